//! The differences of two files as VTU, on the points and cells of the first.

use std::path::Path;

use faceoff_judge::{Comparison, On};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{GlobalArray, Results};
use faceoff_mesh::io::vtu::{self, Compressor, Encoding};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Writes a - b of every field to `path`, NaN where a field is not carried. Cells get points of their own where a
/// field may jump between them.
///
/// # Errors
/// A first file without coordinates, and a file that cannot be written.
pub fn write_differences(path: &Path, a: &Results, comparison: &Comparison) -> Result<()> {
    super::check_vtu_path(path)?;
    if a.points.is_empty() {
        return Err(Error::usage(
            format!(
                "{} has no coordinates, so that its differences have no place",
                a.source
            ),
            "leave out --out, or name the file with the mesh first",
        ));
    }
    if comparison.differences.is_empty() {
        return Err(Error::usage(
            "two meshes with other cells have no mesh on which differences could be written",
            "leave out --out, or write one result on the mesh of the other by --project",
        ));
    }
    let corners = comparison.differences.iter().find(|d| d.on == On::Corners);
    let mut mesh = Mesh {
        points: corners.map_or_else(|| a.points.clone(), |d| d.places.clone()),
        ..Mesh::default()
    };
    let mut cell = 0;
    let mut corner = 0u32;
    for &(kind, count) in &a.kinds {
        let mut nodes = Vec::with_capacity(count * kind.points());
        for _ in 0..count {
            match corners {
                Some(_) => {
                    nodes.extend(corner..corner + kind.points() as u32);
                    corner += kind.points() as u32;
                }
                None => nodes.extend(a.cell(cell)),
            }
            cell += 1;
        }
        mesh.blocks.push(CellBlock::new(kind, nodes));
    }
    if a.kinds.is_empty() {
        let points = (0..mesh.points.len() as u32).collect();
        mesh.blocks.push(CellBlock::new(CellKind::Vertex, points));
    }
    let mut fields = Vec::new();
    for set in &comparison.differences {
        let support = match (set.on, corners) {
            (On::Cells, _) => Support::Cells,
            (On::Corners, _) | (On::Points, None) => Support::Points,
            // Values on points of which there are several now.
            (On::Points, Some(_)) | (On::Whole | On::Functions | On::Domain, _) => continue,
        };
        for (name, components, values) in &set.fields {
            let values = Values::F64(values.clone());
            fields.push(Field::new(name.clone(), support, *components, values));
        }
    }
    let whole = [
        GlobalArray::text("faceoff", env!("CARGO_PKG_VERSION")),
        GlobalArray::texts(
            "difference of",
            vec![comparison.a.clone(), comparison.b.clone()],
        ),
    ];
    vtu::write(
        path,
        &mesh,
        &fields,
        &whole,
        Encoding::Raw(Compressor::Zlib),
    )
}
