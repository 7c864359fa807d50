//! Fields as VTU: the cells for viewing, and the faces as cells of their own with exact values.

use std::path::{Path, PathBuf};

use crate::campaigns::verify::{CaseOutcome, VerifyOutcome};
use crate::engine::Case;
use faceoff_fem::certify::Certificate;
use faceoff_fem::contact::{ContactSet, Problem, face_fields};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ColumnKind, FaceFields, GlobalArray};
use faceoff_mesh::io::vtu::{self, Compressor, Encoding};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

/// Binary64 bit for bit, and still XML.
const ENCODING: Encoding = Encoding::Base64(Compressor::Zlib);

/// Makes the folder that a report goes to, or checks that it is one.
///
/// # Errors
/// A path that is a file, or that cannot be made.
pub fn prepare_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(Error::io(folder, "make"))
}

/// A solution goes to `FILE.vtu` in a folder that is there.
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
        format!("{} is no folder", folder.display()),
        "make it first",
    ))
}

/// Writes one solution: its cells to `path`, with what a certificate knows of them, its faces beside it
/// as `…-faces.vtu`.
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
    let fields = face_fields(&case.problem, u, engine);
    let whole = provenance(case, &[(engine, version)]);
    let certified = certificate.map(|c| certified_fields(&case.problem, c));
    let certified = certified.unwrap_or_default();
    write_cells(path, &case.problem, &[(engine, u)], certified, &whole)?;
    write_faces(
        &faces_path(path),
        &case.problem,
        &[(engine, u)],
        &[&fields],
        &whole,
    )
}

/// Writes every case of an outcome to `SCENE-METHOD-nN.vtu` and `…-faces.vtu` in `folder`.
///
/// # Errors
/// Files that cannot be written.
pub fn write_fields(folder: &Path, outcome: &VerifyOutcome) -> Result<()> {
    for case in &outcome.cases {
        // The judged case has the fields; its mesh and space are cheap to have again.
        let again = case.setup.case()?;
        let n = case.n.map_or(String::new(), |n| format!("-n{n}"));
        let path = folder.join(format!("{}-{}{n}.vtu", case.scene, file_name(case)));
        let engines: Vec<(&str, &str)> = case
            .engines
            .iter()
            .map(|e| (e.engine.as_str(), e.version.as_str()))
            .collect();
        let solutions: Vec<(&str, &[f64])> = case
            .engines
            .iter()
            .map(|e| (e.engine.as_str(), e.answer.u.as_slice()))
            .collect();
        let whole = provenance(&again, &engines);
        write_cells(&path, &again.problem, &solutions, Vec::new(), &whole)?;
        let fields: Vec<&FaceFields> = case.fields.iter().collect();
        write_faces(
            &faces_path(&path),
            &again.problem,
            &solutions,
            &fields,
            &whole,
        )?;
    }
    Ok(())
}

/// `p2(1,0)` as part of a file's name.
fn file_name(case: &CaseOutcome) -> String {
    case.method.replace(['(', ','], "_").replace(')', "")
}

fn faces_path(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-faces.vtu"))
}

/// Where the values come from.
fn provenance(case: &Case, engines: &[(&str, &str)]) -> Vec<GlobalArray> {
    let problem = &case.problem;
    let engines = engines
        .iter()
        .map(|(name, version)| format!("{name} {version}"));
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
        GlobalArray::numbers("gamma0", Values::F64(vec![problem.discretisation.gamma0])),
    ]
}

/// Cells with vertices of their own, so that a viewer shows what jumps: u as DG1 on the points,
/// means and gradients on the cells, and the differences to the first engine.
fn write_cells(
    path: &Path,
    problem: &Problem,
    solutions: &[(&str, &[f64])],
    mut fields: Vec<Field>,
    whole: &[GlobalArray],
) -> Result<()> {
    let space = &problem.space;
    let source = space.mesh;
    let corners = source.dim + 1;
    let cells = source.cell_count();
    let kind = if source.dim == 2 {
        CellKind::Triangle
    } else {
        CellKind::Tetrahedron
    };
    let mesh = Mesh {
        points: (0..cells)
            .flat_map(|cell| source.cell(cell))
            .map(|&v| source.points[v as usize])
            .collect(),
        blocks: vec![CellBlock::new(
            kind,
            (0..(cells * corners) as u32).collect(),
        )],
        ..Mesh::default()
    };
    let mut first: Option<(&str, Vec<f64>)> = None;
    for (engine, u) in solutions {
        let (mut values, mut means, mut gradients) = (Vec::new(), Vec::new(), Vec::new());
        for cell in 0..cells {
            let geometry = source.geometry(cell);
            let local = space.local(cell, u);
            let at = |lambda: &[f64; 4]| -> f64 {
                let phi = space.element.values(source.dim, lambda);
                phi.iter().zip(&local).map(|(p, u)| p * u).sum()
            };
            for corner in 0..corners {
                let mut lambda = [0.0; 4];
                lambda[corner] = 1.0;
                values.push(at(&lambda));
            }
            let rule = &problem.cell_rule;
            means.push(rule.iter().map(|(lambda, w)| w * at(&lambda)).sum());
            let mut center = [0.0; 4];
            center[..corners].fill(1.0 / corners as f64);
            let basis = space.gradients(&geometry, &center);
            let gradient = faceoff_fem::contact::gradient(&basis, &local);
            gradients.extend_from_slice(gradient.as_slice());
        }
        match &first {
            None => first = Some((engine, values.clone())),
            Some((reference, of_reference)) => {
                let difference = values.iter().zip(of_reference).map(|(a, b)| a - b);
                fields.push(Field::new(
                    format!("u {engine} - {reference}"),
                    Support::Points,
                    1,
                    Values::F64(difference.collect()),
                ));
            }
        }
        fields.push(Field::new(
            format!("u {engine}"),
            Support::Points,
            1,
            Values::F64(values),
        ));
        fields.push(Field::new(
            format!("mean {engine}"),
            Support::Cells,
            1,
            Values::F64(means),
        ));
        fields.push(Field::new(
            format!("gradient {engine}"),
            Support::Cells,
            3,
            Values::F64(gradients),
        ));
    }
    vtu::write(path, &mesh, &fields, whole, ENCODING)
}

