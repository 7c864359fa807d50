//! Bytes to `vtkio`'s model: one [`UnstructuredGridPiece`] for each piece, and the data about the whole.
//!
//! `vtkio` (0.7.0-rc2) silently drops an array that does not decode; here it is an error that names the array.

use super::cells;
use super::codec::{Budget, Packing, Stream};
use super::layout::TEXTS;
use super::scalar::{self, Scalar};
use super::xml::{ArrayTag, Document, PieceTag};
use crate::error::{Error, Place, Result};
use crate::field::{Whole, WholeValues, data::to_i64};
use crate::mesh::Values;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashSet;
use std::path::Path;
use vtkio::IOBuffer;
use vtkio::model::{
    Attribute, Attributes, Cells, DataArray, ElementType, UnstructuredGridPiece, VertexNumbers,
};

/// Decodes the arrays of one file.
pub(super) struct Decoder<'a> {
    pub path: &'a Path,
    pub document: &'a Document<'a>,
    pub budget: Budget,
    pub warnings: Vec<String>,
}

/// How many numbers an array must have.
#[derive(Clone, Copy)]
enum Count {
    Exactly(u64),
    /// VTK takes the first so many; here the rest is warned of.
    AtLeast(u64),
    Any,
}

impl<'a> Decoder<'a> {
    /// Takes the memory of all packed arrays from the budget, before any is unpacked.
    pub fn survey(&mut self) -> Result<()> {
        let document = self.document;
        let pieces = document.pieces.iter().flat_map(|piece| {
            let data = piece.point_data.iter().chain(&piece.cell_data);
            data.chain(&piece.coordinates).chain(&piece.topology)
        });
        for tag in document.whole.iter().chain(pieces) {
            if tag.format != "ascii" {
                let stream = self.stream(tag).map_err(|what| self.refuse(tag, what))?;
                let declared = self.packing().declared(stream);
                declared
                    .and_then(|bytes| self.budget.take(bytes))
                    .map_err(|what| self.refuse(tag, what))?;
            }
        }
        Ok(())
    }

    pub fn whole(&mut self) -> Result<Vec<Whole>> {
        let document = self.document;
        let arrays = document.whole.iter();
        let whole = arrays.map(|tag| self.whole_array(tag));
        let mut whole = whole.collect::<Result<Vec<_>>>()?;
        self.restore_texts(&mut whole);
        Ok(whole)
    }

    /// Bytes become texts where the table of texts says so. What is no text stays as it is.
    fn restore_texts(&mut self, whole: &mut Vec<Whole>) {
        let mut texts = |array: &Whole| match &array.values {
            WholeValues::Numbers(Values::U8(bytes)) if bytes.last().is_none_or(|&end| end == 0) => {
                split_texts(bytes, &mut self.budget).ok()
            }
            _ => None,
        };
        let Some(table) = whole.iter().position(|array| array.name == TEXTS) else {
            return;
        };
        let Some(names) = texts(&whole[table]) else {
            return;
        };
        let names: HashSet<String> = names.into_iter().collect();
        whole.remove(table);
        for array in whole.iter_mut().filter(|array| names.contains(&array.name)) {
            if let Some(texts) = texts(array) {
                array.values = WholeValues::Text(texts);
            }
        }
    }

    fn whole_array(&mut self, tag: &ArrayTag) -> Result<Whole> {
        let components = tag.components.unwrap_or(1);
        let count = tag
            .tuples
            .map(|tuples| self.product(tag, tuples, components));
        let count = count.transpose()?;
        let values = if tag.type_name == "String" {
            WholeValues::Text(self.texts(tag, count)?)
        } else {
            let count = count.map_or(Count::Any, Count::Exactly);
            WholeValues::Numbers(scalar::values(self.array(tag, count)?))
        };
        let whole = Whole {
            name: tag.name.clone(),
            components: self.components(tag)?,
            values,
        };
        match &whole.values {
            WholeValues::Numbers(numbers) if !numbers.len().is_multiple_of(whole.components) => {
                Err(self.refuse(tag, "it ends within a tuple"))
            }
            _ => Ok(whole),
        }
    }

    pub fn piece(&mut self, tag: &PieceTag) -> Result<UnstructuredGridPiece> {
        let points = self.points(tag)?;
        let cells = self.cells(tag)?;
        Ok(UnstructuredGridPiece {
            points,
            cells,
            data: Attributes {
                point: self.attributes(&tag.point_data, tag.points)?,
                cell: self.attributes(&tag.cell_data, tag.cells)?,
            },
        })
    }

