//! Numbers that people ask for, as intervals: forces on parts of Γ_C, fluxes through parts of Γ_D and means of u, by a dual problem.
//!
//! For N(u) = (k, u) - <∂ₙu, β>_CD, β constant on each part of Γ_C ∪ Γ_D that is apart from the others, let z ∈ P1 be β on Γ_D,
//! q ∈ RT0 have q·n = 0 on Γ_N and q·n = μ on Γ_C. As (q, ∇u) = -(div q, u) + <q·n, g>_D + <μ, u>_C and
//! (∇z, ∇u) = (f, z) + <t, z>_N + <∂ₙu, z>_CD,
//!
//! ```text
//! N(u) = (q-∇z, ∇u) + (f, z) + <t, z>_N - <q·n, g>_D - <μ, ψ>_C + (k+div q, u) + <∂ₙu, z-β>_C - <μ, u-ψ>_C
//! ```
//!
//! Now (q-∇z, ∇u) = (q-∇z, G) ± R ‖q-∇z‖, and where |μ| ≤ c |λ| and |z-β| ≤ c (ψ-v) on Γ_C, the last two are at most
//! c (<∂ₙu, v-ψ> + <λ, u-ψ>) ≤ c E²/2, E² = M² + 2B + 2Lη (see [`super`]): both errors are of second order. Along the rim of
//! the contact set the dual solution's μ is singular where λ vanishes: it is cut off at c |λ|, and z stays β, which costs
//! ‖q-∇z‖. k enters by its means k̄ on the cells, by sup |k-k̄| on each, as (k-k̄, u) = (k-k̄, v-v̄) + (k-k̄, w), and by what
//! is not known of it.

use super::admissible::{self, descend};
use super::balance::poincare;
use super::cells::{CellFields, sums, sums_over};
use super::flux::Fluxes;
use super::quadratic::{Linear, norm_of_fluxes};
use super::simplex::{Simplex, up};
use crate::assembly::Stiffness;
use crate::contact::Problem;
use crate::element::{P1, Space};
use crate::interval::{Interval, above_of_all};
use crate::scene::Part;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

#[cfg(test)]
mod tests;

/// A linear functional (k, u) - <∂ₙu, β>_CD.
#[derive(Debug, Clone)]
pub(super) struct Goal {
    /// k̄ by cells.
    pub means: Vec<f64>,
    /// Of each cell; empty where k is constant on all.
    pub rests: Vec<Rest>,
    /// β at the vertices; empty where it is 0.
    pub on_boundary: Vec<f64>,
}

/// k on a cell is k̄, a part of mean 0, and what is not known.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rest {
    /// The part of mean 0 is at most this.
    pub spread: f64,
    /// The rest is at most this, and in the mean at most that.
    pub most: f64,
    pub mean: f64,
}

/// The bounds of the primal problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    /// ‖∇u-G‖, G without lifts and τ
    pub of_g: f64,
    /// ‖∇(u-v)‖
    pub eta: f64,
    /// E²/2
    pub terms: f64,
    /// B
    pub contact: f64,
    /// (1, |w|) ≤ this ‖∇w‖ for w that vanishes on Γ_D.
    pub friedrichs: f64,
}

/// c is tried at these multiples of the value that makes both errors about equal; on many cells only at the first, as each needs a
/// factorisation.
const FACTORS: [f64; 3] = [1.0, 2.0, 0.5];
const MANY: usize = 20_000;
/// ‖q-∇z‖ of a dual solution, relative to its own norm: a guess.
const AWAY: f64 = 0.15;

