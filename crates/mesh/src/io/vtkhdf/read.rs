//! Reads VTKHDF files.

use std::ops::Range;
use std::path::Path;

use crate::error::Result;
use crate::field::{GlobalArray, Tell, Unread, to_i64};
use crate::io::Content;
use crate::io::hdf5::{self, Data, Group};
use crate::io::raw::RawNumbers;
use crate::io::vtu::Decoded;
use crate::io::vtu::merge::{Piece, merge};
use crate::io::vtu::read::{new_faces, restore_texts};
use crate::io::vtu::topology::{Cells, Source};
use crate::io::vtu::unpack::Budget;
use crate::mesh::{Field, Support, Values};

/// The sections of polygonal data, and VTK's types of their cells.
const SECTIONS: [(&str, u8); 4] = [
    ("Vertices", 2),
    ("Lines", 4),
    ("Polygons", 7),
    ("Strips", 6),
];

/// Where the numbers of a step begin.
#[derive(Default, Clone, PartialEq)]
struct Start {
    part: usize,
    parts: usize,
    point: usize,
    /// In each section.
    cells: Vec<usize>,
    nodes: Vec<usize>,
}

struct Reader {
    root: Group,
    steps: Option<Group>,
    is_poly: bool,
    budget: Budget,
    unread: Vec<Unread>,
    warnings: Vec<String>,
}

fn open(path: &Path, bytes: &[u8]) -> Result<Reader> {
    let file = hdf5::open(path, bytes)?;
    let root = file
        .group("VTKHDF")?
        .ok_or_else(|| file.refuse("there is no group VTKHDF"))?;
    let kind = root.text("Type").unwrap_or_default();
    if !["UnstructuredGrid", "PolyData"].contains(&kind.as_str()) {
        return Err(root.refuse(format!(
            "data of VTK of the type {kind:?} are not read: only grids and polygonal data"
        )));
    }
    Ok(Reader {
        steps: root.group("Steps")?,
        root,
        is_poly: kind == "PolyData",
        budget: Budget::of_file(bytes.len()),
        unread: Vec::new(),
        warnings: Vec::new(),
    })
}

/// All times of a file, in the order of its steps.
pub fn times(path: &Path, bytes: &[u8]) -> Result<Vec<f64>> {
    open(path, bytes)?.times()
}

/// Reads the mesh and fields of one time, or of all.
pub fn read(path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
    let mut reader = open(path, bytes)?;
    let times = reader.times()?;
    let first = times
        .iter()
        .position(|at| time.is_none_or(|time| *at == time))
        .unwrap_or(0);
    let start = reader.start(first)?;
    let has_steps = reader.steps.is_some();
    let mut decoded = Decoded {
        pieces: reader.pieces(&start, first)?,
        whole: reader.whole(first)?,
        encoding: "binary-little".into(),
        ..Decoded::default()
    };
    // In a file with steps, only numbers about the mesh are there at all times; the restored mesh takes them out.
    let version = reader.root.integers("Version").unwrap_or_default();
    let version: Vec<String> = version.iter().map(i64::to_string).collect();
    let (mut others, mut fields) = (0, Vec::new());
    for (step, &at) in times
        .iter()
        .enumerate()
        .filter(|(_, at)| time.is_none_or(|time| **at == time))
    {
        if step == first {
            continue;
        }
        if reader.start(step)? != start {
            others += 1;
            continue;
        }
        let pieces = reader.pieces(&start, step)?;
        let merged = merge(pieces).map_err(|what| reader.root.refuse(what))?;
        fields.extend(merged.fields.into_iter().map(|field| Field {
            time: Some(at),
            step: i32::try_from(step + 1).ok(),
            ..field
        }));
    }
    if others > 0 {
        reader.unread.tell(
            "times",
            format!(
                "{others} of {} times, at which the mesh is another than at the first",
                times.len()
            ),
        );
    }
    // Parts without cells have one offset all the same.
    let name = |path: &str| {
        let name = path.rsplit('/').next().filter(|name| *name != "Offsets");
        name.map(str::to_owned)
    };
    reader.root.unread(&mut reader.unread, name)?;
    decoded.warnings = reader.warnings;
    decoded.unread = reader.unread;
    let mut content = decoded.content(path, "vtkhdf", Some(version.join(".")))?;
    let known = &mut content.mesh.fields;
    for field in known
        .iter_mut()
        .filter(|field| has_steps && field.time.is_none())
    {
        field.time = times.get(first).copied();
        field.step = i32::try_from(first + 1).ok();
    }
    let is_known = |field: &Field| {
        known
            .iter()
            .any(|other| (&other.name, other.on) == (&field.name, field.on))
    };
    fields.retain(is_known);
    known.append(&mut fields);
    Ok(content)
}

impl Reader {
    fn times(&self) -> Result<Vec<f64>> {
        match self.of_steps("Values")? {
            Some(data) => Ok(data.values()?.to_f64()),
            None => Ok(Vec::new()),
        }
    }

