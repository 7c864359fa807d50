//! Quadrature rules on the reference simplices. The penalty-free scheme is defined at the
//! quadrature points of Γ_C, so a rule is part of the method, and every engine gets its points.

mod parts;

pub use parts::{Piece, WHOLE, cut, longest_edge, parts};

/// A rule on the reference simplex: the weights are fractions of its measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// As scenes and commands call it.
    pub name: &'static str,
    /// Polynomials of this degree are integrated exactly.
    pub degree: usize,
    /// Reference coordinates, `dim` a point.
    pub points: Vec<Vec<f64>>,
    /// Sum to 1.
    pub weights: Vec<f64>,
}

/// The rules on simplices of dimension 1 to 3, the default first. Those of the cells' dimension
/// are for (f, v), those of one less for Γ_C and Γ_N.
pub fn names(dim: usize) -> &'static [&'static str] {
    match dim {
        1 => &["gauss-5", "gauss-3", "gauss-2", "midpoint"],
        2 => &["radon-7", "edges-3", "centroid"],
        _ => &["walkington-14", "hammer-4", "centroid"],
    }
}

/// Rules that other codes use unasked, by which their results are recognised; a scene cannot ask for them.
pub fn foreign(dim: usize) -> &'static [&'static str] {
    match dim {
        1 => &["gauss-4", "simpson", "trapezoid"],
        2 => &["inner-3", "strang-6", "dunavant-6", "vertices-3"],
        _ => &["keast-5", "vertices-4"],
    }
}

/// The rule of this name on the simplex of dimension `dim`.
pub fn rule(dim: usize, name: &str) -> Option<Rule> {
    match dim {
        1 => interval(name),
        2 => triangle(name),
        _ => tetrahedron(name),
    }
}

/// The rule with the fewest points that integrates polynomials of this degree exactly: at most 5, on edges 9.
pub fn exact(dim: usize, degree: usize) -> Rule {
    names(dim)
        .iter()
        .rev()
        .filter_map(|name| rule(dim, name))
        .find(|rule| rule.degree >= degree)
        .expect("invariant: no product here has a degree beyond 9")
}

/// The product with itself of the rule of this name on the unit interval, on the unit square or cube. It is exact to its degree in each
/// coordinate.
pub fn product(dim: usize, name: &str) -> Option<Rule> {
    let line = interval(name)?;
    let mut rule = Rule {
        points: vec![Vec::new()],
        weights: vec![1.0],
        ..line.clone()
    };
    for _ in 0..dim {
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        let of_line = || line.points.iter().zip(&line.weights);
        for (x, w) in of_line().filter(|(_, w)| **w != 0.0) {
            for (point, weight) in rule.points.iter().zip(&rule.weights) {
                points.push([&point[..], x].concat());
                weights.push(weight * w);
            }
        }
        (rule.points, rule.weights) = (points, weights);
    }
    Some(rule)
}

impl Rule {
    /// Barycentric coordinates of point q: λ₀ = 1 - Σ x_k, then the reference coordinates.
    pub fn barycentric(&self, q: usize) -> [f64; 4] {
        let mut lambda = [0.0; 4];
        for (l, x) in lambda[1..].iter_mut().zip(&self.points[q]) {
            *l = *x;
        }
        lambda[0] = 1.0 - self.points[q].iter().sum::<f64>();
        lambda
    }

    /// Points and weights, in turn.
    pub fn iter(&self) -> impl Iterator<Item = ([f64; 4], f64)> + '_ {
        (0..self.weights.len()).map(|q| (self.barycentric(q), self.weights[q]))
    }
}

/// A rule on the reference triangle by name.
///
/// `radon-7`: degree 5 (Radon 1948), the same points as FreeFEM's `qf5pT` and UFL's degree 5;
/// `edges-3`: the edges' midpoints, degree 2; `centroid`: degree 1. All three are built into FreeFEM. Of other codes: `inner-3`,
/// `strang-6` and `dunavant-6` are dolfinx' rules of degree 2, 3 and 4; `vertices-3` is FreeFEM's `qf1pTlump`.
fn triangle(name: &str) -> Option<Rule> {
    let r = 15.0_f64.sqrt();
    Some(match name {
        "radon-7" => Rule::symmetric("radon-7", 5)
            .centroid(2, 9.0 / 40.0)
            .orbit([1, 2], (6.0 - r) / 21.0, (155.0 - r) / 1200.0)
            .orbit([1, 2], (6.0 + r) / 21.0, (155.0 + r) / 1200.0),
        "edges-3" => Rule::symmetric("edges-3", 2).orbit([1, 2], 0.5, 1.0 / 3.0),
        "centroid" => Rule::symmetric("centroid", 1).centroid(2, 1.0),
        "inner-3" => Rule::symmetric("inner-3", 2).orbit([1, 2], 1.0 / 6.0, 1.0 / 3.0),
        "strang-6" => {
            let [a, b, c] = [
                0.659_027_622_374_092,
                0.231_933_368_553_031,
                0.109_039_009_072_877,
            ];
            Rule {
                points: [[a, b], [a, c], [b, a], [b, c], [c, a], [c, b]]
                    .map(Vec::from)
                    .into(),
                weights: vec![1.0 / 6.0; 6],
                ..Rule::symmetric("strang-6", 3)
            }
        }
        "dunavant-6" => {
            let r = 10.0_f64.sqrt();
            let (a, w) = (
                (38.0 - 44.0 * 0.4_f64.sqrt()).sqrt(),
                (213_125.0 - 53_320.0 * r).sqrt(),
            );
            Rule::symmetric("dunavant-6", 4)
                .orbit([1, 2], (8.0 - r + a) / 18.0, (620.0 + w) / 3720.0)
                .orbit([1, 2], (8.0 - r - a) / 18.0, (620.0 - w) / 3720.0)
        }
        "vertices-3" => Rule::symmetric("vertices-3", 1).orbit([1, 2], 0.0, 1.0 / 3.0),
        _ => return None,
    })
}

