//! Boundary values that no linear function has: what g on Γ_D, and ψ on Γ_C, have beyond their linear interpolant on a face
//! of a triangle.
//!
//! On a triangle κ with the face F = ab opposite z, δ = g - I_h g extends to w(z + r(y-z)) = r δ(s), y = a + s (b-a),
//! r ∈ [0, 1]: w = δ on F, and 0 on both other edges, as δ vanishes at the vertices. With r = λ_a + λ_b, s = λ_b/r,
//!
//! ```text
//! ∇w = (δ - s δ') ∇λ_a + (δ + (1-s) δ') ∇λ_b     the same along each ray from z
//! ```
//!
//! δ and δ' are enclosed on the leaves of F, so ∇w is a vector and a box on the sector of each leaf. That δ is continuous
//! is proved, not supposed: on a leaf where an `if` is not decided there is no lift. Where the branches on both sides of a
//! vertex cannot be distinguished from its value they are taken as equal. A face of a tetrahedron has edges in common with others,
//! where δ does not vanish: see [`super::cut_off`].
//!
//! Where g is smooth most of δ is 4 b λ_a λ_b, b its value in the middle of F: that is then a separate part of v, and w the
//! lift of what is left.

use super::refusal;
use super::simplex::{Simplex, Vector, ZERO, add, corners, dot, norm};
use crate::contact::Problem;
use crate::interval::{Interval, above_of_all, above_of_product};
use crate::quadrature::Piece;
use crate::scene::expression::GRADIENT;
use crate::scene::{Expression, Part};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

/// Leaves of a face: at most this many, fewer once the box is below this part of the vector, in the norm of ∇w.
const LEAVES: usize = 120;
const ACCURACY: f64 = 0.1;
/// |δ| below this, relative to the largest value on the face, is the rounding of a linear function.
const ROUNDING: f64 = 1e-13;
/// A leaf at a vertex as small as this shows the value there.
const TINY: f64 = 1.0 / (1_u64 << 40) as f64;

/// w on one cell.
#[derive(Debug, Clone)]
pub(super) struct Lift {
    pub cell: usize,
    /// The cell's corners: z, a, b.
    pub local: usize,
    pub ends: [usize; 2],
    /// δ is what the data have beyond their linear interpolant and 4 b λ_a λ_b with this b.
    pub bend: f64,
    /// Empty where nothing is left.
    pub sectors: Vec<Sector>,
}

/// The part of a cell between z and a leaf of its face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sector {
    /// The leaf: s from here to there.
    pub from: f64,
    pub to: f64,
    /// ∇w is about a ∇λ_a + b ∇λ_b with these a and b, and off by no more than the radius.
    pub slopes: [f64; 2],
    pub radius: f64,
    /// |δ|
    pub height: f64,
}

impl Lift {
    /// The face whose data it continues.
    pub fn face(&self, mesh: &Triangulation) -> usize {
        mesh.cell_faces(self.cell)[self.local] as usize
    }

    /// The part in the cell's barycentric coordinates: z and both ends of the leaf.
    pub fn piece(&self, sector: &Sector) -> Piece {
        let mut piece = [[0.0; 4]; 4];
        piece[0][self.local] = 1.0;
        for (corner, s) in piece[1..3].iter_mut().zip([sector.from, sector.to]) {
            corner[self.ends[0]] = 1.0 - s;
            corner[self.ends[1]] = s;
        }
        piece
    }

    /// The middle of ∇w on a sector.
    pub fn slope(&self, cell: &Simplex, sector: &Sector) -> Vector {
        let mut slope = ZERO;
        for (value, end) in sector.slopes.iter().zip(self.ends) {
            add(&mut slope, Interval::at(*value), &cell.gradient_of(end), 2);
        }
        slope
    }

    /// The mean of |δ| over the face at most.
    pub fn height(&self) -> Interval {
        let sectors = self.sectors.iter();
        let length = |s: &Sector| Interval::at(s.to) - Interval::at(s.from);
        sectors.map(|s| length(s) * Interval::at(s.height)).sum()
    }

    /// ∫_κ |w| at most.
    pub fn size(&self, cell: &Simplex) -> f64 {
        // The mean of r over a triangle is 2/3.
        (self.height() * cell.measure * Interval::at(2.0) / Interval::at(3.0)).high
    }

