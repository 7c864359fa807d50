//! Quadrature rules on the reference simplices. The penalty-free scheme is defined at the
//! quadrature points of Γ_C, so a rule is part of the method, and every engine gets its points.

/// A rule on the reference simplex: the weights are fractions of its measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    pub name: &'static str,
    /// Reference coordinates, `dim` a point.
    pub points: Vec<Vec<f64>>,
    /// Sum to 1.
    pub weights: Vec<f64>,
}

/// Rules for (f, v) on triangles; the first is the default.
pub const CELL_RULES: [&str; 3] = ["radon-7", "edges-3", "centroid"];

/// Rules on Γ_C and Γ_N in 2D; the first is the default.
pub const FACE_RULES: [&str; 4] = ["gauss-5", "gauss-3", "gauss-2", "midpoint"];

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
/// `edges-3`: the edges' midpoints, degree 2; `centroid`: degree 1. All three are built into FreeFEM.
pub fn triangle(name: &str) -> Option<Rule> {
    let (name, orbits): (_, &[(f64, f64)]) = match name {
        "radon-7" => {
            let r = 15.0_f64.sqrt();
            return Some(symmetric(
                "radon-7",
                Some(9.0 / 40.0),
                &[
                    ((6.0 - r) / 21.0, (155.0 - r) / 1200.0),
                    ((6.0 + r) / 21.0, (155.0 + r) / 1200.0),
                ],
            ));
        }
        "edges-3" => ("edges-3", &[(0.5, 1.0 / 3.0)]),
        "centroid" => return Some(symmetric("centroid", Some(1.0), &[])),
        _ => return None,
    };
    Some(symmetric(name, None, orbits))
}

/// The centroid, and orbits (a, a), (1-2a, a), (a, 1-2a).
fn symmetric(name: &'static str, centroid: Option<f64>, orbits: &[(f64, f64)]) -> Rule {
    let mut rule = Rule {
        name,
        points: Vec::new(),
        weights: Vec::new(),
    };
    if let Some(weight) = centroid {
        rule.points.push(vec![1.0 / 3.0; 2]);
        rule.weights.push(weight);
    }
    for &(a, weight) in orbits {
        let b = 1.0 - 2.0 * a;
        rule.points.extend([vec![a, a], vec![b, a], vec![a, b]]);
        rule.weights.extend([weight; 3]);
    }
    rule
}

/// A rule on the unit interval by name: Gauss–Legendre with 5, 3 or 2 points, or the midpoint.
pub fn interval(name: &str) -> Option<Rule> {
    let (name, count) = match name {
        "gauss-5" => ("gauss-5", 5),
        "gauss-3" => ("gauss-3", 3),
        "gauss-2" => ("gauss-2", 2),
        "midpoint" => ("midpoint", 1),
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

    #[test]
    fn triangle_rules_are_exact_to_their_degree_and_no_further() {
        for (name, degree) in CELL_RULES.iter().zip([5u32, 2, 1]) {
            let rule = triangle(name).unwrap();
            let worst = |degree: u32| {
                (0..=degree)
                    .map(|a| {
                        let b = degree - a;
                        // ∫ x^a y^b over the unit triangle, as a fraction of its area 1/2.
                        let exact = 2.0 * factorial(a) * factorial(b) / factorial(a + b + 2);
                        let sum: f64 = rule
                            .iter()
                            .map(|(l, w)| w * l[1].powi(a as i32) * l[2].powi(b as i32))
                            .sum();
                        (sum - exact).abs()
                    })
                    .fold(0.0, f64::max)
            };
            assert!((0..=degree).all(|d| worst(d) < 1e-15), "{name}");
            assert!(worst(degree + 1) > 1e-5, "{name}");
        }
    }

    #[test]
    fn interval_rules_are_exact_to_their_degree_and_no_further() {
        for (name, degree) in FACE_RULES.iter().zip([9, 5, 3, 1]) {
            let rule = interval(name).unwrap();
            let error = |p: i32| {
                let sum: f64 = rule.iter().map(|(l, w)| w * l[1].powi(p)).sum();
                (sum - 1.0 / f64::from(p + 1)).abs()
            };
            assert!((0..=degree).all(|p| error(p) < 1e-15), "{name}");
            assert!(error(degree + 1) > 1e-7, "{name}");
        }
    }
}
