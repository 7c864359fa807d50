//! Multifrontal LU factorisation of the Schur complement with what contact adds (I. Duff, J. Reid, SIAM J. Sci. Stat. Comput.
//! 5, 1984): the part of the elimination that is done again for each set of statuses.
//!
//! The factorised matrix is a sum of dense blocks and single entries. Each front eliminates a group of unknowns; where its pivots
//! would let the entries grow, they wait for the next front, as in Duff and Reid. On the last one all that is left is pivoted.

use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_unit_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, Mat, MatMut, MatRef};

use super::Entry;
use super::dense_lu::{SMALL, factor, subtract};
use super::kernels::{clear_registers, clear_registers_everywhere, threads_for};
use super::lu_plan::{Front, LuPlan};
use super::schur::Schur;
use faceoff_mesh::parallel;

/// Pivots wait if an update is larger than this times the entries of the front.
const LARGEST_GROWTH: f64 = 1e6;

/// A factorisation of S and more.
pub struct SchurLu {
    plan: Arc<LuPlan>,
    fronts: Vec<Eliminated>,
}

/// The factors of a front M = PᵀLU after its pivots p are eliminated from its border b.
#[derive(Default)]
struct Eliminated {
    /// Pivots that fronts below left to this one, which come first.
    late: Vec<u32>,
    /// None for a front that leaves all of its pivots.
    pivots: usize,
    /// The row that each was exchanged with.
    swaps: Vec<u32>,
    /// L_pp with U_pp on its diagonal and above, and below it L_bp; then U_pb: by columns.
    values: Vec<f64>,
}

/// The contribution of a front to the one above: delayed pivots, and a matrix on them and its border, by columns.
#[derive(Default)]
struct Update {
    waiting: Vec<u32>,
    matrix: Vec<f64>,
}

impl SchurLu {
    /// The memory of an `old` one is used again.
    pub(super) fn new(schur: &Schur, extra: &[Entry], old: Option<SchurLu>) -> Self {
        let plan = Arc::clone(&schur.plan);
        let (bytes, flops) = (8 * plan.entries, plan.flops as u64);
        let _span = tracing::debug_span!("contact factorisation", bytes, flops).entered();
        let (starts, entries) = plan.sorted(schur.rest.iter().chain(extra));
        let mut updates: Vec<Update> = plan.fronts.iter().map(|_| Update::default()).collect();
        let old = old.filter(|old| Arc::ptr_eq(&old.plan, &plan));
        let mut fronts = old.map_or(Vec::new(), |old| old.fronts);
        fronts.resize_with(plan.fronts.len(), Eliminated::default);
        for level in &plan.levels {
            let tasks = level.iter().map(|task| {
                let halves = plan.fronts[task.start].below.iter();
                let halves = halves.map(|&half| std::mem::take(&mut updates[half as usize]));
                let fronts = fronts[task.clone()].iter_mut().map(std::mem::take);
                let fronts: Vec<Eliminated> = fronts.collect();
                (task.clone().zip(fronts), halves.collect::<Vec<Update>>())
            });
            let tasks: Vec<_> = tasks.collect();
            let done = parallel::map_with(Vec::new, tasks, |room, (task, mut waiting)| {
                let eliminated = task.map(|(g, old)| {
                    let own = &entries[starts[g]..starts[g + 1]];
                    let below = waiting.len() - plan.fronts[g].below.len();
                    let halves = &waiting[below..];
                    let (front, update) = eliminate(&plan, g, schur, own, halves, old, room);
                    waiting.truncate(below);
                    waiting.push(update);
                    front
                });
                (eliminated.collect::<Vec<_>>(), waiting.pop())
            });
            for (task, (eliminated, update)) in level.iter().zip(done) {
                updates[task.end - 1] = update.unwrap_or_default();
                for (place, front) in fronts[task.clone()].iter_mut().zip(eliminated) {
                    *place = front;
                }
            }
        }
        clear_registers_everywhere();
        SchurLu { plan, fronts }
    }

    /// Whether a correction of this rank, for which a given number of solves is missing, is cheaper than a new factorisation.
    pub fn corrects(&self, rank: usize, missing: usize) -> bool {
        let (rank, missing) = (rank as f64, missing as f64);
        let solves = 2.0 * missing * self.plan.entries as f64 + rank * rank * rank / 1.5;
        // The columns are copied, and added up twice.
        let columns = 8.0 * rank * self.size() as f64;
        1.7 * (solves + columns) < self.plan.flops
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.plan.numbers.len()
    }

