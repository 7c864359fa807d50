//! Any problem: the user's codes on one mesh or each on its own mesh, field by field and number by number.

mod at_once;
mod cause;
mod diagnosis;
mod eigen;
mod fields;
mod in_form;
mod limiting;
mod meetings;
mod numbers;
mod orders;
mod solved;
mod spectra;
mod sweep;
mod symmetries;
mod systems;
mod times;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;
use serde_json::Value;

pub use cause::{Cause, Finding};
pub use diagnosis::{Apart, Diagnosis, Moved};
pub use eigen::OfResidual;
pub use fields::worst;
pub use in_form::OfForm;
pub use meetings::{Extrapolated, OfMeeting};
pub use solved::{NumberFound, Solved, solved};
pub use spectra::{OfSpectra, OfSpectrum};
pub use sweep::{Cost, OfPoint, OfSweep, Smallest, swept};
pub use symmetries::{OfImage, Symmetries};
pub use systems::OfSystems;
pub use times::short;

use crate::engine::{self, How, Left, Progress, Task};
use crate::run::convergence::{Convergence, Limit};
use crate::run::{Asked, Code, FaceOff, Failure, Judged, Label, Level, Record, Same, Store};
use faceoff_form::image::Image;
use faceoff_judge::{ComparedField, Comparison, UpTo, Verdict};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;

/// Which codes are run, and how.
pub struct Running<'a> {
    /// Those of the face-off by name; all where none is named.
    pub codes: Vec<String>,
    /// Where job folders are kept; none: they are removed.
    pub keep: Option<PathBuf>,
    /// Longest time of one run.
    pub time_limit: Duration,
    /// Are codes run in a sandbox?
    pub sandbox: bool,
    /// Keeps what each writes, and has it from an earlier run.
    pub store: Option<&'a Store>,
    /// Answers that were recorded, which the codes are judged against.
    pub against: Option<&'a Record>,
    /// Runs codes again with one thing changed.
    pub diagnose: bool,
    /// Images of the problem that codes get too.
    pub symmetries: Vec<Image>,
    /// May a code run by itself, so that only its answers are reported?
    pub alone: bool,
}

/// What a face-off found.
#[derive(Debug, Serialize)]
pub struct FaceOffOutcome {
    /// As its file has it.
    pub name: String,
    /// What the problem is, in the file's words.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub about: String,
    /// The worst of fields, numbers and runs.
    pub verdict: Verdict,
    /// Each code on each level.
    pub runs: Vec<RunOf>,
    /// How many codes ran at the same time, so that their times depend on each other.
    pub at_once: usize,
    /// Codes that were left out, as the user allowed it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<Failure>,
    /// As the file asks for them.
    pub fields: Vec<OfField>,
    /// As the file asks for them.
    pub numbers: Vec<OfNumber>,
    /// As the file asks for them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spectra: Vec<OfSpectrum>,
    /// Of a form on which codes disagree: what the result of each leaves of it, on the coarsest mesh where they do.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub in_form: Vec<OfForm>,
    /// Every two codes that wrote their linear systems.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub systems: Vec<OfSystems>,
    /// Where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis: Option<Diagnosis>,
    /// Where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symmetries: Option<Symmetries>,
    /// Of a file with a sweep: all its points. The rest is about one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<OfSweep>,
    /// The pair that is farthest from agreement, with the result of its first code.
    #[serde(skip)]
    pub shown: Option<(Comparison, Box<Results>)>,
}

/// Several face-offs, as of scenes of elasticity by several methods.
#[derive(Debug, Serialize)]
pub struct FaceOffs {
    /// The worst.
    pub verdict: Verdict,
    /// As they were asked for.
    pub face_offs: Vec<FaceOffOutcome>,
}

impl FaceOffs {
    /// At least one.
    pub fn new(face_offs: Vec<FaceOffOutcome>) -> Self {
        FaceOffs {
            verdict: Verdict::of_all(face_offs.iter().map(|of| of.verdict)),
            face_offs,
        }
    }
}

