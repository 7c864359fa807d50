//! Reads CGNS files.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use super::tree::{self, Node};
use super::{adf, cells};
use crate::error::Result;
use crate::io::polytopes::Lists;
use crate::io::raw::{self, Nodes};
use crate::io::sets::{self, Sets};
use crate::io::vtu::array::RawNumbers;
use crate::io::{Content, rows, vectors};
use crate::mesh::{CellBlock, CellKind, Field, Support};

struct Reader {
    sets: Sets,
    /// Cells by the names of the groups that they are in, each with its dimension: cells, nodes, and cells that may be missing.
    groups: Vec<(String, Members)>,
    names: BTreeMap<String, i64>,
    unread: Vec<String>,
}

#[derive(Clone)]
enum Members {
    Cells(Vec<u32>),
    Nodes(Vec<u32>),
    /// Parts of structured grids and faces of polyhedra: kinds and nodes.
    Given(Vec<(CellKind, Vec<u32>)>),
}

/// A zone that has been read.
struct Zone {
    /// Points along each dimension of a structured zone, the first running fastest.
    structure: Option<Vec<usize>>,
    points: Range<u32>,
    /// First and last number of the elements of a section, and its first cell.
    sections: Vec<(i64, i64, u32)>,
    /// The faces of polyhedra, from the number of the first on.
    faces: Vec<(i64, Lists)>,
    /// Those of the dimension of the base, which have the values.
    cells: Vec<u32>,
}

pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let opened;
    let root = match adf::is_adf(bytes) {
        true => {
            opened = adf::File::open(path, bytes)?;
            Node::Adf(&opened, opened.root()?)
        }
        false => tree::of_hdf5(path, bytes)?,
    };
    let bases = root.labelled("CGNSBase_t")?;
    let Some(base) = bases.first() else {
        return Err(root.refuse("there is no base (CGNSBase_t)"));
    };
    let mut reader = Reader {
        sets: Sets::default(),
        groups: Vec::new(),
        names: BTreeMap::new(),
        unread: bases
            .iter()
            .skip(1)
            .map(|base| format!("the base {:?}, a further one", base.name()))
            .collect(),
    };
    let dimension = base.integers()?.first().copied().unwrap_or(3).clamp(1, 3) as u8;
    let aliases = aliases(base)?;
    let times = match base.labelled("BaseIterativeData_t")?.first() {
        Some(data) => data
            .child("TimeValues")?
            .map(|times| times.values())
            .transpose()?
            .flatten(),
        None => None,
    };
    let times = times.map_or(Vec::new(), |times| times.to_f64());
    let nodes = base.labelled("Zone_t")?;
    let mut zones = Vec::new();
    for node in &nodes {
        zones.push(reader.zone(node, dimension)?);
    }
    for (node, zone) in nodes.iter().zip(&zones) {
        if nodes.len() > 1 {
            reader
                .groups
                .push((node.name().to_owned(), Members::Cells(zone.cells.clone())));
        }
        if let Some(family) = family(node)? {
            reader
                .groups
                .push((alias(&aliases, &family), Members::Cells(zone.cells.clone())));
        }
        reader.boundaries(node, zone, &aliases)?;
    }
    for (node, zone) in nodes.iter().zip(&zones) {
        reader.solutions(node, zone, &times)?;
        reader.sections(node, zone)?;
    }
    reader.finish_groups(dimension);
    let version = root
        .child("CGNSLibraryVersion")?
        .map(|node| node.values())
        .transpose()?
        .flatten();
    let version = version.and_then(|values| values.to_f64().first().map(|n| format!("{n:.1}")));
    let (mut mesh, warnings) = reader.sets.finish();
    vectors::join(&mut mesh.fields);
    Ok(Content {
        mesh,
        format: "cgns".into(),
        version,
        encoding: if adf::is_adf(bytes) {
            "adf".into()
        } else {
            "hdf5".into()
        },
        warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

/// The names that families give themselves.
fn aliases(base: &Node<'_>) -> Result<BTreeMap<String, String>> {
    let mut aliases = BTreeMap::new();
    for family in base.labelled("Family_t")? {
        if let Some(own) = family.labelled("FamilyName_t")?.first() {
            aliases.insert(family.name().to_owned(), own.name().to_owned());
        }
    }
    Ok(aliases)
}

fn alias(aliases: &BTreeMap<String, String>, family: &str) -> String {
    aliases
        .get(family)
        .cloned()
        .unwrap_or_else(|| family.to_owned())
}

fn family(node: &Node<'_>) -> Result<Option<String>> {
    match node.labelled("FamilyName_t")?.first() {
        Some(family) => Ok(family
            .texts(0)?
            .into_iter()
            .next()
            .filter(|text| !text.is_empty())),
        None => Ok(None),
    }
}

impl Reader {
    /// Reads the points and cells of a zone.
    fn zone(&mut self, node: &Node<'_>, dimension: u8) -> Result<Zone> {
        let sizes = node.integers()?;
        let is_structured = node
            .text_of("ZoneType")?
            .is_some_and(|kind| kind == "Structured");
        let rank = if is_structured { sizes.len() / 3 } else { 1 };
        let counts: Option<Vec<usize>> = sizes
            .iter()
            .take(rank)
            .map(|&n| usize::try_from(n).ok())
            .collect();
        let count = counts.as_ref().and_then(|counts| {
            counts
                .iter()
                .try_fold(1_usize, |all, &n| all.checked_mul(n))
        });
        let (Some(counts), Some(count), 1..=3) = (counts, count, rank) else {
            return Err(node.refuse(format!("the sizes {sizes:?} of a zone")));
        };
        let first = self.sets.mesh.points.len();
        let grids = node.labelled("GridCoordinates_t")?;
        if grids.len() > 1 {
            self.unread.push(format!(
                "{} further grids of the zone {:?}",
                grids.len() - 1,
                node.name()
            ));
        }
        let arrays = grids.first().map(|grid| grid.labelled("DataArray_t"));
        let (mut others, mut axes) = (Vec::new(), [None, None, None]);
        for array in arrays.transpose()?.unwrap_or_default() {
            let known = ["CoordinateX", "CoordinateY", "CoordinateZ"];
            let Some(axis) = known.iter().position(|axis| *axis == array.name()) else {
                others.push(array.name().to_owned());
                continue;
            };
            let numbers = array.raw()?.unwrap_or(RawNumbers::of::<f64>(Vec::new()));
            if numbers.len() != count {
                let what = format!("{} coordinates of {count} points", numbers.len());
                return Err(array.refuse(what));
            }
            axes[axis] = Some(numbers);
        }
        if axes.iter().all(Option::is_none) && count > 0 {
            let what = format!("there are no coordinates x, y, z (but {others:?})");
            return Err(node.refuse(what));
        }
        // Where an axis is missing its coordinates are 0.
        let none = RawNumbers::of::<f64>(Vec::new());
        let columns = axes
            .each_ref()
            .map(|axis| (axis.as_ref().unwrap_or(&none), 0));
        let points = raw::points(&columns, count);
        rows::append(&mut self.sets.mesh.points, points);
        let points = first as u32..(first + count) as u32;
        if is_structured {
            let slowest_first: Vec<usize> = counts.iter().rev().copied().collect();
            let (kind, nodes) = sets::grid(&slowest_first, points.start);
            let cells = self.sets.block(CellBlock::new(kind, nodes)).collect();
            return Ok(Zone {
                structure: Some(counts),
                points,
                sections: Vec::new(),
                faces: Vec::new(),
                cells,
            });
        }
        let all = node.labelled("Elements_t")?;
        let faces = faces(&all)?;
        let mut sections = Vec::new();
        for section in all {
            let first = self.sets.mesh.cell_count() as u32;
            let range = range(&section)?;
            if !self.elements(&section, &points, &faces)? {
                continue;
            }
            let count = self.sets.mesh.cell_count() as i64 - i64::from(first);
            match range[..] {
                [from, to] if to.checked_sub(from) == Some(count - 1) => {
                    sections.push((from, to, first));
                }
                _ => {
                    let what = format!("{count} elements of the numbers {range:?}");
                    return Err(section.refuse(what));
                }
            }
        }
        // Values stand in the order of the elements' numbers.
        sections.sort_unstable();
        let mut cells = Vec::new();
        for &(from, to, first) in &sections {
            let end = first + u32::try_from(to - from + 1).unwrap_or(0);
            let mut start = 0;
            for block in &self.sets.mesh.blocks {
                let of = start..start + block.len() as u32;
                start = of.end;
                if block.kind.dim() == dimension {
                    cells.extend(of.start.max(first)..of.end.min(end));
                }
            }
        }
        Ok(Zone {
            structure: None,
            points,
            sections,
            faces,
            cells,
        })
    }

    /// Reads a section of elements; false if there are no cells in it.
    fn elements(
        &mut self,
        section: &Node<'_>,
        points: &Range<u32>,
        faces: &[(i64, Lists)],
    ) -> Result<bool> {
        let number = section.integers()?.first().copied().unwrap_or(0);
        let refuse = |what| section.refuse(what);
        match number {
            // Where there are polyhedra, these are their faces.
            cells::NGON if !faces.is_empty() => return Ok(false),
            cells::NGON => {
                self.sets
                    .polygons(&lists(section)?, points)
                    .map_err(refuse)?;
                return Ok(true);
            }
            cells::NFACE => {
                let face = |number| Ok(face(faces, number, points)?.1);
                self.sets
                    .polyhedra(&lists(section)?, face)
                    .map_err(refuse)?;
                return Ok(true);
            }
            number if number != cells::MIXED && cells::kind(number).is_none() => {
                self.unread.push(format!(
                    "the section {:?} of elements of CGNS's type {number}",
                    section.name()
                ));
                return Ok(false);
            }
            _ => {}
        }
        let numbers = section.child("ElementConnectivity")?;
        let numbers = numbers.map(|nodes| nodes.raw()).transpose()?.flatten();
        let numbers = numbers.unwrap_or(RawNumbers::of::<i32>(Vec::new()));
        let mut add = |kind: CellKind, numbers: &RawNumbers<'_>| -> Result<()> {
            let nodes = numbers.nodes(&Nodes {
                base: 1,
                points: points.clone(),
                width: kind.points(),
                order: &cells::order(kind),
                by_place: false,
            });
            let nodes = nodes.map_err(|what| section.refuse(what))?;
            match self.sets.mesh.blocks.last_mut() {
                Some(last) if last.kind == kind => last.nodes.extend(nodes),
                _ => drop(self.sets.block(CellBlock::new(kind, nodes))),
            }
            Ok(())
        };
        if let Some(kind) = cells::kind(number) {
            if !numbers.len().is_multiple_of(kind.points()) {
                return Err(
                    section.refuse(format!("{} nodes do not make {kind} cells", numbers.len()))
                );
            }
            add(kind, &numbers)?;
            return Ok(true);
        }
        let numbers = numbers.integers();
        let numbers = numbers.ok_or_else(|| section.refuse("it does not hold whole numbers"))?;
        let mut rest = &numbers[..];
        // Consecutive cells of one kind.
        let mut runs: Vec<(CellKind, Vec<i64>)> = Vec::new();
        while let [number, tail @ ..] = rest {
            let kind = cells::kind(*number).ok_or_else(|| {
                section.refuse(format!("elements of CGNS's type {number} are not read"))
            })?;
            let Some((cell, others)) = tail.split_at_checked(kind.points()) else {
                return Err(section.refuse("its last element ends too early"));
            };
            match runs.last_mut() {
                Some((last, run)) if *last == kind => run.extend(cell),
                _ => runs.push((kind, cell.to_vec())),
            }
            rest = others;
        }
        for (kind, run) in runs {
            add(kind, &RawNumbers::of(run))?;
        }
        Ok(true)
    }

    fn boundaries(
        &mut self,
        node: &Node<'_>,
        zone: &Zone,
        aliases: &BTreeMap<String, String>,
    ) -> Result<()> {
        for list in node.labelled("ZoneBC_t")? {
            for boundary in list.labelled("BC_t")? {
                let Some(members) = self.members(&boundary, zone)? else {
                    self.unread.push(format!(
                        "the boundary condition {:?}, whose place is not understood",
                        boundary.name()
                    ));
                    continue;
                };
                let family = family(&boundary)?;
                let own = boundary.name().to_owned();
                match family {
                    Some(family) if family == own => {
                        self.groups.push((alias(aliases, &family), members))
                    }
                    Some(family) => {
                        let name = alias(aliases, &family);
                        if name != own {
                            self.groups.push((name, members.clone()));
                        }
                        self.groups.push((own, members));
                    }
                    None => self.groups.push((own, members)),
                }
            }
        }
        Ok(())
    }

    /// What a boundary condition is on.
    fn members(&self, boundary: &Node<'_>, zone: &Zone) -> Result<Option<Members>> {
        let mut place = None;
        for name in ["PointRange", "PointList", "ElementRange", "ElementList"] {
            if let Some(node) = boundary.child(name)? {
                place = Some((name, node.integers()?));
                break;
            }
        }
        let Some((name, numbers)) = place else {
            return Ok(None);
        };
        let location = boundary
            .text_of("GridLocation")?
            .unwrap_or_else(|| "Vertex".into());
        let on_nodes = location == "Vertex" && name.starts_with("Point");
        if let Some(structure) = &zone.structure {
            return Ok((name == "PointRange")
                .then(|| part_of_grid(structure, &numbers, &location, zone.points.start))
                .flatten());
        }
        let most = (self.sets.mesh.points.len() + self.sets.mesh.cell_count()) as i64;
        let listed: Vec<i64> = match (name.ends_with("Range"), &numbers[..]) {
            // No more than there are points and cells.
            (true, &[from, to]) if to.checked_sub(from).is_some_and(|n| n <= most) => {
                (from..=to).collect()
            }
            (true, _) => return Ok(None),
            (false, _) => numbers,
        };
        if on_nodes {
            let node = |&n: &i64| {
                u32::try_from(n.wrapping_sub(1))
                    .ok()
                    .filter(|&n| n < zone.points.len() as u32)
                    .map(|n| zone.points.start + n)
            };
            return Ok(listed
                .iter()
                .map(node)
                .collect::<Option<_>>()
                .map(Members::Nodes));
        }
        let cell = |&n: &i64| {
            let at = zone
                .sections
                .partition_point(|&(from, ..)| from <= n)
                .checked_sub(1)?;
            let (from, to, first) = zone.sections[at];
            (n <= to).then(|| first + (n - from) as u32)
        };
        let cells: Option<Vec<u32>> = listed.iter().map(cell).collect();
        let faces = || {
            let face = |&number: &i64| face(&zone.faces, number, &zone.points).ok();
            listed.iter().map(face).collect::<Option<_>>()
        };
        Ok(cells
            .map(Members::Cells)
            .or_else(|| faces().map(Members::Given)))
    }

    /// Solutions as fields, at the times that they are for.
    fn solutions(&mut self, node: &Node<'_>, zone: &Zone, times: &[f64]) -> Result<()> {
        let mut steps: BTreeMap<String, usize> = BTreeMap::new();
        for data in node.labelled("ZoneIterativeData_t")? {
            for pointers in data.children()? {
                if pointers.name().starts_with("FlowSolution")
                    && pointers.name().ends_with("Pointers")
                {
                    let width = pointers.shape()?.first().copied().unwrap_or(32);
                    steps.extend(pointers.texts(width)?.into_iter().zip(0..));
                }
            }
        }
        for solution in node.labelled("FlowSolution_t")? {
            let location = solution
                .text_of("GridLocation")?
                .unwrap_or_else(|| "Vertex".into());
            let (on, items): (_, Vec<u32>) = match location.as_str() {
                "Vertex" => (Support::Points, zone.points.clone().collect()),
                "CellCenter" => (Support::Cells, zone.cells.clone()),
                other => {
                    self.unread.push(format!(
                        "the solution {:?} on each {other}",
                        solution.name()
                    ));
                    continue;
                }
            };
            let step = steps.get(solution.name()).copied();
            let time = step.and_then(|step| times.get(step).copied());
            for array in solution.labelled("DataArray_t")? {
                let Some(values) = array
                    .values()?
                    .filter(|values| values.len() == items.len() && !items.is_empty())
                else {
                    self.unread.push(format!(
                        "{:?} of the solution {:?}, which is not of its size",
                        array.name(),
                        solution.name()
                    ));
                    continue;
                };
                let fields = &mut self.sets.mesh.fields;
                // The same of another zone continues a field.
                let same = |field: &&mut Field| {
                    (field.name.as_str(), field.on, field.time) == (array.name(), on, time)
                        && field
                            .at
                            .last()
                            .zip(items.first())
                            .is_some_and(|(last, first)| last < first)
                };
                if let Some(known) = fields.iter_mut().rev().find(same) {
                    known.at.extend(&items);
                    known.values =
                        crate::mesh::Values::F64([known.values.to_f64(), values.to_f64()].concat());
                    continue;
                }
                let taken = fields.iter().any(|field| {
                    (field.name.as_str(), field.on, field.time) == (array.name(), on, time)
                });
                let name = if taken {
                    format!("{} {}", solution.name(), array.name())
                } else {
                    array.name().to_owned()
                };
                // Cells of a section may have numbers that do not ascend with their places.
                let mut order: Vec<usize> = (0..items.len()).collect();
                order.sort_unstable_by_key(|&k| items[k]);
                let is_sorted = order.is_sorted();
                let values = match is_sorted {
                    true => values,
                    false => {
                        let all = values.to_f64();
                        crate::mesh::Values::F64(order.iter().map(|&k| all[k]).collect())
                    }
                };
                fields.push(Field {
                    at: order.iter().map(|&k| items[k]).collect(),
                    time,
                    step: step
                        .filter(|_| time.is_some())
                        .and_then(|step| i32::try_from(step + 1).ok()),
                    ..Field::new(name, on, 1, values)
                });
            }
        }
        Ok(())
    }

    /// Sections that no other group has the cells of are groups by their names.
    fn sections(&mut self, node: &Node<'_>, zone: &Zone) -> Result<()> {
        let mut covered = vec![false; self.sets.mesh.cell_count()];
        for (_, members) in &self.groups {
            if let Members::Cells(cells) = members {
                cells.iter().for_each(|&cell| covered[cell as usize] = true);
            }
        }
        let all = node.labelled("Elements_t")?;
        let named = all.iter().filter(|section| section.integers().is_ok());
        let mut found = Vec::new();
        for section in named {
            let range = range(section)?;
            let known = zone
                .sections
                .iter()
                .find(|(from, to, _)| range[..] == [*from, *to]);
            if let Some(&(from, to, first)) = known {
                let count = u32::try_from(to - from + 1).unwrap_or(0);
                let cells = first..first.saturating_add(count);
                let free = covered.get(cells.start as usize..cells.end as usize);
                let free = free.is_some_and(|of| !of.contains(&true));
                // Nodes are in sets of nodes.
                let is_node = self
                    .sets
                    .mesh
                    .cell(first)
                    .is_some_and(|(kind, _)| kind == CellKind::Vertex);
                if free && count > 0 && !is_node {
                    found.push((section.name().to_owned(), Members::Cells(cells.collect())));
                }
            }
        }
        self.groups.extend(found);
        Ok(())
    }

    /// Groups of one name are one, numbered in the order of the file.
    fn finish_groups(&mut self, dimension: u8) {
        for (name, members) in std::mem::take(&mut self.groups) {
            let next = self.names.len() as i64 + 1;
            let tag = *self.names.entry(name.clone()).or_insert(next);
            match members {
                Members::Cells(cells) => self.sets.cells(dimension, tag, &name, cells),
                Members::Nodes(nodes) => self.sets.nodes(tag, &name, nodes),
                Members::Given(cells) => {
                    let cells = cells.iter().map(|(kind, nodes)| (*kind, &nodes[..]));
                    self.sets.given(tag, &name, cells);
                }
            }
        }
        // A field of all points or cells names none of them.
        let (points, cells) = (self.sets.mesh.points.len(), self.sets.mesh.cell_count());
        for field in &mut self.sets.mesh.fields {
            if field.at.len()
                == if field.on == Support::Points {
                    points
                } else {
                    cells
                }
            {
                field.at.clear();
            }
        }
    }
}

/// The first and the last number of the elements of a section.
fn range(section: &Node<'_>) -> Result<Vec<i64>> {
    let range = section.child("ElementRange")?;
    Ok(range
        .map(|range| range.integers())
        .transpose()?
        .unwrap_or_default())
}

/// The faces of all polyhedra of a zone, from the number of the first on; none if there are no polyhedra.
fn faces(sections: &[Node<'_>]) -> Result<Vec<(i64, Lists)>> {
    let mut faces = Vec::new();
    let mut has_polyhedra = false;
    for section in sections {
        match section.integers()?.first() {
            Some(&cells::NFACE) => has_polyhedra = true,
            Some(&cells::NGON) => {
                faces.push((
                    range(section)?.first().copied().unwrap_or(1),
                    lists(section)?,
                ));
            }
            _ => {}
        }
    }
    faces.retain(|_| has_polyhedra);
    Ok(faces)
}

/// The kind and the corners of a face by its number.
fn face(
    faces: &[(i64, Lists)],
    number: i64,
    points: &Range<u32>,
) -> Result<(CellKind, Vec<u32>), String> {
    let of_section = |(first, lists): &(i64, Lists)| {
        let k = usize::try_from(number.checked_sub(*first)?).ok()?;
        (k < lists.len()).then(|| lists.face(k, points))
    };
    let found = faces.iter().find_map(of_section);
    found.unwrap_or_else(|| Err(format!("there is no face of the number {number}")))
}

/// The lists of a section, each with its length before it or, since CGNS 4, where they begin given apart.
fn lists(section: &Node<'_>) -> Result<Lists> {
    let numbers = section.child("ElementConnectivity")?;
    let mut numbers = numbers
        .map(|numbers| numbers.integers())
        .transpose()?
        .unwrap_or_default();
    let counts: Vec<i64> = match section.child("ElementStartOffset")? {
        Some(starts) => starts
            .integers()?
            .windows(2)
            .map(|pair| pair[1].saturating_sub(pair[0]))
            .collect(),
        None => {
            let (mut counts, mut at, mut items) = (Vec::new(), 0, Vec::new());
            while let Some(&count) = numbers.get(at) {
                let list = usize::try_from(count)
                    .ok()
                    .and_then(|count| numbers.get(at + 1..)?.get(..count));
                let list = list.ok_or_else(|| section.refuse("its last element ends too early"))?;
                counts.push(count);
                items.extend(list);
                at += 1 + list.len();
            }
            numbers = items;
            counts
        }
    };
    let mut lists = Lists::default();
    lists
        .append(numbers, counts)
        .map_err(|what| section.refuse(what))?;
    Ok(lists)
}

/// The cells of a part of a structured zone, given by its first and last indices of points, or of faces.
fn part_of_grid(structure: &[usize], range: &[i64], location: &str, first: u32) -> Option<Members> {
    let rank = structure.len();
    let (from, to) = range.split_at_checked(rank)?;
    let mut bounds = Vec::new();
    for axis in 0..rank {
        let (mut low, mut high) = (from[axis].min(*to.get(axis)?), from[axis].max(to[axis]));
        // Faces have the points at both of their ends, but for the direction in which they lie.
        if location != "Vertex" && low != high {
            high = high.saturating_add(1);
        }
        let last = structure[axis] as i64;
        (low, high) = (low.clamp(1, last.max(1)), high.clamp(1, last.max(1)));
        bounds.push((
            usize::try_from(low - 1).ok()?,
            usize::try_from(high - 1).ok()?,
        ));
    }
    let counts: Vec<usize> = bounds
        .iter()
        .rev()
        .map(|&(low, high)| high.saturating_sub(low) + 1)
        .collect();
    let (kind, places) = sets::grid(&counts, 0);
    let nodes = places.into_iter().map(|place| {
        let (mut rest, mut stride, mut node) = (place as usize, 1, 0);
        for (axis, &(low, high)) in bounds.iter().enumerate() {
            let count = high.saturating_sub(low) + 1;
            node += (low + rest % count) * stride;
            rest /= count;
            stride *= structure[axis];
        }
        first + node as u32
    });
    let nodes: Vec<u32> = nodes.collect();
    let end = structure.iter().product::<usize>() as u32;
    nodes.iter().all(|&node| node - first < end).then(|| {
        let cells = nodes.chunks_exact(kind.points());
        Members::Given(cells.map(|cell| (kind, cell.to_vec())).collect())
    })
}