    /// Solves M X = B in place; not finite where M is singular.
    pub(super) fn solve_in_place(&self, mut unknowns: MatMut<f64>) {
        let columns = unknowns.ncols();
        let mut x = Mat::zeros(self.size(), columns);
        for (column, mut x) in unknowns.as_ref().col_iter().zip(x.col_iter_mut()) {
            for (value, &number) in column.iter().zip(&self.plan.numbers) {
                x[number as usize] = *value;
            }
        }
        let mut room = Vec::new();
        let eliminated = || self.plan.fronts.iter().zip(&self.fronts);
        for (front, done) in eliminated().filter(|(_, done)| done.pivots > 0) {
            let (p, size) = (done.pivots, done.late.len() + front.unknowns.len());
            let threads = threads_for(size * p * columns);
            gather(x.as_ref(), done.pivots(front), &mut room);
            for column in room.chunks_exact_mut(p) {
                for (k, &swap) in done.swaps.iter().enumerate() {
                    column.swap(k, swap as usize);
                }
            }
            let of_pivots = p * columns;
            room.resize(size * columns, 0.0);
            let (z, on_border) = room.split_at_mut(of_pivots);
            if size * p * columns < SMALL {
                for (j, z) in z.chunks_exact_mut(p).enumerate() {
                    let on_border = &mut on_border[j * (size - p)..][..size - p];
                    for (k, column) in done.values[..size * p].chunks_exact(size).enumerate() {
                        let factor = z[k];
                        subtract(&mut z[k + 1..], &column[k + 1..p], factor);
                        subtract(on_border, &column[p..], factor);
                    }
                }
            } else {
                let mut z = MatMut::from_column_major_slice_mut(z, p, columns);
                let (of_pivots, of_border) = done.lower(size).split_at_row(p);
                solve_unit_lower_triangular_in_place(of_pivots, z.as_mut(), threads);
                let target = MatMut::from_column_major_slice_mut(on_border, size - p, columns);
                matmul(target, Accum::Add, of_border, z.as_ref(), -1.0, threads);
                clear_registers();
            }
            for j in 0..columns {
                for (&k, z) in done.pivots(front).zip(&room[j * p..]) {
                    x[(k as usize, j)] = *z;
                }
                let change = &room[of_pivots + j * (size - p)..];
                for (&k, change) in done.border(front).iter().zip(change) {
                    x[(k as usize, j)] += change;
                }
            }
        }
        for (front, done) in eliminated().rev().filter(|(_, done)| done.pivots > 0) {
            let (p, size) = (done.pivots, done.late.len() + front.unknowns.len());
            let threads = threads_for(size * p * columns);
            let all = done.pivots(front).chain(done.border(front));
            gather(x.as_ref(), all, &mut room);
            if size * p * columns < SMALL {
                for all in room.chunks_exact_mut(size) {
                    let (z, on_border) = all.split_at_mut(p);
                    let of_border = done.values[size * p..].chunks_exact(p);
                    for (column, factor) in of_border.zip(on_border) {
                        subtract(z, column, *factor);
                    }
                    for (k, column) in done.values[..size * p].chunks_exact(size).enumerate().rev()
                    {
                        z[k] /= column[k];
                        let factor = z[k];
                        subtract(&mut z[..k], &column[..k], factor);
                    }
                }
            } else {
                let all = MatMut::from_column_major_slice_mut(&mut room, size, columns);
                let (mut z, on_border) = all.split_at_row_mut(p);
                let of_border =
                    MatRef::from_column_major_slice(&done.values[size * p..], p, size - p);
                let sum = z.as_mut();
                let on_border = on_border.as_ref();
                matmul(sum, Accum::Add, of_border, on_border, -1.0, threads);
                let of_pivots = done.lower(size).split_at_row(p).0;
                solve_upper_triangular_in_place(of_pivots, z, threads);
                clear_registers();
            }
            for (j, z) in room.chunks_exact(size).enumerate() {
                for (&k, z) in done.pivots(front).zip(z) {
                    x[(k as usize, j)] = *z;
                }
            }
        }
        for (column, x) in unknowns.as_mut().col_iter_mut().zip(x.col_iter()) {
            for (value, &number) in column.iter_mut().zip(&self.plan.numbers) {
                *value = x[number as usize];
            }
        }
    }
}

impl Eliminated {
    fn pivots<'a>(&'a self, front: &'a Front) -> impl Iterator<Item = &'a u32> + Clone {
        self.late.iter().chain(&front.unknowns[..front.pivots])
    }

    fn border<'a>(&self, front: &'a Front) -> &'a [u32] {
        front.border()
    }

    /// The columns of L with the diagonal of U and what is above.
    fn lower(&self, size: usize) -> MatRef<'_, f64> {
        let p = self.pivots;
        MatRef::from_column_major_slice(&self.values[..size * p], size, p)
    }
}

