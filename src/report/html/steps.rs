//! Time by time, or file by file: the largest difference of each field, and where there was none to judge.

use std::fmt::Write as _;

use super::Html;
use super::along::{LEFT, Panel};
use super::markup::{division, escape, figure};
use super::plane::{NARROWEST, WIDEST, drawing, ticks, word};
use crate::text::number::{number, power_of_ten, size, trimmed};
use crate::text::text;
use faceoff_judge::{ComparedField, Comparisons, Verdict};

const HEIGHT: f64 = 250.0;
/// So many fields have a line, those that are nearest to their tolerance or beyond it.
const MOST: usize = 6;
/// Of more parts none has a dot of its own, unless it fails.
const DOTTED: usize = 150;
const LINES: [&str; 3] = ["ink", "goodl", "otherl"];

/// A field with its largest relative difference in each part that has one.
struct Line<'a> {
    of: &'a ComparedField,
    values: Vec<(usize, f64, Verdict)>,
    factor: f64,
}

/// Both drawings, of which the page shows one.
pub(in crate::report) fn steps(all: &Comparisons) -> Html {
    let mut lines = lines(all);
    if all.parts.len() < 2 || lines.is_empty() {
        return Html::default();
    }
    let fields = lines.len();
    lines.sort_by(|f, g| g.factor.total_cmp(&f.factor));
    lines.truncate(MOST);
    let by = match is_in_time(all) {
        true => "time by time",
        false => "part by part, in the order of the table",
    };
    let more = match fields - lines.len() {
        0 => String::new(),
        more => format!("; {more} more fields are farther below their tolerances"),
    };
    let caption = text!(
        "**Largest |a − b|** relative to the largest value of its field, {}{}",
        by,
        more
    );
    let [wide, narrow] = [WIDEST, NARROWEST].map(|width| drawn(all, &lines, width));
    figure(
        "",
        caption,
        [division("wide", wide), division("narrow", narrow)],
    )
}

/// Are the parts the times of one file?
fn is_in_time(all: &Comparisons) -> bool {
    let in_time = |part: &faceoff_judge::Part| part.name.is_empty() && part.time.is_some();
    all.parts.iter().all(in_time)
}

fn lines(all: &Comparisons) -> Vec<Line<'_>> {
    let mut lines: Vec<Line> = Vec::new();
    for (k, part) in all.parts.iter().enumerate() {
        for of in part.comparison.iter().flat_map(|c| &c.fields) {
            let value = (k, of.field.max_rel, of.field.verdict);
            let same =
                |line: &&mut Line| line.of.on == of.on && line.of.field.field == of.field.field;
            match lines.iter_mut().find(same) {
                Some(line) => {
                    line.values.push(value);
                    line.factor = line.factor.max(of.factor());
                }
                None => lines.push(Line {
                    of,
                    values: vec![value],
                    factor: of.factor(),
                }),
            }
        }
    }
    lines
}