    /// ‖∇w‖_κ at most, and what of it is the box.
    pub fn norms(&self, cell: &Simplex) -> [f64; 2] {
        let measure = cell.measure.high;
        let of = |size: &dyn Fn(&Sector) -> f64| {
            let parts = self.sectors.iter().map(|sector| {
                above_of_product(
                    sector.to - sector.from,
                    Interval::at(size(sector)).square().high,
                )
            });
            (Interval::at(measure) * Interval::at(above_of_all(parts)))
                .root()
                .high
        };
        let radius = of(&|sector| sector.radius);
        let middle = of(&|sector| {
            let slope = self.slope(cell, sector);
            norm(&slope, 2).high
        });
        [(Interval::at(middle) + Interval::at(radius)).high, radius]
    }
}

/// Why there is no lift of a face.
#[derive(Debug, Clone, Copy)]
pub(super) enum NoLift {
    Jump,
    Slope,
}

/// The lifts of g on all faces of Γ_D that need one, in 2D.
///
/// # Errors
/// g that is not in H¹ along Γ_D or cannot be proved to be.
pub(super) fn lifts(problem: &Problem, unit: i32) -> Result<Vec<Lift>> {
    let (mesh, g) = (problem.space.mesh, &problem.scene.data().g);
    let mut lifts = Vec::new();
    if mesh.dim != 2 || g.is_zero() {
        return Ok(lifts);
    }
    for face in (0..mesh.face_count()).filter(|&f| problem.parts[f] == Some(Part::Dirichlet)) {
        cancel::check()?;
        let cell = mesh.face_cells(face)[0] as usize;
        let simplex = Simplex::new(mesh, cell);
        match lift(&simplex, cell, mesh.local_face(cell, face), g, unit) {
            Ok(lift) => lifts.extend(lift),
            Err(why) => {
                let label = mesh.face_label(face);
                return Err(match why {
                    NoLift::Jump => refusal(
                        format!("g may jump on {label}, and no function in H¹ has a jump on Γ_D"),
                        "write a continuous g with max, min or abs instead of `if`, or put a vertex where its branches meet",
                    ),
                    NoLift::Slope => refusal(
                        format!("the slope of g is not bounded on {label}"),
                        "give data with a bounded slope along the boundary",
                    ),
                });
            }
        }
    }
    Ok(lifts)
}

/// The lift of one face of a triangle, beyond 4 b λ_a λ_b where that leaves less than half; none where δ is 0.
pub(super) fn lift(
    cell: &Simplex,
    number: usize,
    local: usize,
    data: &Expression,
    unit: i32,
) -> std::result::Result<Option<Lift>, NoLift> {
    let ends = [(local + 1) % 3, (local + 2) % 3];
    let mut face = Face::new(cell, ends, data, unit);
    let Some(straight) = lift_of(&face, cell, number, local)? else {
        return Ok(None);
    };
    face.bend = face.middle();
    let bent = lift_of(&face, cell, number, local)?.unwrap_or(Lift {
        bend: face.bend,
        sectors: Vec::new(),
        ..straight.clone()
    });
    let is_less = bent.norms(cell)[0] < 0.5 * straight.norms(cell)[0];
    Ok(Some(if is_less { bent } else { straight }))
}

/// The least derivative in s of the data on a face, from one end on to this s; none where they may jump there, or it has no bound.
pub(super) fn least_slope(
    cell: &Simplex,
    ends: [usize; 2],
    data: &Expression,
    unit: i32,
    to: f64,
) -> Option<f64> {
    let face = Face::new(cell, ends, data, unit);
    let leaf = face.leaf(0.0, to);
    let slope = (leaf.slope + (face.values[1] - face.values[0])).low;
    (slope.is_finite() && !leaf.may_jump && !face.jumps_at(0)).then_some(slope)
}

