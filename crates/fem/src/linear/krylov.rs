//! Preconditioned iterations: conjugate gradients (Hestenes and Stiefel 1952), and GMRES with right
//! preconditioning and restarts (Saad and Schultz 1986).
//!
//! `apply(x, y)` is y = A x, `precondition(r, z)` is z ≈ A⁻¹ r, for GMRES with A z where that is wanted; each call overwrites
//! all but its first argument. The vectors' sums are taken in a fixed order, so that results do not depend on the number of cores.

use faceoff_mesh::cancel;
use faceoff_mesh::parallel;

use super::kernels::Number;
use super::pool::clear;

/// When an iteration ends.
#[derive(Debug, Clone, Copy)]
pub struct KrylovStop {
    /// Euclidean norm of the residual.
    pub residual: f64,
    /// The most that are taken.
    pub steps: usize,
}

/// Steps between restarts of GMRES, which is the number of stored vectors.
const RESTART: usize = 20;
/// The reduction of a residual before a restart: above what rounding to f32 leaves.
const GAIN: f64 = 1e-6;

/// How an iteration ended.
#[derive(Debug, Clone, Copy)]
pub struct Ended {
    /// Those that were taken.
    pub steps: usize,
    /// Whether the recomputed residual is below the limit.
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

/// Solves A x = b for a symmetric positive definite A, from the x given; ends unreached where the run has to end.
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
    let mut r = vec![0.0; n];
    difference(b, &q, &mut r);
    precondition(&r, &mut z);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    for steps in 0..stop.steps {
        let ended = Ended::new(steps, norm(&r), stop);
        if ended.reached || cancel::cause().is_some() {
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
        parallel::map(p.chunks_mut(CHUNK).zip(z.chunks(CHUNK)), |(p, z)| {
            p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p);
        });
    }
    Ended::new(stop.steps, norm(&r), stop)
}

/// Vectors of GMRES, for one solve after the other with as many unknowns.
#[derive(Default)]
pub struct Room {
    basis: Vec<Vec<f32>>,
    vectors: [Vec<f64>; 3],
}

