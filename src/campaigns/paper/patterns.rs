//! The two Union-Jack meshes of n × n squares: "Union Jack" does not determine the diagonal of the first square.

use std::fmt;

use serde::Serialize;

use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::mesh::generate::union_jack;

/// The meshes that may be the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// The first diagonal cuts off the corner (0, 0): our generator's, and dolfinx's `left_right`.
    UnionJack,
    /// With the diagonals interchanged: FreeFEM's `square(n, n, flags=1)`, which the paper may have used.
    Exchanged,
}

pub const PATTERNS: [Pattern; 2] = [Pattern::UnionJack, Pattern::Exchanged];

impl Pattern {
    /// The unit square.
    ///
    /// # Errors
    /// A mesh with more faces than can be numbered.
    pub fn mesh(self, n: usize) -> Result<Triangulation> {
        let mut mesh = union_jack(n, [1.0; 2]);
        if self == Pattern::Exchanged {
            let row = n as u32 + 1;
            let squares = (0..n as u32).flat_map(|j| (0..n as u32).map(move |i| (i, j)));
            let cells = squares.flat_map(|(i, j)| {
                let [a, b] = [j * row + i, j * row + i + 1];
                let [c, d] = [b + row, a + row];
                match (i + j) % 2 {
                    0 => [a, b, d, b, c, d],
                    _ => [a, b, c, a, c, d],
                }
            });
            // The sides come first, then the triangles.
            if let Some(triangles) = mesh.blocks.last_mut() {
                triangles.nodes = cells.collect();
            }
        }
        Triangulation::new(&self.to_string(), &mesh)
    }
}

/// The name in JSON.
impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each interior vertex of one has 8 cells where the other's has 4, and both have the same points.
    #[test]
    fn the_diagonals_are_exchanged() {
        let degrees = |pattern: Pattern| {
            let mesh = pattern.mesh(4).unwrap();
            let mut degree = vec![0; mesh.points.len()];
            for cell in 0..mesh.cell_count() {
                assert!((mesh.geometry(cell).measure() - 1.0 / 32.0).abs() < 1e-15);
                mesh.cell(cell)
                    .iter()
                    .for_each(|v| degree[*v as usize] += 1);
            }
            degree
        };
        let [own, other] = PATTERNS.map(degrees);
        for (v, (own, other)) in own.iter().zip(&other).enumerate() {
            let is_inside = (1..4).contains(&(v % 5)) && (1..4).contains(&(v / 5));
            if is_inside {
                assert_eq!((own.min(other), own.max(other)), (&4, &8));
            }
        }
    }
}
