//! Extremes of contact: everywhere, nowhere, grazing, at points; corners with two contact sides; Γ_C beside Γ_D; hundreds
//! of zones.

use super::trial::{Place, Trial};
use crate::error::{Error, Result};
use crate::scene::{Expression, Scene};
use crate::truth::exact::ManyZones;

const N: usize = 16;

/// Scenes with known solutions, and what is extreme in each.
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

/// A moderate method in the same situation is what others are compared with: no method here has an order that it cannot
/// have.
const ROOM: f64 = 3.0;

/// Squares for each zone: the error is then the same for any number of them.
const PER_ZONE: usize = 4;
const FEW_ZONES: u32 = 3;

pub fn trials() -> Result<Vec<Trial>> {
    let mut all = Vec::new();
    let moderate = "p1-vi"
        .parse()
        .map_err(|what: String| Error::usage(what, "report this: a built-in method is at fault"))?;
    for (value, name) in STATES {
        let mut trial = Trial::new("state", value, Place::of(&Scene::find(name)?, Some(N))?);
        trial.reference_method = Some(moderate);
        trial.room = ROOM;
        all.push(trial);
    }
    let nothing = Place::of(&Scene::parse(NOTHING)?, Some(N))?;
    all.push(Trial::new("state", "f = 0", nothing));
    for zones in [1, 10, 50, 200] {
        let mut trial = Trial::new("zones", zones.to_string(), many_zones(zones)?);
        trial.reference = Some(many_zones(FEW_ZONES)?);
        trial.is_heavy = zones > 10;
        all.push(trial);
    }
    Ok(all)
}

fn many_zones(zones: u32) -> Result<Place> {
    let mut scene = Scene::find("many-zones-3")?;
    let text = ManyZones::new(zones).text();
    let parsed = |text: &str| {
        Expression::parse(text).map_err(|e| Error::Scene {
            scene: format!("many-zones-{zones}"),
            place: format!("character {}", e.column),
            what: e.what,
            remedy: "report this: a built-in scene is at fault".into(),
        })
    };
    scene.name = format!("many-zones-{zones}");
    scene.data.f = parsed(&text.f)?;
    scene.data.g = parsed(&text.g)?;
    scene.exact = Some(parsed(&text.u)?);
    Place::of(&scene, Some(PER_ZONE * zones as usize))
}
