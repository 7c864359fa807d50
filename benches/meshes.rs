//! Reading and writing a million cells beside Gmsh, meshio and VTK, in one run.
//!
//! `cargo bench --bench meshes` (`tests/run` makes the environment with the others); words after `--`
//! choose the files with such words in their names, as `-- med xdmf`.
//! Times are of the work alone, without the start of an interpreter: the best of those of a second, in milliseconds; what is written
//! is written where no file is. Programs do different work in them: faceoff checks every number and has the groups; meshio
//! hands out the arrays of HDF5 files as they are (MED, XDMF) and reads no group of XDMF; VTK takes over the arrays of VTP and
//! VTKHDF without a look at them. Each of these copies the file once; faceoff reads it and looks at each number on all cores: where
//! it lies, if it lies there as it is used, or else while points and nodes are made of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::io::{self, Options, msh};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh};

/// The best of those of a second, three at least, or fewer if they take long.
fn best(mut before: impl FnMut(), mut work: impl FnMut()) -> f64 {
    let begin = Instant::now();
    let mut best = f64::INFINITY;
    for turn in 0.. {
        let spent = begin.elapsed();
        if spent > Duration::from_secs(if turn < 3 { 20 } else { 1 }) {
            break;
        }
        before();
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64());
    }
    best
}

/// Squares cut in two: 2 n² triangles.
fn triangles(n: u32) -> Mesh {
    let h = 1.0 / f64::from(n);
    let point = |i: u32| [f64::from(i % (n + 1)) * h, f64::from(i / (n + 1)) * h, 0.0];
    let corners = (0..n * n).map(|i| i / n * (n + 1) + i % n);
    let nodes = corners.flat_map(|a| [a, a + 1, a + n + 2, a, a + n + 2, a + n + 1]);
    grouped(
        (0..(n + 1) * (n + 1)).map(point).collect(),
        CellKind::Triangle,
        nodes.collect(),
    )
}

/// Cubes cut in six: 6 n³ tetrahedra.
fn tetrahedra(n: u32) -> Mesh {
    let (h, m) = (1.0 / f64::from(n), n + 1);
    let point = |i: u32| [i % m, i / m % m, i / (m * m)].map(|x| f64::from(x) * h);
    let (x, y, z) = (1, m, m * m);
    let mut nodes = Vec::new();
    for i in 0..n * n * n {
        let a = i % n * x + i / n % n * y + i / (n * n) * z;
        for (p, q) in [(x, y), (y, z), (z, x)] {
            let r = x + y + z - p - q;
            debug_assert_eq!(p + q + r, x + y + z);
            nodes.extend([a, a + p, a + p + q, a + x + y + z]);
            nodes.extend([a, a + p + q, a + q, a + x + y + z]);
        }
    }
    grouped(
        (0..m * m * m).map(point).collect(),
        CellKind::Tetrahedron,
        nodes,
    )
}

fn grouped(points: Vec<[f64; 3]>, kind: CellKind, nodes: Vec<u32>) -> Mesh {
    let blocks = vec![CellBlock::new(kind, nodes)];
    let cells = (0..blocks[0].len() as u32).collect();
    let group = Group {
        dim: kind.dim(),
        tag: 1,
        name: Some("all".into()),
        cells,
    };
    Mesh {
        points: points.into(),
        blocks,
        groups: vec![group],
        ..Mesh::default()
    }
}

fn forms() -> Vec<(&'static str, Options)> {
    let msh = |msh_version, binary| Options {
        msh_version,
        binary,
        ..Options::default()
    };
    let vtu = |compressor| Options {
        vtu: Encoding::Raw(compressor),
        ..Options::default()
    };
    let lossy = Options {
        lossy: true,
        ..Options::default()
    };
    let with_names_lost = Options {
        binary: true,
        ..lossy.clone()
    };
    vec![
        ("22-ascii.msh", msh(msh::Version::V22, false)),
        ("22-binary.msh", msh(msh::Version::V22, true)),
        ("41-ascii.msh", msh(msh::Version::V41, false)),
        ("41-binary.msh", msh(msh::Version::V41, true)),
        ("raw.vtu", vtu(Compressor::None)),
        ("zlib.vtu", vtu(Compressor::Zlib)),
        ("raw.vtp", vtu(Compressor::None)),
        ("ascii.vtk", msh(msh::Version::V22, false)),
        ("binary.vtk", msh(msh::Version::V22, true)),
        ("binary.meshb", with_names_lost),
        ("mesh.e", lossy.clone()),
        ("mesh.xdmf", lossy.clone()),
        ("mesh.vtkhdf", lossy.clone()),
        ("mesh.med", lossy.clone()),
        ("mesh.cgns", lossy),
    ]
}

