//! GMRES with right preconditioning (Saad and Schultz 1986), without restarts.

/// Solves A x = b; `apply` is A, `precondition` an approximation of A⁻¹. None if the relative
/// residual is not below `tolerance` after `steps`.
pub fn gmres(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    b: &[f64],
    tolerance: f64,
    steps: usize,
) -> Option<Vec<f64>> {
    let size = norm(b);
    if size == 0.0 {
        return Some(vec![0.0; b.len()]);
    }
    let mut basis = vec![scaled(b, 1.0 / size)];
    let mut directions: Vec<Vec<f64>> = Vec::new();
    // Columns of the triangular factor of the Hessenberg matrix, its rotations, and the
    // right-hand side that they turn.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut rhs = vec![size];
    for k in 0..steps {
        let direction = precondition(&basis[k]);
        let mut next = apply(&direction);
        directions.push(direction);
        let mut column = Vec::with_capacity(k + 2);
        for vector in &basis {
            let h = dot(vector, &next);
            add(&mut next, vector, -h);
            column.push(h);
        }
        let length = norm(&next);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let diagonal = column[k].hypot(length);
        if !(diagonal > 0.0) {
            return None;
        }
        let (c, s) = (column[k] / diagonal, length / diagonal);
        column[k] = diagonal;
        rotations.push((c, s));
        columns.push(column);
        let last = rhs[k];
        rhs[k] = c * last;
        rhs.push(-s * last);
        if rhs[k + 1].abs() <= tolerance * size {
            return Some(combine(&directions, &columns, &rhs));
        }
        basis.push(scaled(&next, 1.0 / length));
    }
    None
}

/// Back substitution in the triangular factor, then the sum of the directions.
fn combine(directions: &[Vec<f64>], columns: &[Vec<f64>], rhs: &[f64]) -> Vec<f64> {
    let count = columns.len();
    let mut y = rhs[..count].to_vec();
    for i in (0..count).rev() {
        y[i] /= columns[i][i];
        for j in 0..i {
            y[j] -= columns[i][j] * y[i];
        }
    }
    let mut x = vec![0.0; directions[0].len()];
    for (direction, y) in directions.iter().zip(&y) {
        add(&mut x, direction, *y);
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: &[f64], factor: f64) -> Vec<f64> {
    a.iter().map(|a| factor * a).collect()
}

fn add(a: &mut [f64], b: &[f64], factor: f64) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_solves_a_nonsymmetric_system_and_says_when_it_cannot() {
        let n = 40;
        let apply = |x: &[f64]| -> Vec<f64> {
            (0..n)
                .map(|i| {
                    let left = if i > 0 { x[i - 1] } else { 0.0 };
                    let right = if i + 1 < n { x[i + 1] } else { 0.0 };
                    (3.0 + i as f64) * x[i] - 2.0 * left + 0.5 * right
                })
                .collect()
        };
        let x: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
        let b = apply(&x);
        let diagonal = |v: &[f64]| -> Vec<f64> {
            v.iter()
                .enumerate()
                .map(|(i, v)| v / (3.0 + i as f64))
                .collect()
        };
        let found = gmres(apply, diagonal, &b, 1e-13, n).unwrap();
        for (a, b) in x.iter().zip(&found) {
            assert!((a - b).abs() < 1e-11);
        }
        assert!(gmres(apply, <[f64]>::to_vec, &b, 1e-13, 3).is_none());
        assert!(gmres(|x| vec![0.0; x.len()], diagonal, &b, 1e-13, 9).is_none());
    }
}
