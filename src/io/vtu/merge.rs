//! `vtkio`'s model to a mesh: pieces one after the other, as VTK's own reader puts them together.

use super::cells;
use super::layout::{Array, Layout};
use super::scalar;
use crate::field::data::with_numbers;
use crate::mesh::{CellBlock, CellKind, Values};
use rayon::prelude::*;
use std::borrow::Cow;
use vtkio::IOBuffer;
use vtkio::model::{Attribute, Cells, UnstructuredGridPiece};

/// Points, runs of cells of one type, and the arrays on both.
#[derive(Default)]
pub(super) struct Merged {
    pub points: Vec<[f64; 3]>,
    pub blocks: Vec<CellBlock>,
    pub arrays: Layout<'static>,
}

/// Puts pieces together. Points that pieces share stay as many as they are in the file. In words what does not fit.
pub(super) fn merge(pieces: Vec<UnstructuredGridPiece>) -> Result<Merged, String> {
    let mut merged = Merged::default();
    let mut cells = 0;
    for (index, piece) in pieces.into_iter().enumerate() {
        let (points_before, cells_before) = (merged.points.len(), cells);
        cells += piece.cells.types.len();
        append_points(&mut merged.points, piece.points);
        if u32::try_from(merged.points.len().max(cells)).is_err() {
            return Err("there are more than 2^32 - 1 points or cells".into());
        }
        append_cells(&mut merged.blocks, piece.cells, points_before as u32)?;
        let arrays = &mut merged.arrays;
        for (on, list, attributes, new, before) in [
            (
                "points",
                &mut arrays.points,
                piece.data.point,
                merged.points.len() - points_before,
                points_before,
            ),
            (
                "cells",
                &mut arrays.cells,
                piece.data.cell,
                cells - cells_before,
                cells_before,
            ),
        ] {
            append_arrays(list, attributes, new, before)
                .map_err(|name| format!("not all pieces have the array {name:?} on {on}, or have it in another type: see piece {index}"))?;
        }
    }
    Ok(merged)
}

fn append_points(points: &mut Vec<[f64; 3]>, piece: IOBuffer) {
    let coordinates = match piece {
        IOBuffer::F64(coordinates) => coordinates,
        other => scalar::values(other).to_f64(),
    };
    points.extend_from_slice(coordinates.as_chunks().0);
}

fn append_cells(blocks: &mut Vec<CellBlock>, cells: Cells, base: u32) -> Result<(), String> {
    let types = cells.types;
    let (connectivity, offsets) = cells.cell_verts.into_xml();
    let start = |cell: usize| match cell {
        0 => 0,
        cell => offsets.get(cell - 1).copied().unwrap_or(0) as usize,
    };
    let mut first = 0;
    while let Some(&vtk) = types.get(first) {
        let width = start(first + 1) - start(first);
        let (kind, order) = cells::kind(vtk, width).ok_or_else(|| {
            format!("cell {first} is a {vtk:?} of {width} points, which is not read")
        })?;
        let rest = types[first..].iter().zip(first..);
        let same =
            |&(&next, cell): &(_, usize)| next == vtk && start(cell + 1) - start(cell) == width;
        let cells = rest.take_while(same).count();
        let nodes = connectivity.get(start(first)..start(first + cells));
        let nodes = nodes.ok_or("the offsets lead beyond the connectivity")?;
        append_nodes(run_of(blocks, kind), nodes, width, order, base);
        first += cells;
    }
    Ok(())
}

/// The nodes of the run of this type that the cells so far end with.
fn run_of(blocks: &mut Vec<CellBlock>, kind: CellKind) -> &mut Vec<u32> {
    if blocks.last().is_none_or(|block| block.kind != kind) {
        blocks.push(CellBlock::new(kind, Vec::new()));
    }
    &mut blocks
        .last_mut()
        .expect("invariant: one was just pushed if there was none")
        .nodes
}

/// Nodes are below the number of points, which a `u32` holds.
fn append_nodes(
    run: &mut Vec<u32>,
    nodes: &[u64],
    width: usize,
    order: Option<&[usize]>,
    base: u32,
) {
    let Some(order) = order else {
        let nodes = nodes.par_iter().with_min_len(1 << 14);
        run.par_extend(nodes.map(|&node| node as u32 + base));
        return;
    };
    for cell in nodes.chunks_exact(width) {
        let start = run.len();
        run.resize(start + width, 0);
        for (&node, &place) in cell.iter().zip(order) {
            run[start + place] = node as u32 + base;
        }
    }
}

/// Appends the arrays of a piece of `new` tuples to those of the `before` tuples so far; the name that does not fit,
/// otherwise. A piece without tuples may lack arrays.
fn append_arrays(
    list: &mut Vec<Array<'static>>,
    attributes: Vec<Attribute>,
    new: usize,
    before: usize,
) -> Result<(), String> {
    let arrays = attributes
        .into_iter()
        .filter_map(|attribute| match attribute {
            Attribute::DataArray(array) => Some(Array {
                components: array.elem.num_comp() as usize,
                name: array.name,
                values: Cow::Owned(scalar::values(array.data)),
            }),
            Attribute::Field { .. } => None,
        });
    let mut arrays: Vec<Array> = arrays.collect();
    if before == 0 {
        if new > 0 || list.is_empty() {
            *list = arrays;
        }
        return Ok(());
    }
    if new == 0 {
        return Ok(());
    }
    for array in list {
        let same = |other: &Array| other.name == array.name && other.components == array.components;
        let Some(at) = arrays.iter().position(same) else {
            return Err(array.name.clone());
        };
        if !append_values(array.values.to_mut(), &arrays.swap_remove(at).values) {
            return Err(array.name.clone());
        }
    }
    match arrays.pop() {
        Some(array) => Err(array.name),
        None => Ok(()),
    }
}

/// Whether both are of one type, so that the second could be appended.
fn append_values(all: &mut Values, new: &Values) -> bool {
    fn append<T: scalar::Scalar>(all: &mut Vec<T>, new: &Values) -> bool {
        T::of_values(new)
            .map(|new| all.extend_from_slice(new))
            .is_some()
    }
    with_numbers!(all, all => append(all, new))
}
