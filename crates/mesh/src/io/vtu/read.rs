//! Pieces of a mesh, and global arrays, from the elements of a file.

use super::array::{Count, Decoder, split_texts};
use super::grids::{Extent, Frame};
use super::lattice::Order;
use super::layout::TEXTS;
use super::merge::Piece;
use super::topology::{Cells, Part, Source, is_uneven};
use super::unpack::Budget;
use super::xml::{ArrayTag, Grid, POLYGONS, PieceTag, TEXT};
use crate::error::{Error, Place, Result};
use crate::field::{GlobalArray, GlobalValues, Tell, to_i64};
use crate::io::raw::RawNumbers;
use crate::io::scalar::{Scalar, with_type};
use crate::mesh::{Array, Field, Polyhedra, Support, Values};
use std::collections::HashSet;

/// The arrays of faces of polyhedra before VTK 9.4, and from then on.
const FACES: [&str; 2] = ["faces", "faceoffsets"];
const NEW_FACES: [&str; 4] = [
    "face_connectivity",
    "face_offsets",
    "polyhedron_to_faces",
    "polyhedron_offsets",
];

impl<'a> Decoder<'a> {
    /// Reserves the memory of all packed arrays in the budget before any is unpacked.
    pub fn survey(&mut self) -> Result<()> {
        let document = self.document;
        let pieces = document.pieces.iter().flat_map(PieceTag::arrays);
        for tag in document.whole.iter().chain(pieces) {
            let declared = self.declared(tag);
            declared
                .and_then(|bytes| self.budget.take(bytes))
                .map_err(|what| self.refuse(tag, what))?;
        }
        Ok(())
    }

    pub fn whole(&mut self) -> Result<Vec<GlobalArray>> {
        let document = self.document;
        let arrays = document.whole.iter();
        let whole = arrays.map(|tag| self.whole_array(tag));
        let mut whole = whole.collect::<Result<Vec<_>>>()?;
        restore_texts(&mut whole, &mut self.budget);
        Ok(whole)
    }

    fn whole_array(&mut self, tag: &ArrayTag) -> Result<GlobalArray> {
        let components = tag.components.unwrap_or(1);
        let count = tag
            .tuples
            .map(|tuples| self.product(tag, tuples, components));
        let count = count.transpose()?;
        let values = if tag.type_name == TEXT {
            GlobalValues::Text(self.texts(tag, count)?)
        } else {
            let count = count.map_or(Count::Any, Count::Exactly);
            GlobalValues::Numbers(self.array(tag, count)?)
        };
        let whole = GlobalArray {
            name: tag.name.clone(),
            components: self.components(tag)?,
            values,
        };
        match &whole.values {
            GlobalValues::Numbers(numbers) if !numbers.len().is_multiple_of(whole.components) => {
                Err(self.refuse(tag, "it ends within a tuple"))
            }
            _ => Ok(whole),
        }
    }

    pub fn piece(&mut self, tag: &'a PieceTag) -> Result<Piece> {
        let (points, cells, counts) = match self.document.grid {
            Grid::Unstructured => (self.points(tag)?, self.cells(tag)?, [tag.points, tag.cells]),
            Grid::Poly => (
                self.points(tag)?,
                self.polygons(tag)?,
                [tag.points, tag.cells],
            ),
            _ => self.structured(tag)?,
        };
        let mut fields = self.arrays(&tag.point_data, counts[0], Support::Points)?;
        fields.extend(self.arrays(&tag.cell_data, counts[1], Support::Cells)?);
        let mut piece = Piece {
            points,
            fields,
            ..Piece::default()
        };
        piece
            .take_cells(cells, &mut self.budget, &mut self.warnings)
            .map_err(|what| self.refuse_piece(tag, what))?;
        Ok(piece)
    }

