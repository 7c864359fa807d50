//! Writes HDF5 files: groups whose links are in their headers, contiguous data, attributes. The headers of all objects
//! come first, then the data, which are made while they are written.

use std::path::Path;

use crate::error::Result;
use crate::field::data::with_numbers;
use crate::io::out::Out;
use crate::io::raw::CellNodes;
use crate::io::scalar::{Number, Scalar};
use crate::mesh::Values;

/// A type of numbers or texts, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    Number(Number),
    /// A text of this many bytes, with zeros at the end.
    Text(u32),
    /// An array of this many small integers.
    Bytes(u32),
}

impl Type {
    /// Bytes of one value.
    pub fn size(self) -> usize {
        match self {
            Type::Number(number) => number.size(),
            Type::Text(size) | Type::Bytes(size) => size as usize,
        }
    }

    /// The datatype message.
    fn message(self) -> Vec<u8> {
        let size = (self.size() as u32).to_le_bytes();
        let bits = 8 * self.size() as u16;
        match self {
            Type::Text(_) => [&[0x13, 0, 0, 0], &size[..]].concat(),
            Type::Bytes(count) => {
                let count = count.to_le_bytes();
                [
                    &[0x2a, 0, 0, 0],
                    &size[..],
                    &[1, 0, 0, 0],
                    &count,
                    &[0; 4],
                    &Type::Number(Number::I8).message(),
                ]
                .concat()
            }
            // IEEE 754: the sign, the place and size of exponent and mantissa, the bias.
            Type::Number(number) if number.is_float() => {
                let (exponent, mantissa, bias) = if number == Number::F32 {
                    (8, 23, 127)
                } else {
                    (11, 52, 1023_u32)
                };
                let parts = [mantissa, exponent, 0, mantissa];
                let flags = [0x11, 0x20, bits as u8 - 1, 0];
                [
                    &flags,
                    &size[..],
                    &[0, 0],
                    &bits.to_le_bytes(),
                    &parts,
                    &bias.to_le_bytes(),
                ]
                .concat()
            }
            Type::Number(number) => {
                let sign = if number.is_unsigned() { 0 } else { 8 };
                [&[0x10, sign, 0, 0], &size[..], &[0, 0], &bits.to_le_bytes()].concat()
            }
        }
    }
}

impl From<Number> for Type {
    fn from(number: Number) -> Self {
        Type::Number(number)
    }
}

