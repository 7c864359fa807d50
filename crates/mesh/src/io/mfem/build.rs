//! The mesh of a file.

use std::collections::{HashMap, HashSet};

use super::Raw;
use super::broken::broken;
use super::nodes::{Nodes, quadratic};
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::builder::{Builder, Numbering};
use crate::io::scan::Scan;
use crate::mesh::{CellKind, Mesh};

impl Raw {
    pub fn build(mut self, scan: &Scan<'_>, unread: &mut Vec<Unread>) -> Result<Mesh> {
        if self.elements.is_empty() {
            return Err(scan.error("the file has no elements"));
        }
        self.place_children(scan)?;
        let order = self.nodes.as_ref().map_or(1, |nodes| nodes.order());
        let lost =
            |unread: &mut Vec<Unread>, nodes: &Nodes| {
                unread.tell("nodes", format!(
                "how the cells are curved, which is of {}: they are read with straight sides",
                nodes.collection
            ));
            };
        let mut builder = Builder::default();
        let all = std::mem::take(&mut self.elements);
        let boundary = std::mem::take(&mut self.boundary);
        let cells: Vec<(CellKind, Vec<u32>)> = match self.nodes.take() {
            Some(nodes) if nodes.collection.starts_with("L2_T1_") => {
                if order > 2 {
                    lost(unread, &nodes);
                }
                broken(scan, &all, &boundary, &nodes, order, &mut self.points)?
            }
            Some(nodes) if order == 2 && nodes.is_nodal() && !self.hanging => {
                quadratic(scan, &all, &boundary, nodes, &mut self.points)?
            }
            nodes => {
                if let Some(nodes) = nodes {
                    if nodes.collection.starts_with("L2") || nodes.collection.starts_with("NURBS") {
                        return Err(scan.error_with(
                            format!("nodes of {} do not say where corners are", nodes.collection),
                            "save the mesh from MFEM with nodes of order 2",
                        ));
                    }
                    if order > 1 {
                        lost(unread, &nodes);
                    }
                    // The dofs of vertices come first.
                    self.points = nodes.points;
                    let highest = all.iter().chain(&boundary).flat_map(|e| &e.vertices).max();
                    self.points.truncate(highest.map_or(0, |&v| v as usize + 1));
                }
                let both = all.iter().chain(&boundary);
                both.map(|e| (e.kinds.0, e.vertices.clone())).collect()
            }
        };
        let mut of_attribute: HashMap<(bool, i64), Vec<u32>> = HashMap::new();
        let sides = all.len();
        for (at, (element, (kind, nodes))) in all.iter().chain(&boundary).zip(cells).enumerate() {
            if nodes.iter().any(|&node| node as usize >= self.points.len()) {
                return Err(scan.error(format!(
                    "a {kind} has a vertex beyond the {} there are",
                    self.points.len()
                )));
            }
            let number = builder.new_number();
            let cell = builder.cell(kind, &nodes, number, element.attribute);
            of_attribute
                .entry((at >= sides, element.attribute))
                .or_default()
                .push(cell);
        }
        for (is_side, sets) in [(false, &self.sets), (true, &self.boundary_sets)] {
            for (name, attributes) in sets {
                let attributes: HashSet<i64> = attributes.iter().copied().collect();
                let cells = attributes
                    .iter()
                    .filter_map(|&a| of_attribute.get(&(is_side, a)));
                builder.set(name, cells.flatten().copied());
            }
        }
        builder.mesh.points = self.points.into();
        Ok(builder.finish())
    }

    /// Places the vertices in the middle of others, and leaves out the numbers that no element has.
    fn place_children(&mut self, scan: &Scan<'_>) -> Result<()> {
        if self.parents.is_empty() {
            return Ok(());
        }
        let mut known: HashMap<u32, [f64; 3]> = (0..).zip(self.points.iter().copied()).collect();
        let mut wanted: Vec<u32> = self
            .elements
            .iter()
            .flat_map(|e| e.vertices.iter().copied())
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        let mut numbering = Numbering::default();
        let mut points = Vec::with_capacity(wanted.len());
        for &vertex in &wanted {
            let mut open = vec![vertex];
            while let Some(&at) = open.last() {
                let missing = || {
                    scan.error(format!(
                        "vertex {at} has neither coordinates nor parents that have them"
                    ))
                };
                if known.contains_key(&at) {
                    open.pop();
                    continue;
                }
                let &[a, b] = self.parents.get(&at).ok_or_else(missing)?;
                match (known.get(&a), known.get(&b)) {
                    (Some(x), Some(y)) => {
                        let middle = std::array::from_fn(|i| 0.5 * (x[i] + y[i]));
                        known.insert(at, middle);
                    }
                    // A chain that is longer than there are children goes round.
                    _ if open.len() > self.parents.len() => return Err(missing()),
                    (None, _) => open.push(a),
                    _ => open.push(b),
                }
            }
            numbering.push(u64::from(vertex));
            points.extend(known.get(&vertex));
        }
        let place = |vertex: u32| {
            wanted
                .binary_search(&vertex)
                .map_or(u32::MAX, |place| place as u32)
        };
        for element in self.elements.iter_mut().chain(&mut self.boundary) {
            element
                .vertices
                .iter_mut()
                .for_each(|vertex| *vertex = place(*vertex));
        }
        self.points = points;
        Ok(())
    }
}
