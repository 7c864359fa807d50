//! Finds and locates what is, or may be, wrong with the topology and geometry of a mesh.

use std::collections::{HashMap, HashSet};

use nalgebra::Vector3;
use serde::Serialize;

use super::hanging::hanging_nodes;
use super::quality::{Measures, Quality, spans};
use super::topology::{FaceKey, Side, all_sides, corners, key};
use super::{Mesh, Shape, Union};
use crate::cancel;
use crate::error::Result;

/// How many findings of a kind are located.
const SHOWN: usize = 5;
/// A cell whose measure is less than this times the power of its longest edge is degenerate.
const FLAT: f64 = 1e-12;

/// The findings of [`check`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Soundness {
    /// Cells with a negative measure: clockwise ones of a planar mesh, inverted solids.
    pub inverted: Defects,
    /// Cells with a repeated node, or with nearly no area or volume.
    pub degenerate: Defects,
    /// Cells with the same corners as an earlier one of the same type.
    pub duplicate: Defects,
    /// Points that belong to no cell other than vertices.
    pub orphans: Defects,
    /// Faces that three or more cells share.
    pub crowded_faces: Defects,
    /// Points inside a face or edge without being one of its corners.
    pub hanging_nodes: Defects,
    /// Faces of one cell only that are in no group.
    pub ungrouped_boundary: Defects,
    /// Parts that share no face, each located by its first cell; a connected mesh has one.
    pub parts: Defects,
    /// Angles of polygons, angles between the faces of solids.
    pub smallest_angle: Option<Angle>,
    /// The same, but the largest.
    pub largest_angle: Option<Angle>,
    /// Cells of higher order whose Jacobian is not positive at some node, although their corners are in order.
    pub folded: Defects,
    /// Points at the place of another.
    pub duplicate_points: Defects,
    /// For cells of the highest dimension.
    pub quality: Vec<Quality>,
}

/// The number of findings, and the first few of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Defects {
    /// How many there are.
    pub count: usize,
    /// The first of them; not all where there are many.
    pub first: Vec<Defect>,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Defect {
    /// The file's numbers of the cells concerned.
    pub cells: Vec<u64>,
    /// The file's numbers of the points concerned.
    pub points: Vec<u64>,
    /// The midpoint of the cell or face, or the point.
    pub at: [f64; 3],
}

/// An angle in degrees, and the file's number of the cell that has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Angle {
    /// From 0 to 180.
    pub degrees: f64,
    /// The file's number.
    pub cell: u64,
    /// The mean of the corners of the cell.
    pub at: [f64; 3],
}

impl Soundness {
    /// Whether a solver can use the mesh: angles and boundary faces without a group do not count.
    pub fn is_sound(&self) -> bool {
        let faults = [
            &self.inverted,
            &self.degenerate,
            &self.duplicate,
            &self.orphans,
            &self.crowded_faces,
            &self.hanging_nodes,
            &self.folded,
            &self.duplicate_points,
        ];
        faults.iter().all(|findings| findings.count == 0) && self.parts.count <= 1
    }
}

impl Defects {
    fn add(&mut self, finding: impl FnOnce() -> Defect) {
        self.count += 1;
        if self.first.len() < SHOWN {
            self.first.push(finding());
        }
    }
}

/// Checks a mesh that passes [`Mesh::validate`]. Cells of the highest dimension fill the domain; those of one
/// dimension less mark faces. O(N log N).
///
/// # Errors
/// [`crate::Error::Ended`].
pub fn check(mesh: &Mesh) -> Result<Soundness> {
    let checker = Checker {
        mesh,
        dim: mesh.dim(),
        tags: mesh.cell_tags().collect(),
    };
    let sides = all_sides(mesh, checker.dim)?;
    let (inverted, degenerate) = checker.measures()?;
    let (quality, folded) = checker.quality()?;
    let angle = |what: &str| {
        let of = quality.iter().find(|quality| quality.what == what)?;
        let worst = of.worst.first()?;
        Some(Angle {
            degrees: worst.value,
            cell: worst.cell,
            at: worst.at,
        })
    };
    Ok(Soundness {
        inverted,
        degenerate,
        duplicate: checker.duplicates()?,
        orphans: checker.orphans()?,
        crowded_faces: checker.crowded(&sides)?,
        hanging_nodes: checker.hanging(&sides)?,
        ungrouped_boundary: checker.ungrouped(&sides)?,
        parts: checker.parts(&sides)?,
        smallest_angle: angle("smallest angle"),
        largest_angle: angle("largest angle"),
        folded,
        duplicate_points: checker.duplicate_points()?,
        quality,
    })
}

