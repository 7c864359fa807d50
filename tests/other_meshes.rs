//! `faceoff compare` on results of other meshes of one domain, of other codes, and `faceoff orders --results`.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, assert_valid, dolfinx, folder, run, source, times, told, write};

fn compare(folder: &Path, words: &[&str]) -> Ran {
    run(folder, &[&["compare"], words, &["--json", "-"]].concat())
}

/// Runs a script with the Python that has readers.
fn readers(folder: &Path, script: &str, words: &[&str]) {
    let script = write(folder, "write.py", script);
    let mut python = Command::new(source("target/python/bin/python3"));
    python.arg(script).args(words).current_dir(folder);
    let ran = told(python.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

fn field<'a>(told: &'a Value, name: &str) -> &'a Value {
    let fields = told["fields"].as_array().unwrap();
    fields.iter().find(|f| f["field"] == name).unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key]
        .as_f64()
        .unwrap_or_else(|| panic!("no {key} in {value}"))
}

/// A polynomial of the order of the mesh at Gmsh's nodes of orders 1 to 5, in triangles, quadrangles and tetrahedra, on two
/// meshes: equal to rounding only if every node is where Gmsh says.
#[test]
fn gmsh_has_the_same_polynomials_in_every_order() {
    let folder = folder();
    let at = folder.path();
    let script = r#"
import gmsh
import numpy as np
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
def f(x, p):
    return (0.3 + x[:, 0] - 0.7 * x[:, 1] + 0.4 * x[:, 2]) ** p
for shape in ["triangle", "quadrangle", "tetrahedron"]:
    for p in range(1, 6):
        for size, name in [(0.4, "a"), (0.31, "b")]:
            gmsh.clear()
            if shape == "tetrahedron":
                gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
            else:
                gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
            gmsh.model.occ.synchronize()
            gmsh.option.setNumber("Mesh.MeshSizeMin", size)
            gmsh.option.setNumber("Mesh.MeshSizeMax", size)
            quads = shape == "quadrangle" and name == "a"
            gmsh.option.setNumber("Mesh.RecombineAll", 1 if quads else 0)
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 2)
            dim = 3 if shape == "tetrahedron" else 2
            gmsh.model.mesh.generate(dim)
            gmsh.model.mesh.setOrder(p)
            tags, x, _ = gmsh.model.mesh.getNodes()
            x = x.reshape(-1, 3)
            view = gmsh.view.add("u")
            gmsh.view.addModelData(view, 0, gmsh.model.getCurrent(), "NodeData", tags, f(x, p)[:, None])
            groups = [e[1] for e in gmsh.model.getEntities(dim)]
            gmsh.model.addPhysicalGroup(dim, groups)
            gmsh.option.setNumber("Mesh.SaveAll", 0)
            path = f"{shape}{p}{name}.msh"
            gmsh.write(path)
            gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
            gmsh.view.write(view, path, append=True)
"#;
    readers(at, script, &[]);
    for shape in ["triangle", "quadrangle", "tetrahedron"] {
        // Of order 5 they take as long as all others.
        let most = if shape == "tetrahedron" && times() == 1 {
            4
        } else {
            5
        };
        for order in 1..=most {
            let [a, b] = ["a", "b"].map(|side| format!("{shape}{order}{side}.msh"));
            let dim = if shape == "tetrahedron" { "3" } else { "2" };
            let ran = compare(at, &[&a, &b, "--dim", dim, "--rtol", "1e-11"]);
            assert_eq!(ran.code, Some(0), "{a}: {}{}", ran.stdout, ran.stderr);
            let told = ran.json();
            let u = field(&told, "u");
            assert_eq!(told["map"], "functions");
            assert!(number(u, "l2") < 1e-12 * number(u, "l2_scale"), "{a}: {u}");
            // Also where the meshes overlap by rounding alone.
            assert!(number(u, "h1") < 1e-10 * number(u, "h1_scale"), "{a}: {u}");
        }
    }
}

