//! Writes Exodus files.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::{FORMAT, cells};
use crate::error::Result;
use crate::field::{GlobalArray, GlobalValues};
use crate::io::loss::Losses;
use crate::io::netcdf::{Attribute, Type, Writer};
use crate::io::raw::CellNodes;
use crate::io::steps::{Steps, row_of};
use crate::io::{Options, refuse_unsound, vectors};
use crate::mesh::topology::{all_sides, corners, key};
use crate::mesh::{CellGroups, CellKind, Group, Mesh, Support};

/// Bytes of a name, the largest that old readers take.
const NAME: usize = 32;

/// How the cells and groups of a mesh are written.
#[derive(Default)]
struct Plan<'a> {
    blocks: Vec<Block<'a>>,
    element_sets: Vec<&'a Group>,
    node_sets: Vec<&'a Group>,
    /// With the cell and the number of each side.
    side_sets: Vec<(&'a Group, Vec<(u32, usize)>)>,
}

struct Block<'a> {
    kind: CellKind,
    cells: Vec<u32>,
    /// The groups that all of them are in.
    of: Vec<u32>,
    /// The one group that consists of these cells.
    group: Option<&'a Group>,
    tag: i64,
}

pub fn write(
    path: &Path,
    mesh: &Mesh,
    whole: &[GlobalArray],
    options: &Options,
) -> Result<Vec<String>> {
    refuse_unsound(path, mesh)?;
    let mut losses = Losses::default();
    let dimension = dimension(mesh);
    let plan = plan(mesh, dimension, &mut losses)?;
    let mut numbers = vec![0; mesh.cell_count()];
    let order = plan.blocks.iter().flat_map(|block| &block.cells);
    order
        .zip(1..)
        .for_each(|(&cell, number)| numbers[cell as usize] = number);
    let steps = Steps::of(&mesh.fields, &mut losses);
    let times = if steps.times.is_empty() {
        vec![0.0]
    } else {
        steps.times.clone()
    };
    let has_fields = !steps.fields.is_empty() || !whole.is_empty();

    let mut out = Writer::default();
    for (name, value) in [
        ("api_version", Attribute::Float(5.1)),
        ("version", Attribute::Float(5.1)),
        ("floating_point_word_size", Attribute::Int(8)),
        ("file_size", Attribute::Int(1)),
        ("title", Attribute::Text("faceoff".into())),
    ] {
        out.attribute(name, value);
    }
    let width = longest(mesh, &steps, whole).max(NAME) + 1;
    out.dimension("len_string", NAME + 1);
    out.dimension("len_name", width);
    out.dimension("len_line", 81);
    out.dimension("four", 4);
    out.dimension("num_dim", dimension);
    out.dimension("num_nodes", mesh.points.len());
    out.dimension("time_step", 0);
    if has_fields {
        out.records(times.len());
        out.floats("time_whole", &["time_step"], |step, _| times[step]);
    }
    let axes = ["x", "y", "z"][..dimension]
        .iter()
        .map(|&axis| axis.to_owned());
    out.texts(
        "coor_names",
        &["num_dim", "len_name"],
        axes.collect(),
        width,
    );
    for (axis, name) in ["coordx", "coordy", "coordz"]
        .into_iter()
        .enumerate()
        .take(dimension)
    {
        out.floats(name, &["num_nodes"], move |_, k| mesh.points[k][axis]);
    }
    write_blocks(&mut out, mesh, &plan, dimension, width);
    write_sets(&mut out, mesh, &plan, &numbers, width);
    write_numbers(&mut out, mesh, &plan, &mut losses);
    write_fields(&mut out, &plan, &steps, width, &mut losses);
    write_whole(&mut out, whole, times.len(), width, &mut losses);
    let warnings = losses.settle(path, FORMAT.title, options.lossy)?;
    out.save(path)?;
    Ok(warnings)
}

/// The fewest coordinates that hold the mesh.
fn dimension(mesh: &Mesh) -> usize {
    let flat = |axis: usize| mesh.points.iter().all(|point| point[axis] == 0.0);
    match mesh.dim() {
        0 | 1 if flat(2) && flat(1) => 1,
        0..=2 if flat(2) => 2,
        _ => 3,
    }
}

