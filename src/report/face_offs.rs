//! The report of `verify` on several face-off files: scenes of elasticity, each by several methods.

use super::face_off::{QUESTION, claim, farthest, tell};
use super::model::{Block, Report, Table, cells};
use crate::campaigns::face_off::FaceOffs;
use crate::text::number::{size, whole};
use crate::text::text;
use faceoff_mesh::error::Result;

/// The report of several face-off files.
///
/// # Errors
/// Only those of a broken installation.
pub fn face_offs(all: &FaceOffs) -> Result<Report<'_>> {
    let mut report = Report::judging("face-offs", QUESTION, all.verdict, all)?;
    // One that does not agree decides for all.
    let claim = match all.face_offs.iter().find(|of| of.verdict == all.verdict) {
        Some(worst) if !all.verdict.passes() => claim(worst),
        _ => text!(
            "all codes **agree** in {} face-offs",
            whole(all.face_offs.len())
        ),
    };
    let passed = all.face_offs.iter().filter(|of| of.verdict.passes());
    let rests_on = text!(
        "{} of {} face-offs agree.",
        whole(passed.count()),
        whole(all.face_offs.len())
    );
    let mut rest = Vec::new();
    let head = [
        "face-off",
        "fields and numbers",
        "largest difference",
        "verdict",
    ];
    let rows = all.face_offs.iter().map(|of| {
        let names = of.fields.iter().map(|field| &*field.field);
        let names = names.chain(of.numbers.iter().map(|number| &*number.number));
        let largest = farthest(of).map(|(_, pair)| size(pair.compared.field.max_rel));
        cells![
            of.name.as_str(),
            names.collect::<Vec<_>>().join(", "),
            largest.map_or(text!("–"), |size| text!("{size}")),
            of.verdict.word()
        ]
    });
    rest.push(Table::new("", head).with(rows).into());
    for of in &all.face_offs {
        let mut own = Report::judging("face-off", QUESTION, of.verdict, of)?;
        tell(of, &mut own);
        rest.push(Block::Heading(2, text!("{of.name}")));
        rest.push(Block::Text(own.story.claim));
        rest.push(Block::Text(own.story.rests_on));
        rest.extend(own.story.picture.into_iter().take(1));
        rest.extend(own.story.rest);
        report.story.next.extend(own.story.next);
        report.notes.extend(own.notes);
        report.suites.extend(own.suites);
    }
    report.story.claim = claim;
    report.story.rests_on = rests_on;
    report.story.rest = rest;
    Ok(report)
}
