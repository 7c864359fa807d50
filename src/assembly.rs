//! The linear parts of the method on any of the elements: (∇u, ∇v)_h, (f, v), <t, v>_N, and the
//! norms of the broken spaces.

use crate::element::{Basis, MAX_DOFS, Space};
use crate::error::{Error, Result};
use crate::linear::{Symmetric, SymmetricBuilder};
use crate::mesh::CellGeometry;
use crate::quadrature::{self, Rule};
use crate::scene::Expression;
use nalgebra::Vector3;

/// A rule that integrates products of gradients exactly: degree 2(k-1).
fn gradient_rule(space: &Space) -> Rule {
    let name = if space.element.degree() == 1 {
        "centroid"
    } else {
        "edges-3"
    };
    quadrature::triangle(name).expect("invariant: a rule of the table")
}

/// A rule that integrates products of functions exactly: degree 2k.
fn value_rule(space: &Space) -> Rule {
    let name = if space.element.degree() == 1 {
        "edges-3"
    } else {
        "radon-7"
    };
    quadrature::triangle(name).expect("invariant: a rule of the table")
}

/// (∇φ_j, ∇φ_i)_h, all dofs.
pub fn stiffness(space: &Space) -> Symmetric {
    let rule = gradient_rule(space);
    assemble(space, |geometry, matrix| {
        for (lambda, weight) in rule.iter() {
            let gradients = space.gradients(geometry, &lambda);
            let weight = weight * geometry.measure();
            for i in 0..space.local_dofs {
                for j in 0..=i {
                    matrix[i][j] += weight * gradients[i].dot(&gradients[j]);
                }
            }
        }
    })
}

/// (φ_j, φ_i), all dofs.
pub fn mass(space: &Space) -> Symmetric {
    // One matrix for all cells, up to their measure.
    let mut reference = [[0.0; MAX_DOFS]; MAX_DOFS];
    for (lambda, weight) in value_rule(space).iter() {
        let phi = space.element.values(space.mesh.dim, &lambda);
        for i in 0..space.local_dofs {
            for j in 0..=i {
                reference[i][j] += weight * phi[i] * phi[j];
            }
        }
    }
    assemble(space, |geometry, matrix| {
        for i in 0..space.local_dofs {
            for j in 0..=i {
                matrix[i][j] = geometry.measure() * reference[i][j];
            }
        }
    })
}

/// Sums the lower triangles that `fill` makes of each cell.
fn assemble(
    space: &Space,
    mut fill: impl FnMut(&CellGeometry, &mut [[f64; MAX_DOFS]; MAX_DOFS]),
) -> Symmetric {
    let local = space.local_dofs;
    let cells = space.mesh.cell_count();
    let mut builder = SymmetricBuilder::new(space.dofs, cells * local * (local + 1) / 2);
    for cell in 0..cells {
        let mut matrix = [[0.0; MAX_DOFS]; MAX_DOFS];
        fill(&space.mesh.geometry(cell), &mut matrix);
        let dofs = space.cell_dofs(cell);
        for (i, &dof_i) in dofs.iter().enumerate() {
            for (j, &dof_j) in dofs.iter().enumerate().take(i + 1) {
                builder.add(dof_i, dof_j, matrix[i][j]);
            }
        }
    }
    builder.build()
}

/// Σ_i u_i ∇φ_i
pub fn combine(gradients: &[Vector3<f64>; MAX_DOFS], local: &Basis) -> Vector3<f64> {
    gradients
        .iter()
        .zip(local)
        .fold(Vector3::zeros(), |sum, (gradient, u)| sum + *u * gradient)
}

/// b_i += (f, φ_i)_h by `rule`, all dofs.
///
/// # Errors
/// A value of f that is not finite, with its point.
pub fn add_load(space: &Space, f: &Expression, rule: &Rule, b: &mut [f64]) -> Result<()> {
    if f.is_zero() {
        return Ok(());
    }
    for cell in 0..space.mesh.cell_count() {
        let geometry = space.mesh.geometry(cell);
        for (lambda, weight) in rule.iter() {
            let value = value_at(f, "f", geometry.point(&lambda))?;
            let phi = space.element.values(space.mesh.dim, &lambda);
            for (phi, &dof) in phi.iter().zip(space.cell_dofs(cell)) {
                b[dof as usize] += weight * geometry.measure() * value * phi;
            }
        }
    }
    Ok(())
}

/// b_i += <t, φ_i>_F for one boundary face, by `rule`.
///
/// # Errors
/// A value of t that is not finite, with its point.
pub fn add_traction(
    space: &Space,
    t: &Expression,
    face: usize,
    rule: &Rule,
    b: &mut [f64],
) -> Result<()> {
    if t.is_zero() {
        return Ok(());
    }
    for point in FacePoints::new(space, face, rule) {
        let value = value_at(t, "t", point.x)?;
        let phi = space.element.values(space.mesh.dim, &point.lambda);
        for (phi, &dof) in phi.iter().zip(space.cell_dofs(point.cell)) {
            b[dof as usize] += point.weight * value * phi;
        }
    }
    Ok(())
}

/// The value of a datum, which must be finite.
pub fn value_at(expression: &Expression, name: &str, x: [f64; 3]) -> Result<f64> {
    let value = expression.value(x);
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::Solver {
        what: format!(
            "{name} = `{}` is {value} at ({}, {}, {})",
            expression.text(),
            x[0],
            x[1],
            x[2]
        ),
        remedy: "give data that are finite on the whole domain".into(),
    })
}

/// A quadrature point on a boundary face.
pub struct FacePoint {
    /// The cell behind the face.
    pub cell: usize,
    /// Barycentric coordinates in that cell.
    pub lambda: [f64; 4],
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, P2};
    use crate::mesh::Triangulation;
    use crate::mesh::generate::union_jack;

    fn polynomial(space: &Space, p: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
        space.points.iter().map(|&x| p(x)).collect()
    }

    #[test]
    fn norms_of_polynomials_are_exact() {
        let mesh = Triangulation::new("uj", &union_jack(3, [2.0, 1.0])).unwrap();
        for element in [&CR as &'static dyn Element, &P1, &P2] {
            let space = Space::new(&mesh, element);
            let u = polynomial(&space, |x| 1.0 + 2.0 * x[0] - 3.0 * x[1]);
            assert!((stiffness(&space).energy(&u) - 26.0).abs() < 1e-12);
            // ∫∫ (1 + 2x - 3y)² over (0,2) × (0,1)
            assert!((mass(&space).energy(&u) - 26.0 / 3.0).abs() < 1e-12);
        }
        let space = Space::new(&mesh, &P2);
        let u = polynomial(&space, |x| x[0] * x[1]);
        assert!((stiffness(&space).energy(&u) - (8.0 / 3.0 + 2.0 / 3.0)).abs() < 1e-12);
        assert!((mass(&space).energy(&u) - 8.0 / 9.0).abs() < 1e-12);
    }
}
