//! The contents of a mesh file, and its faults.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::html::mesh::{drawn, located};
use super::model::{Block, Cell, Report, Suite, Table, TestCase, table};
use crate::text::number::{number, place, trimmed};
use crate::text::{Text, text};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Unread;
use faceoff_mesh::io::{self, Content};
use faceoff_mesh::mesh::check::{Defects, Soundness};
use faceoff_mesh::mesh::quality::{Bin, Quality};
use faceoff_mesh::mesh::{CellKind, Mesh};

/// The report of `mesh info`.
///
/// # Errors
/// Only those of a broken installation.
pub fn info_report<'a>(file: &Path, info: &'a Info, mesh: &'a Mesh) -> Result<Report<'a>> {
    let version = info.version.as_deref().unwrap_or("");
    let about = format!(
        "{}: {} {version}, {}",
        file.display(),
        info.format,
        info.encoding
    );
    let question = "faceoff mesh info: what is in a file?";
    let mut report = Report::new("mesh info", question, "", info)?;
    report.story.rest.push(Block::text(about));
    report.story.rest.extend(holds(&info.holds));
    let drawn = Block::Drawn(Box::new(|| drawn(mesh)));
    report.story.rest.push(Block::Page(vec![drawn]));
    if let [first, .., last] = info.times[..] {
        let count = info.times.len();
        let times = format!("{count}, from {first} to {last}");
        report.story.rest.push(Block::facts([("times", times)]));
    }
    let warnings = info.warnings.iter().map(|what| format!("warning: {what}"));
    report.story.rest.push(Block::list(warnings));
    report.inputs.push(file.to_owned());
    Ok(report)
}

/// The contents of a mesh, as tables.
pub fn holds<'a>(holds: &Holds) -> Vec<Block<'a>> {
    let own = [
        ("points", holds.points),
        ("vertices", holds.vertices),
        ("lines", holds.lines),
        ("triangles", holds.triangles),
        ("tetrahedra", holds.tetrahedra),
    ];
    let own = own.into_iter();
    let counts = own.filter(|(name, count)| *name == "points" || *count > 0);
    let others = holds.other_cells.iter();
    let counts = counts.chain(others.map(|(name, count)| (name.as_str(), *count)));
    let counts = counts.map(|(n, count)| (n.to_owned(), count.to_string()));
    let sides = holds.r#box.iter().flat_map(|[low, high]| {
        let side = |k: usize| format!("{} to {}", low[k], high[k]);
        [0, 1, 2].map(|k| (["x", "y", "z"][k].to_owned(), side(k)))
    });
    let order = holds.order.filter(|order| *order > 1);
    let order = order.map(|order| ("order of the cells".to_owned(), order.to_string()));
    let mut blocks = vec![Block::facts(counts.chain(order).chain(sides))];
    let groups = table!("", &holds.groups, |g|
        "group" => g.tag.to_string(),
        "name" => &g.name,
        "dimension" => usize::from(g.dim),
        "cells" => g.cells,
    );
    let fields = table!("", &holds.fields, |f|
        "field" => &f.name,
        "on" => &f.on,
        "components" => f.components,
        "least" => range(f.least),
        "largest" => range(f.largest),
        "not finite" => f.not_finite,
        "times" => f.times,
    );
    let tables = [groups, fields].into_iter();
    blocks.extend(tables.filter(|of| !of.rows.is_empty()).map(Table::into));
    blocks
}

/// Something that a mesh should not have: its name, how often it occurs, the largest number that is not a fault, and whether it
/// belongs to single cells.
type Kind<'a> = (&'static str, &'a Defects, usize, bool);

/// A number in a table, or a text if there is none.
fn range(value: Option<f64>) -> Cell {
    match value {
        Some(value) => Cell::number(value, value.to_string()),
        None => "–".into(),
    }
}

