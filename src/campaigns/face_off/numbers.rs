//! A number of all codes.

use std::collections::BTreeMap;

use super::{OfNumber, Player, RowOfNumber, Rung, meetings, pairs};
use crate::run::{Asked, Same};
use faceoff_judge::Verdict;

/// Every pair on every level, and the exact value.
pub(super) fn judge(players: &[Player], asked: &Asked, rungs: &[Rung]) -> OfNumber {
    let exact_on = |rung: &Rung| {
        let formula = asked.exact.first()?.at(&rung.parameters, 0.0).ok()?;
        Some(formula.value([0.0; 3]))
    };
    let each = rungs.iter().map(|rung| known(players, asked, rung));
    let all: Vec<BTreeMap<String, f64>> = each.collect();
    let meetings = match meetings::is_asked(asked, rungs) {
        true => meetings::of_number(players, rungs, asked, &all),
        false => Vec::new(),
    };
    let mut rows = Vec::new();
    for (level, rung) in rungs.iter().enumerate() {
        let is_finest = level + 1 == rungs.len();
        let exact = exact_on(rung);
        let is_compared = asked.same == Same::Discretisation || is_finest && asked.rtol.is_finite();
        let against = exact.zip(asked.exact_rtol).filter(|_| is_finest);
        let values = all[level].clone();
        let mut told: Vec<(Verdict, String)> = Vec::new();
        let mut is_settled = false;
        for (player, left) in players.iter().zip(&rung.left) {
            let name = asked.name_in(player.code.name());
            match left.as_ref().map(|left| left.numbers.get(name)) {
                None => {}
                Some(None) => {
                    let why = left.as_ref().and_then(|left| left.numberless.as_ref());
                    let why = why.map_or_else(String::new, |why| format!(": {why}"));
                    told.push((
                        Verdict::Undetermined,
                        format!("{} has no number `{name}`{why}", player.name),
                    ));
                }
                Some(Some(value)) if !value.is_finite() => {
                    told.push((
                        Verdict::Undetermined,
                        format!("{} has {value}", player.name),
                    ));
                }
                Some(Some(_)) => {}
            }
        }
        for (i, j) in pairs(players) {
            let (name_a, name_b) = (&players[i].name, &players[j].name);
            let (Some(a), Some(b)) = (values.get(name_a), values.get(name_b)) else {
                continue;
            };
            let (far, scale) = ((a - b).abs(), a.abs().max(b.abs()));
            if is_compared && far > (asked.rtol * scale).max(asked.atol) {
                // What the limits say counts, and not the error that is left on the finest level.
                let mut of_pair = meetings
                    .iter()
                    .filter(|of| &of.a == name_a && &of.b == name_b);
                if of_pair.any(|of| of.verdict != Verdict::Disagree) {
                    is_settled = true;
                    continue;
                }
                let far = apart(far, scale);
                told.push((
                    Verdict::Disagree,
                    format!("{name_a} – {name_b}: {far} apart"),
                ));
            }
        }
        if let Some((exact, rtol)) = against {
            for (name, value) in &values {
                let far = (value - exact).abs();
                // Not a number is as far as can be.
                if !(far <= (rtol * exact.abs()).max(asked.atol)) {
                    let far = apart(far, exact.abs());
                    let why = format!("{name} is {far} away from the exact {exact}");
                    told.push((Verdict::Disagree, why));
                }
            }
        }
        let verdict = told.iter().map(|(verdict, _)| *verdict).max();
        // A single code is judged by the exact value only.
        let needed = players.len().min(2);
        let is_compared = is_compared && needed == 2;
        let judged = is_compared && !is_settled || against.is_some() || !told.is_empty();
        let alone = if values.len() < needed || !judged {
            Verdict::Undetermined
        } else {
            Verdict::Agree
        };
        rows.push(RowOfNumber {
            n: rung.level.n,
            level: rung.level.label.clone(),
            values,
            judged,
            verdict: verdict.unwrap_or(alone),
            reason: told
                .into_iter()
                .map(|(_, why)| why)
                .collect::<Vec<_>>()
                .join("; "),
        });
    }
    let of_rows = rows.iter().filter(|row| row.judged).map(|row| row.verdict);
    OfNumber {
        number: asked.name.clone(),
        verdict: Verdict::of_all(of_rows.chain(meetings.iter().map(|of| of.verdict))),
        extrapolated: match asked.same {
            Same::Problem => meetings::extrapolated(rungs, &all),
            Same::Discretisation => BTreeMap::new(),
        },
        meetings,
        exact: rungs.last().and_then(exact_on),
        rows,
    }
}

/// The finite numbers on one level, by code.
fn known(players: &[Player], asked: &Asked, rung: &Rung) -> BTreeMap<String, f64> {
    let each = players.iter().zip(&rung.left).filter_map(|(player, left)| {
        let name = asked.name_in(player.code.name());
        let value = left.as_ref()?.numbers.get(name).copied();
        Some((player.name.clone(), value.filter(|x| x.is_finite())?))
    });
    each.collect()
}

/// The difference as a sentence gives it: relative to the larger number, unless that is 0.
fn apart(far: f64, scale: f64) -> String {
    match scale > 0.0 {
        true => format!("{:.3e} of it", far / scale),
        false => format!("{far:.3e}"),
    }
}
