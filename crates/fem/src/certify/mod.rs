//! Guaranteed bounds of the error, from a discrete field alone.
//!
//! Let v ∈ K = {v = g on Γ_D, v ≤ ψ on Γ_C} and let σ have -div σ = Πf on every cell, σ·n = t̄ on Γ_N and
//! σ·n = λ ≤ 0 on Γ_C. Integrating (∇(v-u), ∇u-σ) by parts, with -Δu = f, ∂ₙu = t and (u-ψ) ∂ₙu = 0,
//!
//! ```text
//! ‖∇(v-u)‖² + ‖σ-∇u‖² + 2<∂ₙu, v-ψ>_C + 2<λ, u-ψ>_C
//!     = ‖∇v-σ‖² + 2<λ, v-ψ>_C + 2(f-Πf, u-v) + 2<t-t̄, u-v>_N
//! ```
//!
//! where nothing on the left is negative (W. Prager, J. L. Synge, Quart. Appl. Math. 5, 1947, with a
//! contact side). Write M = ‖∇v-σ‖, B = <λ, v-ψ>_C ≥ 0, and o_κ for what Poincaré's inequality on κ makes of
//! f-Πf and the trace inequality of t-t̄. With A² = Σ (M_κ + o_κ)²
//!
//! ```text
//! ‖∇(u-v)‖ ≤ η = A/2 + √(A²/4 + B)                 from (∇(u-v), ∇(u-v)) ≤ Σ (M_κ+o_κ) ‖∇(u-v)‖_κ + B
//! ‖∇u-G‖  ≤ R = √(M²/4 + B + ‖o‖ η)                for G = (∇v+σ)/2, by the parallelogram law
//! ‖∇u-∇u_h‖_h ≤ ‖G-∇u_h‖_h + R                     for any u_h
//! -2J(v) ≤ ‖∇u‖² ≤ (‖σ‖ + ‖o‖)²                     where g = ψ = 0
//! ```
//!
//! Nothing is asked of u_h: that it solves a scheme, or how well, only makes the bounds small. f and t
//! are integrated until their moments are right to seven digits; what is left, where they jump inside a cell, counts
//! as δ with ‖δ‖ diam(Ω) for Friedrichs' inequality, and is refused where that matters.

mod admissible;
mod cells;
mod data;
mod flux;
mod lift;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use crate::assembly::combine;
use crate::contact::Problem;
use crate::element::Space;
use crate::quadrature;
use crate::scene::Expression;
use cells::{CellFields, CellSquares, Ingredients};
pub use data::PreparedData;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// What the data may be off by for their quadrature, relative to the bound.
const INTEGRATED: f64 = 0.1;

/// How far a field may be off on Γ_D, relative to its largest value.
const ON_DIRICHLET: f64 = 1e-9;

/// Bounds of the error of one discrete field u_h.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// ‖∇(u-v)‖ is at most this.
    pub v: f64,
    /// ‖∇u-G‖ is at most this.
    pub g: f64,
    /// ‖∇u-∇u_h‖_h is at least and at most this.
    pub u_h: [f64; 2],
    /// ‖∇u‖ is at least and at most this.
    pub gradient: [f64; 2],
    pub parts: Parts,
    /// (M_κ + o_κ)² + 2B_κ: what each cell adds to the square of the bound, and where to refine.
    pub local: Vec<f64>,
    /// The best that is known of u and ∇u.
    pub fields: Fields,
}

/// What the bounds are made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parts {
    /// M = ‖∇v-σ‖
    pub misfit: f64,
    /// B = <λ, v-ψ>_C
    pub contact: f64,
    /// ‖o‖
    pub oscillation: f64,
    /// ‖δ‖ diam(Ω): quadrature of the data.
    pub quadrature: f64,
}

/// Fields that the bounds speak of.
#[derive(Debug, Clone)]
pub struct Fields {
    /// v at the vertices.
    pub v: Vec<f64>,
    /// G at each cell's centroid.
    pub gradient: Vec<[f64; 3]>,
}

/// Whose error is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// The averaged gradient G, the most accurate of all.
    G,
    /// The admissible v.
    V,
    /// The discrete field itself.
    UH,
}

impl std::str::FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "g" => Ok(Target::G),
            "v" => Ok(Target::V),
            "u_h" => Ok(Target::UH),
            _ => Err("use g, v or u_h".into()),
        }
    }
}

impl Certificate {
    /// The bounds, from below and above, for a target.
    pub fn of(&self, target: Target) -> [f64; 2] {
        match target {
            Target::G => [0.0, self.g],
            Target::V => [0.0, self.v],
            Target::UH => self.u_h,
        }
    }

