//! The inverse of [`super::layout`]: arrays that hold numbers, groups, blocks and partial fields become those again.
//!
//! An array under one of the reserved names that does not hold what it should, because another program made it or
//! changed the mesh around it, stays an array like any other.

use super::cells::{block_code, written_kind};
use super::layout::{
    BLOCKS, CELL_TAG, ENTITY, FIELD_ARRAYS, FIELD_AT, FIELD_NAMES, FIELD_TIMES, FIELDS, GEOMETRY,
    GROUP, GROUP_NAMES, GROUPS, NO_GROUP, POINT_TAG,
};
use super::merge::{Piece, select};
use super::xml::MAX_ARRAYS_IN_SECTION;
use crate::field::{GlobalArray, GlobalValues, to_i64};
use crate::io::rows;
use crate::mesh::{CellBlock, Field, Geometry, Group, Mesh, Support, Values};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// The mesh that the arrays describe, and the remaining global arrays.
pub(crate) fn restore(merged: Piece, mut whole: Vec<GlobalArray>) -> (Mesh, Vec<GlobalArray>) {
    let mut mesh = Mesh {
        points: merged.points,
        blocks: merged.blocks,
        polyhedra: merged.polyhedra,
        fields: merged.fields,
        ..Mesh::default()
    };
    mesh.fields.sort_by_key(|field| field.on);
    let own_tags = |values: &Values| match values {
        Values::U64(tags) => Some(tags.to_vec()),
        other => to_i64(other)?
            .into_iter()
            .map(|tag| tag.try_into().ok())
            .collect(),
    };
    if let Some(tags) = take_array(&mut mesh, Support::Points, POINT_TAG, own_tags) {
        mesh.point_tags = tags;
    }
    let tags = take_array(&mut mesh, Support::Cells, CELL_TAG, own_tags);
    let entities = take_array(&mut mesh, Support::Cells, ENTITY, |values| {
        let numbers = to_i64(values)?.into_iter();
        numbers.map(|entity| entity.try_into().ok()).collect()
    });
    restore_blocks(&mut mesh.blocks, &mut whole, tags, entities);
    restore_groups(&mut mesh, &mut whole);
    restore_fields(&mut mesh, &mut whole);
    restore_geometry(&mut mesh, &mut whole);
    (mesh, whole)
}

/// The geometry, if it is one of this mesh.
fn restore_geometry(mesh: &mut Mesh, whole: &mut Vec<GlobalArray>) {
    let text = find_texts(whole, GEOMETRY).and_then(|texts| texts.first());
    let Some(geometry) = text.and_then(|text| serde_json::from_str(text).ok()) else {
        return;
    };
    mesh.geometry = geometry;
    match mesh.validate_geometry() {
        Ok(()) => remove(whole, &[GEOMETRY]),
        Err(_) => mesh.geometry = Geometry::default(),
    }
}

/// Removes an array of one component if it has this name, and `get` understands its values.
fn take_array<T>(
    mesh: &mut Mesh,
    on: Support,
    name: &str,
    get: impl Fn(&Values) -> Option<T>,
) -> Option<T> {
    let fits = |field: &Field| (field.on, &*field.name, field.components) == (on, name, 1);
    let at = mesh.fields.iter().position(fits)?;
    let values = get(&mesh.fields[at].values)?;
    mesh.fields.remove(at);
    Some(values)
}

fn find_whole<'a>(whole: &'a [GlobalArray], name: &str) -> Option<&'a GlobalValues> {
    whole
        .iter()
        .find(|array| array.name == name)
        .map(|array| &array.values)
}

fn find_numbers(whole: &[GlobalArray], name: &str) -> Option<Vec<i64>> {
    match find_whole(whole, name)? {
        GlobalValues::Numbers(numbers) => to_i64(numbers),
        GlobalValues::Text(_) => None,
    }
}

fn find_texts<'a>(whole: &'a [GlobalArray], name: &str) -> Option<&'a [String]> {
    match find_whole(whole, name)? {
        GlobalValues::Numbers(_) => None,
        GlobalValues::Text(texts) => Some(texts),
    }
}

fn remove(whole: &mut Vec<GlobalArray>, names: &[&str]) {
    whole.retain(|array| !names.contains(&array.name.as_str()));
}

fn restore_blocks(
    blocks: &mut Vec<CellBlock>,
    whole: &mut Vec<GlobalArray>,
    tags: Option<Vec<u64>>,
    entities: Option<Vec<i32>>,
) {
    let rows = find_numbers(whole, BLOCKS).unwrap_or_default();
    let rows = rows.as_chunks().0;
    let flags = if are_runs(rows, blocks) {
        *blocks = split_blocks(std::mem::take(blocks), rows);
        remove(whole, &[BLOCKS]);
        rows.iter()
            .map(|&[_, _, tags, entities]| (tags != 0, entities != 0))
            .collect()
    } else {
        vec![(true, true); blocks.len()]
    };
    let mut start = 0;
    for (block, (has_tags, has_entities)) in blocks.iter_mut().zip(flags) {
        let cells = start..start + block.len();
        start = cells.end;
        if let Some(tags) = tags.as_ref().filter(|_| has_tags) {
            block.tags = tags.get(cells.clone()).unwrap_or_default().to_vec();
        }
        if let Some(entities) = entities.as_ref().filter(|_| has_entities) {
            block.entities = entities.get(cells).unwrap_or_default().to_vec();
        }
    }
}

