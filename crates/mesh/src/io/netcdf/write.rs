//! Writes netCDF-3 files.

use std::path::Path;

use super::{ATTRIBUTES, DIMENSIONS, VARIABLES, number_of, padding};
use crate::error::{Error, Result};
use crate::io::out::Out;
use crate::io::scalar::Number;

/// A file that is to be written.
#[derive(Default)]
pub struct Writer<'a> {
    dimensions: Vec<(String, usize)>,
    attributes: Vec<(String, Attribute)>,
    variables: Vec<New<'a>>,
    records: usize,
}

/// The value of an attribute.
pub enum Attribute {
    Text(String),
    Int(i32),
    Float(f32),
}

/// Fills bytes with the values of a record from a number on.
type Fill<'a> = Box<dyn Fn(usize, usize, &mut [u8]) + Sync + 'a>;

struct New<'a> {
    name: String,
    dimensions: Vec<usize>,
    number: Number,
    attributes: Vec<(String, Attribute)>,
    fill: Fill<'a>,
}

impl<'a> Writer<'a> {
    /// A dimension; the one of no length is that of the records.
    pub fn dimension(&mut self, name: &str, length: usize) {
        self.dimensions.push((name.to_owned(), length));
    }

    pub fn attribute(&mut self, name: &str, value: Attribute) {
        self.attributes.push((name.to_owned(), value));
    }

    pub fn records(&mut self, count: usize) {
        self.records = count;
    }

    /// A variable of these dimensions, which must be there. `fill` gets the record, the number of a first value in it, and
    /// zeros to fill with big-endian numbers.
    pub fn variable(
        &mut self,
        name: &str,
        dimensions: &[&str],
        number: Number,
        fill: impl Fn(usize, usize, &mut [u8]) + Sync + 'a,
    ) {
        let place = |name: &&str| self.dimensions.iter().position(|(known, _)| known == name);
        self.variables.push(New {
            name: name.to_owned(),
            dimensions: dimensions.iter().filter_map(place).collect(),
            number,
            attributes: Vec::new(),
            fill: Box::new(fill),
        });
    }

    /// Integers.
    pub fn integers(
        &mut self,
        name: &str,
        dimensions: &[&str],
        number: impl Fn(usize) -> i64 + Sync + 'a,
    ) {
        self.variable(name, dimensions, Number::I32, move |_, first, bytes| {
            for (bytes, k) in bytes.chunks_exact_mut(4).zip(first..) {
                bytes.copy_from_slice(&(number(k) as i32).to_be_bytes());
            }
        });
    }

    /// Floats, of each record.
    pub fn floats(
        &mut self,
        name: &str,
        dimensions: &[&str],
        number: impl Fn(usize, usize) -> f64 + Sync + 'a,
    ) {
        self.variable(
            name,
            dimensions,
            Number::F64,
            move |record, first, bytes| {
                for (bytes, k) in bytes.chunks_exact_mut(8).zip(first..) {
                    bytes.copy_from_slice(&number(record, k).to_be_bytes());
                }
            },
        );
    }

    /// Texts of `width` bytes, the length of the last dimension; longer ones are cut.
    pub fn texts(&mut self, name: &str, dimensions: &[&str], texts: Vec<String>, width: usize) {
        self.variable(name, dimensions, Number::U8, move |_, first, bytes| {
            for (byte, k) in bytes.iter_mut().zip(first..) {
                let text = texts
                    .get(k / width)
                    .map(String::as_bytes)
                    .unwrap_or_default();
                *byte = text.get(k % width).copied().unwrap_or(0);
            }
        });
    }

    /// An attribute of the variable that was added last.
    pub fn of_last(&mut self, name: &str, value: Attribute) {
        if let Some(last) = self.variables.last_mut() {
            last.attributes.push((name.to_owned(), value));
        }
    }

    fn count(&self, variable: &New<'_>) -> usize {
        let inner = variable.dimensions.iter().map(|&k| self.dimensions[k].1);
        inner.filter(|&n| n > 0).product()
    }