/// The interval of N(u), the smallest of those with several c.
///
/// # Errors
/// The errors of the linear solver.
///
/// `plain` has z = β wherever u_h touches.
pub(super) fn interval(plain: &mut Dual, goal: &Goal) -> Result<Interval> {
    let (fields, known) = (plain.fields, plain.known);
    let problem = fields.problem;
    let mesh = problem.space.mesh;
    let [w, fluxes] = plain.solver.dual(&goal.means, &goal.on_boundary, &[])?;
    let mut best = goal.with(plain, &w, &fluxes)?;
    let pressed: Vec<f64> = fields.lambda.iter().map(|l| l.abs()).collect();
    if pressed.iter().all(|l| *l == 0.0) {
        return Ok(best);
    }
    let equal = equal(fields, known, &fluxes)?;
    let tried = if mesh.cell_count() > MANY {
        1
    } else {
        FACTORS.len()
    };
    for factor in &FACTORS[..tried] {
        cancel::check()?;
        let c = factor * equal;
        // Where μ is too large it is given, as large as may be.
        let (mut capped, mut fixed) = (Vec::new(), Vec::new());
        for (contact, lambda) in problem.contact.iter().zip(&pressed) {
            let local = mesh.local_face(contact.cell, contact.face);
            let mu = fields.fluxes_of(&fluxes, contact.cell)[local];
            let most = (c * fields
                .least_pressure(contact.face, lambda * contact.measure)
                .low)
                .max(0.0);
            if *lambda > 0.0 && mu.abs() > most {
                capped.push((contact.face, mu.signum() * most));
            } else if *lambda > 0.0 {
                fixed.push(contact.face);
            }
        }
        // Nothing else than before.
        if capped.is_empty() {
            continue;
        }
        let mut solver = Fluxes::with_values(problem, fixed.into_iter());
        let [w, fluxes] = solver.dual(&goal.means, &goal.on_boundary, &capped)?;
        best = best.meet(goal.with(plain, &w, &fluxes)?);
    }
    Ok(best)
}

/// The c with which both errors are about equal, of a dual solution with these fluxes.
///
/// # Errors
/// An interruption.
fn equal(fields: &CellFields, known: &Known, fluxes: &[f64]) -> Result<f64> {
    let [square] = sums_over(fields.problem.space.mesh, |cell| {
        let norm = norm_of_fluxes(&fields.simplex(cell), fields.fluxes_of(fluxes, cell));
        [Interval::at(norm).square()]
    })?;
    Ok(AWAY * known.of_g * square.root().high / known.terms.max(f64::MIN_POSITIVE))
}

/// Dual problems with z = β where u_h presses: one factorisation for all goals.
pub(super) struct Dual<'a> {
    fields: &'a CellFields<'a>,
    known: &'a Known,
    solver: Fluxes<'a>,
    /// (∇λ_j, ∇λ_i) and its diagonal.
    on_vertices: (Stiffness<'a>, Vec<f64>),
}

impl<'a> Dual<'a> {
    /// u_h presses where -λ is at least this.
    pub fn new(fields: &'a CellFields<'a>, known: &'a Known, least: f64) -> Self {
        let problem = fields.problem;
        let fixed = problem.contact.iter().zip(&fields.lambda);
        let fixed = fixed.filter(|(_, lambda)| **lambda < 0.0 && -**lambda >= least);
        let solver = Fluxes::with_values(problem, fixed.map(|(contact, _)| contact.face));
        let space = Space::new(problem.space.mesh, &P1);
        let stiffness = problem.stiffness.on(&space).kept();
        let diagonal = stiffness.diagonal();
        Dual {
            fields,
            known,
            solver,
            on_vertices: (stiffness, diagonal),
        }
    }

    /// # Errors
    /// The errors of the linear solver.
    pub fn interval(&mut self, goal: &Goal) -> Result<Interval> {
        let [w, fluxes] = self.solver.dual(&goal.means, &goal.on_boundary, &[])?;
        goal.with(self, &w, &fluxes)
    }
}

impl Goal {
    /// -<∂ₙu, 1> over some faces of Γ_C or Γ_D; none where others of these have a vertex in common with them: no bound of ∇u
    /// separates what each carries.
    pub fn flux_through(fields: &CellFields, faces: &[usize]) -> Option<Self> {
        let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
        let mut on_boundary = vec![0.0; mesh.points.len()];
        let mut is_own = vec![false; mesh.face_count()];
        for &face in faces {
            is_own[face] = true;
            let vertices = mesh.face(face).iter();
            vertices.for_each(|&vertex| on_boundary[vertex as usize] = 1.0);
        }
        let mut others = problem.parts.iter().enumerate().filter(|(face, part)| {
            !is_own[*face] && matches!(part, Some(Part::Contact | Part::Dirichlet))
        });
        let meets = |face: usize| {
            let mut vertices = mesh.face(face).iter();
            vertices.any(|&vertex| on_boundary[vertex as usize] != 0.0)
        };
        (!others.any(|(face, _)| meets(face))).then(|| Goal {
            means: vec![0.0; mesh.cell_count()],
            rests: Vec::new(),
            on_boundary,
        })
    }

