//! Reads XDMF files.

mod fields;
mod sets;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::item::Items;
use super::topology;
use super::tree::Tree;
use crate::error::Result;
use crate::field::{GlobalArray, Tell, Unread};
use crate::io::Content;
use crate::io::sets::Sets;
use crate::mesh::CellBlock;

/// A grid with its own mesh, at one time.
struct Grid {
    element: usize,
    name: String,
    time: Option<f64>,
    /// These identify equal geometries and topologies; None if there is none.
    geometry: Option<String>,
    topology: Option<String>,
    parts: [Option<usize>; 2],
}

/// What has been read: the positions of the points of each geometry and of the cells of each topology.
struct Reader<'a> {
    items: &'a Items<'a>,
    sets: Sets,
    points: HashMap<String, std::ops::Range<u32>>,
    cells: HashMap<String, std::ops::Range<u32>>,
    /// The topologies whose groups have been read.
    numbered: HashSet<String>,
    whole: Vec<GlobalArray>,
    unread: Vec<Unread>,
}

fn tree<'a>(path: &Path, bytes: &'a [u8]) -> Result<Tree<'a>> {
    let refuse = |what: String| {
        let remedy = "write the file again with the program it comes from";
        crate::Error::whole(path, what, remedy)
    };
    let text = std::str::from_utf8(bytes).map_err(|_| refuse("the XML is not UTF-8".into()))?;
    let tree = Tree::parse(text).map_err(refuse)?;
    match tree.all("Domain").is_empty() {
        true => Err(refuse("there is no <Domain>".into())),
        false => Ok(tree),
    }
}

/// All times of a file.
pub fn times(path: &Path, bytes: &[u8]) -> Result<Vec<f64>> {
    let tree = tree(path, bytes)?;
    let items = Items::new(path, &tree);
    Ok(grids(&items)?.iter().filter_map(|grid| grid.time).collect())
}

