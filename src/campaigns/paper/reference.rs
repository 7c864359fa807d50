//! The mesh-free reference for scripts; its JSON form is a contract.

use serde::ser::{Serialize, Serializer};

use super::{Example, ZONES};
use faceoff_fem::truth::Reference;
use faceoff_mesh::error::Result;

/// Samples of u are on a grid of this many intervals in each direction, including the sides.
const GRID: u32 = 16;

/// The mesh-free solution of one example.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Known {
    /// The contact intervals of x on y = 0, ascending.
    pub contact_set: Vec<[f64; 2]>,
    /// ‖∇u‖²
    pub grad_norm_sq: f64,
    /// ‖u‖
    pub l2_norm: f64,
    /// <∂ₙu, 1>_C
    pub contact_flux: f64,
    /// u on a uniform grid of the unit square; x runs faster than y.
    pub samples: Vec<Sample>,
}

/// u at a point.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Sample {
    pub x: f64,
    pub y: f64,
    pub u: f64,
}

impl Known {
    fn new(truth: &Reference) -> Self {
        let grid = || (0..=GRID).map(|k| f64::from(k) / f64::from(GRID));
        let samples = grid().flat_map(|y| grid().map(move |x| (x, y)));
        Known {
            contact_set: truth.contact_set.clone(),
            grad_norm_sq: truth.grad_norm_sq,
            l2_norm: truth.l2_norm,
            contact_flux: truth.contact_flux,
            samples: samples
                .map(|(x, y)| Sample {
                    x,
                    y,
                    u: truth.u(x, y),
                })
                .collect(),
        }
    }
}

/// The references by name: a map in JSON.
#[derive(Debug, Clone)]
pub struct References(pub Vec<(String, Known)>);

impl References {
    /// `one-zone`, `three-zones` and `five-zones`, and `zones-N` for each N given.
    ///
    /// # Errors
    /// Errors of [`Example::zones`].
    pub fn new(zones: &[u32]) -> Result<Self> {
        let mut all = Vec::new();
        let paper = ZONES.iter().map(|&n| Example::zones(n));
        for example in std::iter::once(Example::one_zone()).chain(paper) {
            let example = example?;
            all.push((example.scene.name().to_owned(), Known::new(&example.truth)));
        }
        for &n in zones {
            all.push((format!("zones-{n}"), Known::new(&Example::zones(n)?.truth)));
        }
        Ok(References(all))
    }
}

impl Serialize for References {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, known)| (name, known)))
    }
}
