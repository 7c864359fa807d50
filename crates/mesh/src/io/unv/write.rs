//! Writes nodes (2411), elements (2412), groups (2467) and results (2414). Groups of vertices become groups of nodes.

use super::elements::{is_beam, order};
use crate::error::Result;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::io::{Job, elements};
use crate::mesh::{CellKind, Field, Mesh, Support, Values};

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    let mut out = Out::to(path)?;
    out.text("    -1\n  2411\n");
    for (point, number) in mesh.points.iter().zip(1u32..) {
        out.text(&format!("{number:>10}{:>10}{:>10}{:>10}\n", 1, 1, 11));
        out.text(&point.iter().map(|x| real(*x)).collect::<String>())
            .end();
    }
    out.text("    -1\n    -1\n  2412\n");
    // Vertices of groups are written as nodes.
    let mut grouped = vec![false; mesh.cell_count()];
    let vertices = mesh.groups.iter().filter(|group| group.dim == 0);
    vertices.for_each(|group| {
        group
            .cells
            .iter()
            .for_each(|&cell| grouped[cell as usize] = true)
    });
    let mut lost = 0;
    for (cell, kind, found) in mesh.cells() {
        let Some(descriptor) = descriptor(kind) else {
            lost += 1;
            continue;
        };
        if kind == CellKind::Vertex && grouped[cell as usize] {
            continue;
        }
        out.text(&row([
            u64::from(cell) + 1,
            descriptor,
            1,
            1,
            7,
            found.len() as u64,
        ]));
        if is_beam(descriptor) {
            out.text(&row([0, 1, 1]));
        }
        let order = order(kind).into_iter();
        let nodes: Vec<u64> = order.map(|place| u64::from(found[place]) + 1).collect();
        nodes.chunks(8).for_each(|nodes| {
            out.text(&row(nodes.iter().copied())).pass_on();
        });
    }
    losses.lose_some(lost, "cells of the kinds that it has no number for");
    out.text("    -1\n");
    groups(&mut out, mesh, &mut losses);
    for field in &mesh.fields {
        result(&mut out, mesh, field, &mut losses);
    }
    losses.note_gmsh(mesh);
    losses.settle(path, || out.save(path))
}

fn descriptor(kind: CellKind) -> Option<u64> {
    elements::name(|element| element.unv, kind)
}

/// Sixteen digits after the point, as wide as two of the format's columns.
fn real(x: f64) -> String {
    let text = format!("{x:.16E}");
    let (digits, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    format!("{:>25}", format!("{digits}D{exponent}"))
}

/// Columns of ten.
fn row(numbers: impl IntoIterator<Item = u64>) -> String {
    let columns: String = numbers
        .into_iter()
        .map(|number| format!("{number:>10}"))
        .collect();
    columns + "\n"
}

fn groups(out: &mut Out, mesh: &Mesh, losses: &mut Losses) {
    if mesh.groups.is_empty() {
        return;
    }
    losses.lose_empty(mesh);
    let mut numbers = std::collections::HashSet::new();
    let kinds: Vec<CellKind> = mesh.cells().map(|(_, kind, _)| kind).collect();
    let points: Vec<u32> = mesh.cells().map(|(_, _, nodes)| nodes[0]).collect();
    out.text("    -1\n  2467\n");
    for (group, place) in mesh.groups.iter().zip(1i64..) {
        // Groups of all dimensions count together.
        let number = if group.tag > 0 && numbers.insert(group.tag) {
            group.tag
        } else {
            mesh.groups.len() as i64 + 1000 + place
        };
        numbers.insert(number);
        if number != group.tag {
            losses.note(format!(
                "group {} of dimension {} is numbered {number}",
                group.tag, group.dim
            ));
        }
        let name = group.name.clone().unwrap_or_else(|| {
            let name = format!("group {}", group.tag);
            losses.called(group, &name);
            name
        });
        if name.contains(['\n', '\r']) || name.trim() != name {
            losses.lose(format!("the name {name:?} as it is"));
        }
        let known = |cell: &&u32| descriptor(kinds[**cell as usize]).is_some();
        let members: Vec<u64> = group
            .cells
            .iter()
            .filter(known)
            .flat_map(|&cell| match group.dim {
                0 => [7, u64::from(points[cell as usize]) + 1, 0, 0],
                _ => [8, u64::from(cell) + 1, 0, 0],
            })
            .collect();
        out.text(&row([
            number as u64,
            0,
            0,
            0,
            0,
            0,
            0,
            members.len() as u64 / 4,
        ]));
        out.text(name.lines().next().unwrap_or_default()).text("\n");
        members.chunks(8).for_each(|members| {
            out.text(&row(members.iter().copied())).pass_on();
        });
    }
    out.text("    -1\n");
}

fn result(out: &mut Out, mesh: &Mesh, field: &Field, losses: &mut Losses) {
    let place = match field.on {
        Support::Points => 1,
        Support::Cells => 2,
        Support::CellPoints => {
            return losses.lose_field(&field.name, field.on);
        }
    };
    let values = field.values.to_f64();
    if values.iter().any(|value| !value.is_finite()) {
        return losses.lose(format!(
            "the field {:?}, which has values that are not numbers",
            field.name
        ));
    }
    if !matches!(field.values, Values::F64(_)) {
        losses.note(format!("the field {:?} is written as binary64", field.name));
    }
    let every: Vec<u32> = (0..mesh.items(field.on) as u32).collect();
    let at = if field.at.is_empty() {
        &every
    } else {
        &field.at
    };
    // One value is a scalar, three a vector, six and nine tensors; otherwise the kind is not known.
    let kind = match field.components {
        1 => 1,
        3 => 2,
        6 => 4,
        9 => 5,
        _ => 0,
    };
    out.text("    -1\n  2414\n");
    out.text(&row([1]))
        .text(field.name.lines().next().unwrap_or_default())
        .text("\n")
        .text(&row([place]));
    out.text("NONE\nNONE\nNONE\nNONE\nNONE\n");
    let transient = if field.time.is_some() { 4 } else { 1 };
    out.text(&row([1, transient, kind, 0, 4, field.components as u64]));
    let step = field
        .step
        .and_then(|step| u64::try_from(step).ok())
        .unwrap_or(0);
    out.text(&row([0, 0, 0, 0, 0, 0, step, 0]))
        .text(&row([0, 0]));
    let time = field.time.unwrap_or(0.0);
    out.text(&[time, 0.0, 0.0, 0.0, 0.0, 0.0].map(real).concat())
        .text("\n");
    out.text(&[0.0; 6].map(real).concat()).text("\n");
    for (&at, values) in at.iter().zip(values.chunks(field.components)) {
        let number = u64::from(at) + 1;
        match place {
            1 => out.text(&row([number])),
            _ => out.text(&row([number, field.components as u64])),
        };
        for values in values.chunks(3) {
            out.text(&values.iter().map(|value| real(*value)).collect::<String>())
                .end();
        }
    }
    out.text("    -1\n");
}
