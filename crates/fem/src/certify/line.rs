//! Data that hang on one axis, on a triangle that is longer than their waves: s = f - p is the divergence of an explicit flux.
//!
//! Let f hang on x alone, w(x) be the length of the triangle's section at x and p constant or linear in x with (f - p, 1) = 0.
//! In the coordinates (x, θ), θ from 0 to 1 along each section, at the height Y(x, θ),
//!
//! ```text
//! τ = -(Φ/w) (1, ∂Y/∂x),    Φ(x) = ∫ s w up to x
//! ```
//!
//! has -div τ = s and no flux through the boundary, as (1, ∂Y/∂x) is a tangent where θ is 0 or 1 and Φ is 0 at both ends (Piola's
//! transform of (Φ, 0)). So (s, z)_κ = (τ, ∇z)_κ, with
//!
//! ```text
//! ‖τ‖² = ∫ (Φ²/w) (1 + mean of (∂Y/∂x)² over θ) dx
//! ```
//!
//! and for a quadratic z, on whose section at x it has the mean z(x, Y(x, ½)) + ∂²z/∂y² w²/24,
//!
//! ```text
//! (s, z) = ∫ s w (z(x, Y(x, ½)) + ∂²z/∂y² w²/24) dx
//! ```
//!
//! All but the slopes is the same for triangles with the same corners along x, as cells in a column have. f is a polynomial on
//! each of some pieces of the axis, by Taylor's formula with its remainder in interval arithmetic; Φ²/w is enclosed as 1/w is
//! between its chord and its tangent.

use super::model::Leaf;
use super::simplex::up;
use crate::interval::{Interval, above_of_all};
use crate::scene::Expression;
use crate::scene::expression::{MOST, ON_LINE, Taylor, spanned};

/// τ on a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Carried {
    /// The mean of |τ|².
    pub square: Interval,
    /// The means of s λ_i.
    pub flat: [Interval; 3],
    /// The means of s 4 λ_a λ_b, by the vertex opposite.
    pub bubbles: [Interval; 3],
}

impl Carried {
    /// The mean of s z, z = Σ z_i λ_i + Σ_F 4 b_F λ_a λ_b.
    pub fn mean(&self, z: &[Interval], b: &[f64; 3]) -> Interval {
        let flat: Interval = self.flat.iter().zip(z).map(|(s, z)| *s * *z).sum();
        let bubbles = self.bubbles.iter().zip(b);
        flat + bubbles.map(|(s, b)| *b * *s).sum()
    }
}

/// f along an axis as three corners of a triangle have it, the heights of its sections scaled to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    /// p = p₀ + p₁ (x - x̄)
    p: [f64; 2],
    middle: f64,
    /// |s|, √ of the mean of s², |r| at most
    wave: f64,
    swell: f64,
    error: f64,
    /// ∫ Φ²/w from the first corner to the second and on to the third, relative to the whole length.
    squares: [Interval; 2],
    /// As [`Carried`] has them.
    flat: [Interval; 3],
    bubbles: [Interval; 3],
}

/// Parts of a side of a triangle at most, and of one that is cut.
const PARTS: usize = 256;
const AT_ONCE: f64 = 32.0;
/// Errors are of this order in the length of a part, or a bit more.
const ORDER: f64 = 4.5;
/// p has a slope where the mean square of that is so many times that of s: σ is no gradient then, and (σ, τ) known less well.
const STEEP: f64 = 10.0;
/// Twice what rounding to nearest errs by, relative to the result.
const STEP: f64 = f64::EPSILON;

/// f on a piece of the axis: Σ a_j (x - c)^j up to an error.
pub(super) struct Part {
    ends: [f64; 2],
    centre: f64,
    /// |x - c| is at most this, and at the ends less by no more than this part of it.
    reach: f64,
    skew: f64,
    series: Polynomial<ON_LINE>,
    error: f64,
}

/// A polynomial in (x - c)/reach on a part of the axis, in f64 with one bound of all that it is off anywhere.
#[derive(Clone, Copy)]
struct Polynomial<const N: usize> {
    coefficients: [f64; N],
    off: f64,
}