/// A rule on the reference tetrahedron by name.
///
/// `walkington-14`: degree 5 (N. J. Walkington, Quadrature on simplices of arbitrary dimension,
/// 2000), FreeFEM's `qfV5`; `hammer-4`: degree 2 (P. C. Hammer, A. H. Stroud 1956), FreeFEM's
/// `qfV2`; `centroid`: degree 1. Of other codes: `keast-5`, dolfinx' rule of degree 3; `vertices-4`.
fn tetrahedron(name: &str) -> Option<Rule> {
    Some(match name {
        "walkington-14" => Rule::symmetric("walkington-14", 5)
            .orbit([1, 3], 0.310_885_919_263_300_6, 0.112_687_925_718_015_85)
            .orbit([1, 3], 0.092_735_250_310_891_23, 0.073_493_043_116_361_95)
            .orbit([2, 2], 0.045_503_704_125_649_65, 0.042_546_020_777_081_466),
        "hammer-4" => {
            Rule::symmetric("hammer-4", 2).orbit([1, 3], (5.0 - 5.0_f64.sqrt()) / 20.0, 0.25)
        }
        "centroid" => Rule::symmetric("centroid", 1).centroid(3, 1.0),
        "keast-5" => Rule::symmetric("keast-5", 3)
            .centroid(3, -0.8)
            .orbit([1, 3], 1.0 / 6.0, 0.45),
        "vertices-4" => Rule::symmetric("vertices-4", 1).orbit([1, 3], 0.0, 0.25),
        _ => return None,
    })
}

impl Rule {
    fn symmetric(name: &'static str, degree: usize) -> Self {
        Rule {
            name,
            degree,
            points: Vec::new(),
            weights: Vec::new(),
        }
    }

    fn centroid(mut self, dim: usize, weight: f64) -> Self {
        self.points.push(vec![1.0 / (dim + 1) as f64; dim]);
        self.weights.push(weight);
        self
    }

    /// All points with `counts[1]` barycentric coordinates `a` and `counts[0]` equal others, each of this weight.
    fn orbit(mut self, counts: [usize; 2], a: f64, weight: f64) -> Self {
        let [others, of_a] = counts;
        let b = (1.0 - of_a as f64 * a) / others as f64;
        for places in 0..1_usize << (others + of_a) {
            if places.count_ones() as usize != others {
                continue;
            }
            let lambda = |i: usize| if places >> i & 1 == 1 { b } else { a };
            self.points.push((1..others + of_a).map(lambda).collect());
            self.weights.push(weight);
        }
        self
    }
}

