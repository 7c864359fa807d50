//! Meshes through every format that is read and written here: nothing lost, nothing believed.

use std::path::{Path, PathBuf};

use faceoff_mesh::io::{self, Content, Format, Options, msh};
use faceoff_mesh::mesh::{
    CellBlock, CellKind, Entity, Field, Geometry, Group, Mesh, Support, Values,
};
use proptest::prelude::*;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn open(name: &str) -> Content {
    let path = data().join(name);
    io::open(&path, None).unwrap_or_else(|error| panic!("{error}"))
}

/// All meshes that Gmsh made, and their bytes.
fn files() -> Vec<(PathBuf, Vec<u8>)> {
    let entries = std::fs::read_dir(data()).expect("the folder of test data");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let meshes = paths.filter(|path| path.extension().is_some_and(|suffix| suffix == "msh"));
    let files: Vec<_> = meshes
        .map(|path| (path.clone(), std::fs::read(&path).expect("a file")))
        .collect();
    assert!(files.len() > 15, "only {} files", files.len());
    files
}

fn group(dim: u8, tag: i64, name: Option<&str>, cells: &[u32]) -> Group {
    Group {
        dim,
        tag,
        name: name.map(str::to_owned),
        cells: cells.to_vec(),
    }
}

#[test]
fn every_version_of_one_mesh_is_the_same_mesh() {
    let reference = open("square-4.1.msh").mesh;
    assert_eq!(reference.points.len(), 12);
    assert_eq!(reference.count(CellKind::Vertex), 1);
    assert_eq!(reference.count(CellKind::Line), 8);
    assert_eq!(reference.count(CellKind::Triangle), 14);
    let groups: Vec<(u8, i64, Option<&str>, usize)> = reference
        .groups
        .iter()
        .map(|g| (g.dim, g.tag, g.name.as_deref(), g.cells.len()))
        .collect();
    let expected = [
        (0, 9, Some("corner"), 1),
        (1, 1, Some("bottom side"), 2),
        (1, 3, None, 2),
        (1, 7, Some("sides"), 4),
        (2, 1, Some("Fläche"), 14),
    ];
    assert_eq!(groups, expected);
    for name in [
        "square-1.0.msh",
        "square-2.2.msh",
        "square-2.2-binary.msh",
        "square-4.0.msh",
        "square-4.1-binary.msh",
    ] {
        let mesh = open(name).mesh;
        for (a, b) in mesh
            .points
            .as_flattened()
            .iter()
            .zip(reference.points.as_flattened())
        {
            assert!((a - b).abs() < 1e-15, "{name}");
        }
        assert_eq!(mesh.points.len(), reference.points.len(), "{name}");
        assert_eq!(mesh.count(CellKind::Triangle), 14, "{name}");
        let cells = |mesh: &Mesh| {
            mesh.groups
                .iter()
                .map(|g| (g.dim, g.tag, g.cells.clone()))
                .collect::<Vec<_>>()
        };
        assert_eq!(cells(&mesh), cells(&reference), "{name}");
        if name != "square-1.0.msh" {
            assert_eq!(mesh.groups, reference.groups, "{name}");
        }
    }
}

#[test]
fn both_byte_orders_sparse_and_wide_tags() {
    let wide = open("big-endian-4.1.msh");
    assert_eq!(wide.encoding, "binary-big");
    assert_eq!(
        wide.mesh.points,
        [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.1, 1.0, 0.0]
        ]
    );
    assert_eq!(wide.mesh.point_tags, [7, 9, 1 << 40, 8]);
    assert_eq!(wide.mesh.blocks[0].nodes, [0, 1, 2, 0, 2, 3]);
    assert_eq!(wide.mesh.blocks[0].tags, [11, 12]);
    assert_eq!(wide.mesh.groups, [group(2, 6, Some("plate"), &[0, 1])]);
    assert_eq!(wide.mesh.geometry.entities[0].physicals, [-6]);
    let old = open("big-endian-2.2.msh");
    assert_eq!(
        (old.encoding.as_str(), &old.mesh.blocks[0].nodes[..]),
        ("binary-big", &[0, 1, 2, 0, 2, 3][..])
    );
    assert_eq!(old.mesh.groups, wide.mesh.groups);
}

