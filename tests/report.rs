//! What people look at and what pipelines read: the page in a real browser, JUnit and JSON against their schemas.
//!
//! `tests/run` installs Chromium and makes the Python with jsonschema and lxml.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

use crate::common::{
    Ran, assert_valid, changed_companion, faceoff, folder, run, source, times, told,
};

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

/// One Chromium for all looks, which ends with the tests: to start one takes longer than a look.
static BROWSER: Mutex<Option<Browser>> = Mutex::new(None);

struct Browser {
    process: Child,
    told: BufReader<ChildStdout>,
}

impl Browser {
    fn start() -> Self {
        let mut python = Command::new("/usr/bin/python3");
        python.arg(source("tests/browser.py")).arg("-");
        python.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = python.spawn().expect("python3 is there");
        Browser {
            told: BufReader::new(process.stdout.take().expect("a pipe")),
            process,
        }
    }

    /// None where it ended.
    fn look(&mut self, words: &[&str]) -> Option<Value> {
        writeln!(self.process.stdin.as_mut()?, "{}", json!(words)).ok()?;
        let mut line = String::new();
        self.told.read_line(&mut line).ok()?;
        serde_json::from_str(&line).ok()
    }
}

/// What Chromium makes of the page, which must have no error and ask for nothing but itself.
fn in_browser(page: &Path, words: &[&str]) -> Value {
    let page_word = page.to_str().expect("plain letters");
    let mut browser = BROWSER.lock().unwrap_or_else(PoisonError::into_inner);
    let seen = browser
        .get_or_insert_with(Browser::start)
        .look(&[&[page_word], words].concat());
    if seen.is_none() {
        *browser = None;
    }
    drop(browser);
    let seen =
        seen.unwrap_or_else(|| panic!("{page_word}: no look at it: apt-get install chromium?"));
    assert_eq!(seen["console"], json!([]));
    let asked = seen["requests"].as_array().unwrap().iter();
    let asked: Vec<&str> = asked.map(|url| url.as_str().unwrap()).collect();
    let asked: Vec<&str> = asked
        .into_iter()
        .filter(|u| !u.starts_with("data:"))
        .collect();
    assert_eq!(asked, [format!("file://{}", page.display())]);
    seen
}

/// Is there something of this role and name for those who do not see the page?
fn is_told(seen: &Value, role: &str, name: &str) -> bool {
    let tree = seen["tree"].as_array().unwrap();
    tree.iter()
        .any(|node| node[0] == role && node[1].as_str().is_some_and(|n| n.contains(name)))
}

/// Left, top, right and bottom of all that a selector finds.
fn boxes(seen: &Value, selector: &str) -> Vec<[f64; 4]> {
    let found = seen["boxes"][selector].as_array().unwrap();
    let number = |of: &Value, k: usize| of[k].as_f64().unwrap();
    let all = found.iter().map(|of| [0, 1, 2, 3].map(|k| number(of, k)));
    all.collect()
}

/// A page fits into so many pixels, and its parts into it.
fn fits(seen: &Value, width: f64) -> bool {
    seen["size"]["width"].as_f64().unwrap() <= width
}

fn height(seen: &Value) -> f64 {
    seen["size"]["height"].as_f64().unwrap()
}

/// What stands between two marks in a page.
fn between<'a>(html: &'a str, from: &str, to: &str) -> &'a str {
    let start = html.find(from).unwrap_or_else(|| panic!("no {from}"));
    let end = html[start..].find(to).unwrap_or_else(|| panic!("no {to}"));
    &html[start..start + end]
}

/// The shapes of a map by the step of their colour; the tolerance is at [`TOLERANCE`].
fn shapes(picture: &str) -> Vec<(usize, usize)> {
    let paths = picture.split("<path class=\"k").skip(1);
    let of = |path: &str| {
        let (step, rest) = path.split_once('"').unwrap();
        let rest = rest.split("/>").next().unwrap();
        (step.parse().unwrap(), rest.matches('M').count())
    };
    paths.map(of).collect()
}

const TOLERANCE: usize = 20;

