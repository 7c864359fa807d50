//! Honest answers agree: random scenes, each solved twice with another linear solver and the cells in another order,
//! are judged as two codes are. And in each of them the judge sees one value that is off.

use crate::common::{folder, write};
use faceoff::verify::tolerance;
use faceoff_fem::contact::{
    Discretisation, Iteration, Method, Problem, Stop, face_fields, solve_by,
};
use faceoff_fem::linear::{Precision, Settings, Solver};
use faceoff_fem::scene::Scene;
use faceoff_judge::{Verdict, judge};
use faceoff_mesh::field::FaceFields;
use faceoff_mesh::mesh::{Mesh, Triangulation};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};

/// How many random scenes are judged.
const SCENES: u32 = 200;

fn any_scene() -> impl Strategy<Value = (String, &'static str, usize)> {
    let pick = |from: &'static [&'static str]| prop::sample::select(from);
    let f = pick(&[
        "0",
        "-1",
        "-2*pi*sin(2*pi*x)",
        "10*cos(17*x)*y",
        "if(x < 0.3, 40, -9)",
        "-1e-9",
        "1e6*(x-0.5)",
    ]);
    let psi = pick(&[
        "0",
        "0.1",
        "-0.05",
        "0.1*x - 0.02",
        "0.05*sin(9*x)",
        "if(x < 0.4, 0.1, -0.1)",
    ]);
    let g = pick(&["0", "0.2*x", "-1", "0.3 - x*x"]);
    let t = pick(&["0", "0.3", "x - y", "sin(20*y)"]);
    let rules = (
        pick(&["radon-7", "edges-3"]),
        pick(&["gauss-5", "gauss-3", "midpoint"]),
    );
    let scheme = (
        -1.0..3.0,
        pick(&["local", "global"]),
        rules,
        pick(&["cr", "cr-fc", "p2"]),
    );
    let mesh = (2usize..14, 0.3..3.0, 0.3..3.0);
    (mesh, (f, psi, g, t), scheme).prop_map(|((n, x, y), (f, psi, g, t), scheme)| {
        let (power, h, (load, contact), method) = scheme;
        let gamma0 = 10f64.powf(power);
        let text = format!(
            "name = \"random\"\n[mesh]\ngenerator = \"union-jack\"\nn = {n}\nsize = [{x}, {y}]\n\
             [boundary]\ndirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n\
             [data]\nf = \"{f}\"\npsi = \"{psi}\"\ng = \"{g}\"\nt = \"{t}\"\n\
             [method]\ngamma0 = {gamma0:?}\nh = \"{h}\"\nload_quadrature = \"{load}\"\ncontact_quadrature = \"{contact}\"\n"
        );
        (text, method, n)
    })
}

fn solve(
    scene: &Scene,
    mesh: &Triangulation,
    method: Method,
    solver: Solver,
    name: &str,
) -> Option<FaceFields> {
    let problem = Problem::new(scene, mesh, &Discretisation::of(scene, method)).unwrap();
    let linear = Settings {
        solver,
        precision: Precision::F64,
    };
    let told = |_, _| Ok(());
    let found = solve_by(&problem, Iteration::Newton, Stop::default(), linear, told).unwrap();
    found
        .converged
        .then(|| face_fields(&problem, &found.u, name))
}

/// The cells of each block from behind, and the groups with them.
fn reversed(mesh: &Mesh) -> Mesh {
    let mut other = mesh.clone();
    let mut start = 0;
    for block in &mut other.blocks {
        let count = block.len() as u32;
        let nodes = block
            .nodes
            .chunks_exact(block.kind.points())
            .rev()
            .flatten();
        block.nodes = nodes.copied().collect();
        for cell in other.groups.iter_mut().flat_map(|group| &mut group.cells) {
            if (start..start + count).contains(cell) {
                *cell = 2 * start + count - 1 - *cell;
            }
        }
        start += count;
    }
    other
        .groups
        .iter_mut()
        .for_each(|group| group.cells.sort_unstable());
    other
}

#[test]
fn two_honest_answers_agree_on_random_scenes() {
    let folder = folder();
    let config = Config {
        cases: SCENES,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(9),
        ..Config::default()
    };
    let judged = std::cell::Cell::new(0);
    let outcome = TestRunner::new(config).run(&any_scene(), |(text, method, n)| {
        let path = write(folder.path(), "random.toml", &text);
        let scene = Scene::find(&path.to_string_lossy()).unwrap();
        let method: Method = method.parse().unwrap();
        let (name, mesh) = scene.mesh(Some(n)).unwrap();
        let meshes =
            [mesh.clone(), reversed(&mesh)].map(|m| Triangulation::new(&name, &m).unwrap());
        let a = solve(&scene, &meshes[0], method, Solver::Multifrontal, "a");
        let b = solve(&scene, &meshes[1], method, Solver::Faer, "b");
        let (Some(a), Some(mut b)) = (a, b) else {
            return Err(TestCaseError::fail("it did not converge"));
        };
        for field in judge(&a, &b, tolerance(&method)).unwrap() {
            prop_assert_eq!(field.verdict, Verdict::Agree, "{:?}\n{}", field, text);
        }
        judged.set(judged.get() + 1);
        // One value off by a little more than is allowed.
        let size = b.columns[0]
            .values
            .iter()
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        let middle = b.columns[0].values.len() / 2;
        b.columns[0].values[middle] += 3.0 * tolerance(&method) * size.max(f64::MIN_POSITIVE);
        if size > 0.0 {
            let field = &judge(&a, &b, tolerance(&method)).unwrap()[0];
            prop_assert_eq!((field.verdict, field.beyond), (Verdict::Disagree, 1));
        }
        Ok(())
    });
    outcome.unwrap();
    assert_eq!(judged.get(), SCENES);
}
