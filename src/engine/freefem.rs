//! FreeFEM: its job form, its command, its version.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::job::{self, Files};
use super::process::find_in_path;
use super::within::Within;
use super::{Case, Settings, unique, version};
use faceoff_fem::contact::Law;
use faceoff_fem::quadrature::Rule;
use faceoff_fem::scene::{Expression, HRule};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file;

/// The companion: the script that is run, and the method that it includes.
const SCRIPTS: [(&str, &str); 2] = [
    ("signorini.edp", include_str!("../../freefem/signorini.edp")),
    ("nitsche.idp", include_str!("../../freefem/nitsche.idp")),
];

/// The program without graphics.
pub(super) fn program(within: &Within) -> Option<PathBuf> {
    let here = || find_in_path("FreeFem++-nw").or_else(|| find_in_path("FreeFem++"));
    within.program(here, "FreeFem++-nw")
}

fn missing() -> Error {
    Error::engine(
        "freefem",
        "FreeFem++ is not installed",
        "run `faceoff engines install`, or on Debian `apt-get install freefem++`",
    )
}

/// The digest of the script that is run.
pub(super) fn digest(scripts: Option<&Path>) -> Result<String> {
    super::digest_of(&SCRIPTS, scripts)
}

/// Runs the job's copy of the script in `folder`.
pub(super) fn command(folder: &Path, scripts: Option<&Path>, within: &Within) -> Result<Command> {
    // FreeFEM first looks for included files next to the script.
    super::put_scripts(&SCRIPTS, scripts, folder)?;
    let mut command = Command::new(program(within).ok_or_else(missing)?);
    command
        .args(["-ne", "-v", "0", "-nw", SCRIPTS[0].0])
        .env("LC_ALL", "C")
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1");
    Ok(within.enclose(command, folder))
}

/// Solves a small system in FreeFEM, and asks the package for its version, because the banner of
/// Debian's 4.11 prints 4.9.
pub(super) fn probe(within: &Within) -> Result<String> {
    let program = program(within).ok_or_else(missing)?;
    let folder = file::Temporary::new()?;
    let script = folder.path().join("probe.edp");
    let text = "mesh Th = square(2, 2); fespace Vh(Th, P1nc); Vh u, v;\n\
                solve a(u, v, solver=UMFPACK) = int2d(Th)(dx(u)*dx(v) + dy(u)*dy(v)) - int2d(Th)(v) + on(1, u=0);\n\
                cout << \"version \" << version << endl;\n\
                if (!(u[].max > 0)) exit(3);\n";
    fs::write(&script, text).map_err(Error::io(&script, "write"))?;
    let mut command = Command::new(&program);
    command.args(["-ne", "-v", "0", "-nw", "probe.edp"]);
    command.env("LC_ALL", "C");
    let command = within.enclose(command, folder.path());
    let told = version::told("freefem", &command, folder.path(), 60)?;
    let version = package_version(within, folder.path()).or(told);
    let version = version.unwrap_or_else(|| "unknown".into());
    version::accept("freefem", &version)?;
    Ok(version)
}

/// Where Debian has FreeFEM's plugins, which its FreeFEM does not look into.
const PLUGINS: [&str; 2] = ["FF_LOADPATH", "/usr/lib/freefem++;;"];

/// The variable with which FreeFEM finds plugins, if the command runs FreeFEM and the variable is not set.
pub(super) fn plugins(words: &[String]) -> Option<[&'static str; 2]> {
    let runs = |word: &String| word.contains("FreeFem") || word.contains("ff-mpirun");
    let [name, path] = PLUGINS;
    let is_there = Path::new(path.trim_end_matches(';')).is_dir();
    (words.iter().any(runs) && is_there && std::env::var_os(name).is_none()).then_some(PLUGINS)
}

