//! Hanging nodes: where cells do not match, the faces on both sides have one cell only, and corners of the finer
//! side lie on faces of the coarser one.

use std::ops::Range;

use crate::parallel;
use nalgebra::Vector3;

use crate::cancel;
use crate::error::Result;

/// A point this close to a face, in units of the face's size, lies on it.
const ON: f64 = 1e-9;
/// A box with so few points is not halved.
const FEW: usize = 8;

/// Points that lie on one of these boundary faces without being a corner of it, each with the first such face;
/// ascending in the points. `faces` are corner indices. O(N log N) for N faces about as large as their neighbours,
/// wherever they lie.
///
/// # Errors
/// [`crate::Error::Ended`].
pub fn hanging_nodes(points: &[[f64; 3]], faces: &[&[u32]]) -> Result<Vec<(u32, usize)>> {
    let place = |point: u32| Vector3::from(points[point as usize]);
    let mut corners: Vec<u32> = faces.iter().flat_map(|face| face.iter().copied()).collect();
    corners.sort_unstable();
    corners.dedup();
    let corners = corners.into_iter().map(|point| (point, place(point)));
    let mut tree = Tree::new(corners.collect())?;
    let face = |index: usize| {
        let nodes = faces[index];
        Face::new(nodes, nodes.iter().map(|&corner| place(corner)).collect())
    };
    // On nearly all meshes none of them carries anything.
    let carrying = parallel::collect(faces.len(), |index| {
        cancel::check()?;
        Ok(tree.has(0, &face(index)).then_some(index))
    });
    let carrying = carrying
        .into_iter()
        .collect::<Result<Vec<Option<usize>>>>()?;
    let mut found = Vec::new();
    for index in carrying.into_iter().flatten() {
        cancel::check()?;
        tree.find(0, &face(index), &mut |point| found.push((point, index)));
    }
    found.sort_unstable();
    Ok(found)
}

/// For each point the first of these faces, given by their corners, that it lies on, up to `near`; here a face has its
/// corners. O(N log N) for N faces about as large as their neighbours.
///
/// # Errors
/// [`crate::Error::Ended`].
pub fn carriers(
    points: &[[f64; 3]],
    faces: &[Vec<[f64; 3]>],
    near: f64,
) -> Result<Vec<Option<usize>>> {
    let mut carriers = vec![None; points.len()];
    if points.is_empty() {
        return Ok(carriers);
    }
    let places = (0..).zip(points.iter().map(|&at| Vector3::from(at)));
    let mut tree = Tree::new(places.collect())?;
    for (index, corners) in faces.iter().enumerate() {
        cancel::check()?;
        let mut face = Face::new(&[], corners.iter().map(|&at| at.into()).collect());
        face.near = near;
        face.has_corners = true;
        tree.find(0, &face, &mut |point| {
            carriers[point as usize] = Some(index)
        });
    }
    Ok(carriers)
}

/// Whether a point lies on a segment or planar polygon, away from its corners.
fn lies_on(point: Vector3<f64>, corners: &[Vector3<f64>], near: f64) -> bool {
    if corners.iter().any(|corner| (point - corner).norm() <= near) {
        return false;
    }
    match corners {
        [a, b] => on_segment(point, *a, *b, near),
        // Keys are sorted, so the order of a quadrangle's corners is lost: all triangles of three corners cover it.
        [a, b, c] => on_triangle(point, *a, *b, *c, near),
        [a, b, c, d] => [[a, b, c], [a, b, d], [a, c, d], [b, c, d]]
            .iter()
            .any(|[a, b, c]| on_triangle(point, **a, **b, **c, near)),
        _ => false,
    }
}

fn on_segment(point: Vector3<f64>, a: Vector3<f64>, b: Vector3<f64>, near: f64) -> bool {
    let along = b - a;
    let t = (point - a).dot(&along) / along.norm_squared();
    (0.0..=1.0).contains(&t) && (a + along * t - point).norm() <= near
}

