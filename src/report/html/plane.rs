//! 2D shapes of a picture: one path per colour, in integer units, each point relative to the one before.

use std::fmt::{Display, Write as _};

use super::markup::{Html, escape, figure, raw, visible};
use super::ramp::CLASSES;
use crate::text::number::{number, trimmed};
use crate::text::{Piece, Span, Text};

/// The width of a map in units of its picture.
pub(super) const WIDTH: f64 = 384.0;
/// Widths of a drawing on a wide and on a narrow page.
pub(in crate::report) const WIDEST: f64 = 1090.0;
pub(in crate::report) const NARROWEST: f64 = 358.0;
/// Larger squares hide small features.
const SQUARE: f64 = 4.0;

/// From a window of the plane to a picture; y points up.
#[derive(Clone, Copy)]
pub(super) struct View {
    pub low: [f64; 2],
    pub high: [f64; 2],
    scale: f64,
    left: f64,
    pub height: f64,
}

impl View {
    /// As wide as a map, or as high as is allowed.
    pub fn new(low: [f64; 2], high: [f64; 2], highest: f64) -> Self {
        let extent = [0, 1].map(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let scale = (WIDTH / extent[0]).min(highest / extent[1]);
        View {
            low,
            high,
            scale,
            left: 0.5 * (WIDTH - scale * extent[0]),
            height: scale * extent[1],
        }
    }

    pub fn of(points: impl Iterator<Item = [f64; 2]> + Clone, highest: f64) -> Self {
        let [x, y] = [0, 1].map(|k| ends(points.clone().map(|p| p[k])));
        match x[0] <= x[1] {
            true => View::new([x[0], y[0]], [x[1], y[1]], highest),
            false => View::new([0.0; 2], [1.0; 2], highest),
        }
    }

    /// The bounding box of the points of a mesh.
    pub fn of_points(points: &[[f64; 3]], highest: f64) -> Self {
        View::of(points.iter().map(|p| flat(*p)), highest)
    }

    pub fn pixel(&self, p: [f64; 2]) -> [f64; 2] {
        [
            self.left + (p[0] - self.low[0]) * self.scale,
            (self.high[1] - p[1]) * self.scale,
        ]
    }

    /// Is a shape in the window, at least in part?
    pub fn meets(&self, corners: &[[f64; 2]]) -> bool {
        (0..2).all(|k| {
            let of = || corners.iter().map(|p| p[k]);
            of().any(|x| x >= self.low[k]) && of().any(|x| x <= self.high[k])
        })
    }
}

/// The shapes of each colour.
pub(super) struct Layers {
    paths: Vec<String>,
    class: &'static str,
}

impl Layers {
    pub fn new(class: &'static str) -> Self {
        Layers {
            paths: vec![String::new(); CLASSES],
            class,
        }
    }

    /// A polygon; shapes no larger than a point are left out.
    pub fn add(&mut self, colour: usize, view: &View, corners: &[[f64; 2]]) {
        let Some(path) = self.paths.get_mut(colour) else {
            return;
        };
        let round = |p: &[f64; 2]| view.pixel(*p).map(|x| x.round() as i64);
        let mut points = corners.iter().map(round);
        let Some(first) = points.next() else { return };
        let mut last = first;
        let _ = write!(path, "M{} {}l", first[0], first[1]);
        for (k, point) in points.enumerate() {
            let [x, y] = [point[0] - last[0], point[1] - last[1]];
            // A minus separates two numbers like a space.
            let space = |n: i64| if n < 0 { "" } else { " " };
            let before = if k == 0 { "" } else { space(x) };
            let _ = write!(path, "{before}{x}{}{y}", space(y));
            last = point;
        }
        path.push('z');
    }

    /// Squares in horizontal runs, in the colour of the largest value in each. Values have the order of colours.
    pub fn add_squares(&mut self, view: &View, points: impl Iterator<Item = ([f64; 2], usize)>) {
        let columns = (WIDTH / SQUARE) as usize;
        let rows = (view.height / SQUARE).ceil().max(1.0) as usize;
        let mut squares: Vec<Option<usize>> = vec![None; columns * rows];
        for (point, colour) in points {
            let [x, y] = view.pixel(point);
            let place = |x: f64, most: usize| ((x / SQUARE).max(0.0) as usize).min(most - 1);
            let square = &mut squares[place(y, rows) * columns + place(x, columns)];
            *square = (*square).max(Some(colour));
        }
        for (row, of_row) in squares.chunks(columns).enumerate() {
            let mut from = 0;
            for run in of_row.chunk_by(|a, b| a == b) {
                if let Some(path) = run[0].and_then(|colour| self.paths.get_mut(colour)) {
                    let [x, y, w] = [from, row, run.len()].map(|n| n * SQUARE as usize);
                    let _ = write!(path, "M{x} {y}h{w}v{s}h-{w}z", s = SQUARE);
                }
                from += run.len();
            }
        }
    }

