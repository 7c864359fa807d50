//! VTK's XML formats: unstructured grids, `.vtu`, and `.pvtu` with its pieces next to it; polygonal data, `.vtp`; and, only for
//! reading, images and structured grids, `.vti`, `.vtr`, `.vts`.
//!
//! Reading takes whatever VTK's own reader takes: ascii, base64 inline or appended, raw appended; plain,
//! zlib, LZ4 or LZMA; headers of 32 or 64 bits; either byte order; any number of pieces. Writing gives
//! ascii, base64 inline or raw appended, each of the latter two compressed or not.
//!
//! These formats are implemented here because the crate `vtkio` reads or writes parts of them wrongly; a comment at each such place
//! names the defect.

pub(crate) mod array;
pub(crate) mod cells;
pub(crate) mod column;
pub(crate) mod grids;
pub(crate) mod lattice;
pub(crate) mod layout;
pub(crate) mod merge;
mod pack;
mod poly;
pub(crate) mod read;
mod restore;
mod sections;
mod stream;
pub(crate) mod topology;
pub(crate) mod unpack;
pub(crate) mod write;
pub(crate) mod xml;

pub use cells::vtk_nodes;
pub use write::write;

use crate::error::{Error, Place, Result};
use crate::field::{GlobalArray, Tell, Unread};
use crate::file;
use crate::io::recognise::begins;
use crate::io::{Content, Job, Native, Read, bytes};
use array::Decoder;
use merge::Piece;
use std::collections::HashSet;
use std::path::Path;
use unpack::Budget;
use xml::{Document, Grid};

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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compressor {
    /// Not at all: fastest to write, largest.
    #[default]
    None,
    /// zlib's deflate, which every reader of VTU has.
    Zlib,
    /// LZ4: faster than zlib, larger.
    Lz4,
    /// LZMA: slower than zlib, smaller.
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

    fn of_vtk_name(name: &str) -> Option<Self> {
        let all = [Compressor::Zlib, Compressor::Lz4, Compressor::Lzma];
        all.into_iter().find(|known| known.vtk_name() == Some(name))
    }
}

/// The format VTU.
pub static FORMAT: Native = Native {
    title: "VTU",
    names: &["vtu"],
    suffixes: &["vtu", "pvtu"],
    has_binary: true,
    holds_whole: true,
    recognises: |bytes| is_xml_of(bytes, &[Grid::Unstructured]),
    read: Read::Once(from_bytes),
    write: write_content,
};

/// Polygonal data: vertices, lines, polygons and strips.
pub static POLY: Native = Native {
    title: "VTP",
    names: &["vtp"],
    suffixes: &["vtp", "pvtp"],
    recognises: |bytes| is_xml_of(bytes, &[Grid::Poly]),
    write: poly::write,
    ..FORMAT
};

/// Images, rectilinear and structured grids, which become meshes of hexahedra, quadrangles or lines.
pub static GRIDS: Native = Native {
    title: "VTI, VTR and VTS",
    names: &["vts", "vtr", "vti"],
    suffixes: &["vti", "vtr", "vts", "pvti", "pvtr", "pvts"],
    recognises: |bytes| is_xml_of(bytes, &[Grid::Image, Grid::Rectilinear, Grid::Structured]),
    write: |job| {
        let what = format!(
            "{} would be a structured grid, which is not written",
            job.path.display()
        );
        Err(Error::usage(what, "write a .vtu file"))
    },
    ..FORMAT
};

fn is_xml_of(bytes: &[u8], grids: &[Grid]) -> bool {
    begins(bytes, "<") && xml::is_of(bytes, grids)
}

/// Reads a `.vtu`, or a `.pvtu` with the pieces in its folder or below, or one of another grid.
///
/// # Errors
/// [`Error::File`] with byte and array if the file is damaged or inconsistent, has cells of unsupported types, or
/// would unpack to more than is plausible for its size; [`Error::Io`] if it cannot be read.
fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Content> {
    let utf8 = xml::to_utf8(bytes);
    let document = xml::parse(path, &utf8)?;
    let mut file = if document.parallel {
        read_parallel(path, &document)?
    } else {
        read_serial(path, bytes.len(), &document)?
    };
    if utf8.len() != bytes.len() {
        file.warnings
            .push("the XML is not UTF-8, and read as Latin-1".into());
    }
    file.content(path, document.grid.suffix(), document.version)
}

