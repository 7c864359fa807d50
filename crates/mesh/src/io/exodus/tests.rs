use super::FORMAT;
use super::read::times;
use crate::field::GlobalArray;
use crate::io::netcdf::{Attribute, Writer};
use crate::io::polytopes::FACES;
use crate::io::{self, Format, Options};
use crate::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};

fn options(lossy: bool) -> Options {
    Options {
        format: Some(Format::Native(&FORMAT)),
        lossy,
        ..Options::default()
    }
}

/// Two cubes side by side, a side of one and two nodes in groups, and fields at two times.
pub(in crate::io) fn cubes() -> Mesh {
    let points = (0..12).map(|k| [f64::from(k % 3), f64::from(k / 3 % 2), f64::from(k / 6)]);
    let group = |dim, tag, name: Option<&str>, cells: &[u32]| Group {
        name: name.map(str::to_owned),
        cells: cells.to_vec(),
        ..Group::new(dim, tag)
    };
    let field = |name: &str, on, components, values: Vec<f64>, time| Field {
        time: Some(time),
        step: Some(if time == 0.5 { 1 } else { 2 }),
        ..Field::new(name, on, components, Values::F64(values.into()))
    };
    let at = |time: f64| {
        let u = (0..36).map(|k| f64::from(k) + time).collect();
        let on_one = Field {
            at: vec![1],
            ..field("p", Support::Cells, 1, vec![7.0 + time], time)
        };
        [field("u", Support::Points, 3, u, time), on_one]
    };
    Mesh {
        points: points.collect(),
        point_tags: (0..12).map(|k| 100 - k).collect(),
        blocks: vec![
            CellBlock::new(CellKind::Hexahedron, vec![0, 1, 4, 3, 6, 7, 10, 9]),
            CellBlock::new(CellKind::Hexahedron, vec![1, 2, 5, 4, 7, 8, 11, 10]),
            CellBlock::new(CellKind::Vertex, vec![3, 5]),
            CellBlock::new(CellKind::Quadrangle, vec![0, 6, 9, 3]),
        ],
        groups: vec![
            group(0, 4, Some("pins"), &[2, 3]),
            group(2, 9, Some("left"), &[4]),
            group(2, 11, None, &[]),
            group(3, 5, Some("steel"), &[0]),
            group(3, 6, Some("wood"), &[1]),
            group(3, 7, Some("all"), &[0, 1]),
        ],
        fields: [at(0.5), at(2.0)].concat(),
        ..Mesh::default()
    }
}

#[test]
fn groups_sets_numbers_and_times_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cubes.e");
    let mesh = cubes();
    let whole = [GlobalArray::numbers(
        "work",
        Values::F64(vec![1.0, 4.0].into()),
    )];
    let warnings = io::write_with(&path, &mesh, &whole, &options(false)).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    let content = io::open(&path, None).unwrap();
    assert_eq!(
        (content.format.as_str(), &content.whole[..]),
        ("exodus", &whole[..])
    );
    assert!(content.unread.is_empty() && content.warnings.is_empty());
    let back = content.mesh;
    assert_eq!(
        (&back.points, &back.point_tags),
        (&mesh.points, &mesh.point_tags)
    );
    assert_eq!(back.fields, mesh.fields);
    // The cells that were in sets come last: first those of lower dimension.
    let named = |mesh: &Mesh| -> Vec<_> {
        let groups = mesh
            .groups
            .iter()
            .map(|g| (g.dim, g.tag, g.name.clone(), g.cells.len()));
        groups.collect()
    };
    assert_eq!(named(&back), named(&mesh));
    let left = back.groups.iter().find(|group| group.tag == 9).unwrap();
    let mut side = back.cell(left.cells[0]).unwrap().1.to_vec();
    side.sort_unstable();
    assert_eq!(side, [0, 3, 6, 9]);
    assert_eq!(
        times(&path, &std::fs::read(&path).unwrap()).unwrap(),
        [0.5, 2.0]
    );
    let mut series = io::Series::open(&path).unwrap();
    assert_eq!(series.times, [Some(0.5), Some(2.0)]);
    let last = series.read(1, None).unwrap();
    assert_eq!(last.on_cells[0].values, [9.0]);
    assert_eq!(last.on_cells[0].at, Some(vec![1]));
}

#[test]
fn values_on_sides_keep_them_as_cells() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cubes.e");
    let mut mesh = cubes();
    let values = Values::F64((0..5).map(f64::from).collect());
    let ends_in_mark = Field::new("d_", Support::Points, 3, Values::F64(vec![2.0; 36].into()));
    mesh.fields = vec![Field::new("flux", Support::Cells, 1, values), ends_in_mark];
    // Sides have no numbers in the file: they get such as no element has.
    mesh.blocks[0].tags = vec![5];
    mesh.blocks[1].tags = vec![3];
    io::write(&path, &mesh, &options(false)).unwrap();
    let back = io::read(&path).unwrap();
    assert!(back.fields.iter().any(|field| field.name == "d_"));
    let mut numbers: Vec<u64> = back.cell_tags().collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), back.cell_count());
    let msh = path.with_extension("msh");
    io::write(
        &msh,
        &back,
        &Options {
            lossy: true,
            ..Options::default()
        },
    )
    .unwrap();
    assert!(io::read(&msh).unwrap().cell_tags().eq(back.cell_tags()));
    let flux = back
        .fields
        .iter()
        .find(|field| field.name == "flux")
        .unwrap();
    assert_eq!(flux.values.to_f64().iter().sum::<f64>(), 10.0);
    assert_eq!(back.groups.len(), mesh.groups.len());
}

