//! Writes VTKHDF: an unstructured grid in one part, and steps where fields have times.

use std::borrow::Cow;

use crate::error::Result;
use crate::io::Job;
use crate::io::hdf5::write::{Data, Group};
use crate::io::scalar::Number;
use crate::io::steps::Steps;
use crate::io::vtu::column::{Column, Width};
use crate::io::vtu::layout::{Topology, lay_out};
use crate::io::vtu::write::{check_arrays, refuse};
use crate::mesh::{CellKind, Field, Mesh, Support};

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        whole,
        mut losses,
        ..
    } = job;
    let has_steps = |field: &Field| {
        field.time.is_some() && matches!(field.on, Support::Points | Support::Cells)
    };
    let (timed, fixed): (Vec<Field>, Vec<Field>) = mesh.fields.iter().cloned().partition(has_steps);
    let base = match timed.is_empty() {
        true => Cow::Borrowed(mesh),
        false => Cow::Owned(Mesh {
            fields: fixed,
            ..mesh.clone()
        }),
    };
    let solid = mesh
        .blocks
        .iter()
        .find(|block| matches!(block.kind, CellKind::Polyhedron(_)));
    if let Some(solid) = solid {
        return Err(refuse(
            path,
            format!("VTKHDF is not written with cells that are {}", solid.kind),
        ));
    }
    let refuse = |what| refuse(path, what);
    let layout = lay_out(&base, &[], whole, Topology::Cells).map_err(refuse)?;
    check_arrays(&layout).map_err(refuse)?;
    let steps = Steps::of(&timed, &mut losses);
    let times = &steps.times;

    let (points, cells) = (mesh.points.len(), mesh.cell_count());
    let connectivity = Column::Connectivity(mesh, Width::Wide);
    let ends = Column::Offsets(mesh, Width::Wide);
    let nodes = connectivity.len();
    let mut file = Group::default();
    let root = file.group("VTKHDF");
    let list = |number: i64| Data::integers(Number::I64, vec![1], move |_| number);
    root.with(
        "Version",
        Data::integers(Number::I64, vec![2], |k| if k == 0 { 2 } else { 0 }),
    );
    root.with("Type", Data::one_text("UnstructuredGrid", 16));
    root.add("NumberOfPoints", list(points as i64));
    root.add("NumberOfCells", list(cells as i64));
    root.add("NumberOfConnectivityIds", list(nodes as i64));
    root.add("Points", column(Column::Coordinates(&mesh.points), 3));
    root.add("Connectivity", column(connectivity, 0));
    // The first offset is 0.
    root.add(
        "Offsets",
        Data::made(Number::I64, vec![cells + 1], move |first, bytes| {
            let skipped = usize::from(first == 0) * 8;
            let (_, rest) = bytes.split_at_mut(skipped.min(bytes.len()));
            ends.fill(first.saturating_sub(1), rest);
        }),
    );
    root.add("Types", column(Column::Types(mesh), 0));
    let (on_points, on_cells) = (layout.points, layout.cells);
    let fixed: Vec<(&str, String)> = on_points
        .iter()
        .map(|array| ("PointData", array.name.clone()))
        .chain(
            on_cells
                .iter()
                .map(|array| ("CellData", array.name.clone())),
        )
        .collect();
    let of_whole: Vec<(String, [usize; 2])> = layout
        .whole
        .iter()
        .map(|array| {
            (
                array.name.clone(),
                [
                    array.components,
                    array.values.len() / array.components.max(1),
                ],
            )
        })
        .collect();
    for (folder, arrays) in [
        ("PointData", on_points),
        ("CellData", on_cells),
        ("FieldData", layout.whole),
    ] {
        for array in arrays {
            let components = if array.components == 1 {
                0
            } else {
                array.components
            };
            file.group("VTKHDF")
                .group(folder)
                .add(&member(&array.name), column(array.values, components));
        }
    }
    if !times.is_empty() {
        let count = times.len();
        let root = file.group("VTKHDF").group("Steps");
        root.with("NSteps", Data::integer(Number::I64, count as i64));
        root.add("Values", Data::floats(vec![count], |k| times[k]));
        let constant =
            |number: i64, shape: Vec<usize>| Data::integers(Number::I64, shape, move |_| number);
        root.add("NumberOfParts", constant(1, vec![count]));
        for name in ["PartOffsets", "PointOffsets"] {
            root.add(name, constant(0, vec![count]));
        }
        for name in ["CellOffsets", "ConnectivityIdOffsets"] {
            root.add(name, constant(0, vec![count, 1]));
        }
        for (folder, name) in &fixed {
            root.group(&format!("{folder}Offsets"))
                .add(&member(name), constant(0, vec![count]));
        }
        for (name, [components, tuples]) in of_whole {
            root.group("FieldDataOffsets")
                .add(&member(&name), constant(0, vec![count]));
            let size = [components as i64, tuples as i64];
            let sizes = Data::integers(Number::I64, vec![count, 2], move |k| size[k % 2]);
            root.group("FieldDataSizes").add(&member(&name), sizes);
        }
        for field in &steps.fields {
            let (folder, rows) = match field.on {
                Support::Points => ("PointData", points),
                _ => ("CellData", cells),
            };
            if field.on == Support::Cells && field.at().is_some() {
                losses.note_gaps(field.name, field.on);
            }
            let width = field.components;
            let shape = if width == 1 {
                vec![count * rows]
            } else {
                vec![count * rows, width]
            };
            let values = Data::floats(shape, move |k| {
                let (row, component) = (k / width, k % width);
                field.value(row / rows, row % rows, component)
            });
            let root = file.group("VTKHDF");
            root.group(folder).add(&member(field.name), values);
            let offsets =
                Data::integers(Number::I64, vec![count], move |step| (step * rows) as i64);
            root.group("Steps")
                .group(&format!("{folder}Offsets"))
                .add(&member(field.name), offsets);
        }
    }
    losses.settle(path, || file.save(path))
}

/// A name that HDF5 takes.
fn member(name: &str) -> String {
    name.replace('/', "_")
}

/// The numbers of a column in rows of a given length, or in a plain list.
fn column(values: Column<'_>, width: usize) -> Data<'_> {
    let count = values.len();
    let shape = match count.checked_div(width) {
        None => vec![count],
        Some(rows) => vec![rows, width],
    };
    Data::made(values.number(), shape, move |first, bytes| {
        values.fill(first, bytes)
    })
}
