//! `faceoff mesh`: from arguments to files and text.

use std::path::Path;

use super::args::{Form, Mesh, MeshAction};
use super::tell::{note, tell};
use super::{DISAGREE, DONE, mesh};
use crate::engine::meshio_python;
use crate::report::{is_stdout, write_json};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::check::{Findings, Report};

pub(super) fn run(arguments: &Mesh) -> Result<u8> {
    let python = meshio_python();
    match &arguments.action {
        MeshAction::Info { file, output } => {
            let info = mesh::info(file, python.as_deref())?;
            write_json(output.json.as_deref(), &info)?;
            if !output.quiet && !is_stdout(output.json.as_deref()) {
                print_info(file, &info);
            }
        }
        MeshAction::Check { file, output } => {
            let report = mesh::check(file, python.as_deref())?;
            write_json(output.json.as_deref(), &report)?;
            if !output.quiet && !is_stdout(output.json.as_deref()) {
                print_report(&report);
            }
            if !report.is_sound() {
                return Ok(DISAGREE);
            }
        }
        MeshAction::Convert { input, out, form } => {
            warn(
                form,
                mesh::convert(input, out, &options(form, out, python)?)?,
            );
        }
        MeshAction::Refine {
            input,
            out,
            times,
            form,
        } => {
            warn(
                form,
                mesh::refine(input, out, *times, &options(form, out, python)?)?,
            );
        }
        MeshAction::Make {
            scene,
            out,
            n,
            trust,
            form,
        } => {
            let scene = trust.scene(scene)?;
            let (_, made) = scene.mesh(n.map(|n| n as usize).or(scene.source().n()))?;
            warn(form, io::write(out, &made, &options(form, out, python)?)?);
        }
    }
    Ok(DONE)
}

fn options(form: &Form, out: &Path, python: Option<std::path::PathBuf>) -> Result<Options> {
    let format = form.format.as_deref().map(|name| {
        Format::of_name(name).ok_or_else(|| {
            Error::usage(
                format!("there is no format `{name}`"),
                "use msh, vtu, freefem, medit, or a name of meshio's",
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
        && target != Format::Vtu
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

fn warn(form: &Form, warnings: Vec<String>) {
    if !form.quiet {
        for warning in warnings {
            note!("faceoff: warning: {warning}");
        }
    }
}

fn print_info(file: &Path, info: &mesh::Info) {
    let version = info.version.as_deref().unwrap_or("");
    tell!(
        "{}: {} {version}, {}",
        file.display(),
        info.format,
        info.encoding
    );
    tell!("  points {}", info.points);
    for (name, count) in [
        ("vertices", info.vertices),
        ("lines", info.lines),
        ("triangles", info.triangles),
        ("tetrahedra", info.tetrahedra),
    ] {
        if count > 0 {
            tell!("  {name} {count}");
        }
    }
    for (name, count) in &info.other_cells {
        tell!("  {name} {count}");
    }
    for group in &info.groups {
        tell!(
            "  group {} {:?} of dimension {}: {} cells",
            group.tag,
            group.name,
            group.dim,
            group.cells
        );
    }
    for field in &info.fields {
        tell!(
            "  field {:?} on {}, {} components",
            field.name,
            field.on,
            field.components
        );
    }
    for warning in &info.warnings {
        tell!("  warning: {warning}");
    }
}

fn print_report(report: &Report) {
    let mut clean = true;
    for (what, findings) in [
        ("inverted cells", &report.inverted),
        ("degenerate cells", &report.degenerate),
        ("duplicate cells", &report.duplicate),
        ("orphan points", &report.orphans),
        ("faces with more than two cells", &report.crowded_faces),
        ("hanging nodes", &report.hanging_nodes),
        ("boundary faces in no group", &report.ungrouped_boundary),
    ] {
        if findings.count > 0 {
            clean = false;
            print_findings(what, findings);
        }
    }
    if report.parts.count > 1 {
        clean = false;
        print_findings("parts that are not connected", &report.parts);
    }
    if clean {
        tell!("nothing is wrong");
    }
    for (what, angle) in [
        ("smallest", &report.smallest_angle),
        ("largest", &report.largest_angle),
    ] {
        if let Some(angle) = angle {
            tell!(
                "{what} angle {:.3}° in cell {} at {:?}",
                angle.degrees,
                angle.cell,
                angle.at
            );
        }
    }
}

fn print_findings(what: &str, findings: &Findings) {
    tell!("{what}: {}", findings.count);
    for finding in &findings.first {
        tell!(
            "  cells {:?}, points {:?}, at {:?}",
            finding.cells,
            finding.points,
            finding.at
        );
    }
    if findings.count > findings.first.len() {
        tell!("  …");
    }
}
