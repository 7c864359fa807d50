//! VTK's files of all kinds, and VTK and Gmsh on the order of nodes. `tests/run` makes the Python with vtk
//! and gmsh.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use faceoff_mesh::io;
use faceoff_mesh::io::vtu::{Compressor, Encoding};
use faceoff_mesh::mesh::{
    CellBlock, CellKind, CellPartitions, Entity, Field, Geometry, Group, Mesh, Partitions,
    Polyhedra, Support, Values,
};
use serde_json::Value;

fn python(words: &[&str]) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = root.join("target/python/bin/python3");
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
/// reported as unread.
#[test]
fn what_vtk_writes_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = python(&["write", folder.path().to_str().expect("a path")]);
    let told = told.as_object().expect("files");
    assert_eq!(told.len(), 7 * 24 + 5 * 4, "files");
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
                    content.unread.iter().any(|part| part.what.contains(name)),
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

/// One cell of each type, with its nodes where Gmsh has them: VTK maps parameters to the same places.
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
                .to_mut()
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
    let geometry = Geometry {
        entities: vec![Entity::without_points(2, 5)],
        partitions: Partitions {
            count: 2,
            cells: vec![CellPartitions {
                cell: 1,
                owners: vec![1],
                ghosts: vec![2],
            }],
            ..Partitions::default()
        },
        ..Geometry::default()
    };
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
        geometry,
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
    assert_eq!(read.geometry.partitions.cells[0].cell, 4);
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

/// A piece of four points and two triangles, of which the second is marked.
fn piece(x: f64, mark: u8, u: [f64; 4]) -> String {
    let array = |kind: &str, name: &str, text: String| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ASCII\">{text}</DataArray>")
    };
    let u = u.map(|u| format!("{u} ")).concat();
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">\
         <PointData>{}</PointData><CellData>{}{}</CellData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">\
         {x} 0 0 {x} 1 0 {} 0 0 {} 1 0</DataArray></Points><Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>",
        array("Float64", "u", u),
        array("UInt8", "vtkGhostType", format!("0 {mark}")),
        array("Int32", "cell", "7 8".into()),
        x + 1.0,
        x + 2.0,
        array("Int32", "connectivity", "1 2 0 3 2 1".into()),
        array("Int32", "offsets", "3 6".into()),
        array("UInt8", "types", "5 5".into()),
    )
}

#[test]
fn ghosts_are_left_out_where_pieces_become_one_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("0.vtu"), piece(0.0, 1, [1.0, 2.0, 3.0, 4.0])).expect("written");
    std::fs::write(at("1.vtu"), piece(5.0, 32, [5.0, 6.0, 7.0, 8.0])).expect("written");
    let list = "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"0.vtu\"/><Piece Source=\"1.vtu\"/>\
                </PUnstructuredGrid></VTKFile>";
    std::fs::write(at("all.pvtu"), list).expect("written");
    let content = io::open(&at("all.pvtu"), None).expect("read");
    assert_eq!(
        content.warnings,
        ["1 ghost cells, which other pieces have as well, are left out"]
    );
    assert_eq!(content.ghosts, 1);
    let mesh = content.mesh;
    let x: Vec<f64> = mesh.points.iter().map(|point| point[0]).collect();
    assert_eq!(x, [0.0, 0.0, 1.0, 5.0, 5.0, 6.0, 7.0]);
    assert_eq!(mesh.blocks[0].nodes, [1, 2, 0, 4, 5, 3, 6, 5, 4]);
    let values = |name: &str| {
        let field = mesh.fields.iter().find(|field| field.name == name);
        field.expect("there").values.to_f64()
    };
    assert_eq!(values("u"), [1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(values("cell"), [7.0, 7.0, 8.0]);
    // A piece by itself is what it is.
    let alone = io::open(&at("0.vtu"), None).expect("read");
    assert_eq!((alone.ghosts, alone.mesh.cell_count()), (0, 2));
}

/// What has the number of nodes of a complete element need not be one: degrees may differ among directions.
#[test]
fn cells_of_uneven_degrees_are_no_elements_of_gmsh() {
    let file = |degrees: &str| {
        let points: String = (0..16).map(|k| format!("{} {} 0 ", k % 8, k / 8)).collect();
        let nodes: String = (0..16).map(|k| format!("{k} ")).collect();
        let array = |name: &str, text: &str| {
            format!(
                "<DataArray type=\"Int32\" Name=\"{name}\" NumberOfComponents=\"3\">{text}</DataArray>"
            )
        };
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"16\" NumberOfCells=\"1\">\
             <CellData>{}</CellData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">{points}</DataArray></Points>\
             <Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>",
            array("HigherOrderDegrees", degrees),
            array("connectivity", &nodes),
            array("offsets", "16"),
            array("types", "70"),
        )
    };
    let kind = |degrees: &str| {
        let read = io::parse(Path::new("a.vtu"), file(degrees).as_bytes(), None);
        read.expect("sound").mesh.blocks[0].kind.to_string()
    };
    assert_eq!(kind("3 3 0"), "quadrangle16");
    assert_eq!(kind("7 1 0"), "lagrange-quadrangle16");
}

/// Numbers that look random and are the same on every day.
fn random(state: &mut u64, below: usize) -> usize {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 33) as usize % below
}

