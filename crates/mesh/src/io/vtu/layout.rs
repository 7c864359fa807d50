//! How a mesh is stored in a VTU file without loss.
//!
//! VTU has points, cells and arrays, but no groups, no numbers of points and cells, no blocks, and no field on a
//! part of the points or cells. They are stored as arrays, under meshio's names where there are such, so that its
//! users find their groups.

use super::cells::{block_code, vtk_type};
use super::column::{Column, GroupTags, Width};
use super::sections;
use super::xml::MAX_ARRAYS_IN_SECTION;
use crate::field::{GlobalArray, GlobalValues, data::with_numbers};
use crate::io::scalar::Scalar;
use crate::mesh::{CellBlock, CellGroups, CellKind, Field, Geometry, Group, Mesh, Support, Values};
use std::borrow::Cow;
use std::collections::HashSet;

/// How the cells are written.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Topology {
    /// As cells of any type.
    Cells,
    /// As the sections of polygonal data.
    Sections,
}

/// Prefix of the arrays below, except meshio's.
const RESERVED: &str = "faceoff:";
/// Own numbers of points, on points.
pub(super) const POINT_TAG: &str = "faceoff:point_tag";
/// Own numbers of cells, on cells.
pub(super) const CELL_TAG: &str = "faceoff:cell_tag";
/// Elementary entity of each cell, on cells; meshio's name.
pub(super) const ENTITY: &str = "gmsh:geometrical";
/// Tags of the groups that hold a cell, on cells; as many components as groups overlap; meshio's name.
pub(super) const GROUP: &str = "gmsh:physical";
/// The value in [`GROUP`] that stands for no (further) group: 0 unless a group has the tag 0.
pub(super) const NO_GROUP: &str = "faceoff:no_group";
/// Dimension, tag, and name of each group: 0 for none, 1 for one in [`GROUP_NAMES`], 2 if besides an array about
/// the whole has that name and holds tag and dimension, which is where meshio looks for it.
pub(super) const GROUPS: &str = "faceoff:groups";
/// Name of each group of [`GROUPS`].
pub(super) const GROUP_NAMES: &str = "faceoff:group_names";
/// VTK type (plus 256 times the number of points, where the type has any), number of cells, 1 for own cell numbers, 1 for entities, of each block.
pub(super) const BLOCKS: &str = "faceoff:blocks";
/// For each field that a plain array cannot represent: support (0 points, 1 cells, 2 nodes of each cell),
/// 1 for a time, 1 for a step, the step, length of its list in [`FIELD_AT`].
pub(super) const FIELDS: &str = "faceoff:fields";
/// The array that holds each field of [`FIELDS`].
pub(super) const FIELD_ARRAYS: &str = "faceoff:field_arrays";
/// The name of each field of [`FIELDS`].
pub(super) const FIELD_NAMES: &str = "faceoff:field_names";
/// The time of each field of [`FIELDS`].
pub(super) const FIELD_TIMES: &str = "faceoff:field_times";
/// One after the other, the indices of points or cells that the fields of [`FIELDS`] have values on.
pub(super) const FIELD_AT: &str = "faceoff:field_at";
/// The geometry behind the mesh as JSON.
pub(super) const GEOMETRY: &str = "faceoff:geometry";
/// The global arrays that hold texts: each text as UTF-8 bytes and a NUL, as numbers. VTK has a type for texts, but
/// meshio cannot read files that use it.
pub(super) const TEXTS: &str = "faceoff:texts";

/// Whether the blocks are the runs of cells of one kind, either all with numbers and entities or none, as they are made of a
/// file that does not contain them.
fn has_usual_blocks(mesh: &Mesh) -> bool {
    let blocks = &mesh.blocks;
    let same =
        |has: fn(&CellBlock) -> bool| blocks.iter().all(|block| has(block) == has(&blocks[0]));
    let taken = |field: &Field| [CELL_TAG, ENTITY].contains(&field.name.as_str());
    blocks.iter().all(|block| !block.is_empty())
        && blocks.windows(2).all(|pair| pair[0].kind != pair[1].kind)
        && same(|block| block.tags.is_empty())
        && same(|block| block.entities.is_empty())
        && !mesh.fields.iter().any(taken)
}

/// One array of a file.
pub(crate) struct Array<'a> {
    pub name: String,
    pub components: usize,
    pub values: Column<'a>,
}

