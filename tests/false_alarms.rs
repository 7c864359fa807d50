//! Honest answers agree: random scenes, each solved twice with another linear solver and the cells in another order,
//! are judged as two codes are. And in each of them the judge sees one value that is off. Then the codes themselves: thin domains,
//! γ₀ from 1e-6 to 1e6, 2D and 3D; and faults planted in them.

use crate::common::{companion_with, folder, run, test_config, times, write};
use faceoff::run::{ROUNDING, tolerance};
use faceoff_fem::contact::{
    Discretisation, Iteration, Method, Problem, Stop, face_fields, solve_by,
};
use faceoff_fem::linear::{Precision, Settings, Solver};
use faceoff_fem::scene::Scene;
use faceoff_judge::{Verdict, judge};
use faceoff_mesh::field::FaceFields;
use faceoff_mesh::mesh::{Mesh, Triangulation};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// How many random scenes are judged.
const SCENES: u32 = 200;

const LOADS: [&str; 7] = [
    "0",
    "-1",
    "-2*pi*sin(2*pi*x)",
    "10*cos(17*x)*y",
    "if(x < 0.3, 40, -9)",
    "-1e-9",
    "1e6*(x-0.5)",
];
const OBSTACLES: [&str; 6] = [
    "0",
    "0.1",
    "-0.05",
    "0.1*x - 0.02",
    "0.05*sin(9*x)",
    "if(x < 0.4, 0.1, -0.1)",
];