const DOLFINX: &str = r#"
import sys
import numpy as np
from dolfinx import fem, io, mesh
from mpi4py import MPI
n, name = int(sys.argv[1]), sys.argv[2]
dim = int(sys.argv[3]) if len(sys.argv) > 3 else 2
make = mesh.create_unit_square if dim == 2 else mesh.create_unit_cube
m = make(MPI.COMM_WORLD, *[n] * dim)
u = fem.Function(fem.FunctionSpace(m, ("Lagrange", 1)), name="u")
u.interpolate(lambda x: np.sin(3 * x[0]) * np.cos(2 * x[1]))
w = fem.Function(fem.FunctionSpace(m, ("DG", 0)), name="w")
w.interpolate(lambda x: x[0] * x[1] ** 2)
linear = fem.Function(fem.FunctionSpace(m, ("DG", 1)), name="linear")
linear.interpolate(lambda x: 1 + x[0] - 2 * x[1])
with io.VTKFile(m.comm, name + ".pvd", "w") as file:
    file.write_function([u, w])
with io.VTKFile(m.comm, name + "-linear.pvd", "w") as file:
    file.write_function(linear)
"#;

/// Each rank writes the cells of its neighbours as well, marked as ghosts.
#[test]
fn dolfinx_on_two_ranks_is_dolfinx_on_one() {
    let folder = folder();
    let at = folder.path();
    dolfinx(at, DOLFINX, &["5", "serial"]);
    let script = at.join("write.py");
    let mut ranks = Command::new("mpirun");
    ranks.args([
        "--allow-run-as-root",
        "--oversubscribe",
        "-n",
        "2",
        "/usr/bin/python3",
    ]);
    ranks.arg(script).args(["5", "parallel"]).current_dir(at);
    // tests/run turns them off for single processes.
    ranks.env("OMPI_MCA_orte_create_session_dirs", "1");
    let ran = told(ranks.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for (a, b) in [("serial", "parallel"), ("parallel", "serial")] {
        for kind in ["", "-linear"] {
            let [a, b] = [a, b].map(|name| format!("{name}{kind}.pvd"));
            let ran = compare(at, &[&a, &b, "--rtol", "1e-13"]);
            assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
            let told = ran.json();
            assert_eq!(told["map"], "coordinates");
            let notes = told["notes"].to_string();
            assert!(notes.contains("ghost cells"), "{notes}");
            if kind.is_empty() {
                assert_eq!(field(&told, "w")["faces"], 50);
            }
        }
    }
}

/// dolfinx on two meshes: discontinuous P1 holds a linear function exactly, P1 and P0 do not hold theirs.
#[test]
fn results_of_dolfinx_on_other_meshes() {
    let folder = folder();
    let at = folder.path();
    for dim in ["2", "3"] {
        dolfinx(at, DOLFINX, &["4", "coarse", dim]);
        dolfinx(at, DOLFINX, &["6", "fine", dim]);
        let ran = compare(
            at,
            &["coarse-linear.pvd", "fine-linear.pvd", "--rtol", "1e-14"],
        );
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let ran = run(
            at,
            &[
                "compare",
                "coarse.pvd",
                "fine.pvd",
                "--json",
                "o.json",
                "--project",
                "on.vtu",
            ],
        );
        assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
        assert!(
            ran.stdout
                .contains("as functions on the intersection of the meshes"),
            "{}",
            ran.stdout
        );
        assert_valid(
            "json",
            "src/report/schema/compare-1.json",
            &at.join("o.json"),
        );
        let text = std::fs::read_to_string(at.join("o.json")).unwrap();
        let told: Value = serde_json::from_str(&text).unwrap();
        let common = number(&told["intersection"], "common");
        assert!((common - 1.0).abs() < 1e-13, "{common}");
        let u = field(&told, "u");
        assert!(u["worst"]["cells"].as_array().unwrap().len() == 2, "{u}");
        // The projection of the finer one is nearer to it than its own interpolant.
        let ran = compare(at, &["on.vtu", "fine.pvd"]);
        let told = ran.json();
        assert!(number(field(&told, "u"), "l2") < number(u, "l2"), "{told}");
        // Matched all the same: its cells are those of the coarse mesh.
        assert_ne!(
            compare(at, &["on.vtu", "coarse.pvd"]).json()["map"],
            "functions"
        );
        // On each cell of the first its largest difference and both means, which are those of the functions.
        let ran = compare(at, &["coarse.pvd", "fine.pvd", "--out", "d.vtu"]);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        let info = run(at, &["mesh", "info", "d.vtu", "--json", "-"]).json();
        let names = ["largest |a - b|", "mean of a", "mean of b"];
        let fields = info["fields"].as_array().unwrap();
        for name in names {
            let of = |f: &&Value| f["name"] == format!("u: {name}");
            let found = fields
                .iter()
                .find(of)
                .unwrap_or_else(|| panic!("{name}: {info}"));
            assert_eq!(found["on"], "cells");
        }
    }
    let ran = compare(
        at,
        &["coarse.pvd", "coarse-linear.pvd", "--map", "coordinates"],
    );
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
}

/// Interpolants of sin(3x) cos(2y): second order in L², first in H¹, whatever they are held against.
#[test]
fn interpolants_have_their_orders() {
    let folder = folder();
    let at = folder.path();
    for n in ["4", "8", "16", "32"] {
        dolfinx(at, DOLFINX, &[n, &format!("n{n}")]);
    }
    let results = "n4.pvd,n8.pvd,n16.pvd";
    let against: [&[&str]; 3] = [
        &["--exact", "sin(3*x)*cos(2*y)"],
        &["--reference", "n32.pvd"],
        &[],
    ];
    for words in against {
        let list = if words.is_empty() {
            format!("{results},n32.pvd")
        } else {
            results.to_owned()
        };
        let base = [
            "orders",
            "--results",
            &list,
            "--only",
            "u",
            "--json",
            "o.json",
            "--report",
            "page",
        ];
        let ran = run(at, &[&base[..], words].concat());
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        assert_valid(
            "json",
            "src/report/schema/orders-1.json",
            &at.join("o.json"),
        );
        let text = std::fs::read_to_string(at.join("o.json")).unwrap();
        let told: Value = serde_json::from_str(&text).unwrap();
        let of = &told["results"][0];
        let fit = |norm: &str| number(&of[norm]["fit"], "exponent");
        assert!((fit("l2") - 2.0).abs() < 0.15, "{words:?}: {of:#}");
        assert!((fit("h1") - 1.0).abs() < 0.15, "{words:?}: {of:#}");
        assert_eq!(of["l2"]["interval"].as_array().unwrap().len(), 2);
        assert!(
            at.join("page/orders-u.svg").is_file()
                || at.join("page/figures/orders-u.svg").is_file()
        );
    }
    let refused = |words: &[&str], part: &str| {
        let ran = run(at, &[&["orders"], words].concat());
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(ran.stderr.contains(part), "{words:?}: {}", ran.stderr);
    };
    refused(
        &["--results", "n8.pvd,n4.pvd", "--exact", "x", "--only", "u"],
        "is not finer",
    );
    refused(&["--results", "n4.pvd,n8.pvd"], "no observed order");
    refused(
        &["--results", "n4.pvd,n8.pvd", "--exact", "x"],
        "name one by --only",
    );
    refused(
        &[
            "--results",
            "n4.pvd,n8.pvd",
            "--exact",
            "x +",
            "--only",
            "u",
        ],
        "character",
    );
    refused(
        &["--results", "n4.pvd,n8.pvd", "--exact", "x", "--only", "v"],
        "has no field `v`",
    );
}

/// A Crouzeix–Raviart function by its means on faces is the one that the file of the cells has.
#[test]
fn means_on_faces_are_functions() {
    let folder = folder();
    let at = folder.path();
    for (scene, n) in [("one-zone", "6"), ("one-zone-3d", "2")] {
        let words = ["solve", scene, "--n", n, "--out", "a.vtu", "--quiet"];
        let ran = run(at, &words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let words = [
            "a-faces.vtu",
            "a.vtu",
            "--map",
            "functions",
            "--pair",
            "mean=u",
            "--only",
            "mean",
        ];
        let ran = compare(at, &[&words[..], &["--rtol", "1e-13"]].concat());
        // The file of the cells has means of its own, on cells.
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        let cells = faceoff_mesh::io::open(&at.join("a.vtu"), None).unwrap();
        let mut mesh = cells.mesh;
        mesh.fields.retain(|field| field.name.starts_with("u"));
        mesh.fields
            .iter_mut()
            .for_each(|field| field.name = "mean".into());
        faceoff_mesh::io::write(&at.join("u.vtu"), &mesh, &Default::default()).unwrap();
        let words = [
            "a-faces.vtu",
            "u.vtu",
            "--map",
            "functions",
            "--only",
            "mean*",
        ];
        let ran = compare(at, &[&words[..], &["--rtol", "1e-13"]].concat());
        let told = ran.json();
        assert_eq!(ran.code, Some(0), "{told:#}{}", ran.stderr);
        let mean = field(&told, "mean");
        assert!(
            number(mean, "l2") < 1e-14 * number(mean, "l2_scale"),
            "{mean}"
        );
    }
}

/// -Δu = f with u = sin(πx) sin(πy) on FreeFEM's own squares; its users write quadratic cells by hand.
const OWN_SQUARES: &str = r#"
load "iovtk"
for (int n = 8; n <= 32; n *= 2) {
    mesh Th = square(n, n, flags = 3);
    func f = 2*pi^2*sin(pi*x)*sin(pi*y);
    fespace V1(Th, P1); V1 u1, v1;
    solve linear(u1, v1) = int2d(Th)(dx(u1)*dx(v1) + dy(u1)*dy(v1)) - int2d(Th, qforder = 8)(f*v1) + on(1, 2, 3, 4, u1 = 0);
    fespace V2(Th, P2); V2 u, v, X = x, Y = y;
    solve quadratic(u, v) = int2d(Th)(dx(u)*dx(v) + dy(u)*dy(v)) - int2d(Th, qforder = 8)(f*v) + on(1, 2, 3, 4, u = 0);
    int[int] order = [1];
    savevtk("own" + n + "p1.vtu", Th, u1, dataname = "u", order = order);
    // savevtk has no quadratic cells: VTK's type 22 by hand; FreeFEM's middle of edge i lies opposite vertex i.
    int[int] nodes = [0, 1, 2, 5, 3, 4];
    ofstream o("own" + n + "p2.vtu");
    o.precision(17);
    o << "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>" << endl;
    o << "<Piece NumberOfPoints=\"" << V2.ndof << "\" NumberOfCells=\"" << Th.nt << "\">" << endl;
    o << "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" << endl;
    for (int i = 0; i < V2.ndof; i++) o << X[][i] << " " << Y[][i] << " 0" << endl;
    o << "</DataArray></Points><PointData><DataArray type=\"Float64\" Name=\"u\" format=\"ascii\">" << endl;
    for (int i = 0; i < V2.ndof; i++) o << u[][i] << endl;
    o << "</DataArray></PointData><Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" << endl;
    for (int k = 0; k < Th.nt; k++) { for (int i = 0; i < 6; i++) o << V2(k, nodes[i]) << " "; o << endl; }
    o << "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">" << endl;
    for (int k = 1; k <= Th.nt; k++) o << 6*k << endl;
    o << "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">" << endl;
    for (int k = 0; k < Th.nt; k++) o << 22 << endl;
    o << "</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>" << endl;
}
"#;

/// The mesh is gmsh's.
const OTHER_SQUARES: &str = r#"
import sys
import numpy as np
if sys.argv[1] == "mesh":
    import gmsh
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    for n in (8, 16, 32):
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / n)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1 / n)
        gmsh.model.mesh.generate(2)
        tags, x, _ = gmsh.model.mesh.getNodes()
        cells = gmsh.model.mesh.getElementsByType(2)[1].reshape(-1, 3) - 1
        np.savez(f"{n}.npz", x=x.reshape(-1, 3)[np.argsort(tags), :2], cells=cells.astype(np.int64))
        gmsh.model.mesh.clear()
    sys.exit()
