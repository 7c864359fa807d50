//! `faceoff mesh`: inspects, checks, converts, makes and refines meshes.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::args::{Command, Form, Mesh as Arguments, MeshAction};
use super::{DONE, code, parse};
use crate::engine::meshio_python;
use crate::report::console::note;
use crate::report::mesh::{Checked, Holds, Info, check_report, holds, info_report, unread};
use crate::report::model::{Block, Report};
use crate::report::{Output, deliver};
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::io::{self, Format, Options, msh};
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::check::check;
use faceoff_mesh::mesh::refine::refine;

pub(super) fn run(arguments: &Arguments, to: &Output) -> Result<u8> {
    let python = meshio_python();
    match &arguments.action {
        MeshAction::Info { file, mesh, .. } => {
            let (content, times) = io::survey(file, mesh.as_deref(), python.as_deref())?;
            let info = Info::new(&content, times);
            deliver(&info_report(file, &info, &content.mesh)?, to)?;
        }
        MeshAction::Check { file, .. } => {
            let content = io::open(file, python.as_deref())?;
            let found = check(&content.mesh)?;
            let checked = Checked { found, content };
            deliver(&check_report(file, &checked)?, to)?;
            return Ok(code(checked.verdict()));
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

/// Prints what was written, and on standard error what was lost.
fn done(written: &Written, inputs: Vec<PathBuf>, to: &Output) -> Result<()> {
    let title = format!("faceoff {}: {}", to.command, written.of);
    let format = written.format.as_ref();
    let format = format.map_or(String::new(), |f| format!(" as {f}"));
    let headline = format!("{} is written{format}", written.file);
    let mut report = Report::new(to.command, &title, headline, written)?;
    report.inputs = inputs;
    let mut blocks = holds(&written.holds);
    blocks.push(Block::list(&written.warnings));
    report.story.rest = vec![Block::Page(blocks)];
    // The output may be standard output itself.
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

/// `faceoff mesh convert` with options as on the command line; `python` is an interpreter with meshio.
///
/// # Errors
/// Unknown options, or options that exclude each other.
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

/// The result of `mesh convert`, `refine` and `make`.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Written {
    /// The source: a file or a scene.
    of: String,
    file: String,
    /// None if meshio identifies it by the suffix.
    format: Option<String>,
    #[serde(flatten)]
    holds: Holds,
    /// Data that were lost.
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

/// Writes the contents of one file, red-refined this number of times, to another. The warnings list what was lost, which only
/// `options.lossy` allows.
///
/// # Errors
/// A file cannot be read or written, a mesh to refine has cells other than linear simplices, or data
/// would be lost.
fn rewrite(input: &Path, output: &Path, times: u32, options: &Options) -> Result<Written> {
    let content = io::open(input, options.python.as_deref())?;
    let unread = unread(&content);
    if !unread.is_empty() && !options.lossy {
        let what: Vec<String> = content
            .unread
            .iter()
            .map(|part| part.what.clone())
            .collect();
        let what = what.join("; ");
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

#[cfg(test)]
mod tests {
    use super::*;

    fn data(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name)
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
        let info = Info::new(&content, Vec::new());
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
