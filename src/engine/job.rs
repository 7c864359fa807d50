//! The job folder: the input of an engine, and the conditions for its answer; tests/engines/README.md describes the protocol.
//!
//! ```text
//! job.json             method, stopping rule, quadrature points and weights, data; for FreeFEM job.idp
//! case-0/, case-1/, …  the mesh and γ, in the format that the code reads best
//! out/                 the engine writes its dofs here, and status.json last, by rename
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Answer, Case, Settings, accepts_family};
use faceoff_fem::contact::{Law, Problem};
use faceoff_fem::quadrature::Rule;
use faceoff_fem::scene::{Expression, HRule};
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::file;

/// Version of the protocol.
pub(super) const PROTOCOL: u32 = 1;

/// The file that an engine writes last.
pub(super) const STATUS: &str = "out/status.json";

/// The largest size in bytes of a status, and of a row of values in text.
const STATUS_BYTES: u64 = 64 << 20;
const ROW_BYTES: u64 = 256;

/// Values of one dof given by several cells may differ by this, relative to max|u|.
const SAME_DOF: f64 = 1e-13;

#[derive(Serialize)]
struct Job<'a> {
    protocol: u32,
    faceoff: &'a str,
    engine: &'a str,
    stop: StopRule,
    quadrature: Quadrature<'a>,
    cases: Vec<JobCase>,
}

#[derive(Serialize)]
struct StopRule {
    increment: f64,
    max_iterations: usize,
}

#[derive(Serialize)]
struct Quadrature<'a> {
    cell: Points<'a>,
    face: Points<'a>,
}

#[derive(Serialize)]
struct Points<'a> {
    points: &'a [Vec<f64>],
    weights: &'a [f64],
}

impl<'a> Points<'a> {
    fn of(rule: &'a Rule) -> Self {
        Points {
            points: &rule.points,
            weights: &rule.weights,
        }
    }
}

#[derive(Serialize)]
struct JobCase {
    id: String,
    scene: String,
    n: Option<usize>,
    dimension: usize,
    method: String,
    element: &'static str,
    theta1: f64,
    theta2: f64,
    /// Whether λ = ∂ₙu - L(φ_F)/|F| replaces ∂ₙu on a contact face F.
    flux_corrected: bool,
    mesh: serde_json::Value,
    /// γ = γ₀ h, which a code may compute itself; it must equal the γ in the files.
    gamma0: f64,
    h: &'static str,
    gamma: serde_json::Value,
    data: BTreeMap<&'static str, String>,
}

/// Where the mesh and γ of a case lie, relative to the job folder.
pub(super) struct Files {
    pub mesh: serde_json::Value,
    pub gamma: serde_json::Value,
}

/// A case's folder and the stem of its files.
pub(super) fn case_id(index: usize) -> String {
    format!("case-{index}")
}

/// How messages name a case.
pub fn case_label(case: &Case) -> String {
    label(
        case.scene().name(),
        &case.problem.method().to_string(),
        case.n,
    )
}

/// The same of its parts.
pub fn label(scene: &str, method: &str, n: Option<usize>) -> String {
    let n = n.map_or(String::new(), |n| format!(", n = {n}"));
    format!("{scene}, {method}{n}")
}

/// The cases of each job, by their places: those with one pair of rules, and so of one dimension.
pub(super) fn jobs(cases: &[&Case]) -> Vec<Vec<usize>> {
    let mut jobs: Vec<Vec<usize>> = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let has_its_rules = |job: &&mut Vec<usize>| {
            let (a, b) = (&cases[job[0]].problem, &case.problem);
            (&a.cell_rule, &a.face_rule) == (&b.cell_rule, &b.face_rule)
        };
        match jobs.iter_mut().find(has_its_rules) {
            Some(job) => job.push(k),
            None => jobs.push(vec![k]),
        }
    }
    jobs
}

/// γ of each cell at a contact face, by ascending cell.
///
/// # Errors
/// Two contact faces of one cell with different γ: no engine could distinguish them.
pub(super) fn gamma_by_cell(problem: &Problem) -> Result<BTreeMap<usize, f64>> {
    let mut gamma = BTreeMap::new();
    for face in &problem.contact {
        if let Some(other) = gamma.insert(face.cell, face.gamma)
            && other != face.gamma
        {
            return Err(Error::Mesh {
                mesh: problem.space.mesh.name.clone(),
                what: format!("cell {} has two contact faces with different γ", face.cell),
                remedy: "use a rule for h that depends on the cell only".into(),
            });
        }
    }
    Ok(gamma)
}

