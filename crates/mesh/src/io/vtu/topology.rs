//! The cells of a piece: from connectivity, offsets and types to blocks of cells.
//!
//! `vtkio`'s model copies each of the three to an array of 64-bit numbers. Here they are read in place: the cost of a
//! large mesh is the memory that is touched.

use super::cells::{self, Meaning, POLYHEDRON};
use super::lattice::Order;
use super::unpack::Unpacked;
use crate::io::raw::RawNumbers;
use crate::io::rows;
use crate::io::scalar::{Number, Scalar, with_type};
use crate::mesh::{Array, CellBlock, CellKind, Polyhedra};
use crate::parallel;
use std::collections::HashMap;

/// Cells that are examined together.
const CELLS: usize = 1 << 12;
/// Types and widths whose meaning is kept; strips have many widths.
const KNOWN: usize = 64;

/// The cells of a piece as they are read, section after section.
#[derive(Default)]
pub(crate) struct Cells {
    pub blocks: Vec<CellBlock>,
    pub polyhedra: Polyhedra,
    /// Numbers of consecutive cells of the file, and how many cells each of them is here; empty while all are one.
    pub parts: Vec<(usize, usize)>,
    /// Cells of the file so far.
    pub count: usize,
}

/// The array that an error is about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Part {
    Connectivity,
    Offsets,
    Types,
}

type Fault = (Part, String);

/// Consecutive cells of one type and width.
struct CellRun {
    code: u8,
    width: usize,
    cells: usize,
}

/// Cells of a file.
pub(crate) struct Source<'b, 'f> {
    /// VTK's types of the cells.
    pub codes: RawNumbers<'b>,
    /// Where the nodes of each cell end.
    pub ends: RawNumbers<'b>,
    pub nodes: RawNumbers<'b>,
    /// That of Lagrange cells.
    pub order: Order,
    /// Whether a cell has other degrees in one direction than in another.
    pub uneven: &'f dyn Fn(usize) -> bool,
    /// The faces of a polyhedron: the number of corners of each, and these.
    pub faces: &'f dyn Fn(usize) -> Option<Vec<u32>>,
}

/// Whether a cell has other degrees in one direction than in another, by the three of each cell.
pub(crate) fn is_uneven(degrees: &[f64], cell: usize) -> bool {
    let row = degrees.get(3 * cell..3 * cell + 3);
    // The third degree of a cell of dimension 2 may be anything.
    row.is_some_and(|row| row[0] != row[1] || (row[2] > 1.0 && row[2] != row[0]))
}

impl<'b> Source<'b, 'static> {
    /// Cells without polyhedra and degrees.
    pub fn plain(codes: RawNumbers<'b>, ends: RawNumbers<'b>, nodes: RawNumbers<'b>) -> Self {
        Source {
            codes,
            ends,
            nodes,
            order: Order::Vtk,
            uneven: &|_| false,
            faces: &|_| None,
        }
    }
}

impl Cells {
    /// Appends cells with `points` points.
    pub fn append(&mut self, source: Source<'_, '_>, points: u64) -> Result<(), Fault> {
        let Source {
            codes,
            ends,
            nodes,
            order,
            uneven,
            faces,
        } = source;
        let codes = codes_of(codes).map_err(|what| (Part::Types, what))?;
        let runs = with_type!(ends.number, T => runs_of::<T>(&ends, &codes));
        let runs = runs.map_err(|what| (Part::Offsets, what.to_owned()))?;
        let mut known: HashMap<(u8, usize), Meaning> = HashMap::new();
        let mut rest = &*nodes.bytes;
        for run in runs {
            let CellRun { code, width, cells } = run;
            let range = self.count..self.count + cells;
            let bytes = nodes.number.size();
            let (words, others) = width
                .checked_mul(cells * bytes)
                .and_then(|length| rest.split_at_checked(length))
                .ok_or_else(|| (Part::Connectivity, "it ends before the cells do".to_owned()))?;
            rest = others;
            // What is known by its number of nodes has the same degree in all directions.
            let is_uneven = matches!(code, 70 | 72 | 73) && range.clone().any(uneven);
            if is_uneven || !known.contains_key(&(code, width)) {
                let found = match is_uneven {
                    true => CellKind::from_vtk(code, width).map(Meaning::whole),
                    false => cells::meaning(code, width, order),
                };
                let found = found.ok_or_else(|| {
                    let cell = range.start;
                    let what = format!(
                        "cell {cell} is of VTK's type {code} with {width} points, which is not read"
                    );
                    (Part::Types, what)
                })?;
                if known.len() > KNOWN {
                    known.clear();
                }
                known.insert((code, width), found);
            }
            let meaning = &known[&(code, width)];
            if code == POLYHEDRON {
                range
                    .clone()
                    .try_for_each(|cell| self.polyhedron(cell, points, faces))?;
            }
            self.note_parts(cells, meaning.parts);
            if meaning.parts > 0 {
                let words = RawNumbers {
                    bytes: words.into(),
                    ..nodes
                };
                let block = self.block(meaning.kind);
                let all_there = with_type!(words.number, T => {
                    append::<T>(block, &words, points, width, meaning)
                });
                if !all_there {
                    let what = with_type!(nodes.number, T => beyond::<T>(&nodes, points));
                    return Err((Part::Connectivity, what));
                }
            }
            if is_uneven {
                known.remove(&(code, width));
            }
        }
        Ok(())
    }

