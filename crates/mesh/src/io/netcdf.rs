//! netCDF: dimensions, variables of up to a few of them, and attributes. The classic formats (CDF-1, 2 and 5) are read here;
//! netCDF-4 is HDF5. The 64-bit offset format, CDF-2, is what is written.

mod header;
mod write;

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use header::Header;
pub use write::{Attribute, Writer};

use super::hdf5;
use super::raw::RawNumbers;
use super::scalar::Number;
use super::vtu::unpack::Unpacked;
use crate::error::{Error, Place, Result};
use crate::mesh::Values;

/// A file that is read.
pub struct File<'a> {
    path: &'a Path,
    held: Held<'a>,
    /// The variables whose values have been asked for.
    read: RefCell<HashSet<String>>,
}

enum Held<'a> {
    Classic(Classic<'a>),
    Hdf5(hdf5::Group),
}

struct Classic<'a> {
    bytes: &'a [u8],
    version: u8,
    dimensions: Vec<(String, usize)>,
    attributes: HashMap<String, Values>,
    variables: HashMap<String, Variable>,
    /// Bytes from one record to the next.
    record: usize,
}

struct Variable {
    shape: Vec<usize>,
    attributes: HashMap<String, Values>,
    number: Number,
    begin: usize,
    is_record: bool,
}

/// Whether these are the bytes of a classic file.
pub fn is_classic(bytes: &[u8]) -> bool {
    matches!(bytes, [b'C', b'D', b'F', 1 | 2 | 5, ..])
}

impl<'a> File<'a> {
    /// # Errors
    /// The header is damaged, or the data of a variable would reach beyond the end of the file.
    pub fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        let held = match is_classic(bytes) {
            true => Held::Classic(Header { path, bytes, at: 4 }.read()?),
            false => Held::Hdf5(hdf5::open(path, bytes)?),
        };
        Ok(File {
            path,
            held,
            read: RefCell::default(),
        })
    }

    pub fn refuse(&self, what: impl Into<String>) -> Error {
        refuse(self.path, Place::Whole, what)
    }

    /// The kind as named in the file.
    pub fn encoding(&self) -> String {
        match &self.held {
            Held::Classic(classic) => format!("netCDF CDF-{}", classic.version),
            Held::Hdf5(_) => "netCDF-4".into(),
        }
    }

    /// The names of the variables, and in netCDF-4 of the dimensions.
    pub fn names(&self) -> Result<Vec<String>> {
        let mut names: Vec<String> = match &self.held {
            Held::Classic(classic) => classic.variables.keys().cloned().collect(),
            Held::Hdf5(root) => root.names()?.1,
        };
        names.sort_unstable();
        Ok(names)
    }

    /// The names of the variables with values that have not been read.
    pub fn unread(&self) -> Result<Vec<String>> {
        let mut names = self.names()?;
        names.retain(|name| !self.read.borrow().contains(name));
        let mut unread = Vec::new();
        for name in names {
            // netCDF-4 has dimensions as data sets without values.
            let is_dimension = match &self.held {
                Held::Classic(_) => false,
                Held::Hdf5(root) => {
                    let about = root.data(&name)?.and_then(|data| data.text("NAME"));
                    about.is_some_and(|text| text.starts_with("This is a netCDF dimension but"))
                }
            };
            let is_empty = self.shape(&name)?.is_some_and(|shape| shape.contains(&0));
            if !is_dimension && !is_empty {
                unread.push(name);
            }
        }
        Ok(unread)
    }

    /// The links that lead out of the file or nowhere, with their targets.
    pub fn links(&self) -> Result<Vec<(String, String)>> {
        match &self.held {
            Held::Classic(_) => Ok(Vec::new()),
            Held::Hdf5(root) => root.links(),
        }
    }

    /// The length of a dimension.
    pub fn dimension(&self, name: &str) -> Result<Option<usize>> {
        match &self.held {
            Held::Classic(classic) => {
                let known = classic.dimensions.iter().find(|(known, _)| known == name);
                Ok(known.map(|(_, length)| *length))
            }
            Held::Hdf5(root) => Ok(root.data(name)?.map(|data| data.rows().0)),
        }
    }

    pub fn shape(&self, name: &str) -> Result<Option<Vec<usize>>> {
        match &self.held {
            Held::Classic(classic) => Ok(classic.variables.get(name).map(|v| v.shape.clone())),
            Held::Hdf5(root) => Ok(root.data(name)?.map(|data| data.shape())),
        }
    }

    /// All values of a variable, if there is one; characters are bytes.
    pub fn values(&self, name: &str) -> Result<Option<Values>> {
        Ok(self.raw(name, None)?.map(|numbers| numbers.values()))
    }

    /// [`File::values`] as binary64; none if there is no such variable.
    pub fn floats(&self, name: &str) -> Result<Vec<f64>> {
        Ok(self
            .values(name)?
            .map_or(Vec::new(), |values| values.to_f64()))
    }

    /// The values of a variable at one index of its first dimension.
    pub fn row(&self, name: &str, k: usize) -> Result<Option<Values>> {
        match self.shape(name)?.as_deref() {
            Some([rows, ..]) if k < *rows => {}
            _ => return Ok(None),
        }
        let row = self.raw(name, Some(k..k + 1))?;
        Ok(row.map(|numbers| numbers.values()))
    }

    /// The numbers of a variable as they lie in the file: all, or those at some indices of its first dimension.
    pub fn raw(&self, name: &str, rows: Option<Range<usize>>) -> Result<Option<RawNumbers<'_>>> {
        self.read.borrow_mut().insert(name.to_owned());
        match &self.held {
            Held::Classic(classic) => {
                let variable = classic.variables.get(name);
                let all = |v: &Variable| 0..v.shape.first().copied().unwrap_or(1);
                let of = |v| classic.rows(v, rows.unwrap_or_else(|| all(v)));
                variable.map(of).transpose()
            }
            Held::Hdf5(root) => root.data(name)?.map(|data| data.raw(rows)).transpose(),
        }
    }

    /// The texts of a variable whose last dimension is their length.
    pub fn texts(&self, name: &str) -> Result<Option<Vec<String>>> {
        let Some(shape) = self.shape(name)? else {
            return Ok(None);
        };
        let is_single = |v: &Values| matches!(v, Values::U8(_) | Values::I8(_));
        let Some(values) = self.values(name)?.filter(is_single) else {
            return Ok(None);
        };
        let bytes = match values {
            Values::U8(bytes) => bytes,
            other => other.to_f64().into_iter().map(|byte| byte as u8).collect(),
        };
        let width = shape.last().copied().unwrap_or(1);
        Ok(Some(bytes.chunks(width.max(1)).map(text_of).collect()))
    }

    /// The text of an attribute of a variable, or of the file.
    pub fn text(&self, variable: Option<&str>, name: &str) -> Result<Option<String>> {
        match &self.held {
            Held::Classic(classic) => {
                let attributes = match variable {
                    None => Some(&classic.attributes),
                    Some(variable) => classic.variables.get(variable).map(|v| &v.attributes),
                };
                let value = attributes.and_then(|all| all.get(name));
                Ok(value.and_then(|value| match value {
                    Values::U8(bytes) => Some(text_of(bytes)),
                    _ => None,
                }))
            }
            Held::Hdf5(root) => match variable {
                None => Ok(root.text(name)),
                Some(variable) => Ok(root.data(variable)?.and_then(|data| data.text(name))),
            },
        }
    }
}

