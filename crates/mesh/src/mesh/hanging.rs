//! Hanging nodes: where cells do not match, the faces on both sides have one cell only, and corners of the finer
//! side lie on faces of the coarser one.

use std::collections::HashMap;

use nalgebra::Vector3;

/// A point this close to a face, in units of the face's size, lies on it.
const ON: f64 = 1e-9;

/// Points that lie on one of these boundary faces without being a corner of it, each with the first such face;
/// ascending in the points. `faces` are corner indices.
pub(super) fn hanging_nodes(points: &[[f64; 3]], faces: &[&[u32]]) -> Vec<(u32, usize)> {
    let place = |point: u32| Vector3::from(points[point as usize]);
    let mut corners: Vec<u32> = faces.iter().flat_map(|face| face.iter().copied()).collect();
    corners.sort_unstable();
    corners.dedup();
    let grid = Grid::new(
        corners.iter().map(|&point| (point, place(point))),
        faces.len(),
    );
    let mut found = Vec::new();
    for (index, face) in faces.iter().enumerate() {
        let at: Vec<Vector3<f64>> = face.iter().map(|&corner| place(corner)).collect();
        grid.near(&at, |point, x| {
            if !face.contains(&point) && lies_on(x, &at) {
                found.push((point, index));
            }
        });
    }
    found.sort_unstable();
    found.dedup_by_key(|(point, _)| *point);
    found
}

/// Whether a point lies on a segment or planar polygon, away from its corners.
fn lies_on(point: Vector3<f64>, corners: &[Vector3<f64>]) -> bool {
    let size = corners
        .iter()
        .flat_map(|a| corners.iter().map(move |b| (b - a).norm()))
        .fold(0.0, f64::max);
    let near = ON * size;
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

/// The lowest and the highest coordinates.
fn bounds(points: impl Iterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
    points.fold(nothing, |[low, high], at| [low.inf(&at), high.sup(&at)])
}

/// Points in a grid of cubes.
struct Grid {
    low: Vector3<f64>,
    width: f64,
    cubes: HashMap<[i64; 3], Vec<(u32, Vector3<f64>)>>,
    points: usize,
}

impl Grid {
    fn new(points: impl Iterator<Item = (u32, Vector3<f64>)> + Clone, faces: usize) -> Self {
        let [low, high] = bounds(points.clone().map(|(_, at)| at));
        // About as wide as a face of an evenly meshed boundary.
        let width = (high - low).max() / (faces as f64).sqrt().max(1.0);
        let width = if width > 0.0 && width.is_finite() {
            width
        } else {
            1.0
        };
        let mut grid = Grid {
            low,
            width,
            cubes: HashMap::new(),
            points: 0,
        };
        for (point, at) in points {
            grid.points += 1;
            grid.cubes
                .entry(grid.cube(at))
                .or_default()
                .push((point, at));
        }
        grid
    }

    fn cube(&self, at: Vector3<f64>) -> [i64; 3] {
        let scaled = (at - self.low) / self.width;
        scaled.map(|x| x.floor() as i64).into()
    }

    /// Calls `visit` with every point in the cubes that the box around `corners` touches.
    fn near(&self, corners: &[Vector3<f64>], mut visit: impl FnMut(u32, Vector3<f64>)) {
        let margin = Vector3::repeat(self.width * 1e-6);
        let [low, high] = bounds(corners.iter().copied());
        let (low, high) = (low - margin, high + margin);
        let (from, to) = (self.cube(low), self.cube(high));
        let spans = from
            .iter()
            .zip(&to)
            .map(|(a, b)| (b.saturating_sub(*a) as f64) + 1.0);
        let inside = |at: &Vector3<f64>| (0..3).all(|i| low[i] <= at[i] && at[i] <= high[i]);
        // A large face would visit more cubes than there are points.
        if spans.product::<f64>() > self.cubes.len() as f64 {
            let all = self.cubes.values().flatten().filter(|(_, at)| inside(at));
            all.for_each(|&(point, at)| visit(point, at));
            return;
        }
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    let cube = self.cubes.get(&[x, y, z]).into_iter().flatten();
                    cube.filter(|(_, at)| inside(at))
                        .for_each(|&(point, at)| visit(point, at));
                }
            }
        }
    }
}