/// v on the cells' own vertices; on the cells the averaged gradient, the most accurate that is known, and
/// the root of what each adds to the square of the bound.
fn certified_fields(problem: &Problem, certificate: &Certificate) -> Vec<Field> {
    let vertices = problem.space.mesh.all_cells().iter();
    let v = vertices.map(|&vertex| certificate.fields.v[vertex as usize]);
    let gradients = certificate.fields.gradient.iter().flatten();
    let local = certificate.local.iter().map(|part| part.sqrt());
    let field = |name: &str, on, components, values| {
        Field::new(name.to_owned(), on, components, Values::F64(values))
    };
    vec![
        field("admissible v", Support::Points, 1, v.collect()),
        field(
            "averaged gradient",
            Support::Cells,
            3,
            gradients.copied().collect(),
        ),
        field("bound", Support::Cells, 1, local.collect()),
    ]
}

/// The faces as cells, on the mesh's own vertices: exact dofs, every compared field of every
/// engine, and the differences to the first. What a face does not carry is NaN. In space also the
/// part of each contact face that is in contact, and the number of its zone, -1 where there is none.
fn write_faces(
    path: &Path,
    problem: &Problem,
    solutions: &[(&str, &[f64])],
    engines: &[&FaceFields],
    whole: &[GlobalArray],
) -> Result<()> {
    let source = problem.space.mesh;
    let faces = source.face_count();
    let kind = if source.dim == 2 {
        CellKind::Line
    } else {
        CellKind::Triangle
    };
    let mesh = Mesh {
        points: source.points.clone(),
        blocks: vec![CellBlock::new(
            kind,
            (0..faces).flat_map(|f| source.face(f)).copied().collect(),
        )],
        ..Mesh::default()
    };
    let on_cells = |name: String, components: usize, values: Values| {
        Field::new(name, Support::Cells, components, values)
    };
    let part = |face: usize| problem.parts[face].map_or(0, |part| part as i32);
    let mut gamma = vec![f64::NAN; faces];
    for face in &problem.contact {
        gamma[face.face] = face.gamma;
    }
    let mut fields = vec![
        on_cells(
            "part".into(),
            1,
            Values::I32((0..faces).map(part).collect()),
        ),
        on_cells("gamma".into(), 1, Values::F64(gamma)),
    ];
    for (engine, u) in solutions {
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
        fields.push(on_cells(
            format!("dofs {engine}"),
            components,
            Values::F64(values),
        ));
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
            fields.push(on_cells(
                format!("contact {engine}"),
                1,
                Values::F64(shares),
            ));
            fields.push(on_cells(format!("zone {engine}"), 1, Values::I32(numbers)));
        }
    }
    let Some(first) = engines.first() else {
        return vtu::write(path, &mesh, &fields, whole, ENCODING);
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
        // The status is judged by the sign of P; what is kept is P itself.
        let name = match column.kind {
            ColumnKind::Value => column.name.as_str(),
            ColumnKind::Status => "P",
        };
        let reference = spread(first);
        for engine in engines {
            let Some(values) = spread(engine) else {
                continue;
            };
            if let (Some(reference), true) = (&reference, engine.source != first.source) {
                let difference = values.iter().zip(reference).map(|(a, b)| a - b);
                fields.push(on_cells(
                    format!("{name} {} - {}", engine.source, first.source),
                    column.components,
                    Values::F64(difference.collect()),
                ));
            }
            fields.push(on_cells(
                format!("{name} {}", engine.source),
                column.components,
                Values::F64(values),
            ));
        }
    }
    vtu::write(path, &mesh, &fields, whole, ENCODING)
}
