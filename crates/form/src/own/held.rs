//! Dirichlet values, initial values and means: prescribed dofs.

use faceoff_fem::linear::General;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use super::assemble::Assembler;
use super::dofs::{Dofs, is_on_facet, sign};
use super::element::{Shape, carriers, vectors};
use super::work::facets;
use crate::grid::Grid;
use crate::problem::{Element, Problem};
use crate::scalar::{Id, Node};

/// The dofs that are prescribed.
#[derive(Debug, Clone)]
pub struct Held {
    /// Is a dof prescribed?
    pub is_held: Vec<bool>,
    /// Its value.
    pub values: Vec<f64>,
}

/// The value of an expression in coordinates and parameters.
pub fn value(problem: &Problem, id: Id, parameters: &[f64], at: &[f64; 3]) -> f64 {
    problem.scalars.value(id, &|node| match node {
        Node::Coordinate(axis) => at[axis],
        Node::Parameter(k) => parameters[k],
        _ => f64::NAN,
    })
}

/// Dirichlet values; if two groups share a dof, the later one counts.
///
/// # Errors
/// Values that are not finite.
pub fn held(assembler: &Assembler, source: &Mesh, parameters: &[f64]) -> Result<Held> {
    let Assembler {
        problem,
        mesh,
        dofs,
        ..
    } = assembler;
    let mut all = Held {
        is_held: vec![false; dofs.count()],
        values: vec![0.0; dofs.count()],
    };
    for condition in problem.held() {
        let element = problem.unknowns[condition.unknown].space.element;
        let facets = facets(problem, mesh, source, condition.group);
        let Some(component) = condition.component else {
            moments(assembler, &condition, &facets, parameters, &mut all)?;
            continue;
        };
        let nodes = Shape::of(element, mesh.shape).nodes(mesh.dim);
        for face in facets {
            let cell = mesh.face_cells(face as usize)[0] as usize;
            let local = mesh.local_face(cell, face as usize);
            let vertices = mesh.vertices(cell);
            for (i, node) in dofs.of_cell(condition.unknown, cell).iter().enumerate() {
                if is_on_facet(element, mesh.shape, mesh.dim, i, local) {
                    let dof = dofs.first[*node as usize] as usize + component;
                    let at = mesh.place(&vertices, &nodes[i]);
                    all.is_held[dof] = true;
                    all.values[dof] = value(problem, condition.values[0], parameters, &at);
                }
            }
        }
    }
    if let Some(k) = all.values.iter().position(|v| !v.is_finite()) {
        return Err(Error::Solver {
            what: format!("a Dirichlet value of {} is {}", problem.name, all.values[k]),
            remedy: "give values that are finite on all of the group".into(),
        });
    }
    Ok(all)
}

/// Prescribes the normal or tangential moments of a vector on facets, by projection of g's.
fn moments(
    assembler: &Assembler,
    condition: &crate::problem::Held,
    facets: &[u32],
    parameters: &[f64],
    all: &mut Held,
) -> Result<()> {
    let Assembler {
        problem,
        mesh,
        dofs,
        ..
    } = assembler;
    let (dim, element) = (mesh.dim, problem.unknowns[condition.unknown].space.element);
    let [_, rule] = problem.rules();
    // Entries of the product of traces, and right-hand sides.
    let mut entries: Vec<(u32, u32, f64)> = Vec::new();
    let mut right: Vec<(u32, f64)> = Vec::new();
    for face in facets {
        let cell = mesh.face_cells(*face as usize)[0] as usize;
        let local = mesh.local_face(cell, *face as usize);
        let geometry = mesh.geometry(cell);
        let normal: [f64; 3] = geometry.normal(local).into();
        let own: Vec<(u32, [[f64; 3]; 4])> = carriers(element, dim)
            .into_iter()
            .zip(dofs.of_cell(condition.unknown, cell))
            .enumerate()
            .filter(|(i, _)| is_on_facet(element, mesh.shape, dim, *i, local))
            .map(|(_, (carrier, node))| {
                let sign = sign(mesh, cell, carrier);
                let vectors = vectors(element, &geometry, carrier);
                (
                    dofs.first[*node as usize],
                    vectors.map(|v| v.map(|x| sign * x)),
                )
            })
            .collect();
        let corners: Vec<usize> = (0..=dim).filter(|i| *i != local).collect();
        for (q, weight) in rule.weights.iter().enumerate() {
            let weight = weight * geometry.face_measure(local);
            let on_face = rule.barycentric(q);
            let mut lambda = [0.0; 4];
            corners
                .iter()
                .zip(on_face)
                .for_each(|(corner, l)| lambda[*corner] = l);
            let at = geometry.point(&lambda);
            let mut g = [0.0; 3];
            for (g, id) in g.iter_mut().zip(&condition.values) {
                *g = value(problem, *id, parameters, &at);
            }
            let g = trace(element, dim, &g, &normal);
            let traces: Vec<(u32, [f64; 3])> = own
                .iter()
                .map(|(dof, vectors)| {
                    let mut v = [0.0; 3];
                    for (l, vector) in lambda.iter().zip(vectors) {
                        v.iter_mut().zip(vector).for_each(|(v, x)| *v += l * x);
                    }
                    (*dof, trace(element, dim, &v, &normal))
                })
                .collect();
            let dot =
                |a: &[f64; 3], b: &[f64; 3]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
            for (i, v) in &traces {
                right.push((*i, weight * dot(&g, v)));
                entries.extend(traces.iter().map(|(j, w)| (*i, *j, weight * dot(v, w))));
            }
        }
    }
    let mut found: Vec<u32> = right.iter().map(|(dof, _)| *dof).collect();
    found.sort_unstable();
    found.dedup();
    let number = |dof: u32| found.binary_search(&dof).unwrap_or(0);
    let mut b = vec![0.0; found.len()];
    right
        .iter()
        .for_each(|(dof, value)| b[number(*dof)] += value);
    let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); found.len()];
    for (i, j, value) in entries {
        let (row, j) = (&mut rows[number(i)], number(j));
        match row.iter_mut().find(|(column, _)| *column == j) {
            Some((_, sum)) => *sum += value,
            None => row.push((j, value)),
        }
    }
    if found.is_empty() {
        return Ok(());
    }
    rows.iter_mut()
        .for_each(|row| row.sort_unstable_by_key(|entry| entry.0));
    let x = General::new(rows, &[], None)?.solve(&b)?;
    for (dof, value) in found.iter().zip(x) {
        all.is_held[*dof as usize] = true;
        all.values[*dof as usize] = value;
    }
    Ok(())
}

