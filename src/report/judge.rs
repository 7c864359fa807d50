//! What `judge` found.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::certified::Certified;
use super::culprit::{claim, equations};
use super::findings::{gamma, terms, tried, worst};
use super::html::{self, Put};
use super::json::csv;
use super::model::{Block, Report, Suite, TestCase, Todo, short, word};
use crate::engine::Case;
use crate::run::foreign::Understood;
use crate::text::number::{size, whole};
use crate::text::{Text, text};
use crate::why::{self, FaceGamma, Findings};
use faceoff_fem::certify::{Certificate, Target};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// A field of a file in a scheme, as scripts read it.
#[derive(Serialize)]
pub struct Judgement {
    /// Does the field solve the scheme?
    pub verdict: Verdict,
    /// What is wrong where, and why.
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
    /// The file without its folders.
    fn name(&self) -> &str {
        self.result.rsplit('/').next().unwrap_or(&self.result)
    }

    /// Of a field that was read from `result` as a function in the case's space; `certificate`, or why there is none.
    pub fn new(
        result: &Path,
        case: &Case,
        understood: Understood,
        findings: Findings,
        certificate: &Result<Certificate, String>,
    ) -> Self {
        let space = &case.problem.space;
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
            certificate: certificate
                .as_ref()
                .ok()
                .map(|c| Certified::new(Target::UH, c)),
            no_certificate: certificate.as_ref().err().cloned(),
        }
    }
}

