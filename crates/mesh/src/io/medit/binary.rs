//! The frame of binary files that are written: meshes and values.

use crate::io::out::Out;

/// A binary file of version 3: binary64, integers of 32 bits, and 64 bits for where sections are.
pub struct Binary<'o> {
    pub out: &'o mut Out,
    at: u64,
}

impl<'o> Binary<'o> {
    pub fn new(out: &'o mut Out, dimension: usize) -> Self {
        let mut binary = Binary { out, at: 24 };
        binary.ints([1, 3, 3]);
        binary.out.append(&24u64.to_le_bytes());
        binary.ints([dimension as i32]);
        binary
    }

    /// Begins a section: its keyword, where the next one is, and the number of its rows, followed by a given number of bytes.
    pub fn begin(&mut self, keyword: i32, count: usize, bytes: usize) {
        self.at += 16 + bytes as u64;
        self.ints([keyword]);
        self.out.append(&self.at.to_le_bytes());
        self.ints([count as i32]);
    }

    pub fn ints(&mut self, ints: impl IntoIterator<Item = i32>) {
        ints.into_iter()
            .for_each(|it| self.out.append(&it.to_le_bytes()));
    }

    pub fn end(mut self) {
        self.ints([54]);
        self.out.append(&0u64.to_le_bytes());
    }
}
