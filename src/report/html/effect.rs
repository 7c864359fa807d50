//! A difference over the whole mesh, and its decay with the distance.

use super::Html;
use super::chart::{Axis, Chart, Cloud, charts};
use super::markup::figure;
use super::panels::LEAST;
use super::plane::{Layers, View, WIDTH, circle, flat, map, ticks};
use super::ramp::Ramp;
use super::residual::{corners, kite, outline};
use super::surface::Surface;
use crate::text::number::{number, trimmed};
use crate::text::text;
use faceoff_fem::contact::Problem;

/// Maps of more faces consist of squares.
const MOST: usize = 5_000;
const HIGHEST: f64 = 310.0;

/// Differences of a field on faces, in units of their tolerance for the colours.
pub(in crate::report) struct Effect<'a> {
    pub problem: &'a Problem<'a>,
    pub values: &'a [(u32, f64)],
    pub tolerance: f64,
    pub name: &'a str,
}

impl Effect<'_> {
    /// The map; in 3D that of Γ_C.
    pub fn map(&self, about: &str) -> Html {
        let mesh = self.problem.space.mesh;
        let ramp = Ramp::over(self.tolerance, self.values.iter().map(|(_, d)| *d));
        let label = format!("map of differences, {about}");
        let colours = self.values.iter();
        let colours = colours.map(|(face, d)| (*face as usize, ramp.step(*d)));
        let worst = self.values.iter().filter(|(_, d)| !(*d <= self.tolerance));
        let worst = worst.max_by(|a, b| a.1.total_cmp(&b.1));
        let worst = worst.map(|(face, _)| *face as usize);
        if mesh.dim == 3 {
            let contact: Vec<usize> = self.problem.contact.iter().map(|f| f.face).collect();
            let faces: Vec<(usize, usize)> = colours
                .filter(|(face, _)| contact.binary_search(face).is_ok())
                .collect();
            let surface = Surface::new(mesh, &contact);
            let caption = text!(
                "**The effect.** |{self.name}| on Γ_C from outside, {}",
                surface.words()
            );
            let worst = worst.filter(|face| contact.contains(face));
            return figure("", caption, surface.picture(&label, &faces, &[], worst));
        }
        let view = View::of_points(&mesh.points, HIGHEST);
        let mut layers = Layers::new("k");
        layers.fill(
            &view,
            self.values.len() <= MOST,
            colours
                .clone()
                .map(|(face, colour)| (kite(mesh, face, 0.0), colour)),
            colours.map(|(face, colour)| (flat(mesh.face_midpoint(face)), colour)),
        );
        let mut svg = layers.svg(true) + &outline(self.problem, &view, 2.5) + &corners(&view);
        if let Some(face) = worst {
            svg += &circle(view.pixel(flat(mesh.face_midpoint(face))), 8.0);
        }
        let caption = text!("**The effect.** |{self.name}| of the face means");
        map(caption, &label, view.height + 14.0, &svg)
    }

    /// Every face by its distance from a point.
    pub fn decay(&self, from: [f64; 3], place: &str, others: &[(u32, f64)]) -> Html {
        let mesh = self.problem.space.mesh;
        let far = |face: u32| {
            let p = mesh.face_midpoint(face as usize);
            (0..3).map(|k| (p[k] - from[k]).powi(2)).sum::<f64>().sqrt()
        };
        let most = self.values.iter().map(|(face, _)| far(*face));
        let most = most.fold(f64::MIN_POSITIVE, f64::max);
        let cloud = |fill, values: &[(u32, f64)]| {
            let finite = values.iter().filter(|(_, d)| *d > 0.0 && d.is_finite());
            let at = |(face, d): &(u32, f64)| [far(*face), d.max(LEAST)];
            let points = finite.map(at).collect();
            let side = 1.4;
            Cloud { fill, side, points }
        };
        let label = |r: f64| (r, trimmed(&number(r, 2)));
        let chart = Chart {
            x: Axis::linear("distance", ticks(most).into_iter().map(label)),
            y: Axis::new("difference"),
            clouds: vec![cloud("inkf", others), cloud("redf", self.values)],
            levels: vec![(self.tolerance, "tolerance")],
            ..Chart::default()
        };
        let below = if others.is_empty() {
            ""
        } else {
            "; black: the others among themselves"
        };
        let caption =
            text!("**It falls off with the distance** from {place}: every dot a face{below}");
        let picture = charts("differences by distance", &[chart], WIDTH);
        figure("", caption, picture.html())
    }
}
