//! VTK's own reader on what is written here. `tests/run` makes the Python with the package `vtk`.

use faceoff_mesh::field::{GlobalArray, data::same_bits};
use faceoff_mesh::io::{
    self,
    vtu::{self, Compressor, Encoding},
};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

const ENCODINGS: [Encoding; 9] = [
    Encoding::Ascii,
    Encoding::Base64(Compressor::None),
    Encoding::Base64(Compressor::Zlib),
    Encoding::Base64(Compressor::Lz4),
    Encoding::Base64(Compressor::Lzma),
    Encoding::Raw(Compressor::None),
    Encoding::Raw(Compressor::Zlib),
    Encoding::Raw(Compressor::Lz4),
    Encoding::Raw(Compressor::Lzma),
];

/// Two triangles with corners of their own, so that a field may jump between them, and the five faces as lines.
fn faces() -> (Mesh, Vec<GlobalArray>) {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0 / 3.0], [0.0, 1.0]];
    let at = |corner: usize| [corners[corner][0], corners[corner][1], 0.0];
    // A NaN with a payload, the smallest number, and the largest.
    let odd = f64::from_bits(0x7ff8_0000_dead_beef);
    let dofs = vec![0.1, odd, -0.0, 5e-324, f64::MAX];
    let mesh = Mesh {
        points: [0, 1, 2, 0, 2, 3].map(at).to_vec().into(),
        blocks: vec![
            CellBlock::new(CellKind::Triangle, (0..6).collect()),
            CellBlock::new(CellKind::Line, vec![0, 1, 1, 2, 0, 2, 4, 5, 5, 3]),
        ],
        groups: vec![Group {
            dim: 1,
            tag: 7,
            name: Some("Γ_C".into()),
            cells: vec![2, 6],
        }],
        fields: vec![
            Field::new(
                "u",
                Support::Points,
                1,
                Values::F64((0..6).map(|i| f64::from(i) / 7.0).collect()),
            ),
            Field {
                at: (2..7).collect(),
                ..Field::new("dof", Support::Cells, 1, Values::F64(dofs.into()))
            },
        ],
        ..Mesh::default()
    };
    let whole = vec![
        GlobalArray::text("engine", "dolfinx 0.5.2"),
        GlobalArray::text("scene", "Signorini, Ω = (0, 1)²"),
        GlobalArray::numbers("gamma", Values::F64(vec![10.0].into())),
    ];
    (mesh, whole)
}

fn hex(bytes: impl IntoIterator<Item = u8>) -> String {
    bytes
        .into_iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn float_bits(values: &[f64]) -> String {
    hex(values.iter().flat_map(|value| value.to_le_bytes()))
}

#[test]
fn face_fields_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("faces.vtu");
    let (mesh, whole) = faces();
    for encoding in ENCODINGS {
        vtu::write(&path, &mesh, &[], &whole, encoding).expect("written");
        let read = io::open(&path, None).expect("read");
        assert_eq!(read.whole, whole);
        assert_eq!(read.mesh.blocks, mesh.blocks);
        assert_eq!(read.mesh.groups, mesh.groups);
        for (read, written) in read.mesh.fields.iter().zip(&mesh.fields) {
            assert_eq!(read.at, written.at);
            // A decimal number does not tell one NaN from another.
            let same = same_bits(&read.values, &written.values);
            assert!(same || encoding == Encoding::Ascii, "{encoding:?} {read:?}");
        }
    }
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .collect();
    assert_eq!(left.len(), 1, "nothing half-written stays behind");
}

