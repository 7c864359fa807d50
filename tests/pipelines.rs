//! What others' pipelines run: the steps of the GitHub action and of the GitLab template that need no server, by the
//! shell that would run them.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{Ran, assert_valid, folder, source, told, write};

/// The lines after the one that is `head`, as far as they are indented more, without their indentation.
fn block(file: &str, head: &str) -> Vec<String> {
    let text = fs::read_to_string(source(file)).unwrap();
    let mut lines = text.lines().skip_while(|line| line.trim() != head);
    let indent = |line: &str| line.len() - line.trim_start().len();
    let outer = indent(lines.next().unwrap_or_else(|| panic!("{file} has {head}")));
    let inner = lines.take_while(|line| line.trim().is_empty() || indent(line) > outer);
    inner.map(|line| line.trim().to_owned()).collect()
}

/// The script of a step of the action.
fn step(name: &str) -> String {
    let lines = block(".ci/action.yml", &format!("- name: {name}"));
    let start = lines.iter().position(|line| line == "run: |").unwrap();
    lines[start + 1..].join("\n")
}

/// The script of the template's job.
fn gitlab() -> String {
    let lines = block(".ci/gitlab.yml", "script:").into_iter();
    let lines = lines.filter(|line| !line.starts_with('#'));
    let commands = lines.map_while(|line| line.strip_prefix("- ").map(str::to_owned));
    commands.collect::<Vec<_>>().join("\n")
}

