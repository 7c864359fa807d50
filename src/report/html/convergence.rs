//! What becomes smaller: errors over meshes, a line a method with its slope; increments step by step, a line a code.

use std::fmt::Write as _;

use super::Html;
use super::along::{LEFT, Panel};
use super::markup::figure;
use super::plane::{WIDTH, drawing, word};
use crate::report::number::{number, power_of_ten};

const HEIGHT: f64 = 270.0;
const RIGHT: f64 = WIDTH - 92.0;
const CLASSES: [[&str; 2]; 3] = [["ink", "inkf"], ["goodl", "goodf"], ["otherl", "otherf"]];

/// A method: its errors on meshes of n, and the order that fits them.
pub(in crate::report) struct Line {
    pub name: String,
    pub errors: Vec<(usize, f64)>,
    pub order: Option<f64>,
}

pub(in crate::report) fn errors(lines: &[Line], caption: &str) -> Html {
    let shown = |(n, e): &(usize, f64)| *n > 0 && *e > 0.0 && *e < 1e100;
    let all = || lines.iter().flat_map(|l| &l.errors).filter(|p| shown(p));
    let ends = |of: &dyn Fn(&(usize, f64)) -> f64| {
        all()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            })
    };
    let (first, last) = ends(&|p| (p.0 as f64).log2());
    let (low, high) = ends(&|p| p.1.log10());
    if !(first < last) {
        return Html::default();
    }
    let (low, high) = (low.floor(), high.ceil().max(low.floor() + 1.0));
    let x = |n: usize| {
        LEFT + 8.0 + (RIGHT - LEFT - 16.0) * ((n as f64).log2() - first) / (last - first)
    };
    let y = |e: f64| 8.0 + (HEIGHT - 36.0) * (high - e.log10()) / (high - low);
    let mut svg = String::new();
    for power in low as i32..=high as i32 {
        let at = y(10f64.powi(power));
        let _ = write!(svg, "<path class=\"hair\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/>");
        svg += &word("t e", [LEFT - 6.0, at + 3.5], &power_of_ten(power));
    }
    let mut counts: Vec<usize> = all().map(|p| p.0).collect();
    counts.sort_unstable();
    counts.dedup();
    let every = counts.len().div_ceil(7);
    for n in counts.iter().step_by(every.max(1)) {
        svg += &word("t m", [x(*n), HEIGHT - 10.0], &n.to_string());
    }
    svg += &word("t", [RIGHT + 8.0, HEIGHT - 10.0], "n");
    let mut taken: Vec<f64> = Vec::new();
    let mut lines: Vec<(usize, &Line)> = lines.iter().enumerate().collect();
    let end = |l: &Line| l.errors.iter().rfind(|p| shown(p)).map_or(0.0, |p| y(p.1));
    lines.sort_by(|a, b| end(a.1).total_cmp(&end(b.1)));
    for (k, line) in lines {
        let [stroke, fill] = CLASSES[k % CLASSES.len()];
        let points: Vec<[f64; 2]> = line
            .errors
            .iter()
            .filter(|p| shown(p))
            .map(|(n, e)| [x(*n), y(*e)])
            .collect();
        let mut path = String::new();
        for [x, y] in &points {
            let _ = write!(
                path,
                "{}{x:.1} {y:.1}",
                if path.is_empty() { 'M' } else { 'L' }
            );
            let _ = write!(
                svg,
                "<circle class=\"{fill}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.4\"/>"
            );
        }
        let _ = write!(
            svg,
            "<path class=\"{stroke}\" stroke-width=\"1.4\" d=\"{path}\"/>"
        );
        if let Some([x, at]) = points.last() {
            let mut at = at + 3.5;
            while taken.iter().any(|t| (t - at).abs() < 12.0) {
                at += 12.0;
            }
            taken.push(at);
            let order = line
                .order
                .map_or(String::new(), |o| format!(" {}", number(o, 3)));
            svg += &word("t b halo", [x + 7.0, at], &format!("{}{order}", line.name));
        }
    }
    figure("", caption, [drawing(caption, [WIDTH, HEIGHT], &svg)])
}

