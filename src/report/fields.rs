//! Fields as VTU: the cells for viewing, and the faces in a separate file with exact values.

use std::path::Path;

use crate::campaigns::verify::{CaseOutcome, VerifyOutcome};
use crate::engine::Case;
use crate::run::function::{at_nodes, at_vertices, block, broken_mesh, nodes};
use faceoff_fem::certify::Certificate;
use faceoff_fem::contact::{ContactSet, Problem, face_fields};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ColumnKind, FaceFields, GlobalArray};
use faceoff_mesh::io::vtu::{self, Compressor, Encoding};
use faceoff_mesh::mesh::{CellKind, Field, Mesh, Support, Values};

/// Binary64 bit for bit, in valid XML.
pub(super) const ENCODING: Encoding = Encoding::Base64(Compressor::Zlib);

/// Checks the path of a solution: `FILE.vtu` in an existing folder.
///
/// # Errors
/// Another suffix, or no such folder.
pub fn check_vtu_path(path: &Path) -> Result<()> {
    if path.extension().is_none_or(|e| e != "vtu") {
        return Err(Error::usage(
            format!("{} does not end in .vtu", path.display()),
            "name the output FILE.vtu",
        ));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if folder.is_dir() {
        return Ok(());
    }
    Err(Error::usage(
        format!("{} is not a folder", folder.display()),
        "make it first",
    ))
}

/// Writes one solution: its cells to `path`, with the bounds of a certificate, its faces to a second file in the same folder,
/// `…-faces.vtu`.
///
/// # Errors
/// Files that cannot be written.
pub fn write_solution(
    path: &Path,
    case: &Case,
    u: &[f64],
    engine: &str,
    version: &str,
    certificate: Option<&Certificate>,
) -> Result<()> {
    let fields = [face_fields(&case.problem, u, engine)];
    let certified = certificate.map(|c| certified_fields(&case.problem, c));
    let solution = (engine, version, u);
    let certified = certified.unwrap_or_default();
    write_both(path, case, &[solution], &fields, certified)
}

/// The same as [`write_solution`] for a field from a file, whose code is not known.
///
/// # Errors
/// Files that cannot be written.
pub fn write_certified(
    path: &Path,
    case: &Case,
    u: &[f64],
    certificate: &Certificate,
) -> Result<()> {
    write_solution(path, case, u, "given", "field", Some(certificate))
}

/// Writes every case of an outcome to `SCENE-METHOD-nN.vtu` and `…-faces.vtu` in `folder`.
///
/// # Errors
/// Files that cannot be written.
pub fn write_fields(folder: &Path, outcome: &VerifyOutcome) -> Result<()> {
    for case in &outcome.cases {
        // The judged case has the fields; its mesh and space are cheap to make again.
        let again = case.setup.case()?;
        let n = case.n.map_or(String::new(), |n| format!("-n{n}"));
        let path = folder.join(format!("{}-{}{n}.vtu", case.scene, file_name(case)));
        let engines = case.engines.iter();
        let solutions: Vec<_> = engines
            .map(|e| (&*e.engine, &*e.version, &*e.answer.u))
            .collect();
        write_both(&path, &again, &solutions, &case.fields, Vec::new())?;
    }
    Ok(())
}

/// A code, its version and its u.
type Solution<'a> = (&'a str, &'a str, &'a [f64]);

/// The cells with additional fields, and the faces.
fn write_both(
    path: &Path,
    case: &Case,
    solutions: &[Solution],
    fields: &[FaceFields],
    further: Vec<Field>,
) -> Result<()> {
    let whole = provenance(case, solutions);
    let (mesh, of_cells) = cells(&case.problem, solutions, further);
    vtu::write(path, &mesh, &of_cells, &whole, ENCODING)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let path = path.with_file_name(format!("{stem}-faces.vtu"));
    let (mesh, of_faces) = faces(&case.problem, solutions, fields);
    vtu::write(&path, &mesh, &of_faces, &whole, ENCODING)
}

