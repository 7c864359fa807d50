//! The types of elements by their names, their nodes, and their sides.

use crate::io::sides::usual_order;
use crate::mesh::{CellKind, Shape, topology};

/// Prefixes of the names of elements, followed by the number of nodes, by dimension; longer ones first.
const FAMILIES: [(u8, &[&str]); 3] = [
    (
        3,
        &[
            "DCC3D", "COH3D", "CIN3D", "DC3D", "AC3D", "EC3D", "Q3D", "C3D", "SC",
        ],
    ),
    (
        2,
        &[
            "DCC2D", "COH2D", "COHAX", "DCCAX", "CPEG", "CGAX", "CINPE", "CINPS", "CINAX", "DC2D",
            "AC2D", "ACAX", "DCAX", "SFM3D", "STRI", "M3D", "R3D", "F3D", "CPS", "CPE", "CAX",
            "DS", "S",
        ],
    ),
    (
        1,
        &[
            "DCC1D", "DC1D", "T2D", "T3D", "R2D", "RAX", "AC1D", "CONN2D", "CONN3D", "GK2D",
            "GK3D", "F2D",
        ],
    ),
];

/// Lines of two nodes; and prefixes of names of lines, followed by a number that ends in 2 for three nodes.
const LINES: [&str; 6] = [
    "SPRINGA", "SPRING2", "DASHPOTA", "GAPUNI", "FRAME2D", "FRAME3D",
];
const BEAMS: [&str; 4] = ["PIPE", "SAX", "MAX", "B"];
const POINTS: [&str; 5] = ["MASS", "ROTARYI", "SPRING1", "DASHPOT1", "HEATCAP"];

/// The kind of an element type, whose name is in capitals, and whether it is a shell.
pub fn kind(name: &str) -> Option<(CellKind, bool)> {
    use CellKind as K;
    if POINTS.contains(&name) {
        return Some((K::Vertex, false));
    }
    for (dim, family) in FAMILIES {
        let Some((family, rest)) = family
            .iter()
            .find_map(|f| Some((*f, name.strip_prefix(f)?)))
        else {
            continue;
        };
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let nodes: usize = match (family, rest.get(..digits)?) {
            ("STRI", "65") => 6,
            (_, digits) if !digits.is_empty() => digits.parse().ok()?,
            _ => continue,
        };
        let kind = match (dim, nodes) {
            (2, 2) => K::Line,
            (3, 14 | 18) => return None,
            _ => K::of_points(dim, nodes)?,
        };
        let shell = dim == 2
            && matches!(
                family,
                "S" | "DS" | "STRI" | "M3D" | "R3D" | "F3D" | "SFM3D"
            );
        return Some((kind, shell));
    }
    if LINES.contains(&name) {
        return Some((K::Line, false));
    }
    let number = BEAMS.iter().find_map(|beam| name.strip_prefix(beam))?;
    let kind = match number.trim_end_matches(|c: char| c.is_ascii_alphabetic()) {
        "2" | "22" | "32" => K::Line3,
        "1" | "21" | "23" | "31" | "33" => K::Line,
        _ => return None,
    };
    Some((kind, false))
}

/// The place in Gmsh's order of each node in Abaqus'; a variable-node brick has its middle before those of its faces.
pub fn order(kind: CellKind) -> Vec<usize> {
    let mut places = usual_order(kind, true);
    match kind {
        CellKind::Line3 => places.swap(1, 2),
        CellKind::Hexahedron27 => drop(places.splice(20.., [26, 20, 25, 21, 23, 24, 22])),
        _ => {}
    }
    places
}

/// The corners of the sides of a cell, S1 first.
pub fn sides(shape: Shape) -> &'static [&'static [usize]] {
    match shape {
        Shape::Tetrahedron => &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]],
        Shape::Pyramid => &[
            &[0, 1, 2, 3],
            &[0, 4, 1],
            &[1, 4, 2],
            &[2, 4, 3],
            &[3, 4, 0],
        ],
        Shape::Prism => &[
            &[0, 1, 2],
            &[3, 5, 4],
            &[0, 3, 4, 1],
            &[1, 4, 5, 2],
            &[2, 5, 3, 0],
        ],
        Shape::Hexahedron => &[
            &[0, 1, 2, 3],
            &[4, 7, 6, 5],
            &[0, 4, 5, 1],
            &[1, 5, 6, 2],
            &[2, 6, 7, 3],
            &[3, 7, 4, 0],
        ],
        _ => topology::sides(shape),
    }
}

/// The meaning of a surface label for an element: the element itself, or the corners of one of its sides.
pub fn side(shape: Shape, shell: bool, label: &str) -> Option<Option<&'static [usize]>> {
    let number = |letter| {
        label
            .strip_prefix(letter)
            .and_then(|digits: &str| digits.parse::<usize>().ok())
    };
    let of = |place: usize| {
        sides(shape)
            .get(place.checked_sub(1)?)
            .map(|side| Some(*side))
    };
    match (label, number('S'), number('E')) {
        ("SPOS" | "SNEG", ..) => Some(None),
        ("END1", ..) => of(1),
        ("END2", ..) => of(2),
        // CalculiX counts the two faces of a shell before its edges.
        (_, Some(1 | 2), _) if shell => Some(None),
        (_, Some(place), _) => of(if shell { place.checked_sub(2)? } else { place }),
        (_, _, Some(place)) => of(place),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_the_kind() {
        use CellKind as K;
        for (name, kind_) in [
            ("C3D20RH", K::Hexahedron20),
            ("C3D4", K::Tetrahedron),
            ("CPS4R", K::Quadrangle),
            ("CPE6M", K::Triangle6),
            ("S8R5", K::Quadrangle8),
            ("S4R", K::Quadrangle),
            ("STRI65", K::Triangle6),
            ("STRI3", K::Triangle),
            ("SC8R", K::Hexahedron),
            ("B31", K::Line),
            ("B32H", K::Line3),
            ("B33", K::Line),
            ("T3D2", K::Line),
            ("R3D3", K::Triangle),
            ("M3D9R", K::Quadrangle9),
            ("DC3D10", K::Tetrahedron10),
            ("DC1D3", K::Line3),
            ("AC2D8", K::Quadrangle8),
            ("COH3D6", K::Prism),
            ("CAX4RH", K::Quadrangle),
            ("MASS", K::Vertex),
            ("SAX1", K::Line),
            ("SAX2", K::Line3),
            ("PIPE21", K::Line),
            ("SPRINGA", K::Line),
            ("COH2D4", K::Quadrangle),
        ] {
            assert_eq!(kind(name).map(|(kind, _)| kind), Some(kind_), "{name}");
        }
        for name in ["U1", "", "C3D", "C3D7", "VUEL", "E3D", "BLOB"] {
            assert_eq!(kind(name), None, "{name}");
        }
    }
}