import dolfinx.fem.petsc
import ufl
from dolfinx import fem, io, mesh
from mpi4py import MPI
for n in (8, 16, 32):
    read = np.load(f"{n}.npz")
    element = ufl.VectorElement("Lagrange", "triangle", 1)
    m = mesh.create_mesh(MPI.COMM_WORLD, read["cells"], read["x"], ufl.Mesh(element))
    m.topology.create_connectivity(1, 2)
    for p in (1, 2):
        V = fem.FunctionSpace(m, ("Lagrange", p))
        u, v, x = ufl.TrialFunction(V), ufl.TestFunction(V), ufl.SpatialCoordinate(m)
        f = 2 * ufl.pi**2 * ufl.sin(ufl.pi * x[0]) * ufl.sin(ufl.pi * x[1])
        faces = mesh.exterior_facet_indices(m.topology)
        on = fem.dirichletbc(np.float64(0), fem.locate_dofs_topological(V, 1, faces), V)
        a = ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx
        problem = fem.petsc.LinearProblem(a, f * v * ufl.dx(degree=8), bcs=[on])
        uh = problem.solve()
        uh.name = "u"
        with io.VTKFile(MPI.COMM_WORLD, f"other{n}p{p}.pvd", "w") as o:
            o.write_function(uh, 0.0)
