//! HDF5: the only place that depends on the libraries that read and write it. Its interface is a tree of groups, data sets of
//! numbers or texts, and attributes.
//!
//! A file is read by the crate `hdf5-reader`, within limits that follow from its size; external links and data outside the
//! file are not followed. What is written ([`mod@write`]) is as simple as the format allows, which every reader since HDF5 1.8
//! takes: compact groups and contiguous data.

mod inventory;
/// A number as stored in the file, of at most eight bytes, so that the compiler makes one copy of the library's readers and not one for
/// each type.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Word([u8; 8]);

impl H5Type for Word {
    fn hdf5_type() -> Datatype {
        Datatype::FixedPoint {
            size: 8,
            signed: false,
            byte_order: ByteOrder::LittleEndian,
        }
    }

    fn from_bytes(bytes: &[u8], _: &Datatype) -> std::result::Result<Self, Inner> {
        let mut word = [0; 8];
        word.iter_mut()
            .zip(bytes)
            .for_each(|(to, byte)| *to = *byte);
        Ok(Word(word))
    }

    fn element_size(of: &Datatype) -> usize {
        dtype_element_size(of).unwrap_or(0)
    }

    fn native_copy_compatible(of: &Datatype) -> bool {
        Self::element_size(of) == size_of::<Word>()
    }
}

#[cfg(test)]
mod tests;
pub mod write;

use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use hdf5_reader::error::Error as Inner;
use hdf5_reader::messages::{HdfMessage, layout::DataLayout};
use hdf5_reader::{
    Attribute, ByteOrder, Datatype, H5Type, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem,
    dtype_element_size,
};

use crate::cancel;
use crate::error::{Error, Result};
use crate::io::bytes::{self, Bytes};
use crate::io::raw::RawNumbers;
use crate::io::scalar::Number;
use crate::io::vtu::unpack::Unpacked;
use crate::mesh::Values;

/// The limit for unpacked data sets: this for a file of any size, plus [`PER_BYTE`] for each of its bytes.
const ALLOWANCE: u64 = 256 << 20;
/// gzip packs no better than 1032 to one, and meshes far less.
const PER_BYTE: u64 = 64;
/// The largest chunk, and the largest header of an object.
const MOST: usize = 256 << 20;

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Whether these are the bytes of an HDF5 file, perhaps behind a block of the user's of 512 bytes or a multiple.
pub fn is_hdf5(bytes: &[u8]) -> bool {
    let places = std::iter::once(0).chain((9..24).map(|power| 1 << power));
    let mut found = places.filter_map(|place| bytes.get(place..)?.get(..SIGNATURE.len()));
    found.any(|start| start == SIGNATURE)
}

/// Groups within groups: more than any format has.
const DEEPEST: usize = 100;

/// A group of a file.
#[derive(Clone)]
pub struct Group {
    group: hdf5_reader::group::Group,
    file: Rc<About>,
    /// Where it is, as in `/ENS_MAA/mesh`; empty for the root.
    pub name: String,
}

/// A data set of a file.
pub struct Data {
    data: hdf5_reader::Dataset,
    file: Rc<About>,
    pub name: String,
}

/// The name for errors, the bytes that may still be unpacked, and the file itself.
struct About {
    path: PathBuf,
    left: Cell<u64>,
    bytes: Arc<Bytes>,
    opened: Option<Hdf5File>,
    /// Where the data sets are whose values have been asked for.
    read: RefCell<HashSet<u64>>,
}

/// The bytes of a file as the library has them.
struct Owner(Arc<Bytes>);

impl AsRef<[u8]> for Owner {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl About {
    fn refuse(&self, name: &str, what: impl Into<String>) -> Error {
        let name = if name.is_empty() { "/" } else { name };
        let what = format!("{name}: {}", what.into());
        Error::whole(
            &self.path,
            what,
            "write the file again with the program it comes from",
        )
    }
}

/// Opens a file; its root.
///
/// # Errors
/// It is not an HDF5 file, or a damaged one.
pub fn open(path: &Path, bytes: &[u8]) -> Result<Group> {
    let left = PER_BYTE
        .saturating_mul(bytes.len() as u64)
        .saturating_add(ALLOWANCE);
    let mut file = About {
        path: path.to_owned(),
        left: Cell::new(left),
        bytes: bytes::owner(bytes),
        opened: None,
        read: RefCell::default(),
    };
    let options = OpenOptions::default()
        .with_max_chunk_bytes(MOST)
        .with_max_object_header_bytes(MOST)
        .with_max_read_bytes(usize::try_from(left).unwrap_or(usize::MAX))
        .with_chunk_cache_bytes(0);
    let opened = Hdf5File::from_owner(Owner(file.bytes.clone()), options);
    let opened = opened.and_then(|opened| Ok((opened.root_group()?, opened)));
    let (group, opened) = opened.map_err(|e| file.refuse("", e.to_string()))?;
    file.opened = Some(opened);
    Ok(Group {
        group,
        name: String::new(),
        file: Rc::new(file),
    })
}

/// Something that may be missing.
fn found<T>(found: Result<T, Inner>) -> Result<Option<T>, Inner> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(error) if is_missing(&error) => Ok(None),
        Err(error) => Err(error),
    }
}

