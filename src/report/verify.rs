//! What `verify` found.

use serde::Serialize;

use super::html::{section, top};
use super::model::{Block, Cell, Report, Suite, Table, TestCase, cells, exact, place, short, word};
use crate::campaigns::verify::{CaseOutcome, Source, VerifyOutcome, VerifyRequest, telling};
use crate::engine::Explanation;
use crate::run::Failure;
use crate::why::Diagnosis;
use faceoff_judge::{FieldVerdict, Verdict, Worst};
use faceoff_mesh::error::Result;

/// An outcome with all that belongs to it.
pub struct Verified<'a> {
    pub request: &'a VerifyRequest,
    pub outcome: &'a VerifyOutcome,
    pub diagnoses: &'a [Diagnosis],
    /// Engines that were asked for and left out.
    pub missing: &'a [Failure],
    /// Says of each case how it was solved.
    pub explain: bool,
}

/// What was found, as JSON has it.
#[derive(Serialize)]
struct Found<'a> {
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
/// None but of a broken installation.
pub fn verify(verified: Verified) -> Result<Report> {
    let Verified {
        request,
        outcome,
        diagnoses,
        missing,
        explain,
    } = verified;
    let explanations = if explain {
        explained(outcome)
    } else {
        Vec::new()
    };
    let found = Found {
        outcome,
        diagnoses,
        explanations: &explanations,
    };
    let question = "faceoff: do the codes agree, face by face?";
    let verdict = word(outcome.verdict);
    let mut report = Report::new("verify", question, verdict, &found)?;
    report.verdict = Some((outcome.verdict, verdict));
    report.lead.push(Block::Html(Box::new(move || {
        top(request, outcome, diagnoses, missing)
    })));
    report.suites = suites(outcome, missing);

    let mut told = Vec::new();
    for case in &outcome.cases {
        told.push(Block::Text(format!(
            "{}: {} cells, {} faces, {} of them contact, {} dofs",
            label(case),
            case.cells,
            case.faces,
            case.contact_faces,
            case.dofs
        )));
        let caption = String::new();
        told.push(Block::Table(Table {
            caption,
            ..engines(case)
        }));
        told.push(pairs(case).into());
    }
    if !outcome.cross.is_empty() {
        told.push(methods(outcome).into());
    }
    let failures = outcome.failures.iter();
    told.extend(failures.map(|f| Block::Text(format!("no answer from {}", f.engine))));
    for e in &explanations {
        told.push(Block::Text(format!("{}:", about(e.scene, e.method, e.n))));
        let lines = e.explanation.lines().into_iter();
        told.extend(lines.map(|line| Block::Text(format!("  {line}"))));
    }
    told.extend(diagnoses.iter().map(|d| {
        let about = about(&d.scene, &d.method, d.n);
        Block::Text(format!("{about}: {} – {}: {}", d.a, d.b, d.sentence()))
    }));

    let mut page = vec![
        Block::Heading(2, "All that was judged".into()),
        matrix(outcome).into(),
    ];
    if !outcome.cross.is_empty() {
        page.push(methods(outcome).into());
    }
    for (index, case) in outcome.cases.iter().enumerate() {
        page.push(Block::Html(Box::new(move || {
            section(index, case, request, diagnoses)
        })));
        let digest = (label(case), case.mesh_digest.clone());
        report
            .digests
            .push((format!("the mesh of {}", digest.0), digest.1));
        for engine in &case.engines {
            let known = (engine.engine.clone(), engine.version.clone());
            if !report.engines.contains(&known) {
                report.engines.push(known);
            }
        }
    }
    report.blocks = vec![Block::Terminal(told), Block::Page(page)];
    report
        .files
        .push(Box::new(move |folder| super::write_fields(folder, outcome)));
    Ok(report)
}

/// `one-zone, cr, n = 16`
fn about(scene: &str, method: &str, n: Option<usize>) -> String {
    let n = n.map_or(String::new(), |n| format!(", n = {n}"));
    format!("{scene}, {method}{n}")
}

pub(super) fn label(case: &CaseOutcome) -> String {
    about(&case.scene, &case.method, case.n)
}

