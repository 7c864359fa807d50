//! A cursor over a file's bytes. Declared sizes are checked against the bytes that follow, and every
//! error states where the cursor is.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bytes::{self, Bytes};
use crate::cancel;
use crate::error::{Error, Place, Result};
use crate::field::Unread;
use crate::file;

/// How the numbers at the cursor are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbers {
    Ascii,
    Little,
    Big,
}

impl Numbers {
    /// The encoding of a file whose numbers these are.
    pub fn encoding(self) -> String {
        let name = match self {
            Numbers::Ascii => "ascii",
            Numbers::Little => "binary-little",
            Numbers::Big => "binary-big",
        };
        name.into()
    }
}

/// A cursor in a file that is in memory.
#[derive(Clone)]
pub struct Scan<'a> {
    pub path: &'a Path,
    data: &'a [u8],
    pos: usize,
    pub numbers: Numbers,
    /// The section that errors name; empty outside of sections.
    pub section: String,
    /// The character that starts a comment up to the end of the line.
    comment: Option<u8>,
    /// Whether [`Scan::int`] reads 64 bits in binary, rather than 32.
    pub wide: bool,
    /// Whether [`Scan::real`] reads binary32 in binary, rather than binary64.
    pub single: bool,
}

/// The remedy for a file that violates its format.
const DAMAGED: &str =
    "the file is damaged or cut short: write it again with the program it comes from";

impl<'a> Scan<'a> {
    pub fn new(path: &'a Path, data: &'a [u8]) -> Self {
        Scan {
            path,
            data,
            pos: 0,
            numbers: Numbers::Ascii,
            section: String::new(),
            comment: None,
            wide: false,
            single: false,
        }
    }

    /// The same, but `start` between words begins a comment.
    pub fn with_comments(path: &'a Path, data: &'a [u8], start: u8) -> Self {
        Scan {
            comment: Some(start),
            ..Scan::new(path, data)
        }
    }

    /// An error at the cursor.
    #[cold]
    pub fn error(&self, what: impl Into<String>) -> Error {
        self.error_with(what, DAMAGED)
    }

    #[cold]
    pub fn error_with(&self, what: impl Into<String>, remedy: impl Into<String>) -> Error {
        let section = self.section.clone();
        let place = if self.numbers == Numbers::Ascii {
            let before = self.data.get(..self.pos).unwrap_or(self.data);
            let line = memchr::memchr_iter(b'\n', before).count() + 1;
            if section.is_empty() {
                Place::Line(line)
            } else {
                Place::SectionLine(section, line)
            }
        } else if section.is_empty() {
            Place::Byte(self.pos as u64)
        } else {
            Place::SectionByte(section, self.pos as u64)
        };
        Error::file(self.path, place, what, remedy)
    }

    /// The file that this line includes, beneath the folder of the file, where `depth` files are open and `files` were read;
    /// `None` if it is not there, which is reported.
    pub fn included(
        &self,
        folder: &Path,
        name: &str,
        depth: usize,
        files: usize,
        unread: &mut Vec<Unread>,
    ) -> Result<Option<(PathBuf, Arc<Bytes>)>> {
        let Some(path) = file::beneath(folder, name) else {
            let what = format!("the included file {name:?} is outside of the folder");
            return Err(self.error_with(what, "put it into the folder of this file or below"));
        };
        if depth > 16 || files > 1000 {
            let remedy = "check whether files include themselves";
            return Err(self.error_with("too many files are included", remedy));
        }
        if !path.exists() {
            let what = format!("the included file {name}, which is not there");
            unread.push(Unread::outside("INCLUDE", what));
            return Ok(None);
        }
        let bytes = bytes::read(&path).map_err(Error::io(&path, "read"))?;
        Ok(Some((path, bytes)))
    }

    /// The fewest bytes of an item, as text or in binary.
    pub fn least(&self, text: usize, binary: usize) -> usize {
        match self.numbers {
            Numbers::Ascii => text,
            Numbers::Little | Numbers::Big => binary,
        }
    }

    /// Number of bytes of the whole file.
    pub fn len(&self) -> usize {
        self.data.len()
    }

