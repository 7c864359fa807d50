//! Scenes of elasticity: the form of each, and the errors, with the line that each is reported at.

use std::collections::BTreeMap;
use std::path::Path;

use faceoff_fem::contact::Method;
use faceoff_mesh::io;
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::generate::{union_cube, union_jack};

use super::{builtin, catalogue, lower, mesh};
use crate::own::{Functionals, output, solve, system};
use crate::problem::Problem;

fn by(name: &str) -> Method {
    name.parse().unwrap()
}

fn form(text: &str, method: &str, on: &Mesh) -> Result<Problem, String> {
    let origin = Path::new("s.toml");
    let lowered = lower(origin, text, &by(method), &["rust"]).map_err(|e| e.to_string())?;
    let found = Problem::parse(origin, &lowered.text.text, on);
    found.map_err(|e| lowered.text.told(e).to_string())
}

fn transition() -> &'static str {
    builtin("elastic-transition").unwrap()
}

/// The form of the scene with `cr` has the solution of the form in the gallery, which was written by hand.
#[test]
fn a_scene_is_the_form_that_one_would_write() {
    let on = union_jack(4, [1.0, 1.0]);
    let gallery = include_str!("../../../../examples/forms/elastic-transition.toml");
    let by_hand = Problem::parse(Path::new("g.toml"), gallery, &on).unwrap();
    let by_hand = solve(&by_hand, &on).unwrap();
    let found = solve(&form(transition(), "cr", &on).unwrap(), &on).unwrap();
    let largest = by_hand.u.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(largest > 0.1);
    for (a, b) in found.u.iter().zip(&by_hand.u) {
        assert!((a - b).abs() <= 1e-13 * largest, "{a} {b}");
    }
}

#[test]
fn built_in_scenes_are_forms_by_every_method() {
    for (name, about) in catalogue() {
        assert!(!about.is_empty(), "{name}");
        let file = match name {
            "hertz-line" => "hertz.msh",
            "hertz-sphere-elastic" => "ball.msh",
            _ => "",
        };
        let on = match mesh(file) {
            Some(bytes) => io::parse(file.as_ref(), bytes, None).unwrap().mesh,
            None => union_jack(2, [1.0, 1.0]),
        };
        for method in ["cr", "p1", "p2", "p2(1,0)", "p1(-1,1)", "p2(0,1)"] {
            form(builtin(name).unwrap(), method, &on).unwrap();
        }
    }
}

/// A block in 3D, pressed onto a plane by a uniform pressure p: u = p/E (νx, νy, -z), plus the height of the plane.
#[test]
fn a_scene_in_space_passes_the_patch_test() {
    let text = r#"
name = "block"
[mesh]
generator = "union-cube"
[elastic]
E = 2.0
nu = 0.25
[boundary]
dirichlet = ["left"]
neumann = ["top"]
contact = ["bottom"]
[data]
g = ["0", "0.0125*y", "0.01 - 0.05*z"]
t = ["0", "0", "-0.1"]
psi = "-0.01"
"#;
    let on = union_cube(2, [1.0, 1.0, 1.0]);
    for method in ["cr", "p1", "p2"] {
        let solution = solve(&form(text, method, &on).unwrap(), &on).unwrap();
        let (mesh, fields) = output(&solution.assembler, &solution.u);
        let u = fields[0].values.to_f64();
        assert_eq!(u.len(), 3 * mesh.points.len());
        for (u, [x, y, z]) in u.chunks(3).zip(&mesh.points) {
            let exact = [0.0125 * x, 0.0125 * y, 0.01 - 0.05 * z];
            for (a, b) in u.iter().zip(exact) {
                assert!((a - b).abs() <= 1e-13, "{method}: {a} {b}");
            }
        }
    }
}

#[test]
fn faults_are_told_at_their_place_in_the_scene() {
    let on = union_jack(2, [1.0, 1.0]);
    let told = |from: &str, to: &str| {
        let text = transition().replacen(from, to, 1);
        assert_ne!(text, transition(), "{from}");
        form(&text, "cr", &on).unwrap_err()
    };
    let line = |of: &str| {
        1 + transition()
            .lines()
            .position(|line| line.starts_with(of))
            .unwrap()
    };
    let begins = |found: String, place: String, what: &str| {
        assert!(found.starts_with(&place), "{found}");
        assert!(found.contains(what), "{found}");
    };
    let wrong = told("s = \"max(x - 1/2, 0)\"", "s = \"max(x - q, 0)\"");
    // An error in a definition is reported where the definition is used.
    begins(
        wrong,
        format!("s.toml:{}:", line("f = ")),
        "definition of `s`: `q` is not known",
    );
    let wrong = told("t = [\"4/5*mu", "t = [\"4/5*nu2");
    begins(
        wrong,
        format!("s.toml:{}:11: ", line("t = ")),
        "`nu2` is not known",
    );
    let wrong = told("g = [\"u1\"", "g = [\"uu\"");
    begins(
        wrong,
        format!("s.toml:{}: ", line("g = ")),
        "`uu` is not known",
    );
    let wrong = told("\"left\", \"top\"", "\"left\", \"tip\"");
    begins(
        wrong,
        format!("s.toml:{}: ", line("g = ")),
        "no group `tip`",
    );
    let wrong = told("E = 1.0", "E = 1.0\nrho = 1");
    begins(
        wrong,
        format!("s.toml:{}: ", line("E = ") + 1),
        "no key `rho`",
    );
    let wrong = told("plane = \"strain\"", "plane = \"thin\"");
    begins(
        wrong,
        format!("s.toml:{}: ", line("plane")),
        "plane is \"thin\"",
    );
    let wrong = told("contact = [\"bottom\"]", "contact = []");
    begins(
        wrong,
        format!("s.toml:{}: ", line("[boundary]")),
        "no group is one of contact",
    );
    let wrong = told("neumann = [\"right\"]", "neumann = []");
    begins(wrong, format!("s.toml:{}: ", line("t = ")), "t is given");
    let wrong = told("[elastic]", "[elastik]");
    begins(
        wrong,
        format!("s.toml:{}: ", line("[elastic]")),
        "did you mean `elastic`",
    );
    let wrong = form(transition(), "cr-fc", &on).unwrap_err();
    assert!(
        wrong.contains("cr-fc is no method for elasticity"),
        "{wrong}"
    );
    let wrong = form(transition(), "p2(1,-1)", &on).unwrap_err();
    assert!(wrong.contains("rewards what contact forbids"), "{wrong}");
}

