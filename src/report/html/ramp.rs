//! One colour scale for residuals and differences: logarithmic, cold below the tolerance and warm above it.

use super::markup::{Html, html, raw};
use super::plane::{path, titled, word};
use crate::text::number::{power_of_ten, size, whole};

/// Steps below the tolerance, and all steps; the style has the colours. One more is for values that are not finite.
const COLD: i32 = 20;
const STEPS: i32 = 48;
pub(super) const CLASSES: usize = STEPS as usize + 1;
/// Steps per decade, unless a value is larger.
const A_DECADE: f64 = 4.0;
/// Height of the tallest column of a histogram.
const TALLEST: i32 = 64;

#[derive(Clone, Copy)]
pub(super) struct Ramp {
    pub tolerance: f64,
    /// Steps per decade above the tolerance.
    above: f64,
}

impl Ramp {
    /// With a tolerance, and wide enough for the largest of these that is finite.
    pub fn over(tolerance: f64, values: impl Iterator<Item = f64>) -> Self {
        Ramp::new(
            tolerance,
            values.filter(|v| v.is_finite()).fold(0.0, f64::max),
        )
    }

    /// With a tolerance, and wide enough for the largest value.
    pub fn new(tolerance: f64, largest: f64) -> Self {
        let room = f64::from(STEPS - COLD);
        let decades = (largest / tolerance).log10();
        let above = match decades.is_finite() && decades * A_DECADE > room {
            true => room / decades.ceil(),
            false => A_DECADE,
        };
        Ramp { tolerance, above }
    }

    /// The colour of a value, by its index.
    pub fn step(&self, value: f64) -> usize {
        if !value.is_finite() {
            return STEPS as usize;
        }
        let decades = (value / self.tolerance).log10();
        let step = match decades <= 0.0 {
            true => (decades * A_DECADE).ceil() - 1.0,
            false => (decades * self.above).floor(),
        };
        // For 0 it is the least integer.
        (COLD + (step as i32).clamp(-COLD, STEPS - COLD - 1)) as usize
    }

    /// The scale with its powers of ten, and the quantity.
    pub fn bar(&self, label: &str) -> Html {
        self.counted(label, &[])
    }

    /// The scale with the number of these values that have each of its colours.
    pub fn counted(&self, label: &str, values: &[f64]) -> Html {
        let (left, width) = (12.0, 376.0);
        let at = |step: f64| left + width * step / f64::from(STEPS);
        let mut counts = [0_usize; STEPS as usize];
        for value in values.iter().filter(|v| v.is_finite() && **v != 0.0) {
            counts[self.step(value.abs())] += 1;
        }
        let most = counts.iter().copied().max().unwrap_or(0);
        let (what, top) = match most {
            0 => ("colour scale", 0),
            _ => ("histogram over the colour scale", TALLEST + 2),
        };
        let mut svg = String::new();
        let width_of_one = width / f64::from(STEPS);
        for (step, count) in (0..STEPS).zip(counts).filter(|(_, count)| *count > 0) {
            let (x, w) = (at(f64::from(step)), width_of_one);
            // One value is visible next to a million.
            let h = (f64::from(TALLEST) * count as f64 / most as f64).max(1.5);
            let d = format_args!("M{x:.1} 0h{w:.2}v-{h:.1}h-{w:.2}z");
            svg += &titled(&format!("f k{step}"), d, &whole(count));
        }
        if most > 0 {
            svg += &path("hair", format_args!("M{left} 0h{width}"));
        }
        for step in 0..STEPS {
            let (x, w) = (at(f64::from(step)), width_of_one + 0.3);
            svg += &path(
                &format!("f crisp k{step}"),
                format_args!("M{x:.1} 12h{w:.2}v8h-{w:.2}z"),
            );
        }
        let x = at(f64::from(COLD));
        let of_tolerance = match self.tolerance.log10().round() as i32 {
            power if format!("1e{power}").parse() == Ok(self.tolerance) => power_of_ten(power),
            _ => size(self.tolerance),
        };
        svg += &path("ink", format_args!("M{x:.1} 9v14"));
        svg += &(word("t b m", [x, 34.0], of_tolerance) + &word("t b m", [x, 7.0], "tolerance"));
        let power = self.tolerance.log10();
        let every = if self.above < 0.75 * A_DECADE { 4 } else { 2 };
        for decades in (-4..=16).filter(|d| *d != 0 && d % if *d > 0 { every } else { 2 } == 0) {
            let steps = f64::from(decades) * if decades > 0 { self.above } else { A_DECADE };
            let step = f64::from(COLD) + steps;
            if (0.0..=f64::from(STEPS)).contains(&step) {
                let label = power_of_ten((power + f64::from(decades)).round() as i32);
                svg += &word("t m", [at(step), 34.0], label);
            }
        }
        let view = format!("0 -{top} 400 {}", 40 + top);
        html! { .scale { span.cap { (label) } svg role="img" aria-label=(what) viewBox=(view) { (raw(svg)) } } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_turns_at_the_tolerance() {
        let ramp = Ramp::new(1e-12, 1e-6);
        assert!(ramp.step(1e-12) < COLD as usize && ramp.step(1.01e-12) == COLD as usize);
        assert_eq!([0.0, 1e-17, 1e-18].map(|v| ramp.step(v)), [0, 0, 0]);
        assert_eq!([1.1e-5, 1e300].map(|v| ramp.step(v)), [47, 47]);
        assert_eq!([f64::NAN, f64::INFINITY].map(|v| ramp.step(v)), [48, 48]);
        // Values far above it are distinguishable.
        let wide = Ramp::new(1e-12, 1.0);
        assert!(wide.step(1e-3) < wide.step(0.5));
        assert!((0..=48).contains(&Ramp::new(1e-12, f64::NAN).step(1.0)));
    }

    #[test]
    fn each_value_is_in_the_column_of_its_colour() {
        let ramp = Ramp::new(1e-12, 1e-6);
        let values = [0.0, f64::NAN, 3e-13, -3e-13, 2e-7];
        let html = ramp.counted("", &values);
        let column = |value: f64, height: &str, count: &str| {
            let start = format!("class=\"f k{}\" d=\"M", ramp.step(value));
            let end = format!("v-{height}");
            let mut all = html
                .as_str()
                .split("<path ")
                .filter(|p| p.starts_with(&start));
            assert!(all.any(|p| p.contains(&end) && p.contains(&format!("<title>{count}<"))));
        };
        column(3e-13, "64.0", "2");
        column(2e-7, "32.0", "1");
        assert_eq!(html.as_str().matches("<title>").count(), 2);
        assert_eq!(ramp.bar("").as_str().matches("<title>").count(), 0);
    }
}
