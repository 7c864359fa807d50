//! The formats on HDF5: what is written comes back, and nothing that is damaged does harm.

use super::write::{Data, Group};
use crate::io::exodus::tests::cubes;
use crate::io::scalar::Number;
use crate::io::{self, Format, Options, Series};
use crate::mesh::{Mesh, Values};

const FORMATS: [(&str, &str); 4] = [
    ("xdmf", "xdmf"),
    ("vtkhdf", "vtkhdf"),
    ("med", "med"),
    ("cgns", "cgns"),
];

fn options(format: &str) -> Options {
    Options {
        format: Format::of_name(format),
        lossy: true,
        ..Options::default()
    }
}

/// Dimension, name, and the sorted nodes of the cells of each group that has cells.
fn groups(mesh: &Mesh) -> Vec<(u8, String, Vec<Vec<u32>>)> {
    let cells = |cells: &[u32]| {
        let sorted = |&cell: &u32| {
            let mut nodes = mesh.cell(cell).expect("a cell").1.to_vec();
            nodes.sort_unstable();
            nodes
        };
        let mut all: Vec<Vec<u32>> = cells.iter().map(sorted).collect();
        all.sort_unstable();
        all
    };
    let filled = mesh.groups.iter().filter(|group| !group.cells.is_empty());
    let named = filled.map(|group| {
        (
            group.dim,
            group.name.clone().unwrap_or_default(),
            cells(&group.cells),
        )
    });
    let mut all: Vec<_> = named.collect();
    all.sort_unstable();
    all
}

/// The values of a field of this name at each time, sorted, without NaN.
fn values(mesh: &Mesh, name: &str) -> Vec<(Option<f64>, Vec<f64>)> {
    let of = mesh.fields.iter().filter(|field| field.name == name);
    let sorted = |values: &Values| {
        let mut all: Vec<f64> = values
            .to_f64()
            .into_iter()
            .filter(|value| !value.is_nan())
            .collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let mut all: Vec<_> = of
        .map(|field| (field.time, sorted(&field.values)))
        .collect();
    all.sort_by(|a, b| a.0.partial_cmp(&b.0).expect("times"));
    all
}

/// What has no name in HDF5 is found again and again in itself.
#[test]
fn a_field_without_a_name_is_lost_or_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    for (format, suffix) in FORMATS {
        let path = folder.path().join(format!("nameless.{suffix}"));
        let mut mesh = cubes();
        mesh.fields[0].name = String::new();
        let losses = io::write(&path, &mesh, &options(format));
        if let Ok(losses) = losses {
            let back = io::open(&path, None).unwrap().mesh;
            let is_there = back.fields.iter().any(|field| field.name.is_empty());
            let is_lost = losses.iter().any(|of| of.contains("\"\""));
            assert!(is_there || is_lost, "{format}: {losses:?}");
        }
    }
}

#[test]
fn groups_fields_and_times_come_back() {
    let folder = tempfile::tempdir().unwrap();
    for (format, suffix) in FORMATS {
        let path = folder.path().join(format!("cubes.{suffix}"));
        let mesh = cubes();
        io::write(&path, &mesh, &options(format)).unwrap();
        // The content decides, not the suffix.
        let renamed = folder.path().join(format!("cubes.{suffix}.h5m"));
        std::fs::copy(&path, &renamed).unwrap();
        let content = io::open(&renamed, None).unwrap();
        assert_eq!(content.format, format);
        assert!(content.unread.is_empty(), "{format}: {:?}", content.unread);
        let back = content.mesh;
        assert_eq!(back.points, mesh.points, "{format}");
        assert_eq!(groups(&back), groups(&mesh), "{format}");
        for name in ["u", "p"] {
            assert_eq!(values(&back, name), values(&mesh, name), "{format} {name}");
        }
        let mut series = Series::open(&path).unwrap();
        assert_eq!(series.times, [Some(0.5), Some(2.0)], "{format}");
        let last = series.read(1, None).unwrap();
        let p = last
            .on_cells
            .iter()
            .find(|field| field.name == "p")
            .expect("p");
        let there: Vec<f64> = p
            .values
            .iter()
            .copied()
            .filter(|value| !value.is_nan())
            .collect();
        assert_eq!(there, [9.0], "{format}");
    }
}

#[test]
fn damaged_files_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    for (format, suffix) in FORMATS {
        let path = folder.path().join(format!("cubes.{suffix}"));
        io::write(&path, &cubes(), &options(format)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let step = (bytes.len() / 300).max(1);
        let refused = (0..bytes.len())
            .step_by(step)
            .filter(|&end| io::parse(&path, &bytes[..end], None).is_err());
        assert!(refused.count() > 250, "{format}");
        let mut random = 7u32;
        for _ in 0..400 {
            let mut damaged = bytes.clone();
            for _ in 0..2 {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let place = (random >> 8) as usize % damaged.len();
                damaged[place] ^= 1 << (random >> 29);
            }
            let _ = io::parse(&path, &damaged, None);
        }
    }
}

#[test]
fn numbers_texts_and_selections_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("numbers.h5");
    let table = Values::I16((0..12).collect());
    let mut file = Group::default();
    file.group("a/b")
        .add("table", Data::numbers(&table, 4))
        .with("name", Data::text("µ"));
    file.group("a")
        .add("words", Data::texts(vec!["one".into(), "three".into()], 8));
    file.group("a")
        .with("count", Data::integer(Number::U16, 65535));
    file.save(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let root = super::open(&path, &bytes).unwrap();
    assert_eq!(
        root.group("a/b").unwrap().unwrap().text("name").as_deref(),
        Some("µ")
    );
    assert_eq!(
        root.group("a").unwrap().unwrap().integers("count"),
        Some(vec![65535])
    );
    assert_eq!(
        root.data("a/words").unwrap().unwrap().texts().unwrap(),
        ["one", "three"]
    );
    let data = root.data("a/b/table").unwrap().unwrap();
    assert_eq!(data.shape(), [3, 4]);
    assert_eq!(data.values().unwrap(), table);
    assert_eq!(data.some(1..2).unwrap(), Values::I16((4..8).collect()));
    assert_eq!(
        data.raw_of(&[[0, 2, 2], [1, 2, 2]]).unwrap().values(),
        Values::I16(vec![1, 3, 9, 11].into())
    );
    assert!(data.some(2..4).is_err() && root.data("a/none").unwrap().is_none());
    let error = io::open(&path, None).unwrap_err().to_string();
    assert!(error.contains("its root has \"a\""), "{error}");
}