/// Seconds by program and by what was done, as meshes.py measures them.
fn others(python: &Path, files: &[PathBuf]) -> BTreeMap<String, BTreeMap<String, f64>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/meshes.py");
    let programs = ["gmsh", "meshio", "vtk"].into_iter();
    let measured = programs.map(|program| {
        let output = Command::new(python)
            .arg(&script)
            .arg(program)
            .args(files)
            .output();
        let output =
            output.unwrap_or_else(|error| panic!("{}: {error}: run tests/run", python.display()));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let times = text
            .lines()
            .last()
            .and_then(|line| serde_json::from_str(line).ok());
        let times = times
            .unwrap_or_else(|| panic!("{program}: {}", String::from_utf8_lossy(&output.stderr)));
        (program.to_owned(), times)
    });
    measured.collect()
}

fn main() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python/bin/python3");
    let folder = tempfile::tempdir().expect("a folder");
    let chosen: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    println!(
        "| file | MB | | bytes alone | faceoff | gmsh | meshio | VTK | next / faceoff | faceoff / bytes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (name, mesh) in [
        ("triangles", triangles(708)),
        ("tetrahedra", tetrahedra(55)),
    ] {
        let mut rows = Vec::new();
        let mut files = Vec::new();
        for (form, options) in forms() {
            // Polygonal data have no solids.
            if form.ends_with("vtp") && mesh.dim() == 3 {
                continue;
            }
            let file = format!("{name}-{form}");
            if !chosen.is_empty() && !chosen.iter().any(|word| file.contains(word)) {
                continue;
            }
            let path = folder.path().join(&file);
            // XDMF has its numbers in a file of their own.
            let numbers = path.with_extension("h5");
            let numbers = if form.ends_with("xdmf") {
                &numbers
            } else {
                &path
            };
            let remove = |path: &Path| drop(std::fs::remove_file(path));
            // Each program writes what it has read.
            drop(io::write(&path, &mesh, &options).expect("written"));
            let again = io::read(&path).expect("sound");
            let write = best(
                || [&path, numbers].into_iter().for_each(|path| remove(path)),
                || drop(io::write(&path, &again, &options).expect("written")),
            );
            let mut bytes = Vec::new();
            let plain_read = best(|| (), || bytes = std::fs::read(numbers).expect("there"));
            let plain = folder.path().join("plain");
            let plain_write = best(
                || remove(&plain),
                || std::fs::write(&plain, &bytes).expect("written"),
            );
            let read = best(
                || (),
                || {
                    assert_eq!(
                        io::read(&path).expect("sound").cell_count(),
                        mesh.cell_count()
                    );
                },
            );
            rows.push((
                file,
                bytes.len(),
                [("read", plain_read, read), ("write", plain_write, write)],
            ));
            files.push(path);
        }
        let others = others(&python, &files);
        for (file, bytes, measured) in rows {
            for (action, plain, ours) in measured {
                let of = |program: &str| {
                    let times = others.get(program)?;
                    times.get(&format!("{action} {file}")).copied()
                };
                let programs = ["gmsh", "meshio", "vtk"].map(of);
                let next = programs
                    .iter()
                    .flatten()
                    .copied()
                    .fold(f64::INFINITY, f64::min);
                let shown = programs
                    .map(|time| time.map_or("".into(), |time| format!("{:.1}", 1e3 * time)));
                println!(
                    "| {file} | {} | {action} | {:.1} | {:.1} | {} | {:.2} | {:.1} |",
                    bytes / 1_000_000,
                    1e3 * plain,
                    1e3 * ours,
                    shown.join(" | "),
                    next / ours,
                    ours / plain
                );
            }
        }
    }
}