/// Bytes of the longest name.
fn longest(mesh: &Mesh, steps: &Steps<'_>, whole: &[GlobalArray]) -> usize {
    let groups = mesh
        .groups
        .iter()
        .filter_map(|group| group.name.as_ref())
        .map(String::len);
    let fields = steps.fields.iter().map(|field| field.name.len() + 4);
    groups
        .chain(fields)
        .chain(whole.iter().map(|data| data.name.len()))
        .max()
        .unwrap_or(0)
}

/// The element type of a kind in a space.
fn element(kind: CellKind, dimension: usize) -> Option<String> {
    let name = cells::name(kind)?;
    Some(match dimension {
        3 => name.replace("QUAD", "SHELL"),
        _ => name,
    })
}

fn plan<'a>(mesh: &'a Mesh, dimension: usize, losses: &mut Losses) -> Result<Plan<'a>> {
    let dim = mesh.dim();
    let mut carries = vec![false; mesh.cell_count()];
    for field in mesh
        .fields
        .iter()
        .filter(|field| field.on == Support::Cells)
    {
        let values = field.values.to_f64();
        for (k, row) in values.chunks(field.components.max(1)).enumerate() {
            let cell = field.at.get(k).map_or(k, |&cell| cell as usize);
            carries[cell] |= row.iter().any(|value| !value.is_nan());
        }
    }
    let mut plan = Plan::default();
    let mut others: Vec<u32> = Vec::new();
    let mut in_sets = vec![false; mesh.cell_count()];
    let owners = owners(mesh, dim)?;
    for (group, k) in mesh.groups.iter().zip(0..) {
        let free = group.dim < dim && !group.cells.iter().any(|&cell| carries[cell as usize]);
        let sides = match free && group.dim + 1 == dim && dim > 1 {
            true => sides_of(mesh, group, &owners, dimension),
            false => None,
        };
        if let Some(sides) = sides {
            plan.side_sets.push((group, sides));
        } else if free && group.dim == 0 {
            plan.node_sets.push(group);
        } else {
            others.push(k);
            continue;
        }
        group
            .cells
            .iter()
            .for_each(|&cell| in_sets[cell as usize] = true);
    }
    let sides = plan
        .side_sets
        .iter()
        .flat_map(|(group, sides)| group.cells.iter().copied().zip(sides.iter().copied()));
    losses.note_twice(sides);
    let sets = CellGroups::new(mesh);
    let kept = |set: &Vec<u32>| -> Vec<u32> {
        set.iter()
            .copied()
            .filter(|k| others.binary_search(k).is_ok())
            .collect()
    };
    let kept: Vec<Vec<u32>> = sets.sets.iter().map(kept).collect();
    let mut places: HashMap<(CellKind, &[u32]), usize> = HashMap::new();
    let mut ends = mesh.blocks.iter().scan(0, |end, block| {
        *end += block.len() as u32;
        Some((block.kind, *end))
    });
    let (mut kind, mut end) = (CellKind::Vertex, 0);
    // The block of the last cell, which is mostly that of the next.
    let mut last: Option<(CellKind, u32, usize)> = None;
    for (cells, set) in sets.runs_from(0) {
        let groups = kept[set as usize].as_slice();
        for cell in cells {
            while cell >= end {
                let Some(next) = ends.next() else { break };
                (kind, end) = next;
            }
            if groups.is_empty() && in_sets[cell as usize] {
                continue;
            }
            if last.is_none_or(|(of, in_set, _)| (of, in_set) != (kind, set)) {
                let place = *places.entry((kind, groups)).or_insert_with(|| {
                    plan.blocks.push(Block {
                        kind,
                        cells: Vec::new(),
                        group: None,
                        of: groups.to_vec(),
                        tag: NO_TAG,
                    });
                    plan.blocks.len() - 1
                });
                last = Some((kind, set, place));
            }
            if let Some((.., place)) = last {
                plan.blocks[place].cells.push(cell);
            }
        }
    }
    for block in &mut plan.blocks {
        let mut groups = block.of.iter().map(|&k| &mesh.groups[k as usize]);
        block.group = groups.find(|group| group.cells.len() == block.cells.len());
    }
    let unknown = plan
        .blocks
        .iter()
        .filter(|block| element(block.kind, dimension).is_none());
    let unknown: Vec<CellKind> = unknown.map(|block| block.kind).collect();
    for kind in unknown {
        losses.lose(format!("{kind} cells"));
    }
    plan.blocks
        .retain(|block| element(block.kind, dimension).is_some());
    if plan.blocks.iter().any(|block| block.group.is_none()) {
        losses.note(
            "cells in no group or in several are blocks, which are groups when they are read again",
        );
    }
    number(mesh, &mut plan, &others, losses);
    Ok(plan)
}

