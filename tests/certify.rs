//! Guaranteed bounds of what files of any code hold: the same as those of `solve --certify` where the file has the same
//! function, and a refusal in words where it has none.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, dolfinx, folder, run, told, write};
use faceoff_mesh::io;
use faceoff_mesh::mesh::{Mesh, Support, Values};

fn certify(at: &Path, words: &[&str]) -> Ran {
    run(at, &[&["certify"], words, &["--json", "-"]].concat())
}

/// What is certified, and how the file was understood.
fn certified(at: &Path, words: &[&str]) -> Value {
    let ran = certify(at, words);
    assert_eq!(ran.code, Some(0), "{words:?}: {}", ran.stderr);
    ran.json()
}

fn refused(at: &Path, words: &[&str], part: &str) {
    let ran = certify(at, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
    assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
    assert!(ran.json()["error"].is_string());
}

/// The numbers of two certificates are the same to 1e-9 of the bound.
fn assert_same(a: &Value, b: &Value) {
    let numbers = |of: &Value| -> Vec<f64> {
        let of = &of["certificate"];
        let gradient = of["gradient"].as_array().unwrap().iter();
        let parts = of["parts"].as_object().unwrap().values();
        let bounds = of["bounds"].as_object().unwrap().values();
        let all = gradient
            .chain(parts)
            .chain(bounds)
            .chain([&of["upper"], &of["lower"]]);
        all.map(|n| n.as_f64().unwrap()).collect()
    };
    let (of_a, of_b) = (numbers(a), numbers(b));
    let scale = a["certificate"]["upper"].as_f64().unwrap();
    assert!(scale > 0.0);
    for (x, y) in of_a.iter().zip(&of_b) {
        // A contact term that is rounding has a root that is 1e-8 of it.
        assert!((x - y).abs() <= 1e-9 * scale, "{x} {y}\n{a:#}\n{b:#}");
    }
}

fn solve(at: &Path, scene: &str, n: &str, method: &str) -> Value {
    let mut words = vec!["solve", scene, "--method", method, "--out", "u.vtu"];
    if !n.is_empty() {
        words.extend(["--n", n]);
    }
    words.extend(["--certify=u_h", "--json", "-"]);
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(0), "{words:?}: {}", ran.stderr);
    ran.json()
}

/// The fields of a VTU changed by someone.
fn changed(at: &Path, from: &str, to: &str, change: impl Fn(&mut Mesh)) {
    let mut content = io::open(&at.join(from), None).unwrap();
    change(&mut content.mesh);
    io::write(&at.join(to), &content.mesh, &io::Options::default()).unwrap();
}

#[test]
fn what_solve_writes_has_the_certificate_of_what_it_solved() {
    let folder = folder();
    let at = folder.path();
    for (scene, n, method, element) in [
        ("one-zone", "8", "cr", "CR"),
        ("one-zone", "8", "cr-fc", "CR"),
        ("one-zone", "8", "p1", "P1"),
        ("one-zone", "8", "p2", "P2"),
        ("plate", "", "cr", "CR"),
        ("plate", "", "p2", "P2"),
        ("one-zone-3d", "3", "cr", "CR"),
        ("one-zone-3d", "3", "p2", "P2"),
    ] {
        let solved = solve(at, scene, n, method);
        let words = ["u.vtu", "--scene", scene, "--method", method];
        let found = certified(at, &[&words[..], &["--out", "map.vtu"]].concat());
        assert_eq!(found["understood"]["element"], element);
        assert_eq!(found["understood"]["field"], "u");
        assert_eq!(found["dofs"], solved["dofs"]);
        assert_eq!(found.get("boundary_off"), None);
        assert_same(&solved, &found);
        let map = io::read(&at.join("map.vtu")).unwrap();
        let bound = map.fields.iter().find(|f| f.name == "bound").unwrap();
        assert_eq!(bound.values.len() as u64, found["cells"].as_u64().unwrap());
        // What was written is the same function again.
        let words = ["map.vtu", "--scene", scene, "--method", method];
        assert_same(&found, &certified(at, &words));
    }
}

