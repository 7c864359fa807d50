//! Recognises a file by its content; the suffix decides only where the content cannot.

use std::fmt;
use std::path::Path;

use super::{freefem, medit};

/// The formats of meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Msh,
    Vtu,
    /// FreeFEM's own two-dimensional `.msh`.
    FreeFem,
    /// Medit's ASCII `.mesh`.
    Medit,
    /// Read and written by meshio, which has this name for it.
    Meshio(&'static str),
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Format::Msh => "Gmsh's MSH",
            Format::Vtu => "VTU",
            Format::FreeFem => "FreeFEM's .msh",
            Format::Medit => "Medit",
            Format::Meshio(name) => name,
        })
    }
}

/// Suffixes of the formats that meshio reads and writes, with its names for them.
const SUFFIXES: [(&str, &str); 31] = [
    ("avs", "avsucd"),
    ("bdf", "nastran"),
    ("cgns", "cgns"),
    ("dat", "tecplot"),
    ("dato", "permas"),
    ("e", "exodus"),
    ("ele", "tetgen"),
    ("ex2", "exodus"),
    ("exo", "exodus"),
    ("f3grid", "flac3d"),
    ("fem", "nastran"),
    ("h5m", "h5m"),
    ("hmf", "hmf"),
    ("inp", "abaqus"),
    ("mdpa", "mdpa"),
    ("med", "med"),
    ("meshb", "medit"),
    ("nas", "nastran"),
    ("node", "tetgen"),
    ("obj", "obj"),
    ("off", "off"),
    ("ply", "ply"),
    ("post", "permas"),
    ("stl", "stl"),
    ("su2", "su2"),
    ("tec", "tecplot"),
    ("ugrid", "ugrid"),
    ("vol", "netgen"),
    ("vtk", "vtk"),
    ("xdmf", "xdmf"),
    ("xml", "dolfin-xml"),
];

impl Format {
    /// The format that belongs to the suffix of a path.
    pub fn of_suffix(path: &Path) -> Option<Format> {
        let suffix = path.extension()?.to_str()?.to_ascii_lowercase();
        match suffix.as_str() {
            "msh" => Some(Format::Msh),
            "vtu" | "pvtu" => Some(Format::Vtu),
            "mesh" => Some(Format::Medit),
            "xmf" => Some(Format::Meshio("xdmf")),
            _ => SUFFIXES
                .iter()
                .find(|(known, _)| *known == suffix)
                .map(|(_, name)| Format::Meshio(name)),
        }
    }

    /// The format of this name: `msh`, `vtu`, `freefem`, `medit`, or one of meshio's names.
    pub fn of_name(name: &str) -> Option<Format> {
        match name {
            "msh" | "gmsh" => Some(Format::Msh),
            "vtu" => Some(Format::Vtu),
            "freefem" => Some(Format::FreeFem),
            "medit" => Some(Format::Medit),
            "ansys" => Some(Format::Meshio("ansys")),
            _ => SUFFIXES
                .iter()
                .find(|(_, known)| *known == name)
                .map(|(_, name)| Format::Meshio(name)),
        }
    }
}

/// The format of a file.
pub fn recognise(path: &Path, bytes: &[u8]) -> Option<Format> {
    let text = start(bytes);
    let begins = |word: &str| {
        text.get(..word.len())
            .is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
    };
    if [
        "$MeshFormat",
        "$NOD",
        "$Comments",
        "$PhysicalNames",
        "$Nodes",
    ]
    .iter()
    .any(|word| begins(word))
    {
        return Some(Format::Msh);
    }
    if medit::recognises(bytes) {
        return Some(Format::Medit);
    }
    if begins("<") {
        let head = text.get(..text.len().min(4096)).unwrap_or_default();
        let has = |word: &str| memchr::memmem::find(head, word.as_bytes()).is_some();
        return match () {
            () if has("<VTKFile") && has("UnstructuredGrid") => Some(Format::Vtu),
            () if has("<Xdmf") => Some(Format::Meshio("xdmf")),
            () if has("<dolfin") => Some(Format::Meshio("dolfin-xml")),
            () => None,
        };
    }
    let signatures = [
        ("# vtk DataFile", "vtk"),
        ("(0 ", "ansys"),
        ("(1 ", "ansys"),
        ("(2 ", "ansys"),
        ("*HEADING", "abaqus"),
        ("*NODE", "abaqus"),
        ("solid ", "stl"),
        ("ply\n", "ply"),
        ("OFF", "off"),
        ("mesh3d", "netgen"),
        ("NDIME", "su2"),
        ("CDF", "exodus"),
    ];
    if let Some((_, name)) = signatures.iter().find(|(word, _)| begins(word)) {
        return Some(Format::Meshio(name));
    }
    if freefem::recognises(bytes) {
        return Some(Format::FreeFem);
    }
    // Formats known by their suffix alone; a .msh or .mesh that gets here is not what its suffix says.
    match Format::of_suffix(path) {
        Some(Format::Meshio(name)) => Some(Format::Meshio(name)),
        _ => None,
    }
}