/// Whether the rows agree with the runs of cells in type and number.
fn are_runs(rows: &[[i64; 4]], runs: &[CellBlock]) -> bool {
    let mut runs = runs.iter().map(|run| (run.kind, run.len())).peekable();
    for &[code, cells, _, _] in rows {
        let (Some(kind), Ok(cells)) = (written_kind(code), usize::try_from(cells)) else {
            return false;
        };
        if cells == 0 {
            continue;
        }
        match runs.peek_mut() {
            Some((found, left)) if block_code(*found) == block_code(kind) && cells <= *left => {
                *left -= cells;
                if *left == 0 {
                    runs.next();
                }
            }
            _ => return false,
        }
    }
    runs.next().is_none()
}

/// Cuts runs of cells into the blocks of the rows, which agree with them.
fn split_blocks(runs: Vec<CellBlock>, rows: &[[i64; 4]]) -> Vec<CellBlock> {
    let mut runs = runs.into_iter();
    let mut left = Vec::new();
    let mut at = 0;
    let mut blocks = Vec::with_capacity(rows.len());
    for &[code, cells, _, _] in rows {
        let Some(kind) = written_kind(code) else {
            continue;
        };
        let count = cells as usize * kind.points();
        if count > 0 && at == left.len() {
            (left, at) = (
                runs.next().map_or(Vec::new(), |run| run.nodes.into_vec()),
                0,
            );
        }
        // A complete run becomes a block without a copy.
        let nodes = if at == 0 && count == left.len() {
            std::mem::take(&mut left)
        } else {
            at += count;
            left.get(at - count..at).unwrap_or_default().to_vec()
        };
        blocks.push(CellBlock::new(kind, nodes));
    }
    blocks
}

/// Groups from the tags on the cells; the table adds names, empty groups, and the tag that stands for none.
fn restore_groups(mesh: &mut Mesh, whole: &mut Vec<GlobalArray>) {
    let mut groups = BTreeMap::new();
    let table = group_table(whole);
    let none = table.as_ref().map_or(0, |(none, _)| *none);
    if let Some((_, table)) = table {
        let mut shown = HashMap::new();
        for (group, has_array) in table {
            if let Some(name) = group.name.as_ref().filter(|_| has_array) {
                shown.insert(name.clone(), vec![group.tag, group.dim.into()]);
            }
            groups.insert((group.dim, group.tag), group);
        }
        remove(whole, &[GROUPS, GROUP_NAMES, NO_GROUP]);
        whole.retain(|array| match (&array.values, shown.get(&array.name)) {
            (GlobalValues::Numbers(Values::I64(numbers)), Some(of_group)) => numbers != of_group,
            _ => true,
        });
    }
    let of_groups = |field: &Field| field.on == Support::Cells && field.name == GROUP;
    if let Some(place) = mesh.fields.iter().position(of_groups) {
        let field = mesh.fields.remove(place);
        if let Values::I32(tags) = &field.values {
            group_cells(&mesh.blocks, tags, none, &mut groups);
        } else if let Some(tags) = to_i64(&field.values) {
            group_cells(&mesh.blocks, &tags, none, &mut groups);
        } else {
            // Values that are not tags are a field.
            mesh.fields.insert(place, field);
        }
    }
    mesh.groups = groups.into_values().collect();
}

/// Puts cells into the groups whose tags each has in its row; the tag `none` stands for none.
fn group_cells<T: Copy + PartialEq + Sync + Into<i64>>(
    blocks: &[CellBlock],
    tags: &[T],
    none: i64,
    groups: &mut BTreeMap<(u8, i64), Group>,
) {
    let all = blocks.iter().map(CellBlock::len).sum::<usize>();
    let Some(components) = tags.len().checked_div(all).filter(|&count| count > 0) else {
        return;
    };
    let mut join = |dim: u8, tag: i64, cells: Range<u32>| {
        let group = groups.entry((dim, tag));
        let group = group.or_insert_with(|| Group::new(dim, tag));
        // A row may name a group twice.
        if group.cells.last().is_none_or(|&last| last < cells.start) {
            group.cells.extend(cells);
        }
    };
    let mut rest = tags;
    let mut first = 0;
    for block in blocks {
        let (mine, others) = rest.split_at(block.len() * components);
        rest = others;
        for run in rows::runs(mine, components) {
            let row = mine[run.start as usize * components..].iter();
            let tags = row.take(components).map(|&tag| tag.into());
            let cells = first + run.start..first + run.end;
            tags.filter(|&tag| tag != none)
                .for_each(|tag| join(block.kind.dim(), tag, cells.clone()));
        }
        first += block.len() as u32;
    }
}

