//! `faceoff matrix`: releases of codes, each in a system of its own, which here is this one.

use std::fs;

use crate::common::{assert_valid, changed_companion, folder, run, write};

/// What runs a command in the job folder, as a container would.
const WITHIN: &str = r#"within = ["env", "--chdir={job}", "PATH=/usr/bin:/bin"]"#;

#[test]
fn releases_are_held_against_the_built_in_solver_and_their_history_is_kept() {
    let folder = folder();
    let at = folder.path();
    changed_companion(
        at,
        "freefem",
        "max(u - psi, gamma",
        "max(u - psi, 1.01*gamma",
    );
    let released = |name: &str, companion: &str, more: &str| {
        format!("[[releases]]\nname = \"{name}\"\ncompanion = \"{companion}\"\n{more}\n")
    };
    let changed = format!("{WITHIN}\nscripts = \"copy\"");
    let text = [
        "scenes = [\"one-zone\"]\nmethods = [\"cr\", \"p1-vi\"]\nn = [8]\n".to_owned(),
        released("new", "freefem", WITHIN),
        released("old", "fenicsx", WITHIN),
        released("changed", "freefem", &changed),
        released(
            "gone",
            "freefem",
            "within = [\"no-such-container\", \"{job}\"]",
        ),
    ];
    write(at, "m.toml", &text.concat());
    let words = [
        "matrix", "--run", "m.toml", "--report", "site", "--json", "m.json", "--junit", "m.xml",
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert_valid(
        "json",
        "src/report/schema/matrix-1.json",
        &at.join("m.json"),
    );
    let told = fs::read_to_string(at.join("m.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let of = |release: &str, method: &str| {
        let cells = told["cells"].as_array().unwrap().iter();
        let mut own = cells.filter(|c| c["release"] == release && c["method"] == method);
        own.next().unwrap().clone()
    };
    for release in ["new", "old"] {
        let cell = of(release, "cr");
        assert_eq!(cell["became"], "agrees", "{cell}");
        let difference = cell["difference"].as_f64().unwrap();
        assert!(0.0 < difference && difference < 1e-12, "{cell}");
        assert_eq!(of(release, "p1-vi")["became"], "refused");
    }
    let changed = of("changed", "cr");
    assert_eq!(changed["became"], "differs");
    assert!(changed["difference"].as_f64().unwrap() > 1e-6, "{changed}");
    assert!(
        changed["why"].as_str().unwrap().contains("1.0100"),
        "{changed}"
    );
    let gone = of("gone", "cr");
    assert_eq!(gone["became"], "absent");
    assert!(gone["why"].as_str().unwrap().contains("no-such-container"));
    assert!(told["releases"][3]["version"].is_null());
    // What a code in another system tells is its own version.
    assert!(
        told["releases"][0]["version"]
            .as_str()
            .unwrap()
            .starts_with("4.")
    );

    let site = at.join("site");
    let page = |name: &str| fs::read_to_string(site.join(name)).unwrap();
    assert!(page("new.svg").contains("1 of 1 agree"));
    assert!(page("changed.svg").contains("0 of 1 agree"));
    assert!(page("index.html").contains("href=\"one-zone-cr/index.html\""));
    assert!(page("one-zone-cr/index.html").contains("changed"));
    assert!(!site.join("one-zone-p1-vi").exists(), "all refuse it");
    assert_eq!(page("history.jsonl").lines().count(), 1);
    // A second run is kept after the first, and a page shows both.
    assert_eq!(run(at, &words).code, Some(1));
    assert_eq!(page("history.jsonl").lines().count(), 2);
    let signs = page("index.html");
    for (sign, runs) in [("●", 4), ("×", 2), ("○", 2)] {
        assert_eq!(
            signs.matches(&format!(">{sign}</span>")).count(),
            runs,
            "{sign}"
        );
    }
    // A history that is not ours is not lost.
    let damaged = page("history.jsonl") + "{\n";
    fs::write(site.join("history.jsonl"), &damaged).unwrap();
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("history.jsonl:3"), "{}", ran.stderr);
    assert_eq!(page("history.jsonl"), damaged);
}

#[test]
fn a_matrix_that_cannot_be_run_says_why() {
    let folder = folder();
    let at = folder.path();
    let release = "[[releases]]\nname = \"a\"\ncompanion = \"freefem\"\n";
    let scenes = "scenes = [\"one-zone\"]\n";
    for (text, said) in [
        (format!("{scenes}{release}"), "does not say what to run"),
        (
            format!("{scenes}{release}within = [\"env\"]\n"),
            "does not name {job}",
        ),
        (format!("{scenes}releases = []\n"), "names no release"),
        (
            format!("scenes = []\n{release}{WITHIN}\n"),
            "names no scene",
        ),
        (
            format!("{scenes}{release}{WITHIN}\n{release}{WITHIN}\n"),
            "give each a name of its own",
        ),
        (
            format!("{scenes}methods = [\"q9\"]\n{release}{WITHIN}\n"),
            "q9",
        ),
        (
            format!("{scenes}{release}inside = []\n"),
            "m.toml:5: unknown field `inside`",
        ),
    ] {
        write(at, "m.toml", &text);
        let ran = run(at, &["matrix", "--run", "m.toml"]);
        assert_eq!(ran.code, Some(2), "{text}");
        assert!(ran.stderr.contains(said), "{said}: {}", ran.stderr);
    }
}
