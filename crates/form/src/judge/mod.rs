//! Decides whether a result of any code solves a form: the residual of its dofs, by row and by term, with Dirichlet values and means; and if
//! not, which changed form it solves.
//!
//! Every known change is a vector: its contribution to the residual at the result. The fewest of them that leave only rounding are
//! the cause ([`Explanation`]).

mod change;
mod dictionary;
mod explain;
mod given;
mod known;
mod local;
pub mod recovery;
mod residual;
mod stated;

use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

pub use change::{Cause, Change, Digits, Explanation, Given, Interpolated, Part, Penalty, Size};
use residual::{Residual, largest};
pub use stated::{Equations, equations};

use crate::own::places;
use crate::problem::Problem;

/// The judgement of a result in a form.
#[derive(Debug)]
pub struct Judged {
    /// The number of its dofs.
    pub dofs: usize,
    /// The number of those that are not prescribed.
    pub free: usize,
    /// The rows of free dofs, the largest error first.
    pub rows: Vec<Row>,
    /// Dirichlet values, the largest error first.
    pub held: Vec<Row>,
    /// Prescribed means: the unknown, and the error of its mean, relative to the mean of its absolute value or the prescribed one.
    pub means: Vec<(usize, f64)>,
    /// The terms of F, in their order.
    pub terms: Vec<Term>,
    /// The change to the form that the result solves; `None` if it solves the given form, or none is known.
    pub explanation: Option<Explanation>,
    /// The values that replace the Dirichlet values: a change for each condition, if all are known.
    pub given: Vec<Cause>,
}

/// An equation, or a prescribed value.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The position of the unknown.
    pub unknown: usize,
    /// Its component; 0 for a vector as a whole.
    pub component: usize,
    /// The position of its dof.
    pub at: [f64; 3],
    /// The residual relative to the sum of the absolute values of its terms; for a prescribed value the difference relative to the largest value.
    pub error: f64,
    /// The residual; for a prescribed value the difference.
    pub residual: f64,
    /// The term of F that is largest in this row.
    pub term: usize,
}

/// A term of F.
#[derive(Debug, Clone)]
pub struct Term {
    /// Its text.
    pub text: String,
    /// Its largest row, relative to the sizes of the rows.
    pub largest: f64,
}

/// Substitutes the fields of a result, which have the names of the unknowns, into a form; `unit` is the relative precision of its numbers
/// in the file.
///
/// # Errors
/// A result on another mesh, fields that are missing or are not functions of the spaces, and a form of several time steps.
pub fn judge(problem: &Problem, source: &Mesh, result: &Mesh, unit: f64) -> Result<Judged> {
    let residual = Residual::new(problem, source, result, unit)?;
    let (rows, held) = rows(&residual);
    Ok(Judged {
        dofs: residual.u.len(),
        free: rows.len(),
        rows,
        held,
        means: off_means(&residual),
        terms: terms(&residual),
        explanation: explanation(&residual, unit),
        given: given::explain(&residual, unit),
    })
}

/// The terms of F, in their order.
fn terms(residual: &Residual<'_>) -> Vec<Term> {
    let terms = residual.terms.iter().zip(texts(residual.problem));
    let terms = terms.map(|(values, text)| {
        let all = values.iter().zip(&residual.sizes);
        let largest = all.fold(0.0_f64, |most, (r, size)| most.max(relative(*r, *size)));
        Term { text, largest }
    });
    terms.collect()
}

/// A change of the form, or else one of the values.
fn explanation(residual: &Residual<'_>, unit: f64) -> Option<Explanation> {
    if largest(&explain::wanted(residual, &residual.values)) <= explain::limit(unit) {
        return None;
    }
    let found = explain::explain(residual, unit);
    match found.as_ref().is_some_and(|found| found.is_exact) {
        true => found,
        false => known::explain(residual, unit).or(found),
    }
}

fn relative(value: f64, size: f64) -> f64 {
    if value == 0.0 {
        0.0
    } else {
        value.abs() / size.max(f64::MIN_POSITIVE)
    }
}

/// The rows of free and of prescribed dofs, the largest error first.
fn rows(residual: &Residual<'_>) -> (Vec<Row>, Vec<Row>) {
    let (u, held) = (&residual.u, &residual.held);
    let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    let (mut free_rows, mut held_rows) = (Vec::new(), Vec::new());
    for (k, (unknown, component, at)) in places(&residual.assembler).into_iter().enumerate() {
        let sized = residual.terms.iter().map(|values| values[k].abs());
        let most = sized.enumerate().fold(
            (0, -1.0),
            |most, own| if own.1 > most.1 { own } else { most },
        );
        let (values, size, rows) = match held.is_held[k] {
            false => (residual.values[k], residual.sizes[k], &mut free_rows),
            true => {
                let size = largest.max(held.values[k].abs());
                (u[k] - held.values[k], size, &mut held_rows)
            }
        };
        rows.push(Row {
            unknown,
            component,
            at,
            error: relative(values, size),
            residual: values,
            term: most.0,
        });
    }
    for rows in [&mut free_rows, &mut held_rows] {
        rows.sort_by(|a: &Row, b: &Row| b.error.total_cmp(&a.error));
    }
    (free_rows, held_rows)
}

/// The errors of prescribed means.
fn off_means(residual: &Residual<'_>) -> Vec<(usize, f64)> {
    let means = residual.problem.means.iter().zip(&residual.means);
    let off = means.map(|(mean, (row, wanted))| {
        let all = row.iter().zip(&residual.u).map(|(r, u)| r * u);
        let (sum, size) = all.fold((0.0, wanted.abs()), |(sum, size), part| {
            (sum + part, size + part.abs())
        });
        (mean.unknown, relative(sum - wanted, size))
    });
    off.collect()
}

/// The text of each term of F, on one line.
fn texts(problem: &Problem) -> Vec<String> {
    let chars: Vec<char> = problem.form.source.chars().collect();
    let ends = problem
        .integrals
        .iter()
        .skip(1)
        .map(|i| i.at)
        .chain([chars.len()]);
    let text = |(from, to): (usize, usize)| {
        let text: String = chars[from.min(chars.len())..to.max(from).min(chars.len())]
            .iter()
            .collect();
        let words: Vec<&str> = text.split_whitespace().collect();
        words.join(" ").trim_end_matches(['+', '-', ' ']).to_owned()
    };
    problem
        .integrals
        .iter()
        .map(|i| i.at)
        .zip(ends)
        .map(text)
        .collect()
}
