//! The scheme condensed onto the dofs K that its contact conditions see, and onto those that separate parts of a long Γ_C.
//!
//! Only the conditions are nonlinear. The other rows state A_II u_I + A_IK u_K = b_I, which is solved
//! once for all u_K; what is left is a scheme of the same form on K,
//!
//! ```text
//! S u_K - Σ_k w_k q_k g_k + Σ_k w_k max(g_k-ψ_k, γ_k q_k) (θ₂γ_k⁻¹ g_k + θ₁ q_k') = g,
//! S = A_KK - A_KI A_II⁻¹ A_IK,   g = b_K - A_KI A_II⁻¹ b_I
//! ```
//!
//! whose steps cost nothing that grows with the number of cells. u_I follows at the end.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use super::condition::Condition;
use super::form::Problem;
use super::scheme::{Scheme, clear_rows};
use super::system::{Built, Energy, System, Weights};
use crate::linear::{
    Changed, Choice, Entry, Factor, LowRank, Reduced, Role, Row, Schur, SchurLu, Settings, Solved,
    clear, condense,
};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// Vectors of this scheme hold the free dofs of K, ascending, and then those of K on Γ_D.
pub(super) struct Condensed<'a> {
    problem: &'a Problem<'a>,
    scheme: Scheme<'a>,
    /// The scheme's conditions with the numbers of K.
    conditions: Vec<Condition>,
    /// The part of the domain of each of K, where it is one that Γ_D does not hold.
    floating: Option<Vec<Option<u32>>>,
    choice: Choice,
    factor: Factor,
    /// b condensed, until u is completed with it.
    reduced: Cell<Option<Reduced>>,
    /// The energy where the iteration starts.
    started: f64,
    /// S with the shift, and the shift with the other sign.
    schur: Schur,
    shift: Vec<Entry>,
    /// g
    load: Vec<f64>,
    /// Dofs of K: the free ones, and those on Γ_D.
    kept: Vec<u32>,
    fixed: Vec<u32>,
    stale: RefCell<Option<Stale>>,
    /// Dense factorisations so far.
    dense: Cell<usize>,
    /// The last vector that S was multiplied with, and the product: three parts of a step ask for that of the same u.
    last: RefCell<(Vec<f64>, Vec<f64>)>,
}

/// The last factorisation of S + N, the laws that it is for, and what has been solved with it.
struct Stale {
    lu: SchurLu,
    laws: Vec<Weights>,
    solved: Solved,
}

/// The matrix that is added to the stiffness of cells if Γ_D does not constrain all of the domain: the mass of Γ_C, so that the matrix
/// is definite.
fn shift_of_cells(problem: &Problem) -> BTreeMap<usize, Vec<f64>> {
    let mut shift = BTreeMap::new();
    if problem.floating.is_none() {
        return shift;
    }
    let local = problem.space.local_dofs;
    for face in &problem.contact {
        let mass = shift.entry(face.cell).or_insert(vec![0.0; local * local]);
        // Of the size of the stiffness, in any unit of length.
        let mesh = problem.space.mesh;
        let size = mesh.geometry(face.cell).diameter.powi(mesh.dim as i32 - 2);
        for point in &face.points {
            let weight = size * point.weight / face.measure;
            for i in 0..local {
                for j in 0..local {
                    mass[i * local + j] += weight * point.phi[i] * point.phi[j];
                }
            }
        }
    }
    shift
}

/// The dofs of contact cells and those that conditions see, ascending.
pub(super) fn of_contact_cells(problem: &Problem) -> Vec<u32> {
    let cells = problem.contact.iter();
    let mut seen: Vec<u32> = cells
        .flat_map(|face| problem.space.cell_dofs(face.cell))
        .chain(problem.conditions.iter().flat_map(|c| &c.dofs))
        .copied()
        .collect();
    seen.sort_unstable();
    seen.dedup();
    seen
}

/// The number of a dof: of the free ones in `kept`, or behind them of those on Γ_D.
fn number(dof: u32, kept: &[u32], fixed: &[u32]) -> u32 {
    match kept.binary_search(&dof) {
        Ok(k) => k as u32,
        Err(_) => (kept.len() + fixed.partition_point(|other| *other < dof)) as u32,
    }
}

