//! A mesh that is being read: points and cells with the numbers that the file gives them, groups, named sets, sides.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Display;

use crate::error::{Error, Result};
use crate::io::scan::Scan;
use crate::mesh::{CellBlock, CellKind, Entity, Group, Mesh};

/// Maps the file's numbers of points or cells to indices from 0.
pub enum Lookup {
    /// The numbers are `first`, `first + 1`, ….
    Dense {
        first: u64,
        count: u32,
    },
    /// Index plus one at position number - `first`; 0 for none.
    Table {
        first: u64,
        table: Vec<u32>,
    },
    Sparse(HashMap<u64, u32>),
}

impl Lookup {
    /// # Errors
    /// The first number that appears twice.
    pub fn new(tags: &[u64]) -> Result<Lookup, u64> {
        let count = tags.len() as u32;
        let first = tags.iter().copied().min().unwrap_or(1);
        if tags
            .iter()
            .zip(first..)
            .all(|(&tag, expected)| tag == expected)
        {
            return Ok(Lookup::Dense { first, count });
        }
        let span = tags.iter().copied().max().unwrap_or(1) - first;
        if span < 4 * u64::from(count) + 1024 {
            let mut table = vec![0; span as usize + 1];
            for (&tag, index) in tags.iter().zip(1u32..) {
                match table.get_mut((tag - first) as usize) {
                    Some(place) if *place == 0 => *place = index,
                    _ => return Err(tag),
                }
            }
            return Ok(Lookup::Table { first, table });
        }
        let mut map = HashMap::with_capacity(tags.len());
        for (&tag, index) in tags.iter().zip(0u32..) {
            if map.insert(tag, index).is_some() {
                return Err(tag);
            }
        }
        Ok(Lookup::Sparse(map))
    }

    #[inline]
    pub fn get(&self, tag: u64) -> Option<u32> {
        match self {
            Lookup::Dense { first, count } => {
                let index = tag.wrapping_sub(*first);
                (index < u64::from(*count)).then_some(index as u32)
            }
            Lookup::Table { first, table } => {
                let place = usize::try_from(tag.wrapping_sub(*first)).ok()?;
                table.get(place)?.checked_sub(1)
            }
            Lookup::Sparse(map) => map.get(&tag).copied(),
        }
    }
}

/// Numbers of points or cells, which are kept only if they are not 1, 2, 3, ….
#[derive(Default)]
pub struct Numbering {
    count: usize,
    /// All numbers, as soon as one breaks the sequence; none before.
    own: Vec<u64>,
    /// The largest that [`Numbering::push`] got.
    highest: u64,
}

impl Numbering {
    pub fn len(&self) -> usize {
        self.count
    }

    /// The numbers, where they are not 1, 2, 3, ….
    pub fn own(&self) -> &[u64] {
        &self.own
    }

    /// The next number of the sequence; `None` if it is broken.
    pub fn next(&self) -> Option<u64> {
        self.own.is_empty().then_some(self.count as u64 + 1)
    }

    #[inline]
    pub fn push(&mut self, number: u64) {
        self.highest = self.highest.max(number);
        if self.next() == Some(number) {
            self.count += 1;
        } else {
            self.append(vec![number]);
        }
    }

    /// Appends `count` numbers that continue the sequence, which is not broken.
    pub fn count_on(&mut self, count: usize) {
        debug_assert!(self.own.is_empty());
        self.count += count;
    }

    pub fn append(&mut self, mut numbers: Vec<u64>) {
        if self.own.is_empty() {
            self.own = (1..=self.count as u64).collect();
        }
        self.count += numbers.len();
        if self.own.is_empty() {
            self.own = numbers;
        } else {
            self.own.append(&mut numbers);
        }
    }

    /// The lowest and the highest number; `None` where there are none.
    pub fn range(&self) -> Option<(u64, u64)> {
        match (self.own.iter().min(), self.own.iter().max()) {
            (Some(&low), Some(&high)) => Some((low, high)),
            _ => (self.count > 0).then_some((1, self.count as u64)),
        }
    }
}

/// Dimension and number of an entity, and the number of a group that cells of it are in.
pub type EntityGroup = (u8, i32, i64);

/// How to find the cell of a number, and the type of each cell.
pub struct CellIndex {
    pub by_tag: Lookup,
    pub kinds: Vec<CellKind>,
}

/// A mesh that is being read.
#[derive(Default)]
pub struct Builder {
    pub mesh: Mesh,
    /// Set once the points are complete.
    pub points: Option<Lookup>,
    /// Numbers of the cells so far.
    pub numbers: Numbering,
    cells: u32,
    groups: BTreeMap<(u8, i64), Group>,
    /// Names by dimension and number; dimension `None` means any with that number.
    names: HashMap<(Option<u8>, i64), String>,
    /// Sets that have a name and no number, in the order of the file.
    sets: Vec<(String, Option<i64>, Vec<u32>)>,
    set_of_name: HashMap<String, usize>,
    /// The cells with up to four corners by these, ascending, once sides have been asked for.
    sides: Option<HashMap<[u32; 4], u32>>,
    pub elements_seen: bool,
    pub cell_index: Option<CellIndex>,
}

