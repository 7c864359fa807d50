//! Extremes of cells, on problems whose solution is linear: every method except the penalty method is exact, so that the error
//! is rounding.

use super::trial::{Place, Trial, ten};
use crate::text::{Text, text};
use faceoff_fem::scene::{GroupName, Scene};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh};

/// Squares along a side.
const N: usize = 8;
/// The same for the reference of fine meshes.
const COARSE: usize = 16;

/// The unit square with contact at the bottom and a linear u, which equals g.
fn linear(name: &str, u: &str, dirichlet: &[&str], neumann: &[&str]) -> Result<Scene> {
    Scene::parse(&format!(
        "name = \"{name}\"\nmesh.generator = \"union-jack\"\ndata.g = \"{u}\"\nexact.u = \"{u}\"\n\
         [boundary]\ndirichlet = {dirichlet:?}\nneumann = {neumann:?}\ncontact = [\"bottom\"]\n"
    ))
}

pub fn trials() -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    let sides = ["top", "left", "right"];
    // In contact everywhere, and nowhere.
    for (name, u) in [("pressed", "y"), ("free", "x-3")] {
        let scene = linear(name, u, &sides, &[])?;
        let square = Place::on(scene.clone(), "square", union_jack(N, [1.0; 2]));
        let mut add = |family, value: Text, mesh: Mesh| {
            let value = text!("{} ({})", value, scene.name());
            let mut trial = Trial::new(family, value, Place::on(scene.clone(), family, mesh));
            trial.reference = Some(square.clone());
            all.push(trial);
        };
        for k in [2, 4, 6, 8] {
            let small = 10.0_f64.powi(-k);
            let one_in = text!("1:{}", ten(k));
            add("flat", one_in.clone(), union_jack(N, [1.0, small]));
            add("tall", one_in.clone(), union_jack(N, [small, 1.0]));
            add("first layer", one_in.clone(), layer(1, small));
            add("thin column", one_in.clone(), layer(0, small));
            add("sheared", one_in.clone(), sheared(10.0_f64.powi(k)));
            let inside = sliver([4, 4], [1.0, 0.5], small);
            add("sliver inside", one_in.clone(), inside);
            let on_contact = sliver([5, 1], [-0.5, -1.0], small);
            add("sliver on contact", one_in, on_contact);
        }
    }
    let scene = linear("hung", "y", &["top"], &["left", "right"])?;
    let square = Place::on(scene.clone(), "square", union_jack(N, [1.0; 2]));
    let mut coarse: Vec<(String, Mesh)> = [1, 2, 3]
        .map(|n| (format!("n = {n}"), union_jack(n, [1.0; 2])))
        .into();
    coarse.push(("one cell".into(), one_cell()));
    for (value, mesh) in coarse {
        let has = |group: &GroupName| {
            let mut groups = mesh.groups.iter();
            groups.any(|g| matches!(group, GroupName::Name(name) if g.name.as_ref() == Some(name)))
        };
        let mut boundary = scene.boundary().clone();
        boundary.neumann.retain(has);
        let scene = scene
            .with_boundary(boundary)
            .with_exact(scene.exact().cloned());
        let mut trial = Trial::new("coarse", value, Place::on(scene, "coarse", mesh));
        trial.reference = Some(square.clone());
        all.push(trial);
    }
    Ok(all)
}

/// Finer and finer meshes: an error is at most what the first order predicts from the coarse one.
pub fn sizes() -> Result<Vec<Trial>> {
    let scene = Scene::find("manufactured-smooth")?;
    let coarse = Place::of(&scene, Some(COARSE))?;
    let mut all = Vec::new();
    for n in [64, 256] {
        let mut trial = Trial::new("fine", format!("n = {n}"), Place::of(&scene, Some(n))?);
        trial.reference = Some(coarse.clone());
        trial.room = 1.5 * COARSE as f64 / n as f64;
        trial.is_heavy = n > 64;
        all.push(trial);
    }
    Ok(all)
}

/// The vertex (i, j) of the square's mesh.
fn vertex(i: usize, j: usize) -> usize {
    j * (N + 1) + i
}

/// The line next to the lower side of an axis, or to the middle one if that is x, at this distance from it.
fn layer(axis: usize, distance: f64) -> Mesh {
    let mut mesh = union_jack(N, [1.0; 2]);
    let line = if axis == 1 { 0 } else { N / 2 };
    for k in 0..=N {
        let [from, to] = [line, line + 1].map(|l| match axis {
            1 => vertex(k, l),
            _ => vertex(l, k),
        });
        mesh.points.to_mut()[to][axis] = mesh.points[from][axis] + distance;
    }
    mesh
}

/// Obtuse cells: x is replaced by x + s y.
fn sheared(s: f64) -> Mesh {
    let mut mesh = union_jack(N, [1.0; 2]);
    for point in mesh.points.to_mut() {
        point[0] += s * point[1];
    }
    mesh
}

/// One vertex of eight cells is moved until it is `distance` times a square's side away from the line of its neighbours.
fn sliver([i, j]: [usize; 2], to: [f64; 2], distance: f64) -> Mesh {
    let mut mesh = union_jack(N, [1.0; 2]);
    let point = &mut mesh.points.to_mut()[vertex(i, j)];
    for axis in 0..2 {
        let less = match to[axis].abs() {
            1.0 => to[axis] * distance,
            _ => 0.0,
        };
        point[axis] += (to[axis] - less) / N as f64;
    }
    mesh
}

/// A triangle with one side of each kind: the bottom, Γ_D opposite the origin, and x = 0.
fn one_cell() -> Mesh {
    let group = |tag: i64, name: &str, side: u32| Group {
        dim: 1,
        tag,
        name: Some(name.into()),
        cells: vec![side],
    };
    Mesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
        blocks: vec![
            CellBlock::new(CellKind::Line, vec![0, 1, 1, 2, 2, 0]),
            CellBlock::new(CellKind::Triangle, vec![0, 1, 2]),
        ],
        groups: vec![
            group(1, "bottom", 0),
            group(3, "top", 1),
            group(4, "left", 2),
        ],
        ..Mesh::default()
    }
}
