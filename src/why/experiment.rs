//! The settings that are changed one at a time when codes run again: one list for scenes and for any problem.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Serialize, Serializer};

use faceoff_fem::linear::Solver;

/// Parameters are changed by this many units in the last place, which is more than the loss in writing a number.
const ULPS: u64 = 4;

/// One change, with all other settings fixed.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// No change: the same run again.
    Again,
    /// Reverses the order of the cells.
    Cells,
    /// Reverses the order of the vertices.
    Vertices,
    /// Changes the number of threads.
    Threads,
    /// Changes the last digits of the parameters.
    Rounding,
    /// Changes the stopping tolerance.
    Tolerances,
    /// Multiplies a parameter by a percentage.
    Parameter(String, u8),
    /// Replaces the load by a constant.
    Load,
    /// Changes the initial guess.
    Start,
    /// Changes the solver of the linear systems.
    Solver(Solver),
}

impl Serialize for Change {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.words())
    }
}

impl Change {
    /// The possible changes of a run with these real parameters: first those that must not move an answer, then each parameter by ten per
    /// cent up and down.
    pub fn of_run(reals: &BTreeSet<&str>) -> Vec<Change> {
        let mut all = vec![
            Change::Again,
            Change::Cells,
            Change::Vertices,
            Change::Threads,
            Change::Rounding,
            Change::Tolerances,
        ];
        let free = reals.iter().filter(|name| !is_tolerance(name));
        all.extend(free.flat_map(|name| {
            [110, 90].map(|percent| Change::Parameter((*name).to_owned(), percent))
        }));
        all
    }

    /// The changes that show whether a numerical parameter limits the accuracy: half and twice its value, and a hundredth of a
    /// tolerance.
    pub fn of_limit(name: &str) -> Vec<Change> {
        let is_tolerance = is_tolerance(name) || name.to_lowercase().contains("eps");
        let percents: &[u8] = if is_tolerance { &[1] } else { &[50, 200] };
        let each = percents.iter();
        each.map(|percent| Change::Parameter(name.to_owned(), *percent))
            .collect()
    }

    /// What is changed: `the order of the mesh`.
    pub fn of(&self) -> String {
        match self {
            Change::Again => "nothing".into(),
            Change::Cells | Change::Vertices => "the order of the mesh".into(),
            Change::Threads => "the number of threads".into(),
            Change::Rounding => "rounding".into(),
            Change::Tolerances => "the tolerance".into(),
            Change::Parameter(name, _) => format!("`{name}`"),
            Change::Load => "the quadrature of the load".into(),
            Change::Start => "the start".into(),
            Change::Solver(_) => "the linear solver".into(),
        }
    }

    /// How it is changed: `cells in reverse order`.
    pub fn words(&self) -> String {
        match self {
            Change::Again => "run once more".into(),
            Change::Cells => "cells in reverse order".into(),
            Change::Vertices => "vertices in reverse order".into(),
            Change::Threads => "in one thread".into(),
            Change::Rounding => format!("parameters changed by {ULPS} units in the last place"),
            Change::Tolerances => "tolerances divided by 100".into(),
            Change::Parameter(name, percent) => {
                format!("{name} times {}", f64::from(*percent) / 100.0)
            }
            Change::Load => "a constant load".into(),
            Change::Start => "another start".into(),
            Change::Solver(solver) => solver.to_string(),
        }
    }

    /// The suffix of the folder's name.
    pub fn suffix(&self) -> String {
        match self {
            Change::Again => "-again".into(),
            Change::Cells => "-cells".into(),
            Change::Vertices => "-vertices".into(),
            Change::Threads => "-threads".into(),
            Change::Rounding => "-rounding".into(),
            Change::Tolerances => "-tolerances".into(),
            Change::Parameter(name, percent) => format!("-{name}-{percent}-percent"),
            Change::Load => "-load".into(),
            Change::Start => "-start".into(),
            Change::Solver(solver) => format!("-{solver}"),
        }
    }

    /// Changes the parameters of a run, and returns whether any changed. An integer, which may be a count, is changed only if it is named and if it stays
    /// an integer.
    pub fn parameters(&self, reals: &BTreeSet<String>, of: &mut BTreeMap<String, String>) -> bool {
        let mut is_changed = false;
        for (name, value) in of {
            let changed = match value.parse::<i64>() {
                Ok(whole) if !reals.contains(name) => self.of_integer(name, whole),
                _ => value.parse().ok().and_then(|x| self.of_real(name, x)),
            };
            if let Some(changed) = changed {
                *value = changed;
                is_changed = true;
            }
        }
        is_changed
    }

    fn of_real(&self, name: &str, x: f64) -> Option<String> {
        let changed = match self {
            Change::Rounding => Some(f64::from_bits(x.to_bits() + ULPS)),
            Change::Tolerances => is_tolerance(name).then_some(x / 100.0),
            Change::Parameter(of, percent) => {
                (name == of).then_some(x * f64::from(*percent) / 100.0)
            }
            _ => None,
        };
        changed
            .filter(|_| x.is_normal())
            .map(|changed| format!("{changed:?}"))
    }

    fn of_integer(&self, name: &str, whole: i64) -> Option<String> {
        let Change::Parameter(of, percent) = self else {
            return None;
        };
        let changed = whole.checked_mul(i64::from(*percent))? / 100;
        (name == of && whole > 0 && changed > 0).then(|| changed.to_string())
    }
}

fn is_tolerance(name: &str) -> bool {
    name.to_lowercase().contains("tol")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_parameters_are_changed_and_no_others() {
        let given = [("E", "200"), ("nu", "0.25"), ("k", "3"), ("rtol", "1e-6")];
        let given = given.map(|(name, value)| (name.to_owned(), value.to_owned()));
        let parameters = BTreeMap::from(given);
        let reals = ["E", "rtol"].map(str::to_owned).into();
        let all = Change::of_run(&BTreeSet::from(["E", "rtol"]));
        let of: Vec<String> = all[6..].iter().map(Change::words).collect();
        assert_eq!(of, ["E times 1.1", "E times 0.9"]);
        let mut changed = parameters.clone();
        assert!(all[7].parameters(&reals, &mut changed));
        assert_eq!(changed.remove("E").as_deref(), Some("180.0"));
        assert!(Change::Tolerances.parameters(&reals, &mut changed));
        assert_eq!(changed.remove("rtol").unwrap().parse(), Ok(1e-8));
        assert!(!Change::Tolerances.parameters(&reals, &mut changed));
        assert!(!Change::Cells.parameters(&reals, &mut changed));
        let [half, twice] = Change::of_limit("k").try_into().unwrap();
        let none = ["rtol".to_owned()].into();
        let mut whole = parameters.clone();
        assert!(half.parameters(&none, &mut whole) && whole["k"] == "1");
        assert!(twice.parameters(&none, &mut whole) && whole["k"] == "2");
        assert!(half.parameters(&none, &mut whole) && !half.parameters(&none, &mut whole));
        assert!(
            changed
                .iter()
                .all(|(name, value)| parameters[name] == *value)
        );
    }
}
