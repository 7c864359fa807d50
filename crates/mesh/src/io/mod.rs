//! Reading and writing meshes and fields.

mod abaqus;
mod builder;
mod bytes;
mod cgns;
mod collection;
mod dofs;
mod elements;
mod exodus;
mod freefem;
mod hdf5;
mod labels;
mod loss;
mod market;
mod med;
mod medit;
mod meshio;
mod mfem;
pub mod msh;
mod nastran;
mod netcdf;
mod out;
mod pattern;
mod petsc;
mod plain;
mod polytopes;
mod raw;
mod recognise;
mod results;
mod rows;
mod scalar;
mod scan;
mod series;
mod sets;
mod sides;
mod steps;
mod su2;
mod surface;
mod table;
#[cfg(test)]
mod text_tests;
mod ucd;
mod unv;
mod vectors;
mod vtk;
mod vtkhdf;
pub mod vtu;
#[cfg(test)]
mod written_tests;
mod xdmf;
mod xml;

use std::fmt;
use std::path::{Path, PathBuf};

pub use collection::sources;
pub use dofs::{DofTable, read_dofs, write_dofs};
pub use market::{Coordinates, read_matrix, read_vector, write_matrix, write_vector};
pub use out::save;
pub use pattern::{files as matching_files, is_pattern, matches};
pub use recognise::recognise;
pub use results::{of_content, read_results};
pub use series::{Series, survey};
pub use vtu::lattice::reference_nodes;
pub use vtu::vtk_nodes;

use crate::cancel;
use crate::error::{Error, Result};
use crate::field::{GlobalArray, Unread};
use crate::mesh::{CellBlock, Mesh};
use loss::Losses;

/// The formats that are read and written here, in the order in which users see them. Whatever depends on the format asks
/// this table.
pub static NATIVE: &[&Native] = &[
    &msh::FORMAT,
    &vtu::FORMAT,
    &vtu::POLY,
    &vtu::GRIDS,
    &vtk::FORMAT,
    &vtkhdf::FORMAT,
    &freefem::FORMAT,
    &medit::FORMAT,
    &exodus::FORMAT,
    &xdmf::FORMAT,
    &med::FORMAT,
    &cgns::FORMAT,
    &mfem::FORMAT,
    &abaqus::FORMAT,
    &ucd::FORMAT,
    &unv::FORMAT,
    &nastran::FORMAT,
    &su2::FORMAT,
    &surface::stl::FORMAT,
    &surface::ply::FORMAT,
    &surface::off::FORMAT,
    &surface::obj::FORMAT,
];

/// A format that is read and written here.
#[derive(Debug)]
pub struct Native {
    /// Its name in messages.
    pub title: &'static str,
    /// The names for [`Format::of_name`]; the first is that of [`Content::format`].
    pub names: &'static [&'static str],
    /// The suffixes of its files, in lower case.
    pub suffixes: &'static [&'static str],
    /// Whether it has a binary form besides text.
    has_binary: bool,
    /// Whether it holds data about the mesh as a whole.
    holds_whole: bool,
    /// Whether the bytes of a file look like this format, and like none of the others.
    recognises: fn(&[u8]) -> bool,
    read: Read,
    /// Writes a mesh and data about it as a whole; the warnings list what the file cannot store.
    write: Write,
}

/// Reads a file from its bytes. The mesh is checked afterwards; what a reader does not say of format and encoding is added.
#[derive(Debug, Clone, Copy)]
enum Read {
    /// Whose fields are of one time, or of none.
    Once(fn(&Path, &[u8]) -> Result<Content>),
    /// Whose fields may be of several times, on one mesh.
    Views(fn(&Path, &[u8]) -> Result<Content>),
    /// Whose mesh may change: read at one of its times, or at all of them.
    Steps {
        times: fn(&Path, &[u8]) -> Result<Vec<f64>>,
        at: fn(&Path, &[u8], Option<f64>) -> Result<Content>,
    },
}

impl Native {
    /// Reads a file at one of its times, or at all.
    fn read_at(&self, path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
        let mut content = match &self.read {
            Read::Once(read) | Read::Views(read) => read(path, bytes),
            Read::Steps { at, .. } => at(path, bytes, time),
        }?;
        if content.format.is_empty() {
            self.names[0].clone_into(&mut content.format);
        }
        if content.encoding.is_empty() {
            content.encoding = "ascii".into();
        }
        checked(path, content)
    }
}

