//! Labels, as FreeFEM and Medit have them: one number for each cell and each vertex, 0 for none.

use std::collections::BTreeMap;

use super::loss::Losses;
use super::out::Out;
use super::raw::{Nodes, RawNumbers, points_of_rows};
use super::rows;
use super::scalar::Scalar;
use super::scan::{Numbers, Scan};
use crate::error::Result;
use crate::mesh::{Array, CellBlock, CellGroups, CellKind, Field, Group, Mesh, Support, Values};

/// The name of the field that holds the labels of points.
const POINT_LABEL: &str = "label";

/// A mesh that is being read from rows that end in a label.
#[derive(Default)]
pub struct Rows {
    points: Array<[f64; 3]>,
    labels: Vec<i32>,
    /// With the label of each cell.
    blocks: Vec<(CellBlock, Vec<i32>)>,
}

impl Rows {
    /// Reads points of one to three coordinates.
    pub fn points(&mut self, scan: &mut Scan<'_>, count: usize, dimension: usize) -> Result<()> {
        let row = scan.row_bytes(1, dimension);
        let found = match (scan.numbers, scan.single, scan.wide) {
            (Numbers::Ascii, ..) => None,
            (_, true, false) => points_of::<f32, i32>(scan, count, dimension),
            (_, true, true) => points_of::<f32, i64>(scan, count, dimension),
            (_, false, false) => points_of::<f64, i32>(scan, count, dimension),
            (_, false, true) => points_of::<f64, i64>(scan, count, dimension),
        };
        if let Some(found) = found {
            (self.points, self.labels) = found;
            scan.advance(count * row);
            return Ok(());
        }
        let points = self.points.to_mut();
        points.reserve(count);
        for _ in 0..count {
            let mut point = [0.0; 3];
            for x in point.iter_mut().take(dimension) {
                *x = scan.real()?;
            }
            points.push(point);
            self.labels.push(label(scan)?);
        }
        Ok(())
    }

    /// Reads cells of the points so far.
    pub fn cells(&mut self, scan: &mut Scan<'_>, count: usize, kind: CellKind) -> Result<()> {
        let (width, points) = (kind.points(), self.points.len());
        let row = scan.row_bytes(width + 1, 0);
        let found = match (scan.numbers, scan.wide) {
            (Numbers::Ascii, _) => None,
            (_, false) => cells_of::<i32>(scan, count, width, points),
            (_, true) => cells_of::<i64>(scan, count, width, points),
        };
        let (nodes, labels) = match found {
            Some(found) => {
                scan.advance(count * row);
                found
            }
            None => {
                let mut nodes = Vec::with_capacity(count * width);
                let mut labels = Vec::with_capacity(count);
                for _ in 0..count {
                    for _ in 0..width {
                        nodes.push(scan.vertex(points)?);
                    }
                    labels.push(label(scan)?);
                }
                (nodes.into(), labels)
            }
        };
        self.blocks.push((CellBlock::of(kind, nodes), labels));
        Ok(())
    }

    /// Swaps two nodes in each of the cells read last.
    pub fn swap(&mut self, a: usize, b: usize) {
        if let Some((block, _)) = self.blocks.last_mut() {
            let cells = block.nodes.to_mut().chunks_exact_mut(block.kind.points());
            cells.for_each(|cell| cell.swap(a, b));
        }
    }

    /// The dimensions of the cells so far.
    pub fn dims(&self) -> impl Iterator<Item = u8> {
        self.blocks.iter().map(|(block, _)| block.kind.dim())
    }

    /// The mesh, with a group for each label of cells.
    pub fn finish(self) -> Mesh {
        let mut mesh = Mesh {
            points: self.points,
            ..Mesh::default()
        };
        if self.labels.iter().any(|&label| label != 0) {
            let labels = Values::I32(self.labels.into());
            mesh.fields
                .push(Field::new(POINT_LABEL, Support::Points, 1, labels));
        }
        let mut groups: BTreeMap<(u8, i64), Group> = BTreeMap::new();
        let mut cell = 0;
        for (block, labels) in self.blocks {
            let dim = block.kind.dim();
            for run in rows::runs(&labels, 1) {
                let tag = i64::from(labels[run.start as usize]);
                let cells = cell + run.start..cell + run.end;
                if tag != 0 {
                    let group = groups.entry((dim, tag));
                    let group = group.or_insert_with(|| Group::new(dim, tag));
                    group.cells.extend(cells);
                }
            }
            cell += block.len() as u32;
            if !block.is_empty() {
                mesh.blocks.push(block);
            }
        }
        mesh.groups = groups.into_values().collect();
        mesh
    }
}

