use super::*;
use crate::mesh::{CellBlock, CellKind, Group};

/// Four triangles around the middle of the unit square, and its sides, in one group.
fn square() -> Mesh {
    let sides = vec![0, 1, 1, 2, 2, 3, 3, 0];
    let triangles = vec![0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4];
    Mesh {
        points: vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 0.0],
        ]
        .into(),
        blocks: vec![
            CellBlock::new(CellKind::Line, sides),
            CellBlock::new(CellKind::Triangle, triangles),
        ],
        groups: vec![Group {
            dim: 1,
            tag: 1,
            name: None,
            cells: vec![0, 1, 2, 3],
        }],
        ..Mesh::default()
    }
}

#[test]
fn a_good_mesh_is_sound() {
    let report = check(&square()).unwrap();
    assert!(report.is_sound(), "{report:?}");
    assert_eq!(
        (report.ungrouped_boundary.count, report.parts.count),
        (0, 1)
    );
    let angles = [report.smallest_angle, report.largest_angle]
        .map(|angle| angle.expect("triangles have angles").degrees);
    assert!(
        (angles[0] - 45.0).abs() < 1e-12 && (angles[1] - 90.0).abs() < 1e-12,
        "{angles:?}"
    );
}

#[test]
fn inverted_degenerate_and_duplicate_cells() {
    let mut mesh = square();
    mesh.blocks[1].nodes.to_mut().swap(0, 1);
    let inverted = check(&mesh).unwrap().inverted;
    assert_eq!(
        (inverted.count, inverted.first[0].cells.as_slice()),
        (1, &[5][..])
    );
    assert_eq!(inverted.first[0].at, [0.5, 1.0 / 6.0, 0.0]);

    let mut mesh = square();
    mesh.points.to_mut()[4] = [0.5, 0.0, 0.0];
    let report = check(&mesh).unwrap();
    assert_eq!((report.degenerate.count, report.inverted.count), (1, 0));

    let mut mesh = square();
    mesh.blocks[1].nodes.to_mut().extend([4, 0, 1]);
    let report = check(&mesh).unwrap();
    assert_eq!(report.duplicate.count, 1);
    assert_eq!(report.duplicate.first[0].cells, [5, 9]);
    assert_eq!(report.crowded_faces.count, 2);
}

#[test]
fn orphans_parts_and_open_boundary() {
    let mut mesh = square();
    mesh.points.to_mut().extend([
        [9.0, 9.0, 0.0],
        [5.0, 0.0, 0.0],
        [6.0, 0.0, 0.0],
        [5.0, 1.0, 0.0],
    ]);
    mesh.point_tags = (11..20).collect();
    mesh.blocks[1].nodes.to_mut().extend([6, 7, 8]);
    let report = check(&mesh).unwrap();
    assert_eq!(
        (
            report.orphans.count,
            report.orphans.first[0].points.as_slice()
        ),
        (1, &[16][..])
    );
    assert_eq!(report.orphans.first[0].at, [9.0, 9.0, 0.0]);
    assert_eq!(report.parts.count, 2);
    assert_eq!(report.ungrouped_boundary.count, 3);
    assert!(!report.is_sound());
}

#[test]
fn hanging_nodes_in_two_and_three_dimensions() {
    let mut mesh = square();
    // The side 1-2 is halved for a neighbour only.
    mesh.points
        .to_mut()
        .extend([[1.0, 0.5, 0.0], [2.0, 0.5, 0.0]]);
    mesh.blocks[1].nodes.to_mut().extend([1, 6, 5, 5, 6, 2]);
    let report = check(&mesh).unwrap();
    assert_eq!(
        (
            report.hanging_nodes.count,
            report.hanging_nodes.first[0].points.as_slice()
        ),
        (1, &[6][..])
    );

    // A tetrahedron on a face of another, with a corner in its middle.
    let solid = Mesh {
        points: vec![
            [0.0; 3],
            [3.0, 0.0, 0.0],
            [0.0, 3.0, 0.0],
            [0.0, 0.0, 3.0],
            [1.0, 1.0, 0.0],
            [0.0, 0.0, -1.0],
        ]
        .into(),
        blocks: vec![CellBlock::new(
            CellKind::Tetrahedron,
            vec![0, 1, 2, 3, 0, 4, 1, 5],
        )],
        ..Mesh::default()
    };
    let report = check(&solid).unwrap();
    assert_eq!(
        (
            report.hanging_nodes.count,
            report.hanging_nodes.first[0].points.as_slice()
        ),
        (1, &[5][..])
    );
    assert_eq!(report.inverted.count, 0);
}

