//! Cards and their fields.

use crate::error::{Error, Result};
use crate::io::scan::Scan;

/// A card: its name in capitals, its fields, and its position.
pub struct Card<'a> {
    pub name: String,
    pub fields: Vec<String>,
    pub row: Scan<'a>,
}

/// The fields of a line, the first being the name or the mark of a continuation, without the mark at its end.
pub fn fields(text: &str) -> (Vec<String>, bool) {
    let text = text.split('$').next().unwrap_or_default().trim_end();
    if text.contains(',') {
        let mut all: Vec<String> = text
            .split(',')
            .map(|field| field.trim().to_owned())
            .collect();
        let wide = all[0].contains('*');
        all.truncate(if wide { 5 } else { 9 });
        return (all, wide);
    }
    let text = text.replace('\t', "        ");
    let characters: Vec<char> = text.chars().collect();
    let part = |from: usize, width: usize| -> String {
        let part = characters.iter().skip(from).take(width);
        part.collect::<String>().trim().to_owned()
    };
    let first = part(0, 8);
    let wide = first.contains('*');
    let (width, count) = if wide { (16, 4) } else { (8, 8) };
    let mut all = vec![first];
    all.extend((0..count).map(|place| part(8 + place * width, width)));
    (all, wide)
}

impl Card<'_> {
    fn field(&self, place: usize) -> &str {
        self.fields.get(place).map_or("", String::as_str)
    }

    /// An integer; 0 where the field is empty.
    pub fn whole(&self, place: usize) -> Result<u64> {
        match self.field(place) {
            "" => Ok(0),
            text => text.parse().map_err(|_| self.refuse(text, "an integer")),
        }
    }

    /// A number, whose exponent may have only a sign, as in 1.5-3; 0 where the field is empty.
    pub fn real(&self, place: usize) -> Result<f64> {
        let text = self.field(place);
        if text.is_empty() {
            return Ok(0.0);
        }
        let mut plain = text.to_ascii_uppercase().replace('D', "E");
        if !plain.contains('E')
            && let Some(sign) = plain.rfind(['+', '-']).filter(|&sign| sign > 0)
        {
            plain.insert(sign, 'E');
        }
        let value = plain.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| self.refuse(text, "a number"))
    }

    fn refuse(&self, text: &str, what: &str) -> Error {
        self.row
            .error(format!("expected {what} on {}, found {text:?}", self.name))
    }
}