/// Runs a script as the servers do, with the program in the path.
fn shell(folder: &Path, script: &str, variables: &[(&str, &str)]) -> Ran {
    let program = Path::new(env!("CARGO_BIN_EXE_faceoff")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let mut bash = Command::new("bash");
    bash.args(["-eo", "pipefail", "-c", script])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", program.display()));
    variables.iter().for_each(|(name, value)| {
        bash.env(name, value);
    });
    told(bash.output().unwrap())
}

fn is_there(folder: &Path, names: &[&str]) -> Vec<bool> {
    names
        .iter()
        .map(|name| folder.join(name).is_file())
        .collect()
}

#[test]
fn both_servers_run_what_is_asked_and_keep_what_is_told() {
    let baseline = source("tests/baseline");
    let baseline = baseline.display();
    for (server, script, names) in [
        ("GitHub", step("Judge"), ["COMMAND", "REPORT"]),
        ("GitLab", gitlab(), ["FACEOFF_COMMAND", "FACEOFF_REPORT"]),
    ] {
        let folder = folder();
        let at = folder.path();
        write(at, "a.csv", "vertex,u\n0,1\n");
        write(at, "b.csv", "vertex,u\n0,2\n");
        write(at, "c.csv", "vertex,u\n0,1.0\n");
        write(at, "with a blank.csv", "vertex,u\n0,1\n");
        let verify = format!("verify one-zone --n 4 --methods cr,p2 --against {baseline}");
        let runs = [
            (verify.as_str(), 0, true),
            ("compare a.csv c.csv", 0, false),
            (
                "compare a.csv\n  'with a blank.csv'\n  --rtol 1e-9\n",
                0,
                false,
            ),
            ("compare a.csv \"$(touch ran)\"", 2, false),
            ("compare a.csv b.csv", 1, false),
            ("compare a.csv none.csv", 2, false),
            ("verify no-scene", 2, false),
        ];
        for (k, (command, code, has_methods)) in runs.into_iter().enumerate() {
            let report = format!("out-{k}");
            let variables = [
                (names[0], command),
                (names[1], &report),
                ("SANDBOX", "true"),
            ];
            let ran = shell(at, &script, &variables);
            assert_eq!(ran.code, Some(code), "{server}, {command}: {}", ran.stderr);
            let kept = at.join(&report);
            let told = ["faceoff.json", "junit.xml", "badge.svg", "index.html"];
            assert_eq!(is_there(&kept, &told), [true; 4], "{command}");
            assert_valid("xsd", "tests/junit.xsd", &kept.join("junit.xml"));
            // The methods are judged against each other as well.
            let xml = fs::read_to_string(kept.join("junit.xml")).unwrap();
            let by_methods = xml.contains("classname=\"one-zone.methods\"");
            assert_eq!(by_methods, has_methods, "{server}, {command}: {xml}");
            assert!(!at.join("ran").exists(), "{server}: {command} was run");
            let word = command.split(' ').next().unwrap();
            let schema = format!("src/report/schema/{word}-1.json");
            assert_valid("json", &schema, &kept.join("faceoff.json"));
        }
    }
}

#[test]
fn the_cache_is_named_by_the_sources_of_the_program() {
    let folder = folder();
    let at = folder.path();
    // The action stands in a folder of its own beside what it builds.
    for name in [
        "Cargo.toml",
        "Cargo.lock",
        "src/a",
        "crates/a",
        "freefem/a",
        "fenicsx/a",
        "meshes/a",
    ] {
        write(at, name, "one");
    }
    fs::create_dir(at.join("ci")).unwrap();
    let digest = || {
        let (action, output) = (at.join("ci"), at.join("output"));
        fs::write(&output, "").unwrap();
        let variables = [
            ("GITHUB_ACTION_PATH", action.to_str().unwrap()),
            ("GITHUB_OUTPUT", output.to_str().unwrap()),
        ];
        let ran = shell(Path::new("/"), &step("Name this version"), &variables);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let told = fs::read_to_string(&output).unwrap();
        let digest = told.trim().strip_prefix("digest=").unwrap().to_owned();
        assert!(digest.len() == 16 && digest.chars().all(|c| c.is_ascii_hexdigit()));
        digest
    };
    let first = digest();
    assert_eq!(digest(), first);
    for changed in ["Cargo.lock", "src/a", "crates/a", "freefem/a", "fenicsx/a"] {
        let before = digest();
        write(at, changed, "two");
        assert_ne!(digest(), before, "{changed}");
    }
}

/// Whatever the words before and after the command are, codes run in a sandbox or not at all; without one only where it is said.
#[test]
fn codes_of_pull_requests_run_in_a_sandbox_or_not_at_all() {
    let folder = folder();
    let at = folder.path();
    let touch = "command = [\"sh\", \"leave.sh\"]\n";
    write(at, "leave.sh", &format!("touch {}/ran\n", at.display()));
    write(at, "e.toml", &format!("name = \"e\"\n{touch}"));
    let leave = at.join("leave.sh");
    let within = format!("companion = \"freefem\"\nwithin = [\"sh\", {leave:?}, \"{{job}}\"]\n");
    let matrix = |release: &str| {
        format!(
            "scenes = [\"one-zone\"]\nmethods = [\"p1\"]\nn = [4]\n[[releases]]\nname = \"r\"\n{release}"
        )
    };
    write(at, "m.toml", &matrix(touch));
    write(at, "w.toml", &matrix(&within));
    write(at, "within.toml", &format!("name = \"w\"\n{within}"));
    let code = |name: &str| {
        let leave = format!("touch {}/ran; true {name}", at.display());
        format!(
            "[codes.{name}]\ncommand = [\"sh\", \"-c\", \"{leave}\", \"{{out}}\"]\nresult = \"u.csv\"\n"
        )
    };
    let text = format!(
        "name = \"f\"\n{}{}[fields.u]\nsame = \"discretisation\"\n",
        code("a"),
        code("b")
    );
    write(at, "f.toml", &text);
    // A system that makes no namespaces.
    write(at, "bare/bwrap", "#!/bin/sh\nexit 1\n");
    let made = Command::new("chmod")
        .arg("+x")
        .arg(at.join("bare/bwrap"))
        .status();
    assert!(made.unwrap().success());
    let program = Path::new(env!("CARGO_BIN_EXE_faceoff")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let bare = format!("{}/bare:{path}", at.display());
    for (server, script, names) in [
        ("GitHub", step("Judge"), ["COMMAND", "REPORT"]),
        ("GitLab", gitlab(), ["FACEOFF_COMMAND", "FACEOFF_REPORT"]),
    ] {
        let small = "one-zone --n 4 --methods p1";
        let commands = [
            format!("verify {small} --engines rust,e.toml"),
            format!("--time-limit 10m verify {small} --engines rust,e.toml"),
            format!("-v verify {small} --engines rust,e.toml"),
            format!("verify {small} --engines rust,within.toml"),
            "engines check e.toml".to_owned(),
            "matrix --run m.toml".to_owned(),
            "matrix --run w.toml".to_owned(),
            "-v verify --run f.toml".to_owned(),
        ];
        // Both set one variable, which is all that there is.
        let count = if server == "GitHub" {
            commands.len()
        } else {
            2
        };
        for command in &commands[..count] {
            let ran = |sandbox: [&str; 2], path: &str| {
                let variables = [
                    (names[0], command.as_str()),
                    (names[1], "page"),
                    ("SANDBOX", sandbox[0]),
                    ("FACEOFF_SANDBOX", sandbox[1]),
                    ("PATH", path),
                ];
                let of_server = if server == "GitHub" {
                    &variables[..3]
                } else {
                    &variables[..]
                };
                let of_server = [of_server, &variables[4..]].concat();
                let ran = shell(at, &script, &of_server);
                let has_run = fs::remove_file(at.join("ran")).is_ok();
                assert!(ran.code != Some(0), "{server}, {command}: {}", ran.stdout);
                has_run
            };
            assert!(!ran(["true", "require"], &path), "{server}, {command}");
            assert!(
                !ran(["true", "require"], &bare),
                "{server}, {command}, without namespaces"
            );
            assert!(
                ran(["false", ""], &path),
                "{server}, {command}: the test shows nothing"
            );
        }
    }
    let words = [
        ("COMMAND", "scenes"),
        ("REPORT", "page"),
        ("SANDBOX", "yes"),
    ];
    let ran = shell(at, &step("Judge"), &words);
    assert!(
        ran.code == Some(2) && ran.stdout.contains("neither true nor false"),
        "{}",
        ran.stdout
    );
    let ran = shell(at, "faceoff scenes", &[("FACEOFF_SANDBOX", "1")]);
    assert!(
        ran.code == Some(2) && ran.stderr.contains("set it to `require`"),
        "{}",
        ran.stderr
    );
}

/// A push is tested, a release only made of what was, and nothing that runs there can be moved.
#[test]
fn workflows_test_what_is_pushed_and_released() {
    let text =
        |name: &str| fs::read_to_string(source(&format!(".github/workflows/{name}.yml"))).unwrap();
    let (ci, release, wheels) = (text("ci"), text("release"), text("wheels"));
    for part in [
        "  push:",
        "  pull_request:",
        "  workflow_call:",
        "- run: .ci/run",
        "cargo deny --locked check",
    ] {
        assert!(ci.contains(part), "{part}");
    }
    let needs = "needs: [test, wheels, build]";
    for part in [
        needs,
        "uses: ./.github/workflows/ci.yml",
        "uses: ./.github/workflows/wheels.yml",
        "sha256sum * >",
        "subject-path: out/*",
    ] {
        assert!(release.contains(part), "{part}");
    }
    assert!(wheels.contains("  workflow_call:") && !wheels.contains("tags:"));
    assert!(
        fs::read_to_string(source(".ci/run"))
            .unwrap()
            .contains("cargo deny")
    );
    for line in [ci, release, wheels].iter().flat_map(|text| text.lines()) {
        let Some((_, used)) = line.split_once("uses: ") else {
            continue;
        };
        let commit = used
            .split_once('@')
            .map(|(_, at)| at.split(' ').next().unwrap());
        let is_fixed =
            commit.is_some_and(|c| c.len() == 40 && c.chars().all(|c| c.is_ascii_hexdigit()));
        assert!(is_fixed || used.starts_with("./"), "{line}");
    }
}
