//! The plain file that we exchange with meshio: a line of JSON, then arrays of binary64 and 64-bit integers, little-endian.

use crate::field::Unread;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Content;
use super::loss::Losses;
use crate::mesh::{CellBlock, CellGroups, CellKind, Field, Group, Mesh, Support, Values};

/// The names under which meshio keeps the physical tag and the elementary entity of cells.
pub const PHYSICAL: &str = "gmsh:physical";
pub const ENTITY: &str = "gmsh:geometrical";

#[derive(Serialize, Deserialize, Default)]
struct Head {
    points: [usize; 2],
    cells: Vec<Block>,
    point_data: Vec<Data>,
    cell_data: Vec<Data>,
    sets: Vec<Set>,
    names: Vec<Name>,
    #[serde(default)]
    unread: Vec<Unread>,
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
    /// Whether the values were binary32.
    #[serde(default)]
    single: bool,
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

type Groups = BTreeMap<(u8, i64), Group>;

fn group(groups: &mut Groups, dim: u8, tag: i64) -> &mut Group {
    groups
        .entry((dim, tag))
        .or_insert_with(|| Group::new(dim, tag))
}

/// The mesh in a plain file; `None` if it is not sound.
pub fn decode(bytes: &[u8], format: &str) -> Option<Content> {
    let end = memchr::memchr(b'\n', bytes)?;
    let head: Head = serde_json::from_slice(bytes.get(..end)?).ok()?;
    let data = bytes.get(end + 1..)?;
    let words = |[start, length]: [usize; 2]| {
        let bytes = data.get(start..start.checked_add(length)?)?;
        Some(bytes.as_chunks::<8>().0.iter().copied())
    };
    let floats = |at| Some(words(at)?.map(f64::from_le_bytes).collect::<Vec<f64>>());
    let ints = |at| Some(words(at)?.map(i64::from_le_bytes).collect::<Vec<i64>>());
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
    mesh.points = floats(head.points)?.as_chunks::<3>().0.to_vec().into();
    for block in head.cells {
        let nodes = indices(block.nodes)?;
        if !nodes.is_empty() {
            mesh.blocks
                .push(CellBlock::new(CellKind::from_gmsh(block.kind)?, nodes));
        }
    }
    let dims: Vec<u8> = mesh.cells().map(|(_, kind, _)| kind.dim()).collect();
    let mut groups = Groups::new();
    let on = |on| move |data: Data| (on, data);
    let on_points = head.point_data.into_iter().map(on(Support::Points));
    let on_cells = head.cell_data.into_iter().map(on(Support::Cells));
    for (on, data) in on_points.chain(on_cells) {
        let Data {
            name,
            integer,
            single,
            components,
            at,
        } = data;
        let tags = on == Support::Cells && integer && components == 1;
        if tags && name == PHYSICAL {
            for ((cell, &dim), tag) in (0u32..).zip(&dims).zip(ints(at)?) {
                if tag != 0 {
                    group(&mut groups, dim, tag).cells.push(cell);
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
                Values::I64(ints(at)?.into())
            } else if single {
                Values::F32(floats(at)?.into_iter().map(|x| x as f32).collect())
            } else {
                Values::F64(floats(at)?.into())
            };
            mesh.fields.push(Field::new(name, on, components, values));
        }
    }
    for name in head.names {
        group(&mut groups, name.dim, name.tag).name = Some(name.name);
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
            let group = group(&mut groups, dim, tag);
            (group.name, group.cells) = (Some(set.name.clone()), cells);
        }
    }
    mesh.groups = groups.into_values().collect();
    mesh.validate().ok()?;
    Some(content)
}

pub fn encode(mesh: &Mesh, losses: &mut Losses) -> Vec<u8> {
    let mut data: Vec<u8> = Vec::new();
    let mut place = |words: &mut dyn Iterator<Item = [u8; 8]>| {
        let start = data.len();
        words.for_each(|word| data.extend(word));
        [start, data.len() - start]
    };
    let word = |index: &u32| i64::from(*index).to_le_bytes();
    let mut head = Head {
        points: place(&mut mesh.points.as_flattened().iter().map(|x| x.to_le_bytes())),
        ..Head::default()
    };
    for block in &mesh.blocks {
        head.cells.push(Block {
            kind: i32::from(block.kind.gmsh()),
            nodes: place(&mut block.nodes.iter().map(word)),
        });
    }
    for field in &mesh.fields {
        if !field.at.is_empty() || field.on == Support::CellPoints {
            losses.lose(format!(
                "the field {:?}, which does not have one value per point or cell",
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
            single: matches!(field.values, Values::F32(_)),
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
        let (first, _) = groups.single(mesh);
        let tag = |set: u32| first[set as usize].map_or(0, |group| group.tag);
        let runs = groups.runs_from(0);
        let tags = runs.flat_map(|(cells, set)| std::iter::repeat_n(tag(set), cells.len()));
        let at = place(&mut tags.map(i64::to_le_bytes));
        head.cell_data.push(Data {
            name: PHYSICAL.into(),
            integer: true,
            single: false,
            components: 1,
            at,
        });
    }
    for group in &mesh.groups {
        if let Some(name) = &group.name {
            head.sets.push(Set {
                name: name.clone(),
                cells: place(&mut group.cells.iter().map(word)),
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
