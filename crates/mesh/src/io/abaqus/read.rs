//! The keywords of a file, and of the files that it includes.

use std::collections::BTreeSet;
use std::path::Path;

use super::build::Model;
use super::elements::kind;
use super::model::{Instance, Part, Set, Surface};
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::Content;
use crate::io::out::folder_of;
use crate::io::scan::Scan;
use crate::mesh::CellKind;

/// Keywords that make nodes or elements out of others.
const GENERATORS: [&str; 8] = [
    "NGEN",
    "NFILL",
    "NCOPY",
    "NMAP",
    "ELGEN",
    "ELCOPY",
    "SUBMODEL",
    "SYMMETRIC MODEL GENERATION",
];
/// Keywords that do not describe the mesh.
const SILENT: [&str; 8] = [
    "HEADING",
    "PREPRINT",
    "END PART",
    "END INSTANCE",
    "END ASSEMBLY",
    "ASSEMBLY",
    "RESTART",
    "PARAMETER",
];

/// The meaning of the following data lines.
pub enum Mode {
    Other,
    Heading,
    Nodes {
        set: Option<usize>,
        system: u8,
    },
    Elements {
        of: Option<(CellKind, bool)>,
        set: Option<usize>,
        open: Vec<u64>,
    },
    Set {
        set: usize,
        generate: bool,
        instance: Option<String>,
    },
    Surface {
        surface: usize,
    },
    Instance {
        rows: usize,
    },
    System {
        rows: usize,
    },
}

pub struct Reader<'a> {
    pub model: Model,
    /// Whether lines belong to the last part, to the last instance, or to the assembly.
    pub scope: Scope,
    pub mode: Mode,
    pub origin: Option<[[f64; 3]; 3]>,
    pub folder: &'a Path,
    pub files: usize,
    /// Keywords that are not read, and how many elements have types that no mesh has.
    pub skipped: BTreeSet<String>,
    pub unread: Vec<Unread>,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Scope {
    Assembly,
    Part,
    Instance,
}

/// Reads a mesh from its bytes.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut reader = Reader {
        model: Model::default(),
        scope: Scope::Assembly,
        mode: Mode::Other,
        origin: None,
        folder: folder_of(path),
        files: 0,
        skipped: BTreeSet::new(),
        unread: Vec::new(),
    };
    reader.file(path, bytes, 0)?;
    let mut unread = std::mem::take(&mut reader.unread);
    if !reader.skipped.is_empty() {
        let words: Vec<String> = reader.skipped.into_iter().collect();
        unread.tell(
            "keywords",
            format!(
                "the keywords {}, which are not part of a mesh",
                words.join(", ")
            ),
        );
    }
    let mesh = reader.model.build(&Scan::new(path, bytes), &mut unread)?;
    Ok(Content {
        mesh,
        unread,
        ..Content::default()
    })
}

/// The fields of a line, between commas that are not in quotes.
pub fn fields(text: &str) -> Vec<&str> {
    let mut quoted = false;
    let is_end = |letter: char| {
        quoted ^= letter == '"';
        letter == ',' && !quoted
    };
    text.split(is_end).map(str::trim).collect()
}

/// The value of a parameter of a keyword; empty where it has none.
fn parameter<'a>(words: &[&'a str], name: &str) -> Option<&'a str> {
    let mut pairs = words
        .iter()
        .skip(1)
        .map(|word| word.split_once('=').unwrap_or((word, "")));
    let found = pairs.find(|(known, _)| known.trim().eq_ignore_ascii_case(name));
    found.map(|(_, value)| value.trim().trim_matches('"'))
}

