//! The judge: are two results the same?
//!
//! Every field is judged, and its largest difference is located. Values that are not finite, fields that one side
//! lacks, and a file compared with itself never pass. The judge gets meshes and fields, and does not depend on the codes that
//! computed them.
//!
//! ```
//! use faceoff_judge::{Settings, Verdict, compare_results};
//! use faceoff_mesh::io;
//!
//! # fn main() -> faceoff_mesh::Result<()> {
//! let table = |name: &str, text: &str| io::read_results(name.as_ref(), text.as_bytes(), None);
//! let a = table("a.csv", "x,y,u\n0,0,1.0\n1,0,2.0\n")?;
//! // The same points in another order, and a value that differs.
//! let b = table("b.csv", "x,y,u\n1,0,2.5\n0,0,1.0\n")?;
//!
//! let comparison = compare_results(&a, &b, &Settings::default())?;
//! assert_eq!(comparison.verdict, Verdict::Disagree);
//! let u = &comparison.fields[0].field;
//! let worst = u.worst.as_ref().expect("a field with values has a worst position");
//! assert_eq!((u.max_abs, &worst.midpoint[..]), (0.5, &[1.0, 0.0][..]));
//! # Ok(())
//! # }
//! ```

#![warn(missing_docs)]

mod align;
mod cells;
mod column;
mod comparison;
mod faces;
mod groups;
mod judge;
mod keyed;
mod law;
mod many;
mod open;
mod parts;
mod places;
mod results;
mod series;
mod sets;
mod spectrum;
mod supermesh;
pub mod systems;
mod up_to;
mod view;

pub use align::align;
pub use comparison::{
    ComparedField, Comparison, Differences, Intersection, MatchBy, Norms, On, Settings,
};
pub use judge::{FieldVerdict, Verdict, Worst, judge, judge_conditioned, relative_differences};
pub use law::{GivenTolerances, PartialTolerance, Tolerance, Tolerances, are_identical};
pub use many::{Comparisons, Part};
pub use open::{Over, Removed, RemovedPart, UpTo, removed_words};
pub use places::{first_at_place, partners};
pub use results::{at_midpoints, compare_results};
pub use series::{Pairing, Times, interpolate, pair_times};
pub use spectrum::{Matched, clusters, match_spectra, relative};
pub use supermesh::{Exact, Modes, Projection, Size, derive, error_against, project};
pub use up_to::error_up_to;

#[cfg(test)]
mod face_fault_tests;
#[cfg(test)]
mod fault_tests;
#[cfg(test)]
mod file_tests;
#[cfg(test)]
mod up_to_tests;
