//! Writes CGNS files on HDF5.

use std::ops::Range;

use super::number_of;
use crate::error::Result;
use crate::io::hdf5::write::{Data, Group};
use crate::io::loss::Losses;
use crate::io::raw::CellNodes;
use crate::io::scalar::Number;
use crate::io::sides::usual_order;
use crate::io::steps::{Steps, row_of};
use crate::io::{Job, sets, vectors};
use crate::mesh::{CellBlock, CellGroups, Mesh, Support};

const INT: Number = Number::I32;
/// Bytes of a name.
const NAME: usize = 32;

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    losses.note_gmsh(mesh);
    let dim = mesh.dim().max(1);
    let count = mesh.points.len();
    losses.lose_blocks(mesh, |kind| number_of(kind).is_some());
    let blocks = mesh.ranges();
    let blocks = blocks.filter(|(_, block)| number_of(block.kind).is_some());
    let blocks: Vec<(Range<u32>, &CellBlock)> = blocks.collect();
    // The number of each element, from 1 on.
    let mut numbers = vec![0_i64; mesh.cell_count()];
    let written = blocks.iter().flat_map(|(cells, _)| cells.clone());
    written
        .zip(1..)
        .for_each(|(cell, number)| numbers[cell as usize] = number);
    let full: Vec<u32> = mesh
        .cells()
        .filter(|(cell, kind, _)| kind.dim() == dim && numbers[*cell as usize] > 0)
        .map(|(cell, ..)| cell)
        .collect();

    let steps = Steps::of(&mesh.fields, &mut losses);
    let mut file = Group::default();
    describe(&mut file, "HDF5 MotherNode", "Root Node of HDF5 File", "MT");
    file.add(" format", characters("IEEE_LITTLE_32", 15));
    file.add(" hdf5version", characters("HDF5 Version 1.8.0", 33));
    let version = Data::made(Number::F32, vec![1], |_, bytes| {
        bytes.copy_from_slice(&3.4_f32.to_le_bytes())
    });
    node(
        &mut file,
        "CGNSLibraryVersion",
        "CGNSLibraryVersion_t",
        "R4",
    )
    .add(" data", version);
    let sizes = [i64::from(dim), 3];
    let base = node(&mut file, "Base", "CGNSBase_t", "I4");
    base.add(" data", Data::integers(INT, vec![2], move |k| sizes[k]));
    let sizes = [count as i64, full.len() as i64, 0];
    let zone = node(base, "Zone", "Zone_t", "I4");
    zone.add(" data", Data::integers(INT, vec![3, 1], move |k| sizes[k]));
    text(zone, "ZoneType", "ZoneType_t", "Unstructured");
    let grid = node(zone, "GridCoordinates", "GridCoordinates_t", "MT");
    for (axis, name) in ["CoordinateX", "CoordinateY", "CoordinateZ"]
        .into_iter()
        .enumerate()
    {
        let values = Data::floats(vec![count], move |k| mesh.points[k][axis]);
        node(grid, name, "DataArray_t", "R8").add(" data", values);
    }
    let filled = blocks.iter().filter(|(_, block)| !block.is_empty());
    for (k, (cells, block)) in filled.clone().enumerate() {
        let kind = block.kind;
        let section = node(zone, &format!("{}_{}", k + 1, kind), "Elements_t", "I4");
        let number = number_of(kind).unwrap_or(0);
        section.add(
            " data",
            Data::integers(INT, vec![2], move |k| if k == 0 { number } else { 0 }),
        );
        let start = numbers[cells.start as usize];
        let range = [start, start + block.len() as i64 - 1];
        node(section, "ElementRange", "IndexRange_t", "I4")
            .add(" data", Data::integers(INT, vec![2], move |k| range[k]));
        let nodes = CellNodes::new(&*block.nodes, usual_order(kind, false), false);
        let connectivity = Data::nodes(vec![nodes.len()], nodes, 1);
        node(section, "ElementConnectivity", "DataArray_t", "I4").add(" data", connectivity);
    }
    let names = sets::distinct_names(mesh.groups.iter(), NAME);
    if !mesh.groups.is_empty() {
        losses.note("groups are numbered anew, in their order");
    }
    let sets = CellGroups::new(mesh);
    let alone = |(cells, block): &(Range<u32>, &CellBlock)| {
        let mut cells = cells.clone();
        block.kind.dim() > 0 && cells.all(|cell| sets.sets[sets.set_of(cell) as usize].is_empty())
    };
    if filled.clone().any(alone) {
        losses
            .note("the cells in no group are sections, which are groups when they are read again");
    }
    let mut named = Vec::new();
    for (group, name) in mesh.groups.iter().zip(&names) {
        if group.name.as_ref() != Some(name) {
            losses.called(group, name);
        }
        let of_vertices = group.dim == 0;
        let listed = group.cells.iter().map(|&cell| match mesh.cell(cell) {
            Some((_, nodes)) if of_vertices => i64::from(nodes[0]) + 1,
            _ => numbers[cell as usize],
        });
        let listed: Vec<i64> = listed.filter(|&number| number > 0).collect();
        if listed.is_empty() {
            losses.lose(format!("the group {name:?}, which has no cells"));
            continue;
        }
        named.push(name.as_str());
        let list = node(zone, "ZoneBC", "ZoneBC_t", "MT");
        let boundary = node(list, name, "BC_t", "C1");
        boundary.add(" data", characters("FamilySpecified", 15));
        let location = match dim - group.dim.min(dim) {
            _ if of_vertices => "Vertex",
            0 => "CellCenter",
            1 => "FaceCenter",
            _ => "EdgeCenter",
        };
        text(boundary, "GridLocation", "GridLocation_t", location);
        // Gmsh makes groups only from families.
        text(boundary, "FamilyName", "FamilyName_t", name);
        let length = listed.len();
        node(boundary, "PointList", "IndexArray_t", "I4").add(
            " data",
            Data::integers(INT, vec![length, 1], move |k| listed[k]),
        );
    }
    for name in &named {
        node(file.member("Base"), name, "Family_t", "MT");
    }
    write_fields(file.member("Base"), mesh, &steps, &full, &mut losses);
    losses.settle(path, || file.save(path))
}

