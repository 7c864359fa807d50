//! The contents of the cards of a file, and of the files that it includes.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::CARDS;
use super::card::{Card, fields};
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::Content;
use crate::io::out::folder_of;
use crate::io::scan::Scan;
use crate::mesh::CellKind;

/// A local system: the origin, a point on the third axis, a point in the plane of the first and the third.
pub struct System {
    pub kind: u8,
    pub base: u64,
    pub points: [[f64; 3]; 3],
}

#[derive(Default)]
pub struct Reader {
    pub numbers: Vec<u64>,
    pub points: Vec<([f64; 3], u64)>,
    pub elements: Vec<Element>,
    pub systems: HashMap<u64, System>,
    /// Cards that are not read, with how many there are.
    pub others: BTreeMap<String, usize>,
    pub unread: Vec<Unread>,
    pub warnings: Vec<String>,
    pub partly: usize,
    pub files: usize,
    pub ended: bool,
}

pub struct Element {
    pub number: u64,
    pub property: i64,
    pub kind: CellKind,
    pub nodes: Vec<u64>,
}

pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut reader = Reader::default();
    // The sections before the bulk data have another syntax.
    let upper = bytes.to_ascii_uppercase();
    let mut skip = 0;
    for start in memchr::memmem::find_iter(&upper, b"BEGIN") {
        let before = upper
            .get(..start)
            .and_then(|before| before.rsplit(|&byte| byte == b'\n').next());
        let after = upper
            .get(start + 5..)
            .unwrap_or_default()
            .trim_ascii_start();
        if before.unwrap_or_default().trim_ascii().is_empty() && after.starts_with(b"BULK") {
            skip = start;
            reader
                .warnings
                .push("the lines before BEGIN BULK were skipped".into());
            break;
        }
    }
    let mut scan = Scan::new(path, bytes);
    scan.advance(skip);
    if skip > 0 {
        scan.line();
    }
    reader.file(scan, folder_of(path), 0)?;
    if reader.partly > 0 {
        reader.warnings.push(format!(
            "{} elements have some of their middle nodes: they are read without any",
            reader.partly
        ));
    }
    let others: Vec<String> = reader
        .others
        .iter()
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    if !others.is_empty() {
        reader
            .unread
            .tell("cards", format!("the cards {}", others.join(", ")));
    }
    Ok(Content {
        mesh: reader.build(&Scan::new(path, bytes))?,
        warnings: reader.warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

impl Reader {
    fn file<'a>(&mut self, mut scan: Scan<'a>, folder: &Path, depth: usize) -> Result<()> {
        self.files += 1;
        let mut open: Option<Card<'a>> = None;
        while let Some(row) = scan.row() {
            let text = String::from_utf8_lossy(row.rest()).into_owned();
            let bare = text.trim();
            if bare.is_empty() || bare.starts_with('$') || self.ended {
                continue;
            }
            let word: String = bare
                .chars()
                .take(8)
                .collect::<String>()
                .to_ascii_uppercase();
            if word.starts_with("ENDDATA") {
                self.ended = true;
                continue;
            }
            if word.starts_with("INCLUDE") {
                self.finish(open.take())?;
                let name = bare
                    .get(7..)
                    .unwrap_or_default()
                    .trim()
                    .trim_matches(['\'', '"']);
                self.include(&row, folder, name, depth)?;
                continue;
            }
            let (mut all, wide) = fields(&text);
            let continues = text.starts_with(['+', '*', ' ', '\t', ','])
                && !all[0]
                    .trim_matches(['+', '*'])
                    .chars()
                    .next()
                    .is_some_and(|c| c.is_ascii_alphabetic() && !text.starts_with(['+', '*']));
            match &mut open {
                Some(card) if continues => {
                    all.remove(0);
                    all.resize(if wide { 4 } else { 8 }, String::new());
                    card.fields.append(&mut all);
                    if card.fields.len() > 4000 {
                        return Err(row.error("a card is longer than any"));
                    }
                }
                _ if continues => return Err(row.error("a continuation follows no card")),
                _ => {
                    self.finish(open.take())?;
                    let name = all
                        .remove(0)
                        .trim_end_matches('*')
                        .trim()
                        .to_ascii_uppercase();
                    all.resize(if wide { 4 } else { 8 }, String::new());
                    open = Some(Card {
                        name,
                        fields: all,
                        row,
                    });
                }
            }
        }
        self.finish(open)
    }

    fn include(&mut self, row: &Scan<'_>, folder: &Path, name: &str, depth: usize) -> Result<()> {
        match row.included(folder, name, depth, self.files, &mut self.unread)? {
            Some((path, bytes)) => self.file(Scan::new(&path, &bytes), folder, depth + 1),
            None => Ok(()),
        }
    }

    /// Takes a card that is complete.
    fn finish(&mut self, card: Option<Card<'_>>) -> Result<()> {
        let Some(card) = card else { return Ok(()) };
        let known = CARDS.iter().find(|(name, ..)| *name == card.name);
        match (card.name.as_str(), known) {
            (_, Some(&(_, linear, quadratic, first))) => {
                self.element(&card, linear, quadratic, first)?
            }
            ("GRID", _) => {
                self.numbers.push(card.whole(0)?);
                self.points.push((
                    [card.real(2)?, card.real(3)?, card.real(4)?],
                    card.whole(1)?,
                ));
            }
            ("CORD2R" | "CORD2C" | "CORD2S", _) => {
                let at = |place: usize| -> Result<[f64; 3]> {
                    Ok([
                        card.real(place)?,
                        card.real(place + 1)?,
                        card.real(place + 2)?,
                    ])
                };
                let system = System {
                    kind: card.name.as_bytes()[5],
                    base: card.whole(1)?,
                    points: [at(2)?, at(5)?, at(8)?],
                };
                self.systems.insert(card.whole(0)?, system);
            }
            _ => *self.others.entry(card.name).or_insert(0) += 1,
        }
        Ok(())
    }

    fn element(
        &mut self,
        card: &Card<'_>,
        linear: CellKind,
        quadratic: Option<CellKind>,
        first: usize,
    ) -> Result<()> {
        let node = |place: usize| card.whole(first + place);
        let mut nodes: Vec<u64> = (0..linear.points()).map(node).collect::<Result<_>>()?;
        let mut kind = linear;
        if linear == CellKind::Line && nodes.contains(&0) {
            *self
                .others
                .entry(format!("{} to the ground", card.name))
                .or_insert(0) += 1;
            return Ok(());
        }
        if let Some(quadratic) = quadratic {
            let more = quadratic.points() - linear.points();
            let middles: Vec<u64> = (0..more)
                .map(|place| node(linear.points() + place))
                .collect::<Result<_>>()?;
            match middles.iter().filter(|&&node| node > 0).count() {
                0 => {}
                there if there == more => {
                    nodes.extend(middles);
                    kind = quadratic;
                }
                _ => self.partly += 1,
            }
        }
        let property = if first == 2 { card.whole(1)? } else { 0 };
        self.elements.push(Element {
            number: card.whole(0)?,
            // An element without a property has the property with its own number.
            property: i64::try_from(property).unwrap_or(0),
            kind,
            nodes,
        });
        Ok(())
    }
}
