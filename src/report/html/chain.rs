//! The faces of Γ_C in order.

use std::collections::HashMap;

use faceoff_mesh::field::FaceFields;

/// The contact faces of a 2D mesh in consecutive order.
pub(super) struct Chain {
    /// Rows of the columns on Γ_C, and the position of each midpoint.
    pub rows: Vec<usize>,
    pub s: Vec<f64>,
    /// The ends of each face.
    pub ends: Vec<(f64, f64)>,
    /// `x`, `y`, or arc length.
    pub axis: &'static str,
}

/// Positions are coordinates if Γ_C is on one line parallel to an axis, else arc length, connected pieces one
/// after the other.
pub(super) fn chain(fields: &FaceFields, faces: &[u32]) -> Chain {
    let at = |row: usize| fields.midpoints[faces[row] as usize];
    let length = |row: usize| fields.measures[faces[row] as usize];
    let total: f64 = (0..faces.len()).map(length).sum();
    let flat = |axis: usize| {
        let first = faces.first().map_or(0.0, |_| at(0)[axis]);
        (0..faces.len()).all(|row| (at(row)[axis] - first).abs() <= 1e-9 * total)
    };
    let axis = match (flat(1), flat(0)) {
        (true, _) => Some(0),
        (_, true) => Some(1),
        _ => None,
    };
    if let Some(axis) = axis {
        let mut rows: Vec<usize> = (0..faces.len()).collect();
        rows.sort_by(|&i, &j| at(i)[axis].total_cmp(&at(j)[axis]));
        let half = |row: usize| 0.5 * length(row);
        return Chain {
            s: rows.iter().map(|&row| at(row)[axis]).collect(),
            ends: rows
                .iter()
                .map(|&row| (at(row)[axis] - half(row), at(row)[axis] + half(row)))
                .collect(),
            rows,
            axis: ["x", "y"][axis],
        };
    }
    let rows = follow(fields, faces);
    let mut from = 0.0;
    let mut ends = Vec::with_capacity(rows.len());
    for &row in &rows {
        ends.push((from, from + length(row)));
        from += length(row);
    }
    Chain {
        s: ends.iter().map(|(a, b)| 0.5 * (a + b)).collect(),
        ends,
        rows,
        axis: "arc length along Γ_C",
    }
}

/// From an end of each connected piece, or from any point of a closed one, to its other end.
fn follow(fields: &FaceFields, faces: &[u32]) -> Vec<usize> {
    let mut around: HashMap<u32, Vec<usize>> = HashMap::new();
    for (row, &face) in faces.iter().enumerate() {
        for &vertex in fields.face(face as usize) {
            around.entry(vertex).or_default().push(row);
        }
    }
    let is_end = |row: usize| {
        let vertices = fields.face(faces[row] as usize).iter();
        vertices.into_iter().any(|vertex| around[vertex].len() == 1)
    };
    let (ends, inner): (Vec<usize>, Vec<usize>) = (0..faces.len()).partition(|&row| is_end(row));
    let mut taken = vec![false; faces.len()];
    let mut order = Vec::with_capacity(faces.len());
    for start in ends.into_iter().chain(inner) {
        let mut next = Some(start);
        while let Some(row) = next.filter(|row| !taken[*row]) {
            taken[row] = true;
            order.push(row);
            let neighbours = fields.face(faces[row] as usize).iter();
            let mut neighbours = neighbours.flat_map(|vertex| &around[vertex]);
            next = neighbours.find(|other| !taken[**other]).copied();
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(vertices: &[u32], midpoints: &[[f64; 3]]) -> FaceFields {
        FaceFields {
            source: "a".into(),
            dim: 2,
            space: 2,
            vertices: vertices.to_vec(),
            midpoints: midpoints.to_vec(),
            measures: vec![1.0; midpoints.len()],
            columns: Vec::new(),
        }
    }

    #[test]
    fn a_line_is_in_the_order_of_its_coordinate_and_a_corner_is_followed() {
        let line = fields(
            &[1, 2, 0, 1, 2, 3],
            &[[1.5, 7.0, 0.0], [0.5, 7.0, 0.0], [2.5, 7.0, 0.0]],
        );
        let found = chain(&line, &[0, 1, 2]);
        assert_eq!((found.rows, found.axis), (vec![1, 0, 2], "x"));
        let corner = fields(
            &[1, 2, 0, 1, 2, 3],
            &[[1.5, 0.0, 0.0], [0.5, 0.0, 0.0], [2.0, 0.5, 0.0]],
        );
        let found = chain(&corner, &[0, 1, 2]);
        assert_eq!(found.rows, [1, 0, 2]);
        assert_eq!(found.s, [0.5, 1.5, 2.5]);
        // Two pieces, one closed.
        let rows = follow(
            &fields(&[0, 1, 5, 6, 1, 2, 0, 2], &[[0.0; 3]; 4]),
            &[0, 1, 2, 3],
        );
        assert_eq!(rows.len(), 4);
    }
}
