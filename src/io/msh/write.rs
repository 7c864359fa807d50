//! What the writers of all MSH versions share.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::{write_v2, write_v4};
use crate::error::{Error, Place, Result};
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::{CellGroups, Field, Mesh, Support, Values};

/// The versions that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Version {
    /// 2.2, which most other codes read.
    #[default]
    V22,
    /// 4.1, which holds everything.
    V41,
}

/// How to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    pub version: Version,
    /// Little-endian binary rather than ASCII.
    pub binary: bool,
    /// What the version cannot hold becomes a warning rather than an error.
    pub lossy: bool,
}

/// Writes an MSH file; the warnings say what could not be taken along.
///
/// # Errors
/// The mesh is not sound, the version cannot hold it, or the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh, options: &Options) -> Result<Vec<String>> {
    let (out, warnings) = encode(path, mesh, options)?;
    out.save(path)?;
    Ok(warnings)
}

/// The bytes that [`fn@write`] writes; `path` is named in messages only.
///
/// # Errors
/// The mesh is not sound, or the version cannot hold it.
pub fn to_bytes(path: &Path, mesh: &Mesh, options: &Options) -> Result<(Vec<u8>, Vec<String>)> {
    encode(path, mesh, options).map(|(out, warnings)| (out.into_bytes(), warnings))
}

fn encode(path: &Path, mesh: &Mesh, options: &Options) -> Result<(Out, Vec<String>)> {
    mesh.validate().map_err(|what| {
        Error::file(
            path,
            Place::Whole,
            what,
            "mend the mesh before it is written",
        )
    })?;
    let mut losses = Losses::default();
    let writer = Writer::new(mesh, options.binary);
    let out = match options.version {
        Version::V22 => write_v2::encode(writer, &mut losses),
        Version::V41 => write_v4::encode(writer, &mut losses),
    };
    let name = match options.version {
        Version::V22 => "MSH 2.2",
        Version::V41 => "MSH 4.1",
    };
    Ok((out, losses.settle(path, name, options.lossy)?))
}

pub struct Writer<'a> {
    pub mesh: &'a Mesh,
    pub binary: bool,
    pub out: Out,
    pub groups: CellGroups,
    /// The entity of each cell, such that the cells of one are in the same groups: Gmsh hangs groups on entities.
    pub entity_of: Vec<i32>,
    /// Each entity that has cells, with its set of groups; in the order of their first cells.
    pub entities: Vec<(u8, i32, u32)>,
    /// Entities whose cells were not all in the same groups.
    pub split: usize,
}

impl<'a> Writer<'a> {
    fn new(mesh: &'a Mesh, binary: bool) -> Self {
        let groups = CellGroups::new(mesh);
        let mut taken: HashSet<(u8, i32)> = HashSet::new();
        let mut next = 1;
        for block in &mesh.blocks {
            let mut last = None;
            for &entity in &block.entities {
                if last != Some(entity) {
                    taken.insert((block.kind.dim(), entity));
                    next = next.max(entity.saturating_add(1));
                    last = Some(entity);
                }
            }
        }
        for entity in &mesh.geometry.entities {
            taken.insert((entity.dim, entity.tag));
            next = next.max(entity.tag.saturating_add(1));
        }
        for group in &mesh.groups {
            next = next.max(i32::try_from(group.tag).unwrap_or(0).saturating_add(1));
        }

        let mut numbers: HashMap<(u8, Option<i32>, u32), i32> = HashMap::new();
        let mut given: HashSet<(u8, i32)> = HashSet::new();
        let mut entities = Vec::new();
        let mut entity_of = Vec::with_capacity(groups.set_of.len());
        let mut split = 0;
        for block in &mesh.blocks {
            let dim = block.kind.dim();
            let mut last = None;
            for cell in 0..block.len() {
                let set = groups.set_of.get(entity_of.len()).copied().unwrap_or(0);
                let key = (dim, block.entities.get(cell).copied(), set);
                if let Some((last_key, number)) = last
                    && last_key == key
                {
                    entity_of.push(number);
                    continue;
                }
                let number = *numbers.entry(key).or_insert_with(|| {
                    let own = key.1.filter(|entity| !given.contains(&(dim, *entity)));
                    split += usize::from(own.is_none() && key.1.is_some());
                    // Cells that lie on no entity get the number of their group: most codes want the two alike.
                    let first = groups
                        .sets
                        .get(set as usize)
                        .and_then(|set| mesh.groups.get(*set.first()? as usize));
                    let like = first.and_then(|group| i32::try_from(group.tag).ok());
                    let like = like
                        .filter(|tag| *tag > 0 && key.1.is_none() && !taken.contains(&(dim, *tag)));
                    let number = own.or(like).unwrap_or_else(|| {
                        next = next.saturating_add(1);
                        next - 1
                    });
                    given.insert((dim, number));
                    taken.insert((dim, number));
                    entities.push((dim, number, set));
                    number
                });
                last = Some((key, number));
                entity_of.push(number);
            }
        }
        // What is binary grows in blocks.
        let text = if binary { 0 } else { 1 };
        let nodes = mesh.blocks.iter();
        let nodes: usize = nodes.map(|block| block.nodes.len() + 4 * block.len()).sum();
        let out = Out::with_capacity(text * (64 * mesh.points.len() + 8 * nodes) + 4096);
        Writer {
            mesh,
            binary,
            out,
            groups,
            entity_of,
            entities,
            split,
        }
    }

