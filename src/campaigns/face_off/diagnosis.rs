//! What each code answers when one thing is changed: how far its answer moves, and, where a parameter was changed, how far codes are
//! apart then. What follows from it is in `cause`.

use serde::Serialize;

use super::cause::{self, Finding, Pair};
use super::fields::{Side, over_times};
use super::{OfField, OfNumber, Player, Rung, Running, pairs, run_how};
use crate::engine::{Back, How, Left, Progress, Task};
use crate::run::{Asked, FaceOff, Label, Same, reverse_cells, reverse_points};
use crate::text::Text;
use crate::why::Change;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

/// What was changed, and what came of it.
#[derive(Debug, Serialize)]
pub struct Diagnosis {
    /// The refinement that all were run on.
    pub n: Option<usize>,
    /// One for each code, change, and field or number.
    pub moved: Vec<Moved>,
    /// One for each two codes, parameter that was changed, and field or number.
    pub apart: Vec<Apart>,
    /// What it says of the differences, in sentences.
    pub findings: Vec<Text>,
    /// The same, by their kind.
    pub outcomes: Vec<Finding>,
}

/// How far a code's field or number moved.
#[derive(Debug, Serialize)]
pub struct Moved {
    /// The one that was run again.
    pub code: String,
    /// What was changed; in JSON a sentence.
    pub change: Change,
    /// The field or the number, by name.
    pub of: String,
    /// Relative to the largest value; none where it is not known.
    pub relative: Option<f64>,
    /// Why it is not known.
    pub reason: Option<String>,
}

/// How far two codes are apart after both were run with other parameters.
#[derive(Debug, Serialize)]
pub struct Apart {
    /// The first code.
    pub a: String,
    /// The second.
    pub b: String,
    /// What was changed; in JSON a sentence.
    pub change: Change,
    /// The field or the number, by name.
    pub of: String,
    /// Relative to the largest value.
    pub relative: f64,
    /// Are they within its tolerance?
    pub agrees: bool,
}

/// What the codes leave with one thing changed; none of those that do not have that thing.
struct Rerun {
    change: Change,
    left: Vec<Option<Result<Left, String>>>,
}

/// Runs every code again, with one thing changed at a time, on the coarsest level where codes differ, or on the coarsest.
///
/// # Errors
/// A mesh that cannot be made; [`Error::Ended`].
pub(super) fn diagnose(
    of: &FaceOff,
    how: &Running,
    players: &[Player],
    rungs: &[Rung],
    fields: &[OfField],
    numbers: &[OfNumber],
    progress: &dyn Progress,
) -> Result<Diagnosis> {
    let rung = differing(rungs, fields, numbers);
    let mesh = of.mesh(rung.level.n)?;
    let changes = Change::of_run(&of.free());
    let count = changes.len();
    let (mut moved, mut apart) = (Vec::new(), Vec::new());
    for (k, change) in changes.into_iter().enumerate() {
        let rerun = rerun(of, how, players, (rung, mesh.as_ref()), change, &|label| {
            progress.next(label, k as f64 / count as f64);
        })?;
        for (player, (left, again)) in players.iter().zip(rung.left.iter().zip(&rerun.left)) {
            let (Some(left), Some(again)) = (left, again) else {
                continue;
            };
            let change = &rerun.change;
            for asked in &of.fields {
                let found = field_moved(asked, player, left, again)?;
                moved.push(row(player, change, &asked.name, found));
            }
            for asked in &of.numbers {
                let found = number_moved(asked, player, left, again);
                moved.push(row(player, change, &asked.name, found));
            }
        }
        if matches!(rerun.change, Change::Parameter(..)) {
            apart.extend(far_apart(of, players, &rerun)?);
        }
    }
    // By code, as they are named.
    moved.sort_by_key(|row| players.iter().position(|player| player.name == row.code));
    let outcomes = findings(
        of,
        &rung.level.label,
        players,
        (fields, numbers),
        (&moved, &apart),
    );
    Ok(Diagnosis {
        n: rung.level.n,
        moved,
        apart,
        findings: outcomes.iter().map(|found| found.words.clone()).collect(),
        outcomes,
    })
}

