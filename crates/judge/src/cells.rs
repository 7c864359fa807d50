//! Whether two files have the same cells, which are part of a result: the same values on points that are connected otherwise
//! are another function.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::parts::number;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{PADDING, Results};
use faceoff_mesh::mesh::Shape;

/// Compares the cells of the dimensions that both files have, in any order, each as a set of vertices; in O(N log N). Where
/// only one side has some: how many, and the first of them.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn other_cells(a: (&Results, &[u32]), b: (&Results, &[u32])) -> Result<Option<String>> {
    // A table of points has no cells.
    if a.0.cell_count() == 0 || b.0.cell_count() == 0 {
        return Ok(None);
    }
    let width = a.0.width.max(b.0.width);
    let (of_a, of_b) = (
        Cells::new(a.0, a.1, width, &b.0.dimensions())?,
        Cells::new(b.0, b.1, width, &a.0.dimensions())?,
    );
    let (mut i, mut j) = (0, 0);
    let (mut only_a, mut only_b) = (Vec::new(), Vec::new());
    loop {
        cancel::check()?;
        let order = match (of_a.order.get(i), of_b.order.get(j)) {
            (None, None) => break,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(&k), Some(&l)) => of_a.key(k).cmp(of_b.key(l)),
        };
        match order {
            Ordering::Less => only_a.push(of_a.order[i]),
            Ordering::Greater => only_b.push(of_b.order[j]),
            Ordering::Equal => {}
        }
        i += usize::from(order.is_le());
        j += usize::from(order.is_ge());
    }
    let (only, of, side, other) = if only_a.is_empty() {
        (only_b, of_b, b.0, a.0)
    } else {
        (only_a, of_a, a.0, b.0)
    };
    let Some(&first) = only.iter().min_by_key(|k| of.cells[**k as usize]) else {
        return Ok(None);
    };
    let vertices = of.key(first)[..width].iter().filter(|v| **v != PADDING);
    let vertices: Vec<_> = vertices.collect();
    let cell = of.cells[first as usize] as usize;
    let place = side.centroid(cell);
    let place = place.map_or(String::new(), |x| format!(" at {:?}", &x[..side.space]));
    Ok(Some(format!(
        "{} of {} cells of {} are not in {}: the first is {vertices:?}{place}",
        only.len(),
        of.cells.len(),
        side.source,
        other.source
    )))
}

/// Some cells of one file.
struct Cells {
    /// Numbers of each cell, ascending, [`PADDING`] at the end; then, of a quadrangle, that opposite the lowest of its
    /// corners, since the same corners in another turn are another cell.
    keys: Vec<u32>,
    /// One more than the vertices.
    width: usize,
    /// Which cell of the file each is.
    cells: Vec<u32>,
    /// Sorted by their keys.
    order: Vec<u32>,
}

impl Cells {
    /// Those of some dimensions; all where a file does not say which it has.
    fn new(side: &Results, numbers: &[u32], width: usize, dims: &[u8]) -> Result<Self> {
        let all = dims.is_empty() || side.kinds.is_empty();
        let mut found = Cells {
            keys: Vec::new(),
            width: width + 1,
            cells: Vec::new(),
            order: Vec::new(),
        };
        let runs = side.kinds.iter();
        let mut shapes = runs.flat_map(|(kind, count)| std::iter::repeat_n(kind.shape(), *count));
        for (cell, dim) in side.cell_dimensions().iter().enumerate() {
            let is_quadrangle = shapes.next() == Some(Shape::Quadrangle);
            cancel::check()?;
            if all || dims.contains(dim) {
                let start = found.keys.len();
                let of_cell = side.cell(cell).map(|point| number(numbers, point));
                found.keys.extend(of_cell);
                found.keys[start..].sort_unstable();
                found.keys.resize(start + width, PADDING);
                let mut corners = [PADDING; 4];
                let of_cell = side.cell(cell).map(|point| number(numbers, point));
                corners.iter_mut().zip(of_cell).for_each(|(c, v)| *c = v);
                let lowest = (0..4).min_by_key(|k| corners[*k]).unwrap_or(0);
                let opposite = corners[(lowest + 2) % 4];
                found
                    .keys
                    .push(if is_quadrangle { opposite } else { PADDING });
                found.cells.push(cell as u32);
            }
        }
        let mut order: Vec<u32> = (0..found.cells.len() as u32).collect();
        order.par_sort_unstable_by(|&k, &l| found.key(k).cmp(found.key(l)));
        found.order = order;
        Ok(found)
    }

    fn key(&self, k: u32) -> &[u32] {
        &self.keys[self.width * k as usize..self.width * (k as usize + 1)]
    }
}
