//! Properties that no other code can test: matrices are derivatives, sums do not depend on the number of cores, and invalid input is rejected.

use std::path::Path;

use faceoff_mesh::mesh::generate::{union_cube, union_jack};
use faceoff_mesh::mesh::{Mesh, Values};

use super::{Assembler, OnFacets, State, Wanted, output, solve};
use crate::judge::judge;
use crate::problem::Problem;

fn problem(text: &str, mesh: &Mesh) -> Problem {
    let text = format!("name = \"test\"\n{text}");
    Problem::parse(Path::new("test.toml"), &text, mesh).unwrap()
}

fn state(u: &[f64]) -> State<'_> {
    State {
        u,
        old: &[],
        parameters: &[],
    }
}

/// Values without a pattern.
fn values(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|k| (step * k as f64).sin()).collect()
}

const FORMS: [(usize, &str); 4] = [
    (
        2,
        "[spaces]\nu = \"P3\"\nw = \"DG1^2\"\n[form]\nF = \"exp(u)*inner(grad(u), grad(v))*dx + u^3*dot(w, test.w)*dx + sqrt(1 + jump(w, n)^2)*avg(v)*dS + u*w[0]*v*ds + dot(w, w)*div(test.w)*dx\"\n",
    ),
    (
        2,
        "[spaces]\nq = \"RT0\"\np = \"N1curl\"\n[form]\nF = \"dot(q, q)*dot(q, test.q)*dx + div(q)^2*div(test.q)*dx + curl(p)*dot(q, test.p)*dx + dot(q, n)^3*dot(test.q, n)*ds + dot(p, q)*curl(test.p)*dx\"\n",
    ),
    (
        3,
        "[spaces]\nu = \"P2^3\"\np = \"CR\"\n[form]\nF = \"det(Identity(3) + grad(u))*div(v)*dx + p^2*dot(u, v)*dx + dot(grad(p), u)*q*dx + avg(p)*dot(avg(u), avg(u))*avg(q)*dS\"\n",
    ),
    (
        3,
        "[spaces]\nu = \"N1curl\"\n[form]\nF = \"dot(curl(u), curl(u))*dot(u, v)*dx + dot(u, u)*dot(curl(u), curl(v))*dx + dot(cross(n, u), cross(n, v))*u[0]*ds\"\n",
    ),
];

fn mesh(dim: usize) -> Mesh {
    if dim == 2 {
        union_jack(3, [1.0, 0.7])
    } else {
        union_cube(2, [1.0, 0.8, 0.9])
    }
}

/// Differences of the residual are the matrix times the direction.
#[test]
fn the_matrix_is_the_derivative_of_the_residual() {
    for (dim, text) in FORMS {
        let mesh = mesh(dim);
        let assembler = Assembler::new(&problem(text, &mesh), &mesh).unwrap();
        let count = assembler.dofs.count();
        let (u, d) = (values(count, 0.7), values(count, 1.3));
        let matrix = assembler.assemble(state(&u), Wanted::Both).matrix;
        let mut slope = vec![0.0; count];
        assembler
            .pattern
            .for_rows(&assembler.dofs, |dof, columns, at| {
                let entries = columns.iter().zip(&matrix[at..]);
                slope[dof] = entries.map(|(column, a)| a * d[*column as usize]).sum();
            });
        let eps = 1e-5;
        let at = |t: f64| {
            let moved: Vec<f64> = u.iter().zip(&d).map(|(u, d)| u + t * d).collect();
            assembler.assemble(state(&moved), Wanted::Residual).residual
        };
        let size = slope.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        for ((after, before), slope) in at(eps).iter().zip(at(-eps)).zip(&slope) {
            let difference = (after - before) / (2.0 * eps);
            assert!(
                (difference - slope).abs() < 1e-7 * size,
                "{difference} {slope}: {text}"
            );
        }
    }
}

/// Bit for bit.
#[test]
fn sums_do_not_depend_on_how_rows_are_divided() {
    for (dim, text) in FORMS {
        let mesh = mesh(dim);
        let mut assembler = Assembler::new(&problem(text, &mesh), &mesh).unwrap();
        let u = values(assembler.dofs.count(), 0.7);
        let state = State {
            u: &u,
            old: &[],
            parameters: &[],
        };
        let of = |count: usize, assembler: &mut Assembler| {
            assembler.divide_into(count);
            let system = assembler.assemble(state, Wanted::Both);
            (system.residual, system.matrix)
        };
        let one = of(1, &mut assembler);
        for count in [2, 3, 7] {
            assert_eq!(of(count, &mut assembler), one, "{count} parts: {text}");
        }
    }
}

#[test]
fn what_has_no_solution_is_an_error_with_a_sentence() {
    let mesh = union_jack(3, [1.0, 1.0]);
    let refused = [
        (
            // Only the difference of the two is known.
            "[spaces]\nu = \"P1\"\np = \"P1\"\n[form]\nF = \"(u - p)*v*dx + (p - u)*q*dx - x*v*dx + x*q*dx\"\n",
            "singular",
        ),
        (
            "[spaces]\nu = \"P2\"\n[form]\nF = \"u*v*ds - v*ds\"\n",
            "singular",
        ),
        (
            "[spaces]\nu = \"P1\"\n[form]\nF = \"u*v*dx - log(x - 2)*v*dx\"\n",
            "not finite",
        ),
        (
            "[spaces]\nu = \"P1\"\n[form]\nF = \"u*v*dx\"\n[dirichlet]\nleft = \"1/x\"\n",
            "Dirichlet value",
        ),
        (
            "[spaces]\nu = \"P1\"\n[form]\nF = \"(exp(u) + u^2 + 1)*v*dx\"\n",
            "test",
        ),
    ];
    for (text, what) in refused {
        let found = solve(&problem(text, &mesh), &mesh);
        let error = found.expect_err(text).to_string();
        assert!(error.contains(what), "{error}");
    }
}

