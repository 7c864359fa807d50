//! The XML of a VTK file: its arrays, and where their data are. No data are decoded here.
//!
//! `vtkio` (0.7.0-rc2) hands the whole file to a deserializer, which fails on raw appended bytes, on counts with
//! blanks (FreeFEM), on a missing `byte_order` (dolfinx) or `version`, and drops `<FieldData>`. Here the appended
//! section, which need not be XML, is cut off by its bytes before a tokenizer sees the rest.

use super::Compressor;
use crate::error::{Error, Place, Result};
use memchr::memmem;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use std::borrow::Cow;
use std::path::Path;

/// The kinds of grids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Grid {
    #[default]
    Unstructured,
    Poly,
    Image,
    Rectilinear,
    Structured,
}

const GRIDS: [(Grid, &str); 5] = [
    (Grid::Unstructured, "UnstructuredGrid"),
    (Grid::Poly, "PolyData"),
    (Grid::Image, "ImageData"),
    (Grid::Rectilinear, "RectilinearGrid"),
    (Grid::Structured, "StructuredGrid"),
];

impl Grid {
    /// VTK's name of the grid, with a `P` in front where its pieces are files.
    fn of_name(name: &str) -> Option<(Grid, bool)> {
        let named = |name: &str| GRIDS.iter().find(|(_, known)| *known == name);
        let serial = named(name).map(|(grid, _)| (*grid, false));
        serial.or_else(|| Some((named(name.strip_prefix('P')?)?.0, true)))
    }

    /// The usual suffix of its files.
    pub fn suffix(self) -> &'static str {
        match self {
            Grid::Unstructured => "vtu",
            Grid::Poly => "vtp",
            Grid::Image => "vti",
            Grid::Rectilinear => "vtr",
            Grid::Structured => "vts",
        }
    }

    fn name(self) -> &'static str {
        let found = GRIDS.iter().find(|(grid, _)| *grid == self);
        found.map_or("", |(_, name)| name)
    }
}

/// The bytes of a file with its XML as UTF-8: what is not is Latin-1, as VTK writes the words of its users.
pub(super) fn to_utf8(bytes: &[u8]) -> Cow<'_, [u8]> {
    let end = memmem::find(bytes, b"<AppendedData").unwrap_or(bytes.len());
    let (head, tail) = bytes.split_at(end);
    if std::str::from_utf8(head).is_ok() {
        return Cow::Borrowed(bytes);
    }
    let text: String = head.iter().map(|&byte| char::from(byte)).collect();
    Cow::Owned([text.as_bytes(), tail].concat())
}

/// Whether the first bytes are those of a file of one of these grids.
pub(super) fn is_of(bytes: &[u8], grids: &[Grid]) -> bool {
    let Some(at) = memmem::find(
        bytes.get(..4096.min(bytes.len())).unwrap_or_default(),
        b"<VTKFile",
    ) else {
        return false;
    };
    let rest = bytes.split_at(at).1;
    let tag = rest.split(|&byte| byte == b'>').next().unwrap_or_default();
    let tag = String::from_utf8_lossy(tag.get(1..).unwrap_or_default());
    let mut found = None;
    let tag = BytesStart::from_content(&*tag, "VTKFile".len().min(tag.len()));
    // A tag that is broken is refused later, with its place.
    let _ = attributes(&tag, |name, value| {
        if name == "type" {
            found = Grid::of_name(value.trim());
        }
        Ok(())
    });
    found.is_some_and(|(grid, _)| grids.contains(&grid))
}

/// The relevant elements of a file.
#[derive(Default)]
pub(super) struct Document<'a> {
    pub grid: Grid,
    /// `.pvtu` and its like: the pieces are files.
    pub parallel: bool,
    /// Of an image: where its point (0, 0, 0) is, the distances of points, and the directions of the axes by rows.
    pub origin: [f64; 3],
    pub spacing: Option<[f64; 3]>,
    pub direction: Option<[f64; 9]>,
    pub whole_extent: Option<[i64; 6]>,
    pub version: Option<String>,
    pub big_endian: bool,
    pub wide_headers: bool,
    pub compressor: Compressor,
    pub whole: Vec<ArrayTag<'a>>,
    pub pieces: Vec<PieceTag<'a>>,
    pub appended: Option<Appended<'a>>,
}

