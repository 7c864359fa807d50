//! The forms in tests/forms, as scripts of all codes, run on one mesh: the fields agree to rounding.
//!
//! FreeFEM, dolfinx and GetFEM must be there; scikit-fem, NGSolve and nutils are run where `target/engines` has them (tests/run installs them).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use faceoff_form::Problem;
use faceoff_form::codes::{CODES, Code};
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::generate::union_jack;

/// Largest difference of two codes, over the largest value.
const TOLERANCE: f64 = 1e-11;

/// Rounded coordinates of the centre of a cell and of a node in it.
type Place = [i64; 6];

/// The values of each unknown at the nodes of cells.
type Values = BTreeMap<String, BTreeMap<Place, Vec<f64>>>;

fn form(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/forms/{name}.toml"));
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

/// The interpreter of the codes that pip installs, if it is there.
fn engines() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/engines/bin/python3");
    root.is_file().then_some(root)
}

/// What a code's script writes; none where the code is not there.
fn run(code: &Code, problem: &Problem, mesh: &Mesh, script: &str) -> Option<Values> {
    let mut command: Vec<PathBuf> = code.command.iter().map(PathBuf::from).collect();
    if code.command == ["python3"] {
        command = vec![engines()?];
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(code.file(problem));
    std::fs::write(&path, script).expect("a script");
    code.write_mesh(folder.path(), problem, mesh)
        .expect("a mesh");
    let ran = Command::new(&command[0])
        .args(&command[1..])
        .arg(&path)
        .current_dir(folder.path())
        .output()
        .unwrap_or_else(|e| panic!("{}: {}: {e}", code.name, command[0].display()));
    assert!(
        ran.status.success(),
        "{} on {}: {}\n{}{}",
        code.name,
        problem.name,
        ran.status,
        String::from_utf8_lossy(&ran.stdout),
        String::from_utf8_lossy(&ran.stderr)
    );
    let written = path.with_extension("vtu");
    // FreeFEM's is called like the problem, as is its script.
    Some(values(&written, problem))
}

fn values(path: &Path, problem: &Problem) -> Values {
    let mesh = faceoff_mesh::io::read(path).expect("a result");
    let mut all = Values::new();
    for unknown in &problem.unknowns {
        let field = mesh.fields.iter().find(|field| field.name == unknown.name);
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

/// Runs all codes that have what a form needs, and returns those that lack something, with what.
fn agree(name: &str, mesh: &Mesh) -> Vec<(&'static str, String)> {
    agree_on(&form(name), mesh)
}

fn agree_on(text: &str, mesh: &Mesh) -> Vec<(&'static str, String)> {
    let problem =
        Problem::parse(Path::new("form.toml"), text, mesh).unwrap_or_else(|e| panic!("{e}"));
    let mut lacking = Vec::new();
    let mut results: Vec<(&str, Values)> = Vec::new();
    for code in &CODES {
        match code.script(&problem) {
            Err(why) => lacking.push((code.name, why)),
            Ok(script) => {
                results.extend(run(code, &problem, mesh, &script).map(|found| (code.name, found)));
            }
        }
    }
    let (first, reference) = &results[0];
    let mut line = format!("{:<18} {first}", problem.name);
    let mut failed = false;
    for (code, found) in &results[1..] {
        let apart = difference(reference, found);
        line += &format!(" – {code} {apart:.1e}");
        failed |= apart > TOLERANCE;
    }
    for (code, why) in &lacking {
        line += &format!("; {code}: {why}");
    }
    println!("{line}");
    assert!(!failed, "{line}");
    lacking
}

/// A form that all codes have all spaces for.
macro_rules! all_codes_agree {
    ($($test:ident: $name:literal),* $(,)?) => {
        $(#[test]
        fn $test() {
            let lacking = agree($name, &square());
            assert!(lacking.is_empty(), "{lacking:?}");
        })*
    };
}

all_codes_agree! {
    poisson: "poisson",
    transport: "transport",
    supg: "supg",
    elasticity: "elasticity",
    stokes: "stokes",
    stokes_by_crouzeix_raviart: "stokes-cr",
    interior_penalty: "interior-penalty",
    nitsche: "nitsche",
    minimal_surface: "minimal-surface",
    p_laplace: "p-laplace",
    neo_hooke: "neo-hooke",
    signorini: "signorini",
}
