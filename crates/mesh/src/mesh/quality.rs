//! The shape of cells: angles, and aspect ratio and scaled Jacobian as [Verdict](https://doi.org/10.2172/901967) defines
//! them; how each is distributed, and which cells are worst.

use std::collections::HashMap;

use nalgebra::{DMatrix, Vector3};
use serde::Serialize;

use super::simplex::{angle, dihedral_angles};
use super::topology::sides;
use super::{CellKind, Shape};
use crate::io::vtu::lattice;

type Point = Vector3<f64>;

/// The number of worst cells that are reported.
const WORST: usize = 5;
/// For cells of higher order only the facets are known.
const MOST_NODES: usize = 125;

/// The quantity that is measured, and the ends of the bins of its histogram.
const MEASURES: [(&str, bool, &[f64]); 4] = [
    (
        "smallest angle",
        false,
        &[0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0],
    ),
    (
        "largest angle",
        true,
        &[
            60.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0, 130.0, 140.0, 150.0, 160.0, 170.0, 180.0,
        ],
    ),
    (
        "aspect ratio",
        true,
        &[1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0, 1000.0, 1e4],
    ),
    (
        "scaled Jacobian",
        false,
        &[-1.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
    ),
];

/// One measure of all cells of the highest dimension.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// `smallest angle` and `largest angle` in degrees (of triangles and quadrangles at the corners, of solids between
    /// faces), `aspect ratio`, `scaled Jacobian`.
    pub what: &'static str,
    /// Number of cells that have it.
    pub cells: usize,
    /// The smallest value of a cell.
    pub least: f64,
    /// The mean over the cells, each of the same weight.
    pub mean: f64,
    /// The largest value of a cell.
    pub largest: f64,
    /// The cells from one end to the next; the first and the last bin have what is beyond, too.
    pub bins: Vec<Bin>,
    /// The worst first.
    pub worst: Vec<Located>,
}

/// The cells whose value is from one number to another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// The lower end.
    pub from: f64,
    /// The upper end, which belongs to the next.
    pub to: f64,
    /// How many there are.
    pub cells: usize,
}

/// A value of a cell, which is called by the file's number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Located {
    /// In the unit of its measure.
    pub value: f64,
    /// The file's number of the cell.
    pub cell: u64,
    /// The mean of its corners.
    pub at: [f64; 3],
}

/// The measures of cells that are given one by one.
pub(super) struct Measures {
    all: [Quality; MEASURES.len()],
    /// The derivatives of the shape functions of each kind of curved cells.
    slopes: HashMap<CellKind, Option<Slopes>>,
}

impl Measures {
    pub fn new() -> Self {
        let quality = |(what, _, ends): (&'static str, bool, &[f64])| Quality {
            what,
            cells: 0,
            least: f64::INFINITY,
            mean: 0.0,
            largest: f64::NEG_INFINITY,
            bins: ends
                .windows(2)
                .map(|pair| Bin {
                    from: pair[0],
                    to: pair[1],
                    cells: 0,
                })
                .collect(),
            worst: Vec::new(),
        };
        Measures {
            all: MEASURES.map(quality),
            slopes: HashMap::new(),
        }
    }

    /// Takes a cell by its corners and all of its nodes; whether its curved sides fold it over.
    pub fn add(&mut self, kind: CellKind, corners: &[Point], nodes: &[Point], number: u64) -> bool {
        let shape = kind.shape();
        let slopes = self.slopes.entry(kind);
        let slopes = slopes.or_insert_with(|| Slopes::new(kind)).as_ref();
        let curved = slopes.map(|slopes| slopes.range(shape, corners, nodes));
        let jacobian = scaled_jacobian(shape, corners).map(|at_corners| match curved {
            Some((least, most)) => at_corners.min(least / most),
            None => at_corners,
        });
        let (low, high) = angles(shape, corners);
        let values = [low, high, aspect_ratio(shape, corners), jacobian];
        let at = corners.iter().sum::<Point>() / corners.len().max(1) as f64;
        for ((quality, value), (_, from_above, _)) in self.all.iter_mut().zip(values).zip(MEASURES)
        {
            if let Some(value) = value {
                quality.take(value, number, at.into(), from_above);
            }
        }
        let at_corners = scaled_jacobian(shape, corners).unwrap_or(0.0);
        curved.is_some_and(|(least, _)| least <= 0.0 && at_corners > 0.0)
    }

    /// Those that any cell has.
    pub fn finish(self) -> Vec<Quality> {
        let mut all = Vec::from(self.all);
        all.retain(|quality| quality.cells > 0);
        all
    }
}