/// A group that is to be written.
#[derive(Default)]
pub struct Group<'a> {
    attributes: Vec<(String, Data<'a>)>,
    groups: Vec<(String, Group<'a>)>,
    data: Vec<(String, Data<'a>)>,
}

/// Fills bytes with the values from a number on.
type Fill<'a> = Box<dyn Fn(usize, &mut [u8]) + Sync + 'a>;

/// A data set, or the value of an attribute.
pub struct Data<'a> {
    kind: Type,
    /// None: one value.
    shape: Vec<usize>,
    fill: Fill<'a>,
    attributes: Vec<(String, Data<'a>)>,
}

impl<'a> Data<'a> {
    /// Values that are made while they are written: `fill` gets the number of a first value, and zeros to fill.
    pub fn made(
        kind: impl Into<Type>,
        shape: Vec<usize>,
        fill: impl Fn(usize, &mut [u8]) + Sync + 'a,
    ) -> Self {
        Data {
            kind: kind.into(),
            shape,
            fill: Box::new(fill),
            attributes: Vec::new(),
        }
    }

    /// Numbers in rows of `width`, or a plain list of them if it is 0.
    pub fn numbers(values: &'a Values, width: usize) -> Self {
        let shape = match width {
            0 => vec![values.len()],
            width => vec![values.len() / width, width],
        };
        Data::made(Number::of(values), shape, move |first, bytes| {
            with_numbers!(values, numbers => Scalar::put_le(&numbers[first..], bytes));
        })
    }

    /// Integers of 32 or 64 bits.
    pub fn integers(
        kind: Number,
        shape: Vec<usize>,
        number: impl Fn(usize) -> i64 + Sync + 'a,
    ) -> Self {
        let size = kind.size();
        Data::made(kind, shape, move |first, bytes| {
            for (bytes, k) in bytes.chunks_exact_mut(size).zip(first..) {
                bytes.copy_from_slice(&number(k).to_le_bytes()[..size]);
            }
        })
    }

    /// Integers of 32 or 64 bits in rows, of which many after one another are the same: the end of each run, and its row.
    pub fn runs(
        kind: Number,
        shape: Vec<usize>,
        runs: Vec<(u32, u32)>,
        rows: Vec<Vec<i64>>,
    ) -> Self {
        let (size, width) = (kind.size(), rows.first().map_or(1, Vec::len).max(1));
        Data::made(kind, shape, move |first, mut bytes| {
            let mut at = first;
            let past = runs.partition_point(|(end, _)| *end as usize * width <= first);
            for &(end, row) in &runs[past..] {
                let count = (end as usize * width - at).min(bytes.len() / size);
                let (now, later) = bytes.split_at_mut(count * size);
                match (size, &rows[row as usize]) {
                    (4, row) => repeat::<4>(now, row, at),
                    (_, row) => repeat::<8>(now, row, at),
                }
                (at, bytes) = (at + count, later);
            }
        })
    }

    /// The same numbers as rows of another shape.
    pub fn of_shape(self, shape: &[usize]) -> Self {
        let shape = shape.to_vec();
        Data { shape, ..self }
    }

    /// Numbers of 64 bits.
    pub fn floats(shape: Vec<usize>, number: impl Fn(usize) -> f64 + Sync + 'a) -> Self {
        Data::made(Number::F64, shape, move |first, bytes| {
            for (bytes, k) in bytes.chunks_exact_mut(8).zip(first..) {
                bytes.copy_from_slice(&number(k).to_le_bytes());
            }
        })
    }

    /// A table of numbers of 64 bits by row and column, without a division for each; it is a list of columns if `by_column`.
    pub fn table(
        shape: Vec<usize>,
        [rows, width]: [usize; 2],
        by_column: bool,
        number: impl Fn(usize, usize) -> f64 + Sync + 'a,
    ) -> Self {
        let inner = if by_column { rows } else { width };
        Data::made(Number::F64, shape, move |first, bytes| {
            let (mut outer, mut k) = (first / inner.max(1), first % inner.max(1));
            for bytes in bytes.as_chunks_mut().0 {
                let (row, column) = if by_column { (k, outer) } else { (outer, k) };
                *bytes = number(row, column).to_le_bytes();
                k += 1;
                if k == inner {
                    (outer, k) = (outer + 1, 0);
                }
            }
        })
    }

    /// The nodes of cells, numbered from `base` on, in 32 bits.
    pub fn nodes(shape: Vec<usize>, nodes: CellNodes<'a>, base: u32) -> Self {
        Data::made(Number::I32, shape, move |first, bytes| {
            nodes.put(first, bytes, |node| (node + base).to_le_bytes());
        })
    }

    /// Texts of `size` bytes; longer ones are cut.
    pub fn texts(texts: Vec<String>, size: usize) -> Self {
        let shape = vec![texts.len()];
        Data::made(Type::Text(size as u32), shape, move |first, bytes| {
            for (bytes, text) in bytes.chunks_exact_mut(size).zip(texts.iter().skip(first)) {
                let text = text.as_bytes();
                let length = text.len().min(size);
                bytes[..length].copy_from_slice(&text[..length]);
            }
        })
    }

    /// Texts as arrays of `size` small integers.
    pub fn byte_arrays(texts: Vec<String>, size: usize) -> Self {
        Data {
            kind: Type::Bytes(size as u32),
            ..Data::texts(texts, size)
        }
    }

    /// One text.
    pub fn text(text: impl Into<String>) -> Self {
        let text = text.into();
        let size = text.len() + 1;
        Data {
            shape: Vec::new(),
            ..Data::texts(vec![text], size)
        }
    }

    /// One text of a given number of bytes.
    pub fn one_text(text: &str, size: usize) -> Self {
        Data {
            shape: Vec::new(),
            ..Data::texts(vec![text.to_owned()], size)
        }
    }

    /// One integer.
    pub fn integer(kind: Number, number: i64) -> Self {
        Data::integers(kind, Vec::new(), move |_| number)
    }

    /// One number.
    pub fn float(number: f64) -> Self {
        Data::floats(Vec::new(), move |_| number)
    }

    pub fn with(mut self, name: &str, value: Data<'a>) -> Self {
        self.attributes.push((name.to_owned(), value));
        self
    }

    pub fn kind(&self) -> Type {
        self.kind
    }

    fn count(&self) -> usize {
        self.shape.iter().product()
    }

    fn dataspace(&self) -> Vec<u8> {
        let mut message = vec![
            2,
            self.shape.len() as u8,
            0,
            u8::from(!self.shape.is_empty()),
        ];
        message.extend(self.shape.iter().flat_map(|&n| (n as u64).to_le_bytes()));
        message
    }

    /// The header of a data set whose values are at `place`.
    fn header(&self, place: u64) -> Vec<u8> {
        let bytes = (self.count() * self.kind.size()) as u64;
        let place = if bytes == 0 { UNDEFINED } else { place };
        let layout = [&[3, 1], &place.to_le_bytes()[..], &bytes.to_le_bytes()].concat();
        let mut messages = vec![
            (DATASPACE, self.dataspace()),
            (DATATYPE, self.kind.message()),
            (FILL, vec![3, 0x0a]),
            (LAYOUT, layout),
        ];
        messages.extend(self.attributes.iter().map(attribute));
        object(&messages)
    }
}

impl<'a> Group<'a> {
    /// The group at this path below, which is made if it is not there.
    pub fn group(&mut self, path: &str) -> &mut Group<'a> {
        match path.split_once('/') {
            None => self.member(path),
            Some((name, rest)) => self.member(name).group(rest),
        }
    }

    /// The group of this name, which is made if it is not there.
    pub fn member(&mut self, name: &str) -> &mut Group<'a> {
        let known = self.groups.iter().position(|(known, _)| known == name);
        let k = known.unwrap_or(self.groups.len());
        if known.is_none() {
            self.groups.push((name.to_owned(), Group::default()));
        }
        &mut self.groups[k].1
    }

    pub fn add(&mut self, name: &str, data: Data<'a>) -> &mut Self {
        self.data.push((name.to_owned(), data));
        self
    }

    pub fn has(&self, group: &str) -> bool {
        self.groups.iter().any(|(known, _)| known == group)
    }

    pub fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    /// Adds an attribute.
    pub fn with(&mut self, name: &str, value: Data<'a>) -> &mut Self {
        self.attributes.push((name.to_owned(), value));
        self
    }

    /// The header of a group whose members are at these places, groups first.
    fn header(&self, places: &[u64]) -> Vec<u8> {
        // The MED library asks for members by the order in which they were made.
        let count = (places.len() as u64).to_le_bytes();
        let info = [
            &[0, 1][..],
            &count,
            &UNDEFINED.to_le_bytes(),
            &UNDEFINED.to_le_bytes(),
        ]
        .concat();
        let mut messages = vec![(LINKS, info), (GROUP, vec![0, 0])];
        let names = self.groups.iter().map(|(name, _)| name);
        let names = names.chain(self.data.iter().map(|(name, _)| name));
        let links = names
            .zip(places)
            .zip(0_u64..)
            .map(|((name, place), order)| {
                let length = (name.len() as u16).to_le_bytes();
                let link = [
                    &[1, 0x15],
                    &order.to_le_bytes()[..],
                    &[1],
                    &length,
                    name.as_bytes(),
                    &place.to_le_bytes(),
                ]
                .concat();
                (LINK, link)
            });
        messages.extend(links);
        messages.extend(self.attributes.iter().map(attribute));
        object(&messages)
    }

    /// Appends the objects below and then this one, each with the bytes of its header; returns its number.
    fn list<'b>(&'b self, all: &mut Vec<Object<'a, 'b>>) -> usize {
        let groups: Vec<usize> = self
            .groups
            .iter()
            .map(|(_, group)| group.list(all))
            .collect();
        let data = self.data.iter().map(|(_, data)| {
            all.push(Object::Data(data));
            all.len() - 1
        });
        let members = groups.into_iter().chain(data).collect();
        all.push(Object::Group(self, members));
        all.len() - 1
    }

    /// Writes the file whose root this is.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; an old file is kept then.
    pub fn save(&self, path: &Path) -> Result<()> {
        let mut out = Out::to(path)?;
        let mut all = Vec::new();
        self.list(&mut all);
        let aligned = |place: u64| place.next_multiple_of(8);
        // The size of a header does not depend on what it points to.
        let headers = all.iter().map(|object| match object {
            Object::Data(data) => data.header(0),
            Object::Group(group, members) => group.header(&vec![0; members.len()]),
        });
        let mut end = SUPERBLOCK;
        let mut places = Vec::with_capacity(all.len());
        for header in headers {
            places.push(end);
            end = aligned(end + header.len() as u64);
        }
        let mut at = end;
        let mut bodies = Vec::new();
        for object in &all {
            if let Object::Data(data) = object {
                bodies.push((at, *data));
                at = aligned(at + (data.count() * data.kind.size()) as u64);
            }
        }
        let root = places.last().copied().unwrap_or(UNDEFINED);
        let mut superblock = [&b"\x89HDF\r\n\x1a\n"[..], &[2, 8, 8, 0]].concat();
        for place in [0, UNDEFINED, at, root] {
            superblock.extend(place.to_le_bytes());
        }
        out.expect(at as usize);
        out.append(&checked(superblock));
        let mut bodies_of = bodies.iter();
        for object in &all {
            let header = match object {
                Object::Data(data) => data.header(bodies_of.next().map_or(0, |(at, _)| *at)),
                Object::Group(group, members) => {
                    let places: Vec<u64> = members.iter().map(|&member| places[member]).collect();
                    group.header(&places)
                }
            };
            out.append(&header);
            out.append(&[0; 8][..padding(header.len())]);
        }
        for (_, data) in &bodies {
            out.rows(data.count(), data.kind.size(), &data.fill);
            out.append(&[0; 8][..padding(data.count() * data.kind.size())]);
        }
        out.save(path)
    }
}