/// An expression along an axis.
pub(super) struct Axis<'a> {
    pub expression: &'a Expression,
    pub axis: usize,
    /// Data are multiplied by 2^unit.
    pub unit: i32,
    /// Errors wanted.
    pub aim: f64,
}

impl Axis<'_> {
    /// f from one number to another; none where so many pieces do not reach the error wanted.
    pub fn parts(&self, ends: [f64; 2]) -> Option<Vec<Part>> {
        let mut parts = Vec::new();
        let least = (ends[1] - ends[0]) / PARTS as f64;
        (ends[0] >= ends[1] || self.cut(ends, least, &mut parts)).then_some(parts)
    }

    /// Cuts a part of the axis until the error is small enough everywhere.
    fn cut(&self, ends: [f64; 2], least: f64, parts: &mut Vec<Part>) -> bool {
        let part = self.part(ends);
        if part.error <= self.aim {
            parts.push(part);
            return parts.len() <= PARTS;
        }
        let count = (part.error / self.aim).powf(1.0 / ORDER).ceil();
        let count = count.clamp(2.0, AT_ONCE);
        let width = (ends[1] - ends[0]) / count;
        let mut from = ends[0];
        for k in 1..=count as usize {
            let to = if k as f64 == count {
                ends[1]
            } else {
                ends[0] + k as f64 * width
            };
            // Where parts get that small there is a jump, or a pole.
            if !(from < to && width >= least && self.cut([from, to], least, parts)) {
                return false;
            }
            from = to;
        }
        true
    }

    fn part(&self, ends: [f64; 2]) -> Part {
        let centre = 0.5 * ends[0] + 0.5 * ends[1];
        let on = |x: Interval| {
            let mut place = [Interval::ZERO; 3];
            place[self.axis] = x;
            place
        };
        let all = on(Interval::new(ends[0], ends[1]));
        let of = self.expression;
        let inside: Taylor<ON_LINE> = of.over(all, &[self.axis], MOST, spanned(all, 1));
        let middle: Taylor<ON_LINE> =
            of.enclosure(on(Interval::at(centre)), &[self.axis], MOST - 1);
        let mut known = middle.coefficients;
        known[MOST] = inside.coefficients[MOST];
        let away = ends.map(|x| (Interval::at(x) - Interval::at(centre)).abs());
        let reach = away[0].high.max(away[1].high);
        let least = away[0].low.min(away[1].low);
        let mut power = Interval::ONE;
        let known = known.map(|c| {
            let scaled = c.times_power_of_two(self.unit) * power;
            power = power * Interval::at(reach);
            scaled
        });
        let is_known = known.iter().all(|c| c.is_finite());
        let series = Polynomial::of(known);
        Part {
            ends,
            centre,
            reach,
            skew: 1.0 - least / reach + STEP,
            // What is not known of f is r.
            series: Polynomial { off: 0.0, ..series },
            error: if is_known { series.off } else { f64::INFINITY },
        }
    }
}

impl Part {
    /// a + b (x - x₀)
    fn line(&self, a: Interval, b: Interval, from: Interval) -> Polynomial<2> {
        let there = Interval::at(self.centre) - from;
        Polynomial::of([a + b * there, b * Interval::at(self.reach)])
    }

    /// ∫ of a polynomial.
    fn integral<const N: usize>(&self, of: &Polynomial<N>) -> Interval {
        let mut sum = 0.0;
        for (k, c) in of.coefficients.iter().enumerate().step_by(2) {
            sum += 2.0 * c / (k + 1) as f64;
        }
        // The ends, and no more roundings than coefficients.
        let ends = 2.0 * (self.skew + N as f64 * STEP) * of.size();
        Interval::at(self.reach) * around(sum, 2.0 * of.off + ends)
    }

    /// The primitive that has this value at an end.
    fn primitive(&self, of: &Polynomial<6>, value: Interval, end: f64) -> Polynomial<7> {
        let mut whole = Polynomial {
            coefficients: [0.0; 7],
            off: self.reach * (of.off + 2.0 * STEP * of.size()) + f64::MIN_POSITIVE,
        };
        for (k, c) in of.coefficients.iter().enumerate() {
            whole.coefficients[k + 1] = self.reach * c / (k + 1) as f64;
        }
        let first = value - self.at_end(&whole, end);
        whole.coefficients[0] = first.mid();
        // What it was off at the end is in its first coefficient now, and everywhere.
        whole.off += first.radius();
        whole
    }

