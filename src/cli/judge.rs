//! `faceoff judge`.

use std::path::Path;
use std::sync::Arc;

use super::args::Judge;
use super::{code, solve};
use crate::engine::{Settings, Silent, meshio_python};
use crate::report::{self, FormJudgement, Judgement, Output, deliver};
use crate::run::foreign::{Foreign, Options, take_boundary_values};
use crate::run::{FormFile, Runner, Setup, certificate, is_elastic, is_face_off};
use crate::why;
use faceoff_fem::certify;
use faceoff_fem::contact::Method;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io;

pub(super) fn run(arguments: &Judge, to: &Output) -> Result<u8> {
    if is_face_off(arguments.scene.as_ref()) {
        return of_form(arguments, to);
    }
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

/// Judges with a form instead of a scene.
fn of_form(arguments: &Judge, to: &Output) -> Result<u8> {
    let given = [
        (
            "--method",
            arguments.method.is_some() && !is_elastic(arguments.scene.as_ref()),
        ),
        ("--gamma0", arguments.gamma0.is_some()),
        ("--field", arguments.field.is_some()),
        ("--mesh", arguments.mesh.is_some()),
    ];
    if let Some((option, _)) = given.iter().find(|(_, is_given)| *is_given) {
        let what = format!("{option} is for scenes, and {} is a form", arguments.scene);
        return Err(Error::usage(what, "leave it out"));
    }
    let path = Path::new(&arguments.scene);
    let method = arguments.method.unwrap_or_else(Method::cr);
    let result = io::open(&arguments.result, meshio_python().as_deref())?.mesh;
    let form = FormFile::fitting(path, &method, arguments.n.map(|n| n as usize), &result)?;
    let found = why::InForm::new(&form.problem, &form.mesh, &result)?;
    let judgement = FormJudgement::new(&arguments.result, &arguments.scene, &form.problem, found);
    let inputs = vec![arguments.result.clone(), path.to_owned()];
    deliver(&report::judge_form(&judgement, inputs)?, to)?;
    Ok(code(judgement.found.verdict))
}