/// A mesh and its fields as the arrays of a file.
#[derive(Default)]
pub(crate) struct FileArrays<'a> {
    pub points: Vec<Array<'a>>,
    pub cells: Vec<Array<'a>>,
    pub whole: Vec<Array<'a>>,
    /// Coordinates.
    pub geometry: Vec<Array<'a>>,
    /// Connectivity, offsets and types.
    pub topology: Vec<Array<'a>>,
    /// For polygonal data, connectivity and offsets of vertices, lines and polygons.
    pub sections: Vec<[Array<'a>; 2]>,
    /// Names of the arrays of `whole` that hold texts.
    texts: Vec<String>,
}

impl<'a> Array<'a> {
    fn new(name: impl Into<String>, components: usize, values: impl Into<Column<'a>>) -> Self {
        Array {
            name: name.into(),
            components,
            values: values.into(),
        }
    }

    pub fn scalar(name: &str, values: Values) -> Self {
        Array::new(name, 1, Cow::Owned(values))
    }
}

/// Lays out a valid mesh; the error states what VTU cannot store.
pub(crate) fn lay_out<'a>(
    mesh: &'a Mesh,
    fields: &'a [Field],
    whole: &'a [GlobalArray],
    kind: Topology,
) -> Result<FileArrays<'a>, String> {
    let mut layout = FileArrays {
        geometry: vec![Array::new("Points", 3, Column::Coordinates(&mesh.points))],
        ..FileArrays::default()
    };
    match kind {
        Topology::Cells => layout.topology = topology(mesh)?,
        Topology::Sections => {
            sections::check(mesh)?;
            let arrays = |of| {
                let [nodes, ends] = sections::nodes_and_ends(mesh, of);
                [
                    Array::scalar("connectivity", nodes),
                    Array::scalar("offsets", ends),
                ]
            };
            layout.sections = (0..3).map(arrays).collect();
        }
    }
    layout.mesh(mesh);
    layout.fields(mesh, mesh.fields.iter().chain(fields))?;
    layout.whole(whole)?;
    if !mesh.groups.is_empty() {
        layout.groups(mesh);
    }
    layout.text_names();
    Ok(layout)
}

fn topology(mesh: &Mesh) -> Result<Vec<Array<'_>>, String> {
    let kinds = mesh.blocks.iter().map(|block| block.kind);
    if let Some(kind) = kinds.into_iter().find(|&kind| vtk_type(kind).is_none()) {
        return Err(format!("VTK has no cells that are {kind}"));
    }
    let length: usize = mesh.blocks.iter().map(|block| block.nodes.len()).sum();
    // VTK requires the same width for connectivity and offsets.
    let width = match length.max(mesh.points.len()) <= i32::MAX as usize {
        true => Width::Narrow,
        false => Width::Wide,
    };
    let mut arrays = vec![
        Array::new("connectivity", 1, Column::Connectivity(mesh, width)),
        Array::new("offsets", 1, Column::Offsets(mesh, width)),
        Array::new("types", 1, Column::Types(mesh)),
    ];
    if !mesh.polyhedra.is_empty() {
        let (faces, ends) = faces(mesh);
        arrays.push(Array::scalar("faces", Values::I64(faces.into())));
        arrays.push(Array::scalar("faceoffsets", Values::I64(ends.into())));
    }
    Ok(arrays)
}

/// For each polyhedron its number of faces, and for each of these its number of corners and the corners; and where that ends for
/// each cell, -1 for one that is not a polyhedron. VTK 9.4 has four other arrays, but reads these, as all before it do.
fn faces(mesh: &Mesh) -> (Vec<i64>, Vec<i64>) {
    let (mut stream, mut ends) = (Vec::new(), Vec::with_capacity(mesh.cell_count()));
    let mut polyhedra = mesh.polyhedra.iter();
    for (_, kind, _) in mesh.cells() {
        let faces = matches!(kind, CellKind::Polyhedron(_))
            .then(|| polyhedra.next())
            .flatten();
        let Some(faces) = faces else {
            ends.push(-1);
            continue;
        };
        stream.push(faces.clone().count() as i64);
        stream.extend(faces.stream().map(i64::from));
        ends.push(stream.len() as i64);
    }
    (stream, ends)
}

impl<'a> FileArrays<'a> {
    fn push_whole(&mut self, name: &str, components: usize, values: Values) {
        let values = Cow::Owned(values);
        self.whole.push(Array::new(name, components, values));
    }

    fn push_texts<T: AsRef<str>>(&mut self, name: &str, texts: impl IntoIterator<Item = T>) {
        self.push_whole(name, 1, Values::U8(text_bytes(texts).into()));
        self.texts.push(name.into());
    }