const NO_TAG: i64 = -1;

/// Gives the blocks their numbers, and the groups that are none to element sets.
fn number<'a>(mesh: &'a Mesh, plan: &mut Plan<'a>, others: &[u32], losses: &mut Losses) {
    let fits = |tag: i64| tag >= 0 && i32::try_from(tag).is_ok();
    let mut taken: HashSet<i64> = HashSet::new();
    for block in &mut plan.blocks {
        let tag = block.group.map_or(NO_TAG, |group| group.tag);
        block.tag = if fits(tag) && taken.insert(tag) {
            tag
        } else {
            NO_TAG
        };
    }
    let mut next = mesh
        .groups
        .iter()
        .map(|group| group.tag)
        .filter(|&tag| fits(tag))
        .max()
        .unwrap_or(0);
    for block in plan.blocks.iter_mut().filter(|block| block.tag == NO_TAG) {
        next += 1;
        block.tag = next;
        if let Some(group) = block.group {
            losses.note(format!(
                "the group {} of dimension {} is numbered {next}",
                group.tag, group.dim
            ));
        }
    }
    let is_block = |group: &Group| {
        plan.blocks
            .iter()
            .any(|block| block.group.is_some_and(|g| std::ptr::eq(g, group)))
    };
    plan.element_sets = others
        .iter()
        .map(|&k| &mesh.groups[k as usize])
        .filter(|group| !is_block(group))
        .collect();
    let numbered = plan.node_sets.iter().chain(&plan.element_sets);
    let odd = numbered
        .chain(plan.side_sets.iter().map(|(group, _)| group))
        .filter(|group| !fits(group.tag));
    losses.lose_some(
        odd.count(),
        "numbers of groups that are negative or exceed 32 bits",
    );
}

type Owners = HashMap<[u32; 4], u32>;

/// A cell of the highest dimension behind each of its sides.
fn owners(mesh: &Mesh, dim: u8) -> Result<Owners> {
    let needed = mesh
        .groups
        .iter()
        .any(|group| group.dim + 1 == dim && dim > 1);
    let sides = if needed {
        all_sides(mesh, dim)?
    } else {
        Vec::new()
    };
    Ok(sides
        .into_iter()
        .rev()
        .map(|side| (side.key, side.cell))
        .collect())
}

/// The cells of a group as sides of others; none if one is not.
fn sides_of(
    mesh: &Mesh,
    group: &Group,
    owners: &Owners,
    dimension: usize,
) -> Option<Vec<(u32, usize)>> {
    let side = |&cell: &u32| {
        let (kind, nodes) = mesh.cell(cell)?;
        let of = corners(kind, nodes)?;
        let wanted = key(of.iter().copied());
        let owner = *owners.get(&wanted)?;
        let (kind, nodes) = mesh.cell(owner)?;
        element(kind, dimension)?;
        let all = cells::sides(kind.shape(), dimension == 3);
        let number = all
            .iter()
            .position(|side| key(side.iter().map(|&k| nodes[k])) == wanted)?;
        Some((owner, number + 1))
    };
    group.cells.iter().map(side).collect()
}

fn names<'a>(groups: impl Iterator<Item = Option<&'a Group>>) -> Vec<String> {
    groups
        .map(|group| {
            group
                .and_then(|group| group.name.clone())
                .unwrap_or_default()
        })
        .collect()
}

