//! Decides whether two codes converge to the same limit, without an exact solution or a theoretical order.
//!
//! The only data are distances between results: of each code on each level, and of each to all others. From these each code gets its
//! order, by how far it moves from level to level, and an extrapolated result X = uₖ + α (uₖ - uₖ₋₁), α = 1/(rᵖ - 1),
//! where r is the ratio of the sizes (L. F. Richardson, 1911). The distance of two such results does not need their values: for
//! coefficients with Σcᵢ = 0, |Σ cᵢ uᵢ|² = -½ Σ cᵢ cⱼ |uᵢ - uⱼ|². Numbers are results whose distance is |a - b|.
//!
//! The error of X is at most twice the sum of its distance from that of the level before, of the change by using a neighbouring order, and of
//! a tenth of its step; that of the finest result, at most twice its estimated error. With second terms of up to 40 % of the first on the coarsest of three levels this holds for orders from 1/2 to
//! 4. Two limits differ only if the finest results also differ by more than three times the distance that either still moves.

use serde::Serialize;

use super::fit::power;
use super::limit::Found;
use crate::text::{Number, Text, text};

/// The range of theoretical orders.
const NATURAL: [f64; 11] = [
    0.5,
    2.0 / 3.0,
    1.0,
    4.0 / 3.0,
    1.5,
    2.0,
    2.5,
    3.0,
    4.0,
    5.0,
    6.0,
];
/// A code that moves with a lower order does not converge on these levels.
const LEAST: f64 = 0.3;
/// If the orders of two neighbouring triples differ by more, they are not yet asymptotic.
const STEADY: f64 = 1.0;
/// Safety factor for the uncertainty of an extrapolated result.
const SAFE: f64 = 2.0;
/// Safety factor for the distance that the finest results still move.
const FAR: f64 = 3.0;
/// A step below this fraction of the size is rounding.
const ROUNDING: f64 = 1e-12;
/// One code is nearer if the other is at least this many times farther from its limit.
const NEARER: f64 = 2.0;

/// The convergence of one code.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Course {
    /// From the last three levels; `None` if the last step is rounding.
    pub order: Option<f64>,
    /// The estimated distance of its finest result from its limit.
    pub away: f64,
    /// The bound for the distance of the extrapolated result from the limit.
    pub room: f64,
    /// α: the extrapolated result is uₖ + α (uₖ - uₖ₋₁).
    #[serde(skip)]
    pub factor: f64,
    /// The remaining distance, if the order is at most 1, or 2 if four levels show it.
    #[serde(skip)]
    left: f64,
}

/// The limits of two codes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Meeting {
    /// Are they the same?
    pub found: Found,
    /// The distance of the limits; `None` if a code does not converge on these levels.
    pub interval: Option<[f64; 2]>,
    /// Limits that are nearer than this are equal.
    pub bound: f64,
    /// The size of the finest results.
    pub scale: f64,
    /// The convergence of each; `None` if it does not converge on these levels.
    pub courses: [Option<Course>; 2],
    /// The next finer level, as text for the command line.
    pub add: Option<String>,
}

/// Distances of the results of one code, or of two: by code and level, the coarsest level first.
pub type Distance<'a> = &'a dyn Fn([usize; 2], [usize; 2]) -> f64;

impl Course {
    /// From one code's results at decreasing sizes; `None` for fewer than three levels, or if it does not converge on them.
    pub fn new(code: usize, sizes: &[f64], scale: f64, distance: Distance) -> Option<Self> {
        let last = sizes.len().checked_sub(1)?;
        let step = |k: usize| distance([code, k], [code, k + 1]);
        let seen = |k: usize| {
            power(
                [sizes[k], sizes[k + 1], sizes[k + 2]],
                step(k) / step(k + 1),
                0.05,
                12.0,
            )
        };
        if last < 2 || sizes.windows(2).any(|pair| !(pair[0] > pair[1])) {
            return None;
        }
        let moved = step(last - 1);
        if moved <= ROUNDING * scale {
            return Some(Course {
                order: None,
                away: moved,
                room: moved,
                factor: 0.0,
                left: moved,
            });
        }
        let order = seen(last - 2).filter(|order| *order >= LEAST)?;
        if last > 2 && !seen(last - 3).is_some_and(|before| (before - order).abs() <= STEADY) {
            return None;
        }
        let near = |p: &f64| (p / order).ln().abs();
        let natural = NATURAL
            .into_iter()
            .min_by(|p, q| near(p).total_cmp(&near(q)))?;
        let factor = |k: usize, p: f64| 1.0 / ((sizes[k] / sizes[k + 1]).powf(p) - 1.0);
        let [fine, coarse] = [last - 1, last - 2].map(|k| factor(k, order.min(natural)));
        // X of the finest levels minus that of the level before.
        let between = [
            (last, 1.0 + fine),
            (last - 1, -fine - 1.0 - coarse),
            (last - 2, coarse),
        ];
        let between = norm(&between.map(|(k, c)| ([code, k], c)), distance);
        let other = moved * (factor(last - 1, order) - factor(last - 1, natural)).abs();
        let room = SAFE * (between + other + 0.1 * fine * moved);
        room.is_finite().then_some(Course {
            order: Some(order),
            away: fine * moved,
            room,
            factor: fine,
            left: factor(last - 1, order.min(if last > 2 { 2.0 } else { 1.0 })) * moved,
        })
    }
}