/// A code with a fault at one place, told by the first page that a stranger sees.
#[test]
fn a_stranger_finds_code_row_size_and_cause_on_the_first_screen() {
    let folder = folder();
    let (from, to) = GAMMA;
    let words = [
        "--n",
        "10",
        "--methods",
        "cr,p2",
        "--report",
        "out",
        "--json",
        "-",
    ];
    let ran = with_fault(folder.path(), from, to, &words);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let found = ran.json();
    let findings = &found["cases"][0]["engines"][2]["findings"];
    let (failing, rows) = (
        findings["failing"].as_u64().unwrap(),
        findings["rows"].as_u64().unwrap(),
    );
    let page = folder.path().join("out/index.html");
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.len() < 1_000_000, "{}", html.len());
    // Nothing in it leads outside.
    assert_eq!(
        html.matches("http").count(),
        html.matches("http-equiv").count()
    );
    let shown = &html[..html.find("<script").unwrap()];
    assert!(!shown.contains("NaN") && !shown.contains("0.0e0"));

    let first = ["#verdict", ".lede", ".next li", ".mark circle"];
    let words = [&["--size", "1280x900", "--boxes"][..], &first].concat();
    let seen = in_browser(&page, &words);
    for part in [
        "<em>changed:</em> γ is too large by 1.0 · 10⁻⁶ of itself on all contact faces",
        &format!("It fails <b>{failing} of {rows} equations</b> of one-zone, cr, n = 10"),
        "rust and freefem solve both cases to rounding",
        "Look where changed makes or reads <b>γ</b>",
    ] {
        let told = html.replace('\u{202f}', " ");
        assert!(
            told.contains(part),
            "{part}: {}",
            &told[told.find("<main").unwrap()..][..3000]
        );
    }
    for (selector, least) in first.into_iter().zip([1, 1, 3, 1]) {
        let found = boxes(&seen, selector);
        assert!(found.len() >= least, "{selector}: {found:?}");
        let inside = |b: &[f64; 4]| b[0] >= 0.0 && b[1] >= 0.0 && b[2] <= 1280.0;
        assert!(
            found.iter().all(inside) && found[0][3] <= 900.0,
            "{selector}: {found:?}"
        );
    }
    for (role, name) in [
        ("status", "verdict: disagree"),
        ("image", "residual of changed, one-zone, cr, n = 10"),
        ("image", "the worst row of changed"),
        ("image", "map of differences"),
        ("image", "u, contact, γ, residual and difference along Γ_C"),
        ("image", "iterations"),
        ("columnheader", "largest |a − b|"),
    ] {
        assert!(
            is_told(&seen, role, name),
            "{role} {name}: {}",
            seen["tree"]
        );
    }
    assert!(!is_told(&seen, "status", "verdict: agree"));

    // As many kites are warm as rows fail, and all others are cold.
    let map = shapes(between(&html, "aria-label=\"residual of changed", "</svg>"));
    let warm = map
        .iter()
        .filter(|(step, _)| *step >= TOLERANCE)
        .map(|(_, n)| n)
        .sum::<usize>();
    let all = map.iter().map(|(_, n)| n).sum::<usize>();
    assert_eq!((warm as u64, all as u64), (failing, rows));
    // Only the code at fault is red.
    let codes = between(&html, "One row per code", "One row per case");
    let rows: Vec<&str> = codes.split("<tr").skip(2).collect();
    let red: Vec<bool> = rows.iter().map(|row| row.contains("\"bd\"")).collect();
    assert_eq!(red, [false, false, true], "{codes}");
    let provenance = between(&html, "Provenance, one-zone, cr, n = 10", "</dl>");
    for part in [
        "rust 0.",
        "freefem 4.",
        "200 cells, 320 faces, 10 of them contact, 320 dofs; digest ",
        "100 h, h the diameter of the cell behind",
        "radon-7 for the load, gauss-5 on Γ<sub>C</sub>",
        "f = -2*pi*sin(2*pi*x)",
        "at most 10⁻¹², or 50 steps",
        "u = 0, and g on Γ<sub>D</sub>",
    ] {
        assert!(provenance.contains(part), "{part}: {provenance}");
    }

    // Without scripts all of it is there, in print what is folded up as well, and in the dark.
    let closed = "details:not([open]) table";
    let seen = in_browser(&page, &["--no-script", "--boxes", closed]);
    assert!(!seen["dom"].as_str().unwrap().contains("<button"));
    assert!(is_told(&seen, "status", "verdict: disagree"));
    let folded = boxes(&seen, closed).len();
    let seen = in_browser(&page, &["--media", "print", "--boxes", closed]);
    assert!(boxes(&seen, closed).len() > folded, "{folded}");
    let seen = in_browser(&page, &["--dark", "--size", "700x900"]);
    assert!(is_told(&seen, "status", "verdict: disagree"));
    assert!(fits(&seen, 700.0), "it fits");
}

/// The numbers by which a column of the table behind a heading is sorted, from top to bottom.
fn column(seen: &Value, heading: &str, column: usize) -> Vec<f64> {
    let dom = seen["dom"].as_str().unwrap();
    let table = between(&dom[dom.find(heading).unwrap()..], "<tbody", "</tbody>");
    let rows = table.split("<tr").skip(1);
    let cell = |row: &str| {
        let cell = row
            .split("<td")
            .nth(column)
            .unwrap()
            .split('>')
            .next()
            .unwrap();
        let value = cell.split("data-v=\"").nth(1).unwrap();
        value.split('"').next().unwrap().parse().unwrap()
    };
    rows.map(cell).collect()
}

