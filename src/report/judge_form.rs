//! What `judge` found about a result in a form.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::causes::{CauseTold, Names};
use super::json::csv;
use super::model::{Block, Report, Suite, TestCase, Todo, short, table, word};
use crate::engine::quoted;
use crate::run::{RESIDUAL_TOLERANCE, Written};
use crate::text::number::{place, share, size, whole};
use crate::text::{Text, text};
use faceoff_form::Problem;
use faceoff_form::judge::{Judged, Row};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// A residual of no more than this, of rows over the sizes of their terms, is rounding: what solvers of linear systems leave, and Newton's
/// method with its last increment.
const ROUNDING: f64 = RESIDUAL_TOLERANCE;
/// Of numbers that were rounded when they were written, a row may be off by so many of their last digits.
const WRITTEN: f64 = 4.0;
/// Rows that are told one by one.
const MOST: usize = 8;

/// A result of a file in a form, as scripts read it.
#[derive(Serialize)]
pub struct FormJudgement {
    /// Does it solve the form?
    pub verdict: Verdict,
    sentence: Text,
    form: String,
    result: String,
    dofs: usize,
    free: usize,
    written: Written,
    /// The largest residual of free rows.
    residual: f64,
    /// What counts as rounding.
    limit: f64,
    failing: usize,
    /// The largest error of given values.
    dirichlet: f64,
    means: Vec<MeanError>,
    worst: Vec<RowTold>,
    held: Vec<RowTold>,
    terms: Vec<TermTold>,
    /// The changes which together make a form that the result solves; empty where it solves the form, or none is known.
    explanations: Vec<CauseTold>,
    /// The same in words, and what else would explain it.
    #[serde(skip)]
    because: Vec<(Text, &'static str)>,
    /// The file of the form.
    #[serde(skip)]
    scene: String,
    #[serde(skip)]
    dim: usize,
    #[serde(skip)]
    judged: Judged,
    #[serde(skip)]
    names: Vec<(String, bool)>,
}

/// A given mean.
#[derive(Serialize)]
struct MeanError {
    unknown: String,
    error: f64,
}

/// A row, or a given value.
#[derive(Serialize)]
struct RowTold {
    unknown: String,
    at: [f64; 3],
    error: f64,
    residual: f64,
    /// The text of its largest term; of a given value none.
    #[serde(skip_serializing_if = "Option::is_none")]
    term: Option<String>,
}

/// A term of F.
#[derive(Serialize)]
struct TermTold {
    term: String,
    /// Its largest row, over the sizes of rows.
    largest: f64,
}

impl FormJudgement {
    /// Of a result whose fields were written so, in the form of a file.
    pub fn new(
        result: &Path,
        scene: &str,
        problem: &Problem,
        judged: Judged,
        written: &[Written],
    ) -> Self {
        let coarsest = written
            .iter()
            .copied()
            .max_by(|a, b| a.unit().total_cmp(&b.unit()));
        let written = coarsest.unwrap_or(Written::Binary64);
        let limit = ROUNDING.max(WRITTEN * written.unit());
        let names: Vec<(String, bool)> = problem
            .unknowns
            .iter()
            .map(|u| {
                (
                    u.name.clone(),
                    u.space.size.is_some() && !u.space.element.is_vector(),
                )
            })
            .collect();
        let first = |rows: &[Row]| rows.first().map_or(0.0, |row| row.error);
        let (residual, dirichlet) = (first(&judged.rows), first(&judged.held));
        // Negated so that NaN fails.
        let fails = |error: f64| !(error <= limit);
        let failing = judged.rows.iter().filter(|row| fails(row.error)).count();
        let failing_held = judged.held.iter().filter(|row| fails(row.error)).count();
        let failing_means: Vec<&str> = judged
            .means
            .iter()
            .filter(|(_, error)| fails(*error))
            .map(|(k, _)| problem.unknowns[*k].name.as_str())
            .collect();
        let told = |row: &Row, has_term: bool| RowTold {
            unknown: called(&names, row),
            at: row.at,
            error: row.error,
            residual: row.residual,
            term: judged
                .terms
                .get(row.term)
                .filter(|_| has_term)
                .map(|t| t.text.clone()),
        };
        let list = |rows: &[Row], has_term: bool| -> Vec<RowTold> {
            let failing = rows.iter().filter(|row| fails(row.error)).take(MOST);
            failing.map(|row| told(row, has_term)).collect()
        };
        let terms = judged.terms.iter().map(|term| TermTold {
            term: term.text.clone(),
            largest: term.largest,
        });
        let terms: Vec<TermTold> = terms.collect();
        let mut parts: Vec<Text> = Vec::new();
        if failing > 0 {
            parts.push(text!(
                "{} of {} equations do not hold, the largest residual is {}",
                whole(failing),
                whole(judged.free),
                size(residual)
            ));
        }
        if failing_held > 0 {
            parts.push(text!(
                "{} of {} Dirichlet values are off, by up to {}",
                whole(failing_held),
                whole(judged.held.len()),
                size(dirichlet)
            ));
        }
        if !failing_means.is_empty() {
            parts.push(text!(
                "the mean of {} is off",
                failing_means.join(" and that of ")
            ));
        }
        let is_solved = parts.is_empty();
        let mut sentence = match is_solved {
            true => text!(
                "solves the form to rounding: the largest residual is {}",
                size(residual)
            ),
            false => Text::default(),
        };
        for (k, part) in parts.into_iter().enumerate() {
            sentence = if k == 0 {
                part
            } else {
                text!("{}; {}", sentence, part)
            };
        }
        let known = Names {
            problem,
            judged: &judged,
        };
        let explanation = judged.explanation.as_ref().filter(|_| failing > 0);
        let mut because = Vec::new();
        if let Some(found) = explanation {
            let cause = known.sentence(&found.causes);
            sentence = match found.is_exact {
                true => text!("{}; it solves the form as if {}", sentence, &cause),
                false => text!(
                    "{}; no change that is known explains it, the nearest, as if {}, explains {}",
                    sentence,
                    &cause,
                    share(found.share)
                ),
            };
            because.push((
                cause,
                if found.is_exact {
                    "all but rounding"
                } else {
                    "a part"
                },
            ));
            let alike = found.alike.iter().map(|causes| known.sentence(causes));
            because.extend(alike.map(|text| (text, "all but rounding")));
        } else if failing > 0 {
            sentence = text!("{}; no change that is known explains it", sentence);
        }
        let explanations = explanation.filter(|found| found.is_exact);
        let explanations = explanations.map_or(Vec::new(), |found| known.told(found));
        FormJudgement {
            verdict: if is_solved {
                Verdict::Agree
            } else {
                Verdict::Disagree
            },
            sentence,
            form: problem.name.clone(),
            scene: quoted([scene]),
            dim: problem.dim,
            result: result.display().to_string(),
            dofs: judged.dofs,
            free: judged.free,
            written,
            residual,
            limit,
            failing,
            dirichlet,
            means: judged
                .means
                .iter()
                .map(|(k, error)| MeanError {
                    unknown: problem.unknowns[*k].name.clone(),
                    error: *error,
                })
                .collect(),
            worst: list(&judged.rows, true),
            held: list(&judged.held, false),
            terms,
            explanations,
            because,
            judged,
            names,
        }
    }
}

/// `u`, or `u[1]` of a vector.
fn called(names: &[(String, bool)], row: &Row) -> String {
    match &names[row.unknown] {
        (name, true) => format!("{name}[{}]", row.component),
        (name, false) => name.clone(),
    }
}

/// The report of a judgement.
///
/// # Errors
/// None but of a broken installation.
pub fn judge_form(told: &FormJudgement, inputs: Vec<PathBuf>) -> Result<Report<'_>> {
    let verdict = word(told.verdict);
    let title = format!("faceoff judge: {}, {}", told.result, told.form);
    let name = told.result.rsplit('/').next().unwrap_or(&told.result);
    let headline = match told.verdict {
        Verdict::Agree => text!(
            "{}: {} {}",
            verdict,
            Text::message(&told.result),
            &told.sentence
        ),
        _ => text!(
            "{}: {}: {}",
            verdict,
            Text::message(&told.result),
            &told.sentence
        ),
    };
    let mut report = Report::new("judge form", &title, headline, told)?;
    report.verdict = Some((told.verdict, verdict));
    report.inputs = inputs;
    report.claim = match told.verdict {
        Verdict::Agree => text!(
            "**{}** solves the form {}, to rounding",
            Text::message(name),
            &told.form
        ),
        _ => text!(
            "**{}** does not solve the form {}",
            Text::message(name),
            &told.form
        ),
    };
    report.lede = told.sentence.clone();
    report.notes = vec![text!(
        "Residual: F at the result of each row over the sum of the sizes of what it is made of. The fields were written {}; no more than {} counts as \
         rounding.",
        told.written.words(),
        short(told.limit)
    )];
    report.blocks.push(Block::facts([
        ("written", Text::from(told.written.words())),
        (
            "residual",
            text!(
                "{}: {} of {} rows are above rounding",
                short(told.residual),
                whole(told.failing),
                whole(told.free)
            ),
        ),
        (
            "Dirichlet values",
            match told.dirichlet == 0.0 {
                true => text!("hold exactly"),
                false => text!("off by up to {} of the largest", short(told.dirichlet)),
            },
        ),
    ]));
    if !told.worst.is_empty() {
        let caption = "The rows that are farthest off, with the largest of their terms";
        report.blocks.push(
            table!(caption, &told.worst, |row|
                "row" => &row.unknown,
                "at" => place(&row.at[..told.dim]),
                "residual" => row.error,
                "largest term" => Text::message(row.term.as_deref().unwrap_or_default()),
            )
            .into(),
        );
    }
    if !told.held.is_empty() {
        let caption = "The Dirichlet values that are farthest off";
        report.blocks.push(
            table!(caption, &told.held, |row|
                "dof" => &row.unknown,
                "at" => place(&row.at[..told.dim]),
                "off" => row.error,
            )
            .into(),
        );
    }
    if !told.because.is_empty() {
        let caption = "What it solves in place of the form";
        report.blocks.push(
            table!(caption, &told.because, |row|
                "as if" => row.0.clone(),
                "explains" => row.1,
            )
            .into(),
        );
    }
    if !told.verdict.passes() {
        report.next = vec![
            Todo::new(
                "Hold it against what the codes find:",
                [format!("faceoff verify --run {}", told.scene)],
            ),
            Todo::only(text!("Every row is in `rows.csv`, beside this page.")),
        ];
    }
    report.file("rows.csv", move || {
        let row = |is_held: bool| {
            move |row: &Row| {
                let [x, y, z] = row.at;
                json!({
                    "unknown": called(&told.names, row), "x": x, "y": y, "z": z, "held": u8::from(is_held), "error": row.error,
                    "residual": row.residual,
                })
            }
        };
        let free = told.judged.rows.iter().map(row(false));
        csv("unknown,x,y,z,held,error,residual", free.chain(told.judged.held.iter().map(row(true))))
    });
    let test = TestCase {
        title: Some(format!("{} does not solve {}", told.result, told.form)),
        ..TestCase::new(
            &told.form,
            format!("{} solves {}", told.result, told.form),
            told.verdict,
            told.sentence.to_string(),
        )
    };
    report.suites.push(Suite::new(&told.result, [test]));
    Ok(report)
}
