//! Contact in elasticity: the patch test in every method, in 2D and 3D; in space all codes; friction as a vector.

use std::path::Path;

use faceoff_form::own::{self, Functionals};
use faceoff_form::{Problem, codes::Code};
use faceoff_mesh::mesh::Mesh;

use super::{NONE, cube, form, lacking, square};

/// The penalty-free method, and that of Chouly, Hild and Renard in place of it.
const FREE: &str = "gamma*sigma_n(u))*sigma_n(v)*ds(bottom)";
const CHOULY_HILD: &str = "gamma*sigma_n(u))*(theta*sigma_n(v) + dot(v, n)/gamma)*ds(bottom)";

/// Of what a form has on Crouzeix–Raviart functions alone.
const JUMPS: &str = " + 2*mu*beta/facet_length*dot(jump(u), jump(v))*dS";

/// The numbers `error` and `deviation` of the patch test, which are squares.
fn patch(text: &str, mesh: &Mesh) -> [f64; 2] {
    let problem = Problem::parse(Path::new("patch.toml"), text, mesh).expect("a form");
    let solution = own::solve(&problem, mesh).expect("a solution");
    let (mut result, fields) = own::output(&solution.assembler, &solution.u);
    result.fields = fields;
    let table: toml::Table = text.parse().expect("TOML");
    let mut numbers = Functionals::new(&problem);
    for name in ["error", "deviation"] {
        let value = table["numbers"][name]["value"].as_str().expect("a value");
        numbers.add(value).expect("a number");
    }
    let found = numbers.of(mesh, &result, f64::EPSILON).expect("numbers");
    found.try_into().expect("two numbers")
}

/// A block of three dimensions, whose sides at x = 0 and y = 0 do not move along their normals.
fn in_space(text: &str) -> String {
    text.replace("^2\"\n\n[parameters]", "^3\"\n\n[parameters]")
        .replace("Identity(2)", "Identity(3)")
        .replace(
            "left = [\"0\", \"free\"]",
            "left = [\"0\", \"free\", \"free\"]\nfront = [\"free\", \"0\", \"free\"]",
        )
        .replace("[w, k]", "[p*nu/E*x, p*nu/E*y, 0.01 - p/E*z]")
        .replace("gamma0 = 100.0", "gamma0 = 1.0")
}

#[test]
fn a_block_has_uniform_pressure_in_every_method() {
    let penalty_free = form("contact-patch");
    let other = |space: &str, theta: f64| {
        penalty_free
            .replace("\"CR^", &format!("\"{space}^"))
            .replace(JUMPS, "")
            .replace(FREE, CHOULY_HILD)
            .replace("gamma0 = 100.0", "gamma0 = 0.1")
            .replace("beta = 10.0", &format!("theta = {theta:?}"))
    };
    let no_jumps = |space: &str| {
        penalty_free
            .replace(JUMPS, "")
            .replace("\"CR^", &format!("\"{space}^"))
    };
    let mut all = vec![penalty_free.clone(), no_jumps("P2")];
    for theta in [1.0, 0.0, -1.0, 0.3] {
        all.extend([other("P1", theta), other("P2", theta)]);
    }
    for text in all {
        for (text, mesh) in [(text.clone(), square()), (in_space(&text), cube())] {
            // The pressure is 0.1, and u up to 0.1.
            let [error, deviation] = patch(&text, &mesh).map(f64::sqrt);
            assert!(
                error <= 1e-13 && deviation <= 1e-13,
                "{error:e} {deviation:e} {text}"
            );
        }
    }
    // Another law is not within these: the method on a block that is not pressed evenly, and with the pressure of other numbers.
    let uneven = penalty_free.replace("p*dot(v, n)*ds(top)", "p*x*dot(v, n)*ds(top)");
    let [error, deviation] = patch(&uneven, &square()).map(f64::sqrt);
    assert!(error > 1e-3 && deviation > 1e-3, "{error:e} {deviation:e}");
}

#[test]
fn without_jumps_the_matrix_is_singular() {
    let text = form("elastic-transition").replace(JUMPS, "");
    let problem = Problem::parse(Path::new("form.toml"), &text, &square()).expect("a form");
    let refused = own::solve(&problem, &square()).map(|_| ());
    let why = refused.expect_err("singular").to_string();
    assert!(why.contains("singular to working precision"), "{why}");
}

/// Contact that begins within faces.
const SOLID: &str = r#"
name = "solid"
[spaces]
u = "P1^3"
[parameters]
mu = 0.4
lam = 0.6
gamma0 = 0.1
theta = 1.0
[definitions]
"sigma(w)" = "2*mu*sym(grad(w)) + lam*div(w)*Identity(3)"
"traction(w)" = "dot(sigma(w), n)"
"sigma_n(w)" = "dot(n, traction(w))"
gamma = "gamma0*h/(2*mu + lam)"
[form]
F = """inner(sigma(u), sym(grad(v)))*dx + dot([0.02, 0.1*x, 0.01*x], v)*dx - sigma_n(u)*dot(v, n)*ds(bottom)
  + max(dot(u, n) + 0.02 - 0.05*x^2, gamma*sigma_n(u))*(theta*sigma_n(v) + dot(v, n)/gamma)*ds(bottom)"""
degree = 2
facet_degree = 2
[dirichlet]
top = [0, 0, 0]
"#;

#[test]
fn contact_in_space() {
    assert_eq!(lacking(SOLID, &cube()), NONE);
}

/// Crouzeix–Raviart functions, without a penalty on contact; Tresca's friction is a vector in the tangential plane, held in a ball.
#[test]
fn contact_with_friction_in_space() {
    let text = SOLID
        .replace("P1^3", "CR^3")
        .replace("theta*sigma_n(v) + dot(v, n)/gamma", "sigma_n(v)")
        .replace("- sigma_n(u)*dot(v, n)*ds(bottom)", "- dot(traction(u), v)*ds(bottom) + 2*mu*beta/facet_length*dot(jump(u), jump(v))*dS")
        .replace("theta = 1.0", "beta = 10.0")
        .replace(
            "[form]",
            "\"tangential(w)\" = \"w - dot(w, n)*n\"\n\"ball(q, radius)\" = \"q/sqrt(max(1, dot(q, q)/radius^2))\"\n[form]",
        )
        .replace(
            "*ds(bottom)\"\"\"",
            "*ds(bottom)\n+ dot(gamma*tangential(traction(u)) - ball(tangential(gamma*traction(u) - u), 0.02*gamma), tangential(traction(v)))*ds(bottom)\"\"\"",
        );
    assert_eq!(
        lacking(&text, &cube()),
        ["freefem", "ngsolve", "getfem", "nutils", "mfem"]
    );
    let problem = Problem::parse(Path::new("solid.toml"), &text, &cube()).expect("a form");
    let dolfinx = Code::of_name("dolfinx").expect("a code");
    let script = dolfinx.script(&problem).expect("a script");
    assert!(
        script.contains("ball(q, radius) = q/sqrt(max(1, dot(q, q)/radius^2))"),
        "{script}"
    );
}
