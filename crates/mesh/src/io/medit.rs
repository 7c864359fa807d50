//! Medit's `.mesh`, text, and `.meshb`, binary of versions 1 to 4, in one to three dimensions: keywords, each with a count
//! and rows that end in a label.
//!
//! The format has no names of groups: in text they are kept in comment lines, which other readers skip.

use std::collections::HashMap;
use std::path::Path;

use super::labels::{Labels, Rows};
use super::loss::Losses;
use super::out::Out;
use super::scan::{Numbers, Scan};
use super::{Content, Native, Options, refuse_unsound};
use crate::error::Result;
use crate::field::GlobalArray;
use crate::mesh::{CellKind, Group, Mesh};

pub static FORMAT: Native = Native {
    title: "Medit",
    names: &["medit"],
    suffixes: &["mesh", "meshb"],
    has_binary: true,
    holds_whole: false,
    recognises,
    read,
    write,
};

/// Keywords of cells and their numbers in binary files. Nodes stand in Gmsh's order, but for the [`SWAPPED`].
pub const CELLS: [(&str, i32, CellKind); 11] = [
    ("Edges", 5, CellKind::Line),
    ("Triangles", 6, CellKind::Triangle),
    ("Quadrilaterals", 7, CellKind::Quadrangle),
    ("Tetrahedra", 8, CellKind::Tetrahedron),
    ("Hexahedra", 10, CellKind::Hexahedron),
    ("Prisms", 9, CellKind::Prism),
    ("Pyramids", 49, CellKind::Pyramid),
    ("EdgesP2", 25, CellKind::Line3),
    ("TrianglesP2", 24, CellKind::Triangle6),
    ("QuadrilateralsQ2", 27, CellKind::Quadrangle9),
    ("TetrahedraP2", 30, CellKind::Tetrahedron10),
];

/// The nodes of the quadratic tetrahedron that Gmsh has the other way round.
const SWAPPED: (usize, usize) = (8, 9);

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

/// Keywords that mark points and cells or relate them to a geometry; skipped, as they hold no part of the mesh.
const MARKS: [&str; 17] = [
    "AngleOfCornerBound",
    "Corners",
    "EdgeOnGeometricEdge",
    "Geometry",
    "Identifier",
    "MaximalAngleOfCorner",
    "RequiredEdges",
    "RequiredQuadrilaterals",
    "RequiredTriangles",
    "RequiredVertices",
    "Ridges",
    "SubDomainFromGeom",
    "SubDomainFromMesh",
    "SubDomain",
    "VertexOnGeometricEdge",
    "VertexOnGeometricVertex",
    "VertexOnSupportVertex",
];

/// Keywords of the curves that bamg makes meshes of; no mesher writes them.
const GEOMETRY: [&str; 5] = [
    "AngleOfCornerBound",
    "MaximalAngleOfCorner",
    "SubDomain",
    "MetricVertices",
    "hVertices",
];

/// Starts the comment that names a group; dimension, label and name follow.
const NAME: &[u8] = b"# faceoff group ";

/// The word that text files start with.
const FIRST: &[u8] = b"MeshVersionFormatted";

