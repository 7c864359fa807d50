//! Small files of the text formats, typed by hand (`fuzz/seeds/text`): what is in them, and that no damage to them makes a reader fail
//! except with a message.

use std::path::{Path, PathBuf};

use super::{Content, parse};
use crate::error::Result;
use crate::mesh::{CellKind, Mesh};

fn read(name: &str, bytes: &[u8]) -> Result<Content> {
    parse(Path::new(name), bytes, None)
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/text")
}

fn content(name: &str) -> Content {
    super::open(&folder().join(name), None).unwrap_or_else(|error| panic!("{error}"))
}

/// Dimension, tag, name and cells of each group.
fn groups(mesh: &Mesh) -> Vec<(u8, i64, &str, &[u32])> {
    let groups = mesh.groups.iter();
    groups
        .map(|g| (g.dim, g.tag, g.name.as_deref().unwrap_or(""), &g.cells[..]))
        .collect()
}

fn cells(mesh: &Mesh) -> Vec<(CellKind, Vec<u32>)> {
    mesh.cells()
        .map(|(_, kind, nodes)| (kind, nodes.to_vec()))
        .collect()
}

#[test]
fn medit_without_an_end_and_of_second_order() {
    let first = content("no-end.mesh");
    assert!(first.warnings[0].contains("no End"), "{:?}", first.warnings);
    assert_eq!(first.unread, ["the section Normals"]);
    assert_eq!(groups(&first.mesh), [(3, 7, "", &[0][..])]);
    // Every middle node lies between its corners, in Gmsh's order.
    let mesh = content("second.mesh").mesh;
    let (kind, nodes) = mesh.cell(0).expect("a cell");
    for (place, [a, b]) in super::sides::nodes(kind).enumerate() {
        let point = |place: usize| mesh.points[nodes[place] as usize];
        let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (point(a)[i] + point(b)[i]));
        assert_eq!(point(place), middle, "node {place}");
    }
    let geometry = "MeshVersionFormatted 0\nMaximalAngleOfCorner 44\nDimension 2\nVertices 2\n0 0 1\n1 0 1\nEdges 1\n1 2 1\nhVertices\n.1 .1\n";
    let error = read("o_g.mesh", geometry.as_bytes())
        .expect_err("no mesh")
        .to_string();
    assert!(error.contains("geometry for bamg"), "{error}");
}

/// Values in binary, of a mesh that is known.
#[test]
fn values_of_binary_medit() {
    let (mesh, path) = (content("no-end.mesh").mesh, Path::new("u.solb"));
    for version in 1..=4i32 {
        let mut bytes = Vec::new();
        let words = |bytes: &mut Vec<u8>, words: &[i32]| {
            words
                .iter()
                .for_each(|word| bytes.extend(word.to_le_bytes()))
        };
        let wide = |bytes: &mut Vec<u8>, value: u64, from: i32| match version >= from {
            true => bytes.extend(value.to_le_bytes()),
            false => bytes.extend((value as u32).to_le_bytes()),
        };
        words(&mut bytes, &[1, version, 3]);
        wide(&mut bytes, if version < 3 { 20 } else { 24 }, 3);
        words(&mut bytes, &[3, 62]);
        wide(&mut bytes, 0, 3);
        wide(&mut bytes, 4, 4);
        words(&mut bytes, &[2, 1, 2]);
        for value in 0..16i16 {
            match version {
                1 => bytes.extend(f32::from(value).to_le_bytes()),
                _ => bytes.extend(f64::from(value).to_le_bytes()),
            }
        }
        let error = super::medit::sol::read(path, &bytes, &mesh)
            .expect_err("no end")
            .to_string();
        assert!(error.contains("End is missing"), "{error}");
        // As no place of the next section is given, the end follows at once.
        words(&mut bytes, &[54]);
        wide(&mut bytes, 0, 3);
        let fields = super::medit::sol::read(path, &bytes, &mesh);
        let fields = fields.unwrap_or_else(|error| panic!("{version}: {error}"));
        assert_eq!(fields[0].values.to_f64(), [0.0, 4.0, 8.0, 12.0]);
        assert_eq!(
            (fields[1].components, &fields[1].values.to_f64()[3..6]),
            (3, &[5.0, 6.0, 7.0][..])
        );
    }
}

