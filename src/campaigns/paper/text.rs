//! The tables and the report, in Markdown: what a terminal shows is what the file holds.

use std::fmt::Write as _;

use comfy_table::{Table, presets};

use super::figures::FIGURES;
use super::iterations::{CAP, Count};
use super::reference::References;
use super::study::{ExampleOutcome, PaperOutcome, Series};
use super::{FINE_ITERATIONS, ITERATIONS, MESHES, TOL};
use crate::run::Observed;

const MOST_INTERVALS: usize = 8;

/// The report: all tables, and the figures by their file names.
pub fn report(outcome: &PaperOutcome) -> String {
    let mut text = tables(outcome);
    let _ = writeln!(text, "## Figures\n");
    for figure in FIGURES {
        let _ = writeln!(
            text,
            "![{0}]({1}.svg)\n\n{0}\n",
            figure.caption(outcome),
            figure.name()
        );
    }
    text
}

/// All that was found, as tables.
pub fn tables(outcome: &PaperOutcome) -> String {
    let mut text = format!(
        "# Burman, Hansbo, Larson (2017), section 6, again\n\n\
         The penalty-free method on CR (`cr`), γ = {} h with h the cells' diameter, on Union-Jack meshes of n × n squares; errors relative \
         to the norms of u: H¹ is ‖∇(u-u_h)‖_h/‖∇u‖. The reference is P2 on {1} × {1} as in the paper, and beside it the mesh-free solution. \
         The paper states neither γ₀, nor the splitting of its fixed point, nor its start: here γ₀ is the program's own, and Newton's iteration \
         starts from u = 0.\n\n",
        outcome.gamma0, outcome.fine,
    );
    for example in &outcome.examples {
        write_example(&mut text, example);
    }
    let _ = writeln!(text, "## What the paper says, and what holds\n");
    let mut table = new(&["example", "the paper", "", "found"]);
    for s in &outcome.statements {
        let verdict = match s.holds {
            Some(true) => "holds",
            Some(false) => "does not hold",
            None => "cannot be told",
        };
        table.add_row([&s.example, &s.says, verdict, &s.found]);
    }
    let _ = writeln!(text, "{table}\n");
    write_counts(&mut text, &outcome.counts);
    for failure in &outcome.failures {
        let _ = writeln!(
            text,
            "No answer from {}: {}\n",
            failure.engine, failure.message
        );
    }
    text
}

fn write_example(text: &mut String, e: &ExampleOutcome) {
    let _ = writeln!(
        text,
        "## {}: f = {}\n\nMesh-free: contact on {}; ‖∇u‖² = {:.12}, ‖u‖ = {:.12}, ∫∂ₙu = {:.12} on Γ_C.\n",
        e.title,
        e.f,
        intervals(&e.contact_set, 10),
        e.grad_norm_sq,
        e.l2_norm,
        e.contact_flux,
    );
    let mut table = new(&[
        "P2, n",
        "dofs",
        "steps",
        "H¹ error",
        "order",
        "L² error",
        "order",
        "‖∇(U_n-U_n/2)‖",
    ]);
    let fine = &e.fine;
    for k in 0..fine.n.len() {
        table.add_row([
            fine.n[k].to_string(),
            fine.dofs[k].to_string(),
            reached(fine.steps[k]),
            format!("{:.3e}", fine.errors[k].h1),
            order(&fine.h1, k),
            format!("{:.3e}", fine.errors[k].l2),
            order(&fine.l2, k),
            k.checked_sub(1)
                .and_then(|k| fine.steps_between.get(k))
                .map_or(String::new(), |step| format!("{step:.3e}")),
        ]);
    }
    let _ = writeln!(text, "{table}\n");
    if let Some(last) = fine.errors.last() {
        let [low, high] = fine.predicted;
        let _ = writeln!(
            text,
            "P2's own last step, with order 3/2 for u ∈ H^(5/2-ε), predicts an H¹ error of {low:.2e} to {high:.2e} on the finest mesh; to the mesh-free \
             solution it is {:.2e}.\n",
            last.h1
        );
    }
    for series in &e.series {
        write_series(text, series);
    }
}

