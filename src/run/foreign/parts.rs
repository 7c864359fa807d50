//! Finds the parts of the boundary of a mesh that does not name them.

use super::near;
use faceoff_fem::scene::{Part, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Triangulation, carriers};

/// The relative tolerance for the sizes of two meshes of one domain.
const SAME_SIZE: f64 = 1e-6;

/// Gives a mesh the groups that the scene names: those of the mesh, or those of the scene's mesh at the same position; returns which.
///
/// # Errors
/// A mesh without the groups whose domain, or whose boundary parts, are not those of the scene's mesh.
pub(super) fn divide(scene: &Scene, mesh: &mut Triangulation) -> Result<&'static str> {
    if scene.parts(mesh).is_ok() {
        return Ok("its groups");
    }
    let own = scene.triangulation(None)?;
    let of_own = scene.parts(&own)?;
    if mesh.dim != own.dim {
        let what = format!("it is {}D, and the scene {}D", mesh.dim, own.dim);
        return Err(refuse(mesh, what));
    }
    let faces = faces_on(mesh, &own)?;
    let mut groups_of = vec![Vec::new(); own.face_count()];
    for (group, index) in own.groups.iter().zip(0..) {
        let faces = group.faces.iter();
        faces.for_each(|face| groups_of[*face as usize].push(index));
    }
    let mut groups = own.groups.clone();
    groups.iter_mut().for_each(|group| group.faces.clear());
    for &(face, carrier) in &faces {
        for &group in &groups_of[carrier] {
            let group: usize = group;
            groups[group].faces.push(face as u32);
        }
    }
    groups.retain(|group| !group.faces.is_empty());

    let parts = [
        ("Γ_C", Part::Contact),
        ("Γ_D", Part::Dirichlet),
        ("Γ_N", Part::Neumann),
    ];
    let whole: f64 = boundary(&own).map(|face| measure(&own, face)).sum();
    let mut sizes = vec![("the domain", volume(mesh), volume(&own), volume(&own))];
    for (name, part) in parts {
        let is_in = |face: usize| of_own[face] == Some(part);
        let here = faces.iter().filter(|(_, carrier)| is_in(*carrier));
        let here = here.map(|(face, _)| measure(mesh, *face)).sum();
        let there = boundary(&own).filter(|face| is_in(*face));
        let there = there.map(|face| measure(&own, face)).sum();
        sizes.push((name, here, there, whole));
    }
    let mut differ = sizes.iter().filter(|(_, here, there, scale)| {
        let off: f64 = here - there;
        off.abs() > SAME_SIZE * scale
    });
    if let Some((name, here, there, _)) = differ.next() {
        let own = &own.name;
        let what = format!("{name} measures {here} on it, and {there} on the scene's mesh {own}");
        return Err(refuse(mesh, what));
    }
    mesh.groups = groups;
    Ok("the scene's mesh at the same places")
}

/// The faces of the boundary, each with the face of another mesh's boundary that contains its midpoint.
fn faces_on(mesh: &Triangulation, other: &Triangulation) -> Result<Vec<(usize, usize)>> {
    let carrying: Vec<usize> = boundary(other).collect();
    let corners = |face: &usize| {
        let vertices = other.face(*face).iter();
        vertices.map(|v| other.points[*v as usize]).collect()
    };
    let corners: Vec<Vec<[f64; 3]>> = carrying.iter().map(corners).collect();
    let middles: Vec<[f64; 3]> = boundary(mesh).map(|f| mesh.face_midpoint(f)).collect();
    let found = carriers(&middles, &corners, near(&mesh.points))?;
    let pairs = boundary(mesh).zip(found).map(|(face, carrier)| {
        let carrier = carrier.ok_or_else(|| {
            let (face, other) = (mesh.face_label(face), &other.name);
            let what = "it has not the boundary groups that the scene names";
            let what =
                format!("{what}, and {face} lies on no boundary face of the scene's mesh {other}");
            refuse(mesh, what)
        })?;
        Ok((face, carrying[carrier]))
    });
    pairs.collect()
}

fn refuse(mesh: &Triangulation, what: String) -> Error {
    Error::Mesh {
        mesh: mesh.name.clone(),
        what,
        remedy: "give a result on the scene's domain, or by --mesh its mesh with the groups that the scene names".into(),
    }
}

fn boundary(mesh: &Triangulation) -> impl Iterator<Item = usize> {
    (0..mesh.face_count()).filter(|face| mesh.is_boundary(*face))
}

/// |F|
fn measure(mesh: &Triangulation, face: usize) -> f64 {
    let cell = mesh.face_cells(face)[0] as usize;
    mesh.geometry(cell)
        .face_measure(mesh.local_face(cell, face))
}

/// |Ω|
fn volume(mesh: &Triangulation) -> f64 {
    let cells = 0..mesh.cell_count();
    cells.map(|cell| mesh.geometry(cell).measure()).sum()
}
