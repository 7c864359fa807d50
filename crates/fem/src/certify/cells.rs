//! v, σ and G = (∇v+σ)/2 on one cell after the other, and enclosures of their norms.

use super::balance::{Balance, Coefficients, balance};
use super::data::PreparedData;
use super::lift::{self, Lift, Sector};
use super::simplex::{
    EDGES, Quadratic, Simplex, Vector, ZERO, add, dot, half, mean_square_of_linear, minus, plus,
};
use super::{admissible, flux};
use crate::contact::Problem;
use crate::interval::Interval;
use crate::quadrature::{Piece, WHOLE};
use faceoff_mesh::error::Result;
use std::borrow::Cow;

/// What the theorem needs of one cell.
pub(super) struct CellNorms {
    /// ‖∇v-σ‖_κ
    pub misfit: f64,
    /// ‖G-∇u_h‖_κ
    pub distance: Interval,
    /// ‖G‖_κ
    pub gradient: Interval,
    /// ‖σ‖_κ
    pub flux: f64,
    /// ‖∇v‖_κ
    pub slope: Interval,
}

/// The discrete fields, cell by cell, in the data's unit.
pub(super) struct CellFields<'a> {
    pub problem: &'a Problem<'a>,
    pub u: Vec<f64>,
    pub data: Cow<'a, PreparedData>,
    /// σ·n on the contact faces.
    pub lambda: Vec<f64>,
    /// v at the vertices.
    pub v: Vec<Interval>,
    /// ∫_F σ·n out of each cell, by its local faces.
    pub fluxes: Vec<f64>,
}

impl<'a> CellFields<'a> {
    /// # Errors
    /// See [`super::certify`].
    pub fn new(
        problem: &'a Problem<'a>,
        u: &[f64],
        data: Cow<'a, PreparedData>,
        solver: &mut flux::Fluxes<'a>,
    ) -> Result<Self> {
        let lambda = flux::contact_fluxes(problem, u, &data);
        let u: Vec<f64> = u.iter().map(|u| data.scaled(*u)).collect();
        let v = admissible::admissible(problem, &u, &lambda, &data)?;
        let fluxes = solver.equilibrated(&u, &lambda, &data)?;
        Ok(CellFields {
            problem,
            u,
            data,
            lambda,
            v,
            fluxes,
        })
    }

    pub fn simplex(&self, cell: usize) -> Simplex {
        Simplex::new(self.problem.space.mesh, cell)
    }

