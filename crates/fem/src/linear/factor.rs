//! A symmetric positive definite system condensed onto the unknowns that are kept.
//!
//! With I the eliminated and K the kept unknowns, A x = b is
//!
//! ```text
//! S x_K = g,   x_I = A_II⁻¹ (b_I - A_IK x_K),
//! S = A_KK - A_KI A_II⁻¹ A_IK,   g = b_K - A_KI A_II⁻¹ b_I
//! ```

use super::cholesky::{Cholesky, Solved};
use super::multifrontal::{Forward, Multifrontal, Refused};
use super::{Analysis, Changed, Elements, Precision, Role, Schur, Settings, Solver};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::memory;

/// The chosen solver, and its predicted cost.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Choice {
    /// Never [`Solver::Auto`].
    pub solver: Solver,
    /// Of the factor; never [`Precision::Auto`].
    pub precision: Precision,
    /// Entries of the factor; of the matrix where iterations solve.
    pub entries: usize,
    /// Multiplications and additions.
    pub flops: f64,
    /// Memory predicted, in MB.
    pub predicted_mb: f64,
    /// Seconds of one core predicted, by which [`Solver::Auto`] chooses: their unit is that of one machine.
    #[serde(skip)]
    pub predicted_seconds: f64,
}

impl Choice {
    fn bytes_of_factor(&self) -> usize {
        self.entries
            * match self.precision {
                Precision::F32Refined => 4,
                Precision::F64 | Precision::Auto => 8,
            }
    }
}

/// A factorisation of the eliminated unknowns.
///
/// The factored matrix is A divided by a power of two of its size: the pivots' roots then have the same digits in any unit, and
/// numbers of f32 their range.
pub struct Factor {
    kind: FactorKind,
    bytes: usize,
    unit: f64,
}

enum FactorKind {
    Faer(Box<Cholesky>),
    F64(Box<Multifrontal<f64>>),
    F32(Box<Multifrontal<f32>>),
}

/// A right-hand side condensed.
#[derive(Clone)]
pub struct Reduced {
    kind: Kind,
    kept: Vec<f64>,
    unit: f64,
}

#[derive(Clone)]
enum Kind {
    Faer(Solved),
    Multifrontal(Forward),
}

impl Reduced {
    fn new(kind: Kind, unit: f64) -> Self {
        let kept = match &kind {
            Kind::Faer(solved) => &solved.kept,
            Kind::Multifrontal(forward) => &forward.kept,
        };
        Reduced {
            kept: kept.iter().map(|g| unit * g).collect(),
            kind,
            unit,
        }
    }

    /// g
    pub fn kept(&self) -> &[f64] {
        &self.kept
    }

    /// b_Iᵀ A_II⁻¹ b_I: with x_Kᵀ S x_K it makes xᵀ A x.
    pub fn energy(&self) -> f64 {
        let energy = match &self.kind {
            Kind::Faer(solved) => solved.energy,
            Kind::Multifrontal(forward) => forward.energy(),
        };
        self.unit * energy
    }
}

/// The power of two that the largest entry of the first element has.
fn unit_of(elements: &impl Elements) -> f64 {
    let mut matrix = vec![0.0; elements.size() * elements.size()];
    if elements.count() > 0 {
        elements.matrix(0, &mut matrix);
    }
    let largest = matrix.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
    let exponent = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    let usable = exponent.is_normal() && exponent.recip().is_normal();
    if usable { exponent } else { 1.0 }
}

fn over(b: &[f64], unit: f64) -> Vec<f64> {
    b.iter().map(|b| b / unit).collect()
}

