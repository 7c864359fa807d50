//! `faceoff paper` and `faceoff orders` as a user runs them.

use std::fs;
use std::path::Path;

use crate::common::{faceoff, folder, interrupt, run, times, told, write};
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

#[test]
fn the_mesh_free_references_are_told() {
    let folder = folder();
    let words = ["paper", "--reference", "--zones", "7,3", "--json", "-"];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let all = ran.json();
    let names: Vec<&str> = all
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    assert_eq!(
        names,
        [
            "faceoff",
            "five-zones",
            "one-zone",
            "schema",
            "three-zones",
            "zones-3",
            "zones-7"
        ]
    );
    for (name, zones) in [
        ("one-zone", 1),
        ("three-zones", 4),
        ("five-zones", 6),
        ("zones-7", 8),
    ] {
        let known = &all[name];
        let mut keys: Vec<&str> = known
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        keys.sort_unstable();
        assert_eq!(
            keys,
            [
                "contact_flux",
                "contact_set",
                "grad_norm_sq",
                "l2_norm",
                "samples"
            ]
        );
        assert_eq!(
            known["contact_set"].as_array().unwrap().len(),
            zones,
            "{name}"
        );
        let samples = known["samples"].as_array().unwrap();
        assert!(samples.len() > 100);
        for sample in samples {
            let [x, y, u] = ["x", "y", "u"].map(|key| number(&sample[key]));
            assert!(x.is_finite() && u.is_finite());
            assert!(y != 1.0 || u.abs() < 1e-12, "{name}: u({x}, 1) = {u}");
            assert!(y != 0.0 || u < 1e-12, "{name}: u({x}, 0) = {u}");
        }
    }
    assert_eq!(all["zones-3"], all["three-zones"]);
    // From a program of another hand (cosine series, collocation).
    let one = &all["one-zone"];
    for (found, known) in [
        (&one["contact_set"][0][0], 0.697_679_979_121_5),
        (&one["contact_set"][0][1], 1.0),
        (&one["grad_norm_sq"], 0.923_508_077_876),
        (&one["l2_norm"], 0.288_438_344_507),
        (&one["contact_flux"], -0.265_830_951_984),
    ] {
        assert!((number(found) - known).abs() < 1e-11, "{found} {known}");
    }
    let shown = run(folder.path(), &["paper", "--reference"]);
    assert!(shown.stdout.contains("0.6976799791215"), "{}", shown.stdout);
}

/// The order of all errors of a series, and that they are within `room` of what the paper says.
fn check_orders(example: &Value, room: f64) {
    for series in example["series"].as_array().unwrap() {
        let fit = |key: &str| number(&series[key]["fit"]);
        for key in ["h1", "h1_to_fine"] {
            assert!((fit(key) - 1.0).abs() < room, "{key}: {series}");
        }
        for key in ["l2", "l2_to_fine"] {
            assert!((fit(key) - 2.0).abs() < room, "{key}: {series}");
        }
        assert!(fit("residual") > 1.4, "{series}");
    }
}

