//! The data items of an XDMF file: numbers in its text, in HDF5 files, or in files of plain bytes.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::tree::Tree;
use crate::error::{Error, Result};
use crate::field::data::with_numbers;
use crate::file;
use crate::io::raw::RawNumbers;
use crate::io::scalar::Number;
use crate::io::vtu::unpack::Unpacked;
use crate::io::{bytes, hdf5};
use crate::mesh::Values;

/// Numbers with the lengths of their dimensions.
pub struct Item {
    pub shape: Vec<usize>,
    pub numbers: RawNumbers<'static>,
}

impl Item {
    /// Rows, and numbers of each; a list has one of each.
    pub fn rows(&self) -> (usize, usize) {
        let count = self.numbers.len();
        let rows = self.shape.first().copied().unwrap_or(count);
        (rows, count.checked_div(rows).unwrap_or(1))
    }

    pub fn values(&self) -> Values {
        self.numbers.values()
    }
}

/// Reads the data items of one file.
pub struct Items<'a> {
    pub path: &'a Path,
    pub tree: &'a Tree<'a>,
    /// The HDF5 files that have been opened.
    opened: RefCell<HashMap<String, hdf5::Group>>,
}

/// How deep items may be nested.
const DEPTH: usize = 8;

impl<'a> Items<'a> {
    pub fn new(path: &'a Path, tree: &'a Tree<'a>) -> Self {
        Items {
            path,
            tree,
            opened: RefCell::default(),
        }
    }

    pub fn refuse(&self, what: impl Into<String>) -> Error {
        let remedy = "write the file again with the program it comes from";
        Error::whole(self.path, what, remedy)
    }

    /// The data items in an element.
    pub fn of(&self, element: usize) -> Result<Vec<usize>> {
        self.tree
            .named(element, "DataItem")
            .map_err(|what| self.refuse(what))
    }

    /// The one data item in an element.
    pub fn only(&self, element: usize) -> Result<Item> {
        match self.of(element)?[..] {
            [one] => self.read(one),
            ref several => {
                let tag = &self.tree.at(element).name;
                Err(self.refuse(format!("<{tag}> has {} data items, not one", several.len())))
            }
        }
    }

    pub fn read(&self, item: usize) -> Result<Item> {
        self.read_at(item, 0)
    }

    fn read_at(&self, item: usize, depth: usize) -> Result<Item> {
        let element = self.tree.at(item);
        let dimensions = element.get("Dimensions").unwrap_or_default();
        let shape: Vec<usize> = whole_numbers(dimensions)
            .ok_or_else(|| self.refuse(format!("the dimensions {dimensions:?} are not numbers")))?;
        let kind = element
            .get("ItemType")
            .unwrap_or("Uniform")
            .to_ascii_lowercase();
        if depth >= DEPTH {
            return Err(self.refuse("data items stand too deep in each other"));
        }
        let of_depth = |item: usize| self.read_at(item, depth + 1);
        match kind.as_str() {
            "uniform" => {}
            "hyperslab" => {
                let [selection, data] = self.of(item)?[..] else {
                    return Err(self.refuse("a hyperslab has a selection and data"));
                };
                let numbers: Vec<usize> = of_depth(selection)?
                    .values()
                    .to_f64()
                    .iter()
                    .map(|&n| n as usize)
                    .collect();
                let rank = numbers.len() / 3;
                let of: Vec<[usize; 3]> = (0..rank)
                    .map(|k| [numbers[k], numbers[rank + k], numbers[2 * rank + k]])
                    .collect();
                return self.selected(data, &of, depth);
            }
            "function" => {
                let parts = self.of(item)?;
                let function = element.get("Function").unwrap_or_default();
                let word: String = function.split_ascii_whitespace().collect();
                let names: Vec<String> = (0..parts.len()).map(|k| format!("${k}")).collect();
                let is_join = word.replace(';', ",") == format!("JOIN({})", names.join(","));
                // The components of a tensor at most, so that no few bytes stand for many.
                if !is_join || parts.len() > 9 {
                    return Err(self.refuse(format!("the function {function:?} is not read")));
                }
                let columns = parts
                    .into_iter()
                    .map(|part| Ok(of_depth(part)?.values().to_f64()));
                let columns = columns.collect::<Result<Vec<Vec<f64>>>>()?;
                let rows = columns.first().map_or(0, Vec::len);
                if columns.iter().any(|column| column.len() != rows) {
                    return Err(self.refuse("what is joined is not of one length"));
                }
                let row = |k: usize| columns.iter().map(move |column| column[k]);
                let numbers = RawNumbers::of((0..rows).flat_map(row).collect::<Vec<f64>>());
                return Ok(Item { shape, numbers });
            }
            other => {
                return Err(self.refuse(format!("data items of the kind {other:?} are not read")));
            }
        }
        let count = shape.iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        let count = count.ok_or_else(|| self.refuse("a data item has too many values"))?;
        let format = element.get("Format").unwrap_or("XML").to_ascii_uppercase();
        let numbers = match format.as_str() {
            "XML" => {
                with_numbers!(self.inline(item, &element.text())?, all => RawNumbers::of(all.into_vec()))
            }
            "HDF" => self.in_hdf5(element.text().trim(), None)?,
            "BINARY" => self.in_bytes(item, count)?,
            other => return Err(self.refuse(format!("data in the format {other:?} are not read"))),
        };
        if numbers.len() != count && !shape.is_empty() {
            let what = format!(
                "a data item of the dimensions {dimensions} has {} values",
                numbers.len()
            );
            return Err(self.refuse(what));
        }
        let shape = if shape.is_empty() {
            vec![numbers.len()]
        } else {
            shape
        };
        Ok(Item { shape, numbers })
    }