/// Solves A x = b from the x given; `room` keeps the vectors for the next solve with as many unknowns, in f32 as the
/// preconditioner is (J. I. Aliaga et al., Concurrency Computat. Pract. Exper. 34, 2022): the residual is computed anew after at most
/// `GAIN`.
pub fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64], Option<&mut [f64]>),
    b: &[f64],
    x: &mut [f64],
    stop: KrylovStop,
    room: &mut Room,
) -> Ended {
    let n = b.len();
    let _span = tracing::debug_span!("basis").entered();
    let Room { basis, vectors } = room;
    vectors.iter_mut().for_each(|v| v.resize(n, 0.0));
    let [last, next, direction] = vectors;
    let mut done = 0;
    let mut before = f64::INFINITY;
    loop {
        // The residual anew, so that what is believed at the end was not only predicted.
        match done > 0 || norm(x) != 0.0 {
            true => apply(x, direction),
            false => clear(direction),
        }
        difference(b, direction, last);
        let size = norm(last);
        // Rounding sets a floor: a restart that does not gain will not.
        let is_over = done >= stop.steps || cancel::cause().is_some();
        if size <= stop.residual || is_over || !(size < 0.5 * before) {
            return Ended::new(done, size, stop);
        }
        before = size;
        let enough = stop.residual.max(GAIN * size);
        let mut triangle = Triangle::new(size);
        let mut length = size;
        while triangle.len() < RESTART && done < stop.steps && triangle.residual() > enough {
            if cancel::cause().is_some() {
                break;
            }
            let k = triangle.len();
            if basis.len() == k {
                basis.push(vec![0.0; n]);
            }
            scale(last, 1.0 / length, &mut basis[k]);
            precondition(last, direction, Some(next));
            // Classical Gram and Schmidt, which reads each vector twice; the residual is computed anew at the end.
            let (bytes, flops) = (n * (8 * (k + 1) + 40), 4 * n * (k + 1));
            let _span = tracing::debug_span!("basis", bytes, flops).entered();
            let old = &basis[..=k];
            let mut column = dots(old, next);
            length = subtract(next, old, &column);
            column.push(length);
            done += 1;
            if !triangle.push(column) || length == 0.0 {
                break;
            }
            std::mem::swap(last, next);
        }
        // x += M⁻¹ V y
        let minus: Vec<f64> = triangle.solve().iter().map(|y| -y).collect();
        clear(last);
        subtract(last, &basis[..minus.len()], &minus);
        precondition(last, direction, None);
        add(x, direction, 1.0);
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
    let chunks = a.chunks(CHUNK).zip(b.chunks(CHUNK));
    let parts = parallel::map(chunks, |(a, b)| dot_of_chunks(a, b));
    parts.iter().sum()
}

/// Entries of a vector that stay nearest while others pass.
const NEAR: usize = 2048;

/// The products of vectors with one.
fn dots(vectors: &[Vec<f32>], with: &[f64]) -> Vec<f64> {
    let parts = parallel::map(with.chunks(CHUNK).enumerate(), |(k, with)| {
        let mut sums = vec![0.0; vectors.len()];
        for (near, with) in with.chunks(NEAR).enumerate() {
            let first = k * CHUNK + near * NEAR;
            for (sum, vector) in sums.iter_mut().zip(vectors) {
                *sum += dot_of_chunks(&vector[first..first + with.len()], with);
            }
        }
        sums
    });
    (0..vectors.len())
        .map(|j| parts.iter().map(|part| part[j]).sum())
        .collect()
}

/// a -= Σ_j h_j v_j, and the norm of what it becomes.
fn subtract(a: &mut [f64], vectors: &[Vec<f32>], h: &[f64]) -> f64 {
    let parts = parallel::map(a.chunks_mut(CHUNK).enumerate(), |(k, a)| {
        let of_near = a.chunks_mut(NEAR).enumerate().map(|(near, a)| {
            for (vector, h) in vectors.iter().zip(h) {
                for (a, v) in a.iter_mut().zip(&vector[k * CHUNK + near * NEAR..]) {
                    *a -= h * f64::from(*v);
                }
            }
            dot_of_chunks(a, a)
        });
        of_near.sum::<f64>()
    });
    parts.iter().sum::<f64>().sqrt()
}

/// Eight sums side by side, as wide as the registers.
fn dot_of_chunks<T: Number>(a: &[T], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_rows, b_rows) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a_rows.remainder().iter().zip(b_rows.remainder());
    let rest: f64 = rest.map(|(a, b)| a.wide() * b).sum();
    for (a, b) in a_rows.zip(b_rows) {
        for k in 0..8 {
            sums[k] += a[k].wide() * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// The Euclidean norm.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// a *= factor, and the same rounded.
fn scale(a: &mut [f64], factor: f64, narrow: &mut [f32]) {
    let chunks = a.chunks_mut(CHUNK).zip(narrow.chunks_mut(CHUNK));
    parallel::map(chunks, |(a, narrow)| {
        for (a, narrow) in a.iter_mut().zip(narrow) {
            *a *= factor;
            *narrow = *a as f32;
        }
    });
}

/// c = a - b
fn difference(a: &[f64], b: &[f64], c: &mut [f64]) {
    let terms = a.chunks(CHUNK).zip(b.chunks(CHUNK));
    parallel::map(c.chunks_mut(CHUNK).zip(terms), |(c, (a, b))| {
        for ((c, a), b) in c.iter_mut().zip(a).zip(b) {
            *c = a - b;
        }
    });
}

/// a += factor b
pub fn add(a: &mut [f64], b: &[f64], factor: f64) {
    parallel::map(a.chunks_mut(CHUNK).zip(b.chunks(CHUNK)), |(a, b)| {
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
        gmres(apply, precondition, b, x, stop, &mut Room::default())
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

    /// The contents of the vectors before a solve do not matter.
    #[test]
    fn gmres_goes_on_in_the_same_room_and_from_where_it_is() {
        let mut b = vec![0.0; N];
        nonsymmetric(&known(), &mut b);
        let mut room = Room::default();
        for start in [0.0, 1.0, 0.0] {
            let mut x = vec![start; N];
            let copy = with(nonsymmetric, |_, r| r);
            let ended = gmres(nonsymmetric, copy, &b, &mut x, FINE, &mut room);
            assert!(ended.reached);
            assert_close(&x, &known());
        }
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
