//! Reads Exodus files.

mod polytopes;
mod sets;
mod variables;

use std::collections::HashSet;
use std::path::Path;

use super::cells;
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::netcdf::File;
use crate::io::polytopes::Lists;
use crate::io::raw::RawNumbers;
use crate::io::raw::{self, Nodes};
use crate::io::sets::Sets;
use crate::io::{Content, vectors};
use crate::mesh::{Array, CellBlock, CellKind, Shape};

/// An element block of the file.
struct Block {
    /// None if there are no elements.
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
    unread: Vec<Unread>,
}

/// All times of a file, in the order of its steps.
pub fn times(path: &Path, bytes: &[u8]) -> Result<Vec<f64>> {
    let file = File::open(path, bytes)?;
    file.floats("time_whole")
}

/// Reads a file with its variables at one time, or at all.
pub fn read(path: &Path, bytes: &[u8], time: Option<f64>) -> Result<Content> {
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
    let times = reader.file.floats("time_whole")?;
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
        encoding,
        warnings,
        unread: reader.unread,
        ..Content::default()
    })
}

impl Reader<'_> {
    /// The integers of a variable; none if it is not there.
    fn integers(&self, name: &str) -> Result<Option<Vec<i64>>> {
        let numbers = self.file.raw(name, None)?.map(|numbers| {
            let what = || {
                self.file
                    .refuse(format!("{name} does not contain integers"))
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
                self.unread.tell(&connect, format!(
                    "the last {} of the {width} nodes of {count} elements {element}, which are {kind} here",
                    width - kind.points()
                ));
            }
            let of = Nodes {
                base: 1,
                points: 0..points as u32,
                width,
                order: &cells::order(kind),
                by_place: false,
            };
            let numbers = self.file.raw(&connect, None)?;
            let nodes = numbers.map_or(Ok(Array::default()), |numbers| numbers.nodes(&of));
            let nodes = nodes.map_err(|what| self.file.refuse(format!("{connect}: {what}")))?;
            let is_shell = cells::is_shell(&element, self.dimension);
            self.blocks.push(Block {
                shape: Some(kind.shape()),
                count,
                is_shell,
                tag,
                name,
            });
            self.sets.block(CellBlock::of(kind, nodes));
        }
        let mut first = 0;
        for block in &self.blocks {
            let cells = first..first + block.count as u32;
            first = cells.end;
            let dim = block.shape.map_or(self.dimension as u8, Shape::dim);
            self.sets.cells(dim, block.tag, &block.name, [cells]);
        }
        Ok(())
    }

    /// The kind of elements without a name.
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

    /// Reports what else is there.
    fn others(&mut self) -> Result<()> {
        for (names, what) in [
            ("name_nset_var", "node sets"),
            ("name_sset_var", "side sets"),
            ("name_elset_var", "element sets"),
            ("name_edge_var", "edges"),
            ("name_face_var", "faces"),
        ] {
            for name in self.file.texts(names)?.unwrap_or_default() {
                self.unread
                    .tell_once(&name, format!("the variable {name:?} on {what}"));
            }
        }
        let declared = self.file.dimension("num_nodes")?.unwrap_or(0);
        if self.sets.mesh.points.is_empty() && declared > 0 {
            let what = format!("the coordinates of {declared} nodes, which are not in the file");
            self.unread.tell_once("coord", what);
        }
        let declared = self.file.dimension("num_elem")?.unwrap_or(0);
        let found: usize = self.blocks.iter().map(|block| block.count).sum();
        if found != declared && declared > 0 {
            let what = format!("{declared} elements, of which the blocks of the file have {found}");
            self.unread.tell_once("num_elem", what);
        }
        for name in self.file.unread()? {
            let starts = |words: &[&str]| words.iter().any(|word| name.starts_with(word));
            // Lists of names, numbers and marks that the rest of the file does not need; and values reported above.
            let told = [
                "vals_nset",
                "vals_sset",
                "vals_elset",
                "vals_edge",
                "vals_face",
            ];
            // The numbers of the blocks of faces that polyhedra are made of.
            let is_of_faces = name == "fa_prop1" && self.faces.is_some();
            let is_harmless =
                HARMLESS.contains(&&*name) || name.ends_with("_var_tab") || is_of_faces;
            if is_harmless || starts(&told) {
                continue;
            }
            let what = if name.starts_with("dist_fact_") {
                // Default values that programs write.
                if self.file.floats(&name)?.iter().all(|&value| value == 1.0) {
                    continue;
                }
                "the distribution factors"
            } else if name.starts_with("attrib") {
                "the attributes of elements"
            } else {
                "the variable"
            };
            self.unread.tell_once(&name, format!("{what} {name}"));
        }
        for (name, target) in self.file.links()? {
            let what = format!("the link {name} to {target}");
            self.unread.push(Unread::outside(name, what));
        }
        Ok(())
    }
}

/// Variables about how a file was made or is sorted.
const HARMLESS: [&str; 14] = [
    "qa_records",
    "info_records",
    "coor_names",
    "elem_map",
    "eb_status",
    "ns_status",
    "ss_status",
    "els_status",
    "ed_status",
    "fa_status",
    "es_status",
    "fs_status",
    "ids_of_maps",
    "time_whole",
];
