//! Preconditioned iterations: conjugate gradients (Hestenes and Stiefel 1952), and GMRES with right
//! preconditioning and restarts (Saad and Schultz 1986).
//!
//! `apply(x, y)` is y = A x, `precondition(r, z)` is z ≈ A⁻¹ r, for GMRES with A z where that is wanted; each call overwrites
//! all but its first argument. The vectors' sums are taken in a fixed order, so that results do not depend on the number of cores.

use rayon::prelude::*;

/// When an iteration ends.
#[derive(Debug, Clone, Copy)]
pub struct KrylovStop {
    /// Euclidean norm of the residual.
    pub residual: f64,
    /// The most that are taken.
    pub steps: usize,
}

/// Steps between restarts of GMRES: as many vectors are held.
const RESTART: usize = 20;

/// What an iteration ended with.
#[derive(Debug, Clone, Copy)]
pub struct Ended {
    /// Those that were taken.
    pub steps: usize,
    /// Is the residual, computed anew, below the limit?
    pub reached: bool,
    /// Its norm.
    pub residual: f64,
}

impl Ended {
    fn new(steps: usize, residual: f64, stop: KrylovStop) -> Self {
        Ended {
            steps,
            reached: residual <= stop.residual,
            residual,
        }
    }
}

/// Solves A x = b for a symmetric positive definite A, from the x given.
pub fn conjugate_gradients(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64]),
    b: &[f64],
    x: &mut [f64],
    stop: KrylovStop,
) -> Ended {
    let n = b.len();
    let (mut q, mut z) = (vec![0.0; n], vec![0.0; n]);
    apply(x, &mut q);
    let mut r = b.to_vec();
    add(&mut r, &q, -1.0);
    precondition(&r, &mut z);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    for steps in 0..stop.steps {
        let ended = Ended::new(steps, norm(&r), stop);
        if ended.reached {
            return ended;
        }
        apply(&p, &mut q);
        let alpha = rz / dot(&p, &q);
        if !alpha.is_finite() {
            return ended;
        }
        add(x, &p, alpha);
        add(&mut r, &q, -alpha);
        precondition(&r, &mut z);
        let next = dot(&r, &z);
        let beta = next / rz;
        rz = next;
        p.par_iter_mut()
            .zip(&z)
            .with_min_len(CHUNK)
            .for_each(|(p, z)| *p = z + beta * *p);
    }
    Ended::new(stop.steps, norm(&r), stop)
}

/// Solves A x = b from the x given; `basis` keeps the vectors for the next solve with as many unknowns.
pub fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64], Option<&mut [f64]>),
    b: &[f64],
    x: &mut [f64],
    stop: KrylovStop,
    basis: &mut Vec<Vec<f64>>,
) -> Ended {
    let n = b.len();
    if basis.is_empty() {
        basis.push(vec![0.0; n]);
    }
    let mut direction = vec![0.0; n];
    let mut done = 0;
    let mut before = f64::INFINITY;
    loop {
        // The residual anew, so that what is believed at the end was not only predicted.
        apply(x, &mut direction);
        basis[0].copy_from_slice(b);
        add(&mut basis[0], &direction, -1.0);
        let size = norm(&basis[0]);
        // Rounding sets a floor: a restart that does not gain will not.
        if size <= stop.residual || done >= stop.steps || !(size < 0.5 * before) {
            return Ended::new(done, size, stop);
        }
        before = size;
        scale(&mut basis[0], 1.0 / size);
        let mut triangle = Triangle::new(size);
        while triangle.len() < RESTART && done < stop.steps && triangle.residual() > stop.residual {
            let k = triangle.len();
            if basis.len() < k + 2 {
                basis.push(vec![0.0; n]);
            }
            let (old, new) = basis.split_at_mut(k + 1);
            let next = &mut new[0];
            precondition(&old[k], &mut direction, Some(next));
            // Classical Gram and Schmidt, which reads each vector twice; the residual is computed anew at the end.
            let mut column = dots(old, next);
            let length = subtract(next, old, &column);
            column.push(length);
            done += 1;
            if !triangle.push(column) {
                break;
            }
            if length > 0.0 {
                scale(next, 1.0 / length);
            }
        }
        // x += M⁻¹ V y
        let y = triangle.solve();
        let mut sum = vec![0.0; n];
        let minus: Vec<f64> = y.iter().map(|y| -y).collect();
        subtract(&mut sum, &basis[..y.len()], &minus);
        precondition(&sum, &mut direction, None);
        add(x, &direction, 1.0);
    }
}

