//! The Signorini problem by the penalty-free Nitsche method and its neighbours, its exact and mesh-free solutions, and
//! guaranteed bounds of the error of any field.
//!
//! A [`scene::Scene`] is a problem, a [`contact::Discretisation`] defines how it is discretised, and both on a mesh are a
//! [`contact::Problem`], which [`contact::solve`] solves. [`certify::certify`] bounds the error.
//!
//! ```
//! use faceoff_fem::certify::{Target, certify};
//! use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, solve};
//! use faceoff_fem::scene::Scene;
//!
//! # fn main() -> faceoff_mesh::Result<()> {
//! let scene = Scene::find("one-zone")?;
//! let mesh = scene.triangulation(Some(16))?;
//! let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr()))?;
//! let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))?;
//! assert!(solution.converged);
//!
//! let relative = certify(&problem, &solution.u)?.relative(Target::G);
//! assert!(relative < 0.2, "an error of at most {relative}, relative to the norm of the gradient");
//! # Ok(())
//! # }
//! ```

#![warn(missing_docs)]

pub mod adapt;
pub mod assembly;
pub mod certify;
pub mod contact;
pub mod element;
pub mod interval;
pub mod known;
pub mod linear;
pub mod quadrature;
pub mod scene;
#[cfg(test)]
mod sixty_digits;
pub mod truth;

/// Random tests see the same values on every day and machine; `FACEOFF_SEED` asks for others (see tests/run).
#[cfg(test)]
fn test_config(cases: u32) -> proptest::test_runner::Config {
    let seed = std::env::var("FACEOFF_SEED").map_or(2017, |seed| {
        seed.parse().expect("FACEOFF_SEED is an integer")
    });
    proptest::test_runner::Config {
        cases,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(seed),
        ..proptest::test_runner::Config::default()
    }
}

/// `FACEOFF_SEED` asks for other scenes than the usual, `FACEOFF_SCENES` for that many times as many, as `tests/run --all` does.
#[cfg(test)]
fn asked_for() -> (u64, u64) {
    let number = |name: &str, usual: u64| {
        std::env::var(name).map_or(usual, |text| text.parse().expect("an integer"))
    };
    (number("FACEOFF_SEED", 1), number("FACEOFF_SCENES", 1))
}

/// Random numbers of tests that draw their own: xorshift, the same on every machine.
#[cfg(test)]
struct Random(u64);

#[cfg(test)]
impl Random {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        // Neighbouring seeds begin alike.
        (0..8).for_each(|_| {
            random.next();
        });
        random
    }

    /// In [0, 1).
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