    /// A part of an item: the first index, the step and the count along each dimension.
    fn selected(&self, item: usize, of: &[[usize; 3]], depth: usize) -> Result<Item> {
        let shape = of.iter().map(|[.., count]| *count).collect();
        let element = self.tree.at(item);
        if element
            .get("Format")
            .is_some_and(|format| format.eq_ignore_ascii_case("HDF"))
        {
            let numbers = self.in_hdf5(element.text().trim(), Some(of))?;
            return Ok(Item { shape, numbers });
        }
        let whole = self.read_at(item, depth + 1)?;
        let inside = |(&[start, step, count], &n): (&[usize; 3], &usize)| {
            let last = count
                .saturating_sub(1)
                .checked_mul(step)
                .and_then(|span| span.checked_add(start));
            count == 0 || last.is_some_and(|last| last < n)
        };
        if of.len() != whole.shape.len() || !of.iter().zip(&whole.shape).all(inside) {
            return Err(self.refuse(format!(
                "the selection {of:?} of data of the shape {:?}",
                whole.shape
            )));
        }
        let mut places = vec![0];
        for (&[start, step, count], &n) in of.iter().zip(&whole.shape) {
            let next = |&place: &usize| (0..count).map(move |k| place * n + start + k * step);
            places = places.iter().flat_map(next).collect();
        }
        let all = whole.values().to_f64();
        let numbers: Vec<f64> = places.iter().map(|&place| all[place]).collect();
        let numbers = RawNumbers::of(numbers);
        Ok(Item { shape, numbers })
    }

    /// Whether an item holds floats, and the bytes of each.
    fn kind(&self, item: usize) -> (&'a str, usize) {
        let element = self.tree.at(item);
        let kind = element
            .get("NumberType")
            .or(element.get("DataType"))
            .unwrap_or("Float");
        let size = element.get("Precision").and_then(|size| size.parse().ok());
        let usual = if kind.to_ascii_lowercase().ends_with("char") {
            1
        } else {
            4
        };
        (kind, size.unwrap_or(usual))
    }

    fn inline(&self, item: usize, text: &str) -> Result<Values> {
        let (kind, size) = self.kind(item);
        let words = text.split_ascii_whitespace();
        if kind.eq_ignore_ascii_case("float") {
            let mut numbers = Vec::new();
            for word in words {
                numbers.push(
                    fast_float2::parse(word)
                        .map_err(|_| self.refuse(format!("{word:?} is not a number")))?,
                );
            }
            return Ok(match size {
                4 if self.tree.at(item).get("Precision").is_some() => {
                    Values::F32(numbers.iter().map(|&n: &f64| n as f32).collect())
                }
                _ => Values::F64(numbers.into()),
            });
        }
        let mut numbers = Vec::new();
        for word in words {
            let number = word.parse().ok().or_else(|| {
                word.parse::<f64>()
                    .ok()
                    .filter(|n| n.fract() == 0.0)
                    .map(|n| n as i64)
            });
            numbers.push(number.ok_or_else(|| self.refuse(format!("{word:?} is not an integer")))?);
        }
        Ok(Values::I64(numbers.into()))
    }