#[test]
fn a_function_is_the_same_by_cells_by_faces_and_by_places() {
    let folder = folder();
    let at = folder.path();
    for (scene, n) in [("one-zone", "6"), ("one-zone-3d", "2")] {
        let solved = solve(at, scene, n, "cr");
        let on = ["--scene", scene, "--n", n];
        let faces = certified(at, &[&["u-faces.vtu"][..], &on].concat());
        assert_eq!(faces["understood"]["values"], "faces");
        assert_same(&solved, &faces);
        let mesh = io::read(&at.join("u-faces.vtu")).unwrap();
        let means = mesh.fields.iter().find(|f| f.name == "mean rust").unwrap();
        let means = means.values.to_f64();
        let mut by_face = vec![["v0,v1,mean", "v0,v1,v2,mean"][solved_dim(&mesh) - 2].to_owned()];
        let mut by_place = vec!["x,y,z,u".to_owned()];
        for ((_, _, nodes), mean) in mesh.cells().zip(&means) {
            let k = nodes.len() as f64;
            let at = [0, 1, 2].map(|c| {
                nodes
                    .iter()
                    .map(|v| mesh.points[*v as usize][c])
                    .sum::<f64>()
                    / k
            });
            by_place.insert(1, format!("{},{},{},{mean:e}", at[0], at[1], at[2]));
            // The vertices of a face in any order.
            let names: Vec<String> = nodes.iter().rev().map(u32::to_string).collect();
            by_face.insert(1, format!("{},{mean:e}", names.join(",")));
        }
        write(at, "faces.csv", &(by_face.join("\n") + "\n"));
        write(at, "places.csv", &(by_place.join("\n") + "\n"));
        for (file, values) in [("faces.csv", "faces"), ("places.csv", "places")] {
            let found = certified(at, &[&[file][..], &on].concat());
            assert_eq!(found["understood"]["values"], values);
            assert_eq!(found["understood"]["element"], "CR");
            assert_same(&solved, &found);
        }
        by_face.pop();
        write(at, "short.csv", &(by_face.join("\n") + "\n"));
        refused(
            at,
            &[&["short.csv"][..], &on].concat(),
            "has no value on face",
        );
        by_place.pop();
        write(at, "short.csv", &(by_place.join("\n") + "\n"));
        refused(at, &[&["short.csv"][..], &on].concat(), "CR has");
        refused(
            at,
            &["places.csv", "--scene", scene, "--n", "5"],
            "values, and on mesh",
        );

        let solved = solve(at, scene, n, "p1");
        let found = certified(at, &["u.vtu", "--scene", scene, "--element", "p1"]);
        assert_same(&solved, &found);
        // A continuous function that is linear on the cells is also one of CR.
        let found = certified(at, &["u.vtu", "--scene", scene, "--element", "cr"]);
        assert_eq!(found["understood"]["element"], "CR");
        run(at, &["mesh", "make", scene, "mesh.msh", "--n", n]);
        let found = certified(at, &["u.vtu", "--scene", scene, "--mesh", "mesh.msh"]);
        assert_eq!(found["understood"]["boundary"], "its groups");
        assert_same(&solved, &found);
        run(at, &["mesh", "make", scene, "other.msh", "--n", "4"]);
        let words = ["u.vtu", "--scene", scene, "--mesh", "other.msh"];
        refused(at, &words, "and mesh other.msh");
    }
}

fn solved_dim(faces: &Mesh) -> usize {
    usize::from(faces.dim()) + 1
}

/// A refined or another mesh of the same domain has the parts of the scene's at the same places.
#[test]
fn the_parts_of_the_boundary_are_found_by_place() {
    let folder = folder();
    let at = folder.path();
    let words = [
        "solve",
        "one-zone",
        "--accuracy",
        "0.05",
        "--way",
        "adaptive",
        "--out",
        "u.vtu",
    ];
    let ran = run(
        at,
        &[&words[..], &["--certify=u_h", "--json", "-"]].concat(),
    );
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let words = ["u.vtu", "--scene", "one-zone", "--method", "cr-fc"];
    let found = certified(at, &words);
    let by = "the scene's mesh at the same places";
    assert_eq!(found["understood"]["boundary"], by);
    assert_same(&ran.json(), &found);
    // Coarser than the scene's own.
    let solved = solve(at, "one-zone", "2", "cr");
    assert_same(&solved, &certified(at, &["u.vtu", "--scene", "one-zone"]));
    refused(
        at,
        &["u.vtu", "--scene", "l-shape"],
        "lies on no boundary face",
    );
    refused(
        at,
        &["u.vtu", "--scene", "plate"],
        "give a result on the scene's domain",
    );
    refused(at, &["u.vtu", "--scene", "one-zone-3d"], "u.vtu");
    // The same domain, of which other parts are Γ_D.
    changed(at, "u.vtu", "moved.vtu", |mesh| {
        mesh.points.to_mut().iter_mut().for_each(|p| p[0] *= 2.0);
    });
    refused(
        at,
        &["moved.vtu", "--scene", "one-zone", "--field", "u rust"],
        "lies on no boundary face",
    );
}

