//! Numbers as they lie in a file, made points, nodes of cells or values on all cores, in one pass over the file's bytes; and
//! nodes of cells made numbers of a file.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel;

use super::scalar::{Number, Scalar, with_type};
use super::vtu::unpack::Unpacked;
use super::{bytes, rows};
use crate::field::to_i64;
use crate::mesh::{Array, CellBlock, Mesh, Values, highest};

/// Points that one thread makes at a time.
const SHARE: usize = 1 << 12;

/// The order of the nodes of cells of one kind in a file.
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

/// Numbers of one type as bytes; those of a text are converted.
pub(crate) struct RawNumbers<'b> {
    pub number: Number,
    pub bytes: Unpacked<'b>,
    pub big_endian: bool,
}

impl RawNumbers<'_> {
    pub fn of<T: Scalar>(numbers: Vec<T>) -> Self {
        let mut bytes = vec![0; numbers.len() * T::WIDTH];
        T::put_le(&numbers, &mut bytes);
        RawNumbers {
            number: T::TYPE,
            bytes: bytes.into(),
            big_endian: false,
        }
    }

    pub fn values(&self) -> Values {
        with_type!(self.number, T => T::values(T::from_bytes(&self.bytes, self.big_endian)))
    }

    /// Whether a number is among them.
    pub fn has(&self, number: u64) -> bool {
        with_type!(self.number, T => {
            T::each(&self.bytes, self.big_endian).any(|each| each.index() == Some(number))
        })
    }

    /// All but the first.
    pub fn without_first(self) -> Self {
        let width = self.number.size();
        let bytes = match self.bytes {
            Unpacked::Borrowed(bytes) => Unpacked::Borrowed(bytes.get(width..).unwrap_or_default()),
            Unpacked::Owned(bytes) => bytes.get(width..).unwrap_or_default().to_vec().into(),
            Unpacked::Part(file, range) => Unpacked::Part(file, range.start + width..range.end),
        };
        RawNumbers { bytes, ..self }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.number.size()
    }

    /// The integers; `None` for others.
    pub fn integers(&self) -> Option<Vec<i64>> {
        match self.values() {
            Values::I64(numbers) => Some(numbers.into_vec()),
            other => to_i64(&other),
        }
    }

    /// Runs of equal rows of a given number of integers, and the numbers of each run; `None` for others.
    pub fn runs(&self, width: usize) -> Option<(Vec<Range<u32>>, Vec<i64>)> {
        let size = width * self.number.size();
        let runs = rows::runs(&self.bytes, size);
        let row = |run: &Range<u32>| {
            let start = run.start as usize * size;
            self.bytes.get(start..start + size).unwrap_or_default()
        };
        let numbers = RawNumbers {
            number: self.number,
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
    /// A message for a number that is not that of a point.
    pub fn nodes(&self, of: &Nodes<'_>) -> Result<Array<u32>, String> {
        let in_order = of.order.len() == of.width && of.order.is_sorted();
        let as_they_are = in_order && !of.by_place && of.base == 0 && of.points.start == 0;
        if as_they_are && let Some(nodes) = self.lent_nodes(of.points.end) {
            return Ok(nodes);
        }
        with_type!(self.number, T => self.nodes_of::<T>(of))
    }

    /// Nodes that the file lends, each less than `limit`.
    pub fn lent_nodes(&self, limit: u32) -> Option<Array<u32>> {
        // Less than 2^31, a number is the same with a sign and without.
        let fits = matches!(self.number, Number::I32 | Number::U32) && limit <= 1 << 31;
        let nodes = (fits && !self.big_endian).then(|| bytes::lent(&self.bytes))??;
        (highest(&nodes) < limit).then(|| nodes.below(limit))
    }

    fn nodes_of<T: Scalar>(&self, of: &Nodes<'_>) -> Result<Array<u32>, String> {
        let (start, count) = (of.points.start, of.points.len() as u32);
        // Without a branch, so that the loops are vectorised.
        let beyond = |word: T| {
            let (index, odd) = word.index_from(of.base);
            odd | u32::from(index >= count)
        };
        let cells = self.len() / of.width;
        let read = of.order.len();
        let in_order = of.order.iter().copied().eq(0..read);
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
            } else if in_order && read == of.width {
                let words = words(first * read, nodes.len());
                nodes
                    .iter_mut()
                    .zip(words)
                    .for_each(|(to, word)| *to = node(word));
            } else {
                let size = of.width * T::WIDTH;
                let rows = self.bytes.get(first * size..).unwrap_or_default();
                let rows = rows.chunks_exact(size);
                match (in_order, read) {
                    (true, 2) => first_of_rows::<T, 2>(nodes, rows, self.big_endian, node),
                    (true, 3) => first_of_rows::<T, 3>(nodes, rows, self.big_endian, node),
                    (true, 4) => first_of_rows::<T, 4>(nodes, rows, self.big_endian, node),
                    (true, 8) => first_of_rows::<T, 8>(nodes, rows, self.big_endian, node),
                    _ => {
                        for (cell, row) in nodes.chunks_exact_mut(read).zip(rows) {
                            let words = T::each(row, self.big_endian).zip(of.order);
                            words.for_each(|(word, &at)| cell[at] = node(word));
                        }
                    }
                }
            }
            odd == 0
        };
        let mut nodes = Vec::new();
        if rows::fill(&mut nodes, cells, read, share) {
            return Ok(Array::from(nodes).below(of.points.end));
        }
        let mut all = words(0, self.len());
        let odd = all.find(|&word| beyond(word) != 0).map(T::float);
        Err(format!(
            "it names the node {} of {count}",
            odd.unwrap_or(0.0)
        ))
    }

    /// Points of rows of one to three coordinates.
    pub fn points(&self, width: usize) -> Array<[f64; 3]> {
        let as_they_are = self.number == Number::F64 && !self.big_endian && width == 3;
        if as_they_are && let Some(points) = bytes::lent::<[f64; 3]>(&self.bytes) {
            let finite = points.is_finite();
            return points.seen(finite);
        }
        let (bytes, big_endian) = (&*self.bytes, self.big_endian);
        with_type!(self.number, T => match width {
            1 => points_of_rows::<T, 1>(bytes, T::WIDTH, big_endian),
            2 => points_of_rows::<T, 2>(bytes, 2 * T::WIDTH, big_endian),
            _ => points_of_rows::<T, 3>(bytes, 3 * T::WIDTH, big_endian),
        })
    }
}