#[test]
fn tables_sort_by_numbers_and_not_by_what_they_look_like() {
    let folder = folder();
    let (from, to) = GAMMA;
    let words = [
        "--n",
        "6",
        "--methods",
        "cr,p2",
        "--report",
        "out",
        "--quiet",
    ];
    assert_eq!(with_fault(folder.path(), from, to, &words).code, Some(1));
    let page = folder.path().join("out/index.html");
    // The relative differences of every field of every pair: 2.0 · 10⁻¹⁶ comes before 1.5 · 10⁻⁹, and 0 first.
    let head = ".folds details:nth-of-type(2) th:nth-child(4) button";
    let mut shown = Vec::new();
    for (pressed, order) in [(&[head][..], 1.0), (&[head, head], -1.0)] {
        let seen = in_browser(&page, &[&["--press"][..], pressed].concat());
        let values = column(&seen, "worst face", 4);
        assert_eq!(values.len(), 12);
        assert!(
            values.windows(2).all(|v| order * v[0] <= order * v[1]),
            "{values:?}"
        );
        let direction = if order > 0.0 {
            "ascending"
        } else {
            "descending"
        };
        let dom = seen["dom"].as_str().unwrap();
        assert!(dom.contains(&format!("aria-sort=\"{direction}\"")));
        let rows = between(
            &dom[dom.find("worst face").unwrap()..],
            "<tbody",
            "</tbody>",
        );
        let cells = rows
            .split("<tr")
            .skip(1)
            .map(|row| row.split("<td").nth(4).unwrap());
        shown = cells
            .map(|cell| cell[cell.find('>').unwrap()..cell.find('<').unwrap()].to_owned())
            .collect();
    }
    // By their digits they would stand in another order.
    let mut as_text = shown.clone();
    as_text.sort_by(|a, b| b.cmp(a));
    assert_ne!(shown, as_text);
}

