//! Releases of codes × scenes × methods: compares each release with the built-in solver, by means of `verify`.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::verify::{VerifyOutcome, VerifyRequest, verify};
use crate::engine::{self, Engine, EngineFile, OWN, Progress, Settings};
use crate::text::Text;
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result, distinct};

/// The releases and the cases to run.
pub struct MatrixRequest {
    /// Lines of the matrix, each with every method.
    pub scenes: Vec<Scene>,
    /// The methods for each scene.
    pub methods: Vec<Method>,
    /// Refinements; empty: those of each scene.
    pub n: Vec<usize>,
    /// Columns of the matrix.
    pub releases: Vec<EngineFile>,
    /// The file that contains them; paths in it refer to its folder.
    pub path: PathBuf,
}

/// The result of a run.
#[derive(Serialize)]
pub struct MatrixOutcome {
    /// The worst of all cells; refusals do not count.
    pub verdict: Verdict,
    /// In the order of the request.
    pub releases: Vec<Release>,
    /// Every release on every line.
    pub cells: Vec<Entry>,
    /// The result of `verify` for each scene and method.
    #[serde(skip)]
    pub cases: Vec<(Place, VerifyOutcome)>,
}

/// A release of a code, on some system.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Release {
    /// The name in the file of releases.
    pub name: String,
    /// `None` if it is not installed.
    pub version: Option<String>,
}

/// A line of the matrix.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// The name of the scene.
    pub scene: String,
    /// The name of the method.
    pub method: String,
}

/// A release on one scene, by one method.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Entry {
    /// The index of the line.
    #[serde(flatten)]
    pub place: Place,
    /// The name of the column.
    pub release: String,
    /// The classification of the result.
    pub became: Became,
    /// The largest difference of any field from the built-in solver's, relative to the field.
    pub difference: Option<f64>,
    /// Why there is no answer, or the fault in it.
    pub why: Option<Text>,
}

/// The classification of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Became {
    /// All fields are within their tolerance of the built-in solver's.
    Agrees,
    /// A field exceeds its tolerance.
    Differs,
    /// It does not have the method, and reports that.
    Refused,
    /// It is installed, and gives no valid answer.
    Failed,
    /// It is not installed.
    Absent,
}

impl Became {
    /// A refusal with a message is neither a pass nor a failure.
    pub fn verdict(self) -> Option<Verdict> {
        match self {
            Became::Agrees => Some(Verdict::Agree),
            Became::Differs => Some(Verdict::Disagree),
            Became::Refused => None,
            Became::Failed | Became::Absent => Some(Verdict::Undetermined),
        }
    }
}

/// The verdict on some entries together: undetermined if nothing was compared.
pub fn verdict<'a>(entries: impl IntoIterator<Item = &'a Entry>) -> Verdict {
    Verdict::of_all(entries.into_iter().filter_map(|e| e.became.verdict()))
}

