//! Products with the matrices of P1 and of Crouzeix and Raviart, which are those of a graph: the row of i has Σ_j c_ij (u_i - u_j).

use super::{Stiffness, add_over_cells, clear};

impl Stiffness<'_> {
    /// A u on cells with L corners, into `y`.
    pub(super) fn times_graph<const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        self.over_graph::<L>(u, y, |at, weights, y| {
            for_each_pair::<L>(weights, |weight, i, j| {
                let flux = weight * (at[i] - at[j]);
                y[i] += flux;
                y[j] -= flux;
            });
        });
    }

    /// Σ_j |A_ij u_j|, the entries of each cell counted for themselves, into `y`.
    pub(super) fn sizes_graph<const L: usize>(&self, u: &[f64], y: &mut [f64]) {
        self.over_graph::<L>(u, y, |at, weights, y| {
            let mut own = [0.0; L];
            for_each_pair::<L>(weights, |weight, i, j| {
                own[i] += weight;
                own[j] += weight;
                y[i] += (weight * at[j]).abs();
                y[j] += (weight * at[i]).abs();
            });
            for ((y, own), at) in y.iter_mut().zip(own).zip(at) {
                *y += (own * at).abs();
            }
        });
    }

    /// Σ over the cells of what `form` adds up from u on the cell, scaled, and -|κ| ∇λ_i·∇λ_j of the pairs, into `y`.
    fn over_graph<const L: usize>(
        &self,
        u: &[f64],
        y: &mut [f64],
        form: impl Fn(&[f64; L], &[f64], &mut [f64; L]) + Sync,
    ) {
        // The same for all pairs, as the elements are symmetric.
        let scale = self
            .pairs
            .first()
            .map_or(0.0, |(i, _, reference)| reference[i * L + i]);
        let pairs = const { L * (L - 1) / 2 };
        let kept = self.weights.get();
        clear(y);
        add_over_cells(&self.space, y, |cells, vectors| {
            let dofs = self.space.dofs_of_cells(cells.clone()).as_chunks().0;
            let of_cells = dofs.iter().zip(vectors.as_chunks_mut().0);
            for (cell, (dofs, y)) in cells.zip(of_cells) {
                let at: &[u32; L] = dofs;
                let at = at.map(|dof| scale * u[dof as usize]);
                let anew;
                let weights = match kept {
                    Some(kept) => &kept[cell * pairs..][..pairs],
                    None => {
                        anew = self.weights_of(cell);
                        &anew[..pairs]
                    }
                };
                *y = [0.0; L];
                form(&at, weights, y);
            }
        });
    }
}

/// Visits the pairs i < j of L, in the order of the weights, with lengths that are known.
#[inline(always)]
fn for_each_pair<const L: usize>(weights: &[f64], mut visit: impl FnMut(f64, usize, usize)) {
    let mut pair = 0;
    for j in 0..L {
        for i in 0..j {
            visit(weights[pair], i, j);
            pair += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, Space};
    use faceoff_mesh::Triangulation;
    use faceoff_mesh::mesh::generate::{union_cube, union_jack};

    /// Both sums against those over the entries of all cells.
    #[test]
    fn products_and_sizes_are_the_sums_over_the_entries() {
        let mut random = crate::Random::new(7);
        let meshes = [union_jack(5, [1.3, 0.4]), union_cube(3, [0.9, 2.0, 0.3])];
        for mut mesh in meshes {
            let dim = usize::from(mesh.dim());
            let mut moved = mesh.points.to_vec();
            for point in &mut moved {
                point[..dim]
                    .iter_mut()
                    .for_each(|x| *x += 0.02 * random.next());
            }
            mesh.points = moved.into();
            let mesh = Triangulation::new("moved", &mesh).unwrap();
            for element in [&CR as &'static dyn Element, &P1] {
                let space = Space::new(&mesh, element);
                let stiffness = Stiffness::new(&space);
                let u: Vec<f64> = (0..space.dofs).map(|_| random.next() - 0.5).collect();
                let (mut product, mut sizes) = (vec![0.0; space.dofs], vec![0.0; space.dofs]);
                stiffness.for_each(0..mesh.cell_count(), |i, j, value| {
                    product[i as usize] += value * u[j as usize];
                    sizes[i as usize] += (value * u[j as usize]).abs();
                });
                let found = [stiffness.times(&u), stiffness.sizes(&u)];
                for (sum, found) in [product, sizes].iter().zip(&found) {
                    for ((sum, found), size) in sum.iter().zip(found).zip(&stiffness.sizes(&u)) {
                        assert!((sum - found).abs() <= 1e-14 * size, "{sum} {found}");
                    }
                }
            }
        }
    }
}
