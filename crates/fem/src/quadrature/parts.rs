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

/// Both parts of what is cut at this share of its edge ij: that at corner i, with the point of the cut instead of j, and that
/// at j.
pub fn cut(piece: &Piece, [i, j]: [usize; 2], at: f64) -> [Piece; 2] {
    let point = std::array::from_fn(|k| piece[i][k] + at * (piece[j][k] - piece[i][k]));
    let (mut at_i, mut at_j) = (*piece, *piece);
    (at_i[j], at_j[i]) = (point, point);
    [at_i, at_j]
}

/// The longest edge of a part: [i, j] with the largest `length` of x_i - x_j, a sum of 0 in barycentric coordinates.
pub fn longest_edge(piece: &Piece, dim: usize, length: impl Fn(&[f64; 4]) -> f64) -> [usize; 2] {
    let edges = (1..=dim).flat_map(|j| (0..j).map(move |i| [i, j]));
    let of = |[i, j]: [usize; 2]| length(&std::array::from_fn(|k| piece[i][k] - piece[j][k]));
    let longest = edges.fold(([0, 0], 0.0), |most, edge| {
        let length = of(edge);
        if length > most.1 || most.0 == [0, 0] {
            (edge, length)
        } else {
            most
        }
    });
    longest.0
}

/// 2^d parts of equal measure, each d times a half.
pub fn parts(piece: &Piece, dim: usize) -> Vec<Piece> {
    let length = |of: &[f64; 4]| of.iter().map(|x| x * x).sum();
    let halves = |piece: &Piece| cut(piece, longest_edge(piece, dim, length), 0.5);
    (0..dim).fold(vec![*piece], |all, _| all.iter().flat_map(halves).collect())
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
