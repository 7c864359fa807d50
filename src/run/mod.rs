//! Runs of cases, and what follows from their answers.

pub mod orders;
