//! Fields on faces: what codes are compared by.

/// In place of a vertex where a face has fewer than others.
pub const PADDING: u32 = u32::MAX;

/// Fields of one result, keyed by faces. Where files of other codes are compared, a face is whatever carries values:
/// a cell, a point, or a corner of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceFields {
    /// Whose they are, as the comparison names it.
    pub source: String,
    /// Number of vertices of a face: 2 in the plane, 3 in space.
    pub dim: usize,
    /// Number of coordinates of a point: 2 or 3.
    pub space: usize,
    /// Vertices of the faces, `dim` each, ascending.
    pub vertices: Vec<u32>,
    /// Centroids of the faces; none where nothing is known of places.
    pub midpoints: Vec<[f64; 3]>,
    /// |F|; none where all weigh the same.
    pub measures: Vec<f64>,
    pub columns: Vec<FaceColumn>,
}

/// One field: values on some of the faces.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceColumn {
    pub name: String,
    pub kind: ColumnKind,
    /// Values on each face.
    pub components: usize,
    /// The faces that carry it, ascending.
    pub faces: Vec<u32>,
    /// `components` values a face of `faces`.
    pub values: Vec<f64>,
    /// By how much a value on that face can change when no dof changes by more than 1; this makes
    /// a tolerance for dofs one for every field. Empty where a field is judged by its own scale.
    pub sensitivity: Vec<f64>,
}

/// How a field is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// By its values.
    Value,
    /// By the signs of its values: contact where P ≤ 0, non-contact where P > 0.
    Status,
}

impl FaceFields {
    pub fn face_count(&self) -> usize {
        self.vertices.len() / self.dim
    }

    /// Vertices of a face, ascending.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.vertices[self.dim * face..self.dim * (face + 1)]
    }

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
