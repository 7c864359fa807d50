//! `verify --symmetries`: codes get images of a problem, and one whose answer does not move with them is named.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Ran, assert_valid, folder, run, source, write};

/// Nodes of a mesh in Gmsh's format 2.2, and a function of them that is symmetric about the middle of the unit square.
const SCRIPT: &str = "import sys
lines = open(sys.argv[1]).read().split('$Nodes\\n')[1].split('\\n')
nodes = [[float(x) for x in line.split()[1:3]] for line in lines[1 : 1 + int(lines[0])]]
u = [1 + (x - 0.5)**2*(x - 0.5)**2 + (y - 0.5)**2*(y - 0.5)**2 for x, y in nodes]
FAULT
with open(sys.argv[2] + '/u.csv', 'w') as file:
    file.write('vertex,u\\n' + ''.join(f'{k},{v!r}\\n' for k, v in enumerate(u)))
";

/// Two codes, the second with a fault, and what else the file says.
fn scripts(at: &Path, fault: &str, more: &str) {
    write(at, "right.py", &SCRIPT.replace("FAULT\n", ""));
    write(at, "other.py", &SCRIPT.replace("FAULT", fault));
    let code = |name: &str| {
        format!(
            "[codes.{name}]\ncommand = [\"/usr/bin/python3\", \"{name}.py\", \"{{mesh}}\", \"{{out}}\"]\nmesh = \"msh2\"\nresult = \"u.csv\"\n"
        )
    };
    let text = format!(
        "name = \"two\"\n{more}[mesh]\ngenerator = \"union-jack\"\nn = 3\n{}{}[fields.u]\nsame = \"discretisation\"\nrtol = 1e-9\n",
        code("right"),
        code("other")
    );
    write(at, "two.toml", &text);
}

fn verify(at: &Path, words: &[&str]) -> (Ran, Value) {
    let ran = run(at, &[&["verify", "--json", "o.json"], words].concat());
    let json = at.join("o.json");
    let text = fs::read_to_string(&json);
    let text = text.unwrap_or_else(|e| panic!("{e}: {}{}", ran.stdout, ran.stderr));
    assert_valid("json", "src/report/schema/face-off-1.json", &json);
    (ran, serde_json::from_str(&text).unwrap())
}

/// The codes and images of this verdict.
fn rows<'a>(found: &'a Value, verdict: &str) -> Vec<[&'a str; 2]> {
    let rows = found["symmetries"]["rows"].as_array().unwrap().iter();
    let rows = rows.filter(|row| row["verdict"] == verdict);
    rows.map(|row| ["code", "image"].map(|key| row[key].as_str().unwrap()))
        .collect()
}

#[test]
fn a_script_that_depends_on_numbers_or_places_is_named() {
    let symmetric = "symmetries = [\"mirrored\", \"turned\"]\n";
    for (fault, more, images) in [
        ("", symmetric, &[][..]),
        // Where the mesh is numbered as it was generated, nothing is wrong.
        ("u[0] += 1e-3*(nodes[0] != [0, 0])", "", &["renumbered"][..]),
        (
            "u[0] += 1e-3*(nodes[0] == [1, 0])",
            symmetric,
            &["mirrored", "turned"],
        ),
    ] {
        let folder = folder();
        let at = folder.path();
        scripts(at, fault, more);
        let (ran, found) = verify(at, &["--run", "two.toml"]);
        assert_eq!(ran.code, Some(0), "{fault}: {}{}", ran.stdout, ran.stderr);
        assert!(found.get("symmetries").is_none());
        let words = ["--run", "two.toml", "--symmetries", "--junit", "j.xml"];
        let (ran, found) = verify(at, &words);
        let junit = fs::read_to_string(at.join("j.xml")).unwrap();
        assert_eq!(junit.matches("<failure").count(), images.len(), "{junit}");
        let all = rows(&found, "agree").len() + images.len();
        assert_eq!(all, if more.is_empty() { 2 } else { 6 }, "{found:#}");
        let wrong: Vec<[&str; 2]> = images.iter().map(|image| ["other", *image]).collect();
        assert_eq!(rows(&found, "disagree"), wrong, "{fault}: {found:#}");
        let code = if images.is_empty() { 0 } else { 1 };
        assert_eq!(
            ran.code,
            Some(code),
            "{fault}: {}{}",
            ran.stdout,
            ran.stderr
        );
        let says = "`u` of other changes by";
        let is_said = ran.stdout.contains("of other changes") || ran.stderr.contains(says);
        assert_eq!(is_said, !images.is_empty(), "{}{}", ran.stdout, ran.stderr);
    }
}

