//! `faceoff mesh`: what a file holds, what is wrong with it, and the same in another format or finer.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::io::{self, Content, Format, Options};
use faceoff_mesh::mesh::check::{Report, check as check_mesh};
use faceoff_mesh::mesh::refine::refine as refine_mesh;
use faceoff_mesh::mesh::{CellKind, Mesh};

/// What `mesh info` tells; its JSON form is a contract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Info {
    /// `msh`, `vtu`, `freefem`, `medit` or `other`.
    pub format: String,
    pub version: Option<String>,
    pub encoding: String,
    #[serde(flatten)]
    pub holds: Holds,
    pub warnings: Vec<String>,
}

/// What a mesh holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Holds {
    /// All points of the file, those of no cell included.
    pub points: usize,
    pub vertices: usize,
    pub lines: usize,
    pub triangles: usize,
    pub tetrahedra: usize,
    /// Number of cells of each other type.
    pub other_cells: BTreeMap<String, usize>,
    pub groups: Vec<GroupInfo>,
    pub fields: Vec<FieldInfo>,
}

/// What `mesh convert`, `refine` and `make` wrote.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Written {
    /// The file that it was made of, or the scene.
    pub of: String,
    pub file: String,
    /// None where meshio knows it by the suffix.
    pub format: Option<String>,
    #[serde(flatten)]
    pub holds: Holds,
    /// What did not come along.
    pub warnings: Vec<String>,
}

impl Written {
    /// A mesh that was written to `file`.
    pub fn new(
        of: String,
        file: &Path,
        mesh: &Mesh,
        options: &Options,
        warnings: Vec<String>,
    ) -> Self {
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
pub struct GroupInfo {
    pub dim: u8,
    pub tag: i64,
    /// Empty for a group without a name.
    pub name: String,
    /// Number of its cells.
    pub cells: usize,
}

/// A field on a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldInfo {
    pub name: String,
    /// `points`, `cells` or `cell points`.
    pub on: String,
    pub components: usize,
}

/// `mesh info FILE`. `python` is the interpreter of an environment with meshio, for formats that need it.
///
/// # Errors
/// The file cannot be read.
pub fn info(path: &Path, python: Option<&Path>) -> Result<Info> {
    Ok(describe(&io::open(path, python)?))
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
        for block in mesh
            .blocks
            .iter()
            .filter(|block| !named.contains(&block.kind))
        {
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

fn describe(content: &Content) -> Info {
    let mut warnings = content.warnings.clone();
    warnings.extend(
        content
            .unread
            .iter()
            .map(|what| format!("not read: {what}")),
    );
    let own = ["msh", "vtu", "freefem", "medit"];
    let own = own.into_iter().find(|own| *own == content.format);
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

/// `mesh check FILE`.
///
/// # Errors
/// The file cannot be read; what is wrong with a mesh that can be is in the report.
pub fn check(path: &Path, python: Option<&Path>) -> Result<Report> {
    check_mesh(&io::open(path, python)?.mesh)
}

/// `mesh convert IN OUT`: the warnings say what did not come along, which only `options.lossy` allows.
///
/// # Errors
/// A file cannot be read or written, or something would be lost.
pub fn convert(input: &Path, output: &Path, options: &Options) -> Result<Written> {
    let content = io::open(input, options.python.as_deref())?;
    let unread = unread(input, &content, options)?;
    let mut warnings = content.warnings;
    warnings.extend(unread);
    let mesh = &content.mesh;
    warnings.extend(io::write_with(output, mesh, &content.whole, options)?);
    Ok(Written::new(
        input.display().to_string(),
        output,
        mesh,
        options,
        warnings,
    ))
}

/// `mesh refine IN OUT`: `times` uniform red refinements.
///
/// # Errors
/// A file cannot be read or written, the mesh has other cells than simplices of first order, or something
/// would be lost.
pub fn refine(input: &Path, output: &Path, times: u32, options: &Options) -> Result<Written> {
    let content = io::open(input, options.python.as_deref())?;
    let mut warnings = content.warnings.clone();
    warnings.extend(unread(input, &content, options)?);
    let whole = content.whole;
    let mut mesh: Mesh = content.mesh;
    for _ in 0..times {
        let (fine, left_out) = refine_mesh(&input.display().to_string(), &mesh)?;
        if !left_out.is_empty() && !options.lossy {
            return Err(Error::usage(
                format!("refining {} loses {}", input.display(), left_out.join(", ")),
                "allow the loss with --lossy",
            ));
        }
        warnings.extend(
            left_out
                .into_iter()
                .map(|what| format!("not in the refined mesh: {what}")),
        );
        mesh = fine;
    }
    warnings.extend(io::write_with(output, &mesh, &whole, options)?);
    Ok(Written::new(
        input.display().to_string(),
        output,
        &mesh,
        options,
        warnings,
    ))
}

/// What the reader left behind: an error, or warnings where losses are allowed.
fn unread(path: &Path, content: &Content, options: &Options) -> Result<Vec<String>> {
    if !content.unread.is_empty() && !options.lossy {
        return Err(Error::file(
            path,
            Place::Whole,
            format!(
                "not everything in it can be read: {}",
                content.unread.join("; ")
            ),
            "allow the loss with --lossy",
        ));
    }
    Ok(content
        .unread
        .iter()
        .map(|what| format!("not read: {what}"))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(name: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name)
    }

    #[test]
    fn info_is_what_the_contract_says() {
        let info = info(&data("square-2.2-binary.msh"), None).expect("a sound mesh");
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
        refine(&data("square-4.1.msh"), &out, 2, &options).expect("refined");
        let report = check(&out, None).expect("a sound mesh");
        assert!(report.is_sound(), "{report:?}");
        assert_eq!(report.ungrouped_boundary.count, 0);
        let info = info(&out, None).expect("a sound mesh");
        assert_eq!(
            (info.format.as_str(), info.holds.triangles, info.holds.lines),
            ("medit", 14 * 16, 8 * 4)
        );
        let back = folder.path().join("back.msh");
        let written = convert(&out, &back, &Options::default()).expect("MSH holds what Medit does");
        assert!(written.warnings.is_empty(), "{written:?}");
        assert_eq!(written.holds.triangles, 14 * 16);
    }
}