pub fn any_scene() -> impl Strategy<Value = (String, &'static str, usize)> {
    let pick = |from: &'static [&'static str]| prop::sample::select(from);
    let f = pick(&LOADS);
    let psi = pick(&OBSTACLES);
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
    let judged = std::cell::Cell::new(0);
    let outcome = TestRunner::new(test_config(SCENES)).run(&any_scene(), |(text, method, n)| {
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

/// What the extreme scenes are drawn from.
type Drawn = (
    (bool, usize, [f64; 3]),
    [prop::sample::Index; 6],
    (f64, bool),
    Vec<bool>,
);

fn extreme_scene() -> impl Strategy<Value = Drawn> {
    let index = any::<prop::sample::Index>;
    let sides = [-3.0..0.0, -3.0..0.0, -3.0..0.0];
    (
        (any::<bool>(), 1usize..12, sides),
        [index(), index(), index(), index(), index(), index()],
        (-6.0..6.0, any::<bool>()),
        prop::collection::vec(prop::bool::weighted(0.15), 4),
    )
}

/// A scene on a box of these sides, with Γ_D on one side, Γ_C on the bottom and sometimes on others.
fn text(name: &str, ((is_3d, n, sides), data, (power, is_global), more): &Drawn) -> String {
    let (dim, n) = if *is_3d { (3, 1 + n / 3) } else { (2, 1 + n) };
    let pick = |k: usize, of: &[&'static str]| data[k].get(of).to_string();
    let mut others = vec!["left", "right", "top"];
    if *is_3d {
        others.extend(["front", "back"]);
    }
    let held = others.remove(data[0].index(others.len()));
    let (contact, free): (Vec<_>, Vec<_>) = others
        .into_iter()
        .zip(more)
        .partition(|(_, is_contact)| **is_contact);
    let names =
        |of: Vec<(&'static str, &bool)>| of.into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    let contact = [&["bottom"][..], &names(contact)].concat();
    let size: Vec<f64> = sides[..dim]
        .iter()
        .map(|power| 10f64.powf(*power))
        .collect();
    let rules: &[&str] = match dim {
        2 => &["gauss-5", "gauss-3", "gauss-2", "midpoint"],
        _ => &["radon-7", "edges-3", "centroid"],
    };
    format!(
        "name = \"{name}\"\n[mesh]\ngenerator = \"{}\"\nn = {n}\nsize = {size:?}\n\
         [boundary]\ndirichlet = [\"{held}\"]\nneumann = {:?}\ncontact = {contact:?}\n\
         [data]\nf = \"{}\"\npsi = \"{}\"\ng = \"{}\"\nt = \"{}\"\n\
         [method]\ngamma0 = {:?}\nh = \"{}\"\ncontact_quadrature = \"{}\"\n",
        if *is_3d { "union-cube" } else { "union-jack" },
        names(free),
        pick(1, &LOADS),
        pick(2, &OBSTACLES),
        pick(3, &["0", "0.2*x", "-1", "0.3 - x*x"]),
        pick(4, &["0", "0.3", "x - y", "sin(20*y)"]),
        10f64.powf(*power),
        if *is_global { "global" } else { "local" },
        pick(5, rules),
    )
}

/// Runs codes on so many random scenes, each by one of the methods, and holds each verdict against the residuals: where they are
/// rounding there is no `disagree`.
fn no_false_alarm(engines: &str, scenes: usize) {
    let folder = folder();
    let at = folder.path();
    let mut runner = TestRunner::new(test_config(1));
    let (mut solved, mut unsolved) = (0, 0);
    for (k, method) in ["cr", "cr-fc", "p2"].into_iter().enumerate() {
        let names: Vec<String> = (0..scenes / 3).map(|i| format!("s{k}-{i}.toml")).collect();
        for name in &names {
            let drawn = extreme_scene().new_tree(&mut runner).unwrap().current();
            write(at, name, &text(name, &drawn));
        }
        let mut words = vec![
            "verify",
            "--engines",
            engines,
            "--methods",
            method,
            "--json",
            "-",
        ];
        words.extend(names.iter().map(String::as_str));
        let outcome = run(at, &words).json();
        let cases = outcome["cases"].as_array().unwrap();
        assert_eq!(cases.len(), names.len());
        for case in cases {
            let mut all = case["engines"].as_array().unwrap().iter();
            if all.all(|e| e["residual"].as_f64().is_some_and(|r| r <= ROUNDING)) {
                solved += 1;
                let scene =
                    std::fs::read_to_string(at.join(case["scene"].as_str().unwrap())).unwrap();
                assert_ne!(
                    case["verdict"], "disagree",
                    "{method}: {scene}\n{}",
                    case["pairs"]
                );
            } else {
                unsolved += 1;
            }
        }
    }
    println!("{engines}: {solved} solved, {unsolved} not");
    // P2 with a tiny γ₀ on thin cells does not always come to an end.
    assert!(unsolved <= scenes / 20, "{unsolved} of {scenes}");
}

#[test]
fn freefem_agrees_on_extreme_scenes() {
    no_false_alarm("rust,freefem", 20 * times());
}

#[test]
fn all_three_agree_on_extreme_scenes() {
    let scenes = if times() > 1 { 6 * times() } else { 3 };
    no_false_alarm("rust,freefem,fenicsx", scenes);
}

/// Ten faults in FreeFEM's script, on three random scenes each: none agrees, conditioned or not.
#[test]
fn no_planted_fault_agrees_on_random_scenes() {
    let faults = [
        (
            "gamma[][Ch(cell, 0)] = value;",
            "gamma[][Ch(cell, 0)] = 1.001*value;",
        ),
        (
            "gamma[][Ch(cell, 0)] = value;",
            "gamma[][Ch(cell, 0)] = (c + 1 > 0)*value*(1 + 1e-6);",
        ),
        ("(t*v)", "(-t*v)"),
        ("(f*v)", "((1 + 1e-7)*f*v)"),
        ("int cellOrder = findCellOrder()", "int cellOrder = 3"),
        ("faceOrder = findFaceOrder()", "faceOrder = 4"),
        (
            "func psi = scenePsi(scene);",
            "func psi = scenePsi(scene)*(1 + 1e-6);",
        ),
        (
            "func g = sceneG(scene);",
            "func g = sceneG(scene)*(1 + 1e-8);",
        ),
        (
            "(law(u) * contactTest(v) - flux(u)*v)",
            "(law(u) * contactTest(v) - 1.000001*flux(u)*v)",
        ),
        ("dofs.precision(17);", "dofs.precision(8);"),
    ];
    let folder = folder();
    let at = folder.path();
    let mut runner = TestRunner::new(test_config(1));
    let mut planted = 0;
    for (from, to) in faults {
        let names: Vec<String> = (0..3).map(|k| format!("p{k}.toml")).collect();
        for name in &names {
            let box_of = ((2usize..7), (-1.5..0.0, -1.5..0.0), -3.0..3.0);
            let (n, (x, y), power) = box_of.new_tree(&mut runner).unwrap().current();
            let [x, y, gamma0] = [x, y, power].map(|power| 10f64.powf(power));
            // Contact on parts: the load lifts u by as much as the obstacle waves.
            let wave = 4.0 * y * y;
            let scene = format!(
                "name = \"{name}\"\n[mesh]\ngenerator = \"union-jack\"\nn = {n}\nsize = [{x}, {y}]\n\
                 [boundary]\ndirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n\
                 [data]\nf = \"9+4*cos({}*x)\"\npsi = \"{wave}*(1+sin({}*x))\"\ng = \"{wave}*(1-x)\"\nt = \"{y}*(1+x-y)\"\n\
                 [method]\ngamma0 = {gamma0:?}\n",
                3.0 / x,
                9.0 / x,
            );
            write(at, name, &scene);
        }
        let engine = companion_with(at, "freefem", &[(from, to)]);
        let engines = format!("rust,{engine}");
        let words = [
            "verify",
            "--engines",
            &engines,
            "--methods",
            "p2",
            "--json",
            "-",
        ];
        let words: Vec<&str> = words
            .into_iter()
            .chain(names.iter().map(String::as_str))
            .collect();
        let outcome = run(at, &words).json();
        for case in outcome["cases"].as_array().unwrap() {
            planted += 1;
            let scene = std::fs::read_to_string(at.join(case["scene"].as_str().unwrap())).unwrap();
            assert_eq!(
                case["verdict"], "disagree",
                "{from} -> {to}: {scene}\n{}",
                case["engines"]
            );
        }
    }
    assert_eq!(planted, 30);
}