    /// The nodes of the block that a cell of a kind belongs to.
    fn block(&mut self, kind: CellKind) -> &mut Array<u32> {
        if self.blocks.last().is_none_or(|block| block.kind != kind) {
            self.blocks.push(CellBlock::new(kind, Vec::new()));
        }
        let last = self.blocks.len() - 1;
        &mut self.blocks[last].nodes
    }

    fn polyhedron(
        &mut self,
        cell: usize,
        points: u64,
        faces: &dyn Fn(usize) -> Option<Vec<u32>>,
    ) -> Result<(), Fault> {
        let sound = faces(cell).is_some_and(|stream| self.polyhedra.push(stream));
        let mut corners = self.polyhedra.last().into_iter().flatten().flatten();
        if !sound || corners.any(|&corner| u64::from(corner) >= points) {
            let what = format!(
                "the faces of the polyhedron {cell} are missing, or not faces of these points"
            );
            return Err((Part::Types, what));
        }
        Ok(())
    }

    fn note_parts(&mut self, cells: usize, parts: usize) {
        if parts != 1 && self.parts.is_empty() && self.count > 0 {
            self.parts.push((self.count, 1));
        }
        if parts != 1 || !self.parts.is_empty() {
            self.parts.push((cells, parts));
        }
        self.count += cells;
    }

    /// Messages about what was cut up or left out.
    pub fn notes(&self) -> Vec<String> {
        let (mut strips, mut pieces, mut none) = (0, 0, 0);
        for &(cells, parts) in &self.parts {
            match parts {
                0 => none += cells,
                1 => {}
                _ => (strips, pieces) = (strips + cells, pieces + cells * parts),
            }
        }
        let strips = (strips > 0).then(|| {
            format!("{strips} strips, poly-lines and poly-vertices are read as the {pieces} cells they consist of")
        });
        let none = (none > 0).then(|| format!("{none} cells of no extent are left out"));
        strips.into_iter().chain(none).collect()
    }
}

const NO_INDEX: &str = "it holds a value that is not an index";

/// Codes of cell types as bytes, their usual form.
fn codes_of(codes: RawNumbers) -> Result<Unpacked, String> {
    fn narrow<T: Scalar>(codes: &RawNumbers) -> Result<Vec<u8>, String> {
        let narrow = |code: T| {
            let code = code.index().ok_or(NO_INDEX)?;
            u8::try_from(code).map_err(|_| format!("VTK has no cell type {code}"))
        };
        T::each(&codes.bytes, codes.big_endian)
            .map(narrow)
            .collect()
    }
    if codes.number == Number::U8 {
        return Ok(codes.bytes);
    }
    with_type!(codes.number, T => narrow::<T>(&codes).map(Unpacked::from))
}

/// Collects consecutive cells of the same type and width.
fn runs_of<T: Scalar>(ends: &RawNumbers, codes: &[u8]) -> Result<Vec<CellRun>, &'static str> {
    let end_of = |cell: usize| {
        let bytes = ends.bytes.get(cell * T::WIDTH..).unwrap_or_default();
        T::each(bytes, ends.big_endian).next().and_then(T::index)
    };
    // Usually the cells that are looked at together have one width, which is seen without a branch.
    let width_of = |share: usize, bytes: &[u8], codes: &[u8]| {
        let first = share * CELLS;
        let start = first.checked_sub(1).map_or(Some(0), end_of)?;
        let width = end_of(first)?.checked_sub(start)?;
        let last = width.checked_mul(codes.len() as u64)?.checked_add(start)?;
        let expected = (1..).map(|cell| start + cell * width);
        let ends = T::each(bytes, ends.big_endian).map(T::index);
        let pairs = ends.zip(expected).take(codes.len());
        let even = pairs.fold(true, |on, (end, expected)| on & (end == Some(expected)));
        let even = codes.iter().fold(even, |on, code| on & (*code == codes[0]));
        even.then_some((width, last))
    };
    let shares = ends.bytes.chunks(CELLS * T::WIDTH).zip(codes.chunks(CELLS));
    let shares = parallel::map(shares.enumerate(), |(k, (bytes, codes))| {
        (bytes, codes, width_of(k, bytes, codes))
    });
    let mut runs: Vec<CellRun> = Vec::new();
    let mut push = |code: u8, width: usize, cells: usize| match runs.last_mut() {
        Some(run) if run.code == code && run.width == width => run.cells += cells,
        _ => runs.push(CellRun { code, width, cells }),
    };
    let mut start = 0;
    for (bytes, codes, even) in shares {
        if let Some((width, last)) = even {
            push(codes[0], width as usize, codes.len());
            start = last;
            continue;
        }
        for (end, &code) in T::each(bytes, ends.big_endian).zip(codes) {
            let end = end.index().ok_or(NO_INDEX)?;
            let width = end.checked_sub(start).ok_or("the offsets do not ascend")?;
            start = end;
            push(code, width as usize, 1);
        }
    }
    Ok(runs)
}

