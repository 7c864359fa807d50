//! A mesh from points, blocks of cells, and sets of cells, sides and nodes, as codes have them. A side set becomes a group of
//! facets, and a node set a group of vertices; and vice versa.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use super::sides;
use super::vtu::lattice::CUBE;
use crate::mesh::{CellBlock, CellKind, Group, Mesh};

/// A mesh that is being read. All blocks come before the first set.
#[derive(Default)]
pub struct Sets {
    pub mesh: Mesh,
    pub warnings: Vec<String>,
    groups: BTreeMap<(u8, i64), (Option<String>, Runs)>,
    /// Cells by their sorted nodes, of the dimensions that have been asked for.
    known: HashMap<Vec<u32>, u32>,
    indexed: [bool; 4],
    /// Cells that were made for sides and nodes; their numbers have the bit [`MADE`] until their blocks are known.
    made: Vec<(CellKind, Vec<u32>)>,
}

const MADE: u32 = 1 << 31;

/// Cells of a group, those after one another as one.
#[derive(Default, Clone)]
pub struct Runs(pub Vec<Range<u32>>);

impl Runs {
    pub fn push(&mut self, run: Range<u32>) {
        match self.0.last_mut() {
            _ if run.is_empty() => {}
            Some(last) if last.end == run.start => last.end = run.end,
            _ => self.0.push(run),
        }
    }

    /// The cells in ascending order, each once.
    fn cells(mut self) -> Vec<u32> {
        if !self.0.is_sorted_by_key(|run| run.start) {
            self.0.sort_unstable_by_key(|run| run.start);
        }
        let (mut cells, mut end) = (Vec::new(), 0);
        for run in self.0 {
            cells.extend(run.start.max(end)..run.end);
            end = end.max(run.end);
        }
        cells
    }
}

impl FromIterator<u32> for Runs {
    fn from_iter<I: IntoIterator<Item = u32>>(cells: I) -> Self {
        let mut runs = Runs::default();
        cells.into_iter().for_each(|cell| runs.push(cell..cell + 1));
        runs
    }
}

impl Sets {
    /// Adds a block; its cells.
    pub fn block(&mut self, block: CellBlock) -> Range<u32> {
        let first = self.mesh.cell_count() as u32;
        let cells = first..first + block.len() as u32;
        self.mesh.blocks.push(block);
        cells
    }

    /// Adds a set of cells, given as runs: a group for each of their dimensions, or of dimension `dim` if there are none.
    pub fn cells(
        &mut self,
        dim: u8,
        tag: i64,
        name: &str,
        cells: impl IntoIterator<Item = Range<u32>>,
    ) {
        let ends = self.mesh.block_ends();
        let mut by_dim: BTreeMap<u8, Runs> = BTreeMap::new();
        for run in cells {
            for (dim, part) in self.of_blocks(&ends, run) {
                by_dim.entry(dim).or_default().push(part);
            }
        }
        self.groups_of(by_dim, dim, tag, name);
    }

    /// The parts of a run of cells in each block, with its dimension. `ends` are those of [`Mesh::block_ends`].
    pub fn of_blocks(
        &self,
        ends: &[usize],
        cells: Range<u32>,
    ) -> impl Iterator<Item = (u8, Range<u32>)> {
        let first = ends.partition_point(|&end| end <= cells.start as usize);
        let blocks = self.mesh.blocks.iter().zip(ends).skip(first);
        let parts = blocks.scan(cells.start, move |start, (block, &end)| {
            let part = *start..cells.end.min(end as u32);
            *start = part.end.max(*start);
            (!part.is_empty() || *start < cells.end).then_some((block.kind.dim(), part))
        });
        parts.filter(|(_, part)| !part.is_empty())
    }