/// Values at nodes are those of the function: a quadratic solution is exact.
#[test]
fn a_quadratic_solution_is_found() {
    let mesh = union_cube(2, [1.0; 3]);
    let text = "[spaces]\nu = \"P2\"\n[form]\nF = \"inner(grad(u), grad(v))*dx + 2*v*dx - 2*x*v*ds(right)\"\ndegree = 2\nfacet_degree = 2\n[dirichlet]\nleft = \"x^2 - y*z\"\n\
                top = \"x^2 - y*z\"\nbottom = \"x^2 - y*z\"\nfront = \"x^2 - y*z\"\nback = \"x^2 - y*z\"\n";
    let solution = solve(&problem(text, &mesh), &mesh).unwrap();
    assert_eq!(solution.steps, 2);
    let (mesh, fields) = output(&solution.assembler, &solution.u);
    for (value, [x, y, z]) in fields[0].values.to_f64().iter().zip(mesh.points.iter()) {
        assert!((value - (x * x - y * z)).abs() < 1e-13);
    }
}

/// A continuous unknown that is written cell by cell, because another unknown needs that, with jumps of little more than rounding.
#[test]
fn a_field_that_jumps_is_no_continuous_function() {
    let mesh = mesh(2);
    let text = "[spaces]\nu = \"P1\"\np = \"P0\"\n[form]\nF = \"inner(grad(u), grad(v))*dx + (p - u)*q*dx - v*dx\"\n[dirichlet]\nu = { left = \"0\" }\n";
    let problem = problem(text, &mesh);
    let solution = solve(&problem, &mesh).unwrap();
    let (mut result, fields) = output(&solution.assembler, &solution.u);
    result.fields = fields;
    let unit = f64::EPSILON;
    let judged = judge(&problem, &mesh, &result, unit).unwrap();
    assert!(judged.rows[0].error < 1e-12, "{:?}", judged.rows[0]);
    let field = result.fields.iter_mut().find(|field| field.name == "u");
    let field = field.expect("u is written");
    let mut numbers = field.values.to_f64();
    let largest = numbers.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let at = numbers
        .iter()
        .position(|v| v.abs() > 0.5 * largest)
        .unwrap();
    numbers[at] += 1e-8 * largest;
    field.values = Values::F64(numbers.into());
    let refused = judge(&problem, &mesh, &result, unit).unwrap_err();
    assert!(
        refused.to_string().contains("is not a function of P1"),
        "{refused}"
    );
    // For numbers with seven digits that is rounding.
    assert!(judge(&problem, &mesh, &result, 5e-7).is_ok());
}

/// Where every dof has a given value, that is the solution.
#[test]
fn what_is_given_everywhere_is_the_solution() {
    let mesh = union_jack(1, [1.0, 1.0]);
    let text = "[spaces]\nu = \"P1\"\n[form]\nF = \"u*v*dx - v*dx\"\n[dirichlet]\ntop = \"x\"\nbottom = \"x\"\n";
    let solution = solve(&problem(text, &mesh), &mesh).unwrap();
    assert!(mesh.points.len() == 4 && solution.u.len() == 4);
    let (cells, fields) = output(&solution.assembler, &solution.u);
    for (x, u) in cells.points.iter().zip(fields[0].values.to_f64().iter()) {
        assert!((x[0] - u).abs() < 1e-15, "{x:?}: {u}");
    }
}

/// Means of xy + y on facets are their values at midpoints plus what xy bends; each changes by as much as its dofs do at most.
#[test]
fn means_on_facets_are_those_by_hand() {
    let text = "[spaces]\nu = \"P2\"\n[form]\nF = \"u*v*dx - (x*y + y)*v*dx\"\n";
    let mesh = mesh(2);
    let problem = problem(text, &mesh);
    let solution = solve(&problem, &mesh).unwrap();
    let assembler = Assembler::new(&problem, &mesh).unwrap();
    let (mut result, fields) = output(&assembler, &solution.u);
    result.fields = fields;
    let texts = ["u*ds(right)", "dot(grad(u), n)*ds(right)"].map(str::to_owned);
    let of = OnFacets::new(&problem, &texts).unwrap();
    let found = of.of("u", &mesh, &result, 0.0).unwrap();
    let Values::F64(values) = &found.mesh.fields[0].values else {
        panic!("{:?}", found.mesh.fields);
    };
    assert_eq!(found.mesh.blocks[0].len(), 3);
    for (facet, means) in found.mesh.blocks[0].cells().zip(values.chunks_exact(2)) {
        let ends: Vec<[f64; 3]> = facet
            .iter()
            .map(|k| found.mesh.points[*k as usize])
            .collect();
        let y = (ends[0][1] + ends[1][1]) / 2.0;
        assert!(ends.iter().all(|x| x[0] == 1.0));
        // u = 2y and ∂ₓu = y there.
        assert!((means[0] - 2.0 * y).abs() < 1e-13, "{means:?} at {y}");
        assert!((means[1] - y).abs() < 1e-12, "{means:?} at {y}");
    }
    // The slope of P2 is at most that of its basis, which changes by some 1/h.
    let largest = 1.4;
    assert!(
        found.scale > largest && found.scale < 20.0 * 3.0 * largest,
        "{}",
        found.scale
    );
    let of_u = OnFacets::new(&problem, &texts[..1]).unwrap();
    let scale = of_u.of("u", &mesh, &result, 0.0).unwrap().scale;
    assert!((scale / largest - 1.0).abs() < 1e-12, "{scale}");
}
