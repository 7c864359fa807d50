//! Numbers as they lie in a file, made points, nodes of cells or values on all cores, in one pass over the file's bytes; and
//! nodes of cells made numbers of a file.

use std::borrow::Cow;
use std::ops::Range;

use super::rows;
use super::vtu::array::RawNumbers;
use super::vtu::scalar::{Scalar, with_type};
use crate::field::to_i64;
use crate::mesh::{CellBlock, Mesh, Values};

/// How the nodes of cells of one kind stand in a file.
pub struct Nodes<'o> {
    /// The file's number of the first point.
    pub base: u32,
    /// The points that are numbered.
    pub points: Range<u32>,
    /// Nodes of a cell in the file.
    pub width: usize,
    /// The place in a cell of each of them, as many as are read.
    pub order: &'o [usize],
    /// Whether the first nodes of all cells come first, then the second ones.
    pub by_place: bool,
}

impl RawNumbers<'_> {
    /// The whole numbers; `None` for others.
    pub fn integers(&self) -> Option<Vec<i64>> {
        match self.values() {
            Values::I64(numbers) => Some(numbers.into_vec()),
            other => to_i64(&other),
        }
    }

    /// Runs of equal rows of so many whole numbers, and the numbers of each run; `None` for others.
    pub fn runs(&self, width: usize) -> Option<(Vec<Range<u32>>, Vec<i64>)> {
        let size = width * with_type!(self.type_name, T => T::WIDTH, 1);
        let runs = rows::runs(&self.bytes, size);
        let row = |run: &Range<u32>| {
            let start = run.start as usize * size;
            self.bytes.get(start..start + size).unwrap_or_default()
        };
        let numbers = RawNumbers {
            type_name: self.type_name,
            bytes: runs
                .iter()
                .flat_map(row)
                .copied()
                .collect::<Vec<u8>>()
                .into(),
            big_endian: self.big_endian,
        };
        Some((runs, numbers.integers()?))
    }

    /// The nodes of cells, as indices of points.
    ///
    /// # Errors
    /// A number that is none of a point, in words.
    pub fn nodes(&self, of: &Nodes<'_>) -> Result<Vec<u32>, String> {
        with_type!(self.type_name, T => self.nodes_of::<T>(of), Err("there are no numbers".into()))
    }

    fn nodes_of<T: Scalar>(&self, of: &Nodes<'_>) -> Result<Vec<u32>, String> {
        let (start, count) = (of.points.start, of.points.len() as u32);
        // Without a branch, so that the loops are vectorised.
        let beyond = |word: T| {
            let (index, odd) = word.index_from(of.base);
            odd | u32::from(index >= count)
        };
        let cells = self.len() / of.width;
        let read = of.order.len();
        let in_order = read == of.width && of.order.is_sorted();
        let words = |from: usize, count: usize| {
            let bytes = self
                .bytes
                .get(from * T::WIDTH..(from + count) * T::WIDTH)
                .unwrap_or_default();
            T::each(bytes, self.big_endian)
        };
        let share = |first: usize, nodes: &mut [u32]| {
            let mut odd = 0;
            let mut node = |word: T| {
                odd |= beyond(word);
                start.wrapping_add(word.index_from(of.base).0)
            };
            if of.by_place {
                let mut column = vec![0; nodes.len() / read];
                for (place, &at) in of.order.iter().enumerate() {
                    let words = words(place * cells + first, column.len());
                    let each = column.iter_mut().zip(words);
                    each.for_each(|(to, word)| *to = node(word));
                    let places = nodes.iter_mut().skip(at).step_by(read);
                    places.zip(&column).for_each(|(to, node)| *to = *node);
                }
            } else if in_order {
                let words = words(first * read, nodes.len());
                nodes
                    .iter_mut()
                    .zip(words)
                    .for_each(|(to, word)| *to = node(word));
            } else {
                let size = of.width * T::WIDTH;
                let rows = self.bytes.get(first * size..).unwrap_or_default();
                for (cell, row) in nodes.chunks_exact_mut(read).zip(rows.chunks_exact(size)) {
                    let words = T::each(row, self.big_endian).zip(of.order);
                    words.for_each(|(word, &at)| cell[at] = node(word));
                }
            }
            odd == 0
        };
        let mut nodes = Vec::new();
        if rows::fill(&mut nodes, cells, read, share) {
            return Ok(nodes);
        }
        let mut all = words(0, self.len());
        let odd = all.find(|&word| beyond(word) != 0).map(T::float);
        Err(format!(
            "it names the node {} of {count}",
            odd.unwrap_or(0.0)
        ))
    }

    /// Points of rows of one to three coordinates.
    pub fn points(&self, width: usize) -> Vec<[f64; 3]> {
        with_type!(self.type_name, T => match width {
            1 => self.points_of::<T, 1>(),
            2 => self.points_of::<T, 2>(),
            _ => self.points_of::<T, 3>(),
        }, Vec::new())
    }

    fn points_of<T: Scalar, const WIDTH: usize>(&self) -> Vec<[f64; 3]> {
        let (mut points, size) = (Vec::new(), WIDTH * T::WIDTH);
        let fill = |first: usize, points: &mut [[f64; 3]]| {
            let rows = self.bytes.get(first * size..).unwrap_or_default();
            for (point, row) in points.iter_mut().zip(rows.chunks_exact(size)) {
                let numbers = point.iter_mut().zip(T::each(row, self.big_endian));
                numbers.for_each(|(x, number)| *x = number.float());
            }
            true
        };
        rows::fill(&mut points, self.len() / WIDTH, 1, fill);
        points
    }
}

