//! Crouzeix–Raviart functions from means on faces: the cells are reconstructed from their faces, and the function is linear on each.

use std::collections::HashMap;

use faceoff_mesh::CellKind;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};

/// Are the cells of a file the faces of a mesh: segments in 2D or triangles in 3D?
pub(super) fn are_faces(side: &Results) -> bool {
    let kinds = side.kinds.iter().filter(|(_, count)| *count > 0);
    let all = |kind| kinds.clone().all(|(of, _)| *of == kind);
    let flat = side.cell_count() > 0 && side.on_points.is_empty() && !side.points.is_empty();
    flat && (side.space == 2 && all(CellKind::Line) || side.space == 3 && all(CellKind::Triangle))
}

/// The functions, discontinuous and linear on each cell, whose means the values on all faces are; and the names of the fields that
/// are not on all faces and hence do not define such a function. None of triangles in space that surround no cells: they are a surface.
///
/// With m_j the mean on the face opposite corner j, u = Σ m_j (1 - d λ_j): at corner i, Σ m_j - d m_i.
///
/// # Errors
/// Faces that do not belong to a cell.
pub(super) fn crouzeix_raviart(side: &Results) -> Result<Option<(Results, Vec<String>)>> {
    let dim = side.space;
    let cells = cells(side, dim)?;
    if cells.is_empty() && dim == 3 {
        return Ok(None);
    }
    if cells.is_empty() {
        return Err(Error::Mesh {
            mesh: side.source.clone(),
            what:
                "its cells are not the faces of a mesh, so values on them do not define functions"
                    .into(),
            remedy: "give results on cells".into(),
        });
    }
    let is_mean = |field: &ResultField| field.at.is_none() && field.rest.is_none();
    let (means, others): (Vec<&ResultField>, Vec<_>) =
        side.on_cells.iter().partition(|f| is_mean(f));
    let on_points = means.into_iter().map(|field| {
        let n = field.components;
        let mut values = Vec::with_capacity(n * (dim + 1) * cells.len());
        for (_, faces) in &cells {
            let mean = |j: usize, component: usize| field.values[faces[j] as usize * n + component];
            for i in 0..=dim {
                for component in 0..n {
                    let sum: f64 = (0..=dim).map(|j| mean(j, component)).sum();
                    values.push(sum - dim as f64 * mean(i, component));
                }
            }
        }
        ResultField {
            values: values.into(),
            ..field.clone()
        }
    });
    let corners = cells.iter().flat_map(|(corners, _)| &corners[..=dim]);
    let found = Results {
        source: side.source.clone(),
        space: side.space,
        points: corners.map(|p| side.points[*p as usize]).collect(),
        width: dim + 1,
        cells: (0..((dim + 1) * cells.len()) as u32).collect(),
        kinds: vec![(
            if dim == 2 {
                CellKind::Triangle
            } else {
                CellKind::Tetrahedron
            },
            cells.len(),
        )],
        on_points: on_points.collect(),
        whole: side.whole.clone(),
        ..Results::default()
    };
    let others = others.into_iter().map(|f| f.name.clone()).collect();
    Ok(Some((found, others)))
}

/// The corners of a cell, and its faces, each opposite its corner.
type Cell = ([u32; 4], [u32; 4]);

