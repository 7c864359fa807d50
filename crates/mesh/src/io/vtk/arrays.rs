//! The arrays of a legacy file: on points, on cells, or about the whole.

use super::numbers::{text, words};
use super::read::Reader;
use crate::error::Result;
use crate::field::{GlobalArray, Tell};
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{Field, Values};

impl Reader<'_> {
    /// A keyword of data on points or cells, or of the whole.
    pub(super) fn attribute(&mut self, keyword: &str, start: &Scan) -> Result<()> {
        if keyword == "FIELD" {
            return self.field();
        }
        let known = [
            ("SCALARS", 1),
            ("VECTORS", 3),
            ("NORMALS", 3),
            ("TENSORS", 9),
            ("TENSORS6", 6),
            ("TEXTURE_COORDINATES", 2),
            ("GLOBAL_IDS", 1),
            ("PEDIGREE_IDS", 1),
            ("EDGE_FLAGS", 1),
            ("COLOR_SCALARS", 1),
            ("LOOKUP_TABLE", 4),
        ];
        let Some((_, usual)) = known.iter().find(|(known, _)| *known == keyword) else {
            return Err(start.error(format!("the keyword {keyword:?} is unknown")));
        };
        let name = text(self.argument()?);
        let mut rest = words(self.scan.line());
        let next = rest.next().map(text);
        let count_of = |word: Option<&str>, scan: &Scan| -> Result<usize> {
            let number = word.and_then(|word| word.parse::<usize>().ok());
            number.ok_or_else(|| scan.error(format!("{keyword} {name:?} lacks a number")))
        };
        if keyword == "LOOKUP_TABLE" {
            let count = count_of(next.as_deref(), start)?;
            let kind = if self.numbers == Numbers::Ascii {
                "float"
            } else {
                "unsigned_char"
            };
            self.plain(kind, 4 * count as u64)?;
            self.out
                .unread
                .tell(&*name, format!("the table {name:?} of colours"));
            return Ok(());
        }
        let (kind, components) = match keyword {
            "COLOR_SCALARS" => (String::new(), count_of(next.as_deref(), start)?),
            "TEXTURE_COORDINATES" => {
                let components = count_of(next.as_deref(), start)?;
                (rest.next().map(text).unwrap_or_default(), components)
            }
            "SCALARS" => {
                let components = rest.next().map(text);
                let components = components
                    .map(|word| count_of(Some(&word), start))
                    .transpose()?;
                (next.unwrap_or_default(), components.unwrap_or(1))
            }
            _ => (next.unwrap_or_default(), *usual),
        };
        if keyword == "SCALARS" {
            // The name of a table of colours, which need not be there.
            let mut after = self.scan.clone();
            if after
                .word()
                .is_some_and(|word| word.eq_ignore_ascii_case(b"LOOKUP_TABLE"))
            {
                self.scan = after;
                self.scan.line();
            }
        }
        let Some((_, tuples)) = self.on else {
            return Err(start.error("it comes before POINT_DATA and CELL_DATA"));
        };
        let values = if keyword == "COLOR_SCALARS" {
            Some(self.colours(tuples, components)?)
        } else {
            self.values(&kind, tuples, components)?
        };
        self.keep(name, components, values, tuples);
        Ok(())
    }

    /// Parts of one as text, bytes in binary.
    pub(super) fn colours(&mut self, tuples: usize, components: usize) -> Result<Values> {
        let count = self.product(tuples, components)?;
        if self.numbers != Numbers::Ascii {
            return self.plain("unsigned_char", count);
        }
        let parts = self.plain("float", count)?.to_f64();
        Ok(Values::U8(
            parts
                .into_iter()
                .map(|part| (255.0 * part).round() as u8)
                .collect(),
        ))
    }

    /// Named arrays, of the points or cells or, before these are named, of the whole.
    pub(super) fn field(&mut self) -> Result<()> {
        let [_, count] = self.arguments()?;
        let count = self.number(count)?;
        for _ in 0..count {
            self.skip_metadata();
            let name = text(self.argument()?);
            if name == "NULL_ARRAY" {
                continue;
            }
            self.scan.section = format!("FIELD array {name:?}");
            let [components, tuples, kind] = self.arguments()?;
            let (components, tuples) = (
                self.number(components)? as usize,
                self.number(tuples)? as usize,
            );
            let kind = text(kind);
            self.data_begin();
            let values = self.values(&kind, tuples, components)?;
            self.keep(name, components, values, tuples);
        }
        Ok(())
    }

    pub(super) fn keep(
        &mut self,
        name: String,
        components: usize,
        values: Option<Values>,
        found: usize,
    ) {
        let (Some(values), true) = (values, components > 0) else {
            self.out
                .unread
                .tell(&*name, format!("the array {name:?} of texts or of nothing"));
            return;
        };
        match self.on {
            None => self.out.whole.push(GlobalArray {
                components,
                ..GlobalArray::numbers(name, values)
            }),
            Some((_, tuples)) if tuples != found => {
                let what = format!(
                    "the array {name:?}, which has {found} tuples where {tuples} are declared"
                );
                self.out.unread.tell(&*name, what);
            }
            Some((on, _)) => {
                let field = Field::new(name, on, components, values);
                self.piece.fields.push(field);
            }
        }
    }
}