#[test]
fn mfem() {
    let mesh = content("curved.mesh").mesh;
    let expected = [
        (CellKind::Quadrangle9, vec![0, 1, 2, 3, 5, 6, 7, 8, 11]),
        (CellKind::Triangle6, vec![1, 4, 2, 9, 10, 6]),
        (CellKind::Line3, vec![1, 4, 9]),
    ];
    assert_eq!(cells(&mesh), expected);
    let expected = [
        (1, 5, "", &[2][..]),
        (1, 6, "side", &[2]),
        (2, 1, "", &[0]),
        (2, 2, "", &[1]),
        (2, 3, "both of them", &[0, 1]),
    ];
    assert_eq!(groups(&mesh), expected);
    let leaves = content("leaves.mesh").mesh;
    assert_eq!(
        (
            leaves.points.len(),
            leaves.count(CellKind::Quadrangle),
            leaves.count(CellKind::Triangle)
        ),
        (7, 2, 1)
    );
    assert_eq!(
        (leaves.points[5], leaves.points[6]),
        ([1.0, 0.0, 0.0], [1.0, 2.0, 0.0])
    );
    let made = content("box.mesh").mesh;
    assert_eq!(
        (
            made.points.len(),
            made.count(CellKind::Triangle),
            made.count(CellKind::Line)
        ),
        (6, 4, 6)
    );
    // Of a curved mesh with hanging vertices only the corners are known.
    let hanging = "MFEM mesh v1.1\ndimension\n2\nelements\n1\n1 2 0 1 2\nboundary\n0\nvertex_parents\n1\n2 0 1\nvertices\n3\nnodes\nFiniteElementCollection: Quadratic\nVDim: 2\nOrdering: 0\n0 1 0 .5 .6 0 .1\n 0 0 1 .1 .5 .5 .2\n";
    let hanging = read("h.mesh", hanging.as_bytes()).expect("read");
    assert_eq!(cells(&hanging.mesh), [(CellKind::Triangle, vec![0, 1, 2])]);
    assert_eq!(
        hanging.mesh.points,
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert!(
        hanging.unread[0].what.contains("how the cells are curved"),
        "{:?}",
        hanging.unread
    );
    let huge = b"MFEM mesh v1.0\ndimension\n2\nelements\n1\n1 2 0 1 4294967292\nboundary\n0\nvertices\n3\nnodes\nFiniteElementCollection: H1_2D_P2\nVDim: 2\nOrdering: 1\n0 0 1 0 0 1\n";
    let error = read("h.mesh", huge)
        .expect_err("no such vertex")
        .to_string();
    assert!(
        error.contains("vertex 4294967292 is beyond the 3 nodes"),
        "{error}"
    );
    let error = read("n.mesh", b"MFEM NURBS mesh v1.0\ndimension\n2\n")
        .expect_err("no cells")
        .to_string();
    assert!(
        error.contains("no cells before its patches are cut"),
        "{error}"
    );
}

#[test]
fn abaqus() {
    let found = content("parts.inp");
    let mesh = &found.mesh;
    assert_eq!(mesh.count(CellKind::Hexahedron), 2);
    // Turned by a quarter around the axis through x = 2.
    let far = mesh.points[9];
    assert!(
        (far[0] - 2.0).abs() < 1e-15 && (far[1] - 1.0).abs() < 1e-15,
        "{far:?}"
    );
    let names: Vec<_> = groups(mesh)
        .iter()
        .map(|(dim, _, name, cells)| (*dim, name.to_string(), cells.len()))
        .collect();
    let expected = [
        (0, "Two.all", 8),
        (0, "One.all", 8),
        (0, "corners", 2),
        (0, "more", 3),
        (2, "Two.top", 1),
        (2, "One.top", 1),
        (3, "One", 1),
        (3, "Two", 1),
        (3, "Two.solid", 1),
        (3, "Two.same", 1),
        (3, "One.solid", 1),
        (3, "One.same", 1),
    ];
    assert_eq!(
        names,
        expected.map(|(dim, name, count)| (dim, name.to_owned(), count))
    );
    let top = mesh
        .cells_of(CellKind::Quadrangle)
        .last()
        .expect("a side")
        .2;
    assert!(top.iter().all(|&node| mesh.points[node as usize][2] == 1.0));
    assert!(
        found
            .unread
            .iter()
            .any(|part| part.what.contains("MATERIAL, SOLID SECTION")),
        "{:?}",
        found.unread
    );

    let mesh = content("shell.inp").mesh;
    let expected = [
        (CellKind::Triangle6, vec![0, 1, 2, 3, 4, 5]),
        (CellKind::Line3, vec![0, 1, 3]),
    ];
    // The line is a side of the triangle and not doubled.
    assert_eq!(cells(&mesh), expected);
    assert_eq!(
        groups(&mesh),
        [
            (1, 1, "outside", &[1][..]),
            (2, 1, "E", &[0]),
            (2, 2, "outside", &[0])
        ]
    );
    assert!((mesh.points[2][0] + 1.0).abs() < 1e-15);

    for (text, words) in [
        (
            "*NODE\n1, 0\n*ELEMENT, TYPE=T3D2\n1, 1, 2\n",
            "node 2, which does not exist",
        ),
        (
            "*NODE\n1, 0\n*ELEMENT, TYPE=T3D2\n1, 1\n*STEP\n",
            "has 1 nodes, and a line has 2",
        ),
        ("*NODE\n1, x\n", "expected a number, found \"x\""),
        (
            "*NODE\n1, 0\n*NGEN\n1, 5, 1\n",
            "*NGEN makes a mesh out of numbers",
        ),
        ("*NODE\n1, 0\n1, 0\n", "node 1 appears twice"),
        ("*INCLUDE, INPUT=../other.inp\n", "outside of the folder"),
        ("*HEADING\nnothing\n", "no nodes"),
    ] {
        let error = read("a.inp", text.as_bytes()).expect_err(text).to_string();
        assert!(error.contains(words), "{error}");
    }
    // A set of everything in each of many lines would take far more than the file.
    let nodes: String = (1..3000).map(|n| format!("{n}\n")).collect();
    let sets: String = (0..3000)
        .map(|n| format!("*NSET,NSET={n},GENERATE\n1,3000\n"))
        .collect();
    let error = read("a.inp", format!("*NODE\n{nodes}{sets}").as_bytes())
        .expect_err("too many")
        .to_string();
    assert!(error.contains("more members than is plausible"), "{error}");
}

#[test]
fn files_that_include_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let write =
        |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write(
        "all.inp",
        "*INCLUDE, INPUT=nodes.inc\n*ELEMENT, TYPE=T3D2\n1, 1, 2\n*INCLUDE, INPUT=none.inc\n",
    );
    write("nodes.inc", "*NODE\n1, 0\n2, 1\n");
    let content = super::open(&folder.path().join("all.inp"), None).expect("read");
    assert_eq!(content.mesh.count(CellKind::Line), 1);
    assert_eq!(
        content.unread,
        ["the included file none.inc, which is not there"]
    );
    write("all.bdf", "CROD,1,1,1,2\nINCLUDE 'grid.bdf'\n$ GRID\n");
    write("grid.bdf", "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n");
    let content = super::open(&folder.path().join("all.bdf"), None).expect("read");
    assert_eq!(content.mesh.count(CellKind::Line), 1);
    for (name, text) in [
        ("round.inp", "*INCLUDE, INPUT=round.inp\n"),
        ("round.bdf", "INCLUDE 'round.bdf'\n$ GRID\n"),
    ] {
        write(name, text);
        let error = super::open(&folder.path().join(name), None)
            .expect_err(name)
            .to_string();
        assert!(error.contains("too many files"), "{error}");
    }
}

