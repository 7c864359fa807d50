//! Modes of two results as subspaces of L²: products of all of them, and how far one subspace is from another.

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use super::clip::measure;
use super::domain::Domain;
use super::function::Function;
use super::map::Local;
use super::norms::{combine, rule_for};
use super::overlay::{Common, overlay};
use crate::On;
use crate::places;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};

/// The modes of two codes: products in L² over what their meshes have in common, by our own integration.
pub struct Modes<'a> {
    sides: [&'a [Results]; 2],
    near: f64,
    /// (a_i, a_k), (a_i, b_j), (b_j, b_k).
    aa: DMatrix<f64>,
    ab: DMatrix<f64>,
    bb: DMatrix<f64>,
}

impl<'a> Modes<'a> {
    /// Modes of either code, each a result with one field; the meshes of the two codes may be others, that of all modes of one code
    /// is the same.
    ///
    /// # Errors
    /// Modes of one code on several meshes; meshes that have nothing in common, or on which fields are not functions.
    pub fn new(a: &'a [Results], b: &'a [Results]) -> Result<Self> {
        let (Some(first), Some(second)) = (a.first(), b.first()) else {
            return Err(Error::usage("there are no modes", "give one at least"));
        };
        let near = places::tolerance(&first.points, &second.points)?;
        let mut modes = Modes {
            sides: [a, b],
            near,
            aa: DMatrix::zeros(a.len(), a.len()),
            ab: DMatrix::zeros(a.len(), b.len()),
            bb: DMatrix::zeros(b.len(), b.len()),
        };
        let none = DMatrix::zeros(a.len(), b.len());
        let all = modes.integrated(&none, true)?;
        let [na, nb] = [a.len(), b.len()];
        modes.aa = all.view((0, 0), (na, na)).into();
        modes.ab = all.view((0, na), (na, nb)).into();
        modes.bb = all.view((na, na), (nb, nb)).into();
        Ok(modes)
    }

    /// |(a_i, b_j)|² / ((a_i, a_i) (b_j, b_j)): 1 where two modes are the same but for a factor, 0 where they are orthogonal. The
    /// modal assurance criterion, one row for each mode of a.
    pub fn assurance(&self) -> Vec<Vec<f64>> {
        let row = |i: usize| {
            let of = |j: usize| self.ab[(i, j)].powi(2) / (self.aa[(i, i)] * self.bb[(j, j)]);
            (0..self.ab.ncols()).map(of).collect()
        };
        (0..self.ab.nrows()).map(row).collect()
    }