impl Builder {
    /// Takes the numbers of all points, which must be different.
    pub fn finish_points(&mut self, scan: &Scan<'_>, numbers: Numbering) -> Result<()> {
        let count = numbers.len() as u32;
        let own = numbers.own;
        self.points = Some(if own.is_empty() {
            Lookup::Dense { first: 1, count }
        } else {
            Lookup::new(&own).map_err(|tag| scan.error(format!("node {tag} appears twice")))?
        });
        self.mesh.point_tags = own;
        Ok(())
    }

    /// The block to which cells of this type are appended.
    #[inline]
    pub fn block(&mut self, kind: CellKind) -> &mut CellBlock {
        if self
            .mesh
            .blocks
            .last()
            .is_none_or(|block| block.kind != kind)
        {
            self.mesh.blocks.push(CellBlock::new(kind, Vec::new()));
        }
        self.mesh
            .blocks
            .last_mut()
            .expect("invariant: a block was pushed just now")
    }

    /// Counts cells that were appended and puts them into the group with this tag.
    pub fn appended(&mut self, count: u32, dim: u8, groups: &[i64]) {
        let (start, end) = (self.cells, self.cells + count);
        for &tag in groups {
            self.group(dim, tag).cells.extend(start..end);
        }
        self.cells = end;
    }

    /// The group with this tag, which is created if necessary.
    pub fn group(&mut self, dim: u8, tag: i64) -> &mut Group {
        let group = self.groups.entry((dim, tag));
        group.or_insert_with(|| Group::new(dim, tag))
    }

    /// The cells by their numbers, once they are complete.
    pub fn index_cells(&mut self) -> &CellIndex {
        let mesh = &self.mesh;
        self.cell_index.get_or_insert_with(|| {
            let tags: Vec<u64> = mesh.cell_tags().collect();
            CellIndex {
                // Duplicates were refused when the cells were complete.
                by_tag: Lookup::new(&tags).unwrap_or(Lookup::Sparse(HashMap::new())),
                kinds: mesh.cells().map(|(_, kind, _)| kind).collect(),
            }
        })
    }

    /// Appends a cell of known points, with its number and the tag of its group; 0 for none. Its index.
    pub fn cell(&mut self, kind: CellKind, nodes: &[u32], number: u64, tag: i64) -> u32 {
        self.block(kind).nodes.to_mut().extend_from_slice(nodes);
        self.numbers.push(number);
        self.appended(1, kind.dim(), &[tag][usize::from(tag == 0)..]);
        if let (Some(sides), Some(key)) = (&mut self.sides, key(kind, nodes)) {
            sides.entry(key).or_insert(self.cells - 1);
        }
        self.cells - 1
    }

    /// The number of a cell that the file does not number.
    pub fn new_number(&self) -> u64 {
        self.numbers
            .next()
            .unwrap_or(self.numbers.highest.saturating_add(1))
    }

    /// The cell with these points: one that is there, or else a new one.
    pub fn side(&mut self, kind: CellKind, nodes: &[u32]) -> u32 {
        let mesh = &self.mesh;
        let all = || {
            let keyed = mesh
                .cells()
                .filter_map(|(cell, kind, nodes)| Some((key(kind, nodes)?, cell)));
            // Of several cells with the same corners the first.
            keyed.fold(HashMap::new(), |mut all, (key, cell)| {
                all.entry(key).or_insert(cell);
                all
            })
        };
        let sides = self.sides.get_or_insert_with(all);
        let known = key(kind, nodes).and_then(|key| sides.get(&key).copied());
        known.unwrap_or_else(|| self.cell(kind, nodes, self.new_number(), 0))
    }

    /// Adds cells to the set of this name, which is created if necessary.
    pub fn set(&mut self, name: &str, cells: impl IntoIterator<Item = u32>) {
        let next = self.sets.len();
        let known = *self.set_of_name.entry(name.to_owned()).or_insert(next);
        if known == next {
            self.sets.push((name.to_owned(), None, Vec::new()));
        }
        if let Some((.., set)) = self.sets.get_mut(known) {
            set.extend(cells);
        }
    }

    /// Adds a set with a name and a number, which is that of its groups where no other has it.
    pub fn numbered_set(&mut self, name: String, number: i64, cells: Vec<u32>) {
        self.sets.push((name, Some(number), cells));
    }

    /// Turns the sets into groups, one for each dimension of their cells, numbered in their order.
    fn group_sets(&mut self) {
        let sets = std::mem::take(&mut self.sets);
        if sets.is_empty() {
            return;
        }
        let dims: Vec<u8> = self.mesh.cells().map(|(_, kind, _)| kind.dim()).collect();
        for (name, number, mut cells) in sets {
            cells.sort_unstable();
            cells.dedup();
            for dim in 0..=3 {
                let of_dim = |cell: &u32| dims.get(*cell as usize) == Some(&dim);
                let cells: Vec<u32> = cells.iter().copied().filter(of_dim).collect();
                if !cells.is_empty() {
                    let last = self.groups.range((dim, 1)..=(dim, i64::MAX)).next_back();
                    let next = last.map_or(1, |(&(_, tag), _)| tag.saturating_add(1));
                    let free = |tag: &i64| !self.groups.contains_key(&(dim, *tag));
                    let tag = number.filter(free).unwrap_or(next);
                    let group = self.group(dim, tag);
                    (group.name, group.cells) =
                        (Some(name.clone()).filter(|name| !name.is_empty()), cells);
                }
            }
        }
    }

