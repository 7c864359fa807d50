//! Fields on facets and edges: fluxes of RT0 and circulations of N1curl as dofs in CSV are functions, the divergence and curl of which are
//! compared cell by cell.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{assert_valid, folder, run, source, write};

/// A form of the gallery with FreeFEM's script as a code of its own, which writes moments too.
fn with_moments(at: &Path, form: &str, space: &str, vector: [&str; 2], fields: &str) {
    let text = fs::read_to_string(source("examples/forms").join(format!("{form}.toml"))).unwrap();
    let (text, _) = text.split_once("[codes]").unwrap();
    let text = text.replace("n = [8, 16, 32]", "n = [4, 8]");
    let mine = "[codes]\nuse = [\"rust\", \"dolfinx\"]\n[codes.mine]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"mine.edp\", \"{mesh}\", \"{out}/all.vtu\"]\n\
                mesh = \"medit\"\nresult = [\"all.vtu\", \"all.vtu.csv\"]\n";
    write(at, "form.toml", &format!("{text}{mine}{fields}"));
    write(
        at,
        "alone.toml",
        &format!("{text}[codes]\nuse = [\"rust\"]\n"),
    );
    let ran = run(at, &["write", "alone.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let [a, b] = vector;
    let more = format!(
        "include \"moments.idp\"\nfespace Eh(Th, {space});\nEh [a1, a2] = [{a}, {b}];\nwriteMoments(writes + \".csv\", Th, \"moments\", a1[]);\n"
    );
    write(at, "mine.edp", &(ran.stdout + &more));
    fs::copy(source("examples/blank/moments.idp"), at.join("moments.idp")).unwrap();
}

/// What is found with another text in a file.
fn verify(at: &Path, script: &str, (from, to): (&str, &str)) -> (Option<i32>, Value, String) {
    let path = at.join(script);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let words = ["verify", "--run", "form.toml", "--json", "o.json"];
    // A fault shows on one mesh.
    let level: &[&str] = if from == to { &[] } else { &["--n", "8"] };
    let ran = run(at, &[&words, level].concat());
    fs::write(&path, text).unwrap();
    let schema = "src/report/schema/face-off-1.json";
    assert_valid("json", schema, &at.join("o.json"));
    let told = fs::read_to_string(at.join("o.json")).unwrap();
    let told = serde_json::from_str(&told).unwrap();
    (ran.code, told, ran.stdout + &ran.stderr)
}

/// The verdicts of a field's pairs on the finest mesh, of which `with` says whether mine is one of the two.
fn verdicts<'a>(told: &'a Value, field: &str, with: bool) -> Vec<&'a str> {
    let fields = told["fields"].as_array().unwrap();
    let of = fields.iter().find(|of| of["field"] == field).unwrap();
    let pairs = of["pairs"].as_array().unwrap().iter();
    let pairs = pairs.filter(|p| p["n"] == 8 && (p["a"] == "mine" || p["b"] == "mine") == with);
    pairs.map(|p| p["verdict"].as_str().unwrap()).collect()
}

#[test]
fn fluxes_of_darcy_are_functions_of_rt0_with_a_divergence() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.q]\nrtol = 1e-11\nnames = { mine = \"RT0(moments)\" }\norders = { l2 = 1 }\n\
                  exact = [\"(1 + x)*pi*sin(pi*x)*sin(pi*y)\", \"-(1 + x)*pi*cos(pi*x)*cos(pi*y)\"]\n\
                  [fields.\"div(q)\"]\nrtol = 1e-11\nnames = { mine = \"div(RT0(moments))\" }\nexact = \"f\"\norders = { l2 = 1 }\n\
                  [fields.p]\nrtol = 1e-11\n";
    with_moments(at, "darcy", "RT0", ["q1", "q2"], fields);
    let (code, told, said) = verify(at, "mine.edp", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    for field in ["q", "div(q)"] {
        assert_eq!(verdicts(&told, field, true), ["agree"; 2], "{said}");
        let of = told["fields"].as_array().unwrap();
        let of = of.iter().find(|of| of["field"] == field).unwrap();
        assert_eq!(of["orders"].as_array().unwrap().len(), 3, "{of}");
    }
    // The order of the two vertices in a row says nothing.
    let turned = ("file << v0 << \",\" << v1", "file << v1 << \",\" << v0");
    assert_eq!(verify(at, "moments.idp", turned).0, Some(0));
    // A sign that follows the cell instead, and one edge that has another flux.
    let of_cell = (
        "<< moments[edge]",
        "<< (v0 < v1 ? moments[edge] : -moments[edge])",
    );
    let one = (
        "<< moments[edge]",
        "<< moments[edge] + (edge == 7 ? 1e-6 : 0.)",
    );
    for fault in [of_cell, one] {
        let (code, told, said) = verify(at, "moments.idp", fault);
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(verdicts(&told, "q", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "div(q)", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "p", true), ["agree"; 2], "{said}");
        assert_eq!(verdicts(&told, "q", false), ["agree"], "{said}");
    }
    // A row that is missing, and one of no edge.
    let missing = ("if (done[edge] == 0)", "if (done[edge] == 0 && edge != 7)");
    let other = ("<< v1 <<", "<< (edge == 7 ? v1 + 1 : v1) <<");
    for fault in [missing, other] {
        let (code, _, said) = verify(at, "moments.idp", fault);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains("is not a function there"), "{said}");
    }
}