    /// For each pair of subspaces, given by the numbers of their modes in a and in b and of the same dimension, the sine of the largest
    /// principal angle between them; none where the modes of one are not independent.
    ///
    /// The sine is the norm of what the projection to the other subspace leaves, which is integrated itself: 1 - cos² would lose half
    /// of the digits.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn sines(&self, subspaces: &[[Vec<usize>; 2]]) -> Result<Vec<Option<f64>>> {
        let mut coefficients = DMatrix::zeros(self.aa.nrows(), self.bb.nrows());
        let mut is_known = Vec::new();
        for [of_a, of_b] in subspaces {
            let gram = self.aa.select_rows(of_a).select_columns(of_a);
            let load = self.ab.select_rows(of_a).select_columns(of_b);
            let solved = independent(&gram).map(|factor| factor.solve(&load));
            is_known.push(solved.is_some());
            let Some(solved) = solved else { continue };
            for (row, i) in of_a.iter().enumerate() {
                for (column, j) in of_b.iter().enumerate() {
                    coefficients[(*i, *j)] = solved[(row, column)];
                }
            }
        }
        let left = self.integrated(&coefficients, false)?;
        let sine = |(known, [_, of_b]): (&bool, &[Vec<usize>; 2])| {
            let left = left.select_rows(of_b).select_columns(of_b);
            let gram = self.bb.select_rows(of_b).select_columns(of_b);
            let factor = independent(&gram).filter(|_| *known)?;
            let half = factor.l().solve_lower_triangular(&left)?;
            let both = factor.l().solve_lower_triangular(&half.transpose())?;
            let squares = SymmetricEigen::new((&both + both.transpose()) * 0.5).eigenvalues;
            Some(squares.max().max(0.0).sqrt())
        };
        Ok(is_known.iter().zip(subspaces).map(sine).collect())
    }

    /// Products of all modes, a before b; or of b_j - Σ c_ij a_i with each other.
    fn integrated(&self, coefficients: &DMatrix<f64>, all: bool) -> Result<DMatrix<f64>> {
        let [a, b] = self.sides;
        let domains = [
            &Domain::new(&a[0], self.near)?,
            &Domain::new(&b[0], self.near)?,
        ];
        let mut functions = [functions(a)?, functions(b)?];
        let components = || functions.iter().flatten().map(|f| f.components);
        // In the plane a vector may have a third component, 0, as VTK requires.
        if domains[0].dim == 2 && components().all(|n| n == 2 || n == 3) {
            let most = components().max().unwrap_or_default();
            let each = functions.iter_mut().flatten();
            each.for_each(|f| f.components = most);
        }
        let functions = [&functions[0][..], &functions[1][..]];
        let components = functions[0][0].components;
        let other = functions.iter().flat_map(|of| of.iter());
        if let Some(one) = other.map(|f| f.components).find(|n| *n != components) {
            return Err(Error::usage(
                format!("one mode has {components} components, another {one}"),
                "write modes with the same components",
            ));
        }
        let rule = rule_for(domains, functions);
        let dim = domains[0].dim;
        let [na, nb] = [a.len(), b.len()];
        let size = if all { na + nb } else { nb };
        let state = || {
            let sides = [0, 1].map(|k| Local::new(domains[k], functions[k]));
            (sides, vec![0.0; na + nb], DMatrix::<f64>::zeros(size, size))
        };
        type State<'a> = ([Local<'a>; 2], Vec<f64>, DMatrix<f64>);
        let visit = |(sides, values, sum): &mut State, common: &Common| {
            let cells = common.pieces.map(|piece| piece.cell);
            let both = sides.iter_mut().zip(cells);
            both.for_each(|(side, cell)| side.turn_to(cell, &common.frame));
            for simplex in common.simplices {
                let volume = measure(dim, simplex);
                for (lambda, weight) in &rule.points {
                    let place = combine(simplex, lambda);
                    sides.iter_mut().for_each(|side| side.evaluate(&place));
                    for component in 0..components {
                        for i in 0..na {
                            values[i] = sides[0].values[i * components + component][0];
                        }
                        for j in 0..nb {
                            values[na + j] = sides[1].values[j * components + component][0];
                        }
                        if !all {
                            for j in 0..nb {
                                let part = (0..na).map(|i| coefficients[(i, j)] * values[i]);
                                let part: f64 = part.sum();
                                values[na + j] -= part;
                            }
                        }
                        let values = &values[na + nb - size..];
                        for i in 0..size {
                            for j in 0..size {
                                sum[(i, j)] += weight * volume * values[i] * values[j];
                            }
                        }
                    }
                }
            }
        };
        let mut sum = DMatrix::zeros(size, size);
        let merge = |(_, _, of): State| sum += of;
        overlay(domains, state, visit, merge, &|_| {})?;
        Ok(sum)
    }
}

/// The factor of a Gram matrix whose functions are independent.
fn independent(gram: &DMatrix<f64>) -> Option<Cholesky<f64, nalgebra::Dyn>> {
    let factor = Cholesky::new(gram.clone())?;
    let diagonal = factor.l().diagonal();
    let scale: f64 = (0..gram.nrows())
        .map(|k| gram[(k, k)].sqrt())
        .fold(0.0, f64::max);
    // 1e-6 is what is left of a vector that is another one but for rounding and errors of iterations.
    (diagonal.min() > 1e-6 * scale).then_some(factor)
}

/// The one field of each result, as functions on the mesh of the first.
fn functions(side: &[Results]) -> Result<Vec<Function<'_>>> {
    let first = &side[0];
    side.iter()
        .map(|results| {
            let all = [
                (On::Points, &results.on_points),
                (On::Cells, &results.on_cells),
                (On::Corners, &results.on_corners),
            ];
            let fields = all
                .into_iter()
                .flat_map(|(on, fields)| fields.iter().map(move |f| (on, f)));
            let fields: Vec<(On, &ResultField)> = fields.collect();
            let same = results.cells == first.cells && results.points == first.points;
            match fields[..] {
                [(on, field)] if same => Ok(Function::new(field, on)),
                [_] => Err(Error::Mesh {
                    mesh: results.source.clone(),
                    what: format!("its mesh is not that of {}", first.source),
                    remedy:
                        "write all modes of a code on one mesh, in one order of points and cells"
                            .into(),
                }),
                _ => Err(Error::usage(
                    format!(
                        "{} has {} fields that could be the mode",
                        results.source,
                        fields.len()
                    ),
                    "give one",
                )),
            }
        })
        .collect()
}