fn numbered(conditions: &[Condition], kept: &[u32], fixed: &[u32]) -> Vec<Condition> {
    let numbered = |condition: &Condition| condition.with_dofs(|dof| number(dof, kept, fixed));
    conditions.iter().map(numbered).collect()
}

impl<'a> Condensed<'a> {
    /// The scheme back where what is predicted of iterating is better.
    ///
    /// # Errors
    /// Nothing to solve for; a stiffness that is not positive definite; memory that is not there.
    pub fn new(
        scheme: Scheme<'a>,
        settings: Settings,
        instead: Option<Choice>,
    ) -> Result<Result<Self, Scheme<'a>>> {
        let problem = scheme.problem;
        let space = &problem.space;
        let mut roles = problem.dirichlet.map(|held| match held {
            true => Role::Fixed,
            false => Role::Eliminated,
        });
        if !roles.contains(&Role::Eliminated) {
            return Err(Error::Solver {
                what: "Γ_D holds every dof, so there is nothing to solve".into(),
                remedy: "refine the mesh".into(),
            });
        }
        let (fixed, to_keep): (Vec<u32>, Vec<u32>) = of_contact_cells(problem)
            .iter()
            .partition(|&&dof| roles[dof as usize] == Role::Fixed);
        for &dof in &to_keep {
            roles[dof as usize] = Role::Kept;
        }
        let of_cells = shift_of_cells(problem);
        let change = |cell: usize, matrix: &mut [f64]| {
            let shift = of_cells.get(&cell).into_iter().flatten();
            matrix
                .iter_mut()
                .zip(shift)
                .for_each(|(a, shift)| *a += shift);
        };
        let cells = Changed {
            elements: &problem.stiffness,
            change,
        };
        let b = right_side(&scheme);
        let ties: Vec<&[u32]> = scheme.conditions.iter().map(|c| &c.dofs[..]).collect();
        let Some((factor, reduced, schur, choice)) =
            condense(&cells, &roles, &ties, b, settings, instead)?
        else {
            return Ok(Err(scheme));
        };
        let kept = schur.kept().to_vec();
        let number = |dof: u32| number(dof, &kept, &fixed);
        let mut shift = Vec::new();
        for (&cell, matrix) in &of_cells {
            let dofs = space.cell_dofs(cell);
            for (&i, row) in dofs.iter().zip(matrix.chunks_exact(dofs.len())) {
                for (&j, value) in dofs.iter().zip(row) {
                    let free = |dof: u32| roles[dof as usize] == Role::Kept;
                    if free(i) && free(j) {
                        shift.push((number(i), number(j), -value));
                    }
                }
            }
        }
        let conditions = numbered(&scheme.conditions, &kept, &fixed);
        let floating = problem.floating.as_ref().map(|floating| {
            let dofs = kept.iter().chain(&fixed);
            dofs.map(|&dof| floating[dof as usize]).collect()
        });
        Ok(Ok(Condensed {
            problem,
            scheme,
            conditions,
            floating,
            choice,
            load: reduced.kept().to_vec(),
            started: reduced.energy().max(0.0),
            factor,
            reduced: Cell::new(Some(reduced)),
            schur,
            shift,
            kept,
            fixed,
            stale: RefCell::new(None),
            dense: Cell::new(0),
            last: RefCell::default(),
        }))
    }

    fn residual_with(&self, u: &[f64], add: impl Fn(usize, &Condition, &mut [f64])) -> Vec<f64> {
        let mut r = self.times(u);
        for (r, g) in r.iter_mut().zip(&self.load) {
            *r -= g;
        }
        r.resize(u.len(), 0.0);
        clear_rows(&self.conditions, &mut r);
        for (k, condition) in self.conditions.iter().enumerate() {
            add(k, condition, &mut r);
        }
        r[self.load.len()..].fill(0.0);
        r
    }

    /// S u of the free dofs, the shift included.
    fn schur_times(&self, u: &[f64]) -> Vec<f64> {
        let mut last = self.last.borrow_mut();
        if last.0 != u || u.is_empty() {
            *last = (u.to_vec(), self.schur.times(u));
        }
        last.1.clone()
    }

    /// The same without the shift.
    fn times(&self, u: &[f64]) -> Vec<f64> {
        let mut y = self.schur_times(&u[..self.load.len()]);
        for &(i, j, value) in &self.shift {
            y[i as usize] += value * u[j as usize];
        }
        y
    }

    /// From step to step few conditions change their law, so that an earlier factorisation and a
    /// correction of low rank do what a new one would.
    fn solve_kept(&self, laws: &[Weights], b: &[f64]) -> Vec<f64> {
        if b.is_empty() {
            return Vec::new();
        }
        let mut stale = self.stale.borrow_mut();
        let change = stale.as_ref().map(|old| self.change(&old.laws, laws));
        let corrects = |old: &Stale, change: &LowRank| {
            let missing = old.solved.missing(change);
            old.lu.corrects(change.rank(), missing)
        };
        let kept = stale.take().zip(change);
        let (mut old, change) = match kept {
            Some((old, change)) if corrects(&old, &change) => (old, change),
            other => {
                let old = other.map(|(old, _)| old.lu);
                self.dense.set(self.dense.get() + 1);
                let anew = Stale {
                    lu: self.schur.lu(&self.entries(laws), old),
                    laws: laws.to_vec(),
                    solved: Solved::default(),
                };
                (anew, LowRank::default())
            }
        };
        let solve = old.lu.changed(&change, &mut old.solved);
        let mut delta = solve(b);
        // One step of refinement takes away what the correction, or small pivots, left.
        let mut rest = self.times(&delta);
        rest.resize(delta.len() + self.fixed.len(), 0.0);
        let mut whole = delta.clone();
        whole.resize(rest.len(), 0.0);
        for (condition, law) in self.conditions.iter().zip(laws) {
            condition.add_linear_to(*law, &whole, &mut rest);
        }
        let rest: Vec<f64> = b.iter().zip(&rest).map(|(b, r)| b - r).collect();
        for (delta, correction) in delta.iter_mut().zip(solve(&rest)) {
            *delta += correction;
        }
        drop(solve);
        *stale = Some(old);
        delta
    }

    /// N less the shift.
    fn entries(&self, laws: &[Weights]) -> Vec<Entry> {
        let free = self.load.len() as u32;
        let mut entries = self.shift.clone();
        for (condition, law) in self.conditions.iter().zip(laws) {
            condition.for_each_entry(*law, |i, j, value| {
                if i < free && j < free {
                    entries.push((i, j, value));
                }
            });
        }
        entries
    }

    /// N of `new` less N of `old`: conditions with the same test functional share a term.
    fn change(&self, old: &[Weights], new: &[Weights]) -> LowRank {
        let free = self.load.len() as u32;
        let only_free = |row: Row| -> Row { row.into_iter().filter(|(k, _)| *k < free).collect() };
        let mut change = LowRank::default();
        let mut last: Option<(Row, Row)> = None;
        for ((condition, old), new) in self.conditions.iter().zip(old).zip(new) {
            if old == new {
                continue;
            }
            let test = only_free(condition.test_row());
            let row = only_free(condition.law_row([new[0] - old[0], new[1] - old[1]]));
            match &mut last {
                Some((left, right)) if *left == test && same_places(right, &row) => {
                    for (sum, (_, value)) in right.iter_mut().zip(row) {
                        sum.1 += value;
                    }
                }
                _ => {
                    if let Some((left, right)) = last.replace((test, row)) {
                        change.push(left, right);
                    }
                }
            }
        }
        if let Some((left, right)) = last {
            change.push(left, right);
        }
        change
    }
}

