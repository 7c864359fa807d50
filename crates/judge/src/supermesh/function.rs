//! A field of a file as a function on its cells.

use super::domain::Domain;
use crate::On;
use faceoff_mesh::field::ResultField;

/// Values at the nodes of cells, shared or not, or one for each cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Function<'a> {
    pub field: &'a ResultField,
    pub on: On,
    pub components: usize,
}

impl<'a> Function<'a> {
    pub fn new(field: &'a ResultField, on: On) -> Self {
        let components = field.components;
        Function {
            field,
            on,
            components,
        }
    }

    /// Is it constant on each cell?
    pub fn is_constant(&self) -> bool {
        self.on == On::Cells
    }

    /// The degree of its polynomials on this mesh.
    pub fn degree(&self, domain: &Domain) -> usize {
        let degrees = domain.elements.iter().map(|e| e.degree);
        if self.is_constant() {
            0
        } else {
            degrees.max().unwrap_or(0)
        }
    }

    fn entry(&self, item: u32, component: usize) -> f64 {
        if component >= self.field.components {
            // The third component of a vector in the plane.
            return 0.0;
        }
        let row = self.field.row_of(item);
        let at = row.map(|row| row * self.field.components + component);
        let value = at.and_then(|at| self.field.values.get(at));
        value.copied().unwrap_or(f64::NAN)
    }

    /// The value on a cell; NaN where it has none.
    pub fn on_cell(&self, cell: u32, component: usize) -> f64 {
        self.entry(cell, component)
    }

    /// What rounding has taken from an integer on a cell.
    pub fn rest(&self, cell: u32, component: usize) -> f64 {
        let row = self.field.row_of(cell);
        let rest = row.zip(self.field.rest.as_ref());
        let entry = rest.and_then(|(row, rest)| rest.get(row * self.field.components + component));
        entry.copied().unwrap_or(0.0)
    }

    /// Values at the nodes of a cell; NaN where there are none.
    pub fn at_nodes(&self, domain: &Domain, cell: u32, component: usize, out: &mut [f64]) {
        let first = domain.first_corners.get(cell as usize);
        for ((k, out), point) in (0..).zip(out).zip(domain.side.cell(cell as usize)) {
            let item = match self.on {
                On::Corners => first.map_or(u32::MAX, |first| first + k),
                _ => point,
            };
            *out = self.entry(item, component);
        }
    }
}
