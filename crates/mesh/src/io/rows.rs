//! Conversion of rows on all cores; large binary files consist of rows.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::parallel;

/// Rows that one thread converts at a time.
const SHARE: usize = 1 << 12;

/// Converts the rows of `from` to those of `to`, given with the number of items in a row. `share` gets the index of its
/// first row, and `both` combines what it returns; `None` if there are no rows.
pub fn convert<S: Sync, T: Send, A: Send>(
    (from, from_row): (&[S], usize),
    (to, to_row): (&mut [T], usize),
    share: impl Fn(usize, &[S], &mut [T]) -> A + Sync,
    both: impl Fn(A, A) -> A,
) -> Option<A> {
    // A few rows take less time than waking the other cores.
    if from.len() <= SHARE * from_row {
        return (!from.is_empty()).then(|| share(0, from, to));
    }
    let from = from.chunks(SHARE * from_row);
    let to = to.chunks_mut(SHARE * to_row);
    let shares = from.zip(to).enumerate();
    let answers = parallel::map(shares, |(index, (from, to))| share(index * SHARE, from, to));
    answers.into_iter().reduce(both)
}

/// Items that are made on the stack at a time: whole rows of all but a few kinds of cells.
const ARRAY: usize = 720;

/// Appends rows of `width` items: `share` gets the index of a first row, and items to fill. Whether all answers were yes.
pub fn fill<T: Copy + Default + Send>(
    all: &mut Vec<T>,
    rows: usize,
    width: usize,
    share: impl Fn(usize, &mut [T]) -> bool + Sync,
) -> bool {
    fill_by(all, rows, width, &share)
}

/// [`fill`], of which the compiler makes one copy for each type.
fn fill_by<T: Copy + Default + Send>(
    all: &mut Vec<T>,
    rows: usize,
    width: usize,
    share: &(dyn Fn(usize, &mut [T]) -> bool + Sync),
) -> bool {
    if !all.is_empty() || rows * width <= ARRAY || !ARRAY.is_multiple_of(width) {
        let start = all.len();
        all.resize(start + rows * width, T::default());
        let new = all.split_at_mut(start).1;
        if rows <= SHARE {
            return share(0, new);
        }
        let shares = new.chunks_mut(SHARE * width).enumerate();
        let sound = parallel::map(shares, |(k, rows)| share(k * SHARE, rows));
        return sound.into_iter().all(|sound| sound);
    }
    // To fill all memory with zeros before takes as long as to read the numbers.
    let (sound, per) = (AtomicBool::new(true), ARRAY / width);
    let arrays = (0..rows.div_ceil(per)).into_par_iter().map(|k| {
        let mut array = [T::default(); ARRAY];
        let count = per.min(rows - k * per);
        if !share(k * per, &mut array[..count * width]) {
            sound.store(false, Ordering::Relaxed);
        }
        array
    });
    *all = arrays.collect::<Vec<_>>().into_flattened();
    all.truncate(rows * width);
    sound.into_inner()
}

/// Runs of equal rows of `width` items.
pub fn runs<T: PartialEq + Sync>(all: &[T], width: usize) -> Vec<Range<u32>> {
    let rows = all.len() / width;
    let row = move |k: usize| all.get(k * width..(k + 1) * width);
    // The rows of a share that another one comes before.
    let starts = |share: usize| {
        let (first, end) = (share * SHARE + 1, rows.min((share + 1) * SHARE + 1));
        // Most are like those before, which is seen at once.
        let same =
            all.get((first - 1) * width..(end - 1) * width) == all.get(first * width..end * width);
        let first = if same { end } else { first };
        (first..end).filter(move |&k| row(k - 1) != row(k))
    };
    let shares = rows.saturating_sub(1).div_ceil(SHARE);
    let starts: Vec<usize> = match shares {
        1 => starts(0).collect(),
        _ => parallel::map(0..shares, |share| starts(share).collect::<Vec<_>>()).concat(),
    };
    let first = (rows > 0).then_some(0);
    let starts = first.into_iter().chain(starts);
    let ends = starts.clone().skip(1).chain([rows]);
    starts
        .zip(ends)
        .map(|(start, end)| start as u32..end as u32)
        .collect()
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

    /// Of widths that make whole arrays or not, into a list that is empty or not; one share may refuse.
    #[test]
    fn rows_are_appended_in_order() {
        for (rows, width) in [(0, 3), (7, 13), (239, 3), (241, 3), (9000, 4), (9000, 13)] {
            for before in [0, 5] {
                let mut all: Vec<usize> = (0..before).collect();
                let made = |first: usize, items: &mut [usize]| {
                    let items = items.iter_mut().zip(before + first * width..);
                    items.for_each(|(item, k)| *item = k);
                    true
                };
                assert!(fill(&mut all, rows, width, made));
                assert!(
                    all.into_iter().eq(0..before + rows * width),
                    "{rows} {width}"
                );
                let odd = rows / 2;
                let holds = |first: usize, items: &mut [usize]| {
                    !(first..first + items.len() / width).contains(&odd)
                };
                assert_eq!(fill(&mut vec![0; before], rows, width, holds), rows == 0);
            }
        }
    }

    #[test]
    fn runs_are_those_of_each_row_beside_the_next() {
        for rows in [0, 1, 2, SHARE, SHARE + 1, SHARE + 2, 3 * SHARE + 5] {
            // One row is another in its second number; so are the ones where shares meet.
            for odd in [0, rows / 2, SHARE, SHARE + 1, rows.saturating_sub(1)] {
                let all: Vec<u8> = (0..rows)
                    .flat_map(|row| [7, u8::from(row == odd)])
                    .collect();
                let all_rows: Vec<&[u8]> = all.chunks(2).collect();
                let mut end = 0;
                let expected = all_rows.chunk_by(|a, b| a == b).map(|run| {
                    let start = end;
                    end += run.len() as u32;
                    start..end
                });
                assert!(runs(&all, 2).into_iter().eq(expected), "{rows} {odd}");
            }
        }
    }
}
