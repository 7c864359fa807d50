//! PETSc's binary files, as `-ksp_view_mat binary:A.bin` and `-ksp_view_rhs binary:b.bin` write them: one matrix by rows, or one vector, big-endian, with
//! indices of 32 bits and real numbers of 64.
//!
//! Specification: the pages of MatLoad and VecLoad in PETSc's manual.

use std::path::Path;

use super::market::Coordinates;
use super::scalar::Scalar;
use super::scan::{Numbers, Scan};
use crate::cancel;
use crate::error::Result;

const MATRIX: i32 = 1_211_216;
const VECTOR: i32 = 1_211_214;

const REMEDY: &str =
    "let PETSc with real numbers and indices of 32 bits write it, or write it as Matrix Market";

/// Does a file begin as one of PETSc does?
pub fn is_here(data: &[u8]) -> bool {
    let first = data.first_chunk().map(|bytes| i32::from_be_bytes(*bytes));
    matches!(first, Some(MATRIX | VECTOR))
}

/// The entries of a matrix, or those of a vector as one column.
///
/// # Errors
/// Fewer or more bytes than are declared, places outside of the matrix, entries that are not finite; [`crate::Error::Ended`].
pub fn matrix(path: &Path, data: &[u8]) -> Result<Coordinates> {
    let mut scan = Scan::new(path, data);
    scan.numbers = Numbers::Big;
    let kind = scan.i32()?;
    let rows = count(&mut scan, "rows")?;
    if kind == VECTOR {
        let values = reals(&mut scan, rows)?;
        end(&scan)?;
        let entries = (0..).zip(values).map(|(row, value)| (row, 0, value));
        return Ok(Coordinates {
            rows,
            columns: 1,
            entries: entries.collect(),
        });
    }
    let columns = count(&mut scan, "columns")?;
    // A dense matrix declares -1.
    let count = count(&mut scan, "entries")?;
    let lengths: Vec<u32> = numbers(&mut scan, rows, "lengths of rows")?.collect();
    let places = numbers::<u32>(&mut scan, count, "columns of entries")?;
    let values = reals(&mut scan, count)?;
    end(&scan)?;
    if lengths.iter().map(|&length| u64::from(length)).sum::<u64>() != count as u64 {
        let what = format!("its rows do not have {count} entries together");
        return Err(scan.error_with(what, REMEDY));
    }
    let mut entries = Vec::with_capacity(count);
    let mut rest = places.zip(values);
    for (row, length) in (0..).zip(lengths) {
        if row % 65536 == 0 {
            cancel::check()?;
        }
        for (column, value) in rest.by_ref().take(length as usize) {
            if column as usize >= columns {
                let what = format!("row {row} has an entry in column {column} of {columns}");
                return Err(scan.error_with(what, REMEDY));
            }
            entries.push((row, column, value));
        }
    }
    Ok(Coordinates {
        rows,
        columns,
        entries,
    })
}

fn count(scan: &mut Scan<'_>, of: &str) -> Result<usize> {
    let number = scan.i32()?;
    let negative = |_| scan.error_with(format!("the number of {of} is {number}"), REMEDY);
    usize::try_from(number).map_err(negative)
}

fn numbers<'a, T: Scalar + 'a>(
    scan: &mut Scan<'a>,
    count: usize,
    of: &str,
) -> Result<impl Iterator<Item = T> + use<'a, T>> {
    let count = scan.believe(count as u64, of, T::WIDTH)?;
    Ok(T::each(scan.bytes(count, T::WIDTH)?, true))
}

fn reals(scan: &mut Scan<'_>, count: usize) -> Result<Vec<f64>> {
    let values: Vec<f64> = numbers(scan, count, "real numbers")?.collect();
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(values),
        Some(k) => {
            let what = format!("entry {k} is {}, which is not finite", values[k]);
            Err(scan.error_with(what, REMEDY))
        }
    }
}

fn end(scan: &Scan<'_>) -> Result<()> {
    match scan.rest().len() {
        0 => Ok(()),
        more => Err(scan.error_with(
            format!("{more} bytes follow what is declared, as where a file holds several matrices or complex numbers"),
            REMEDY,
        )),
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
