//! The report of `verify`.

mod story;

use serde::Serialize;

use super::described::{sizes, versions, why};
use super::html::{Run, Spread, fields, tolerances};
use super::model::{Block, Cell, Report, Story, Suite, Table, TestCase, short, table, word};
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, Source, VerifyOutcome, telling};
use crate::engine::{Explanation, label, unique};
use crate::run::{Failure, RESIDUAL_TOLERANCE};
use crate::text::number::{number, place, whole};
use crate::text::{Text, text};
use crate::why::Diagnosis;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// An outcome with its supplements.
pub struct Verified<'a> {
    /// The outcome.
    pub outcome: &'a VerifyOutcome,
    /// Why codes differ, if they were run again.
    pub diagnoses: &'a [Diagnosis],
    /// Requested engines that were left out.
    pub missing: &'a [Failure],
    /// Prints for each case how it was solved.
    pub explain: bool,
    /// Shows every field of every pair of every case.
    pub verbose: bool,
}

/// The outcome for JSON.
#[derive(Serialize)]
struct Found<'a> {
    /// The verdict, with the code at fault, its fault and the place.
    sentence: &'a Text,
    #[serde(flatten)]
    outcome: &'a VerifyOutcome,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    diagnoses: &'a [Diagnosis],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    explanations: &'a [Explained<'a>],
}

/// How a case was solved.
#[derive(Serialize)]
struct Explained<'a> {
    scene: &'a str,
    method: &'a str,
    n: Option<usize>,
    #[serde(flatten)]
    explanation: Explanation,
}

/// The report of a run.
///
/// # Errors
/// Only those of a broken installation.
pub fn verify(verified: Verified) -> Result<Report> {
    let Verified {
        outcome,
        diagnoses,
        missing,
        explain,
        verbose,
    } = verified;
    let told = story::told(outcome, diagnoses, missing);
    let said = [Text::from(word(outcome.verdict)), told.sentence];
    let sentence = Text::joined(said.into_iter().filter(|words| !words.is_empty()), ": ");
    let found = Found {
        sentence: &sentence,
        outcome,
        diagnoses,
        explanations: &if explain {
            explained(outcome)
        } else {
            Vec::new()
        },
    };
    let question = "faceoff: do the codes agree, face by face?";
    let mut report = Report::judging("verify", question, outcome.verdict, &found)?;
    let run = Run { outcome, diagnoses };
    let agrees = outcome.verdict.passes();
    let picture = move || match agrees {
        true => run.agreeing(),
        false => run.hero(),
    };
    let terminal = of_terminal(&found, verbose);
    report.headline = sentence;
    let because = match agrees {
        true => [spread(outcome)?, told.because],
        false => [Text::default(), told.because],
    };
    let mut page = Vec::new();
    if !agrees {
        page.push(Block::Drawn(Box::new(move || run.details())));
    }
    let mut rest = Vec::new();
    if !outcome.cross.is_empty() {
        rest.push(methods(outcome).into());
    }
    rest.push(Block::drawn(move || run.rest()));
    page.push(Block::folded(
        "Every pair and field",
        "what was compared, and how each case is posed",
        rest,
    ));
    report.story = Story {
        claim: told.claim,
        rests_on: Text::joined(because.into_iter().filter(|w| !w.is_empty()), " "),
        picture: vec![Block::Drawn(Box::new(picture))],
        next: told.next,
        rest: vec![Block::Terminal(terminal), Block::Page(page)],
    };
    report.notes = notes(outcome);
    report.suites = suites(outcome, missing);
    for case in &outcome.cases {
        let name = format!("the mesh of {}", case.label());
        report.digests.push((name, case.mesh_digest.clone()));
    }
    let engines = outcome.answers();
    report.engines = unique(engines.map(|e| (e.engine.clone(), e.version.clone())));
    report
        .files
        .push(Box::new(move |folder| super::write_fields(folder, outcome)));
    Ok(report)
}

