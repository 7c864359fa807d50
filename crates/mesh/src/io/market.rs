//! Matrix Market: sparse matrices as coordinates, and vectors as arrays or coordinates.
//!
//! Specification: R. Boisvert, R. Pozo, K. Remington, The Matrix Market exchange formats, NISTIR 5935 (1996). Real and integer entries are read;
//! `symmetric` and `skew-symmetric` files hold the lower triangle, of which the upper one is made.

use std::path::Path;

use super::out::Out;
use super::petsc;
use super::scan::Scan;
use crate::cancel;
use crate::error::Result;
use crate::file;

/// Entries of a sparse matrix, in the order of the file; several of one place are to be added.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates {
    /// Rows of the matrix.
    pub rows: usize,
    /// Its columns.
    pub columns: usize,
    /// Row and column from 0, and the value.
    pub entries: Vec<(u32, u32, f64)>,
}

/// The declarations in the first line.
struct Header {
    is_array: bool,
    /// The sign of an entry above the diagonal that the file leaves out.
    mirrored: Option<f64>,
}

/// How to write what can be read.
const REMEDY: &str =
    "write it as `%%MatrixMarket matrix coordinate real general` (scipy.io.mmwrite does)";

/// Reads a sparse matrix, or one that PETSc wrote in binary.
///
/// # Errors
/// Another header, places outside of the matrix, entries that are not finite, fewer or more of them than declared; [`crate::Error::Ended`].
pub fn read_matrix(path: &Path) -> Result<Coordinates> {
    matrix(path, &file::read(path)?)
}

/// Reads a vector: an array or coordinates of one column, or of one row.
///
/// # Errors
/// As [`read_matrix`]; several columns.
pub fn read_vector(path: &Path) -> Result<Vec<f64>> {
    let data = file::read(path)?;
    let found = matrix(path, &data)?;
    let (rows, columns) = (found.rows, found.columns);
    if columns != 1 && rows != 1 {
        let what =
            format!("a vector has one column, and this has {rows} rows and {columns} columns");
        return Err(Scan::new(path, &data).error_with(what, "write only the right-hand side"));
    }
    let mut all = vec![0.0; rows.max(columns)];
    for (row, column, value) in found.entries {
        all[row.max(column) as usize] += value;
    }
    Ok(all)
}

/// Writes a sparse matrix, with numbers that read back as they are.
///
/// # Errors
/// A file that cannot be written.
pub fn write_matrix(path: &Path, matrix: &Coordinates) -> Result<()> {
    let mut out = Out::to(path)?;
    out.text("%%MatrixMarket matrix coordinate real general\n");
    out.int(matrix.rows)
        .int(matrix.columns)
        .int(matrix.entries.len())
        .end();
    for (row, column, value) in &matrix.entries {
        out.int(row + 1).int(column + 1).float(*value).end();
    }
    out.save(path)
}

/// Writes a vector as an array.
///
/// # Errors
/// A file that cannot be written.
pub fn write_vector(path: &Path, vector: &[f64]) -> Result<()> {
    let mut out = Out::to(path)?;
    out.text("%%MatrixMarket matrix array real general\n");
    out.int(vector.len()).int(1).end();
    for value in vector {
        out.float(*value).end();
    }
    out.save(path)
}

fn matrix(path: &Path, data: &[u8]) -> Result<Coordinates> {
    if petsc::is_here(data) {
        return petsc::matrix(path, data);
    }
    let mut scan = Scan::with_comments(path, data, b'%');
    let header = header(&mut scan)?;
    let rows = size(&mut scan, "rows")?;
    let columns = size(&mut scan, "columns")?;
    match header.is_array {
        true => dense(&mut scan, &header, rows, columns),
        false => sparse(&mut scan, &header, rows, columns),
    }
}

fn header(scan: &mut Scan<'_>) -> Result<Header> {
    let start = scan.clone();
    let line = String::from_utf8_lossy(scan.line()).to_ascii_lowercase();
    let words: Vec<&str> = line.split_whitespace().collect();
    let ["%%matrixmarket", "matrix", layout, field, symmetry] = words[..] else {
        let what = "the first line is not a header of Matrix Market";
        return Err(start.error_with(what, REMEDY));
    };
    let is_array = match layout {
        "coordinate" => false,
        "array" => true,
        other => return Err(start.error_with(format!("the layout `{other}` is not known"), REMEDY)),
    };
    if !matches!(field, "real" | "integer" | "double") {
        return Err(start.error_with(format!("entries are `{field}`, and must be real"), REMEDY));
    }
    let mirrored = match symmetry {
        "general" => None,
        "symmetric" => Some(1.0),
        "skew-symmetric" => Some(-1.0),
        other => {
            return Err(start.error_with(format!("the symmetry `{other}` is not known"), REMEDY));
        }
    };
    Ok(Header { is_array, mirrored })
}

fn size(scan: &mut Scan<'_>, of: &str) -> Result<usize> {
    let size = scan.uint()?;
    match u32::try_from(size) {
        Ok(size) => Ok(size as usize),
        Err(_) => Err(scan.error(format!("{size} {of} are too many"))),
    }
}

