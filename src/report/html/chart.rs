//! Charts of errors over meshes, times or parameters: each is described once and drawn for the widths of its page.

mod scale;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::Html;
use super::markup::{escape, figures};
use super::plane::{NARROWEST, Picture, ends, line as stroked, path, titled, word};
use crate::engine::unique;
use crate::text::Text;
pub(in crate::report) use scale::Axis;
use scale::Scale;
#[cfg(test)]
use scale::decades;

/// The classes of a line and of its filled marks; red marks faults.
pub(in crate::report) const COLOURS: [[&str; 2]; 5] = [
    ["ink", "inkf"],
    ["goodl", "goodf"],
    ["warml", "warmf"],
    ["otherl", "otherf"],
    ["pluml", "plumf"],
];
pub(super) const RED: [&str; 2] = ["redl", "redf"];

/// Corners of marks; the first is a circle.
const MARKS: [&[[f64; 2]]; 8] = [
    &[],
    &[[-3.4, -3.4], [3.4, -3.4], [3.4, 3.4], [-3.4, 3.4]],
    &[[0.0, -4.6], [4.3, 3.2], [-4.3, 3.2]],
    &[[0.0, -4.8], [4.8, 0.0], [0.0, 4.8], [-4.8, 0.0]],
    &[[0.0, 4.6], [4.3, -3.2], [-4.3, -3.2]],
    &[[4.6, 0.0], [-3.2, 4.3], [-3.2, -4.3]],
    &[[-4.6, 0.0], [3.2, 4.3], [3.2, -4.3]],
    &[[-1.7, -4.6], [1.7, -4.6], [1.7, 4.6], [-1.7, 4.6]],
];

const LEFT: f64 = 50.0;
/// Margins above and below a panel.
const HEAD: f64 = 22.0;
const FOOT: f64 = 38.0;
const GAP: f64 = 24.0;
/// A panel narrower than this is placed below the one before.
const NARROW: f64 = 320.0;
/// The height of a line of text, and the mean width of its letters.
const LINE: f64 = 13.0;
const LETTER: f64 = 6.1;
/// More dots than these are drawn on a coarser grid.
const FINE: usize = 5_000;
/// The number of positions that are tried for a label, half a line apart.
const SHIFTS: i32 = 15;

/// A chart of lines over two axes, which are logarithmic by default.
#[derive(Default)]
pub(in crate::report) struct Chart {
    /// The title.
    pub name: String,
    pub x: Axis,
    pub y: Axis,
    pub lines: Vec<Line>,
    /// Dots too many for separate marks, below all lines.
    pub clouds: Vec<Cloud>,
    /// Dotted: the first of several slopes above all points, the last below.
    pub slopes: Vec<Slope>,
    /// Dotted: the Pareto front, by ascending x.
    pub front: Vec<[f64; 2]>,
    /// Dashed horizontal lines, with their names.
    pub levels: Vec<(f64, &'static str)>,
    /// Grey vertical bands: ranges of x.
    pub shades: Vec<[f64; 2]>,
    /// Dashed vertical lines for missing parts, with their descriptions.
    pub gaps: Vec<(f64, String)>,
}

#[derive(Default)]
pub(in crate::report) struct Line {
    /// The name that its colour identifies, and the one that its mark identifies; one of them may be empty.
    pub names: [String; 2],
    /// The text of its label after the names.
    pub about: String,
    pub colour: [&'static str; 2],
    pub mark: usize,
    pub is_dashed: bool,
    /// Without marks.
    pub is_bare: bool,
    /// 1 unless lines may overlap; 0: marks only.
    pub thickness: f64,
    pub points: Vec<Point>,
}

/// Dots of one class.
#[derive(Default)]
pub(in crate::report) struct Cloud {
    pub fill: &'static str,
    /// The size of a dot.
    pub side: f64,
    pub points: Vec<[f64; 2]>,
}

#[derive(Default)]
pub(in crate::report) struct Point {
    pub at: [f64; 2],
    /// The least and the largest x.
    pub spread: Option<[f64; 2]>,
    pub is_hollow: bool,
    /// Is it red, and marked in any case?
    pub is_bad: bool,
    /// Is it separate from the point before?
    pub is_apart: bool,
    /// The tooltip.
    pub title: String,
}

/// y as a power of x.
pub(in crate::report) struct Slope {
    pub power: f64,
    pub name: String,
}

impl Point {
    pub fn new(at: [f64; 2]) -> Self {
        Point {
            at,
            ..Point::default()
        }
    }
}

impl Line {
    /// A line with this name, whose colour and mark follow from its index.
    pub fn new(name: &str, place: usize, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Line {
            names: [String::new(), name.to_owned()],
            colour: COLOURS[place % COLOURS.len()],
            mark: place,
            thickness: 1.0,
            points: points.into_iter().map(Point::new).collect(),
            ..Line::default()
        }
    }

