//! `faceoff compare` on files of its own, of FreeFEM, of dolfinx, of meshio, and tables.
//!
//! FreeFEM's writers are plugins of its own: Debian's package `libfreefem++`, which `tests/run` installs.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{Ran, dolfinx, folder, run, write};

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
    // A deterministic code gives the same bytes again.
    for words in [
        &["a.vtu", "copy.vtu"][..],
        &["a.vtu", "copy.vtu", "--allow-identical"],
    ] {
        let ran = compare(at, words);
        assert_eq!(
            (ran.code, &ran.json()["identical"]),
            (Some(0), &true.into())
        );
    }
    let ran = run(at, &["compare", "a.vtu", "copy.vtu"]);
    assert!(ran.stdout.contains("identical bytes"), "{}", ran.stdout);
    // And NaN is no result, however often it comes.
    write(at, "n.csv", "vertex,u\n0,nan\n1,2\n");
    fs::copy(at.join("n.csv"), at.join("nan.csv")).unwrap();
    assert_eq!(compare(at, &["n.csv", "nan.csv"]).code, Some(1));
    assert_eq!(
        compare(at, &["n.csv", "nan.csv", "--nan-equal", "u"]).code,
        Some(0)
    );
    refused(
        at,
        &["n.csv", "nan.csv", "--nan-equal", "w"],
        "neither has a field `w`",
    );
    write(at, "number.csv", "vertex,u\n0,1\n1,2\n");
    assert_eq!(
        compare(at, &["n.csv", "number.csv", "--nan-equal", "u"]).code,
        Some(1)
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
    for (a, b, code) in [
        // As functions.
        ("a.vtu", "b.vtu", 1),
        ("a-faces.vtu", "b-faces.vtu", 1),
        ("a.vtu", "a-faces.vtu", 2),
    ] {
        assert_eq!(compare(at, &[a, b]).code, Some(code), "{a}, {b}");
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
        "mean:rtol=1e-14,atol=0",
    ];
    assert_eq!(compare(at, &own).code, Some(1));
    refused(
        at,
        &["a.vtu", "c.vtu", "--field", "w:rtol=1"],
        "neither has the field `w`",
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
        let of_a: Vec<String> = fields(a)
            .iter()
            .map(|name| name.trim_end_matches(" rust").to_owned())
            .collect();
        assert_eq!(fields("d.vtu"), of_a);
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
    write(at, "q.csv", "x,y,u\n0.33334,1,3\n0,0,1\n1,0,2\n");
    refused(at, &["p.csv", "q.csv"], "has no point");
    assert_eq!(
        compare(at, &["p.csv", "q.csv", "--place-tolerance", "1e-4"]).code,
        Some(0)
    );
    // Whatever the number of digits from six on.
    for digits in 6..=16 {
        write(
            at,
            "q.csv",
            &format!("x,y,u\n0.{},1,3\n0,0,1\n1,0,2\n", "3".repeat(digits)),
        );
        let ran = compare(at, &["p.csv", "q.csv"]);
        assert_eq!(ran.code, Some(0), "{digits}: {}", ran.stderr);
        assert_eq!(ran.json()["map"], "coordinates");
    }
    refused(at, &["faces.csv", "p.csv"], "faces.csv has no coordinates");
    refused(at, &["p.csv", "faces.csv"], "faces.csv has no coordinates");
    write(at, "twice.csv", "x,y,u\n0,0,1\n0,0,2\n1,0,3\n");
    refused(at, &["p.csv", "twice.csv"], "ambiguous");
    for (name, text, part) in [
        ("nan.csv", "vertex,u\n0,1\n1,nan\n2,3\n", ""),
        ("missing.csv", "vertex,w\n0,1\n1,2\n2,3\n", ""),
        ("short.csv", "vertex,u\n0,1\n1,2\n", "one has 3 points"),
        ("partial.csv", "vertex,u\n0,1\n1,\n2,3\n", ""),
        ("empty.csv", "vertex,u\n", "the other 0 points"),
        ("keyless.csv", "u\n1\n", "the other rows in their order"),
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
    let content = faceoff_mesh::io::open(&at.join("a-faces.vtu"), None).unwrap();
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
    assert_eq!(keep.fields.len(), 1);
    faceoff_mesh::io::write(&at.join("mean.vtu"), &keep, &Default::default()).unwrap();
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
    assert_eq!(
        compare(at, &["a.csv", "b.csv", "--only", "u*"]).code,
        Some(0)
    );
    for pattern in ["label", "lab*"] {
        let ran = compare(at, &["a.csv", "b.csv", "--except", pattern]);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    }
    refused(at, &["a.csv", "b.csv", "--except", "*"], "has no field");
    write(at, "l.csv", "vertex,u,Label\n0,1,7\n1,2,7\n");
    let ran = compare(at, &["l.csv", "b.csv"]);
    assert!(
        ran.stdout
            .contains("rather than a result: select the results with --only"),
        "{}",
        ran.stdout
    );
}

/// A point that no cell has, with a value of its own, does not keep the rest from being judged.
#[test]
fn points_of_no_cell_are_left_out_with_a_word() {
    let folder = folder();
    let at = folder.path();
    let text = |points: &str, count: usize, values: &str| {
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{count}\n1 0 0 0\n2 1 0 0\n3 0 1 0\n{points}$EndNodes\n\
             $Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n\
             $NodeData\n1\n\"u\"\n1\n0\n3\n0\n1\n{count}\n1 1\n2 2\n3 3\n{values}$EndNodeData\n"
        )
    };
    write(at, "a.msh", &text("", 3, ""));
    write(at, "b.msh", &text("4 5 5 0\n", 4, "4 9\n"));
    write(at, "c.msh", &text("4 5 5 0\n", 4, "4 8\n"));
    let ran = compare(at, &["a.msh", "b.msh"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let word = "b.msh: left out 1 points that are in no cell";
    assert!(ran.stderr.contains(word), "{}", ran.stderr);
    // Where both have it, it is judged.
    assert_eq!(compare(at, &["b.msh", "c.msh"]).code, Some(1));
}

/// Runs a script of FreeFEM that loads its plugins.
fn freefem(folder: &Path, script: &str) {
    let plugins = "/usr/lib/freefem++";
    assert!(
        Path::new(plugins).join("iovtk.so").is_file(),
        "FreeFEM's plugins are there: apt-get install libfreefem++"
    );
    let script = write(folder, "write.edp", script);
    let mut freefem = Command::new("FreeFem++");
    freefem.args(["-nw", "-v", "0"]).arg(script);
    freefem.env("FF_LOADPATH", format!("{plugins};;"));
    let ran = crate::common::told(freefem.current_dir(folder).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

/// sin(3x) + y² at vertices, x y² at centroids and (y, x²) at vertices, by FreeFEM in all its own forms; in the second
/// files one value of each is off.
const BY_FREEFEM: &str = r#"
load "iovtk"
load "medit"
mesh Th = square(5, 4, [x + 0.05*sin(3*y), y]);
savemesh(Th, "mesh.msh");
fespace Vh(Th, P1);
fespace Wh(Th, P0);
Vh u = sin(3*x) + y^2, vx = y, vy = x^2;
Wh w = x*y^2;
int[int] order = [1, 0, 1];
for (int wrong = 0; wrong < 2; wrong++) {
    string name = wrong ? "off" : "freefem";
    u[][7] += wrong*1e-6;
    w[][3] += wrong*1e-6;
    vy[][11] += wrong*1e-6;
    savevtk(name + ".vtu", Th, u, w, [vx, vy], dataname="u w v", order=order);
    savevtk(name + "-ascii.vtu", Th, u, w, [vx, vy], dataname="u w v", order=order, bin=false);
    ofstream table(name + ".csv");
    table.precision(17);
    table << "x,y,u" << endl;
    for (int k = 0; k < Th.nv; k++)
        table << Th(k).x << "," << Th(k).y << "," << u[][k] << endl;
    // Six digits are all that this writer keeps.
    u[][7] += wrong*1e-3;
    savemesh(Th, name + ".mesh");
    savesol(name + ".sol", Th, u);
}
"#;

/// The same functions by dolfinx on the same mesh, points and cells in another order.
const BY_DOLFINX: &str = r#"
import numpy as np
import ufl
from dolfinx import fem, io, mesh
from mpi4py import MPI
x = np.loadtxt("freefem.csv", delimiter=",", skiprows=1)[:, :2]
lines = [line.split() for line in open("mesh.msh")]
points, cells = int(lines[0][0]), int(lines[0][1])
t = np.array([line[:3] for line in lines[1 + points : 1 + points + cells]], dtype=int) - 1
new = np.random.default_rng(5).permutation(points)
order = np.random.default_rng(6).permutation(cells)
moved = np.empty_like(x)
moved[new] = x
domain = ufl.Mesh(ufl.VectorElement("Lagrange", "triangle", 1))
m = mesh.create_mesh(MPI.COMM_WORLD, new[t][order], moved, domain)
u = fem.Function(fem.FunctionSpace(m, ("Lagrange", 1)), name="u")
u.interpolate(lambda x: np.sin(3 * x[0]) + x[1] ** 2)
v = fem.Function(fem.VectorFunctionSpace(m, ("Lagrange", 1)), name="v")
v.interpolate(lambda x: (x[1], x[0] ** 2))
w = fem.Function(fem.FunctionSpace(m, ("DG", 0)), name="w")
w.interpolate(lambda x: x[0] * x[1] ** 2)
with io.VTKFile(m.comm, "dolfinx.pvd", "w") as file:
    file.write_function([u, v, w])
with io.XDMFFile(m.comm, "dolfinx.xdmf", "w") as file:
    file.write_mesh(m)
    file.write_function(u)
    file.write_function(w)
    u.name = "temperature"
    file.write_function(u)
"#;

#[test]
fn what_freefem_and_dolfinx_write_is_compared_as_it_is() {
    let folder = folder();
    let at = folder.path();
    freefem(at, BY_FREEFEM);
    dolfinx(at, BY_DOLFINX, &[]);
    let fields = |told: &serde_json::Value| -> Vec<(String, u64, u64)> {
        let fields = told["fields"].as_array().unwrap().iter();
        let mut fields: Vec<_> = fields
            .map(|f| {
                let number = |key: &str| f[key].as_u64().unwrap();
                let name = f["field"].as_str().unwrap().to_owned();
                (name, number("faces"), number("beyond"))
            })
            .collect();
        fields.sort();
        fields
    };
    let all = |beyond: u64| {
        [("u", 30), ("v", 30), ("w", 40)].map(|(name, on)| (name.to_owned(), on, beyond))
    };
    // FreeFEM has the sides of the square as cells, and their labels as a field.
    refused(at, &["freefem.vtu", "dolfinx.pvd"], "--dim 2");
    let only = ["--dim", "2", "--only", "u", "--only", "v", "--only", "w"];
    for by_freefem in ["freefem.vtu", "freefem-ascii.vtu"] {
        for pair in [[by_freefem, "dolfinx.pvd"], ["dolfinx.pvd", by_freefem]] {
            let ran = compare(at, &[&pair[..], &only].concat());
            assert_eq!(ran.code, Some(0), "{pair:?}: {}{}", ran.stdout, ran.stderr);
            let told = ran.json();
            assert_eq!(told["map"], "coordinates");
            assert_eq!(fields(&told), all(0));
        }
    }
    for pair in [["off.vtu", "dolfinx.pvd"], ["dolfinx.pvd", "off.vtu"]] {
        let ran = compare(at, &[&pair[..], &only].concat());
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        let told = ran.json();
        assert_eq!(fields(&told), all(1));
        let found = told["fields"].as_array().unwrap();
        let u = found.iter().find(|f| f["field"] == "u").unwrap();
        let off = (u["max_abs"].as_f64().unwrap() - 1e-6).abs();
        // The eighth vertex: six in each row.
        let place = u["worst"]["midpoint"].as_array().unwrap();
        let y = place[1].as_f64().unwrap();
        assert!(off < 1e-12 && (y - 0.25).abs() < 1e-6, "{u}");
    }

    let with = |file: &str, words: &[&str], code: i32, other: &str| {
        let ran = compare(at, &[&[file, other, "--only", "u"], words].concat());
        let all = format!("{file}, {other}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(ran.code, Some(code), "{all}");
    };
    for other in ["dolfinx.pvd", "dolfinx.xdmf"] {
        with("freefem.csv", &[], 0, other);
        with("off.csv", &[], 1, other);
        with("off.csv", &["--rtol", "1e-5"], 0, other);
        let rounded = ["--rtol", "1e-5", "--pair", "sol=u", "--only", "sol"];
        with("freefem.sol", &rounded, 0, other);
        with("off.sol", &rounded, 1, other);
        with("freefem.vtu", &["--dim", "2"], 0, other);
        with("off.vtu", &["--dim", "2"], 1, other);
    }
    let named = ["--pair", "u=temperature", "--only", "u"];
    let ran = compare(at, &[&["freefem.csv", "dolfinx.xdmf"], &named[..]].concat());
    // Two of the second file's fields have that name now.
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    fs::remove_file(at.join("freefem.mesh")).unwrap();
    refused(
        at,
        &["freefem.sol", "dolfinx.pvd"],
        "freefem.mesh: cannot read",
    );
}

#[test]
fn the_faces_of_two_engines_have_fields_of_the_same_names() {
    let folder = folder();
    let at = folder.path();
    for engine in ["rust", "freefem", "fenicsx"] {
        solve(at, engine, &format!("{engine}.vtu"));
    }
    let words = [
        "solve", "one-zone", "--n", "6", "--engine", "freefem", "--gamma0", "100.001", "--out",
        "off.vtu", "--quiet",
    ];
    assert_eq!(run(at, &words).code, Some(0));
    for (a, b) in [
        ("rust", "freefem"),
        ("freefem", "fenicsx"),
        ("fenicsx", "rust"),
    ] {
        for kind in ["", "-faces"] {
            let [a, b, off] = [a, b, "off"].map(|name| format!("{name}{kind}.vtu"));
            let ran = compare(at, &[&a, &b]);
            assert_eq!(ran.code, Some(0), "{a}, {b}: {}{}", ran.stdout, ran.stderr);
            let told = ran.json();
            let fields = told["fields"].as_array().unwrap();
            let named = |name: &str| fields.iter().any(|f| f["field"] == name);
            let names = if kind.is_empty() {
                ["u", "mean", "gradient"]
            } else {
                ["mean", "flux", "P"]
            };
            assert!(names.iter().all(|name| named(name)), "{told:#}");
            assert_eq!(compare(at, &[&a, &off]).code, Some(1), "{a}, {off}");
        }
    }
}

#[test]
fn fields_of_other_names_are_paired() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u,v\n0,1,5\n1,2,6\n");
    write(at, "b.csv", "vertex,T,v\n1,2,6\n0,1,5\n");
    assert_eq!(compare(at, &["a.csv", "b.csv"]).code, Some(2));
    assert_eq!(
        compare(at, &["a.csv", "b.csv", "--pair", "u=T"]).code,
        Some(0)
    );
    // Two fields that change places are another answer.
    let swapped = ["a.csv", "b.csv", "--pair", "u=v", "--pair", "v=T"];
    assert_ne!(compare(at, &swapped).code, Some(0));
    refused(
        at,
        &["a.csv", "b.csv", "--pair", "w=T"],
        "a.csv has no field `w`",
    );
    refused(
        at,
        &["a.csv", "b.csv", "--pair", "u=w"],
        "b.csv has no field `w`",
    );
    refused(at, &["a.csv", "b.csv", "--pair", "u"], "is not NAME=OTHER");
}

#[test]
fn tolerances_are_those_of_the_scene_unless_options_say_otherwise() {
    let folder = folder();
    let at = folder.path();
    write(at, "a.csv", "vertex,u,v\n0,1,5\n1,2,6\n");
    write(at, "b.csv", "vertex,u,v\n0,1.001,5\n1,2,6.00001\n");
    let scene = |name: &str, tables: &str| {
        let text = fs::read_to_string(crate::common::source(
            "crates/fem/src/scene/builtin/one-zone.toml",
        ))
        .unwrap();
        write(at, name, &format!("{text}\n{tables}"));
    };
    scene("plain.toml", "");
    scene("all.toml", "[compare]\nrtol = 1e-3\n");
    scene(
        "own.toml",
        "[compare.fields]\nu = { atol = 1e-2 }\nother = { rtol = 0 }\n",
    );
    scene(
        "both.toml",
        "[compare]\nrtol = 1e-5\n[compare.fields.u]\nrtol = 1e-3\n",
    );
    scene("wrong.toml", "[compare.fields.u]\nrtol = -1\n");
    let code = |words: &[&str]| compare(at, &[&["a.csv", "b.csv"], words].concat()).code;
    assert_eq!(code(&[]), Some(1));
    assert_eq!(code(&["--scene", "all.toml"]), Some(0));
    assert_eq!(code(&["--scene", "own.toml"]), Some(1));
    assert_eq!(code(&["--scene", "own.toml", "--rtol", "1e-5"]), Some(0));
    assert_eq!(code(&["--scene", "both.toml"]), Some(0));
    assert_eq!(
        code(&["--scene", "both.toml", "--field", "u:rtol=1e-6"]),
        Some(1)
    );
    assert_eq!(code(&["--scene", "all.toml", "--rtol", "1e-9"]), Some(1));
    for (name, part) in [
        ("plain.toml", "it gives no tolerances"),
        ("wrong.toml", "compare.fields.u.rtol: -1 is not a tolerance"),
        ("none.toml", "none.toml: cannot read"),
    ] {
        refused(at, &["a.csv", "b.csv", "--scene", name], part);
    }
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
    dolfinx(at, script, &[]);
    let ran = compare(at, &["cg000000.pvtu", "dg_p0_000000.vtu"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let told = ran.json();
    assert_eq!(
        (&told["map"], &told["fields"][0]["faces"]),
        (&"coordinates".into(), &96.into())
    );
    // A list of files is these files.
    for (a, b) in [
        ("cg.pvd", "cg000000.pvtu"),
        ("cg000000.pvtu", "cg_p0_000000.vtu"),
        ("cg_p0_000000.vtu", "cg.pvd"),
    ] {
        refused(at, &[a, b], "a file against itself");
    }
    fs::copy(at.join("cg_p0_000000.vtu"), at.join("copy.vtu")).unwrap();
    assert_eq!(
        compare(at, &["cg.pvd", "copy.vtu"]).json()["identical"],
        true
    );
    assert_eq!(compare(at, &["cg.pvd", "dg.pvd"]).code, Some(0));
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
    crate::common::assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
    crate::common::assert_valid(
        "json",
        "src/report/schema/compare-1.json",
        &at.join("o.json"),
    );
    let xml = fs::read_to_string(at.join("o.xml")).unwrap();
    assert!(
        xml.contains("tests=\"2\" failures=\"1\" errors=\"1\""),
        "{xml}"
    );
    assert!(xml.contains("message=\"b.csv does not have it\""), "{xml}");
    assert!(
        fs::read_to_string(at.join("o.svg"))
            .unwrap()
            .contains("disagree")
    );
    // What could not be judged does not leave an earlier verdict behind.
    let words = [
        "compare", "a.csv", "none.csv", "--json", "o.json", "--junit", "o.xml", "--badge", "o.svg",
    ];
    assert_eq!(run(at, &words).code, Some(2));
    crate::common::assert_valid("xsd", "tests/junit.xsd", &at.join("o.xml"));
    let schema = "src/report/schema/compare-1.json";
    crate::common::assert_valid("json", schema, &at.join("o.json"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    assert!(told.contains("none.csv: cannot read"), "{told}");
    let badge = fs::read_to_string(at.join("o.svg")).unwrap();
    assert!(badge.contains(">undetermined<"));
}
