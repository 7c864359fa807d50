//! Reads Exodus files.

use std::collections::HashSet;
use std::path::Path;

use super::cells;
use crate::error::Result;
use crate::field::GlobalArray;
use crate::io::netcdf::File;
use crate::io::polytopes::Lists;
use crate::io::raw::{self, Nodes};
use crate::io::sets::Sets;
use crate::io::vtu::array::RawNumbers;
use crate::io::{Content, vectors};
use crate::mesh::{CellBlock, CellKind, Field, Shape, Support, Values};

/// An element block of the file.
struct Block {
    /// None where there are no elements.
    shape: Option<Shape>,
    /// Number of elements.
    count: usize,
    is_shell: bool,
    tag: i64,
    name: String,
}

struct Reader<'a> {
    file: File<'a>,
    sets: Sets,
    blocks: Vec<Block>,
    dimension: usize,
    /// The corners of the faces of polyhedra.
    faces: Option<Lists>,
    unread: Vec<String>,
}

/// All times of a file, in the order of its steps.
pub fn times(path: &Path, bytes: &[u8]) -> Result<Vec<f64>> {
    let file = File::open(path, bytes)?;
    Ok(file
        .values("time_whole")?
        .map_or(Vec::new(), |times| times.to_f64()))
}

/// Reads a file with its variables at all times.
pub fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    read_at(path, bytes, None)
}