"#;

/// FreeFEM on its own meshes against dolfinx on gmsh's, P1 and P2: their difference falls with the order of the elements, and
/// so does the error of FreeFEM's result when it is projected onto the other mesh.
#[test]
fn two_codes_on_their_own_meshes_have_the_orders_of_theory() {
    let folder = folder();
    let at = folder.path();
    let script = write(at, "own.edp", OWN_SQUARES);
    let mut freefem = Command::new("FreeFem++-nw");
    freefem.args(["-v", "0"]).arg(script).current_dir(at);
    freefem.env("FF_LOADPATH", "/usr/lib/freefem++");
    let ran = told(freefem.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    readers(at, OTHER_SQUARES, &["mesh"]);
    dolfinx(at, OTHER_SQUARES, &["solve"]);
    for p in [1, 2] {
        let mut norms = Vec::new();
        for n in [8, 16, 32] {
            let [own, other] = ["own", "other"].map(|of| format!("{of}{n}p{p}"));
            let (own, other) = (format!("{own}.vtu"), format!("{other}.pvd"));
            let onto = format!("onto{n}p{p}.vtu");
            let ran = compare(at, &[&other, &own, "--only", "u", "--project", &onto]);
            assert_eq!(ran.code, Some(1), "{}", ran.stderr);
            let told = ran.json();
            assert_eq!(told["map"], "functions");
            norms.push(["l2", "h1"].map(|norm| number(field(&told, "u"), norm)));
        }
        for (k, theory) in [(0, p + 1), (1, p)] {
            let steps = norms.windows(2).map(|w| (w[0][k] / w[1][k]).log2());
            for order in steps {
                assert!((order - f64::from(theory)).abs() < 0.15, "P{p}: {norms:?}");
            }
        }
        let list = [8, 16, 32].map(|n| format!("onto{n}p{p}.vtu")).join(",");
        let exact = "sin(pi*x)*sin(pi*y)";
        let words = [
            "orders",
            "--results",
            &list,
            "--exact",
            exact,
            "--json",
            "-",
        ];
        let told = run(at, &words).json();
        for (norm, theory) in [("l2", p + 1), ("h1", p)] {
            let order = number(&told["results"][0][norm]["fit"], "exponent");
            assert!(
                (order - f64::from(theory)).abs() < 0.15,
                "P{p} {norm}: {told:#}"
            );
        }
    }
}
