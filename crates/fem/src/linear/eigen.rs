//! The eigenvalues of a symmetric pencil A x = λ M x that are nearest to a shift σ, with their vectors.
//!
//! A Krylov space of (A - σM)⁻¹ M is spanned from a block of vectors, so that eigenvalues may be multiple, and started again from the best
//! vectors in it until they solve the equations.

use faer::{Mat, Side};

use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

use super::General;
use super::krylov::{dot, norm};

/// A matrix by its rows, whose columns ascend.
pub type Rows = Vec<Vec<(usize, f64)>>;

/// The number of extra vectors in the block, so that the last requested ones converge as fast.
const MORE: usize = 8;
/// Powers of the operator in a Krylov space.
const POWERS: usize = 4;
/// The space is started again so often.
const MOST_STARTS: usize = 60;
/// A residual below this part of its terms is small enough.
const SMALL: f64 = 1e-13;
/// A residual that no start makes smaller is accepted up to this fraction of its terms, or this multiple of the effect of rounding x on A x.
const LARGEST_RESIDUAL: f64 = 1e-9;
const ROUNDINGS: f64 = 64.0;
/// A vector that loses all but this part to the others depends on them.
const DEPENDENT: f64 = 1e-10;

/// What to do where A - σM is singular.
const ON_EIGENVALUE: &str = "give a shift that is not an eigenvalue, as -1 where 0 is one";

/// The product of a matrix and a vector.
pub fn product(rows: &Rows, x: &[f64]) -> Vec<f64> {
    let each = rows.iter();
    each.map(|row| row.iter().map(|(j, a)| a * x[*j]).sum())
        .collect()
}

/// The sums of the absolute values of what the product is made of.
fn sizes(rows: &Rows, x: &[f64]) -> Vec<f64> {
    let each = rows.iter();
    each.map(|row| row.iter().map(|(j, a)| (a * x[*j]).abs()).sum())
        .collect()
}

/// ‖A x - λ M x‖ over ‖A x‖ + (|λ| + |λ - σ|) ‖M x‖; infinite where that is not a number.
pub fn residual(ax: &[f64], mx: &[f64], value: f64, shift: f64) -> f64 {
    let difference: Vec<f64> = ax.iter().zip(mx).map(|(a, m)| a - value * m).collect();
    let size = norm(ax) + (value.abs() + (value - shift).abs()) * norm(mx);
    let part = norm(&difference) / size;
    if part.is_finite() {
        part
    } else {
        f64::INFINITY
    }
}

