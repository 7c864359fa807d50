//! Eigenproblems of form files: codes agree on eigenvalues and modes, which are those of books, and faults in a script are caught and named.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, faceoff, folder, source, told, write};

const SQUARE: &str = r#"name = "square"
[mesh]
generator = "union-jack"
n = 8
[spaces]
u = "P2"
[eigen]
a = "inner(grad(u), grad(v))*dx"
m = "u*v*dx"
count = 6
[dirichlet]
left = 0
right = 0
bottom = 0
top = 0
[codes]
use = ["rust", "freefem", "dolfinx", "scikit-fem", "ngsolve"]
[spectra.lambda]
exact = [19.739208802178716, 49.34802200544679, 49.34802200544679, 78.95683520871486, 98.69604401089358, 98.69604401089358]
exact_rtol = 4e-3
"#;

/// A beam of length 20 and height 1 in plane stress without Poisson's effect, clamped on the left: its lowest modes bend it.
const BEAM: &str = r#"name = "beam"
[mesh]
generator = "union-jack"
n = 8
size = [20, 1]
[spaces]
u = "P2^2"
[parameters]
E = 1200
rho = 2
[eigen]
a = "E*inner(sym(grad(u)), sym(grad(v)))*dx"
m = "rho*dot(u, v)*dx"
count = 2
[dirichlet]
left = [0, 0]
[codes]
use = ["rust", "scikit-fem", "freefem"]
[spectra.lambda]
"#;

/// FreeFEM's script as it was changed.
const WRONG: &str = r#"command = ["FreeFem++-nw", "-v", "0", "wrong.edp", "{mesh}", "{out}/NAME.vtu"]
mesh = "medit"
result = "NAME.vtu"
numbers = "NAME.csv"
"#;

pub(crate) fn run(at: &Path, words: &[&str]) -> Ran {
    let path = std::env::var("PATH").unwrap();
    let engines = source("target/python/bin");
    let mut command = faceoff(at);
    command.env("PATH", format!("{}:{path}", engines.display()));
    told(command.args(words).output().unwrap())
}

