//! VTKHDF, VTK's format on HDF5: unstructured grids and polygonal data in partitions, and their steps of time.
//!
//! Cells, arrays, groups and what else of a mesh VTK has no place for are as in VTU. Where the mesh changes with time, a file is
//! read at one time, and a series at each. Written is an unstructured grid, whose fields may have times.

mod read;
mod write;

use super::{Native, Read};

pub static FORMAT: Native = Native {
    title: "VTKHDF",
    names: &["vtkhdf"],
    suffixes: &["vtkhdf"],
    has_binary: true,
    holds_whole: true,
    // What is HDF5 is known by its root.
    recognises: |_| false,
    read: Read::Steps {
        times: read::times,
        at: read::read,
    },
    write: write::write,
};
