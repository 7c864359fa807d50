//! Means over a simplex of the product of what an expression is there, p + s + r by leaves, and
//!
//! ```text
//! w = Σ_i z_i λ_i + Σ_F 4 b_F λ_a λ_b.
//! ```
//!
//! (p, w) is a sum of moments of p. As s has mean 0 on each leaf S, and Σ_i λ_i = 1,
//!
//! ```text
//! |(s, w)_S| ≤ ‖s‖ max_S |w - w̄_S|,   w - w̄_S = Σ_i (z_i - z_k) (λ_i - λ̄_i) for any k where all b are 0,
//! |(r, w)_S| ≤ ∫_S |r| max_S |w|.
//! ```

use super::simplex::{bubble_on, mean_with_bubble};
use super::tree::Tree;
use crate::interval::Interval;
use crate::quadrature::Piece;

/// Moments of an expression on a simplex that was cut: products of any w come from them, however many leaves there are.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    /// Of p.
    pub mean: Interval,
    /// Of p λ_i.
    pub corners: [Interval; 4],
    /// Of p 4 λ_a λ_b: in 2D by the vertex opposite, on a line the first.
    pub bubbles: [Interval; 3],
    /// The mean of ‖s‖ max |λ_i - λ̄_i| over the leaves.
    waves: [f64; 4],
    /// That of |r| max λ_i.
    rests: [f64; 4],
    /// |(s + r, 4 λ_a λ_b)| at most, as a mean.
    off_bubbles: [f64; 3],
}

impl Moments {
    pub fn of(tree: &Tree, dim: usize) -> Self {
        let (at, count) = (Interval::at, dim + 1);
        let edges: &[[usize; 2]] = match dim {
            1 => &[[0, 1]],
            2 => &[[1, 2], [2, 0], [0, 1]],
            _ => &[],
        };
        let mut mean = Interval::ZERO;
        let [mut corners, mut waves, mut rests] = [[Interval::ZERO; 4]; 3];
        let [mut bubbles, mut off_bubbles] = [[Interval::ZERO; 3]; 2];
        tree.for_each(&mut |node, piece: &Piece, share| {
            let leaf = tree.leaf(node);
            let (values, share) = (leaf.values.map(at), at(share));
            let (swell, rest) = (at(leaf.swell), at(leaf.unknown()));
            let all: Interval = values[..count].iter().copied().sum();
            mean += share * all / at(count as f64);
            for i in 0..count {
                let lambda: Vec<Interval> = piece[..count].iter().map(|x| at(x[i])).collect();
                let sides: Interval = lambda.iter().copied().sum();
                let mixed: Interval = lambda.iter().zip(&values).map(|(l, p)| *l * *p).sum();
                corners[i] += share * (mixed + all * sides) / at((count * (count + 1)) as f64);
                let (away, largest) = reach(&lambda);
                waves[i] += share * swell * at(away);
                rests[i] += share * rest * at(largest);
            }
            for (k, edge) in edges.iter().enumerate() {
                let w = bubble_on(piece, *edge, dim);
                bubbles[k] += share * mean_with_bubble(&values, &w, dim);
                // No value is larger than the largest coefficient.
                let (away, largest) = match dim {
                    1 => reach(&[w[0], w[1], w[4]]),
                    _ => reach(&[w[0], w[1], w[2], w[4], w[5], w[6]]),
                };
                off_bubbles[k] += share * (swell * at(away) + rest * at(largest));
            }
        });
        Moments {
            mean,
            corners,
            bubbles,
            waves: waves.map(|of| of.high),
            rests: rests.map(|of| of.high),
            off_bubbles: off_bubbles.map(|of| of.high),
        }
    }

    /// The mean of the product with w.
    fn with(&self, z: &[Interval], b: [f64; 3]) -> Interval {
        let at = Interval::at;
        let p: Interval = z.iter().zip(self.corners).map(|(z, p)| *z * p).sum();
        let bent: Interval = b.iter().zip(self.bubbles).map(|(b, p)| *b * p).sum();
        let from = |k: usize| -> f64 {
            let steps = z.iter().map(|other| (*other - z[k]).abs());
            let sum: Interval = steps.zip(self.waves).map(|(step, s)| step * at(s)).sum();
            sum.high
        };
        let of_wave = (0..z.len()).map(from).fold(f64::INFINITY, f64::min);
        let of_rest: Interval = z.iter().zip(self.rests).map(|(z, r)| z.abs() * at(r)).sum();
        let of_bubbles = b.iter().zip(self.off_bubbles);
        let of_bubbles: Interval = of_bubbles.map(|(b, off)| at(b.abs()) * at(off)).sum();
        p + bent + Interval::around_zero((at(of_wave) + of_rest + of_bubbles).high)
    }
}

/// The mean of f w on a cell.
pub(super) fn mean_of_product(tree: &Tree, z: &[Interval], b: Option<[f64; 3]>) -> Interval {
    let b = b.unwrap_or_default();
    match &tree.moments {
        Some(moments) => moments.with(z, b),
        None => with_one_model(tree, z, b),
    }
}

