//! The linear parts of the method on any of the elements: (∇u, ∇v)_h, (f, v), <t, v>_N, and the
//! norms of the broken spaces. No matrix is put together, but for iterations: its products are sums over the cells,
//! which all cores form and one adds up in the cells' order, so that no bit depends on their number.

mod face_points;
mod graph;
mod iterated;
mod load;
mod quadratic;

use std::sync::{Arc, OnceLock};

use crate::element::{MAX_DOFS, Space};
use crate::linear::{Elements, clear, zeros};
use crate::quadrature::{self, Rule};
pub use face_points::{FacePoint, FacePoints};
use faceoff_mesh::mesh::Metric;
use faceoff_mesh::parallel;
pub(crate) use iterated::{Free, Iterated, iterations};
pub use load::{add_load, add_traction, value_at};

/// Cells whose contributions wait to be added, and how many of them one task forms.
const WAITING: usize = 1 << 15;
const TASK: usize = 256;

/// A rule that integrates products of gradients exactly: degree 2(k-1).
fn gradient_rule(space: &Space) -> Rule {
    quadrature::exact(space.mesh.dim, 2 * (space.element.degree() - 1))
}

/// A rule that integrates products of functions exactly: degree 2k.
fn value_rule(space: &Space) -> Rule {
    quadrature::exact(space.mesh.dim, 2 * space.element.degree())
}

/// Σ over the cells of vectors on their dofs. `form` takes a range of cells and writes the
/// local vectors one after the other.
pub(crate) fn sum_over_cells(
    space: &Space,
    form: impl Fn(std::ops::Range<usize>, &mut [f64]) + Sync,
) -> Vec<f64> {
    let mut sum = zeros(space.dofs);
    add_over_cells(space, &mut sum, form);
    sum
}

/// Adds the same to `sum`.
fn add_over_cells(
    space: &Space,
    sum: &mut [f64],
    form: impl Fn(std::ops::Range<usize>, &mut [f64]) + Sync,
) {
    let (cells, local) = (space.mesh.cell_count(), space.local_dofs);
    let of = |first: usize| first..(first + WAITING).min(cells);
    let form = |first: usize, vectors: &mut [f64]| {
        let vectors = &mut vectors[..of(first).len() * local];
        let tasks = vectors.chunks_mut(TASK * local).enumerate();
        parallel::map(tasks, |(k, vectors)| {
            let from = first + k * TASK;
            form(from..from + vectors.len() / local, vectors);
        });
    };
    let mut add = |first: usize, vectors: &[f64]| {
        for (&dof, value) in space.dofs_of_cells(of(first)).iter().zip(vectors) {
            sum[dof as usize] += value;
        }
    };
    // What was formed is added up while the next is.
    let room = || vec![0.0; cells.min(WAITING) * local];
    let mut formed = room();
    let mut next = if cells > WAITING { room() } else { Vec::new() };
    form(0, &mut formed);
    for first in (0..cells).step_by(WAITING) {
        if first + WAITING < cells {
            rayon::join(|| add(first, &formed), || form(first + WAITING, &mut next));
            std::mem::swap(&mut formed, &mut next);
        } else {
            add(first, &formed);
        }
    }
}

/// Σ over the cells of numbers, always in the same order.
fn total_over_cells(space: &Space, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    let count = space.mesh.cell_count();
    let parts = parallel::map((0..count).step_by(TASK), |from| {
        (from..count.min(from + TASK)).map(&value).sum::<f64>()
    });
    parts.iter().sum()
}

/// (∇φ_j, ∇φ_i)_h, all dofs.
///
/// As Σ_i ∇λ_i = 0, a cell's matrix is -Σ_{i<j} |κ| ∇λ_i·∇λ_j R_ij with matrices R_ij that are the
/// same for all cells: R_ij[a, b] is the mean of (∂_i - ∂_j)φ_a (∂_i - ∂_j)φ_b, ∂_i = ∂/∂λ_i. Its
/// rows sum to 0 whatever the shape of the cell.
pub struct Stiffness<'a> {
    space: Space<'a>,
    /// i, j and R_ij.
    pairs: Vec<(usize, usize, Vec<f64>)>,
    /// Whether R_ij is c (e_i - e_j)(e_i - e_j)ᵀ, which holds if there are as many dofs as vertices.
    is_graph: bool,
    /// -|κ| ∇λ_i·∇λ_j of all cells, where they are kept.
    weights: Arc<OnceLock<Vec<f64>>>,
}

