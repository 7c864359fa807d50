//! What people and programs read: the table, JSON, and fields as VTU.

mod annotations;
mod badge;
mod baseline;
mod certified;
mod difference;
mod fields;
mod folder;
mod html;
mod json;
mod junit;
mod table;

pub use annotations::{annotate, annotate_comparison, annotate_failure};
pub use badge::write_badge;
pub use baseline::{check_baseline_folder, write_baseline};
pub use certified::Certified;
pub use difference::write_differences;
pub use fields::{check_vtu_path, prepare_folder, write_fields, write_solution};
pub use folder::{check_report_folder, write_report_folder};
pub use html::write_html;
pub use json::{document, failure, is_stdout, write_json, write_text};
pub use junit::{write_comparison_junit, write_failed_junit, write_junit};
use table::word;
pub use table::{comparison_table, table};
