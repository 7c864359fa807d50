//! `faceoff mesh`: from arguments to files and text.

use std::path::{Path, PathBuf};

use super::args::{Form, Mesh, MeshAction};
use super::{DISAGREE, DONE, mesh};
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::model::{Block, Report, Suite, Table, TestCase, cells};
use crate::report::{Judged, Output, deliver};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::check::{Findings, Report as Found};

pub(super) fn run(arguments: &Mesh, to: &Output) -> Result<u8> {
    let python = meshio_python();
    match &arguments.action {
        MeshAction::Info { file, .. } => {
            let info = mesh::info(file, python.as_deref())?;
            deliver(&info_report(file, &info)?, to)?;
        }
        MeshAction::Check { file, .. } => {
            let found = mesh::check(file, python.as_deref())?;
            let report = check_report(file, &found)?;
            deliver(&report, to)?;
            if !found.is_sound() {
                return Ok(DISAGREE);
            }
        }
        MeshAction::Convert {
            input, out, form, ..
        } => {
            let written = mesh::convert(input, out, &options(form, out, python)?)?;
            done(&written, vec![input.clone()], to)?;
        }
        MeshAction::Refine {
            input,
            out,
            times,
            form,
            ..
        } => {
            let written = mesh::refine(input, out, *times, &options(form, out, python)?)?;
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
            let written = mesh::Written::new(scene.clone(), out, &made, &options, warnings);
            done(&written, Vec::new(), to)?;
        }
    }
    Ok(DONE)
}

/// Says what was written, and on standard error what did not come along.
fn done(written: &mesh::Written, inputs: Vec<PathBuf>, to: &Output) -> Result<()> {
    let title = format!("faceoff {}: {}", to.command, written.of);
    let format = written
        .format
        .as_ref()
        .map_or(String::new(), |f| format!(" as {f}"));
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
        && target != Format::VTU
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
            "use ascii, binary (MSH), base64 or raw (VTU), the latter two also with -zlib, -lz4 or -lzma",
        )),
    }
}

fn info_report<'a>(file: &Path, info: &'a mesh::Info) -> Result<Report<'a>> {
    let version = info.version.as_deref().unwrap_or("");
    let about = format!(
        "{}: {} {version}, {}",
        file.display(),
        info.format,
        info.encoding
    );
    let mut report = Report::new(
        "mesh info",
        "faceoff mesh info: what is in a file?",
        "",
        info,
    )?;
    report.blocks.push(Block::Text(about));
    report.blocks.extend(holds(&info.holds));
    let warnings = info
        .warnings
        .iter()
        .map(|warning| format!("warning: {warning}"));
    report.blocks.push(Block::List(warnings.collect()));
    report.inputs.push(file.to_owned());
    Ok(report)
}

fn holds<'a>(holds: &mesh::Holds) -> Vec<Block<'a>> {
    let own = [
        ("points", holds.points),
        ("vertices", holds.vertices),
        ("lines", holds.lines),
        ("triangles", holds.triangles),
        ("tetrahedra", holds.tetrahedra),
    ];
    let others = holds
        .other_cells
        .iter()
        .map(|(name, count)| (name.as_str(), *count));
    let counts = own
        .into_iter()
        .filter(|(name, count)| *name == "points" || *count > 0);
    let facts = counts
        .chain(others)
        .map(|(name, count)| (name.to_owned(), count.to_string()));
    let mut blocks = vec![Block::Facts(facts.collect())];
    let groups = holds
        .groups
        .iter()
        .map(|g| cells![g.tag.to_string(), &g.name, usize::from(g.dim), g.cells]);
    let fields = holds
        .fields
        .iter()
        .map(|f| cells![&f.name, &f.on, f.components]);
    for table in [
        Table::new("", &["group", "name", "dimension", "cells"]).with(groups),
        Table::new("", &["field", "on", "components"]).with(fields),
    ] {
        if !table.rows.is_empty() {
            blocks.push(table.into());
        }
    }
    blocks
}

fn check_report<'a>(file: &Path, found: &'a Found) -> Result<Report<'a>> {
    let kinds: [(&str, &Findings); 8] = [
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
    report.inputs.push(file.to_owned());
    for (what, findings) in odd {
        let rows = findings.first.iter().map(|f| {
            cells![
                format!("{:?}", f.cells),
                format!("{:?}", f.points),
                format!("{:?}", f.at)
            ]
        });
        let more = if findings.count > findings.first.len() {
            ", the first of them"
        } else {
            ""
        };
        let caption = format!("{what}: {}{more}", findings.count);
        report.blocks.push(
            Table::new(caption, &["cells", "points", "at"])
                .with(rows)
                .into(),
        );
    }
    let angles = [
        ("smallest angle", &found.smallest_angle),
        ("largest angle", &found.largest_angle),
    ];
    let angles = angles.into_iter().filter_map(|(what, angle)| {
        let a = angle.as_ref()?;
        let where_ = format!("{:.1}° in cell {} at {:?}", a.degrees, a.cell, a.at);
        Some((what.to_owned(), where_))
    });
    report.blocks.push(Block::Facts(angles.collect()));
    let case = TestCase {
        class: "mesh".into(),
        name: file.display().to_string(),
        title: None,
        seconds: 0.0,
        verdict,
        message: report.headline.clone(),
    };
    report.suites.push(Suite {
        name: "mesh check".into(),
        properties: Vec::new(),
        cases: vec![case],
    });
    Ok(report)
}
