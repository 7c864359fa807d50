//! Solves (3.1): Newton as the primal-dual active set strategy, which always ends, and the paper's
//! fixed points.

use std::time::Instant;

use super::active_set::{ActiveSet, Per};
use super::choose::system;
use super::continuation::{DOZEN, follow, newton};
use super::form::Problem;
use super::iteration::Iteration;
use super::scheme::Scheme;
use super::sensitivity::{for_each_contact_term, moved_by_rounding};
use super::solution::{Ended, Solution, Stop, Timings};
use super::system::{Energy, System, Weights, largest, plus};
use crate::linear::{Choice, Precision, Settings, Solver, add};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::parallel;

/// A residual is rounding when two steps in a row leave not more than this, relative to the
/// largest terms.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// A field that is called converged has at most this backward error, or the tolerance where that is larger: by an
/// increment by itself does not show a contact of stiffness γ⁻¹ that is still to come, or to go.
const BACKWARD: f64 = 1e-9;
/// Where steps of refinement stay larger than this part of u, rounding decides what u is.
const SETTLED: f64 = 1e-3;
/// Likewise where rounding in the contact terms, as large as it may be and with the worst signs, moves u by more: what it is
/// and the signs that it has leave a small part of that.
const MOVED: f64 = 1e-2;
/// A fixed point's increments bound its error but for the factor 1/(1-rate).
const SLOWEST: f64 = 100.0;