    fn label(&self) -> String {
        let words = [&*self.names[0], &*self.names[1], &*self.about];
        let words: Vec<&str> = words.into_iter().filter(|w| !w.is_empty()).collect();
        words.join(" ")
    }
}

impl Cloud {
    /// Dots in a dense set that touch are merged to one line.
    fn svg(&self, x: &Scale, y: &Scale) -> String {
        let grain = if self.points.len() > FINE { 2.0 } else { 1.0 };
        let place =
            |[a, b]: &[f64; 2]| [y.inside(*b), x.inside(*a)].map(|at| (at / grain).round() as i64);
        let seen: BTreeSet<[i64; 2]> = self.points.iter().map(place).collect();
        let seen: Vec<[i64; 2]> = seen.into_iter().collect();
        let mut dots = String::new();
        for run in seen.chunk_by(|a, b| a[0] == b[0] && b[1] == a[1] + 1) {
            let side = self.side;
            let [y, x] = run[0].map(|at| at as f64 * grain - 0.5 * side);
            let length = (run.len() - 1) as f64 * grain + side;
            let _ = write!(dots, "M{x:.1} {y:.1}h{length:.1}v{side}h-{length:.1}z");
        }
        path(&format!("{} pale", self.fill), dots)
    }
}

/// Left, top, right and bottom.
type Place = [f64; 4];

fn meets(a: &Place, b: &Place) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn wide(text: &str) -> f64 {
    LETTER * text.chars().count() as f64
}

/// The label of a line: its position, and that of the end of the line.
struct Label {
    line: usize,
    at: [f64; 2],
    end: [f64; 2],
}

impl Chart {
    /// Are there no lines to draw?
    pub fn is_empty(&self) -> bool {
        let shown = |p: &&Point| self.x.shows(p.at[0]) && self.y.shows(p.at[1]);
        let points = self.lines.iter().flat_map(|line| &line.points);
        let mut xs: Vec<f64> = points.filter(shown).map(|p| p.at[0]).collect();
        xs.sort_by(f64::total_cmp);
        xs.dedup();
        xs.len() < 2
    }

