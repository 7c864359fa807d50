//! What codes that share the problem only converge to: fields by the distances of their results on all levels, numbers likewise.

use std::cell::RefCell;
use std::collections::BTreeMap;

use serde::Serialize;

use super::{Label, Player, Rung, pairs};
use crate::run::Asked;
use crate::run::convergence::{Found, Meeting};
use crate::text::{Text, text};
use faceoff_judge::{MatchBy, Settings, Size, Verdict, compare_results};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Results;

/// How many of the finest levels are used.
const LEVELS: usize = 4;

/// Distances, with the size of what they are between, by code and level of either.
type Known = BTreeMap<[[usize; 2]; 2], Option<[f64; 2]>>;

/// Two codes on finer and finer levels.
#[derive(Debug, Serialize)]
pub struct OfMeeting {
    /// The first code.
    pub a: String,
    /// The second.
    pub b: String,
    /// Whether they converge to the same thing; where that is not known, the finest level decides if it agrees.
    pub verdict: Verdict,
    /// What was found.
    #[serde(flatten)]
    pub found: Meeting,
}

impl OfMeeting {
    /// `a and b converge to each other …`
    pub fn words(&self) -> Text {
        let words = self.found.words([&self.a, &self.b]);
        text!("{} and {} {}", &self.a, &self.b, words)
    }

    fn new(a: &str, b: &str, rungs: &[Rung], found: Meeting, finest: Verdict) -> Self {
        let verdict = match found.found {
            Found::Zero => Verdict::Agree,
            Found::Apart => Verdict::Disagree,
            Found::Unknown if finest == Verdict::Agree => Verdict::Agree,
            Found::Unknown => Verdict::Undetermined,
        };
        let found = Meeting {
            add: next(rungs),
            ..found
        };
        OfMeeting {
            a: a.to_owned(),
            b: b.to_owned(),
            verdict,
            found,
        }
    }
}

/// Are there levels enough, and is nothing else asked that decides?
pub(super) fn is_asked(asked: &Asked, rungs: &[Rung]) -> bool {
    asked.same == crate::run::Same::Problem
        && asked.orders[0].is_none()
        && asked.rtol.is_finite()
        && rungs.len() > 2
}

/// `n = 64`, where levels differ only by n.
fn next(rungs: &[Rung]) -> Option<String> {
    let n = |k: usize| match rungs.get(k)?.level.label {
        Label::Mesh(n) => Some(n),
        _ => None,
    };
    let (before, last) = (n(rungs.len().checked_sub(2)?)?, n(rungs.len() - 1)?);
    let ratio = (last as f64 / before.max(1) as f64).round().max(2.0);
    Some(format!("n = {}", (last as f64 * ratio) as usize))
}

/// Of fields: `of` extracts that of a code on a level, at the time that is judged; `finest` is how each two are judged on the finest
/// level, if that is at one time.
///
/// # Errors
/// [`faceoff_mesh::error::Error::Ended`].
pub(super) fn of_field(
    players: &[Player],
    rungs: &[Rung],
    asked: &Asked,
    of: &dyn Fn(usize, &Rung) -> Option<Results>,
    finest: &dyn Fn(&str, &str) -> Option<Verdict>,
) -> Result<Vec<OfMeeting>> {
    let rungs = &rungs[rungs.len().saturating_sub(LEVELS)..];
    let all: Vec<Vec<Option<Results>>> = (0..players.len())
        .map(|k| rungs.iter().map(|rung| of(k, rung)).collect())
        .collect();
    let known: RefCell<Known> = RefCell::default();
    let norms = |a: [usize; 2], b: [usize; 2]| -> Option<[f64; 2]> {
        let key = [a.min(b), a.max(b)];
        if let Some(known) = known.borrow().get(&key) {
            return *known;
        }
        let [a, b] = key.map(|[code, level]| all[code][level].as_ref());
        let settings = Settings {
            map: Some(MatchBy::Functions),
            alone: asked.uncovered,
            ..Settings::default()
        };
        let compared = compare_results(a?, b?, &settings).ok();
        let field = compared
            .as_ref()
            .and_then(|of| of.fields.iter().find(|f| f.field.field == asked.name));
        let norms = field.and_then(|f| f.norms).map(|n| [n.l2, n.l2_scale]);
        known.borrow_mut().insert(key, norms);
        norms
    };
    let mut found = Vec::new();
    for (a, b) in pairs(players) {
        cancel::check()?;
        let [name_a, name_b] = [a, b].map(|k| &*players[k].name);
        let Some(verdict) = finest(name_a, name_b).filter(|v| *v != Verdict::Undetermined) else {
            continue;
        };
        let sizes = [a, b].map(|k| {
            let sizes = all[k].iter();
            sizes
                .map(|of| Some(Size::of(of.as_ref()?).ok()?.h))
                .collect::<Option<Vec<f64>>>()
        });
        let last = rungs.len() - 1;
        let ([Some(of_a), Some(of_b)], Some([_, scale])) = (sizes, norms([a, last], [b, last]))
        else {
            continue;
        };
        let distance = |[i, k]: [usize; 2], [j, l]: [usize; 2]| {
            let code = |i| if i == 0 { a } else { b };
            norms([code(i), k], [code(j), l]).map_or(f64::NAN, |[far, _]| far)
        };
        let meeting = Meeting::new(
            [&of_a, &of_b],
            scale,
            (asked.rtol * scale).max(asked.atol),
            &distance,
        );
        cancel::check()?;
        found.push(OfMeeting::new(name_a, name_b, rungs, meeting, verdict));
    }
    Ok(found)
}

