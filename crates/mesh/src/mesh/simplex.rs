//! Geometry of one simplicial cell: one formula for triangles and tetrahedra.

use nalgebra::{Matrix3, Vector3};

/// Measure, barycentric gradients and diameter of a simplex.
#[derive(Debug, Clone, Copy)]
pub struct CellGeometry {
    /// 2 for a triangle, 3 for a tetrahedron.
    pub dim: usize,
    /// |κ| with the sign of its orientation: area in 2D, volume in 3D.
    pub signed_measure: f64,
    /// ∇λ_i, i = 0..=dim; face i lies opposite vertex i.
    pub gradients: [Vector3<f64>; 4],
    /// Length of the longest edge.
    pub diameter: f64,
    /// The vertices' coordinates.
    pub vertices: [Vector3<f64>; 4],
}

impl CellGeometry {
    /// J = (x₁-x₀, …, x_d-x₀), completed by e_z in 2D; the rows of J⁻¹ are ∇λ₁, …, ∇λ_d.
    ///
    /// The gradients of a cell of measure zero are not finite.
    pub fn new(dim: usize, points: &[[f64; 3]]) -> Self {
        let mut vertices = [Vector3::zeros(); 4];
        for (vertex, point) in vertices.iter_mut().zip(points).take(dim + 1) {
            *vertex = Vector3::from(*point);
        }
        let mut edges = [1, 2, 3].map(|i| vertices[i] - vertices[0]);
        if dim == 2 {
            edges[2] = Vector3::z();
        }
        let jacobian = Matrix3::from_columns(&edges);
        let determinant = jacobian.determinant();
        let inverse = jacobian
            .try_inverse()
            .unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        let mut gradients = [Vector3::zeros(); 4];
        for i in 1..=dim {
            gradients[i] = inverse.row(i - 1).transpose();
            if dim == 2 {
                gradients[i].z = 0.0;
            }
        }
        gradients[0] = -(gradients[1] + gradients[2] + gradients[3]);
        CellGeometry {
            dim,
            signed_measure: determinant / if dim == 2 { 2.0 } else { 6.0 },
            gradients,
            diameter: diameter(dim, points),
            vertices,
        }
    }

    /// |κ|
    pub fn measure(&self) -> f64 {
        self.signed_measure.abs()
    }

    /// Outward unit normal of local face i: -∇λ_i / |∇λ_i|.
    pub fn normal(&self, i: usize) -> Vector3<f64> {
        -self.gradients[i] / self.gradients[i].norm()
    }

    /// |F_i| = d |κ| |∇λ_i|
    pub fn face_measure(&self, i: usize) -> f64 {
        self.dim as f64 * self.measure() * self.gradients[i].norm()
    }

    /// Barycentric coordinates of the centroid.
    pub fn centroid(&self) -> [f64; 4] {
        let mut lambda = [0.0; 4];
        lambda[..=self.dim].fill(1.0 / (self.dim + 1) as f64);
        lambda
    }

    /// The point with barycentric coordinates `lambda`.
    pub fn point(&self, lambda: &[f64; 4]) -> [f64; 3] {
        let mut x = Vector3::zeros();
        for i in 0..=self.dim {
            x += lambda[i] * self.vertices[i];
        }
        x.into()
    }
}

/// |κ| with the sign of its orientation.
#[inline]
pub(super) fn signed_measure(dim: usize, points: &[[f64; 3]; 4]) -> f64 {
    let [p, q, r, s] = points.map(Vector3::from);
    let (a, b) = (q - p, r - p);
    if dim == 2 {
        0.5 * (a.x * b.y - a.y * b.x)
    } else {
        a.dot(&b.cross(&(s - p))) / 6.0
    }
}

/// The smallest height of a tetrahedron over its shortest edge. It is small for a sliver, whose four
/// vertices are nearly in one plane while no edge is short; a flat cell of a thin layer is not a sliver.
pub(super) fn thickness(points: &[[f64; 3]; 4]) -> f64 {
    let p = points.map(Vector3::from);
    let mut shortest = f64::INFINITY;
    let mut largest = 0.0_f64;
    for i in 0..4 {
        let [a, b, c] = [1, 2, 3].map(|k| p[(i + k) % 4]);
        largest = largest.max(0.5 * (b - a).cross(&(c - a)).norm());
        for j in 0..i {
            shortest = shortest.min((p[i] - p[j]).norm());
        }
    }
    3.0 * signed_measure(3, points).abs() / (largest * shortest)
}

/// The angles between the faces of a tetrahedron, in degrees, at the edges 01, 02, 03, 12, 13, 23.
pub(super) fn dihedral_angles(points: &[[f64; 3]; 4]) -> [f64; 6] {
    let p = points.map(Vector3::from);
    [
        [0, 1, 2, 3],
        [0, 2, 1, 3],
        [0, 3, 1, 2],
        [1, 2, 0, 3],
        [1, 3, 0, 2],
        [2, 3, 0, 1],
    ]
    .map(|[i, j, k, l]| {
        let edge = p[j] - p[i];
        angle(edge.cross(&(p[k] - p[i])), edge.cross(&(p[l] - p[i])))
    })
}