    /// A panel: with a label at each line, or none if there is no space for them; without labels on request.
    fn draw(
        &self,
        [left, top]: [f64; 2],
        width: f64,
        height: f64,
        is_named: bool,
    ) -> Option<String> {
        let shown = |p: &&Point| self.x.shows(p.at[0]) && self.y.shows(p.at[1]);
        let points = || {
            self.lines
                .iter()
                .flat_map(|l| l.points.iter().filter(shown))
        };
        let xs = points().flat_map(|p| p.spread.unwrap_or([p.at[0]; 2]));
        let xs = xs.chain(self.gaps.iter().map(|gap| gap.0));
        let clouds = || self.clouds.iter().flat_map(|of| &of.points);
        let xs = xs.chain(clouds().map(|p| p[0]));
        let xs: Vec<f64> = xs.chain(self.front.iter().map(|p| p[0])).collect();
        let slopes = self.slopes(points().map(|p| p.at).collect(), &xs);
        let ys = points().map(|p| p.at[1]);
        let ys = ys.chain(self.front.iter().map(|p| p[1]));
        let ys = ys.chain(slopes.iter().flat_map(|s| s.1.map(|p| p[1])));
        let ys = ys.chain(self.levels.iter().map(|(at, _)| *at));
        let ys = ys.chain(clouds().map(|p| p[1]));
        let widest = self.lines.iter().map(|line| wide(&line.label()));
        let room = match is_named {
            true => (widest.fold(0.0, f64::max) + 12.0).min(0.36 * width),
            false => 6.0,
        };
        let frame = [
            left + LEFT,
            top + HEAD,
            left + width - room,
            top + height - FOOT,
        ];
        let mut svg = format!(
            "<text class=\"t b\" x=\"{left:.1}\" y=\"{:.1}\">{}<tspan class=\"q\">{}{}</tspan></text>",
            top + 11.0,
            escape(&self.name),
            if self.name.is_empty() { "" } else { "\u{2002}" },
            escape(&self.y.name)
        );
        let y = Scale::new(&self.y, ys, [frame[3], frame[1]]);
        let x = Scale::new(&self.x, xs.into_iter(), [frame[0], frame[2]]);
        let (Some(x), Some(y)) = (x, y) else {
            svg += &word("t", [left, top + HEAD + LINE], "No error is above zero.");
            return Some(svg);
        };
        svg += &self.ground(&x, &y, frame);
        svg.extend(self.clouds.iter().map(|cloud| cloud.svg(&x, &y)));
        let mut taken = Vec::new();
        for (k, (slope, ends)) in slopes.iter().enumerate() {
            let [from, to] = ends.map(|p| [x.at(p[0]), y.at(p[1])]);
            svg += &straight("frame dots", from, to);
            let shift = if k + 1 < slopes.len() { -6.0 } else { 14.0 };
            let at = [
                from[0],
                (from[1] + shift).clamp(frame[1] + 10.0, frame[3] - 3.0),
            ];
            taken.push([at[0], at[1] - LINE, at[0] + wide(&slope.name), at[1]]);
            svg += &word("t halo", at, &slope.name);
        }
        let paths = self.paths(&x, &y, &mut svg);
        if is_named {
            let limits = [frame[0], frame[1] - 6.0, left + width, frame[3]];
            let labels = self.labels(&paths, &mut taken, limits)?;
            svg += &self.named(&labels);
        }
        Some(svg)
    }

    /// A low panel in a frame, one of several that share the x axis; without text below.
    pub fn strip(mut self, frame: Place, ends: [f64; 2], is_named: bool) -> String {
        // Positions may have either sign.
        self.x.is_linear = true;
        let x = Scale {
            ends,
            places: [frame[0], frame[2]],
            is_linear: true,
        };
        let lines = self.lines.iter().flat_map(|line| &line.points);
        let ys = lines
            .map(|p| p.at[1])
            .chain(self.levels.iter().map(|l| l.0));
        let ys = ys.chain(self.clouds.iter().flat_map(|of| &of.points).map(|p| p[1]));
        let Some(y) = Scale::new(&self.y, ys, [frame[3], frame[1]]) else {
            return String::new();
        };
        let mut svg = self.ground(&x, &y, frame);
        svg.extend(self.clouds.iter().map(|cloud| cloud.svg(&x, &y)));
        let paths = self.paths(&x, &y, &mut svg);
        let limits = [frame[0], frame[1] - 6.0, f64::INFINITY, frame[3] + 14.0];
        let labels = self.labels(&paths, &mut Vec::new(), limits);
        match labels.filter(|_| is_named) {
            Some(labels) => svg + &self.named(&labels),
            None => svg,
        }
    }

    /// Each slope with the ends of its line, away from all points.
    fn slopes(&self, points: Vec<[f64; 2]>, xs: &[f64]) -> Vec<(&Slope, [[f64; 2]; 2])> {
        let [low, high] = ends(xs.iter().copied());
        let of = |(k, slope): (usize, &Slope)| {
            let factors = points.iter().map(|[x, y]| y / x.powf(slope.power));
            let factor = match k + 1 < self.slopes.len() {
                true => 1.8 * factors.fold(0.0, f64::max),
                false => 0.5 * factors.fold(f64::INFINITY, f64::min),
            };
            [low, high].map(|x| [x, factor * x.powf(slope.power)])
        };
        let all = self.slopes.iter().enumerate();
        all.map(|(k, slope)| (slope, of((k, slope)))).collect()
    }

