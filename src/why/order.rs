//! Finds right values in another order: of the dofs of a cell, or of the cells.

use faceoff_fem::contact::Problem;

/// Two values are the same if they differ by less than this, relative to the largest.
const SAME: f64 = 1e-8;

/// Are the values of all cells right except for one common permutation? `raw` and `known` have all local dofs of all cells.
pub fn order(problem: &Problem, raw: &[f64], known: &[f64]) -> Option<String> {
    let space = &problem.space;
    let local = space.local_dofs;
    let same = same(known);
    if is_right(raw, known) {
        return None;
    }
    // Dofs on vertices and on edges are not interchanged.
    let vertices = space.mesh.dim + 1;
    let groups = [0..vertices.min(local), vertices.min(local)..local];
    let fits = |place: usize, from: usize| {
        let cells = raw.chunks(local).zip(known.chunks(local));
        cells
            .into_iter()
            .all(|(raw, known)| same(raw[place], known[from]))
    };
    let orders: Option<Vec<Vec<usize>>> = groups
        .into_iter()
        .map(|group| arrange(group.collect(), &fits))
        .collect();
    let order = orders?.concat();
    Some(format!(
        "the dofs of a cell are right but in a different order: positions 0, 1, … hold those of {order:?}"
    ))
}

/// Are the values right, but permuted in each cell, or among the cells?
pub fn elsewhere(problem: &Problem, raw: &[f64], known: &[f64]) -> Option<String> {
    let local = problem.space.local_dofs;
    let same = same(known);
    if is_right(raw, known) {
        return None;
    }
    let sorted = |values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted
    };
    let alike = |a: &[f64], b: &[f64]| {
        let (a, b) = (sorted(a), sorted(b));
        a.iter().zip(&b).all(|(a, b)| same(*a, *b))
    };
    if raw
        .chunks(local)
        .zip(known.chunks(local))
        .all(|(a, b)| alike(a, b))
    {
        return Some(
            "each cell has the right values, but in an order that differs from cell to cell: \
             dofs belong to the vertices in the order given, not in the code's own"
                .into(),
        );
    }
    alike(raw, known)
        .then(|| "the values are right, but belong to other cells: keep the given order".into())
}

/// Are two values the same?
fn same(known: &[f64]) -> impl Fn(f64, f64) -> bool {
    let largest = known.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    move |a, b| (a - b).abs() <= SAME * largest
}

/// Is each value in the right position?
fn is_right(raw: &[f64], known: &[f64]) -> bool {
    let same = same(known);
    raw.iter().zip(known).all(|(a, b)| same(*a, *b))
}

/// For each of `places`, a different one of them that it fits: `fits(place, from)`.
fn arrange(places: Vec<usize>, fits: &dyn Fn(usize, usize) -> bool) -> Option<Vec<usize>> {
    fn place(done: &mut Vec<usize>, places: &[usize], fits: &dyn Fn(usize, usize) -> bool) -> bool {
        let Some(next) = places.get(done.len()) else {
            return true;
        };
        for from in places {
            if !done.contains(from) && fits(*next, *from) {
                done.push(*from);
                if place(done, places, fits) {
                    return true;
                }
                done.pop();
            }
        }
        false
    }
    let mut done = Vec::with_capacity(places.len());
    place(&mut done, &places, fits).then_some(done)
}
