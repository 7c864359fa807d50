//! The assumptions and results of sections 3 and 4, as numbers of the scheme of section 6.

use serde::Serialize;

use super::patterns::{PATTERNS, Pattern};
use faceoff_fem::contact::{
    Discretisation, Doubt, Lifting, Method, Positivity, Problem, doubt, lifting, load_has_no_trace,
    positivity,
};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;

/// The numbers on one of the two meshes. All cells at Γ_C are congruent, so the numbers are the same for all n.
#[derive(Debug, Clone, Serialize)]
pub struct OfMesh {
    pub mesh: Pattern,
    /// Lemma 3.1.
    pub lifting: Option<Lifting>,
    /// (4.2)
    pub positivity: Option<Positivity>,
    /// The same with the midpoint rule on Γ_C.
    pub positivity_at_midpoints: Option<Positivity>,
    /// Proposition 4.2: the solution is unique for γ₀ above this; 0 if for all.
    pub unique_above: f64,
}

/// The theory as numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Theory {
    /// γ₀ of the scheme.
    pub gamma0: f64,
    /// One per direction of the diagonals.
    pub meshes: Vec<OfMesh>,
    /// (2.10): does f have a trace near Γ_C?
    pub load_has_trace: bool,
}

/// A γ₀ at which uniqueness is lost, if a small γ₀ can lose it.
const TINY: f64 = 1e-9;

/// On the meshes of n × n, for the examples' boundary and the load of `scene`.
///
/// # Errors
/// Errors of [`Problem::new`].
pub fn theory(scene: &Scene, n: usize, gamma0: f64) -> Result<Theory> {
    let mut meshes = Vec::new();
    let mut load_has_trace = true;
    for pattern in PATTERNS {
        let mesh = pattern.mesh(n)?;
        let problem = |gamma0: f64, rule: Option<&str>| {
            let usual = Discretisation::of(scene, Method::cr());
            let discretisation = Discretisation {
                gamma0,
                contact_quadrature: rule.map(str::to_owned).or(usual.contact_quadrature.clone()),
                ..usual
            };
            Problem::new(scene, &mesh, &discretisation)
        };
        let own = problem(gamma0, None)?;
        load_has_trace &= !load_has_no_trace(&own);
        let unique_above = match doubt(&problem(TINY, None)?) {
            Some(Doubt::GammaTooSmall { factor, .. }) => factor * TINY,
            Some(_) => f64::NAN,
            None => 0.0,
        };
        meshes.push(OfMesh {
            mesh: pattern,
            lifting: lifting(&own),
            positivity: positivity(&own),
            positivity_at_midpoints: positivity(&problem(gamma0, Some("midpoint"))?),
            unique_above,
        });
    }
    Ok(Theory {
        gamma0,
        meshes,
        load_has_trace,
    })
}