#[test]
fn ucd() {
    let found = content("cells.inp");
    assert_eq!(found.format, "avsucd");
    let mesh = &found.mesh;
    // The tip of the pyramid comes last.
    assert_eq!(
        mesh.cell(0),
        Some((CellKind::Pyramid, &[0, 1, 2, 3, 4][..]))
    );
    assert_eq!(groups(mesh), [(2, 2, "", &[1][..]), (3, 1, "", &[0])]);
    assert!(
        found.warnings[0].contains("same number"),
        "{:?}",
        found.warnings
    );
    let fields: Vec<_> = mesh
        .fields
        .iter()
        .map(|f| (f.name.as_str(), f.components, f.values.to_f64()))
        .collect();
    let expected = [
        ("t", 1, vec![1.0, 2.0, 3.0, 4.0, 5.0]),
        ("v", 2, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]),
    ];
    assert_eq!(fields, expected);

    // The top of a brick first, as AVS has it.
    let brick = "8 1 0 0 0\n1 0 0 1\n2 1 0 1\n3 1 1 1\n4 0 1 1\n5 0 0 0\n6 1 0 0\n7 1 1 0\n8 0 1 0\n1 1 hex 1 2 3 4 5 6 7 8\n";
    let brick = read("brick.inp", brick.as_bytes()).expect("read");
    assert_eq!(brick.mesh.blocks[0].nodes, [4, 5, 6, 7, 0, 1, 2, 3]);
    assert!(
        brick.warnings[0].contains("turned over"),
        "{:?}",
        brick.warnings
    );

    // The same in binary, in both byte orders: a line with a field on its points.
    for big in [false, true] {
        let mut bytes = vec![7u8];
        let mut word = |word: [u8; 4]| {
            bytes.extend(if big {
                word.into_iter().rev().collect::<Vec<u8>>()
            } else {
                word.to_vec()
            })
        };
        [2, 1, 1, 0, 0, 2, 1, 5, 2, 1, 1, 2]
            .iter()
            .for_each(|n: &i32| word(n.to_le_bytes()));
        [0.0f32, 3.0, 0.0, 4.0, 0.0, 0.0]
            .iter()
            .for_each(|x| word(x.to_le_bytes()));
        bytes.extend(*b"heat.");
        bytes.resize(bytes.len() + 2043, 0);
        let mut word = |word: [u8; 4]| {
            bytes.extend(if big {
                word.into_iter().rev().collect::<Vec<u8>>()
            } else {
                word.to_vec()
            })
        };
        [1, 1].iter().for_each(|n: &i32| word(n.to_le_bytes()));
        [0.5f32, 2.5, 0.5, 2.5, 0.0]
            .iter()
            .for_each(|x| word(x.to_le_bytes()));
        let found = read("b.inp", &bytes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            found.encoding,
            if big { "binary-big" } else { "binary-little" }
        );
        assert_eq!(found.mesh.points, [[0.0; 3], [3.0, 4.0, 0.0]]);
        assert_eq!(groups(&found.mesh), [(1, 5, "", &[0][..])]);
        assert_eq!(
            (
                found.mesh.fields[0].name.as_str(),
                found.mesh.fields[0].values.to_f64()
            ),
            ("heat", vec![0.5, 2.5])
        );
    }
}

