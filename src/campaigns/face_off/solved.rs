//! One code on one level of a scene of elasticity, as `solve` has it: nothing is compared.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Player, Rung, Running, fields, run_how};
use crate::engine::{Progress, Task};
use crate::run::FaceOff;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

/// A solution of one code, with its integrals.
#[derive(Debug, Serialize)]
pub struct Solved {
    /// The scene and the method, as in `contact-patch-cr`.
    pub name: String,
    /// The code.
    pub engine: String,
    /// The refinement of the mesh, if it has one.
    pub n: Option<usize>,
    /// The number of cells.
    pub cells: usize,
    /// The number of facets on Γ_C.
    pub facets: usize,
    /// The largest |u| at a node of a cell.
    pub largest: f64,
    /// The values of the scene's parameters, as they were given.
    pub parameters: BTreeMap<String, String>,
    /// Integrals of the solution.
    pub numbers: BTreeMap<String, NumberFound>,
    /// The relative errors; none where the solution is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Errors>,
    /// Wall time; for our own solver, of assembly and solving together.
    pub seconds: f64,
    /// u and the mean stress of each cell.
    #[serde(skip)]
    pub on_cells: Mesh,
    /// On Γ_C reaction, stress and status.
    #[serde(skip)]
    pub on_facets: Mesh,
}

/// A number of the scene.
#[derive(Debug, Serialize)]
pub struct NumberFound {
    /// Its value for this solution.
    pub value: f64,
    /// The exact value, where it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<f64>,
}

/// Relative errors.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Errors {
    /// ‖∇(u - u_h)‖/‖∇u‖, cell by cell; none for fields constant on cells.
    pub h1: Option<f64>,
    /// ‖u - u_h‖/‖u‖.
    pub l2: f64,
}

/// Runs the only code of a face-off on its first level.
///
/// # Errors
/// A mesh that cannot be made, a code that is missing or fails, a result that cannot be read.
pub fn solved(of: &FaceOff, how: &Running, progress: &dyn Progress) -> Result<Solved> {
    let nothing = || Error::usage("there is nothing to solve", "name one code and one mesh");
    let code = of.codes.first().ok_or_else(nothing)?;
    let level = of.levels().into_iter().next().ok_or_else(nothing)?;
    let mesh = of.mesh(level.n)?.ok_or_else(nothing)?;
    let parameters = level.parameters(&of.parameters);
    progress.next(&(code.name().to_owned() + &level.label.at()), 0.0);
    let task = Task {
        mesh: Some(&mesh),
        n: level.n,
        parameters: &parameters,
    };
    let mut left = code.run(&task, &run_how(of, code, &level, "", how, None))?;
    left.lay_on(&mesh)?;
    of.integrate(code, Some(&mesh), &parameters, &mut left);
    if let Some(why) = &left.numberless {
        let remedy = "see that its result is a function of the method's space";
        return Err(Error::engine(code.name(), why, remedy));
    }
    let [on_cells, on_facets] = of.solution(code, &mesh, &parameters, &left)?;
    let numbers = of.numbers.iter().filter_map(|asked| {
        let value = *left.numbers.get(asked.name_in(code.name()))?;
        let exact = asked.exact.first().and_then(|formula| {
            let formula = formula.at(&parameters, 0.0).ok()?;
            Some(formula.value([0.0; 3]))
        });
        Some((asked.name.clone(), NumberFound { value, exact }))
    });
    let numbers = numbers.collect();
    let values = on_cells.fields.first().map(|field| field.values.to_f64());
    let largest = values.unwrap_or_default();
    let dim = on_cells
        .fields
        .first()
        .map_or(1, |field| field.components.max(1));
    let largest = largest.chunks(dim);
    let largest = largest.map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt());
    let largest = largest.fold(0.0, f64::max);
    let players = [Player {
        name: code.name().to_owned(),
        code,
        record: None,
    }];
    let seconds = left.seconds;
    let (n, label) = (level.n, code.name().to_owned());
    let rung = Rung {
        level,
        parameters: parameters.clone(),
        left: vec![Some(left)],
    };
    let known = of.fields.iter().find(|asked| !asked.exact.is_empty());
    let error = match (known, fields::side(&players, &rung, 0)) {
        (Some(asked), Some(side)) => fields::error(asked, &rung, &side)?,
        _ => None,
    };
    Ok(Solved {
        name: of.name.clone(),
        engine: label,
        n,
        cells: on_cells.cells().count(),
        facets: on_facets.cells().count(),
        largest,
        parameters,
        numbers,
        error: error.map(|norms| Errors {
            h1: norms
                .h1
                .zip(norms.h1_scale)
                .map(|(error, scale)| error / scale),
            l2: norms.l2 / norms.l2_scale,
        }),
        seconds,
        on_cells,
        on_facets,
    })
}
