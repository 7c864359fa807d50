//! What bad input gets: exit code 2, one sentence with the place and the remedy, nothing left.

use std::fs;
use std::path::Path;

use crate::common::{
    changed_companion, companion_with, faceoff, folder, interrupt, run, scene, source, told, until,
    write,
};

/// Runs `words`, which must fail with code 2 and one line that has all of `parts`.
fn refused(folder: &Path, words: &[&str], parts: &[&str]) {
    let before = entries(folder);
    let ran = run(folder, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}{}", ran.stdout, ran.stderr);
    assert_eq!(ran.stderr.trim_end().lines().count(), 1, "{}", ran.stderr);
    for part in parts {
        assert!(ran.stderr.contains(part), "`{part}` in: {}", ran.stderr);
    }
    assert_eq!(entries(folder), before, "{words:?} left something");
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// `| head`: the verdict is the exit code, whoever reads on. Output that is wanted and lost is told.
#[test]
fn readers_that_are_gone_and_disks_that_are_full() {
    let folder = folder();
    let words = ["solve", "one-zone", "--n", "8", "--method", "cr"];
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let gone = told(
        faceoff(folder.path())
            .args(words)
            .stdout(writer)
            .output()
            .unwrap(),
    );
    assert_eq!((gone.code, &*gone.stderr), (Some(0), ""));

    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let full = told(
        faceoff(folder.path())
            .args(words)
            .stdout(full)
            .output()
            .unwrap(),
    );
    assert_eq!(full.code, Some(2));
    assert!(
        full.stderr
            .contains("standard output: cannot write: No space left"),
        "{}",
        full.stderr
    );
}

#[test]
fn scenes_that_are_not_valid() {
    for (from, to, parts) in [
        ("name =", "nam =", ["line 2", "unknown field `nam`"]),
        (
            "\"top\"",
            "\"lid\"",
            ["boundary.dirichlet", "no boundary group \"lid\""],
        ),
        (
            "[\"left\", \"right\"]",
            "[\"left\"]",
            ["is in no part", "neumann"],
        ),
        (
            "[\"left\", \"right\"]",
            "[\"left\", \"right\", 1]",
            ["is in two parts", "exactly one"],
        ),
        (
            "[\"bottom\"]",
            "[17]",
            ["no boundary group 17", "\"bottom\" (1)"],
        ),
        (
            "[data]",
            "[method]\ngamma0 = -3\n[data]",
            ["method.gamma0", "-3 is not positive"],
        ),
        (
            "-2*pi*sin(2*pi*x)",
            "sin(2*pi*x",
            ["data.f, character 11", "`)` is needed"],
        ),
        (
            "-2*pi*sin(2*pi*x)",
            "rand(x)",
            ["data.f, character 1", "`rand` is not known"],
        ),
        (
            "-2*pi*sin(2*pi*x)",
            "1/(x - x)",
            ["f = `1/(x - x)` is inf at", "finite"],
        ),
        ("n = 16", "n = 0", ["mesh.n", "at least 1"]),
        (
            "union-jack",
            "cross",
            ["mesh.generator", "`cross` is not known"],
        ),
        (
            "dirichlet = [\"top\"]\nneumann = [\"left\", \"right\"]\n",
            "neumann = [\"left\", \"right\", \"top\"]\n",
            ["boundary.dirichlet", "does not press it"],
        ),
    ] {
        let folder = folder();
        let file = scene(folder.path(), "one-zone", from, to);
        for command in ["verify", "solve"] {
            refused(folder.path(), &[command, &file], &parts);
        }
    }
}

#[test]
fn an_expression_runs_nothing_in_any_engine() {
    let folder = folder();
    for attack in [
        "1); exec(\\\"touch x\\\")",
        "exec(\\\"touch x\\\")",
        "__import__('os').system('touch x')",
        "x.__class__",
        "1; touch x",
    ] {
        let file = scene(folder.path(), "one-zone", "-2*pi*sin(2*pi*x)", attack);
        refused(folder.path(), &["verify", &file], &["data.f, character"]);
    }
    assert!(!folder.path().join("x").exists());
}

#[test]
fn scenes_and_engines_that_are_not_there() {
    let folder = folder();
    refused(
        folder.path(),
        &["verify", "no-zone"],
        &["no scene `no-zone`", "one-zone"],
    );
    refused(
        folder.path(),
        &["verify", "no.toml"],
        &["no.toml: cannot read"],
    );
    refused(
        folder.path(),
        &["verify", "--engines", "rust,abaqus"],
        &["no engine `abaqus`"],
    );
    refused(
        folder.path(),
        &["verify", "--engines", "rust,rust"],
        &["`rust` is named twice"],
    );
    refused(
        folder.path(),
        &["verify", "--engines", "rust"],
        &["one engine alone"],
    );
    refused(
        folder.path(),
        &["verify", "one-zone", "one-zone"],
        &["named twice"],
    );
    refused(
        folder.path(),
        &["verify", "plate", "--n", "17"],
        &["n = 17", "16, 32"],
    );
    refused(
        folder.path(),
        &["solve", "one-zone", "--gamma0", "-1"],
        &["not positive"],
    );
    refused(
        folder.path(),
        &["solve", "one-zone", "--mesh", "none.msh"],
        &["none.msh: cannot read"],
    );
    for words in [
        &["verify", "--n", "0"][..],
        &["verify", "--methods", "p7"],
        &["solve", "one-zone", "--iteration", "picard"],
        &["solve", "one-zone", "--tolerance", "-1"],
        &["solv"],
    ] {
        assert_eq!(run(folder.path(), words).code, Some(2), "{words:?}");
    }
}

#[test]
fn output_that_cannot_be_written() {
    let folder = folder();
    let words = ["solve", "one-zone", "--n", "4", "--json", "none/out.json"];
    refused(folder.path(), &words, &["none/out.json: cannot write"]);
    let words = ["solve", "one-zone", "--n", "4", "--out", "none/out.vtu"];
    refused(folder.path(), &words, &["none"]);
    let words = ["solve", "one-zone", "--n", "4", "--out", "out.stl"];
    refused(folder.path(), &words, &["out.stl", ".vtu"]);
    write(folder.path(), "report", "a file");
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--report",
        "report",
    ];
    refused(folder.path(), &words, &["report"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("report")).unwrap(),
        "a file"
    );
}