/// The trace that a boundary value prescribes: u · n, or the tangential part n × u.
fn trace(element: Element, dim: usize, u: &[f64; 3], n: &[f64; 3]) -> [f64; 3] {
    match (element, dim) {
        (Element::Nedelec, 2) => [n[0] * u[1] - n[1] * u[0], 0.0, 0.0],
        (Element::Nedelec, _) => [
            n[1] * u[2] - n[2] * u[1],
            n[2] * u[0] - n[0] * u[2],
            n[0] * u[1] - n[1] * u[0],
        ],
        _ => [u.iter().zip(n).map(|(u, n)| u * n).sum(), 0.0, 0.0],
    }
}

/// The initial values of the unknowns for time steps; all 0 if there are none.
pub fn initial(problem: &Problem, mesh: &Grid, dofs: &Dofs, parameters: &[f64]) -> Vec<f64> {
    let mut u = vec![0.0; dofs.count()];
    let all = problem.time.iter().flat_map(|time| &time.initial);
    for initial in all {
        let element = problem.unknowns[initial.unknown].space.element;
        let nodes = Shape::of(element, mesh.shape).nodes(mesh.dim);
        for cell in 0..mesh.cell_count() {
            let vertices = mesh.vertices(cell);
            for (node, lambda) in dofs.of_cell(initial.unknown, cell).iter().zip(&nodes) {
                let dof = dofs.first[*node as usize] as usize + initial.component;
                u[dof] = value(
                    problem,
                    initial.value,
                    parameters,
                    &mesh.place(&vertices, lambda),
                );
            }
        }
    }
    u
}

/// For each prescribed mean, the integrals of the basis functions, and the value of their sum.
pub fn means(problem: &Problem, mesh: &Grid, dofs: &Dofs) -> Vec<(Vec<f64>, f64)> {
    let [rule, _] = problem.rules();
    let points: Vec<[f64; 4]> = (0..rule.weights.len())
        .map(|q| rule.barycentric(q))
        .collect();
    let each = problem.means.iter().map(|mean| {
        let shape = Shape::of(problem.unknowns[mean.unknown].space.element, mesh.shape);
        let table = shape.table(mesh.dim, &points);
        let (mut row, mut volume) = (vec![0.0; dofs.count()], 0.0);
        for cell in 0..mesh.cell_count() {
            let vertices = mesh.vertices(cell);
            for (q, weight) in rule.weights.iter().enumerate() {
                let part = weight * mesh.map(&vertices, &points[q]).measure;
                volume += part;
                let nodes = dofs.of_cell(mean.unknown, cell).iter();
                for (node, phi) in nodes.zip(table.row(0, q)) {
                    row[dofs.first[*node as usize] as usize] += phi * part;
                }
            }
        }
        (row, volume * mean.value)
    });
    each.collect()
}
