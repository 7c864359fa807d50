//! A field, and the contribution of each cell to a bound: maps without a tolerance.

use super::Html;
use super::markup::figure;
use super::plane::{Layers, Shades, View, WIDTH, drawing, flat, map};
use super::residual::{centroid, outline, shapes};
use super::surface::{Surface, from_side};
use crate::text::number::size;
use crate::text::text;
use faceoff_fem::contact::Problem;
use faceoff_mesh::mesh::Triangulation;

/// Maps of more shapes consist of squares.
const MOST: usize = 8_000;
const HIGHEST: f64 = 360.0;
/// Values smaller by this number of powers of ten have no separate colour.
const DECADES: f64 = 3.0;
/// The colours of large values, in the order of the style.
const WARM: [f64; 2] = [20.0, 47.0];

/// u, by its value at each dof; in 3D the contact zones, seen from outside.
pub(in crate::report) fn solution(problem: &Problem, u: &[f64], about: &str) -> Html {
    let mesh = problem.space.mesh;
    if mesh.dim == 3 {
        return zones(problem, u, about);
    }
    let shades = Shades::of(u.iter().copied());
    let view = View::of_points(&mesh.points, HIGHEST);
    let mut layers = Layers::new("g");
    let has_room = u.len() <= MOST;
    let kites = if has_room {
        shapes(problem)
    } else {
        Vec::new()
    };
    let kites = kites.into_iter();
    layers.fill(
        &view,
        has_room,
        kites.map(|(row, corners)| (corners, shades.step(u[row]))),
        (0..u.len()).map(|row| (flat(problem.space.point(row)), shades.step(u[row]))),
    );
    let y = view.height + 13.0;
    let svg = layers.svg(true) + &outline(problem, &view, 2.5) + &shades.words(y);
    map(
        text!("**u**, {about}"),
        &format!("u, {about}"),
        y + 2.0,
        &svg,
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
    // Cold up to the tolerance: faces fully in contact are darkest.
    let faces = problem
        .contact
        .iter()
        .map(|f| (f.face, (in_contact(f) * (WARM[0] - 1.0)) as usize));
    let faces: Vec<(usize, usize)> = faces.collect();
    let surface = Surface::new(problem.space.mesh, &all);
    let caption = text!(
        "**Γ_C from outside**, {}: dark where in contact; {about}",
        surface.words()
    );
    let label = format!("contact status on Γ_C, {about}");
    figure("", caption, surface.picture(&label, &faces, &[], None))
}

/// Cells by the root of their contributions, the larger the darker; `squares` are the contributions.
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
        let cells = squares.iter().enumerate();
        let spots = cells.map(|(cell, part)| (centroid(cell), colour(*part)));
        from_side(about, mesh, spots)
    } else {
        let view = View::of_points(&mesh.points, HIGHEST);
        let mut layers = Layers::new("k");
        let cells = || squares.iter().map(|part| colour(*part)).enumerate();
        let corners = |cell: usize| mesh.vertices(cell)[..3].iter().map(|p| flat(*p)).collect();
        layers.fill(
            &view,
            squares.len() <= MOST,
            cells().map(|(cell, colour)| (corners(cell), colour)),
            cells().map(|(cell, colour)| (centroid(mesh, cell), colour)),
        );
        drawing(about, [WIDTH, view.height], &layers.svg(true))
    };
    let caption = text!(
        "**What each cell adds to the bound**: the darker, the more, over three powers of ten down from {}; refining there pays most",
        size(most.sqrt())
    );
    figure("", caption, picture)
}