/// vtkio knows neither compression here nor raw bytes, and nothing of our reader.
#[test]
fn vtkio_reads_the_same() {
    use vtkio::model::{DataSet, IOBuffer, Piece, VertexNumbers};
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("faces.vtu");
    let (mesh, whole) = faces();
    for encoding in [Encoding::Ascii, Encoding::Base64(Compressor::None)] {
        vtu::write(&path, &mesh, &[], &whole, encoding).expect("written");
        let read = vtkio::Vtk::import(&path).expect("vtkio reads it");
        let DataSet::UnstructuredGrid { pieces, .. } = read.data else {
            panic!("{encoding:?}: {:?}", read.data)
        };
        let [Piece::Inline(piece)] = &pieces[..] else {
            panic!("{encoding:?}: {pieces:?}")
        };
        let IOBuffer::F64(points) = &piece.points else {
            panic!("{encoding:?}: {:?}", piece.points)
        };
        assert_eq!(float_bits(points), float_bits(mesh.points.as_flattened()));
        let VertexNumbers::XML {
            connectivity,
            offsets,
        } = &piece.cells.cell_verts
        else {
            panic!("{encoding:?}: {:?}", piece.cells.cell_verts)
        };
        let nodes = mesh
            .cells()
            .flat_map(|(_, _, nodes)| nodes.iter().map(|k| u64::from(*k)));
        assert_eq!(*connectivity, nodes.collect::<Vec<_>>(), "{encoding:?}");
        assert_eq!(*offsets, [3, 6, 8, 10, 12, 14, 16], "{encoding:?}");
        let types: Vec<u8> = piece.cells.types.iter().map(|kind| *kind as u8).collect();
        assert_eq!(types, [5, 5, 3, 3, 3, 3, 3], "{encoding:?}");
    }
}

#[test]
fn vtk_reads_the_same() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python/bin/python3");
    assert!(
        python.exists(),
        "{} is not there: run tests/run",
        python.display()
    );
    let folder = tempfile::tempdir().expect("a folder");
    let (mesh, whole) = faces();
    let paths: Vec<PathBuf> = (0..ENCODINGS.len())
        .map(|i| folder.path().join(format!("{i}.vtu")))
        .collect();
    for (path, encoding) in paths.iter().zip(ENCODINGS) {
        vtu::write(path, &mesh, &[], &whole, encoding).expect("written");
    }
    let empty = folder.path().join("empty.vtu");
    vtu::write(
        &empty,
        &Mesh::default(),
        &[],
        &[],
        Encoding::Raw(Compressor::Zlib),
    )
    .expect("written");

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vtk_reads.py");
    let output = Command::new(python)
        .arg(script)
        .args(&paths)
        .arg(&empty)
        .output()
        .expect("Python runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let grids: Vec<Value> = serde_json::from_slice(&output.stdout).expect("JSON");

    for (grid, encoding) in grids.iter().zip(ENCODINGS) {
        let points = float_bits(mesh.points.as_flattened());
        assert_eq!(
            grid["points"],
            json!(["float64", 3, points]),
            "{encoding:?}"
        );
        let cells: Vec<Vec<u32>> = mesh.cells().map(|(_, _, nodes)| nodes.to_vec()).collect();
        assert_eq!(grid["cells"], json!(cells), "{encoding:?}");
        assert_eq!(grid["types"], json!([5, 5, 3, 3, 3, 3, 3]), "{encoding:?}");
        let Values::F64(u) = &mesh.fields[0].values else {
            unreachable!("made so above")
        };
        assert_eq!(
            grid["point_data"]["u"],
            json!(["float64", 1, float_bits(u)]),
            "{encoding:?}"
        );
        // Texts are bytes, each with a NUL at its end.
        for (name, text) in [
            ("engine", "dolfinx 0.5.2\0"),
            ("scene", "Signorini, Ω = (0, 1)²\0"),
            ("faceoff:group_names", "Γ_C\0"),
        ] {
            let bytes = json!(["uint8", 1, hex(text.bytes())]);
            assert_eq!(grid["field_data"][name], bytes, "{encoding:?}");
        }
        let gamma = json!(["float64", 1, float_bits(&[10.0])]);
        assert_eq!(grid["field_data"]["gamma"], gamma, "{encoding:?}");
        if encoding != Encoding::Ascii {
            let Values::F64(dofs) = &mesh.fields[1].values else {
                unreachable!("made so above")
            };
            let all = [&[f64::NAN, f64::NAN], &dofs[..]].concat();
            assert_eq!(
                grid["cell_data"]["dof"],
                json!(["float64", 1, float_bits(&all)]),
                "{encoding:?}"
            );
        }
    }
    assert_eq!(grids.last().map(|grid| &grid["types"]), Some(&json!([])));
}
