//! Simplices cut into parts.

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
