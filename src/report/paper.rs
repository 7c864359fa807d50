//! The report of section 6 of the paper.

mod convergence;

use super::html::{charts, elevation::elevation};
use super::model::{Block, Cell, Figure, Report, Table, cells, count, joined, short, table};
use crate::campaigns::paper::{
    CAP, ExampleOutcome, FAR, FINE_ITERATIONS, ITERATIONS, MESHES, PaperOutcome, References,
    Series, SeriesLevel, TOL, intervals,
};
use crate::engine::unique;
use crate::run::Observed;
use crate::text::{Number, text};
use faceoff_fem::contact::Positivity;
use faceoff_mesh::error::Result;

const QUESTION: &str = "faceoff paper: Burman, Hansbo, Larson (2017), section 6, again";

/// The report of all that was computed.
///
/// # Errors
/// Only those of a broken installation.
pub fn paper(outcome: &PaperOutcome) -> Result<Report<'_>> {
    let all = || outcome.statements.iter();
    let of = |holds| all().filter(|s| s.holds == holds).count();
    let mut report = Report::new("paper", QUESTION, "", outcome)?;
    report.story.claim = text!(
        "**{} of {}** of the paper hold{}",
        of(Some(true)),
        count(outcome.statements.len(), "statement"),
        match of(None) {
            0 => String::new(),
            some => format!(", {some} are undecided"),
        }
    );
    report.story.rests_on = text!(
        "Section 6 of Burman, Hansbo, Larson (2017) again: {}, P2 on {outcome.fine} × {outcome.fine} as the reference, and the mesh-free solution in addition.",
        count(outcome.examples.len(), "example")
    );
    report.story.rest.push(Block::text(text!("The penalty-free method on CR (`cr`), γ = {} h with h the cells' diameter, on Union-Jack meshes of n × n squares; errors relative \
         to the norms of u: H¹ is ‖∇(u-u_h)‖_h/‖∇u‖. The reference is P2 on {outcome.fine} × {outcome.fine} as in the paper, and the mesh-free solution in addition. \
         The paper states neither γ₀, nor the splitting of its fixed point, nor its initial guess: here γ₀ is the default, and Newton's iteration \
         starts from u = 0.", outcome.gamma0.to_string())));
    let verdict = |holds| match holds {
        Some(true) => "holds",
        Some(false) => "does not hold",
        None => "undecided",
    };
    let statements = table!("", all(), |s|
        "example" => &s.example,
        "the paper" => &s.says,
        "verdict" => verdict(s.holds),
        "found" => &s.found,
    );
    report.story.picture = figures(outcome).into_iter().map(Block::Figure).collect();
    report.story.rest.extend([
        Block::heading(2, "What the paper says, and what holds"),
        statements.into(),
    ]);
    report
        .story
        .rest
        .extend(outcome.examples.iter().flat_map(of_example));
    let series = outcome.examples.iter().flat_map(|example| &example.series);
    report.engines = unique(series.map(|of| (of.engine.clone(), of.version.clone())));
    report.story.rest.extend(counts(outcome));
    report.story.rest.extend(theory(outcome));
    let failures = outcome.failures.iter();
    report.story.rest.extend(
        failures.map(|f| Block::text(format!("No answer from {}: {}", f.engine, f.message))),
    );
    Ok(report)
}

