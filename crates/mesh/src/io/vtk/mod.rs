//! VTK's legacy format, `.vtk`, of versions 1.0 to 5.1, as text and in binary.
//!
//! Reading takes all kinds of grids; structured ones become meshes of hexahedra, quadrangles or lines, strips are cut up.
//! Tables of colours and texts are not read, which is reported. Writing gives an unstructured grid, with groups and names as
//! VTU has them, of version 4.2, or 5.1 where VTK takes nodes of high order for others before.
//!
//! The crate `vtkio` (0.7.0-rc2) is the oracle of the tests, in both directions, and not the reader: of 143 files of other
//! projects it reads 131 where VTK reads 142, it names no place in its errors, and it passes over all data behind a `FIELD` of
//! the whole without a word. Nor is it the writer, which is 220 lines here: its model has no polyhedra, and copies the mesh.

mod arrays;
mod assemble;
mod numbers;
mod read;
mod write;

use super::recognise::begins;
use super::{Native, Read};

pub static FORMAT: Native = Native {
    title: "VTK",
    names: &["vtk"],
    suffixes: &["vtk"],
    has_binary: true,
    holds_whole: true,
    recognises: |bytes| begins(bytes, "# vtk DataFile"),
    read: Read::Once(read::read),
    write: write::write,
};