/// The angle between two vectors, in degrees; unlike the arc cosine accurate near 0° and 180° too.
pub(super) fn angle(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
}

/// Length of the longest edge.
pub(super) fn diameter(dim: usize, points: &[[f64; 3]]) -> f64 {
    let mut largest = 0.0_f64;
    for i in 0..=dim {
        for j in 0..i {
            let edge = Vector3::from(points[i]) - Vector3::from(points[j]);
            largest = largest.max(edge.norm_squared());
        }
    }
    largest.sqrt()
}

/// The part of a simplex's geometry that its stiffness needs.
#[derive(Debug, Clone, Copy)]
pub struct Metric {
    /// |κ|
    pub measure: f64,
    /// |κ| ∇λ_i·∇λ_j, i, j = 0..=dim
    pub products: [[f64; 4]; 4],
}

impl Metric {
    /// In 2D |κ| ∇λ_i·∇λ_j = e_i·e_j / 4|κ| with e_i the edge opposite vertex i; in 3D the same with
    /// the faces' normals instead of edges.
    ///
    /// The products of a cell of measure zero are not finite.
    #[inline]
    pub fn new(dim: usize, points: &[[f64; 3]; 4]) -> Self {
        let mut products = [[0.0; 4]; 4];
        if dim == 2 {
            // The common case, with as few operations as possible.
            let [p, q, r, _] = points;
            let edge = |a: &[f64; 3], b: &[f64; 3]| [b[0] - a[0], b[1] - a[1]];
            let [a, b, c] = [edge(q, r), edge(r, p), edge(p, q)];
            let determinant = (a[0] * b[1] - a[1] * b[0]).abs();
            let scale = 0.5 / determinant;
            let dot = |a: [f64; 2], b: [f64; 2]| (a[0] * b[0] + a[1] * b[1]) * scale;
            let (ab, bc, ca) = (dot(a, b), dot(b, c), dot(c, a));
            products[0] = [dot(a, a), ab, ca, 0.0];
            products[1] = [ab, dot(b, b), bc, 0.0];
            products[2] = [ca, bc, dot(c, c), 0.0];
            return Metric {
                measure: 0.5 * determinant,
                products,
            };
        }
        let [p, q, r, s] = points.map(Vector3::from);
        let (a, b, c) = (q - p, r - p, s - p);
        let [m, n, o] = [b.cross(&c), c.cross(&a), a.cross(&b)];
        let normals = [-(m + n + o), m, n, o];
        let determinant = a.dot(&m).abs();
        for i in 0..=dim {
            for j in 0..=dim {
                products[i][j] = normals[i].dot(&normals[j]) / (6.0 * determinant);
            }
        }
        Metric {
            measure: determinant / 6.0,
            products,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_metric_is_that_of_the_geometry() {
        let points = [
            [0.1, -0.3, 0.0],
            [1.2, 0.4, 0.0],
            [0.3, 2.0, 0.0],
            [-0.2, 0.5, 1.7],
        ];
        for dim in [2, 3] {
            let geometry = CellGeometry::new(dim, &points);
            let metric = Metric::new(dim, &points);
            assert!((metric.measure - geometry.measure()).abs() < 1e-15);
            assert!((signed_measure(dim, &points) - geometry.signed_measure).abs() < 1e-15);
            assert!((diameter(dim, &points) - geometry.diameter).abs() < 1e-15);
            for i in 0..=dim {
                for j in 0..=dim {
                    let slopes = geometry.gradients[i].dot(&geometry.gradients[j]);
                    let product = geometry.measure() * slopes;
                    assert!(
                        (metric.products[i][j] - product).abs() < 1e-14,
                        "{dim} {i} {j}"
                    );
                }
            }
        }
    }

    #[test]
    fn triangle_and_tetrahedron_by_one_formula() {
        let triangle = CellGeometry::new(2, &[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        assert_eq!(triangle.signed_measure, 6.0);
        assert_eq!(triangle.diameter, 5.0);
        assert!((triangle.face_measure(0) - 5.0).abs() < 1e-15);
        assert!((triangle.normal(0) - Vector3::new(0.8, 0.6, 0.0)).norm() < 1e-15);
        let tetrahedron = CellGeometry::new(
            3,
            &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]],
        );
        assert!((tetrahedron.signed_measure - 1.0 / 3.0).abs() < 1e-15);
        assert!((tetrahedron.face_measure(3) - 0.5).abs() < 1e-15);
        assert!((tetrahedron.normal(3) - Vector3::new(0.0, 0.0, -1.0)).norm() < 1e-15);
    }
}
