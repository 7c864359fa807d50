//! Fields on faces, by which codes are compared.

/// Fills up faces that have fewer vertices than others.
pub const PADDING: u32 = u32::MAX;

/// Fields of one result, keyed by faces. When files of other codes are compared, "face" stands for whatever carries
/// values: a cell, a point, or a corner of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceFields {
    /// The name of the result in the comparison.
    pub source: String,
    /// Number of vertices of a face: 2 in 2D, 3 in 3D.
    pub dim: usize,
    /// Number of coordinates of a point: 2 or 3.
    pub space: usize,
    /// Vertices of the faces, `dim` each, ascending.
    pub vertices: Vec<u32>,
    /// Centroids of the faces; empty if positions are unknown.
    pub midpoints: Vec<[f64; 3]>,
    /// |F|; empty if all have the same weight.
    pub measures: Vec<f64>,
    /// The fields.
    pub columns: Vec<FaceColumn>,
}

/// One field: values on some of the faces.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceColumn {
    /// Its name on both sides: `mean`, `flux`.
    pub name: String,
    /// The kind of judgement.
    pub kind: ColumnKind,
    /// Values on each face.
    pub components: usize,
    /// The faces that carry it, ascending.
    pub faces: Vec<u32>,
    /// `components` values a face of `faces`.
    pub values: Vec<f64>,
    /// How much a value on that face can change when no dof changes by more than 1: it turns a
    /// tolerance for dofs into one for this field. Empty if the field is judged on its own scale.
    pub sensitivity: Vec<f64>,
}

/// How a field is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// The values are compared.
    Value,
    /// The signs of the values are compared: contact where P ≤ 0, non-contact where P > 0.
    Status,
}

impl FaceFields {
    /// How many faces have values.
    pub fn face_count(&self) -> usize {
        self.vertices.len() / self.dim
    }

    /// Vertices of a face, ascending.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.vertices[self.dim * face..self.dim * (face + 1)]
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&FaceColumn> {
        self.columns.iter().find(|c| c.name == name)
    }
}

impl FaceColumn {
    /// Values on the k-th of its faces.
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[self.components * k..self.components * (k + 1)]
    }
}
