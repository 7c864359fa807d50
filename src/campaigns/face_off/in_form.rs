//! Where codes disagree on a form, the result of each put into it: which of them solve it, and what the others solve.

use serde::Serialize;

use super::{OfField, OfSpectrum, Player, Rung, eigen};
use crate::engine::{Left, with};
use crate::run::{FaceOff, Label};
use crate::why::InForm;
use faceoff_form::Problem;
use faceoff_judge::Verdict;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

/// The result of a code in the form.
#[derive(Debug, Serialize)]
pub struct OfForm {
    /// The code.
    pub code: String,
    /// As in the runs.
    pub level: Label,
    /// What was found.
    #[serde(flatten)]
    pub found: Option<InForm>,
    /// Why it cannot be put into the form.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

impl OfForm {
    /// What was found, if it does not solve the form.
    pub fn wrong(&self) -> Option<&InForm> {
        self.found.as_ref().filter(|found| !found.verdict.passes())
    }
}

/// Of each code that has a result; none where the codes agree, or where the form has steps in time.
///
/// # Errors
/// A mesh that cannot be made.
pub(super) fn judge(
    of: &FaceOff,
    players: &[Player],
    rungs: &[Rung],
    (fields, spectra): (&[OfField], &[OfSpectrum]),
) -> Result<Vec<OfForm>> {
    let Some(form) = of.form.as_ref().filter(|form| form.time.is_none()) else {
        return Ok(Vec::new());
    };
    if form.eigen.is_some() {
        return of_modes(of, form, players, rungs, spectra);
    }
    let differs = |rung: &&Rung| {
        let mut pairs = fields.iter().flat_map(|field| &field.pairs);
        pairs.any(|pair| {
            let verdict = pair.compared.field.verdict;
            pair.level == rung.level.label && pair.judged && verdict == Verdict::Disagree
        })
    };
    let Some(rung) = rungs.iter().find(differs) else {
        return Ok(Vec::new());
    };
    let Some(mesh) = of.mesh(rung.level.n)? else {
        return Ok(Vec::new());
    };
    let form = with(form, &rung.parameters);
    let each = players.iter().zip(&rung.left).filter_map(|(player, left)| {
        let ask = |result: &Mesh, _| InForm::new(&form, &mesh, result);
        let found = of.first(player.code, left.as_ref()?, ask);
        let refused = found.as_ref().err().map(ToString::to_string);
        Some(OfForm {
            code: player.name.clone(),
            level: rung.level.label.clone(),
            found: found.ok(),
            refused,
        })
    });
    Ok(each.collect())
}

/// Of each code whose modes do not solve an eigenproblem: the worst of them.
fn of_modes(
    of: &FaceOff,
    form: &Problem,
    players: &[Player],
    rungs: &[Rung],
    spectra: &[OfSpectrum],
) -> Result<Vec<OfForm>> {
    let mut all = Vec::new();
    let wrong = spectra.iter().flat_map(|found| &found.residuals);
    let mut wrong = wrong
        .filter(|row| row.verdict == Verdict::Disagree)
        .peekable();
    let (Some(asked), Some(first)) = (of.spectra.first(), wrong.peek()) else {
        return Ok(all);
    };
    let level = first.level.clone();
    let Some(rung) = rungs.iter().find(|rung| rung.level.label == level) else {
        return Ok(all);
    };
    let Some(mesh) = of.mesh(rung.level.n)? else {
        return Ok(all);
    };
    let form = with(form, &rung.parameters);
    for row in wrong.filter(|row| row.level == level) {
        let mut each = players.iter().zip(&rung.left);
        let is_it = |(player, _): &(&Player, &Option<Left>)| player.name == row.code;
        let Some((player, Some(left))) = each.find(is_it) else {
            continue;
        };
        let value = row.value.unwrap_or(f64::NAN);
        let found = eigen::explain(of, asked, (&form, &mesh), player, left, value);
        let refused = found.as_ref().err().map(ToString::to_string);
        all.push(OfForm {
            code: row.code.clone(),
            level: level.clone(),
            found: found.ok(),
            refused,
        });
    }
    Ok(all)
}
