//! Extremes of contact: everywhere, nowhere, grazing, at points; corners with two contact sides; Γ_C next to Γ_D; hundreds
//! of zones.

use super::trial::{Place, Trial};
use faceoff_fem::scene::{Exact, Expression, Scene};
use faceoff_fem::truth::exact::{ExactSolution, ManyZones};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh};

const N: usize = 16;

/// Scenes with known solutions, and the extreme property of each.
const STATES: [(&str, &str); 10] = [
    ("all contact", "contact-everywhere"),
    ("no contact", "contact-nowhere"),
    ("grazing everywhere", "grazing-everywhere"),
    ("grazing on sets", "manufactured-grazing"),
    ("touching in a point", "grazing-touch"),
    ("no pressure in a point", "grazing-lift"),
    ("Γ_C meets Γ_D", "dirichlet-meets-contact"),
    ("corner, both in contact", "two-sides-contact"),
    ("corner, both free", "two-sides-free"),
    ("a transition of class C^∞", "manufactured-smooth"),
];

/// No data at all: u = 0.
const NOTHING: &str = r#"
name = "nothing"
[mesh]
generator = "union-jack"
[boundary]
dirichlet = ["top"]
neumann = ["left", "right"]
contact = ["bottom"]
[exact]
u = "0"
"#;

/// The reference is a moderate method in the same situation: no method here has an order that it cannot
/// reach.
const ROOM: f64 = 3.0;

/// Columns for each zone, and rows: with these the error is the same for any number of zones.
const PER_ZONE: usize = 8;
const FEW_ZONES: u32 = 3;

pub fn trials() -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    let moderate = "p1-vi"
        .parse()
        .map_err(|what: String| Error::usage(what, "report this: a built-in method is at fault"))?;
    for (value, name) in STATES {
        all.push(Trial {
            reference_method: Some(moderate),
            room: ROOM,
            ..Trial::new("state", value, Place::of(&Scene::find(name)?, Some(N))?)
        });
    }
    let nothing = Place::of(&Scene::parse(NOTHING)?, Some(N))?;
    all.push(Trial::new("state", "f = 0", nothing));
    for zones in [1, 10, 50, 200] {
        let mut trial = Trial::new("zones", zones.to_string(), many_zones(zones)?);
        trial.reference = Some(many_zones(FEW_ZONES)?);
        trial.is_heavy = zones > 50;
        all.push(trial);
    }
    Ok(all)
}

fn many_zones(zones: u32) -> Result<Place> {
    let scene = Scene::find("many-zones-3")?;
    let text = ManyZones::new(zones).text();
    let parsed = |text: &str| {
        Expression::parse(text).map_err(|e| Error::Scene {
            scene: format!("many-zones-{zones}"),
            place: format!("character {}", e.column),
            what: e.what,
            remedy: "report this: a built-in scene is at fault".into(),
        })
    };
    let u = parsed(&text.u)?;
    let mut data = scene.data().clone();
    data.f = parsed(&text.f)?;
    // u is known: the part that is farther away than the width of a zone can be left out.
    data.g = u.clone();
    let scene = scene
        .renamed(&format!("many-zones-{zones}"))?
        .with_data(data)
        .with_exact(Some(Exact::Formula(u)));
    let mesh = strip(PER_ZONE * zones as usize, PER_ZONE);
    Ok(Place::on(scene, "strip", mesh))
}

/// The lower part of the unit square in columns, and a number of rows of squares.
fn strip(columns: usize, rows: usize) -> Mesh {
    let point = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let mut mesh = Mesh::default();
    let at = |k: usize| k as f64 / columns as f64;
    for j in 0..=rows {
        mesh.points
            .to_mut()
            .extend((0..=columns).map(|i| [at(i), at(j), 0.0]));
    }
    let mut triangles = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b] = [point(i, j), point(i + 1, j)];
            let [d, c] = [point(i, j + 1), point(i + 1, j + 1)];
            triangles.extend(if i % 2 == 0 {
                [a, b, c, a, c, d]
            } else {
                [a, b, d, b, c, d]
            });
        }
    }
    let across = |j: usize| (0..columns).flat_map(move |i| [point(i, j), point(i + 1, j)]);
    let up = |i: usize| (0..rows).flat_map(move |j| [point(i, j), point(i, j + 1)]);
    let sides: [(&str, Vec<u32>); 4] = [
        ("bottom", across(0).collect()),
        ("right", up(columns).collect()),
        ("top", across(rows).collect()),
        ("left", up(0).collect()),
    ];
    let mut lines = Vec::new();
    for (tag, (name, side)) in (1..).zip(sides) {
        let first = lines.len() as u32 / 2;
        mesh.groups.push(Group {
            dim: 1,
            tag,
            name: Some(name.into()),
            cells: (first..first + side.len() as u32 / 2).collect(),
        });
        lines.extend(side);
    }
    mesh.blocks = vec![
        CellBlock::new(CellKind::Line, lines),
        CellBlock::new(CellKind::Triangle, triangles),
    ];
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formula of a scene is the function, with hundreds of zones too.
    #[test]
    fn formulas_of_many_zones_are_in_range() {
        for zones in [1, 20, 200] {
            let exact = ManyZones::new(zones);
            let formula = Expression::parse(&exact.text().u).unwrap();
            for k in 0..400 {
                let x = (0.819_172_513_396 * f64::from(k)).fract();
                for y in [0.0, 1e-3, (0.671_043_606_704 * f64::from(k)).fract(), 1.0] {
                    let (a, b) = (formula.value([x, y, 0.0]), exact.u([x, y, 0.0]));
                    assert!((a - b).abs() < 1e-9, "{zones} zones, ({x}, {y}): {a} {b}");
                }
            }
        }
    }
}
