//! The mesh of all cards.

use nalgebra::Vector3;

use super::read::{Reader, System};
use crate::error::Result;
use crate::io::builder::{Builder, Numbering, points_in_order};
use crate::io::scan::Scan;
use crate::io::sides::usual_order;
use crate::mesh::Mesh;

impl Reader {
    /// The place of a point of a system, which may lie in others.
    fn placed(&self, scan: &Scan<'_>, point: [f64; 3], mut system: u64) -> Result<[f64; 3]> {
        let mut point = Vector3::from(point);
        let mut turns = 0;
        while system != 0 {
            let found = self.systems.get(&system).filter(|_| turns < 100);
            let Some(System { kind, base, points }) = found else {
                return Err(scan.error_with(
                    format!("the coordinate system {system} is not defined by CORD2R, CORD2C or CORD2S, or by itself"),
                    "write the mesh in the basic system",
                ));
            };
            turns += 1;
            let (sin, cos) = point[1].to_radians().sin_cos();
            let local = match kind {
                b'C' => Vector3::new(point[0] * cos, point[0] * sin, point[2]),
                b'S' => {
                    let (sin_phi, cos_phi) = point[2].to_radians().sin_cos();
                    Vector3::new(
                        point[0] * sin * cos_phi,
                        point[0] * sin * sin_phi,
                        point[0] * cos,
                    )
                }
                _ => point,
            };
            let [a, b, c] = points.map(Vector3::from);
            let up = (b - a).try_normalize(0.0).unwrap_or(Vector3::z());
            let across = up
                .cross(&(c - a))
                .try_normalize(0.0)
                .unwrap_or(Vector3::y());
            point = a + across.cross(&up) * local[0] + across * local[1] + up * local[2];
            system = *base;
        }
        Ok(point.into())
    }

    pub fn build(&mut self, scan: &Scan<'_>) -> Result<Mesh> {
        if self.numbers.is_empty() {
            return Err(scan.error_with(
                "the file has no GRID",
                "give the file with the mesh, or put the included files next to it",
            ));
        }
        let mut builder = Builder::default();
        let mut numbers = Numbering::default();
        for (&number, &(point, system)) in self.numbers.iter().zip(&self.points) {
            numbers.push(number);
            builder
                .mesh
                .points
                .to_mut()
                .push(self.placed(scan, point, system)?);
        }
        builder.finish_points(scan, numbers)?;
        for element in &self.elements {
            let (kind, number) = (element.kind, element.number);
            let point = |node| builder.points.as_ref()?.get(node);
            let order = usual_order(kind, false);
            let nodes = points_in_order(scan, number, &element.nodes, &order, point)?;
            builder.cell(kind, &nodes, number, element.property);
        }
        builder.finish_cells(scan)?;
        Ok(builder.finish())
    }
}