#[test]
fn a_folder_that_is_no_job_is_not_replaced() {
    let folder = folder();
    write(folder.path(), "freefem/mine.edp", "my work");
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--keep",
        ".",
        "--quiet",
    ];
    refused(
        folder.path(),
        &words,
        &["freefem", "not a job folder", "--keep"],
    );
    assert!(folder.path().join("freefem/mine.edp").exists());
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--keep",
        "jobs",
    ];
    for _ in 0..2 {
        assert_eq!(run(folder.path(), &words).code, Some(0));
    }
    assert!(folder.path().join("jobs/freefem/job.idp").exists());
}

/// The plate's mesh with one change to its text.
fn mesh_refused(from: &str, to: &str, parts: &[&str]) {
    let folder = folder();
    let file = scene(
        folder.path(),
        "plate",
        "name = \"plate\"",
        "name = \"plate\"",
    );
    let text = fs::read_to_string(source("meshes/plate.msh")).unwrap();
    assert!(text.contains(from), "{from}");
    write(folder.path(), "plate.msh", &text.replacen(from, to, 1));
    refused(folder.path(), &["solve", &file], parts);
}

#[test]
fn meshes_that_cannot_carry_the_problem() {
    let text = fs::read_to_string(source("meshes/plate.msh")).unwrap();
    // The last triangle: `tag a b c`.
    let last = text
        .lines()
        .rev()
        .find(|line| line.split(' ').count() == 5 || line.trim_end().split(' ').count() == 4)
        .unwrap()
        .trim_end();
    let words: Vec<&str> = last.split(' ').collect();
    let with = |nodes: [&str; 3]| format!("{} {} {} {}", words[0], nodes[0], nodes[1], nodes[2]);
    let [a, b, c] = [words[1], words[2], words[3]];
    mesh_refused(last, &with([a, b, b]), &["plate.msh"]);
    mesh_refused(last, &with([a, b, "999999"]), &["plate.msh", "999999"]);
    mesh_refused("$EndElements", "", &["plate.msh"]);
    mesh_refused("\"base\"", "\"bottom\"", &["no boundary group \"base\""]);
    // Another cell's vertex: overlapping or inverted cells.
    let other = (1..50)
        .map(|k| k.to_string())
        .find(|k| ![a, b, c].contains(&k.as_str()))
        .unwrap();
    mesh_refused(last, &with([a, b, &other]), &["plate.msh"]);
    let folder = folder();
    write(folder.path(), "mesh.msh", "not a mesh");
    refused(
        folder.path(),
        &["solve", "plate", "--mesh", "mesh.msh"],
        &["mesh.msh"],
    );
}

