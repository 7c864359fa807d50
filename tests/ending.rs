//! However a run ends, its exit code is 0, 1 or 2, and no earlier verdict stands for this one's.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::common::{Ran, faceoff, folder, interrupt, run, scene, told, until, write};

/// The results that every judging command writes.
const OUTPUTS: [&str; 8] = [
    "--json", "out.json", "--junit", "out.xml", "--badge", "out.svg", "--report", "page",
];

fn with_outputs(folder: &Path, words: &[&str]) -> Command {
    let mut command = faceoff(folder);
    command.args(words).args(OUTPUTS);
    command
}

/// Whether no output speaks of agreement, and each says `said`.
fn assert_no_verdict(folder: &Path, said: &str) {
    for file in ["out.json", "out.xml", "page/index.html", "out.svg"] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        assert!(
            !text.contains(">agree<") && !text.contains("\"agree\""),
            "{file}: {text}"
        );
        let words = if file == "out.svg" {
            "undetermined"
        } else {
            said
        };
        assert!(text.contains(words), "`{words}` in {file}: {text}");
    }
}

fn agreed(folder: &Path) -> Ran {
    let words = ["compare", "a.csv", "b.csv", "--allow-identical"];
    for name in ["a.csv", "b.csv"] {
        write(folder, name, "vertex,u\n0,1\n1,2\n");
    }
    let ran = told(with_outputs(folder, &words).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    ran
}

#[test]
fn a_run_that_is_refused_or_ended_leaves_no_earlier_verdict() {
    let folder = folder();
    let path = folder.path();
    agreed(path);
    let refused = with_outputs(path, &["verify", "nosuch"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert_no_verdict(path, "there is no scene `nosuch`");

    agreed(path);
    let words = [
        "verify",
        "one-zone",
        "--engines",
        "rust,fenicsx",
        "--n",
        "256",
        "--time-limit",
        "0.01",
    ];
    let ended = told(with_outputs(path, &words).output().unwrap());
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert_no_verdict(path, "--time-limit");
}

/// Nothing can be written any more by a process that is killed: what it would replace is marked before it begins.
#[test]
fn a_run_that_is_killed_leaves_no_earlier_verdict() {
    let folder = folder();
    let path = folder.path();
    agreed(path);
    let mut child = with_outputs(
        path,
        &[
            "verify",
            "one-zone",
            "--engines",
            "rust,freefem",
            "--n",
            "512",
        ],
    )
    .stdout(Stdio::null())
    .spawn()
    .unwrap();
    // The last one that is written.
    let is_marked = || {
        let json = fs::read_to_string(path.join("out.json"));
        json.is_ok_and(|json| json.contains("it has not ended"))
    };
    until(is_marked, "the earlier results are marked");
    child.kill().unwrap();
    child.wait().unwrap();
    assert_no_verdict(path, "it has not ended");
}

#[test]
fn a_file_that_is_no_result_of_ours_is_left_until_there_is_one() {
    let folder = folder();
    let mine = write(folder.path(), "mine.json", "{\"schema\": \"mine\"}");
    let mut child = faceoff(folder.path())
        .args(["solve", "one-zone", "--n", "900", "--json", "mine.json"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    interrupt(&child);
    assert_eq!(ended(&mut child), Some(2));
    assert!(fs::read_to_string(mine).unwrap().contains("interrupted"));
}

fn ended(child: &mut Child) -> Option<i32> {
    child.wait().unwrap().code()
}

/// Each would take minutes: a mesh that is made, checked, compared, solved on, certified.
#[test]
fn a_signal_and_a_time_limit_end_every_command() {
    let folder = folder();
    let path = folder.path();
    let waves = scene(
        path,
        "one-zone",
        "f = \"-2*pi*sin(2*pi*x)\"",
        "f = \"-2*pi*sin(2*pi*x*60)*cos(2*pi*y*60)-0.1\"",
    );
    let made = run(path, &["mesh", "make", "one-zone", "m.msh", "--n", "300"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    let commands: [&[&str]; 8] = [
        &["solve", "one-zone", "--n", "1500"],
        &["solve", &waves, "--n", "128", "--certify"],
        &[
            "verify",
            "one-zone",
            "--n",
            "700",
            "--engines",
            "rust,freefem",
        ],
        &["orders", "one-zone", "--n", "16,32,1024"],
        &["stress", "transition-1.5"],
        &["study", "one-zone", "--budget", "10m"],
        &["paper", "--n", "64,128"],
        &["mesh", "refine", "m.msh", "fine.msh", "--times", "4"],
    ];
    for words in commands {
        let limited = [words, &["--time-limit", "0.3", "--json", "out.json"]].concat();
        let ran = run(path, &limited);
        assert_eq!(ran.code, Some(2), "{limited:?}: {}", ran.stderr);
        assert!(
            ran.stderr.contains("0.3 s of --time-limit"),
            "{limited:?}: {}",
            ran.stderr
        );
        let json = fs::read_to_string(path.join("out.json")).unwrap();
        assert!(
            json.contains("0.3 s of --time-limit"),
            "{limited:?}: {json}"
        );
        assert!(!path.join("fine.msh").exists());

        let mut child = faceoff(path)
            .args(words)
            .args(["--json", "out.json"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        interrupt(&child);
        assert_eq!(ended(&mut child), Some(2), "{words:?}");
        let json = fs::read_to_string(path.join("out.json")).unwrap();
        assert!(json.contains("interrupted"), "{words:?}: {json}");
    }
}

/// What was certified before the end is the result.
#[test]
fn an_accuracy_ends_with_the_best_so_far() {
    let folder = folder();
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "1e-5",
        "--json",
        "out.json",
    ];
    let best = |code: Option<i32>, stderr: &str| {
        assert_eq!(code, Some(1), "{stderr}");
        let json = fs::read_to_string(folder.path().join("out.json")).unwrap();
        let told: serde_json::Value = serde_json::from_str(&json).unwrap();
        let relative = told["certificate"]["relative"].as_f64().unwrap();
        assert!(0.0 < relative && relative < 0.5, "{json}");
        assert!(
            told["meshes"].as_array().is_some_and(|m| !m.is_empty()),
            "{json}"
        );
    };
    let ran = run(
        folder.path(),
        &[&words[..], &["--time-limit", "3"]].concat(),
    );
    best(ran.code, &ran.stderr);
    assert!(ran.stderr.contains("3 s of --time-limit"), "{}", ran.stderr);

    let mut child = faceoff(folder.path())
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Not before the first mesh is certified.
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let first = lines.next().unwrap().unwrap();
    assert!(first.contains("certified to"), "{first}");
    interrupt(&child);
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    best(ended(&mut child), &rest.join("\n"));
}

#[test]
fn memory_that_may_not_be_taken_is_not() {
    let folder = folder();
    let path = folder.path();
    for (words, said) in [
        (
            &["solve", "one-zone", "--n", "16384"][..],
            "would take about",
        ),
        (
            &["solve", "one-zone", "--n", "4294967295"],
            "beyond the largest mesh",
        ),
        (
            &["mesh", "make", "one-zone-3d", "m.msh", "--n", "512"],
            "would take about",
        ),
        (
            &["solve", "one-zone", "--n", "256", "--memory", "40MB"],
            "--memory",
        ),
        (
            &[
                "solve",
                "one-zone-3d",
                "--n",
                "24",
                "--method",
                "p2",
                "--memory",
                "100MB",
            ],
            "MB",
        ),
    ] {
        let ran = run(path, &[words, &["--json", "out.json"]].concat());
        assert_eq!(ran.code, Some(2), "{words:?}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(said), "{words:?}: {}", ran.stderr);
        assert!(
            fs::read_to_string(path.join("out.json"))
                .unwrap()
                .contains("error")
        );
    }
    let scene = scene(path, "one-zone", "[mesh]", "[mesh]\nn = 16384");
    let ran = run(path, &["solve", &scene]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    let ran = run(path, &["solve", "one-zone", "--memory", "none"]);
    assert!(ran.stderr.contains("not a memory size"), "{}", ran.stderr);
}

/// An adapted mesh that is too large is not begun, and what was reached is kept.
#[test]
fn an_accuracy_beyond_memory_ends_with_the_best_so_far() {
    let folder = folder();
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "1e-7",
        "--way",
        "adaptive",
        "--memory",
        "200MB",
        "--json",
        "out.json",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let told = ran.stdout + &ran.stderr;
    assert!(told.contains("an adapted mesh of"), "{told}");
    let json = fs::read_to_string(folder.path().join("out.json")).unwrap();
    let of: serde_json::Value = serde_json::from_str(&json).unwrap();
    let relative = of["certificate"]["relative"].as_f64().unwrap();
    assert!(1e-7 < relative && relative < 0.5, "{json}");
}

/// What nobody predicts, and what an engine takes.
#[test]
fn memory_of_engines_counts() {
    let folder = folder();
    let path = folder.path();
    let script = "import time\nheld = b'1' * (400 << 20)\ntime.sleep(600)\n";
    write(path, "hungry.py", script);
    let engine = "name = \"hungry\"\ncommand = [\"python3\", \"hungry.py\"]\n";
    write(path, "hungry.toml", engine);
    let engines = [
        "verify",
        "one-zone",
        "--n",
        "4",
        "--engines",
        "rust,hungry.toml",
    ];
    let ran = run(
        path,
        &[&engines[..], &["--memory", "200MB", "--json", "out.json"]].concat(),
    );
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stderr.contains("200 MB may be taken"), "{}", ran.stderr);
    let json = fs::read_to_string(path.join("out.json")).unwrap();
    assert!(json.contains("200 MB may be taken"), "{json}");
}

/// A limit on threads and memory from outside is no reason for a panic.
#[test]
fn a_system_that_gives_no_threads_is_told() {
    let folder = folder();
    let program = env!("CARGO_BIN_EXE_faceoff");
    let script = format!("ulimit -v 60000; exec {program} solve one-zone --n 8");
    let ran = told(
        Command::new("sh")
            .current_dir(folder.path())
            .args(["-c", &script])
            .output()
            .unwrap(),
    );
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
}

/// A child that has left its group and session, and one that has left its parents.
#[test]
fn nothing_outlives_an_engine() {
    let folder = folder();
    let path = folder.path();
    // Those of another run of this test have other numbers.
    let numbers = [1, 2, 3].map(|k| format!("{k}{}", std::process::id()));
    let [a, b, c] = &numbers;
    let script = format!("setsid sleep {a} & (setsid setsid sleep {b} &) ; sleep {c}");
    write(path, "hang.sh", &script);
    write(
        path,
        "mine.toml",
        "name = \"mine\"\ncommand = [\"sh\", \"hang.sh\"]\n",
    );
    let words = [
        "verify",
        "one-zone",
        "--n",
        "4",
        "--engines",
        "rust,mine.toml",
        "--time-limit",
        "3",
    ];
    let ran = run(path, &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("did not end within"), "{}", ran.stderr);
    std::thread::sleep(Duration::from_millis(100));
    let processes = told(Command::new("ps").args(["-eo", "args"]).output().unwrap());
    for number in numbers {
        let is_running = processes.stdout.contains(&format!("sleep {number}"));
        assert!(!is_running, "sleep {number} outlived its engine");
    }
}

/// Names of files need not be Unicode.
#[test]
fn a_name_that_is_no_text_is_a_name() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let name = OsStr::from_bytes(b"kept-\xff");
    let words = [
        "verify",
        "one-zone",
        "--n",
        "4",
        "--engines",
        "rust,freefem",
    ];
    let mut command = faceoff(folder.path());
    command.args(words).args(["--report", "page", "--record"]);
    let ran = told(command.arg(name).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(folder.path().join(name).join("baseline.json").is_file());
}
