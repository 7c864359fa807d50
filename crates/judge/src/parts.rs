//! The connected parts of a mesh. Each has a separate scale, so that errors on a part with small values are not hidden by another part.

use rayon::prelude::*;

use super::places;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{PADDING, Results};
use faceoff_mesh::mesh::Union;

/// The part of every point that belongs to a cell, by the number for matching the point.
#[derive(Default)]
pub(super) struct Parts {
    /// The numbers of these points, ascending.
    numbers: Vec<u32>,
    parts: Vec<u32>,
    /// The number of parts; everything outside of cells is one further part.
    pub count: usize,
}

impl Parts {
    /// Cells are connected if they share a point; if no cells do, as in discontinuous data, if they share a position.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn new(side: &Results, numbers: &[u32], near: f64) -> Result<Self> {
        let dims = side.cell_dimensions();
        let top = dims.iter().max();
        let (mut known, mut own) = (Vec::new(), Vec::new());
        for (cell, dim) in dims.iter().enumerate() {
            cancel::check()?;
            let numbers = side.cell(cell).map(|point| number(numbers, point));
            if Some(dim) == top {
                own.extend(numbers.clone());
            }
            // A cell of one point connects nothing.
            if side.cell(cell).nth(1).is_some() {
                known.extend(numbers);
            }
        }
        known.par_sort_unstable();
        known.dedup();
        own.par_sort_unstable();
        let shares = own.windows(2).any(|pair| pair[0] == pair[1]);
        drop(own);
        let places = if shares {
            Vec::new()
        } else {
            places::numbers(&side.points, &[], near)?
        };

        let index = |point: u32| known.binary_search(&number(numbers, point)).ok();
        let mut union = Union::new(known.len());
        let mut at_place = vec![None; places.len()];
        for cell in 0..dims.len() {
            cancel::check()?;
            let mut before = None;
            for point in side.cell(cell) {
                let Some(this) = index(point) else { continue };
                let this = this as u32;
                let place = places.get(point as usize);
                let there = place.and_then(|&place| at_place[place as usize].replace(this));
                for other in [before.replace(this), there].into_iter().flatten() {
                    union.join(this, other);
                }
            }
        }
        let mut count = 0;
        let mut parts = vec![0; known.len()];
        for k in 0..known.len() {
            cancel::check()?;
            // The first point of a part has the lowest number.
            let root = union.root(k as u32) as usize;
            parts[k] = if root == k { count } else { parts[root] };
            count += u32::from(root == k);
        }
        Ok(Parts {
            numbers: known,
            parts,
            count: count as usize,
        })
    }

    /// The part of a point, cell or corner with these vertices.
    pub fn of(&self, vertices: &[u32]) -> u32 {
        let first = vertices.iter().find(|v| **v != PADDING);
        let found = first.and_then(|v| self.numbers.binary_search(v).ok());
        found.map_or(self.count as u32, |k| self.parts[k])
    }
}

/// The number for matching a point; a table of cells only has the numbers of the vertices.
pub(super) fn number(numbers: &[u32], point: u32) -> u32 {
    numbers.get(point as usize).copied().unwrap_or(point)
}