/// The lift beyond 4 b λ_a λ_b with the face's b.
fn lift_of(
    face: &Face,
    cell: &Simplex,
    number: usize,
    local: usize,
) -> std::result::Result<Option<Lift>, NoLift> {
    let ends = face.corners;
    if (0..2).any(|end| face.jumps_at(end)) {
        return Err(NoLift::Jump);
    }
    let size = face.values[0].magnitude().max(face.values[1].magnitude());
    let mut leaves = vec![face.leaf(0.0, 1.0)];
    // No leaf that costs can be cut any more.
    let mut is_stuck = false;
    let gradients = ends.map(|end| cell.gradient_of(end));
    let of_r = norm(&super::simplex::plus(&gradients[0], &gradients[1]), 2).high;
    let of_s = norm(&gradients[1], 2).high;
    loop {
        let radius = |leaf: &Delta| {
            let [first, slope] = [leaf.first.radius(), leaf.slope.radius()];
            above_of_product(first, of_r) + above_of_product(slope, of_s)
        };
        let cost = |leaf: &Delta| {
            let radius = if leaf.may_jump {
                f64::INFINITY
            } else {
                radius(leaf)
            };
            (leaf.to - leaf.from) * radius * radius
        };
        let costs: Vec<f64> = leaves.iter().map(cost).collect();
        let total: f64 = costs.iter().sum();
        let slope = |leaf: &Delta| {
            let (first, along) = (leaf.first.mid(), leaf.slope.mid());
            let mut of = ZERO;
            add(&mut of, Interval::at(first), &gradients[0], 2);
            add(&mut of, Interval::at(first + along), &gradients[1], 2);
            (leaf.to - leaf.from) * dot(&of, &of, 2).high
        };
        let energy: f64 = leaves.iter().map(slope).sum();
        let height = leaves
            .iter()
            .map(|leaf| leaf.height.magnitude())
            .fold(0.0, f64::max);
        let is_done = total <= ACCURACY * ACCURACY * energy || height <= ROUNDING * size;
        if is_done || is_stuck || leaves.len() >= LEAVES {
            if !total.is_finite() {
                let jumps = leaves.iter().any(|leaf| leaf.may_jump);
                return Err(if jumps { NoLift::Jump } else { NoLift::Slope });
            }
            let sectors: Vec<Sector> = leaves
                .iter()
                .map(|leaf| {
                    let first = leaf.first.mid();
                    let second = first + leaf.slope.mid();
                    // What rounding of the second coefficient adds.
                    let rounding = above_of_product(second.abs() * f64::EPSILON, of_s);
                    Sector {
                        from: leaf.from,
                        to: leaf.to,
                        slopes: [first, second],
                        radius: (Interval::at(radius(leaf)) + Interval::at(rounding))
                            .high
                            .next_up(),
                        height: leaf.height.magnitude(),
                    }
                })
                .collect();
            let is_nothing = |s: &Sector| s.slopes == [0.0; 2] && s.height == 0.0;
            let lift = Lift {
                cell: number,
                local,
                ends,
                bend: face.bend,
                sectors,
            };
            return Ok((!lift.sectors.iter().all(is_nothing)).then_some(lift));
        }
        let before = leaves.len();
        let worst = costs.iter().copied().fold(0.0, f64::max);
        leaves = leaves
            .into_iter()
            .zip(costs)
            .flat_map(|(leaf, cost)| {
                if cost < 0.3 * worst && cost.is_finite() {
                    return vec![leaf];
                }
                let middle = 0.5 * (leaf.from + leaf.to);
                if middle <= leaf.from + TINY {
                    return vec![leaf];
                }
                vec![face.leaf(leaf.from, middle), face.leaf(middle, leaf.to)]
            })
            .collect();
        is_stuck = leaves.len() == before;
    }
}

/// Data along a face.
struct Face<'a> {
    corners: [usize; 2],
    ends: [[f64; 3]; 2],
    data: &'a Expression,
    unit: i32,
    values: [Interval; 2],
    edge: Vector,
    /// b
    bend: f64,
}

/// δ on a leaf.
#[derive(Clone, Copy)]
struct Delta {
    from: f64,
    to: f64,
    /// δ - s δ'
    first: Interval,
    /// δ'
    slope: Interval,
    /// δ
    height: Interval,
    may_jump: bool,
}

impl<'a> Face<'a> {
    fn new(cell: &Simplex, ends: [usize; 2], data: &'a Expression, unit: i32) -> Self {
        let vertices = ends.map(|i| cell.vertices[i]);
        let value = |x: [f64; 3]| {
            let of = data.range(x.map(Interval::at));
            of.times_power_of_two(unit)
        };
        Face {
            corners: ends,
            ends: vertices,
            data,
            unit,
            values: vertices.map(value),
            edge: cell.edge(ends[0], ends[1]),
            bend: 0.0,
        }
    }

