//! Data that depend on only one axis, on a triangle that is longer than their waves: s = f - p is the divergence of an explicit flux.
//!
//! Let f depend only on x, w(x) be the length of the triangle's section at x and p constant or linear in x with (f - p, 1) = 0.
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
//! between its chord and its tangent. Where f jumps there is a part so short that what is not known of f on it, the height of the
//! jump, counts for nothing in the mean.

use std::collections::HashMap;

use super::carried::{Carried, STEP, around};
use super::model::{Domain, Improved, Open, WORTH};
use super::simplex::up;
use super::tree::Leaf;
use crate::interval::{Interval, above_of_all};
use crate::scene::Expression;
use crate::scene::expression::{MOST, ON_LINE, Taylor, spanned};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;
use rayon::prelude::*;

/// Models of data that depend on only one axis, by the corners of triangles along it, in order, as bits; where there is one.
pub(super) type Lines = HashMap<[u64; 3], Along>;

/// f along an axis as three corners of a triangle have it, the heights of its sections scaled to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    /// p = p₀ + p₁ (x - x̄)
    p: [f64; 2],
    middle: f64,
    /// |s|, √ of the mean of s², |r| at most: of |r| what is not a spot, where |s| + |r| is no larger than `wave` either.
    wave: f64,
    swell: f64,
    error: f64,
    /// As [`Leaf`] has them.
    spots: [f64; 2],
    /// ∫ Φ²/w from the first corner to the second and on to the third, relative to the whole length.
    squares: [Interval; 2],
    flat: [Interval; 3],
    bubbles: [Interval; 3],
}

/// Parts of a side of a triangle at most, and of one that is cut.
const PARTS: usize = 256;
const AT_ONCE: f64 = 64.0;
/// Errors are of this order in the length of a part, or a bit more.
const ORDER: f64 = 4.2;
/// Along one axis this part of what was not known before is little enough.
const LITTLE: f64 = 3e-4;
/// p has a slope where the mean square of that is this many times that of s: σ is not a gradient then, and (σ, τ) known less well.
const STEEP: f64 = 10.0;
/// A spot is no longer than this part of a side; where its ends are neighbours in f64 before that, than the other.
const SPOT: f64 = 1.0 / (1_u64 << 40) as f64;
const LONGEST_SPOT: f64 = 1.0 / (1_u64 << 20) as f64;

/// f on a piece of the axis: Σ a_j (x - c)^j up to an error.
pub(super) struct Part {
    ends: [f64; 2],
    centre: f64,
    /// |x - c| is at most this, and at the ends less by no more than this part of it.
    reach: f64,
    skew: f64,
    series: Polynomial<ON_LINE>,
    error: f64,
    /// Whether only the range of f is known, and too wide, as f jumps there or its slope has no bound.
    is_rough: bool,
}

