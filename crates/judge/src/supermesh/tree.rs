//! A flat tree of bounding boxes: which boxes of one mesh meet a given one.

use faceoff_mesh::parallel;

/// Smallest and largest coordinate along each axis.
pub(super) type Bounds = [[f64; 3]; 2];

/// Boxes in one leaf.
const LEAF: usize = 4;

/// Below this, a thread of its own is not worth its start.
const SPLIT: usize = 1 << 13;

#[derive(Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The boxes' numbers, near ones next to each other, and the boxes in this order.
    pub order: Vec<u32>,
    bounds: Vec<Bounds>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds,
    /// The node that follows where this one is left out.
    skip: u32,
    /// The first box of a leaf and the number of them; 0 within the tree.
    first: u32,
    count: u32,
}

pub(super) fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
}

fn join(a: &Bounds, b: &Bounds) -> Bounds {
    [
        [0, 1, 2].map(|k| a[0][k].min(b[0][k])),
        [0, 1, 2].map(|k| a[1][k].max(b[1][k])),
    ]
}

/// Nodes of a tree over this many boxes.
fn node_count(boxes: usize) -> usize {
    match boxes <= LEAF {
        true => 1,
        false => 1 + node_count(boxes / 2) + node_count(boxes - boxes / 2),
    }
}

impl Tree {
    /// Halved at the median of the longest axis, in O(N log N).
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let none = Node {
            bounds: [[0.0; 3]; 2],
            skip: 0,
            first: 0,
            count: 0,
        };
        let mut nodes = vec![
            none;
            if boxes.is_empty() {
                0
            } else {
                node_count(boxes.len())
            }
        ];
        if !boxes.is_empty() {
            build(boxes, &mut order, &mut nodes, 0, 0);
        }
        let bounds = parallel::collect(order.len(), |k| boxes[order[k] as usize]);
        Tree {
            nodes,
            order,
            bounds,
        }
    }

    /// Calls `found` with the number of each box that meets `bounds`.
    pub fn query(&self, bounds: &Bounds, mut found: impl FnMut(u32)) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if !meet(&node.bounds, bounds) {
                at = node.skip as usize;
                continue;
            }
            for k in node.first as usize..(node.first + node.count) as usize {
                if meet(&self.bounds[k], bounds) {
                    found(self.order[k]);
                }
            }
            at += 1;
        }
    }
}

/// Fills `nodes`, the first of which has the number `at`, with a tree of `order`, which starts at `first`.
fn build(boxes: &[Bounds], order: &mut [u32], nodes: &mut [Node], at: usize, first: usize) {
    let of = |k: &u32| &boxes[*k as usize];
    let start = *of(&order[0]);
    let bounds = order.iter().fold(start, |all, k| join(&all, of(k)));
    let is_leaf = order.len() <= LEAF;
    nodes[0] = Node {
        bounds,
        skip: (at + nodes.len()) as u32,
        first: first as u32,
        count: if is_leaf { order.len() as u32 } else { 0 },
    };
    if is_leaf {
        return;
    }
    let length = |k: usize| bounds[1][k] - bounds[0][k];
    let axis = (0..3)
        .max_by(|a, b| length(*a).total_cmp(&length(*b)))
        .unwrap_or(0);
    let middle = |k: &u32| of(k)[0][axis] + of(k)[1][axis];
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
    let threads = order.len() > SPLIT;
    let (low, high) = order.split_at_mut(half);
    let (of_low, of_high) = nodes[1..].split_at_mut(node_count(half));
    let next = at + 1 + of_low.len();
    let mut left = || build(boxes, low, of_low, at + 1, first);
    let mut right = || build(boxes, high, of_high, next, first + half);
    if threads {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_that_meets_is_found_once() {
        for count in [0, 1, 4, 5, 63, 1000, 20_000] {
            let at = |k: usize, axis: usize| ((k * 7919 + axis * 104_729) % 1000) as f64 / 10.0;
            let boxes: Vec<Bounds> = (0..count)
                .map(|k| {
                    let low = [0, 1, 2].map(|axis| at(k, axis));
                    [
                        low,
                        [0, 1, 2].map(|axis| low[axis] + at(k, axis + 3) / 20.0),
                    ]
                })
                .collect();
            let tree = Tree::new(&boxes);
            for query in boxes.iter().step_by(1 + count / 50) {
                let mut found = Vec::new();
                tree.query(query, |k| found.push(k));
                found.sort_unstable();
                let all = (0..count as u32).filter(|k| meet(&boxes[*k as usize], query));
                assert!(found.into_iter().eq(all), "{count}");
            }
        }
    }
}
