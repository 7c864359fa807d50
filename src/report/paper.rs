//! Section 6 of the paper again.

mod convergence;
mod elevation;
mod figures;

use super::model::{Block, Cell, Report, Table, cells, count, short};
use crate::campaigns::paper::{
    CAP, Count, ExampleOutcome, FINE_ITERATIONS, ITERATIONS, MESHES, PaperOutcome, References,
    Series, TOL, intervals,
};
use crate::run::Observed;
use faceoff_mesh::error::Result;

const QUESTION: &str = "faceoff paper: Burman, Hansbo, Larson (2017), section 6, again";

/// The report of all that was computed.
///
/// # Errors
/// None but of a broken installation.
pub fn paper(outcome: &PaperOutcome) -> Result<Report<'_>> {
    let of = |holds| {
        outcome
            .statements
            .iter()
            .filter(|s| s.holds == holds)
            .count()
    };
    let headline = format!(
        "{} of the paper: {} hold, {} do not, {} cannot be told",
        count(outcome.statements.len(), "statement"),
        of(Some(true)),
        of(Some(false)),
        of(None)
    );
    let mut report = Report::new("paper", QUESTION, headline, outcome)?;
    report.blocks.push(Block::Text(format!(
        "The penalty-free method on CR (`cr`), γ = {} h with h the cells' diameter, on Union-Jack meshes of n × n squares; errors relative \
         to the norms of u: H¹ is ‖∇(u-u_h)‖_h/‖∇u‖. The reference is P2 on {1} × {1} as in the paper, and beside it the mesh-free solution. \
         The paper states neither γ₀, nor the splitting of its fixed point, nor its start: here γ₀ is the program's own, and Newton's iteration \
         starts from u = 0.",
        outcome.gamma0, outcome.fine,
    )));
    let statements = outcome.statements.iter().map(|s| {
        let verdict = match s.holds {
            Some(true) => "holds",
            Some(false) => "does not hold",
            None => "cannot be told",
        };
        cells![&s.example, &s.says, verdict, &s.found]
    });
    let statements = Table::new("", &["example", "the paper", "verdict", "found"]).with(statements);
    report.blocks.push(Block::Heading(
        2,
        "What the paper says, and what holds".into(),
    ));
    report.blocks.push(statements.into());
    let figures = figures::figures(outcome).into_iter().map(Block::Figure);
    report.blocks.push(Block::Page(figures.collect()));
    for example in &outcome.examples {
        report.blocks.extend(of_example(example));
        for series in &example.series {
            let known = (series.engine.clone(), series.version.clone());
            if !report.engines.contains(&known) {
                report.engines.push(known);
            }
        }
    }
    report.blocks.extend(counts(&outcome.counts));
    let failures = outcome.failures.iter();
    report.blocks.extend(
        failures.map(|f| Block::Text(format!("No answer from {}: {}", f.engine, f.message))),
    );
    Ok(report)
}

fn of_example(e: &ExampleOutcome) -> Vec<Block<'_>> {
    let fine = &e.fine;
    let rows = (0..fine.n.len()).map(|k| {
        let between = k.checked_sub(1).and_then(|k| fine.steps_between.get(k));
        cells![
            fine.n[k],
            fine.dofs[k],
            reached(fine.steps[k]),
            fine.errors[k].h1,
            order(&fine.h1, k),
            fine.errors[k].l2,
            order(&fine.l2, k),
            between.copied(),
        ]
    });
    let head = [
        "P2, n",
        "dofs",
        "steps",
        "H¹ error",
        "order",
        "L² error",
        "order",
        "‖∇(U_n-U_n/2)‖",
    ];
    let mut blocks = vec![
        Block::Heading(2, format!("{}: f = {}", e.title, e.f)),
        Block::Text(format!(
            "Mesh-free: contact on {}; ‖∇u‖² = {:.12}, ‖u‖ = {:.12}, ∫∂ₙu = {:.12} on Γ_C.",
            intervals(&e.contact_set, 10),
            e.grad_norm_sq,
            e.l2_norm,
            e.contact_flux,
        )),
        Table::new("", &head).with(rows).into(),
    ];
    if let Some(last) = fine.errors.last() {
        let [low, high] = fine.predicted.map(short);
        blocks.push(Block::Text(format!(
            "P2's own last step, with order 3/2 for u ∈ H^(5/2-ε), predicts an H¹ error of {low} to {high} on the finest mesh; to the \
             mesh-free solution it is {}.",
            short(last.h1)
        )));
    }
    blocks.extend(e.series.iter().map(|s| of_series(s).into()));
    blocks
}

