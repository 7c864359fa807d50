//! Points and cells of what a legacy file has.

use std::collections::{HashMap, HashSet};

use super::read::{Lists, POLYGONS, Reader};
use crate::error::Result;
use crate::field::to_i64;
use crate::io::raw::RawNumbers;
use crate::io::vtu::cells::POLYHEDRON;
use crate::io::vtu::grids::Extent;
use crate::io::vtu::lattice::Order;
use crate::io::vtu::topology::{Cells, Source, is_uneven};
use crate::io::vtu::xml::Grid;
use crate::mesh::{Field, Polyhedra, Support};

impl<'a> Reader<'a> {
    /// Makes points and cells of what was read.
    pub(super) fn assemble(&mut self, grid: Grid, before_5: bool) -> Result<()> {
        self.scan.section = "DATASET".into();
        let order = if before_5 {
            Order::VtkBefore
        } else {
            Order::Vtk
        };
        let mut points = std::mem::take(&mut self.points);
        let mut cells = Cells::default();
        match grid {
            Grid::Unstructured => {
                let (lists, codes) = (self.cells.take(), self.codes.take());
                match (lists, codes) {
                    (Some(lists), Some(codes)) => {
                        self.unstructured(&mut cells, lists, codes, order, points.len() as u64)?;
                    }
                    (None, None) => {}
                    _ => return Err(self.scan.error("of CELLS and CELL_TYPES one is missing")),
                }
            }
            Grid::Poly => {
                for ((name, code), lists) in
                    POLYGONS.into_iter().zip(std::mem::take(&mut self.sections))
                {
                    let Some(Lists { ends, nodes }) = lists else {
                        continue;
                    };
                    let codes = RawNumbers::of(vec![code; ends.len()]);
                    let appended =
                        cells.append(Source::plain(codes, ends, nodes), points.len() as u64);
                    appended.map_err(|(_, what)| self.scan.error(format!("{name}: {what}")))?;
                }
            }
            _ => {
                let ends = self
                    .dimensions
                    .map(|count| i64::try_from(count).unwrap_or(i64::MAX) - 1);
                let extent = Extent::new([0, ends[0], 0, ends[1], 0, ends[2]], &mut self.budget);
                let extent =
                    extent.map_err(|what| self.scan.error(format!("DIMENSIONS: {what}")))?;
                points = match grid {
                    Grid::Image => extent.image(&self.frame),
                    Grid::Rectilinear => extent.rectilinear(&self.axes),
                    _ => points,
                };
                if points.len() as u64 != extent.point_count() {
                    return Err(self
                        .scan
                        .error("POINTS and DIMENSIONS are of different numbers of points"));
                }
                cells = extent.cells();
            }
        }
        let misfit = |field: &Field| {
            let on_points = field.on == Support::Points;
            let count = if on_points { points.len() } else { cells.count };
            field.values.len() != count * field.components
        };
        if self.piece.fields.iter().any(misfit) {
            let (points, cells) = (points.len(), cells.count);
            let what = format!(
                "POINT_DATA or CELL_DATA is not of the {points} points and {cells} cells there are"
            );
            return Err(self.scan.error(what));
        }
        self.piece.points = points.into();
        let taken = self
            .piece
            .take_cells(cells, &mut self.budget, &mut self.out.warnings);
        taken.map_err(|what| self.scan.error(what))
    }

    pub(super) fn unstructured(
        &mut self,
        cells: &mut Cells,
        lists: Lists<'a>,
        codes: RawNumbers<'a>,
        order: Order,
        points: u64,
    ) -> Result<()> {
        let Lists {
            mut ends,
            mut nodes,
        } = lists;
        if ends.len() != codes.len() {
            let what = format!(
                "there are {} cells, and types of {}",
                ends.len(),
                codes.len()
            );
            return Err(self.scan.error(what));
        }
        let mut faces = HashMap::new();
        if codes.has(POLYHEDRON.into()) {
            let solids = solids(&codes, &ends, &nodes);
            let solids = solids.ok_or_else(|| {
                self.scan
                    .error("the faces of a polyhedron are not what they should be")
            })?;
            (ends, nodes) = (RawNumbers::of(solids.ends), RawNumbers::of(solids.nodes));
            faces = solids.faces;
        }
        let degrees = self.piece.fields.iter().find(|field| {
            let known = (field.on, &*field.name, field.components);
            known == (Support::Cells, "HigherOrderDegrees", 3)
        });
        let degrees = degrees.map_or(Vec::new(), |field| field.values.to_f64());
        let source = Source {
            codes,
            ends,
            nodes,
            order,
            uneven: &|cell| is_uneven(&degrees, cell),
            faces: &|cell| faces.get(&cell).cloned(),
        };
        let appended = cells.append(source, points);
        appended.map_err(|(part, what)| self.scan.error(format!("{part:?} of CELLS: {what}")))
    }
}

/// Cells of which some are polyhedra, whose lists are of faces.
#[derive(Default)]
struct Solids {
    ends: Vec<u32>,
    nodes: Vec<u32>,
    /// The number of corners of each face, and these, by cell.
    faces: HashMap<usize, Vec<u32>>,
}

/// `None` where a list is not one of faces.
fn solids(codes: &RawNumbers, ends: &RawNumbers, nodes: &RawNumbers) -> Option<Solids> {
    let [codes, ends, nodes] = [codes, ends, nodes].map(|numbers| to_i64(&numbers.values()));
    let nodes: Vec<u32> = nodes?
        .into_iter()
        .map(|node| u32::try_from(node).ok())
        .collect::<Option<_>>()?;
    let (mut solids, mut start) = (Solids::default(), 0);
    for (cell, (code, end)) in codes?.into_iter().zip(ends?).enumerate() {
        let end = usize::try_from(end).ok()?;
        let list = nodes.get(start..end)?;
        start = end;
        if code != i64::from(POLYHEDRON) {
            solids.nodes.extend_from_slice(list);
        } else {
            let (&count, faces) = list.split_first()?;
            Polyhedra::count_faces(faces).filter(|&faces| faces == count as usize)?;
            let first = solids.nodes.len();
            let mut rest = faces;
            let mut seen = HashSet::new();
            while let Some((&count, others)) = rest.split_first() {
                let (corners, others) = others.split_at_checked(count as usize)?;
                solids
                    .nodes
                    .extend(corners.iter().filter(|&&corner| seen.insert(corner)));
                rest = others;
            }
            if solids.nodes.len() == first {
                return None;
            }
            solids.faces.insert(cell, faces.to_vec());
        }
        solids.ends.push(u32::try_from(solids.nodes.len()).ok()?);
    }
    Some(solids)
}
