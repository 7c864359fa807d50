//! Any bytes as legacy VTK: read or refused, and what is read is sound.
#![no_main]

use std::path::Path;

use faceoff_mesh::io;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(content) = io::parse(Path::new("input.vtk"), bytes, None) {
        assert_eq!(content.mesh.validate(), Ok(()));
    }
});
