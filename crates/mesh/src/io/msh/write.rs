//! Writes an MSH file of either version.

use std::path::Path;

use super::writer::Writer;
use super::{write_v2, write_v4};
use crate::error::Result;
use crate::io::loss::Losses;
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
    let (out, losses) = encode(job, Out::to(path)?)?;
    losses.settle(path, || out.save(path))
}

/// The bytes that `write` writes; `path` is only for messages.
///
/// # Errors
/// The mesh is not sound, or the version cannot hold it.
pub fn to_bytes(path: &Path, mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, Vec<String>)> {
    let job = Job::new(path, mesh, &[], options)?;
    let (out, losses) = encode(job, Out::default())?;
    Ok((out.bytes, losses.settle(path, || Ok(()))?))
}

fn encode(job: Job<'_>, out: Out) -> Result<(Out, Losses)> {
    job.refuse_kinds_beyond_gmsh("MSH")?;
    let (options, mut losses) = (job.options, job.losses);
    let writer = Writer::new(job.mesh, options.binary, out);
    if writer.split > 0 {
        losses.note(format!(
            "{} entities with cells of different groups were split",
            writer.split
        ));
    }
    let (name, encode): (_, fn(Writer<'_>, &mut Losses) -> Out) = match options.msh_version {
        Version::V22 => ("MSH 2.2", write_v2::encode),
        Version::V41 => ("MSH 4.1", write_v4::encode),
    };
    let out = encode(writer, &mut losses);
    losses.title = name.into();
    Ok((out, losses))
}