#[test]
fn unv() {
    let found = content("plate.unv");
    let mesh = &found.mesh;
    let expected = [
        (CellKind::Triangle6, vec![0, 1, 2, 3, 4, 5]),
        (CellKind::Line3, vec![0, 1, 3]),
        (CellKind::Vertex, vec![2]),
    ];
    assert_eq!(cells(mesh), expected);
    assert_eq!(
        groups(mesh),
        [(0, 3, "the side", &[2][..]), (1, 3, "the side", &[1])]
    );
    assert_eq!(mesh.point_tags[..2], [5, 6]);
    let property = &mesh.fields[0];
    assert_eq!(
        (property.name.as_str(), property.at.as_slice()),
        ("property", &[0, 1][..])
    );
    let heat = &mesh.fields[1];
    assert_eq!(
        (heat.name.as_str(), heat.time, heat.step),
        ("temperature", Some(2.5), Some(3))
    );
    assert_eq!(
        (heat.at.as_slice(), heat.values.to_f64()),
        (&[0, 1][..], vec![3.0, -1.0])
    );
    assert!(found.warnings.is_empty() && found.unread.is_empty());
}

#[test]
fn nastran() {
    let found = content("cards.bdf");
    let mesh = &found.mesh;
    assert_eq!(
        cells(mesh),
        [
            (CellKind::Tetrahedron, vec![0, 1, 2, 3]),
            (CellKind::Triangle, vec![0, 1, 2])
        ]
    );
    assert_eq!(groups(mesh), [(2, 6, "", &[1][..]), (3, 5, "", &[0])]);
    // The first axis of the system 9 is the second one of the mesh.
    assert_eq!(mesh.points[1], [1.0, 0.0, 0.0]);
    assert_eq!(mesh.points[2], [1.0, 0.0, 0.0]);
    assert_eq!(mesh.points[3], [0.0, 0.0, 0.15]);
    assert_eq!(found.unread, ["the cards 1 CBUSH to the ground, 1 PSOLID"]);
    // A deck without its head, as programs include it.
    let bulk = b"$ a comment\nGRDSET,,,,,,,123\nGRID,1\nGRID,2,,1.\nCROD,1,1,1,2\n";
    let mesh = read("bulk.nas", bulk).expect("read").mesh;
    assert_eq!(cells(&mesh), [(CellKind::Line, vec![0, 1])]);
}

