//! g in 3D, where it is not linear on every face of Γ_D: v = v₁ + χ (g - I_h g) with v₁ linear on the cells and v₁ = g at the
//! vertices of Γ_D, where χ is linear on the cells, 1 at the vertices of those faces and 0 at all others.
//!
//! χ is 1 on these faces, and g - I_h g is 0 on all other faces of Γ_D: v = g on Γ_D. g is that of its formula also within the cells
//! where χ is not 0; there it has to be continuous with a bounded slope. On each part of such a cell g = q + r with q of degree 2
//! by Taylor's formula about a point c, with second derivatives in the middle of their enclosures on the box of the part, or of
//! degree 1 with such first derivatives, whichever leaves less:
//!
//! ```text
//! ∇(χ (g - I_h g)) = (q - I_h g) ∇χ + χ (∇q - ∇I_h g) + (r ∇χ + χ ∇r)
//! ```
//!
//! The first two terms are a field of degree 2, and the size of the rest is bounded by the radii of the enclosures.

use super::quadratic::Quadratic;
use super::refusal;
use super::simplex::{
    EDGES, Simplex, Vector, ZERO, around, corners, dot, length, longest_edge_of, minus, norm, plus,
    times, up,
};
use crate::contact::Problem;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::{Piece, WHOLE, cut};
use crate::scene::expression::{GRADIENT, Monomials, SECOND_IN_SPACE, Taylor};
use crate::scene::{self, Expression};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::parallel;

/// Parts of a cell at most, fewer once the rest is below this share of the gradient.
const PARTS: usize = 64;
const ACCURACY: f64 = 0.1;
/// g whose slope along an edge is off that of its interpolant by no more than this, relative to its size, is read as linear.
const ROUNDING: f64 = 1e-13;

/// w = χ (g - I_h g) on one cell.
#[derive(Debug, Clone)]
pub(super) struct CutOff {
    pub cell: usize,
    pub parts: Vec<Part>,
}

/// A part of a cell.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub piece: Piece,
    /// Of the cell, exact.
    pub share: f64,
    /// ∇w at the corners and in the middles of the edges, but for the rest …
    points: ([Vector; 4], [Vector; 6]),
    /// … which is nowhere larger than this.
    radius: f64,
    /// χ and |g - I_h g| at most.
    chi: f64,
    beyond: f64,
}

impl Part {
    /// ∇w but for the rest.
    pub fn slope<const D: usize>(&self) -> Quadratic<D> {
        Quadratic::new(&self.points.0, &self.points.1)
    }

    /// |w| at most.
    fn height(&self) -> f64 {
        above_of_product(self.chi, self.beyond)
    }

    /// The largest of ∇w at its points.
    fn steepest(&self) -> f64 {
        let all = self.points.0.iter().chain(&self.points.1);
        all.map(|g| norm(g, 3).high).fold(0.0, f64::max)
    }
}

impl CutOff {
    /// ‖∇w‖_κ at most, and what of it is the rest.
    pub fn norms(&self, cell: &Simplex) -> [f64; 2] {
        let root = |mean: Interval| (mean * cell.measure).root();
        let squares = |of: &dyn Fn(&Part) -> Interval| -> Interval {
            let terms = self.parts.iter().map(|part| part.share * of(part));
            terms.sum()
        };
        let known = root(squares(&|part| part.slope::<3>().mean_square(3)));
        let rest = root(squares(&|part| Interval::at(part.radius).square()));
        [(known + rest).high, rest.high]
    }

    /// |w| on the cell at most.
    pub fn height(&self) -> f64 {
        self.parts
            .iter()
            .fold(0.0, |most, part| part.height().max(most))
    }

    /// |g - I_h g| on the cell at most.
    pub fn beyond(&self) -> f64 {
        let parts = self.parts.iter();
        parts.fold(0.0, |most, part| part.beyond.max(most))
    }

