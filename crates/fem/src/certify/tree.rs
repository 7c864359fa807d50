//! A model of an expression on the parts of a simplex that was cut: p + s + r on each, with p linear, s of mean 0 and |s| ≤ `wave`,
//! |r| ≤ `error` everywhere but on spots.

use super::carried::Carried;
use super::products::Moments;
use super::simplex::up;
use crate::interval::Interval;
use crate::quadrature::{Piece, WHOLE, cut};

/// A leaf, or a part that was cut.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Leaf {
    /// p at the corners.
    pub values: [f64; 4],
    /// |s| is at most this, and the mean of s is 0 …
    pub wave: f64,
    /// … that of s² no larger than the square of this.
    pub swell: f64,
    /// |r| is at most this, but on spots.
    pub error: f64,
    /// The mean and the mean square over the leaf of |r| on spots at most …
    pub spots: [f64; 2],
    /// … and |r| there, if |s| + |r| is larger than `wave`.
    pub peak: f64,
    /// Whether more derivatives may give a better model.
    pub is_smooth: bool,
    /// The ends of the edge where it is cut, or where a cut would follow a jump …
    pub edge: [u8; 2],
    /// … and the share of the part at the first of them; 0 where there is neither.
    pub at: f64,
    /// The share of it on the wrong side of a cut along a jump, roughly.
    pub wrong: f64,
    /// The first of its parts among the nodes of its tree; 0 where it was not cut.
    pub parts: u32,
}

impl Leaf {
    /// The largest |p|.
    pub fn size(&self) -> f64 {
        self.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// The mean of |r| at most.
    pub fn unknown(&self) -> f64 {
        up(self.error, self.spots[0])
    }

    /// |r| at most, if |s| + |r| is larger than `wave`.
    pub fn most(&self) -> f64 {
        self.error.max(self.peak)
    }

    /// How far numbers in a range are from p + s at most.
    pub fn farthest(&self, range: Interval, corners: usize) -> f64 {
        let values = &self.values[..corners];
        let all = values.iter().map(|v| Interval::at(*v));
        let hull = all.reduce(Interval::hull).unwrap_or(Interval::WHOLE);
        (range - (hull + Interval::around_zero(self.wave))).magnitude()
    }

    /// ∫ |r| at most.
    pub fn cost(&self, measure: f64) -> f64 {
        match self.unknown() {
            0.0 => 0.0,
            unknown => measure * unknown,
        }
    }
}

/// An expression on one simplex.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    /// The whole first.
    pub whole: Leaf,
    /// Its parts, theirs, …; empty where it was not cut.
    pub rest: Vec<Leaf>,
    /// The flux that carries s, on a triangle that was not cut.
    pub carried: Option<Box<Carried>>,
    /// Moments of all parts, of f on a cell that was cut.
    pub moments: Option<Box<Moments>>,
}

impl Tree {
    pub fn leaf(&self, index: u32) -> &Leaf {
        match index {
            0 => &self.whole,
            _ => &self.rest[index as usize - 1],
        }
    }

    pub fn node_mut(&mut self, index: u32) -> &mut Leaf {
        match index {
            0 => &mut self.whole,
            _ => &mut self.rest[index as usize - 1],
        }
    }

    pub fn is_cut(&self) -> bool {
        !self.rest.is_empty()
    }

    /// Cuts a node at this share of an edge; the numbers of its parts.
    pub fn cut(&mut self, index: u32, edge: [usize; 2], at: f64, parts: [Leaf; 2]) -> [u32; 2] {
        let first = self.rest.len() as u32 + 1;
        let node = self.node_mut(index);
        (node.parts, node.at) = (first, at);
        node.edge = edge.map(|corner| corner as u8);
        self.rest.extend(parts);
        [first, first + 1]
    }

    /// Calls `visit` with every leaf's number, where it is, and its share of the whole.
    #[inline]
    pub fn for_each(&self, visit: &mut impl FnMut(u32, &Piece, f64)) {
        if self.is_cut() {
            self.below(0, &WHOLE, 1.0, visit);
        } else {
            visit(0, &WHOLE, 1.0);
        }
    }

    fn below(
        &self,
        index: u32,
        piece: &Piece,
        share: f64,
        visit: &mut impl FnMut(u32, &Piece, f64),
    ) {
        let Some(below) = self.below_of(index) else {
            return visit(index, piece, share);
        };
        for (index, (part, of_node)) in below.iter().zip(self.parts_of(index, piece)) {
            self.below(*index, &part, share * of_node, visit);
        }
    }

    /// The parts of a node that was cut.
    pub fn below_of(&self, index: u32) -> Option<[u32; 2]> {
        let first = self.leaf(index).parts;
        (first != 0).then_some([first, first + 1])
    }

    /// The edge on which a node was cut: the first part has its first end.
    pub fn edge(&self, index: u32) -> [usize; 2] {
        self.leaf(index).edge.map(usize::from)
    }

    /// Where the parts of a node are that was cut, and their shares of it: both exact.
    pub fn parts_of(&self, index: u32, piece: &Piece) -> [(Piece, f64); 2] {
        let at = self.leaf(index).at;
        let [first, second] = cut(piece, self.edge(index), at);
        [(first, at), (second, 1.0 - at)]
    }

    /// Means of all nodes from those of the leaves.
    pub fn averages(&self, mut means: Vec<f64>) -> Vec<f64> {
        // The parts of a node come after it.
        for node in (0..means.len()).rev() {
            if let Some([a, b]) = self.below_of(node as u32) {
                let at = self.leaf(node as u32).at;
                means[node] = at * means[a as usize] + (1.0 - at) * means[b as usize];
            }
        }
        means
    }

    /// The mean of what each leaf has.
    pub fn mean(&self, of: impl Fn(u32) -> Interval) -> Interval {
        let mut sum = Interval::ZERO;
        self.for_each(&mut |node, _, share| sum += share * of(node));
        sum
    }
}