fn recognises(bytes: &[u8]) -> bool {
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

    /// The next keyword, which is the section that errors name from here on; the dimension is none. `None` after the last.
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

    /// The keyword of a binary file, after which stands where the next one is.
    fn number(&mut self) -> Result<Option<String>> {
        let scan = &mut self.scan;
        if let Some(next) = self.next.take() {
            scan.go(next)?;
        }
        if scan.rest().is_empty() {
            return Ok(None);
        }
        let number = scan.i32()?;
        let cells = CELLS.iter().map(|&(name, number, _)| (name, number));
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
    fn skip(&mut self) -> Result<()> {
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

    /// The declared number of rows of whole numbers and reals.
    pub fn count(&mut self, of: &str, ints: usize, reals: usize) -> Result<usize> {
        let scan = &mut self.scan;
        let declared = scan.uint()?;
        let binary = ints * if scan.wide { 8 } else { 4 } + reals * if scan.single { 4 } else { 8 };
        scan.believe(declared, of, scan.least(2 * (ints + reals), binary))
    }

    /// `ascii`, `binary-little` or `binary-big`.
    fn encoding(&self) -> &'static str {
        match self.scan.numbers {
            Numbers::Ascii => "ascii",
            Numbers::Little => "binary-little",
            Numbers::Big => "binary-big",
        }
    }
}

/// Reads a mesh from its bytes.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut sections = Sections::new(path, bytes)?;
    let mut content = Content {
        format: "medit".into(),
        version: Some(sections.version.to_string()),
        encoding: sections.encoding().into(),
        ..Content::default()
    };
    let mut rows = Rows::default();
    let (mut has_vertices, mut curves, mut values) = (false, false, false);
    while let Some(word) = sections.next()? {
        curves |= GEOMETRY.contains(&word.as_str());
        values |= word.starts_with("SolAt");
        let cell = CELLS.iter().find(|(name, ..)| *name == word);
        match (word.as_str(), cell) {
            ("Vertices", _) => {
                let dimension = sections.dimension;
                if dimension == 0 {
                    return Err(sections
                        .scan
                        .error("the vertices come before the dimension"));
                }
                if has_vertices {
                    return Err(sections.scan.error("the vertices appear twice"));
                }
                has_vertices = true;
                let count = sections.count("vertices", 1, dimension)?;
                rows.points(&mut sections.scan, count, dimension)?;
            }
            (_, Some(&(_, _, kind))) => {
                if !has_vertices {
                    return Err(sections.scan.error("cells come before the vertices"));
                }
                let count = sections.count("cells", kind.points() + 1, 0)?;
                rows.cells(&mut sections.scan, count, kind)?;
                if kind == CellKind::Tetrahedron10 {
                    rows.swap(SWAPPED.0, SWAPPED.1);
                }
            }
            (mark, None) if MARKS.contains(&mark) => {
                content.warnings.push(format!("{mark} was skipped"));
                sections.skip()?;
            }
            (other, None) => {
                content.unread.push(format!("the section {other}"));
                sections.skip()?;
            }
        }
    }
    let scan = &sections.scan;
    if !has_vertices {
        let (what, remedy) = match values {
            true => (
                "these are values on a mesh, not a mesh",
                "give the mesh, which has the same name and the suffix .mesh or .meshb",
            ),
            false => ("the file has no vertices", "give a file with a mesh"),
        };
        return Err(scan.error_with(what, remedy));
    }
    if curves && rows.dims().all(|dim| dim < 2) {
        return Err(scan.error_with(
            "this is a geometry for bamg, the curves around a mesh, not a mesh",
            "give the mesh that bamg makes of it",
        ));
    }
    if !sections.ended {
        content
            .warnings
            .push("the file has no End: it may be cut short".into());
    }
    content.mesh = rows.finish();
    name_groups(&mut content.mesh.groups, bytes);
    Ok(content)
}

/// Gives groups the names in the comments.
fn name_groups(groups: &mut [Group], bytes: &[u8]) {
    let mut names: HashMap<(u8, i64), String> = HashMap::new();
    for start in memchr::memmem::find_iter(bytes, NAME) {
        let rest = bytes.get(start + NAME.len()..).unwrap_or_default();
        let end = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
        let Some(Ok(line)) = rest.get(..end).map(std::str::from_utf8) else {
            continue;
        };
        let mut parts = line.strip_suffix('\r').unwrap_or(line).splitn(3, ' ');
        let dim = parts.next().and_then(|word| word.parse().ok());
        let tag = parts.next().and_then(|word| word.parse().ok());
        if let (Some(dim), Some(tag), Some(name)) = (dim, tag, parts.next()) {
            names.insert((dim, tag), name.to_owned());
        }
    }
    for group in groups {
        group.name = names.remove(&(group.dim, group.tag));
    }
}