    /// β at a vertex.
    fn beta(&self, vertex: usize) -> f64 {
        self.on_boundary.get(vertex).copied().unwrap_or(0.0)
    }

    /// By one dual solution: w of Crouzeix and Raviart, and its fluxes.
    fn with(&self, dual: &Dual, w: &[f64], fluxes: &[f64]) -> Result<Interval> {
        let (fields, known) = (dual.fields, dual.known);
        let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
        let at = Interval::at;
        let out = |cell: usize| fields.fluxes_of(fluxes, cell);
        // |μ| ≤ c |λ|; what c costs at least lets z away from β where there is a gap.
        let mut c = equal(fields, known, fluxes)?;
        let mut on_contact = Interval::ZERO;
        for (contact, obstacle) in problem.contact.iter().zip(&fields.data.obstacles) {
            let local = mesh.local_face(contact.cell, contact.face);
            let mu = out(contact.cell)[local];
            if mu != 0.0 {
                let lambda = fields.fluxes_of(&fields.fluxes, contact.cell)[local];
                let least = fields.least_pressure(contact.face, lambda);
                c = c.max((at(mu) / least).magnitude());
            }
            on_contact += at(mu) * obstacle.mean;
        }
        let z = self.test_function(dual, c, w);
        // |k̄ + div q| and what is not known of k, at most.
        let mut missing = vec![0.0; mesh.cell_count()];
        let [base, squares, of_means, of_spread] = sums(&mut missing, |cell, missing| {
            let simplex = Simplex::new(mesh, cell);
            let fluxes = out(cell);
            let count = simplex.dim + 1;
            let slope = Linear::<3>::gradient(&simplex, &fields.corners_of(&z, cell), None);
            let difference = Linear::raviart_thomas(&simplex, fluxes).plus(-1.0, &slope);
            let twice = fields.twice_g(&simplex, cell);
            let square = difference.mean_product(&difference, simplex.dim);
            let square = Interval::new(square.low.max(0.0), square.high);
            // G's bubble is half of σ's, and counts with its norm.
            let bubble = 0.5 * fields.norm_of_bubble(&simplex, cell);
            let own = (square * simplex.measure).root();
            let product = 0.5 * difference.mean_product(&twice, simplex.dim) * simplex.measure
                + Interval::around_zero((own * at(bubble)).high);
            let sum: Interval = fluxes.iter().map(|f| at(*f)).sum();
            let divergence = at(self.means[cell]) + sum / simplex.measure;
            let v = fields.corner_values(cell);
            // The mean of 4 λ_a λ_b over a triangle is 1/3.
            let bubbles = fields.bubbles_of(cell).unwrap_or_default().map(at);
            let of_bubbles = bubbles.iter().copied().sum::<Interval>() / at(3.0);
            let flat = v[..count].iter().copied().sum::<Interval>() / at(count as f64);
            let mean_of_v = flat + of_bubbles;
            let most_of_bubbles = above_of_all(bubbles.iter().map(|b| b.magnitude()));
            let of_lifts = fields.data.size_of_lifts(&simplex, cell);
            let mut of_means =
                divergence * (mean_of_v * simplex.measure + Interval::around_zero(of_lifts));
            let mut away = Interval::ZERO;
            let mut unknown = 0.0;
            if let Some(rest) = self
                .rests
                .get(cell)
                .filter(|rest| rest.spread > 0.0 || rest.most > 0.0)
            {
                let off = v[..count].iter().map(|v| (*v - mean_of_v).magnitude());
                let off = at(up(off.fold(0.0, f64::max), most_of_bubbles));
                let off = off * simplex.measure + at(of_lifts);
                let largest = v[..count].iter().map(|v| v.magnitude()).fold(0.0, f64::max);
                let largest = up(largest, most_of_bubbles);
                let all = at(rest.spread) * off
                    + at(rest.mean) * at(largest) * simplex.measure
                    + at(rest.most) * at(of_lifts);
                of_means += Interval::around_zero(all.high);
                let size = at(rest.spread) * simplex.measure.root();
                away = (poincare(simplex.dim) * at(simplex.diameter) * size).square();
                unknown = rest.most;
            }
            *missing = (divergence.abs() + at(unknown)).high;
            [product, square * simplex.measure, of_means, away]
        })?;
        let missing = missing.into_iter().fold(0.0, f64::max);
        let mut on_dirichlet = Interval::ZERO;
        for (face, part) in problem.parts.iter().enumerate() {
            if *part == Some(Part::Dirichlet) {
                let cell = mesh.face_cells(face)[0] as usize;
                let local = mesh.local_face(cell, face);
                on_dirichlet += at(out(cell)[local]) * fields.mean_of_g(cell, local);
            }
        }
        let base = base + super::load(fields, &z)? - on_dirichlet - on_contact + of_means;
        let radius = at(known.of_g) * squares.root()
            + (at(missing) * at(known.friedrichs) + of_spread.root()) * at(known.eta)
            + at(c) * at(up(known.terms, known.contact));
        Ok(base + Interval::around_zero(radius.high))
    }