/// The report of a judgement of u in a case.
///
/// # Errors
/// None but of a broken installation.
pub fn judge<'a>(
    told: &'a Judgement,
    case: &'a Case,
    u: &'a [f64],
    inputs: Vec<PathBuf>,
) -> Result<Report<'a>> {
    let (found, verdict) = (&told.findings, word(told.verdict));
    let title = format!(
        "faceoff judge: {}, {}, {}",
        told.result, told.scene, told.method
    );
    let headline = format!("{verdict}: {} {}", told.result, told.sentence);
    let headline = match told.verdict {
        Verdict::Agree => headline,
        _ => format!("{verdict}: {}: {}", told.result, told.sentence),
    };
    let mut report = Report::new("judge", &title, headline, told)?;
    report.verdict = Some((told.verdict, verdict));
    report.inputs = inputs;
    let mesh = case.problem.space.mesh;
    report.digests.push(("the mesh".into(), mesh.digest()));
    let certificate = match (&told.certificate, &told.no_certificate) {
        (Some(c), _) => c.sentence(),
        (_, because) => format!("none, because {}", because.as_deref().unwrap_or_default()),
    };
    let name = told.name();
    let of = format!("{}, {}", told.scene, told.method);
    report.claim = match told.verdict {
        Verdict::Agree => text!("**{}** solves the scheme, to rounding", name),
        _ => claim(name, found),
    };
    report.lede = match told.verdict {
        Verdict::Agree => text!(
            "All **{} equations** of {} hold: the largest residual is {}. Proved besides: {}.",
            whole(found.rows),
            of,
            size(found.residual),
            told.certificate
                .as_ref()
                .map_or(certificate.clone(), Certified::brief)
        ),
        _ => equations(found, &of),
    };
    report.next = next(told);
    report.notes = vec![text!(
        "Scheme: Burman, Hansbo, Larson 2017, (3.2) and (2.4); γ = {} h. Residual: of each row over the sum of the sizes of its terms. The \
         field was read as {}, written {}.",
        case.problem.discretisation.gamma0().to_string(),
        Text::message(&told.understood.sentence()),
        found.written.words()
    )];
    let told_facts = || {
        Block::facts([
            ("understood as", Text::message(&told.understood.sentence())),
            ("written", found.written.words().into()),
            ("residual", residual(found).into()),
            ("certificate", certificate.clone().into()),
        ])
    };
    let mut terminal = vec![told_facts()];
    if found.failing > 0 {
        terminal.extend([worst(&found.worst).into(), terms(&found.terms).into()]);
    }
    if !found.explanations.is_empty() {
        terminal.push(tried(&found.explanations).into());
    }
    let off = |g: &&FaceGamma| {
        g.factor
            .is_some_and(|f| (f - 1.0).abs() > 10.0 * g.uncertain.unwrap_or(0.0))
    };
    let off: Vec<&FaceGamma> = found.gamma.iter().filter(off).collect();
    if !off.is_empty() {
        terminal.push(gamma(off.into_iter().take(FACES)).into());
    }
    report.lead.push(Block::Html(Box::new(move || {
        let put = Put::new(name, &case.problem, u, Some(&told.findings));
        Ok(html::cause(
            &put,
            &format!("{}, {}", told.scene, told.method),
        ))
    })));
    let mut page: Vec<Block> = Vec::new();
    page.push(Block::Html(Box::new(move || {
        let put = Put::new(name, &case.problem, u, Some(&told.findings));
        let is_faulty = !told.verdict.passes();
        Ok(html::along_one(put, told.findings.limit, is_faulty))
    })));
    if !found.explanations.is_empty() {
        let words = "One thing put into the scheme in its place at a time, and the residual that is left with it.";
        page.extend([
            Block::heading(2, "What was tried"),
            Block::Text(words.into()),
        ]);
        page.push(Block::Html(Box::new(move || {
            Ok(html::tried(
                &told.findings.explanations,
                told.findings.limit,
            ))
        })));
    }
    let mut rest = vec![told_facts()];
    if found.failing > 0 {
        rest.push(Block::Html(Box::new(move || {
            let put = Put::new(name, &case.problem, u, Some(&told.findings));
            Ok(html::by_term(&put, &told.scene))
        })));
        rest.extend([worst(&found.worst).into(), terms(&found.terms).into()]);
    }
    page.push(Block::folded(
        "Rows and terms",
        "how the file was understood, and what its rows are made of",
        rest,
    ));
    if !found.gamma.is_empty() {
        page.push(Block::folded(
            "γ on every contact face",
            "",
            vec![gamma(&found.gamma).into()],
        ));
    }
    report.blocks = vec![Block::Terminal(terminal), Block::Page(page)];
    report.file("rows.csv", || rows(told, case, u));
    let test = TestCase {
        title: Some(format!("{} does not solve {}", told.result, told.scene)),
        ..TestCase::new(
            &told.scene,
            format!("{} solves {}", told.result, told.method),
            told.verdict,
            told.sentence.to_string(),
        )
    };
    report.suites.push(Suite::new(&told.result, [test]));
    Ok(report)
}

/// What to do about a field that does not solve.
fn next(told: &Judgement) -> Vec<Todo> {
    if told.verdict.passes() {
        return Vec::new();
    }
    let found = &told.findings;
    let culprit = found.culprit();
    let mut suspects = found.terms.iter().filter(|t| t.suspect).map(|t| t.term);
    let term = culprit.and_then(|c| c.term).or_else(|| suspects.next());
    let words = match (culprit, term) {
        (Some(c), _) if c.is_gamma() => Some(match &c.at[..] {
            [spot] => text!("Look where the code makes **γ** of {}.", spot.carrier()),
            _ => text!("Look where the code makes **γ**."),
        }),
        (_, Some(term)) => Some(text!(
            "Look where the code assembles **{}**.",
            why::name(term)
        )),
        _ => None,
    };
    let mut steps: Vec<Todo> = words.into_iter().map(Todo::only).collect();
    let scene = &told.scene;
    steps.push(Todo::new(
        "Hold against it what this program finds:",
        [format!(
            "faceoff solve {scene} --method {} --out u.vtu",
            told.method
        )],
    ));
    steps.push(Todo::only(text!(
        "Every row with its terms is in `rows.csv`, beside this page."
    )));
    steps
}

/// So many faces a terminal has room for.
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
