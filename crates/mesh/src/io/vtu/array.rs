//! The numbers of one array of a file, in any of its four encodings.
//!
//! `vtkio` (0.7.0-rc2) silently drops an array that does not decode; here it is an error that names the array.

use super::stream::Stream;
use super::unpack::{Budget, Packing, Unpacked};
use super::xml::{ArrayTag, Document};
use crate::cancel;
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::raw::RawNumbers;
use crate::io::scalar::{Number, Scalar, with_type};
use crate::mesh::Values;
use std::borrow::Cow;
use std::path::Path;

/// How many numbers an array must have.
#[derive(Clone, Copy)]
pub(super) enum Count {
    Exactly(u64),
    /// VTK reads this many and ignores the rest, of which we warn.
    AtLeast(u64),
    Any,
}

/// Decodes the arrays of one file.
pub(super) struct Decoder<'a> {
    pub path: &'a Path,
    pub document: &'a Document<'a>,
    pub budget: Budget,
    pub warnings: Vec<String>,
    /// Arrays that the mesh has no place for.
    pub unread: Vec<Unread>,
}

impl<'a> Decoder<'a> {
    pub fn array(&mut self, tag: &ArrayTag, count: Count) -> Result<Values> {
        cancel::check()?;
        let numbers = match tag.number {
            Some(number) => with_type!(number, T => self.values::<T>(tag, count)),
            None => Err(unknown(tag)),
        };
        numbers.map_err(|what| self.refuse(tag, what))
    }

    /// The numbers of an array that must have `count`.
    pub fn numbers<'b>(&mut self, tag: &'b ArrayTag<'_>, count: u64) -> Result<RawNumbers<'b>>
    where
        'a: 'b,
    {
        cancel::check()?;
        let numbers = match tag.number {
            Some(number) => self.raw(number, tag, Count::Exactly(count)),
            None => Err(unknown(tag)),
        };
        numbers.map_err(|what| self.refuse(tag, what))
    }

    fn values<T: Scalar>(&mut self, tag: &ArrayTag, count: Count) -> Result<Values, String> {
        let exact = match count {
            Count::Exactly(count) => Some(count),
            Count::AtLeast(_) | Count::Any => None,
        };
        let mut numbers = if tag.format == "ascii" {
            self.ascii::<T>(tag, exact)?
        } else {
            let RawNumbers {
                bytes, big_endian, ..
            } = self.raw(T::TYPE, tag, count)?;
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
                let what = format!(
                    "the rest of the array {:?}, which has {there} numbers where the counts make {count}",
                    tag.name
                );
                self.unread.tell(&tag.name, what);
                numbers.truncate(count as usize);
            }
        }
        Ok(T::values(numbers))
    }

    fn raw<'b>(
        &mut self,
        number: Number,
        tag: &'b ArrayTag<'_>,
        count: Count,
    ) -> Result<RawNumbers<'b>, String>
    where
        'a: 'b,
    {
        let (exact, known) = match count {
            Count::Exactly(count) => (Some(count), Some(count)),
            Count::AtLeast(count) => (None, Some(count)),
            Count::Any => (None, None),
        };
        if tag.format == "ascii" {
            return with_type!(number, T => self.ascii::<T>(tag, exact).map(RawNumbers::of));
        }
        let [expected, known] = [exact, known]
            .map(|count| count.map(|count| count.saturating_mul(number.size() as u64)));
        let bytes = self.bytes(tag, expected, known)?;
        if !bytes.len().is_multiple_of(number.size()) {
            return Err("it ends within a number".into());
        }
        Ok(RawNumbers {
            number,
            bytes,
            big_endian: self.document.big_endian,
        })
    }

    fn ascii<T: Scalar>(&mut self, tag: &ArrayTag, count: Option<u64>) -> Result<Vec<T>, String> {
        // Each number takes at least a byte and a blank, so the text bounds their number.
        let most = tag
            .texts
            .iter()
            .map(|text| text.len().div_ceil(2))
            .sum::<usize>();
        let expected = count.map_or(most, |count| usize::try_from(count).unwrap_or(usize::MAX));
        if expected > most {
            return Err(format!(
                "{expected} numbers are declared where at most {most} fit"
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
                format!("{word:?} is not of type {}", T::TYPE.name())
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

    /// The unpacked bytes of an array that is not ascii, `expected` many, or `known` by the counts of the mesh.
    fn bytes<'b>(
        &mut self,
        tag: &'b ArrayTag<'_>,
        expected: Option<u64>,
        known: Option<u64>,
    ) -> Result<Unpacked<'b>, String>
    where
        'a: 'b,
    {
        let mut stream = self.stream(tag)?;
        // GetFEM writes another number where the length belongs, one that is beyond all there is; VTK goes by the counts.
        if let Some(known) = known
            && self.packing().lies(&mut stream)?
        {
            self.warnings.push(format!(
                "array {:?} says that it is longer than the file; as many numbers are read as the counts make",
                tag.name
            ));
            return stream.take(known).map(Unpacked::from);
        }
        self.packing().unpack(self.stream(tag)?, expected)
    }

    /// The memory that an array will take, as far as it is declared before unpacking.
    pub fn declared(&self, tag: &ArrayTag) -> Result<u64, String> {
        if tag.format == "ascii" {
            return Ok(0);
        }
        self.packing().declared(self.stream(tag)?)
    }

    fn packing(&self) -> Packing {
        Packing {
            big_endian: self.document.big_endian,
            wide_headers: self.document.wide_headers,
            compressor: self.document.compressor,
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
    pub fn texts(&mut self, tag: &ArrayTag, count: Option<u64>) -> Result<Vec<String>> {
        let bytes = if tag.format == "ascii" {
            // VTK itself writes bytes beyond 127 as negative numbers.
            let codes = self.ascii::<i16>(tag, None);
            let byte = |code: i16| u8::try_from(code).or(i8::try_from(code).map(|code| code as u8));
            codes.and_then(|codes| {
                let bytes = codes.into_iter().map(byte).collect::<Result<Vec<u8>, _>>();
                bytes
                    .map(Unpacked::from)
                    .map_err(|_| "a text holds a value that is not a byte".into())
            })
        } else {
            self.bytes(tag, None, None)
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

fn unknown(tag: &ArrayTag) -> String {
    format!("arrays of type {:?} are not read", tag.type_name)
}

/// Texts, each of which ends with a NUL; the last may lack it.
pub(super) fn split_texts(bytes: &[u8], budget: &mut Budget) -> Result<Vec<String>, String> {
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
