//! Room for numbers, of which the system gives each page when it is first used.

use std::sync::Mutex;

use faceoff_mesh::parallel;

/// Zeros that all cores have written. With only `vec![0.0; n]`, the first user requests the pages, and twice where it
/// reads before it writes: each then interrupts all cores.
pub fn zeros(count: usize) -> Vec<f64> {
    let mut zeros = vec![0.0; count];
    clear(&mut zeros);
    zeros
}

/// x := 0 on all cores.
pub fn clear(x: &mut [f64]) {
    parallel::map(x.chunks_mut(1 << 14), |x| x.fill(0.0));
}

/// Buffers that wait to be used again, by all threads.
///
/// A front's room is large and short-lived. Asked of the system anew each time, most of a
/// factorisation's time would go into pages that the system clears, and takes away from all threads.
pub(super) struct Pool(Mutex<Vec<Vec<f64>>>);

impl Pool {
    pub fn new() -> Self {
        Pool(Mutex::new(Vec::new()))
    }

    /// Room for `count` numbers, which are anything: the smallest buffer that has it, or a new one in
    /// the place of the largest.
    pub fn take(&self, count: usize) -> Vec<f64> {
        match self.find(count) {
            Some(buffer) if buffer.len() >= count => buffer,
            too_small => {
                drop(too_small);
                vec![0.0; count]
            }
        }
    }

    pub fn give(&self, buffer: Vec<f64>) {
        if let Ok(mut buffers) = self.0.lock() {
            buffers.push(buffer);
        }
    }

    /// Lets go of what has no room for `count` numbers.
    pub fn forget_below(&self, count: usize) {
        if let Ok(mut buffers) = self.0.lock() {
            buffers.retain(|buffer| buffer.len() >= count);
        }
    }

    fn find(&self, count: usize) -> Option<Vec<f64>> {
        let mut buffers = self.0.lock().ok()?;
        let best = (0..buffers.len()).min_by_key(|&k| match buffers[k].len() {
            room if room >= count => (0, room),
            room => (1, usize::MAX - room),
        })?;
        Some(buffers.swap_remove(best))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cleared_is_zero_to_its_end() {
        let mut x = vec![1.0; 40_001];
        clear(&mut x);
        assert_eq!(x, zeros(40_001));
        assert!(x.iter().all(|x| *x == 0.0));
    }

    #[test]
    fn the_smallest_room_that_suffices_is_taken_and_the_largest_makes_way() {
        let pool = Pool::new();
        let rooms = [30, 10, 20].map(|count| pool.take(count));
        rooms.into_iter().for_each(|room| pool.give(room));
        assert_eq!(pool.take(15).len(), 20);
        assert_eq!(pool.take(40).len(), 40);
        assert_eq!(pool.take(1).len(), 10, "the room for 30 has made way");
        assert_eq!(pool.take(1).len(), 1);
        pool.give(vec![0.0; 7]);
        pool.forget_below(8);
        assert_eq!(pool.take(1).len(), 1, "the room for 7 is forgotten");
    }
}