#[test]
fn geometry_periodic_links_and_parts_are_kept() {
    let parametric = open("square-parametric.msh").mesh.geometry.point_runs;
    assert!(parametric.iter().any(|run| {
        run.dim == 2
            && run
                .parameters
                .as_ref()
                .is_some_and(|p| p.len() == 2 * run.count)
    }));
    let old = open("square-parametric-2.2.msh").mesh.geometry.point_runs;
    assert_eq!(old.iter().map(|run| run.count).sum::<usize>(), 12);
    for name in ["periodic.msh", "periodic-binary.msh", "periodic-2.2.msh"] {
        let links = open(name).mesh.geometry.periodic;
        let link = links
            .iter()
            .find(|link| link.dim == 1)
            .expect("a link of curves");
        assert_eq!(
            (link.entity, link.master, link.affine[3], link.pairs.len()),
            (2, 4, 1.0, 3),
            "{name}"
        );
    }
    for name in ["parts.msh", "parts-binary.msh"] {
        let geometry = open(name).mesh.geometry;
        assert_eq!(geometry.partitions.count, 2, "{name}");
        assert!(
            geometry
                .entities
                .iter()
                .any(|e| e.parent == Some((2, 1)) && e.partitions == [2]),
            "{name}"
        );
    }
    let quadratic = open("box-quadratic.msh").mesh;
    assert!(quadratic.count(CellKind::Tetrahedron10) > 0);
    let field = &quadratic.fields[0];
    assert_eq!(
        (
            field.name.as_str(),
            field.on,
            field.components,
            field.at.len()
        ),
        ("a b", Support::Points, 3, 5)
    );
    assert_eq!((field.time, field.step), (Some(0.5), Some(2)));
}

#[test]
fn what_gmsh_wrote_is_written_back() {
    for (path, _) in files() {
        let mesh = io::read(&path).expect("a sound mesh");
        for binary in [false, true] {
            let mut expected = mesh.clone();
            let mut again = round_trip(
                &mesh,
                &Options {
                    msh_version: msh::Version::V41,
                    binary,
                    ..Options::default()
                },
            );
            if mesh.geometry.entities.is_empty() {
                // 4.1 hangs groups on entities, which 1.0 and 2.2 do not declare, and partitions likewise.
                again.geometry.entities.clear();
                expected.geometry.partitions = Default::default();
            }
            if mesh.geometry.point_runs.is_empty() {
                again.geometry.point_runs.clear();
            }
            assert!(
                again == expected,
                "{} as MSH 4.1, binary: {binary}",
                path.display()
            );
        }
    }
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    for (path, bytes) in files().into_iter().chain(text_files()) {
        let text_end = bytes.trim_ascii_end().len();
        for end in 0..text_end {
            let result = io::parse(&path, &bytes[..end], None);
            // A file of numbers whose last number is cut is still one of numbers; one of words is not.
            let cut_number = path.extension().is_some_and(|e| e == "msh")
                && bytes[0] != b'$'
                && end + 3 > text_end;
            // Medit's End need not be there, and is missed in a warning.
            let warned = result.as_ref().is_ok_and(|content| {
                content
                    .warnings
                    .iter()
                    .any(|warning| warning.contains("no End"))
            });
            let ends_early =
                warned || (path.extension().is_some_and(|e| e == "mesh") && end + 3 >= text_end);
            // Nor can anyone tell that sections are missing that need not be there.
            let word = bytes[..end]
                .rsplit(|b| b.is_ascii_whitespace())
                .find(|word| !word.is_empty());
            let whole = bytes[end].is_ascii_whitespace() || bytes[end] == b'$';
            let at_section = whole && word.is_some_and(|word| word.starts_with(b"$End"));
            if !(cut_number || ends_early || at_section) {
                assert!(result.is_err(), "{} cut at {end}", path.display());
            }
        }
    }
}

/// FreeFEM's and Medit's form of a small mesh.
fn text_files() -> Vec<(PathBuf, Vec<u8>)> {
    vec![
        ("free.msh".into(), b"4 2 4\n0 0 1\n1 0 1\n1 1 2\n0 1 2\n1 2 3 5\n1 3 4 6\n1 2 11\n2 3 12\n3 4 13\n4 1 14\n".to_vec()),
        (
            "flat.mesh".into(),
            b"MeshVersionFormatted 2\nDimension 2\nVertices\n3\n0 0 1\n1 0 0\n0 1 0\nTriangles\n1\n1 2 3 7\nEdges\n1\n1 2 5\nEnd\n".to_vec(),
        ),
    ]
}

