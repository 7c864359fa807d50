//! Pieces of a mesh, and global arrays, from the elements of a file.

use super::array::{Count, RawNumbers, split_texts};
use super::layout::TEXTS;
use super::merge::{Piece, PieceArray};
use super::scalar::{Scalar, with_type};
use super::unpack::Budget;
use super::xml::{ArrayTag, Document, PieceTag};
use crate::error::{Error, Place, Result};
use crate::field::{GlobalArray, GlobalValues};
use crate::io::rows;
use crate::mesh::{Values, all_finite};
use std::collections::HashSet;
use std::path::Path;

/// Decodes the arrays of one file.
pub(super) struct Decoder<'a> {
    pub path: &'a Path,
    pub document: &'a Document<'a>,
    pub budget: Budget,
    pub warnings: Vec<String>,
}

impl<'a> Decoder<'a> {
    /// Reserves the memory of all packed arrays in the budget before any is unpacked.
    pub fn survey(&mut self) -> Result<()> {
        let document = self.document;
        let pieces = document.pieces.iter().flat_map(|piece| {
            let data = piece.point_data.iter().chain(&piece.cell_data);
            data.chain(&piece.coordinates).chain(&piece.topology)
        });
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
        self.restore_texts(&mut whole);
        Ok(whole)
    }

    /// Converts bytes to texts where the table of texts says so and they are texts.
    fn restore_texts(&mut self, whole: &mut Vec<GlobalArray>) {
        let mut texts = |array: &GlobalArray| match &array.values {
            GlobalValues::Numbers(Values::U8(bytes))
                if bytes.last().is_none_or(|&end| end == 0) =>
            {
                split_texts(bytes, &mut self.budget).ok()
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

    fn whole_array(&mut self, tag: &ArrayTag) -> Result<GlobalArray> {
        let components = tag.components.unwrap_or(1);
        let count = tag
            .tuples
            .map(|tuples| self.product(tag, tuples, components));
        let count = count.transpose()?;
        let values = if tag.type_name == "String" {
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
        Ok(Piece {
            points: self.points(tag)?,
            cell_count: tag.cells,
            blocks: self.cells(tag)?,
            on_points: self.arrays(&tag.point_data, tag.points)?,
            on_cells: self.arrays(&tag.cell_data, tag.cells)?,
        })
    }

    fn points(&mut self, piece: &'a PieceTag) -> Result<Vec<[f64; 3]>> {
        let [tag] = piece.coordinates.as_slice() else {
            if piece.coordinates.is_empty() && piece.points == 0 {
                return Ok(Vec::new());
            }
            let arrays = piece.coordinates.len();
            return Err(self.refuse_piece(piece, format!("<Points> has {arrays} arrays, not one")));
        };
        if tag.components.is_some_and(|components| components != 3) {
            return Err(self.refuse(tag, "points have three coordinates"));
        }
        let count = self.product(tag, piece.points, 3)?;
        let numbers = self.numbers(tag, count)?;
        let points = with_type!(tag.type_name.as_str(), T => points::<T>(&numbers), Vec::new());
        if all_finite(points.as_flattened()) {
            return Ok(points);
        }
        let odd = |point: &[f64; 3]| !point.iter().all(|x| x.is_finite());
        let at = points.iter().position(odd).unwrap_or(0);
        let what = format!("a coordinate of point {at} is not finite");
        Err(self.refuse(tag, what))
    }

    fn arrays(&mut self, tags: &[ArrayTag], tuples: u64) -> Result<Vec<PieceArray>> {
        let mut arrays = Vec::with_capacity(tags.len());
        for tag in tags {
            if tag.type_name == "String" {
                return Err(self.refuse(tag, "text on points or cells is not read"));
            }
            let components = self.components(tag)?;
            let count = self.product(tag, tuples, components as u64)?;
            arrays.push(PieceArray {
                name: tag.name.clone(),
                components,
                values: self.array(tag, Count::AtLeast(count))?,
            });
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

/// Points, of three coordinates each.
fn points<T: Scalar>(numbers: &RawNumbers) -> Vec<[f64; 3]> {
    let bytes = &*numbers.bytes;
    let mut points = vec![[0.0; 3]; bytes.len() / T::WIDTH / 3];
    let convert = |_, bytes: &[u8], points: &mut [[f64; 3]]| {
        let numbers = T::each(bytes, numbers.big_endian);
        let places = points.as_flattened_mut().iter_mut();
        places
            .zip(numbers)
            .for_each(|(place, x)| *place = x.float());
    };
    rows::convert(
        (bytes, 3 * T::WIDTH),
        (&mut points, 1),
        convert,
        |(), ()| (),
    );
    points
}