#[derive(Default)]
pub(super) struct PieceTag<'a> {
    pub byte: u64,
    pub source: Option<String>,
    pub points: u64,
    pub cells: u64,
    /// First and last index of the points in each direction of a structured grid.
    pub extent: Option<[i64; 6]>,
    /// Cells in each of the sections of `polygons`.
    pub counts: [u64; 4],
    pub point_data: Vec<ArrayTag<'a>>,
    pub cell_data: Vec<ArrayTag<'a>>,
    pub coordinates: Vec<ArrayTag<'a>>,
    pub topology: Vec<ArrayTag<'a>>,
    /// Connectivity and offsets of the sections [`POLYGONS`].
    pub polygons: [Vec<ArrayTag<'a>>; 4],
}

/// The sections of polygonal data in the order in which their cells count, the attributes with their numbers of cells, and
/// VTK's types of their cells.
pub(super) const POLYGONS: [(&str, &str, u8); 4] = [
    ("Verts", "NumberOfVerts", 2),
    ("Lines", "NumberOfLines", 4),
    ("Polys", "NumberOfPolys", 7),
    ("Strips", "NumberOfStrips", 6),
];

impl<'a> PieceTag<'a> {
    /// All arrays.
    pub fn arrays(&self) -> impl Iterator<Item = &ArrayTag<'a>> {
        let data = self.point_data.iter().chain(&self.cell_data);
        let rest = self.coordinates.iter().chain(&self.topology);
        data.chain(rest).chain(self.polygons.iter().flatten())
    }
}

/// A `<DataArray>` or `<Array>`.
#[derive(Default)]
pub(super) struct ArrayTag<'a> {
    pub byte: u64,
    pub name: String,
    pub type_name: String,
    pub components: Option<u64>,
    pub tuples: Option<u64>,
    pub format: String,
    pub offset: Option<u64>,
    /// The text between its tags, without blanks and child elements such as `<InformationKey>`.
    pub texts: Vec<&'a str>,
}

/// The bytes from the underscore to the end of `<AppendedData>`.
pub(super) struct Appended<'a> {
    pub raw: bool,
    pub data: &'a [u8],
}

/// Far beyond any real file: VTK itself nests seven deep.
const MAX_DEPTH: usize = 64;
const MAX_ATTRIBUTES: usize = 128;
const MAX_ARRAYS: usize = 100_000;
pub(super) const MAX_ARRAYS_IN_SECTION: usize = 4096;

impl Document<'_> {
    /// Whether the file's version is lower.
    pub fn is_before(&self, version: [u32; 2]) -> bool {
        let own = self.version.as_deref().unwrap_or("0.1").split('.');
        own.map(|part| part.trim().parse().unwrap_or(0)).lt(version)
    }

    /// How the arrays are stored, as the first of them is.
    pub fn encoding(&self) -> String {
        let pieces = self.pieces.iter();
        let mut arrays = pieces.flat_map(PieceTag::arrays);
        let format = arrays.next().map(|array| array.format.as_str());
        let appended = self.appended.as_ref().map(|appended| appended.raw);
        let base = match (format, appended) {
            (Some("appended"), Some(true)) => "appended raw",
            (Some("appended"), _) => "appended base64",
            (Some("binary"), _) => "base64",
            _ => return "ascii".into(),
        };
        match self.compressor {
            Compressor::None => base.into(),
            Compressor::Zlib => format!("{base}, zlib"),
            Compressor::Lz4 => format!("{base}, LZ4"),
            Compressor::Lzma => format!("{base}, LZMA"),
        }
    }
}

/// What stands for elements that are not read, or not where they are.
const OTHER: &str = "";
/// The grid, whatever its kind.
const GRID: &str = "Grid";
/// An array; its own name is that of either kind.
const ARRAY: &str = "DataArray";

pub(super) fn parse<'a>(path: &Path, bytes: &'a [u8]) -> Result<Document<'a>> {
    let fail = |byte: u64, what: String| {
        Error::file(
            path,
            Place::Byte(byte),
            what,
            "write the file again: it is not sound VTK",
        )
    };
    let (head, tail) = match memmem::find(bytes, b"<AppendedData") {
        Some(at) => bytes.split_at(at),
        None => (bytes, &[][..]),
    };
    let text = std::str::from_utf8(head)
        .map_err(|error| fail(error.valid_up_to() as u64, "the XML is not UTF-8".into()))?;
    let mut parser = Parser::default();
    let mut reader = Reader::from_str(text);
    loop {
        let byte = reader.buffer_position();
        let event = reader.read_event().map_err(|error| {
            fail(
                reader.error_position(),
                format!("not well-formed XML: {error}"),
            )
        })?;
        if matches!(event, Event::Eof) {
            break;
        }
        parser.event(event, byte).map_err(|what| fail(byte, what))?;
    }
    let end = head.len() as u64;
    let complete = if tail.is_empty() {
        parser.root_seen && parser.open.is_empty()
    } else {
        parser.open == ["VTKFile"]
    };
    if !complete {
        return Err(fail(end, "the file ends before its elements do".into()));
    }
    if !parser.grid_seen {
        let grid = parser.document.grid.name();
        return Err(fail(end, format!("there is no <{grid}>")));
    }
    if !tail.is_empty() {
        parser.document.appended =
            Some(appended(tail).map_err(|(byte, what)| fail(end + byte, what))?);
    }
    Ok(parser.document)
}