/// The warning for a FreeFEM that finds no plugins; it is tested by loading one.
///
/// # Errors
/// A folder that cannot be created.
pub fn lacks_plugins() -> Result<Option<String>> {
    let here = Within::default();
    let Some(program) = program(&here) else {
        return Ok(None);
    };
    let folder = file::Temporary::new()?;
    let script = folder.path().join("load.edp");
    fs::write(&script, "load \"msh3\"\n").map_err(Error::io(&script, "write"))?;
    let loads = |variable: Option<[&str; 2]>| {
        let mut command = Command::new(&program);
        command
            .args(["-ne", "-v", "0", "-nw", "load.edp"])
            .envs(variable.map(|[name, path]| (name, path)));
        version::told("freefem", &command, folder.path(), 60).is_ok()
    };
    if loads(None) {
        return Ok(None);
    }
    let [name, path] = PLUGINS;
    Ok(Some(if loads(Some(PLUGINS)) {
        format!(
            "`load` finds its plugins only with {name}=\"{path}\" in the environment; codes of a face-off get that unless it is set"
        )
    } else {
        "`load` finds no plugins, as msh3: on Debian `apt-get install libfreefem++`, else put their folder into FF_LOADPATH".into()
    }))
}

/// The version of Debian's package, if this is its program: 4.11 of 4.11+dfsg1-4.
pub(super) fn package_version(within: &Within, folder: &Path) -> Option<String> {
    if within.is_here() && !program(within)?.starts_with("/usr/bin") {
        return None;
    }
    let mut command = Command::new("dpkg-query");
    command.args(["-W", "-f", "${Version}", "freefem++"]);
    let output = within.enclose(command, folder).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let end = text.find(['+', '-', '~']).unwrap_or(text.len());
    let version = text[..end].split_once(':').map_or(&text[..end], |v| v.1);
    (output.status.success() && !version.is_empty()).then(|| version.to_owned())
}

/// Writes job.json, for people, and job.idp with each case's mesh and γ, for FreeFEM.
pub(super) fn write_job(
    engine: &str,
    folder: &Path,
    cases: &[&Case],
    settings: &Settings,
) -> Result<()> {
    let syntax = |e: &Expression| e.to_freefem();
    job::write(engine, folder, cases, settings, syntax, |case, id| {
        let write = |name: &str, text: String| -> Result<()> {
            let path = folder.join(id).join(name);
            fs::write(&path, text).map_err(Error::io(&path, "write"))
        };
        write("mesh.mesh", mesh(case))?;
        let gamma = job::gamma_by_cell(&case.problem)?;
        let mut text = format!("{}\n", gamma.len());
        for (cell, value) in gamma {
            let _ = writeln!(text, "{cell} {value:e}");
        }
        write("gamma.txt", text)?;
        Ok(Files {
            mesh: format!("{id}/mesh.mesh").into(),
            gamma: format!("{id}/gamma.txt").into(),
        })
    })?;
    let path = folder.join("job.idp");
    fs::write(&path, job_idp(cases, settings)).map_err(Error::io(&path, "write"))
}

/// Medit's format, numbers from 1: vertices, cells, boundary faces with the part's label.
fn mesh(case: &Case) -> String {
    let problem = &case.problem;
    let mesh = problem.space.mesh;
    let (of_cells, of_faces) = match mesh.dim {
        2 => ("Triangles", "Edges"),
        _ => ("Tetrahedra", "Triangles"),
    };
    let mut text = format!(
        "MeshVersionFormatted 2\nDimension {}\nVertices\n{}\n",
        mesh.dim,
        mesh.points.len()
    );
    for point in &mesh.points {
        for x in &point[..mesh.dim] {
            let _ = write!(text, "{x:e} ");
        }
        text.push_str("0\n");
    }
    let row = |text: &mut String, vertices: &[u32], label: i64| {
        for v in vertices {
            let _ = write!(text, "{} ", v + 1);
        }
        let _ = writeln!(text, "{label}");
    };
    let _ = writeln!(text, "{of_cells}\n{}", mesh.cell_count());
    for cell in 0..mesh.cell_count() {
        row(&mut text, mesh.cell(cell), 0);
    }
    let labelled = problem.parts.iter().flatten().count();
    let _ = writeln!(text, "{of_faces}\n{labelled}");
    for (face, part) in problem.parts.iter().enumerate() {
        if let Some(part) = part {
            row(&mut text, mesh.face(face), *part as i64);
        }
    }
    text.push_str("End\n");
    text
}

