//! What moves a code's answer that should not: the same once more, the order of cells and of vertices, threads, and parameters
//! that are changed by a few units of rounding. What follows from it is in `cause`.

use serde::{Serialize, Serializer};

use super::cause::{self, Finding, Pair};
use super::fields::{Side, over_times};
use super::{OfField, OfNumber, Player, Rung, Running, pairs, run_how};
use crate::engine::{How, Left, Progress, Task};
use crate::run::{Asked, FaceOff, Label, Same, reverse_cells, reverse_points};
use crate::text::Text;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

/// Parameters are changed by so many units in the last place: more than the writing of a number loses.
const ULPS: u64 = 4;

/// What was changed, and what came of it.
#[derive(Debug, Serialize)]
pub struct Diagnosis {
    /// The refinement that all were run on.
    pub n: Option<usize>,
    /// One for each code, change, and field or number.
    pub moved: Vec<Moved>,
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
    /// What was changed, in JSON in words.
    pub change: Change,
    /// The field or the number, by name.
    pub of: String,
    /// Relative to the largest value; none where it could not be told.
    pub relative: Option<f64>,
    /// Why it could not be told.
    pub reason: Option<String>,
}

/// One thing that an answer should not depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// Nothing: the same once more.
    Again,
    /// The order of the cells.
    Cells,
    /// The order of the vertices.
    Vertices,
    /// The number of threads.
    Threads,
    /// The last digits of the parameters.
    Rounding,
}

impl Serialize for Change {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.words())
    }
}

impl Change {
    const ALL: [Change; 5] = [
        Change::Again,
        Change::Cells,
        Change::Vertices,
        Change::Threads,
        Change::Rounding,
    ];

    /// `cells in reverse order`
    pub fn words(self) -> &'static str {
        match self {
            Change::Again => "run once more",
            Change::Cells => "cells in reverse order",
            Change::Vertices => "vertices in reverse order",
            Change::Threads => "in one thread",
            Change::Rounding => "parameters changed by 4 units in the last place",
        }
    }

    /// As the end of a folder's name.
    fn suffix(self) -> &'static str {
        match self {
            Change::Again => "-again",
            Change::Cells => "-cells",
            Change::Vertices => "-vertices",
            Change::Threads => "-threads",
            Change::Rounding => "-rounding",
        }
    }
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
    let rung = rungs.iter().find(differs).unwrap_or(&rungs[0]);
    let mesh = of.mesh(rung.level.n)?;
    let mut moved = Vec::new();
    for (player, left) in players.iter().zip(&rung.left) {
        let (None, Some(left)) = (player.record, left) else {
            continue;
        };
        for (k, change) in Change::ALL.into_iter().enumerate() {
            let share = k as f64 / Change::ALL.len() as f64;
            progress.next(&format!("{}, {}", player.name, change.words()), share);
            let again = match again(of, how, player, rung, mesh.as_ref(), change) {
                None => continue,
                Some(Err(Error::Ended(cause))) => return Err(Error::Ended(cause)),
                Some(again) => again.map_err(|error| error.to_string()),
            };
            for asked in &of.fields {
                let found = field_moved(asked, player, left, &again)?;
                moved.push(row(player, change, &asked.name, found));
            }
            for asked in &of.numbers {
                let found = number_moved(asked, player, left, &again);
                moved.push(row(player, change, &asked.name, found));
            }
        }
    }
    let outcomes = findings(of, &rung.level.label, players, fields, numbers, &moved);
    Ok(Diagnosis {
        n: rung.level.n,
        moved,
        findings: outcomes.iter().map(|found| found.words.clone()).collect(),
        outcomes,
    })
}

fn row(player: &Player, change: Change, of: &str, found: Result<f64, String>) -> Moved {
    Moved {
        code: player.name.clone(),
        change,
        of: of.to_owned(),
        relative: found.as_ref().ok().copied(),
        reason: found.err(),
    }
}

/// The code once more, with one thing changed; none where it does not have that thing.
fn again(
    of: &FaceOff,
    how: &Running,
    player: &Player,
    rung: &Rung,
    mesh: Option<&Mesh>,
    change: Change,
) -> Option<Result<Left>> {
    let source = mesh;
    let mut mesh = mesh.filter(|_| player.code.takes_mesh()).cloned();
    let mut parameters = rung.parameters.clone();
    let mut threads = None;
    match change {
        Change::Again => {}
        Change::Cells => reverse_cells(mesh.as_mut()?),
        Change::Vertices => reverse_points(mesh.as_mut()?),
        Change::Threads => threads = Some(1),
        Change::Rounding => {
            let mut is_changed = false;
            for value in parameters.values_mut().filter(|v| v.contains(['.', 'e'])) {
                let number = value.parse::<f64>().ok();
                let Some(number) = number.filter(|x| x.is_normal()) else {
                    continue;
                };
                *value = format!("{:e}", f64::from_bits(number.to_bits() + ULPS));
                is_changed = true;
            }
            if !is_changed {
                return None;
            }
        }
    }
    let task = Task {
        mesh: mesh.as_ref(),
        n: rung.level.n,
        parameters: &parameters,
    };
    let how = How {
        threads,
        ..run_how(of, player.code, &rung.level, change.suffix(), how, None)
    };
    let mut again = player.code.run(&task, &how);
    if let Ok(left) = &mut again {
        // Cells and vertices are found by their places.
        of.integrate(player.code, source, &rung.parameters, left);
    }
    Some(again)
}

fn field_moved(
    asked: &Asked,
    player: &Player,
    left: &Left,
    again: &Result<Left, String>,
) -> Result<Result<f64, String>> {
    let again = match again {
        Ok(again) => again,
        Err(reason) => return Ok(Err(reason.clone())),
    };
    let side = |left| Side {
        name: &player.name,
        code: player.code.name(),
        left,
    };
    let as_it_is = Asked {
        same: Same::Discretisation,
        ..asked.clone()
    };
    let found = over_times(&as_it_is, [&side(left), &side(again)], false, &mut None)?;
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

fn number_moved(
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
    fields: &[OfField],
    numbers: &[OfNumber],
    moved: &[Moved],
) -> Vec<Finding> {
    let mut found = Vec::new();
    for field in fields {
        let pairs = cause::of_field(field, level);
        found.extend(cause::findings(&field.field, field.same, &pairs, moved));
    }
    for (asked, number) in of.numbers.iter().zip(numbers) {
        let rows = number.rows.iter().filter(|r| r.level == *level);
        for row in rows.filter(|r| r.verdict == Verdict::Disagree) {
            let mut pairs_of = Vec::new();
            for (a, b) in pairs(players) {
                let names = [&*players[a].name, &*players[b].name];
                let [Some(x), Some(y)] = names.map(|name| row.values.get(name)) else {
                    continue;
                };
                let (far, scale) = ((x - y).abs(), x.abs().max(y.abs()));
                pairs_of.push(Pair {
                    a: names[0],
                    b: names[1],
                    apart: if far > 0.0 { far / scale } else { 0.0 },
                    agrees: far <= (asked.rtol * scale).max(asked.atol) || asked.rtol.is_infinite(),
                });
            }
            found.extend(cause::findings(&asked.name, asked.same, &pairs_of, moved));
        }
    }
    found
}
