//! A field of all codes: taken from what each wrote, and each pair compared at each time.

use std::borrow::Cow;

use super::meetings;
use super::orders::orders;
use super::times::{of_one, rows};
use super::{OfField, OfPair, Player, Rung, pairs};
use crate::engine::{Left, Written};
use crate::run::convergence::Level as Step;
use crate::run::{Asked, Level, Same};
use faceoff_judge::{
    ComparedField, Comparison, FieldVerdict, MatchBy, Norms, On, Settings, Size, Tolerance,
    Tolerances, Verdict, compare_results, derive, error_up_to,
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

/// The file of a code that has a field: at its last time, as all files are open there.
pub(super) fn file_of<'a>(
    left: &'a Left,
    asked: &Asked,
    code: &str,
) -> Result<&'a Written, String> {
    if let Some(found) = left.on_facets.get(&asked.name) {
        let found = found.as_ref().map(|facets| &facets.written);
        return found.map_err(|why| format!("`{}` of {code}: {why}", asked.name));
    }
    let name = asked.name_in(code);
    let last = |file: &Written| file.at(file.times.len() - 1).map_err(|e| e.to_string());
    let (mut known, mut unread) = (Vec::new(), None);
    for file in &left.results {
        let of = last(file)?;
        if of.has(name)
            || derive(&mut Results::clone(&of), name, file.grid.as_deref()).unwrap_or(true)
        {
            return Ok(file);
        }
        known.extend(of.all().map(|field| field.name.clone()));
        let part = of.unread.iter().find(|part| part.name == name);
        unread = unread.or(part.map(ToString::to_string));
    }
    known.dedup();
    if let Some(unread) = unread {
        return Err(format!("`{name}` of {code} was not read: {unread}"));
    }
    let known = known.join(", ");
    Err(format!("{code} has no field `{name}`; it has {known}"))
}

/// One field of a code at one of its times, by the name that the file has for it.
pub(super) fn extract(
    file: &Written,
    k: usize,
    asked: &Asked,
    code: &str,
) -> Result<Results, String> {
    let name = asked.name_in(code);
    let mut of = Results::clone(&*file.at(k).map_err(|error| error.to_string())?);
    let is_known = of.has(name)
        || derive(&mut of, name, file.grid.as_deref()).map_err(|error| error.to_string())?;
    if !is_known {
        return Err(format!("{code} has no field `{name}` then"));
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
    Ok(of)
}

/// A code and what it left, as the two that are compared.
pub(super) struct Side<'a> {
    /// As reports call it.
    pub name: &'a str,
    /// As the file calls it.
    pub code: &'a str,
    pub left: &'a Left,
}

/// Two answers on one level, at each time that is judged.
pub(super) fn over_times(
    asked: &Asked,
    [a, b]: [&Side; 2],
    judged: bool,
    shown: &mut Option<Shown>,
) -> Result<Vec<(Option<f64>, ComparedField)>> {
    let files =
        file_of(a.left, asked, a.code).and_then(|of_a| Ok([of_a, file_of(b.left, asked, b.code)?]));
    let [of_a, of_b] = match files {
        Ok(files) => files,
        Err(reason) => return Ok(vec![(None, unjudged(asked, reason))]),
    };
    let rows = rows(&asked.times, [a.name, b.name], [&of_a.times, &of_b.times]);
    let asked = &to_rounding(asked, [a.left, b.left]);
    let mut found = Vec::with_capacity(rows.len());
    for row in rows {
        cancel::check()?;
        let both = row.both.and_then(|[i, j]| {
            Ok([
                extract(of_a, i, asked, a.code)?,
                extract(of_b, j, asked, b.code)?,
            ])
        });
        let compared = match both {
            Ok([of_a, of_b]) => compare(asked, &of_a, &of_b, judged, shown)?,
            Err(reason) => unjudged(asked, reason),
        };
        found.push((row.t, compared));
    }
    Ok(found)
}

/// A field on facets is also equal to rounding where its difference is no larger than such a difference of the dofs makes it.
fn to_rounding<'a>(asked: &'a Asked, of: [&Left; 2]) -> Cow<'a, Asked> {
    let scale = |left: &Left| {
        let facets = left.on_facets.get(&asked.name)?.as_ref().ok()?;
        // With an infinite one everything would be rounding.
        facets.scale.is_finite().then_some(facets.scale)
    };
    let [Some(a), Some(b)] = of.map(scale) else {
        return Cow::Borrowed(asked);
    };
    Cow::Owned(Asked {
        atol: asked.atol.max(asked.rtol * a.min(b)),
        ..asked.clone()
    })
}

/// The time at which two are farthest from agreement.
pub fn worst<'a>(pairs: impl IntoIterator<Item = &'a OfPair>) -> Option<&'a OfPair> {
    pairs.into_iter().max_by(|p, q| {
        let key = |p: &OfPair| ((p.judged, p.compared.field.verdict), p.compared.factor());
        let ((v, x), (w, y)) = (key(p), key(q));
        // Of several that are alike the first.
        v.cmp(&w)
            .then(x.total_cmp(&y))
            .then(std::cmp::Ordering::Greater)
    })
}

