//! Simplices cut into parts, and integration that looks closer where it has to.

use super::Rule;

/// Corners of a part of a simplex in the simplex's barycentric coordinates, `dim + 1` of them.
pub type Piece = [[f64; 4]; 4];

/// The simplex itself.
pub const WHOLE: Piece = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
];

/// 2^d parts of equal measure, cut between the edges' midpoints: the corners, and in 3D the
/// octahedron between them along one of its diagonals.
pub fn parts(&[a, b, c, d]: &Piece, dim: usize) -> Vec<Piece> {
    let middle = |p: [f64; 4], q: [f64; 4]| std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
    let ab = middle(a, b);
    if dim == 1 {
        return vec![[a, ab, c, d], [ab, b, c, d]];
    }
    let (ac, bc) = (middle(a, c), middle(b, c));
    if dim == 2 {
        return [[a, ab, ac], [ab, b, bc], [ac, bc, c], [ab, bc, ac]]
            .map(|[p, q, r]| [p, q, r, d])
            .to_vec();
    }
    let (ad, bd, cd) = (middle(a, d), middle(b, d), middle(c, d));
    vec![
        [a, ab, ac, ad],
        [ab, b, bc, bd],
        [ac, bc, c, cd],
        [ad, bd, cd, d],
        [ab, ac, ad, bd],
        [ab, ac, bd, bc],
        [ac, ad, bd, cd],
        [ac, bc, cd, bd],
    ]
}

/// A point of a simplex: barycentric coordinates, weight as a fraction of the measure, and a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub lambda: [f64; 4],
    pub weight: f64,
    pub value: f64,
}

/// Points, weights and values of a function on a simplex that integrate it and its products with
/// linear functions, and what they may be off by, as a mean over the simplex.
///
/// `rule` is believed on the 2^d parts of a part where it gives the same there, for the function and
/// its first moments, as on the part itself, up to `tolerance`; elsewhere the parts are cut in turn,
/// `deepest` times. The difference is reported as the error: that of the parts is smaller.
pub fn samples(
    dim: usize,
    rule: &Rule,
    function: impl Fn(&[f64; 4]) -> f64,
    tolerance: f64,
    deepest: usize,
) -> (Vec<Sample>, f64) {
    let mut adaptive = Adaptive {
        dim,
        rule,
        function,
        tolerance,
        samples: Vec::new(),
        error: 0.0,
    };
    let whole = adaptive.over(&WHOLE, 1.0);
    adaptive.refine(&WHOLE, 1.0, &whole, deepest);
    (adaptive.samples, adaptive.error)
}

struct Adaptive<'a, F> {
    dim: usize,
    rule: &'a Rule,
    function: F,
    tolerance: f64,
    samples: Vec<Sample>,
    error: f64,
}

impl<F: Fn(&[f64; 4]) -> f64> Adaptive<'_, F> {
    fn over(&self, part: &Piece, share: f64) -> Vec<Sample> {
        self.rule
            .iter()
            .map(|(inner, weight)| {
                let lambda: [f64; 4] =
                    std::array::from_fn(|i| (0..=self.dim).map(|k| inner[k] * part[k][i]).sum());
                Sample {
                    lambda,
                    weight: weight * share,
                    value: (self.function)(&lambda),
                }
            })
            .collect()
    }

    fn refine(&mut self, part: &Piece, share: f64, coarse: &[Sample], deeper: usize) {
        let cut = parts(part, self.dim);
        let share = share / cut.len() as f64;
        let fine: Vec<Vec<Sample>> = cut.iter().map(|p| self.over(p, share)).collect();
        let before = moments(coarse);
        let after = fine.iter().map(|samples| moments(samples));
        let after = after.fold([0.0; 5], |a, b| std::array::from_fn(|k| a[k] + b[k]));
        let pairs = before.iter().zip(&after);
        let off = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        // What is not finite does not become so by looking closer.
        let near = !(off > self.tolerance * share * cut.len() as f64) || !off.is_finite();
        if near || deeper == 0 {
            self.samples.extend(fine.into_iter().flatten());
            self.error += off;
            return;
        }
        for (part, samples) in cut.iter().zip(&fine) {
            self.refine(part, share, samples, deeper - 1);
        }
    }
}

/// ∫ of the values, and of their products with the λ_i.
fn moments(samples: &[Sample]) -> [f64; 5] {
    samples.iter().fold([0.0; 5], |mut sum, sample| {
        let part = sample.weight * sample.value;
        sum[4] += part;
        for (sum, lambda) in sum.iter_mut().zip(sample.lambda) {
            *sum += part * lambda;
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::exact;

    fn volume(p: &Piece, dim: usize) -> f64 {
        let edge = |k: usize| nalgebra::Vector3::from_fn(|i, _| p[k][i + 1] - p[0][i + 1]);
        match dim {
            1 => edge(1).norm(),
            2 => edge(1).cross(&edge(2)).norm(),
            _ => edge(1).cross(&edge(2)).dot(&edge(3)).abs(),
        }
    }

    #[test]
    fn parts_are_equal_and_fill_the_whole() {
        for dim in 1..=3 {
            let parts = parts(&WHOLE, dim);
            assert_eq!(parts.len(), 1 << dim);
            let share = 1.0 / parts.len() as f64;
            assert!(parts.iter().all(|p| (volume(p, dim) - share).abs() < 1e-15));
        }
    }

    #[test]
    fn a_smooth_function_needs_no_cut_and_a_jump_many() {
        let rule = exact(2, 5);
        let (smooth, error) = samples(2, &rule, |l| l[0] * l[1] * l[2], 1e-12, 8);
        assert_eq!(smooth.len(), 28);
        assert!(error < 1e-15);
        // λ₀λ₁λ₂ has the mean 2/5!.
        let mean: f64 = smooth.iter().map(|s| s.weight * s.value).sum();
        assert!((mean - 1.0 / 60.0).abs() < 1e-15);
        let jump = |l: &[f64; 4]| f64::from(u8::from(l[0] > 0.3));
        let (cut, error) = samples(2, &rule, jump, 1e-12, 8);
        let mean: f64 = cut.iter().map(|s| s.weight * s.value).sum();
        assert!(cut.len() > 1000 && error > 1e-6);
        assert!((mean - 0.49).abs() < error, "{mean} {error}");
    }
}
