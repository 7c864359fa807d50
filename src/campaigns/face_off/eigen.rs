//! How well the eigenvalues and modes of each code solve the eigenproblem of a form: its own matrices are not asked for, ours judge them.

use serde::Serialize;

use super::times::short;
use super::{Player, Rung};
use crate::engine::{Left, with};
use crate::run::{Code, FaceOff, Label, Spectrum};
use crate::why::InForm;
use faceoff_form::Problem;
use faceoff_form::own::{Pair, Pencil};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

/// What a residual may be where the file does not say how far apart modes may be: all codes have one mesh and one space.
const ALLOWED: f64 = 1e-6;

/// The pair of a code that solves an eigenproblem worst.
#[derive(Debug, Serialize)]
pub struct OfResidual {
    /// The code.
    pub code: String,
    /// As in the runs.
    pub level: Label,
    /// How many pairs were looked at.
    pub pairs: usize,
    /// Whether all of them solve it.
    pub verdict: Verdict,
    /// The eigenvalue of the worst one.
    pub value: Option<f64>,
    /// ‖Au - λMu‖ of that one, relative to ‖Au‖ + (|λ| + |λ - σ|) ‖Mu‖ with the shift σ; infinite where it is not a number.
    pub residual: Option<f64>,
    /// The largest value of a mode that Dirichlet conditions make 0, relative to its largest.
    pub dirichlet: Option<f64>,
    /// What both may be.
    pub allowed: f64,
    /// What is wrong, or why there is no verdict; else empty.
    pub reason: String,
}

/// Of every code on every level; none where the file has no eigenproblem.
///
/// # Errors
/// A mesh that cannot be made; [`Error::Ended`].
pub(super) fn judge(
    of: &FaceOff,
    asked: &Spectrum,
    players: &[Player],
    rungs: &[Rung],
) -> Result<Vec<OfResidual>> {
    let Some(form) = of.form.as_ref().filter(|form| form.eigen.is_some()) else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for rung in rungs {
        let Some(mesh) = of.mesh(rung.level.n)? else {
            continue;
        };
        let pencil = Pencil::new(&with(form, &rung.parameters), &mesh);
        if let Err(Error::Ended(cause)) = pencil {
            return Err(Error::Ended(cause));
        }
        for (player, left) in players.iter().zip(&rung.left) {
            let Some(left) = left else { continue };
            let found = match &pencil {
                Ok(pencil) => pairs(of, asked, form, player.code, left, pencil),
                Err(error) => Err(Error::usage(error.to_string(), "change the form")),
            };
            all.push(row(player, rung, asked, found));
        }
    }
    Ok(all)
}

fn row(player: &Player, rung: &Rung, asked: &Spectrum, found: Result<Vec<Pair>>) -> OfResidual {
    let allowed = asked.angle.unwrap_or(ALLOWED);
    let mut row = OfResidual {
        code: player.name.clone(),
        level: rung.level.label.clone(),
        pairs: 0,
        verdict: Verdict::Undetermined,
        value: None,
        residual: None,
        dirichlet: None,
        allowed,
        reason: String::new(),
    };
    let pairs = match found {
        Ok(pairs) => pairs,
        Err(error) => {
            row.reason = error.to_string();
            return row;
        }
    };
    row.pairs = pairs.len();
    let worst = pairs
        .iter()
        .max_by(|x, y| x.residual.total_cmp(&y.residual));
    let held = pairs.iter().map(|pair| pair.held).max_by(f64::total_cmp);
    let (Some(worst), Some(held)) = (worst, held) else {
        row.reason = "it has no eigenvalues".to_owned();
        return row;
    };
    (row.value, row.residual, row.dirichlet) =
        (Some(worst.value), Some(worst.residual), Some(held));
    let mut told = Vec::new();
    // Negated so that NaN fails.
    if !(worst.residual <= allowed) {
        told.push(format!(
            "{} with its mode leaves {:.3e} of Au = λMu",
            short(worst.value),
            worst.residual
        ));
    }
    if !(held <= allowed) {
        told.push(format!(
            "a mode that Dirichlet conditions hold at 0 has {held:.3e} of its largest value there"
        ));
    }
    row.verdict = match told.is_empty() {
        true => Verdict::Agree,
        false => Verdict::Disagree,
    };
    row.reason = told.join("; ");
    row
}

