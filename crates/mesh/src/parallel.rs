//! Loops on all cores.
//!
//! Every loop goes through one function that takes its task by reference, so the scheduler is compiled once; a parallel iterator of
//! rayon compiles a dozen functions for each loop and type. The price is one indirect call and one lock per task, so a task should be
//! much more work than that.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// Tasks per core: enough that no core waits long for the last.
const TASKS: usize = 16;
/// Values per task of [`update`].
const CHUNK: usize = 1 << 13;

/// Applies `task` to every item, one task per item, and returns the results in the order of the items.
///
/// ```
/// let mut squares = [0; 5];
/// let sums = faceoff_mesh::parallel::map(squares.chunks_mut(2).enumerate(), |(k, squares)| {
///     squares.iter_mut().zip(2 * k..).for_each(|(square, i)| *square = i * i);
///     squares.iter().sum::<usize>()
/// });
/// assert_eq!((squares, sums), ([0, 1, 4, 9, 16], vec![1, 13, 16]));
/// ```
pub fn map<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    task: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let places: Vec<_> = items
        .into_iter()
        .map(|i| Mutex::new((Some(i), None)))
        .collect();
    run(places.len(), &|k| {
        // Nobody else asks for this place.
        let mut place = places[k].lock().unwrap_or_else(PoisonError::into_inner);
        place.1 = place.0.take().map(&task);
    });
    let made = places
        .into_iter()
        .map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner).1);
    made.flatten().collect()
}

/// Like [`map`], with scratch memory that a finished task passes on to a later one; at most one per core is made.
///
/// ```
/// let lengths = faceoff_mesh::parallel::map_with(String::new, [1, 2, 3], |text, k| {
///     text.clear();
///     text.extend(std::iter::repeat_n('x', k));
///     text.len()
/// });
/// assert_eq!(lengths, [1, 2, 3]);
/// ```
pub fn map_with<S: Send, I: Send, T: Send>(
    scratch: impl Fn() -> S + Sync,
    items: impl IntoIterator<Item = I>,
    task: impl Fn(&mut S, I) -> T + Sync,
) -> Vec<T> {
    let spare = Mutex::new(Vec::new());
    let spare = || spare.lock().unwrap_or_else(PoisonError::into_inner);
    map(items, |item| {
        let used = spare().pop();
        let mut own = used.unwrap_or_else(&scratch);
        let made = task(&mut own, item);
        spare().push(own);
        made
    })
}

/// Returns `of(0)`, `of(1)`, …, `of(count - 1)`, many per task.
///
/// ```
/// assert_eq!(faceoff_mesh::parallel::collect(4, |k| k * k), [0, 1, 4, 9]);
/// ```
pub fn collect<T: Send>(count: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    chunks(count, share(count), |chunk| chunk.map(&of).collect())
}

/// The number of tasks that run at the same time.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// The number of items per task that keeps all cores busy with `count` items of equal work; at least 1.
pub fn share(count: usize) -> usize {
    count.div_ceil(TASKS * rayon::current_num_threads()).max(1)
}

/// Applies `of` to consecutive ranges of `size` indices below `count`, one task per range, and joins the results in order.
///
/// ```
/// let odd = |chunk: std::ops::Range<usize>| chunk.filter(|k| k % 2 == 1).collect();
/// assert_eq!(faceoff_mesh::parallel::chunks(8, 3, odd), [1, 3, 5, 7]);
/// ```
pub fn chunks<T: Send>(
    count: usize,
    size: usize,
    of: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let size = size.max(1);
    let firsts = (0..count).step_by(size);
    let made = map(firsts, |first| of(first..count.min(first + size)));
    let mut all = Vec::with_capacity(made.iter().map(Vec::len).sum());
    made.into_iter().for_each(|made| all.extend(made));
    all
}

/// Replaces every value v, at place k, by `of(k, v)`.
///
/// ```
/// let mut values = [1, 1, 1];
/// faceoff_mesh::parallel::update(&mut values, |k, value| value + 2 * k);
/// assert_eq!(values, [1, 3, 5]);
/// ```
pub fn update<T: Copy + Send>(values: &mut [T], of: impl Fn(usize, T) -> T + Sync) {
    map(values.chunks_mut(CHUNK).enumerate(), |(k, values)| {
        for (place, value) in (k * CHUNK..).zip(values) {
            *value = of(place, *value);
        }
    });
}

/// Calls `task` with 0, 1, …, `count` - 1.
fn run(count: usize, task: &(dyn Fn(usize) + Sync)) {
    match count {
        0 => {}
        1 => task(0),
        _ => (0..count).into_par_iter().for_each(task),
    }
}