fn sparse(
    scan: &mut Scan<'_>,
    header: &Header,
    rows: usize,
    columns: usize,
) -> Result<Coordinates> {
    // The shortest entry is `1 1 0` and the end of its line.
    let count = scan.count("entries", 6)?;
    let doubled = if header.mirrored.is_some() { 2 } else { 1 };
    let mut entries = Vec::with_capacity(count * doubled);
    for k in 0..count {
        if k % 65536 == 0 {
            cancel::check()?;
        }
        let row = index(scan, "row", rows)?;
        let column = index(scan, "column", columns)?;
        let value = finite(scan)?;
        entries.push((row, column, value));
        if let Some(sign) = header.mirrored.filter(|_| row != column) {
            entries.push((column, row, sign * value));
        }
    }
    ended(scan, count)?;
    Ok(Coordinates {
        rows,
        columns,
        entries,
    })
}

fn dense(scan: &mut Scan<'_>, header: &Header, rows: usize, columns: usize) -> Result<Coordinates> {
    if header.mirrored.is_some() {
        return Err(scan.error_with("an array must be `general`", REMEDY));
    }
    let count = scan.believe(rows as u64 * columns as u64, "entries", 2)?;
    let mut entries = Vec::with_capacity(count);
    for k in 0..count {
        if k % 65536 == 0 {
            cancel::check()?;
        }
        let (column, row) = (k / rows, k % rows);
        entries.push((row as u32, column as u32, finite(scan)?));
    }
    ended(scan, count)?;
    Ok(Coordinates {
        rows,
        columns,
        entries,
    })
}

/// A number from 1, counted from 0.
fn index(scan: &mut Scan<'_>, of: &str, count: usize) -> Result<u32> {
    let number = scan.uint()?;
    match number.checked_sub(1).filter(|k| *k < count as u64) {
        // The size was checked to be one of 32 bits.
        Some(k) => Ok(k as u32),
        None => Err(scan.error(format!("the {of} {number} is not one of 1 to {count}"))),
    }
}

fn finite(scan: &mut Scan<'_>) -> Result<f64> {
    let value = scan.any_f64()?;
    match value.is_finite() {
        true => Ok(value),
        false => Err(scan.error(format!("an entry is {value}, which is not finite"))),
    }
}

fn ended(scan: &mut Scan<'_>, count: usize) -> Result<()> {
    match scan.word() {
        None => Ok(()),
        Some(_) => Err(scan.error(format!(
            "there is more than the {count} entries that are declared"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Coordinates> {
        matrix("A.mtx".as_ref(), text.as_bytes())
    }

    #[test]
    fn a_symmetric_file_holds_the_lower_triangle() {
        let text = "%%MatrixMarket matrix coordinate real symmetric\n% a comment\n\n2 2 2\n1 1 2.5\n2 1 -1e0\n";
        let found = read(text).unwrap();
        assert_eq!(found.entries, [(0, 0, 2.5), (1, 0, -1.0), (0, 1, -1.0)]);
        let skew = read(
            &text
                .replace("symmetric", "skew-symmetric")
                .replace("1 1 2.5", "2 1 2.5"),
        );
        assert_eq!(skew.unwrap().entries[1], (0, 1, -2.5));
    }

    #[test]
    fn errors_name_the_line() {
        let head = "%%MatrixMarket matrix coordinate real general\n";
        for (text, told) in [
            ("2 2 1\n3 1 1.0\n", ":3: the row 3 is not one of 1 to 2"),
            ("2 2 1\n1 0 1.0\n", ":3: the column 0"),
            ("2 2 1\n1 1 nan\n", ":3: an entry is NaN"),
            (
                "2 2 1\n1 1 1\n2 2 2\n",
                ":4: there is more than the 1 entries",
            ),
            ("2 2 900000000\n1 1 1\n", ":2: "),
        ] {
            let error = read(&(head.to_owned() + text)).unwrap_err().to_string();
            assert!(error.contains(told), "{text:?}: {error}");
        }
        let complex = read("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n");
        assert!(
            complex
                .unwrap_err()
                .to_string()
                .contains(":1: entries are `complex`, and must be real")
        );
        assert!(
            read("1 1 1\n")
                .unwrap_err()
                .to_string()
                .contains(":1: the first line is not a header")
        );
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["A.mtx", "b.mtx"].map(|name| folder.path().join(name));
        let entries = vec![(0, 1, 0.1 + 0.2), (1, 0, -1e-300)];
        let matrix = Coordinates {
            rows: 2,
            columns: 2,
            entries,
        };
        write_matrix(&a, &matrix).unwrap();
        write_vector(&b, &[1.0 / 3.0, -2.0]).unwrap();
        assert_eq!(read_matrix(&a).unwrap(), matrix);
        assert_eq!(read_vector(&b).unwrap(), [1.0 / 3.0, -2.0]);
    }

    #[test]
    fn an_array_is_read_by_columns() {
        let found = read("%%MatrixMarket matrix array real general\n2 2\n1\n2\n3\n4\n").unwrap();
        assert_eq!(found.entries[1..3], [(1, 0, 2.0), (0, 1, 3.0)]);
    }
}
