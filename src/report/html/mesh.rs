//! A mesh: its cells, or its outer surface, in the colours of its groups and of its fields.

use std::fmt::Write as _;

use super::markup::html;
use super::plane::{Layers, Shades, View, WIDTH, circle, map, mean, path, polygon, word};
use super::ramp::Ramp;
use super::{Html, in_thirds};
use crate::text::number::whole;
use crate::text::text;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::{Field, Mesh, Support};

/// Pictures of more shapes consist of squares.
const MOST: usize = 8_000;
const HIGHEST: f64 = 360.0;
/// The most groups in the legend, and the most fields that are drawn.
const GROUPS: usize = 16;
const FIELDS: usize = 4;
/// The colours of groups in the order of the style, from the first that differs from the background.
const COLOURS: [usize; 2] = [6, 48];

/// Cells or faces in the picture plane, those in front last.
struct Scene<'a> {
    mesh: &'a Mesh,
    view: View,
    /// The cell behind each shape, and its corners.
    shapes: Vec<(u32, Vec<u32>)>,
    sight: Sight,
}

/// The projection of 3D meshes.
#[derive(Clone, Copy)]
enum Sight {
    /// The mesh is planar, with these axes.
    Along([usize; 2]),
    /// From the side where x, y and z are large.
    Oblique,
}

impl Sight {
    fn flat(self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        match self {
            Sight::Along(axes) => axes.map(|axis| [x, y, z][axis]),
            Sight::Oblique => [(y - x) * 0.75f64.sqrt(), z - 0.5 * (x + y)],
        }
    }
}

impl<'a> Scene<'a> {
    fn new(mesh: &'a Mesh) -> Result<Self> {
        let mut shapes: Vec<(u32, Vec<u32>)> = match mesh.dim() {
            3 => mesh.outline()?,
            dim => {
                let of = mesh.cells().filter(|(_, kind, _)| kind.dim() == dim);
                of.map(|(cell, kind, nodes)| {
                    (cell, nodes[..kind.corners().min(nodes.len())].to_vec())
                })
                .collect()
            }
        };
        let sight = match mesh.plane() {
            Some(across) if mesh.dim() < 3 => Sight::Along([[1, 2], [0, 2], [0, 1]][across]),
            _ => Sight::Oblique,
        };
        let depth = |shape: &(u32, Vec<u32>)| -> f64 {
            let of = shape.1.iter().flat_map(|&k| mesh.points[k as usize]);
            of.sum::<f64>() / shape.1.len().max(1) as f64
        };
        if matches!(sight, Sight::Oblique) {
            shapes.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        }
        let all = shapes.iter().flat_map(|(_, corners)| corners);
        let view = View::of(all.map(|&k| sight.flat(mesh.points[k as usize])), HIGHEST);
        Ok(Scene {
            mesh,
            view,
            shapes,
            sight,
        })
    }

    /// From a point of the mesh to the picture plane.
    fn place(&self, point: u32) -> [f64; 2] {
        self.sight.flat(self.mesh.points[point as usize])
    }

    /// Each shape in its colour.
    fn painted(&self, class: &'static str, colour: impl Fn(u32, &[u32]) -> usize) -> String {
        let corners = |of: &[u32]| of.iter().map(|k| self.place(*k)).collect();
        let shapes = self.shapes.iter();
        let coloured: Vec<(usize, Vec<[f64; 2]>)> = shapes
            .map(|(cell, of)| (colour(*cell, of), corners(of)))
            .collect();
        if coloured.len() > MOST {
            let mut layers = Layers::new(class);
            let points = coloured.iter().map(|(colour, of)| (mean(of), *colour));
            layers.add_squares(&self.view, points);
            return layers.svg(true);
        }
        // Shapes in front come later, whatever their colour.
        let runs = coloured.chunk_by(|a, b| a.0 == b.0).map(|run| {
            let mut layers = Layers::new(class);
            run.iter()
                .for_each(|(colour, of)| layers.add(*colour, &self.view, of));
            layers.svg(true)
        });
        let net = match self.sight {
            Sight::Along(_) => coloured
                .iter()
                .map(|(_, of)| polygon(&self.view, of.iter().copied()))
                .collect(),
            Sight::Oblique => String::new(),
        };
        runs.collect::<String>() + &path("net", net)
    }