impl Reader<'_> {
    fn file(&mut self, path: &Path, bytes: &[u8], depth: usize) -> Result<()> {
        self.files += 1;
        self.model.bytes += bytes.len();
        let mut scan = Scan::new(path, bytes);
        while let Some(row) = scan.row() {
            let text = String::from_utf8_lossy(row.rest());
            let text = text.trim();
            if text.starts_with("**")
                || text.is_empty() && !matches!(self.mode, Mode::System { .. })
            {
                continue;
            }
            let Some(keyword) = text.strip_prefix('*') else {
                self.data(&row, text)?;
                continue;
            };
            let mut keyword = keyword.to_owned();
            while keyword.ends_with(',') {
                let Some(more) = scan.row() else { break };
                keyword.push_str(String::from_utf8_lossy(more.rest()).trim());
            }
            self.end(&row)?;
            let words = fields(&keyword);
            if words[0].eq_ignore_ascii_case("INCLUDE") {
                let name = parameter(&words, "INPUT").unwrap_or_default();
                self.include(&row, name, depth)?;
            } else {
                self.keyword(&row, &words)?;
            }
        }
        self.end(&scan)
    }

    fn include(&mut self, row: &Scan<'_>, name: &str, depth: usize) -> Result<()> {
        let (folder, files) = (self.folder, self.files);
        match row.included(folder, name, depth, files, &mut self.unread)? {
            Some((path, bytes)) => self.file(&path, &bytes, depth + 1),
            None => Ok(()),
        }
    }

    pub fn part(&mut self) -> &mut Part {
        let model = &mut self.model;
        match self.scope {
            Scope::Part if !model.parts.is_empty() => model.parts.last_mut(),
            Scope::Instance => model.instances.last_mut().map(|instance| &mut instance.own),
            _ => None,
        }
        .unwrap_or(&mut model.root)
    }

    /// The place of a set of this name, which is created if necessary.
    fn set(&mut self, name: Option<&str>, of_nodes: bool) -> Option<usize> {
        let name = name.filter(|name| !name.is_empty())?;
        let sets = &mut self.part().sets;
        let same = |set: &Set| set.of_nodes == of_nodes && set.name.eq_ignore_ascii_case(name);
        // Sets of many lines follow each other; a search among all would take long for many sets.
        let known = sets.iter().rposition(same);
        Some(known.unwrap_or_else(|| {
            sets.push(Set {
                name: name.to_owned(),
                of_nodes,
                members: Vec::new(),
            });
            sets.len() - 1
        }))
    }

    fn keyword(&mut self, row: &Scan<'_>, words: &[&str]) -> Result<()> {
        let keyword = words[0].to_ascii_uppercase();
        let owned = |name| parameter(words, name).map(str::to_owned);
        self.mode = match keyword.as_str() {
            "NODE" => {
                let system = parameter(words, "SYSTEM")
                    .and_then(|s| s.bytes().next())
                    .unwrap_or(b'R');
                let set = self.set(parameter(words, "NSET"), true);
                Mode::Nodes {
                    set,
                    system: system.to_ascii_uppercase(),
                }
            }
            "ELEMENT" => {
                let name = parameter(words, "TYPE")
                    .unwrap_or_default()
                    .to_ascii_uppercase();
                let of = kind(&name);
                if of.is_none() {
                    self.unread.tell(
                        &*name,
                        format!("the elements of type {name:?}, which no mesh has"),
                    );
                }
                let set = self.set(parameter(words, "ELSET"), false);
                Mode::Elements {
                    of,
                    set,
                    open: Vec::new(),
                }
            }
            "NSET" | "ELSET" => {
                let missing = || row.error(format!("{keyword} without a name"));
                let set = self
                    .set(parameter(words, &keyword), keyword == "NSET")
                    .ok_or_else(missing)?;
                Mode::Set {
                    set,
                    generate: parameter(words, "GENERATE").is_some(),
                    instance: owned("INSTANCE").map(|name| name.to_ascii_uppercase()),
                }
            }
            "SURFACE" => {
                let kind = parameter(words, "TYPE")
                    .unwrap_or("ELEMENT")
                    .to_ascii_uppercase();
                let name = owned("NAME").unwrap_or_default();
                if !["ELEMENT", "NODE"].contains(&kind.as_str()) {
                    self.unread
                        .tell(&name, format!("the surface {name:?} of type {kind}"));
                    Mode::Heading
                } else {
                    let surfaces = &mut self.part().surfaces;
                    surfaces.push(Surface {
                        name,
                        of_nodes: kind == "NODE",
                        sides: Vec::new(),
                    });
                    Mode::Surface {
                        surface: surfaces.len() - 1,
                    }
                }
            }
            "PART" => {
                self.scope = Scope::Part;
                self.origin = None;
                self.model.parts.push(Part {
                    name: owned("NAME").unwrap_or_default(),
                    ..Part::default()
                });
                Mode::Other
            }
            "INSTANCE" => {
                self.scope = Scope::Instance;
                self.model.instances.push(Instance {
                    name: owned("NAME").unwrap_or_default(),
                    part: owned("PART").unwrap_or_default().to_ascii_uppercase(),
                    ..Instance::default()
                });
                Mode::Instance { rows: 0 }
            }
            "END PART" | "END INSTANCE" | "ASSEMBLY" | "END ASSEMBLY" => {
                self.scope = Scope::Assembly;
                self.origin = None;
                Mode::Other
            }
            "SYSTEM" => {
                self.origin = None;
                Mode::System { rows: 0 }
            }
            generator if GENERATORS.contains(&generator) => {
                return Err(row.error_with(
                    format!("*{generator} makes a mesh out of numbers, which is not read"),
                    "write the mesh with all its nodes and elements from the program",
                ));
            }
            silent if SILENT.contains(&silent) => Mode::Heading,
            _ => {
                self.skipped.insert(keyword);
                Mode::Heading
            }
        };
        Ok(())
    }

    /// Checks that nothing is open where the lines of a keyword end.
    fn end(&mut self, row: &Scan<'_>) -> Result<()> {
        match &self.mode {
            Mode::Elements {
                open,
                of: Some((kind, _)),
                ..
            } if !open.is_empty() => Err(row.error(format!(
                "element {} has {} nodes, and a {kind} has {}",
                open[0],
                open.len() - 1,
                kind.points()
            ))),
            _ => Ok(()),
        }
    }
}
