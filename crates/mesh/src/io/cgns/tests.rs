use std::path::Path;

use super::write::{describe, node, text};
use crate::error::Result;
use crate::io::hdf5::write::{Data, Group};
use crate::io::polytopes::FACES;
use crate::io::scalar::Number;
use crate::io::{self, Content};
use crate::mesh::CellKind;

const INT: Number = Number::I32;

fn array(parent: &mut Group<'_>, name: &str, label: &str, numbers: Vec<i64>) {
    let count = numbers.len();
    let data = Data::integers(INT, vec![count], move |k| numbers[k]);
    node(parent, name, label, "I4").add(" data", data);
}

/// Two cubes by their faces; each list has its length before it, as before CGNS 4, or all begin at separately listed positions.
fn read(path: &Path, of_cells: [i64; 12], has_starts: bool) -> Result<Content> {
    let mut file = Group::default();
    describe(&mut file, "HDF5 MotherNode", "Root Node of HDF5 File", "MT");
    let version = Data::made(Number::F32, vec![1], |_, bytes| {
        bytes.copy_from_slice(&4.0_f32.to_le_bytes())
    });
    node(
        &mut file,
        "CGNSLibraryVersion",
        "CGNSLibraryVersion_t",
        "R4",
    )
    .add(" data", version);
    let base = node(&mut file, "Base", "CGNSBase_t", "I4");
    base.add(" data", Data::integers(INT, vec![2], |_| 3));
    let zone = node(base, "Zone", "Zone_t", "I4");
    zone.add(" data", Data::integers(INT, vec![3, 1], |k| [12, 2, 0][k]));
    text(zone, "ZoneType", "ZoneType_t", "Unstructured");
    let grid = node(zone, "GridCoordinates", "GridCoordinates_t", "MT");
    for (axis, name) in ["CoordinateX", "CoordinateY", "CoordinateZ"]
        .into_iter()
        .enumerate()
    {
        let place = move |k: usize| [k % 3, k / 3 % 2, k / 6][axis] as f64;
        node(grid, name, "DataArray_t", "R8").add(" data", Data::floats(vec![12], place));
    }
    let lists = [
        (
            "Faces",
            22,
            1,
            FACES.iter().map(|face| face.to_vec()).collect::<Vec<_>>(),
        ),
        (
            "Solids",
            23,
            12,
            of_cells.chunks(6).map(<[i64]>::to_vec).collect(),
        ),
    ];
    for (name, number, first, lists) in lists {
        let section = node(zone, name, "Elements_t", "I4");
        section.add(
            " data",
            Data::integers(INT, vec![2], move |k| if k == 0 { number } else { 0 }),
        );
        array(
            section,
            "ElementRange",
            "IndexRange_t",
            vec![first, first + lists.len() as i64 - 1],
        );
        let starts =
            (0..=lists.len()).map(|k| lists[..k].iter().map(|list| list.len() as i64).sum());
        if has_starts {
            array(
                section,
                "ElementStartOffset",
                "DataArray_t",
                starts.collect(),
            );
        }
        let length = |list: &Vec<i64>| (!has_starts).then_some(list.len() as i64);
        let all = lists
            .iter()
            .flat_map(|list| length(list).into_iter().chain(list.iter().copied()));
        array(section, "ElementConnectivity", "DataArray_t", all.collect());
    }
    let boundary = node(
        node(zone, "ZoneBC", "ZoneBC_t", "MT"),
        "inlet",
        "BC_t",
        "C1",
    );
    text(boundary, "GridLocation", "GridLocation_t", "FaceCenter");
    let listed = Data::integers(INT, vec![2, 1], |k| [5, 6][k]);
    node(boundary, "PointList", "IndexArray_t", "I4").add(" data", listed);
    file.save(path)?;
    io::open(path, None)
}

#[test]
fn polyhedra_are_cells_and_their_faces_where_conditions_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cubes.cgns");
    // The face between the two has the opposite orientation in the second.
    let sound = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, -6, 11];
    for has_starts in [true, false] {
        let content = read(&path, sound, has_starts).unwrap();
        assert!(content.unread.is_empty(), "{:?}", content.unread);
        let mesh = content.mesh;
        let kinds: Vec<_> = mesh
            .blocks
            .iter()
            .map(|block| (block.kind, block.len()))
            .collect();
        assert_eq!(
            kinds,
            [(CellKind::Polyhedron(8), 2), (CellKind::Quadrangle, 2)]
        );
        let shared: Vec<&[u32]> = mesh
            .polyhedra
            .iter()
            .filter_map(|mut faces| faces.nth(5 - 1))
            .collect();
        assert_eq!(shared, [[0, 3, 9, 6], [7, 10, 4, 1]]);
        let groups: Vec<_> = mesh
            .groups
            .iter()
            .map(|g| (g.dim, g.name.as_deref(), &g.cells[..]))
            .collect();
        assert_eq!(
            groups,
            [
                (2, Some("inlet"), &[2, 3][..]),
                (3, Some("Solids"), &[0, 1])
            ]
        );
    }
    for (odd, what) in [
        (0, "no face with the number 0"),
        (12, "no face with the number 12"),
        (1, "more than two cells"),
    ] {
        let mut damaged = sound;
        damaged[11] = odd;
        damaged[10] = if odd == 1 { 1 } else { -6 };
        let error = read(&path, damaged, true).unwrap_err().to_string();
        assert!(error.contains("Solids") && error.contains(what), "{error}");
    }
}

/// A group without a name, or one that holds itself, would be read without end.
#[test]
fn groups_without_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("nameless.cgns");
    let mut file = Group::default();
    describe(&mut file, "HDF5 MotherNode", "Root Node of HDF5 File", "MT");
    let version = Data::floats(vec![1], |_| 4.0);
    node(
        &mut file,
        "CGNSLibraryVersion",
        "CGNSLibraryVersion_t",
        "R8",
    )
    .add(" data", version);
    node(&mut file, "Base", "CGNSBase_t", "I4")
        .member("")
        .member("inside");
    file.save(&path).unwrap();
    let refused = io::open(&path, None).unwrap_err().to_string();
    assert!(refused.contains("has no name"), "{refused}");
}