/// The coarsest level where codes differ, or the coarsest.
pub(super) fn differing<'a>(
    rungs: &'a [Rung],
    fields: &[OfField],
    numbers: &[OfNumber],
) -> &'a Rung {
    let differs = |rung: &&Rung| {
        let of_pairs = fields.iter().flat_map(|f| &f.pairs);
        let mut of_pairs = of_pairs.filter(|p| p.judged && p.level == rung.level.label);
        let mut of_rows = numbers
            .iter()
            .flat_map(|n| &n.rows)
            .filter(|r| r.level == rung.level.label);
        of_pairs.any(|p| p.compared.field.verdict == Verdict::Disagree)
            || of_rows.any(|r| r.verdict == Verdict::Disagree)
    };
    rungs.iter().find(differs).unwrap_or(&rungs[0])
}

fn row(player: &Player, change: &Change, of: &str, found: Result<f64, String>) -> Moved {
    Moved {
        code: player.name.clone(),
        change: change.clone(),
        of: of.to_owned(),
        relative: found.as_ref().ok().copied(),
        reason: found.err(),
    }
}

/// The codes once more, with one thing changed.
fn rerun(
    of: &FaceOff,
    how: &Running,
    players: &[Player],
    (rung, source): (&Rung, Option<&Mesh>),
    change: Change,
    next: &dyn Fn(&str),
) -> Result<Rerun> {
    let mut left = Vec::with_capacity(players.len());
    for (player, before) in players.iter().zip(&rung.left) {
        if player.record.is_some() || before.is_none() {
            left.push(None);
            continue;
        }
        next(&format!("{}, {}", player.name, change.words()));
        left.push(match again(of, how, player, (rung, source), &change) {
            Some(Err(Error::Ended(cause))) => return Err(Error::Ended(cause)),
            again => again.map(|again| again.map_err(|error| error.to_string())),
        });
    }
    Ok(Rerun { change, left })
}

/// A code once more, with one thing changed; none where it does not have that thing.
fn again(
    of: &FaceOff,
    how: &Running,
    player: &Player,
    (rung, source): (&Rung, Option<&Mesh>),
    change: &Change,
) -> Option<Result<Left>> {
    let mut mesh = source.filter(|_| player.code.takes_mesh()).cloned();
    let mut parameters = rung.parameters.clone();
    match change {
        Change::Cells => reverse_cells(mesh.as_mut()?),
        Change::Vertices => reverse_points(mesh.as_mut()?),
        Change::Again | Change::Threads => {}
        of_parameters => of_parameters
            .parameters(&of.reals, &mut parameters)
            .then_some(())?,
    }
    let task = Task {
        mesh: mesh.as_ref(),
        n: rung.level.n,
        parameters: &parameters,
    };
    let how = How {
        threads: (*change == Change::Threads).then_some(1),
        ..run_how(of, player.code, &rung.level, &change.suffix(), how, None)
    };
    let again = player.code.run(&task, &how);
    let mut again = again.and_then(|mut left| {
        if let (Change::Vertices, Some(mesh)) = (change, &mesh) {
            left.bring_back(&Back {
                numbers: (0..mesh.points.len() as u32).rev().collect(),
                ..Back::default()
            });
        }
        let grid = source.filter(|_| player.code.takes_mesh());
        grid.map_or(Ok(()), |mesh| left.lay_on(mesh))?;
        Ok(left)
    });
    if let Ok(left) = &mut again {
        // Cells and vertices are found by their places.
        of.integrate(player.code, source, &parameters, left);
    }
    Some(again)
}

