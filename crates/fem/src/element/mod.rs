//! The elements, and how their dofs are numbered on a mesh.

mod cr;
mod p1;
mod p2;
mod space;

pub use space::Space;

/// No element here has more dofs on a cell (P2 on tetrahedra: 10).
pub const MAX_DOFS: usize = 10;

/// Values of the local basis functions, or of their derivatives along a direction.
pub type Basis = [f64; MAX_DOFS];

/// A Lagrange element on simplices, in barycentric coordinates λ.
///
/// Everything is given by λ, so that one short file serves triangles and tetrahedra.
pub trait Element: Sync {
    /// As the engines know it: `CR`, `P1`, `P2`.
    fn name(&self) -> &'static str;

    /// Polynomial degree.
    fn degree(&self) -> usize;

    /// Number of dofs on the vertices, edges and faces of a cell (one each, or none).
    fn on(&self) -> DofEntities;

    /// φ_i(λ)
    fn values(&self, dim: usize, lambda: &[f64; 4]) -> Basis;

    /// ∂φ_i/∂λ_j, rows i.
    fn derivatives(&self, dim: usize, lambda: &[f64; 4]) -> [[f64; 4]; MAX_DOFS];
}

/// Which mesh entities carry one dof each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DofEntities {
    /// One dof on each vertex.
    pub vertices: bool,
    /// One on each edge.
    pub edges: bool,
    /// One on each face: edges in 2D, triangles in 3D.
    pub faces: bool,
}

/// The Crouzeix–Raviart element.
pub static CR: cr::CrouzeixRaviart = cr::CrouzeixRaviart;
/// The linear Lagrange element.
pub static P1: p1::Linear = p1::Linear;
/// The quadratic Lagrange element.
pub static P2: p2::Quadratic = p2::Quadratic;

#[cfg(test)]
mod tests {
    use super::*;

    /// Each basis function is 1 at its own node and 0 at the others, and the derivatives are
    /// those of the values (by central differences, exact for quadratics).
    #[test]
    fn bases_are_nodal_and_derivatives_are_theirs() {
        for element in [&CR as &dyn Element, &P1, &P2] {
            for dim in [2, 3] {
                let nodes = space::nodes(element, dim);
                for (j, node) in nodes.iter().enumerate() {
                    let values = element.values(dim, node);
                    for i in 0..nodes.len() {
                        let expected = f64::from(u8::from(i == j));
                        assert!((values[i] - expected).abs() < 1e-15);
                    }
                }
                let mut at = [0.1, 0.2, 0.3, 0.4];
                at[dim..].fill(0.0);
                let derivatives = element.derivatives(dim, &at);
                for j in 0..=dim {
                    let (mut up, mut down) = (at, at);
                    up[j] += 1e-3;
                    down[j] -= 1e-3;
                    let (up, down) = (element.values(dim, &up), element.values(dim, &down));
                    for i in 0..nodes.len() {
                        let slope = (up[i] - down[i]) / 2e-3;
                        assert!((derivatives[i][j] - slope).abs() < 1e-12);
                    }
                }
            }
        }
    }
}
