//! The universal file format (UNV) of I-DEAS, as Salome, Gmsh and Code_Aster have it: nodes, elements, groups, and results
//! at nodes and on elements.

mod elements;
mod read;
mod results;
mod write;

use super::{Native, Read};

pub static FORMAT: Native = Native {
    title: "UNV",
    names: &["unv"],
    suffixes: &["unv", "uff"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read: Read::Once(read::read),
    write: write::write,
};

/// Whether the first line is only -1 and the second only a number.
fn recognises(bytes: &[u8]) -> bool {
    let mut lines = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.by_ref().find(|line| !line.is_empty());
    let number =
        |line: &[u8]| !line.is_empty() && line.len() < 7 && line.iter().all(u8::is_ascii_digit);
    first == Some(b"-1") && lines.next().is_some_and(number)
}