#[test]
fn symmetries_that_cannot_be_judged_are_refused() {
    let folder = folder();
    let at = folder.path();
    for (name, says) in [
        ("mirroredd", "did you mean `mirrored`"),
        ("scaled", "`scaled` is no symmetry that data may have"),
    ] {
        scripts(at, "", &format!("symmetries = [\"{name}\"]\n"));
        let ran = run(at, &["verify", "--run", "two.toml", "--symmetries"]);
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(ran.stderr.contains(says), "{}", ran.stderr);
    }
    let ran = run(at, &["verify", "one-zone", "--symmetries"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("stress"), "{}", ran.stderr);
}

/// Rows of a table are keyed by vertices of the mesh that the code was given, whatever their order.
#[test]
fn tables_are_read_by_the_numbers_that_vertices_had() {
    let folder = folder();
    let at = folder.path();
    scripts(at, "u[0] += 0.01", "");
    let (_, found) = verify(at, &["--run", "two.toml", "--diagnose"]);
    let moved = found["diagnosis"]["moved"].as_array().unwrap();
    let by = |code: &str| {
        let row = moved
            .iter()
            .find(|row| row["code"] == code && row["change"] == "vertices in reverse order");
        row.unwrap_or_else(|| panic!("{moved:#?}"))["relative"].as_f64()
    };
    assert_eq!(by("right"), Some(0.0));
    assert!(
        by("other").is_some_and(|far| (1e-3..2e-2).contains(&far)),
        "{moved:#?}"
    );
}

/// Forms of each kind of element move with mirrors, turns and units in codes as they are.
#[test]
fn forms_move_with_their_images() {
    let folder = folder();
    let at = folder.path();
    for name in [
        "poisson",
        "darcy",
        "curl-curl",
        "neo-hooke",
        "biharmonic",
        "heat",
    ] {
        let text = match name {
            // Steps in time, with lengths and normals.
            "heat" => "name = \"heat\"\n[mesh]\ngenerator = \"union-jack\"\nn = 2\n[spaces]\nu = \"P2\"\n[time]\nstep = 0.1\nend = 0.2\n\
                 [initial]\nu = \"x*y^2\"\n[data]\nb = [\"1\", \"x\"]\n\
                 [form]\nF = \"(u - old(u))/dt*v*dx + inner(grad(u), grad(v))*dx + h*dot(b, grad(u))*dot(b, grad(v))*dx - x*dot(b, n)*v*ds(right)\"\n\
                 [dirichlet]\nleft = \"y\"\n"
                .to_owned(),
            _ => fs::read_to_string(source("examples/forms").join(format!("{name}.toml"))).unwrap(),
        };
        write(at, "form.toml", &text);
        let words = [
            "form.toml",
            "--engines",
            "rust,freefem",
            "--n",
            "2",
            "--symmetries",
        ];
        let (ran, found) = verify(at, &words);
        let images = rows(&found, "agree");
        for code in ["rust", "freefem"] {
            for image in ["renumbered", "regrouped", "mirrored", "turned", "scaled"] {
                assert!(
                    images.contains(&[code, image]),
                    "{name}: {code} {image}: {}{}\n{:#}",
                    ran.stdout,
                    ran.stderr,
                    found["symmetries"]
                );
            }
        }
        assert_eq!(found["symmetries"]["verdict"], "agree", "{name}: {found:#}");
    }
}