fn of_example(e: &ExampleOutcome) -> Vec<Block<'_>> {
    let fine = &e.fine;
    let levels = table!("", 0..fine.n.len(), |k|
        "P2, n" => fine.n[k],
        "dofs" => fine.dofs[k],
        "steps" => reached(fine.steps[k]),
        "H¹ error" => fine.errors[k].h1,
        "order" => order(&fine.h1, k),
        "L² error" => fine.errors[k].l2,
        "order" => order(&fine.l2, k),
        "‖∇(U_n-U_n/2)‖" => before(&fine.steps_between, k),
    );
    let mut blocks = vec![
        Block::heading(2, format!("{}: f = {}", e.title, e.f)),
        Block::text(text!(
            "Mesh-free: contact on {}; ‖∇u‖² = {}, ‖u‖ = {}, ∫∂ₙu = {} on Γ_C.",
            intervals(&e.contact_set, 10),
            Number::fixed(e.grad_norm_sq, 12),
            Number::fixed(e.l2_norm, 12),
            Number::fixed(e.contact_flux, 12)
        )),
        levels.into(),
    ];
    if let Some(last) = fine.errors.last() {
        let [low, high] = fine.predicted.map(short);
        blocks.push(Block::text(format!(
            "P2's own last step, with order 3/2 for u ∈ H^(5/2-ε), predicts an H¹ error of {low} to {high} on the finest mesh; to the \
             mesh-free solution it is {}.",
            short(last.h1)
        )));
    }
    blocks.extend(e.series.iter().map(|s| of_series(s).into()));
    blocks.push(variants(e));
    blocks
}

fn of_series(s: &Series) -> Table {
    let caption = format!(
        "CR by {} {}; the fit is over the last three meshes.",
        s.engine, s.version
    );
    // Each mesh, and finally the fit.
    let rows = s.levels.iter().map(Some).chain([None]).enumerate();
    let order = |level: Option<&SeriesLevel>, k: usize, observed: &Observed| match level {
        Some(_) => order(observed, k),
        None => observed.fit.map(|fit| Cell::fixed(fit, 3)).into(),
    };
    table!(caption, rows, |(k, l)|
        "CR, n" => l.map_or("fit".into(), |l| Cell::from(l.n)),
        "steps" => l.map(|l| reached(l.steps)),
        "H¹, mesh-free" => l.map(|l| l.errors.h1),
        "order" => order(l, k, &s.h1),
        "H¹, P2" => l.map(|l| l.errors_to_fine.h1),
        "order" => order(l, k, &s.h1_to_fine),
        "L², mesh-free" => l.map(|l| l.errors.l2),
        "order" => order(l, k, &s.l2),
        "L², P2" => l.map(|l| l.errors_to_fine.l2),
        "order" => order(l, k, &s.l2_to_fine),
        "‖u-u_h‖₁ₕ" => l.map(|l| l.norm_1h),
        "‖u_h+[P]₊‖_C" => l.map(|l| l.residual),
        "order" => order(l, k, &s.residual),
        "times γ^(-1/2)" => l.map(|l| l.weighted_residual),
        "order" => order(l, k, &s.weighted_residual),
    )
}

/// The order relative to the mesh before.
fn order(observed: &Observed, k: usize) -> Cell {
    before(&observed.steps, k)
        .map(|order| Cell::fixed(order, 2))
        .into()
}

/// For values between meshes, that between the mesh before and this one.
fn before(between: &[f64], k: usize) -> Option<f64> {
    between.get(k.checked_sub(1)?).copied()
}

