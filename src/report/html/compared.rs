//! Two files on the mesh of the first: where a field differs, and its values in both.

use super::Html;
use super::in_thirds;
use super::markup::html;
use super::plane::{Layers, Shades, View, circle, flat, map, mean};
use super::ramp::Ramp;
use super::residual::corners;
use super::source::{Triangle, entering};
use crate::text::number::{number, place, size, trimmed, whole};
use crate::text::text;
use faceoff_judge::{ComparedField, Comparison, Differences, On};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::mesh::{CellKind, Shape};

/// Maps of more shapes consist of squares.
const MOST: usize = 12_000;
const HIGHEST: f64 = 384.0;
/// The rounding error of sums of rounded terms.
const ROUNDING: f64 = 1e-12;

/// A field of two files as far as it exists on the mesh of the first.
pub(in crate::report) struct Compared<'a> {
    of: &'a ComparedField,
    a: &'a Results,
    on: On,
    components: usize,
    /// a and b, the largest component of each; `None` where the field is not defined. On cells of other meshes these are means.
    values: Vec<Option<f64>>,
    of_b: Vec<Option<f64>>,
    /// a - b; for functions the largest |a - b| on a cell.
    differences: Vec<f64>,
}

impl<'a> Compared<'a> {
    /// `None` if the field has no position in 2D.
    pub fn new(comparison: &'a Comparison, a: &'a Results, of: &'a ComparedField) -> Option<Self> {
        let a = comparison.found.as_deref().unwrap_or(a);
        let set = comparison.differences.iter().find(|set| set.on == of.on)?;
        let (components, differences) = find(set, &of.field.field)?;
        if a.points.is_empty() {
            return None;
        }
        let compared = |[values, of_b]: [Vec<Option<f64>>; 2], differences| Compared {
            of,
            a,
            on: of.on,
            components,
            values,
            of_b,
            differences,
        };
        let fields = match of.on {
            On::Points => &a.on_points,
            On::Cells => &a.on_cells,
            On::Corners => &a.on_corners,
            On::Functions => {
                let column = |k: usize| differences.iter().skip(k).step_by(components);
                let means = |k: usize| column(k).map(|v| (!v.is_nan()).then_some(*v)).collect();
                return Some(compared([means(1), means(2)], column(0).copied().collect()));
            }
            On::Whole | On::Domain | On::Unread => return None,
        };
        let field = fields.iter().find(|f| f.name == of.field.field)?;
        let differences = largest(differences, components);
        let carried = largest(&field.values, components);
        let values: Vec<Option<f64>> = match &field.at {
            None => carried.into_iter().map(Some).collect(),
            Some(at) => {
                let mut all = vec![None; differences.len()];
                for (k, value) in at.iter().zip(carried) {
                    if let Some(place) = all.get_mut(*k as usize) {
                        *place = Some(value);
                    }
                }
                all
            }
        };
        let both = values.iter().zip(&differences);
        let of_b = both.map(|(a, d)| a.map(|a| a - d)).collect();
        Some(compared([values, of_b], differences))
    }

    fn count(&self) -> usize {
        self.a.kinds.iter().map(|(_, count)| count).sum()
    }

    /// The corners of a cell, their points and the indices of their values; around each corner its part of the cell.
    fn shapes(&self) -> Vec<(usize, Vec<[f64; 2]>)> {
        let place = |p: u32| self.a.points.get(p as usize).map(|p| flat(*p));
        let mut shapes = Vec::new();
        if self.count() == 0 && self.on == On::Points {
            let points = self.a.points.iter().map(|p| vec![flat(*p)]);
            return points.enumerate().collect();
        }
        let (mut cell, mut corner) = (0, 0);
        for &(kind, count) in &self.a.kinds {
            for _ in 0..count {
                let points: Vec<u32> = self.a.cell(cell).collect();
                let corners = kind.corners().min(points.len());
                let places = points[..corners].iter().map(|p| place(*p));
                if let Some(places) = places.collect::<Option<Vec<_>>>() {
                    let value = |k: usize| match self.on {
                        On::Corners => corner + k,
                        _ => points[k] as usize,
                    };
                    match self.on {
                        On::Cells | On::Functions => shapes.push((cell, places)),
                        _ => shapes.extend((0..corners).map(|k| (value(k), part(&places, k)))),
                    }
                }
                corner += kind.points();
                cell += 1;
            }
        }
        shapes
    }

