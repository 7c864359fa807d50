//! `faceoff mesh`: what a file holds, what is wrong with it, and the same in another format or finer.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::args::{Command, Form, Mesh as Arguments, MeshAction};
use super::{DISAGREE, DONE, parse};
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::model::{Block, Report, Suite, Table, TestCase, table};
use crate::report::{Judged, Output, deliver};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::io::{self, Content, Format, Options, msh};
use faceoff_mesh::mesh::check::{Defects, Soundness, check};
use faceoff_mesh::mesh::refine::refine;
use faceoff_mesh::mesh::{CellKind, Mesh};

pub(super) fn run(arguments: &Arguments, to: &Output) -> Result<u8> {
    let python = meshio_python();
    match &arguments.action {
        MeshAction::Info { file, .. } => {
            let info = Info::new(&io::open(file, python.as_deref())?);
            deliver(&info_report(file, &info)?, to)?;
        }
        MeshAction::Check { file, .. } => {
            let found = check(&io::open(file, python.as_deref())?.mesh)?;
            deliver(&check_report(file, &found)?, to)?;
            if !found.is_sound() {
                return Ok(DISAGREE);
            }
        }
        MeshAction::Convert {
            input, out, form, ..
        } => {
            let written = rewrite(input, out, 0, &options(form, out, python)?)?;
            done(&written, vec![input.clone()], to)?;
        }
        MeshAction::Refine {
            input,
            out,
            times,
            form,
            ..
        } => {
            let written = rewrite(input, out, *times, &options(form, out, python)?)?;
            done(&written, vec![input.clone()], to)?;
        }
        MeshAction::Make {
            scene,
            out,
            n,
            trust,
            form,
            ..
        } => {
            let found = trust.scene(scene)?;
            let (_, made) = found.mesh(n.map(|n| n as usize).or(found.source().n()))?;
            let options = options(form, out, python)?;
            let warnings = io::write(out, &made, &options)?;
            let written = Written::new(scene.clone(), out, &made, &options, warnings);
            done(&written, Vec::new(), to)?;
        }
    }
    Ok(DONE)
}

/// Says what was written, and on standard error what did not come along.
fn done(written: &Written, inputs: Vec<PathBuf>, to: &Output) -> Result<()> {
    let title = format!("faceoff {}: {}", to.command, written.of);
    let format = written.format.as_ref();
    let format = format.map_or(String::new(), |f| format!(" as {f}"));
    let headline = format!("{} is written{format}", written.file);
    let mut report = Report::new(to.command, &title, headline, written)?;
    report.inputs = inputs;
    let mut blocks = holds(&written.holds);
    blocks.push(Block::List(written.warnings.clone()));
    report.blocks = vec![Block::Page(blocks)];
    // What is written may be standard output itself.
    let silent = Output {
        quiet: true,
        ..to.clone()
    };
    deliver(&report, &silent)?;
    for warning in written.warnings.iter().filter(|_| !to.quiet) {
        note!("faceoff: warning: {warning}");
    }
    Ok(())
}

/// The options of `faceoff mesh convert` as one types them; `python` is an interpreter that has meshio.
///
/// # Errors
/// Options that there are not, or that do not go together.
pub fn options_of(words: &[String], out: &Path, python: Option<PathBuf>) -> Result<Options> {
    let before = ["mesh", "convert"].map(Into::into).into_iter();
    let words = before.chain(words.iter().map(Into::into));
    let words = words.chain(["--".into(), "-".into(), out.as_os_str().to_owned()]);
    match parse(words)?.command {
        Command::Mesh(Arguments {
            action: MeshAction::Convert { form, .. },
        }) => options(&form, out, python),
        _ => Err(Error::usage(
            "this writes nothing",
            "give options of mesh convert",
        )),
    }
}

fn options(form: &Form, out: &Path, python: Option<PathBuf>) -> Result<Options> {
    let format = form.format.as_deref().map(|name| {
        Format::of_name(name).ok_or_else(|| {
            Error::usage(
                format!("there is no format `{name}`"),
                format!("use {}, or a name of meshio's", io::native_names()),
            )
        })
    });
    let msh_version = match form.msh_version.as_str() {
        "2.2" | "2" => msh::Version::V22,
        "4.1" | "4" => msh::Version::V41,
        other => {
            return Err(Error::usage(
                format!("MSH {other} is not written"),
                "use --msh-version 2.2 or 4.1",
            ));
        }
    };
    let format = format.transpose()?;
    let encoding = form.encoding.as_deref();
    let for_vtu = encoding.filter(|name| !["ascii", "binary"].contains(name));
    let target = format.or_else(|| Format::of_suffix(out));
    if let (Some(name), Some(target)) = (for_vtu, target)
        && ![Format::VTU, Format::VTP].contains(&target)
    {
        vtu_encoding(encoding)?;
        return Err(Error::usage(
            format!("{target} has no encoding `{name}`"),
            "use ascii or binary",
        ));
    }
    Ok(Options {
        format,
        msh_version,
        binary: encoding == Some("binary"),
        vtu: vtu_encoding(encoding)?,
        lossy: form.lossy,
        python,
    })
}

