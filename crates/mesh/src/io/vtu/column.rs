//! The numbers of an array that is being written.

use super::cells::{order, vtk_type};
use crate::field::data::with_numbers;
use crate::io::scalar::{Number, Scalar, with_type};
use crate::mesh::{CellGroups, Mesh, Values};
use std::borrow::Cow;

/// Numbers in memory, or derived from a mesh while they are written.
pub(crate) enum Column<'a> {
    Values(Cow<'a, Values>),
    Coordinates(&'a [[f64; 3]]),
    /// The nodes of all cells in VTK's order, from 0 on.
    Connectivity(&'a Mesh, Width),
    /// Where the nodes of each cell end in the connectivity.
    Offsets(&'a Mesh, Width),
    /// VTK's types of all cells.
    Types(&'a Mesh),
    /// The tags of the groups of each cell.
    Groups(GroupTags),
}

/// Bits of an integer.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Width {
    Narrow,
    Wide,
}

/// For each cell a row of the tags of its groups.
pub(crate) struct GroupTags {
    pub groups: CellGroups,
    pub cells: usize,
    /// One for each set of groups, all of the same length, which is not 0.
    pub rows: Vec<Vec<i64>>,
    pub width: Width,
}

impl<'a> From<Cow<'a, Values>> for Column<'a> {
    fn from(values: Cow<'a, Values>) -> Self {
        Column::Values(values)
    }
}

impl Column<'_> {
    pub fn len(&self) -> usize {
        match self {
            Column::Values(values) => values.len(),
            Column::Coordinates(points) => 3 * points.len(),
            Column::Connectivity(mesh, _) => {
                mesh.blocks.iter().map(|block| block.nodes.len()).sum()
            }
            Column::Offsets(mesh, _) | Column::Types(mesh) => mesh.cell_count(),
            Column::Groups(tags) => tags.cells * tags.components(),
        }
    }

    /// The type of the numbers.
    pub fn number(&self) -> Number {
        match self {
            Column::Values(values) => Number::of(values),
            Column::Coordinates(_) => Number::F64,
            Column::Connectivity(_, width) | Column::Offsets(_, width) => width.number(),
            Column::Types(_) => Number::U8,
            Column::Groups(tags) => tags.width.number(),
        }
    }

    /// Bytes of one number.
    pub fn width(&self) -> usize {
        self.number().size()
    }

    /// Fills `bytes` with the numbers from `first` on, little-endian.
    pub fn fill(&self, first: usize, bytes: &mut [u8]) {
        fn put<T: Scalar>(numbers: &[T], first: usize, bytes: &mut [u8]) {
            T::put_le(numbers.get(first..).unwrap_or_default(), bytes);
        }
        match self {
            Column::Values(values) => {
                with_numbers!(values.as_ref(), numbers => put(numbers, first, bytes))
            }
            Column::Coordinates(points) => put(points.as_flattened(), first, bytes),
            Column::Connectivity(mesh, width) => connectivity(mesh, *width, first, bytes),
            Column::Offsets(mesh, width) => offsets(mesh, *width, first, bytes),
            Column::Types(mesh) => types(mesh, first, bytes),
            Column::Groups(tags) => tags.fill(first, bytes),
        }
    }

    /// All numbers in memory.
    pub fn values(&self) -> Cow<'_, Values> {
        if let Column::Values(values) = self {
            return Cow::Borrowed(values.as_ref());
        }
        let mut bytes = vec![0; self.len() * self.width()];
        self.fill(0, &mut bytes);
        Cow::Owned(with_type!(self.number(), T => T::values(T::from_bytes(&bytes, false))))
    }
}

impl Width {
    fn number(self) -> Number {
        match self {
            Width::Narrow => Number::I32,
            Width::Wide => Number::I64,
        }
    }

    /// Puts numbers in front, which fit; returns the remaining bytes.
    #[inline]
    fn put(self, bytes: &mut [u8], numbers: impl ExactSizeIterator<Item = i64>) -> &mut [u8] {
        let count = numbers.len().min(bytes.len() / self.number().size());
        let (front, rest) = bytes.split_at_mut(count * self.number().size());
        match self {
            Width::Narrow => {
                for (word, x) in front.as_chunks_mut().0.iter_mut().zip(numbers) {
                    *word = (x as i32).to_le_bytes();
                }
            }
            Width::Wide => {
                for (word, x) in front.as_chunks_mut().0.iter_mut().zip(numbers) {
                    *word = x.to_le_bytes();
                }
            }
        }
        rest
    }
}

fn connectivity(mesh: &Mesh, width: Width, first: usize, mut bytes: &mut [u8]) {
    let mut skip = first;
    for block in &mesh.blocks {
        let Some(nodes) = block.nodes.get(skip..) else {
            skip -= block.nodes.len();
            continue;
        };
        bytes = match order(block.kind) {
            None => width.put(bytes, nodes.iter().map(|&node| i64::from(node))),
            Some(order) => {
                let corners = order.len();
                let node = |place: usize| {
                    let place = place - place % corners + order[place % corners];
                    i64::from(block.nodes[place])
                };
                width.put(bytes, (skip..block.nodes.len()).map(node))
            }
        };
        if bytes.is_empty() {
            return;
        }
        skip = 0;
    }
}