/// `p2(1,0)` as part of a file's name.
fn file_name(case: &CaseOutcome) -> String {
    case.method.replace(['(', ','], "_").replace(')', "")
}

/// The values of a field, as a file stores them.
pub(super) fn of_numbers(
    name: impl Into<String>,
    on: Support,
    components: usize,
    values: Vec<f64>,
) -> Field {
    Field::new(name.into(), on, components, Values::F64(values.into()))
}

/// The source of the values.
fn provenance(case: &Case, solutions: &[Solution]) -> Vec<GlobalArray> {
    let problem = &case.problem;
    let engines = solutions.iter();
    let engines = engines.map(|(name, version, _)| format!("{name} {version}"));
    vec![
        GlobalArray::text("faceoff", env!("CARGO_PKG_VERSION")),
        GlobalArray::text("scene", case.scene().name()),
        GlobalArray::text("method", problem.method().to_string()),
        GlobalArray::texts("engines", engines.collect()),
        GlobalArray::text("mesh", &*problem.space.mesh.name),
        GlobalArray::text("mesh digest", problem.space.mesh.digest()),
        GlobalArray::texts(
            "quadrature",
            vec![problem.cell_rule.name.into(), problem.face_rule.name.into()],
        ),
        GlobalArray::numbers(
            "gamma0",
            Values::F64(vec![problem.discretisation.gamma0].into()),
        ),
    ]
}

