//! `faceoff` settles whether finite element codes agree, face by face. ARCHITECTURE.md is the map.

#![warn(missing_docs)]

pub mod campaigns;
pub mod cli;
pub mod engine;
pub mod report;
pub mod run;
pub mod text;
pub mod why;