impl Meeting {
    /// From two codes on the same levels, each with separate sizes. Limits nearer than `bound` are equal; `scale` is the size of the results.
    pub fn new(sizes: [&[f64]; 2], scale: f64, bound: f64, distance: Distance) -> Self {
        let courses = [0, 1].map(|code| Course::new(code, sizes[code], scale, distance));
        let mut meeting = Meeting {
            found: Found::Unknown,
            interval: None,
            bound,
            scale,
            courses,
            add: None,
        };
        let [Some(a), Some(b)] = &meeting.courses else {
            return meeting;
        };
        let [last, of_b] = sizes.map(|of| of.len() - 1);
        let points = [
            ([0, last], 1.0 + a.factor),
            ([0, last - 1], -a.factor),
            ([1, of_b], -1.0 - b.factor),
            ([1, of_b - 1], b.factor),
        ];
        let apart = norm(&points, distance);
        let finest = distance([0, last], [1, of_b]);
        if !apart.is_finite() || !finest.is_finite() {
            return meeting;
        }
        // The errors of finite elements oscillate in each cell, so extrapolated fields may be less accurate than the finest ones.
        let rooms = [(apart, a.room + b.room), (finest, SAFE * (a.away + b.away))];
        let low = rooms
            .iter()
            .fold(0.0, |low: f64, (far, room)| low.max(far - room));
        let high = rooms
            .iter()
            .fold(f64::INFINITY, |high, (far, room)| high.min(far + room));
        let finest = finest - FAR * (a.left + b.left);
        let interval = [low.min(high), high];
        meeting.found = match interval {
            [_, high] if high <= bound.max(ROUNDING * scale) => Found::Zero,
            [low, _] if low > bound && finest > bound => Found::Apart,
            _ => Found::Unknown,
        };
        meeting.interval = Some(interval);
        meeting
    }

    /// The code whose finest result is nearer to the common limit, if there is one.
    pub fn nearer(&self) -> Option<usize> {
        let [Some(a), Some(b)] = &self.courses else {
            return None;
        };
        // Different limits are not a common one.
        let is_nearer = |x: &Course, y: &Course| {
            self.found == Found::Zero && y.away - y.room > NEARER * (x.away + x.room)
        };
        [is_nearer(a, b), is_nearer(b, a)].iter().position(|is| *is)
    }

    /// A clause about two codes: `converge to each other …`.
    pub fn words(&self, names: [&str; 2]) -> Text {
        let add = match &self.add {
            Some(add) => text!("add {add}"),
            None => text!("add finer levels"),
        };
        let part = |x: f64| x / self.scale;
        match (self.found, self.interval) {
            (Found::Zero, Some([_, high])) => {
                let nearer = self
                    .nearer()
                    .map(|k| text!("; {} is nearer to it", names[k]));
                let high = Number::at_most(part(high), 2);
                text!("converge to each other: their limits differ by at most {high} of it{nearer}")
            }
            (Found::Apart, Some([low, high])) => {
                let [low, high] = [
                    Number::at_least(part(low.max(self.bound)), 2),
                    Number::at_most(part(high), 2),
                ];
                text!(
                    "do not converge to each other: their limits are between {low} and {high} of it apart"
                )
            }
            (_, Some([_, high])) => {
                let high = Number::at_most(part(high), 2);
                let bound = Number::new(part(self.bound), 2);
                text!(
                    "cannot be shown to converge to each other on these levels: their limits may be {high} of it apart, where {bound} is allowed; {add}"
                )
            }
            _ => {
                let wild = (0..2).filter(|k| self.courses[*k].is_none());
                let wild: Vec<&str> = wild.map(|k| names[k]).collect();
                if wild.is_empty() {
                    return text!(
                        "cannot be shown to converge to each other: their results on neighbouring levels cannot be compared"
                    );
                }
                let does = if wild.len() == 1 { "does" } else { "do" };
                let wild = wild.join(" and ");
                text!(
                    "cannot be shown to converge to each other: {wild} {does} not converge steadily on these levels; {add}"
                )
            }
        }
    }
}