/// The case that shows the fault, or all of them, on a terminal.
fn of_terminal<'a>(found: &Found, verbose: bool) -> Vec<Block<'a>> {
    let outcome = found.outcome;
    let mut told = Vec::new();
    if !verbose {
        told.push(overview(outcome).into());
    }
    let shown = outcome.culprit();
    for case in &outcome.cases {
        let is_shown = shown.is_some_and(|(of, _)| std::ptr::eq(of, case));
        if verbose || is_shown {
            told.push(Block::text(format!("{}: {}", case.label(), sizes(case))));
            told.extend([engines(case).into(), fields(case).into()]);
        }
    }
    let judged = outcome.cross.iter().filter_map(|c| Some(c.judged?.verdict));
    if !outcome.cross.is_empty() && (verbose || judged.max() != Some(Verdict::Agree)) {
        told.push(methods(outcome).into());
    }
    let failures = outcome.failures.iter();
    told.extend(failures.map(|f| Block::text(format!("no answer from {}", f.engine))));
    for e in found.explanations {
        told.push(Block::text(format!("{}:", label(e.scene, e.method, e.n))));
        let lines = e.explanation.lines().into_iter();
        told.extend(lines.map(|line| Block::text(text!("  {line}"))));
    }
    told.extend(found.diagnoses.iter().map(|d| {
        let about = label(&d.scene, &d.method, d.n);
        Block::text(text!("{about}: {d.a} – {d.b}: {}", d.sentence()))
    }));
    told
}

/// The quality of the agreement.
fn spread(outcome: &VerifyOutcome) -> Result<Text> {
    let points = outcome.cases.iter().filter_map(|case| {
        let status = case.fields.first()?.column("status")?;
        Some(status.values.len())
    });
    let points: usize = points.sum();
    let flips = outcome.pairs().filter_map(|p| p.field.rounding_flips);
    let contact = match (points, flips.max().unwrap_or(0)) {
        (0, _) => Text::default(),
        (points, 0) => text!("Contact is the same at all **{} points**.", whole(points)),
        (_, flips) => text!(
            "Contact differs at up to {} points, all of them at rounding level.",
            whole(flips)
        ),
    };
    let words = [Spread::new(outcome)?.words(), contact];
    Ok(Text::joined(
        words.into_iter().filter(|w| !w.is_empty()),
        " ",
    ))
}

/// The methods, and the meaning of the numbers.
fn notes(outcome: &VerifyOutcome) -> Vec<Text> {
    let gamma = outcome.cases.first();
    let gamma = gamma.map(|case| format!(" γ = {} h.", case.setup.discretisation.gamma0));
    vec![text!(
        "Schemes: Burman, Hansbo, Larson 2017, (3.2) and (2.4);{gamma} Residual: the largest row over the sum of the sizes of its terms; \
         tolerance {}. Difference: |a − b| relative to max |u| and to how much the field changes with the unknowns; tolerances {}.",
        number(RESIDUAL_TOLERANCE, 2),
        tolerances(outcome)
    )]
}

/// For every case that the Rust engine solved. A certificate covers all fields on a mesh, if methods are judged by it.
fn explained<'a>(outcome: &'a VerifyOutcome) -> Vec<Explained<'a>> {
    let of = |case: &'a CaseOutcome| {
        let mut explanation = case.explanation.clone()?;
        explanation.certificate = outcome.cross.iter().any(|cross| {
            let is_its = cross.a.method == case.method || cross.b.method == case.method;
            cross.judged.is_some() && is_its && (&cross.scene, cross.n) == (&case.scene, case.n)
        });
        Some(Explained {
            scene: &case.scene,
            method: &case.method,
            n: case.n,
            explanation,
        })
    };
    outcome.cases.iter().filter_map(of).collect()
}

/// The largest, 0 if there is none; NaN is larger than any number.
fn most(numbers: impl Iterator<Item = f64>) -> f64 {
    let sizes = numbers.map(f64::abs);
    sizes.max_by(f64::total_cmp).unwrap_or(0.0)
}

/// The number of cases that fit into a dozen lines.
const CASES: usize = 8;

/// One line per case, those farthest from agreement first if they are too many.
fn overview(outcome: &VerifyOutcome) -> Table {
    let largest = |case: &CaseOutcome| most(case.pairs.iter().map(|p| p.field.max_rel));
    let excess = |case: &CaseOutcome| {
        let of = case.pairs.iter();
        most(of.map(|p| p.field.max_rel / p.field.tolerance))
    };
    let residual = |case: &CaseOutcome| most(case.engines.iter().map(|e| e.residual));
    let mut cases: Vec<&CaseOutcome> = outcome.cases.iter().collect();
    let more = cases.len().saturating_sub(CASES);
    if more > 0 {
        cases.sort_by(|a, b| {
            let by_verdict = b.verdict.cmp(&a.verdict);
            by_verdict.then(excess(b).total_cmp(&excess(a)))
        });
        cases.truncate(CASES);
    }
    let caption = match more {
        0 => String::new(),
        more => {
            format!(
                "The {CASES} cases that are farthest from agreement; {more} more with --verbose"
            )
        }
    };
    table!(caption, cases, |case|
        "case" => case.label(),
        "codes" => case.engines.len(),
        "largest residual" => residual(case),
        "largest |a-b|" => largest(case),
        "verdict" => case.verdict,
    )
}

