//! An expression on simplices, proved: on each leaf of a tree of parts it is p + s + r with p linear, s of mean 0 and
//! |s| ≤ `wave`, |r| ≤ `error` everywhere.
//!
//! p and s come from Taylor's formula about a point c of the leaf with the remainder in interval arithmetic (K. Makino,
//! M. Berz, Int. J. Pure Appl. Math. 4, 2003), of whichever order m leaves least:
//!
//! ```text
//! f(x) = Σ_{|α| < m} f_α(c) (x-c)^α + Σ_{|α| = m} f_α (x-c)^α,   f_α = ∂^α f/α! somewhere in the box of the leaf
//! ```
//!
//! In the last sum the middles of the intervals that hold f_α belong to p and s, their radii make r. Where an `if` is not
//! decided on a leaf only order 0 is known. Leaves that cost most get derivatives up to the fourth, and are cut where these
//! do not help.

use rayon::prelude::*;

use super::quadratic::Quadratic;
use super::simplex::{Vector, corners, up};
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE, halves, longest_edge};
use crate::scene::Expression;
use crate::scene::expression::{IN_PLANE, IN_SPACE, MOST, Monomials, SECOND, Taylor};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// A leaf, or a part that was cut.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Leaf {
    /// p at the corners.
    pub values: [f64; 4],
    /// |s| is at most this, and the mean of s is 0 …
    pub wave: f64,
    /// … that of s² no larger than the square of this.
    pub swell: f64,
    /// |r| is at most this.
    pub error: f64,
    /// May more derivatives say more of it?
    pub is_smooth: bool,
    /// The ends of its longest edge, where it is cut.
    pub edge: [u8; 2],
    /// The first of its halves among the nodes of its tree; 0 where it was not cut.
    pub halves: u32,
}

impl Leaf {
    /// The largest |p|.
    fn size(&self) -> f64 {
        self.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// ∫ |r| at most; an none where r is 0.
    fn cost(&self, measure: f64) -> f64 {
        if self.error == 0.0 {
            0.0
        } else {
            measure * self.error
        }
    }
}

/// An expression on one simplex.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    /// The whole first.
    pub whole: Leaf,
    /// Its halves, theirs, …; empty where it was not cut.
    pub rest: Vec<Leaf>,
}

impl Tree {
    pub fn leaf(&self, index: u32) -> &Leaf {
        match index {
            0 => &self.whole,
            _ => &self.rest[index as usize - 1],
        }
    }

    fn node_mut(&mut self, index: u32) -> &mut Leaf {
        match index {
            0 => &mut self.whole,
            _ => &mut self.rest[index as usize - 1],
        }
    }

    pub fn is_cut(&self) -> bool {
        !self.rest.is_empty()
    }

    /// Calls `visit` with every leaf's number, where it is, and its share of the whole.
    pub fn for_each(&self, visit: &mut impl FnMut(u32, &Piece, f64)) {
        self.below(0, &WHOLE, 1.0, visit);
    }

    fn below(
        &self,
        index: u32,
        piece: &Piece,
        share: f64,
        visit: &mut impl FnMut(u32, &Piece, f64),
    ) {
        let Some(indices) = self.halves_of(index) else {
            return visit(index, piece, share);
        };
        for (index, half) in indices.iter().zip(halves(piece, self.edge(index))) {
            self.below(*index, &half, 0.5 * share, visit);
        }
    }

    /// The halves of a node that was cut.
    pub fn halves_of(&self, index: u32) -> Option<[u32; 2]> {
        let first = self.leaf(index).halves;
        (first != 0).then_some([first, first + 1])
    }

    /// The edge in whose middle a node was cut: the first half has its first end.
    pub fn edge(&self, index: u32) -> [usize; 2] {
        self.leaf(index).edge.map(usize::from)
    }