    /// Axes, the front and the horizontal lines.
    fn ground(&self, x: &Scale, y: &Scale, [left, top, right, bottom]: Place) -> String {
        let mut svg = String::new();
        for ends in &self.shades {
            let [from, to] = ends.map(|end| x.at(end));
            let d = format_args!("M{from:.1} {top:.1}H{to:.1}V{bottom:.1}H{from:.1}z");
            svg += &path("holdf pale", d);
        }
        // No label touches the one above.
        let ticks = self.y.ticks(y);
        let places: Vec<f64> = ticks.iter().map(|tick| y.at(tick.0)).collect();
        let is_free = |every: &usize| {
            let places: Vec<&f64> = places.iter().step_by(*every).collect();
            places
                .windows(2)
                .all(|pair| (pair[0] - pair[1]).abs() >= 0.9 * LINE)
        };
        let every = (1..=ticks.len().max(1)).find(is_free).unwrap_or(1);
        for (value, label) in ticks.into_iter().step_by(every) {
            let at = y.at(value);
            svg += &path("hair", format_args!("M{left:.1} {at:.1}H{right:.1}"));
            if !label.is_empty() {
                svg += &word("t e", [left - 6.0, at + 3.5], &label);
            }
        }
        let ticks = self.x.ticks(x);
        // No label touches the next.
        let fit = |every: &usize| {
            let places = ticks.iter().step_by(*every);
            let ends: Vec<[f64; 2]> = places
                .map(|(v, label)| [-0.5, 0.5].map(|s| x.at(*v) + s * (wide(label) + 6.0)))
                .collect();
            ends.windows(2).all(|pair| pair[0][1] <= pair[1][0])
        };
        let every = (1..=ticks.len().max(1)).find(fit).unwrap_or(1);
        for (value, label) in ticks.iter().step_by(every) {
            let at = x.at(*value);
            svg += &path("hair", format_args!("M{at:.1} {top:.1}V{bottom:.1}"));
            svg += &word("t m", [at, bottom + 15.0], label);
        }
        if !self.x.name.is_empty() {
            svg += &word("t e", [right, bottom + 30.0], &self.x.name);
        }
        for (value, name) in self.levels.iter().filter(|l| y.at(l.0) <= bottom) {
            let at = y.at(*value);
            svg += &path("frame dash", format_args!("M{left:.1} {at:.1}H{right:.1}"));
            if !name.is_empty() {
                // Below its line if the title is near.
                let off = if at < top + LINE { LINE - 2.0 } else { -4.0 };
                svg += &word("t halo", [left + 4.0, at + off], *name);
            }
        }
        for (at, why) in &self.gaps {
            let at = x.at(*at);
            svg += &titled(
                "redl dash",
                format_args!("M{at:.1} {top:.1}V{bottom:.1}"),
                why,
            );
        }
        let mut front = String::new();
        for [at, height] in &self.front {
            let (at, height) = (x.at(*at), y.at(*height));
            let _ = match front.is_empty() {
                true => write!(front, "M{at:.1} {top:.1}V{height:.1}"),
                false => write!(front, "H{at:.1}V{height:.1}"),
            };
        }
        if !front.is_empty() {
            svg += &path("ink dots", format_args!("{front}H{right:.1}"));
        }
        svg
    }

    /// Draws the lines; returns their ends.
    fn paths(&self, x: &Scale, y: &Scale, svg: &mut String) -> Vec<Vec<[f64; 2]>> {
        let mut paths = Vec::new();
        let mut marks = String::new();
        for line in &self.lines {
            let [stroke, fill] = line.colour;
            let (mut way, mut drawn) = (Vec::new(), String::new());
            for point in &line.points {
                if !(self.x.shows(point.at[0]) && self.y.shows(point.at[1])) {
                    continue;
                }
                let at = [x.at(point.at[0]), y.at(point.at[1])];
                let step = if way.is_empty() || point.is_apart {
                    'M'
                } else {
                    'L'
                };
                let _ = write!(drawn, "{step}{:.1} {:.1}", at[0], at[1]);
                way.push(at);
                if let Some([from, to]) = point.spread.map(|s| s.map(|v| x.at(v)))
                    && to - from > 2.0
                {
                    marks += &straight(&format!("{stroke} thin"), [from, at[1]], [to, at[1]]);
                }
                let class = match point.is_hollow {
                    _ if point.is_bad => RED[1].to_owned(),
                    true => format!("{stroke} hollow"),
                    false => fill.to_owned(),
                };
                if !line.is_bare || point.is_bad {
                    marks += &mark(line.mark, &class, at, &point.title);
                }
            }
            let dash = if line.is_dashed { " dash" } else { "" };
            if way.len() > 1 && line.thickness > 0.0 {
                let width = (14.0 * line.thickness).round() / 10.0;
                *svg += &stroked(&format!("{stroke}{dash}"), width, drawn);
            }
            paths.push(way);
        }
        *svg += &marks;
        paths
    }