    /// The value at the first end, -1, or the last, 1.
    fn at_end<const N: usize>(&self, of: &Polynomial<N>, end: f64) -> Interval {
        let sum = of
            .coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, c| end * sum + c);
        let steep = N as f64 * (self.skew + STEP) * of.size();
        around(sum, of.off + steep)
    }
}

impl Part {
    /// ℓ ∫ Φ²/w on the part at a tip, the first end or the last: Φ = (d²/ℓ) Σ_j s_j d^j/(j+2) at the distance d, w = d/ℓ.
    fn at_tip(&self, s: &Polynomial<ON_LINE>, tip: usize) -> Interval {
        let at = Interval::at;
        let reach = at(self.reach);
        let away = (at(self.ends[tip]) - at(self.centre)) / reach;
        // About the tip, in multiples of the reach.
        let mut here = s.coefficients.map(at);
        for first in 0..ON_LINE - 1 {
            for k in (first..ON_LINE - 1).rev() {
                here[k] = here[k] + away * here[k + 1];
            }
        }
        let sign = if tip == 0 { 1.0_f64 } else { -1.0 };
        let terms: [Interval; ON_LINE] =
            std::array::from_fn(|j| sign.powi(j as i32) * here[j] / at(j as f64 + 2.0));
        let width = (at(self.ends[1]) - at(self.ends[0])) / reach;
        let mut square = Interval::ZERO;
        for n in (0..2 * ON_LINE - 1).rev() {
            let pairs = (0..ON_LINE).filter(|i| (n + 1..=n + ON_LINE).contains(&(i + ON_LINE)));
            let pairs = pairs.map(|i| terms[i] * terms[n - i]);
            square = square * width + pairs.sum::<Interval>() / at(n as f64 + 4.0);
        }
        // What s is off: no more than off/2 of the last factor of Φ.
        let norm = (square * width.square().square()).root();
        let off = 0.25 * at(s.off) * width.square();
        let most = (norm + off).square().high;
        let least = (norm - off).low.max(0.0);
        Interval::new(at(least).square().low, most) * reach.square().square()
    }
}

/// What is no farther from a number than this, rounded in some steps.
fn around(middle: f64, radius: f64) -> Interval {
    Interval::at(middle) + Interval::around_zero(1.001 * radius + f64::MIN_POSITIVE)
}

impl<const N: usize> Polynomial<N> {
    fn of(coefficients: [Interval; N]) -> Self {
        Polynomial {
            coefficients: coefficients.map(Interval::mid),
            off: above_of_all(coefficients.map(Interval::radius)),
        }
    }

    /// No value is larger, but for what it is off.
    fn size(&self) -> f64 {
        self.coefficients.iter().map(|c| c.abs()).sum()
    }

    fn times<const B: usize, const C: usize>(&self, other: &Polynomial<B>) -> Polynomial<C> {
        let mut coefficients = [0.0; C];
        for (i, a) in self.coefficients.iter().enumerate() {
            for (j, b) in other.coefficients.iter().enumerate() {
                coefficients[i + j] += a * b;
            }
        }
        let [a, b] = [self.size(), other.size()];
        let off = self.off * (b + other.off) + a * other.off + C as f64 * STEP * a * b;
        Polynomial {
            coefficients,
            off: 1.001 * off + f64::MIN_POSITIVE,
        }
    }
}

