//! Labels, as FreeFEM and Medit have them: one number for each cell and each vertex, 0 for none.

use std::collections::BTreeMap;

use super::loss::Losses;
use crate::mesh::{CellGroups, CellKind, Field, Group, Mesh, Support, Values};

/// The name of the field that holds the labels of points.
pub const POINT_LABEL: &str = "label";

/// The groups that labels stand for. Each item is the dimension of some cells and their labels; cells are counted
/// through all items.
pub fn group_cells(items: &[(u8, &[i32])]) -> Vec<Group> {
    let mut groups: BTreeMap<(u8, i64), Vec<u32>> = BTreeMap::new();
    let mut cell = 0u32;
    for (dim, labels) in items {
        let mut last: Option<(i32, Vec<u32>)> = None;
        for &label in *labels {
            if let Some((value, cells)) = &mut last
                && *value == label
            {
                cells.push(cell);
            } else {
                if let Some((value, cells)) = last.take() {
                    groups
                        .entry((*dim, i64::from(value)))
                        .or_default()
                        .extend(cells);
                }
                last = Some((label, vec![cell]));
            }
            cell += 1;
        }
        if let Some((value, cells)) = last {
            groups
                .entry((*dim, i64::from(value)))
                .or_default()
                .extend(cells);
        }
    }
    let labelled = groups.into_iter().filter(|((_, tag), _)| *tag != 0);
    labelled
        .map(|((dim, tag), cells)| Group {
            dim,
            tag,
            name: None,
            cells,
        })
        .collect()
}

/// The one label of each cell.
pub struct CellLabels<'a> {
    mesh: &'a Mesh,
    groups: CellGroups,
    of_set: Vec<i32>,
}

impl<'a> CellLabels<'a> {
    pub fn new(mesh: &'a Mesh, losses: &mut Losses) -> Self {
        let groups = CellGroups::new(mesh);
        let (first, many) = groups.single();
        losses.lose_some(many, "cells that are in several groups");
        let mut bad = 0;
        for group in &mesh.groups {
            bad += usize::from(group.tag == 0 || i32::try_from(group.tag).is_err());
        }
        losses.lose_some(bad, "groups whose number is 0 or exceeds 32 bits");
        let empty = mesh
            .groups
            .iter()
            .filter(|group| group.cells.is_empty())
            .count();
        losses.lose_some(empty, "groups without cells");
        let tag = |first: Option<u32>| {
            let group = first.and_then(|group| mesh.groups.get(group as usize));
            group
                .and_then(|group| i32::try_from(group.tag).ok())
                .unwrap_or(0)
        };
        let of_set = first.into_iter().map(tag).collect();
        CellLabels {
            mesh,
            groups,
            of_set,
        }
    }

    pub fn of(&self, cell: u32) -> i32 {
        let set = self.groups.set_of(cell);
        self.of_set.get(set as usize).copied().unwrap_or(0)
    }

    pub fn lose_names(&self, losses: &mut Losses) {
        let named = self
            .mesh
            .groups
            .iter()
            .filter_map(|group| group.name.as_ref());
        let names: Vec<String> = named.map(|name| format!("{name:?}")).collect();
        if !names.is_empty() {
            losses.lose(format!("the group names {}", names.join(", ")));
        }
    }
}

/// The labels of points: those of the field of that name, or else those of the vertex cells; empty if all are 0.
/// Other fields are lost.
pub fn point_labels(mesh: &Mesh, cells: &CellLabels<'_>, losses: &mut Losses) -> Vec<i32> {
    let mut labels = None;
    for field in &mesh.fields {
        match (&field.values, labels.is_none()) {
            (Values::I32(values), true) if is_label(field) => labels = Some(values.clone()),
            // Another format may have turned integers into floating-point numbers.
            (Values::F64(values), true)
                if is_label(field) && values.iter().all(|&v| f64::from(v as i32) == v) =>
            {
                labels = Some(values.iter().map(|&v| v as i32).collect());
            }
            _ => losses.lose(format!("the field {:?} on {}", field.name, field.on)),
        }
    }
    let mut labels = labels.unwrap_or_default();
    let (mut dropped, mut turned) = (0, 0);
    for (cell, _, nodes) in mesh
        .cells()
        .filter(|(_, kind, _)| *kind == CellKind::Vertex)
    {
        let (label, point) = (
            cells.of(cell),
            nodes.first().map_or(0, |&node| node as usize),
        );
        labels.resize(mesh.points.len(), 0);
        match labels.get_mut(point) {
            Some(place) if label != 0 && (*place == 0 || *place == label) => {
                *place = label;
                turned += 1;
            }
            _ => dropped += 1,
        }
    }
    losses.lose_some(
        dropped,
        "vertex cells that are in no group or lie on a point with another label",
    );
    if turned > 0 {
        losses.note(format!(
            "{turned} vertex cells become labels of their points"
        ));
    }
    labels
}

fn is_label(field: &Field) -> bool {
    field.name == POINT_LABEL
        && field.on == Support::Points
        && field.components == 1
        && field.at.is_empty()
}

/// The label of one point.
pub fn point_labels_of(labels: &[i32], point: usize) -> i32 {
    labels.get(point).copied().unwrap_or(0)
}