    pub fn fluxes_of<'b>(&self, fluxes: &'b [f64], cell: usize) -> &'b [f64] {
        let corners = self.problem.space.mesh.dim + 1;
        &fluxes[corners * cell..corners * (cell + 1)]
    }

    /// f + div σ, split.
    pub fn balance(&self, cell: usize) -> Balance {
        let simplex = self.simplex(cell);
        let load = &self.data.loads[cell];
        let count = simplex.dim + 1;
        let out: Interval = self
            .fluxes_of(&self.fluxes, cell)
            .iter()
            .map(|f| Interval::at(*f))
            .sum();
        let divergence = out / simplex.measure;
        let slopes = load.slopes.map(Interval::at);
        let mean = slopes[..count].iter().copied().sum::<Interval>() / Interval::at(count as f64);
        balance(&simplex, &self.data.trees[cell], |lambda, value| {
            let bubble: Interval = (0..count)
                .map(|i| slopes[i] * Interval::at(lambda[i]))
                .sum();
            Interval::at(value) + divergence - (bubble - mean)
        })
    }

    /// Enclosures of the norms, with the cell's τ as part of σ.
    pub fn norms(&self, cell: usize, balance: &Balance) -> CellNorms {
        let simplex = self.simplex(cell);
        let slope = self.slope(&simplex, cell);
        let lifts = lift::of_cell(&self.data, cell);
        let mut sums = Sums::default();
        // With a lift the cell's parts are its sectors, and τ is counted apart.
        let mut apart = Interval::ZERO;
        match (lifts.first(), balance.tau.is_empty()) {
            (Some(first), _) => {
                apart = Interval::at(balance.norm);
                for sector in &first.sectors {
                    let slope = plus(&slope, &first.slope(&simplex, sector));
                    let share = Interval::at(sector.to) - Interval::at(sector.from);
                    sums.add(
                        self,
                        &simplex,
                        cell,
                        &first.piece(sector),
                        share,
                        &slope,
                        None,
                    );
                }
                apart += Interval::at(first.norms(&simplex)[1]);
            }
            (None, true) => sums.add(self, &simplex, cell, &WHOLE, Interval::ONE, &slope, None),
            (None, false) => {
                for (piece, share, tau) in &balance.tau {
                    sums.add(
                        self,
                        &simplex,
                        cell,
                        piece,
                        Interval::at(*share),
                        &slope,
                        Some(tau),
                    );
                }
            }
        }
        // A second lift on the same cell has rays of its own: by the triangle inequality.
        for lift in lifts.iter().skip(1) {
            apart += Interval::at(lift.norms(&simplex)[0]);
        }
        let of = |mean: Interval| (mean * simplex.measure).root();
        let around = Interval::around_zero(0.5 * apart.high);
        let positive = |of: Interval| Interval::new(of.low.max(0.0), of.high);
        CellNorms {
            misfit: (of(sums.misfit) + apart).high,
            distance: positive(of(sums.distance) + around),
            gradient: positive(of(sums.gradient) + around),
            flux: (of(sums.flux) + apart).high,
            slope: positive(of(sums.slope) + Interval::around_zero(apart.high)),
        }
    }

    /// ∇v without the lift.
    pub fn slope(&self, simplex: &Simplex, cell: usize) -> Vector {
        simplex.gradient(&self.corner_values(cell))
    }

    /// v at the cell's vertices.
    pub fn corner_values(&self, cell: usize) -> [Interval; 4] {
        self.corners_of(&self.v, cell)
    }

    /// Values at the cell's vertices of those at all.
    pub fn corners_of(&self, all: &[Interval], cell: usize) -> [Interval; 4] {
        let mut values = [Interval::ZERO; 4];
        for (value, &vertex) in values.iter_mut().zip(self.problem.space.mesh.cell(cell)) {
            *value = all[vertex as usize];
        }
        values
    }

    /// The mean of g over a face of Γ_D.
    pub fn mean_of_g(&self, cell: usize, local: usize) -> Interval {
        let mesh = self.problem.space.mesh;
        let values = self.corner_values(cell);
        let sum: Interval = (0..=mesh.dim)
            .filter(|&i| i != local)
            .map(|i| values[i])
            .sum();
        let lifts = lift::of_cell(&self.data, cell)
            .iter()
            .filter(|lift| lift.local == local);
        let heights: Interval = lifts
            .flat_map(|lift| &lift.sectors)
            .map(|s: &Sector| (Interval::at(s.to) - Interval::at(s.from)) * Interval::at(s.height))
            .sum();
        sum / Interval::at(mesh.dim as f64) + Interval::around_zero(heights.high)
    }

    /// ‖·‖_κ of the part of σ that has f's slopes: it is 0 at the vertices.
    pub fn norm_of_bubble(&self, simplex: &Simplex, cell: usize) -> f64 {
        let slopes = &self.data.loads[cell].slopes;
        if slopes.iter().all(|slope| *slope == 0.0) {
            return 0.0;
        }
        let mut field = Quadratic::ZERO;
        let none = vec![0.0; simplex.dim + 1];
        for (middle, [i, j]) in field
            .middles
            .iter_mut()
            .zip(EDGES)
            .take(simplex.dim * (simplex.dim + 1) / 2)
        {
            let mut lambda = [0.0; 4];
            (lambda[i], lambda[j]) = (0.5, 0.5);
            *middle = simplex.vector(&flux::coefficients(simplex, &none, slopes, &lambda));
        }
        (field.mean_square(simplex.dim) * simplex.measure)
            .root()
            .high
    }

    /// σ without τ at a point.
    pub fn sigma_at(&self, simplex: &Simplex, cell: usize, lambda: &[f64; 4]) -> Vector {
        let fluxes = self.fluxes_of(&self.fluxes, cell);
        let slopes = &self.data.loads[cell].slopes;
        simplex.vector(&flux::coefficients(simplex, fluxes, slopes, lambda))
    }

    /// σ without τ on all of the cell.
    fn sigma_of(&self, simplex: &Simplex, cell: usize) -> Quadratic {
        let dim = simplex.dim;
        let fluxes = self.fluxes_of(&self.fluxes, cell);
        let slopes = &self.data.loads[cell].slopes;
        let mut sigma = Quadratic::ZERO;
        for (corner, lambda) in sigma.corners.iter_mut().zip(&WHOLE).take(dim + 1) {
            *corner = flux::raviart_thomas(simplex, fluxes, lambda);
        }
        // The bubble is (a_j - a_i) (x_j - x_i) / (4 (d+1)) at the middle of an edge.
        let scale = Interval::at((4 * (dim + 1)) as f64);
        for (middle, [i, j]) in sigma
            .middles
            .iter_mut()
            .zip(EDGES)
            .take(dim * (dim + 1) / 2)
        {
            let flat = half(&plus(&sigma.corners[i], &sigma.corners[j]));
            let bubble = (Interval::at(slopes[j]) - Interval::at(slopes[i])) / scale;
            *middle = plus(&flat, &super::simplex::times(bubble, &simplex.edge(i, j)));
        }
        sigma
    }

    /// ∇u_h at a point, whose coordinates are exact.
    fn of_u(&self, simplex: &Simplex, cell: usize, lambda: &[f64; 4]) -> Vector {
        let space = &self.problem.space;
        let local = space.local(cell, &self.u);
        let derivatives = space.element.derivatives(simplex.dim, lambda);
        let mut slope = ZERO;
        for i in 0..=simplex.dim {
            let along = derivatives.iter().zip(&local).filter(|(d, _)| d[i] != 0.0);
            let along: Interval = along.map(|(d, u)| d[i] * Interval::at(*u)).sum();
            add(&mut slope, along, &simplex.gradients[i], simplex.dim);
        }
        slope
    }

    /// G at the centroid, without the lift.
    pub fn gradient(&self, cell: usize) -> [f64; 3] {
        let simplex = self.simplex(cell);
        let mut centroid = [0.0; 4];
        centroid[..=simplex.dim].fill(1.0 / (simplex.dim + 1) as f64);
        let sigma = self.sigma_at(&simplex, cell, &centroid);
        half(&plus(&self.slope(&simplex, cell), &sigma)).map(Interval::mid)
    }
}

