//! The judge: are two results the same? It sees fields on faces and nothing else.

mod align;
mod column;
mod judge;
mod keyed;
mod law;
mod places;
mod results;

pub use align::align;
pub use judge::{FieldVerdict, Verdict, Worst, judge, relative_differences};
pub use law::{GivenTolerances, PartialTolerance, Tolerance, Tolerances, refuse_copies};
pub use results::{ComparedField, Comparison, Differences, Map, On, compare_results};

#[cfg(test)]
mod face_fault_tests;
#[cfg(test)]
mod fault_tests;