#[test]
fn a_changed_byte_never_panics() {
    for (path, bytes) in files().into_iter().chain(text_files()) {
        let mut changed = bytes.clone();
        for at in (0..bytes.len()).step_by(if bytes.len() > 3000 { 7 } else { 1 }) {
            for value in [0xff, 0x7f, b'9', b'-', b' ', bytes[at] ^ 1] {
                changed[at] = value;
                if let Ok(content) = io::parse(&path, &changed, None) {
                    assert_eq!(content.mesh.validate(), Ok(()));
                }
            }
            changed[at] = bytes[at];
        }
    }
}

/// Nobody could read so many, nor hold them: a reader that tries does not end, or dies.
#[test]
fn huge_counts_are_refused() {
    let huge = "1000000000000000000";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("huge.msh");
    let head = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    let cases = [
        format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{huge}\n1 0 0 0\n$EndNodes\n"),
        format!("$NOD\n{huge}\n1 0 0 0\n$ENDNOD\n"),
        format!("{head}$Nodes\n1 {huge} 1 {huge}\n2 1 0 {huge}\n1\n0 0 0\n$EndNodes\n"),
        format!("{head}$Nodes\n{huge} 1 1 1\n2 1 0 1\n1\n0 0 0\n$EndNodes\n"),
        format!("{head}$Entities\n{huge} 0 0 0\n$EndEntities\n"),
        format!("{head}$Entities\n0 0 1 0\n1 0 0 0 0 0 0 {huge} 1\n$EndEntities\n"),
        format!("{head}$PhysicalNames\n{huge}\n1 1 \"a\"\n$EndPhysicalNames\n"),
        format!("{huge} {huge} {huge}\n0 0 0\n"),
        format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{huge}\n0 0 0 0\nEnd\n"),
    ];
    for case in cases {
        std::fs::write(&path, &case).expect("written");
        assert!(io::open(&path, None).is_err(), "{case}");
    }
}

