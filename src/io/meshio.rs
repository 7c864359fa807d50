//! Every other format, by way of meshio: one process of a Python environment that has it.
//!
//! Between the process and us goes a plain file: a line of JSON, then arrays of binary64 and 64-bit integers,
//! little-endian. meshio drops in silence what a format cannot hold, so what was written is read back and
//! compared before it counts.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::Content;
use super::loss::Losses;
use super::out::is_special;
use crate::error::{Error, Place, Result};
use crate::mesh::{CellBlock, CellGroups, CellKind, Field, Group, Mesh, Support, Values};

const SCRIPT: &str = include_str!("meshio.py");
/// After this long the process is taken to hang.
const LIMIT: Duration = Duration::from_secs(600);
/// Cell data that meshio's readers and writers take for the physical tag and the elementary entity.
const PHYSICAL: &str = "gmsh:physical";
const ENTITY: &str = "gmsh:geometrical";

#[derive(Serialize, Deserialize, Default)]
struct Head {
    points: [usize; 2],
    cells: Vec<Block>,
    point_data: Vec<Data>,
    cell_data: Vec<Data>,
    sets: Vec<Set>,
    names: Vec<Name>,
    #[serde(default)]
    unread: Vec<String>,
}

#[derive(Serialize, Deserialize)]
struct Block {
    kind: i32,
    nodes: [usize; 2],
}

#[derive(Serialize, Deserialize)]
struct Data {
    name: String,
    integer: bool,
    components: usize,
    at: [usize; 2],
}

#[derive(Serialize, Deserialize)]
struct Set {
    name: String,
    cells: [usize; 2],
}

#[derive(Serialize, Deserialize)]
struct Name {
    name: String,
    tag: i64,
    dim: u8,
}

/// Reads a file of the format that meshio calls `format`.
///
/// # Errors
/// There is no such environment, meshio fails, or what it gives is no sound mesh.
pub fn read(path: &Path, format: &str, python: Option<&Path>) -> Result<Content> {
    let folder = tempfile::tempdir().map_err(Error::io(path, "create a folder for"))?;
    let plain = folder.path().join("mesh");
    run(python, "read", path, &plain, format, path)?;
    let bytes = std::fs::read(&plain).map_err(Error::io(&plain, "read"))?;
    decode(&bytes, format).ok_or_else(|| {
        Error::file(
            path,
            Place::Whole,
            format!("meshio read no sound mesh from this {format} file"),
            "check the file",
        )
    })
}

/// Writes a file of the format that meshio calls `format`, and says what did not arrive in it.
///
/// # Errors
/// There is no such environment, meshio fails, or the format cannot hold the mesh.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    format: &str,
    lossy: bool,
    python: Option<&Path>,
) -> Result<Vec<String>> {
    let refuse = |what: String| {
        Error::file(
            path,
            Place::Whole,
            what,
            "mend the mesh before it is written",
        )
    };
    mesh.validate().map_err(refuse)?;
    if is_special(path) {
        return Err(Error::usage(
            format!("{} is no file, and meshio writes files", path.display()),
            "give the name of a file",
        ));
    }
    let parent = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    // Some formats are several files that name each other, so the names must be final from the start.
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
    let mut losses = Losses::default();
    std::fs::write(&plain, encode(mesh, &mut losses)).map_err(Error::io(path, "write"))?;
    run(python, "write", &plain, &made.join(name), format, path)?;
    let back = read(&made.join(name), format, python)?;
    compare(mesh, &back.mesh, &mut losses);
    losses.note_gmsh(mesh);
    let warnings = losses.settle(path, &format!("{format}, as meshio writes it,"), lossy)?;
    for entry in std::fs::read_dir(&made).map_err(Error::io(path, "list"))? {
        let entry = entry.map_err(Error::io(path, "list"))?;
        std::fs::rename(entry.path(), parent.join(entry.file_name()))
            .map_err(Error::io(path, "replace"))?;
    }
    Ok(warnings)
}

