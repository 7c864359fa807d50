//! The Signorini problem by the penalty-free Nitsche method and its neighbours, its exact and mesh-free solutions, and
//! guaranteed bounds of the error of any field.

pub mod adapt;
pub mod assembly;
pub mod certify;
pub mod contact;
pub mod element;
pub mod known;
pub mod linear;
pub mod quadrature;
pub mod scene;
pub mod truth;