    /// A square for each position where there are points, in the colour of the largest value there, as large as space allows.
    pub fn add_spots(&mut self, view: &View, points: impl Iterator<Item = ([f64; 2], usize)>) {
        let mut seen = std::collections::BTreeMap::new();
        for (point, colour) in points {
            let at = view.pixel(point).map(|x| (x / SQUARE).round() as i64);
            let kept = seen.entry(at).or_insert(colour);
            *kept = (*kept).max(colour);
        }
        // On a lattice they overlap, so that there are no holes between its points.
        let across = ((seen.len() as f64).sqrt() - 1.0).max(1.0);
        let side = (1.7 * (WIDTH * view.height).sqrt() / across)
            .clamp(SQUARE, 48.0)
            .ceil();
        let ends = [WIDTH, view.height];
        for ([x, y], colour) in seen {
            if let Some(path) = self.paths.get_mut(colour) {
                let place = |k: i64, end: f64| {
                    (k as f64 * SQUARE - 0.5 * side)
                        .min(end - side)
                        .max(0.0)
                        .round()
                };
                let [x, y] = [place(x, ends[0]), place(y, ends[1])];
                let _ = write!(path, "M{x} {y}h{side}v{side}h-{side}z");
            }
        }
    }

    /// Polygons if there is space for them, else squares at these points.
    pub fn fill(
        &mut self,
        view: &View,
        has_room: bool,
        shapes: impl Iterator<Item = (Vec<[f64; 2]>, usize)>,
        points: impl Iterator<Item = ([f64; 2], usize)>,
    ) {
        match has_room {
            true => shapes.for_each(|(corners, colour)| self.add(colour, view, &corners)),
            false => self.add_squares(view, points),
        }
    }

    pub fn svg(&self, thin: bool) -> String {
        let paths = self.paths.iter().enumerate();
        let shown = paths.filter(|(_, path)| !path.is_empty());
        let shown: String = shown
            .map(|(k, d)| path(&format!("{}{k}", self.class), d))
            .collect();
        format!(
            "<g class=\"map{}\">{shown}</g>",
            if thin { " thin" } else { "" }
        )
    }
}

/// Sixteen shades over the values of a field: the least is dark, the largest pale.
pub(super) struct Shades {
    pub low: f64,
    pub high: f64,
}

impl Shades {
    const COUNT: f64 = 16.0;

    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values.filter(|value| value.is_finite()));
        Shades { low, high }
    }

    /// Values that are not finite are dark.
    pub fn step(&self, value: f64) -> usize {
        let share = (value - self.low) / (self.high - self.low).max(f64::MIN_POSITIVE);
        match share.is_finite() {
            true => (share * Self::COUNT).clamp(0.0, Self::COUNT - 1.0) as usize,
            false => 0,
        }
    }

    /// The ends, below a map.
    pub fn words(&self, y: f64) -> String {
        let told = |value: f64| trimmed(&number(value, 3));
        word("t", [0.0, y], format!("from {}, dark", told(self.low)))
            + &word("t e", [WIDTH, y], format!("to {}, pale", told(self.high)))
    }
}

/// The least and the largest; if there are no values, the first is above the second.
pub(super) fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.fold(none, |[low, high], v| [low.min(v), high.max(v)])
}

/// From above.
pub(super) fn flat([x, y, _]: [f64; 3]) -> [f64; 2] {
    [x, y]
}

/// The mean of some points.
pub(super) fn mean(points: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len().max(1) as f64)
}

/// Separate lines from point to point.
pub(super) fn segments(view: &View, ends: impl Iterator<Item = [[f64; 2]; 2]>) -> String {
    let mut path = String::new();
    for [p, q] in ends {
        let ([a, b], [c, d]) = (view.pixel(p), view.pixel(q));
        let _ = write!(path, "M{a:.0} {b:.0}L{c:.0} {d:.0}");
    }
    path
}

/// The path of a polygon, which is closed.
pub(super) fn polygon(view: &View, corners: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut path = String::new();
    for p in corners {
        let [x, y] = view.pixel(p);
        let _ = write!(
            path,
            "{}{x:.1} {y:.1}",
            if path.is_empty() { 'M' } else { 'L' }
        );
    }
    path + "z"
}

/// A path of a class.
pub(super) fn path(class: &str, d: impl Display) -> String {
    format!("<path class=\"{class}\" d=\"{d}\"/>")
}

/// The same as a line of this width.
pub(super) fn line(class: &str, width: f64, d: impl Display) -> String {
    format!("<path class=\"{class}\" stroke-width=\"{width}\" d=\"{d}\"/>")
}

