//! Quantities of a discrete solution of any engine: fields on the faces for
//! the comparison, and the numbers that section 6 of the paper reports.

use super::contact_set::ContactSet;
use super::form::Problem;
use crate::assembly::{self, FacePoints};
use crate::element::{Basis, MAX_DOFS, Space};
use crate::quadrature::{self, Rule};
use faceoff_mesh::field::{ColumnKind, FaceColumn, FaceFields};
use faceoff_mesh::mesh::NONE;

/// Numbers of one solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantities {
    /// ‖∇u_h‖²_h
    pub grad_norm_sq: f64,
    /// ‖u_h‖
    pub l2_norm: f64,
    /// <∂ₙu_h, 1>_C
    pub contact_flux: f64,
    /// ‖u_h - ψ + [P(u_h)]₊‖ on Γ_C, by the scheme's own rule.
    pub contact_residual: f64,
    /// ‖γ^(-1/2) (u_h - ψ + [P(u_h)]₊)‖ on Γ_C, which (5.12) bounds.
    pub weighted_residual: f64,
    /// Where P(u_h) ≤ 0 on Γ_C.
    pub contact_set: ContactSet,
}

/// The numbers of u (values at all dofs).
pub fn quantities(problem: &Problem, u: &[f64]) -> Quantities {
    let (mut flux, mut residual, mut weighted) = (0.0, 0.0, 0.0);
    for face in &problem.contact {
        let local = problem.space.local(face.cell, u);
        for point in &face.points {
            let trace = point.trace(face.gamma, &local);
            flux += point.weight * trace.flux;
            let square = point.weight * trace.gap.max(face.gamma * trace.flux).powi(2);
            residual += square;
            weighted += square / face.gamma;
        }
    }
    Quantities {
        grad_norm_sq: problem.stiffness.energy(u),
        l2_norm: assembly::norm_squared(&problem.space, u).sqrt(),
        contact_flux: flux,
        contact_residual: residual.sqrt(),
        weighted_residual: weighted.sqrt(),
        contact_set: ContactSet::new(problem, u),
    }
}

/// The fields that codes are compared by.
///
/// - `mean`: mean of u_h on every face (from the first cell, on which it is the other's as well).
/// - `jump`: root mean square of the jump ⟦u_h⟧ on interior faces; elements with continuous
///   traces have none.
/// - `moments`: |F|⁻¹ ∫_F u λ_a λ_b, a ≤ b ascending vertices; of quadratic elements.
/// - `flux`: mean of ∂ₙu_h on Γ_C, from inside.
/// - `status`: P(u_h) at the quadrature points of Γ_C, judged by its sign.
pub fn face_fields(problem: &Problem, u: &[f64], source: &str) -> FaceFields {
    let space = &problem.space;
    let mesh = space.mesh;
    // Second moments of functions, squares of jumps.
    let rule = quadrature::exact(mesh.dim - 1, 2 * space.element.degree());
    let faces = mesh.face_count();
    let mut mean = column("mean", 1, faces);
    let mut moments = column("moments", mesh.dim * (mesh.dim + 1) / 2, faces);
    let mut jump = column("jump", 1, faces);
    let (quadratic, broken) = (space.element.degree() == 2, space.element.on().faces);
    let of_moments = moment_sensitivity(space, &rule);
    for face in 0..faces {
        let points: Vec<(Trace, f64)> = traces(space, face, &rule, u);
        let measure: f64 = points.iter().map(|(_, weight)| weight).sum();
        let average = |value: &dyn Fn(&Trace) -> f64| -> f64 {
            points.iter().map(|(t, w)| w * value(t)).sum::<f64>() / measure
        };
        push(&mut mean, face, &[average(&|t| t.first)], 1.0);
        if quadratic {
            let mut values = Vec::with_capacity(moments.components);
            for a in 0..mesh.dim {
                for b in a..mesh.dim {
                    values.push(average(&|t| t.first * t.on_face[a] * t.on_face[b]));
                }
            }
            push(&mut moments, face, &values, of_moments);
        }
        if broken && !mesh.is_boundary(face) {
            let value = average(&|t| (t.first - t.second).powi(2)).sqrt();
            push(&mut jump, face, &[value], 2.0 * mesh.dim as f64);
        }
    }
    let mut flux = column("flux", 1, problem.contact.len());
    let mut status = column(
        "status",
        problem.face_rule.weights.len(),
        problem.contact.len(),
    );
    status.kind = ColumnKind::Status;
    for face in &problem.contact {
        let local = space.local(face.cell, u);
        let (mut mean_flux, mut p, mut steepest) = (0.0, Vec::new(), 0.0_f64);
        for point in &face.points {
            let trace = point.trace(face.gamma, &local);
            mean_flux += point.weight * trace.flux / face.measure;
            p.push(trace.p);
            steepest = steepest.max(point.dn.iter().map(|d| d.abs()).sum());
        }
        push(&mut flux, face.face, &[mean_flux], steepest);
        push(&mut status, face.face, &p, 1.0 + face.gamma * steepest);
    }
    let mut columns = vec![mean];
    if quadratic {
        columns.push(moments);
    }
    if broken {
        columns.push(jump);
    }
    if !problem.contact.is_empty() {
        columns.extend([flux, status]);
    }
    FaceFields {
        source: source.to_owned(),
        dim: mesh.dim,
        space: mesh.dim,
        vertices: (0..faces).flat_map(|f| mesh.face(f)).copied().collect(),
        midpoints: (0..faces).map(|f| mesh.face_midpoint(f)).collect(),
        measures: (0..faces)
            .map(|f| FacePoints::new(space, f, &rule).measure())
            .collect(),
        columns,
    }
}

