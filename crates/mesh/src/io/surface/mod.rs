//! Surfaces of polygons as graphics programs have them: OBJ, OFF, PLY and STL. Read here, written by meshio.
//!
//! Normals, textures and the like are reported.

pub mod obj;
pub mod off;
pub mod ply;
pub mod stl;

use super::Content;
use super::builder::Builder;
use super::scan::Numbers;
use crate::field::{Tell, Unread};
use crate::mesh::CellKind;

/// Cells of a surface, and how many polygons without corners are none.
#[derive(Default)]
struct Surface {
    builder: Builder,
    others: usize,
    unread: Vec<Unread>,
}

impl Surface {
    /// The cell of these points, if there is one.
    fn polygon(&mut self, points: &[u32]) -> Option<u32> {
        let Some(kind) = CellKind::of_corners(points.len()) else {
            self.others += 1;
            return None;
        };
        let number = self.builder.new_number();
        Some(self.builder.cell(kind, points, number, 0))
    }

    fn content(mut self, numbers: Numbers) -> Content {
        if self.others > 0 {
            self.unread.tell(
                "polygons",
                format!("{} polygons without corners", self.others),
            );
        }
        Content {
            mesh: self.builder.finish(),
            encoding: numbers.encoding(),
            unread: self.unread,
            ..Content::default()
        }
    }
}