/// Fills bytes with the numbers of a row, over and over, from the `first` one on.
fn repeat<const N: usize>(bytes: &mut [u8], row: &[i64], first: usize) {
    let word = |number: i64| std::array::from_fn(|k| number.to_le_bytes()[k]);
    let words: &mut [[u8; N]] = bytes.as_chunks_mut().0;
    match row {
        [one] => words.fill(word(*one)),
        _ => {
            let numbers = row.iter().cycle().skip(first % row.len().max(1));
            let each = words.iter_mut().zip(numbers);
            each.for_each(|(to, number)| *to = word(*number));
        }
    }
}

enum Object<'a, 'b> {
    Data(&'b Data<'a>),
    /// With the numbers of its members.
    Group(&'b Group<'a>, Vec<usize>),
}

/// Bytes up to the next multiple of 8.
fn padding(length: usize) -> usize {
    length.next_multiple_of(8) - length
}

const UNDEFINED: u64 = u64::MAX;
/// Bytes of the superblock.
const SUPERBLOCK: u64 = 48;

// Messages of an object's header.
const DATASPACE: u8 = 1;
const LINKS: u8 = 2;
const DATATYPE: u8 = 3;
const FILL: u8 = 5;
const LINK: u8 = 6;
const LAYOUT: u8 = 8;
const GROUP: u8 = 10;
const ATTRIBUTE: u8 = 12;

fn attribute((name, value): &(String, Data<'_>)) -> (u8, Vec<u8>) {
    let (kind, space) = (value.kind.message(), value.dataspace());
    let mut message = vec![3, 0];
    for length in [name.len() + 1, kind.len(), space.len()] {
        message.extend((length as u16).to_le_bytes());
    }
    // Names are UTF-8.
    message.push(1);
    message.extend(name.as_bytes());
    message.push(0);
    message.extend(kind);
    message.extend(space);
    let start = message.len();
    message.resize(start + value.count() * value.kind.size(), 0);
    (value.fill)(0, &mut message[start..]);
    (ATTRIBUTE, message)
}

/// The header of an object: version 2, with four bytes for its length.
fn object(messages: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let length: usize = messages.iter().map(|(_, message)| 4 + message.len()).sum();
    let mut header = [&b"OHDR"[..], &[2, 2], &(length as u32).to_le_bytes()].concat();
    for (kind, message) in messages {
        header.push(*kind);
        header.extend((message.len() as u16).to_le_bytes());
        header.push(0);
        header.extend(message);
    }
    checked(header)
}

/// Appends Jenkins's checksum (lookup3, little-endian).
fn checked(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = hdf5_reader::checksum::jenkins_lookup3(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}