#[test]
fn su2() {
    let found = content("zones.su2");
    let mesh = &found.mesh;
    assert_eq!((mesh.points.len(), mesh.points[3]), (6, [5.0, 0.0, 0.0]));
    let expected = [
        (1, 1, "wall", &[2][..]),
        (1, 2, "both", &[2, 3]),
        (2, 1, "zone 1", &[0]),
        (2, 2, "zone 2", &[1]),
    ];
    assert_eq!(groups(mesh), expected);
    assert_eq!(found.unread, ["FFD_TAG= box"]);
}

#[test]
fn surfaces() {
    let mesh = content("text.stl").mesh;
    assert_eq!(
        cells(&mesh),
        [
            (CellKind::Triangle, vec![0, 1, 2]),
            (CellKind::Triangle, vec![1, 3, 2])
        ]
    );
    assert_eq!(groups(&mesh), [(2, 1, "one side", &[0, 1][..])]);
    let mut bytes = b"solid by name, binary by its length".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(1u32.to_le_bytes());
    let numbers = [
        0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0,
    ];
    bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([1, 0]);
    let found = read("b.stl", &bytes).expect("read");
    assert_eq!(
        found.mesh.points,
        [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]
    );
    assert_eq!(found.unread, ["the attributes of 1 triangles"]);

    let found = content("faces.off");
    assert_eq!(
        cells(&found.mesh),
        [
            (CellKind::Quadrangle, vec![0, 1, 2, 3]),
            (CellKind::Triangle, vec![2, 4, 3]),
            (CellKind::Polygon(5), vec![0, 1, 2, 4, 3])
        ]
    );
    assert_eq!(found.unread, ["colours or normals of 2 points and faces"]);

    let text = content("faces.ply").mesh;
    assert_eq!(
        cells(&text),
        [
            (CellKind::Triangle, vec![0, 1, 2]),
            (CellKind::Quadrangle, vec![0, 1, 2, 3])
        ]
    );
    let fields: Vec<_> = text
        .fields
        .iter()
        .map(|f| (f.name.as_str(), f.values.to_f64()))
        .collect();
    assert_eq!(
        fields,
        [
            ("red", vec![1.0, 2.0, 3.0, 4.0]),
            ("quality", vec![0.5, 0.25])
        ]
    );
    for big in [false, true] {
        let head = std::fs::read_to_string(folder().join("faces.ply")).expect("there");
        let head = head.split_inclusive("end_header\n").next().expect("a head");
        let mut bytes = head
            .replace(
                "ascii",
                if big {
                    "binary_big_endian"
                } else {
                    "binary_little_endian"
                },
            )
            .into_bytes();
        let word = |word: [u8; 4]| {
            if big {
                word.into_iter().rev().collect::<Vec<u8>>()
            } else {
                word.to_vec()
            }
        };
        for (at, red) in text.points.iter().zip(1u8..) {
            at.iter()
                .for_each(|&x| bytes.extend(word((x as f32).to_le_bytes())));
            bytes.push(red);
        }
        for (corners, quality) in [(&[0, 1, 2][..], 0.5f32), (&[0, 1, 2, 3], 0.25)] {
            bytes.push(corners.len() as u8);
            corners
                .iter()
                .for_each(|corner: &i32| bytes.extend(word(corner.to_le_bytes())));
            bytes.extend(word(quality.to_le_bytes()));
        }
        assert_eq!(read("b.ply", &bytes).expect("read").mesh, text);
    }

    let found = content("faces.obj");
    let expected = [
        (CellKind::Triangle, vec![0, 1, 2]),
        (CellKind::Quadrangle, vec![0, 1, 2, 3]),
        (CellKind::Line, vec![0, 1]),
        (CellKind::Line, vec![1, 2]),
    ];
    assert_eq!(cells(&found.mesh), expected);
    let names: Vec<_> = groups(&found.mesh)
        .iter()
        .map(|group| (group.0, group.2.to_owned(), group.3.to_vec()))
        .collect();
    let expected = [
        (1, "body", vec![2, 3]),
        (1, "left", vec![2, 3]),
        (2, "body", vec![0, 1]),
        (2, "left", vec![0, 1]),
        (2, "right", vec![0, 1]),
    ];
    assert_eq!(
        names,
        expected.map(|(dim, name, cells)| (dim, name.to_owned(), cells))
    );
    assert_eq!(found.unread, ["1 lines of mtllib", "1 lines of vn"]);
}

