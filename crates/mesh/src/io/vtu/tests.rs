//! Written files are read back, bit for bit; damaged files are rejected.

use super::*;
use crate::field::{GlobalArray, data::same_bits};
use crate::io::out::Out;
use crate::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};
use std::path::Path;

pub(super) const ENCODINGS: [Encoding; 9] = [
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

/// Two triangles and their four boundary edges, every group, number and field that VTU has a place for.
pub(super) fn square() -> Mesh {
    let block = |kind, nodes: &[u32], tags: &[u64], entities: &[i32]| CellBlock {
        kind,
        nodes: nodes.to_vec().into(),
        tags: tags.to_vec(),
        entities: entities.to_vec(),
    };
    let group = |dim, tag, name: Option<&str>, cells: &[u32]| Group {
        dim,
        tag,
        name: name.map(str::to_owned),
        cells: cells.to_vec(),
    };
    Mesh {
        points: vec![
            [0.0, 0.0, 0.0],
            [1.0, -0.0, 0.0],
            [1.0, 1.0 / 3.0, 0.0],
            [0.0, 1e-300, 0.0],
        ]
        .into(),
        point_tags: vec![7, 1 << 40, 9, 2],
        blocks: vec![
            block(CellKind::Line, &[0, 1, 1, 2], &[10, 11], &[1, 2]),
            block(CellKind::Line, &[2, 3, 3, 0], &[], &[3, 4]),
            block(CellKind::Triangle, &[0, 1, 2, 0, 2, 3], &[], &[]),
        ],
        groups: vec![
            group(1, -3, None, &[1]),
            group(1, 0, Some("Γ & \"<b>\""), &[0, 1, 3]),
            group(2, 0, Some(""), &[]),
            group(2, 1 << 33, Some("body\nof two lines"), &[4, 5]),
        ],
        fields: vec![
            Field::new(
                "u",
                Support::Points,
                1,
                Values::F64(vec![1.5, -0.0, 1e-310, 7.0].into()),
            ),
            Field::new("flag", Support::Cells, 2, Values::I8((-6..6).collect())),
            Field {
                at: vec![1, 4],
                time: Some(0.1),
                ..Field::new(
                    "flag",
                    Support::Cells,
                    1,
                    Values::U64(vec![u64::MAX, 3].into()),
                )
            },
            Field {
                step: Some(-2),
                ..Field::new(
                    "σ",
                    Support::CellPoints,
                    1,
                    Values::F32(vec![0.5; 14].into()),
                )
            },
        ],
        ..Mesh::default()
    }
}

pub(super) fn provenance() -> Vec<GlobalArray> {
    vec![
        GlobalArray::text("engine", "FreeFEM 4.11, γ = 10"),
        GlobalArray::texts("notes", vec![String::new(), "second".into()]),
        GlobalArray::numbers("gamma", Values::F64(vec![10.0].into())),
    ]
}

/// Equal in every bit; the order of fields is that of sections.
pub(super) fn assert_same(read: &Mesh, written: &Mesh) {
    let bits = |mesh: &Mesh| {
        mesh.points
            .iter()
            .flatten()
            .map(|x| x.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(read), bits(written));
    assert_eq!(read.point_tags, written.point_tags);
    assert_eq!(read.blocks, written.blocks);
    assert_eq!(read.groups, written.groups);
    let mut fields: Vec<&Field> = written.fields.iter().collect();
    fields.sort_by_key(|field| field.on);
    assert_eq!(read.fields.len(), fields.len());
    for (a, b) in read.fields.iter().zip(fields) {
        assert!(same_bits(&a.values, &b.values), "{a:?} {b:?}");
        let rest = |field: &Field| Field {
            values: Values::U8(vec![].into()),
            ..field.clone()
        };
        assert_eq!(rest(a), rest(b));
    }
}

fn bytes_of(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
    write::encode(
        mesh,
        &[],
        &provenance(),
        encoding,
        layout::Topology::Cells,
        Out::default(),
    )
    .expect("a sound mesh")
    .bytes
}

fn reads(bytes: &[u8]) -> Result<Content> {
    from_bytes(Path::new("test.vtu"), bytes)
}

#[test]
fn every_encoding_gives_back_the_whole_mesh() {
    for encoding in ENCODINGS {
        for mesh in [square(), Mesh::default()] {
            let vtu = reads(&bytes_of(&mesh, encoding)).expect("read");
            assert_same(&vtu.mesh, &mesh);
            assert_eq!(vtu.whole, provenance());
            assert_eq!(vtu.version.as_deref(), Some("1.0"));
        }
    }
}

#[test]
fn every_truncation_is_refused() {
    for encoding in ENCODINGS {
        let bytes = bytes_of(&square(), encoding);
        for end in 0..bytes.trim_ascii_end().len() {
            assert!(reads(&bytes[..end]).is_err(), "{encoding:?} cut at {end}");
        }
    }
}
