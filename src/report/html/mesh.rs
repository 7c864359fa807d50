//! A mesh as it is: its cells, or what is seen of it from outside, in the colours of its groups and of its fields.

use std::fmt::Write as _;

use super::markup::figure;
use super::plane::{Layers, View, WIDTH, circle, drawing, word};
use super::{Html, in_thirds};
use crate::text::number::{number, trimmed};
use crate::text::text;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::{Field, Mesh, Support};

/// Of more shapes a picture has squares.
const MOST: usize = 8_000;
const HIGHEST: f64 = 360.0;
/// Groups in the legend, and fields that are drawn.
const GROUPS: usize = 16;
const FIELDS: usize = 4;
/// The colours of groups in the order of the style, from one that differs from the ground on.
const COLOURS: [usize; 2] = [6, 48];
/// Shades of a field, the darkest first.
const SHADES: f64 = 16.0;

/// Cells or faces in a plane, those that hide others last.
struct Scene<'a> {
    mesh: &'a Mesh,
    view: View,
    /// The cell behind each shape, and its corners.
    shapes: Vec<(u32, Vec<u32>)>,
    sight: Sight,
}

/// How space is seen.
#[derive(Clone, Copy)]
enum Sight {
    /// The mesh lies in a plane, whose axes these are.
    Along([usize; 2]),
    /// From where x, y and z are large.
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

    /// Each shape in its colour.
    fn painted(&self, class: &'static str, colour: impl Fn(u32, &[u32]) -> usize) -> String {
        let corners = |of: &[u32]| -> Vec<[f64; 2]> {
            of.iter()
                .map(|&k| self.sight.flat(self.mesh.points[k as usize]))
                .collect()
        };
        let coloured = self
            .shapes
            .iter()
            .map(|(cell, of)| (colour(*cell, of), corners(of)));
        let coloured: Vec<(usize, Vec<[f64; 2]>)> = coloured.collect();
        if coloured.len() > MOST {
            let mut layers = Layers::new(class);
            let points = coloured.iter().map(|(colour, of)| {
                let sum = of.iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
                (sum.map(|x| x / of.len().max(1) as f64), *colour)
            });
            layers.add_squares(&self.view, points);
            return layers.svg(true);
        }
        // What lies in front comes later, whatever its colour.
        let mut svg = String::new();
        let mut net = String::new();
        for run in coloured.chunk_by(|a, b| a.0 == b.0) {
            let mut layers = Layers::new(class);
            run.iter()
                .for_each(|(colour, of)| layers.add(*colour, &self.view, of));
            svg += &layers.svg(true);
        }
        if matches!(self.sight, Sight::Along(_)) {
            for (_, of) in &coloured {
                for (k, p) in of.iter().enumerate() {
                    let [x, y] = self.view.pixel(*p);
                    let _ = write!(net, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
                }
                net.push('z');
            }
        }
        svg + &format!("<path class=\"net\" d=\"{net}\"/>")
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

/// Groups of the shapes' dimension, and the sides of a plane mesh as lines.
fn of_groups(scene: &Scene<'_>) -> Html {
    let mesh = scene.mesh;
    let dim = mesh.dim();
    let mut colours = vec![0; mesh.cell_count()];
    let groups = mesh.groups.iter();
    let mut groups: Vec<_> = groups
        .filter(|group| group.dim > 0 && group.dim + 1 >= dim)
        .collect();
    // What fills the picture is pale.
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
        let mut path = String::new();
        for &cell in &groups[k].cells {
            let Some((_, [a, b, ..])) = mesh.cell(cell) else {
                continue;
            };
            let [[a, b], [c, d]] =
                [a, b].map(|&k| scene.view.pixel(scene.sight.flat(mesh.points[k as usize])));
            let _ = write!(path, "M{a:.1} {b:.1}L{c:.1} {d:.1}");
        }
        let _ = write!(
            svg,
            "<path class=\"k{}\" style=\"stroke:var(--c)\" stroke-width=\"3\" fill=\"none\" d=\"{path}\"/>",
            colour(k)
        );
    }
    let mut y = scene.view.height + 4.0;
    for (k, group) in groups.iter().enumerate().take(GROUPS) {
        let name = group.name.clone().unwrap_or_else(|| group.tag.to_string());
        let _ = write!(
            svg,
            "<path class=\"f k{}\" d=\"M0 {y:.0}h10v10h-10z\"/>",
            colour(k)
        );
        svg += &word(
            "t",
            [16.0, y + 9.0],
            format!("{name} ({} cells)", group.cells.len()),
        );
        y += 14.0;
    }
    if groups.len() > GROUPS {
        svg += &word(
            "t",
            [16.0, y + 9.0],
            format!("and {} more", groups.len() - GROUPS),
        );
        y += 14.0;
    }
    let caption = text!("**Groups**, {}", scene.words());
    figure(
        "",
        caption,
        [drawing("groups of the mesh", [WIDTH, y + 2.0], &svg)],
    )
}

/// A field by its value, a vector by its length: of the cell, or in the mean of the corners.
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
    let finite = rows.iter().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(*v), h.max(*v))
    });
    let svg = scene.painted("g", |cell, corners| {
        let value = match field.on {
            Support::Cells => value(cell),
            _ => corners.iter().map(|&k| value(k)).sum::<f64>() / corners.len().max(1) as f64,
        };
        match (value - low) / (high - low).max(f64::MIN_POSITIVE) {
            share if share.is_finite() => (share * SHADES).clamp(0.0, SHADES - 1.0) as usize,
            _ => 0,
        }
    });
    let y = scene.view.height + 13.0;
    let told = |value: f64| trimmed(&number(value, 3));
    let svg = svg
        + &word("t", [0.0, y], format!("from {}, dark", told(low)))
        + &word("t e", [WIDTH, y], format!("to {}, pale", told(high)));
    let what = if field.components > 1 {
        "length of "
    } else {
        ""
    };
    let time = field
        .time
        .map_or(String::new(), |time| format!(", time {time}"));
    let caption = text!(
        "**{}{}** on {}{}",
        what,
        &field.name,
        field.on.to_string(),
        time
    );
    let label = format!("{what}{} on {}", field.name, field.on);
    figure("", caption, [drawing(&label, [WIDTH, y + 2.0], &svg)])
}

/// The mesh with circles around some places.
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
    let picture = drawing("the worst cells", [WIDTH, scene.view.height], &svg);
    Ok(in_thirds([figure("", caption, [picture])].into_iter()))
}
