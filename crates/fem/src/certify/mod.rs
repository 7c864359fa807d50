//! Guaranteed bounds of the error, from only a discrete field.
//!
//! Nothing is assumed of u_h: that it solves a scheme, or how well, only makes the bounds small. [`certify`] bounds the error;
//! [`examine`] gives intervals of numbers of u as well, and what is proved of its contact set. The data are not sampled but
//! enclosed, and rounding is part of the bounds ([`crate::interval`]).
#![doc = include_str!("theorem.md")]

mod admissible;
mod balance;
mod carried;
mod cells;
mod cut_off;
mod data;
#[cfg(test)]
mod data_tests;
mod fitted;
mod flux;
mod goal;
mod integrated;
mod jump;
mod lift;
mod line;
mod model;
mod numbers;
mod obstacle;
mod patch;
mod poisson;
mod polynomial;
mod products;
mod proof;
mod quadratic;
#[cfg(test)]
mod random_tests;
mod second_order;
mod simplex;
#[cfg(test)]
mod sixty_digits_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod theorem_tests;
mod tree;

use std::borrow::Cow;

use serde::Serialize;

use crate::contact::Problem;
use crate::element::Space;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature;
use cells::CellFields;
use cut_off::CutOff;
pub use data::PreparedData;
use data::Traction;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;
use flux::Fluxes;
use goal::Known;
pub use numbers::{Numbers, OfPart};
use products::{mean_of_product, reach};
pub use proof::{ContactProof, Touched};
use simplex::{Simplex, length, up};

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
    /// ‖∇u-Π₀G‖ is at most this, but for rounding: what constants on the cells can be shown to reach, a yardstick for fields
    /// of degree 1.
    pub constants: f64,
    /// ‖∇u‖ is at least and at most this.
    pub gradient: [f64; 2],
    /// J(u) is at least and at most this.
    pub energy: [f64; 2],
    /// The parts of the bounds.
    pub parts: Parts,
    /// Numbers of u, where they were asked for: see [`examine`].
    pub numbers: Option<Numbers>,
    /// (M_κ + o_κ + Q_κ)² + 2B_κ: what each cell adds to the square of the bound, and where to refine.
    ///
    /// In units of 4^-`unit`.
    pub local: Vec<f64>,
    /// 0 but where the squares of the data are out of range.
    pub unit: i32,
    /// The best that is known of u and ∇u.
    pub fields: Fields,
}

/// The parts of the bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parts {
    /// M = ‖∇v-σ‖
    pub misfit: f64,
    /// B = <λ, v-ψ>_C
    pub contact: f64,
    /// ‖o‖: what is known of the data and no flux balances.
    pub oscillation: f64,
    /// ‖Q‖: what is not known of the data, and all rounding.
    pub unknown: f64,
}

/// Fields that the bounds speak of.
#[derive(Debug, Clone)]
pub struct Fields {
    /// v at the vertices.
    pub v: Vec<f64>,
    /// Besides its linear part, v has 4 b λ_a λ_b on each face with these b; empty where all are 0.
    pub bubbles: Vec<f64>,
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
    /// The contact force: half the width of its interval.
    #[serde(rename = "contact-force")]
    ContactForce,
}

impl std::str::FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "g" => Ok(Target::G),
            "v" => Ok(Target::V),
            "u_h" => Ok(Target::UH),
            "contact-force" => Ok(Target::ContactForce),
            _ => Err("use g, v, u_h or contact-force".into()),
        }
    }
}

impl Certificate {
    /// The contribution of a cell to the bound: the root of its part of the square.
    pub fn part(&self, cell: usize) -> f64 {
        let root = Interval::at(self.local[cell].sqrt());
        root.times_power_of_two(-self.unit).mid()
    }

    /// The bounds, from below and above, for a target.
    pub fn of(&self, target: Target) -> [f64; 2] {
        match target {
            Target::G => [0.0, self.g],
            Target::V => [0.0, self.v],
            Target::UH => self.u_h,
            Target::ContactForce => {
                let width = self.contact_force().map(|[low, high]| 0.5 * (high - low));
                [0.0, width.unwrap_or(f64::INFINITY)]
            }
        }
    }

    fn contact_force(&self) -> Option<[f64; 2]> {
        self.numbers
            .as_ref()
            .and_then(|numbers| numbers.contact_force)
    }