impl System for Condensed<'_> {
    fn conditions(&self) -> &[Condition] {
        &self.conditions
    }

    fn put_conditions(&mut self, conditions: Vec<Condition>) {
        self.conditions = numbered(&conditions, &self.kept, &self.fixed);
        self.scheme.conditions = conditions.into();
        *self.stale.borrow_mut() = None;
    }

    fn floating(&self) -> Option<&[Option<u32>]> {
        self.floating.as_deref()
    }

    fn choice(&self) -> Choice {
        self.choice
    }

    fn built(&self) -> Built {
        Built {
            unknowns: self.load.len(),
            factors: 1,
            dense: self.dense.get(),
            preconditioners: 0,
        }
    }

    fn is_solved_but_for_conditions(&self) -> bool {
        true
    }

    /// u on K: 0 but for g on Γ_D.
    fn start(&self) -> Vec<f64> {
        let dirichlet = &self.problem.dirichlet;
        let fixed = self.fixed.iter();
        let g = fixed.map(|&dof| dirichlet[dof as usize].unwrap_or(0.0));
        std::iter::repeat_n(0.0, self.load.len()).chain(g).collect()
    }

    /// The residual of the scheme on the free dofs of K, 0 on the others.
    fn residual(&self, u: &[f64]) -> Vec<f64> {
        self.residual_with(u, |_, condition, r| condition.add_to(u, r))
    }

    /// The same of the linear scheme with these laws.
    fn linear_residual(&self, laws: &[Weights], u: &[f64]) -> Vec<f64> {
        self.residual_with(u, |k, condition, r| condition.add_law_to(laws[k], u, r))
    }

    /// The reference for residuals: ‖S‖ in the maximum norm, and max |g|.
    fn scale(&self) -> [f64; 2] {
        let load = self.load.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
        [self.schur.norm(), load]
    }

    /// (∇v,∇v)_h of the v that is δ on K, 0 on Γ_D, and solves the rows of all other dofs without
    /// load; with the shift added that holds what Γ_D does not.
    fn energy(&self, delta: &[f64]) -> Energy {
        let delta = &delta[..self.load.len()];
        Energy::of_product(delta, &self.schur_times(delta))
    }

    /// The same of u less what it is where the iteration starts, the load included.
    fn size(&self, u: &[f64]) -> Energy {
        let started = self.started;
        let on_kept = self.energy(u);
        let value = on_kept.value + started / on_kept.unit / on_kept.unit;
        if on_kept.is_zero() || !value.is_finite() {
            return Energy {
                unit: 1.0,
                value: started,
            };
        }
        Energy { value, ..on_kept }
    }

    /// δ on K with (S + N) δ = -r, where N is of the conditions with these laws.
    ///
    /// # Errors
    /// A singular matrix.
    fn step(&self, laws: &[Weights], r: &[f64]) -> Result<Vec<f64>> {
        let minus: Vec<f64> = r[..self.load.len()].iter().map(|r| -r).collect();
        let mut delta = self.solve_kept(laws, &minus);
        if let Some(k) = delta.iter().position(|d| !d.is_finite()) {
            return Err(Error::Solver {
                what: format!(
                    "the Newton matrix is singular (contact dof {k} of the step is {})",
                    delta[k]
                ),
                remedy: "check gamma0, the data, and what holds the domain".into(),
            });
        }
        delta.resize(r.len(), 0.0);
        Ok(delta)
    }

    /// u on K from u at all dofs.
    fn restrict(&self, u: &[f64]) -> Vec<f64> {
        let dofs = self.kept.iter().chain(&self.fixed);
        dofs.map(|&dof| u[dof as usize]).collect()
    }

    /// u at all dofs from u on K.
    fn complete(&self, on_kept: &[f64]) -> Vec<f64> {
        let mut u = self.problem.start();
        let kept = &on_kept[..self.load.len()];
        let reduced = self.reduced.take();
        let anew = || self.factor.reduce(&right_side(&self.scheme));
        self.factor
            .expand(reduced.unwrap_or_else(anew), kept, &mut u);
        u
    }

    fn scheme(&self) -> &Scheme<'_> {
        &self.scheme
    }

    fn step_everywhere(&self, laws: &[Weights], mut r: Vec<f64>) -> Result<Vec<f64>> {
        // Rows of Γ_D are not read.
        let reduced = self.factor.reduce(&r);
        let mut on_kept = reduced.kept().to_vec();
        on_kept.resize(self.load.len() + self.fixed.len(), 0.0);
        let delta = self.step(laws, &on_kept)?;
        // What r gives is the step with the other sign.
        let minus: Vec<f64> = delta[..self.load.len()].iter().map(|d| -d).collect();
        clear(&mut r);
        self.factor.expand(reduced, &minus, &mut r);
        parallel::update(&mut r, |_, step| -step);
        Ok(r)
    }
}

/// L(φ_i) - (∇u, ∇φ_i), all dofs, with u where the iteration starts.
fn right_side(scheme: &Scheme) -> Vec<f64> {
    let mut b = scheme.load();
    let problem = scheme.problem;
    if problem.dirichlet.given().any(|(_, g)| g != 0.0) {
        for (b, r) in b.iter_mut().zip(problem.stiffness.times(&problem.start())) {
            *b -= r;
        }
    }
    b
}

fn same_places(a: &[(u32, f64)], b: &[(u32, f64)]) -> bool {
    a.iter().map(|a| a.0).eq(b.iter().map(|b| b.0))
}
