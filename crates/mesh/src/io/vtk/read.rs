//! Reads legacy VTK: keyword after keyword, each with a line of words and the data it declares.

use std::collections::HashMap;
use std::path::Path;

use crate::error::Result;
use crate::field::{GlobalArray, GlobalValues, to_i64};
use crate::io::Content;
use crate::io::scan::{Numbers, Scan};
use crate::io::vtu::array::RawNumbers;
use crate::io::vtu::cells::POLYHEDRON;
use crate::io::vtu::grids::{Extent, Frame};
use crate::io::vtu::lattice::Order;
use crate::io::vtu::merge::{Piece, PieceArray};
use crate::io::vtu::read::restore_texts;
use crate::io::vtu::scalar::Scalar;
use crate::io::vtu::topology::{Cells, Source};
use crate::io::vtu::unpack::Budget;
use crate::io::vtu::{Decoded, xml::Grid};
use crate::mesh::{Polyhedra, Values};

/// The sections of polygonal data in the order in which their cells count, with VTK's types of their cells.
const POLYGONS: [(&str, u8); 4] = [
    ("VERTICES", 2),
    ("LINES", 4),
    ("POLYGONS", 7),
    ("TRIANGLE_STRIPS", 6),
];
const GRIDS: [(&str, Grid); 5] = [
    ("UNSTRUCTURED_GRID", Grid::Unstructured),
    ("POLYDATA", Grid::Poly),
    ("STRUCTURED_POINTS", Grid::Image),
    ("RECTILINEAR_GRID", Grid::Rectilinear),
    ("STRUCTURED_GRID", Grid::Structured),
];

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::new(path, bytes);
    scan.skip_blanks();
    let version = words(scan.line()).last().map(text).unwrap_or_default();
    scan.line(); // a title
    let encoding = text(scan.line().trim_ascii());
    let binary = match encoding.to_ascii_lowercase().as_str() {
        "ascii" => false,
        "binary" => true,
        _ => {
            return Err(scan.error(format!(
                "the third line is {encoding:?}, neither ASCII nor BINARY"
            )));
        }
    };
    let mut reader = Reader {
        scan,
        numbers: if binary { Numbers::Big } else { Numbers::Ascii },
        budget: Budget::of_file(bytes.len()),
        grid: None,
        points: Vec::new(),
        cells: None,
        codes: None,
        sections: Default::default(),
        dimensions: [0; 3],
        frame: Frame {
            origin: [0.0; 3],
            spacing: [1.0; 3],
            direction: None,
        },
        axes: Default::default(),
        on: None,
        piece: Piece::default(),
        out: Decoded::default(),
    };
    while reader.keyword()? {}
    let Some(grid) = reader.grid else {
        return Err(reader.scan.error_with(
            "there is no DATASET: these are tables, and no mesh",
            "give a file with a mesh",
        ));
    };
    reader.assemble(grid, version.split('.').next() < Some("5"))?;
    let mut out = reader.out;
    restore_texts(&mut out.whole, &mut reader.budget);
    out.pieces.push(reader.piece);
    out.encoding = if binary { "binary-big" } else { "ascii" }.into();
    out.content(path, "vtk", Some(version))
}

/// What arrays belong to.
#[derive(Clone, Copy, PartialEq)]
enum On {
    Points,
    Cells,
}

struct Reader<'a> {
    scan: Scan<'a>,
    /// How data are written; keywords are text.
    numbers: Numbers,
    budget: Budget,
    grid: Option<Grid>,
    points: Vec<[f64; 3]>,
    cells: Option<Lists<'a>>,
    codes: Option<RawNumbers<'a>>,
    sections: [Option<Lists<'a>>; 4],
    dimensions: [u64; 3],
    frame: Frame,
    axes: [Vec<f64>; 3],
    /// What the arrays that follow belong to, and how many tuples they have.
    on: Option<(On, usize)>,
    piece: Piece,
    out: Decoded,
}

/// Lists of nodes, and where each ends.
struct Lists<'a> {
    ends: RawNumbers<'a>,
    nodes: RawNumbers<'a>,
}

/// The words of a line.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// A name as VTK writes it: other bytes than letters as % and two digits; what is not UTF-8 is Latin-1.
fn text(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len());
    let mut rest = word;
    while let Some((&first, others)) = rest.split_first() {
        let code = others.get(..2).filter(|_| first == b'%');
        let code =
            code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = others
            .get(if code.is_some() { 2 } else { 0 }..)
            .unwrap_or_default();
    }
    String::from_utf8(bytes)
        .unwrap_or_else(|error| error.as_bytes().iter().map(|&b| char::from(b)).collect())
}

