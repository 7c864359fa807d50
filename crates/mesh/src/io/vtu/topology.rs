//! The cells of a piece: from connectivity, offsets and types to blocks of cells.
//!
//! `vtkio`'s model copies each of the three to an array of 64-bit numbers. Here they are read in place: the cost of a
//! large mesh is the memory that is touched.

use super::array::RawNumbers;
use super::cells;
use super::read::Decoder;
use super::scalar::{Scalar, with_type};
use super::unpack::Unpacked;
use super::xml::{ArrayTag, PieceTag};
use crate::error::Result;
use crate::io::rows;
use crate::mesh::CellBlock;
use num_traits::FromPrimitive;
use vtkio::model::CellType;

/// Cells that are examined together.
const CELLS: usize = 1 << 12;

/// Consecutive cells of one type and width.
struct CellRun {
    code: u8,
    width: usize,
    cells: usize,
}

impl<'a> Decoder<'a> {
    /// The cells of a piece in runs of one type.
    pub fn cells(&mut self, piece: &'a PieceTag) -> Result<Vec<CellBlock>> {
        let find = |name: &str| piece.topology.iter().find(|array| array.name == name);
        let (Some(connectivity), Some(offsets), Some(types)) =
            (find("connectivity"), find("offsets"), find("types"))
        else {
            if piece.cells == 0 {
                return Ok(Vec::new());
            }
            let what = "<Cells> lacks connectivity, offsets or types".into();
            return Err(self.refuse_piece(piece, what));
        };
        let ends = self.numbers(offsets, piece.cells)?;
        let codes = self.numbers(types, piece.cells)?;
        let codes =
            with_type!(types.type_name.as_str(), T => codes_of::<T>(codes), Ok(codes.bytes));
        let codes = codes.map_err(|what| self.refuse(types, what))?;
        let runs = with_type!(offsets.type_name.as_str(), T => runs_of::<T>(&ends, &codes), Ok(Vec::new()));
        let runs = runs.map_err(|what| self.refuse(offsets, what))?;
        let entries = runs.iter().map(|run| (run.width * run.cells) as u64).sum();
        let nodes = self.numbers(connectivity, entries)?;
        with_type!(connectivity.type_name.as_str(), T => {
            self.blocks::<T>(piece, connectivity, types, &nodes, &runs)
        }, Ok(Vec::new()))
    }

    fn blocks<T: Scalar>(
        &self,
        piece: &PieceTag,
        connectivity: &ArrayTag,
        types: &ArrayTag,
        nodes: &RawNumbers,
        runs: &[CellRun],
    ) -> Result<Vec<CellBlock>> {
        let mut blocks: Vec<CellBlock> = Vec::new();
        let mut rest = &*nodes.bytes;
        let mut cell = 0;
        for run in runs {
            let vtk = CellType::from_u8(run.code)
                .ok_or_else(|| self.refuse(types, format!("VTK has no cell type {}", run.code)))?;
            let (kind, order) = cells::kind(vtk, run.width).ok_or_else(|| {
                let width = run.width;
                let what = format!("cell {cell} is a {vtk:?} of {width} points, which is not read");
                self.refuse(types, what)
            })?;
            if blocks.last().is_none_or(|block| block.kind != kind) {
                blocks.push(CellBlock::new(kind, Vec::new()));
            }
            let (words, others) = rest.split_at(run.width * run.cells * T::WIDTH);
            rest = others;
            let block = blocks.last_mut().map(|block| &mut block.nodes);
            let all_there = block.is_none_or(|block| {
                append::<T>(
                    block,
                    words,
                    nodes.big_endian,
                    piece.points,
                    run.width,
                    order,
                )
            });
            if !all_there {
                return Err(self.refuse(connectivity, beyond::<T>(nodes, piece.points)));
            }
            cell += run.cells;
        }
        Ok(blocks)
    }
}

const NO_INDEX: &str = "it holds a value that is not an index";

