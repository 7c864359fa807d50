//! The points and cells of structured grids: images, rectilinear and structured grids, of dimension 1 to 3.

use super::topology::Cells;
use super::unpack::Budget;
use crate::io::sets::grid;
use crate::mesh::CellBlock;

/// The points of a structured grid in each direction.
pub(crate) struct Extent {
    first: [f64; 3],
    pub points: [u64; 3],
}

/// Where the points of an image are.
pub(crate) struct Frame {
    pub origin: [f64; 3],
    pub spacing: [f64; 3],
    /// The directions of the axes, a matrix by rows; those of space if there is none.
    pub direction: Option<[f64; 9]>,
}

/// Bytes of a point and of a hexahedron.
const EACH: u64 = 24 + 32;

impl Extent {
    /// From the first and last index in each direction. The error states why there are too many points: a few digits
    /// declare them.
    pub fn new(ends: [i64; 6], budget: &mut Budget) -> Result<Self, String> {
        let count = |axis: usize| {
            let (first, last) = (ends[2 * axis], ends[2 * axis + 1]);
            let count = last.checked_sub(first).and_then(|last| last.checked_add(1));
            u64::try_from(count.unwrap_or(i64::MAX)).unwrap_or(0)
        };
        let points = [0, 1, 2].map(count);
        let all = points
            .iter()
            .try_fold(1u64, |all, &count| all.checked_mul(count));
        let all = all.filter(|&all| u32::try_from(all).is_ok());
        let all = all.ok_or_else(|| format!("{points:?} points are more than fit"))?;
        budget.take(all.saturating_mul(EACH))?;
        let first = [0, 1, 2].map(|axis| ends[2 * axis] as f64);
        Ok(Extent { first, points })
    }

    pub fn point_count(&self) -> u64 {
        self.points.iter().product()
    }

    pub fn cell_count(&self) -> u64 {
        match self.point_count() {
            0 => 0,
            _ => self
                .points
                .iter()
                .map(|&count| (count - 1).max(1))
                .product(),
        }
    }

    /// The points, the first direction changing fastest.
    fn all<'e>(&'e self, at: impl Fn([u64; 3]) -> [f64; 3] + 'e) -> Vec<[f64; 3]> {
        let [nx, ny, nz] = self.points;
        let mut points = Vec::with_capacity(self.point_count() as usize);
        for k in 0..nz {
            for j in 0..ny {
                points.extend((0..nx).map(|i| at([i, j, k])));
            }
        }
        points
    }

    pub fn image(&self, frame: &Frame) -> Vec<[f64; 3]> {
        self.all(|index| {
            let step = |axis: usize| (self.first[axis] + index[axis] as f64) * frame.spacing[axis];
            let steps = [0, 1, 2].map(step);
            let along = |row: usize| match &frame.direction {
                None => steps[row],
                Some(matrix) => (0..3)
                    .map(|axis| matrix[3 * row + axis] * steps[axis])
                    .sum(),
            };
            [0, 1, 2].map(|row| frame.origin[row] + along(row))
        })
    }

    /// The points of these coordinates, of which there are at least as many as points.
    pub fn rectilinear(&self, axes: &[Vec<f64>; 3]) -> Vec<[f64; 3]> {
        self.all(|index| {
            let at = |axis: usize| axes[axis].get(index[axis] as usize).copied();
            [0, 1, 2].map(|axis| at(axis).unwrap_or(f64::NAN))
        })
    }

    /// The cells: of as many dimensions as there are directions with several points.
    pub fn cells(&self) -> Cells {
        let [nx, ny, nz] = self.points.map(|count| count as usize);
        let (kind, nodes) = grid(&[nz, ny, nx], 0);
        let block = CellBlock::new(kind, nodes);
        Cells {
            blocks: (!block.is_empty()).then_some(block).into_iter().collect(),
            count: self.cell_count() as usize,
            ..Cells::default()
        }
    }
}