    /// The global arrays, texts as bytes.
    fn whole(&mut self, whole: &'a [GlobalArray]) -> Result<(), String> {
        for array in whole {
            let (name, components) = (&array.name, array.components);
            match &array.values {
                GlobalValues::Numbers(numbers) => {
                    if components == 0 || !numbers.len().is_multiple_of(components) {
                        return Err(format!("array {name:?} ends within a tuple"));
                    }
                    let values = Cow::Borrowed(numbers);
                    self.whole.push(Array::new(name, components, values));
                }
                GlobalValues::Text(texts) => {
                    if components != 1 || texts.iter().any(|text| text.contains('\0')) {
                        return Err(format!(
                            "text {name:?} holds a NUL or has several components"
                        ));
                    }
                    self.push_texts(name, texts);
                }
            }
        }
        Ok(())
    }

    /// Which arrays hold texts.
    fn text_names(&mut self) {
        if !self.texts.is_empty() {
            let names = text_bytes(&self.texts);
            self.push_whole(TEXTS, 1, Values::U8(names.into()));
        }
    }

    /// The file's own numbers, entities, and blocks.
    fn mesh(&mut self, mesh: &Mesh) {
        if !mesh.point_tags.is_empty() {
            let tags = Values::U64(mesh.point_tags.clone().into());
            self.points.push(Array::scalar(POINT_TAG, tags));
        }
        if mesh.blocks.iter().any(|block| !block.tags.is_empty()) {
            let tags = Values::U64(mesh.cell_tags().collect());
            self.cells.push(Array::scalar(CELL_TAG, tags));
        }
        if mesh.blocks.iter().any(|block| !block.entities.is_empty()) {
            let mut entities = Vec::with_capacity(mesh.cell_count());
            for block in &mesh.blocks {
                let end = entities.len() + block.len();
                entities.extend_from_slice(&block.entities);
                entities.resize(end, 0);
            }
            self.cells
                .push(Array::scalar(ENTITY, Values::I32(entities.into())));
        }
        let rows = mesh.blocks.iter().flat_map(|block| {
            [
                block_code(block.kind),
                block.len() as i64,
                (!block.tags.is_empty()).into(),
                (!block.entities.is_empty()).into(),
            ]
        });
        if !has_usual_blocks(mesh) {
            self.push_whole(BLOCKS, 4, Values::I64(rows.collect()));
        }
        if mesh.geometry != Geometry::default() {
            let text = serde_json::to_string(&mesh.geometry);
            self.push_texts(GEOMETRY, text.ok());
        }
    }

    fn groups(&mut self, mesh: &Mesh) {
        let used: HashSet<i64> = mesh.groups.iter().map(|group| group.tag).collect();
        let none = (0..).map(|i: i64| -i).find(|tag| !used.contains(tag));
        let none = none.expect("invariant: there are fewer groups than integers");
        let groups = CellGroups::new(mesh);
        let components = groups.sets.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let tag = |group: &u32| {
            mesh.groups
                .get(*group as usize)
                .map_or(none, |group| group.tag)
        };
        // The last group first, free places at the end.
        let row = |set: &Vec<u32>| {
            let free = std::iter::repeat(none);
            set.iter()
                .rev()
                .map(tag)
                .chain(free)
                .take(components)
                .collect()
        };
        let rows: Vec<Vec<i64>> = groups.sets.iter().map(row).collect();
        let fits = |tag: &i64| i32::try_from(*tag).is_ok();
        let width = match rows.iter().flatten().all(fits) {
            true => Width::Narrow,
            false => Width::Wide,
        };
        let tags = GroupTags {
            groups,
            cells: mesh.cell_count(),
            rows,
            width,
        };
        self.cells
            .push(Array::new(GROUP, components, Column::Groups(tags)));

        let shown = self.show_names(mesh);
        let named = |group: &Group| i64::from(group.name.is_some());
        let rows = mesh.groups.iter().zip(shown).flat_map(|(group, shown)| {
            [group.dim.into(), group.tag, named(group) + i64::from(shown)]
        });
        self.push_whole(NO_GROUP, 1, Values::I64(vec![none].into()));
        self.push_whole(GROUPS, 3, Values::I64(rows.collect()));
        let names = mesh.groups.iter().map(|group| group.name.as_deref());
        self.push_texts(GROUP_NAMES, names.map(Option::unwrap_or_default));
    }

