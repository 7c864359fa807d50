//! An equilibrated flux σ: -div σ = Π₁f on every cell, σ·n continuous, the mean of t on Γ_N, λ ≤ 0 on Γ_C.
//!
//! L. D. Marini, SIAM J. Numer. Anal. 22 (1985): if w ∈ CR solves (∇w, ∇φ_F) = (f, φ_F) + <t, φ_F>_N + <λ, φ_F>_C
//! for every face F off Γ_D, the Raviart–Thomas flux with
//!
//! ```text
//! ∫_F σ·n = (∇w, ∇φ_F)_κ - (f, φ_F)_κ - <t, φ_F>_{∂κ∩Γ_N}     out of κ through F
//! ```
//!
//! has the same value, with the other sign, from the other side, and -div σ = Π₀f, since the φ_F of a
//! cell sum to 1. On Γ_N itself t is counted once, not taken away.

use super::data::{Load, PreparedData};
use super::poisson::Poisson;
use super::quadratic::norm_of_fluxes;
use super::refusal;
use super::simplex::Simplex;
use crate::contact::{Law, Problem};
use crate::element::{CR, Space};
use crate::interval::{Interval, above_of_product};
use crate::linear::Role;
use crate::quadrature;
use crate::scene::Part;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::parallel;

/// Cells that one task takes.
const CHUNK: usize = 1 << 12;

/// σ·n on the contact faces, from u_h: its flux where P(u_h) ≤ 0, with the cell's height for γ
/// (with γ itself the paper's law has a spurious flux where nothing touches), and never positive.
pub(super) fn contact_fluxes(problem: &Problem, u: &[f64], data: &PreparedData) -> Vec<f64> {
    let mesh = problem.space.mesh;
    let flux = |face: &crate::contact::ContactFace| {
        let local = problem.space.local(face.cell, u);
        let (mut flux, mut gap) = (0.0, 0.0);
        for point in &face.points {
            let trace = point.trace(face.gamma, &local);
            flux += point.weight / face.measure * trace.flux;
            gap += point.weight / face.measure * trace.gap;
        }
        let height = mesh.dim as f64 * mesh.geometry(face.cell).measure() / face.measure;
        if height * flux - gap <= 0.0 {
            data.scaled(flux.min(0.0))
        } else {
            0.0
        }
    };
    problem.contact.iter().map(flux).collect()
}

/// (f, φ)_κ, of which `on_face` gives the mean, and <t, φ> on the faces of κ that are not on Γ_N, by the local faces of each cell;
/// (f, φ_F) + <t, φ_F>_N by faces.
pub(super) fn loads(
    mesh: &Triangulation,
    data: &PreparedData,
    on_face: fn(&Load, usize, usize) -> f64,
) -> [Vec<f64>; 2] {
    let (dim, corners) = (mesh.dim, mesh.dim + 1);
    let mut cells = vec![0.0; corners * mesh.cell_count()];
    let chunks = cells.chunks_mut(CHUNK * corners).enumerate();
    parallel::map(chunks, |(k, cells)| {
        for (cell, of_cell) in (k * CHUNK..).zip(cells.chunks_exact_mut(corners)) {
            let (measure, load) = (mesh.measure(cell), &data.loads[cell]);
            for (i, b) in of_cell.iter_mut().enumerate() {
                *b = measure * on_face(load, dim, i);
            }
        }
    });
    let mut b = vec![0.0; mesh.face_count()];
    for traction in &data.tractions {
        b[traction.face] += traction.total;
        for (i, &face) in mesh.cell_faces(traction.cell).iter().enumerate() {
            if face as usize != traction.face {
                let on_other = traction.total - dim as f64 * traction.moments[i].mid();
                cells[corners * traction.cell + i] += on_other;
            }
        }
    }
    add_cells(mesh, &mut b, &cells);
    [cells, b]
}

