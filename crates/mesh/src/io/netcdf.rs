//! netCDF: dimensions, variables of up to a few of them, and attributes. The classic formats (CDF-1, 2 and 5) are read here;
//! netCDF-4 is HDF5. The 64-bit offset format, CDF-2, is what is written.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use super::hdf5;
use super::out::Out;
use super::vtu::array::RawNumbers;
use super::vtu::unpack::Unpacked;
use crate::error::{Error, Place, Result};
use crate::mesh::Values;

/// A file that is read.
pub struct File<'a> {
    path: &'a Path,
    held: Held<'a>,
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
    kind: u32,
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
        Ok(File { path, held })
    }

    pub fn refuse(&self, what: impl Into<String>) -> Error {
        refuse(self.path, Place::Whole, what)
    }

    /// What the file calls its kind.
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
        let size = count * size_of(variable.kind);
        let part = |at: usize, length: usize| self.bytes.get(at..at + length).unwrap_or_default();
        let bytes = match variable.is_record {
            false => part(variable.begin + rows.start * size, rows.len() * size).into(),
            true => {
                let records = rows.map(|k| part(variable.begin + k * self.record, size));
                records.collect::<Vec<_>>().concat().into()
            }
        };
        Ok(numbers(variable.kind, bytes))
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

/// Bytes of a value of a type of netCDF; 0 for one that is unknown.
fn size_of(kind: u32) -> usize {
    match kind {
        1 | 2 | 7 => 1,
        3 | 8 => 2,
        4 | 5 | 9 => 4,
        6 | 10 | 11 => 8,
        _ => 0,
    }
}

