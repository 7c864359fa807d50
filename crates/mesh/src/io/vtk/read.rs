//! Reads legacy VTK: keyword after keyword, each with a line of words and the data it declares. The arrays are read in
//! `arrays`, their numbers in `numbers`, and cells are made of them in `assemble`.

use std::path::Path;

use super::numbers::{text, words};
use crate::error::Result;
use crate::io::Content;
use crate::io::raw::RawNumbers;
use crate::io::rows;
use crate::io::scalar::Scalar;
use crate::io::scan::{Numbers, Scan};
use crate::io::vtu::Decoded;
use crate::io::vtu::grids::Frame;
use crate::io::vtu::merge::Piece;
use crate::io::vtu::read::restore_texts;
use crate::io::vtu::unpack::Budget;
use crate::io::vtu::xml::Grid;
use crate::mesh::Support;

/// The sections of polygonal data in the order in which their cells count, with VTK's types of their cells.
pub(super) const POLYGONS: [(&str, u8); 4] = [
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
    let numbers = match encoding.to_ascii_lowercase().as_str() {
        "ascii" => Numbers::Ascii,
        "binary" => Numbers::Big,
        _ => {
            return Err(scan.error(format!(
                "the third line is {encoding:?}, neither ASCII nor BINARY"
            )));
        }
    };
    let mut reader = Reader {
        scan,
        numbers,
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
    out.encoding = reader.numbers.encoding();
    out.content(path, "vtk", Some(version))
}

pub(super) struct Reader<'a> {
    pub scan: Scan<'a>,
    /// How data are written; keywords are text.
    pub numbers: Numbers,
    pub budget: Budget,
    pub grid: Option<Grid>,
    pub points: Vec<[f64; 3]>,
    pub cells: Option<Lists<'a>>,
    pub codes: Option<RawNumbers<'a>>,
    pub sections: [Option<Lists<'a>>; 4],
    pub dimensions: [u64; 3],
    pub frame: Frame,
    pub axes: [Vec<f64>; 3],
    /// The entities of the following arrays, and the number of tuples.
    pub on: Option<(Support, usize)>,
    pub piece: Piece,
    pub out: Decoded,
}

/// Lists of nodes, and where each ends.
pub(super) struct Lists<'a> {
    pub ends: RawNumbers<'a>,
    pub nodes: RawNumbers<'a>,
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
                let on = match keyword.as_str() {
                    "POINT_DATA" => Support::Points,
                    _ => Support::Cells,
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

    /// Lines up to an empty one.
    pub(super) fn metadata(&mut self) {
        self.scan.line();
        while !self.scan.rest().is_empty() && !self.scan.line().trim_ascii().is_empty() {}
    }

    pub(super) fn skip_metadata(&mut self) {
        while (self.scan.peek()).is_some_and(|word| word.eq_ignore_ascii_case(b"METADATA")) {
            self.scan.word();
            self.metadata();
        }
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
                self.skip_metadata();
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
        if let Some(lists) = even_lists(&numbers, count) {
            return Ok(lists);
        }
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
}

/// The lists of cells that all have as many nodes as the first, which is usual and quickly checked.
fn even_lists<'a>(numbers: &RawNumbers, count: u64) -> Option<Lists<'a>> {
    let (bytes, big_endian) = (&*numbers.bytes, numbers.big_endian);
    let first = i32::each(bytes, big_endian).next()?;
    let width = usize::try_from(first).ok().filter(|&width| width > 0)?;
    let count = usize::try_from(count).ok()?;
    if count.checked_mul(width + 1)? != numbers.len() {
        return None;
    }
    let mut nodes = vec![0i32; count * width];
    let fill = |_, bytes: &[u8], nodes: &mut [i32]| {
        let mut words = i32::each(bytes, big_endian);
        let lists = nodes.chunks_exact_mut(width);
        lists.fold(true, |even, list| {
            let even = even & (words.next() == Some(first));
            list.iter_mut()
                .zip(&mut words)
                .for_each(|(node, word)| *node = word);
            even
        })
    };
    let row = (width + 1) * i32::WIDTH;
    rows::convert((bytes, row), (&mut nodes, width), fill, |a, b| a & b).filter(|&even| even)?;
    let ends = (1..=count).map(|cell| (cell * width) as u32).collect();
    Some(Lists {
        ends: RawNumbers::of::<u32>(ends),
        nodes: RawNumbers::of(nodes),
    })
}