    /// The numbers of a data set that are not less than 0.
    fn counts(&self, data: &Data, values: &Values) -> Result<Vec<usize>> {
        let numbers = to_i64(values).ok_or_else(|| data.refuse("it does not contain integers"))?;
        let counts = numbers
            .into_iter()
            .map(|n| usize::try_from(n).ok().filter(|&n| n <= u32::MAX as usize));
        let counts: Option<Vec<usize>> = counts.collect();
        counts.ok_or_else(|| data.refuse("it holds a number that is negative or too large"))
    }

    fn numbers(&self, group: &Group, name: &str) -> Result<Vec<usize>> {
        let data = group.needed(name)?;
        self.counts(&data, &data.values()?)
    }

    /// The array of this name about the steps.
    fn of_steps(&self, name: &str) -> Result<Option<Data>> {
        match &self.steps {
            Some(steps) => steps.data(name),
            None => Ok(None),
        }
    }

    /// A row of an array of the steps; zeros if there is none.
    fn row(&self, name: &str, step: usize, width: usize) -> Result<Vec<usize>> {
        let mut row = match self.of_steps(name)? {
            Some(data) if step < data.rows().0 => {
                self.counts(&data, &data.some(step..step + 1)?)?
            }
            _ => Vec::new(),
        };
        row.resize(width, 0);
        Ok(row)
    }

    fn start(&self, step: usize) -> Result<Start> {
        let sections = if self.is_poly { SECTIONS.len() } else { 1 };
        let part = self.row("PartOffsets", step, 1)?[0];
        let parts = match &self.steps {
            Some(steps) if steps.data("NumberOfParts")?.is_some() => {
                self.row("NumberOfParts", step, 1)?[0]
            }
            // Up to where those of another step begin.
            Some(steps) => {
                let total = self.root.needed("NumberOfPoints")?.rows().0;
                let all = steps
                    .data("PartOffsets")?
                    .map(|data| self.counts(&data, &data.values()?))
                    .transpose()?;
                let next = all
                    .unwrap_or_default()
                    .into_iter()
                    .filter(|&next| next > part)
                    .min();
                next.unwrap_or(total).saturating_sub(part)
            }
            None => self.root.needed("NumberOfPoints")?.rows().0,
        };
        Ok(Start {
            part,
            parts,
            point: self.row("PointOffsets", step, 1)?[0],
            cells: self.row("CellOffsets", step, sections)?,
            nodes: self.row("ConnectivityIdOffsets", step, sections)?,
        })
    }

    /// The parts of a step.
    fn pieces(&mut self, start: &Start, step: usize) -> Result<Vec<Piece>> {
        let counts = self.numbers(&self.root, "NumberOfPoints")?;
        let places = self.root.needed("Points")?;
        let sections: Vec<(Group, Option<u8>)> = match self.is_poly {
            false => vec![(self.root.clone(), None)],
            true => {
                let mut groups = Vec::new();
                for (name, code) in SECTIONS {
                    let group = self.root.group(name)?;
                    groups.push((
                        group
                            .ok_or_else(|| self.root.refuse(format!("there is no group {name}")))?,
                        Some(code),
                    ));
                }
                groups
            }
        };
        let mut counted = Vec::new();
        for (group, _) in &sections {
            let numbers = |name: &str| self.numbers(group, name);
            counted.push([
                numbers("NumberOfCells")?,
                numbers("NumberOfConnectivityIds")?,
            ]);
        }
        let mut pieces = Vec::new();
        let mut point = start.point;
        let (mut cell, mut node) = (start.cells.clone(), start.nodes.clone());
        let mut data = [(Support::Points, 0), (Support::Cells, 0)];
        for part in start.part..start.part.saturating_add(start.parts) {
            let part_of = |all: &[usize], what: &str| {
                all.get(part)
                    .copied()
                    .ok_or_else(|| self.root.refuse(format!("{what} lacks the part {part}")))
            };
            let points = part_of(&counts, "NumberOfPoints")?;
            let mut cells = Cells::default();
            for (k, (group, code)) in sections.iter().enumerate() {
                let count = part_of(&counted[k][0], "NumberOfCells")?;
                let nodes = part_of(&counted[k][1], "NumberOfConnectivityIds")?;
                if count > 0 {
                    let lists = match code {
                        None => self.faces(part, cell[k]..cell[k] + count)?,
                        Some(_) => None,
                    };
                    let faces = |cell: usize| {
                        let lists = lists.as_ref()?.each_ref();
                        new_faces(lists.map(|list| Some(&list[..])), cell)
                    };
                    let data = |name: &str, rows| group.needed(name)?.raw(Some(rows));
                    let codes = match code {
                        Some(code) => RawNumbers::of(vec![*code; count]),
                        None => data("Types", cell[k]..cell[k] + count)?,
                    };
                    // Each part has one offset more than cells, the first being 0.
                    let first = cell[k] + part + 1;
                    if data("Offsets", first - 1..first)?.integers().as_deref() != Some(&[0]) {
                        return Err(group.refuse("the first offset of a part is not 0"));
                    }
                    let ends = data("Offsets", first..first + count)?;
                    let connectivity = data("Connectivity", node[k]..node[k] + nodes)?;
                    let source = Source {
                        faces: &faces,
                        ..Source::plain(codes, ends, connectivity)
                    };
                    cells
                        .append(source, points as u64)
                        .map_err(|(_, what)| group.refuse(what))?;
                }
                cell[k] += count;
                node[k] += nodes;
            }
            if places.rows().1 != 3 {
                return Err(places.refuse("points have three coordinates"));
            }
            let mut piece = Piece {
                points: places.raw(Some(point..point + points))?.points(3),
                ..Piece::default()
            };
            let sizes = [points, cells.count];
            for ((on, before), size) in data.iter_mut().zip(sizes) {
                piece.fields.extend(self.arrays(*on, step, *before, size)?);
                *before += size;
            }
            let taken = piece.take_cells(cells, &mut self.budget, &mut self.warnings);
            taken.map_err(|what| self.root.refuse(what))?;
            piece.leave_ghosts_out();
            pieces.push(piece);
            point += points;
        }
        Ok(pieces)
    }