/// The model on three corners, in order, from the parts between them.
pub(super) fn along(corners: [f64; 3], sides: [&[Part]; 2]) -> Option<Along> {
    let at = Interval::at;
    let [first, knee, last] = corners.map(at);
    let length = last - first;
    let half = 0.5 * length;
    // The height of the sections: 0 at the ends, 1 at the knee.
    let rises = [(knee - first).recip(), -(last - knee).recip()];
    let tips = [first, last];
    let sections: [Vec<Polynomial<2>>; 2] = std::array::from_fn(|side| {
        let of = |part: &Part| part.line(Interval::ZERO, rises[side], tips[side]);
        sides[side].iter().map(of).collect()
    });
    let middle = (corners.iter().sum::<f64>() / 3.0).clamp(corners[0], corners[2]);
    // Least squares with the weight w: its variance is Σ_{i<j} (x_i - x_j)²/36.
    let spread = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| (corners[i] - corners[j]).powi(2));
    let variance = spread.iter().sum::<f64>() / 36.0;
    let [mut mean, mut slope, mut of_f] = [Interval::ZERO; 3];
    let all = sides.iter().zip(&sections);
    for (part, w) in all.flat_map(|(parts, sections)| parts.iter().zip(sections)) {
        let weighted = part.series.times::<2, 6>(w);
        mean += part.integral(&weighted);
        of_f += part.integral(&part.series.times::<6, 10>(&weighted));
        let away = part.line(Interval::ZERO, Interval::ONE, at(middle));
        slope += part.integral(&weighted.times::<2, 7>(&away));
    }
    let [mean, slope, of_f] = [mean, slope, of_f].map(|sum| sum / half);
    let mut p = [mean.mid(), slope.mid() / variance];
    // The mean squares of p's slope and of what is left beside it.
    let of_slope = p[1] * p[1] * variance;
    if of_slope < STEEP * (of_f.mid() - p[0] * p[0] - of_slope) {
        p[1] = 0.0;
    }
    // What rounding leaves of the mean goes to r: that of x is in the middle of all corners.
    let centroid = (first + knee + last) / at(3.0);
    let rest = mean - at(p[0]) - at(p[1]) * (centroid - at(middle));
    let (mut wave, mut error, mut square) = (0.0_f64, 0.0_f64, Interval::ZERO);
    let mut squares = [Interval::ZERO; 2];
    let [mut flat, mut bubbles] = [[Interval::ZERO; 3]; 2];
    // λ where the knee's section meets the longest edge, and in the middle of that section.
    let share = (knee - first) / length;
    let end = [Interval::ONE - share, Interval::ZERO, share];
    let middle_of_knee = [0, 1, 2].map(|i| 0.5 * (end[i] + at(f64::from(i == 1))));
    for (side, parts) in sides.into_iter().enumerate() {
        // Φ from the end where it is 0, and 2/ℓ ∫ s w^(k+1).
        let mut phi = Interval::ZERO;
        let mut moments = [Interval::ZERO; 3];
        for k in 0..parts.len() {
            let k_th = if side == 0 { k } else { parts.len() - 1 - k };
            let (part, w) = (&parts[k_th], &sections[side][k_th]);
            let mut s = part.series;
            let linear = part.line(at(p[0]), at(p[1]), at(middle));
            let of_mean = at(linear.coefficients[0]) + rest;
            s.off = linear.off + of_mean.radius();
            for (c, p) in s
                .coefficients
                .iter_mut()
                .zip([of_mean.mid(), linear.coefficients[1]])
            {
                s.off += STEP * (c.abs() + p.abs());
                *c -= p;
            }
            error = error.max(part.error);
            let most = 1.001 * (s.size() + s.off);
            wave = wave.max(most);
            let weighted = s.times::<2, 6>(w);
            let second = weighted.times::<2, 7>(w);
            square += part.integral(&s.times::<6, 10>(&weighted));
            moments[0] += part.integral(&weighted);
            moments[1] += part.integral(&second);
            moments[2] += part.integral(&second.times::<2, 8>(w));
            let [tip, inner] = if side == 0 { [-1.0, 1.0] } else { [1.0, -1.0] };
            let whole = part.primitive(&weighted, phi, tip);
            phi = part.at_end(&whole, inner);
            squares[side] += if k == 0 {
                part.at_tip(&s, side) * rises[side].abs()
            } else {
                // 1/w is below its chord (w_a + w_b - w)/(w_a w_b), and above its tangent (2m - w)/m², m = (w_a + w_b)/2.
                let heights = part.ends.map(|x| (at(x) - tips[side]) * rises[side]);
                let sum = heights[0] + heights[1];
                let line = part.line(sum, -rises[side], tips[side]);
                let squared = whole.times::<7, 13>(&whole);
                let all = part.integral(&squared.times::<2, 14>(&line));
                let most = (all / (heights[0] * heights[1])).high;
                let least = (4.0 * all / sum.square()).low;
                Interval::new(least.max(0.0), most.max(0.0))
            };
        }
        squares[side] = squares[side] / length;
        let moments = moments.map(|m| 2.0 * m / length);
        // λ along the middles of sections, by their heights: from a corner to the middle of the knee's section.
        let line = |i: usize| {
            let from = at(f64::from(i == 2 * side));
            [from, middle_of_knee[i] - from]
        };
        for i in 0..3 {
            let of = line(i);
            flat[i] += of[0] * moments[0] + of[1] * moments[1];
            let [[a, b], [c, d]] = [(i + 1) % 3, (i + 2) % 3].map(line);
            // The slopes of λ across the knee's section, of the length 1.
            let [e, f] = [(i + 1) % 3, (i + 2) % 3].map(|i| end[i] - at(f64::from(i == 1)));
            let products = [a * c, a * d + b * c, b * d + e * f / at(12.0)];
            let terms = products.iter().zip(&moments).map(|(c, m)| *c * *m);
            bubbles[i] += 4.0 * terms.sum::<Interval>();
        }
    }
    let found = Along {
        p,
        middle,
        wave,
        swell: (square / half).root().high,
        error: up(error, rest.magnitude()),
        squares,
        flat,
        bubbles,
    };
    let numbers = [found.wave, found.swell, found.error, p[0], p[1]];
    let is_known = numbers.iter().all(|n| n.is_finite()) && squares.iter().all(|s| s.is_finite());
    is_known.then_some(found)
}

