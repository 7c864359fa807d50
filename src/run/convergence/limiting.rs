//! What limits an order: straight sides on a curved domain, a re-entrant corner, a coefficient that jumps inside cells, or a method that is not
//! adjoint-consistent. A pattern of orders is not enough to name a cause: the mesh or the position of the error must show it as well.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::{Convergence, Order};
use crate::text::number::{number, size, whole};
use crate::text::{Text, text};
use faceoff_mesh::field::Results;

/// The reason for an order below the theoretical one.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Limiting {
    /// The measure of the mesh changes from level to level, as for straight cells on a curved domain.
    StraightSides {
        /// The relative change from the last mesh but one to the last.
        change: f64,
    },
    /// A corner of the domain of more than 180°.
    Corner {
        /// Its place.
        at: [f64; 2],
        /// The interior angle.
        degrees: f64,
        /// π/ω, the order in H¹.
        order: f64,
    },
    /// The gradient is wrong in a strip of cells in the interior of the domain.
    Jump {
        /// The number of cells with most of the error.
        cells: usize,
        /// The number of all cells.
        of: usize,
    },
    /// The order is right in H¹ and one less in L², and boundary values are imposed weakly.
    Nonsymmetric {
        /// The largest error at a vertex of the boundary, relative to that at any vertex.
        boundary: f64,
    },
    /// The error falls if a parameter changes, on the same mesh.
    Parameter {
        /// The name of the parameter.
        name: String,
        /// Its values.
        values: [String; 2],
        /// The error in L² with each value.
        errors: [f64; 2],
    },
}

/// Measures that differ by at most this, relatively, are equal.
const SAME: f64 = 1e-7;
/// The tolerance for matching observed orders to a pattern.
const NEAR: f64 = 0.3;
/// The same for a singularity, whose order is known more precisely.
const NEARER: f64 = 0.12;
/// Smaller angles belong to polygons that approximate a curve.
const REENTRANT: f64 = 1.1 * std::f64::consts::PI;
/// The fraction of the squared error that locates it.
const MOST: f64 = 0.8;
/// Cells of a strip: at most this many times √N of N cells.
const STRIP: f64 = 3.0;
/// If boundary values are imposed strongly, the error at boundary vertices is at most this fraction of the largest one.
const STRONG: f64 = 1e-3;

impl Limiting {
    /// A clause such as `straight sides on a curved domain limit it …`
    pub fn words(&self) -> Text {
        match self {
            Limiting::StraightSides { change } => text!(
                "straight sides on a curved domain limit it (the measure of the mesh changes by {} of it on the last refinement): use curved cells of the same degree as the space",
                size(*change)
            ),
            Limiting::Corner { at, degrees, order } => text!(
                "the corner of {}° at ({}, {}) limits it to π/ω = {} in H¹: refine towards it",
                number(*degrees, 3),
                number(at[0], 4),
                number(at[1], 4),
                number(*order, 3)
            ),
            Limiting::Jump { cells, of } => text!(
                "most of the error in the gradient is in {} of {} cells along a line inside of the domain, as where a coefficient jumps inside cells: let the mesh follow it",
                whole(*cells),
                whole(*of)
            ),
            Limiting::Nonsymmetric { .. } => text!(
                "it is one less in L² only, and values on the boundary are imposed weakly, as in a nonsymmetric Nitsche or nonsymmetric interior penalty method, which is not adjoint-consistent"
            ),
            Limiting::Parameter {
                name,
                values: [from, to],
                errors: [before, after],
            } => text!(
                "`{name}` limits it: the error on the finest level falls from {} to {} with {name} = {to} instead of {from}",
                size(*before),
                size(*after)
            ),
        }
    }

