//! VTK's XML format for unstructured grids: `.vtu`, and `.pvtu` with its pieces beside it.
//!
//! Reading takes whatever VTK's own reader takes: ascii, base64 inline or appended, raw appended; plain,
//! zlib, LZ4 or LZMA; headers of 32 or 64 bits; either byte order; any number of pieces. Writing gives
//! ascii, base64 inline or raw appended, each of the latter two compressed or not.
//!
//! The model in memory between bytes and mesh is `vtkio`'s. What `vtkio` reads or writes wrongly is
//! done here instead; the comment at each such place names the defect it answers.

mod cells;
mod codec;
mod layout;
mod scalar;
mod write;

pub use write::write;

use crate::mesh::{Mesh, Partitions};

/// How a file stores its arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Decimal numbers that read back as the same numbers. NaN stays NaN, but its sign and payload are lost.
    Ascii,
    /// Base64 inside the XML, bit for bit.
    Base64(Compressor),
    /// Bytes after the XML, bit for bit: the smallest and fastest, but no longer XML.
    Raw(Compressor),
}

/// How the bytes of an array are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compressor {
    None,
    Zlib,
    Lz4,
    Lzma,
}

impl Encoding {
    fn compressor(self) -> Compressor {
        match self {
            Encoding::Ascii => Compressor::None,
            Encoding::Base64(compressor) | Encoding::Raw(compressor) => compressor,
        }
    }
}

impl Compressor {
    /// The `compressor` attribute.
    fn vtk_name(self) -> Option<&'static str> {
        match self {
            Compressor::None => None,
            Compressor::Zlib => Some("vtkZLibDataCompressor"),
            Compressor::Lz4 => Some("vtkLZ4DataCompressor"),
            Compressor::Lzma => Some("vtkLZMADataCompressor"),
        }
    }
}

/// What a mesh knows that VTU has no place for, in words.
pub fn losses(mesh: &Mesh) -> Vec<String> {
    let geometry = &mesh.geometry;
    let mut losses = Vec::new();
    if !geometry.entities.is_empty() || !geometry.point_runs.is_empty() {
        losses.push("the geometry behind the mesh".into());
    }
    if !geometry.periodic.is_empty() {
        losses.push(format!("{} periodic links", geometry.periodic.len()));
    }
    if geometry.partitions != Partitions::default() {
        losses.push("the partitions of cells".into());
    }
    losses
}

#[cfg(test)]
mod tests;
