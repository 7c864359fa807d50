//! What of the data f and t a piecewise polynomial flux can balance, and what is left over.
//!
//! On a cell κ the flux has -div σ = Π₁f, the L² projection onto linear functions; what is left,
//! f - Π₁f, has mean 0 and so is bounded by Poincaré's inequality. On a face F of Γ_N σ·n is the mean
//! of t, and what is left is bounded by the trace inequality.

use rayon::prelude::*;

use super::largest;
use super::lift::{Lift, lifts};
use crate::assembly::value_at;
use crate::contact::Problem;
use crate::quadrature::{self, Sample, samples};
use crate::scene::Part;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::CellGeometry;

/// The first positive zero of the Bessel function J₁.
const J11: f64 = 3.831_705_970_207_512;

/// Data are integrated until the moments of a cell are right to this part of their size.
const ACCURACY: f64 = 1e-7;
/// A cell is cut in 2^d at most so often for a jump or a singularity of the data, by dimension.
const DEEPEST: [usize; 4] = [0, 12, 6, 2];

/// ‖w - w̄‖_κ ≤ C h_κ ‖∇w‖_κ: C = 1/π on convex cells (L. E. Payne, H. F. Weinberger, Arch. Rational Mech.
/// Anal. 5, 1960), 1/j₁₁ on triangles (R. S. Laugesen, B. A. Siudeja, J. Differential Equations 249, 2010).
pub(super) fn poincare(dim: usize) -> f64 {
    if dim == 2 {
        1.0 / J11
    } else {
        std::f64::consts::FRAC_1_PI
    }
}

/// The data of a problem on a mesh, the same for every field on it.
#[derive(Debug, Clone)]
pub struct PreparedData {
    pub(super) loads: Vec<Load>,
    pub(super) tractions: Vec<Traction>,
    /// By cells.
    pub(super) lifts: Vec<Lift>,
}

impl PreparedData {
    /// # Errors
    /// Data that are not finite, or that no function in the cells continues.
    pub fn new(problem: &Problem) -> Result<Self> {
        Ok(PreparedData {
            loads: loads(problem)?,
            tractions: tractions(problem)?,
            lifts: lifts(problem)?,
        })
    }
}

/// f on one cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Load {
    /// The mean of f.
    pub mean: f64,
    /// (Π₁f - Π₀f) at the vertices; they sum to 0.
    pub slopes: [f64; 4],
    /// C h ‖f - Π₁f‖_κ
    pub oscillation: f64,
    /// |κ| δ², δ what the mean may be off by for the quadrature.
    pub uncertain: f64,
}

impl Load {
    /// (f, λ_i)_κ / |κ|
    pub fn moment(&self, dim: usize, i: usize) -> f64 {
        let d = dim as f64;
        self.mean / (d + 1.0) + self.slopes[i] / ((d + 1.0) * (d + 2.0))
    }

    /// (f, φ_i)_κ / |κ| with the Crouzeix–Raviart function φ_i = 1 - d λ_i.
    pub fn on_face(&self, dim: usize, i: usize) -> f64 {
        self.mean - dim as f64 * self.moment(dim, i)
    }
}

/// t on one face of Γ_N.
#[derive(Debug, Clone, Copy)]
pub(super) struct Traction {
    pub face: usize,
    pub cell: usize,
    /// ∫_F t λ_i for the vertices of the cell; 0 for the one opposite F.
    pub moments: [f64; 4],
    /// ∫_F t
    pub total: f64,
    /// C_F ‖t - t̄‖_F
    pub oscillation: f64,
}

/// f on all cells.
///
/// # Errors
/// A value that is not finite.
fn loads(problem: &Problem) -> Result<Vec<Load>> {
    let mesh = problem.space.mesh;
    let f = &problem.scene.data().f;
    if f.is_zero() {
        return Ok(vec![Load::default(); mesh.cell_count()]);
    }
    let rule = quadrature::exact(mesh.dim, 5);
    let centroids = (0..mesh.cell_count()).map(|cell| {
        let geometry = mesh.geometry(cell);
        geometry.point(&geometry.centroid())
    });
    let size = largest(f, centroids);
    let loads: Vec<Load> = (0..mesh.cell_count())
        .into_par_iter()
        .map(|cell| {
            cancel::check()?;
            let geometry = mesh.geometry(cell);
            let value = |lambda: &[f64; 4]| f.value(geometry.point(lambda));
            let accuracy = ACCURACY * size;
            let (samples, error) = samples(mesh.dim, &rule, value, accuracy, DEEPEST[mesh.dim]);
            Ok(load(&geometry, &samples, error))
        })
        .collect::<Result<_>>()?;
    let strange = loads.iter().position(|l| !l.oscillation.is_finite());
    if let Some(cell) = strange {
        let geometry = mesh.geometry(cell);
        for (lambda, _) in rule.iter() {
            value_at(f, "f", geometry.point(&lambda))?;
        }
    }
    Ok(loads)
}

