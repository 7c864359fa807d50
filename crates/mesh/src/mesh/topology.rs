//! The faces of cells of the highest dimension, found by sorting.

use super::{Mesh, Shape};
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

/// The sides of a shape, by its corners: edges in 2D, faces in 3D, end points of lines.
pub fn sides(shape: Shape) -> &'static [&'static [usize]] {
    match shape {
        Shape::Vertex => &[],
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

/// The key of a face with these corners; only the first four count.
pub fn key(corners: impl IntoIterator<Item = u32>) -> FaceKey {
    let mut key = [u32::MAX; 4];
    for (place, corner) in key.iter_mut().zip(corners) {
        *place = corner;
    }
    key.sort_unstable();
    key
}

/// The corners of a cell; `None` for the types of order zero, which have none.
pub fn corners(shape: Shape, nodes: &[u32]) -> Option<&[u32]> {
    nodes.get(..shape.corners())
}

/// All sides of all cells of dimension `dim`, sorted, so that the sides of one face are adjacent.
///
/// # Errors
/// [`crate::Error::Ended`].
pub fn all_sides(mesh: &Mesh, dim: u8) -> Result<Vec<Side>> {
    let mut all = Vec::new();
    for (cell, kind, nodes) in mesh.cells().filter(|(_, kind, _)| kind.dim() == dim) {
        cancel::check()?;
        let Some(corners) = corners(kind.shape(), nodes) else {
            continue;
        };
        for side in sides(kind.shape()) {
            let key = key(side
                .iter()
                .filter_map(|&corner| corners.get(corner).copied()));
            all.push(Side { key, cell });
        }
    }
    all.sort_unstable();
    Ok(all)
}
