//! Generated meshes of rectangles and boxes.

use std::convert::Infallible;

use super::{CellBlock, CellKind, Group, Mesh};
use crate::cancel;
use crate::error::Result;
use crate::memory;
use crate::parallel;

/// The sides of a rectangle and of a box in the order of their groups' tags, which start at 1. The
/// last coordinate points up.
pub fn sides(dim: usize) -> &'static [&'static str] {
    const SIDES: [&str; 6] = ["bottom", "right", "top", "left", "front", "back"];
    &SIDES[..2 * dim]
}

/// The coordinate that is constant on a side, and whether it has its upper value there.
pub fn place(side: usize, dim: usize) -> (usize, bool) {
    match side {
        0 => (dim - 1, false),
        1 => (0, true),
        2 => (dim - 1, true),
        3 => (0, false),
        _ => (1, side == 5),
    }
}

/// A rectangle or a box with sides parallel to the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    /// 2 or 3; in 2D the third coordinates are 0.
    pub dim: usize,
    /// The corner of the lowest coordinates.
    pub origin: [f64; 3],
    /// Lengths of the sides, from `origin`, in the unit of the coordinates.
    pub size: [f64; 3],
    /// Where each side of a rectangle is split into two groups: the coordinate along it.
    pub splits: [Option<f64>; 4],
}

impl Cuboid {
    /// A rectangle or a box, according to the number of coordinates (2 or 3).
    pub fn new<const D: usize>(origin: [f64; D], size: [f64; D]) -> Self {
        let padded = |v: [f64; D]| std::array::from_fn(|k| v.get(k).copied().unwrap_or(0.0));
        Cuboid {
            dim: D,
            origin: padded(origin),
            size: padded(size),
            splits: [None; 4],
        }
    }

    /// How many of the `n` edges of a rectangle's side lie before its split, by ascending
    /// coordinate.
    ///
    /// None if the split is inside an edge or leaves one part empty.
    pub fn split_after(&self, side: usize, n: usize) -> Option<usize> {
        let axis = side % 2;
        let at = self.splits.get(side).copied().flatten()?;
        let position = n as f64 * (at - self.origin[axis]) / self.size[axis];
        let edges = position.round();
        let fits = (position - edges).abs() < 1e-9 && edges >= 1.0 && edges < n as f64;
        fits.then_some(edges as usize)
    }
}

/// The Union-Jack mesh of (0, Lx) × (0, Ly); see [`union_mesh`].
pub fn union_jack(n: usize, size: [f64; 2]) -> Mesh {
    let Ok(mesh) = build(n, &Cuboid::new([0.0; 2], size), never);
    mesh
}

/// The mesh of (0, Lx) × (0, Ly) × (0, Lz) of 6n³ tetrahedra; see [`union_mesh`].
pub fn union_cube(n: usize, size: [f64; 3]) -> Mesh {
    let Ok(mesh) = build(n, &Cuboid::new([0.0; 3], size), never);
    mesh
}

/// The Union-Jack mesh of a rectangle or box: n^d small ones, each cut into d! simplices so that
/// neighbours mirror each other (section 6 of the paper: h = √2/n on the unit square).
///
/// Each small cuboid is cut as by Kuhn (1960): a simplex is a path along d edges, one of each
/// direction in any order, from the corner with even lattice coordinates to the opposite one.
///
/// The small cuboids are numbered with the first coordinate running fastest; in 2D the lower
/// triangle of each comes first.
///
/// Groups: bottom 1, right 2, top 3, left 4, front 5, back 6. A side of a rectangle that is split
/// has two groups: that of the lower coordinates keeps the tag, the other's is larger by 4, and the
/// names give the position of each, as in `bottom-left` and `bottom-right`. A split that falls on no
/// vertex is ignored. Boundary faces are oriented outwards.
///
/// # Errors
/// A mesh that memory cannot hold; an interruption.
pub fn union_mesh(n: usize, cuboid: &Cuboid) -> Result<Mesh> {
    let simplices = if cuboid.dim == 2 { 2.0 } else { 6.0 };
    let cells = simplices * (n as f64).powi(cuboid.dim as i32);
    memory::require(BYTES * cells, &format!("a mesh of {cells} cells"))?;
    build(n, cuboid, cancel::check)
}

