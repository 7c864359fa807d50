//! Fifteen faults in what FreeFEM and dolfinx solve for one equation of transport: each is named in the last line.

use std::fs;

use serde_json::Value;

use crate::common::folder;
use crate::judge_forms::{changed, judge};

const FORM: &str = r#"name = "transport"

[mesh]
generator = "union-jack"
n = 8

[spaces]
u = "P1"

[parameters]
c = 2.0

[data]
k = "1 + x*y"
b = ["1", "x"]
f = "exp(x)*sin(4*y)"
t = "cos(2*y)"

[form]
F = "k*inner(grad(u), grad(v))*dx + dot(b, grad(u))*v*dx + c*u*v*dx - f*v*dx - t*v*ds(right)"
degree = 5

[dirichlet]
left = 0
bottom = 0
"#;

const DIFFUSION: &str = "k*inner(grad(u), grad(v))*dx";
const CONVECTION: &str = "dot(b, grad(u))*v*dx";
const REACTION: &str = "c*u*v*dx";
const LOAD: &str = "f*v*dx";
const TRACTION: &str = "t*v*ds(right)";

/// A text of a script, and what comes in its place.
type Edit = (&'static str, &'static str);
/// The kind of a change, its term or place, and its factor.
type Cause = (&'static str, &'static str, Option<f64>);

/// What is wrong, in FreeFEM, in dolfinx, and what is told.
struct Fault {
    freefem: &'static [Edit],
    dolfinx: &'static [Edit],
    causes: &'static [Cause],
}

/// What FreeFEM has behind its last functions: a number for each cell, which is 1 but in one of them.
const CELLS: [Edit; 2] = [
    (
        "\nfespace Vh",
        "\nfespace Zh(Th, P0);\nZh some = 1;\nsome[][40] = 1.001;\nfespace Vh",
    ),
    (
        "\nV = space",
        "\nsome = fem.Function(space(mesh, element(\"DG\", 0)))\nsome.x.array[:] = 1\nsome.x.array[40] = 1.001\nV = space",
    ),
];

const FAULTS: [Fault; 15] = [
    // The convection is missing.
    Fault {
        freefem: &[
            ("b1*dx(u) + b2*dy(u) + c*u", "c*u"),
            ("(b1)*", "0*"),
            ("(b2)*", "0*"),
        ],
        dolfinx: &[("+ dot(b, grad(u))*v*dx ", "")],
        causes: &[("factor", CONVECTION, Some(0.0))],
    },
    // The reaction has the other sign.
    Fault {
        freefem: &[("+ c*u - f", "- c*u - f"), ("(c)*du", "(-c)*du")],
        dolfinx: &[("+ c*u*v", "- c*u*v")],
        causes: &[("factor", REACTION, Some(-1.0))],
    },
    // The diffusion has a factor.
    Fault {
        freefem: &[("kX = 1.0 + x*y", "kX = 1.001*(1.0 + x*y)")],
        dolfinx: &[("k*inner", "1.001*k*inner")],
        causes: &[("factor", DIFFUSION, Some(1.001))],
    },
    // The load is integrated by the centroid.
    Fault {
        freefem: &[
            ("c*u - f)*v", "c*u)*v"),
            ("(-t)*v)", "(-t)*v)\n  + int2d(Th, qft=qf1pT)(-f*v)"),
        ],
        dolfinx: &[("- f*v*dx", "- f*v*dx(metadata={\"quadrature_degree\": 1})")],
        causes: &[("rule", "centroid", None)],
    },
    // The reaction is lumped.
    Fault {
        freefem: &[
            LUMPED,
            ("(-t)*v)", "(-t)*v)\n  + int2d(Th, qft=qf1pTlump)(c*u*v)"),
        ],
        dolfinx: &[BY_VERTICES],
        causes: &[("rule", "vertices-3", None)],
    },
    // A cell is without load.
    Fault {
        freefem: &[CELLS[0], ("1.001", "0"), ("c*u - f)*v", "c*u - some*f)*v")],
        dolfinx: &[CELLS[1], ("1.001", "0"), ("- f*v*dx", "- some*f*v*dx")],
        causes: &[("some", LOAD, Some(0.0))],
    },
    // A cell has other diffusion.
    Fault {
        freefem: &[
            CELLS[0],
            ("kX*dx(u)", "some*kX*dx(u)"),
            ("kX*dy(u)", "some*kX*dy(u)"),
        ],
        dolfinx: &[CELLS[1], ("k*inner", "some*k*inner")],
        causes: &[("some", DIFFUSION, Some(1.001))],
    },
    // The coefficient is 1.
    Fault {
        freefem: &[("kX = 1.0 + x*y", "kX = 1.0")],
        dolfinx: &[("\nk = 1 + x[0]*x[1]", "\nk = 1")],
        causes: &[("one", "k", None)],
    },
    // There is a mass on top.
    Fault {
        freefem: &[("+ c*u - f", "+ (c + 1e-4)*u - f")],
        dolfinx: &[("- f*v*dx", "+ 1e-4*u*v*dx - f*v*dx")],
        causes: &[("parameter", "c", Some(2.0001))],
    },
    // A facet is without traction.
    Fault {
        freefem: &[("(-t)*v", "(-t*(abs(y - 0.3125) > 0.0625))*v")],
        dolfinx: &[(
            "- t*v*ds(2)",
            "- conditional(lt(abs(x[1] - 0.3125), 0.0625), 0.0, t)*v*ds(2)",
        )],
        causes: &[("some", TRACTION, Some(0.0))],
    },
    // The convection has test function and unknown exchanged.
    Fault {
        freefem: &[
            (
                "(b1*dx(u) + b2*dy(u) + c*u - f)*v",
                "(c*u - f)*v + b1*u*dx(v) + b2*u*dy(v)",
            ),
            ("(b1)*dx(du)*v", "(b1)*du*dx(v)"),
            ("(b2)*dy(du)*v", "(b2)*du*dy(v)"),
        ],
        dolfinx: &[("dot(b, grad(u))*v", "dot(b, grad(v))*u")],
        causes: &[("transposed", CONVECTION, None)],
    },
    // The load and the traction have factors.
    Fault {
        freefem: &[
            ("func f = ", "func f = 1.01*"),
            ("func t = ", "func t = 0.98*"),
        ],
        dolfinx: &[
            ("- f*v*dx", "- 1.01*f*v*dx"),
            ("- t*v*ds(2)", "- 0.98*t*v*ds(2)"),
        ],
        causes: &[
            ("factor", LOAD, Some(1.01)),
            ("factor", TRACTION, Some(0.98)),
        ],
    },
    // The convection is missing, and the reaction is lumped.
    Fault {
        freefem: &[
            LUMPED,
            ("b1*dx(u) + b2*dy(u) - f", "-f"),
            ("(b1)*", "0*"),
            ("(b2)*", "0*"),
            ("(-t)*v)", "(-t)*v)\n  + int2d(Th, qft=qf1pTlump)(c*u*v)"),
        ],
        dolfinx: &[("+ dot(b, grad(u))*v*dx ", ""), BY_VERTICES],
        causes: &[
            ("factor", CONVECTION, Some(0.0)),
            ("rule", "vertices-3", None),
        ],
    },
    // The load is interpolated.
    Fault {
        freefem: &[("func f =", "fespace P1h(Th, P1);\nP1h f =")],
        dolfinx: &[(
            "F = (\n",
            "f = fem.Function(V)\nf.interpolate(lambda x: np.exp(x[0])*np.sin(4*x[1]))\nF = (\n",
        )],
        causes: &[("data", "f", None)],
    },
    // The coefficient is constant in each cell.
    Fault {
        freefem: &[("func kX =", "fespace P0h(Th, P0);\nP0h kX =")],
        dolfinx: &[(
            "F = (\n",
            "k = fem.Function(space(mesh, element(\"DG\", 0)))\nk.interpolate(lambda x: 1 + x[0]*x[1])\nF = (\n",
        )],
        causes: &[("data", "k", None)],
    },
];

