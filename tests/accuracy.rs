//! Certificates and accuracies on the command line, and against solutions that are known.

use crate::common::{folder, run, write};
use faceoff_fem::adapt::{Outcome, Way, Wish, reach};
use faceoff_fem::certify::Target;
use faceoff_fem::contact::{Discretisation, Method, Stop};
use faceoff_fem::scene::Scene;
use faceoff_fem::truth::Reference;
use serde_json::Value;

/// ‖∇u‖² of 6.1, from the solution without a mesh.
fn exact_square() -> f64 {
    let folder = folder();
    let ran = run(folder.path(), &["paper", "--reference", "--json", "-"]);
    ran.json()["one-zone"]["grad_norm_sq"].as_f64().unwrap()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn an_accuracy_is_reached_and_certified() {
    let folder = folder();
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "1e-2",
        "--out",
        "u.vtu",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let told = ran.json();
    let certificate = &told["certificate"];
    assert_eq!(certificate["target"], "g");
    assert!(number(&certificate["relative"]) <= 1e-2);
    assert_eq!(
        number(&certificate["upper"]),
        number(&certificate["bounds"]["g"])
    );
    assert!(number(&certificate["lower"]) <= number(&certificate["upper"]));
    assert!(certificate["oscillation"].is_number() && certificate["parts"]["misfit"].is_number());
    let [low, high] = [0, 1].map(|k| number(&certificate["gradient"][k]));
    let exact = exact_square().sqrt();
    assert!(low <= exact && exact <= high, "{low} {exact} {high}");
    let meshes = told["meshes"].as_array().unwrap();
    assert_eq!(meshes.last().unwrap()["dofs"], told["dofs"]);
    assert!(ran.stderr.contains("certified to"), "{}", ran.stderr);
    let info = run(folder.path(), &["mesh", "info", "u.vtu", "--json", "-"]).json();
    let fields: Vec<&str> = info["fields"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|f| f["name"].as_str())
        .collect();
    for name in ["averaged gradient", "bound", "admissible v"] {
        assert!(fields.contains(&name), "{fields:?}");
    }
}

/// The error of the admissible function against the solution by separation of variables.
#[test]
fn the_certificate_holds_against_the_mesh_free_reference() {
    let scene = Scene::find("one-zone").unwrap();
    let wish = Wish {
        discretisation: Discretisation::of(&scene, Method::cr_fc()),
        target: Target::V,
        accuracy: 0.08,
        stop: Stop::default(),
        linear: Default::default(),
        way: None,
    };
    let reached = reach(&scene, &wish, |_, _| Ok(())).unwrap();
    assert_eq!(reached.outcome, Outcome::Reached);
    let truth = Reference::one_zone(400).unwrap();
    let rule = faceoff_fem::quadrature::exact(2, 5);
    let mut square = 0.0;
    for cell in 0..reached.mesh.cell_count() {
        let geometry = reached.mesh.geometry(cell);
        let vertices = reached.mesh.cell(cell).iter().zip(geometry.gradients);
        let flat = vertices.fold([0.0; 2], |sum, (&vertex, gradient)| {
            let v = reached.certificate.fields.v[vertex as usize];
            [sum[0] + v * gradient.x, sum[1] + v * gradient.y]
        });
        for (lambda, weight) in rule.iter() {
            let mut slope = flat;
            for (i, &face) in reached.mesh.cell_faces(cell).iter().enumerate() {
                let b = 4.0 * reached.certificate.fields.bubbles[face as usize];
                let [a, c] = [(i + 1) % 3, (i + 2) % 3];
                let bent = lambda[a] * geometry.gradients[c] + lambda[c] * geometry.gradients[a];
                slope = [slope[0] + b * bent.x, slope[1] + b * bent.y];
            }
            let [x, y, _] = geometry.point(&lambda);
            let exact = truth.grad(x, y);
            let distance = (exact[0] - slope[0]).powi(2) + (exact[1] - slope[1]).powi(2);
            square += weight * geometry.measure() * distance;
        }
    }
    let (error, bound) = (square.sqrt(), reached.certificate.v);
    assert!(error <= bound && bound < 2.0 * error, "{error} {bound}");
    assert!(reached.certificate.relative(Target::V) <= 0.08);
}

#[test]
fn a_corner_is_worth_adapting_and_a_smooth_solution_is_not() {
    let dofs = |scene: &str, way: &str| -> Vec<(f64, f64)> {
        let folder = folder();
        let words = [
            "solve",
            scene,
            "--accuracy",
            "2e-2",
            "--way",
            way,
            "--json",
            "-",
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let told = ran.json();
        let meshes = told["meshes"].as_array().unwrap().iter();
        meshes
            .map(|m| (number(&m["dofs"]), number(&m["relative"])))
            .collect()
    };
    // A uniform file mesh comes in powers of two: what 2 % would take lies between two of them.
    let uniform = dofs("l-shape", "uniform");
    let [.., (n1, e1), (n2, e2)] = uniform[..] else {
        panic!("{uniform:?}")
    };
    let rate = (e1 / e2).ln() / (n2 / n1).ln();
    let needed = n2 * (e2 / 2e-2).powf(1.0 / rate);
    let adapted = dofs("l-shape", "adaptive").last().unwrap().0;
    assert!(needed > 5.0 * adapted, "{needed} {adapted}");
    for (scene, way) in [("l-shape", Way::Adaptive), ("one-zone", Way::Uniform)] {
        let scene = Scene::find(scene).unwrap();
        let wish = Wish {
            discretisation: Discretisation::of(&scene, Method::cr_fc()),
            target: Target::G,
            accuracy: 2e-2,
            stop: Stop::default(),
            linear: Default::default(),
            way: None,
        };
        let reached = reach(&scene, &wish, |_, _| Ok(())).unwrap();
        assert_eq!(
            (reached.way, reached.outcome),
            (way, Outcome::Reached),
            "{}",
            scene.name()
        );
    }
}

#[test]
fn what_cannot_be_had_is_said() {
    let folder = folder();
    for (words, code, needle) in [
        (
            &["solve", "one-zone", "--accuracy", "0"][..],
            2,
            "between 0 and 1",
        ),
        (
            &["solve", "one-zone", "--accuracy", "1"],
            2,
            "between 0 and 1",
        ),
        (
            &["solve", "one-zone", "--accuracy", "nan"],
            2,
            "between 0 and 1",
        ),
        (
            &["solve", "one-zone", "--accuracy", "1e-2", "--n", "8"],
            2,
            "cannot be used with",
        ),
        (
            &["solve", "transition-1.5-3d", "--accuracy", "0.1"],
            2,
            "no certificate, because",
        ),
        (
            &["solve", "transition-1.5-3d", "--n", "2", "--certify"],
            2,
            "no certificate, because",
        ),
        (
            &["solve", "one-zone", "--accuracy", "1e-8"],
            1,
            "was not reached",
        ),
    ] {
        let ran = run(folder.path(), words);
        assert_eq!(ran.code, Some(code), "{words:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(needle), "{words:?}: {}", ran.stderr);
    }
    // The best that there is comes with its certificate.
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "1e-8",
        "--json",
        "-",
        "--quiet",
    ];
    let told = run(folder.path(), &words).json();
    assert!(number(&told["certificate"]["relative"]) < 0.5);
    // Jumps that no mesh follows: the interval is wide, not refused, and it is no accident that it is.
    let jump = write(
        folder.path(),
        "jump.toml",
        "name = \"jump\"\n[mesh]\ngenerator = \"union-jack\"\nn = 1\n[boundary]\ndirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n[data]\nf = \"if(sin(1e4*x*x+3e3*y) > 0, 1e3, -1e3)\"\n",
    );
    let words = ["solve", jump.to_str().unwrap(), "--certify", "--json", "-"];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let certificate = &ran.json()["certificate"];
    assert!(
        number(&certificate["parts"]["unknown"]) > 10.0,
        "{certificate}"
    );
}

/// The interval of the force closes in on the value of the solution without a mesh, and so does what is proved of the
/// contact set: the transition of 6.1 is at 0.6976799791204.
#[test]
fn the_contact_force_and_the_contact_set_are_in_their_intervals() {
    let folder = folder();
    let mut widths = Vec::new();
    for n in ["16", "32", "64"] {
        let words = ["solve", "one-zone", "--n", n, "--certify", "--json", "-"];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let certificate = ran.json()["certificate"].clone();
        let pair = |of: &Value| [0, 1].map(|k| number(&of[k]));
        let [low, high] = pair(&certificate["numbers"]["contact_force"]);
        assert!(low <= -0.26583 && -0.26582 <= high, "{low} {high}");
        let [from, to] = pair(&certificate["gradient"]);
        assert!(from * from <= 0.92350807787588 && 0.92350807787588 <= to * to);
        let contact = &certificate["numbers"]["contact"];
        let free = pair(contact["free"].as_array().unwrap().last().unwrap())[1];
        let touched = &contact["touched"][0];
        let begins = number(&touched["from"]) + number(&touched["window"]);
        assert!(
            free < 0.697679979120 && 0.697679979120 < begins,
            "{free} {begins}"
        );
        widths.push((high - low, to * to - from * from, free, begins));
    }
    println!("{widths:?}");
    for pair in widths.windows(2) {
        assert!(
            pair[1].0 < 0.6 * pair[0].0 && pair[1].1 < pair[0].1,
            "{widths:?}"
        );
        assert!(
            pair[1].2 >= pair[0].2 && pair[1].3 <= pair[0].3,
            "{widths:?}"
        );
    }
    // Coarse meshes spend more on f: the order shows over both steps.
    assert!(widths[2].1 < 0.16 * widths[0].1, "{widths:?}");
    let (force, square, ..) = widths[2];
    assert!(force <= 0.005 * 0.26583 && square < 1e-4, "{widths:?}");
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "0.1:contact-force",
        "--json",
        "-",
    ];
    let told = run(folder.path(), &words).json();
    assert_eq!(told["certificate"]["target"], "contact-force");
    assert!(number(&told["certificate"]["relative"]) <= 0.1);
}

#[test]
fn every_code_gets_a_certificate() {
    let folder = folder();
    let of = |engine: &str, method: &str| -> f64 {
        let words = [
            "solve",
            "one-zone",
            "--engine",
            engine,
            "--method",
            method,
            "--n",
            "8",
            "--certify=u_h",
            "--json",
            "-",
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let told = ran.json();
        assert_eq!(told["certificate"]["target"], "u_h");
        number(&told["certificate"]["upper"])
    };
    for method in ["cr", "p2"] {
        let rust = of("rust", method);
        for engine in ["freefem", "fenicsx"] {
            let other = of(engine, method);
            assert!(
                (other - rust).abs() < 1e-9 * rust,
                "{engine} {method}: {other} {rust}"
            );
        }
    }
}
