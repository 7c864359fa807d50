//! One problem in every code: which of them is wrong, as far as the residual, or an image of the problem, shows.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::campaigns::face_off::{FaceOffOutcome, Running, face_off};
use crate::engine::{OWN, Silent};
use crate::run::{Code, FaceOff};
use crate::text::number::size;
use faceoff_form::Problem;
use faceoff_form::image::Image;
use faceoff_form::random::{Drawn, PATCH, Rewritten};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// Integrals of a solution may move by this under a symmetry, relative to themselves and to 1: more than rounding does in problems of some
/// hundred cells whose condition is no worse than that of these forms.
const MOVES: f64 = 1e-7;
/// How scripts and our solver say that there is no solution that can be found.
const LOST: &str = "did not converge";

/// What a code does that is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Its answer does not solve the form.
    Wrong,
    /// Its answer is not one of finite numbers.
    NotFinite,
    /// Its answer does not move with the problem.
    Moves,
    /// Its process fails.
    Crashes,
    /// It does not end.
    Hangs,
    /// It finds no solution where other codes do.
    Fails,
}

impl Kind {
    /// As a verb.
    pub fn words(self) -> &'static str {
        match self {
            Kind::Wrong => "is wrong",
            Kind::NotFinite => "is not finite",
            Kind::Moves => "does not move with the problem",
            Kind::Crashes => "crashes",
            Kind::Hangs => "hangs",
            Kind::Fails => "finds no solution",
        }
    }
}

/// A code that is wrong.
#[derive(Debug, Clone)]
pub struct Suspect {
    /// Its name.
    pub code: String,
    /// What it does.
    pub kind: Kind,
    /// The change of the form that explains its answer, or how it fails; none where nothing does.
    pub cause: Option<String>,
    /// As a sentence without a full stop.
    pub words: String,
}

/// What came of a problem.
pub enum Trial {
    /// All that answer agree.
    Agree,
    /// They differ by no more than rounding moves them.
    Conditioned,
    /// Fewer than two answers, or nothing that can be judged.
    Refused,
    /// Some codes are wrong.
    Wrong(Vec<Suspect>),
}

/// A problem in these codes; none where fewer than two have it.
fn solved(
    drawn: &Drawn,
    engines: &[String],
    patience: Duration,
    images: &[Image],
) -> Result<Option<(FaceOffOutcome, f64)>> {
    // A single code is judged by what its answers do under symmetries.
    let mut names = engines.to_vec();
    if names.len() == 1 {
        let other = if names[0] == OWN { "freefem" } else { OWN };
        names.push(other.to_owned());
    }
    let mut text = drawn.text("hunt");
    let _ = writeln!(text, "[codes]\nuse = {names:?}");
    for (name, value) in drawn.invariants() {
        // They are reported, not judged.
        let _ = writeln!(text, "[numbers.{name}]\nvalue = \"{value}\"\nrtol = 1e99");
    }
    let mut of = FaceOff::on(&text, drawn.shape.mesh()?)?;
    of.without_missing(false);
    of.codes
        .retain(|code: &Code| engines.iter().any(|name| name == code.name()));
    if of.codes.len() < 2 && of.codes.len() < engines.len() {
        return Ok(None);
    }
    let how = Running {
        codes: Vec::new(),
        keep: None,
        time_limit: patience,
        sandbox: false,
        store: None,
        against: None,
        diagnose: false,
        symmetries: images.to_vec(),
        alone: engines.len() == 1,
    };
    let begun = Instant::now();
    let outcome = face_off(&of, &how, &Silent)?;
    Ok(Some((outcome, begun.elapsed().as_secs_f64())))
}

/// What is wrong with the answers to a problem, and their integrals.
///
/// # Errors
/// A form that cannot be read; an interruption.
pub fn trial(drawn: &Drawn, engines: &[String], patience: Duration) -> Result<(Trial, Integrals)> {
    let Some((outcome, seconds)) = solved(drawn, engines, patience, &[])? else {
        return Ok((Trial::Refused, Integrals::new()));
    };
    let integrals = integrals(&outcome);
    let found = match judged(&outcome, seconds, patience) {
        Trial::Wrong(suspects) => Trial::Wrong(suspects),
        found => match off(&integrals) {
            None => found,
            // A nonlinear form may have further solutions, which are what codes find that agree and leave no residual.
            Some(all)
                if matches!(found, Trial::Agree)
                    && all.len() == integrals.len()
                    && all.len() > 1
                    && !is_linear(drawn)? =>
            {
                Trial::Conditioned
            }
            Some(suspects) => Trial::Wrong(suspects),
        },
    };
    Ok((found, integrals))
}

