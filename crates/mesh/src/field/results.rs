//! The fields of one file as they are, before they are matched with those of another.

use super::{PADDING, Unread};
use crate::cancel;
use crate::error::Result;
use crate::io::matches;
use crate::mesh::{Array, CellKind, Group};

/// The fields of one file: values on points, cells and corners of cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Results {
    /// The name of the result in the comparison.
    pub source: String,
    /// Number of coordinates: 2 or 3; 1 for a curve, whose points are times, and 0 for rows without a key.
    pub space: usize,
    /// Coordinates of the points; empty where the file has none.
    pub points: Array<[f64; 3]>,
    /// The number of each point; empty where they are numbered 0, 1, 2, ….
    pub ids: Vec<u32>,
    /// The largest number of points of a cell; 0 if there are no cells.
    pub width: usize,
    /// Points of the cells, `width` each, [`PADDING`] where there are fewer.
    pub cells: Array<u32>,
    /// Runs of cells of one kind, in order: kind and number; empty if only point numbers are known.
    pub kinds: Vec<(CellKind, usize)>,
    /// Groups of cells, by their numbers among `cells`.
    pub groups: Vec<Group>,
    /// Fields with a row for each point.
    pub on_points: Vec<ResultField>,
    /// Fields with a row for each cell.
    pub on_cells: Vec<ResultField>,
    /// Values at each point of each cell in turn.
    pub on_corners: Vec<ResultField>,
    /// Numbers about the file as a whole: its time, its cycle.
    pub whole: Vec<ResultField>,
    /// Cells that were left out because another process has them as well.
    pub ghosts: usize,
    /// What else the file contains.
    pub unread: Vec<Unread>,
}

/// One field of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultField {
    /// Its name: fields with the same name are compared.
    pub name: String,
    /// Numbers in a row: 1 for a scalar, 2 or 3 for a vector.
    pub components: usize,
    /// `components` for each item of `at`.
    pub values: Array<f64>,
    /// For integers, what is to be added to each of `values`, which are rounded; empty where that is nothing. `None` for
    /// floats.
    pub rest: Option<Vec<f64>>,
    /// The points, cells or corners that carry it, ascending; `None` if all do.
    pub at: Option<Vec<u32>>,
    /// For a difference of two fields: the field whose size sets the scale.
    pub scaled_by: Option<String>,
    /// Whether the file holds binary32, so that values are rounded to 6e-8 of themselves.
    pub single: bool,
}

/// Names that codes give to the real and the imaginary part of a field `*`.
const COMPLEX: [[&str; 2]; 6] = [
    ["*_re", "*_im"],
    ["*_real", "*_imag"],
    ["*.real", "*.imag"],
    ["*_r", "*_i"],
    ["real_*", "imag_*"],
    ["re_*", "im_*"],
];

impl ResultField {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.values.len() / self.components.max(1)
    }

    /// Whether it has no values.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The row of a point, cell or corner; `None` if it does not carry the field.
    pub fn row_of(&self, item: u32) -> Option<usize> {
        match &self.at {
            None => Some(item as usize),
            Some(at) => at.binary_search(&item).ok(),
        }
    }

    /// Keeps the rows of the points, cells or corners that are kept, which are renumbered.
    fn keep(&mut self, kept: &[bool]) {
        let mut count = 0;
        let numbers: Vec<Option<u32>> = kept
            .iter()
            .map(|kept| {
                count += u32::from(*kept);
                kept.then(|| count - 1)
            })
            .collect();
        let all = || (0..kept.len() as u32).collect();
        let items = self.at.take().unwrap_or_else(all);
        for values in std::iter::once(self.values.to_mut()).chain(&mut self.rest) {
            let rows = items.iter().zip(values.chunks_exact(self.components));
            let rows = rows.filter(|(item, _)| kept[**item as usize]);
            *values = rows.flat_map(|(_, row)| row).copied().collect();
        }
        let at = items.iter().filter_map(|item| numbers[*item as usize]);
        let at: Vec<u32> = at.collect();
        self.at = (at.len() < count as usize).then_some(at);
    }
}

