//! The XML of a VTK file: its arrays, and where their data are. No data are decoded here.
//!
//! `vtkio` (0.7.0-rc2) hands the whole file to a deserializer, which fails on raw appended bytes, on counts with
//! blanks (FreeFEM), on a missing `byte_order` (dolfinx) or `version`, and drops `<FieldData>`. Here the appended
//! section, which need not be XML, is cut off by its bytes before a tokenizer sees the rest.

use super::Compressor;
use crate::error::{Error, Place, Result};
use crate::io::scalar::Number;
use crate::io::xml::{self, Element, Fault, Tree};
use memchr::memmem;
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
    // A tag that is broken is refused later, with its place.
    let attributes = xml::attributes_of(&tag);
    let kind = attributes.iter().find(|(name, _)| name == "type");
    let found = kind.and_then(|(_, name)| Grid::of_name(name.trim()));
    found.is_some_and(|(grid, _)| grids.contains(&grid))
}

/// The relevant elements of a file.
#[derive(Default)]
pub(super) struct Document<'a> {
    pub grid: Grid,
    /// `.pvtu` and its like: the pieces are files.
    pub parallel: bool,
    /// For an image: the position of its point (0, 0, 0), the distances of points, and the directions of the axes by rows.
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
    /// The type, if it is one of numbers.
    pub number: Option<Number>,
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

pub(super) fn parse<'a>(path: &Path, bytes: &'a [u8]) -> Result<Document<'a>> {
    let fail = |(byte, what): Fault| {
        let remedy = "write the file again: it is not sound VTK";
        Error::file(path, Place::Byte(byte), what, remedy)
    };
    let (head, tail) = match memmem::find(bytes, b"<AppendedData") {
        Some(at) => bytes.split_at(at),
        None => (bytes, &[][..]),
    };
    let text = std::str::from_utf8(head)
        .map_err(|error| fail((error.valid_up_to() as u64, "the XML is not UTF-8".into())))?;
    let tree = xml::parse(text).map_err(fail)?;
    let end = head.len() as u64;
    let mut document = document(&tree, end, !tail.is_empty()).map_err(fail)?;
    if !tail.is_empty() {
        let appended = appended(tail).map_err(|(byte, what)| fail((end + byte, what)))?;
        document.appended = Some(appended);
    }
    Ok(document)
}

/// The contents of the elements, which end at this byte; the root continues if the file has appended data.
fn document<'a>(tree: &Tree<'a>, end: u64, goes_on: bool) -> Result<Document<'a>, Fault> {
    let mut document = Document::default();
    let whole = &tree.elements[0];
    let (mut arrays, mut grid_seen) = (0, false);
    for (k, root) in tree.inside(whole).enumerate() {
        let name = &root.name;
        if k > 0 || name != "VTKFile" {
            return Err(root.fault(format!("<{name}> is found where one <VTKFile> is expected")));
        }
        root.check()?;
        document.file(root)?;
        for grid in tree.inside(root) {
            let name = &grid.name;
            let Some(found) = Grid::of_name(name) else {
                continue;
            };
            if std::mem::replace(&mut grid_seen, true)
                || found != (document.grid, document.parallel)
            {
                return Err(grid.fault(format!("<{name}> is misplaced")));
            }
            grid.check()?;
            document.whole_extent = numbers(grid, "WholeExtent")?;
            document.origin = numbers(grid, "Origin")?.unwrap_or_default();
            document.spacing = numbers(grid, "Spacing")?;
            document.direction = numbers(grid, "Direction")?;
            for part in tree.inside(grid) {
                match part.name.as_str() {
                    "FieldData" => add_arrays(tree, part, &mut arrays, &mut document.whole)?,
                    "Piece" => {
                        let piece = document.piece(tree, part, &mut arrays)?;
                        document.pieces.push(piece);
                    }
                    _ => {}
                }
            }
        }
    }
    if let Some(byte) = tree.stray {
        return Err((byte, "text outside of <VTKFile>".into()));
    }
    if whole.children.is_empty() || tree.open.len() != usize::from(goes_on) {
        return Err((end, "the file ends before its elements do".into()));
    }
    if !grid_seen {
        return Err((end, format!("there is no <{}>", document.grid.name())));
    }
    Ok(document)
}

