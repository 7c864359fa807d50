//! What a difference looks like all over the mesh, and how it falls off with the distance.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::Html;
use super::markup::figure;
use super::plane::{Layers, WIDTH, circle, drawing, ticks, word};
use super::ramp::Ramp;
use super::residual::{corners, outline, window};
use super::surface::Surface;
use crate::text::number::{number, power_of_ten, trimmed};
use crate::text::text;
use faceoff_fem::contact::Problem;

/// Of more faces the map has squares.
const MOST: usize = 5_000;
const HIGHEST: f64 = 310.0;

/// Differences of a field on faces, in units of their tolerance where they have a colour.
pub(in crate::report) struct Effect<'a> {
    pub problem: &'a Problem<'a>,
    pub values: &'a [(u32, f64)],
    pub tolerance: f64,
    pub name: &'a str,
}

impl Effect<'_> {
    /// The map; in space that of Γ_C.
    pub fn map(&self, about: &str) -> Html {
        let mesh = self.problem.space.mesh;
        let largest = self
            .values
            .iter()
            .map(|(_, d)| *d)
            .filter(|d| d.is_finite())
            .fold(0.0, f64::max);
        let ramp = Ramp::new(self.tolerance, largest);
        let label = format!("map of differences, {about}");
        let worst = self.values.iter().filter(|(_, d)| !(*d <= self.tolerance));
        let worst = worst
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(face, _)| *face as usize);
        if mesh.dim == 3 {
            let contact: Vec<usize> = self.problem.contact.iter().map(|f| f.face).collect();
            let on_contact = self
                .values
                .iter()
                .filter(|(face, _)| contact.binary_search(&(*face as usize)).is_ok());
            let faces: Vec<(usize, usize)> = on_contact
                .map(|(face, d)| (*face as usize, ramp.step(*d)))
                .collect();
            let surface = Surface::new(mesh, &contact);
            let caption = text!(
                "**The effect.** |{}| on Γ_C from outside, {}",
                &self.name,
                surface.words()
            );
            let worst = worst.filter(|face| contact.contains(face));
            return figure("", caption, [surface.picture(&label, &faces, &[], worst)]);
        }
        let view = window(self.problem, HIGHEST);
        let mut layers = Layers::new("k");
        if self.values.len() <= MOST {
            let at = |v: u32| [0, 1].map(|k| mesh.points[v as usize][k]);
            let centroid = |cell: u32| {
                let of = mesh.cell(cell as usize).iter().map(|v| at(*v));
                of.fold([0.0; 2], |s, p| [s[0] + p[0] / 3.0, s[1] + p[1] / 3.0])
            };
            for (face, difference) in self.values {
                let (ends, [one, other]) =
                    (mesh.face(*face as usize), mesh.face_cells(*face as usize));
                let mut kite = vec![at(ends[0]), centroid(one), at(ends[1])];
                kite.extend((!mesh.is_boundary(*face as usize)).then(|| centroid(other)));
                layers.add(ramp.step(*difference), &view, &kite);
            }
        } else {
            let points = self.values.iter().map(|(face, d)| {
                let [x, y, _] = mesh.face_midpoint(*face as usize);
                ([x, y], ramp.step(*d))
            });
            layers.add_squares(&view, points);
        }
        let mut svg = layers.svg(true) + &outline(self.problem, &view, 2.5) + &corners(&view);
        let worst = worst
            .map(|face| mesh.face_midpoint(face))
            .map(|p| view.pixel([p[0], p[1]]));
        svg += &worst.map_or(String::new(), |at| circle(at, 8.0));
        let caption = text!("**The effect.** |{}| of the face means", &self.name);
        figure(
            "",
            caption,
            [drawing(&label, [WIDTH, view.height + 14.0], &svg)],
        )
    }

    /// Every face by its distance from a place.
    pub fn decay(&self, from: [f64; 3], place: &str, others: &[(u32, f64)]) -> Html {
        let mesh = self.problem.space.mesh;
        let far = |face: u32| {
            let p = mesh.face_midpoint(face as usize);
            (0..3).map(|k| (p[k] - from[k]).powi(2)).sum::<f64>().sqrt()
        };
        let most = self
            .values
            .iter()
            .map(|(face, _)| far(*face))
            .fold(0.0, f64::max)
            .max(f64::MIN_POSITIVE);
        let largest = self
            .values
            .iter()
            .map(|(_, d)| *d)
            .filter(|d| d.is_finite());
        let high = (largest.fold(10.0 * self.tolerance, f64::max).log10() + 0.3)
            .ceil()
            .min(300.0);
        let (left, right, top, bottom) = (44.0, WIDTH - 8.0, 8.0, 292.0);
        let y = |d: f64| {
            let decades = if d > 0.0 {
                d.log10().clamp(-17.0, high)
            } else {
                -17.0
            };
            top + (bottom - top) * (high - decades) / (high + 17.0)
        };
        let x = |r: f64| left + (right - left) * r / most;
        let mut svg = String::new();
        for power in (-16..=high as i32).filter(|p| (p + 16) % 4 == 0) {
            let y = y(10f64.powi(power));
            let _ = write!(svg, "<path class=\"hair\" d=\"M{left} {y:.1}H{right}\"/>");
            svg += &word("t e", [left - 6.0, y + 3.5], &power_of_ten(power));
        }
        let at = y(self.tolerance);
        let _ = write!(
            svg,
            "<path class=\"frame dash\" d=\"M{left} {at:.1}H{right}\"/>"
        );
        svg += &word("t e", [right, at - 4.0], "tolerance");
        let grain = if self.values.len() > MOST { 2.0 } else { 1.0 };
        for (class, values) in [("inkf", others), ("redf", self.values)] {
            let finite = values.iter().filter(|(_, d)| *d > 0.0 && d.is_finite());
            // Of many dots those that touch are one line.
            let seen: BTreeSet<[i64; 2]> = finite
                .map(|(f, d)| [y(*d), x(far(*f))].map(|v| (v / grain).round() as i64))
                .collect();
            let seen: Vec<[i64; 2]> = seen.into_iter().collect();
            let mut path = String::new();
            for run in seen.chunk_by(|a, b| a[0] == b[0] && b[1] == a[1] + 1) {
                let [y, x] = run[0].map(|v| v as f64 * grain);
                let length = (run.len() - 1) as f64 * grain + 1.4;
                let _ = write!(path, "M{x} {y}h{length:.1}v1.4h-{length:.1}z");
            }
            let _ = write!(
                svg,
                "<path class=\"{class}\" opacity=\".55\" d=\"{path}\"/>"
            );
        }
        for r in ticks(most) {
            svg += &word("t m", [x(r), bottom + 17.0], &trimmed(&number(r, 2)));
        }
        let below = if others.is_empty() {
            ""
        } else {
            "; black: the others among themselves"
        };
        let caption = text!(
            "**It falls off with the distance** from {}: every dot a face{}",
            place,
            below
        );
        figure(
            "",
            caption,
            [drawing(
                "differences by distance",
                [WIDTH, bottom + 22.0],
                &svg,
            )],
        )
    }
}