fn on_triangle(
    point: Vector3<f64>,
    a: Vector3<f64>,
    b: Vector3<f64>,
    c: Vector3<f64>,
    near: f64,
) -> bool {
    let normal = (b - a).cross(&(c - a));
    let area = normal.norm();
    if area == 0.0 || ((point - a).dot(&normal) / area).abs() > near {
        return false;
    }
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(p, q)| (q - p).cross(&(point - p)).dot(&normal) >= 0.0);
    inside
        || on_segment(point, a, b, near)
        || on_segment(point, b, c, near)
        || on_segment(point, c, a, near)
}

/// Points in a tree of boxes, each of which is halved until few points are left.
struct Tree {
    /// In the order of the boxes.
    points: Vec<(u32, Vector3<f64>)>,
    /// The points that were found, which no face needs to find again.
    found: Vec<bool>,
    boxes: Vec<Bounds>,
}

/// The box around some points.
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
    points: Range<usize>,
    /// How many of them have not been found.
    left: usize,
    /// The boxes of either half.
    halves: Option<[usize; 2]>,
}

impl Tree {
    fn new(points: Vec<(u32, Vector3<f64>)>) -> Result<Self> {
        let mut tree = Tree {
            found: vec![false; points.len()],
            points,
            boxes: Vec::new(),
        };
        tree.halve(0..tree.points.len())?;
        Ok(tree)
    }

    /// Adds the box of these points, and those of its parts; returns its number.
    fn halve(&mut self, range: Range<usize>) -> Result<usize> {
        cancel::check()?;
        let points = &mut self.points[range.clone()];
        let none = Vector3::repeat(f64::INFINITY);
        let (low, high) = points.iter().fold((none, -none), |(low, high), (_, at)| {
            (low.inf(at), high.sup(at))
        });
        let axis = (high - low).imax();
        let number = self.boxes.len();
        self.boxes.push(Bounds {
            low,
            high,
            left: points.len(),
            points: range.clone(),
            halves: None,
        });
        if points.len() > FEW {
            let half = points.len() / 2;
            points.select_nth_unstable_by(half, |p, q| p.1[axis].total_cmp(&q.1[axis]));
            let middle = range.start + half;
            let halves = [
                self.halve(range.start..middle)?,
                self.halve(middle..range.end)?,
            ];
            self.boxes[number].halves = Some(halves);
        }
        Ok(number)
    }

    /// Whether a point of a box lies on a face.
    fn has(&self, number: usize, face: &Face) -> bool {
        let of = &self.boxes[number];
        if face.misses(of) {
            return false;
        }
        match of.halves {
            Some(halves) => halves.into_iter().any(|half| self.has(half, face)),
            None => self.points[of.points.clone()]
                .iter()
                .any(|&(point, at)| face.carries(point, at)),
        }
    }

    /// Calls `found` with the points of a box that lie on a face and were not found before; returns their number.
    fn find(&mut self, number: usize, face: &Face, found: &mut impl FnMut(u32)) -> usize {
        let of = &self.boxes[number];
        if of.left == 0 || face.misses(of) {
            return 0;
        }
        let mut count = 0;
        if let Some(halves) = of.halves {
            for half in halves {
                count += self.find(half, face, found);
            }
        } else {
            for place in of.points.clone() {
                let (point, at) = self.points[place];
                if !self.found[place] && face.carries(point, at) {
                    self.found[place] = true;
                    found(point);
                    count += 1;
                }
            }
        }
        self.boxes[number].left -= count;
        count
    }
}

/// A segment or planar polygon.
struct Face<'a> {
    nodes: &'a [u32],
    corners: Vec<Vector3<f64>>,
    /// How close a point on it is.
    near: f64,
    /// Directions across which it is thin.
    across: Vec<Vector3<f64>>,
    /// Whether its corners lie on it.
    has_corners: bool,
}

impl<'a> Face<'a> {
    fn new(nodes: &'a [u32], corners: Vec<Vector3<f64>>) -> Self {
        let pairs = corners
            .iter()
            .flat_map(|a| corners.iter().map(move |b| (b - a).norm()));
        let near = ON * pairs.fold(0.0, f64::max);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut across = axes.to_vec();
        match corners[..] {
            [a, b] => across.extend(axes.map(|axis| (b - a).cross(&axis))),
            [a, b, c, ..] => across.push((b - a).cross(&(c - a))),
            _ => {}
        }
        Face {
            nodes,
            corners,
            near,
            across,
            has_corners: false,
        }
    }