/// The tag that stands for none; and groups without cells, with whether an array has the name of each.
fn group_table(whole: &[GlobalArray]) -> Option<(i64, Vec<(Group, bool)>)> {
    let none = find_numbers(whole, NO_GROUP)?.first().copied()?;
    let rows = find_numbers(whole, GROUPS)?;
    let rows = rows.as_chunks::<3>().0;
    let names = find_texts(whole, GROUP_NAMES)?;
    if rows.len() != names.len() {
        return None;
    }
    let groups = rows.iter().zip(names).map(|(&[dim, tag, named], name)| {
        let dim = u8::try_from(dim).ok().filter(|&dim| dim <= 3)?;
        let mut group = Group::new(dim, tag);
        group.name = (named != 0).then(|| name.clone());
        Some((group, named == 2))
    });
    Some((none, groups.collect::<Option<_>>()?))
}

/// One row of the table of fields.
struct FieldRow {
    on: Support,
    array: String,
    name: String,
    time: Option<f64>,
    step: Option<i32>,
    at: Vec<u32>,
}

fn restore_fields(mesh: &mut Mesh, whole: &mut Vec<GlobalArray>) {
    let Some(rows) = field_table(whole) else {
        return;
    };
    remove(
        whole,
        &[FIELDS, FIELD_ARRAYS, FIELD_NAMES, FIELD_TIMES, FIELD_AT],
    );
    let fields = mesh.fields.iter().enumerate();
    let places: HashMap<(Support, String), usize> = fields
        .map(|(place, field)| ((field.on, field.name.clone()), place))
        .collect();
    for row in rows {
        if row.on == Support::CellPoints {
            restore_cell_points(mesh, whole, row);
            continue;
        }
        let Some(&place) = places.get(&(row.on, row.array)) else {
            continue;
        };
        let field = &mut mesh.fields[place];
        if !row.at.is_empty()
            && field.at.is_empty()
            && row
                .at
                .last()
                .is_none_or(|&last| (last as usize) < field.values.len() / field.components)
        {
            let places = row.at.iter().map(|&at| at as usize);
            field.values = select(&field.values, field.components, places);
            field.at = row.at;
        }
        field.name = row.name;
        field.time = row.time;
        field.step = row.step;
    }
}

fn restore_cell_points(mesh: &mut Mesh, whole: &mut Vec<GlobalArray>, row: FieldRow) {
    let Some(place) = whole.iter().position(|array| array.name == row.array) else {
        return;
    };
    let array = &whole[place];
    if let GlobalValues::Numbers(values) = &array.values {
        let field = Field {
            at: row.at,
            time: row.time,
            step: row.step,
            ..Field::new(row.name, row.on, array.components, values.clone())
        };
        if field.expected_len(mesh) == Some(field.values.len()) {
            whole.remove(place);
            mesh.fields.push(field);
        }
    }
}

fn field_table(whole: &[GlobalArray]) -> Option<Vec<FieldRow>> {
    let rows = find_numbers(whole, FIELDS)?;
    let rows = rows.as_chunks::<5>().0;
    let at = find_numbers(whole, FIELD_AT).unwrap_or_default();
    let at: Vec<u32> = at
        .into_iter()
        .map(|at| at.try_into().ok())
        .collect::<Option<_>>()?;
    let (arrays, names) = (
        find_texts(whole, FIELD_ARRAYS)?,
        find_texts(whole, FIELD_NAMES)?,
    );
    let GlobalValues::Numbers(Values::F64(times)) = find_whole(whole, FIELD_TIMES)? else {
        return None;
    };
    // Rows of fields on the nodes of cells are looked up one by one: bound them by the possible number of arrays.
    if rows.len() > 3 * MAX_ARRAYS_IN_SECTION {
        return None;
    }
    if [arrays.len(), names.len(), times.len()] != [rows.len(); 3] {
        return None;
    }
    let mut rest = at.as_slice();
    let mut table = Vec::with_capacity(rows.len());
    for (index, &[on, timed, stepped, step, count]) in rows.iter().enumerate() {
        let (at, others) = rest.split_at_checked(usize::try_from(count).ok()?)?;
        rest = others;
        if !at.is_sorted_by(|a, b| a < b) {
            return None;
        }
        table.push(FieldRow {
            on: match on {
                0 => Support::Points,
                1 => Support::Cells,
                2 => Support::CellPoints,
                _ => return None,
            },
            array: arrays[index].clone(),
            name: names[index].clone(),
            time: (timed != 0).then_some(times[index]),
            step: if stepped == 0 {
                None
            } else {
                Some(step.try_into().ok()?)
            },
            at: at.to_vec(),
        });
    }
    Some(table)
}