    /// The causes that the results show; `value` is the exact solution with its gradient at a point, by component.
    pub fn of(
        theory: [Option<f64>; 2],
        found: &Convergence,
        finest: &Results,
        components: usize,
        value: &dyn Fn([f64; 3], usize) -> f64,
    ) -> Option<Limiting> {
        // Over all levels, since orders of singularities vary with the position of the mesh.
        let last = |order: Option<&Order>| order.and_then(|order| Some(order.fit?.exponent));
        let (l2, h1) = (last(Some(&found.l2)), last(found.h1.as_ref()));
        let [theory_l2, theory_h1] = theory;
        let is = |order: Option<f64>, of: f64, room: f64| {
            order.is_some_and(|order| (order - of).abs() <= room)
        };
        if let Some(change) = curved(found)
            && (theory_l2.is_some_and(|t| t > 2.5) || theory_h1.is_some_and(|t| t > 1.75))
            && match h1 {
                Some(_) => is(h1, 1.5, NEAR),
                None => is(l2, 2.0, NEAR),
            }
        {
            return Some(Limiting::StraightSides { change });
        }
        let place = Place::of(finest, &found.field, components, value)?;
        let is_order = |alpha: f64| match h1 {
            Some(_) => is(h1, alpha, NEARER),
            // The error in L² falls twice as fast, up to the limit of the space.
            None => is(l2, 2.0 * alpha, 2.0 * NEARER),
        };
        let near = |at: &[f64; 2]| distance(*at, place.worst) <= 2.5 * place.h;
        let corner = place
            .corners
            .iter()
            .find(|(at, angle)| near(at) && is_order(std::f64::consts::PI / angle));
        if let Some((at, angle)) = corner {
            return Some(Limiting::Corner {
                at: *at,
                degrees: angle.to_degrees(),
                order: std::f64::consts::PI / angle,
            });
        }
        if place.is_strip && is_order(0.5) {
            return Some(Limiting::Jump {
                cells: place.most,
                of: place.cells,
            });
        }
        let is_less = theory_l2.is_some_and(|t| is(l2, t - 1.0, NEAR));
        let is_right = h1.zip(theory_h1).is_some_and(|(h1, t)| h1 >= t - NEAR);
        (is_less && is_right && place.boundary > STRONG).then_some(Limiting::Nonsymmetric {
            boundary: place.boundary,
        })
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The last relative change of the measure of the meshes, if changes fall about like h².
fn curved(found: &Convergence) -> Option<f64> {
    let levels = &found.levels;
    // h is the size of the cells, whatever the orders refer to.
    let measures: Vec<f64> = levels.iter().map(|of| of.measure).collect();
    let last = measures.last()?;
    let changes: Vec<f64> = measures
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs() / last)
        .collect();
    let [.., before, change] = &changes[..] else {
        return None;
    };
    let cells = |k: usize| levels[levels.len() - k].cells as f64;
    // In 2D, h² is 1 over the number of cells.
    let order = 2.0 * (before / change).ln() / (cells(1) / cells(2)).ln();
    (*change > SAME && order > 1.0 && order < 3.0).then_some(*change)
}

/// A corner of a triangle: its position, the index of its errors, and its point, which triangles share.
type Corner = ([f64; 2], usize, [i64; 2]);

/// Where the error of a 2D result is, and which corners its mesh has.
struct Place {
    /// The re-entrant ones, with their angles.
    corners: Vec<([f64; 2], f64)>,
    /// The centre of the cell in which the gradient is worst.
    worst: [f64; 2],
    h: f64,
    cells: usize,
    /// The number of cells with most of the squared error of the gradient.
    most: usize,
    /// Are these few, spread out and not along the boundary?
    is_strip: bool,
    /// The largest error at a vertex of the boundary, relative to that at any vertex.
    boundary: f64,
}

impl Place {
    /// `None` if the result is not on triangles and quadrangles, or has no values at their corners.
    fn of(
        of: &Results,
        name: &str,
        components: usize,
        value: &dyn Fn([f64; 3], usize) -> f64,
    ) -> Option<Self> {
        let field = |all: &'_ [_]| -> Option<usize> {
            all.iter()
                .position(|f: &faceoff_mesh::field::ResultField| f.name == name && f.at.is_none())
        };
        let (values, width, by_corner) = match (field(&of.on_points), field(&of.on_corners)) {
            (Some(k), _) => (&of.on_points[k].values, of.on_points[k].components, false),
            (_, Some(k)) => (&of.on_corners[k].values, of.on_corners[k].components, true),
            _ => return None,
        };
        if of.space != 2 && of.points.iter().any(|x| x[2] != of.points[0][2]) {
            return None;
        }
        let kinds = of
            .kinds
            .iter()
            .flat_map(|(kind, count)| std::iter::repeat_n(*kind, *count));
        // If cells have separate points, those at one position are one; if they share points, a slit has two at one position.
        let nodes: BTreeSet<u32> = of.cells.iter().copied().collect();
        let is_shared = 2 * nodes.len() < of.cells.len();
        let size = of
            .points
            .iter()
            .flatten()
            .fold(0.0_f64, |most, x| most.max(x.abs()));
        let key = |node: usize, x: [f64; 3]| match is_shared {
            true => [node as i64, 0],
            false => [0, 1].map(|i| (x[i] / (SAME * size)).round() as i64),
        };
        let mut triangles: Vec<[Corner; 3]> = Vec::new();
        let mut errors: Vec<f64> = Vec::new();
        let mut start = 0;
        for (cell, kind) in kinds.enumerate() {
            let nodes: Vec<u32> = of.cell(cell).collect();
            let here = start;
            start += nodes.len();
            if kind.dim() != 2 {
                continue;
            }
            let corners = nodes
                .get(..kind.corners())
                .filter(|c| (3..=4).contains(&c.len()))?;
            let corner = |k: usize, errors: &mut Vec<f64>| {
                let node = corners[k] as usize;
                let x = *of.points.get(node)?;
                let row = if by_corner { here + k } else { node };
                let at = errors.len();
                for i in 0..components {
                    errors.push(values.get(width * row + i)? - value(x, i));
                }
                Some(([x[0], x[1]], at, key(node, x)))
            };
            let all = (0..corners.len())
                .map(|k| corner(k, &mut errors))
                .collect::<Option<Vec<_>>>()?;
            triangles.extend((1..all.len() - 1).map(|k| [all[0], all[k], all[k + 1]]));
        }
        if triangles.is_empty() || errors.iter().any(|e| !e.is_finite()) {
            return None;
        }
        Some(Place::new(&triangles, &errors, components))
    }