#[test]
fn errors_say_where() {
    let head =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n";
    let cases = [
        (
            format!("{head}$Elements\n1\n1 2 2 1 1 1 2 4\n$EndElements\n"),
            ":12, $Elements",
            "node 4",
        ),
        (
            format!("{head}$Elements\n1\n1 199 2 1 1 1 2 3\n$EndElements\n"),
            ":12, $Elements",
            "199",
        ),
        (
            format!("{head}$Elements\n2\n1 2 2 1 1 1 2 3\n1 2 2 1 1 2 3 1\n$EndElements\n"),
            "$Elements",
            "element 1 appears twice",
        ),
        (
            format!("{head}$Elements\n1\n1 2 2 1 1 1 2 3\n"),
            "$Elements",
            "expected $EndElements",
        ),
        (
            head.replace("2 1 0 0", "1 1 0 0"),
            "$Nodes",
            "node 1 appears twice",
        ),
        (head.replace("2 1 0 0", "2 nan 0 0"), ":7, $Nodes", "finite"),
        (head.replace("2.2 0 8", "5.0 0 8"), "$MeshFormat", "5.0"),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bad.msh");
    for (text, place, what) in cases {
        std::fs::write(&path, &text).expect("written");
        let message = io::open(&path, None).expect_err("a bad file").to_string();
        assert!(
            message.contains(place) && message.contains(what),
            "{message}"
        );
    }
}

#[test]
fn signs_and_order_of_physical_tags_are_kept() {
    let text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 0\n4 0 0 0 1 1 0 2 8 -3 0\n$EndEntities\n\
                $Nodes\n1 3 1 3\n2 4 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n\
                $Elements\n1 1 1 1\n2 4 2 1\n1 1 2 3\n$EndElements\n";
    let mesh = io::parse(Path::new("signs.msh"), text.as_bytes(), None)
        .expect("a sound mesh")
        .mesh;
    assert_eq!(
        mesh.groups,
        [group(2, 3, None, &[0]), group(2, 8, None, &[0])]
    );
    let options = Options {
        msh_version: msh::Version::V41,
        ..Options::default()
    };
    assert_eq!(round_trip(&mesh, &options), mesh);
}

#[test]
fn crlf_comments_and_unknown_sections_do_no_harm() {
    let text = "$Comments\nmade by hand\n$EndComments\n$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Foo\n1 2 3\n$EndFoo\n\
                $Nodes\n3\n1 0 0 0 \n2  1 0\t0\n3 0 1 0\n$EndNodes\n$Elements\n1\n1 2 2 -4 1 1 2 3\n$EndElements\n";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("odd.msh");
    std::fs::write(&path, text.replace('\n', "\r\n")).expect("written");
    let content = io::open(&path, None).expect("a sound mesh");
    assert_eq!(content.unread, ["the section $Foo"]);
    assert_eq!(content.mesh.groups, [group(2, 4, None, &[0])]);
    assert_eq!(content.warnings, [""; 0]);
}

/// In MSH 1 and 2 the sign stands at each element, in 4 at each entity.
#[test]
fn signs_of_elements_are_kept() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n\
                $Elements\n4\n1 2 2 -4 1 1 2 3\n2 2 2 -4 1 2 4 3\n3 1 2 4 1 1 2\n4 1 2 4 2 2 4\n$EndElements\n";
    let parse = |text: &str| {
        io::parse(Path::new("signs.msh"), text.as_bytes(), None).expect("a sound mesh")
    };
    let content = parse(text);
    let mesh = content.mesh;
    assert_eq!(content.unread, [""; 0]);
    assert_eq!(
        mesh.groups,
        [group(1, 4, None, &[2, 3]), group(2, 4, None, &[0, 1])]
    );
    assert_eq!(
        mesh.geometry.entities,
        [Entity {
            dim: 2,
            tag: 1,
            bounds: [[0.0; 3], [1.0, 1.0, 0.0]],
            physicals: vec![-4],
            ..Entity::default()
        }]
    );
    for (msh_version, binary) in [
        (msh::Version::V22, false),
        (msh::Version::V22, true),
        (msh::Version::V41, false),
        (msh::Version::V41, true),
    ] {
        let options = Options {
            msh_version,
            binary,
            ..Options::default()
        };
        let mut again = round_trip(&mesh, &options);
        again.geometry.entities.retain(Entity::is_reversed);
        again.geometry.point_runs.clear();
        assert_eq!(again, mesh, "{msh_version:?} {binary}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let warnings = io::write(&folder.path().join("m.mesh"), &mesh, &Options::default());
    let warnings = warnings.expect("labels").join("\n");
    assert!(warnings.contains("1 entities are reversed"), "{warnings}");

    // An entity of which only a part is reversed is beyond 4, and told.
    let mixed = parse(&text.replace("2 2 2 -4", "2 2 2 4"));
    let [lost] = mixed.unread.as_slice() else {
        panic!("{:?}", mixed.unread)
    };
    assert!(lost.what.contains("the groups of 1 elements"), "{lost}");
    assert_eq!(mixed.mesh.groups, mesh.groups);
}

fn round_trip(mesh: &Mesh, options: &Options) -> Mesh {
    let folder = tempfile::tempdir().expect("a folder");
    let suffix = if options.format == Format::of_name("medit") {
        "mesh"
    } else {
        "msh"
    };
    let path = folder.path().join("m").with_extension(suffix);
    io::write(&path, mesh, options).unwrap_or_else(|error| panic!("{error}"));
    io::read(&path).unwrap_or_else(|error| panic!("{error}"))
}

const KINDS: [CellKind; 7] = [
    CellKind::Vertex,
    CellKind::Line,
    CellKind::Triangle,
    CellKind::Tetrahedron,
    CellKind::Quadrangle9,
    CellKind::Prism,
    CellKind::Tetrahedron10,
];

prop_compose! {
    /// Any mesh that MSH holds: the nodes of cells are any points, as the formats do not mind.
    fn meshes()(
        points in prop::collection::vec(prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL), 1..12),
        sparse in any::<bool>(),
        blocks in prop::collection::vec((0..KINDS.len(), 1..5usize, 1..9i32), 0..5),
        choices in prop::collection::vec(any::<u32>(), 400),
        names in prop::collection::vec("[a-zA-Zäß ,:]{1,12}", 4),
        values in prop::collection::vec(prop::num::f64::NORMAL, 36),
    ) -> Mesh {
        let mut mesh = Mesh { points: points.into(), ..Mesh::default() };
        let count = mesh.points.len();
        if sparse {
            mesh.point_tags = (0..count as u64).map(|i| 1000 - 7 * i).collect();
        }
        let mut choice = choices.into_iter().cycle();
        let mut pick = |below: usize| choice.next().expect("a cycle does not end") as usize % below;
        let mut last = None;
        let mut cell = 0u32;
        for (kind, len, entity) in blocks {
            if last == Some(kind) {
                continue;
            }
            last = Some(kind);
            let kind = KINDS[kind];
            let nodes = (0..len * kind.points()).map(|_| pick(count) as u32).collect();
            let mut block = CellBlock::new(kind, nodes);
            block.entities = vec![entity; len];
            if sparse {
                block.tags = (0..len as u64).map(|i| 50 + u64::from(cell) + i).collect();
            }
            // One group for each entity, so that 4.1 can hang the one on the other.
            let tag = i64::from(entity) * 3;
            let cells = cell..cell + len as u32;
            match mesh.groups.iter_mut().find(|g| (g.dim, g.tag) == (kind.dim(), tag)) {
                Some(group) => group.cells.extend(cells),
                None => mesh.groups.push(Group { dim: kind.dim(), tag, name: names.get(entity as usize).map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()), cells: cells.collect() }),
            }
            cell += len as u32;
            mesh.blocks.push(block);
        }
        mesh.groups.sort_by_key(|group| (group.dim, group.tag));
        mesh.fields.push(Field {
            time: Some(0.25), step: Some(3),
            ..Field::new("u v", Support::Points, 3, Values::F64(values[..3 * count].to_vec().into()))
        });
        if count > 2 {
            mesh.fields.push(Field { at: vec![1], time: Some(0.0), step: Some(0), ..Field::new("part", Support::Points, 1, Values::F64(vec![2.5].into())) });
        }
        mesh
    }
}