    /// ∫_κ |w| at most.
    pub fn size(&self, cell: &Simplex) -> f64 {
        let parts = self.parts.iter();
        let means = parts.map(|part| above_of_product(part.share, part.height()));
        above_of_product(above_of_all(means), cell.measure.high)
    }
}

/// Those of all cells that need one, by cells.
///
/// # Errors
/// g that may jump in such a cell, or whose slope is not bounded there.
pub(super) fn cut_offs(problem: &Problem, unit: i32) -> Result<Vec<CutOff>> {
    let (mesh, g) = (problem.space.mesh, &problem.scene.data().g);
    if mesh.dim != 3 || g.is_zero() {
        return Ok(Vec::new());
    }
    let is_one = on_curved_faces(problem, unit);
    let found = parallel::collect(mesh.cell_count(), |cell| {
        let mut chi = [0.0; 4];
        for (chi, &vertex) in chi.iter_mut().zip(mesh.cell(cell)) {
            *chi = f64::from(u8::from(is_one[vertex as usize]));
        }
        if chi == [0.0; 4] {
            return Ok(None);
        }
        cancel::check()?;
        let parts = OnCell::new(mesh, cell, g, chi, unit).parts();
        let (jumps, is_known) = (
            parts.iter().any(|(_, may_jump)| *may_jump),
            parts.iter().all(|(part, _)| part.radius.is_finite()),
        );
        let what = match (jumps, is_known) {
            (false, true) => {
                let parts = parts.into_iter().map(|(part, _)| part).collect();
                return Ok(Some(CutOff { cell, parts }));
            }
            (true, _) => "g may jump",
            _ => "the slope of g is not bounded",
        };
        let [x, y, z] = mesh.cell_midpoint(cell);
        Err(refusal(
            format!(
                "{what} in the cell about ({x}, {y}, {z}) next to Γ_D, where its formula continues what it has there beyond linear functions"
            ),
            "write g so that it is continuous with a bounded slope within these cells as well, or linear on every face",
        ))
    });
    found.into_iter().filter_map(Result::transpose).collect()
}

/// Whether a vertex belongs to a face of Γ_D on which g is not linear.
pub(super) fn on_curved_faces(problem: &Problem, unit: i32) -> Vec<bool> {
    let mesh = problem.space.mesh;
    let mut is_one = vec![false; mesh.points.len()];
    let on_dirichlet = |face: &usize| problem.parts[*face] == Some(scene::Part::Dirichlet);
    let faces = (0..mesh.face_count()).filter(on_dirichlet);
    for face in faces.filter(|&face| mesh.dim == 3 && !is_linear(problem, face, unit)) {
        let vertices = mesh.face(face).iter();
        vertices.for_each(|&vertex| is_one[vertex as usize] = true);
    }
    is_one
}

/// Whether g - I_h g is 0 on a face of Γ_D up to rounding of g's own slopes.
fn is_linear(problem: &Problem, face: usize, unit: i32) -> bool {
    let (mesh, g) = (problem.space.mesh, &problem.scene.data().g);
    let corners = mesh.face_vertices(face).map(|x| x.map(Interval::at));
    let corners = &corners[..3];
    let scaled = |of: Interval| of.times_power_of_two(unit);
    let on_box = g.enclosure_inside::<GRADIENT>(around(corners), &[0, 1, 2], 1, 2);
    let slope = [0, 1, 2].map(|k| scaled(on_box.slope(k)));
    let value = |x: &Vector| scaled(g.range(*x));
    let first = value(&corners[0]);
    let mut others = corners[1..].iter();
    !on_box.may_jump
        && others.all(|x| {
            // Along the edge, against the variation of g along it: an offset hides nothing.
            let along = dot(&slope, &minus(x, &corners[0]), 3);
            let off = along - (value(x) - first);
            off.contains(0.0)
                && off.magnitude() <= ROUNDING * (along.magnitude() + value(x).magnitude())
        })
}