fn is_linear(drawn: &Drawn) -> Result<bool> {
    let mesh = drawn.shape.mesh()?;
    Ok(Problem::parse(Path::new("hunt"), &drawn.text("hunt"), &mesh)?.is_linear())
}

/// The codes whose answers are not the polynomial that solves the form, where one does.
fn off(integrals: &Integrals) -> Option<Vec<Suspect>> {
    let errors = integrals.iter().filter_map(|(code, values)| {
        let (_, square) = values.iter().find(|(name, _)| name == PATCH)?;
        Some((code, square.sqrt()))
    });
    // Negated so that NaN is wrong.
    let wrong = errors.filter(|(_, error)| !(*error <= MOVES));
    let suspects: Vec<Suspect> = wrong
        .map(|(code, error)| Suspect {
            code: code.clone(),
            kind: Kind::Wrong,
            cause: None,
            words: format!(
                "a polynomial of its space solves the form, and its answer is {} away from it",
                size(error)
            ),
        })
        .collect();
    (!suspects.is_empty()).then_some(suspects)
}

fn judged(outcome: &FaceOffOutcome, seconds: f64, patience: Duration) -> Trial {
    let mut suspects = Vec::new();
    let failures: Vec<(&str, &str)> = outcome
        .runs
        .iter()
        .filter_map(|run| Some((&*run.code, run.failure.as_deref()?)))
        .collect();
    let is_lost = |failure: &str| failure.contains(LOST);
    let has_solution = outcome.runs.iter().any(|run| run.failure.is_none());
    let lost_by_own = failures
        .iter()
        .any(|(code, failure)| *code == OWN && is_lost(failure));
    for (code, failure) in &failures {
        let kind = match failure {
            failure if is_lost(failure) => Kind::Fails,
            failure if failure.contains("did not end within") => Kind::Hangs,
            failure if failure.contains("finite") => Kind::NotFinite,
            _ => Kind::Crashes,
        };
        let is_one = match kind {
            // Newton's method may end nowhere: then no answer says anything.
            Kind::Fails => has_solution && !lost_by_own,
            // Near the end of the hunt programs get less time than that.
            Kind::Hangs => seconds >= patience.as_secs_f64(),
            _ => true,
        };
        if is_one {
            suspects.push(Suspect {
                code: (*code).to_owned(),
                kind,
                cause: Some(plain(failure)),
                words: shortened(failure),
            });
        }
    }
    for of in &outcome.in_form {
        if let Some(found) = of.wrong() {
            let causes: Vec<String> = found
                .explanations
                .iter()
                .map(|c| c.kind().to_owned())
                .collect();
            suspects.push(Suspect {
                code: of.code.clone(),
                kind: Kind::Wrong,
                cause: (!causes.is_empty()).then(|| causes.join(" and ")),
                words: found.sentence.told(),
            });
        } else if let Some(refused) = &of.refused {
            // An answer that is not a function of the space is wrong, whatever it is.
            let kind = match refused.contains("finite") {
                true => Kind::NotFinite,
                false => Kind::Wrong,
            };
            suspects.push(Suspect {
                code: of.code.clone(),
                kind,
                cause: Some(plain(refused)),
                words: shortened(refused),
            });
        }
    }
    let answers = outcome.runs.len() - failures.len();
    let fields = Verdict::of_all(outcome.fields.iter().map(|field| field.verdict));
    match suspects.is_empty() {
        false => Trial::Wrong(suspects),
        // A single code is judged by the images of the problem.
        true if outcome.runs.len() == 1 => Trial::Agree,
        true if answers < 2 => Trial::Refused,
        true if fields.passes() => Trial::Agree,
        true if fields == Verdict::Undetermined => Trial::Refused,
        true => Trial::Conditioned,
    }
}

/// How a program failed, without the numbers and places of one run.
pub(super) fn plain(failure: &str) -> String {
    let words = failure
        .split_whitespace()
        .filter(|word| !word.contains('/'));
    let words = words.flat_map(|word| word.split(|c: char| !c.is_alphabetic()));
    let words: Vec<&str> = words.filter(|word| word.len() > 2).take(14).collect();
    words.join(" ")
}