/// The increments of each code, step by step; the lines of those at fault are red.
pub(in crate::report) fn newton(
    engines: &[(&str, &[f64])],
    faulty: &[&str],
    stop: Option<f64>,
    caption: &str,
) -> Html {
    let shown = |v: f64| v > 0.0 && v < 1e100;
    let all = || {
        engines
            .iter()
            .flat_map(|(_, v)| v.iter().copied())
            .filter(|v| shown(*v))
    };
    let (Some(least), Some(most)) = (all().reduce(f64::min), all().reduce(f64::max)) else {
        return Html::default();
    };
    let steps = engines
        .iter()
        .map(|(_, v)| v.len())
        .max()
        .unwrap_or(1)
        .max(2);
    let (width, height) = (384.0, 300.0);
    let low = least.max(1e-18).log10().floor();
    let high = most.log10().ceil().max(low + 1.0);
    let panel = Panel {
        top: 6.0,
        height: height - 30.0,
        low,
        high,
    };
    let x = |step: usize| LEFT + (width - 66.0 - LEFT) * step as f64 / (steps - 1) as f64;
    let mut svg = String::new();
    let every = if high - low > 10.0 { 4 } else { 2 };
    for power in (low as i32..=high as i32).filter(|p| p % every == 0) {
        let y = panel.y(f64::from(power));
        let _ = write!(
            svg,
            "<path class=\"hair\" d=\"M{LEFT} {y:.1}H{}\"/>",
            width - 62.0
        );
        let label = if power == 0 {
            "1".to_owned()
        } else {
            power_of_ten(power)
        };
        svg += &word("t e", [LEFT - 6.0, y + 3.5], &label);
    }
    if let Some(stop) = stop.filter(|s| s.log10() > low) {
        let y = panel.log(stop);
        let _ = write!(
            svg,
            "<path class=\"frame dash\" d=\"M{LEFT} {y:.1}H{}\"/>",
            width - 62.0
        );
        svg += &word("t", [LEFT + 4.0, y - 4.0], "stop");
    }
    let mut taken: Vec<f64> = Vec::new();
    for (k, (name, values)) in engines.iter().enumerate() {
        let is_faulty = faulty.contains(name);
        let (line, fill) = match (is_faulty, k) {
            (true, _) => ("redl", "redf"),
            (_, 0) => ("ink", "inkf"),
            (_, 1) => ("goodl", "goodf"),
            _ => ("otherl", "otherf"),
        };
        let points: Vec<(f64, f64)> = values
            .iter()
            .enumerate()
            .filter(|(_, v)| **v < 1e100)
            .map(|(k, v)| (x(k), panel.log(*v)))
            .collect();
        let mut path = String::new();
        let mut dots = String::new();
        for (x, y) in &points {
            let _ = write!(
                path,
                "{}{x:.1} {y:.1}",
                if path.is_empty() { 'M' } else { 'L' }
            );
            if points.len() < 60 {
                let _ = write!(
                    dots,
                    "<circle class=\"{fill}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\"/>"
                );
            }
        }
        let thick = 1.5 + 1.6 * (engines.len() - 1 - k) as f64;
        let _ = write!(
            svg,
            "<path class=\"{line}\" stroke-width=\"{thick}\" d=\"{path}\"/>{dots}"
        );
        if let Some((x, y)) = points.last() {
            let mut y = y + 3.5;
            while taken.iter().any(|t| (t - y).abs() < 12.0) {
                y -= 12.0;
            }
            taken.push(y);
            svg += &word(
                if is_faulty { "t red halo" } else { "t halo" },
                [x + 6.0, y],
                name,
            );
        }
    }
    let every = steps.div_ceil(10);
    for step in (0..steps).filter(|s| s % every == 0) {
        svg += &word("t m", [x(step), height - 8.0], &(step + 1).to_string());
    }
    let picture = drawing("iterations: increment by step", [width, height], &svg);
    figure("", caption, [picture])
}