struct Checker<'a> {
    mesh: &'a Mesh,
    /// The highest dimension of any cell.
    dim: u8,
    tags: Vec<u64>,
}

impl Checker<'_> {
    fn hanging(&self, sides: &[Side]) -> Result<Defects> {
        let mut findings = Defects::default();
        if self.dim < 2 {
            return Ok(findings);
        }
        let faces: Vec<(Side, Vec<u32>)> = boundary(sides)
            .map(|side| (side, nodes_of(&side.key)))
            .collect();
        let corners: Vec<&[u32]> = faces.iter().map(|(_, nodes)| nodes.as_slice()).collect();
        for (point, face) in hanging_nodes(&self.mesh.points, &corners)? {
            findings.add(|| self.finding(&[faces[face].0.cell], &[point]));
        }
        Ok(findings)
    }

    fn point(&self, index: u32) -> Vector3<f64> {
        self.mesh
            .points
            .get(index as usize)
            .copied()
            .unwrap_or_default()
            .into()
    }

    fn tag(&self, cell: u32) -> u64 {
        self.tags.get(cell as usize).copied().unwrap_or(0)
    }

    fn finding(&self, cells: &[u32], points: &[u32]) -> Defect {
        let sum: Vector3<f64> = points.iter().map(|&point| self.point(point)).sum();
        Defect {
            cells: cells.iter().map(|&cell| self.tag(cell)).collect(),
            points: points
                .iter()
                .map(|&point| self.mesh.point_tag(point))
                .collect(),
            at: (sum / points.len().max(1) as f64).into(),
        }
    }

    fn cells(&self) -> impl Iterator<Item = (u32, Shape, &[u32])> {
        self.mesh.cells().filter_map(|(cell, kind, nodes)| {
            let shape = kind.shape();
            Some((cell, shape, corners(kind, nodes)?))
        })
    }

    fn measures(&self) -> Result<(Defects, Defects)> {
        let (mut inverted, mut degenerate) = (Defects::default(), Defects::default());
        // A planar mesh is seen from above; for a surface, most of its cells decide.
        let up = match self.mesh.plane().filter(|_| self.dim == 2) {
            Some(2) => Some(Vector3::z()),
            Some(axis) => {
                let axis = Vector3::ith(axis, 1.0);
                let plane = self.cells().filter(|(_, shape, _)| shape.dim() == 2);
                let total: f64 = plane.map(|(_, _, nodes)| self.area(nodes).dot(&axis)).sum();
                Some(axis * total.signum())
            }
            None => None,
        };
        for (cell, shape, nodes) in self.cells().filter(|(_, shape, _)| shape.dim() > 0) {
            cancel::check()?;
            let longest = self.longest(nodes);
            let scale = longest.powi(i32::from(shape.dim()));
            // The smallest of the measures that the corners span: one for a simplex.
            let measure = match (shape.dim(), up) {
                (1, _) => longest,
                (2, Some(up)) => self.corner_areas(shape, nodes, |area| area.dot(&up)),
                (2, None) => self.corner_areas(shape, nodes, |area| area.norm()),
                _ => self.corner_volumes(shape, nodes),
            };
            let mut sorted = nodes.to_vec();
            sorted.sort_unstable();
            let twice = sorted.windows(2).any(|pair| pair[0] == pair[1]);
            if twice || measure.abs() <= FLAT * scale || scale == 0.0 {
                degenerate.add(|| self.finding(&[cell], nodes));
            } else if measure < 0.0 {
                inverted.add(|| self.finding(&[cell], nodes));
            }
        }
        Ok((inverted, degenerate))
    }

    fn longest(&self, nodes: &[u32]) -> f64 {
        let points: Vec<_> = nodes.iter().map(|&node| self.point(node)).collect();
        let mut longest = 0.0f64;
        // The distances from a few corners are long enough for a scale.
        for (i, a) in points.iter().enumerate().take(8) {
            for b in points.iter().skip(i + 1) {
                longest = longest.max((b - a).norm());
            }
        }
        longest
    }

    /// Vector area of a polygon.
    fn area(&self, nodes: &[u32]) -> Vector3<f64> {
        let Some(&first) = nodes.first() else {
            return Vector3::zeros();
        };
        let origin = self.point(first);
        let fan = nodes
            .windows(2)
            .map(|edge| (self.point(edge[0]) - origin).cross(&(self.point(edge[1]) - origin)));
        fan.sum::<Vector3<f64>>() / 2.0
    }

    fn corner_areas(&self, shape: Shape, nodes: &[u32], of: impl Fn(Vector3<f64>) -> f64) -> f64 {
        // A polygon need not be convex.
        if matches!(shape, Shape::Triangle | Shape::Polygon) {
            return of(self.area(nodes));
        }
        let n = nodes.len();
        let corner = |i: usize| [nodes[(i + n - 1) % n], nodes[i], nodes[(i + 1) % n]];
        (0..n)
            .map(|i| of(self.area(&corner(i))))
            .fold(f64::INFINITY, f64::min)
    }

    /// The smallest volume of the tetrahedra spanned by a corner and its neighbours.
    fn corner_volumes(&self, shape: Shape, nodes: &[u32]) -> f64 {
        let volume = |span: &[usize; 4]| {
            let [a, b, c, d] = span.map(|i| {
                nodes
                    .get(i)
                    .map_or_else(Vector3::zeros, |&node| self.point(node))
            });
            (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
        };
        spans(shape)
            .iter()
            .map(volume)
            .fold(f64::INFINITY, f64::min)
    }

    fn duplicates(&self) -> Result<Defects> {
        let mut findings = Defects::default();
        let mut all: Vec<(Shape, Vec<u32>, u32)> = Vec::new();
        // Faces, lines and tetrahedra fit the fixed key; only larger solids need a list.
        let mut small: Vec<(Shape, FaceKey, u32)> = Vec::new();
        for (cell, shape, nodes) in self.cells() {
            cancel::check()?;
            if nodes.len() <= 4 {
                small.push((shape, key(nodes.iter().copied()), cell));
            } else {
                let mut sorted = nodes.to_vec();
                sorted.sort_unstable();
                all.push((shape, sorted, cell));
            }
        }
        let mut pairs = twice(small);
        pairs.extend(twice(all));
        pairs.sort_unstable();
        let shown: HashSet<u32> = pairs.iter().take(SHOWN).map(|pair| pair.0).collect();
        let nodes_of: HashMap<u32, &[u32]> = self
            .cells()
            .filter(|(cell, ..)| shown.contains(cell))
            .map(|(cell, _, nodes)| (cell, nodes))
            .collect();
        for (cell, before) in pairs {
            findings.add(|| self.finding(&[before, cell], nodes_of[&cell]));
        }
        Ok(findings)
    }

    fn orphans(&self) -> Result<Defects> {
        let mut used = vec![false; self.mesh.points.len()];
        for (_, kind, nodes) in self.mesh.cells() {
            cancel::check()?;
            for &node in nodes {
                if let Some(used) = used.get_mut(node as usize)
                    && kind.dim() > 0
                {
                    *used = true;
                }
            }
        }
        let mut findings = Defects::default();
        for (point, _) in (0u32..).zip(&used).filter(|(_, used)| !**used) {
            findings.add(|| self.finding(&[], &[point]));
        }
        Ok(findings)
    }

    fn crowded(&self, sides: &[Side]) -> Result<Defects> {
        let mut findings = Defects::default();
        for face in sides.chunk_by(|a, b| a.key == b.key) {
            cancel::check()?;
            if face.len() <= 2 {
                continue;
            }
            let cells: Vec<u32> = face.iter().map(|side| side.cell).collect();
            findings.add(|| self.finding(&cells, &nodes_of(&face[0].key)));
        }
        Ok(findings)
    }

    fn ungrouped(&self, sides: &[Side]) -> Result<Defects> {
        let mut grouped = vec![false; self.tags.len()];
        for group in self
            .mesh
            .groups
            .iter()
            .filter(|group| group.dim + 1 == self.dim)
        {
            for &cell in &group.cells {
                if let Some(grouped) = grouped.get_mut(cell as usize) {
                    *grouped = true;
                }
            }
        }
        let marked = self
            .cells()
            .filter(|(cell, ..)| grouped.get(*cell as usize) == Some(&true));
        let marked = marked.map(|(.., nodes)| {
            cancel::check()?;
            Ok(key(nodes.iter().copied()))
        });
        let marked = marked.collect::<Result<HashSet<FaceKey>>>()?;
        let mut findings = Defects::default();
        for side in boundary(sides).filter(|side| !marked.contains(&side.key)) {
            cancel::check()?;
            findings.add(|| self.finding(&[side.cell], &nodes_of(&side.key)));
        }
        Ok(findings)
    }

    fn parts(&self, sides: &[Side]) -> Result<Defects> {
        let mut parts = Union::new(self.tags.len());
        for pair in sides.windows(2) {
            cancel::check()?;
            if pair[0].key == pair[1].key {
                parts.join(pair[0].cell, pair[1].cell);
            }
        }
        let mut findings = Defects::default();
        for (cell, shape, nodes) in self.cells() {
            cancel::check()?;
            if shape.dim() == self.dim && parts.root(cell) == cell {
                findings.add(|| self.finding(&[cell], nodes));
            }
        }
        Ok(findings)
    }

    /// How good the cells of the highest dimension are, and those that curved sides fold over.
    fn quality(&self) -> Result<(Vec<Quality>, Defects)> {
        let (mut measures, mut folded) = (Measures::new(), Defects::default());
        let whole = self
            .mesh
            .cells()
            .filter(|(_, kind, _)| kind.dim() == self.dim);
        for (cell, kind, nodes) in whole {
            cancel::check()?;
            let Some(corners) = corners(kind, nodes) else {
                continue;
            };
            let [ends, all] = [corners, nodes]
                .map(|of| of.iter().map(|&node| self.point(node)).collect::<Vec<_>>());
            if measures.add(kind, &ends, &all, self.tag(cell)) {
                folded.add(|| self.finding(&[cell], corners));
            }
        }
        Ok((measures.finish(), folded))
    }

    /// Points at the place of another, to the last bit.
    fn duplicate_points(&self) -> Result<Defects> {
        let mut all: Vec<([u64; 3], u32)> = (0..)
            .zip(&self.mesh.points)
            .map(|(k, x)| (x.map(|x| (x + 0.0).to_bits()), k))
            .collect();
        all.sort_unstable();
        let mut findings = Defects::default();
        for pair in all.windows(2) {
            cancel::check()?;
            if pair[0].0 == pair[1].0 {
                findings.add(|| self.finding(&[], &[pair[0].1, pair[1].1]));
            }
        }
        Ok(findings)
    }
}

/// Cells that are like another one of a list, each with that one.
fn twice<K: Ord>(mut cells: Vec<(Shape, K, u32)>) -> Vec<(u32, u32)> {
    cells.sort_unstable();
    let alike = |pair: &&[(Shape, K, u32)]| (pair[0].0, &pair[0].1) == (pair[1].0, &pair[1].1);
    let pairs = cells.windows(2).filter(alike);
    pairs.map(|pair| (pair[1].2, pair[0].2)).collect()
}

/// The faces with one cell only.
fn boundary(sides: &[Side]) -> impl Iterator<Item = Side> {
    sides
        .chunk_by(|a, b| a.key == b.key)
        .filter(|face| face.len() == 1)
        .map(|face| face[0])
}

fn nodes_of(key: &FaceKey) -> Vec<u32> {
    key.iter()
        .copied()
        .filter(|&node| node != u32::MAX)
        .collect()
}

#[cfg(test)]
mod tests;