fn run(
    python: Option<&Path>,
    task: &str,
    from: &Path,
    to: &Path,
    format: &str,
    about: &Path,
) -> Result<()> {
    let fail = |what: String| {
        Error::file(
            about,
            Place::Whole,
            what,
            "check the file, or convert it to MSH or VTU with the program it comes from",
        )
    };
    let Some(python) = python else {
        return Err(Error::usage(
            format!(
                "{} is {format}, which meshio would {task}, but there is no meshio here",
                about.display()
            ),
            "install it into the private environment with `faceoff engines install`",
        ));
    };
    let mut child = Command::new(python)
        .args(["-I", "-c", SCRIPT, task])
        .args([from, to])
        .arg(format)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(Error::io(python, "start"))?;
    let stderr = child.stderr.take();
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        if let Some(mut stderr) = stderr {
            // What cannot be read is only missing from the message.
            let _ = std::io::Read::read_to_end(&mut stderr, &mut text);
        }
        text
    });
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(Error::io(python, "wait for"))? {
            break status;
        }
        if start.elapsed() > LIMIT {
            // It may have ended in this moment, which is as well.
            let _ = child.kill();
            let _ = child.wait();
            return Err(fail(format!(
                "meshio did not {task} this {format} file within {} s",
                LIMIT.as_secs()
            )));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let message = reader.join().unwrap_or_default();
    if status.success() {
        return Ok(());
    }
    let message = String::from_utf8_lossy(&message);
    let last = message
        .lines()
        .rev()
        .find(|line| !line.trim().is_empty())
        .unwrap_or("it did not say why")
        .trim();
    Err(fail(format!(
        "meshio could not {task} this {format} file: {last}"
    )))
}

/// The mesh in a plain file; `None` where it is not sound.
fn decode(bytes: &[u8], format: &str) -> Option<Content> {
    let end = memchr::memchr(b'\n', bytes)?;
    let head: Head = serde_json::from_slice(bytes.get(..end)?).ok()?;
    let data = bytes.get(end + 1..)?;
    let words = |at: [usize; 2]| {
        Some(
            data.get(at[0]..at[0].checked_add(at[1])?)?
                .as_chunks::<8>()
                .0,
        )
    };
    let floats = |at| {
        Some(
            words(at)?
                .iter()
                .map(|word| f64::from_le_bytes(*word))
                .collect::<Vec<f64>>(),
        )
    };
    let ints = |at| {
        Some(
            words(at)?
                .iter()
                .map(|word| i64::from_le_bytes(*word))
                .collect::<Vec<i64>>(),
        )
    };
    let indices = |at| {
        ints(at)?
            .into_iter()
            .map(|value| u32::try_from(value).ok())
            .collect::<Option<Vec<u32>>>()
    };

    let mut content = Content {
        format: format.to_owned(),
        encoding: "read by meshio".into(),
        ..Content::default()
    };
    content.unread = head.unread;
    let mesh = &mut content.mesh;
    mesh.points = floats(head.points)?.as_chunks::<3>().0.to_vec();
    for block in head.cells {
        let nodes = indices(block.nodes)?;
        if !nodes.is_empty() {
            mesh.blocks
                .push(CellBlock::new(CellKind::from_gmsh(block.kind)?, nodes));
        }
    }
    let dims: Vec<u8> = mesh.cells().map(|(_, kind, _)| kind.dim()).collect();
    let mut groups: BTreeMap<(u8, i64), Group> = BTreeMap::new();
    let mut add = |dim: u8, tag: i64, cell: u32| {
        let group = || Group {
            dim,
            tag,
            name: None,
            cells: Vec::new(),
        };
        groups
            .entry((dim, tag))
            .or_insert_with(group)
            .cells
            .push(cell);
    };
    for entry in head
        .point_data
        .into_iter()
        .map(|d| (Support::Points, d))
        .chain(head.cell_data.into_iter().map(|d| (Support::Cells, d)))
    {
        let (
            on,
            Data {
                name,
                integer,
                components,
                at,
            },
        ) = entry;
        let tags = on == Support::Cells && integer && components == 1;
        if tags && name == PHYSICAL {
            for ((cell, &dim), tag) in (0u32..).zip(&dims).zip(ints(at)?) {
                if tag != 0 {
                    add(dim, tag, cell);
                }
            }
        } else if tags && name == ENTITY {
            let mut entities = ints(at)?
                .into_iter()
                .map(|tag| i32::try_from(tag).unwrap_or(0));
            for block in &mut mesh.blocks {
                let len = block.len();
                block.entities = entities.by_ref().take(len).collect();
            }
        } else {
            let values = if integer {
                Values::I64(ints(at)?)
            } else {
                Values::F64(floats(at)?)
            };
            mesh.fields.push(Field::new(name, on, components, values));
        }
    }
    for name in head.names {
        let Name { name, tag, dim } = name;
        let group = || Group {
            dim,
            tag,
            name: None,
            cells: Vec::new(),
        };
        groups.entry((dim, tag)).or_insert_with(group).name = Some(name);
    }
    for set in head.sets {
        let mut by_dim: BTreeMap<u8, Vec<u32>> = BTreeMap::new();
        for cell in indices(set.cells)? {
            by_dim
                .entry(*dims.get(cell as usize)?)
                .or_default()
                .push(cell);
        }
        for (dim, cells) in by_dim {
            let of_dim = || groups.values().filter(|group| group.dim == dim);
            let known = of_dim()
                .find(|group| group.name.as_ref() == Some(&set.name))
                .map(|group| group.tag);
            let tag = known
                .unwrap_or_else(|| of_dim().map(|group| group.tag).max().unwrap_or(0).max(0) + 1);
            groups.insert(
                (dim, tag),
                Group {
                    dim,
                    tag,
                    name: Some(set.name.clone()),
                    cells,
                },
            );
        }
    }
    mesh.groups = groups.into_values().collect();
    mesh.validate().ok()?;
    Some(content)
}

