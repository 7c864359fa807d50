//! Where an expression jumps on a surface through a simplex, as an `if` does: the side that most of the simplex is on, the share
//! of it on the other, and where a cut follows the surface.
//!
//! The condition asks for the sign of a function g. On a simplex S with a point c it is known, by Taylor's formula of order 1 or
//! 2, to be
//!
//! ```text
//! g(x) = a + b·(x-c),   a in [a_0 - r_0, a_0 + r_0],   b_k in [m_k - r_k, m_k + r_k],
//! ```
//!
//! so that |g - l| ≤ ε = r_0 + Σ_k r_k max |x_k - c_k| there with l(x) = a_0 + m·(x-c).
//!
//! So g ≤ 0 only where Σ_k a_k λ_k ≤ τ with a_k = l(x_k) - min l and τ = ε - min l. Of the barycentric coordinates of a point that
//! is distributed uniformly on S, of dimension d, any m have a density of at most d!/(d-m)!, and m numbers λ_k ≥ 0 with
//! Σ a_k λ_k ≤ τ fill the volume τ^m/(m! Π a_k). That is no more than the share
//!
//! ```text
//! C(d, m) τ^m / Π a_k,   over any m ≤ d vertices with a_k > 0,
//! ```
//!
//! of S. Where l changes its sign from one end of an edge to the other, cuts there leave parts with one sign of l each.

use super::simplex::{Vector, around};
use crate::interval::{Interval, above_of_all};
use crate::scene::Expression;
use crate::scene::expression::{Condition, Monomials, SECOND_IN_SPACE};

/// How a simplex meets the surfaces where an expression jumps.
pub(super) struct Jump {
    /// The values of the conditions on most of the simplex, in the order of the expression.
    pub chosen: Vec<Option<bool>>,
    /// No more of the simplex than this has other conditions.
    pub share: f64,
    /// Where a cut follows a surface best.
    pub cut: Option<Cut>,
}

/// A cut that follows a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// An edge that crosses it …
    pub edge: [usize; 2],
    /// … and the share of the edge at its first end.
    pub at: f64,
    /// The share of the simplex that is then on the wrong side, roughly.
    pub wrong: f64,
}

/// Cuts are at multiples of this share of an edge: four on each other have exact shares of a simplex.
const GRAIN: f64 = 1.0 / (1_u32 << 13) as f64;
/// A cut is worth it where l is this many times ε on the other side: it would follow its own parts for ever otherwise.
const CLEARLY: f64 = 4.0;

/// None if no condition changes, or its surface is not known.
pub(super) fn find(expression: &Expression, corners: &[Vector], axes: &[usize]) -> Option<Jump> {
    let around = around(corners);
    let count = corners.len() as f64;
    let middle = |k: usize| {
        let sum: f64 = corners.iter().map(|x| x[k].mid()).sum();
        Interval::at((sum / count).clamp(around[k].low, around[k].high))
    };
    let centre: Vector = std::array::from_fn(middle);
    let (mut on_box, mut at_centre) = (Vec::new(), Vec::new());
    expression.over_by(around, axes, 2, None, &[], Some(&mut on_box));
    expression.over_by(centre, axes, 1, None, &[], Some(&mut at_centre));
    let mut jump = Jump {
        chosen: vec![None; on_box.len()],
        share: 0.0,
        cut: None,
    };
    let (mut shares, mut cuts) = (Vec::new(), Vec::new());
    for (k, condition) in on_box.iter().enumerate() {
        if condition.decided.is_some() {
            continue;
        }
        let surface = Surface::new([condition, &at_centre[k]], corners, centre, axes)?;
        jump.chosen[k] = Some(condition.is_less != surface.is_above);
        shares.push(surface.other_share()?);
        cuts.extend(surface.cut());
    }
    jump.cut = cuts.into_iter().min_by(|a, b| a.wrong.total_cmp(&b.wrong));
    jump.share = above_of_all(shares).min(1.0);
    jump.chosen.iter().any(Option::is_some).then_some(jump)
}

/// l, with its sign turned where it is negative on average.
struct Surface {
    /// At the corners.
    values: Vec<Interval>,
    /// ε
    slack: Interval,
    /// Whether it was positive on average.
    is_above: bool,
}