    pub fn rest(&self) -> &'a [u8] {
        self.data.get(self.pos..).unwrap_or_default()
    }

    pub fn skip_blanks(&mut self) {
        loop {
            while let Some(byte) = self.data.get(self.pos)
                && byte.is_ascii_whitespace()
            {
                self.pos += 1;
            }
            if self.comment.is_none() || self.data.get(self.pos).copied() != self.comment {
                return;
            }
            self.pos += memchr::memchr(b'\n', self.rest()).unwrap_or(self.rest().len());
        }
    }

    /// The next word, or `None` at the end of the file.
    pub fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let rest = self.rest();
        let len = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        self.pos += len;
        rest.get(..len).filter(|word| !word.is_empty())
    }

    /// The next word, without moving on.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().word()
    }

    /// The rest of the line; the cursor moves to the next line.
    pub fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let (line, passed) = match memchr::memchr(b'\n', rest) {
            Some(end) => (rest.split_at(end).0, end + 1),
            None => (rest, rest.len()),
        };
        self.pos += passed;
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// A cursor on only this line, for formats whose lines have meanings; the cursor moves to the next line. `None` at the
    /// end of the file.
    pub fn row(&mut self) -> Option<Scan<'a>> {
        let mut row = self.clone();
        let text = (self.pos < self.data.len()).then(|| self.line())?;
        row.data = row.data.get(..row.pos + text.len()).unwrap_or(row.data);
        Some(row)
    }

    /// The same cursor, with an end after a given number of bytes.
    pub fn within(mut self, bytes: usize) -> Self {
        let end = self.pos.saturating_add(bytes).min(self.data.len());
        self.data = self.data.get(..end).unwrap_or(self.data);
        self
    }

    /// The byte at the cursor.
    pub fn position(&self) -> usize {
        self.pos
    }

    /// Moves on to this byte of the file.
    pub fn go(&mut self, position: u64) -> Result<()> {
        match usize::try_from(position) {
            Ok(position) if (self.pos..=self.data.len()).contains(&position) => self.pos = position,
            _ => {
                return Err(self.error(format!(
                    "the next section is at byte {position}, where it cannot be"
                )));
            }
        }
        Ok(())
    }

    /// Moves to the next occurrence of `word`; returns `false` without moving if there is none.
    pub fn seek(&mut self, word: &[u8]) -> bool {
        let found = memchr::memmem::find(self.rest(), word);
        self.pos += found.unwrap_or(0);
        found.is_some()
    }

    pub fn advance(&mut self, bytes: usize) {
        self.pos = self.pos.saturating_add(bytes).min(self.data.len());
    }

    /// Exactly `count` times `size` bytes.
    pub fn bytes(&mut self, count: usize, size: usize) -> Result<&'a [u8]> {
        let bytes = count
            .checked_mul(size)
            .and_then(|len| self.rest().get(..len));
        let bytes = bytes.ok_or_else(|| {
            self.error(format!(
                "{count} items of {size} bytes are expected, but only {} bytes follow",
                self.rest().len()
            ))
        })?;
        self.pos += bytes.len();
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(array) = self.rest().first_chunk::<N>() else {
            return Err(self.error("the file ends where a number is expected"));
        };
        self.pos += N;
        Ok(*array)
    }

    /// The word at the cursor, for messages.
    pub fn shown(&self) -> String {
        match self.peek() {
            None => "the end of the file".into(),
            Some(word) => {
                let word = String::from_utf8_lossy(word.get(..40).unwrap_or(word));
                format!("{word:?}")
            }
        }
    }

    /// Whether the byte before the cursor ended a word.
    #[inline]
    fn at_word_end(&self) -> bool {
        self.data.get(self.pos).is_none_or(u8::is_ascii_whitespace)
    }

    #[inline]
    fn ascii_uint(&mut self) -> Result<u64> {
        self.skip_blanks();
        let start = self.pos;
        let mut value = 0u64;
        let mut overflow = false;
        while let Some(digit) = self.data.get(self.pos).map(|byte| byte.wrapping_sub(b'0'))
            && digit < 10
        {
            // Nineteen digits always fit; beyond that each one is checked.
            if self.pos - start < 19 {
                value = value * 10 + u64::from(digit);
            } else {
                match value
                    .checked_mul(10)
                    .and_then(|v| v.checked_add(u64::from(digit)))
                {
                    Some(next) => value = next,
                    None => overflow = true,
                }
            }
            self.pos += 1;
        }
        if self.pos == start || overflow || !self.at_word_end() {
            self.pos = start;
            return Err(self.error(format!("expected an integer, found {}", self.shown())));
        }
        Ok(value)
    }

    #[inline]
    fn ascii_int(&mut self) -> Result<i64> {
        self.skip_blanks();
        let start = self.pos;
        let negative = match self.data.get(self.pos) {
            Some(b'-') => true,
            Some(b'+') => false,
            _ => {
                let value = self.ascii_uint()?;
                return i64::try_from(value)
                    .map_err(|_| self.error(format!("{value} is too large")));
            }
        };
        self.pos += 1;
        if !self.data.get(self.pos).is_some_and(u8::is_ascii_digit) {
            self.pos = start;
            return Err(self.error(format!("expected an integer, found {}", self.shown())));
        }
        let value =
            i64::try_from(self.ascii_uint()?).map_err(|_| self.error("a number is too large"))?;
        Ok(if negative { -value } else { value })
    }

    #[inline]
    fn ascii_f64(&mut self) -> Result<f64> {
        self.skip_blanks();
        // Some writers put a plus sign before numbers.
        let signed = self.rest();
        let digits = signed
            .strip_prefix(b"+")
            .filter(|d| !d.starts_with(b"-"))
            .unwrap_or(signed);
        let Ok((value, len)) = fast_float2::parse_partial::<f64, _>(digits) else {
            return Err(self.error(format!("expected a number, found {}", self.shown())));
        };
        let start = self.pos;
        self.pos += len + (signed.len() - digits.len());
        if !self.at_word_end() {
            self.pos = start;
            return Err(self.error(format!("expected a number, found {}", self.shown())));
        }
        Ok(value)
    }

    /// A 32-bit integer.
    #[inline]
    pub fn i32(&mut self) -> Result<i32> {
        match self.numbers {
            Numbers::Ascii => {
                let value = self.ascii_int()?;
                i32::try_from(value)
                    .map_err(|_| self.error(format!("{value} does not fit 32 bits")))
            }
            Numbers::Little => self.array().map(i32::from_le_bytes),
            Numbers::Big => self.array().map(i32::from_be_bytes),
        }
    }

    /// A 64-bit integer that is not negative.
    #[inline]
    pub fn u64(&mut self) -> Result<u64> {
        match self.numbers {
            Numbers::Ascii => self.ascii_uint(),
            Numbers::Little => self.array().map(u64::from_le_bytes),
            Numbers::Big => self.array().map(u64::from_be_bytes),
        }
    }

    /// The number of a node or element: of 32 bits in binary, of any size in ASCII.
    #[inline]
    pub fn tag(&mut self) -> Result<u64> {
        if self.numbers == Numbers::Ascii {
            return self.u64();
        }
        let value = self.i32()?;
        u64::try_from(value)
            .map_err(|_| self.error(format!("{value} is not the number of a node or element")))
    }

    /// A binary64 that may be NaN or infinite.
    #[inline]
    pub fn any_f64(&mut self) -> Result<f64> {
        match self.numbers {
            Numbers::Ascii => self.ascii_f64(),
            Numbers::Little => self.array().map(f64::from_le_bytes),
            Numbers::Big => self.array().map(f64::from_be_bytes),
        }
    }

    /// A finite binary64.
    #[inline]
    pub fn f64(&mut self) -> Result<f64> {
        let value = self.any_f64()?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.error(format!("expected a finite number, found {value}")))
        }
    }

    /// An integer, of the width that the file has in binary.
    #[inline]
    pub fn int(&mut self) -> Result<i64> {
        match self.numbers {
            Numbers::Ascii => self.ascii_int(),
            Numbers::Little if self.wide => self.array().map(i64::from_le_bytes),
            Numbers::Big if self.wide => self.array().map(i64::from_be_bytes),
            _ => self.i32().map(i64::from),
        }
    }

    /// An integer that is not negative, of the width that the file has in binary.
    pub fn uint(&mut self) -> Result<u64> {
        let value = self.int()?;
        u64::try_from(value).map_err(|_| self.error(format!("{value} is negative")))
    }

    /// A number that may be NaN or infinite, of the width that the file has in binary.
    #[inline]
    pub fn any_real(&mut self) -> Result<f64> {
        match self.numbers {
            Numbers::Little if self.single => Ok(f32::from_le_bytes(self.array()?).into()),
            Numbers::Big if self.single => Ok(f32::from_be_bytes(self.array()?).into()),
            _ => self.any_f64(),
        }
    }

    /// A finite number, of the width that the file has in binary.
    #[inline]
    pub fn real(&mut self) -> Result<f64> {
        let value = self.any_real()?;
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.error(format!("expected a finite number, found {value}"))),
        }
    }

    /// The bytes of these numbers of integers and reals in binary.
    pub fn row_bytes(&self, ints: usize, reals: usize) -> usize {
        ints * if self.wide { 8 } else { 4 } + reals * if self.single { 4 } else { 8 }
    }

    /// Coordinates of one point.
    #[inline]
    pub fn xyz(&mut self) -> Result<[f64; 3]> {
        Ok([self.f64()?, self.f64()?, self.f64()?])
    }

    /// A vertex among `points`, which files count from 1, counted from 0.
    #[inline]
    pub fn vertex(&mut self, points: usize) -> Result<u32> {
        let vertex = self.int()?;
        match u32::try_from(vertex.wrapping_sub(1)) {
            Ok(index) if (index as usize) < points => Ok(index),
            _ => Err(self.error(format!("the vertex {vertex} does not exist among {points}"))),
        }
    }

    /// A declared number of items, each of at least `bytes` bytes; an error if the rest of the file cannot
    /// hold them.
    pub fn count(&mut self, of: &str, bytes: usize) -> Result<usize> {
        let declared = self.u64()?;
        self.believe(declared, of, bytes)
    }

    /// [`Scan::count`] of a number already read. Every section and block begins with a count, so readers of text
    /// notice an interruption here.
    pub fn believe(&self, declared: u64, of: &str, bytes: usize) -> Result<usize> {
        cancel::check()?;
        let held = (self.rest().len() + 1) / bytes.max(1);
        match usize::try_from(declared) {
            Ok(count) if count <= held && u32::try_from(count).is_ok() => Ok(count),
            _ => Err(self.error(format!(
                "{declared} {of} are declared, but the {} bytes that follow cannot hold them",
                self.rest().len()
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(text: &str) -> Scan<'_> {
        Scan::new(Path::new("test"), text.as_bytes())
    }

    #[test]
    fn whole_numbers() {
        let mut s = scan(" 12\r\n-7 +3 18446744073709551615 18446744073709551616");
        assert_eq!(s.u64().expect("12"), 12);
        assert_eq!(s.i32().expect("-7"), -7);
        assert_eq!(s.i32().expect("+3"), 3);
        assert_eq!(s.u64().expect("largest"), u64::MAX);
        assert!(s.u64().is_err());
        for bad in ["", "x", "1x", "1.5", "--1", "-", "+-1", "- 1", "2147483648"] {
            assert!(scan(bad).i32().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn finite_numbers() {
        let mut s = scan("1.5 -0 +2e3 .5 1e-320");
        let values: Vec<f64> = (0..5).map(|_| s.f64().expect("a number")).collect();
        assert_eq!(values, [1.5, 0.0, 2000.0, 0.5, 1e-320]);
        assert!(values[1].is_sign_negative());
        for bad in [
            "nan",
            "inf",
            "-Infinity",
            "1e999",
            "",
            "1,5",
            "0x10",
            "+-1",
            "1.5.2",
        ] {
            assert!(scan(bad).f64().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn counts_are_not_believed() {
        assert_eq!(scan("2 1 1").count("rows", 2).expect("two fit"), 2);
        assert!(scan("3 1 1").count("rows", 2).is_err());
        assert!(scan("1000000000000000000").count("rows", 1).is_err());
    }

    #[test]
    fn errors_name_the_line() {
        let mut s = scan("1\n2\nx");
        s.section = "$Nodes".into();
        assert_eq!([s.u64().expect("1"), s.u64().expect("2")], [1, 2]);
        let message = s.u64().expect_err("x is no number").to_string();
        assert!(message.starts_with("test:3, $Nodes: "), "{message}");
    }
}