#[test]
fn values_of_binary32_are_taken_as_g_and_others_are_not() {
    let folder = folder();
    let at = folder.path();
    let solved = solve(at, "plate", "", "p1");
    let upper = |of: &Value| of["certificate"]["upper"].as_f64().unwrap();
    let round = |mesh: &mut Mesh| {
        let field = mesh.fields.iter_mut().find(|f| f.name == "u rust").unwrap();
        let Values::F64(values) = &field.values else {
            panic!()
        };
        field.values = Values::F32(values.iter().map(|v| *v as f32).collect());
    };
    changed(at, "u.vtu", "single.vtu", round);
    let words = ["single.vtu", "--scene", "plate", "--field", "u rust"];
    let found = certified(at, &words);
    let off = found["boundary_off"].as_f64().unwrap();
    assert!(off > 1e-12 && off < 1e-7, "{off}");
    assert!((upper(&found) / upper(&solved) - 1.0).abs() < 1e-5);
    let ran = run(at, &[&["certify"], &words[..]].concat());
    assert!(ran.stdout.contains("taken as g"), "{}", ran.stdout);
    solve(at, "plate", "", "cr");
    changed(at, "u.vtu", "single.vtu", round);
    assert_eq!(certified(at, &words)["understood"]["element"], "CR");
    changed(at, "u.vtu", "wrong.vtu", |mesh| {
        let field = mesh.fields.iter_mut().find(|f| f.name == "u rust").unwrap();
        let Values::F64(values) = &mut field.values else {
            panic!()
        };
        values.to_mut().iter_mut().for_each(|v| *v *= 1.001);
    });
    let words = ["wrong.vtu", "--scene", "plate", "--field", "u rust"];
    refused(at, &words, "the field violates its boundary data");
}

