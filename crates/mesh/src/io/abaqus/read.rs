//! What the lines of a file say, and of the files that it includes.

use std::collections::BTreeSet;
use std::path::Path;

use super::build::Model;
use super::elements::kind;
use crate::error::{Error, Result};
use crate::file;
use crate::io::Content;
use crate::io::out::folder_of;
use crate::io::scan::Scan;
use crate::mesh::CellKind;

/// A member of a set: a number, or the name of an earlier set in capitals. Either may name an instance.
#[derive(Debug, Clone)]
pub enum Member {
    Number(Option<String>, u64),
    Range(Option<String>, [u64; 3]),
    Set(Option<String>, String),
}

/// A set of nodes or of elements.
#[derive(Debug, Clone)]
pub struct Set {
    pub name: String,
    pub of_nodes: bool,
    pub members: Vec<Member>,
}

/// Sides of elements: a set or an element, and which side; of nodes without one.
#[derive(Debug, Clone)]
pub struct Surface {
    pub name: String,
    pub of_nodes: bool,
    pub sides: Vec<(Member, String)>,
}

#[derive(Debug, Clone)]
pub struct Element {
    pub number: u64,
    pub kind: CellKind,
    pub shell: bool,
    pub nodes: Vec<u64>,
}

/// Nodes and elements with their own numbers.
#[derive(Debug, Default)]
pub struct Part {
    pub name: String,
    pub numbers: Vec<u64>,
    pub points: Vec<[f64; 3]>,
    pub elements: Vec<Element>,
    pub sets: Vec<Set>,
    pub surfaces: Vec<Surface>,
}

/// A part that is put somewhere; it may have nodes and elements of its own.
#[derive(Debug, Default)]
pub struct Instance {
    pub name: String,
    /// The name of the part in capitals.
    pub part: String,
    pub own: Part,
    pub shift: [f64; 3],
    /// Two points on an axis and an angle in degrees.
    pub turn: Option<[f64; 7]>,
}

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
/// Keywords that say nothing of the mesh.
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
/// The most files that one includes.
const MOST_FILES: usize = 1000;

/// What the data lines that follow mean.
enum Mode {
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

struct Reader<'a> {
    model: Model,
    /// Whether lines belong to the last part, to the last instance, or to the assembly.
    scope: Scope,
    mode: Mode,
    origin: Option<[[f64; 3]; 3]>,
    folder: &'a Path,
    files: usize,
    /// Keywords that are not read, and how many elements have types that no mesh has.
    skipped: BTreeSet<String>,
    unread: Vec<String>,
}

#[derive(Clone, Copy, PartialEq)]
enum Scope {
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
        unread.push(format!(
            "the keywords {}, which are no part of a mesh",
            words.join(", ")
        ));
    }
    let mesh = reader.model.build(&Scan::new(path, bytes), &mut unread)?;
    Ok(Content {
        mesh,
        format: "abaqus".into(),
        encoding: "ascii".into(),
        unread,
        ..Content::default()
    })
}

/// The fields of a line, between commas that are not in quotes.
fn fields(text: &str) -> Vec<&str> {
    let mut quoted = false;
    let is_end = |letter: char| {
        quoted ^= letter == '"';
        letter == ',' && !quoted
    };
    text.split(is_end).map(str::trim).collect()
}

pub fn real(row: &Scan<'_>, text: &str) -> Result<f64> {
    let value = match text {
        "" => Some(0.0),
        text => text
            .parse()
            .or_else(|_| text.replace(['D', 'd'], "e").parse())
            .ok(),
    };
    let finite = value.filter(|value: &f64| value.is_finite());
    finite.ok_or_else(|| row.error(format!("expected a number, found {text:?}")))
}

