//! What is asked of the paper's examples.

use super::Example;
use crate::engine::{Engine, Settings};

/// What is to be run.
pub struct PaperRequest {
    /// 6.1 first.
    pub examples: Vec<Example>,
    /// Meshes for CR, rising.
    pub n: Vec<usize>,
    /// The mesh of the P2 reference, a multiple of 4: half and a quarter of it are solved as well.
    pub fine: usize,
    /// The codes that solve with CR.
    pub engines: Vec<Box<dyn Engine>>,
    /// Of every solve.
    pub settings: Settings,
}
