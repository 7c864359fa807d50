//! Forms on quadrangles and hexahedra by the program: codes that have them, those that do not, scripts to keep, and what a changed script solves.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, faceoff, folder, source, told, write};
use crate::judge_forms;

fn run(at: &Path, words: &[&str]) -> Ran {
    let path = std::env::var("PATH").unwrap();
    let engines = source("target/python/bin");
    let mut command = faceoff(at);
    command.env("PATH", format!("{}:{path}", engines.display()));
    told(command.args(words).output().unwrap())
}

/// A form of the gallery with its mesh.
fn copy(at: &Path, name: &str) -> String {
    let from = source("examples/forms");
    for file in [format!("{name}.toml"), "ring.msh".to_owned()] {
        fs::copy(from.join(&file), at.join(&file)).unwrap();
    }
    format!("{name}.toml")
}

fn json(at: &Path, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(at.join(name)).unwrap()).unwrap()
}

/// Codes run side by side, and are told in the order of the file.
#[test]
fn codes_agree_on_hexahedra_with_the_orders_of_theory() {
    let folder = folder();
    let at = folder.path();
    let file = copy(at, "block");
    let words = [
        "--engines",
        "rust,scikit-fem,ngsolve,getfem",
        "--json",
        "o.json",
        "--report",
        "page",
    ];
    let ran = run(at, &[&["verify", &file], &words[..]].concat());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let told = json(at, "o.json");
    let codes: Vec<&str> = told["runs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| run["code"].as_str().unwrap())
        .collect();
    let each = ["rust", "scikit-fem", "ngsolve", "getfem"];
    assert_eq!(codes, [each, each, each].concat());
    let cores = std::thread::available_parallelism().unwrap().get();
    assert_eq!(told["at_once"], cores.min(4));
    let order = &told["fields"][0]["orders"][0]["l2"]["fit"]["exponent"];
    assert!((order.as_f64().unwrap() - 3.0).abs() < 0.2, "{order}");
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert_eq!(page.contains("ran at the same time"), cores > 1);
}

/// A code without quadrangles is missing, which is no pass.
#[test]
fn a_code_without_quadrangles_is_missing() {
    let folder = folder();
    let at = folder.path();
    let file = copy(at, "ring");
    let text = fs::read_to_string(at.join(&file)).unwrap();
    write(at, &file, &text.replace("\"dolfinx\"", "\"freefem\""));
    let words = [
        "verify",
        &file,
        "--engines",
        "rust,freefem,scikit-fem",
        "--n",
        "1,2",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let why = "FreeFEM has no quadrangles, only triangles";
    assert!(ran.stderr.contains(why), "{}", ran.stderr);
    let ran = run(at, &[&words[..], &["--allow-missing"]].concat());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stderr.contains(why), "{}", ran.stderr);
    let ran = run(at, &["write", &file, "--for", "freefem"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains(why), "{}", ran.stderr);
    write(
        at,
        &file,
        &text.replace("file = \"ring.msh\"", "generator = \"quads\""),
    );
    let ran = run(at, &["verify", &file]);
    assert!(
        ran.stderr
            .contains("take union-jack, union-cube, quadrangles, hexahedra, or a file"),
        "{}",
        ran.stderr
    );
}

/// The form's mesh is called as the script's would be, in another version of the format: the script gets one of another name.
#[test]
fn a_script_beside_the_mesh_of_its_form_and_what_it_solves() {
    let folder = folder();
    let at = folder.path();
    let file = copy(at, "ring");
    let mesh = fs::read(at.join("ring.msh")).unwrap();
    let ran = run(at, &["write", &file, "--for", "dolfinx", "-o", "."]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(fs::read(at.join("ring.msh")).unwrap(), mesh);
    let script = fs::read_to_string(at.join("ring_dolfinx.py")).unwrap();
    assert!(script.contains("reads ring-dolfinx.msh and writes ring_dolfinx.vtu"));
    let solve = |text: &str| {
        judge_forms::solve(&write(at, "ring_dolfinx.py", text));
        run(
            at,
            &[
                "judge",
                "ring_dolfinx.vtu",
                "--scene",
                &file,
                "--json",
                "j.json",
                "--report",
                "page",
            ],
        )
    };
    let ran = solve(&script);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(json(at, "j.json")["residual"].as_f64().unwrap() < 1e-13);
    let faults = [
        (
            "- f*v*dx",
            "- 1.5*f*v*dx",
            "the term `f*v*dx` had the factor 1.5",
        ),
        (
            "- f*v*dx",
            "- f*v*dx(metadata={\"quadrature_degree\": 2})",
            "the term `f*v*dx` were integrated by the rule `gauss-2`",
        ),
        (
            "k = 1 + x[0]*x[1]",
            "k = fem.Constant(mesh, PETSc.ScalarType(1.0))",
            "as if `k` were 1",
        ),
    ];
    for (from, to, words) in faults {
        assert!(script.contains(from), "{script}");
        let ran = solve(&script.replace(from, to));
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stdout.contains(words), "{to}: {}", ran.stdout);
    }
}
