//! `faceoff judge`.

use std::sync::Arc;

use super::args::Judge;
use super::{code, solve};
use crate::engine::{Settings, Silent};
use crate::report::{self, Judgement, Output, deliver};
use crate::run::foreign::{Foreign, Options, take_boundary_values};
use crate::run::{Runner, Setup, certificate};
use crate::why;
use faceoff_fem::certify;
use faceoff_mesh::error::Result;

pub(super) fn run(arguments: &Judge, to: &Output) -> Result<u8> {
    let scene = arguments.trust.scene(&arguments.scene)?;
    let options = Options {
        field: arguments.field.as_deref(),
        element: arguments.method.map(|method| method.element),
        mesh: arguments.mesh.as_deref(),
        n: arguments.n.map(|n| n as usize),
    };
    let found = Foreign::read(&arguments.result, &scene, &options)?;
    let method = arguments.method.unwrap_or_else(|| found.method());
    let Foreign {
        mesh,
        u,
        written,
        understood,
        ..
    } = found;
    let settings = Settings::default();
    let mut setup = Setup::on(Arc::new(mesh), &scene, None, method, &settings);
    if let Some(gamma0) = arguments.gamma0 {
        setup.discretisation.gamma0 = solve::gamma0(&method, gamma0)?;
    }
    let runner = Runner::new(&settings, &Silent);
    let findings = why::examine(&runner, &setup, &u, written)?;
    let case = setup.case()?;
    let mut held = u.clone();
    take_boundary_values(&case.problem, &mut held);
    let certificate = certificate(certify::examine(&case.problem, &held))?;
    let judgement = Judgement::new(&arguments.result, &case, understood, findings, &certificate);
    let inputs = [Some(&arguments.result), arguments.mesh.as_ref()];
    let inputs = inputs.into_iter().flatten().cloned().collect();
    deliver(&report::judge(&judgement, &case, &u, inputs)?, to)?;
    Ok(code(judgement.verdict))
}