/// All pairs that a code wrote.
fn pairs(
    of: &FaceOff,
    asked: &Spectrum,
    form: &Problem,
    code: &Code,
    left: &Left,
    pencil: &Pencil,
) -> Result<Vec<Pair>> {
    let values = values(asked, code, left);
    of.first(code, left, |result, unit| {
        let each = values.iter().map(|(value, number)| {
            let mode = mode(asked, form, code, result, number);
            pencil.pair(*value, &mode, unit)
        });
        each.collect()
    })
}

/// The eigenvalues of a code, with the text behind each name that its mode has too.
fn values(asked: &Spectrum, code: &Code, left: &Left) -> Vec<(f64, String)> {
    let (values, _) = asked.names_in(code.name());
    let numbers = left.numbers.iter();
    let numbers = numbers.filter_map(|(name, value)| {
        let number = name.strip_prefix(values)?;
        number.parse::<usize>().ok()?;
        Some((*value, number.to_owned()))
    });
    numbers.collect()
}

/// One mode, with the name of the unknown.
fn mode(asked: &Spectrum, form: &Problem, code: &Code, result: &Mesh, number: &str) -> Mesh {
    let (_, modes) = asked.names_in(code.name());
    let modes = modes.unwrap_or_default();
    let name = match modes.contains('*') {
        true => modes.replace('*', number),
        false => modes.to_owned() + number,
    };
    let mut mesh = Mesh {
        fields: Vec::new(),
        ..result.clone()
    };
    let field = result.fields.iter().find(|field| field.name == name);
    if let (Some(field), Some(unknown)) = (field, form.unknowns.first()) {
        let mut field = field.clone();
        field.name.clone_from(&unknown.name);
        mesh.fields.push(field);
    }
    mesh
}

/// How many pairs of a code are searched for the problem that it solves instead.
const LOOKED_AT: usize = 12;

/// Pairs of a code in the form a(u, v) - λ m(u, v), the worst and others, and what they solve instead: what most of them do, as one mode may not
/// show all of a fault.
///
/// # Errors
/// As [`InForm::new`]; no eigenvalues.
pub(super) fn explain(
    of: &FaceOff,
    asked: &Spectrum,
    (form, mesh): (&Problem, &Mesh),
    player: &Player,
    left: &Left,
    worst: f64,
) -> Result<InForm> {
    let code = player.code;
    let mut all = values(asked, code, left);
    all.sort_by(|x, y| {
        let is_other = |(value, _): &(f64, String)| *value != worst;
        is_other(x).cmp(&is_other(y)).then(x.0.total_cmp(&y.0))
    });
    let mut found: Vec<InForm> = Vec::new();
    for (value, number) in all.iter().take(LOOKED_AT) {
        found.push(of.first(code, left, |result, _| {
            let mode = mode(asked, form, code, result, number);
            InForm::new(&form.pencil(*value), mesh, &mode)
        })?);
    }
    let words = |found: &InForm| found.cause().map(ToString::to_string);
    let causes: Vec<Option<String>> = found.iter().map(words).collect();
    let count = |k: usize| causes.iter().filter(|cause| **cause == causes[k]).count();
    let known = (0..found.len()).filter(|k| causes[*k].is_some());
    // Of several the first, where the worst is.
    let best = known.rev().max_by_key(|k| count(*k)).unwrap_or(0);
    if best < found.len() {
        return Ok(found.swap_remove(best));
    }
    let what = format!("{} has no eigenvalues", player.name);
    Err(Error::usage(what, "let it write them"))
}
