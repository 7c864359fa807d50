//! PETSc's binary files, as `-ksp_view_mat binary:A.bin` and `-ksp_view_rhs binary:b.bin` write them: one matrix by rows, or one vector, big-endian, with
//! indices of 32 bits and real numbers of 64.
//!
//! Specification: the pages of MatLoad and VecLoad in PETSc's manual.

use std::path::Path;

use super::market::Coordinates;
use crate::cancel;
use crate::error::{Error, Place, Result};

const MATRIX: i32 = 1_211_216;
const VECTOR: i32 = 1_211_214;

const REMEDY: &str =
    "let PETSc with real numbers and indices of 32 bits write it, or write it as Matrix Market";

/// Does a file begin as one of PETSc does?
pub fn is_here(data: &[u8]) -> bool {
    let first = data.first_chunk().map(|bytes| i32::from_be_bytes(*bytes));
    matches!(first, Some(MATRIX | VECTOR))
}

/// Bytes that are taken from the front.
struct Bytes<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

/// The entries of a matrix, or those of a vector as one column.
///
/// # Errors
/// Fewer or more bytes than are declared, places outside of the matrix, entries that are not finite; [`Error::Ended`].
pub fn matrix(path: &Path, data: &[u8]) -> Result<Coordinates> {
    let mut bytes = Bytes { path, rest: data };
    let kind = bytes.count("its kind")?;
    let rows = bytes.count("rows")?;
    if kind as i32 == VECTOR {
        let values = bytes.reals(rows)?;
        bytes.end()?;
        let entries = (0..).zip(values).map(|(row, value)| (row, 0, value));
        return Ok(Coordinates {
            rows,
            columns: 1,
            entries: entries.collect(),
        });
    }
    let columns = bytes.count("columns")?;
    // A dense matrix declares -1.
    let count = bytes.count("entries")?;
    let lengths = bytes.whole(rows)?;
    let places = bytes.whole(count)?;
    let values = bytes.reals(count)?;
    bytes.end()?;
    if lengths.iter().sum::<u64>() != count as u64 {
        return Err(bytes.error(format!("its rows do not have {count} entries together")));
    }
    let mut entries = Vec::with_capacity(count);
    let mut rest = places.iter().zip(values);
    for (row, length) in (0..).zip(lengths) {
        if row % 65536 == 0 {
            cancel::check()?;
        }
        for (column, value) in rest.by_ref().take(length as usize) {
            if *column >= columns as u64 {
                let what = format!("row {row} has an entry in column {column} of {columns}");
                return Err(bytes.error(what));
            }
            // Columns are of 31 bits.
            entries.push((row, *column as u32, value));
        }
    }
    Ok(Coordinates {
        rows,
        columns,
        entries,
    })
}

impl<'a> Bytes<'a> {
    fn error(&self, what: String) -> Error {
        Error::File {
            path: self.path.to_owned(),
            place: Place::Whole,
            what,
            remedy: REMEDY.into(),
        }
    }

    /// `count` items of `bytes` bytes each.
    fn take(&mut self, count: usize, bytes: usize, of: &str) -> Result<&'a [u8]> {
        let length = count.checked_mul(bytes);
        let Some((found, rest)) = length.and_then(|length| self.rest.split_at_checked(length))
        else {
            let what = format!(
                "{count} {of} are declared, but the {} bytes that follow cannot hold them",
                self.rest.len()
            );
            return Err(self.error(what));
        };
        self.rest = rest;
        Ok(found)
    }

    fn count(&mut self, of: &str) -> Result<usize> {
        let number = self
            .take(1, 4, of)?
            .iter()
            .fold(0u32, |n, byte| n << 8 | u32::from(*byte));
        // Indices have a sign, and a negative count is none.
        usize::try_from(number as i32)
            .map_err(|_| self.error(format!("the number of {of} is {}", number as i32)))
    }

    fn whole(&mut self, count: usize) -> Result<Vec<u64>> {
        let found = self.take(count, 4, "whole numbers")?.chunks_exact(4);
        let each = found.map(|bytes| bytes.iter().fold(0, |n, byte| n << 8 | u64::from(*byte)));
        Ok(each.collect())
    }

    fn reals(&mut self, count: usize) -> Result<Vec<f64>> {
        let found = self.take(count, 8, "real numbers")?.chunks_exact(8);
        let each = found.map(|bytes| bytes.iter().fold(0, |n, byte| n << 8 | u64::from(*byte)));
        let values: Vec<f64> = each.map(f64::from_bits).collect();
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(k) => Err(self.error(format!("entry {k} is {}, which is not finite", values[k]))),
        }
    }

    fn end(&self) -> Result<()> {
        match self.rest.len() {
            0 => Ok(()),
            more => Err(self.error(format!(
                "{more} bytes follow what is declared, as where a file holds several matrices or complex numbers"
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes that PETSc 3.18 writes for the matrix (2 -1; 0 4).
    fn two() -> Vec<u8> {
        let whole = [MATRIX, 2, 2, 3, 2, 1, 0, 1, 1];
        let reals = [2.0, -1.0, 4.0];
        let whole = whole.iter().flat_map(|n: &i32| n.to_be_bytes());
        whole
            .chain(reals.iter().flat_map(|x: &f64| x.to_be_bytes()))
            .collect()
    }

    fn read(data: &[u8]) -> Result<Coordinates> {
        matrix("A.bin".as_ref(), data)
    }

    #[test]
    fn rows_are_read() {
        let found = read(&two()).unwrap();
        assert_eq!((found.rows, found.columns), (2, 2));
        assert_eq!(found.entries, [(0, 0, 2.0), (0, 1, -1.0), (1, 1, 4.0)]);
    }

    #[test]
    fn nothing_that_is_declared_is_believed() {
        for (at, bytes, told) in [
            (7, &[200][..], "cannot hold them"),
            (12, &[255], "the number of entries is -"),
            (15, &[2], "bytes follow"),
            (19, &[3], "do not have 3 entries together"),
            (27, &[9], "column 9 of 2"),
            (36, &[127, 248], "not finite"),
        ] {
            let mut data = two();
            data[at..at + bytes.len()].copy_from_slice(bytes);
            let error = read(&data).unwrap_err().to_string();
            assert!(error.contains(told), "{at}: {error}");
        }
        for length in 4..two().len() {
            assert!(read(&two()[..length]).is_err(), "{length}");
        }
    }
}
