//! Taylor polynomials on a simplex: p, s and what bounds r, from the derivatives on a box and at its centre (module `model`).

use super::quadratic::Quadratic;
use super::simplex::{Vector, up};
use super::tree::Leaf;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::scene::expression::{IN_SPACE, Monomials};

/// The number of derivatives taken at first.
pub(super) const AT_FIRST: usize = 2;
/// More are not tried where these leave this many times the range of f: a leaf is then longer than its waves.
const FAR: f64 = 4.0;

/// p, s and r from the derivatives on a box and at its centre: of whichever order they leave least.
pub(super) fn polynomial<const N: usize>(
    corners: &[Vector],
    centre: Vector,
    axes: &[usize],
    order: usize,
    derivatives: &[Interval],
) -> Leaf {
    let vars = axes.len();
    let (on_box, at_centre) = derivatives.split_at(N);
    let range = on_box[0];
    let flat = |error: f64| Leaf {
        values: [range.mid(); 4],
        error,
        ..Leaf::default()
    };
    // A constant, or nothing but the range is known.
    if range.radius() == 0.0 || !on_box[1..=vars].iter().all(|g| g.is_finite()) {
        return flat(range.radius());
    }
    let mut steps = [[Interval::ZERO; 3]; 4];
    for (step, corner) in steps.iter_mut().zip(corners) {
        for (step, &axis) in step.iter_mut().zip(axes) {
            *step = corner[axis] - centre[axis];
        }
    }
    let steps = &steps[..corners.len()];
    let monomials = Monomials::of(vars);
    let counts = &monomials.counts;
    // |(x-c)^α| is at most this.
    let farthest: [f64; 3] =
        std::array::from_fn(|k| steps.iter().fold(0.0, |most, s| s[k].magnitude().max(most)));
    let mut reach = [1.0; N];
    for (reach, exponents) in reach[..counts[order]].iter_mut().zip(&monomials.exponents) {
        for (most, exponent) in farthest.iter().zip(exponents) {
            (0..*exponent).for_each(|_| *reach = above_of_product(*reach, *most));
        }
    }
    let sum = |sizes: &mut dyn Iterator<Item = (usize, f64)>| {
        above_of_all(sizes.map(|(n, size)| above_of_product(size, reach[n])))
    };
    // What is known at c grows with m; of which order the rest is least?
    let (mut known, mut m, mut rest) = (at_centre[0].radius(), 1, f64::INFINITY);
    for degree in 1..=order {
        let here = counts[degree - 1]..counts[degree];
        let last = sum(&mut here.clone().map(|n| (n, on_box[n].radius())));
        if up(known, last) < rest {
            (m, rest) = (degree, up(known, last));
        }
        if degree < order {
            known = up(known, sum(&mut here.map(|n| (n, at_centre[n].radius()))));
        }
    }
    let mut coefficients = [0.0; N];
    for (n, of) in coefficients[..counts[m]].iter_mut().enumerate() {
        *of = if n < counts[m - 1] {
            at_centre[n]
        } else {
            on_box[n]
        }
        .mid();
    }
    let sizes = |from: usize| (from..counts[m]).map(|n| (n, coefficients[n].abs()));
    let mut wave = if m < 2 {
        0.0
    } else {
        sum(&mut sizes(counts[1]))
    };
    let (mut mean, mut swell) = (Interval::ZERO, wave);
    if wave > 0.0 {
        let quadratic = (counts[1]..counts[2]).filter(|n| coefficients[*n] != 0.0);
        let of_degree_2 = quadratic
            .clone()
            .map(|n| coefficients[n] * moment(&monomials.exponents[n], steps))
            .sum();
        mean = of_degree_2;
        if m > 2 {
            let moments = moments(monomials, steps, counts[m]);
            mean += (counts[2]..counts[m])
                .map(|n| coefficients[n] * moments[n])
                .sum();
        }
        wave = up(wave, mean.magnitude());
        if order > AT_FIRST {
            // The rest of degree 3 and 4 less its mean, by its size.
            let rest = 2.0 * sum(&mut sizes(counts[2]));
            let terms: Vec<_> = quadratic
                .map(|n| (monomials.exponents[n], coefficients[n]))
                .collect();
            swell = wave.min(up(root_mean_square(steps, &terms, of_degree_2), rest));
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
    for (value, step) in leaf.values.iter_mut().zip(steps) {
        let slope: Interval = (0..vars).map(|k| coefficients[1 + k] * step[k]).sum();
        let exact = Interval::at(coefficients[0]) + Interval::at(mean.mid()) + slope;
        *value = exact.mid();
        rounding = rounding.max(exact.radius());
    }
    leaf.error = up(leaf.error, rounding);
    leaf
}

/// The mean of x_a x_b over the simplex with these corners, from their sums: (Σ x_a x_b + Σ x_a Σ x_b) / ((d+1)(d+2)).
fn moment(exponents: &[u8; 3], corners: &[Vector]) -> Interval {
    let mut axes = (0..3).flat_map(|k| std::iter::repeat_n(k, exponents[k].into()));
    let (Some(a), Some(b), None) = (axes.next(), axes.next(), axes.next()) else {
        return Interval::WHOLE;
    };
    let of = |k: usize| corners.iter().map(|x| x[k]).sum::<Interval>();
    let (own, both) = if a == b {
        (corners.iter().map(|x| x[a].square()).sum(), of(a).square())
    } else {
        (
            corners.iter().map(|x| x[a] * x[b]).sum::<Interval>(),
            of(a) * of(b),
        )
    };
    let count = corners.len() as f64;
    (own + both) / Interval::at(count * (count + 1.0))
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
    Quadratic::<3>::scalar(&points, value, off, size)
        .mean_square(corners.len() - 1)
        .root()
        .high
}
