//! Recognises a file by its content; the suffix decides only where the content cannot.

use std::path::Path;

use super::{Format, NATIVE, hdf5};

/// Suffixes of the formats that meshio reads and writes, with its names for them.
const SUFFIXES: [(&str, &str); 13] = [
    ("dat", "tecplot"),
    ("dato", "permas"),
    ("ele", "tetgen"),
    ("f3grid", "flac3d"),
    ("h5m", "h5m"),
    ("hmf", "hmf"),
    ("mdpa", "mdpa"),
    ("node", "tetgen"),
    ("post", "permas"),
    ("tec", "tecplot"),
    ("ugrid", "ugrid"),
    ("vol", "netgen"),
    ("xml", "dolfin-xml"),
];

impl Format {
    /// The format that belongs to the suffix of a path.
    pub fn of_suffix(path: &Path) -> Option<Format> {
        let suffix = path.extension()?.to_str()?.to_ascii_lowercase();
        let suffix = suffix.as_str();
        let native = NATIVE.iter().find(|known| known.suffixes.contains(&suffix));
        native.map(|native| Format::Native(native)).or_else(|| {
            let known = SUFFIXES.iter().find(|(known, _)| *known == suffix);
            known.map(|(_, name)| Format::Meshio(name))
        })
    }

    /// The format of this name: a native one's, or one of meshio's.
    pub fn of_name(name: &str) -> Option<Format> {
        let native = NATIVE.iter().find(|known| known.names.contains(&name));
        native.map(|native| Format::Native(native)).or_else(|| {
            let mut names = SUFFIXES.iter().map(|(_, name)| *name).chain(["ansys"]);
            names.find(|known| *known == name).map(Format::Meshio)
        })
    }
}

/// The format of a file.
pub fn recognise(path: &Path, bytes: &[u8]) -> Option<Format> {
    if hdf5::is_hdf5(bytes) {
        return of_hdf5(path, bytes).or_else(|| {
            Format::of_suffix(path).filter(|format| matches!(format, Format::Meshio(_)))
        });
    }
    if let Some(native) = NATIVE.iter().find(|known| (known.recognises)(bytes)) {
        return Some(Format::Native(native));
    }
    if begins(bytes, "<") {
        return match () {
            () if head_has(bytes, "<dolfin") => Some(Format::Meshio("dolfin-xml")),
            () => None,
        };
    }
    let signatures = [
        ("(0 ", "ansys"),
        ("(1 ", "ansys"),
        ("(2 ", "ansys"),
        ("mesh3d", "netgen"),
    ];
    if let Some((_, name)) = signatures.iter().find(|(word, _)| begins(bytes, word)) {
        return Some(Format::Meshio(name));
    }
    // Formats known only by their suffix; a .msh or .mesh that gets here is not of the format of its suffix.
    Format::of_suffix(path).filter(|format| matches!(format, Format::Meshio(_)))
}

/// The objects in the root of an HDF5 file, and the format that they identify.
const ROOTS: [(&str, &str); 6] = [
    ("CGNSLibraryVersion", "cgns"),
    ("VTKHDF", "vtkhdf"),
    ("ENS_MAA", "med"),
    ("INFOS_GENERALES", "med"),
    ("num_nodes", "exodus"),
    ("coordx", "exodus"),
];

/// The format of an HDF5 file, which its root identifies and its suffix does not.
fn of_hdf5(path: &Path, bytes: &[u8]) -> Option<Format> {
    let (groups, data) = hdf5::open(path, bytes).and_then(|root| root.names()).ok()?;
    let known = |(name, _): &&(&str, &str)| groups.iter().chain(&data).any(|found| found == name);
    ROOTS
        .iter()
        .find(known)
        .and_then(|(_, format)| Format::of_name(format))
}

/// The contents of an HDF5 file of unknown format.
fn unknown_hdf5(bytes: &[u8]) -> String {
    let names = hdf5::open(Path::new(""), bytes).and_then(|root| root.names());
    let Ok((groups, data)) = names else {
        return "this is an HDF5 file, but a damaged one".into();
    };
    let all: Vec<String> = groups
        .into_iter()
        .chain(data)
        .take(8)
        .map(|name| format!("{name:?}"))
        .collect();
    format!(
        "this is an HDF5 file of no known kind (Exodus, MED, CGNS, VTKHDF); its root has {}. If these are the data of an XDMF \
         file, give that: it says what they are",
        if all.is_empty() {
            "nothing".into()
        } else {
            all.join(", ")
        }
    )
}

/// Describes a file of unknown format.
pub fn unknown(bytes: &[u8]) -> String {
    let text = start(bytes);
    let what = if text.is_empty() {
        "the file is empty".into()
    } else if hdf5::is_hdf5(bytes) {
        unknown_hdf5(bytes)
    } else if head_has(bytes, "<VTKFile") {
        "this is a VTK XML file, but not of an unstructured grid".into()
    } else if text.starts_with(b"<") {
        "this is an XML file of some other kind".into()
    } else if text.starts_with(b"\x1f\x8b") || text.starts_with(b"PK") {
        "this is a compressed file: unpack it first".into()
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

/// Whether a file begins with this word, in any case, after a byte order mark and blanks.
pub fn begins(bytes: &[u8], word: &str) -> bool {
    start(bytes)
        .get(..word.len())
        .is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
}

/// The first line that is not empty and does not begin with this mark of a comment, without blanks around it.
pub fn first_line<'a>(bytes: &'a [u8], comment: &[u8]) -> &'a [u8] {
    let mut lines = bytes.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(comment));
    first.unwrap_or_default()
}

/// Whether a word is among the first few thousand bytes.
pub fn head_has(bytes: &[u8], word: &str) -> bool {
    let text = start(bytes);
    let head = text.get(..text.len().min(4096)).unwrap_or_default();
    memchr::memmem::find(head, word.as_bytes()).is_some()
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
        let native = |name| Format::of_name(name);
        let cases: [(&str, &[u8], Option<Format>); 9] = [
            ("a.msh", b"$MeshFormat\n4.1 0 8\n", native("msh")),
            ("a.txt", b"\n$NOD\n1\n", native("msh")),
            (
                "a.msh",
                b"3 1 0\n0 0 1\n1 0 1\n0 1 1\n1 2 3 0\n",
                native("freefem"),
            ),
            (
                "a.msh",
                b"(0 \"GAMBIT to Fluent File\")\n",
                Some(Format::Meshio("ansys")),
            ),
            ("a.mesh", b"\nMeshVersionFormatted 2\n", native("medit")),
            (
                "a.xml",
                b"<?xml version=\"1.0\"?><VTKFile type=\"UnstructuredGrid\">",
                native("vtu"),
            ),
            ("a.bdf", b"$ a comment\nGRID,1\n", native("nastran")),
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