fn is_missing(error: &Inner) -> bool {
    match error {
        Inner::GroupNotFound(_) | Inner::DatasetNotFound(_) | Inner::AttributeNotFound(_) => true,
        Inner::Context { source, .. } => is_missing(source),
        _ => false,
    }
}

impl Group {
    /// An error about this group.
    pub fn refuse(&self, what: impl Into<String>) -> Error {
        self.file.refuse(&self.name, what)
    }

    fn below(&self, name: &str) -> String {
        format!("{}/{name}", self.name)
    }

    /// The names of the groups and of the data sets in it, each in the order of the file.
    pub fn names(&self) -> Result<(Vec<String>, Vec<String>)> {
        cancel::check()?;
        let names = self.group.member_names();
        let names = names.map_err(|e| self.refuse(e.to_string()))?;
        // Without a name a group would be found again and again in itself.
        match names.0.iter().any(String::is_empty) {
            true => Err(self.refuse("a group in it has no name")),
            false => Ok(names),
        }
    }

    /// The group at this path below, if there is one.
    pub fn group(&self, path: &str) -> Result<Option<Group>> {
        let mut at = self.clone();
        for part in path.split('/').filter(|part| !part.is_empty()) {
            let next = found(at.group.group(part)).map_err(|e| at.refuse(e.to_string()))?;
            let Some(group) = next else {
                return Ok(None);
            };
            let name = at.below(part);
            if name.matches('/').count() > DEEPEST {
                return Err(at.refuse("its groups are nested too deeply: one may hold itself"));
            }
            at = Group { group, name, ..at };
        }
        Ok(Some(at))
    }

    /// The groups in it.
    pub fn groups(&self) -> Result<Vec<(String, Group)>> {
        let mut groups = Vec::new();
        for name in self.names()?.0 {
            if let Some(group) = self.group(&name)? {
                groups.push((name, group));
            }
        }
        Ok(groups)
    }

    /// The groups in the one at this path; none if there is none.
    pub fn groups_of(&self, path: &str) -> Result<Vec<(String, Group)>> {
        match self.group(path)? {
            Some(group) => group.groups(),
            None => Ok(Vec::new()),
        }
    }

    /// The data set at this path below, if there is one.
    pub fn data(&self, path: &str) -> Result<Option<Data>> {
        let path = path.trim_matches('/');
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
        let Some(group) = self.group(folder)? else {
            return Ok(None);
        };
        let data =
            found(group.group.dataset(name)).map_err(|e| group.refuse(format!("{name}: {e}")))?;
        Ok(data.map(|data| Data {
            data,
            name: group.below(name),
            file: group.file,
        }))
    }

    /// The data set of this name, which must be there.
    pub fn needed(&self, path: &str) -> Result<Data> {
        self.data(path)?
            .ok_or_else(|| self.refuse(format!("the data set {path} is missing")))
    }

    fn attribute(&self, name: &str) -> Option<Attribute> {
        self.group.attribute(name).ok()
    }

    /// The text of an attribute.
    pub fn text(&self, name: &str) -> Option<String> {
        text(&self.attribute(name)?)
    }

    /// The integers of an attribute.
    pub fn integers(&self, name: &str) -> Option<Vec<i64>> {
        integers(&self.attribute(name)?)
    }

    /// The one number of an attribute.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.attribute(name)?.read_as_f64().ok()
    }
}

fn text(attribute: &Attribute) -> Option<String> {
    let text = attribute.read_string().ok()?;
    Some(text.trim_end_matches(['\0', ' ']).to_owned())
}