/// Writes job.json; `write_case` writes a case's folder, `syntax` an expression.
pub(super) fn write(
    engine: &str,
    folder: &Path,
    cases: &[&Case],
    settings: &Settings,
    syntax: impl Fn(&Expression) -> String,
    write_case: impl Fn(&Case, &str) -> Result<Files>,
) -> Result<()> {
    let Some(Case { problem, .. }) = cases.first().copied() else {
        return Err(Error::usage("there is no case to run", "name a scene"));
    };
    let (cell, face) = (&problem.cell_rule, &problem.face_rule);
    let out = folder.join("out");
    fs::create_dir_all(&out).map_err(Error::io(&out, "make"))?;
    let cases = cases
        .iter()
        .enumerate()
        .map(|(index, case)| {
            let id = case_id(index);
            let path = folder.join(&id);
            fs::create_dir_all(&path).map_err(Error::io(&path, "make"))?;
            let files = write_case(case, &id)?;
            let data = case.scene().data();
            let method = case.problem.method();
            accepts_family(engine, &method)?;
            let [theta1, theta2] = method.law.thetas();
            Ok(JobCase {
                id,
                scene: case.scene().name().to_owned(),
                n: case.n,
                dimension: case.problem.space.mesh.dim,
                method: method.to_string(),
                element: method.element.name(),
                theta1,
                theta2,
                flux_corrected: method.law == Law::FluxCorrected,
                mesh: files.mesh,
                gamma0: case.problem.discretisation.gamma0(),
                h: match case.problem.discretisation.h {
                    HRule::Local => "local",
                    HRule::Global => "global",
                },
                gamma: files.gamma,
                data: [
                    ("f", &data.f),
                    ("g", &data.g),
                    ("t", &data.t),
                    ("psi", &data.psi),
                ]
                .map(|(name, expression)| (name, syntax(expression)))
                .into(),
            })
        })
        .collect::<Result<_>>()?;
    let job = Job {
        protocol: PROTOCOL,
        faceoff: env!("CARGO_PKG_VERSION"),
        engine,
        stop: StopRule {
            increment: settings.stop.increment,
            max_iterations: settings.stop.max_iterations,
        },
        quadrature: Quadrature {
            cell: Points::of(cell),
            face: Points::of(face),
        },
        cases,
    };
    let path = folder.join("job.json");
    let text = serde_json::to_string_pretty(&job).map_err(|e| {
        Error::file(
            &path,
            Place::Whole,
            format!("it cannot be written: {e}"),
            "report this",
        )
    })?;
    fs::write(&path, text).map_err(Error::io(&path, "write"))
}

#[derive(Deserialize)]
struct Status {
    protocol: u32,
    version: String,
    cases: Vec<StatusCase>,
}

#[derive(Deserialize)]
struct StatusCase {
    id: String,
    converged: bool,
    iterations: usize,
    /// JSON has no NaN: an increment that is not a number comes as null.
    increments: Vec<Option<f64>>,
    rows: usize,
    dofs: String,
    #[serde(default)]
    seconds: BTreeMap<String, f64>,
}

/// Reads what an engine wrote. It counts only if every case is there, with the expected number of
/// rows, every value finite, and each dof the same from every cell that has it.
pub(super) fn read(engine: &str, folder: &Path, cases: &[&Case]) -> Result<(String, Vec<Answer>)> {
    let fault = |what: String| {
        Error::engine(
            engine,
            what,
            "its answer does not count; keep the job folder with --keep and look at log.txt",
        )
    };
    let path = folder.join(STATUS);
    if path.symlink_metadata().is_err() {
        return Err(fault("it ended without writing out/status.json".into()));
    }
    let text =
        file::read_beneath(folder, STATUS, STATUS_BYTES).map_err(|e| fault(e.to_string()))?;
    let status: Status = serde_json::from_slice(&text)
        .map_err(|e| fault(format!("its out/status.json is not valid: {e}")))?;
    if status.protocol != PROTOCOL {
        return Err(fault(format!(
            "it speaks protocol {}, not {PROTOCOL}",
            status.protocol
        )));
    }
    let answers = cases
        .iter()
        .enumerate()
        .map(|(index, case)| {
            let id = case_id(index);
            let label = case_label(case);
            let mut reported = status.cases.iter().filter(|c| c.id == id);
            let (Some(reported), None) = (reported.next(), reported.next()) else {
                return Err(fault(format!(
                    "its status does not have {id} ({label}) exactly once"
                )));
            };
            let space = &case.problem.space;
            let expected = space.mesh.cell_count() * space.local_dofs;
            if reported.rows != expected {
                return Err(fault(format!(
                    "it wrote {} values for {id} ({label}), and there are {expected}",
                    reported.rows
                )));
            }
            if reported.iterations != reported.increments.len() {
                return Err(fault(format!(
                    "it reports {} iterations of {id} ({label}) but {} increments",
                    reported.iterations,
                    reported.increments.len()
                )));
            }
            let values = read_values(folder, &reported.dofs, expected, space.local_dofs)
                .map_err(|what| fault(format!("{} of {id} ({label}): {what}", reported.dofs)))?;
            let u = to_dofs(&case.problem, &values)
                .map_err(|what| fault(format!("{id} ({label}): {what}")))?;
            Ok(Answer {
                residual: case.problem.backward_error(&u).0,
                u,
                increments: reported
                    .increments
                    .iter()
                    .map(|i| i.unwrap_or(f64::NAN))
                    .collect(),
                converged: reported.converged,
                step: reported.iterations,
                history: None,
                seconds: reported.seconds.clone().into_iter().collect(),
            })
        })
        .collect::<Result<_>>()?;
    Ok((status.version, answers))
}