    /// Each shape in its colour; lines are as thick as space allows.
    fn painted(
        &self,
        class: &'static str,
        view: &View,
        colour: impl Fn(usize) -> Option<usize>,
    ) -> String {
        let mut layers = Layers::new(class);
        let shapes = self.shapes();
        let coloured = shapes
            .iter()
            .filter_map(|(k, shape)| Some((shape, colour(*k)?)));
        if self.count() > 0 && self.is_flat() && shapes.len() <= MOST {
            coloured.for_each(|(shape, colour)| layers.add(colour, view, shape));
        } else {
            layers.add_spots(view, coloured.map(|(shape, colour)| (shape[0], colour)));
        }
        let svg = layers.svg(true);
        let is_lines = self.count() > 0 && self.a.kinds.iter().all(|(kind, _)| kind.dim() == 1);
        match is_lines {
            true => {
                let width = (900.0 / (self.count() as f64).sqrt() / 8.0).clamp(1.2, 6.0);
                format!("<g style=\"--w:{width:.1}\" class=\"lines\">{svg}</g>")
            }
            false => svg,
        }
    }

    /// Are all cells in one plane?
    fn is_flat(&self) -> bool {
        self.a.kinds.iter().all(|(kind, _)| kind.dim() <= 2)
            && self.a.points.iter().all(|p| p[2] == self.a.points[0][2])
    }

    /// Where the difference enters; `None` if there are cells other than triangles with a value at each corner.
    fn entering(&self, view: &View) -> Option<Html> {
        let kinds = &self.a.kinds;
        let is_triangle = |kind: CellKind| kind.shape() == Shape::Triangle && kind.points() == 3;
        let has_corners = matches!(self.on, On::Points | On::Corners) && self.components == 1;
        if kinds.is_empty()
            || !kinds.iter().all(|(kind, _)| is_triangle(*kind))
            || !self.is_flat()
            || !has_corners
            || self.of.field.max_abs == 0.0
        {
            return None;
        }
        let value = |k: usize| {
            let difference = *self.differences.get(k)?;
            Some((self.values.get(k).copied().flatten()?, difference))
        };
        let triangles = (0..self.count()).map(|cell| {
            let nodes: Vec<u32> = self.a.cell(cell).take(3).collect();
            let [p, q, r] = *nodes.as_slice() else {
                return None;
            };
            let at = |k: usize| match self.on {
                On::Corners => value(3 * cell + k),
                _ => value(nodes[k] as usize),
            };
            let of = [at(0)?, at(1)?, at(2)?];
            let point = |p: u32| self.a.points.get(p as usize).map(|p| flat(*p));
            Some(Triangle {
                points: [point(p)?, point(q)?, point(r)?],
                a: of.map(|v| v.0),
                difference: of.map(|v| v.1),
            })
        });
        let triangles: Vec<Triangle> = triangles.collect::<Option<_>>()?;
        // Values on cells with separate points may jump.
        let bits = |p: &[f64; 3]| p.map(|x| (x + 0.0).to_bits());
        let mut places: Vec<[u64; 3]> = self.a.points.iter().map(bits).collect();
        places.sort_unstable();
        let is_broken = self.on == On::Corners || places.windows(2).any(|p| p[0] == p[1]);
        let all = entering(&triangles, is_broken);
        let ramp = Ramp::over(ROUNDING, all.iter().map(|(_, enters)| *enters));
        let mut layers = Layers::new("k");
        let coloured = all
            .iter()
            .map(|(shape, enters)| (shape, ramp.step(*enters)));
        match all.len() <= MOST {
            true => coloured.for_each(|(shape, colour)| layers.add(colour, view, shape)),
            false => layers.add_spots(view, coloured.map(|(shape, colour)| (shape[0], colour))),
        }
        let finite = all.iter().filter(|(_, enters)| enters.is_finite());
        let most = finite.max_by(|a, b| a.1.total_cmp(&b.1));
        let mut svg = layers.svg(true);
        let mut at = String::new();
        if let Some((shape, _)) = most {
            let last = if is_broken { shape[2] } else { shape[0] };
            let middle = mean(&[shape[0], last]);
            svg += &circle(view.pixel(middle), 9.0);
            at = format!("; most at {}", place(&middle));
        }
        let by = if is_broken { "face" } else { "vertex" };
        let caption = text!(
            "**−Δ(a − b)** by {by}: where the difference enters, and not where diffusion merely spreads it; warm above {}{at}",
            number(ROUNDING, 2)
        );
        let label = format!("where the difference of {} enters", self.of.field.field);
        Some(map(caption, &label, view.height + 14.0, &svg))
    }

    fn scale(&self) -> f64 {
        let scale = self.of.scale.filter(|s| *s > 0.0 && s.is_finite());
        scale.unwrap_or(1.0)
    }

    fn name(&self) -> String {
        let name = &self.of.field.field;
        let fields = [&self.a.on_points, &self.a.on_corners, &self.a.on_cells];
        let has_components = |f: &ResultField| f.name == *name && f.components > 1;
        match self.on == On::Functions && fields.into_iter().flatten().any(has_components) {
            true => format!("|{name}|"),
            false => name.clone(),
        }
    }

