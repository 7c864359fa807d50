//! Elimination orders that keep the factor sparse.

/// Parts smaller than this are not cut further.
const LEAF: usize = 48;

/// Nested dissection by coordinates (George 1973): cut the longest extent at the median, take
/// the points of one half that touch the other as separator, eliminate the halves first.
///
/// `last` marks the indices that come at the very end, in ascending order. Returns the indices
/// in the order of elimination.
pub fn nested_dissection(
    points: &[[f64; 3]],
    (starts, neighbours): &(Vec<usize>, Vec<u32>),
    last: &[bool],
) -> Vec<usize> {
    let mut order = Vec::with_capacity(points.len());
    let mut side = vec![OUTSIDE; points.len()];
    let mut rest: Vec<u32> = (0..points.len() as u32)
        .filter(|&k| !last[k as usize])
        .collect();
    dissect(points, starts, neighbours, &mut rest, &mut side, &mut order);
    order.extend((0..points.len()).filter(|&k| last[k]));
    order
}

const OUTSIDE: u8 = 0;
const LOW: u8 = 1;
const HIGH: u8 = 2;

/// Depth is bounded by log₂(n): each call cuts at the median.
fn dissect(
    points: &[[f64; 3]],
    starts: &[usize],
    neighbours: &[u32],
    part: &mut [u32],
    side: &mut [u8],
    order: &mut Vec<usize>,
) {
    if part.len() <= LEAF {
        order.extend(part.iter().map(|&k| k as usize));
        return;
    }
    let extent = |axis: usize| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &k in part.iter() {
            low = low.min(points[k as usize][axis]);
            high = high.max(points[k as usize][axis]);
        }
        high - low
    };
    let extents = [extent(0), extent(1), extent(2)];
    let axis = (0..3).fold(
        0,
        |best, k| if extents[k] > extents[best] { k } else { best },
    );
    let middle = part.len() / 2;
    part.select_nth_unstable_by(middle, |&a, &b| {
        points[a as usize][axis]
            .total_cmp(&points[b as usize][axis])
            .then(a.cmp(&b))
    });
    for (k, &index) in part.iter().enumerate() {
        side[index as usize] = if k < middle { LOW } else { HIGH };
    }
    let touches = |index: u32, other: u8| {
        let index = index as usize;
        neighbours[starts[index]..starts[index + 1]]
            .iter()
            .any(|&n| side[n as usize] == other)
    };
    // The separator comes from the half that has fewer points at the cut.
    let (low, high) = part.split_at(middle);
    let low_separator: Vec<bool> = low.iter().map(|&k| touches(k, HIGH)).collect();
    let high_separator: Vec<bool> = high.iter().map(|&k| touches(k, LOW)).collect();
    let count = |marks: &[bool]| marks.iter().filter(|&&m| m).count();
    let from_low = count(&low_separator) <= count(&high_separator);
    let (mut first, mut second, mut separator) = (Vec::new(), Vec::new(), Vec::new());
    for (&k, &cut) in low.iter().zip(&low_separator) {
        if from_low && cut {
            separator.push(k);
        } else {
            first.push(k);
        }
    }
    for (&k, &cut) in high.iter().zip(&high_separator) {
        if !from_low && cut {
            separator.push(k);
        } else {
            second.push(k);
        }
    }
    for &k in part.iter() {
        side[k as usize] = OUTSIDE;
    }
    dissect(points, starts, neighbours, &mut first, side, order);
    dissect(points, starts, neighbours, &mut second, side, order);
    separator.sort_unstable_by(|&a, &b| {
        let along = |k: u32| points[k as usize][(axis + 1) % 3];
        along(a).total_cmp(&along(b)).then(a.cmp(&b))
    });
    order.extend(separator.iter().map(|&k| k as usize));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::SymmetricBuilder;

    #[test]
    fn every_index_comes_once_and_the_marked_ones_last() {
        let n = 20;
        let mut builder = SymmetricBuilder::new(n * n, 0);
        let at = |i: usize, j: usize| (i * n + j) as u32;
        for i in 0..n {
            for j in 0..n {
                builder.add(at(i, j), at(i, j), 4.0);
                if i + 1 < n {
                    builder.add(at(i, j), at(i + 1, j), -1.0);
                }
                if j + 1 < n {
                    builder.add(at(i, j), at(i, j + 1), -1.0);
                }
            }
        }
        let points: Vec<_> = (0..n * n)
            .map(|k| [(k / n) as f64, (k % n) as f64, 0.0])
            .collect();
        let last: Vec<bool> = (0..n * n).map(|k| k % n == 0).collect();
        let order = nested_dissection(&points, &builder.build().graph(), &last);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..n * n).collect::<Vec<_>>());
        assert!(order[n * (n - 1)..].iter().all(|&k| last[k]));
    }
}