/// Numbers of a type that is known; characters are bytes.
fn numbers(kind: u32, bytes: Unpacked<'_>) -> RawNumbers<'_> {
    let type_name = match kind {
        1 => "Int8",
        3 => "Int16",
        4 => "Int32",
        5 => "Float32",
        6 => "Float64",
        8 => "UInt16",
        9 => "UInt32",
        10 => "Int64",
        11 => "UInt64",
        _ => "UInt8",
    };
    RawNumbers {
        type_name,
        bytes,
        big_endian: true,
    }
}

/// The header of a classic file.
struct Header<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

/// What begins a list of the header, which is absent where there is 0.
const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;
const ATTRIBUTES: u32 = 12;

impl<'a> Header<'a> {
    fn error(&self, what: impl Into<String>) -> Error {
        refuse(
            self.path,
            Place::SectionByte("netCDF header".into(), self.at as u64),
            what,
        )
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let end = self.at.checked_add(count);
        let found = end.and_then(|end| self.bytes.get(self.at..end));
        let found = found.ok_or_else(|| self.error("the header ends too early"))?;
        self.at += count;
        Ok(found)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(self
            .take(4)?
            .iter()
            .fold(0, |all, &byte| all << 8 | u32::from(byte)))
    }

    fn u64(&mut self) -> Result<u64> {
        Ok(u64::from(self.u32()?) << 32 | u64::from(self.u32()?))
    }

    /// A number of things, which CDF-5 has in 64 bits.
    fn count(&mut self) -> Result<usize> {
        let count = if self.version() == 5 {
            self.u64()?
        } else {
            self.u32()?.into()
        };
        usize::try_from(count).map_err(|_| self.error(format!("{count} is too many")))
    }

    fn version(&self) -> u8 {
        self.bytes.get(3).copied().unwrap_or(1)
    }

    fn padded(&mut self, count: usize) -> Result<&'a [u8]> {
        let bytes = self.take(count)?;
        self.take(padding(count))?;
        Ok(bytes)
    }

    fn name(&mut self) -> Result<String> {
        let length = self.count()?;
        Ok(text_of(self.padded(length)?))
    }

    /// The length of a list that begins with this mark, none of whose items takes less than `least` bytes.
    fn list(&mut self, mark: u32, least: usize) -> Result<usize> {
        let found = self.u32()?;
        let count = self.count()?;
        if found != mark && (found, count) != (0, 0) {
            return Err(self.error(format!("there is {found} where a list begins with {mark}")));
        }
        if count.saturating_mul(least) > self.bytes.len() - self.at {
            return Err(self.error(format!(
                "{count} entries are more than the file has bytes for"
            )));
        }
        Ok(count)
    }

    fn kind(&mut self) -> Result<u32> {
        let kind = self.u32()?;
        match size_of(kind) {
            0 => Err(self.error(format!("netCDF has no type {kind}"))),
            _ => Ok(kind),
        }
    }

    fn attributes(&mut self) -> Result<HashMap<String, Values>> {
        let mut attributes = HashMap::new();
        for _ in 0..self.list(ATTRIBUTES, 12)? {
            let name = self.name()?;
            let kind = self.kind()?;
            let bytes = self.count()?.saturating_mul(size_of(kind));
            attributes.insert(name, numbers(kind, self.padded(bytes)?.into()).values());
        }
        Ok(attributes)
    }

    fn read(mut self) -> Result<Classic<'a>> {
        let version = self.version();
        let records = self.count()?;
        let mut dimensions = Vec::new();
        for _ in 0..self.list(DIMENSIONS, 8)? {
            dimensions.push((self.name()?, self.count()?));
        }
        let attributes = self.attributes()?;
        let mut variables = Vec::new();
        for _ in 0..self.list(VARIABLES, 28)? {
            variables.push(self.variable(&dimensions)?);
        }
        let sizes = variables.iter().filter(|(_, v)| v.is_record).map(|(_, v)| {
            let inner = v
                .shape
                .iter()
                .skip(1)
                .try_fold(size_of(v.kind), |all, &n| all.checked_mul(n));
            inner.filter(|&size| size <= self.bytes.len())
        });
        let too_large = || self.error("a record is larger than the file");
        let sizes = sizes
            .collect::<Option<Vec<usize>>>()
            .ok_or_else(too_large)?;
        let record = match sizes[..] {
            [one] => one,
            _ => sizes.iter().map(|&size| size + padding(size)).sum(),
        };
        // A program that is still writing does not know the number of records.
        let streaming = if version == 5 {
            u64::MAX
        } else {
            u32::MAX.into()
        };
        let first = variables
            .iter()
            .filter(|(_, v)| v.is_record)
            .map(|(_, v)| v.begin)
            .min();
        let records = match first {
            Some(first) if records as u64 == streaming && record > 0 => {
                self.bytes.len().saturating_sub(first) / record
            }
            _ => records,
        };
        let mut total = 0_usize;
        for (name, variable) in &mut variables {
            if variable.is_record {
                variable.shape[0] = records;
            }
            total = total.saturating_add(self.check(name, variable, record)?);
        }
        if total > self.bytes.len() {
            return Err(self.error("its variables together are larger than the file"));
        }
        for (_, length) in dimensions.iter_mut().filter(|(_, length)| *length == 0) {
            *length = records;
        }
        Ok(Classic {
            bytes: self.bytes,
            version,
            dimensions,
            attributes,
            variables: variables.into_iter().collect(),
            record,
        })
    }

    fn variable(&mut self, dimensions: &[(String, usize)]) -> Result<(String, Variable)> {
        let name = self.name()?;
        let rank = self.count()?;
        if rank > self.bytes.len() {
            return Err(self.error(format!("the variable {name} has {rank} dimensions")));
        }
        let (mut shape, mut is_record) = (Vec::new(), false);
        for k in 0..rank {
            let number = self.count()?;
            let Some((_, length)) = dimensions.get(number) else {
                return Err(self.error(format!(
                    "the variable {name} has a dimension {number} that is not there"
                )));
            };
            is_record |= k == 0 && *length == 0;
            shape.push(*length);
        }
        let attributes = self.attributes()?;
        let kind = self.kind()?;
        // The size in bytes, which follows from the shape and overflows for large variables.
        self.count()?;
        let begin = if self.version() == 1 {
            self.u32()?.into()
        } else {
            self.u64()?
        };
        let begin =
            usize::try_from(begin).map_err(|_| self.error("data beyond the end of the file"))?;
        let variable = Variable {
            shape,
            attributes,
            kind,
            begin,
            is_record,
        };
        Ok((name, variable))
    }

    /// Whether all data of a variable are in the file; their bytes.
    fn check(&self, name: &str, variable: &Variable, record: usize) -> Result<usize> {
        let skipped = usize::from(variable.is_record);
        let mut inner = variable.shape.iter().skip(skipped);
        let size = inner.try_fold(size_of(variable.kind), |all, &n| all.checked_mul(n));
        let last = match variable.is_record {
            true => variable.shape[0]
                .checked_sub(1)
                .map(|last| last.checked_mul(record)),
            false => Some(Some(0)),
        };
        let Some(last) = last else {
            return Ok(0);
        };
        let end = size
            .zip(last)
            .and_then(|(size, last)| size.checked_add(last)?.checked_add(variable.begin));
        if let (Some(size), Some(end)) = (size, end)
            && end <= self.bytes.len()
        {
            let times = if variable.is_record {
                variable.shape[0]
            } else {
                1
            };
            return Ok(size.saturating_mul(times));
        }
        let what = format!(
            "the variable {name} of the shape {:?} would reach beyond the {} bytes of the file",
            variable.shape,
            self.bytes.len()
        );
        Err(refuse(self.path, Place::Byte(variable.begin as u64), what))
    }
}

