//! An answer in the form in which files store it, and the case that it belongs to.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::engine::{Answer, Case, binary, digest, to_dofs};
use faceoff_fem::scene::Part;

/// An answer in a journal or a record. Other quantities are computed again from the dofs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Kept {
    /// The version that the engine reported.
    pub version: String,
    converged: bool,
    step: usize,
    /// JSON has no NaN: an increment that is not a number is null.
    increments: Vec<Option<f64>>,
    seconds: Vec<(String, f64)>,
    /// Values of the local dofs of all cells, little-endian binary64 in base64.
    dofs: String,
    /// The digest of those bytes.
    digest: String,
}

impl Kept {
    /// An engine's answer to a case.
    pub fn new(version: &str, case: &Case, answer: &Answer) -> Self {
        let space = &case.problem.space;
        let cells = 0..space.mesh.cell_count();
        let dofs = cells.flat_map(|cell| space.cell_dofs(cell));
        let bytes: Vec<u8> = dofs
            .flat_map(|dof| answer.u[*dof as usize].to_le_bytes())
            .collect();
        Kept {
            version: version.into(),
            converged: answer.converged,
            step: answer.step,
            increments: answer
                .increments
                .iter()
                .map(|i| i.is_finite().then_some(*i))
                .collect(),
            seconds: answer.seconds.clone(),
            digest: digest(&bytes),
            dofs: BASE64_STANDARD.encode(bytes),
        }
    }

    /// The description of the case, which does not depend on the machine or the time.
    pub fn without_times(mut self) -> Self {
        self.seconds.clear();
        self
    }

    /// The answer, with its residual computed here.
    ///
    /// # Errors
    /// A message on dofs that have changed since they were stored, or that do not fit this case.
    pub fn answer(&self, case: &Case) -> Result<Answer, String> {
        let bytes = BASE64_STANDARD
            .decode(&self.dofs)
            .map_err(|e| format!("its dofs are damaged: {e}"))?;
        if digest(&bytes) != self.digest {
            return Err("its dofs have changed since they were kept".into());
        }
        let space = &case.problem.space;
        let expected = space.mesh.cell_count() * space.local_dofs;
        let values = binary(&bytes, expected)?;
        let u = to_dofs(&case.problem, &values)?;
        Ok(Answer {
            residual: case.problem.backward_error(&u).0,
            u,
            increments: self
                .increments
                .iter()
                .map(|i| i.unwrap_or(f64::NAN))
                .collect(),
            converged: self.converged,
            step: self.step,
            history: None,
            seconds: self.seconds.clone(),
        })
    }
}

/// Everything that defines the scheme of a case.
pub fn identity(case: &Case) -> Value {
    let problem = &case.problem;
    let (scene, data) = (problem.scene, problem.scene.data());
    let parts = problem.parts.iter().map(|part| match part {
        None => 0,
        Some(Part::Dirichlet) => 1,
        Some(Part::Neumann) => 2,
        Some(Part::Contact) => 3,
    });
    json!({
        "scene": scene.name(),
        "method": problem.method().to_string(),
        "n": case.n,
        "mesh digest": problem.space.mesh.digest(),
        "parts of the boundary, digest": digest(&parts.collect::<Vec<u8>>()),
        "dofs": problem.space.dofs,
        "gamma0": problem.discretisation.gamma0,
        "h": format!("{:?}", problem.discretisation.h).to_lowercase(),
        "quadrature": [problem.cell_rule.name, problem.face_rule.name],
        "f": data.f.text(),
        "g": data.g.text(),
        "t": data.t.text(),
        "psi": data.psi.text(),
    })
}
