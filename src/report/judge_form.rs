//! The report of `judge` about a result in a form.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::json::csv;
use super::model::{Block, Report, Story, Suite, Table, Todo, short, table};
use crate::engine::quoted;
use crate::text::number::{place, whole};
use crate::text::{Text, text};
use crate::why::InForm;
use faceoff_form::Problem;
use faceoff_form::judge::Row;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// The number of rows that are listed one by one.
const MOST: usize = 8;

/// A result of a file in a form, for scripts.
#[derive(Serialize)]
pub struct FormJudgement {
    /// The findings.
    #[serde(flatten)]
    pub found: InForm,
    form: String,
    result: String,
    dofs: usize,
    free: usize,
    means: Vec<MeanError>,
    worst: Vec<RowTold>,
    held: Vec<RowTold>,
    terms: Vec<TermTold>,
    /// The file of the form.
    #[serde(skip)]
    scene: String,
    #[serde(skip)]
    dim: usize,
    /// The name of each unknown, and whether its rows have a component.
    #[serde(skip)]
    names: Vec<(String, bool)>,
}

/// A prescribed mean.
#[derive(Serialize)]
struct MeanError {
    unknown: String,
    error: f64,
}

/// A row, or a prescribed value.
#[derive(Serialize)]
struct RowTold {
    unknown: String,
    at: [f64; 3],
    error: f64,
    residual: f64,
    /// The text of its largest term; `None` for a prescribed value.
    #[serde(skip_serializing_if = "Option::is_none")]
    term: Option<String>,
}

/// A term of F.
#[derive(Serialize)]
struct TermTold {
    term: String,
    /// Its largest row, relative to the sizes of the rows.
    largest: f64,
}

impl FormJudgement {
    /// From a result file and a form file.
    pub fn new(result: &Path, scene: &str, problem: &Problem, found: InForm) -> Self {
        let names = problem.unknowns.iter().map(|u| {
            let has_components = u.space.size.is_some() && !u.space.element.is_vector();
            (u.name.clone(), has_components)
        });
        let names: Vec<(String, bool)> = names.collect();
        let judged = &found.judged;
        let term = |row: &Row| judged.terms.get(row.term).map(|term| term.text.clone());
        let list = |rows: &[Row], has_term: bool| -> Vec<RowTold> {
            // Negated so that NaN fails.
            let failing = rows.iter().filter(|row| !(row.error <= found.limit));
            let told = failing.take(MOST).map(|row| RowTold {
                unknown: called(&names, row),
                at: row.at,
                error: row.error,
                residual: row.residual,
                term: term(row).filter(|_| has_term),
            });
            told.collect()
        };
        let terms = judged.terms.iter().map(|term| TermTold {
            term: term.text.clone(),
            largest: term.largest,
        });
        let means = judged.means.iter().map(|(k, error)| MeanError {
            unknown: problem.unknowns[*k].name.clone(),
            error: *error,
        });
        FormJudgement {
            form: problem.name.clone(),
            scene: quoted([scene]),
            dim: problem.dim,
            result: result.display().to_string(),
            dofs: judged.dofs,
            free: judged.free,
            means: means.collect(),
            worst: list(&judged.rows, true),
            held: list(&judged.held, false),
            terms: terms.collect(),
            names,
            found,
        }
    }
}

/// `u`, or `u[1]` for a vector.
fn called(names: &[(String, bool)], row: &Row) -> String {
    match &names[row.unknown] {
        (name, true) => format!("{name}[{}]", row.component),
        (name, false) => name.clone(),
    }
}

/// The report of a judgement.
///
/// # Errors
/// Only those of a broken installation.
pub fn judge_form(told: &FormJudgement, inputs: Vec<PathBuf>) -> Result<Report<'_>> {
    let (found, form) = (&told.found, &told.form);
    let title = format!("faceoff judge: {}, {form}", told.result);
    let mut report = Report::judging("judge form", &title, found.verdict, told)?;
    let (result, name) = (
        Text::message(&told.result),
        Text::message(told.result.rsplit('/').next().unwrap_or(&told.result)),
    );
    let colon = if found.verdict.passes() { "" } else { ":" };
    let verdict = found.verdict.word();
    report.headline = text!("{verdict}: {result}{colon} {found.sentence}");
    report.inputs = inputs;
    report.notes = vec![text!(
        "Residual: F at the result of each row over the sum of the sizes of what it is made of. The fields were written {}; no more than {} counts as \
         rounding.",
        found.written.words(),
        short(found.limit)
    )];
    let residual = text!(
        "{}: {} of {} rows are above rounding",
        short(found.residual),
        whole(found.failing),
        whole(told.free)
    );
    let dirichlet = match found.dirichlet == 0.0 {
        true => text!("hold exactly"),
        false => text!("off by up to {} of the largest", short(found.dirichlet)),
    };
    let worst = table!("The rows that are farthest off, with the largest of their terms", &told.worst, |row|
        "row" => &row.unknown,
        "at" => place(&row.at[..told.dim]),
        "residual" => row.error,
        "largest term" => Text::message(row.term.as_deref().unwrap_or_default()),
    );
    let held = table!("The Dirichlet values that are farthest off", &told.held, |row|
        "dof" => &row.unknown,
        "at" => place(&row.at[..told.dim]),
        "off" => row.error,
    );
    let because = table!("What it solves instead of the form", &found.because, |row|
        "as if" => row.0.clone(),
        "explains" => &row.1,
    );
    let tables = [worst, held, because].into_iter();
    let facts = Block::facts([
        ("written", Text::from(found.written.words())),
        ("residual", residual),
        ("Dirichlet values", dirichlet),
    ]);
    let again = Todo::new(
        "Hold it against what the codes find:",
        [format!("faceoff verify --run {}", told.scene)],
    );
    let rows = Todo::only(text!("Every row is in `rows.csv`, next to this page."));
    let cause = found.cause().map(|words| text!(", but as if {words}"));
    report.story = Story {
        claim: match found.verdict {
            Verdict::Agree => text!("**{name}** solves the form {form}, to rounding"),
            _ => text!("**{name}** does not solve the form {form}{cause}"),
        },
        rests_on: found.sentence.clone(),
        picture: Vec::new(),
        next: match found.verdict.passes() {
            true => Vec::new(),
            false => vec![again, rows],
        },
        rest: [facts]
            .into_iter()
            .chain(tables.filter(|of| !of.rows.is_empty()).map(Table::into))
            .collect(),
    };
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
        let free = told.found.judged.rows.iter().map(row(false));
        csv("unknown,x,y,z,held,error,residual", free.chain(told.found.judged.held.iter().map(row(true))))
    });
    let does = [format!("solves {form}"), format!("does not solve {form}")];
    let (does, why) = ([&*does[0], &*does[1]], found.sentence.to_string());
    report.suites = vec![Suite::of(&told.result, form, does, found.verdict, why)];
    Ok(report)
}
