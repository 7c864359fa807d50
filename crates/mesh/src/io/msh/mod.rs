//! Gmsh's MSH format: 1.0, 2.x, 3.0 (text), 4.0 and 4.1, ASCII and binary.

mod bulk;
mod data;
mod elements_v2;
mod entities;
mod layout;
mod nodes_v2;
mod read;
mod tags_v2;
mod v3;
mod v4;
mod write;
mod write_elements_v2;
mod write_entities_v4;
mod write_fields;
mod write_v2;
mod write_v4;
mod writer;

pub use read::read;
pub use write::{Version, to_bytes};

use super::recognise::begins;
use super::{Native, Read};

/// The format MSH.
pub static FORMAT: Native = Native {
    title: "Gmsh's MSH",
    names: &["msh", "gmsh"],
    suffixes: &["msh"],
    has_binary: true,
    holds_whole: false,
    recognises,
    read: Read::Views(read),
    write: write::write,
};

fn recognises(bytes: &[u8]) -> bool {
    let sections = [
        "MeshFormat",
        "NOD",
        "NOE",
        "Comments",
        "PhysicalNames",
        "Nodes",
    ];
    sections
        .iter()
        .any(|name| begins(bytes, &format!("${name}")))
}
