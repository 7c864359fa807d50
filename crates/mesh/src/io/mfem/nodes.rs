//! Grid functions of nodes, and the quadratic cells of a continuous one.

use std::collections::HashMap;

use super::Element;
use crate::error::Result;
use crate::io::scan::Scan;
use crate::io::sides::{self, Between, around, quadrangles};
use crate::mesh::{CellKind, Shape};

/// A grid function: coordinates of the dofs of a space.
pub struct Nodes {
    pub collection: String,
    pub points: Vec<[f64; 3]>,
}

impl Nodes {
    pub fn read(scan: &mut Scan<'_>) -> Result<Nodes> {
        let mut collection = String::new();
        let (mut components, mut by_component) = (0, true);
        while let Some(word) = scan.peek().filter(|word| word[0].is_ascii_alphabetic()) {
            scan.word();
            match word {
                b"FiniteElementCollection:" => {
                    collection = String::from_utf8_lossy(scan.line().trim_ascii()).into_owned();
                }
                b"VDim:" => components = scan.u64()?,
                b"Ordering:" => by_component = scan.u64()? == 0,
                _ => {}
            }
        }
        let components = usize::try_from(components)
            .ok()
            .filter(|c| (1..=3).contains(c));
        let components = components.ok_or_else(|| scan.error("nodes have 1 to 3 coordinates"))?;
        let mut values = Vec::new();
        while scan
            .peek()
            .is_some_and(|word| !word[0].is_ascii_alphabetic())
        {
            values.push(scan.f64()?);
        }
        let count = values.len() / components;
        if values.len() % components != 0 {
            return Err(scan.error(format!(
                "{} values do not make nodes of {components} coordinates",
                values.len()
            )));
        }
        let value = |node: usize, axis: usize| match by_component {
            true => values[axis * count + node],
            false => values[node * components + axis],
        };
        let point = |node| {
            std::array::from_fn(|axis| {
                if axis < components {
                    value(node, axis)
                } else {
                    0.0
                }
            })
        };
        Ok(Nodes {
            collection,
            points: (0..count).map(point).collect(),
        })
    }

    /// The order of the space; 0 if its name does not give it.
    pub fn order(&self) -> usize {
        match self.collection.as_str() {
            "Linear" => 1,
            "Quadratic" => 2,
            "Cubic" => 3,
            other => other
                .rsplit_once("_P")
                .and_then(|(_, order)| order.parse().ok())
                .unwrap_or(0),
        }
        .min(20)
    }

    /// Whether the dofs are the values at nodes.
    pub fn is_nodal(&self) -> bool {
        self.collection == "Quadratic" || self.collection.starts_with("H1_")
    }
}

/// The edges of a cell in the order in which MFEM numbers them.
fn edges(shape: Shape) -> Vec<Between> {
    match shape {
        Shape::Tetrahedron => vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        _ => around(shape, true),
    }
}

/// The quadratic cells of a continuous grid function; its dofs are the points. Dofs belong to vertices, then edges,
/// then quadrangles, then the inside of cells, each in the order in which they first appear.
pub fn quadratic(
    scan: &Scan<'_>,
    elements: &[Element],
    boundary: &[Element],
    nodes: Nodes,
    points: &mut Vec<[f64; 3]>,
) -> Result<Vec<(CellKind, Vec<u32>)>> {
    let all = || elements.iter().chain(boundary);
    let mut next = all()
        .flat_map(|e| &e.vertices)
        .max()
        .map_or(0, |&v| v + 1)
        .max(points.len() as u32);
    if next as usize > nodes.points.len() {
        return Err(scan.error(format!(
            "vertex {} is beyond the {} nodes",
            next - 1,
            nodes.points.len()
        )));
    }
    let mut dofs: HashMap<[u32; 4], u32> = HashMap::new();
    let key = |vertices: &[u32], local: &[usize]| {
        let mut key = [u32::MAX; 4];
        for (place, &at) in key.iter_mut().zip(local) {
            *place = vertices.get(at).copied().unwrap_or(u32::MAX);
        }
        key.sort_unstable();
        key
    };
    let mut number = |key: [u32; 4]| {
        dofs.entry(key).or_insert_with(|| {
            next += 1;
            next - 1
        });
    };
    for element in all() {
        edges(element.kinds.0.shape())
            .iter()
            .for_each(|edge| number(key(&element.vertices, edge)));
    }
    // In a plane mesh a quadrangle is a cell; its inside comes in the same order.
    for element in all() {
        quadrangles(element.kinds.0.shape())
            .iter()
            .for_each(|face| number(key(&element.vertices, face)));
    }
    let mut cells = Vec::with_capacity(elements.len() + boundary.len());
    for element in all() {
        let (vertices, kind) = (&element.vertices, element.kinds.1);
        let shape = kind.shape();
        let edges = edges(shape);
        let node = |[a, b]: Between| {
            if a == b {
                return vertices.get(a).copied();
            }
            let edge = edges
                .iter()
                .find(|edge| edge.contains(&a) && edge.contains(&b));
            let face = || {
                quadrangles(shape)
                    .iter()
                    .find(|face| face.contains(&a) && face.contains(&b))
            };
            let key = match edge {
                Some(edge) => key(vertices, edge),
                None => key(vertices, face()?),
            };
            dofs.get(&key).copied()
        };
        let mut found: Vec<u32> = Vec::with_capacity(kind.points());
        for between in sides::nodes(kind) {
            // What is in the middle of no face is in the middle of a hexahedron.
            found.push(node(between).unwrap_or(next));
        }
        if shape == Shape::Hexahedron {
            next += 1;
        }
        cells.push((kind, found));
    }
    // Some versions have a dof inside of each pyramid.
    let pyramids = elements
        .iter()
        .filter(|e| e.kinds.0 == CellKind::Pyramid)
        .count();
    let there = nodes.points.len();
    if there != next as usize && (pyramids == 0 || there != next as usize + pyramids) {
        return Err(scan.error(format!(
            "{there} nodes of {} do not fit a mesh that needs {next}",
            nodes.collection
        )));
    }
    *points = nodes.points;
    points.truncate(next as usize);
    Ok(cells)
}