impl Decoded {
    /// The mesh that the pieces make.
    pub(crate) fn content(
        mut self,
        path: &Path,
        format: &str,
        version: Option<String>,
    ) -> Result<Content> {
        let unsound = |what| Error::whole(path, what, "write the file again");
        let merged = merge::merge(std::mem::take(&mut self.pieces)).map_err(unsound)?;
        let (mesh, whole) = restore::restore(merged, self.whole);
        Ok(Content {
            mesh,
            whole,
            format: format.into(),
            version,
            encoding: self.encoding,
            warnings: self.warnings,
            unread: self.unread,
            ghosts: self.ghosts,
        })
    }
}

/// [`write()`] as the table of formats has it.
fn write_content(job: Job<'_>) -> Result<Vec<String>> {
    let (path, mesh, whole, options) = (job.path, job.mesh, job.whole, job.options);
    let suffix = path.extension().unwrap_or_default();
    if suffix.eq_ignore_ascii_case("pvtu") {
        let what = format!(
            "{} would be a list of pieces, which is not written",
            path.display()
        );
        return Err(Error::usage(what, "write one .vtu file"));
    }
    write::save(path, mesh, &[], whole, options.vtu, layout::Topology::Cells)?;
    Ok(Vec::new())
}

/// The decoded contents of one file, or of all files of a `.pvtu`.
#[derive(Default)]
pub(crate) struct Decoded {
    pub pieces: Vec<Piece>,
    pub whole: Vec<GlobalArray>,
    pub encoding: String,
    pub warnings: Vec<String>,
    pub unread: Vec<Unread>,
    pub ghosts: usize,
}

fn read_serial(path: &Path, bytes: usize, document: &Document) -> Result<Decoded> {
    let mut decoder = Decoder {
        path,
        document,
        budget: Budget::of_file(bytes),
        warnings: Vec::new(),
        unread: Vec::new(),
    };
    decoder.survey()?;
    let pieces = document.pieces.iter();
    let pieces = pieces
        .map(|piece| decoder.piece(piece))
        .collect::<Result<_>>()?;
    Ok(Decoded {
        pieces,
        whole: decoder.whole()?,
        encoding: document.encoding(),
        warnings: decoder.warnings,
        unread: decoder.unread,
        ghosts: 0,
    })
}

fn read_parallel(path: &Path, document: &Document) -> Result<Decoded> {
    let mut all = Decoded::default();
    let mut seen = HashSet::new();
    for tag in &document.pieces {
        let refuse = |what: String| {
            let place = Place::SectionByte("<Piece>".into(), tag.byte);
            let remedy = "a .pvtu file only lists pieces: put them next to it, or read a piece, which is a .vtu file, by itself";
            Error::file(path, place, what, remedy)
        };
        let source = tag.source.as_deref().unwrap_or_default();
        let Some(piece_path) = file::beneath(&path.with_file_name(""), source) else {
            return Err(refuse(format!(
                "the piece {source:?} is not in the folder of this file or below it"
            )));
        };
        if !seen.insert(source) {
            // dolfinx 0.5 lists the pieces once for each kind of function in them.
            all.warnings.push(format!(
                "the piece {source:?} is listed twice, and read once"
            ));
            continue;
        }
        let bytes = bytes::read(&piece_path)
            .map_err(|error| refuse(format!("the piece {source:?} cannot be read: {error}")))?;
        let utf8 = xml::to_utf8(&bytes);
        let piece = xml::parse(&piece_path, &utf8)?;
        if piece.parallel || piece.grid != document.grid {
            return Err(refuse(format!(
                "the piece {source:?} is a list of pieces itself, or of another grid"
            )));
        }
        let mut piece = read_serial(&piece_path, bytes.len(), &piece)?;
        let ghosts = piece.pieces.iter_mut().map(Piece::leave_ghosts_out);
        all.ghosts += ghosts.sum::<usize>();
        all.pieces.extend(piece.pieces);
        all.encoding = piece.encoding;
        all.warnings.extend(piece.warnings);
        for Unread { name, what, .. } in piece.unread {
            all.unread.tell_once(name, what);
        }
        for array in piece.whole {
            if let Some(other) = array.join(&mut all.whole) {
                let what = format!(
                    "{:?} of the piece {source:?}, which differs from that of another",
                    other.name
                );
                all.unread.tell(&other.name, what);
            }
        }
    }
    if all.ghosts > 0 {
        let ghosts = all.ghosts;
        all.warnings.push(format!(
            "{ghosts} ghost cells, which other pieces have as well, are left out"
        ));
    }
    Ok(all)
}

#[cfg(test)]
mod hostile_tests;
#[cfg(test)]
mod random_tests;
#[cfg(test)]
mod tests;