proptest! {
    #![proptest_config(crate::common::test_config(128))]

    #[test]
    fn msh_gives_back_what_it_was_given(mesh in meshes(), v41 in any::<bool>(), binary in any::<bool>()) {
        let msh_version = if v41 { msh::Version::V41 } else { msh::Version::V22 };
        let mut again = round_trip(&mesh, &Options { msh_version, binary, ..Options::default() });
        let declared: Vec<Entity> = std::mem::take(&mut again.geometry.entities);
        prop_assert_eq!(declared.is_empty(), !v41 || mesh.blocks.is_empty());
        again.geometry.point_runs.clear();
        prop_assert_eq!(&again.geometry, &Geometry::default());
        prop_assert_eq!(again, mesh);
    }

    #[test]
    fn label_formats_give_back_what_they_were_given(
        points in prop::collection::vec(prop::array::uniform3(-1e9..1e9f64), 3..9),
        triangles in prop::collection::vec((prop::array::uniform3(0..3u32), -2..3i32), 1..9),
        lines in prop::collection::vec((prop::array::uniform2(0..3u32), 0..3i32), 1..9),
        point_labels in prop::collection::vec(1..5i32, 9),
        medit in any::<bool>(),
        solid in any::<bool>(),
    ) {
        let mut mesh = Mesh { points: points.into(), ..Mesh::default() };
        let count = mesh.points.len();
        if !(medit && solid) {
            mesh.points.to_mut().iter_mut().for_each(|point| point[2] = 0.0);
        }
        let line_block = CellBlock::new(CellKind::Line, lines.iter().flat_map(|l| l.0).collect());
        let triangle_block = CellBlock::new(CellKind::Triangle, triangles.iter().flat_map(|t| t.0).collect());
        let (line_start, triangle_start) = if medit { (0, lines.len()) } else { (triangles.len(), 0) };
        mesh.blocks = if medit { vec![line_block, triangle_block] } else { vec![triangle_block, line_block] };
        let mut add = |dim: u8, cell: usize, label: i32| {
            if label != 0 {
                match mesh.groups.iter_mut().find(|g| (g.dim, g.tag) == (dim, label.into())) {
                    Some(group) => group.cells.push(cell as u32),
                    None => mesh.groups.push(Group { dim, tag: label.into(), name: medit.then(|| format!("n {label}")), cells: vec![cell as u32] }),
                }
            }
        };
        lines.iter().enumerate().for_each(|(i, l)| add(1, line_start + i, l.1));
        triangles.iter().enumerate().for_each(|(i, t)| add(2, triangle_start + i, t.1));
        mesh.groups.sort_by_key(|group| (group.dim, group.tag));
        mesh.fields.push(Field::new("label", Support::Points, 1, Values::I32(point_labels[..count].to_vec().into())));
        let format = Format::of_name(if medit { "medit" } else { "freefem" });
        prop_assert_eq!(round_trip(&mesh, &Options { format, ..Options::default() }), mesh);
    }
}