/// A factor, b condensed, S, and how it was done. The kept unknowns are in ascending order; more than were to be kept
/// may be. `ties` couple kept unknowns in matrices that S is to be factored with. None where the solver is to be chosen, and
/// what is predicted of `instead` is better.
///
/// # Errors
/// A matrix that is not positive definite; more memory needed than there is.
pub fn condense(
    elements: &impl Elements,
    roles: &[Role],
    ties: &[&[u32]],
    b: Vec<f64>,
    settings: Settings,
    instead: Option<Choice>,
) -> Result<Option<(Factor, Reduced, Schur, Choice)>> {
    let ordering = tracing::debug_span!("ordering").entered();
    if let (Solver::Auto, Some(other)) = (settings.solver, instead)
        && other.predicted_seconds < Analysis::seconds_at_least(elements, roles)
        && memory::available().is_none_or(|there| other.predicted_mb * 1e6 < there as f64)
    {
        tracing::info!("iterations, without an ordering");
        return Ok(None);
    }
    let analysis = Analysis::new(elements, roles, ties, settings.solver == Solver::Faer);
    let Some(choice) = choose(&analysis, elements, settings, instead)? else {
        return Ok(None);
    };
    drop(ordering);
    // The factor is written once.
    let (bytes, flops) = (choice.bytes_of_factor(), analysis.flops_once());
    let _span = tracing::debug_span!("factorisation", bytes, flops).entered();
    tracing::info!(
        solver = %choice.solver,
        precision = %choice.precision,
        entries = choice.entries,
        gigaflops = choice.flops / 1e9,
        predicted_mb = choice.predicted_mb,
        "direct factorisation"
    );
    let refuse = |refused| {
        match refused {
        Refused::NotPositive(unknown) => Error::Solver {
            what: format!("the stiffness matrix is not positive definite (at dof {unknown})"),
            remedy: "check that Γ_D (or contact) fixes every connected part, and that no cell is degenerate"
                .into(),
        },
        Refused::Ended(ended) => ended,
    }
    };
    let unit = unit_of(elements);
    let inverse = 1.0 / unit;
    let change = |_: usize, matrix: &mut [f64]| matrix.iter_mut().for_each(|a| *a *= inverse);
    let scaled = Changed { elements, change };
    let (kind, reduced, schur) = match (choice.solver, choice.precision) {
        (Solver::Faer, _) => {
            let factor = Cholesky::new(&scaled, roles, analysis)?;
            let (solved, schur) = (
                factor.forward(&over(&b, unit)),
                factor.schur_complement().clone(),
            );
            (
                FactorKind::Faer(Box::new(factor)),
                Kind::Faer(solved),
                schur,
            )
        }
        (_, Precision::F32Refined) => {
            let (factor, forward, schur) =
                Multifrontal::new(&scaled, analysis, b, unit).map_err(refuse)?;
            let kind = FactorKind::F32(Box::new(factor));
            (kind, Kind::Multifrontal(forward), schur)
        }
        (_, Precision::F64 | Precision::Auto) => {
            let (factor, forward, schur) =
                Multifrontal::new(&scaled, analysis, b, unit).map_err(refuse)?;
            let kind = FactorKind::F64(Box::new(factor));
            (kind, Kind::Multifrontal(forward), schur)
        }
    };
    let reduced = Reduced::new(reduced, unit);
    Ok(Some((
        Factor { kind, bytes, unit },
        reduced,
        schur.times_unit(unit),
        choice,
    )))
}

/// Entries of a factor that takes 0.5 GB in f64. From there on half of that counts for more than the time of a further step of
/// refinement, a twentieth of a solve.
const LARGE: usize = 1 << 26;

fn precision_for(entries: usize, fits_in_f64: bool) -> Precision {
    if entries >= LARGE || !fits_in_f64 {
        Precision::F32Refined
    } else {
        Precision::F64
    }
}