    /// Whether no point of a box can lie on the face: the box is next to it, or at a corner that does not count.
    fn misses(&self, of: &Bounds) -> bool {
        let (middle, half) = ((of.low + of.high) / 2.0, (of.high - of.low) / 2.0);
        let beside = self.across.iter().any(|axis| {
            let along = self
                .corners
                .iter()
                .map(|corner| (corner - middle).dot(axis));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                (low.min(at), high.max(at))
            });
            // Twice as far as a point on it may be, for rounding.
            let reach = half.dot(&axis.abs()) + 2.0 * self.near * axis.norm();
            low > reach || high < -reach
        });
        let farthest = |corner: &Vector3<f64>| ((middle - corner).abs() + half).norm();
        let mut corners = self.corners.iter();
        beside || !self.has_corners && corners.any(|corner| farthest(corner) <= self.near)
    }

    /// Whether a point lies on it.
    fn carries(&self, point: u32, at: Vector3<f64>) -> bool {
        let is_near = |corner: &Vector3<f64>| (at - corner).norm() <= self.near;
        if self.has_corners && self.corners.iter().any(is_near) {
            return true;
        }
        !self.nodes.contains(&point) && lies_on(at, &self.corners, self.near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_carry_and_what_is_beside_a_face_does_not() {
        let faces = [
            vec![[0.0; 3], [1.0, 0.0, 0.0]],
            vec![[1.0, 0.0, 0.0], [1.0, 2.0, 0.0]],
        ];
        let points = [
            [0.5, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0 + 1e-8, 1.0, 0.0],
            [1.0, 2.0 + 1e-8, 0.0],
            [1.0, 2.1, 0.0],
            [0.5, 1e-6, 0.0],
        ];
        let found = carriers(&points, &faces, 1e-7).unwrap();
        assert_eq!(found, [Some(0), Some(0), Some(1), Some(1), None, None]);
    }

    /// The order of a quadrangle's corners is lost: whatever it is, all of it carries.
    #[test]
    fn a_quadrangle_carries_everywhere_in_any_order_of_its_corners() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let points = [
            [0.5, 0.1, 0.0],
            [0.9, 0.5, 0.0],
            [0.5, 0.9, 0.0],
            [0.1, 0.5, 0.0],
            [0.5, 1.1, 0.0],
            [0.5, 0.5, 0.1],
        ];
        let expected = [Some(0), Some(0), Some(0), Some(0), None, None];
        for order in [[0, 1, 2, 3], [0, 2, 1, 3], [0, 1, 3, 2]] {
            let face = order.map(|k| corners[k]).to_vec();
            let found = carriers(&points, &[face], 1e-9).unwrap();
            assert_eq!(found, expected, "{order:?}");
        }
    }

    /// Against every point with every face, on coordinates with few digits, so that many do lie on faces.
    #[test]
    fn the_tree_finds_what_a_search_of_all_points_finds() {
        let mut random = 2017u32;
        let mut next = |below: u32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 16) % below
        };
        for corners in [2, 3, 4] {
            let points: Vec<[f64; 3]> = (0..300)
                .map(|_| [(); 3].map(|()| f64::from(next(5)) / 3.0))
                .map(|p| [p[0], p[1], if corners == 4 { 0.0 } else { p[2] }])
                .collect();
            let faces: Vec<Vec<u32>> = (0..200)
                .map(|_| (0..corners).map(|_| next(300)).collect())
                .collect();
            let faces: Vec<&[u32]> = faces.iter().map(Vec::as_slice).collect();
            let mut used = faces.concat();
            used.sort_unstable();
            used.dedup();
            let at = |point: u32| Vector3::from(points[point as usize]);
            let first = |&point: &u32| {
                let on = |face: &&[u32]| {
                    let corners = face.iter().map(|&corner| at(corner)).collect();
                    Face::new(face, corners).carries(point, at(point))
                };
                faces.iter().position(on).map(|face| (point, face))
            };
            let expected: Vec<_> = used.iter().filter_map(first).collect();
            assert!(expected.len() > 20);
            assert_eq!(hanging_nodes(&points, &faces).unwrap(), expected);
        }
    }
}
