//! Figures: each drawn once, as SVG and as PNG.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use faceoff_mesh::error::{Error, Place, Result};

/// Registered with the font that the program carries; a viewer of SVG takes what it has.
const FONT: &str = "DejaVu Sans, sans-serif";

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

/// Draws to `folder/NAME.svg` and `folder/NAME.png`.
///
/// # Errors
/// Files that cannot be written.
pub fn draw(drawing: &impl Drawing, folder: &Path, name: &str) -> Result<()> {
    let file = |suffix: &str| folder.join(format!("{name}.{suffix}"));
    let (svg, png) = (file("svg"), file("png"));
    if register_font(FONT, FontStyle::Normal, dejavu::sans::regular()).is_err() {
        return Err(failed(&svg, "the font that the program carries is no font"));
    }
    let area = SVGBackend::new(&svg, drawing.size()).into_drawing_area();
    on_white(drawing, &area).map_err(|e| failed(&svg, e))?;
    let (width, height) = drawing.size();
    let mut pixels = vec![0; 3 * width as usize * height as usize];
    let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
    on_white(drawing, &area).map_err(|e| failed(&png, e))?;
    drop(area);
    let bytes = encode(width, height, &pixels).map_err(|e| failed(&png, e))?;
    std::fs::write(&png, bytes).map_err(Error::io(&png, "write"))
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

fn on_white<DB: DrawingBackend>(
    drawing: &impl Drawing,
    area: &DrawingArea<DB, Shift>,
) -> Drawn<DB> {
    area.fill(&WHITE)?;
    drawing.on(area)?;
    area.present()
}

fn failed(path: &Path, why: impl std::fmt::Display) -> Error {
    let remedy = "check that the folder can be written to";
    Error::file(
        path,
        Place::Whole,
        format!("the figure cannot be drawn: {why}"),
        remedy,
    )
}

/// Black text of a size in pixels.
pub fn font(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&BLACK)
}

/// `-3` as `10⁻³`.
pub fn power_of_ten(exponent: i32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let of = |c: char| c.to_digit(10).map_or('⁻', |d| digits[d as usize]);
    let power: String = exponent.to_string().chars().map(of).collect();
    format!("10{power}")
}
