//! Nested dissection of the unknowns of a sparse matrix by where they are (A. George, SIAM J. Numer. Anal. 10, 1973).
//!
//! The unknowns are cut in two, again and again. Of those that entries couple across a cut, the ones on the side with fewer of them are
//! eliminated after both parts.

use super::bisection::Tree;

/// A part with at most this many unknowns is eliminated as a whole.
const WHOLE: usize = 32;

/// Groups of unknowns in the order of elimination. Row i of the matrix has its entries in `columns[starts[i]..starts[i + 1]]`, in either triangle
/// or in both; unknowns without a place come last, together.
pub(super) fn groups(starts: &[usize], columns: &[usize], places: &[[f64; 3]]) -> Vec<Vec<u32>> {
    let count = places.len();
    let members: Vec<u32> = (0..count as u32).collect();
    let tree = Tree::new(&members, |k| places[k as usize]);
    let mut position = vec![0; count];
    for (at, k) in tree.order.iter().enumerate() {
        position[*k as usize] = at;
    }
    let cuts = Cuts::new(&tree);
    // The cuts that each unknown is coupled across.
    let mut across: Vec<Vec<u32>> = vec![Vec::new(); count];
    for i in 0..count {
        let entries = columns[starts[i]..starts[i + 1]].iter();
        for j in entries.copied().filter(|j| *j < count && *j != i) {
            if let Some(cut) = cuts.between(position[i], position[j]) {
                for k in [i, j] {
                    if !across[k].contains(&cut) {
                        across[k].push(cut);
                    }
                }
            }
        }
    }
    let mut sides = vec![[0_u32; 2]; tree.parts.len()];
    for (k, found) in across.iter().enumerate() {
        for cut in found {
            sides[*cut as usize][cuts.side(*cut, position[k])] += 1;
        }
    }
    let mut of_parts: Vec<Vec<u32>> = vec![Vec::new(); tree.parts.len()];
    // In the order of the tree, so that what is near stays near.
    for (at, k) in tree.order.iter().enumerate() {
        let is_between = |cut: &&u32| {
            let [left, right] = sides[**cut as usize];
            (cuts.side(**cut, at) == 0) == (left <= right)
        };
        let cut = across[*k as usize].iter().filter(is_between).max();
        of_parts[cut.map_or(cuts.whole[at], |cut| *cut) as usize].push(*k);
    }
    of_parts.push((count as u32..starts.len() as u32 - 1).collect());
    of_parts.retain(|group| !group.is_empty());
    of_parts
}

/// Where the tree cuts.
struct Cuts<'a> {
    tree: &'a Tree,
    /// The part above each; itself of the last.
    above: Vec<u32>,
    /// The part that is not cut further, of each place in the order.
    whole: Vec<u32>,
}

impl<'a> Cuts<'a> {
    fn new(tree: &'a Tree) -> Self {
        let parts = &tree.parts;
        let mut above: Vec<u32> = (0..parts.len() as u32).collect();
        let mut whole = vec![0; tree.order.len()];
        // From the whole downwards.
        for k in (0..parts.len()).rev() {
            let is_below_whole = parts[above[k] as usize].len() <= WHOLE && above[k] as usize != k;
            if let Some(left) = parts[k].left() {
                (above[left], above[k - 1]) = (k as u32, k as u32);
            }
            let is_leaf = parts[k].len() <= WHOLE || parts[k].left().is_none();
            if is_leaf && !is_below_whole {
                whole[parts[k].from as usize..parts[k].to as usize].fill(k as u32);
            }
        }
        Cuts { tree, above, whole }
    }

    /// The cut that has two places in the order on its two sides; none within a part that is not cut.
    fn between(&self, a: usize, b: usize) -> Option<u32> {
        let mut part = self.whole[a];
        if part == self.whole[b] {
            return None;
        }
        let has_b = |part: &crate::linear::bisection::Part| {
            (part.from as usize..part.to as usize).contains(&b)
        };
        while !has_b(&self.tree.parts[part as usize]) {
            part = self.above[part as usize];
        }
        Some(part)
    }

    /// 0 in the first part of a cut, 1 in the second.
    fn side(&self, cut: u32, at: usize) -> usize {
        let left = self.tree.parts[cut as usize].left();
        let is_left = left.is_some_and(|left| {
            at < self.tree.parts[left].to as usize && at >= self.tree.parts[left].from as usize
        });
        usize::from(!is_left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of n × n unknowns, each coupled to its neighbours, with one more that is coupled to all.
    fn grid(n: usize) -> (Vec<usize>, Vec<usize>, Vec<[f64; 3]>) {
        let (mut starts, mut columns, mut places) = (vec![0], Vec::new(), Vec::new());
        for k in 0..n * n {
            let (x, y) = (k % n, k / n);
            let near = [
                (y > 0).then(|| k - n),
                (x > 0).then(|| k - 1),
                Some(k),
                (x + 1 < n).then_some(k + 1),
                (y + 1 < n).then_some(k + n),
                Some(n * n),
            ];
            columns.extend(near.into_iter().flatten());
            starts.push(columns.len());
            places.push([x as f64, y as f64, 0.0]);
        }
        columns.extend(0..n * n);
        starts.push(columns.len());
        (starts, columns, places)
    }

    #[test]
    fn groups_are_parts_and_the_lines_between_them() {
        let n = 24;
        let (starts, columns, places) = grid(n);
        let groups = groups(&starts, &columns, &places);
        let mut all = groups.concat();
        all.sort_unstable();
        assert!(all.iter().copied().eq(0..=(n * n) as u32));
        assert_eq!(groups[groups.len() - 1], [(n * n) as u32]);
        // The last cut is a line, and takes out all that couples the two halves.
        let line = &groups[groups.len() - 2];
        assert_eq!(line.len(), n);
        assert!(groups.iter().all(|group| group.len() <= WHOLE));
        // What is coupled and not in one group: the later one is above the earlier one, in that no third part has both.
        let mut group_of = vec![0; n * n + 1];
        for (g, group) in groups.iter().enumerate() {
            group.iter().for_each(|k| group_of[*k as usize] = g);
        }
        let half = |k: usize| group_of[k] < groups.len() - 2;
        let side = |k: usize| {
            places[k][0] < places[line[0] as usize][0]
                || places[k][1] < places[line[0] as usize][1]
                    && places[line[1] as usize][1] == places[line[0] as usize][1]
        };
        for i in (0..n * n).filter(|i| half(*i)) {
            for j in columns[starts[i]..starts[i + 1]]
                .iter()
                .filter(|j| **j < n * n && half(**j))
            {
                assert_eq!(side(i), side(*j), "{i} and {j}");
            }
        }
    }
}
