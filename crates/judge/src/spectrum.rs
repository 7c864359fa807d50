//! Matches eigenvalues of two codes: common values, values that only one code has, and clusters.

/// Values that differ by more, relative to the larger, are different values rather than one with an error, unless a tolerance is larger.
const APART: f64 = 0.02;

/// Two ascending lists of eigenvalues, compared as multisets.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// Pairs of an index into the first list and one into the second.
    pub pairs: Vec<[usize; 2]>,
    /// Values that only the first or only the second has, below the end of the other list.
    pub alone: [Vec<usize>; 2],
    /// Values that only the first or only the second has, above the end of the other list, which may be the shorter one by request.
    pub beyond: [Vec<usize>; 2],
}

/// Matches two ascending lists of eigenvalues so that the sum of relative differences is smallest; values that differ by more than 2 %, or
/// than a larger tolerance, stay unmatched, or are beyond the end of the other list.
///
/// ```
/// let found = faceoff_judge::match_spectra(&[1.0, 2.0, 5.0, 5.0], &[2.0, 5.0, 5.0, 8.0], 1e-9);
/// assert_eq!(found.pairs, [[1, 0], [2, 1], [3, 2]]);
/// assert_eq!(found.alone, [vec![0], vec![]]);
/// // 8 is above the last of the first list.
/// assert_eq!(found.beyond, [vec![], vec![3]]);
/// ```
pub fn match_spectra(a: &[f64], b: &[f64], tolerance: f64) -> Matched {
    // One of 1 or more is none.
    let apart = match tolerance < 1.0 {
        true => APART.max(tolerance),
        false => APART,
    };
    let (n, m) = (a.len(), b.len());
    // The least cost of the first i and j values, and its last step: both matched, or one left unmatched.
    let mut cost = vec![vec![0.0; m + 1]; n + 1];
    let mut step = vec![vec![0; m + 1]; n + 1];
    for i in 0..=n {
        for j in 0..=m {
            if i + j == 0 {
                continue;
            }
            let mut best = (f64::INFINITY, 0);
            if i > 0 && j > 0 {
                let far = relative(a[i - 1], b[j - 1]);
                if far <= 2.0 * apart {
                    best = (cost[i - 1][j - 1] + far, 0);
                }
            }
            for (is_there, before, kind) in [
                (i > 0, cost[i.saturating_sub(1)][j], 1),
                (j > 0, cost[i][j.saturating_sub(1)], 2),
            ] {
                if is_there && before + apart < best.0 {
                    best = (before + apart, kind);
                }
            }
            (cost[i][j], step[i][j]) = best;
        }
    }
    let mut found = Matched {
        pairs: Vec::new(),
        alone: [Vec::new(), Vec::new()],
        beyond: [Vec::new(), Vec::new()],
    };
    let (mut i, mut j) = (n, m);
    while i + j > 0 {
        match step[i][j] {
            0 if i > 0 && j > 0 => {
                (i, j) = (i - 1, j - 1);
                found.pairs.push([i, j]);
            }
            1 => {
                i -= 1;
                found.alone[0].push(i);
            }
            _ => {
                j = j.saturating_sub(1);
                found.alone[1].push(j);
            }
        }
    }
    found.pairs.reverse();
    let last = |list: &[f64]| list.last().copied().unwrap_or(f64::NEG_INFINITY);
    let ends = [last(b), last(a)];
    for (k, alone) in found.alone.iter_mut().enumerate() {
        alone.reverse();
        let list = [a, b][k];
        (*alone, found.beyond[k]) = alone.iter().partition(|at| list[**at] <= ends[k]);
    }
    found
}

/// |a - b| relative to the larger one; infinite for NaN.
pub fn relative(a: f64, b: f64) -> f64 {
    match (a - b).abs() {
        0.0 => 0.0,
        far if far.is_finite() => far / a.abs().max(b.abs()),
        _ => f64::INFINITY,
    }
}

/// Clusters of values, as ranges of indices: consecutive values of a cluster differ by at most this, relative to the larger value.
///
/// ```
/// let runs = faceoff_judge::clusters(&[1.0, 5.0, 5.0 + 1e-9, 8.0], 1e-6);
/// assert_eq!(runs, [0..1, 1..3, 3..4]);
/// ```
pub fn clusters(values: &[f64], gap: f64) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for (k, value) in values.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if relative(values[k - 1], *value) <= gap => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spurious_value_shifts_nothing() {
        let truth = [19.7, 49.3, 49.3, 79.0];
        let spurious = [1.0, 19.7, 49.3, 49.3];
        let found = match_spectra(&spurious, &truth, 0.0);
        assert_eq!(found.pairs, [[1, 0], [2, 1], [3, 2]]);
        assert_eq!(found.alone, [vec![0], vec![]]);
        // A missing value of a pair is reported.
        let found = match_spectra(&[19.7, 49.3, 79.0], &truth, 0.0);
        let missed: Vec<f64> = found.alone[1].iter().map(|k| truth[*k]).collect();
        assert_eq!((&*missed, found.alone[0].len()), (&[49.3][..], 0));
        assert_eq!(found.pairs.len(), 3);
        // An error common to all values is an error, not a set of other values.
        let scaled = truth.map(|x| 1.01 * x);
        assert_eq!(match_spectra(&scaled, &truth, 0.0).pairs.len(), 4);
        // One of 8 % is one where that is allowed.
        let coarse = [21.3, 53.2, 53.2, 85.3];
        assert_eq!(match_spectra(&coarse, &truth, 0.0).pairs.len(), 0);
        assert_eq!(match_spectra(&coarse, &truth, 0.1).pairs.len(), 4);
        let nothing = match_spectra(&[1.0, 1.0], &[], 0.0);
        assert_eq!((nothing.pairs.len(), nothing.alone), (0, [vec![], vec![]]));
        assert_eq!(nothing.beyond, [vec![0, 1], vec![]]);
        assert!(match_spectra(&[f64::NAN], &[1.0], 0.0).pairs.is_empty());
    }
}
