//! A number of all codes.

use std::collections::BTreeMap;

use super::{OfNumber, Player, RowOfNumber, Rung, pairs};
use crate::run::{Asked, Same};
use faceoff_judge::Verdict;

/// Every pair on every level, and the exact value.
pub(super) fn judge(players: &[Player], asked: &Asked, rungs: &[Rung]) -> OfNumber {
    let exact = asked.exact.first().map(|e| e.value([0.0; 3]));
    let mut rows = Vec::new();
    for (level, rung) in rungs.iter().enumerate() {
        let is_finest = level + 1 == rungs.len();
        let mut values = BTreeMap::new();
        let mut told: Vec<(Verdict, String)> = Vec::new();
        for (player, left) in players.iter().zip(&rung.left) {
            let name = asked.name_in(player.code.name());
            match left.as_ref().map(|left| left.numbers.get(name)) {
                None => {}
                Some(None) => told.push((
                    Verdict::Undetermined,
                    format!("{} has no number `{name}`", player.name),
                )),
                Some(Some(value)) if !value.is_finite() => {
                    told.push((
                        Verdict::Undetermined,
                        format!("{} has {value}", player.name),
                    ));
                }
                Some(Some(value)) => {
                    values.insert(player.name.clone(), *value);
                }
            }
        }
        for (i, j) in pairs(players) {
            let (name_a, name_b) = (&players[i].name, &players[j].name);
            let (Some(a), Some(b)) = (values.get(name_a), values.get(name_b)) else {
                continue;
            };
            let (far, scale) = ((a - b).abs(), a.abs().max(b.abs()));
            let is_judged =
                asked.same == Same::Discretisation || is_finest && asked.rtol.is_finite();
            if is_judged && far > (asked.rtol * scale).max(asked.atol) {
                told.push((
                    Verdict::Disagree,
                    format!("{name_a} – {name_b}: {:.3e} of it apart", far / scale),
                ));
            }
        }
        if let (Some(exact), Some(rtol), true) = (exact, asked.exact_rtol, is_finest) {
            for (name, value) in &values {
                let far = (value - exact).abs();
                if far > rtol * exact.abs() {
                    let far = far / exact.abs();
                    told.push((
                        Verdict::Disagree,
                        format!("{name} is {far:.3e} of it away from the exact {exact}"),
                    ));
                }
            }
        }
        let verdict = told.iter().map(|(verdict, _)| *verdict).max();
        let alone = if values.len() < 2 {
            Verdict::Undetermined
        } else {
            Verdict::Agree
        };
        rows.push(RowOfNumber {
            n: rung.n,
            values,
            verdict: verdict.unwrap_or(alone),
            reason: told
                .into_iter()
                .map(|(_, why)| why)
                .collect::<Vec<_>>()
                .join("; "),
        });
    }
    OfNumber {
        number: asked.name.clone(),
        verdict: rows
            .iter()
            .map(|row| row.verdict)
            .max()
            .unwrap_or(Verdict::Undetermined),
        exact,
        rows,
    }
}
