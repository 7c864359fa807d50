//! Common to the writers of all MSH versions.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::{CellGroups, Mesh};

pub struct Writer<'a> {
    pub mesh: &'a Mesh,
    pub binary: bool,
    pub out: Out,
    pub groups: CellGroups,
    /// All cells. The cells of an entity are in the same groups, as Gmsh assigns groups to entities.
    pub runs: Vec<EntityRun>,
    /// Each entity that has cells, with its set of groups, in the order of first cells.
    pub entities: Vec<(u8, i32, u32)>,
    /// Entities whose cells were not all in the same groups.
    pub split: usize,
}

/// Consecutive cells of one block and one entity.
pub struct EntityRun {
    pub block: usize,
    /// Counted through all blocks.
    pub cells: Range<usize>,
    pub entity: i32,
    /// Index into the sets of groups.
    pub set: u32,
}

impl<'a> Writer<'a> {
    pub fn new(mesh: &'a Mesh, binary: bool, out: Out) -> Self {
        let groups = CellGroups::new(mesh);
        let mut taken: HashSet<(u8, i32)> = HashSet::new();
        let mut next = 1;
        for block in &mesh.blocks {
            for &entity in block
                .entities
                .chunk_by(|a, b| a == b)
                .filter_map(|run| run.first())
            {
                taken.insert((block.kind.dim(), entity));
                next = next.max(entity.saturating_add(1));
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
        let mut runs: Vec<EntityRun> = Vec::new();
        let mut split = 0;
        for (block_index, cells, own, set) in plain_runs(mesh, &groups) {
            let dim = mesh
                .blocks
                .get(block_index)
                .map_or(0, |block| block.kind.dim());
            let entity = *numbers.entry((dim, own, set)).or_insert_with(|| {
                let kept = own.filter(|entity| !given.contains(&(dim, *entity)));
                split += usize::from(kept.is_none() && own.is_some());
                // Cells without an entity get the number of their group: most codes expect the two to be equal.
                let first = groups
                    .sets
                    .get(set as usize)
                    .and_then(|set| mesh.groups.get(*set.first()? as usize));
                let like = first.and_then(|group| i32::try_from(group.tag).ok());
                let like =
                    like.filter(|tag| *tag > 0 && own.is_none() && !taken.contains(&(dim, *tag)));
                let number = kept.or(like).unwrap_or_else(|| {
                    next = next.saturating_add(1);
                    next - 1
                });
                given.insert((dim, number));
                taken.insert((dim, number));
                entities.push((dim, number, set));
                number
            });
            runs.push(EntityRun {
                block: block_index,
                cells,
                entity,
                set,
            });
        }
        Writer {
            mesh,
            binary,
            out,
            groups,
            runs,
            entities,
            split,
        }
    }

    /// The runs from this cell on, each with its cells; the first run is cut to start at the cell.
    pub fn runs_from(&self, cell: usize) -> impl Iterator<Item = (Range<usize>, &EntityRun)> {
        let first = self.runs.partition_point(|run| run.cells.end <= cell);
        let runs = self.runs.get(first..).unwrap_or_default().iter();
        runs.map(move |run| (run.cells.start.max(cell)..run.cells.end, run))
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

    /// Loses the groups whose numbers do not go from `least` to 2^31 - 1.
    pub fn lose_groups(&self, least: i64, losses: &mut Losses) {
        let fits = |tag: i64| (least..=i32::MAX.into()).contains(&tag);
        for group in self.mesh.groups.iter().filter(|group| !fits(group.tag)) {
            losses.lose(format!(
                "group {} of dimension {}, {:?}, whose number is not {least} to 2^31 - 1",
                group.tag,
                group.dim,
                group.name.as_deref().unwrap_or_default()
            ));
        }
    }

    /// `$PhysicalNames`: the named groups and, with an empty name, groups that no cell shows.
    pub fn names(&mut self, shown: impl Fn(u8, i64) -> bool, losses: &mut Losses) {
        let mut lines = Vec::new();
        for group in &self.mesh.groups {
            let name = group.name.as_deref().unwrap_or_default();
            if name.contains(['"', '\n', '\r']) {
                losses.lose(format!(
                    "the name {name:?}, which has a quote or a line end"
                ));
            }
            let name = name.replace(['"', '\n', '\r'], "'");
            if !name.is_empty() || (group.cells.is_empty() && !shown(group.dim, group.tag)) {
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

    /// A 32-bit integer, with a blank in ASCII.
    #[inline]
    pub fn i32(&mut self, value: i32) -> &mut Self {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.int(value);
        }
        self
    }

    /// A 64-bit integer, with a blank in ASCII.
    #[inline]
    pub fn u64(&mut self, value: u64) -> &mut Self {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.int(value);
        }
        self
    }

    #[inline]
    pub fn f64(&mut self, value: f64) -> &mut Self {
        if self.binary {
            self.out.bytes.extend(value.to_le_bytes());
        } else {
            self.out.float(value);
        }
        self
    }

    #[inline]
    pub fn f64s(&mut self, values: &[f64]) -> &mut Self {
        for &value in values {
            self.f64(value);
        }
        self
    }

    /// A list with its length.
    pub fn list(&mut self, values: &[i32]) -> &mut Self {
        self.u64(values.len() as u64);
        for &value in values {
            self.i32(value);
        }
        self
    }

    /// The number of a node or element where it has 32 bits in binary.
    #[inline]
    pub fn tag(&mut self, tag: u64) -> &mut Self {
        if self.binary {
            self.i32(tag as i32)
        } else {
            self.u64(tag)
        }
    }

    /// Rows of three binary64 numbers.
    pub fn binary_points(&mut self, points: &[[f64; 3]]) {
        self.out.rows(points.len(), 24, |first, rows| {
            let (places, _) = rows.as_chunks_mut::<8>();
            let numbers = points.get(first..).unwrap_or_default().as_flattened();
            for (place, x) in places.iter_mut().zip(numbers) {
                *place = x.to_le_bytes();
            }
        });
    }

    /// Ends a line, in ASCII.
    #[inline]
    pub fn end(&mut self) -> &mut Self {
        if !self.binary {
            self.out.end();
        }
        self
    }

    /// The end of a section.
    pub fn end_section(&mut self, name: &str) {
        if self.binary {
            self.out.text("\n");
        }
        self.out.text(&format!("$End{name}\n"));
    }
}

/// Runs of cells that share block, entity and set of groups.
fn plain_runs(mesh: &Mesh, groups: &CellGroups) -> Vec<(usize, Range<usize>, Option<i32>, u32)> {
    let mut runs = Vec::new();
    let mut first = 0;
    for (index, block) in mesh.blocks.iter().enumerate() {
        let end = first + block.len();
        let sets = groups.runs_from(first as u32);
        let sets = sets.take_while(|(cells, _)| (cells.start as usize) < end);
        for (cells, set) in sets {
            let cells = cells.start as usize..end.min(cells.end as usize);
            let entities = block.entities.get(cells.start - first..cells.end - first);
            let Some(entities) = entities else {
                runs.push((index, cells, None, set));
                continue;
            };
            let mut start = cells.start;
            for same in entities.chunk_by(|a, b| a == b) {
                let cells = start..start + same.len();
                start = cells.end;
                runs.push((index, cells, same.first().copied(), set));
            }
        }
        first = end;
    }
    runs
}