type Write = fn(Job<'_>) -> Result<Vec<String>>;

/// A sound mesh that is to be written, and what the format cannot hold of it.
struct Job<'a> {
    path: &'a Path,
    mesh: &'a Mesh,
    whole: &'a [GlobalArray],
    options: &'a Options,
    losses: Losses,
}

impl<'a> Job<'a> {
    fn new(
        path: &'a Path,
        mesh: &'a Mesh,
        whole: &'a [GlobalArray],
        options: &'a Options,
    ) -> Result<Self> {
        let refuse = |what| Error::whole(path, what, "repair the mesh before it is written");
        mesh.validate().map_err(refuse)?;
        let mut losses = Losses::default();
        losses.lossy = options.lossy;
        Ok(Job {
            path,
            mesh,
            whole,
            options,
            losses,
        })
    }

    /// Refuses cells of types that Gmsh does not have.
    fn refuse_kinds_beyond_gmsh(&self, format: &str) -> Result<()> {
        let mut blocks = self.mesh.blocks.iter();
        match blocks.find(|block| !block.is_empty() && block.kind.gmsh() == 0) {
            None => Ok(()),
            Some(CellBlock { kind, .. }) => {
                let what = format!("{format} is not written with cells that are {kind}");
                Err(Error::whole(
                    self.path,
                    what,
                    "choose another format, as VTU",
                ))
            }
        }
    }
}

impl PartialEq for Native {
    fn eq(&self, other: &Self) -> bool {
        self.names == other.names
    }
}

impl Eq for Native {}

/// The formats of meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Read and written here, by this entry of the table.
    Native(&'static Native),
    /// Read and written by meshio, which has this name for it.
    Meshio(&'static str),
}

impl Format {
    /// VTK's XML for unstructured grids.
    pub const VTU: Format = Format::Native(&vtu::FORMAT);
    /// VTK's XML for polygonal data.
    pub const VTP: Format = Format::Native(&vtu::POLY);
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Format::Native(native) => native.title,
            Format::Meshio(name) => name,
        })
    }
}

/// The names of the native formats, as in `a, b, c`.
pub fn native_names() -> String {
    let names: Vec<&str> = NATIVE.iter().map(|format| format.names[0]).collect();
    names.join(", ")
}

/// The contents of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Content {
    /// Points, cells, groups, and fields on them.
    pub mesh: Mesh,
    /// Data about the mesh as a whole, which only VTK's formats hold.
    pub whole: Vec<GlobalArray>,
    /// The name of the format: the first of [`Native::names`], or meshio's name.
    pub format: String,
    /// The format's version as the file gives it.
    pub version: Option<String>,
    /// `ascii`, `binary-little`, `binary-big`, or the format's own name for it.
    pub encoding: String,
    /// Oddities of a file that was read completely.
    pub warnings: Vec<String>,
    /// Data in the file that `mesh` cannot store.
    pub unread: Vec<Unread>,
    /// Cells that several pieces have, and that were left out of all but one.
    pub ghosts: usize,
}

/// Reads a mesh; [`open`] returns all that the file holds.
///
/// ```
/// use faceoff_mesh::io;
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// # let folder = tempfile::tempdir().expect("a temporary folder");
/// # let path = folder.path().join("triangle.mesh");
/// let text = "MeshVersionFormatted 2 Dimension 2
///     Vertices 3  0 0 0  1 0 0  0 1 0
///     Triangles 1  1 2 3 7
///     End";
/// std::fs::write(&path, text).expect("written");
/// let mesh = io::read(&path)?;
/// assert_eq!((mesh.points.len(), mesh.groups[0].tag), (3, 7));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// The file cannot be read, its format is unknown, or it violates its format.
pub fn read(path: &Path) -> Result<Mesh> {
    open(path, None).map(|content| content.mesh)
}

/// Reads a file of any format, which is recognised by its content. `python` is the interpreter of an environment that
/// has meshio, for the formats that meshio reads.
///
/// # Errors
/// The file cannot be read, its format is unknown, or it violates its format.
pub fn open(path: &Path, python: Option<&Path>) -> Result<Content> {
    let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
    parse(path, &bytes, python)
}