/// Cuts `<AppendedData encoding="…">_…</AppendedData></VTKFile>`; the error is a position and a text.
fn appended(tail: &[u8]) -> Result<Appended<'_>, (u64, String)> {
    let end = tail.len() as u64;
    let cut_off = || (end, "the file ends within <AppendedData>".to_owned());
    let tag_end = memchr::memchr(b'>', tail).ok_or_else(cut_off)?;
    let tag = std::str::from_utf8(&tail[1..tag_end])
        .map_err(|_| (0, "the tag <AppendedData> is not UTF-8".to_owned()))?;
    let tag = BytesStart::from_content(tag, "AppendedData".len());
    let mut raw = None;
    attributes(&tag, |name, value| {
        if name == "encoding" {
            raw = match value.as_str() {
                "raw" => Some(true),
                "base64" => Some(false),
                _ => {
                    return Err(format!(
                        "the encoding {value:?} of <AppendedData> is unknown"
                    ));
                }
            };
        }
        Ok(())
    })
    .map_err(|what| (0, what))?;
    let raw = raw.ok_or((0, "<AppendedData> does not say its encoding".to_owned()))?;

    let body = &tail[tag_end + 1..];
    let close = memmem::rfind(body, b"</AppendedData").ok_or_else(cut_off)?;
    let rest: Vec<u8> = (body[close + b"</AppendedData".len()..].iter().copied())
        .filter(|byte| !byte.is_ascii_whitespace())
        .take(16)
        .collect();
    if rest != b"></VTKFile>" {
        let at = (tag_end + 1 + close) as u64;
        return Err((
            at,
            "the file does not end with </AppendedData></VTKFile>".into(),
        ));
    }
    let blanks = body
        .iter()
        .take_while(|byte| byte.is_ascii_whitespace())
        .count();
    if body[blanks..close.max(blanks)].first() != Some(&b'_') {
        let at = (tag_end + 1 + blanks) as u64;
        return Err((
            at,
            "<AppendedData> does not begin with an underscore".into(),
        ));
    }
    Ok(Appended {
        raw,
        data: &body[blanks + 1..close],
    })
}

/// Calls `each` with every attribute, references resolved and blanks cut off.
fn attributes(
    tag: &BytesStart<'_>,
    mut each: impl FnMut(&str, String) -> Result<(), String>,
) -> Result<(), String> {
    let mut list = tag.attributes();
    // The check for duplicate attributes is quadratic; the bound below keeps the list short.
    for (count, attribute) in list.with_checks(false).enumerate() {
        let attribute = attribute.map_err(|error| format!("a broken attribute: {error}"))?;
        if count >= MAX_ATTRIBUTES {
            return Err(format!(
                "an element has more than {MAX_ATTRIBUTES} attributes"
            ));
        }
        let name = attribute.key.into_inner();
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|error| format!("attribute {name:?}: {error}"))?;
        each(name, value.into_owned())?;
    }
    Ok(())
}

/// A count; FreeFEM writes blanks around it.
fn count(name: &str, value: &str) -> Result<u64, String> {
    let value = value.trim();
    let parsed = value.parse();
    parsed.map_err(|_| format!("{name}={value:?} is not a count"))
}

/// As many numbers as there is place for.
fn numbers<const N: usize, T: Default + Copy + std::str::FromStr>(
    name: &str,
    value: &str,
) -> Result<[T; N], String> {
    let mut numbers = [T::default(); N];
    let mut words = value.split_ascii_whitespace();
    let fits = numbers.iter_mut().all(|number| {
        let word = words.next().and_then(|word| word.parse().ok());
        word.is_some_and(|word| {
            *number = word;
            true
        })
    });
    match fits && words.next().is_none() {
        true => Ok(numbers),
        false => Err(format!("{name}={value:?} does not have {N} numbers")),
    }
}

#[derive(Default)]
struct Parser<'a> {
    document: Document<'a>,
    /// The names of the elements around.
    open: Vec<&'static str>,
    arrays: usize,
    root_seen: bool,
    grid_seen: bool,
}