impl FaceOffOutcome {
    /// Each run of a code, with its level and its problem.
    pub fn asked(&self) -> Vec<(String, Level, Value)> {
        let runs = self.runs.iter().filter(|run| run.seconds.is_some());
        runs.map(|run| (run.code.clone(), run.of.clone(), run.problem.clone()))
            .collect()
    }
}

/// One code on one mesh.
#[derive(Debug, Serialize)]
pub struct RunOf {
    /// Its name.
    pub code: String,
    /// The refinement, where the mesh has several.
    pub n: Option<usize>,
    /// What it is called, as `n = 16` or `dt = 0.05`; empty where there is only one.
    pub level: Label,
    /// Of the process; none of a recorded answer, or without a result.
    pub seconds: Option<f64>,
    /// Why there is no result.
    pub failure: Option<String>,
    /// The questions that it was asked, without the code itself.
    #[serde(skip)]
    pub problem: Value,
    #[serde(skip)]
    of: Level,
}

/// A field of all codes.
#[derive(Debug, Serialize)]
pub struct OfField {
    /// Its name.
    pub field: String,
    /// What the codes share, which decides how it is judged.
    pub same: Same,
    /// What its problem leaves open, which is taken away before anything is judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub up_to: Vec<UpTo>,
    /// Those that are judged.
    pub times: Judged,
    /// Of which times errors are taken, where a result has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors_of: Option<&'static str>,
    /// The worst of the pairs that are judged and of the orders.
    pub verdict: Verdict,
    /// Every two codes on every level where both have results, at every time.
    pub pairs: Vec<OfPair>,
    /// On several levels, where the solution is known or the codes share the problem only.
    pub orders: Vec<OfOrder>,
    /// On three levels or more, where codes share the problem only and no order is asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub meetings: Vec<OfMeeting>,
}

/// Two codes on one level, at one time.
#[derive(Debug, Serialize)]
pub struct OfPair {
    /// The first code.
    pub a: String,
    /// The second.
    pub b: String,
    /// The refinement.
    pub n: Option<usize>,
    /// As in the runs.
    pub level: Label,
    /// Where results have times.
    pub t: Option<f64>,
    /// Coarser levels of one problem are reported and not judged.
    pub judged: bool,
    /// The field of the one less that of the other.
    #[serde(flatten)]
    pub compared: ComparedField,
}

/// Observed orders, of one code's error or of two codes' difference.
#[derive(Debug, Serialize)]
pub struct OfOrder {
    /// The code, or both: `freefem – dolfinx`.
    pub of: String,
    /// The refinements, coarsest first.
    pub n: Vec<Option<usize>>,
    /// In what the order is: `h`, a parameter, or `1/n`.
    pub axis: String,
    /// In L² and H¹, as far as the file states them.
    pub theory: [Option<f64>; 2],
    /// The worse of both; none where theory is not asked.
    pub verdict: Option<Verdict>,
    /// Of each norm.
    pub verdicts: [Option<Verdict>; 2],
    /// What is left in the limit, in L² and H¹, where theory is asked.
    pub limits: [Option<Limit>; 2],
    /// What was observed.
    #[serde(flatten)]
    pub found: Convergence,
}

/// A number of all codes.
#[derive(Debug, Serialize)]
pub struct OfNumber {
    /// Its name.
    pub number: String,
    /// The worst of its rows.
    pub verdict: Verdict,
    /// Where the file states it.
    pub exact: Option<f64>,
    /// One a level.
    pub rows: Vec<RowOfNumber>,
    /// As of fields.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub meetings: Vec<OfMeeting>,
    /// Where codes share the problem only: what the number of each converges to, by code.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub extrapolated: BTreeMap<String, Extrapolated>,
}

/// A number on one level.
#[derive(Debug, Serialize)]
pub struct RowOfNumber {
    /// The refinement.
    pub n: Option<usize>,
    /// As in the runs.
    pub level: Label,
    /// By code.
    pub values: BTreeMap<String, f64>,
    /// Coarser levels of one problem are reported and not judged.
    pub judged: bool,
    /// Of this level; undetermined where it is not judged.
    pub verdict: Verdict,
    /// What is wrong, or why there is no verdict; else empty.
    pub reason: String,
}