    /// To the right of each line, away from other labels and from lines; `None` if that is impossible.
    fn labels(
        &self,
        paths: &[Vec<[f64; 2]>],
        taken: &mut Vec<Place>,
        limits: Place,
    ) -> Option<Vec<Label>> {
        let sampled = |way: &Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            let between = |pair: &[[f64; 2]]| {
                let ([a, b], [c, d]) = (pair[0], pair[1]);
                let steps = ((c - a).hypot(d - b) / 5.0).ceil().max(1.0) as usize;
                let at = move |k: usize| k as f64 / steps as f64;
                (0..=steps).map(move |k| [a + at(k) * (c - a), b + at(k) * (d - b)])
            };
            way.windows(2).flat_map(between).collect()
        };
        let lines: Vec<[f64; 2]> = paths.iter().flat_map(sampled).collect();
        let ends = paths.iter().enumerate();
        let mut ends: Vec<(usize, [f64; 2])> = ends
            .filter_map(|(k, way)| {
                let rightmost = way.iter().max_by(|a, b| a[0].total_cmp(&b[0]));
                Some((k, *rightmost?))
            })
            .collect();
        ends.retain(|(k, _)| !self.lines[*k].label().is_empty());
        ends.sort_by(|a, b| a.1[1].total_cmp(&b.1[1]));
        let mut labels = Vec::new();
        let mut crossed = 0;
        for (line, end) in ends {
            let width = wide(&self.lines[line].label());
            let shifts = (0..SHIFTS).map(|k| if k % 2 == 0 { k / 2 } else { -(k + 1) / 2 });
            let places = shifts.map(|k| {
                let [x, y] = [end[0] + 8.0, end[1] + 3.5 + 7.0 * f64::from(k)];
                let place = [x, y - 10.0, x + width, y + 3.0];
                let inside =
                    place[1] >= limits[1] && place[3] <= limits[3] && place[2] <= limits[2];
                let is_free = inside && !taken.iter().any(|other| meets(other, &place));
                let is_hit = |p: &&[f64; 2]| {
                    meets(&place, &[p[0] - 2.0, p[1] - 2.0, p[0] + 2.0, p[1] + 2.0])
                };
                let hits = lines.iter().filter(is_hit).count();
                (
                    is_free,
                    3 * hits + k.unsigned_abs() as usize,
                    hits,
                    [x, y],
                    place,
                )
            });
            let free = places.filter(|place| place.0);
            let (_, _, hits, at, place) = free.min_by_key(|place| place.1)?;
            crossed += hits;
            taken.push(place);
            labels.push(Label { line, at, end });
        }
        (crossed <= 2 * labels.len()).then_some(labels)
    }

