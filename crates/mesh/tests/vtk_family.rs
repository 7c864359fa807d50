//! VTK's files of all kinds, and VTK and Gmsh on the order of nodes. `FACEOFF_READERS` names a Python with vtk and gmsh;
//! `tests/run` makes one and sets it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use faceoff_mesh::io;
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Group, Mesh, Polyhedra, Support, Values};
use serde_json::Value;

fn python(words: &[&str]) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let named = std::env::var_os("FACEOFF_READERS").map(PathBuf::from);
    let python = named.unwrap_or_else(|| root.join("target/readers/bin/python3"));
    let script = root.join("tests/vtk_family.py");
    let ran = Command::new(&python).arg(script).args(words).output();
    let ran = ran.unwrap_or_else(|error| panic!("{}: {error}: run tests/run", python.display()));
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}");
    serde_json::from_slice(&ran.stdout).expect("JSON")
}

fn floats(value: &Value) -> Vec<f64> {
    let all = value.as_array().into_iter().flatten();
    all.map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
}

/// Every grid and every way to store it: the same points, cells by kind, and sums of arrays as VTK itself reads; texts are
/// told as unread.
#[test]
fn what_vtk_writes_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = python(&["write", folder.path().to_str().expect("a path")]);
    let told = told.as_object().expect("files");
    assert_eq!(told.len(), 7 * 24 + 5 * 4);
    for (path, theirs) in told {
        let content = io::open(Path::new(path), None).unwrap_or_else(|error| panic!("{error}"));
        let mesh = &content.mesh;
        assert_eq!(theirs["points"], mesh.points.len(), "{path}");
        let mut cells: BTreeMap<String, u64> = BTreeMap::new();
        for block in &mesh.blocks {
            *cells.entry(block.kind.to_string()).or_default() += block.len() as u64;
        }
        let counts = theirs["cells"].as_object().expect("counts").iter();
        let counts = counts.map(|(kind, count)| (kind.clone(), count.as_u64().expect("a count")));
        assert_eq!(cells, counts.collect(), "{path}");
        let [low, high] = [0, 1].map(|end| floats(&theirs["box"][end]));
        for axis in 0..3 {
            let all = || mesh.points.iter().map(|point| point[axis]);
            let (least, most) = (
                all().fold(f64::INFINITY, f64::min),
                all().fold(f64::NEG_INFINITY, f64::max),
            );
            assert!(
                (least - low[axis]).abs() + (most - high[axis]).abs() < 1e-6,
                "{path}"
            );
        }
        for (name, theirs) in theirs["fields"].as_object().expect("fields") {
            let (on, name) = name.split_once(' ').expect("of points or cells");
            if theirs.is_null() {
                assert!(
                    content.unread.iter().any(|what| what.contains(name)),
                    "{path}: {name}"
                );
                continue;
            }
            let mine = mesh
                .fields
                .iter()
                .find(|field| field.name == name && field.on.to_string() == on);
            let mine = mine.unwrap_or_else(|| panic!("{path}: no {name} on {on}"));
            let theirs = floats(theirs);
            assert_eq!(mine.components as f64, theirs[0], "{path}: {name}");
            let sum: f64 = mine.values.to_f64().iter().sum();
            assert!(
                (sum - theirs[3]).abs() <= 1e-6 * theirs[4],
                "{path}: {name}: {sum}, not {}",
                theirs[3]
            );
        }
    }
}

/// One cell of each type, with its nodes where Gmsh says that they are: VTK maps parameters to the same places.
#[test]
fn nodes_stand_where_vtk_expects_them() {
    let places = python(&["places"]);
    let mut mesh = Mesh::default();
    for (number, rows) in places.as_object().expect("types") {
        let kind =
            CellKind::from_gmsh(number.parse().expect("a number")).expect("a type of Gmsh's");
        let first = mesh.points.len() as u32;
        for row in rows.as_array().expect("rows") {
            mesh.points
                .push(floats(row).try_into().expect("three coordinates"));
        }
        let nodes = (first..mesh.points.len() as u32).collect();
        mesh.blocks.push(CellBlock::new(kind, nodes));
    }
    // Ten orders of four shapes, nine of hexahedra, two of prisms, the pyramid, and four serendipity cells.
    assert_eq!(mesh.blocks.len(), 56);
    let folder = tempfile::tempdir().expect("a folder");
    let files = ["a.vtu", "a.vtk", "b.vtk"].map(|name| folder.path().join(name));
    for (file, binary) in files.iter().zip([true, false, true]) {
        let options = io::Options {
            binary,
            ..io::Options::default()
        };
        io::write(file, &mesh, &options).expect("written");
        assert_eq!(
            io::read(file).expect("read").blocks,
            mesh.blocks,
            "{}",
            file.display()
        );
    }
    let words: Vec<&str> = files
        .iter()
        .map(|file| file.to_str().expect("a path"))
        .collect();
    let checked = python(&[&["check"], &words[..]].concat());
    for found in checked.as_array().expect("a file each").iter().map(floats) {
        assert!(found[0] < 1e-12 && found[1] == 56.0, "{found:?}");
    }
}

