//! SU2's mesh: keywords with `=`, cells by VTK's numbers, markers of the boundary, several zones in one file.

use std::path::Path;

use super::builder::{Builder, Numbering};
use super::out::Out;
use super::scan::Scan;
use super::vtu::cells::{classical, vtk_type};
use super::{Content, Job, Native, Read};
use crate::error::{Error, Result};
use crate::field::Tell;
use crate::mesh::{CellKind, Mesh};

pub static FORMAT: Native = Native {
    title: "SU2's mesh",
    names: &["su2"],
    suffixes: &["su2"],
    has_binary: false,
    holds_whole: false,
    recognises,
    read: Read::Once(read),
    write,
};

/// The cell of this number of VTK's.
fn kind(number: u64) -> Option<CellKind> {
    classical(number).filter(|kind| kind.points() == kind.corners())
}

/// VTK's number of a cell of first order.
fn number(kind: CellKind) -> Option<u8> {
    vtk_type(kind).filter(|&number| self::kind(number.into()) == Some(kind))
}

/// Whether the first word that is not a comment is one of the keywords that files start with.
fn recognises(bytes: &[u8]) -> bool {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'%');
    let word = scan.word().unwrap_or_default();
    ["NDIME", "NZONE", "NELEM", "NPOIN", "NCHUNK", "AOA", "IZONE"]
        .iter()
        .any(|known| {
            word.strip_prefix(known.as_bytes())
                .is_some_and(|rest| rest.is_empty() || rest[0] == b'=')
        })
}

/// A marker: its name and cells.
type Marker = (String, Vec<(CellKind, Vec<u64>)>);

/// One zone, whose points count from 0.
#[derive(Default)]
struct Zone {
    points: Vec<[f64; 3]>,
    cells: Vec<(CellKind, Vec<u64>)>,
    markers: Vec<Marker>,
}

fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'%');
    let mut content = Content::default();
    let mut zones = vec![Zone::default()];
    let (mut dimension, mut tag) = (0, String::new());
    while scan.peek().is_some() {
        scan.skip_blanks();
        let line = scan.clone().line();
        let line = String::from_utf8_lossy(line);
        let Some((key, value)) = line.split_once('=') else {
            return Err(scan.error(format!("expected a keyword with =, found {}", scan.shown())));
        };
        let key = key.trim().to_ascii_uppercase();
        let value = value
            .split('%')
            .next()
            .unwrap_or_default()
            .trim()
            .to_owned();
        scan.section.clone_from(&key);
        let number = |scan: &Scan<'_>| {
            let first = value
                .split_whitespace()
                .next()
                .and_then(|word| word.parse::<u64>().ok());
            first.ok_or_else(|| scan.error(format!("expected an integer, found {value:?}")))
        };
        let zone = zones.len() - 1;
        match key.as_str() {
            "NDIME" => match number(&scan)? {
                found @ (2 | 3) if dimension == 0 || dimension == found as usize => {
                    dimension = found as usize
                }
                other => {
                    return Err(scan.error(format!(
                        "the dimension is 2 or 3 and the same in all zones, not {other}"
                    )));
                }
            },
            "IZONE" if !zones[zone].points.is_empty() => zones.push(Zone::default()),
            "NELEM" => {
                let count = scan.believe(number(&scan)?, "cells", 4)?;
                scan.line();
                zones[zone].cells = cells(&mut scan, count)?;
                continue;
            }
            "NPOIN" => {
                let count = scan.believe(number(&scan)?, "points", 2)?;
                if dimension == 0 {
                    return Err(scan.error("the points come before NDIME"));
                }
                scan.line();
                for _ in 0..count {
                    let mut point = [0.0; 3];
                    for x in point.iter_mut().take(dimension) {
                        *x = scan.f64()?;
                    }
                    // The number of the point may follow; it is its place.
                    scan.line();
                    zones[zone].points.push(point);
                }
                continue;
            }
            "MARKER_TAG" => tag.clone_from(&value),
            "MARKER_ELEMS" => {
                let count = scan.believe(number(&scan)?, "cells", 3)?;
                scan.line();
                let cells = cells(&mut scan, count)?;
                zones[zone].markers.push((tag.clone(), cells));
                continue;
            }
            "NZONE" | "IZONE" | "NMARK" | "AOA" | "AOS" | "NCHUNK" | "SEND_TO" | "SEND_RECV"
            | "FFD_NBOX" => {
                if matches!(key.as_str(), "SEND_TO" | "SEND_RECV") {
                    content.unread.tell(
                        &*tag,
                        format!(
                            "the partition that the marker {tag:?} is sent to or received from"
                        ),
                    );
                }
            }
            _ => {
                content.unread.tell(&*key, format!("{key}= {value}"));
                scan.line();
                while scan.peek().is_some() && !scan.clone().line().contains(&b'=') {
                    scan.skip_blanks();
                    if scan.clone().line().contains(&b'=') {
                        break;
                    }
                    scan.line();
                }
                continue;
            }
        }
        scan.line();
    }
    scan.section.clear();
    content.mesh = build(&scan, zones)?;
    Ok(content)
}

