//! Why a field is not what the scheme has: where it fails, in which terms, and which single change of the scheme it solves.
//!
//! The residual of a field in a scheme is cheap, and exact to rounding: a field that solves the scheme with another rule, γ
//! or sign leaves nothing in that one. So every change is tried by assembling, none by solving; the Rust engine solves only
//! where no change explains the field, to see whether its values are right but elsewhere, or nearly right. What is no
//! part of the scheme (tolerance, order of the mesh) shows only when two codes run again.

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

/// What is found about a field in a scheme.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// The largest backward error of a row.
    pub residual: f64,
    /// What the rounding of the values as they are written may leave.
    pub limit: f64,
    /// The digits that the values have.
    pub written: Written,
    /// The dofs, each with its row.
    pub rows: usize,
    /// The rows that are above rounding.
    pub failing: usize,
    /// Those of the mesh.
    pub faces: usize,
    /// The faces with such a row.
    pub failing_faces: usize,
    /// The rows that are farthest off, the worst first.
    pub worst: Vec<Spot>,
    /// How far each term is part of the rows that fail.
    pub terms: Vec<TermRows>,
    /// What γ would have to be on each contact face.
    pub gamma: Vec<FaceGamma>,
    /// What was tried, with what it leaves: what explains the field first.
    pub explanations: Vec<Explanation>,
    /// The backward error of each row.
    #[serde(skip)]
    pub errors: Vec<f64>,
}

/// A term of the scheme in the rows that fail.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TermRows {
    /// Which.
    pub term: Term,
    /// The rows that it is part of.
    pub rows: usize,
    /// Those of them that fail.
    pub failing: usize,
    /// Is it part of all that fail, and of hardly more rows than any other such term?
    pub suspect: bool,
}

/// One change of the scheme or of the values, and the residual with it.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// What differs.
    pub ingredient: Aspect,
    /// How, as a sentence about the code.
    pub what: Text,
    /// The same without places.
    #[serde(skip)]
    pub brief: Text,
    /// The one that it is about, where it is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub term: Option<Term>,
    /// By which what the scheme has is multiplied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Where, if not everywhere.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<Spot>,
    /// The backward error with it.
    pub left: f64,
    /// Is nothing but rounding left, where there was more? Never of an iteration that stopped early, for which only the distance to
    /// the solution speaks.
    pub accounts: bool,
    #[serde(skip)]
    rank: Rank,
}

/// Of two explanations that both leave nothing the one that supposes less comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Rounding of what was written.
    Written,
    /// One of a few possibilities.
    Choice,
    /// A number for all of the domain.
    Number,
    /// Choices at some places.
    Statuses,
    /// A few numbers at some places.
    Places,
    /// The values, compared with the solution.
    Values,
    /// As many numbers as there are faces.
    Many,
}

impl Explanation {
    /// What `brief` says, which names no place.
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

    /// With the places, or what else is said behind.
    fn more(mut self, more: Text) -> Self {
        self.what = self.what.and(more);
        self
    }

    /// With the faces, edges or vertices where it is.
    fn on(self, at: Vec<Spot>) -> Self {
        let more = text!(" on {}", Spot::list(&at));
        Explanation {
            at,
            ..self.more(more)
        }
    }

    /// Is it about γ?
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

    /// What explains the field, if anything does.
    pub fn culprit(&self) -> Option<&Explanation> {
        let first = self.explanations.first();
        first.filter(|e| e.accounts || e.is_iteration())
    }

    /// Does another scheme, or the rounding of what was written, explain it?
    pub fn is_of_scheme(&self) -> bool {
        self.culprit().is_some_and(|e| e.rank < Rank::Values)
    }

    /// What is wrong where, in words after the name of the code.
    pub fn sentence(&self) -> Text {
        let size = |error: f64| Number::new(error, 2);
        if self.solves() {
            return text!("solves the scheme: its residual is {}", size(self.residual));
        }
        let fail = text!("{} of {} rows fail", self.failing, self.rows);
        if let Some(culprit) = self.culprit() {
            let others = self.explanations.iter().skip(1);
            // An iteration is only what is left: γ by face, which supposes more, stands beside it.
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

/// What a term is called.
pub fn name(term: Term) -> Text {
    match term {
        Term::Volume => text!("the volume term (∇u,∇v)"),
        Term::Load => text!("the load (f,v) + <t,v>"),
        Term::Consistency => text!("the consistency term <∂ₙu,v>"),
        Term::Contact => text!("the contact term"),
        Term::Dirichlet => text!("the values on Γ_D"),
    }
}
