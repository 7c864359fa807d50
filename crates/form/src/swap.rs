//! Detects forms on facets between cells whose value depends on which of the two cells comes first.
//!
//! No code guarantees an order of the two cells of a facet, and the orders differ. So the integrand must be invariant under
//! interchanging the sides; here it is evaluated for random values on both sides, in both orders.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};

use crate::problem::{Domain, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// Differences below this fraction of the largest term are rounding.
const ROUNDING: f64 = 1e-8;

/// Draws of random values; if a root or logarithm of a negative number occurs, the next draw counts.
const DRAWS: u64 = 8;

/// The position, in characters of F, of the first integral over dS that changes if the two sides are interchanged.
pub fn changes(problem: &mut Problem) -> Option<usize> {
    let sums = problem.residual();
    let of_sides = sums.iter().filter(|i| i.measure.domain == Domain::Interior);
    let changed = of_sides
        .filter(|sum| differs(problem, sum.terms.iter()))
        .map(|sum| sum.measure.clone())
        .next()?;
    let parts = problem.integrals.iter().filter(|i| i.measure == changed);
    parts
        .filter(|part| differs(problem, part.terms.iter()))
        .map(|part| part.at)
        .next()
}

fn differs<'a>(problem: &Problem, terms: impl Iterator<Item = (&'a Leaf, &'a Id)> + Clone) -> bool {
    (0..DRAWS).any(|seed| {
        let (mut sums, mut largest) = ([0.0; 2], 0.0_f64);
        for (test, coefficient) in terms.clone() {
            for (sum, is_swapped) in sums.iter_mut().zip([false, true]) {
                let of = |node| random(problem, seed, node, is_swapped);
                let value = problem.scalars.value(*coefficient, &of) * of(Node::Leaf(*test));
                *sum += value;
                largest = largest.max(value.abs());
            }
        }
        (sums[0] - sums[1]).abs() > ROUNDING * largest
    })
}

/// The value of a leaf: the sides have the values of one random function on a facet with a random normal, or those of the other side.
pub(crate) fn random(problem: &Problem, seed: u64, node: Node, is_swapped: bool) -> f64 {
    let turned = |side| match (side, is_swapped) {
        (Side::Plus, true) => Side::Minus,
        (Side::Minus, true) => Side::Plus,
        (side, _) => side,
    };
    let draw = |what: &Node| {
        let mut hasher = DefaultHasher::new();
        (seed, what).hash(&mut hasher);
        // In (-1, 1).
        (hasher.finish() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let normal = |axis: usize| {
        let all = (0..problem.dim).map(|k| draw(&Node::Normal(k, Side::Plus)));
        draw(&Node::Normal(axis, Side::Plus)) / all.map(|n| n * n).sum::<f64>().sqrt()
    };
    match node {
        Node::Parameter(k) => problem.parameters[k].value,
        Node::Normal(axis, side) => match turned(side) {
            Side::Minus => -normal(axis),
            _ => normal(axis),
        },
        Node::Length(length, side) => 1.5 + draw(&Node::Length(length, turned(side))),
        Node::Leaf(leaf) => {
            let side = turned(leaf.side);
            let is_continuous = match leaf.field {
                Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                    problem.unknowns[k].space.element.is_continuous()
                }
                Field::Datum(_) => true,
            };
            // On a facet continuous functions have one value; only the normal derivative has two.
            match leaf.axis.filter(|_| leaf.second.is_none()) {
                _ if leaf.second.is_some() => draw(&Node::Leaf(Leaf { side, ..leaf })),
                None if is_continuous => draw(&Node::Leaf(Leaf {
                    side: Side::Plus,
                    ..leaf
                })),
                Some(axis) if is_continuous => {
                    let plus = draw(&Node::Leaf(Leaf {
                        side: Side::Plus,
                        ..leaf
                    }));
                    let jump = draw(&Node::Leaf(Leaf {
                        side: Side::Minus,
                        axis: None,
                        ..leaf
                    }));
                    plus + if side == Side::Minus {
                        jump * normal(axis)
                    } else {
                        0.0
                    }
                }
                _ => draw(&Node::Leaf(Leaf { side, ..leaf })),
            }
        }
        other => draw(&other),
    }
}