    pub fn header(&mut self, version: &str) {
        let binary = i32::from(self.binary);
        self.out
            .text(&format!("$MeshFormat\n{version} {binary} 8\n"));
        if self.binary {
            self.out.bytes.extend(1i32.to_le_bytes());
            self.out.text("\n");
        }
        self.out.text("$EndMeshFormat\n");
    }

    /// `$PhysicalNames`: the named groups, and with an empty name those that no cell would tell of.
    pub fn names(&mut self, told: impl Fn(u8, i64) -> bool, losses: &mut Losses) {
        let mut lines = Vec::new();
        for group in &self.mesh.groups {
            let name = group.name.as_deref().unwrap_or_default();
            if name.contains(['"', '\n', '\r']) {
                losses.lose(format!(
                    "the name {name:?}, which has a quote or a line end"
                ));
            }
            let name = name.replace(['"', '\n', '\r'], "'");
            if !name.is_empty() || (group.cells.is_empty() && !told(group.dim, group.tag)) {
                lines.push(format!("{} {} \"{name}\"\n", group.dim, group.tag));
            }
        }
        if !lines.is_empty() {
            let count = lines.len();
            self.out.text(&format!(
                "$PhysicalNames\n{count}\n{}$EndPhysicalNames\n",
                lines.concat()
            ));
        }
    }

    /// A 32-bit whole number, with a blank in ASCII.
    #[inline]
    pub fn i32(&mut self, value: i32) {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.int(value);
        }
    }

    /// A 64-bit whole number, with a blank in ASCII.
    #[inline]
    pub fn u64(&mut self, value: u64) {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.int(value);
        }
    }

    #[inline]
    pub fn f64(&mut self, value: f64) {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.float(value);
        }
    }

    /// Rows of binary64, three a point.
    pub fn binary_points(&mut self, points: &[[f64; 3]]) {
        self.out.rows(points.len(), 24, |index, row| {
            let (places, _) = row.as_chunks_mut::<8>();
            if let Some(point) = points.get(index) {
                places
                    .iter_mut()
                    .zip(point)
                    .for_each(|(place, x)| *place = x.to_le_bytes());
            }
        });
    }

    /// The end of a line, which binary has not.
    #[inline]
    pub fn end(&mut self) {
        if !self.binary {
            self.out.end();
        }
    }

    /// The end of a section.
    pub fn end_section(&mut self, name: &str) {
        if self.binary {
            self.out.text("\n");
        }
        self.out.text(&format!("$End{name}\n"));
    }

    /// The fields; `point_tag` and `cell_tags` are the numbers that the file gives points and cells.
    pub fn fields(
        &mut self,
        point_tag: impl Fn(u32) -> u64,
        cell_tags: &[u64],
        losses: &mut Losses,
    ) {
        let mesh = self.mesh;
        for field in &mesh.fields {
            if field.name.contains(['"', '\n', '\r']) || field.name != field.name.trim_ascii() {
                losses.lose(format!(
                    "the field name {:?}, which has a quote, a line end or outer blanks",
                    field.name
                ));
                continue;
            }
            self.field(field, &point_tag, cell_tags, losses);
        }
    }

    fn field(
        &mut self,
        field: &Field,
        point_tag: &impl Fn(u32) -> u64,
        cell_tags: &[u64],
        losses: &mut Losses,
    ) {
        let inexact = match &field.values {
            Values::I64(values) => values.iter().any(|v| v.unsigned_abs() > 1 << 53),
            Values::U64(values) => values.iter().any(|v| *v > 1 << 53),
            _ => false,
        };
        if inexact {
            losses.lose(format!(
                "the 64-bit whole numbers of field {:?} exactly",
                field.name
            ));
        }
        let (section, rows) = match field.on {
            Support::Points => ("NodeData", self.mesh.points.len()),
            Support::Cells => ("ElementData", cell_tags.len()),
            Support::CellPoints => ("ElementNodeData", cell_tags.len()),
        };
        let all: Vec<u32>;
        let at = if field.at.is_empty() {
            all = (0..rows as u32).collect();
            &all
        } else {
            &field.at
        };
        let tag = |index: u32| match field.on {
            Support::Points => point_tag(index),
            Support::Cells | Support::CellPoints => {
                cell_tags.get(index as usize).copied().unwrap_or(0)
            }
        };
        // Here a number is 32 bits wide in every version.
        if self.binary && at.iter().any(|&index| i32::try_from(tag(index)).is_err()) {
            losses.lose(format!(
                "the field {:?}, as numbers of its points or cells exceed 32 bits",
                field.name
            ));
            return;
        }
        let kinds: Vec<usize> = match field.on {
            Support::CellPoints => self
                .mesh
                .cells()
                .map(|(_, kind, _)| kind.points())
                .collect(),
            Support::Points | Support::Cells => Vec::new(),
        };
        let (time, step) = (field.time.unwrap_or(0.0), field.step.unwrap_or(0));
        self.out
            .text(&format!("${section}\n1\n\"{}\"\n1\n", field.name));
        self.out.float(time).end();
        self.out
            .text(&format!("3\n{step}\n{}\n{}\n", field.components, at.len()));
        let values = field.values.to_f64();
        let mut next = values.iter();
        for &index in at {
            let tag = tag(index);
            if self.binary {
                self.i32(tag as i32)
            } else {
                self.u64(tag)
            }
            let points = kinds.get(index as usize).copied();
            if let Some(points) = points {
                self.i32(points as i32);
            }
            for &value in next.by_ref().take(points.unwrap_or(1) * field.components) {
                self.f64(value);
            }
            self.end();
        }
        self.end_section(section);
    }
}