#[test]
fn circulations_of_maxwell_are_functions_of_nedelec_with_a_curl() {
    let folder = folder();
    let at = folder.path();
    let fields = "[fields.u]\nrtol = 1e-11\nnames = { mine = \"N1curl(moments)\" }\norders = { l2 = 1 }\nexact = [\"sin(pi*y)\", \"sin(pi*x)\"]\n\
                  [fields.\"curl(u)\"]\nrtol = 1e-11\nnames = { mine = \"curl(N1curl(moments))\" }\nexact = \"c\"\norders = { l2 = 1 }\n";
    with_moments(at, "curl-curl", "RT0Ortho", ["u1", "u2"], fields);
    let (code, told, said) = verify(at, "mine.edp", ("", ""));
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(verdicts(&told, "curl(u)", true), ["agree"; 2], "{said}");
    // The gradient of a hat function, which no curl shows, and a curl of its own.
    let gradient =
        "<< moments[edge] + (max(v0, v1) == 30 ? 1e-6 : (min(v0, v1) == 30 ? -1e-6 : 0.))";
    let bend = "<< moments[edge] + (v0 == 30 ? 1e-6 : 0.)";
    for (to, of_curl) in [(gradient, "agree"), (bend, "disagree")] {
        let (code, told, said) = verify(at, "moments.idp", ("<< moments[edge]", to));
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(verdicts(&told, "u", true), ["disagree"; 2], "{said}");
        assert_eq!(verdicts(&told, "curl(u)", true), [of_curl; 2], "{said}");
    }
}

const IN_SPACE: &str = r#"name = "space"
[mesh]
generator = "union-cube"
n = 2
[spaces]
q = "RT0"
u = "N1curl"
[data]
f = ["1 + y*z", "x - z", "x*y"]
[form]
F = "dot(q - f, test.q)*dx + dot(u - f, v)*dx"
[codes]
use = ["rust"]
[codes.mine]
command = ["FreeFem++-nw", "-v", "0", "mine.edp", "{mesh}", "{out}/all.vtu"]
mesh = "medit"
result = ["all.vtu.q.csv", "all.vtu.u.csv"]
[fields.q]
names = { mine = "RT0(flux)" }
[fields."div(q)"]
names = { mine = "div(RT0(flux))" }
[fields.u]
names = { mine = "N1curl(moments)" }
[fields."curl(u)"]
names = { mine = "curl(N1curl(moments))" }
"#;

