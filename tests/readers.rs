//! Meshes from one format to another through the program, read back by programs that share nothing with it: Gmsh,
//! meshio, VTK, FreeFEM and dolfinx see the same points to the last bit, cells, groups and names.
//!
//! `tests/run` makes the Python with gmsh, meshio and vtk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{faceoff, folder, run, source, told};
use faceoff_mesh::io;
use faceoff_mesh::mesh::{CellKind, Mesh, Support, Values};
use serde_json::Value;

fn readers() -> PathBuf {
    let python = source("target/python/bin/python3");
    assert!(
        python.exists(),
        "{} is not there: run tests/run",
        python.display()
    );
    python
}

/// What a reader sees; see readers.py.
#[derive(Debug, Clone, Default, PartialEq)]
struct Seen {
    points: Vec<String>,
    cells: BTreeMap<String, Vec<String>>,
    /// By dimension and number: name and cells.
    groups: BTreeMap<String, (String, Vec<String>)>,
}

impl Seen {
    fn of_mesh(mesh: &Mesh) -> Seen {
        let points: Vec<String> = mesh.points.iter().map(|point| bits(point)).collect();
        let cells: Vec<(CellKind, String)> = mesh
            .cells()
            .map(|(_, kind, nodes)| {
                let nodes: Vec<&str> = nodes.iter().map(|&n| points[n as usize].as_str()).collect();
                (kind, nodes.join(" "))
            })
            .collect();
        let mut seen = Seen::default();
        for (kind, cell) in &cells {
            seen.cells
                .entry(kind.to_string())
                .or_default()
                .push(cell.clone());
        }
        for group in &mesh.groups {
            let members = group
                .cells
                .iter()
                .map(|&cell| cells[cell as usize].1.clone())
                .collect();
            let name = group.name.clone().unwrap_or_default();
            seen.groups
                .insert(format!("{} {}", group.dim, group.tag), (name, members));
        }
        seen.points = points;
        seen.sorted()
    }

    fn of_json(value: &Value) -> Seen {
        let texts = |value: &Value| -> Vec<String> {
            let texts = value.as_array().unwrap().iter();
            texts
                .map(|text| text.as_str().unwrap().to_owned())
                .collect()
        };
        let map = |value: &Value| value.as_object().unwrap().clone();
        Seen {
            points: texts(&value["points"]),
            cells: map(&value["cells"])
                .iter()
                .map(|(kind, cells)| (kind.clone(), texts(cells)))
                .collect(),
            groups: map(&value["groups"])
                .iter()
                .map(|(group, value)| {
                    let name = value["name"].as_str().unwrap().to_owned();
                    (group.clone(), (name, texts(&value["cells"])))
                })
                .collect(),
        }
    }

    fn sorted(mut self) -> Seen {
        self.points.sort();
        self.cells.values_mut().for_each(|cells| cells.sort());
        self.groups.values_mut().for_each(|(_, cells)| cells.sort());
        self
    }

    /// As labels tell it: no names.
    fn nameless(mut self) -> Seen {
        self.groups.values_mut().for_each(|(name, _)| name.clear());
        self
    }

    /// Without cells of dimension 0, which labels of points stand for.
    fn without_vertices(mut self) -> Seen {
        self.cells.remove("vertex");
        self.groups.retain(|group, _| !group.starts_with("0 "));
        self
    }

    /// The points of a cell in any order, as some readers turn them.
    fn unordered(mut self) -> Seen {
        let groups = self.groups.values_mut().map(|(_, cells)| cells);
        for cell in self.cells.values_mut().chain(groups).flatten() {
            let mut points: Vec<&str> = cell.split(' ').collect();
            points.sort_unstable();
            *cell = points.join(" ");
        }
        self.sorted()
    }
}

fn bits(point: &[f64]) -> String {
    let numbers = point
        .iter()
        .map(|x| format!("{:016x}", (x + 0.0).to_bits()));
    numbers.collect()
}

/// What a reader of readers.py sees in files; one process for all, as its imports are slow.
fn see(python: &Path, reader: &str, files: &[PathBuf]) -> Vec<Value> {
    let mut command = Command::new(python);
    let ran = told(
        command
            .arg(source("tests/readers.py"))
            .arg(reader)
            .args(files)
            .output()
            .unwrap(),
    );
    assert_eq!(ran.code, Some(0), "{reader}: {}", ran.stderr);
    let seen: Value = ran
        .stdout
        .lines()
        .find_map(|line| serde_json::from_str(line).ok())
        .unwrap();
    let seen = seen.as_array().unwrap().clone();
    assert_eq!(seen.len(), files.len());
    seen
}

fn compare(reader: &str, cases: &[(PathBuf, Seen)], as_told: impl Fn(Seen) -> Seen) {
    let files: Vec<PathBuf> = cases.iter().map(|(file, _)| file.clone()).collect();
    for ((file, expected), value) in cases.iter().zip(see(&readers(), reader, &files)) {
        let (seen, expected) = (Seen::of_json(&value), as_told(expected.clone()));
        assert!(
            as_told(seen.clone()) == expected,
            "{reader} sees {}:\n{seen:#?}\n{expected:#?}",
            file.display()
        );
    }
}

