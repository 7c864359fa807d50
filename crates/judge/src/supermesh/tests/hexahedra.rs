//! Functions on hexahedra: boxes, and cells whose faces are not plane.

use faceoff_mesh::CellKind;
use faceoff_mesh::field::Results;
use faceoff_mesh::mesh::generate::{Cuboid, lattice_mesh};

use super::super::element::Element;
use super::{broken_nodes, compare, grid, norms, tetrahedron, with};

/// n³ hexahedra in the unit cube with nodes of their own, whose inner corners are moved by at most `by`.
fn cube(kind: CellKind, n: usize, by: f64) -> Results {
    let mesh = lattice_mesh(n, &Cuboid::new([0.0; 3], [1.0; 3])).unwrap();
    let moved = |[x, y, z]: [f64; 3]| {
        let bump = by * 64.0 * x * (1.0 - x) * y * (1.0 - y) * z * (1.0 - z);
        [
            x + bump * (7.0 * y).sin(),
            y + bump * (5.0 * z).cos(),
            z - bump * (3.0 * x).cos(),
        ]
    };
    let nodes = Element::new(kind).unwrap().nodes;
    let corners = Element::new(CellKind::Hexahedron).unwrap();
    let cells = mesh.blocks[1].cells().map(|cell| {
        // Corners begin elsewhere in every second cell, so that neighbours do not divide a face alike by chance.
        let k = usize::from(cell[0] % 2 == 1);
        let cell: Vec<[f64; 3]> = (0..8)
            .map(|i| cell[i / 4 * 4 + (i + k) % 4])
            .map(|v| moved(mesh.points[v as usize]))
            .collect();
        nodes
            .iter()
            .map(|x| corners.interpolate(&cell, x))
            .collect()
    });
    broken_nodes("hexahedra", kind, &cells.collect::<Vec<Vec<_>>>())
}

#[test]
fn errors_on_hexahedra_are_those_known() {
    let linear = |x: &[f64; 3]| 1.0 + 2.0 * x[0] - 3.0 * x[1] + x[2];
    let exact = |x: [f64; 3], _: usize| (linear(&x), [2.0, -3.0, 1.0]);
    let zero = |_: [f64; 3], _: usize| (0.0, [0.0; 3]);
    for kind in [CellKind::Hexahedron, CellKind::Hexahedron27] {
        for by in [0.0, 0.08] {
            let a = with(cube(kind, 2, by), "u", linear);
            let a = with(a, "one", |_| 1.0);
            let found = crate::error_against(&a, "u", 1, &exact).unwrap();
            // Gradients are taken where Newton's method for the place began its last step.
            assert!(found.l2 < 1e-14 && found.h1.unwrap() < 1e-9, "{found:?}");
            // The pieces fill the cube without gaps, although no face is plane.
            let volume = crate::error_against(&a, "one", 1, &zero).unwrap().l2;
            assert!((volume - 1.0).abs() < 1e-13, "{kind}: {volume}");
        }
    }
    // ‖x y - x y z‖² = 1/27 and ‖∇(x y - x y z)‖² = 3/27 on the unit cube.
    let a = with(cube(CellKind::Hexahedron, 2, 0.0), "u", |x| x[0] * x[1]);
    let product = |[x, y, z]: [f64; 3], _: usize| (x * y * z, [y * z, x * z, x * y]);
    let found = crate::error_against(&a, "u", 1, &product).unwrap();
    assert!((found.l2.powi(2) - 1.0 / 27.0).abs() < 1e-15, "{found:?}");
    assert!(
        (found.h1.unwrap().powi(2) - 1.0 / 3.0).abs() < 1e-14,
        "{found:?}"
    );
}

/// Two meshes of one cube have the same function, in boxes and in tetrahedra.
#[test]
fn functions_on_other_hexahedra_are_compared() {
    let product = |x: &[f64; 3]| x[0] * x[1] * x[2];
    let coarse = with(cube(CellKind::Hexahedron, 2, 0.0), "u", product);
    let fine = with(cube(CellKind::Hexahedron27, 3, 0.0), "u", product);
    let compared = compare(&coarse, &fine).unwrap();
    assert!(norms(&compared, "u").l2 < 1e-15, "{compared:?}");
    let cells = grid(3, 2, 1, |x| x);
    let straight = with(super::broken("t", tetrahedron(1), &cells), "u", |x| x[2]);
    let bent = with(cube(CellKind::Hexahedron, 2, 0.08), "u", |x| x[2]);
    let compared = compare(&straight, &bent).unwrap();
    assert!(norms(&compared, "u").l2 < 1e-13, "{compared:?}");
}

/// On a frustum, x = ξ (1 - ζ/2), y = η (1 - ζ/2), z = ζ, the square of ξηζ has the integral 1/9 ∫ ζ² (1 - ζ/2)² = 2/135. Sides are plane, so
/// that tetrahedra fill it.
#[test]
fn the_stated_error_of_quadrature_is_not_less_than_the_true_one() {
    let corner = |x: f64, y: f64, z: f64| [x * (1.0 - z / 2.0), y * (1.0 - z / 2.0), z];
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let at = |z: f64| square.map(|[x, y]| corner(x, y, z));
    let corners = [at(0.0), at(1.0)].concat();
    let cells = [1, 2, 3, 7, 4, 5, 1].windows(2).map(|of| {
        let all = [0, of[0], of[1], 6];
        all.map(|k| corners[k]).to_vec()
    });
    let cells: Vec<Vec<_>> = cells.collect();
    let b = broken_nodes("t", tetrahedron(1), &cells);
    let frustum = broken_nodes(
        "frustum",
        CellKind::Hexahedron,
        std::slice::from_ref(&corners),
    );
    let one = |x: &[f64; 3]| if x == &corners[6] { 1.0 } else { 0.0 };
    let found = compare(&with(frustum, "u", one), &with(b, "u", |_| 0.0)).unwrap();
    let common = found.intersection.as_ref().unwrap();
    // ∫ (1 - ζ/2)² = 7/12.
    assert!((common.common - 7.0 / 12.0).abs() < 1e-14, "{common:?}");
    let stated = common.quadrature.unwrap();
    let off = (norms(&found, "u").l2 / (2.0_f64 / 135.0).sqrt() - 1.0).abs();
    assert!(off <= stated && stated < 100.0 * off, "{off} {stated}");
}
