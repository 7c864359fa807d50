//! `faceoff` settles whether finite element codes agree on the Signorini problem, face by face.

pub mod cli;
pub mod diagnose;
pub mod engine;
pub mod orders;
pub mod paper;
pub mod report;
pub mod stress;
pub mod study;
pub mod verify;