    fn words(&self) -> &'static str {
        match (self.sight, self.mesh.dim()) {
            (Sight::Along(_), _) => "cells",
            (_, 3) => "boundary from where x, y and z are large",
            _ => "cells from where x, y and z are large",
        }
    }
}

/// The mesh in the colours of its groups, and its first fields.
///
/// # Errors
/// The command has ended.
pub(in crate::report) fn drawn(mesh: &Mesh) -> Result<Html> {
    let scene = Scene::new(mesh)?;
    if scene.shapes.is_empty() {
        return Ok(Html::default());
    }
    let mut seen: Vec<&str> = Vec::new();
    let fields = mesh.fields.iter().filter(|field| {
        let first = !seen.contains(&&*field.name) && field.on != Support::CellPoints;
        seen.push(&field.name);
        first
    });
    let fields = fields.take(FIELDS).map(|field| of_field(&scene, field));
    let fields = fields.collect::<Vec<_>>();
    Ok(in_thirds([of_groups(&scene)].into_iter().chain(fields)))
}

/// Groups of the shapes' dimension, and the sides of a 2D mesh as lines.
fn of_groups(scene: &Scene<'_>) -> Html {
    let mesh = scene.mesh;
    let dim = mesh.dim();
    let mut colours = vec![0; mesh.cell_count()];
    let groups = mesh.groups.iter();
    let mut groups: Vec<_> = groups
        .filter(|group| group.dim > 0 && group.dim + 1 >= dim)
        .collect();
    // Colours of filled shapes are pale.
    groups.sort_by_key(|group| std::cmp::Reverse(group.dim));
    let colour = |k: usize| COLOURS[0] + k * (COLOURS[1] - COLOURS[0]) / groups.len().max(1);
    for (k, group) in groups.iter().enumerate() {
        group
            .cells
            .iter()
            .for_each(|&cell| colours[cell as usize] = colour(k));
    }
    // A face of a solid has the colour of the cell that marks it, or else of the solid.
    let key = |corners: &[u32]| {
        let mut key = corners.to_vec();
        key.sort_unstable();
        key
    };
    let marks = mesh
        .cells()
        .filter(|(cell, kind, _)| kind.dim() + 1 == dim && colours[*cell as usize] > 0);
    let marks: std::collections::HashMap<Vec<u32>, usize> = marks
        .map(|(cell, kind, nodes)| {
            (
                key(&nodes[..kind.corners().min(nodes.len())]),
                colours[cell as usize],
            )
        })
        .collect();
    let mut svg = scene.painted("k", |cell, corners| match dim {
        3 => marks
            .get(&key(corners))
            .copied()
            .unwrap_or(colours[cell as usize]),
        _ => colours[cell as usize],
    });
    for (k, _) in groups
        .iter()
        .enumerate()
        .filter(|(_, group)| group.dim == 1 && dim == 2)
    {
        let mut lines = String::new();
        for &cell in &groups[k].cells {
            let Some((_, [a, b, ..])) = mesh.cell(cell) else {
                continue;
            };
            let [[a, b], [c, d]] = [a, b].map(|&k| scene.view.pixel(scene.place(k)));
            let _ = write!(lines, "M{a:.1} {b:.1}L{c:.1} {d:.1}");
        }
        let _ = write!(
            svg,
            "<path class=\"k{}\" style=\"stroke:var(--c)\" stroke-width=\"3\" fill=\"none\" d=\"{lines}\"/>",
            colour(k)
        );
    }
    let mut y = scene.view.height + 4.0;
    for (k, group) in groups.iter().enumerate().take(GROUPS) {
        let name = group.name.clone().unwrap_or_else(|| group.tag.to_string());
        let named = format!("{name} ({} cells)", group.cells.len());
        svg += &path(
            &format!("f k{}", colour(k)),
            format_args!("M0 {y:.0}h10v10h-10z"),
        );
        svg += &word("t", [16.0, y + 9.0], named);
        y += 14.0;
    }
    if let Some(more @ 1..) = groups.len().checked_sub(GROUPS) {
        svg += &word("t", [16.0, y + 9.0], format!("and {more} more"));
        y += 14.0;
    }
    let caption = text!("**Groups**, {}", scene.words());
    map(caption, "groups of the mesh", y + 2.0, &svg)
}

