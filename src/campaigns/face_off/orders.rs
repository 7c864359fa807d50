//! Observed orders of a field, of each code's error or of two codes' difference.

use super::{OfOrder, OfPair, Player, pairs};
use crate::campaigns::convergence::{Against, Convergence, Level, Order, convergence};
use crate::campaigns::limit::{Found, Limit};
use crate::run::{Asked, FaceOff, Same};
use faceoff_judge::{Norms, Size, Verdict};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Results;

/// An observed order may be so much lower than that of theory.
const LOWER: f64 = 0.25;

/// Of each code's error where the solution is known, else of the codes' differences.
pub(super) fn orders(
    of: &FaceOff,
    players: &[Player],
    asked: &Asked,
    found: &[Vec<Option<Result<Results, String>>>],
    pairs_found: &[OfPair],
) -> Result<Vec<OfOrder>> {
    let mut all = Vec::new();
    let series = |code: usize| -> Option<Vec<Results>> {
        let of_code = found
            .iter()
            .map(|level| level[code].as_ref()?.as_ref().ok().cloned());
        of_code.collect()
    };
    if !asked.exact.is_empty() {
        for (k, player) in players.iter().enumerate() {
            if player.record.is_some() {
                continue;
            }
            let Some(results) = series(k) else { continue };
            let against = Against::Exact(asked.exact.clone());
            let names = std::slice::from_ref(&asked.name);
            for found in convergence(&results, names, &against, &|_| {})? {
                all.push(judged(asked, of, player.name.clone(), found));
            }
        }
    } else if asked.same == Same::Problem {
        for (a, b) in pairs(players) {
            let (Some(results), Some(_)) = (series(a), series(b)) else {
                continue;
            };
            let (name_a, name_b) = (&players[a].name, &players[b].name);
            let of_pair = pairs_found
                .iter()
                .filter(|p| p.a == *name_a && p.b == *name_b);
            let mut levels = Vec::new();
            for (result, pair) in results.iter().zip(of_pair) {
                let Size { cells, h, .. } = Size::of(result)?;
                levels.push(Level {
                    file: result.source.clone(),
                    cells,
                    h,
                    norms: pair.compared.norms,
                    alone: None,
                });
            }
            let order = |pick: fn(&Norms) -> Option<f64>| {
                let errors = levels
                    .iter()
                    .filter_map(|l| Some((l.h, pick(l.norms.as_ref()?)?)));
                let errors: Vec<(f64, f64)> = errors.collect();
                (!errors.is_empty()).then(|| Order::new(&errors))
            };
            let (l2, h1) = (order(|n| Some(n.l2)), order(|n| n.h1));
            let found = Convergence {
                field: asked.name.clone(),
                against: "code",
                l2: l2.unwrap_or_else(|| Order::new(&[])),
                h1,
                levels,
            };
            all.push(judged(asked, of, format!("{name_a} – {name_b}"), found));
        }
    }
    Ok(all)
}

/// An order lower than that of theory disagrees; a higher one is none's fault.
fn judged(asked: &Asked, file: &FaceOff, of: String, found: Convergence) -> OfOrder {
    let fit = |order: Option<&Order>| order.and_then(|o| o.fit).map(|fit| fit.exponent);
    let pairs = [fit(Some(&found.l2)), fit(found.h1.as_ref())];
    let asked_for = asked
        .orders
        .iter()
        .zip(pairs)
        .filter_map(|(theory, fit)| Some(((*theory)?, fit)));
    let limits = limits(asked, &found);
    let verdicts = asked_for.map(|(theory, fit)| match fit {
        Some(fit) if fit >= theory - LOWER => Verdict::Agree,
        Some(_) => Verdict::Disagree,
        None => Verdict::Undetermined,
    });
    OfOrder {
        of,
        n: file.levels(),
        theory: asked.orders,
        verdict: verdicts.chain(limits.iter().flatten().map(verdict)).max(),
        limits,
        found,
    }
}

/// What the errors or differences fall to, in each norm with an order of theory. A tolerance is of two codes in L²: for the error
/// of one code, and in H¹, the bound is that of the limit.
fn limits(asked: &Asked, found: &Convergence) -> [Option<Limit>; 2] {
    let of_codes = found.against == "code";
    let rtol = Some(asked.rtol).filter(|rtol| of_codes && rtol.is_finite());
    let limit = |theory: Option<f64>, pick: fn(&Norms) -> Option<(f64, f64)>, rtol: Option<f64>| {
        let norms = found
            .levels
            .iter()
            .map(|l| Some((l.h, pick(l.norms.as_ref()?)?)));
        let norms = norms.collect::<Option<Vec<_>>>()?;
        let scale = norms.last()?.1.1;
        let levels: Vec<(f64, f64)> = norms.into_iter().map(|(h, (norm, _))| (h, norm)).collect();
        Limit::new(&levels, theory?, scale, rtol, !of_codes)
    };
    let [l2, h1] = asked.orders;
    [
        limit(l2, |n| Some((n.l2, n.l2_scale)), rtol),
        limit(h1, |n| n.h1.zip(n.h1_scale), None),
    ]
}

fn verdict(limit: &Limit) -> Verdict {
    match limit.found {
        Found::Zero => Verdict::Agree,
        Found::Apart => Verdict::Disagree,
        Found::Unknown => Verdict::Undetermined,
    }
}
