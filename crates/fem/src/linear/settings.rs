//! How linear systems are to be solved.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// The solver of linear systems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Solver {
    /// Whatever is predicted to be fastest in the memory that there is.
    #[default]
    Auto,
    /// faer's sparse Cholesky factorisation.
    Faer,
    /// Our own, which sums no matrix and uses all cores.
    Multifrontal,
    /// Krylov's methods with P1 as preconditioner: memory as the mesh takes.
    Iterative,
}

/// The numbers that a factor is stored in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// binary64, or f32 where the factor is large: half of its memory for a twentieth more time, that of a further step of refinement.
    #[default]
    Auto,
    /// binary64.
    F64,
    /// Half the memory; steps of refinement in f64 bring the digits back.
    F32Refined,
}

/// Solver and precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// The solver; [`Solver::Auto`] chooses one.
    pub solver: Solver,
    /// The precision of the factor; [`Precision::Auto`] chooses one, and faer's is always binary64.
    pub precision: Precision,
}

const SOLVERS: [(&str, Solver); 4] = [
    ("auto", Solver::Auto),
    ("faer", Solver::Faer),
    ("multifrontal", Solver::Multifrontal),
    ("iterative", Solver::Iterative),
];

const PRECISIONS: [(&str, Precision); 3] = [
    ("auto", Precision::Auto),
    ("f64", Precision::F64),
    ("f32-refined", Precision::F32Refined),
];

impl FromStr for Solver {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        find(text, &SOLVERS, "linear solver")
    }
}

impl FromStr for Precision {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        find(text, &PRECISIONS, "precision")
    }
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(name(*self, &SOLVERS))
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(name(*self, &PRECISIONS))
    }
}

fn find<T: Copy>(text: &str, table: &[(&str, T)], what: &str) -> Result<T, String> {
    table
        .iter()
        .find(|(name, _)| *name == text)
        .map(|(_, value)| *value)
        .ok_or_else(|| {
            let names: Vec<_> = table.iter().map(|(name, _)| *name).collect();
            format!("there is no {what} `{text}`: use {}", names.join(", "))
        })
}

fn name<T: PartialEq>(value: T, table: &'static [(&'static str, T)]) -> &'static str {
    let row = table.iter().find(|(_, other)| *other == value);
    row.map_or("", |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for (name, solver) in SOLVERS {
            assert_eq!(
                (name.parse(), solver.to_string()),
                (Ok(solver), name.to_owned())
            );
        }
        for (name, precision) in PRECISIONS {
            assert_eq!(
                (name.parse(), precision.to_string()),
                (Ok(precision), name.to_owned())
            );
        }
        assert!("ilu".parse::<Solver>().unwrap_err().contains("iterative"));
        assert!(
            "f16"
                .parse::<Precision>()
                .unwrap_err()
                .contains("f32-refined")
        );
    }
}