    /// z: the dual solution at the vertices, as near to β on Γ_C as c allows, and β on Γ_D.
    fn test_function(&self, dual: &Dual, c: f64, w: &[f64]) -> Vec<Interval> {
        let fields = dual.fields;
        let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
        let at = Interval::at;
        let mut z = averages(problem, w);
        let mut held = vec![false; z.len()];
        for (vertex, _) in fields
            .data
            .dirichlet
            .iter()
            .enumerate()
            .filter(|(_, g)| g.is_some())
        {
            (z[vertex], held[vertex]) = (self.beta(vertex), true);
        }
        let pressed = problem
            .contact
            .iter()
            .zip(&fields.lambda)
            .filter(|(_, l)| **l < 0.0);
        for (contact, _) in pressed {
            for &vertex in mesh.face(contact.face) {
                let vertex = vertex as usize;
                z[vertex] = if held[vertex] {
                    z[vertex]
                } else {
                    self.beta(vertex)
                };
                held[vertex] = true;
            }
        }
        let mut loads = vec![0.0; z.len()];
        for cell in 0..mesh.cell_count() {
            let share = self.means[cell] * mesh.measure(cell) / (mesh.dim + 1) as f64;
            mesh.cell(cell)
                .iter()
                .for_each(|&vertex| loads[vertex as usize] += share);
        }
        if self.rests.is_empty() {
            let (stiffness, diagonal) = &dual.on_vertices;
            let steps = admissible::steps(stiffness.space());
            descend(stiffness, diagonal, &held, &[], loads, &mut z, steps);
        }
        for (contact, obstacle) in problem.contact.iter().zip(&fields.data.obstacles) {
            let gaps = mesh.face(contact.face).iter().zip(obstacle.ceiling);
            let gaps =
                gaps.map(|(&vertex, ceiling)| at(ceiling) - at(fields.v[vertex as usize].high));
            let gaps: Vec<f64> = gaps.map(|gap| gap.low.max(0.0)).collect();
            // A bubble of v leaves less in the middle of the face.
            let bubble = fields.bubble(contact.face).high;
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            let least = (at(least) - at(bubble)).low.max(0.0);
            for (&vertex, gap) in mesh.face(contact.face).iter().zip(gaps) {
                if fields.data.dirichlet[vertex as usize].is_some() {
                    continue;
                }
                let gap = if bubble > 0.0 { least } else { gap };
                let reach = (at(c) * at(gap)).low.max(0.0);
                let (value, beta) = (&mut z[vertex as usize], self.beta(vertex as usize));
                *value = value.clamp(beta - reach, beta + reach);
            }
        }
        z.into_iter().map(at).collect()
    }
}

/// A Crouzeix–Raviart function at the vertices: the means over the cells around.
fn averages(problem: &Problem, w: &[f64]) -> Vec<f64> {
    let mesh = problem.space.mesh;
    let (mut values, mut count) = (vec![0.0; mesh.points.len()], vec![0.0; mesh.points.len()]);
    for cell in 0..mesh.cell_count() {
        let faces = mesh.cell_faces(cell);
        let all: f64 = faces.iter().map(|&face| w[face as usize]).sum();
        for (&vertex, &opposite) in mesh.cell(cell).iter().zip(faces) {
            values[vertex as usize] += all - mesh.dim as f64 * w[opposite as usize];
            count[vertex as usize] += 1.0;
        }
    }
    values
        .iter_mut()
        .zip(count)
        .for_each(|(v, count)| *v /= count);
    values
}