    /// Means of all nodes from those of the leaves.
    pub fn averages(&self, mut means: Vec<f64>) -> Vec<f64> {
        // The halves of a node stand behind it.
        for node in (0..means.len()).rev() {
            if let Some([a, b]) = self.halves_of(node as u32) {
                means[node] = 0.5 * (means[a as usize] + means[b as usize]);
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

/// Where an expression is modelled: simplices of dimension `dim` in a space of `space` dimensions.
pub(super) struct Domain<'a> {
    pub expression: &'a Expression,
    /// Of each simplex, `dim + 1` of them.
    pub vertices: Vec<[[f64; 3]; 4]>,
    /// |S|, roughly: only what is cut first depends on it.
    pub measures: Vec<f64>,
    pub dim: usize,
    pub space: usize,
    /// Data are multiplied by 2^unit.
    pub unit: i32,
}

/// What enclosing may take.
pub(super) struct Effort {
    /// ∫ |r| wanted, relative to (∫ f²)^½.
    pub tolerance: f64,
    /// Leaves in all, beyond one a simplex.
    pub budget: usize,
}

/// The corners of all parts are exact dyadic combinations, in multiples of 2 to the power of less this.
const FINEST: i32 = 40;
/// Those are cut that cost at least this part of the costliest.
const COSTLY: f64 = 0.125;
/// So many derivatives are taken at first.
const AT_FIRST: usize = 2;
/// More derivatives are worth their time where they leave less than this part.
const WORTH: f64 = 0.25;
/// … and not tried where the first leave so many times the range of f: a leaf is then longer than its waves.
const FAR: f64 = 4.0;

impl Domain<'_> {
    /// The trees of all simplices, and whether the tolerance was met.
    ///
    /// # Errors
    /// An interruption.
    pub fn enclose(&self, effort: &Effort) -> Result<Vec<Tree>> {
        let count = self.vertices.len();
        let mut trees: Vec<Tree> = (0..count)
            .into_par_iter()
            .map(|k| {
                cancel::check()?;
                let whole = self.model(k, &WHOLE, AT_FIRST);
                Ok(Tree {
                    whole,
                    rest: Vec::new(),
                })
            })
            .collect::<Result<_>>()?;
        let mut left = effort.budget;
        let mut open: Vec<Open> = (0..count)
            .map(|simplex| Open {
                simplex,
                node: 0,
                piece: WHOLE,
                is_final: false,
                order: AT_FIRST,
                measure: self.measures[simplex],
                leaf: trees[simplex].whole,
            })
            .collect();
        let mut square: f64 = open.iter().map(Open::square).sum();
        loop {
            cancel::check()?;
            let total = above_of_all(open.iter().map(Open::cost));
            if total <= effort.tolerance * square.sqrt() {
                break;
            }
            let worst = open.iter().map(Open::cost).fold(0.0, f64::max);
            let is_costly = |o: &Open| o.cost() >= COSTLY * worst && !o.is_final;
            let (mut chosen, kept): (Vec<Open>, Vec<Open>) = open.into_iter().partition(is_costly);
            open = kept;
            if chosen.is_empty() {
                break;
            }
            // What may not be cut any more may still get more derivatives.
            chosen.sort_by(|a, b| b.cost().total_cmp(&a.cost()));
            for late in chosen.iter_mut().skip(left) {
                late.is_final = true;
            }
            let made: Vec<Vec<Open>> = chosen
                .par_iter()
                .map(|parent| cancel::check().map(|()| self.improved(parent)))
                .collect::<Result<_>>()?;
            for (parent, mut made) in chosen.iter().zip(made) {
                let tree = &mut trees[parent.simplex];
                square -= parent.square();
                square += made.iter().map(Open::square).sum::<f64>();
                if let [same] = &made[..] {
                    *tree.node_mut(parent.node) = same.leaf;
                } else {
                    left -= 1;
                    let first = tree.rest.len() as u32 + 1;
                    tree.node_mut(parent.node).halves = first;
                    for (child, node) in made.iter_mut().zip(first..) {
                        child.node = node;
                        tree.rest.push(child.leaf);
                    }
                }
                open.extend(made);
            }
            square = square.max(0.0);
        }
        Ok(trees)
    }

    /// The same leaf with more derivatives, or its halves.
    fn improved(&self, parent: &Open) -> Vec<Open> {
        if parent.order < MOST && parent.leaf.is_smooth {
            let leaf = self.model(parent.simplex, &parent.piece, MOST);
            let worth = if parent.is_final { 1.0 } else { WORTH };
            if leaf.error < worth * parent.leaf.error {
                let order = MOST;
                return vec![Open {
                    leaf,
                    order,
                    ..*parent
                }];
            }
        }
        let both = halves(&parent.piece, parent.leaf.edge.map(usize::from));
        let is_exact = |x: &f64| (x * 2.0_f64.powi(FINEST)).fract() == 0.0;
        if parent.is_final || !both[0].iter().flatten().all(is_exact) {
            return vec![Open {
                is_final: true,
                ..*parent
            }];
        }
        let of = |piece: Piece| Open {
            leaf: self.model(parent.simplex, &piece, parent.order),
            piece,
            measure: 0.5 * parent.measure,
            ..*parent
        };
        both.map(of).into()
    }

    /// p, s and r on a part of a simplex from so many derivatives.
    fn model(&self, simplex: usize, piece: &Piece, order: usize) -> Leaf {
        let leaf = match (order, self.space) {
            (..=AT_FIRST, _) => self.model_of::<SECOND>(simplex, piece, order),
            (_, 2) => self.model_of::<IN_PLANE>(simplex, piece, order),
            _ => self.model_of::<IN_SPACE>(simplex, piece, order),
        };
        let vertices = &self.vertices[simplex][..=self.dim];
        let edge = longest_edge(piece, self.dim, |weights| {
            let along = |k: usize| vertices.iter().zip(weights).map(|(x, w)| w * x[k]).sum();
            let edge: [f64; 3] = std::array::from_fn(along);
            edge.iter().map(|x| x * x).sum()
        });
        Leaf {
            edge: edge.map(|corner| corner as u8),
            ..leaf
        }
    }

    fn model_of<const N: usize>(&self, simplex: usize, piece: &Piece, order: usize) -> Leaf {
        let count = self.dim + 1;
        let corners = corners(&self.vertices[simplex][..count], piece, self.space);
        let mut around = corners[0];
        for corner in &corners[1..count] {
            around = std::array::from_fn(|k| around[k].hull(corner[k]));
        }
        let scaled = |of: Taylor<N>| of.coefficients.map(|c| c.times_power_of_two(self.unit));
        let inside = self
            .expression
            .enclosure_inside(around, self.space, order, self.dim);
        let on_box = scaled(inside);
        let range = on_box[0];
        let flat = |error: f64| Leaf {
            values: [range.mid(); 4],
            error,
            ..Leaf::default()
        };
        // A constant, or nothing but the range is known.
        if range.radius() == 0.0 || !on_box[1..=self.space].iter().all(|g| g.is_finite()) {
            return flat(range.radius());
        }
        // From the middle of the box no point is far.
        let centre = around.map(|x| Interval::at(x.mid().clamp(x.low, x.high)));
        let at_centre = scaled(self.expression.enclosure(centre, self.space, order - 1));
        let steps: Vec<Vector> = corners[..count]
            .iter()
            .map(|c| std::array::from_fn(|k| c[k] - centre[k]))
            .collect();
        let monomials = Monomials::of(self.space);
        // |(x-c)^α| is at most this.
        let mut reach = [1.0; N];
        for (n, reach) in reach
            .iter_mut()
            .enumerate()
            .take(monomials.counts[order])
            .skip(1)
        {
            for (k, exponent) in monomials.exponents[n].iter().enumerate() {
                let most = steps.iter().map(|s| s[k].magnitude()).fold(0.0, f64::max);
                (0..*exponent).for_each(|_| *reach = above_of_product(*reach, most));
            }
        }
        let of_degree = |degree: usize| match degree {
            0 => 0..1,
            _ => monomials.counts[degree - 1]..monomials.counts[degree],
        };
        let sum = |size: &dyn Fn(usize) -> f64, degrees: std::ops::RangeInclusive<usize>| {
            let all = degrees.flat_map(of_degree);
            above_of_all(all.map(|n| above_of_product(size(n), reach[n])))
        };
        let rest = |m: usize| {
            let known = sum(&|n| at_centre[n].radius(), 0..=m - 1);
            up(known, sum(&|n| on_box[n].radius(), m..=m))
        };
        let rests = (1..=order).map(|m| (m, rest(m)));
        let Some((m, rest)) = rests.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return flat(range.radius());
        };
        let coefficient = |n: usize| {
            let of = if n < monomials.counts[m - 1] {
                at_centre[n]
            } else {
                on_box[n]
            };
            of.mid()
        };
        let mut wave = sum(&|n| coefficient(n).abs(), 2..=m);
        let (mut mean, mut swell) = (Interval::ZERO, wave);
        if wave > 0.0 {
            let moments = moments(monomials, &steps, monomials.counts[m]);
            let of = |n: usize| coefficient(n) * moments[n];
            let of_degree_2: Interval = of_degree(2).map(of).sum();
            mean = of_degree_2 + (monomials.counts[2]..monomials.counts[m]).map(of).sum();
            wave = up(wave, mean.magnitude());
            let quadratic = of_degree(2).map(|n| (monomials.exponents[n], coefficient(n)));
            let quadratic: Vec<_> = quadratic.filter(|(_, c)| *c != 0.0).collect();
            // The rest of degree 3 and 4 less its mean, by its size.
            let rest = 2.0 * sum(&|n| coefficient(n).abs(), 3..=m);
            if order > AT_FIRST {
                swell = wave.min(up(root_mean_square(&steps, &quadratic, of_degree_2), rest));
            }
        }
        let error = up(rest, mean.radius());
        if !(error < range.radius()) {
            return Leaf {
                is_smooth: error < FAR * range.radius(),
                ..flat(range.radius())
            };
        }
        let mut leaf = Leaf {
            wave,
            swell,
            error,
            is_smooth: true,
            ..Leaf::default()
        };
        let mut rounding = 0.0_f64;
        for (value, step) in leaf.values.iter_mut().zip(&steps) {
            let slope: Interval = (0..self.space).map(|k| coefficient(1 + k) * step[k]).sum();
            let exact = Interval::at(coefficient(0)) + Interval::at(mean.mid()) + slope;
            *value = exact.mid();
            rounding = rounding.max(exact.radius());
        }
        leaf.error = up(leaf.error, rounding);
        leaf
    }
}

/// The means of the first monomials over the simplex with these corners:
///
/// ```text
/// mean of x^α = α! d!/(|α|+d)! [t^α] Π_i 1/(1 - t·x_i)
/// ```
///
/// as that of (t·x)^m is d! m!/(m+d)! times the complete homogeneous polynomial of degree m of the t·x_i.
fn moments(monomials: &Monomials, corners: &[Vector], count: usize) -> [Interval; IN_SPACE] {
    let mut series = [Interval::ZERO; IN_SPACE];
    series[0] = Interval::ONE;
    for corner in corners {
        // P_α of P/(1 - t·x) is P_α + Σ_k x_k P_(α - e_k): by degree.
        for n in 1..count {
            for (k, lower) in monomials.lower[n].iter().enumerate() {
                if let Some(lower) = lower {
                    series[n] += corner[k] * series[*lower as usize];
                }
            }
        }
    }
    let shares = &monomials.shares[corners.len() - 1];
    for (moment, share) in series.iter_mut().zip(shares).take(count) {
        *moment = *share * *moment;
    }
    series
}

/// √ of the mean square of Σ c_α x^α, |α| = 2, less its mean over the simplex with these corners at most.
fn root_mean_square(corners: &[Vector], terms: &[([u8; 3], f64)], mean: Interval) -> f64 {
    let points: Vec<[f64; 3]> = corners.iter().map(|c| c.map(Interval::mid)).collect();
    let all = corners.iter().flatten();
    let (radius, largest) = all.fold((0.0, 0.0), |(radius, largest): (f64, f64), c| {
        (radius.max(c.radius()), largest.max(c.magnitude()))
    });
    let value = |x: [f64; 3]| {
        let power = |e: &[u8; 3]| (0..3).map(|k| x[k].powi(i32::from(e[k]))).product::<f64>();
        terms.iter().map(|(e, c)| c * power(e)).sum::<f64>() - mean.mid()
    };
    // Points are off by `radius` and a rounding.
    let sizes: f64 = terms.iter().map(|(_, c)| c.abs()).sum();
    let radius = radius + f64::EPSILON * largest;
    let size = sizes * largest * largest + mean.magnitude();
    let off =
        sizes * radius * (2.0 * largest + radius) + mean.radius() + 16.0 * f64::EPSILON * size;
    Quadratic::scalar(&points, value, off, size)
        .mean_square(corners.len() - 1)
        .root()
        .high
}

/// A leaf that may be cut.
#[derive(Clone, Copy)]
struct Open {
    simplex: usize,
    node: u32,
    piece: Piece,
    /// May it not be cut any more?
    is_final: bool,
    /// So many derivatives are taken.
    order: usize,
    measure: f64,
    leaf: Leaf,
}

impl Open {
    /// ∫ |r|
    fn cost(&self) -> f64 {
        self.leaf.cost(self.measure)
    }