/// The Hessenberg matrix, made triangular by rotations, and the right-hand side that they turn.
struct Triangle {
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
    rhs: Vec<f64>,
}

impl Triangle {
    fn new(size: f64) -> Self {
        Triangle {
            columns: Vec::new(),
            rotations: Vec::new(),
            rhs: vec![size],
        }
    }

    fn len(&self) -> usize {
        self.columns.len()
    }

    fn residual(&self) -> f64 {
        self.rhs[self.len()].abs()
    }

    /// Takes a column of the Hessenberg matrix; false, and nothing taken, if it is singular.
    fn push(&mut self, mut column: Vec<f64>) -> bool {
        let k = self.len();
        for (i, &(c, s)) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let diagonal = column[k].hypot(column[k + 1]);
        if !(diagonal > 0.0) {
            return false;
        }
        let (c, s) = (column[k] / diagonal, column[k + 1] / diagonal);
        column[k] = diagonal;
        column.truncate(k + 1);
        self.columns.push(column);
        self.rotations.push((c, s));
        let last = self.rhs[k];
        self.rhs[k] = c * last;
        self.rhs.push(-s * last);
        true
    }

    fn solve(&self) -> Vec<f64> {
        let mut y = self.rhs[..self.len()].to_vec();
        for i in (0..y.len()).rev() {
            y[i] /= self.columns[i][i];
            for j in 0..i {
                y[j] -= self.columns[i][j] * y[i];
            }
        }
        y
    }
}

/// Entries that one task takes.
const CHUNK: usize = 1 << 14;

/// Sums by chunks of fixed length, then over the chunks.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| dot_of_chunks(a, b))
        .collect();
    parts.iter().sum()
}

/// The products of vectors with one, of which each chunk stays near while they pass.
fn dots(vectors: &[Vec<f64>], with: &[f64]) -> Vec<f64> {
    let parts: Vec<Vec<f64>> = with
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(k, with)| {
            let chunk = k * CHUNK..k * CHUNK + with.len();
            let vectors = vectors.iter();
            vectors
                .map(|v| dot_of_chunks(&v[chunk.clone()], with))
                .collect()
        })
        .collect();
    (0..vectors.len())
        .map(|j| parts.iter().map(|part| part[j]).sum())
        .collect()
}

/// a -= Σ_j h_j v_j, and the norm of what it becomes.
fn subtract(a: &mut [f64], vectors: &[Vec<f64>], h: &[f64]) -> f64 {
    let parts: Vec<f64> = a
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(k, a)| {
            for (vector, h) in vectors.iter().zip(h) {
                for (a, v) in a.iter_mut().zip(&vector[k * CHUNK..]) {
                    *a -= h * v;
                }
            }
            dot_of_chunks(a, a)
        })
        .collect();
    parts.iter().sum::<f64>().sqrt()
}

/// Eight sums side by side, as wide as the registers.
fn dot_of_chunks(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_rows, b_rows) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a_rows.remainder().iter().zip(b_rows.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a_rows.zip(b_rows) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// The Euclidean norm.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scale(a: &mut [f64], factor: f64) {
    a.par_chunks_mut(CHUNK)
        .for_each(|a| a.iter_mut().for_each(|a| *a *= factor));
}