/// Cuts `<AppendedData encoding="…">_…</AppendedData></VTKFile>`; the error is a position and a text.
fn appended(tail: &[u8]) -> Result<Appended<'_>, Fault> {
    let end = tail.len() as u64;
    let cut_off = || (end, "the file ends within <AppendedData>".to_owned());
    let tag_end = memchr::memchr(b'>', tail).ok_or_else(cut_off)?;
    let tag = std::str::from_utf8(&tail[..=tag_end])
        .map_err(|_| (0, "the tag <AppendedData> is not UTF-8".to_owned()))?;
    let tree = xml::parse(tag)?;
    tree.elements.iter().try_for_each(Element::check)?;
    let raw = match tree.elements.get(1).and_then(|tag| tag.exact("encoding")) {
        Some("raw") => true,
        Some("base64") => false,
        Some(other) => {
            let what = format!("the encoding {other:?} of <AppendedData> is unknown");
            return Err((0, what));
        }
        None => return Err((0, "<AppendedData> does not say its encoding".to_owned())),
    };

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

/// An attribute that is a count; FreeFEM writes blanks around it.
fn count(tag: &Element<'_>, name: &str) -> Result<Option<u64>, Fault> {
    let count = |value: &str| {
        let value = value.trim();
        let what = || tag.fault(format!("{name}={value:?} is not a count"));
        value.parse().map_err(|_| what())
    };
    tag.exact(name).map(count).transpose()
}

/// An attribute of as many numbers as there is place for.
fn numbers<const N: usize, T: std::str::FromStr>(
    tag: &Element<'_>,
    name: &str,
) -> Result<Option<[T; N]>, Fault> {
    let numbers = |value: &str| {
        let words = value.split_ascii_whitespace();
        let numbers: Option<Vec<T>> = words.map(|word| word.parse().ok()).collect();
        let what = || tag.fault(format!("{name}={value:?} does not have {N} numbers"));
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.ok_or_else(what)
    };
    tag.exact(name).map(numbers).transpose()
}

/// Adds the arrays of a section; `all` counts them in all sections.
fn add_arrays<'a>(
    tree: &Tree<'a>,
    section: &Element<'a>,
    all: &mut usize,
    list: &mut Vec<ArrayTag<'a>>,
) -> Result<(), Fault> {
    for tag in tree.inside(section) {
        if !matches!(tag.name.as_str(), "DataArray" | "Array") {
            continue;
        }
        *all += 1;
        if *all > MAX_ARRAYS {
            return Err(tag.fault(format!("there are more than {MAX_ARRAYS} arrays")));
        }
        if list.len() >= MAX_ARRAYS_IN_SECTION {
            let what = format!("more than {MAX_ARRAYS_IN_SECTION} arrays in one section");
            return Err(tag.fault(what));
        }
        list.push(ArrayTag::of(tag)?);
    }
    Ok(())
}

impl<'a> Document<'a> {
    /// Reads the attributes of the root.
    fn file(&mut self, tag: &Element<'a>) -> Result<(), Fault> {
        let word = |name: &str| tag.exact(name).map(str::trim);
        self.version = word("version").map(str::to_owned);
        self.big_endian = match word("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
            Some(other) => return Err(tag.fault(format!("the byte order {other:?} is unknown"))),
        };
        self.wide_headers = match word("header_type") {
            None | Some("UInt32") => false,
            Some("UInt64") => true,
            Some(other) => return Err(tag.fault(format!("the header type {other:?} is unknown"))),
        };
        self.compressor = match word("compressor") {
            None | Some("") => Compressor::None,
            Some(name) => Compressor::of_vtk_name(name)
                .ok_or_else(|| tag.fault(format!("the compressor {name:?} is unknown")))?,
        };
        let grid = word("type").ok_or_else(|| tag.fault("<VTKFile> does not say its type"))?;
        let found = Grid::of_name(grid);
        (self.grid, self.parallel) =
            found.ok_or_else(|| tag.fault(format!("VTK's {grid:?} is not read")))?;
        Ok(())
    }