/// Codes of cell types as bytes, their usual form.
fn codes_of<T: Scalar>(codes: RawNumbers) -> Result<Unpacked, String> {
    if T::NAME == u8::NAME {
        return Ok(codes.bytes);
    }
    let narrow = |code: T| {
        let code = code.index().ok_or(NO_INDEX)?;
        u8::try_from(code).map_err(|_| format!("VTK has no cell type {code}"))
    };
    let codes = T::each(&codes.bytes, codes.big_endian).map(narrow);
    codes.collect::<Result<Vec<u8>, _>>().map(Unpacked::from)
}

/// Collects consecutive cells of the same type and width.
fn runs_of<T: Scalar>(ends: &RawNumbers, codes: &[u8]) -> Result<Vec<CellRun>, &'static str> {
    let mut runs: Vec<CellRun> = Vec::new();
    let mut start = 0;
    let chunks = ends.bytes.chunks(CELLS * T::WIDTH).zip(codes.chunks(CELLS));
    for (bytes, codes) in chunks {
        let ends = || T::each(bytes, ends.big_endian).map(Scalar::index);
        // Usually all continue the last run, which can be checked for many at once.
        if let Some(run) = runs.last_mut()
            && let Some(last) = (run.width as u64).checked_mul(codes.len() as u64)
            && let Some(last) = last.checked_add(start)
        {
            let expected = (1..).map(|cell| start + cell * run.width as u64);
            let pairs = ends().zip(expected);
            let on = pairs.fold(true, |on, (end, expected)| on & (end == Some(expected)));
            if on && codes.iter().fold(true, |on, code| on & (*code == run.code)) {
                run.cells += codes.len();
                start = last;
                continue;
            }
        }
        for (end, &code) in ends().zip(codes) {
            let end = end.ok_or(NO_INDEX)?;
            let width = end.checked_sub(start).ok_or("the offsets do not ascend")? as usize;
            start = end;
            match runs.last_mut() {
                Some(run) if run.code == code && run.width == width => run.cells += 1,
                _ => runs.push(CellRun {
                    code,
                    width,
                    cells: 1,
                }),
            }
        }
    }
    Ok(runs)
}

/// Appends the nodes of cells, given in VTK's `order`; returns whether all are below the number of points.
fn append<T: Scalar>(
    nodes: &mut Vec<u32>,
    words: &[u8],
    big_endian: bool,
    points: u64,
    width: usize,
    order: Option<&[usize]>,
) -> bool {
    let start = nodes.len();
    let count = words.len() / T::WIDTH;
    if start == 0 {
        *nodes = vec![0; count];
    } else {
        nodes.resize(start + count, 0);
    }
    let fill = |_, words: &[u8], nodes: &mut [u32]| {
        let mut there = true;
        let narrow = |word: T| {
            // An invalid index is beyond all points.
            let node = word.index().unwrap_or(u64::MAX);
            there &= node < points;
            node as u32
        };
        let mut words = T::each(words, big_endian).map(narrow);
        match order {
            None => nodes
                .iter_mut()
                .zip(words)
                .for_each(|(node, word)| *node = word),
            Some(order) => {
                for cell in nodes.chunks_exact_mut(width) {
                    for (&place, word) in order.iter().zip(words.by_ref()) {
                        cell[place] = word;
                    }
                }
            }
        }
        there
    };
    let new = nodes.split_at_mut(start).1;
    let all = rows::convert((words, width * T::WIDTH), (new, width), fill, |a, b| a & b);
    all.unwrap_or(true)
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
    use super::super::{Compressor, Encoding, from_bytes, write};
    use super::*;
    use crate::io::out::Out;
    use crate::mesh::{CellKind, Mesh};
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
                points: vec![[1.0; 3]; 9],
                blocks: kinds.into_iter().map(block).collect(),
                ..Mesh::default()
            };
            let encoding = Encoding::Raw(Compressor::None);
            let out = write::encode(&mesh, &[], &[], encoding, Out::default());
            let bytes = out.expect("a sound mesh").bytes;
            let read = from_bytes(Path::new("test.vtu"), &bytes).expect("a sound file");
            assert!(read.mesh.blocks == mesh.blocks, "{first}");
        }
    }
}