fn vtu_encoding(name: Option<&str>) -> Result<Encoding> {
    let Some(name) = name.filter(|name| *name != "binary") else {
        return Ok(Options::default().vtu);
    };
    let (form, compressor) = name.split_once('-').unwrap_or((name, "none"));
    let compressor = match compressor {
        "none" => Some(Compressor::None),
        "zlib" => Some(Compressor::Zlib),
        "lz4" => Some(Compressor::Lz4),
        "lzma" => Some(Compressor::Lzma),
        _ => None,
    };
    match (form, compressor) {
        ("ascii", Some(Compressor::None)) => Ok(Encoding::Ascii),
        ("base64", Some(compressor)) => Ok(Encoding::Base64(compressor)),
        ("raw", Some(compressor)) => Ok(Encoding::Raw(compressor)),
        _ => Err(Error::usage(
            format!("there is no encoding `{name}`"),
            "use ascii, binary (MSH, VTK), base64 or raw (VTU, VTP), the latter two also with -zlib, -lz4 or -lzma",
        )),
    }
}

fn info_report<'a>(file: &Path, info: &'a Info) -> Result<Report<'a>> {
    let version = info.version.as_deref().unwrap_or("");
    let about = format!(
        "{}: {} {version}, {}",
        file.display(),
        info.format,
        info.encoding
    );
    let question = "faceoff mesh info: what is in a file?";
    let mut report = Report::new("mesh info", question, "", info)?;
    report.blocks.push(Block::Text(about));
    report.blocks.extend(holds(&info.holds));
    let warnings = info.warnings.iter().map(|what| format!("warning: {what}"));
    report.blocks.push(Block::List(warnings.collect()));
    report.inputs.push(file.to_owned());
    Ok(report)
}

fn holds<'a>(holds: &Holds) -> Vec<Block<'a>> {
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
    let mut blocks = vec![Block::facts(
        counts.map(|(n, count)| (n, count.to_string())),
    )];
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
    );
    let tables = [groups, fields].into_iter();
    blocks.extend(tables.filter(|of| !of.rows.is_empty()).map(Table::into));
    blocks
}

fn check_report<'a>(file: &Path, found: &'a Soundness) -> Result<Report<'a>> {
    let kinds: [(&str, &Defects); 8] = [
        ("inverted cells", &found.inverted),
        ("degenerate cells", &found.degenerate),
        ("duplicate cells", &found.duplicate),
        ("orphan points", &found.orphans),
        ("faces with more than two cells", &found.crowded_faces),
        ("hanging nodes", &found.hanging_nodes),
        ("boundary faces in no group", &found.ungrouped_boundary),
        ("parts that are not connected", &found.parts),
    ];
    // One part is as it should be.
    let least = |what: &str| usize::from(what.starts_with("parts"));
    let odd = kinds
        .iter()
        .filter(|(what, findings)| findings.count > least(what));
    let words: Vec<String> = odd
        .clone()
        .map(|(what, f)| format!("{} {what}", f.count))
        .collect();
    let headline = match (words.is_empty(), found.is_sound()) {
        (true, _) => "nothing is wrong".to_owned(),
        (_, true) => format!("sound, with {}", words.join(", ")),
        _ => words.join(", "),
    };
    let (verdict, word) = match found.is_sound() {
        true => (Verdict::Agree, "sound"),
        false => (Verdict::Disagree, "unsound"),
    };
    let title = format!("faceoff mesh check: is {} sound?", file.display());
    let judged = Judged { verdict, found };
    let mut report = Report::new("mesh check", &title, headline, &judged)?;
    report.verdict = Some((verdict, word));
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    report.claim = format!("**{name}** is {word}");
    report.lede = match words.is_empty() {
        true => "No cell is inverted, degenerate or there twice, no point is left over, and every boundary face is in a group.".into(),
        false => format!("It has **{}**.", words.join("**, **")),
    };
    report.inputs.push(file.to_owned());
    for (what, findings) in odd {
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
        report.blocks.push(found.into());
    }
    let angles = [
        ("smallest angle", &found.smallest_angle),
        ("largest angle", &found.largest_angle),
    ];
    let angles = angles.into_iter().filter_map(|(what, angle)| {
        let a = angle.as_ref()?;
        let place = format!("{:.1}° in cell {} at {:?}", a.degrees, a.cell, a.at);
        Some((what, place))
    });
    report.blocks.push(Block::facts(angles));
    let (name, message) = (file.display().to_string(), report.headline.clone());
    let case = TestCase::new("mesh", name, verdict, message);
    report.suites.push(Suite::new("mesh check", [case]));
    Ok(report)
}

/// What `mesh info` tells; its JSON form is a contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Info {
    /// The name of a native format, or `other`.
    format: String,
    version: Option<String>,
    encoding: String,
    #[serde(flatten)]
    holds: Holds,
    warnings: Vec<String>,
}

