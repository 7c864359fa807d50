//! Where results go: pipes, folders with an earlier report, and what strangers call things.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{faceoff, folder, run, told, write};

/// Runs a line of bash with the program in the path; it must end.
fn bash(at: &Path, line: &str) -> (Option<i32>, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_faceoff")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let mut bash = Command::new("timeout");
    bash.args(["20", "bash", "-o", "pipefail", "-c", line])
        .current_dir(at);
    bash.env("PATH", format!("{}:{path}", program.display()));
    let ran = told(bash.stdin(Stdio::null()).output().unwrap());
    (ran.code, ran.stdout)
}

#[test]
fn results_go_into_pipes() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u\n0,1\n");
    write(at, "b.csv", "vertex,u\n0,2\n");
    for (words, mark) in [
        ("--json /dev/stdout -q", "\"verdict\": \"disagree\""),
        ("--junit /dev/stdout -q", "<failure type=\"disagree\""),
        ("--badge /dev/stdout -q", ">disagree<"),
        ("--json /dev/fd/3 -q 3>&1", "\"verdict\": \"disagree\""),
    ] {
        let (code, text) = bash(at, &format!("faceoff compare a.csv b.csv {words} | cat"));
        assert_eq!(code, Some(1), "{words}: {text}");
        assert!(text.contains(mark), "{words}: {text}");
    }
    let line = "faceoff compare a.csv b.csv -q --json >(cat > o.json) --junit >(cat > o.xml); code=$?; sleep 0.3; exit $code";
    assert_eq!(bash(at, line).0, Some(1));
    let text = |name: &str| fs::read_to_string(at.join(name)).unwrap();
    assert!(text("o.json").contains("\"disagree\"") && text("o.xml").contains("<failure"));
    // A page that is a pipe is none of ours.
    fs::create_dir(at.join("page")).unwrap();
    let made = Command::new("mkfifo")
        .arg(at.join("page/index.html"))
        .status();
    assert!(made.unwrap().success());
    let (code, _) = bash(at, "faceoff compare a.csv b.csv --report page");
    assert_eq!(code, Some(2));
}

#[test]
fn a_report_has_no_files_of_an_earlier_one() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u\n0,1\n");
    write(at, "b.csv", "vertex,u\n0,1\n");
    let names = || {
        let entries = fs::read_dir(at.join("page")).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    let ran = run(
        at,
        &[
            "verify",
            "one-zone",
            "--n",
            "4",
            "--methods",
            "p1",
            "--engines",
            "rust,freefem",
            "--report",
            "page",
            "--junit",
            "page/junit.xml",
        ],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let first = names();
    assert!(
        first.contains(&"verify.json".into()) && first.len() > 3,
        "{first:?}"
    );
    write(&at.join("page"), "mine.txt", "not of a report");
    let ran = run(at, &["compare", "a.csv", "b.csv", "--report", "page"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let second = names();
    let fresh = [
        ".faceoff-report",
        "compare.json",
        "index.html",
        "junit.xml",
        "mine.txt",
    ];
    let stale: Vec<&String> = second.iter().filter(|n| first.contains(n)).collect();
    assert_eq!(
        stale,
        [".faceoff-report", "index.html", "junit.xml"],
        "{second:?}"
    );
    assert!(
        fresh
            .iter()
            .all(|name| second.contains(&(*name).to_owned())),
        "{second:?}"
    );
    // What an earlier list names outside of its folder stays.
    write(
        at,
        "page/.faceoff-report",
        "../a.csv\n/etc/hostname\n.\n..\n\nindex.html\n",
    );
    assert_eq!(
        run(at, &["compare", "a.csv", "b.csv", "--report", "page"]).code,
        Some(0)
    );
    assert!(at.join("a.csv").is_file() && at.join("page/mine.txt").is_file());
}

#[test]
fn linked_folders_are_not_left_out_without_a_word() {
    let folder = folder();
    let at = folder.path();
    for (side, value) in [("a", 1), ("b", 2)] {
        write(at, &format!("{side}/u.csv"), "vertex,u\n0,1\n");
        write(
            at,
            &format!("of-{side}/v.csv"),
            &format!("vertex,v\n0,{value}\n"),
        );
        std::os::unix::fs::symlink(format!("../of-{side}"), at.join(side).join("sub")).unwrap();
        std::os::unix::fs::symlink("nowhere", at.join(side).join("gone.csv")).unwrap();
    }
    let ran = run(at, &["compare", "a", "b"]);
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    for part in [
        "a/sub is a link to a folder",
        "b/sub is a link to a folder",
        "a/gone.csv is a link that leads to no file",
    ] {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
    let ran = run(
        at,
        &[
            "compare",
            "a",
            "b",
            "--exclude",
            "sub",
            "--exclude",
            "gone.csv",
        ],
    );
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(run(at, &["compare", "a/sub", "b/sub"]).code, Some(1));
}

#[test]
fn a_matrix_of_refusals_is_an_error_of_the_pipeline() {
    let folder = folder();
    let at = folder.path();
    let text = "scenes = [\"one-zone\"]\nmethods = [\"p1-vi\"]\nn = [4]\n[[releases]]\nname = \"a\"\ncompanion = \"freefem\"\nwithin = [\"env\", \"--chdir={job}\"]\n";
    write(at, "m.toml", text);
    let ran = run(at, &["matrix", "--run", "m.toml", "--junit", "m.xml"]);
    assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
    let xml = fs::read_to_string(at.join("m.xml")).unwrap();
    assert!(
        xml.contains("tests=\"1\" failures=\"0\" errors=\"1\""),
        "{xml}"
    );
}

/// What turns the direction of reading makes people read what is not there.
#[test]
fn no_output_lets_a_name_turn_the_direction_of_reading() {
    let folder = folder();
    let at = folder.path();
    let turned = "u\u{202e}eerga\u{2066}\u{61c}";
    write(at, "a.csv", &format!("vertex,{turned}\n0,1\n"));
    write(at, "b.csv", &format!("vertex,{turned}\n0,2\n"));
    let mut command = faceoff(at);
    command.args([
        "compare", "a.csv", "b.csv", "--report", "page", "--json", "o.json", "--junit", "o.xml",
        "--badge", "o.svg",
    ]);
    command
        .env("GITHUB_ACTIONS", "true")
        .env("GITHUB_STEP_SUMMARY", at.join("summary.md"));
    let ran = told(command.output().unwrap());
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let mut files = vec![
        at.join("o.json"),
        at.join("o.xml"),
        at.join("o.svg"),
        at.join("summary.md"),
    ];
    files.extend(
        fs::read_dir(at.join("page"))
            .unwrap()
            .map(|e| e.unwrap().path()),
    );
    let texts = files
        .iter()
        .filter_map(|path| Some((path, fs::read_to_string(path).ok()?)));
    let misleads = |text: &str| text.contains(['\u{202e}', '\u{2066}', '\u{61c}']);
    for (path, text) in texts.filter(|(path, _)| path.extension().is_none_or(|e| e != "vtu")) {
        assert!(!misleads(&text), "{}: {text}", path.display());
    }
    assert!(!misleads(&ran.stdout) && !misleads(&ran.stderr));
    // To a program it is the name that it was.
    let found: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
    assert_eq!(found["fields"][0]["field"], turned, "{found}");
}