/// Appends the nodes of cells of `width` nodes, those that the meaning wants; returns whether all are below the number of
/// points.
fn append<T: Scalar>(
    nodes: &mut Array<u32>,
    numbers: &RawNumbers,
    points: u64,
    width: usize,
    meaning: &Meaning,
) -> bool {
    let places = meaning.nodes.as_deref();
    let out = places.map_or(width, <[usize]>::len);
    let cells = numbers.len() / width.max(1);
    let points = u32::try_from(points).unwrap_or(u32::MAX);
    let is_first = nodes.is_empty();
    if is_first
        && places.is_none()
        && let Some(lent) = numbers.lent_nodes(points)
    {
        *nodes = lent;
        return true;
    }
    let fill = |first: usize, nodes: &mut [u32]| {
        let mut odd = 0;
        let narrow = |word: T| {
            let (node, beyond) = word.index_from(0);
            odd |= beyond | u32::from(node >= points);
            node
        };
        let words = numbers
            .bytes
            .get(first * width * T::WIDTH..)
            .unwrap_or_default();
        let mut words = T::each(words, numbers.big_endian).map(narrow);
        let Some(places) = places else {
            nodes
                .iter_mut()
                .zip(words)
                .for_each(|(node, word)| *node = word);
            return odd == 0;
        };
        let mut cell = Vec::with_capacity(width);
        for nodes in nodes.chunks_exact_mut(out) {
            cell.clear();
            cell.extend(words.by_ref().take(width));
            nodes
                .iter_mut()
                .zip(places)
                .for_each(|(node, &place)| *node = cell[place]);
        }
        odd == 0
    };
    let sound = rows::fill(nodes.to_mut(), cells, out, fill);
    if sound && is_first {
        *nodes = std::mem::take(nodes).below(points);
    }
    sound
}

/// Finds the entry of the connectivity that is not a point.
#[cold]
fn beyond<T: Scalar>(nodes: &RawNumbers, points: u64) -> String {
    let mut nodes = T::each(&nodes.bytes, nodes.big_endian)
        .map(Scalar::index)
        .enumerate();
    let bad = nodes.find(|(_, node)| node.is_none_or(|node| node >= points));
    match bad {
        Some((entry, Some(node))) => {
            format!("entry {entry} is point {node}, but there are {points} points")
        }
        _ => NO_INDEX.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::Topology;
    use super::super::{Compressor, Encoding, from_bytes, write};
    use super::CELLS;
    use crate::io::out::Out;
    use crate::mesh::{CellBlock, CellKind, Mesh};
    use std::path::Path;

    /// Where the type or the width changes, whether within or between the cells that are looked at together.
    #[test]
    fn runs_end_where_type_or_width_changes() {
        for first in [1, CELLS - 1, CELLS, CELLS + 1, 2 * CELLS] {
            let kinds = [
                CellKind::Quadrangle,
                CellKind::Tetrahedron,
                CellKind::Triangle,
            ];
            let block = |kind: CellKind| {
                let width = kind.points() as u32;
                CellBlock::new(kind, (0..first as u32 * width).map(|i| i % 9).collect())
            };
            let mesh = Mesh {
                points: vec![[1.0; 3]; 9].into(),
                blocks: kinds.into_iter().map(block).collect(),
                ..Mesh::default()
            };
            let encoding = Encoding::Raw(Compressor::None);
            let out = write::encode(&mesh, &[], &[], encoding, Topology::Cells, Out::default());
            let bytes = out.expect("a sound mesh").bytes;
            let read = from_bytes(Path::new("test.vtu"), &bytes).expect("a sound file");
            assert!(read.mesh.blocks == mesh.blocks, "{first}");
        }
    }

    /// Also where the nodes of a cell are in a different order, or the cell is several cells here.
    #[test]
    fn a_node_beyond_the_points_is_refused_in_any_cell() {
        for code in [4, 6, 7, 8, 9] {
            for (node, is_there) in [(3, true), (4, false)] {
                let text = format!(
                    "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\
                     <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\
                     0 0 0 1 0 0 0 1 0 1 1 0</DataArray></Points><Cells>\
                     <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 {node}</DataArray>\
                     <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
                     <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{code}</DataArray>\
                     </Cells></Piece></UnstructuredGrid></VTKFile>"
                );
                let read = from_bytes(Path::new("test.vtu"), text.as_bytes());
                assert_eq!(read.is_ok(), is_there, "{code}");
                let what = read
                    .err()
                    .map(|error| error.to_string())
                    .unwrap_or_default();
                assert_eq!(
                    what.contains("entry 3 is point 4, but there are 4 points"),
                    !is_there,
                    "{what}"
                );
            }
        }
    }
}