/// A rule on the unit interval by name: Gauss–Legendre with 5, 3 or 2 points, or the midpoint; of other codes Gauss–Legendre with 4,
/// Simpson's rule and the trapezoid.
fn interval(name: &str) -> Option<Rule> {
    let (name, count): (_, usize) = match name {
        "gauss-5" => ("gauss-5", 5),
        "gauss-3" => ("gauss-3", 3),
        "gauss-2" => ("gauss-2", 2),
        "midpoint" => ("midpoint", 1),
        "gauss-4" => ("gauss-4", 4),
        // Of the ends, and of the midpoint with 4 times their weight.
        "trapezoid" | "simpson" => {
            let (name, degree, middle) = match name {
                "simpson" => ("simpson", 3, 2.0 / 3.0),
                _ => ("trapezoid", 1, 0.0),
            };
            let end = 0.5 * (1.0 - middle);
            return Some(Rule {
                name,
                degree,
                points: vec![vec![0.0], vec![0.5], vec![1.0]],
                weights: vec![end, middle, end],
            });
        }
        _ => return None,
    };
    // Nodes and weights on (-1, 1), in closed form.
    let (nodes, weights): (Vec<f64>, Vec<f64>) = match count {
        1 => (vec![0.0], vec![2.0]),
        2 => {
            let a = (1.0_f64 / 3.0).sqrt();
            (vec![-a, a], vec![1.0, 1.0])
        }
        3 => {
            let a = 0.6_f64.sqrt();
            (vec![-a, 0.0, a], vec![5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0])
        }
        4 => {
            let s = 2.0 / 7.0 * 1.2_f64.sqrt();
            let (a, b) = ((3.0 / 7.0 - s).sqrt(), (3.0 / 7.0 + s).sqrt());
            let r = 30.0_f64.sqrt() / 36.0;
            (vec![-b, -a, a, b], vec![0.5 - r, 0.5 + r, 0.5 + r, 0.5 - r])
        }
        _ => {
            let s = 2.0 * (10.0_f64 / 7.0).sqrt();
            let (a, b) = ((5.0 - s).sqrt() / 3.0, (5.0 + s).sqrt() / 3.0);
            let r = 13.0 * 70.0_f64.sqrt();
            let (va, vb) = ((322.0 + r) / 900.0, (322.0 - r) / 900.0);
            (vec![-b, -a, 0.0, a, b], vec![vb, va, 128.0 / 225.0, va, vb])
        }
    };
    Some(Rule {
        name,
        degree: 2 * count - 1,
        points: nodes.iter().map(|x| vec![0.5 * (1.0 + x)]).collect(),
        weights: weights.iter().map(|w| 0.5 * w).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: u32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    /// ∫ x^a y^b z^c over the reference simplex as a fraction of its measure.
    fn moment(powers: &[u32]) -> f64 {
        let dim = powers.len() as u32;
        let numerator: f64 = powers.iter().map(|&p| factorial(p)).product();
        factorial(dim) * numerator / factorial(powers.iter().sum::<u32>() + dim)
    }

    /// All exponents of monomials of this degree.
    fn monomials(dim: usize, degree: u32) -> Vec<Vec<u32>> {
        if dim == 1 {
            return vec![vec![degree]];
        }
        let with_first = |first| {
            let rest = monomials(dim - 1, degree - first);
            rest.into_iter().map(move |r| [vec![first], r].concat())
        };
        (0..=degree).flat_map(with_first).collect()
    }

    #[test]
    fn rules_are_exact_to_their_degree_and_no_further() {
        for dim in 1..=3 {
            for name in names(dim).iter().chain(foreign(dim)) {
                let rule = rule(dim, name).unwrap();
                assert_eq!(rule.points.len(), rule.weights.len());
                let worst = |degree: usize| {
                    let error = |powers: Vec<u32>| {
                        let value = |point: &Vec<f64>| -> f64 {
                            let pairs = point.iter().zip(&powers);
                            pairs.map(|(x, &p)| x.powi(p as i32)).product()
                        };
                        let sum: f64 = rule
                            .points
                            .iter()
                            .zip(&rule.weights)
                            .map(|(p, w)| w * value(p))
                            .sum();
                        (sum - moment(&powers)).abs()
                    };
                    let all = monomials(dim, degree as u32).into_iter();
                    all.map(error).fold(0.0, f64::max)
                };
                assert!((0..=rule.degree).all(|d| worst(d) < 2e-15), "{dim}D {name}");
                assert!(worst(rule.degree + 1) > 1e-7, "{dim}D {name}");
            }
        }
    }

    /// ∫ x^a y^b z^c over the unit cube is 1/((a + 1)(b + 1)(c + 1)).
    #[test]
    fn products_are_exact_in_each_coordinate() {
        for (name, dim) in [
            ("gauss-3", 2),
            ("gauss-2", 3),
            ("trapezoid", 3),
            ("simpson", 1),
        ] {
            let rule = product(dim, name).unwrap();
            let error = |powers: [u32; 3]| {
                let value = |x: &Vec<f64>| -> f64 {
                    x.iter()
                        .zip(powers)
                        .map(|(x, p)| x.powi(p as i32))
                        .product()
                };
                let points = rule.points.iter().zip(&rule.weights);
                let sum: f64 = points.map(|(x, w)| w * value(x)).sum();
                let exact: f64 = powers[..dim]
                    .iter()
                    .map(|p| 1.0 / f64::from(p + 1))
                    .product();
                (sum - exact).abs()
            };
            let most = rule.degree as u32;
            assert!(error([most, most, most]) < 1e-15, "{name}");
            assert!(error([0, 0, 0]) < 1e-15 && rule.points.iter().all(|x| x.len() == dim));
            assert!(error([most + 1, 0, 0]) > 1e-4, "{name}");
        }
        assert_eq!(product(3, "trapezoid").unwrap().weights.len(), 8);
    }

    #[test]
    fn the_cheapest_exact_rule_is_taken() {
        let points = |dim, degree| exact(dim, degree).weights.len();
        assert_eq!([0, 2, 4].map(|degree| points(2, degree)), [1, 3, 7]);
        assert_eq!([0, 2, 4].map(|degree| points(3, degree)), [1, 4, 14]);
    }
}