impl Elements for Stiffness<'_> {
    fn unknowns(&self) -> usize {
        self.space.dofs
    }

    fn count(&self) -> usize {
        self.space.mesh.cell_count()
    }

    fn size(&self) -> usize {
        self.space.local_dofs
    }

    fn of(&self, cell: usize) -> &[u32] {
        self.space.cell_dofs(cell)
    }

    fn centre(&self, cell: usize) -> [f64; 3] {
        self.space.mesh.cell_midpoint(cell)
    }

    fn matrix(&self, cell: usize, matrix: &mut [f64]) {
        self.cell_matrix(cell, matrix);
    }

    #[inline]
    fn row(&self, cell: usize, row: usize, values: &mut [f64]) {
        let local = self.space.local_dofs;
        if !self.is_graph {
            return self.part(cell, row * local..(row + 1) * local, values);
        }
        let weights = self.weights_at(cell);
        values[row] = 0.0;
        for other in (0..local).filter(|other| *other != row) {
            // As the pairs are numbered, see [`Stiffness::new`].
            let (i, j) = (other.min(row), other.max(row));
            let pair = j * (j - 1) / 2 + i;
            let value = weights[pair] * self.pairs[pair].2[i * local + i];
            values[row] += value;
            values[other] = -value;
        }
    }
}

impl<'a> Stiffness<'a> {
    /// Takes the geometry and the rule of a space.
    pub fn new(space: &Space<'a>) -> Self {
        let (rule, dim, local) = (gradient_rule(space), space.mesh.dim, space.local_dofs);
        let mut pairs = Vec::new();
        for j in 0..=dim {
            for i in 0..j {
                let mut reference = vec![0.0; local * local];
                for (lambda, weight) in rule.iter() {
                    let slopes = space.element.derivatives(dim, &lambda);
                    for a in 0..local {
                        for b in 0..local {
                            reference[a * local + b] += weight
                                * (slopes[a][i] - slopes[a][j])
                                * (slopes[b][i] - slopes[b][j]);
                        }
                    }
                }
                pairs.push((i, j, reference));
            }
        }
        let is_graph = |(i, j, reference): &(usize, usize, Vec<f64>)| {
            let sign = |a: usize| f64::from(a == *i) - f64::from(a == *j);
            let scale = reference[i * local + i];
            let places = (0..local).flat_map(|a| (0..local).map(move |b| (a, b)));
            let mut entries = places.zip(reference);
            entries.all(|((a, b), r)| *r == scale * sign(a) * sign(b))
        };
        Stiffness {
            is_graph: local == dim + 1 && pairs.iter().all(is_graph),
            space: space.clone(),
            pairs,
            weights: Arc::default(),
        }
    }