/// The report of `mesh check`.
///
/// # Errors
/// Only those of a broken installation.
pub fn check_report<'a>(file: &Path, checked: &'a Checked) -> Result<Report<'a>> {
    let Checked { found, content } = checked;
    let mesh = &content.mesh;
    let kinds: [Kind; 10] = [
        ("cells that curved sides fold over", &found.folded, 0, true),
        (
            "points at the place of another",
            &found.duplicate_points,
            0,
            true,
        ),
        ("inverted cells", &found.inverted, 0, true),
        ("degenerate cells", &found.degenerate, 0, true),
        ("duplicate cells", &found.duplicate, 0, true),
        ("orphan points", &found.orphans, 0, true),
        (
            "faces with more than two cells",
            &found.crowded_faces,
            0,
            true,
        ),
        ("hanging nodes", &found.hanging_nodes, 0, true),
        (
            "boundary faces in no group",
            &found.ungrouped_boundary,
            0,
            false,
        ),
        // One part is normal.
        ("parts that are not connected", &found.parts, 1, false),
    ];
    let odd = kinds
        .iter()
        .filter(|(_, findings, most, _)| findings.count > *most);
    let words = odd.clone();
    let words = words.map(|(what, findings, ..)| format!("{} {what}", findings.count));
    let mut words: Vec<String> = words.collect();
    let verdict = checked.verdict();
    if !content.unread.is_empty() {
        words.push(match content.unread.len() {
            1 => "1 part that was not read".to_owned(),
            several => format!("{several} parts that were not read"),
        });
    }
    if !content.warnings.is_empty() {
        words.push(match content.warnings.len() {
            1 => "1 oddity".to_owned(),
            several => format!("{several} oddities"),
        });
    }
    let headline = match (words.is_empty(), verdict) {
        (true, _) => "nothing is wrong".to_owned(),
        (_, Verdict::Agree) => format!("sound, with {}", words.join(", ")),
        _ => words.join(", "),
    };
    let word = match (verdict, found.is_sound()) {
        (Verdict::Agree, _) => "sound",
        (_, true) => "not read completely",
        (_, false) => "unsound",
    };
    let title = format!("faceoff mesh check: is {} sound?", file.display());
    let found = FoundAndUnread {
        verdict,
        found,
        unread: &content.unread,
        warnings: &content.warnings,
    };
    let mut report = Report::new("mesh check", &title, headline, &found)?;
    let found = &checked.found;
    report.verdict = Some((verdict, word));
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    report.story.claim = text!("**{}** is {word}", &*name);
    report.story.rests_on = match words.is_empty() {
        true => "No cell is inverted, degenerate or there twice, no point is left over, and every boundary face is in a group.".into(),
        false => text!("It has {}.", Text::joined(words.into_iter().map(Text::strong), ", ")),
    };
    report.inputs.push(file.to_owned());
    for (what, findings, ..) in odd {
        let more = match findings.count > findings.first.len() {
            true => ", the first of them",
            false => "",
        };
        let caption = format!("{what}: {}{more}", findings.count);
        let found = table!(caption, &findings.first, |f|
            "cells" => format!("{:?}", f.cells),
            "points" => format!("{:?}", f.points),
            "at" => format!("{:?}", f.at),
        );
        report.story.rest.push(found.into());
    }
    if !content.unread.is_empty() {
        let caption = format!("parts that were not read: {}", content.unread.len());
        let table = table!(caption, &content.unread, |part|
            "name" => &part.name,
            "what" => &part.what,
        );
        report.story.rest.push(table.into());
    }
    let warnings = content.warnings.iter();
    let warnings: Vec<String> = warnings.map(|what| format!("warning: {what}")).collect();
    if !warnings.is_empty() {
        report.story.rest.push(Block::list(warnings));
    }
    report
        .story
        .rest
        .extend(found.quality.iter().flat_map(quality));
    let worst = found.quality.iter();
    let worst = worst.filter_map(|of| Some(of.worst.first()?.at));
    let of_cells = kinds.iter().filter(|(.., is_of_cells)| *is_of_cells);
    let first = of_cells.filter_map(|(_, findings, ..)| Some(findings.first.first()?.at));
    let worst: Vec<[f64; 3]> = worst.chain(first).collect();
    let drawn = Block::Drawn(Box::new(move || located(mesh, &worst)));
    report.story.rest.push(Block::Page(vec![drawn]));
    let (name, message) = (file.display().to_string(), report.headline.to_string());
    let case = TestCase::new("mesh", name, verdict, message);
    report.suites.push(Suite::new("mesh check", [case]));
    Ok(report)
}

/// The contents of a file, and the faults of its mesh.
pub struct Checked {
    /// Of the mesh.
    pub found: Soundness,
    /// Of the file.
    pub content: Content,
}

