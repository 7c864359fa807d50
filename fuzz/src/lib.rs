//! What holds of any bytes.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use faceoff_mesh::io;

/// Bytes as a file of this name are read or refused, and what is read is sound.
pub fn sound(name: &str, bytes: &[u8]) {
    if let Ok(content) = io::parse(Path::new(name), bytes, None) {
        assert_eq!(content.mesh.validate(), Ok(()));
    }
}

/// Bytes as a file of results of this name are read or refused; a mesh of two triangles is beside it, and as a piece of a list.
pub fn results(name: &str, bytes: &[u8]) {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("faceoff-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let mesh = "MeshVersionFormatted 2 Dimension 2 Vertices 4 0 0 0 1 0 0 1 1 0 0 1 0 \
                    Triangles 2 1 2 3 1 1 3 4 1 End";
        std::fs::write(folder.join("input.mesh"), mesh).expect("written");
        let mesh = io::read(&folder.join("input.mesh")).expect("sound");
        io::write(&folder.join("piece.vtu"), &mesh, &io::Options::default()).expect("written");
        folder
    });
    let path = folder.join(name);
    // Lists are read from the file.
    std::fs::write(&path, bytes).expect("written");
    drop(io::read_results(&path, bytes, None));
}
