//! Prints the contents of each file as one line of JSON: what a program that wants nothing but meshes and fields needs
//! of this crate, and what other readers are compared with.
//!
//! ```text
//! cargo run -p faceoff-mesh --example inspect -- plate.msh u.vtu
//! cargo run -p faceoff-mesh --example inspect -- plate.msh --as plate.vtu plate.med
//! ```
//!
//! With `--as`, writes each file in other formats too, and prints for each what it cannot store and what is read back.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use faceoff_mesh::{Field, Mesh, io};
use serde_json::{Value, json};

fn main() {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    let formats = match names.iter().position(|name| name == "--as") {
        Some(place) => names.split_off(place)[1..].to_vec(),
        None => Vec::new(),
    };
    for name in names {
        let content = io::open(Path::new(&name), None);
        let mut line = described(&content);
        line["file"] = json!(name);
        for out in &formats {
            if let Ok(content) = &content {
                line["written"][out] = written(Path::new(out), content);
            }
        }
        if writeln!(std::io::stdout(), "{line}").is_err() {
            return; // whoever reads has had enough
        }
    }
}

fn described(content: &faceoff_mesh::Result<io::Content>) -> Value {
    match content {
        Ok(content) => describe(content),
        Err(error) => json!({ "error": error.to_string() }),
    }
}

/// What another format does not hold, and what is read from it.
fn written(out: &Path, content: &io::Content) -> Value {
    let options = io::Options {
        lossy: true,
        ..io::Options::default()
    };
    match io::write_with(out, &content.mesh, &content.whole, &options) {
        Ok(lost) => json!({ "lost": lost, "again": described(&io::open(out, None)) }),
        Err(error) => json!({ "error": error.to_string() }),
    }
}

fn describe(content: &io::Content) -> Value {
    let mesh = &content.mesh;
    let mut cells = BTreeMap::new();
    for block in &mesh.blocks {
        *cells.entry(block.kind.to_string()).or_insert(0) += block.len();
    }
    let groups = mesh.groups.iter().map(
        |group| json!({ "dim": group.dim, "tag": group.tag, "name": group.name, "cells": group.cells.len() }),
    );
    json!({
        "format": content.format, "version": content.version, "encoding": content.encoding,
        "points": mesh.points.len(), "used": used(mesh), "box": bounds(mesh), "cells": cells,
        "groups": groups.collect::<Vec<_>>(),
        "fields": mesh.fields.iter().map(field).collect::<Vec<_>>(),
        "whole": content.whole.iter().map(|data| &data.name).collect::<Vec<_>>(),
        "warnings": content.warnings, "unread": content.unread.iter().map(|part| &part.what).collect::<Vec<_>>(),
    })
}

/// Points that belong to cells.
fn used(mesh: &Mesh) -> usize {
    let nodes = mesh.blocks.iter().flat_map(|block| &block.nodes);
    nodes.collect::<std::collections::HashSet<_>>().len()
}

/// Least and largest coordinates.
fn bounds(mesh: &Mesh) -> [[f64; 3]; 2] {
    let mut ends = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for point in &mesh.points {
        for axis in 0..3 {
            ends[0][axis] = ends[0][axis].min(point[axis]);
            ends[1][axis] = ends[1][axis].max(point[axis]);
        }
    }
    ends
}

fn field(field: &Field) -> Value {
    let values = field.values.to_f64();
    let finite = values.iter().copied().filter(|value| value.is_finite());
    json!({
        "name": field.name, "on": field.on.to_string(), "components": field.components,
        "values": values.len(), "time": field.time, "step": field.step,
        "min": finite.clone().fold(f64::INFINITY, f64::min),
        "max": finite.clone().fold(f64::NEG_INFINITY, f64::max),
        "sum": finite.sum::<f64>(),
    })
}