    fn points(&mut self, piece: &PieceTag) -> Result<IOBuffer> {
        let [tag] = piece.coordinates.as_slice() else {
            if piece.coordinates.is_empty() && piece.points == 0 {
                return Ok(IOBuffer::F64(Vec::new()));
            }
            let arrays = piece.coordinates.len();
            return Err(self.refuse_piece(piece, format!("<Points> has {arrays} arrays, not one")));
        };
        if tag.components.is_some_and(|components| components != 3) {
            return Err(self.refuse(tag, "points have three coordinates"));
        }
        let count = self.product(tag, piece.points, 3)?;
        let points = self.array(tag, Count::Exactly(count))?;
        let odd = match &points {
            IOBuffer::F64(numbers) => numbers.iter().position(|x| !x.is_finite()),
            IOBuffer::F32(numbers) => numbers.iter().position(|x| !x.is_finite()),
            _ => None,
        };
        match odd {
            Some(at) => {
                let what = format!("a coordinate of point {} is not finite", at / 3);
                Err(self.refuse(tag, what))
            }
            None => Ok(points),
        }
    }

    fn cells(&mut self, piece: &PieceTag) -> Result<Cells> {
        let find = |name: &str| piece.topology.iter().find(|array| array.name == name);
        let (Some(connectivity), Some(offsets), Some(types)) =
            (find("connectivity"), find("offsets"), find("types"))
        else {
            if piece.cells == 0 {
                return Ok(Cells::default());
            }
            let what = "<Cells> lacks connectivity, offsets or types".into();
            return Err(self.refuse_piece(piece, what));
        };
        let ends = self.indices(offsets, piece.cells)?;
        if !ends.is_sorted() {
            return Err(self.refuse(offsets, "the offsets do not ascend"));
        }
        let nodes = self.indices(connectivity, ends.last().copied().unwrap_or(0))?;
        if let Some(cell) = nodes.iter().position(|&node| node >= piece.points) {
            let (node, points) = (nodes[cell], piece.points);
            let what = format!("entry {cell} is point {node}, but there are {points} points");
            return Err(self.refuse(connectivity, what));
        }
        let table = cells::type_table();
        let codes = self.indices(types, piece.cells)?;
        let known = |&code: &u64| table.get(code as usize).copied().flatten();
        let Some(types) = codes.iter().map(known).collect::<Option<Vec<_>>>() else {
            let bad = codes
                .iter()
                .find(|&code| known(code).is_none())
                .unwrap_or(&0);
            return Err(self.refuse(types, format!("VTK has no cell type {bad}")));
        };
        Ok(Cells {
            cell_verts: VertexNumbers::XML {
                connectivity: nodes,
                offsets: ends,
            },
            types,
        })
    }

    fn attributes(&mut self, tags: &[ArrayTag], tuples: u64) -> Result<Vec<Attribute>> {
        let mut attributes = Vec::with_capacity(tags.len());
        for tag in tags {
            if tag.type_name == "String" {
                return Err(self.refuse(tag, "text on points or cells is not read"));
            }
            let components = self.components(tag)?;
            let count = self.product(tag, tuples, components as u64)?;
            attributes.push(Attribute::DataArray(DataArray {
                name: tag.name.clone(),
                elem: ElementType::Generic(components as u32),
                data: self.array(tag, Count::AtLeast(count))?,
            }));
        }
        Ok(attributes)
    }

    /// The components of an array, which are few enough for a `u32` and at least one.
    fn components(&self, tag: &ArrayTag) -> Result<usize> {
        let components = u32::try_from(tag.components.unwrap_or(1)).ok();
        let components = components.filter(|&components| components > 0);
        let components = components.ok_or_else(|| {
            self.refuse(tag, "its NumberOfComponents is 0 or more than 4294967295")
        })?;
        Ok(components as usize)
    }

    fn product(&self, tag: &ArrayTag, a: u64, b: u64) -> Result<u64> {
        let product = a.checked_mul(b);
        product.ok_or_else(|| self.refuse(tag, format!("{a} tuples of {b} values are too many")))
    }

    fn refuse(&self, tag: &ArrayTag, what: impl std::fmt::Display) -> Error {
        let place = Place::SectionByte(format!("array {:?}", tag.name), tag.byte);
        Error::file(self.path, place, what.to_string(), "write the file anew")
    }

