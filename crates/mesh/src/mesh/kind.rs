//! The cell types: their names, dimensions, numbers of points, and Gmsh's numbers for them.

use std::fmt;

/// The cell types that meshes of the supported formats contain. Nodes are in Gmsh's order, except for [`CellKind::Vtk`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CellKind {
    /// One point.
    Vertex,
    /// Two points.
    Line,
    /// Three corners.
    Triangle,
    /// Four corners in turn.
    Quadrangle,
    /// Four corners.
    Tetrahedron,
    /// Eight corners: the bottom in turn, then the top.
    Hexahedron,
    /// Six corners: a triangle, then the one above it.
    Prism,
    /// Five corners: the base in turn, then the apex.
    Pyramid,
    /// Order 2: the ends, then the middle.
    Line3,
    /// Order 2: corners, then midpoints of edges.
    Triangle6,
    /// Order 2 without the node inside.
    Quadrangle8,
    /// Order 2: corners, midpoints of edges, the centre.
    Quadrangle9,
    /// Order 2: corners, then midpoints of edges; the last two are in a different order than in VTK.
    Tetrahedron10,
    /// Order 2 with nodes only on corners and edges.
    Hexahedron20,
    /// Order 2: corners, edges, faces, the centre.
    Hexahedron27,
    /// Order 2 with nodes only on corners and edges.
    Prism15,
    /// Order 2: corners, edges, quadrangles.
    Prism18,
    /// Order 2 with nodes only on corners and edges.
    Pyramid13,
    /// Order 2: corners, edges, the base.
    Pyramid14,
    /// Any other type of Gmsh's table: cubic, quartic and so on.
    Other(OtherKind),
    /// A polygon of this many corners, which are 5 or more.
    Polygon(u32),
    /// A polyhedron of this many corners; [`super::Mesh::polyhedra`] has its faces.
    Polyhedron(u32),
    /// A type that VTK has and Gmsh lacks; its nodes are in VTK's order.
    Vtk(VtkKind),
}

/// A type of VTK's that Gmsh does not have; made by [`CellKind::from_vtk`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VtkKind {
    code: u8,
    shape: Shape,
    points: u32,
}

/// A type of Gmsh's table without a separate variant; made by [`CellKind::from_gmsh`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OtherKind {
    gmsh: u8,
    shape: Shape,
    points: u16,
}

/// The shape of a cell, regardless of its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    /// A point.
    Vertex,
    /// A line, straight or curved.
    Line,
    /// Three sides.
    Triangle,
    /// Four sides.
    Quadrangle,
    /// Four triangles.
    Tetrahedron,
    /// Six quadrangles.
    Hexahedron,
    /// Two triangles and three quadrangles; VTK's wedge.
    Prism,
    /// A quadrangle and four triangles.
    Pyramid,
    /// Of any number of corners, which the kind of a cell has.
    Polygon,
    /// Of any number of corners and faces.
    Polyhedron,
}

use CellKind as K;
use Shape as S;

/// The variants with their own name, in the order of their Gmsh numbers 1 to 19.
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

/// Gmsh's numbers of the complete elements of order 1, 2, …: those with all polynomials of that degree.
const COMPLETE: [(Shape, &[u8]); 6] = [
    (S::Line, &[1, 8, 26, 27, 28, 62, 63, 64, 65, 66]),
    (S::Triangle, &[2, 9, 21, 23, 25, 42, 43, 44, 45, 46]),
    (S::Quadrangle, &[3, 10, 36, 37, 38, 47, 48, 49, 50, 51]),
    (S::Tetrahedron, &[4, 11, 29, 30, 31, 71, 72, 73, 74, 75]),
    (S::Hexahedron, &[5, 12, 92, 93, 94, 95, 96, 97, 98]),
    (S::Prism, &[6, 13, 90, 91, 106, 107, 108, 109, 110]),
];

/// VTK's types by number: the shape, and the points of those that have a fixed number. Bézier cells are Lagrange cells in
/// another basis: their nodes are control points.
const OF_VTK: [(u8, Shape, Option<u32>, &str); 22] = [
    (15, S::Polyhedron, Some(10), "pentagonal-prism"),
    (16, S::Polyhedron, Some(12), "hexagonal-prism"),
    (30, S::Quadrangle, Some(6), "quadratic-linear-quadrangle"),
    (31, S::Prism, Some(12), "quadratic-linear-prism"),
    (
        33,
        S::Hexahedron,
        Some(24),
        "biquadratic-quadratic-hexahedron",
    ),
    (34, S::Triangle, Some(7), "biquadratic-triangle"),
    (36, S::Polygon, None, "quadratic-polygon"),
    (37, S::Pyramid, Some(19), "triquadratic-pyramid"),
    (41, S::Polyhedron, None, "convex-point-set"),
    (68, S::Line, None, "lagrange-line"),
    (69, S::Triangle, None, "lagrange-triangle"),
    (70, S::Quadrangle, None, "lagrange-quadrangle"),
    (71, S::Tetrahedron, None, "lagrange-tetrahedron"),
    (72, S::Hexahedron, None, "lagrange-hexahedron"),
    (73, S::Prism, None, "lagrange-prism"),
    (74, S::Pyramid, None, "lagrange-pyramid"),
    (75, S::Line, None, "bezier-line"),
    (76, S::Triangle, None, "bezier-triangle"),
    (77, S::Quadrangle, None, "bezier-quadrangle"),
    (78, S::Tetrahedron, None, "bezier-tetrahedron"),
    (79, S::Hexahedron, None, "bezier-hexahedron"),
    (80, S::Prism, None, "bezier-prism"),
];

