//! The frame of an MSH file: the format, then its sections.

use std::path::Path;

use super::layout::{Layout, Reader};
use super::{data, elements_v2, entities, nodes_v2, v3, v4};
use crate::error::Result;
use crate::field::Tell;
use crate::io::Content;
use crate::io::builder::Builder;
use crate::io::scan::{Numbers, Scan};
use crate::mesh::Support;

/// Reads an MSH file of any version and encoding from its bytes.
///
/// # Errors
/// Any violation of the format, with section and line or byte.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut reader = Reader {
        scan: Scan::new(path, bytes),
        layout: None,
        numbers: Numbers::Ascii,
        version: "1.0".into(),
        builder: Builder::default(),
        content: Content::default(),
        waiting: Vec::new(),
    };
    while reader.section()? {}
    for place in std::mem::take(&mut reader.waiting) {
        reader.scan = place;
        reader.section()?;
    }
    reader.finish()
}

impl<'a> Reader<'a> {
    /// Reads the section at the cursor; `false` at the end of the file.
    fn section(&mut self) -> Result<bool> {
        let start = self.scan.clone();
        let numbers = std::mem::replace(&mut self.scan.numbers, Numbers::Ascii);
        self.scan.section.clear();
        let Some(word) = self.scan.peek() else {
            return Ok(false);
        };
        if !word.starts_with(b"$") || word.len() > 80 {
            return Err(self
                .scan
                .error(format!("expected a section, found {}", self.scan.shown())));
        }
        let name = String::from_utf8_lossy(word).into_owned();
        self.scan.section.clone_from(&name);
        self.scan.word();
        self.scan.line();
        let end = match name.as_str() {
            "$NOD" | "$NOE" | "$ELM" => format!("$END{}", &name[1..]),
            _ => format!("$End{}", &name[1..]),
        };
        self.scan.numbers = numbers;
        let (nodes, elements) = (self.builder.points.is_some(), self.builder.elements_seen);
        match name.as_str() {
            "$NOD" | "$NOE" | "$Nodes" | "$ParametricNodes" if nodes => {
                return Err(self.scan.error("the nodes appear twice"));
            }
            "$ELM" | "$Elements" if elements => {
                return Err(self.scan.error("the elements appear twice"));
            }
            "$ELM" | "$Elements" => self.builder.elements_seen = true,
            _ => {}
        }
        match (name.as_str(), self.layout) {
            ("$Comments", _) => self.skip(&end)?,
            ("$MeshFormat", None) => self.format()?,
            ("$MeshFormat", Some(layout)) => {
                // Gmsh writes it again before the fields that it appends to a file.
                let numbers = self.numbers;
                self.format()?;
                if (self.layout, self.numbers) != (Some(layout), numbers) {
                    return Err(self.scan.error("the format appears twice and differs"));
                }
            }
            ("$NOD" | "$NOE", None | Some(Layout::V1)) => {
                self.layout = Some(Layout::V1);
                nodes_v2::nodes(self)?;
            }
            ("$ELM", Some(Layout::V1)) => elements_v2::elements(self, Layout::V1)?,
            (_, None) => return Err(self.scan.error(format!("{name} comes before $MeshFormat"))),
            ("$PhysicalNames", Some(_)) => self.physical_names()?,
            ("$Nodes", Some(Layout::V2 | Layout::V22)) => nodes_v2::nodes(self)?,
            ("$Elements", Some(layout @ (Layout::V2 | Layout::V22))) => {
                elements_v2::elements(self, layout)?
            }
            ("$ParametricNodes", Some(Layout::V2 | Layout::V22)) => {
                nodes_v2::parametric_nodes(self)?
            }
            ("$Entities", Some(Layout::V30)) => v3::entities(self)?,
            ("$Nodes", Some(Layout::V30)) => v3::nodes(self)?,
            ("$Elements", Some(Layout::V30)) => v3::elements(self)?,
            ("$Entities", Some(layout)) if layout >= Layout::V40 => {
                entities::entities(self, layout, false)?
            }
            ("$PartitionedEntities", Some(layout)) if layout >= Layout::V40 => {
                entities::partitioned_entities(self, layout)?;
            }
            ("$Nodes", Some(layout)) if layout >= Layout::V40 => v4::nodes(self, layout)?,
            ("$Elements", Some(layout)) if layout >= Layout::V40 => v4::elements(self, layout)?,
            ("$Periodic", Some(_)) if self.builder.points.is_none() => {
                self.waiting.push(start);
                self.skip(&end)?;
            }
            ("$Periodic", Some(layout)) => entities::periodic(self, layout)?,
            ("$GhostElements", Some(layout)) if layout >= Layout::V40 => {
                entities::ghosts(self, layout)?
            }
            ("$NodeData", Some(_)) => data::read(self, Support::Points)?,
            ("$ElementData", Some(_)) => data::read(self, Support::Cells)?,
            ("$ElementNodeData", Some(_)) => data::read(self, Support::CellPoints)?,
            // Gmsh writes the polynomials of its own elements with data at their nodes, and these are what such data mean here.
            ("$InterpolationScheme", Some(_)) => {
                let what = "values at the nodes of cells are taken for those of Lagrange elements, whatever $InterpolationScheme says";
                self.content.warnings.push(what.to_owned());
                self.skip(&end)?;
            }
            _ => {
                self.content
                    .unread
                    .tell(&name, format!("the section {name}"));
                self.skip(&end)?;
            }
        }
        self.scan.numbers = Numbers::Ascii;
        if self.scan.peek() != Some(end.as_bytes()) && !self.ends_otherwise(&end, numbers) {
            // The declared count or the numbers are wrong; in binary the byte is more useful than the line.
            self.scan.numbers = numbers;
            return Err(self
                .scan
                .error(format!("expected {end}, found {}", self.scan.shown())));
        }
        self.scan.word();
        self.scan.numbers = if name == "$MeshFormat" {
            self.numbers
        } else {
            numbers
        };
        Ok(true)
    }

