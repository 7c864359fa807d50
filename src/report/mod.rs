//! What people and programs read: the table, JSON, and fields as VTU.

mod certified;
mod fields;
mod folder;
mod json;
mod table;

pub use certified::Certified;
pub use fields::{check_vtu_path, prepare_folder, write_fields, write_solution};
pub use folder::{check_report_folder, write_report_folder};
pub use json::{is_stdout, write_json, write_text};
pub use table::table;