    /// The faces of the polyhedra among the cells of a part, for [`new_faces`].
    fn faces(&self, part: usize, cells: Range<usize>) -> Result<Option<[Vec<u64>; 4]>> {
        if self.root.data("PolyhedronToFaces")?.is_none() {
            return Ok(None);
        }
        // Those of the parts before come first.
        let of_part = |name: &str| -> Result<Range<usize>> {
            let counts = self.numbers(&self.root, name)?;
            let first = counts.iter().take(part).sum();
            Ok(first..first + counts.get(part).copied().unwrap_or(0))
        };
        let list = |name: &str, rows: Range<usize>| -> Result<Vec<u64>> {
            let numbers = self.root.needed(name)?.raw(Some(rows))?.integers();
            let numbers = numbers.unwrap_or_default().into_iter();
            Ok(numbers.map(|n| n.try_into().unwrap_or(u64::MAX)).collect())
        };
        // Each part has one offset more than faces and cells, the first being 0.
        let ends = |of: Range<usize>| of.start + part + 1..of.end + part + 1;
        Ok(Some([
            list("FaceConnectivity", of_part("NumberOfFaceConnectivityIds")?)?,
            list("FaceOffsets", ends(of_part("NumberOfFaces")?))?,
            list("PolyhedronToFaces", of_part("NumberOfPolyhedronToFaceIds")?)?,
            list("PolyhedronOffsets", ends(cells))?,
        ]))
    }

    /// The arrays on the points or cells of a part; `before` is their number in the earlier parts of the step.
    fn arrays(
        &mut self,
        on: Support,
        step: usize,
        before: usize,
        size: usize,
    ) -> Result<Vec<Field>> {
        let folder = if on == Support::Points {
            "PointData"
        } else {
            "CellData"
        };
        let mut arrays = Vec::new();
        let Some(group) = self.root.group(folder)? else {
            return Ok(arrays);
        };
        for name in group.names()?.1 {
            let data = group.needed(&name)?;
            if data.is_text() {
                self.unread
                    .tell_once(&name, format!("the texts {name:?} on {on}"));
                continue;
            }
            let offsets = format!("{folder}Offsets/{name}");
            let first = self.row(&offsets, step, 1)?[0] + before;
            let (components, values) = (data.rows().1.max(1), data.some(first..first + size)?);
            arrays.push(Field::new(name, on, components, values));
        }
        Ok(arrays)
    }

    fn whole(&mut self, step: usize) -> Result<Vec<GlobalArray>> {
        let mut whole = Vec::new();
        let Some(group) = self.root.group("FieldData")? else {
            return Ok(whole);
        };
        for name in group.names()?.1 {
            let data = group.needed(&name)?;
            if data.is_text() {
                whole.push(GlobalArray::texts(name, data.texts()?));
                continue;
            }
            let rows = data.rows();
            let sizes = format!("FieldDataSizes/{name}");
            let size = self.row(&sizes, step, 2)?;
            let first = self.row(&format!("FieldDataOffsets/{name}"), step, 1)?[0];
            let has_steps = self.steps.is_some() && size[0] > 0;
            let values = match has_steps {
                true => data.some(first..first.saturating_add(size[1].max(1)))?,
                false => data.values()?,
            };
            whole.push(GlobalArray {
                components: rows.1.max(1),
                ..GlobalArray::numbers(name, values)
            });
        }
        restore_texts(&mut whole, &mut self.budget);
        Ok(whole)
    }
}
