//! The levels of a face-off file: points on axes, which are the refinements of its mesh and a parameter that is a list, or both together.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Serialize, Serializer};

/// The settings of one run of all codes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Level {
    /// The name in reports.
    pub label: Label,
    /// The refinement of the mesh, which is also an axis.
    pub n: Option<usize>,
    /// Its value on each axis.
    at: Vec<(String, String)>,
    /// The name and value of what goes to zero, if that is not the mesh size: a parameter, or `1/n`.
    pub step: Option<(String, f64)>,
}

/// The label of a level.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Label {
    /// Empty, if there is only one.
    #[default]
    Only,
    /// `n = 16`: by its refinement.
    Mesh(usize),
    /// `dt = 0.05`: by a parameter, and by the refinement where that changes as well.
    Named(String),
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Label::Only => Ok(()),
            Label::Mesh(n) => write!(f, "n = {n}"),
            Label::Named(name) => f.write_str(name),
        }
    }
}

impl Serialize for Label {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Label {
    /// For the middle of a sentence: `, n = 16`, or empty.
    pub fn at(&self) -> String {
        match self {
            Label::Only => String::new(),
            of => format!(", {of}"),
        }
    }
}

/// A quantity that changes from level to level, or that all levels share: the refinement, or a parameter that is a list.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub name: String,
    /// The values as text for commands, from the coarsest to the finest.
    pub values: Vec<String>,
    /// The corresponding values that go to zero: step sizes, or the reciprocals of numbers of steps and of refinements.
    steps: Vec<f64>,
}

/// The name of the axis of refinements, and of its placeholder.
pub(super) const N: &str = "n";

impl Axis {
    /// The refinements of the mesh; `None` if it has none.
    pub fn refinements(n: &[usize]) -> Option<Self> {
        (!n.is_empty()).then(|| Axis {
            name: N.to_owned(),
            values: n.iter().map(usize::to_string).collect(),
            steps: n.iter().map(|n| 1.0 / *n as f64).collect(),
        })
    }

    /// A value that all levels share.
    pub fn fixed(name: &str, value: &str) -> Self {
        Axis {
            name: name.to_owned(),
            values: vec![value.to_owned()],
            steps: Vec::new(),
        }
    }

    pub fn is_refinement(&self) -> bool {
        self.name == N
    }

    /// A parameter that is a list.
    ///
    /// # Errors
    /// A message that says what the list is, and what it should be.
    pub fn of_list(
        name: &str,
        values: Vec<String>,
        is_whole: bool,
    ) -> Result<Self, (String, &'static str)> {
        let remedy =
            "list step sizes that fall, as [0.1, 0.05, 0.025], or whole numbers of steps that rise";
        let numbers: Option<Vec<f64>> = values.iter().map(|v| v.parse().ok()).collect();
        let Some(numbers) = numbers.filter(|all| all.iter().all(|x| *x > 0.0)) else {
            let what = format!("[{}] has something that is not above 0", values.join(", "));
            return Err((what, remedy));
        };
        let falls = numbers.windows(2).all(|pair| pair[0] > pair[1]);
        let rises = numbers.windows(2).all(|pair| pair[0] < pair[1]);
        let steps = match numbers.len() {
            0 | 1 => {
                return Err((
                    "a list of one value has no levels".into(),
                    "give two or more, or the value itself",
                ));
            }
            _ if falls => numbers,
            _ if rises && is_whole => numbers.iter().map(|n| 1.0 / n).collect(),
            _ => {
                let what = format!(
                    "[{}] is not from the coarsest to the finest",
                    values.join(", ")
                );
                return Err((what, remedy));
            }
        };
        Ok(Axis {
            name: name.to_owned(),
            values,
            steps,
        })
    }
}