    /// Whose dofs it has.
    pub fn space(&self) -> &Space<'a> {
        &self.space
    }

    /// Keeps what it takes of the cells' geometry, for many products: 24 bytes a triangle, 48 a tetrahedron.
    pub fn keep(&self) {
        self.weights.get_or_init(|| {
            let count = self.pairs.len();
            let mut weights = vec![0.0; count * self.space.mesh.cell_count()];
            let tasks = weights.chunks_mut(TASK * count).enumerate();
            parallel::map(tasks, |(k, weights)| {
                for (cell, weights) in (k * TASK..).zip(weights.chunks_exact_mut(count)) {
                    weights.copy_from_slice(&self.weights_of(cell)[..count]);
                }
            });
            weights
        });
    }

    /// [`Stiffness::keep`], in passing.
    pub fn kept(self) -> Self {
        self.keep();
        self
    }

    /// On another space of the same mesh, with what was kept.
    pub fn on<'b>(&self, space: &Space<'b>) -> Stiffness<'b> {
        Stiffness {
            weights: Arc::clone(&self.weights),
            ..Stiffness::new(space)
        }
    }

    fn weights_of(&self, cell: usize) -> [f64; 6] {
        let mesh = self.space.mesh;
        let metric = Metric::new(mesh.dim, &mesh.vertices(cell));
        let mut weights = [0.0; 6];
        for (weight, (i, j, _)) in weights.iter_mut().zip(&self.pairs) {
            *weight = -metric.products[*i][*j];
        }
        weights
    }

    /// The matrix of one cell, `local_dofs`² places, symmetric.
    pub fn cell_matrix(&self, cell: usize, matrix: &mut [f64]) {
        if !self.is_graph {
            return self.part(cell, 0..matrix.len(), matrix);
        }
        let local = self.space.local_dofs;
        matrix.fill(0.0);
        self.for_each_pair(cell, |weight, i, j, reference| {
            let value = weight * reference[i * local + i];
            matrix[i * local + i] += value;
            matrix[j * local + j] += value;
            matrix[i * local + j] = -value;
            matrix[j * local + i] = -value;
        });
    }

    /// -|κ| ∇λ_i·∇λ_j, i, j and R_ij.
    fn for_each_pair(&self, cell: usize, mut visit: impl FnMut(f64, usize, usize, &[f64])) {
        for (weight, (i, j, reference)) in self.weights_at(cell).iter().zip(&self.pairs) {
            visit(*weight, *i, *j, reference);
        }
    }

    /// -|κ| ∇λ_i·∇λ_j of the pairs, as they are kept or anew.
    fn weights_at(&self, cell: usize) -> [f64; 6] {
        let Some(kept) = self.weights.get() else {
            return self.weights_of(cell);
        };
        // Of known lengths: to copy three numbers is not a call.
        match kept.as_chunks::<3>().0 {
            of_cells if self.pairs.len() == 3 => {
                let [a, b, c] = of_cells[cell];
                [a, b, c, 0.0, 0.0, 0.0]
            }
            _ => kept.as_chunks().0[cell],
        }
    }

    /// The entries of one cell's matrix at these places.
    fn part(&self, cell: usize, places: std::ops::Range<usize>, entries: &mut [f64]) {
        entries.fill(0.0);
        self.for_each_pair(cell, |weight, _, _, reference| {
            for (value, r) in entries.iter_mut().zip(&reference[places.clone()]) {
                *value += weight * r;
            }
        });
    }

    /// y_i = Σ_j product(A_ij, u_j) on one cell.
    pub fn cell_times(
        &self,
        cell: usize,
        u: &[f64],
        y: &mut [f64],
        product: impl Fn(f64, f64) -> f64,
    ) {
        // Loops whose lengths are known are several times as fast.
        match self.space.local_dofs {
            3 => self.times_of::<3>(cell, u, y, product),
            4 => self.times_of::<4>(cell, u, y, product),
            6 => self.times_of::<6>(cell, u, y, product),
            _ => self.times_of::<MAX_DOFS>(cell, u, y, product),
        }
    }

    #[inline]
    fn times_of<const L: usize>(
        &self,
        cell: usize,
        u: &[f64],
        y: &mut [f64],
        product: impl Fn(f64, f64) -> f64,
    ) {
        let (mut matrix, mut at) = ([[0.0; L]; L], [0.0; L]);
        let flat = matrix.as_flattened_mut();
        if self.is_graph {
            self.cell_matrix(cell, flat);
        } else {
            self.for_each_pair(cell, |weight, _, _, reference| {
                for (value, r) in flat.iter_mut().zip(reference) {
                    *value += weight * r;
                }
            });
        }
        for (at, &dof) in at.iter_mut().zip(self.space.cell_dofs(cell)) {
            *at = u[dof as usize];
        }
        for (y, row) in y.iter_mut().zip(&matrix) {
            *y = row.iter().zip(&at).map(|(a, u)| product(*a, *u)).sum();
        }
    }

    fn products(&self, u: &[f64], y: &mut [f64], product: impl Fn(f64, f64) -> f64 + Sync + Copy) {
        let local = self.space.local_dofs;
        clear(y);
        add_over_cells(&self.space, y, |cells, vectors| {
            for (cell, y) in cells.zip(vectors.chunks_exact_mut(local)) {
                self.cell_times(cell, u, y, product);
            }
        });
    }

    /// A u
    pub fn times(&self, u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.space.dofs];
        self.times_into(u, &mut y);
        y
    }

    /// A u, into `y`.
    pub fn times_into(&self, u: &[f64], y: &mut [f64]) {
        let Space { mesh, element, .. } = self.space;
        match (mesh.dim, element.degree()) {
            (2, 2) => self.times_quadratic::<3, 6>(u, y),
            (3, 2) => self.times_quadratic::<4, 10>(u, y),
            (2, _) if self.is_graph => self.times_graph::<3>(u, y),
            (3, _) if self.is_graph => self.times_graph::<4>(u, y),
            _ => self.products(u, y, |a, u| a * u),
        }
    }

    /// a_ii
    pub fn diagonal(&self) -> Vec<f64> {
        let local = self.space.local_dofs;
        sum_over_cells(&self.space, |cells, vectors| {
            for (cell, diagonal) in cells.zip(vectors.chunks_exact_mut(local)) {
                diagonal.fill(0.0);
                self.for_each_pair(cell, |weight, _, _, reference| {
                    let own = reference.iter().step_by(local + 1);
                    let pairs = diagonal.iter_mut().zip(own);
                    pairs.for_each(|(d, r)| *d += weight * r);
                });
            }
        })
    }

    /// Σ_j |A_ij u_j|, the entries of each cell counted for themselves.
    pub fn sizes(&self, u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.space.dofs];
        match self.space.mesh.dim {
            2 if self.is_graph => self.sizes_graph::<3>(u, &mut y),
            3 if self.is_graph => self.sizes_graph::<4>(u, &mut y),
            _ => self.products(u, &mut y, |a, u| (a * u).abs()),
        }
        y
    }

    /// uᵀ A u = ‖∇u‖²_h, from cell to cell without what is constant there, which would leave rounding of that size.
    pub fn energy(&self, u: &[f64]) -> f64 {
        total_over_cells(&self.space, |cell| {
            let mut y = [0.0; MAX_DOFS];
            let local = self.space.local(cell, u);
            let first = local[0];
            self.cell_times(cell, u, &mut y, |a, u| a * (u - first));
            let local = &local[..self.space.local_dofs];
            y.iter().zip(local).map(|(y, u)| y * (u - first)).sum()
        })
    }

    /// Visits the entries of the cells' matrices: row, column, value. An entry of the whole is
    /// the sum of what is passed for it.
    pub fn for_each(
        &self,
        cells: impl Iterator<Item = usize>,
        mut visit: impl FnMut(u32, u32, f64),
    ) {
        let local = self.space.local_dofs;
        let mut matrix = vec![0.0; local * local];
        for cell in cells {
            self.cell_matrix(cell, &mut matrix);
            let dofs = self.space.cell_dofs(cell);
            for (&i, row) in dofs.iter().zip(matrix.chunks_exact(local)) {
                for (&j, value) in dofs.iter().zip(row) {
                    visit(i, j, *value);
                }
            }
        }
    }
}

