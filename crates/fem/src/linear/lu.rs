//! Multifrontal LU factorisation of the Schur complement with what contact adds (I. Duff, J. Reid, SIAM J. Sci. Stat. Comput.
//! 5, 1984): the part of the elimination that is done again for each set of statuses.
//!
//! What is factored is a sum of dense blocks and single entries. Each front eliminates a group of unknowns; where its pivots
//! would let the entries grow, they wait for the next front, as in Duff and Reid. On the last one all that is left is pivoted.

use std::sync::Arc;

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

use super::frontier;
use super::schur::{Entry, Schur};

/// Pivots wait if an update is larger than this times the entries of the front.
const LARGEST_GROWTH: f64 = 1e6;

/// The fronts, all that does not depend on values.
#[derive(Debug, Default)]
pub(super) struct LuPlan {
    fronts: Vec<Front>,
    /// Fronts whose halves are in earlier levels.
    levels: Vec<Vec<u32>>,
    /// The front of each unknown, and its number in the order of elimination.
    owners: Vec<u32>,
    numbers: Vec<u32>,
    /// Entries that are stored, and multiplications and additions.
    pub entries: usize,
    pub flops: f64,
    /// Most entries of one front.
    pub largest: usize,
}

#[derive(Debug, Default)]
struct Front {
    pivots: usize,
    /// The pivots and the border, in the order of elimination.
    unknowns: Vec<u32>,
    /// Blocks that are added to it, and fronts.
    blocks: Vec<u32>,
    below: Vec<u32>,
}

impl LuPlan {
    /// `groups` are eliminated one after the other; each block and each tie couples its unknowns.
    pub fn new<'a>(
        groups: Vec<Vec<u32>>,
        blocks: impl Iterator<Item = &'a [u32]>,
        ties: impl Iterator<Item = Vec<u32>>,
    ) -> Self {
        let size = groups.iter().map(Vec::len).sum();
        let mut plan = LuPlan {
            owners: vec![0; size],
            numbers: vec![0; size],
            ..LuPlan::default()
        };
        for (number, (owner, &k)) in (0..groups.len() as u32)
            .zip(&groups)
            .flat_map(|(owner, group)| group.iter().map(move |k| (owner, k)))
            .enumerate()
        {
            (plan.owners[k as usize], plan.numbers[k as usize]) = (owner, number as u32);
        }
        // What is coupled comes into the front that eliminates the first of it.
        let mut tied: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        let mut of_blocks = vec![Vec::new(); groups.len()];
        for (block, border) in (0..).zip(blocks) {
            if let Some(first) = border.iter().map(|&k| plan.owners[k as usize]).min() {
                of_blocks[first as usize].push(block);
                tied[first as usize].extend(border);
            }
        }
        for tie in ties {
            if let Some(first) = tie.iter().map(|&k| plan.owners[k as usize]).min() {
                tied[first as usize].extend(tie);
            }
        }
        let mut below: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
        let mut heights = vec![0; groups.len()];
        for (g, group) in groups.into_iter().enumerate() {
            let pivots = group.len();
            let mut unknowns = group;
            unknowns.append(&mut tied[g]);
            for &half in &below[g] {
                let half: &Front = &plan.fronts[half as usize];
                unknowns.extend(&half.unknowns[half.pivots..]);
            }
            unknowns.sort_unstable_by_key(|&k| plan.numbers[k as usize]);
            unknowns.dedup();
            if let Some(&next) = unknowns.get(pivots) {
                let parent = plan.owners[next as usize] as usize;
                below[parent].push(g as u32);
                heights[parent] = heights[parent].max(heights[g] + 1);
            }
            let (p, b) = (pivots, unknowns.len() - pivots);
            plan.entries += p * p + 2 * p * b;
            plan.flops += frontier::lu(p as f64, b as f64);
            plan.largest = plan.largest.max(unknowns.len().pow(2));
            plan.levels
                .resize(plan.levels.len().max(heights[g] + 1), Vec::new());
            plan.levels[heights[g]].push(g as u32);
            plan.fronts.push(Front {
                pivots,
                unknowns,
                blocks: std::mem::take(&mut of_blocks[g]),
                below: std::mem::take(&mut below[g]),
            });
        }
        plan
    }

    /// Entries by the front that they come into.
    fn sorted<'e>(
        &self,
        entries: impl Iterator<Item = &'e Entry> + Clone,
    ) -> (Vec<usize>, Vec<Entry>) {
        let front = |entry: &Entry| {
            let owner = |k: u32| self.owners[k as usize];
            owner(entry.0).min(owner(entry.1)) as usize
        };
        let mut starts = vec![0; self.fronts.len() + 1];
        for entry in entries.clone() {
            starts[front(entry) + 1] += 1;
        }
        for g in 0..self.fronts.len() {
            starts[g + 1] += starts[g];
        }
        let mut next = starts.clone();
        let mut sorted = vec![(0, 0, 0.0); next[self.fronts.len()]];
        for entry in entries {
            let place = &mut next[front(entry)];
            sorted[*place] = *entry;
            *place += 1;
        }
        (starts, sorted)
    }
}

