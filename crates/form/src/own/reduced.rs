//! The equations of a step of Newton's method: those of the free dofs, and the prescribed means with one multiplier each.

use faceoff_fem::linear::General;
use faceoff_mesh::error::{Error, Result};

use super::assemble::{Assembler, System};
use super::held::{Held, means};
use super::places::places;

/// The equations that remain after elimination of prescribed dofs.
pub struct Reduced<'a> {
    assembler: &'a Assembler,
    held: &'a Held,
    /// For each prescribed mean the integrals of the basis functions, and the value of their sum.
    means: Vec<(Vec<f64>, f64)>,
    /// The free dofs, and the number of each dof among them.
    free: Vec<usize>,
    numbers: Vec<Option<usize>>,
    /// The positions of the free dofs.
    places: Vec<[f64; 3]>,
    factor: Option<General>,
}

impl<'a> Reduced<'a> {
    /// The equations before the first step.
    pub fn new(assembler: &'a Assembler, held: &'a Held) -> Self {
        let free: Vec<usize> = (0..held.is_held.len())
            .filter(|k| !held.is_held[*k])
            .collect();
        let mut numbers = vec![None; held.is_held.len()];
        for (number, dof) in free.iter().enumerate() {
            numbers[*dof] = Some(number);
        }
        let all = places(assembler);
        Reduced {
            assembler,
            held,
            means: means(&assembler.problem, &assembler.mesh, &assembler.dofs),
            places: free.iter().map(|dof| all[*dof].2).collect(),
            free,
            numbers,
            factor: None,
        }
    }

    /// The increment to subtract from u. A system without a matrix uses that of the last call.
    ///
    /// # Errors
    /// A singular matrix.
    pub fn solve(&mut self, system: &System, u: &[f64]) -> Result<Vec<f64>> {
        let mut d = vec![0.0; u.len()];
        for (k, d) in d.iter_mut().enumerate() {
            if self.held.is_held[k] {
                *d = u[k] - self.held.values[k];
            }
        }
        let mut b: Vec<f64> = self.free.iter().map(|dof| system.residual[*dof]).collect();
        if !system.matrix.is_empty() {
            let rows = self.rows(&system.matrix, &d, &mut b);
            self.factor = Some(General::new(rows, &self.places, self.factor.take())?);
        }
        let factor = self.factor.as_ref().ok_or_else(|| Error::Solver {
            what: "there is no matrix".into(),
            remedy: "assemble one first".into(),
        })?;
        b.extend(self.means.iter().map(|(row, wanted)| {
            let all = row.iter().zip(u).zip(&d);
            // The increments of free dofs are not known yet, and 0 here.
            all.map(|((r, u), d)| r * (u - d)).sum::<f64>() - wanted
        }));
        for (dof, value) in self.free.iter().zip(factor.solve(&b)?) {
            d[*dof] = value;
        }
        Ok(d)
    }

    /// The rows of the matrix; the contributions of the increments d of prescribed dofs are moved to the right-hand side.
    fn rows(&self, matrix: &[f64], d: &[f64], right: &mut [f64]) -> Vec<Vec<(usize, f64)>> {
        let count = self.free.len();
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); count];
        let Assembler { pattern, dofs, .. } = self.assembler;
        pattern.for_rows(dofs, |dof, columns, at| {
            let Some(row) = self.numbers[dof] else { return };
            rows[row].reserve(columns.len() + self.means.len());
            for (column, value) in columns.iter().zip(&matrix[at..]) {
                match self.numbers[*column as usize] {
                    Some(column) => rows[row].push((column, *value)),
                    None => right[row] -= value * d[*column as usize],
                }
            }
            let means = self.means.iter().map(|(mean, _)| mean[dof]).enumerate();
            let means = means.filter(|(_, value)| *value != 0.0);
            rows[row].extend(means.map(|(k, value)| (count + k, value)));
        });
        rows.extend(self.means.iter().map(|(mean, _)| {
            let of_free = self.free.iter().map(|dof| mean[*dof]).enumerate();
            of_free.filter(|(_, value)| *value != 0.0).collect()
        }));
        rows
    }
}