impl Quality {
    fn take(&mut self, value: f64, cell: u64, at: [f64; 3], from_above: bool) {
        self.cells += 1;
        self.least = self.least.min(value);
        self.largest = self.largest.max(value);
        self.mean += (value - self.mean) / self.cells as f64;
        let bin = self.bins.partition_point(|bin| bin.to <= value);
        let last = self.bins.len().saturating_sub(1);
        if let Some(bin) = self.bins.get_mut(bin.min(last)) {
            bin.cells += 1;
        }
        let worse = |other: &Located| match from_above {
            true => other.value >= value,
            false => other.value <= value,
        };
        let place = self.worst.partition_point(worse);
        if place < WORST {
            self.worst.insert(place, Located { value, cell, at });
            self.worst.truncate(WORST);
        }
    }
}

/// The smallest and the largest angle, in degrees.
fn angles(shape: Shape, p: &[Point]) -> (Option<f64>, Option<f64>) {
    let found: Vec<f64> = match (shape, p) {
        (Shape::Triangle | Shape::Quadrangle | Shape::Polygon, p) => {
            let n = p.len();
            let at = |i: usize| angle(p[(i + 1) % n] - p[i], p[(i + n - 1) % n] - p[i]);
            (0..n).map(at).collect()
        }
        (Shape::Tetrahedron, &[a, b, c, d]) => dihedral_angles(&[a, b, c, d].map(Into::into))
            .into_iter()
            .collect(),
        _ => between_faces(shape, p),
    };
    let finite = || found.iter().copied().filter(|angle| angle.is_finite());
    (finite().reduce(f64::min), finite().reduce(f64::max))
}

/// The angles between the faces of a solid, by their mean normals.
fn between_faces(shape: Shape, p: &[Point]) -> Vec<f64> {
    let faces = sides(shape);
    let normals: Vec<Point> = faces.iter().map(|face| area(&pick(p, face))).collect();
    let mut found = Vec::new();
    for (k, a) in faces.iter().enumerate().filter(|(_, face)| face.len() > 2) {
        for (l, b) in faces.iter().enumerate().skip(k + 1) {
            if a.iter().filter(|node| b.contains(node)).count() == 2 {
                found.push(180.0 - angle(normals[k], normals[l]));
            }
        }
    }
    found
}

fn pick(p: &[Point], places: &[usize]) -> Vec<Point> {
    places.iter().filter_map(|&k| p.get(k).copied()).collect()
}

/// The vector area of a polygon.
fn area(p: &[Point]) -> Point {
    let Some(&origin) = p.first() else {
        return Point::zeros();
    };
    let fan = p
        .windows(2)
        .map(|edge| (edge[0] - origin).cross(&(edge[1] - origin)));
    fan.sum::<Point>() / 2.0
}

/// 1 for an equilateral simplex and for a square; of other solids the longest edge over the shortest.
fn aspect_ratio(shape: Shape, p: &[Point]) -> Option<f64> {
    let around = || (0..p.len()).map(|k| (p[(k + 1) % p.len()] - p[k]).norm());
    let longest = around().fold(0.0, f64::max);
    match (shape, p) {
        (Shape::Triangle, [..]) => {
            Some(longest * around().sum::<f64>() / (4.0 * 3f64.sqrt() * area(p).norm()))
        }
        (Shape::Quadrangle, [..]) => Some(longest * around().sum::<f64>() / (4.0 * area(p).norm())),
        (Shape::Tetrahedron, &[a, b, c, d]) => {
            let volume = (b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0;
            let faces = sides(shape).iter().map(|face| area(&pick(p, face)).norm());
            let inradius = 3.0 * volume / faces.sum::<f64>();
            Some(lengths(shape, p).1 / (2.0 * 6f64.sqrt() * inradius))
        }
        (Shape::Hexahedron | Shape::Prism | Shape::Pyramid, [..]) => {
            let (shortest, longest) = lengths(shape, p);
            Some(longest / shortest)
        }
        _ => None,
    }
    .map(|ratio| if ratio.is_nan() { f64::INFINITY } else { ratio })
}

/// The shortest and the longest edge of a solid.
fn lengths(shape: Shape, p: &[Point]) -> (f64, f64) {
    let edges = sides(shape).iter().flat_map(|face| {
        let face = pick(p, face);
        (0..face.len()).map(move |k| (face[(k + 1) % face.len()] - face[k]).norm())
    });
    edges.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), edge| {
        (low.min(edge), high.max(edge))
    })
}