/// All simplices all of whose faces are in the file: on each side of a face, the smallest.
fn cells(side: &Results, dim: usize) -> Result<Vec<Cell>> {
    let mut by_corners: HashMap<[u32; 3], u32> = HashMap::with_capacity(side.cell_count());
    let mut at_point: Vec<Vec<u32>> = vec![Vec::new(); side.point_count()];
    let key = |points: &mut dyn Iterator<Item = u32>| {
        let mut key = [u32::MAX; 3];
        key.iter_mut().zip(points).for_each(|(k, p)| *k = p);
        key.sort_unstable();
        key
    };
    for face in 0..side.cell_count() {
        by_corners.insert(key(&mut side.cell(face)), face as u32);
        side.cell(face)
            .for_each(|p| at_point[p as usize].push(face as u32));
    }
    // Each simplex once, from the face opposite its largest corner.
    let mut found: Vec<(Cell, f64)> = Vec::new();
    for face in 0..side.cell_count() {
        cancel::check()?;
        let base: Vec<u32> = side.cell(face).collect();
        let (Some(&first), Some(&largest)) = (base.first(), base.iter().max()) else {
            continue;
        };
        let near = at_point[first as usize]
            .iter()
            .flat_map(|other| side.cell(*other as usize));
        let mut apexes: Vec<u32> = near.filter(|p| *p > largest).collect();
        apexes.sort_unstable();
        apexes.dedup();
        for apex in apexes {
            let mut corners = [0; 4];
            corners[..dim].copy_from_slice(&base);
            corners[dim] = apex;
            let opposite = |i: usize| {
                let mut others = (0..=dim).filter(|j| *j != i).map(|j| corners[j]);
                by_corners.get(&key(&mut others)).copied()
            };
            let faces: Option<Vec<u32>> = (0..=dim).map(opposite).collect();
            if let Some(faces) = faces {
                let mut of = [0; 4];
                of[..=dim].copy_from_slice(&faces);
                found.push(((corners, of), measure(side, dim, &corners)));
            }
        }
    }
    // The smallest on each side of each face, by its index among those found.
    let mut smallest: HashMap<(u32, bool), f64> = HashMap::new();
    let side_of = |(corners, faces): &Cell, i: usize| {
        let mut turned = *corners;
        let face: Vec<u32> = side.cell(faces[i] as usize).collect();
        turned[..dim].copy_from_slice(&face);
        turned[dim] = corners[i];
        measure(side, dim, &turned) > 0.0
    };
    for (cell, size) in &found {
        for i in 0..=dim {
            let least = smallest
                .entry((cell.1[i], side_of(cell, i)))
                .or_insert(f64::INFINITY);
            *least = least.min(size.abs());
        }
    }
    let is_cell = |(cell, size): &(Cell, f64)| {
        (0..=dim).all(|i| smallest.get(&(cell.1[i], side_of(cell, i))) == Some(&size.abs()))
    };
    Ok(found
        .into_iter()
        .filter(is_cell)
        .map(|(cell, _)| cell)
        .collect())
}

fn measure(side: &Results, dim: usize, corners: &[u32; 4]) -> f64 {
    let x = corners.map(|p| side.points[p as usize]);
    let origin = x[0];
    let at = x.map(|x| super::supermesh::subtract(&x, &origin));
    super::supermesh::measure(dim, &at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces(points: Vec<[f64; 3]>, width: usize, cells: Vec<u32>) -> Results {
        let count = cells.len() / width;
        let mut side = Results {
            source: "faces".into(),
            space: width,
            points: points.into(),
            width,
            cells: cells.into(),
            kinds: vec![(
                if width == 2 {
                    CellKind::Line
                } else {
                    CellKind::Triangle
                },
                count,
            )],
            ..Results::default()
        };
        // The mean of x - 2 y + 3 z + 1 is its value at the midpoint.
        let linear = |x: [f64; 3]| x[0] - 2.0 * x[1] + 3.0 * x[2] + 1.0;
        let means = (0..count)
            .map(|face| linear(side.centroid(face).unwrap()))
            .collect();
        side.on_cells = vec![ResultField {
            name: "mean".into(),
            components: 1,
            values: means,
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        }];
        side
    }

    /// A triangle cut into three is not a cell if its parts are; the function is linear again.
    #[test]
    fn cells_are_found_from_their_faces() {
        let points = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.3, 0.3, 0.0],
            [1.0, 1.0, 0.0],
        ];
        let side = faces(
            points,
            2,
            vec![0, 1, 1, 2, 2, 0, 0, 3, 1, 3, 2, 3, 1, 4, 4, 2],
        );
        let corners = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.2, 0.2, 0.2],
        ];
        let mut all = Vec::new();
        for i in 0..5 {
            for j in 0..i {
                all.extend((0..j).flat_map(|k| [i, j, k]));
            }
        }
        let solid = faces(corners, 3, all);
        for (side, count) in [(side, 4), (solid, 4)] {
            assert!(are_faces(&side));
            let (found, others) = crouzeix_raviart(&side).unwrap().unwrap();
            assert_eq!((found.cell_count(), others.len()), (count, 0));
            for (x, u) in found.points.iter().zip(&found.on_points[0].values) {
                let exact = x[0] - 2.0 * x[1] + 3.0 * x[2] + 1.0;
                assert!((u - exact).abs() < 1e-14, "{x:?}: {u}");
            }
        }
        let alone = faces(vec![[0.0; 3], [1.0, 0.0, 0.0]], 2, vec![0, 1]);
        assert!(crouzeix_raviart(&alone).is_err());
    }
}