/// [`open`] for a file whose bytes are in memory; only meshio reads the file again.
///
/// # Errors
/// The format is unknown, or the file violates it.
pub fn parse(path: &Path, bytes: &[u8], python: Option<&Path>) -> Result<Content> {
    cancel::check()?;
    match recognise(path, bytes) {
        Some(Format::Native(format)) => format.read_at(path, bytes, None),
        Some(Format::Meshio(format)) => checked(path, meshio::read(path, format, python)?),
        None => Err(Error::whole(
            path,
            recognise::unknown(bytes),
            "give a mesh in a known format",
        )),
    }
}

/// The data that were read, if the mesh is sound.
fn checked(path: &Path, content: Content) -> Result<Content> {
    let unsound = |what| Error::whole(path, what, "repair the mesh with the program it comes from");
    content.mesh.validate().map_err(unsound)?;
    Ok(content)
}

/// How to write a mesh.
#[derive(Debug, Clone)]
pub struct Options {
    /// The format; `None` lets the suffix of the path decide.
    pub format: Option<Format>,
    /// Which MSH, where that is the format.
    pub msh_version: msh::Version,
    /// MSH as little-endian binary, legacy VTK as binary, rather than as text.
    pub binary: bool,
    /// How a VTU or VTP stores its arrays.
    pub vtu: vtu::Encoding,
    /// Whether what the format cannot hold is a warning rather than an error.
    pub lossy: bool,
    /// The interpreter of an environment that has meshio.
    pub python: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            format: None,
            msh_version: msh::Version::default(),
            binary: false,
            vtu: vtu::Encoding::Raw(vtu::Compressor::Zlib),
            lossy: false,
            python: None,
        }
    }
}

/// Writes a mesh to a temporary file next to `path` and renames it; the warnings list what the file cannot store.
///
/// ```
/// use faceoff_mesh::{io, mesh::generate::union_jack};
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// # let folder = tempfile::tempdir().expect("a temporary folder");
/// # let path = folder.path().join("square.vtu");
/// let mesh = union_jack(2, [1.0, 1.0]);
/// let warnings = io::write(&path, &mesh, &io::Options::default())?;
/// assert!(warnings.is_empty());
/// assert_eq!(io::read(&path)?, mesh);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// The mesh is not sound, the format cannot hold it, or the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh, options: &Options) -> Result<Vec<String>> {
    write_with(path, mesh, &[], options)
}

/// [`fn@write`] together with data about the mesh as a whole.
///
/// # Errors
/// As [`fn@write`].
pub fn write_with(
    path: &Path,
    mesh: &Mesh,
    whole: &[GlobalArray],
    options: &Options,
) -> Result<Vec<String>> {
    cancel::check()?;
    let format = options
        .format
        .or_else(|| Format::of_suffix(path))
        .ok_or_else(|| {
            let suffixes = NATIVE.iter().filter_map(|format| format.suffixes.first());
            let suffixes: String = suffixes.map(|suffix| format!(".{suffix}, ")).collect();
            Error::usage(
                format!("the suffix of {} names no known format", path.display()),
                format!(
                    "use {} or another suffix that meshio knows, or name the format",
                    suffixes.trim_end_matches(", ")
                ),
            )
        })?;
    if options.binary && matches!(format, Format::Native(native) if !native.has_binary) {
        return Err(Error::usage(
            format!("{format} is written as text only"),
            "leave out the binary option",
        ));
    }
    let mut job = Job::new(path, mesh, whole, options)?;
    job.losses.title = format.to_string();
    if !matches!(format, Format::Native(native) if native.holds_whole) {
        for data in whole {
            let what = format!("the data {:?} about the mesh as a whole", data.name);
            job.losses.lose(what);
        }
    }
    match format {
        Format::Native(native) => (native.write)(job),
        Format::Meshio(name) => meshio::write(job, name),
    }
}

/// The writer of formats that are only read.
fn read_only(job: Job<'_>) -> Result<Vec<String>> {
    let what = format!(
        "the format asked for {} is read, but not written",
        job.path.display()
    );
    Err(Error::usage(
        what,
        "choose another format, such as msh or vtu",
    ))
}
