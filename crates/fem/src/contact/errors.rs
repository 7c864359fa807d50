//! The error of a discrete solution where the exact one is known.

use nalgebra::Vector3;

use crate::element::Space;
use crate::quadrature::{self, Piece, Rule, WHOLE, parts};
use crate::scene::Expression;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::CellGeometry;
use faceoff_mesh::parallel;

/// Errors relative to the norms of u.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Errors {
    /// ‖∇(u-u_h)‖_h / ‖∇u‖
    pub h1: f64,
    /// ‖u-u_h‖ / ‖u‖
    pub l2: f64,
}

/// Relative accuracy of the squares of the errors: an observed order is off by 1e-3 at most.
const ACCURACY: f64 = 1e-3;
/// Squares of errors below this, relative to the square of the norm, are not looked into.
const ROUNDING: f64 = 1e-24;
/// A simplex is cut into 2^d at most so often: r^{-1}, the most singular square here, then
/// leaves 2⁻³⁰ of its cell's share.
const DEEPEST: usize = 30;

/// The errors of u_h (values at all dofs) against `exact`.
///
/// The rule of degree 5 on a simplex is believed where the 2^d parts of it give the same to 1e-3,
/// relative or as a share of the whole sum; elsewhere the parts are looked at in turn. So the
/// integrals are right to 1e-3, and mostly far better, also where ∇u is singular or jumps inside a cell, at any order.
///
/// # Errors
/// A value or slope of `exact` that is not finite.
pub fn errors(space: &Space, u: &[f64], exact: &Expression) -> Result<Errors> {
    let dim = space.mesh.dim;
    let rule = quadrature::exact(dim, 5);
    let integrands: Vec<Integrand> = (0..space.mesh.cell_count())
        .map(|cell| Integrand {
            space,
            exact,
            rule: &rule,
            geometry: space.mesh.geometry(cell),
            local: space.local(cell, u),
        })
        .collect();
    let coarse = parallel::collect(integrands.len(), |cell| integrands[cell].over(&WHOLE, 1.0));
    let total = coarse.iter().fold(ZERO, |a, b| plus(a, *b));
    // Errors that are rounding have no accuracy to be refined to.
    let norms = [total[2], total[3], total[2], total[3]];
    let share: Squares = std::array::from_fn(|k| {
        (ACCURACY * total[k]).max(ROUNDING * norms[k]) / coarse.len().max(1) as f64
    });
    let fine = parallel::collect(integrands.len(), |cell| {
        integrands[cell].refined(&WHOLE, 1.0, coarse[cell], &share, DEEPEST)
    });
    let fine = fine.iter().fold(ZERO, |a, b| plus(a, *b));
    if fine.iter().any(|square| !square.is_finite()) {
        return Err(Error::Solver {
            what: format!(
                "the exact solution `{}` or its gradient is not finite inside some cell, or the result is not",
                exact.text()
            ),
            remedy: "give a u that is finite on the whole domain".into(),
        });
    }
    let [gradient_error, value_error, gradient, value] = fine;
    Ok(Errors {
        h1: relative(gradient_error, gradient),
        l2: relative(value_error, value),
    })
}

/// √(a/b), and 0 for what is nothing at all.
fn relative(error: f64, norm: f64) -> f64 {
    if error == 0.0 {
        0.0
    } else {
        (error / norm).sqrt()
    }
}

/// ∫|∇(u-u_h)|², ∫(u-u_h)², ∫|∇u|², ∫u².
type Squares = [f64; 4];

const ZERO: Squares = [0.0; 4];

fn plus(a: Squares, b: Squares) -> Squares {
    std::array::from_fn(|k| a[k] + b[k])
}

/// The squares on one cell.
struct Integrand<'a> {
    space: &'a Space<'a>,
    exact: &'a Expression,
    rule: &'a Rule,
    geometry: CellGeometry,
    local: crate::element::Basis,
}

