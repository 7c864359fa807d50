//! Pieces to one mesh: one after the other, as VTK's own reader puts them together.

use super::scalar;
use crate::field::data::with_numbers;
use crate::mesh::{CellBlock, Values};

/// What one `<Piece>` holds.
pub(super) struct Piece {
    pub points: Vec<[f64; 3]>,
    pub cell_count: u64,
    /// Runs of cells of one type, whose nodes are points of this piece.
    pub blocks: Vec<CellBlock>,
    pub on_points: Vec<Array>,
    pub on_cells: Vec<Array>,
}

/// An array on points or cells.
pub(super) struct Array {
    pub name: String,
    pub components: usize,
    pub values: Values,
}

/// Points, runs of cells of one type, and the arrays on both.
#[derive(Default)]
pub(super) struct Merged {
    pub points: Vec<[f64; 3]>,
    pub blocks: Vec<CellBlock>,
    pub on_points: Vec<Array>,
    pub on_cells: Vec<Array>,
}

/// Puts pieces together. Points that pieces share stay as many as they are in the file. In words what does not fit.
pub(super) fn merge(pieces: Vec<Piece>) -> Result<Merged, String> {
    let mut merged = Merged::default();
    let mut cells = 0;
    for (index, piece) in pieces.into_iter().enumerate() {
        let before = (merged.points.len(), cells);
        let new = (piece.points.len(), piece.cell_count as usize);
        cells += new.1;
        if u32::try_from(cells.max(before.0 + new.0)).is_err() {
            return Err("there are more than 2^32 - 1 points or cells".into());
        }
        append_blocks(&mut merged.blocks, piece.blocks, before.0 as u32);
        append(&mut merged.points, piece.points);
        let misfit = |on: &str, name: String| {
            format!(
                "not all pieces have the array {name:?} on {on}, or have it in another type: see piece {index}"
            )
        };
        append_arrays(&mut merged.on_points, piece.on_points, new.0, before.0)
            .map_err(|name| misfit("points", name))?;
        append_arrays(&mut merged.on_cells, piece.on_cells, new.1, before.1)
            .map_err(|name| misfit("cells", name))?;
    }
    Ok(merged)
}

/// Appends what is new; where there is nothing yet it is not copied.
fn append<T>(all: &mut Vec<T>, mut new: Vec<T>) {
    if all.is_empty() {
        *all = new;
    } else {
        all.append(&mut new);
    }
}

/// Appends runs of cells whose nodes count from the point `base`, which fits as all points do.
fn append_blocks(blocks: &mut Vec<CellBlock>, new: Vec<CellBlock>, base: u32) {
    for mut block in new {
        if base > 0 {
            block.nodes.iter_mut().for_each(|node| *node += base);
        }
        match blocks.last_mut().filter(|last| last.kind == block.kind) {
            Some(last) => append(&mut last.nodes, block.nodes),
            None => blocks.push(block),
        }
    }
}

/// Appends the arrays of a piece of `new` tuples to those of the `before` tuples so far; the name that does not fit,
/// otherwise. A piece without tuples may lack arrays.
fn append_arrays(
    list: &mut Vec<Array>,
    mut arrays: Vec<Array>,
    new: usize,
    before: usize,
) -> Result<(), String> {
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
        if !append_values(&mut array.values, &arrays.swap_remove(at).values) {
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
