//! The kernels one by one on the Union-Jack mesh of the unit square: `cargo bench --bench kernels`.
//! The argument is n; times are per call.

use divan::{Bencher, black_box};
use faceoff_fem::assembly;
use faceoff_fem::assembly::Stiffness;
use faceoff_fem::certify::certify;
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, face_fields, solve};
use faceoff_fem::element::{CR, P2, Space};
use faceoff_fem::linear::{Analysis, Role, Settings, condense};
use faceoff_fem::scene::Scene;
use faceoff_judge as compare;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::mesh::generate::union_jack;

const N: [usize; 3] = [32, 128, 256];

fn main() {
    divan::main();
}

fn mesh(n: usize) -> Triangulation {
    Triangulation::new("union-jack", &union_jack(n, [1.0, 1.0])).expect("a sound mesh")
}

/// The problem of section 6.1, and a function that no kernel knows.
fn problem<'a>(scene: &'a Scene, mesh: &'a Triangulation, method: &str) -> (Problem<'a>, Vec<f64>) {
    let method: Method = method.parse().expect("a method");
    let problem =
        Problem::new(scene, mesh, &Discretisation::of(scene, method)).expect("a sound problem");
    let u = (0..problem.space.dofs).map(|k| (7.3 * k as f64).sin());
    let u = u.collect();
    (problem, u)
}

fn scene() -> Scene {
    Scene::find("one-zone").expect("a built-in scene")
}

#[divan::bench(args = N)]
fn topology(bencher: Bencher, n: usize) {
    let mesh = union_jack(n, [1.0, 1.0]);
    bencher.bench(|| Triangulation::new("union-jack", black_box(&mesh)));
}

#[divan::bench(args = N)]
fn dofs_p2(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    bencher.bench(|| Space::new(black_box(&mesh), &P2).dofs);
}

#[divan::bench(args = N)]
fn element_matrices_cr(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    element_matrices(bencher, &Space::new(&mesh, &CR));
}

#[divan::bench(args = N)]
fn element_matrices_p2(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    element_matrices(bencher, &Space::new(&mesh, &P2));
}

/// Those of the stiffness, all cells one after the other.
fn element_matrices(bencher: Bencher, space: &Space) {
    let stiffness = Stiffness::new(space);
    let mut matrix = vec![0.0; space.local_dofs * space.local_dofs];
    bencher.bench_local(|| {
        for cell in 0..space.mesh.cell_count() {
            stiffness.cell_matrix(cell, black_box(&mut matrix));
        }
    });
}

/// The same written for the plane alone, (e_i·e_j)/|κ| of the edge vectors: what serves space too should not take longer.
#[divan::bench(args = N)]
fn element_matrices_of_the_plane_cr(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    let space = Space::new(&mesh, &CR);
    let mut general = [0.0; 9];
    Stiffness::new(&space).cell_matrix(n, &mut general);
    let plane = plane_matrix(&mesh, n);
    let pairs = general.iter().zip(&plane);
    assert!(
        pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12),
        "the formula is not that of the assembly"
    );
    bencher.bench_local(|| {
        for cell in 0..mesh.cell_count() {
            black_box(plane_matrix(&mesh, cell));
        }
    });
}

fn plane_matrix(mesh: &Triangulation, cell: usize) -> [f64; 9] {
    let vertices = mesh.cell(cell);
    let at = |k: usize| mesh.points[vertices[k % 3] as usize];
    let edge = |k: usize| [0, 1].map(|axis| at(k + 2)[axis] - at(k + 1)[axis]);
    let edges = [edge(0), edge(1), edge(2)];
    let area = 0.5 * (edges[0][0] * edges[1][1] - edges[0][1] * edges[1][0]).abs();
    let mut matrix = [0.0; 9];
    for i in 0..3 {
        for j in 0..3 {
            let product = edges[i][0] * edges[j][0] + edges[i][1] * edges[j][1];
            matrix[3 * i + j] = product / area;
        }
    }
    matrix
}

#[divan::bench(args = N)]
fn load_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    bencher.bench(|| {
        let mut b = vec![0.0; problem.space.dofs];
        assembly::add_load(&problem.space, &scene.data().f, &problem.cell_rule, &mut b).map(|()| b)
    });
}

