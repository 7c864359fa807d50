//! Admissible v on the contact faces: a linear function that is nowhere above ψ, or ψ itself by a lift.
//!
//! In 2D v is ψ's interpolant and its lift where ψ is not linear. Where there is no lift, in 3D and where ψ jumps or has a
//! spike, v stays below ψ by as much as its interpolant is above it somewhere on the face: that costs <λ, v-ψ>.
//!
//! Where Γ_D meets Γ_C in 2D that line is often below g. There v is ψ's lift as well or, where that costs more or does not exist, the line
//! from c = min(g, ψ) at the corner, s = 0, that is nowhere above ψ and highest at s = 1:
//!
//! ```text
//! inf over s of c + (ψ(s) - c)/s     up to some s ≥ c + inf ψ', from there on least at the ends of a polygon below ψ
//! ```

use super::lift::{Lift, least_slope, lift};
use super::model::{Domain, Effort};
use super::refusal;
use super::simplex::Simplex;
use super::tree::{Leaf, Tree};
use crate::contact::Problem;
use crate::interval::{Interval, above_of_all, above_of_product};
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// The distance that v stays below ψ only because of rounding, relative to the largest |ψ| on the face.
const ROUNDING: f64 = 1e-12;
/// Leaves of ψ beyond one per face, and of each face.
const MORE: usize = 20_000;
const PER_FACE: usize = 32;
/// The number of times that a leaf of ψ is cut in halves, in 2D and in 3D: where ψ is bent a line below the leaf passes below ψ by
/// 1/64 and 1/16 of what it would.
const CUTS: [usize; 2] = [3, 4];

/// ψ's slope from a corner on is bounded up to the end of a leaf, or half of that, and so on.
const HALVINGS: i32 = 8;

/// ψ on a contact face.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Obstacle {
    /// v at the vertices is at most this, by the mesh's order of the face.
    pub ceiling: [f64; 4],
    /// ψ at the vertices.
    pub values: [Interval; 4],
    /// The ceiling without a lift, on a face of a triangle, unless that is below g where Γ_D meets Γ_C.
    pub line: Option<[f64; 2]>,
    /// Whether v's P1 part is compared with ψ's interpolant, and the rest is lifted.
    pub is_lifted: bool,
    /// The mean of ψ.
    pub mean: Interval,
    /// Where there is a lift: [s, value] of a polygon that ψ is nowhere below, s from one vertex to the other.
    pub polygon: Vec<[f64; 2]>,
}

