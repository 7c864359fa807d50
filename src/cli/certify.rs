//! `faceoff certify`.

use super::DONE;
use super::args::Certify;
use crate::engine::Case;
use crate::report::{self, Certification, Output, deliver};
use crate::run::foreign::{Foreign, Options, take_boundary_values};
use faceoff_fem::certify::examine;
use faceoff_fem::contact::{Discretisation, Problem};
use faceoff_mesh::error::Result;

pub(super) fn run(arguments: &Certify, to: &Output) -> Result<u8> {
    let scene = arguments.trust.scene(&arguments.scene)?;
    if let Some(out) = &arguments.out {
        report::check_vtu_path(out)?;
    }
    let asked = arguments.method.or(arguments.element);
    let options = Options {
        field: arguments.field.as_deref(),
        element: asked.map(|method| method.element),
        mesh: arguments.mesh.as_deref(),
        n: arguments.n.map(|n| n as usize),
    };
    let found = Foreign::read(&arguments.result, &scene, &options)?;
    let method = asked.unwrap_or_else(|| found.method());
    let Foreign {
        mesh,
        mut u,
        understood,
        ..
    } = found;
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method))?;
    let off = take_boundary_values(&problem, &mut u);
    let case = Case { n: None, problem };
    let certificate = examine(&case.problem, &u)?;
    let told = Certification::new(&arguments.result, &case, understood, off, &certificate);
    if let Some(out) = &arguments.out {
        report::write_certified(out, &case, &u, &certificate)?;
    }
    let inputs = [Some(&arguments.result), arguments.mesh.as_ref()];
    let inputs = inputs.into_iter().flatten().cloned().collect();
    deliver(
        &report::certify(&told, &case, &u, &certificate, inputs)?,
        to,
    )?;
    Ok(DONE)
}