/// The reaction is taken out of the integral with the rule of the form.
const LUMPED: Edit = (" + c*u - f", " - f");
const BY_VERTICES: Edit = (
    "c*u*v*dx",
    "c*u*v*dx(metadata={\"quadrature_rule\": \"vertex\", \"quadrature_degree\": 1})",
);

#[test]
fn fifteen_faults_in_freefem_are_named() {
    for fault in &FAULTS {
        is_named("freefem", fault.freefem, fault.causes);
    }
}

#[test]
fn fifteen_faults_in_dolfinx_are_named() {
    for fault in &FAULTS {
        is_named("dolfinx", fault.dolfinx, fault.causes);
    }
}

fn is_named(code: &str, edits: &[Edit], causes: &[Cause]) {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("transport.toml"), FORM).unwrap();
    let result = changed(at, "transport", code, edits);
    let (exit, told) = judge(at, "transport", &result);
    let sentence = told["sentence"].as_str().unwrap();
    println!("{code}, {edits:?}: {sentence}");
    assert_eq!(exit, Some(1), "{told}");
    let fits = |all: &[Value]| {
        let is = |told: &Value, (kind, name, factor): &Cause| {
            let names = [&told["term"], &told["where"]];
            let is_it = told["kind"] == *kind && names.contains(&&Value::from(*name));
            let found = told.get("factor").and_then(Value::as_f64);
            is_it
                && match (found, factor) {
                    (None, None) => true,
                    (Some(found), Some(factor)) => (found - factor).abs() < 1e-8,
                    _ => false,
                }
        };
        all.len() == causes.len()
            && causes
                .iter()
                .all(|cause| all.iter().any(|told| is(told, cause)))
    };
    let first = told["explanations"].as_array().unwrap();
    // Of a constant a factor of the term, its parameter and a mass are one thing.
    let alike = told["alike"].as_array().into_iter().flatten();
    let mut all = alike.map(|all| all.as_array().unwrap()).chain([first]);
    assert!(all.any(|all| fits(all)), "{told}");
    assert!(sentence.contains("it solves the form as if"), "{sentence}");
}