/// Describes a file of unknown format.
pub fn unknown(bytes: &[u8]) -> String {
    let text = start(bytes);
    let what = if text.is_empty() {
        "the file is empty".into()
    } else if text.starts_with(b"\x89HDF") {
        "this is an HDF5 file, whose suffix does not say which mesh format it holds".into()
    } else if text.starts_with(b"<VTKFile")
        || memchr::memmem::find(text, b"<VTKFile").is_some_and(|at| at < 4096)
    {
        "this is a VTK XML file, but not of an unstructured grid".into()
    } else if text.starts_with(b"<") {
        "this is an XML file of some other kind".into()
    } else if text.starts_with(b"\x1f\x8b") || text.starts_with(b"PK") {
        "this is a compressed file: unpack it first".into()
    } else if bytes.starts_with(&[1, 0, 0, 0]) || bytes.starts_with(&[0, 0, 0, 1]) {
        "this may be a binary Medit file, whose suffix is .meshb".into()
    } else if text
        .iter()
        .take(400)
        .all(|byte| byte.is_ascii_digit() || b" \t\r\n.+-eE".contains(byte))
    {
        "this is a table of numbers, but not FreeFEM's .msh, which starts with three counts that fit the file".into()
    } else {
        let line = text.split(|&byte| byte == b'\n').next().unwrap_or_default();
        let line = String::from_utf8_lossy(line.get(..line.len().min(60)).unwrap_or_default())
            .into_owned();
        format!("this is not a known mesh format; it starts with {line:?}")
    };
    format!("not a mesh that can be read: {what}")
}

/// The bytes after a byte order mark and blanks.
fn start(bytes: &[u8]) -> &[u8] {
    bytes
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(bytes)
        .trim_ascii_start()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_goes_before_suffix() {
        let cases: [(&str, &[u8], Option<Format>); 9] = [
            ("a.msh", b"$MeshFormat\n4.1 0 8\n", Some(Format::Msh)),
            ("a.txt", b"\n$NOD\n1\n", Some(Format::Msh)),
            (
                "a.msh",
                b"3 1 0\n0 0 1\n1 0 1\n0 1 1\n1 2 3 0\n",
                Some(Format::FreeFem),
            ),
            (
                "a.msh",
                b"(0 \"GAMBIT to Fluent File\")\n",
                Some(Format::Meshio("ansys")),
            ),
            ("a.mesh", b"\nMeshVersionFormatted 2\n", Some(Format::Medit)),
            (
                "a.xml",
                b"<?xml version=\"1.0\"?><VTKFile type=\"UnstructuredGrid\">",
                Some(Format::Vtu),
            ),
            (
                "a.bdf",
                b"$ a comment\nGRID,1\n",
                Some(Format::Meshio("nastran")),
            ),
            ("a.msh", b"0.5 0.1 0.2\n0.3 0.2 0.1\n", None),
            ("a.msh", b"", None),
        ];
        for (path, bytes, format) in cases {
            assert_eq!(
                recognise(Path::new(path), bytes),
                format,
                "{path} {}",
                String::from_utf8_lossy(bytes)
            );
        }
        assert!(unknown(b"0.5 0.1 0.2\n").contains("table of numbers"));
    }
}