#[test]
fn section_6_again() {
    let folder = folder();
    // The paper's meshes with `tests/run --all`; without the finest, a third of the time.
    let n = [16, 32, 64];
    let n = &n[..if times() > 1 { 3 } else { 2 }];
    let levels: Vec<String> = n.iter().map(u32::to_string).collect();
    let levels = levels.join(",");
    let words = [
        "paper", "--n", &levels, "--fine", "128", "--report", "out", "--json", "-",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let outcome = ran.json();
    let examples = outcome["examples"].as_array().unwrap();
    assert_eq!(examples.len(), 3);
    for example in examples {
        // For N = 5 a cell of n = 16 is a third of a wave.
        check_orders(
            example,
            if example["zones"].is_null() {
                0.1
            } else {
                0.15
            },
        );
        let fine = &example["fine"];
        let error = number(&fine["errors"][2]["h1"]);
        let [low, high] = [0, 1].map(|k| number(&fine["predicted"][k]));
        assert!(low / 2.0 < error && error < 1.2 * high, "{fine}");
    }
    let statements = outcome["statements"].as_array().unwrap();
    let of = |words: &str| {
        let said = |s: &&Value| s["says"].as_str().unwrap().contains(words);
        statements.iter().find(said).unwrap()
    };
    let half = of("one half of the side");
    assert_eq!(half["holds"], false);
    assert!(
        half["found"].as_str().unwrap().contains("30.23 %"),
        "{half}"
    );
    assert_eq!(of("4 points")["holds"], false);
    assert_eq!(of("in 1 point")["holds"], true);
    // Another on each of the two Union-Jack meshes, and the paper does not say which: nothing is claimed.
    let close = of("close to 3/2");
    assert!(close["holds"].is_null(), "{close}");
    let variants = examples[0]["variants"].as_array().unwrap();
    let fits = |mesh: &str| {
        let of_mesh = variants.iter().filter(|v| v["mesh"] == mesh);
        let of_cr = of_mesh.filter(|v| v["method"] == "cr");
        of_cr
            .map(|v| number(&v["residual"]["fit"]))
            .collect::<Vec<_>>()
    };
    assert_eq!(fits("union-jack").len(), 4);
    assert!(fits("union-jack").iter().all(|fit| *fit > 1.9));
    assert!(fits("exchanged").iter().all(|fit| *fit < 1.7));
    assert!(
        variants
            .iter()
            .all(|v| (number(&v["h1"]["fit"]) - 1.0).abs() < 0.1),
        "{variants:?}"
    );
    check_counts(&outcome, n);
    let theory = &outcome["theory"];
    assert_eq!(theory["load_has_trace"], true);
    for of_mesh in theory["meshes"].as_array().unwrap() {
        // Corners of half a square over F: C² = √2/96, and |F|/24 < γ = γ₀ √2 |F| bounds what gauss-5 needs from below.
        let lifting = number(&of_mesh["lifting"]["constant"]);
        assert!((lifting - (2.0_f64.sqrt() / 96.0).sqrt()).abs() < 1e-9);
        assert!(number(&of_mesh["positivity"]["constant"]) > 0.9);
        let [least, unique] = [
            &of_mesh["positivity"]["least_gamma0"],
            &of_mesh["unique_above"],
        ];
        assert!(number(least) > 0.001 && number(least) <= number(unique) && number(unique) < 0.1);
    }

    let out = folder.path().join("out");
    let kept: Value = serde_json::from_slice(&fs::read(out.join("paper.json")).unwrap()).unwrap();
    assert_eq!(kept, outcome);
    let text = fs::read_to_string(out.join("index.html")).unwrap();
    for part in [
        "<h2>6.1: f",
        "<h2>6.2, N = 5: f",
        ">79<",
        "30.23 %",
        "figure-2.svg",
        "not stated",
    ] {
        assert!(text.contains(part), "{part}");
    }
    check_figures(&out, n.len());

    // An earlier report is replaced, and nothing is left beside it.
    let again = [
        "paper", "--n", "4,8", "--fine", "8", "--report", "out", "--quiet",
    ];
    let ran = run(folder.path(), &again);
    assert_eq!(
        (ran.code, ran.stdout.as_str()),
        (Some(0), ""),
        "{}",
        ran.stderr
    );
    check_figures(&out, 2);
    let mut names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != ".faceoff-report")
        .collect();
    names.sort();
    let expected = ["figure-1.svg", "figure-2.svg", "index.html", "paper.json"];
    names.retain(|name| !name.starts_with('.'));
    assert_eq!(names, expected);
}