fn padding(count: usize) -> usize {
    count.next_multiple_of(4) - count
}

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
    kind: u32,
    attributes: Vec<(String, Attribute)>,
    fill: Fill<'a>,
}

/// The type of a variable that is written.
#[derive(Clone, Copy)]
pub enum Type {
    Char = 2,
    Int = 4,
    Double = 6,
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
        kind: Type,
        fill: impl Fn(usize, usize, &mut [u8]) + Sync + 'a,
    ) {
        let place = |name: &&str| self.dimensions.iter().position(|(known, _)| known == name);
        self.variables.push(New {
            name: name.to_owned(),
            dimensions: dimensions.iter().filter_map(place).collect(),
            kind: kind as u32,
            attributes: Vec::new(),
            fill: Box::new(fill),
        });
    }

    /// Whole numbers.
    pub fn integers(
        &mut self,
        name: &str,
        dimensions: &[&str],
        number: impl Fn(usize) -> i64 + Sync + 'a,
    ) {
        self.variable(name, dimensions, Type::Int, move |_, first, bytes| {
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
            Type::Double,
            move |record, first, bytes| {
                for (bytes, k) in bytes.chunks_exact_mut(8).zip(first..) {
                    bytes.copy_from_slice(&number(record, k).to_be_bytes());
                }
            },
        );
    }

    /// Texts of `width` bytes, the length of the last dimension; longer ones are cut.
    pub fn texts(&mut self, name: &str, dimensions: &[&str], texts: Vec<String>, width: usize) {
        self.variable(name, dimensions, Type::Char, move |_, first, bytes| {
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
        let size = self.count(variable) * size_of(variable.kind);
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
            int(&mut out, variable.kind as usize);
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
            return Err(Error::file(
                path,
                Place::Whole,
                what,
                "choose another format",
            ));
        }
        let mut begins = vec![0; self.variables.len()];
        let mut at = self.header(&begins).len() as u64;
        for &k in fixed.iter().chain(&records) {
            begins[k] = at;
            at += self.size(&self.variables[k]) as u64;
        }
        let mut out = Out::to(path)?;
        out.append(&self.header(&begins));
        let mut write = |k: usize, record: usize| {
            let variable = &self.variables[k];
            let size = size_of(variable.kind);
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