    fn piece(
        &self,
        tree: &Tree<'a>,
        tag: &Element<'a>,
        arrays: &mut usize,
    ) -> Result<PieceTag<'a>, Fault> {
        tag.check()?;
        let lacks = |name: &str| tag.fault(format!("a piece does not say its {name}"));
        let mut piece = PieceTag {
            byte: tag.byte,
            source: tag.exact("Source").map(str::to_owned),
            extent: numbers(tag, "Extent")?,
            ..PieceTag::default()
        };
        let (points, cells) = (count(tag, "NumberOfPoints")?, count(tag, "NumberOfCells")?);
        for (sum, (_, name, _)) in piece.counts.iter_mut().zip(POLYGONS) {
            *sum = count(tag, name)?.unwrap_or(0);
        }
        if self.parallel {
            return match piece.source {
                Some(_) => Ok(piece),
                None => Err(tag.fault("a piece does not name its file")),
            };
        }
        match self.grid {
            Grid::Unstructured | Grid::Poly => {
                piece.points = points.ok_or_else(|| lacks("NumberOfPoints"))?;
            }
            _ => {
                piece.extent = piece.extent.or(self.whole_extent);
                piece.extent.ok_or_else(|| lacks("Extent"))?;
            }
        }
        if self.grid == Grid::Unstructured {
            piece.cells = cells.ok_or_else(|| lacks("NumberOfCells"))?;
        } else if self.grid == Grid::Poly {
            let mut counts = piece.counts.iter();
            let sum = counts.try_fold(0u64, |sum, &count| sum.checked_add(count));
            piece.cells = sum.ok_or_else(|| tag.fault("a piece has more cells than fit"))?;
        }
        for section in tree.inside(tag) {
            let name = section.name.as_str();
            let list = match name {
                "PointData" => &mut piece.point_data,
                "CellData" => &mut piece.cell_data,
                "Points" | "Coordinates" => &mut piece.coordinates,
                "Cells" => &mut piece.topology,
                _ => match POLYGONS.iter().position(|(known, ..)| *known == name) {
                    Some(at) => &mut piece.polygons[at],
                    None => continue,
                },
            };
            add_arrays(tree, section, arrays, list)?;
        }
        Ok(piece)
    }
}

impl<'a> ArrayTag<'a> {
    fn of(tag: &Element<'a>) -> Result<Self, Fault> {
        tag.check()?;
        let word = |name: &str| tag.exact(name).map(str::trim);
        let mut texts = Vec::new();
        for text in &tag.texts {
            match text {
                Cow::Borrowed(text) if !text.trim_ascii().is_empty() => texts.push(*text),
                Cow::Borrowed(_) => {}
                Cow::Owned(_) => return Err(tag.fault("a text that cannot be read")),
            }
        }
        let kind = word("type").unwrap_or_default();
        let number = number(kind);
        let type_name = match number {
            Some(number) => number.name(),
            None if kind.eq_ignore_ascii_case(TEXT) => TEXT,
            None => kind,
        };
        Ok(ArrayTag {
            byte: tag.byte,
            name: tag.exact("Name").unwrap_or_default().to_owned(),
            type_name: type_name.to_owned(),
            number,
            components: count(tag, "NumberOfComponents")?,
            tuples: count(tag, "NumberOfTuples")?,
            // VTK's default.
            format: word("format").unwrap_or("ascii").to_ascii_lowercase(),
            offset: count(tag, "offset")?,
            texts,
        })
    }
}

/// The type of arrays of texts.
pub(super) const TEXT: &str = "String";

/// The type of numbers by VTK's name in any case, or by the word of another program.
fn number(word: &str) -> Option<Number> {
    Number::of_name(word).or_else(|| match word.to_ascii_lowercase().as_str() {
        "int" => Some(Number::I32),
        "vtkidtype" => Some(Number::I64),
        "float" => Some(Number::F32),
        "double" => Some(Number::F64),
        _ => None,
    })
}