    pub fn cell_count(&self) -> u32 {
        self.cells
    }

    /// Names a group that has no name yet, as Gmsh does; its name.
    pub fn name(&mut self, dim: Option<u8>, tag: i64, name: String) -> &str {
        self.names.entry((dim, tag)).or_insert(name)
    }

    /// MSH 1 and 2 mark elements that are reversed by a minus sign before the number of their group, 4 does so once for
    /// an entity. `reversed` counts the former; if they are all cells of an entity, the entity is marked. Returns the
    /// number of marks that cannot be expressed so.
    pub fn reverse_groups(&mut self, reversed: &HashMap<EntityGroup, usize>) -> usize {
        if reversed.is_empty() {
            return 0;
        }
        let mesh = &mut self.mesh;
        let mut entities: BTreeMap<(u8, i32), (usize, Entity)> = BTreeMap::new();
        for &(dim, tag, group) in reversed.keys() {
            let entity = entities.entry((dim, tag));
            let (_, entity) = entity.or_insert_with(|| (0, Entity::without_points(dim, tag)));
            // The number is that of a 32-bit tag.
            entity.physicals.push(-group as i32);
        }
        for block in &mesh.blocks {
            for (cell, &entity) in block.cells().zip(&block.entities) {
                let Some((cells, entity)) = entities.get_mut(&(block.kind.dim(), entity)) else {
                    continue;
                };
                *cells += 1;
                let points = cell
                    .iter()
                    .filter_map(|&node| mesh.points.get(node as usize));
                points.for_each(|point| entity.extend(point));
            }
        }
        let mut mixed = reversed.values().sum();
        for (cells, entity) in entities.into_values() {
            if let &[group] = entity.physicals.as_slice()
                && reversed.get(&(entity.dim, entity.tag, -i64::from(group))) == Some(&cells)
            {
                mixed -= cells;
                mesh.geometry.entities.push(entity);
            }
        }
        mixed
    }

    /// Takes the numbers of all cells, which must be different.
    pub fn finish_cells(&mut self, scan: &Scan<'_>) -> Result<()> {
        let mut tags = std::mem::take(&mut self.numbers).own;
        if tags.is_empty() {
            return Ok(());
        }
        if !tags.is_sorted_by(|a, b| a < b) {
            Lookup::new(&tags).map_err(|tag| scan.error(format!("element {tag} appears twice")))?;
        }
        for block in self.mesh.blocks.iter_mut().rev() {
            block.tags = tags.split_off(tags.len().saturating_sub(block.len()));
        }
        Ok(())
    }

    /// The mesh with its groups named; a name without cells becomes a group without cells.
    pub fn finish(mut self) -> Mesh {
        self.group_sets();
        let mut names_of_any: HashMap<i64, String> = HashMap::new();
        for ((dim, tag), name) in std::mem::take(&mut self.names) {
            match dim {
                // Our writers give an empty name to a group that has neither name nor cells.
                Some(dim) => self.group(dim, tag).name = Some(name).filter(|name| !name.is_empty()),
                None => {
                    names_of_any.insert(tag, name);
                }
            }
        }
        for group in self
            .groups
            .values_mut()
            .filter(|group| group.name.is_none())
        {
            group.name = names_of_any.get(&group.tag).cloned();
        }
        self.mesh.groups = self.groups.into_values().collect();
        self.mesh
    }
}

/// The points of a cell in Gmsh's order, from the file's numbers of them, of which each has its place in that `order`.
pub fn points_in_order<N: Copy + Display + TryInto<u64>>(
    scan: &Scan<'_>,
    element: u64,
    nodes: &[N],
    order: &[usize],
    point: impl Fn(u64) -> Option<u32>,
) -> Result<Vec<u32>> {
    let mut points = vec![0; order.len()];
    for (&node, &place) in nodes.iter().zip(order) {
        let found = node.try_into().ok().and_then(&point);
        points[place] = found.ok_or_else(|| no_such_node(scan, element, node))?;
    }
    Ok(points)
}

#[cold]
pub fn no_such_node(scan: &Scan<'_>, element: impl Display, node: impl Display) -> Error {
    scan.error(format!(
        "element {element} has the node {node}, which does not exist"
    ))
}

/// The corners of a cell that may be a side, ascending.
fn key(kind: CellKind, nodes: &[u32]) -> Option<[u32; 4]> {
    let corners = nodes.get(..kind.shape().corners())?;
    let mut key = [u32::MAX; 4];
    key.get_mut(..corners.len())
        .filter(|_| kind.dim() < 3)?
        .copy_from_slice(corners);
    key.sort_unstable();
    Some(key)
}
