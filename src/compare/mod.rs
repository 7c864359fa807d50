//! The judge: are two results the same? It sees fields on faces and nothing else.

mod align;
mod judge;

pub use align::align;
pub use judge::{FieldVerdict, Verdict, Worst, judge, observed_orders};