impl Results {
    /// How many cells there are.
    pub fn cell_count(&self) -> usize {
        self.cells.len().checked_div(self.width).unwrap_or(0)
    }

    /// Number of points, whether their coordinates are known or only their numbers.
    pub fn point_count(&self) -> usize {
        self.points.len().max(self.ids.len())
    }

    /// The points of a cell.
    pub fn cell(&self, cell: usize) -> impl Iterator<Item = u32> + Clone {
        let all = &self.cells[self.width * cell..self.width * (cell + 1)];
        all.iter().copied().filter(|p| *p != PADDING)
    }

    /// Keeps the fields whose names `keeps`, and of groups and what was not read what has such a name; returns the names of the others.
    pub fn keep_only(&mut self, keeps: impl Fn(&str) -> bool) -> Vec<String> {
        let mut others = Vec::new();
        for fields in self.all_mut() {
            fields.retain(|field| {
                let kept = keeps(&field.name);
                if !kept {
                    others.push(field.name.clone());
                }
                kept
            });
        }
        self.groups.retain(|group| match &group.name {
            Some(name) => keeps(name),
            None => keeps(&group.tag.to_string()),
        });
        self.unread.retain(|part| {
            let kept = keeps(&part.name);
            if !kept {
                others.push(part.name.clone());
            }
            kept
        });
        others
    }

    /// Keeps the cells of one dimension and their values; returns the number of other cells. A table has none.
    pub fn keep_dimension(&mut self, dim: u8) -> usize {
        let kinds: Vec<CellKind> = self.each_kind().collect();
        let kept: Vec<bool> = kinds.iter().map(|kind| kind.dim() == dim).collect();
        let others = kept.iter().filter(|kept| !**kept).count();
        if others == 0 {
            return 0;
        }
        self.keep_cells(&kinds, &kept);
        others
    }

    /// Leaves out cells, and the points that only they have; returns their number.
    pub fn leave_out(&mut self, cells: &[bool]) -> usize {
        let others = cells.iter().filter(|out| **out).count();
        if others == 0 {
            return 0;
        }
        let kinds: Vec<CellKind> = self.each_kind().collect();
        let before = self.in_cells();
        let kept: Vec<bool> = cells.iter().map(|out| !out).collect();
        self.keep_cells(&kinds, &kept);
        let after = self.in_cells();
        let kept = before
            .iter()
            .zip(after)
            .map(|(before, after)| !before || after);
        self.keep_points(&kept.collect::<Vec<_>>());
        others
    }

    /// Leaves out the points that no cell has; returns their number. Without cells, the points are results by themselves.
    pub fn leave_out_orphans(&mut self) -> usize {
        if self.kinds.is_empty() {
            return 0;
        }
        let kept = self.in_cells();
        let others = kept.iter().filter(|kept| !**kept).count();
        if others > 0 {
            self.keep_points(&kept);
        }
        others
    }

    /// Which points are in cells?
    fn in_cells(&self) -> Vec<bool> {
        let mut found = vec![false; self.point_count()];
        let points = self.cells.iter().filter(|p| **p != PADDING);
        points.for_each(|p| found[*p as usize] = true);
        found
    }

    /// The points that remain are numbered anew.
    fn keep_points(&mut self, kept: &[bool]) {
        let mut count = 0;
        let numbers: Vec<u32> = kept
            .iter()
            .map(|kept| {
                count += u32::from(*kept);
                count.wrapping_sub(1)
            })
            .collect();
        let cells = self.cells.to_mut().iter_mut().filter(|p| **p != PADDING);
        cells.for_each(|p| *p = numbers[*p as usize]);
        self.on_points.iter_mut().for_each(|field| field.keep(kept));
        let mut each = kept.iter();
        self.points
            .to_mut()
            .retain(|_| each.next().is_some_and(|kept| *kept));
        let mut each = kept.iter();
        self.ids.retain(|_| each.next().is_some_and(|kept| *kept));
    }

