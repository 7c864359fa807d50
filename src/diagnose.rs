//! Why two codes of one scheme differ: the case again, with one ingredient matched at a time.

use serde::Serialize;

use crate::verify::CaseOutcome;

/// What was found about one pair of one case.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    pub scene: String,
    pub method: String,
    pub n: Option<usize>,
    pub a: String,
    pub b: String,
    /// max|a-b| over the face means, relative to max|u|.
    pub difference: f64,
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
    pub fn is_of(&self, case: &CaseOutcome, a: &str, b: &str) -> bool {
        (&*self.scene, &*self.method, self.n) == (&*case.scene, &*case.method, case.n)
            && (&*self.a, &*self.b) == (a, b)
    }

    /// What accounts for the difference, in words.
    pub fn sentence(&self) -> String {
        String::new()
    }
}