/// Points and labels of a binary file; none where something is wrong, without what and where.
fn points_of<R: Scalar, L: Scalar>(
    scan: &Scan<'_>,
    count: usize,
    dimension: usize,
) -> Option<(Array<[f64; 3]>, Vec<i32>)> {
    let big_endian = scan.numbers == Numbers::Big;
    let row = dimension * R::WIDTH + L::WIDTH;
    let bytes = scan.rest().get(..count * row)?;
    let points = match dimension {
        1 => points_of_rows::<R, 1>(bytes, row, big_endian),
        2 => points_of_rows::<R, 2>(bytes, row, big_endian),
        _ => points_of_rows::<R, 3>(bytes, row, big_endian),
    };
    let sound = points.is_finite().then_some(points);
    sound.zip(labels_of::<L>(bytes, row, big_endian))
}

/// The labels at the end of rows of a given number of bytes.
fn labels_of<L: Scalar>(bytes: &[u8], row: usize, big_endian: bool) -> Option<Vec<i32>> {
    let mut labels = Vec::new();
    let sound = rows::fill(
        &mut labels,
        bytes.len() / row,
        1,
        |first, labels: &mut [i32]| {
            let rows = bytes[first * row..].chunks_exact(row).zip(labels);
            rows.fold(true, |sound, (row, to)| {
                let label = L::each(&row[row.len() - L::WIDTH..], big_endian).next();
                let label = label.unwrap_or_default();
                *to = label.index_from(0).0 as i32;
                sound & (L::WIDTH == 4 || f64::from(*to) == label.float())
            })
        },
    );
    sound.then_some(labels)
}

/// [`points_of`] for the nodes of cells.
fn cells_of<L: Scalar>(
    scan: &Scan<'_>,
    count: usize,
    width: usize,
    points: usize,
) -> Option<(Array<u32>, Vec<i32>)> {
    let row = (width + 1) * L::WIDTH;
    let bytes = scan.rest().get(..count * row)?;
    let numbers = RawNumbers {
        number: L::TYPE,
        bytes: bytes.into(),
        big_endian: scan.numbers == Numbers::Big,
    };
    let nodes = numbers.nodes(&Nodes {
        base: 1,
        points: 0..points as u32,
        width: width + 1,
        order: &(0..width).collect::<Vec<usize>>(),
        by_place: false,
    });
    let labels = labels_of::<L>(bytes, row, numbers.big_endian);
    nodes.ok().zip(labels)
}

fn label(scan: &mut Scan<'_>) -> Result<i32> {
    let value = scan.int()?;
    i32::try_from(value).map_err(|_| scan.error(format!("the label {value} does not fit 32 bits")))
}

/// The one label of each cell and of each point.
pub struct Labels<'a> {
    mesh: &'a Mesh,
    groups: CellGroups,
    of_set: Vec<i32>,
    /// Empty if all are 0.
    of_points: Vec<i32>,
}

impl<'a> Labels<'a> {
    /// Those of cells; [`Labels::label_points`] adds those of points.
    pub fn of_cells(mesh: &'a Mesh, losses: &mut Losses) -> Self {
        let groups = CellGroups::new(mesh);
        let (first, many) = groups.single(mesh);
        losses.lose_some(many, "cells that are in several groups");
        let bad = |group: &&Group| group.tag == 0 || i32::try_from(group.tag).is_err();
        losses.lose_some(
            mesh.groups.iter().filter(bad).count(),
            "groups whose number is 0 or exceeds 32 bits",
        );
        losses.lose_empty(mesh);
        let label = |first: Option<&Group>| i32::try_from(first?.tag).ok();
        let of_set = first.into_iter().map(|first| label(first).unwrap_or(0));
        let of_set = of_set.collect();
        Labels {
            mesh,
            groups,
            of_set,
            of_points: Vec::new(),
        }
    }

    fn of(&self, cell: u32) -> i32 {
        let set = self.groups.set_of(cell);
        self.of_set.get(set as usize).copied().unwrap_or(0)
    }