/// The same with one model of f: in f64, with one bound of all rounding.
fn with_one_model(tree: &Tree, z: &[Interval], b: [f64; 3]) -> Interval {
    let leaf = &tree.whole;
    let p = &leaf.values[..z.len()];
    let count = z.len() as f64;
    let size = |of: &mut dyn Iterator<Item = f64>| of.fold(0.0, |m: f64, x| m.max(x.abs()));
    let (of_p, of_b) = (size(&mut p.iter().copied()), size(&mut b.into_iter()));
    let of_z = z.iter().map(|z| z.magnitude()).fold(0.0, f64::max);
    let around = z.iter().map(|z| z.high - z.low).fold(0.0, f64::max);
    let (all, total): (f64, f64) = (p.iter().sum(), z.iter().map(|z| z.mid()).sum());
    let mixed: f64 = p.iter().zip(z).map(|(p, z)| p * z.mid()).sum();
    // The mean of λ_i 4 λ_a λ_b is 2/15 for i = a, b and 1/15 for the third.
    let bent: f64 = b.iter().zip(p).map(|(b, p)| b * (2.0 * all - p)).sum();
    let mean = (mixed + all * total) / (count * (count + 1.0)) + bent / 15.0;
    // Bernstein's coefficients of w; no value is larger than the largest, and the wave has mean 0.
    let middle = total / count;
    let away = size(&mut z.iter().map(|z| z.mid() - middle));
    // What carries the wave has its mean.
    let (carried, in_wave) = match &tree.carried {
        Some(carried) => (carried.mean(z, &b), 0.0),
        None => (Interval::ZERO, away + around + 2.0 * of_b),
    };
    let slack =
        leaf.swell * (in_wave + 8.0 * f64::EPSILON * of_z) + leaf.unknown() * (of_z + 2.0 * of_b);
    // Fewer than 32 roundings, each of no more than the largest of f w or so.
    let rounding = 32.0 * f64::EPSILON * of_p * (of_z + 4.0 * of_b) + of_p * around;
    let off = 1.001 * (slack + rounding) + f64::MIN_POSITIVE;
    Interval::new(mean - off, mean + off) + carried
}

/// How far values are from their mean at most, and the largest of their sizes.
pub(super) fn reach(values: &[Interval]) -> (f64, f64) {
    let mean = values.iter().copied().sum::<Interval>() / Interval::at(values.len() as f64);
    let away = values
        .iter()
        .map(|v| (*v - mean).magnitude())
        .fold(0.0, f64::max);
    (
        away,
        values.iter().map(|v| v.magnitude()).fold(0.0, f64::max),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::tree::Leaf;
    use crate::quadrature::exact;

    /// Random trees of three leaves: the product with p is that of a rule, and what s and r may be is in its radius, each.
    #[test]
    fn products_come_from_moments() {
        let mut random = crate::Random::new(8);
        for (dim, with_wave, with_rest, k) in (0..80).map(|k| (1 + k % 3, k % 2 == 0, k % 5 < 3, k))
        {
            let mut leaf = |parts: u32| Leaf {
                values: std::array::from_fn(|_| random.next() - 0.4),
                swell: if with_wave { random.next() } else { 0.0 },
                error: if with_rest { random.next() } else { 0.0 },
                spots: [if with_rest { random.next() } else { 0.0 }; 2],
                edge: if parts == 1 { [0, 1] } else { [1, 0] },
                at: 0.25,
                parts,
                ..Leaf::default()
            };
            let mut tree = Tree {
                whole: leaf(1),
                rest: vec![leaf(0), leaf(3), leaf(0), leaf(0)],
                ..Tree::default()
            };
            tree.moments = Some(Box::new(Moments::of(&tree, dim)));
            let z: [f64; 4] = std::array::from_fn(|_| random.next() - 0.5);
            let mut b: [f64; 3] = std::array::from_fn(|_| random.next() - 0.5);
            match (dim, k % 4) {
                (2, 0..=2) => {}
                (1, 0..=2) => b[1..].fill(0.0),
                _ => b.fill(0.0),
            }
            let w = |x: &[f64; 4]| -> f64 {
                let flat: f64 = z[..=dim].iter().zip(x).map(|(z, x)| z * x).sum();
                flat + match dim {
                    1 => 4.0 * b[0] * x[0] * x[1],
                    2 => 4.0 * (b[0] * x[1] * x[2] + b[1] * x[2] * x[0] + b[2] * x[0] * x[1]),
                    _ => 0.0,
                }
            };
            let size: f64 = z[..=dim].iter().chain(&b).map(|of| of.abs()).sum();
            let (mut product, mut least, mut most) = (0.0, 0.0, 1e-14);
            tree.for_each(&mut |node, piece, share| {
                let leaf = tree.leaf(node);
                let rule = exact(dim, 4);
                let inside = |l: &[f64; 4]| -> [f64; 4] {
                    std::array::from_fn(|i| (0..=dim).map(|j| l[j] * piece[j][i]).sum())
                };
                let mean = |of: &dyn Fn(&[f64; 4]) -> f64| -> f64 {
                    rule.iter().map(|(l, weight)| weight * of(&l)).sum()
                };
                let p = |l: &[f64; 4]| (0..=dim).map(|j| l[j] * leaf.values[j]).sum::<f64>();
                product += share * mean(&|l| p(l) * w(&inside(l)));
                let middle = mean(&|l| w(&inside(l)));
                let away = mean(&|l| (w(&inside(l)) - middle).powi(2)).sqrt();
                let corners = piece[..=dim].iter().map(|x| w(x).abs());
                let largest = corners.fold(middle.abs(), f64::max);
                least += share * (leaf.swell * away + leaf.unknown() * largest);
                most += share * 2.0 * (leaf.swell + leaf.unknown()) * size;
            });
            let found = mean_of_product(&tree, &z.map(Interval::at)[..=dim], Some(b));
            assert!((found.mid() - product).abs() < 1e-14, "{dim} {b:?}");
            assert!(
                least <= found.radius() && found.radius() <= most,
                "{dim} {b:?} {} {least}",
                found.radius()
            );
        }
    }
}