fn counts(outcome: &PaperOutcome) -> Vec<Block<'_>> {
    let Some(first) = outcome.counts.first() else {
        return Vec::new();
    };
    let of_paper = |n: &usize| {
        let place = MESHES.iter().position(|m| m == n);
        place.map_or("–".into(), |k| Cell::from(ITERATIONS[k]))
    };
    let mut paper = cells!["the paper's", "cr", "not stated", "Union Jack"];
    paper.extend(first.n.iter().map(of_paper));
    paper.push("–".into());
    let rows = outcome.counts.iter().map(|count| {
        let mut row = cells![
            count.iteration.to_string(),
            &count.method,
            &count.gamma,
            count.mesh.to_string()
        ];
        // P2 is not run on the finest ones.
        row.extend(first.n.iter().map(|n| {
            let place = count.n.iter().position(|of| of == n);
            place.map_or("–".into(), |k| reached(count.iterations[k]))
        }));
        let worst = count.backward_errors.iter().copied().fold(0.0, f64::max);
        row.push(Cell::from(worst));
        row
    });
    let head = by_mesh(
        &["iteration", "method", "γ", "mesh"],
        &first.n,
        "largest residual",
    );
    let mut blocks = vec![
        Block::heading(2, "Iterations"),
        Block::text(text!(
            "Of 6.1 until the relative H¹ norm of the increment is below {}, from u = 0: the paper's own criterion. The last column is \
             the backward error of what each ended with, on any of the meshes: an increment below the tolerance does not say that the \
             scheme is solved to it. The paper's fixed point took {} for its fine P2 solution; it tells none for 6.2.",
            Number::power(TOL),
            &FINE_ITERATIONS
        )),
        Table::new("", head).with([paper]).with(rows).into(),
        Block::text(text!(
            "What is new in each step and what is old, all in the increment form: lagged-p lags [P]₊ as a whole; lagged-gap lags [u-γ∂ₙu]₊; \
             relaxed lags the indicator of contact and takes a sixth of each step; flux-new has in P the flux new and the displacement old; \
             displacement-new has in γ∂ₙu + [u-γ∂ₙu]₊ the displacement new and the flux in the bracket old. \
             exchanged: the Union-Jack mesh with the diagonals exchanged, FreeFEM's square(n, n, flags=1). Not reached: not within {} iterations.",
            &CAP
        )),
    ];
    if let Some(search) = &outcome.search {
        let trials = search.nearest.iter().map(|trial| {
            let mut row = cells![
                trial.iteration.to_string(),
                &trial.gamma,
                trial.mesh.to_string()
            ];
            row.extend(trial.iterations.iter().map(|k| Cell::from(*k)));
            row.push(Cell::number(
                trial.off,
                format!("{:.1} %", 100.0 * trial.off),
            ));
            row
        });
        let mut stated = cells!["the paper's", "not stated", "Union Jack"];
        stated.extend(search.n.iter().map(of_paper));
        stated.push("–".into());
        let head = by_mesh(&["iteration", "γ", "mesh"], &search.n, "off by at most");
        let near = search.near.iter();
        let near = joined(near.map(|(name, count)| format!("{name} {count}")), ", ");
        blocks.extend([
            Block::text(text!("**The search for γ₀.** Each splitting on both meshes with γ = γ₀h and with γ fixed, 81 values from 0.01 to 1000: {search.tried} trials. \
                 Within {} % of the paper's counts on every mesh: {near}. The nearest:", Number::fixed(100.0 * FAR, 0))),
            Table::new("", head).with([stated]).with(trials).into(),
        ]);
    }
    blocks
}

/// The names of the columns, one per mesh.
fn by_mesh(first: &[&str], n: &[usize], last: &str) -> Vec<String> {
    let first = first.iter().map(|name| (*name).to_owned());
    let meshes = n.iter().map(|n| format!("n = {n}"));
    first.chain(meshes).chain([last.to_owned()]).collect()
}

fn variants(e: &ExampleOutcome) -> Block<'_> {
    let fit = |of: &Observed| Cell::from(of.fit.map(|fit| Cell::fixed(fit, 2)));
    let steps = |of: &Observed| joined(of.steps.iter().map(|s| format!("{s:.2}")), " ");
    let caption = "Orders on both Union-Jack meshes and for other γ₀, to the mesh-free solution; fits over the last three meshes, \
                   ρ = ‖u_h+[P]₊‖_C. p1(1,0) is the conforming penalty-free method";
    table!(caption, e.variants.iter(), |v|
        "method" => &v.method,
        "mesh" => v.mesh.to_string(),
        "γ₀" => Cell::from(v.gamma0),
        "H¹" => fit(&v.h1),
        "L²" => fit(&v.l2),
        "ρ" => fit(&v.residual),
        "ρ from mesh to mesh" => steps(&v.residual),
        "γ^(-1/2) ρ" => fit(&v.weighted_residual),
        "H¹ error, finest" => v.errors.last().map(|e| e.h1),
    )
    .into()
}

