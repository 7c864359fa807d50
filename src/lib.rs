//! `faceoff` settles whether finite element codes agree on the Signorini problem, face by face.
//!
//! Imports point one way; the order of the modules below is the order of the layers.

pub mod adapt;
pub mod assembly;
pub mod certify;
pub mod cli;
pub mod compare;
pub mod contact;
pub mod diagnose;
pub mod drawing;
pub mod element;
pub mod engine;
pub mod error;
pub mod field;
pub mod io;
pub mod linear;
pub mod mesh;
pub mod orders;
pub mod paper;
pub mod quadrature;
pub mod report;
pub mod scene;
pub mod stress;
pub mod study;
pub mod truth;
pub mod verify;

pub use error::{Error, Result};
