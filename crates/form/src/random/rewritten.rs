//! Random forms in other words, and integrals of solutions that must not change with them.

use super::{Drawn, Term};

/// The square of the error where the solution is known.
pub const PATCH: &str = "patch";

/// The highest degree of which all codes have rules on all cells.
const HIGH: usize = 5;

/// A form of the same solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rewritten {
    /// All terms of the form twice as large.
    Doubled,
    /// Each term as two halves.
    Halved,
    /// Rules of higher degree. For forms that a polynomial of the space solves: their integrands vanish at this solution, in every point of any rule.
    Raised,
}

impl Rewritten {
    /// All of them.
    pub const ALL: [Rewritten; 3] = [Rewritten::Doubled, Rewritten::Halved, Rewritten::Raised];

    /// What was done, as the end of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Rewritten::Doubled => "all terms are doubled",
            Rewritten::Halved => "each term is written as two halves",
            Rewritten::Raised => "rules have a higher degree than needed",
        }
    }
}

impl Drawn {
    /// The same form in other words.
    pub fn rewritten(&self, how: Rewritten) -> Drawn {
        let times = |term: &Term, factor: &str| Term {
            text: format!("{factor}*{}", term.text),
            ..term.clone()
        };
        let terms = self.terms.iter();
        let is_raised = how == Rewritten::Raised;
        Drawn {
            terms: match how {
                Rewritten::Doubled => terms.map(|term| times(term, "2")).collect(),
                Rewritten::Halved => terms
                    .flat_map(|term| [times(term, "0.5"), times(term, "0.5")])
                    .collect(),
                Rewritten::Raised => terms
                    .map(|term| Term {
                        degree: term.degree.map(|_| HIGH),
                        ..term.clone()
                    })
                    .collect(),
            },
            degree: if is_raised { HIGH } else { self.degree },
            facet_degree: if is_raised {
                self.facet_degree.max(HIGH)
            } else {
                self.facet_degree
            },
            ..self.clone()
        }
    }

    /// Integrals of a solution, by name, that those of the form in other words have too.
    pub fn invariants(&self) -> Vec<(&'static str, String)> {
        let weight = "sin(3*x + y)";
        let mut all = match self.is_vector || self.is_whole() {
            true => vec![
                ("square", "dot(u, u)*dx".to_owned()),
                ("weighted", format!("{weight}*(u[0] + 2*u[1])*dx")),
            ],
            false => vec![
                ("square", format!("(u - {weight})^2*dx")),
                ("boundary", format!("u*{weight}*ds(left)")),
            ],
        };
        if self.pressure.is_some() {
            all.push(("pressure", format!("p*{weight}*dx")));
        }
        if self.is_patch {
            let parts = self.polynomial();
            let squares = parts.iter().enumerate().map(|(k, p)| match parts.len() {
                1 => format!("(u - ({p}))^2"),
                _ => format!("(u[{k}] - ({p}))^2"),
            });
            let squares: Vec<String> = squares.collect();
            all.push((PATCH, format!("({})*dx", squares.join(" + "))));
        }
        all
    }
}