    /// Whether a section of a text ends in another way that Gmsh takes too: a misspelt end, or rows beyond those declared.
    fn ends_otherwise(&mut self, end: &str, numbers: Numbers) -> bool {
        if numbers != Numbers::Ascii {
            return false;
        }
        let word = String::from_utf8_lossy(self.scan.peek().unwrap_or_default()).into_owned();
        // Not the end of a file that was cut short.
        if word.starts_with("$End") && self.scan.rest().trim_ascii_start().len() > word.len() {
            self.content
                .warnings
                .push(format!("{end} is written {word}"));
            return true;
        }
        let ahead = self.scan.rest();
        let next = memchr::memchr(b'$', ahead).and_then(|place| ahead.get(place..));
        let found = next.is_some_and(|next| next.starts_with(end.as_bytes()));
        if found && !word.starts_with('$') {
            let section = &self.scan.section;
            self.content.unread.tell(
                section,
                format!("what {section} has beyond the number of rows that it declares"),
            );
            self.scan.seek(end.as_bytes());
        }
        found
    }

    /// Moves to the end of a section whose content is not read.
    fn skip(&mut self, end: &str) -> Result<()> {
        if self.scan.seek(end.as_bytes()) {
            Ok(())
        } else {
            Err(self.scan.error(format!("{end} is missing")))
        }
    }