    fn is_record(&self, variable: &New<'_>) -> bool {
        variable
            .dimensions
            .first()
            .is_some_and(|&k| self.dimensions[k].1 == 0)
    }

    /// The bytes of a variable, or of one record of it, with their padding.
    fn size(&self, variable: &New<'_>) -> usize {
        let size = self.count(variable) * variable.number.size();
        size + padding(size)
    }

    fn header(&self, begins: &[u64]) -> Vec<u8> {
        let mut out = b"CDF\x02".to_vec();
        int(&mut out, self.records);
        list(&mut out, DIMENSIONS, self.dimensions.len());
        for (dimension, length) in &self.dimensions {
            name(&mut out, dimension);
            int(&mut out, *length);
        }
        attributes(&mut out, &self.attributes);
        list(&mut out, VARIABLES, self.variables.len());
        for (variable, begin) in self.variables.iter().zip(begins) {
            name(&mut out, &variable.name);
            int(&mut out, variable.dimensions.len());
            variable.dimensions.iter().for_each(|&k| int(&mut out, k));
            attributes(&mut out, &variable.attributes);
            let kind = (1..=11).find(|&kind| number_of(kind) == Some(variable.number));
            int(&mut out, kind.unwrap_or(0) as usize);
            int(&mut out, self.size(variable).min(u32::MAX as usize));
            out.extend(begin.to_be_bytes());
        }
        out
    }

    /// # Errors
    /// [`Error::Io`]; an old file is kept then.
    pub fn save(&self, path: &Path) -> Result<()> {
        let (records, fixed): (Vec<usize>, Vec<usize>) =
            (0..self.variables.len()).partition(|&k| self.is_record(&self.variables[k]));
        if let Some(large) = self
            .variables
            .iter()
            .find(|v| u32::try_from(self.size(v)).is_err())
        {
            let what = format!(
                "{} has more than 2^32 bytes, which netCDF's 64-bit offsets do not hold",
                large.name
            );
            return Err(Error::whole(path, what, "choose another format"));
        }
        let mut begins = vec![0; self.variables.len()];
        let mut at = self.header(&begins).len() as u64;
        for &k in fixed.iter().chain(&records) {
            begins[k] = at;
            at += self.size(&self.variables[k]) as u64;
        }
        let mut out = Out::to(path)?;
        out.expect(at as usize);
        out.append(&self.header(&begins));
        let mut write = |k: usize, record: usize| {
            let variable = &self.variables[k];
            let size = variable.number.size();
            let count = self.count(variable);
            out.rows(count, size, |first, bytes| {
                (variable.fill)(record, first, bytes)
            });
            out.append(&[0; 4][..padding(count * size)]);
        };
        fixed.iter().for_each(|&k| write(k, 0));
        for record in 0..self.records {
            records.iter().for_each(|&k| write(k, record));
        }
        out.save(path)
    }
}

fn int(out: &mut Vec<u8>, number: usize) {
    out.extend((number as u32).to_be_bytes());
}

fn list(out: &mut Vec<u8>, mark: u32, count: usize) {
    int(out, if count == 0 { 0 } else { mark as usize });
    int(out, count);
}

fn padded(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend(bytes);
    out.extend(&[0; 4][..padding(bytes.len())]);
}

fn name(out: &mut Vec<u8>, name: &str) {
    int(out, name.len());
    padded(out, name.as_bytes());
}

fn attributes(out: &mut Vec<u8>, attributes: &[(String, Attribute)]) {
    list(out, ATTRIBUTES, attributes.len());
    for (key, value) in attributes {
        name(out, key);
        let (kind, count, bytes) = match value {
            Attribute::Text(text) => (2, text.len(), text.as_bytes().to_vec()),
            Attribute::Int(number) => (4, 1, number.to_be_bytes().to_vec()),
            Attribute::Float(number) => (5, 1, number.to_be_bytes().to_vec()),
        };
        int(out, kind);
        int(out, count);
        padded(out, &bytes);
    }
}