    /// The bound from above relative to ‖∇u‖, or to the force, of which a bound from below is known; infinite where none is.
    pub fn relative(&self, target: Target) -> f64 {
        let upper = self.of(target)[1];
        if upper == 0.0 {
            return 0.0;
        }
        let least = match (target, self.contact_force()) {
            (Target::ContactForce, Some([low, high])) => Interval::new(low, high).mignitude(),
            _ => self.gradient[0],
        };
        upper / least
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
/// [`Error::Certificate`] if there is none: a part of the domain that Γ_D does not constrain, data on Γ_D or Γ_C
/// that cannot be continued into the cells, g above ψ, a field that is not g on Γ_D, data that this mesh does not
/// integrate. Data that are not finite; those of the linear solver.
pub fn certify(problem: &Problem, u: &[f64]) -> Result<Certificate> {
    // Outside of the pool every small part that has many threads would wait for one to wake up.
    rayon::scope(|_| {
        let (data, mut solver) = prepared(problem, u)?;
        let fields = CellFields::new(problem, u, Cow::Owned(data), &mut solver)?;
        bounds(&fields, &mut solver).map(|(certificate, _)| certificate)
    })
}

/// The data are enclosed while the matrix of the fluxes is factored.
fn prepared<'a>(problem: &'a Problem<'a>, u: &[f64]) -> Result<(PreparedData, Fluxes<'a>)> {
    let mut solver = Fluxes::new(problem);
    let (data, factored) = rayon::join(|| PreparedData::new(problem), || solver.prepare());
    let data = data?;
    check(problem, u)?;
    factored.map(|()| (data, solver))
}

/// [`certify`] with data that other fields on the same mesh share.
///
/// # Errors
/// The errors of [`certify`].
pub fn certify_with(
    problem: &Problem,
    u: &[f64],
    data: Cow<'_, PreparedData>,
) -> Result<Certificate> {
    check(problem, u)?;
    let mut solver = Fluxes::new(problem);
    let fields = CellFields::new(problem, u, data, &mut solver)?;
    bounds(&fields, &mut solver).map(|(certificate, _)| certificate)
}

/// A certificate with intervals of numbers of u, and what is proved of its contact set.
///
/// The numbers take a dual problem each, the contact set some more.
///
/// # Errors
/// The errors of [`certify`].
pub fn examine(problem: &Problem, u: &[f64]) -> Result<Certificate> {
    rayon::scope(|_| {
        let (data, mut solver) = prepared(problem, u)?;
        let fields = CellFields::new(problem, u, Cow::Owned(data), &mut solver)?;
        let (mut certificate, known) = bounds(&fields, &mut solver)?;
        certificate.numbers = Some(numbers::numbers(&fields, known, &mut solver)?);
        Ok(certificate)
    })
}

fn bounds(fields: &CellFields, solver: &mut Fluxes) -> Result<(Certificate, Known)> {
    let (problem, data) = (fields.problem, &*fields.data);
    let mesh = problem.space.mesh;
    let (cells, norms) = fields.all_norms()?;
    let errors: Vec<f64> = cells.iter().map(|cell| cell.error).collect();
    let on_neumann: Vec<(usize, f64)> = data
        .tractions
        .iter()
        .map(|traction| (traction.face, traction.error))
        .collect();
    // ‖Q‖_κ
    let [_, mut unknown] = solver.majorant(&errors, &on_neumann)?;
    parallel::update(&mut unknown, |cell, q| up(q, cells[cell].spread));
    let mut oscillations: Vec<f64> = cells.iter().map(|cell| cell.oscillation).collect();
    for traction in &data.tractions {
        let oscillation = &mut oscillations[traction.cell];
        *oscillation = up(*oscillation, traction.oscillation);
        unknown[traction.cell] = up(unknown[traction.cell], traction.spread);
    }
    let touching = contact_terms(fields);

    let at = Interval::at;
    // (M_κ + o_κ + Q_κ)²
    let mut local = vec![0.0; mesh.cell_count()];
    let squares = cells::sums(&mut local, |cell, local| {
        let (oscillation, unknown) = (oscillations[cell], unknown[cell]);
        let left = up(oscillation, unknown);
        let all = up(cells[cell].misfit, left);
        *local = all * all;
        [oscillation, unknown, left, all].map(|part| at(part).square())
    })?;
    let [oscillation, unknown, rest, all] = squares.map(|of| of.root().high);
    let contact = above_of_all(touching.iter().copied());
    let half = at(0.5) * at(all);
    let eta = (half + (half.square() + at(contact)).root()).high;
    let half = at(0.5) * at(norms.misfit);
    let of_g = (half.square() + at(contact) + at(rest) * at(eta))
        .root()
        .high;
    let energy_of_v = energy(fields, norms.energy);
    let gap = at(0.5) * at(norms.misfit).square() + at(contact) + at(rest) * at(eta);
    let mut gradient = around(norms.gradient, of_g);
    let given = problem.scene.data();
    if given.g.is_zero() && given.psi.is_zero() {
        let least = (-2.0 * energy_of_v).low.max(0.0);
        gradient[0] = gradient[0].max(at(least).root().low);
        gradient[1] = gradient[1].min(up(norms.flux, rest));
    }

    // Back in the unit of the data.
    let back = |value: f64| at(value).times_power_of_two(-data.unit);
    let both = |[low, high]: [f64; 2]| [back(low).low.max(0.0), back(high).high];
    let twice = |value: Interval| {
        back(value.low)
            .hull(back(value.high))
            .times_power_of_two(-data.unit)
    };
    for (face, term) in problem.contact.iter().zip(&touching) {
        local[face.cell] += 2.0 * term;
    }
    let energy = Interval::new((energy_of_v - gap).low, energy_of_v.high);
    let certificate = Certificate {
        v: back(eta).high,
        g: back(of_g).high,
        u_h: both(around(norms.distance, of_g)),
        constants: back(up(norms.variation, of_g)).high,
        gradient: both(gradient),
        energy: [twice(energy).low, twice(energy).high],
        parts: Parts {
            misfit: back(norms.misfit).high,
            contact: twice(at(contact)).high,
            oscillation: back(oscillation).high,
            unknown: back(unknown).high,
        },
        numbers: None,
        local,
        unit: data.unit,
        fields: Fields {
            gradient: cells
                .iter()
                .map(|cell| cell.centre.map(|g| back(g).mid()))
                .collect(),
            v: fields.v.iter().map(|v| back(v.mid()).mid()).collect(),
            bubbles: fields.bubbles.iter().map(|b| back(*b).mid()).collect(),
        },
    };
    if !(certificate.g.is_finite() && certificate.u_h[1].is_finite()) {
        return Err(refusal(
            "the bound is not finite: the data or the cells are beyond the range of numbers",
            "scale the problem, or use cells of less extreme shape",
        ));
    }
    let apart = cells.iter().enumerate().map(|(cell, parts)| {
        let of_lifts = data.norm_of_lifts(&fields.simplex(cell), cell);
        up(of_lifts, parts.tau)
    });
    let known = Known {
        of_g: up(of_g, 0.5 * length(apart)),
        eta,
        terms: gap.high,
        contact,
        friedrichs: f64::INFINITY,
    };
    Ok((certificate, known))
}

/// The interval within `radius` of a norm.
fn around(norm: Interval, radius: f64) -> [f64; 2] {
    let of = norm + Interval::around_zero(radius);
    [of.low.max(0.0), of.high]
}

/// ‖∇(u_a - u_b)‖, broken over the cells of the mesh that both spaces have.
pub fn distance(spaces: [&Space; 2], fields: [&[f64]; 2]) -> f64 {
    let mesh = spaces[0].mesh;
    let degree = spaces.map(|space| space.element.degree());
    let rule = quadrature::exact(mesh.dim, 2 * (degree[0].max(degree[1]) - 1));
    let squares = parallel::collect(mesh.cell_count(), |cell| {
        let geometry = mesh.geometry(cell);
        let local = [0, 1].map(|k| spaces[k].local(cell, fields[k]));
        let slope = |k: usize, lambda: &[f64; 4]| spaces[k].slope(&geometry, lambda, &local[k]);
        let terms = rule.iter().map(|(lambda, weight)| {
            weight * (slope(0, &lambda) - slope(1, &lambda)).norm_squared()
        });
        geometry.measure() * terms.sum::<f64>()
    });
    norm(squares.into_iter())
}

fn check(problem: &Problem, u: &[f64]) -> Result<()> {
    if problem.floating.is_some() {
        return Err(refusal(
            "a part of the domain has no Dirichlet face, and there the flux is not in equilibrium by itself",
            "hold each part by Γ_D",
        ));
    }
    let largest = u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    for (dof, (u, g)) in u.iter().zip(problem.dirichlet.iter()).enumerate() {
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

/// λ_F ∫_F (v-ψ) of each contact face at most.
fn contact_terms(fields: &CellFields) -> Vec<f64> {
    let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
    let pairs = problem.contact.iter().zip(&fields.data.obstacles);
    pairs
        .map(|(contact, obstacle)| {
            let local = mesh.local_face(contact.cell, contact.face);
            let flux = fields.fluxes_of(&fields.fluxes, contact.cell)[local];
            // λ is linear: nowhere larger in size than this.
            let most = 2.0 * Interval::at(flux) + fields.least_pressure(contact.face, flux);
            let vertices = mesh.face(contact.face).iter().zip(obstacle.values);
            let gaps: Interval = vertices
                .map(|(&vertex, psi)| {
                    let v = fields.v[vertex as usize];
                    if obstacle.is_lifted { v - psi } else { v }
                })
                .sum();
            let bubble = 2.0 * fields.bubble(contact.face) / Interval::at(3.0);
            let mut gap = gaps / Interval::at(mesh.dim as f64) + bubble;
            if !obstacle.is_lifted {
                gap = gap - obstacle.mean;
            }
            if let Some(beyond) = fields.data.cut_off(contact.cell) {
                gap += Interval::around_zero(beyond.height());
            }
            // v is nowhere above ψ: what is positive here is rounding.
            (most * Interval::at(gap.low.min(0.0))).high.max(0.0)
        })
        .collect()
}

/// J(v) = ½‖∇v‖² - (f,v) - <t,v>_N from what the cells add to it.
fn energy(fields: &CellFields, of_cells: Interval) -> Interval {
    let mut sum = of_cells;
    // v's lifts.
    let data = &fields.data;
    let lifted = data.lifts.iter().map(|lift| lift.cell);
    let mut lifted: Vec<usize> = lifted.collect();
    lifted.dedup();
    let beside = data.cut_offs.iter().map(|cut_off| cut_off.cell);
    for cell in lifted.into_iter().chain(beside) {
        let simplex = fields.simplex(cell);
        let mut sup = 0.0_f64;
        let tree = &data.trees[cell];
        tree.for_each(&mut |node, _, _| {
            let leaf = tree.leaf(node);
            let most = leaf.values[..=simplex.dim]
                .iter()
                .fold(0.0, |m: f64, p| m.max(p.abs()));
            sup = sup.max(up(up(most, leaf.wave), leaf.most()));
        });
        let size = Interval::at(sup) * Interval::at(data.size_of_lifts(&simplex, cell));
        sum += Interval::around_zero(size.high);
    }
    let of_face = |traction: &Traction| {
        let b = fields.bubbles.get(traction.face).copied().unwrap_or(0.0);
        let slack = Interval::around_zero(up(traction.wave, traction.rest));
        let flat = load_of_face(fields, traction, &fields.corner_values(traction.cell));
        // In 2D lifts vanish on Γ_N.
        let beyond = fields.data.cut_off(traction.cell).map(CutOff::height);
        let most = up(up(traction.size, traction.wave), traction.rest);
        let beyond = above_of_product(beyond.unwrap_or(0.0), most);
        flat + Interval::at(b) * (traction.bubble + slack) + Interval::around_zero(beyond)
    };
    sum - fields.data.tractions.iter().map(of_face).sum::<Interval>()
}

/// (f, z) + <t, z>_N for the continuous piecewise linear z with these values at the vertices.
///
/// # Errors
/// An interruption.
fn load(fields: &CellFields, z: &[Interval]) -> Result<Interval> {
    let [of_cells] = cells::sums_over(fields.problem.space.mesh, |cell| {
        let z = fields.corners_of(z, cell);
        [load_of_cell(fields, &fields.simplex(cell), cell, &z, None)]
    })?;
    let of_face = |t: &Traction| load_of_face(fields, t, &fields.corners_of(z, t.cell));
    let faces = fields.data.tractions.iter().map(of_face);
    Ok(of_cells + faces.sum())
}

/// (f, w)_κ of w = Σ z_i λ_i + Σ_F 4 b_F λ_a λ_b.
fn load_of_cell(
    fields: &CellFields,
    simplex: &Simplex,
    cell: usize,
    z: &[Interval; 4],
    b: Option<[f64; 3]>,
) -> Interval {
    mean_of_product(&fields.data.trees[cell], &z[..=simplex.dim], b) * simplex.measure
}

/// <t, z>_F of the corner values of the cell.
fn load_of_face(fields: &CellFields, traction: &Traction, z: &[Interval; 4]) -> Interval {
    let mesh = fields.problem.space.mesh;
    let local = mesh.local_face(traction.cell, traction.face);
    let corners = (0..=mesh.dim).filter(|&i| i != local);
    let on_face: Vec<Interval> = corners.map(|i| z[i]).collect();
    let (away, largest) = reach(&on_face);
    let at = Interval::at;
    let slack = at(traction.wave) * at(away) + at(traction.rest) * at(largest);
    let mean: Interval = (0..=mesh.dim).map(|i| traction.moments[i] * z[i]).sum();
    mean + Interval::around_zero(slack.high)
}
