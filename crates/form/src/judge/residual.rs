//! A result of any code in a form: the residual by rows and by terms.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Mesh;

use crate::own::{Assembler, Held, State, Wanted, held, means, read};
use crate::problem::Problem;

/// The residual of a result in a form.
pub struct Residual<'a> {
    pub problem: &'a Problem,
    /// The mesh of the form, with its groups.
    pub source: &'a Mesh,
    pub assembler: Assembler,
    /// The dofs of the result.
    pub u: Vec<f64>,
    pub parameters: Vec<f64>,
    pub held: Held,
    /// The integrals of the basis functions of each prescribed mean, and the value of their sum.
    pub means: Vec<(Vec<f64>, f64)>,
    /// F(u; ·), without multipliers of means: 0 where a dof is prescribed.
    pub values: Vec<f64>,
    /// The same with the rows of prescribed dofs, and with the contributions of multipliers of means.
    pub whole: Vec<f64>,
    /// F(u; ·) of each term, as in `values`.
    pub terms: Vec<Vec<f64>>,
    /// For each row the sum of the absolute values of its terms.
    pub sizes: Vec<f64>,
    /// The values that the rows should have: 0 for a result.
    pub goal: Vec<f64>,
}

impl<'a> Residual<'a> {
    /// From the fields of a result, which have the names of the unknowns; `unit` is the relative precision of its numbers in the file.
    ///
    /// # Errors
    /// A result on another mesh, fields that are missing or are not functions of the spaces, and a form of several time steps.
    pub fn new(problem: &'a Problem, source: &'a Mesh, result: &Mesh, unit: f64) -> Result<Self> {
        if problem.time.is_some() {
            return Err(Error::usage(
                format!(
                    "{} has steps in time, and a result at its end does not say what was before",
                    problem.name
                ),
                "compare it with that of another code: faceoff verify",
            ));
        }
        if problem.eigen.is_some() {
            return Err(Error::usage(
                format!(
                    "{} is an eigenproblem, and a result says nothing of its eigenvalues",
                    problem.name
                ),
                "compare it with that of another code: faceoff verify",
            ));
        }
        let assembler = Assembler::of(problem, source, &problem.integrals, true)?;
        let u = read(&assembler, result, unit)?;
        Residual::of(problem, source, assembler, u)
    }

    /// From given values of all dofs.
    ///
    /// # Errors
    /// Dirichlet values that cannot be evaluated, and a residual that is not finite.
    pub fn of(
        problem: &'a Problem,
        source: &'a Mesh,
        assembler: Assembler,
        u: Vec<f64>,
    ) -> Result<Self> {
        let parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
        let mut found = Residual {
            problem,
            source,
            held: held(&assembler, source, &parameters)?,
            means: means(problem, &assembler.mesh, &assembler.dofs),
            values: vec![0.0; u.len()],
            whole: vec![0.0; u.len()],
            terms: Vec::new(),
            sizes: vec![0.0; u.len()],
            goal: vec![0.0; u.len()],
            assembler,
            u,
            parameters,
        };
        for k in 0..problem.integrals.len() {
            let state = found.state(&found.parameters);
            let mut system = found.assembler.assemble_only(k, state, Wanted::Sizes);
            add(&mut found.sizes, &system.sizes, 1.0);
            add(&mut found.whole, &system.residual, 1.0);
            found.free(&mut system.residual);
            add(&mut found.values, &system.residual, 1.0);
            found.terms.push(system.residual);
        }
        // Rounding of the dofs enters the residual through the matrix.
        let state = found.state(&found.parameters);
        let matrix = found.assembler.assemble(state, Wanted::Both).matrix;
        let Assembler { pattern, dofs, .. } = &found.assembler;
        let (sizes, u) = (&mut found.sizes, &found.u);
        pattern.for_rows(dofs, |dof, columns, at| {
            let entries = columns.iter().zip(&matrix[at..]);
            sizes[dof] += entries
                .map(|(column, a)| (a * u[*column as usize]).abs())
                .sum::<f64>();
        });
        match found.values.iter().find(|r| !r.is_finite()) {
            None => Ok(found),
            Some(value) => Err(Error::Solver {
                what: format!(
                    "with this result the residual of {} is {value}",
                    problem.name
                ),
                remedy: "give a result of finite numbers, and check the form for divisions by 0"
                    .into(),
            }),
        }
    }

    /// The result, with other parameters.
    pub fn state<'s>(&'s self, parameters: &'s [f64]) -> State<'s> {
        State {
            u: &self.u,
            old: &[],
            parameters,
        }
    }

    /// Removes the rows of prescribed dofs, and the contribution of a multiplier of a mean, which is a multiple of its row.
    pub fn free(&self, values: &mut [f64]) {
        let clear = |values: &mut [f64]| {
            let all = values.iter_mut().zip(&self.held.is_held);
            all.filter(|(_, is)| **is).for_each(|(r, _)| *r = 0.0);
        };
        clear(values);
        for (row, _) in &self.means {
            let mut row = row.clone();
            clear(&mut row);
            let square = dot(&row, &row);
            if square > 0.0 {
                let multiplier = dot(values, &row) / square;
                values
                    .iter_mut()
                    .zip(&row)
                    .for_each(|(r, row)| *r -= multiplier * row);
            }
        }
    }

    /// F(u; ·) with other parameters.
    pub fn with(&self, parameters: &[f64]) -> Vec<f64> {
        let system = self
            .assembler
            .assemble(self.state(parameters), Wanted::Residual);
        let mut values = system.residual;
        self.free(&mut values);
        values
    }
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The root of the sum of squares.
pub fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

/// Adds a multiple.
pub fn add(sum: &mut [f64], values: &[f64], factor: f64) {
    let all = sum.iter_mut().zip(values);
    all.for_each(|(sum, value)| *sum += factor * value);
}

/// The largest |x|; infinite if one is NaN.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| match x.is_nan() {
        true => f64::INFINITY,
        false => most.max(x.abs()),
    })
}
