//! What meshio, Gmsh, netCDF4 and VTK write on HDF5 and netCDF is read, and they read what is written here. `tests/run`
//! makes the Python with these.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use faceoff_mesh::io::{self, Content, Options};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};
use serde_json::Value;

fn python(words: &[&str]) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = root.join("target/python/bin/python3");
    let script = root.join("tests/hdf5_family.py");
    let ran = Command::new(&python).arg(script).args(words).output();
    let ran = ran.unwrap_or_else(|error| panic!("{}: {error}: run tests/run", python.display()));
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}");
    let text = String::from_utf8_lossy(&ran.stdout);
    serde_json::from_str(text.lines().last().unwrap_or_default()).expect("JSON")
}

/// Numbers of cells by their numbers of nodes.
fn cells(mesh: &Mesh) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    for block in &mesh.blocks {
        *counts.entry(block.kind.points().to_string()).or_default() += block.len() as u64;
    }
    counts
}

fn counts(value: &Value) -> BTreeMap<String, u64> {
    let all = value.as_object().into_iter().flatten();
    all.map(|(name, count)| (name.clone(), count.as_u64().expect("a count")))
        .collect()
}

fn sum_of_u(mesh: &Mesh) -> f64 {
    let of = mesh.fields.iter().filter(|field| field.name == "u");
    of.flat_map(|field| field.values.to_f64()).sum()
}

#[test]
fn what_others_write_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = python(&["write", folder.path().to_str().expect("a path")]);
    let told = told.as_object().expect("files");
    assert_eq!(told.len(), 15);
    for (path, theirs) in told {
        let content = io::open(Path::new(path), None).unwrap_or_else(|error| panic!("{error}"));
        let Content { mesh, unread, .. } = &content;
        assert!(unread.is_empty(), "{path}: {unread:?}");
        assert_eq!(theirs["points"], mesh.points.len(), "{path}");
        assert_eq!(cells(mesh), counts(&theirs["cells"]), "{path}");
        if theirs["groups"].is_object() {
            let groups = mesh
                .groups
                .iter()
                .map(|g| (g.name.clone().unwrap_or_default(), g.cells.len() as u64));
            assert_eq!(
                groups.collect::<BTreeMap<_, _>>(),
                counts(&theirs["groups"]),
                "{path}"
            );
        }
        if let Some(u) = theirs["u"].as_f64() {
            assert!(
                (sum_of_u(mesh) - u).abs() <= 1e-12 * u,
                "{path}: {} and {u}",
                sum_of_u(mesh)
            );
        }
    }
}

/// Each cell by the places of its nodes in their order.
fn shapes(mesh: &Mesh) -> Vec<(CellKind, Vec<[i64; 3]>)> {
    let place = |&node: &u32| mesh.points[node as usize].map(|x| (x * 1e8).round() as i64);
    let cells = mesh
        .cells()
        .map(|(_, kind, nodes)| (kind, nodes.iter().map(place).collect()));
    let mut all: Vec<_> = cells.collect();
    all.sort_unstable();
    all
}

/// Gmsh writes one mesh as MSH, MED and CGNS.
#[test]
fn nodes_stand_in_the_order_of_gmsh() {
    let folder = tempfile::tempdir().expect("a folder");
    python(&["write", folder.path().to_str().expect("a path")]);
    for order in ["order1", "order2"] {
        let read = |suffix: &str| io::read(&folder.path().join(format!("{order}.{suffix}")));
        let msh = shapes(&read("msh").expect("MSH"));
        for suffix in ["med", "cgns"] {
            assert!(
                shapes(&read(suffix).expect("read")) == msh,
                "{order}.{suffix}"
            );
        }
    }
}

/// A hexahedron, a tetrahedron on its top, and a side in a group.
fn mesh() -> Mesh {
    let points = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [0., 0., 1.],
        [1., 0., 1.],
        [1., 1., 1.],
        [0., 1., 1.],
        [0.5, 0.5, 2.],
    ];
    let group = |dim, tag, name: &str, cells: &[u32]| Group {
        name: Some(name.into()),
        cells: cells.to_vec(),
        ..Group::new(dim, tag)
    };
    let u = (0..9).map(|k| f64::from(k * k)).collect();
    Mesh {
        points: points.to_vec().into(),
        blocks: vec![
            CellBlock::new(CellKind::Hexahedron, (0..8).collect()),
            CellBlock::new(CellKind::Tetrahedron, vec![4, 5, 6, 8]),
            CellBlock::new(CellKind::Quadrangle, vec![0, 3, 2, 1]),
        ],
        groups: vec![
            group(2, 3, "floor", &[2]),
            group(3, 1, "body", &[0]),
            group(3, 2, "roof", &[1]),
        ],
        fields: vec![Field::new("u", Support::Points, 1, Values::F64(u))],
        ..Mesh::default()
    }
}

#[test]
fn others_read_what_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = mesh();
    let names = ["a.e", "a.xdmf", "a.vtkhdf", "a.med", "a.cgns"];
    let paths = names.map(|name| {
        folder
            .path()
            .join(name)
            .to_str()
            .expect("a path")
            .to_owned()
    });
    for path in &paths {
        let options = Options {
            lossy: true,
            ..Options::default()
        };
        io::write(Path::new(path), &mesh, &options).unwrap_or_else(|error| panic!("{error}"));
    }
    let mut words = vec!["read"];
    words.extend(paths.iter().map(String::as_str));
    let told = python(&words);
    let mut readers = 0;
    for path in &paths {
        for (program, theirs) in told[path].as_object().expect("programs") {
            readers += 1;
            assert_eq!(theirs["points"], 9, "{program} {path}");
            let found = counts(&theirs["cells"]);
            let solids = ["8", "4"].map(|nodes| found.get(nodes).copied().unwrap_or(0));
            // VTK has sides apart; a quadrangle has as many nodes as a tetrahedron.
            let sides =
                u64::from(!(path.ends_with(".e") || program == "vtk" && path.ends_with(".cgns")));
            assert_eq!(solids, [1, 1 + sides], "{program} {path}: {found:?}");
            // Of CGNS, Gmsh has groups by entities, which are not written.
            if theirs["groups"].is_object() && path.ends_with(".med") {
                let expected = [("body", 1), ("floor", 1), ("roof", 1)]
                    .map(|(name, count)| (name.to_owned(), count));
                assert_eq!(
                    counts(&theirs["groups"]),
                    expected.into(),
                    "{program} {path}"
                );
            }
            if let Some(u) = theirs["u"].as_f64() {
                assert_eq!(u, sum_of_u(&mesh), "{program} {path}");
            }
        }
    }
    assert_eq!(readers, 9);
}
