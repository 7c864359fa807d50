//! Points of Γ_C that are certainly free.
//!
//! Let the half-ball of radius ρ about x₀ ∈ Γ_C be in Ω with its flat side in Γ_C. u reflected in Γ_C has
//! -Δu ≤ F = max(0, sup f) in the ball, as ∂ₙu ≤ 0; so u + F |x-x₀|²/(2d) is subharmonic, and with a radial k of mass m
//!
//! ```text
//! m u(x₀) ≤ (2k, u) + F/(2d) ∫ k |x-x₀|²      over the half-ball and the ball
//! ```
//!
//! where (2k, u) has an upper bound by a dual problem ([`super::super::goal`]). Where it is below m ψ(x₀), x₀ is free; and so is
//! what is nearer to it than the slack over the slope: |(2k_x - 2k_y, u)| ≤ |x-y| ‖2k‖ ‖∇u‖, on the half-balls between.
//! Here d = 2 and k = c (1 - |x-x₀|²/ρ²)₊², whose mass is c π ρ²/3.

use super::super::cells::CellFields;
use super::super::goal::{Dual, Goal, Known, Rest};
use super::super::model::{Domain, Effort};
use super::super::simplex::{Simplex, dot, length, up};
use super::Line;
use crate::interval::Interval;
use crate::scene::Expression;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use std::collections::BTreeSet;

/// No more balls than that along Γ_C.
const MOST_BALLS: usize = 30;
/// Where the search begins in a run, until all of them are covered.
const STARTS: [f64; 3] = [0.5, 0.25, 0.75];
/// A ball that proves nothing is followed by smaller ones, down to this many lengths of a contact face.
const SMALLER: f64 = 0.4;
const SMALLEST: f64 = 2.5;
/// Leaves of a kernel beyond one a cell.
const KERNEL: usize = 800;
/// For dual problems u_h presses where -λ is at least this part of its largest value, and above the error of ∇u: μ/λ is large
/// where it hardly does.
const STRIP: f64 = 0.15;

impl Line {
    /// Where u < ψ is proved.
    pub fn free<'a>(
        &'a self,
        fields: &'a CellFields<'a>,
        known: &'a Known,
    ) -> Result<Vec<[f64; 2]>> {
        // Runs of faces that the discrete field does not press.
        let mut runs: Vec<[f64; 2]> = Vec::new();
        for (k, [from, to]) in &self.faces {
            if fields.lambda[*k] < 0.0 {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run[1] == *from => run[1] = *to,
                _ => runs.push([*from, *to]),
            }
        }
        let mut search = Search::new(self, fields, known);
        let mut proved: Vec<[f64; 2]> = Vec::new();
        for run in runs {
            let first = proved.len();
            for start in STARTS {
                let s = run[0] + start * (run[1] - run[0]);
                if proved[first..]
                    .iter()
                    .any(|[from, to]| *from <= s && s <= *to)
                {
                    continue;
                }
                let Some(found) = search.from(run, s)? else {
                    continue;
                };
                // What it meets of this run becomes one with it.
                let apart = |other: &[f64; 2]| other[1] < found[0] || found[1] < other[0];
                let met = proved.split_off(first);
                let (kept, met): (Vec<_>, Vec<_>) = met.into_iter().partition(apart);
                proved.extend(kept);
                proved.push(met.iter().fold(found, |of, other| {
                    [of[0].min(other[0]), of[1].max(other[1])]
                }));
            }
            proved[first..].sort_by(|a, b| a[0].total_cmp(&b[0]));
        }
        Ok(proved)
    }

    /// No boundary but this line's Γ_C is nearer to a point of it.
    fn room(&self, fields: &CellFields, s: f64) -> f64 {
        let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
        let x = self.point(s);
        let of_contact: BTreeSet<usize> =
            problem.contact.iter().map(|contact| contact.face).collect();
        let others =
            (0..mesh.face_count()).filter(|f| mesh.is_boundary(*f) && !of_contact.contains(f));
        let distance = others.map(|face| {
            let [a, b] = [0, 1].map(|i| mesh.points[mesh.face(face)[i] as usize]);
            let edge = [b[0] - a[0], b[1] - a[1]];
            let square = edge[0] * edge[0] + edge[1] * edge[1];
            let along = ((x[0] - a[0]) * edge[0] + (x[1] - a[1]) * edge[1]) / square;
            let t = along.clamp(0.0, 1.0);
            (x[0] - a[0] - t * edge[0]).hypot(x[1] - a[1] - t * edge[1])
        });
        // Rounding moves it by far less.
        distance.fold(f64::INFINITY, f64::min) * (1.0 - 1e-9)
    }
}

/// Balls along a line, as many as are left.
pub(super) struct Search<'a> {
    line: &'a Line,
    fields: &'a CellFields<'a>,
    known: &'a Known,
    dual: Dual<'a>,
    left: usize,
}

