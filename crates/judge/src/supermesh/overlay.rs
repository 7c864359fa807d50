//! Two domains laid over each other: every pair of cells with something in common, cut into simplices.

use super::clip::{Simplex, clip, measure};
use super::domain::{BLOCK, Domain, Piece};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// What is reported about the intersection of the meshes.
#[derive(Debug, Default)]
pub(super) struct Cover {
    /// Area or volume of the intersection.
    pub common: f64,
    /// That of each cell, by its number in the file, that the other mesh covers.
    pub of_cells: [Vec<f64>; 2],
}

/// Two cells' common part.
pub(super) struct Common<'a> {
    pub pieces: [&'a Piece; 2],
    pub simplices: &'a [Simplex],
    /// From where the places are given.
    pub origin: [f64; 3],
    /// Only rounding of the coordinates may have made it: on one side of a face that both meshes have, it belongs to a cell
    /// on the other side.
    pub is_rounding: bool,
}

/// Pairs of cells with what they have in common.
type Covered = Vec<([u32; 2], f64)>;

/// Visits all pairs on all cores. Each block of cells has a `State` of its own; they are merged in the order of the blocks, so
/// that sums do not depend on the number of threads.
///
/// # Errors
/// Those of `visit`, and [`Error::Ended`].
pub(super) fn overlay<State: Send>(
    [a, b]: [&Domain; 2],
    state: impl Fn() -> State + Sync,
    visit: impl Fn(&mut State, &Common) + Sync,
    mut merge: impl FnMut(State),
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Cover> {
    let count = |side: &Domain| vec![0.0; side.side.cell_count()];
    let mut cover = Cover {
        common: 0.0,
        of_cells: [count(a), count(b)],
    };
    let dim = a.dim;
    let block = |order: &[u32]| -> Result<(State, Covered)> {
        let mut state = state();
        let mut covered = Vec::with_capacity(8 * order.len());
        let (mut simplices, mut scratch) = (Vec::new(), Vec::new());
        for &k in order {
            cancel::check()?;
            let piece = &a.pieces[k as usize];
            let origin = a.origin(piece);
            let of_a = a.simplex(piece, &origin);
            let size = measure(dim, &of_a);
            b.tree.query(&a.bounds(piece), |other| {
                let other = &b.pieces[other as usize];
                let of_b = b.simplex(other, &origin);
                let common = clip(dim, &of_a, &of_b, &mut simplices, &mut scratch);
                if common > 0.0 {
                    covered.push(([piece.cell, other.cell], common));
                    let thin = a.near.max(b.near) * a.span(piece).min(b.span(other));
                    let smaller = size.min(measure(dim, &of_b));
                    let is_rounding = common <= thin.min(1e-3 * smaller);
                    let pieces = [piece, other];
                    let simplices = &simplices;
                    visit(
                        &mut state,
                        &Common {
                            pieces,
                            simplices,
                            origin,
                            is_rounding,
                        },
                    );
                }
            });
        }
        Ok((state, covered))
    };
    let batch = BLOCK * 4 * rayon::current_num_threads();
    for (k, batched) in a.tree.order.chunks(batch).enumerate() {
        let blocks = parallel::map(batched.chunks(BLOCK), block);
        let blocks: Vec<_> = blocks.into_iter().collect::<Result<_>>()?;
        for (state, covered) in blocks {
            merge(state);
            for ([i, j], common) in covered {
                cover.common += common;
                cover.of_cells[0][i as usize] += common;
                cover.of_cells[1][j as usize] += common;
            }
        }
        progress(((k + 1) * batch).min(a.tree.order.len()) as f64 / a.tree.order.len() as f64);
    }
    if cover.common > 0.0 {
        return Ok(cover);
    }
    let extent = |side: &Domain| {
        let pieces = side.pieces.iter().map(|piece| side.bounds(piece));
        let all = pieces.reduce(|all, of| {
            let pick = |k: usize, f: fn(f64, f64) -> f64| [0, 1, 2].map(|i| f(all[k][i], of[k][i]));
            [pick(0, f64::min), pick(1, f64::max)]
        });
        let [low, high] = all.unwrap_or_default();
        format!("from {:?} to {:?}", &low[..dim], &high[..dim])
    };
    Err(Error::Compare {
        a: a.side.source.clone(),
        b: b.side.source.clone(),
        what: format!(
            "their meshes have nothing in common: one lies {}, the other {}",
            extent(a),
            extent(b)
        ),
        remedy: "give two results on one domain".into(),
    })
}

/// The part of the cells of a domain that the other mesh does not cover.
#[derive(Debug, Clone, Default)]
pub(super) struct Uncovered {
    pub measure: f64,
    /// Cells of which more than rounding of the coordinates is not covered.
    pub cells: usize,
    /// That with the largest part.
    pub worst: Option<u32>,
}

impl Uncovered {
    pub fn new(side: &Domain, covered: &[f64]) -> Self {
        let mut whole = vec![0.0; covered.len()];
        let mut allowed = vec![0.0; covered.len()];
        for piece in &side.pieces {
            let cell = piece.cell as usize;
            whole[cell] += side.piece_measure(piece);
            // All around a simplex.
            allowed[cell] += 2.0 * (side.dim + 1) as f64 * side.near * side.span(piece);
        }
        let mut found = Uncovered::default();
        let mut largest = 0.0;
        for (cell, (whole, covered)) in (0..).zip(whole.iter().zip(covered)) {
            let alone = whole - covered;
            found.measure += alone;
            // In a cell as small as the rounding, a part is still a part.
            if alone > allowed[cell as usize].min(1e-2 * whole) {
                found.cells += 1;
                if alone > largest {
                    (largest, found.worst) = (alone, Some(cell));
                }
            }
        }
        found
    }
}