/// Data that are the same on all parts of a cell.
struct OnCell<'a> {
    cell: Simplex,
    g: &'a Expression,
    unit: i32,
    /// χ at the vertices.
    chi: [f64; 4],
    /// ∇χ and ∇I_h g
    slopes: [Vector; 2],
    /// g at the vertices.
    values: [Interval; 4],
}

impl<'a> OnCell<'a> {
    fn new(mesh: &Triangulation, cell: usize, g: &'a Expression, chi: [f64; 4], unit: i32) -> Self {
        let cell = Simplex::new(mesh, cell);
        let at = |x: [f64; 3]| g.range(x.map(Interval::at)).times_power_of_two(unit);
        let values = cell.vertices.map(at);
        let slopes = [chi.map(Interval::at), values].map(|values| cell.gradient(&values));
        OnCell {
            cell,
            g,
            unit,
            chi,
            slopes,
            values,
        }
    }

    /// Parts with little left, and whether g may jump on them.
    fn parts(&self) -> Vec<(Part, bool)> {
        let mut parts = vec![self.part(WHOLE, 1.0)];
        let cost = |part: &Part| part.share * part.radius * part.radius;
        while parts.len() < PARTS {
            let sum =
                |of: &dyn Fn(&Part) -> f64| parts.iter().map(|(part, _)| of(part)).sum::<f64>();
            let slopes = sum(&|part| part.share * part.steepest().powi(2));
            if sum(&cost) <= ACCURACY * ACCURACY * slopes {
                break;
            }
            let costs = parts.iter().map(|(part, _)| cost(part)).enumerate();
            let Some((worst, _)) = costs.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            let (part, _) = parts.swap_remove(worst);
            let edge = longest_edge_of(&self.cell.vertices, &part.piece, 3);
            let halves = cut(&part.piece, edge, 0.5);
            parts.extend(halves.map(|piece| self.part(piece, 0.5 * part.share)));
        }
        parts
    }

    fn part(&self, piece: Piece, share: f64) -> (Part, bool) {
        let corners = corners(&self.cell.vertices, &piece, 3);
        let around = around(&corners);
        let centre = around.map(|x| Interval::at(x.mid()));
        let axes = [0, 1, 2];
        let scaled = |of: Taylor<SECOND_IN_SPACE>| {
            let all = of.coefficients.map(|c| c.times_power_of_two(self.unit));
            (all, of.may_jump)
        };
        // On all of the closed box: a jump only at its side would be one on Γ_D.
        let (on_box, may_jump) = scaled(self.g.enclosure(around, &axes, 2));
        let (at_centre, _) = scaled(self.g.enclosure(centre, &axes, 1));
        let reach: [f64; 3] = std::array::from_fn(|k| {
            let off = |corner: &Vector| (corner[k] - centre[k]).magnitude();
            corners.iter().map(off).fold(0.0, f64::max)
        });
        let of_degree = |degree: usize| Model::new(degree, &on_box, &at_centre, reach);
        let of_chi = norm(&self.slopes[0], 3).high;
        let highest = |at: &[f64; 4]| (0..4).map(|i| at[i] * self.chi[i]).sum::<f64>();
        let most = piece.iter().map(highest).fold(0.0, f64::max);
        let radius = |model: &Model| {
            let of_slope = above_of_product(most, model.off_slope);
            (Interval::at(above_of_product(of_chi, model.off)) + Interval::at(of_slope)).high
        };
        let (first, second) = (of_degree(1), of_degree(2));
        let is_bent = radius(&second) < radius(&first);
        let model = if is_bent { second } else { first };
        let radius = if may_jump {
            f64::INFINITY
        } else {
            radius(&model)
        };
        let at = |lambda: &[f64; 4], x: &Vector| -> Vector {
            let (value, slope) = model.at(&minus(x, &centre));
            let weighted = |of: &[Interval; 4]| (0..4).map(|i| lambda[i] * of[i]).sum::<Interval>();
            let beyond = value - weighted(&self.values);
            let slope = minus(&slope, &self.slopes[1]);
            let chi = weighted(&self.chi.map(Interval::at));
            plus(&times(beyond, &self.slopes[0]), &times(chi, &slope))
        };
        let of_corners = std::array::from_fn(|n| at(&piece[n], &corners[n]));
        let in_middles = std::array::from_fn(|n| {
            let [i, j] = EDGES[n];
            let lambda = std::array::from_fn(|k| 0.5 * (piece[i][k] + piece[j][k]));
            let x = std::array::from_fn(|k| 0.5 * (corners[i][k] + corners[j][k]));
            at(&lambda, &x)
        });
        // By the mean value theorem from the centre.
        let from_first = minus(&centre, &self.cell.vertices[0].map(Interval::at));
        let mut linear = self.values[0];
        let mut beyond = Interval::ZERO;
        for k in 0..3 {
            linear += self.slopes[1][k] * from_first[k];
            let slope = on_box[1 + k] - self.slopes[1][k];
            beyond += slope.abs() * Interval::at(reach[k]);
        }
        beyond += (at_centre[0] - linear).abs();
        let part = Part {
            piece,
            share,
            points: (of_corners, in_middles),
            radius,
            chi: most,
            beyond: beyond.high,
        };
        (part, may_jump)
    }
}