/// The job as FreeFEM's source text. Expressions were parsed and are written from their tree.
fn job_idp(cases: &[&Case], settings: &Settings) -> String {
    let mut text = format!(
        "real stopIncrement = {:?};\nint stopIterations = {};\n",
        settings.stop.increment, settings.stop.max_iterations
    );
    if let Some(case) = cases.first() {
        // FreeFEM decides by it what it compiles.
        let dim = case.problem.space.mesh.dim;
        let _ = writeln!(text, "macro dimension() {dim} //");
        write_rule(&mut text, "cellRule", &case.problem.cell_rule);
        write_rule(&mut text, "faceRule", &case.problem.face_rule);
    }
    // Cases of one scene share its functions.
    let scenes = unique(cases.iter().map(|case| case.scene().data()));
    let number = |k: usize| scenes.iter().position(|of| *of == cases[k].scene().data());
    for name in ["sceneF", "sceneG", "sceneT", "scenePsi"] {
        let values = scenes.iter().map(|data| {
            let of = match name {
                "sceneF" => &data.f,
                "sceneG" => &data.g,
                "sceneT" => &data.t,
                _ => &data.psi,
            };
            of.to_freefem()
        });
        let values: Vec<String> = values.collect();
        // FreeFEM leaves a function by an exception, which takes ninety times as long as a formula; but of `?:` it takes both sides, and
        // ends where one divides by zero.
        if let [value] = unique(&values)[..] {
            let _ = writeln!(text, "macro {name}(k) ({value}) //");
            continue;
        }
        let _ = writeln!(text, "func real {name}(int k) {{");
        for (number, value) in values.iter().enumerate() {
            let _ = writeln!(text, "  if (k == {number}) return {value};");
        }
        text.push_str("  return noScene(k);\n}\n");
    }
    let list = |item: &dyn Fn(usize) -> String| -> String {
        let items: Vec<_> = (0..cases.len()).map(item).collect();
        format!("[{}]", items.join(", "))
    };
    let method = |k: usize| cases[k].problem.method();
    let _ = write!(
        text,
        "int cases = {};\n\
         string[int] caseId = {};\n\
         string[int] caseFolder = {};\n\
         string[int] caseElement = {};\n\
         int[int] caseScene = {};\n\
         real[int] caseTheta1 = {};\n\
         real[int] caseTheta2 = {};\n\
         int[int] caseCorrected = {};\n\
         real[int] caseGamma0 = {};\n\
         int[int] caseGlobalH = {};\n",
        cases.len(),
        list(&|k| format!("\"{}\"", job::case_id(k))),
        list(&|k| format!("\"{}\"", job::case_id(k))),
        list(&|k| format!("\"{}\"", method(k).element.name())),
        list(&|k| number(k).unwrap_or_default().to_string()),
        list(&|k| format!("{:?}", method(k).law.thetas()[0])),
        list(&|k| format!("{:?}", method(k).law.thetas()[1])),
        list(&|k| u8::from(method(k).law == Law::FluxCorrected).to_string()),
        list(&|k| format!("{:?}", cases[k].problem.discretisation.gamma0())),
        list(&|k| u8::from(cases[k].problem.discretisation.h == HRule::Global).to_string()),
    );
    text
}

fn write_rule(text: &mut String, name: &str, rule: &Rule) {
    // As FreeFEM writes an array, Rust writes a vector.
    let rows = rule.points.iter().zip(&rule.weights);
    let rows: Vec<Vec<f64>> = rows
        .map(|(point, w)| [&point[..], &[*w]].concat())
        .collect();
    let _ = writeln!(text, "real[int,int] {name} = {rows:?};");
}
