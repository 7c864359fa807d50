//! MSH 2.2: the version that most codes read.

use super::write_elements_v2;
use super::writer::Writer;
use crate::io::loss::Losses;
use crate::io::out::Out;
use crate::mesh::{Group, Mesh};

pub fn encode(mut writer: Writer<'_>, losses: &mut Losses) -> Out {
    let mesh = writer.mesh;
    let keep_points = fit(mesh.point_tags.iter().copied(), "points", losses);
    let keep_cells = fit(mesh.cell_tags(), "cells", losses);
    let point_tag = |point: u32| match keep_points {
        true => mesh.point_tag(point),
        false => u64::from(point) + 1,
    };
    let physical_of_set = physicals(&writer, losses);
    let geometry = &mesh.geometry;
    if geometry
        .point_runs
        .iter()
        .any(|run| run.parameters.as_ref().is_some_and(|p| !p.is_empty()))
    {
        losses.note("the parametric coordinates of points are not written");
    }
    writer.header("2.2");
    writer.names(|_, _| false, losses);
    writer.out.text(&format!("$Nodes\n{}\n", mesh.points.len()));
    if writer.binary {
        writer.out.rows(mesh.points.len(), 28, |first, rows| {
            let points = mesh.points.get(first..).unwrap_or_default();
            let rows = rows.as_chunks_mut::<28>().0.iter_mut();
            for ((row, point), index) in rows.zip(points).zip(first as u32..) {
                let (number, coordinates) = row.split_at_mut(4);
                number.copy_from_slice(&(point_tag(index) as i32).to_le_bytes());
                let places = coordinates.as_chunks_mut::<8>().0.iter_mut();
                places
                    .zip(point)
                    .for_each(|(place, x)| *place = x.to_le_bytes());
            }
        });
    } else {
        for (point, index) in mesh.points.iter().zip(0u32..) {
            writer.u64(point_tag(index)).f64s(point).end();
        }
    }
    writer.end_section("Nodes");

    writer
        .out
        .text(&format!("$Elements\n{}\n", mesh.cell_count()));
    write_elements_v2::elements(&mut writer, keep_cells, &point_tag, &physical_of_set);
    writer.end_section("Elements");
    if !geometry.periodic.is_empty() {
        periodic(&mut writer.out, mesh, &point_tag);
    }
    writer.fields(point_tag, keep_cells, losses);
    writer.out
}

/// Whether all numbers fit 32 bits; otherwise all are renumbered.
fn fit(mut tags: impl Iterator<Item = u64>, of: &str, losses: &mut Losses) -> bool {
    let fit = tags.all(|tag| i32::try_from(tag).is_ok());
    if !fit {
        losses.note(format!(
            "the {of} are renumbered, as their numbers exceed 32 bits"
        ));
    }
    fit
}

/// The one physical tag that 2.2 gives a cell, for each set of groups; 0 means none.
fn physicals(writer: &Writer<'_>, losses: &mut Losses) -> Vec<i32> {
    let (first, many) = writer.groups.single(writer.mesh);
    losses.lose_some(many, "cells that are in several groups");
    writer.lose_groups(1, losses);
    let tag = |first: Option<&Group>| i32::try_from(first?.tag).ok().filter(|tag| *tag > 0);
    let tags = first.into_iter().map(|first| tag(first).unwrap_or(0));
    tags.collect()
}

/// `$Periodic`, which is text in binary files too.
fn periodic(out: &mut Out, mesh: &Mesh, point_tag: &impl Fn(u32) -> u64) {
    out.text("$Periodic\n")
        .int(mesh.geometry.periodic.len())
        .end();
    for link in &mesh.geometry.periodic {
        out.int(link.dim).int(link.entity).int(link.master).end();
        if !link.affine.is_empty() {
            out.text("Affine ");
            link.affine.iter().for_each(|&x| {
                out.float(x);
            });
            out.end();
        }
        out.int(link.pairs.len()).end();
        for pair in &link.pairs {
            out.int(point_tag(pair[0])).int(point_tag(pair[1])).end();
        }
    }
    out.text("$EndPeriodic\n");
}
