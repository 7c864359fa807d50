//! Merges pieces into one mesh: one after the other, as VTK's own reader does.

use super::topology::Cells;
use super::unpack::Budget;
use crate::field::data::{to_i64, with_numbers};
use crate::io::scalar::Scalar;
use crate::mesh::{Array, CellBlock, CellKind, Field, Polyhedra, Support, Values};
use std::iter::repeat_n;

/// The contents of one `<Piece>`, or of several together.
#[derive(Default)]
pub(crate) struct Piece {
    pub points: Array<[f64; 3]>,
    /// Runs of cells of one type, whose nodes are points of this piece.
    pub blocks: Vec<CellBlock>,
    pub polyhedra: Polyhedra,
    /// On all points or cells.
    pub fields: Vec<Field>,
}

/// VTK's marks of points and cells, of which the lowest bit means that another piece has them as well.
const GHOSTS: &str = "vtkGhostType";

impl Piece {
    /// How many points and cells there are.
    fn counts(&self) -> [usize; 2] {
        let cells = self.blocks.iter().map(CellBlock::len).sum();
        [self.points.len(), cells]
    }

    /// Takes the cells; arrays on them, one tuple for each cell of the file, get one for each cell here.
    pub fn take_cells(
        &mut self,
        cells: Cells,
        budget: &mut Budget,
        warnings: &mut Vec<String>,
    ) -> Result<(), String> {
        warnings.extend(cells.notes());
        let count: usize = cells.blocks.iter().map(CellBlock::len).sum();
        if !cells.parts.is_empty() {
            let on_cells = |field: &&mut Field| field.on == Support::Cells;
            for array in self.fields.iter_mut().filter(on_cells) {
                budget.take((count as u64).saturating_mul(8 * array.components as u64))?;
                let rows = cells.parts.iter();
                let rows = rows
                    .flat_map(|&(cells, parts)| repeat_n(parts, cells))
                    .enumerate();
                let rows = rows.flat_map(|(row, parts)| repeat_n(row, parts));
                array.values = select(&array.values, array.components, rows);
            }
        }
        (self.blocks, self.polyhedra) = (cells.blocks, cells.polyhedra);
        Ok(())
    }

    /// Leaves out the cells that are marked as those of another piece, and the points that only they have; returns their
    /// number.
    pub fn leave_ghosts_out(&mut self) -> usize {
        let marks = self.fields.iter().find(|array| {
            array.name == GHOSTS && array.on == Support::Cells && array.components == 1
        });
        let Some(marks) = marks.and_then(|array| to_i64(&array.values)) else {
            return 0;
        };
        let kept: Vec<bool> = marks.iter().map(|mark| mark & 1 == 0).collect();
        let ghosts = kept.iter().filter(|kept| !**kept).count();
        if ghosts == 0 || kept.len() != self.counts()[1] {
            return 0;
        }
        // Points of no cell at all stay.
        let mut of_ghosts = vec![false; self.points.len()];
        let mut of_others = of_ghosts.clone();
        let mut polyhedra = Polyhedra::default();
        let before = std::mem::take(&mut self.polyhedra);
        let mut faces = before.iter();
        let mut cell = kept.iter();
        for block in &mut self.blocks {
            let width = block.kind.points();
            let solid = matches!(block.kind, CellKind::Polyhedron(_));
            let mut nodes = Vec::with_capacity(block.nodes.len());
            for (corners, &kept) in block.nodes.chunks_exact(width).zip(&mut cell) {
                let faces = if solid { faces.next() } else { None };
                let of = if kept { &mut of_others } else { &mut of_ghosts };
                corners.iter().for_each(|&node| of[node as usize] = true);
                if kept {
                    nodes.extend_from_slice(corners);
                    if let Some(faces) = faces {
                        polyhedra.push(faces.stream());
                    }
                }
            }
            block.nodes = nodes.into();
        }
        self.blocks.retain(|block| !block.is_empty());
        let places = |kept: &mut dyn Iterator<Item = bool>| -> Vec<usize> {
            kept.enumerate()
                .filter_map(|(place, kept)| kept.then_some(place))
                .collect()
        };
        let cells = places(&mut kept.iter().copied());
        let points = places(
            &mut of_ghosts
                .iter()
                .zip(&of_others)
                .map(|(ghost, other)| !ghost || *other),
        );
        let mut number = vec![0u32; self.points.len()];
        for (new, &old) in points.iter().enumerate() {
            number[old] = new as u32;
        }
        for faces in polyhedra.iter() {
            self.polyhedra
                .push(faces.renumbered(|node| number[node as usize]));
        }
        let nodes = self
            .blocks
            .iter_mut()
            .flat_map(|block| block.nodes.to_mut());
        nodes.for_each(|node| *node = number[*node as usize]);
        self.points = points.iter().map(|&place| self.points[place]).collect();
        for array in &mut self.fields {
            let places = [&points, &cells][usize::from(array.on == Support::Cells)];
            array.values = select(&array.values, array.components, places.iter().copied());
        }
        ghosts
    }
}