/// Counted by the paper's own criterion. The numbers are those of a program of another hand, in numpy, and of FreeFEM.
fn check_counts(outcome: &Value, n: &[u32]) {
    let counts = outcome["counts"].as_array().unwrap();
    let of = |iteration: &str, method: &str, mesh: &str| {
        let found = counts
            .iter()
            .find(|c| c["iteration"] == iteration && c["method"] == method && c["mesh"] == mesh);
        found.unwrap_or_else(|| panic!("{iteration} {method} {mesh}"))
    };
    for mesh in ["union-jack", "exchanged"] {
        let nearest = of("displacement-new", "cr", mesh);
        assert_eq!(
            nearest["iterations"],
            serde_json::json!([79, 73, 67][..n.len()])
        );
        let lagged = of("lagged-gap", "cr", mesh);
        // By the increment alone, though the scheme is far from solved.
        assert_eq!(lagged["iterations"][0], 163);
        assert!(
            number(&lagged["backward_errors"][n.len() - 1]) > 1e-4,
            "{lagged}"
        );
        assert_eq!(
            of("newton", "cr", mesh)["iterations"]
                .as_array()
                .unwrap()
                .len(),
            n.len()
        );
        assert_eq!(
            of("displacement-new", "p2", mesh)["n"],
            serde_json::json!(n)
        );
    }
    let search = &outcome["search"];
    assert!(search["tried"].as_u64().unwrap() > 1000);
    let first = &search["nearest"][0];
    // The nearest on all three meshes of the paper.
    if n.len() == 3 {
        assert_eq!(first["iteration"], "displacement-new");
    }
    assert!(number(&first["off"]) < 0.1, "{first}");
    // Two numbers that are reported of each trial say the same.
    let stated = [79.0, 84.0, 66.0];
    let counts = first["iterations"].as_array().unwrap().iter();
    let off = counts.zip(stated).map(|(k, s)| (number(k) - s).abs() / s);
    assert!((off.fold(0.0, f64::max) - number(&first["off"])).abs() < 1e-12);
}

/// SVG is XML, without variables, which other programs do not know, and has a mark for each mesh.
fn check_figures(folder: &Path, meshes: usize) {
    let svg = |name: &str| {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        let mut reader = quick_xml::Reader::from_str(&text);
        while reader.read_event().unwrap() != quick_xml::events::Event::Eof {}
        assert!(!text.contains("var("), "{name}");
        text
    };
    let text = svg("figure-2.svg");
    let count = |what: &str| text.matches(what).count();
    // 6.1, N = 3 and N = 5; one more each where marks stand in a key: N = 3 is hollow, the rest filled.
    let of = |inside: &str| {
        [
            count(&format!("<circle class=\"{inside}\"")),
            count(&format!("<polygon class=\"{inside}\"")),
        ]
    };
    let keys = usize::from(text.contains("<g transform"));
    assert_eq!(
        of("ink hollow"),
        [meshes + keys, 2 * (meshes + keys)],
        "{text}"
    );
    assert_eq!(
        of("inkf"),
        [2 * (meshes + keys), 4 * (meshes + keys)],
        "{text}"
    );
    for part in ["O(h)", "O(h²)", "√2/", "N = 3, 5", "font-family:Helvetica"] {
        assert!(text.contains(part), "{part}");
    }
    // Every tile of the elevation, and the red line of contact.
    let text = svg("figure-1.svg");
    assert!(text.matches("class=\"f tile").count() >= 48 * 48);
    assert_eq!(text.matches("class=\"redl marked\"").count(), 1);
}

#[test]
fn bad_requests_are_refused_in_words() {
    let folder = folder();
    write(folder.path(), "work/thesis.txt", "years");
    write(folder.path(), "file", "a file");
    for (words, part) in [
        (&["paper", "--zones", "0"][..], "0 is not in"),
        (
            &["paper", "--reference", "--zones", "4000000000"],
            "at most",
        ),
        (
            &["paper", "--reference", "--n", "8,16"],
            "cannot be used with",
        ),
        (
            &["paper", "--engines", "comsol"],
            "there is no engine `comsol`",
        ),
        (&["paper", "--n", "32,16"], "do not rise"),
        (&["paper", "--n", "16,16"], "do not rise"),
        (&["paper", "--n", "16"], "a single mesh"),
        (&["paper", "--fine", "250"], "multiple of 4"),
        (
            &["paper", "--n", "4,8", "--fine", "8", "--report", "work"],
            "holds no earlier report",
        ),
        (
            &["paper", "--n", "4,8", "--fine", "8", "--report", "file"],
            "not a folder",
        ),
        (&["orders", "plate"], "its solution is not known"),
        (&["orders", "no-such-scene"], "there is no scene"),
        (&["orders", "--n", "16"], "a single mesh"),
        (&["orders", "--n", "32,16"], "do not rise"),
    ] {
        let ran = run(folder.path(), words);
        assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
        assert_eq!(ran.stdout, "");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    assert_eq!(fs::read_dir(folder.path().join("work")).unwrap().count(), 1);
}

#[test]
fn an_interrupted_run_leaves_no_result_but_says_so() {
    let folder = folder();
    let words = [
        "paper",
        "--n",
        "64,128,256",
        "--report",
        "out",
        "--json",
        "out.json",
    ];
    let mut child = faceoff(folder.path());
    let child = child
        .args(words)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    interrupt(&child);
    let ran = told(child.wait_with_output().unwrap());
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("interrupted"), "{}", ran.stderr);
    for file in ["out.json", "out/index.html", "out/paper.json"] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(text.contains("interrupted"), "{file}: {text}");
    }
    // With the list of what a report has written.
    let files = fs::read_dir(folder.path().join("out")).unwrap();
    assert_eq!(files.count(), 3);
}

