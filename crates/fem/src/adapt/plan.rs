//! What to refine next: how many cells a uniform and how many an adapted mesh would take.
//!
//! On cells of measure |κ| the square of the bound is Σ η_κ², η_κ² ≈ w |κ|^{1+2/d} with a density w of the solution's own
//! (first order in h = |κ|^{1/d}). In 2D a uniform mesh with the square T so needs |Ω| ∫w / T cells, and the
//! best one, on which all η_κ are equal, (∫√w)² / T, where ∫w = Σ η_κ²/|κ| and ∫√w = Σ η_κ. Their ratio
//!
//! ```text
//! S = |Ω| Σ η_κ²/|κ| / (Σ η_κ)² ≥ 1
//! ```
//!
//! is what adapting saves; at a singularity ∫w, and S with it, grows as the mesh resolves it.

/// Cells that carry the bound, from the certificate.
#[derive(Debug, Clone, Copy)]
pub struct Spread {
    /// Σ η_κ
    pub sum: f64,
    /// S
    pub saving: f64,
}

impl Spread {
    /// From η_κ² and |κ| of each cell.
    pub fn new(squares: &[f64], measures: &[f64]) -> Self {
        let whole: f64 = measures.iter().sum();
        let density: f64 = squares.iter().zip(measures).map(|(e, m)| e / m).sum();
        let sum: f64 = squares.iter().map(|e| e.sqrt()).sum();
        Spread {
            sum,
            saving: whole * density / (sum * sum),
        }
    }
}

/// How often each triangle is to be bisected so that the sum of the η_κ² becomes `target`, all equal. A bisection
/// leaves a quarter of η_κ² on each part. What is further away than `most` is seen better from nearer.
pub fn bisections(squares: &[f64], spread: Spread, target: f64, most: u8) -> Vec<u8> {
    // N = sum²/target cells with target/N each.
    let each = (target / spread.sum).powi(2);
    squares
        .iter()
        .map(|square| {
            let times = (0.5 * (square / each).log2()).round();
            if times > 0.0 {
                (times as u8).min(most)
            } else {
                0
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_cells_save_nothing() {
        let spread = Spread::new(&[2.0; 8], &[0.5; 8]);
        assert!((spread.saving - 1.0).abs() < 1e-15);
        // A quarter of the bound's square takes four times the cells: two bisections.
        assert_eq!(bisections(&[2.0; 8], spread, 4.0, 9), vec![2; 8]);
        assert_eq!(bisections(&[2.0; 8], spread, 16.0, 9), vec![0; 8]);
    }

    /// w = r^{-2/3} as at the corner of an L, on squares: S grows with the mesh.
    #[test]
    fn a_singularity_is_seen() {
        let saving = |n: usize| {
            let h = 1.0 / n as f64;
            let at = |k: usize| (k as f64 + 0.5) * h;
            let cells = (0..n * n).map(|k| at(k % n).hypot(at(k / n)));
            let squares: Vec<f64> = cells
                .map(|r| r.powf(-4.0 / 3.0 * 1.5) * h.powi(4))
                .collect();
            Spread::new(&squares, &vec![h * h; n * n]).saving
        };
        assert!(
            saving(64) > 1.3 * saving(16),
            "{} {}",
            saving(16),
            saving(64)
        );
    }
}
