//! The values that are aligned and judged, borrowed, since coordinates and values are most of the memory of a comparison.

use std::borrow::Cow;

use faceoff_mesh::field::{ColumnKind, FaceColumn, FaceFields};

/// The carriers of values, keyed by vertices: faces, cells, points, or corners of cells.
pub(super) struct Faces<'a> {
    pub source: &'a str,
    /// The number of vertices of each.
    pub dim: usize,
    /// The number of coordinates of a point.
    pub space: usize,
    pub vertices: Cow<'a, [u32]>,
    /// Empty if positions are unknown.
    pub midpoints: Cow<'a, [[f64; 3]]>,
    /// Empty if all have the same weight.
    pub measures: &'a [f64],
}

impl Faces<'_> {
    pub fn count(&self) -> usize {
        self.vertices.len() / self.dim
    }

    /// Its vertices, ascending.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.vertices[self.dim * face..self.dim * (face + 1)]
    }
}

impl<'a> From<&'a FaceFields> for Faces<'a> {
    fn from(of: &'a FaceFields) -> Self {
        Faces {
            source: &of.source,
            dim: of.dim,
            space: of.space,
            vertices: Cow::from(&of.vertices),
            midpoints: Cow::from(&of.midpoints),
            measures: &of.measures,
        }
    }
}

/// One field: values on some of the faces, as in [`FaceColumn`].
pub(super) struct Column<'a> {
    pub name: &'a str,
    pub kind: ColumnKind,
    pub components: usize,
    pub faces: Cow<'a, [u32]>,
    pub values: Cow<'a, [f64]>,
    pub rest: Cow<'a, [f64]>,
}

impl Column<'_> {
    /// The values on the k-th of its faces.
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[self.components * k..self.components * (k + 1)]
    }

    /// The part of a component that was lost to rounding, on the k-th of its faces.
    pub fn rest(&self, k: usize, component: usize) -> f64 {
        let at = self.components * k + component;
        self.rest.get(at).copied().unwrap_or(0.0)
    }
}

impl<'a> From<&'a FaceColumn> for Column<'a> {
    fn from(of: &'a FaceColumn) -> Self {
        Column {
            name: &of.name,
            kind: of.kind,
            components: of.components,
            faces: Cow::from(&of.faces),
            values: Cow::from(&of.values),
            rest: Cow::from(&[]),
        }
    }
}
