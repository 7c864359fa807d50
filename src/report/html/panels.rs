//! The panels along Γ_C: u and its contact, γ that faces imply, residuals, differences.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::along::{LEFT, Panel, Sheet};
use super::plane::word;
use super::residual::Put;
use crate::text::number::{number, power_of_ten, trimmed};
use crate::text::text;
use crate::why::Explanation;

/// γ that is off by less has no picture.
const OFF: f64 = 1e-9;

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
            // Faces follow each other as their places do.
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
        let all = || {
            points
                .iter()
                .flat_map(|p| [p.1, p.2])
                .filter(|v| v.abs() < 1e100)
        };
        let (low, high) = (
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        );
        if !(low < high) {
            return;
        }
        self.title(text!("u on Γ_C, and the obstacle"));
        self.at += 4.0;
        let panel = Panel {
            top: self.at,
            height: 54.0,
            low,
            high,
        };
        for (class, of) in [("frame", 2), ("ink", 1)] {
            let values = points
                .iter()
                .map(|p| (p.0, if of == 1 { p.1 } else { p.2 }));
            let path = self.line_through(
                values
                    .filter(|(_, v)| v.abs() < 1e100)
                    .map(|(s, v)| (s, panel.y(v))),
            );
            let _ = write!(
                self.svg,
                "<path class=\"{class}\" stroke-width=\"1.3\" d=\"{path}\"/>"
            );
        }
        let upper = if low < 0.0 && high >= 0.0 && -low > 4.0 * high {
            0.0
        } else {
            high
        };
        for value in [low, upper] {
            self.svg += &word(
                "t e",
                [LEFT - 6.0, panel.y(value) + 3.5],
                &trimmed(&number(value, 2)),
            );
        }
        if let Some(last) = points.last() {
            self.tag("obstacle ψ", panel.y(last.2) + 3.5, "");
        }
        self.at += 54.0 + 24.0;
    }

    /// Contact at each quadrature point, a line for each code.
    pub fn status(&mut self) {
        let of = self.of;
        let with: Vec<_> = of
            .fields
            .iter()
            .filter_map(|f| Some((f, f.column("status")?)))
            .collect();
        let Some((_, first)) = with.first() else {
            return;
        };
        let names: Vec<&str> = with.iter().map(|(f, _)| &*f.source).collect();
        match self.is_narrow {
            true => self.title(format!("Contact: {}", names.join(", "))),
            false => self.title(format!(
                "Contact at the {} quadrature points of each face",
                first.components
            )),
        }
        for (fields, column) in with {
            let faulty = of.is_faulty(&fields.source);
            let (mut path, mut runs) = (String::new(), Vec::<(f64, f64)>::new());
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
                        // Neighbours in contact are one zone.
                        Some((_, end)) if (*end - from).abs() <= 1e-6 * width => *end = to,
                        _ => runs.push((from, to)),
                    }
                }
            }
            for (from, to) in runs {
                let (from, to) = (self.x(from), self.x(to));
                let _ = write!(
                    path,
                    "M{from:.1} {:.0}h{:.1}v7H{from:.1}z",
                    self.at,
                    to - from
                );
            }
            let (right, at) = (self.right, self.at);
            let class = if faulty { "redf" } else { "inkf" };
            let _ = write!(
                self.svg,
                "<path class=\"hair\" d=\"M{LEFT} {at:.0}H{right}v7H{LEFT}z\"/><path class=\"{class}\" d=\"{path}\"/>"
            );
            self.tag(&fields.source, at + 8.0, if faulty { "red" } else { "" });
            self.at += 12.0;
        }
        self.at += 20.0;
    }

    /// What γ would have to be, where some of it is off.
    pub fn gamma(&mut self) {
        let of = self.of;
        let found = of.puts.last().and_then(|put| put.findings);
        let Some(found) = found else { return };
        let factors: Vec<f64> = found
            .gamma
            .iter()
            .filter_map(|g| g.factor)
            .filter(|f| f.is_finite())
            .collect();
        let is_gamma = found.culprit().is_some_and(Explanation::is_gamma);
        if !is_gamma || !factors.iter().any(|f| (f - 1.0).abs() > OFF) {
            return;
        }
        let (low, high) = factors
            .iter()
            .fold((1.0_f64, 1.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
        let room = 0.15 * (high - low);
        self.title("γ that each face implies ÷ γ that the scene gives");
        let panel = Panel {
            top: self.at,
            height: 44.0,
            low: low - room,
            high: high + room,
        };
        let digits = (2.0 - (high - low).log10().floor()).clamp(2.0, 12.0) as usize;
        for value in [1.0, if high - 1.0 > 1.0 - low { high } else { low }] {
            self.line("hair", panel.y(value), &format!("{value:.digits$}"));
        }
        let mut told = None;
        let (mut grey, mut lines) = (String::new(), [String::new(), String::new()]);
        for (k, row) in self.chain.rows.iter().enumerate() {
            let Some(gamma) = found.gamma.get(*row) else {
                continue;
            };
            let (a, b) = self.chain.ends[k];
            let (a, b) = (self.x(a), self.x(b));
            match gamma.factor {
                None => {
                    let _ = write!(grey, "M{a:.1} {:.1}H{b:.1}v44H{a:.1}z", self.at);
                }
                Some(factor) => {
                    let is_off =
                        (factor - 1.0).abs() > OFF.max(10.0 * gamma.uncertain.unwrap_or(0.0));
                    let y = panel.y(factor);
                    let _ = write!(
                        lines[usize::from(is_off)],
                        "M{:.1} {y:.1}H{:.1}",
                        a + 0.5,
                        b - 0.5
                    );
                    if is_off {
                        told = told.or(Some((b, y, factor, &gamma.vertices)));
                    }
                }
            }
        }
        for (path, (class, width)) in lines.iter().zip([("ink", 2.2), ("redl", 4.0)]) {
            let _ = write!(
                self.svg,
                "<path class=\"{class}\" stroke-width=\"{width}\" d=\"{path}\"/>"
            );
        }
        let _ = write!(
            self.svg,
            "<path class=\"holdf\" opacity=\".55\" d=\"{grey}\"/>"
        );
        let off = factors.iter().filter(|f| (*f - 1.0).abs() > OFF).count();
        if let (Some((x, y, factor, vertices)), 1) = (told, off) {
            let x = x.min(self.right - 130.0);
            self.svg += &word(
                "s red halo",
                [x + 6.0, y + 4.0],
                &format!("{factor:.4} on {vertices:?}"),
            );
        }
        if !grey.is_empty() {
            self.tag("grey: in contact,", self.at + 12.0, "");
            self.tag("γ has no say there", self.at + 25.0, "");
        }
        self.at += 44.0 + 22.0;
    }

    /// A frame of powers of ten, with the tolerance.
    fn powers(&mut self, largest: f64, tolerance: f64, height: f64) -> Panel {
        let high = (largest.max(10.0 * tolerance).log10() + 0.3)
            .ceil()
            .min(300.0);
        let panel = Panel {
            top: self.at,
            height,
            low: -17.0,
            high,
        };
        let every = if high > -5.0 { 5 } else { 4 };
        for power in (-17..=high as i32).filter(|p| (p + 17) % every == 0) {
            self.line("hair", panel.y(f64::from(power)), &power_of_ten(power));
        }
        let (right, y) = (self.right, panel.log(tolerance));
        let _ = write!(
            self.svg,
            "<path class=\"frame dash\" d=\"M{LEFT} {y:.1}H{right}\"/>"
        );
        self.tag("tolerance", y + 3.5, "");
        panel
    }

    /// The worst row of each contact face, of every code.
    pub fn residuals(&mut self) {
        let of = self.of;
        let (problem, mesh) = (of.problem, of.problem.space.mesh);
        let error = |put: &Put, row: usize| {
            let face = &problem.contact[row];
            let mut rows = problem
                .space
                .face_dofs(face.cell, mesh.local_face(face.cell, face.face));
            rows.by_ref()
                .map(|r| put.errors[r as usize])
                .fold(
                    0.0,
                    |m: f64, e| if e.is_nan() { f64::INFINITY } else { m.max(e) },
                )
        };
        let finite = |v: &f64| v.is_finite();
        let all = of
            .puts
            .iter()
            .flat_map(|put| (0..problem.contact.len()).map(|row| error(put, row)));
        let largest = all.filter(finite).fold(0.0, f64::max);
        let Some(tolerance) = of.puts.last().map(|put| put.ramp.tolerance) else {
            return;
        };
        self.title("Residual of the row of each face");
        let panel = self.powers(largest, tolerance, 70.0);
        for put in of.puts {
            let faulty = of.is_faulty(put.name);
            let mut seen = BTreeSet::new();
            let (class, side) = if faulty {
                ("redf", 4.4)
            } else {
                ("otherf", 3.4)
            };
            for (k, row) in self.chain.rows.iter().enumerate() {
                let at = [self.x(self.chain.s[k]), panel.log(error(put, *row))]
                    .map(|x| x.round() as i64);
                seen.insert(at);
            }
            let mut path = String::new();
            for [x, y] in seen {
                let _ = write!(
                    path,
                    "M{:.1} {:.1}h{side}v{side}h-{side}z",
                    x as f64 - 0.5 * side,
                    y as f64 - 0.5 * side
                );
            }
            let _ = write!(self.svg, "<path class=\"{class}\" d=\"{path}\"/>");
            let last = self.chain.rows.last().map_or(0.0, |row| error(put, *row));
            if faulty {
                self.tag(put.name, panel.log(last) + 3.5, "red");
            }
        }
        self.at += 70.0 + 24.0;
    }

    pub fn differences(&mut self) {
        let of = self.of;
        if of.differences.is_empty() {
            return;
        }
        let mut by_pair = Vec::new();
        for (name, of_pair) in &of.differences {
            let values: Vec<f64> = self
                .chain
                .rows
                .iter()
                .map(|row| {
                    let face = of.problem.contact[*row].face as u32;
                    let at = of_pair.binary_search_by_key(&face, |(face, _)| *face);
                    at.map_or(0.0, |k| of_pair[k].1)
                })
                .collect();
            by_pair.push((name, values));
        }
        let all = by_pair.iter().flat_map(|(_, v)| v.iter().copied());
        let largest = all.filter(|v| v.is_finite()).fold(0.0, f64::max);
        self.title("|a − b| of the face means, in units of max |u|");
        let panel = self.powers(largest, of.tolerance, 70.0);
        let count = by_pair.len();
        let mut taken: Vec<f64> = vec![panel.log(of.tolerance) + 3.5];
        for (k, (name, values)) in by_pair.into_iter().enumerate().rev() {
            let is_last = k + 1 == count && !of.faulty.is_empty();
            let finite = self
                .chain
                .s
                .iter()
                .zip(&values)
                .filter(|(_, v)| v.is_finite());
            let path = self.line_through(finite.map(|(s, v)| (*s, panel.log(*v))));
            let (class, width) = if is_last { ("redl", 1.6) } else { ("ink", 1.1) };
            let _ = write!(
                self.svg,
                "<path class=\"{class}\" stroke-width=\"{width}\" d=\"{path}\"/>"
            );
            let y = values.last().map_or(panel.top, |v| panel.log(*v)) + 3.5;
            let is_free =
                |y: &f64| *y <= panel.top + 80.0 && taken.iter().all(|t| (t - y).abs() >= 12.0);
            let around = [0.0, -6.0, 6.0, -12.0, 12.0, -18.0, 18.0, -24.0, 24.0];
            let y = around
                .into_iter()
                .map(|by| y + by)
                .find(is_free)
                .unwrap_or(y);
            taken.push(y);
            self.tag(name, y, if is_last { "red" } else { "" });
        }
        self.at += 70.0;
    }
}