fn write_blocks<'a>(
    out: &mut Writer<'a>,
    mesh: &'a Mesh,
    plan: &'a Plan<'a>,
    dimension: usize,
    width: usize,
) {
    let blocks = &plan.blocks;
    out.dimension(
        "num_elem",
        blocks.iter().map(|block| block.cells.len()).sum(),
    );
    if blocks.is_empty() {
        return;
    }
    out.dimension("num_el_blk", blocks.len());
    out.integers("eb_status", &["num_el_blk"], |_| 1);
    out.integers("eb_prop1", &["num_el_blk"], |k| blocks[k].tag);
    out.of_last("name", Attribute::Text("ID".into()));
    out.texts(
        "eb_names",
        &["num_el_blk", "len_name"],
        names(blocks.iter().map(|block| block.group)),
        width,
    );
    for (k, block) in blocks.iter().enumerate() {
        let [count, nodes] =
            ["num_el_in_blk", "num_nod_per_el"].map(|name| format!("{name}{}", k + 1));
        let points = block.kind.points();
        out.dimension(&count, block.cells.len());
        out.dimension(&nodes, points);
        let order = match cells::order(block.kind) {
            Some(order) => Cow::Borrowed(order),
            None => (0..points).collect(),
        };
        let cells = CellNodes::of_cells(mesh, &block.cells, order, false);
        let (name, shape) = (format!("connect{}", k + 1), [&*count, &*nodes]);
        out.variable(&name, &shape, Type::Int, move |_, first, bytes| {
            cells.put(first, bytes, |node| (node + 1).to_be_bytes());
        });
        let element = element(block.kind, dimension).unwrap_or_default();
        out.of_last("elem_type", Attribute::Text(element));
    }
}

fn write_sets<'a>(
    out: &mut Writer<'a>,
    mesh: &'a Mesh,
    plan: &'a Plan<'a>,
    numbers: &'a [i64],
    width: usize,
) {
    let number = |cell: u32| numbers[cell as usize];
    let head = |out: &mut Writer<'a>, word: &str, count: &str, groups: Vec<&'a Group>| {
        out.dimension(count, groups.len());
        let sizes: Vec<i64> = groups
            .iter()
            .map(|group| i64::from(!group.cells.is_empty()))
            .collect();
        out.integers(&format!("{word}_status"), &[count], move |k| sizes[k]);
        out.texts(
            &format!("{word}_names"),
            &[count, "len_name"],
            names(groups.iter().map(|&group| Some(group))),
            width,
        );
        out.integers(&format!("{word}_prop1"), &[count], move |k| groups[k].tag);
        out.of_last("name", Attribute::Text("ID".into()));
    };
    if !plan.side_sets.is_empty() {
        head(
            out,
            "ss",
            "num_side_sets",
            plan.side_sets.iter().map(|(group, _)| *group).collect(),
        );
    }
    for (k, (_, sides)) in plan
        .side_sets
        .iter()
        .enumerate()
        .filter(|(_, (_, sides))| !sides.is_empty())
    {
        let count = format!("num_side_ss{}", k + 1);
        out.dimension(&count, sides.len());
        out.integers(&format!("elem_ss{}", k + 1), &[&count], move |k| {
            number(sides[k].0)
        });
        out.integers(&format!("side_ss{}", k + 1), &[&count], |k| {
            sides[k].1 as i64
        });
    }
    if !plan.node_sets.is_empty() {
        head(out, "ns", "num_node_sets", plan.node_sets.clone());
    }
    let filled = |sets: &[&'a Group]| -> Vec<(usize, &'a Group)> {
        (1..)
            .zip(sets.iter().copied())
            .filter(|(_, group)| !group.cells.is_empty())
            .collect()
    };
    for (k, group) in filled(&plan.node_sets) {
        let count = format!("num_nod_ns{k}");
        out.dimension(&count, group.cells.len());
        let node = move |k: usize| {
            mesh.cell(group.cells[k])
                .map_or(0, |(_, nodes)| i64::from(nodes[0]) + 1)
        };
        out.integers(&format!("node_ns{k}"), &[&count], node);
    }
    if !plan.element_sets.is_empty() {
        head(out, "els", "num_elem_sets", plan.element_sets.clone());
    }
    for (k, group) in filled(&plan.element_sets) {
        // Cells of kinds that Exodus has not, which are lost, have no number.
        let members: Vec<i64> = group
            .cells
            .iter()
            .map(|&cell| number(cell))
            .filter(|&n| n > 0)
            .collect();
        if !members.is_empty() {
            let count = format!("num_ele_els{k}");
            out.dimension(&count, members.len());
            out.integers(&format!("elem_els{k}"), &[&count], move |k| members[k]);
        }
    }
}

