//! The request for the paper's examples.

use super::Example;
use crate::engine::{Engine, Settings};

/// The examples and meshes to run.
pub struct PaperRequest {
    /// 6.1 first.
    pub examples: Vec<Example>,
    /// Meshes for CR, ascending.
    pub n: Vec<usize>,
    /// The mesh of the P2 reference, a multiple of 4, since those with n/2 and n/4 are solved as well.
    pub fine: usize,
    /// The codes that solve with CR.
    pub engines: Vec<Box<dyn Engine>>,
    /// The settings of every solve.
    pub settings: Settings,
}
