//! The faces of cells of the highest dimension, found by sorting.

use super::{CellKind, Mesh, Shape};
use crate::cancel;
use crate::error::Result;

/// Corner indices of a face, ascending; unused places hold `u32::MAX`.
pub type FaceKey = [u32; 4];

/// A face of one cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    pub key: FaceKey,
    pub cell: u32,
}

/// The sides of a shape, by its corners: edges in 2D, faces in 3D, end points of lines; none for those of any number of
/// corners.
pub fn sides(shape: Shape) -> &'static [&'static [usize]] {
    match shape {
        Shape::Vertex | Shape::Polygon | Shape::Polyhedron => &[],
        Shape::Line => &[&[0], &[1]],
        Shape::Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
        Shape::Quadrangle => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        Shape::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[0, 3, 2], &[1, 2, 3]],
        Shape::Hexahedron => &[
            &[0, 3, 2, 1],
            &[4, 5, 6, 7],
            &[0, 1, 5, 4],
            &[1, 2, 6, 5],
            &[2, 3, 7, 6],
            &[3, 0, 4, 7],
        ],
        Shape::Prism => &[
            &[0, 2, 1],
            &[3, 4, 5],
            &[0, 1, 4, 3],
            &[1, 2, 5, 4],
            &[2, 0, 3, 5],
        ],
        Shape::Pyramid => &[
            &[0, 3, 2, 1],
            &[0, 1, 4],
            &[1, 2, 4],
            &[2, 3, 4],
            &[3, 0, 4],
        ],
    }
}

/// The key of a face with these corners; of many, the four smallest count.
pub fn key(corners: impl IntoIterator<Item = u32>) -> FaceKey {
    let mut key = [u32::MAX; 4];
    for corner in corners {
        if corner < key[3] {
            key[3] = corner;
            key.sort_unstable();
        }
    }
    key
}

/// The corners of a cell; `None` for the types of order zero, which have none.
pub fn corners(kind: CellKind, nodes: &[u32]) -> Option<&[u32]> {
    nodes.get(..kind.corners())
}

impl Mesh {
    /// The corners of each facet that only one cell of the highest dimension has, in their order, with that cell; without the
    /// sides of polygons and polyhedra.
    ///
    /// # Errors
    /// [`crate::Error::Ended`].
    pub fn outline(&self) -> Result<Vec<(u32, Vec<u32>)>> {
        let all = all_sides(self, self.dim())?;
        let mut alone = vec![Vec::new(); self.cell_count()];
        for side in all
            .chunk_by(|a, b| a.key == b.key)
            .filter(|face| face.len() == 1)
        {
            alone[side[0].cell as usize].push(side[0].key);
        }
        let mut found = Vec::new();
        for (cell, kind, nodes) in self.cells() {
            cancel::check()?;
            for side in sides(kind.shape()) {
                let corners: Vec<u32> =
                    side.iter().filter_map(|&k| nodes.get(k).copied()).collect();
                if alone[cell as usize].contains(&key(corners.iter().copied())) {
                    found.push((cell, corners));
                }
            }
        }
        Ok(found)
    }
}

/// All sides of all cells of dimension `dim`, sorted, so that the sides of one face are adjacent.
///
/// # Errors
/// [`crate::Error::Ended`].
pub fn all_sides(mesh: &Mesh, dim: u8) -> Result<Vec<Side>> {
    let mut all = Vec::new();
    let mut polyhedra = mesh.polyhedra.iter();
    for (cell, kind, nodes) in mesh.cells() {
        // The faces of each polyhedron are in the order of the cells.
        let faces = matches!(kind, CellKind::Polyhedron(_)).then(|| polyhedra.next());
        if kind.dim() != dim {
            continue;
        }
        cancel::check()?;
        let Some(corners) = corners(kind, nodes) else {
            continue;
        };
        let mut push = |corners: &mut dyn Iterator<Item = u32>| {
            all.push(Side {
                key: key(corners),
                cell,
            });
        };
        if let Some(faces) = faces.flatten() {
            faces.for_each(|face| push(&mut face.iter().copied()));
        } else if kind.shape() == Shape::Polygon {
            let ring = corners.iter().zip(corners.iter().cycle().skip(1));
            ring.for_each(|(&a, &b)| push(&mut [a, b].into_iter()));
        }
        for side in sides(kind.shape()) {
            push(
                &mut side
                    .iter()
                    .filter_map(|&corner| corners.get(corner).copied()),
            );
        }
    }
    all.sort_unstable();
    Ok(all)
}
