//! The fields of one file, each value keyed by points, so that two files can be aligned.

use super::On;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ColumnKind, FaceColumn, FaceFields, PADDING, ResultField, Results};

pub(super) fn fields_on(results: &Results, on: On) -> &[ResultField] {
    match on {
        On::Points => &results.on_points,
        On::Cells => &results.on_cells,
        On::Corners => &results.on_corners,
    }
}

/// The fields of one file on points, cells or corners, keyed so that they can be aligned.
pub(super) struct Keyed<'a> {
    pub fields: FaceFields,
    pub carried: &'a [ResultField],
    /// Where points became corners: the row of a point field that each corner uses.
    pub corner_points: Option<Vec<u32>>,
}

impl<'a> Keyed<'a> {
    pub fn new(side: &'a Results, numbers: &[u32], on: On, broken: bool) -> Result<Self> {
        let mut fields = FaceFields {
            source: side.source.clone(),
            dim: 1,
            space: side.space,
            vertices: Vec::new(),
            midpoints: Vec::new(),
            measures: Vec::new(),
            columns: Vec::new(),
        };
        let mut corner_points = None;
        match on {
            On::Points if !broken => {
                fields.vertices = numbers.to_vec();
                fields.midpoints.clone_from(&side.points);
            }
            On::Cells => {
                fields.dim = side.width;
                for cell in 0..side.cell_count() {
                    push_key(&mut fields.vertices, side, cell, numbers, None)?;
                }
                if !side.points.is_empty() {
                    fields.midpoints = side.centroids().points;
                }
            }
            On::Points | On::Corners => {
                fields.dim = side.width + 1;
                let corners = side.width * side.cell_count();
                fields.vertices.reserve_exact(fields.dim * corners);
                let mut points = Vec::with_capacity(corners);
                for cell in 0..side.cell_count() {
                    for point in side.cell(cell) {
                        push_key(&mut fields.vertices, side, cell, numbers, Some(point))?;
                        points.push(point);
                    }
                }
                if on == On::Points {
                    add_orphans(&mut fields.vertices, &mut points, side, numbers);
                }
                if !side.points.is_empty() {
                    let places = points.iter().map(|p| side.points[*p as usize]);
                    fields.midpoints = places.collect();
                }
                if on == On::Points {
                    corner_points = Some(points);
                }
            }
        }
        Ok(Keyed {
            fields,
            carried: fields_on(side, on),
            corner_points,
        })
    }

    /// A field in the form that [`super::column`] judges.
    pub fn column(&self, field: &ResultField) -> FaceColumn {
        let all = || (0..self.fields.face_count() as u32).collect();
        let (faces, values): (Vec<u32>, Vec<f64>) = match &self.corner_points {
            None => (field.at.clone().unwrap_or_else(all), field.values.clone()),
            Some(points) => {
                let rows = field.rows();
                let row = |point: u32| {
                    rows.as_ref()
                        .map_or(Some(point), |r| r.get(&point).copied())
                };
                let corners = points.iter().zip(0..);
                let carried = corners.filter_map(|(&point, corner)| Some((corner, row(point)?)));
                let carried: Vec<(u32, u32)> = carried.collect();
                let values = carried.iter().flat_map(|(_, row)| {
                    let start = *row as usize * field.components;
                    &field.values[start..start + field.components]
                });
                let values = values.copied().collect();
                (carried.iter().map(|(corner, _)| *corner).collect(), values)
            }
        };
        FaceColumn {
            name: field.name.clone(),
            kind: ColumnKind::Value,
            components: field.components,
            faces,
            values,
            sensitivity: Vec::new(),
        }
    }
}

/// In 2D a vector may have a third component, 0, as VTK requires.
pub(super) fn same_length(a: &mut FaceColumn, b: &mut FaceColumn) {
    let shorter = match (a.components, b.components) {
        (2, 3) => a,
        (3, 2) => b,
        _ => return,
    };
    let vectors = shorter.values.chunks_exact(2);
    shorter.values = vectors.flat_map(|v| [v[0], v[1], 0.0]).collect();
    shorter.components = 3;
}

/// The numbers of a cell's points, ascending, followed by that of one of its corners.
fn push_key(
    keys: &mut Vec<u32>,
    side: &Results,
    cell: usize,
    numbers: &[u32],
    corner: Option<u32>,
) -> Result<()> {
    let start = keys.len();
    let number = |point: u32| numbers.get(point as usize).copied().unwrap_or(point);
    keys.extend(side.cell(cell).map(number));
    keys[start..].sort_unstable();
    if keys[start..].windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(Error::Compare {
            a: side.source.clone(),
            b: "the other".into(),
            what: format!(
                "two points of cell {cell} lie at one place, so that its partner is ambiguous"
            ),
            remedy: "match them by vertices, or repair the mesh".into(),
        });
    }
    keys.resize(start + side.width, PADDING);
    keys.extend(corner.map(number));
    Ok(())
}

/// Points that belong to no cell are keyed by themselves.
fn add_orphans(keys: &mut Vec<u32>, points: &mut Vec<u32>, side: &Results, numbers: &[u32]) {
    let mut used = vec![false; side.point_count()];
    points.iter().for_each(|p| used[*p as usize] = true);
    for point in (0..side.point_count()).filter(|p| !used[*p]) {
        keys.extend(std::iter::repeat_n(PADDING, side.width));
        keys.push(numbers[point]);
        points.push(point as u32);
    }
}