fn of_series(s: &Series) -> Table {
    let orders = [&s.h1, &s.h1_to_fine, &s.l2, &s.l2_to_fine, &s.residual];
    let levels = s.levels.iter().enumerate().map(|(k, l)| {
        let errors = [
            l.errors.h1,
            l.errors_to_fine.h1,
            l.errors.l2,
            l.errors_to_fine.l2,
            l.residual,
        ];
        let mut row = cells![l.n, reached(l.steps)];
        for (error, observed) in errors.into_iter().zip(orders) {
            row.extend([error.into(), order(observed, k)]);
        }
        row
    });
    let mut fits = cells!["fit", ""];
    for observed in orders {
        fits.extend([
            "".into(),
            observed.fit.map(|fit| Cell::fixed(fit, 3)).into(),
        ]);
    }
    let head = [
        "CR, n",
        "steps",
        "H¹, mesh-free",
        "order",
        "H¹, P2",
        "order",
        "L², mesh-free",
        "order",
        "L², P2",
        "order",
        "‖u_h+[P]₊‖_C",
        "order",
    ];
    let caption = format!(
        "CR by {} {}; the fit is over the last three meshes.",
        s.engine, s.version
    );
    Table::new(caption, &head).with(levels.chain([fits]))
}

/// The order from the mesh before.
fn order(observed: &Observed, k: usize) -> Cell {
    let order = k.checked_sub(1).and_then(|k| observed.steps.get(k));
    order.map(|order| Cell::fixed(*order, 2)).into()
}

fn counts(counts: &[Count]) -> Vec<Block<'_>> {
    let Some(first) = counts.first() else {
        return Vec::new();
    };
    let of_paper = |n: &usize| {
        let place = MESHES.iter().position(|m| m == n);
        place.map_or("–".into(), |k| Cell::from(ITERATIONS[k]))
    };
    let mut paper = cells!["the paper's", "not stated"];
    paper.extend(first.n.iter().map(of_paper));
    let rows = counts.iter().map(|count| {
        let mut row = cells![count.iteration.to_string(), &count.gamma];
        row.extend(count.iterations.iter().map(|k| reached(*k)));
        row
    });
    let mut head = vec!["iteration".to_owned(), "γ".to_owned()];
    head.extend(first.n.iter().map(|n| format!("n = {n}")));
    vec![
        Block::Heading(2, "Iterations".into()),
        Block::Text(format!(
            "Of 6.1 until the relative H¹ norm of the increment is below {TOL:e}, from u = 0. The paper's fixed point took {FINE_ITERATIONS} \
             for its fine P2 solution; it tells none for 6.2."
        )),
        Table::new("", &head).with([paper]).with(rows).into(),
        Block::Text(format!(
            "lagged-p lags [P]₊ as a whole; lagged-gap lags [u-γ∂ₙu]₊; relaxed lags the indicator of contact and takes a sixth of each step; \
             flux-new has the flux new and the displacement old in P. Not reached: not within {CAP} iterations."
        )),
    ]
}

fn reached(iterations: Option<usize>) -> Cell {
    iterations.map_or("not reached".into(), Cell::from)
}

/// The report of the mesh-free references.
///
/// # Errors
/// None but of a broken installation.
pub fn references(references: &References) -> Result<Report<'_>> {
    let mut report = Report::new("paper reference", QUESTION, "", references)?;
    for (name, known) in &references.0 {
        let facts = [
            ("contact on", intervals(&known.contact_set, 13)),
            ("‖∇u‖²", format!("{:.12}", known.grad_norm_sq)),
            ("‖u‖", format!("{:.12}", known.l2_norm)),
            ("flux on Γ_C", format!("{:.12}", known.contact_flux)),
        ];
        let facts = facts.map(|(name, fact)| (name.to_owned(), fact));
        report.blocks.push(Block::Heading(2, name.clone()));
        report.blocks.push(Block::Facts(facts.into()));
    }
    Ok(report)
}
