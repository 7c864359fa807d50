//! v, σ and G = (∇v+σ)/2 on one cell after the other, and enclosures of their norms.

use super::balance::{Balance, Tau, balance};
use super::carried::Carried;
use super::cut_off::CutOff;
use super::data::{PreparedData, is_second_order};
use super::integrated::integrated;
use super::lift::Lift;
use super::quadratic::{Linear, Quadratic};
use super::second_order::{self, Stream};
use super::simplex::{Simplex, Vector, times, up};
use super::{admissible, fitted, flux};
use crate::contact::Problem;
use crate::element::{MAX_DOFS, P1, Space};
use crate::interval::Interval;
use crate::quadrature::{Piece, WHOLE};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::parallel;
use std::borrow::Cow;

/// The quantities of each cell that the theorem needs.
#[derive(Clone, Copy, Default)]
pub(super) struct CellParts {
    /// ‖∇v-σ‖_κ
    pub misfit: f64,
    /// For the remainder of f: see [`Balance`].
    pub oscillation: f64,
    pub error: f64,
    pub spread: f64,
    /// ‖τ‖_κ
    pub tau: f64,
    /// G at the centroid, without the lift.
    pub centre: [f64; 3],
}

/// Norms on one cell.
pub(super) struct CellNorms {
    pub parts: CellParts,
    /// ‖G-∇u_h‖_κ
    pub distance: Interval,
    /// ‖G‖_κ
    pub gradient: Interval,
    /// ‖σ‖_κ
    pub flux: f64,
    /// ‖∇v‖_κ
    pub slope: Interval,
    /// ‖G-Π₀G‖_κ, about
    pub variation: f64,
    /// (f, v)_κ, v without the lift
    pub load: Interval,
}

/// Norms over all cells.
pub(super) struct Norms {
    /// ‖∇v-σ‖
    pub misfit: f64,
    /// ‖σ‖
    pub flux: f64,
    /// ‖G-Π₀G‖, about
    pub variation: f64,
    /// ‖G-∇u_h‖_h
    pub distance: Interval,
    /// ‖G‖
    pub gradient: Interval,
    /// ½‖∇v‖² - (f, v), v without lifts in the load
    pub energy: Interval,
}

/// Cells that one task adds up: sums do not depend on the number of cores.
const CHUNK: usize = 256;

/// Σ over the cells of a mesh of some numbers.
///
/// # Errors
/// An interruption.
pub(super) fn sums_over<const N: usize>(
    mesh: &Triangulation,
    of: impl Fn(usize) -> [Interval; N] + Sync,
) -> Result<[Interval; N]> {
    sums(&mut vec![(); mesh.cell_count()], |cell, ()| of(cell))
}

