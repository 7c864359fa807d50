//! Axes with their labels, and positions of values on them.

use super::super::plane::ends;
use crate::text::number::{number, power_of_ten, trimmed};

/// Logarithmic by default.
#[derive(Default)]
pub(in crate::report) struct Axis {
    pub name: String,
    pub is_linear: bool,
    /// The values with labels; empty: powers of ten.
    pub at: Vec<(f64, String)>,
    /// Additional values with labels.
    pub also: Option<(f64, &'static str)>,
}

impl Axis {
    pub fn new(name: &str) -> Self {
        Axis {
            name: name.to_owned(),
            ..Axis::default()
        }
    }

    /// From value to value, with these labels.
    pub fn linear(name: &str, at: impl IntoIterator<Item = (f64, String)>) -> Self {
        Axis {
            is_linear: true,
            at: at.into_iter().collect(),
            ..Axis::new(name)
        }
    }

    pub fn shows(&self, value: f64) -> bool {
        value.is_finite() && (self.is_linear || value > 0.0) && value.abs() < 1e100
    }

    /// Numbers to be labelled, with their labels.
    pub fn ticks(&self, scale: &Scale) -> Vec<(f64, String)> {
        let [low, high] = scale.values();
        let room = 1e-9 * (high - low);
        let all = match self.at.is_empty() && !scale.is_linear {
            true => decades(low, high),
            false => self.at.clone(),
        };
        let inside = |t: &(f64, String)| (low - room..=high + room).contains(&t.0);
        let mut all: Vec<(f64, String)> = all.into_iter().filter(inside).collect();
        if let Some((value, name)) = self.also {
            all.retain(|(at, _)| (at / value).log10().abs() > 0.5);
            all.push((value, name.to_owned()));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}

/// From values to positions.
pub struct Scale {
    pub ends: [f64; 2],
    pub places: [f64; 2],
    pub is_linear: bool,
}

impl Scale {
    /// A range that contains all values, with a margin.
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64>, places: [f64; 2]) -> Option<Self> {
        let of = |v: f64| if axis.is_linear { v } else { v.log10() };
        let [low, high] = ends(values.filter(|v| axis.shows(*v)).map(of));
        if !low.is_finite() {
            return None;
        }
        let room = if high > low { 0.04 * (high - low) } else { 0.5 };
        Some(Scale {
            ends: [low - room, high + room],
            places,
            is_linear: axis.is_linear,
        })
    }

    pub fn at(&self, value: f64) -> f64 {
        let value = if self.is_linear { value } else { value.log10() };
        let share = (value - self.ends[0]) / (self.ends[1] - self.ends[0]);
        self.places[0] + (self.places[1] - self.places[0]) * share
    }

    /// The same, but not beyond the ends.
    pub fn inside(&self, value: f64) -> f64 {
        let [low, high] = [f64::min, f64::max].map(|of| of(self.places[0], self.places[1]));
        self.at(value).clamp(low, high)
    }

    pub fn values(&self) -> [f64; 2] {
        match self.is_linear {
            true => self.ends,
            false => self.ends.map(|e| 10f64.powf(e)),
        }
    }
}

/// Powers of ten in a range; if there are fewer than three, multiples of them, and in less than a decade round numbers.
pub fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    if !(low > 0.0 && high < f64::INFINITY) {
        return Vec::new();
    }
    let powers = (low.log10() - 1e-9).ceil() as i32..=(high.log10() + 1e-9).floor() as i32;
    let every = (powers.clone().count()).div_ceil(7).max(1) as i32;
    let all: Vec<f64> = if powers.clone().count() >= 3 {
        let powers = powers.filter(|k| k % every == 0);
        powers.map(|k| 10f64.powi(k)).collect()
    } else if high / low > 5.0 {
        let powers = low.log10().floor() as i32..=high.log10().floor() as i32;
        let of = |k| [1.0, 2.0, 5.0].map(|m: f64| format!("{m}e{k}").parse().unwrap_or(m));
        powers.flat_map(of).collect()
    } else {
        let power = 10f64.powf((0.3 * (high - low)).log10().floor());
        let steps = [1.0, 2.0, 5.0].map(|s| s * power);
        let step = steps.into_iter().find(|s| (high - low) / s <= 5.0);
        let step = step.unwrap_or(10.0 * power);
        let first = (low / step).ceil();
        (0..6).map(|k| (first + f64::from(k)) * step).collect()
    };
    let all: Vec<f64> = all
        .into_iter()
        .filter(|v| (low..=high).contains(v))
        .collect();
    let is_plain = all.iter().all(|v| (9e-4..2e3).contains(v));
    let label = |v: f64| {
        let power = (v.log10() + 1e-9).floor() as i32;
        let factor = v / 10f64.powi(power);
        match (factor - 1.0).abs() < 1e-9 {
            _ if is_plain => trimmed(&number(v, 3)),
            true if power == 0 => "1".into(),
            true => power_of_ten(power),
            false => format!("{}·{}", trimmed(&number(factor, 2)), power_of_ten(power)),
        }
    };
    all.into_iter().map(|v| (v, label(v))).collect()
}