    /// |a - b| relative to the largest value; `None` if neither side has one.
    fn relative(&self, k: usize) -> Option<f64> {
        let has = |values: &[Option<f64>]| values.get(k).is_some_and(Option::is_some);
        let difference = self.differences.get(k).copied().unwrap_or(f64::NAN);
        (has(&self.values) || has(&self.of_b)).then(|| difference.abs() / self.scale())
    }

    /// The number of differences with each colour, over the scale.
    fn histogram(&self, ramp: &Ramp) -> Html {
        let all = (0..self.differences.len()).filter_map(|k| self.relative(k));
        let all: Vec<f64> = all.collect();
        let equal = all.iter().filter(|d| **d == 0.0).count();
        let (of, cells) = match self.on {
            On::Functions => ("the largest |a − b| on each cell", "of cells"),
            _ => ("|a − b|", "of values"),
        };
        let equal = match equal {
            0 => String::new(),
            n if n == all.len() => "; all are equal to the last bit".to_owned(),
            n => format!("; {} more are equal to the last bit", whole(n)),
        };
        let label =
            format!("number {cells} by {of}, relative to the largest value of the field{equal}");
        ramp.counted(&label, &all)
    }

    /// |a - b|, and next to it a and b.
    pub fn figures(&self) -> Html {
        let (name, field) = (&self.name(), &self.of.field);
        let view = View::of_points(&self.a.points, HIGHEST);
        let tolerance = match field.tolerance > 0.0 {
            true => field.tolerance,
            false => f64::EPSILON,
        };
        let ramp = Ramp::new(tolerance, field.max_rel);
        let colour = |k: usize| self.relative(k).map(|relative| ramp.step(relative));
        let mut svg = self.painted("k", &view, colour);
        let worst = field.worst.as_ref().filter(|_| field.max_abs != 0.0);
        if let Some([x, y, ..]) = worst.map(|worst| &worst.midpoint[..]) {
            svg += &circle(view.pixel([*x, *y]), 9.0);
        }
        svg += &corners(&view);
        let of = |x: f64| trimmed(&number(x, 3));
        let (largest, mean) = match self.on {
            On::Functions => (
                ", the largest on each cell of a,",
                ", means on the cells of a",
            ),
            _ => ("", ""),
        };
        let caption = text!(
            "**|a − b| of {name}**{largest} relative to its largest value, {}",
            size(self.scale())
        );
        let label = format!("map of differences of {name}");
        let difference = map(caption, &label, view.height + 13.0, &svg);
        let values = self.values.iter().chain(&self.of_b).flatten();
        let shades = Shades::of(values.copied());
        let side = |letter: &str, values: &[Option<f64>]| {
            let value = |k: usize| values.get(k).copied().flatten();
            let finite = |k: usize| value(k).filter(|v| v.is_finite());
            let svg = self.painted("g", &view, |k| finite(k).map(|v| shades.step(v)));
            let caption = text!(
                "**{name} of {letter}**{mean}, {} dark, {} pale",
                of(shades.low),
                of(shades.high)
            );
            map(caption, &format!("{name} of {letter}"), view.height, &svg)
        };
        let bar = self.histogram(&ramp);
        let [a, b] = [side("a", &self.values), side("b", &self.of_b)];
        if field.verdict.passes() {
            return in_thirds([Html::from([difference, bar]), a, b]);
        }
        let both = html! { .two { (a) (b) } };
        match self.entering(&view) {
            Some(source) => html! { .two { (difference) (source) } (bar) (both) },
            None => html! { .two { (difference) div { (both) (bar) } } },
        }
    }
}

/// The part of a cell around one of its corners.
fn part(places: &[[f64; 2]], k: usize) -> Vec<[f64; 2]> {
    let n = places.len();
    let [before, own, next] = [k + n - 1, k, k + 1].map(|j| places[j % n]);
    vec![own, mean(&[own, next]), mean(places), mean(&[own, before])]
}

/// The component of each value with the largest absolute value.
fn largest(values: &[f64], components: usize) -> Vec<f64> {
    let larger = |m: f64, v: f64| match v.is_nan() || v.abs() > m.abs() {
        true => v,
        false => m,
    };
    let of = values.chunks(components.max(1));
    of.map(|c| c.iter().copied().fold(0.0, larger)).collect()
}

fn find<'a>(set: &'a Differences, name: &str) -> Option<(usize, &'a [f64])> {
    let field = set.fields.iter().find(|(known, ..)| known == name)?;
    Some((field.1, &field.2))
}