/// |Σ cᵢ uᵢ| of results from their distances, with Σ cᵢ = 0.
fn norm(of: &[([usize; 2], f64)], distance: Distance) -> f64 {
    let mut square = 0.0;
    for (k, (u, c)) in of.iter().enumerate() {
        square -= of[..k]
            .iter()
            .map(|(v, d)| c * d * distance(*u, *v).powi(2))
            .sum::<f64>();
    }
    // Unlike `max`, which would turn NaN into 0.
    if square < 0.0 { 0.0 } else { square.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::super::limit::tests::random;
    use super::*;
    use faceoff_form::{Problem, own};
    use faceoff_mesh::mesh::generate::union_jack;

    type Point = [f64; 3];

    fn far(a: &Point, b: &Point) -> f64 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    }

    fn of(paths: &[Vec<Point>; 2], rtol: f64) -> Meeting {
        let sizes: Vec<f64> = (0..paths[0].len())
            .map(|k| 0.5_f64.powi(k as i32))
            .collect();
        let distance = |[a, k]: [usize; 2], [b, l]: [usize; 2]| far(&paths[a][k], &paths[b][l]);
        Meeting::new([&sizes, &sizes], 1.0, rtol, &distance)
    }

    /// 1 + h², with no second term, has the limit 1 to rounding; so has 1 - h.
    #[test]
    fn powers_are_extrapolated() {
        let path = |p: f64, c: f64| -> Vec<Point> {
            (0..4)
                .map(|k| [1.0 + c * 0.5_f64.powf(p * f64::from(k)), 0.0, 0.0])
                .collect()
        };
        let found = of(&[path(2.0, 0.1), path(1.0, -0.1)], 1e-1);
        let orders = found.courses.map(|of| of.unwrap().order.unwrap());
        assert!((orders[0] - 2.0).abs() < 1e-9 && (orders[1] - 1.0).abs() < 1e-9);
        assert_eq!(
            (found.found, found.nearer()),
            (Found::Zero, Some(0)),
            "{found:?}"
        );
        let words = found.words(["a", "b"]).to_string();
        assert!(
            words.starts_with("converge to each other") && words.ends_with("a is nearer to it"),
            "{words}"
        );
    }

    /// A result that differs by rounding is not apart, and one that moves without falling is not reported to converge.
    #[test]
    fn what_does_not_converge_is_unknown() {
        let still = vec![[1.0, 0.0, 0.0]; 3];
        assert_eq!(of(&[still.clone(), still.clone()], 0.0).found, Found::Zero);
        let wild: Vec<Point> = [1.0, 1.2, 0.9].map(|x| [x, 0.0, 0.0]).to_vec();
        let found = of(&[still.clone(), wild], 1e-3);
        assert_eq!(found.found, Found::Unknown);
        let words = found.words(["a", "b"]).to_string();
        assert!(words.contains("b does not converge steadily"), "{words}");
        assert_eq!(
            of(&[still[..2].to_vec(), still[..2].to_vec()], 1.0).found,
            Found::Unknown
        );
    }

    /// An unknown distance leaves everything undecided, whichever it is.
    #[test]
    fn what_cannot_be_compared_is_unknown() {
        let sizes = [1.0, 0.5, 0.25];
        let value =
            |[code, k]: [usize; 2]| 1.0 + (code as f64 - 0.5) * 1e-5 * f64::powi(sizes[k], 2);
        let all = [0, 1].map(|code| [0, 1, 2].map(|k| [code, k])).concat();
        for (i, gap) in all.iter().enumerate() {
            for other in &all[..i] {
                let distance = |a: [usize; 2], b: [usize; 2]| {
                    let is_gap = [a.min(b), a.max(b)] == [*gap.min(other), *gap.max(other)];
                    if is_gap {
                        f64::NAN
                    } else {
                        (value(a) - value(b)).abs()
                    }
                };
                // The coarsest result of a code is not compared with the other code.
                let is_used = gap[0] == other[0] || gap[1].min(other[1]) > 0;
                let found = Meeting::new([&sizes, &sizes], 1.0, 1e-3, &distance);
                let expected = if is_used { Found::Unknown } else { Found::Zero };
                assert_eq!(found.found, expected, "{gap:?} {other:?}: {found:?}");
            }
        }
    }

    /// 200 pairs of right codes, whose errors have any orders, directions and second terms: none is apart. 200 with limits that differ by
    /// more than the tolerance: none is reported to converge to each other. The fractions that are decided are bounded from below.
    #[test]
    fn random_codes_are_not_misjudged() {
        let mut random = random(11);
        let mut told = [0; 2];
        for draw in 0..400 {
            let is_off = draw % 2 == 1;
            let mut vector = |size: f64| -> Point {
                let of = [(); 3].map(|()| 2.0 * random() - 1.0);
                let norm = far(&of, &[0.0; 3]).max(1e-3);
                of.map(|x| size * x / norm)
            };
            let off = vector(if is_off { 1e-2 } else { 0.0 });
            let errors = [(); 2].map(|()| (vector(1.0), vector(1.0)));
            let rtol = 1e-2 * 10.0_f64.powf(-0.1 - 2.0 * random());
            let levels = 3 + draw / 2 % 2;
            let paths = [0, 1].map(|code| {
                let orders = [0.5, 2.0 / 3.0, 1.0, 2.0, 2.0, 3.0, 4.0];
                let p = orders[(random() * 7.0) as usize];
                let q = p + [0.5, 1.0, 2.0][(random() * 3.0) as usize];
                let size = 10.0_f64.powf(-0.3 - 2.2 * random());
                let second = 0.4 * random() * size;
                let (first, other) = errors[code];
                let point = |k: usize| {
                    let h = 0.5_f64.powi(k as i32);
                    [0, 1, 2].map(|x| {
                        let error = size * first[x] * h.powf(p) + second * other[x] * h.powf(q);
                        f64::from(u8::from(x == 0)) + code as f64 * off[x] + error
                    })
                };
                (0..levels).map(point).collect::<Vec<_>>()
            });
            let found = of(&paths, rtol);
            let wrong = if is_off { Found::Zero } else { Found::Apart };
            assert_ne!(found.found, wrong, "draw {draw}: {found:?}");
            told[usize::from(is_off)] += usize::from(found.found != Found::Unknown);
        }
        assert!(told.iter().all(|told| *told >= 25), "{told:?}");
    }

    /// An integral of the solution of -∇·(1 + k x)∇u + c u = f, with values on the left, on three meshes of one of two families.
    fn discretised(element: &str, is_graded: bool, [k, c, wave, load]: [f64; 4]) -> Vec<Point> {
        let text = format!(
            "name = \"real\"\n[spaces]\nu = \"{element}\"\n\
             [form]\nF = \"(1 + {k}*x)*inner(grad(u), grad(v))*dx + {c}*u*v*dx - {load}*(1 + sin({wave}*x)*y)*v*dx\"\n\
             [dirichlet]\nleft = \"0\"\n"
        );
        let value = |n: usize| {
            let mut mesh = union_jack(n, [1.0; 2]);
            if is_graded {
                for point in mesh.points.to_mut() {
                    point[0] *= 0.5 + 0.5 * point[0];
                    point[1] += 0.2 * point[1] * (1.0 - point[1]) * (1.0 + point[0]);
                }
            }
            let problem = Problem::parse("real.toml".as_ref(), &text, &mesh).unwrap();
            let solution = own::solve(&problem, &mesh).unwrap();
            let (mut cells, fields) = own::output(&solution.assembler, &solution.u);
            cells.fields = fields;
            let mut number = own::Functionals::new(&problem);
            number.add("(1 + x*y)*u*dx").unwrap();
            number.of(&mesh, &cells, f64::EPSILON).unwrap()[0]
        };
        [4, 8, 16].map(|n| [value(n), 0.0, 0.0]).to_vec()
    }

    /// The same of discretisations: two elements or two families of meshes, of one problem or of two whose loads are 1 % apart.
    #[test]
    fn discretisations_are_not_misjudged() {
        let mut random = random(63);
        let (mut told, mut tried) = ([0; 2], 0);
        for draw in (0..60).filter(|k| crate::run::is_in_turn(k / 2, 3)) {
            tried += 1;
            let is_off = draw % 2 == 1;
            let mut data = [0; 4].map(|_| 0.5 + 3.0 * random());
            let elements = ["CR", "P1", "P2"].map(|of| (random(), of));
            let mut elements = elements.to_vec();
            elements.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            let rtol = 1e-2 * 10.0_f64.powf(-0.1 - 2.0 * random());
            let mut a = discretised(elements[0].1, random() < 0.5, data);
            if is_off {
                data[3] *= 1.01;
            }
            let mut b = discretised(elements[1].1, random() < 0.5, data);
            let scale = a[2][0];
            a.iter_mut().chain(&mut b).for_each(|x| x[0] /= scale);
            let found = of(&[a, b], rtol);
            let wrong = if is_off { Found::Zero } else { Found::Apart };
            assert_ne!(found.found, wrong, "draw {draw}: {found:?}");
            told[usize::from(is_off)] += usize::from(found.found != Found::Unknown);
        }
        println!("{told:?} of {tried}");
        assert!(told.iter().all(|told| 8 * told >= tried), "{told:?}");
    }
}