#[test]
fn facets_and_edges_in_space_make_functions() {
    let folder = folder();
    let at = folder.path();
    write(at, "form.toml", IN_SPACE);
    let alone = IN_SPACE.split_once("[codes]").unwrap().0.to_owned();
    write(at, "alone.toml", &(alone + "[codes]\nuse = [\"rust\"]\n"));
    let ran = run(at, &["write", "alone.toml", "--for", "freefem"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let more = "include \"moments3.idp\"\nfespace Fh(Th, RT03d);\nfespace Eh(Th, Edge03d);\n\
                Fh [a1, a2, a3] = [q1, q2, q3];\nEh [b1, b2, b3] = [u1, u2, u3];\n\
                writeFluxes(writes + \".q.csv\", Th, \"flux\", a1[]);\nwriteCirculations(writes + \".u.csv\", Th, \"moments\", b1[]);\n";
    write(at, "mine.edp", &(ran.stdout + more));
    let helper = "moments3.idp";
    fs::copy(source("examples/blank").join(helper), at.join(helper)).unwrap();
    let (code, told, said) = verify(at, helper, ("", ""));
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(told["fields"].as_array().unwrap().len(), 4);
    let (code, told, said) = verify(at, helper, ("<< -dofs[facet]", "<< dofs[facet]"));
    assert_eq!(code, Some(1), "{said}");
    let verdicts = told["fields"].as_array().unwrap().iter();
    let verdicts: Vec<&str> = verdicts.map(|of| of["verdict"].as_str().unwrap()).collect();
    assert_eq!(
        verdicts,
        ["agree", "disagree", "disagree", "agree"],
        "{said}"
    );
}

/// In the plane q = (1 + 2x, 3 + 2y) on two triangles, as a table and as a function; the divergence is 4.
#[test]
fn a_table_is_compared_with_a_function_on_a_given_mesh() {
    let folder = folder();
    let at = folder.path();
    let mesh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n\
                $Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n";
    write(at, "m.msh", mesh);
    let table = "v0,v1,q\n0,1,-3\n1,2,3\n2,0,-2\n2,3,5\n0,3,1\n";
    write(at, "a.csv", table);
    // Another order of rows and vertices.
    write(
        at,
        "b.csv",
        "v0,v1,f\n3,2,5\n1,0,-3\n0,2,-2\n3,0,1\n1,2,3.00001\n",
    );
    let compare = |words: &[&str]| run(at, &[&["compare", "a.csv", "b.csv"], words].concat());
    let pair = [
        "--mesh",
        "m.msh",
        "--pair",
        "RT0(q)=RT0(f)",
        "--only",
        "RT0(q)",
    ];
    assert_eq!(compare(&pair).code, Some(1));
    assert_eq!(
        compare(&[&pair[..], &["--rtol", "1e-4"]].concat()).code,
        Some(0)
    );
    let without = compare(&pair[2..]);
    assert_eq!(without.code, Some(2));
    assert!(without.stderr.contains("--mesh"), "{}", without.stderr);
    // A name that neither has is no agreement about it.
    let typed = compare(&[&pair[..], &["--rtol", "1e-4", "--only", "div(q)"]].concat());
    assert_eq!(typed.code, Some(2), "{}", typed.stdout);
    assert!(
        typed.stderr.contains("has no field `div(q)`"),
        "{}",
        typed.stderr
    );
}

/// A function of BDM1 by scikit-fem, on cells and by its moments on edges.
const BDM: &str = r#"import meshio
import numpy as np
from skfem import Basis, ElementTriBDM1, FacetBasis, MeshTri

mesh = MeshTri().refined(2)
element = ElementTriBDM1()
u = np.random.default_rng(1).standard_normal(Basis(mesh, element).N)
corners = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
points = np.pad(mesh.mapping().F(corners), ((0, 1), (0, 0), (0, 0))).transpose(1, 2, 0).reshape(-1, 3)
cells = [("triangle", np.arange(len(points)).reshape(-1, 3))]
q = np.asarray(Basis(mesh, element, quadrature=(corners, np.ones(3))).interpolate(u))
meshio.Mesh(points, cells, point_data={"q": q.transpose(1, 2, 0).reshape(-1, 2)}).write("q.vtu")
meshio.Mesh(np.pad(mesh.p.T, ((0, 0), (0, 1))), [("triangle", mesh.t.T)]).write("mesh.vtu")
t, w = np.array([0.5 - 0.75**0.5/3, 0.5 + 0.75**0.5/3]), np.array([0.5, 0.5])
edges = FacetBasis(mesh, element, facets=np.arange(mesh.nfacets), quadrature=(t[None], w))
x, y = np.asarray(edges.interpolate(u))
along = mesh.p[:, mesh.facets[1]] - mesh.p[:, mesh.facets[0]]
flux = x*along[1][:, None] - y*along[0][:, None]
moments = np.array([flux @ (w*(1 - t)), flux @ (w*t)])
with open("q.csv", "w") as file:
    file.write("v0,v1,q0,q1\n")
    file.writelines(f"{a},{b},{m!r},{n!r}\n" for (a, b), m, n in zip(mesh.facets.T.tolist(), *moments.tolist()))
"#;

#[test]
fn moments_of_scikit_fem_are_a_function_of_bdm1() {
    let folder = folder();
    let at = folder.path();
    let python = source("target/python/bin/python");
    let words = [
        "compare",
        "q.vtu",
        "q.csv",
        "--mesh",
        "mesh.vtu",
        "--pair",
        "q=BDM1(q)",
        "--only",
        "q",
        "--rtol",
        "1e-12",
    ];
    for (from, to, expected) in [
        ("*moments.tolist()", "*moments.tolist()", Some(0)),
        // The two weights exchanged, and the flux of the edge alone.
        ("*moments.tolist()", "*moments[::-1].tolist()", Some(1)),
        (
            "flux @ (w*(1 - t)), flux @ (w*t)",
            "flux @ w/2, flux @ w/2",
            Some(1),
        ),
    ] {
        assert!(BDM.contains(from));
        write(at, "bdm.py", &BDM.replace(from, to));
        let ran = std::process::Command::new(&python)
            .arg("bdm.py")
            .current_dir(at)
            .output()
            .unwrap();
        assert!(
            ran.status.success(),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        let ran = run(at, &words);
        assert_eq!(ran.code, expected, "{to}: {}{}", ran.stdout, ran.stderr);
    }
}