    fn new(triangles: &[[Corner; 3]], errors: &[f64], components: usize) -> Self {
        let area = |t: &[Corner; 3]| {
            let [a, b, c] = t.map(|(x, ..)| x);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
        };
        let total: f64 = triangles.iter().map(area).sum();
        let h = (total / triangles.len() as f64).sqrt();
        let mut sides: BTreeMap<[[i64; 2]; 2], usize> = BTreeMap::new();
        let mut angles: BTreeMap<[i64; 2], ([f64; 2], f64)> = BTreeMap::new();
        for t in triangles {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| t[(k + i) % 3].0);
                let side = [t[k].2, t[(k + 1) % 3].2];
                *sides
                    .entry([side[0].min(side[1]), side[0].max(side[1])])
                    .or_default() += 1;
                let [u, v] = [b, c].map(|x| [x[0] - a[0], x[1] - a[1]]);
                let angle = (u[0] * v[1] - u[1] * v[0])
                    .abs()
                    .atan2(u[0] * v[0] + u[1] * v[1]);
                angles.entry(t[k].2).or_insert((a, 0.0)).1 += angle;
            }
        }
        let outer = sides.iter().filter(|(_, count)| **count == 1);
        let boundary: BTreeSet<[i64; 2]> = outer.flat_map(|(side, _)| *side).collect();
        let corners = angles
            .iter()
            .filter(|(key, (_, angle))| boundary.contains(*key) && *angle > REENTRANT);
        let mut slopes: Vec<(f64, usize)> = triangles
            .iter()
            .enumerate()
            .map(|(k, t)| (slope(t, errors, components) * area(t), k))
            .collect();
        slopes.sort_by(|p, q| q.0.total_cmp(&p.0));
        let sum: f64 = slopes.iter().map(|(e, _)| e).sum();
        let mut so_far = 0.0;
        let most: Vec<usize> = slopes
            .iter()
            .take_while(|(e, _)| {
                let is_in = so_far < MOST * sum;
                so_far += e;
                is_in
            })
            .map(|(_, k)| *k)
            .collect();
        let middle = |k: usize| {
            let t = &triangles[k];
            [0, 1].map(|i| t.iter().map(|(x, ..)| x[i]).sum::<f64>() / 3.0)
        };
        let wide = |all: &mut dyn Iterator<Item = [f64; 2]>| {
            let start = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
            let [low, high] = all.fold(start, |[low, high], x| {
                [
                    [0, 1].map(|i| low[i].min(x[i])),
                    [0, 1].map(|i| high[i].max(x[i])),
                ]
            });
            distance(low, high)
        };
        let touches = |k: &&usize| {
            triangles[**k]
                .iter()
                .any(|(.., point)| boundary.contains(point))
        };
        let outside = most.iter().filter(touches).count();
        let extent = wide(&mut most.iter().map(|k| middle(*k)));
        let whole = wide(&mut (0..triangles.len()).map(middle));
        let largest = |is_outer: bool| {
            let all = triangles.iter().flatten();
            let all = all.filter(|(.., point)| !is_outer || boundary.contains(point));
            let all = all.flat_map(|(_, at, _)| &errors[*at..at + components]);
            all.fold(0.0_f64, |most, e| most.max(e.abs()))
        };
        let of_all = largest(false);
        Place {
            corners: corners.map(|(_, corner)| *corner).collect(),
            worst: slopes.first().map_or([0.0; 2], |(_, k)| middle(*k)),
            h,
            cells: triangles.len(),
            most: most.len(),
            is_strip: most.len() as f64 <= STRIP * (triangles.len() as f64).sqrt()
                && extent > 0.25 * whole
                && 2 * outside < most.len(),
            boundary: if of_all > 0.0 {
                largest(true) / of_all
            } else {
                0.0
            },
        }
    }
}

/// The squared gradient of the linear function with the errors at the corners.
fn slope(t: &[Corner; 3], errors: &[f64], components: usize) -> f64 {
    let [a, b, c] = t.map(|(x, ..)| x);
    let [u, v] = [b, c].map(|x| [x[0] - a[0], x[1] - a[1]]);
    let det = u[0] * v[1] - u[1] * v[0];
    let of = |i: usize| {
        let [e, f, g] = t.map(|(_, at, _)| errors[at + i]);
        let (p, q) = (f - e, g - e);
        let x = (p * v[1] - q * u[1]) / det;
        let y = (q * u[0] - p * v[0]) / det;
        x * x + y * y
    };
    (0..components).map(of).filter(|x| x.is_finite()).sum()
}