/// Runs every release on every scene by every method.
///
/// # Errors
/// Two releases of one name, an invalid description of a code, scenes that are not valid; an interruption. A release that fails is
/// not an error.
pub fn matrix(request: &MatrixRequest, progress: &dyn Progress) -> Result<MatrixOutcome> {
    let engines = request.releases.iter();
    let engines = engines.map(|of| engine::release(of.clone(), &request.path));
    let engines = engines.collect::<Result<Vec<_>>>()?;
    let names = engines.iter().map(|engine| engine.name());
    distinct(names, "release", "give each a name of its own")?;
    let probed: Vec<Result<String>> = engines.iter().map(|engine| engine.probe()).collect();
    let own = engine::find(OWN)?;
    let (mut cells, mut cases) = (Vec::new(), Vec::new());
    let all = request.scenes.len() * request.methods.len();
    for scene in &request.scenes {
        for method in &request.methods {
            let place = Place {
                scene: scene.name().to_owned(),
                method: method.to_string(),
            };
            let share = cases.len() as f64 / all as f64;
            progress.next(&format!("{}, {}", place.scene, place.method), share);
            let refusal =
                |of: &dyn Engine, probed: &Result<String>| match (probed, of.accepts(method)) {
                    (Err(why), _) => Some((Became::Absent, Text::message(&why.to_string()))),
                    (_, Err(why)) => Some((Became::Refused, Text::message(&why.to_string()))),
                    _ => None,
                };
            let refusals = engines.iter().zip(&probed);
            let refusals: Vec<_> = refusals
                .map(|(of, probed)| refusal(&**of, probed))
                .collect();
            let runs = engines
                .iter()
                .zip(&refusals)
                .filter(|(_, refusal)| refusal.is_none());
            let runs: Vec<&dyn Engine> = runs.map(|(of, _)| &**of).collect();
            let outcome = (!runs.is_empty()).then(|| {
                let request = VerifyRequest {
                    scenes: vec![scene.clone()],
                    methods: vec![*method],
                    n: request.n.clone(),
                    engines: [&[&*own], &runs[..]].concat(),
                    settings: Settings::default(),
                    journal: None,
                };
                verify(&request, progress)
            });
            let outcome = outcome.transpose()?;
            for (of, refusal) in engines.iter().zip(refusals) {
                let (became, difference, why) = match (refusal, &outcome) {
                    (Some((became, why)), _) => (became, None, Some(why)),
                    (None, Some(outcome)) => judged(outcome, of.name()),
                    (None, None) => (Became::Failed, None, None),
                };
                cells.push(Entry {
                    place: place.clone(),
                    release: of.name().to_owned(),
                    became,
                    difference,
                    why,
                });
            }
            cases.extend(outcome.map(|outcome| (place, outcome)));
        }
    }
    Ok(MatrixOutcome {
        verdict: verdict(&cells),
        releases: engines
            .iter()
            .zip(probed)
            .map(|(of, version)| Release {
                name: of.name().to_owned(),
                version: version.ok(),
            })
            .collect(),
        cells,
        cases,
    })
}

/// Compares the answers of a release with those of the built-in solver.
fn judged(outcome: &VerifyOutcome, release: &str) -> (Became, Option<f64>, Option<Text>) {
    let answers = outcome.answers();
    let answers: Vec<_> = answers.filter(|of| of.engine == release).collect();
    let pairs = outcome.pairs();
    let pairs: Vec<_> = pairs.filter(|p| p.a == OWN && p.b == release).collect();
    let is_whole = outcome.cases.iter().all(|case| {
        let is = |name: &str| case.engines.iter().any(|of| of.engine == name);
        is(OWN) && is(release)
    });
    let failure = |name: &str| outcome.failures.iter().find(|of| of.engine == name);
    if !is_whole {
        let why = failure(release).or(failure(OWN));
        return (
            Became::Failed,
            None,
            why.map(|of| Text::message(&of.message)),
        );
    }
    let of_pairs = pairs.iter().map(|pair| pair.field.verdict);
    let of_answers = answers.iter().map(|answer| answer.verdict);
    let (became, words) = match of_pairs.chain(of_answers).max() {
        Some(Verdict::Agree | Verdict::Conditioned) => (Became::Agrees, None),
        Some(Verdict::Several) => (Became::Differs, Some("both solve the scheme".into())),
        Some(Verdict::Disagree) => (Became::Differs, None),
        Some(Verdict::Undetermined) | None => (Became::Failed, Some("it did not converge".into())),
    };
    let found = answers.iter().find_map(|answer| answer.findings.as_ref());
    let largest = pairs.iter().map(|pair| pair.field.max_rel);
    (
        became,
        largest.fold(None, |most: Option<f64>, value| {
            Some(most.map_or(value, |most| most.max(value)))
        }),
        found.map(|found| found.sentence()).or(words),
    )
}

/// Rejects a request that has nothing to run.
///
/// # Errors
/// A file without scenes or releases.
pub fn check(request: &MatrixRequest) -> Result<()> {
    let lacks = |what: &str| {
        let what = format!("{} names no {what}", request.path.display());
        Err(Error::usage(what, "give `scenes` and `[[releases]]`"))
    };
    match (request.scenes.is_empty(), request.releases.is_empty()) {
        (true, _) => lacks("scene"),
        (_, true) => lacks("release"),
        _ => Ok(()),
    }
}