impl<'a> Reader<'a> {
    /// Reads a keyword with what belongs to it; false at the end of the file.
    fn keyword(&mut self) -> Result<bool> {
        let Some(word) = self.scan.peek() else {
            return Ok(false);
        };
        let keyword = text(word).to_ascii_uppercase();
        self.scan.section.clone_from(&keyword);
        let start = self.scan.clone();
        self.scan.word();
        let polygons = POLYGONS.iter().position(|(known, _)| *known == keyword);
        match keyword.as_str() {
            "DATASET" => {
                let name = text(self.argument()?).to_ascii_uppercase();
                let grid = GRIDS.iter().find(|(known, _)| *known == name);
                self.grid = Some(
                    grid.ok_or_else(|| start.error(format!("DATASET {name} is not read")))?
                        .1,
                );
            }
            "POINTS" => {
                let [count, kind] = self.arguments()?;
                let (count, kind) = (self.number(count)?, text(kind));
                self.data_begin();
                let count3 = count
                    .checked_mul(3)
                    .ok_or_else(|| start.error("too many points"))?;
                let values = self.plain(&kind, count3)?;
                self.points = values.to_f64().as_chunks::<3>().0.to_vec();
            }
            "CELLS" => self.cells = Some(self.lists()?),
            "CELL_TYPES" => {
                let count = self.argument()?;
                let count = self.number(count)?;
                self.data_begin();
                self.codes = Some(self.raw("int", count)?);
            }
            "DIMENSIONS" => {
                let words = self.arguments::<3>()?;
                for (place, word) in words.into_iter().enumerate() {
                    self.dimensions[place] = self.number(word)?;
                }
            }
            "ORIGIN" => self.frame.origin = self.three()?,
            "SPACING" | "ASPECT_RATIO" => self.frame.spacing = self.three()?,
            "X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES" => {
                let [count, kind] = self.arguments()?;
                let (count, kind) = (self.number(count)?, text(kind));
                self.data_begin();
                self.axes[usize::from(word[0].to_ascii_uppercase() - b'X')] =
                    self.plain(&kind, count)?.to_f64();
            }
            "METADATA" => self.metadata(),
            "POINT_DATA" | "CELL_DATA" => {
                let on = if keyword == "POINT_DATA" {
                    On::Points
                } else {
                    On::Cells
                };
                let count = self.argument()?;
                self.on = Some((on, self.number(count)? as usize));
            }
            _ if polygons.is_some() => {
                let lists = self.lists()?;
                self.sections[polygons.unwrap_or(0)] = Some(lists);
            }
            _ => self.attribute(&keyword, &start)?,
        }
        Ok(true)
    }

    /// A keyword of data on points or cells, or of the whole.
    fn attribute(&mut self, keyword: &str, start: &Scan) -> Result<()> {
        if keyword == "FIELD" {
            return self.field();
        }
        let known = [
            ("SCALARS", 1),
            ("VECTORS", 3),
            ("NORMALS", 3),
            ("TENSORS", 9),
            ("TENSORS6", 6),
            ("TEXTURE_COORDINATES", 2),
            ("GLOBAL_IDS", 1),
            ("PEDIGREE_IDS", 1),
            ("EDGE_FLAGS", 1),
            ("COLOR_SCALARS", 1),
            ("LOOKUP_TABLE", 4),
        ];
        let Some((_, usual)) = known.iter().find(|(known, _)| *known == keyword) else {
            return Err(start.error(format!("the keyword {keyword:?} is unknown")));
        };
        let name = text(self.argument()?);
        let mut rest = words(self.scan.line());
        let next = rest.next().map(text);
        let count_of = |word: Option<&str>, scan: &Scan| -> Result<usize> {
            let number = word.and_then(|word| word.parse::<usize>().ok());
            number.ok_or_else(|| scan.error(format!("{keyword} {name:?} lacks a number")))
        };
        if keyword == "LOOKUP_TABLE" {
            let count = count_of(next.as_deref(), start)?;
            let kind = if self.numbers == Numbers::Ascii {
                "float"
            } else {
                "unsigned_char"
            };
            self.plain(kind, 4 * count as u64)?;
            self.out
                .unread
                .push(format!("the table {name:?} of colours"));
            return Ok(());
        }
        let (kind, components) = match keyword {
            "COLOR_SCALARS" => (String::new(), count_of(next.as_deref(), start)?),
            "TEXTURE_COORDINATES" => {
                let components = count_of(next.as_deref(), start)?;
                (rest.next().map(text).unwrap_or_default(), components)
            }
            "SCALARS" => {
                let components = rest.next().map(text);
                let components = components
                    .map(|word| count_of(Some(&word), start))
                    .transpose()?;
                (next.unwrap_or_default(), components.unwrap_or(1))
            }
            _ => (next.unwrap_or_default(), *usual),
        };
        if keyword == "SCALARS" {
            // The name of a table of colours, which need not be there.
            let mut after = self.scan.clone();
            if after
                .word()
                .is_some_and(|word| word.eq_ignore_ascii_case(b"LOOKUP_TABLE"))
            {
                self.scan = after;
                self.scan.line();
            }
        }
        let Some((_, tuples)) = self.on else {
            return Err(start.error("it stands before POINT_DATA and CELL_DATA"));
        };
        let values = if keyword == "COLOR_SCALARS" {
            Some(self.colours(tuples, components)?)
        } else {
            self.values(&kind, tuples, components)?
        };
        self.keep(name, components, values, tuples);
        Ok(())
    }

