//! ADF, the tree of nodes that CGNS stood on before HDF5: headers of fixed size whose pointers are blocks of 4096 bytes and
//! offsets in them, as hexadecimal text in version A, in binary in version B.

use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::io::raw::{self, RawNumbers};
use crate::io::scalar::Number;

/// Whether these are the bytes of such a file.
pub fn is_adf(bytes: &[u8]) -> bool {
    bytes
        .get(4..25)
        .is_some_and(|head| head == b"ADF Database Version ")
}

/// A file that is read.
pub struct File<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// Whether pointers are text.
    is_text: bool,
    big_endian: bool,
    /// Bytes that may still be read: of a sound file no more than it has.
    left: Cell<usize>,
    /// Where the data are that have been asked for.
    read: RefCell<HashSet<u64>>,
}

/// A node: its name, label and type, the lengths of its dimensions, the first running fastest, and where its data are.
#[derive(Clone)]
pub struct Node {
    pub name: String,
    pub label: String,
    pub kind: String,
    pub shape: Vec<usize>,
    children: (usize, u64),
    chunks: usize,
    data: u64,
}

/// Bytes of a node's header, and of an entry in a table of children.
const HEADER: usize = 246;
const ENTRY: usize = 44;
const POINTER: usize = 12;

impl<'a> File<'a> {
    pub fn open(path: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        let file = File {
            path,
            bytes,
            is_text: bytes.get(25) == Some(&b'A'),
            big_endian: bytes.get(100) == Some(&b'B'),
            left: Cell::new(4 * bytes.len()),
            read: RefCell::default(),
        };
        if !matches!(bytes.get(100), Some(b'B' | b'L')) {
            return Err(file.refuse(100, "the numbers are neither big-endian nor little-endian"));
        }
        Ok(file)
    }

    pub fn refuse(&self, at: u64, what: impl Into<String>) -> Error {
        let remedy = "write the file again with the program it comes from";
        Error::file(self.path, Place::Byte(at), what, remedy)
    }

    fn take(&self, at: u64, count: usize) -> Result<&'a [u8]> {
        let start = usize::try_from(at).ok();
        let found = start.and_then(|start| self.bytes.get(start..start.checked_add(count)?));
        found.ok_or_else(|| {
            self.refuse(
                at,
                format!("the file ends before {count} bytes that it points to"),
            )
        })
    }

    fn hex(&self, at: u64, count: usize) -> Result<u64> {
        let text = std::str::from_utf8(self.take(at, count)?).ok();
        let number = text.and_then(|text| u64::from_str_radix(text.trim(), 16).ok());
        number.ok_or_else(|| self.refuse(at, "there is no hexadecimal number"))
    }

    fn little(&self, at: u64, count: usize) -> Result<u64> {
        Ok(self
            .take(at, count)?
            .iter()
            .rev()
            .fold(0, |all, &byte| all << 8 | u64::from(byte)))
    }

    /// The place that a pointer points to.
    fn pointer(&self, at: u64) -> Result<u64> {
        let (block, offset) = match self.is_text {
            true => (self.hex(at, 8)?, self.hex(at + 8, 4)?),
            false => (self.little(at, 8)?, self.little(at + 8, 4)?),
        };
        let place = block
            .checked_mul(4096)
            .and_then(|place| place.checked_add(offset));
        place
            .filter(|&place| place <= self.bytes.len() as u64)
            .ok_or_else(|| self.refuse(at, "it points beyond the end of the file"))
    }

    fn text(&self, at: u64, count: usize) -> Result<String> {
        Ok(raw::text(self.take(at, count)?))
    }

    pub fn root(&self) -> Result<Node> {
        self.node(self.pointer(134)?)
    }

    fn node(&self, at: u64) -> Result<Node> {
        let header = self.take(at, HEADER)?;
        if !header.starts_with(b"NoDe") || !header.ends_with(b"TaiL") {
            return Err(self.refuse(at, "there is no node where one should be"));
        }
        let count = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let rank = count(self.hex(at + 128, 2)?).min(12);
        let length = |k: usize| {
            let place = at + 130 + 8 * k as u64;
            if self.is_text {
                self.hex(place, 8)
            } else {
                self.little(place, 8)
            }
        };
        let kind = self.text(at + 96, 32)?;
        let chunks = count(self.hex(at + 226, 4)?);
        Ok(Node {
            name: self.text(at + 4, 32)?,
            label: self.text(at + 36, 32)?,
            shape: (0..rank)
                .map(|k| length(k).map(count))
                .collect::<Result<_>>()?,
            kind,
            children: (
                count(self.hex(at + 68, 8)?),
                self.pointer(at + 84).unwrap_or(0),
            ),
            chunks,
            data: if chunks > 0 {
                self.pointer(at + 230)?
            } else {
                0
            },
        })
    }

    pub fn children(&self, node: &Node) -> Result<Vec<Node>> {
        let (count, table) = node.children;
        let head = 4 + POINTER;
        // No more than there are bytes for.
        self.take(
            table,
            if count == 0 {
                0
            } else {
                count.saturating_mul(ENTRY).saturating_add(head)
            },
        )?;
        let entry = |k: usize| self.node(self.pointer(table + (head + k * ENTRY + 32) as u64)?);
        (0..count).map(entry).collect()
    }

    /// Whether a node has data that have not been read.
    pub fn is_unread(&self, node: &Node) -> bool {
        let is_empty = node.chunks == 0 || node.shape.contains(&0);
        !is_empty && !self.read.borrow().contains(&node.data)
    }

    /// The numbers of a node; characters are bytes. None if it has none.
    pub fn raw(&self, node: &Node) -> Result<Option<RawNumbers<'a>>> {
        self.read.borrow_mut().insert(node.data);
        let number = match node.kind.as_str() {
            "C1" | "B1" | "LK" => Number::U8,
            "I4" => Number::I32,
            "U4" => Number::U32,
            "R4" => Number::F32,
            "I8" => Number::I64,
            "U8" => Number::U64,
            "R8" => Number::F64,
            _ => return Ok(None),
        };
        if node.chunks == 0 {
            return Ok(None);
        }
        let bytes = node
            .shape
            .iter()
            .try_fold(number.size(), |all: usize, &n| all.checked_mul(n));
        let bytes = bytes.filter(|&bytes| bytes <= self.left.get());
        let bytes = bytes.ok_or_else(|| {
            self.refuse(
                node.data,
                format!("the data of {} are larger than the file", node.name),
            )
        })?;
        self.left.set(self.left.get() - bytes);
        let bytes = match node.chunks {
            1 => self.take(node.data + 4 + POINTER as u64, bytes)?.into(),
            chunks => {
                let mut found = Vec::new();
                // A table of where each part begins and ends.
                for k in 0..chunks {
                    let at = node.data + (4 + POINTER + 2 * POINTER * k) as u64;
                    let (start, end) = (
                        self.pointer(at)? + 4 + POINTER as u64,
                        self.pointer(at + POINTER as u64)?,
                    );
                    let length = usize::try_from(end.saturating_sub(start))
                        .unwrap_or(0)
                        .min(bytes - found.len());
                    found.extend_from_slice(self.take(start, length)?);
                }
                if found.len() < bytes {
                    return Err(self.refuse(
                        node.data,
                        format!("the data of {} end too early", node.name),
                    ));
                }
                found.into()
            }
        };
        Ok(Some(RawNumbers {
            number,
            bytes,
            big_endian: self.big_endian,
        }))
    }
}