#[divan::bench(args = N)]
fn ordering_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    let roles = roles(&problem);
    bencher.bench(|| Analysis::new(black_box(&problem.stiffness), &roles, &[], false).entries());
}

#[divan::bench(args = N)]
fn factor_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    factor(bencher, &problem);
}

#[divan::bench(args = N)]
fn factor_p2(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "p2");
    factor(bencher, &problem);
}

/// Ordering, factorisation and the Schur complement on the contact cells.
fn factor(bencher: Bencher, problem: &Problem) {
    let roles = roles(problem);
    bencher.bench(|| {
        let settings = Settings::default();
        let cells = black_box(&problem.stiffness);
        condense(cells, &roles, &[], problem.load.clone(), settings, None)
            .map(|done| done.map(|d| d.3))
    });
}

#[divan::bench(args = N)]
fn residual_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, u) = problem(&scene, &mesh, "cr");
    bencher.bench(|| problem.residual(black_box(&u)));
}

#[divan::bench(args = N)]
fn residual_p2(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, u) = problem(&scene, &mesh, "p2");
    bencher.bench(|| problem.residual(black_box(&u)));
}

#[divan::bench(args = N)]
fn fields_of_faces_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, u) = problem(&scene, &mesh, "cr");
    bencher.bench(|| face_fields(black_box(&problem), &u, "a"));
}

#[divan::bench(args = N)]
fn comparison_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, u) = problem(&scene, &mesh, "cr");
    let (a, b) = (
        face_fields(&problem, &u, "a"),
        face_fields(&problem, &u, "b"),
    );
    bencher.bench(|| compare::judge(black_box(&a), &b, 1e-12));
}

/// The scene with its contact side held: what is left is linear.
const LINEAR: &str = r#"
name = "linear"
[mesh]
generator = "union-jack"
[boundary]
dirichlet = ["top", "bottom"]
neumann = ["left", "right"]
[data]
f = "-2*pi*sin(2*pi*x)"
"#;

/// A linear scene by the solver for contact: it should take what `linear_alone_cr` takes.
#[divan::bench(args = N)]
fn linear_scene_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (Scene::parse(LINEAR).expect("a scene"), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    bencher.bench(|| solved(&problem));
}

/// The same by the linear solver alone: factor, solution, one step of refinement, and the residual that tells.
#[divan::bench(args = N)]
fn linear_alone_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (Scene::parse(LINEAR).expect("a scene"), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    let roles = roles(&problem);
    let rest = |u: &[f64]| {
        let mut r = problem.stiffness.times(u);
        for (r, b) in r.iter_mut().zip(&problem.load) {
            *r = b - *r;
        }
        r
    };
    bencher.bench(|| {
        let cells = black_box(&problem.stiffness);
        let (factor, reduced, ..) = condense(
            cells,
            &roles,
            &[],
            problem.load.clone(),
            Settings::default(),
            None,
        )
        .expect("a sound matrix")
        .expect("a factor");
        let mut u = problem.start();
        factor.expand(reduced, &[], &mut u);
        let mut step = vec![0.0; u.len()];
        factor.expand(factor.reduce(&rest(&u)), &[], &mut step);
        for (u, step) in u.iter_mut().zip(&step) {
            *u += step;
        }
        rest(&u)
    });
}

/// A contact problem, and what a certificate takes: a solve that asks for none pays nothing of it.
#[divan::bench(args = N)]
fn contact_scene_cr_fc(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr-fc");
    bencher.bench(|| solved(&problem));
}

#[divan::bench(args = N)]
fn certificate_cr_fc(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr-fc");
    let u = solved(&problem);
    bencher.bench(|| certify(&problem, black_box(&u)).map(|found| found.g));
}

fn solved(problem: &Problem) -> Vec<f64> {
    let told = |_, _| Ok(());
    let solution = solve(problem, Iteration::Newton, Stop::default(), told);
    solution.expect("a solution").u
}

/// Γ_D is fixed, the contact cells are kept.
fn roles(problem: &Problem) -> Vec<Role> {
    let mut roles = vec![Role::Eliminated; problem.space.dofs];
    for face in &problem.contact {
        for &dof in problem.space.cell_dofs(face.cell) {
            roles[dof as usize] = Role::Kept;
        }
    }
    for (role, g) in roles.iter_mut().zip(problem.dirichlet.iter()) {
        if g.is_some() {
            *role = Role::Fixed;
        }
    }
    roles
}
