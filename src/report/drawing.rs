//! Figures: each drawn once, as SVG and as PNG.

use std::path::Path;

use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use super::console::misleads;
use super::number::power_of_ten;
use faceoff_mesh::error::{Error, Result};

/// Registered with the font that the program carries; a viewer of SVG takes what it has.
const FONT: &str = "DejaVu Sans, sans-serif";

/// Labels on an axis.
const MOST_LABELS: i32 = 12;
/// Up to so many decades 2 and 5 are labelled as well.
const FEW_DECADES: i32 = 2;

/// What drawing on a backend ends with.
pub type Drawn<DB> =
    std::result::Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Something that can be drawn on any backend.
pub trait Drawing {
    /// Width and height in pixels.
    fn size(&self) -> (u32, u32);

    /// Draws on a white area of that size.
    ///
    /// # Errors
    /// Those of the backend.
    fn on<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Drawn<DB>;
}

/// What can be drawn, whatever it is.
pub trait Picture {
    /// As a document of its own.
    ///
    /// # Errors
    /// What cannot be drawn.
    fn svg(&self) -> Result<String>;

    /// As a file.
    ///
    /// # Errors
    /// What cannot be drawn, and a file that cannot be written.
    fn png(&self, path: &Path) -> Result<()>;
}

impl<T: Drawing> Picture for T {
    fn svg(&self) -> Result<String> {
        svg(self.size(), |area| on_white(self, area))
    }

    fn png(&self, path: &Path) -> Result<()> {
        set_up_font()?;
        let (width, height) = self.size();
        let mut pixels = vec![0; 3 * width as usize * height as usize];
        {
            let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
            on_white(self, &area).map_err(|e| failed(e.to_string()))?;
        }
        let bytes = encode(width, height, &pixels).map_err(|e| failed(e.to_string()))?;
        std::fs::write(path, bytes).map_err(Error::io(path, "write"))
    }
}

/// Rows of red, green and blue as PNG.
fn encode(width: u32, height: u32, pixels: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// A part of a picture that becomes SVG.
pub type SvgArea<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// SVG of a size in pixels, on a transparent ground.
///
/// # Errors
/// What cannot be drawn.
pub fn svg(
    size: (u32, u32),
    plot: impl FnOnce(&SvgArea) -> std::result::Result<(), DrawingAreaErrorKind<std::io::Error>>,
) -> Result<String> {
    set_up_font()?;
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let drawn = plot(&area).and_then(|()| area.present());
        drawn.map_err(|e| failed(e.to_string()))?;
    }
    // Names are drawn as text.
    let shown = |c: char| if misleads(c) { '\u{fffd}' } else { c };
    Ok(svg.chars().map(shown).collect())
}

fn on_white<DB: DrawingBackend>(
    drawing: &impl Drawing,
    area: &DrawingArea<DB, Shift>,
) -> Drawn<DB> {
    area.fill(&WHITE)?;
    drawing.on(area)?;
    area.present()
}

fn set_up_font() -> Result<()> {
    register_font(FONT, FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| failed("the font that the program carries is no font".into()))
}

fn failed(why: String) -> Error {
    Error::Solver {
        what: format!("a figure cannot be drawn: {why}"),
        remedy: "report this".into(),
    }
}

/// Black text of a size in pixels.
pub fn font(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&BLACK)
}

/// Axes of a chart with pale lines where the labels are, and with text of a size.
pub fn axes<'m, 'a, 'b, X: Ranged, Y: Ranged, DB: DrawingBackend>(
    mesh: &'m mut MeshStyle<'a, 'b, X, Y, DB>,
    shade: f64,
    size: u32,
) -> &'m mut MeshStyle<'a, 'b, X, Y, DB> {
    mesh.bold_line_style(BLACK.mix(shade))
        .light_line_style(TRANSPARENT)
        .label_style(font(size))
        .axis_desc_style(font(size))
}

/// From deep blue below to pale yellow at the top.
pub fn shade(share: f64) -> RGBColor {
    let share = share.clamp(0.0, 1.0);
    let (low, high) = ([49.0, 84.0, 150.0], [250.0, 244.0, 200.0]);
    let mix = |k: usize| (low[k] + share * (high[k] - low[k])) as u8;
    RGBColor(mix(0), mix(1), mix(2))
}

/// `10⁻³`, or `2·10⁻³`.
pub fn label(value: f64) -> String {
    let power = (value.log10() + 1e-9).floor() as i32;
    let digit = (value / 10.0_f64.powi(power)).round();
    if digit == 1.0 {
        power_of_ten(power)
    } else {
        format!("{digit}·{}", power_of_ten(power))
    }
}

/// The range of whole decades about values that are positive, and what is labelled in it: not too many, nor too few.
pub fn decades(values: impl Iterator<Item = f64> + Clone) -> (std::ops::Range<f64>, Vec<f64>) {
    let low = values.clone().fold(f64::INFINITY, f64::min).log10().floor() as i32;
    let high = (values.fold(0.0, f64::max).log10().ceil() as i32).max(low + 1);
    let step = (high - low).div_euclid(MOST_LABELS) + 1;
    let multiples: &[f64] = match high - low {
        ..=FEW_DECADES => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let powers = (low..=high).step_by(step as usize);
    let powers = powers.map(|k| 10.0_f64.powi(k));
    let labelled = powers.flat_map(|power| multiples.iter().map(move |m| m * power));
    (10.0_f64.powi(low)..10.0_f64.powi(high), labelled.collect())
}