/// Solves (3.1). `progress` is called with each step and its relative increment; an error it returns
/// ends the run.
///
/// ```
/// use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, quantities, solve};
/// use faceoff_fem::scene::Scene;
///
/// # fn main() -> faceoff_mesh::Result<()> {
/// let scene = Scene::find("one-zone")?;
/// let mesh = scene.triangulation(Some(8))?;
/// let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::p2()))?;
/// let mut steps = 0;
/// let solution = solve(&problem, Iteration::Newton, Stop::default(), |step, _| {
///     steps = step;
///     Ok(())
/// })?;
/// assert_eq!(solution.increments.len(), steps);
/// // What presses on the obstacle is negative.
/// assert!(quantities(&problem, &solution.u).contact_flux < 0.0);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// What `progress` returns; a fixed point for a method that has none; a stiffness that is not
/// positive definite, or a singular Newton matrix. An iteration that does not reach its tolerance is
/// not an error: its result states this.
pub fn solve(
    problem: &Problem,
    iteration: Iteration,
    stop: Stop,
    progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Solution> {
    solve_by(problem, iteration, stop, Settings::default(), progress)
}

/// [`solve`] with a linear solver of one's choice.
///
/// # Errors
/// The errors of [`solve`]; more memory needed than there is.
pub fn solve_by(
    problem: &Problem,
    iteration: Iteration,
    stop: Stop,
    settings: Settings,
    mut progress: impl FnMut(usize, f64) -> Result<()>,
) -> Result<Solution> {
    if iteration != Iteration::Newton && !problem.method().is_nitsche() {
        return Err(Error::usage(
            format!(
                "{iteration} is a fixed point of the family (2.4) and of cr-fc, and {} is neither",
                problem.method()
            ),
            "use newton, which for the variational inequalities is the primal-dual active set",
        ));
    }
    let clock = Instant::now();
    let rows = match iteration {
        Iteration::Newton => Scheme::new(problem),
        _ => Scheme::as_it_stands(problem),
    };
    let system = system(rows, settings)?;
    let choice = system.choice();
    let ended = iterate(problem, system, clock, iteration, stop, &mut progress);
    match (ended, safer(settings, choice)) {
        (Err(first @ Error::Solver { .. }), Some(settings)) => {
            tracing::info!(%first, solver = %settings.solver, precision = %settings.precision, "solved again");
            match solve_by(problem, iteration, stop, settings, progress) {
                // Nor is it a matter of digits.
                Err(Error::Solver { .. }) if choice.solver != Solver::Iterative => Err(first),
                again => again,
            }
        }
        (ended, _) => ended,
    }
}

/// The fallback solver, if the one that was chosen because it is faster or takes less memory fails.
fn safer(settings: Settings, choice: Choice) -> Option<Settings> {
    match (settings.solver, settings.precision) {
        (Solver::Auto, _) if choice.solver == Solver::Iterative => Some(Settings {
            solver: Solver::Multifrontal,
            ..settings
        }),
        (_, Precision::Auto) if choice.precision == Precision::F32Refined => Some(Settings {
            precision: Precision::F64,
            ..settings
        }),
        _ => None,
    }
}

/// Solves the scheme of a system, which was put together since `clock`.
fn iterate(
    problem: &Problem,
    mut system: Box<dyn System + '_>,
    clock: Instant,
    iteration: Iteration,
    stop: Stop,
    progress: &mut dyn FnMut(usize, f64) -> Result<()>,
) -> Result<Solution> {
    let is_newton = iteration == Iteration::Newton;
    let mut scheme = &*system;
    let scale = Scale::new(scheme);
    let factor = clock.elapsed().as_secs_f64();
    let clock = Instant::now();

    let mut per = if scheme.conditions().iter().any(|c| c.row.is_some()) {
        Per::Face
    } else {
        Per::Condition
    };
    let _span = tracing::debug_span!("contact").entered();
    let mut u = match scheme.choice().solver {
        Solver::Iterative => nested_start(problem, progress)?,
        _ => None,
    }
    .unwrap_or_else(|| scheme.start());
    let mut set = ActiveSet::new(scheme, &u, per);
    let (mut increments, mut changes, mut residuals) = (Vec::new(), Vec::new(), Vec::new());
    let mut best = (f64::INFINITY, 0, Vec::new());
    let mut laws: Vec<Weights> = Vec::new();
    let mut ended = Ended::NotReached;
    let mut on_the_way = 0;
    if scheme.conditions().is_empty() && scheme.is_solved_but_for_conditions() {
        // Linear: the whole of u is one increment, and there is nothing to iterate.
        let increment = f64::from(u8::from(!scheme.size(&u).is_zero()));
        (increments, changes, residuals) = (vec![increment], vec![0], vec![0.0]);
        progress(1, increment)?;
        ended = Ended::Rounding;
    }
    while ended == Ended::NotReached && increments.len() < stop.max_iterations {
        if is_newton && increments.len() == DOZEN {
            let start = scheme.start();
            let found = follow(problem, &mut *system, &start, &mut on_the_way, progress)?;
            scheme = &*system;
            if let Some(found) = found {
                (u, per) = (found, Per::Condition);
                set = ActiveSet::new(scheme, &u, per);
            }
        }
        if laws.is_empty() || !iteration.is_constant() {
            laws = set.laws(scheme, iteration);
        }
        let r = if is_newton {
            scheme.linear_residual(&laws, &u)
        } else {
            scheme.residual(&u)
        };
        let mut step = scheme.step(&laws, &r)?;
        if iteration.relaxation() != 1.0 {
            step.iter_mut().for_each(|d| *d *= iteration.relaxation());
        }
        let next = plus(&u, &step);
        let increment = relative_increment(scheme, &scale, &step, &next);
        if let Some(residual) = residuals.last().filter(|r| **r < best.0) {
            best = (*residual, increments.len(), u);
        }
        u = next;
        // A small increment does not exclude remaining violations.
        let mut arrived = increment < stop.increment && !set.is_partial();
        let mut changed = if is_newton {
            set.pivot(scheme, &u)
        } else {
            set.follow(scheme, &u)
        };
        if per == Per::Face && (changed == 0 || arrived) {
            per = Per::Condition;
            let by_face = std::mem::replace(&mut set, ActiveSet::new(scheme, &u, per));
            changed = set.differing(&by_face).len();
            arrived &= changed == 0;
        }
        let mut r = scheme.residual(&u);
        set.scale_rows(scheme, &mut r);
        let before = residuals.last().copied();
        let residual = scale.relative(scheme, &set, &u, &r);
        increments.push(increment);
        changes.push(changed);
        residuals.push(residual);
        progress(increments.len(), increment)?;
        if !increment.is_finite() {
            break;
        }
        // Newton's residual is that of the violations; a fixed point has nothing else than its increments.
        let solves = !is_newton || residual <= stop.increment.max(BACKWARD);
        if per == Per::Condition && arrived && solves && !set.is_partial() {
            ended = Ended::Increment;
        } else if residual <= ROUNDING && before.is_some_and(|r| r <= ROUNDING) {
            ended = Ended::Rounding;
        }
    }
    let mut step = increments.len();
    if !ended.converged() && !residuals.last().is_some_and(|r| *r <= best.0) && !best.2.is_empty() {
        (_, step, u) = best;
    }
    let iterate = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let mut u = scheme.complete(&u);
    let backward_error = if ended.converged() && is_newton {
        let limit = stop.increment.max(BACKWARD);
        let (failed, error) = refine(problem, scheme, &mut set, &mut u, limit)?;
        ended = failed.unwrap_or(ended);
        error
    } else {
        // A fixed point is what it is: Newton's step would replace it.
        let error = problem.backward_error(&u).0;
        if !(error <= (SLOWEST * stop.increment).max(BACKWARD)) {
            ended = Ended::NotReached;
        }
        error
    };
    Ok(Solution {
        u,
        step,
        on_the_way,
        increments,
        changes,
        residuals,
        ended,
        converged: ended.converged(),
        backward_error,
        seconds: Timings {
            factor,
            iterate,
            expand: clock.elapsed().as_secs_f64(),
        },
        linear: scheme.choice(),
        built: scheme.built(),
    })
}

/// The reduction of the residual in a step towards the initial guess: the next one continues from there.
const ROUGH: f64 = 0.1;

/// u of the variational inequality on P1, which has nearly the same contact set at a third of the unknowns in 2D and
/// a tenth in 3D; g on Γ_D. None without contact, where P1 has no fewer unknowns, and where it is not solved.
///
/// # Errors
/// What `progress` returns; its steps count as 0.
fn nested_start(
    problem: &Problem,
    progress: &mut dyn FnMut(usize, f64) -> Result<()>,
) -> Result<Option<Vec<f64>>> {
    let mesh = problem.space.mesh;
    if problem.conditions.is_empty() || problem.space.dofs <= mesh.points.len() {
        return Ok(None);
    }
    let _span = tracing::debug_span!("P1 start", whole = true).entered();
    let settings = Settings {
        solver: Solver::Iterative,
        ..Settings::default()
    };
    let coarse = problem.on_p1()?;
    let system = system(Scheme::new(&coarse), settings);
    let found = system.and_then(|system| {
        let step = |laws: &[Weights], r: &[f64]| system.rough_step(laws, r, ROUGH);
        let most = Stop::default().max_iterations;
        newton(&*system, step, &system.start(), most, &mut 0, progress)
    });
    let found = match found {
        Ok(Some(found)) => found,
        Ok(None) | Err(Error::Solver { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let mut u = vec![0.0; problem.space.dofs];
    parallel::update(&mut u, |dof, _| {
        let of_vertices = problem.space.vertex_values(dof);
        of_vertices
            .map(|(k, value)| value * found[k as usize])
            .sum()
    });
    for (dof, g) in problem.dirichlet.given() {
        u[dof] = g;
    }
    Ok(Some(u))
}

/// Most steps of refinement: each brings a digit or more where a factor in f32 has any.
const REFINEMENTS: usize = 20;

/// Steps at all dofs until they are at rounding and the backward error is below `limit`; what is wrong where they do not
/// come there, and that error. From a factor in f64 one step does, or two from faer's, which knows the Schur complement
/// less well: without them the condition of the stiffness, of order h⁻², would show in the last digits. From one in f32 each
/// step brings six digits. After a loose tolerance the active set is only right as far as u resolves it, and is updated with it.
fn refine(
    problem: &Problem,
    scheme: &dyn System,
    set: &mut ActiveSet,
    u: &mut [f64],
    limit: f64,
) -> Result<(Option<Ended>, f64)> {
    let _span = tracing::debug_span!("refinement").entered();
    let choice = scheme.choice();
    let least = match (choice.precision, choice.solver) {
        (Precision::F32Refined, _) | (_, Solver::Faer) => 2,
        (Precision::F64 | Precision::Auto, _) => 1,
    };
    let mut last = f64::INFINITY;
    for step in 1..=REFINEMENTS {
        let laws = set.laws(scheme, Iteration::Newton);
        let size = take_step(scheme, &laws, u)?;
        tracing::debug!(step, size, "refinement");
        let mut rests = step >= least && size <= SETTLED;
        if choice.precision == Precision::F32Refined {
            // It is at rounding, or the next one would be; or steps grow smaller no more.
            let is_last = size <= f64::EPSILON || size * (size / last) <= f64::EPSILON;
            rests &= is_last || size > 0.5 * last;
        }
        last = size;
        if rests {
            let error = problem.backward_error(u).0;
            if error <= limit || vanishes(problem, u) {
                let moved = moved_by_rounding(scheme, &laws, &scheme.restrict(u))?;
                tracing::debug!(moved, "rounding in the contact terms");
                return Ok(((moved > MOVED).then_some(Ended::Undetermined), error));
            }
            set.pivot(scheme, &scheme.restrict(u));
        }
    }
    if choice.precision == Precision::F32Refined {
        return Err(Error::Solver {
            what: format!(
                "{REFINEMENTS} steps of refinement with a factor in f32 do not settle (the last one is {last:.1e} of u)"
            ),
            remedy: "use --precision f64".into(),
        });
    }
    let failed = if last <= SETTLED {
        Ended::NotReached
    } else {
        Ended::Undetermined
    };
    Ok((Some(failed), problem.backward_error(u).0))
}

/// Whether the residual is rounding in units of the largest terms of the stiffness and the load. Where u vanishes with all its
/// neighbours the terms of a row are rounding themselves.
fn vanishes(problem: &Problem, u: &[f64]) -> bool {
    let terms = largest(&problem.stiffness.sizes(u)) + largest(&problem.load);
    largest(&problem.residual(u)) <= ROUNDING * terms
}

/// One step at all dofs; max |δ| over max |u|.
pub(super) fn take_step(scheme: &dyn System, laws: &[Weights], u: &mut [f64]) -> Result<f64> {
    let rows = scheme.scheme();
    let r = rows.linear_residual(rows.problem.stiffness.times(u), laws, u);
    let step = scheme.step_everywhere(laws, r)?;
    add(u, &step, 1.0);
    let size = largest(u);
    Ok(if size > 0.0 {
        largest(&step) / size
    } else {
        0.0
    })
}

/// The reference for residuals.
struct Scale {
    /// ‖S‖ in the maximum norm, max |g|.
    stiffness: f64,
    load: f64,
}

impl Scale {
    fn new(scheme: &dyn System) -> Self {
        let [stiffness, load] = scheme.scale();
        Scale { stiffness, load }
    }

    /// max |R_i| over ‖S‖ max |u|, max |g| and the largest contact term; 0 where all vanish. Rows
    /// are scaled as `set` has them.
    fn relative(&self, scheme: &dyn System, set: &ActiveSet, u: &[f64], r: &[f64]) -> f64 {
        let size = largest(r);
        if size == 0.0 {
            return 0.0;
        }
        let mut terms = self.stiffness * largest(u) + self.load;
        let laws = set.laws(scheme, Iteration::Newton);
        for_each_contact_term(scheme.conditions(), &laws, u, |_, size| {
            terms = terms.max(size)
        });
        size / terms
    }
}

/// The energy norm of δ, in the norm of u; 0 where both vanish.
fn relative_increment(scheme: &dyn System, scale: &Scale, step: &[f64], u: &[f64]) -> f64 {
    let increment = scheme.energy(step);
    if increment.is_zero() {
        return 0.0;
    }
    let size = scheme.size(u);
    // Where u hardly leaves the start its own size is rounding.
    let least = Energy {
        unit: largest(u),
        value: 1e-6 * scale.stiffness,
    };
    increment.over(if size.over(least) > 1.0 { size } else { least })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A solver that was requested by name is not replaced.
    #[test]
    fn what_was_chosen_has_a_safer_way_and_what_was_asked_for_has_none() {
        let chosen = |solver, precision| Choice {
            solver,
            precision,
            entries: 1,
            flops: 1.0,
            predicted_mb: 1.0,
            predicted_seconds: 1.0,
        };
        let settings = |solver, precision| Settings { solver, precision };
        let (auto, multifrontal) = (Solver::Auto, Solver::Multifrontal);
        let narrow = chosen(multifrontal, Precision::F32Refined);
        for solver in [auto, multifrontal] {
            let wide = Some(settings(solver, Precision::F64));
            assert_eq!(safer(settings(solver, Precision::Auto), narrow), wide);
            for precision in [Precision::F64, Precision::F32Refined] {
                let choice = chosen(multifrontal, precision);
                assert_eq!(safer(settings(solver, precision), choice), None);
            }
        }
        let iterated = chosen(Solver::Iterative, Precision::F64);
        let factored = settings(multifrontal, Precision::Auto);
        assert_eq!(
            safer(settings(auto, Precision::Auto), iterated),
            Some(factored)
        );
        assert_eq!(
            safer(settings(Solver::Iterative, Precision::Auto), iterated),
            None
        );
    }
}
