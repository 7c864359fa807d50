//! Surfaces of polygons as graphics programs have them: OBJ, OFF, PLY and STL. Read here, written by meshio.
//!
//! Of polygons, triangles and quadrangles are cells; others are told. So are normals, textures and the like.

pub mod obj;
pub mod off;
pub mod ply;
pub mod stl;

use super::Content;
use super::builder::Builder;
use crate::mesh::CellKind;

/// Cells of a surface, and how many polygons are none.
#[derive(Default)]
struct Surface {
    builder: Builder,
    others: usize,
    unread: Vec<String>,
}

impl Surface {
    /// The cell of these points, if there is one.
    fn polygon(&mut self, points: &[u32]) -> Option<u32> {
        let kind = match points.len() {
            1 => CellKind::Vertex,
            2 => CellKind::Line,
            3 => CellKind::Triangle,
            4 => CellKind::Quadrangle,
            _ => {
                self.others += 1;
                return None;
            }
        };
        let number = self.builder.new_number();
        Some(self.builder.cell(kind, points, number, 0))
    }

    fn content(mut self, format: &str, encoding: &str) -> Content {
        if self.others > 0 {
            self.unread.push(format!(
                "{} polygons of more than four corners",
                self.others
            ));
        }
        Content {
            mesh: self.builder.finish(),
            format: format.into(),
            encoding: encoding.into(),
            unread: self.unread,
            ..Content::default()
        }
    }
}
