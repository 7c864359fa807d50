//! Labels, as FreeFEM and Medit have them: one number for each cell and each vertex, 0 for none.

use std::collections::BTreeMap;

use super::loss::Losses;
use super::out::Out;
use super::scan::{Numbers, Scan};
use super::vtu::scalar::Scalar;
use crate::error::Result;
use crate::mesh::{CellBlock, CellGroups, CellKind, Field, Group, Mesh, Support, Values};

/// The name of the field that holds the labels of points.
const POINT_LABEL: &str = "label";

/// A mesh that is being read from rows that end in a label.
#[derive(Default)]
pub struct Rows {
    points: Vec<[f64; 3]>,
    labels: Vec<i32>,
    /// With the label of each cell.
    blocks: Vec<(CellBlock, Vec<i32>)>,
}

impl Rows {
    /// Reads points of one to three coordinates.
    pub fn points(&mut self, scan: &mut Scan<'_>, count: usize, dimension: usize) -> Result<()> {
        (self.points, self.labels) = (vec![[0.0; 3]; count], vec![0; count]);
        let to = (&mut self.points[..], 1, &mut self.labels[..]);
        scan.rows(1, dimension, to, |scan, points, labels| {
            if fast_points(scan, dimension, points, labels) {
                return Ok(());
            }
            for (point, to) in points.iter_mut().zip(labels) {
                for x in point.iter_mut().take(dimension) {
                    *x = scan.real()?;
                }
                *to = label(scan)?;
            }
            Ok(())
        })
    }

    /// Reads cells of the points so far.
    pub fn cells(&mut self, scan: &mut Scan<'_>, count: usize, kind: CellKind) -> Result<()> {
        let (width, points) = (kind.points(), self.points.len());
        let (mut nodes, mut labels) = (vec![0; count * width], vec![0; count]);
        let to = (&mut nodes[..], width, &mut labels[..]);
        scan.rows(width + 1, 0, to, |scan, nodes, labels| {
            if fast_cells(scan, points, nodes, labels) {
                return Ok(());
            }
            for (cell, to) in nodes.chunks_exact_mut(width).zip(labels) {
                for node in cell {
                    *node = scan.vertex(points)?;
                }
                *to = label(scan)?;
            }
            Ok(())
        })?;
        self.blocks.push((CellBlock::new(kind, nodes), labels));
        Ok(())
    }

    /// Swaps two nodes in each of the cells read last.
    pub fn swap(&mut self, a: usize, b: usize) {
        if let Some((block, _)) = self.blocks.last_mut() {
            let cells = block.nodes.chunks_exact_mut(block.kind.points());
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
            let labels = Values::I32(self.labels);
            mesh.fields
                .push(Field::new(POINT_LABEL, Support::Points, 1, labels));
        }
        let mut groups: BTreeMap<(u8, i64), Group> = BTreeMap::new();
        let mut cell = 0;
        for (block, labels) in self.blocks {
            let dim = block.kind.dim();
            for run in labels.chunk_by(|a, b| a == b) {
                let (tag, cells) = (i64::from(run[0]), cell..cell + run.len() as u32);
                cell = cells.end;
                if tag != 0 {
                    let group = groups.entry((dim, tag));
                    let group = group.or_insert_with(|| Group::new(dim, tag));
                    group.cells.extend(cells);
                }
            }
            if !block.is_empty() {
                mesh.blocks.push(block);
            }
        }
        mesh.groups = groups.into_values().collect();
        mesh
    }
}

/// Fills points and labels from a binary file at once; whether all is sound, without what and where it is not.
fn fast_points(
    scan: &Scan<'_>,
    dimension: usize,
    points: &mut [[f64; 3]],
    labels: &mut [i32],
) -> bool {
    fn fill<R: Scalar, L: Scalar>(
        scan: &Scan<'_>,
        dimension: usize,
        points: &mut [[f64; 3]],
        labels: &mut [i32],
    ) -> bool {
        let big_endian = scan.numbers == Numbers::Big;
        let rows = scan.rest().chunks_exact(dimension * R::WIDTH + L::WIDTH);
        let enough = rows.len() >= points.len();
        rows.zip(points)
            .zip(labels)
            .fold(enough, |sound, ((row, point), to)| {
                let (reals, label) = row.split_at(dimension * R::WIDTH);
                let numbers = R::each(reals, big_endian);
                point
                    .iter_mut()
                    .zip(numbers)
                    .for_each(|(x, number)| *x = number.float());
                let label = L::each(label, big_endian).next().map_or(f64::NAN, L::float);
                *to = label as i32;
                sound & point.iter().all(|x| x.is_finite()) & (f64::from(*to) == label)
            })
    }
    match (scan.numbers, scan.single, scan.wide) {
        (Numbers::Ascii, ..) => false,
        (_, true, false) => fill::<f32, i32>(scan, dimension, points, labels),
        (_, true, true) => fill::<f32, i64>(scan, dimension, points, labels),
        (_, false, false) => fill::<f64, i32>(scan, dimension, points, labels),
        (_, false, true) => fill::<f64, i64>(scan, dimension, points, labels),
    }
}

/// [`fast_points`] for the nodes of cells, of which there are as many `points`.
fn fast_cells(scan: &Scan<'_>, points: usize, nodes: &mut [u32], labels: &mut [i32]) -> bool {
    fn fill<L: Scalar>(
        scan: &Scan<'_>,
        points: usize,
        nodes: &mut [u32],
        labels: &mut [i32],
    ) -> bool {
        let width = nodes.len() / labels.len().max(1);
        let words = scan.rest().get(..(nodes.len() + labels.len()) * L::WIDTH);
        let mut words = L::each(words.unwrap_or_default(), scan.numbers == Numbers::Big);
        let mut sound = words.len() == nodes.len() + labels.len();
        for (cell, to) in nodes.chunks_exact_mut(width.max(1)).zip(labels) {
            for (node, word) in cell.iter_mut().zip(&mut words) {
                let index = word.index().unwrap_or(0).wrapping_sub(1);
                sound &= index < points as u64;
                *node = index as u32;
            }
            let label = words.next().map_or(f64::NAN, L::float);
            *to = label as i32;
            sound &= f64::from(*to) == label;
        }
        sound
    }
    match (scan.numbers, scan.wide) {
        (Numbers::Ascii, _) => false,
        (_, false) => fill::<i32>(scan, points, nodes, labels),
        (_, true) => fill::<i64>(scan, points, nodes, labels),
    }
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
                (Values::I32(values), true) if is_label(field) => labels = Some(values.clone()),
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

    /// Each point with its label.
    pub fn points(&self) -> impl Iterator<Item = (&[f64; 3], i32)> {
        let labels = self.of_points.iter().copied().chain(std::iter::repeat(0));
        self.mesh.points.iter().zip(labels)
    }

    /// The points and the label of each cell of this kind.
    pub fn cells(&self, kind: CellKind) -> impl Iterator<Item = (&[u32], i32)> {
        let cells = self.mesh.cells_of(kind);
        cells.map(|(cell, _, nodes)| (nodes, self.of(cell)))
    }

    /// Writes a row for each point.
    pub fn write_points(&self, out: &mut Out, dimension: usize) {
        for (point, label) in self.points() {
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
