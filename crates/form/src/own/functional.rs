//! Numbers of a solution: integrals, linear or nonlinear in the unknowns, such as energies, forces and means.
//!
//! They are computed by the assembly of residuals: with a test function that is constant on each cell, the sum of a residual is the integral.

use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

use super::assemble::{Assembler, Wanted};
use super::batch::State;
use super::read::read;
use crate::language::{Fault, Formula, Names, Reader};
use crate::problem::{Element, Integral, Problem, Space, Unknown};

/// The numbers of a problem, each a sum of integrals.
#[derive(Debug)]
pub struct Functionals {
    /// With one more unknown, which has no name.
    pub(super) problem: Problem,
    pub(super) integrals: Vec<Integral>,
    /// The number that each integral is part of.
    pub(super) owners: Vec<usize>,
    pub(super) count: usize,
}

impl Functionals {
    /// No numbers yet.
    pub fn new(problem: &Problem) -> Self {
        let mut problem = problem.clone();
        problem.unknowns.push(Unknown {
            name: String::new(),
            test: String::new(),
            space: Space {
                element: Element::Broken(0),
                size: None,
            },
        });
        Functionals {
            problem,
            integrals: Vec::new(),
            owners: Vec::new(),
            count: 0,
        }
    }

    /// Adds a number, as in `inner(grad(u), grad(u))*dx`.
    ///
    /// # Errors
    /// Text that is not in the language, a test function, or a solution at another time.
    pub fn add(&mut self, text: &str) -> std::result::Result<(), Fault> {
        let formula = Formula::new(text.to_owned(), &self.problem.definitions)?;
        let Problem {
            dim,
            cells,
            unknowns,
            parameters,
            data,
            groups,
            scalars,
            ..
        } = &mut self.problem;
        let weight = unknowns.len() - 1;
        let known = unknowns[..weight].iter().map(|unknown| Unknown {
            test: String::new(),
            ..unknown.clone()
        });
        let known: Vec<Unknown> = known.collect();
        let names = Names {
            dim: *dim,
            cells: *cells,
            unknowns: &known,
            parameters,
            data,
            groups,
            unmarked: 0,
            // Only the last time of a result is known.
            is_timed: false,
        };
        let found = Reader::new(names, scalars).number(&formula.term, weight);
        let found = found.map_err(|fault| formula.in_source(fault))?;
        self.owners
            .extend(std::iter::repeat_n(self.count, found.len()));
        self.integrals.extend(found);
        self.count += 1;
        Ok(())
    }

    /// The numbers of a result on a mesh, whose values were written with this relative precision.
    ///
    /// # Errors
    /// A result on another mesh, and fields that are missing or are not functions of the spaces.
    pub fn of(&self, source: &Mesh, result: &Mesh, unit: f64) -> Result<Vec<f64>> {
        let (assembler, u) = self.read(source, result, unit)?;
        let mut found = vec![0.0; self.count];
        for of_cell in self.on_cells(&assembler, &u).chunks(self.count.max(1)) {
            found
                .iter_mut()
                .zip(of_cell)
                .for_each(|(sum, of)| *sum += of);
        }
        Ok(found)
    }

    /// The assembler of these integrals on a mesh, and the dofs of a result there.
    ///
    /// # Errors
    /// Those of [`Functionals::of`].
    pub(super) fn read(
        &self,
        source: &Mesh,
        result: &Mesh,
        unit: f64,
    ) -> Result<(Assembler, Vec<f64>)> {
        let assembler = Assembler::of(&self.problem, source, &self.integrals, false)?;
        let u = read(&assembler, result, unit)?;
        Ok((assembler, u))
    }

    /// The part of each cell in the numbers: a row of them for each.
    pub(super) fn on_cells(&self, assembler: &Assembler, u: &[f64]) -> Vec<f64> {
        let Assembler { mesh, dofs, .. } = assembler;
        let parameters: Vec<f64> = self.problem.parameters.iter().map(|p| p.value).collect();
        let state = State {
            u,
            old: &[],
            parameters: &parameters,
        };
        let weight = self.problem.unknowns.len() - 1;
        let mut found = vec![0.0; mesh.cell_count() * self.count];
        for (k, owner) in self.owners.iter().enumerate() {
            let system = assembler.assemble_only(k, state, Wanted::Residual);
            for cell in 0..mesh.cell_count() {
                let nodes = dofs.of_cell(weight, cell).iter();
                let of_cell = nodes.flat_map(|node| dofs.of_node(*node));
                let sum: f64 = of_cell.map(|dof| system.residual[dof]).sum();
                found[cell * self.count + owner] += sum;
            }
        }
        found
    }
}