/// Every pair on every level at every time, and the orders.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn judge(
    players: &[Player],
    asked: &Asked,
    rungs: &[Rung],
    shown: &mut Option<Shown>,
) -> Result<OfField> {
    let mut pairs_found = Vec::new();
    for (k, rung) in rungs.iter().enumerate() {
        let judged =
            asked.same == Same::Discretisation || k + 1 == rungs.len() && asked.rtol.is_finite();
        for (a, b) in pairs(players) {
            let [Some(of_a), Some(of_b)] = [a, b].map(|k| side(players, rung, k)) else {
                continue;
            };
            for (t, compared) in over_times(asked, [&of_a, &of_b], judged, shown)? {
                pairs_found.push(OfPair {
                    a: of_a.name.to_owned(),
                    b: of_b.name.to_owned(),
                    n: rung.level.n,
                    level: rung.level.label.clone(),
                    t,
                    judged: judged || compared.field.reason.is_some(),
                    compared,
                });
            }
        }
    }
    let mut found = Vec::new();
    if rungs.len() > 1 {
        let levels: Vec<&Level> = rungs.iter().map(|rung| &rung.level).collect();
        for (of, against, steps) in errors(players, asked, rungs, &pairs_found)? {
            found.push(orders(asked, &levels, of, against, steps)?);
        }
    }
    let mut meetings = Vec::new();
    if let Some(finest) = rungs.last().filter(|_| meetings::is_asked(asked, rungs)) {
        let of = |k: usize, rung: &Rung| {
            let of = side(players, rung, k)?;
            let file = file_of(of.left, asked, of.code).ok()?;
            let last = *of_one(&asked.times, &file.times).last()?;
            extract(file, last, asked, of.code).ok()
        };
        let is_of =
            |p: &OfPair, a: &str, b: &str| p.level == finest.level.label && p.a == a && p.b == b;
        let verdict = |a: &str, b: &str| {
            let mut all = pairs_found.iter().filter(|p| is_of(p, a, b));
            let only = all.next().map(|p| p.compared.field.verdict);
            // Of several times each is judged by itself.
            only.filter(|_| all.next().is_none())
        };
        meetings = meetings::of_field(players, rungs, asked, &of, &verdict)?;
        // What the limits say counts, and not the error that is left on the finest level.
        for pair in &mut pairs_found {
            let mut of_pair = meetings.iter().filter(|of| is_of(pair, &of.a, &of.b));
            let is_settled = of_pair.any(|of| of.verdict != Verdict::Disagree);
            let differs = pair.compared.field.verdict == Verdict::Disagree;
            pair.judged &= !(is_settled && differs);
        }
    }
    let of_pairs = pairs_found
        .iter()
        .filter(|p| p.judged)
        .map(|p| p.compared.field.verdict);
    let of_orders = found.iter().filter_map(|o| o.verdict);
    let of_meetings = meetings.iter().map(|of| of.verdict);
    Ok(OfField {
        field: asked.name.clone(),
        same: asked.same,
        up_to: asked.up_to.clone(),
        times: asked.times.clone(),
        errors_of: errors_of(players, asked, rungs),
        verdict: Verdict::of_all(of_pairs.chain(of_orders).chain(of_meetings)),
        pairs: pairs_found,
        orders: found,
        meetings,
    })
}

pub(super) fn side<'a>(players: &'a [Player], rung: &'a Rung, k: usize) -> Option<Side<'a>> {
    Some(Side {
        name: &players[k].name,
        code: players[k].code.name(),
        left: rung.left[k].as_ref()?,
    })
}

/// Of which times errors are taken, where a result has several that are judged.
fn errors_of(players: &[Player], asked: &Asked, rungs: &[Rung]) -> Option<&'static str> {
    let has_several = |rung: &Rung| {
        (0..players.len()).any(|k| {
            let file = side(players, rung, k).and_then(|of| file_of(of.left, asked, of.code).ok());
            file.is_some_and(|file| of_one(&asked.times, &file.times).len() > 1)
        })
    };
    let is_last = !asked.exact.is_empty() && !asked.exact.iter().any(|f| f.has_time);
    rungs.iter().any(has_several).then_some(match is_last {
        true => "the last time, as exact has no t",
        false => "the time at which they are largest",
    })
}