/// The tuples at these places; places beyond the last are passed over.
pub(super) fn select(
    values: &Values,
    components: usize,
    places: impl Iterator<Item = usize>,
) -> Values {
    fn pick<T: Scalar>(values: &[T], width: usize, places: impl Iterator<Item = usize>) -> Values {
        let rows = places.filter_map(|place| values.get(place * width..(place + 1) * width));
        T::values(rows.flatten().copied().collect())
    }
    with_numbers!(values, values => pick(values, components, places))
}

/// Merges pieces; points shared by pieces are not merged. The error states what does not fit.
pub(crate) fn merge(pieces: Vec<Piece>) -> Result<Piece, String> {
    let mut merged = Piece::default();
    for (index, piece) in pieces.into_iter().enumerate() {
        let (before, new) = (merged.counts(), piece.counts());
        if (0..2).any(|k| u32::try_from(before[k] + new[k]).is_err()) {
            return Err("there are more than 2^32 - 1 points or cells".into());
        }
        append_blocks(&mut merged.blocks, piece.blocks, before[0] as u32);
        merged.polyhedra.append(&piece.polyhedra, before[0] as u32);
        merged.points.append(piece.points);
        let (on_points, on_cells) =
            (piece.fields.into_iter()).partition(|f| f.on == Support::Points);
        for (k, (on, fields)) in [(Support::Points, on_points), (Support::Cells, on_cells)]
            .into_iter()
            .enumerate()
        {
            append_fields(&mut merged.fields, on, fields, new[k], before[k]).map_err(|name| {
                format!(
                    "not all pieces have the array {name:?} on {on}, or have it in another type: see piece {index}"
                )
            })?;
        }
    }
    Ok(merged)
}

/// Appends runs of cells whose nodes count from the point `base`, which fits as all points do.
fn append_blocks(blocks: &mut Vec<CellBlock>, new: Vec<CellBlock>, base: u32) {
    for mut block in new {
        if base > 0 {
            block
                .nodes
                .to_mut()
                .iter_mut()
                .for_each(|node| *node += base);
        }
        match blocks.last_mut().filter(|last| last.kind == block.kind) {
            Some(last) => last.nodes.append(block.nodes),
            None => blocks.push(block),
        }
    }
}

/// Appends the fields of a piece of `new` tuples to those of the `before` tuples so far. A piece without tuples may
/// lack fields. The error is the name that does not fit.
fn append_fields(
    list: &mut Vec<Field>,
    on: Support,
    mut fields: Vec<Field>,
    new: usize,
    before: usize,
) -> Result<(), String> {
    if before == 0 {
        if new > 0 || !list.iter().any(|field| field.on == on) {
            list.retain(|field| field.on != on);
            list.append(&mut fields);
        }
        return Ok(());
    }
    if new == 0 {
        return Ok(());
    }
    for field in list.iter_mut().filter(|field| field.on == on) {
        let same = |other: &Field| other.name == field.name && other.components == field.components;
        let other = fields
            .iter()
            .position(same)
            .map(|at| fields.swap_remove(at));
        if !other.is_some_and(|other| append_values(&mut field.values, &other.values)) {
            return Err(field.name.clone());
        }
    }
    fields.pop().map_or(Ok(()), |field| Err(field.name))
}

/// Appends values of the same type; returns whether the types are the same.
fn append_values(all: &mut Values, new: &Values) -> bool {
    fn append<T: Scalar>(all: &mut Vec<T>, new: &Values) -> bool {
        T::of_values(new)
            .map(|new| all.extend_from_slice(new))
            .is_some()
    }
    with_numbers!(all, all => append(all.to_mut(), new))
}