    fn named(&self, labels: &[Label]) -> String {
        let mut svg = String::new();
        for Label { line, at, end } in labels {
            let line = &self.lines[*line];
            if (at[1] - 3.5 - end[1]).abs() > 8.0 {
                svg += &straight(
                    "frame thin",
                    [end[0] + 3.0, end[1]],
                    [at[0] - 2.0, at[1] - 3.5],
                );
            }
            let class = if line.colour == RED {
                "t red halo"
            } else {
                "t b halo"
            };
            svg += &word(class, *at, line.label());
        }
        svg
    }
}

/// The legend of colours and marks, and its height.
fn key(charts: &[Chart], top: f64, width: f64) -> (String, f64) {
    let lines = || charts.iter().flat_map(|chart| &chart.lines);
    let is_both = lines().any(|l| !l.names[0].is_empty());
    let sign = |l: &Line, fill: &str| {
        let is_hollow = !l.points.is_empty() && l.points.iter().all(|p| p.is_hollow);
        let class = if is_hollow {
            format!("{} hollow", l.colour[0])
        } else {
            fill.to_owned()
        };
        mark(l.mark, &class, [0.0; 2], "")
    };
    let mut entries: Vec<(String, String)> = Vec::new();
    if is_both {
        entries.extend(lines().map(|l| {
            let stroke = l.colour[0];
            (stroked(stroke, 2.5, "M-6 0H8"), l.names[0].clone())
        }));
        entries.extend(lines().map(|l| (mark(l.mark, "inkf", [0.0; 2], ""), l.names[1].clone())));
    } else {
        entries.extend(lines().map(|l| (sign(l, l.colour[1]), l.names[1].clone())));
    }
    entries.retain(|(_, name)| !name.is_empty());
    let (mut svg, mut x, mut y) = (String::new(), 0.0, top + 8.0);
    for (sign, name) in unique(entries) {
        let room = wide(&name) + 30.0;
        if x > 0.0 && x + room > width {
            (x, y) = (0.0, y + 17.0);
        }
        let _ = write!(
            svg,
            "<g transform=\"translate({:.1} {y:.1})\">{sign}</g>",
            x + 7.0
        );
        svg += &word("t", [x + 18.0, y + 4.0], &name);
        x += room;
    }
    (svg, y - top + 12.0)
}

/// A line between two positions.
fn straight(class: &str, [a, b]: [f64; 2], [c, d]: [f64; 2]) -> String {
    path(class, format_args!("M{a:.1} {b:.1}L{c:.1} {d:.1}"))
}

/// A mark at a position, with its tooltip.
fn mark(kind: usize, class: &str, [x, y]: [f64; 2], title: &str) -> String {
    let title = match title {
        "" => String::new(),
        title => format!("<title>{}</title>", escape(title)),
    };
    let corners = MARKS[kind % MARKS.len()];
    if corners.is_empty() {
        return format!(
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.4\">{title}</circle>"
        );
    }
    let corners = corners
        .iter()
        .map(|[a, b]| format!("{:.1} {:.1}", x + a, y + b));
    let corners = corners.collect::<Vec<_>>().join(" ");
    format!("<polygon class=\"{class}\" points=\"{corners}\">{title}</polygon>")
}

/// Charts with a caption, drawn for a wide page and for a narrow one.
pub(in crate::report) fn chart_figure(caption: &Text, all: &[Chart], widest: f64) -> Html {
    let label = caption.to_string();
    let drawn = [widest, NARROWEST].map(|width| charts(&label, all, width).html());
    match all.iter().all(Chart::is_empty) {
        true => Html::default(),
        false => figures("", caption, drawn),
    }
}

/// Charts as one picture of a given width: side by side if there is space, else one below the other.
pub(in crate::report) fn charts(label: &str, all: &[Chart], width: f64) -> Picture {
    let columns = match width / (all.len().max(1) as f64) {
        each if each >= NARROW => all.len().max(1),
        _ => 1,
    };
    let each = (width - GAP * (columns - 1) as f64) / columns as f64;
    let height = (0.68 * each).clamp(260.0, 400.0);
    let rows = all.len().div_ceil(columns);
    let place = |k: usize| {
        let [column, row] = [k % columns, k / columns].map(|n| n as f64);
        [column * (each + GAP), row * (height + GAP)]
    };
    let draw = |is_named: bool| -> Option<String> {
        let panels = all.iter().enumerate();
        panels
            .map(|(k, chart)| chart.draw(place(k), each, height, is_named))
            .collect()
    };
    let foot = rows as f64 * (height + GAP) - GAP;
    // Names are at the lines, or all of them below.
    let (svg, foot) = match draw(true) {
        Some(svg) => (svg, foot),
        None => {
            let (key, more) = key(all, foot, width);
            (draw(false).unwrap_or_default() + &key, foot + more)
        }
    };
    Picture::new(label, [width, foot], svg)
}

#[cfg(test)]
mod tests;