#[test]
fn an_agreement_is_one_screen_and_a_fault_in_four_cases_three() {
    let folder = folder();
    let at = folder.path();
    let ran = run(
        at,
        &[
            "verify",
            "--engines",
            "rust,freefem,fenicsx",
            "--report",
            "agree",
            "--quiet",
        ],
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let words = [
        "three-zones",
        "--n",
        "16",
        "--methods",
        "cr,p2",
        "--report",
        "faulty",
        "--quiet",
    ];
    assert_eq!(with_fault(at, GAMMA.0, GAMMA.1, &words).code, Some(1));
    for (name, screens) in [("agree", 1.0), ("faulty", 3.0)] {
        let page = at.join(name).join("index.html");
        assert!(fs::metadata(&page).unwrap().len() < 1_000_000, "{name}");
        let seen = in_browser(&page, &["--size", "1280x900"]);
        assert!(
            fits(&seen, 1280.0) && height(&seen) <= screens * 900.0,
            "{name}: {}",
            seen["size"]
        );
        for words in [&["--size", "390x900"][..], &["--size", "390x900", "--dark"]] {
            assert!(fits(&in_browser(&page, words), 390.0), "{name} {words:?}");
        }
        // A4 without its margins.
        let seen = in_browser(&page, &["--size", "696x900", "--media", "print"]);
        assert!(fits(&seen, 696.0), "{name} in print: {}", seen["size"]);
    }
    let html = fs::read_to_string(at.join("agree/index.html")).unwrap();
    assert!(html.contains("Three codes <em>agree</em> in all 8 cases, to rounding"));
    assert!(html.contains("units of rounding</b>") && html.contains("Not checked"));
    assert!(!html.contains("What to do next"));
}

/// What a campaign found is read on any screen and on paper: only a table's own box scrolls sideways.
#[test]
fn pages_of_campaigns_fit_every_screen() {
    let folder = folder();
    let at = folder.path();
    let commands: [&[&str]; 4] = [
        &[
            "study",
            "one-zone",
            "--methods",
            "cr-fc,p2",
            "--finest",
            "8",
        ],
        &["stress", "transition-1.5", "--families", "gamma0,bodies"],
        &["orders", "one-zone"],
        &["paper", "--n", "4,8", "--fine", "8"],
    ];
    for words in commands {
        let name = words[0];
        let ran = run(at, &[words, &["--report", name, "--quiet"]].concat());
        assert_eq!(ran.code, Some(0), "{name}: {}", ran.stderr);
        let page = at.join(name).join("index.html");
        assert!(fs::metadata(&page).unwrap().len() < 1_000_000, "{name}");
        for (size, words, width) in [
            ("1280x900", &[][..], 1280.0),
            ("390x900", &["--dark"], 390.0),
            ("696x900", &["--media", "print"], 696.0),
        ] {
            let seen = in_browser(&page, &[&["--size", size][..], words].concat());
            assert!(fits(&seen, width), "{name} at {size}: {}", seen["size"]);
        }
    }
}

/// The JSON of a file, which follows the schema of its name.
fn valid_json(file: &Path, name: &str) -> Value {
    assert_valid("json", &format!("src/report/schema/{name}-1.json"), file);
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

#[test]
fn every_command_writes_a_page_and_json_that_follows_its_schema() {
    let folder = folder();
    let at = folder.path();
    crate::common::write(at, "a.csv", "vertex,u\n0,1\n");
    crate::common::write(at, "b.csv", "vertex,u\n0,2\n");
    let out = at.join("out.json");
    let commands: [(&[&str], &str, i32); 25] = [
        (
            &[
                "verify",
                "one-zone",
                "--engines",
                "rust,freefem",
                "--n",
                "4",
                "--explain",
            ],
            "verify",
            0,
        ),
        (&["compare", "a.csv", "b.csv"], "compare", 1),
        (
            &["solve", "one-zone", "--n", "4", "--certify", "--explain"],
            "solve",
            0,
        ),
        (&["solve", "one-zone-3d", "--n", "3"], "solve", 0),
        (
            &[
                "solve", "one-zone", "--n", "4", "--engine", "freefem", "--out", "u.vtu",
            ],
            "solve",
            0,
        ),
        (&["compare", "u.vtu", "u-faces.vtu"], "compare", 2),
        (&["certify", "u.vtu", "--scene", "one-zone"], "certify", 0),
        (&["certify", "u.vtu", "--scene", "plate"], "certify", 2),
        (&["judge", "u.vtu", "--scene", "one-zone"], "judge", 0),
        (
            &["judge", "u.vtu", "--scene", "one-zone", "--gamma0", "7"],
            "judge",
            1,
        ),
        (&["judge", "u.vtu", "--scene", "plate"], "judge", 2),
        (
            &["solve", "transition-1.5", "--accuracy", "0.2"],
            "solve",
            0,
        ),
        (
            &["solve", "one-zone", "--n", "4", "--max-iterations", "1"],
            "solve",
            1,
        ),
        (
            &[
                "orders",
                "transition-1.5",
                "--n",
                "4,8",
                "--methods",
                "cr,penalty",
            ],
            "orders",
            0,
        ),
        (
            &[
                "study",
                "one-zone",
                "--methods",
                "cr-fc,p2",
                "--budget",
                "5s",
                "--finest",
                "8",
            ],
            "study",
            0,
        ),
        (
            &[
                "stress",
                "transition-1.5",
                "--methods",
                "cr,p1",
                "--families",
                "gamma0,bodies",
            ],
            "stress",
            0,
        ),
        (&["paper", "--n", "4,8", "--fine", "8"], "paper", 0),
        (&["paper", "--reference"], "paper-reference", 0),
        (&["mesh", "make", "plate", "plate.msh"], "mesh-written", 0),
        (
            &["mesh", "convert", "plate.msh", "plate.vtu"],
            "mesh-written",
            0,
        ),
        (
            &["mesh", "refine", "plate.msh", "fine.mesh", "--lossy"],
            "mesh-written",
            0,
        ),
        (&["mesh", "info", "u-faces.vtu"], "mesh-info", 0),
        (&["mesh", "check", "plate.msh"], "mesh-check", 0),
        (&["engines"], "engines", 0),
        (&["engines", "check", "rust"], "engines-check", 0),
    ];
    for (k, (words, name, code)) in commands.into_iter().enumerate() {
        let report = format!("report-{k}");
        let to = ["--report", &report, "--json", "out.json", "--quiet"];
        let ran = run(at, &[words, &to].concat());
        assert_eq!(ran.code, Some(code), "{words:?}: {}", ran.stderr);
        assert_eq!(ran.stdout, "", "{words:?}");
        let found = valid_json(&out, name);
        let kept = at.join(&report);
        assert_eq!(found["error"].is_string(), code == 2, "{words:?}");
        let same = fs::read(kept.join(format!("{name}.json"))).unwrap();
        assert_eq!(serde_json::from_slice::<Value>(&same).unwrap(), found);

        let page = kept.join("index.html");
        let seen = in_browser(&page, &["--size", "390x900", "--dark"]);
        assert!(fits(&seen, 390.0), "{words:?} fits");
        assert!(is_told(&seen, "status", ""), "{words:?}");
        assert!(
            fits(&in_browser(&page, &["--size", "1280x900"]), 1280.0),
            "{words:?}"
        );
        let seen = in_browser(&page, &["--size", "696x900", "--media", "print"]);
        assert!(fits(&seen, 696.0), "{words:?} in print");
        let html = fs::read_to_string(&page).unwrap();
        assert!(
            html.contains(&format!("<code>faceoff {}", words[0])),
            "{words:?}"
        );
        let shown = &html[..html.find("<script").unwrap()];
        assert!(shown.len() < 1_000_000 && !shown.contains("NaN") && !shown.contains("0.0e0"));
        // All that it leads to is there, and all that is there is named.
        let leads = html
            .split(" href=\"")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap());
        let leads: Vec<&str> = leads.filter(|to| !to.starts_with(['#', 'd'])).collect();
        assert!(
            leads.iter().all(|name| kept.join(name).is_file()),
            "{leads:?}"
        );
        for entry in fs::read_dir(&kept).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(
                ["index.html", ".faceoff-report"].contains(&&*name)
                    || html.contains(&format!("\"{name}\"")),
                "{name}"
            );
        }
        // A second run may replace the first, which one function decides for all commands.
        if ["compare", "solve", "mesh"].contains(&words[0]) {
            assert_eq!(
                run(at, &[words, &to].concat()).code,
                Some(code),
                "{words:?}"
            );
        }
    }
}