    /// Parts of one as text, bytes in binary.
    fn colours(&mut self, tuples: usize, components: usize) -> Result<Values> {
        let count = self.product(tuples, components)?;
        if self.numbers != Numbers::Ascii {
            return self.plain("unsigned_char", count);
        }
        let parts = self.plain("float", count)?.to_f64();
        Ok(Values::U8(
            parts
                .into_iter()
                .map(|part| (255.0 * part).round() as u8)
                .collect(),
        ))
    }

    /// Named arrays, of the points or cells or, before these are named, of the whole.
    fn field(&mut self) -> Result<()> {
        let [_, count] = self.arguments()?;
        let count = self.number(count)?;
        for _ in 0..count {
            while self
                .scan
                .peek()
                .is_some_and(|word| word.eq_ignore_ascii_case(b"METADATA"))
            {
                self.scan.word();
                self.metadata();
            }
            let name = text(self.argument()?);
            if name == "NULL_ARRAY" {
                continue;
            }
            self.scan.section = format!("FIELD array {name:?}");
            let [components, tuples, kind] = self.arguments()?;
            let (components, tuples) = (
                self.number(components)? as usize,
                self.number(tuples)? as usize,
            );
            let kind = text(kind);
            self.data_begin();
            let values = self.values(&kind, tuples, components)?;
            self.keep(name, components, values, tuples);
        }
        Ok(())
    }

    fn keep(&mut self, name: String, components: usize, values: Option<Values>, found: usize) {
        let (Some(values), true) = (values, components > 0) else {
            self.out
                .unread
                .push(format!("the array {name:?} of texts or of nothing"));
            return;
        };
        match self.on {
            None => self.out.whole.push(GlobalArray {
                name,
                components,
                values: GlobalValues::Numbers(values),
            }),
            Some((_, tuples)) if tuples != found => {
                let what = format!(
                    "the array {name:?}, which has {found} tuples where {tuples} are declared"
                );
                self.out.unread.push(what);
            }
            Some((On::Points, _)) => self.piece.on_points.push(PieceArray {
                name,
                components,
                values,
            }),
            Some((On::Cells, _)) => self.piece.on_cells.push(PieceArray {
                name,
                components,
                values,
            }),
        }
    }

    /// Lines up to an empty one.
    fn metadata(&mut self) {
        self.scan.line();
        while !self.scan.rest().is_empty() && !self.scan.line().trim_ascii().is_empty() {}
    }

