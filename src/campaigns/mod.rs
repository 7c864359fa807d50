//! Campaigns decide what to run, and draw conclusions from the answers.

pub mod conformance;
pub mod face_off;
pub mod hunt;
pub mod matrix;
pub mod orders;
pub mod paper;
pub mod stress;
pub mod study;
pub mod verify;