fn whole(row: &Scan<'_>, text: &str) -> Result<u64> {
    text.parse()
        .map_err(|_| row.error(format!("expected a whole number, found {text:?}")))
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
        let remedy = "put it into the folder of this file or below";
        let Some(path) = file::beneath(self.folder, name) else {
            return Err(row.error_with(
                format!("the included file {name:?} is outside of the folder"),
                remedy,
            ));
        };
        if depth > 16 || self.files > MOST_FILES {
            return Err(row.error_with(
                "too many files are included",
                "check whether files include themselves",
            ));
        }
        if !path.exists() {
            self.unread
                .push(format!("the included file {name}, which is not there"));
            return Ok(());
        }
        let bytes = crate::io::bytes::read(&path).map_err(Error::io(&path, "read"))?;
        self.file(&path, &bytes, depth + 1)
    }

    fn part(&mut self) -> &mut Part {
        let model = &mut self.model;
        match self.scope {
            Scope::Part if !model.parts.is_empty() => model.parts.last_mut(),
            Scope::Instance => model.instances.last_mut().map(|instance| &mut instance.own),
            _ => None,
        }
        .unwrap_or(&mut model.root)
    }

    /// The place of a set of this name, new if there is none yet.
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
                    self.unread
                        .push(format!("the elements of type {name:?}, which no mesh has"));
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
                        .push(format!("the surface {name:?} of type {kind}"));
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

    fn data(&mut self, row: &Scan<'_>, text: &str) -> Result<()> {
        let fields = fields(text);
        let reals = |most: usize| -> Result<Vec<f64>> {
            let mut found: Vec<f64> = fields
                .iter()
                .take(most)
                .map(|field| real(row, field))
                .collect::<Result<_>>()?;
            found.resize(most, 0.0);
            Ok(found)
        };
        let mut mode = std::mem::replace(&mut self.mode, Mode::Other);
        match &mut mode {
            Mode::Heading => {}
            Mode::Other => return Err(row.error(format!("{text:?} belongs to no keyword"))),
            Mode::Nodes { set, system } => {
                let number = whole(row, fields[0])?;
                let mut point = [0.0; 3];
                for (x, field) in point.iter_mut().zip(fields.iter().skip(1)) {
                    *x = real(row, field)?;
                }
                let point = self.placed(point, *system);
                let part = self.part();
                part.numbers.push(number);
                part.points.push(point);
                if let Some(set) = set.and_then(|set| part.sets.get_mut(set)) {
                    set.members.push(Member::Number(None, number));
                }
            }
            Mode::Elements { of: None, .. } => {}
            Mode::Elements {
                of: Some((kind, shell)),
                set,
                open,
            } => {
                for field in fields.iter().filter(|field| !field.is_empty()) {
                    open.push(whole(row, field)?);
                }
                if open.len() > kind.points() {
                    let number = open[0];
                    let nodes: Vec<u64> = open.drain(1..).collect();
                    open.clear();
                    if nodes.len() != kind.points() {
                        return Err(row.error(format!(
                            "element {number} has {} nodes, and a {kind} has {}",
                            nodes.len(),
                            kind.points()
                        )));
                    }
                    let (kind, shell) = (*kind, *shell);
                    let part = self.part();
                    part.elements.push(Element {
                        number,
                        kind,
                        shell,
                        nodes,
                    });
                    if let Some(set) = set.and_then(|set| part.sets.get_mut(set)) {
                        set.members.push(Member::Number(None, number));
                    }
                }
            }
            Mode::Set {
                set,
                generate,
                instance,
            } => {
                let mut members = Vec::new();
                if *generate {
                    let numbers: Vec<u64> = fields
                        .iter()
                        .filter(|field| !field.is_empty())
                        .map(|field| whole(row, field))
                        .collect::<Result<_>>()?;
                    let range = match numbers[..] {
                        [first, last] => [first, last, 1],
                        [first, last, step] => [first, last, step.max(1)],
                        _ => {
                            return Err(row.error(
                                "a generated set has a first number, a last one and a step",
                            ));
                        }
                    };
                    members.push(Member::Range(instance.clone(), range));
                } else {
                    let named = fields.iter().filter(|field| !field.is_empty());
                    members.extend(named.map(|field| member(field, instance.as_ref())));
                }
                if let Some(set) = self.part().sets.get_mut(*set) {
                    set.members.extend(members);
                }
            }
            Mode::Surface { surface } => {
                let side = fields
                    .get(1)
                    .copied()
                    .unwrap_or_default()
                    .to_ascii_uppercase();
                if let Some(surface) = self.part().surfaces.get_mut(*surface) {
                    surface.sides.push((member(fields[0], None), side));
                }
            }
            Mode::Instance { rows } => {
                if let Some(instance) = self.model.instances.last_mut() {
                    match *rows {
                        0 => instance.shift.copy_from_slice(&reals(3)?),
                        1 => instance.turn = reals(7)?.try_into().ok(),
                        _ => return Err(row.error("an instance has at most two lines")),
                    }
                }
                *rows += 1;
            }
            Mode::System { rows } => {
                let row = reals(6)?;
                let (a, b) = ([row[0], row[1], row[2]], [row[3], row[4], row[5]]);
                match (*rows, &mut self.origin) {
                    (0, _) if text.is_empty() => {}
                    (0, origin) => *origin = Some([a, b, [a[0], a[1] + 1.0, a[2]]]),
                    (_, Some(origin)) if !text.is_empty() => origin[2] = a,
                    _ => {}
                }
                *rows += 1;
            }
        }
        self.mode = mode;
        Ok(())
    }

    /// The place of a point that is given in cylindrical (C), spherical (S) or straight coordinates of the current system.
    fn placed(&self, [a, b, c]: [f64; 3], system: u8) -> [f64; 3] {
        let (sin, cos) = b.to_radians().sin_cos();
        let (rise, run) = c.to_radians().sin_cos();
        let local = match system {
            b'C' => [a * cos, a * sin, c],
            b'S' => [a * cos * run, a * sin * run, a * rise],
            _ => [a, b, c],
        };
        let Some([o, x, y]) = self
            .origin
            .map(|system| system.map(nalgebra::Vector3::from))
        else {
            return local;
        };
        let axis = (x - o).try_normalize(0.0).unwrap_or(nalgebra::Vector3::x());
        let up = axis
            .cross(&(y - o))
            .try_normalize(0.0)
            .unwrap_or(nalgebra::Vector3::z());
        let across = up.cross(&axis);
        (o + axis * local[0] + across * local[1] + up * local[2]).into()
    }
}

/// A number or a name, which may begin with that of an instance.
fn member(text: &str, instance: Option<&String>) -> Member {
    let text = text.trim_matches('"');
    if let Ok(number) = text.parse() {
        return Member::Number(instance.cloned(), number);
    }
    match text.rsplit_once('.') {
        Some((of, number)) if number.parse::<u64>().is_ok() => {
            Member::Number(Some(of.to_ascii_uppercase()), number.parse().unwrap_or(0))
        }
        Some((of, set)) if instance.is_none() => {
            Member::Set(Some(of.to_ascii_uppercase()), set.to_ascii_uppercase())
        }
        _ => Member::Set(instance.cloned(), text.to_ascii_uppercase()),
    }
}