    /// Adds a set of sides: cells, and the corners of each side by their places in the cell. Returns how many are of an order
    /// whose sides are not known here.
    pub fn sides<'a>(
        &mut self,
        tag: i64,
        name: &str,
        sides: impl IntoIterator<Item = (u32, &'a [usize])>,
    ) -> usize {
        let ends = self.mesh.block_ends();
        let mut by_dim: BTreeMap<u8, Runs> = BTreeMap::new();
        let mut unknown = 0;
        for (cell, corners) in sides {
            let index = ends.partition_point(|&end| end <= cell as usize);
            let Some(block) = self.mesh.blocks.get(index) else {
                continue;
            };
            let first = ends[index] - block.len();
            let nodes = block.cells().nth(cell as usize - first).unwrap_or_default();
            // The two faces of a shell are the shell.
            let is_whole = block.kind.dim() < 3 && corners.len() == block.kind.corners();
            let side = match is_whole {
                true => Some((block.kind, nodes.to_vec())),
                false => sides::side(block.kind, nodes, corners),
            };
            match side {
                Some((kind, nodes)) => {
                    let cell = self.cell_of(kind, nodes);
                    by_dim.entry(kind.dim()).or_default().push(cell..cell + 1);
                }
                None => unknown += 1,
            }
        }
        let dim = self.mesh.dim().saturating_sub(1);
        self.groups_of(by_dim, dim, tag, name);
        unknown
    }

    /// Adds a set of nodes.
    pub fn nodes(&mut self, tag: i64, name: &str, nodes: impl IntoIterator<Item = u32>) {
        let cells = nodes
            .into_iter()
            .map(|node| self.cell_of(CellKind::Vertex, vec![node]));
        let cells = cells.collect();
        self.group(0, tag, name, cells);
    }

    /// Adds a set of cells of any kinds by their nodes.
    pub fn given<'a>(
        &mut self,
        tag: i64,
        name: &str,
        cells: impl IntoIterator<Item = (CellKind, &'a [u32])>,
    ) {
        let mut by_dim: BTreeMap<u8, Runs> = BTreeMap::new();
        for (kind, nodes) in cells {
            let cell = self.cell_of(kind, nodes.to_vec());
            by_dim.entry(kind.dim()).or_default().push(cell..cell + 1);
        }
        self.groups_of(by_dim, 0, tag, name);
    }

    /// The cell with these nodes, which is made if it is not there.
    fn cell_of(&mut self, kind: CellKind, nodes: Vec<u32>) -> u32 {
        let dim = kind.dim();
        let sorted = |nodes: &[u32]| {
            let mut key = nodes.to_vec();
            key.sort_unstable();
            key
        };
        if !std::mem::replace(&mut self.indexed[usize::from(dim)], true) {
            for (cell, _, nodes) in self.mesh.cells().filter(|(_, kind, _)| kind.dim() == dim) {
                self.known.entry(sorted(nodes)).or_insert(cell);
            }
        }
        *self.known.entry(sorted(&nodes)).or_insert_with(|| {
            self.made.push((kind, nodes));
            MADE | (self.made.len() - 1) as u32
        })
    }

    fn groups_of(&mut self, by_dim: BTreeMap<u8, Runs>, dim: u8, tag: i64, name: &str) {
        if by_dim.is_empty() {
            self.group(dim, tag, name, Runs::default());
        }
        for (dim, cells) in by_dim {
            self.group(dim, tag, name, cells);
        }
    }

    /// Another set of this number and dimension goes before: then it gets the next free one.
    fn group(&mut self, dim: u8, tag: i64, name: &str, cells: Runs) {
        let name = Some(name).filter(|name| !name.is_empty());
        let mut number = tag;
        while let Some((other, known)) = self.groups.get_mut(&(dim, number)) {
            if name.is_some() && other.as_deref() == name {
                cells.0.into_iter().for_each(|run| known.push(run));
                return;
            }
            let last = self
                .groups
                .range((dim, i64::MIN)..=(dim, i64::MAX))
                .next_back();
            number = last.map_or(1, |((_, last), _)| last.saturating_add(1));
        }
        if number != tag {
            self.warnings.push(format!(
                "the group {:?} of number {tag} and dimension {dim} is numbered {number}, as there is another",
                name.unwrap_or_default()
            ));
        }
        let name = name.map(str::to_owned);
        self.groups.insert((dim, number), (name, cells));
    }

