//! All other formats, through meshio, which runs as a process in a Python environment that has it.
//!
//! We exchange plain files (`io::plain`) with the process. meshio silently drops what a format cannot hold, so what was
//! written is read back and compared.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use super::loss::Losses;
use super::out::{folder_of, is_special};
use super::{Content, Job, plain};
use crate::error::{Error, Result};
use crate::file::Temporary;
use crate::mesh::{CellKind, Field, Group, Mesh};
use crate::process::{self, Failure};

const SCRIPT: &str = include_str!("meshio.py");
/// After this time the process is assumed to hang.
const LIMIT: Duration = Duration::from_secs(600);

/// Reads a file of the format that meshio calls `format`.
///
/// # Errors
/// There is no such environment, meshio fails, or its answer is not a sound mesh; an interruption.
pub fn read(path: &Path, format: &str, python: Option<&Path>) -> Result<Content> {
    let folder = Temporary::new()?;
    let plain = folder.path().join("mesh");
    run(python, "read", path, &plain, format, path)?;
    let bytes = std::fs::read(&plain).map_err(Error::io(&plain, "read"))?;
    plain::decode(&bytes, format).ok_or_else(|| {
        Error::whole(
            path,
            format!("what meshio read from this {format} file is not a sound mesh"),
            "check the file",
        )
    })
}

/// Writes a file of the format that meshio calls `format`; the warnings list what is missing in it.
///
/// # Errors
/// There is no such environment, meshio fails, or the format cannot hold the mesh; an interruption.
pub fn write(job: Job<'_>, format: &str) -> Result<Vec<String>> {
    job.refuse_kinds_beyond_gmsh(format)?;
    let (path, mesh, mut losses) = (job.path, job.mesh, job.losses);
    let python = job.options.python.as_deref();
    if is_special(path) {
        return Err(Error::usage(
            format!(
                "{} is not a regular file, and meshio writes only those",
                path.display()
            ),
            "give the name of a file",
        ));
    }
    let parent = folder_of(path);
    // Some formats consist of several files that refer to each other: they need their final names from the start.
    let folder = tempfile::Builder::new()
        .prefix(".faceoff-")
        .tempdir_in(parent)
        .map_err(Error::io(path, "create"))?;
    let name = path
        .file_name()
        .ok_or_else(|| Error::usage("the path names no file", "give the name of a file"))?;
    let plain = folder.path().join("plain");
    let made = folder.path().join("made");
    std::fs::create_dir(&made).map_err(Error::io(path, "create"))?;
    let round_trip = |mesh: &Mesh, losses: &mut Losses| -> Result<Mesh> {
        std::fs::write(&plain, plain::encode(mesh, losses)).map_err(Error::io(path, "write"))?;
        run(python, "write", &plain, &made.join(name), format, path)?;
        Ok(read(&made.join(name), format, python)?.mesh)
    };
    let mut back = round_trip(mesh, &mut losses)?;
    let (kept, lost): (Vec<&Field>, Vec<&Field>) =
        mesh.fields.iter().partition(|field| is_in(field, &back));
    if !lost.is_empty() {
        // meshio may have written fields that no program reads: without these fields the file is as described by the warnings.
        let fields = kept.into_iter().cloned().collect();
        let rest = Mesh {
            fields,
            ..mesh.clone()
        };
        back = round_trip(&rest, &mut Losses::default())?;
    }
    losses.lose_fields(lost);
    compare(mesh, &back, &mut losses);
    losses.note_gmsh(mesh);
    losses.title = format!("{format}, as meshio writes it,");
    losses.settle(path, || {
        for entry in std::fs::read_dir(&made).map_err(Error::io(path, "list"))? {
            let entry = entry.map_err(Error::io(path, "list"))?;
            std::fs::rename(entry.path(), parent.join(entry.file_name()))
                .map_err(Error::io(path, "replace"))?;
        }
        Ok(())
    })
}

/// `task` is to read or to write.
fn run(
    python: Option<&Path>,
    task: &str,
    from: &Path,
    to: &Path,
    format: &str,
    about: &Path,
) -> Result<()> {
    let Some(python) = python else {
        return Err(Error::usage(
            format!(
                "{} is {format}, which meshio would {task}, but there is no meshio here",
                about.display()
            ),
            "install it into the private environment with `faceoff engines install`",
        ));
    };
    // For the log of the process.
    let folder = Temporary::new()?;
    let absolute = |path: &Path| std::path::absolute(path).map_err(Error::io(path, "use"));
    let mut command = Command::new(absolute(python)?);
    command
        .args(["-I", "-c", SCRIPT, task])
        .args([absolute(from)?, absolute(to)?])
        .arg(format)
        // NumPy's threads would wait for work, and there is none.
        .env("OPENBLAS_NUM_THREADS", "1");
    process::run(&command, folder.path(), LIMIT, |_| {}).map_err(|failure| {
        let why = match failure {
            Failure::Ours(error) => return error,
            Failure::Failed { said, .. } => said,
            other => format!(": {other}"),
        };
        Error::whole(
            about,
            format!("meshio could not {task} this {format} file{why}"),
            "check the file, or convert it to MSH or VTU with the program it comes from",
        )
    })
}

/// Notes what of `mesh` is missing in `back`.
fn compare(mesh: &Mesh, back: &Mesh, losses: &mut Losses) {
    if mesh.points.len() != back.points.len() {
        losses.lose(format!(
            "{} points (it has {})",
            mesh.points.len(),
            back.points.len()
        ));
    } else {
        let pairs = mesh
            .points
            .as_flattened()
            .iter()
            .zip(back.points.as_flattened());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if worst > 0.0 {
            losses.lose(format!("the points exactly (they move by up to {worst:e})"));
        }
    }
    let mut kinds: Vec<CellKind> = mesh.blocks.iter().map(|block| block.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut same_cells = true;
    for kind in kinds {
        let of = |mesh: &Mesh| -> Vec<u32> {
            mesh.blocks
                .iter()
                .filter(|block| block.kind == kind)
                .flat_map(|block| block.nodes.iter().copied())
                .collect()
        };
        if of(mesh) != of(back) {
            same_cells = false;
            losses.lose(format!(
                "the {} {kind} cells (it has {})",
                mesh.count(kind),
                back.count(kind)
            ));
        }
    }
    for group in &mesh.groups {
        let like =
            |other: &&Group| other.dim == group.dim && other.cells.len() == group.cells.len();
        let same = back
            .groups
            .iter()
            .filter(like)
            .find(|other| !same_cells || other.cells == group.cells);
        let shown = group.name.clone().unwrap_or_else(|| group.tag.to_string());
        match same {
            None => losses.lose(format!("the group {shown:?} of dimension {}", group.dim)),
            Some(other) if group.name.is_some() && other.name != group.name => {
                losses.lose(format!(
                    "the name {shown:?} of a group of dimension {}",
                    group.dim
                ));
            }
            Some(_) => {}
        }
    }
}

/// Relative to the largest value of a field: the precision that text formats keep.
const KEPT: f64 = 1e-5;

/// Whether a mesh has a field of this name with these values.
fn is_in(field: &Field, back: &Mesh) -> bool {
    let values = field.values.to_f64();
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let is_same = |other: &&Field| {
        let found = other.values.to_f64();
        let mut pairs = values.iter().zip(&found);
        (other.on, &other.name) == (field.on, &field.name)
            && values.len() == found.len()
            && pairs.all(|(a, b)| {
                a == b || (a - b).abs() <= KEPT * largest || (a.is_nan() && b.is_nan())
            })
    };
    back.fields.iter().any(|other| is_same(&other))
}