    pub fn lose_names(&self, losses: &mut Losses) {
        let names = self.mesh.groups.iter().filter_map(|g| g.name.as_ref());
        let names: Vec<String> = names.map(|name| format!("{name:?}")).collect();
        if !names.is_empty() {
            losses.lose(format!("the group names {}", names.join(", ")));
        }
    }

    /// Labels points: by the field of that name, or else by the vertex cells. The other fields.
    pub fn label_points(&mut self, losses: &mut Losses) -> Vec<&'a Field> {
        let mesh = self.mesh;
        let (mut labels, mut others) = (None, Vec::new());
        for field in &mesh.fields {
            match (&field.values, labels.is_none()) {
                (Values::I32(values), true) if is_label(field) => labels = Some(values.to_vec()),
                // Another format may have turned integers into floating-point numbers.
                (Values::F64(values), true)
                    if is_label(field) && values.iter().all(|&v| f64::from(v as i32) == v) =>
                {
                    labels = Some(values.iter().map(|&v| v as i32).collect());
                }
                _ => others.push(field),
            }
        }
        let mut labels = labels.unwrap_or_default();
        let (mut dropped, mut turned) = (0, 0);
        for (cell, _, nodes) in mesh.cells_of(CellKind::Vertex) {
            labels.resize(mesh.points.len(), 0);
            let label = self.of(cell);
            match labels.get_mut(nodes[0] as usize) {
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
                "{turned} vertex cells become labels of their points, without the names of their groups"
            ));
        }
        self.of_points = labels;
        others
    }

    /// Each point with its label, from one on.
    pub fn points(&self, first: usize) -> impl Iterator<Item = (&[f64; 3], i32)> {
        let labels = self.of_points.get(first..).unwrap_or_default();
        let labels = labels.iter().copied().chain(std::iter::repeat(0));
        let points = self.mesh.points.get(first..).unwrap_or_default();
        points.iter().zip(labels)
    }

    /// The labels of the cells from one on.
    pub fn from(&self, cell: u32) -> impl Iterator<Item = i32> {
        let runs = self.groups.runs_from(cell);
        runs.flat_map(|(cells, set)| {
            let label = self.of_set.get(set as usize).copied().unwrap_or(0);
            std::iter::repeat_n(label, cells.len())
        })
    }

    /// The blocks of a kind, each with its first cell.
    pub fn blocks(&self, kind: CellKind) -> impl Iterator<Item = (u32, &CellBlock)> {
        let blocks = self.mesh.ranges();
        let blocks = blocks.filter(move |(_, block)| block.kind == kind);
        blocks.map(|(cells, block)| (cells.start, block))
    }

    /// The points and the label of each cell of this kind.
    pub fn cells(&self, kind: CellKind) -> impl Iterator<Item = (&[u32], i32)> {
        let blocks = self.blocks(kind);
        blocks.flat_map(|(first, block)| block.cells().zip(self.from(first)))
    }

    /// Writes a row for each point.
    pub fn write_points(&self, out: &mut Out, dimension: usize) {
        for (point, label) in self.points(0) {
            point[..dimension].iter().for_each(|&x| {
                out.float(x);
            });
            out.int(label).end();
        }
    }

    /// Writes a row for each cell of this kind.
    pub fn write_cells(&self, out: &mut Out, kind: CellKind) {
        for (nodes, label) in self.cells(kind) {
            nodes.iter().for_each(|&node| {
                out.int(node + 1);
            });
            out.int(label).end();
        }
    }
}

fn is_label(field: &Field) -> bool {
    field.name == POINT_LABEL
        && field.on == Support::Points
        && field.components == 1
        && field.at.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn labels_of_64_bits_are_those_of_32_or_refused() {
        for (label, fits) in [(-7, true), (1 << 33, false), ((1 << 32) - 7, false)] {
            let reals = [0.5_f64, 0.25].map(f64::to_le_bytes).concat();
            let bytes = [&reals[..], &i64::to_le_bytes(label)].concat();
            let mut scan = Scan::new(Path::new("a.meshb"), &bytes);
            (scan.numbers, scan.wide) = (Numbers::Little, true);
            let mut rows = Rows::default();
            match rows.points(&mut scan, 1, 2) {
                Ok(()) => {
                    assert!(fits, "{label}");
                    assert_eq!(rows.labels, [-7]);
                    assert_eq!(rows.points, [[0.5, 0.25, 0.0]]);
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(!fits && text.contains("does not fit 32 bits"), "{text}");
                }
            }
        }
    }
}