/// One that answers: a code as it is, or what it answered when it was recorded.
struct Player<'a> {
    name: String,
    code: &'a Code,
    record: Option<&'a Record>,
}

/// What the codes left on one level; none of those that failed.
struct Rung {
    level: Level,
    /// As commands got them.
    parameters: BTreeMap<String, String>,
    left: Vec<Option<Left>>,
}

/// Runs every code on every level and judges what they answer. A code that fails does not keep the others from being judged.
///
/// # Errors
/// A name that is of no code; a mesh that cannot be made; kept runs of something else; [`Error::Ended`].
pub fn face_off(of: &FaceOff, how: &Running, progress: &dyn Progress) -> Result<FaceOffOutcome> {
    let players = players(of, how)?;
    let levels = of.levels();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut runs = Vec::new();
    let mut rungs = Vec::with_capacity(levels.len());
    let all = levels.len() * players.len();
    for level in levels {
        let mesh = of.mesh(level.n)?;
        let problem = of.problem(&level, mesh.as_ref());
        let parameters = level.parameters(&of.parameters);
        let task = Task {
            mesh: mesh.as_ref(),
            n: level.n,
            parameters: &parameters,
        };
        let done = runs.len();
        let found = at_once::at_once(&players, cores, |k, player| {
            let label = player.name.clone() + &level.label.at();
            progress.next(&label, (done + k) as f64 / all as f64);
            let mut found = match player.record {
                Some(record) => record.left(player.code, &level, &problem),
                None => answer(of, player.code, &task, (&level, &problem), how)?,
            };
            if let Err(Error::Ended(cause)) = found {
                return Err(Error::Ended(cause));
            }
            if let Ok(left) = &mut found {
                if let Some(mesh) = mesh.as_ref().filter(|_| player.code.takes_mesh()) {
                    left.lay_on(mesh)?;
                }
                of.integrate(player.code, mesh.as_ref(), &parameters, left);
            }
            Ok(found)
        })?;
        let mut left = Vec::with_capacity(players.len());
        for (player, found) in players.iter().zip(found) {
            let seconds = found.as_ref().ok().map(|left| left.seconds);
            runs.push(RunOf {
                code: player.name.clone(),
                n: level.n,
                level: level.label.clone(),
                seconds: seconds.filter(|_| player.record.is_none()),
                failure: found.as_ref().err().map(Error::to_string),
                problem: problem.clone(),
                of: level.clone(),
            });
            left.push(found.ok());
        }
        rungs.push(Rung {
            level,
            parameters,
            left,
        });
    }
    let mut shown = None;
    // A single code is judged only by what is known; numbers that may be anything are reported.
    let is_judged = |asked: &&Asked| {
        let is_known = match asked.is_number {
            true => asked.exact_rtol.is_some() || asked.rtol >= 1.0,
            false => !asked.exact.is_empty(),
        };
        players.len() > 1 || is_known
    };
    let judge = |asked| fields::judge(&players, asked, &rungs, &mut shown);
    let fields = of.fields.iter().filter(is_judged).map(judge);
    let mut fields = fields.collect::<Result<Vec<_>>>()?;
    limiting::explain(of, how, &players, &rungs, &mut fields, progress)?;
    let numbers = of.numbers.iter().filter(is_judged);
    let numbers: Vec<OfNumber> = numbers
        .map(|asked| numbers::judge(&players, asked, &rungs))
        .collect();
    let spectra = of.spectra.iter();
    let spectra = spectra.map(|asked| spectra::judge(of, &players, asked, &rungs));
    let spectra = spectra.collect::<Result<Vec<_>>>()?;
    let diagnosis = match how.diagnose {
        true => Some(diagnosis::diagnose(
            of, how, &players, &rungs, &fields, &numbers, progress,
        )?),
        false => None,
    };
    let symmetries = match how.symmetries.is_empty() {
        false => Some(symmetries::judge(
            of,
            how,
            &players,
            &rungs,
            (&fields, &numbers),
            progress,
        )?),
        true => None,
    };
    let verdicts = fields
        .iter()
        .map(|f| f.verdict)
        .chain(symmetries.iter().map(|of| of.verdict))
        .chain(numbers.iter().map(|n| n.verdict))
        .chain(spectra.iter().map(|of| of.verdict));
    let failed = runs.iter().any(|run| run.failure.is_some());
    let systems = systems::judge(of, &players, &rungs)?;
    let verdicts = verdicts.chain(systems.iter().map(|of| of.verdict));
    let verdicts = verdicts.chain(failed.then_some(Verdict::Undetermined));
    Ok(FaceOffOutcome {
        name: of.name.clone(),
        about: of.about.clone(),
        verdict: Verdict::of_all(verdicts),
        runs,
        at_once: at_once::most(&players, cores),
        missing: Vec::new(),
        in_form: in_form::judge(of, &players, &rungs, (&fields, &spectra))?,
        fields,
        numbers,
        spectra,
        systems,
        diagnosis,
        symmetries,
        sweep: None,
        shown: shown.map(|shown: fields::Shown| (shown.comparison, shown.of_a)),
    })
}