    fn keep_cells(&mut self, kinds: &[CellKind], kept: &[bool]) {
        let corners = kinds.iter().zip(kept);
        let corners = corners.flat_map(|(kind, kept)| std::iter::repeat_n(*kept, kind.points()));
        let corners: Vec<bool> = corners.collect();
        self.on_cells.iter_mut().for_each(|f| f.keep(kept));
        self.on_corners.iter_mut().for_each(|f| f.keep(&corners));
        let before: Vec<u32> = kept
            .iter()
            .scan(0, |count, kept| {
                *count += u32::from(*kept);
                Some(*count - u32::from(*kept))
            })
            .collect();
        for group in &mut self.groups {
            group.cells.retain(|cell| kept[*cell as usize]);
            group
                .cells
                .iter_mut()
                .for_each(|cell| *cell = before[*cell as usize]);
        }
        self.groups.retain(|group| !group.cells.is_empty());
        self.kinds.clear();
        for (kind, _) in kinds.iter().zip(kept).filter(|(_, kept)| **kept) {
            match self.kinds.last_mut() {
                Some((last, count)) if last == kind => *count += 1,
                _ => self.kinds.push((*kind, 1)),
            }
        }
        let width = self.kinds.iter().map(|(kind, _)| kind.points()).max();
        let cells = self.cells.chunks_exact(self.width).zip(kept);
        let cells = cells.filter(|(_, kept)| **kept);
        // The remaining cells may have fewer points.
        let width = width.unwrap_or(0);
        self.cells = cells
            .flat_map(|(cell, _)| &cell[..width])
            .copied()
            .collect();
        self.width = width;
    }

    fn each_kind(&self) -> impl Iterator<Item = CellKind> {
        let runs = self.kinds.iter();
        runs.flat_map(|(kind, count)| std::iter::repeat_n(*kind, *count))
    }

    /// The dimension of each cell; 0 for all where only numbers are known.
    pub fn cell_dimensions(&self) -> Vec<u8> {
        let mut dims: Vec<u8> = self.each_kind().map(|kind| kind.dim()).collect();
        dims.resize(self.cell_count(), 0);
        dims
    }

    /// The dimensions of the cells, ascending; empty where only numbers are known.
    pub fn dimensions(&self) -> Vec<u8> {
        let filled = self.kinds.iter().filter(|(_, count)| *count > 0);
        let mut dims: Vec<u8> = filled.map(|(kind, _)| kind.dim()).collect();
        dims.sort_unstable();
        dims.dedup();
        dims
    }

    /// Whether there are values on cells or at their corners.
    pub fn has_cell_fields(&self) -> bool {
        !self.on_cells.is_empty() || !self.on_corners.is_empty()
    }

    /// Renames the fields `old` to `new`; returns whether there was one.
    pub fn rename(&mut self, old: &str, new: &str) -> bool {
        let named = self.all_mut().into_iter().flatten();
        let named = named.filter(|f| f.name == old);
        named.map(|f| new.clone_into(&mut f.name)).count() > 0
    }

