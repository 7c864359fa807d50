//! Data between samples, and the uncertainty of data: all of it is in the bounds.

use super::carried::Carried;
use super::products::Moments;
use super::simplex::Simplex;
use super::tests::{certified, solved, square};
use super::tree::{Leaf, Tree};
use super::*;
use crate::contact::{Discretisation, Method, Problem};
use crate::quadrature::exact;
use crate::scene::Scene;

fn certificate(scene: &Scene, method: &str, n: usize) -> Result<Certificate> {
    let mesh = scene.triangulation(Some(n))?;
    let problem = Problem::new(
        scene,
        &mesh,
        &Discretisation::of(scene, method.parse().unwrap()),
    )?;
    let u = solved(&problem);
    certify(&problem, &u)
}

/// ‖∇u‖ is in its interval, which is not wider than this.
fn holds(found: &Certificate, truth: f64, width: f64) {
    let [low, high] = found.gradient;
    assert!(low <= truth && truth <= high, "[{low}, {high}] {truth}");
    assert!(high - low < width, "[{low}, {high}]");
}

/// Data that no sample on the mesh shows: ‖∇u‖ of each from a series or a closed form, not from a mesh.
#[test]
fn data_between_the_samples_are_in_the_interval() {
    for (f, t, truth, width) in [
        // One step next to a cell's edge; a band; a band with nothing else; a smooth peak; a patch of traction.
        ("-1-if(y<0.501,0,5)", "0", 1.551_348_336, 1e-4),
        ("-1-if(abs(y-0.5)<0.001,500,0)", "0", 1.258_173_147, 0.002),
        ("-1-1e6*exp(-((x-0.5)^2+(y-0.5)^2)*1e6)", "0", 3.936_7, 0.7),
        (
            "-1",
            "-if(x>0.9,if(abs(y-0.5)<0.002,250,0),0)",
            1.858_162,
            1.8,
        ),
    ] {
        let found = certificate(&square(f, t, "0", "0"), "cr", 16).unwrap();
        holds(&found, truth, width);
    }
}

/// What is not known on spots is part of the error's mean, of what is off its mean, and of (f, z).
#[test]
fn spots_are_part_of_all_bounds() {
    let mesh = Scene::find("one-zone").unwrap().triangulation(Some(2));
    let mesh = mesh.unwrap();
    let simplex = Simplex::new(&mesh, 0);
    let [mean, square] = [0.3, 2.0];
    let carried = Carried {
        square: Interval::at(1e-6),
        flat: [Interval::ZERO; 3],
        bubbles: [Interval::ZERO; 3],
    };
    let tree = Tree {
        whole: Leaf {
            error: 0.1,
            spots: [mean, square],
            swell: 0.7,
            ..Leaf::default()
        },
        carried: Some(Box::new(carried)),
        ..Tree::default()
    };
    let found = balance::balance(&simplex, &tree, 0.0, |_, value| Interval::at(value));
    assert!(found.error >= 0.1 + mean && found.error < 0.401);
    // ‖e‖ C h
    let spread = simplex.diameter / 3.831_705_970_207_512 * (simplex.measure.mid() * square).sqrt();
    assert!((found.spread / spread - 1.0).abs() < 1e-12);
    let load = mean_of_product(&tree, &[2.0, 2.0, 2.0].map(Interval::at), None);
    assert!(load.low <= -0.8 && load.high >= 0.8);
}

/// What is not known on spots of leaves is in (f, w) of a cell, at corners and by bubbles.
#[test]
fn spots_of_leaves_are_part_of_loads() {
    let scene = square("-1", "0", "0", "0");
    let mesh = scene.triangulation(Some(2)).unwrap();
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr()));
    let problem = problem.unwrap();
    let (_, mut fields) = certified(&problem, &solved(&problem)).unwrap();
    let leaf = Leaf {
        spots: [0.3, 2.0],
        peak: 7.0,
        ..Leaf::default()
    };
    let whole = Leaf {
        edge: [0, 1],
        at: 0.25,
        parts: 1,
        ..Leaf::default()
    };
    let mut tree = Tree {
        whole,
        rest: vec![leaf; 2],
        ..Tree::default()
    };
    tree.moments = Some(Box::new(Moments::of(&tree, 2)));
    let of_bubbles = mean_of_product(&tree, &[Interval::ZERO; 3], Some([0.0, 0.0, 1.0]));
    // The mean of 4 λ_a λ_b is 1/3.
    assert!(
        of_bubbles.low <= -0.1 && of_bubbles.high >= 0.1,
        "{of_bubbles:?}"
    );
    fields.data.to_mut().trees[0] = tree;
    let simplex = Simplex::new(&mesh, 0);
    let z = [2.0, 2.0, 2.0, 0.0].map(Interval::at);
    let load = load_of_cell(&fields, &simplex, 0, &z, None);
    let least = 0.6 * simplex.measure.low;
    assert!(load.low <= -least && load.high >= least, "{load:?}");
}