fn write_series(text: &mut String, s: &Series) {
    let mut table = new(&[
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
    ]);
    for (k, l) in s.levels.iter().enumerate() {
        table.add_row([
            l.n.to_string(),
            reached(l.steps),
            format!("{:.3e}", l.errors.h1),
            order(&s.h1, k),
            format!("{:.3e}", l.errors_to_fine.h1),
            order(&s.h1_to_fine, k),
            format!("{:.3e}", l.errors.l2),
            order(&s.l2, k),
            format!("{:.3e}", l.errors_to_fine.l2),
            order(&s.l2_to_fine, k),
            format!("{:.3e}", l.residual),
            order(&s.residual, k),
        ]);
    }
    let fit = |o: &Observed| o.fit.map_or(String::new(), |fit| format!("{fit:.3}"));
    table.add_row([
        "fit".to_owned(),
        String::new(),
        String::new(),
        fit(&s.h1),
        String::new(),
        fit(&s.h1_to_fine),
        String::new(),
        fit(&s.l2),
        String::new(),
        fit(&s.l2_to_fine),
        String::new(),
        fit(&s.residual),
    ]);
    let _ = writeln!(
        text,
        "CR by {} {}; the fit is over the last three meshes.\n\n{table}\n",
        s.engine, s.version
    );
}

/// The order from the mesh before.
fn order(observed: &Observed, k: usize) -> String {
    k.checked_sub(1)
        .and_then(|k| observed.steps.get(k))
        .map_or(String::new(), |order| format!("{order:.2}"))
}

fn write_counts(text: &mut String, counts: &[Count]) {
    let Some(first) = counts.first() else { return };
    let _ = writeln!(
        text,
        "## Iterations\n\nOf 6.1 until the relative H¹ norm of the increment is below {TOL:e}, from u = 0. The paper's fixed point took {FINE_ITERATIONS} \
         for its fine P2 solution; it tells none for 6.2.\n"
    );
    let mut header = vec!["iteration".to_owned(), "γ".to_owned()];
    header.extend(first.n.iter().map(|n| format!("n = {n}")));
    let mut table = new(&header);
    let of_paper = |n: &usize| {
        let place = MESHES.iter().position(|m| m == n);
        place.map_or("–".to_owned(), |k| ITERATIONS[k].to_string())
    };
    let mut row = vec!["the paper's".to_owned(), "not stated".to_owned()];
    row.extend(first.n.iter().map(of_paper));
    table.add_row(row);
    for count in counts {
        let mut row = vec![count.iteration.to_string(), count.gamma.clone()];
        row.extend(count.iterations.iter().map(|k| reached(*k)));
        table.add_row(row);
    }
    let _ = writeln!(
        text,
        "{table}\n\nlagged-p lags [P]₊ as a whole; lagged-gap lags [u-γ∂ₙu]₊; relaxed lags the indicator of contact and takes a sixth of each step; \
         flux-new has the flux new and the displacement old in P. Not reached: not within {CAP} iterations.\n"
    );
}

fn reached(iterations: Option<usize>) -> String {
    iterations.map_or("not reached".to_owned(), |k| k.to_string())
}

/// The mesh-free references for people.
pub fn references_text(references: &References) -> String {
    let mut text = String::new();
    for (name, known) in &references.0 {
        let _ = writeln!(text, "{name}");
        let _ = writeln!(
            text,
            "  contact on      {}",
            intervals(&known.contact_set, 13)
        );
        let _ = writeln!(text, "  ‖∇u‖²           {:.12}", known.grad_norm_sq);
        let _ = writeln!(text, "  ‖u‖             {:.12}", known.l2_norm);
        let _ = writeln!(text, "  flux on Γ_C     {:.12}", known.contact_flux);
    }
    text
}

/// `[0, 0.1] ∪ [0.3, 0.4]`; of very many the first ones.
pub(super) fn intervals(set: &[[f64; 2]], digits: usize) -> String {
    let shown = set.iter().take(MOST_INTERVALS);
    let words: Vec<String> = shown
        .map(|[a, b]| format!("[{a:.digits$}, {b:.digits$}]"))
        .collect();
    let more = if set.len() > MOST_INTERVALS {
        format!(" ∪ … ({} in all)", set.len())
    } else {
        String::new()
    };
    words.join(" ∪ ") + &more
}

fn new<T: ToString>(header: &[T]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header.iter().map(ToString::to_string).collect::<Vec<_>>());
    table
}
