//! Our solver of eigenproblems, and the residual of a mode of any code.

use faceoff_fem::linear::eigen::{Rows, nearest, product, residual};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{Field, Mesh};

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::held::{Held, held};
use super::output::output;
use super::places::places;
use super::read::read;
use crate::problem::Problem;

/// The matrices of an eigenproblem on a mesh.
#[derive(Debug)]
pub struct Pencil {
    assembler: Assembler,
    held: Held,
    shift: f64,
    count: usize,
    /// The number of each dof among those that are free.
    numbers: Vec<Option<usize>>,
    a: Rows,
    m: Rows,
}

/// An eigenvalue and mode of a code, substituted into these matrices.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// The eigenvalue.
    pub value: f64,
    /// ‖A u - λ M u‖ relative to ‖A u‖ + (|λ| + |λ - σ|) ‖M u‖, with the shift σ.
    pub residual: f64,
    /// The largest value that should be 0 by the Dirichlet conditions, relative to the largest of all.
    pub held: f64,
}

impl Pencil {
    /// Assembles an eigenproblem on a mesh.
    ///
    /// # Errors
    /// A form that is not an eigenproblem; a mesh on which it cannot be solved; values that are not finite.
    pub fn new(problem: &Problem, source: &Mesh) -> Result<Self> {
        let Some(eigen) = problem.eigen.clone() else {
            let what = format!("{} is not an eigenproblem", problem.name);
            return Err(Error::usage(what, "add [eigen] with a, m and count"));
        };
        let mut problem = problem.clone();
        let integrals = problem.residual();
        let assembler = Assembler::of(&problem, source, &integrals, true)?;
        let parameters: Vec<f64> = problem.parameters.iter().map(|p| p.value).collect();
        let held = held(&assembler, source, &parameters)?;
        let mut free = 0..;
        let numbers = held.is_held.iter();
        let numbers: Vec<Option<usize>> = numbers
            .map(|is| (!is).then(|| free.next()).flatten())
            .collect();
        let zero = vec![0.0; assembler.dofs.count()];
        let state = State {
            u: &zero,
            old: &[],
            parameters: &parameters,
        };
        let [mut a, mut m] = [(); 2].map(|()| vec![0.0; assembler.pattern.values()]);
        for (k, integral) in integrals.iter().enumerate() {
            let found = assembler.assemble_only(k, state, Wanted::Both).matrix;
            let sum = if integral.is_mass { &mut m } else { &mut a };
            sum.iter_mut().zip(found).for_each(|(sum, x)| *sum += x);
        }
        if a.iter().chain(&m).any(|x| !x.is_finite()) {
            return Err(Error::Solver {
                what: format!("a number of {} is not finite", problem.name),
                remedy: "check a and m for divisions by 0, roots and logarithms of negative numbers, and overflow".into(),
            });
        }
        let [a, m] = [a, m].map(|values| {
            let mut rows = Rows::new();
            assembler
                .pattern
                .for_rows(&assembler.dofs, |dof, columns, at| {
                    if numbers[dof].is_none() {
                        return;
                    }
                    let entries = columns.iter().zip(&values[at..]);
                    let entries = entries
                        .filter_map(|(column, value)| Some((numbers[*column as usize]?, *value)));
                    rows.push(entries.collect());
                });
            rows
        });
        Ok(Pencil {
            assembler,
            held,
            shift: eigen.shift,
            count: eigen.found(),
            numbers,
            a,
            m,
        })
    }

    /// The eigenvalues nearest to the shift, ascending, and the mesh and the fields of their modes: the unknown's name with 1, 2, ….
    ///
    /// # Errors
    /// A shift that is an eigenvalue, too few free dofs, an m that is not positive, an iteration that does not converge.
    pub fn solve(&self) -> Result<(Vec<f64>, Mesh, Vec<Field>)> {
        let all = places(&self.assembler).into_iter().zip(&self.numbers);
        let places: Vec<[f64; 3]> = all
            .filter(|(_, number)| number.is_some())
            .map(|((_, _, at), _)| at)
            .collect();
        let found = nearest(&self.a, &self.m, &places, self.shift, self.count)?;
        let mut cells = Mesh::default();
        let (mut values, mut fields) = (Vec::new(), Vec::new());
        for ((value, mode), number) in found.into_iter().zip(1..) {
            let number: usize = number;
            let u = self.numbers.iter();
            let u: Vec<f64> = u.map(|at| at.map_or(0.0, |at| mode[at])).collect();
            let (mesh, of_mode) = output(&self.assembler, &u);
            cells = mesh;
            values.push(value);
            fields.extend(of_mode.into_iter().map(|mut field| {
                field.name = format!("{}{number}", field.name);
                field
            }));
        }
        Ok((values, cells, fields))
    }

    /// Substitutes an eigenvalue and a mode, a field of a result with the name of the unknown, written with this relative precision.
    ///
    /// # Errors
    /// A result on another mesh; a field that is missing or is not a function of the space.
    pub fn pair(&self, value: f64, result: &Mesh, unit: f64) -> Result<Pair> {
        let u = read(&self.assembler, result, unit)?;
        let largest =
            |all: &mut dyn Iterator<Item = f64>| all.fold(0.0_f64, |most, x| most.max(x.abs()));
        let all = largest(&mut u.iter().copied());
        let held = u.iter().zip(&self.held.is_held).filter(|(_, is)| **is);
        let held = largest(&mut held.map(|(x, _)| *x));
        let free = u.iter().zip(&self.numbers);
        let free: Vec<f64> = free.filter_map(|(x, number)| number.map(|_| *x)).collect();
        let (ax, mx) = (product(&self.a, &free), product(&self.m, &free));
        let part = held / all;
        Ok(Pair {
            value,
            residual: residual(&ax, &mx, value, self.shift),
            held: if part.is_finite() {
                part
            } else {
                f64::INFINITY
            },
        })
    }
}
