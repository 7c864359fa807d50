//! What limits an order that is too low: what the results show, or else a parameter with which the error falls on the same mesh.

use super::fields::{error, extract, file_of, side};
use super::times::of_one;
use super::{OfField, OfOrder, Player, Rung, Running, run_how};
use crate::engine::{Progress, Task};
use crate::run::convergence::Limiting;
use crate::run::{Asked, Code, DT, FaceOff};
use crate::why::Change;
use faceoff_judge::Verdict;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};

/// A parameter limits the error if that falls to this part of it.
const FALLS: f64 = 0.8;
/// More parameters are not tried.
const MOST: usize = 8;
/// What is in the names of parameters of an approximation. Others are tried after them where runs with changes are asked for.
const FIRST: [&str; 9] = [
    "dt", "tau", "step", "tol", "eps", "pen", "quad", "deg", "order",
];

/// Looks at each order of one code's error that is lower than that of theory.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn explain(
    of: &FaceOff,
    how: &Running,
    players: &[Player],
    rungs: &[Rung],
    fields: &mut [OfField],
    progress: &dyn Progress,
) -> Result<()> {
    for field in fields {
        let Some(asked) = of.fields.iter().find(|asked| asked.name == field.field) else {
            continue;
        };
        let is_low = |order: &&mut OfOrder| {
            order.verdict.is_some_and(|verdict| !verdict.passes()) && order.found.against == "exact"
        };
        for order in field.orders.iter_mut().filter(is_low) {
            cancel::check()?;
            let Some(k) = players.iter().position(|player| player.name == order.of) else {
                continue;
            };
            let Some(rung) = rungs.last() else { continue };
            order.found.limiting = match shown(asked, players, rung, k, order) {
                // Where the order is only not settled, no code is run again.
                None if order.verdict == Some(Verdict::Disagree) => {
                    varied(of, how, asked, (players, k), rung, order, progress)?
                }
                found => found,
            };
        }
    }
    Ok(())
}

/// What the finest result shows.
fn shown(
    asked: &Asked,
    players: &[Player],
    rung: &Rung,
    k: usize,
    order: &OfOrder,
) -> Option<Limiting> {
    let of = side(players, rung, k)?;
    let file = file_of(of.left, asked, of.code).ok()?;
    let last = *of_one(&asked.times, &file.times).last()?;
    let finest = extract(file, last, asked, of.code).ok()?;
    let t = file.times[last].unwrap_or_default();
    let exact = asked
        .exact
        .iter()
        .map(|formula| formula.at(&rung.parameters, t));
    let exact = exact.collect::<Result<Vec<_>, String>>().ok()?;
    let value = |x: [f64; 3], component: usize| exact[component].with_gradient(x).0;
    Limiting::of(asked.orders, &order.found, &finest, exact.len(), &value)
}

/// The first parameter that is not in the exact solution and with another value of which the error on the finest level is smaller.
fn varied(
    of: &FaceOff,
    how: &Running,
    asked: &Asked,
    (players, k): (&[Player], usize),
    rung: &Rung,
    order: &OfOrder,
    progress: &dyn Progress,
) -> Result<Option<Limiting>> {
    let Some(before) = order
        .found
        .levels
        .last()
        .and_then(|level| Some(level.norms?.l2))
    else {
        return Ok(None);
    };
    let mut parameters = rung.parameters.clone();
    let step = of.form.as_ref().and_then(|form| form.step());
    if let Some(step) = step {
        let step = || format!("{:?}", step.value);
        parameters.entry(DT.to_owned()).or_insert_with(step);
    }
    let is_free = |name: &str| !asked.exact.iter().any(|formula| formula.uses(name));
    let mut names: Vec<&String> = parameters.keys().filter(|name| is_free(name)).collect();
    let is_first = |name: &str| FIRST.iter().any(|of| name.to_lowercase().contains(of));
    names.retain(|name| how.diagnose || is_first(name));
    names.sort_by_key(|name| !is_first(name));
    let mesh = of.mesh(rung.level.n)?;
    for name in names.into_iter().take(MOST) {
        for change in Change::of_limit(name) {
            let mut changed = parameters.clone();
            if !change.parameters(&of.reals, &mut changed) {
                continue;
            }
            let now = changed[name].clone();
            progress.next(&format!("{}, {name} = {now}", players[k].name), 1.0);
            cancel::check()?;
            // A value that the file or the code does not take shows nothing.
            let Ok(other) = of.at(&[(name.clone(), now.clone())].into()) else {
                continue;
            };
            let same = |code: &&Code| code.name() == players[k].code.name();
            let Some(code) = other.codes.iter().find(same) else {
                continue;
            };
            changed.retain(|name, _| rung.parameters.contains_key(name));
            let task = Task {
                mesh: mesh.as_ref(),
                n: rung.level.n,
                parameters: &changed,
            };
            let how = run_how(of, code, &rung.level, &change.suffix(), how, None);
            let left = match code.run(&task, &how) {
                Ok(left) => left,
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                Err(_) => continue,
            };
            let values = [parameters[name].clone(), now];
            let mut there = Rung {
                level: rung.level.clone(),
                parameters: changed,
                left: (0..players.len()).map(|_| None).collect(),
            };
            there.left[k] = Some(left);
            let found = match side(players, &there, k) {
                Some(of) => match error(asked, &there, &of) {
                    Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                    found => found.ok().flatten(),
                },
                None => None,
            };
            if let Some(after) = found.map(|norms| norms.l2).filter(|x| *x <= FALLS * before) {
                return Ok(Some(Limiting::Parameter {
                    name: name.clone(),
                    values,
                    errors: [before, after],
                }));
            }
        }
    }
    Ok(None)
}
