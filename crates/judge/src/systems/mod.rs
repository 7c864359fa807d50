//! Two linear systems A u = b of different codes: do they state the same equations, and if not, which rows, which terms and which constants differ?
//!
//! This does not depend on a form. The rows of both are matched by the functionals that define their dofs ([`Matched`]); constrained rows are recognised however a code keeps
//! them; and D = A - P B Pᵀ is analysed by rows ([`compare`]).
//!
//! ```
//! use faceoff_judge::systems::{Settings, System, compare};
//! use faceoff_mesh::io::{Coordinates, DofTable};
//!
//! # fn main() -> faceoff_mesh::Result<()> {
//! // u'' on two cells, with the rows in different orders, and twice as stiff.
//! let system = |name: &str, order: [u32; 3], factor: f64| {
//!     let rows = [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 4.0), (1, 2, -2.0), (2, 1, -2.0), (2, 2, 2.0)];
//!     let entries = rows.map(|(i, j, a): (usize, usize, f64)| (order[i], order[j], factor * a)).to_vec();
//!     let mut at = vec![[0.0; 3]; 3];
//!     (0..3).for_each(|k| at[order[k] as usize][0] = 0.5 * k as f64);
//!     let dofs = DofTable { names: vec!["u".into()], field: vec![0; 3], at, direction: vec![[1.0, 0.0, 0.0]; 3], values: None };
//!     System::new(name, Coordinates { rows: 3, columns: 3, entries }, vec![1.0; 3], dofs)
//! };
//! let found = compare(&system("a", [0, 1, 2], 1.0)?, &system("b", [2, 0, 1], 2.0)?, &Settings::default())?;
//! assert_eq!(found.matrix[0].factor, Some(2.0));
//! # Ok(())
//! # }
//! ```

mod difference;
mod groups;
mod held;
mod matching;
mod matrix;
mod probes;
#[cfg(test)]
mod tests;

pub use difference::{Block, Both, Loads, Residuals, compare};
pub use groups::{Region, Where};
pub use held::{Constrained, Kept};
pub use matching::{Matched, matched};
pub use matrix::Matrix;
pub use probes::{Energies, Kernel};

use serde::Serialize;

use super::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io::{Coordinates, DofTable};

/// A linear system A u = b with the description of its dofs.
#[derive(Debug, Clone)]
pub struct System {
    /// Its name in reports.
    pub name: String,
    /// A.
    pub matrix: Matrix,
    /// b.
    pub load: Vec<f64>,
    /// One row per dof.
    pub dofs: DofTable,
}

impl System {
    /// A system from the entries of A in any order; entries at the same position are added.
    ///
    /// # Errors
    /// Row counts that differ, or numbers that are not finite; an empty system; a dof that vanishes for all constant fields.
    pub fn new(name: &str, matrix: Coordinates, load: Vec<f64>, dofs: DofTable) -> Result<Self> {
        let refuse = |what: String, remedy: &str| Error::engine(name, what, remedy);
        let count = dofs.at.len();
        if matrix.rows != count || matrix.columns != count || load.len() != count || count == 0 {
            let (rows, columns, loads) = (matrix.rows, matrix.columns, load.len());
            let what = format!(
                "its matrix is {rows} × {columns}, its right-hand side has {loads} rows, and its table {count} dofs"
            );
            return Err(refuse(what, "write one row of each per dof"));
        }
        let entries = matrix.entries.iter().map(|(.., a)| a);
        let of_dofs = dofs.at.iter().chain(&dofs.direction).flatten();
        let of_dofs = of_dofs.chain(dofs.values.iter().flatten());
        if !entries.chain(&load).chain(of_dofs).all(|x| x.is_finite()) {
            let what = "it has a number that is not finite".to_owned();
            return Err(refuse(
                what,
                "see what the code assembled where that number is",
            ));
        }
        if let Some(k) = dofs
            .direction
            .iter()
            .position(|d| d.iter().all(|x| *x == 0.0))
        {
            let [x, y, z] = dofs.at[k];
            let what = format!(
                "dof {k} of {}, at ({x}, {y}, {z}), is 0 for every constant field, as those of a hierarchical basis are, so that it cannot be matched",
                dofs.names[usize::from(dofs.field[k])]
            );
            return Err(refuse(
                what,
                "use a nodal basis, or lowest-order moments on facets or edges",
            ));
        }
        Ok(System {
            name: name.to_owned(),
            matrix: Matrix::new(count, matrix.entries),
            load,
            dofs,
        })
    }
}

/// How systems are compared.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// The tolerance: for entries, relative to the largest one of their row and block; for loads, relative to the largest one of their field. 0 means 1e-12.
    pub rtol: f64,
    /// The volume of the domain, which turns energies into material constants.
    pub volume: Option<f64>,
    /// Named parts of the mesh, by which reports describe places.
    pub regions: Vec<Region>,
}

/// The result of comparing two systems; row indices are those of the first one.
#[derive(Debug, Clone, Serialize)]
pub struct Compared {
    /// The first system's name.
    pub a: String,
    /// The second one's.
    pub b: String,
    /// Agree if all equations are the same.
    pub verdict: Verdict,
    /// The number of matched dofs.
    pub dofs: usize,
    /// Those of them whose sign or scaling differs.
    pub rescaled: usize,
    /// Rows that both systems leave free.
    pub free: usize,
    /// Constrained rows of both.
    pub constrained: Constrained,
    /// One per pair of fields that is coupled.
    pub matrix: Vec<Block>,
    /// The right-hand sides, by field.
    pub load: Vec<Loads>,
    /// For each field: the remainder of constants, rotations and gradients in the rows of both.
    pub kernels: Vec<Kernel>,
    /// The energies of constant gradients, in both; empty if rows are constrained.
    pub energies: Vec<Energies>,
    /// If the answers are known: the residual of each in its own system and in the other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
    /// For each row that differs, its position, and the largest difference relative to its entries or the load.
    #[serde(skip)]
    pub rows: Vec<([f64; 3], f64)>,
}
