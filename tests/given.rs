//! What runs, and what is only read: that hangs on how a file is given, not on what it holds.

use std::fs;
use std::path::Path;

use crate::common::{Ran, folder, run, write};

/// Two codes that leave a trace and agree.
const SCENE: &str = r#"name = "scene"
[codes.a]
command = ["sh", "-c", "touch ran; printf 'vertex,u\n0,1\n' > $0/u.csv", "{out}"]
result = "u.csv"
[codes.b]
command = ["/bin/sh", "-c", "touch ran; printf 'vertex,u\n0,1\n' > $0/u.csv", "{out}"]
result = "u.csv"
[fields.u]
same = "discretisation"
"#;

fn refused(at: &Path, words: &[&str], told: &[&str]) {
    let ran = run(at, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}{}", ran.stdout, ran.stderr);
    for part in told {
        assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
    }
    assert!(!at.join("ran").exists(), "{words:?} has run something");
}

#[test]
fn a_file_that_starts_programs_runs_only_where_the_user_says_so() {
    let folder = folder();
    let at = folder.path();
    write(at, "scene.toml", SCENE);
    let told = [
        "scene.toml starts programs: sh, /bin/sh",
        "verify --run scene.toml",
    ];
    for words in [
        &["verify", "scene.toml"][..],
        &["verify", "scene.toml", "--sandbox"],
        &["verify", "scene.toml", "--diagnose"],
        &["verify", "scene.toml", "--record", "kept"],
        &["verify", "scene.toml", "--resume", "kept"],
    ] {
        refused(at, words, &told);
    }
    assert!(!at.join("kept").exists());
    // No other command that takes a scene takes it for one.
    write(at, "u.csv", "vertex,u\n0,1\n");
    for words in [
        &["solve", "scene.toml"][..],
        &["judge", "u.csv", "--scene", "scene.toml"],
        &["compare", "u.csv", "u.csv", "--scene", "scene.toml"],
        &["certify", "u.csv", "--scene", "scene.toml"],
        &["study", "scene.toml"],
        &["orders", "--scenes", "scene.toml"],
        &["stress", "--families", "scene.toml"],
        &["engines", "check", "scene.toml"],
        &["verify", "one-zone", "--engines", "rust,scene.toml"],
    ] {
        refused(at, words, &[]);
    }
    for words in [
        &["verify", "--run", "scene.toml"][..],
        &["verify", "scene.toml", "--run"],
        &["verify", "--run", "scene.toml", "--record", "kept"],
        &[
            "verify",
            "--run",
            "scene.toml",
            "--against",
            "kept",
            "--engines",
            "a",
        ],
        &["verify", "--run", "scene.toml", "--resume", "runs"],
        &["verify", "--run", "scene.toml", "--diagnose"],
    ] {
        let ran = run(at, words);
        assert_eq!(ran.code, Some(0), "{words:?}: {}{}", ran.stdout, ran.stderr);
        assert!(fs::remove_file(at.join("ran")).is_ok(), "{words:?}");
    }
}

#[test]
fn engines_of_ours_need_no_leave_and_described_ones_do() {
    let folder = folder();
    let at = folder.path();
    let code = |name: &str, engine: &str, method: &str| {
        format!(
            "[codes.{name}]\nengine = \"{engine}\"\nscene = \"one-zone\"\nmethod = \"{method}\"\n"
        )
    };
    let text = |engine: &str| {
        format!(
            "name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = [4]\n{}{}[fields.u]\nsame = \"problem\"\nrtol = 1.0\n",
            code("one", "rust", "p1"),
            code("two", engine, "p2")
        )
    };
    write(at, "x.toml", &text("rust"));
    let Ran { code, stderr, .. } = run(at, &["verify", "x.toml"]);
    assert_eq!(code, Some(0), "{stderr}");
    write(
        at,
        "theirs.toml",
        "name = \"theirs\"\ncommand = [\"touch\", \"ran\"]\n",
    );
    write(at, "x.toml", &text("theirs.toml"));
    refused(
        at,
        &["verify", "x.toml"],
        &["x.toml starts programs: theirs"],
    );
    let ran = run(at, &["verify", "x.toml", "--engines", "two"]);
    assert!(ran.stderr.contains("starts programs"), "{}", ran.stderr);
}

#[test]
fn a_matrix_runs_only_where_the_user_says_so() {
    let folder = folder();
    let at = folder.path();
    let release = |name: &str, more: &str| format!("[[releases]]\nname = \"{name}\"\n{more}\n");
    let text = [
        "scenes = [\"one-zone\"]\nmethods = [\"p1\"]\nn = [4]\n".to_owned(),
        release(
            "a",
            "companion = \"freefem\"\nwithin = [\"touch\", \"ran\", \"{job}\"]",
        ),
        release("b", "command = [\"python3\", \"b.py\"]"),
        release("c", "companion = \"fenicsx\"\nscripts = \"changed\""),
    ];
    write(at, "m.toml", &text.concat());
    let told = [
        "m.toml starts programs: touch, python3, changed",
        "matrix --run m.toml",
    ];
    refused(at, &["matrix", "m.toml"], &told);
    let ran = run(at, &["matrix", "--run", "m.toml"]);
    assert!(!ran.stderr.contains("starts programs"), "{}", ran.stderr);
}