    /// The cells of an unstructured grid.
    fn cells(&mut self, piece: &'a PieceTag) -> Result<Cells> {
        let find = |name: &str| piece.topology.iter().find(|array| array.name == name);
        let mut cells = Cells::default();
        let (Some(connectivity), Some(offsets), Some(types)) =
            (find("connectivity"), find("offsets"), find("types"))
        else {
            if piece.cells == 0 {
                return Ok(cells);
            }
            let what = "<Cells> lacks connectivity, offsets or types".into();
            return Err(self.refuse_piece(piece, what));
        };
        let ends = self.numbers(offsets, piece.cells)?;
        let codes = self.numbers(types, piece.cells)?;
        let nodes = self.numbers(connectivity, last(&ends))?;
        let (old, new) = (FACES.map(find), NEW_FACES.map(find));
        let mut lists = Vec::new();
        for tag in new.iter().chain(&old).flatten() {
            lists.push((tag.name.as_str(), self.indices(tag)?));
        }
        let list = |name: &str| {
            lists
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, list)| &list[..])
        };
        let faces = |cell: usize| match old.iter().all(Option::is_some) {
            true => old_faces(FACES.map(list), cell),
            false => new_faces(NEW_FACES.map(list), cell),
        };
        let degrees = piece
            .cell_data
            .iter()
            .find(|array| array.name == "HigherOrderDegrees");
        let degrees = degrees.filter(|array| array.components == Some(3));
        let degrees = degrees
            .map(|array| self.array(array, Count::Any))
            .transpose()?;
        let degrees = degrees.map(|values| values.to_f64()).unwrap_or_default();
        let source = Source {
            codes,
            ends,
            nodes,
            order: self.order(),
            uneven: &|cell| is_uneven(&degrees, cell),
            faces: &faces,
        };
        let appended = cells.append(source, piece.points);
        appended.map_err(|(part, what)| {
            let tag = match part {
                Part::Connectivity => connectivity,
                Part::Offsets => offsets,
                Part::Types => types,
            };
            self.refuse(tag, what)
        })?;
        Ok(cells)
    }

    /// The cells of polygonal data: vertices, lines, polygons and strips.
    fn polygons(&mut self, piece: &'a PieceTag) -> Result<Cells> {
        let mut cells = Cells::default();
        for (at, (section, _, code)) in POLYGONS.into_iter().enumerate() {
            let (tags, count) = (&piece.polygons[at], piece.counts[at]);
            let find = |name: &str| tags.iter().find(|array| array.name == name);
            let (Some(connectivity), Some(offsets)) = (find("connectivity"), find("offsets"))
            else {
                if count == 0 {
                    continue;
                }
                return Err(
                    self.refuse_piece(piece, format!("<{section}> lacks connectivity or offsets"))
                );
            };
            let ends = self.numbers(offsets, count)?;
            let nodes = self.numbers(connectivity, last(&ends))?;
            let codes = RawNumbers::of(vec![code; ends.len()]);
            let source = Source::plain(codes, ends, nodes);
            cells.append(source, piece.points).map_err(|(part, what)| {
                let tag = if part == Part::Offsets {
                    offsets
                } else {
                    connectivity
                };
                self.refuse(tag, what)
            })?;
        }
        Ok(cells)
    }

    /// The points and cells of an image, a rectilinear or a structured grid, and the numbers of both.
    fn structured(&mut self, piece: &'a PieceTag) -> Result<(Array<[f64; 3]>, Cells, [u64; 2])> {
        let document = self.document;
        let refuse = |what| {
            Error::file(
                self.path,
                Place::SectionByte("<Piece>".into(), piece.byte),
                what,
                "write the file again",
            )
        };
        let extent =
            Extent::new(piece.extent.unwrap_or_default(), &mut self.budget).map_err(refuse)?;
        let points = match document.grid {
            Grid::Image => Array::from(extent.image(&Frame {
                origin: document.origin,
                spacing: document.spacing.unwrap_or([1.0; 3]),
                direction: document.direction,
            })),
            Grid::Rectilinear => {
                let mut axes = Vec::new();
                for (tag, count) in piece.coordinates.iter().zip(extent.points) {
                    axes.push(self.array(tag, Count::AtLeast(count))?.to_f64());
                }
                let axes = axes.try_into().map_err(|_| {
                    self.refuse_piece(piece, "<Coordinates> does not have three arrays".into())
                })?;
                extent.rectilinear(&axes).into()
            }
            _ => self.points_of(piece, extent.point_count())?,
        };
        if !points.is_finite() {
            return Err(self.refuse_piece(piece, "a coordinate is not finite".into()));
        }
        Ok((
            points,
            extent.cells(),
            [extent.point_count(), extent.cell_count()],
        ))
    }

    /// The order of nodes in Lagrange cells, as VTK reads a file of this version.
    fn order(&self) -> Order {
        match self.document.is_before([2, 1]) {
            true => Order::VtkBefore,
            false => Order::Vtk,
        }
    }

    /// Integers; what is negative, as VTK marks cells without faces, is beyond all.
    fn indices(&mut self, tag: &ArrayTag) -> Result<Vec<u64>> {
        let values = self.array(tag, Count::Any)?;
        let Some(numbers) = to_i64(&values) else {
            return Err(self.refuse(tag, "it holds a value that is not an index"));
        };
        Ok(numbers
            .into_iter()
            .map(|number| u64::try_from(number).unwrap_or(u64::MAX))
            .collect())
    }

    fn points(&mut self, piece: &'a PieceTag) -> Result<Array<[f64; 3]>> {
        self.points_of(piece, piece.points)
    }

    fn points_of(&mut self, piece: &'a PieceTag, count: u64) -> Result<Array<[f64; 3]>> {
        let [tag] = piece.coordinates.as_slice() else {
            if piece.coordinates.is_empty() && count == 0 {
                return Ok(Array::default());
            }
            let arrays = piece.coordinates.len();
            return Err(self.refuse_piece(piece, format!("<Points> has {arrays} arrays, not one")));
        };
        if tag.components.is_some_and(|components| components != 3) {
            return Err(self.refuse(tag, "points have three coordinates"));
        }
        let count = self.product(tag, count, 3)?;
        let numbers = self.numbers(tag, count)?;
        let points = numbers.points(3);
        if points.is_finite() {
            return Ok(points);
        }
        let odd = |point: &[f64; 3]| !point.iter().all(|x| x.is_finite());
        let at = points.iter().position(odd).unwrap_or(0);
        let what = format!("a coordinate of point {at} is not finite");
        Err(self.refuse(tag, what))
    }

    fn arrays(&mut self, tags: &[ArrayTag], tuples: u64, on: Support) -> Result<Vec<Field>> {
        let mut arrays = Vec::with_capacity(tags.len());
        for tag in tags {
            if tag.number.is_none() {
                let (kind, name) = (&tag.type_name, &tag.name);
                self.unread
                    .tell(name, format!("the array {name:?} of {kind} on {on}"));
                continue;
            }
            let components = self.components(tag)?;
            let count = self.product(tag, tuples, components as u64)?;
            let values = self.array(tag, Count::AtLeast(count))?;
            arrays.push(Field::new(&tag.name, on, components, values));
        }
        Ok(arrays)
    }

    /// The components of an array, which are few enough for a `u32` and at least one.
    fn components(&self, tag: &ArrayTag) -> Result<usize> {
        let components = u32::try_from(tag.components.unwrap_or(1)).ok();
        let components = components.filter(|&components| components > 0);
        let components = components.ok_or_else(|| {
            self.refuse(tag, "its NumberOfComponents is 0 or more than 4294967295")
        })?;
        Ok(components as usize)
    }

    fn product(&self, tag: &ArrayTag, a: u64, b: u64) -> Result<u64> {
        let product = a.checked_mul(b);
        product.ok_or_else(|| self.refuse(tag, format!("{a} tuples of {b} values are too many")))
    }

    pub fn refuse(&self, tag: &ArrayTag, what: impl std::fmt::Display) -> Error {
        let place = Place::SectionByte(format!("array {:?}", tag.name), tag.byte);
        Error::file(self.path, place, what.to_string(), "write the file again")
    }

    pub fn refuse_piece(&self, piece: &PieceTag, what: String) -> Error {
        let place = Place::SectionByte("<Piece>".into(), piece.byte);
        Error::file(self.path, place, what, "write the file again")
    }
}