impl Checked {
    /// A file of which a part was not read is not sound, whatever the rest of it is.
    pub fn verdict(&self) -> Verdict {
        match self.found.is_sound() && self.content.unread.is_empty() {
            true => Verdict::Agree,
            false => Verdict::Disagree,
        }
    }
}

/// The JSON form of [`Checked`].
#[derive(Serialize)]
struct FoundAndUnread<'a> {
    verdict: Verdict,
    #[serde(flatten)]
    found: &'a Soundness,
    /// Parts of the file.
    unread: &'a [Unread],
    /// Oddities of the file that lose no data.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    warnings: &'a [String],
}

/// How a measure is distributed, and the worst cells.
fn quality<'a>(of: &Quality) -> [Block<'a>; 2] {
    let most = of.bins.iter().map(|bin| bin.cells).max();
    let most = most.unwrap_or(0).max(1);
    let bar = |cells: usize| "█".repeat((cells * BAR).div_ceil(most));
    let digits = |value: f64| trimmed(&number(value, 4));
    let [least, mean, largest] = [of.least, of.mean, of.largest].map(digits);
    let caption = format!("{}: {least} to {largest}, {mean} in the mean", of.what);
    let some = |bin: &&Bin| bin.cells > 0;
    let bins = table!(caption, of.bins.iter().filter(some), |bin|
        "from" => Cell::number(bin.from, digits(bin.from)),
        "to" => Cell::number(bin.to, digits(bin.to)),
        "cells" => bin.cells,
        "" => bar(bin.cells),
    );
    let worst = of.worst.first().map(|worst| {
        let (value, at) = (digits(worst.value), place(&worst.at));
        let told = format!("{value} in cell {} at {at}", worst.cell);
        (format!("worst {}", of.what), told)
    });
    [bins.into(), Block::facts(worst)]
}

/// The longest bar of a histogram, in characters.
const BAR: usize = 40;

/// The result of `mesh info`; its JSON form is a contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// The name of a native format, or `other`.
    pub format: String,
    /// The version of the format, if the file states one.
    pub version: Option<String>,
    /// `ascii`, `binary-little`, `binary-big`, or the format's name for it.
    pub encoding: String,
    /// Ascending; empty if the file has none.
    pub times: Vec<f64>,
    /// The contents.
    #[serde(flatten)]
    pub holds: Holds,
    /// Oddities of the file, and what was not read.
    pub warnings: Vec<String>,
    /// Parts of the file that were not read.
    pub unread: Vec<Unread>,
}

/// The contents of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Holds {
    /// The number of all points of the file, including those of no cell.
    pub points: usize,
    /// The number of cells of one vertex.
    pub vertices: usize,
    /// The number of cells of two vertices.
    pub lines: usize,
    /// The number of cells of three vertices.
    pub triangles: usize,
    /// The number of cells of four vertices.
    pub tetrahedra: usize,
    /// Number of cells of each other type.
    pub other_cells: BTreeMap<String, usize>,
    /// The highest degree of the cells, if it is known.
    pub order: Option<usize>,
    /// The least and the largest coordinates of the points; `None` without points.
    pub r#box: Option<[[f64; 3]; 2]>,
    /// In the order of the mesh.
    pub groups: Vec<GroupInfo>,
    /// By name and kind of entity.
    pub fields: Vec<FieldInfo>,
}

/// A group in a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupInfo {
    /// The dimension of its cells.
    pub dim: u8,
    /// Its number.
    pub tag: i64,
    /// Empty for a group without a name.
    pub name: String,
    /// Number of its cells.
    pub cells: usize,
}

/// A field on a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldInfo {
    /// The name in the file.
    pub name: String,
    /// `points`, `cells` or `cell points`.
    pub on: String,
    /// The number of values per entity.
    pub components: usize,
    /// The least of its finite values at all times; `None` if there is none.
    pub least: Option<f64>,
    /// The largest of them.
    pub largest: Option<f64>,
    /// The number of values that are infinite or NaN.
    pub not_finite: usize,
    /// The number of its times; 1 if it has no time.
    pub times: usize,
}