/// q about a point.
struct Model {
    coefficients: [f64; SECOND_IN_SPACE],
    /// |r| and |∇r| at most.
    off: f64,
    off_slope: f64,
}

impl Model {
    /// Of this degree, from the Taylor coefficients on a box and at its centre, from which it reaches so far along each axis.
    fn new(
        degree: usize,
        on_box: &[Interval; SECOND_IN_SPACE],
        at_centre: &[Interval; SECOND_IN_SPACE],
        reach: [f64; 3],
    ) -> Self {
        let monomials = Monomials::of(3);
        let [below, count] = [degree - 1, degree].map(|degree| monomials.counts[degree]);
        let (mut coefficients, mut off) = ([0.0; SECOND_IN_SPACE], 0.0);
        let mut off_slope = [0.0; 3];
        for (n, exponents) in monomials.exponents[..count].iter().enumerate() {
            let of = if n < below { at_centre[n] } else { on_box[n] };
            coefficients[n] = of.mid();
            let times_reach = |size: f64, exponents: [u8; 3]| {
                let powers = exponents
                    .iter()
                    .zip(reach)
                    .flat_map(|(e, x)| vec![x; (*e).into()]);
                powers.fold(size, above_of_product)
            };
            off = up(off, times_reach(of.radius(), *exponents));
            for (k, off) in off_slope
                .iter_mut()
                .enumerate()
                .filter(|(k, _)| exponents[*k] > 0)
            {
                let mut lower = *exponents;
                lower[k] -= 1;
                *off = up(
                    *off,
                    times_reach(f64::from(exponents[k]) * of.radius(), lower),
                );
            }
        }
        Model {
            coefficients,
            off,
            off_slope: length(off_slope),
        }
    }

    /// q and ∇q at a step from the point.
    fn at(&self, step: &Vector) -> (Interval, Vector) {
        let monomial = |exponents: [u8; 3]| -> Interval {
            let powers = exponents
                .iter()
                .zip(step)
                .flat_map(|(e, x)| vec![*x; (*e).into()]);
            powers.fold(Interval::ONE, |product, x| product * x)
        };
        let (mut value, mut slope) = (Interval::ZERO, ZERO);
        let terms = Monomials::of(3).exponents.iter().zip(self.coefficients);
        for (exponents, c) in terms.filter(|(_, c)| *c != 0.0) {
            value += c * monomial(*exponents);
            for k in (0..3).filter(|k| exponents[*k] > 0) {
                let mut lower = *exponents;
                lower[k] -= 1;
                slope[k] += f64::from(exponents[k]) * (c * monomial(lower));
            }
        }
        (value, slope)
    }
}

#[cfg(test)]
pub(super) mod tests;