/// Rows of type, nodes, and perhaps a number.
fn cells(scan: &mut Scan<'_>, count: usize) -> Result<Vec<(CellKind, Vec<u64>)>> {
    let mut cells = Vec::new();
    for _ in 0..count {
        let number = scan.u64()?;
        let kind = kind(number);
        let kind = kind.ok_or_else(|| scan.error(format!("{number} is not a type of cells")))?;
        let nodes = (0..kind.points())
            .map(|_| scan.u64())
            .collect::<Result<_>>()?;
        scan.line();
        cells.push((kind, nodes));
    }
    Ok(cells)
}

fn build(scan: &Scan<'_>, zones: Vec<Zone>) -> Result<Mesh> {
    let mut builder = Builder::default();
    let (mut firsts, many) = (Vec::new(), zones.len() > 1);
    let points =
        |(kind, nodes): &(CellKind, Vec<u64>), first: usize, count: usize| -> Result<Vec<u32>> {
            let point = |&node: &u64| match usize::try_from(node) {
                Ok(node) if node < count => Ok((first + node) as u32),
                _ => Err(scan.error(format!(
                    "a {kind} has the point {node}, which does not exist among {count}"
                ))),
            };
            nodes.iter().map(point).collect()
        };
    for (zone, place) in zones.iter().zip(1..) {
        let first = builder.mesh.points.len();
        firsts.push(first);
        builder.mesh.points.to_mut().extend_from_slice(&zone.points);
        let from = builder.cell_count();
        for cell in &zone.cells {
            let nodes = points(cell, first, zone.points.len())?;
            let number = builder.new_number();
            builder.cell(cell.0, &nodes, number, 0);
        }
        if many {
            let to = builder.cell_count();
            builder.set(&format!("zone {place}"), from..to);
        }
    }
    for (zone, first) in zones.iter().zip(firsts) {
        for (name, cells) in &zone.markers {
            let mut sides = Vec::new();
            for cell in cells {
                let nodes = points(cell, first, zone.points.len())?;
                sides.push(builder.side(cell.0, &nodes));
            }
            builder.set(name, sides);
        }
    }
    if builder.mesh.points.is_empty() {
        return Err(scan.error("the file has no points"));
    }
    builder.finish_points(scan, Numbering::default())?;
    Ok(builder.finish())
}

/// Writes the cells of the highest dimension, and the groups of their sides as markers.
fn write(job: Job<'_>) -> Result<Vec<String>> {
    let Job {
        path,
        mesh,
        mut losses,
        ..
    } = job;
    let dim = mesh.dim().max(2);
    let kinds: Vec<(CellKind, &[u32])> =
        mesh.cells().map(|(_, kind, nodes)| (kind, nodes)).collect();
    let mut marked = vec![false; kinds.len()];
    let markers: Vec<_> = mesh
        .groups
        .iter()
        .filter(|group| group.dim + 1 == dim)
        .collect();
    markers.iter().for_each(|group| {
        group
            .cells
            .iter()
            .for_each(|&cell| marked[cell as usize] = true)
    });
    let lost = kinds
        .iter()
        .zip(&marked)
        .filter(|((kind, _), marked)| number(*kind).is_none() || (kind.dim() < dim && !**marked));
    losses.lose_some(
        lost.count(),
        "cells of second order, or sides in no group and smaller cells",
    );
    losses.lose_some(
        mesh.groups.len() - markers.len(),
        "groups that are not sides of the mesh",
    );
    losses.lose_fields(&mesh.fields);
    if dim == 2 {
        let raised = mesh.points.iter().filter(|point| point[2] != 0.0).count();
        losses.lose_some(
            raised,
            "points with a third coordinate in a mesh of two dimensions",
        );
    }
    losses.note_gmsh(mesh);

    let mut out = Out::to(path)?;
    let cell = |out: &mut Out, (kind, nodes): (CellKind, &[u32])| {
        if let Some(number) = number(kind) {
            out.int(number);
            nodes.iter().for_each(|&node| {
                out.int(node);
            });
            out.end();
        }
    };
    let whole: Vec<_> = kinds
        .iter()
        .copied()
        .filter(|(kind, _)| kind.dim() == dim && number(*kind).is_some())
        .collect();
    if whole.is_empty() {
        let what = "of its cells in the plane or in space it has none";
        return Err(Error::whole(path, what, "choose another format"));
    }
    out.text(&format!("NDIME= {dim}\nNELEM= {}\n", whole.len()));
    whole.into_iter().for_each(|whole| cell(&mut out, whole));
    out.text(&format!("NPOIN= {}\n", mesh.points.len()));
    for point in &mesh.points {
        point[..usize::from(dim)].iter().for_each(|&x| {
            out.float(x);
        });
        out.end();
    }
    out.text(&format!("NMARK= {}\n", markers.len()));
    for group in markers {
        let name = group.name.clone().unwrap_or_else(|| {
            let name = group.tag.to_string();
            losses.called(group, &name);
            name
        });
        if name.contains(['\n', '\r', '%']) || name.trim() != name {
            losses.lose(format!(
                "the name {name:?}, which has a line end, a % or blanks around it"
            ));
        }
        let sides = group
            .cells
            .iter()
            .map(|&cell| kinds[cell as usize])
            .filter(|(kind, _)| number(*kind).is_some());
        let sides: Vec<_> = sides.collect();
        out.text(&format!(
            "MARKER_TAG= {}\nMARKER_ELEMS= {}\n",
            name.replace(['\n', '\r', '%'], " "),
            sides.len()
        ));
        sides.into_iter().for_each(|side| cell(&mut out, side));
    }
    losses.settle(path, || out.save(path))
}