#[test]
fn orders_stand_beside_theory() {
    let folder = folder();
    let words = [
        "orders",
        "transition-1.5",
        "dirichlet-meets-contact",
        "contact-everywhere",
        "--methods",
        "cr,p1,p2",
        "--n",
        "8,16,32",
        "--json",
        "orders.json",
    ];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stdout.contains("1.5, regularity"), "{}", ran.stdout);
    assert!(ran.stdout.contains("1, method"), "{}", ran.stdout);
    let text = fs::read(folder.path().join("orders.json")).unwrap();
    let all: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(all["schema"], "faceoff/orders/1");
    let all = all["orders"].as_array().unwrap();
    assert_eq!(all.len(), 9);
    for o in all {
        let (fit, theory) = (number(&o["h1"]["fit"]), number(&o["theory"]["h1"]));
        assert!(fit > theory - 0.1, "{o}");
    }
}

/// A scene knows its solution by what it says, not by its name.
#[test]
fn solve_knows_the_solutions_of_the_papers_scenes() {
    let folder = folder();
    let solve = |scene: &str| run(folder.path(), &["solve", scene, "--n", "16", "--json", "-"]);
    for (scene, method) in [
        ("one-zone", "cr"),
        ("one-zone", "p2"),
        ("three-zones", "p2"),
    ] {
        let words = [
            "solve", scene, "--method", method, "--n", "16", "--json", "-",
        ];
        let error = run(folder.path(), &words).json()["error"]["h1"].clone();
        let error = error.as_f64().expect("an error");
        assert!(error > 1e-3 && error < 0.3, "{scene} {method}: {error}");
    }
    let text = "name = \"one-zone\"\n[mesh]\ngenerator = \"union-jack\"\n[boundary]\ndirichlet = [\"top\"]\n\
                neumann = [\"left\", \"right\"]\ncontact = [\"bottom\"]\n[data]\nf = \"-2*pi*sin(2*pi*x)\"\n";
    write(folder.path(), "plain.toml", text);
    assert!(solve("plain.toml").json()["error"].is_null());
    let known = format!("{text}[exact]\nreference = \"one-zone\"\n")
        .replace("= \"one-zone\"\n[mesh]", "= \"mine\"\n[mesh]");
    write(folder.path(), "mine.toml", &known);
    assert!(solve("mine.toml").json()["error"]["h1"].is_f64());
    write(
        folder.path(),
        "other.toml",
        &known.replace("sin(2", "sin(3"),
    );
    let refused = solve("other.toml");
    assert_eq!(refused.code, Some(2));
    assert!(
        refused.stderr.contains("f is not that of `one-zone`"),
        "{}",
        refused.stderr
    );
    // Turned upside down the domain has another solution.
    let turned = known
        .replace("\"top\"", "\"lid\"")
        .replace("\"bottom\"", "\"top\"")
        .replace("\"lid\"", "\"bottom\"");
    write(folder.path(), "turned.toml", &turned);
    let refused = solve("turned.toml");
    assert_eq!(refused.code, Some(2));
    assert!(
        refused.stderr.contains("exact.reference"),
        "{}",
        refused.stderr
    );
}
