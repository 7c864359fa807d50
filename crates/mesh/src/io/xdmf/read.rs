//! Reads XDMF files.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use super::item::{Item, Items};
use super::tree::Tree;
use super::{GROUP, topology};
use crate::error::Result;
use crate::field::GlobalArray;
use crate::io::Content;
use crate::io::sets::Sets;
use crate::mesh::{CellBlock, Field, Support, Values};

/// A grid with a mesh of its own, at one time.
struct Grid {
    element: usize,
    name: String,
    time: Option<f64>,
    /// By these equal geometries and topologies are known; none where there is none.
    geometry: Option<String>,
    topology: Option<String>,
    parts: [Option<usize>; 2],
}

/// What has been read: where the points of each geometry and the cells of each topology are.
struct Reader<'a> {
    items: &'a Items<'a>,
    sets: Sets,
    points: HashMap<String, std::ops::Range<u32>>,
    cells: HashMap<String, std::ops::Range<u32>>,
    /// The topologies whose groups have been read.
    numbered: HashSet<String>,
    whole: Vec<GlobalArray>,
    unread: Vec<String>,
}

fn tree(path: &Path, bytes: &[u8]) -> Result<Tree> {
    let refuse = |what: String| {
        let remedy = "write the file again with the program it comes from";
        crate::Error::file(path, crate::Place::Whole, what, remedy)
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

/// Reads a file with its fields at all times at which the mesh is that of the first.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    read_at(path, bytes, None)
}

/// Reads the mesh and fields of one time, or of all.
pub fn read_at(path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
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
    let version = tree
        .all("Xdmf")
        .first()
        .and_then(|&root| tree.at(root).get("Version").map(str::to_owned));
    let (mesh, warnings) = reader.sets.finish();
    Ok(Content {
        mesh,
        whole: reader.whole,
        format: "xdmf".into(),
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
                others.extend(grid.time.map(f64::to_bits));
                continue;
            }
            self.attributes(grid)?;
        }
        if !others.is_empty() {
            self.unread.push(format!(
                "{} times, at which the mesh is another than at the first",
                others.len()
            ));
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
            all.extend(points);
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
                self.sets.block(CellBlock::new(kind, nodes));
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
            .map(|(kind, nodes)| (*kind, nodes))
            .eq(mesh.blocks.iter().map(|b| (b.kind, &b.nodes)));
        if points != mesh.points || !same_cells {
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

    fn attributes(&mut self, grid: &Grid) -> Result<()> {
        for attribute in self.attributes_of(grid)? {
            let element = self.items.tree.at(attribute);
            let name = element.get("Name").unwrap_or("unnamed").to_owned();
            if element
                .get("ItemType")
                .is_some_and(|kind| kind.eq_ignore_ascii_case("FiniteElementFunction"))
            {
                if let Err(what) = self.function(grid, attribute, &name)? {
                    self.unread.push(format!("the function {name:?}, {what}"));
                }
                continue;
            }
            let centre = element.get("Center").unwrap_or("Node").to_ascii_lowercase();
            let (on, range) = match centre.as_str() {
                "node" => (
                    Support::Points,
                    grid.geometry.as_ref().and_then(|key| self.points.get(key)),
                ),
                "cell" => (
                    Support::Cells,
                    grid.topology.as_ref().and_then(|key| self.cells.get(key)),
                ),
                "grid" => {
                    let item = self.items.only(attribute)?;
                    let (_, components) = item.rows();
                    if self.whole.iter().any(|known| known.name == name) {
                        continue;
                    }
                    self.whole.push(GlobalArray {
                        components: components.max(1),
                        ..GlobalArray::numbers(name, item.values())
                    });
                    continue;
                }
                other => {
                    self.unread
                        .push(format!("the attribute {name:?} on each {other}"));
                    continue;
                }
            };
            let range = range.ok_or_else(|| {
                self.refuse(grid, format!("{name:?} is on a mesh that is not there"))
            })?;
            let (range, item) = (range.clone(), self.items.only(attribute)?);
            if on == Support::Cells && name == GROUP && item.numbers.type_name.contains("Int") {
                self.numbered(grid, range, &item)?;
                continue;
            }
            self.field(grid, name, on, range, item)?;
        }
        Ok(())
    }

    fn field(
        &mut self,
        grid: &Grid,
        name: String,
        on: Support,
        range: std::ops::Range<u32>,
        item: Item,
    ) -> Result<()> {
        let values = item.numbers.len();
        let rows = range.len();
        if rows == 0 && values == 0 {
            return Ok(());
        }
        if rows == 0 || values == 0 || !values.is_multiple_of(rows) {
            return Err(self.refuse(grid, format!("{name:?} has {values} values on {rows} {on}")));
        }
        let all = match on {
            Support::Points => self.sets.mesh.points.len(),
            _ => self.sets.mesh.cell_count(),
        };
        let time = grid.time;
        // The parts of a spatial collection make one field.
        let fields = &mut self.sets.mesh.fields;
        let components = values / rows;
        let same = |field: &&mut Field| {
            (&field.name, field.on, field.time, field.components) == (&name, on, time, components)
                && field.at.last().is_some_and(|&last| last < range.start)
        };
        if let Some(known) = fields.iter_mut().rev().find(same) {
            known.at.extend(range);
            known.values = Values::F64([known.values.to_f64(), item.values().to_f64()].concat());
            if known.at.len() == all {
                known.at.clear();
            }
            return Ok(());
        }
        fields.push(Field {
            at: if rows == all {
                Vec::new()
            } else {
                range.collect()
            },
            time,
            ..Field::new(name, on, components, item.values())
        });
        Ok(())
    }

    /// A function of dolfin: values of degrees of freedom, and those of each cell. Of degree 0 and 1 they are values on cells and
    /// at the corners of cells.
    fn function(
        &mut self,
        grid: &Grid,
        attribute: usize,
        name: &str,
    ) -> Result<Result<(), String>> {
        let element = self.items.tree.at(attribute);
        let family = element.get("ElementFamily").unwrap_or_default();
        let degree = element.get("ElementDegree").unwrap_or_default();
        let items = self.items.of(attribute)?;
        let Some(range) = grid
            .topology
            .as_ref()
            .and_then(|key| self.cells.get(key))
            .cloned()
        else {
            return Ok(Err("whose mesh is not there".into()));
        };
        let is_lagrange = ["CG", "DG", "P", "Lagrange", "Discontinuous Lagrange"].contains(&family);
        if !is_lagrange || !["0", "1"].contains(&degree) || items.len() < 4 {
            return Ok(Err(format!(
                "an element {family} of degree {degree}, which is not read"
            )));
        }
        let numbers = |item: usize| -> Result<Vec<usize>> {
            let values = self
                .items
                .read(item)?
                .numbers
                .integers()
                .unwrap_or_default();
            Ok(values
                .into_iter()
                .map(|n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect())
        };
        let (dofs, starts, cells) = (numbers(items[0])?, numbers(items[2])?, numbers(items[3])?);
        let vector = self.items.read(items[1])?.values().to_f64();
        let mesh = &self.sets.mesh;
        let count = range.len();
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); count];
        for (k, &cell) in cells.iter().enumerate() {
            let of = starts
                .get(k)
                .zip(starts.get(k + 1))
                .and_then(|(&a, &b)| dofs.get(a..b));
            let values = of.and_then(|of| {
                of.iter()
                    .map(|&dof| vector.get(dof).copied())
                    .collect::<Option<Vec<f64>>>()
            });
            let (Some(values), Some(row)) = (values, rows.get_mut(cell)) else {
                return Ok(Err("whose degrees of freedom do not fit its cells".into()));
            };
            *row = values;
        }
        let sizes = range.clone().map(|cell| match degree {
            "0" => 1,
            _ => mesh.cell(cell).map_or(1, |(kind, _)| kind.points()),
        });
        let sizes: Vec<usize> = sizes.collect();
        let components = rows.first().map_or(1, |row| row.len() / sizes[0]).max(1);
        if rows
            .iter()
            .zip(&sizes)
            .any(|(row, &size)| row.len() != size * components)
        {
            return Ok(Err("whose degrees of freedom do not fit its cells".into()));
        }
        // The components stand one after another in a cell.
        let turned = rows.iter().zip(&sizes).flat_map(|(row, &size)| {
            (0..size).flat_map(move |node| (0..components).map(move |c| row[c * size + node]))
        });
        let on = if degree == "0" {
            Support::Cells
        } else {
            Support::CellPoints
        };
        let values = Values::F64(turned.collect());
        let all = count == mesh.cell_count();
        self.sets.mesh.fields.push(Field {
            at: if all { Vec::new() } else { range.collect() },
            time: grid.time,
            ..Field::new(name, on, components, values)
        });
        Ok(Ok(()))
    }

    /// The groups whose numbers stand on the cells, with the names in what else is told of the grid. Once for all times.
    fn numbered(&mut self, grid: &Grid, cells: std::ops::Range<u32>, item: &Item) -> Result<()> {
        if grid
            .topology
            .as_ref()
            .is_some_and(|key| !self.numbered.insert(key.clone()))
        {
            return Ok(());
        }
        let items = self.items;
        let mut names: BTreeMap<(u8, i64), String> = BTreeMap::new();
        for about in items
            .tree
            .named(grid.element, "Information")
            .map_err(|what| items.refuse(what))?
        {
            let Ok(inner) = Tree::parse(&items.tree.at(about).text) else {
                continue;
            };
            for name in inner.all("map").into_iter().map(|name| inner.at(name)) {
                let dim = name.get("dim").and_then(|dim| dim.parse().ok());
                if let (Some(key), Some(dim), Ok(tag)) =
                    (name.get("key"), dim, name.text.trim().parse())
                {
                    names.insert((dim, tag), key.to_owned());
                }
            }
        }
        let tags = item.numbers.integers().unwrap_or_default();
        let width = tags.len().checked_div(cells.len()).unwrap_or(0).max(1);
        let mut members: BTreeMap<(u8, i64), Vec<u32>> =
            names.keys().map(|key| (*key, Vec::new())).collect();
        let ends = self.sets.mesh.block_ends();
        let (mut cell, mut rest) = (cells.start, &tags[..]);
        while let Some(row) = rest.get(..width)
            && cell < cells.end
        {
            let block = ends.partition_point(|&end| end <= cell as usize);
            let dim = self.sets.mesh.blocks[block].kind.dim();
            let most = ends[block].min(cells.end as usize) - cell as usize;
            let rows = rest.chunks_exact(width).take(most);
            let same = rows.take_while(|other| *other == row).count();
            let run = cell..cell + same as u32;
            for &tag in row.iter().filter(|tag| **tag != 0) {
                members.entry((dim, tag)).or_default().extend(run.clone());
            }
            (cell, rest) = (run.end, rest.split_at(same * width).1);
        }
        for ((dim, tag), cells) in members {
            let name = names
                .get(&(dim, tag))
                .map(String::as_str)
                .unwrap_or_default();
            self.sets.cells(dim, tag, name, cells);
        }
        Ok(())
    }

    /// The sets of cells and nodes of a grid.
    fn sets(&mut self, grid: &Grid) -> Result<()> {
        let items = self.items;
        let sets = items
            .tree
            .named(grid.element, "Set")
            .map_err(|what| items.refuse(what))?;
        for (set, k) in sets.into_iter().zip(1..) {
            let element = items.tree.at(set);
            let name = element.get("Name").unwrap_or_default();
            let kind = element
                .get("SetType")
                .unwrap_or_default()
                .to_ascii_lowercase();
            let range = match kind.as_str() {
                "cell" => grid.topology.as_ref().and_then(|key| self.cells.get(key)),
                "node" => grid.geometry.as_ref().and_then(|key| self.points.get(key)),
                _ => {
                    self.unread.push(format!("the set {name:?} of each {kind}"));
                    continue;
                }
            };
            let range = range.cloned().unwrap_or(0..0);
            let numbers = items.only(set)?.numbers.integers().unwrap_or_default();
            let inside = |&n: &i64| {
                u32::try_from(n)
                    .ok()
                    .filter(|&n| (n as usize) < range.len())
                    .map(|n| range.start + n)
            };
            let found: Option<Vec<u32>> = numbers.iter().map(inside).collect();
            let found = found.ok_or_else(|| {
                self.refuse(
                    grid,
                    format!("the set {name:?} has a number beyond the last {kind}"),
                )
            })?;
            match kind.as_str() {
                "cell" => self.sets.cells(0, k, name, found),
                _ => self.sets.nodes(k, name, found),
            }
        }
        Ok(())
    }

    /// Whether a grid gives whole numbers to cells of its own.
    fn is_tags(&self, grid: &Grid) -> Result<bool> {
        let attributes = self.attributes_of(grid)?;
        let [one] = attributes[..] else {
            return Ok(false);
        };
        let element = self.items.tree.at(one);
        let on_cells = element
            .get("Center")
            .is_some_and(|centre| centre.eq_ignore_ascii_case("cell"));
        if grid.topology.is_none() || !on_cells || element.get("Name") != Some(&grid.name) {
            return Ok(false);
        }
        let place = self
            .items
            .of(one)?
            .first()
            .map(|&item| self.items.tree.at(item).text.clone());
        Ok(place.is_some_and(|place| place.contains("/MeshTags/")))
    }

    fn tags(&mut self, grid: &Grid) -> Result<()> {
        let (Some(key), Some(topology)) = (&grid.geometry, grid.parts[1]) else {
            return Ok(());
        };
        let points = self.points.get(key).cloned().unwrap_or(0..0);
        let attributes = self.attributes_of(grid)?;
        let Some(&attribute) = attributes.first() else {
            return Ok(());
        };
        let tags = self.items.only(attribute)?.numbers.integers();
        let tags = tags.ok_or_else(|| self.refuse(grid, "its tags are no whole numbers"))?;
        let blocks = topology::cells(self.items, topology, None, points.len(), points.start)?;
        let cells: Vec<_> = blocks
            .iter()
            .flat_map(|(kind, nodes)| nodes.chunks_exact(kind.points()).map(|cell| (*kind, cell)))
            .collect();
        if cells.len() != tags.len() {
            return Err(self.refuse(
                grid,
                format!("{} tags of {} cells", tags.len(), cells.len()),
            ));
        }
        let mut by_tag: BTreeMap<i64, Vec<_>> = BTreeMap::new();
        for (cell, tag) in cells.into_iter().zip(tags) {
            by_tag.entry(tag).or_default().push(cell);
        }
        for (tag, cells) in by_tag {
            let name = format!("{}_{tag}", grid.name);
            self.sets.given(tag, &name, cells);
        }
        Ok(())
    }
}