#[test]
fn what_is_no_function_of_a_space_is_refused_in_words() {
    let folder = folder();
    let at = folder.path();
    solve(at, "one-zone", "4", "cr");
    let one = ["--scene", "one-zone"];
    let on = |words: &[&'static str]| [words, &one].concat();
    refused(at, &on(&["none.vtu"]), "cannot read");
    refused(at, &["u.vtu", "--scene", "none"], "there is no scene");
    refused(
        at,
        &on(&["u.vtu", "--field", "w"]),
        "it has no field `w`; name a field",
    );
    refused(
        at,
        &on(&["u.vtu", "--field", "mean"]),
        "`mean` is not a field at points",
    );
    refused(
        at,
        &on(&["u.vtu", "--field", "gradient"]),
        "`gradient` is not a field at points",
    );
    refused(
        at,
        &on(&["u.vtu", "--element", "p1"]),
        "no function of P1, as it jumps",
    );
    refused(at, &on(&["u.vtu", "--mesh", "none.msh"]), "none.msh");
    refused(
        at,
        &on(&["u.vtu", "--out", "map.png"]),
        "does not end in .vtu",
    );
    let field = |name: &str, of: fn(usize) -> f64| {
        changed(at, "u.vtu", name, |mesh| {
            let field = mesh.fields.iter_mut().find(|f| f.name == "u rust").unwrap();
            let count = field.values.len();
            field.values = Values::F64((0..count).map(of).collect());
        });
    };
    let named = |file: &'static str| on(&[file, "--field", "u rust"]);
    field("noise.vtu", |k| (k as f64).sin());
    refused(at, &named("noise.vtu"), "no function of CR, as it jumps");
    field("nan.vtu", |k| if k == 7 { f64::NAN } else { 0.0 });
    refused(at, &named("nan.vtu"), "is NaN");
    changed(at, "u.vtu", "two.vtu", |mesh| {
        for name in ["v", "w"] {
            let mut other = mesh
                .fields
                .iter()
                .find(|f| f.name == "u rust")
                .unwrap()
                .clone();
            other.name = name.into();
            mesh.fields.push(other);
        }
    });
    refused(
        at,
        &on(&["two.vtu"]),
        "several of its fields can be u: `admissible v`, `u rust`, `v`, `w`; name one by --field",
    );
    certified(at, &on(&["two.vtu", "--field", "w"]));
    changed(at, "u.vtu", "none.vtu", |mesh| {
        mesh.fields.retain(|f| f.on == Support::Cells);
    });
    refused(at, &on(&["none.vtu"]), "it has no field that can be u");
    solve(at, "one-zone", "4", "p2");
    refused(at, &on(&["u.vtu", "--element", "cr"]), "is of degree 2");
    changed(at, "u.vtu", "curved.vtu", |mesh| {
        mesh.points.to_mut()[4][1] += 0.01
    });
    refused(at, &named("curved.vtu"), "is curved");
    write(at, "a.csv", "vertex,u\n0,1\n1,2\n");
    refused(at, &on(&["a.csv"]), "numbers of vertices are those of P1");
    write(at, "a.csv", "v0,v1,u\n0,400\n");
    refused(at, &on(&["a.csv"]), "a.csv");
    write(at, "a.csv", "v0,v1,u\n0,999999,1\n");
    refused(at, &on(&["a.csv"]), "is not a face of mesh");
    write(
        at,
        "tags.toml",
        "name = \"tags\"\n[mesh]\nfile = \"none.msh\"\n[boundary]\ndirichlet = [7]\n[data]\n",
    );
    refused(at, &["u.vtu", "--scene", "tags.toml"], "none.msh");
}

/// P1 by FreeFEM with a penalty on the contact side, in its own mesh and numbering.
const BY_FREEFEM: &str = r#"
load "iovtk"
load "medit"
mesh Th = square(16, 16);
fespace Vh(Th, P1);
Vh u = 0, v;
for (int k = 0; k < 30; k++) {
    Vh w;
    solve step(w, v) = int2d(Th)(dx(w)*dx(v) + dy(w)*dy(v))
        + int1d(Th, 1)(1e3*(u > 0)*w*v)
        - int2d(Th)(-2*pi*sin(2*pi*x)*v) + on(3, w=0);
    u = w;
}
int[int] order = [1];
savevtk("freefem.vtu", Th, u, dataname="T", order=order);
savemesh(Th, "freefem.mesh");
savesol("freefem.sol", Th, u);
"#;

/// CR, P1 and P2 by dolfinx on its own mesh, as it writes them, and at the places of their nodes.
const BY_DOLFINX: &str = r#"
import numpy as np
from dolfinx import fem, io, mesh
from mpi4py import MPI
m = mesh.create_unit_square(MPI.COMM_WORLD, 5, 4)
f = lambda x: (1 - x[1]) * (np.sin(3 * x[0]) - 0.7)
for name, kind in (("cr", ("CR", 1)), ("p1", ("Lagrange", 1)), ("p2", ("Lagrange", 2))):
    u = fem.Function(fem.FunctionSpace(m, kind), name="u")
    u.interpolate(f)
    x = u.function_space.tabulate_dof_coordinates()
    rows = [f"{p[0]!r},{p[1]!r},{v!r}" for p, v in zip(x.tolist(), u.x.array.tolist())]
    open(name + ".csv", "w").write("\n".join(["x,y,u", *rows]) + "\n")
    if name == "cr":
        w = fem.Function(fem.FunctionSpace(m, ("DG", 1)), name="u")
        w.interpolate(u)
        u = w
    with io.VTKFile(m.comm, name + ".pvd", "w") as file:
        file.write_function(u)
    if name == "p1":
        with io.XDMFFile(m.comm, "p1.xdmf", "w") as file:
            file.write_mesh(m)
            file.write_function(u)
"#;

#[test]
fn what_freefem_and_dolfinx_write_is_certified_as_it_is() {
    let folder = folder();
    let at = folder.path();
    let script = write(at, "write.edp", BY_FREEFEM);
    let mut freefem = Command::new("FreeFem++");
    freefem.args(["-nw", "-v", "0"]).arg(script);
    freefem.env("FF_LOADPATH", "/usr/lib/freefem++;;");
    let ran = told(freefem.current_dir(at).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let found = certified(at, &["freefem.vtu", "--scene", "one-zone"]);
    assert_eq!(found["understood"]["field"], "T");
    assert_eq!(found["understood"]["element"], "P1");
    let bound = |of: &Value| of["certificate"]["upper"].as_f64().unwrap();
    let solved = solve(at, "one-zone", "16", "p1");
    let ratio = bound(&found) / bound(&solved);
    assert!((0.9..1.2).contains(&ratio), "{ratio}");
    // Six digits are all that this writer keeps.
    let rounded = certified(at, &["freefem.sol", "--scene", "one-zone"]);
    assert!((bound(&rounded) / bound(&found) - 1.0).abs() < 1e-4);

    dolfinx(at, BY_DOLFINX, &[]);
    for (name, element) in [("cr", "CR"), ("p1", "P1"), ("p2", "P2")] {
        let [pvd, csv] = ["pvd", "csv"].map(|suffix| format!("{name}.{suffix}"));
        let found = certified(at, &[&pvd, "--scene", "one-zone"]);
        assert_eq!(found["understood"]["element"], element);
        let mesh = "p1_p0_000000.vtu";
        let places = certified(at, &[&csv, "--scene", "one-zone", "--mesh", mesh]);
        assert_eq!(places["understood"]["values"], "places");
        assert_eq!(places["understood"]["element"], element);
        assert_same(&found, &places);
    }
    let found = certified(at, &["p1.xdmf", "--scene", "one-zone"]);
    assert_same(&found, &certified(at, &["p1.pvd", "--scene", "one-zone"]));
}
