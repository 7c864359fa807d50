//! Newton's steps without a factorisation, for meshes beyond it.
//!
//! In the form of `scheme` the rows of contact faces hold nothing but their law, scaled to the size of
//! the stiffness: in contact a Dirichlet condition, separated the row of the stiffness itself, and in
//! between only on faces partly in contact. The matrix so is the stiffness with Dirichlet conditions on the
//! faces wholly in contact, up to little; P1 ⊂ CR preconditions it, with functions that vanish at
//! the vertices of these faces. A hierarchy for another such set serves as long as it is not much slower.
//!
//! Laws that add to the rows instead leave those of contact cells far from the stiffness: `layer` solves for these as one
//! block, between sweeps over the others. Of what is left the stiffness with such Dirichlet conditions is again near enough,
//! whatever γ: the block has the law exactly, and hands on no more than a Dirichlet or a Neumann condition.

use std::cell::{Cell, RefCell};

use super::condition::Condition;
use super::layer::Layer;
use super::scheme::Scheme;
use super::system::{Built, Energy, System, Weights, largest};
use crate::assembly::{Free, iterations};
use crate::linear::{
    Choice, Csr, Embedded, Ended, KrylovStop, LowRank, Room, SchurLu, Solved, Sweeps,
    conjugate_gradients, gmres, norm, zeros,
};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// Most iterations for one step of Newton's method.
const STEPS: usize = 400;
/// The reduction of the residual in a step while many conditions change, while a few do, and in the end.
const COARSE: f64 = 1e-2;
const MEDIUM: f64 = 1e-4;
const FINE: f64 = 1e-10;
/// Systems of so few unknowns are always solved to the last: digits cost less than another step.
const FEW: usize = 2000;
/// Numbers that one task compares.
const CHUNK: usize = 1 << 13;

/// Vectors of this system hold all dofs.
pub(super) struct Krylov<'a> {
    scheme: Scheme<'a>,
    /// The dofs that are not given on Γ_D.
    free: Free<'a>,
    /// The rows that the conditions change, as A has them: free number and values.
    stiff: Vec<(u32, Vec<f64>)>,
    /// The unknowns that are solved for as one block, and their free numbers.
    layer: Option<Layer>,
    layer_rows: Vec<u32>,
    state: RefCell<State>,
    choice: Choice,
    /// The stiffness times u = g on Γ_D and 0 elsewhere, at the free numbers, and the energy of that.
    given: Vec<f64>,
    energy_given: f64,
    /// u of the last product at the free numbers, and that.
    last: RefCell<[Vec<f64>; 2]>,
    /// ‖u‖₂ of the last residual, and the norm of the matrix.
    size: Cell<f64>,
    scale: f64,
    /// Preconditioners so far.
    built: Cell<usize>,
}

/// Data that are kept from step to step.
struct State {
    sweeps: Sweeps,
    laws: Vec<Weights>,
    /// The preconditioner of the layer with these laws.
    lu: Option<SchurLu>,
    /// Vectors of iterations.
    room: Room,
    preconditioner: Option<Preconditioner>,
}

struct Preconditioner {
    embedded: Embedded,
    /// The dofs in contact that it was built for.
    closed: Vec<u32>,
    /// Iterations for each digit with these.
    pace: f64,
}

/// An iteration that leaves more than this of its residual has not met rounding.
const STALLED: f64 = 0.1;
/// A preconditioner for another contact set is used up to this many times the iterations that it needs for its own set.
const STALE: f64 = 2.0;

impl<'a> Krylov<'a> {
    /// The predicted cost of iterating; None for systems that it does not solve.
    pub fn predicted(scheme: &Scheme) -> Option<Choice> {
        choice(scheme)
    }

