//! Abaqus' and CalculiX' input: nodes, elements, sets and surfaces, in parts that instances place, over several files.
//!
//! Sets of nodes become vertices, surfaces the sides of their elements. Steps, materials and the like are not part of a mesh.

mod build;
mod data;
mod elements;
mod model;
mod read;
mod write;

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
    let mut lines = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"**"));
    let Some(word) = first.and_then(|line| line.strip_prefix(b"*")) else {
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
    let begins = |known: &str| {
        word.get(..known.len())
            .is_some_and(|w| w.eq_ignore_ascii_case(known.as_bytes()))
    };
    known.iter().any(|known| begins(known))
}