fn integers(attribute: &Attribute) -> Option<Vec<i64>> {
    fn widen<T: H5Type + Into<i64>>(attribute: &Attribute) -> Option<Vec<i64>> {
        Some(
            attribute
                .read_1d::<T>()
                .ok()?
                .into_iter()
                .map(Into::into)
                .collect(),
        )
    }
    let Datatype::FixedPoint { size, signed, .. } = &attribute.datatype else {
        return None;
    };
    match (size, signed) {
        (1, true) => widen::<i8>(attribute),
        (1, false) => widen::<u8>(attribute),
        (2, true) => widen::<i16>(attribute),
        (2, false) => widen::<u16>(attribute),
        (4, true) => widen::<i32>(attribute),
        (4, false) => widen::<u32>(attribute),
        (8, _) => widen::<i64>(attribute),
        _ => None,
    }
}

impl Data {
    /// An error about this data set.
    pub fn refuse(&self, what: impl Into<String>) -> Error {
        self.file.refuse(&self.name, what)
    }

    /// The number of rows, of columns and so on; none for a single number.
    pub fn shape(&self) -> Vec<usize> {
        let dims = self.data.shape().iter();
        dims.map(|&dim| usize::try_from(dim).unwrap_or(usize::MAX))
            .collect()
    }

    /// Rows, and numbers of a row.
    pub fn rows(&self) -> (usize, usize) {
        let shape = self.shape();
        let width = shape
            .iter()
            .skip(1)
            .fold(1_usize, |all, &n| all.saturating_mul(n));
        (shape.first().copied().unwrap_or(1), width)
    }

    pub fn text(&self, attribute: &str) -> Option<String> {
        text(&self.data.attribute(attribute).ok()?)
    }

    /// Whether it holds texts rather than numbers.
    pub fn is_text(&self) -> bool {
        matches!(
            self.data.dtype(),
            Datatype::String { .. } | Datatype::VarLen { .. }
        )
    }

    /// Subtracts a given number of values from those that may be unpacked; returns the bytes of one.
    fn take(&self, numbers: usize) -> Result<usize> {
        cancel::check()?;
        self.file.read.borrow_mut().insert(self.data.address());
        let size = self
            .data
            .raw_element_size()
            .map_err(|e| self.refuse(e.to_string()))?;
        let left = (numbers as u64).checked_mul(size as u64);
        let left = left.and_then(|bytes| self.file.left.get().checked_sub(bytes));
        let left = left.ok_or_else(|| {
            self.refuse(format!(
                "its {numbers} values are more than a file of this size may unpack to"
            ))
        })?;
        self.file.left.set(left);
        Ok(size)
    }

    /// All numbers, in the type of the file; texts are bytes.
    pub fn values(&self) -> Result<Values> {
        self.raw(None).map(|numbers| numbers.values())
    }

    /// Some of the first indices and all of the others.
    pub fn some(&self, rows: Range<usize>) -> Result<Values> {
        self.raw(Some(rows)).map(|numbers| numbers.values())
    }

