//! Reads CGNS files.

mod boundaries;
mod polytopes;
mod solutions;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use boundaries::{alias, family};
use polytopes::{face, faces, lists};

use super::tree::{self, Node};
use super::{MIXED, NFACE, NGON, adf, kind_of};
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::polytopes::Lists;
use crate::io::raw::RawNumbers;
use crate::io::raw::{self, Nodes};
use crate::io::sets::{self, Runs, Sets};
use crate::io::sides::usual_order;
use crate::io::{Content, vectors};
use crate::mesh::{CellBlock, CellKind, Support};

/// The first and the last number of the elements of a section.
const RANGE: &str = "ElementRange";

struct Reader {
    sets: Sets,
    /// Cells by the names of the groups that they are in, each with its dimension: cells, nodes, and cells that may be missing.
    groups: Vec<(String, Members)>,
    names: BTreeMap<String, i64>,
    unread: Vec<Unread>,
}

#[derive(Clone)]
enum Members {
    Cells(Runs),
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
    cells: Runs,
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
        unread: Vec::new(),
    };
    for base in bases.iter().skip(1) {
        let what = format!("the base {:?}, a further one", base.name());
        reader.unread.tell(base.name(), what);
    }
    let dimension = base.integers()?.first().copied().unwrap_or(3).clamp(1, 3) as u8;
    let aliases = aliases(base)?;
    let times = match base.labelled("BaseIterativeData_t")?.first() {
        Some(data) => data.numbers_of("TimeValues")?,
        None => Vec::new(),
    };
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
    for child in root.children()? {
        if !bases.iter().skip(1).any(|base| base.name() == child.name()) {
            child.unread("", &mut reader.unread)?;
        }
    }
    if let Node::Hdf5(group, _) = &root {
        let links = group.links()?.into_iter();
        reader.unread.extend(links.map(|(name, target)| {
            let what = format!("the link /{name} to {target}");
            Unread::outside(name, what)
        }));
    }
    let version = root.numbers_of("CGNSLibraryVersion")?;
    let version = version.first().map(|n| format!("{n:.1}"));
    let (mut mesh, warnings) = reader.sets.finish();
    vectors::join(&mut mesh.fields);
    Ok(Content {
        mesh,
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
            self.unread.tell(
                node.name(),
                format!(
                    "{} further grids of the zone {:?}",
                    grids.len() - 1,
                    node.name()
                ),
            );
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
        self.sets.mesh.points.append(points);
        let points = first as u32..(first + count) as u32;
        if is_structured {
            let slowest_first: Vec<usize> = counts.iter().rev().copied().collect();
            let (kind, nodes) = sets::grid(&slowest_first, points.start);
            let cells = Runs(vec![self.sets.block(CellBlock::new(kind, nodes))]);
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
            let range = section.integers_of(RANGE)?;
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
        // Values are in the order of the elements' numbers.
        sections.sort_unstable();
        let mut cells = Runs::default();
        for &(from, to, first) in &sections {
            let end = first + u32::try_from(to - from + 1).unwrap_or(0);
            for (of, block) in self.sets.mesh.ranges() {
                if block.kind.dim() == dimension {
                    cells.push(of.start.max(first)..end.min(of.end));
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
            NGON if !faces.is_empty() => return Ok(false),
            NGON => {
                self.sets
                    .polygons(&lists(section)?, points)
                    .map_err(refuse)?;
                return Ok(true);
            }
            NFACE => {
                let face = |number| Ok(face(faces, number, points)?.1);
                self.sets
                    .polyhedra(&lists(section)?, face)
                    .map_err(refuse)?;
                return Ok(true);
            }
            number if number != MIXED && kind_of(number).is_none() => {
                self.unread.tell(
                    section.name(),
                    format!(
                        "the section {:?} of elements of CGNS's type {number}",
                        section.name()
                    ),
                );
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
                order: &usual_order(kind, false),
                by_place: false,
            });
            let nodes = nodes.map_err(|what| section.refuse(what))?;
            match self.sets.mesh.blocks.last_mut() {
                Some(last) if last.kind == kind => last.nodes.append(nodes),
                _ => drop(self.sets.block(CellBlock::of(kind, nodes))),
            }
            Ok(())
        };
        if let Some(kind) = kind_of(number) {
            if !numbers.len().is_multiple_of(kind.points()) {
                return Err(
                    section.refuse(format!("{} nodes do not make {kind} cells", numbers.len()))
                );
            }
            add(kind, &numbers)?;
            return Ok(true);
        }
        let numbers = numbers.integers();
        let numbers = numbers.ok_or_else(|| section.refuse("it does not contain integers"))?;
        let mut rest = &numbers[..];
        // Consecutive cells of one kind.
        let mut runs: Vec<(CellKind, Vec<i64>)> = Vec::new();
        while let [number, tail @ ..] = rest {
            let kind = kind_of(*number).ok_or_else(|| {
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

    /// Sections that no other group has the cells of are groups by their names.
    fn sections(&mut self, node: &Node<'_>, zone: &Zone) -> Result<()> {
        let mut covered = vec![false; self.sets.mesh.cell_count()];
        for (_, members) in &self.groups {
            if let Members::Cells(cells) = members {
                let runs = cells.0.iter().cloned();
                runs.for_each(|run| covered[run.start as usize..run.end as usize].fill(true));
            }
        }
        let all = node.labelled("Elements_t")?;
        let named = all.iter().filter(|section| section.integers().is_ok());
        let mut found = Vec::new();
        for section in named {
            let range = section.integers_of(RANGE)?;
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
                    found.push((section.name().to_owned(), Members::Cells(Runs(vec![cells]))));
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
                Members::Cells(cells) => self.sets.cells(dimension, tag, &name, cells.0),
                Members::Nodes(nodes) => self.sets.nodes(tag, &name, nodes),
                Members::Given(cells) => {
                    let cells = cells.iter().map(|(kind, nodes)| (*kind, &nodes[..]));
                    self.sets.given(tag, &name, cells);
                }
            }
        }
        // A field of all points or cells names none of them.
        let mesh = &mut self.sets.mesh;
        let all = [Support::Points, Support::Cells].map(|on| (on, mesh.items(on)));
        let fields = mesh.fields.iter_mut();
        fields
            .filter(|field| all.contains(&(field.on, field.at.len())))
            .for_each(|field| field.at.clear());
    }
}