fn add(a: &mut [f64], b: &[f64], factor: f64) {
    a.par_chunks_mut(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .for_each(|(a, b)| {
            for (a, b) in a.iter_mut().zip(b) {
                *a += factor * b;
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 40;

    fn nonsymmetric(x: &[f64], y: &mut [f64]) {
        for i in 0..N {
            let left = if i > 0 { x[i - 1] } else { 0.0 };
            let right = if i + 1 < N { x[i + 1] } else { 0.0 };
            y[i] = (3.0 + i as f64) * x[i] - 2.0 * left + 0.5 * right;
        }
    }

    fn symmetric(x: &[f64], y: &mut [f64]) {
        for i in 0..N {
            let left = if i > 0 { x[i - 1] } else { 0.0 };
            let right = if i + 1 < N { x[i + 1] } else { 0.0 };
            y[i] = (3.0 + i as f64) * x[i] - left - right;
        }
    }

    /// By the diagonal, for the matrix of `apply`.
    fn by_diagonal(
        apply: fn(&[f64], &mut [f64]),
    ) -> impl Fn(&[f64], &mut [f64], Option<&mut [f64]>) {
        with(apply, |i, r| r / (3.0 + i as f64))
    }

    fn divided(r: &[f64], z: &mut [f64]) {
        by_diagonal(symmetric)(r, z, None);
    }

    fn with(
        apply: fn(&[f64], &mut [f64]),
        inverse: fn(usize, f64) -> f64,
    ) -> impl Fn(&[f64], &mut [f64], Option<&mut [f64]>) {
        move |r, z, product| {
            for i in 0..N {
                z[i] = inverse(i, r[i]);
            }
            if let Some(product) = product {
                apply(z, product);
            }
        }
    }

    fn known() -> Vec<f64> {
        (0..N).map(|k| (k as f64).cos()).collect()
    }

    fn assert_close(a: &[f64], b: &[f64]) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
    }

    const FINE: KrylovStop = KrylovStop {
        residual: 1e-12,
        steps: 200,
    };

    fn gmres_of(
        apply: fn(&[f64], &mut [f64]),
        precondition: impl Fn(&[f64], &mut [f64], Option<&mut [f64]>),
        b: &[f64],
        x: &mut [f64],
        stop: KrylovStop,
    ) -> Ended {
        gmres(apply, precondition, b, x, stop, &mut Vec::new())
    }

    #[test]
    fn gmres_solves_a_nonsymmetric_system_and_says_when_it_cannot() {
        let mut b = vec![0.0; N];
        nonsymmetric(&known(), &mut b);
        let mut x = vec![0.0; N];
        assert!(gmres_of(nonsymmetric, by_diagonal(nonsymmetric), &b, &mut x, FINE).reached);
        assert_close(&x, &known());
        // Without a preconditioner it needs more steps than there are between restarts.
        let mut x = vec![1.0; N];
        let copy = || with(nonsymmetric, |_, r| r);
        let ended = gmres_of(nonsymmetric, copy(), &b, &mut x, FINE);
        assert!(ended.reached && ended.steps > RESTART, "{ended:?}");
        assert_close(&x, &known());
        let few = KrylovStop { steps: 3, ..FINE };
        assert!(!gmres_of(nonsymmetric, copy(), &b, &mut vec![0.0; N], few).reached);
        let singular = |_: &[f64], y: &mut [f64]| y.fill(0.0);
        assert!(
            !gmres_of(
                singular,
                with(singular, |_, r| r),
                &b,
                &mut vec![0.0; N],
                FINE
            )
            .reached
        );
    }

    #[test]
    fn conjugate_gradients_solve_a_symmetric_system() {
        let mut b = vec![0.0; N];
        symmetric(&known(), &mut b);
        let mut x = vec![0.0; N];
        assert!(conjugate_gradients(symmetric, divided, &b, &mut x, FINE).reached);
        assert_close(&x, &known());
        let singular = |_: &[f64], y: &mut [f64]| y.fill(0.0);
        let mut x = vec![0.0; N];
        assert!(!conjugate_gradients(singular, divided, &b, &mut x, FINE).reached);
        assert!(x.iter().all(|x| x.is_finite()));
    }

    #[test]
    fn nothing_to_do_takes_no_step() {
        let mut x = vec![0.0; N];
        assert_eq!(
            gmres_of(symmetric, by_diagonal(symmetric), &[0.0; N], &mut x, FINE).steps,
            0
        );
        let ended = conjugate_gradients(symmetric, divided, &[0.0; N], &mut x, FINE);
        assert_eq!(ended.steps, 0);
    }
}