/// ψ on all contact faces, and its lifts.
///
/// # Errors
/// ψ that is not bounded on a face; an interruption.
pub(super) fn obstacles(
    problem: &Problem,
    unit: i32,
    dirichlet: &[Option<Interval>],
) -> Result<(Vec<Obstacle>, Vec<Lift>)> {
    let (mesh, psi) = (problem.space.mesh, &problem.scene.data().psi);
    let zero = Obstacle {
        ceiling: [0.0; 4],
        values: [Interval::ZERO; 4],
        line: None,
        is_lifted: false,
        mean: Interval::ZERO,
        polygon: Vec::new(),
    };
    if psi.is_zero() {
        return Ok((vec![zero; problem.contact.len()], Vec::new()));
    }
    let domain = Domain {
        expression: psi,
        vertices: Box::new(|k| mesh.face_vertices(problem.contact[k].face)),
        measures: problem
            .contact
            .iter()
            .map(|contact| contact.measure)
            .collect(),
        dim: mesh.dim - 1,
        space: mesh.dim,
        unit,
    };
    let mut trees = domain.enclose(&Effort {
        tolerance: 1e-6,
        budget: PER_FACE * problem.contact.len() + MORE,
    })?;
    let straightened = parallel::map(trees.iter_mut().enumerate(), |(k, tree)| {
        domain.straighten(k, tree, CUTS[mesh.dim - 2]);
        cancel::check()
    });
    straightened.into_iter().collect::<Result<()>>()?;
    let (mut obstacles, mut lifts) = (Vec::new(), Vec::new());
    for (contact, tree) in problem.contact.iter().zip(&trees) {
        let face = mesh.face(contact.face);
        let mut obstacle = zero.clone();
        for (value, &vertex) in obstacle.values.iter_mut().zip(face) {
            let at = mesh.points[vertex as usize].map(Interval::at);
            *value = psi.range(at).times_power_of_two(unit);
        }
        // How far the interpolant of the vertex values is above ψ, and about how far below it; and the mean of ψ.
        let (mut drop, mut rise, mut size) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut means = Interval::ZERO;
        tree.for_each(&mut |node, piece, share| {
            let leaf = tree.leaf(node);
            let below = from_below(leaf);
            for j in 0..mesh.dim {
                let linear: Interval = (0..mesh.dim)
                    .map(|i| piece[j][i] * obstacle.values[i])
                    .sum();
                drop = drop.max((linear - below[j]).high);
                rise = rise.max((Interval::at(leaf.values[j]) - linear).high);
                size = size.max(leaf.values[j].abs());
            }
            let sum: Interval = leaf.values[..mesh.dim]
                .iter()
                .map(|v| Interval::at(*v))
                .sum();
            means += share
                * (sum / Interval::at(mesh.dim as f64) + Interval::around_zero(leaf.unknown()));
        });
        if !drop.is_finite() {
            return Err(refusal(
                format!(
                    "psi could not be bounded on {}",
                    mesh.face_label(contact.face)
                ),
                "give an obstacle that is defined and finite on Γ_C",
            ));
        }
        obstacle.mean = means;
        let ceilings = obstacle.ceiling.iter_mut().zip(obstacle.values);
        ceilings
            .take(mesh.dim)
            .for_each(|(ceiling, value)| *ceiling = (value - Interval::at(drop)).low);
        if mesh.dim == 2 {
            let given = [0, 1].map(|i| dirichlet[face[i] as usize]);
            let is_above = |i: usize| given[i].is_some_and(|g| g.high > obstacle.ceiling[i]);
            let (is_pressed, simplex) = ((0..2).any(is_above), Simplex::new(mesh, contact.cell));
            let [first, second, ..] = obstacle.ceiling;
            obstacle.line = Some([first, second]);
            // About how far v may be off ψ without a lift.
            let mut off = drop.max(rise);
            if is_pressed {
                let corner_of =
                    |vertex: u32| mesh.cell(contact.cell).iter().position(|v| *v == vertex);
                let slope = |end: usize, to: f64| {
                    let ends = [corner_of(face[end])?, corner_of(face[1 - end])?];
                    least_slope(&simplex, ends, psi, unit, to)
                };
                let found = line_from_corner(&obstacle.values, given, &polygon(tree), slope);
                obstacle.line = found.map(|(line, _)| line);
                off = found.map_or(f64::INFINITY, |(_, fall)| off.max(fall));
            }
            let local = mesh.local_face(contact.cell, contact.face);
            if (is_pressed || off > ROUNDING * size)
                && let Ok(lift) = lift(&simplex, contact.cell, local, psi, unit)
                && lift
                    .as_ref()
                    .is_none_or(|lift| is_worth_it(&simplex, lift, off))
            {
                lifts.extend(lift);
                obstacle.is_lifted = true;
                obstacle.polygon = polygon(tree);
                obstacle.ceiling[..2].copy_from_slice(&[0, 1].map(|i| obstacle.values[i].low));
            } else if let Some(line) = &obstacle.line {
                obstacle.ceiling[..2].copy_from_slice(line);
            }
        }
        obstacles.push(obstacle);
    }
    Ok((obstacles, lifts))
}

/// The linear function of these values at the corners is nowhere above ψ on a leaf.
fn from_below(leaf: &Leaf) -> [Interval; 4] {
    let slack = Interval::at(leaf.wave) + Interval::at(leaf.most());
    leaf.values.map(|value| Interval::at(value) - slack)
}

/// ψ on the leaves of a face from below: linear between these values, where it may have two values at an s.
fn polygon(tree: &Tree) -> Vec<[f64; 2]> {
    let mut polygon = Vec::new();
    tree.for_each(&mut |node, piece, _| {
        let corners = piece.iter().zip(from_below(tree.leaf(node)));
        polygon.extend(corners.take(2).map(|(corner, psi)| [corner[1], psi.low]));
    });
    polygon
}