/// Changes the protocol version of a written job.
pub(super) fn pretend_protocol(folder: &Path, protocol: u32) -> Result<()> {
    let path = folder.join("job.json");
    let text = fs::read_to_string(&path).map_err(Error::io(&path, "read"))?;
    let own = format!("\"protocol\": {PROTOCOL}");
    let text = text.replacen(&own, &format!("\"protocol\": {protocol}"), 1);
    fs::write(&path, text).map_err(Error::io(&path, "write"))
}

/// The values of all local dofs of all cells for a case in a kept job folder, though the answer may not count.
pub fn raw_values(folder: &Path, index: usize, problem: &Problem) -> Option<Vec<f64>> {
    let space = &problem.space;
    let expected = space.mesh.cell_count() * space.local_dofs;
    ["f64", "txt"].into_iter().find_map(|form| {
        let name = format!("out/{}.dofs.{form}", case_id(index));
        read_values(folder, &name, expected, space.local_dofs).ok()
    })
}

/// Values of all local dofs of all cells, from rows of text or raw little-endian binary64.
pub(super) fn read_values(
    folder: &Path,
    name: &str,
    expected: usize,
    local: usize,
) -> Result<Vec<f64>, String> {
    let most = ROW_BYTES * (expected as u64 + 1);
    let bytes = file::read_beneath(folder, name, most).map_err(|e| e.to_string())?;
    if name.ends_with(".f64") {
        return binary(&bytes, expected);
    }
    let text = str::from_utf8(&bytes).map_err(|e| format!("it is not text: {e}"))?;
    let mut values = vec![None; expected];
    for (number, line) in text.lines().enumerate() {
        let row = || format!("line {} (`{line}`)", number + 1);
        let mut words = line.split_ascii_whitespace();
        let (Some(cell), Some(index), Some(value), None) =
            (words.next(), words.next(), words.next(), words.next())
        else {
            return Err(format!("{} is not `cell local value`", row()));
        };
        let (Ok(cell), Ok(index), Ok(value)) = (
            cell.parse::<usize>(),
            index.parse::<usize>(),
            value.parse::<f64>(),
        ) else {
            return Err(format!("{} does not hold two counts and a number", row()));
        };
        let slot = cell
            .checked_mul(local)
            .filter(|_| index < local)
            .and_then(|start| values.get_mut(start + index))
            .ok_or_else(|| format!("{} names a dof that is not there", row()))?;
        if slot.replace(value).is_some() {
            return Err(format!("{} names a dof for the second time", row()));
        }
    }
    let missing = values.iter().filter(|v| v.is_none()).count();
    values
        .into_iter()
        .collect::<Option<_>>()
        .ok_or_else(|| format!("{missing} of {expected} rows are missing"))
}

/// Little-endian binary64.
///
/// # Errors
/// A message about a wrong number of bytes.
pub fn binary(bytes: &[u8], expected: usize) -> Result<Vec<f64>, String> {
    if bytes.len() != 8 * expected {
        return Err(format!(
            "it has {} bytes, and {expected} values take {}",
            bytes.len(),
            8 * expected
        ));
    }
    let (values, _) = bytes.as_chunks::<8>();
    Ok(values.iter().map(|v| f64::from_le_bytes(*v)).collect())
}

/// One value per dof, after checking that every cell that has it gives the same.
///
/// # Errors
/// A message about values that are not finite, or not the same from every cell.
pub fn to_dofs(problem: &Problem, values: &[f64]) -> Result<Vec<f64>, String> {
    let space = &problem.space;
    let size = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut u: Vec<Option<(f64, usize)>> = vec![None; space.dofs];
    for cell in 0..space.mesh.cell_count() {
        let told = &values[cell * space.local_dofs..(cell + 1) * space.local_dofs];
        for (local, (&dof, &value)) in space.cell_dofs(cell).iter().zip(told).enumerate() {
            let place = || {
                let x = space.point(dof as usize);
                format!(
                    "dof {local} of cell {cell} (vertices {:?}), at ({}, {})",
                    space.mesh.cell(cell),
                    x[0],
                    x[1]
                )
            };
            if !value.is_finite() {
                return Err(format!("{} is {value}", place()));
            }
            match u[dof as usize] {
                None => u[dof as usize] = Some((value, cell)),
                Some((other, from)) if (value - other).abs() > SAME_DOF * size => {
                    return Err(format!(
                        "{} is {value:e}, but {other:e} from cell {from}",
                        place()
                    ));
                }
                Some(_) => {}
            }
        }
    }
    Ok(u.into_iter()
        .map(|told| told.expect("invariant: every dof belongs to a cell").0)
        .collect())
}
