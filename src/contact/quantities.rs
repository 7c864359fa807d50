//! What is read off a discrete solution, whichever engine it came from: fields on the faces for
//! the comparison, and the numbers that section 6 of the paper reports.

use super::Problem;
use crate::assembly::{self, FacePoints};
use crate::element::{Basis, Space};
use crate::field::{ColumnKind, FaceColumn, FaceFields};
use crate::mesh::NONE;
use crate::quadrature::{self, Rule};

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
    /// Maximal runs of contact along Γ_C.
    pub contact_set: Vec<[f64; 2]>,
}

/// The numbers of u (values at all dofs).
pub fn quantities(problem: &Problem, u: &[f64]) -> Quantities {
    let (mut flux, mut residual) = (0.0, 0.0);
    for face in &problem.contact {
        let local = problem.space.local(face.cell, u);
        for point in &face.points {
            let trace = point.trace(face.gamma, &local);
            flux += point.weight * trace.flux;
            residual += point.weight * trace.gap.max(face.gamma * trace.flux).powi(2);
        }
    }
    Quantities {
        grad_norm_sq: problem.stiffness.energy(u),
        l2_norm: assembly::norm_squared(&problem.space, u).sqrt(),
        contact_flux: flux,
        contact_residual: residual.sqrt(),
        contact_set: contact_set(problem, u),
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
    let rule = quadrature::interval("gauss-5").expect("invariant: a rule of the table");
    let faces = mesh.face_count();
    let mut mean = column("mean", 1, faces);
    let mut moments = column("moments", mesh.dim * (mesh.dim + 1) / 2, faces);
    let mut jump = column("jump", 1, faces);
    let (quadratic, broken) = (space.element.degree() == 2, space.element.on().faces);
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
            push(&mut moments, face, &values, 1.0);
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
    let value = |cell: usize, lambda: &[f64; 4]| -> f64 {
        let local: Basis = space.local(cell, u);
        let phi = space.element.values(mesh.dim, lambda);
        phi.iter().zip(&local).map(|(p, u)| p * u).sum()
    };
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

/// Maximal runs of contact along Γ_C in the plane. Positions are coordinates where Γ_C lies on
/// one line parallel to an axis; else arc length, connected pieces one after the other. Inside a
/// face the end of a run is where P, linear between quadrature points, vanishes.
fn contact_set(problem: &Problem, u: &[f64]) -> Vec<[f64; 2]> {
    let mut runs: Vec<[f64; 2]> = Vec::new();
    let mut offset = 0.0;
    for chain in chains(problem) {
        let straight = chain.axis;
        let mut from = straight.map_or(offset, |_| chain.start);
        for &(index, reversed) in &chain.faces {
            let face = &problem.contact[index];
            let to = from + face.measure;
            let local = problem.space.local(face.cell, u);
            let mut samples: Vec<(f64, f64)> = face
                .points
                .iter()
                .enumerate()
                .map(|(q, point)| {
                    let s = problem.face_rule.barycentric(q)[1];
                    let s = if reversed { 1.0 - s } else { s };
                    (from + s * face.measure, point.trace(face.gamma, &local).p)
                })
                .collect();
            samples.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (k, &(s, p)) in samples.iter().enumerate() {
                if p > 0.0 {
                    continue;
                }
                let meet = |other: Option<&(f64, f64)>, end: f64| match other {
                    None => end,
                    Some(&(_, q)) if q <= 0.0 => end,
                    Some(&(t, q)) => s + (t - s) * p / (p - q),
                };
                let before = if k > 0 { samples.get(k - 1) } else { None };
                let after = samples.get(k + 1);
                let low = meet(before, before.map_or(from, |b| b.0));
                let high = meet(after, after.map_or(to, |a| a.0));
                let joins = 1e-9 * face.measure;
                match runs.last_mut() {
                    Some(run) if low <= run[1] + joins && low >= run[0] => {
                        run[1] = run[1].max(high);
                    }
                    _ => runs.push([low, high]),
                }
            }
            from = to;
        }
        offset = from;
    }
    runs
}

/// Contact faces one after the other.
struct Chain {
    /// Indices into the contact faces, and whether the face is passed against its vertices' order.
    faces: Vec<(usize, bool)>,
    /// The axis that all of Γ_C is parallel to.
    axis: Option<usize>,
    /// The coordinate along that axis where the chain starts.
    start: f64,
}

fn chains(problem: &Problem) -> Vec<Chain> {
    let mesh = problem.space.mesh;
    let vertices = |k: usize| {
        let face = mesh.face(problem.contact[k].face);
        [face[0], face[1]]
    };
    let at = |vertex: u32| mesh.points[vertex as usize];
    let count = problem.contact.len();
    let mut touching: std::collections::BTreeMap<u32, Vec<usize>> = Default::default();
    for k in 0..count {
        for vertex in vertices(k) {
            touching.entry(vertex).or_default().push(k);
        }
    }
    let axis = (0..2).find(|&axis| {
        let level = |v: u32| at(v)[1 - axis];
        count > 0 && touching.keys().all(|&v| level(v) == level(vertices(0)[0]))
    });
    let key = |vertex: u32| {
        let p = at(vertex);
        (p[0], p[1], vertex)
    };
    let order = |a: &u32, b: &u32| {
        let (a, b) = (key(*a), key(*b));
        a.0.total_cmp(&b.0)
            .then(a.1.total_cmp(&b.1))
            .then(a.2.cmp(&b.2))
    };
    // Chains start at loose ends; what is left over is closed and starts anywhere.
    let mut starts: Vec<u32> = touching.keys().copied().collect();
    starts.sort_by(|a, b| {
        let loose = |v: &u32| touching[v].len() != 1;
        loose(a).cmp(&loose(b)).then(order(a, b))
    });
    let mut used = vec![false; count];
    let mut chains = Vec::new();
    for start in starts {
        let mut vertex = start;
        let mut faces = Vec::new();
        while let Some(&k) = touching[&vertex].iter().find(|&&k| !used[k]) {
            used[k] = true;
            let [a, b] = vertices(k);
            faces.push((k, vertex == b));
            vertex = if vertex == a { b } else { a };
        }
        if !faces.is_empty() {
            chains.push(Chain {
                faces,
                axis,
                start: axis.map_or(0.0, |axis| at(start)[axis]),
            });
        }
    }
    chains
}
