//! The forms in examples/forms and others, as scripts of all codes, run on one mesh: the fields agree to rounding.
//!
//! What tests words of the language is run by all codes, other forms by two in turn, and by all in `tests/run --all`. All codes must
//! be there: tests/run installs them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use faceoff_form::codes::{CODES, Code};
use faceoff_form::{Problem, own};
use faceoff_mesh::mesh::generate::{union_cube, union_jack};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Group, Mesh};

/// Largest difference of two codes, over the largest value.
const TOLERANCE: f64 = 1e-11;

/// Rounded coordinates of the centre of a cell and of a node in it.
type Place = [i64; 6];

/// The values of each unknown at the nodes of cells.
type Values = BTreeMap<String, BTreeMap<Place, Vec<f64>>>;

fn form(name: &str) -> String {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/forms/{name}.toml"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A square whose inner vertices are moved, so that no two cells are alike.
fn square() -> Mesh {
    let mut mesh = union_jack(5, [1.0, 1.0]);
    for point in mesh.points.to_mut() {
        let [x, y, _] = *point;
        let bump = 16.0 * x * (1.0 - x) * y * (1.0 - y);
        point[0] += 0.03 * bump * (7.0 * y).sin();
        point[1] += 0.03 * bump * (5.0 * x + 1.0).cos();
    }
    mesh
}

fn cube() -> Mesh {
    let mut mesh = union_cube(2, [1.0; 3]);
    for point in mesh.points.to_mut() {
        let [x, y, z] = *point;
        let bump = 64.0 * x * (1.0 - x) * y * (1.0 - y) * z * (1.0 - z);
        point[0] += 0.05 * bump;
        point[2] -= 0.03 * bump;
    }
    mesh
}

/// What says that a form has no solution that can be found.
const LOST: &str = "Newton's method did not converge";

/// The Python that has the codes from PyPI.
fn python() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python3")
}

/// How a code's scripts are run.
fn command(code: &Code) -> Vec<PathBuf> {
    match code.command {
        ["python3"] => vec![python()],
        words => words.iter().map(PathBuf::from).collect(),
    }
}

/// Runs a script by itself: whether it succeeds, and what it writes to standard output and standard error.
fn cold(code: &Code, script: &Path) -> (bool, [String; 2]) {
    let command = command(code);
    let ran = Command::new(&command[0])
        .args(&command[1..])
        .arg(script)
        .current_dir(script.parent().expect("a script is in a folder"))
        .output()
        .unwrap_or_else(|e| panic!("{}: {}: {e}", code.name, command[0].display()));
    let written = [&ran.stdout, &ran.stderr].map(|b| String::from_utf8_lossy(b).into_owned());
    (ran.status.success(), written)
}

/// What a code's script writes; none where it finds no solution.
fn run(code: &Code, problem: &Problem, mesh: &Mesh, script: &str) -> Option<Values> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(code.file(problem));
    std::fs::write(&path, script).expect("a script");
    code.write_mesh(folder.path(), problem, mesh)
        .expect("a mesh");
    let ran = match warm::modules(code.name) {
        Some(modules) => warm::run(&command(code)[0], modules, &path, &[]),
        None => cold(code, &path),
    };
    let (has_ended_well, [said, errors]) = ran;
    if !has_ended_well && (said.contains(LOST) || errors.contains(LOST)) {
        return None;
    }
    assert!(
        has_ended_well,
        "{} on {}: {said}{errors}",
        code.name, problem.name
    );
    let written = path.with_extension("vtu");
    // FreeFEM's is called like the problem, as is its script.
    Some(values(&written, problem))
}

fn values(path: &Path, problem: &Problem) -> Values {
    let mesh = faceoff_mesh::io::read(path).expect("a result");
    values_of(&mesh, &mesh.fields, problem)
}