/// The method is symmetric only for θ = (-1, 1), which is Chouly, Hild and Renard's θ = 1.
#[test]
fn the_sign_of_theta_is_that_of_the_family() {
    let on = union_jack(2, [1.0, 1.0]);
    let asymmetry = |method: &str| {
        // The obstacle is far above, so that all of Γ_C is in contact in the state at which the matrix is the derivative.
        let text = builtin("contact-patch").unwrap();
        let text = text.replace("psi = \"-0.01\"", "psi = \"-100\"");
        let found = form(&text, method, &on).unwrap();
        let (matrix, ..) = system(&found, &on).unwrap();
        let entries: BTreeMap<(u32, u32), f64> = matrix
            .entries
            .iter()
            .map(|(i, j, a)| ((*i, *j), *a))
            .collect();
        // A row of the identity belongs to a constrained dof.
        let is_held = |i: u32| entries.keys().filter(|(row, _)| *row == i).count() == 1;
        let free = entries
            .iter()
            .filter(|((i, j), _)| !is_held(*i) && !is_held(*j));
        free.fold(0.0_f64, |most, ((i, j), a)| {
            let other = entries.get(&(*j, *i)).copied().unwrap_or(0.0);
            most.max((a - other).abs())
        })
    };
    assert!(asymmetry("p2(-1,1)") < 1e-12);
    assert!(asymmetry("p2(1,1)") > 1e-2);
    assert!(asymmetry("p2(0,1)") > 1e-2);
}

/// The patch test of sliding, with Coulomb friction and with Tresca friction of the same magnitude; with twice that friction, the block sticks.
#[test]
fn friction_passes_the_patch_test() {
    let on = union_jack(4, [1.0, 1.0]);
    let coulomb = builtin("friction-patch").unwrap();
    let tresca = coulomb.replace("coulomb = \"q\"", "friction = \"q*p\"");
    for text in [coulomb, &tresca] {
        for method in ["cr", "p1", "p2"] {
            let solution = solve(&form(text, method, &on).unwrap(), &on).unwrap();
            let (mesh, fields) = output(&solution.assembler, &solution.u);
            let u = fields[0].values.to_f64();
            for (u, [x, y, _]) in u.chunks(u.len() / mesh.points.len()).zip(&mesh.points) {
                let exact = [0.039 * x + 0.104 * y + 0.2, 0.01 - 0.091 * y];
                for (a, b) in u.iter().zip(exact) {
                    assert!((a - b).abs() <= 1e-12, "{method}: {a} {b}");
                }
            }
        }
    }
    let stronger = tresca.replace("friction = \"q*p\"", "friction = \"2*q*p\"");
    let solution = solve(&form(&stronger, "cr", &on).unwrap(), &on).unwrap();
    let (_, fields) = output(&solution.assembler, &solution.u);
    // The displacement that is given on the left is then not reached by slip elsewhere.
    let largest = fields[0].values.to_f64().into_iter().fold(0.0, f64::max);
    assert!((largest - (0.039 + 0.104 + 0.2)).abs() > 1e-3, "{largest}");
}

/// The integral of the reaction is that of the loads, to rounding, for every method; with a penalty the integral of -σₙ is not.
#[test]
fn the_reaction_balances_the_loads() {
    let on = io::parse("hertz.msh".as_ref(), mesh("hertz.msh").unwrap(), None).unwrap();
    let on = on.mesh;
    for (method, has_penalty) in [
        ("cr", false),
        ("p2(1,0)", false),
        ("p1", true),
        ("p2", true),
        ("p2(-1,1)", true),
        ("p1(0,0.5)", true),
    ] {
        let problem = form(builtin("hertz-line").unwrap(), method, &on).unwrap();
        let solution = solve(&problem, &on).unwrap();
        let (mut result, fields) = output(&solution.assembler, &solution.u);
        result.fields = fields;
        let mut both = Functionals::new(&problem);
        both.add("2*reaction*ds(contact)").unwrap();
        both.add("-2*sigma_n(u)*ds(contact)").unwrap();
        let found = both.of(&on, &result, 0.0).unwrap();
        assert!((found[0] - 8.0).abs() <= 1e-11, "{method}: {found:?}");
        let misses = (found[1] - 8.0).abs() > 1e-6;
        assert_eq!(misses, has_penalty, "{method}: {found:?}");
    }
}
