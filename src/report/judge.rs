//! The report of `judge`.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::certified::Certified;
use super::culprit::{claim, equations, look};
use super::findings::{gamma, terms, tried, worst};
use super::html::{self, Put};
use super::json::csv;
use super::model::{Block, Report, Story, Suite, Todo, short};
use crate::engine::Case;
use crate::run::foreign::Understood;
use crate::text::number::{size, whole};
use crate::text::{Text, text};
use crate::why::{FaceGamma, Findings};
use faceoff_fem::certify::{Certificate, Target};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// A field of a file in a scheme, for scripts.
#[derive(Serialize)]
pub struct Judgement {
    /// Does the field solve the scheme?
    pub verdict: Verdict,
    /// The fault, its place and its cause.
    sentence: Text,
    scene: String,
    result: String,
    understood: Understood,
    method: String,
    cells: usize,
    dofs: usize,
    findings: Findings,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<Certified>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    no_certificate: Option<String>,
}

impl Judgement {
    /// The name of the file without its folders.
    fn name(&self) -> &str {
        self.result.rsplit('/').next().unwrap_or(&self.result)
    }

    /// For a field that was read from `result` as a function in the case's space; `certificate`, or why there is none.
    pub fn new(
        result: &Path,
        case: &Case,
        understood: Understood,
        findings: Findings,
        certificate: &Result<Certificate, String>,
    ) -> Self {
        let space = &case.problem.space;
        let certified = certificate.as_ref().ok();
        Judgement {
            verdict: match findings.solves() {
                true => Verdict::Agree,
                false => Verdict::Disagree,
            },
            sentence: findings.sentence(),
            scene: case.scene().name().to_owned(),
            result: result.display().to_string(),
            understood,
            method: case.problem.method().to_string(),
            cells: space.mesh.cell_count(),
            dofs: space.dofs,
            findings,
            no_certificate: certificate.as_ref().err().cloned(),
            certificate: certified.map(|c| Certified::new(Target::UH, c)),
        }
    }
}