/// Reads the mesh and fields of one time, or of all.
pub fn read(path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
    let tree = tree(path, bytes)?;
    let items = Items::new(path, &tree);
    let mut grids = grids(&items)?;
    if let Some(time) = time {
        grids.retain(|grid| grid.time.is_none_or(|at| at == time));
    }
    let mut reader = Reader {
        items: &items,
        sets: Sets::default(),
        points: HashMap::new(),
        cells: HashMap::new(),
        numbered: HashSet::new(),
        whole: Vec::new(),
        unread: Vec::new(),
    };
    reader.read(&grids)?;
    let domains = tree.all("Domain").len();
    if domains > 1 {
        let what = format!("{} further domains", domains - 1);
        reader.unread.tell("Domain", what);
    }
    let version = tree
        .all("Xdmf")
        .first()
        .and_then(|&root| tree.at(root).get("Version").map(str::to_owned));
    let (mesh, warnings) = reader.sets.finish();
    Ok(Content {
        mesh,
        whole: reader.whole,
        version,
        encoding: "xml".into(),
        warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

/// The grids of the first domain, those of collections one by one.
fn grids(items: &Items<'_>) -> Result<Vec<Grid>> {
    let tree = items.tree;
    let refuse = |what| items.refuse(what);
    let mut grids = Vec::new();
    let domain = tree.all("Domain").first().copied().unwrap_or(0);
    let top = tree.named(domain, "Grid").map_err(refuse)?;
    let mut waiting: Vec<(usize, Option<f64>, usize)> =
        top.into_iter().rev().map(|grid| (grid, None, 0)).collect();
    while let Some((element, time, depth)) = waiting.pop() {
        let grid = tree.at(element);
        let own = tree.named(element, "Time").map_err(refuse)?;
        let value = own
            .first()
            .and_then(|&time| tree.at(time).get("Value")?.parse().ok());
        let time = value.or(time).filter(|time: &f64| time.is_finite());
        let kind = grid
            .get("GridType")
            .or(grid.get("CollectionType"))
            .unwrap_or("Uniform");
        if kind.eq_ignore_ascii_case("uniform") {
            let part = |tag: &str| -> Result<Option<usize>> {
                Ok(tree.named(element, tag).map_err(refuse)?.first().copied())
            };
            let parts = [part("Geometry")?, part("Topology")?];
            let key =
                |part: Option<usize>| part.map(|part| tree.key(part).map_err(refuse)).transpose();
            let [geometry, topology] = [key(parts[0])?, key(parts[1])?];
            grids.push(Grid {
                element,
                name: grid.get("Name").unwrap_or_default().to_owned(),
                time,
                // Structured grids need both.
                topology: geometry
                    .as_ref()
                    .zip(topology)
                    .map(|(geometry, topology)| format!("{geometry}{topology}")),
                geometry,
                parts,
            });
            continue;
        }
        if depth > 16 {
            return Err(items.refuse("grids stand too deep in each other"));
        }
        let inner = tree.named(element, "Grid").map_err(refuse)?;
        let temporal = grid
            .get("CollectionType")
            .is_some_and(|kind| kind.eq_ignore_ascii_case("temporal"));
        let list = match own.first() {
            Some(&own) if temporal && value.is_none() => times_of(items, own, inner.len())?,
            _ => Vec::new(),
        };
        let each = inner
            .into_iter()
            .enumerate()
            .map(|(k, grid)| (grid, list.get(k).copied().or(time), depth + 1));
        waiting.extend(each.collect::<Vec<_>>().into_iter().rev());
    }
    Ok(grids)
}

/// The times of a collection that gives them in one: a list, or the first, the step and the count.
fn times_of(items: &Items<'_>, time: usize, count: usize) -> Result<Vec<f64>> {
    if items.of(time)?.is_empty() {
        return Ok(Vec::new());
    }
    let numbers = items.only(time)?.values().to_f64();
    Ok(
        match (
            items.tree.at(time).get("TimeType").unwrap_or("List"),
            &numbers[..],
        ) {
            ("HyperSlab", [first, step, ..]) => {
                (0..count).map(|k| first + step * k as f64).collect()
            }
            _ => numbers,
        },
    )
}

impl Reader<'_> {
    fn read(&mut self, grids: &[Grid]) -> Result<()> {
        let first = grids
            .iter()
            .filter(|grid| grid.topology.is_some())
            .find_map(|grid| grid.time);
        let is_base = |grid: &&Grid| grid.time.is_none() || grid.time == first;
        // Grids of tags give numbers to cells of another grid, or to sides of them.
        let mut shared: HashSet<&str> = HashSet::new();
        let mut tags = Vec::new();
        for grid in grids.iter().filter(is_base) {
            let geometry = grid.geometry.as_deref().unwrap_or_default();
            if !shared.insert(geometry) && self.is_tags(grid)? {
                tags.push(grid);
                continue;
            }
            self.mesh(grid)?;
        }
        let mut others = HashSet::new();
        for grid in grids
            .iter()
            .filter(|grid| !tags.iter().any(|tags| std::ptr::eq(*tags, *grid)))
        {
            if !is_base(&grid) && !self.is_known(grid)? {
                match grid.time {
                    Some(time) => drop(others.insert(time.to_bits())),
                    None => {
                        let what = format!("the grid {:?}, whose mesh is another", grid.name);
                        self.unread.tell(&grid.name, what);
                    }
                }
                continue;
            }
            self.attributes(grid)?;
        }
        if !others.is_empty() {
            self.unread.tell(
                "times",
                format!(
                    "{} times, at which the mesh is another than at the first",
                    others.len()
                ),
            );
        }
        for grid in tags {
            self.tags(grid)?;
        }
        for grid in grids.iter().filter(is_base) {
            self.sets(grid)?;
        }
        Ok(())
    }

    fn refuse(&self, grid: &Grid, what: impl std::fmt::Display) -> crate::Error {
        self.items
            .refuse(format!("the grid {:?}: {what}", grid.name))
    }

    /// Adds the points and cells of a grid, unless they are there.
    fn mesh(&mut self, grid: &Grid) -> Result<()> {
        let (Some(key), Some(geometry)) = (&grid.geometry, grid.parts[0]) else {
            return Ok(());
        };
        let structure = topology::structure(self.items, grid.parts[1])?;
        if !self.points.contains_key(key) {
            let points = topology::points(self.items, geometry, structure.as_deref())?;
            let all = &mut self.sets.mesh.points;
            let first = all.len() as u32;
            all.append(points);
            self.points.insert(key.clone(), first..all.len() as u32);
        }
        let points = self.points[key].clone();
        let (Some(key), Some(part)) = (&grid.topology, grid.parts[1]) else {
            return Ok(());
        };
        if !self.cells.contains_key(key) {
            let blocks = topology::cells(
                self.items,
                part,
                structure.as_deref(),
                points.len(),
                points.start,
            )?;
            let first = self.sets.mesh.cell_count() as u32;
            for (kind, nodes) in blocks {
                self.sets.block(CellBlock::of(kind, nodes));
            }
            self.cells
                .insert(key.clone(), first..self.sets.mesh.cell_count() as u32);
        }
        Ok(())
    }

    /// Whether the mesh of a grid is one that has been read, by its place in the file or by its numbers.
    fn is_known(&mut self, grid: &Grid) -> Result<bool> {
        let known = |key: &Option<String>, all: &HashMap<String, std::ops::Range<u32>>| {
            key.as_ref().is_none_or(|key| all.contains_key(key))
        };
        if known(&grid.geometry, &self.points) && known(&grid.topology, &self.cells) {
            return Ok(true);
        }
        let (Some(geometry), Some(topology)) = (grid.parts[0], grid.parts[1]) else {
            return Ok(false);
        };
        let (Some(at), Some(of)) = (&grid.geometry, &grid.topology) else {
            return Ok(false);
        };
        let structure = topology::structure(self.items, grid.parts[1])?;
        let points = topology::points(self.items, geometry, structure.as_deref())?;
        let blocks = topology::cells(self.items, topology, structure.as_deref(), points.len(), 0)?;
        let mesh = &self.sets.mesh;
        let same_cells = blocks
            .iter()
            .map(|(kind, nodes)| (*kind, &nodes[..]))
            .eq(mesh.blocks.iter().map(|b| (b.kind, &b.nodes[..])));
        if mesh.points != points || !same_cells {
            return Ok(false);
        }
        self.points.insert(at.clone(), 0..mesh.points.len() as u32);
        self.cells.insert(of.clone(), 0..mesh.cell_count() as u32);
        Ok(true)
    }

    fn attributes_of(&self, grid: &Grid) -> Result<Vec<usize>> {
        self.items
            .tree
            .named(grid.element, "Attribute")
            .map_err(|what| self.items.refuse(what))
    }
}