/// The mesh's own numbers of points and cells.
fn write_numbers<'a>(out: &mut Writer<'a>, mesh: &'a Mesh, plan: &Plan<'_>, losses: &mut Losses) {
    let sound = |numbers: &[u64]| {
        let mut seen = HashSet::new();
        numbers
            .iter()
            .all(|&n| n > 0 && i32::try_from(n).is_ok() && seen.insert(n))
    };
    let tags = &mesh.point_tags;
    if !tags.is_empty() && sound(tags) {
        out.integers("node_num_map", &["num_nodes"], |k| tags[k] as i64);
    }
    let has_tags = mesh.blocks.iter().any(|block| !block.tags.is_empty());
    let all: Vec<u64> = if has_tags {
        mesh.cell_tags().collect()
    } else {
        Vec::new()
    };
    let order = plan.blocks.iter().flat_map(|block| &block.cells);
    let tags: Vec<u64> = order
        .filter_map(|&cell| all.get(cell as usize).copied())
        .collect();
    if !tags.is_empty() && sound(&tags) {
        out.integers("elem_num_map", &["num_elem"], move |k| tags[k] as i64);
    }
    losses.note_geometry(mesh);
}

fn write_fields<'a>(
    out: &mut Writer<'a>,
    plan: &'a Plan<'a>,
    steps: &'a Steps<'a>,
    width: usize,
    losses: &mut Losses,
) {
    let on = |support: Support| {
        steps
            .fields
            .iter()
            .filter(move |field| field.on == support)
            .collect::<Vec<_>>()
    };
    for field in on(Support::CellPoints) {
        losses.lose_field(field.name, field.on);
    }
    for (support, names, count) in [
        (Support::Points, "name_nod_var", "num_nod_var"),
        (Support::Cells, "name_elem_var", "num_elem_var"),
    ] {
        let all: Vec<String> = on(support)
            .iter()
            .flat_map(|field| vectors::names(field.first(), usize::MAX, losses))
            .collect();
        if !all.is_empty() {
            out.dimension(count, all.len());
            out.texts(names, &[count, "len_name"], all, width);
        }
    }
    let mut number = 0;
    for field in on(Support::Points) {
        for component in 0..field.components {
            number += 1;
            out.floats(
                &format!("vals_nod_var{number}"),
                &["time_step", "num_nodes"],
                move |step, k| field.value(step, k, component),
            );
        }
    }
    let on_cells = on(Support::Cells);
    let has = |block: &Block<'_>, field: &crate::io::steps::Stepped<'_>| {
        field.at().is_none_or(|at| {
            block
                .cells
                .iter()
                .any(|&cell| row_of(at, cell as usize).is_some())
        })
    };
    let mut table: Vec<i64> = Vec::new();
    for (b, block) in plan.blocks.iter().enumerate() {
        let mut number = 0;
        for field in &on_cells {
            let there = has(block, field);
            for component in 0..field.components {
                number += 1;
                table.push(there.into());
                if there {
                    let name = format!("vals_elem_var{number}eb{}", b + 1);
                    let count = format!("num_el_in_blk{}", b + 1);
                    let field = *field;
                    out.floats(&name, &["time_step", &count], move |step, k| {
                        field.value(step, block.cells[k] as usize, component)
                    });
                }
            }
        }
    }
    if !table.is_empty() {
        out.integers("elem_var_tab", &["num_el_blk", "num_elem_var"], move |k| {
            table[k]
        });
    }
}

/// Data about the whole that are one number, or one at each time.
fn write_whole<'a>(
    out: &mut Writer<'a>,
    whole: &'a [GlobalArray],
    steps: usize,
    width: usize,
    losses: &mut Losses,
) {
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for data in whole {
        match &data.values {
            GlobalValues::Numbers(values)
                if data.components == 1 && [1, steps].contains(&values.len()) =>
            {
                columns.push((data.name.clone(), values.to_f64()));
            }
            _ => losses.lose(format!(
                "the data {:?} about the mesh as a whole",
                data.name
            )),
        }
    }
    if columns.is_empty() {
        return;
    }
    out.dimension("num_glo_var", columns.len());
    let names = columns.iter().map(|(name, _)| name.clone()).collect();
    out.texts("name_glo_var", &["num_glo_var", "len_name"], names, width);
    out.floats(
        "vals_glo_var",
        &["time_step", "num_glo_var"],
        move |step, k| {
            let values = &columns[k].1;
            values
                .get(step)
                .or(values.first())
                .copied()
                .unwrap_or(f64::NAN)
        },
    );
}
