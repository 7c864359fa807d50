//! Random meshes in every encoding.

use super::tests::{ENCODINGS, assert_same};
use super::*;
use crate::io::out::Out;
use crate::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};
use proptest::collection::{btree_map, btree_set, vec};
use proptest::prelude::*;

const KINDS: [CellKind; 18] = [
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
    CellKind::Quadrangle8,
    CellKind::Quadrangle9,
    CellKind::Tetrahedron10,
    CellKind::Hexahedron20,
    CellKind::Hexahedron27,
    CellKind::Prism15,
    CellKind::Prism18,
    CellKind::Pyramid13,
];

fn block(points: u32) -> impl Strategy<Value = CellBlock> {
    (
        prop::sample::select(&KINDS[..]),
        0usize..5,
        any::<bool>(),
        any::<bool>(),
    )
        .prop_flat_map(move |(kind, cells, tags, entities)| {
            (
                vec(0..points, cells * kind.points()),
                vec(any::<u64>(), if tags { cells } else { 0 }),
                vec(any::<i32>(), if entities { cells } else { 0 }),
            )
                .prop_map(move |(nodes, tags, entities)| CellBlock {
                    kind,
                    nodes: nodes.into(),
                    tags,
                    entities,
                })
        })
}

/// Any bits: NaN of every kind, infinities, numbers too small to be normal.
fn values(len: usize) -> BoxedStrategy<Values> {
    prop_oneof![
        vec(any::<u64>().prop_map(f64::from_bits), len).prop_map(|all| Values::F64(all.into())),
        vec(any::<u32>().prop_map(f32::from_bits), len).prop_map(|all| Values::F32(all.into())),
        vec(any::<i8>(), len).prop_map(|all| Values::I8(all.into())),
        vec(any::<u8>(), len).prop_map(|all| Values::U8(all.into())),
        vec(any::<i16>(), len).prop_map(|all| Values::I16(all.into())),
        vec(any::<u16>(), len).prop_map(|all| Values::U16(all.into())),
        vec(any::<i32>(), len).prop_map(|all| Values::I32(all.into())),
        vec(any::<u32>(), len).prop_map(|all| Values::U32(all.into())),
        vec(any::<i64>(), len).prop_map(|all| Values::I64(all.into())),
        vec(any::<u64>(), len).prop_map(|all| Values::U64(all.into())),
    ]
    .boxed()
}

fn field(mesh: &Mesh) -> impl Strategy<Value = Field> + use<> {
    let mesh = Mesh {
        fields: Vec::new(),
        ..mesh.clone()
    };
    let support = prop::sample::select(&[Support::Points, Support::Cells, Support::CellPoints][..]);
    (
        ("[a-c]{0,2}", support, 1usize..4),
        (
            btree_set(0u32..40, 0..4),
            proptest::option::of(-1e300..1e300f64),
            proptest::option::of(any::<i32>()),
        ),
    )
        .prop_flat_map(move |((name, on, components), (at, time, step))| {
            let limit = match on {
                Support::Points => mesh.points.len(),
                Support::Cells | Support::CellPoints => mesh.cell_count(),
            };
            let field = Field {
                at: at.into_iter().filter(|&at| (at as usize) < limit).collect(),
                time,
                step,
                ..Field::new(name, on, components, Values::U8(Vec::new().into()))
            };
            let len = field.expected_len(&mesh).unwrap_or(0);
            values(len).prop_map(move |values| Field {
                values,
                ..field.clone()
            })
        })
}

fn mesh() -> impl Strategy<Value = Mesh> {
    let single = any::<f32>().prop_map(|x| if x.is_finite() { x.into() } else { 0.5 });
    let point = (-1e300..1e300f64, single, -1.0..1.0f64).prop_map(|(x, y, z)| [x, y, z]);
    let points = vec(point, 1..30);
    (points, any::<bool>())
        .prop_flat_map(|(points, tagged)| {
            let count = points.len();
            (
                Just(points),
                vec(any::<u64>(), if tagged { count } else { 0 }),
                vec(block(count as u32), 0..5),
                btree_map(
                    (0u8..4, prop_oneof![-3i64..3, any::<i64>()]),
                    (proptest::option::of(".{0,4}"), vec(any::<bool>(), 25)),
                    0..5,
                ),
            )
        })
        .prop_map(|(points, point_tags, blocks, groups)| {
            let dims = blocks
                .iter()
                .flat_map(|b| std::iter::repeat_n(b.kind.dim(), b.len()));
            let dims: Vec<u8> = dims.collect();
            let groups = groups
                .into_iter()
                .map(|((dim, tag), (name, member))| Group {
                    dim,
                    tag,
                    name: name.map(|name: String| name.replace('\0', "")),
                    cells: (0..)
                        .zip(&dims)
                        .zip(member)
                        .filter(|&((_, &of), member)| member && of == dim)
                        .map(|((cell, _), _)| cell)
                        .collect(),
                });
            Mesh {
                points: points.into(),
                point_tags,
                groups: groups.collect(),
                blocks,
                ..Mesh::default()
            }
        })
        .prop_flat_map(|mesh| {
            let fields = vec(field(&mesh), 0..5);
            (Just(mesh), fields).prop_map(|(mesh, fields)| Mesh { fields, ..mesh })
        })
}

/// A decimal number does not distinguish one NaN from another.
fn forget_payloads(mesh: &mut Mesh) {
    for field in &mut mesh.fields {
        match &mut field.values {
            Values::F64(values) => values
                .to_mut()
                .iter_mut()
                .filter(|x| x.is_nan())
                .for_each(|x| *x = f64::NAN),
            Values::F32(values) => values
                .to_mut()
                .iter_mut()
                .filter(|x| x.is_nan())
                .for_each(|x| *x = f32::NAN),
            _ => {}
        }
    }
}

proptest! {
    #![proptest_config(crate::test_config(200))]

    #[test]
    fn any_mesh_comes_back(mut mesh in mesh(), encoding in prop::sample::select(&ENCODINGS[..])) {
        prop_assert_eq!(mesh.validate(), Ok(()));
        let bytes = write::encode(&mesh, &[], &[], encoding, layout::Topology::Cells, Out::default()).expect("a sound mesh").bytes;
        let mut read = from_bytes(Path::new("test.vtu"), &bytes).expect("a sound file");
        if encoding == Encoding::Ascii {
            forget_payloads(&mut mesh);
            forget_payloads(&mut read.mesh);
        }
        assert_same(&read.mesh, &mesh);
        prop_assert_eq!(read.whole, vec![]);
    }

    #[test]
    fn spliced_files_never_panic(
        encoding in prop::sample::select(&ENCODINGS[..]),
        from in any::<prop::sample::Index>(),
        to in any::<prop::sample::Index>(),
        length in 0usize..200,
        noise in vec(any::<u8>(), 0..20),
    ) {
        let bytes = write::encode(&tests::square(), &[], &[], encoding, layout::Topology::Cells, Out::default()).expect("a sound mesh").bytes;
        let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
        let mut spliced = bytes[..to].to_vec();
        spliced.extend_from_slice(&noise);
        spliced.extend_from_slice(&bytes[from..bytes.len().min(from + length)]);
        spliced.extend_from_slice(&bytes[to..]);
        let _ = from_bytes(Path::new("test.vtu"), &spliced);
    }
}
