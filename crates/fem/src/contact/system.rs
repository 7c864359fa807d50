//! The interface of a scheme, condensed or whole, for the iterations of `solve`.

use super::condition::Condition;
use super::scheme::Scheme;
use crate::linear::Choice;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// The replacement of the law `u-ψ + [P]₊` of a condition in a linear step: α (u-ψ) + β γ ∂ₙu.
pub(super) type Weights = [f64; 2];

/// The sizes of the systems that a solve built: 0 if not needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Built {
    /// The unknowns that the iteration works on.
    pub unknowns: usize,
    /// Sparse factorisations, which are kept to the end.
    pub factors: usize,
    /// Dense factorisations of what contact adds, each replacing the last one; between them it is corrected by low rank.
    pub dense: usize,
    /// Preconditioners, where iterations solve.
    pub preconditioners: usize,
}

/// (∇v,∇v) as unit² times a value, so that neither overflows. A power of two in v or in the matrix changes no
/// digit of either, nor of their ratios.
#[derive(Debug, Clone, Copy)]
pub(super) struct Energy {
    pub unit: f64,
    pub value: f64,
}

impl Energy {
    /// Σ v_i · `product`(i) + `rest`, in a unit of one's choice.
    pub fn new(unit: f64, v: &[f64], product: impl Fn(usize) -> f64 + Sync, rest: f64) -> Self {
        if unit == 0.0 || !unit.is_finite() {
            return Energy { unit, value: 1.0 };
        }
        let of_chunk = |(chunk, v): (usize, &[f64])| -> f64 {
            let places = chunk * CHUNK..;
            let terms = places.zip(v);
            terms.map(|(k, v)| product(k) / unit * (v / unit)).sum()
        };
        // Summed in the order of the chunks, whatever the number of cores.
        let parts = parallel::map(v.chunks(CHUNK).enumerate(), of_chunk);
        let sum: f64 = parts.iter().sum();
        let value = (sum + rest / unit / unit).max(0.0);
        Energy { unit, value }
    }

    /// The energy of v, from the product of the matrix with it.
    pub fn of_product(v: &[f64], product: &[f64]) -> Self {
        Energy::new(largest(v), v, |k| product[k], 0.0)
    }

    pub fn is_zero(self) -> bool {
        self.unit == 0.0 || self.value == 0.0
    }

    /// The ratio of the norms.
    pub fn over(self, other: Energy) -> f64 {
        self.unit / other.unit * (self.value / other.value).sqrt()
    }
}

/// A scheme R(u) = 0 in the unknowns that an iteration works on.
pub(super) trait System {
    /// The conditions, in these unknowns.
    fn conditions(&self) -> &[Condition];

    /// Takes other conditions, which see the same dofs by the same functionals.
    fn put_conditions(&mut self, conditions: Vec<Condition>);

    /// The part of the domain of each unknown, where it is one that Γ_D does not hold.
    fn floating(&self) -> Option<&[Option<u32>]>;

    /// The solver of the linear systems.
    fn choice(&self) -> Choice;

    /// The systems that have been built so far.
    fn built(&self) -> Built;

    /// Whether [`System::complete`] solves all that the conditions leave open.
    fn is_solved_but_for_conditions(&self) -> bool;

    /// 0 but for g on Γ_D.
    fn start(&self) -> Vec<f64>;

    /// R(u), 0 on Γ_D.
    fn residual(&self, u: &[f64]) -> Vec<f64>;

    /// The same of the linear scheme with these laws.
    fn linear_residual(&self, laws: &[Weights], u: &[f64]) -> Vec<f64>;

    /// The reference for residuals: the matrix in the maximum norm, and the largest load.
    fn scale(&self) -> [f64; 2];

    /// The energy of an increment.
    fn energy(&self, delta: &[f64]) -> Energy;

    /// The energy of u.
    fn size(&self, u: &[f64]) -> Energy;

    /// δ, 0 on Γ_D, that solves the linear scheme with these laws and the right-hand side -r.
    ///
    /// # Errors
    /// A singular matrix; an iteration that does not converge.
    fn step(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>>;

    /// The same, of which iterations may leave this part.
    ///
    /// # Errors
    /// The errors of [`System::step`].
    fn rough_step(&self, laws: &[Weights], r: &[f64], _left: f64) -> Result<Vec<f64>> {
        self.step(laws, r)
    }

    /// These unknowns of a u at all dofs of the space.
    fn restrict(&self, u: &[f64]) -> Vec<f64>;

    /// u at all dofs of the space.
    fn complete(&self, u: &[f64]) -> Vec<f64>;

    /// The scheme at all dofs of the space.
    fn scheme(&self) -> &Scheme<'_>;

    /// [`System::step`] at all dofs of the space, for a u near its solution; r, whose room it takes, is that of
    /// [`System::scheme`].
    ///
    /// # Errors
    /// The errors of [`System::step`].
    fn step_everywhere(&self, laws: &[Weights], r: Vec<f64>) -> Result<Vec<f64>>;
}

/// Numbers that one task takes.
const CHUNK: usize = 1 << 14;

/// a + b
pub(super) fn plus(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; a.len()];
    parallel::update(&mut sum, |k, _| a[k] + b[k]);
    sum
}

/// The largest |v_i|; NaN where there is one.
pub(super) fn largest(v: &[f64]) -> f64 {
    let larger = |m: f64, v: f64| if m >= v || m.is_nan() { m } else { v };
    let of_some = |v: &[f64]| v.iter().fold(0.0, |m, v| larger(m, v.abs()));
    let parts = parallel::map(v.chunks(CHUNK), of_some);
    parts.into_iter().fold(0.0, larger)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a plain sum, in sizes whose squares are none.
    #[test]
    fn an_energy_is_a_sum_over_all_chunks_in_its_unit() {
        let count = 2 * CHUNK + 5;
        let v: Vec<f64> = (0..count).map(|k| (k % 7) as f64 - 2.0).collect();
        let product: Vec<f64> = (0..count).map(|k| (k / CHUNK + k % 5) as f64).collect();
        let sum: f64 = v.iter().zip(&product).map(|(v, p)| v * p).sum();
        for unit in [1e-200, 1.0, 1e200] {
            let scaled: Vec<f64> = v.iter().map(|v| v * unit).collect();
            let energy = Energy::new(4.0 * unit, &scaled, |k| product[k] * unit, 0.0);
            assert!((16.0 * energy.value / sum - 1.0).abs() < 1e-12);
            assert_eq!(energy.unit, 4.0 * unit);
        }
        assert_eq!(
            Energy::new(2.0, &v, |k| product[k], 12.0).value,
            (sum + 12.0) / 4.0
        );
        assert!(Energy::of_product(&[0.0; 3], &[1.0; 3]).is_zero());
    }

    #[test]
    fn the_largest_is_found_anywhere_and_a_nan_is_not_lost() {
        let mut v = vec![0.5; 40_000];
        assert_eq!(largest(&[]), 0.0);
        for k in [0, 20_000, 39_999] {
            v[k] = -2.0;
            assert_eq!(largest(&v), 2.0);
            v[k] = f64::NAN;
            assert!(largest(&v).is_nan());
            v[k] = 0.5;
        }
    }
}