impl Holds {
    /// Counts, and the ranges of points and fields.
    pub fn new(mesh: &Mesh) -> Self {
        let named = [
            CellKind::Vertex,
            CellKind::Line,
            CellKind::Triangle,
            CellKind::Tetrahedron,
        ];
        let mut other_cells = BTreeMap::new();
        let others = mesh.blocks.iter().filter(|b| !named.contains(&b.kind));
        for block in others {
            *other_cells.entry(block.kind.to_string()).or_insert(0) += block.len();
        }
        let groups = mesh.groups.iter().map(|group| GroupInfo {
            dim: group.dim,
            tag: group.tag,
            name: group.name.clone().unwrap_or_default(),
            cells: group.cells.len(),
        });
        let ends = mesh.points.iter().map(|x| [*x, *x]).reduce(|a, b| {
            let of =
                |k: usize, take: fn(f64, f64) -> f64| [0, 1, 2].map(|i| take(a[k][i], b[k][i]));
            [of(0, f64::min), of(1, f64::max)]
        });
        Holds {
            points: mesh.points.len(),
            vertices: mesh.count(CellKind::Vertex),
            lines: mesh.count(CellKind::Line),
            triangles: mesh.count(CellKind::Triangle),
            tetrahedra: mesh.count(CellKind::Tetrahedron),
            other_cells,
            order: mesh
                .blocks
                .iter()
                .filter_map(|block| block.kind.order())
                .max(),
            r#box: ends,
            groups: groups.collect(),
            fields: fields(mesh),
        }
    }
}

/// The fields by name and support, each at all of its times.
fn fields(mesh: &Mesh) -> Vec<FieldInfo> {
    let mut all: Vec<FieldInfo> = Vec::new();
    for field in &mesh.fields {
        let values = field.values.to_f64();
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let one = FieldInfo {
            name: field.name.clone(),
            on: field.on.to_string(),
            components: field.components,
            least: finite().reduce(f64::min),
            largest: finite().reduce(f64::max),
            not_finite: values.len() - finite().count(),
            times: 1,
        };
        let same = |known: &&mut FieldInfo| {
            (&known.name, &known.on, known.components) == (&one.name, &one.on, one.components)
        };
        match all.iter_mut().find(same).filter(|_| field.time.is_some()) {
            None => all.push(one),
            Some(known) => {
                let both = [known.least, one.least].into_iter().flatten();
                known.least = both.reduce(f64::min);
                let both = [known.largest, one.largest].into_iter().flatten();
                known.largest = both.reduce(f64::max);
                known.not_finite += one.not_finite;
                known.times += 1;
            }
        }
    }
    all
}

impl Info {
    /// From a file's contents; `times` are those of all of its series.
    pub fn new(content: &Content, times: Vec<f64>) -> Self {
        let mut warnings = [content.warnings.clone(), unread(content)].concat();
        let mut own = io::NATIVE.iter().map(|format| format.names[0]);
        let own = own.find(|own| *own == content.format);
        if own.is_none() {
            warnings.push(format!("read by meshio as {}", content.format));
        }
        Info {
            format: own.unwrap_or("other").to_owned(),
            version: content.version.clone(),
            encoding: content.encoding.clone(),
            times,
            holds: Holds::new(&content.mesh),
            warnings,
            unread: content.unread.clone(),
        }
    }
}

/// The parts that the reader skipped.
pub fn unread(content: &Content) -> Vec<String> {
    let unread = content.unread.iter();
    unread.map(|part| format!("not read: {part}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn info_is_what_the_contract_says() {
        let content = io::open(
            Path::new(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/tests/data/square-2.2-binary.msh"
            )),
            None,
        )
        .expect("a sound mesh");
        let info = Info::new(&content, Vec::new());
        let json = serde_json::to_value(&info).expect("JSON");
        assert_eq!(json["format"], "msh");
        assert_eq!(json["version"], "2.2");
        assert_eq!(json["encoding"], "binary-little");
        let counts = ["points", "vertices", "lines", "triangles", "tetrahedra"]
            .map(|key| json[key].as_u64());
        assert_eq!(counts, [12, 1, 8, 14, 0].map(Some));
        assert_eq!(
            json["groups"][1],
            serde_json::json!({"dim": 1, "tag": 1, "name": "bottom side", "cells": 2})
        );
        assert_eq!(json["other_cells"], serde_json::json!({}));
        assert_eq!(json["warnings"], serde_json::json!([]));
    }
}