/// The codes that are asked for, then those of a record.
fn players<'a>(of: &'a FaceOff, how: &Running<'a>) -> Result<Vec<Player<'a>>> {
    let code = |name: &str| of.codes.iter().find(|code| code.name() == name);
    let known = || {
        let names: Vec<&str> = of.codes.iter().map(Code::name).collect();
        format!("{} has {}", of.name, names.join(", "))
    };
    for name in &how.codes {
        if code(name).is_none() {
            return Err(Error::usage(format!("there is no code `{name}`"), known()));
        }
    }
    let is_asked =
        |code: &&Code| how.codes.is_empty() || how.codes.iter().any(|n| n == code.name());
    let live = of.codes.iter().filter(is_asked).map(|code| Player {
        name: code.name().to_owned(),
        code,
        record: None,
    });
    let mut players: Vec<Player> = live.collect();
    if let Some(record) = how.against {
        for name in record.players() {
            let code = code(name).ok_or_else(|| {
                let what = format!("{name} was recorded, and is no code of this face-off");
                Error::usage(what, format!("{}: record it again", known()))
            })?;
            players.push(Player {
                name: format!("{name} (recorded)"),
                code,
                record: Some(record),
            });
        }
    }
    if players.len() < 2 && !(how.alone && players.len() == 1) {
        let what = match players.first() {
            Some(player) => format!("{} alone shows nothing", player.name),
            None => format!("no code of {} is here", of.name),
        };
        return Err(Error::usage(
            what,
            "name two codes, or judge against a record",
        ));
    }
    Ok(players)
}

/// What a code answers, or why it does not: from the store, or by running it.
fn answer(
    of: &FaceOff,
    code: &Code,
    task: &Task,
    (level, problem): (&Level, &Value),
    how: &Running,
) -> Result<Result<Left>> {
    let run = |into| code.run(task, &run_how(of, code, level, "", how, into));
    let Some(store) = how.store else {
        return Ok(run(None));
    };
    store.once(code, level, problem, |place| run(Some(place)))
}

/// How one run is done, in a folder of its own.
fn run_how(
    of: &FaceOff,
    code: &Code,
    level: &Level,
    change: &str,
    how: &Running,
    into: Option<PathBuf>,
) -> How {
    let level = level.suffix();
    How {
        into,
        threads: None,
        keep: how.keep.clone(),
        kept: format!("{}-{}{level}{change}", of.name, code.name()),
        time_limit: how.time_limit,
        sandbox: how.sandbox,
    }
}

/// Each pair of those that answer, but for two that were recorded, by their numbers.
fn pairs(players: &[Player]) -> Vec<(usize, usize)> {
    let is_live = |&(a, b): &(usize, usize)| [a, b].iter().any(|k| players[*k].record.is_none());
    engine::pairs(players.len()).filter(is_live).collect()
}