fn write_fields<'a>(
    base: &mut Group<'a>,
    mesh: &'a Mesh,
    steps: &'a Steps<'a>,
    full: &[u32],
    losses: &mut Losses,
) {
    let count = steps.times.len().max(1);
    let has_times = !steps.times.is_empty();
    let full: std::sync::Arc<[u32]> = full.into();
    for field in &steps.fields {
        let on_full = |at: &[u32]| at.iter().all(|&cell| full.binary_search(&cell).is_ok());
        let fits = match (field.on, field.at()) {
            (Support::Points, _) => true,
            (Support::Cells, None) => full.len() == mesh.cell_count(),
            (Support::Cells, Some(at)) => on_full(at),
            _ => false,
        };
        if field.name.is_empty() {
            losses.lose_field(field.name, field.on);
            continue;
        }
        if !fits {
            losses.lose(format!(
                "the field {:?} on {}, other than those of the highest dimension",
                field.name, field.on
            ));
            continue;
        }
        if let Some(at) = field.at()
            && field.on == Support::Cells
            && full.iter().any(|&cell| row_of(at, cell as usize).is_none())
        {
            losses.note_gaps(field.name, field.on);
        }
        let (location, word) = if field.on == Support::Points {
            ("Vertex", "Vertex")
        } else {
            ("CellCenter", "Cell")
        };
        let names = vectors::names(field.first(), NAME, losses);
        for step in 0..count {
            let solution = format!("{word}Solution{}", step + 1);
            let zone = base.group("Zone");
            let is_new = !zone.has(&solution);
            let at = node(zone, &solution, "FlowSolution_t", "MT");
            if is_new {
                text(at, "GridLocation", "GridLocation_t", location);
            }
            for (component, name) in names.iter().enumerate() {
                let rows = if field.on == Support::Points {
                    mesh.points.len()
                } else {
                    full.len()
                };
                let cells = full.clone();
                let on_points = field.on == Support::Points;
                let values = Data::floats(vec![rows], move |k| {
                    field.value(
                        step,
                        if on_points { k } else { cells[k] as usize },
                        component,
                    )
                });
                if at.has(name) {
                    losses.lose(format!("the field {name:?}, as another has this name"));
                    continue;
                }
                node(at, name, "DataArray_t", "R8").add(" data", values);
            }
        }
    }
    if has_times {
        let times = &steps.times;
        let data = node(base, "BaseIterativeData", "BaseIterativeData_t", "I4");
        data.add(" data", Data::integers(INT, vec![1], move |_| count as i64));
        node(data, "TimeValues", "DataArray_t", "R8")
            .add(" data", Data::floats(vec![count], move |k| times[k]));
        let zone = base.group("Zone");
        for (word, name) in [
            ("Vertex", "FlowSolutionVertexPointers"),
            ("Cell", "FlowSolutionCellPointers"),
        ] {
            if zone.has(&format!("{word}Solution1")) {
                let names: String = (1..=count)
                    .map(|k| format!("{:<32}", format!("{word}Solution{k}")))
                    .collect();
                let pointers = Data::made(Number::I8, vec![count, 32], move |first, bytes| {
                    bytes.copy_from_slice(&names.as_bytes()[first..first + bytes.len()]);
                });
                let data = node(zone, "ZoneIterativeData", "ZoneIterativeData_t", "MT");
                node(data, name, "DataArray_t", "C1").add(" data", pointers);
            }
        }
    }
}

/// The header of each node.
pub(super) fn describe(node: &mut Group<'_>, name: &str, label: &str, kind: &str) {
    if node.has_attributes() {
        return;
    }
    let fixed = |text: &str, size: usize| Data::one_text(text, size);
    node.with("name", fixed(name, 33))
        .with("label", fixed(label, 33))
        .with("type", fixed(kind, 3));
    node.with("flags", Data::integers(INT, vec![1], |_| 1));
}

pub(super) fn node<'b, 'a>(
    parent: &'b mut Group<'a>,
    name: &str,
    label: &str,
    kind: &str,
) -> &'b mut Group<'a> {
    let node = parent.member(&name.replace('/', "_"));
    describe(node, name, label, kind);
    node
}

/// A node whose data are a text.
pub(super) fn text(parent: &mut Group<'_>, name: &str, label: &str, value: &str) {
    node(parent, name, label, "C1").add(" data", characters(value, value.len()));
}

fn characters(text: &str, size: usize) -> Data<'static> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(size, 0);
    Data::made(Number::I8, vec![size], move |first, out| {
        out.copy_from_slice(&bytes[first..first + out.len()])
    })
}
