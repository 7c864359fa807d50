//! The agreement of codes: the differences of each pair of codes by their size, in units of rounding.

use std::fmt::Write as _;

use super::Html;
use super::markup::figures;
use super::pair::pairs;
use super::plane::{drawing, path, titled, word};
use crate::campaigns::verify::VerifyOutcome;
use crate::engine::unique;
use crate::text::number::{size, trimmed, whole};
use crate::text::{Text, at_most, text};
use faceoff_mesh::error::Result;

/// Powers of two of rounding that are drawn.
const LOW: i32 = -9;
const HIGH: i32 = 17;
const BINS: usize = 2 * (HIGH - LOW) as usize;
/// The most pairs of codes with separate lines.
const MOST: usize = 3;

/// Differences of one pair of codes by one method, over rounding.
struct Of {
    pair: [String; 2],
    method: String,
    tolerance: f64,
    differences: Vec<f64>,
}

/// All differences of values of a run.
pub(in crate::report) struct Spread {
    all: Vec<Of>,
}

impl Spread {
    /// # Errors
    /// Faces that cannot be matched.
    pub fn new(outcome: &VerifyOutcome) -> Result<Self> {
        let mut all: Vec<Of> = Vec::new();
        for case in &outcome.cases {
            for pair in pairs(case) {
                for field in pair.fields.iter().filter(|f| f.field != "status") {
                    let of = pair.differences(case, &field.field)?;
                    let of = of.into_iter().map(|(_, d)| d / f64::EPSILON);
                    let of = of.filter(|d| d.is_finite());
                    let name = [pair.a, pair.b].map(str::to_owned);
                    let same = |o: &&mut Of| o.pair == name && o.method == case.method;
                    match all.iter_mut().find(same) {
                        Some(known) => known.differences.extend(of),
                        None => all.push(Of {
                            pair: name,
                            method: case.method.clone(),
                            tolerance: field.tolerance / f64::EPSILON,
                            differences: of.collect(),
                        }),
                    }
                }
            }
        }
        all.iter_mut()
            .for_each(|of| of.differences.sort_by(f64::total_cmp));
        Ok(Spread { all })
    }

    fn differences(&self) -> impl Iterator<Item = f64> {
        self.all
            .iter()
            .flat_map(|of| of.differences.iter().copied())
    }

    /// The size of the differences as text.
    pub fn words(&self) -> Text {
        let mut all: Vec<f64> = self.differences().collect();
        all.sort_by(f64::total_cmp);
        let Some(last) = all.last().copied() else {
            return Text::default();
        };
        let at = |share: f64| all[((all.len() - 1) as f64 * share) as usize];
        let units = |d: f64| trimmed(&at_most(d, if d < 100.0 { 2 } else { 3 }));
        let slack = self.all.iter().filter_map(|of| {
            let largest = of.differences.last().filter(|d| **d > 0.0)?;
            Some(of.tolerance / largest)
        });
        let slack = slack.fold(f64::INFINITY, f64::min);
        let slack = match slack.is_finite() && slack >= 1.0 {
            true => format!(", 1/{} of its tolerance", whole(slack as usize)),
            false => String::new(),
        };
        text!(
            "Of {} differences half are below **{} units of rounding**, 99 in 100 below {}; the largest is {} units{slack}.",
            whole(all.len()),
            units(at(0.5)),
            units(at(0.99)),
            units(last)
        )
    }

    pub fn figure(&self) -> Html {
        let equal = self.differences().filter(|d| *d == 0.0).count();
        let count = self.differences().count();
        let caption = text!(
            "**How well they agree.** Share of the values by their difference, for each pair of codes; ▴ the largest. {} in 100 are \
             equal to the last bit and not drawn",
            (100 * equal).div_ceil(count.max(1))
        );
        let drawn = [(545.0, 306.0), (358.0, 330.0)].map(|size| self.drawn(size));
        figures("c6", caption, drawn)
    }