#[test]
fn every_command_that_fails_says_so_where_its_result_was_to_be() {
    let folder = folder();
    let at = folder.path();
    let commands: [(&[&str], &str); 14] = [
        (&["verify", "no-scene"], "verify"),
        (&["compare", "none.vtu", "no.vtu"], "compare"),
        (&["solve", "no-scene"], "solve"),
        (&["orders", "no-scene"], "orders"),
        (&["study", "no-scene"], "study"),
        (&["stress", "no-scene"], "stress"),
        (&["paper", "--n", "4"], "paper"),
        (
            &["paper", "--reference", "--zones", "4000000"],
            "paper-reference",
        ),
        (&["mesh", "make", "no-scene", "a.msh"], "mesh-written"),
        (&["mesh", "convert", "none.msh", "a.msh"], "mesh-written"),
        (&["mesh", "refine", "none.msh", "a.msh"], "mesh-written"),
        (&["mesh", "info", "none.msh"], "mesh-info"),
        (&["mesh", "check", "none.msh"], "mesh-check"),
        (&["engines", "check", "no-engine"], "engines-check"),
    ];
    for (words, name) in commands {
        // What an earlier run wrote must not be taken for this one's.
        let earlier = "<title>faceoff mesh: sound</title>";
        crate::common::write(at, "report/index.html", earlier);
        crate::common::write(at, "out.json", "{}");
        let to = ["--report", "report", "--json", "out.json"];
        let ran = run(at, &[words, &to].concat());
        assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stderr);
        let found = valid_json(&at.join("out.json"), name);
        let why = found["error"].as_str().unwrap();
        assert!(ran.stderr.contains(why), "{words:?}: {}", ran.stderr);
        let html = fs::read_to_string(at.join("report/index.html")).unwrap();
        let escaped = why.replace('\'', "&#39;").replace('"', "&quot;");
        assert!(
            html.contains(&escaped) && !html.contains("sound<"),
            "{words:?}"
        );
    }
    // What is no report of ours is left alone, and the rest is told.
    crate::common::write(at, "mine/index.html", "mine");
    let words = [
        "mesh", "check", "none.msh", "--report", "mine", "--json", "out.json",
    ];
    let ran = run(at, &words);
    assert!(ran.stderr.contains("nothing was touched"), "{}", ran.stderr);
    assert!(valid_json(&at.join("out.json"), "mesh-check")["error"].is_string());
    assert_eq!(
        fs::read_to_string(at.join("mine/index.html")).unwrap(),
        "mine"
    );
}