/// Means of squares over the parts of a cell.
#[derive(Default)]
struct Sums {
    misfit: Interval,
    distance: Interval,
    gradient: Interval,
    flux: Interval,
    slope: Interval,
}

impl Sums {
    /// Adds a part of a cell: ∇v there, and τ at its corners.
    #[allow(clippy::too_many_arguments)] // what a part of a cell consists of
    fn add(
        &mut self,
        fields: &CellFields,
        simplex: &Simplex,
        cell: usize,
        piece: &Piece,
        share: Interval,
        of_v: &Vector,
        tau: Option<&[Coefficients; 4]>,
    ) {
        let dim = simplex.dim;
        let is_whole = tau.is_none() && share == Interval::ONE;
        let mut sigma = if is_whole {
            fields.sigma_of(simplex, cell)
        } else {
            Quadratic::ZERO
        };
        let element = fields.problem.space.element;
        let is_linear = element.degree() == 1;
        let mut of_u = Quadratic::constant(fields.of_u(simplex, cell, &piece[0]));
        for j in 0..=dim {
            if !is_whole {
                sigma.corners[j] = fields.sigma_at(simplex, cell, &piece[j]);
            }
            if let Some(tau) = tau {
                sigma.corners[j] = plus(&sigma.corners[j], &simplex.vector(&tau[j]));
            }
            if !is_linear {
                of_u.corners[j] = fields.of_u(simplex, cell, &piece[j]);
            }
        }
        for (e, [i, j]) in EDGES[..dim * (dim + 1) / 2].iter().enumerate() {
            let at = std::array::from_fn(|k| 0.5 * (piece[*i][k] + piece[*j][k]));
            if !is_whole {
                sigma.middles[e] = fields.sigma_at(simplex, cell, &at);
            }
            if let Some(tau) = tau {
                let sum: Coefficients = std::array::from_fn(|k| {
                    let sum = tau[*i][k] + tau[*j][k];
                    Interval::new(0.5 * sum.low, 0.5 * sum.high)
                });
                sigma.middles[e] = plus(&sigma.middles[e], &simplex.vector(&sum));
            }
            if !is_linear {
                of_u.middles[e] = fields.of_u(simplex, cell, &at);
            }
        }
        // With m = ∇v-σ all other norms follow from its square and its mean: σ = ∇v - m and G = ∇v - m/2.
        let misfit = Quadratic::constant_minus(of_v, &sigma);
        let (square, mean) = (misfit.mean_square(dim), misfit.mean(dim));
        let quarter = 0.25 * square;
        let own = dot(of_v, of_v, dim);
        let along = dot(of_v, &mean, dim);
        let distance = if is_linear {
            let a = minus(of_v, &of_u.corners[0]);
            dot(&a, &a, dim) - dot(&a, &mean, dim) + quarter
        } else {
            Quadratic::constant_minus(of_v, &of_u)
                .plus(-0.5, &misfit)
                .mean_square(dim)
        };
        self.misfit += share * square;
        self.distance += share * distance;
        self.gradient += share * (own - along + quarter);
        self.flux += share * (own - 2.0 * along + square);
        self.slope += share * own;
    }
}

/// ‖q‖_κ of a Raviart–Thomas field of lowest order.
pub(super) fn norm_of_fluxes(simplex: &Simplex, fluxes: &[f64]) -> f64 {
    let count = simplex.dim + 1;
    let corners: Vec<Vector> = (0..count)
        .map(|j| simplex.vector(&flux::coefficients(simplex, fluxes, &[0.0; 4], &WHOLE[j])))
        .collect();
    let mean: Interval = (0..simplex.dim)
        .map(|k| mean_square_of_linear(&corners.iter().map(|c| c[k]).collect::<Vec<_>>()))
        .sum();
    (mean * simplex.measure).root().high
}

/// ∫_κ |w| of a lift at most.
pub(super) fn size_of_lift(simplex: &Simplex, lift: &Lift) -> f64 {
    // The mean of r over a triangle is 2/3.
    let sum: Interval = lift
        .sectors
        .iter()
        .map(|s: &Sector| (Interval::at(s.to) - Interval::at(s.from)) * Interval::at(s.height))
        .sum();
    (sum * simplex.measure * Interval::at(2.0) / Interval::at(3.0)).high
}