/// A factorisation of S and more.
pub struct SchurLu {
    plan: Arc<LuPlan>,
    fronts: Vec<Eliminated>,
}

/// A front M whose pivots p are eliminated from its border b.
struct Eliminated {
    pivots: Vec<u32>,
    border: Vec<u32>,
    lu: Option<PartialPivLu<f64>>,
    /// M_pp⁻¹ M_pb and M_bp.
    across: Mat<f64>,
    back: Mat<f64>,
}

/// What a front hands up.
struct Update {
    /// Pivots that wait, and the border.
    waiting: usize,
    unknowns: Vec<u32>,
    matrix: Mat<f64>,
}

impl SchurLu {
    pub(super) fn new(schur: &Schur, extra: &[Entry]) -> Self {
        let plan = Arc::clone(&schur.plan);
        let (starts, entries) = plan.sorted(schur.rest.iter().chain(extra));
        let mut updates: Vec<Option<Update>> = plan.fronts.iter().map(|_| None).collect();
        let mut fronts: Vec<Option<Eliminated>> = plan.fronts.iter().map(|_| None).collect();
        for level in &plan.levels {
            let done: Vec<_> = level
                .par_iter()
                .with_min_len(16)
                .map(|&g| {
                    let g = g as usize;
                    let own = &entries[starts[g]..starts[g + 1]];
                    eliminate(&plan, g, schur, own, &updates)
                })
                .collect();
            for (&g, (front, update)) in level.iter().zip(done) {
                for &half in &plan.fronts[g as usize].below {
                    updates[half as usize] = None;
                }
                fronts[g as usize] = Some(front);
                updates[g as usize] = Some(update);
            }
        }
        let fronts: Vec<Eliminated> = fronts.into_iter().flatten().collect();
        SchurLu { plan, fronts }
    }

    /// Is a correction of this rank cheaper than to factor anew? It takes as many solves.
    pub fn corrects(&self, rank: usize) -> bool {
        let rank = rank as f64;
        let solves = 2.0 * rank * self.plan.entries as f64 + rank * rank * rank / 1.5;
        1.7 * solves < self.plan.flops
    }

    pub fn size(&self) -> usize {
        self.plan.owners.len()
    }

    /// Solves M X = B in place; not finite where M is singular.
    pub(super) fn solve_in_place(&self, mut x: MatMut<f64>) {
        for front in &self.fronts {
            let Some(lu) = &front.lu else { continue };
            let mut z = gather(x.as_ref(), &front.pivots);
            lu.solve_in_place(z.as_mut());
            subtract(x.as_mut(), &front.border, &(&front.back * &z));
            for (i, &k) in front.pivots.iter().enumerate() {
                for j in 0..z.ncols() {
                    x[(k as usize, j)] = z[(i, j)];
                }
            }
        }
        for front in self.fronts.iter().rev().filter(|front| front.lu.is_some()) {
            let update = &front.across * gather(x.as_ref(), &front.border);
            subtract(x.as_mut(), &front.pivots, &update);
        }
    }
}

fn gather(x: MatRef<f64>, rows: &[u32]) -> Mat<f64> {
    Mat::from_fn(rows.len(), x.ncols(), |i, j| x[(rows[i] as usize, j)])
}

fn subtract(mut x: MatMut<f64>, rows: &[u32], update: &Mat<f64>) {
    for (i, &k) in rows.iter().enumerate() {
        for j in 0..update.ncols() {
            x[(k as usize, j)] -= update[(i, j)];
        }
    }
}