/// The `count` eigenvalues nearest to a shift, ascending, with vectors of norm 1 by M; `places` are where the unknowns are.
///
/// # Errors
/// A shift that is an eigenvalue, fewer unknowns than eigenvalues, an M that is not positive, an iteration that does not converge.
pub fn nearest(
    a: &Rows,
    m: &Rows,
    places: &[[f64; 3]],
    shift: f64,
    count: usize,
) -> Result<Vec<(f64, Vec<f64>)>> {
    let n = a.len();
    let refuse = |what: String, remedy: &str| Error::Solver {
        what,
        remedy: remedy.to_owned(),
    };
    if n < count {
        let what = format!("there are {n} free unknowns, and {count} eigenvalues are needed");
        return Err(refuse(what, "refine the mesh, or ask for fewer"));
    }
    let shifted = a.iter().zip(m).map(|(a, m)| less(a, m, shift)).collect();
    let factor = General::new(shifted, places, None).map_err(|error| match error {
        Error::Solver { what, .. } => refuse(format!("A - {shift} M: {what}"), ON_EIGENVALUE),
        other => other,
    })?;
    let block = (count + MORE).min(n);
    let mut start: Vec<Vec<f64>> = (0..block).map(|k| noise(n, k)).collect();
    let (mut best, mut is_on_eigenvalue) = (f64::INFINITY, false);
    for _ in 0..MOST_STARTS {
        cancel::check()?;
        let space = Space::new(&factor, m, start, n)?;
        if space.basis.len() < count {
            let what = format!(
                "M is of rank {}, and {count} eigenvalues are needed",
                space.basis.len()
            );
            return Err(refuse(
                what,
                "ask for fewer, or give an m that is positive on more functions",
            ));
        }
        start = space.ritz(block)?;
        let each = start.iter().take(count).map(|x| {
            let (ax, mx) = (product(a, x), product(m, x));
            let value = dot(x, &ax) / dot(x, &mx);
            let size = norm(&ax) + (value.abs() + (value - shift).abs()) * norm(&mx);
            let rounding = ROUNDINGS * f64::EPSILON * norm(&sizes(a, x)) / size;
            let left = residual(&ax, &mx, value, shift);
            // Rounding may hide from the factorisation that it is one.
            let distance = (value - shift).abs() * norm(&mx);
            is_on_eigenvalue |= distance <= ROUNDINGS * f64::EPSILON * norm(&sizes(a, x));
            (value, left, left / LARGEST_RESIDUAL.max(rounding))
        });
        let found: Vec<(f64, f64, f64)> = each.collect();
        let worst = found.iter().map(|of| of.1).fold(0.0, f64::max);
        let is_stuck = !(worst < 0.5 * best) && found.iter().all(|of| of.2 <= 1.0);
        if worst <= SMALL || is_stuck {
            let mut pairs: Vec<(f64, Vec<f64>)> =
                found.into_iter().map(|of| of.0).zip(start).collect();
            pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
            return Ok(pairs);
        }
        best = worst.min(best);
    }
    let what = format!(
        "the eigenvalues nearest to {shift} did not converge: the largest residual is {best:.1e}"
    );
    let remedy = match is_on_eigenvalue {
        true => ON_EIGENVALUE,
        false => "give a shift nearer to them, or ask for fewer",
    };
    Err(refuse(what, remedy))
}

/// A row of A - σM.
fn less(a: &[(usize, f64)], m: &[(usize, f64)], shift: f64) -> Vec<(usize, f64)> {
    let scaled = m.iter().map(|(j, m)| (*j, -shift * m));
    let mut all: Vec<(usize, f64)> = a.iter().copied().chain(scaled).collect();
    all.sort_by_key(|entry| entry.0);
    all.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        if is_same {
            kept.1 += next.1;
        }
        is_same
    });
    all
}

/// A vector without a pattern, the same on every machine: SplitMix64.
fn noise(n: usize, number: usize) -> Vec<f64> {
    let each = (0..n as u64).map(|k| {
        let mut z = (k + (number as u64 + 1) * n as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    });
    each.collect()
}

/// A Krylov space: vectors that M makes orthonormal, and the operator's values of them.
struct Space<'a> {
    m: &'a Rows,
    basis: Vec<Vec<f64>>,
    /// M times the vectors of the basis.
    weighted: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
}

impl<'a> Space<'a> {
    fn new(factor: &General, m: &'a Rows, mut front: Vec<Vec<f64>>, n: usize) -> Result<Self> {
        let mut space = Space {
            m,
            basis: Vec::new(),
            weighted: Vec::new(),
            images: Vec::new(),
        };
        for _ in 0..POWERS {
            let before = space.basis.len();
            for x in front {
                if space.basis.len() < n {
                    space.add(x);
                }
            }
            for k in before..space.basis.len() {
                space.images.push(factor.solve(&space.weighted[k])?);
            }
            front = space.images[before..].to_vec();
        }
        Ok(space)
    }

    /// Adds what is left of a vector once the others are taken away, twice, so that rounding is.
    fn add(&mut self, mut x: Vec<f64>) {
        for _ in 0..2 {
            let before = dot(&x, &product(self.m, &x));
            for (v, mv) in self.basis.iter().zip(&self.weighted) {
                let part = dot(&x, mv);
                x.iter_mut().zip(v).for_each(|(x, v)| *x -= part * v);
            }
            let mx = product(self.m, &x);
            let after = dot(&x, &mx);
            // Negated so that NaN is left out.
            if !(after > DEPENDENT * DEPENDENT * before) {
                return;
            }
            let scale = 1.0 / after.sqrt();
            x.iter_mut().for_each(|x| *x *= scale);
        }
        self.weighted.push(product(self.m, &x));
        self.basis.push(x);
    }