/// A FreeFEM companion with one change must fail as an engine, not as a disagreement.
fn engine_refused(from: &str, to: &str, parts: &[&str]) {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", from, to);
    let engines = format!("rust,{engine}");
    let words = [
        "verify",
        "one-zone",
        "--engines",
        &engines,
        "--n",
        "4",
        "--quiet",
    ];
    refused(folder.path(), &words, parts);
    let ran = run(folder.path(), &[&words[..6], &["--json", "-"]].concat());
    assert_eq!(ran.json()["verdict"], "undetermined");
}

#[test]
fn engines_whose_answer_does_not_count() {
    let rows = "      dofs << k << \" \" << i << \" \" << coefficients[Wh(k, protocolOrder(i))] << \"\\n\";";
    engine_refused(
        "if (cases < 1) fail(",
        "exit(7); if (cases < 1) fail(",
        &["engine changed", "7"],
    );
    engine_refused(
        rows,
        "      if (k > 0) dofs << k << \" \" << i << \" \" << coefficients[Wh(k, protocolOrder(i))] << \"\\n\";",
        &["3 of 96 rows are missing", "case-0"],
    );
    engine_refused(
        "rows = Th.nt*Wh.ndofK;",
        "rows = Th.nt*Wh.ndofK - 1;",
        &["95 values", "there are 96"],
    );
    engine_refused(
        "rows = Th.nt*Wh.ndofK;",
        "rows = Th.nt*Wh.ndofK; coefficients[Wh(2, 1)] = sqrt(-1.);",
        &["case-0 (one-zone, cr, n = 4)", "(vertices [", "is NaN"],
    );
    engine_refused(
        "rows = Th.nt*Wh.ndofK;",
        "rows = Th.nt*Wh.ndofK; coefficients[Wh(2, 1)] = 1/tiny;",
        &["engine changed"],
    );
    engine_refused(
        "if (exec(\"mv out/status.json.part out/status.json\") != 0)",
        "if (0 != 0)",
        &["without writing out/status.json"],
    );
    engine_refused(
        "real eps = 1e-14;",
        "real eps = 1e-14; nonsense",
        &["engine changed", "failed"],
    );
}

#[test]
fn an_engine_that_never_ends_is_killed_with_its_children() {
    let folder = folder();
    let engine = changed_companion(
        folder.path(),
        "freefem",
        "if (cases < 1) fail(",
        &format!("exec(\"{}\"); if (cases < 1) fail(", asleep(987)),
    );
    let engines = format!("rust,{engine}");
    refused(
        folder.path(),
        &[
            "verify",
            "one-zone",
            "--engines",
            &engines,
            "--n",
            "4",
            "--time-limit",
            "1",
            "--quiet",
        ],
        &["did not end within", "--time-limit"],
    );
    until(|| !is_running(&asleep(987)), "its children are gone");
}

/// As UMFPACK's wrapper in FreeFEM does where memory is short: it tells the log, and goes on without a step.
#[test]
fn a_code_that_calls_nothing_convergence_has_not_solved() {
    let folder = folder();
    let changes = [
        ("step = J^-1*R;", "step = 0;"),
        (
            "converged = (isSmall && error <= enough) || (isRounding && wasRounding);",
            "converged = isSmall;",
        ),
    ];
    let engine = companion_with(folder.path(), "freefem", &changes);
    let words = [
        "solve", "one-zone", "--n", "4", "--method", "p2", "--engine", &engine, "--quiet",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stderr.contains("a backward error of 1.0e0"),
        "{}",
        ran.stderr
    );
}