    /// The nodes of cells: in two arrays as of version 5, or each list after its length.
    fn lists(&mut self) -> Result<Lists<'a>> {
        let [count, size] = self.arguments()?;
        let (count, size) = (self.number(count)?, self.number(size)?);
        self.data_begin();
        let is_new = self
            .scan
            .peek()
            .is_some_and(|word| word.eq_ignore_ascii_case(b"OFFSETS"));
        if is_new {
            let mut array = |count: u64| {
                let [_, kind] = self.arguments()?;
                let kind = text(kind);
                self.data_begin();
                self.raw(&kind, count)
            };
            // The first end is 0.
            let ends = array(count)?.without_first();
            return Ok(Lists {
                ends,
                nodes: array(size)?,
            });
        }
        let at = self.scan.clone();
        let numbers = self.raw("int", size)?;
        let mut lists = Lists {
            ends: RawNumbers::of(Vec::<u32>::new()),
            nodes: RawNumbers::of(Vec::<u32>::new()),
        };
        let (mut ends, mut nodes) = (Vec::new(), Vec::with_capacity(numbers.len()));
        let mut numbers = i32::each(&numbers.bytes, numbers.big_endian);
        for _ in 0..count {
            let width = numbers.next().and_then(|width| usize::try_from(width).ok());
            let width = width.filter(|&width| width <= numbers.len());
            let width = width
                .ok_or_else(|| at.error("a cell has more nodes than follow, or fewer than none"))?;
            nodes.extend(numbers.by_ref().take(width));
            ends.push(nodes.len() as u32);
        }
        (lists.ends, lists.nodes) = (RawNumbers::of(ends), RawNumbers::of(nodes));
        Ok(lists)
    }

    /// Makes points and cells of what was read.
    fn assemble(&mut self, grid: Grid, before_5: bool) -> Result<()> {
        self.scan.section = "DATASET".into();
        let order = if before_5 {
            Order::VtkBefore
        } else {
            Order::Vtk
        };
        let mut points = std::mem::take(&mut self.points);
        let mut cells = Cells::default();
        match grid {
            Grid::Unstructured => {
                let (lists, codes) = (self.cells.take(), self.codes.take());
                match (lists, codes) {
                    (Some(lists), Some(codes)) => {
                        self.unstructured(&mut cells, lists, codes, order, points.len() as u64)?;
                    }
                    (None, None) => {}
                    _ => return Err(self.scan.error("of CELLS and CELL_TYPES one is missing")),
                }
            }
            Grid::Poly => {
                for ((name, code), lists) in
                    POLYGONS.into_iter().zip(std::mem::take(&mut self.sections))
                {
                    let Some(Lists { ends, nodes }) = lists else {
                        continue;
                    };
                    let codes = RawNumbers::of(vec![code; ends.len()]);
                    let appended =
                        cells.append(Source::plain(codes, ends, nodes), points.len() as u64);
                    appended.map_err(|(_, what)| self.scan.error(format!("{name}: {what}")))?;
                }
            }
            _ => {
                let ends = self
                    .dimensions
                    .map(|count| i64::try_from(count).unwrap_or(i64::MAX) - 1);
                let extent = Extent::new([0, ends[0], 0, ends[1], 0, ends[2]], &mut self.budget);
                let extent =
                    extent.map_err(|what| self.scan.error(format!("DIMENSIONS: {what}")))?;
                points = match grid {
                    Grid::Image => extent.image(&self.frame),
                    Grid::Rectilinear => extent.rectilinear(&self.axes),
                    _ => points,
                };
                if points.len() as u64 != extent.point_count() {
                    return Err(self
                        .scan
                        .error("POINTS and DIMENSIONS are of different numbers of points"));
                }
                cells = extent.cells();
            }
        }
        let misfit = |arrays: &[PieceArray], count: usize| {
            arrays
                .iter()
                .any(|array| array.values.len() != count * array.components)
        };
        if misfit(&self.piece.on_points, points.len()) || misfit(&self.piece.on_cells, cells.count)
        {
            let (points, cells) = (points.len(), cells.count);
            let what = format!(
                "POINT_DATA or CELL_DATA is not of the {points} points and {cells} cells there are"
            );
            return Err(self.scan.error(what));
        }
        self.piece.points = points;
        let taken = self
            .piece
            .take_cells(cells, &mut self.budget, &mut self.out.warnings);
        taken.map_err(|what| self.scan.error(what))
    }

    fn unstructured(
        &mut self,
        cells: &mut Cells,
        lists: Lists<'a>,
        codes: RawNumbers<'a>,
        order: Order,
        points: u64,
    ) -> Result<()> {
        let Lists {
            mut ends,
            mut nodes,
        } = lists;
        if ends.len() != codes.len() {
            let what = format!(
                "there are {} cells, and types of {}",
                ends.len(),
                codes.len()
            );
            return Err(self.scan.error(what));
        }
        let mut faces = HashMap::new();
        if codes.has(POLYHEDRON.into()) {
            let solids = solids(&codes, &ends, &nodes);
            let solids = solids.ok_or_else(|| {
                self.scan
                    .error("the faces of a polyhedron are not what they should be")
            })?;
            (ends, nodes) = (RawNumbers::of(solids.ends), RawNumbers::of(solids.nodes));
            faces = solids.faces;
        }
        let (uneven, rows) = self.uneven();
        let source = Source {
            codes,
            ends,
            nodes,
            order,
            uneven: &|cell| rows > cell && uneven[cell],
            faces: &|cell| faces.get(&cell).cloned(),
        };
        let appended = cells.append(source, points);
        appended.map_err(|(part, what)| self.scan.error(format!("{part:?} of CELLS: {what}")))
    }

    /// Of each cell, whether the degrees of its directions differ.
    fn uneven(&self) -> (Vec<bool>, usize) {
        let degrees = self
            .piece
            .on_cells
            .iter()
            .find(|array| array.name == "HigherOrderDegrees" && array.components == 3);
        let degrees = degrees
            .map(|array| array.values.to_f64())
            .unwrap_or_default();
        let uneven = |row: &[f64; 3]| row[0] != row[1] || (row[2] > 1.0 && row[2] != row[0]);
        let uneven: Vec<bool> = degrees.as_chunks().0.iter().map(uneven).collect();
        let rows = uneven.len();
        (uneven, rows)
    }

    fn argument(&mut self) -> Result<&'a [u8]> {
        self.arguments::<1>().map(|[word]| word)
    }

    fn arguments<const N: usize>(&mut self) -> Result<[&'a [u8]; N]> {
        let mut words = [&b""[..]; N];
        for word in &mut words {
            *word = self
                .scan
                .word()
                .ok_or_else(|| self.scan.error("the file ends within a keyword's line"))?;
        }
        Ok(words)
    }

    fn number(&self, word: &[u8]) -> Result<u64> {
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.scan.error(format!("{:?} is not a count", text(word))))
    }

    fn three(&mut self) -> Result<[f64; 3]> {
        Ok([self.scan.f64()?, self.scan.f64()?, self.scan.f64()?])
    }

    fn product(&self, tuples: usize, components: usize) -> Result<u64> {
        let count = (tuples as u64).checked_mul(components as u64);
        count.ok_or_else(|| {
            self.scan.error(format!(
                "{tuples} tuples of {components} numbers are too many"
            ))
        })
    }

    /// Moves to where binary data begin: the next line.
    fn data_begin(&mut self) {
        if self.numbers != Numbers::Ascii {
            self.scan.line();
        }
    }

    /// Numbers of a named type; `None` for texts, which are passed over.
    fn values(&mut self, kind: &str, tuples: usize, components: usize) -> Result<Option<Values>> {
        let count = self.product(tuples, components)?;
        match kind.to_ascii_lowercase().as_str() {
            "string" | "utf8_string" | "variant" => self.skip_texts(kind, count).map(|()| None),
            _ => self.plain(kind, count).map(Some),
        }
    }

    /// Texts: a line each, or in binary each after its length, in whose first two bits stands the width of the length.
    fn skip_texts(&mut self, kind: &str, count: u64) -> Result<()> {
        self.scan.believe(count, "texts", 1)?;
        self.scan.skip_blanks();
        for _ in 0..count {
            if self.numbers == Numbers::Ascii || kind.eq_ignore_ascii_case("variant") {
                self.scan.line();
                continue;
            }
            let first = self.scan.bytes(1, 1)?[0];
            let more = [7, 3, 1, 0][usize::from(first >> 6)];
            let rest = self.scan.bytes(more, 1)?;
            let length = rest.iter().fold(u64::from(first & 0x3f), |sum, &byte| {
                (sum << 8) | u64::from(byte)
            });
            self.scan
                .bytes(usize::try_from(length).unwrap_or(usize::MAX), 1)?;
        }
        Ok(())
    }

    fn plain(&mut self, kind: &str, count: u64) -> Result<Values> {
        if kind.eq_ignore_ascii_case("bit") && self.numbers != Numbers::Ascii {
            let count = usize::try_from(count).unwrap_or(usize::MAX);
            let bytes = self.scan.bytes(count.div_ceil(8), 1)?;
            let bits = bytes
                .iter()
                .flat_map(|byte| (0..8).rev().map(move |bit| (byte >> bit) & 1));
            return Ok(Values::U8(bits.take(count).collect()));
        }
        self.raw(kind, count).map(|numbers| numbers.values())
    }

    /// Numbers of a type by VTK's name of it.
    fn raw(&mut self, kind: &str, count: u64) -> Result<RawNumbers<'a>> {
        match kind.to_ascii_lowercase().as_str() {
            "char" | "signed_char" | "vtktypeint8" => self.numbers_of::<i8>(count),
            "bit" | "unsigned_char" | "vtktypeuint8" => self.numbers_of::<u8>(count),
            "short" | "vtktypeint16" => self.numbers_of::<i16>(count),
            "unsigned_short" | "vtktypeuint16" => self.numbers_of::<u16>(count),
            // VTK writes its own type of numbers as one of 32 bits.
            "int" | "vtkidtype" | "vtktypeint32" => self.numbers_of::<i32>(count),
            "unsigned_int" | "vtktypeuint32" => self.numbers_of::<u32>(count),
            "long" | "long_long" | "__int64" | "vtktypeint64" => self.numbers_of::<i64>(count),
            "unsigned_long" | "unsigned_long_long" | "unsigned___int64" | "vtktypeuint64" => {
                self.numbers_of::<u64>(count)
            }
            "float" => self.numbers_of::<f32>(count),
            "double" => self.numbers_of::<f64>(count),
            _ => Err(self
                .scan
                .error(format!("numbers of type {kind:?} are not read"))),
        }
    }

    fn numbers_of<T: Scalar>(&mut self, count: u64) -> Result<RawNumbers<'a>> {
        let count = self.scan.believe(
            count,
            "numbers",
            if self.numbers == Numbers::Ascii {
                2
            } else {
                T::WIDTH
            },
        )?;
        if self.numbers != Numbers::Ascii {
            let at = self.scan.bytes(count, T::WIDTH)?;
            return Ok(RawNumbers {
                type_name: T::NAME,
                bytes: at.into(),
                big_endian: true,
            });
        }
        let mut numbers = Vec::with_capacity(count);
        for _ in 0..count {
            let Some(number) = self.scan.peek().and_then(T::parse) else {
                return Err(self.scan.error(format!(
                    "expected a number of type {}, found {}",
                    T::NAME,
                    self.scan.shown()
                )));
            };
            self.scan.word();
            numbers.push(number);
        }
        Ok(RawNumbers::of(numbers))
    }
}

