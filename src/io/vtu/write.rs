//! Meshes and fields to VTU.
//!
//! `vtkio` has no place for `<FieldData>`, where names of groups and provenance live; it leaves the counts of an
//! empty mesh out, which VTK refuses; its `export_ascii` and `export_le` write another format under a `.vtu` name.
//! So every encoding is written here.

use super::codec::{self, Packed};
use super::layout::{self, Array, Layout};
use super::scalar::Scalar;
use super::{Compressor, Encoding};
use crate::error::{Error, Place, Result};
use crate::field::data::with_numbers;
use crate::field::{Whole, WholeValues};
use crate::io::out;
use crate::mesh::{Field, Mesh, Values};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use std::collections::HashSet;
use std::path::Path;

/// Writes a mesh with its fields, further `fields`, and data about the `whole`; the file appears whole or not at
/// all. What the mesh knows of geometry, periodicity and partitions has no place in VTU: see [`super::losses`].
///
/// # Errors
/// A mesh that contradicts itself or has cells that VTK does not know, a field that does not fit the mesh, names
/// that are there twice or that XML cannot hold, a text with a NUL, and whatever the file system answers.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    fields: &[Field],
    whole: &[Whole],
    encoding: Encoding,
) -> Result<()> {
    let bytes = to_bytes(mesh, fields, whole, encoding).map_err(|what| {
        Error::file(
            path,
            Place::Whole,
            what,
            "VTU cannot hold it: correct it before writing",
        )
    })?;
    out::save(path, &bytes)
}

/// The bytes of a file; in words why there is none, otherwise.
pub(super) fn to_bytes(
    mesh: &Mesh,
    fields: &[Field],
    whole: &[Whole],
    encoding: Encoding,
) -> Result<Vec<u8>, String> {
    mesh.validate()?;
    let layout = layout::lay_out(mesh, fields, whole)?;
    check_arrays(&layout)?;
    document(mesh, &layout, encoding).map_err(|error| format!("an array was not packed: {error}"))
}

fn check_arrays(layout: &Layout) -> Result<(), String> {
    check_names(layout.points.iter().map(|array| &array.name))?;
    check_names(layout.cells.iter().map(|array| &array.name))?;
    check_names(layout.whole.iter().map(|array| &array.name))?;
    for array in &layout.whole {
        let name = &array.name;
        match &array.values {
            WholeValues::Numbers(numbers) => {
                if array.components == 0 || !numbers.len().is_multiple_of(array.components) {
                    return Err(format!("array {name:?} ends within a tuple"));
                }
            }
            WholeValues::Text(texts) => {
                if array.components != 1 || texts.iter().any(|text| text.contains('\0')) {
                    return Err(format!(
                        "text {name:?} holds a NUL or has several components"
                    ));
                }
            }
        }
    }
    Ok(())
}

fn check_names<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), String> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(format!("two arrays are called {name:?}"));
        }
        let in_xml = |c: char| {
            matches!(c, '\t' | '\n' | '\r')
                || !(c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'))
        };
        if !name.chars().all(in_xml) {
            return Err(format!("the name {name:?} holds a control character"));
        }
    }
    Ok(())
}

fn document(mesh: &Mesh, layout: &Layout, encoding: Encoding) -> std::io::Result<Vec<u8>> {
    let points = Values::F64(mesh.points.as_flattened().to_vec());
    let mut file = File {
        out: Vec::new(),
        encoding,
        appended: Vec::new(),
    };
    file.text("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\"");
    file.text(" byte_order=\"LittleEndian\" header_type=\"UInt64\"");
    if let Some(name) = encoding.compressor().vtk_name() {
        file.text(&format!(" compressor=\"{name}\""));
    }
    file.text(">\n<UnstructuredGrid>\n<FieldData>\n");
    for array in &layout.whole {
        let values = match &array.values {
            WholeValues::Numbers(numbers) => Data::Numbers(numbers),
            WholeValues::Text(texts) => Data::Texts(texts),
        };
        file.array(&array.name, array.components, Some(array.tuples()), values)?;
    }
    file.text(&format!(
        "</FieldData>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        mesh.points.len(),
        mesh.cell_count()
    ));
    file.section("PointData", &layout.points)?;
    file.section("CellData", &layout.cells)?;
    file.text("<Points>\n");
    file.array("Points", 3, None, Data::Numbers(&points))?;
    file.text("</Points>\n");
    file.section("Cells", &layout.topology)?;
    file.text("</Piece>\n</UnstructuredGrid>\n");
    file.append();
    file.text("</VTKFile>\n");
    Ok(file.out)
}