fn drawn(all: &Comparisons, lines: &[Line], width: f64) -> Html {
    let right = width - if width < 500.0 { 8.0 } else { 150.0 };
    let values = || lines.iter().flat_map(|l| &l.values).map(|v| v.1);
    let tolerances = || lines.iter().map(|l| l.of.field.tolerance);
    let drawable = |v: &f64| *v > 0.0 && *v < 1e100;
    let ends = values().chain(tolerances()).filter(drawable);
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v.log10()), h.max(v.log10()))
    });
    // What is equal to the last bit has a place of its own, a decade below the rest.
    let has_zeros = values().any(|v| v == 0.0);
    let low = if low.is_finite() {
        low.floor().max(-18.0)
    } else {
        -16.0
    };
    let low = if has_zeros { low - 1.0 } else { low };
    let panel = Panel {
        top: 8.0,
        height: HEIGHT - 38.0,
        low,
        high: high.ceil().max(low + 1.0),
    };
    let in_time = is_in_time(all);
    let place = |k: usize| match in_time {
        true => all.parts[k].time.unwrap_or_default(),
        false => k as f64 + 1.0,
    };
    let (from, to) = (place(0), place(all.parts.len() - 1));
    let x = |k: usize| {
        LEFT + 6.0 + (right - LEFT - 12.0) * (place(k) - from) / (to - from).max(f64::MIN_POSITIVE)
    };
    let mut svg = String::new();
    let every = ((panel.high - panel.low) / 6.0).ceil().max(1.0) as usize;
    for power in (panel.low as i32..=panel.high as i32).step_by(every) {
        let y = panel.y(f64::from(power));
        let _ = write!(svg, "<path class=\"hair\" d=\"M{LEFT} {y:.1}H{right}\"/>");
        let label = match has_zeros && power == panel.low as i32 {
            true => "equal".to_owned(),
            false => power_of_ten(power),
        };
        svg += &word("t e", [LEFT - 6.0, y + 3.5], &label);
    }
    let mut drawn: Vec<f64> = Vec::new();
    for tolerance in tolerances().filter(drawable) {
        if !drawn.contains(&tolerance) && drawn.len() < 3 {
            let y = panel.log(tolerance);
            let _ = write!(
                svg,
                "<path class=\"frame dash\" d=\"M{LEFT} {y:.1}H{right}\"/>"
            );
            if drawn.is_empty() {
                svg += &word("t halo", [LEFT + 4.0, y - 4.0], "tolerance");
            }
            drawn.push(tolerance);
        }
    }
    let foot = panel.top + panel.height;
    for (k, part) in all
        .parts
        .iter()
        .enumerate()
        .filter(|(_, p)| p.comparison.is_none())
    {
        let reason = part.reason.as_deref().unwrap_or("not compared");
        let told = escape(&format!("{}: {reason}", part.title()));
        let _ = write!(
            svg,
            "<g><path class=\"redl dash\" d=\"M{0:.1} {1}V{foot}\"/><title>{told}</title></g>",
            x(k),
            panel.top
        );
    }
    let mut taken: Vec<f64> = Vec::new();
    for (j, line) in lines.iter().enumerate() {
        line_of(line, all, &panel, &x, LINES[j % LINES.len()], &mut svg);
        if let Some((_, value, _)) = line.values.last() {
            let mut y = height(&panel, *value) + 3.5;
            while taken.iter().any(|t| (t - y).abs() < 12.0) {
                y -= 12.0;
            }
            taken.push(y);
            if width > 500.0 {
                svg += &word("t halo", [right + 8.0, y], &line.of.field.field);
            }
        }
    }
    for at in marks(from, to, in_time) {
        let x =
            LEFT + 6.0 + (right - LEFT - 12.0) * (at - from) / (to - from).max(f64::MIN_POSITIVE);
        svg += &word("t m", [x, HEIGHT - 10.0], &trimmed(&number(at, 4)));
    }
    svg += &word(
        "t",
        [right + 8.0, HEIGHT - 10.0],
        if in_time { "time" } else { "part" },
    );
    drawing("largest differences, part by part", [width, HEIGHT], &svg)
}

/// What is not a finite number stands at the top.
fn height(panel: &Panel, value: f64) -> f64 {
    match value.is_finite() {
        true => panel.log(value),
        false => panel.top,
    }
}

fn line_of(
    line: &Line,
    all: &Comparisons,
    panel: &Panel,
    x: &impl Fn(usize) -> f64,
    class: &str,
    svg: &mut String,
) {
    let (mut path, mut dots) = (String::new(), String::new());
    let mut before = None;
    for (k, value, verdict) in &line.values {
        let (at, y) = (x(*k), height(panel, *value));
        // What lies on the other side of a gap is not joined.
        let is_next = before.is_some_and(|before: usize| before + 1 == *k);
        let _ = write!(path, "{}{at:.1} {y:.1}", if is_next { 'L' } else { 'M' });
        before = Some(*k);
        let fails = !verdict.passes();
        if fails || line.values.len() <= DOTTED {
            let told = escape(&format!(
                "{}, {}: {}",
                all.parts[*k].title(),
                line.of.field.field,
                size(*value)
            ));
            let (class, r) = if fails { ("redf", 3.2) } else { ("inkf", 2.0) };
            let _ = write!(
                dots,
                "<circle class=\"{class}\" cx=\"{at:.1}\" cy=\"{y:.1}\" r=\"{r}\"><title>{told}</title></circle>"
            );
        }
    }
    let _ = write!(
        svg,
        "<path class=\"{class}\" stroke-width=\"1.4\" d=\"{path}\"/>{dots}"
    );
}

/// Numbers below the axis.
fn marks(from: f64, to: f64, in_time: bool) -> Vec<f64> {
    let all = ticks(to - from);
    let step = all.get(1).copied().unwrap_or(to - from);
    let step = if in_time { step } else { step.ceil().max(1.0) };
    let first = (from / step).ceil();
    (0..=10)
        .map(|k| (first + f64::from(k)) * step)
        .filter(|t| *t <= to * (1.0 + 1e-9))
        .collect()
}
