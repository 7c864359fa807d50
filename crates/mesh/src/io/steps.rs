//! The fields of a mesh by their names, with their values at each time, as formats have them that hold times.

use super::loss::Losses;
use crate::mesh::{Field, Support, Values};

/// Fields and the times of all of them.
pub struct Steps<'a> {
    /// Ascending; none if no field has a time.
    pub times: Vec<f64>,
    pub fields: Vec<Stepped<'a>>,
}

/// A field at some times.
pub struct Stepped<'a> {
    pub name: &'a str,
    pub on: Support,
    pub components: usize,
    /// At each of the times; a single one if the field has none.
    steps: Vec<Option<&'a Field>>,
}

impl<'a> Steps<'a> {
    /// A field that lacks a time is reported, and is NaN there.
    pub fn of(fields: &'a [Field], losses: &mut Losses) -> Self {
        let mut times: Vec<f64> = fields.iter().filter_map(|field| field.time).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut all: Vec<Stepped<'a>> = Vec::new();
        for field in fields {
            let same = |known: &&mut Stepped<'_>| {
                (known.name, known.on, known.components)
                    == (&field.name, field.on, field.components)
            };
            let place = field
                .time
                .map(|time| times.partition_point(|known| *known < time));
            if let Some(known) = all.iter_mut().find(same)
                && let Some(place) =
                    place.filter(|&place| known.steps.get(place).is_some_and(Option::is_none))
            {
                known.steps[place] = Some(field);
                continue;
            }
            let mut steps = vec![None; if place.is_some() { times.len() } else { 1 }];
            steps[place.unwrap_or(0)] = Some(field);
            all.push(Stepped {
                name: &field.name,
                on: field.on,
                components: field.components,
                steps,
            });
        }
        for field in &all {
            let missing = field.steps.iter().filter(|step| step.is_none()).count();
            if missing > 0 {
                losses.note(format!(
                    "the field {:?} is NaN at {missing} of {} times, where it is not given",
                    field.name,
                    times.len()
                ));
            }
            let partial = field.steps.iter().flatten().any(|step| !step.at.is_empty());
            if partial && field.on == Support::Points {
                losses.note_gaps(field.name, field.on);
            }
        }
        Steps { times, fields: all }
    }
}

impl<'a> Stepped<'a> {
    /// The field at its first time.
    pub fn first(&self) -> &'a Field {
        self.steps
            .iter()
            .flatten()
            .next()
            .expect("invariant: each has one field at least")
    }

    /// Whether the field has no time.
    pub fn at_all_times(&self) -> bool {
        self.steps.len() == 1
    }

    /// The field at a time.
    pub fn at_step(&self, step: usize) -> Option<&'a Field> {
        match &self.steps[..] {
            [one] => *one,
            steps => steps.get(step).copied().flatten(),
        }
    }

    /// The points or cells that have values, unless all have.
    pub fn at(&self) -> Option<&'a [u32]> {
        let at = &self.first().at;
        (!at.is_empty()).then_some(at)
    }

    /// A value of a point or cell; NaN if there is none.
    pub fn value(&self, step: usize, item: usize, component: usize) -> f64 {
        let Some(field) = self.at_step(step) else {
            return f64::NAN;
        };
        let row = match field.at.is_empty() {
            true => Some(item),
            false => row_of(&field.at, item),
        };
        row.map_or(f64::NAN, |row| {
            number(&field.values, row * self.components + component)
        })
    }
}

/// The row of a point or cell among those that have values.
pub fn row_of(at: &[u32], item: usize) -> Option<usize> {
    at.binary_search(&u32::try_from(item).ok()?).ok()
}

/// One value as binary64.
#[allow(clippy::unnecessary_cast, reason = "of ten types one is f64")]
pub fn number(values: &Values, k: usize) -> f64 {
    #[allow(clippy::unnecessary_cast)] // of the one type that is it already
    let value = crate::field::data::with_numbers!(values, numbers => numbers.get(k).map_or(f64::NAN, |&value| value as f64));
    value
}
