//! Exodus II, on netCDF-3 and netCDF-4: meshes and results of Sierra, MOOSE, libMesh, Cubit, …
//!
//! Read are coordinates, element blocks, sets of elements, sides and nodes, each a group with its number and name, the numbers of
//! nodes and elements, and the variables on nodes, elements and the whole at all times. Variables on sets, distribution factors
//! and polyhedra are not, which is reported. Written is netCDF-3 with 64-bit offsets: groups are element blocks or, where they
//! overlap, element sets, and those of lower dimension node sets and side sets where they can be.

mod cells;
mod read;
mod write;

#[cfg(test)]
pub(super) mod tests;

use super::{Native, Read, netcdf};

pub static FORMAT: Native = Native {
    title: "Exodus",
    names: &["exodus"],
    suffixes: &["e", "ex2", "exo"],
    has_binary: true,
    holds_whole: true,
    recognises: netcdf::is_classic,
    read: Read::Steps {
        times: read::times,
        at: read::read,
    },
    write: write::write,
};
