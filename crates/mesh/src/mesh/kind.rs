//! The cell types: their names, dimensions, numbers of points, and Gmsh's numbers for them.

use std::fmt;

/// The cell types that meshes of the supported formats hold. Nodes stand in Gmsh's order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CellKind {
    Vertex,
    Line,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
    Line3,
    Triangle6,
    Quadrangle8,
    Quadrangle9,
    Tetrahedron10,
    Hexahedron20,
    Hexahedron27,
    Prism15,
    Prism18,
    Pyramid13,
    Pyramid14,
    /// Any other type of Gmsh's table: cubic, quartic and so on.
    Other(OtherKind),
}

/// A type of Gmsh's table that has no variant of its own; made by [`CellKind::from_gmsh`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OtherKind {
    gmsh: u8,
    shape: Shape,
    points: u16,
}

/// The shape of a cell, regardless of its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    Vertex,
    Line,
    Triangle,
    Quadrangle,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
}

use CellKind as K;
use Shape as S;

/// The variants with a name of their own, in the order of their Gmsh numbers 1 to 19.
const NAMED: [CellKind; 19] = [
    K::Line,
    K::Triangle,
    K::Quadrangle,
    K::Tetrahedron,
    K::Hexahedron,
    K::Prism,
    K::Pyramid,
    K::Line3,
    K::Triangle6,
    K::Quadrangle9,
    K::Tetrahedron10,
    K::Hexahedron27,
    K::Prism18,
    K::Pyramid14,
    K::Vertex,
    K::Quadrangle8,
    K::Hexahedron20,
    K::Prism15,
    K::Pyramid13,
];

/// Gmsh's numbers from 20 on: (first number, shape, points of that number and of the following ones).
/// Types without a fixed number of points (polygons, polyhedra, cut cells) are left out.
const HIGHER: [(u8, Shape, &[u16]); 20] = [
    (20, S::Triangle, &[9, 10, 12, 15, 15, 21]),
    (26, S::Line, &[4, 5, 6]),
    (29, S::Tetrahedron, &[20, 35, 56, 22, 28]),
    (36, S::Quadrangle, &[16, 25, 36, 12, 16, 20]),
    (42, S::Triangle, &[28, 36, 45, 55, 66]),
    (47, S::Quadrangle, &[49, 64, 81, 100, 121]),
    (52, S::Triangle, &[18, 21, 24, 27, 30]),
    (57, S::Quadrangle, &[24, 28, 32, 36, 40]),
    (62, S::Line, &[7, 8, 9, 10, 11]),
    (71, S::Tetrahedron, &[84, 120, 165, 220, 286]),
    (79, S::Tetrahedron, &[34, 40, 46, 52, 58]),
    (84, S::Line, &[1]),
    (85, S::Triangle, &[1]),
    (90, S::Prism, &[40, 75]),
    (92, S::Hexahedron, &[64, 125, 216, 343, 512, 729, 1000]),
    (99, S::Hexahedron, &[32, 44, 56, 68, 80, 92, 104]),
    (
        106,
        S::Prism,
        &[126, 196, 288, 405, 550, 24, 33, 42, 51, 60, 69, 78],
    ),
    (118, S::Pyramid, &[30, 55, 91, 140, 204, 285, 385]),
    (125, S::Pyramid, &[21, 29, 37, 45, 53, 61, 69]),
    (137, S::Tetrahedron, &[16]),
];

impl CellKind {
    /// The type of this Gmsh number, or `None` for one that is unknown or has no fixed number of points.
    pub fn from_gmsh(number: i32) -> Option<Self> {
        let number = u8::try_from(number).ok()?;
        if let Some(kind) = NAMED.get(usize::from(number).wrapping_sub(1)) {
            return Some(*kind);
        }
        HIGHER.iter().find_map(|(first, shape, points)| {
            let offset = usize::from(number.checked_sub(*first)?);
            Some(K::Other(OtherKind {
                gmsh: number,
                shape: *shape,
                points: *points.get(offset)?,
            }))
        })
    }