    /// The bound from above relative to ‖∇u‖, of which a bound from below is known; infinite where none is.
    pub fn relative(&self, target: Target) -> f64 {
        let upper = self.of(target)[1];
        if upper == 0.0 {
            return 0.0;
        }
        upper / self.gradient[0]
    }
}

/// "no certificate, because …"
fn refusal(because: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::Certificate {
        because: because.into(),
        remedy: remedy.into(),
    }
}

/// The bounds for a field u (values at all dofs) of the problem's space.
///
/// ```
/// use faceoff_fem::certify::certify;
/// use faceoff_fem::contact::{Discretisation, Method, Problem};
/// use faceoff_fem::scene::Scene;
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let scene = Scene::find("one-zone")?;
/// let mesh = scene.triangulation(Some(8))?;
/// let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr()))?;
/// // Any field has bounds: this one is far from the solution.
/// let [least, most] = certify(&problem, &problem.start())?.u_h;
/// assert!(0.0 < least && least <= most);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Certificate`] where there is none: a part of the domain that Γ_D does not hold, data on Γ_D or Γ_C
/// that cannot be continued into the cells, g above ψ, a field that is not g on Γ_D, data that this mesh does not
/// integrate. Data that are not finite; those of the linear solver.
pub fn certify(problem: &Problem, u: &[f64]) -> Result<Certificate> {
    certify_with(problem, u, Cow::Owned(PreparedData::new(problem)?))
}

/// [`certify`] with data that other fields on the same mesh share.
///
/// # Errors
/// Those of [`certify`].
pub fn certify_with(
    problem: &Problem,
    u: &[f64],
    data: Cow<'_, PreparedData>,
) -> Result<Certificate> {
    check(problem, u)?;
    bounds(problem, &CellFields::new(problem, u, data)?)
}

fn bounds(problem: &Problem, fields: &CellFields) -> Result<Certificate> {
    let given = problem.scene.data();
    let mesh = problem.space.mesh;
    let Ingredients {
        data, lambda, v, ..
    } = &fields.ingredients;
    let PreparedData {
        loads, tractions, ..
    } = &**data;
    let mut oscillations: Vec<f64> = loads.iter().map(|load| load.oscillation).collect();
    for traction in tractions {
        oscillations[traction.cell] += traction.oscillation;
    }
    let cells: Vec<CellSquares> = (0..mesh.cell_count())
        .into_par_iter()
        .map(|cell| cancel::check().map(|()| fields.squares(cell)))
        .collect::<Result<_>>()?;
    let touching = contact_terms(problem, v, lambda);
    let uncertain: f64 = loads.iter().map(|load| load.uncertain).sum();
    let parts = Parts {
        misfit: norm(cells.iter().map(|c| c.misfit.powi(2))),
        contact: touching.iter().sum(),
        oscillation: norm(oscillations.iter().map(|o| o * o)),
        quadrature: uncertain.sqrt() * diameter(&mesh.points),
    };
    let mut local: Vec<f64> = cells
        .iter()
        .zip(&oscillations)
        .map(|(cell, o)| (cell.misfit + o).powi(2))
        .collect();
    let a = norm(local.iter().copied()) + parts.quadrature;
    let v_bound = 0.5 * a + (0.25 * a * a + parts.contact).sqrt();
    let left = parts.oscillation + parts.quadrature;
    let g_bound = (0.25 * parts.misfit.powi(2) + parts.contact + left * v_bound).sqrt();
    if parts.quadrature > INTEGRATED * g_bound {
        return Err(refusal(
            format!(
                "f cannot be integrated on this mesh: its jumps or singularities inside cells leave {:e}, and the bound is {g_bound:e}",
                parts.quadrature
            ),
            "refine the mesh, or let its edges follow the jumps",
        ));
    }
    let distance = norm(cells.iter().map(|c| c.distance.powi(2)));
    let size = norm(cells.iter().map(|c| c.gradient));
    let mut gradient = [(size - g_bound).max(0.0), size + g_bound];
    if given.g.is_zero() && given.psi.is_zero() {
        let flux = norm(cells.iter().map(|c| c.flux));
        let least = -2.0 * energy(problem, &fields.ingredients);
        gradient[0] = gradient[0].max(least.max(0.0).sqrt() - parts.quadrature);
        gradient[1] = gradient[1].min(flux + left);
    }
    for (face, term) in problem.contact.iter().zip(&touching) {
        local[face.cell] += 2.0 * term;
    }
    Ok(Certificate {
        v: v_bound,
        g: g_bound,
        u_h: [(distance - g_bound).max(0.0), distance + g_bound],
        gradient,
        parts,
        local,
        fields: Fields {
            gradient: (0..mesh.cell_count())
                .map(|cell| fields.gradient(cell))
                .collect(),
            v: v.clone(),
        },
    })
}

