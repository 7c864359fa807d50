//! `faceoff orders`.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::args::Orders;
use super::progress::Bar;
use super::{DISAGREE, DONE};
use crate::engine;
use crate::orders::orders;
use crate::report::{self, Output, deliver};
use faceoff_fem::scene::Scene;
use faceoff_mesh::error::{Error, Result};

pub(super) fn run(arguments: &Orders, to: &Output) -> Result<u8> {
    let names: Vec<&str> = if arguments.scenes.is_empty() {
        Scene::exact_names()
    } else {
        arguments.scenes.iter().map(String::as_str).collect()
    };
    let scenes = names
        .iter()
        .map(|name| arguments.trust.scene(name))
        .collect::<Result<Vec<_>>>()?;
    let n: Vec<usize> = arguments.n.iter().map(|&n| n as usize).collect();
    let methods = &arguments.methods.0;
    let bar = Bar::new(to.quiet);
    let (started, total) = (AtomicUsize::new(0), scenes.len() * methods.len() * n.len());
    let all = orders(&scenes, methods, &n, |scene, method, n| {
        let share = started.fetch_add(1, Ordering::Relaxed) as f64 / total as f64;
        bar.tell(&format!("{}, {method}, n = {n}", scene.name), share);
        if engine::interrupted() {
            return Err(Error::Interrupted);
        }
        Ok(())
    });
    bar.clear();
    let all = all?;
    deliver(&report::orders(&all)?, to)?;
    let converged = all.iter().all(|o| o.levels.iter().all(|l| l.converged));
    Ok(if converged { DONE } else { DISAGREE })
}
