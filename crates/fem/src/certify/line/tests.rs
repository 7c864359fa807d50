use super::*;
use crate::quadrature::{Piece, WHOLE, exact, parts};
use crate::sixty_digits::Big;

/// An expression along x, up to this error.
fn along_x(expression: &Expression, aim: f64) -> Axis<'_> {
    Axis {
        expression,
        axis: 0,
        unit: 0,
        aim,
    }
}

/// Σ c_k t^k
fn value(coefficients: &[f64], t: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| t * sum + c)
}

/// A part of an axis whose ends are farther from the centre than rounding asks.
fn part(skew: f64) -> Part {
    Part {
        ends: [0.3, 0.8],
        centre: 0.55,
        reach: 0.25 / (1.0 - skew),
        skew: skew + 1e-12,
        series: Polynomial {
            coefficients: [0.0; ON_LINE],
            off: 0.0,
        },
        error: 0.0,
        is_rough: false,
    }
}

/// τ by quadrature, from f itself and p at the corners.
pub(in super::super) fn tau_by_quadrature(
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
        let (rule, count) = (exact(1, 9), 40);
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
pub(in super::super) fn points_beside_knee(
    corners: &[[f64; 3]; 3],
    axis: usize,
    cuts: usize,
) -> Vec<([f64; 4], f64)> {
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
    for (triangle, (text, axis)) in triangles.iter().zip(functions.iter().zip([0, 1, 0, 1, 0])) {
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

/// Of a coarse model all that f - p - s may be is in the error.
#[test]
fn moments_are_off_by_no_more_than_the_error() {
    let corners = [[0.3, 0.1, 0.0], [0.5, 0.4, 0.0], [1.1, -0.2, 0.0]];
    for text in ["sin(17*x)", "exp(-30*(x-0.6)^2)", "1/(0.01+x^2)"] {
        let f = Expression::parse(text).unwrap();
        let of = along_x(&f, 0.2);
        let [a, b, c] = corners.map(|x| x[0]);
        let sides = [[a, b], [b, c]].map(|ends| of.parts(ends).unwrap());
        let found = along([a, b, c], [&sides[0], &sides[1]]).unwrap();
        let (leaf, carried) = found.on(&corners, 0);
        let mut moments = [0.0; 3];
        for (lambda, weight) in points_beside_knee(&corners, 0, 5) {
            let x: f64 = (0..3).map(|i| lambda[i] * corners[i][0]).sum();
            let p: f64 = (0..3).map(|i| lambda[i] * leaf.values[i]).sum();
            let rest = f.value([x, 0.0, 0.0]) - p;
            (0..3).for_each(|i| moments[i] += weight * lambda[i] * rest);
        }
        // |(r, λ_i)| ≤ error/3
        let off = (0..3).map(|i| (moments[i] - carried.flat[i].mid()).abs());
        let off = off.fold(0.0, f64::max);
        assert!(
            1e-6 < off && off <= leaf.error / 3.0,
            "{text} {off} {}",
            leaf.error
        );
    }
}

/// What ∫ Φ²/w is at a tip for s off by as much as it may be is in the enclosure, which is not wider than that.
#[test]
fn tips_hold_what_s_may_be() {
    let coefficients = [0.3, -1.1, 0.7, 0.4, -0.2];
    let part = part(1e-15);
    let ([from, to], centre, reach) = (part.ends, part.centre, part.reach);
    // ℓ ∫ Φ²/w by Gauss' rule within Gauss' rule: exact for polynomials of degree 9, on a given number of parts.
    let (rule, count) = (exact(1, 9), 20);
    let integral = |from: f64, to: f64, of: &dyn Fn(f64) -> f64| -> f64 {
        let h = (to - from) / f64::from(count);
        let points = (0..count).flat_map(|k| rule.iter().map(move |(l, w)| (k, l[1], w)));
        points
            .map(|(k, l, w)| h * w * of(from + h * (f64::from(k) + l)))
            .sum()
    };
    for (tip, at_tip) in [(0, from), (1, to)] {
        for off in [0.0, 1e-3, 0.2, 3.0] {
            let s = Polynomial { coefficients, off };
            let found = part.at_tip(&s, tip);
            let of = |delta: &dyn Fn(f64) -> f64| {
                let s = |x: f64| {
                    let t = (x - centre) / reach;
                    value(&coefficients, t) + delta(x)
                };
                let weighted = |d: f64| {
                    let x = if tip == 0 { at_tip + d } else { at_tip - d };
                    s(x) * d
                };
                integral(0.0, to - from, &|d| integral(0.0, d, &weighted).powi(2) / d)
            };
            let all = [of(&|_| off), of(&|_| -off), of(&|x| off * (30.0 * x).sin())];
            for value in all {
                assert!(
                    found.low <= value * (1.0 + 1e-12) && value <= found.high * (1.0 + 1e-12),
                    "{tip} {off}: {found:?} {value}"
                );
            }
            // Were it a constant that is added, ‖·‖ would be off by that of the constant.
            let [norm, constant] = [of(&|_| 0.0).sqrt(), 0.25 * off * (to - from).powi(2)];
            assert!(
                found.high.sqrt() <= (norm + constant) * (1.0 + 1e-12),
                "{found:?}"
            );
            assert!(
                found.low.sqrt() >= (norm - constant) * (1.0 - 1e-12),
                "{found:?}"
            );
        }
    }
}

/// Poles and what is not defined have no such model, nor has what jumps everywhere.
#[test]
fn what_has_no_bound_is_not_modelled() {
    for text in [
        "1/(x-0.3)",
        "log(x-0.5)",
        "sin(1e5*x)",
        "if(sin(1e5*x)<0,1,0)",
        "abs(x-0.37)^0.25",
    ] {
        let f = Expression::parse(text).unwrap();
        let of = along_x(&f, 1e-3);
        assert!(of.parts([0.0, 1.0]).is_none(), "{text}");
    }
    // An `if` that is decided on each side of a corner is smooth there.
    let f = Expression::parse("if(x<0.5123,sin(9*x),cos(9*x))").unwrap();
    let of = along_x(&f, 1e-6);
    for ends in [[0.0, 0.5123], [0.5123, 1.0]] {
        let parts = of.parts(ends).unwrap();
        assert!(parts.iter().all(|part| !part.is_rough));
    }
}

/// Where f jumps one short part has the jump as its error, and all else is what quadrature on either side finds.
#[test]
fn jumps_are_in_short_parts() {
    let corners = [[0.3, 0.1, 0.0], [0.5, 0.4, 0.0], [1.1, -0.2, 0.0]];
    for (text, jump, place) in [
        ("if(x<0.7123,sin(9*x),2+cos(3*x))", 1.33, 0.7123),
        ("if(x<0.300001,5,1)", 4.0, 0.300001),
    ] {
        let f = Expression::parse(text).unwrap();
        let of = along_x(&f, 1e-5);
        let [a, b, c] = corners.map(|x| x[0]);
        let sides = [[a, b], [b, c]].map(|ends| of.parts(ends).unwrap());
        let rough: Vec<&Part> = sides.iter().flatten().filter(|p| p.is_rough).collect();
        assert!((1..=2).contains(&rough.len()), "{text} {}", rough.len());
        for part in rough {
            let [from, to] = part.ends;
            assert!(from <= place && place <= to && to - from < 1e-11);
            assert!(part.error >= 0.5 * jump);
        }
        let found = along([a, b, c], [&sides[0], &sides[1]]).unwrap();
        let (leaf, carried) = found.on(&corners, 0);
        assert!(leaf.error < 2e-5 && leaf.spots[0] < 1e-8 && leaf.spots[0] > 0.0);
        // ∫ (f - p) λ_i and ∫ |f - p|, with the sections' lengths as weights, broken where f jumps.
        let mut breaks = vec![a, b, c, place];
        for k in 1..60 {
            let step = 0.5_f64.powi(k);
            breaks.extend(
                [place - step, place + step]
                    .iter()
                    .filter(|x| (a..c).contains(*x)),
            );
        }
        breaks.sort_by(f64::total_cmp);
        let rule = exact(1, 9);
        let section = |x: f64| ((x - a) / (b - a)).min((c - x) / (c - b));
        let p = |x: f64| leaf.values[0] + (leaf.values[2] - leaf.values[0]) * (x - a) / (c - a);
        let (mut square, mut mean) = (0.0, 0.0);
        for ends in breaks.windows(2) {
            for ([_, l, ..], weight) in rule.iter() {
                let x = ends[0] + l * (ends[1] - ends[0]);
                let s = f.value([x, 0.0, 0.0]) - p(x);
                let weight = weight * (ends[1] - ends[0]) * section(x) / (0.5 * (c - a));
                square += weight * s * s;
                mean += weight * s;
                assert!(s.abs() <= leaf.wave + leaf.error);
            }
        }
        let all: Interval = carried.flat.iter().copied().sum();
        assert!(
            mean.abs() < 2e-5 && all.magnitude() < 2e-5,
            "{text} {mean} {all:?}"
        );
        assert!(
            square.sqrt() <= leaf.swell + 2e-5,
            "{text} {square} {}",
            leaf.swell
        );
        assert!(
            leaf.swell <= square.sqrt() * 1.001,
            "{text} {square} {}",
            leaf.swell
        );
    }
}

/// What is not known on a spot is in its mean and its mean square, and in the size of s.
#[test]
fn spots_are_charged() {
    let f = Expression::parse("1+sin(3*x)").unwrap();
    let of = along_x(&f, 1e-4);
    let [a, b, c] = [0.0, 0.25, 1.0];
    let mut sides = [[a, b], [b, c]].map(|ends| of.parts(ends).unwrap());
    let plain = along([a, b, c], [&sides[0], &sides[1]]).unwrap();
    let (mut mean, mut square) = (0.0, 0.0);
    for (side, error) in [(0, 7.0), (1, 4.0)] {
        let part = sides[side].last_mut().unwrap();
        (part.error, part.is_rough) = (error, true);
        let height = |x: f64| if side == 0 { x / b } else { (c - x) / (c - b) };
        let [from, to] = part.ends;
        let share = (to - from) * (height(from) + height(to)) / (c - a);
        mean += share * error;
        square += share * error * error;
    }
    let found = along([a, b, c], [&sides[0], &sides[1]]).unwrap();
    assert_eq!(plain.spots, [0.0; 2]);
    assert!(found.spots[0] >= mean && found.spots[1] >= square);
    assert!(found.wave >= 7.0 && found.error <= plain.error);
}

/// Values at the ends are those there, not at ±1, and a primitive has the one it was given.
#[test]
fn ends_have_their_values() {
    let of = Polynomial {
        coefficients: [0.3, -1.1, 0.7, 0.4, -0.2, 0.6],
        off: 0.0,
    };
    for skew in [0.0, 1e-3] {
        let part = part(skew);
        for (k, end) in [(0, -1.0), (1, 1.0)] {
            let t = (part.ends[k] - part.centre) / part.reach;
            let value = value(&of.coefficients, t);
            let found = part.at_end(&of, end);
            assert!(
                found.low - 1e-15 <= value && value <= found.high + 1e-15,
                "{found:?} {value}"
            );
            let given = Interval::new(1.0, 1.5);
            let whole = part.primitive(&of, given, end);
            let there = part.at_end(&whole, end);
            assert!(
                there.low <= given.low && given.high <= there.high,
                "{there:?}"
            );
        }
    }
}

/// The coefficients of a product are off by rounding, its values by what each factor is off times the other.
#[test]
fn products_are_off_by_what_their_factors_are() {
    let mut random = crate::Random::new(8);
    let mut random = || 2.0 * random.next() - 1.0;
    for _ in 0..200 {
        let mut of = |off: f64| Polynomial::<3> {
            coefficients: std::array::from_fn(|_| random()),
            off,
        };
        let (a, b) = (of(0.0), of(0.0));
        let found: Polynomial<5> = a.times(&b);
        let mut off = Big::of(0.0);
        for (n, c) in found.coefficients.iter().enumerate() {
            let terms = (0..3).filter(|i| (i..&(i + 3)).contains(&&n));
            let terms = terms.map(|i| Big::of(a.coefficients[i]) * Big::of(b.coefficients[n - i]));
            off = off + (terms.sum::<Big>() - Big::of(*c)).abs();
        }
        assert!(off.at_most(found.off), "{found:?}");
        let (a, b) = (of(0.1), of(0.2));
        let found: Polynomial<5> = a.times(&b);
        for t in [-1.0, -0.4, 0.0, 0.7, 1.0] {
            for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                let there = [value(&a.coefficients, t), value(&b.coefficients, t)];
                let moved = (there[0] + 0.1 * signs[0]) * (there[1] + 0.2 * signs[1]);
                let off = (moved - value(&found.coefficients, t)).abs();
                assert!(off <= found.off, "{off} {found:?}");
            }
        }
    }
}

/// p is not quite f for a constant f, nor are its values at corners quite p: both are in the error.
#[test]
fn what_p_is_off_is_in_the_error() {
    let (mut random, mut off) = (crate::Random::new(9), [0; 2]);
    for _ in 0..100 {
        let mut corners = [0; 3].map(|_| random.next());
        corners.sort_by(f64::total_cmp);
        let [a, b, c] = corners;
        let f = Expression::constant(0.1);
        let of = along_x(&f, 1e-6);
        let sides = [[a, b], [b, c]].map(|ends| of.parts(ends).unwrap());
        let mut found = along(corners, [&sides[0], &sides[1]]).unwrap();
        let centroid = corners.map(Big::of).into_iter().sum::<Big>() / Big::of(3.0);
        let slope = Big::of(found.p[1]) * (centroid - Big::of(found.middle));
        let apart = (Big::of(0.1) - Big::of(found.p[0]) - slope).abs();
        assert!(apart.at_most(found.error), "{found:?}");
        off[0] += usize::from(!apart.at_most(0.0));
        (found.p, found.error) = ([0.1, 0.3], 0.0);
        let (leaf, _) = found.on(&corners.map(|x| [x, x * x, 0.0]), 0);
        for (value, x) in leaf.values.iter().zip(corners) {
            let away = Big::of(x) - Big::of(found.middle);
            let exact = Big::of(0.1) + Big::of(0.3) * away;
            let apart = (exact - Big::of(*value)).abs();
            assert!(apart.at_most(leaf.error), "{leaf:?}");
            off[1] += usize::from(!apart.at_most(0.0));
        }
    }
    assert!(off[0] > 5 && off[1] > 50, "{off:?}");
}

/// Whatever numbers the intervals have, with 60 digits: of points, of intervals of rounding, and of wide ones.
#[test]
fn means_of_carried_waves_hold_every_product() {
    let mut random = crate::Random::new(12);
    for round in 0..600 {
        let width = [0.0, 1e-14, 1e-3][round % 3];
        let mut number = || 2.0 * random.next() - 1.0;
        let b = [(); 3].map(|()| number());
        let mut some = || {
            let [middle, below, above] = [(); 3].map(|()| number());
            Interval::new(middle - width * below.abs(), middle + width * above.abs())
        };
        let mut three = || [(); 3].map(|()| some());
        let (flat, bubbles, z) = (three(), three(), three());
        let carried = Carried {
            square: Interval::ONE,
            flat,
            bubbles,
        };
        let found = carried.mean(&z, &b);
        let factors = z.into_iter().chain(b.map(Interval::at));
        let pairs = || flat.into_iter().chain(bubbles).zip(factors.clone());
        let ends = |of: Interval| [of.low, of.high].map(Big::of);
        let sum = |is_worse: fn(&Big) -> bool| -> Big {
            let worst = |(s, z): (Interval, Interval)| {
                let products = ends(s).into_iter().flat_map(|s| ends(z).map(|z| &s * &z));
                let worse = |a: Big, b: Big| if is_worse(&(&a - &b)) { a } else { b };
                products.reduce(worse).unwrap()
            };
            pairs().map(worst).sum()
        };
        let (least, most) = (sum(|d| d.at_most(0.0)), sum(|d| d.at_least(0.0)));
        assert!(least.at_least(found.low), "{round}: {least:?} {found:?}");
        assert!(most.at_most(found.high), "{round}: {most:?} {found:?}");
        assert!(found.high - found.low <= 20.0 * width + 1e-14, "{found:?}");
    }
    // A sum that is a number of f64, and is beyond them on the way.
    let beyond = Carried {
        square: Interval::ONE,
        flat: [1.5e154, 1.5e154, -1.5e154].map(Interval::at),
        bubbles: [Interval::ZERO; 3],
    };
    let found = beyond.mean(&[Interval::at(1e154); 3], &[0.0; 3]);
    assert!(found.contains(1.5e308), "{found:?}");
}