impl<'a> Parser<'a> {
    fn event(&mut self, event: Event<'a>, byte: u64) -> Result<(), String> {
        match event {
            Event::Start(tag) => {
                let element = self.begin(&tag, byte)?;
                if self.open.len() >= MAX_DEPTH {
                    return Err(format!("elements are nested more than {MAX_DEPTH} deep"));
                }
                self.open.push(element);
            }
            Event::Empty(tag) => {
                self.begin(&tag, byte)?;
            }
            Event::End(_) => {
                self.open.pop();
            }
            Event::Text(text) => self.text(text.into_inner())?,
            Event::CData(text) => self.text(text.into_inner())?,
            Event::GeneralRef(reference) => {
                let name = reference.into_inner();
                if self.open.last() == Some(&ARRAY) || !is_predefined(&name) {
                    return Err(format!("the reference &{name}; is not expanded"));
                }
            }
            // Only a document type declares entities; those that hold no declarations are harmless.
            Event::DocType(text) => {
                let declares = text.into_inner().contains('[');
                if declares {
                    return Err("a document type that declares entities is not read".into());
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: Cow<'a, str>) -> Result<(), String> {
        if text.bytes().all(|byte| byte.is_ascii_whitespace()) {
            return Ok(());
        }
        if self.open.is_empty() {
            return Err("text outside of <VTKFile>".into());
        }
        if self.open.last() == Some(&ARRAY) {
            let Cow::Borrowed(text) = text else {
                return Err("a text that cannot be read".into());
            };
            if let Some(array) = self.list(1).and_then(|list| list.last_mut()) {
                array.texts.push(text);
            }
        }
        Ok(())
    }

    /// The arrays of the section that is open `above` elements up.
    fn list(&mut self, above: usize) -> Option<&mut Vec<ArrayTag<'a>>> {
        let section = *self.open.iter().rev().nth(above)?;
        if section == "FieldData" {
            return Some(&mut self.document.whole);
        }
        let piece = self.document.pieces.last_mut()?;
        match section {
            "PointData" => Some(&mut piece.point_data),
            "CellData" => Some(&mut piece.cell_data),
            "Points" => Some(&mut piece.coordinates),
            "Cells" => Some(&mut piece.topology),
            _ => {
                let at = POLYGONS.iter().position(|(name, ..)| *name == section)?;
                piece.polygons.get_mut(at)
            }
        }
    }

    /// The name of an element that begins, [`OTHER`] if it is not read.
    fn begin(&mut self, tag: &BytesStart<'a>, byte: u64) -> Result<&'static str, String> {
        let name = tag.name().into_inner();
        let parallel = self.document.parallel;
        Ok(match (self.open.last().copied(), name) {
            (None, "VTKFile") if !self.root_seen => {
                self.file(tag)?;
                "VTKFile"
            }
            (None, _) => return Err(format!("<{name}> stands where one <VTKFile> is expected")),
            (Some("VTKFile"), _) if Grid::of_name(name).is_some() => {
                if self.grid_seen || Grid::of_name(name) != Some((self.document.grid, parallel)) {
                    return Err(format!("<{name}> is misplaced"));
                }
                self.grid_seen = true;
                self.grid(tag)?;
                GRID
            }
            (Some(GRID), "FieldData") => "FieldData",
            (Some(GRID), "Piece") => {
                self.piece(tag, byte)?;
                "Piece"
            }
            (Some("Piece"), "PointData") => "PointData",
            (Some("Piece"), "CellData") => "CellData",
            (Some("Piece"), "Points" | "Coordinates") => "Points",
            (Some("Piece"), "Cells") => "Cells",
            (Some("Piece"), _) => {
                let section = POLYGONS.iter().find(|(known, ..)| *known == name);
                section.map_or(OTHER, |(known, ..)| known)
            }
            (
                Some(
                    "PointData" | "CellData" | "Points" | "Cells" | "FieldData" | "Verts" | "Lines"
                    | "Polys" | "Strips",
                ),
                "DataArray" | "Array",
            ) => {
                self.arrays += 1;
                if self.arrays > MAX_ARRAYS {
                    return Err(format!("there are more than {MAX_ARRAYS} arrays"));
                }
                let array = array(tag, byte)?;
                if let Some(list) = self.list(0) {
                    if list.len() >= MAX_ARRAYS_IN_SECTION {
                        return Err(format!(
                            "more than {MAX_ARRAYS_IN_SECTION} arrays in one section"
                        ));
                    }
                    list.push(array);
                }
                ARRAY
            }
            _ => OTHER,
        })
    }

    fn file(&mut self, tag: &BytesStart<'a>) -> Result<(), String> {
        self.root_seen = true;
        let document = &mut self.document;
        let mut grid = None;
        attributes(tag, |name, value| {
            match name {
                "type" => grid = Some(value),
                "version" => document.version = Some(value.trim().to_owned()),
                "byte_order" => {
                    document.big_endian = match value.trim() {
                        "LittleEndian" => false,
                        "BigEndian" => true,
                        _ => return Err(format!("the byte order {value:?} is unknown")),
                    }
                }
                "header_type" => {
                    document.wide_headers = match value.trim() {
                        "UInt32" => false,
                        "UInt64" => true,
                        _ => return Err(format!("the header type {value:?} is unknown")),
                    }
                }
                "compressor" => {
                    document.compressor = match value.trim() {
                        "" => Compressor::None,
                        known => Compressor::of_vtk_name(known)
                            .ok_or_else(|| format!("the compressor {value:?} is unknown"))?,
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        let grid = grid.ok_or("<VTKFile> does not say its type")?;
        (document.grid, document.parallel) =
            Grid::of_name(grid.trim()).ok_or_else(|| format!("VTK's {grid:?} is not read"))?;
        Ok(())
    }

    fn grid(&mut self, tag: &BytesStart<'a>) -> Result<(), String> {
        let document = &mut self.document;
        attributes(tag, |name, value| {
            match name {
                "WholeExtent" => document.whole_extent = Some(numbers(name, &value)?),
                "Origin" => document.origin = numbers(name, &value)?,
                "Spacing" => document.spacing = Some(numbers(name, &value)?),
                "Direction" => document.direction = Some(numbers(name, &value)?),
                _ => {}
            }
            Ok(())
        })
    }

    fn piece(&mut self, tag: &BytesStart<'a>, byte: u64) -> Result<(), String> {
        let parallel = self.document.parallel;
        let mut piece = PieceTag {
            byte,
            ..PieceTag::default()
        };
        let (mut points, mut cells) = (None, None);
        attributes(tag, |name, value| {
            match name {
                "Source" => piece.source = Some(value),
                "NumberOfPoints" => points = Some(count(name, &value)?),
                "NumberOfCells" => cells = Some(count(name, &value)?),
                "Extent" => piece.extent = Some(numbers(name, &value)?),
                _ => {
                    if let Some(at) = POLYGONS.iter().position(|(_, known, _)| *known == name) {
                        piece.counts[at] = count(name, &value)?;
                    }
                }
            }
            Ok(())
        })?;
        if parallel {
            if piece.source.is_none() {
                return Err("a piece does not name its file".into());
            }
            self.document.pieces.push(piece);
            return Ok(());
        }
        match self.document.grid {
            Grid::Unstructured => {
                piece.points = points.ok_or("a piece does not say its NumberOfPoints")?;
                piece.cells = cells.ok_or("a piece does not say its NumberOfCells")?;
            }
            Grid::Poly => {
                piece.points = points.ok_or("a piece does not say its NumberOfPoints")?;
                let sum = piece
                    .counts
                    .iter()
                    .try_fold(0u64, |sum, &count| sum.checked_add(count));
                piece.cells = sum.ok_or("a piece has more cells than fit")?;
            }
            _ => {
                piece.extent = piece.extent.or(self.document.whole_extent);
                if piece.extent.is_none() {
                    return Err("a piece does not say its Extent".into());
                }
            }
        }
        self.document.pieces.push(piece);
        Ok(())
    }
}

fn array<'a>(tag: &BytesStart<'a>, byte: u64) -> Result<ArrayTag<'a>, String> {
    let mut array = ArrayTag {
        byte,
        // VTK's default.
        format: "ascii".into(),
        ..ArrayTag::default()
    };
    attributes(tag, |name, value| {
        match name {
            "Name" => array.name = value,
            "type" => array.type_name = value.trim().to_owned(),
            "format" => array.format = value.trim().to_ascii_lowercase(),
            "NumberOfComponents" => array.components = Some(count(name, &value)?),
            "NumberOfTuples" => array.tuples = Some(count(name, &value)?),
            "offset" => array.offset = Some(count(name, &value)?),
            _ => {}
        }
        Ok(())
    })?;
    Ok(array)
}

fn is_predefined(name: &str) -> bool {
    name.starts_with('#') || matches!(name, "lt" | "gt" | "amp" | "apos" | "quot")
}