/// Sums a front and eliminates its pivots.
fn eliminate(
    plan: &LuPlan,
    g: usize,
    schur: &Schur,
    entries: &[Entry],
    updates: &[Option<Update>],
) -> (Eliminated, Update) {
    let front = &plan.fronts[g];
    let mut late: Vec<u32> = Vec::new();
    let halves = || {
        front
            .below
            .iter()
            .filter_map(|&half| updates[half as usize].as_ref())
    };
    for half in halves() {
        late.extend(&half.unknowns[..half.waiting]);
    }
    let number = |k: u32| plan.numbers[k as usize];
    // Who waited stands first.
    let place = |k: u32| {
        let in_front = front
            .unknowns
            .binary_search_by_key(&number(k), |&other| number(other));
        match in_front {
            Ok(place) => late.len() + place,
            Err(_) => late.iter().position(|&other| other == k).expect(
                "invariant: the plan has all that is tied in the front of its first unknown",
            ),
        }
    };
    let size = late.len() + front.unknowns.len();
    let mut matrix = Mat::<f64>::zeros(size, size);
    let blocks = front.blocks.iter().map(|&block| {
        let (border, dense) = &schur.blocks[block as usize];
        (border, dense)
    });
    let from_below = halves().map(|half| (&half.unknowns, &half.matrix));
    for (unknowns, dense) in blocks.chain(from_below) {
        let places: Vec<usize> = unknowns.iter().map(|&k| place(k)).collect();
        for (&q, column) in places.iter().zip(dense.col_iter()) {
            let mut target = matrix.col_mut(q);
            for (&p, value) in places.iter().zip(column.iter()) {
                target[p] += *value;
            }
        }
    }
    for &(i, j, value) in entries {
        matrix[(place(i), place(j))] += value;
    }
    let p = late.len() + front.pivots;
    let mut unknowns = late;
    unknowns.extend(&front.unknowns);
    let lu = matrix.submatrix(0, 0, p, p).partial_piv_lu();
    let mut across = matrix.submatrix(0, p, p, size - p).to_owned();
    lu.solve_in_place(across.as_mut());
    let back = matrix.submatrix(p, 0, size - p, p).to_owned();
    let mut update = &back * &across;
    let growth = LARGEST_GROWTH * largest(matrix.as_ref());
    // What is not a number waits as well.
    if size > p && !(largest(update.as_ref()) <= growth) {
        let none = Eliminated {
            pivots: Vec::new(),
            border: Vec::new(),
            lu: None,
            across: Mat::new(),
            back: Mat::new(),
        };
        let update = Update {
            waiting: p,
            unknowns,
            matrix,
        };
        return (none, update);
    }
    let of_border = matrix.submatrix(p, p, size - p, size - p);
    for (update, own) in update.col_iter_mut().zip(of_border.col_iter()) {
        for (update, own) in update.iter_mut().zip(own.iter()) {
            *update = own - *update;
        }
    }
    let border = unknowns.split_off(p);
    let above = Update {
        waiting: 0,
        unknowns: border.clone(),
        matrix: update,
    };
    let front = Eliminated {
        pivots: unknowns,
        border,
        lu: Some(lu),
        across,
        back,
    };
    (front, above)
}

/// The largest entry; not a number if one is none.
fn largest(matrix: MatRef<f64>) -> f64 {
    let mut largest = 0.0;
    for column in matrix.col_iter() {
        for a in column.iter() {
            if !(a.abs() <= largest) {
                largest = a.abs();
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::LowRank;

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
        lu.fronts.iter().map(|front| front.pivots.len()).collect()
    }

    #[test]
    fn blocks_and_the_dense_part_solve_together() {
        let (schur, extra) = example(31);
        let b: Vec<f64> = (0..31).map(|k| f64::from(k).sin()).collect();
        let lu = schur.lu(&extra);
        assert_eq!(
            (lu.size(), pivots(&lu)),
            (31, vec![2; 10].into_iter().chain([11]).collect())
        );
        let x = lu.changed(&LowRank::default())(&b);
        assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        // A front whose pivots cannot be eliminated leaves them to the next one.
        let mut singular = extra.clone();
        singular.extend([
            (1, 1, -3.0),
            (2, 2, -3.0),
            (1, 2, -0.7),
            (2, 1, -0.7 - 2.0_f64.cos()),
        ]);
        let lu = schur.lu(&singular);
        let of_fronts = pivots(&lu);
        assert!(of_fronts[0] == 0 && of_fronts[10] > 11 && of_fronts.iter().sum::<usize>() == 31);
        let x = lu.changed(&LowRank::default())(&b);
        assert!(rest(&schur, &singular, &x, &b) < 1e-13);
    }

    #[test]
    fn a_change_of_low_rank_needs_no_new_factorisation() {
        let (schur, mut extra) = example(40);
        let lu = schur.lu(&extra);
        let mut change = LowRank::default();
        for r in 0..4 {
            let l = vec![(r, 2.0), (r + 9, -1.0)];
            let m = vec![(2 * r, 0.5), (2 * r + 1, f64::from(r))];
            for &(i, x) in &l {
                extra.extend(m.iter().map(|&(j, y)| (i, j, x * y)));
            }
            change.push(l, m);
        }
        let b: Vec<f64> = (0..40).map(|k| f64::from(k).cos()).collect();
        let x = lu.changed(&change)(&b);
        assert!(rest(&schur, &extra, &x, &b) < 1e-14);
        assert!(schur.norm() > 20.0);
    }
}
