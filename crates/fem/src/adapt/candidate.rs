//! Meshes to solve on: the scene's own at some n, or parts of triangles.

use super::plan::{Spread, bisections};
use super::{AIM, COARSE, FURTHEST, MOST, Step, Way, Wish};
use crate::scene::{LARGEST_N, MeshSource, Scene};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::Triangulation;
use faceoff_mesh::mesh::bisect::{at_longest_edges, bisect};

/// A mesh, how it was made, and how long that took.
pub(super) struct Candidate {
    pub mesh: Triangulation,
    pub way: Way,
    pub n: Option<usize>,
    pub seconds: f64,
}

/// Where to begin: coarse, but not so coarse that nothing is seen. A file's own mesh is as coarse as it gets.
pub(super) fn first_n(scene: &Scene) -> Option<usize> {
    match scene.source() {
        MeshSource::Union { n, cuboid } => {
            let coarse = if cuboid.dim == 3 { 4 } else { 8 };
            // Sides that are split need a vertex there, which the scene's own n has.
            let fits = |n: &usize| scene.has_mesh(*n);
            Some(Some(coarse).filter(fits).unwrap_or(*n))
        }
        other => other.n(),
    }
}

/// The order of the bound of G in n where none is seen yet.
const USUAL: f64 = 1.5;

/// The n of a mesh between the last one and one far beyond is smaller than the latter's by this factor: 4 % of its cells in 3D.
const NEARER: f64 = 3.0;

/// n and the relative bound on uniform meshes.
fn uniform(steps: &[Step]) -> Vec<(f64, f64)> {
    let of = |step: &Step| Some((step.n? as f64, step.relative));
    steps.iter().filter_map(of).collect()
}

/// The order of the bound in n on the last two uniform meshes.
pub(super) fn order(steps: &[Step]) -> Option<f64> {
    match uniform(steps)[..] {
        [.., (coarse, before), (n, relative)] => Some((before / relative).ln() / (n / coarse).ln()),
        _ => None,
    }
}

/// The n that is predicted to reach the accuracy from the last uniform mesh, with the order seen so far.
pub(super) fn needed_n(wish: &Wish, steps: &[Step]) -> f64 {
    let Some(&(n, relative)) = uniform(steps).last() else {
        return 1.0;
    };
    let order = order(steps).map_or(USUAL, |order| order.clamp(0.25, 2.0));
    n * (relative / (AIM * wish.accuracy)).powf(1.0 / order)
}

/// The n of the next uniform mesh. One far beyond the last has a mesh between, where the order is seen better at little cost.
pub(super) fn next_n(wish: &Wish, steps: &[Step]) -> usize {
    let needed = needed_n(wish, steps);
    let Some(&(n, relative)) = uniform(steps).last() else {
        return 1;
    };
    let furthest = FURTHEST * n;
    // A tolerance that no mesh reaches is reported immediately, if a rate can be seen.
    let is_possible = relative > COARSE || needed <= LARGEST_N as f64;
    let next = if is_possible && needed > furthest {
        furthest.min(needed / NEARER)
    } else {
        needed.min(1e9)
    };
    next.ceil().max(n + 1.0) as usize
}

impl Candidate {
    pub fn uniform(scene: &Scene, n: Option<usize>) -> Result<Self> {
        Ok(Candidate {
            mesh: scene.triangulation(n)?,
            way: Way::Uniform,
            n,
            seconds: 0.0,
        })
    }

    /// The first n from this one on that the scene has a mesh for.
    pub fn uniform_from(scene: &Scene, n: usize) -> Result<Self> {
        let n = match scene.source() {
            MeshSource::Union { n: own, .. } => {
                let candidates = [n, n.next_multiple_of(2), n.next_multiple_of(4)];
                let fits = |n: &&usize| scene.has_mesh(**n);
                let found = candidates.iter().find(fits).copied();
                found.unwrap_or(n.next_multiple_of(*own))
            }
            other => {
                let own = other.n().ok_or_else(|| Error::Scene {
                    scene: scene.name().to_owned(),
                    place: "mesh.n".into(),
                    what: "the mesh file has no n, so that it is unknown which finer one to make"
                        .into(),
                    remedy: "give it one, as in n = 8".into(),
                })?;
                let mut fine = own;
                while fine < n {
                    fine *= 2;
                }
                fine
            }
        };
        Candidate::uniform(scene, Some(n))
    }

    /// Ready for bisection.
    pub fn turned(self) -> Result<Self> {
        let mesh = at_longest_edges(&self.mesh)?;
        Ok(Candidate {
            mesh: Triangulation::new(&self.mesh.name, &mesh)?,
            way: Way::Adaptive,
            n: None,
            seconds: self.seconds,
        })
    }

    /// Bisected so that the sum of the squares is predicted to become `goal`.
    pub fn adapted(&self, squares: &[f64], spread: Spread, goal: f64) -> Result<Self> {
        let name = format!("{} adapted", self.mesh.name.trim_end_matches(" adapted"));
        let mut mesh = match self.way {
            Way::Uniform => Triangulation::new(&name, &at_longest_edges(&self.mesh)?)?,
            Way::Adaptive => self.mesh.clone(),
        };
        let mut left = bisections(squares, spread, goal, MOST);
        // Near the goal nobody may want to be first.
        if left.iter().all(|times| *times == 0) {
            let largest = squares.iter().fold(0.0, |m: f64, s| m.max(*s));
            for (left, square) in left.iter_mut().zip(squares) {
                *left = u8::from(*square > 0.25 * largest);
            }
        }
        while left.iter().any(|times| *times > 0) {
            let marked: Vec<bool> = left.iter().map(|times| *times > 0).collect();
            let (finer, origins) = bisect(&mesh, &marked)?;
            left = origins
                .iter()
                .map(|&(whole, times)| left[whole as usize].saturating_sub(times))
                .collect();
            mesh = Triangulation::new(&name, &finer)?;
        }
        Ok(Candidate {
            mesh,
            way: Way::Adaptive,
            n: None,
            seconds: 0.0,
        })
    }
}