impl Level {
    /// The levels of some axes; those with several values change together.
    ///
    /// # Errors
    /// A message on two axes of different lengths.
    pub(super) fn all(axes: &[Axis]) -> Result<Vec<Level>, String> {
        let varying: Vec<&Axis> = axes.iter().filter(|axis| axis.values.len() > 1).collect();
        let count = varying.first().map_or(1, |first| first.values.len());
        if let Some(other) = varying.iter().find(|other| other.values.len() != count) {
            return Err(format!(
                "{} has {count} values and {} has {}",
                varying[0].name,
                other.name,
                other.values.len()
            ));
        }
        let named = match varying.is_empty() {
            true => axes.iter().collect(),
            false => varying.clone(),
        };
        let level = |k: usize| {
            let of = |axis: &Axis| axis.values.get(k).unwrap_or(&axis.values[0]).clone();
            let refinement = axes.iter().find(|axis| axis.is_refinement());
            let n = refinement.and_then(|axis| of(axis).parse().ok());
            let at = |axis: &Axis| (axis.name.clone(), of(axis));
            // If the mesh changes as well, its size is what goes to zero.
            let step = varying.iter().min_by_key(|axis| !axis.is_refinement());
            let step = step.map(|axis| match axis.is_refinement() {
                true => ("1/n".to_owned(), axis.steps[k]),
                false => (axis.name.clone(), axis.steps[k]),
            });
            Level {
                label: match (&named[..], n) {
                    ([], _) => Label::Only,
                    ([axis], Some(n)) if axis.is_refinement() => Label::Mesh(n),
                    (axes, _) => Label::Named(words(axes.iter().map(|axis| at(axis)))),
                },
                n,
                at: axes.iter().map(at).collect(),
                step,
            }
        };
        Ok((0..count).map(level).collect())
    }

    /// These parameters with those of this level.
    pub fn parameters(&self, of_all: &BTreeMap<String, String>) -> BTreeMap<String, String> {
        let mut parameters = of_all.clone();
        let own = self.at.iter().filter(|(name, _)| name != N);
        parameters.extend(own.cloned());
        parameters
    }

    /// Its value on each axis: `n = 4, dt = 0.05`; empty if there is only one level.
    pub fn words(&self) -> String {
        words(self.at.iter().cloned())
    }

    /// The suffix of the names of its folders: `-n16`, `-dt0.05`.
    pub fn suffix(&self) -> String {
        let at = self
            .at
            .iter()
            .map(|(name, value)| format!("-{name}{value}"));
        at.collect()
    }
}

fn words(at: impl Iterator<Item = (String, String)>) -> String {
    let each = at.map(|(name, value)| format!("{name} = {value}"));
    each.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_run_together_or_alone() {
        let list = |values: &[&str], is_whole| {
            Axis::of_list(
                "dt",
                values.iter().map(|v| (*v).to_owned()).collect(),
                is_whole,
            )
        };
        let dt = list(&["0.1", "0.05"], false).unwrap();
        let all = |n: &[usize], list: Option<&Axis>| {
            let axes: Vec<Axis> = Axis::refinements(n)
                .into_iter()
                .chain(list.cloned())
                .collect();
            Level::all(&axes)
        };
        let labels = |n: &[usize], list| {
            let levels = all(n, list).unwrap();
            let step = |level: &Level| {
                level
                    .step
                    .as_ref()
                    .map(|(name, size)| format!("{name} {size}"))
            };
            let of = |level: &Level| {
                format!(
                    "{}|{}|{}",
                    level.label,
                    level.suffix(),
                    step(level).unwrap_or_default()
                )
            };
            levels.iter().map(of).collect::<Vec<_>>()
        };
        assert_eq!(labels(&[], None), ["||"]);
        assert_eq!(
            labels(&[4, 8], None),
            ["n = 4|-n4|1/n 0.25", "n = 8|-n8|1/n 0.125"]
        );
        assert_eq!(
            labels(&[4], Some(&dt)),
            ["dt = 0.1|-n4-dt0.1|dt 0.1", "dt = 0.05|-n4-dt0.05|dt 0.05"]
        );
        assert_eq!(
            labels(&[4, 8], Some(&dt))[1],
            "n = 8, dt = 0.05|-n8-dt0.05|1/n 0.125"
        );
        assert_eq!(labels(&[4], None), ["n = 4|-n4|"]);
        assert!(all(&[4, 8, 16], Some(&dt)).is_err());
        assert_eq!(list(&["5", "10"], true).unwrap().steps, [0.2, 0.1]);
        for (bad, is_whole) in [
            (&["0.05", "0.1"][..], false),
            (&["1"], true),
            (&["1", "0"], true),
            (&["a", "b"], false),
            (&["5", "10", "7"], true),
        ] {
            assert!(list(bad, is_whole).is_err(), "{bad:?}");
        }
    }
}
