//! Two engines in one case: their fields, and where they differ.

use super::map::Shown;
use crate::campaigns::verify::CaseOutcome;
use crate::why::Diagnosis;
use faceoff_judge::{FieldVerdict, Verdict, relative_differences};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// Two engines and every field of theirs.
pub(super) struct Pair<'a> {
    pub a: &'a str,
    pub b: &'a str,
    pub fields: Vec<&'a FieldVerdict>,
}

pub(super) fn pairs(case: &CaseOutcome) -> Vec<Pair<'_>> {
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

    /// What both gave.
    pub fn of<'c>(&self, case: &'c CaseOutcome) -> Option<[&'c FaceFields; 2]> {
        let find = |name: &str| case.fields.iter().find(|f| f.source == name);
        Some([find(self.a)?, find(self.b)?])
    }

    /// Those of `all` that are about these two in this case.
    pub fn diagnoses<'d>(
        &self,
        case: &CaseOutcome,
        all: &'d [Diagnosis],
    ) -> impl Iterator<Item = &'d Diagnosis> {
        let of = (&*case.scene, &*case.method, case.n);
        all.iter().filter(move |d| d.is_of(of, (self.a, self.b)))
    }

    /// How far a field lies beyond its tolerance.
    pub fn factor(field: &FieldVerdict) -> f64 {
        let factor = field.max_rel / field.tolerance;
        match field.verdict {
            Verdict::Agree => factor,
            _ if factor.is_nan() => f64::INFINITY,
            _ => factor,
        }
    }

    pub fn verdict(&self) -> Verdict {
        let all = self.fields.iter().map(|f| f.verdict);
        all.max().unwrap_or(Verdict::Undetermined)
    }

    /// The field that is shown: the means where they differ, which every face has; else what lies farthest beyond its
    /// tolerance.
    pub fn worst(&self) -> Option<&'a FieldVerdict> {
        let means = self.fields.iter().find(|f| f.field == "mean");
        let values = self.fields.iter().filter(|f| f.field != "status");
        let farthest = values.max_by(|f, g| Pair::factor(f).total_cmp(&Pair::factor(g)));
        match (means, farthest) {
            (Some(means), _) if !means.verdict.passes() => Some(means),
            (Some(means), Some(farthest)) if farthest.verdict.passes() => Some(means),
            (_, farthest) => farthest.copied(),
        }
    }
}

/// What the map of a pair shows: in 3D only Γ_C.
pub(super) fn differences<'a>(case: &'a CaseOutcome, pair: &Pair) -> Result<Option<Shown<'a>>> {
    let mesh = &*case.setup.mesh;
    let (Some([a, b]), Some(field)) = (pair.of(case), pair.worst()) else {
        return Ok(None);
    };
    let mut differences = relative_differences(a, b, &field.field)?;
    if mesh.dim == 3 {
        let contact = a.column("flux").map_or(&[][..], |c| &c.faces);
        differences.retain(|(face, _)| contact.binary_search(face).is_ok());
    }
    let worst = field.worst.as_ref();
    let worst = worst.and_then(|w| mesh.find_face(&w.vertices));
    let worst = worst.map(|face| face as u32);
    let worst = worst.filter(|face| differences.iter().any(|(f, _)| f == face));
    Ok(Some(Shown {
        mesh,
        differences,
        tolerance: field.tolerance,
        disagrees: !field.verdict.passes(),
        worst,
    }))
}