/// Points of columns of coordinates, each given with the place of the first.
pub fn points(columns: &[(&RawNumbers<'_>, usize)], count: usize) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    rows::fill(&mut points, count, 1, |first, points: &mut [[f64; 3]]| {
        for (axis, (numbers, start)) in columns.iter().enumerate() {
            with_type!(numbers.type_name, T => {
                let bytes = numbers.bytes.get((start + first) * T::WIDTH..).unwrap_or_default();
                let numbers = T::each(bytes, numbers.big_endian);
                points.iter_mut().zip(numbers).for_each(|(point, x)| point[axis] = x.float());
            }, ());
        }
        true
    });
    points
}

/// The nodes of cells of one kind that are written.
pub struct CellNodes<'a> {
    nodes: Cow<'a, [u32]>,
    /// Where each node of a cell of the file is in a cell here.
    order: Cow<'a, [usize]>,
    by_place: bool,
}

impl<'a> CellNodes<'a> {
    /// Nodes cell by cell; `by_place` as [`Nodes::by_place`].
    pub fn new(
        nodes: impl Into<Cow<'a, [u32]>>,
        order: impl Into<Cow<'a, [usize]>>,
        by_place: bool,
    ) -> Self {
        CellNodes {
            nodes: nodes.into(),
            order: order.into(),
            by_place,
        }
    }

    /// Cells of one kind anywhere in a mesh.
    pub fn of_cells(
        mesh: &'a Mesh,
        cells: &[u32],
        order: impl Into<Cow<'a, [usize]>>,
        by_place: bool,
    ) -> Self {
        let mut nodes: Cow<'a, [u32]> = Cow::default();
        let mut rest = cells;
        let mut start = 0;
        for block in &mesh.blocks {
            let (end, width) = (start + block.len(), block.kind.points());
            let inside = rest.iter().take_while(|&&cell| (cell as usize) < end);
            let (of_block, others) = rest.split_at(inside.count());
            for run in of_block.chunk_by(|a, b| a + 1 == *b) {
                let first = (run[0] as usize).saturating_sub(start);
                let part = block.nodes.get(first * width..(first + run.len()) * width);
                let part = part.unwrap_or_default();
                match nodes.is_empty() {
                    true => nodes = Cow::Borrowed(part),
                    false => nodes.to_mut().extend(part),
                }
            }
            (rest, start) = (others, end);
        }
        CellNodes::new(nodes, order, by_place)
    }

