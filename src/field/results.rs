//! The fields of a file as they are, before anything is matched with anything.

use std::collections::HashMap;

use super::PADDING;
use crate::mesh::CellKind;

/// What one file tells: values on points, cells and corners of cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    /// Whose they are, as the comparison names it.
    pub source: String,
    /// Number of coordinates: 2 or 3.
    pub space: usize,
    /// Coordinates of the points; empty where the file has none.
    pub points: Vec<[f64; 3]>,
    /// The number of each point; empty where they are numbered 0, 1, 2, ….
    pub ids: Vec<u32>,
    /// Points of a cell at most; 0 where there are no cells.
    pub width: usize,
    /// Points of the cells, `width` each, [`PADDING`] where there are fewer.
    pub cells: Vec<u32>,
    /// The kinds of the cells, in their order, and how many follow each other; empty where only numbers are known.
    pub kinds: Vec<(CellKind, usize)>,
    pub on_points: Vec<Carried>,
    pub on_cells: Vec<Carried>,
    /// Values at each point of each cell in turn.
    pub on_corners: Vec<Carried>,
}

/// One field of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    pub name: String,
    pub components: usize,
    /// `components` for each item of `at`.
    pub values: Vec<f64>,
    /// The points, cells or corners that carry it, ascending; none: all do.
    pub at: Option<Vec<u32>>,
    /// The field whose size is the scale of this one, which is a difference of such fields.
    pub scaled_by: Option<String>,
}

impl Carried {
    /// The row of each item that carries it; none: all do, in their order.
    pub fn rows(&self) -> Option<HashMap<u32, u32>> {
        let at = self.at.as_ref()?;
        Some(at.iter().copied().zip(0..).collect())
    }
}

impl Results {
    pub fn cell_count(&self) -> usize {
        self.cells.len().checked_div(self.width).unwrap_or(0)
    }

    /// Number of points, whether their coordinates are known or only their numbers.
    pub fn point_count(&self) -> usize {
        self.points.len().max(self.ids.len())
    }

    pub fn cell(&self, cell: usize) -> impl Iterator<Item = u32> {
        let all = &self.cells[self.width * cell..self.width * (cell + 1)];
        all.iter().copied().filter(|p| *p != PADDING)
    }

    /// Keeps the fields of these names; the names of the others.
    pub fn keep_only(&mut self, names: &[String]) -> Vec<String> {
        let mut others = Vec::new();
        for fields in [
            &mut self.on_points,
            &mut self.on_cells,
            &mut self.on_corners,
        ] {
            fields.retain(|field| {
                let kept = names.contains(&field.name);
                if !kept {
                    others.push(field.name.clone());
                }
                kept
            });
        }
        others
    }

    /// Is there any field at all?
    pub fn is_empty(&self) -> bool {
        [&self.on_points, &self.on_cells, &self.on_corners]
            .iter()
            .all(|fields| fields.is_empty())
    }

    /// The cells as points at their centroids, with the fields of the cells: how a table that is keyed by midpoints
    /// sees them.
    pub fn centroids(&self) -> Results {
        let centroid = |cell: usize| {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for point in self.cell(cell) {
                let x = self.points[point as usize];
                sum.iter_mut().zip(x).for_each(|(s, x)| *s += x);
                count += 1.0;
            }
            sum.map(|s| s / count)
        };
        Results {
            source: self.source.clone(),
            space: self.space,
            points: (0..self.cell_count()).map(centroid).collect(),
            on_points: self.on_cells.clone(),
            ..Results::default()
        }
    }
}