    /// # Errors
    /// A scheme that is not of this kind; nothing free; a matrix too large to be summed.
    pub fn new(scheme: Scheme<'a>) -> Result<Self> {
        let problem = scheme.problem;
        let space = &problem.space;
        let Some(choice) = choice(&scheme) else {
            return Err(Error::usage(
                "iterations do not solve this scene: parts of its domain are constrained only by contact, and iterations need Γ_D",
                "use --linear auto",
            ));
        };
        let _span = tracing::debug_span!("matrix").entered();
        let free = Free::new(space, |dof| problem.dirichlet[dof].is_some());
        let (numbers, dofs) = (&free.number, &free.dofs);
        if dofs.is_empty() {
            return Err(Error::Solver {
                what: "Γ_D holds every dof, so there is nothing to solve".into(),
                remedy: "refine the mesh".into(),
            });
        }
        let mut seen: Vec<u32> = scheme
            .conditions
            .iter()
            .flat_map(|c| &c.dofs)
            .filter_map(|&dof| numbers[dof as usize])
            .collect();
        seen.sort_unstable();
        seen.dedup();
        // A law has entries where the stiffness has none.
        let whole = |row: usize| seen.binary_search(&(row as u32)).is_ok();
        let stiffness = &problem.stiffness;
        let mut sweeps = Sweeps::new(
            match space.element.on().vertices && space.element.degree() == 1 {
                true => problem.vertex_stiffness()?.submatrix(numbers),
                false => Csr::sum(stiffness, numbers, whole)?,
            },
        );
        let matrix = sweeps.matrix_mut();
        let scale = matrix.norm();
        let stiff = seen
            .into_iter()
            .map(|row| (row, matrix.row_values_mut(row as usize).to_vec()))
            .collect();
        let start = problem.start();
        let (mut given, mut energy_given) = (vec![0.0; dofs.len()], 0.0);
        if start.iter().any(|g| *g != 0.0) {
            let product = problem.stiffness.times(&start);
            given = dofs.iter().map(|&dof| product[dof as usize]).collect();
            energy_given = problem.stiffness.energy(&start);
        }
        let layer = if adds_to_rows(&scheme) {
            Layer::new(problem)?
        } else {
            None
        };
        let of_layer = layer.iter().flat_map(Layer::dofs);
        Ok(Krylov {
            layer_rows: of_layer.filter_map(|&dof| numbers[dof as usize]).collect(),
            layer,
            choice,
            given,
            energy_given,
            scale,
            state: RefCell::new(State {
                sweeps,
                laws: Vec::new(),
                lu: None,
                room: Room::default(),
                preconditioner: None,
            }),
            scheme,
            free,
            stiff,
            last: RefCell::default(),
            size: Cell::new(0.0),
            built: Cell::new(0),
        })
    }

    /// The matrix of the linear scheme with these laws; the dofs wholly in contact.
    fn put(&self, laws: &[Weights], matrix: &mut Csr) -> Vec<u32> {
        for (row, values) in &self.stiff {
            matrix.row_values_mut(*row as usize).copy_from_slice(values);
        }
        let mut closed = Vec::new();
        let mut open = Vec::new();
        for (condition, law) in self.scheme.conditions.iter().zip(laws) {
            condition.for_each_entry(*law, |i, j, value| {
                let (Some(i), Some(j)) =
                    (self.free.number[i as usize], self.free.number[j as usize])
                else {
                    return;
                };
                let place = matrix.row_columns(i as usize).iter().position(|&c| c == j);
                if let Some(k) = place {
                    matrix.row_values_mut(i as usize)[k] += value;
                }
            });
            if law[1] == 0.0 {
                &mut closed
            } else {
                &mut open
            }
            .extend(self.held_by(condition));
        }
        // A face partly in contact is open.
        closed.sort_unstable();
        closed.dedup();
        open.sort_unstable();
        closed.retain(|dof| open.binary_search(dof).is_err());
        closed
    }