    /// The cells of blocks of one kind.
    pub fn of_blocks(
        blocks: &[&'a CellBlock],
        order: impl Into<Cow<'a, [usize]>>,
        by_place: bool,
    ) -> Self {
        match blocks {
            [one] => CellNodes::new(&*one.nodes, order, by_place),
            several => {
                let nodes: Vec<&[u32]> = several.iter().map(|block| &block.nodes[..]).collect();
                CellNodes::new(nodes.concat(), order, by_place)
            }
        }
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Fills bytes with the numbers from one on.
    pub fn put<const N: usize>(
        &self,
        first: usize,
        bytes: &mut [u8],
        word: impl Fn(u32) -> [u8; N],
    ) {
        let (width, nodes) = (self.order.len(), &self.nodes);
        let cells = nodes.len() / width;
        let from = |at: usize| nodes.get(at..).unwrap_or_default();
        let (mut at, mut words) = (first, bytes.as_chunks_mut().0);
        if !self.by_place && self.order.is_sorted() {
            let each = words.iter_mut().zip(from(first));
            each.for_each(|(to, &node)| *to = word(node));
            return;
        }
        // Up to the last cell of a place, or to the last place of a cell.
        let inner = if self.by_place { cells } else { width };
        while !words.is_empty() {
            let (outer, k) = (at / inner, at % inner);
            let (now, later) = words.split_at_mut(words.len().min(inner - k));
            at += now.len();
            if self.by_place {
                let column = from(k * width + self.order[outer]).iter().step_by(width);
                let each = now.iter_mut().zip(column);
                each.for_each(|(to, &node)| *to = word(node));
            } else {
                let cell = from(outer * width);
                let each = now.iter_mut().zip(&self.order[k..]);
                each.for_each(|(to, &place)| *to = word(cell[place]));
            }
            words = later;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARE: usize = 1 << 12;

    /// Across the ends of shares, in all three layouts, of any type and order of bytes.
    #[test]
    fn nodes_and_points_are_where_they_belong() {
        let cells = 2 * SHARE + 7;
        let number = |cell: usize, place: usize| (1 + (cell * 3 + place) % 1000) as i64;
        let all = |f: &dyn Fn(usize) -> i64| (0..cells * 3).map(f).collect::<Vec<i64>>();
        let rows = all(&|k| number(k / 3, k % 3));
        let columns = all(&|k| number(k % cells, k / cells));
        let mut big = RawNumbers::of(rows.iter().map(|n| n.swap_bytes()).collect::<Vec<_>>());
        big.big_endian = true;
        let of = |order, by_place| Nodes {
            base: 1,
            points: 5..1005,
            width: 3,
            order,
            by_place,
        };
        let expected = |order: &[usize]| -> Vec<u32> {
            let of_cell = |cell: usize| {
                let mut nodes = vec![0; order.len()];
                for (place, &at) in order.iter().enumerate() {
                    nodes[at] = number(cell, place) as u32 + 4;
                }
                nodes
            };
            (0..cells).flat_map(of_cell).collect()
        };
        for order in [&[0, 1, 2][..], &[0, 2, 1], &[1, 0]] {
            let small: Vec<i16> = rows.iter().map(|&n| n as i16).collect();
            for numbers in [&RawNumbers::of(small), &RawNumbers::of(rows.clone()), &big] {
                assert!(numbers.nodes(&of(order, false)) == Ok(expected(order)));
            }
            let columns = RawNumbers::of(columns.clone());
            assert!(columns.nodes(&of(order, true)) == Ok(expected(order)));
        }
        for (odd, shown) in [(0, "0"), (1001, "1001"), (-7, "-7")] {
            let mut rows = rows.clone();
            rows[3 * SHARE + 1] = odd;
            let error = RawNumbers::of(rows).nodes(&of(&[0, 1, 2], false));
            let expected = format!("it names the node {shown} of 1000");
            assert_eq!(error.err(), Some(expected));
        }
        let halves = RawNumbers::of(vec![1.5, 2.5, 3.5]);
        assert!(halves.nodes(&of(&[0, 1, 2], false)).is_err());

        let floats: Vec<f32> = (0..cells * 2).map(|k| k as f32).collect();
        let floats = RawNumbers::of(floats);
        let rows = (0..cells).map(|k| [(2 * k) as f64, (2 * k + 1) as f64, 0.0]);
        assert!(floats.points(2).into_iter().eq(rows));
        let columns = (0..cells).map(|k| [k as f64, (k + cells) as f64, 0.0]);
        let made = points(&[(&floats, 0), (&floats, cells)], cells);
        assert!(made.into_iter().eq(columns));
    }
}