impl Along {
    /// The model of f on the triangle with these corners, and τ.
    pub fn on(&self, corners: &[[f64; 3]; 3], axis: usize) -> (Leaf, Carried) {
        let at = Interval::at;
        let other = 1 - axis;
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| corners[i][axis].total_cmp(&corners[j][axis]));
        let edge = |i: usize, j: usize| -> [Interval; 2] {
            let [a, b] = [corners[order[i]], corners[order[j]]];
            [axis, other].map(|k| at(b[k]) - at(a[k]))
        };
        let slope = |i: usize, j: usize| {
            let [along, across] = edge(i, j);
            across / along
        };
        // ‖τ‖² over |κ| = height · length / 2
        let mut square = Interval::ZERO;
        for side in 0..2 {
            if edge(side, side + 1)[0].is_zero() {
                continue;
            }
            let [long, short] = [slope(0, 2), slope(side, side + 1)];
            let of_slopes = long.square() + long * short + short.square();
            let factor = Interval::ONE + of_slopes / at(3.0);
            square += 2.0 * factor * self.squares[side];
        }
        let mut leaf = Leaf {
            wave: self.wave,
            swell: self.swell,
            error: self.error,
            is_smooth: true,
            ..Leaf::default()
        };
        let mut rounding = 0.0_f64;
        for (value, x) in leaf.values.iter_mut().zip(corners) {
            let exact = at(self.p[0]) + at(self.p[1]) * (at(x[axis]) - at(self.middle));
            *value = exact.mid();
            rounding = rounding.max(exact.radius());
        }
        leaf.error = up(leaf.error, rounding);
        let [mut flat, mut bubbles] = [[Interval::ZERO; 3]; 2];
        for (k, &corner) in order.iter().enumerate() {
            (flat[corner], bubbles[corner]) = (self.flat[k], self.bubbles[k]);
        }
        let carried = Carried {
            square,
            flat,
            bubbles,
        };
        (leaf, carried)
    }
}