impl Integrand<'_> {
    /// Over a part with this share of the cell.
    fn over(&self, part: &Piece, share: f64) -> Squares {
        let corners = self.geometry.dim + 1;
        let measure = self.geometry.measure() * share;
        let mut sum = ZERO;
        let place = |inner: [f64; 4]| -> [f64; 4] {
            std::array::from_fn(|i| (0..corners).map(|k| inner[k] * part[k][i]).sum())
        };
        let places: Vec<[f64; 4]> = self.rule.iter().map(|(inner, _)| place(inner)).collect();
        let points = places.iter().map(|lambda| self.geometry.point(lambda));
        let exact = self.exact.with_gradients(points);
        for ((lambda, weight), (u, gradient)) in places.iter().zip(&self.rule.weights).zip(exact) {
            let value = self.space.value(lambda, &self.local);
            let slope = self.space.slope(&self.geometry, lambda, &self.local);
            let gradient = Vector3::from(gradient);
            let squares = [
                (gradient - slope).norm_squared(),
                (u - value).powi(2),
                gradient.norm_squared(),
                u * u,
            ];
            sum = plus(sum, squares.map(|s| weight * measure * s));
        }
        sum
    }

    /// The integral over a part of which `coarse` is the rule's answer.
    fn refined(
        &self,
        part: &Piece,
        measure: f64,
        coarse: Squares,
        share: &Squares,
        deeper: usize,
    ) -> Squares {
        let parts = parts(part, self.geometry.dim);
        let measure = measure / parts.len() as f64;
        let values: Vec<Squares> = parts.iter().map(|p| self.over(p, measure)).collect();
        let fine = values.iter().fold(ZERO, |a, b| plus(a, *b));
        let near = |k: usize| {
            let difference = (fine[k] - coarse[k]).abs();
            difference <= ACCURACY * fine[k] || difference <= share[k]
        };
        // What is not finite does not become so by looking closer.
        if deeper == 0 || (0..4).all(near) || fine.iter().any(|s| !s.is_finite()) {
            return fine;
        }
        parts.iter().zip(values).fold(ZERO, |sum, (part, value)| {
            plus(sum, self.refined(part, measure, value, share, deeper - 1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{CR, Element, P1, P2};
    use faceoff_mesh::mesh::Triangulation;
    use faceoff_mesh::mesh::generate::{Cuboid, union_cube, union_mesh};

    fn mesh(n: usize, lower: f64) -> Triangulation {
        let rectangle = Cuboid::new([lower, 0.0], [1.0 - lower, 1.0]);
        Triangulation::new("uj", &union_mesh(n, &rectangle).unwrap()).unwrap()
    }

    #[test]
    fn polynomials_have_the_errors_that_one_works_out() {
        let mesh = mesh(3, 0.0);
        let exact = Expression::parse("3*x - 4*y").unwrap();
        for element in [&CR as &'static dyn Element, &P1, &P2] {
            let space = Space::new(&mesh, element);
            // u_h = u/2 + 1/10: the errors are half the slopes, and u/2 - 1/10.
            let half: Vec<f64> = space.points().map(|x| 0.5 * exact.value(x) + 0.1).collect();
            let Errors { h1, l2 } = errors(&space, &half, &exact).unwrap();
            assert!((h1 - 0.5).abs() < 1e-13);
            // ∫u² = 3 + 16/3 - 6, ∫u = -1/2
            let square: f64 = 3.0 + 16.0 / 3.0 - 6.0;
            let error = 0.25 * square + 0.05 + 0.01;
            assert!((l2 - (error / square).sqrt()).abs() < 1e-13);
        }
    }

    /// As above with the errors and norms on the unit cube.
    #[test]
    fn polynomials_in_space_have_the_errors_that_one_works_out() {
        let mesh = Triangulation::new("uc", &union_cube(2, [1.0; 3])).unwrap();
        let exact = Expression::parse("3*x - 4*y + 2*z").unwrap();
        for element in [&CR as &'static dyn Element, &P1, &P2] {
            let space = Space::new(&mesh, element);
            let half: Vec<f64> = space.points().map(|x| 0.5 * exact.value(x) + 0.1).collect();
            let Errors { h1, l2 } = errors(&space, &half, &exact).unwrap();
            assert!((h1 - 0.5).abs() < 1e-13);
            // ∫u = 1/2, the variance (9+16+4)/12
            let (mean, square): (f64, f64) = (0.5, 29.0 / 12.0 + 0.25);
            let error = 0.25 * square - 0.1 * mean + 0.01;
            assert!((l2 - (error / square).sqrt()).abs() < 1e-13, "{l2}");
        }
    }

    #[test]
    fn an_error_of_rounding_is_not_refined_for_ever() {
        let mesh = mesh(8, -1.0);
        let space = Space::new(&mesh, &P2);
        let exact = Expression::parse("y^2 - x^2 + 0.1").unwrap();
        let u: Vec<f64> = space.points().map(|x| exact.value(x)).collect();
        let Errors { h1, l2 } = errors(&space, &u, &exact).unwrap();
        assert!(h1 < 1e-13 && l2 < 1e-14, "{h1:e} {l2:e}");
    }

    /// ∇u of r^{1/2} cos(θ/2) has a pole in a vertex, and the sum of its square a closed form.
    #[test]
    fn singular_gradients_are_integrated() {
        let mesh = mesh(3, -1.0);
        let space = Space::new(&mesh, &P1);
        let text = "(x^2+y^2)^0.25*cos(0.5*atan2(y,x))";
        let exact = Expression::parse(text).unwrap();
        let rule = quadrature::exact(2, 5);
        let cells = 0..mesh.cell_count();
        let (mut plain, mut adapted) = (0.0, 0.0);
        for cell in cells {
            let integrand = Integrand {
                space: &space,
                exact: &exact,
                rule: &rule,
                geometry: mesh.geometry(cell),
                local: [0.0; crate::element::MAX_DOFS],
            };
            let coarse = integrand.over(&WHOLE, 1.0);
            plain += coarse[2];
            adapted += integrand.refined(&WHOLE, 1.0, coarse, &[1e-6; 4], DEEPEST)[2];
        }
        // |∇u|² = 1/(4r); ∫∫ 1/r over [-1,1] × [0,1] = 4 ln(1+√2), each triangle of four ln(1+√2).
        let closed = (1.0 + 2.0_f64.sqrt()).ln();
        assert!((adapted / closed - 1.0).abs() < 2e-4, "{adapted} {closed}");
        assert!((plain / closed - 1.0).abs() > 1e-3, "{plain} {closed}");
        assert_eq!(
            errors(&space, &vec![0.0; space.dofs], &exact).unwrap().h1,
            1.0
        );
        let pole = Expression::parse("log(x - 5)").unwrap();
        assert!(errors(&space, &vec![0.0; space.dofs], &pole).is_err());
    }
}
