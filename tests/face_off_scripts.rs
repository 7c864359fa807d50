//! Face-offs whose codes run the scripts that `faceoff write` wrote: each fault planted in one of them is found.
//!
//! FreeFEM and GetFEM, as they start fastest.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, write};

/// A problem of the gallery as a face-off: where its mesh comes from, and what is known of it.
struct Problem {
    form: &'static str,
    mesh: &'static str,
    fields: &'static str,
}

const UNION_JACK: &str = "generator = \"union-jack\"";

const POISSON: Problem = Problem {
    form: "poisson",
    mesh: UNION_JACK,
    fields: "[fields.u]\nsame = \"discretisation\"\nrtol = 1e-11\nexact = \"exp(x)*sin(2*y)\"\norders = { l2 = 3, h1 = 2 }\n",
};

const CANTILEVER: Problem = Problem {
    form: "cantilever",
    mesh: "file = \"beam.msh\"",
    fields: "[fields.u]\nsame = \"discretisation\"\nrtol = 1e-11\ncomponents = 2\n",
};

const CROUZEIX_RAVIART: Problem = Problem {
    form: "stokes-cr",
    mesh: UNION_JACK,
    fields: "[fields.u]\nsame = \"discretisation\"\nrtol = 1e-11\ncomponents = 2\n\
             [fields.p]\nsame = \"discretisation\"\nrtol = 1e-11\n",
};

/// Compared as functions.
const TAYLOR_HOOD: Problem = Problem {
    form: "stokes",
    mesh: UNION_JACK,
    fields: "[fields.u]\nsame = \"problem\"\nrtol = 5e-4\ncomponents = 2\n\
             exact = [\"sin(pi*x)*cos(pi*y)\", \"-cos(pi*x)*sin(pi*y)\"]\norders = { l2 = 3, h1 = 2 }\n\
             [fields.p]\nsame = \"problem\"\nrtol = 1e-2\nexact = \"cos(pi*x)*cos(pi*y)\"\norders = { l2 = 2 }\n",
};

impl Problem {
    /// Writes the scripts, and the face-off that runs them.
    fn write(&self, at: &Path) {
        let Problem { form, mesh, fields } = self;
        for name in [&*format!("{form}.toml"), "beam.msh"] {
            fs::copy(source("examples/forms").join(name), at.join(name)).unwrap();
        }
        for code in ["freefem", "getfem"] {
            let words = ["write", &format!("{form}.toml"), "--for", code, "-o", "."];
            let ran = run(at, &words);
            assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        }
        let code = |name: &str, program: &str, script: &str, mesh: &str| {
            format!(
                "[codes.{name}]\ncommand = [{program}, \"{script}\", \"{{mesh}}\", \"{{out}}/u.vtu\"]\nmesh = \"{mesh}\"\nresult = \"u.vtu\"\n"
            )
        };
        let text = format!(
            "name = \"{form}\"\n[mesh]\n{mesh}\n{}{}{fields}",
            code(
                "freefem",
                "\"FreeFem++-nw\", \"-v\", \"0\"",
                &format!("{form}.edp"),
                "medit"
            ),
            code(
                "getfem",
                "\"/usr/bin/python3\"",
                &format!("{form}_getfem.py"),
                "msh2"
            )
        );
        write(at, "pair.toml", &text);
    }

    /// Runs the face-off with another text in FreeFEM's script, which is there once at least.
    fn verify_with(&self, at: &Path, (from, to): (&str, &str), n: &str) -> (Option<i32>, Value) {
        let path = at.join(format!("{}.edp", self.form));
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{from} is not in {text}");
        fs::write(&path, text.replace(from, to)).unwrap();
        let words = ["verify", "--run", "pair.toml", "--n", n];
        let outputs = ["--json", "o.json", "--report", "page", "--junit", "j.xml"];
        let ran = run(at, &[&words[..], &outputs].concat());
        fs::write(&path, text).unwrap();
        assert_valid(
            "json",
            "src/report/schema/face-off-1.json",
            &at.join("o.json"),
        );
        assert_valid("xsd", "tests/junit.xsd", &at.join("j.xml"));
        let told = fs::read_to_string(at.join("o.json")).unwrap();
        (ran.code, serde_json::from_str(&told).unwrap())
    }
}

fn field<'a>(told: &'a Value, name: &str) -> &'a Value {
    let fields = told["fields"].as_array().unwrap();
    fields.iter().find(|f| f["field"] == name).unwrap()
}

