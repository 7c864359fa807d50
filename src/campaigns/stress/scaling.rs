//! Extremes of units: the same problem with γ₀ over 24 decades, with data and domain scaled, and far from the origin.

use super::trial::{Place, Trial, rewritten, ten};
use crate::run::{Variation, words};
use crate::text::{Text, text};
use faceoff_fem::scene::{Data, Expression, MeshSource, Scene};
use faceoff_mesh::error::Result;

/// Fine enough that the discretisation error is visible, coarse enough that hundreds of solves take seconds.
const N: usize = 16;
const N_SOLID: usize = 4;

/// Decades.
const GAMMAS: [i32; 7] = [-12, -8, -4, -1, 4, 8, 12];
const DATA: [i32; 6] = [-150, -100, -10, 10, 100, 150];
const DOMAINS: [i32; 4] = [-12, -6, 6, 12];
const SHIFTS: [i32; 3] = [2, 5, 8];

/// All trials of one scene with an exact solution.
pub fn trials(scene: &Scene) -> Result<Vec<Trial>> {
    let n = match scene.source() {
        MeshSource::Union { cuboid, .. } if cuboid.dim == 3 => N_SOLID,
        MeshSource::Union { n, .. } if !scene.has_mesh(N) => *n,
        MeshSource::Union { .. } => N,
        other => other.n().unwrap_or(N),
    };
    let home = Place::of(scene, Some(n).filter(|_| scene.source().n().is_some()))?;
    let named = |sign: &str, k: i32| text!("{}{} ({})", sign, ten(k), scene.name());
    let mut all = Vec::new();
    let mut add = |family, value: Text, extreme: Place, scale: f64| {
        let mut trial = Trial::new(family, value, extreme);
        trial.home = Some(home.clone());
        trial.scale = scale;
        trial.is_parameter = family == "gamma0";
        all.push(trial);
    };
    for k in GAMMAS {
        let mut extreme = home.clone();
        extreme.variation = Some(Variation::Gamma0(10.0_f64.powi(k)));
        add("gamma0", named("", k), extreme, 1.0);
    }
    for k in DATA {
        let mut extreme = home.clone();
        let scale = 10.0_f64.powi(k);
        extreme.scene = scene.with_data(scaled_data(scene.data(), scale)?);
        add("data", named("× ", k), extreme, scale);
    }
    for k in DOMAINS {
        let extreme = moved(&home, 10.0_f64.powi(k), 0.0)?;
        add("domain", named("× ", k), extreme, 1.0);
    }
    for k in SHIFTS {
        let extreme = moved(&home, 1.0, 10.0_f64.powi(k))?;
        add("shift", named("+ ", k), extreme, 1.0);
    }
    Ok(all)
}

/// f, g, t and ψ times s, and hence u times s.
pub fn scaled_data(data: &Data, s: f64) -> Result<Data> {
    let times = |e: &Expression| rewritten(e, |text| format!("({s:e})*({text})"));
    Ok(Data {
        f: times(&data.f)?,
        g: times(&data.g)?,
        t: times(&data.t)?,
        psi: times(&data.psi)?,
    })
}

/// The domain scaled by s and shifted along the diagonal, with data that keep the values of u at corresponding points.
pub fn moved(home: &Place, s: f64, shift: f64) -> Result<Place> {
    let back = |text: &str| {
        coordinates(text, |name| {
            if shift == 0.0 {
                format!("({name}/({s:e}))")
            } else {
                format!("(({name}-({shift:e}))/({s:e}))")
            }
        })
    };
    let data = home.scene.data();
    let data = Data {
        // Twice, since s² may overflow or underflow.
        f: rewritten(&data.f, |t| format!("({})/({s:e})/({s:e})", back(t)))?,
        g: rewritten(&data.g, back)?,
        t: rewritten(&data.t, |t| format!("({})/({s:e})", back(t)))?,
        psi: rewritten(&data.psi, back)?,
    };
    let dim = usize::from(home.mesh.dim());
    let mut moved = home.clone();
    for point in moved.mesh.points.to_mut() {
        for x in &mut point[..dim] {
            *x = s * *x + shift;
        }
    }
    moved.scene = home.scene.with_data(data);
    Ok(moved)
}

/// The text with x, y and z replaced.
fn coordinates(text: &str, with: impl Fn(&str) -> String) -> String {
    words(text, |word| {
        ["x", "y", "z"].contains(&word).then(|| with(word))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_coordinates_are_replaced() {
        let text = coordinates("exp(x)*max(y,2e-3*x1)-x^2", |name| format!("<{name}>"));
        assert_eq!(text, "exp(<x>)*max(<y>,2e-3*x1)-<x>^2");
    }

    /// The moved problem has the data of the original one at corresponding points.
    #[test]
    fn moved_data_are_those_of_home() {
        let scene = Scene::find("manufactured-3").unwrap();
        let home = Place::of(&scene, Some(4)).unwrap();
        let moved = moved(&home, 4.0, 8.0).unwrap();
        for (p, q) in home.mesh.points.iter().zip(&moved.mesh.points) {
            let [here, there] = [(&home, p), (&moved, q)].map(|(place, p)| {
                let data = &place.scene.data();
                [data.f.value(*p), data.g.value(*p), data.psi.value(*p)]
            });
            assert!((here[0] - 16.0 * there[0]).abs() < 1e-9, "{p:?} {q:?}");
            assert!((here[1] - there[1]).abs() < 1e-12 && here[2] == there[2]);
        }
    }
}
