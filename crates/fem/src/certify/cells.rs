//! v, σ and G = (∇v+σ)/2 on one cell after the other, and their norms.

use nalgebra::Vector3;

use std::borrow::Cow;

use super::data::PreparedData;
use super::lift::Lift;
use super::{admissible, flux};
use crate::assembly::combine;
use crate::contact::Problem;
use crate::quadrature::{self, Rule};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::CellGeometry;

/// Norms on one cell.
pub(super) struct CellSquares {
    /// ‖∇v-σ‖_κ
    pub misfit: f64,
    /// ‖G-∇u_h‖_κ
    pub distance: f64,
    /// ‖G‖²_κ
    pub gradient: f64,
    /// ‖σ‖²_κ
    pub flux: f64,
}

/// The discrete fields, cell by cell.
pub(super) struct CellFields<'a> {
    problem: &'a Problem<'a>,
    u: &'a [f64],
    pub ingredients: Ingredients<'a>,
    /// Exact for squares of quadratic functions.
    rule: Rule,
}

/// What the bounds are computed from.
pub(super) struct Ingredients<'a> {
    pub data: Cow<'a, PreparedData>,
    /// σ·n on the contact faces.
    pub lambda: Vec<f64>,
    /// v at the vertices.
    pub v: Vec<f64>,
    /// ∫_F σ·n out of each cell, by its local faces.
    pub fluxes: Vec<f64>,
}

impl<'a> CellFields<'a> {
    /// # Errors
    /// See [`super::certify`].
    pub fn new(
        problem: &'a Problem<'a>,
        u: &'a [f64],
        data: Cow<'a, PreparedData>,
    ) -> Result<Self> {
        let lambda = flux::contact_fluxes(problem, u);
        let v = admissible::admissible(problem, u, &lambda, &data)?;
        let fluxes = flux::equilibrated(problem, u, &lambda, &data)?;
        Ok(CellFields {
            problem,
            u,
            ingredients: Ingredients {
                data,
                lambda,
                v,
                fluxes,
            },
            rule: quadrature::exact(problem.space.mesh.dim, 4),
        })
    }

    pub fn lifts_of(&self, cell: usize) -> &[Lift] {
        let lifts = &self.ingredients.data.lifts;
        let first = lifts.partition_point(|lift| lift.cell < cell);
        let count = lifts[first..].partition_point(|lift| lift.cell == cell);
        &lifts[first..first + count]
    }

    pub fn squares(&self, cell: usize) -> CellSquares {
        let (space, mesh) = (&self.problem.space, self.problem.space.mesh);
        let geometry = mesh.geometry(cell);
        let local = space.local(cell, self.u);
        let slope = self.slope(cell);
        let lifts = self.lifts_of(cell);
        let [mut misfit, mut distance, mut gradient, mut flux] = [0.0; 4];
        let mut add = |lambda: &[f64; 4], weight: f64, lift: Vector3<f64>| {
            let weight = weight * geometry.measure();
            let sigma = self.sigma(cell, &geometry, lambda);
            let of_v = slope + lift;
            let mean = 0.5 * (of_v + sigma);
            let of_u = combine(&space.gradients(&geometry, lambda), &local);
            misfit += weight * (of_v - sigma).norm_squared();
            distance += weight * (mean - of_u).norm_squared();
            gradient += weight * mean.norm_squared();
            flux += weight * sigma.norm_squared();
        };
        match lifts.first() {
            None => {
                for (lambda, weight) in self.rule.iter() {
                    add(&lambda, weight, Vector3::zeros());
                }
            }
            Some(lift) => {
                for (lambda, weight, slope) in lift.points() {
                    add(&lambda, weight, slope);
                }
            }
        }
        // A second lift on the same cell has rays of its own: by the triangle inequality.
        let more: f64 = lifts
            .iter()
            .skip(1)
            .map(|lift| lift.square(geometry.measure()).sqrt())
            .sum();
        CellSquares {
            misfit: misfit.sqrt() + more,
            distance: distance.sqrt() + 0.5 * more,
            gradient: (gradient.sqrt() - 0.5 * more).max(0.0).powi(2),
            flux,
        }
    }

    /// ∇v without the lift.
    pub fn slope(&self, cell: usize) -> Vector3<f64> {
        let mesh = self.problem.space.mesh;
        let geometry = mesh.geometry(cell);
        let vertices = mesh.cell(cell).iter().zip(geometry.gradients);
        vertices.fold(Vector3::zeros(), |sum, (&vertex, gradient)| {
            sum + self.ingredients.v[vertex as usize] * gradient
        })
    }

    /// σ at a point.
    pub fn sigma(&self, cell: usize, geometry: &CellGeometry, lambda: &[f64; 4]) -> Vector3<f64> {
        let corners = geometry.dim + 1;
        let fluxes = &self.ingredients.fluxes[corners * cell..corners * (cell + 1)];
        flux::value(
            geometry,
            fluxes,
            &self.ingredients.data.loads[cell].slopes,
            lambda,
        )
    }

    /// G at the centroid, without the lift.
    pub fn gradient(&self, cell: usize) -> [f64; 3] {
        let geometry = self.problem.space.mesh.geometry(cell);
        let sigma = self.sigma(cell, &geometry, &geometry.centroid());
        (0.5 * (self.slope(cell) + sigma)).into()
    }
}
