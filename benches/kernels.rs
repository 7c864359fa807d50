//! The kernels one by one on the Union-Jack mesh of the unit square: `cargo bench --bench kernels`.
//! The argument is n; times are per call.

use divan::{Bencher, black_box};
use faceoff::contact::{Method, Problem, face_fields};
use faceoff::element::{CR, P2, Space};
use faceoff::linear::{Cholesky, nested_dissection};
use faceoff::mesh::Triangulation;
use faceoff::mesh::generate::union_jack;
use faceoff::scene::Scene;
use faceoff::{assembly, compare};

const N: [usize; 3] = [32, 128, 256];

fn main() {
    divan::main();
}

fn mesh(n: usize) -> Triangulation {
    Triangulation::new("union-jack", &union_jack(n, [1.0, 1.0])).expect("a sound mesh")
}

/// The problem of section 6.1, and a function that no kernel knows.
fn problem<'a>(scene: &Scene, mesh: &'a Triangulation, method: &str) -> (Problem<'a>, Vec<f64>) {
    let method: Method = method.parse().expect("a method");
    let problem = Problem::new(scene, mesh, method).expect("a sound problem");
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
fn stiffness_cr(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    let space = Space::new(&mesh, &CR);
    bencher.bench(|| assembly::stiffness(black_box(&space)));
}

#[divan::bench(args = N)]
fn stiffness_p2(bencher: Bencher, n: usize) {
    let mesh = mesh(n);
    let space = Space::new(&mesh, &P2);
    bencher.bench(|| assembly::stiffness(black_box(&space)));
}

#[divan::bench(args = N)]
fn load_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    bencher.bench(|| {
        let mut b = vec![0.0; problem.space.dofs];
        assembly::add_load(&problem.space, &scene.data.f, &problem.cell_rule, &mut b).map(|()| b)
    });
}

#[divan::bench(args = N)]
fn ordering_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    let (points, graph, last) = graph(&problem);
    bencher.bench(|| nested_dissection(black_box(&points), &graph, &last));
}

#[divan::bench(args = N)]
fn factor_cr(bencher: Bencher, n: usize) {
    let (scene, mesh) = (scene(), mesh(n));
    let (problem, _) = problem(&scene, &mesh, "cr");
    let (points, graph, last) = graph(&problem);
    let order = nested_dissection(&points, &graph, &last);
    let matrix = problem.stiffness.block(&free(&problem), points.len());
    bencher.bench(|| Cholesky::factor(black_box(&matrix), &order).map(|f| f.entries()));
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

/// Number of each free dof.
fn free(problem: &Problem) -> Vec<Option<u32>> {
    let mut next = 0..;
    let numbers = problem.dirichlet.iter();
    numbers
        .map(|g| if g.is_none() { next.next() } else { None })
        .collect()
}

/// Points and graph of the free dofs, and none that must come last.
fn graph(problem: &Problem) -> (Vec<[f64; 3]>, (Vec<usize>, Vec<u32>), Vec<bool>) {
    let free = free(problem);
    let dofs = free.iter().zip(&problem.space.points);
    let points: Vec<[f64; 3]> = dofs.filter(|(k, _)| k.is_some()).map(|(_, p)| *p).collect();
    let graph = problem.stiffness.block(&free, points.len()).graph();
    let last = vec![false; points.len()];
    (points, graph, last)
}
