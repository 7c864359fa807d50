//! The differences of two files as VTU, on the points and cells of the first.

use std::path::Path;

use super::fields::of_numbers;
use faceoff_judge::{Comparison, On, Projection};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{GlobalArray, Results};
use faceoff_mesh::io::vtu::{self, Compressor, Encoding};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Writes a - b of every field to `path`, NaN where a field is not defined. Cells get separate points if a
/// field may jump between them. For functions on different meshes, each cell of the first has the largest |a - b| and both means.
///
/// # Errors
/// A first file without coordinates, and a file that cannot be written.
pub fn write_differences(path: &Path, a: &Results, comparison: &Comparison) -> Result<()> {
    super::check_vtu_path(path)?;
    let a = comparison.found.as_deref().unwrap_or(a);
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
            "no field has values on points or cells of both, so that there are no differences to write",
            "leave out --out",
        ));
    }
    let corners = comparison.differences.iter().find(|d| d.on == On::Corners);
    let mesh = mesh_of(a, corners.map(|d| d.places(a).to_vec()));
    let mut fields = Vec::new();
    for set in &comparison.differences {
        let support = match (set.on, corners) {
            (On::Cells, _) => Support::Cells,
            (On::Corners, _) | (On::Points, None) => Support::Points,
            // Values on points that are now several.
            (On::Points, Some(_)) | (On::Whole | On::Domain | On::Unread, _) => continue,
            (On::Functions, _) => {
                fields.extend(set.fields.iter().flat_map(of_function));
                continue;
            }
        };
        for (name, components, values) in &set.fields {
            fields.push(of_numbers(name, support, *components, values.clone()));
        }
    }
    let of = vec![comparison.a.clone(), comparison.b.clone()];
    write(path, &mesh, &fields, ("difference of", of))
}

/// With the entities that carry the values.
fn write(
    path: &Path,
    mesh: &Mesh,
    fields: &[Field],
    (name, of): (&str, Vec<String>),
) -> Result<()> {
    let whole = [
        GlobalArray::text("faceoff", env!("CARGO_PKG_VERSION")),
        GlobalArray::texts(name, of),
    ];
    vtu::write(path, mesh, fields, &whole, Encoding::Raw(Compressor::Zlib))
}

/// The values of a function per cell.
fn of_function((name, _, rows): &(String, usize, Vec<f64>)) -> [Field; 3] {
    let titles = [(0, "largest |a - b|"), (1, "mean of a"), (2, "mean of b")];
    titles.map(|(k, title)| {
        let column = rows.iter().skip(k).step_by(3).copied().collect();
        of_numbers(format!("{name}: {title}"), Support::Cells, 1, column)
    })
}

/// The cells of a result; with separate points, at these positions, if a field may jump between them.
fn mesh_of(of: &Results, corners: Option<Vec<[f64; 3]>>) -> Mesh {
    let is_broken = corners.is_some();
    let mut mesh = Mesh {
        points: corners.map_or_else(|| of.points.clone(), Into::into),
        ..Mesh::default()
    };
    let mut cell = 0;
    let mut corner = 0u32;
    for &(kind, count) in &of.kinds {
        let mut nodes = Vec::with_capacity(count * kind.points());
        for _ in 0..count {
            if is_broken {
                nodes.extend(corner..corner + kind.points() as u32);
                corner += kind.points() as u32;
            } else {
                nodes.extend(of.cell(cell));
            }
            cell += 1;
        }
        mesh.blocks.push(CellBlock::new(kind, nodes));
    }
    if of.kinds.is_empty() {
        let points = (0..mesh.points.len() as u32).collect();
        mesh.blocks.push(CellBlock::new(CellKind::Vertex, points));
    }
    mesh
}

/// Writes the fields of one result on the mesh of another.
///
/// # Errors
/// A file that cannot be written.
pub fn write_projection(path: &Path, projection: &Projection, onto: &str) -> Result<()> {
    super::check_vtu_path(path)?;
    let of = &projection.results;
    // The point of each corner.
    let points: Vec<usize> = (0..of.cell_count())
        .flat_map(|cell| of.cell(cell).map(|point| point as usize))
        .collect();
    let is_broken = !of.on_corners.is_empty();
    let places = || points.iter().map(|point| of.points[*point]).collect();
    let mesh = mesh_of(of, is_broken.then(places));
    let on_points = of.on_points.iter().map(|field| {
        let n = field.components;
        let values = match is_broken {
            true => points
                .iter()
                .flat_map(|p| &field.values[p * n..(p + 1) * n])
                .copied()
                .collect(),
            false => field.values.clone(),
        };
        (field, Support::Points, values)
    });
    let on_corners = of.on_corners.iter();
    let on_corners = on_corners.map(|f| (f, Support::Points, f.values.clone()));
    let on_cells = of.on_cells.iter();
    let on_cells = on_cells.map(|f| (f, Support::Cells, f.values.clone()));
    let fields = on_points.chain(on_corners).chain(on_cells);
    let fields = fields.map(|(field, on, values)| {
        let (name, components) = (field.name.clone(), field.components);
        Field::new(name, on, components, Values::F64(values))
    });
    let fields: Vec<Field> = fields.collect();
    let of = vec![of.source.clone(), onto.to_owned()];
    write(path, &mesh, &fields, ("projection", of))
}

/// What a projection preserved, one line per field, and the part of the mesh that has no values.
pub fn projected(projection: &Projection) -> Vec<String> {
    let lines = projection.integrals.iter().map(|(name, component, [before, after])| {
        format!(
            "projected `{name}`, component {component}: its integral {before:.16e} is {after:.16e}"
        )
    });
    let uncovered = (projection.uncovered > 1e-9).then(|| {
        format!(
            "{:.3e} of the mesh is not covered: values are NaN where nothing is",
            projection.uncovered
        )
    });
    lines.chain(uncovered).collect()
}