/// τ by quadrature, from f itself and p at the corners.
#[cfg(test)]
pub(super) fn tau_by_quadrature(
    f: impl Fn([f64; 3]) -> f64,
    corners: [[f64; 3]; 3],
    p: [f64; 3],
    axis: usize,
) -> impl Fn([f64; 3]) -> [f64; 2] {
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| corners[i][axis].total_cmp(&corners[j][axis]));
    let x = order.map(|i| corners[i][axis]);
    let y = order.map(|i| corners[i][1 - axis]);
    let p = order.map(|i| p[i]);
    let on_longest =
        move |t: f64, of: [f64; 3]| of[0] + (of[2] - of[0]) * (t - x[0]) / (x[2] - x[0]);
    let height = move |t: f64| {
        let rising = if x[1] > x[0] {
            (t - x[0]) / (x[1] - x[0])
        } else {
            1.0
        };
        let falling = if x[2] > x[1] {
            (x[2] - t) / (x[2] - x[1])
        } else {
            1.0
        };
        rising.min(falling)
    };
    let wave = move |t: f64| {
        let mut place = [0.0; 3];
        place[axis] = t;
        f(place) - on_longest(t, p)
    };
    let integral = move |from: f64, to: f64| -> f64 {
        let (rule, count) = (crate::quadrature::exact(1, 9), 40);
        let h = (to - from) / f64::from(count);
        let points = (0..count).flat_map(|k| {
            let at = from + f64::from(k) * h;
            rule.iter()
                .map(move |(lambda, weight)| (at + h * lambda[1], h * weight))
        });
        points.map(|(t, weight)| weight * wave(t) * height(t)).sum()
    };
    move |place| {
        let (t, across) = (place[axis], place[1 - axis]);
        let is_first = t < x[1];
        // From the nearer end, where it is 0.
        let phi = if is_first {
            integral(x[0], t)
        } else {
            -integral(t, x[2])
        };
        let side = usize::from(!is_first);
        let short = (y[side + 1] - y[side]) / (x[side + 1] - x[side]);
        let long = (y[2] - y[0]) / (x[2] - x[0]);
        let there = [on_longest(t, y), y[side] + short * (t - x[side])];
        let slope = long + (short - long) * (across - there[0]) / (there[1] - there[0]);
        let along = -phi / height(t);
        let mut tau = [0.0; 2];
        (tau[axis], tau[1 - axis]) = (along, along * slope);
        tau
    }
}

