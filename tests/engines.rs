//! The main job with the real FreeFEM and the real dolfinx. A missing one fails these tests, and
//! the message has the command that brings it.

use crate::common::{changed_companion, faceoff, folder, run, scene, told, write};

#[test]
fn three_engines_agree_on_all_scenes_with_both_methods() {
    let folder = folder();
    let ran = run(folder.path(), &["verify", "--n", "16", "--json", "-"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let outcome = ran.json();
    assert_eq!(outcome["verdict"], "agree");
    let cases = outcome["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4 * 2, "scenes, methods");
    for case in cases {
        let tolerance = if case["method"] == "cr" { 1e-12 } else { 1e-11 };
        let engines = case["engines"].as_array().unwrap();
        assert_eq!(engines.len(), 3);
        for engine in engines {
            assert_eq!(engine["finite"], true);
            assert!(engine["residual"].as_f64().unwrap() < 1e-13);
            assert!((1..=12).contains(&engine["iterations"].as_u64().unwrap()));
            assert!(!engine["version"].as_str().unwrap().is_empty());
        }
        let pairs = case["pairs"].as_array().unwrap();
        assert_eq!(pairs.len(), 3 * 4, "pairs of engines, fields");
        for pair in pairs {
            assert_eq!(pair["verdict"], "agree");
            assert!(pair["max_rel"].as_f64().unwrap() <= tolerance);
            assert!(pair["worst"]["vertices"].as_array().unwrap().len() == 2);
        }
    }
    // Nothing is left where the program ran.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn fine_meshes_agree_to_the_same_digits() {
    let folder = folder();
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--methods",
        "cr,cr-fc",
        "--n",
        "128",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn methods_agree_within_certified_bounds() {
    let folder = folder();
    let ran = run(
        folder.path(),
        &[
            "verify",
            "one-zone",
            "plate",
            "--n",
            "16,32",
            "--methods",
            "cr,cr-fc,p2",
            "--engines",
            "rust,freefem",
            "--json",
            "-",
        ],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let outcome = ran.json();
    let cross = outcome["cross"].as_array().unwrap();
    // Scenes, meshes, pairs of methods, pairs of engines.
    assert_eq!(cross.len(), 2 * 2 * 3 * 4);
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    for pair in cross {
        let judged = &pair["judged"];
        assert_eq!(judged["verdict"], "agree", "{pair}");
        let sum = number(&judged["bounds"][0]) + number(&judged["bounds"][1]);
        assert!(number(&judged["distance"]) <= sum, "{pair}");
        assert!((sum - number(&judged["distance"]) - number(&judged["slack"])).abs() < 1e-12 * sum);
        assert!(
            sum < number(&judged["gradient"]),
            "the bounds say nothing: {pair}"
        );
    }
    // Half the mesh size, half the bounds.
    let bound = |n: u32| {
        let pair = cross
            .iter()
            .find(|p| p["n"] == n && p["scene"] == "one-zone")
            .unwrap();
        number(&pair["judged"]["best"])
    };
    assert!(bound(16) / bound(32) > 1.8, "{} {}", bound(16), bound(32));
}

/// The load is forgotten by one code: its own scheme tells, and so does the bound.
#[test]
fn a_wrong_field_stands_out() {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", "(f*v)", "(0.*f*v)");
    let engines = format!("rust,{engine}");
    let words = [
        "verify",
        "one-zone",
        "--engines",
        &engines,
        "--n",
        "16",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let outcome = ran.json();
    let cross = outcome["cross"].as_array().unwrap();
    for pair in cross {
        let wrong = [&pair["a"], &pair["b"]]
            .iter()
            .any(|s| s["engine"] != "rust");
        let expected = if wrong { "disagree" } else { "agree" };
        assert_eq!(pair["judged"]["verdict"], expected, "{pair}");
    }
}

#[test]
fn the_whole_family_agrees() {
    let folder = folder();
    let words = [
        "verify",
        "plate",
        "--methods",
        "cr(1,1),cr(0,1),p1,p1(1,0),p2(1,0),p2(0,1)",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn the_corrected_flux_agrees_in_all_engines() {
    let folder = folder();
    // Zones; every datum inhomogeneous; cells with two contact faces.
    for scene in ["five-zones", "plate", "two-sides-contact"] {
        let words = ["verify", scene, "--methods", "cr,cr-fc,p2", "--json", "-"];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{scene}: {}{}", ran.stdout, ran.stderr);
        let outcome = ran.json();
        let cases = outcome["cases"].as_array().unwrap();
        let case = cases.iter().find(|c| c["method"] == "cr-fc").unwrap();
        let pairs = case["pairs"].as_array().unwrap();
        assert_eq!(pairs.len(), 3 * 4, "pairs of engines, fields");
        for pair in pairs.iter().filter(|p| p["field"] == "mean") {
            assert_eq!(pair["tolerance"], 1e-12);
            assert!(pair["max_rel"].as_f64().unwrap() <= 1e-12, "{pair}");
        }
    }
}

#[test]
fn every_function_of_expressions_means_the_same_in_every_engine() {
    let folder = folder();
    let f = "sin(x)+cos(y)+tan(0.5*x)+asin(0.5*x)+acos(0.5*y)+atan(x)+atan2(y+0.1,x-0.3)+sinh(x)\
             +cosh(y)+tanh(x)+exp(-x)+log(1+x)+sqrt(x+y)+abs(x-0.3)+min(x,y)+max(x,0.25)\
             +pow(1+x,1.5)+(x-0.5)^2-1/3+if(x < 0.31, 2, -1)+if(y >= 0.27, x, pi)+2e-3";
    let scene = scene(folder.path(), "one-zone", "-2*pi*sin(2*pi*x)", f);
    let ran = run(
        folder.path(),
        &["verify", &scene, "--n", "8", "--json", "-"],
    );
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

#[test]
fn every_quadrature_rule_and_h_is_taken_by_every_engine() {
    let folder = folder();
    for (load, contact, h) in [
        ("edges-3", "gauss-3", "global"),
        ("centroid", "gauss-2", "local"),
        ("radon-7", "midpoint", "global"),
    ] {
        let method = format!(
            "[method]\nload_quadrature = \"{load}\"\ncontact_quadrature = \"{contact}\"\nh = \"{h}\"\n\n[data]"
        );
        let scene = scene(folder.path(), "plate", "[data]", &method);
        std::fs::copy(
            crate::common::source("meshes/plate.msh"),
            folder.path().join("plate.msh"),
        )
        .unwrap();
        let words = ["verify", &scene, "--methods", "cr,cr-fc,p2", "--json", "-"];
        let ran = run(folder.path(), &words);
        assert_eq!(
            ran.code,
            Some(0),
            "{load} {contact}: {}{}",
            ran.stdout,
            ran.stderr
        );
    }
}

#[test]
fn exact_scenes_agree_and_their_errors_are_told() {
    let folder = folder();
    // Singular, smooth, and with a side that is split.
    let scenes = [
        "transition-1.5",
        "two-sides-contact",
        "dirichlet-meets-contact",
    ];
    let words = ["verify", scenes[0], scenes[1], scenes[2], "--json", "-"];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(ran.json()["cases"].as_array().unwrap().len(), 3 * 2);
    let error = |engine: &str, method: &str, n: &str| -> [f64; 2] {
        let words = [
            "solve", scenes[0], "--engine", engine, "--method", method, "--n", n, "--json", "-",
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let error = &ran.json()["error"];
        ["h1", "l2"].map(|key| error[key].as_f64().unwrap())
    };
    let coarse = error("rust", "cr", "16");
    for engine in ["freefem", "fenicsx"] {
        for (a, b) in coarse.iter().zip(error(engine, "cr", "16")) {
            assert!((a - b).abs() < 1e-10 * a, "{engine} {a} {b}");
        }
    }
    // A singular and a smooth one converge as theory says, with every engine.
    for scene in ["transition-1.5", "contact-everywhere"] {
        let words = [
            "orders",
            scene,
            "--methods",
            "cr",
            "--n",
            "8,16",
            "--json",
            "-",
        ];
        let theory = run(folder.path(), &words).json()["orders"][0]["theory"].clone();
        for engine in ["rust", "freefem", "fenicsx"] {
            let of = |n: &str| -> [f64; 2] {
                let words = ["solve", scene, "--engine", engine, "--n", n, "--json", "-"];
                let error = &run(folder.path(), &words).json()["error"];
                ["h1", "l2"].map(|key| error[key].as_f64().unwrap())
            };
            let (coarse, fine) = (of("16"), of("32"));
            for (k, key) in ["h1", "l2"].iter().enumerate() {
                let order = (coarse[k] / fine[k]).log2();
                let expected = theory[key].as_f64().unwrap();
                assert!(order > expected - 0.1, "{engine} {scene} {key}: {order}");
            }
        }
    }
    for method in ["cr", "p1-vi", "cr-vi", "penalty", "multiplier"] {
        let ([h, _], [half, _]) = (error("rust", method, "16"), error("rust", method, "32"));
        assert!((h / half).log2() > 0.9, "{method} {h} {half}");
    }
}

#[test]
fn section_6_is_the_same_by_every_engine() {
    let folder = folder();
    let words = [
        "paper",
        "--engines",
        "freefem,fenicsx",
        "--n",
        "4,8",
        "--fine",
        "16",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for example in ran.json()["examples"].as_array().unwrap() {
        let series = example["series"].as_array().unwrap();
        let engines: Vec<_> = series
            .iter()
            .map(|s| s["engine"].as_str().unwrap())
            .collect();
        assert_eq!(engines, ["rust", "freefem", "fenicsx"]);
        for other in &series[1..] {
            for k in 0..2 {
                let (a, b) = (&series[0]["levels"][k], &other["levels"][k]);
                for key in ["errors", "errors_to_fine"] {
                    for norm in ["h1", "l2"] {
                        let (a, b) = (
                            a[key][norm].as_f64().unwrap(),
                            b[key][norm].as_f64().unwrap(),
                        );
                        assert!(
                            (a - b).abs() < 1e-10 * a,
                            "{} {key} {norm}: {a} {b}",
                            other["engine"]
                        );
                    }
                }
                assert!(b["steps"].as_u64().unwrap() <= 12);
            }
        }
    }
}

#[test]
fn what_only_the_rust_engine_has_is_refused_elsewhere() {
    let folder = folder();
    for words in [
        &["verify", "one-zone", "--methods", "cr,p1-vi"][..],
        &[
            "verify",
            "one-zone",
            "--methods",
            "penalty",
            "--engines",
            "rust,freefem",
        ],
        &[
            "solve",
            "one-zone",
            "--method",
            "multiplier",
            "--engine",
            "fenicsx",
        ],
    ] {
        let ran = run(folder.path(), words);
        assert_eq!(ran.code, Some(2), "{words:?}");
        assert!(ran.stderr.contains("is not of it"), "{}", ran.stderr);
    }
    let words = ["solve", "one-zone", "--method", "penalty", "--gamma0", "3"];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("penalty(0.01)"), "{}", ran.stderr);
    let ran = run(folder.path(), &["solve", "transition-15"]);
    assert!(ran.stderr.contains("transition-1.5"), "{}", ran.stderr);
    let ran = run(folder.path(), &["solve", "no-such-scene"]);
    assert!(ran.stderr.contains("`faceoff scenes`"), "{}", ran.stderr);
}

#[test]
fn any_engine_solves_and_says_the_same() {
    let folder = folder();
    let solve = |engine: &str| {
        let words = [
            "solve", "one-zone", "--engine", engine, "--n", "16", "--json", "-",
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{engine}: {}", ran.stderr);
        ran.json()
    };
    let rust = solve("rust");
    for key in [
        "scene",
        "method",
        "engine",
        "n",
        "faces",
        "cells",
        "dofs",
        "gamma0",
        "iterations",
        "grad_norm_sq",
        "l2_norm",
        "contact_flux",
        "contact_residual",
        "contact_set",
        "seconds",
        "peak_rss_mb",
    ] {
        assert!(!rust[key].is_null(), "{key}");
    }
    for key in ["mesh", "assembly", "factor", "iterate", "total"] {
        assert!(rust["seconds"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    for engine in ["freefem", "fenicsx"] {
        let other = solve(engine);
        for key in [
            "grad_norm_sq",
            "l2_norm",
            "contact_flux",
            "contact_residual",
        ] {
            let (a, b) = (rust[key].as_f64().unwrap(), other[key].as_f64().unwrap());
            assert!((a - b).abs() < 1e-12 * a.abs(), "{engine} {key}: {a} {b}");
        }
    }
}

#[test]
fn the_history_of_the_iteration_is_told() {
    let folder = folder();
    let solve = |words: &[&str]| {
        let all = [&["solve", "five-zones", "--n", "16", "--json", "-"], words].concat();
        run(folder.path(), &all)
    };
    let lengths = |told: &serde_json::Value| {
        ["increments", "active_set_changes", "residuals"]
            .map(|key| told[key].as_array().unwrap().len() as u64)
    };
    let ran = solve(&["--method", "cr-fc"]);
    let told = ran.json();
    let steps = told["iterations"].as_u64().unwrap();
    assert_eq!(lengths(&told), [steps; 3]);
    assert_eq!(told["ended"], "increment");
    assert_eq!(told["step"], steps);
    assert_eq!(
        told["active_set_changes"]
            .as_array()
            .unwrap()
            .last()
            .unwrap(),
        0
    );
    assert!(
        told["residuals"]
            .as_array()
            .unwrap()
            .last()
            .unwrap()
            .as_f64()
            .unwrap()
            < 1e-14
    );

    // Beyond binary64: at rounding, and no failure.
    let ran = solve(&["--tolerance", "1e-40"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(ran.json()["ended"], "rounding");

    // Not reached: code 1, and the best iterate is named.
    let ran = solve(&["--iteration", "lagged-p", "--max-iterations", "30"]);
    assert_eq!(ran.code, Some(1));
    let told = ran.json();
    assert_eq!(told["ended"], "not-reached");
    assert_eq!(told["converged"], false);
    let step = told["step"].as_u64().unwrap();
    assert!(
        step < 30,
        "the iteration diverges, and its best iterate is an early one"
    );
    assert!(
        ran.stderr
            .contains(&format!("best iterate by residual, that of step {step},")),
        "{}",
        ran.stderr
    );
    let ran = solve(&["--engine", "freefem", "--max-iterations", "1"]);
    assert_eq!(ran.code, Some(1));
    assert!(ran.stderr.contains("its last iterate"), "{}", ran.stderr);
}

#[test]
fn engines_are_found_by_running_them() {
    let folder = folder();
    let ran = run(folder.path(), &["engines", "--json", "-"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stdout);
    let engines = ran.json();
    for engine in engines["engines"].as_array().unwrap() {
        assert!(engine["version"].is_string(), "{engine}");
    }
}

#[test]
fn a_missing_engine_is_never_a_pass() {
    let folder = folder();
    let without = |words: &[&str]| {
        let mut command = faceoff(folder.path());
        let command = command.args(words).env("PATH", folder.path());
        told(command.output().unwrap())
    };
    let missing = without(&[
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
    ]);
    assert_eq!(missing.code, Some(2));
    assert!(
        missing.stderr.contains("apt-get install freefem++"),
        "{}",
        missing.stderr
    );
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--allow-missing",
    ];
    let alone = without(&words);
    assert_eq!(alone.code, Some(2), "one engine alone proves nothing");
    // What was not asked for may be missing.
    let other = without(&["engines", "install", "meshio"]);
    assert_eq!(other.code, Some(0), "{}", other.stderr);
    let listed = without(&["engines"]);
    assert_eq!(listed.code, Some(2));
    assert!(
        listed
            .stdout
            .contains("apt-get install -y --no-install-recommends freefem++"),
        "{}",
        listed.stdout
    );
}

#[test]
fn a_third_code_joins_by_a_file() {
    let folder = folder();
    // It answers with what the Rust engine found, so it agrees; and with one value off, it does not.
    let solver = r#"
import json, pathlib, struct, subprocess, sys
job = json.loads(pathlib.Path("job.json").read_text())
assert job["protocol"] == 1 and job["cases"][0]["data"]["f"] == "-2*pi*sin(2*pi*x)"
home = pathlib.Path(__file__).parent
for case in job["cases"]:
    values = (home / "dofs.f64").read_bytes()
    if (home / "spoil").exists():
        values = struct.pack("<d", 1 + struct.unpack("<d", values[:8])[0]) + values[8:]
    pathlib.Path("out", case["id"] + ".dofs.f64").write_bytes(values)
    print("progress", case["id"], 1, 0.0, flush=True)
entry = {"id": "case-0", "converged": True, "iterations": 1, "increments": [0.0],
         "rows": len(values) // 8, "dofs": "out/case-0.dofs.f64"}
part = pathlib.Path("out/part")
part.write_text(json.dumps({"protocol": 1, "version": "1", "cases": [entry]}))
part.rename("out/status.json")
"#;
    write(folder.path(), "solve.py", solver);
    write(
        folder.path(),
        "mine.toml",
        "name = \"mine\"\ncommand = [\"python3\", \"solve.py\"]\n",
    );
    // The dofs come from dolfinx's own answer, kept with --keep.
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,fenicsx",
        "--methods",
        "cr",
        "--n",
        "4",
    ];
    let ran = run(folder.path(), &[&words[..], &["--keep", "jobs"]].concat());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let kept = folder.path().join("jobs/fenicsx/out/case-0.dofs.f64");
    std::fs::copy(kept, folder.path().join("dofs.f64")).unwrap();

    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,mine.toml",
        "--methods",
        "cr",
        "--n",
        "4",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    write(folder.path(), "spoil", "");
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("from cell"), "{}", ran.stderr);
}
