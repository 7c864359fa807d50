//! A field as it is, and what each cell adds to a bound: maps without a tolerance.

use super::Html;
use super::markup::figure;
use super::plane::{Layers, View, WIDTH, drawing, word};
use super::residual::{outline, shapes, window};
use super::surface::{Surface, from_side};
use crate::text::number::{number, size, trimmed};
use crate::text::text;
use faceoff_fem::contact::Problem;
use faceoff_mesh::mesh::Triangulation;

/// Of more shapes a map has squares.
const MOST: usize = 8_000;
const HIGHEST: f64 = 360.0;
/// Shades of a field, the darkest first.
const SHADES: f64 = 16.0;
/// What is smaller by so many powers of ten has no colour of its own.
const DECADES: f64 = 3.0;
/// The colours of what is large, in the order of the style.
const WARM: [f64; 2] = [20.0, 47.0];

/// u, by its value at each dof; in space what is in contact, seen from outside.
pub(in crate::report) fn solution(problem: &Problem, u: &[f64], about: &str) -> Html {
    let mesh = problem.space.mesh;
    let finite = u.iter().filter(|u| u.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), u| {
        (l.min(*u), h.max(*u))
    });
    if mesh.dim == 3 {
        return zones(problem, u, about);
    }
    let shade = |u: f64| match (u - low) / (high - low).max(f64::MIN_POSITIVE) {
        share if share.is_finite() => (share * SHADES).clamp(0.0, SHADES - 1.0) as usize,
        _ => 0,
    };
    let view = window(problem, HIGHEST);
    let mut layers = Layers::new("g");
    if u.len() <= MOST {
        for (row, corners) in shapes(problem) {
            layers.add(shade(u[row]), &view, &corners);
        }
    } else {
        let points = u.iter().enumerate().map(|(row, u)| {
            let [x, y, _] = problem.space.point(row);
            ([x, y], shade(*u))
        });
        layers.add_squares(&view, points);
    }
    let y = view.height + 13.0;
    let told = |value: f64| trimmed(&number(value, 3));
    let svg = layers.svg(true)
        + &outline(problem, &view, 2.5)
        + &word("t", [0.0, y], format!("from {}, dark", told(low)))
        + &word("t e", [WIDTH, y], format!("to {}, pale", told(high)));
    figure(
        "",
        text!("**u**, {}", about),
        [drawing(&format!("u, {about}"), [WIDTH, y + 2.0], &svg)],
    )
}

fn zones(problem: &Problem, u: &[f64], about: &str) -> Html {
    let all: Vec<usize> = problem.contact.iter().map(|f| f.face).collect();
    if all.is_empty() {
        return Html::default();
    }
    let in_contact = |face: &faceoff_fem::contact::ContactFace| {
        let local = problem.space.local(face.cell, u);
        let points = face
            .points
            .iter()
            .filter(|p| !(p.trace(face.gamma, &local).p > 0.0));
        points.count() as f64 / face.points.len().max(1) as f64
    };
    // Cold to the tolerance: what is wholly in contact is darkest.
    let faces = problem
        .contact
        .iter()
        .map(|f| (f.face, (in_contact(f) * (WARM[0] - 1.0)) as usize));
    let faces: Vec<(usize, usize)> = faces.collect();
    let surface = Surface::new(problem.space.mesh, &all);
    let caption = text!(
        "**Γ_C from outside**, {}: dark where in contact; {}",
        surface.words(),
        about
    );
    let label = format!("contact status on Γ_C, {about}");
    figure("", caption, [surface.picture(&label, &faces, &[], None)])
}

/// Cells by the root of what each adds, the larger the darker; `squares` are what they add.
pub(in crate::report) fn cells(mesh: &Triangulation, squares: &[f64], about: &str) -> Html {
    let most = squares.iter().fold(0.0, |most: f64, part| most.max(*part));
    let colour = |part: f64| {
        let decades = -0.5 * (part / most).log10() / DECADES;
        match decades.is_finite() {
            true => (WARM[1] - decades.clamp(0.0, 1.0) * (WARM[1] - WARM[0])) as usize,
            false => 0,
        }
    };
    let picture = if mesh.dim == 3 {
        let centroid = |cell: usize| {
            let of = mesh.vertices(cell);
            std::array::from_fn(|k| of.iter().map(|x| x[k]).sum::<f64>() / 4.0)
        };
        let points = squares
            .iter()
            .enumerate()
            .map(|(cell, part)| (centroid(cell), colour(*part)));
        from_side(about, mesh, &points.collect::<Vec<_>>())
    } else {
        let view = View::of(mesh.points.iter().map(|p| [p[0], p[1]]), HIGHEST);
        let mut layers = Layers::new("k");
        let corners = |cell: usize| {
            mesh.vertices(cell)[..3]
                .iter()
                .map(|p| [p[0], p[1]])
                .collect::<Vec<_>>()
        };
        if squares.len() <= MOST {
            for (cell, part) in squares.iter().enumerate() {
                layers.add(colour(*part), &view, &corners(cell));
            }
        } else {
            let points = squares.iter().enumerate().map(|(cell, part)| {
                let sum = corners(cell)
                    .into_iter()
                    .fold([0.0; 2], |s, p| [s[0] + p[0] / 3.0, s[1] + p[1] / 3.0]);
                (sum, colour(*part))
            });
            layers.add_squares(&view, points);
        }
        drawing(about, [WIDTH, view.height], &layers.svg(true))
    };
    let caption = text!(
        "**What each cell adds to the bound**: the darker, the more, over three powers of ten down from {}; refining there pays most",
        size(most.sqrt())
    );
    figure("", caption, [picture])
}