#[test]
fn what_it_cannot_hold_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cubes.e");
    let mut mesh = cubes();
    mesh.fields = vec![Field::new(
        "d",
        Support::CellPoints,
        1,
        Values::F64(vec![0.0; 22].into()),
    )];
    let error = io::write(&path, &mesh, &options(false))
        .unwrap_err()
        .to_string();
    assert!(error.contains("the field \"d\" on cell points"), "{error}");
    assert!(!path.exists());
    let warnings = io::write(&path, &mesh, &options(true)).unwrap();
    assert!(warnings[0].contains("\"d\""), "{warnings:?}");
}

#[test]
fn damaged_files_are_refused_and_never_more() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cubes.e");
    io::write(&path, &cubes(), &options(false)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let mut refused = 0;
    for end in 4..bytes.len() {
        // Padding at the end may be missing.
        refused += usize::from(io::parse(&path, &bytes[..end], None).is_err());
    }
    assert!(
        refused + 16 > bytes.len() - 4,
        "{refused} of {}",
        bytes.len()
    );
    let mut random = 1u32;
    for _ in 0..3000 {
        let mut damaged = bytes.clone();
        for _ in 0..3 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let place = (random >> 8) as usize % damaged.len();
            damaged[place] = (random >> 3) as u8;
        }
        let _ = io::parse(&path, &damaged, None);
    }
}

/// Two cubes by their eleven faces, and a block of a triangle, a quadrangle and a pentagon.
#[test]
fn polygons_and_polyhedra_are_read() {
    let mesh = cubes();
    let points = &mesh.points;
    let write = |path: &std::path::Path, of_cells: [i64; 12]| {
        let mut file = Writer::default();
        for (name, length) in [
            ("num_dim", 3),
            ("num_nodes", 12),
            ("num_el_blk", 2),
            ("num_fa_blk", 1),
            ("num_el_in_blk1", 2),
            ("num_el_in_blk2", 3),
            ("num_fac_per_el1", 12),
            ("num_nod_per_el2", 12),
            ("num_fa_in_blk1", 11),
            ("num_nod_per_fa1", 44),
            ("time_step", 0),
        ] {
            file.dimension(name, length);
        }
        for (axis, name) in ["coordx", "coordy", "coordz"].into_iter().enumerate() {
            file.floats(name, &["num_nodes"], move |_, k| points[k][axis]);
        }
        file.integers("eb_prop1", &["num_el_blk"], |k| [7, 8][k]);
        file.integers("fa_prop1", &["num_fa_blk"], |_| 1);
        file.integers("fbconn1", &["num_nod_per_fa1"], |k| FACES.as_flattened()[k]);
        file.integers("fbepecnt1", &["num_fa_in_blk1"], |_| 4);
        file.integers("facconn1", &["num_fac_per_el1"], move |k| of_cells[k]);
        file.integers("ebepecnt1", &["num_el_in_blk1"], |_| 6);
        file.integers("connect2", &["num_nod_per_el2"], |k| {
            [1, 2, 4, 2, 3, 6, 5, 1, 2, 8, 10, 7][k]
        });
        file.of_last("elem_type", Attribute::Text("NSIDED".into()));
        file.integers("ebepecnt2", &["num_el_in_blk2"], |k| [3, 4, 5][k]);
        file.save(path).unwrap();
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("polyhedra.e");
    write(&path, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 6, 11]);
    let content = io::open(&path, None).unwrap();
    assert!(content.unread.is_empty(), "{:?}", content.unread);
    let back = content.mesh;
    let kinds: Vec<_> = back
        .blocks
        .iter()
        .map(|block| (block.kind, block.len()))
        .collect();
    let expected = [
        (CellKind::Polyhedron(8), 2),
        (CellKind::Triangle, 1),
        (CellKind::Quadrangle, 1),
        (CellKind::Polygon(5), 1),
    ];
    assert_eq!(kinds, expected);
    let second: Vec<&[u32]> = back.polyhedra.iter().nth(1).unwrap().collect();
    assert_eq!((second.len(), second[4]), (6, &[1, 4, 10, 7][..]));
    assert_eq!(back.blocks[3].nodes, [0, 1, 7, 9, 6]);
    let cells: Vec<_> = back
        .groups
        .iter()
        .map(|g| (g.dim, g.tag, g.cells.len()))
        .collect();
    assert_eq!(cells, [(2, 8, 3), (3, 7, 2)]);
    for (of_cells, part) in [
        (
            [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 6, 12],
            "there is no face 12",
        ),
        (
            [1, 2, 3, 4, 5, 6, 6, 8, 9, 10, 6, 11],
            "more than two cells",
        ),
        ([0, 2, 3, 4, 5, 6, 7, 8, 9, 10, 6, 11], "there is no face"),
    ] {
        write(&path, of_cells);
        let error = io::open(&path, None).unwrap_err().to_string();
        assert!(
            error.contains("facconn1") && error.contains(part),
            "{error}"
        );
    }
}