/// Of numbers: by code, one a level.
pub(super) fn of_number(
    players: &[Player],
    rungs: &[Rung],
    asked: &Asked,
    values: &[BTreeMap<String, f64>],
) -> Vec<OfMeeting> {
    let start = rungs.len().saturating_sub(LEVELS);
    let (rungs, values) = (&rungs[start..], &values[start..]);
    let sizes = rungs.iter().map(|rung| Some(rung.level.step.as_ref()?.1));
    let Some(sizes) = sizes.collect::<Option<Vec<f64>>>() else {
        return Vec::new();
    };
    let each = pairs(players).into_iter().filter_map(|(a, b)| {
        let names = [a, b].map(|k| &players[k].name);
        let paths = names.map(|name| {
            let path = values.iter().map(|of| of.get(name).copied());
            path.collect::<Option<Vec<f64>>>()
        });
        let [Some(of_a), Some(of_b)] = paths else {
            return None;
        };
        let paths = [of_a, of_b];
        let distance = |[i, k]: [usize; 2], [j, l]: [usize; 2]| (paths[i][k] - paths[j][l]).abs();
        let last = sizes.len() - 1;
        let scale = paths[0][last].abs().max(paths[1][last].abs());
        let meeting = Meeting::new(
            [&sizes, &sizes],
            scale,
            (asked.rtol * scale).max(asked.atol),
            &distance,
        );
        let is_near = distance([0, last], [1, last]) <= (asked.rtol * scale).max(asked.atol);
        let finest = if is_near {
            Verdict::Agree
        } else {
            Verdict::Disagree
        };
        Some(OfMeeting::new(names[0], names[1], rungs, meeting, finest))
    });
    each.collect()
}

/// What a number of a code converges to, with the room that it may have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extrapolated {
    /// Richardson's value.
    pub value: f64,
    /// A bound on its error.
    pub room: f64,
    /// Observed.
    pub order: Option<f64>,
}

/// Of each code whose number converges steadily on three levels or more.
pub(super) fn extrapolated(
    rungs: &[Rung],
    values: &[BTreeMap<String, f64>],
) -> BTreeMap<String, Extrapolated> {
    let sizes = rungs.iter().map(|rung| Some(rung.level.step.as_ref()?.1));
    let (Some(sizes), Some(finest)) = (sizes.collect::<Option<Vec<f64>>>(), values.last()) else {
        return BTreeMap::new();
    };
    let each = finest.iter().filter_map(|(name, last)| {
        let path = values.iter().map(|of| of.get(name).copied());
        let path = path.collect::<Option<Vec<f64>>>()?;
        let distance = |[_, k]: [usize; 2], [_, l]: [usize; 2]| (path[k] - path[l]).abs();
        let course = crate::run::convergence::Course::new(0, &sizes, last.abs(), &distance)?;
        let before = path[path.len() - 2];
        let found = Extrapolated {
            value: last + course.factor * (last - before),
            room: course.room,
            order: course.order,
        };
        Some((name.clone(), found))
    });
    each.collect()
}
