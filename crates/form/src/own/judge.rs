//! Does a result of any code solve a form? The residual of its dofs, by row and by term, with Dirichlet values and means.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::held::{held, means};
use super::places::places;
use super::read::read;
use crate::problem::Problem;

/// What a result leaves of a form.
#[derive(Debug)]
pub struct Judged {
    /// Its dofs.
    pub dofs: usize,
    /// Those that are not given.
    pub free: usize,
    /// The rows of free dofs, the largest error first.
    pub rows: Vec<Row>,
    /// Dirichlet values, the largest error first.
    pub held: Vec<Row>,
    /// Given means: the unknown, and by how much its mean is off, over the mean of its absolute value or the given one.
    pub means: Vec<(usize, f64)>,
    /// The terms of F, in their order.
    pub terms: Vec<Term>,
}

/// An equation, or a given value.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The position of the unknown.
    pub unknown: usize,
    /// Its component; 0 of a vector as a whole.
    pub component: usize,
    /// Where its dof is.
    pub at: [f64; 3],
    /// The residual over the sum of the sizes of what it is made of; of a given value the difference over the largest value.
    pub error: f64,
    /// The residual itself; of a given value the difference.
    pub residual: f64,
    /// The term of F that is largest in this row.
    pub term: usize,
}

/// A term of F.
#[derive(Debug, Clone)]
pub struct Term {
    /// Its text.
    pub text: String,
    /// Its largest row, over the sizes of rows.
    pub largest: f64,
    /// Where there are other terms, and if the code solves the form with this term times a factor: the factor that leaves least, and the part of the residual that it leaves.
    pub factor: Option<(f64, f64)>,
}

/// Puts the fields of a result, which have the names of the unknowns, into a form; `unit` is the relative error with which its numbers were
/// written.
///
/// # Errors
/// A result on another mesh, fields that are not there or are no functions of the spaces, and a form of several steps in time.
pub fn judge(problem: &Problem, source: &Mesh, result: &Mesh, unit: f64) -> Result<Judged> {
    if problem.time.is_some() {
        return Err(Error::usage(
            format!(
                "{} has steps in time, and a result at its end does not say what was before",
                problem.name
            ),
            "compare it with that of another code: faceoff verify",
        ));
    }
    let assembler = Assembler::of(problem, source, &problem.integrals, true)?;
    let u = read(&assembler, result, unit)?;
    let parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
    let held = held(&assembler, source, &parameters)?;
    let state = State {
        u: &u,
        old: &[],
        parameters: &parameters,
    };
    let mut terms = Vec::new();
    let mut residual = vec![0.0; u.len()];
    let mut sizes = vec![0.0; u.len()];
    for k in 0..problem.integrals.len() {
        let system = assembler.assemble_only(k, state, Wanted::Sizes);
        add(&mut residual, &system.residual);
        add(&mut sizes, &system.sizes);
        terms.push(system.residual);
    }
    // Rounding of the dofs goes into the residual by the matrix.
    let matrix = assembler.assemble(state, Wanted::Both).matrix;
    assembler
        .pattern
        .for_rows(&assembler.dofs, |dof, columns, at| {
            let entries = columns.iter().zip(&matrix[at..]);
            sizes[dof] += entries
                .map(|(column, a)| (a * u[*column as usize]).abs())
                .sum::<f64>();
        });
    if let Some(value) = residual.iter().find(|r| !r.is_finite()) {
        return Err(Error::Solver {
            what: format!(
                "with this result the residual of {} is {value}",
                problem.name
            ),
            remedy: "give a result of finite numbers, and check the form for divisions by 0".into(),
        });
    }
    let is_free = |k: usize| !held.is_held[k];
    let dot = |a: &[f64], b: &[f64]| -> f64 {
        (0..a.len())
            .filter(|k| is_free(*k))
            .map(|k| a[k] * b[k])
            .sum()
    };
    // What a multiplier of a mean contributes is a multiple of its row.
    let rows = means(problem, &assembler.mesh, &assembler.dofs);
    let off = problem
        .means
        .iter()
        .zip(&rows)
        .map(|(mean, (row, wanted))| {
            let (sum, size) = row
                .iter()
                .zip(&u)
                .fold((0.0, wanted.abs()), |(sum, size), (r, u)| {
                    (sum + r * u, size + (r * u).abs())
                });
            (
                mean.unknown,
                if size > 0.0 {
                    (sum - wanted).abs() / size
                } else {
                    0.0
                },
            )
        });
    let off: Vec<(usize, f64)> = off.collect();
    for (row, _) in &rows {
        let square = dot(row, row);
        if square > 0.0 {
            let multiplier = dot(&residual, row) / square;
            residual
                .iter_mut()
                .zip(row)
                .for_each(|(r, row)| *r -= multiplier * row);
        }
    }
    let all = places(&assembler);
    let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    let relative = |value: f64, size: f64| {
        if value == 0.0 {
            0.0
        } else {
            value.abs() / size.max(f64::MIN_POSITIVE)
        }
    };
    let (mut free_rows, mut held_rows) = (Vec::new(), Vec::new());
    for (k, (unknown, component, at)) in all.into_iter().enumerate() {
        let row = match is_free(k) {
            true => {
                let sized = terms
                    .iter()
                    .enumerate()
                    .map(|(t, values)| (t, values[k].abs()));
                let most = sized.fold(
                    (0, -1.0),
                    |most, own| if own.1 > most.1 { own } else { most },
                );
                Row {
                    unknown,
                    component,
                    at,
                    error: relative(residual[k], sizes[k]),
                    residual: residual[k],
                    term: most.0,
                }
            }
            false => {
                let difference = u[k] - held.values[k];
                let size = largest.max(held.values[k].abs());
                Row {
                    unknown,
                    component,
                    at,
                    error: relative(difference, size),
                    residual: difference,
                    term: 0,
                }
            }
        };
        if is_free(k) {
            &mut free_rows
        } else {
            &mut held_rows
        }
        .push(row);
    }
    for rows in [&mut free_rows, &mut held_rows] {
        rows.sort_by(|a, b| b.error.total_cmp(&a.error));
    }
    let total = dot(&residual, &residual);
    let texts = texts(problem);
    let term = |(values, text): (&Vec<f64>, String)| {
        let square = dot(values, values);
        let factor = (square > 0.0 && total > 0.0 && terms.len() > 1).then(|| {
            let c = -dot(&residual, values) / square;
            let left: f64 = (0..u.len())
                .filter(|k| is_free(*k))
                .map(|k| (residual[k] + c * values[k]).powi(2))
                .sum();
            (1.0 + c, (left / total).sqrt())
        });
        let rows = (0..u.len()).filter(|k| is_free(*k));
        let largest = rows
            .map(|k| relative(values[k], sizes[k]))
            .fold(0.0, f64::max);
        Term {
            text,
            largest,
            factor,
        }
    };
    Ok(Judged {
        dofs: u.len(),
        free: free_rows.len(),
        rows: free_rows,
        held: held_rows,
        means: off,
        terms: terms.iter().zip(texts).map(term).collect(),
    })
}

fn add(sum: &mut [f64], values: &[f64]) {
    sum.iter_mut()
        .zip(values)
        .for_each(|(sum, value)| *sum += value);
}

/// The text of each term of F, on one line.
fn texts(problem: &Problem) -> Vec<String> {
    let chars: Vec<char> = problem.form.0.chars().collect();
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