/// Of every case that the Rust engine solved. A certificate is of all fields on a mesh, where methods are judged by it.
fn explained(outcome: &VerifyOutcome) -> Vec<Explained<'_>> {
    let of = |case: &'_ CaseOutcome| {
        let mut explanation = case.explanation.clone()?;
        explanation.certificate = outcome.cross.iter().any(|cross| {
            let is_its = cross.a.method == case.method || cross.b.method == case.method;
            cross.judged.is_some() && is_its && (&cross.scene, cross.n) == (&case.scene, case.n)
        });
        Some(explanation)
    };
    let cases = outcome.cases.iter();
    cases
        .filter_map(|case| {
            Some(Explained {
                scene: &case.scene,
                method: &case.method,
                n: case.n,
                explanation: of(case)?,
            })
        })
        .collect()
}

/// The answers to a case.
pub(super) fn engines(case: &CaseOutcome) -> Table {
    let rows = case.engines.iter().map(|e| {
        let steps = if e.converged { "" } else { " (not converged)" };
        cells![
            &e.engine,
            &e.version,
            Cell::Number(e.iterations as f64, format!("{}{steps}", e.iterations)),
            Cell::fixed(e.seconds, 3),
            e.residual,
            e.residual_at.as_ref().map(|x| place(x)),
            e.verdict,
        ]
    });
    let caption =
        "Answers; the residual is the backward error of an answer put into the scheme again";
    let head = [
        "engine", "version", "steps", "seconds", "residual", "most at", "verdict",
    ];
    Table::new(caption, &head).with(rows)
}

/// Every field of every pair.
fn pairs(case: &CaseOutcome) -> Table {
    let rows = case.pairs.iter().map(|pair| {
        let field = &pair.field;
        cells![
            format!("{} – {}", pair.a, pair.b),
            &field.field,
            field.max_abs,
            field.max_rel,
            Cell::Number(field.tolerance, format!("{:e}", field.tolerance)),
            worst(field),
            remark(field, "faces"),
        ]
    });
    let head = [
        "pair",
        "field",
        "max |a-b|",
        "relative",
        "tolerance",
        "worst face",
        "verdict",
    ];
    Table::new("", &head).with(rows)
}

/// `[14, 31] at (0.8750, 0.0312)`
pub(super) fn worst(field: &FieldVerdict) -> Option<String> {
    let worst = field.worst.as_ref()?;
    let at = match worst.midpoint.is_empty() {
        true => String::new(),
        false => format!(" at {}", place(&worst.midpoint)),
    };
    Some(format!("{:?}{at}", worst.vertices))
}

/// The verdict, and what it rests on.
pub(super) fn remark(field: &FieldVerdict, carriers: &str) -> String {
    let mut text = word(field.verdict).to_owned();
    if let Some(reason) = &field.reason {
        text += &format!(": {reason}");
    } else if field.beyond > 0 {
        text += &format!(": {} of {} {carriers}", field.beyond, field.faces);
    }
    if let Some(flips @ 1..) = field.rounding_flips {
        text += &format!(" ({flips} status flips at rounding level)");
    }
    text
}

/// How much, where and how many, in one sentence.
pub(super) fn why(field: &FieldVerdict) -> String {
    let values = |w: &Worst| format!("{} against {}", exact(w.a), exact(w.b));
    let values = field.worst.as_ref().map(values).unwrap_or_default();
    let place = worst(field).map_or(String::new(), |at| format!(", worst at {at}: {values}"));
    match &field.reason {
        Some(reason) => reason.clone(),
        None => format!(
            "{} of {} beyond {:e}: |a-b| up to {}, relative {}{place}",
            field.beyond,
            field.faces,
            field.tolerance,
            short(field.max_abs),
            short(field.max_rel)
        ),
    }
}

/// One row a case, one column a pair.
fn matrix(outcome: &VerifyOutcome) -> Table {
    let name = |a: &str, b: &str| format!("{a} – {b}");
    let mut names: Vec<String> = Vec::new();
    for pair in outcome.cases.iter().flat_map(|case| &case.pairs) {
        if !names.contains(&name(&pair.a, &pair.b)) {
            names.push(name(&pair.a, &pair.b));
        }
    }
    let rows = outcome.cases.iter().enumerate().map(|(index, case)| {
        let link = Cell::Link(format!("#case-{index}"), case.scene.clone());
        let mut row = cells![link, &case.method, case.n];
        row.extend(names.iter().map(|of| {
            let fields = case.pairs.iter().filter(|p| name(&p.a, &p.b) == *of);
            let largest = fields.clone().map(|p| p.field.max_rel).fold(0.0, f64::max);
            let verdict = fields.map(|p| p.field.verdict).max();
            verdict.map_or("no answer".into(), |verdict| Cell::Judged(verdict, largest))
        }));
        let engines = case.engines.iter().map(|e| e.verdict).max();
        row.push(engines.unwrap_or(Verdict::Undetermined).into());
        row
    });
    let head = ["scene", "method", "n"].into_iter();
    let head = head.chain(names.iter().map(String::as_str));
    let head: Vec<&str> = head.chain(["every answer solves the scheme"]).collect();
    let caption = "Scenes, methods and pairs of codes; the number is the largest difference of any field, relative to max|u|";
    Table::new(caption, &head).with(rows)
}

