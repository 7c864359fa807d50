//! What people look at and what pipelines read: the page in a real browser, JUnit and JSON against their schemas.
//!
//! `FACEOFF_READERS` names a Python with jsonschema and lxml, and Chromium must be there; `tests/run` sees to both.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::{Ran, assert_valid, changed_companion, faceoff, folder, run, source, told};

/// Runs Rust beside a FreeFEM with one thing changed, with `words` after it.
fn with_fault(folder: &Path, from: &str, to: &str, words: &[&str]) -> Ran {
    let engine = changed_companion(folder, "freefem", from, to);
    let engines = format!("rust,freefem,{engine}");
    let all = [&["verify", "one-zone", "--engines", &engines], words].concat();
    run(folder, &all)
}

const GAMMA: (&str, &str) = (
    "gamma[][Ch(cell, 0)] = value;",
    "gamma[][Ch(cell, 0)] = value*(1 + 1e-6);",
);

/// The page as Chromium has it after its script ran; it must have no error and ask for nothing.
fn in_browser(page: &Path) -> String {
    let home = folder();
    let net = home.path().join("net.json");
    let output = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--dump-dom",
        ])
        .arg(format!(
            "--user-data-dir={}",
            home.path().join("profile").display()
        ))
        .arg(format!("--log-net-log={}", net.display()))
        .arg(format!("file://{}", page.display()))
        .env("HOME", home.path())
        .output()
        .expect("chromium is there: apt-get install chromium");
    let ran = told(output);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let console: Vec<&str> = ran
        .stderr
        .lines()
        .filter(|l| l.contains("CONSOLE"))
        .collect();
    assert!(console.is_empty(), "{console:?}");
    // The browser itself may ask for updates; the page may not ask for anything but itself.
    let log = fs::read_to_string(net).unwrap();
    let page_name = page.file_name().unwrap().to_string_lossy();
    let asked = log.matches("\"url\":\"file:").count();
    let for_page = log.matches(&format!("{page_name}\"")).count();
    assert!(asked <= for_page, "the page asked for other files");
    ran.stdout
}

#[test]
fn a_stranger_finds_engine_face_size_and_cause_at_the_top_of_the_page() {
    let folder = folder();
    let (from, to) = GAMMA;
    let words = [
        "--n",
        "10",
        "--methods",
        "cr,p2",
        "--report",
        "out",
        "--diagnose",
    ];
    let ran = with_fault(folder.path(), from, to, &words);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let page = folder.path().join("out/index.html");
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.len() < 5_000_000);
    // Nothing in it leads outside: the only addresses are names of XML.
    let addresses = html.matches("http").count();
    assert_eq!(
        addresses,
        html.matches("http://www.w3.org/2000/svg").count() + html.matches("http-equiv").count()
    );
    assert!(!html[..html.find("<script").unwrap()].contains("NaN"));

    let dom = in_browser(&page);
    let top = &dom[dom.find("role=\"status\"").unwrap()..dom.find("All that was judged").unwrap()];
    for part in [
        "aria-label=\"verdict: disagree\"",
        "id=\"verdict\">disagree<",
        "Which code: <b>changed</b>",
        "Which face: <b>[",
        "How much: <b>",
        "γ = γ₀ h accounts for it",
        "γ₀ = 100.0001",
        "<circle",
    ] {
        assert!(top.contains(part), "{part}: {top}");
    }
    // The script ran, and without it the tables are there as well.
    assert!(
        dom.contains("<button type=\"button\">pair")
            || dom.contains("<button type=\"button\">field")
    );
    assert!(html.contains("<th scope=\"col\">field</th>"));
    for picture in [
        "histogram of differences",
        "map of differences",
        "trace and flux along Γ_C",
        "iterations",
    ] {
        assert!(
            html.contains(&format!("aria-label=\"{picture}")),
            "{picture}"
        );
    }
}