    /// `$MeshFormat`: version, 0 for ASCII or 1 for binary, size of a number; then, in binary, the number one.
    fn format(&mut self) -> Result<()> {
        self.scan.numbers = Numbers::Ascii;
        let version = String::from_utf8_lossy(self.scan.word().unwrap_or_default()).into_owned();
        // Some write more digits than the version has.
        let layout = match version.parse::<f64>() {
            Ok(2.0 | 2.1) => Layout::V2,
            Ok(2.2) => Layout::V22,
            Ok(3.0) => Layout::V30,
            Ok(4.0) => Layout::V40,
            Ok(4.1) => Layout::V41,
            _ => {
                return Err(self.scan.error_with(
                    format!("MSH version {version:?} is not known"),
                    "save the mesh as MSH 4.1 or 2.2",
                ));
            }
        };
        self.layout = Some(layout);
        self.version = version;
        let binary = match self.scan.i32()? {
            0 => false,
            1 => true,
            other => {
                return Err(self.scan.error(format!(
                    "the encoding is 0 (ASCII) or 1 (binary), not {other}"
                )));
            }
        };
        let size = self.scan.i32()?;
        let more = String::from_utf8_lossy(self.scan.line().trim_ascii()).into_owned();
        if !more.is_empty() {
            self.content
                .unread
                .tell("$MeshFormat", format!("{more:?} behind the version"));
        }
        self.numbers = Numbers::Ascii;
        if binary {
            if size != 8 {
                return Err(self.scan.error_with(
                    format!("numbers of {size} bytes are not read"),
                    "save the mesh with numbers of 8 bytes, as Gmsh does",
                ));
            }
            if layout == Layout::V30 {
                return Err(self.scan.error_with(
                    "MSH 3.0 is read as text only",
                    "save the mesh as MSH 4.1 or 2.2",
                ));
            }
            self.numbers = match self.scan.bytes(1, 4)? {
                [1, 0, 0, 0] => Numbers::Little,
                [0, 0, 0, 1] => Numbers::Big,
                _ => {
                    return Err(self
                        .scan
                        .error("the number that gives the byte order is not 1"));
                }
            };
        }
        Ok(())
    }

    /// `$PhysicalNames`, which is text in binary files too. Version 2.0 had no dimension before the number.
    fn physical_names(&mut self) -> Result<()> {
        self.scan.numbers = Numbers::Ascii;
        let count = self.scan.count("names", 4)?;
        self.scan.line();
        for _ in 0..count {
            self.scan.skip_blanks();
            let line = self.scan.clone().line().trim_ascii();
            let quotes = (memchr::memchr(b'"', line), memchr::memrchr(b'"', line));
            let (Some(first), Some(last)) = quotes else {
                return Err(self.scan.error("a physical name is not in quotes"));
            };
            let (head, name, more) = (
                line.get(..first),
                line.get(first + 1..last),
                line.get(last + 1..),
            );
            let (Some(head), Some(name)) = (head, name) else {
                return Err(self.scan.error("a physical name is not in quotes"));
            };
            // The name may follow the number without a blank.
            let mut numbers = self.scan.clone();
            let numbers = numbers.row().map(|row| row.within(head.len()));
            let mut numbers = numbers.unwrap_or_else(|| self.scan.clone());
            let first = numbers.i32()?;
            let (dim, tag) = match numbers.peek() {
                None => (None, first),
                Some(_) => (
                    u8::try_from(first).ok().filter(|dim| *dim <= 3),
                    numbers.i32()?,
                ),
            };
            let name = String::from_utf8(name.to_owned()).map_err(|_| {
                self.scan.error_with(
                    "a physical name is not UTF-8",
                    "save the mesh with UTF-8 names",
                )
            })?;
            let more = String::from_utf8_lossy(more.unwrap_or_default())
                .trim()
                .to_owned();
            if !more.is_empty() {
                self.content
                    .unread
                    .tell(&name, format!("{more:?} behind the name {name:?}"));
            }
            let kept = self.builder.name(dim, i64::from(tag), name.clone());
            if kept != name {
                self.content.unread.tell(
                    &name,
                    format!("the name {name:?} of group {tag}, which is called {kept:?} already"),
                );
            }
            self.scan.line();
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Content> {
        self.scan.section.clear();
        if self.builder.points.is_none() {
            return Err(self.scan.error("the file has no nodes"));
        }
        if !self.builder.elements_seen {
            return Err(self.scan.error("the file has no elements"));
        }
        self.content.version = Some(self.version);
        self.content.encoding = self.numbers.encoding();
        self.content.mesh = self.builder.finish();
        Ok(self.content)
    }
}
