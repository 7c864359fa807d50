//! Faults planted in the scripts of forms that write their linear systems: each is named beside another code, and the script as it is has no difference.

use std::fs;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::common::{self, assert_valid, faceoff, folder, run, source, write};

/// Of `tests/systems/faults.toml`.
#[derive(Deserialize)]
struct Faults {
    set: Vec<Set>,
}

/// Faults in the script of one code for one form.
#[derive(Deserialize)]
struct Set {
    form: String,
    /// Whose script is changed.
    code: String,
    /// What it is compared with.
    beside: String,
    fault: Vec<Fault>,
}

#[derive(Deserialize)]
struct Fault {
    name: String,
    /// Texts of the script, and what is in their place.
    change: Vec<[String; 2]>,
    /// What must be told; of a text with `|` one of its parts.
    told: Vec<String>,
}

fn sets() -> Vec<Set> {
    let text = fs::read_to_string(source("tests/systems/faults.toml")).unwrap();
    toml::from_str::<Faults>(&text).unwrap().set
}

/// Runs the script as it is and with each fault, all beside the other code, and returns what was found.
fn found(at: &Path, set: &Set) -> Value {
    let form = |more: &str| {
        let text = format!(
            "{}[codes]\nuse = ['{}']\nsystems = true\n{more}",
            set.form, set.beside
        );
        write(at, "form.toml", &text);
    };
    form("[codes.none]\ncommand = ['true']\n");
    let suffix = if set.code == "freefem" { "edp" } else { "py" };
    let script = format!("script.{suffix}");
    let words = [
        "write",
        "form.toml",
        "--for",
        &set.code,
        "--system",
        "-o",
        &script,
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let text = fs::read_to_string(at.join(&script)).unwrap();
    let (command, mesh) = match set.code.as_str() {
        "freefem" => ("FreeFem++-nw', '-v', '0", "freefem"),
        _ => ("/usr/bin/python3", "msh2"),
    };
    let right = Fault {
        name: "right".into(),
        change: Vec::new(),
        told: Vec::new(),
    };
    let mut codes = String::new();
    for fault in std::iter::once(&right).chain(&set.fault) {
        let mut changed = text.clone();
        for [from, to] in &fault.change {
            assert!(changed.contains(from), "{script} has no {from}:\n{text}");
            changed = changed.replace(from, to);
        }
        let name = &fault.name;
        write(at, &format!("{name}.{suffix}"), &changed);
        codes += &format!(
            "[codes.{name}]\ncommand = ['{command}', '{name}.{suffix}', '{{mesh}}', '{{out}}/form.vtu']\nmesh = '{mesh}'\nresult = 'form.vtu'\nsystem = 'A.mtx b.mtx dofs.csv'\n"
        );
    }
    form(&codes);
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", source("target/python/bin").display());
    let words = [
        "verify",
        "--run",
        "form.toml",
        "--json",
        "o.json",
        "--report",
        "page",
    ];
    let ran = common::told(
        faceoff(at)
            .env("PATH", path)
            .args(words)
            .output()
            .expect("the program starts"),
    );
    assert_eq!(ran.code, Some(1), "{}\n{}", ran.stdout, ran.stderr);
    let json = at.join("o.json");
    assert_valid("json", "src/report/schema/face-off-1.json", &json);
    let page = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(page.contains("Where the systems differ."), "no picture");
    assert!(page.contains("<circle class=\"f k"), "no dots");
    serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap()
}

/// Each fault of these codes.
fn named(code: &str) {
    for set in sets().iter().filter(|set| set.code == code) {
        let at = folder();
        let all = found(at.path(), set);
        let of = |name: &str| {
            let pair = |of: &&Value| {
                let names = [&of["a"], &of["b"]];
                names.iter().any(|known| *known == name)
                    && names.iter().any(|known| **known == set.beside)
            };
            let found = all["systems"].as_array().unwrap().iter().find(pair);
            found.unwrap_or_else(|| panic!("no systems of {name} and {}", set.beside))
        };
        // Whether the system of a code is recorded as that of the form.
        let is_form = |name: &str| {
            let mut stated = of(name)["in_form"].as_array().unwrap().iter();
            let own = stated.find(|of| of["code"] == name).unwrap();
            own["is_form"] == true && own["is_derivative"] != false
        };
        assert_eq!(of("right")["verdict"], "agree", "{}", of("right"));
        for fault in &set.fault {
            let (name, found) = (&fault.name, of(&fault.name));
            assert_eq!(found["verdict"], "disagree", "{name}");
            assert!(!is_form(name), "{name}: {found}");
            let stated = found["in_form"].as_array().into_iter().flatten();
            let told: Vec<&str> = stated
                .chain([found])
                .filter_map(|of| of["sentence"].as_str())
                .collect();
            let told = told.join("; ");
            for wanted in &fault.told {
                assert!(
                    wanted.split('|').any(|words| told.contains(words)),
                    "{name}: `{wanted}` is not in {told}"
                );
            }
        }
    }
}

#[test]
fn faults_in_scripts_of_freefem_are_named_beside_scikit_fem() {
    named("freefem");
}

#[test]
fn faults_in_scripts_of_dolfinx_are_named_beside_rust() {
    named("dolfinx");
}
