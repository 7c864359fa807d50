//! Writes Exodus files.

mod plan;

use std::collections::HashSet;

use super::cells;
use crate::error::Result;
use crate::field::{GlobalArray, GlobalValues};
use crate::io::loss::Losses;
use crate::io::netcdf::{Attribute, Writer};
use crate::io::raw::CellNodes;
use crate::io::scalar::Number;
use crate::io::steps::{Steps, row_of};
use crate::io::{Job, vectors};
use crate::mesh::{CellKind, Group, Mesh, Support};

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

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        whole,
        mut losses,
        ..
    } = job;
    let dimension = dimension(mesh);
    let plan = plan::plan(mesh, dimension, &mut losses)?;
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
    losses.settle(path, || out.save(path))
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
        let order = cells::order(block.kind);
        let cells = CellNodes::of_cells(mesh, &block.cells, order, false);
        let (name, shape) = (format!("connect{}", k + 1), [&*count, &*nodes]);
        out.variable(&name, &shape, Number::I32, move |_, first, bytes| {
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