fn encode(mesh: &Mesh, losses: &mut Losses) -> Vec<u8> {
    let mut data: Vec<u8> = Vec::new();
    let mut place = |words: &mut dyn Iterator<Item = [u8; 8]>| {
        let start = data.len();
        words.for_each(|word| data.extend(word));
        [start, data.len() - start]
    };
    let mut head = Head {
        points: place(&mut mesh.points.as_flattened().iter().map(|x| x.to_le_bytes())),
        ..Head::default()
    };
    for block in &mesh.blocks {
        let nodes = place(
            &mut block
                .nodes
                .iter()
                .map(|&node| i64::from(node).to_le_bytes()),
        );
        head.cells.push(Block {
            kind: i32::from(block.kind.gmsh()),
            nodes,
        });
    }
    for field in &mesh.fields {
        if !field.at.is_empty() || field.on == Support::CellPoints {
            losses.lose(format!(
                "the field {:?}, which has not one value a point or cell",
                field.name
            ));
            continue;
        }
        let floating = matches!(field.values, Values::F32(_) | Values::F64(_));
        let values = field.values.to_f64();
        let at = if floating {
            place(&mut values.iter().map(|x| x.to_le_bytes()))
        } else {
            place(&mut values.iter().map(|&x| (x as i64).to_le_bytes()))
        };
        let entry = Data {
            name: field.name.clone(),
            integer: !floating,
            components: field.components,
            at,
        };
        if field.on == Support::Points {
            head.point_data.push(entry)
        } else {
            head.cell_data.push(entry)
        }
    }
    if !mesh.groups.is_empty() {
        let groups = CellGroups::new(mesh);
        let (first, _) = groups.single();
        let tag = |set: u32| {
            let group = first.get(set as usize).copied().flatten();
            group
                .and_then(|group| mesh.groups.get(group as usize))
                .map_or(0, |group| group.tag)
        };
        let runs = groups.runs_from(0);
        let tags = runs.flat_map(|(cells, set)| std::iter::repeat_n(tag(set), cells.len()));
        let at = place(&mut tags.map(i64::to_le_bytes));
        head.cell_data.push(Data {
            name: PHYSICAL.into(),
            integer: true,
            components: 1,
            at,
        });
    }
    for group in &mesh.groups {
        if let Some(name) = &group.name {
            let cells = place(
                &mut group
                    .cells
                    .iter()
                    .map(|&cell| i64::from(cell).to_le_bytes()),
            );
            head.sets.push(Set {
                name: name.clone(),
                cells,
            });
            head.names.push(Name {
                name: name.clone(),
                tag: group.tag,
                dim: group.dim,
            });
        }
    }
    // Serialising numbers and strings into memory does not fail.
    let mut bytes = serde_json::to_vec(&head).unwrap_or_default();
    bytes.push(b'\n');
    bytes.extend(data);
    bytes
}

/// What of `mesh` did not arrive in `back`.
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
    for field in &mesh.fields {
        if !back
            .fields
            .iter()
            .any(|other| (other.on, &other.name) == (field.on, &field.name))
        {
            losses.lose(format!("the field {:?} on {}", field.name, field.on));
        }
    }
}