/// What our own solver gives; none where it finds no solution.
fn ours(problem: &Problem, mesh: &Mesh) -> Option<Values> {
    let solution = match own::solve(problem, mesh) {
        Err(e) if e.to_string().contains(LOST) => return None,
        other => other.unwrap_or_else(|e| panic!("{e}")),
    };
    let (mesh, fields) = own::output(&solution.assembler, &solution.u);
    Some(values_of(&mesh, &fields, problem))
}

fn values_of(mesh: &Mesh, fields: &[Field], problem: &Problem) -> Values {
    let mut all = Values::new();
    for unknown in &problem.unknowns {
        let field = fields.iter().find(|field| field.name == unknown.name);
        let field = field.unwrap_or_else(|| panic!("no {} in the result", unknown.name));
        let numbers = field.values.to_f64();
        let of = all.entry(unknown.name.clone()).or_default();
        for (_, _, nodes) in mesh.cells() {
            let round = |x: f64| (x * 1e7).round() as i64;
            let places = || nodes.iter().map(|k| mesh.points[*k as usize]);
            let centre = std::array::from_fn::<f64, 3, _>(|i| {
                places().map(|p| p[i]).sum::<f64>() / nodes.len() as f64
            });
            for (k, place) in nodes.iter().zip(places()) {
                let key: Place =
                    std::array::from_fn(|i| round(if i < 3 { centre[i] } else { place[i - 3] }));
                let at = *k as usize * field.components;
                of.insert(key, numbers[at..at + field.components].to_vec());
            }
        }
    }
    all
}

/// The largest difference of two results over the largest value of each field.
fn difference(a: &Values, b: &Values) -> f64 {
    let mut most = 0.0_f64;
    for (name, left) in a {
        let right = &b[name];
        assert_eq!(left.len(), right.len(), "nodes of {name}");
        let all = left.values().flatten();
        let size = all.fold(0.0_f64, |size, v| size.max(v.abs()));
        assert!(size > 0.0 && size.is_finite(), "{name} is {size}");
        for (place, p) in left {
            let q = right.get(place);
            let q = q.unwrap_or_else(|| panic!("no node of {name} at {place:?}"));
            for (p, q) in p.iter().zip(q) {
                assert!(p.is_finite() && q.is_finite());
                most = most.max((p - q).abs() / size);
            }
        }
    }
    most
}

/// The codes to run: all, or those that `FACEOFF_CODES` names. A name of no code would compare nothing, and pass.
fn chosen() -> Vec<&'static str> {
    let known: Vec<&str> = CODES.iter().map(|code| code.name).collect();
    let Ok(given) = std::env::var("FACEOFF_CODES") else {
        return known;
    };
    let find = |name: &str| {
        let found = known.iter().find(|code| **code == name);
        *found.unwrap_or_else(|| {
            panic!("FACEOFF_CODES: there is no code `{name}`: give of {known:?}")
        })
    };
    given.split(',').map(find).collect()
}

/// Which codes run a form.
#[derive(Clone, Copy, PartialEq)]
enum Codes {
    /// All: what tests words of the language.
    All,
    /// Two, beginning with another one for each form.
    InTurn,
}

