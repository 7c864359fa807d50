//! Time by time, or file by file: the largest difference of each field, and parts that could not be judged.

use super::Html;
use super::chart::{Axis, Chart, Line, Point, chart_figure};
use super::plane::{WIDEST, ends, ticks};
use crate::engine::unique;
use crate::text::number::{number, size, trimmed};
use crate::text::text;
use faceoff_judge::{ComparedField, Comparisons, Verdict};

/// The most fields with a line, those with the largest differences relative to the tolerance.
const MOST: usize = 6;
/// With more parts, none has a separate mark, unless it fails.
const MARKED: usize = 150;
/// The most tolerances with a line.
const TOLERANCES: usize = 3;

/// A field with its largest relative difference in each part that has one.
struct Track<'a> {
    of: &'a ComparedField,
    values: Vec<(usize, f64, Verdict)>,
    factor: f64,
}

/// The largest differences of the important fields, part by part.
pub(in crate::report) fn steps(all: &Comparisons) -> Html {
    let mut tracks = tracks(all);
    if all.parts.len() < 2 || tracks.is_empty() {
        return Html::default();
    }
    let fields = tracks.len();
    tracks.sort_by(|f, g| g.factor.total_cmp(&f.factor));
    tracks.truncate(MOST);
    let by = match is_in_time(all) {
        true => "time by time",
        false => "part by part, in the order of the table",
    };
    let more = match fields - tracks.len() {
        0 => String::new(),
        more => format!("; {more} more fields are farther below their tolerances"),
    };
    let caption =
        text!("**Largest |a − b|** relative to the largest value of its field, {by}{more}");
    chart_figure(&caption, &[chart(all, &tracks)], WIDEST)
}

/// Are the parts the times of one file?
fn is_in_time(all: &Comparisons) -> bool {
    let in_time = |part: &faceoff_judge::Part| part.name.is_empty() && part.time.is_some();
    all.parts.iter().all(in_time)
}

fn tracks(all: &Comparisons) -> Vec<Track<'_>> {
    let mut tracks: Vec<Track> = Vec::new();
    for (k, part) in all.parts.iter().enumerate() {
        for of in part.comparison.iter().flat_map(|c| &c.fields) {
            let value = (k, of.field.max_rel, of.field.verdict);
            let same =
                |track: &&mut Track| track.of.on == of.on && track.of.field.field == of.field.field;
            match tracks.iter_mut().find(same) {
                Some(track) => {
                    track.values.push(value);
                    track.factor = track.factor.max(of.factor());
                }
                None => tracks.push(Track {
                    of,
                    values: vec![value],
                    factor: of.factor(),
                }),
            }
        }
    }
    tracks
}

/// A line for each field, over time or the number of the part.
fn chart(all: &Comparisons, tracks: &[Track]) -> Chart {
    let in_time = is_in_time(all);
    let place = |k: usize| match in_time {
        true => all.parts[k].time.unwrap_or_default(),
        false => k as f64 + 1.0,
    };
    let values = || tracks.iter().flat_map(|t| &t.values).map(|v| v.1);
    let drawable = |v: &f64| *v > 0.0 && *v < 1e100;
    let tolerances = unique(tracks.iter().map(|t| t.of.field.tolerance.to_bits()));
    let tolerances = tolerances.into_iter().map(f64::from_bits).filter(drawable);
    let tolerances: Vec<f64> = tolerances.collect();
    let drawn = values().filter(drawable).chain(tolerances.iter().copied());
    let [low, high] = match ends(drawn) {
        [low, high] if low <= high => [low, high],
        _ => [1e-16, 1e-15],
    };
    // Equal values have a separate position below the rest, values that are not finite one above.
    let equal = 10f64.powf(low.log10().floor().max(-18.0) - 1.0);
    let height = |value: f64| match value {
        0.0 => equal,
        value if drawable(&value) => value.max(equal),
        _ => 10.0 * high,
    };
    let lines = tracks.iter().enumerate().map(|(j, track)| {
        let mut before = None;
        let points = track.values.iter().map(|(k, value, verdict)| {
            // A line ends at a gap.
            let is_next = before
                .replace(*k)
                .is_some_and(|before: usize| before + 1 == *k);
            let (title, name) = (all.parts[*k].title(), &track.of.field.field);
            Point {
                is_bad: !verdict.passes(),
                is_apart: !is_next,
                title: format!("{title}, {name}: {}", size(*value)),
                ..Point::new([place(*k), height(*value)])
            }
        });
        let points: Vec<Point> = points.collect();
        Line {
            is_bare: points.len() > MARKED,
            points,
            ..Line::new(&track.of.field.field, j, [])
        }
    });
    let gaps = all.parts.iter().enumerate();
    let gaps = gaps.filter(|(_, part)| part.comparison.is_none());
    let gaps = gaps.map(|(k, part)| {
        let reason = part.reason.as_deref().unwrap_or("not compared");
        (place(k), format!("{}: {reason}", part.title()))
    });
    let (from, to) = (place(0), place(all.parts.len() - 1));
    let marks = marks(from, to, in_time).into_iter();
    let marks = marks.map(|at| (at, trimmed(&number(at, 4))));
    let names = [&["tolerance"][..], &[""; TOLERANCES]].concat();
    Chart {
        x: Axis::linear(if in_time { "time" } else { "part" }, marks),
        y: Axis {
            also: values().any(|v| v == 0.0).then_some((equal, "equal")),
            ..Axis::new("largest difference")
        },
        levels: tolerances.into_iter().zip(names).take(TOLERANCES).collect(),
        gaps: gaps.collect(),
        lines: lines.collect(),
        ..Chart::default()
    }
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
