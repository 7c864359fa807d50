//! Extremes of the constraints: several components, and components that only contact constrains.

use super::trial::{Place, Trial, rewritten};
use faceoff_fem::scene::{GroupName, Scene};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{CellBlock, Mesh};

const N: usize = 8;

/// Pressed down by f = 1 over its whole height, fixed at the top.
const HELD: &str = r#"
name = "held"
[mesh]
generator = "union-jack"
[boundary]
dirichlet = ["top"]
neumann = ["left", "right"]
contact = ["bottom"]
[data]
f = "1"
g = "0.5"
[exact]
u = "y-0.5*y^2"
"#;

/// The same without Dirichlet values: the load presses it against the obstacle, and ∂ₙu = 0 at the top as before.
pub(super) const FLOATING: &str = r#"
name = "floating"
[mesh]
generator = "union-jack"
[boundary]
neumann = ["left", "right", "top"]
contact = ["bottom"]
[data]
f = "1"
[exact]
u = "y-0.5*y^2"
"#;

/// The error of a floating component has a free constant, which contact fixes to the order of the method.
const ROOM: f64 = 3.0;

pub fn trials() -> Result<Vec<Trial>> {
    let square = union_jack(N, [1.0; 2]);
    let held = Scene::parse(HELD)?;
    let floating = Scene::parse(FLOATING)?;
    let one = Place::on(held.clone(), "one body", square.clone());
    let mut all = Vec::new();
    let mut add = |value: &str, scene: &Scene, mesh: &Mesh, is_solvable: bool| {
        let place = Place::on(scene.clone(), value, mesh.clone());
        all.push(Trial {
            must_refuse: !is_solvable,
            reference: Some(one.clone()),
            room: ROOM,
            ..Trial::new("bodies", value, place)
        });
    };
    let two = joined(&square, &square, 2.0);
    add("two, held", &held, &two, true);
    add("one, floating", &floating, &square, true);
    add("two, floating", &floating, &two, true);
    // The top of the second component has a separate name, which is in Γ_N.
    let mut boundary = held.boundary().clone();
    boundary.neumann = floating.boundary().neumann.clone();
    boundary.neumann.pop();
    boundary.neumann.push(GroupName::Name("lid".into()));
    let one_held = held.with_boundary(boundary);
    let one_held = one_held.with_exact(held.exact().cloned());
    let lidded = joined(&square, &open(&square), 2.0);
    add("one held, one floating", &one_held, &lidded, true);
    for (value, f) in [
        ("floating, pulled off", "-1"),
        ("floating, balanced", "x-0.5"),
        ("floating, no load", "0"),
    ] {
        let mut data = floating.data().clone();
        data.f = rewritten(&data.f, |_| f.to_owned())?;
        let scene = floating.with_data(data);
        add(value, &scene, &square, false);
    }
    Ok(all)
}

/// The square with a different name for its top.
fn open(square: &Mesh) -> Mesh {
    let mut mesh = square.clone();
    for group in &mut mesh.groups {
        if group.name.as_deref() == Some("top") {
            group.name = Some("lid".into());
            group.tag = 9;
        }
    }
    mesh
}

/// Two meshes of one kind in one, the second shifted along x. Groups with the same tag are merged.
fn joined(a: &Mesh, b: &Mesh, shift: f64) -> Mesh {
    let mut whole = a.clone();
    let points = a.points.len() as u32;
    let shifted = b.points.iter().map(|p| [p[0] + shift, p[1], p[2]]);
    whole.points.to_mut().extend(shifted);
    // Faces come first in both, and only they are in groups.
    let faces = a.blocks[0].len() as u32;
    let block = |(a, b): (&CellBlock, &CellBlock)| {
        let further = b.nodes.iter().map(|node| node + points);
        CellBlock::new(a.kind, a.nodes.iter().copied().chain(further).collect())
    };
    whole.blocks = a.blocks.iter().zip(&b.blocks).map(block).collect();
    for group in &b.groups {
        let cells = group.cells.iter().map(|cell| cell + faces);
        match whole.groups.iter_mut().find(|other| other.tag == group.tag) {
            Some(same) => same.cells.extend(cells),
            None => {
                let mut group = group.clone();
                group.cells = cells.collect();
                whole.groups.push(group);
            }
        }
    }
    whole.groups.sort_by_key(|group| group.tag);
    whole
}