/// Runs codes that have what a form needs, and returns those of all that lack something, with what.
fn agree_on(text: &str, mesh: &Mesh, codes: Codes) -> Vec<(&'static str, String)> {
    let problem =
        Problem::parse(Path::new("form.toml"), text, mesh).unwrap_or_else(|e| panic!("{e}"));
    let mut lacking = Vec::new();
    let mut results = vec![("rust", ours(&problem, mesh))];
    let chosen = chosen();
    let mut able = Vec::new();
    for code in CODES.iter().filter(|code| chosen.contains(&code.name)) {
        match code.script(&problem) {
            Err(why) => lacking.push((code.name, why)),
            Ok(script) => able.push((code, script)),
        }
    }
    let is_whole = ["FACEOFF_CODES", "FACEOFF_SCENES"].map(std::env::var_os);
    if codes == Codes::InTurn && is_whole.iter().all(Option::is_none) {
        let first = text.bytes().map(usize::from).sum::<usize>();
        let count = able.len().max(1);
        able.rotate_left(first % count);
        able.truncate(2);
    }
    for (code, script) in able {
        results.push((code.name, run(code, &problem, mesh, &script)));
    }
    let (first, reference) = &results[0];
    let mut line = format!("{:<18} {first}", problem.name);
    let mut failed = false;
    for (code, found) in &results[1..] {
        let apart = match (reference, found) {
            (Some(reference), Some(found)) => difference(reference, found),
            // None finds a solution, or only one of them.
            (None, None) => 0.0,
            _ => f64::INFINITY,
        };
        line += &format!(" – {code} {apart:.1e}");
        failed |= apart > TOLERANCE;
    }
    for (code, why) in &lacking {
        line += &format!("; {code}: {why}");
    }
    if reference.is_none() {
        line += "; no code finds a solution";
    }
    println!("{line}");
    assert!(!failed, "{line}");
    lacking
}

/// Forms of the folder, each with the codes that lack its spaces.
macro_rules! forms_agree {
    ($($test:ident: $name:literal lacking $codes:expr;)*) => {
        $(#[test]
        fn $test() {
            let codes: &[&str] = &$codes;
            assert_eq!(lacking(&form($name), &square()), codes);
        })*
    };
}

forms_agree! {
    poisson: "poisson" lacking [];
    convection: "convection" lacking [];
    supg: "supg" lacking [];
    elasticity: "elasticity" lacking [];
    stokes: "stokes" lacking [];
    stokes_by_crouzeix_raviart: "stokes-cr" lacking ["nutils"];
    interior_penalty: "interior-penalty" lacking [];
    nitsche: "nitsche" lacking [];
    minimal_surface: "minimal-surface" lacking [];
    p_laplace: "p-laplace" lacking [];
    neo_hooke: "neo-hooke" lacking [];
    signorini: "signorini" lacking ["nutils"];
    chouly_hild: "chouly-hild" lacking [];
    darcy: "darcy" lacking ["nutils", "mfem"];
    curl_curl: "curl-curl" lacking ["nutils", "mfem"];
    stokes_closed: "stokes-closed" lacking [];
    allen_cahn: "allen-cahn" lacking [];
    biharmonic: "biharmonic" lacking ["mfem"];
    elastic_transition: "elastic-transition" lacking ["nutils"];
    elastic_chouly_hild: "elastic-chouly-hild" lacking [];
    contact_patch: "contact-patch" lacking ["nutils"];
    tresca: "tresca" lacking ["nutils"];
}

/// On a mesh from Gmsh: its groups and its numbers of vertices are not those of generated meshes.
#[test]
fn cantilever() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/forms/beam.msh");
    let mesh = faceoff_mesh::io::read(&path).expect("the mesh");
    assert_eq!(lacking(&form("cantilever"), &mesh), NONE);
}

/// The codes that lack what a form needs, which is run by all others.
fn lacking_of_all(text: &str, mesh: &Mesh) -> Vec<&'static str> {
    names(agree_on(text, mesh, Codes::All))
}

/// The codes that lack what a form needs, which is run by some others in turn.
fn lacking(text: &str, mesh: &Mesh) -> Vec<&'static str> {
    names(agree_on(text, mesh, Codes::InTurn))
}