/// ‖u‖²
pub fn norm_squared(space: &Space, u: &[f64]) -> f64 {
    // One matrix for all cells, up to their measure.
    let mut reference = [[0.0; MAX_DOFS]; MAX_DOFS];
    for (lambda, weight) in value_rule(space).iter() {
        let phi = space.element.values(space.mesh.dim, &lambda);
        for i in 0..space.local_dofs {
            for j in 0..space.local_dofs {
                reference[i][j] += weight * phi[i] * phi[j];
            }
        }
    }
    total_over_cells(space, |cell| {
        let u = space.local(cell, u);
        let rows = reference.iter().zip(&u);
        let sum: f64 = rows
            .map(|(row, ui)| ui * row.iter().zip(&u).map(|(m, uj)| m * uj).sum::<f64>())
            .sum();
        space.mesh.measure(cell) * sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, P2};
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::union_jack;

    fn polynomial(space: &Space, p: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
        space.points().map(p).collect()
    }

    /// Against the integral of the gradients' products, formed in the plainest way.
    #[test]
    fn cells_matrices_are_integrals_of_gradients() {
        let points = [[0.1, 0.0, 0.0], [2.0, 0.3, 0.0], [0.4, 0.9, 0.0]];
        let mesh = faceoff_mesh::mesh::Mesh {
            points: points.to_vec().into(),
            blocks: vec![faceoff_mesh::mesh::CellBlock::new(
                faceoff_mesh::mesh::CellKind::Triangle,
                vec![0, 1, 2],
            )],
            ..Default::default()
        };
        let mesh = Triangulation::new("one", &mesh).unwrap();
        for element in [&CR as &'static dyn Element, &P1, &P2] {
            let space = Space::new(&mesh, element);
            let (local, geometry) = (space.local_dofs, mesh.geometry(0));
            let mut matrix = vec![0.0; local * local];
            Stiffness::new(&space).cell_matrix(0, &mut matrix);
            for (lambda, weight) in gradient_rule(&space).iter() {
                let gradients = space.gradients(&geometry, &lambda);
                for i in 0..local {
                    for j in 0..local {
                        let product = gradients[i].dot(&gradients[j]);
                        matrix[i * local + j] -= weight * geometry.measure() * product;
                    }
                }
            }
            assert!(matrix.iter().all(|rest| rest.abs() < 1e-14), "{matrix:?}");
        }
    }

    /// In 2D and in 3D, of elements with one dof a vertex or a face and with more.
    #[test]
    fn a_row_is_that_of_the_cells_matrix() {
        for scene in ["plate", "block"] {
            let scene = crate::scene::Scene::find(scene).unwrap();
            let mesh = scene.triangulation(None).unwrap();
            for element in [&CR as &'static dyn Element, &P1, &P2] {
                let space = Space::new(&mesh, element);
                let (local, stiffness) = (space.local_dofs, Stiffness::new(&space));
                let (mut matrix, mut row) = (vec![0.0; local * local], vec![7.0; local]);
                for cell in [0, mesh.cell_count() - 1] {
                    stiffness.cell_matrix(cell, &mut matrix);
                    for i in 0..local {
                        stiffness.row(cell, i, &mut row);
                        for (a, b) in row.iter().zip(&matrix[i * local..]) {
                            assert!((a - b).abs() < 1e-14 * matrix[0].abs(), "{a} {b}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn norms_of_polynomials_are_exact() {
        let mesh = Triangulation::new("uj", &union_jack(3, [2.0, 1.0])).unwrap();
        // Two bodies, whose values have no large part in common.
        let bodies = faceoff_mesh::mesh::Mesh {
            points: [0.0, 9.0]
                .map(|x| [[x, 0.0, 0.0], [x + 0.9, 0.1, 0.0], [x + 0.2, 0.7, 0.0]])
                .concat()
                .into(),
            blocks: vec![faceoff_mesh::mesh::CellBlock::new(
                faceoff_mesh::mesh::CellKind::Triangle,
                (0..6).collect(),
            )],
            ..Default::default()
        };
        let bodies = Triangulation::new("bodies", &bodies).unwrap();
        for element in [&CR as &'static dyn Element, &P1, &P2] {
            let space = Space::new(&mesh, element);
            let u = polynomial(&space, |x| 1.0 + 2.0 * x[0] - 3.0 * x[1]);
            let stiffness = Stiffness::new(&space);
            assert!((stiffness.energy(&u) - 26.0).abs() < 1e-12);
            let lifted: Vec<f64> = u.iter().map(|u| u + 1e8).collect();
            assert!((stiffness.energy(&lifted) - 26.0).abs() < 1e-5);
            let apart = Space::new(&bodies, element);
            let lift = |x: f64| if x < 5.0 { 0.0 } else { 1e8 };
            let of_bodies = polynomial(&apart, |x| 2.0 * x[0] - 3.0 * x[1] + lift(x[0]));
            let energy = Stiffness::new(&apart).energy(&of_bodies);
            assert!((energy - 13.0 * 0.61).abs() < 1e-5, "{energy}");
            let products = stiffness.times(&u).into_iter().zip(&u);
            assert!((products.map(|(y, u)| y * u).sum::<f64>() - 26.0).abs() < 1e-12);
            // ∫∫ (1 + 2x - 3y)² over (0,2) × (0,1)
            assert!((norm_squared(&space, &u) - 26.0 / 3.0).abs() < 1e-12);
        }
        let space = Space::new(&mesh, &P2);
        let u = polynomial(&space, |x| x[0] * x[1]);
        assert!((Stiffness::new(&space).energy(&u) - (8.0 / 3.0 + 2.0 / 3.0)).abs() < 1e-12);
        assert!((norm_squared(&space, &u) - 8.0 / 9.0).abs() < 1e-12);
    }
}