#[test]
fn verdicts_of_stress_and_of_checks_are_junit_and_badges() {
    let folder = folder();
    let at = folder.path();
    let twice = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
                 $Elements\n2\n1 2 0 1 2 3\n2 2 0 1 2 3\n$EndElements\n";
    crate::common::write(at, "twice.msh", twice);
    let commands: [(&[&str], i32, &str, &str); 3] = [
        (
            &["mesh", "check", "twice.msh"],
            1,
            "failures=\"1\"",
            ">unsound<",
        ),
        (
            &["engines", "check", "rust"],
            0,
            "failures=\"0\"",
            ">right<",
        ),
        (
            &[
                "stress",
                "transition-1.5",
                "--methods",
                "cr",
                "--families",
                "bodies",
            ],
            0,
            "name=\"bodies ",
            ">nothing wrong<",
        ),
    ];
    for (words, code, junit, badge) in commands {
        let to = ["--junit", "o.xml", "--badge", "o.svg", "--quiet"];
        let ran = run(at, &[words, &to].concat());
        assert_eq!(ran.code, Some(code), "{words:?}: {}", ran.stderr);
        assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
        let text = |name: &str| fs::read_to_string(at.join(name)).unwrap();
        assert!(text("o.xml").contains(junit), "{}", text("o.xml"));
        assert!(text("o.svg").contains(badge), "{}", text("o.svg"));
    }
}

