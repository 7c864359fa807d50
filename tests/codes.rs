//! More codes by the open protocol, more processes by MPI, other versions, and long runs taken up again.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use crate::common::{Ran, changed_companion, faceoff, folder, run, scene, source, told, write};
use serde_json::Value;

fn verify(folder: &Path, words: &[&str]) -> Ran {
    run(folder, &[&["verify"], words].concat())
}

/// The largest difference of any field of any pair, relative to the field's own unit.
fn largest(outcome: &Value) -> f64 {
    let cases = outcome["cases"].as_array().unwrap().iter();
    let pairs = cases.flat_map(|case| case["pairs"].as_array().unwrap());
    pairs.fold(0.0, |m, pair| pair["max_rel"].as_f64().unwrap().max(m))
}

/// A companion in dolfinx with a line more, before it begins; as an engine file in `folder`.
fn before_it_begins(folder: &Path, line: &str) -> String {
    let first = "        check_ranks(comm)\n";
    changed_companion(
        folder,
        "fenicsx",
        first,
        &format!("{first}        {line}\n"),
    )
}

#[test]
fn two_ranks_agree_with_one_process() {
    let folder = folder();
    // The companion says how many there are: two that know nothing of each other would agree as well.
    let engine = before_it_begins(folder.path(), "assert comm.size == 2, comm.size");
    let engines = format!("rust,{engine}");
    let words = [
        "one-zone",
        "one-zone-3d",
        "--n",
        "4",
        "--engines",
        &engines,
        "--ranks",
        "2",
        "--json",
        "-",
    ];
    let ran = verify(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let outcome = ran.json();
    assert_eq!(
        outcome["cases"].as_array().unwrap().len(),
        2 * 2,
        "scenes, methods"
    );
    assert!(largest(&outcome) <= 1e-11, "{}", largest(&outcome));
}

#[test]
fn more_ranks_than_cores_and_other_launchers() {
    let folder = folder();
    let engine = before_it_begins(folder.path(), "assert comm.size == 3, comm.size");
    let engines = format!("rust,{engine}");
    let of = ["--n", "4", "--engines", &engines];
    for how in [
        ["one-zone", "--methods", "cr,cr-fc", "--ranks", "3"],
        ["one-zone", "--methods", "cr", "--launcher", "mpirun -n 3"],
    ] {
        let ran = verify(folder.path(), &[&how[..], &of].concat());
        assert_eq!(ran.code, Some(0), "{how:?}: {}{}", ran.stdout, ran.stderr);
    }
    // A launcher of another MPI starts processes that are each alone.
    let words = ["one-zone", "--engines", "rust,fenicsx", "--launcher", "env"];
    let ran = verify(folder.path(), &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(
        ran.stderr
            .contains("started as several processes, but MPI counts 1"),
        "{}",
        ran.stderr
    );
    // Nobody is distributed.
    let ran = verify(
        folder.path(),
        &["one-zone", "--engines", "rust,freefem", "--ranks", "2"],
    );
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr
            .contains("no engine here runs as several processes"),
        "{}",
        ran.stderr
    );
}

#[test]
fn an_iterative_solver_takes_the_place_of_the_factorisation() {
    let folder = folder();
    let mut command = faceoff(folder.path());
    command
        .args([
            "verify",
            "one-zone-3d",
            "--n",
            "4",
            "--engines",
            "rust,fenicsx",
            "--ranks",
            "2",
        ])
        .args(["--methods", "cr", "--json", "-"])
        .env(
            "PETSC_OPTIONS",
            "-ksp_type gmres -ksp_rtol 1e-14 -pc_type hypre",
        );
    let ran = told(command.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let told = largest(&ran.json());
    assert!(told > 0.0 && told <= 1e-12, "{told}");
}

#[test]
fn a_crash_on_one_rank_ends_all_and_is_told() {
    let folder = folder();
    for (line, said) in [
        (
            "if comm.rank == 1: raise ValueError('the second one stumbles')",
            &["on rank 1 of 2: ValueError: the second one stumbles"][..],
        ),
        (
            "import os, signal; comm.rank == 1 and os.kill(os.getpid(), signal.SIGKILL)",
            &["rank 1", "signal 9"],
        ),
    ] {
        let engine = before_it_begins(folder.path(), line);
        let engines = format!("rust,{engine}");
        let words = [
            "one-zone",
            "--methods",
            "cr",
            "--engines",
            &engines,
            "--ranks",
            "2",
        ];
        let ran = verify(folder.path(), &words);
        assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
        for part in said {
            assert!(ran.stderr.contains(part), "`{part}` in: {}", ran.stderr);
        }
        assert!(!ran.stderr.contains("did not end within"), "{}", ran.stderr);
    }
}

/// The findings of `engines check` that are not right.
fn wrong(folder: &Path, engine: &str, code: i32) -> Vec<Value> {
    let (count, wrong) = wrong_about(folder, engine, "", code);
    assert!(count > 30, "{count}");
    wrong
}

/// How many findings there are about something, and those that are not "agree".
fn wrong_about(folder: &Path, engine: &str, about: &str, code: i32) -> (usize, Vec<Value>) {
    let mut words = vec!["engines", "check", engine, "--json", "-"];
    if !about.is_empty() {
        words.extend(["--about", about]);
    }
    let ran = run(folder, &words);
    assert_eq!(
        ran.code,
        Some(code),
        "{engine}: {}{}",
        ran.stdout,
        ran.stderr
    );
    let findings = ran.json();
    let findings = findings["findings"].as_array().unwrap();
    let wrong = findings.iter().filter(|f| f["verdict"] != "agree");
    (findings.len(), wrong.cloned().collect())
}

#[test]
fn codes_that_do_what_they_must_are_right_in_everything() {
    let folder = folder();
    for engine in ["freefem", "fenicsx"] {
        let wrong = wrong(folder.path(), engine, 0);
        assert!(wrong.is_empty(), "{engine}: {wrong:#?}");
    }
    let ran = run(
        folder.path(),
        &["engines", "check", "freefem", "--about", "Γ_X"],
    );
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("no check is about `Γ_X`") && ran.stderr.contains("t on Γ_N"),
        "{}",
        ran.stderr
    );
    let ran = run(folder.path(), &["engines", "check", "none.toml"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("none.toml: cannot read"),
        "{}",
        ran.stderr
    );
}

#[test]
fn what_a_code_gets_wrong_is_named() {
    for (from, to, about, why) in [
        (
            "(f*v)",
            "(-f*v)",
            "f that needs its rule",
            "f has the other sign",
        ),
        ("(t*v)", "(0.*t*v)", "t on Γ_N", "t is 0"),
        (
            "gamma[][Ch(cell, 0)] = value;",
            "gamma[][Ch(cell, 0)] = 2*value;",
            "contact in part",
            "γ₀ = 200",
        ),
        (
            "gamma[][Ch(cell, 0)] = value;",
            "gamma[][Ch(cell, 0)] = value*(1 + 1e-6);",
            "an unstructured mesh with all data",
            "γ is × 1.00000100",
        ),
        (
            "macro contactTest(v) (theta1*dn(v)",
            "macro contactTest(v) (-theta1*dn(v)",
            "contact in part",
            "it solves p2(-1,1), not p2",
        ),
        (
            "coefficients[Wh(k, protocolOrder(i))]",
            "coefficients[Wh(k, protocolOrder((i + 1) % Wh.ndofK))]",
            "which dof is where",
            "in a different order: positions 0, 1, … hold those of [1, 2, 0]",
        ),
        (
            "sigma1[][Fh(k, i)] = loads[Wh(k, i)] /",
            "sigma1[][Fh(k, i)] = 0.*loads[Wh(k, i)] /",
            "the flux corrected",
            "it solves cr, not cr-fc",
        ),
    ] {
        let folder = folder();
        let engine = changed_companion(folder.path(), "freefem", from, to);
        let (_, wrong) = wrong_about(folder.path(), &engine, about, 1);
        let told = |finding: &Value| {
            let has =
                |key: &str, part: &str| finding[key].as_str().is_some_and(|s| s.contains(part));
            finding["verdict"] == "disagree" && has("about", about) && has("why", why)
        };
        assert!(wrong.iter().any(told), "{to}: {wrong:#?}");
    }
}

#[test]
fn a_code_that_leaves_something_out_is_told_what() {
    let folder = folder();
    // Zeros for plane cases, without the increments for those on unstructured meshes; a crash in 3D.
    let solver = r#"
import json, os, pathlib, struct
job = json.loads(pathlib.Path("job.json").read_text())
cases = []
for k, case in enumerate(job["cases"]):
    if case["dimension"] == 3:
        raise SystemExit("error there is no space here")
    cells = os.path.getsize(case["mesh"]["cells"]) // 24
    rows = cells * {"CR": 3, "P1": 3, "P2": 6}[case["element"]]
    dofs = f"out/case-{k}.dofs.f64"
    pathlib.Path(dofs).write_bytes(bytes(8 * rows))
    cases.append({"id": case["id"], "converged": True, "iterations": 0, "rows": rows, "dofs": dofs})
    if case["scene"] != "plate":
        cases[-1]["increments"] = []
pathlib.Path("out/status.json").write_text(json.dumps({"protocol": 1, "version": "1", "cases": cases}))
"#;
    write(folder.path(), "solve.py", solver);
    write(
        folder.path(),
        "mine.toml",
        "name = \"mine\"\ncommand = [\"python3\", \"solve.py\"]\n",
    );
    let wrong = wrong(folder.path(), "mine.toml", 1);
    let why = |about: &str| {
        let mut found = wrong
            .iter()
            .filter(|f| f["about"].as_str().unwrap().contains(about));
        found.next().unwrap()["why"].as_str().unwrap().to_owned()
    };
    for (about, part) in [
        ("unstructured", "missing field `increments`"),
        ("3D", "there is no space here"),
        ("a protocol", "another protocol"),
        ("several", "no case is right by itself"),
    ] {
        assert!(why(about).contains(part), "{}", why(about));
    }
}

#[test]
fn a_code_that_does_not_run_is_said_once() {
    let folder = folder();
    let engine = "name = \"mine\"\ncommand = [\"python3\", \"sovle.py\"]\n";
    write(folder.path(), "mine.toml", engine);
    let ran = run(folder.path(), &["engines", "check", "mine.toml", "--quiet"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let said = "mine: it answers nothing";
    assert_eq!(ran.stderr.matches(said).count(), 1, "{}", ran.stderr);
    assert!(ran.stderr.contains("sovle.py"), "{}", ran.stderr);
}

/// The engine files of the repository's further codes, whose Python must be there.
fn further_codes() -> [String; 3] {
    let python = source("target/python/bin/python3");
    assert!(
        python.is_file(),
        "no {}: use tests/run, or see tests/engines/README.md",
        python.display()
    );
    ["skfem", "ngsolve", "getfem"].map(|name| {
        source(&format!("tests/engines/{name}.toml"))
            .to_string_lossy()
            .into_owned()
    })
}

#[test]
fn six_codes_agree_in_all_pairs() {
    let folder = folder();
    let [skfem, ngsolve, getfem] = further_codes();
    let engines = format!("rust,freefem,fenicsx,{skfem},{ngsolve},{getfem}");
    let words = [
        "one-zone",
        "--n",
        "16,32",
        "--methods",
        "cr,cr-fc,p2",
        "--engines",
        &engines,
        "--json",
        "-",
    ];
    let ran = verify(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    for case in ran.json()["cases"].as_array().unwrap() {
        assert_eq!(case["engines"].as_array().unwrap().len(), 6);
        let pairs = case["pairs"].as_array().unwrap();
        let fields = if case["method"] == "p2" { 5 } else { 4 };
        assert!(
            pairs.len() >= 15 * (fields - 1),
            "{} of {}",
            pairs.len(),
            case["method"]
        );
        let limit = if case["method"] == "p2" { 1e-11 } else { 1e-12 };
        for pair in pairs {
            assert!(pair["max_rel"].as_f64().unwrap() <= limit, "{pair}");
        }
    }
}

#[test]
fn further_codes_are_right_in_everything() {
    let folder = folder();
    for engine in further_codes() {
        let wrong = wrong(folder.path(), &engine, 0);
        assert!(wrong.is_empty(), "{engine}: {wrong:#?}");
    }
}

/// A program of this name in `folder`/bin.
fn program(folder: &Path, name: &str, script: &str) {
    let path = write(folder, &format!("bin/{name}"), script);
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn releases_that_are_too_old_are_refused_and_unknown_ones_doubted() {
    let folder = folder();
    let engines = |version: &str| {
        program(
            folder.path(),
            "FreeFem++-nw",
            &format!("#!/bin/sh\necho version {version}\n"),
        );
        let path = std::env::var("PATH").unwrap();
        let mut command = faceoff(folder.path());
        command.args(["engines", "--json", "-"]).env(
            "PATH",
            format!("{}:{path}", folder.path().join("bin").display()),
        );
        told(command.output().unwrap()).json()["engines"][1].clone()
    };
    let old = engines("3.610000");
    assert!(
        old["problem"]
            .as_str()
            .unwrap()
            .contains("FreeFEM 3.610000 is too old"),
        "{old}"
    );
    let new = engines("5.1");
    assert_eq!(new["version"], "5.1");
    assert!(
        new["doubt"]
            .as_str()
            .unwrap()
            .contains("not one of the releases"),
        "{new}"
    );
    assert!(engines("4.15")["doubt"].is_null());
    // dolfinx tells its own when the companion runs, before anything is missed.
    for (release, code, said) in [
        (
            "0.4.1",
            2,
            "dolfinx 0.4.1 is too old: the companion needs 0.5",
        ),
        ("0.12.0.dev0", 0, ""),
    ] {
        let version = format!("VERSION = \"{release}\"");
        let engine = changed_companion(
            folder.path(),
            "fenicsx",
            "VERSION = dolfinx.__version__",
            &version,
        );
        let engines = format!("rust,{engine}");
        let words = [
            "one-zone",
            "--n",
            "4",
            "--methods",
            "cr",
            "--engines",
            &engines,
            "--json",
            "-",
        ];
        let ran = verify(folder.path(), &words);
        assert_eq!(ran.code, Some(code), "{}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
        if code == 0 {
            assert_eq!(ran.json()["cases"][0]["engines"][1]["version"], release);
        }
    }
}

#[test]
fn a_long_run_is_taken_up_where_it_stopped() {
    let folder = folder();
    // A code that fails from the third case on, until it is mended.
    let engine = changed_companion(
        folder.path(),
        "freefem",
        "if (cases < 1) fail(",
        "{ ifstream stop(\"HERE/broken\"); int k = 0; stop >> k; if (k == 1 && caseElement[0] == \"P2\") exit(3); } if (cases < 1) fail(",
    );
    let script = folder.path().join("copy/signorini.edp");
    let text = fs::read_to_string(&script).unwrap();
    let here = folder.path().to_string_lossy().into_owned();
    fs::write(&script, text.replace("HERE", &here)).unwrap();
    write(folder.path(), "broken", "1\n");

    let engines = format!("rust,{engine}");
    let words = [
        "one-zone",
        "--n",
        "4,8",
        "--engines",
        &engines,
        "--resume",
        "kept",
    ];
    let ran = verify(folder.path(), &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let journal = folder.path().join("kept/journal.jsonl");
    let kept = || {
        let text = fs::read_to_string(&journal).unwrap();
        let keys = text.lines().skip(1).map(|line| {
            let entry: Value = serde_json::from_str(line).unwrap();
            ["by", "at"].map(|key| entry[key].as_str().unwrap().to_owned())
        });
        let own = keys.filter(|[by, _]| by == "changed").map(|[_, at]| at);
        own.collect::<std::collections::BTreeSet<_>>()
    };
    let first = "one-zone, cr, n = 4";
    assert_eq!(kept().into_iter().collect::<Vec<_>>(), [first]);

    // What was kept is taken: otherwise this nonsense, with a digest that fits, would not be seen.
    write(folder.path(), "broken", "0\n");
    let before = fs::read_to_string(&journal).unwrap();
    let change = |from: &str, to: &str| {
        let is_first = |line: &str| line.contains(first) && line.contains("\"changed\"");
        let lines = before.lines().map(|line| match is_first(line) {
            true => line.replace(from, to) + "\n",
            false => line.to_owned() + "\n",
        });
        fs::write(&journal, lines.collect::<String>()).unwrap();
    };
    change("\"converged\":true", "\"converged\":false");
    let ran = verify(folder.path(), &[&words[..], &["--json", "-"]].concat());
    // It solves the scheme, and says that it does not.
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert_eq!(ran.json()["cases"][0]["engines"][1]["converged"], false);
    assert_eq!(kept().len(), 4);
    fs::write(&journal, &before).unwrap();
    assert_eq!(verify(folder.path(), &words).code, Some(0));

    // All is there: nothing is run, and the verdict is the same as of a run at once.
    write(folder.path(), "broken", "1\n");
    let resumed = verify(folder.path(), &[&words[..], &["--json", "-"]].concat());
    assert_eq!(resumed.code, Some(0), "{}", resumed.stderr);
    write(folder.path(), "broken", "0\n");
    let at_once = verify(folder.path(), &[&words[..5], &["--json", "-"]].concat());
    let values = |ran: &Ran| {
        let cases = ran.json()["cases"].as_array().unwrap().clone();
        let pairs = cases
            .iter()
            .flat_map(|case| case["pairs"].as_array().unwrap().clone());
        pairs
            .map(|pair| pair["max_abs"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(values(&resumed), values(&at_once));

    // Never with other settings, another program, or another scene of the same name.
    let refused = |words: &[&str], said: &str| {
        let ran = verify(folder.path(), words);
        assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(said), "`{said}` in: {}", ran.stderr);
    };
    refused(
        &[&words[..], &["--tolerance", "1e-9"]].concat(),
        "increment was 1e-12 and is 1e-9",
    );
    refused(
        &[&words[..], &["--max-iterations", "7"]].concat(),
        "max_iterations was 50 and is 7",
    );
    let other = scene(folder.path(), "one-zone", "sin(2*pi*x)", "sin(3*pi*x)");
    let of_other = [&[other.as_str()], &words[1..]].concat();
    refused(
        &of_other,
        "f was \"-2*pi*sin(2*pi*x)\" and is \"-2*pi*sin(3*pi*x)\"",
    );
    fs::write(&script, text.replace("HERE", &here) + "// changed\n").unwrap();
    refused(&words, "companion was");
    fs::write(&script, text.replace("HERE", &here)).unwrap();

    // Damaged dofs are computed again.
    let before = fs::read_to_string(&journal).unwrap();
    let at = before.find("\"dofs\":\"").unwrap() + 8;
    for damage in ["", "AAAAAAAA"] {
        let damaged = format!("{}{damage}{}", &before[..at], &before[at + 8..]);
        fs::write(&journal, damaged).unwrap();
        let ran = verify(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let lines = fs::read_to_string(&journal).unwrap().lines().count();
        assert_eq!(lines, before.lines().count() + 1);
    }
}