fn column(name: &str, components: usize, capacity: usize) -> FaceColumn {
    FaceColumn {
        name: name.to_owned(),
        kind: ColumnKind::Value,
        components,
        faces: Vec::with_capacity(capacity),
        values: Vec::with_capacity(capacity * components),
        sensitivity: Vec::with_capacity(capacity),
    }
}

fn push(column: &mut FaceColumn, face: usize, values: &[f64], sensitivity: f64) {
    column.faces.push(face as u32);
    column.values.extend_from_slice(values);
    column.sensitivity.push(sensitivity);
}

/// How much a moment moves when the dofs move by 1: the largest Σ_i |F|⁻¹ |∫_F φ_i λ_a λ_b| over a, b, the
/// same for every face of an affine element.
fn moment_sensitivity(space: &Space, rule: &Rule) -> f64 {
    let dim = space.mesh.dim;
    let mut largest = 0.0_f64;
    for a in 0..dim {
        for b in a..dim {
            let mut means: Basis = [0.0; MAX_DOFS];
            for (on_face, weight) in rule.iter() {
                // The face opposite the last vertex of a cell.
                let phi = space.element.values(dim, &on_face);
                for (mean, phi) in means.iter_mut().zip(phi) {
                    *mean += weight * phi * on_face[a] * on_face[b];
                }
            }
            largest = largest.max(means.iter().map(|mean| mean.abs()).sum());
        }
    }
    largest
}

/// u_h at one point of a face, from both sides.
struct Trace {
    /// Barycentric coordinates on the face, by ascending vertex.
    on_face: [f64; 4],
    first: f64,
    /// On the boundary, the same as `first`.
    second: f64,
}

fn traces(space: &Space, face: usize, rule: &Rule, u: &[f64]) -> Vec<(Trace, f64)> {
    let mesh = space.mesh;
    let [first, second] = mesh.face_cells(face);
    let value = |cell: usize, lambda: &[f64; 4]| space.value(lambda, &space.local(cell, u));
    FacePoints::new(space, face, rule)
        .enumerate()
        .map(|(q, point)| {
            let inside = value(first as usize, &point.lambda);
            let outside = if second == NONE {
                inside
            } else {
                let mut lambda = [0.0; 4];
                for (i, vertex) in mesh.cell(second as usize).iter().enumerate() {
                    let other = mesh.cell(first as usize).iter().position(|v| v == vertex);
                    if let Some(other) = other {
                        lambda[i] = point.lambda[other];
                    }
                }
                value(second as usize, &lambda)
            };
            let trace = Trace {
                on_face: rule.barycentric(q),
                first: inside,
                second: outside,
            };
            (trace, point.weight)
        })
        .collect()
}
