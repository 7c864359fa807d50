//! Schemes by hand for contact in elasticity, broken on purpose: in a copy of a script one thing is changed, and `judge` must say that its result does not
//! solve the scheme, and which one it solves instead.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{folder, run, source, write};
use crate::judge_forms::solve;

/// Writes the script of a code for a scene, with one text instead of another, and runs it; the name of its result.
fn result(at: &Path, code: &str, scene: &str, from: &str, to: &str) -> String {
    let ran = run(at, &["write", scene, "--for", code, "--n", "4", "-o", "."]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let script = match code {
        "freefem" => format!("{scene}-cr.edp"),
        _ => format!("{scene}-cr_fenicsx.py"),
    };
    let text = fs::read_to_string(at.join(&script)).unwrap();
    assert!(text.contains(from), "{script} does not contain {from}");
    fs::write(at.join(&script), text.replacen(from, to, 1)).unwrap();
    solve(&at.join(script));
    match code {
        "freefem" => format!("{scene}-cr.vtu"),
        _ => format!("{scene}-cr_fenicsx.vtu"),
    }
}

/// The exit code of `judge` on the result of a changed script, and what it says.
fn judged(code: &str, scene: &str, from: &str, to: &str) -> (Option<i32>, String) {
    let folder = folder();
    let at = folder.path();
    let result = result(at, code, scene, from, to);
    let ran = run(at, &["judge", &result, "--scene", scene, "--n", "4"]);
    (ran.code, ran.stdout + &ran.stderr)
}

fn caught(code: &str, scene: &str, from: &str, to: &str) {
    let (exit, said) = judged(code, scene, from, to);
    assert_eq!(exit, Some(1), "{from} -> {to}: {said}");
}

#[test]
fn unchanged_scripts_pass() {
    for (code, scene) in [
        ("freefem", "elastic-transition"),
        ("freefem", "friction-patch"),
        ("fenicsx", "elastic-transition"),
    ] {
        let (exit, said) = judged(code, scene, "gamma", "gamma");
        assert_eq!(exit, Some(0), "{code} {scene}: {said}");
    }
}

#[test]
fn freefem_terms_that_are_wrong() {
    for (from, to) in [
        // Both in the residual and in its derivative, or Newton's method would end elsewhere or not at all.
        (
            " - sigman(u)*un(v) + shear(u, v))",
            " - 0.999999*sigman(u)*un(v) + shear(u, v))",
        ),
        ("law(u)*contactTest(v)", "(1 + 1e-6)*law(u)*contactTest(v)"),
        (
            "macro gamma() (gamma0*hTriangle",
            "macro gamma() (1.000001*gamma0*hTriangle",
        ),
        (
            "lambda*divergence(u)*divergence(v)) //",
            "(1 + 1e-6)*lambda*divergence(u)*divergence(v)) //",
        ),
        ("beta*2*mu/lenEdge", "beta*mu/lenEdge"),
        ("(f1*v#1 + f2*v#2)", "(f1*v#1 + (1 + 1e-6)*f2*v#2)"),
        ("(t1*v#1 + t2*v#2)", "(t1*v#1)"),
    ] {
        caught("freefem", "elastic-transition", from, to);
    }
    for (from, to) in [
        (
            "macro radius(u) (coefficient*max(-Pn(u), 0.))",
            "macro radius(u) (1.000001*coefficient*max(-Pn(u), 0.))",
        ),
        ("- sigmat(u)*ut(v))", "- 1.000001*sigmat(u)*ut(v))"),
    ] {
        caught("freefem", "friction-patch", from, to);
    }
}

#[test]
fn fenicsx_terms_that_are_wrong() {
    for (from, to) in [
        (
            "- sigma_n(u) * normal(v)) * ds_C",
            "- 1.000001 * sigma_n(u) * normal(v)) * ds_C",
        ),
        ("data[\"beta\"] * 2 * mu", "data[\"beta\"] * mu"),
        (
            "F -= dot(data[\"f\"], v) * dx",
            "F -= 1.000001 * dot(data[\"f\"], v) * dx",
        ),
        (
            "gamma = data[\"gamma0\"] * h",
            "gamma = 1.000001 * data[\"gamma0\"] * h",
        ),
    ] {
        caught("fenicsx", "elastic-transition", from, to);
    }
    let from = "F += (slip * (theta1 * sigma_t(v) + theta2 / gamma * along(v)) - sigma_t(u) * along(v)) * ds_C";
    let to = "F += (slip * (theta1 * sigma_t(v) + theta2 / gamma * along(v)) - 1.000001 * sigma_t(u) * along(v)) * ds_C";
    caught("fenicsx", "friction-patch", from, to);
}

/// A user's own script by penalty, which has nothing of ours: the page says what it solves in place of the scheme.
#[test]
fn a_script_by_penalty_is_told_what_it_solves() {
    let folder = folder();
    let at = folder.path();
    // Its rules are those that FreeFEM takes where none is given.
    let scene = source("crates/form/src/elastic/builtin/elastic-transition.toml");
    let scene = fs::read_to_string(scene).unwrap();
    let usual = scene
        .lines()
        .filter(|line| !line.starts_with("facet_degree"));
    write(at, "scene.toml", &usual.collect::<Vec<_>>().join("\n"));
    let words = "write scene.toml --for freefem --method p1 --n 4 -o .";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let out = Command::new("FreeFem++-nw")
        .current_dir(at)
        .args(["-v", "0"])
        .arg(source("tests/elastic/penalty.edp"))
        .args(["elastic-transition-p1.mesh", "penalty.vtk"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success(), "{said}");
    let words =
        "judge penalty.vtk --scene scene.toml --method p1 --n 4 --report page --json o.json";
    let ran = run(at, &words.split(' ').collect::<Vec<_>>());
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    for said in [&*ran.stdout, &page] {
        let part = "contact was imposed by the penalty";
        assert!(said.contains(part), "{said}");
    }
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let causes = told["explanations"].as_array().unwrap();
    let penalty = causes.iter().find(|of| of["kind"] == "penalty").unwrap();
    let factor = penalty["factor"].as_f64().unwrap();
    assert!((factor - 1000.0).abs() < 1e-6, "{factor}");
}