/// The least memory of a cell, with its faces and neighbours.
const BYTES: f64 = 150.0;

/// Small cuboids that one task cuts.
const TASK: usize = 1 << 12;

/// For meshes that are made in no time.
fn never() -> Result<(), Infallible> {
    Ok(())
}

/// [`union_mesh`], unless `check` stops it.
fn build<E: Send>(
    n: usize,
    cuboid: &Cuboid,
    check: impl Fn() -> Result<(), E> + Sync,
) -> Result<Mesh, E> {
    let dim = cuboid.dim;
    let row = n + 1;
    let at =
        |k: usize, axis: usize| cuboid.origin[axis] + cuboid.size[axis] * (k as f64 / n as f64);
    let point = |v| {
        let lattice = digits(v, row, dim);
        std::array::from_fn(|k| if k < dim { at(lattice[k], k) } else { 0.0 })
    };
    let points: Vec<[f64; 3]> = parallel::collect(row.pow(dim as u32), point);
    let orders = orders(dim);
    let count = n.pow(dim as u32);
    // Of paths upwards those that rise last run along the bottom, of paths downwards those that fall first.
    let order_of = |corner: &[usize; 3], number: usize| {
        let downwards = corner[dim - 1] % 2 == 1;
        orders[if downwards {
            orders.len() - 1 - number
        } else {
            number
        }]
    };
    let of_cuboid = orders.len() * (dim + 1);
    let mut cells = vec![0; count * of_cuboid];
    let tasks = cells.chunks_mut(TASK * of_cuboid).enumerate();
    let made = parallel::map(tasks, |(task, cells)| {
        check()?;
        for (k, cells) in cells.chunks_exact_mut(of_cuboid).enumerate() {
            let corner = digits(task * TASK + k, n, dim);
            for (number, cell) in cells.chunks_exact_mut(dim + 1).enumerate() {
                let (path, positive) = path(corner, order_of(&corner, number), row);
                cell.copy_from_slice(&path[..=dim]);
                turn(cell, positive);
            }
        }
        Ok(())
    });
    made.into_iter().collect::<Result<(), E>>()?;
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); 2 * dim];
    for index in 0..count {
        let corner = digits(index, n, dim);
        if corner[..dim].iter().all(|&c| c > 0 && c < n - 1) {
            continue;
        }
        check()?;
        for number in 0..orders.len() {
            let order = order_of(&corner, number);
            let (path, positive) = path(corner, order, row);
            for (side, of_side) in faces.iter_mut().enumerate() {
                let (axis, upper) = place(side, dim);
                if corner[axis] != if upper { n - 1 } else { 0 } {
                    continue;
                }
                // Paths start on even coordinates: there on this side, or at the end.
                let starts_here = (corner[axis] % 2 == 1) == upper;
                let (from, positive) = if starts_here && order[dim - 1] == axis {
                    (0, positive == (dim == 2))
                } else if !starts_here && order[0] == axis {
                    (1, positive)
                } else {
                    continue;
                };
                of_side.extend_from_slice(&path[from..from + dim]);
                let end = of_side.len();
                turn(&mut of_side[end - dim..], positive);
            }
        }
    }
    let (cell_kind, face_kind) = match dim {
        2 => (CellKind::Triangle, CellKind::Line),
        _ => (CellKind::Tetrahedron, CellKind::Triangle),
    };
    let counts: Vec<usize> = faces.iter().map(|f| f.len() / dim).collect();
    Ok(Mesh {
        points: points.into(),
        groups: groups(n, cuboid, &counts),
        blocks: vec![
            CellBlock::new(face_kind, faces.concat()),
            CellBlock::new(cell_kind, cells),
        ],
        ..Mesh::default()
    })
}