/// Converts bytes to texts if the table of texts lists them and they are texts.
pub(crate) fn restore_texts(whole: &mut Vec<GlobalArray>, budget: &mut Budget) {
    let mut texts = |array: &GlobalArray| match &array.values {
        GlobalValues::Numbers(Values::U8(bytes)) if bytes.last().is_none_or(|&end| end == 0) => {
            split_texts(bytes, budget).ok()
        }
        _ => None,
    };
    let Some(table) = whole.iter().position(|array| array.name == TEXTS) else {
        return;
    };
    let Some(names) = texts(&whole[table]) else {
        return;
    };
    let names: HashSet<String> = names.into_iter().collect();
    whole.remove(table);
    for array in whole.iter_mut().filter(|array| names.contains(&array.name)) {
        if let Some(texts) = texts(array) {
            array.values = GlobalValues::Text(texts);
        }
    }
}

/// The last of the ends of cells; what is not a number of nodes is refused where the cells are read.
fn last(ends: &RawNumbers) -> u64 {
    with_type!(ends.number, T => {
        T::each(&ends.bytes, ends.big_endian).last().and_then(T::index).unwrap_or(0)
    })
}

/// The faces of a cell from a stream of all faces and where those of each cell end.
fn old_faces(lists: [Option<&[u64]>; 2], cell: usize) -> Option<Vec<u32>> {
    let [stream, ends] = lists;
    let (stream, end) = (stream?, usize::try_from(*ends?.get(cell)?).ok()?);
    // VTK marks cells without faces by -1.
    let before = ends?
        .get(..cell)?
        .iter()
        .rev()
        .find(|&&end| end != u64::MAX);
    let start = before.map_or(Some(0), |&start| usize::try_from(start).ok())?;
    let (&count, faces) = stream.get(start..end)?.split_first()?;
    let faces = faces.iter().map(|&number| u32::try_from(number).ok());
    let faces = faces.collect::<Option<Vec<u32>>>()?;
    (Polyhedra::count_faces(&faces) == usize::try_from(count).ok()).then_some(faces)
}

/// The faces of a cell if each face is listed separately: the corners of all faces, where those of each end, the faces of all
/// cells, and where those of each end.
pub(crate) fn new_faces(lists: [Option<&[u64]>; 4], cell: usize) -> Option<Vec<u32>> {
    let [corners, corner_ends, faces, face_ends] = lists;
    fn part<'l>(list: &'l [u64], ends: &[u64], at: usize) -> Option<&'l [u64]> {
        let start = at
            .checked_sub(1)
            .map_or(Some(0), |before| ends.get(before).copied())?;
        list.get(usize::try_from(start).ok()?..usize::try_from(*ends.get(at)?).ok()?)
    }
    let mut stream = Vec::new();
    for &face in part(faces?, face_ends?, cell)? {
        let corners = part(corners?, corner_ends?, usize::try_from(face).ok()?)?;
        stream.push(corners.len() as u32);
        for &corner in corners {
            stream.push(u32::try_from(corner).ok()?);
        }
    }
    Some(stream)
}
