//! `faceoff orders`.

use super::args::Orders;
use super::progress::watched;
use super::{DISAGREE, DONE};
use crate::campaigns::orders::orders;
use crate::engine::Settings;
use crate::report::{self, Output, deliver};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::Result;

pub(super) fn run(arguments: &Orders, to: &Output) -> Result<u8> {
    let names = match &arguments.scenes[..] {
        [] => Scene::exact_names()
            .into_iter()
            .map(str::to_owned)
            .collect(),
        asked => asked.to_vec(),
    };
    let scenes = arguments.trust.scenes(&names)?;
    let n: Vec<usize> = arguments.n.iter().map(|&n| n as usize).collect();
    let methods = &arguments.methods.0;
    let settings = Settings::default();
    let all = watched(&[], vec![], to.quiet, |progress| {
        orders(&scenes, methods, &n, &settings, progress)
    })?;
    deliver(&report::orders(&all)?, to)?;
    let converged = all.iter().all(|o| o.levels.iter().all(|l| l.converged));
    Ok(if converged { DONE } else { DISAGREE })
}
