//! Files in the text formats are read again, and data that they cannot store are reported.

use crate::mesh::{CellKind, Mesh};

/// Written files are read again: all kinds of cells that the format can store, groups, fields and numbers.
#[test]
fn what_is_written_comes_back() {
    use crate::io::{Format, Options, write};
    use crate::mesh::{CellBlock, Field, Group, Support, Values};
    let folder = tempfile::tempdir().expect("a folder");
    let group = |dim, tag, name: Option<&str>, cells: &[u32]| Group {
        name: name.map(str::to_owned),
        cells: cells.to_vec(),
        ..Group::new(dim, tag)
    };
    let mesh = |kinds: &[CellKind], groups: Vec<Group>| {
        let block =
            |kind: &CellKind| CellBlock::new(*kind, (0..kind.points() as u32).rev().collect());
        Mesh {
            points: (0..27)
                .map(|i| [f64::from(i) / 3.0, 1e-300 * f64::from(i), -f64::from(i * i)])
                .collect(),
            blocks: kinds.iter().map(block).collect(),
            groups,
            ..Mesh::default()
        }
    };
    use CellKind as K;
    let labelled = [
        K::Line,
        K::Triangle,
        K::Quadrangle,
        K::Tetrahedron,
        K::Hexahedron,
        K::Prism,
        K::Pyramid,
        K::Line3,
        K::Triangle6,
        K::Quadrangle9,
        K::Tetrahedron10,
    ];
    let cases = [
        (
            "a.meshb",
            mesh(
                &labelled,
                vec![group(1, 3, None, &[0, 7]), group(3, -4, None, &[3, 10])],
            ),
        ),
        (
            "a.mesh",
            mesh(
                &labelled,
                vec![
                    group(1, 3, Some("a b"), &[0, 7]),
                    group(3, -4, None, &[3, 10]),
                ],
            ),
        ),
        (
            "a.su2",
            mesh(
                &[
                    K::Tetrahedron,
                    K::Hexahedron,
                    K::Prism,
                    K::Pyramid,
                    K::Triangle,
                    K::Quadrangle,
                ],
                vec![
                    group(2, 1, Some("wall"), &[4]),
                    group(2, 2, Some("the rest"), &[5]),
                ],
            ),
        ),
        ("a.inp", {
            // A brick and a tetrahedron, and behind them a vertex and sides, as a reader of sets appends them.
            let mut mesh = mesh(
                &[],
                vec![
                    group(0, 1, Some("tip"), &[2]),
                    group(2, 1, Some("bottom, or top"), &[3, 4]),
                    group(3, 1, Some("all"), &[0, 1]),
                ],
            );
            let block = |kind, nodes: &[u32]| CellBlock::new(kind, nodes.to_vec());
            mesh.blocks = vec![
                block(K::Hexahedron20, &(0..20).collect::<Vec<u32>>()),
                block(K::Tetrahedron, &[4, 5, 7, 20]),
                block(K::Vertex, &[20]),
                block(K::Quadrangle8, &[0, 1, 2, 3, 8, 11, 13, 9]),
                block(K::Triangle, &[4, 5, 7]),
            ];
            mesh
        }),
        ("a.unv", {
            let kinds = [
                K::Line,
                K::Line3,
                K::Triangle,
                K::Triangle6,
                K::Quadrangle,
                K::Quadrangle8,
                K::Tetrahedron,
                K::Tetrahedron10,
                K::Pyramid,
                K::Pyramid13,
                K::Prism,
                K::Prism15,
                K::Hexahedron,
                K::Hexahedron20,
            ];
            let mut mesh = mesh(
                &kinds,
                vec![
                    group(1, 7, Some("lines of it"), &[0, 1]),
                    group(3, 9, Some("solid"), &[6, 13]),
                ],
            );
            mesh.fields.push(Field {
                time: Some(0.1),
                step: Some(4),
                ..Field::new(
                    "u v",
                    Support::Points,
                    3,
                    Values::F64((0..81).map(|i| f64::from(i).sqrt()).collect()),
                )
            });
            mesh.fields.push(Field {
                at: vec![2, 13],
                time: Some(0.0),
                step: Some(0),
                ..Field::new(
                    "w",
                    Support::Cells,
                    2,
                    Values::F64(vec![1.0, -2.5, 1e-7, 3e100].into()),
                )
            });
            mesh
        }),
    ];
    for (name, mesh) in cases {
        let path = folder.path().join(name);
        let warnings =
            write(&path, &mesh, &Options::default()).unwrap_or_else(|error| panic!("{error}"));
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        let again = super::open(&path, None).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.mesh, mesh, "{name}");
        assert_eq!(again.unread, [""; 0], "{name}");
        assert_eq!(
            Format::of_suffix(&path).map(|format| format.to_string()),
            super::NATIVE
                .iter()
                .find(|native| native.names[0] == again.format)
                .map(|native| native.title.to_owned())
        );
    }
    // Data that a format cannot store are reported or refused.
    let solids = mesh(&[K::Line, K::Prism18], vec![group(3, 1, None, &[1])]);
    let plane = mesh(&[K::Triangle, K::Triangle6], vec![]);
    for (name, mesh, words) in [
        ("b.su2", &plane, "second order"),
        ("b.unv", &solids, "no number for"),
        ("b.inp", &solids, "no element for"),
        ("b.meshb", &solids, "no keyword for"),
    ] {
        let path = folder.path().join(name);
        let error = write(&path, mesh, &Options::default())
            .expect_err(name)
            .to_string();
        assert!(error.contains(words), "{error}");
        let options = Options {
            lossy: true,
            ..Options::default()
        };
        assert!(!write(&path, mesh, &options).expect("allowed").is_empty());
        let [kept, lost] = [mesh.blocks[0].kind, mesh.blocks[1].kind];
        let again = super::open(&path, None).expect(name).mesh;
        assert_eq!((again.count(kept), again.count(lost)), (1, 0), "{name}");
    }
    // Where nothing would be left there is no file.
    let path = folder.path().join("c.su2");
    for lossy in [false, true] {
        let options = Options {
            lossy,
            ..Options::default()
        };
        let error = write(&path, &solids, &options).expect_err("empty");
        assert!(error.to_string().contains("it has none"), "{error}");
        assert!(!path.exists());
    }
}