/// ‖∇(u_a - u_b)‖, broken over the cells of the mesh that both spaces have.
pub fn distance(spaces: [&Space; 2], fields: [&[f64]; 2]) -> f64 {
    let mesh = spaces[0].mesh;
    let degree = spaces.map(|space| space.element.degree());
    let rule = quadrature::exact(mesh.dim, 2 * (degree[0].max(degree[1]) - 1));
    let squares: Vec<f64> = (0..mesh.cell_count())
        .into_par_iter()
        .map(|cell| {
            let geometry = mesh.geometry(cell);
            let slope = |k: usize, lambda: &[f64; 4]| {
                let local = spaces[k].local(cell, fields[k]);
                combine(&spaces[k].gradients(&geometry, lambda), &local)
            };
            let terms = rule.iter().map(|(lambda, weight)| {
                weight * (slope(0, &lambda) - slope(1, &lambda)).norm_squared()
            });
            geometry.measure() * terms.sum::<f64>()
        })
        .collect();
    norm(squares.into_iter())
}

fn check(problem: &Problem, u: &[f64]) -> Result<()> {
    if problem.floating.is_some() {
        return Err(refusal(
            "a part of the domain has no Dirichlet face, and there the flux has no balance of its own",
            "hold each part by Γ_D",
        ));
    }
    let largest = u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    for (dof, (u, g)) in u.iter().zip(&problem.dirichlet).enumerate() {
        if !u.is_finite() {
            return Err(refusal(
                format!("dof {dof} of the field is {u}"),
                "give a finite field",
            ));
        }
        if let Some(g) = g.filter(|g| (u - g).abs() > ON_DIRICHLET * largest.max(g.abs())) {
            let x = problem.space.point(dof);
            return Err(refusal(
                format!(
                    "the field violates its boundary data: on Γ_D at ({}, {}, {}) it is {u}, and g = {g}",
                    x[0], x[1], x[2]
                ),
                "give a field of this scene",
            ));
        }
    }
    Ok(())
}

/// ‖·‖ from its squares on the cells, always in the same order.
fn norm(squares: impl Iterator<Item = f64>) -> f64 {
    squares.sum::<f64>().sqrt()
}

/// The largest |data| at some points.
fn largest(data: &Expression, points: impl Iterator<Item = [f64; 3]>) -> f64 {
    points.fold(0.0, |m: f64, x| m.max(data.value(x).abs()))
}

/// Of the box around all points, which is not less than that of the domain.
fn diameter(points: &[[f64; 3]]) -> f64 {
    let extent = |k: usize| {
        let values = points.iter().map(|p| p[k]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    };
    (0..3).map(|k| extent(k).powi(2)).sum::<f64>().sqrt()
}

/// λ_F ∫_F (v-ψ) of each contact face, both as linear functions on it.
fn contact_terms(problem: &Problem, v: &[f64], lambda: &[f64]) -> Vec<f64> {
    let psi = &problem.scene.data().psi;
    let mesh = problem.space.mesh;
    let of_face = |(face, lambda): (&crate::contact::ContactFace, &f64)| {
        let vertices = mesh.face(face.face).iter();
        let gaps =
            vertices.map(|&vertex| v[vertex as usize] - psi.value(mesh.points[vertex as usize]));
        // v was held at or below ψ: what is above is rounding.
        lambda * face.measure * gaps.map(|gap| gap.min(0.0)).sum::<f64>() / mesh.dim as f64
    };
    problem.contact.iter().zip(lambda).map(of_face).collect()
}

/// J(v) = ½‖∇v‖² - (f,v) - <t,v>_N
fn energy(problem: &Problem, ingredients: &Ingredients) -> f64 {
    let Ingredients { data, v, .. } = ingredients;
    let mesh = problem.space.mesh;
    let mut sum = 0.0;
    for (cell, load) in data.loads.iter().enumerate() {
        let geometry = mesh.geometry(cell);
        let mut slope = Vector3::zeros();
        for (i, &vertex) in mesh.cell(cell).iter().enumerate() {
            let value = v[vertex as usize];
            slope += value * geometry.gradients[i];
            sum -= geometry.measure() * load.moment(mesh.dim, i) * value;
        }
        sum += 0.5 * geometry.measure() * slope.norm_squared();
    }
    for traction in &data.tractions {
        for (&vertex, moment) in mesh.cell(traction.cell).iter().zip(traction.moments) {
            sum -= moment * v[vertex as usize];
        }
    }
    sum
}
