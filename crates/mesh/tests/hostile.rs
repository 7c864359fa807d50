//! Files of every format that are cut short or changed: a mesh or words, no panic, no more memory than a file of that size
//! deserves, and no long time. A format takes part by a line in `samples`.

use std::path::Path;

use faceoff_mesh::io;
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Polyhedra, Support, Values};

/// Cells of many kinds with data.
fn mesh(surface: bool) -> Mesh {
    let mut blocks = vec![
        CellBlock::new(CellKind::Vertex, vec![3]),
        CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
        CellBlock::new(CellKind::Triangle, vec![0, 1, 2, 2, 1, 3]),
        CellBlock::new(CellKind::Polygon(5), vec![0, 1, 2, 3, 4]),
    ];
    let mut polyhedra = Polyhedra::default();
    if !surface {
        let cubic = CellKind::complete(CellKind::Triangle.shape(), 3).expect("cubic");
        blocks.push(CellBlock::new(cubic, (0..10).collect()));
        blocks.push(CellBlock::new(CellKind::Polyhedron(4), vec![0, 1, 2, 3]));
        assert!(polyhedra.push([3, 0, 1, 2, 3, 0, 1, 3, 3, 1, 2, 3, 3, 0, 2, 3]));
    }
    let cells: usize = blocks.iter().map(CellBlock::len).sum();
    Mesh {
        points: (0..10)
            .map(|k| [f64::from(k), f64::from(k * k % 5), 0.5])
            .collect(),
        blocks,
        polyhedra,
        fields: vec![
            Field::new("u", Support::Points, 1, Values::F64(vec![0.5; 10].into())),
            Field::new(
                "k",
                Support::Cells,
                1,
                Values::I32((0..cells as i32).collect()),
            ),
        ],
        ..Mesh::default()
    }
}

const POLY: &str = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n\
    LINES 1 5\n4 0 1 2 3\nPOLYGONS 2 8\n3 0 1 2 3 0 2 3\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\nCELL_DATA 4\nSCALARS s int 1\n\
    LOOKUP_TABLE default\n1 2 3 4\nPOINT_DATA 4\nCOLOR_SCALARS c 2\n0 1 0 1 0 1 0.5 1\nFIELD f 1\nw 1 4 string\na\nb\nc\nd\n";
const IMAGE: &str = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 0 0 0\n\
    SPACING 1 1 2\nPOINT_DATA 12\nVECTORS v float\n0 0 0 1 1 1 2 2 2 3 3 3 4 4 4 5 5 5 6 6 6 7 7 7 8 8 8 9 9 9 0 0 0 1 1 1\n";
const SPLIT: &str = "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n\
    METADATA\nINFORMATION 0\n\nCELLS 3 7\nOFFSETS vtktypeint64\n0 4 7\nCONNECTIVITY vtktypeint64\n0 1 2 3 0 1 2\n\
    CELL_TYPES 2\n10\n5\n";
const VTI: &str = "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 2 0 1 0 0\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\
    <Piece Extent=\"0 2 0 1 0 0\"><PointData><DataArray type=\"Int8\" Name=\"a\">1 2 3 4 5 6</DataArray></PointData>\
    </Piece></ImageData></VTKFile>";

/// Names, whose suffix gives the format, and bytes.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let folder = tempfile::tempdir().expect("a folder");
    let written = |name: &str, surface, binary, vtu| {
        let path = folder.path().join(name);
        let options = io::Options {
            binary,
            vtu,
            lossy: true,
            ..io::Options::default()
        };
        io::write(&path, &mesh(surface), &options).expect("written");
        std::fs::read(path).expect("there")
    };
    let raw = Encoding::Raw(Compressor::Zlib);
    vec![
        ("a.vtu", written("a.vtu", false, false, Encoding::Ascii)),
        ("b.vtu", written("b.vtu", false, true, raw)),
        (
            "a.vtp",
            written("a.vtp", true, false, Encoding::Base64(Compressor::None)),
        ),
        ("a.vtk", written("a.vtk", false, false, raw)),
        ("b.vtk", written("b.vtk", false, true, raw)),
        ("a.e", written("a.e", true, true, raw)),
        ("a.vtkhdf", written("a.vtkhdf", true, true, raw)),
        ("a.med", written("a.med", true, true, raw)),
        ("a.cgns", written("a.cgns", true, true, raw)),
        ("poly.vtk", POLY.into()),
        ("image.vtk", IMAGE.into()),
        ("split.vtk", SPLIT.into()),
        ("a.vti", VTI.into()),
    ]
}

