//! Generated meshes.

use super::{CellBlock, CellKind, Group, Mesh};

/// The Union-Jack mesh of (0, Lx) × (0, Ly): n × n squares, each cut along the diagonal that
/// makes neighbouring squares mirror each other (section 6 of the paper: h = √2/n on the unit
/// square). Groups: bottom 1, right 2, top 3, left 4.
pub fn union_jack(n: usize, [lx, ly]: [f64; 2]) -> Mesh {
    let row = n + 1;
    let at = |k: usize, length: f64| length * (k as f64 / n as f64);
    let points = (0..row * row)
        .map(|v| [at(v % row, lx), at(v / row, ly), 0.0])
        .collect();
    let mut cells = Vec::with_capacity(6 * n * n);
    for j in 0..n {
        for i in 0..n {
            let a = (j * row + i) as u32;
            let (b, c) = (a + 1, a + row as u32);
            let d = c + 1;
            if (i + j) % 2 == 0 {
                cells.extend([a, b, d, a, d, c]);
            } else {
                cells.extend([a, b, c, b, d, c]);
            }
        }
    }
    let vertex = |i: usize, j: usize| (j * row + i) as u32;
    let mut lines = Vec::with_capacity(8 * n);
    for k in 0..n {
        lines.extend([vertex(k, 0), vertex(k + 1, 0)]);
    }
    for k in 0..n {
        lines.extend([vertex(n, k), vertex(n, k + 1)]);
    }
    for k in 0..n {
        lines.extend([vertex(n - k, n), vertex(n - k - 1, n)]);
    }
    for k in 0..n {
        lines.extend([vertex(0, n - k), vertex(0, n - k - 1)]);
    }
    let groups = ["bottom", "right", "top", "left"]
        .into_iter()
        .zip(0u32..)
        .map(|(name, side)| Group {
            dim: 1,
            tag: i64::from(side) + 1,
            name: Some(name.to_owned()),
            cells: (side * n as u32..(side + 1) * n as u32).collect(),
        })
        .collect();
    Mesh {
        points,
        blocks: vec![
            CellBlock::new(CellKind::Line, lines),
            CellBlock::new(CellKind::Triangle, cells),
        ],
        groups,
        ..Mesh::default()
    }
}