    /// The numbers, all or those of some of the first indices, where they lie in the file if they are in one piece.
    pub fn raw(&self, rows: Option<Range<usize>>) -> Result<RawNumbers<'static>> {
        let shape = self.shape();
        let (number, big_endian) = self.number()?;
        let product = |shape: &[usize]| shape.iter().fold(1_usize, |all, &n| all.saturating_mul(n));
        let all = product(&shape);
        let (first, count) = match &rows {
            None => (0, all),
            Some(rows) => {
                let width = product(shape.get(1..).unwrap_or_default());
                let count = rows.end.saturating_sub(rows.start);
                let end = rows.start.checked_add(count);
                if end.is_none_or(|end| end > shape.first().copied().unwrap_or(0)) {
                    return Err(self.refuse(format!(
                        "it has not the rows {rows:?}, but the shape {shape:?}"
                    )));
                }
                (
                    rows.start.saturating_mul(width),
                    count.saturating_mul(width),
                )
            }
        };
        let size = self.take(count)?;
        if let Some(place) = self.place(all.saturating_mul(size)) {
            let start = place + first * size;
            let part = start..start + count * size;
            return Ok(RawNumbers {
                number,
                bytes: Unpacked::Part(self.file.bytes.clone(), part),
                big_endian,
            });
        }
        // All rows are a selection as well, which would ask for all again.
        if let Some(rows) = rows.filter(|_| count < all) {
            let rest = shape.iter().skip(1).map(|&n| [0, 1, n]);
            let first = [rows.start, 1, rows.end.saturating_sub(rows.start)];
            let of: Vec<_> = std::iter::once(first).chain(rest).collect();
            return self.raw_of(&of);
        }
        let bytes = self.data.read_raw_bytes();
        Ok(RawNumbers {
            number,
            bytes: bytes.map_err(|e| self.refuse(e.to_string()))?.into(),
            big_endian,
        })
    }

    /// Where the numbers begin in the file, if they are there in one piece of this size.
    fn place(&self, bytes: usize) -> Option<usize> {
        let opened = self.file.opened.as_ref()?;
        let header = opened.get_or_parse_header(self.data.address()).ok()?;
        let mut place = None;
        for message in &header.messages {
            match message {
                HdfMessage::ExternalFiles(_) => return None,
                HdfMessage::DataLayout(layout) => match layout.layout {
                    DataLayout::Contiguous { address, size } if size == bytes as u64 => {
                        place = address.checked_add(opened.superblock().base_address);
                    }
                    _ => return None,
                },
                _ => {}
            }
        }
        let place = usize::try_from(place?).ok()?;
        let end = place.checked_add(bytes)?;
        (end <= self.file.bytes.len()).then_some(place)
    }

    /// The type of the numbers, and whether their first byte is the highest; characters are bytes.
    fn number(&self) -> Result<(Number, bool)> {
        let kind = match self.data.dtype() {
            Datatype::Enum { base, .. } => base,
            other => other,
        };
        let (number, byte_order) = match kind {
            Datatype::FloatingPoint { size, byte_order } => {
                (Number::float(usize::from(*size)), byte_order)
            }
            Datatype::FixedPoint {
                size,
                signed,
                byte_order,
            } => {
                let number = Number::integer(usize::from(*size), *signed);
                let refuse = || self.refuse(format!("integers of {size} bytes are not read"));
                (Some(number.ok_or_else(refuse)?), byte_order)
            }
            // netCDF's and CGNS's characters, MED's names.
            Datatype::String { .. } | Datatype::Array { .. } => {
                (Some(Number::U8), &ByteOrder::LittleEndian)
            }
            _ => (None, &ByteOrder::LittleEndian),
        };
        let number =
            number.ok_or_else(|| self.refuse(format!("it holds no numbers, but {kind:?}")))?;
        Ok((number, *byte_order == ByteOrder::BigEndian))
    }

    /// A selection: the first index, the step and the count along each dimension.
    pub fn raw_of(&self, of: &[[usize; 3]]) -> Result<RawNumbers<'static>> {
        let shape = self.shape();
        let inside = |(&[start, step, count], &n): (&[usize; 3], &usize)| {
            let span = count.saturating_sub(1).checked_mul(step);
            let last = span.and_then(|span| span.checked_add(start));
            step > 0 && (count == 0 || last.is_some_and(|last| last < n))
        };
        if of.len() != shape.len() || !of.iter().zip(&shape).all(inside) {
            return Err(self.refuse(format!("a selection {of:?} of data of the shape {shape:?}")));
        }
        let whole = of
            .iter()
            .zip(&shape)
            .all(|(&[start, step, count], &n)| (start, step, count) == (0, 1, n));
        if whole {
            return self.raw(None);
        }
        let (number, big_endian) = self.number()?;
        Ok(RawNumbers {
            number,
            bytes: self.bytes_of(of)?.into(),
            big_endian,
        })
    }

    fn bytes_of(&self, of: &[[usize; 3]]) -> Result<Vec<u8>> {
        let counts = of.iter().map(|[.., count]| *count);
        let count = counts.fold(1_usize, |all, n| all.saturating_mul(n));
        let size = self.take(count)?;
        if count == 0 {
            return Ok(Vec::new());
        }
        if size > size_of::<Word>() {
            return Err(self.refuse(format!("a selection of items of {size} bytes is not read")));
        }
        let slices = of.iter().map(|&[start, step, count]| SliceInfoElem::Slice {
            start: start as u64,
            end: (start + (count - 1) * step + 1) as u64,
            step: step as u64,
        });
        let info = SliceInfo {
            selections: slices.collect(),
        };
        let words = self.data.read_slice::<Word>(&info);
        let words = words.map_err(|error| self.refuse(error.to_string()))?;
        let bytes = words.iter().flat_map(|Word(bytes)| bytes.iter().take(size));
        Ok(bytes.copied().collect())
    }

    /// All texts, without the zeros and blanks at their ends.
    pub fn texts(&self) -> Result<Vec<String>> {
        let (rows, width) = self.rows();
        self.take(rows.saturating_mul(width))?;
        let texts = self
            .data
            .read_strings()
            .map_err(|e| self.refuse(e.to_string()))?;
        let trimmed = texts
            .iter()
            .map(|text| text.trim_end_matches(['\0', ' ']).to_owned());
        Ok(trimmed.collect())
    }
}
