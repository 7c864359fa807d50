//! Weak forms in UFL's words: read, checked, lowered to scalars and written as scripts for finite element codes.
//!
//! A form file has spaces, data, a form F and the values that are held on parts of the boundary. [`Problem::parse`] checks all of
//! it, [`Problem::residual`] and [`Problem::derivative`] are what Newton's method needs, and a [`codes::Code`] makes a script of it that
//! runs alone.

#![warn(missing_docs)]

pub mod codes;

pub mod file;
pub mod language;
pub mod problem;
pub mod scalar;
mod swap;

pub use file::is_form;
pub use problem::Problem;
