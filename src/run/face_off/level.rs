//! The levels of a face-off: the refinements of its mesh, the values of a parameter that is a list, or both together.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Serialize, Serializer};

/// What one run of all codes is asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Level {
    /// As reports call it.
    pub label: Label,
    /// The refinement of the mesh.
    pub n: Option<usize>,
    /// The value of the parameter that is a list.
    pub value: Option<(String, String)>,
    /// What goes to zero, where that is not the mesh size: the value of that parameter, or one over it where it is a number
    /// of steps.
    pub step: Option<f64>,
}

/// What a level is called.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Label {
    /// Nothing, where there is one alone.
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
    /// For the middle of a sentence: `, n = 16`, or nothing.
    pub fn at(&self) -> String {
        match self {
            Label::Only => String::new(),
            of => format!(", {of}"),
        }
    }
}

/// A parameter with several values, from the coarsest to the finest.
#[derive(Debug, Clone)]
pub(super) struct List {
    pub name: String,
    /// As commands get them.
    pub values: Vec<String>,
    /// A falling list is of step sizes, a rising one of numbers of steps.
    pub steps: Vec<f64>,
}

impl List {
    /// # Errors
    /// In words: what the list is, and what it should be.
    pub fn new(
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
        Ok(List {
            name: name.to_owned(),
            values,
            steps,
        })
    }
}

impl Level {
    /// The levels of refinements and of a list, which run together where there are several of both.
    ///
    /// # Errors
    /// In words: as many refinements as values are needed.
    pub(super) fn all(n: &[usize], list: Option<&List>) -> Result<Vec<Level>, String> {
        let of_n = |n: usize| Level {
            label: Label::Mesh(n),
            n: Some(n),
            ..Level::default()
        };
        let Some(list) = list else {
            return Ok(match n {
                [] => vec![Level::default()],
                n => n.iter().copied().map(of_n).collect(),
            });
        };
        if n.len() > 1 && n.len() != list.values.len() {
            return Err(format!(
                "n has {} values and {} has {}",
                n.len(),
                list.name,
                list.values.len()
            ));
        }
        let values = list.values.iter().zip(&list.steps).enumerate();
        let level = |(k, (value, step)): (usize, (&String, &f64))| {
            let named = format!("{} = {value}", list.name);
            let several = n.len() > 1;
            Level {
                label: Label::Named(match several {
                    true => format!("n = {}, {named}", n[k]),
                    false => named,
                }),
                n: if several {
                    Some(n[k])
                } else {
                    n.first().copied()
                },
                value: Some((list.name.clone(), value.clone())),
                step: (!several).then_some(*step),
            }
        };
        Ok(values.map(level).collect())
    }

    /// These parameters with this level's value.
    pub fn parameters(&self, of_all: &BTreeMap<String, String>) -> BTreeMap<String, String> {
        let mut parameters = of_all.clone();
        parameters.extend(self.value.clone());
        parameters
    }

    /// Where it is on each axis: `n = 4, dt = 0.05`; nothing where there is one level alone.
    pub fn words(&self) -> String {
        let n = self.n.map(|n| format!("n = {n}"));
        let value = self
            .value
            .as_ref()
            .map(|(name, value)| format!("{name} = {value}"));
        n.into_iter().chain(value).collect::<Vec<_>>().join(", ")
    }

    /// The end of the names of its folders: `-n16`, `-dt0.05`.
    pub fn suffix(&self) -> String {
        let n = self.n.map_or(String::new(), |n| format!("-n{n}"));
        let value = self.value.as_ref();
        n + &value.map_or(String::new(), |(name, value)| format!("-{name}{value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_run_together_or_alone() {
        let list = |values: &[&str], is_whole| {
            List::new(
                "dt",
                values.iter().map(|v| (*v).to_owned()).collect(),
                is_whole,
            )
        };
        let dt = list(&["0.1", "0.05"], false).unwrap();
        let labels = |n: &[usize], list| {
            let levels = Level::all(n, list).unwrap();
            let of = |level: &Level| format!("{}|{}|{:?}", level.label, level.suffix(), level.step);
            levels.iter().map(of).collect::<Vec<_>>()
        };
        assert_eq!(labels(&[], None), ["||None"]);
        assert_eq!(labels(&[4, 8], None), ["n = 4|-n4|None", "n = 8|-n8|None"]);
        assert_eq!(
            labels(&[4], Some(&dt)),
            [
                "dt = 0.1|-n4-dt0.1|Some(0.1)",
                "dt = 0.05|-n4-dt0.05|Some(0.05)"
            ]
        );
        assert_eq!(
            labels(&[4, 8], Some(&dt))[1],
            "n = 8, dt = 0.05|-n8-dt0.05|None"
        );
        assert!(Level::all(&[4, 8, 16], Some(&dt)).is_err());
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
