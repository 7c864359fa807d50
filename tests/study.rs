//! `study`, `stress` and `--explain` on the command line.

use std::path::Path;

use crate::common::{assert_valid, changed_companion, folder, run, source, times, write};
use serde_json::Value;

/// A study that is ended by its finest mesh and not by its budget, so that it is the same everywhere but for times.
fn studied(folder: &Path, scene: &str, more: &[&str]) -> Value {
    let mut words = vec!["study", scene, "--budget", "1h", "--json", "-"];
    words.extend(more);
    let ran = run(folder, &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    ran.json()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// Every command that is advised, typed word for word, reaches the error that it is advised for.
#[test]
fn a_study_ends_with_a_report_and_advice_that_holds() {
    let folder = folder();
    // One whose certificates are cheap, except by `tests/run --all`.
    let (scene, finest, levels) = match times() {
        1 => ("one-zone", "16", 2),
        _ => ("transition-1.5", "32", 3),
    };
    let words = ["--methods", "cr-fc,p2", "--finest", finest, "--report", "r"];
    let told = studied(folder.path(), scene, &words);
    let rows = told["rows"].as_array().unwrap();
    for method in ["cr-fc", "p2"] {
        let track = rows
            .iter()
            .filter(|r| r["method"] == method && r["varied"] == "mesh");
        let errors: Vec<f64> = track.clone().map(|r| number(&r["h1"])).collect();
        assert!(errors.len() == levels && errors.windows(2).all(|e| e[1] < e[0]));
        for row in track {
            assert!(number(&row["h1"]) <= number(&row["certified"]), "{row}");
            let seconds = &row["seconds"];
            let [least, median, most] =
                ["least", "median", "most"].map(|key| number(&seconds[key]));
            assert!(0.0 < least && least <= median && median <= most);
        }
    }
    let usual = rows.iter().filter(|row| row["varied"] != "gamma0");
    assert!(usual.clone().all(|row| row["converged"] == true));
    for varied in [
        "mesh",
        "adaptive",
        "tolerance",
        "contact-quadrature",
        "linear",
        "target",
    ] {
        assert!(usual.clone().any(|row| row["varied"] == varied), "{varied}");
    }

    let advice = told["advice"].as_array().unwrap();
    for advice in advice {
        let command = advice["command"].as_str().unwrap();
        let mut words: Vec<&str> = command.split(' ').skip(1).collect();
        words.extend(["--quiet", "--json", "-"]);
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{command}: {}", ran.stderr);
        let solved = ran.json();
        let key = if advice["norm"] == "energy" {
            "h1"
        } else {
            "l2"
        };
        let error = number(&solved["error"][key]);
        assert!(error <= number(&advice["target"]), "{advice}: {error:e}");
        let told = number(&advice["best"]["error"]);
        assert!((error / told - 1.0).abs() < 1e-9, "{advice}: {error:e}");
    }
    // There is advice for every error that some mesh reaches, and for no other.
    for (norm, key) in [("energy", "h1"), ("l2", "l2")] {
        let counts = usual.clone().filter(|row| row["varied"] == "mesh");
        let least = counts.fold(f64::INFINITY, |m, row| m.min(number(&row[key])));
        let targets = advice.iter().filter(|a| a["norm"] == norm);
        let tightest = targets.fold(1.0_f64, |m, a| m.min(number(&a["target"])));
        assert!(tightest < 20.0 * least, "{norm}: {tightest:e} {least:e}");
    }

    let report = |name: &str| std::fs::read_to_string(folder.path().join("r").join(name)).unwrap();
    // One line a row, and the header.
    let csv = report("rows.csv");
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
    let text = report("index.html");
    for advice in advice {
        assert!(text.contains(advice["command"].as_str().unwrap()));
    }
    for (figure, words) in [("work", "time: mesh, assembly"), ("gamma0", "γ₀")] {
        let name = format!("{figure}-{scene}.svg");
        assert!(text.contains(&name));
        assert!(report(&name).contains(words));
    }
    assert!(text.contains("solved at 25 of 25 values"));
    // The page begins with what an error costs, and its figure has each point that nothing beats: a step down to each.
    let cheap = advice.iter().rfind(|a| a["norm"] == "energy").unwrap();
    let claim = text.split("<h1").nth(1).unwrap();
    let claim = &claim[..claim.find("</h1>").unwrap()];
    let asked = format!("{} %", 100.0 * number(&cheap["target"]));
    assert!(
        claim.contains(&asked) && claim.contains(cheap["best"]["method"].as_str().unwrap()),
        "{claim}"
    );
    let picture = report(&format!("work-{scene}.svg"));
    let front = picture.split("class=\"ink dots\" d=\"").nth(1).unwrap();
    let steps = front[..front.find('"').unwrap()].matches('H').count();
    assert_eq!(steps, told["front"].as_array().unwrap().len());
    assert_eq!(
        serde_json::from_str::<Value>(&report("study.json")).unwrap()["rows"],
        told["rows"]
    );
    // Other folders are left alone.
    write(folder.path(), "other/mine.txt", "mine");
    let ran = run(folder.path(), &["study", "hertz", "--report", "other"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("nothing was touched"), "{}", ran.stderr);
}

/// A study that is resumed has the very times of the one before, and measures what is new.
#[test]
fn a_study_is_resumed() {
    let folder = folder();
    let mut words = vec!["--methods", "cr-fc", "--resume", "journal", "--finest", "8"];
    let times = |told: &Value| -> Vec<String> {
        let rows = told["rows"].as_array().unwrap().iter();
        let kinds = rows.filter(|row| row["varied"] == "mesh" || row["varied"] == "gamma0");
        kinds
            .map(|row| format!("{} {:.9e}", row["n"], number(&row["seconds"]["median"])))
            .collect()
    };
    // Its certificates are the cheapest.
    let studied = |words: &[&str]| studied(folder.path(), "one-zone", words);
    let first = times(&studied(&words));
    assert_eq!(times(&studied(&words)), first);
    words[5] = "16";
    let more = times(&studied(&words));
    let kept = first.iter().filter(|time| more.contains(time)).count();
    assert!(kept >= 2 && more.iter().any(|time| !first.contains(time)));
    let refused = |place: &str, sentence: &str| {
        let words = "study one-zone --methods cr-fc --finest 16 --resume";
        let words: Vec<&str> = words.split(' ').chain([place]).collect();
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(2), "{place}: {}", ran.stdout);
        assert!(ran.stderr.contains(sentence), "{}", ran.stderr);
    };
    refused("/no/such/folder/j", "No such file");
    // One run at a time, and times of this machine alone.
    let journal = folder.path().join("journal/journal.jsonl");
    let held = std::fs::File::open(&journal).unwrap();
    held.lock().unwrap();
    refused("journal", "is in use by another run");
    drop(held);
    let text = std::fs::read_to_string(&journal).unwrap();
    let other = text.replacen("\"processor\":\"", "\"processor\":\"other ", 1);
    assert_ne!(other, text);
    write(folder.path(), "journal/journal.jsonl", &other);
    refused("journal", "was begun with something else: processor was");
}

/// Times of a program that was changed since are not those of the one that is there.
#[test]
fn a_study_is_not_resumed_with_another_program() {
    let folder = folder();
    let engine = changed_companion(folder.path(), "freefem", "cases < 1", "cases < 1");
    let words = "study one-zone --methods cr --finest 8 --budget 1s --resume kept --engines";
    let words: Vec<&str> = words.split(' ').chain([&*engine]).collect();
    for _ in 0..2 {
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    let script = folder.path().join("copy/signorini.edp");
    let text = std::fs::read_to_string(&script).unwrap();
    std::fs::write(&script, text + "// changed\n").unwrap();
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    let told = "of changed: one-zone, changed cr, n = 8, mesh";
    assert!(ran.stderr.contains(told), "{}", ran.stderr);
    assert!(ran.stderr.contains("companion was"), "{}", ran.stderr);
}

/// `solve --accuracy` reaches the true error that is asked for, on a mesh less than twice as fine as it takes: the bound
/// exceeds the error by no more.
#[test]
fn an_accuracy_leads_to_a_mesh_that_is_hardly_finer_than_it_takes() {
    let folder = folder();
    let solved = |more: &[&str]| {
        let scene = ["solve", "transition-1.5", "--quiet", "--json", "-"];
        let ran = run(folder.path(), &[&scene, more].concat());
        assert_eq!(ran.code, Some(0), "{more:?}: {}", ran.stderr);
        ran.json()
    };
    for target in ["0.05", "0.02", "0.01"] {
        let words = ["--accuracy", target, "--way", "uniform", "--certify=u_h"];
        let fine = solved(&words);
        assert_eq!(fine["method"], "cr-fc");
        let half = (number(&fine["n"]) as usize / 2).to_string();
        let coarse = solved(&["--method", "cr-fc", "--n", &half]);
        let target: f64 = target.parse().unwrap();
        let [fine, coarse] = [fine, coarse].map(|told| number(&told["error"]["h1"]));
        assert!(
            fine <= target && target < coarse,
            "{fine} {target} {coarse}"
        );
    }
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let folder = folder();
    write(folder.path(), "mine.txt", "mine\n");
    for (words, sentence) in [
        (&["study", "--budget", "0s"][..], "not a positive duration"),
        (&["study", "no-such-scene"], "there is no scene"),
        (&["study", "hertz", "hertz"], "named twice"),
        (&["study", "r32", "transition-1.5"], "named twice"),
        (&["study", "--engines", "rust,rust"], "named twice"),
        (&["study", "--budget", "1us"], "not a positive duration"),
        (&["study", "--resume", "mine.txt"], "nothing was touched"),
        (&["stress", "plate"], "its solution is not known"),
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
    // The page has a word for each trial on the ground of its verdict, by method.
    let page = report("index.html");
    let words = |class: &str, word: &str| {
        let [start, end] = [format!("<td class=\"{class}\""), format!(">{word}")];
        let cells = page.split(&*start).skip(1);
        cells
            .filter(|cell| cell[..cell.find("</td>").unwrap()].ends_with(&end))
            .count()
    };
    assert_eq!(
        [words("w0", "holds"), words("wr", "refuses")],
        ["holds", "refuses"].map(count)
    );
    assert!(page.contains("scope=\"col\" class=\"code\">cr<") && page.contains(">p2</th>"));
    assert_eq!(report("map.csv").lines().count(), cells.len() + 1);
    assert!(report("index.html").contains("does not press it into contact"));
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

#[test]
fn verify_explains_itself() {
    let folder = folder();
    let baseline = source("tests/baseline");
    let baseline = baseline.to_str().unwrap();
    let words = ["verify", "one-zone", "--n", "4", "--against", baseline];
    let ran = run(
        folder.path(),
        &[&words[..], &["--explain", "--json", "v.json"]].concat(),
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for line in [
        "one-zone, cr, n = 4:",
        "model: CR in 2",
        "model: P2 in 2",
        "certificate: computed",
    ] {
        assert!(ran.stdout.contains(line), "{line}: {}", ran.stdout);
    }
    let file = folder.path().join("v.json");
    assert_valid("json", "src/report/schema/verify-1.json", &file);
    let told: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let of = |k: usize| &told["explanations"][k];
    assert_eq!(
        (&of(0)["method"], &of(1)["method"]),
        (&"cr".into(), &"p2".into())
    );
    assert_eq!(of(0)["built"]["factors"], 1);
    let ran = run(folder.path(), &words);
    assert!(!ran.stdout.contains("model:"), "{}", ran.stdout);
}

/// What started a program, and how large it is, is no part of the program's memory.
#[test]
fn memory_is_that_of_the_program_alone() {
    let folder = folder();
    let large = vec![1_u8; 400_000_000];
    let words = [
        "solve", "one-zone", "--n", "8", "--method", "cr", "--json", "-",
    ];
    let told = run(folder.path(), &words).json();
    assert_eq!(
        large.iter().map(|b| u64::from(*b)).sum::<u64>(),
        400_000_000
    );
    let memory = number(&told["peak_rss_mb"]);
    assert!(memory > 1.0 && memory < 200.0, "{memory} MB");
}

/// All values of a family go to a code in one job, with what they are compared with.
#[test]
fn stress_starts_a_code_once() {
    let folder = folder();
    let real = std::env::split_paths(&std::env::var_os("PATH").unwrap())
        .map(|place| place.join("FreeFem++-nw"))
        .find(|program| program.is_file())
        .expect("FreeFEM");
    let starts = folder.path().join("starts");
    let script = format!(
        "#!/bin/sh\necho x >> {}\nexec {} \"$@\"\n",
        starts.display(),
        real.display()
    );
    write(folder.path(), "bin/FreeFem++-nw", &script);
    let wrapper = folder.path().join("bin/FreeFem++-nw");
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(&wrapper, mode).unwrap();
    let path = format!(
        "{}:{}",
        folder.path().join("bin").display(),
        std::env::var("PATH").unwrap()
    );
    let words = "stress transition-1.5 --methods cr --families gamma0 --engines freefem --json -";
    let mut command = crate::common::faceoff(folder.path());
    let output = command.args(words.split(' ')).env("PATH", path).output();
    let ran = crate::common::told(output.unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(ran.json()["cells"].as_array().unwrap().len(), 7);
    assert_eq!(std::fs::read_to_string(&starts).unwrap(), "x\n");
}