/// A polynomial in (x - c)/reach on a part of the axis, in f64 with one bound of all that it is off anywhere.
#[derive(Debug, Clone, Copy)]
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
    /// f from one number to another; None if this number of pieces does not reach the error wanted.
    pub fn parts(&self, ends: [f64; 2]) -> Option<Vec<Part>> {
        let mut parts = Vec::new();
        (ends[0] >= ends[1] || self.cut(ends, ends[1] - ends[0], &mut parts)).then_some(parts)
    }

    /// Cuts a part of a side until the error is small enough, or the part a spot.
    fn cut(&self, ends: [f64; 2], side: f64, parts: &mut Vec<Part>) -> bool {
        let mut part = self.part(ends);
        part.is_rough &= part.error > self.aim;
        let width = ends[1] - ends[0];
        let is_inside = ends[0] < part.centre && part.centre < ends[1];
        let longest = if is_inside { SPOT } else { LONGEST_SPOT };
        let is_spot = part.is_rough && width <= longest * side;
        if part.error <= self.aim || is_spot {
            parts.push(part);
            return parts.len() <= PARTS;
        }
        // Where smooth parts get that small there is a pole, or too many waves.
        let count = (part.error / self.aim).powf(1.0 / ORDER).ceil();
        let count = match part.is_rough {
            true => 2.0,
            false => count.clamp(2.0, AT_ONCE),
        };
        if !part.is_rough && width / count < side / PARTS as f64 {
            return false;
        }
        let mut from = ends[0];
        for k in 1..=count as usize {
            let to = if k as f64 == count {
                ends[1]
            } else {
                ends[0] + k as f64 * (width / count)
            };
            if !(from < to && self.cut([from, to], side, parts)) {
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
        let range = inside.coefficients[0].times_power_of_two(self.unit);
        let is_rough = !is_known && range.is_finite();
        let series = if is_rough {
            let mut of = [Interval::ZERO; ON_LINE];
            of[0] = range;
            Polynomial::of(of)
        } else {
            Polynomial::of(known)
        };
        Part {
            ends,
            centre,
            reach,
            skew: 1.0 - least / reach + STEP,
            // What is not known of f is r.
            series: Polynomial { off: 0.0, ..series },
            error: if is_known || is_rough {
                series.off
            } else {
                f64::INFINITY
            },
            is_rough,
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
        // The ends, and no more roundings than coefficients.
        let ends = 2.0 * (self.skew + N as f64 * STEP) * of.size();
        Interval::at(self.reach) * around(of.sum(), 2.0 * of.off + ends)
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

    /// ℓ ∫ Φ²/w on the part at a tip, the first end or the last: Φ = (d²/ℓ) Σ_j s_j d^j/(j+2) at the distance d, w = d/ℓ.
    fn at_tip(&self, s: &Polynomial<ON_LINE>, tip: usize) -> Interval {
        let at = Interval::at;
        let reach = at(self.reach);
        let away = (at(self.ends[tip]) - at(self.centre)) / reach;
        // About the tip, in multiples of the reach.
        let mut here = s.coefficients.map(at);
        for first in 0..ON_LINE - 1 {
            for k in (first..ON_LINE - 1).rev() {
                here[k] += away * here[k + 1];
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

impl<const N: usize> Polynomial<N> {
    fn of(coefficients: [Interval; N]) -> Self {
        Polynomial {
            coefficients: coefficients.map(Interval::mid),
            off: above_of_all(coefficients.map(Interval::radius)),
        }
    }

    /// ∫ from -1 to 1, about.
    fn sum(&self) -> f64 {
        let even = self.coefficients.iter().enumerate().step_by(2);
        even.map(|(k, c)| 2.0 * c / (k + 1) as f64).sum()
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
    let (mut mean, mut slope, mut of_f) = (Interval::ZERO, 0.0, 0.0);
    let all = sides.iter().zip(&sections);
    for (part, w) in all.flat_map(|(parts, sections)| parts.iter().zip(sections)) {
        let weighted = part.series.times::<2, 6>(w);
        mean += part.integral(&weighted);
        // Any p will do.
        of_f += part.reach * part.series.times::<6, 10>(&weighted).sum();
        let away = Polynomial {
            coefficients: [part.centre - middle, part.reach],
            off: 0.0,
        };
        slope += part.reach * weighted.times::<2, 7>(&away).sum();
    }
    mean = mean / half;
    let [slope, of_f] = [slope, of_f].map(|sum| sum / half.mid());
    let mut p = [mean.mid(), slope / variance];
    // The mean squares of p's slope and of the remainder.
    let of_slope = p[1] * p[1] * variance;
    if of_slope < STEEP * (of_f - p[0] * p[0] - of_slope) {
        p[1] = 0.0;
    }
    // What rounding leaves of the mean goes to r: that of x is in the middle of all corners.
    let centroid = (first + knee + last) / at(3.0);
    let rest = mean - at(p[0]) - at(p[1]) * (centroid - at(middle));
    let (mut wave, mut error, mut square) = (0.0_f64, 0.0_f64, Interval::ZERO);
    let mut spots = [Interval::ZERO; 2];
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
            let mut most = 1.001 * (s.size() + s.off);
            if part.is_rough {
                // Sections are no longer than 1, and |κ| is ℓ/2.
                let [from, to] = part.ends.map(at);
                let mean = at(part.error) * (to - from) / half;
                spots[0] += mean;
                spots[1] += mean * at(part.error);
                most = up(most, part.error);
            } else {
                error = error.max(part.error);
            }
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
        spots: spots.map(|of| of.high),
        squares,
        flat,
        bubbles,
    };
    let [spot, spots] = found.spots;
    let numbers = [
        found.wave,
        found.swell,
        found.error,
        spot,
        spots,
        p[0],
        p[1],
    ];
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
            spots: self.spots,
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

impl Domain<'_> {
    /// The axis, where a leaf is the whole of a triangle and the expression depends on only one axis.
    pub(super) fn axis_of(&self, open: &Open, axes: &[usize]) -> Option<usize> {
        match axes {
            [axis] if open.node == 0 && [self.dim, self.space] == [2, 2] => Some(*axis),
            _ => None,
        }
    }

    /// The corners of a triangle along an axis, in order.
    fn corners_along(&self, simplex: usize, axis: usize) -> [f64; 3] {
        let [a, b, c, _] = (self.vertices)(simplex);
        let mut along = [a, b, c].map(|x| x[axis]);
        along.sort_by(f64::total_cmp);
        along
    }

    /// The models along one axis for the triangles that wait for them: each once.
    pub(super) fn lines(
        &self,
        open: &[Open],
        chosen: &[usize],
        axes: &[usize],
        aim: f64,
    ) -> Result<Lines> {
        let corners = parallel::collect(chosen.len(), |k| {
            let open = &open[chosen[k]];
            let axis = self.axis_of(open, axes)?;
            let corners = self.corners_along(open.simplex, axis).map(f64::to_bits);
            (!open.may_be_smoother()).then_some(corners)
        });
        let corners: Vec<[u64; 3]> = different(corners.into_iter().flatten().collect());
        let (Some(axis), false) = (axes.first(), corners.is_empty()) else {
            return Ok(Lines::default());
        };
        let unknown = chosen.iter().map(|&k| open[k].leaf.unknown());
        let largest = unknown.fold(0.0, f64::max);
        let of = Axis {
            expression: self.expression,
            axis: *axis,
            unit: self.unit,
            aim: aim.max(LITTLE * largest),
        };
        let ends = |[a, b, c]: [u64; 3]| [[a, b], [b, c]];
        let sides = different(corners.iter().copied().flat_map(ends).collect());
        let parts = parallel::map(sides, |side| {
            cancel::check().map(|()| (side, of.parts(side.map(f64::from_bits))))
        });
        let parts: HashMap<[u64; 2], Option<Vec<Part>>> =
            parts.into_iter().collect::<Result<_>>()?;
        let found = parallel::map(corners, |corners| {
            let sides = ends(corners).map(|ends| parts[&ends].as_deref());
            let [Some(first), Some(last)] = sides else {
                return None;
            };
            Some((corners, along(corners.map(f64::from_bits), [first, last])?))
        });
        Ok(found.into_iter().flatten().collect())
    }

    /// The model along one axis, where it is much better than what a triangle has: it is not cut then.
    pub(super) fn along_axis(
        &self,
        parent: &Open,
        axes: &[usize],
        lines: &Lines,
    ) -> Option<Improved> {
        let axis = self.axis_of(parent, axes)?;
        let corners = self.corners_along(parent.simplex, axis);
        let [a, b, c, _] = (self.vertices)(parent.simplex);
        let found = lines.get(&corners.map(f64::to_bits))?;
        let (leaf, carried) = found.on(&[a, b, c], axis);
        let is_worth = leaf.unknown() < WORTH * parent.leaf.unknown();
        is_worth.then(|| Improved::Carried(leaf, Box::new(carried)))
    }
}

/// Each once, in order.
fn different<T: Ord + Send>(mut all: Vec<T>) -> Vec<T> {
    all.par_sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
pub(super) mod tests;
