//! What holds of any bytes.

use std::path::Path;

use faceoff_mesh::io;

/// Bytes as a file of this name are read or refused, and what is read is sound.
pub fn sound(name: &str, bytes: &[u8]) {
    if let Ok(content) = io::parse(Path::new(name), bytes, None) {
        assert_eq!(content.mesh.validate(), Ok(()));
    }
}