/// Writes a mesh, with two coordinates if it lies in the plane z = 0; in binary if asked to, or by the suffix `.meshb`.
fn write(path: &Path, mesh: &Mesh, _: &[GlobalArray], options: &Options) -> Result<Vec<String>> {
    refuse_unsound(path, mesh)?;
    let mut losses = Losses::default();
    let mut labels = Labels::of_cells(mesh, &mut losses);
    let held =
        |kind: CellKind| CELLS.iter().any(|(.., known)| *known == kind) || kind == CellKind::Vertex;
    let rest = mesh.cells().filter(|(_, kind, _)| !held(*kind)).count();
    losses.lose_some(rest, "cells of the kinds that it has no keyword for");
    labels.label_points(&mut losses);
    losses.note_gmsh(mesh);

    // FreeFEM and dolfinx expect a planar mesh to have two coordinates.
    let flat = mesh.dim() <= 2 && mesh.points.iter().all(|point| point[2] == 0.0);
    let dimension = if flat { 2 } else { 3 };
    let mut out = Out::to(path)?;
    let is_meshb = path
        .extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case("meshb"));
    if options.binary || is_meshb {
        labels.lose_names(&mut losses);
        write_binary(&mut out, &labels, mesh, dimension);
    } else {
        write_text(&mut out, &labels, mesh, dimension, &mut losses);
    }
    let warnings = losses.settle(path, FORMAT.title, options.lossy)?;
    out.save(path)?;
    Ok(warnings)
}

/// The nodes of a cell in Medit's order, counted from 1.
fn numbers(kind: CellKind, nodes: &[u32]) -> impl Iterator<Item = u32> {
    let mut nodes = nodes.to_vec();
    if kind == CellKind::Tetrahedron10 {
        nodes.swap(SWAPPED.0, SWAPPED.1);
    }
    nodes.into_iter().map(|node| node + 1)
}

fn write_text(
    out: &mut Out,
    labels: &Labels<'_>,
    mesh: &Mesh,
    dimension: usize,
    losses: &mut Losses,
) {
    out.text("MeshVersionFormatted 2\n");
    for group in &mesh.groups {
        if let Some(name) = &group.name {
            if name.contains(['\n', '\r']) {
                losses.lose(format!("the name {name:?}, which has a line end"));
                continue;
            }
            out.text(&String::from_utf8_lossy(NAME))
                .int(group.dim)
                .int(group.tag)
                .text(name)
                .text("\n");
        }
    }
    out.text(&format!(
        "Dimension {dimension}\nVertices\n{}\n",
        mesh.points.len()
    ));
    labels.write_points(out, dimension);
    for (keyword, _, kind) in CELLS {
        let count = mesh.count(kind);
        if count > 0 {
            out.text(&format!("{keyword}\n{count}\n"));
            for (nodes, label) in labels.cells(kind) {
                numbers(kind, nodes).for_each(|node| {
                    out.int(node);
                });
                out.int(label).end();
            }
        }
    }
    out.text("End\n");
}

/// Version 3: binary64, whole numbers of 32 bits, and 64 bits for where sections are.
fn write_binary(out: &mut Out, labels: &Labels<'_>, mesh: &Mesh, dimension: usize) {
    let ints =
        |out: &mut Out, ints: &[i32]| ints.iter().for_each(|it| out.append(&it.to_le_bytes()));
    ints(out, &[1, 3, 3]);
    let mut at = 24u64;
    out.append(&at.to_le_bytes());
    ints(out, &[dimension as i32]);
    // A section: keyword, place of the next one, number of its rows.
    let mut begin = |out: &mut Out, keyword: i32, count: usize, row: usize| {
        at += 16 + (count * row) as u64;
        ints(out, &[keyword]);
        out.append(&at.to_le_bytes());
        ints(out, &[count as i32]);
    };
    begin(out, 4, mesh.points.len(), 8 * dimension + 4);
    for (point, label) in labels.points() {
        point[..dimension]
            .iter()
            .for_each(|x| out.append(&x.to_le_bytes()));
        ints(out, &[label]);
    }
    for (_, keyword, kind) in CELLS {
        let count = mesh.count(kind);
        if count > 0 {
            begin(out, keyword, count, 4 * (kind.points() + 1));
            for (nodes, label) in labels.cells(kind) {
                numbers(kind, nodes).for_each(|node| out.append(&node.to_le_bytes()));
                ints(out, &[label]);
            }
        }
    }
    ints(out, &[54]);
    out.append(&0u64.to_le_bytes());
}