/// The same where something of each cell is kept.
///
/// # Errors
/// An interruption.
pub(super) fn sums<T: Send, const N: usize>(
    cells: &mut [T],
    of: impl Fn(usize, &mut T) -> [Interval; N] + Sync,
) -> Result<[Interval; N]> {
    let added = |sums: [Interval; N], of: [Interval; N]| std::array::from_fn(|k| sums[k] + of[k]);
    let of_chunk = |(chunk, cells): (usize, &mut [T])| {
        cancel::check()?;
        let cells = (chunk * CHUNK..).zip(cells);
        let cells = cells.map(|(cell, of_cell)| of(cell, of_cell));
        Ok(cells.fold([Interval::ZERO; N], added))
    };
    let chunks = parallel::map(cells.chunks_mut(CHUNK).enumerate(), of_chunk);
    let chunks: Vec<_> = chunks.into_iter().collect::<Result<_>>()?;
    Ok(chunks.into_iter().fold([Interval::ZERO; N], added))
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
    /// v has 4 b λ_a λ_b on each face with these b; empty where all are 0.
    pub bubbles: Vec<f64>,
    /// s, where σ is of second order.
    pub stream: Option<Stream>,
    /// ∫_F σ·n out of each cell, by its local faces.
    pub fluxes: Vec<f64>,
    /// Of the basis functions of u_h, at the corners.
    derivatives: [[[f64; 4]; MAX_DOFS]; 4],
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
        let again = integrated(problem, u, &data)?;
        let (scheme, near) = match &again {
            Some((again, solution)) => (again, &solution[..]),
            None => (problem, u),
        };
        let lambda = flux::contact_fluxes(scheme, near, &data);
        let scaled = |u: &[f64]| -> Vec<f64> { u.iter().map(|u| data.scaled(*u)).collect() };
        let (near, u) = (scaled(near), scaled(u));
        let of_second_order = second_order::space(problem);
        let space = of_second_order.unwrap_or_else(|| Space::new(problem.space.mesh, &P1));
        let stiffness = problem.stiffness.on(&space).kept();
        let (v, diagonal) = (
            admissible::near(problem, &near, &space),
            stiffness.diagonal(),
        );
        let data = fitted::fitted(problem, data, &lambda, &v, &diagonal);
        let (v, fluxes) = rayon::join(
            || admissible::admissible(problem, v, &lambda, &data, &stiffness, &diagonal),
            || solver.equilibrated(&near, &lambda, &data),
        );
        let (v, fluxes) = (v?, fluxes?);
        let mut fields = CellFields {
            problem,
            u,
            data,
            lambda,
            v: v.vertices,
            bubbles: v.faces,
            stream: None,
            fluxes,
            derivatives: WHOLE.map(|corner| {
                let Space { mesh, element, .. } = problem.space;
                element.derivatives(mesh.dim, &corner)
            }),
        };
        if is_second_order(problem) {
            let misfit = |cell: usize, simplex: &Simplex| {
                let of_v = Quadratic::of(&fields.slope(simplex, cell));
                of_v.plus(-1.0, &fields.sigma_of(simplex, cell))
            };
            let lambda = &fields.lambda;
            let stream = Stream::new(problem, &stiffness, &diagonal, &near, lambda, misfit);
            fields.stream = Some(stream);
        }
        Ok(fields)
    }

    /// The size of λ on a contact face at least, times |F|: λ is linear there.
    pub fn least_pressure(&self, face: usize, flux: f64) -> Interval {
        let off = self
            .stream
            .as_ref()
            .map_or(0.0, |s| 4.0 * s.faces[face].abs());
        Interval::at(flux).abs() - Interval::at(off)
    }

    /// b of v on a face beyond that of ψ or g.
    pub fn bubble(&self, face: usize) -> Interval {
        let own = self.bubbles.get(face).copied().unwrap_or(0.0);
        Interval::at(own) - Interval::at(self.data.bend(face))
    }

    /// b of v on the faces of a cell, unless all are 0.
    pub fn bubbles_of(&self, cell: usize) -> Option<[f64; 3]> {
        if self.bubbles.is_empty() {
            return None;
        }
        let b = second_order::on_cell(self.problem.space.mesh, &self.bubbles, cell);
        (b != [0.0; 3]).then_some(b)
    }

    /// ∇v without the lift.
    pub fn slope<const D: usize>(&self, simplex: &Simplex, cell: usize) -> Linear<D> {
        let bubbles = self.bubbles_of(cell);
        Linear::gradient(simplex, &self.corner_values(cell), bubbles.as_ref())
    }

    /// The linear part of σ.
    fn flux<const D: usize>(&self, simplex: &Simplex, cell: usize) -> Linear<D> {
        let own = Linear::raviart_thomas(simplex, self.fluxes_of(&self.fluxes, cell));
        match &self.stream {
            Some(stream) => own.plus(1.0, &stream.rot(self.problem.space.mesh, cell, simplex)),
            None => own,
        }
    }

    /// Twice the linear part of G, without the lift and τ.
    pub fn twice_g(&self, simplex: &Simplex, cell: usize) -> Linear<3> {
        let of_v = self.slope::<3>(simplex, cell);
        of_v.plus(1.0, &self.flux(simplex, cell))
    }

    /// The linear part of G at the corners, without the lift and τ.
    pub fn gradient_at_corners(&self, simplex: &Simplex, cell: usize) -> [Vector; 4] {
        let twice = self.twice_g(simplex, cell).at_corners();
        twice.map(|g| times(Interval::at(0.5), &g))
    }

    pub fn simplex(&self, cell: usize) -> Simplex {
        Simplex::new(self.problem.space.mesh, cell)
    }

    pub fn fluxes_of<'b>(&self, fluxes: &'b [f64], cell: usize) -> &'b [f64] {
        let corners = self.problem.space.mesh.dim + 1;
        &fluxes[corners * cell..corners * (cell + 1)]
    }

    /// f + div σ, split.
    pub fn balance(&self, simplex: &Simplex, cell: usize) -> Balance {
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
        let known = divergence + mean;
        let enough = self.data.enough * simplex.measure.high.sqrt();
        balance(simplex, &self.data.trees[cell], enough, |lambda, value| {
            let bubble = (0..count).filter(|i| lambda[*i] != 0.0);
            let bubble = bubble.map(|i| match lambda[i] {
                1.0 => slopes[i],
                weight => slopes[i] * Interval::at(weight),
            });
            Interval::at(value) + known - bubble.sum()
        })
    }

    /// [`CellFields::norms`] of all cells.
    ///
    /// # Errors
    /// An interruption.
    pub fn all_norms(&self) -> Result<(Vec<CellParts>, Norms)> {
        let mut parts = vec![CellParts::default(); self.problem.space.mesh.cell_count()];
        let sums = sums(&mut parts, |cell, parts| {
            let of = self.norms(&self.simplex(cell), cell);
            *parts = of.parts;
            let [misfit, flux, variation] =
                [of.parts.misfit, of.flux, of.variation].map(Interval::at);
            let energy = 0.5 * of.slope.square() - of.load;
            let [misfit, flux, variation, distance, gradient] =
                [misfit, flux, variation, of.distance, of.gradient].map(Interval::square);
            [misfit, flux, variation, distance, gradient, energy]
        })?;
        let [.., energy] = sums;
        let [misfit, flux, variation, distance, gradient, _] = sums.map(Interval::root);
        let norms = Norms {
            misfit: misfit.high,
            flux: flux.high,
            variation: variation.high,
            distance,
            gradient,
            energy,
        };
        Ok((parts, norms))
    }

    /// Enclosures of the norms, with the cell's τ as part of σ.
    pub fn norms(&self, simplex: &Simplex, cell: usize) -> CellNorms {
        match simplex.dim {
            2 => self.norms_of::<2>(simplex, cell),
            _ => self.norms_of::<3>(simplex, cell),
        }
    }

    fn norms_of<const D: usize>(&self, simplex: &Simplex, cell: usize) -> CellNorms {
        let balance = self.balance(simplex, cell);
        let on_cell = OnCell::<D> {
            slope: Quadratic::of(&self.slope(simplex, cell)),
            sigma: self.sigma_of(simplex, cell),
            of_u: self.of_u(simplex, cell),
            simplex,
        };
        let lifts = self.data.lifts_of(cell);
        let mut sums = Sums::default();
        // With a lift the cell's parts are its sectors, and τ is counted apart.
        let mut apart = Interval::ZERO;
        match (
            lifts.first(),
            self.data.cut_off(cell),
            balance.tau.is_empty(),
        ) {
            (Some(first), ..) => {
                apart = Interval::at(balance.norm);
                for sector in &first.sectors {
                    let share = Interval::at(sector.to) - Interval::at(sector.from);
                    let lift = Quadratic::of(&Linear::new(&[first.slope(simplex, sector); 4]));
                    sums.add(&on_cell, (&first.piece(sector), share), Some(&lift), None);
                }
                apart += Interval::at(first.norms(simplex)[1]);
            }
            (None, Some(cut_off), _) => {
                apart = Interval::at(balance.norm);
                for part in &cut_off.parts {
                    let on = (&part.piece, Interval::at(part.share));
                    sums.add(&on_cell, on, Some(&part.slope()), None);
                }
                apart += Interval::at(cut_off.norms(simplex)[1]);
            }
            (None, None, true) => {
                sums.add(&on_cell, (&WHOLE, Interval::ONE), None, None);
                if let Some(carried) = &balance.carried {
                    let (z, b) = (self.corner_values(cell), self.bubbles_of(cell));
                    let of_v = carried.mean(&z, &b.unwrap_or_default());
                    sums.carry(&on_cell, carried, of_v);
                }
            }
            (None, None, false) => {
                for tau in &balance.tau {
                    let part = (&tau.piece, Interval::at(tau.share));
                    sums.add(&on_cell, part, None, Some(tau));
                }
            }
        }
        // A second lift on the same cell has separate rays: by the triangle inequality.
        for lift in lifts.iter().skip(1) {
            apart += Interval::at(lift.norms(simplex)[0]);
        }
        let of = |mean: Interval| (mean * simplex.measure).root();
        let around = Interval::around_zero(0.5 * apart.high);
        let positive = |of: Interval| Interval::new(of.low.max(0.0), of.high);
        let parts = CellParts {
            misfit: (of(sums.misfit) + apart).high,
            oscillation: balance.oscillation,
            error: balance.error,
            spread: balance.spread,
            tau: balance.norm,
            centre: {
                let middle = [1.0 / (simplex.dim + 1) as f64; 4];
                let [v, sigma] =
                    [&on_cell.slope, &on_cell.sigma].map(|of| of.at(&middle, simplex.dim));
                let mut centre = [0.0; 3];
                (0..D).for_each(|k| centre[k] = 0.5 * (v[k] + sigma[k]));
                centre
            },
        };
        CellNorms {
            parts,
            distance: positive(of(sums.distance) + around),
            gradient: positive(of(sums.of_g) + around),
            flux: (of(sums.flux) + apart).high,
            slope: positive(of(sums.slope) + Interval::around_zero(apart.high)),
            variation: {
                let of_mean: f64 = sums.mean.iter().map(|g| g * g).sum();
                let square = (sums.of_g.mid() - of_mean).max(0.0);
                (square * simplex.measure.mid()).sqrt()
            },
            load: {
                let v = self.corner_values(cell);
                super::load_of_cell(self, simplex, cell, &v, self.bubbles_of(cell))
            },
        }
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
        let lifts = self
            .data
            .lifts_of(cell)
            .iter()
            .filter(|lift| lift.local == local);
        let heights: Interval = lifts.map(Lift::height).sum();
        let beyond = self.data.cut_off(cell).map_or(0.0, CutOff::height);
        let bent = Interval::at(self.data.bend(mesh.cell_faces(cell)[local] as usize));
        let bent = 2.0 * bent / Interval::at(3.0);
        let around = Interval::around_zero(up(heights.high, beyond));
        sum / Interval::at(mesh.dim as f64) + bent + around
    }

    /// ‖·‖_κ of the part of σ that has f's slopes: it is 0 at the vertices.
    pub fn norm_of_bubble(&self, simplex: &Simplex, cell: usize) -> f64 {
        let slopes = &self.data.loads[cell].slopes;
        if slopes.iter().all(|slope| *slope == 0.0) {
            return 0.0;
        }
        let mut field = Quadratic::<3>::ZERO;
        field.add_bubble(simplex.dim, slopes, |i, j| simplex.edge(i, j));
        (field.mean_square(simplex.dim) * simplex.measure)
            .root()
            .high
    }

    /// σ without τ on all of the cell.
    pub fn sigma_of<const D: usize>(&self, simplex: &Simplex, cell: usize) -> Quadratic<D> {
        let mut sigma = Quadratic::of(&self.flux(simplex, cell));
        let slopes = &self.data.loads[cell].slopes;
        sigma.add_bubble(simplex.dim, slopes, |i, j| simplex.edge(i, j));
        sigma
    }

    /// ∇u_h, linear on the cell.
    fn of_u<const D: usize>(&self, simplex: &Simplex, cell: usize) -> Quadratic<D> {
        let space = &self.problem.space;
        let local = space.local(cell, &self.u);
        let local = &local[..space.local_dofs];
        Quadratic::of(&Linear::of_basis(simplex, &self.derivatives, local))
    }
}

