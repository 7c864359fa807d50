//! Nodes of MSH 1.0 and 2.x.

use super::bulk;
use super::layout::Reader;
use crate::error::Result;
use crate::io::builder::{Builder, Numbering};
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{PointRun, all_finite};

/// `$NOD`, `$Nodes`: their number, then number and coordinates of each.
pub fn nodes(reader: &mut Reader<'_>) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let count = text_count(scan, "nodes", scan.least(8, 28))?;
    if scan.numbers != Numbers::Ascii {
        let tags = binary_nodes(scan, builder, count)?;
        return builder.finish_points(scan, tags);
    }
    let mut tags = Numbering::default();
    builder.mesh.points.to_mut().reserve_exact(count);
    for _ in 0..count {
        tags.push(scan.tag()?);
        let point = scan.xyz()?;
        builder.mesh.points.to_mut().push(point);
    }
    builder.finish_points(scan, tags)
}

/// [`nodes`] of a binary file, all at once; their numbers.
fn binary_nodes(scan: &mut Scan<'_>, builder: &mut Builder, count: usize) -> Result<Numbering> {
    let numbers = scan.numbers;
    let start = scan.clone();
    let bytes = scan.bytes(count, 28)?;
    let (words, _) = bytes.as_chunks::<4>();
    let points = bulk::points(bytes, 4, numbers);
    let mut tags = Numbering::default();
    let counted = bulk::count_on(words, 7, 1, numbers);
    if counted {
        tags.count_on(count);
    } else {
        tags.append(bulk::first_words(words, 7, numbers));
    }
    if !counted || !all_finite(points.as_flattened()) {
        // Find the first error, reading one by one.
        let mut place = start;
        for _ in 0..count {
            place.tag()?;
            place.xyz()?;
        }
    }
    builder.mesh.points = points.into();
    Ok(tags)
}

/// `$ParametricNodes`: nodes with the entity on which they lie and their parameters on it.
pub fn parametric_nodes(reader: &mut Reader<'_>) -> Result<()> {
    let Reader { scan, builder, .. } = reader;
    let count = text_count(scan, "nodes", scan.least(12, 36))?;
    let mut tags = Numbering::default();
    let mut runs: Vec<PointRun> = Vec::new();
    for _ in 0..count {
        tags.push(scan.tag()?);
        let point = scan.xyz()?;
        builder.mesh.points.to_mut().push(point);
        let (dim, entity) = (scan.i32()?, scan.i32()?);
        let dim = u8::try_from(dim).ok().filter(|dim| *dim <= 3);
        let dim = dim.ok_or_else(|| scan.error("the dimension of an entity is 0 to 3"))?;
        if runs
            .last()
            .is_none_or(|run| (run.dim, run.entity) != (dim, entity))
        {
            runs.push(PointRun {
                dim,
                entity,
                count: 0,
                parameters: Some(Vec::new()),
            });
        }
        if let Some(PointRun {
            count,
            parameters: Some(parameters),
            ..
        }) = runs.last_mut()
        {
            *count += 1;
            // Gmsh gives the coordinates on curves and surfaces; points and volumes have none here.
            for _ in 0..if dim == 3 { 0 } else { dim } {
                parameters.push(scan.f64()?);
            }
        }
    }
    for run in runs.iter_mut().filter(|run| run.dim == 3) {
        run.parameters = None;
    }
    builder.mesh.geometry.point_runs = runs;
    builder.finish_points(scan, tags)
}

/// A count that is text even in binary files; the rest of its line is skipped.
pub fn text_count(scan: &mut Scan<'_>, of: &str, bytes: usize) -> Result<usize> {
    let numbers = std::mem::replace(&mut scan.numbers, Numbers::Ascii);
    let declared = scan.u64()?;
    if numbers != Numbers::Ascii {
        scan.line();
    }
    scan.numbers = numbers;
    scan.believe(declared, of, bytes)
}