/// A file in the making; arrays of raw encoding come after the XML.
struct File {
    out: Vec<u8>,
    encoding: Encoding,
    appended: Vec<u8>,
}

#[derive(Clone, Copy)]
enum Data<'a> {
    Numbers(&'a Values),
    Texts(&'a [String]),
}

impl File {
    fn text(&mut self, text: &str) {
        self.out.extend_from_slice(text.as_bytes());
    }

    fn section(&mut self, name: &str, arrays: &[Array]) -> std::io::Result<()> {
        self.text(&format!("<{name}>\n"));
        for array in arrays {
            let values = Data::Numbers(&array.values);
            self.array(&array.name, array.components, None, values)?;
        }
        self.text(&format!("</{name}>\n"));
        Ok(())
    }

    fn array(
        &mut self,
        name: &str,
        components: usize,
        tuples: Option<usize>,
        data: Data,
    ) -> std::io::Result<()> {
        // VTK reads and writes text in an element of its own.
        let element = match data {
            Data::Numbers(_) => "DataArray",
            Data::Texts(_) => "Array",
        };
        self.text(&format!(
            "<{element} type=\"{}\" Name=\"{}\" NumberOfComponents=\"{components}\"",
            data.type_name(),
            escape(name)
        ));
        if let Some(tuples) = tuples {
            self.text(&format!(" NumberOfTuples=\"{tuples}\""));
        }
        match self.encoding {
            Encoding::Ascii => {
                self.text(" format=\"ascii\">\n");
                data.print(components, &mut self.out);
                self.text(&format!("</{element}>\n"));
            }
            Encoding::Base64(compressor) => {
                let Packed { header, body } = codec::pack(data.bytes(), compressor)?;
                self.text(" format=\"binary\">\n");
                // Plain bytes continue the header's base64; compressed ones start afresh.
                let text = if compressor == Compressor::None {
                    BASE64_STANDARD.encode([header, body].concat())
                } else {
                    BASE64_STANDARD.encode(header) + &BASE64_STANDARD.encode(body)
                };
                self.text(&text);
                self.text(&format!("\n</{element}>\n"));
            }
            Encoding::Raw(compressor) => {
                let offset = self.appended.len();
                let Packed { header, body } = codec::pack(data.bytes(), compressor)?;
                self.text(&format!(" format=\"appended\" offset=\"{offset}\"/>\n"));
                self.appended.extend_from_slice(&header);
                self.appended.extend_from_slice(&body);
            }
        }
        Ok(())
    }

    fn append(&mut self) {
        if matches!(self.encoding, Encoding::Raw(_)) {
            self.text("<AppendedData encoding=\"raw\">\n_");
            self.out.append(&mut self.appended);
            self.text("\n</AppendedData>\n");
        }
    }
}

impl Data<'_> {
    fn type_name(self) -> &'static str {
        fn name<T: Scalar>(_: &[T]) -> &'static str {
            T::NAME
        }
        match self {
            Data::Numbers(values) => with_numbers!(values, numbers => name(numbers)),
            Data::Texts(_) => "String",
        }
    }

    /// Little-endian bytes; each text ends with a NUL.
    fn bytes(self) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Data::Numbers(values) => {
                with_numbers!(values, numbers => Scalar::append_le(numbers, &mut out));
            }
            Data::Texts(texts) => {
                for text in texts {
                    out.extend_from_slice(text.as_bytes());
                    out.push(0);
                }
            }
        }
        out
    }

    /// Decimal numbers, one tuple a line; text as the numbers of its bytes.
    fn print(self, components: usize, out: &mut Vec<u8>) {
        fn rows<T: Scalar>(values: &[T], width: usize, out: &mut Vec<u8>) {
            for row in values.chunks(width) {
                for value in row {
                    value.print(out);
                    out.push(b' ');
                }
                out.push(b'\n');
            }
        }
        match self {
            Data::Numbers(values) => {
                with_numbers!(values, numbers => rows(numbers, components, out))
            }
            Data::Texts(_) => rows(&self.bytes(), 32, out),
        }
    }
}

/// An attribute's value; blanks other than a space would be read back as spaces.
fn escape(name: &str) -> String {
    quick_xml::escape::escape(name)
        .replace('\t', "&#9;")
        .replace('\n', "&#10;")
        .replace('\r', "&#13;")
}