    /// Adds the component that `name` means, as `u[0]` does, or the magnitude, as `|u|` does, of a field, or the complex field of
    /// which a file has real and imaginary parts, as `u_re` and `u_im`; returns whether there is such a field.
    pub fn derive(&mut self, name: &str) -> bool {
        let magnitude = name
            .strip_prefix('|')
            .and_then(|rest| rest.strip_suffix('|'));
        if let Some(of) = magnitude.filter(|of| !self.has(of)) {
            // Of a complex field that is in parts.
            let _is_complex = self.complex(of);
        }
        let component = || -> Option<(&str, usize)> {
            let (of, index) = name.strip_suffix(']')?.rsplit_once('[')?;
            Some((of, index.parse().ok()?))
        };
        let (of, component) = match (magnitude, component()) {
            (Some(of), _) => (of, None),
            (_, Some((of, component))) => (of, Some(component)),
            _ => return self.complex(name),
        };
        let mut found = false;
        for fields in self.all_mut() {
            let known = fields.iter().find(|field| field.name == of);
            let Some(field) = known.filter(|f| component.is_none_or(|c| c < f.components)) else {
                continue;
            };
            let rows = field.values.chunks_exact(field.components);
            let part = |rest: &Vec<f64>| -> Vec<f64> {
                let rows = rest.chunks_exact(field.components);
                component.map_or(Vec::new(), |c| rows.map(|row| row[c]).collect())
            };
            let size = |row: &[f64]| row.iter().fold(0.0_f64, |sum, v| sum.hypot(*v));
            let derived = ResultField {
                name: name.to_owned(),
                components: 1,
                values: rows
                    .map(|row| component.map_or_else(|| size(row), |c| row[c]))
                    .collect(),
                rest: field
                    .rest
                    .as_ref()
                    .filter(|_| component.is_some())
                    .map(part),
                ..field.clone()
            };
            fields.push(derived);
            found = true;
        }
        found
    }

    /// Adds the complex field of this name where there are fields of its real and its imaginary part: these are its components in turn.
    fn complex(&mut self, name: &str) -> bool {
        let mut found = false;
        for fields in self.all_mut() {
            let part = |called: &str| {
                let called = called.replace('*', name);
                fields.iter().find(|field| field.name == called)
            };
            let parts = COMPLEX.iter().find_map(|[re, im]| part(re).zip(part(im)));
            let alike = |(re, im): &(&ResultField, &ResultField)| {
                let same = re.components == im.components && re.values.len() == im.values.len();
                same && re.at == im.at && re.rest.is_none() && im.rest.is_none()
            };
            let Some((re, im)) = parts.filter(alike) else {
                continue;
            };
            let values = re.values.iter().zip(&*im.values);
            let field = ResultField {
                name: name.to_owned(),
                components: 2 * re.components,
                values: values.flat_map(|(re, im)| [*re, *im]).collect(),
                single: re.single || im.single,
                ..re.clone()
            };
            fields.push(field);
            found = true;
        }
        found
    }

    /// Whether there is a field of this name, or one that matches it as a pattern.
    pub fn has(&self, name: &str) -> bool {
        self.all().any(|f| matches(name, &f.name))
    }

    /// All fields, those of the whole last.
    pub fn all(&self) -> impl Iterator<Item = &ResultField> {
        let all = [&self.on_points, &self.on_cells, &self.on_corners];
        all.into_iter().chain([&self.whole]).flatten()
    }

    fn all_mut(&mut self) -> [&mut Vec<ResultField>; 4] {
        [
            &mut self.on_points,
            &mut self.on_cells,
            &mut self.on_corners,
            &mut self.whole,
        ]
    }

    /// Copies borrowed data: owned data cannot be changed by others.
    pub fn own(&mut self) {
        self.points.to_mut();
        self.cells.to_mut();
        for field in self.all_mut().into_iter().flatten() {
            field.values.to_mut();
        }
    }

    /// Whether there is any field on the mesh.
    pub fn is_empty(&self) -> bool {
        [&self.on_points, &self.on_cells, &self.on_corners]
            .iter()
            .all(|fields| fields.is_empty())
    }

    /// The centroids of the cells; none where the points have no coordinates.
    ///
    /// # Errors
    /// [`crate::Error::Ended`].
    pub fn centroids(&self) -> Result<Vec<[f64; 3]>> {
        let centroids = (0..self.cell_count()).filter_map(|cell| self.centroid(cell));
        let polled = centroids.map(|at| cancel::check().map(|()| at));
        polled.collect()
    }

