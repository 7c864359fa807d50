//! Rules of integration on simplices, with positive weights, exact to any degree.

/// Points in barycentric coordinates with weights that add up to 1.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub points: Vec<([f64; 4], f64)>,
}

impl Rule {
    /// Exact for polynomials up to `degree` on a simplex: few points where that is simple, and otherwise products of
    /// Gauss–Jacobi rules (Stroud, Approximate Calculation of Multiple Integrals, 1971, section 2.4).
    pub fn new(dim: usize, degree: usize) -> Self {
        if degree <= 1 {
            let mut centre = [0.0; 4];
            centre[..=dim].fill(1.0 / (dim + 1) as f64);
            return Rule {
                points: vec![(centre, 1.0)],
            };
        }
        if degree == 2 {
            let other = match dim {
                2 => 1.0 / 6.0,
                _ => (5.0 - 5.0_f64.sqrt()) / 20.0,
            };
            let point = |i: usize| {
                let mut x = [0.0; 4];
                x[..=dim].fill(other);
                x[i] = 1.0 - dim as f64 * other;
                (x, 1.0 / (dim + 1) as f64)
            };
            return Rule {
                points: (0..=dim).map(point).collect(),
            };
        }
        let count = degree / 2 + 1;
        let axes: Vec<_> = (0..dim).map(|k| gauss_jacobi(count, dim - 1 - k)).collect();
        let mut points = vec![([0.0; 4], 1.0, 1.0)];
        for (k, axis) in axes.iter().enumerate() {
            let each = points.iter().flat_map(|(x, weight, rest)| {
                axis.iter().map(move |(t, w)| {
                    let mut x = *x;
                    x[k] = t * rest;
                    (x, weight * w, rest * (1.0 - t))
                })
            });
            points = each.collect();
        }
        let last = |(mut x, weight, rest): ([f64; 4], f64, f64)| {
            x[dim] = rest;
            (x, weight)
        };
        Rule {
            points: points.into_iter().map(last).collect(),
        }
    }
}

/// Points in [0, 1] and weights that add up to 1 for the weight (1 - t)^a, exact to degree 2 n - 1: the zeros of Jacobi's
/// polynomial, by Newton's method with the zeros that are known divided out.
fn gauss_jacobi(n: usize, a: usize) -> Vec<(f64, f64)> {
    let a = a as f64;
    // P_n^(a, 0) and its derivative, by the recurrence in n.
    let jacobi = |x: f64| {
        let (mut p, mut dp) = ((1.0, (a + (a + 2.0) * x) / 2.0), (0.0, (a + 2.0) / 2.0));
        for k in 2..=n {
            let k = k as f64;
            let c = 2.0 * k + a;
            let first = 2.0 * k * (k + a) * (c - 2.0);
            let (second, third) = ((c - 1.0) * a * a, (c - 1.0) * c * (c - 2.0));
            let fourth = 2.0 * (k + a - 1.0) * (k - 1.0) * c;
            let next = ((second + third * x) * p.1 - fourth * p.0) / first;
            let slope = (third * p.1 + (second + third * x) * dp.1 - fourth * dp.0) / first;
            (p, dp) = ((p.1, next), (dp.1, slope));
        }
        (p.1, dp.1)
    };
    let mut zeros: Vec<f64> = Vec::with_capacity(n);
    for k in 0..n {
        let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..100 {
            let (value, slope) = jacobi(x);
            let known: f64 = zeros.iter().map(|z| 1.0 / (x - z)).sum();
            let step = value / (slope - value * known);
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        zeros.push(x);
    }
    let weight = |x: f64| 1.0 / ((1.0 - x * x) * jacobi(x).1.powi(2));
    let sum: f64 = zeros.iter().map(|x| weight(*x)).sum();
    zeros
        .iter()
        .map(|&x| ((1.0 + x) / 2.0, weight(x) / sum))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ λ₀^i λ₁^j λ₂^k λ₃^l = d! i! j! k! l! / (d + i + j + k + l)! on a simplex of measure 1.
    #[test]
    fn monomials_are_integrated_exactly() {
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        for dim in [2, 3] {
            for degree in 0..=21 {
                let rule = Rule::new(dim, degree);
                for i in 0..=degree {
                    for j in 0..=degree - i {
                        let k = (degree - i - j) / 2;
                        let l = if dim == 3 { degree - i - j - k } else { 0 };
                        let sum: f64 = rule
                            .points
                            .iter()
                            .map(|(x, w)| {
                                let power = |at: usize, n: usize| x[at].powi(n as i32);
                                w * power(0, i) * power(1, j) * power(2, k) * power(3, l)
                            })
                            .sum();
                        let product: f64 = [i, j, k, l].into_iter().map(factorial).product();
                        let exact = factorial(dim) * product / factorial(dim + i + j + k + l);
                        assert!(
                            (sum / exact - 1.0).abs() < 1e-12,
                            "{dim} {degree}: {sum} {exact}"
                        );
                    }
                }
                assert!(
                    rule.points
                        .iter()
                        .all(|(x, w)| *w > 0.0 && x.iter().all(|x| *x >= 0.0))
                );
            }
        }
    }
}