/// The methods against each other.
fn methods(outcome: &VerifyOutcome) -> Table {
    let rows = telling(&outcome.cross).into_iter().map(|(c, pairs)| {
        let source = |s: &Source| format!("{} {}", s.engine, s.method);
        let mut row = cells![&c.scene, c.n, source(&c.a), source(&c.b), pairs];
        row.extend(match &c.judged {
            Some(j) => cells![j.distance, j.bounds[0], j.bounds[1], j.slack, j.verdict],
            None => {
                let because = c.no_certificate.as_deref().unwrap_or_default();
                cells!["", "", "", "", format!("no certificate, because {because}")]
            }
        });
        row
    });
    let caption = "Methods against each other: ‖∇(u_a-u_b)‖ and certified bounds of each error; of all pairs of codes the one with the least slack";
    let head = [
        "scene", "n", "a", "b", "pairs", "distance", "bound a", "bound b", "slack", "verdict",
    ];
    Table::new(caption, &head).with(rows)
}

/// A suite for each scene, method and mesh, and in it a case for each engine, and for each pair and field.
fn suites(outcome: &VerifyOutcome, missing: &[Failure]) -> Vec<Suite> {
    let mut suites: Vec<Suite> = outcome.cases.iter().map(suite).collect();
    let cross = outcome.cross.iter();
    let cross = cross
        .filter_map(|c| Some((c, c.judged?)))
        .map(|(c, judged)| TestCase {
            class: format!("{}.methods", c.scene),
            name: format!(
                "{}{} {} – {} {}",
                c.n.map_or(String::new(), |n| format!("n = {n}: ")),
                c.a.engine,
                c.a.method,
                c.b.engine,
                c.b.method
            ),
            title: None,
            seconds: 0.0,
            verdict: judged.verdict,
            message: format!(
                "distance {:e}, certified bounds {:e} and {:e}, the best on this mesh {:e}",
                judged.distance, judged.bounds[0], judged.bounds[1], judged.best
            ),
        });
    let engines = outcome
        .failures
        .iter()
        .chain(missing)
        .map(|failure| TestCase {
            class: "engines".into(),
            name: failure.engine.clone(),
            title: Some(format!("no answer from {}", failure.engine)),
            seconds: 0.0,
            verdict: Verdict::Undetermined,
            message: failure.message.clone(),
        });
    for (name, cases) in [
        ("methods", cross.collect::<Vec<_>>()),
        ("engines", engines.collect()),
    ] {
        if !cases.is_empty() {
            suites.push(Suite {
                name: name.into(),
                properties: Vec::new(),
                cases,
            });
        }
    }
    suites
}

fn suite(case: &CaseOutcome) -> Suite {
    let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
    // A dot would open a package of its own in the servers' trees.
    let class = format!("{}.{}{n}", case.scene.replace('.', "_"), case.method);
    let test = |name: String, verdict, message| TestCase {
        class: class.clone(),
        name,
        title: None,
        seconds: 0.0,
        verdict,
        message,
    };
    let engines = case.engines.iter().map(|engine| {
        let message = match engine.converged {
            true => format!("its backward error is {}", short(engine.residual)),
            false => format!("it did not converge in {} steps", engine.iterations),
        };
        let name = &engine.engine;
        TestCase {
            title: Some(format!("{}: {name} does not solve the scheme", label(case))),
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
    let versions = case.engines.iter();
    let versions: Vec<String> = versions
        .map(|e| format!("{} {}", e.engine, e.version))
        .collect();
    Suite {
        name: label(case),
        properties: vec![
            ("engines", versions.join(", ")),
            ("mesh", case.mesh_digest.clone()),
            ("faces", case.faces.to_string()),
        ],
        cases,
    }
}
