//! Two engines in one case: their fields, and where they differ.

use super::map::Shown;
use crate::campaigns::verify::CaseOutcome;
use faceoff_judge::{FieldVerdict, Verdict, relative_differences};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

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
            None => pairs.push(Pair {
                a,
                b,
                fields: vec![&outcome.field],
            }),
        }
    }
    pairs
}

impl<'a> Pair<'a> {
    pub fn name(&self) -> String {
        format!("{} – {}", self.a, self.b)
    }

    pub fn verdict(&self) -> Verdict {
        let all = self.fields.iter().map(|f| f.verdict);
        all.max().unwrap_or(Verdict::Undetermined)
    }

    /// The field that is shown: the means where they differ, which every face has; else what lies farthest beyond its
    /// tolerance.
    pub fn worst(&self) -> Option<&'a FieldVerdict> {
        let means = self.fields.iter().find(|f| f.field == "mean");
        let farthest = self
            .fields
            .iter()
            .filter(|f| f.field != "status")
            .max_by(|f, g| {
                let factor = |f: &FieldVerdict| match (f.verdict, f.max_rel / f.tolerance) {
                    (Verdict::Agree, factor) => factor,
                    (_, factor) if factor.is_nan() => f64::INFINITY,
                    (_, factor) => factor,
                };
                factor(f).total_cmp(&factor(g))
            });
        match (means, farthest) {
            (Some(means), _) if means.verdict != Verdict::Agree => Some(means),
            (Some(means), Some(farthest)) if farthest.verdict == Verdict::Agree => Some(means),
            (_, farthest) => farthest.copied(),
        }
    }
}

/// What a map shows, without the mesh.
pub(super) struct Differences {
    differences: Vec<(u32, f64)>,
    tolerance: f64,
    pub disagrees: bool,
    worst: Option<u32>,
}

impl Differences {
    pub fn on<'a>(&'a self, mesh: &'a Triangulation) -> Shown<'a> {
        Shown {
            mesh,
            differences: &self.differences,
            tolerance: self.tolerance,
            disagrees: self.disagrees,
            worst: self.worst,
        }
    }
}

/// What the map of a pair shows: in 3D only Γ_C.
pub(super) fn differences(case: &CaseOutcome, pair: &Pair) -> Result<Option<Differences>> {
    let mesh = &*case.setup.mesh;
    let find = |name: &str| case.fields.iter().find(|f| f.source == name);
    let (Some(a), Some(b), Some(field)) = (find(pair.a), find(pair.b), pair.worst()) else {
        return Ok(None);
    };
    let mut differences = relative_differences(a, b, &field.field)?;
    if mesh.dim == 3 {
        let contact = a.column("flux").map_or(&[][..], |c| &c.faces);
        differences.retain(|(face, _)| contact.binary_search(face).is_ok());
    }
    let worst = field
        .worst
        .as_ref()
        .and_then(|w| mesh.find_face(&w.vertices));
    let worst = worst.map(|face| face as u32);
    let worst = worst.filter(|face| differences.iter().any(|(f, _)| f == face));
    Ok(Some(Differences {
        differences,
        tolerance: field.tolerance,
        disagrees: field.verdict != Verdict::Agree,
        worst,
    }))
}