/// The tooltip.
pub(super) fn titled(class: &str, d: impl Display, title: &str) -> String {
    format!(
        "<path class=\"{class}\" d=\"{d}\"><title>{}</title></path>",
        escape(title)
    )
}

/// A drawing with the text alternative `label`.
pub(super) fn drawing(label: &str, [width, height]: [f64; 2], inner: &str) -> Html {
    let (label, width, height) = (escape(label), width + 4.0, height + 4.0);
    raw(format!(
        "<svg role=\"img\" aria-label=\"{label}\" viewBox=\"-2 -2 {width:.0} {height:.0}\">{inner}</svg>"
    ))
}

/// A map of this height with its caption.
pub(super) fn map(caption: impl Into<Text>, label: &str, height: f64, inner: &str) -> Html {
    figure("", caption, drawing(label, [WIDTH, height], inner))
}

/// A drawing for a page, with its size as an upper limit, which can also be written to a file.
pub struct Picture {
    label: String,
    size: [f64; 2],
    svg: String,
}

impl Picture {
    pub fn new(label: &str, size: [f64; 2], svg: String) -> Self {
        Picture {
            label: label.to_owned(),
            size: size.map(|side| side.ceil() + 4.0),
            svg,
        }
    }

    pub fn html(&self) -> Html {
        let [width, height] = self.size;
        raw(format!(
            "<svg role=\"img\" aria-label=\"{}\" style=\"max-width:{:.0}px\" viewBox=\"-2 -2 {width} {height}\">{}</svg>",
            escape(&self.label),
            1.16 * width,
            self.svg
        ))
    }

    /// A whole SVG file in the colours of a light page; variables are resolved, since other programs do not support them.
    pub fn file(&self) -> String {
        let [width, height] = self.size;
        let sheet = include_str!("svg.css");
        let mut rules: String = sheet.lines().skip(2).collect();
        let shades = include_str!("ramp.css").lines().nth(1).unwrap_or_default();
        rules += &shades.replace("--c:", "fill:");
        let values = sheet
            .split(['{', ';', '}'])
            .filter_map(|part| part.split_once(':'));
        // The first definition of a name is that of a light page.
        let mut values: Vec<_> = values.filter(|(name, _)| name.starts_with("--")).collect();
        values.reverse();
        let values: std::collections::BTreeMap<_, _> = values.into_iter().collect();
        for (name, value) in &values {
            rules = rules.replace(&format!("var({name})"), value);
        }
        visible(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"-2 -2 {width} {height}\"><style>text{{font-family:Helvetica,Arial,\"Liberation Sans\",sans-serif}}{rules}</style>\
             <path fill=\"{}\" d=\"M-2 -2h{width}v{height}h-{width}z\"/>{}</svg>\n",
            escape(&self.label),
            values.get("--paper").unwrap_or(&"#fff"),
            self.svg
        ))
    }
}

/// A circle around a point, visible on any background.
pub(super) fn circle([x, y]: [f64; 2], radius: f64) -> String {
    let of = |class: &str, width: f64| {
        format!(
            "<circle class=\"{class}\" stroke-width=\"{width}\" cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{radius}\"/>"
        )
    };
    format!(
        "<g class=\"mark\">{}{}</g>",
        of("ring", 5.0),
        of("redl", 1.8)
    )
}

/// A word in a picture, with its classes.
pub(super) fn word(class: &str, [x, y]: [f64; 2], words: impl Into<Text>) -> String {
    let of = |span: &Span| match &span.piece {
        Piece::Words(words) | Piece::Code(words) | Piece::Link(_, words) => escape(words),
        Piece::Number(number) => number.told(),
        Piece::Boundary(part) => format!(
            "Γ<tspan dy=\"2\" font-size=\"8.5\">{}</tspan><tspan dy=\"-2\">\u{200b}</tspan>",
            escape(part.encode_utf8(&mut [0; 4]))
        ),
    };
    let words: String = words.into().spans().iter().map(of).collect();
    format!("<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{words}</text>")
}

/// A position for people: rounding errors of 0, for a window of some extent, are 0.
pub(super) fn position(x: f64, extent: f64) -> String {
    let x = if x.abs() < 1e-9 * extent { 0.0 } else { x };
    trimmed(&number(x, 3))
}

/// Round numbers from 0 on for the labels of an axis, to at most `most`.
pub(super) fn ticks(most: f64) -> Vec<f64> {
    let power = 10f64.powf((most / 4.0).log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0].map(|s| s * power);
    let step = steps.into_iter().find(|s| most / s <= 5.0).unwrap_or(most);
    match step.is_normal() {
        true => (0..=5)
            .map(|k| f64::from(k) * step)
            .filter(|t| *t <= most * (1.0 + 1e-9))
            .collect(),
        false => vec![0.0],
    }
}