/// How far every two codes are apart, field by field and number by number.
fn far_apart(of: &FaceOff, players: &[Player], rerun: &Rerun) -> Result<Vec<Apart>> {
    let mut found = Vec::new();
    for (a, b) in pairs(players) {
        let (Some(Ok(of_a)), Some(Ok(of_b))) = (&rerun.left[a], &rerun.left[b]) else {
            continue;
        };
        let [a, b] = [a, b].map(|k| &players[k]);
        let mut add = |of: &str, (relative, agrees)| {
            found.push(Apart {
                a: a.name.clone(),
                b: b.name.clone(),
                change: rerun.change.clone(),
                of: of.to_owned(),
                relative,
                agrees,
            });
        };
        for asked in &of.fields {
            let sides = [side(a, of_a), side(b, of_b)];
            let all = over_times(asked, [&sides[0], &sides[1]], false, &mut None)?;
            let all = all.iter().map(|(_, of)| &of.field);
            if all.clone().all(|of| of.verdict != Verdict::Undetermined) {
                let most = all.clone().map(|of| of.max_rel).max_by(f64::total_cmp);
                if let Some(most) = most {
                    add(
                        &asked.name,
                        (most, all.clone().all(|of| of.verdict.passes())),
                    );
                }
            }
        }
        for asked in &of.numbers {
            let names = [a, b].map(|player| asked.name_in(player.code.name()));
            if let (Some(x), Some(y)) = (of_a.numbers.get(names[0]), of_b.numbers.get(names[1]))
                && (x - y).is_finite()
            {
                add(&asked.name, numbers_apart(asked, *x, *y));
            }
        }
    }
    Ok(found)
}

/// How far two numbers are apart, relative to the larger, and whether that is within the tolerance.
fn numbers_apart(asked: &Asked, x: f64, y: f64) -> (f64, bool) {
    let (far, scale) = ((x - y).abs(), x.abs().max(y.abs()));
    let agrees = far <= (asked.rtol * scale).max(asked.atol) || asked.rtol.is_infinite();
    (if far > 0.0 { far / scale } else { 0.0 }, agrees)
}

fn side<'a>(player: &'a Player, left: &'a Left) -> Side<'a> {
    Side {
        name: &player.name,
        code: player.code.name(),
        left,
    }
}

pub(super) fn field_moved(
    asked: &Asked,
    player: &Player,
    left: &Left,
    again: &Result<Left, String>,
) -> Result<Result<f64, String>> {
    let again = match again {
        Ok(again) => again,
        Err(reason) => return Ok(Err(reason.clone())),
    };
    let as_it_is = Asked {
        same: Same::Discretisation,
        ..asked.clone()
    };
    let found = over_times(
        &as_it_is,
        [&side(player, left), &side(player, again)],
        false,
        &mut None,
    )?;
    let reason = found.iter().find_map(|(_, of)| of.field.reason.clone());
    let most = found
        .iter()
        .map(|(_, of)| of.field.max_rel)
        .max_by(f64::total_cmp);
    Ok(match reason {
        Some(reason) => Err(reason),
        None => most.ok_or_else(|| "it has no time that is judged".to_owned()),
    })
}

pub(super) fn number_moved(
    asked: &Asked,
    player: &Player,
    left: &Left,
    again: &Result<Left, String>,
) -> Result<f64, String> {
    let name = asked.name_in(player.code.name());
    let again = again.as_ref().map_err(Clone::clone)?;
    match (left.numbers.get(name), again.numbers.get(name)) {
        (Some(a), Some(b)) if a == b => Ok(0.0),
        (Some(a), Some(b)) => Ok((a - b).abs() / a.abs().max(b.abs())),
        _ => Err(format!("there is no number `{name}`")),
    }
}

/// Of each field and number: what explains where codes differ by more than its tolerance.
fn findings(
    of: &FaceOff,
    level: &Label,
    players: &[Player],
    (fields, numbers): (&[OfField], &[OfNumber]),
    seen: (&[Moved], &[Apart]),
) -> Vec<Finding> {
    let mut found = Vec::new();
    for field in fields {
        let pairs = cause::of_field(field, level);
        found.extend(cause::findings(&field.field, field.same, &pairs, seen));
    }
    for number in numbers {
        let Some(asked) = of.numbers.iter().find(|asked| asked.name == number.number) else {
            continue;
        };
        let rows = number.rows.iter().filter(|r| r.level == *level);
        for row in rows.filter(|r| r.judged) {
            let of_pair = |(a, b): (usize, usize)| {
                let [a, b] = [a, b].map(|k| &*players[k].name);
                let (apart, agrees) =
                    numbers_apart(asked, *row.values.get(a)?, *row.values.get(b)?);
                Some(Pair {
                    a,
                    b,
                    apart,
                    agrees,
                })
            };
            let of_pairs: Vec<Pair> = pairs(players).into_iter().filter_map(of_pair).collect();
            found.extend(cause::findings(&asked.name, asked.same, &of_pairs, seen));
        }
    }
    found
}
