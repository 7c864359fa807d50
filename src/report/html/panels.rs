//! The panels along Γ_C: u and its contact, γ of each face, residuals, differences.

use super::along::Sheet;
use super::chart::{Axis, COLOURS, Chart, Cloud, Line, Point, RED};
use super::plane::ends;
use super::residual::Put;
use crate::text::number::{number, trimmed};
use crate::text::text;
use crate::why::Explanation;

/// A smaller relative deviation of γ is not drawn.
const OFF: f64 = 1e-9;
/// Values below rounding are drawn as equal.
pub(super) const LEAST: f64 = 1e-17;

impl Sheet<'_> {
    /// u at the quadrature points, and the obstacle.
    pub fn trace(&mut self) {
        let of = self.of;
        let Some(put) = of.puts.first() else { return };
        let mesh = of.problem.space.mesh;
        let mut points = Vec::new();
        for (k, row) in self.chain.rows.iter().enumerate() {
            let face = &of.problem.contact[*row];
            let local = of.problem.space.local(face.cell, put.u);
            let ends = mesh.face(face.face);
            let start = mesh.points[ends[0] as usize];
            let (a, b) = self.chain.ends[k];
            let mut of_face: Vec<(f64, f64, f64)> = face
                .points
                .iter()
                .map(|point| {
                    let from: f64 = (0..3).map(|k| (point.x[k] - start[k]).powi(2)).sum();
                    let share = from.sqrt() / face.measure;
                    let gap = point.trace(face.gamma, &local).gap;
                    (share, gap + point.psi, point.psi)
                })
                .collect();
            // Faces are in the order of their positions.
            let next = mesh.points[ends[1] as usize];
            let axis = if self.chain.axis == "y" { 1 } else { 0 };
            if next[axis] < start[axis] {
                of_face.iter_mut().for_each(|p| p.0 = 1.0 - p.0);
            }
            of_face.sort_by(|p, q| p.0.total_cmp(&q.0));
            points.extend(
                of_face
                    .into_iter()
                    .map(|(share, u, psi)| (a + share * (b - a), u, psi)),
            );
        }
        let shown = |pick: fn(&(f64, f64, f64)) -> f64| {
            let points = points.iter().map(move |p| [p.0, pick(p)]);
            points.filter(|p| p[1].abs() < 1e100)
        };
        let [low, high] = ends(shown(|p| p.1).chain(shown(|p| p.2)).map(|p| p[1]));
        if !(low < high) {
            return;
        }
        let upper = match low < 0.0 && high >= 0.0 && -low > 4.0 * high {
            true => 0.0,
            false => high,
        };
        let line = |name: &str, class, points: Vec<[f64; 2]>| Line {
            colour: [class; 2],
            is_bare: true,
            ..Line::new(name, 0, points)
        };
        let chart = Chart {
            y: Axis::linear("", [low, upper].map(|v| (v, trimmed(&number(v, 2))))),
            lines: vec![
                line("obstacle ψ", "frame", shown(|p| p.2).collect()),
                line("u", "ink", shown(|p| p.1).collect()),
            ],
            ..Chart::default()
        };
        self.panel(text!("u on Γ_C, and the obstacle"), 54.0, chart);
    }

    /// Contact at each quadrature point, one line per code.
    pub fn status(&mut self) {
        let of = self.of;
        let fields = of.fields.iter();
        let with = fields.filter_map(|f| Some((f, f.column("status")?)));
        let with: Vec<_> = with.collect();
        let Some((_, first)) = with.first() else {
            return;
        };
        let names: Vec<&str> = with.iter().map(|(f, _)| &*f.source).collect();
        let title = match self.is_narrow {
            true => format!("Contact: {}", names.join(", ")),
            false => format!(
                "Contact at the {} quadrature points of each face",
                first.components
            ),
        };
        let lines = with.iter().enumerate().map(|(line, (fields, column))| {
            let mut runs = Vec::<[f64; 2]>::new();
            for (k, row) in self.chain.rows.iter().enumerate() {
                let face = of.problem.contact[*row].face as u32;
                let Ok(at) = column.faces.binary_search(&face) else {
                    continue;
                };
                let values = column.row(at);
                let (a, b) = self.chain.ends[k];
                let width = (b - a) / values.len() as f64;
                for (q, _) in values.iter().enumerate().filter(|(_, p)| **p <= 0.0) {
                    let (from, to) = (a + q as f64 * width, a + (q + 1) as f64 * width);
                    match runs.last_mut() {
                        // Neighbours in contact form one zone.
                        Some([_, end]) if (*end - from).abs() <= 1e-6 * width => *end = to,
                        _ => runs.push([from, to]),
                    }
                }
            }
            let height = (with.len() - line) as f64;
            segments(
                &fields.source,
                of.is_faulty(&fields.source),
                5.0,
                runs.into_iter().map(|run| (run, height)),
            )
        });
        let chart = Chart {
            lines: lines.collect(),
            y: Axis::linear("", (1..=with.len()).map(|k| (k as f64, String::new()))),
            ..Chart::default()
        };
        self.panel(title, 13.0 * with.len() as f64, chart);
    }

    /// The γ that fits, if it deviates somewhere.
    pub fn gamma(&mut self) {
        let of = self.of;
        let found = of.puts.last().and_then(|put| put.findings);
        let Some(found) = found else { return };
        let factors = found.gamma.iter().filter_map(|g| g.factor);
        let factors: Vec<f64> = factors.filter(|f| f.is_finite()).collect();
        let is_gamma = found.culprit().is_some_and(Explanation::is_gamma);
        let off = factors.iter().filter(|f| (*f - 1.0).abs() > OFF).count();
        if !is_gamma || off == 0 {
            return;
        }
        let [low, high] = ends(factors.iter().copied().chain([1.0]));
        let digits = (2.0 - (high - low).log10().floor()).clamp(2.0, 12.0) as usize;
        let farthest = if high - 1.0 > 1.0 - low { high } else { low };
        let mut told = String::new();
        let mut runs = [Vec::new(), Vec::new()];
        let mut grey = Vec::new();
        for (k, row) in self.chain.rows.iter().enumerate() {
            let Some(gamma) = found.gamma.get(*row) else {
                continue;
            };
            let (a, b) = self.chain.ends[k];
            let Some(factor) = gamma.factor else {
                grey.push([a, b]);
                continue;
            };
            let least = OFF.max(10.0 * gamma.uncertain.unwrap_or(0.0));
            let is_off = (factor - 1.0).abs() > least;
            if is_off && off == 1 {
                told = format!("{factor:.4} on {:?}", gamma.vertices);
            }
            runs[usize::from(is_off)].push(([a, b], factor));
        }
        let [right, wrong] = runs;
        let chart = Chart {
            y: Axis::linear("", [1.0, farthest].map(|v| (v, format!("{v:.digits$}")))),
            lines: vec![
                segments("", false, 1.6, right.into_iter()),
                segments(&told, true, 2.9, wrong.into_iter()),
            ],
            shades: grey,
            levels: vec![(1.0, "")],
            ..Chart::default()
        };
        let grey = match chart.shades.is_empty() {
            true => "",
            false if self.is_narrow => "; grey: in contact",
            false => "; grey: in contact, where γ does not enter",
        };
        let title = match self.is_narrow {
            true => text!("γ of each face ÷ γ of the scene{grey}"),
            false => text!("γ that each face implies ÷ γ that the scene gives{grey}"),
        };
        self.panel(title, 44.0, chart);
    }

    /// The worst row of each contact face, for every code.
    pub fn residuals(&mut self) {
        let of = self.of;
        let (problem, mesh) = (of.problem, of.problem.space.mesh);
        let error = |put: &Put, row: usize| {
            let face = &problem.contact[row];
            let local = mesh.local_face(face.cell, face.face);
            let errors = problem.space.face_dofs(face.cell, local);
            let errors = errors.map(|r| put.errors[r as usize]);
            errors.fold(
                0.0,
                |m: f64, e| if e.is_nan() { f64::INFINITY } else { m.max(e) },
            )
        };
        let Some(tolerance) = of.puts.last().map(|put| put.ramp.tolerance) else {
            return;
        };
        let clouds = of.puts.iter().map(|put| {
            let (fill, side) = match of.is_faulty(put.name) {
                true => ("redf", 4.4),
                false => ("otherf", 3.4),
            };
            let rows = self.chain.s.iter().zip(&self.chain.rows);
            let points = rows.map(|(s, row)| [*s, error(put, *row).max(LEAST)]);
            Cloud {
                fill,
                side,
                points: points.collect(),
            }
        });
        let chart = Chart {
            clouds: clouds.collect(),
            levels: vec![(tolerance, "tolerance")],
            ..Chart::default()
        };
        let red = match &of.faulty[..] {
            [] => String::new(),
            names => format!("; red: {}", names.join(", ")),
        };
        self.panel(
            format!("Residual of the row of each face{red}"),
            70.0,
            chart,
        );
    }

    /// Differences of the means of two codes.
    pub fn differences(&mut self) {
        let of = self.of;
        let all = of.differences.len();
        if all == 0 {
            return;
        }
        let lines = of.differences.iter().enumerate();
        let lines = lines.map(|(k, (name, of_pair))| {
            let rows = self.chain.s.iter().zip(&self.chain.rows);
            let points = rows.map(|(s, row)| {
                let face = of.problem.contact[*row].face as u32;
                let at = of_pair.binary_search_by_key(&face, |(face, _)| *face);
                [*s, at.map_or(0.0, |k| of_pair[k].1).max(LEAST)]
            });
            let is_wrong = k + 1 == all && !of.faulty.is_empty();
            Line {
                colour: if is_wrong { RED } else { COLOURS[0] },
                is_bare: true,
                ..Line::new(name, 0, points)
            }
        });
        let chart = Chart {
            lines: lines.collect(),
            levels: vec![(of.tolerance, "tolerance")],
            ..Chart::default()
        };
        let title = "|a − b| of the face means, in units of max |u|";
        self.panel(title, 70.0, chart);
    }
}

/// A line for each run, at its height.
fn segments(
    name: &str,
    is_wrong: bool,
    thickness: f64,
    runs: impl Iterator<Item = ([f64; 2], f64)>,
) -> Line {
    let points = runs.flat_map(|(run, y)| {
        let of = move |(k, x)| Point {
            is_apart: k == 0,
            ..Point::new([x, y])
        };
        run.into_iter().enumerate().map(of)
    });
    Line {
        colour: if is_wrong { RED } else { COLOURS[0] },
        is_bare: true,
        thickness,
        points: points.collect(),
        ..Line::new(name, 0, [])
    }
}