/// FreeFEM's sight of a plane mesh; edges without a label, which it adds itself, are left out.
fn freefem(file: &Path) -> Seen {
    let mut command = Command::new("FreeFem++-nw");
    command
        .args(["-ne", "-v", "0", "-nw"])
        .arg(source("tests/readers.edp"))
        .arg(file);
    let ran = told(command.output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stdout);
    let mut lines = ran.stdout.lines().filter(|line| !line.trim().is_empty());
    let mut seen = Seen::default();
    for (kind, dim) in [("points", 0), ("triangle", 2), ("line", 1)] {
        let head = lines.find(|line| line.starts_with(kind)).unwrap();
        let count: usize = head.split_whitespace().nth(1).unwrap().parse().unwrap();
        for line in lines.by_ref().take(count) {
            let words: Vec<&str> = line.split_whitespace().collect();
            if dim == 0 {
                let xy: Vec<f64> = words.iter().map(|word| word.parse().unwrap()).collect();
                seen.points.push(bits(&[xy[0], xy[1], 0.0]));
                continue;
            }
            let (label, nodes) = words.split_last().unwrap();
            let nodes = nodes
                .iter()
                .map(|node| seen.points[node.parse::<usize>().unwrap()].as_str());
            let cell = nodes.collect::<Vec<&str>>().join(" ");
            if *label != "0" {
                seen.groups
                    .entry(format!("{dim} {label}"))
                    .or_default()
                    .1
                    .push(cell.clone());
            }
            if dim == 2 || *label != "0" {
                seen.cells.entry(kind.into()).or_default().push(cell);
            }
        }
    }
    seen.sorted()
}

/// The forms that are written, by the suffix and the words that ask for them.
const TARGETS: [(&str, &[&str]); 12] = [
    ("22a.msh", &["--msh-version", "2.2"]),
    ("22b.msh", &["--msh-version", "2.2", "--encoding", "binary"]),
    ("41a.msh", &["--msh-version", "4.1"]),
    ("41b.msh", &["--msh-version", "4.1", "--encoding", "binary"]),
    ("ascii.vtu", &["--encoding", "ascii"]),
    ("base64.vtu", &["--encoding", "base64"]),
    ("raw.vtu", &["--encoding", "raw"]),
    ("zlib.vtu", &["--encoding", "raw-zlib"]),
    ("lz4.vtu", &["--encoding", "base64-lz4"]),
    ("lzma.vtu", &["--encoding", "raw-lzma"]),
    ("free.msh", &["--format", "freefem", "--lossy"]),
    ("medit.mesh", &["--lossy"]),
];

const SOURCES: [&str; 10] = [
    "tests/data/square-1.0.msh",
    "tests/data/square-2.2.msh",
    "tests/data/square-2.2-binary.msh",
    "tests/data/square-4.0.msh",
    "tests/data/square-4.1.msh",
    "tests/data/square-4.1-binary.msh",
    "tests/data/big-endian-2.2.msh",
    "tests/data/big-endian-4.1.msh",
    "tests/data/box.msh",
    "meshes/plate.msh",
];

fn convert(folder: &Path, from: &Path, to: &Path, words: &[&str]) {
    let mut command = faceoff(folder);
    let ran = told(
        command
            .args(["mesh", "convert"])
            .arg(from)
            .arg(to)
            .args(words)
            .output()
            .unwrap(),
    );
    assert_eq!(
        ran.code,
        Some(0),
        "{} -> {}: {}",
        from.display(),
        to.display(),
        ran.stderr
    );
}

#[test]
fn every_pair_of_formats() {
    readers();
    let folder = folder();
    let of = |path: &Path| Seen::of_mesh(&io::read(path).unwrap());
    let (mut gmsh, mut meshio, mut vtk) = (Vec::new(), Vec::new(), Vec::new());
    // What is written first is then a source itself: VTU, FreeFEM's and Medit's files among them.
    let mut sources: Vec<PathBuf> = SOURCES.map(source).to_vec();
    gmsh.extend(sources.iter().map(|path| (path.clone(), of(path))));
    for (to, words) in TARGETS {
        let path = folder.path().join(format!("from-{to}"));
        convert(
            folder.path(),
            &source("tests/data/square-2.2.msh"),
            &path,
            words,
        );
        sources.push(path);
    }
    for (i, from) in sources.iter().enumerate() {
        let mesh = io::read(from).unwrap();
        let seen = Seen::of_mesh(&mesh);
        let flat = !from.ends_with("box.msh");
        for (to, words) in TARGETS.iter().filter(|(to, _)| flat || *to != "free.msh") {
            let path = folder.path().join(format!("{i}-{to}"));
            convert(folder.path(), from, &path, words);
            let labels = seen.clone().nameless().without_vertices();
            // FreeFEM turns the edges of the border so that the domain lies on their left.
            let by_freefem = |path: &Path| {
                let turned = freefem(path).unordered() == labels.clone().unordered();
                assert!(turned, "FreeFEM on {} -> {to}", from.display());
            };
            match *to {
                "free.msh" => by_freefem(&path),
                "medit.mesh" => {
                    if flat {
                        by_freefem(&path);
                    }
                    meshio.push((path, labels));
                }
                _ if to.ends_with(".vtu") => {
                    vtk.push((path.clone(), seen.clone()));
                    // meshio knows no LZ4.
                    if *to != "lz4.vtu" {
                        meshio.push((path, seen.clone()));
                    }
                }
                _ => {
                    gmsh.push((path.clone(), seen.clone()));
                    // Of binary 2.2, meshio reads only nodes that are numbered 1, 2, 3, …; of 4.1, it takes
                    // memory for every number up to the highest.
                    let highest = mesh.point_tags.iter().max().copied().unwrap_or(0);
                    if highest < 1 << 32 && (*to != "22b.msh" || highest == 0) {
                        meshio.push((path, seen.clone()));
                    }
                }
            }
        }
    }
    compare("gmsh", &gmsh, |seen| seen);
    compare("vtk", &vtk, |seen| seen);
    compare("meshio", &meshio, |seen| seen);
}