#[test]
fn the_default_report_at_n_64_is_below_5_megabytes() {
    let folder = folder();
    let words = [
        "verify",
        "--engines",
        "rust,freefem",
        "--n",
        "64",
        "--methods",
        "cr,p2",
        "--report",
        "out",
        "--quiet",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let bytes = fs::metadata(folder.path().join("out/index.html"))
        .unwrap()
        .len();
    // Three engines make three times as many pairs.
    assert!(3 * bytes < 5_000_000, "{bytes}");
    let dom = in_browser(&folder.path().join("out/index.html"));
    assert!(dom.contains("id=\"verdict\">agree<"));
}

#[test]
fn solid_scenes_show_the_contact_surface() {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", GAMMA.0, GAMMA.1);
    let engines = format!("rust,{engine}");
    let words = [
        "verify",
        "one-zone-3d",
        "--engines",
        &engines,
        "--n",
        "3",
        "--methods",
        "cr",
        "--report",
        "out",
    ];
    assert_eq!(run(folder.path(), &words).code, Some(1));
    let html = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    assert!(html.contains("The faces of Γ_C by |a-b|") && html.contains("class=\"map filled\""));
}

#[test]
fn junit_json_and_badge_are_valid_for_every_verdict() {
    let folder = folder();
    let out = |name: &str| folder.path().join(name);
    let outputs = [
        "--n",
        "4",
        "--methods",
        "cr",
        "--json",
        "o.json",
        "--junit",
        "o.xml",
        "--badge",
        "o.svg",
        "--quiet",
    ];
    let valid = || {
        assert_valid("xsd", "tests/junit.xsd", &out("o.xml"));
        assert_valid("json", "src/report/schema/verify-1.json", &out("o.json"));
    };
    let all = [
        &["verify", "one-zone", "--engines", "rust,freefem"],
        &outputs[..],
    ]
    .concat();
    assert_eq!(run(folder.path(), &all).code, Some(0));
    valid();
    let xml = fs::read_to_string(out("o.xml")).unwrap();
    // Two engines, four fields of one pair.
    assert!(
        xml.contains("tests=\"6\" failures=\"0\" errors=\"0\""),
        "{xml}"
    );
    assert!(
        fs::read_to_string(out("o.svg"))
            .unwrap()
            .contains(">agree<")
    );

    assert_eq!(
        with_fault(
            folder.path(),
            GAMMA.0,
            GAMMA.1,
            &[&outputs[..], &["--diagnose"]].concat()
        )
        .code,
        Some(1)
    );
    valid();
    let xml = fs::read_to_string(out("o.xml")).unwrap();
    assert!(
        xml.contains("<failure type=\"disagree\"")
            && xml.contains("name=\"freefem – changed: mean\""),
        "{xml}"
    );
    assert!(
        fs::read_to_string(out("o.svg"))
            .unwrap()
            .contains(">disagree<")
    );

    // An engine that fails, and a run that never began.
    let ran = with_fault(
        folder.path(),
        "if (cases < 1) fail(",
        "exit(7); if (cases < 1) fail(",
        &outputs,
    );
    assert_eq!(ran.code, Some(2));
    valid();
    let xml = fs::read_to_string(out("o.xml")).unwrap();
    assert!(
        xml.contains("<error type=\"undetermined\"")
            && xml.contains("classname=\"engines\" name=\"changed\""),
        "{xml}"
    );
    assert_eq!(
        run(folder.path(), &["verify", "no-scene", "--junit", "o.xml"]).code,
        Some(2)
    );
    assert_valid("xsd", "tests/junit.xsd", &out("o.xml"));
    assert!(
        fs::read_to_string(out("o.xml"))
            .unwrap()
            .contains("there is no scene")
    );
}

#[test]
fn an_engine_that_was_left_out_is_an_error_of_the_pipeline() {
    let folder = folder();
    fs::write(
        folder.path().join("mine.toml"),
        "name = \"mine\"\ncommand = [\"none-such\"]\n",
    )
    .unwrap();
    let mut command = faceoff(folder.path());
    command
        .args([
            "verify",
            "one-zone",
            "--engines",
            "rust,freefem",
            "--n",
            "4",
            "--allow-missing",
            "--junit",
            "o.xml",
        ])
        .env("PATH", folder.path());
    assert_eq!(told(command.output().unwrap()).code, Some(2));
    let xml = fs::read_to_string(folder.path().join("o.xml")).unwrap();
    assert!(xml.contains("<error") && !xml.contains("<skipped"), "{xml}");
}

#[test]
fn annotations_are_made_where_the_environment_says_so() {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", GAMMA.0, GAMMA.1);
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
            "--methods",
            "cr",
            "--report",
            "out",
            "--quiet",
        ])
        .env("GITHUB_ACTIONS", "true")
        .env("GITHUB_STEP_SUMMARY", folder.path().join("summary.md"))
        .env("GITLAB_CI", "true")
        .env("CI_JOB_URL", "https://ci.example/jobs/1");
    let ran = told(command.output().unwrap());
    assert_eq!(ran.code, Some(1));
    assert!(
        ran.stdout
            .starts_with("::error title=one-zone%2C cr%2C n = 4%3A"),
        "{}",
        ran.stdout
    );
    let summary = fs::read_to_string(folder.path().join("summary.md")).unwrap();
    assert!(summary.starts_with("### faceoff: disagree"), "{summary}");
    let links = fs::read_to_string(folder.path().join("out/gitlab-annotations.json")).unwrap();
    assert!(
        links.contains("https://ci.example/jobs/1/artifacts/file/out/index.html"),
        "{links}"
    );
}