/// Whose error or difference has an order, what it is against, and its norms on each level: the largest over the times, or,
/// where the exact solution is of no time, those of the last.
type Errors = Vec<(String, &'static str, Vec<Step>)>;

fn errors(
    players: &[Player],
    asked: &Asked,
    rungs: &[Rung],
    pairs_found: &[OfPair],
) -> Result<Errors> {
    let mut all = Vec::new();
    // Each level, unless one is missing.
    let steps = |k: usize, norms: &dyn Fn(&Rung, &Side) -> Result<Option<Norms>>| {
        let mut steps = Vec::with_capacity(rungs.len());
        for rung in rungs {
            cancel::check()?;
            let Some(of) = side(players, rung, k) else {
                return Ok(None);
            };
            let Ok(file) = file_of(of.left, asked, of.code) else {
                return Ok(None);
            };
            let last = file.times.len() - 1;
            let (Ok(results), Some(norms)) =
                (extract(file, last, asked, of.code), norms(rung, &of)?)
            else {
                return Ok(None);
            };
            let Size { cells, h, measure } = Size::of(&results)?;
            steps.push(Step {
                file: results.source,
                cells,
                h,
                measure,
                norms: Some(norms),
                alone: None,
            });
        }
        Ok::<_, Error>(Some(steps))
    };
    if !asked.exact.is_empty() {
        let live = players.iter().enumerate();
        for (k, player) in live.filter(|(_, player)| player.record.is_none()) {
            if let Some(steps) = steps(k, &|rung, of| error(asked, rung, of))? {
                all.push((player.name.clone(), "exact", steps));
            }
        }
    } else if asked.same == Same::Problem {
        for (a, b) in pairs(players) {
            let [name_a, name_b] = [a, b].map(|k| &players[k].name);
            let of_level = |rung: &Rung, _: &Side| {
                let of_pair = pairs_found
                    .iter()
                    .filter(|p| [&p.a, &p.b] == [name_a, name_b] && p.level == rung.level.label);
                let norms = of_pair.filter_map(|p| p.compared.norms);
                Ok::<_, Error>(norms.reduce(larger))
            };
            let both = [steps(a, &of_level)?, steps(b, &of_level)?];
            if let [Some(steps), Some(_)] = both {
                all.push((format!("{name_a} – {name_b}"), "code", steps));
            }
        }
    }
    Ok(all)
}

/// ‖u_h - u‖ of a code; none where it has no such field.
pub(super) fn error(asked: &Asked, rung: &Rung, of: &Side) -> Result<Option<Norms>> {
    let Ok(file) = file_of(of.left, asked, of.code) else {
        return Ok(None);
    };
    let mut judged = of_one(&asked.times, &file.times);
    let needs_time = asked.exact.iter().any(|formula| formula.has_time);
    if !needs_time {
        judged.drain(..judged.len().saturating_sub(1));
    }
    let mut largest: Option<Norms> = None;
    for k in judged {
        cancel::check()?;
        let Ok(results) = extract(file, k, asked, of.code) else {
            return Ok(None);
        };
        let refuse = |what: String, remedy: &str| {
            Error::usage(format!("`{}` of {}: {what}", asked.name, of.name), remedy)
        };
        let t = match file.times[k] {
            None if needs_time => {
                let what = "exact has t, and its result is of no time".to_owned();
                return Err(refuse(
                    what,
                    "write results with their times, or put the time in for t",
                ));
            }
            t => t.unwrap_or_default(),
        };
        let exact = asked.exact.iter();
        let exact = exact.map(|formula| formula.at(&rung.parameters, t));
        let exact = exact
            .collect::<Result<Vec<_>, String>>()
            .map_err(|what| refuse(what, "give a formula in x, y, z and t"))?;
        let value = |x: [f64; 3], component: usize| exact[component].with_gradient(x);
        let (norms, _) = error_up_to(&results, &asked.name, exact.len(), &value, &asked.up_to)?;
        largest = Some(largest.map_or(norms, |before| larger(before, norms)));
    }
    Ok(largest)
}

/// Of each norm the larger one, with its scale.
fn larger(a: Norms, b: Norms) -> Norms {
    let (of_l2, of_h1) = (
        if b.l2 > a.l2 { b } else { a },
        if b.h1 > a.h1 { b } else { a },
    );
    Norms {
        l2: of_l2.l2,
        l2_scale: of_l2.l2_scale,
        h1: of_h1.h1,
        h1_scale: of_h1.h1_scale,
    }
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
        removed: Vec::new(),
        equal_after: Vec::new(),
        field: FieldVerdict::failed(&asked.name, rtol, reason),
    }
}

/// Two answers on one level: equal to rounding, as functions where the files have other cells (a linear function on quadratic
/// ones is the same function), or by the norm of their difference.
fn compare(
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
        up_to: vec![(asked.name.clone(), asked.up_to.clone())],
        ..Settings::default()
    };
    let comparison = match compare_results(a, b, &settings) {
        Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
        Err(error) => return Ok(unjudged(asked, error.to_string())),
        Ok(comparison) => comparison,
    };
    // What only one mesh has is a separate field, which counts.
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
        let norms = found.norms.filter(|n| n.l2.is_finite());
        match norms {
            None => {
                let reason = found.field.reason;
                let reason = reason.unwrap_or_else(|| "it has no norm".into());
                return Ok(unjudged(asked, reason));
            }
            Some(Norms { l2_scale, .. }) if l2_scale == 0.0 && asked.atol == 0.0 => {
                let reason = "it is 0 in both, and nothing is small beside that: give atol".into();
                return Ok(unjudged(asked, reason));
            }
            Some(Norms { l2, l2_scale, .. }) => {
                let is_zero = l2_scale == 0.0;
                found.field.max_rel = if is_zero { 0.0 } else { l2 / l2_scale };
                if asked.rtol.is_finite() && !is_zero {
                    found.field.tolerance = asked.rtol.max(asked.atol / l2_scale);
                }
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
