//! What section 6 says, and what holds: every number on the right-hand side is computed.

use serde::Serialize;

use super::iterations::Count;
use super::study::{ExampleOutcome, PaperRequest};
use super::{FINE, FINE_ITERATIONS, ITERATIONS, MESHES, intervals};
use crate::run::Observed;
use faceoff_fem::contact::Iteration;

/// A statement of the paper beside what was found.
#[derive(Debug, Clone, Serialize)]
pub struct Statement {
    pub section: &'static str,
    /// The example, where one is meant.
    pub example: String,
    /// What the paper says, in our words.
    pub says: String,
    /// None where the paper does not state enough to decide.
    pub holds: Option<bool>,
    /// What was found.
    pub found: String,
}

/// An order is confirmed by a fit this near.
const NEAR: f64 = 0.1;

pub fn statements(
    examples: &[ExampleOutcome],
    counts: &[Count],
    request: &PaperRequest,
) -> Vec<Statement> {
    let mut all = Vec::new();
    for example in examples {
        all.push(contact(example));
        all.push(changes(example));
        all.extend(orders(example));
        all.push(reference(example));
    }
    all.extend(iterations(examples, counts, request));
    all
}

fn statement(
    example: &ExampleOutcome,
    says: impl Into<String>,
    holds: impl Into<Option<bool>>,
    found: String,
) -> Statement {
    Statement {
        section: example.section,
        example: example.title.clone(),
        says: says.into(),
        holds: holds.into(),
        found,
    }
}

/// "contact condition is active in one-half of the boundary": for 6.2 no share is stated.
fn contact(e: &ExampleOutcome) -> Statement {
    let share: f64 = e.contact_set.iter().map(|[a, b]| b - a).sum();
    let found = format!(
        "contact on {}, {:.2} % of the side",
        intervals(&e.contact_set, 6),
        100.0 * share
    );
    match e.zones {
        None => {
            // Half the side to the two digits that "one half" can claim.
            let half = (share - 0.5).abs() < 0.005;
            statement(e, "contact on one half of the side y = 0", half, found)
        }
        Some(n) => {
            let says = format!("several contact zones for N = {n}");
            statement(e, says, e.contact_set.len() > 1, found)
        }
    }
}

fn changes(e: &ExampleOutcome) -> Statement {
    let (points, zones) = (e.transitions.len(), e.contact_set.len());
    let stated = e.zones.map_or(1, |n| n as usize + 1);
    let plural =
        |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
    let changes = plural(stated, "point");
    let says = format!("the solution changes from contact to non-contact in {changes}");
    let found = format!(
        "{} with {}",
        plural(zones, "zone"),
        plural(points, "change")
    );
    statement(e, says, points == stated, found)
}

/// First order, second order, and "close to 3/2".
fn orders(e: &ExampleOutcome) -> Vec<Statement> {
    let Some(series) = e.series.first() else {
        return Vec::new();
    };
    let shown = |of: &Observed| of.fit.map_or("no fit".into(), |fit| format!("{fit:.3}"));
    let near = |of: &Observed, order: f64| of.fit.is_some_and(|fit| (fit - order).abs() <= NEAR);
    let both = |says: &str, order: f64, fine: &Observed, exact: &Observed| {
        let found = format!(
            "fit {} to the fine P2 solution, {} to the mesh-free one",
            shown(fine),
            shown(exact)
        );
        statement(e, says, near(fine, order) && near(exact, order), found)
    };
    let (h1, l2) = (
        "the relative H¹ error has order 1",
        "the relative L² error has order 2",
    );
    vec![
        both(h1, 1.0, &series.h1_to_fine, &series.h1),
        both(l2, 2.0, &series.l2_to_fine, &series.l2),
        statement(
            e,
            "‖u_h + [P(u_h)]₊‖ on Γ_C has an order close to 3/2",
            near(&series.residual, 1.5),
            format!(
                "fit {}{}; (5.12) promises at least 3/2, for it bounds γ^(-1/2) times this by O(h)",
                shown(&series.residual),
                match series.residual.fit {
                    Some(fit) if fit > 1.5 + NEAR => ", higher",
                    Some(fit) if fit < 1.5 - NEAR => ", lower",
                    _ => "",
                }
            ),
        ),
    ]
}

/// The fine P2 solution stands for u: its own errors must be small beside those it measures.
fn reference(e: &ExampleOutcome) -> Statement {
    let last = e.fine.errors.last().copied();
    let cr = e.series.first().and_then(|s| s.levels.last());
    let (share_h1, share_l2, found) = match (last, cr) {
        (Some(p2), Some(cr)) => {
            let (h1, l2) = (p2.h1 / cr.errors.h1, p2.l2 / cr.errors.l2);
            let [low, high] = e.fine.predicted;
            let found = format!(
                "its errors are {:.1e} in H¹ and {:.1e} in L²: {:.2} % and {:.2} % of those of CR at n = {}; its own last step predicts \
                 {low:.1e} to {high:.1e} in H¹",
                p2.h1,
                p2.l2,
                100.0 * h1,
                100.0 * l2,
                cr.n,
            );
            (h1, l2, found)
        }
        _ => (f64::NAN, f64::NAN, "not solved".into()),
    };
    let n = e.fine.n.last().copied().unwrap_or_default();
    statement(
        e,
        format!("P2 on {n} × {n} can stand for the unknown solution (its errors under 10 %)"),
        share_h1 < 0.1 && share_l2 < 0.1,
        found,
    )
}

/// The counts of 6.1, where the meshes are the paper's.
fn iterations(
    examples: &[ExampleOutcome],
    counts: &[Count],
    request: &PaperRequest,
) -> Vec<Statement> {
    let Some(example) = examples.first().filter(|e| e.zones.is_none()) else {
        return Vec::new();
    };
    let mut all = Vec::new();
    if request.n == MESHES {
        let stated: Vec<Option<usize>> = ITERATIONS.iter().map(|&k| Some(k)).collect();
        let newton = Iteration::Newton;
        let mut fixed = counts.iter().filter(|c| c.iteration != newton);
        let splittings = fixed.clone().count();
        let same = fixed.find(|c| c.iterations == stated);
        let found = match same {
            Some(Count {
                iteration, gamma, ..
            }) => {
                format!("{iteration} with γ = {gamma} gives just these")
            }
            None => format!(
                "none of {splittings} splittings gives them (γ₀, splitting and start are not stated); see the table"
            ),
        };
        let words: Vec<String> = ITERATIONS.iter().map(ToString::to_string).collect();
        all.push(statement(
            example,
            format!("the fixed point takes {} iterations", words.join(", ")),
            same.map(|_| true),
            found,
        ));
    }
    if request.fine == FINE {
        let newton = example.fine.steps.last().copied().flatten();
        all.push(statement(
            example,
            format!("the fine solution takes {FINE_ITERATIONS} fixed point iterations"),
            None,
            newton.map_or("semismooth Newton does not get there".into(), |steps| {
                format!("semismooth Newton takes {steps}; the fixed point is not stated in full, and not run on this mesh")
            }),
        ));
    }
    all
}
