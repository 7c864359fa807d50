//! Finds where a field does not solve the scheme, in which terms, and which single change of the scheme it solves.
//!
//! The residual of a field in a scheme is cheap, and exact up to rounding: a field that solves the scheme with a different rule, γ
//! or sign has no residual in that scheme. So every change is tried by assembly, without solving; the Rust engine solves only
//! if no change explains the field, to see whether its values are permuted or nearly right. Settings that are not
//! part of the scheme (tolerance, order of the mesh) show only when two codes run again.

mod again;
mod aspect;
mod changes;
mod dictionary;
mod examine;
mod experiment;
mod gamma;
mod in_form;
mod known;
mod local;
mod order;
mod place;
mod recovery;
mod scheme;
mod search;
mod stated;
mod systems;
mod terms;

use serde::Serialize;

use crate::run::Written;
use crate::text::{Number, Text, text};
use faceoff_fem::contact::Term;

pub use again::{Again, Diagnosis, Ingredient};
pub use aspect::Aspect;
pub use changes::CauseTold;
pub use examine::examine;
pub use experiment::Change;
pub use gamma::FaceGamma;
pub use in_form::InForm;
pub use order::{elsewhere, order};
pub use place::Spot;
pub use stated::Stated;
pub use systems::Systems;

/// The findings about a field in a scheme.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// The largest backward error of a row.
    pub residual: f64,
    /// The bound for the effect of the digits in the file.
    pub limit: f64,
    /// The number of digits in the file.
    pub written: Written,
    /// The number of dofs, which is that of rows.
    pub rows: usize,
    /// The number of rows above rounding.
    pub failing: usize,
    /// The number of faces of the mesh.
    pub faces: usize,
    /// The number of faces with such a row.
    pub failing_faces: usize,
    /// The places of the worst rows, the worst first.
    pub worst: Vec<Spot>,
    /// For each term, in how many of the rows that fail it is.
    pub terms: Vec<TermRows>,
    /// The γ that fits on each contact face.
    pub gamma: Vec<FaceGamma>,
    /// All attempts with their remaining residuals: those that explain the field first.
    pub explanations: Vec<Explanation>,
    /// The backward error of each row.
    #[serde(skip)]
    pub errors: Vec<f64>,
}

/// A term of the scheme in the rows that fail.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TermRows {
    /// The term.
    pub term: Term,
    /// The number of rows that it is part of.
    pub rows: usize,
    /// The number of those that fail.
    pub failing: usize,
    /// Is it part of all rows that fail, and of hardly more rows than any other such term?
    pub suspect: bool,
}

/// One change of the scheme or of the values, and the residual with it.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// The part of the scheme that differs.
    pub ingredient: Aspect,
    /// The difference, as a sentence about the code.
    pub what: Text,
    /// The same without places.
    #[serde(skip)]
    pub brief: Text,
    /// The datum that it concerns, if it concerns one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub term: Option<Term>,
    /// The factor of the quantity in the scheme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// The places, if it is not everywhere.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<Spot>,
    /// The backward error with the change.
    pub left: f64,
    /// Is only rounding left, where there was more? Never true for an iteration that stopped early, which only the distance to
    /// the solution shows.
    pub accounts: bool,
    #[serde(skip)]
    rank: Rank,
}

/// How much an explanation supposes: of two that leave nothing, the simpler one comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Rounding in the file.
    Written,
    /// One of a few choices.
    Choice,
    /// One number for the whole domain.
    Number,
    /// Choices at some places.
    Statuses,
    /// A few numbers at some places.
    Places,
    /// The values, compared with the solution.
    Values,
    /// One number per face.
    Many,
}

impl Explanation {
    /// An explanation that only has a `brief` text, which names no place.
    fn new(ingredient: Aspect, brief: Text, rank: Rank, left: f64) -> Self {
        Explanation {
            ingredient,
            what: brief.clone(),
            brief,
            term: None,
            factor: None,
            at: Vec::new(),
            left,
            accounts: false,
            rank,
        }
    }