/// Cells with separate vertices, so that a viewer shows jumps: u as DG1 on the points,
/// means and gradients on the cells, and the differences to the first engine.
fn cells(problem: &Problem, solutions: &[Solution], mut fields: Vec<Field>) -> (Mesh, Vec<Field>) {
    let space = &problem.space;
    let source = space.mesh;
    let corners = source.dim + 1;
    let cells = source.cell_count();
    let mut add = |name: String, on, components, values| {
        fields.push(of_numbers(name, on, components, values));
    };
    let mut first: Option<(&str, Vec<f64>)> = None;
    for (engine, _, u) in solutions {
        let values = at_nodes(problem, u);
        let (mut means, mut gradients) = (Vec::new(), Vec::new());
        for cell in 0..cells {
            let geometry = source.geometry(cell);
            let local = space.local(cell, u);
            let at = |lambda: &[f64; 4]| -> f64 {
                let phi = space.element.values(source.dim, lambda);
                phi.iter().zip(&local).map(|(p, u)| p * u).sum()
            };
            let rule = &problem.cell_rule;
            means.push(rule.iter().map(|(lambda, w)| w * at(&lambda)).sum());
            let mut center = [0.0; 4];
            center[..corners].fill(1.0 / corners as f64);
            let gradient = space.slope(&geometry, &center, &local);
            gradients.extend_from_slice(gradient.as_slice());
        }
        match &first {
            None => first = Some((engine, values.clone())),
            Some((reference, of_reference)) => {
                let name = format!("u {engine} - {reference}");
                add(name, Support::Points, 1, difference(&values, of_reference));
            }
        }
        add(format!("u {engine}"), Support::Points, 1, values);
        add(format!("mean {engine}"), Support::Cells, 1, means);
        add(format!("gradient {engine}"), Support::Cells, 3, gradients);
    }
    (broken_mesh(problem), fields)
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// v at the cells' nodes; on the cells the averaged gradient, which is the most accurate known one, and
/// the root of each cell's contribution to the square of the bound.
fn certified_fields(problem: &Problem, certificate: &Certificate) -> Vec<Field> {
    let mesh = problem.space.mesh;
    let (_, places) = nodes(problem);
    let v = (0..mesh.cell_count()).flat_map(|cell| {
        let mut at_corners = [[0.0]; 4];
        for (at_corner, &vertex) in at_corners.iter_mut().zip(mesh.cell(cell)) {
            *at_corner = [certificate.fields.v[vertex as usize]];
        }
        let at = move |lambda: &[f64; 4]| at_vertices(lambda, &at_corners)[0];
        places.iter().map(at)
    });
    let gradients = certificate.fields.gradient.iter().flatten();
    let gradients = gradients.copied().collect();
    let local = (0..certificate.local.len()).map(|cell| certificate.part(cell));
    vec![
        of_numbers("admissible v", Support::Points, 1, v.collect()),
        of_numbers("averaged gradient", Support::Cells, 3, gradients),
        of_numbers("bound", Support::Cells, 1, local.collect()),
    ]
}

/// The faces as cells, on the mesh's vertices: exact dofs, every compared field of every
/// engine, and the differences to the first. Values that a face does not have are NaN. In 3D also the
/// fraction of each contact face that is in contact, and the number of its zone, -1 if there is none.
fn faces(problem: &Problem, solutions: &[Solution], engines: &[FaceFields]) -> (Mesh, Vec<Field>) {
    let source = problem.space.mesh;
    let faces = source.face_count();
    let kind = match source.dim {
        2 => CellKind::Line,
        _ => CellKind::Triangle,
    };
    let nodes = (0..faces).flat_map(|f| source.face(f)).copied().collect();
    let mesh = block(source.points.clone(), kind, nodes);
    let part = |face: usize| problem.parts[face].map_or(0, |part| part as i32);
    let mut gamma = vec![f64::NAN; faces];
    for face in &problem.contact {
        gamma[face.face] = face.gamma;
    }
    let parts = (0..faces).map(part).collect();
    let on = Support::Cells;
    let mut fields = vec![
        Field::new("part".to_owned(), on, 1, Values::I32(parts)),
        of_numbers("gamma", on, 1, gamma),
    ];
    for (engine, _, u) in solutions {
        let mut values = Vec::new();
        let mut components = 0;
        for face in 0..faces {
            let cell = source.face_cells(face)[0] as usize;
            let local = source.local_face(cell, face);
            let mut dofs: Vec<u32> = problem.space.face_dofs(cell, local).collect();
            // Vertices come before edges, each ascending: the same order from either cell.
            dofs.sort_unstable();
            components = dofs.len();
            values.extend(dofs.iter().map(|&dof| u[dof as usize]));
        }
        fields.push(of_numbers(format!("dofs {engine}"), on, components, values));
        if let ContactSet::Zones(zones) = ContactSet::new(problem, u) {
            let mut shares = vec![f64::NAN; faces];
            let mut numbers = vec![-1; faces];
            for face in &problem.contact {
                shares[face.face] = 0.0;
            }
            for face in &zones.faces {
                shares[face.face] = face.share;
                numbers[face.face] = face.zone as i32;
            }
            let name = format!("zone {engine}");
            fields.push(of_numbers(format!("contact {engine}"), on, 1, shares));
            fields.push(Field::new(name, on, 1, Values::I32(numbers.into())));
        }
    }
    let Some(first) = engines.first() else {
        return (mesh, fields);
    };
    for column in &first.columns {
        let spread = |of: &FaceFields| -> Option<Vec<f64>> {
            let column = of.column(&column.name)?;
            let mut values = vec![f64::NAN; faces * column.components];
            for (k, &face) in column.faces.iter().enumerate() {
                let start = face as usize * column.components;
                values[start..start + column.components].copy_from_slice(column.row(k));
            }
            Some(values)
        };
        // The status is judged by the sign of P; the file contains P.
        let name = match column.kind {
            ColumnKind::Value => column.name.as_str(),
            ColumnKind::Status => "P",
        };
        let reference = spread(first);
        for engine in engines {
            let Some(values) = spread(engine) else {
                continue;
            };
            let (components, source) = (column.components, &engine.source);
            if let (Some(reference), true) = (&reference, *source != first.source) {
                let difference = difference(&values, reference);
                let name = format!("{name} {source} - {}", first.source);
                fields.push(of_numbers(name, on, components, difference));
            }
            fields.push(of_numbers(
                format!("{name} {source}"),
                on,
                components,
                values,
            ));
        }
    }
    (mesh, fields)
}
