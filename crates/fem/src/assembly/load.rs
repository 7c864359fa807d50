//! (f, φ_i)_h and <t, φ_i>_N, by quadrature.

use super::{FacePoints, add_over_cells};
use crate::element::{Basis, Space};
use crate::quadrature::Rule;
use crate::scene::Expression;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// b_i += (f, φ_i)_h by `rule`, all dofs.
///
/// # Errors
/// A value of f that is not finite, with its point.
pub fn add_load(space: &Space, f: &Expression, rule: &Rule, b: &mut [f64]) -> Result<()> {
    if f.is_zero() {
        return Ok(());
    }
    let (mesh, local) = (space.mesh, space.local_dofs);
    // The values of the basis times the weight.
    let weighted = |(lambda, weight): ([f64; 4], f64)| -> ([f64; 4], Basis) {
        let values = space.element.values(mesh.dim, &lambda);
        (lambda, values.map(|phi| weight * phi))
    };
    let rule: Vec<_> = rule.iter().map(weighted).collect();
    add_over_cells(space, b, |cells, vectors| {
        let mut points = Vec::with_capacity(cells.len() * rule.len());
        let mut measures = Vec::with_capacity(cells.len());
        for cell in cells {
            let vertices = mesh.vertices(cell);
            measures.push(mesh.measure(cell));
            points.extend(rule.iter().map(|([a, b, c, d], ..)| -> [f64; 3] {
                // In 2D d and the fourth vertex are 0.
                let [p, q, r, s] = &vertices;
                std::array::from_fn(|k| a * p[k] + b * q[k] + c * r[k] + d * s[k])
            }));
        }
        let mut values = vec![0.0; points.len()];
        f.values(&points, &mut values);
        let of_cells = values.chunks_exact(rule.len());
        let of_cells = of_cells.zip(measures).zip(vectors.chunks_exact_mut(local));
        for ((values, measure), vector) in of_cells {
            vector.fill(0.0);
            for ((_, phi), value) in rule.iter().zip(values) {
                let weight = measure * value;
                for (sum, phi) in vector.iter_mut().zip(phi) {
                    *sum += weight * phi;
                }
            }
        }
    });
    let are_finite = |b: &[f64]| b.iter().all(|value| value.is_finite());
    if parallel::map(b.chunks(1 << 14), are_finite).contains(&false) {
        for cell in 0..mesh.cell_count() {
            let geometry = mesh.geometry(cell);
            for (lambda, ..) in &rule {
                value_at(f, "f", geometry.point(lambda))?;
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