impl CellKind {
    /// VTK's type of this number with `points` points, kept in VTK's order; `None` for a number that is not VTK's, or one of
    /// a type that has a better name here.
    pub fn from_vtk(code: u8, points: usize) -> Option<Self> {
        let (code, shape, fixed, _) = *OF_VTK.iter().find(|(known, ..)| *known == code)?;
        let points = u32::try_from(points).ok()?;
        let enough = points as usize >= shape.corners().max(1);
        let fits = fixed.map_or(enough, |fixed| fixed == points);
        fits.then_some(K::Vtk(VtkKind {
            code,
            shape,
            points,
        }))
    }

    /// VTK's number of a type that only VTK has.
    pub fn vtk(self) -> Option<u8> {
        match self {
            K::Vtk(kind) => Some(kind.code),
            _ => None,
        }
    }

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

    /// Gmsh's number of this type; 0 where Gmsh has no such type of a fixed number of points.
    pub fn gmsh(self) -> u8 {
        match self {
            K::Other(other) => other.gmsh,
            K::Polygon(_) | K::Polyhedron(_) | K::Vtk(_) => 0,
            named => {
                let place = NAMED.iter().position(|kind| *kind == named);
                1 + place.expect("invariant: every variant is among those named") as u8
            }
        }
    }

    /// The type up to order 2 of this dimension with `points` points; there is at most one.
    pub fn of_points(dim: u8, points: usize) -> Option<Self> {
        NAMED
            .into_iter()
            .find(|kind| (kind.dim(), kind.points()) == (dim, points))
    }

    /// The cells of this many corners in turn; `None` for none of them.
    pub fn of_corners(corners: usize) -> Option<Self> {
        Some(match corners {
            0 => return None,
            1 => K::Vertex,
            2 => K::Line,
            3 => K::Triangle,
            4 => K::Quadrangle,
            many => K::Polygon(u32::try_from(many).ok()?),
        })
    }

    /// The complete element of this order, if Gmsh has it.
    pub fn complete(shape: Shape, order: usize) -> Option<Self> {
        let (_, numbers) = COMPLETE.iter().find(|(of, _)| *of == shape)?;
        Self::from_gmsh((*numbers.get(order.checked_sub(1)?)?).into())
    }

    /// The order of a complete element, with all polynomials of that degree; `None` for any other.
    pub fn complete_order(self) -> Option<usize> {
        let (_, numbers) = COMPLETE.iter().find(|(of, _)| *of == self.shape())?;
        let place = numbers.iter().position(|number| *number == self.gmsh())?;
        Some(place + 1)
    }

    /// The degree of the sides; `None` where it is not that of a complete element or of one that lacks inner nodes.
    pub fn order(self) -> Option<usize> {
        match self {
            K::Vertex => None,
            K::Quadrangle8 | K::Hexahedron20 | K::Prism15 | K::Pyramid13 | K::Pyramid14 => Some(2),
            K::Pyramid | K::Polygon(_) | K::Polyhedron(_) => Some(1),
            other => other.complete_order(),
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
            K::Polygon(points) | K::Polyhedron(points) => points.max(1) as usize,
            K::Vtk(kind) => kind.points.max(1) as usize,
        }
    }

    /// Number of corners, which are the first nodes of a cell.
    pub fn corners(self) -> usize {
        match self.shape() {
            // The second half of a quadratic polygon are the middles of its sides.
            S::Polygon if self.vtk().is_some() => self.points() / 2,
            S::Polygon | S::Polyhedron => self.points(),
            shape => shape.corners(),
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
            K::Polygon(_) => S::Polygon,
            K::Polyhedron(_) => S::Polyhedron,
            K::Vtk(kind) => kind.shape,
        }
    }
}

impl Shape {
    /// Topological dimension.
    pub fn dim(self) -> u8 {
        match self {
            S::Vertex => 0,
            S::Line => 1,
            S::Triangle | S::Quadrangle | S::Polygon => 2,
            S::Tetrahedron | S::Hexahedron | S::Prism | S::Pyramid | S::Polyhedron => 3,
        }
    }

    /// Number of corners, which are the first nodes of a cell of any order; 0 for those of any number, which
    /// [`CellKind::corners`] knows.
    pub fn corners(self) -> usize {
        match self {
            S::Polygon | S::Polyhedron => 0,
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

/// The shape, followed by the number of points where that is not the number of corners: `triangle`, `triangle6`; of a type
/// that only VTK has, its name there.
impl fmt::Display for CellKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shape = self.shape();
        match OF_VTK.iter().find(|(code, ..)| Some(*code) == self.vtk()) {
            Some((.., name)) => f.write_str(name)?,
            None => write!(f, "{}", format!("{shape:?}").to_lowercase())?,
        }
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
    fn types_of_vtk_have_corners_first() {
        let kind = |code, points| CellKind::from_vtk(code, points);
        assert_eq!(kind(30, 7), None);
        assert_eq!(kind(70, 3), None);
        assert_eq!(kind(12, 8), None);
        let hexagon = kind(36, 12).expect("a quadratic hexagon");
        assert_eq!(
            (hexagon.corners(), hexagon.dim(), hexagon.gmsh()),
            (6, 2, 0)
        );
        assert_eq!(hexagon.to_string(), "quadratic-polygon12");
        assert_eq!(kind(77, 16).map(CellKind::corners), Some(4));
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