    pub fn refuse_piece(&self, piece: &PieceTag, what: String) -> Error {
        let place = Place::SectionByte("<Piece>".into(), piece.byte);
        Error::file(self.path, place, what, "write the file anew")
    }

    /// Whole numbers from 0 on, whatever their width.
    fn indices(&mut self, tag: &ArrayTag, count: u64) -> Result<Vec<u64>> {
        let numbers = self.array(tag, Count::Exactly(count))?;
        let indices: Option<Vec<u64>> = match numbers {
            IOBuffer::U64(numbers) => Some(numbers),
            IOBuffer::U8(numbers) => Some(numbers.into_iter().map(u64::from).collect()),
            IOBuffer::I32(numbers) => {
                let numbers = numbers.par_iter().with_min_len(1 << 14);
                let negative = numbers.clone().any(|&x| x < 0);
                (!negative).then(|| numbers.map(|&x| x as u64).collect())
            }
            IOBuffer::I64(numbers) => {
                let numbers = numbers.par_iter().with_min_len(1 << 14);
                let negative = numbers.clone().any(|&x| x < 0);
                (!negative).then(|| numbers.map(|&x| x as u64).collect())
            }
            other => to_i64(&scalar::values(other)).and_then(|numbers| {
                let numbers = numbers.into_iter().map(|x| x.try_into().ok());
                numbers.collect()
            }),
        };
        indices.ok_or_else(|| self.refuse(tag, "it holds what is no index"))
    }

    fn array(&mut self, tag: &ArrayTag, count: Count) -> Result<IOBuffer> {
        let numbers = match tag.type_name.as_str() {
            "Int8" => self.numbers::<i8>(tag, count),
            "UInt8" => self.numbers::<u8>(tag, count),
            "Int16" => self.numbers::<i16>(tag, count),
            "UInt16" => self.numbers::<u16>(tag, count),
            "Int32" => self.numbers::<i32>(tag, count),
            "UInt32" => self.numbers::<u32>(tag, count),
            "Int64" => self.numbers::<i64>(tag, count),
            "UInt64" => self.numbers::<u64>(tag, count),
            "Float32" => self.numbers::<f32>(tag, count),
            "Float64" => self.numbers::<f64>(tag, count),
            other => Err(format!("arrays of type {other:?} are not read")),
        };
        numbers.map_err(|what| self.refuse(tag, what))
    }

    fn numbers<T: Scalar>(&mut self, tag: &ArrayTag, count: Count) -> Result<IOBuffer, String> {
        let exact = match count {
            Count::Exactly(count) => Some(count),
            Count::AtLeast(_) | Count::Any => None,
        };
        let mut numbers = if tag.format == "ascii" {
            self.ascii::<T>(tag, exact)?
        } else {
            let big_endian = self.document.big_endian;
            let bytes = exact.map(|count| count.saturating_mul(T::WIDTH as u64));
            let bytes = self.bytes(tag, bytes)?;
            if !bytes.len().is_multiple_of(T::WIDTH) {
                return Err("it ends within a number".into());
            }
            T::from_bytes(&bytes, big_endian)
        };
        if let Count::AtLeast(count) = count {
            let there = numbers.len() as u64;
            if there < count {
                return Err(format!(
                    "it has {there} numbers where the counts make {count}"
                ));
            }
            if there > count {
                self.warnings.push(format!(
                    "array {:?} has {there} numbers where the counts make {count}; the rest is left out",
                    tag.name
                ));
                numbers.truncate(count as usize);
            }
        }
        Ok(T::buffer(numbers))
    }

    fn ascii<T: Scalar>(&mut self, tag: &ArrayTag, count: Option<u64>) -> Result<Vec<T>, String> {
        // Each number takes a byte and a blank at least, so that the text bounds them.
        let most = tag
            .texts
            .iter()
            .map(|text| text.len().div_ceil(2))
            .sum::<usize>();
        let expected = count.map_or(most, |count| usize::try_from(count).unwrap_or(usize::MAX));
        if expected > most {
            return Err(format!(
                "{expected} numbers are declared where at most {most} stand"
            ));
        }
        self.budget.take((expected * T::WIDTH) as u64)?;
        let mut numbers = Vec::with_capacity(if count.is_some() { expected } else { 0 });
        let blank = |byte: &u8| byte.is_ascii_whitespace();
        let words = tag
            .texts
            .iter()
            .flat_map(|text| text.as_bytes().split(blank));
        for word in words.filter(|word| !word.is_empty()) {
            if numbers.len() == expected {
                return Err(format!("it has more than {expected} numbers"));
            }
            let number = T::parse(word).ok_or_else(|| {
                let word = String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned();
                format!("{word:?} is no {}", T::NAME)
            })?;
            numbers.push(number);
        }
        match count {
            Some(_) if numbers.len() < expected => {
                let there = numbers.len();
                Err(format!(
                    "it has {there} numbers where the counts make {expected}"
                ))
            }
            _ => Ok(numbers),
        }
    }

