//! The fields of one file, each value keyed by points, so that two files can be aligned.

use std::borrow::Cow;
use std::collections::HashMap;

use super::On;
use super::parts::number;
use super::view::{Column, Faces};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ColumnKind, PADDING, ResultField, Results};

pub(super) fn fields_on(results: &Results, on: On) -> &[ResultField] {
    match on {
        On::Points => &results.on_points,
        On::Cells => &results.on_cells,
        On::Corners => &results.on_corners,
        On::Whole => &results.whole,
        On::Functions | On::Domain | On::Unread => &[],
    }
}

/// The fields of one file on points, cells or corners, with keys for aligning them.
pub(super) struct Keyed<'a> {
    pub fields: Faces<'a>,
    pub carried: &'a [ResultField],
    by_name: HashMap<&'a str, &'a ResultField>,
    /// If points became corners: the row of the point field that each corner uses.
    pub corner_points: Option<Vec<u32>>,
}

impl<'a> Keyed<'a> {
    pub fn new(side: &'a Results, numbers: &'a [u32], on: On, broken: bool) -> Result<Self> {
        let mut fields = Faces {
            source: &side.source,
            dim: 1,
            space: side.space,
            vertices: Cow::default(),
            midpoints: Cow::default(),
            measures: &[],
        };
        let mut corner_points = None;
        match on {
            On::Points if !broken => {
                fields.vertices = numbers.into();
                fields.midpoints = Cow::from(&*side.points);
            }
            On::Cells => {
                fields.dim = side.width.max(1);
                let vertices = fields.vertices.to_mut();
                for cell in 0..side.cell_count() {
                    push_key(vertices, side, cell, numbers, None)?;
                }
                fields.midpoints = side.centroids()?.into();
            }
            // One array at a time, each with a separate length: see `Keyed::of_whole`.
            On::Whole | On::Functions | On::Domain | On::Unread => {}
            On::Points | On::Corners => {
                fields.dim = side.width + 1;
                let corners = side.width * side.cell_count();
                let vertices = fields.vertices.to_mut();
                vertices.reserve_exact(fields.dim * corners);
                let mut points = Vec::with_capacity(corners);
                for cell in 0..side.cell_count() {
                    for point in side.cell(cell) {
                        push_key(vertices, side, cell, numbers, Some(point))?;
                        points.push(point);
                    }
                }
                if on == On::Points {
                    add_orphans(vertices, &mut points, side, numbers);
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

    /// The same keys with other fields.
    pub fn carrying(self, carried: &'a [ResultField]) -> Self {
        Keyed::of(self.fields, carried)
    }

    /// One array on the file as a whole, keyed by the order of its entries.
    pub fn of_whole(side: &'a Results, array: &'a ResultField) -> Self {
        let fields = Faces {
            source: &side.source,
            dim: 1,
            space: side.space,
            vertices: (0..array.len() as u32).collect(),
            midpoints: Cow::default(),
            measures: &[],
        };
        Keyed::of(fields, std::slice::from_ref(array))
    }

    fn of(fields: Faces<'a>, carried: &'a [ResultField]) -> Self {
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
    pub fn column(&self, field: &'a ResultField) -> Result<Column<'a>> {
        let mut column = Column {
            name: &field.name,
            kind: ColumnKind::Value,
            components: field.components,
            faces: Cow::default(),
            values: Cow::default(),
            rest: Cow::default(),
        };
        let rest = field.rest.as_deref().unwrap_or_default();
        let Some(points) = &self.corner_points else {
            column.faces = match &field.at {
                Some(at) => at.into(),
                None => (0..self.fields.count() as u32).collect(),
            };
            column.values = Cow::from(&*field.values);
            column.rest = rest.into();
            return Ok(column);
        };
        let (mut faces, mut values, mut rests) = (Vec::new(), Vec::new(), Vec::new());
        for (corner, &point) in (0..).zip(points) {
            cancel::check()?;
            if let Some(row) = field.row_of(point) {
                let row = row * field.components..(row + 1) * field.components;
                faces.push(corner);
                values.extend_from_slice(&field.values[row.clone()]);
                rests.extend(rest.get(row).into_iter().flatten());
            }
        }
        (column.faces, column.values, column.rest) = (faces.into(), values.into(), rests.into());
        Ok(column)
    }

    /// The values that set the scale of a field: those of the field, or those of another one.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn scaling(&self, field: &ResultField) -> Result<Option<Column<'a>>> {
        let by = field.scaled_by.as_deref();
        let other = by.and_then(|name| self.by_name.get(name));
        other.map(|field| self.column(field)).transpose()
    }
}

/// In 2D a vector may have a third component, 0, as VTK requires.
pub(super) fn same_length<'a, 'b>(a: &'b mut Column<'a>, b: &'b mut Column<'a>) {
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

/// The key of a point that belongs to no cell is the point.
fn add_orphans(keys: &mut Vec<u32>, points: &mut Vec<u32>, side: &Results, numbers: &[u32]) {
    let mut used = vec![false; side.point_count()];
    points.iter().for_each(|p| used[*p as usize] = true);
    for point in (0..side.point_count()).filter(|p| !used[*p]) {
        keys.extend(std::iter::repeat_n(PADDING, side.width));
        keys.push(numbers[point]);
        points.push(point as u32);
    }
}