/// Data that jump along one axis take no parts of cells, and hardly widen the interval.
#[test]
fn steps_along_an_axis_take_no_leaves() {
    // ‖∇u‖² = ∫ (∫ -f)² from the bottom, where nothing touches.
    for (f, truth, width) in [
        ("-1-if(y<0.501,0,5)", 1.551_348_336_125_707, 2e-5),
        ("-1-if(abs(y-0.5)<0.001,500,0)", 1.258_173_146_536_941, 0.2),
        ("-if(abs(y-0.5)<0.001,500,0)", 0.706_871_039_629_342, 0.4),
    ] {
        let scene = square(f, "0", "0", "0");
        let mesh = scene.triangulation(Some(16)).unwrap();
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr()));
        let problem = problem.unwrap();
        let data = PreparedData::new(&problem).unwrap();
        assert!(data.trees.iter().all(|tree| !tree.is_cut()), "{f}");
        let carried = data.trees.iter().filter(|tree| tree.carried.is_some());
        let spots = carried.filter(|tree| tree.whole.spots[0] > 0.0);
        assert!(spots.count() >= 16, "{f}");
        let found = certify(&problem, &solved(&problem)).unwrap();
        holds(&found, truth, width);
    }
}

#[test]
fn tiny_data_have_their_bounds() {
    let tiny = square("1e-160*sin(3*x)*cos(2*y)-1e-160", "0", "0", "0");
    let plain = square("sin(3*x)*cos(2*y)-1", "0", "0", "0");
    let [tiny, plain] = [&tiny, &plain].map(|scene| certificate(scene, "cr-fc", 8).unwrap());
    for (a, b) in [
        (tiny.g, plain.g),
        (tiny.gradient[0], plain.gradient[0]),
        (tiny.gradient[1], plain.gradient[1]),
    ] {
        assert!((a * 1e160 / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
}

/// A weight that is known up to a radius makes (f, z) as wide.
#[test]
fn what_weights_are_off_is_in_the_load() {
    let tree = Tree {
        whole: Leaf {
            values: [1.0; 4],
            ..Leaf::default()
        },
        ..Tree::default()
    };
    let load = mean_of_product(&tree, &[Interval::new(1.0, 2.0); 3], None);
    assert!(load.low <= 1.0 && load.high >= 2.0, "{load:?}");
}

/// (t, z) on faces of Γ_N holds what quadrature finds where t is not a line.
#[test]
fn loads_of_faces_hold_what_is_no_line() {
    let scene = square("-1", "y^3", "0", "0");
    let mesh = scene.triangulation(Some(2)).unwrap();
    let discretisation = Discretisation::of(&scene, Method::cr());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (_, fields) = certified(&problem, &problem.start()).unwrap();
    let mut most = 0.0_f64;
    for traction in &fields.data.tractions {
        let geometry = mesh.geometry(traction.cell);
        let local = mesh.local_face(traction.cell, traction.face);
        let [j, k] = [(local + 1) % 3, (local + 2) % 3];
        for z in [[1.0, -0.5, 0.3, 0.0], [-0.2, 0.7, 1.0, 0.0]] {
            let at = |([p, q, ..], weight): ([f64; 4], f64)| {
                let mut lambda = [0.0; 4];
                (lambda[j], lambda[k]) = (p, q);
                let t = scene.data().t.value(geometry.point(&lambda));
                weight * t * (p * z[j] + q * z[k])
            };
            let truth = geometry.face_measure(local) * exact(1, 9).iter().map(at).sum::<f64>();
            let found = load_of_face(&fields, traction, &z.map(Interval::at));
            assert!(
                found.low - 1e-9 <= truth && truth <= found.high + 1e-9,
                "{found:?} {truth}"
            );
            most = most.max((found.mid() - truth).abs());
        }
    }
    // What p has is not enough.
    assert!(most > 1e-5, "{most}");
}

/// (t, 1) on faces of Γ_N where no leaf resolves t: -1 on all but acos(0.9)/π of a period.
#[test]
fn loads_of_faces_hold_what_is_not_known() {
    let scene = square("-1", "if(sin(1e7*y)<0.9,-1,0)", "0", "0");
    let mesh = scene.triangulation(Some(2)).unwrap();
    let discretisation = Discretisation::of(&scene, Method::cr());
    let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
    let (_, fields) = certified(&problem, &problem.start()).unwrap();
    assert_eq!(fields.data.tractions.len(), 4);
    for traction in &fields.data.tractions {
        let truth = 0.5 * (0.9_f64.acos() / std::f64::consts::PI - 1.0);
        let found = load_of_face(&fields, traction, &[Interval::ONE; 4]);
        assert!(
            found.low - 1e-3 <= truth && truth <= found.high + 1e-3,
            "{found:?}"
        );
    }
}

/// u = (max(0, s))²/2, s = x + 2y - 1.3, whose -Δu jumps on a line across the cells: ‖∇u‖² = ∫ 5 max(0, s)² = 5/24 (1.7⁴ - 0.7⁴).
#[test]
fn steps_across_cells_take_few_leaves() {
    let truth = (5.0 / 24.0 * (1.7_f64.powi(4) - 0.7_f64.powi(4))).sqrt();
    let scene = square(
        "-if(x+2*y<1.3,0,5)",
        "if(x<0.5,-1,1)*max(0,x+2*y-1.3)",
        "max(0,x+0.7)^2/2",
        "1",
    );
    for (method, n, width) in [("cr", 16, 0.04), ("cr-fc", 32, 0.015), ("p2", 16, 0.04)] {
        let mesh = scene.triangulation(Some(n)).unwrap();
        let discretisation = Discretisation::of(&scene, method.parse().unwrap());
        let problem = Problem::new(&scene, &mesh, &discretisation).unwrap();
        let (found, fields) = certified(&problem, &solved(&problem)).unwrap();
        holds(&found, truth, width);
        let trees = fields.data.trees.iter();
        let cut: usize = trees.map(|tree| tree.rest.len()).sum();
        assert!(cut > n && cut < 20 * n, "{method}: {cut}");
    }
}
