//! Two domains laid over each other: every pair of cells with something in common, cut into simplices.

use super::clip::{Simplex, clip, measure, turn_left};
use super::domain::{APART, BLOCK, Domain, Piece};
use super::frame::Frame;
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
    /// The largest distance of two surfaces in space along the normals of the first; none in a plane or of solid cells.
    pub distance: Option<f64>,
}

/// Two cells' common part.
pub(super) struct Common<'a> {
    pub pieces: [&'a Piece; 2],
    pub simplices: &'a [Simplex],
    /// In which the places are given.
    pub frame: Frame,
    /// Only rounding of the coordinates may have made it: on one side of a face that both meshes have, it belongs to a cell
    /// on the other side.
    pub is_rounding: bool,
}

/// Pairs of cells with what they have in common, in the plane of either.
type Covered = Vec<([u32; 2], [f64; 2])>;

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
        distance: a.is_surface.then_some(0.0),
    };
    if a.is_surface != b.is_surface {
        return Err(Error::Compare {
            a: a.side.source.clone(),
            b: b.side.source.clone(),
            what: "one mesh is a surface in space, the other lies in a plane z = const".into(),
            remedy: "give two results on one domain".into(),
        });
    }
    let dim = a.dim;
    let block = |order: &[u32]| -> Result<(State, Covered, f64)> {
        let mut state = state();
        let mut covered = Vec::with_capacity(8 * order.len());
        let (mut simplices, mut scratch) = (Vec::new(), Vec::new());
        let (mut others, mut distance) = (Vec::new(), 0.0_f64);
        for &k in order {
            cancel::check()?;
            let piece = &a.pieces[k as usize];
            let frame = a.frame(piece);
            let of_a = a.simplex(piece, &frame);
            let size = measure(dim, &of_a);
            others.clear();
            b.tree.query(&a.reach(piece), |other| {
                others.push((&b.pieces[other as usize], 0.0))
            });
            if a.is_surface {
                distance = distance.max(keep_one_sheet([a, b], piece, &mut others));
            }
            for (other, in_other) in &others {
                let mut of_b = b.simplex(other, &frame);
                turn_left(dim, &mut of_b);
                let common = clip(dim, &of_a, &of_b, &mut simplices, &mut scratch);
                let in_other = if a.is_surface { *in_other } else { common };
                if common > 0.0 || in_other > 0.0 {
                    covered.push(([piece.cell, other.cell], [common, in_other]));
                }
                if common > 0.0 {
                    let thin = a.near.max(b.near) * a.span(piece).min(b.span(other));
                    let smaller = size.min(measure(dim, &of_b));
                    visit(
                        &mut state,
                        &Common {
                            pieces: [piece, other],
                            simplices: &simplices,
                            frame,
                            is_rounding: common <= thin.min(1e-3 * smaller),
                        },
                    );
                }
            }
        }
        Ok((state, covered, distance))
    };
    let batch = BLOCK * 4 * rayon::current_num_threads();
    for (k, batched) in a.tree.order.chunks(batch).enumerate() {
        let blocks = parallel::map(batched.chunks(BLOCK), block);
        let blocks: Vec<_> = blocks.into_iter().collect::<Result<_>>()?;
        for (state, covered, distance) in blocks {
            merge(state);
            cover.distance = cover.distance.map(|of| of.max(distance));
            for ([i, j], common) in covered {
                cover.common += common[0];
                cover.of_cells[0][i as usize] += common[0];
                cover.of_cells[1][j as usize] += common[1];
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
        let shown = if side.is_surface { 3 } else { dim };
        format!("from {:?} to {:?}", &low[..shown], &high[..shown])
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

/// What a piece of a surface and the projection of another on its plane have in common, and how far the other is from it there.
fn projected([a, b]: [&Domain; 2], piece: &Piece, other: &Piece) -> (f64, f64) {
    let frame = a.frame(piece);
    let mut of_b = b.simplex(other, &frame);
    turn_left(a.dim, &mut of_b);
    let mut cut = Vec::new();
    let of_a = a.simplex(piece, &frame);
    let common = clip(a.dim, &of_a, &of_b, &mut cut, &mut Vec::new());
    (common, b.rise(other, &frame, &cut))
}

/// Keeps those pieces of another surface that are the same part of the surface as this one, each with what the two have in common in its plane, and
/// returns the largest distance: pieces whose planes
/// are within 60° of each other and no further apart than [`APART`]. Where two sheets of the other are as near as that, as at
/// the trailing edge of a wing, they turn about opposite normals, and the nearer one is kept.
fn keep_one_sheet([a, b]: [&Domain; 2], piece: &Piece, others: &mut Vec<(&Piece, f64)>) -> f64 {
    let frame = a.frame(piece);
    let size = a.piece_measure(piece);
    // Area, and distance times area, of those that turn the same way and of those that turn the other.
    let mut sheets = [[0.0; 2]; 2];
    let mut found = Vec::with_capacity(others.len());
    for (other, _) in others.drain(..) {
        let cosine = frame.cosine(&b.frame(other));
        let (common, rise) = projected([a, b], piece, other);
        let (in_other, rise_in_other) = projected([b, a], other, piece);
        let rise = rise.max(rise_in_other);
        let apart = APART * a.length(piece).max(b.length(other));
        if cosine.abs() >= 0.5 && common.max(in_other) > 0.0 && rise <= apart {
            let sheet = usize::from(cosine < 0.0);
            sheets[sheet][0] += common;
            sheets[sheet][1] += common * rise;
            found.push((
                sheet,
                (other, in_other),
                if common > 0.0 { rise } else { 0.0 },
            ));
        }
    }
    let [same, opposite] = sheets;
    if same[0].min(opposite[0]) > 0.0 && same[0] + opposite[0] > (1.0 + 1e-6) * size {
        let nearer = usize::from(opposite[1] * same[0] < same[1] * opposite[0]);
        found.retain(|(sheet, ..)| *sheet == nearer);
    }
    others.extend(found.iter().map(|(_, other, _)| *other));
    found.iter().fold(0.0, |most, (.., rise)| rise.max(most))
}

/// The part of the cells of a domain that the other mesh does not cover, or of a surface in space covers more than once.
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
            // Cells in a plane that overlap were refused. Of a surface, the other may have two sheets here; a little is covered twice where they meet
            // in an edge.
            let alone = match side.is_surface && *covered > 1.25 * whole {
                true => covered - whole,
                false => whole - covered,
            };
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