fn theory(outcome: &PaperOutcome) -> Vec<Block<'_>> {
    let of = &outcome.theory;
    let constant = |of: &Option<Positivity>| of.map(|p| Cell::fixed(p.constant, 4));
    let least = |of: &Option<Positivity>| of.map(|p| Cell::fixed(p.least_gamma0, 4));
    let caption = text!(
        "For the scheme that the errors are of, γ₀ = {}; all cells at Γ_C are alike, so that the numbers are those of every n",
        of.gamma0.to_string()
    );
    let rows = table!(caption, of.meshes.iter(), |m|
        "mesh" => m.mesh.to_string(),
        "Lemma 3.1: flux, means off by" => m.lifting.map(|l| Cell::from(l.flux_error.max(l.mean_error))),
        "C of (3.10)" => m.lifting.map(|l| Cell::fixed(l.constant, 4)),
        "c of (4.2)" => constant(&m.positivity),
        "(4.2) for γ₀ above" => least(&m.positivity),
        "c at midpoints" => constant(&m.positivity_at_midpoints),
        "unique for γ₀ above" => Cell::fixed(m.unique_above, 4),
    );
    let trace = match of.load_has_trace {
        true => text!("The loads have a trace near Γ_C, as (2.10) asks."),
        false => text!("The load seems to have no trace near Γ_C: (2.10) fails."),
    };
    vec![
        Block::heading(2, "What sections 3 and 4 suppose, as numbers"),
        Block::text(text!(
            "C is the constant of ‖v_h‖ ≤ C h^(3/2) ‖r‖; c the largest with c (‖∇w‖² + γ⁻¹‖w + [P(u₁)]₊ - [P(u₂)]₊‖²_C) ≤ A_h(u₁; v_h) - A_h(u₂; v_h) \
             for all u₁, u₂, with the v_h of the proof: a smallest eigenvalue on the cells at Γ_C. (4.2) gives uniqueness above its own γ₀, \
             which is sharper than the condition that `solve` warns by, in the last column. With one point on each face both hold for every γ₀. {trace}"
        )),
        rows.into(),
    ]
}

fn reached(iterations: Option<usize>) -> Cell {
    iterations.map_or("not reached".into(), Cell::from)
}

/// The report of the mesh-free references.
///
/// # Errors
/// Only those of a broken installation.
pub fn references(references: &References) -> Result<Report<'_>> {
    let mut report = Report::new("paper reference", QUESTION, "", references)?;
    for (name, known) in &references.0 {
        report.story.rest.push(Block::heading(2, name.clone()));
        report.story.rest.push(Block::facts([
            (text!("contact on"), intervals(&known.contact_set, 13)),
            (text!("‖∇u‖²"), format!("{:.12}", known.grad_norm_sq)),
            (text!("‖u‖"), format!("{:.12}", known.l2_norm)),
            (text!("flux on Γ_C"), format!("{:.12}", known.contact_flux)),
        ]));
    }
    Ok(report)
}

/// The paper's figures from what was computed.
fn figures(outcome: &PaperOutcome) -> Vec<Figure<'_>> {
    let first = outcome.examples.first();
    let first = first.map(|e| {
        let caption = text!("**Figure 1.** The fine mesh solution of {e.title} by P2 on {outcome.fine} × {outcome.fine}. Red: contact, {} on y = 0", &intervals(&e.contact_set, 4));
        let label = format!("elevation of {}", e.title);
        let draw = move |width| elevation(&e.fine.elevation, &e.contact_set, &label, width);
        Figure {
            name: "figure-1".into(),
            caption,
            picture: Box::new(draw),
        }
    });
    let second = Figure {
        name: "figure-2".into(),
        caption: convergence::caption(outcome),
        picture: Box::new(|width| charts("errors over h", &convergence::panels(outcome), width)),
    };
    first.into_iter().chain([second]).collect()
}
