//! `faceoff mesh info` and `mesh check`: what is told of files of all kinds, and of cells.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::{assert_valid, folder, run, write};

const MESH: &str = "MeshVersionFormatted 2 Dimension 2
Vertices 4  0 0 0  2 0 0  2 1 0  0 1 0
Triangles 2  1 2 3 7  1 3 4 8
Edges 1  1 2 5
End";

fn valid(at: &Path, schema: &str, told: &str) {
    let file = write(at, "told.json", told);
    assert_valid("json", &format!("src/report/schema/{schema}-1.json"), &file);
}

fn info(at: &Path, words: &[&str]) -> Value {
    let ran = run(at, &[&["mesh", "info"], words, &["--json", "-"]].concat());
    assert_eq!(ran.code, Some(0), "{words:?}: {}", ran.stderr);
    valid(at, "mesh-info", &ran.stdout);
    ran.json()
}

#[test]
fn a_solution_of_medits_is_on_the_mesh_beside_it_or_on_one_that_is_given() {
    let folder = folder();
    let at = folder.path();
    write(at, "u.mesh", MESH);
    fs::create_dir(at.join("other")).unwrap();
    let sol = "MeshVersionFormatted 2 Dimension 2 SolAtVertices 4 2 1 2
1 3 4  2 0 0  -5 0 0  4 0 0 End";
    write(at, "u.sol", sol);
    write(&at.join("other"), "v.sol", sol);
    for words in [&["u.sol"][..], &["other/v.sol", "--mesh", "u.mesh"]] {
        let told = info(at, words);
        assert_eq!(told["box"], json!([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]]));
        assert_eq!((&told["order"], &told["triangles"]), (&json!(1), &json!(2)));
        assert_eq!(
            told["fields"],
            json!([
                {"name": "sol 1", "on": "points", "components": 1, "least": -5.0, "largest": 4.0, "not_finite": 0, "times": 1},
                {"name": "sol 2", "on": "points", "components": 2, "least": 0.0, "largest": 4.0, "not_finite": 0, "times": 1},
            ])
        );
    }
    let ran = run(at, &["mesh", "info", "other/v.sol"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("v.mesh"), "{}", ran.stderr);
}

#[test]
fn lists_and_numbered_files_have_times() {
    let folder = folder();
    let at = folder.path();
    for (k, value) in [(1, "3"), (2, "nan")] {
        let vtk = format!(
            "# vtk DataFile Version 3.0\nu\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n0 0 0 1 0 0 0 1 {k}\n\
             CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\nPOINT_DATA 3\nSCALARS u double 1\nLOOKUP_TABLE default\n1 2 {value}\n"
        );
        write(at, &format!("u_{k}.vtk"), &vtk);
        let words = [
            "mesh",
            "convert",
            &format!("u_{k}.vtk"),
            &format!("u_{k}.vtu"),
        ];
        assert_eq!(run(at, &words).code, Some(0));
    }
    let entry = |time: f64, k: usize| format!("<DataSet timestep=\"{time}\" file=\"u_{k}.vtu\"/>");
    let list = format!(
        "<VTKFile type=\"Collection\"><Collection>{}{}</Collection></VTKFile>",
        entry(0.25, 1),
        entry(0.5, 2)
    );
    write(at, "u.pvd", &list);
    for (words, times) in [
        (["u.pvd"], json!([0.25, 0.5])),
        (["u_*.vtk"], json!([1.0, 2.0])),
    ] {
        let told = info(at, &words);
        assert_eq!(told["times"], times);
        assert_eq!(told["box"][1], json!([1.0, 1.0, 2.0]));
        let field = &told["fields"][0];
        assert_eq!(
            (&field["largest"], &field["not_finite"]),
            (&json!(2.0), &json!(1))
        );
        assert!(told["warnings"][0].as_str().unwrap().contains("last file"));
    }
    assert_eq!(info(at, &["u_1.vtu"])["times"], json!([]));
    let page = run(at, &["mesh", "info", "u.pvd", "--report", "page"]);
    assert!(
        page.stdout.contains("2, from 0.25 to 0.5"),
        "{}",
        page.stdout
    );
    let html = fs::read_to_string(at.join("page/index.html")).unwrap();
    assert!(html.contains("aria-label=\"u on points\""), "{html}");
}

#[test]
fn a_page_has_the_groups_and_a_check_the_worst_cells() {
    let folder = folder();
    let at = folder.path();
    write(at, "m.mesh", MESH);
    run(at, &["mesh", "info", "m.mesh", "--report", "info"]);
    let html = fs::read_to_string(at.join("info/index.html")).unwrap();
    for part in [
        "aria-label=\"groups of the mesh\"",
        ">5 (1 cells)<",
        ">8 (1 cells)<",
    ] {
        assert!(html.contains(part), "{part}");
    }
    let sound = run(at, &["mesh", "check", "m.mesh", "--report", "check"]);
    assert_eq!(sound.code, Some(0), "{}", sound.stdout);
    // tan of the smallest angle is 1/2; of 2·√5·(3+√5)/(4√3) is half.
    for part in ["smallest angle: 26.57 to 26.57", "worst aspect ratio", "█"] {
        assert!(sound.stdout.contains(part), "{part}: {}", sound.stdout);
    }
    let html = fs::read_to_string(at.join("check/index.html")).unwrap();
    assert!(html.contains("aria-label=\"the worst cells\""));
    // A point that is there twice is a slit, and the second cell the other way round is inverted.
    let slit = MESH
        .replace("Vertices 4", "Vertices 5")
        .replace("0 1 0\n", "0 1 0  0 0 0\n")
        .replace("1 3 4 8", "5 4 3 8");
    write(at, "slit.mesh", &slit);
    let ran = run(at, &["mesh", "check", "slit.mesh", "--json", "-"]);
    let told = ran.json();
    valid(at, "mesh-check", &ran.stdout);
    assert_eq!(ran.code, Some(1));
    assert_eq!(
        (
            &told["duplicate_points"]["count"],
            &told["inverted"]["count"]
        ),
        (&json!(1), &json!(1))
    );
    assert_eq!(told["quality"][3]["what"], "scaled Jacobian");
}