/// Cells of first order of all kinds, and data of several types on points and cells.
fn any_mesh(state: &mut u64) -> Mesh {
    let points = 1 + random(state, 20);
    let kinds = [
        CellKind::Vertex,
        CellKind::Line,
        CellKind::Triangle,
        CellKind::Quadrangle,
        CellKind::Tetrahedron,
        CellKind::Hexahedron,
        CellKind::Prism,
        CellKind::Pyramid,
        CellKind::Line3,
        CellKind::Triangle6,
    ];
    let mut blocks: Vec<CellBlock> = Vec::new();
    for _ in 0..1 + random(state, 12) {
        let kind = kinds[random(state, kinds.len())];
        let nodes: Vec<u32> = (0..kind.points())
            .map(|_| random(state, points) as u32)
            .collect();
        match blocks.last_mut() {
            Some(last) if last.kind == kind => last.nodes.to_mut().extend(nodes),
            _ => blocks.push(CellBlock::new(kind, nodes)),
        }
    }
    let cells = blocks.iter().map(CellBlock::len).sum();
    let mut number = || (random(state, 2001) as f64 - 1000.0) / 7.0;
    let points: Vec<[f64; 3]> = (0..points).map(|_| [(); 3].map(|()| number())).collect();
    let mut fields = Vec::new();
    for (k, (on, rows)) in [(Support::Points, points.len()), (Support::Cells, cells)]
        .into_iter()
        .flat_map(|on| [on; 4])
        .enumerate()
    {
        let width = [1, 2, 3, 9][k % 4];
        let all: Vec<f64> = (0..rows * width).map(|_| number()).collect();
        let values = match k % 4 {
            0 => Values::F64(all.into()),
            1 => Values::I32(all.iter().map(|&x| x as i32).collect()),
            2 => Values::F32(all.iter().map(|&x| x as f32).collect()),
            _ => Values::U8(all.iter().map(|&x| x as u8).collect()),
        };
        fields.push(Field::new(format!("data{k}"), on, width, values));
    }
    Mesh {
        points: points.into(),
        blocks,
        fields,
        ..Mesh::default()
    }
}

/// What is written `vtkio` reads equal, as text and in binary, and what it writes of that is read equal here.
#[test]
fn vtkio_and_this_crate_agree_on_legacy_files() {
    use vtkio::model::{Attribute, DataSet, IOBuffer, Piece, VertexNumbers};
    let folder = tempfile::tempdir().expect("a folder");
    let [path, again] = ["a.vtk", "b.vtk"].map(|name| folder.path().join(name));
    let seed = std::env::var("FACEOFF_SEED").ok();
    let mut state = seed.and_then(|seed| seed.parse().ok()).unwrap_or(2017);
    for case in 0..64 {
        let mesh = any_mesh(&mut state);
        let options = io::Options {
            binary: case % 2 == 0,
            ..io::Options::default()
        };
        io::write(&path, &mesh, &options).expect("written");
        let read = vtkio::Vtk::import(&path).expect("read");
        let DataSet::UnstructuredGrid { pieces, .. } = &read.data else {
            panic!("another grid")
        };
        let [Piece::Inline(piece)] = &pieces[..] else {
            panic!("another number of pieces")
        };
        let points: Vec<f64> = piece.points.cast_into().expect("numbers");
        assert_eq!(points, mesh.points.as_flattened(), "{case}");
        let VertexNumbers::Legacy { vertices, .. } = &piece.cells.cell_verts else {
            panic!("cells of another version")
        };
        let cells = mesh.cells().flat_map(|(_, _, nodes)| {
            std::iter::once(nodes.len() as u32).chain(nodes.iter().copied())
        });
        assert!(cells.eq(vertices.iter().copied()), "{case}");
        let types = piece.cells.types.iter().map(|kind| *kind as u8);
        let expected = mesh.cells().map(|(_, kind, _)| match kind {
            CellKind::Vertex => 1,
            CellKind::Line => 3,
            CellKind::Triangle => 5,
            CellKind::Quadrangle => 9,
            CellKind::Tetrahedron => 10,
            CellKind::Hexahedron => 12,
            CellKind::Prism => 13,
            CellKind::Pyramid => 14,
            CellKind::Line3 => 21,
            _ => 22,
        });
        assert!(types.eq(expected), "{case}");
        let both = [
            (Support::Points, &piece.data.point),
            (Support::Cells, &piece.data.cell),
        ];
        let mut compared = 0;
        for (on, attributes) in both {
            let mut arrays: Vec<(&str, &IOBuffer)> = Vec::new();
            for attribute in attributes {
                match attribute {
                    Attribute::DataArray(array) => arrays.push((&array.name, &array.data)),
                    Attribute::Field { data_array, .. } => {
                        arrays.extend(data_array.iter().map(|of| (&*of.name, &of.data)));
                    }
                }
            }
            for (name, data) in arrays {
                let mut known = mesh.fields.iter().filter(|field| field.on == on);
                let mine = known.find(|field| field.name == name);
                let mine = mine.unwrap_or_else(|| panic!("{case}: {name}"));
                let theirs: Vec<f64> = data.cast_into().expect("numbers");
                assert_eq!(mine.values.to_f64(), theirs, "{case}: {name}");
                compared += 1;
            }
        }
        assert_eq!(compared, mesh.fields.len(), "{case}");

        match case % 4 < 2 {
            true => read.export_be(&again).expect("written"),
            false => read.export_ascii(&again).expect("written"),
        }
        let back = io::read(&again).unwrap_or_else(|error| panic!("{case}: {error}"));
        assert_eq!(back.points, mesh.points, "{case}");
        assert_eq!(back.blocks, mesh.blocks, "{case}");
        assert_eq!(back.fields, mesh.fields, "{case}");
    }
}