    /// Arrays that give meshio the names of groups; returns for each group whether it has one. A name that another array
    /// has, that XML cannot hold, or that follows very many others is only in the table.
    fn show_names(&mut self, mesh: &Mesh) -> Vec<bool> {
        let mut taken: HashSet<String> =
            self.whole.iter().map(|array| array.name.clone()).collect();
        let mut left = MAX_ARRAYS_IN_SECTION / 4;
        let mut show = |group: &Group| {
            let name = group.name.as_deref().unwrap_or_default();
            let fits = !name.is_empty() && !name.starts_with(RESERVED) && is_in_xml(name);
            if !fits || left == 0 || !taken.insert(name.to_owned()) {
                return false;
            }
            left -= 1;
            let values = Values::I64(vec![group.tag, group.dim.into()].into());
            self.push_whole(name, 1, values);
            true
        };
        mesh.groups.iter().map(&mut show).collect()
    }

    /// Fields; those that are partial, have a time, share a name, or are on the nodes of each cell get a row of [`FIELDS`].
    fn fields(
        &mut self,
        mesh: &Mesh,
        fields: impl Iterator<Item = &'a Field>,
    ) -> Result<(), String> {
        let (mut rows, mut times, mut at) = (Vec::new(), Vec::new(), Vec::new());
        let (mut arrays, mut names) = (Vec::new(), Vec::new());
        let mut taken = HashSet::new();
        for field in fields {
            if field.components == 0 || field.expected_len(mesh) != Some(field.values.len()) {
                return Err(format!("field {:?} does not fit the mesh", field.name));
            }
            let array = unused_name(field, &mut taken);
            let plain = field.at.is_empty() && field.time.is_none() && field.step.is_none();
            if !plain || array != field.name || field.on == Support::CellPoints {
                rows.extend([
                    field.on as i64,
                    field.time.is_some().into(),
                    field.step.is_some().into(),
                    field.step.unwrap_or(0).into(),
                    field.at.len() as i64,
                ]);
                times.push(field.time.unwrap_or(0.0));
                at.extend_from_slice(&field.at);
                names.push(field.name.clone());
                arrays.push(array.clone());
            }
            let components = field.components;
            match field.on {
                Support::Points => {
                    let values = everywhere(field, mesh.points.len());
                    self.points.push(Array::new(array, components, values));
                }
                Support::Cells => {
                    let values = everywhere(field, mesh.cell_count());
                    self.cells.push(Array::new(array, components, values));
                }
                Support::CellPoints => self.push_whole(&array, components, field.values.clone()),
            }
        }
        if !names.is_empty() {
            self.push_whole(FIELDS, 5, Values::I64(rows.into()));
            self.push_whole(FIELD_TIMES, 1, Values::F64(times.into()));
            // meshio cannot read a compressed empty array.
            if !at.is_empty() {
                self.push_whole(FIELD_AT, 1, Values::U32(at.into()));
            }
            self.push_texts(FIELD_NAMES, names);
            self.push_texts(FIELD_ARRAYS, arrays);
        }
        Ok(())
    }
}

/// Texts as bytes, each with a NUL at its end.
fn text_bytes<T: AsRef<str>>(texts: impl IntoIterator<Item = T>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for text in texts {
        bytes.extend_from_slice(text.as_ref().as_bytes());
        bytes.push(0);
    }
    bytes
}

/// Whether an XML attribute can hold a name.
pub(super) fn is_in_xml(name: &str) -> bool {
    name.chars().all(|c| {
        matches!(c, '\t' | '\n' | '\r') || !(c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'))
    })
}

/// The field's name, with a number if an array of the same section already has it.
fn unused_name(field: &Field, taken: &mut HashSet<(Support, String)>) -> String {
    let numbered = (2..).map(|i: u64| format!("{} {i}", field.name));
    let mut names = std::iter::once(field.name.clone()).chain(numbered);
    let name = names.find(|name| taken.insert((field.on, name.clone())));
    name.expect("invariant: there are more numbers than fields")
}

/// A field's values for all points or cells; NaN (0 for integers) where it has none.
fn everywhere(field: &Field, rows: usize) -> Cow<'_, Values> {
    fn spread<T: Scalar>(values: &[T], field: &Field, rows: usize) -> Values {
        let width = field.components;
        let mut all = vec![T::MISSING; rows * width];
        for (row, &at) in values.chunks_exact(width).zip(&field.at) {
            all[at as usize * width..][..width].copy_from_slice(row);
        }
        T::values(all)
    }
    if field.at.is_empty() {
        return Cow::Borrowed(&field.values);
    }
    Cow::Owned(with_numbers!(&field.values, values => spread(values, field, rows)))
}