/// Means of squares over the parts of a cell.
#[derive(Default)]
struct Sums {
    misfit: Interval,
    distance: Interval,
    flux: Interval,
    slope: Interval,
    of_g: Interval,
    /// Of G, about.
    mean: [f64; 3],
}

/// The fields on a cell, without lifts and τ.
struct OnCell<'a, const D: usize> {
    simplex: &'a Simplex,
    /// ∇v
    slope: Quadratic<D>,
    sigma: Quadratic<D>,
    /// ∇u_h
    of_u: Quadratic<D>,
}

impl Sums {
    /// Adds a part of a cell and its share of it, with the lift's slope and τ there.
    fn add<const D: usize>(
        &mut self,
        on: &OnCell<D>,
        (piece, share): (&Piece, Interval),
        lift: Option<&Quadratic<D>>,
        tau: Option<&Tau>,
    ) {
        let dim = on.simplex.dim;
        let (mut of_v, mut sigma, of_u) = if lift.is_none() && tau.is_none() {
            (on.slope, on.sigma, on.of_u)
        } else {
            let of = |field: &Quadratic<D>| field.on(piece, dim);
            (of(&on.slope), of(&on.sigma), of(&on.of_u))
        };
        if let Some(lift) = lift {
            of_v = of_v.plus(1.0, lift);
        }
        if let Some(tau) = tau {
            sigma = sigma.plus(1.0, &tau.field(on.simplex));
        }
        let misfit = of_v.plus(-1.0, &sigma);
        let of_g = of_v.plus(-0.5, &misfit);
        let square = |of: &Quadratic<D>| share * of.mean_square(dim);
        let [of_misfit, flux, slope] = [&misfit, &sigma, &of_v].map(square);
        self.misfit += of_misfit;
        self.distance += square(&of_g.plus(-1.0, &of_u));
        self.flux += flux;
        self.slope += slope;
        // G is half the sum of ∇v and σ, and they differ by the misfit.
        self.of_g += 0.5 * (slope + flux) - 0.25 * of_misfit;
        for (sum, value) in self.mean.iter_mut().zip(of_g.mean(dim)) {
            *sum += share.mid() * value;
        }
    }