#[test]
fn msh_as_gmsh_reads_it() {
    let found = content("three.msh");
    assert_eq!(found.mesh.count(CellKind::Triangle), 2);
    assert_eq!(
        groups(&found.mesh),
        [(1, 9, "edge", &[][..]), (2, 4, "one", &[0, 1])]
    );
    let told = [
        "the name \"two\" of group 4, which is called \"one\" already",
        "\"more\" behind the name \"edge\"",
        "which elements 1 others are parts of",
    ];
    assert_eq!(found.unread, told);
    let found = content("rows.msh");
    assert_eq!(found.mesh.fields[0].values.to_f64(), [5.0, 6.0, 7.0]);
    let told = [
        "what $Nodes has beyond the number of rows that it declares",
        "1 rows of the field \"u\", of nodes that are not in the file",
    ];
    assert_eq!(found.unread, told);
    let old = "$NOE\n2\n1 0 0 0\n2 1 0 0\n$ENDNOE\n$ELM\n1\n1 1 5 5 2 1 2\n$ENDELM\n";
    assert_eq!(
        read("a.txt", old.as_bytes())
            .expect("sound")
            .mesh
            .count(CellKind::Line),
        1
    );
    // Links come before the nodes that they name.
    let link = |slave: u32| format!("$Periodic\n1\n0 {slave} 1\n1\n{slave} 1\n$EndPeriodic\n");
    let read = |links: String| {
        let text = format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{links}$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n\
             $Elements\n1\n1 1 2 5 5 1 2\n$EndElements\n"
        );
        read("a.msh", text.as_bytes())
    };
    let found = read(link(2) + &link(2)).expect("sound");
    let pairs = found
        .mesh
        .geometry
        .periodic
        .iter()
        .map(|link| &link.pairs[..]);
    assert_eq!(pairs.collect::<Vec<_>>(), [[[1, 0]]; 2]);
    let error = read(link(3)).expect_err("there is no node 3").to_string();
    assert!(error.contains("a.msh:8, $Periodic: the node 3"), "{error}");
}

/// Cut anywhere, or with any byte changed, a file is read or rejected with a message, and what is read is sound.
#[test]
fn damage_is_refused_in_words() {
    let files: Vec<_> = std::fs::read_dir(folder()).expect("a folder").collect();
    assert!(files.len() > 16, "only {} files", files.len());
    for file in files {
        let path = file.expect("a file").path();
        let text = std::fs::read_to_string(&path).expect("text");
        let name = path.to_str().expect("UTF-8");
        let bytes = text.as_bytes();
        for end in 0..bytes.len() {
            drop(read(name, &bytes[..end]));
        }
        let mut changed = bytes.to_vec();
        for at in 0..bytes.len() {
            for value in [0xff, b'9', b'-', b' ', b'\n', b',', b'0', bytes[at] ^ 1] {
                changed[at] = value;
                drop(read(name, &changed));
            }
            changed[at] = bytes[at];
        }
        // A number that is never valid, wherever a number can be.
        let words: Vec<&str> = text
            .split_inclusive(|c: char| c.is_whitespace() || c == ',')
            .collect();
        for place in 0..words.len() {
            if words[place].starts_with(|c: char| c.is_ascii_digit()) {
                let end = words[place]
                    .chars()
                    .last()
                    .filter(|c| !c.is_ascii_digit())
                    .map_or(String::new(), String::from);
                for huge in ["4000000000", "1000000000000000000", "-3"] {
                    let mut changed: Vec<String> =
                        words.iter().map(|word| word.to_string()).collect();
                    changed[place] = format!("{huge}{end}");
                    drop(read(name, changed.concat().as_bytes()));
                }
            }
        }
    }
}
