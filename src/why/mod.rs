//! Why an answer is not what the scheme has: which single change explains it.
//!
//! A code is a black box, but the Rust engine is not. Where an answer comes out of the Rust engine once it uses another
//! quadrature, another γ or the other sign of f, that is what the code does otherwise. What is no parameter of the scheme
//! (tolerance, order of the mesh) is matched by running two codes again.

mod gamma;
mod order;
mod search;

use serde::Serialize;

use crate::engine::unique;

pub use order::{elsewhere, order};
pub use search::Search;

/// What the start was matched to where it is not to blame.
const BADLY_CONDITIONED: &str =
    "either answer: both solve the same linear system, which is badly conditioned";

/// What was found about two answers to one case.
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
    /// The code that seems to use that, or does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub used_by: Option<String>,
    /// The difference that is left, in the same units.
    pub left: f64,
    /// Is nothing but rounding left?
    pub accounts: bool,
}

impl Ingredient {
    /// What is matched, and by whom it seems to be used.
    pub fn words(&self) -> String {
        let seems = if self.accounts {
            "seems"
        } else {
            "does not seem"
        };
        match &self.used_by {
            Some(who) => format!("{}, which {who} {seems} to use", self.matched),
            None => self.matched.clone(),
        }
    }
}

impl Diagnosis {
    /// Is it about these two in this case?
    pub fn is_of(&self, case: (&str, &str, Option<usize>), pair: (&str, &str)) -> bool {
        (&*self.scene, &*self.method, self.n) == case && (&*self.a, &*self.b) == pair
    }

    /// Of each ingredient that accounts for the difference, what leaves least.
    pub fn causes(&self) -> Vec<&Ingredient> {
        let accounts = || self.ingredients.iter().filter(|i| i.accounts);
        let best = |name: &str| {
            let same = accounts().filter(|i| i.ingredient == name);
            same.min_by(|i, j| i.left.total_cmp(&j.left))
        };
        names(accounts()).into_iter().filter_map(best).collect()
    }

    /// What accounts for the difference, in words.
    pub fn sentence(&self) -> String {
        let cause = |i: &&Ingredient| {
            let words = i.words();
            let comma = if words.contains(',') { "," } else { "" };
            format!(
                "{} accounts for it: with {words}{comma} the difference falls from {:.1e} to {:.1e}",
                i.ingredient, self.difference, i.left
            )
        };
        let named: Vec<String> = self.causes().iter().map(cause).collect();
        if !named.is_empty() {
            return format!("{}.", named.join("; "));
        }
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
        let nearer = self
            .ingredients
            .iter()
            .filter(|i| i.left < 0.5 * self.difference);
        let nearest = nearer.min_by(|i, j| i.left.total_cmp(&j.left));
        let nearest = nearest.map_or(String::new(), |i| {
            let (name, words, left) = (&i.ingredient, i.words(), i.left);
            format!(" {name} with {words} comes nearest and leaves {left:.1e}.")
        });
        format!(
            "no ingredient alone accounts for the difference of {:.1e}, neither {}.{nearest}",
            self.difference,
            names(self.ingredients.iter()).join(" nor ")
        )
    }
}

fn names<'a>(ingredients: impl Iterator<Item = &'a Ingredient>) -> Vec<&'a str> {
    unique(ingredients.map(|i| &*i.ingredient))
}
