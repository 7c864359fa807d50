//! Many rows of binary numbers at once, on all cores, as large files have them.

use crate::parallel;

use crate::io::builder::Lookup;
use crate::io::rows;
use crate::io::scan::Numbers;

/// An integer that files store.
pub trait Word: Copy + PartialEq + Send + Sync {
    /// The number; negative ones become numbers that no item has.
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

/// An integer of 32 bits.
#[inline]
pub fn signed(word: [u8; 4], numbers: Numbers) -> i32 {
    match numbers {
        Numbers::Big => i32::from_be_bytes(word),
        _ => i32::from_le_bytes(word),
    }
}

/// Unchecked coordinates, from rows in which they follow `head` bytes.
pub fn points(bytes: &[u8], head: usize, numbers: Numbers) -> Vec<[f64; 3]> {
    let row = head + 24;
    let mut points = vec![[0.0; 3]; bytes.len() / row];
    let convert = |_, bytes: &[u8], points: &mut [[f64; 3]]| {
        for (point, bytes) in points.iter_mut().zip(bytes.chunks_exact(row)) {
            let words = bytes.split_at(head).1.as_chunks::<8>().0;
            for (x, word) in point.iter_mut().zip(words) {
                *x = f64::from_bits(word.number(numbers));
            }
        }
    };
    rows::convert((bytes, row), (&mut points, 1), convert, |(), ()| ());
    points
}

/// The first word of each row of `width`.
pub fn first_words<W: Word>(words: &[W], width: usize, numbers: Numbers) -> Vec<u64> {
    let rows = words.chunks_exact(width);
    rows.map(|row| row.first().map_or(0, |word| word.number(numbers)))
        .collect()
}

/// Whether the first words of rows of `width` are `first`, `first + 1`, ….
pub fn count_on<W: Word>(words: &[W], width: usize, first: u64, numbers: Numbers) -> bool {
    const ROWS: usize = 1 << 14;
    let share = |(index, words): (usize, &[W])| {
        let expected = first.wrapping_add((index * ROWS) as u64)..;
        let rows = words.chunks_exact(width).zip(expected);
        rows.fold(true, |so_far, (row, expected)| {
            so_far & (row[0].number(numbers) == expected)
        })
    };
    if words.len() <= ROWS * width {
        return share((0, words));
    }
    let shares = words.chunks(ROWS * width).enumerate();
    parallel::map(shares, share).into_iter().all(|on| on)
}

/// Rows of elements.
pub struct Elements {
    /// The points of the nodes.
    pub nodes: Vec<u32>,
    /// Whether their numbers continue the sequence.
    pub count_on: bool,
    /// Whether all have the tags of the first.
    pub alike: bool,
}

/// Elements in rows of `width` words: number and tags, `head` words in all, then nodes. The error is the position of
/// a word that is not a node.
pub fn elements<W: Word>(
    words: &[W],
    width: usize,
    head: usize,
    points: &Lookup,
    expected: u64,
    numbers: Numbers,
) -> Result<Elements, usize> {
    let node_count = width - head;
    let mut nodes = vec![0; words.len() / width * node_count];
    let tags_of_first = words.get(1..head).unwrap_or_default();
    let share = |first: usize, words: &[W], nodes: &mut [u32]| {
        let (mut known, mut count_on, mut alike) = (true, true, true);
        let rows = words
            .chunks_exact(width)
            .zip(nodes.chunks_exact_mut(node_count));
        for ((row, nodes), expected) in rows.zip(expected.wrapping_add(first as u64)..) {
            let (head, row) = row.split_at(head);
            count_on &= head[0].number(numbers) == expected;
            alike &= head[1..] == *tags_of_first;
            // No early exit: it would cost more than it saves.
            match points {
                Lookup::Dense { first, count } => {
                    for (node, word) in nodes.iter_mut().zip(row) {
                        let point = word.number(numbers).wrapping_sub(*first);
                        known &= point < u64::from(*count);
                        *node = point as u32;
                    }
                }
                points => {
                    for (node, word) in nodes.iter_mut().zip(row) {
                        let point = points.get(word.number(numbers));
                        known &= point.is_some();
                        *node = point.unwrap_or(0);
                    }
                }
            }
        }
        (known, count_on, alike)
    };
    let (known, count_on, alike) =
        rows::convert((words, width), (&mut nodes, node_count), share, |a, b| {
            (a.0 & b.0, a.1 & b.1, a.2 & b.2)
        })
        .unwrap_or((true, true, true));
    if known {
        return Ok(Elements {
            nodes,
            count_on,
            alike,
        });
    }
    let is_node = |word: &W| points.get(word.number(numbers)).is_some();
    let mut rows = words.chunks_exact(width).enumerate();
    let place = rows.find_map(|(row, words)| {
        let unknown = words[head..].iter().position(|word| !is_node(word));
        unknown.map(|place| row * width + head + place)
    });
    Err(place.unwrap_or(0))
}