/// Reads a file with its variables at one time, or at all.
pub fn read_at(path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
    let file = File::open(path, bytes)?;
    let encoding = file.encoding();
    if file.dimension("num_nodes")?.is_none() && file.dimension("num_dim")?.is_none() {
        return Err(
            file.refuse("this is a netCDF file, but not of Exodus: it has no nodes (num_nodes)")
        );
    }
    let mut reader = Reader {
        file,
        sets: Sets::default(),
        blocks: Vec::new(),
        dimension: 0,
        faces: None,
        unread: Vec::new(),
    };
    reader.points()?;
    reader.blocks()?;
    reader.numbers()?;
    let times = reader
        .file
        .values("time_whole")?
        .map_or(Vec::new(), |times| times.to_f64());
    let mut whole = Vec::new();
    let steps: Vec<(usize, Option<f64>)> = match times.is_empty() {
        // Variables of files without time.
        true => vec![(0, None)],
        false => times.iter().copied().map(Some).enumerate().collect(),
    };
    for (step, at) in steps {
        if time.is_none() || at == time {
            reader.on_nodes(step, at)?;
            reader.on_elements(step, at)?;
        }
    }
    reader.globals(&times, time, &mut whole)?;
    reader.sides()?;
    reader.node_sets()?;
    reader.element_sets()?;
    reader.others()?;
    let (mut mesh, warnings) = reader.sets.finish();
    vectors::join(&mut mesh.fields);
    Ok(Content {
        mesh,
        whole,
        format: "exodus".into(),
        version: None,
        encoding,
        warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

impl Reader<'_> {
    /// The whole numbers of a variable; none if it is not there.
    fn integers(&self, name: &str) -> Result<Option<Vec<i64>>> {
        let numbers = self.file.raw(name, None)?.map(|numbers| {
            let what = || {
                self.file
                    .refuse(format!("{name} does not hold whole numbers"))
            };
            numbers.integers().ok_or_else(what)
        });
        numbers.transpose()
    }

    /// The numbers and names of sets, or of blocks. There are `count` of them, or as many as have numbers.
    fn numbers_and_names(&self, ids: &str, names: &str) -> Result<Vec<(i64, String)>> {
        let ids = self.integers(ids)?.unwrap_or_default();
        let names = self.file.texts(names)?.unwrap_or_default();
        let names = names.into_iter().chain(std::iter::repeat(String::new()));
        Ok(ids.into_iter().zip(names).collect())
    }

    fn points(&mut self) -> Result<()> {
        let (mut one_by_one, all) = (Vec::new(), self.file.raw("coord", None)?);
        for name in ["coordx", "coordy", "coordz"] {
            one_by_one.extend(self.file.raw(name, None)?);
        }
        let shape = self.file.shape("coord")?.unwrap_or_default();
        let mut columns: Vec<_> = one_by_one.iter().map(|column| (column, 0)).collect();
        let mut count = one_by_one.first().map_or(0, RawNumbers::len);
        if let ([axes, of_axis], Some(all), true) = (&shape[..], &all, columns.is_empty()) {
            columns = (0..*axes).map(|axis| (all, axis * of_axis)).collect();
            count = *of_axis;
        }
        // Some files of two dimensions have a third column all the same.
        let dimension = self.file.dimension("num_dim")?.unwrap_or(columns.len());
        self.dimension = dimension.clamp(1, 3);
        columns.truncate(self.dimension);
        if one_by_one
            .iter()
            .take(self.dimension)
            .any(|column| column.len() != count)
        {
            let what = "coordx, coordy and coordz are not of one length";
            return Err(self.file.refuse(what));
        }
        let nodes = self.file.dimension("num_nodes")?;
        if nodes.is_some_and(|nodes| nodes != count) && !columns.is_empty() {
            let what = format!("there are {count} coordinates for {nodes:?} nodes");
            return Err(self.file.refuse(what));
        }
        self.sets.mesh.points = raw::points(&columns, count);
        Ok(())
    }

    fn blocks(&mut self) -> Result<()> {
        let known = self.numbers_and_names("eb_prop1", "eb_names")?;
        let declared = self.file.dimension("num_el_blk")?.unwrap_or(known.len());
        let points = self.sets.mesh.points.len();
        // No more than there are variables for.
        let most = self.file.names()?.len() + known.len();
        for k in 0..declared.min(most) {
            let connect = format!("connect{}", k + 1);
            let (tag, name) = known
                .get(k)
                .cloned()
                .unwrap_or((k as i64 + 1, String::new()));
            let found = self.polytopes(k + 1)?;
            let Some(shape) = self.file.shape(&connect)?.filter(|_| found.is_none()) else {
                let (shape, count) = found.unzip();
                self.blocks.push(Block {
                    shape,
                    count: count.unwrap_or(0),
                    is_shell: false,
                    tag,
                    name,
                });
                continue;
            };
            let element = self
                .file
                .text(Some(&connect), "elem_type")?
                .unwrap_or_default();
            let [count, width] = shape[..] else {
                return Err(self.file.refuse(format!(
                    "{connect} is of elements {element:?} without a fixed number of nodes, which are not read"
                )));
            };
            let kind = match element.is_empty() {
                false => cells::kind(&element, width),
                true => self.guess(width),
            };
            let Some(kind) = kind else {
                let what = format!(
                    "{connect} has elements {element:?} of {width} nodes, which are not known"
                );
                return Err(self.file.refuse(what));
            };
            if width > kind.points() {
                self.unread.push(format!(
                    "the last {} of the {width} nodes of {count} elements {element}, which are {kind} here",
                    width - kind.points()
                ));
            }
            let places: Vec<usize> = (0..kind.points()).collect();
            let of = Nodes {
                base: 1,
                points: 0..points as u32,
                width,
                order: cells::order(kind).unwrap_or(&places),
                by_place: false,
            };
            let numbers = self.file.raw(&connect, None)?;
            let nodes = numbers.map_or(Ok(Vec::new()), |numbers| numbers.nodes(&of));
            let nodes = nodes.map_err(|what| self.file.refuse(format!("{connect}: {what}")))?;
            let is_shell = cells::is_shell(&element, self.dimension);
            self.blocks.push(Block {
                shape: Some(kind.shape()),
                count,
                is_shell,
                tag,
                name,
            });
            self.sets.block(CellBlock::new(kind, nodes));
        }
        let mut first = 0;
        for block in &self.blocks {
            let cells = first..first + block.count as u32;
            first = cells.end;
            let dim = block.shape.map_or(self.dimension as u8, Shape::dim);
            self.sets.cells(dim, block.tag, &block.name, cells);
        }
        Ok(())
    }

    /// Reads the k-th block if it is one of polygons (NSIDED) or polyhedra (NFACED); their shape and number.
    fn polytopes(&mut self, k: usize) -> Result<Option<(Shape, usize)>> {
        let Some(counts) = self.integers(&format!("ebepecnt{k}"))? else {
            return Ok(None);
        };
        let points = 0..self.sets.mesh.points.len() as u32;
        let (mut lists, mut block) = (Lists::default(), format!("connect{k}"));
        let (shape, added) = if let Some(nodes) = self.integers(&block)? {
            let added = lists
                .append(nodes, counts)
                .and_then(|()| self.sets.polygons(&lists, &points));
            (Shape::Polygon, added)
        } else {
            block = format!("facconn{k}");
            let numbers = self.integers(&block)?.unwrap_or_default();
            let faces = match self.faces.take() {
                Some(faces) => faces,
                None => self.faces()?,
            };
            let face = |number: i64| {
                let k = usize::try_from(number.wrapping_sub(1)).unwrap_or(usize::MAX);
                faces.face(k, &points).map(|(_, corners)| corners)
            };
            let added = lists
                .append(numbers, counts)
                .and_then(|()| self.sets.polyhedra(&lists, face));
            self.faces = Some(faces);
            (Shape::Polyhedron, added)
        };
        added.map_err(|what| self.file.refuse(format!("{block}: {what}")))?;
        Ok(Some((shape, lists.len())))
    }

    /// The corners of all faces of the blocks of faces.
    fn faces(&self) -> Result<Lists> {
        let mut faces = Lists::default();
        let declared = self.file.dimension("num_fa_blk")?.unwrap_or(0);
        for k in 1..=declared.min(self.file.names()?.len()) {
            let name = format!("fbconn{k}");
            let nodes = self.integers(&name)?.unwrap_or_default();
            let counts = match (
                self.integers(&format!("fbepecnt{k}"))?,
                self.file.shape(&name)?.as_deref(),
            ) {
                (Some(counts), _) => counts,
                (None, Some(&[_, width])) => {
                    vec![width as i64; nodes.len().checked_div(width).unwrap_or(0)]
                }
                _ => Vec::new(),
            };
            let appended = faces.append(nodes, counts);
            appended.map_err(|what| self.file.refuse(format!("{name}: {what}")))?;
        }
        Ok(faces)
    }

    /// What elements without a name are.
    fn guess(&self, nodes: usize) -> Option<CellKind> {
        let names: &[&str] = match self.dimension {
            3 => &["TETRA", "HEX", "WEDGE", "PYRAMID", "TRI", "QUAD", "BAR"],
            2 => &["TRI", "QUAD", "BAR"],
            _ => &["BAR"],
        };
        let kinds = names.iter().filter_map(|name| cells::kind(name, nodes));
        kinds.into_iter().find(|kind| kind.points() == nodes)
    }

    /// The file's numbers of nodes and elements, where they are other than 1, 2, 3, ….
    fn numbers(&mut self) -> Result<()> {
        let usual = |numbers: &[i64]| numbers.iter().zip(1..).all(|(&number, k)| number == k);
        let sound = |numbers: &[i64]| {
            let mut seen = HashSet::new();
            numbers.iter().all(|&number| number > 0)
                && (numbers.is_sorted_by(|a, b| a < b)
                    || numbers.iter().all(|number| seen.insert(number)))
        };
        let counts = [self.sets.mesh.points.len(), self.sets.mesh.cell_count()];
        for (name, count) in ["node_num_map", "elem_num_map"].into_iter().zip(counts) {
            let Some(numbers) = self.integers(name)?.filter(|numbers| !usual(numbers)) else {
                continue;
            };
            if numbers.len() != count || !sound(&numbers) {
                self.sets.warnings.push(format!(
                    "{name} is left out, as it does not number {count} items"
                ));
                continue;
            }
            let mut tags = numbers.into_iter().map(|number| number as u64);
            if name == "node_num_map" {
                self.sets.mesh.point_tags = tags.collect();
                continue;
            }
            for block in &mut self.sets.mesh.blocks {
                block.tags = tags.by_ref().take(block.len()).collect();
            }
        }
        Ok(())
    }

    /// A variable of the k-th of several; the old files have all of them in one.
    fn variable(&self, one: &str, all: &str, k: usize, step: usize) -> Result<Option<Values>> {
        if let Some(values) = self.file.row(one, step)? {
            return Ok(Some(values));
        }
        let shape = self.file.shape(all)?.unwrap_or_default();
        let [_, count, width] = shape[..] else {
            return Ok(None);
        };
        let values = self.file.row(all, step)?;
        Ok(values.filter(|_| k < count).map(|values| {
            Values::F64(
                values
                    .to_f64()
                    .into_iter()
                    .skip(k * width)
                    .take(width)
                    .collect(),
            )
        }))
    }

    fn on_nodes(&mut self, step: usize, time: Option<f64>) -> Result<()> {
        let points = self.sets.mesh.points.len();
        for (k, name) in self
            .file
            .texts("name_nod_var")?
            .unwrap_or_default()
            .into_iter()
            .enumerate()
        {
            let values =
                self.variable(&format!("vals_nod_var{}", k + 1), "vals_nod_var", k, step)?;
            match values.filter(|values| values.len() == points && points > 0) {
                Some(values) => self.add(Field::new(name, Support::Points, 1, values), step, time),
                None => self.tell(format!(
                    "the variable {name:?} on nodes, whose values are not there"
                )),
            }
        }
        Ok(())
    }

    fn tell(&mut self, what: String) {
        if !self.unread.contains(&what) {
            self.unread.push(what);
        }
    }

    fn add(&mut self, field: Field, step: usize, time: Option<f64>) {
        self.sets.mesh.fields.push(Field {
            time,
            step: time.and(i32::try_from(step + 1).ok()),
            ..field
        });
    }

    fn on_elements(&mut self, step: usize, time: Option<f64>) -> Result<()> {
        for (k, name) in self
            .file
            .texts("name_elem_var")?
            .unwrap_or_default()
            .into_iter()
            .enumerate()
        {
            let (mut at, mut parts) = (Vec::new(), Vec::new());
            let mut first = 0;
            for (b, block) in self.blocks.iter().enumerate() {
                let cells = first..first + block.count as u32;
                first = cells.end;
                // Where the truth table says no, there is no such variable.
                let found = self
                    .file
                    .row(&format!("vals_elem_var{}eb{}", k + 1, b + 1), step)?;
                if let Some(values) = found.filter(|values| values.len() == block.count) {
                    at.extend(cells);
                    parts.push(values);
                }
            }
            if at.is_empty() {
                self.tell(format!(
                    "the variable {name:?} on elements, whose values are not there"
                ));
                continue;
            }
            let at = if at.len() == first as usize {
                Vec::new()
            } else {
                at
            };
            let field = Field {
                at,
                ..Field::new(name, Support::Cells, 1, joined(parts))
            };
            self.add(field, step, time);
        }
        Ok(())
    }

    /// Variables of the whole: at one time, or a row for each time.
    fn globals(
        &mut self,
        times: &[f64],
        time: Option<f64>,
        whole: &mut Vec<GlobalArray>,
    ) -> Result<()> {
        let names = self.file.texts("name_glo_var")?.unwrap_or_default();
        let values = self
            .file
            .values("vals_glo_var")?
            .map_or(Vec::new(), |values| values.to_f64());
        let kept = |row: &usize| time.is_none() || times.get(*row).copied() == time;
        for (k, name) in names.iter().enumerate() {
            let rows = values.chunks_exact(names.len()).enumerate();
            let column = rows.filter(|(row, _)| kept(row)).map(|(_, row)| row[k]);
            whole.push(GlobalArray::numbers(name, Values::F64(column.collect())));
        }
        Ok(())
    }

    fn sides(&mut self) -> Result<()> {
        let mut ends = Vec::new();
        for block in &self.blocks {
            ends.push(ends.last().copied().unwrap_or(0) + block.count);
        }
        for (k, (tag, name)) in self
            .numbers_and_names("ss_prop1", "ss_names")?
            .into_iter()
            .enumerate()
        {
            let elements = self
                .integers(&format!("elem_ss{}", k + 1))?
                .unwrap_or_default();
            let numbers = self
                .integers(&format!("side_ss{}", k + 1))?
                .unwrap_or_default();
            let (mut sides, mut of_polytopes) = (Vec::with_capacity(elements.len()), 0);
            for (&element, &side) in elements.iter().zip(&numbers) {
                let cell = usize::try_from(element.wrapping_sub(1)).unwrap_or(usize::MAX);
                let block = self.blocks.get(ends.partition_point(|&end| end <= cell));
                if let Some(Shape::Polygon | Shape::Polyhedron) =
                    block.and_then(|block| block.shape)
                {
                    of_polytopes += 1;
                    continue;
                }
                let corners = block.and_then(|block| {
                    let all = cells::sides(block.shape?, block.is_shell);
                    all.get(usize::try_from(side.wrapping_sub(1)).ok()?)
                });
                let Some(corners) = corners else {
                    let what = format!(
                        "the side set {tag} names side {side} of element {element}, which is not there"
                    );
                    return Err(self.file.refuse(what));
                };
                sides.push((cell as u32, *corners));
            }
            let unknown = self.sets.sides(tag, &name, sides);
            for (count, of) in [
                (unknown, "cells of higher order"),
                (of_polytopes, "polygons and polyhedra"),
            ] {
                if count > 0 {
                    self.unread
                        .push(format!("{count} sides of the side set {tag}, of {of}"));
                }
            }
        }
        Ok(())
    }

    fn node_sets(&mut self) -> Result<()> {
        let points = self.sets.mesh.points.len();
        for (tag, name, nodes) in self.lists("ns", "node", points)? {
            self.sets.nodes(tag, &name, nodes);
        }
        Ok(())
    }

    fn element_sets(&mut self) -> Result<()> {
        let all = self.blocks.iter().map(|block| block.count).sum();
        let dim = self.sets.mesh.dim();
        for (tag, name, elements) in self.lists("els", "elem", all)? {
            self.sets.cells(dim, tag, &name, elements);
        }
        Ok(())
    }

    /// The number, the name and the members of each set of a kind, of which there are so many things in the file.
    fn lists(&self, kind: &str, of: &str, count: usize) -> Result<Vec<(i64, String, Vec<u32>)>> {
        let known = self.numbers_and_names(&format!("{kind}_prop1"), &format!("{kind}_names"))?;
        let sets = known.into_iter().zip(1..).map(|((tag, name), k)| {
            let numbers = self.integers(&format!("{of}_{kind}{k}"))?;
            let index = |number: i64| {
                let index = u32::try_from(number.wrapping_sub(1)).ok();
                index
                    .filter(|&index| (index as usize) < count)
                    .ok_or_else(|| {
                        let thing = if of == "node" { "node" } else { "element" };
                        let what =
                            format!("the {thing} set {tag} names the {thing} {number} of {count}");
                        self.file.refuse(what)
                    })
            };
            let members = numbers.unwrap_or_default().into_iter().map(index);
            Ok((tag, name, members.collect::<Result<_>>()?))
        });
        sets.collect()
    }

    /// Tells what else is there.
    fn others(&mut self) -> Result<()> {
        let kinds: [(&str, &str); 9] = [
            ("name_nset_var", "variables on node sets"),
            ("name_sset_var", "variables on side sets"),
            ("name_elset_var", "variables on element sets"),
            ("name_edge_var", "variables on edges"),
            ("name_face_var", "variables on faces"),
            ("ed_prop1", "edge blocks"),
            ("fa_prop1", "face blocks"),
            ("es_prop1", "edge sets"),
            ("fs_prop1", "face sets"),
        ];
        let used = |variable: &str| variable == "fa_prop1" && self.faces.is_some();
        for (variable, what) in kinds.into_iter().filter(|(variable, _)| !used(variable)) {
            if let Some(shape) = self.file.shape(variable)? {
                self.unread
                    .push(format!("{} {what}", shape.first().unwrap_or(&0)));
            }
        }
        let names = self.file.names()?;
        let of = |word: &str| names.iter().filter(|name| name.starts_with(word)).count();
        for (word, what) in [
            ("dist_fact_", "lists of distribution factors of sets"),
            ("attrib", "lists of attributes of elements"),
        ] {
            let count = of(word);
            if count > 0 {
                self.unread.push(format!("{count} {what}"));
            }
        }
        Ok(())
    }
}

/// Parts of one type one after another, of several as binary64.
fn joined(mut parts: Vec<Values>) -> Values {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    if parts.iter().all(|part| matches!(part, Values::F32(_))) {
        let parts = parts.into_iter().filter_map(|part| match part {
            Values::F32(values) => Some(values),
            _ => None,
        });
        return Values::F32(parts.flatten().collect());
    }
    Values::F64(parts.iter().flat_map(Values::to_f64).collect())
}