impl Surface {
    fn new(
        [on_box, at_centre]: [&Condition<SECOND_IN_SPACE>; 2],
        corners: &[Vector],
        centre: Vector,
        axes: &[usize],
    ) -> Option<Self> {
        let [inside, middle] = [&on_box.difference, &at_centre.difference];
        if inside.may_jump {
            return None;
        }
        let steps = |x: &Vector| -> Vec<Interval> {
            axes.iter().map(|axis| x[*axis] - centre[*axis]).collect()
        };
        let steps: Vec<Vec<Interval>> = corners.iter().map(steps).collect();
        let reach = |k: usize| steps.iter().map(move |s| s[k]).reduce(Interval::hull);
        let reach: Vec<Interval> = (0..axes.len()).map_while(reach).collect();
        let monomials = Monomials::of(axes.len());
        let second = monomials.counts[1]..monomials.counts[2];
        let bent: Interval = second
            .map(|n| {
                let powers = reach.iter().zip(monomials.exponents[n]);
                let power = powers.map(|(s, e)| s.powi(e.into()));
                power.fold(inside.coefficients[n], |product, s| product * s)
            })
            .sum();
        let count = axes.len();
        let by_order = [
            (middle.value(), &inside.coefficients[1..=count]),
            (middle.value() + bent, &middle.coefficients[1..=count]),
        ];
        let known = by_order.map(|(a, slopes)| {
            let off = slopes.iter().zip(&reach).map(|(b, s)| {
                let radius = if b.is_finite() {
                    b.radius()
                } else {
                    f64::INFINITY
                };
                Interval::at(radius) * Interval::at(s.magnitude())
            });
            (a, slopes, Interval::at(a.radius()) + off.sum::<Interval>())
        });
        let is_known =
            |(a, _, slack): &(Interval, &[Interval], Interval)| a.is_finite() && slack.is_finite();
        let known = known.into_iter().filter(is_known);
        let (a, slopes, slack) = known.min_by(|a, b| a.2.high.total_cmp(&b.2.high))?;
        let value = |step: &Vec<Interval>| -> Interval {
            let rise = step.iter().zip(slopes).map(|(s, b)| b.mid() * *s);
            Interval::at(a.mid()) + rise.sum::<Interval>()
        };
        let values: Vec<Interval> = steps.iter().map(value).collect();
        let is_above = values.iter().map(|l| l.mid()).sum::<f64>() > 0.0;
        let turned = |l: &Interval| if is_above { *l } else { -*l };
        Some(Surface {
            values: values.iter().map(turned).collect(),
            slack,
            is_above,
        })
    }

    /// The largest share of the simplex on which g has not the sign that l has on average.
    fn other_share(&self) -> Option<f64> {
        let mut lows: Vec<f64> = self.values.iter().map(|l| l.low).collect();
        lows.sort_by(f64::total_cmp);
        let (low, others) = lows.split_first()?;
        let short = self.slack - Interval::at(*low);
        if short.high < 0.0 {
            return Some(0.0);
        }
        let shares = others.iter().rev().enumerate();
        let shares = shares.scan(Interval::ONE, |share, (m, value)| {
            let rise = Interval::at(*value) - Interval::at(*low);
            let of = Interval::at((others.len() - m) as f64) / Interval::at(m as f64 + 1.0);
            *share = *share * of * (short / rise);
            (rise.low > 0.0).then_some(share.high)
        });
        shares.min_by(f64::total_cmp)
    }

    /// On the edge along which l changes most of those on which it changes its sign; none where nearly all of the simplex is on
    /// one side.
    fn cut(&self) -> Option<Cut> {
        let values: Vec<f64> = self.values.iter().map(|l| l.mid()).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (slack, wide) = (self.slack.high, high - low);
        let wrong = 2.0 * (values.len() - 1) as f64 * slack / wide;
        if -low <= CLEARLY * slack + GRAIN * wide {
            return None;
        }
        let edges = (1..values.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        let rise = |[i, j]: &[usize; 2]| (values[*j] - values[*i]).abs();
        let crossing = edges.filter(|[i, j]| values[*i] * values[*j] < 0.0);
        let edge = crossing.max_by(|a, b| rise(a).total_cmp(&rise(b)))?;
        let [i, j] = edge.map(|corner| values[corner]);
        let at = i / (i - j);
        let at = (at / GRAIN).round() * GRAIN;
        (0.0 < at && at < 1.0).then_some(Cut { edge, at, wrong })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear functions that are negative at a corner, at two, or nearly: the share where they are below ε is no larger than
    /// bounded, by random points, and at one corner it is the share of a cone.
    #[test]
    fn shares_hold_what_points_find() {
        const POINTS: usize = 4000;
        let mut random = crate::Random::new(12);
        for k in 0..120 {
            let dim = 2 + k % 2;
            let mut at = |low: f64| Interval::at(low + random.next());
            let mut values = vec![at(0.1), at(0.1), at(0.1), at(0.1)];
            values.truncate(dim + 1);
            let below = 1 + k / 2 % dim;
            values[..below]
                .iter_mut()
                .for_each(|l| *l = Interval::at(-0.05 * l.mid()));
            let slack = Interval::at(0.1 * random.next());
            let surface = Surface {
                values: values.clone(),
                slack,
                is_above: true,
            };
            let share = surface.other_share().unwrap();
            let found = (0..POINTS).filter(|_| {
                let mut inner = vec![0.0; dim + 1];
                inner.fill_with(|| -random.next().ln());
                let sum: f64 = inner.iter().sum();
                let at = inner.iter().zip(&values);
                at.map(|(x, l)| x / sum * l.mid()).sum::<f64>() <= slack.high
            });
            let found = found.count() as f64 / POINTS as f64;
            let deviation = (share.min(1.0) / POINTS as f64).sqrt();
            assert!(found <= share + 6.0 * deviation, "{found} {share}");
            if below == 1 {
                let short = slack.high - values[0].mid();
                let cone = values[1..]
                    .iter()
                    .map(|l| short / (l.mid() - values[0].mid()));
                assert!(share <= cone.product::<f64>() * (1.0 + 1e-12));
            }
        }
    }
}
