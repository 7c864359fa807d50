//! The fields of one file, each value keyed by points, so that two files can be aligned.

use std::collections::HashMap;

use super::On;
use super::parts::number;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ColumnKind, FaceColumn, FaceFields, PADDING, ResultField, Results};

pub(super) fn fields_on(results: &Results, on: On) -> &[ResultField] {
    match on {
        On::Points => &results.on_points,
        On::Cells => &results.on_cells,
        On::Corners => &results.on_corners,
        On::Whole => &results.whole,
        On::Functions | On::Domain => &[],
    }
}

/// The fields of one file on points, cells or corners, keyed so that they can be aligned.
pub(super) struct Keyed<'a> {
    pub fields: FaceFields,
    pub carried: &'a [ResultField],
    by_name: HashMap<&'a str, &'a ResultField>,
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
                fields.dim = side.width.max(1);
                for cell in 0..side.cell_count() {
                    push_key(&mut fields.vertices, side, cell, numbers, None)?;
                }
                fields.midpoints = side.centroids()?;
            }
            // One array at a time, each of its own length: see `Keyed::of_whole`.
            On::Whole | On::Functions | On::Domain => {}
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
                    let place = |p: &u32| cancel::check().map(|()| side.points[*p as usize]);
                    fields.midpoints = points.iter().map(place).collect::<Result<_>>()?;
                }
                if on == On::Points {
                    corner_points = Some(points);
                }
            }
        }
        Ok(Keyed {
            corner_points,
            ..Keyed::of(fields, fields_on(side, on))
        })
    }

    /// One array about the file as a whole, keyed by the order of its entries.
    pub fn of_whole(side: &Results, array: &'a ResultField) -> Self {
        let fields = FaceFields {
            source: side.source.clone(),
            dim: 1,
            space: side.space,
            vertices: (0..array.len() as u32).collect(),
            midpoints: Vec::new(),
            measures: Vec::new(),
            columns: Vec::new(),
        };
        Keyed::of(fields, std::slice::from_ref(array))
    }

    fn of(fields: FaceFields, carried: &'a [ResultField]) -> Self {
        let by_name = carried.iter().map(|field| (field.name.as_str(), field));
        Keyed {
            fields,
            carried,
            by_name: by_name.collect(),
            corner_points: None,
        }
    }

    /// A field in the form that [`super::column`] judges.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn column(&self, field: &ResultField) -> Result<FaceColumn> {
        let mut column = FaceColumn {
            name: field.name.clone(),
            kind: ColumnKind::Value,
            components: field.components,
            faces: Vec::new(),
            values: Vec::new(),
            rest: Vec::new(),
            sensitivity: Vec::new(),
        };
        let rest = field.rest.as_deref().unwrap_or_default();
        let Some(points) = &self.corner_points else {
            let all = || (0..self.fields.face_count() as u32).collect();
            column.faces = field.at.clone().unwrap_or_else(all);
            column.values.clone_from(&field.values);
            column.rest = rest.to_vec();
            return Ok(column);
        };
        for (corner, &point) in (0..).zip(points) {
            cancel::check()?;
            if let Some(row) = field.row_of(point) {
                let row = row * field.components..(row + 1) * field.components;
                column.faces.push(corner);
                column.values.extend_from_slice(&field.values[row.clone()]);
                column.rest.extend(rest.get(row).into_iter().flatten());
            }
        }
        Ok(column)
    }

    /// The values that set the scale of a field: its own, or those of another.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn scaling(&self, field: &ResultField) -> Result<Option<FaceColumn>> {
        let by = field.scaled_by.as_deref();
        let other = by.and_then(|name| self.by_name.get(name));
        other.map(|field| self.column(field)).transpose()
    }
}

/// In 2D a vector may have a third component, 0, as VTK requires.
pub(super) fn same_length(a: &mut FaceColumn, b: &mut FaceColumn) {
    let shorter = match (a.components, b.components) {
        (2, 3) => a,
        (3, 2) => b,
        _ => return,
    };
    for values in [&mut shorter.values, &mut shorter.rest] {
        let vectors = values.chunks_exact(2);
        *values = vectors.flat_map(|v| [v[0], v[1], 0.0]).collect();
    }
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
    cancel::check()?;
    let start = keys.len();
    keys.extend(side.cell(cell).map(|point| number(numbers, point)));
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
    keys.extend(corner.map(|point| number(numbers, point)));
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
