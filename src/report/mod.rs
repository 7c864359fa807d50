//! What people and programs read, from one model of a report: the page, the terminal, JSON, JUnit, badges, annotations;
//! and fields as VTU.

mod annotations;
mod badge;
mod baseline;
mod certified;
mod compare;
pub mod console;
mod deliver;
mod difference;
mod drawing;
mod fields;
mod folder;
mod html;
mod json;
mod junit;
pub mod model;
mod orders;
mod paper;
mod provenance;
mod solve;
mod stress;
mod study;
mod text;
mod verify;

pub use baseline::{check_baseline_folder, write_baseline};
pub use certified::Certified;
pub use compare::compare;
pub use deliver::{Output, deliver};
pub use difference::write_differences;
pub use fields::{check_vtu_path, write_fields, write_solution};
pub use orders::orders;
pub use paper::{paper, references};
pub use solve::{Answer, solve};
pub use stress::stress;
pub use study::study;
pub use verify::{Verified, verify};