    /// The dofs on Γ_C that a condition holds where it is in contact: on CR the one that is 1 on the face.
    fn held_by<'c>(&self, condition: &'c Condition) -> impl Iterator<Item = u32> + 'c {
        let values = &condition.displacement;
        let of_faces = self.scheme.problem.space.element.on().faces;
        let largest = values.iter().fold(0.0, |m: f64, g| m.max(*g));
        let holds = move |g: f64| if of_faces { g == largest } else { g != 0.0 };
        let dofs = condition.dofs.iter().zip(values);
        dofs.filter(move |(_, g)| holds(**g)).map(|(dof, _)| *dof)
    }

    /// P1 functions that vanish on Γ_D and where there is contact.
    fn embedded(&self, closed: &[u32]) -> Result<Embedded> {
        let on_vertices = self.scheme.problem.vertex_stiffness()?;
        let found = self.free.embedded(closed, on_vertices);
        found.ok_or_else(|| Error::Solver {
            what: "the P1 matrix on this mesh does not coarsen (cells of extreme shape?)".into(),
            remedy: "use --linear multifrontal".into(),
        })
    }
}

impl Krylov<'_> {
    /// Gives u at the free numbers, and the stiffness times that, from the rows that are summed already: rounding in these does
    /// not matter on the way, and the last step takes the residual from the cells. The same u is needed repeatedly.
    fn with_product<T>(&self, u: &[f64], take: impl FnOnce(&[f64], &[f64]) -> T) -> T {
        let [v, y] = &mut *self.last.borrow_mut();
        let dofs = &self.free.dofs;
        let chunks = dofs.chunks(CHUNK).zip(v.chunks(CHUNK));
        let is_last = parallel::map(chunks, |(dofs, v)| {
            let mut pairs = dofs.iter().zip(v);
            pairs.all(|(&dof, v)| u[dof as usize] == *v)
        });
        if v.len() < dofs.len() || is_last.contains(&false) {
            v.resize(dofs.len(), 0.0);
            parallel::update(v, |k, _| u[dofs[k] as usize]);
            y.resize(v.len(), 0.0);
            self.multiply(v, y);
        }
        take(v, y)
    }

    fn multiply(&self, v: &[f64], y: &mut [f64]) {
        let state = self.state.borrow();
        let matrix = state.sweeps.matrix();
        matrix.times(v, y);
        for (row, values) in &self.stiff {
            let columns = matrix.row_columns(*row as usize).iter();
            let terms = columns.zip(values).map(|(&j, a)| a * v[j as usize]);
            y[*row as usize] = terms.sum();
        }
    }

    /// The stiffness times u, 0 on Γ_D.
    fn times(&self, u: &[f64]) -> Vec<f64> {
        self.size.set(norm(u));
        let given = &self.given;
        self.with_product(u, |_, y| self.at_all(|k| y[k] + given[k]))
    }

    /// Numbers at all dofs, 0 on Γ_D.
    fn at_all(&self, of_free: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let number = &self.free.number;
        let mut values = vec![0.0; number.len()];
        parallel::update(&mut values, |dof, _| {
            number[dof].map_or(0.0, |k| of_free(k as usize))
        });
        values
    }

    /// Numbers made of those at the free dofs.
    fn at_free(&self, of_all: &[f64], of: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
        let dofs = &self.free.dofs;
        let mut values = vec![0.0; dofs.len()];
        parallel::update(&mut values, |k, _| of(of_all[dofs[k] as usize]));
        values
    }

    /// δ with at most `wanted` of the residual left, or `least`.
    fn solve(&self, laws: &[Weights], r: &[f64], wanted: f64, least: f64) -> Result<Vec<f64>> {
        let state = &mut *self.state.borrow_mut();
        let closed = self.put(laws, state.sweeps.matrix_mut());
        // No sweep moves what the layer has.
        let changed = self.stiff.iter().map(|(row, _)| *row);
        state.sweeps.set(changed, &self.layer_rows);
        if let Some(layer) = &self.layer
            && (state.lu.is_none() || state.laws != laws)
        {
            let old = state.lu.take();
            state.lu = Some(layer.lu(&self.scheme.conditions, laws, old));
        }
        state.laws = laws.to_vec();
        let (sweeps, matrix) = (&state.sweeps, state.sweeps.matrix());
        let b = self.at_free(r, |r| -r);
        let size = norm(&b);
        let residual = (wanted * size).max(least);
        if size <= residual {
            return Ok(zeros(r.len()));
        }
        let digits = (size / residual).log10().max(1.0);
        let none = LowRank::default();
        let of_layer = state
            .lu
            .as_ref()
            .map(|lu| lu.changed(&none, &mut Solved::default()));
        let relax_layer = of_layer.as_ref().map(|solve| {
            move |b: &[f64], x: &mut [f64]| {
                let rows = self.layer_rows.iter();
                let rest: Vec<f64> = rows.map(|&i| matrix.rest(i as usize, b, x)).collect();
                for (&row, change) in self.layer_rows.iter().zip(solve(&rest)) {
                    x[row as usize] += change;
                }
            }
        });
        let relax_layer = relax_layer.as_ref();
        let mut delta = zeros(b.len());
        // From where an earlier one left off.
        let mut iterate = |embedded: &mut Embedded, steps: usize| {
            let stop = KrylovStop { residual, steps };
            let apply = |x: &[f64], y: &mut [f64]| {
                let (bytes, flops) = (matrix.bytes() + 16 * x.len(), 2 * matrix.entries());
                let _span = tracing::debug_span!("products", bytes, flops).entered();
                matrix.times(x, y);
            };
            let mut precondition = |r: &[f64], z: &mut [f64], product: Option<&mut [f64]>| {
                embedded.apply(sweeps, r, z, product, relax_layer.map(|relax| relax as _));
            };
            let ended = if laws.is_empty() {
                let precondition = |r: &[f64], z: &mut [f64]| precondition(r, z, None);
                conjugate_gradients(apply, precondition, &b, &mut delta, stop)
            } else {
                gmres(apply, precondition, &b, &mut delta, stop, &mut state.room)
            };
            tracing::debug!(?ended, digits, "linear iteration");
            ended
        };
        let has_stalled = |ended: Ended| !ended.reached && !(ended.residual <= STALLED * size);
        let (mut steps, mut stalled) = (0, false);
        if let Some(old) = &mut state.preconditioner {
            let is_stale = old.closed != closed;
            let limit = match is_stale {
                true => ((STALE * old.pace * digits).ceil() as usize).min(STEPS),
                false => STEPS,
            };
            let ended = iterate(&mut old.embedded, limit);
            cancel::check()?;
            steps = ended.steps;
            stalled = has_stalled(ended);
            if is_stale && !ended.reached {
                state.preconditioner = None;
            }
        }
        if state.preconditioner.is_none() {
            let mut embedded = self.embedded(&closed)?;
            self.built.set(self.built.get() + 1);
            let ended = iterate(&mut embedded, STEPS);
            cancel::check()?;
            steps = ended.steps;
            stalled = has_stalled(ended);
            state.preconditioner = Some(Preconditioner {
                embedded,
                closed,
                pace: steps.max(1) as f64 / digits,
            });
        }
        if steps == STEPS || stalled || delta.iter().any(|d| !d.is_finite()) {
            return Err(not_converged(steps));
        }
        Ok(self.at_all(|k| delta[k]))
    }
}