/// The mesh of a rectangle or box of n^d quadrangles or hexahedra, numbered with the first coordinate running fastest. Groups are as in
/// [`union_mesh`].
///
/// # Errors
/// A mesh that memory cannot hold; an interruption.
pub fn lattice_mesh(n: usize, cuboid: &Cuboid) -> Result<Mesh> {
    let dim = cuboid.dim;
    let count = (n as f64).powi(dim as i32);
    memory::require(BYTES * count, &format!("a mesh of {count} cells"))?;
    cancel::check()?;
    let row = n + 1;
    let point = |v| {
        let lattice = digits(v, row, dim);
        let at = |k: usize| cuboid.origin[k] + cuboid.size[k] * (lattice[k] as f64 / n as f64);
        std::array::from_fn(|k| if k < dim { at(k) } else { 0.0 })
    };
    let points: Vec<[f64; 3]> = parallel::collect(row.pow(dim as u32), point);
    let number = |at: [usize; 3]| at.iter().rev().fold(0, |sum, k| sum * row + k) as u32;
    // The corners of a square or cube in turn: the bottom, then the top.
    const TURN: [[usize; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let mut cells = Vec::with_capacity(n.pow(dim as u32) << dim);
    for index in 0..n.pow(dim as u32) {
        let at = digits(index, n, dim);
        for up in 0..dim - 1 {
            cells.extend(TURN.map(|[a, b]| number([at[0] + a, at[1] + b, at[2] + up])));
        }
    }
    let mut faces = Vec::new();
    let mut counts = Vec::new();
    for side in 0..2 * dim {
        let (axis, is_upper) = place(side, dim);
        // Outwards is to the right of an edge, and from where the corners of a face run to the left.
        let is_turned = is_upper == (axis == 1);
        let along: Vec<usize> = (0..dim).filter(|k| *k != axis).collect();
        for index in 0..n.pow(dim as u32 - 1) {
            let from = digits(index, n, dim - 1);
            let corner = |[a, b]: [usize; 2]| {
                let mut at = [0; 3];
                at[axis] = if is_upper { n } else { 0 };
                let steps = along.iter().zip(from).zip([a, b]);
                steps.for_each(|((axis, from), step)| at[*axis] = from + step);
                number(at)
            };
            let start = faces.len();
            faces.extend(TURN.into_iter().take(2 * (dim - 1)).map(corner));
            if is_turned {
                faces[start..].reverse();
            }
        }
        counts.push(n.pow(dim as u32 - 1));
    }
    let kinds = match dim {
        2 => [CellKind::Line, CellKind::Quadrangle],
        _ => [CellKind::Quadrangle, CellKind::Hexahedron],
    };
    let [face_kind, cell_kind] = kinds;
    Ok(Mesh {
        points: points.into(),
        groups: groups(n, cuboid, &counts),
        blocks: vec![
            CellBlock::new(face_kind, faces),
            CellBlock::new(cell_kind, cells),
        ],
        ..Mesh::default()
    })
}

/// Lattice coordinates of the `index`th of `base`^dim places, the first coordinate running fastest.
fn digits(index: usize, base: usize, dim: usize) -> [usize; 3] {
    let mut rest = index;
    let mut digits = [0; 3];
    for digit in &mut digits[..dim] {
        *digit = rest % base;
        rest /= base;
    }
    digits
}

/// All orders of the axes.
fn orders(dim: usize) -> &'static [&'static [usize]] {
    match dim {
        2 => &[&[0, 1], &[1, 0]],
        _ => &[
            &[0, 1, 2],
            &[0, 2, 1],
            &[1, 0, 2],
            &[1, 2, 0],
            &[2, 0, 1],
            &[2, 1, 0],
        ],
    }
}

/// The vertices of the path through a small cuboid that steps along the axes in this order, and
/// whether that simplex is positively oriented. `row` vertices lie on a line of the lattice.
fn path(corner: [usize; 3], order: &[usize], row: usize) -> ([u32; 4], bool) {
    let mut vertex = corner.map(|c| c + c % 2);
    let number = |vertex: &[usize; 3]| vertex.iter().rev().fold(0, |sum, v| sum * row + v) as u32;
    let mut path = [number(&vertex); 4];
    let mut positive = true;
    for (k, &axis) in order.iter().enumerate() {
        let backwards = corner[axis] % 2 == 1;
        vertex[axis] = corner[axis] + usize::from(!backwards);
        path[k + 1] = number(&vertex);
        positive ^= backwards;
        positive ^= order[..k].iter().filter(|before| **before > axis).count() % 2 == 1;
    }
    (path, positive)
}

/// Exchanges the last two vertices of a simplex that is not positive.
fn turn(simplex: &mut [u32], positive: bool) {
    if let (false, [.., a, b]) = (positive, simplex) {
        std::mem::swap(a, b);
    }
}

/// The groups of the boundary faces, which come side by side, `counts` of each.
fn groups(n: usize, cuboid: &Cuboid, counts: &[usize]) -> Vec<Group> {
    let mut groups = Vec::new();
    let mut group = |name: String, tag: usize, cells: std::ops::Range<usize>| {
        groups.push(Group {
            dim: cuboid.dim as u8 - 1,
            tag: tag as i64,
            name: Some(name),
            cells: cells.map(|cell| cell as u32).collect(),
        });
    };
    let mut first = 0;
    for (side, name) in sides(cuboid.dim).iter().enumerate() {
        let end = first + counts[side];
        match cuboid.split_after(side, n) {
            None => group((*name).to_owned(), side + 1, first..end),
            Some(edges) => {
                let [low, high] = [["left", "right"], ["bottom", "top"]][side % 2];
                group(format!("{name}-{low}"), side + 1, first..first + edges);
                group(format!("{name}-{high}"), side + 5, first + edges..end);
            }
        }
        first = end;
    }
    groups.sort_by_key(|group| group.tag);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Triangulation;
    use nalgebra::Vector3;

    #[test]
    fn neighbours_mirror_each_other() {
        for dim in [2, 3] {
            let n = 4;
            let mesh = match dim {
                2 => union_jack(n, [1.0; 2]),
                _ => union_cube(n, [1.0; 3]),
            };
            let mesh = Triangulation::new("union", &mesh).unwrap();
            let simplices = if dim == 2 { 2 } else { 6 };
            assert_eq!(mesh.cell_count(), simplices * n.pow(dim as u32));
            // Reflected in a plane between two layers of small cubes, every face is a face again.
            let place = |v: u32| mesh.points[v as usize].map(|x| (x * n as f64).round() as i64);
            let mut found = std::collections::HashMap::new();
            for vertex in 0..mesh.points.len() as u32 {
                found.insert(place(vertex), vertex);
            }
            for axis in 0..dim {
                for level in 1..n as i64 {
                    let mut seen = 0;
                    for face in 0..mesh.face_count() {
                        let reflected = mesh.face(face).iter().map(|&v| {
                            let mut p = place(v);
                            p[axis] = 2 * level - p[axis];
                            found.get(&p).copied()
                        });
                        let Some(mut reflected) = reflected.collect::<Option<Vec<u32>>>() else {
                            continue;
                        };
                        reflected.sort_unstable();
                        assert!(
                            mesh.find_face(&reflected).is_some(),
                            "{dim}D, {axis} {level}"
                        );
                        seen += 1;
                    }
                    assert!(seen > 0);
                }
            }
        }
    }

    #[test]
    fn sides_are_named_whole_and_look_outwards() {
        let cuboid = Cuboid::new([-1.0, 2.0, 0.5], [3.0, 1.0, 2.0]);
        for n in [1, 2, 3] {
            let mesh = union_mesh(n, &cuboid).unwrap();
            assert_eq!(mesh.validate(), Ok(()));
            assert_eq!(mesh.groups.len(), 6);
            for group in &mesh.groups {
                let (axis, upper) = place(group.tag as usize - 1, 3);
                let level = cuboid.origin[axis] + if upper { cuboid.size[axis] } else { 0.0 };
                let mut area = 0.0;
                for &cell in &group.cells {
                    let (_, nodes) = mesh.cell(cell).unwrap();
                    let p = [0, 1, 2].map(|i| Vector3::from(mesh.points[nodes[i] as usize]));
                    let normal = 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0]));
                    assert!(p.iter().all(|p| (p[axis] - level).abs() < 1e-12));
                    assert_eq!(normal[axis] > 0.0, upper, "{:?}", group.name);
                    area += normal.norm();
                }
                let whole: f64 = (0..3)
                    .filter(|a| *a != axis)
                    .map(|a| cuboid.size[a])
                    .product();
                assert!((area - whole).abs() < 1e-12, "{:?}", group.name);
            }
            Triangulation::new("box", &mesh).unwrap();
        }
    }

    /// The cells of a lattice fill the box, and its faces look outwards and fill the sides.
    #[test]
    fn lattices_fill_the_box() {
        for dim in [2, 3] {
            let cuboid = match dim {
                2 => Cuboid::new([-1.0, 2.0], [3.0, 1.0]),
                _ => Cuboid::new([-1.0, 2.0, 0.5], [3.0, 1.0, 2.0]),
            };
            let mesh = lattice_mesh(3, &cuboid).unwrap();
            assert_eq!(mesh.validate(), Ok(()));
            assert_eq!(mesh.groups.len(), 2 * dim);
            let at = |v: u32| Vector3::from(mesh.points[v as usize]);
            for group in &mesh.groups {
                let (axis, upper) = place(group.tag as usize - 1, dim);
                let level = cuboid.origin[axis] + if upper { cuboid.size[axis] } else { 0.0 };
                let mut size = 0.0;
                for &cell in &group.cells {
                    let (_, nodes) = mesh.cell(cell).unwrap();
                    assert!(nodes.iter().all(|v| (at(*v)[axis] - level).abs() < 1e-12));
                    let first = at(nodes[1]) - at(nodes[0]);
                    let normal = match dim {
                        2 => Vector3::new(first.y, -first.x, 0.0),
                        _ => first.cross(&(at(nodes[3]) - at(nodes[0]))),
                    };
                    assert_eq!(normal[axis] > 0.0, upper, "{:?}", group.name);
                    size += normal.norm();
                }
                let others = (0..dim).filter(|a| *a != axis);
                let whole: f64 = others.map(|a| cuboid.size[a]).product();
                assert!((size - whole).abs() < 1e-12, "{:?}", group.name);
            }
            let volume = |nodes: &[u32]| match nodes {
                [a, b, _, d] => (at(*b) - at(*a)).cross(&(at(*d) - at(*a))).z,
                [a, b, _, d, e, ..] => {
                    let up = at(*e) - at(*a);
                    (at(*b) - at(*a)).cross(&(at(*d) - at(*a))).dot(&up)
                }
                _ => f64::NAN,
            };
            let cells = mesh.blocks[1].cells();
            let found: Vec<f64> = cells.map(volume).collect();
            assert!(found.iter().all(|v| *v > 0.0));
            let whole: f64 = cuboid.size[..dim].iter().product();
            assert!((found.iter().sum::<f64>() - whole).abs() < 1e-12);
        }
    }

    #[test]
    fn a_split_side_has_a_group_on_either_part() {
        let mut rectangle = Cuboid::new([-1.0, 2.0], [3.0, 1.0]);
        rectangle.splits = [Some(0.0), Some(2.5), Some(1.0), Some(2.25)];
        let mesh = Triangulation::new("split", &union_mesh(12, &rectangle).unwrap()).unwrap();
        assert_eq!(mesh.groups.len(), 8);
        for group in &mesh.groups {
            let name = group.name.as_deref().unwrap();
            let (side, part) = name.split_once('-').unwrap();
            let k = sides(2).iter().position(|s| *s == side).unwrap();
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
