//! Quadrature points of boundary faces, in the cells behind them.

use crate::element::Space;
use crate::quadrature::Rule;
use faceoff_mesh::mesh::CellGeometry;

/// A quadrature point on a boundary face.
pub struct FacePoint {
    /// The cell behind the face.
    pub cell: usize,
    /// Barycentric coordinates in that cell.
    pub lambda: [f64; 4],
    /// Its place in the domain; the third coordinate is 0 in 2D.
    pub x: [f64; 3],
    /// Weight times |F|.
    pub weight: f64,
}

/// Quadrature points of a boundary face, along its vertices in ascending order.
pub struct FacePoints<'a> {
    rule: &'a Rule,
    next: usize,
    cell: usize,
    geometry: CellGeometry,
    measure: f64,
    /// Local numbers of the face's vertices, by ascending vertex.
    corners: Vec<usize>,
}

impl<'a> FacePoints<'a> {
    /// Takes the cell behind a face and the points of a rule on it.
    pub fn new(space: &Space, face: usize, rule: &'a Rule) -> Self {
        let mesh = space.mesh;
        let cell = mesh.face_cells(face)[0] as usize;
        let geometry = mesh.geometry(cell);
        let local = mesh.local_face(cell, face);
        let vertices = mesh.cell(cell);
        let mut corners: Vec<usize> = (0..vertices.len()).filter(|&i| i != local).collect();
        corners.sort_unstable_by_key(|&i| vertices[i]);
        FacePoints {
            rule,
            next: 0,
            cell,
            measure: geometry.face_measure(local),
            geometry,
            corners,
        }
    }

    /// |F|
    pub fn measure(&self) -> f64 {
        self.measure
    }

    /// The cell's gradients and volume.
    pub fn geometry(&self) -> &CellGeometry {
        &self.geometry
    }
}

impl Iterator for FacePoints<'_> {
    type Item = FacePoint;

    fn next(&mut self) -> Option<FacePoint> {
        let q = self.next;
        let weight = self.measure * self.rule.weights.get(q)?;
        self.next += 1;
        let on_face = self.rule.barycentric(q);
        let mut lambda = [0.0; 4];
        for (k, &corner) in self.corners.iter().enumerate() {
            lambda[corner] = on_face[k];
        }
        Some(FacePoint {
            cell: self.cell,
            lambda,
            x: self.geometry.point(&lambda),
            weight,
        })
    }
}
