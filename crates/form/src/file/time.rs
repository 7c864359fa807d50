//! Time steps: their number, and the initial values of the unknowns.

use std::collections::BTreeSet;

use faceoff_mesh::error::Result;

use super::{Entry, File};
use crate::problem::{Initial, Parameter, Problem, Time};
use crate::scalar::{Field, Node};

/// More steps are a typing error.
const MOST_STEPS: f64 = 1e6;

impl<'a> File<'a> {
    /// The steps; the time at the end of a step and its length join the parameters as `t` and `dt`.
    pub(super) fn time(
        &self,
        entry: &Entry<'a>,
        parameters: &mut Vec<Parameter>,
        taken: &mut BTreeSet<String>,
    ) -> Result<Time> {
        let at = entry.place.start;
        let keys = self.entries(entry.value, "time")?;
        self.known(&keys, &["step", "end"])?;
        let number = |key: &str| {
            let Some(given) = keys.iter().find(|entry| entry.key == key) else {
                let what = format!("[time] has no {key}");
                return Err(self.refuse(at, what, "give both: step = 0.1 and end = 1.0"));
            };
            let value = self.number(given.value).filter(|value| *value > 0.0);
            value.ok_or_else(|| {
                let what = format!("{key} is not a positive number");
                self.refuse(given.value.span().start, what, "give one number")
            })
        };
        let [step, end] = [number("step")?, number("end")?];
        let steps = (end / step).round();
        if (end - steps * step).abs() > 1e-9 * end || steps > MOST_STEPS {
            let what = format!("{step} goes into {end} {} times", end / step);
            let remedy = format!("give a step of which end is a multiple, at most {MOST_STEPS}");
            return Err(self.refuse(at, what, remedy));
        }
        for (name, value) in [("t", end), ("dt", step)] {
            if !taken.insert(name.to_owned()) {
                let what = format!("there are two things called `{name}`");
                let remedy = "with [time], t is the time at the end of a step and dt its length: give the other another name";
                return Err(self.refuse(at, what, remedy));
            }
            parameters.push(Parameter {
                name: name.to_owned(),
                value,
            });
        }
        Ok(Time {
            steps: steps as usize,
            parameter: parameters.len() - 2,
            initial: Vec::new(),
        })
    }

    /// The values of the unknowns at time 0.
    pub(super) fn initial(&self, entry: &Entry<'a>, problem: &mut Problem) -> Result<()> {
        let Some(time) = &problem.time else {
            let what = "initial values, and no steps in time";
            let remedy = "add [time] with step and end, or leave them out";
            return Err(self.refuse(entry.place.start, what, remedy));
        };
        let parameter = time.parameter;
        let mut initial = Vec::new();
        for each in self.entries(entry.value, "initial")? {
            let unknown = self.unknown(&each, problem)?;
            if problem.unknowns[unknown].space.element.is_vector() {
                let space = problem.unknowns[unknown].space.name();
                let what = format!("not all codes interpolate in {space} alike");
                return Err(self.refuse(each.place.start, what, "start from 0: leave it out"));
            }
            let parts = self.components(&each, unknown, problem)?;
            for (component, part) in parts.into_iter().enumerate() {
                let Some(value) = self.value(part, problem)? else {
                    let what = "an initial value is given or 0";
                    return Err(self.refuse(part.span().start, what, "write 0 for \"free\""));
                };
                let zero = problem.scalars.number(0.0);
                let value = problem.scalars.map(value, &mut |_, node| {
                    (node == Node::Parameter(parameter)).then_some(zero)
                });
                initial.push(Initial {
                    unknown,
                    component,
                    value,
                });
            }
        }
        if let Some(time) = &mut problem.time {
            time.initial = initial;
        }
        Ok(())
    }

    /// Is there an initial value for each unknown whose previous value is used?
    pub(super) fn check_start(&self, problem: &Problem, at: usize) -> Result<()> {
        let Some(time) = &problem.time else {
            return Ok(());
        };
        let all = problem.integrals.iter().flat_map(|i| i.terms.values());
        for leaf in problem.scalars.leaves(all.copied()) {
            let Field::Old(k) = leaf.field else { continue };
            let unknown = &problem.unknowns[k];
            let is_given = time.initial.iter().any(|initial| initial.unknown == k);
            if !is_given && !unknown.space.element.is_vector() {
                let name = &unknown.name;
                let what = format!("F has old({name}), and nothing says what {name} is at time 0");
                let remedy = format!("add [initial] with {name} = \"…\"");
                return Err(self.refuse(at, what, remedy));
            }
        }
        Ok(())
    }
}