pub(crate) fn verify(at: &Path, text: &str) -> (Ran, Value) {
    write(at, "form.toml", text);
    let words = [
        "verify",
        "--run",
        "form.toml",
        "--json",
        "o.json",
        "--report",
        "page",
    ];
    let ran = run(at, &words);
    let schema = "src/report/schema/face-off-1.json";
    assert_valid("json", schema, &at.join("o.json"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    (ran, serde_json::from_str(&told).unwrap())
}

/// The form with FreeFEM's script in the place of all other codes but ours, one text in it put in the place of another.
pub(crate) fn with_fault(
    at: &Path,
    text: &str,
    name: &str,
    (from, to): (&str, &str),
) -> (Ran, Value) {
    write(at, "form.toml", text);
    let ran = run(at, &["write", "form.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stdout.contains(from), "{from} is not in {}", ran.stdout);
    write(at, "wrong.edp", &ran.stdout.replacen(from, to, 1));
    let start = text.find("use = [").unwrap();
    let end = start + text[start..].find('\n').unwrap();
    let codes = format!(
        "use = [\"rust\"]\n[codes.wrong]\n{}",
        WRONG.replace("NAME", name)
    );
    verify(at, &[&text[..start], &codes, &text[end..]].concat())
}

/// What is found of a code's pairs in our matrices, on the finest mesh.
pub(crate) fn residual<'a>(told: &'a Value, code: &str) -> &'a Value {
    let all = told["spectra"][0]["residuals"].as_array().unwrap();
    all.iter().rfind(|row| row["code"] == code).unwrap()
}

/// Every two codes have the same values and spaces, every pair solves the problem, and values are those that are known.
pub(crate) fn assert_agree(ran: &Ran, told: &Value, codes: usize) {
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let found = &told["spectra"][0];
    let pairs = found["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), codes * (codes - 1) / 2, "{found}");
    for pair in pairs {
        assert!(pair["relative"].as_f64().unwrap() < 1e-10, "{pair}");
        let spaces = pair["spaces"].as_array().unwrap();
        let apart = |space: &Value| space["sine"].as_f64().unwrap() > 1e-7;
        assert!(!spaces.is_empty() && !spaces.iter().any(apart), "{pair}");
    }
    let residuals = found["residuals"].as_array().unwrap();
    assert_eq!(residuals.len(), codes);
    for row in residuals {
        assert!(row["residual"].as_f64().unwrap() < 1e-9, "{row}");
        assert!(row["dirichlet"].as_f64().unwrap() < 1e-12, "{row}");
    }
}

#[test]
fn modes_of_the_square_agree_in_five_codes_and_faults_are_named() {
    let folder = folder();
    let at = folder.path();
    let (ran, told) = verify(at, SQUARE);
    assert_agree(&ran, &told, 5);
    let exact = told["spectra"][0]["exact"].as_array().unwrap();
    assert!(
        exact.iter().all(|row| row["verdict"] == "agree"),
        "{exact:?}"
    );
    let faults = [
        // The mass, all of it; the values of a group; a direction of the gradient; a mode of another eigenvalue.
        ("du*v);", "1.01*du*v);", "the factor 0.990099"),
        ("  + on(4, du = 0.0)\n", "", "`left` were not imposed"),
        (
            "dy(du)*dy(v)",
            "0.999*dy(du)*dy(v)",
            "the derivative by y of the test function had the factor 0.999",
        ),
        (
            "u[] = modes(:, mode);",
            "u[] = modes(:, (mode == 0 ? 3 : mode));",
            "Au = λMu",
        ),
    ];
    for (from, to, words) in faults {
        let (ran, told) = with_fault(at, SQUARE, "square", (from, to));
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(residual(&told, "wrong")["verdict"], "disagree", "{to}");
        assert_eq!(residual(&told, "rust")["verdict"], "agree", "{to}");
        assert!(ran.stdout.contains(words), "{to}: {}", ran.stdout);
    }
    // Residuals count also where nothing is said of modes, as of codes that share the problem only.
    let loose = "[spectra.lambda]\nsame = \"problem\"";
    let text = SQUARE.replacen("[spectra.lambda]", loose, 1);
    let (from, to, _) = faults[3];
    let (ran, told) = with_fault(at, &text, "square", (from, to));
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(residual(&told, "wrong")["verdict"], "disagree");
}

/// Trefethen and Betcke, Computed eigenmodes of planar regions, 2006.
#[test]
fn the_l_shape_has_the_eigenvalues_of_trefethen_and_betcke() {
    let folder = folder();
    let at = folder.path();
    fs::copy(source("examples/forms/l.msh"), at.join("l.msh")).unwrap();
    let text = fs::read_to_string(source("examples/forms/l-shape.toml")).unwrap();
    let text = text.replace("n = [1, 2, 4]", "n = [1, 4]");
    let few = text.replace("\"dolfinx\", \"scikit-fem\", \"ngsolve\"", "\"scikit-fem\"");
    let (ran, told) = verify(
        at,
        &few.replace("n = [1, 4]", "n = 4")
            .replace("exact_rtol = 1e-2", "exact_rtol = 1.5e-3"),
    );
    assert_agree(&ran, &told, 3);
    let exact = told["spectra"][0]["exact"].as_array().unwrap();
    assert_eq!(exact.len(), 3);
    for row in exact {
        // The first one is that of the corner, which converges least.
        assert_eq!(row["values"].as_array().unwrap().len(), 5, "{row}");
        assert!(row["relative"].as_f64().unwrap() < 1.5e-3, "{row}");
    }
    // A load that is no part of the mass, and a mesh with another corner's cell twice as dense.
    let n = text.replace("n = [1, 4]", "n = 1");
    for (from, to) in [
        ("du*v);", "du*v + 1e-4*du*dx(v));"),
        ("dx(du)*dx(v)", "(1 + 0.01*(x > 1))*dx(du)*dx(v)"),
    ] {
        let (ran, told) = with_fault(at, &n, "l-shape", (from, to));
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(residual(&told, "wrong")["verdict"], "disagree", "{to}");
    }
}

#[test]
fn a_beam_bends_as_euler_and_bernoulli_say() {
    let folder = folder();
    let at = folder.path();
    // βL of a clamped beam; λ = ω² = β⁴ EI/ρA, and I/A = 1/12.
    let beta = [1.875_104_068_711_961_f64, 4.694_091_132_974_174];
    let exact = beta.map(|x| (x / 20.0).powi(4) * 1200.0 / 12.0 / 2.0);
    let text = format!(
        "{BEAM}rtol = 1e-6\nexact = [{}, {}]\nexact_rtol = 0.01\n",
        exact[0], exact[1]
    );
    let (ran, told) = verify(at, &text);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let found = &told["spectra"][0];
    for what in ["pairs", "residuals", "exact"] {
        assert_eq!(found[what].as_array().unwrap().len(), 3, "{found}");
    }
    for (from, to) in [
        ("(0.5*E)*dx(du2)*dy(v1)", "(0.5*E)*dx(du2)*dx(v1)"),
        ("real rho = 2.0", "real rho = 2.02"),
        ("        + (E)*dy(du2)*dy(v2)", ""),
    ] {
        let (ran, told) = with_fault(at, &text, "beam", (from, to));
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(residual(&told, "wrong")["verdict"], "disagree", "{to}");
        assert_eq!(residual(&told, "rust")["verdict"], "agree", "{to}");
    }
}

#[test]
fn resonances_of_a_cavity_agree_above_their_kernel() {
    let folder = folder();
    let at = folder.path();
    let text = fs::read_to_string(source("examples/forms/cavity.toml")).unwrap();
    let text = text.replace("n = [4, 8, 16]", "n = 8");
    let few = text.replace("\"dolfinx\", \"scikit-fem\", \"ngsolve\"", "\"ngsolve\"");
    let (ran, told) = verify(at, &few.replace("exact_rtol = 1e-2", "exact_rtol = 2e-2"));
    assert_agree(&ran, &told, 3);
    for row in told["spectra"][0]["exact"].as_array().unwrap() {
        assert_eq!(row["values"].as_array().unwrap().len(), 8, "{row}");
    }
    for (from, to, words) in [
        (
            "  + on(2, du1 = 0.0, du2 = 0.0)\n",
            "",
            "Dirichlet values are off",
        ),
        ("+ du2*v2", "+ 0.98*du2*v2", "0.98"),
        // A gradient, which no curl shows.
        (
            "u1[] = modes(:, mode);",
            "u1[] = modes(:, mode);\nVh [g1, g2] = [y*(1 - y)*(1 - 2*x), x*(1 - x)*(1 - 2*y)];\nu1[] += 1e-4*g1[];",
            "Au = λMu",
        ),
    ] {
        let (ran, told) = with_fault(at, &text, "cavity", (from, to));
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(residual(&told, "wrong")["verdict"], "disagree", "{to}");
        assert!(ran.stdout.contains(words), "{to}: {}", ran.stdout);
    }
}

#[test]
fn what_is_no_eigenproblem_is_refused_with_its_place() {
    let folder = folder();
    let at = folder.path();
    let form = "[form]\nF = \"u*v*dx\"\n[codes]";
    let cases = [
        ("m = \"u*v*dx\"\n", "", "the eigenproblem has no m"),
        (
            "count = 6",
            "count = 0",
            "count is not a number of eigenvalues",
        ),
        (
            "count = 6",
            "count = 6\nshift = nan",
            "shift is not a finite number",
        ),
        ("u*v*dx", "u*u*v*dx", "not linear in the unknown"),
        ("u*v*dx", "u*v*dx + v*dx", "not linear in the unknown"),
        (
            "u*v*dx",
            "u*grad(v)[0]*dx",
            "change where u and v are exchanged",
        ),
        (
            "left = 0",
            "left = 1",
            "a Dirichlet value of an eigenproblem is not 0",
        ),
        (
            "[codes]",
            "[mean]\nu = 0\n[codes]",
            "an eigenproblem has no [mean]",
        ),
        (
            "[codes]",
            "[fields.u]\nrtol = 1e-9\n[codes]",
            "an eigenproblem has no [fields]",
        ),
        ("[codes]", form, "there are [form] and [eigen]"),
        (
            "[spectra.lambda]",
            "[spectra.lambda]\ncount = 3",
            "count is what [eigen] and its scripts have",
        ),
        (
            "[codes]",
            "[codes]\nsystems = true",
            "an eigenproblem has two matrices",
        ),
    ];
    for (from, to, words) in cases {
        assert!(SQUARE.contains(from), "{from}");
        write(at, "form.toml", &SQUARE.replacen(from, to, 1));
        let ran = run(at, &["verify", "form.toml"]);
        assert_eq!(ran.code, Some(2), "{to}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(words), "{to}: {}", ran.stderr);
    }
    // A free membrane has the eigenvalue 0, which is the shift.
    let free = SQUARE.replace("left = 0\nright = 0\nbottom = 0\ntop = 0\n", "");
    let several = free.replace("u = \"P2\"", "u = \"P2\"\np = \"P1\"");
    write(at, "form.toml", &several);
    let ran = run(at, &["verify", "form.toml"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let words = "an eigenproblem is of one unknown";
    assert!(ran.stderr.contains(words), "{}", ran.stderr);
    write(at, "form.toml", &free);
    let words = ["verify", "form.toml", "--engines", "rust,freefem"];
    let ran = run(at, &words);
    // FreeFEM's factorisation does not see it, and its pair of the kernel is not one to rounding.
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout
            .contains("give a shift that is not an eigenvalue"),
        "{}",
        ran.stdout
    );
    // Codes without scripts of eigenproblems are missing, and a single result says nothing of eigenvalues.
    write(at, "form.toml", SQUARE);
    let ran = run(at, &["write", "form.toml", "--for", "getfem"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("solve no eigenproblems"),
        "{}",
        ran.stderr
    );
}