    /// Gmsh's number of this type.
    pub fn gmsh(self) -> u8 {
        match self {
            K::Other(other) => other.gmsh,
            named => {
                let place = NAMED.iter().position(|kind| *kind == named);
                1 + place.expect("invariant: every variant is among those named") as u8
            }
        }
    }

    /// Number of points of one cell; never 0.
    pub fn points(self) -> usize {
        match self {
            K::Vertex => 1,
            K::Line => 2,
            K::Triangle | K::Line3 => 3,
            K::Quadrangle | K::Tetrahedron => 4,
            K::Pyramid => 5,
            K::Prism | K::Triangle6 => 6,
            K::Hexahedron | K::Quadrangle8 => 8,
            K::Quadrangle9 => 9,
            K::Tetrahedron10 => 10,
            K::Pyramid13 => 13,
            K::Pyramid14 => 14,
            K::Prism15 => 15,
            K::Prism18 => 18,
            K::Hexahedron20 => 20,
            K::Hexahedron27 => 27,
            K::Other(other) => usize::from(other.points),
        }
    }

    /// Topological dimension.
    pub fn dim(self) -> u8 {
        self.shape().dim()
    }

    /// The shape, whatever the order.
    pub fn shape(self) -> Shape {
        match self {
            K::Vertex => S::Vertex,
            K::Line | K::Line3 => S::Line,
            K::Triangle | K::Triangle6 => S::Triangle,
            K::Quadrangle | K::Quadrangle8 | K::Quadrangle9 => S::Quadrangle,
            K::Tetrahedron | K::Tetrahedron10 => S::Tetrahedron,
            K::Hexahedron | K::Hexahedron20 | K::Hexahedron27 => S::Hexahedron,
            K::Prism | K::Prism15 | K::Prism18 => S::Prism,
            K::Pyramid | K::Pyramid13 | K::Pyramid14 => S::Pyramid,
            K::Other(other) => other.shape,
        }
    }
}

impl Shape {
    /// Topological dimension.
    pub fn dim(self) -> u8 {
        match self {
            S::Vertex => 0,
            S::Line => 1,
            S::Triangle | S::Quadrangle => 2,
            S::Tetrahedron | S::Hexahedron | S::Prism | S::Pyramid => 3,
        }
    }

    /// Number of corners, which are the first nodes of a cell of any order.
    pub fn corners(self) -> usize {
        match self {
            S::Vertex => 1,
            S::Line => 2,
            S::Triangle => 3,
            S::Quadrangle | S::Tetrahedron => 4,
            S::Pyramid => 5,
            S::Prism => 6,
            S::Hexahedron => 8,
        }
    }
}

/// The shape, followed by the number of points where that is not the number of corners: `triangle`, `triangle6`.
impl fmt::Display for CellKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shape = self.shape();
        write!(f, "{}", format!("{shape:?}").to_lowercase())?;
        if self.points() != shape.corners() {
            write!(f, "{}", self.points())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_gmsh_number_comes_back() {
        for number in -3..300 {
            if let Some(kind) = CellKind::from_gmsh(number) {
                assert_eq!(i32::from(kind.gmsh()), number);
                assert!(kind.points() > 0);
            }
        }
    }

    #[test]
    fn types_without_a_fixed_number_of_points_are_unknown() {
        for number in [0, 34, 35, 67, 70, 133, 136, 138, 256] {
            assert_eq!(CellKind::from_gmsh(number), None, "{number}");
        }
    }

    #[test]
    fn names_tell_the_order() {
        assert_eq!(CellKind::Triangle.to_string(), "triangle");
        assert_eq!(CellKind::Triangle6.to_string(), "triangle6");
        assert_eq!(
            CellKind::from_gmsh(36)
                .expect("cubic quadrangle")
                .to_string(),
            "quadrangle16"
        );
    }
}