/// A polyhedron, polygons of several sizes, and cells that only VTK has, with data and groups.
fn odd() -> Mesh {
    let mut polyhedra = Polyhedra::default();
    let faces = [
        4, 0, 1, 2, 3, 3, 0, 1, 4, 3, 1, 2, 4, 3, 2, 3, 4, 3, 3, 0, 4,
    ];
    assert!(polyhedra.push(faces));
    let group = |dim, tag, cells: &[u32]| Group {
        dim,
        tag,
        name: Some(format!("group {tag}")),
        cells: cells.to_vec(),
    };
    let numbers = |count: u32| Values::F64((0..count).map(|k| f64::from(k) / 3.0).collect());
    let point = |k: u32| [k, k * k % 7, k % 3].map(f64::from);
    Mesh {
        points: (0..20).map(point).collect(),
        blocks: vec![
            CellBlock::new(CellKind::Polyhedron(5), vec![0, 1, 2, 3, 4]),
            CellBlock::new(CellKind::Polygon(5), (5..15).collect()),
            CellBlock::new(CellKind::Polygon(6), (6..12).collect()),
            CellBlock::new(
                CellKind::from_vtk(77, 16).expect("Bézier"),
                (0..16).collect(),
            ),
            CellBlock::new(
                CellKind::from_vtk(36, 10).expect("quadratic"),
                (3..13).collect(),
            ),
        ],
        polyhedra,
        groups: vec![group(2, 3, &[1, 3]), group(3, 1, &[0])],
        fields: vec![
            Field::new("on points", Support::Points, 1, numbers(20)),
            Field::new("on cells", Support::Cells, 2, numbers(12)),
        ],
        ..Mesh::default()
    }
}

#[test]
fn cells_of_any_number_of_points_come_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = odd();
    for (name, binary, vtu) in [
        ("a.vtu", false, Encoding::Ascii),
        ("b.vtu", false, Encoding::Raw(Compressor::Lz4)),
        ("a.vtk", false, Encoding::Ascii),
        ("b.vtk", true, Encoding::Ascii),
    ] {
        let path = folder.path().join(name);
        let options = io::Options {
            binary,
            vtu,
            ..io::Options::default()
        };
        assert_eq!(
            io::write(&path, &mesh, &options).expect("written"),
            Vec::<String>::new()
        );
        assert_eq!(io::read(&path).expect("read"), mesh, "{name}");
    }
    for name in ["a.msh", "a.vtp"] {
        let error = io::write(&folder.path().join(name), &mesh, &io::Options::default());
        let error = error.expect_err("no such cells").to_string();
        assert!(error.contains("cells that are"), "{error}");
    }
}

/// Polygonal data have vertices, lines and polygons in this order.
#[test]
fn a_surface_is_written_as_polygonal_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.vtp");
    let mut mesh = odd();
    mesh.blocks = vec![
        CellBlock::new(CellKind::Polygon(5), (5..15).collect()),
        CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
        CellBlock::new(CellKind::Triangle, vec![0, 1, 2]),
        CellBlock::new(CellKind::Vertex, vec![7]),
    ];
    mesh.polyhedra = Polyhedra::default();
    mesh.groups.truncate(1);
    mesh.groups[0].cells = vec![0, 4];
    let warnings = io::write(&path, &mesh, &io::Options::default()).expect("written");
    assert_eq!(
        warnings,
        ["the cells stand in the order of their dimensions"]
    );
    let read = io::read(&path).expect("read");
    let order = [5usize, 2, 3, 0, 1, 4];
    let was: Vec<_> = mesh
        .cells()
        .map(|(_, kind, nodes)| (kind, nodes.to_vec()))
        .collect();
    let is: Vec<_> = read
        .cells()
        .map(|(_, kind, nodes)| (kind, nodes.to_vec()))
        .collect();
    assert_eq!(is, order.map(|cell| was[cell].clone()));
    assert_eq!(read.groups[0].cells, [3, 5]);
    let values = mesh.fields[1].values.to_f64();
    let values: Vec<f64> = order
        .iter()
        .flat_map(|&cell| [values[2 * cell], values[2 * cell + 1]])
        .collect();
    assert_eq!(read.fields[1].values.to_f64(), values);
    // What is in order comes back as it was.
    assert!(
        io::write(&path, &read, &io::Options::default())
            .expect("written")
            .is_empty()
    );
    assert_eq!(io::read(&path).expect("read"), read);
}