/// Adds to each face what its cells have of it.
fn add_cells(mesh: &Triangulation, b: &mut [f64], cells: &[f64]) {
    let corners = mesh.dim + 1;
    for cell in 0..mesh.cell_count() {
        for (&face, part) in mesh.cell_faces(cell).iter().zip(&cells[corners * cell..]) {
            b[face as usize] += part;
        }
    }
}

/// Raviart–Thomas fluxes from the Crouzeix–Raviart matrix, which is factored once for σ and for the majorant.
pub(super) struct Fluxes<'a> {
    problem: &'a Problem<'a>,
    space: Space<'a>,
    poisson: Poisson<'a>,
}

impl<'a> Fluxes<'a> {
    pub fn new(problem: &'a Problem<'a>) -> Self {
        let space = Space::new(problem.space.mesh, &CR);
        let is_fixed = |part: &Option<Part>| *part == Some(Part::Dirichlet);
        let role = |fixed: bool| if fixed { Role::Fixed } else { Role::Eliminated };
        let roles = problem.parts.iter().map(|part| role(is_fixed(part)));
        Fluxes {
            problem,
            poisson: Poisson::new(
                problem,
                problem.stiffness.on(&space).kept(),
                roles.collect(),
            ),
            space,
        }
    }

    /// Factors the matrix, or prepares iterations, unless u_h may itself be the solution for σ: it may never be needed then.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn prepare(&mut self) -> Result<()> {
        if self.problem.discretisation.method.law != Law::FluxCorrected {
            self.poisson.prepare(&vec![0.0; self.space.dofs])?;
        }
        Ok(())
    }

    /// The same with values given on further faces.
    pub fn with_values(problem: &'a Problem<'a>, faces: impl Iterator<Item = usize>) -> Self {
        let mut fluxes = Fluxes::new(problem);
        faces.for_each(|face| fluxes.poisson.roles[face] = Role::Fixed);
        fluxes
    }

    /// z with -Δz = `loads` on the cells, on the faces with values `on_boundary`, which has a value a vertex or none at all for 0,
    /// with `given` fluxes through some faces and none through the rest, and its fluxes.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn dual(
        &mut self,
        loads: &[f64],
        on_boundary: &[f64],
        given: &[(usize, f64)],
    ) -> Result<[Vec<f64>; 2]> {
        let mesh = self.problem.space.mesh;
        let corners = mesh.dim + 1;
        let cells = (0..mesh.cell_count())
            .flat_map(|cell| vec![mesh.measure(cell) * loads[cell] / corners as f64; corners]);
        let cells: Vec<f64> = cells.collect();
        let mut b = vec![0.0; self.space.dofs];
        add_cells(mesh, &mut b, &cells);
        given.iter().for_each(|(face, flux)| b[*face] += flux);
        let mut w = vec![0.0; b.len()];
        for (face, w) in w.iter_mut().enumerate() {
            if self.poisson.roles[face] == Role::Fixed {
                let vertex = mesh.face(face)[0] as usize;
                *w = on_boundary.get(vertex).copied().unwrap_or(0.0);
            }
        }
        let w = self.poisson.solution(w, &b)?;
        let mut fluxes = self.out(&w, &cells);
        for (face, part) in self.problem.parts.iter().enumerate() {
            if part.is_some() && self.poisson.roles[face] != Role::Fixed {
                self.set(&mut fluxes, face, 0.0);
            }
        }
        given
            .iter()
            .for_each(|(face, flux)| self.set(&mut fluxes, *face, *flux));
        Ok([w, fluxes])
    }

    /// ∫_F σ·n out of each cell, by its local faces: `dim + 1` numbers a cell, one number a face but for its sign.
    ///
    /// Takes u_h itself for w where it solves the equations to rounding, as `cr-fc` does where the rule of its load is
    /// exact; else solves them.
    ///
    /// # Errors
    /// The errors of the linear solver.
    pub fn equilibrated(
        &mut self,
        u: &[f64],
        lambda: &[f64],
        data: &PreparedData,
    ) -> Result<Vec<f64>> {
        let [cells, mut b] = loads(self.problem.space.mesh, data, Load::balanced_on_face);
        for (face, lambda) in self.problem.contact.iter().zip(lambda) {
            b[face.face] += lambda * face.measure;
        }
        let is_own = self.problem.space.element.name() == "CR" && self.is_solution(u, &b);
        let w = if is_own {
            u.to_vec()
        } else {
            self.poisson.solution(self.on_dirichlet(data), &b)?
        };
        let mut fluxes = self.out(&w, &cells);
        // What is given is given, not equal up to rounding.
        for (face, part) in self.problem.parts.iter().enumerate() {
            if *part == Some(Part::Neumann) {
                self.set(&mut fluxes, face, 0.0);
            }
        }
        for traction in &data.tractions {
            self.set(&mut fluxes, traction.face, traction.total);
        }
        for (face, lambda) in self.problem.contact.iter().zip(lambda) {
            self.set(&mut fluxes, face.face, lambda * face.measure);
        }
        Ok(fluxes)
    }

    /// Fluxes of a q with -div q ≥ `cells` on every cell, q·n ≥ `neumann` on the faces of Γ_N and q·n = 0 on Γ_C, proved, and
    /// ‖q‖_κ of each cell.
    ///
    /// # Errors
    /// The errors of the linear solver, and where its rounding is too large.
    pub fn majorant(&mut self, cells: &[f64], neumann: &[(usize, f64)]) -> Result<[Vec<f64>; 2]> {
        let mesh = self.problem.space.mesh;
        let corners = mesh.dim + 1;
        if cells.iter().all(|e| *e == 0.0) && neumann.iter().all(|(_, e)| *e == 0.0) {
            return Ok([corners, 1].map(|each| vec![0.0; each * mesh.cell_count()]));
        }
        let measures = parallel::collect(mesh.cell_count(), |cell| mesh.measure(cell));
        let measure = |cell: usize| measures[cell];
        let face_measure = |face: usize| {
            let cell = mesh.face_cells(face)[0] as usize;
            mesh.geometry(cell)
                .face_measure(mesh.local_face(cell, face))
        };
        let volume: f64 = (0..mesh.cell_count()).map(measure).sum();
        let total: f64 = (0..mesh.cell_count())
            .map(|cell| cells[cell] * measure(cell))
            .sum::<f64>()
            + neumann
                .iter()
                .map(|(face, e)| e * face_measure(*face))
                .sum::<f64>();
        for inflation in [1e-8, 1e-5, 1e-2] {
            let wanted = |cell: usize| cells[cell] * (1.0 + inflation) + inflation * total / volume;
            let loads: Vec<f64> = (0..mesh.cell_count())
                .flat_map(|cell| {
                    let load = measure(cell) * wanted(cell) / corners as f64;
                    std::iter::repeat_n(load, corners)
                })
                .collect();
            let mut b = vec![0.0; self.space.dofs];
            add_cells(mesh, &mut b, &loads);
            for (face, error) in neumann {
                b[*face] += error * (1.0 + inflation) * face_measure(*face);
            }
            let w = self.poisson.about(&b)?;
            let mut fluxes = self.out(&w, &loads);
            for (face, part) in self.problem.parts.iter().enumerate() {
                if matches!(part, Some(Part::Contact | Part::Neumann)) {
                    self.set(&mut fluxes, face, 0.0);
                }
            }
            for (face, error) in neumann {
                // |F| of the certificate's own geometry, rounded up.
                let cell = mesh.face_cells(*face)[0] as usize;
                let simplex = Simplex::new(mesh, cell);
                let size = simplex.face_measure(mesh.local_face(cell, *face)).high;
                self.set(&mut fluxes, *face, above_of_product(*error, size));
            }
            let norm = |cell: usize| {
                let fluxes = &fluxes[corners * cell..corners * (cell + 1)];
                let out: Interval = fluxes.iter().map(|f| Interval::at(*f)).sum();
                let simplex = Simplex::new(mesh, cell);
                let holds = (-out / simplex.measure).low >= cells[cell];
                holds.then(|| norm_of_fluxes(&simplex, fluxes))
            };
            let norms = parallel::collect(mesh.cell_count(), norm);
            if let Some(norms) = norms.into_iter().collect() {
                return Ok([fluxes, norms]);
            }
        }
        Err(refusal(
            "the rounding of the linear solver is larger than what the certificate has to bound",
            "use cells of less extreme shape",
        ))
    }

    /// The fluxes of w: one number on either side of a face, the mean of both.
    fn out(&self, w: &[f64], cells: &[f64]) -> Vec<f64> {
        let mesh = self.problem.space.mesh;
        let corners = mesh.dim + 1;
        let mut fluxes = vec![0.0; cells.len()];
        let chunk = CHUNK * corners;
        let chunks = fluxes.chunks_mut(chunk).zip(cells.chunks(chunk));
        parallel::map(chunks.enumerate(), |(k, (fluxes, loads))| {
            for (cell, fluxes) in (k * CHUNK..).zip(fluxes.chunks_exact_mut(corners)) {
                self.poisson
                    .stiffness
                    .cell_times(cell, w, fluxes, |a, w| a * w);
            }
            fluxes
                .iter_mut()
                .zip(loads)
                .for_each(|(flux, load)| *flux -= load);
        });
        // Out of the first cell of each face.
        let mean = |face: usize| {
            let of = |cell: u32| {
                let cell = cell as usize;
                fluxes[corners * cell + mesh.local_face(cell, face)]
            };
            match mesh.face_cells(face) {
                [a, _] if mesh.is_boundary(face) => of(a),
                [a, b] => 0.5 * (of(a) - of(b)),
            }
        };
        let means = parallel::collect(mesh.face_count(), mean);
        parallel::update(&mut fluxes, |k, _| {
            let cell = k / corners;
            let face = mesh.cell_faces(cell)[k % corners] as usize;
            let is_first = mesh.face_cells(face)[0] as usize == cell;
            if is_first { means[face] } else { -means[face] }
        });
        fluxes
    }

    /// Gives a boundary face its flux.
    fn set(&self, fluxes: &mut [f64], face: usize, value: f64) {
        let mesh = self.problem.space.mesh;
        let cell = mesh.face_cells(face)[0] as usize;
        fluxes[(mesh.dim + 1) * cell + mesh.local_face(cell, face)] = value;
    }

    /// Whether the rows off Γ_D hold to rounding.
    fn is_solution(&self, w: &[f64], b: &[f64]) -> bool {
        let (product, sizes) = (
            self.poisson.stiffness.times(w),
            self.poisson.stiffness.sizes(w),
        );
        (0..w.len()).all(|face| {
            self.poisson.roles[face] == Role::Fixed
                || (product[face] - b[face]).abs() <= 1e-13 * (sizes[face] + b[face].abs())
        })
    }

    /// The means of g.
    fn on_dirichlet(&self, data: &PreparedData) -> Vec<f64> {
        let g = &self.problem.scene.data().g;
        let mesh = self.problem.space.mesh;
        let mut w = vec![0.0; self.space.dofs];
        let rule = quadrature::exact(mesh.dim - 1, 5);
        for face in (0..w.len()).filter(|&face| self.poisson.roles[face] == Role::Fixed) {
            let vertices = mesh.face(face);
            for (lambda, weight) in rule.iter() {
                let x: [f64; 3] = std::array::from_fn(|k| {
                    let corners = vertices.iter().zip(lambda);
                    corners.map(|(&v, l)| l * mesh.points[v as usize][k]).sum()
                });
                w[face] += weight * data.scaled(g.value(x));
            }
        }
        w
    }
}