#[test]
fn what_is_shown_along_the_contact_side_is_of_each_code() {
    let folder = folder();
    let (from, to) = (
        "* contactTest(v) - flux(u)*v)",
        "* contactTest(v) + flux(u)*v)",
    );
    let words = [
        "--n",
        "8",
        "--methods",
        "cr",
        "--report",
        "out",
        "--json",
        "-",
    ];
    let ran = with_fault(folder.path(), from, to, &words);
    assert_eq!(ran.code, Some(1));
    let html = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    let picture = between(&html, "aria-label=\"u, contact, γ", "</svg>");
    // What is in contact by the three codes; a wrong sign moves it.
    let status = between(
        picture,
        "Contact at the 5 quadrature points",
        "Residual of the row",
    );
    let of = |class: &str| -> Vec<&str> {
        let start = format!("<path class=\"{class}\" stroke-width=\"7\" d=\"");
        let paths = status.split(&*start).skip(1);
        paths.map(|path| path.split('"').next().unwrap()).collect()
    };
    let (right, wrong) = (of("ink"), of("redl"));
    assert_eq!(right.len(), 2, "{status}");
    let across = |path: &str| {
        path.split('M')
            .skip(1)
            .map(|run| run.split(' ').next().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(across(right[0]), across(right[1]));
    assert!(status.contains(">changed</text>"), "{status}");
    assert!(wrong.iter().all(|path| across(path) != across(right[0])));
    // How many points that are is said.
    let found = ran.json();
    let pairs = found["cases"][0]["pairs"].as_array().unwrap().iter();
    let flips = pairs.filter_map(|p| p["flips"].as_u64()).max().unwrap();
    assert!(flips > 0);
    assert!(html.contains(&format!(
        "The contact status differs at up to {flips} quadrature points."
    )));
    // The difference of those that are right in ink, that of the wrong one in red.
    let differences = &picture[picture.find("|a − b| of the face means").unwrap()..];
    assert!(differences.contains("rust − freefem<") && differences.contains(">rust − changed<"));
    assert_eq!(differences.matches("class=\"redl\"").count(), 1);
    assert_eq!(differences.matches("class=\"ink\"").count(), 1);
    let newton = between(&html, "aria-label=\"iterations", "</svg>");
    assert_eq!(newton.matches("class=\"redl\"").count(), 1);
}

#[test]
fn the_default_report_at_n_64_is_below_a_megabyte() {
    let folder = folder();
    // A page of P2 is no larger, and takes FreeFEM twice as long.
    let methods = if times() > 1 { "cr,p2" } else { "cr" };
    let words = [
        "verify",
        "--engines",
        "rust,freefem",
        "--n",
        "64",
        "--methods",
        methods,
        "--report",
        "out",
        "--quiet",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let bytes = fs::metadata(folder.path().join("out/index.html"))
        .unwrap()
        .len();
    assert!(bytes < 1_000_000, "{bytes}");
    let seen = in_browser(&folder.path().join("out/index.html"), &[]);
    assert!(is_told(&seen, "status", "verdict: agree"));
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
    assert!(
        html.contains("from outside, x to the left, y upwards"),
        "seen from below"
    );
    // Two triangles on each of 3 × 3 squares.
    for label in ["residual of changed on Γ_C", "map of differences"] {
        let map = shapes(between(&html, &format!("aria-label=\"{label}"), "</svg>"));
        assert_eq!(map.iter().map(|(_, n)| n).sum::<usize>(), 18, "{label}");
        assert!(map.iter().any(|(step, _)| *step >= TOLERANCE), "{label}");
    }
    let first = ["#verdict", ".lede", ".mark circle"];
    let words = [&["--size", "1280x900", "--boxes"][..], &first].concat();
    let seen = in_browser(&folder.path().join("out/index.html"), &words);
    assert!(is_told(&seen, "status", "verdict: disagree"));
    assert!(is_told(&seen, "image", "residual of changed from the side"));
    for selector in first {
        let found = boxes(&seen, selector);
        assert!(
            !found.is_empty() && found[0][3] <= 900.0,
            "{selector}: {found:?}"
        );
    }
}

#[test]
fn junit_json_and_badge_are_valid_for_every_verdict() {
    let folder = folder();
    let out = |name: &str| folder.path().join(name);
    let text = |name: &str| fs::read_to_string(out(name)).unwrap();
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
    assert!(text("o.svg").contains(">undetermined<"));
    let never = [&["verify", "no-scene"], &outputs[..]].concat();
    fs::write(out("o.svg"), "agree").unwrap();
    assert_eq!(run(folder.path(), &never).code, Some(2));
    valid();
    assert!(text("o.xml").contains("there is no scene"));
    assert!(text("o.json").contains("there is no scene"));
    assert!(text("o.svg").contains(">undetermined<"));
}

#[test]
fn an_engine_that_was_left_out_is_an_error_of_the_pipeline() {
    let folder = folder();
    let case = ["verify", "one-zone", "--n", "4", "--methods", "cr"];
    let engines = ["--engines", "rust,freefem"];
    let left_out = ["--allow-missing", "--junit", "o.xml", "--report", "out"];
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let without_freefem = |words: &[&str], baseline: bool| {
        let mut command = faceoff(folder.path());
        command.args(case).args(engines).args(words);
        if baseline {
            command.arg("--against").arg(source("tests/baseline"));
        }
        command.env("GITHUB_ACTIONS", "true");
        told(command.env("PATH", folder.path()).output().unwrap())
    };

    // Rust agrees with what was recorded; the pipeline learns that FreeFEM itself was not asked.
    let ran = without_freefem(&left_out, true);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(
        ran.stderr
            .contains("engine freefem is missing and left out")
    );
    let note = "::error title=no answer from freefem::engine freefem is missing";
    assert!(ran.stdout.contains(note), "{}", ran.stdout);
    // Three answers, four fields of three pairs, and the one that is not there.
    let xml = text("o.xml");
    let counts = "tests=\"16\" failures=\"0\" errors=\"1\"";
    assert!(xml.contains(counts), "{xml}");
    let error = xml.split("classname=\"engines\" name=\"freefem\"").nth(1);
    assert!(error.unwrap().contains("<error type=\"undetermined\""));
    assert!(!xml.contains("<skipped"), "{xml}");
    assert_valid("xsd", "tests/junit.xsd", &folder.path().join("o.xml"));
    let page = text("out/index.html");
    assert!(page.contains("engine freefem is missing and was left out."));
    // Without leave it is no verdict.
    assert_eq!(without_freefem(&[], true).code, Some(2));

    // One code alone is none either.
    assert_eq!(without_freefem(&left_out, false).code, Some(2));
    let xml = text("o.xml");
    assert!(xml.contains("<error") && !xml.contains("<skipped"), "{xml}");
}

#[test]
fn annotations_are_made_where_the_environment_says_so() {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", GAMMA.0, GAMMA.1);
    let engines = format!("rust,{engine}");
    let on_server = |words: &[&str]| {
        let mut command = faceoff(folder.path());
        command
            .args(words)
            .env("GITHUB_ACTIONS", "true")
            .env("GITHUB_STEP_SUMMARY", folder.path().join("summary.md"))
            .env("GITLAB_CI", "true")
            .env("CI_JOB_URL", "https://ci.example/jobs/1");
        told(command.output().unwrap())
    };
    let case = ["one-zone", "--n", "4", "--methods", "cr"];
    let pair = ["--engines", &engines, "--report", "out", "--quiet"];
    let ran = on_server(&[&["verify"][..], &case, &pair].concat());
    assert_eq!(ran.code, Some(1));
    let lines: Vec<&str> = ran.stdout.lines().collect();
    let about = "::error title=one-zone%2C cr%2C n = 4%3A";
    assert_eq!(
        lines[0].split("::").nth(1).unwrap(),
        format!("{} changed does not solve the scheme", &about[2..])
    );
    let mean = lines
        .iter()
        .find(|l| l.starts_with(&format!("{about} rust – changed%3A mean::")));
    let mean = mean.unwrap_or_else(|| panic!("{}", ran.stdout));
    assert!(mean.contains(" beyond 1e-12: |a-b| up to ") && mean.contains("worst at ["));
    let summary = fs::read_to_string(folder.path().join("summary.md")).unwrap();
    assert!(summary.starts_with("### faceoff: disagree"), "{summary}");
    assert!(summary.contains("| one-zone, cr, n = 4: rust – changed: mean | "));

    // With the result itself on standard output, what agrees, and what was not judged.
    let json = ["--engines", &engines, "--json", "-"];
    let ran = on_server(&[&["verify"][..], &case, &json].concat());
    assert_eq!(ran.json()["verdict"], "disagree");
    assert!(
        ran.stderr
            .contains(&format!("{about} rust – changed%3A mean::"))
    );
    let honest = ["--engines", "rust,freefem", "--quiet"];
    let ran = on_server(&[&["verify"][..], &case, &honest].concat());
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(0), ""));
    let summary = fs::read_to_string(folder.path().join("summary.md")).unwrap();
    assert!(summary.ends_with("### faceoff: agree\n\n"), "{summary}");
    assert!(
        summary.starts_with("### faceoff: disagree"),
        "added to, not replaced"
    );
    let ran = on_server(&["verify", "no-scene"]);
    let failed = "::error title=verify could not be judged::there is no scene";
    assert!(
        ran.code == Some(2) && ran.stdout.starts_with(failed),
        "{}",
        ran.stdout
    );
    crate::common::write(folder.path(), "a.csv", "vertex,u\n0,1\n");
    crate::common::write(folder.path(), "b.csv", "vertex,u\n0,2\n");
    let ran = on_server(&["compare", "a.csv", "b.csv", "--quiet"]);
    let differs = "::error title=a.csv – b.csv%3A u::1 of 1 beyond 1e-9";
    assert!(
        ran.code == Some(1) && ran.stdout.starts_with(differs),
        "{}",
        ran.stdout
    );
    let ran = on_server(&["compare", "a.csv", "none.csv"]);
    assert!(
        ran.code == Some(2)
            && ran
                .stdout
                .starts_with("::error title=a.csv – none.csv could")
    );
    let links = fs::read_to_string(folder.path().join("out/gitlab-annotations.json")).unwrap();
    assert!(
        links.contains("https://ci.example/jobs/1/artifacts/file/out/index.html"),
        "{links}"
    );
}

/// A sign is no ingredient, and none is blamed for it.
#[test]
fn what_nothing_explains_is_not_explained() {
    let folder = folder();
    let (from, to) = (
        "* contactTest(v) - flux(u)*v)",
        "* contactTest(v) + flux(u)*v)",
    );
    let words = ["--n", "8", "--methods", "cr", "--diagnose", "--json", "-"];
    let outcome = with_fault(folder.path(), from, to, &words).json();
    let found = &outcome["cases"][0]["engines"][2]["findings"];
    let explanations = found["explanations"].as_array().unwrap();
    assert!(
        explanations.iter().all(|e| e["accounts"] == false),
        "{explanations:#?}"
    );
    // But the terms that may be wrong are.
    let terms = found["terms"].as_array().unwrap().iter();
    let suspects = terms
        .filter(|t| t["suspect"] == true)
        .map(|t| t["term"].as_str().unwrap());
    assert_eq!(suspects.collect::<Vec<_>>(), ["consistency", "contact"]);
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

    // Another version of an engine is judged against what the recorded one answered.
    let version = |engine: &str| {
        let words = [
            "verify",
            "one-zone",
            "--n",
            "4",
            "--methods",
            "cr",
            "--engines",
            engine,
            "--against",
        ];
        let kept = baseline.to_string_lossy();
        run(folder.path(), &[&words[..], &[&*kept]].concat()).code
    };
    assert_eq!(version("freefem"), Some(0));
    let newer = changed_companion(folder.path(), "freefem", GAMMA.0, GAMMA.1);
    assert_eq!(version(&newer), Some(1));

    // What was not recorded, or otherwise, is refused in words.
    let changed = crate::common::scene(
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
    let copy = folder.path().join("kept");
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
                "kept",
                "--methods",
                "cr",
            ],
        )
    };
    assert_eq!(judge().code, Some(0));
    let text = String::from_utf8(whole("baseline.json")).unwrap();
    let at = text.find("\"dofs\": \"").unwrap() + 9;
    for damage in ["", "AAAAAAAA"] {
        let damaged = format!("{}{damage}{}", &text[..at], &text[at + 8..]);
        fs::write(copy.join("baseline.json"), damaged).unwrap();
        let ran = judge();
        let refused = "its dofs have changed since they were kept";
        assert!(
            ran.code == Some(2) && ran.stderr.contains(refused),
            "{}",
            ran.stderr
        );
    }
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
    assert_eq!(names(), ["baseline.json"]);
    assert_eq!(
        record("rust,freefem", "kept").code,
        Some(0),
        "a baseline may replace a baseline"
    );
    crate::common::write(folder.path(), "mine/notes.txt", "my work");
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
