//! The report of `solve` on a scene of elasticity.

use std::path::Path;

use super::fields::ENCODING;
use super::model::{Block, Report, Table, cells, count, short};
use crate::campaigns::face_off::Solved;
use crate::text::number::{number, whole};
use crate::text::{Text, text};
use faceoff_mesh::error::Result;
use faceoff_mesh::io::vtu;

/// The report of a solution.
///
/// # Errors
/// Only those of a broken installation.
pub fn solve_elastic(of: &Solved) -> Result<Report<'_>> {
    let n = of.n.map_or(String::new(), |n| format!(", n = {n}"));
    let about = format!("{} by {}{n}", of.name, of.engine);
    let headline = format!("solved, {} s", short(of.seconds));
    let mut report = Report::new(
        "solve elastic",
        &format!("faceoff solve: {about}"),
        headline,
        of,
    )?;
    let value = |value: f64| Text::from(number(value, 6));
    let sizes = format!(
        "{}, {} on Γ_C",
        count(of.cells, "cell"),
        count(of.facets, "facet")
    );
    let mut facts: Vec<(Text, Text)> = vec![
        ("mesh".into(), sizes.into()),
        ("max|u|".into(), value(of.largest)),
    ];
    facts.extend(of.error.map(|error| {
        let h1 = error.h1.map(|h1| format!("{} in ∇u, ", short(h1)));
        let words = h1.unwrap_or_default() + &format!("{} in u", short(error.l2));
        ("relative error".into(), words.into())
    }));
    let rows = of.numbers.iter().map(|(name, found)| {
        let exact = found.exact.map_or(Text::from("–"), value);
        cells![name.as_str(), value(found.value), exact]
    });
    let table = Table::new("", ["integral", "value", "exact"]).with(rows);
    report.story.claim = text!("{of.name} is **solved** by {of.engine}");
    report.story.rests_on = text!(
        "{} cells; contact is possible on {} facets.",
        whole(of.cells),
        whole(of.facets)
    );
    report.story.rest = vec![
        Block::Terminal(vec![Block::text(about)]),
        Block::Facts(facts),
        table.into(),
    ];
    report.files.push(Box::new(move |folder| {
        write_elastic(&folder.join(format!("{}.vtu", of.name)), of)
    }));
    Ok(report)
}

/// Writes u and the mean stress of each cell, and into `…-faces.vtu` in the same folder what is known on each facet of Γ_C.
///
/// # Errors
/// Files that cannot be written.
pub fn write_elastic(path: &Path, of: &Solved) -> Result<()> {
    let (cells, facets) = (&of.on_cells, &of.on_facets);
    vtu::write(path, cells, &[], &[], ENCODING)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let path = path.with_file_name(format!("{stem}-faces.vtu"));
    vtu::write(&path, facets, &[], &[], ENCODING)
}