#[test]
fn solids_of_all_shapes_are_the_right_way_round() {
    let cube = |x: [f64; 3]| x;
    let mesh = Mesh {
        points: [
            [0., 0., 0.],
            [1., 0., 0.],
            [1., 1., 0.],
            [0., 1., 0.],
            [0., 0., 1.],
            [1., 0., 1.],
            [1., 1., 1.],
            [0., 1., 1.],
            [0.5, 0.5, 2.],
            [2., 0., 0.],
            [2., 0., 1.],
        ]
        .map(cube)
        .to_vec()
        .into(),
        blocks: vec![
            CellBlock::new(CellKind::Hexahedron, vec![0, 1, 2, 3, 4, 5, 6, 7]),
            CellBlock::new(CellKind::Pyramid, vec![4, 5, 6, 7, 8]),
            CellBlock::new(CellKind::Prism, vec![1, 9, 2, 5, 10, 6]),
        ],
        ..Mesh::default()
    };
    let report = check(&mesh).unwrap();
    assert!(report.is_sound(), "{report:?}");
    let mut wrong = mesh;
    wrong.blocks[2].nodes = vec![5, 10, 6, 1, 9, 2].into();
    assert_eq!(check(&wrong).unwrap().inverted.count, 1);
}

/// Loose triangles in a row, in one heap with one far away, all at one place, and each inside the next: a face that looked at
/// every point would take minutes.
#[test]
fn loose_triangles_take_no_time() {
    let count = 10_000;
    let triangle = |at: f64, size: f64| [[at, 0.0, 0.0], [at + size, 0.0, 0.0], [at, size, 0.0]];
    let arranged = |place: &dyn Fn(usize) -> [[f64; 3]; 3]| Mesh {
        points: (0..count).flat_map(place).collect(),
        blocks: vec![CellBlock::new(
            CellKind::Triangle,
            (0..3 * count as u32).collect(),
        )],
        ..Mesh::default()
    };
    let last = |k: usize| f64::from(u8::from(k == count - 1));
    for (mesh, hanging) in [
        (arranged(&|k| triangle(2.0 * k as f64, 1.0)), 0),
        (
            arranged(&|k| triangle(2.0 * k as f64 + 1e12 * last(k), 1.0)),
            0,
        ),
        (arranged(&|_| triangle(0.0, 1.0)), 0),
        // On two of the sides of each lie corners of all that are smaller.
        (
            arranged(&|k| triangle(0.0, 1.0 + k as f64)),
            2 * (count - 1),
        ),
    ] {
        let report = check(&mesh).unwrap();
        assert_eq!(
            (report.parts.count, report.hanging_nodes.count),
            (count, hanging)
        );
    }
}

#[test]
fn curved_sides_that_fold_a_cell_are_found() {
    let mesh = |middle: [f64; 3]| Mesh {
        points: vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            middle,
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.0],
        ]
        .into(),
        blocks: vec![CellBlock::new(CellKind::Triangle6, vec![0, 1, 2, 3, 4, 5])],
        ..Mesh::default()
    };
    let scaled = |mesh: &Mesh| {
        let found = check(mesh).unwrap();
        let of = found.quality.iter().find(|q| q.what == "scaled Jacobian");
        (found.folded.count, of.unwrap().least)
    };
    // sin 45° over sin 60°, which straight sides leave as it is.
    let (folded, straight) = scaled(&mesh([0.5, 0.0, 0.0]));
    assert!(
        folded == 0 && (straight - (2.0f64 / 3.0).sqrt()).abs() < 1e-12,
        "{straight}"
    );
    // At the first corner the Jacobian is 1 - 4 h with the middle of the side lifted by h, at the second 1 + 4 h · 0.
    let (folded, bent) = scaled(&mesh([0.5, 0.2, 0.0]));
    assert!(folded == 0 && bent > 0.0 && bent < straight, "{bent}");
    let (folded, over) = scaled(&mesh([0.5, 0.3, 0.0]));
    assert!(folded == 1 && over < 0.0, "{over}");
    assert!(!check(&mesh([0.5, 0.3, 0.0])).unwrap().is_sound());
}

#[test]
fn points_at_one_place_are_found() {
    let mut mesh = square();
    mesh.points.to_mut().push([0.5, 0.5, -0.0]);
    mesh.blocks[1].nodes.to_mut()[11] = 5;
    let found = check(&mesh).unwrap();
    assert_eq!(found.duplicate_points.first[0].points, [5, 6]);
    assert!(!found.is_sound());
}

#[test]
fn cells_are_counted_between_the_ends_of_bins() {
    let found = check(&square()).unwrap();
    let of = &found.quality[0];
    assert_eq!((of.what, of.cells), ("smallest angle", 4));
    let full: Vec<_> = of.bins.iter().filter(|bin| bin.cells > 0).collect();
    assert_eq!((full.len(), full[0].cells), (1, 4), "{full:?}");
    assert!(full[0].from <= 45.0 && 45.0 < full[0].to);
    assert_eq!(of.worst.len(), 4);
}