fn shortened(words: &str) -> String {
    const MOST: usize = 300;
    let line: String = words.split_whitespace().collect::<Vec<_>>().join(" ");
    match line.char_indices().nth(MOST) {
        Some((at, _)) => format!("{}…", &line[..at]),
        None => line,
    }
}

/// The integrals of each code's answer, by name.
pub type Integrals = BTreeMap<String, Vec<(String, f64)>>;

fn integrals(outcome: &FaceOffOutcome) -> Integrals {
    let mut all = Integrals::new();
    for number in &outcome.numbers {
        for (code, value) in number.rows.iter().flat_map(|row| &row.values) {
            let of = all.entry(code.clone()).or_default();
            of.push((number.number.clone(), *value));
        }
    }
    all
}

/// What is wrong with the answers to a problem, or with those to an image of it.
///
/// # Errors
/// As [`trial`].
pub fn symmetric(
    drawn: &Drawn,
    image: Image,
    engines: &[String],
    patience: Duration,
) -> Result<Trial> {
    let Some((outcome, seconds)) = solved(drawn, engines, patience, &[image])? else {
        return Ok(Trial::Refused);
    };
    let found = judged(&outcome, seconds, patience);
    if !matches!(found, Trial::Agree) {
        return Ok(found);
    }
    // Integrals may be 0 but for rounding.
    let integrals = drawn.invariants();
    let is_field = |of: &str| !integrals.iter().any(|(name, _)| *name == of);
    let rows = outcome.symmetries.iter().flat_map(|of| &of.rows);
    let rows = rows.filter(|row| is_field(&row.of));
    let mut suspects: Vec<Suspect> = Vec::new();
    let mut kept = 0;
    for row in rows {
        let (kind, words) = match (row.relative, &row.reason) {
            (Some(far), _) if far <= MOVES => {
                kept += 1;
                continue;
            }
            (None, Some(reason)) if reason.contains(LOST) => continue,
            (None, Some(reason)) => (Kind::Crashes, shortened(reason)),
            (far, _) => {
                let far = size(far.unwrap_or(f64::NAN));
                let (of, words) = (&row.of, image.words());
                (
                    Kind::Moves,
                    format!("`{of}` changes by {far} of it with {words}"),
                )
            }
        };
        if suspects.iter().all(|of| of.code != row.code) {
            let cause = (kind == Kind::Crashes).then(|| plain(&words));
            suspects.push(Suspect {
                code: row.code.clone(),
                kind,
                cause,
                words,
            });
        }
    }
    // A problem that all of them see move is ill-conditioned.
    let all = outcome.runs.len();
    Ok(match suspects.len() {
        0 if kept == 0 => Trial::Refused,
        0 => Trial::Agree,
        some if some == all && all > 1 && suspects.iter().all(|of| of.kind == Kind::Moves) => {
            Trial::Conditioned
        }
        _ => Trial::Wrong(suspects),
    })
}

/// What is wrong with the answers to a problem written in another way: as for any problem, or compared with the answers to the problem itself, whose integrals may
/// be known.
///
/// # Errors
/// As [`trial`].
pub fn rewritten(
    (drawn, before): (&Drawn, Option<&Integrals>),
    how: Rewritten,
    engines: &[String],
    patience: Duration,
) -> Result<(Trial, Integrals)> {
    let (found, after) = trial(&drawn.rewritten(how), engines, patience)?;
    if !matches!(found, Trial::Agree) {
        return Ok((found, after));
    }
    let before = match before {
        Some(before) => before.clone(),
        None => trial(drawn, engines, patience)?.1,
    };
    let mut suspects = Vec::new();
    for (code, values) in &after {
        let Some(own) = before.get(code) else {
            continue;
        };
        for (name, y) in values {
            let Some((_, x)) = own.iter().find(|(known, _)| known == name) else {
                continue;
            };
            let far = (x - y).abs() / x.abs().max(y.abs()).max(1.0);
            // Negated so that NaN moves.
            if !(far <= MOVES) {
                suspects.push(Suspect {
                    code: code.clone(),
                    kind: Kind::Moves,
                    cause: None,
                    words: format!(
                        "`{name}` of its answer moves by {} where {}",
                        size(far),
                        how.words()
                    ),
                });
                break;
            }
        }
    }
    // A problem that all of them see move is ill-conditioned.
    let found = match suspects.len() {
        0 => Trial::Agree,
        all if all == after.len() && all > 1 => Trial::Conditioned,
        _ => Trial::Wrong(suspects),
    };
    Ok((found, before))
}