    /// The vectors of the space whose eigenvalues are nearest to the shift, the nearest first: their images, in which the operator has made little of
    /// the rounding that A would make much of.
    fn ritz(&self, count: usize) -> Result<Vec<Vec<f64>>> {
        let size = self.images.len();
        let entry = |i: usize, j: usize| dot(&self.weighted[i], &self.images[j]);
        let small = Mat::from_fn(size, size, |i, j| 0.5 * (entry(i, j) + entry(j, i)));
        let found = small.self_adjoint_eigen(Side::Lower).map_err(|error| {
            let what = format!("an eigenproblem of {size} unknowns has no solution: {error:?}");
            let remedy = "check that a and m are finite".to_owned();
            Error::Solver { what, remedy }
        })?;
        let (values, vectors) = (found.S(), found.U());
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|i, j| values[*j].abs().total_cmp(&values[*i].abs()));
        let each = order.into_iter().take(count).map(|k| {
            let mut x = vec![0.0; self.m.len()];
            for (i, w) in self.images.iter().enumerate() {
                let part = vectors[(i, k)];
                x.iter_mut().zip(w).for_each(|(x, w)| *x += part * w);
            }
            let scale = 1.0 / dot(&x, &product(self.m, &x)).sqrt();
            x.iter_mut().for_each(|x| *x *= scale);
            x
        });
        Ok(each.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second differences on two lines of n points: every eigenvalue twice, 2 - 2 cos(kπ/(n + 1)).
    fn twice(n: usize) -> Rows {
        let row = |i: usize| {
            let (line, k) = (i / n * n, i % n);
            let below = (k > 0).then(|| (line + k - 1, -1.0));
            let above = (k + 1 < n).then(|| (line + k + 1, -1.0));
            below.into_iter().chain([(i, 2.0)]).chain(above).collect()
        };
        (0..2 * n).map(row).collect()
    }

    fn unit(n: usize, value: f64) -> Rows {
        (0..n).map(|i| vec![(i, value)]).collect()
    }

    #[test]
    fn double_eigenvalues_come_twice_on_both_sides_of_a_shift() {
        let n = 60;
        let exact =
            |k: usize| 2.0 - 2.0 * (k as f64 * std::f64::consts::PI / (n as f64 + 1.0)).cos();
        let places: Vec<[f64; 3]> = (0..2 * n)
            .map(|i| [(i % n) as f64, (i / n) as f64, 0.0])
            .collect();
        let (a, m) = (twice(n), unit(2 * n, 0.5));
        for (shift, first) in [(0.0, 1), (exact(5) + exact(6), 4)] {
            let found = nearest(&a, &m, &places, shift, 8).unwrap();
            for (k, (value, x)) in found.iter().enumerate() {
                let truth = 2.0 * exact(first + k / 2);
                assert!((value / truth - 1.0).abs() < 1e-11, "{k}: {value} {truth}");
                assert!((dot(x, &product(&m, x)) - 1.0).abs() < 1e-12);
                for (_, y) in &found[..k] {
                    assert!(dot(x, &product(&m, y)).abs() < 1e-11);
                }
            }
        }
        // All of them, and more than there are.
        let all = nearest(&a, &m, &places, -1.0, 2 * n).unwrap();
        assert!((all[2 * n - 1].0 / (2.0 * exact(n)) - 1.0).abs() < 1e-12);
        assert!(nearest(&a, &m, &places, 0.0, 2 * n + 1).is_err());
        // 0 is an eigenvalue of this one, and an M of 0 has none.
        let zero: Rows = (0..4)
            .map(|i| vec![(i, if i < 3 { 1.0 } else { 0.0 })])
            .collect();
        let error = nearest(&zero, &unit(4, 1.0), &[], 0.0, 2).unwrap_err();
        assert!(error.to_string().contains("give a shift"), "{error}");
        let error = nearest(&a, &unit(2 * n, 0.0), &places, 0.0, 2).unwrap_err();
        assert!(error.to_string().contains("rank 0"), "{error}");
    }
}