/// The codes agree to rounding, with the orders of theory; faults that cost a code its order are named with it.
#[test]
fn poisson_agrees_and_its_faults_are_named() {
    let folder = folder();
    let at = folder.path();
    POISSON.write(at);
    let page = || fs::read_to_string(at.join("page/index.html")).unwrap();
    let (code, told) = POISSON.verify_with(at, ("", ""), "4,8");
    assert_eq!(code, Some(0), "{told}");
    let u = field(&told, "u");
    for pair in u["pairs"].as_array().unwrap() {
        assert!(pair["max_rel"].as_f64().unwrap() < 1e-12, "{pair}");
    }
    for order in u["orders"].as_array().unwrap() {
        let fit = |norm: &str| order[norm]["fit"]["exponent"].as_f64().unwrap();
        assert!(
            (fit("l2") - 3.0).abs() < 0.1 && (fit("h1") - 2.0).abs() < 0.1,
            "{order}"
        );
    }
    assert!(page().contains("freefem, getfem <em>agree</em> on poisson"));

    let faults = [
        // A coefficient, the sign of the flux, its side, and a condition that is not there.
        ("(dx(u))*dx(v)", "(1.001*dx(u))*dx(v)"),
        ("(-t)*v", "(t)*v"),
        ("int1d(Th, 2,", "int1d(Th, 4,"),
        ("on(3,", "on(9,"),
    ];
    for (from, to) in faults {
        let (code, told) = POISSON.verify_with(at, (from, to), "4,8");
        assert_eq!(code, Some(1), "{to}");
        for order in field(&told, "u")["orders"].as_array().unwrap() {
            let expected = match order["of"] == "freefem" {
                true => "disagree",
                false => "agree",
            };
            assert_eq!(order["verdict"], expected, "{to}: {order}");
        }
        assert!(page().contains("of <em>freefem</em> has order"), "{to}");
    }
    // A rule that is too low keeps the order, and only the other code shows it.
    let (code, told) = POISSON.verify_with(at, ("qft=qf5pT", "qft=qf2pT"), "4,8");
    assert_eq!(code, Some(1));
    let u = field(&told, "u");
    assert_eq!(u["pairs"][0]["verdict"], "disagree");
    for order in u["orders"].as_array().unwrap() {
        assert_eq!(order["verdict"], "agree", "{order}");
    }
}

/// Another material, and the load on another side.
#[test]
fn faults_in_vectors_are_found() {
    let faults: [(&Problem, &str, &str, &str, &str); 3] = [
        (&CANTILEVER, "1", "real E = 21", "real E = 1.001*21", "u"),
        (
            &CANTILEVER,
            "1",
            "s1() (nu/(1.0 - 2.0*nu))",
            "s1() (nu/(1.0 - nu))",
            "u",
        ),
        (&CROUZEIX_RAVIART, "4", "int1d(Th, 2,", "int1d(Th, 4,", "p"),
    ];
    for (problem, n, from, to, wrong) in faults {
        let folder = folder();
        let at = folder.path();
        problem.write(at);
        let (code, told) = problem.verify_with(at, ("", ""), n);
        assert_eq!(code, Some(0), "{told}");
        let (code, told) = problem.verify_with(at, (from, to), n);
        assert_eq!(code, Some(1), "{to}: {told}");
        assert_eq!(field(&told, wrong)["verdict"], "disagree", "{to}");
    }
}

/// FreeFEM makes meshes of its own, cut along other diagonals, and has its own quadrature: functions agree as far as they are discretised, and
/// a viscosity that is 1 % too large is seen.
#[test]
fn results_on_two_meshes_are_compared_as_functions() {
    let folder = folder();
    let at = folder.path();
    TAYLOR_HOOD.write(at);
    let script = at.join("stokes.edp");
    let text = fs::read_to_string(&script).unwrap();
    let text = text
        .replace("readmesh(reads)", "square(atoi(reads), atoi(reads))")
        .replace("qft=qf5pT", "qft=qf7pT");
    fs::write(&script, text).unwrap();
    let pair = fs::read_to_string(at.join("pair.toml")).unwrap();
    let own = pair
        .replacen("\"{mesh}\"", "\"{n}\"", 1)
        .replacen("\"medit\"", "\"none\"", 1);
    write(at, "pair.toml", &own);
    let (code, told) = TAYLOR_HOOD.verify_with(at, ("", ""), "4,8,16");
    assert_eq!(code, Some(0), "{told}");
    let (code, told) = TAYLOR_HOOD.verify_with(at, ("nu*d", "1.01*nu*d"), "4,8,16");
    assert_eq!(code, Some(1), "{told}");
    assert_eq!(field(&told, "u")["verdict"], "disagree", "{told}");
}
