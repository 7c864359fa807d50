//! The linear systems of every two codes, row by row.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use super::{Player, Rung, pairs};
use crate::engine::with;
use crate::run::{FaceOff, Label};
use crate::why::{Stated, Systems};
use faceoff_judge::Verdict;
use faceoff_judge::systems::System;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

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
    /// Where they differ and the form is known: which form each of them states.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub in_form: Vec<Stated>,
    /// Where they differ: the mesh, on which that is drawn.
    #[serde(skip)]
    pub mesh: Option<Arc<Mesh>>,
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
        let mesh = of.mesh(rung.level.n)?.map(Arc::new);
        let form = of.form.as_ref().filter(|form| form.time.is_none());
        let form = form.map(|form| with(form, &rung.parameters));
        let mut stated = BTreeMap::new();
        let mut state = |k: usize, system: &System| -> Result<Option<Stated>> {
            let (Some(form), Some(mesh)) = (&form, &mesh) else {
                return Ok(None);
            };
            if let Some(known) = stated.get(&k) {
                return Ok(Option::clone(known));
            }
            let found = match Stated::new(form, mesh, system) {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                // What cannot be put into the form is compared with the other code all the same.
                found => found.ok().flatten(),
            };
            stated.insert(k, found.clone());
            Ok(found)
        };
        for (i, j, a, b) in there {
            let found = match Systems::new(a, b, mesh.as_deref()) {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                found => found,
            };
            let verdict = found.as_ref().map(|found| found.compared.verdict);
            let mut in_form = Vec::new();
            let differs = matches!(verdict, Ok(Verdict::Disagree));
            if differs {
                in_form.extend(state(i, a)?);
                in_form.extend(state(j, b)?);
            }
            let refused = found.as_ref().err().map(ToString::to_string);
            all.push(OfSystems {
                a: players[i].name.clone(),
                b: players[j].name.clone(),
                level: rung.level.label.clone(),
                verdict: verdict.unwrap_or(Verdict::Undetermined),
                found: found.ok(),
                in_form,
                mesh: mesh.clone().filter(|_| differs),
                refused,
            });
        }
    }
    Ok(all)
}
