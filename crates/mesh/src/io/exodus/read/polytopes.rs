//! Blocks of polygons (NSIDED) and polyhedra (NFACED).

use super::Reader;
use crate::error::Result;
use crate::io::polytopes::Lists;
use crate::mesh::Shape;

impl Reader<'_> {
    /// Reads the k-th block if it is one of polygons (NSIDED) or polyhedra (NFACED); their shape and number.
    pub(super) fn polytopes(&mut self, k: usize) -> Result<Option<(Shape, usize)>> {
        let Some(counts) = self.integers(&format!("ebepecnt{k}"))? else {
            return Ok(None);
        };
        let points = 0..self.sets.mesh.points.len() as u32;
        let (mut lists, mut block) = (Lists::default(), format!("connect{k}"));
        let (shape, added) = if let Some(nodes) = self.integers(&block)? {
            let added = lists
                .append(nodes, counts)
                .and_then(|()| self.sets.polygons(&lists, &points));
            (Shape::Polygon, added)
        } else {
            block = format!("facconn{k}");
            let numbers = self.integers(&block)?.unwrap_or_default();
            let faces = match self.faces.take() {
                Some(faces) => faces,
                None => self.faces()?,
            };
            let face = |number: i64| {
                let k = usize::try_from(number.wrapping_sub(1)).unwrap_or(usize::MAX);
                faces.face(k, &points).map(|(_, corners)| corners)
            };
            let added = lists
                .append(numbers, counts)
                .and_then(|()| self.sets.polyhedra(&lists, face));
            self.faces = Some(faces);
            (Shape::Polyhedron, added)
        };
        added.map_err(|what| self.file.refuse(format!("{block}: {what}")))?;
        Ok(Some((shape, lists.len())))
    }

    /// The corners of all faces of the blocks of faces.
    fn faces(&self) -> Result<Lists> {
        let mut faces = Lists::default();
        let declared = self.file.dimension("num_fa_blk")?.unwrap_or(0);
        for k in 1..=declared.min(self.file.names()?.len()) {
            let name = format!("fbconn{k}");
            let nodes = self.integers(&name)?.unwrap_or_default();
            let counts = match (
                self.integers(&format!("fbepecnt{k}"))?,
                self.file.shape(&name)?.as_deref(),
            ) {
                (Some(counts), _) => counts,
                (None, Some(&[_, width])) => {
                    vec![width as i64; nodes.len().checked_div(width).unwrap_or(0)]
                }
                _ => Vec::new(),
            };
            let appended = faces.append(nodes, counts);
            appended.map_err(|what| self.file.refuse(format!("{name}: {what}")))?;
        }
        Ok(faces)
    }
}