impl<'a> Classic<'a> {
    /// Some rows of a variable, whose bytes have been found to be there.
    fn rows(&self, variable: &Variable, rows: Range<usize>) -> Result<RawNumbers<'a>> {
        crate::cancel::check()?;
        let count: usize = variable.shape.iter().skip(1).product();
        let size = count * variable.number.size();
        let part = |at: usize, length: usize| self.bytes.get(at..at + length).unwrap_or_default();
        let bytes = match variable.is_record {
            false => part(variable.begin + rows.start * size, rows.len() * size).into(),
            true => {
                let records = rows.map(|k| part(variable.begin + k * self.record, size));
                records.collect::<Vec<_>>().concat().into()
            }
        };
        Ok(numbers(variable.number, bytes))
    }
}

fn text_of(bytes: &[u8]) -> String {
    let end = memchr::memchr(0, bytes).unwrap_or(bytes.len());
    let text = bytes.split_at(end).0;
    String::from_utf8_lossy(text).trim_end().to_owned()
}

fn refuse(path: &Path, place: Place, what: impl Into<String>) -> Error {
    Error::file(
        path,
        place,
        what,
        "write the file again with the program it comes from",
    )
}

/// The type of numbers that netCDF has this number for; characters are bytes.
fn number_of(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 | 7 => Number::U8,
        3 => Number::I16,
        4 => Number::I32,
        5 => Number::F32,
        6 => Number::F64,
        8 => Number::U16,
        9 => Number::U32,
        10 => Number::I64,
        11 => Number::U64,
        _ => return None,
    })
}

fn numbers(number: Number, bytes: Unpacked<'_>) -> RawNumbers<'_> {
    RawNumbers {
        number,
        bytes,
        big_endian: true,
    }
}

/// The tag at the beginning of a list in the header; 0 if the list is absent.
const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;
const ATTRIBUTES: u32 = 12;

fn padding(count: usize) -> usize {
    count.next_multiple_of(4) - count
}