/// The answers to a case.
fn engines(case: &CaseOutcome) -> Table {
    let steps = |e: &EngineOutcome| {
        let remark = if e.converged { "" } else { " (not converged)" };
        Cell::number(e.iterations as f64, format!("{}{remark}", e.iterations))
    };
    table!("", &case.engines, |e|
        "engine" => &e.engine,
        "version" => &e.version,
        "steps" => steps(e),
        "seconds" => Cell::fixed(e.seconds, 3),
        "residual" => e.residual,
        "most at" => e.residual_at.as_ref().map(|x| place(x)),
        "verdict" => e.verdict,
    )
}

/// The methods compared with each other.
fn methods(outcome: &VerifyOutcome) -> Table {
    let source = |s: &Source| format!("{} {}", s.engine, s.method);
    let because = |because: &Option<String>| {
        let because = because.as_deref().unwrap_or_default();
        Cell::from(format!("no certificate, because {because}"))
    };
    let caption = "Methods against each other: ‖∇(u_a-u_b)‖ and certified bounds of each error; of all pairs of codes the one with the least slack";
    table!(caption, telling(&outcome.cross), |(c, pairs)|
        "scene" => &c.scene,
        "n" => c.n,
        "a" => source(&c.a),
        "b" => source(&c.b),
        "pairs" => pairs,
        "distance" => c.judged.map(|j| j.distance),
        "bound a" => c.judged.map(|j| Cell::at_most(j.bounds[0])),
        "bound b" => c.judged.map(|j| Cell::at_most(j.bounds[1])),
        "slack" => c.judged.map(|j| Cell::at_least(j.slack)),
        "verdict" => c.judged.map_or_else(|| because(&c.no_certificate), |j| j.verdict.into()),
    )
}

/// A suite for each scene, method and mesh, with a case for each engine, and for each pair and field.
fn suites(outcome: &VerifyOutcome, missing: &[Failure]) -> Vec<Suite> {
    let mut suites: Vec<Suite> = outcome.cases.iter().map(suite).collect();
    let cross = outcome.cross.iter().filter_map(|c| {
        let judged = c.judged?;
        let n = c.n.map_or(String::new(), |n| format!("n = {n}: "));
        let (a, b) = (&c.a, &c.b);
        Some(TestCase::new(
            &format!("{}.methods", c.scene),
            format!("{n}{} {} – {} {}", a.engine, a.method, b.engine, b.method),
            judged.verdict,
            format!(
                "distance {:e}, certified bounds {:e} and {:e}, the best on this mesh {:e}",
                judged.distance, judged.bounds[0], judged.bounds[1], judged.best
            ),
        ))
    });
    let failures = outcome.failures.iter().chain(missing);
    let engines = failures.map(|Failure { engine, message }| TestCase {
        title: Some(format!("no answer from {engine}")),
        ..TestCase::new("engines", engine, Verdict::Undetermined, message.clone())
    });
    suites.extend([Suite::new("methods", cross), Suite::new("engines", engines)]);
    suites.retain(|suite| !suite.cases.is_empty());
    suites
}

fn suite(case: &CaseOutcome) -> Suite {
    let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
    // A dot would start a separate package in the servers' trees.
    let class = format!("{}.{}{n}", case.scene.replace('.', "_"), case.method);
    let test = |name, verdict, message| TestCase::new(&class, name, verdict, message);
    let engines = case.engines.iter().map(|engine| {
        let message = match (&engine.findings, engine.converged) {
            (Some(found), _) => found.sentence().to_string(),
            (None, true) => format!("its backward error is {}", short(engine.residual)),
            (None, false) => format!("it did not converge in {} steps", engine.iterations),
        };
        let name = &engine.engine;
        TestCase {
            title: Some(format!(
                "{}: {name} does not solve the scheme",
                case.label()
            )),
            seconds: engine.seconds,
            ..test(format!("{name} solves the scheme"), engine.verdict, message)
        }
    });
    let pairs = case.pairs.iter().map(|pair| {
        let name = format!("{} – {}: {}", pair.a, pair.b, pair.field.field);
        test(name, pair.field.verdict, why(&pair.field))
    });
    let mut cases: Vec<TestCase> = engines.chain(pairs).collect();
    if case.pairs.is_empty() {
        let why = "fewer than two engines answered".to_owned();
        cases.push(test("a pair to compare".into(), Verdict::Undetermined, why));
    }
    Suite {
        properties: vec![
            ("engines", versions(case)),
            ("mesh", case.mesh_digest.clone()),
            ("faces", case.faces.to_string()),
        ],
        ..Suite::new(case.label(), cases)
    }
}