/// What a mesh holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Holds {
    /// All points of the file, those of no cell included.
    points: usize,
    vertices: usize,
    lines: usize,
    triangles: usize,
    tetrahedra: usize,
    /// Number of cells of each other type.
    other_cells: BTreeMap<String, usize>,
    groups: Vec<GroupInfo>,
    fields: Vec<FieldInfo>,
}

/// What `mesh convert`, `refine` and `make` wrote.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Written {
    /// The file that it was made of, or the scene.
    of: String,
    file: String,
    /// None where meshio knows it by the suffix.
    format: Option<String>,
    #[serde(flatten)]
    holds: Holds,
    /// What did not come along.
    warnings: Vec<String>,
}

impl Written {
    /// A mesh that was written to `file`.
    fn new(of: String, file: &Path, mesh: &Mesh, options: &Options, warnings: Vec<String>) -> Self {
        let format = options.format.or_else(|| Format::of_suffix(file));
        Written {
            of,
            file: file.display().to_string(),
            format: format.map(|format| format.to_string()),
            holds: Holds::new(mesh),
            warnings,
        }
    }
}

/// A group in a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct GroupInfo {
    dim: u8,
    tag: i64,
    /// Empty for a group without a name.
    name: String,
    /// Number of its cells.
    cells: usize,
}

/// A field on a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct FieldInfo {
    name: String,
    /// `points`, `cells` or `cell points`.
    on: String,
    components: usize,
}

impl Holds {
    fn new(mesh: &Mesh) -> Self {
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
        let fields = mesh.fields.iter().map(|field| FieldInfo {
            name: field.name.clone(),
            on: field.on.to_string(),
            components: field.components,
        });
        Holds {
            points: mesh.points.len(),
            vertices: mesh.count(CellKind::Vertex),
            lines: mesh.count(CellKind::Line),
            triangles: mesh.count(CellKind::Triangle),
            tetrahedra: mesh.count(CellKind::Tetrahedron),
            other_cells,
            groups: groups.collect(),
            fields: fields.collect(),
        }
    }
}

impl Info {
    fn new(content: &Content) -> Self {
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
            holds: Holds::new(&content.mesh),
            warnings,
        }
    }
}

/// What is in one file, red-refined so many times, in another. The warnings say what did not come along, which only
/// `options.lossy` allows.
///
/// # Errors
/// A file cannot be read or written, a mesh that is refined has other cells than simplices of first order, or something
/// would be lost.
fn rewrite(input: &Path, output: &Path, times: u32, options: &Options) -> Result<Written> {
    let content = io::open(input, options.python.as_deref())?;
    let unread = unread(&content);
    if !unread.is_empty() && !options.lossy {
        let what = content.unread.join("; ");
        return Err(Error::file(
            input,
            Place::Whole,
            format!("not everything in it can be read: {what}"),
            "allow the loss with --lossy",
        ));
    }
    let mut warnings = [content.warnings, unread].concat();
    let (mut mesh, of) = (content.mesh, input.display().to_string());
    for _ in 0..times {
        let (fine, left_out) = refine(&of, &mesh)?;
        if !left_out.is_empty() && !options.lossy {
            return Err(Error::usage(
                format!("refining {of} loses {}", left_out.join(", ")),
                "allow the loss with --lossy",
            ));
        }
        let left_out = left_out.into_iter();
        warnings.extend(left_out.map(|what| format!("not in the refined mesh: {what}")));
        mesh = fine;
    }
    warnings.extend(io::write_with(output, &mesh, &content.whole, options)?);
    Ok(Written::new(of, output, &mesh, options, warnings))
}

/// What the reader left behind.
fn unread(content: &Content) -> Vec<String> {
    let unread = content.unread.iter();
    unread.map(|what| format!("not read: {what}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name)
    }

    #[test]
    fn info_is_what_the_contract_says() {
        let content = io::open(&data("square-2.2-binary.msh"), None).expect("a sound mesh");
        let info = Info::new(&content);
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

    #[test]
    fn convert_check_and_refine() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("fine.mesh");
        let options = Options {
            lossy: true,
            ..Options::default()
        };
        rewrite(&data("square-4.1.msh"), &out, 2, &options).expect("refined");
        let content = io::open(&out, None).expect("a sound mesh");
        let report = check(&content.mesh).unwrap();
        assert!(report.is_sound(), "{report:?}");
        assert_eq!(report.ungrouped_boundary.count, 0);
        let info = Info::new(&content);
        assert_eq!(
            (info.format.as_str(), info.holds.triangles, info.holds.lines),
            ("medit", 14 * 16, 8 * 4)
        );
        let back = folder.path().join("back.msh");
        let written = rewrite(&out, &back, 0, &Options::default());
        let written = written.expect("MSH holds what Medit does");
        assert!(written.warnings.is_empty(), "{written:?}");
        assert_eq!(written.holds.triangles, 14 * 16);
    }
}