/// Points and weights on a triangle for what is smooth on either side of the middle corner along an axis, as τ is.
#[cfg(test)]
pub(super) fn points_beside_knee(
    corners: &[[f64; 3]; 3],
    axis: usize,
    cuts: usize,
) -> Vec<([f64; 4], f64)> {
    use crate::quadrature::{Piece, WHOLE, exact, parts};
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| corners[i][axis].total_cmp(&corners[j][axis]));
    let [first, knee, last] = order;
    let x = order.map(|i| corners[i][axis]);
    let share = (x[1] - x[0]) / (x[2] - x[0]);
    let mut opposite = [0.0; 4];
    (opposite[first], opposite[last]) = (1.0 - share, share);
    let of = |corner: usize| WHOLE[corner];
    let mut found = Vec::new();
    for (tip, share) in [(first, share), (last, 1.0 - share)] {
        let mut pieces: Vec<Piece> = vec![[of(tip), of(knee), opposite, [0.0; 4]]];
        for _ in 0..cuts {
            pieces = pieces.iter().flat_map(|piece| parts(piece, 2)).collect();
        }
        let (rule, share) = (exact(2, 5), share / pieces.len() as f64);
        for piece in pieces.iter().filter(|_| share > 0.0) {
            let at = |inner: &[f64; 4]| {
                std::array::from_fn(|i| (0..3).map(|k| inner[k] * piece[k][i]).sum())
            };
            found.extend(rule.iter().map(|(inner, w)| (at(&inner), w * share)));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The model, τ's square and the moments of s hold what quadrature finds, and (τ, ∇z) = (s, z).
    #[test]
    fn tau_is_what_quadrature_finds() {
        let triangles = [
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            [[0.3, 0.1], [0.5, 0.4], [1.1, -0.2]],
            [[0.5, 0.0], [0.25, 0.0625], [0.0, 0.0]],
            [[-0.2, 0.7], [0.9, 0.65], [0.1, 0.9]],
            [[0.75, 0.0], [0.75, 1.0], [0.0, 0.3]],
        ];
        let functions = [
            "sin(17*@)",
            "exp(-30*(@-0.4)^2)",
            "1/(1.2+@)",
            "@^7-3*@^2",
            "cos(50*@)+2*@",
        ];
        for (triangle, (text, axis)) in triangles.iter().zip(functions.iter().zip([0, 1, 0, 1, 0]))
        {
            let f = Expression::parse(&text.replace('@', ["x", "y"][axis])).unwrap();
            let corners = triangle.map(|[x, y]| [x, y, 0.0]);
            let of = Axis {
                expression: &f,
                axis,
                unit: 0,
                aim: 1e-6,
            };
            let mut along_axis = corners.map(|x| x[axis]);
            along_axis.sort_by(f64::total_cmp);
            let [a, b, c] = along_axis;
            let sides = [[a, b], [b, c]].map(|ends| of.parts(ends).unwrap());
            let found = along(along_axis, [&sides[0], &sides[1]]).unwrap();
            let (leaf, carried) = found.on(&corners, axis);
            assert!(leaf.error < 2e-6, "{text} {}", leaf.error);
            let values = [0, 1, 2].map(|i| leaf.values[i]);
            let tau = tau_by_quadrature(|x| f.value(x), corners, values, axis);
            let points = points_beside_knee(&corners, axis, 5);
            let (mut square, mut of_s, mut size) = (0.0, 0.0, 0.0_f64);
            let [mut flat, mut bubbles] = [[0.0; 3]; 2];
            // (τ, ∇z) - (s, z) of monomials.
            let powers = [[1, 0], [0, 1], [2, 0], [1, 1], [0, 2], [3, 0], [1, 2]];
            let mut off = [0.0; 7];
            for (lambda, weight) in &points {
                let x: [f64; 3] =
                    std::array::from_fn(|k| (0..3).map(|i| lambda[i] * corners[i][k]).sum());
                let p: f64 = (0..3).map(|i| lambda[i] * leaf.values[i]).sum();
                let s = f.value(x) - p;
                let t = tau(x);
                square += weight * (t[0] * t[0] + t[1] * t[1]);
                of_s += weight * s * s;
                size = size.max(s.abs());
                for i in 0..3 {
                    flat[i] += weight * s * lambda[i];
                    bubbles[i] += weight * s * 4.0 * lambda[(i + 1) % 3] * lambda[(i + 2) % 3];
                }
                for (off, [m, n]) in off.iter_mut().zip(powers) {
                    let power = |x: f64, n: i32| if n < 0 { 0.0 } else { x.powi(n) };
                    let z = x[0].powi(m) * x[1].powi(n);
                    let of_x = f64::from(m) * power(x[0], m - 1) * x[1].powi(n);
                    let of_y = f64::from(n) * x[0].powi(m) * power(x[1], n - 1);
                    *off += weight * (t[0] * of_x + t[1] * of_y - s * z);
                }
            }
            let near = |of: Interval, by: f64, size: f64| {
                let room = 1e-5 * size;
                assert!(
                    of.low - room <= by && by <= of.high + room,
                    "{text} axis {axis}: {of:?} {by}"
                );
            };
            near(carried.square, square, carried.square.high);
            assert!(
                carried.square.high <= 1.1 * square,
                "{text}: {:?} {square}",
                carried.square
            );
            for i in 0..3 {
                near(carried.flat[i], flat[i], size);
                near(carried.bubbles[i], bubbles[i], size);
            }
            assert!(
                size <= leaf.wave && of_s.sqrt() <= leaf.swell * (1.0 + 1e-6),
                "{text}"
            );
            assert!(
                leaf.wave <= 2.0 * size + 1e-6,
                "{text} {} {size}",
                leaf.wave
            );
            let room = 1e-5 * size;
            assert!(off.iter().all(|off| off.abs() <= room), "{text}: {off:?}");
        }
    }

    /// Jumps, poles and what is not defined have no such model.
    #[test]
    fn what_jumps_is_not_modelled() {
        for text in [
            "if(x<0.3,1,2)",
            "1/(x-0.3)",
            "log(x-0.5)",
            "abs(x-0.37)^0.5",
        ] {
            let f = Expression::parse(text).unwrap();
            let of = Axis {
                expression: &f,
                axis: 0,
                unit: 0,
                aim: 1e-3,
            };
            assert!(of.parts([0.0, 1.0]).is_none(), "{text}");
        }
        // An `if` that is decided on each side of a corner is smooth there.
        let f = Expression::parse("if(x<0.5123,sin(9*x),cos(9*x))").unwrap();
        let of = Axis {
            expression: &f,
            axis: 0,
            unit: 0,
            aim: 1e-6,
        };
        assert!(
            [[0.0, 0.5123], [0.5123, 1.0]]
                .into_iter()
                .all(|ends| of.parts(ends).is_some())
        );
        assert!(of.parts([0.2, 0.75]).is_none());
    }
}