/// Our own factorisation is faster than faer's at every size that was measured, and takes less
/// memory. What decides for iterations instead, or for f32, is time, and whether the factor fits.
fn choose(
    analysis: &Analysis,
    elements: &impl Elements,
    settings: Settings,
    instead: Option<Choice>,
) -> Result<Option<Choice>> {
    let bytes = |solver: Solver, precision: Precision| match (solver, precision) {
        // faer stores whole supernodes, and the matrix with its entries before they are summed.
        (Solver::Faer, _) => {
            let entries = elements.count() * elements.size() * (elements.size() + 1) / 2;
            analysis.bytes(8) * 5 / 4 + entries * 28
        }
        (_, Precision::F32Refined) => analysis.bytes(4),
        (_, Precision::F64 | Precision::Auto) => analysis.bytes(8),
    };
    let there = memory::available();
    let fits = |bytes: usize| there.is_none_or(|there| (bytes as u64) < there);
    let solver = match (settings.solver, settings.precision) {
        (Solver::Auto, _) => Solver::Multifrontal,
        (Solver::Faer, Precision::F32Refined) => {
            return Err(Error::usage(
                "faer's factorisation is in f64",
                "use --linear multifrontal with --precision f32-refined",
            ));
        }
        (named, _) => named,
    };
    let precision = match (solver, settings.precision) {
        (Solver::Multifrontal, Precision::Auto) => {
            precision_for(analysis.entries(), fits(bytes(solver, Precision::F64)))
        }
        (_, Precision::Auto) => Precision::F64,
        (_, named) => named,
    };
    let needed = bytes(solver, precision);
    let choice = Choice {
        solver,
        precision,
        entries: analysis.entries(),
        flops: analysis.flops(),
        predicted_mb: needed as f64 / 1e6,
        predicted_seconds: analysis.seconds(),
    };
    if let Some(other) = instead.filter(|other| fits((other.predicted_mb * 1e6) as usize)) {
        let faster = other.predicted_seconds < choice.predicted_seconds;
        tracing::info!(
            factor_seconds = choice.predicted_seconds,
            iterations_seconds = other.predicted_seconds,
            factor_mb = choice.predicted_mb,
            iterations_mb = other.predicted_mb,
            faster,
            "iterations instead?"
        );
        if faster || !fits(needed) {
            return Ok(None);
        }
    }
    if fits(needed) {
        return Ok(Some(choice));
    }
    Err(Error::Solver {
        what: format!(
            "the factor needs about {:.0} MB, and {:.0} MB of memory are available",
            choice.predicted_mb,
            there.unwrap_or(0) as f64 / 1e6
        ),
        remedy: "take a coarser mesh, --precision f32-refined, --linear iterative, or a machine with more memory; or allow more with --memory".into(),
    })
}

impl Factor {
    /// A pass over the factor: what it reads at least.
    fn pass(&self) -> tracing::span::EnteredSpan {
        let (bytes, flops) = (self.bytes, self.bytes / 4);
        tracing::debug_span!("substitution", bytes, flops).entered()
    }

    /// Condenses a further right-hand side.
    pub fn reduce(&self, b: &[f64]) -> Reduced {
        let _span = self.pass();
        let unit = self.unit;
        let kind = match &self.kind {
            FactorKind::Faer(factor) => Kind::Faer(factor.forward(&over(b, unit))),
            FactorKind::F64(factor) => Kind::Multifrontal(factor.forward(b, unit)),
            FactorKind::F32(factor) => Kind::Multifrontal(factor.forward(b, unit)),
        };
        Reduced::new(kind, self.unit)
    }

    /// Writes all unknowns into `x`, where the kept ones are `kept`; fixed ones stay as they are.
    pub fn expand(&self, reduced: Reduced, kept: &[f64], x: &mut [f64]) {
        let _span = self.pass();
        match (&self.kind, reduced.kind) {
            (FactorKind::Faer(factor), Kind::Faer(solved)) => factor.backward(solved, kept, x),
            (FactorKind::F64(factor), Kind::Multifrontal(y)) => factor.backward(y, kept, x),
            (FactorKind::F32(factor), Kind::Multifrontal(y)) => factor.backward(y, kept, x),
            // A right-hand side that another factor reduced is invalid here.
            _ => x.fill(f64::NAN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_factors_and_those_without_room_are_stored_in_f32() {
        for (entries, fits, expected) in [
            (LARGE - 1, true, Precision::F64),
            (LARGE, true, Precision::F32Refined),
            (1, false, Precision::F32Refined),
        ] {
            assert_eq!(precision_for(entries, fits), expected);
        }
    }
}
