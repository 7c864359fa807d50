//! Numbers as dots on one logarithmic axis, one strip per row of a table. They are HTML, so that they keep their shape.

use super::markup::{Html, html};
use crate::text::number::{power_of_ten, size};

/// Decades from end to end, and the positions of the tolerances.
pub(in crate::report) struct Axis {
    low: f64,
    high: f64,
    tolerances: Vec<f64>,
}

/// A number on an axis: its class, and its tooltip.
pub(in crate::report) struct Dot {
    pub value: f64,
    pub class: &'static str,
    pub title: String,
}

impl Axis {
    /// From rounding to some decades above the tolerances and the largest value.
    pub fn new(values: impl Iterator<Item = f64>, tolerances: Vec<f64>) -> Self {
        let finite = values.filter(|v| v.is_finite() && *v > 0.0);
        let largest = finite
            .chain(tolerances.iter().copied())
            .fold(1e-13, f64::max);
        Axis {
            low: -17.0,
            high: (largest.log10() + 0.5).ceil().min(300.0),
            tolerances,
        }
    }

    /// The left end for 0, the right end for values that are not finite.
    fn left(&self, value: f64) -> String {
        let decades = match value {
            v if !v.is_finite() => self.high,
            v => v.log10().clamp(self.low, self.high),
        };
        let percent = 100.0 * (decades - self.low) / (self.high - self.low);
        format!("left:{percent:.1}%")
    }

    /// The powers of ten above a column of strips.
    pub fn head(&self) -> Html {
        let every = match self.high - self.low {
            span if span > 30.0 => 50,
            span if span > 12.0 => 4,
            _ => 2,
        };
        let powers: Vec<i32> = self
            .tolerances
            .iter()
            .map(|t| t.log10().round() as i32)
            .collect();
        let first = powers.first().copied().unwrap_or(-12);
        let inside =
            |power: &i32| f64::from(*power) > self.low && f64::from(*power) < self.high + 0.1;
        let ticks = (-400..=400).filter(|p| (p - first) % every == 0);
        let ticks = ticks.filter(|power| {
            inside(power)
                && !powers
                    .iter()
                    .any(|of| of != power && (of - power).abs() < every)
        });
        let mut all: Vec<i32> = ticks.chain(powers.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        html! {
            span.axis aria-hidden="true" {
                @for power in all {
                    span style=(self.left(10f64.powi(power))) class=[powers.contains(&power).then_some("b")] {
                        (power_of_ten(power))
                    }
                }
            }
        }
    }

    pub fn strip(&self, dots: &[Dot]) -> Html {
        html! {
            .strip {
                s {}
                @for tolerance in &self.tolerances { u style=(self.left(*tolerance)) {} }
                @for Dot { value, class, title } in dots {
                    i style=(self.left(*value)) title={ (title) ": " (size(*value)) }
                        class=[Some(class).filter(|class| !class.is_empty())] {}
                }
            }
        }
    }
}

/// The codes of the dots.
pub(super) fn key<'a>(names: impl Iterator<Item = (&'a str, &'static str)>) -> Html {
    html! { @for (name, class) in names { span.key { i class=(class) {} (name) } } }
}