impl<'a> Search<'a> {
    pub fn new(line: &'a Line, fields: &'a CellFields<'a>, known: &'a Known) -> Self {
        let mesh = fields.problem.space.mesh;
        let area: f64 = (0..mesh.cell_count()).map(|cell| mesh.measure(cell)).sum();
        let most = fields.lambda.iter().fold(0.0, |m: f64, l| m.max(-l));
        let least = (STRIP * most).max(known.of_g / area.sqrt());
        Search {
            line,
            fields,
            known,
            dual: Dual::new(fields, known, least),
            left: MOST_BALLS,
        }
    }

    /// The part around a point of a run that is free: outward as far as each ball shows.
    fn from(&mut self, run: [f64; 2], start: f64) -> Result<Option<[f64; 2]>> {
        let Some((first, radius)) = self.ball(start, f64::INFINITY)? else {
            return Ok(None);
        };
        let mut found = first;
        for side in [0, 1] {
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let (mut reach, mut largest) = (0.5 * (first[1] - first[0]), radius);
            let mut fails = 0;
            while self.left > 0 && fails < 2 && reach > 0.005 * (run[1] - run[0]) {
                let next = found[side] + sign * 0.9 * reach;
                let inside = (run[side] - next) * sign > 0.0;
                let ball = if inside {
                    self.ball(next, 1.5 * largest)?
                } else {
                    None
                };
                match ball {
                    Some((more, radius)) if more[0] <= found[1] && found[0] <= more[1] => {
                        found = [found[0].min(more[0]), found[1].max(more[1])];
                        (reach, largest) = (0.5 * (more[1] - more[0]), radius);
                    }
                    // Free as well, but what is between is not shown to be.
                    Some((more, _)) => reach = (0.5 * (more[1] - more[0])).min(0.5 * reach),
                    None => {
                        reach *= 0.4;
                        fails += usize::from(inside);
                    }
                }
            }
        }
        Ok(Some(found))
    }

    /// An interval about a point of Γ_C that is free, and the ball's radius.
    pub fn ball(&mut self, s: f64, largest: f64) -> Result<Option<([f64; 2], f64)>> {
        let Search {
            line,
            fields,
            known,
            ..
        } = *self;
        let room = line.room(fields, s);
        let lengths = line.faces.iter().map(|(_, [from, to])| to - from);
        let h = lengths.fold(0.0, f64::max);
        let mut radius = (0.8 * room).min(largest);
        let mut best: Option<([f64; 2], f64)> = None;
        while self.left > 0 && radius > SMALLEST * h {
            self.left -= 1;
            cancel::check()?;
            let ball = Ball::new(line, fields, s, radius, room)?;
            let upper = self.dual.interval(&ball.goal)?.high;
            // From the widest interval that the room has to narrow ones.
            let widest = 0.9 * (room - ball.radius.high);
            let widths = (0..14).map(|k| widest * 0.6_f64.powi(k));
            let width = widths
                .filter(|w| *w > 0.0)
                .find(|w| ball.is_free(line, fields, known, upper, *w));
            // As long as smaller balls show more: f bends u by ρ², a narrow kernel costs more.
            match (width, best) {
                (Some(width), Some((of_larger, _)))
                    if 2.0 * width <= of_larger[1] - of_larger[0] =>
                {
                    break;
                }
                (Some(width), _) => best = Some(([s - width, s + width], radius)),
                (None, Some(_)) => break,
                (None, None) => {}
            }
            radius *= SMALLER;
        }
        Ok(best)
    }
}

/// A half-ball and its kernel.
struct Ball {
    goal: Goal,
    centre: f64,
    /// ρ
    radius: Interval,
    /// c, and ρ² as the kernel has it
    scale: f64,
    square: f64,
    /// The cells that the ball or one next to it may meet, nearest first.
    around: Vec<Around>,
}

/// A cell near a ball.
struct Around {
    /// No point of the cell is nearer to the ball's centre.
    distance: f64,
    /// sup f at most
    load: f64,
    /// ‖G‖_κ at most
    gradient: f64,
}

impl Around {
    fn new(fields: &CellFields, cell: usize, x: [f64; 3]) -> Self {
        let (mesh, at) = (fields.problem.space.mesh, Interval::at);
        let geometry = mesh.geometry(cell);
        let c = geometry.point(&geometry.centroid());
        let distance = (c[0] - x[0]).hypot(c[1] - x[1]) * (1.0 - 1e-9) - geometry.diameter;
        let tree = &fields.data.trees[cell];
        let mut load = 0.0_f64;
        tree.for_each(&mut |node, _, _| {
            let leaf = tree.leaf(node);
            let most = leaf.values[..3]
                .iter()
                .fold(f64::NEG_INFINITY, |m: f64, v| m.max(*v));
            load = load.max((at(most) + at(leaf.wave) + at(leaf.most())).high);
        });
        let simplex = Simplex::new(mesh, cell);
        let corners = fields.gradient_at_corners(&simplex, cell);
        let largest = corners[..3].iter().map(|g| dot(g, g, 2).high);
        // A linear field is nowhere larger than at a corner; its bubble counts by its norm.
        let flat = (at(largest.fold(0.0, f64::max)) * simplex.measure).root();
        Around {
            distance,
            load,
            gradient: up(flat.high, 0.5 * fields.norm_of_bubble(&simplex, cell)),
        }
    }
}

