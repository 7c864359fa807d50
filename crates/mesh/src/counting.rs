//! Counting sort on all cores.

use crate::parallel;

/// Fewest keys that a task sorts by, and fewest entries that one writes.
const TASK: usize = 1 << 12;

/// The places of the keys below `count`, sorted by key and otherwise ascending, and where those of each key start. Other
/// keys are left out. There are fewer than 2³² keys.
///
/// ```
/// let (starts, places) = faceoff_mesh::counting::sort_by_key(&[2, 0, u32::MAX, 2, 0], 3);
/// assert_eq!(starts, [0, 2, 2, 4]);
/// assert_eq!(places, [1, 4, 0, 3]);
/// ```
pub fn sort_by_key(keys: &[u32], count: usize) -> (Vec<usize>, Vec<u32>) {
    // A task looks at all places, for some of the keys: so they stay in their order, whatever the number of tasks.
    let some = count
        .div_ceil(rayon::current_num_threads().min(8))
        .max(TASK);
    let of_task = |task: usize, key: u32| (key as usize).wrapping_sub(task * some);
    let (mut starts, mut next) = (vec![0; count + 1], vec![0; count]);
    parallel::map(next.chunks_mut(some).enumerate(), |(task, counts)| {
        for &key in keys {
            if let Some(count) = counts.get_mut(of_task(task, key)) {
                *count += 1;
            }
        }
    });
    for (key, next) in next.iter_mut().enumerate() {
        starts[key + 1] = starts[key] + std::mem::replace(next, starts[key]);
    }
    let mut places = vec![0; starts[count]];
    let mut rest = &mut places[..];
    let tasks = next.chunks_mut(some).enumerate().map(|(task, next)| {
        let first = starts[task * some];
        let length = starts[task * some + next.len()] - first;
        let (own, others) = std::mem::take(&mut rest).split_at_mut(length);
        rest = others;
        (task, first, next, own)
    });
    parallel::map(tasks, |(task, first, next, own)| {
        for (place, &key) in (0..).zip(keys) {
            if let Some(slot) = next.get_mut(of_task(task, key)) {
                own[*slot - first] = place;
                *slot += 1;
            }
        }
    });
    (starts, places)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against a stable sort, with fewer and more keys than one task has.
    #[test]
    fn places_are_sorted_by_key_and_stay_in_their_order() {
        for count in [0, 1, 7, 3 * TASK + 5] {
            let keys: Vec<u32> = (0..20_000_u32)
                .map(|k| k.wrapping_mul(2_654_435_761) % (count as u32 + 3))
                .collect();
            let mut sorted: Vec<u32> = (0..keys.len() as u32).collect();
            sorted.retain(|&k| (keys[k as usize] as usize) < count);
            sorted.sort_by_key(|&k| keys[k as usize]);
            let (starts, places) = sort_by_key(&keys, count);
            assert_eq!(places, sorted);
            for key in 0..count {
                let own = &places[starts[key]..starts[key + 1]];
                assert!(own.iter().all(|&k| keys[k as usize] as usize == key));
            }
            assert_eq!(starts[count], places.len());
        }
    }
}
