//! Results of two meshes of one domain, compared as functions on the intersection of the meshes.

mod clip;
mod derived;
mod domain;
mod element;
mod exact;
mod frame;
mod free;
mod function;
mod geometry;
mod gram;
mod judged;
mod map;
mod moments;
mod norms;
mod overlay;
mod project;
mod rule;
mod small;
mod tree;

#[cfg(test)]
mod tests;

pub(crate) use clip::{measure, subtract};
pub use derived::derive;
pub use exact::{Exact, Size, error_against};
pub(crate) use free::{Carried, Known};
pub use gram::Modes;
pub(crate) use judged::judge_functions;
pub(crate) use norms::norms_on_mesh;
pub use project::{Projection, project};
pub(crate) use small::{Linear, Products};
