//! What people and programs read: the table, JSON, and fields as VTU.

mod fields;
mod json;
mod table;

pub use fields::{check_vtu_path, prepare_folder, write_fields, write_solution};
pub use json::{is_stdout, write_json};
pub use table::table;
