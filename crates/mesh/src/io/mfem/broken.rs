//! The cells of a grid function of nodes that jumps between cells, as those of periodic meshes do.

use std::collections::{HashMap, HashSet};

use super::Element;
use super::nodes::Nodes;
use crate::error::Result;
use crate::io::scan::Scan;
use crate::io::sides::{self, edges};
use crate::io::vtu::lattice::{CUBE, SIMPLEX};
use crate::mesh::{CellKind, Shape, topology};

/// The cells of a grid function that each cell has for itself, as periodic meshes do; nodes of one place and of the same
/// vertices become one point.
pub fn broken(
    scan: &Scan<'_>,
    elements: &[Element],
    boundary: &[Element],
    nodes: &Nodes,
    order: usize,
    points: &mut Vec<[f64; 3]>,
) -> Result<Vec<(CellKind, Vec<u32>)>> {
    points.clear();
    let mut known: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    let close = 1e-9
        * nodes
            .points
            .as_flattened()
            .iter()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut sides: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    let wanted: HashSet<Vec<u32>> = boundary.iter().map(|e| sorted(&e.vertices)).collect();
    let mut cells = Vec::new();
    let mut first = 0;
    for element in elements {
        let kind = if order == 2 {
            element.kinds.1
        } else {
            element.kinds.0
        };
        let lattice = lattice(kind.shape(), order);
        let mut found = Vec::with_capacity(kind.points());
        for [a, b] in sides::nodes(kind) {
            let (x, y) = (corner(kind.shape(), a), corner(kind.shape(), b));
            let at: [usize; 3] = std::array::from_fn(|i| (x[i] + y[i]) * order / 2);
            let place = lattice.iter().position(|&point| point == at);
            let point = place
                .and_then(|place| nodes.points.get(first + place))
                .copied();
            let point = point.ok_or_else(|| {
                scan.error(format!("there are too few nodes of {}", nodes.collection))
            })?;
            // What the node lies on, by its vertices; a periodic mesh has several places for it.
            let on = |face: &&&[usize]| face.contains(&a) && face.contains(&b);
            let on = match topology::sides(kind.shape()).iter().find(on) {
                _ if a == b || edges(kind.shape()).contains(&[a, b]) => vec![a, b],
                Some(face) => face.to_vec(),
                None => (0..kind.shape().corners()).collect(),
            };
            let vertices = on.iter().filter_map(|&a| element.vertices.get(a).copied());
            let places = known
                .entry(sorted(&vertices.collect::<Vec<u32>>()))
                .or_default();
            let same = |&&node: &&u32| {
                let there: [f64; 3] = points.get(node as usize).copied().unwrap_or([f64::NAN; 3]);
                there.iter().zip(point).all(|(x, y)| (x - y).abs() <= close)
            };
            let node = places.iter().find(same).copied();
            let node = node.unwrap_or_else(|| {
                places.push(points.len() as u32);
                points.push(point);
                points.len() as u32 - 1
            });
            found.push(node);
        }
        first += lattice.len();
        for corners in topology::sides(kind.shape()) {
            let vertices = corners
                .iter()
                .filter_map(|&a| element.vertices.get(a).copied());
            let key = sorted(&vertices.collect::<Vec<u32>>());
            if wanted.contains(&key)
                && let Some((_, side)) = sides::side(kind, &found, corners)
            {
                sides.entry(key).or_insert(side);
            }
        }
        cells.push((kind, found));
    }
    if first != nodes.points.len() {
        return Err(scan.error(format!(
            "{} nodes of {} do not fit the elements, which have {first}",
            nodes.points.len(),
            nodes.collection
        )));
    }
    for element in boundary {
        let side = sides.get(&sorted(&element.vertices));
        let side =
            side.ok_or_else(|| scan.error("a part of the boundary is not a side of an element"))?;
        let kind = if order == 2 {
            element.kinds.1
        } else {
            element.kinds.0
        };
        cells.push((kind, side.clone()));
    }
    Ok(cells)
}

fn sorted(vertices: &[u32]) -> Vec<u32> {
    let mut vertices = vertices.to_vec();
    vertices.sort_unstable();
    vertices
}

/// A corner of the reference cell.
fn corner(shape: Shape, corner: usize) -> [usize; 3] {
    let (layer, base): (usize, &[[usize; 3]]) = match shape {
        Shape::Prism => (3, &SIMPLEX),
        Shape::Triangle | Shape::Tetrahedron => (4, &SIMPLEX),
        _ => (4, &CUBE),
    };
    let [x, y, z] = base[corner % layer];
    [x, y, z + corner / layer]
}

/// The nodes of an order inside a reference cell that is as large as the order, x first.
fn lattice(shape: Shape, order: usize) -> Vec<[usize; 3]> {
    let dim = shape.dim();
    let end = |on: bool| if on { order } else { 0 };
    let mut points = Vec::new();
    for z in 0..=end(dim > 2) {
        for y in 0..=end(dim > 1) {
            for x in 0..=end(dim > 0) {
                let inside = match shape {
                    Shape::Triangle | Shape::Prism => x + y <= order,
                    Shape::Tetrahedron => x + y + z <= order,
                    Shape::Pyramid => x.max(y) + z <= order,
                    _ => true,
                };
                if inside {
                    points.push([x, y, z]);
                }
            }
        }
    }
    points
}
