//! Weak forms of partial differential equations, written once in the notation of UFL and translated into scripts for several finite
//! element codes.
//!
//! A form file is TOML: the spaces of the unknowns, data, a form F(u; v) that vanishes for all test functions v, and Dirichlet values.
//! [`Problem::parse`] reads and checks it, with line and column in every message; [`Problem::residual`] and [`Problem::derivative`] are
//! the two parts of Newton's method, as scalar expressions; and a [`codes::Code`] writes an independent script.
//!
//! ```
//! use std::path::Path;
//!
//! use faceoff_form::{Problem, codes::Code};
//! use faceoff_mesh::mesh::generate::union_jack;
//!
//! # fn main() -> faceoff_mesh::Result<()> {
//! let text = r#"
//! name = "poisson"
//! [spaces]
//! u = "P2"
//! [form]
//! F = "inner(grad(u), grad(v))*dx - x*v*dx"
//! [dirichlet]
//! left = 0
//! "#;
//! let problem = Problem::parse(Path::new("poisson.toml"), text, &union_jack(4, [1.0, 1.0]))?;
//! let freefem = Code::of_name("freefem").expect("it is in the list");
//! let script = freefem.script(&problem).expect("FreeFEM has P2");
//! assert!(script.contains("fespace Vh(Th, P2);"));
//!
//! let wrong = text.replace("x*v*dx", "f*v*dx");
//! let error = Problem::parse(Path::new("poisson.toml"), &wrong, &union_jack(4, [1.0, 1.0])).unwrap_err();
//! assert!(error.to_string().starts_with("poisson.toml:6:35: `f` is not known"));
//! # Ok(())
//! # }
//! ```

#![warn(missing_docs)]

pub mod codes;
mod eigen;
pub mod elastic;
pub mod file;
pub mod grid;
pub mod image;
pub mod judge;
mod kernel;
pub mod language;
pub mod own;
pub mod problem;
pub mod random;
pub mod scalar;
mod swap;

pub use file::is_form;
pub use problem::Problem;