/// The index of what has this number among `count` things that are numbered from 1 on.
pub fn index(number: i64, count: usize) -> Option<u32> {
    let index = u32::try_from(number.wrapping_sub(1)).ok()?;
    ((index as usize) < count).then_some(index)
}

/// The text in bytes of which the rest is zeros or blanks.
pub fn text(bytes: &[u8]) -> String {
    let end = memchr::memchr(0, bytes).unwrap_or(bytes.len());
    String::from_utf8_lossy(bytes.split_at(end).0)
        .trim()
        .to_owned()
}

/// The first numbers of each row are the nodes of a cell. Their number is a constant, so that the inner loop is unrolled.
fn first_of_rows<'r, T: Scalar, const READ: usize>(
    nodes: &mut [u32],
    rows: impl Iterator<Item = &'r [u8]>,
    big_endian: bool,
    mut node: impl FnMut(T) -> u32,
) {
    for (cell, row) in nodes.as_chunks_mut::<READ>().0.iter_mut().zip(rows) {
        let row = row.get(..READ * T::WIDTH).unwrap_or_default();
        let each = cell.iter_mut().zip(T::each(row, big_endian));
        each.for_each(|(to, word)| *to = node(word));
    }
}

/// Points of columns of coordinates, each given with the place of the first; 0 where a column is missing.
pub fn points(columns: &[(&RawNumbers<'_>, usize)], count: usize) -> Array<[f64; 3]> {
    let Some((first, _)) = columns.first() else {
        return made(count, |_| [0.0; 3]);
    };
    let form = |numbers: &RawNumbers<'_>| (numbers.number, numbers.big_endian);
    let mut others = columns.iter().map(|(numbers, _)| numbers);
    if !others.all(|numbers| numbers.bytes.is_empty() || form(numbers) == form(first)) {
        let each = columns.iter().map(|(numbers, _)| numbers.values().to_f64());
        let each: Vec<RawNumbers<'_>> = each.map(RawNumbers::of).collect();
        let starts = columns.iter().map(|(_, start)| *start);
        return points(&each.iter().zip(starts).collect::<Vec<_>>(), count);
    }
    with_type!(first.number, T => {
        let bytes = |axis: usize| {
            let (numbers, start) = columns.get(axis)?;
            numbers.bytes.get(start * T::WIDTH..(start + count) * T::WIDTH)
        };
        let columns = [0, 1, 2].map(|axis| bytes(axis).unwrap_or_default());
        made(count, |k| columns.map(|bytes| {
            let word = bytes.get(k * T::WIDTH..(k + 1) * T::WIDTH).unwrap_or_default();
            T::each(word, first.big_endian).next().map_or(0.0, T::float)
        }))
    })
}

/// Points at the beginning of rows of a given number of bytes.
pub fn points_of_rows<T: Scalar, const DIM: usize>(
    bytes: &[u8],
    row: usize,
    big_endian: bool,
) -> Array<[f64; 3]> {
    let share = |first: usize, points: &mut [[f64; 3]]| {
        let rows = bytes.get(first * row..).unwrap_or_default();
        let mut finite = true;
        for (point, numbers) in points.iter_mut().zip(rows.chunks_exact(row)) {
            let numbers = numbers.get(..DIM * T::WIDTH).unwrap_or_default();
            for (x, number) in point.iter_mut().zip(T::each(numbers, big_endian)) {
                *x = number.float();
                finite &= x.is_finite();
            }
        }
        finite
    };
    let mut points = Vec::new();
    let finite = rows::fill(&mut points, bytes.len() / row, 1, share);
    Array::from(points).seen(finite)
}

/// Points by their places; whether all are finite is seen on the way.
fn made(count: usize, point: impl Fn(usize) -> [f64; 3] + Sync) -> Array<[f64; 3]> {
    let odd = AtomicBool::new(false);
    let each = |k: usize| {
        let point = point(k);
        if !point.iter().fold(true, |sound, x| sound & x.is_finite()) {
            odd.store(true, Ordering::Relaxed);
        }
        point
    };
    // A few points take less time than waking the other cores.
    let points: Vec<[f64; 3]> = match count <= SHARE {
        true => (0..count).map(each).collect(),
        false => parallel::collect(count, each),
    };
    Array::from(points).seen(!odd.into_inner())
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
        let expected = |order: &[usize]| -> Array<u32> {
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
        assert!(floats.points(2) == rows.collect::<Vec<_>>());
        let columns = (0..cells).map(|k| [k as f64, (k + cells) as f64, 0.0]);
        let made = points(&[(&floats, 0), (&floats, cells)], cells);
        assert!(made == columns.collect::<Vec<_>>());
    }

    /// A file lends numbers that lie in it as they are used, if they are much of it; they are looked at all the same.
    #[test]
    fn a_file_lends_what_is_as_it_is_used() {
        const COUNT: usize = 120_000;
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("numbers");
        let read = |shift: usize, points: &[f64], nodes: &[i32]| {
            let mut all = vec![0; shift];
            all.extend(points.iter().flat_map(|x| x.to_le_bytes()));
            all.extend(nodes.iter().flat_map(|n| n.to_le_bytes()));
            std::fs::write(&path, all).expect("written");
            let file = bytes::read(&path).expect("read");
            let part = |number, part| RawNumbers {
                number,
                bytes: Unpacked::Part(file.clone(), part),
                big_endian: false,
            };
            let end = shift + 24 * COUNT;
            let numbers = (
                part(Number::F64, shift..end),
                part(Number::I32, end..file.len()),
            );
            (file, numbers)
        };
        let of = |count: u32| Nodes {
            base: 0,
            points: 0..count,
            width: 4,
            order: &[0, 1, 2, 3],
            by_place: false,
        };
        let points: Vec<f64> = (0..3 * COUNT).map(|k| k as f64).collect();
        let nodes: Vec<i32> = (0..4 * COUNT).map(|k| (k / 4) as i32).collect();
        for (shift, is_lent) in [(0, true), (8, true), (5, false)] {
            let (file, (at, of_cells)) = read(shift, &points, &nodes);
            let inside = |place: *const u8| file.as_ptr_range().contains(&place);
            let found = at.points(3);
            assert!(found.is_finite() && found.as_flattened() == points);
            assert_eq!(inside(found.as_ptr().cast()), is_lent);
            let found = of_cells.nodes(&of(COUNT as u32)).expect("nodes");
            assert!(found.iter().zip(&nodes).all(|(a, b)| *a == *b as u32));
            assert_eq!(
                (inside(found.as_ptr().cast()), found.limit()),
                (is_lent, Some(COUNT as u32))
            );
            // A tenth of a file is not a reason to keep it.
            let few = RawNumbers {
                bytes: (&at.bytes[..shift + 24 * COUNT / 10]).into(),
                ..at
            };
            assert!(!inside(few.points(3).as_ptr().cast()));
        }
        for (odd, shown) in [
            (COUNT as i32, "120000"),
            (-1, "-1"),
            (i32::MIN, "-2147483648"),
        ] {
            let mut nodes = nodes.clone();
            nodes[3 * COUNT] = odd;
            let (_, (_, of_cells)) = read(0, &points, &nodes);
            let error = of_cells.nodes(&of(COUNT as u32));
            assert_eq!(
                error.err(),
                Some(format!("it names the node {shown} of {COUNT}"))
            );
            assert!(of_cells.nodes(&of(u32::MAX)).is_err() == (odd < 0));
        }
        for odd in [f64::NAN, f64::NEG_INFINITY] {
            let mut points = points.clone();
            points[2 * COUNT] = odd;
            for shift in [0, 5] {
                let (_, (at, _)) = read(shift, &points, &nodes);
                assert!(!at.points(3).is_finite(), "{shift}");
            }
        }
    }
}