    fn drawn(&self, (width, height): (f64, f64)) -> Html {
        let is_narrow = width < 500.0;
        let (left, right) = match is_narrow {
            true => (2.0, width - 4.0),
            false => (90.0, width - 14.0),
        };
        let x =
            |power: f64| left + (right - left) * (power - f64::from(LOW)) / f64::from(HIGH - LOW);
        let bins = |of: &Of| {
            let mut bins = [0_usize; BINS];
            for d in of.differences.iter().filter(|d| **d > 0.0) {
                let place = 2.0 * (d.log2() - f64::from(LOW));
                bins[(place.max(0.0) as usize).min(BINS - 1)] += 1;
            }
            bins.map(|n| n as f64 / of.differences.len().max(1) as f64)
        };
        let top = self
            .all
            .iter()
            .flat_map(bins)
            .fold(f64::MIN_POSITIVE, f64::max);
        let names = unique(self.all.iter().map(|of| &of.pair));
        let methods = unique(self.all.iter().map(|of| &*of.method));
        let shown = names.len().clamp(1, MOST);
        let row = (height - 52.0) / shown as f64;
        let mut svg = String::new();
        let tolerances = self
            .all
            .iter()
            .map(|of| (of.tolerance.to_bits(), &*of.method));
        let tolerances = unique(tolerances);
        for (k, (bits, method)) in tolerances.iter().enumerate() {
            let at = x(f64::from_bits(*bits).log2());
            svg += &path("frame dash", format_args!("M{at:.1} 16V{}", height - 34.0));
            let (class, dx, told) = match k {
                0 => ("t e", -4.0, format!("tolerance, {method}")),
                _ => ("t", 4.0, (*method).to_owned()),
            };
            if k < 2 {
                svg += &word(class, [at + dx, 11.0], &told);
            }
        }
        for (k, name) in names.iter().take(MOST).enumerate() {
            let base = 10.0 + row * (k + 1) as f64;
            let most = row - if is_narrow { 26.0 } else { 14.0 };
            svg += &path("hair", format_args!("M{left} {base:.1}H{right}"));
            let [a, b] = name;
            let both = format!("{a} – {b}");
            match is_narrow {
                false => {
                    svg += &word("s e", [left - 10.0, base - 4.0], format!("{a} –"));
                    svg += &word("s e", [left - 10.0, base + 10.0], b);
                }
                true => svg += &word("s", [left, base - most - 4.0], &both),
            }
            for of in self.all.iter().filter(|of| of.pair == **name) {
                let which = methods.iter().position(|m| *m == of.method).unwrap_or(0);
                let step = (right - left) / BINS as f64;
                let mut outline = format!("M{left:.1} {base:.1}");
                for share in bins(of) {
                    let _ = write!(outline, "V{:.1}h{step:.2}", base - most * share / top);
                }
                let _ = write!(outline, "V{base:.1}z");
                let largest = of.differences.last().copied().unwrap_or(0.0);
                let median = of.differences.get(of.differences.len() / 2);
                let median = median.copied().unwrap_or(0.0);
                let told = format!(
                    "{both}, {}: half below {}, largest {} units of rounding",
                    of.method,
                    size(median),
                    size(largest)
                );
                let (class, fill) = match which {
                    0 => ("inkf\" fill-opacity=\".82", "inkf"),
                    1 => ("goodl\" stroke-width=\"1.6", "goodf"),
                    _ => ("otherl\" stroke-width=\"1.3", "otherf"),
                };
                svg += &titled(class, outline, &told);
                if largest > 0.0 {
                    let at = x(largest.log2().clamp(f64::from(LOW), f64::from(HIGH)));
                    svg += &path(fill, format_args!("M{at:.1} {:.1}l-4 7h8z", base + 4.0));
                }
                // The methods are named once, each at its highest bar.
                if k == 0 && !is_narrow {
                    let bars = bins(of);
                    let peak = (0..BINS).max_by(|a, b| bars[*a].total_cmp(&bars[*b]));
                    let peak = peak.unwrap_or(0);
                    let x = left + step * (peak as f64 + 0.5);
                    let y = base - most * bars[peak] / top - 4.0;
                    svg += &word("t b halo m", [x, y], &of.method);
                }
            }
        }
        for power in (LOW + 1..HIGH).step_by(4) {
            let (at, foot) = (x(f64::from(power)), height - 34.0);
            let label = match power {
                0 => "1".to_owned(),
                p if p < 0 => format!("1⁄{}", 1_u32 << -p),
                p => whole(1_usize << p),
            };
            let class = if power == 0 { "t b m" } else { "t m" };
            svg += &path("frame", format_args!("M{at:.1} {foot}v4"));
            svg += &word(class, [at, foot + 15.0], &label);
        }
        let unit = format!(
            "|a − b| in units of rounding, {} of max |u|",
            size(f64::EPSILON)
        );
        svg += &word("t m", [0.5 * (left + right), height - 3.0], &unit);
        drawing("histogram of differences", [width, height], &svg)
    }
}
