//! Conversion of rows on all cores; large binary files consist of rows.

use rayon::prelude::*;

/// Rows that one thread converts at a time.
const SHARE: usize = 1 << 12;

/// Converts the rows of `from` to those of `to`, given with the number of items in a row. `share` gets the index of its
/// first row, and `both` combines what it returns; `None` if there are no rows.
pub fn convert<S: Sync, T: Send, A: Send>(
    (from, from_row): (&[S], usize),
    (to, to_row): (&mut [T], usize),
    share: impl Fn(usize, &[S], &mut [T]) -> A + Sync,
    both: impl Fn(A, A) -> A + Sync + Send,
) -> Option<A> {
    // A few rows take less time than waking the other cores.
    if from.len() <= SHARE * from_row {
        return (!from.is_empty()).then(|| share(0, from, to));
    }
    let from = from.par_chunks(SHARE * from_row);
    let to = to.par_chunks_mut(SHARE * to_row);
    let shares = from.zip(to).enumerate();
    let answers = shares.map(|(index, (from, to))| share(index * SHARE, from, to));
    answers.reduce_with(both)
}

/// Appends `new`, without copying if `all` is empty.
pub fn append<T>(all: &mut Vec<T>, mut new: Vec<T>) {
    if all.is_empty() {
        *all = new;
    } else {
        all.append(&mut new);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_is_made_once_in_its_place() {
        for rows in [0, 1, SHARE, SHARE + 1, 3 * SHARE + 5] {
            let from: Vec<usize> = (0..2 * rows).collect();
            let mut to = vec![0; 3 * rows];
            let made = convert(
                (&from, 2),
                (&mut to, 3),
                |first, from, to| {
                    for ((row, from), to) in (first..).zip(from.chunks(2)).zip(to.chunks_mut(3)) {
                        to.copy_from_slice(&[from[0], from[1], row]);
                    }
                    to.len() / 3
                },
                |a, b| a + b,
            );
            assert_eq!(made.unwrap_or(0), rows);
            let expected = (0..rows).flat_map(|row| [2 * row, 2 * row + 1, row]);
            assert!(to.into_iter().eq(expected));
        }
    }
}