/// Cells of which some are polyhedra, whose lists are of faces.
#[derive(Default)]
struct Solids {
    ends: Vec<u32>,
    nodes: Vec<u32>,
    /// The number of corners of each face, and these, by cell.
    faces: HashMap<usize, Vec<u32>>,
}

/// `None` where a list is not one of faces.
fn solids(codes: &RawNumbers, ends: &RawNumbers, nodes: &RawNumbers) -> Option<Solids> {
    let [codes, ends, nodes] = [codes, ends, nodes].map(|numbers| to_i64(&numbers.values()));
    let nodes: Vec<u32> = nodes?
        .into_iter()
        .map(|node| u32::try_from(node).ok())
        .collect::<Option<_>>()?;
    let (mut solids, mut start) = (Solids::default(), 0);
    for (cell, (code, end)) in codes?.into_iter().zip(ends?).enumerate() {
        let end = usize::try_from(end).ok()?;
        let list = nodes.get(start..end)?;
        start = end;
        if code != i64::from(POLYHEDRON) {
            solids.nodes.extend_from_slice(list);
        } else {
            let (&count, faces) = list.split_first()?;
            Polyhedra::count_faces(faces).filter(|&faces| faces == count as usize)?;
            let first = solids.nodes.len();
            let mut rest = faces;
            let mut seen = std::collections::HashSet::new();
            while let Some((&count, others)) = rest.split_first() {
                let (corners, others) = others.split_at_checked(count as usize)?;
                solids
                    .nodes
                    .extend(corners.iter().filter(|&&corner| seen.insert(corner)));
                rest = others;
            }
            if solids.nodes.len() == first {
                return None;
            }
            solids.faces.insert(cell, faces.to_vec());
        }
        solids.ends.push(u32::try_from(solids.nodes.len()).ok()?);
    }
    Some(solids)
}
