//! `faceoff compare` on results of several times, on folders, and on curves.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, assert_valid, dolfinx, faceoff, folder, run, source, told, write};

fn compare(folder: &Path, words: &[&str]) -> Ran {
    run(folder, &[&["compare"], words, &["--json", "-"]].concat())
}

fn refused(folder: &Path, words: &[&str], part: &str) {
    let ran = compare(folder, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
    assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
}

/// Times and verdicts of the parts.
fn parts(ran: &Ran) -> Vec<(f64, String)> {
    let told = ran.json();
    let parts = told["parts"].as_array().unwrap().iter();
    let part = |of: &Value| {
        (
            of["time"].as_f64().unwrap(),
            of["verdict"].as_str().unwrap().to_owned(),
        )
    };
    parts.map(part).collect()
}

/// u = t x, written by dolfinx as PVD and XDMF; in `off` the value at the last time is wrong, `half` lacks a time.
#[test]
fn series_of_dolfinx_are_matched_by_time() {
    let folder = folder();
    let at = folder.path();
    let script = r#"
import numpy as np
from dolfinx import fem, io, mesh
from mpi4py import MPI
m = mesh.create_unit_square(MPI.COMM_WORLD, 3, 3)
u = fem.Function(fem.FunctionSpace(m, ("Lagrange", 1)), name="u")
for name, times, error in [("a", [0, 0.1, 0.2], 0), ("off", [0, 0.1, 0.1 + 0.1], 1e-3), ("half", [0, 0.2], 0)]:
    with io.VTKFile(m.comm, name + ".pvd", "w") as pvd, io.XDMFFile(m.comm, name + ".xdmf", "w") as xdmf:
        xdmf.write_mesh(m)
        for t in times:
            u.interpolate(lambda x: t * x[0] + error * (t > 0.15) * x[1])
            pvd.write_function(u, t)
            xdmf.write_function(u, t)
"#;
    dolfinx(at, script, &[]);
    for suffix in ["pvd", "xdmf"] {
        let [a, off, half] = ["a", "off", "half"].map(|name| format!("{name}.{suffix}"));
        let ran = compare(at, &[&a, &off]);
        assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
        let verdicts = [(0.0, "agree"), (0.1, "agree"), (0.2, "disagree")];
        assert_eq!(parts(&ran), verdicts.map(|(t, v)| (t, v.to_owned())));
        let text = run(at, &["compare", &a, &off, "--json", "o.json"]).stdout;
        assert!(text.contains("time 0.2"), "{text}");
        assert_valid(
            "json",
            "src/report/schema/compare-1.json",
            &at.join("o.json"),
        );
        assert_eq!(compare(at, &[&a, &off, "--rtol", "1e-2"]).code, Some(0));
        assert_eq!(compare(at, &[&a, &off, "--time", "0.1"]).code, Some(0));
        assert_eq!(compare(at, &[&a, &off, "--times", "last"]).code, Some(1));
        // A missing time is no pass, unless what lies between is asked for.
        for (one, two) in [(&a, &half), (&half, &a)] {
            let ran = compare(at, &[one, two]);
            assert_eq!(ran.code, Some(2), "{}", ran.stdout);
            assert_eq!(parts(&ran)[1], (0.1, "undetermined".into()));
        }
        assert_eq!(
            compare(at, &[&a, &half, "--interpolate", "--rtol", "1e-14"]).code,
            Some(0)
        );
        let ran = run(at, &["compare", &half, &a, "--interpolate"]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let note = format!("1 of the 3 times of {a} lie between times of {half}");
        assert!(ran.stdout.contains(&note), "{}", ran.stdout);
        refused(at, &[&a, &half, "--time", "0.1"], "has no time 0.1");
        // The page has a line through the times, and the map of the one that is farthest from agreement.
        let page = format!("page-{suffix}");
        run(at, &["compare", &a, &off, "--report", &page]);
        let html = fs::read_to_string(at.join(&page).join("index.html")).unwrap();
        for part in [
            "<em>u</em> differs in 1 of 3 times",
            "<b>Largest |a − b|</b> relative to the largest value of its field, time by time",
            "aria-label=\"Largest |a − b| relative to the largest value of its field, time by time\"",
            "<title>time 0.2, u: ",
            "Farthest from agreement: time 0.2",
            "aria-label=\"map of differences of u\"",
            "aria-label=\"histogram over the colour scale\"",
        ] {
            assert!(html.contains(part), "{page}: {part}");
        }
        let of = at.join(&page).join("differences.vtu");
        let info = run(at, &["mesh", "info", of.to_str().unwrap()]);
        assert!(info.stdout.contains(" u "), "{}", info.stdout);
    }
    assert_eq!(compare(at, &["a.pvd", "a.xdmf"]).code, Some(0));
    let single = "a_p0_000001.vtu";
    refused(
        at,
        &[single, "off.pvd"],
        "is of no time, and off.pvd has 3 times",
    );
    assert_eq!(
        compare(at, &[single, "off.pvd", "--time", "0.1"]).code,
        Some(0)
    );
    refused(at, &["a.pvd", "a.pvd"], "a file against itself");
}

/// Views in an MSH file, as Gmsh writes them.
#[test]
fn views_are_matched_by_time() {
    let folder = folder();
    let at = folder.path();
    let views = |last: &str| {
        let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
                    $Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n";
        let view = |time: f64, step: usize, value: &str| {
            format!(
                "$NodeData\n1\n\"u\"\n1\n{time}\n3\n{step}\n1\n3\n1 1\n2 2\n3 {value}\n$EndNodeData\n"
            )
        };
        format!("{head}{}{}", view(0.5, 0, "3"), view(1.5, 1, last))
    };
    write(at, "a.msh", &views("3"));
    write(at, "b.msh", &views("4"));
    let ran = compare(at, &["a.msh", "b.msh"]);
    assert_eq!(
        parts(&ran),
        [(0.5, "agree".to_owned()), (1.5, "disagree".to_owned())]
    );
    assert_eq!(
        compare(at, &["a.msh", "b.msh", "--time", "0.5"]).code,
        Some(0)
    );
}

#[test]
fn numbered_files_and_folders() {
    let folder = folder();
    let at = folder.path();
    let table = |path: &str, value: &str| write(at, path, &format!("vertex,u\n0,1\n1,{value}\n"));
    for k in 8..12 {
        table(&format!("a/u_{k}.csv"), &k.to_string());
        table(&format!("b/u_{k}.csv"), &format!("{k}.0"));
    }
    let ran = compare(at, &["a/u_*.csv", "b/u_*.csv"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(
        parts(&ran).iter().map(|p| p.0).collect::<Vec<_>>(),
        [8.0, 9.0, 10.0, 11.0]
    );
    let ran = compare(at, &["a", "b"]);
    assert_eq!(
        (ran.code, ran.json()["parts"].as_array().unwrap().len()),
        (Some(0), 4)
    );
    refused(at, &["a", "a"], "");
    refused(at, &["a", "b/u_8.csv"], "b/u_8.csv is not");
    refused(
        at,
        &["a", "b", "--include", "*.vtu"],
        "has a result to compare",
    );
    // What is missing on either side, and what cannot be read, is no pass.
    table("a/deep/v.csv", "7");
    fs::write(at.join("b/log.txt"), "words").unwrap();
    for (one, two) in [("a", "b"), ("b", "a")] {
        let ran = compare(at, &[one, two]);
        assert_eq!(ran.code, Some(2));
        assert!(
            ran.stdout.contains("deep/v.csv") && ran.stdout.contains("b does not have it"),
            "{}",
            ran.stdout
        );
        assert!(ran.stdout.contains("log.txt"), "{}", ran.stdout);
        assert_eq!(compare(at, &[one, two, "--exclude", "v.csv"]).code, Some(0));
        assert_eq!(compare(at, &[one, two, "--include", "u_*"]).code, Some(0));
    }
    fs::write(at.join("a/u_9.csv"), "nothing").unwrap();
    assert_eq!(compare(at, &["a", "b", "--include", "u_*"]).code, Some(2));
    table("a/u_9.csv", "9.5");
    let ran = run(
        at,
        &[
            "compare",
            "a",
            "b",
            "--include",
            "u_*",
            "--json",
            "o.json",
            "--junit",
            "o.xml",
        ],
    );
    assert_eq!(ran.code, Some(1));
    assert!(
        ran.stdout.contains("u_9.csv, `u`: 1 of 2 beyond"),
        "{}",
        ran.stdout
    );
    assert_valid(
        "json",
        "src/report/schema/compare-1.json",
        &at.join("o.json"),
    );
    assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
}

#[test]
fn curves_are_matched_by_time_and_columns_by_name() {
    let folder = folder();
    let at = folder.path();
    write(
        at,
        "a.csv",
        "time,drag,lift\n0,1,2\n0.1,1.5,3\n0.2,1.25,4\n",
    );
    write(
        at,
        "b.csv",
        "lift,time,drag\n4,0.2,1.25\n2,0,1\n3,0.1,1.5\n",
    );
    assert_eq!(compare(at, &["a.csv", "b.csv"]).code, Some(0));
    write(
        at,
        "b.csv",
        "lift,time,drag\n4,0.2,1.25\n2,0,1\n3.5,0.1,1.5\n",
    );
    let ran = compare(at, &["a.csv", "b.csv"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let told = ran.json();
    let lift = &told["fields"]
        .as_array()
        .unwrap()
        .iter()
        .find(|f| f["field"] == "lift")
        .unwrap()["worst"];
    assert_eq!(
        (&lift["midpoint"][0], &lift["b"]),
        (&0.1.into(), &3.5.into())
    );
    write(at, "short.csv", "time,drag,lift\n0,1,2\n0.2,1.25,4\n");
    refused(
        at,
        &["a.csv", "short.csv"],
        "one has 3 rows, the other 2 rows",
    );
    write(at, "rows.csv", "drag,lift\n1,2\n1.5,3\n1.25,4\n");
    refused(
        at,
        &["a.csv", "rows.csv"],
        "one has rows by their time, the other rows in their order",
    );
    write(at, "other.csv", "drag,lift\n1,2\n1.5,3\n1.25,4.5\n");
    let ran = compare(at, &["rows.csv", "other.csv"]);
    assert_eq!(ran.json()["fields"][1]["worst"]["vertices"][0], 2);
    write(at, "x.csv", "x,u\n1,2\n");
    refused(at, &["x.csv", "x.csv"], "");
    refused(at, &["x.csv", "rows.csv"], "no column is a key");
}

#[test]
fn components_and_magnitudes_are_fields() {
    let folder = folder();
    let at = folder.path();
    let vtu = |v: &str| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
             <Piece NumberOfPoints=\"3\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" \
             NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Cells>\
             <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
             <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray></Cells><PointData>\
             <DataArray type=\"Float32\" Name=\"v\" NumberOfComponents=\"3\" format=\"ascii\">{v}</DataArray>\
             </PointData></Piece></UnstructuredGrid></VTKFile>"
        )
    };
    write(at, "a.vtu", &vtu("3 4 0 6 8 0 0 1 0"));
    write(at, "b.vtu", &vtu("4 3 0 8 6 0 1 0 0"));
    assert_eq!(compare(at, &["a.vtu", "b.vtu"]).code, Some(1));
    assert_eq!(
        compare(at, &["a.vtu", "b.vtu", "--only", "|v|"]).code,
        Some(0)
    );
    assert_eq!(
        compare(at, &["a.vtu", "b.vtu", "--only", "v[2]"]).code,
        Some(0)
    );
    assert_eq!(
        compare(at, &["a.vtu", "b.vtu", "--only", "v[0]"]).code,
        Some(1)
    );
    assert_eq!(
        compare(
            at,
            &["a.vtu", "b.vtu", "--pair", "v[0]=v[1]", "--only", "v[0]"]
        )
        .code,
        Some(0)
    );
    let told = compare(at, &["a.vtu", "b.vtu"]).json();
    assert_eq!(told["fields"][0]["worst"]["component"], 0);
    // Binary32 is allowed its rounding, and that is told; a table has no places of its own.
    write(at, "s.csv", "vertex,speed\n0,5.0000001\n1,10\n2,1\n");
    let ran = run(
        at,
        &[
            "compare",
            "s.csv",
            "a.vtu",
            "--pair",
            "speed=|v|",
            "--only",
            "speed",
        ],
    );
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout.contains("f32: 6e-8 is its rounding"),
        "{}",
        ran.stdout
    );
    let words = [
        "s.csv",
        "a.vtu",
        "--pair",
        "speed=|v|",
        "--only",
        "speed",
        "--rtol",
        "1e-9",
    ];
    let ran = compare(at, &words);
    assert_eq!(ran.code, Some(1));
    assert_eq!(
        ran.json()["fields"][0]["worst"]["midpoint"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
}

/// Exodus files of three times, on HDF5.
#[test]
fn exodus_steps_are_matched_by_time() {
    let folder = folder();
    let at = folder.path();
    let script = r#"
import meshio
import netCDF4
import numpy as np
points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])
cells = [("triangle", np.array([[0, 1, 2], [1, 3, 2]]))]
mesh = meshio.Mesh(points, cells, point_data={"u": np.array([1.0, 2, 3, 4])})
meshio.write("one.e", mesh, file_format="exodus")
for name, off in [("a.e", 0), ("b.e", 0.5)]:
    with netCDF4.Dataset("one.e") as one, netCDF4.Dataset(name, "w") as many:
        many.setncatts(one.__dict__)
        for key, dim in one.dimensions.items():
            many.createDimension(key, None if dim.isunlimited() else len(dim))
        for key, old in one.variables.items():
            new = many.createVariable(key, old.dtype, old.dimensions)
            new.setncatts(old.__dict__)
            old.set_auto_mask(False)
            new[:] = old[:]
        many["time_whole"][:] = [0.0, 0.1, 0.2]
        first = np.array(many["vals_nod_var1"][0])
        for k in range(3):
            many["vals_nod_var1"][k] = (k + 1) * first + (off if k == 2 else 0)
"#;
    let script = write(at, "write.py", script);
    let python = source("target/python/bin/python3");
    let ran = told(
        Command::new(&python)
            .arg(script)
            .current_dir(at)
            .output()
            .unwrap(),
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let compare = |words: &[&str]| {
        let mut program = faceoff(at);
        program.env("FACEOFF_MESHIO_PYTHON", &python);
        program
            .arg("compare")
            .args(["a.e", "b.e"])
            .args(words)
            .args(["--json", "-"]);
        told(program.output().unwrap())
    };
    let ran = compare(&[]);
    // Times are binary32 there.
    for ((time, verdict), exact) in parts(&ran).into_iter().zip([0.0, 0.1, 0.2]) {
        assert!((time - exact).abs() < 1e-7, "{time}");
        assert_eq!(verdict == "disagree", exact == 0.2);
    }
    assert_eq!(ran.code, Some(1));
    assert_eq!(compare(&["--time", "0.1"]).code, Some(0));
}