    /// Adds the places, or another supplement to the text.
    fn more(mut self, more: Text) -> Self {
        self.what = self.what.and(more);
        self
    }

    /// Adds the faces, edges or vertices where it is.
    fn on(self, at: Vec<Spot>) -> Self {
        let more = text!(" on {}", Spot::list(&at));
        Explanation {
            at,
            ..self.more(more)
        }
    }

    /// Does it concern γ?
    pub fn is_gamma(&self) -> bool {
        self.ingredient == Aspect::Gamma
    }

    fn is_iteration(&self) -> bool {
        self.ingredient == Aspect::Iteration
    }
}

impl Findings {
    /// Does the field solve the scheme?
    pub fn solves(&self) -> bool {
        self.residual <= crate::run::RESIDUAL_TOLERANCE
    }

    /// The explanation of the field, if there is one.
    pub fn culprit(&self) -> Option<&Explanation> {
        let first = self.explanations.first();
        first.filter(|e| e.accounts || e.is_iteration())
    }

    /// Is it explained by another scheme, or by rounding in the file?
    pub fn is_of_scheme(&self) -> bool {
        self.culprit().is_some_and(|e| e.rank < Rank::Values)
    }

    /// The fault and its place, as text to follow the name of the code.
    pub fn sentence(&self) -> Text {
        let size = |error: f64| Number::new(error, 2);
        if self.solves() {
            return text!("solves the scheme: its residual is {}", size(self.residual));
        }
        let fail = text!("{} of {} rows fail", self.failing, self.rows);
        if let Some(culprit) = self.culprit() {
            let others = self.explanations.iter().skip(1);
            // An iteration is the last resort: γ by face, which supposes more, is reported in addition.
            let is_iteration = culprit.is_iteration();
            let others = others.filter(|e| e.accounts && (e.rank == culprit.rank || is_iteration));
            let others = others.map(|e| text!("; or {}", &e.what));
            let what = culprit.what.clone().and(Text::joined(others, ""));
            let what = text!("{}. Residual {}", what, size(self.residual));
            return match culprit.rank {
                Rank::Written => what,
                _ if is_iteration => text!("{}; {}", what, fail),
                _ => text!(
                    "{}, and {} with that change; {}",
                    what,
                    size(culprit.left),
                    fail
                ),
            };
        }
        let at = self.worst.first().map(|spot| text!(" at {}", spot.words()));
        let suspects = || self.terms.iter().filter(|t| t.suspect);
        let terms = Text::joined(suspects().map(|t| name(t.term)), " or ");
        let terms = suspects()
            .next()
            .map(|_| text!(", all of which contain {}", terms));
        let nearest = self.explanations.first();
        if let Some(nearest) = nearest.filter(|e| e.left <= self.limit) {
            return text!(
                "it does not solve the scheme, and too few rows fail to tell causes apart: one that leaves nothing is that {}. Residual {}{}; {}",
                &nearest.what,
                size(self.residual),
                at,
                fail
            );
        }
        let nearest = nearest.filter(|e| e.left < 0.1 * self.residual);
        let nearest = nearest.map(|e| {
            let left = size(e.left);
            text!("; the nearest is that {}, which leaves {}", &e.what, left)
        });
        text!(
            "it does not solve the scheme, and no single change explains it. Residual {}{}; {}{}{}",
            size(self.residual),
            at,
            fail,
            terms,
            nearest
        )
    }
}

/// The name of a term.
pub fn name(term: Term) -> Text {
    match term {
        Term::Volume => text!("the volume term (∇u,∇v)"),
        Term::Load => text!("the load (f,v) + <t,v>"),
        Term::Consistency => text!("the consistency term <∂ₙu,v>"),
        Term::Contact => text!("the contact term"),
        Term::Dirichlet => text!("the values on Γ_D"),
    }
}
