//! Scalar expressions as a list of operations on vectors of points.
//!
//! A batch has some cells (or facets) and the same quadrature points on each. Expressions that are constant on a cell, such as the gradient of a
//! linear function, are computed once per cell. Values are stored point by point, those of all cells of the batch next to each other, so that each
//! operation is a loop without conditions over contiguous memory.

use std::collections::HashMap;

use faceoff_fem::scene::expression::{Comparison, Function};

use crate::scalar::{Id, Node, Scalars};

/// A vector of values: its start, in units of one value per cell, and whether it has one value per point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    at: usize,
    /// Does it differ between the points of a cell?
    pub varies: bool,
}

#[derive(Debug, Clone, Copy)]
enum Operation {
    Add(Slot, Slot),
    Multiply(Slot, Slot),
    Divide(Slot, Slot),
    Power(Slot, Slot),
    /// To the power of an integer, 2 or 3.
    Whole(Slot, u8),
    Call(Function, Slot, Slot),
    If(Comparison, [Slot; 4]),
}

/// The operations that evaluate some expressions.
#[derive(Debug, Clone)]
pub struct Tape {
    points: usize,
    /// The number of values per cell in all vectors.
    size: usize,
    /// The leaves, which are given: numbers, coordinates, fields.
    pub ends: Vec<(Node, Slot)>,
    operations: Vec<(Operation, Slot)>,
    slots: HashMap<Id, Slot>,
}

/// The values of a tape's vectors for one batch.
#[derive(Debug, Default)]
pub struct Memory {
    values: Vec<f64>,
    cells: usize,
}

impl Tape {
    /// For these expressions at a number of points; `varies` determines which leaves differ between the points of a cell.
    pub fn new(
        scalars: &Scalars,
        roots: &[Id],
        points: usize,
        varies: impl Fn(Node) -> bool,
    ) -> Self {
        let mut tape = Tape {
            points,
            size: 0,
            ends: Vec::new(),
            operations: Vec::new(),
            slots: HashMap::new(),
        };
        for id in scalars.nodes_of(roots.iter().copied()) {
            let node = scalars.node(id);
            let of = |part: Id| tape.slots[&part];
            let operation = match node {
                Node::Add(a, b) => Some(Operation::Add(of(a), of(b))),
                Node::Multiply(a, b) => Some(Operation::Multiply(of(a), of(b))),
                Node::Divide(a, b) => Some(Operation::Divide(of(a), of(b))),
                Node::Power(a, b) => Some(match scalars.number_of(b) {
                    Some(2.0) => Operation::Whole(of(a), 2),
                    Some(3.0) => Operation::Whole(of(a), 3),
                    _ => Operation::Power(of(a), of(b)),
                }),
                Node::Call(function, a, b) => {
                    Some(Operation::Call(function, of(a), of(b.unwrap_or(a))))
                }
                Node::If(comparison, parts) => Some(Operation::If(comparison, parts.map(of))),
                _ => None,
            };
            let varies = match operation {
                Some(_) => node.parts().iter().any(|part| of(*part).varies),
                None => varies(node),
            };
            let slot = tape.allot(varies);
            tape.slots.insert(id, slot);
            match operation {
                Some(operation) => tape.operations.push((operation, slot)),
                None => tape.ends.push((node, slot)),
            }
        }
        tape
    }

    fn allot(&mut self, varies: bool) -> Slot {
        let slot = Slot {
            at: self.size,
            varies,
        };
        self.size += if varies { self.points } else { 1 };
        slot
    }

    /// The vector of an expression.
    pub fn slot(&self, id: Id) -> Slot {
        self.slots[&id]
    }

    /// Allocates memory for a batch of this many cells.
    pub fn prepare(&self, memory: &mut Memory, cells: usize) {
        memory.cells = cells;
        memory.values.resize(self.size * cells, 0.0);
    }

    /// Evaluates all operations, after the leaves are set.
    pub fn run(&self, memory: &mut Memory) {
        let cells = memory.cells;
        for (operation, slot) in &self.operations {
            let rows = if slot.varies { self.points } else { 1 };
            let (before, rest) = memory.values.split_at_mut(slot.at * cells);
            let row = |of: &Slot, q: usize| {
                let at = (of.at + if of.varies { q } else { 0 }) * cells;
                &before[at..at + cells]
            };
            for (q, out) in rest[..rows * cells].chunks_exact_mut(cells).enumerate() {
                match operation {
                    Operation::Add(a, b) => each(out, row(a, q), row(b, q), |a, b| a + b),
                    Operation::Multiply(a, b) => each(out, row(a, q), row(b, q), |a, b| a * b),
                    Operation::Divide(a, b) => each(out, row(a, q), row(b, q), |a, b| a / b),
                    Operation::Power(a, b) => each(out, row(a, q), row(b, q), f64::powf),
                    Operation::Whole(a, 2) => each(out, row(a, q), row(a, q), |a, b| a * b),
                    Operation::Whole(a, _) => each(out, row(a, q), row(a, q), |a, b| a * b * b),
                    Operation::Call(function, a, b) => {
                        each(out, row(a, q), row(b, q), |a, b| function.apply(a, b));
                    }
                    Operation::If(comparison, parts) => {
                        let [a, b, then, otherwise] = [0, 1, 2, 3].map(|k| row(&parts[k], q));
                        for (k, out) in out.iter_mut().enumerate() {
                            let holds = comparison.holds(a[k], b[k]);
                            *out = if holds { then[k] } else { otherwise[k] };
                        }
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn each(out: &mut [f64], a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = of(*a, *b);
    }
}

impl Memory {
    /// The values at a point, cell by cell.
    #[inline]
    pub fn row(&self, slot: Slot, point: usize) -> &[f64] {
        let at = (slot.at + if slot.varies { point } else { 0 }) * self.cells;
        &self.values[at..at + self.cells]
    }

    /// The same, for writing.
    #[inline]
    pub fn row_mut(&mut self, slot: Slot, point: usize) -> &mut [f64] {
        let at = (slot.at + if slot.varies { point } else { 0 }) * self.cells;
        &mut self.values[at..at + self.cells]
    }
}