fn offsets(mesh: &Mesh, width: Width, first: usize, mut bytes: &mut [u8]) {
    let (mut skip, mut before) = (first, 0);
    for block in &mesh.blocks {
        let corners = block.kind.points();
        if let Some(left) = block.len().checked_sub(skip) {
            let end = |cell: usize| (before + (skip + cell + 1) * corners) as i64;
            bytes = width.put(bytes, (0..left).map(end));
            if bytes.is_empty() {
                return;
            }
            skip = 0;
        } else {
            skip -= block.len();
        }
        before += block.nodes.len();
    }
}

fn types(mesh: &Mesh, first: usize, mut bytes: &mut [u8]) {
    let mut skip = first;
    for block in &mesh.blocks {
        let Some(left) = block.len().checked_sub(skip) else {
            skip -= block.len();
            continue;
        };
        let (front, rest) = bytes.split_at_mut(left.min(bytes.len()));
        // Kinds without a VTK type were refused earlier.
        front.fill(vtk_type(block.kind).unwrap_or(0));
        (bytes, skip) = (rest, 0);
    }
}

impl GroupTags {
    pub fn components(&self) -> usize {
        self.rows.first().map_or(1, Vec::len)
    }

    fn fill(&self, first: usize, mut bytes: &mut [u8]) {
        let components = self.components();
        let first_cell = (first / components) as u32;
        for (cells, set) in self.groups.runs_from(first_cell) {
            let Some(row) = self.rows.get(set as usize) else {
                return;
            };
            let start = first.max(cells.start as usize * components);
            let places = start..cells.end as usize * components;
            bytes = match row.as_slice() {
                &[tag] => self.width.put(bytes, places.map(|_| tag)),
                row => self
                    .width
                    .put(bytes, places.map(|place| row[place % components])),
            };
            if bytes.is_empty() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CellBlock, CellKind, Group};

    fn mesh() -> Mesh {
        let group = |dim, tag, cells: &[u32]| Group {
            dim,
            tag,
            name: None,
            cells: cells.to_vec(),
        };
        Mesh {
            points: vec![[0.5, 1.5, 2.5]; 11].into(),
            blocks: vec![
                CellBlock::new(CellKind::Line, vec![3, 4, 4, 5]),
                CellBlock::new(CellKind::Triangle, vec![]),
                CellBlock::new(CellKind::Tetrahedron10, (0..10).chain(1..11).collect()),
                CellBlock::new(CellKind::Vertex, vec![7]),
            ],
            groups: vec![group(1, 5, &[1]), group(3, -2, &[2, 3]), group(3, 9, &[3])],
            ..Mesh::default()
        }
    }

    /// The bytes are the same wherever a thread begins.
    #[test]
    fn every_part_is_that_of_the_whole() {
        let mesh = mesh();
        let groups = |width| {
            Column::Groups(GroupTags {
                groups: CellGroups::new(&mesh),
                cells: mesh.cell_count(),
                rows: vec![vec![0, 0], vec![5, 0], vec![-2, 0], vec![9, -2]],
                width,
            })
        };
        let narrow = [
            (
                Column::Connectivity(&mesh, Width::Narrow),
                vec![
                    3, 4, 4, 5, 0, 1, 2, 3, 4, 5, 6, 7, 9, 8, 1, 2, 3, 4, 5, 6, 7, 8, 10, 9, 7,
                ],
            ),
            (
                Column::Offsets(&mesh, Width::Narrow),
                vec![2, 4, 14, 24, 25],
            ),
            (groups(Width::Narrow), vec![0, 0, 5, 0, -2, 0, 9, -2, 0, 0]),
        ];
        let wide = [
            Column::Connectivity(&mesh, Width::Wide),
            Column::Offsets(&mesh, Width::Wide),
            groups(Width::Wide),
        ];
        for ((narrow, expected), wide) in narrow.iter().zip(wide) {
            assert_eq!(*narrow.values(), Values::I32(expected.clone().into()));
            let expected = expected.iter().map(|&x| i64::from(x)).collect();
            assert_eq!(*wide.values(), Values::I64(expected));
        }
        let types = Column::Types(&mesh);
        assert_eq!(*types.values(), Values::U8(vec![3, 3, 24, 24, 1].into()));
        let coordinates = Column::Coordinates(&mesh.points);
        for column in narrow
            .iter()
            .map(|(column, _)| column)
            .chain([&types, &coordinates])
        {
            let mut whole = vec![0; column.len() * column.width()];
            column.fill(0, &mut whole);
            for first in 0..column.len() {
                for end in first..=column.len() {
                    let mut part = vec![0xee; (end - first) * column.width()];
                    column.fill(first, &mut part);
                    assert_eq!(part, whole[first * column.width()..end * column.width()]);
                }
            }
        }
    }
}