impl Ball {
    fn new(line: &Line, fields: &CellFields, s: f64, radius: f64, room: f64) -> Result<Self> {
        let mesh = fields.problem.space.mesh;
        let x = line.point(s);
        let square = radius * radius;
        let scale = 3.0 / (std::f64::consts::PI * square);
        let text = format!(
            "{:?}*max(0,1-((x-({:?}))^2+(y-({:?}))^2)/{square:?})^2",
            2.0 * scale,
            x[0],
            x[1]
        );
        // It is written by us; a number that cannot be read again would make a kernel of 0, which proves nothing.
        let kernel = Expression::parse(&text).unwrap_or(Expression::constant(0.0));
        let box_of = |cell: usize| -> [Interval; 3] {
            let of = |k: usize| {
                mesh.cell(cell)
                    .iter()
                    .map(move |&v| Interval::at(mesh.points[v as usize][k]))
            };
            [0, 1, 2].map(|k| of(k).reduce(Interval::hull).unwrap_or(Interval::WHOLE))
        };
        let is_near = |cell: &usize| !kernel.range(box_of(*cell)).is_zero();
        let near: Vec<usize> = (0..mesh.cell_count()).filter(is_near).collect();
        let domain = Domain {
            expression: &kernel,
            vertices: Box::new(|k| mesh.vertices(near[k])),
            measures: near.iter().map(|&cell| mesh.measure(cell)).collect(),
            dim: 2,
            space: 2,
            unit: 0,
        };
        let trees = domain.enclose(&Effort {
            tolerance: 1e-3 * radius,
            budget: KERNEL,
        })?;
        let mut means = vec![0.0; mesh.cell_count()];
        let mut rests = vec![Rest::default(); mesh.cell_count()];
        for (&cell, tree) in near.iter().zip(&trees) {
            let mean = |node: u32| {
                let values = tree.leaf(node).values[..3]
                    .iter()
                    .copied()
                    .map(Interval::at);
                values.sum::<Interval>() / Interval::at(3.0)
            };
            let exact = tree.mean(mean);
            let mean = exact.mid();
            let mut rest = Rest {
                mean: exact.radius(),
                ..Rest::default()
            };
            tree.for_each(&mut |node, _, share| {
                let leaf = tree.leaf(node);
                for value in &leaf.values[..3] {
                    let off = (Interval::at(*value) - exact).abs() + Interval::at(leaf.wave);
                    rest.spread = rest.spread.max(off.high);
                }
                rest.most = rest.most.max(up(leaf.most(), exact.radius()));
                rest.mean = (Interval::at(rest.mean) + share * Interval::at(leaf.unknown())).high;
            });
            (means[cell], rests[cell]) = (mean, rest);
        }
        let mut around: Vec<Around> = (0..mesh.cell_count())
            .filter(|&cell| {
                let c = mesh.points[mesh.cell(cell)[0] as usize];
                (c[0] - x[0]).hypot(c[1] - x[1]) <= 1.01 * room + 2.0 * mesh.geometry(cell).diameter
            })
            .map(|cell| Around::new(fields, cell, x))
            .collect();
        around.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        Ok(Ball {
            goal: Goal {
                means,
                rests,
                on_boundary: Vec::new(),
            },
            centre: s,
            radius: Interval::at(square).sqrt(),
            scale,
            square,
            around,
        })
    }

    /// Whether u < ψ within `width` of the centre, as (2k, u) ≤ `upper`.
    fn is_free(
        &self,
        line: &Line,
        fields: &CellFields,
        known: &Known,
        upper: f64,
        width: f64,
    ) -> bool {
        let data = &fields.data;
        let at = Interval::at;
        let reach = self.radius.high + width;
        // F and ‖∇u‖ on all half-balls: cells that may meet them.
        let (mut load, mut squares) = (0.0_f64, Vec::new());
        for around in self
            .around
            .iter()
            .take_while(|around| around.distance <= reach)
        {
            load = load.max(around.load);
            squares.push(around.gradient);
        }
        let slope = up(length(squares), known.of_g);
        // ‖2k‖² over the half-ball: 2 c² π ρ²/5.
        let area = Interval::PI * at(self.square);
        let kernel = (2.0 * (at(self.scale).square() * area) / at(5.0)).root();
        let mass = at(self.scale) * area / at(3.0);
        // ∫ k |x-x₀|² = c π ρ⁴/12, over 2d = 4.
        let bent = at(load) * at(self.scale) * area * at(self.square) / at(48.0);
        let moved = at(width) * kernel * at(slope);
        let total = at(upper) + bent + moved;
        // ψ on the whole interval.
        let psi = &fields.problem.scene.data().psi;
        let mut around = line.point(self.centre).map(at);
        around[line.axis] = Interval::new(
            (at(self.centre) - at(width)).low,
            (at(self.centre) + at(width)).high,
        );
        let psi = psi.range(around).times_power_of_two(data.unit);
        (mass * psi - total).low > 0.0
    }
}