#[test]
fn the_ingredient_that_differs_is_named() {
    for (name, from, to) in [
        ("γ = γ₀ h", GAMMA.0, GAMMA.1),
        (
            "the quadrature of the load",
            "int cellOrder = findCellOrder()",
            "int cellOrder = 3",
        ),
        (
            "the quadrature on Γ_C",
            "faceOrder = findFaceOrder()",
            "faceOrder = 3",
        ),
    ] {
        let folder = folder();
        let words = ["--n", "10", "--methods", "cr", "--diagnose", "--json", "-"];
        let ran = with_fault(folder.path(), from, to, &words);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        let outcome = ran.json();
        let diagnoses = outcome["diagnoses"].as_array().unwrap();
        assert_eq!(diagnoses.len(), 2, "two pairs disagree");
        for found in diagnoses {
            let ingredients = found["ingredients"].as_array().unwrap();
            let accounts = ingredients.iter().filter(|i| i["accounts"] == true);
            let named: Vec<&str> = accounts
                .map(|i| i["ingredient"].as_str().unwrap())
                .collect();
            assert!(
                !named.is_empty() && named.iter().all(|n| *n == name),
                "{name}: {found:#}"
            );
        }
    }
    // A sign is no ingredient, and none is blamed for it.
    let folder = folder();
    let (from, to) = (
        "* contactTest(v) - flux(u)*v)",
        "* contactTest(v) + flux(u)*v)",
    );
    let words = ["--n", "8", "--methods", "cr", "--diagnose", "--json", "-"];
    let outcome = with_fault(folder.path(), from, to, &words).json();
    let ingredients = outcome["diagnoses"][0]["ingredients"].as_array().unwrap();
    assert!(
        ingredients.iter().all(|i| i["accounts"] == false),
        "{ingredients:#?}"
    );
}

