//! The keywords of a mesh or of its values, text or binary.

use std::path::Path;

use super::cells;
use crate::error::Result;
use crate::io::scan::{Numbers, Scan};

/// Further keywords that are known by their numbers in binary files.
const KEYWORDS: [(&str, i32); 24] = [
    ("Dimension", 3),
    ("Vertices", 4),
    ("Corners", 13),
    ("Ridges", 14),
    ("RequiredVertices", 15),
    ("RequiredEdges", 16),
    ("RequiredTriangles", 17),
    ("RequiredQuadrilaterals", 18),
    ("TangentAtEdgeVertices", 19),
    ("NormalAtVertices", 20),
    ("NormalAtTriangleVertices", 21),
    ("HexahedraQ2", 33),
    ("End", 54),
    ("Tangents", 59),
    ("Normals", 60),
    ("TangentAtVertices", 61),
    ("SolAtVertices", 62),
    ("SolAtEdges", 63),
    ("SolAtTriangles", 64),
    ("SolAtQuadrilaterals", 65),
    ("SolAtTetrahedra", 66),
    ("SolAtPrisms", 67),
    ("SolAtHexahedra", 68),
    ("SolAtPyramids", 26),
];

/// The word that text files start with.
const FIRST: &[u8] = b"MeshVersionFormatted";

pub fn recognises(bytes: &[u8]) -> bool {
    let text = Scan::with_comments(Path::new(""), bytes, b'#').word() == Some(FIRST);
    text || byte_order(bytes).is_some()
}

/// How numbers are written in a binary file: it starts with 1, a version and the dimension's keyword.
fn byte_order(bytes: &[u8]) -> Option<Numbers> {
    let words = bytes.first_chunk::<12>()?.as_chunks::<4>().0;
    let fits = |words: Vec<i32>| matches!(words[..], [1, 1..=4, 3]);
    match () {
        () if fits(words.iter().map(|&word| i32::from_le_bytes(word)).collect()) => {
            Some(Numbers::Little)
        }
        () if fits(words.iter().map(|&word| i32::from_be_bytes(word)).collect()) => {
            Some(Numbers::Big)
        }
        () => None,
    }
}

/// The number of a keyword of values in binary files.
pub fn number(keyword: &str) -> Option<i32> {
    let found = KEYWORDS.iter().find(|(known, _)| *known == keyword);
    found.map(|(_, number)| *number)
}

/// The keywords of a mesh or of its values, text or binary.
pub struct Sections<'a> {
    pub scan: Scan<'a>,
    pub version: i64,
    /// 0 before it is known.
    pub dimension: usize,
    /// Where the next keyword of a binary file is.
    next: Option<u64>,
    /// Whether the keyword `End` was there.
    pub ended: bool,
}

impl<'a> Sections<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        let mut scan = Scan::with_comments(path, bytes, b'#');
        match byte_order(bytes) {
            Some(numbers) => {
                scan.numbers = numbers;
                scan.i32()?;
            }
            None if scan.word() == Some(FIRST) => {}
            None => return Err(scan.error("the file does not start with MeshVersionFormatted")),
        }
        let version = scan.i32()?.into();
        (scan.single, scan.wide) = (version == 1, version >= 4);
        Ok(Sections {
            scan,
            version,
            dimension: 0,
            next: None,
            ended: false,
        })
    }

    /// The next keyword, which is the section that errors name from here on; the dimension is not one. `None` after the last.
    pub fn next(&mut self) -> Result<Option<String>> {
        let binary = self.scan.numbers != Numbers::Ascii;
        loop {
            self.scan.section.clear();
            let word = match binary {
                true => self.number()?,
                false => self.word()?,
            };
            match word.as_deref() {
                None | Some("End") => {
                    self.ended = word.is_some();
                    return Ok(None);
                }
                // This and the numbers of fields have 32 bits in all versions.
                Some("Dimension") => match self.scan.i32()? {
                    found @ 1..=3 if self.dimension == 0 => self.dimension = found as usize,
                    other => {
                        return Err(self.scan.error(format!(
                            "the dimension must be 1, 2 or 3 and given once, not {other}"
                        )));
                    }
                },
                Some(_) => return Ok(word),
            }
        }
    }

    fn word(&mut self) -> Result<Option<String>> {
        let Some(word) = self.scan.word() else {
            return Ok(None);
        };
        if !word.first().is_some_and(u8::is_ascii_alphabetic) {
            let word = String::from_utf8_lossy(word.get(..40).unwrap_or(word)).into_owned();
            return Err(self
                .scan
                .error(format!("expected a keyword, found {word:?}")));
        }
        self.scan.section = String::from_utf8_lossy(word.get(..80).unwrap_or(word)).into_owned();
        Ok(Some(self.scan.section.clone()))
    }

    /// The keyword of a binary file; the position of the next one follows it.
    fn number(&mut self) -> Result<Option<String>> {
        let scan = &mut self.scan;
        if let Some(next) = self.next.take() {
            scan.go(next)?;
        }
        if scan.rest().is_empty() {
            return Ok(None);
        }
        let number = scan.i32()?;
        let cells = cells().map(|(name, number, _)| (name, number));
        let mut known = cells.chain(KEYWORDS).filter(|(_, known)| *known == number);
        let name = known.next().map(|(name, _)| name.to_owned());
        let name = name.unwrap_or_else(|| format!("keyword {number}"));
        scan.section.clone_from(&name);
        let wide = std::mem::replace(&mut scan.wide, self.version >= 3);
        let next = scan.uint();
        scan.wide = wide;
        self.next = Some(next?).filter(|&next| next > 0);
        Ok(Some(name))
    }

    /// Skips a section: in text everything up to the next word that is not a number.
    pub fn skip(&mut self) -> Result<()> {
        let scan = &mut self.scan;
        if scan.numbers != Numbers::Ascii {
            return match self.next {
                Some(_) => Ok(()),
                None => Err(scan.error("it is not said where the next section is")),
            };
        }
        while let Some(word) = scan.peek() {
            if word.starts_with(b"\"") {
                scan.skip_blanks();
                scan.advance(1);
                if !scan.seek(b"\"") {
                    return Err(scan.error("a quoted text does not end"));
                }
                scan.advance(1);
                continue;
            }
            if word.first().is_some_and(u8::is_ascii_alphabetic) {
                break;
            }
            scan.word();
        }
        Ok(())
    }

    /// The declared number of rows of integers and reals.
    pub fn count(&mut self, of: &str, ints: usize, reals: usize) -> Result<usize> {
        let scan = &mut self.scan;
        let declared = scan.uint()?;
        let binary = scan.row_bytes(ints, reals);
        scan.believe(declared, of, scan.least(2 * (ints + reals), binary))
    }
}
