//! `faceoff judge` with a form: results of real codes that solve it, and of real codes whose scripts were changed.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, run_dolfinx, source, told};

/// Writes the script of a code with one text instead of another, runs it, and returns its result.
fn result(at: &Path, form: &str, code: &str, change: (&str, &str)) -> String {
    let file = format!("{form}.toml");
    fs::copy(source("examples/forms").join(&file), at.join(&file)).unwrap();
    changed(at, form, code, &[change])
}

/// The same with several texts, of a form that is already there.
pub fn changed(at: &Path, form: &str, code: &str, changes: &[(&str, &str)]) -> String {
    let file = format!("{form}.toml");
    fs::create_dir_all(at.join("out")).unwrap();
    let ran = run(at, &["write", &file, "--for", code, "-o", "out"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let script = match code {
        "freefem" => format!("out/{form}.edp"),
        _ => format!("out/{form}_dolfinx.py"),
    };
    let mut text = fs::read_to_string(at.join(&script)).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{script} does not contain {from}");
        text = text.replace(from, to);
    }
    fs::write(at.join(&script), text).unwrap();
    solve(&at.join(script));
    let suffix = if code == "freefem" { "" } else { "_dolfinx" };
    format!("out/{form}{suffix}.vtu")
}

/// Runs a script of FreeFEM or dolfinx in its folder, where it reads the mesh.
pub fn solve(script: &Path) {
    if script.extension().is_some_and(|of| of == "py") {
        return run_dolfinx(script, &[]);
    }
    let mut command = Command::new("FreeFem++-nw");
    let command = command.args(["-v", "0"]).arg(script);
    let ran = told(
        command
            .current_dir(script.parent().unwrap())
            .output()
            .unwrap(),
    );
    assert_eq!(ran.code, Some(0), "{}: {}", script.display(), ran.stdout);
}

pub fn judge(at: &Path, form: &str, result: &str) -> (Option<i32>, Value) {
    let file = format!("{form}.toml");
    let words = [
        "judge", result, "--scene", &file, "--json", "o.json", "--report", "page", "--junit",
        "j.xml",
    ];
    let ran = run(at, &words);
    assert_valid(
        "json",
        "src/report/schema/judge-form-1.json",
        &at.join("o.json"),
    );
    assert_valid("xsd", "tests/junit.xsd", &at.join("j.xml"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    (ran.code, serde_json::from_str(&told).unwrap())
}

#[test]
fn what_codes_find_solves_the_form() {
    for form in [
        "poisson",
        "darcy",
        "stokes-closed",
        "minimal-surface",
        "interior-penalty",
    ] {
        for code in ["freefem", "dolfinx"] {
            let folder = folder();
            let at = folder.path();
            let found = result(at, form, code, ("", ""));
            let (exit, told) = judge(at, form, &found);
            assert_eq!(exit, Some(0), "{form} by {code}: {told}");
            assert!(
                told["residual"].as_f64().unwrap() < 1e-13,
                "{form} by {code}: {told}"
            );
        }
    }
}

/// A form and a code, one text of its script with another in its place, and the kind, the term or the place, and the factor of what is told.
type Planted = (
    &'static str,
    &'static str,
    [&'static str; 2],
    &'static str,
    &'static str,
    Option<f64>,
);

const PLANTED: [Planted; 6] = [
    (
        "poisson",
        "freefem",
        ["(-t)*v", "(t)*v"],
        "factor",
        "t*v*ds(right)",
        Some(-1.0),
    ),
    (
        "poisson",
        "dolfinx",
        ["- f*v*dx", "- 1.001*f*v*dx"],
        "factor",
        "f*v*dx",
        Some(1.001),
    ),
    (
        "stokes-closed",
        "dolfinx",
        ["nu*inner", "0.99*nu*inner"],
        "factor",
        "nu*inner(grad(u), grad(v))*dx",
        Some(0.99),
    ),
    (
        "convection",
        "freefem",
        ["real c = 1.0", "real c = 1.5"],
        "parameter",
        "c",
        Some(1.5),
    ),
    (
        "convection",
        "dolfinx",
        ["- f*v*dx", "- f*v*dx + 1e-4*x[0]*u*v*dx"],
        "varying",
        "c*u*v*dx",
        Some(1e-4),
    ),
    // No change that is known.
    (
        "minimal-surface",
        "dolfinx",
        ["F = (\n    ", "F = 1e-3*v*dx + (\n    "],
        "",
        "",
        None,
    ),
];

#[test]
fn faults_planted_in_scripts_are_told_with_their_cause() {
    for (form, code, [from, to], kind, name, factor) in PLANTED {
        let folder = folder();
        let at = folder.path();
        let found = result(at, form, code, (from, to));
        let (exit, told) = judge(at, form, &found);
        assert_eq!(exit, Some(1), "{form}: {told}");
        assert_eq!(told["verdict"], "disagree");
        let sentence = told["sentence"].as_str().unwrap();
        println!("{form} by {code}, {to}: {sentence}");
        let all = told["explanations"].as_array().unwrap();
        if kind.is_empty() {
            let is_told = sentence.contains("no change that is known explains it");
            assert!(all.is_empty() && is_told, "{told}");
            continue;
        }
        assert!(sentence.contains("it solves the form as if"), "{sentence}");
        assert_eq!(all.len(), 1, "{told}");
        // A rule of one point and a datum at centres are one thing for P1.
        let others = told["alike"].as_array().into_iter().flatten();
        let mut each = all.iter().chain(others.map(|one| &one[0]));
        let found = each.find(|cause| {
            cause["kind"] == kind && [&cause["term"], &cause["where"]].contains(&&Value::from(name))
        });
        let found = found.unwrap_or_else(|| panic!("{told}"));
        match factor {
            None => assert!(found.get("factor").is_none(), "{told}"),
            Some(factor) => assert!(
                (found["factor"].as_f64().unwrap() - factor).abs() < 1e-8,
                "{told}"
            ),
        }
    }
}

#[test]
fn dirichlet_values_that_are_off_are_told_with_their_place() {
    let changes = [
        (
            "freefem",
            "value2(du, v) = on(3, du = exp",
            "value2(du, v) = on(3, du = 1.001*exp",
        ),
        (
            "dolfinx",
            "hold(V, 3, lambda x: np.exp",
            "hold(V, 3, lambda x: 1.001*np.exp",
        ),
    ];
    for (code, from, to) in changes {
        let folder = folder();
        let at = folder.path();
        let found = result(at, "poisson", code, (from, to));
        let (exit, told) = judge(at, "poisson", &found);
        assert_eq!(
            (exit, told["failing"].as_u64()),
            (Some(1), Some(0)),
            "{told}"
        );
        // The top, where y = 1.
        let held = told["held"].as_array().unwrap();
        assert!(
            !held.is_empty() && held.iter().all(|row| row["at"][1] == 1.0),
            "{told}"
        );
        let (most, x) = (&held[0]["residual"], &held[0]["at"][0]);
        let wanted = 1e-3 * x.as_f64().unwrap().exp() * 2_f64.sin();
        assert!((most.as_f64().unwrap() - wanted).abs() < 1e-12, "{told}");
        let sentence = told["sentence"].as_str().unwrap();
        let cause = "as if the Dirichlet values of `u` on `top` had the factor 1.001";
        assert!(sentence.contains(cause), "{sentence}");
        assert_eq!(told["explanations"][0]["kind"], "dirichlet");
    }
}

#[test]
fn a_penalty_in_place_of_dirichlet_values_is_told() {
    let folder = folder();
    let at = folder.path();
    let exact = "A.zeroRowsColumns(held, 1.0, d, r)";
    let penalty = "diagonal = A.getDiagonal()
    diagonal.array[held] += 1e8
    A.setDiagonal(diagonal)
    r.array[held] += 1e8*d.array[held]";
    let found = result(at, "poisson", "dolfinx", (exact, penalty));
    let (exit, told) = judge(at, "poisson", &found);
    assert_eq!(exit, Some(1), "{told}");
    let sentence = told["sentence"].as_str().unwrap();
    let cause =
        "as if Dirichlet values g were imposed by the penalty 10⁸ times `(u - g) at each dof`";
    assert!(sentence.contains(cause), "{sentence}");
    assert_eq!(told["explanations"][0]["kind"], "penalty");
    let factor = told["explanations"][0]["factor"].as_f64().unwrap();
    assert!((factor - 1e8).abs() < 1e3, "{told}");
}

#[test]
fn what_is_no_result_of_the_form_is_not_judged() {
    let folder = folder();
    let at = folder.path();
    let found = result(at, "poisson", "freefem", ("", ""));
    let text = fs::read_to_string(at.join(&found)).unwrap();
    let form = fs::read_to_string(at.join("poisson.toml")).unwrap();
    let other = |name: &str, from: &str, to: &str| {
        assert!(form.contains(from));
        fs::write(at.join(name), form.replace(from, to)).unwrap();
    };
    fs::write(at.join("other.vtu"), text.replace("Name='u'", "Name='w'")).unwrap();
    other("linear.toml", "u = \"P2\"", "u = \"P1\"");
    other("coarse.toml", "n = [4, 8, 16]", "n = 2");
    let cases = [
        ("other.vtu", "poisson.toml", "no field `u`"),
        (&found, "linear.toml", "is not a function of P1"),
        (
            &found,
            "coarse.toml",
            "the result has 32 cells, and the form's mesh 8",
        ),
    ];
    for (result, form, what) in cases {
        let ran = run(at, &["judge", result, "--scene", form, "--json", "o.json"]);
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(ran.stderr.contains(what), "{}", ran.stderr);
        assert_valid(
            "json",
            "src/report/schema/judge-form-1.json",
            &at.join("o.json"),
        );
    }
    let ran = run(
        at,
        &["judge", &found, "--scene", "poisson.toml", "--gamma0", "3"],
    );
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("--gamma0 is for scenes"),
        "{}",
        ran.stderr
    );
}
