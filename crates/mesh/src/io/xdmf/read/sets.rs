//! Sets, and the numbers that cells have for their groups.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Grid, Reader};
use crate::error::Result;
use crate::field::Tell;
use crate::io::xdmf::item::Item;
use crate::io::xdmf::topology;
use crate::io::xdmf::tree::Tree;

impl Reader<'_> {
    /// The groups whose numbers are on the cells, with the names in the other data about the grid. Once for all times.
    pub(super) fn numbered(&mut self, grid: &Grid, cells: Range<u32>, item: &Item) -> Result<()> {
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
            let text = items.tree.at(about).text();
            let Ok(inner) = Tree::parse(&text) else {
                continue;
            };
            for name in inner.all("map").into_iter().map(|name| inner.at(name)) {
                let dim = name.get("dim").and_then(|dim| dim.parse().ok());
                if let (Some(key), Some(dim), Ok(tag)) =
                    (name.get("key"), dim, name.text().trim().parse())
                {
                    names.insert((dim, tag), key.to_owned());
                }
            }
        }
        let width = item.numbers.len().checked_div(cells.len());
        let width = width.unwrap_or(0).max(1);
        let runs = item.numbers.runs(width).unwrap_or_default();
        let mut members: BTreeMap<(u8, i64), Vec<Range<u32>>> =
            names.keys().map(|key| (*key, Vec::new())).collect();
        let ends = self.sets.mesh.block_ends();
        for (rows, tags) in runs.0.iter().zip(runs.1.chunks_exact(width)) {
            let [start, end] = [rows.start, rows.end].map(|row| cells.start.saturating_add(row));
            for (dim, part) in self.sets.of_blocks(&ends, start..end.min(cells.end)) {
                for &tag in tags.iter().filter(|tag| **tag != 0) {
                    members.entry((dim, tag)).or_default().push(part.clone());
                }
            }
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
    pub(super) fn sets(&mut self, grid: &Grid) -> Result<()> {
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
                    self.unread
                        .tell(name, format!("the set {name:?} of each {kind}"));
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
                "cell" => {
                    let cells = found.into_iter().map(|cell| cell..cell + 1);
                    self.sets.cells(0, k, name, cells);
                }
                _ => self.sets.nodes(k, name, found),
            }
        }
        Ok(())
    }

    /// Whether a grid gives integers to its own cells.
    pub(super) fn is_tags(&self, grid: &Grid) -> Result<bool> {
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
            .map(|&item| self.items.tree.at(item).text());
        Ok(place.is_some_and(|place| place.contains("/MeshTags/")))
    }

    pub(super) fn tags(&mut self, grid: &Grid) -> Result<()> {
        let (Some(key), Some(topology)) = (&grid.geometry, grid.parts[1]) else {
            return Ok(());
        };
        let points = self.points.get(key).cloned().unwrap_or(0..0);
        let attributes = self.attributes_of(grid)?;
        let Some(&attribute) = attributes.first() else {
            return Ok(());
        };
        let tags = self.items.only(attribute)?.numbers.integers();
        let tags = tags.ok_or_else(|| self.refuse(grid, "its tags are not integers"))?;
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
