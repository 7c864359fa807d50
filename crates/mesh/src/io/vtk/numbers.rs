//! The words and numbers of a legacy file.

use super::read::Reader;
use crate::error::Result;
use crate::io::raw::RawNumbers;
use crate::io::scalar::{Number, Scalar, with_type};
use crate::io::scan::Numbers;
use crate::mesh::Values;

/// VTK's names of types, the first as it is written: meshio and `vtkio` know those in C.
pub(super) const TYPES: [(Number, &[&str]); 10] = [
    (Number::I8, &["char", "signed_char", "vtktypeint8"]),
    (Number::U8, &["unsigned_char", "bit", "vtktypeuint8"]),
    (Number::I16, &["short", "vtktypeint16"]),
    (Number::U16, &["unsigned_short", "vtktypeuint16"]),
    (Number::I32, &["int", "vtktypeint32"]),
    (Number::U32, &["unsigned_int", "vtktypeuint32"]),
    (
        Number::I64,
        &["long", "long_long", "__int64", "vtktypeint64"],
    ),
    (
        Number::U64,
        &[
            "unsigned_long",
            "unsigned_long_long",
            "unsigned___int64",
            "vtktypeuint64",
        ],
    ),
    (Number::F32, &["float"]),
    (Number::F64, &["double"]),
];

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// A name as VTK writes it: other bytes than letters as % and two digits; what is not UTF-8 is Latin-1.
pub(super) fn text(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len());
    let mut rest = word;
    while let Some((&first, others)) = rest.split_first() {
        let code = others.get(..2).filter(|_| first == b'%');
        let code =
            code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = others
            .get(if code.is_some() { 2 } else { 0 }..)
            .unwrap_or_default();
    }
    String::from_utf8(bytes)
        .unwrap_or_else(|error| error.as_bytes().iter().map(|&b| char::from(b)).collect())
}

impl<'a> Reader<'a> {
    pub(super) fn argument(&mut self) -> Result<&'a [u8]> {
        self.arguments::<1>().map(|[word]| word)
    }

    pub(super) fn arguments<const N: usize>(&mut self) -> Result<[&'a [u8]; N]> {
        let mut words = [&b""[..]; N];
        for word in &mut words {
            *word = self
                .scan
                .word()
                .ok_or_else(|| self.scan.error("the file ends within a keyword's line"))?;
        }
        Ok(words)
    }

    pub(super) fn number(&self, word: &[u8]) -> Result<u64> {
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.scan.error(format!("{:?} is not a count", text(word))))
    }

    pub(super) fn three(&mut self) -> Result<[f64; 3]> {
        Ok([self.scan.f64()?, self.scan.f64()?, self.scan.f64()?])
    }

    pub(super) fn product(&self, tuples: usize, components: usize) -> Result<u64> {
        let count = (tuples as u64).checked_mul(components as u64);
        count.ok_or_else(|| {
            self.scan.error(format!(
                "{tuples} tuples of {components} numbers are too many"
            ))
        })
    }

    /// Moves to where binary data begin: the next line.
    pub(super) fn data_begin(&mut self) {
        if self.numbers != Numbers::Ascii {
            self.scan.line();
        }
    }

    /// Numbers of a named type; `None` for texts, which are passed over.
    pub(super) fn values(
        &mut self,
        kind: &str,
        tuples: usize,
        components: usize,
    ) -> Result<Option<Values>> {
        let count = self.product(tuples, components)?;
        match kind.to_ascii_lowercase().as_str() {
            "string" | "utf8_string" | "variant" => self.skip_texts(kind, count).map(|()| None),
            _ => self.plain(kind, count).map(Some),
        }
    }

    /// Texts: one line each, or in binary each after its length, whose first two bits contain the width of the length.
    pub(super) fn skip_texts(&mut self, kind: &str, count: u64) -> Result<()> {
        self.scan.believe(count, "texts", 1)?;
        self.scan.skip_blanks();
        for _ in 0..count {
            if self.numbers == Numbers::Ascii || kind.eq_ignore_ascii_case("variant") {
                self.scan.line();
                continue;
            }
            let first = self.scan.bytes(1, 1)?[0];
            let more = [7, 3, 1, 0][usize::from(first >> 6)];
            let rest = self.scan.bytes(more, 1)?;
            let length = rest.iter().fold(u64::from(first & 0x3f), |sum, &byte| {
                (sum << 8) | u64::from(byte)
            });
            self.scan
                .bytes(usize::try_from(length).unwrap_or(usize::MAX), 1)?;
        }
        Ok(())
    }

    pub(super) fn plain(&mut self, kind: &str, count: u64) -> Result<Values> {
        if kind.eq_ignore_ascii_case("bit") && self.numbers != Numbers::Ascii {
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            let bytes = self.scan.bytes(count.div_ceil(8), 1)?;
            let bits = bytes
                .iter()
                .flat_map(|byte| (0..8).rev().map(move |bit| (byte >> bit) & 1));
            return Ok(Values::U8(bits.take(count).collect()));
        }
        self.raw(kind, count).map(|numbers| numbers.values())
    }

    /// Numbers of a type by VTK's name of it.
    pub(super) fn raw(&mut self, kind: &str, count: u64) -> Result<RawNumbers<'a>> {
        let lower = kind.to_ascii_lowercase();
        let known = TYPES.iter().find(|(_, names)| names.contains(&&*lower));
        let number = match (lower.as_str(), self.numbers) {
            ("vtkidtype", Numbers::Ascii) => Some(Number::I64),
            // VTK writes its own type of numbers as one of 32 bits.
            ("vtkidtype", _) => Some(Number::I32),
            _ => known.map(|(number, _)| *number),
        };
        let unknown = || {
            self.scan
                .error(format!("numbers of type {kind:?} are not read"))
        };
        let number = number.ok_or_else(unknown)?;
        with_type!(number, T => self.numbers_of::<T>(count))
    }

    pub(super) fn numbers_of<T: Scalar>(&mut self, count: u64) -> Result<RawNumbers<'a>> {
        let count = self.scan.believe(
            count,
            "numbers",
            if self.numbers == Numbers::Ascii {
                2
            } else {
                T::WIDTH
            },
        )?;
        if self.numbers != Numbers::Ascii {
            let at = self.scan.bytes(count, T::WIDTH)?;
            return Ok(RawNumbers {
                number: T::TYPE,
                bytes: at.into(),
                big_endian: true,
            });
        }
        let mut numbers = Vec::with_capacity(count);
        for _ in 0..count {
            let Some(number) = self.scan.peek().and_then(T::parse) else {
                return Err(self.scan.error(format!(
                    "expected a number of type {}, found {}",
                    T::TYPE.name(),
                    self.scan.shown()
                )));
            };
            self.scan.word();
            numbers.push(number);
        }
        Ok(RawNumbers::of(numbers))
    }
}
