//! Writes nodes, elements and sets. Groups of vertices become sets of nodes, those of sides of elements surfaces.

use std::collections::HashMap;

use super::elements::{order, sides as sides_of};
use crate::error::Result;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::io::{Job, elements};
use crate::mesh::{CellKind, Group};

type Cell<'a> = (CellKind, &'a [u32]);

pub fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    losses.lose_fields(&mesh.fields);
    losses.note_gmsh(mesh);
    let dim = mesh.dim();
    let flat = mesh.is_flat();
    let cells: Vec<Cell<'_>> = mesh.cells().map(|(_, kind, nodes)| (kind, nodes)).collect();
    let sides = sides(&cells, dim);

    let side = |cell: &u32| {
        let side = sides.get(&sorted(cells[*cell as usize])).copied();
        side.filter(|(of, _)| types(cells[*of as usize].0).is_some())
    };
    let is_surface = |group: &&Group| {
        group.dim + 1 == dim && dim > 1 && group.cells.iter().all(|cell| side(cell).is_some())
    };
    let (surfaces, sets): (Vec<&Group>, Vec<&Group>) = mesh.groups.iter().partition(is_surface);

    // What a set of nodes or a surface stands for is not written as an element.
    let mut written: Vec<bool> = cells
        .iter()
        .map(|(kind, _)| types(*kind).is_some())
        .collect();
    let twice = surfaces.iter().flat_map(|group| &group.cells);
    losses.note_twice(twice.filter_map(|cell| {
        let (of, number) = side(cell)?;
        Some((*cell, (of, number)))
    }));
    losses.lose_some(
        written.iter().filter(|written| !**written).count(),
        "cells of the kinds that it has no element for",
    );
    losses.lose_empty(mesh);
    let mut stood_for = vec![false; cells.len()];
    for group in surfaces
        .iter()
        .chain(sets.iter().filter(|group| group.dim == 0))
    {
        group
            .cells
            .iter()
            .for_each(|&cell| stood_for[cell as usize] = true);
    }
    let elements = sets.iter().filter(|group| group.dim > 0);
    elements.for_each(|group| {
        group
            .cells
            .iter()
            .for_each(|&cell| stood_for[cell as usize] = false)
    });
    written
        .iter_mut()
        .zip(stood_for)
        .for_each(|(written, stood)| *written &= !stood);

    let mut out = Out::to(path)?;
    out.text("*NODE\n");
    for (point, number) in mesh.points.iter().zip(1u32..) {
        row(&mut out, [number]);
        point.iter().for_each(|&x| {
            out.text(", ").float(x);
            out.bytes.pop();
        });
        out.end();
    }
    let mut last = None;
    for (number, ((kind, nodes), written)) in (1u32..).zip(cells.iter().zip(&written)) {
        let Some([plane, space]) = types(*kind).filter(|_| *written) else {
            continue;
        };
        if last.replace(*kind) != Some(*kind) {
            out.text(&format!(
                "*ELEMENT, TYPE={}\n",
                if flat { plane } else { space }
            ));
        }
        let order = order(*kind).into_iter();
        let nodes = order.map(|place| nodes[place] + 1);
        let numbers: Vec<u32> = [number].into_iter().chain(nodes).collect();
        // A line has at most sixteen numbers.
        for (place, part) in numbers.chunks(16).enumerate() {
            if place > 0 {
                out.bytes.pop();
                out.text(",\n");
            }
            row(&mut out, part.iter().copied());
            out.end();
        }
    }
    for group in sets {
        let name = name(group, &mut losses);
        let keyword = if group.dim == 0 { "NSET" } else { "ELSET" };
        out.text(&format!("*{keyword}, {keyword}={name}\n"));
        let members = group.cells.iter().filter_map(|&cell| match group.dim {
            0 => cells[cell as usize].1.first().map(|node| node + 1),
            _ => written[cell as usize].then_some(cell + 1),
        });
        members.for_each(|member| {
            row(&mut out, [member]);
            out.end();
        });
    }
    for group in surfaces {
        out.text(&format!(
            "*SURFACE, TYPE=ELEMENT, NAME={}\n",
            name(group, &mut losses)
        ));
        for (cell, face) in group.cells.iter().filter_map(side) {
            // The edges of shells have another letter than the sides of solids.
            let is_shell = !flat || cells[cell as usize].0 == CellKind::Quadrangle9;
            let letter = if dim == 2 && is_shell { 'E' } else { 'S' };
            out.text(&format!("{}, {letter}{}\n", cell + 1, face + 1))
                .pass_on();
        }
    }
    losses.settle(path, || out.save(path))
}

/// The types of elements that are written in 2D and in 3D.
fn types(kind: CellKind) -> Option<[&'static str; 2]> {
    elements::name(|element| element.abaqus, kind)
}

/// Numbers with commas between them; the line stays open.
fn row(out: &mut Out, numbers: impl IntoIterator<Item = u32>) {
    for (place, number) in numbers.into_iter().enumerate() {
        out.text(if place > 0 { ", " } else { "" }).int(number);
        out.bytes.pop();
    }
}

/// The name of a set, in quotes where it needs them.
fn name(group: &Group, losses: &mut Losses) -> String {
    let Some(name) = &group.name else {
        let name = format!("GROUP_{}_{}", group.dim, group.tag);
        losses.called(group, &name);
        return name;
    };
    if name.contains(['"', '\n', '\r']) || name.trim() != name {
        losses.lose(format!(
            "the name {name:?}, which has quotes, line ends or blanks around it"
        ));
    }
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let name = name.replace(['"', '\n', '\r'], "_");
    if name.chars().all(plain) {
        name
    } else {
        format!("\"{name}\"")
    }
}

fn sorted((kind, nodes): Cell<'_>) -> Vec<u32> {
    let mut corners = nodes
        .get(..kind.shape().corners())
        .unwrap_or_default()
        .to_vec();
    corners.sort_unstable();
    corners
}

/// The first cell of the highest dimension that has these corners as a side, and which side.
fn sides(cells: &[Cell<'_>], dim: u8) -> HashMap<Vec<u32>, (u32, usize)> {
    let mut sides = HashMap::new();
    for ((kind, nodes), cell) in cells.iter().zip(0u32..) {
        let known = kind.dim() == dim && types(*kind).is_some();
        for (place, side) in sides_of(kind.shape()).iter().enumerate().filter(|_| known) {
            let mut corners: Vec<u32> = side
                .iter()
                .filter_map(|&corner| nodes.get(corner).copied())
                .collect();
            corners.sort_unstable();
            sides.entry(corners).or_insert((cell, place));
        }
    }
    sides
}