/// A corner of a solid and its neighbours, right-handed.
pub(super) fn spans(shape: Shape) -> &'static [[usize; 4]] {
    match shape {
        Shape::Tetrahedron => &[[0, 1, 2, 3], [1, 2, 0, 3], [2, 0, 1, 3], [3, 1, 0, 2]],
        Shape::Hexahedron => &[
            [0, 1, 3, 4],
            [1, 2, 0, 5],
            [2, 3, 1, 6],
            [3, 0, 2, 7],
            [4, 7, 5, 0],
            [5, 4, 6, 1],
            [6, 5, 7, 2],
            [7, 6, 4, 3],
        ],
        Shape::Prism => &[
            [0, 1, 2, 3],
            [1, 2, 0, 4],
            [2, 0, 1, 5],
            [3, 5, 4, 0],
            [4, 3, 5, 1],
            [5, 4, 3, 2],
        ],
        Shape::Pyramid => &[[0, 1, 3, 4], [1, 2, 0, 4], [2, 3, 1, 4], [3, 0, 2, 4]],
        _ => &[],
    }
}

/// The least over the corners of the determinant of the edges' directions: 1 for the best cell of each shape.
fn scaled_jacobian(shape: Shape, p: &[Point]) -> Option<f64> {
    let best = match shape {
        Shape::Triangle | Shape::Prism => 3f64.sqrt() / 2.0,
        Shape::Tetrahedron => 0.5f64.sqrt(),
        Shape::Quadrangle | Shape::Hexahedron | Shape::Pyramid => 1.0,
        _ => return None,
    };
    let direction = |v: Point| v.try_normalize(0.0).unwrap_or_default();
    let least = if shape.dim() == 2 {
        let (n, up) = (p.len(), direction(area(p)));
        let at = |k: usize| {
            let edges = [p[(k + 1) % n] - p[k], p[(k + n - 1) % n] - p[k]].map(direction);
            edges[0].cross(&edges[1]).dot(&up)
        };
        (0..n).map(at).fold(f64::INFINITY, f64::min)
    } else {
        let at = |span: &[usize; 4]| {
            let [a, b, c, d] = span.map(|k| p.get(k).copied().unwrap_or_default());
            let [b, c, d] = [b - a, c - a, d - a].map(direction);
            b.cross(&c).dot(&d)
        };
        spans(shape).iter().map(at).fold(f64::INFINITY, f64::min)
    };
    Some(least / best)
}

/// The derivatives of the shape functions of a complete element at its nodes, for each axis: row by row.
struct Slopes([DMatrix<f64>; 3]);

impl Slopes {
    /// `None` for cells with straight sides, and for those whose polynomials are not known here.
    fn new(kind: CellKind) -> Option<Self> {
        let order = kind.complete_order().filter(|&order| order > 1)?;
        let nodes = lattice::of_gmsh(kind.shape(), order);
        let n = nodes.len();
        if n != kind.points() || n > MOST_NODES || kind.dim() < 2 {
            return None;
        }
        // The monomials of the element have the places of its nodes in the lattice as exponents.
        let power = |node: &[usize; 3], axis: usize, exponent: i32| match exponent {
            negative if negative < 0 => 0.0,
            exponent => (node[axis] as f64 / order as f64).powi(exponent),
        };
        let matrix = |slope: Option<usize>| {
            DMatrix::from_fn(n, n, |row, column| {
                let factors = (0..3).map(|axis| {
                    let exponent = nodes[column][axis] as i32;
                    match slope == Some(axis) {
                        true => f64::from(exponent) * power(&nodes[row], axis, exponent - 1),
                        false => power(&nodes[row], axis, exponent),
                    }
                });
                factors.product::<f64>()
            })
        };
        let inverse = matrix(None).try_inverse()?;
        Some(Slopes([0, 1, 2].map(|axis| matrix(Some(axis)) * &inverse)))
    }

    /// The least and the largest determinant of the Jacobian at the nodes.
    fn range(&self, shape: Shape, corners: &[Point], nodes: &[Point]) -> (f64, f64) {
        let up = area(corners).try_normalize(0.0).unwrap_or_default();
        let at = |row: usize| {
            let [a, b, c] = [0, 1, 2].map(|axis| {
                let slopes = self.0[axis].row(row);
                let parts = slopes.iter().zip(nodes).map(|(slope, node)| node * *slope);
                parts.sum::<Point>()
            });
            match shape.dim() {
                2 => a.cross(&b).dot(&up),
                _ => a.cross(&b).dot(&c),
            }
        };
        let all = (0..nodes.len()).map(at);
        all.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(low, high), jacobian| (low.min(jacobian), high.max(jacobian)),
        )
    }
}
