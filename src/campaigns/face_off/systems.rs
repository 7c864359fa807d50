//! The linear systems of every two codes, row by row.

use serde::Serialize;

use super::{Player, Rung, pairs};
use crate::run::{FaceOff, Label};
use crate::why::Systems;
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

/// The linear systems of two codes on one level.
#[derive(Debug, Serialize)]
pub struct OfSystems {
    /// The first code.
    pub a: String,
    /// The second.
    pub b: String,
    /// As in the runs.
    pub level: Label,
    /// Are the equations the same? Undetermined where they cannot be compared.
    pub verdict: Verdict,
    /// What was found.
    #[serde(flatten)]
    pub found: Option<Systems>,
    /// Why they cannot be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// Of each two codes that have them, on each level.
///
/// # Errors
/// A mesh that cannot be made; [`Error::Ended`].
pub(super) fn judge(of: &FaceOff, players: &[Player], rungs: &[Rung]) -> Result<Vec<OfSystems>> {
    let mut all = Vec::new();
    for rung in rungs {
        let system = |k: usize| rung.left[k].as_ref()?.system.as_ref();
        let there = pairs(players)
            .into_iter()
            .filter_map(|(i, j)| Some((i, j, system(i)?, system(j)?)));
        let there: Vec<_> = there.collect();
        if there.is_empty() {
            continue;
        }
        let mesh = of.mesh(rung.level.n)?;
        for (i, j, a, b) in there {
            let found = match Systems::new(a, b, mesh.as_ref()) {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                found => found,
            };
            let verdict = found.as_ref().map(|found| found.compared.verdict);
            let refused = found.as_ref().err().map(ToString::to_string);
            all.push(OfSystems {
                a: players[i].name.clone(),
                b: players[j].name.clone(),
                level: rung.level.label.clone(),
                verdict: verdict.unwrap_or(Verdict::Undetermined),
                found: found.ok(),
                refused,
            });
        }
    }
    Ok(all)
}