#[test]
fn dolfinx_reads_xdmf() {
    let folder = folder();
    // A file for dolfinx has cells of one type.
    let mut mesh = io::read(&source("tests/data/square-4.1.msh")).unwrap();
    mesh.blocks.retain(|block| block.kind == CellKind::Triangle);
    mesh.groups.clear();
    mesh.geometry = Default::default();
    let mut used: Vec<u32> = mesh.blocks[0].nodes.to_vec();
    used.sort_unstable();
    used.dedup();
    assert_eq!(
        used.len(),
        mesh.points.len(),
        "dolfinx drops points of no cell"
    );
    let plain = folder.path().join("plain.msh");
    io::write(&plain, &mesh, &io::Options::default()).unwrap();
    let out = folder.path().join("plain.xdmf");
    let mut command = faceoff(folder.path());
    let words = ["mesh", "convert", "plain.msh", "plain.xdmf", "--lossy"];
    let ran = told(command.args(words).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let seen = see(Path::new("/usr/bin/python3"), "dolfinx", &[out]);
    assert_eq!(
        Seen::of_json(&seen[0]).unordered(),
        Seen::of_mesh(&mesh).unordered()
    );
}

/// With NumPy 2 meshio writes values of this format as `np.float64(0.0)`, which nothing reads.
#[test]
fn what_meshio_does_not_read_back_is_not_left_in_the_file() {
    let folder = folder();
    let words = ["solve", "one-zone", "--n", "3", "--out", "s.vtu", "--quiet"];
    assert_eq!(run(folder.path(), &words).code, Some(0));
    let mut command = faceoff(folder.path());
    command.env("FACEOFF_MESHIO_PYTHON", readers());
    let words = ["mesh", "convert", "s.vtu", "s.mdpa", "--lossy"];
    let ran = told(command.args(words).output().unwrap());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let written = std::fs::read_to_string(folder.path().join("s.mdpa")).unwrap();
    let has_values = written.contains("Data") && written.contains("u rust");
    let is_told = ran.stderr.contains("does not hold the field \"u rust\"");
    assert!(has_values != is_told, "{}{written}", ran.stderr);
    assert!(!written.contains("np.float64"), "{written}");
}

#[test]
fn the_faces_of_a_solution_open_in_vtk_and_meshio() {
    let folder = folder();
    let words = ["solve", "one-zone", "--n", "4", "--out", "faces.vtu"];
    let ran = run(folder.path(), &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let files: Vec<PathBuf> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    let files: Vec<PathBuf> = files
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "vtu"))
        .collect();
    assert!(!files.is_empty());
    let by_meshio = see(&readers(), "meshio", &files);
    let by_vtk = see(&readers(), "vtk", &files);
    for ((path, value), meshio) in files.iter().zip(by_vtk).zip(by_meshio) {
        let mesh = io::read(path).unwrap();
        assert_eq!(Seen::of_json(&meshio), Seen::of_mesh(&mesh));
        assert!(mesh.cell_count() > 0);
        let mut fields = 0;
        for field in mesh
            .fields
            .iter()
            .filter(|field| field.on == Support::Cells)
        {
            let Values::F64(values) = &field.values else {
                continue;
            };
            let (mut all, n) = (
                vec![f64::NAN; mesh.cell_count() * field.components],
                field.components,
            );
            if field.at.is_empty() {
                all = values.to_vec();
            }
            for (row, &cell) in field.at.iter().enumerate() {
                all[n * cell as usize..][..n].copy_from_slice(&values[n * row..][..n]);
            }
            let expected: String = all
                .iter()
                .map(|x| format!("{:016x}", x.to_bits()))
                .collect();
            assert_eq!(
                value["fields"][&field.name],
                expected,
                "{} {}",
                path.display(),
                field.name
            );
            fields += 1;
        }
        assert!(fields > 0, "{}", path.display());
        let seen = Seen::of_json(&value);
        assert_eq!(seen.cells, Seen::of_mesh(&mesh).cells);
    }
}