#[test]
fn an_interruption_ends_everything() {
    let folder = folder();
    let engine = changed_companion(
        folder.path(),
        "freefem",
        "if (cases < 1) fail(",
        &format!("exec(\"{}\"); if (cases < 1) fail(", asleep(1654)),
    );
    let engines = format!("rust,{engine}");
    let mut command = faceoff(folder.path());
    command
        .args([
            "verify",
            "one-zone",
            "--engines",
            &engines,
            "--n",
            "4",
            "--json",
            "out.json",
        ])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped());
    let child = command.spawn().unwrap();
    until(|| is_running(&asleep(1654)), "the engine runs");
    interrupt(&child);
    let ran = told(child.wait_with_output().unwrap());
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("interrupted"), "{}", ran.stderr);
    until(|| !is_running(&asleep(1654)), "the engine is gone");
    let json = fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert!(json.contains("interrupted"), "{json}");
}

/// Nobody can catch SIGKILL, and still no engine goes on alone.
#[test]
fn a_killed_run_takes_its_engines_along() {
    let folder = folder();
    let engine = changed_companion(
        folder.path(),
        "freefem",
        "if (cases < 1) fail(",
        &format!("exec(\"{}\"); if (cases < 1) fail(", asleep(1321)),
    );
    let engines = format!("rust,{engine}");
    let words = [
        "verify",
        "one-zone",
        "--engines",
        &engines,
        "--n",
        "4",
        "--keep",
        "jobs",
    ];
    let mut child = faceoff(folder.path())
        .args(words)
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    until(|| is_running(&asleep(1321)), "the engine runs");
    child.kill().unwrap();
    child.wait().unwrap();
    until(|| !is_running(&asleep(1321)), "the engine is gone");
    let log = fs::read_to_string(folder.path().join("jobs/changed/log.txt")).unwrap();
    assert!(log.contains("faceoff itself was ended"), "{log}");
    // The folder is a job folder, and free for the next run.
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--keep",
        "jobs",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

#[test]
fn a_killed_engine_and_a_folder_in_use_are_told() {
    engine_refused(
        "if (cases < 1) fail(",
        "exec(\"kill -9 $PPID; sleep 5\"); if (cases < 1) fail(",
        &[
            "engine changed",
            "was killed from outside",
            "not enough memory",
        ],
    );
    let folder = folder();
    fs::create_dir_all(folder.path().join("jobs/freefem")).unwrap();
    let lock = fs::File::open(folder.path().join("jobs/freefem")).unwrap();
    lock.lock().unwrap();
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,freefem",
        "--n",
        "4",
        "--quiet",
        "--keep",
        "jobs",
    ];
    refused(
        folder.path(),
        &words,
        &["jobs/freefem is in use by another run", "--keep"],
    );
    drop(lock);
    write(folder.path(), "jobs/freefem/thesis.tex", "");
    refused(
        folder.path(),
        &words,
        &["jobs/freefem exists but is not a job folder"],
    );
    assert!(folder.path().join("jobs/freefem/thesis.tex").exists());
}

/// A pause that no other run of the tests on this machine has, told by its fraction.
fn asleep(seconds: u32) -> String {
    format!("sleep {seconds}.{}", std::process::id())
}

/// Is there a process with exactly this command line? (Its shell has a longer one.)
pub fn is_running(line: &str) -> bool {
    fs::read_dir("/proc")
        .unwrap()
        .flatten()
        .filter_map(|e| fs::read(e.path().join("cmdline")).ok())
        .any(|bytes| {
            let words: Vec<_> = bytes
                .split(|b| *b == 0)
                .filter(|w| !w.is_empty())
                .map(String::from_utf8_lossy)
                .collect();
            words.join(" ") == line
        })
}
