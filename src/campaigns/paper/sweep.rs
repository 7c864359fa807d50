//! Variations of what the paper does not state: which of the two Union-Jack meshes, which γ₀, and the conforming penalty-free method that
//! its conclusion mentions. A statement on orders is robust only if it holds for all of these.

use rayon::prelude::*;
use serde::Serialize;

use super::Example;
use super::patterns::{PATTERNS, Pattern};
use crate::run::Observed;
use faceoff_fem::contact::{
    Discretisation, Errors, Iteration, Method, Problem, Stop, quantities, solve,
};
use faceoff_fem::element::P1;
use faceoff_fem::known::{distance, fine_errors};
use faceoff_mesh::error::Result;

/// "γ₀ large enough": from one hundredth of the program's default to ten times it.
pub const GAMMAS: [f64; 4] = [1.0, 10.0, 100.0, 1000.0];

/// A method with one γ₀ over one sequence of meshes.
#[derive(Debug, Clone, Serialize)]
pub struct Variant {
    /// `cr`, or `p1(1,0)`: the conforming penalty-free method.
    pub method: String,
    /// The direction of the diagonals.
    pub mesh: Pattern,
    /// γ₀ of γ = γ₀ h.
    pub gamma0: f64,
    /// With respect to the mesh-free reference.
    pub errors: Vec<Errors>,
    /// ‖u_h + [P(u_h)]₊‖ on Γ_C, as in the paper's figure.
    pub residuals: Vec<f64>,
    /// The same times γ^(-1/2), as in (5.12).
    pub weighted: Vec<f64>,
    /// Orders of the errors in the energy norm.
    pub h1: Observed,
    /// Orders of the errors in L².
    pub l2: Observed,
    /// Orders of `residuals`.
    pub residual: Observed,
    /// Orders of `weighted`.
    pub weighted_residual: Observed,
    /// Did Newton's iteration reach its tolerance on all meshes?
    pub converged: bool,
}

impl Variant {
    /// Is it the paper's method (3.2)?
    pub fn is_penalty_free_cr(&self) -> bool {
        self.method == Method::cr().to_string()
    }
}

/// The results on one mesh: the errors, the residual and its weighted form, and whether Newton's iteration converged.
type Level = (Errors, [f64; 2], bool);

/// The conforming penalty-free method.
fn conforming() -> Method {
    Method::nitsche(&P1, 1.0, 0.0)
}

/// All variants of an example on meshes of n × n.
///
/// # Errors
/// Errors of the solver, and of `check`.
pub fn sweep(
    example: &Example,
    n: &[usize],
    gamma0: f64,
    check: impl Fn() -> Result<()> + Sync,
) -> Result<Vec<Variant>> {
    let mut all = Vec::new();
    for pattern in PATTERNS {
        let meshes = n.iter().map(|&n| pattern.mesh(n));
        let meshes = meshes.collect::<Result<Vec<_>>>()?;
        let of_cr = GAMMAS.map(|gamma0| (Method::cr(), gamma0));
        let asked = of_cr.into_iter().chain([(conforming(), gamma0)]);
        for (method, gamma0) in asked {
            let levels = meshes.par_iter().map(|mesh| {
                check()?;
                let discretisation = Discretisation {
                    gamma0,
                    ..Discretisation::of(&example.scene, method)
                };
                let problem = Problem::new(&example.scene, mesh, &discretisation)?;
                let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| check())?;
                let of = quantities(&problem, &solution.u);
                // Only for CR is the mean on a face a dof.
                let errors = match problem.space.element.on().faces {
                    true => distance(&problem.space, &solution.u, &example.truth),
                    false => fine_errors(&problem, &solution.u, &of, &example.truth),
                };
                Ok((
                    errors,
                    [of.contact_residual, of.weighted_residual],
                    solution.converged,
                ))
            });
            let levels = levels.collect::<Result<Vec<_>>>()?;
            let observed = |value: &dyn Fn(&Level) -> f64| {
                Observed::new(n.iter().copied().zip(levels.iter().map(value)))
            };
            all.push(Variant {
                method: method.to_string(),
                mesh: pattern,
                gamma0,
                h1: observed(&|l| l.0.h1),
                l2: observed(&|l| l.0.l2),
                residual: observed(&|l| l.1[0]),
                weighted_residual: observed(&|l| l.1[1]),
                errors: levels.iter().map(|l| l.0).collect(),
                residuals: levels.iter().map(|l| l.1[0]).collect(),
                weighted: levels.iter().map(|l| l.1[1]).collect(),
                converged: levels.iter().all(|l| l.2),
            });
        }
    }
    Ok(all)
}
