//! Writes meshes and fields to VTU.
//!
//! `vtkio` cannot write `<FieldData>`, which holds names of groups and provenance; it omits the counts of an empty mesh,
//! which VTK then refuses; its `export_ascii` and `export_le` write another format under a `.vtu` name. So every
//! encoding is written here.

use super::cells::needs_new_version;
use super::column::Column;
use super::layout::{self, Array, FileArrays, Topology, is_in_xml};
use super::pack::{Packed, pack};
use super::xml::POLYGONS;
use super::{Compressor, Encoding};
use crate::error::{Error, Result};
use crate::field::GlobalArray;
use crate::field::data::with_numbers;
use crate::io::out::Out;
use crate::io::scalar::Scalar;
use crate::mesh::{Field, Mesh, Values};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use std::collections::HashSet;
use std::path::Path;

/// Writes a mesh with its fields, further `fields`, and data about the `whole`; the file appears complete or not
/// at all.
///
/// # Errors
/// A mesh that is not valid or has cells that VTK does not have, a field that does not fit the mesh, names that appear
/// twice or that XML cannot hold, a text with a NUL, and errors of the file system.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    fields: &[Field],
    whole: &[GlobalArray],
    encoding: Encoding,
) -> Result<()> {
    mesh.validate().map_err(|what| refuse(path, what))?;
    save(path, mesh, fields, whole, encoding, Topology::Cells)
}

/// [`write()`] of a sound mesh.
pub(super) fn save(
    path: &Path,
    mesh: &Mesh,
    fields: &[Field],
    whole: &[GlobalArray],
    encoding: Encoding,
    topology: Topology,
) -> Result<()> {
    let out = encode(mesh, fields, whole, encoding, topology, Out::to(path)?);
    out.map_err(|what| refuse(path, what))?.save(path)
}

pub(crate) fn refuse(path: &Path, what: String) -> Error {
    Error::whole(path, what, "correct it, or choose another format")
}

/// Appends a file to `out`; the error states why it cannot be written.
pub(super) fn encode(
    mesh: &Mesh,
    fields: &[Field],
    whole: &[GlobalArray],
    encoding: Encoding,
    topology: Topology,
    out: Out,
) -> Result<Out, String> {
    let layout = layout::lay_out(mesh, fields, whole, topology)?;
    check_arrays(&layout)?;
    document(mesh, &layout, encoding, out)
        .map_err(|error| format!("an array was not packed: {error}"))
}

pub(crate) fn check_arrays(layout: &FileArrays) -> Result<(), String> {
    check_names(layout.points.iter().map(|array| &array.name))?;
    check_names(layout.cells.iter().map(|array| &array.name))?;
    check_names(layout.whole.iter().map(|array| &array.name))
}

fn check_names<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), String> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(format!("two arrays are called {name:?}"));
        }
        if !is_in_xml(name) {
            return Err(format!("the name {name:?} holds a control character"));
        }
    }
    Ok(())
}

fn document(
    mesh: &Mesh,
    layout: &FileArrays,
    encoding: Encoding,
    mut out: Out,
) -> std::io::Result<Out> {
    let mut file = File {
        out: Vec::new(),
        encoding,
        appended: Vec::new(),
    };
    // meshio reads no later version, but VTK takes some nodes of high order for others in earlier ones.
    let version = match mesh
        .blocks
        .iter()
        .any(|block| needs_new_version(block.kind))
    {
        true => "2.2",
        false => "1.0",
    };
    let grid = match layout.sections.is_empty() {
        true => "UnstructuredGrid",
        false => "PolyData",
    };
    file.text(&format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{grid}\" version=\"{version}\""
    ));
    file.text(" byte_order=\"LittleEndian\" header_type=\"UInt64\"");
    if let Some(name) = encoding.compressor().vtk_name() {
        file.text(&format!(" compressor=\"{name}\""));
    }
    file.text(&format!(">\n<{grid}>\n<FieldData>\n"));
    for array in &layout.whole {
        let tuples = array.values.len() / array.components;
        file.array(&array.name, array.components, Some(tuples), &array.values)?;
    }
    file.text(&format!(
        "</FieldData>\n<Piece NumberOfPoints=\"{}\"",
        mesh.points.len()
    ));
    match layout.sections.as_slice() {
        [] => file.text(&format!(" NumberOfCells=\"{}\"", mesh.cell_count())),
        sections => {
            for ((_, count, _), [_, ends]) in POLYGONS.into_iter().zip(sections) {
                file.text(&format!(" {count}=\"{}\"", ends.values.len()));
            }
        }
    }
    file.text(">\n");
    file.section("PointData", &layout.points)?;
    file.section("CellData", &layout.cells)?;
    file.section("Points", &layout.geometry)?;
    for ((name, ..), arrays) in POLYGONS.into_iter().zip(&layout.sections) {
        file.section(name, arrays)?;
    }
    if layout.sections.is_empty() {
        file.section("Cells", &layout.topology)?;
    }
    file.text(&format!("</Piece>\n</{grid}>\n"));
    file.append(&mut out);
    out.text("</VTKFile>\n");
    Ok(out)
}

/// Plain numbers after the XML begin at a multiple of this many bytes, so that they can be used where they are. No array is filled
/// up to one: meshio takes it that the next begins where one ends.
const WORD: usize = size_of::<u64>();