    /// The mean of a cell's points; `None` where a point has no coordinates.
    pub fn centroid(&self, cell: usize) -> Option<[f64; 3]> {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for point in self.cell(cell) {
            let x = self.points.get(point as usize)?;
            sum.iter_mut().zip(x).for_each(|(s, x)| *s += x);
            count += 1.0;
        }
        Some(sum.map(|s| s / count))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn what_is_owned_is_no_memory_of_a_lender() {
        let (points, cells, values) = ([[0.0; 3]; 2], [0, 1], [1.0, 2.0]);
        let (points, cells, values) = (Arc::new(points), Arc::new(cells), Arc::new(values));
        let field = ResultField {
            name: "u".into(),
            components: 1,
            values: Array::lent(values.clone()),
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        };
        let mut results = Results {
            points: Array::lent(points.clone()),
            cells: Array::lent(cells.clone()),
            on_points: vec![field.clone()],
            on_cells: vec![field],
            ..Results::default()
        };
        let lenders = |shared: bool| {
            let counts = [
                Arc::strong_count(&points),
                Arc::strong_count(&cells),
                Arc::strong_count(&values),
            ];
            assert_eq!(counts, if shared { [2, 2, 3] } else { [1, 1, 1] });
        };
        lenders(true);
        results.own();
        lenders(false);
        assert_eq!(results.on_cells[0].values, [1.0, 2.0]);
    }

    #[test]
    fn real_and_imaginary_parts_are_one_field() {
        let field = |name: &str, values: [f64; 2]| ResultField {
            name: name.into(),
            components: 1,
            values: values.to_vec().into(),
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        };
        let mut results = Results {
            on_points: vec![
                field("real_u", [3.0, 0.0]),
                field("imag_u", [4.0, -1.0]),
                field("p_re", [1.0; 2]),
            ],
            ..Results::default()
        };
        assert!(!results.derive("p") && results.derive("|u|"));
        let named = |name: &str| {
            results
                .all()
                .find(|f| f.name == name)
                .map(|f| f.values.to_vec())
        };
        assert_eq!(named("u"), Some(vec![3.0, 4.0, 0.0, -1.0]));
        assert_eq!(named("|u|"), Some(vec![5.0, 1.0]));
    }

    #[test]
    fn cells_of_other_dimensions_go_with_what_they_carry() {
        let field = |values: &[f64], at: Option<&[u32]>| ResultField {
            name: "w".into(),
            components: 2,
            values: values.to_vec().into(),
            rest: None,
            at: at.map(<[u32]>::to_vec),
            scaled_by: None,
            single: false,
        };
        let mut results = Results {
            points: vec![[0.0; 3]; 4].into(),
            width: 4,
            cells: vec![
                0, 1, 2, PADDING, // a triangle
                0, 1, PADDING, PADDING, // a line
                1, 2, 3, PADDING, // a triangle
                0, 1, 2, 3, // a tetrahedron
            ]
            .into(),
            kinds: vec![
                (CellKind::Triangle, 1),
                (CellKind::Line, 1),
                (CellKind::Triangle, 1),
                (CellKind::Tetrahedron, 1),
            ],
            on_cells: vec![
                field(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5], None),
                field(&[1.0, 1.5, 2.0, 2.5], Some(&[1, 2])),
            ],
            ..Results::default()
        };
        let group = |dim, cells: &[u32]| Group {
            cells: cells.to_vec(),
            ..Group::new(dim, 7)
        };
        results.groups = vec![group(1, &[1]), group(2, &[0, 2])];
        let corners: Vec<f64> = (0..24).map(f64::from).collect();
        results.on_corners = vec![field(&corners, None)];
        assert_eq!(results.dimensions(), [1, 2, 3]);
        assert_eq!(results.keep_dimension(2), 2);
        assert_eq!((results.width, results.dimensions()), (3, vec![2]));
        assert_eq!(results.cells, [0, 1, 2, 1, 2, 3]);
        assert_eq!(results.groups, [group(2, &[0, 1])]);
        assert_eq!(results.on_cells[0], field(&[0.0, 0.5, 2.0, 2.5], None));
        assert_eq!(results.on_cells[1], field(&[2.0, 2.5], Some(&[1])));
        let kept: Vec<f64> = (0..6).chain(10..16).map(f64::from).collect();
        assert_eq!(results.on_corners[0], field(&kept, None));
        assert_eq!(results.keep_dimension(2), 0);
    }
}