#[cfg(test)]
mod tests {
    use super::super::from_bytes;
    use crate::io::Content;
    use crate::mesh::{CellKind, Support, Values};
    use std::path::Path;

    /// A piece of the points (x, 0), (x + 1, 0), (x, 1) and cells of them.
    fn piece(x: f64, cells: &[(u8, &[u8])], on_points: &str, on_cells: &str) -> String {
        let array = |kind: &str, name: &str, text: String| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>"
            )
        };
        let list = |values: Vec<u8>| values.iter().map(|v| format!("{v} ")).collect::<String>();
        let nodes = list(cells.iter().flat_map(|cell| cell.1).copied().collect());
        let ends = cells.iter().scan(0, |end, cell| {
            *end += cell.1.len() as u8;
            Some(*end)
        });
        format!(
            "<Piece NumberOfPoints=\"3\" NumberOfCells=\"{}\"><PointData>{on_points}</PointData><CellData>{on_cells}\
             </CellData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\
             {x} 0 0 {} 0 0 {x} 1 0</DataArray></Points><Cells>{}{}{}</Cells></Piece>",
            cells.len(),
            x + 1.0,
            array("Int64", "connectivity", nodes),
            array("Int64", "offsets", list(ends.collect())),
            array(
                "UInt8",
                "types",
                list(cells.iter().map(|cell| cell.0).collect())
            ),
        )
    }

    fn field(kind: &str, name: &str, values: &str) -> String {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>")
    }

    fn read(pieces: &[String]) -> crate::error::Result<Content> {
        let text = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{}</UnstructuredGrid></VTKFile>",
            pieces.concat()
        );
        from_bytes(Path::new("pieces.vtu"), text.as_bytes())
    }

    const TRIANGLE: (u8, &[u8]) = (5, &[0, 1, 2]);
    const LINE: (u8, &[u8]) = (3, &[2, 0]);

    #[test]
    fn cells_of_later_pieces_name_their_own_points() {
        let of = |x: f64, cells: &[_], u: &str, k: &str| {
            piece(x, cells, &field("Float64", "u", u), &field("Int32", "k", k))
        };
        let pieces = [
            of(0.0, &[TRIANGLE], "0 1 2", "7"),
            of(10.0, &[TRIANGLE, LINE], "3 4 5", "8 9"),
            of(20.0, &[TRIANGLE], "6 7 8", "10"),
        ];
        let mesh = read(&pieces).unwrap().mesh;
        let x: Vec<f64> = mesh.points.iter().map(|p| p[0]).collect();
        assert_eq!(x, [0.0, 1.0, 0.0, 10.0, 11.0, 10.0, 20.0, 21.0, 20.0]);
        let cells: Vec<_> = mesh.blocks.iter().map(|b| (b.kind, &b.nodes[..])).collect();
        let triangle = CellKind::Triangle;
        assert_eq!(
            cells,
            [
                (triangle, &[0, 1, 2, 3, 4, 5][..]),
                (CellKind::Line, &[5, 3][..]),
                (triangle, &[6, 7, 8][..]),
            ]
        );
        let values = |name: &str| {
            let found = mesh.fields.iter().find(|field| field.name == name);
            let found = found.unwrap();
            (found.on.to_string(), found.values.clone())
        };
        let u = (0..9).map(f64::from).collect();
        assert_eq!(values("u"), (Support::Points.to_string(), Values::F64(u)));
        let k = Values::I32(vec![7, 8, 9, 10].into());
        assert_eq!(values("k"), (Support::Cells.to_string(), k));
    }

    #[test]
    fn an_array_that_a_piece_lacks_or_types_otherwise_is_refused() {
        let whole = field("Float64", "u", "0 1 2");
        for other in [
            String::new(),
            field("Float32", "u", "0 1 2"),
            field("Float64", "v", "0 1 2"),
        ] {
            for turned in [false, true] {
                let mut arrays = [&whole, &other];
                if turned {
                    arrays.swap(0, 1);
                }
                let pieces = arrays.map(|array| piece(0.0, &[TRIANGLE], array, ""));
                let refusal = read(&pieces).unwrap_err().to_string();
                assert!(refusal.contains("see piece 1"), "{other}: {refusal}");
            }
        }
    }
}