/// A file that is being written; arrays of raw encoding come after the XML.
struct File<'a> {
    out: Vec<u8>,
    encoding: Encoding,
    /// With the place in the XML where its offset belongs.
    appended: Vec<(usize, Deferred<'a>)>,
}

/// An array after the XML. Plain numbers are converted to bytes only then.
enum Deferred<'a> {
    Plain(&'a Column<'a>),
    Packed(Packed),
}

impl Deferred<'_> {
    fn len(&self) -> usize {
        match self {
            Deferred::Plain(column) => WORD + column.len() * column.width(),
            Deferred::Packed(packed) => packed.len(),
        }
    }

    fn append(self, out: &mut Out) {
        match self {
            Deferred::Plain(column) => {
                let (count, width) = (column.len(), column.width());
                out.append(&((count * width) as u64).to_le_bytes());
                out.rows(count, width, |first, bytes| column.fill(first, bytes));
            }
            Deferred::Packed(Packed { header, blocks }) => {
                out.append(&header);
                blocks.iter().for_each(|block| out.append(block));
            }
        }
    }
}

impl<'a> File<'a> {
    fn text(&mut self, text: &str) {
        self.out.extend_from_slice(text.as_bytes());
    }

    fn section(&mut self, name: &str, arrays: &'a [Array<'a>]) -> std::io::Result<()> {
        self.text(&format!("<{name}>\n"));
        for array in arrays {
            self.array(&array.name, array.components, None, &array.values)?;
        }
        self.text(&format!("</{name}>\n"));
        Ok(())
    }

    fn array(
        &mut self,
        name: &str,
        components: usize,
        tuples: Option<usize>,
        values: &'a Column<'a>,
    ) -> std::io::Result<()> {
        self.text(&format!(
            "<DataArray type=\"{}\" Name=\"{}\"",
            values.number().name(),
            escape(name)
        ));
        // One component is the default; if it is written, meshio makes a table of one column.
        if components != 1 {
            self.text(&format!(" NumberOfComponents=\"{components}\""));
        }
        if let Some(tuples) = tuples {
            self.text(&format!(" NumberOfTuples=\"{tuples}\""));
        }
        match self.encoding {
            Encoding::Ascii => {
                self.text(" format=\"ascii\">\n");
                print(&values.values(), components, &mut self.out);
                self.text("</DataArray>\n");
            }
            Encoding::Base64(compressor) => {
                self.text(" format=\"binary\">\n");
                let Packed { header, blocks } = packed(values, compressor)?;
                // Plain bytes continue the base64 of the header; compressed ones start a new run.
                let text = if compressor == Compressor::None {
                    BASE64_STANDARD.encode([header, blocks.concat()].concat())
                } else {
                    BASE64_STANDARD.encode(header) + &BASE64_STANDARD.encode(blocks.concat())
                };
                self.text(&text);
                self.text("\n</DataArray>\n");
            }
            Encoding::Raw(compressor) => {
                let array = match compressor {
                    Compressor::None => Deferred::Plain(values),
                    _ => Deferred::Packed(packed(values, compressor)?),
                };
                self.text(" format=\"appended\" offset=\"");
                self.appended.push((self.out.len(), array));
                self.text("\"/>\n");
            }
        }
        Ok(())
    }

    /// The XML and the arrays of raw encoding, these in the reverse order of their elements: meshio looks for the first element with the
    /// offset of each array in turn, and gives the element another then, which could be that of an array to come.
    fn append(mut self, out: &mut Out) {
        let mut offset = 0;
        for (place, array) in self.appended.iter().rev() {
            let text = offset.to_string();
            self.out.splice(*place..*place, text.bytes());
            offset += array.len();
        }
        if matches!(self.encoding, Encoding::Raw(_)) {
            self.text("<AppendedData encoding=\"raw\">\n");
            let first = (self.out.len() + 1).next_multiple_of(WORD);
            self.out.resize(first - 1, b' ');
            self.text("_");
        }
        out.append(&self.out);
        if matches!(self.encoding, Encoding::Raw(_)) {
            let arrays = self.appended.into_iter().rev();
            arrays.for_each(|(_, array)| array.append(out));
            out.text("\n</AppendedData>\n");
        }
    }
}

fn packed(column: &Column, compressor: Compressor) -> std::io::Result<Packed> {
    let width = column.width();
    let fill = |place: usize, bytes: &mut [u8]| column.fill(place / width, bytes);
    pack(column.len() * width, fill, compressor)
}

/// Decimal numbers, one tuple per line.
fn print(values: &Values, components: usize, out: &mut Vec<u8>) {
    fn rows<T: Scalar>(values: &[T], width: usize, out: &mut Vec<u8>) {
        for row in values.chunks(width) {
            for value in row {
                value.print(out);
                out.push(b' ');
            }
            out.push(b'\n');
        }
    }
    with_numbers!(values, numbers => rows(numbers, components, out));
}

/// An attribute's value; blanks other than a space would be read back as spaces.
fn escape(name: &str) -> String {
    quick_xml::escape::escape(name)
        .replace('\t', "&#9;")
        .replace('\n', "&#10;")
        .replace('\r', "&#13;")
}
