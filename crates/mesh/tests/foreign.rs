//! Meshes that Gmsh and meshio write in formats of text: the same cells, node by node. The shape of cells as VTK measures it.
//!
//! `tests/run` makes the Python with gmsh and meshio.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use faceoff_mesh::mesh::check::check;
use faceoff_mesh::{CellBlock, CellKind, Mesh, io};

type Cells = BTreeMap<u8, Vec<String>>;

/// The cells of each kind, each by the coordinates of its nodes.
fn cells(mesh: &Mesh) -> Cells {
    let mut found = Cells::new();
    for (_, kind, nodes) in mesh.cells() {
        let node = |&node: &u32| {
            mesh.points[node as usize]
                .map(|x| format!("{:.4}", x + 0.0))
                .join(" ")
        };
        let nodes: Vec<String> = nodes.iter().map(node).collect();
        found.entry(kind.gmsh()).or_default().push(nodes.join(";"));
    }
    found.values_mut().for_each(|cells| cells.sort());
    found
}

fn unordered(cells: &mut [String]) {
    for cell in cells.iter_mut() {
        let mut nodes: Vec<&str> = cell.split(';').collect();
        nodes.sort_unstable();
        *cell = nodes.join(";");
    }
    cells.sort();
}

#[test]
fn gmsh_and_meshio_mean_the_same_cells() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join("../../target/python/bin/python3");
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(&python);
    command
        .arg(root.join("tests/foreign.py"))
        .arg(folder.path());
    let ran = command
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}: run tests/run", python.display()));
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    let text = String::from_utf8(ran.stdout).unwrap();
    let seen: BTreeMap<PathBuf, Cells> =
        serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert!(seen.len() > 30, "only {} files", seen.len());
    for (path, expected) in seen {
        let mesh = io::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let found = cells(&mesh);
        let suffix = path.extension().unwrap().to_str().unwrap();
        // Gmsh writes no points as cells, cards of two nodes for all lines, and for SU2 only the cells of groups.
        let least = if suffix == "su2" {
            3
        } else if suffix == "bdf" {
            2
        } else {
            1
        };
        for (kind, mut cells) in expected {
            if CellKind::from_gmsh(kind.into()).unwrap().dim() < least {
                continue;
            }
            let mut found = found.get(&kind).cloned().unwrap_or_default();
            // For SU2 Gmsh turns prisms over, as VTK's manual has them.
            if suffix == "su2" {
                unordered(&mut cells);
                unordered(&mut found);
            }
            assert!(
                found == cells,
                "{}: type {kind}: {:?}, not {:?}",
                path.display(),
                found.first(),
                cells.first()
            );
        }
        let bottom = mesh
            .groups
            .iter()
            .find(|group| group.name.as_deref() == Some("bottom"));
        let named = matches!(suffix, "unv" | "su2")
            || (suffix == "inp" && !path.to_str().unwrap().contains("meshio"));
        assert_eq!(bottom.is_some(), named, "{}", path.display());
    }
}

/// One cell of each shape, each pulled out of shape in its own way: what VTK, which uses Verdict, reports for it.
#[test]
fn vtk_measures_the_same_shapes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join("../../target/python/bin/python3");
    let folder = tempfile::tempdir().unwrap();
    let cube = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let (mut cells, mut paths) = (Vec::new(), Vec::new());
    for (kind, nodes) in [
        (CellKind::Triangle, vec![0, 1, 2]),
        (CellKind::Quadrangle, vec![0, 1, 2, 3]),
        (CellKind::Tetrahedron, vec![0, 1, 3, 4]),
        (CellKind::Hexahedron, vec![0, 1, 2, 3, 4, 5, 6, 7]),
        (CellKind::Prism, vec![0, 1, 3, 4, 5, 7]),
    ] {
        for pull in 0..6u32 {
            let points = cube.iter().zip(0u32..).map(|(x, k)| {
                let pulled = f64::from(pull);
                let off = |axis: u32| f64::from((7 * k + 5 * axis + 3 * pull) % 11) * 0.06;
                let up = f64::from(kind.dim() - 2) * (x[2] + pulled * off(2) / 4.0);
                [x[0] * (1.0 + pulled) + off(0), x[1] + off(1), up]
            });
            let mesh = Mesh {
                points: points.collect(),
                blocks: vec![CellBlock::new(kind, nodes.clone())],
                ..Mesh::default()
            };
            let path = folder.path().join(format!("{kind}{pull}.vtu"));
            io::write(&path, &mesh, &io::Options::default()).unwrap();
            cells.push((kind, mesh));
            paths.push(path);
        }
    }
    let mut command = Command::new(&python);
    command.arg(root.join("tests/quality.py")).args(&paths);
    let ran = command
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}: run tests/run", python.display()));
    let told = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{told}");
    let seen: Vec<BTreeMap<String, f64>> = serde_json::from_slice(&ran.stdout).unwrap();
    let mut compared = 0;
    for ((kind, mesh), theirs) in cells.iter().zip(&seen) {
        for of in check(mesh).unwrap().quality {
            // What Verdict has of prisms besides is measured otherwise.
            let known = *kind != CellKind::Prism || of.what == "scaled Jacobian";
            if let Some(theirs) = theirs.get(of.what).filter(|_| known) {
                let apart = (of.least - theirs).abs() / theirs.abs().max(1.0);
                let what = of.what;
                assert!(
                    apart < 1e-9,
                    "{what} of a {kind}: {} and {theirs}",
                    of.least
                );
                compared += 1;
            }
        }
    }
    assert!(compared >= 60, "only {compared}");
}
