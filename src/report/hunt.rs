//! What a hunt found: a line for each fault, and the smallest form that shows it.

use std::path::Path;

use super::json::Judged;
use super::model::{Block, Report, Suite, TestCase, Todo, count, duration, table};
use crate::campaigns::hunt::{Finding, HuntOutcome};
use crate::text::number::whole;
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;

/// The report of a hunt, whose findings are in a folder.
///
/// # Errors
/// None but of a broken installation.
pub fn hunt<'a>(outcome: &'a HuntOutcome, folder: Option<&Path>) -> Result<Report<'a>> {
    let question = match outcome.files {
        true => "faceoff hunt: which library changes a mesh that it writes or reads?",
        false => "faceoff hunt: which code is wrong on some weak form?",
    };
    let verdict = outcome.verdict();
    let mut report = Report::judging(
        "hunt",
        question,
        verdict,
        &Judged {
            verdict,
            found: outcome,
        },
    )?;
    let found = outcome.findings.len();
    let problems = count(outcome.problems, "problem");
    let headline = match found {
        0 => format!("nothing was found in {problems}"),
        _ => format!("{} in {problems}", count(found, "fault")),
    };
    report.headline = headline.clone().into();
    report.story.claim = text!("**{headline}**");
    let drawn = text!(
        "{} of {}, drawn with seed {}, in {}: {} agree, {} differ only by rounding, {} could not be judged. ",
        problems.clone(),
        match outcome.files {
            true => "as many meshes".to_owned(),
            false => count(outcome.forms, "form"),
        },
        outcome.seed.to_string(),
        outcome.engines.join(", "),
        outcome.agree.to_string(),
        outcome.conditioned.to_string(),
        outcome.refused.to_string()
    );
    let how = match outcome.files {
        true => text!(
            "Each library writes each mesh in one format, and every library reads the file; what differs from what was drawn is a finding, \
             except where the library refuses with a message or the format cannot hold it."
        ),
        false => text!(
            "Every answer that differs was put into its form; images of problems (renumbered, regrouped, mirrored, turned, in other units) must have \
             the same fields, and terms that are doubled or halved the same integrals."
        ),
    };
    report.story.rests_on = Text::joined([drawn, how], "");
    let findings = outcome.findings.iter();
    let rows = findings.clone().map(|of| {
        (
            of.code.clone(),
            of.kind.words(),
            of.cause.clone(),
            whole(of.first),
            whole(of.times),
            Text::message(&of.words),
        )
    });
    if found > 0 {
        let table = table!("", rows, |row|
            "code" => row.0,
            "does" => row.1,
            "cause" => row.2,
            "first in problem" => row.3,
            "problems" => row.4,
            "what was found" => row.5
        );
        report
            .story
            .rest
            .push(Block::Titled("Faults".into(), table));
    }
    for (k, finding) in outcome.findings.iter().enumerate() {
        report.story.rest.push(Block::Page(vec![
            Block::heading(2, format!("{} {}", finding.name(k), finding.kind.words())),
            Block::text(Text::message(&finding.words)),
            Block::text(format!(
                "The smallest case that was found, on {}:",
                finding.mesh
            )),
            Block::Commands(vec![finding.form.clone()]),
        ]));
    }
    if let (Some(folder), Some(first)) = (folder, outcome.findings.first()) {
        let again = match outcome.files {
            true => format!(
                "faceoff hunt --files --seed {} --count {}",
                outcome.seed, first.first
            ),
            false => format!(
                "faceoff verify {}",
                folder.join(first.name(0)).join(&first.file).display()
            ),
        };
        report
            .story
            .next
            .push(Todo::new("Run the first of them again", [again]));
    }
    let cases = outcome.engines.iter().map(|code| {
        let wrong: Vec<&Finding> = outcome
            .findings
            .iter()
            .filter(|of| of.is_of(code))
            .collect();
        let words: Vec<&str> = wrong.iter().map(|of| &*of.words).collect();
        let verdict = match (wrong.is_empty(), verdict) {
            (false, _) => Verdict::Disagree,
            (true, Verdict::Undetermined) => Verdict::Undetermined,
            (true, _) => Verdict::Agree,
        };
        TestCase::new("hunt", code.clone(), verdict, words.join("; "))
    });
    report.suites.push(Suite::new("hunt", cases));
    let took = duration(outcome.seconds).text();
    report.notes.push(text!("It took {took}."));
    Ok(report)
}