/// The peak memory of this process, in kB.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    number.expect("a number")
}

#[test]
fn a_file_that_is_cut_short_or_changed_is_no_panic_and_takes_little() {
    let seed = std::env::var("FACEOFF_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok());
    let mut state: u64 = seed.unwrap_or(1);
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let (mut refused, mut read) = (0, 0);
    for (name, bytes) in samples() {
        let path = Path::new(name);
        io::parse(path, &bytes, None).unwrap_or_else(|error| panic!("{error}"));
        let mut take = |bytes: &[u8]| match io::parse(path, bytes, None) {
            Ok(_) => read += 1,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        };
        (0..bytes.len()).for_each(|end| take(&bytes[..end]));
        for _ in 0..1500 {
            let mut bytes = bytes.clone();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes[at] = b"0123456789-"[random(11)],
                    1 => bytes[at] = random(256) as u8,
                    2 => bytes.insert(at, b"9876543210"[random(10)]),
                    _ => drop(bytes.remove(at)),
                }
            }
            take(&bytes);
        }
    }
    assert!(refused > 1000 && read > 1000, "{refused} {read}");
    assert!(peak() < 1_000_000, "{} kB", peak());
}

/// Digits that declare what no file holds.
#[test]
fn what_is_declared_is_there() {
    let legacy = |from: &str, to: &str, text: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        let error = io::parse(Path::new("a.vtk"), changed.as_bytes(), None);
        error.expect_err(to).to_string()
    };
    for (from, to, text, place) in [
        ("POINTS 4", "POINTS 4000000000", POLY, "a.vtk:5, POINTS"),
        ("POINTS 4", "POINTS 18446744073709551615", POLY, "POINTS"),
        ("POINTS 4", "POINTS -4", POLY, "is not a count"),
        ("1 5\n4 0", "99999999999 5\n4 0", POLY, "LINES"),
        ("1 5\n4 0", "1 5\n9 0", POLY, "LINES"),
        ("1 5\n4 0", "1 5\n-4 0", POLY, "LINES"),
        (
            "0 1 2 3\nPOLY",
            "0 1 2 4\nPOLY",
            POLY,
            "point 4, but there are 4 points",
        ),
        (
            "POLYGONS",
            "POLYGONES",
            POLY,
            "the keyword \"POLYGONES\" is unknown",
        ),
        ("CELL_DATA 4", "CELL_DATA 5", POLY, "expected a number"),
        ("c 2", "c 2000000000000000000", POLY, "COLOR_SCALARS"),
        (
            "w 1 4",
            "w 4000000000 4000000000",
            POLY,
            "texts are declared",
        ),
        ("3 2 2", "3000 2000 2000", IMAGE, "DIMENSIONS"),
        ("3 2 2", "3 2 3", IMAGE, "18 points"),
        (
            "CELLS 3 7",
            "CELLS 3 6",
            SPLIT,
            "the keyword \"2\" is unknown",
        ),
        ("0 4 7", "0 4 8", SPLIT, "Connectivity of CELLS"),
        ("0 4 7", "0 7 4", SPLIT, "offsets do not ascend"),
        ("10\n5", "10\n200", SPLIT, "type 200 with 3 points"),
        ("10\n5", "10\n42", SPLIT, "faces of a polyhedron"),
        ("CELL_TYPES 2\n10\n5\n", "", SPLIT, "one is missing"),
    ] {
        let error = legacy(from, to, text);
        assert!(error.contains(place), "{from} -> {to}: {error}");
    }
    let image = VTI.replace("0 2 0 1 0 0", "0 2000 0 2000 0 2000");
    let error = io::parse(Path::new("a.vti"), image.as_bytes(), None).expect_err("too many");
    assert!(
        error.to_string().contains("points are more than fit"),
        "{error}"
    );
    let image = VTI.replace("0 2 0 1 0 0", "0 200 0 200 0 200");
    let error = io::parse(Path::new("a.vti"), image.as_bytes(), None).expect_err("too many");
    assert!(error.to_string().contains("may unpack to"), "{error}");
}
