//! `faceoff compare` on files of its own, of meshio, and tables.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::Path;

use common::{Ran, folder, run, write};

/// A solution as VTU, and its faces beside it.
fn solve(folder: &Path, engine: &str, out: &str) {
    let words = [
        "solve", "one-zone", "--n", "6", "--engine", engine, "--out", out, "--quiet",
    ];
    let ran = run(folder, &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

fn compare(folder: &Path, words: &[&str]) -> Ran {
    run(folder, &[&["compare"], words, &["--json", "-"]].concat())
}

fn refused(folder: &Path, words: &[&str], part: &str) {
    let ran = compare(folder, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
    assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
}

#[test]
fn a_file_against_itself_is_never_a_pass() {
    let folder = folder();
    let at = folder.path();
    solve(at, "rust", "a.vtu");
    fs::hard_link(at.join("a.vtu"), at.join("hard.vtu")).unwrap();
    std::os::unix::fs::symlink("a.vtu", at.join("soft.vtu")).unwrap();
    fs::copy(at.join("a.vtu"), at.join("copy.vtu")).unwrap();
    fs::create_dir(at.join("sub")).unwrap();
    for other in ["a.vtu", "./a.vtu", "sub/../a.vtu", "hard.vtu", "soft.vtu"] {
        refused(
            at,
            &["a.vtu", other],
            "a file against itself proves nothing",
        );
        refused(
            at,
            &["a.vtu", other, "--allow-identical"],
            "a file against itself",
        );
    }
    refused(at, &["a.vtu", "copy.vtu"], "the same byte for byte");
    assert_eq!(
        compare(at, &["a.vtu", "copy.vtu", "--allow-identical"]).code,
        Some(0)
    );
    refused(at, &["a.vtu", "none.vtu"], "none.vtu: cannot read");
}

#[test]
fn files_that_are_cut_or_changed_are_no_pass() {
    let folder = folder();
    let at = folder.path();
    solve(at, "rust", "a.vtu");
    let bytes = fs::read(at.join("a-faces.vtu")).unwrap();
    for part in [0, 10, bytes.len() / 2, bytes.len() - 20] {
        fs::write(at.join("cut.vtu"), &bytes[..part]).unwrap();
        assert_eq!(
            compare(at, &["a-faces.vtu", "cut.vtu"]).code,
            Some(2),
            "{part} bytes"
        );
    }
    // Another mesh, another field, the cells instead of the faces.
    let words = ["solve", "one-zone", "--n", "8", "--out", "b.vtu", "--quiet"];
    assert_eq!(run(at, &words).code, Some(0));
    for (a, b) in [
        ("a.vtu", "b.vtu"),
        ("a-faces.vtu", "b-faces.vtu"),
        ("a.vtu", "a-faces.vtu"),
    ] {
        assert_eq!(compare(at, &[a, b]).code, Some(2));
    }
    let words = [
        "solve", "one-zone", "--n", "6", "--gamma0", "100.0001", "--out", "c.vtu", "--quiet",
    ];
    assert_eq!(run(at, &words).code, Some(0));
    let ran = compare(at, &["a-faces.vtu", "c-faces.vtu"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let loose = ["a-faces.vtu", "c-faces.vtu", "--rtol", "1e-3"];
    assert_eq!(compare(at, &loose).code, Some(0));
    // Every field is judged, those of γ as well.
    let told = ran.json();
    let fields = told["fields"].as_array().unwrap();
    let verdict =
        |name: &str| fields.iter().find(|f| f["field"] == name).unwrap()["verdict"].clone();
    assert_eq!(
        (verdict("gamma"), verdict("part")),
        ("disagree".into(), "agree".into())
    );
    let own = [
        "a-faces.vtu",
        "c-faces.vtu",
        "--rtol",
        "1e-3",
        "--field",
        "mean rust:rtol=1e-14,atol=0",
    ];
    assert_eq!(compare(at, &own).code, Some(1));
    refused(
        at,
        &["a.vtu", "c.vtu", "--field", "u:rtol=1"],
        "neither has the field `u`",
    );
}

#[test]
fn differences_are_written_where_they_are() {
    let folder = folder();
    let at = folder.path();
    solve(at, "rust", "a.vtu");
    let words = [
        "solve", "one-zone", "--n", "6", "--gamma0", "101", "--out", "c.vtu", "--quiet",
    ];
    assert_eq!(run(at, &words).code, Some(0));
    for (a, b) in [("a.vtu", "c.vtu"), ("a-faces.vtu", "c-faces.vtu")] {
        assert_eq!(compare(at, &[a, b, "--out", "d.vtu"]).code, Some(1));
        let fields = |file: &str| -> Vec<String> {
            let told = run(at, &["mesh", "info", file, "--json", "-"]).json();
            let named = told["fields"].as_array().unwrap().iter();
            let mut names: Vec<_> = named
                .map(|f| f["name"].as_str().unwrap().to_owned())
                .collect();
            names.sort();
            names
        };
        assert_eq!(fields("d.vtu"), fields(a));
        // What is subtracted from itself is nothing.
        let ran = compare(at, &["d.vtu", a]);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    }
    refused(
        at,
        &["a.vtu", "c.vtu", "--out", "d.txt"],
        "does not end in .vtu",
    );
}

#[test]
fn tables_are_matched_by_numbers_or_places() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u\n0,1.0\n1,2.0\n2,3.0\n");
    write(at, "b.csv", "vertex, u\n2,3.0\n0,1.0\n1,2.000000000001\n");
    assert_eq!(compare(at, &["a.csv", "b.csv"]).code, Some(0));
    assert_eq!(
        compare(at, &["a.csv", "b.csv", "--rtol", "1e-14"]).code,
        Some(1)
    );
    write(at, "faces.csv", "v0,v1,mean\n1,0,5\n2,1,7\n");
    write(at, "other.csv", "v0,v1,mean\n1,2,7.0\n0,1,5.0\n");
    assert_eq!(compare(at, &["faces.csv", "other.csv"]).code, Some(0));
    write(at, "p.csv", "x,y,u\n0,0,1\n1,0,2\n0.3333333333333333,1,3\n");
    write(at, "q.csv", "x,y,u\n0.33333334,1,3\n0,0,1\n1,0,2\n");
    refused(at, &["p.csv", "q.csv"], "has no point");
    write(at, "q.csv", "x,y,u\n0.33333333333334,1,3\n0,0,1\n1,0,2\n");
    let ran = compare(at, &["p.csv", "q.csv"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(ran.json()["map"], "coordinates");
    write(at, "twice.csv", "x,y,u\n0,0,1\n0,0,2\n1,0,3\n");
    refused(at, &["p.csv", "twice.csv"], "ambiguous");
    for (name, text, part) in [
        ("nan.csv", "vertex,u\n0,1\n1,nan\n2,3\n", ""),
        ("missing.csv", "vertex,w\n0,1\n1,2\n2,3\n", ""),
        ("short.csv", "vertex,u\n0,1\n1,2\n", "one has 3 points"),
        ("partial.csv", "vertex,u\n0,1\n1,\n2,3\n", ""),
        ("empty.csv", "vertex,u\n", "0 of 1"),
        ("keyless.csv", "u\n1\n", "no column is a key"),
        ("none.csv", "vertex\n0\n1\n2\n", "has no field"),
    ] {
        write(at, name, text);
        let ran = compare(at, &["a.csv", name]);
        assert!(matches!(ran.code, Some(1 | 2)), "{name}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{name}: {}", ran.stderr);
        let turned = compare(at, &[name, "a.csv"]);
        assert!(
            matches!(turned.code, Some(1 | 2)),
            "{name}: {}",
            turned.stdout
        );
    }
}

#[test]
fn a_table_of_face_means_is_held_against_faces_by_their_midpoints() {
    let folder = folder();
    let at = folder.path();
    solve(at, "rust", "a.vtu");
    // What another code would write: midpoints and means, here from the judge's own file.
    let content = faceoff::io::open(&at.join("a-faces.vtu"), None).unwrap();
    let mesh = &content.mesh;
    let field = |name: &str| {
        mesh.fields
            .iter()
            .find(|f| f.name == name)
            .unwrap()
            .values
            .to_f64()
    };
    let mut keep = mesh.clone();
    keep.fields.retain(|f| f.name == "mean rust");
    faceoff::io::write(&at.join("mean.vtu"), &keep, &Default::default()).unwrap();
    let means = field("mean rust");
    let mut rows = vec!["x,y,mean rust".to_owned()];
    for (cell, _, nodes) in mesh.cells() {
        let [p, q] = [nodes[0], nodes[1]].map(|v| mesh.points[v as usize]);
        let middle = [0, 1].map(|k| 0.5 * (p[k] + q[k]));
        rows.insert(
            1,
            format!("{},{},{:e}", middle[0], middle[1], means[cell as usize]),
        );
    }
    write(at, "means.csv", &(rows.join("\n") + "\n"));
    for (a, b) in [("mean.vtu", "means.csv"), ("means.csv", "mean.vtu")] {
        let ran = compare(at, &[a, b, "--rtol", "1e-15"]);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    }
    rows.swap(3, 4);
    let last = rows.len() - 1;
    rows[last].push('1');
    write(at, "means.csv", &(rows.join("\n") + "\n"));
    let ran = compare(at, &["mean.vtu", "means.csv"]);
    assert_ne!(ran.code, Some(0));
}

#[test]
fn fields_are_left_out_only_by_name() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u,label\n0,1,7\n1,2,7\n");
    write(at, "b.csv", "vertex,u\n0,1\n1,2\n");
    assert_eq!(compare(at, &["a.csv", "b.csv"]).code, Some(2));
    let ran = compare(at, &["a.csv", "b.csv", "--only", "u"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(
        ran.stderr.contains("a.csv: left out label"),
        "{}",
        ran.stderr
    );
    refused(at, &["a.csv", "b.csv", "--only", "w"], "has no field");
    refused(
        at,
        &["a.csv", "b.csv", "--only", "label"],
        "b.csv has no field",
    );
}

/// The function that dolfinx writes here as continuous and as discontinuous data, each through its own writer.
#[test]
fn what_dolfinx_writes_is_compared_as_it_is() {
    let folder = folder();
    let at = folder.path();
    let script = r#"
import numpy as np
from dolfinx import fem, io, mesh
from mpi4py import MPI
m = mesh.create_unit_square(MPI.COMM_WORLD, 4, 4)
for element, name, shift in [("Lagrange", "cg", 0), ("DG", "dg", 0), ("DG", "off", 1e-6)]:
    u = fem.Function(fem.FunctionSpace(m, (element, 1)), name="u")
    u.interpolate(lambda x: np.sin(3 * x[0]) + x[1] ** 2)
    u.x.array[5] += shift
    with io.VTKFile(m.comm, name + ".pvd", "w") as file:
        file.write_function(u)
"#;
    let script = write(at, "write.py", script);
    let mut python = std::process::Command::new("/usr/bin/python3");
    let ran = common::told(python.arg(script).current_dir(at).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let ran = compare(at, &["cg000000.pvtu", "dg_p0_000000.vtu"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let told = ran.json();
    assert_eq!(
        (&told["map"], &told["fields"][0]["faces"]),
        (&"coordinates".into(), &96.into())
    );
    let ran = compare(at, &["dg000000.pvtu", "off000000.pvtu"]);
    assert_eq!(ran.code, Some(1));
    let field = &ran.json()["fields"][0];
    assert_eq!(field["beyond"], 1);
    assert!(
        (field["max_abs"].as_f64().unwrap() - 1e-6).abs() < 1e-12,
        "{field}"
    );
}

#[test]
fn what_is_told_is_valid() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u,v\n0,1,1\n1,2,2\n");
    write(at, "b.csv", "vertex,u\n0,1\n1,3\n");
    let words = [
        "compare", "a.csv", "b.csv", "--json", "o.json", "--junit", "o.xml", "--badge", "o.svg",
        "--quiet",
    ];
    let ran = run(at, &words);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(1), ""));
    common::assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
    common::assert_valid(
        "json",
        "src/report/schema/compare-1.json",
        &at.join("o.json"),
    );
    let xml = fs::read_to_string(at.join("o.xml")).unwrap();
    assert!(
        xml.contains("tests=\"2\" failures=\"1\" errors=\"1\""),
        "{xml}"
    );
    assert!(
        fs::read_to_string(at.join("o.svg"))
            .unwrap()
            .contains("disagree")
    );
    assert_eq!(
        run(at, &["compare", "a.csv", "none.csv", "--junit", "o.xml"]).code,
        Some(2)
    );
    common::assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
}
