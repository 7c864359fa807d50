//! A field of all codes: taken from what each wrote, and each pair compared.

use super::orders::orders;
use super::{OfField, OfPair, Player, Rung, pairs};
use crate::engine::Left;
use crate::run::{Asked, FaceOff, Same};
use faceoff_judge::{
    ComparedField, Comparison, FieldVerdict, MatchBy, Norms, On, Settings, Tolerance, Tolerances,
    Verdict, compare_results,
};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;

/// The pair that is shown.
pub(super) struct Shown {
    factor: f64,
    pub comparison: Comparison,
    pub of_a: Box<Results>,
}

/// One field of a code, by the name that the file has for it.
pub(super) fn extract(left: &Left, asked: &Asked, code: &str) -> Result<Results, String> {
    let name = asked.name_in(code);
    for of in &left.results {
        let mut of = of.clone();
        if !of.has(name) && !of.derive(name) {
            continue;
        }
        of.keep_only(|known| known == name);
        if let Some(unread) = of.unread.first() {
            return Err(format!(
                "a part of `{name}` of {code} was not read: {unread}"
            ));
        }
        of.rename(name, &asked.name);
        let fields = [
            (On::Points, &of.on_points),
            (On::Cells, &of.on_cells),
            (On::Corners, &of.on_corners),
        ];
        for (on, field) in fields
            .into_iter()
            .flat_map(|(on, all)| all.iter().map(move |f| (on, f)))
        {
            if asked.on.is_some_and(|asked| asked != on) {
                return Err(format!(
                    "`{name}` of {code} is on {}",
                    format!("{on:?}").to_lowercase()
                ));
            }
            // Files have three components of a vector in the plane.
            let same = |n: usize| n == field.components || n == 2 && field.components == 3;
            if asked.components.is_some_and(|n| !same(n)) {
                return Err(format!(
                    "`{name}` of {code} has {} components",
                    field.components
                ));
            }
            if field.values.iter().any(|v| !v.is_finite()) {
                return Err(format!(
                    "`{name}` of {code} has a value that is not a finite number"
                ));
            }
        }
        return Ok(of);
    }
    let mut known: Vec<&str> = left
        .results
        .iter()
        .flat_map(Results::all)
        .map(|f| &*f.name)
        .collect();
    known.dedup();
    let unread = left.results.iter().flat_map(|of| &of.unread);
    if let Some(unread) = unread.clone().find(|part| part.name == name) {
        return Err(format!("`{name}` of {code} was not read: {unread}"));
    }
    Err(format!(
        "{code} has no field `{name}`; it has {}",
        known.join(", ")
    ))
}

/// Every pair on every level, and the orders.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn judge(
    of: &FaceOff,
    players: &[Player],
    asked: &Asked,
    rungs: &[Rung],
    shown: &mut Option<Shown>,
) -> Result<OfField> {
    // A level by a code.
    let found: Vec<Vec<Option<Result<Results, String>>>> = rungs
        .iter()
        .map(|rung| {
            let codes = rung.left.iter().zip(players);
            codes
                .map(|(left, player)| Some(extract(left.as_ref()?, asked, player.code.name())))
                .collect()
        })
        .collect();
    let mut pairs_found = Vec::new();
    for (level, (rung, of_codes)) in rungs.iter().zip(&found).enumerate() {
        let judged = asked.same == Same::Discretisation
            || level + 1 == rungs.len() && asked.rtol.is_finite();
        for (a, b) in pairs(players) {
            cancel::check()?;
            let (Some(of_a), Some(of_b)) = (&of_codes[a], &of_codes[b]) else {
                continue;
            };
            let compared = match (of_a, of_b) {
                (Ok(of_a), Ok(of_b)) => compare(asked, of_a, of_b, judged, shown)?,
                (Err(reason), _) | (_, Err(reason)) => unjudged(asked, reason.clone()),
            };
            pairs_found.push(OfPair {
                a: players[a].name.clone(),
                b: players[b].name.clone(),
                n: rung.n,
                judged: judged || compared.field.reason.is_some(),
                compared,
            });
        }
    }
    let orders = if rungs.len() > 1 {
        orders(of, players, asked, &found, &pairs_found)?
    } else {
        Vec::new()
    };
    let of_pairs = pairs_found
        .iter()
        .filter(|p| p.judged)
        .map(|p| p.compared.field.verdict);
    let of_orders = orders.iter().filter_map(|o| o.verdict);
    Ok(OfField {
        field: asked.name.clone(),
        same: asked.same,
        verdict: of_pairs
            .chain(of_orders)
            .max()
            .unwrap_or(Verdict::Undetermined),
        pairs: pairs_found,
        orders,
    })
}

fn unjudged(asked: &Asked, reason: String) -> ComparedField {
    let rtol = if asked.rtol.is_finite() {
        asked.rtol
    } else {
        0.0
    };
    ComparedField {
        on: On::Functions,
        scale: None,
        rtol,
        atol: asked.atol,
        norms: None,
        single: false,
        field: FieldVerdict::failed(&asked.name, rtol, reason),
    }
}

/// Two answers on one level: equal to rounding, as functions where the files have other cells (a linear function on quadratic
/// ones is the same function), or by the norm of their difference.
pub(super) fn compare(
    asked: &Asked,
    a: &Results,
    b: &Results,
    judged: bool,
    shown: &mut Option<Shown>,
) -> Result<ComparedField> {
    let is_same = asked.same == Same::Discretisation;
    let of_all = Tolerance {
        rtol: if asked.rtol.is_finite() {
            asked.rtol
        } else {
            0.0
        },
        atol: asked.atol,
    };
    let settings = Settings {
        tolerances: Tolerances {
            of_all,
            of_field: Vec::new(),
            is_given: true,
        },
        map: (!is_same).then_some(MatchBy::Functions),
        alone: asked.uncovered,
        ..Settings::default()
    };
    let comparison = match compare_results(a, b, &settings) {
        Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
        Err(error) => return Ok(unjudged(asked, error.to_string())),
        Ok(comparison) => comparison,
    };
    // What one mesh has alone comes as a field of its own, which counts.
    let domain = comparison
        .fields
        .iter()
        .find(|f| f.on == On::Domain && !f.field.verdict.passes());
    if let Some(domain) = domain {
        let reason = domain.field.reason.clone().unwrap_or_default();
        return Ok(unjudged(
            asked,
            format!("{reason}; allow a part by `uncovered`"),
        ));
    }
    let Some(found) = comparison
        .fields
        .iter()
        .position(|f| f.field.field == asked.name)
    else {
        return Ok(unjudged(asked, "it is not in the comparison".into()));
    };
    let mut found = comparison.fields[found].clone();
    if !is_same {
        let norms = found.norms.filter(|n| n.l2.is_finite() && n.l2_scale > 0.0);
        match norms {
            None => {
                return Ok(unjudged(
                    asked,
                    found
                        .field
                        .reason
                        .unwrap_or_else(|| "it has no norm".into()),
                ));
            }
            Some(Norms { l2, l2_scale, .. }) => {
                found.field.max_rel = l2 / l2_scale;
                found.field.verdict = match l2 <= (asked.rtol * l2_scale).max(asked.atol) {
                    true => Verdict::Agree,
                    false => Verdict::Disagree,
                };
            }
        }
    }
    let factor = found.factor();
    if judged && shown.as_ref().is_none_or(|shown| factor > shown.factor) {
        *shown = Some(Shown {
            factor,
            comparison,
            of_a: Box::new(a.clone()),
        });
    }
    Ok(found)
}