    /// The unpacked bytes of an array that is not ascii.
    fn bytes<'b>(
        &self,
        tag: &'b ArrayTag<'_>,
        expected: Option<u64>,
    ) -> Result<Cow<'b, [u8]>, String>
    where
        'a: 'b,
    {
        self.packing().unpack(self.stream(tag)?, expected)
    }

    fn packing(&self) -> Packing {
        Packing {
            big_endian: self.document.big_endian,
            wide_headers: self.document.wide_headers,
            compressor: self.document.compressor.unwrap_or(super::Compressor::None),
        }
    }

    /// The packed bytes of an array that is not ascii.
    fn stream<'b>(&self, tag: &'b ArrayTag<'_>) -> Result<Stream<'b>, String>
    where
        'a: 'b,
    {
        Ok(match tag.format.as_str() {
            "binary" => {
                let texts = tag.texts.iter().flat_map(|text| text.bytes());
                match tag.texts.as_slice() {
                    [text] if !has_blanks(text.trim_ascii()) => {
                        Stream::base64(Cow::Borrowed(text.trim_ascii().as_bytes()))
                    }
                    _ => Stream::base64(Cow::Owned(
                        texts.filter(|byte| !byte.is_ascii_whitespace()).collect(),
                    )),
                }
            }
            "appended" => {
                let appended = self.document.appended.as_ref();
                let appended = appended.ok_or("there is no <AppendedData>")?;
                let offset = tag.offset.ok_or("it does not say its offset")?;
                let data = usize::try_from(offset)
                    .ok()
                    .and_then(|at| appended.data.get(at..));
                let data = data.ok_or_else(|| {
                    let length = appended.data.len();
                    format!("its offset {offset} is beyond the {length} appended bytes")
                })?;
                if appended.raw {
                    Stream::Raw(data)
                } else {
                    Stream::base64(Cow::Borrowed(data.trim_ascii_end()))
                }
            }
            other => return Err(format!("the format {other:?} is unknown")),
        })
    }

    /// Texts, each of which ends with a NUL.
    fn texts(&mut self, tag: &ArrayTag, count: Option<u64>) -> Result<Vec<String>> {
        let bytes = if tag.format == "ascii" {
            // VTK itself writes bytes beyond 127 as negative numbers.
            let codes = self.ascii::<i16>(tag, None);
            let byte = |code: i16| u8::try_from(code).or(i8::try_from(code).map(|code| code as u8));
            codes.and_then(|codes| {
                let bytes = codes.into_iter().map(byte).collect::<Result<Vec<u8>, _>>();
                bytes
                    .map(Cow::Owned)
                    .map_err(|_| "a text holds what is no byte".into())
            })
        } else {
            self.bytes(tag, None)
        };
        let bytes = bytes.map_err(|what| self.refuse(tag, what))?;
        let texts = split_texts(&bytes, &mut self.budget).map_err(|what| self.refuse(tag, what))?;
        if count.is_some_and(|count| count != texts.len() as u64) {
            let there = texts.len();
            return Err(self.refuse(
                tag,
                format!("it has {there} texts, not as many as declared"),
            ));
        }
        Ok(texts)
    }
}

/// Texts, each of which ends with a NUL; the last may lack it.
fn split_texts(bytes: &[u8], budget: &mut Budget) -> Result<Vec<String>, String> {
    let mut texts = Vec::new();
    for text in bytes.split_inclusive(|&byte| byte == 0) {
        let text = text.strip_suffix(b"\0").unwrap_or(text);
        let text = std::str::from_utf8(text).map_err(|_| "a text is not UTF-8")?;
        budget.take(size_of::<String>() as u64)?;
        texts.push(text.to_owned());
    }
    Ok(texts)
}

fn has_blanks(text: &str) -> bool {
    text.bytes().any(|byte| byte.is_ascii_whitespace())
}
