//! What people meet on a terminal: completions, manual pages, words that were meant, widths, colours.

use std::fs;
use std::process::Command;

use crate::common::{assert_valid, faceoff, folder, run, told};

/// Runs words on a terminal of so many columns.
fn on_terminal(columns: u32, before: &str, words: &str) -> String {
    let folder = folder();
    let program = env!("CARGO_BIN_EXE_faceoff");
    let typed = format!("stty cols {columns}; {before} {program} {words}");
    let ran = crate::common::on_terminal(folder.path(), &typed, "");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    ran.stdout
}

#[test]
fn shells_take_the_completions() {
    let folder = folder();
    for (shell, says) in [
        ("bash", "complete -F _faceoff"),
        ("zsh", "#compdef faceoff"),
        ("fish", "complete -c faceoff"),
    ] {
        let ran = run(folder.path(), &["completions", shell]);
        assert_eq!(ran.code, Some(0));
        assert!(ran.stdout.contains(says), "{shell}");
        assert!(ran.stdout.contains("time-limit") && !ran.stdout.contains('\u{fffd}'));
    }
    let completed = "source <($0 completions bash); COMP_WORDS=(faceoff mesh che); COMP_CWORD=2; _faceoff faceoff che mesh; echo ${COMPREPLY[@]}";
    let mut bash = Command::new("bash");
    bash.args(["-c", completed, env!("CARGO_BIN_EXE_faceoff")]);
    let ran = told(bash.output().unwrap());
    assert_eq!(ran.stdout.trim(), "check", "{}", ran.stderr);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = folder();
    let ran = run(folder.path(), &["man", "pages/man1"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for (page, says) in [
        ("faceoff", "FACEOFF_LOG"),
        ("faceoff-verify", "diagnose"),
        ("faceoff-mesh-convert", "lossy"),
        ("faceoff-engines-check", "sandbox"),
    ] {
        let path = folder.path().join(format!("pages/man1/{page}.1"));
        let text = fs::read_to_string(path).unwrap();
        assert!(
            text.starts_with(".ie") && text.contains(says),
            "{page}: {text}"
        );
    }
}

#[test]
fn a_word_that_is_nearly_right_is_asked_for() {
    let folder = folder();
    for (words, meant) in [
        (&["solve", "onezone"][..], "one-zone"),
        (&["verify", "one-zone", "--engines", "fenics"], "fenicsx"),
        (&["verify", "one-zone", "--methods", "cr-cf"], "cr-fc"),
        (&["solv", "one-zone"], "solve"),
        (&["mesh", "inof", "a.msh"], "info"),
        (&["solve", "one-zone", "--methd", "cr"], "--method"),
    ] {
        let ran = run(folder.path(), words);
        assert_eq!(ran.code, Some(2));
        assert!(ran.stderr.contains(meant), "{words:?}: {}", ran.stderr);
    }
}

#[test]
fn scenes_are_listed_and_one_is_begun_on_a_mesh() {
    let folder = folder();
    let at = folder.path();
    let listed = run(at, &["scenes", "--json", "scenes.json"]);
    assert_eq!(listed.code, Some(0), "{}", listed.stderr);
    assert_valid(
        "json",
        "src/report/schema/scenes-1.json",
        &at.join("scenes.json"),
    );
    assert_eq!(
        run(at, &["mesh", "make", "plate", "mine.msh"]).code,
        Some(0)
    );
    let begun = run(at, &["init", "mine.msh"]);
    assert_eq!(
        (begun.code, &*begun.stdout, &*begun.stderr),
        (Some(0), "faceoff solve mine.toml\n", "")
    );
    let scene = fs::read_to_string(at.join("mine.toml")).unwrap();
    for line in ["dirichlet = [\"clamp\"]", "contact = [\"base\"]"] {
        assert!(scene.lines().any(|l| l == line), "{scene}");
    }
    let solved = run(at, &["solve", "mine.toml"]);
    assert_eq!(solved.code, Some(0), "{}", solved.stderr);
    let again = run(at, &["init", "mine.msh"]);
    assert_eq!(again.code, Some(2));
    assert!(
        again.stderr.contains("mine.toml already exists"),
        "{}",
        again.stderr
    );
}

#[test]
fn pipes_get_no_colours_and_terminals_their_width() {
    let folder = folder();
    let solve = ["solve", "one-zone", "--n", "8", "-vv"];
    let mut piped = faceoff(folder.path());
    let ran = told(
        piped
            .args(solve)
            .env("FACEOFF_LOG", "debug")
            .output()
            .unwrap(),
    );
    assert!(ran.stderr.contains("INFO"), "{}", ran.stderr);
    assert!(!(ran.stdout + &ran.stderr).contains('\u{1b}'));
    let compare = "compare a.csv b.csv";
    let files = "printf 'vertex,u\\n0,1\\n' | tee a.csv > b.csv;";
    assert!(on_terminal(80, files, compare).contains("\u{1b}[1;32m"));
    let files = format!("{files} NO_COLOR=1");
    assert!(!on_terminal(80, &files, compare).contains('\u{1b}'));
    for columns in [60, 100] {
        let widths = on_terminal(columns, "", "scenes");
        let lines: Vec<&str> = widths.lines().map(str::trim_end).collect();
        // The last line is a sentence, which a terminal breaks by itself.
        let table = lines.split_last().unwrap().1.iter();
        let widest = table.map(|line| line.chars().count()).max().unwrap();
        assert!(
            widest <= columns as usize && widest + 25 > columns as usize,
            "{widest}: {widths}"
        );
    }
}