/// A field by its value, a vector by its length: that of the cell, or the mean over the corners.
fn of_field(scene: &Scene<'_>, field: &Field) -> Html {
    let values = field.values.to_f64();
    let rows = values.chunks(field.components.max(1)).map(|row| match row {
        [value] => *value,
        row => row.iter().map(|x| x * x).sum::<f64>().sqrt(),
    });
    let rows: Vec<f64> = rows.collect();
    let value = |item: u32| {
        let row = match field.at.is_empty() {
            true => Some(item as usize),
            false => field.at.binary_search(&item).ok(),
        };
        row.and_then(|row| rows.get(row))
            .copied()
            .unwrap_or(f64::NAN)
    };
    let shades = Shades::of(rows.iter().copied());
    let y = scene.view.height + 13.0;
    let svg = scene.painted("g", |cell, corners| {
        shades.step(match field.on {
            Support::Cells => value(cell),
            _ => corners.iter().map(|&k| value(k)).sum::<f64>() / corners.len().max(1) as f64,
        })
    }) + &shades.words(y);
    let what = if field.components > 1 {
        "length of "
    } else {
        ""
    };
    let time = field
        .time
        .map_or(String::new(), |time| format!(", time {time}"));
    let caption = text!("**{what}{field.name}** on {}{time}", field.on.to_string());
    let label = format!("{what}{} on {}", field.name, field.on);
    map(caption, &label, y + 2.0, &svg)
}

/// The mesh with circles around some points.
///
/// # Errors
/// The command has ended.
pub(in crate::report) fn located(mesh: &Mesh, places: &[[f64; 3]]) -> Result<Html> {
    let scene = Scene::new(mesh)?;
    if scene.shapes.is_empty() {
        return Ok(Html::default());
    }
    let mut svg = scene.painted("k", |_, _| 10);
    for place in places {
        svg += &circle(scene.view.pixel(scene.sight.flat(*place)), 8.0);
    }
    let caption = text!(
        "**The worst cells** by each measure, and the first finding of each kind; {}",
        scene.words()
    );
    let picture = map(caption, "the worst cells", scene.view.height, &svg);
    Ok(in_thirds([picture]))
}

/// Rows of linear systems of `what` that differ, as dots on the mesh in the colour of their difference, the largest on top.
///
/// # Errors
/// The command has ended.
pub(in crate::report) fn rows(
    mesh: &Mesh,
    rows: &[([f64; 3], f64)],
    tolerance: f64,
    what: &str,
) -> Result<Html> {
    let scene = Scene::new(mesh)?;
    if scene.shapes.is_empty() || rows.is_empty() {
        return Ok(Html::default());
    }
    let view = &scene.view;
    let ramp = Ramp::over(tolerance, rows.iter().map(|(_, size)| *size));
    let mut dots: Vec<([f64; 2], usize)> = rows
        .iter()
        .map(|(at, size)| (scene.sight.flat(*at), ramp.step(*size)))
        .collect();
    dots.sort_by_key(|(_, colour)| *colour);
    let mut svg = scene.painted("k", |_, _| 2);
    if dots.len() > MOST {
        let mut layers = Layers::new("k");
        layers.add_squares(view, dots.into_iter());
        svg += &layers.svg(true);
    } else {
        let area = WIDTH * view.height;
        let radius = (0.3 * (area / dots.len() as f64).sqrt()).clamp(1.5, 6.0);
        for (at, colour) in dots {
            let [x, y] = view.pixel(at);
            let _ = write!(
                svg,
                "<circle class=\"f k{colour}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\"/>"
            );
        }
    }
    let caption = text!(
        "**Where the systems differ.** {} rows of {what}, each at the place of its dof; {}",
        whole(rows.len()),
        scene.words()
    );
    let label = format!("rows of the systems of {what} that differ");
    let picture = map(caption, &label, view.height, &svg);
    let bar = ramp.bar("Largest difference in a row, over its largest entry or the load");
    Ok(html! { (picture) (bar) })
}
