//! Two engines in one case: their fields, and where they differ.

use crate::campaigns::verify::CaseOutcome;
use crate::why::Diagnosis;
use faceoff_judge::{FieldVerdict, Verdict, relative_differences};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// Two engines with all their fields.
pub(in crate::report) struct Pair<'a> {
    pub a: &'a str,
    pub b: &'a str,
    pub fields: Vec<&'a FieldVerdict>,
}

pub(in crate::report) fn pairs(case: &CaseOutcome) -> Vec<Pair<'_>> {
    let mut pairs: Vec<Pair> = Vec::new();
    for outcome in &case.pairs {
        let (a, b) = (outcome.a.as_str(), outcome.b.as_str());
        match pairs.iter_mut().find(|p| (p.a, p.b) == (a, b)) {
            Some(pair) => pair.fields.push(&outcome.field),
            None => {
                let fields = vec![&outcome.field];
                pairs.push(Pair { a, b, fields });
            }
        }
    }
    pairs
}

impl<'a> Pair<'a> {
    pub fn name(&self) -> String {
        format!("{} – {}", self.a, self.b)
    }

    /// The selection for these two.
    pub fn difference(&self) -> String {
        format!("{} − {}", self.a, self.b)
    }

    pub fn has(&self, engine: &str) -> bool {
        self.a == engine || self.b == engine
    }

    /// The fields that both have.
    pub fn of<'c>(&self, case: &'c CaseOutcome) -> Option<[&'c FaceFields; 2]> {
        let find = |name: &str| case.fields.iter().find(|f| f.source == name);
        Some([find(self.a)?, find(self.b)?])
    }

    /// Those of `all` that belong to these two in this case.
    pub fn diagnoses<'d>(
        &self,
        case: &CaseOutcome,
        all: &'d [Diagnosis],
    ) -> impl Iterator<Item = &'d Diagnosis> {
        let of = (&*case.scene, &*case.method, case.n);
        all.iter().filter(move |d| d.is_of(of, (self.a, self.b)))
    }

    /// The largest difference of any field, relative to max|u|; NaN if one is NaN.
    pub fn largest(&self) -> f64 {
        largest(self.fields.iter().copied())
    }

    /// The field to show: the means if they differ, which every face has; else the one with the largest difference relative to its
    /// tolerance.
    pub fn worst(&self) -> Option<&'a FieldVerdict> {
        let means = self.fields.iter().find(|f| f.field == "mean");
        let values = self.fields.iter().filter(|f| f.field != "status");
        let farthest = values.max_by(|f, g| factor(f).total_cmp(&factor(g)));
        match (means, farthest) {
            (Some(means), _) if !means.verdict.passes() => Some(means),
            (Some(means), Some(farthest)) if farthest.verdict.passes() => Some(means),
            (_, farthest) => farthest.copied(),
        }
    }

    /// |a-b| of a field on its faces, relative to max|u|.
    ///
    /// # Errors
    /// Faces that cannot be matched.
    pub fn differences(&self, case: &CaseOutcome, field: &str) -> Result<Vec<(u32, f64)>> {
        match self.of(case) {
            Some([a, b]) => relative_differences(a, b, field),
            None => Ok(Vec::new()),
        }
    }
}

/// The ratio of a field's difference to its tolerance.
pub(in crate::report) fn factor(field: &FieldVerdict) -> f64 {
    let factor = field.max_rel / field.tolerance;
    match field.verdict {
        Verdict::Agree => factor,
        _ if factor.is_nan() => f64::INFINITY,
        _ => factor,
    }
}

pub(in crate::report) fn largest<'a>(fields: impl Iterator<Item = &'a FieldVerdict>) -> f64 {
    let of = fields.filter(|f| f.field != "status").map(|f| f.max_rel);
    of.fold(0.0, |most: f64, d| {
        if d.is_nan() {
            f64::INFINITY
        } else {
            most.max(d)
        }
    })
}
