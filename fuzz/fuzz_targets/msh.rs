//! Any bytes as MSH, or as any other format that is recognised by its content: read or refused, and what is read is written and read again.
#![no_main]

use std::path::Path;

use faceoff_mesh::io::{self, msh};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let path = Path::new("input.msh");
    let Ok(content) = io::parse(path, bytes, None) else {
        return;
    };
    assert_eq!(content.mesh.validate(), Ok(()));
    for version in [msh::Version::V22, msh::Version::V41] {
        for binary in [false, true] {
            let options = io::Options {
                msh_version: version,
                binary,
                lossy: true,
                ..io::Options::default()
            };
            let (written, _) =
                msh::to_bytes(path, &content.mesh, &options).expect("what was read is sound");
            let again = io::parse(path, &written, None).expect("what was written is read");
            assert_eq!(again.mesh.points, content.mesh.points);
            assert_eq!(again.mesh.cell_count(), content.mesh.cell_count());
        }
    }
});