/// The report of a judgement of u in a case.
///
/// # Errors
/// Only those of a broken installation.
pub fn judge<'a>(
    told: &'a Judgement,
    case: &'a Case,
    u: &'a [f64],
    inputs: Vec<PathBuf>,
) -> Result<Report<'a>> {
    let (found, verdict) = (&told.findings, told.verdict.word());
    let of = format!("{}, {}", told.scene, told.method);
    let title = format!("faceoff judge: {}, {of}", told.result);
    let mut report = Report::judging("judge", &title, told.verdict, told)?;
    let colon = if told.verdict.passes() { "" } else { ":" };
    report.headline = text!("{verdict}: {told.result}{colon} {told.sentence}");
    report.inputs = inputs;
    let mesh = case.problem.space.mesh;
    report.digests.push(("the mesh".into(), mesh.digest()));
    let certificate = match (&told.certificate, &told.no_certificate) {
        (Some(c), _) => c.sentence(),
        (_, because) => format!("none, because {}", because.as_deref().unwrap_or_default()),
    };
    let name = told.name();
    report.notes = vec![text!(
        "Scheme: Burman, Hansbo, Larson 2017, (3.2) and (2.4); γ = {} h. Residual: of each row over the sum of the sizes of its terms. The \
         field was read as {}, written {}.",
        case.problem.discretisation.gamma0().to_string(),
        Text::message(&told.understood.sentence()),
        found.written.words()
    )];
    let facts = || {
        Block::facts([
            ("understood as", Text::message(&told.understood.sentence())),
            ("written", found.written.words().into()),
            ("residual", residual(found).into()),
            ("certificate", certificate.clone().into()),
        ])
    };
    let rows_that_fail = || match found.failing {
        0 => Vec::new(),
        _ => vec![worst(&found.worst).into(), terms(&found.terms).into()],
    };
    let mut terminal = vec![facts()];
    terminal.extend(rows_that_fail());
    if !found.explanations.is_empty() {
        let what = "What was put into the scheme in its place, one thing at a time, and the residual with it";
        terminal.push(Block::text(what));
        terminal.extend(tried(&found.explanations, found.limit));
    }
    let is_off = |g: &&FaceGamma| {
        let least = 10.0 * g.uncertain.unwrap_or(0.0);
        g.factor.is_some_and(|f| (f - 1.0).abs() > least)
    };
    let off: Vec<&FaceGamma> = found.gamma.iter().filter(is_off).take(FACES).collect();
    if !off.is_empty() {
        terminal.push(gamma(off).into());
    }
    let put = move || Put::new(name, &case.problem, u, Some(&told.findings));
    let is_faulty = !told.verdict.passes();
    let mut page = vec![Block::drawn(move || {
        html::along_one(put(), told.findings.limit, is_faulty)
    })];
    if !found.explanations.is_empty() {
        let words = "One thing put into the scheme in its place at a time, and the residual that is left with it.";
        page.extend([Block::heading(2, "What was tried"), Block::text(words)]);
        page.extend(tried(&found.explanations, found.limit));
    }
    let mut rest = vec![facts()];
    if found.failing > 0 {
        rest.push(Block::drawn(move || html::by_term(&put(), &told.scene)));
    }
    rest.extend(rows_that_fail());
    let about = "how the file was understood, and what its rows are made of";
    page.push(Block::folded("Rows and terms", about, rest));
    if !found.gamma.is_empty() {
        let all = vec![gamma(&found.gamma).into()];
        page.push(Block::folded("γ on every contact face", "", all));
    }
    let proved = told.certificate.as_ref().map(Certified::brief);
    report.story = Story {
        claim: match told.verdict {
            Verdict::Agree => text!("**{name}** solves the scheme, to rounding"),
            _ => claim(name, found),
        },
        rests_on: match told.verdict {
            Verdict::Agree => text!(
                "All **{} equations** of {of} hold: the largest residual is {}. Proved in addition: {}.",
                whole(found.rows),
                size(found.residual),
                proved.unwrap_or(certificate)
            ),
            _ => equations(found, &of),
        },
        picture: vec![Block::drawn(move || html::cause(&put(), &of))],
        next: next(told),
        rest: vec![Block::Terminal(terminal), Block::Page(page)],
    };
    report.file("rows.csv", || rows(told, case, u));
    let does = [
        format!("solves {}", told.method),
        format!("does not solve {}", told.scene),
    ];
    let does = [&*does[0], &*does[1]];
    let (verdict, why) = (told.verdict, told.sentence.to_string());
    report.suites = vec![Suite::of(&told.result, &told.scene, does, verdict, why)];
    Ok(report)
}

/// Suggestions for a field that does not solve.
fn next(told: &Judgement) -> Vec<Todo> {
    if told.verdict.passes() {
        return Vec::new();
    }
    let (scene, method) = (&told.scene, &told.method);
    let again = format!("faceoff solve {scene} --method {method} --out u.vtu");
    let look = look(&told.findings, "the code", None).into_iter();
    let rows = text!("Every row with its terms is in `rows.csv`, next to this page.");
    let hold = Todo::new("Hold against it what this program finds:", [again]);
    look.chain([hold, Todo::only(rows)]).collect()
}

/// The most faces on a terminal.
const FACES: usize = 10;

fn residual(found: &Findings) -> String {
    format!(
        "{}: {} of {} rows and {} of {} faces are above rounding",
        short(found.residual),
        found.failing,
        found.rows,
        found.failing_faces,
        found.faces
    )
}

/// Every row with its terms.
fn rows(told: &Judgement, case: &Case, u: &[f64]) -> String {
    let problem = &case.problem;
    let (residual, terms) = (problem.residual(u), problem.terms(u));
    let head = "dof,x,y,z,u,error,residual,volume,load,consistency,contact";
    let row = |dof: usize| {
        let [x, y, z] = problem.space.point(dof);
        let [volume, load, consistency, contact] = [0, 1, 2, 3].map(|k| terms[k][dof]);
        let error = told.findings.errors[dof];
        json!({
            "dof": dof, "x": x, "y": y, "z": z, "u": u[dof], "error": error, "residual": residual[dof],
            "volume": volume, "load": load, "consistency": consistency, "contact": contact,
        })
    };
    csv(head, (0..u.len()).map(row))
}