fn names(lacking: Vec<(&'static str, String)>) -> Vec<&'static str> {
    lacking.into_iter().map(|(name, _)| name).collect()
}

#[path = "gallery/contact.rs"]
mod contact;
#[path = "gallery/cubes.rs"]
mod cubes;
#[path = "gallery/lengths.rs"]
mod lengths;
#[path = "gallery/random.rs"]
mod random;
#[path = "gallery/spaces.rs"]
mod spaces;
#[path = "../../../tests/common/warm.rs"]
mod warm;

const NONE: [&str; 0] = [];

/// The square with two groups of cells, `inner` and `outer`, and the facets between them, `interface`.
fn two_regions() -> Mesh {
    let mut mesh = square();
    let is_inner = |nodes: &[u32]| {
        let centre = |axis: usize| {
            nodes
                .iter()
                .map(|k| mesh.points[*k as usize][axis])
                .sum::<f64>()
                / 3.0
        };
        centre(0) > 0.4 && centre(1) < 0.6
    };
    let triangles = || {
        mesh.cells()
            .filter(|(_, kind, _)| *kind == CellKind::Triangle)
    };
    let mut groups = [Group::new(2, 7), Group::new(2, 8)];
    let mut edges: BTreeMap<[u32; 2], Vec<bool>> = BTreeMap::new();
    for (cell, _, nodes) in triangles() {
        groups[usize::from(!is_inner(nodes))].cells.push(cell);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let edge = [nodes[a].min(nodes[b]), nodes[a].max(nodes[b])];
            edges.entry(edge).or_default().push(is_inner(nodes));
        }
    }
    let between = edges
        .into_iter()
        .filter(|(_, sides)| sides.len() == 2 && sides[0] != sides[1]);
    let nodes: Vec<u32> = between.flat_map(|(edge, _)| edge).collect();
    let mut interface = Group::new(1, 12);
    let first = mesh.cell_count() as u32;
    interface.cells = (first..first + nodes.len() as u32 / 2).collect();
    mesh.blocks.push(CellBlock::new(CellKind::Line, nodes));
    for (mut group, name) in
        groups
            .into_iter()
            .chain([interface])
            .zip(["inner", "outer", "interface"])
    {
        group.name = Some(name.into());
        mesh.groups.push(group);
    }
    mesh.groups.sort_by_key(|group| (group.dim, group.tag));
    mesh
}

#[test]
fn groups_of_cells_and_facets() {
    let text = r#"
name = "regions"
[spaces]
u = "P2"
[form]
F = """
inner(grad(u), grad(v))*dx + 10*inner(grad(u), grad(v))*dx(inner) + u*v*dx([7, outer]) - x*v*dx('outer')
- y*v*ds(left, right) - v*ds([top]) - 3*avg(v)*dS(interface) + u*v*ds
"""
"#;
    assert_eq!(lacking_of_all(text, &two_regions()), NONE);
    // Jumps across some facets only.
    let text = r#"
name = "membrane"
[spaces]
u = "DG1"
[form]
F = """
inner(grad(u), grad(v))*dx + u*v*dx - x*v*dx(inner) - exp(y)*v*dx
- inner(avg(grad(u)), jump(v, n))*dS - inner(jump(u, n), avg(grad(v)))*dS + 12/avg(h)*jump(u)*jump(v)*dS
+ 0.5*inner(jump(u, n), jump(v, n))*dS(interface) - (x*avg(v) + dot(jump(v, n), [1, 2])*h('+')*h('-'))*dS(interface)
"""
"#;
    assert_eq!(lacking_of_all(text, &two_regions()), NONE);
}

/// At a corner two groups hold the same dofs with other values: the later one counts, in every code.
#[test]
fn the_later_condition_counts_at_corners() {
    let text = |space: &str, conditions: &str| {
        format!(
            "name = \"corners\"\n[spaces]\nu = \"{space}\"\n[form]\nF = \"inner(grad(u), grad(v))*dx\"\n[dirichlet]\n{conditions}\n"
        )
    };
    for conditions in [
        "left = 1\nbottom = 2\nright = 3\ntop = 4",
        "top = 4\nright = 3\nbottom = 2\nleft = 1",
    ] {
        assert_eq!(lacking_of_all(&text("P2", conditions), &square()), NONE);
    }
    // Component by component.
    let conditions = "left = [1, \"free\"]\nbottom = [\"free\", \"y + 2\"]\ntop = [3, \"-x\"]";
    assert_eq!(lacking_of_all(&text("P1^2", conditions), &square()), NONE);
}

#[test]
fn conditions_on_facets_between_cells() {
    let text = r#"
name = "fixed-interface"
[spaces]
u = "P1"
[form]
F = "inner(grad(u), grad(v))*dx - v*dx"
[dirichlet]
interface = "x + 2*y"
left = 0
"#;
    assert_eq!(lacking_of_all(text, &two_regions()), NONE);
}

#[test]
fn cofactors_of_a_matrix_that_is_not_symmetric() {
    let text = r#"
name = "cofactors"
[spaces]
u = "P1"
[form]
F = "inner(cofac([[1 + x, 2], [y, 5]]), outer(grad(u), grad(v)))*dx - v*dx"
[dirichlet]
left = 0
"#;
    assert_eq!(lacking_of_all(text, &square()), NONE);
}

/// Words of some code as names; test functions by `test`; coefficients by conditions; interpolated data.
#[test]
fn names_that_codes_know_already() {
    let text = r#"
name = "names"
[spaces]
mean = "P1"
region = "P2"
N = "P0"
[parameters]
lambda = 2.5
real = 1.25
pi_2 = 0.5
[data]
area = "conditional(x < 0.5, 1, 2 + y)"
two = "1 + 1"
E = { expr = "exp(x)*y", space = "P1" }
[form]
F = """
inner(grad(mean), grad(test.mean))*dx + lambda*mean*test.mean*dx + region*test.mean*dx
+ area*inner(grad(region), grad(test.region))*dx - mean*test.region*dx - E*test.region*dx + pi_2*E*region*test.region*dx + two*grad(two)[0]*test.region*dx
+ real*N*test.N*dx - abs(x - 0.3)*test.N*dx + conditional(x*y >= 0.25, mean, 0.5)*test.N*dx
"""
[dirichlet]
region = { left = "y" }
"#;
    assert_eq!(lacking_of_all(text, &square()), NONE);
}

#[test]
fn discontinuous_spaces() {
    let text = |space: &str| {
        format!(
            "name = \"volumes\"\n[spaces]\nu = \"{space}\"\n[form]\nF = \"u*v*dx + 1/avg(h)*jump(u)*jump(v)*dS - exp(x*y)*v*dx + h*u^3*v*ds\"\n"
        )
    };
    assert_eq!(lacking(&text("P0"), &square()), NONE);
    assert_eq!(lacking(&text("DG1"), &square()), NONE);
    assert_eq!(lacking(&text("DG2"), &square()), ["freefem"]);
}

#[test]
fn cubic_elements() {
    let text = form("poisson").replace("P2", "P3");
    assert_eq!(lacking(&text, &square()), ["freefem"]);
}

#[test]
fn every_function() {
    let text = r#"
name = "functions"
[spaces]
u = "P1"
[data]
f = "sin(x) + cos(y) + tan(x*y) + asin(x/2) + acos(y/2) + atan(x) + atan2(y, x + 1) + sinh(x) + cosh(y) + tanh(x) + log(1 + x) + sqrt(1 + y)"
[form]
F = """
u*v*dx - (f + abs(x - 0.5) + min(x, y) + max(x, 0.3) + sign(x - y) + pos(0.4 - x) + pow(1 + x, y) + x^-2*0 + (1 + x)^-2 + pi)*v*dx
+ (sinh(0.1*u) + tanh(u) + atan(u) + 0.1*sqrt(1 + u^2) + u^3/(1 + u^2))*v*dx
"""
"#;
    assert_eq!(
        lacking_of_all(&text.replace("x^-2*0 + ", ""), &square()),
        NONE
    );
}

#[test]
fn tetrahedra() {
    let text = r#"
name = "cube"
[spaces]
u = "P2"
[form]
F = "(1 + z)*inner(grad(u), grad(v))*dx - exp(x)*z*v*dx - x*y*v*ds(top) + h*u*v*ds(front) + n[2]*v*ds"
[dirichlet]
left = "y + z"
"#;
    assert_eq!(lacking(text, &cube()), ["getfem"]);
    let text = r#"
name = "solid"
[spaces]
u = "P1^3"
[parameters]
mu = 1.5
lam = 2.0
[form]
F = "2*mu*inner(sym(grad(u)), sym(grad(v)))*dx + lam*div(u)*div(v)*dx - dot([0, x, -1], v)*dx + dot(cross(n, [1, 2, 3]), v)*ds(right) + dot(curl(u), v)*dx"
degree = 2
facet_degree = 2
[dirichlet]
left = [0, 0, "0.1*y"]
bottom = ["free", 0, "free"]
"#;
    assert_eq!(lacking(text, &cube()), NONE);
    let text = r#"
name = "faces"
[spaces]
u = "CR"
[form]
F = "inner(grad(u), grad(v))*dx - x*v*dx + jump(u)*jump(v)*dS"
[dirichlet]
left = 0
"#;
    assert_eq!(
        lacking(text, &cube()),
        ["freefem", "ngsolve", "getfem", "nutils", "mfem"]
    );
}

/// Jumps inside of functions: the derivatives of codes on facets between cells are put to the test.
#[test]
fn nonlinear_jumps() {
    let text = r#"
name = "jumps"
[spaces]
u = "DG1"
w = "DG1^2"
[form]
F = """
u*v*dx - exp(x)*v*dx + dot(w, test.w)*dx - dot([x, y*y], test.w)*dx + 0.1*u*inner(grad(w), grad(test.w))*dx
+ sqrt(1 + jump(u)^2)*jump(u)*jump(v)*dS + avg(u^2)*avg(v)*dS
+ 0.1*dot(jump(w), jump(grad(u)))*avg(v)*dS + jump(w, n)*jump(test.w, n)*(1 + avg(u))*dS - avg(x*u)*jump(test.w, n)*dS
+ max(u - 1, 0)*v*ds
"""
"#;
    assert_eq!(lacking_of_all(text, &square()), NONE);
}

/// With data that no rule integrates exactly, only the same points give the same values.
#[test]
fn every_rule() {
    let text = |degree: usize, facet_degree: usize| {
        format!(
            "name = \"rules\"\n[spaces]\nu = \"P1\"\n[form]\nF = \"inner(grad(u), grad(v))*dx + u*v*dx - exp(3*x)*sin(9*y)*v*dx - cos(9*x + 7*y)*v*ds\"\n\
             degree = {degree}\nfacet_degree = {facet_degree}\n"
        )
    };
    for [degree, facet_degree] in [[2, 3], [5, 5], [1, 9]] {
        assert_eq!(lacking_of_all(&text(degree, facet_degree), &square()), NONE);
    }
    assert_eq!(lacking_of_all(&text(2, 2), &cube()), NONE);
    assert_eq!(lacking_of_all(&text(2, 5), &cube()), NONE);
    assert_eq!(lacking_of_all(&text(5, 5), &cube()), ["getfem"]);
}

/// Terms over one measure with rules of their own. A rule of one point has its measure for itself, as FFCx 0.5 takes its point for other rules too.
#[test]
fn measures_with_degrees() {
    let text = "name = \"degrees\"\n[spaces]\nu = \"P2\"\n[form]\nF = \"\"\"\n(1 + x^2)*inner(grad(u), grad(v))*dx(degree=5) + u*v*dx(degree=2)\n\
        - exp(3*x)*sin(9*y)*v*dx(degree=2) + u*v*ds(degree=1) - sin(5*y)*v*ds(right, degree=1) - x*y*v*ds(left, top, degree=1)\n\"\"\"\n";
    assert_eq!(lacking_of_all(text, &square()), ["getfem"]);
    let plain = text.replace("P2", "P1").replace("degree=1", "degree=2");
    assert_eq!(lacking_of_all(&plain, &cube()), ["getfem"]);
}
