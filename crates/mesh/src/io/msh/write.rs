//! Writes an MSH file of either version.

use std::path::Path;

use super::writer::Writer;
use super::{write_v2, write_v4};
use crate::error::Result;
use crate::io::out::Out;
use crate::io::{Job, Options};
use crate::mesh::Mesh;

/// The versions that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Version {
    /// 2.2, which most other codes read.
    #[default]
    V22,
    /// 4.1, which holds everything.
    V41,
}

/// Writes an MSH file; the warnings list what it cannot store.
///
/// # Errors
/// The mesh is not sound, the version cannot hold it, or the file cannot be written.
pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let path = job.path;
    let (out, warnings) = encode(job, Out::to(path)?)?;
    out.save(path)?;
    Ok(warnings)
}

/// The bytes that `write` writes; `path` is only for messages.
///
/// # Errors
/// The mesh is not sound, or the version cannot hold it.
pub fn to_bytes(path: &Path, mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, Vec<String>)> {
    let job = Job::new(path, mesh, &[], options)?;
    encode(job, Out::default()).map(|(out, warnings)| (out.bytes, warnings))
}

fn encode(job: Job<'_>, out: Out) -> Result<(Out, Vec<String>)> {
    job.refuse_kinds_beyond_gmsh("MSH")?;
    let (path, mesh, options, mut losses) = (job.path, job.mesh, job.options, job.losses);
    let writer = Writer::new(mesh, options.binary, out);
    if writer.split > 0 {
        losses.note(format!(
            "{} entities with cells of different groups were split",
            writer.split
        ));
    }
    let out = match options.msh_version {
        Version::V22 => write_v2::encode(writer, &mut losses),
        Version::V41 => write_v4::encode(writer, &mut losses),
    };
    let name = match options.msh_version {
        Version::V22 => "MSH 2.2",
        Version::V41 => "MSH 4.1",
    };
    Ok((out, losses.settle(path, name, options.lossy)?))
}