    /// Data as in `u.h5:/Function/u/0`, perhaps with a selection behind `|`.
    fn in_hdf5(&self, place: &str, of: Option<&[[usize; 3]]>) -> Result<RawNumbers<'static>> {
        let (place, selection) = place.split_once('|').unwrap_or((place, ""));
        let Some((name, path)) = place.rsplit_once(':') else {
            return Err(self.refuse(format!(
                "{place:?} names no file and data set, as in \"u.h5:/u\""
            )));
        };
        let name = name.trim();
        let known = self.opened.borrow().get(name).cloned();
        let root = match known {
            Some(root) => root,
            None => {
                let (path, bytes) = self.beside(name)?;
                let root = hdf5::open(&path, &bytes)?;
                self.opened
                    .borrow_mut()
                    .insert(name.to_owned(), root.clone());
                root
            }
        };
        let data = root.needed(path.trim())?;
        let lists: Option<Vec<Vec<usize>>> = selection.split(':').map(whole_numbers).collect();
        match (of, lists.as_deref()) {
            (Some(of), _) => data.raw_of(of),
            (None, Some([start, step, count, ..]))
                if start.len() == step.len() && step.len() == count.len() =>
            {
                let of = start
                    .iter()
                    .zip(step)
                    .zip(count)
                    .map(|((&a, &b), &c)| [a, b, c]);
                data.raw_of(&of.collect::<Vec<_>>())
            }
            _ if !selection.is_empty() => {
                Err(self.refuse(format!("the selection {selection:?} is not understood")))
            }
            _ => data.raw(None),
        }
    }

    /// The bytes of a file in the folder of this one or below.
    fn beside(&self, name: &str) -> Result<(std::path::PathBuf, Arc<bytes::Bytes>)> {
        let folder = self.path.with_file_name("");
        // meshio gives the whole path of files of bytes.
        let around = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &folder
        };
        let around = around.canonicalize().unwrap_or_default();
        let inner = Path::new(name)
            .strip_prefix(&around)
            .ok()
            .and_then(Path::to_str);
        let path = file::beneath(&folder, inner.unwrap_or(name));
        let path = path.ok_or_else(|| {
            self.refuse(format!(
                "{name:?} is not in the folder of this file or below it"
            ))
        })?;
        let bytes = bytes::read(&path).map_err(|error| {
            let what = format!("its data are in {name:?}, which cannot be read: {error}");
            Error::whole(self.path, what, "put that file next to this one")
        })?;
        Ok((path, bytes))
    }

    fn in_bytes(&self, item: usize, count: usize) -> Result<RawNumbers<'static>> {
        let element = self.tree.at(item);
        let name = element.text();
        let name = name.trim();
        let (_, bytes) = self.beside(name)?;
        let (kind, size) = self.kind(item);
        let seek = element.get("Seek").unwrap_or("0").parse().ok();
        let end = count.checked_mul(size).zip(seek);
        let part = end.and_then(|(length, seek): (_, usize)| Some(seek..seek.checked_add(length)?));
        let part = part.filter(|part| part.end <= bytes.len());
        let part = part.ok_or_else(|| {
            let seek = seek.unwrap_or_default();
            let what =
                format!("{name:?} has not {count} values of {size} bytes from byte {seek} on");
            self.refuse(what)
        })?;
        let number = match (kind.to_ascii_lowercase().as_str(), size) {
            ("float", _) => Number::float(size),
            ("int", _) | ("char", 1) | ("short", 2) => Number::integer(size, true),
            ("uint", _) | ("uchar", 1) | ("ushort", 2) => Number::integer(size, false),
            _ => None,
        };
        let number = number.ok_or_else(|| {
            self.refuse(format!(
                "numbers of the type {kind} of {size} bytes are not read"
            ))
        })?;
        let endian = element.get("Endian");
        Ok(RawNumbers {
            number,
            bytes: Unpacked::Part(bytes, part),
            big_endian: endian.is_some_and(|endian| endian.eq_ignore_ascii_case("big")),
        })
    }
}

/// Integers with blanks or commas between them.
fn whole_numbers(text: &str) -> Option<Vec<usize>> {
    let words = text
        .split([' ', ',', '\t', '\n', '\r'])
        .filter(|word| !word.is_empty());
    words.map(|word| word.parse().ok()).collect()
}
