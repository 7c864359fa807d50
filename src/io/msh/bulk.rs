//! Many rows of binary numbers at once, on all cores: what large files consist of.

use rayon::prelude::*;

use super::builder::Lookup;
use crate::io::scan::Numbers;

/// Rows that one thread takes in one go.
const ROWS: usize = 1 << 12;

/// A whole number that files store.
pub trait Word: Copy + Send + Sync {
    /// The number; what is negative becomes a number that nothing has.
    fn number(self, numbers: Numbers) -> u64;
}

impl Word for [u8; 4] {
    #[inline]
    fn number(self, numbers: Numbers) -> u64 {
        i64::from(signed(self, numbers)) as u64
    }
}

impl Word for [u8; 8] {
    #[inline]
    fn number(self, numbers: Numbers) -> u64 {
        match numbers {
            Numbers::Big => u64::from_be_bytes(self),
            _ => u64::from_le_bytes(self),
        }
    }
}

/// A whole number of 32 bits.
#[inline]
pub fn signed(word: [u8; 4], numbers: Numbers) -> i32 {
    match numbers {
        Numbers::Big => i32::from_be_bytes(word),
        _ => i32::from_le_bytes(word),
    }
}

/// Coordinates, which may be anything.
#[inline]
pub fn coordinates(words: [[u8; 8]; 3], numbers: Numbers) -> [f64; 3] {
    words.map(|word| f64::from_bits(word.number(numbers)))
}

/// The first word of each row of `width`.
pub fn first_words<W: Word>(words: &[W], width: usize, numbers: Numbers) -> Vec<u64> {
    let rows = words.par_chunks_exact(width).with_min_len(ROWS);
    rows.map(|row| row.first().map_or(0, |word| word.number(numbers)))
        .collect()
}

/// The points of the nodes in rows of `width` words, which come after `head` others; the place of a word that is no
/// node, otherwise.
pub fn nodes<W: Word>(
    words: &[W],
    width: usize,
    head: usize,
    points: &Lookup,
    numbers: Numbers,
) -> Result<Vec<u32>, usize> {
    let node_count = width - head;
    let mut nodes = vec![0; words.len() / width * node_count];
    let chunks = nodes.par_chunks_mut(ROWS * node_count);
    let chunks = chunks.zip(words.par_chunks(ROWS * width)).enumerate();
    let unknown = chunks.map(|(chunk, (nodes, words))| {
        let rows = nodes.chunks_exact_mut(node_count);
        for (row, (nodes, words)) in rows.zip(words.chunks_exact(width)).enumerate() {
            for (place, (node, word)) in nodes.iter_mut().zip(&words[head..]).enumerate() {
                match points.get(word.number(numbers)) {
                    Some(point) => *node = point,
                    None => return Some((chunk * ROWS + row) * width + head + place),
                }
            }
        }
        None
    });
    match unknown.find_first(Option::is_some).flatten() {
        Some(place) => Err(place),
        None => Ok(nodes),
    }
}
