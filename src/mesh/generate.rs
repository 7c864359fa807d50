//! Generated meshes.

use super::{CellBlock, CellKind, Group, Mesh};

/// The sides of a rectangle, in the order of their groups' tags, which start at 1.
pub const SIDES: [&str; 4] = ["bottom", "right", "top", "left"];

/// A rectangle with sides parallel to the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// The lower left corner.
    pub origin: [f64; 2],
    pub size: [f64; 2],
    /// Where each of [`SIDES`] is split into two groups: the coordinate along it.
    pub splits: [Option<f64>; 4],
}

impl Rectangle {
    pub fn new(origin: [f64; 2], size: [f64; 2]) -> Self {
        Rectangle {
            origin,
            size,
            splits: [None; 4],
        }
    }

    /// Number of the `n` edges of a side that come before its split, by ascending coordinate.
    ///
    /// None where the split falls inside an edge or leaves one part empty.
    pub fn split_after(&self, side: usize, n: usize) -> Option<usize> {
        let axis = side % 2;
        let position = n as f64 * (self.splits[side]? - self.origin[axis]) / self.size[axis];
        let edges = position.round();
        let fits = (position - edges).abs() < 1e-9 && edges >= 1.0 && edges < n as f64;
        fits.then_some(edges as usize)
    }
}

/// The Union-Jack mesh of (0, Lx) × (0, Ly); see [`union_jack_on`].
pub fn union_jack(n: usize, size: [f64; 2]) -> Mesh {
    union_jack_on(n, &Rectangle::new([0.0; 2], size))
}

/// The Union-Jack mesh of a rectangle: n × n rectangles, each cut along the diagonal that makes
/// neighbours mirror each other (section 6 of the paper: h = √2/n on the unit square).
///
/// Groups: bottom 1, right 2, top 3, left 4. A side that is split has two groups: that of the
/// lower coordinates keeps the tag, the other's is larger by 4, and the names say where each lies,
/// as in `bottom-left` and `bottom-right`. A split that falls on no vertex is not made.
pub fn union_jack_on(n: usize, rectangle: &Rectangle) -> Mesh {
    let row = n + 1;
    let at = |k: usize, axis: usize| {
        rectangle.origin[axis] + rectangle.size[axis] * (k as f64 / n as f64)
    };
    let points = (0..row * row)
        .map(|v| [at(v % row, 0), at(v / row, 1), 0.0])
        .collect();
    let mut cells = Vec::with_capacity(6 * n * n);
    for j in 0..n {
        for i in 0..n {
            let a = (j * row + i) as u32;
            let (b, c) = (a + 1, a + row as u32);
            let d = c + 1;
            if (i + j) % 2 == 0 {
                cells.extend([a, b, d, a, d, c]);
            } else {
                cells.extend([a, b, c, b, d, c]);
            }
        }
    }
    let vertex = |i: usize, j: usize| (j * row + i) as u32;
    let mut lines = Vec::with_capacity(8 * n);
    for k in 0..n {
        lines.extend([vertex(k, 0), vertex(k + 1, 0)]);
    }
    for k in 0..n {
        lines.extend([vertex(n, k), vertex(n, k + 1)]);
    }
    for k in 0..n {
        lines.extend([vertex(n - k, n), vertex(n - k - 1, n)]);
    }
    for k in 0..n {
        lines.extend([vertex(0, n - k), vertex(0, n - k - 1)]);
    }
    Mesh {
        points,
        blocks: vec![
            CellBlock::new(CellKind::Line, lines),
            CellBlock::new(CellKind::Triangle, cells),
        ],
        groups: groups(n, rectangle),
        ..Mesh::default()
    }
}

/// The groups of the lines, which go around the rectangle from its lower left corner.
fn groups(n: usize, rectangle: &Rectangle) -> Vec<Group> {
    let mut groups = Vec::new();
    for (side, name) in SIDES.into_iter().enumerate() {
        let (first, end) = ((side * n) as u32, ((side + 1) * n) as u32);
        let mut group = |name: String, tag: usize, cells: std::ops::Range<u32>| {
            groups.push(Group {
                dim: 1,
                tag: tag as i64,
                name: Some(name),
                cells: cells.collect(),
            });
        };
        let Some(edges) = rectangle.split_after(side, n) else {
            group(name.to_owned(), side + 1, first..end);
            continue;
        };
        // Top and left are passed against their coordinate.
        let (lower, upper) = if side < 2 {
            let split = first + edges as u32;
            (first..split, split..end)
        } else {
            let split = end - edges as u32;
            (split..end, first..split)
        };
        let [low, high] = [["left", "right"], ["bottom", "top"]][side % 2];
        group(format!("{name}-{low}"), side + 1, lower);
        group(format!("{name}-{high}"), side + 5, upper);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Triangulation;

    #[test]
    fn a_split_side_has_a_group_on_either_part() {
        let mut rectangle = Rectangle::new([-1.0, 2.0], [3.0, 1.0]);
        rectangle.splits = [Some(0.0), Some(2.5), Some(1.0), Some(2.25)];
        let mesh = Triangulation::new("split", &union_jack_on(12, &rectangle)).unwrap();
        assert_eq!(mesh.groups.len(), 8);
        for group in &mesh.groups {
            let name = group.name.as_deref().unwrap();
            let (side, part) = name.split_once('-').unwrap();
            let k = SIDES.iter().position(|s| *s == side).unwrap();
            let split = rectangle.splits[k].unwrap();
            let mut length = 0.0;
            for &face in &group.faces {
                let p = mesh.face_midpoint(face as usize);
                // Bottom y = 2, right x = 2, top y = 3, left x = -1.
                let level = [2.0, 2.0, 3.0, -1.0][k];
                assert_eq!(p[1 - k % 2], level, "{name}");
                assert_eq!(
                    p[k % 2] < split,
                    ["left", "bottom"].contains(&part),
                    "{name}"
                );
                length += rectangle.size[k % 2] / 12.0;
            }
            let whole = rectangle.size[k % 2];
            let lower = split - rectangle.origin[k % 2];
            let expected = if group.tag > 4 { whole - lower } else { lower };
            assert!((length - expected).abs() < 1e-12, "{name}");
        }
        // Where no vertex lies there is nothing to split at.
        assert_eq!(rectangle.split_after(0, 12), Some(4));
        for n in [1, 2, 4, 5] {
            assert_eq!(rectangle.split_after(0, n), None, "{n}");
        }
    }
}
