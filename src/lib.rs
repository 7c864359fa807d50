//! `faceoff` settles whether finite element codes agree on the Signorini problem, face by face.
//!
//! Imports point one way; the order of the modules below is the order of the layers.

pub mod cli;
pub mod error;
pub mod field;
pub mod io;
pub mod mesh;

pub use error::{Error, Result};
