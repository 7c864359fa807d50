//! `study`, `stress` and `--explain` on the command line.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::{folder, run, write};

#[test]
fn a_study_ends_with_a_report() {
    let folder = folder();
    let words = [
        "study",
        "transition-1.5",
        "--methods",
        "cr-fc,p1",
        "--budget",
        "1s",
        "--report",
        "r",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let told = ran.json();
    let rows = told["rows"].as_array().unwrap();
    assert!(rows.len() >= 4);
    for method in ["cr-fc", "p1"] {
        let track = rows
            .iter()
            .filter(|r| r["method"] == method && r["varied"] == "mesh");
        let errors: Vec<f64> = track.clone().map(|r| r["h1"].as_f64().unwrap()).collect();
        assert!(errors.len() >= 2 && errors.windows(2).all(|e| e[1] < e[0]));
        for row in track {
            let [error, bound] = ["h1", "certified"].map(|key| row[key].as_f64().unwrap());
            assert!(error <= bound, "{row}");
            let seconds = &row["seconds"];
            let [least, median, most] =
                ["least", "median", "most"].map(|key| seconds[key].as_f64().unwrap());
            assert!(0.0 < least && least <= median && median <= most);
        }
    }
    assert!(rows.iter().all(|row| row["converged"] == true));
    let report = |name: &str| std::fs::read_to_string(folder.path().join("r").join(name)).unwrap();
    // One line a row, and the header.
    let csv = report("rows.csv");
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
    let text = report("report.md");
    for advice in told["advice"].as_array().unwrap() {
        assert!(text.contains(advice["command"].as_str().unwrap()));
    }
    assert!(text.contains("work-transition-1.5.svg"));
    assert!(report("work-transition-1.5.svg").contains("<svg"));
    assert_eq!(
        serde_json::from_str::<serde_json::Value>(&report("study.json")).unwrap()["rows"],
        told["rows"]
    );
    // A second report takes the place of the first; other folders are left alone.
    write(folder.path(), "other/mine.txt", "mine");
    let ran = run(
        folder.path(),
        &[
            "study",
            "transition-1.5",
            "--budget",
            "1s",
            "--report",
            "other",
        ],
    );
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("nothing was touched"), "{}", ran.stderr);
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let folder = folder();
    for (words, sentence) in [
        (&["study", "--budget", "0s"][..], "no positive time"),
        (&["study", "no-such-scene"], "there is no scene"),
        (&["study", "hertz", "hertz"], "named twice"),
        (&["study", "--engines", "rust,rust"], "named twice"),
        (&["study", "--budget", "1us"], "no positive time"),
        (&["stress", "one-zone"], "its solution is not known"),
        (&["stress", "--families", "weather"], "there is no family"),
    ] {
        let ran = run(folder.path(), words);
        assert_eq!(ran.code, Some(2), "{words:?}");
        assert!(ran.stderr.contains(sentence), "{}", ran.stderr);
    }
}

#[test]
fn a_map_is_drawn_and_the_same_again() {
    let folder = folder();
    let words = [
        "stress",
        "transition-1.5",
        "--families",
        "data,bodies",
        "--methods",
        "cr,p2",
        "--report",
        "r",
        "--json",
        "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let told = ran.json();
    let cells = told["cells"].as_array().unwrap();
    let count = |verdict: &str| cells.iter().filter(|c| c["verdict"] == verdict).count();
    assert_eq!(count("wrong"), 0);
    assert_eq!(count("refuses"), 6, "{}", ran.stdout);
    assert!(count("holds") >= 12);
    let again = run(folder.path(), &words);
    assert_eq!(again.stdout, ran.stdout);
    let report = |name: &str| std::fs::read_to_string(folder.path().join("r").join(name)).unwrap();
    assert!(report("map-rust.svg").contains("<svg"));
    assert_eq!(report("map.csv").lines().count(), cells.len() + 1);
    assert!(report("report.md").contains("does not press it into contact"));
}

#[test]
fn solve_explains_itself() {
    let folder = folder();
    let ran = run(folder.path(), &["solve", "one-zone", "--explain"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for line in [
        "model: CR in 2 dimensions, 800 dofs, 16 of them given on Γ_D",
        "contact: 16 faces, 80 conditions",
        "1 sparse factor(s)",
        "left out: g, t, psi (zero)",
        "the certificate (--certify)",
    ] {
        assert!(ran.stdout.contains(line), "{line}: {}", ran.stdout);
    }
    let words = ["solve", "one-zone", "--explain", "--certify", "--json", "-"];
    let told = run(folder.path(), &words).json();
    assert_eq!(told["explanation"]["certificate"], true);
    assert_eq!(told["explanation"]["built"]["factors"], 1);
    let told = run(folder.path(), &["solve", "one-zone", "--json", "-"]).json();
    assert!(told.get("explanation").is_none());
}