    /// The mesh, in which the cells that were made come last.
    pub fn finish(mut self) -> (Mesh, Vec<String>) {
        let mut numbers = vec![0; self.made.len()];
        let mut of_kind: BTreeMap<CellKind, Vec<usize>> = BTreeMap::new();
        for (k, (kind, _)) in self.made.iter().enumerate() {
            of_kind.entry(*kind).or_default().push(k);
        }
        for (kind, made) in of_kind {
            let nodes = made
                .iter()
                .flat_map(|&k| self.made[k].1.iter().copied())
                .collect();
            let cells = self.block(CellBlock::new(kind, nodes));
            made.iter()
                .zip(cells)
                .for_each(|(&k, cell)| numbers[k] = cell);
        }
        let groups = self.groups.into_iter().map(|((dim, tag), (name, runs))| {
            let mut known = Runs::default();
            for run in runs.0 {
                match run.start & MADE {
                    0 => known.push(run),
                    _ => run.for_each(|made| {
                        let cell = numbers[(made ^ MADE) as usize];
                        known.push(cell..cell + 1);
                    }),
                }
            }
            Group {
                name,
                cells: known.cells(),
                ..Group::new(dim, tag)
            }
        });
        self.mesh.groups = groups.collect();
        self.mesh.blocks.retain(|block| !block.is_empty());
        // Fields were read before the last cells were made.
        let all = self.mesh.cell_count();
        for field in &mut self.mesh.fields {
            if field.on == crate::mesh::Support::Cells
                && field.at.is_empty()
                && field.components > 0
            {
                let rows = field.values.len() / field.components;
                if rows < all {
                    field.at = (0..rows as u32).collect();
                }
            }
        }
        (self.mesh, self.warnings)
    }
}

/// The cells between points along each of up to three dimensions, the slowest first; points are numbered from `first` on.
pub fn grid(counts: &[usize], first: u32) -> (CellKind, Vec<u32>) {
    let counts: Vec<usize> = counts.iter().copied().filter(|&count| count != 1).collect();
    let kinds = [
        CellKind::Vertex,
        CellKind::Line,
        CellKind::Quadrangle,
        CellKind::Hexahedron,
    ];
    let count = |axis: usize| counts.len().checked_sub(axis + 1).map_or(1, |k| counts[k]);
    let strides = [1, count(0), count(0) * count(1)];
    let corners = &CUBE[..1 << counts.len().min(3)];
    let cells = |axis: usize| {
        if axis < counts.len() {
            0..count(axis).saturating_sub(1)
        } else {
            0..1
        }
    };
    let mut nodes = Vec::new();
    for (k, j, i) in
        cells(2).flat_map(|k| cells(1).flat_map(move |j| cells(0).map(move |i| (k, j, i))))
    {
        let node = |[a, b, c]: &[usize; 3]| (i + a) + (j + b) * strides[1] + (k + c) * strides[2];
        nodes.extend(corners.iter().map(|corner| first + node(corner) as u32));
    }
    (kinds[counts.len().min(3)], nodes)
}

/// Names in which every one is another, as formats have them whose groups are known by name: the group's, or else its number.
pub fn distinct_names<'a>(groups: impl Iterator<Item = &'a Group>, longest: usize) -> Vec<String> {
    let mut seen = HashSet::new();
    let name = |group: &Group| {
        let own = group
            .name
            .clone()
            .unwrap_or_else(|| format!("group_{}_{}", group.dim, group.tag));
        let own: String = own
            .chars()
            .filter(|c| !c.is_control())
            .map(|c| if c == '/' { '_' } else { c })
            .collect();
        let mut text = cut(&own, longest);
        let mut k = 1;
        while text.is_empty() || !seen.insert(text.clone()) {
            let tail = format!("_{k}");
            k += 1;
            let mut head = own.clone();
            while head.len() + tail.len() > longest && head.pop().is_some() {}
            text = head + &tail;
        }
        text
    };
    groups.map(name).collect()
}

/// The beginning of a text, of at most a given number of bytes.
pub fn cut(text: &str, longest: usize) -> String {
    let mut text = text.to_owned();
    while text.len() > longest {
        text.pop();
    }
    text
}