/// The rows of x, by columns.
fn gather<'a>(x: MatRef<f64>, rows: impl Iterator<Item = &'a u32> + Clone, room: &mut Vec<f64>) {
    room.clear();
    for j in 0..x.ncols() {
        room.extend(rows.clone().map(|&k| x[(k as usize, j)]));
    }
}

/// Sums a front and eliminates its pivots; `room` is for the front, and used again, as the memory of an `old` one is.
fn eliminate(
    plan: &LuPlan,
    g: usize,
    schur: &Schur,
    entries: &[Entry],
    halves: &[Update],
    old: Eliminated,
    room: &mut Vec<f64>,
) -> (Eliminated, Update) {
    let front = &plan.fronts[g];
    let Eliminated {
        mut late,
        mut values,
        ..
    } = old;
    late.clear();
    late.extend(halves.iter().flat_map(|half| &half.waiting));
    let size = late.len() + front.unknowns.len();
    sum(plan, front, schur, entries, halves, &late, room);
    let p = late.len() + front.pivots;
    let growth = LARGEST_GROWTH * largest(room);
    let swaps = factor(room, size, p);
    let of_border = || room[size * p..].chunks_exact(size.max(1)).map(|c| &c[p..]);
    // What is not a number waits as well.
    if !of_border().all(|column| largest(column) <= growth) {
        sum(plan, front, schur, entries, halves, &late, room);
        let own = &front.unknowns[..front.pivots];
        let update = Update {
            waiting: [&late[..], own].concat(),
            matrix: std::mem::take(room),
        };
        return (Eliminated::default(), update);
    }
    let mut matrix = Vec::with_capacity((size - p).pow(2));
    of_border().for_each(|column| matrix.extend(column));
    values.clear();
    values.reserve_exact(size * p + p * (size - p));
    values.extend(&room[..size * p]);
    for column in room[size * p..].chunks_exact(size.max(1)) {
        values.extend(&column[..p]);
    }
    let front = Eliminated {
        late,
        pivots: p,
        swaps,
        values,
    };
    let waiting = Vec::new();
    (front, Update { waiting, matrix })
}

/// Adds all that comes into a front, by columns: delayed pivots come first.
fn sum(
    plan: &LuPlan,
    front: &Front,
    schur: &Schur,
    entries: &[Entry],
    halves: &[Update],
    late: &[u32],
    matrix: &mut Vec<f64>,
) {
    let size = late.len() + front.unknowns.len();
    matrix.clear();
    matrix.resize(size * size, 0.0);
    let mut next = front.places;
    let mut places = Vec::with_capacity(size);
    let mut known = |count: usize, places: &mut Vec<usize>| {
        let of_part = &plan.places[next..next + count];
        places.extend(of_part.iter().map(|&place| late.len() + place as usize));
        next += count;
    };
    for &block in &front.blocks {
        let (border, dense) = &schur.blocks[block as usize];
        places.clear();
        known(border.len(), &mut places);
        for (k, column) in dense.col_iter().enumerate() {
            let target = &mut matrix[places[k] * size..][..size];
            for (&place, value) in places.iter().zip(column.iter()) {
                target[place] += *value;
            }
        }
    }
    let mut waited = 0;
    for (&half, update) in front.below.iter().zip(halves) {
        places.clear();
        places.extend(waited..waited + update.waiting.len());
        waited += update.waiting.len();
        known(plan.fronts[half as usize].border().len(), &mut places);
        let columns = update.matrix.chunks_exact(places.len().max(1));
        for (k, column) in columns.enumerate() {
            let target = &mut matrix[places[k] * size..][..size];
            for (&place, value) in places.iter().zip(column) {
                target[place] += *value;
            }
        }
    }
    let place = |k: u32| {
        let found = front.unknowns.binary_search(&k);
        late.len()
            + found.expect(
                "invariant: the plan has all that is tied in the front of its first unknown",
            )
    };
    for &(i, j, value) in entries {
        matrix[place(j) * size + place(i)] += value;
    }
}