    /// ∫ f², roughly.
    fn square(&self) -> f64 {
        self.measure * self.leaf.size().powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::{exact, parts};

    /// Points and weights of a composite rule on 4^dim parts.
    fn points(dim: usize) -> Vec<([f64; 4], f64)> {
        let twice = parts(&WHOLE, dim)
            .into_iter()
            .flat_map(|part| parts(&part, dim));
        let twice: Vec<Piece> = twice.collect();
        let share = 1.0 / twice.len() as f64;
        let of = |part: &Piece| -> Vec<([f64; 4], f64)> {
            let inside = |inner: [f64; 4]| {
                std::array::from_fn(|i| (0..=dim).map(|k| inner[k] * part[k][i]).sum())
            };
            let rule = exact(dim, 5);
            rule.iter().map(|(l, w)| (inside(l), share * w)).collect()
        };
        twice.iter().flat_map(of).collect()
    }

    /// On random cells and faces: what is said of f - p holds at the points of a rule, in its mean and in its mean square.
    #[test]
    fn models_hold_the_function() {
        let mut random = crate::Random::new(3);
        let mut random = || random.next();
        for text in [
            "sin(3*x + y - z) + x^2*y",
            "exp(x*y) / (2 + z) - x^y",
            "sqrt(2 + x - y) * cos(2*z)",
            "atan2(1 + y, 2 + x) + tanh(3*x)*z",
            "(x - 0.5)^4 - 2*(y - 0.3)^3*x + x*y*z",
            "abs(x - 0.4) + if(y < 0.6, 0, 1)",
        ] {
            let expression = Expression::parse(text).unwrap();
            for (dim, space) in [(1, 2), (2, 2), (2, 3), (3, 3)] {
                for _ in 0..40 {
                    let size = 0.4 * 10f64.powf(-2.0 * random());
                    let first: [f64; 3] = std::array::from_fn(|_| 0.3 + random());
                    let mut corner = || -> [f64; 3] {
                        let mut at = |k: usize| first[k] + size * random();
                        std::array::from_fn(|k| if k < space { at(k) } else { 0.0 })
                    };
                    let vertices: [[f64; 3]; 4] = std::array::from_fn(|_| corner());
                    let domain = Domain {
                        expression: &expression,
                        vertices: vec![vertices],
                        measures: vec![1.0],
                        dim,
                        space,
                        unit: 0,
                    };
                    let left = |lambda: &[f64; 4], leaf: &Leaf| {
                        let all = vertices.iter().zip(lambda).take(dim + 1);
                        let x = std::array::from_fn(|k| all.clone().map(|(v, l)| l * v[k]).sum());
                        let linear = leaf.values.iter().zip(lambda).take(dim + 1);
                        expression.value(x) - linear.map(|(p, l)| p * l).sum::<f64>()
                    };
                    let errors = [AT_FIRST, MOST].map(|order| {
                        let leaf = domain.model(0, &WHOLE, order);
                        let (mut mean, mut square) = (0.0, 0.0);
                        for (lambda, weight) in points(dim) {
                            let off = left(&lambda, &leaf);
                            assert!(
                                off.abs() <= leaf.wave + leaf.error + 1e-12,
                                "{text} {leaf:?}"
                            );
                            mean += weight * off;
                            square += weight * off * off;
                        }
                        if leaf.is_smooth {
                            // The rule has an error of its own.
                            let slack = 1e-12 + 1e-5 * size.powi(6);
                            assert!(mean.abs() <= leaf.error + slack, "{text} {mean} {leaf:?}");
                            let root = square.sqrt();
                            assert!(
                                root <= leaf.swell + leaf.error + slack,
                                "{text} {root} {leaf:?}"
                            );
                        }
                        leaf.error
                    });
                    // Third and fourth derivatives are worth their time.
                    if size < 0.1 && !text.contains("if") {
                        let [second, fourth] = errors;
                        assert!(fourth <= 0.02 * second + 1e-13, "{text} {size} {errors:?}");
                    }
                }
            }
        }
    }
}
