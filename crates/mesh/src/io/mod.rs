//! Reading and writing meshes and fields.

mod bytes;
mod collection;
pub mod freefem;
mod labels;
mod loss;
pub mod medit;
pub mod meshio;
pub mod msh;
mod out;
mod plain;
mod recognise;
mod results;
mod rows;
mod scan;
mod sol;
mod table;
pub mod vtu;

use std::path::{Path, PathBuf};

pub use collection::sources;
pub use out::save;
pub use recognise::{Format, recognise};
pub use results::read_results;

use crate::cancel;
use crate::error::{Error, Place, Result};
use crate::field::GlobalArray;
use crate::mesh::Mesh;
use loss::Losses;

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Content {
    pub mesh: Mesh,
    /// Data about the mesh as a whole, which only VTU holds.
    pub whole: Vec<GlobalArray>,
    /// The name of the format: `msh`, `vtu`, `freefem`, `medit`, or meshio's name.
    pub format: String,
    /// The format's version as the file gives it.
    pub version: Option<String>,
    /// `ascii`, `binary-little`, `binary-big`, or the format's own name for it.
    pub encoding: String,
    /// Oddities of a file that was read completely.
    pub warnings: Vec<String>,
    /// What the file holds but `mesh` does not.
    pub unread: Vec<String>,
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
    let content = match recognise(path, bytes) {
        Some(Format::Msh) => msh::read(path, bytes),
        Some(Format::FreeFem) => freefem::read(path, bytes),
        Some(Format::Medit) => medit::read(path, bytes),
        // Its mesh has been validated already.
        Some(Format::Vtu) => return read_vtu(path, bytes),
        Some(Format::Meshio(format)) => meshio::read(path, format, python),
        None => Err(Error::file(
            path,
            Place::Whole,
            recognise::unknown(bytes),
            "give a mesh in a known format",
        )),
    }?;
    let unsound = |what| {
        Error::file(
            path,
            Place::Whole,
            what,
            "repair the mesh with the program it comes from",
        )
    };
    content.mesh.validate().map_err(unsound)?;
    Ok(content)
}

fn read_vtu(path: &Path, bytes: &[u8]) -> Result<Content> {
    let file = vtu::from_bytes(path, bytes)?;
    Ok(Content {
        mesh: file.mesh,
        whole: file.whole,
        format: "vtu".into(),
        version: file.version,
        encoding: file.encoding,
        warnings: file.warnings,
        unread: Vec::new(),
    })
}

/// How to write a mesh.
#[derive(Debug, Clone)]
pub struct Options {
    /// The format; `None` lets the suffix of the path decide.
    pub format: Option<Format>,
    pub msh_version: msh::Version,
    /// MSH as little-endian binary rather than as text.
    pub binary: bool,
    /// How a VTU stores its arrays.
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

/// Writes a mesh to a temporary file beside `path` and renames it; the warnings say what the file does not hold.
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
            Error::usage(
                format!("the suffix of {} names no known format", path.display()),
                "use .msh, .vtu, .mesh or another suffix that meshio knows, or name the format",
            )
        })?;
    let suffix = path.extension().unwrap_or_default();
    if format == Format::Vtu && suffix.eq_ignore_ascii_case("pvtu") {
        return Err(Error::usage(
            format!(
                "{} would be a list of pieces, which is not written",
                path.display()
            ),
            "write one .vtu file",
        ));
    }
    let ascii_only = matches!(format, Format::FreeFem | Format::Medit);
    if options.binary && ascii_only {
        return Err(Error::usage(
            format!("{format} is written as text only"),
            "leave out the binary option",
        ));
    }
    let mut losses = Losses::default();
    if format == Format::Vtu {
        vtu::losses(mesh)
            .into_iter()
            .for_each(|what| losses.note(format!("VTU does not hold {what}")));
    } else {
        whole.iter().for_each(|data| {
            losses.lose(format!(
                "the data {:?} about the mesh as a whole",
                data.name
            ))
        });
    }
    let mut warnings = losses.settle(path, &format.to_string(), options.lossy)?;
    let lossy = options.lossy;
    warnings.extend(match format {
        Format::Msh => msh::write(path, mesh, options)?,
        Format::FreeFem => freefem::write(path, mesh, lossy)?,
        Format::Medit => medit::write(path, mesh, lossy)?,
        Format::Vtu => {
            vtu::write(path, mesh, &[], whole, options.vtu)?;
            Vec::new()
        }
        Format::Meshio(name) => meshio::write(path, mesh, name, lossy, options.python.as_deref())?,
    });
    Ok(warnings)
}