impl System for Krylov<'_> {
    fn conditions(&self) -> &[Condition] {
        &self.scheme.conditions
    }

    fn put_conditions(&mut self, conditions: Vec<Condition>) {
        self.scheme.conditions = conditions.into();
        self.state.get_mut().lu = None;
    }

    fn floating(&self) -> Option<&[Option<u32>]> {
        None
    }

    fn choice(&self) -> Choice {
        self.choice
    }

    fn built(&self) -> Built {
        Built {
            unknowns: self.free.dofs.len(),
            factors: 0,
            dense: 0,
            preconditioners: self.built.get(),
        }
    }

    fn is_solved_but_for_conditions(&self) -> bool {
        false
    }

    fn start(&self) -> Vec<f64> {
        self.scheme.problem.start()
    }

    fn residual(&self, u: &[f64]) -> Vec<f64> {
        self.scheme.residual(self.times(u), u)
    }

    fn linear_residual(&self, laws: &[Weights], u: &[f64]) -> Vec<f64> {
        self.scheme.linear_residual(self.times(u), laws, u)
    }

    fn scale(&self) -> [f64; 2] {
        let load = self.scheme.load().into_iter();
        [self.scale, load.fold(0.0, |m: f64, b| m.max(b.abs()))]
    }

    fn energy(&self, delta: &[f64]) -> Energy {
        if largest(delta) == 0.0 {
            return Energy::of_product(delta, delta);
        }
        self.with_product(delta, Energy::of_product)
    }

    fn size(&self, u: &[f64]) -> Energy {
        let unit = largest(u);
        let given = &self.given;
        self.with_product(u, |v, y| {
            Energy::new(unit, v, |k| y[k] + 2.0 * given[k], self.energy_given)
        })
    }

    /// While conditions change, δ is only as exact as that deserves.
    fn step(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        let changes = {
            let old = &self.state.borrow().laws;
            let pairs = laws.iter().zip(old);
            laws.len() - pairs.filter(|(a, b)| a == b).count()
        };
        let wanted = match changes {
            _ if self.free.dofs.len() <= FEW => FINE,
            0 => FINE,
            few if few <= laws.len() / 50 + 8 => MEDIUM,
            _ => COARSE,
        };
        // Below this lies the rounding of A u: no step is worth it.
        let rounding = f64::EPSILON * self.scale * self.size.get();
        self.solve(laws, r, wanted, rounding)
    }

    fn rough_step(&self, laws: &[Weights], r: &[f64], left: f64) -> Result<Vec<f64>> {
        self.solve(laws, r, left, 0.0)
    }

    fn restrict(&self, u: &[f64]) -> Vec<f64> {
        u.to_vec()
    }

    fn complete(&self, u: &[f64]) -> Vec<f64> {
        u.to_vec()
    }

    fn scheme(&self) -> &Scheme<'_> {
        &self.scheme
    }

    /// From u as exact as a step makes it, δ to four digits is below the rounding of A u.
    fn step_everywhere(&self, laws: &[Weights], r: Vec<f64>) -> Result<Vec<f64>> {
        self.solve(laws, &r, MEDIUM, 0.0)
    }
}

/// Whether the law adds to the rows of contact cells, instead of replacing some.
fn adds_to_rows(scheme: &Scheme) -> bool {
    let replaces = scheme.problem.method().law.replaces_rows();
    !replaces && scheme.conditions.iter().any(|c| c.row.is_none())
}

/// Iterations of Newton's method times those of each step, and of its last one, as measured in 2D and in 3D: they hardly
/// depend on the mesh.
const ITERATIONS: [f64; 2] = [100.0, 60.0];

/// None if parts are constrained only by contact.
fn choice(scheme: &Scheme) -> Option<Choice> {
    let problem = scheme.problem;
    if problem.floating.is_some() {
        return None;
    }
    let of_layer = adds_to_rows(scheme).then(|| Layer::predicted(problem));
    let count = ITERATIONS[problem.space.mesh.dim - 2];
    let beside = of_layer.unwrap_or_default();
    Some(iterations(&problem.stiffness, count, beside))
}

fn not_converged(steps: usize) -> Error {
    Error::Solver {
        what: format!("the iterative solver did not converge in {steps} iterations"),
        remedy: "use --linear multifrontal, or check the mesh for cells of extreme shape".into(),
    }
}

#[cfg(test)]
mod tests;
