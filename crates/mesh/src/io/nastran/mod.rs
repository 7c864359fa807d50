//! Nastran's bulk data: cards of small, large and free fields, with continuations and included files. Properties are groups.
//! meshio writes it.

mod build;
mod card;
mod read;

use super::recognise::{begins, first_line};
use super::{Native, Read, meshio};
use crate::mesh::CellKind;

pub static FORMAT: Native = Native {
    title: "Nastran's bulk data",
    names: &["nastran"],
    suffixes: &["bdf", "nas", "fem"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read: Read::Once(read::read),
    write: |job| meshio::write(job, "nastran"),
};

/// Possible beginnings of the first line that is not a comment.
const BEGINNINGS: [&str; 27] = [
    "GRID", "BEGIN", "SOL ", "CEND", "NASTRAN ", "ID ", "ASSIGN", "INCLUDE", "CTETRA", "CHEXA",
    "CPENTA", "CQUAD", "CTRIA", "PSHELL", "PSOLID", "MAT1", "TITLE", "CORD2", "SUBCASE", "ECHO",
    "INIT ", "PARAM", "GRDSET", "PBAR", "PCOMP", "SPC", "FORCE",
];

fn recognises(bytes: &[u8]) -> bool {
    let first = first_line(bytes, b"$");
    let cards = CARDS.iter().map(|(name, ..)| name);
    (BEGINNINGS.iter().chain(cards)).any(|known| begins(first, known))
        && memchr::memmem::find(&bytes.to_ascii_uppercase(), b"GRID").is_some()
}

/// Cards of elements: the linear and quadratic kinds, and the field of the first node after the element's number.
const CARDS: [(&str, CellKind, Option<CellKind>, usize); 23] = [
    ("CBAR", CellKind::Line, None, 2),
    ("CBEAM", CellKind::Line, None, 2),
    ("CROD", CellKind::Line, None, 2),
    ("CTUBE", CellKind::Line, None, 2),
    ("CBUSH", CellKind::Line, None, 2),
    ("CGAP", CellKind::Line, None, 2),
    ("CONROD", CellKind::Line, None, 1),
    ("PLOTEL", CellKind::Line, None, 1),
    ("CONM2", CellKind::Vertex, None, 1),
    ("CTRIA3", CellKind::Triangle, None, 2),
    ("CTRIAR", CellKind::Triangle, None, 2),
    ("CTRAX3", CellKind::Triangle, None, 2),
    ("CTRIA6", CellKind::Triangle, Some(CellKind::Triangle6), 2),
    ("CQUAD4", CellKind::Quadrangle, None, 2),
    ("CQUADR", CellKind::Quadrangle, None, 2),
    ("CSHEAR", CellKind::Quadrangle, None, 2),
    (
        "CQUAD8",
        CellKind::Quadrangle,
        Some(CellKind::Quadrangle8),
        2,
    ),
    (
        "CQUAD",
        CellKind::Quadrangle,
        Some(CellKind::Quadrangle9),
        2,
    ),
    (
        "CTETRA",
        CellKind::Tetrahedron,
        Some(CellKind::Tetrahedron10),
        2,
    ),
    ("CPYRAM", CellKind::Pyramid, Some(CellKind::Pyramid13), 2),
    ("CPYRA", CellKind::Pyramid, Some(CellKind::Pyramid13), 2),
    ("CPENTA", CellKind::Prism, Some(CellKind::Prism15), 2),
    (
        "CHEXA",
        CellKind::Hexahedron,
        Some(CellKind::Hexahedron20),
        2,
    ),
];