#[test]
fn what_a_format_cannot_hold_is_an_error_or_a_warning() {
    let mesh = open("box-quadratic.msh").mesh;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.mesh");
    let mut options = Options::default();
    let message = io::write(&path, &mesh, &options)
        .expect_err("fields and vertices")
        .to_string();
    assert!(
        message.contains("vertex cells") && message.contains("a b"),
        "{message}"
    );
    assert!(!path.exists());
    options.lossy = true;
    let warnings = io::write(&path, &mesh, &options).expect("allowed");
    assert!(
        warnings
            .iter()
            .any(|warning| warning.contains("vertex cells")),
        "{warnings:?}"
    );

    let mut twice = open("square-4.1.msh").mesh;
    twice.groups.push(group(2, 8, Some("again"), &[9]));
    options.lossy = false;
    let path = path.with_extension("msh");
    let message = io::write(&path, &twice, &options)
        .expect_err("two groups")
        .to_string();
    assert!(
        message.contains("1 cells that are in several groups"),
        "{message}"
    );
    options.msh_version = msh::Version::V41;
    io::write(&path, &twice, &options).expect("4.1 holds cells of two groups");
    assert_eq!(io::read(&path).expect("sound").groups, twice.groups);
}

/// Numbers that go on as they should in one block need not have done so before.
#[test]
fn own_numbers_of_cells_stay_when_later_blocks_count_from_nought() {
    for (first, second) in [
        ([5, 6], [0, 1]),
        ([5, 6], [3, 4]),
        ([1, 2], [3, 4]),
        ([1, 2], [4, 3]),
    ] {
        let block = |kind, nodes: &[u32], tags: [u64; 2]| CellBlock {
            tags: tags.to_vec(),
            entities: vec![7; 2],
            ..CellBlock::new(kind, nodes.to_vec())
        };
        let mesh = Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
            blocks: vec![
                block(CellKind::Line, &[0, 1, 1, 2], first),
                block(CellKind::Triangle, &[0, 1, 2, 1, 2, 0], second),
            ],
            ..Mesh::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.msh");
        for msh_version in [msh::Version::V22, msh::Version::V41] {
            for binary in [false, true] {
                let options = Options {
                    msh_version,
                    binary,
                    ..Options::default()
                };
                io::write(&path, &mesh, &options).unwrap();
                let read = io::read(&path).unwrap();
                let tags: Vec<u64> = read.cell_tags().collect();
                assert_eq!(tags, [first, second].concat(), "{options:?}");
            }
        }
    }
}

/// What is declared of numbers is true, and those that 2.2 has no room for are given anew.
#[test]
fn ranges_of_numbers_are_told_and_wide_ones_given_anew() {
    let mut mesh = Mesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
        blocks: vec![
            CellBlock::new(CellKind::Line, vec![0, 1, 1, 2]),
            CellBlock::new(CellKind::Triangle, vec![0, 1, 2]),
        ],
        ..Mesh::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.msh");
    let options = |msh_version, binary| Options {
        msh_version,
        binary,
        ..Options::default()
    };
    for binary in [false, true] {
        io::write(&path, &mesh, &options(msh::Version::V41, binary)).unwrap();
        let read = io::open(&path, None).unwrap();
        assert_eq!(read.warnings, Vec::<String>::new());
        assert!(read.mesh.cell_tags().eq(1..=3));
    }
    mesh.point_tags = vec![1, 2, 1 << 40];
    mesh.blocks[1].tags = vec![1 << 40];
    for binary in [false, true] {
        let warnings = io::write(&path, &mesh, &options(msh::Version::V22, binary)).unwrap();
        let anew = |of: &str| {
            warnings
                .iter()
                .any(|told| told.contains(&format!("the {of} are renumbered")))
        };
        assert!(anew("points") && anew("cells"), "{warnings:?}");
        let read = io::read(&path).unwrap();
        assert!(read.point_tags.is_empty() && read.cell_tags().eq(1..=3));
    }
}