    /// Adds τ to σ all over a triangle: ‖w + τ‖² = ‖w‖² + 2 (w, τ) + ‖τ‖², where (∇z, τ) is (s, z) for any quadratic z, and is
    /// known of v.
    fn carry<const D: usize>(&mut self, on: &OnCell<D>, tau: &Carried, of_v: Interval) {
        let size = tau.square.root();
        let with_tau = |field: &Quadratic<D>| {
            let (z, b) = field.potential(on.simplex);
            let slope = Linear::gradient(on.simplex, &z, Some(&b));
            let off = field
                .plus(-1.0, &Quadratic::of(&slope))
                .mean_square(2)
                .root()
                * size;
            tau.mean(&z, &b) + Interval::around_zero(off.high)
        };
        let [of_sigma, of_u] = [&on.sigma, &on.of_u].map(with_tau);
        let of_g = 0.5 * (of_v + of_sigma);
        for (sum, factor, mixed) in [
            (&mut self.misfit, -1.0, of_v - of_sigma),
            (&mut self.distance, 0.5, of_g - of_u),
            (&mut self.flux, 1.0, of_sigma),
            (&mut self.of_g, 0.5, of_g),
        ] {
            let square = *sum + factor * (2.0 * mixed + factor * tau.square);
            *sum = Interval::new(square.low.max(0.0), square.high);
        }
    }
}