    /// Whether the data at an end can be distinguished from those next to it.
    fn jumps_at(&self, end: usize) -> bool {
        let near = self.value([[0.0, TINY], [1.0 - TINY, 1.0]][end]);
        let vertex = self.values[end];
        near.low > vertex.high || near.high < vertex.low
    }

    /// The approximate difference of the data from their linear interpolant at the midpoint.
    fn middle(&self) -> f64 {
        let values = self.values[0] + self.values[1];
        let middle = (self.value([0.5, 0.5]) - 0.5 * values).mid();
        if middle.is_finite() { middle } else { 0.0 }
    }

    fn around(&self, [from, to]: [f64; 2]) -> [Interval; 3] {
        let mut piece = [[0.0; 4]; 4];
        (piece[0], piece[1]) = ([1.0 - from, from, 0.0, 0.0], [1.0 - to, to, 0.0, 0.0]);
        let [a, b, ..] = corners(&self.ends, &piece, 2);
        std::array::from_fn(|k| a[k].hull(b[k]))
    }

    /// The data on a leaf.
    fn value(&self, leaf: [f64; 2]) -> Interval {
        let of = self
            .data
            .enclosure_inside::<GRADIENT>(self.around(leaf), &[0, 1], 1, 1);
        of.value().times_power_of_two(self.unit)
    }

    fn leaf(&self, from: f64, to: f64) -> Delta {
        let on_box = self
            .data
            .enclosure_inside::<GRADIENT>(self.around([from, to]), &[0, 1], 1, 1);
        let scaled = |of: Interval| of.times_power_of_two(self.unit);
        let difference = self.values[1] - self.values[0];
        let s = Interval::new(from, to);
        // 4 b s (1-s) = b (1 - (2s-1)²)
        let (one, bend) = (Interval::ONE, Interval::at(self.bend));
        let bent = 4.0 * (bend * (one - 2.0 * s));
        let slope =
            dot(&[0, 1, 2].map(|k| scaled(on_box.slope(k))), &self.edge, 2) - difference - bent;
        let linear =
            |s: Interval| self.values[0] + s * difference + bend * (one - (2.0 * s - one).square());
        let range = scaled(on_box.value()) - linear(s);
        let middle = 0.5 * (from + to);
        let at_middle = self.data.range(self.around([middle, middle]));
        let centre = scaled(at_middle) - linear(Interval::at(middle));
        let steps = Interval::around_zero(0.5 * (to - from));
        let height = range.meet(centre + slope * steps);
        Delta {
            from,
            to,
            first: height - s * slope,
            slope,
            height,
            may_jump: on_box.may_jump,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{lifted, moved};
    use super::*;
    use crate::scene::Scene;

    /// w and ∇w at points anywhere in the sectors are within their bounds, for data with kinks and without.
    #[test]
    fn lifts_are_no_farther_from_their_middle_than_said() {
        let mesh = moved(&Scene::find("one-zone").unwrap(), 2, 7);
        let mut random = crate::Random::new(3);
        let mut off = 0;
        for data in [
            "sin(5*x)*exp(y)",
            "abs(x-0.3)+y^2",
            "max(0,y-0.2)^2-x",
            "300+cos(9*(x+y))",
        ] {
            let data = Expression::parse(data).unwrap();
            for cell in 0..mesh.cell_count() {
                let (simplex, geometry) = (Simplex::new(&mesh, cell), mesh.geometry(cell));
                for local in 0..3 {
                    let Some(lift) = lift(&simplex, cell, local, &data, 0).unwrap() else {
                        continue;
                    };
                    for sector in &lift.sectors {
                        let middle = lift.slope(&simplex, sector).map(Interval::mid);
                        for _ in 0..20 {
                            let s = sector.from + random.next() * (sector.to - sector.from);
                            let r = random.next().max(1e-3);
                            let mut lambda = [0.0; 4];
                            lambda[local] = 1.0 - r;
                            lambda[lift.ends[0]] = r * (1.0 - s);
                            lambda[lift.ends[1]] = r * s;
                            let (w, slope) = lifted(&geometry, &lift, &data, &lambda);
                            let away = (slope - nalgebra::Vector3::from(middle)).norm();
                            assert!(away <= sector.radius + 1e-9, "{away} {}", sector.radius);
                            assert!(w.abs() <= sector.height + 1e-12, "{w} {}", sector.height);
                            off += usize::from(away > 0.1 * sector.radius);
                        }
                    }
                }
            }
        }
        assert!(off > 1000, "{off}");
    }
}