/// The largest |a|; NaN if one of them is NaN.
fn largest(values: &[f64]) -> f64 {
    let mut largest = 0.0;
    for a in values {
        if !(a.abs() <= largest) {
            largest = a.abs();
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{LowRank, Solved};

    /// Dense on every third of `n` unknowns, the others joined to neighbours in twos and threes.
    fn example(n: u32) -> (Schur, Vec<Entry>) {
        let border: Vec<u32> = (0..n).filter(|k| k % 3 == 0).collect();
        let dense = Mat::from_fn(border.len(), border.len(), |i, j| {
            (0.3 * (i + j) as f64).sin() + if i == j { 20.0 } else { 0.0 }
        });
        let mut rest = Vec::new();
        for k in 0..n {
            rest.push((k, k, 3.0));
            if k + 1 < n {
                rest.extend([(k, k + 1, 0.7), (k + 1, k, 0.7)]);
            }
        }
        let extra: Vec<Entry> = (1..n).map(|k| (k, k - 1, f64::from(k).cos())).collect();
        // Pairs between the dense ones first.
        let pairs = (0..n).collect::<Vec<u32>>();
        let pairs = pairs.chunks(3).map(|three| three[1..].to_vec());
        let groups: Vec<Vec<u32>> = pairs
            .filter(|pair| !pair.is_empty())
            .chain([border.clone()])
            .collect();
        // Four of a change that comes later as well.
        let changed = (0..4).map(|r| vec![r, r + 9, 2 * r, 2 * r + 1]);
        let ties = rest
            .iter()
            .chain(&extra)
            .map(|&(i, j, _)| vec![i, j])
            .chain(changed);
        let plan = LuPlan::new(
            groups,
            [&border[..]].into_iter(),
            ties.filter(|tie| tie.iter().all(|k| *k < n)),
        );
        let kept = (0..n).collect();
        (
            Schur::new(kept, vec![(border, dense)], rest, Arc::new(plan)),
            extra,
        )
    }

    /// b - (S + extra) x
    fn rest(schur: &Schur, extra: &[Entry], x: &[f64], b: &[f64]) -> f64 {
        let mut y = schur.times(x);
        for &(i, j, value) in extra {
            y[i as usize] += value * x[j as usize];
        }
        let rests = y.iter().zip(b).map(|(y, b)| (y - b).abs());
        rests.fold(0.0, f64::max)
    }

    /// Of each front.
    fn pivots(lu: &SchurLu) -> Vec<usize> {
        lu.fronts.iter().map(|front| front.pivots).collect()
    }

    #[test]
    fn blocks_and_the_dense_part_solve_together() {
        let (schur, extra) = example(31);
        let b: Vec<f64> = (0..31).map(|k| f64::from(k).sin()).collect();
        let lu = schur.lu(&extra, None);
        assert_eq!(
            (lu.size(), pivots(&lu)),
            (31, vec![2; 10].into_iter().chain([11]).collect())
        );
        let x = lu.changed(&LowRank::default(), &mut Solved::default())(&b);
        assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        // A front whose pivots cannot be eliminated leaves them to the next one.
        let mut singular = extra.clone();
        singular.extend([
            (1, 1, -3.0),
            (2, 2, -3.0),
            (1, 2, -0.7),
            (2, 1, -0.7 - 2.0_f64.cos()),
        ]);
        // In the memory of the last one.
        let lu = schur.lu(&singular, Some(lu));
        let of_fronts = pivots(&lu);
        assert!(of_fronts.contains(&0) && of_fronts.iter().any(|pivots| *pivots > 11));
        assert_eq!(of_fronts.iter().sum::<usize>(), 31);
        let x = lu.changed(&LowRank::default(), &mut Solved::default())(&b);
        assert!(rest(&schur, &singular, &x, &b) < 1e-13);
    }

    #[test]
    fn a_change_of_low_rank_needs_no_new_factorisation() {
        let (schur, extra) = example(40);
        let lu = schur.lu(&extra, None);
        let b: Vec<f64> = (0..40).map(|k| f64::from(k).cos()).collect();
        let mut solved = Solved::default();
        // Terms that come and go and weigh otherwise: what is solved for serves the changes that follow.
        let changes: [(&[u32], usize); 4] =
            [(&[1], 1), (&[3, 1, 0], 2), (&[0, 1, 2, 3], 1), (&[2], 0)];
        for (step, (terms, missing)) in (1..).zip(changes) {
            let (mut change, mut extra) = (LowRank::default(), extra.clone());
            for &r in terms {
                let l = vec![(r, 2.0), (r + 9, -1.0)];
                let m = vec![(2 * r, 0.5 * f64::from(step)), (2 * r + 1, f64::from(r))];
                for &(i, x) in &l {
                    extra.extend(m.iter().map(|&(j, y)| (i, j, x * y)));
                }
                change.push(l, m);
            }
            assert_eq!(solved.missing(&change), missing);
            let x = lu.changed(&change, &mut solved)(&b);
            assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        }
        assert!(schur.norm() > 20.0);
    }
}
