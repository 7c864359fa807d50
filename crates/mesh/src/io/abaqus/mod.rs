//! Abaqus' and CalculiX' input: nodes, elements, sets and surfaces, in parts that instances place, over several files.
//!
//! Sets of nodes become vertices, surfaces the sides of their elements. Steps, materials and the like are not part of a mesh.

mod build;
mod data;
mod elements;
mod model;
mod read;
mod write;

use super::recognise::{begins, first_line};
use super::{Native, Read};

pub static FORMAT: Native = Native {
    title: "Abaqus' input",
    names: &["abaqus"],
    suffixes: &["inp"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read: Read::Once(read::read),
    write: write::write,
};

/// Whether the first line that is not a comment begins with an asterisk and a known keyword.
fn recognises(bytes: &[u8]) -> bool {
    let Some(word) = first_line(bytes, b"**").strip_prefix(b"*") else {
        return false;
    };
    let known = [
        "HEADING",
        "NODE",
        "PART",
        "INCLUDE",
        "ELEMENT",
        "PREPRINT",
        "SYSTEM",
        "ASSEMBLY",
        "NSET",
        "ELSET",
        "PARAMETER",
    ];
    known.iter().any(|known| begins(word, known))
}
