//! Bytes to meshes and fields, and back.

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
use crate::field::Whole;
use crate::mesh::Mesh;
use loss::Losses;

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Content {
    pub mesh: Mesh,
    /// Data about the mesh as a whole, which only VTU holds.
    pub whole: Vec<Whole>,
    /// The name of the format: `msh`, `vtu`, `freefem`, `medit`, or as meshio calls it.
    pub format: String,
    /// The format's version as the file gives it.
    pub version: Option<String>,
    /// `ascii`, `binary-little`, `binary-big`, or what else the format calls it.
    pub encoding: String,
    /// What is odd about the file, although it was read whole.
    pub warnings: Vec<String>,
    /// What the file holds and `mesh` does not.
    pub unread: Vec<String>,
}

/// Reads a mesh; [`open`] tells more.
///
/// # Errors
/// The file cannot be read, is not known, or is not as its format demands.
pub fn read(path: &Path) -> Result<Mesh> {
    open(path, None).map(|content| content.mesh)
}

/// Reads a file of any format, which its content tells. `python` is the interpreter of an environment that has
/// meshio, for the formats that are left to it.
///
/// # Errors
/// The file cannot be read, is not known, or is not as its format demands.
pub fn open(path: &Path, python: Option<&Path>) -> Result<Content> {
    let bytes = bytes::read(path).map_err(Error::io(path, "read"))?;
    parse(path, &bytes, python)
}

/// [`open`] of a file whose bytes are there already; only meshio reads the file once more.
///
/// # Errors
/// The file is not known, or is not as its format demands.
pub fn parse(path: &Path, bytes: &[u8], python: Option<&Path>) -> Result<Content> {
    cancel::check()?;
    let content = match recognise(path, bytes) {
        Some(Format::Msh) => msh::read(path, bytes),
        Some(Format::FreeFem) => freefem::read(path, bytes),
        Some(Format::Medit) => medit::read(path, bytes),
        // Which has been asked already whether it is sound.
        Some(Format::Vtu) => return read_vtu(path, bytes),
        Some(Format::Meshio(format)) => meshio::read(path, format, python),
        None => Err(Error::file(
            path,
            Place::Whole,
            recognise::unknown(bytes),
            "give a mesh of a known format",
        )),
    }?;
    let unsound = |what| {
        Error::file(
            path,
            Place::Whole,
            what,
            "mend the mesh with the program it comes from",
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
    pub binary: bool,
    /// How a VTU stores its arrays.
    pub vtu: vtu::Encoding,
    /// What the format cannot hold becomes a warning rather than an error.
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

/// Writes a mesh beside `path` and renames it; the warnings say what could not be taken along.
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
    whole: &[Whole],
    options: &Options,
) -> Result<Vec<String>> {
    cancel::check()?;
    let format = options
        .format
        .or_else(|| Format::of_suffix(path))
        .ok_or_else(|| {
            Error::usage(
                format!("the suffix of {} tells no format", path.display()),
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
            format!("{format} has no binary form here"),
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
    let (version, binary, lossy) = (options.msh_version, options.binary, options.lossy);
    warnings.extend(match format {
        Format::Msh => msh::write(
            path,
            mesh,
            &msh::Options {
                version,
                binary,
                lossy,
            },
        )?,
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
