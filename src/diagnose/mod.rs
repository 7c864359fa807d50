//! Why two codes of one scheme differ: the case again, with one ingredient matched at a time.
//!
//! A code is a black box, but the Rust engine is not. Where one of two answers comes out of the Rust engine once it
//! uses another quadrature, or another γ, that ingredient is what the codes do not share. What is no parameter of the
//! scheme (tolerance, mesh order, f itself) is matched by running the pair again.

mod pair;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::verify::{CaseOutcome, Outcome, Request};
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;
use pair::Pair;

/// What the start was matched to where it is not to blame.
const BADLY_CONDITIONED: &str =
    "either answer: both solve the same linear system, which is badly conditioned";

/// What was found about one pair of one case.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    pub scene: String,
    pub method: String,
    pub n: Option<usize>,
    pub a: String,
    pub b: String,
    /// The largest |a-b| of any field by value, relative to max|u| and the field's sensitivity.
    pub difference: f64,
    /// Those that account for the difference first.
    pub ingredients: Vec<Ingredient>,
}

/// One ingredient, matched.
#[derive(Debug, Clone, Serialize)]
pub struct Ingredient {
    pub ingredient: String,
    /// What it was set to.
    pub matched: String,
    /// The difference that is left, in the same units.
    pub left: f64,
    /// Is nothing but rounding left?
    pub accounts: bool,
}

impl Diagnosis {
    /// Is it about these two in this case?
    pub fn is_of(&self, case: &CaseOutcome, a: &str, b: &str) -> bool {
        (&*self.scene, &*self.method, self.n) == (&*case.scene, &*case.method, case.n)
            && (&*self.a, &*self.b) == (a, b)
    }

    /// What accounts for the difference, in words.
    pub fn sentence(&self) -> String {
        let accounts = || self.ingredients.iter().filter(|i| i.accounts);
        let best = |name: &str| {
            let same = accounts().filter(|i| i.ingredient == name);
            same.min_by(|i, j| i.left.total_cmp(&j.left))
        };
        let named: Vec<String> = names(accounts())
            .into_iter()
            .filter_map(best)
            .map(|i| {
                let comma = if i.matched.contains(',') { "," } else { "" };
                format!(
                    "{} accounts for it: with {}{comma} the difference falls from {:.1e} to {:.1e}",
                    i.ingredient, i.matched, self.difference, i.left
                )
            })
            .collect();
        if !named.is_empty() {
            return format!("{}.", named.join("; "));
        }
        let nearest = self
            .ingredients
            .iter()
            .filter(|i| i.left < 0.5 * self.difference);
        let nearest = nearest.min_by(|i, j| i.left.total_cmp(&j.left));
        let nearest = nearest.map_or(String::new(), |i| {
            format!(
                " {} with {} comes nearest and leaves {:.1e}.",
                i.ingredient, i.matched, i.left
            )
        });
        if self
            .ingredients
            .iter()
            .any(|i| i.matched == BADLY_CONDITIONED)
        {
            return format!(
                "no ingredient alone accounts for the difference of {:.1e}: both answers solve the scheme to rounding and \
                 with the same contact status, so that the linear system is badly conditioned.",
                self.difference
            );
        }
        format!(
            "no ingredient alone accounts for the difference of {:.1e}, neither {}: look at signs and terms of the form.{nearest}",
            self.difference,
            names(self.ingredients.iter()).join(" nor ")
        )
    }
}

fn names<'a>(ingredients: impl Iterator<Item = &'a Ingredient>) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for ingredient in ingredients {
        if !names.contains(&&*ingredient.ingredient) {
            names.push(&ingredient.ingredient);
        }
    }
    names
}

/// Diagnoses every pair of every case that disagrees.
///
/// # Errors
/// An interruption. What cannot be run with an ingredient matched, is left out.
pub fn diagnose(request: &Request, outcome: &Outcome) -> Result<Vec<Diagnosis>> {
    let mut found = Vec::new();
    for case in outcome
        .cases
        .iter()
        .filter(|c| c.verdict == Verdict::Disagree)
    {
        let scene = request.scenes.iter().find(|s| s.name() == case.scene);
        let method = request
            .methods
            .iter()
            .find(|m| m.to_string() == case.method);
        let (Some(scene), Some(method)) = (scene, method) else {
            continue;
        };
        let mut pairs: Vec<(&str, &str)> = Vec::new();
        for pair in case
            .pairs
            .iter()
            .filter(|p| p.field.verdict == Verdict::Disagree)
        {
            if !pairs.contains(&(&pair.a, &pair.b)) {
                pairs.push((&pair.a, &pair.b));
            }
        }
        for (a, b) in pairs {
            let pair = Pair::new(request, case, scene, *method, [a, b])?;
            found.extend(pair.map(|pair| pair.diagnose()).transpose()?);
        }
    }
    Ok(found)
}