#[test]
fn a_baseline_stands_in_for_engines_that_are_not_there() {
    let folder = folder();
    let baseline = source("tests/baseline");
    let against = |words: &[&str]| {
        let mut command = faceoff(folder.path());
        command
            .args(["verify", "--against"])
            .arg(&baseline)
            .args(words)
            .env("PATH", folder.path());
        told(command.output().unwrap())
    };
    let ran = against(&["one-zone", "--n", "4", "--json", "-"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let outcome = ran.json();
    let engines: Vec<&str> = outcome["cases"][0]["engines"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| e["engine"].as_str().unwrap())
        .collect();
    assert_eq!(
        engines,
        ["rust", "freefem (recorded)", "fenicsx (recorded)"]
    );

    // What was not recorded, or otherwise, is refused in words.
    let changed = common::scene(
        folder.path(),
        "one-zone",
        "[data]",
        "[method]\ngamma0 = 10\n\n[data]",
    );
    for (words, part) in [
        (
            &["one-zone", "--n", "8"][..],
            "the baseline does not hold one-zone, cr, n = 8",
        ),
        (
            &["one-zone", "--n", "4", "--methods", "p1"],
            "does not hold one-zone, p1",
        ),
        (&[&changed, "--n", "4"], "gamma0 was 100.0 and is 10.0"),
        (
            &["one-zone", "--n", "4", "--tolerance", "1e-8"],
            "increment was 1e-12 and is 1e-8",
        ),
        (
            &["one-zone", "--n", "4", "--max-iterations", "7"],
            "max_iterations was 50 and is 7",
        ),
    ] {
        let ran = against(words);
        assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
        assert!(
            ran.stderr
                .contains("record it again: faceoff verify one-zone"),
            "{}",
            ran.stderr
        );
    }

    // So is what was changed since: a value, a length, the mesh's digest.
    let copy = folder.path().join("copy");
    fs::create_dir(&copy).unwrap();
    let whole = |name: &str| fs::read(baseline.join(name)).unwrap();
    for entry in fs::read_dir(&baseline).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        fs::write(copy.join(&name), whole(&name)).unwrap();
    }
    let judge = || {
        run(
            folder.path(),
            &[
                "verify",
                "one-zone",
                "--n",
                "4",
                "--against",
                "copy",
                "--methods",
                "cr",
            ],
        )
    };
    assert_eq!(judge().code, Some(0));
    let dofs = "case-0.freefem.f64";
    let mut bytes = whole(dofs);
    bytes[9] ^= 1;
    fs::write(copy.join(dofs), &bytes).unwrap();
    let ran = judge();
    assert!(
        ran.code == Some(2) && ran.stderr.contains("has changed since it was recorded"),
        "{}",
        ran.stderr
    );
    fs::write(copy.join(dofs), &bytes[..bytes.len() - 8]).unwrap();
    let ran = judge();
    assert!(
        ran.code == Some(2) && ran.stderr.contains("bytes, and"),
        "{}",
        ran.stderr
    );
    fs::write(copy.join(dofs), whole(dofs)).unwrap();
    let text = String::from_utf8(whole("baseline.json")).unwrap();
    let at = text.find("\"mesh digest\": \"").unwrap() + 16;
    let wrong = format!("{}0000{}", &text[..at], &text[at + 4..]);
    fs::write(copy.join("baseline.json"), wrong).unwrap();
    let ran = judge();
    assert!(
        ran.code == Some(2) && ran.stderr.contains("mesh digest was"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_baseline_is_recorded_only_where_all_agree_and_nothing_is_overwritten() {
    let folder = folder();
    let record = |engines: &str, into: &str| {
        let words = [
            "verify",
            "one-zone",
            "--n",
            "4",
            "--methods",
            "cr",
            "--engines",
            engines,
            "--record",
            into,
            "--quiet",
        ];
        run(folder.path(), &words)
    };
    assert_eq!(record("rust,freefem", "kept").code, Some(0));
    let names = || {
        let entries = fs::read_dir(folder.path().join("kept")).unwrap();
        let mut names: Vec<_> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    assert_eq!(names(), ["baseline.json", "case-0.freefem.f64"]);
    assert_eq!(
        record("rust,freefem", "kept").code,
        Some(0),
        "a baseline may replace a baseline"
    );
    common::write(folder.path(), "mine/notes.txt", "my work");
    assert_eq!(record("rust,freefem", "mine").code, Some(2));
    let engine = changed_companion(folder.path(), "freefem", GAMMA.0, GAMMA.1);
    let ran = record(&format!("rust,{engine}"), "other");
    assert!(
        ran.code == Some(2) && ran.stderr.contains("the codes do not agree"),
        "{}",
        ran.stderr
    );
    assert!(!folder.path().join("other").exists());
}