/// The line from the one end that has a value given to the other, and how far it is below ψ there; none where both have one, or where
/// ψ's slope in s from that end on has no bound.
fn line_from_corner(
    psi: &[Interval; 4],
    given: [Option<Interval>; 2],
    polygon: &[[f64; 2]],
    least_slope: impl Fn(usize, f64) -> Option<f64>,
) -> Option<([f64; 2], f64)> {
    let at = Interval::at;
    let (end, g) = match given {
        [Some(g), None] => (0, g),
        [None, Some(g)] => (1, g),
        _ => return None,
    };
    let c = at(g.high.min(psi[end].low));
    let away = |s: f64| {
        if end == 0 {
            at(s)
        } else {
            Interval::ONE - at(s)
        }
    };
    let through = |s: Interval, below: Interval| (c + (below - c) / s).low;
    let mut most = f64::INFINITY;
    // Leaf by leaf.
    for leaf in polygon.chunks_exact(2) {
        let mut points = [leaf[0], leaf[1]].map(|[s, below]| (away(s), at(below)));
        points.sort_by(|p, q| p.0.low.total_cmp(&q.0.low));
        let [(from, first), (to, last)] = points;
        most = most.min(through(to, last));
        if from.low > 0.0 {
            most = most.min(through(from, first));
        } else if first.low < c.low {
            // ψ may jump in the rest of the leaf.
            let up_to = |k: i32| {
                let share = at(0.5_f64.powi(k));
                let (s, below) = (share * to, first + share * (last - first));
                let by_slope = (c + at(least_slope(end, s.high)?)).low;
                Some(by_slope.min(through(s, below)))
            };
            let all = (0..HALVINGS).filter_map(up_to);
            most = most.min(all.reduce(f64::max)?);
        }
    }
    let mut line = [c.low; 2];
    line[1 - end] = most;
    let fall = (psi[1 - end] - at(most)).high;
    fall.is_finite().then_some((line, fall))
}

/// A lift over a spike costs more than passing below it: the slope of what is lifted is much steeper over the cell's size than what
/// ψ is off its interpolant, or a line off ψ.
fn is_worth_it(cell: &Simplex, lift: &Lift, off: f64) -> bool {
    let flat = above_of_product(off, 1.0 / cell.diameter) * cell.measure.high.sqrt();
    let steep = lift.norms(cell)[0];
    steep <= 30.0 * flat || above_of_all([steep]) == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Discretisation, Method, Problem};
    use crate::scene::{Data, Expression, Scene};

    /// The polygon below x² on a face of length h is nowhere farther below it than h²/100: by Taylor's formula on the whole face the
    /// ends are h²/6 below.
    #[test]
    fn polygons_are_near_a_bent_obstacle() {
        let scene = Scene::find("one-zone").unwrap();
        let scene = scene.with_data(Data {
            psi: Expression::parse("x^2").unwrap(),
            ..scene.data().clone()
        });
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, Method::cr());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let (found, _) = obstacles(&problem, 0, &vec![None; mesh.points.len()]).unwrap();
        for (contact, obstacle) in problem.contact.iter().zip(found) {
            let [a, b] = [0, 1].map(|i| mesh.points[mesh.face(contact.face)[i] as usize][0]);
            assert!(obstacle.polygon.len() > 2);
            for [s, below] in obstacle.polygon {
                let off = (a + s * (b - a)).powi(2) - below;
                assert!(0.0 <= off + 1e-15 && off < 0.01 * (b - a).powi(2), "{off}");
            }
        }
    }

    /// The mean of what no leaf resolves is not known, and its interval holds it: -1 on all but acos(0.9)/π of a period.
    #[test]
    fn means_hold_what_is_not_known() {
        let scene = Scene::find("one-zone").unwrap();
        let psi = Expression::parse("if(sin(1e7*x)<0.9,-1,0)").unwrap();
        let scene = scene.with_data(Data {
            psi,
            ..scene.data().clone()
        });
        let mesh = scene.triangulation(Some(4)).unwrap();
        let discretisation = Discretisation::of(&scene, Method::cr());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let mean = -1.0 + 0.9_f64.acos() / std::f64::consts::PI;
        for obstacle in obstacles(&problem, 0, &vec![None; mesh.points.len()])
            .unwrap()
            .0
        {
            let Interval { low, high } = obstacle.mean;
            assert!(low - 1e-3 <= mean && mean <= high + 1e-3, "{low} {high}");
        }
    }
}
