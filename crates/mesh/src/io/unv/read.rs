//! The sections of a file, each between two lines of -1.

use std::collections::BTreeSet;
use std::path::Path;

use super::elements;
use super::results;
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::Content;
use crate::io::builder::{Builder, Lookup, Numbering, points_in_order};
use crate::io::scan::Scan;
use crate::mesh::{CellKind, Field, Support, Values};

/// A group: its number, its name, and the numbers of nodes and of elements.
struct Group {
    number: i64,
    name: String,
    nodes: Vec<u64>,
    elements: Vec<u64>,
}

pub struct Reader<'a> {
    pub scan: Scan<'a>,
    pub builder: Builder,
    numbers: Numbering,
    groups: Vec<Group>,
    /// The numbers of the property and of the material of each element.
    marks: Vec<[i32; 2]>,
    pub unread: Vec<Unread>,
    warnings: Vec<String>,
}

/// Reads a mesh and results from its bytes.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut reader = Reader {
        scan: Scan::new(path, bytes),
        builder: Builder::default(),
        numbers: Numbering::default(),
        groups: Vec::new(),
        marks: Vec::new(),
        unread: Vec::new(),
        warnings: Vec::new(),
    };
    let mut others = BTreeSet::new();
    // Elements and results come after the nodes, in whatever order the file has them.
    let start = reader.scan.clone();
    for pass in 0..3 {
        reader.scan = start.clone();
        while let Some(number) = reader.section()? {
            let begin = reader.scan.clone();
            match (number, pass) {
                (15 | 781 | 2411, 0) => reader.nodes(number)?,
                (164, 0) => reader.units()?,
                (2420, 0) => reader.systems()?,
                (71 | 780 | 2412 | 2431, 1) => reader.elements(number)?,
                (2417 | 2429..=2432 | 2435 | 2452 | 2467 | 2477, 1) => reader.group(number)?,
                (55 | 56 | 2414, 2) => results::read(&mut reader, number)?,
                (
                    15
                    | 55
                    | 56
                    | 71
                    | 164
                    | 780
                    | 781
                    | 2411
                    | 2412
                    | 2414
                    | 2417
                    | 2420
                    | 2429..=2432
                    | 2435
                    | 2452
                    | 2467
                    | 2477,
                    _,
                ) => {}
                // The head of the file.
                (151, _) => {}
                (other, _) => drop(others.insert(other)),
            }
            reader.scan = begin;
            reader.skip()?;
        }
        reader.scan.section.clear();
        match pass {
            0 if reader.numbers.len() == 0 => {
                return Err(reader
                    .scan
                    .error_with("the file has no nodes", "give a file with a mesh"));
            }
            0 => reader
                .builder
                .finish_points(&reader.scan, std::mem::take(&mut reader.numbers))?,
            1 => reader.finish_elements()?,
            _ => {}
        }
    }
    for number in others {
        reader
            .unread
            .tell(format!("dataset {number}"), format!("the dataset {number}"));
    }
    Ok(Content {
        mesh: reader.builder.finish(),
        warnings: reader.warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

impl<'a> Reader<'a> {
    /// The number of the next section; `None` at the end of the file.
    fn section(&mut self) -> Result<Option<u64>> {
        self.scan.section.clear();
        loop {
            let Some(row) = self.scan.row() else {
                return Ok(None);
            };
            match row.rest().trim_ascii() {
                b"" => {}
                b"-1" => break,
                _ => return Err(row.error("a dataset does not start with -1")),
            }
        }
        let Some(mut row) = self.scan.row() else {
            return Ok(None);
        };
        let word = row.clone().word().unwrap_or_default();
        if word.ends_with(b"b") {
            return Err(row.error_with("binary datasets are not read", "save the file as text"));
        }
        let number = row.u64()?;
        self.scan.section = format!("dataset {number}");
        Ok(Some(number))
    }

    /// Moves behind the end of a section.
    fn skip(&mut self) -> Result<()> {
        while let Some(row) = self.scan.row() {
            if row.rest().trim_ascii() == b"-1" {
                return Ok(());
            }
        }
        Err(self
            .scan
            .error("the line of -1 at the end of the dataset is missing"))
    }

    /// The next line of a section; `None` at its end.
    pub fn row(&mut self) -> Option<Scan<'a>> {
        let row = self.scan.clone().row()?;
        if row.rest().trim_ascii() == b"-1" {
            return None;
        }
        self.scan.row()
    }

    /// A line that must be there.
    pub fn line(&mut self) -> Result<Scan<'a>> {
        match self.row() {
            Some(row) => Ok(row),
            None => Err(self.scan.error("the dataset ends too early")),
        }
    }

    /// The integers of a line.
    pub fn ints(&mut self) -> Result<Vec<i64>> {
        let mut row = self.line()?;
        let mut found = Vec::new();
        while row.peek().is_some() {
            found.push(row.int()?);
        }
        Ok(found)
    }

    /// The numbers of a line.
    pub fn reals(&mut self) -> Result<Vec<f64>> {
        let row = self.line()?;
        reals(&row, row.rest())
    }

    fn nodes(&mut self, dataset: u64) -> Result<()> {
        while let Some(mut row) = self.row() {
            self.numbers.push(row.u64()?);
            let values = match dataset {
                15 => {
                    for _ in 0..3 {
                        row.int()?;
                    }
                    reals(&row, row.rest())?
                }
                _ => self.reals()?,
            };
            let &[x, y, z] = values.as_slice() else {
                return Err(row.error(format!("a node has 3 coordinates, not {}", values.len())));
            };
            self.builder.mesh.points.to_mut().push([x, y, z]);
        }
        Ok(())
    }

    fn units(&mut self) -> Result<()> {
        let name = String::from_utf8_lossy(self.line()?.rest())
            .trim()
            .to_owned();
        let factor = self.reals()?.first().copied().unwrap_or(1.0);
        if factor != 1.0 {
            self.warnings.push(format!(
                "lengths are in the unit {name:?}, of which {factor} are a metre"
            ));
        }
        Ok(())
    }

    /// Coordinate systems: reported if they are not the default one.
    fn systems(&mut self) -> Result<()> {
        self.line()?;
        self.line()?;
        let mut others = 0;
        while let Some(mut head) = self.row() {
            let (_, kind) = (head.u64()?, head.u64()?);
            self.line()?;
            let mut rows = Vec::new();
            for _ in 0..4 {
                rows.extend(self.reals()?);
            }
            let usual = [1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.];
            others += usize::from(kind != 0 || rows != usual);
        }
        if others > 0 {
            self.unread.tell(
                "coordinate systems",
                format!("{others} local coordinate systems: coordinates are taken as they stand"),
            );
        }
        Ok(())
    }

    fn elements(&mut self, dataset: u64) -> Result<()> {
        let mut unknown: BTreeSet<(u64, usize)> = BTreeSet::new();
        while let Some(mut row) = self.row() {
            let (number, descriptor) = (row.u64()?, row.u64()?);
            let mut rest = Vec::new();
            while row.peek().is_some() {
                rest.push(row.int()?);
            }
            // The older datasets have another property and another material first.
            let (marks, count) = match (dataset, rest.as_slice()) {
                (780, [_, property, _, material, _, count, ..]) => ([*property, *material], *count),
                (_, [property, material, _, count, ..]) => ([*property, *material], *count),
                _ => return Err(row.error("an element's head has too few numbers")),
            };
            let count = usize::try_from(count)
                .ok()
                .filter(|count| (1..=1000).contains(count));
            let count = count.ok_or_else(|| row.error("this is not a possible number of nodes"))?;
            if elements::is_beam(descriptor) {
                self.line()?;
            }
            let mut found = Vec::new();
            while found.len() < count {
                found.extend(self.ints()?);
            }
            let Some(kind) = elements::kind(descriptor, count) else {
                unknown.insert((descriptor, count));
                continue;
            };
            let point = |node| self.builder.points.as_ref()?.get(node);
            let nodes = points_in_order(&row, number, &found, &elements::order(kind), point)?;
            self.builder.cell(kind, &nodes, number, 0);
            self.marks
                .push(marks.map(|mark| i32::try_from(mark).unwrap_or(0)));
        }
        for (descriptor, count) in unknown {
            self.unread.tell(
                "elements",
                format!("the elements of type {descriptor} with {count} nodes"),
            );
        }
        Ok(())
    }

    fn group(&mut self, dataset: u64) -> Result<()> {
        // Numbers of a member, of which the first two are its kind and its number.
        let width = if matches!(dataset, 2417 | 2429..=2432) {
            2
        } else {
            4
        };
        while let Some(mut head) = self.row() {
            let mut numbers = Vec::new();
            while head.peek().is_some() {
                numbers.push(head.int()?);
            }
            let (Some(&number), Some(&count)) = (numbers.first(), numbers.last()) else {
                continue;
            };
            let name = String::from_utf8_lossy(self.line()?.rest())
                .trim()
                .to_owned();
            let mut group = Group {
                number,
                name,
                nodes: Vec::new(),
                elements: Vec::new(),
            };
            let (mut found, mut others) = (0, 0);
            while found < count {
                let row = self.ints()?;
                for member in row.chunks(width) {
                    let &[kind, number, ..] = member else {
                        continue;
                    };
                    found += 1;
                    match (kind, u64::try_from(number)) {
                        (7, Ok(number)) => group.nodes.push(number),
                        (8, Ok(number)) => group.elements.push(number),
                        _ => others += 1,
                    }
                }
            }
            if others > 0 {
                self.unread.tell(
                    &group.name,
                    format!(
                        "{others} members of the group {:?} that are neither nodes nor elements",
                        group.name
                    ),
                );
            }
            self.groups.push(group);
        }
        Ok(())
    }

    /// Once all elements are there: groups, and the fields of properties and materials if there are several.
    fn finish_elements(&mut self) -> Result<()> {
        let count = self.builder.cell_count();
        let tags: Vec<u64> = match self.builder.numbers.own() {
            [] => (1..=u64::from(count)).collect(),
            own => own.to_vec(),
        };
        let twice = |tag| self.scan.error(format!("element {tag} appears twice"));
        let cells = Lookup::new(&tags).map_err(twice)?;
        for group in std::mem::take(&mut self.groups) {
            let mut members: Vec<u32> = group
                .elements
                .iter()
                .filter_map(|&number| cells.get(number))
                .collect();
            let mut lost = group.elements.len() - members.len();
            for &node in &group.nodes {
                let point = self
                    .builder
                    .points
                    .as_ref()
                    .and_then(|points| points.get(node));
                match point {
                    Some(point) => members.push(self.builder.side(CellKind::Vertex, &[point])),
                    None => lost += 1,
                }
            }
            if lost > 0 {
                self.unread.tell(
                    &group.name,
                    format!(
                        "{lost} members of the group {:?}, which do not exist",
                        group.name
                    ),
                );
            }
            self.builder.numbered_set(group.name, group.number, members);
        }
        for (place, name) in ["property", "material"].into_iter().enumerate() {
            let values: Vec<i32> = self.marks.iter().map(|marks| marks[place]).collect();
            if values.windows(2).any(|pair| pair[0] != pair[1]) {
                let all = self.builder.cell_count() as usize;
                let field = Field::new(name, Support::Cells, 1, Values::I32(values.into()));
                let field = field.only((0..count).collect(), all);
                self.builder.mesh.fields.push(field);
            }
        }
        self.builder.finish_cells(&self.scan)
    }
}

/// Numbers that may follow each other without a blank, as Fortran writes them, with E or D before the exponent.
fn reals(row: &Scan<'_>, text: &[u8]) -> Result<Vec<f64>> {
    let mut found = Vec::new();
    let mut rest = text.trim_ascii();
    while !rest.is_empty() {
        let mut end = 1;
        while let Some(&byte) = rest.get(end) {
            let after_exponent = matches!(rest[end - 1], b'e' | b'E' | b'd' | b'D');
            if byte.is_ascii_whitespace() || (matches!(byte, b'+' | b'-') && !after_exponent) {
                break;
            }
            end += 1;
        }
        let (word, more) = rest.split_at(end);
        let text = String::from_utf8_lossy(word).replace(['D', 'd'], "E");
        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
        found.push(value.ok_or_else(|| row.error(format!("expected a number, found {text:?}")))?);
        rest = more.trim_ascii_start();
    }
    Ok(found)
}