fn load(cell: &CellGeometry, samples: &[Sample], error: f64) -> Load {
    let d = cell.dim as f64;
    let mean: f64 = samples.iter().map(|s| s.weight * s.value).sum();
    let mut slopes = [0.0; 4];
    for (i, slope) in slopes.iter_mut().enumerate().take(cell.dim + 1) {
        let moment: f64 = samples
            .iter()
            .map(|s| s.weight * s.value * s.lambda[i])
            .sum();
        *slope = (d + 1.0) * (d + 2.0) * (moment - mean / (d + 1.0));
    }
    let rest = |s: &Sample| {
        let linear: f64 = s.lambda.iter().zip(&slopes).map(|(l, a)| l * a).sum();
        s.weight * (s.value - mean - linear).powi(2)
    };
    let left: f64 = samples.iter().map(rest).sum();
    Load {
        mean,
        slopes,
        oscillation: poincare(cell.dim) * cell.diameter * (cell.measure() * left).sqrt(),
        uncertain: cell.measure() * error * error,
    }
}

/// t on all faces of Γ_N where it is not 0.
///
/// With w̄ the mean over κ, the divergence theorem for |w - w̄|² (x - x_F), x_F the vertex opposite F, gives
/// ‖w - w̄‖²_F ≤ (|F|/|κ|) (‖w - w̄‖² + (2h/d) ‖w - w̄‖ ‖∇w‖) ≤ C_F² ‖∇w‖², C_F² = |F| h²/|κ| · C (C + 2/d).
///
/// # Errors
/// A value that is not finite.
fn tractions(problem: &Problem) -> Result<Vec<Traction>> {
    let t = &problem.scene.data().t;
    if t.is_zero() {
        return Ok(Vec::new());
    }
    let mesh = problem.space.mesh;
    let rule = quadrature::exact(mesh.dim - 1, 5);
    let faces = problem.parts.iter().enumerate();
    let faces = faces.filter(|(_, part)| **part == Some(Part::Neumann));
    faces
        .map(|(face, _)| {
            let cell = mesh.face_cells(face)[0] as usize;
            let geometry = mesh.geometry(cell);
            let local = mesh.local_face(cell, face);
            let corners: Vec<usize> = (0..=mesh.dim).filter(|&i| i != local).collect();
            let in_cell = |on_face: &[f64; 4]| {
                let mut lambda = [0.0; 4];
                for (k, &corner) in corners.iter().enumerate() {
                    lambda[corner] = on_face[k];
                }
                lambda
            };
            let at = |on_face: &[f64; 4]| t.value(geometry.point(&in_cell(on_face)));
            let size = rule.iter().fold(0.0, |m: f64, (l, _)| m.max(at(&l).abs()));
            let deepest = DEEPEST[mesh.dim - 1];
            let (samples, _) = samples(mesh.dim - 1, &rule, at, ACCURACY * size, deepest);
            let measure = geometry.face_measure(local);
            let mean: f64 = samples.iter().map(|s| s.weight * s.value).sum();
            let mut moments = [0.0; 4];
            let mut left = 0.0;
            for sample in &samples {
                for (sum, lambda) in moments.iter_mut().zip(in_cell(&sample.lambda)) {
                    *sum += measure * sample.weight * sample.value * lambda;
                }
                left += measure * sample.weight * (sample.value - mean).powi(2);
            }
            if !(mean.is_finite() && left.is_finite()) {
                for (lambda, _) in rule.iter() {
                    value_at(t, "t", geometry.point(&in_cell(&lambda)))?;
                }
            }
            let (c, h) = (poincare(mesh.dim), geometry.diameter);
            let trace = measure * h * h / geometry.measure() * c * (c + 2.0 / mesh.dim as f64);
            Ok(Traction {
                face,
                cell,
                moments,
                total: measure * mean,
                oscillation: (trace * left).sqrt(),
            })
        })
        .collect()
}
