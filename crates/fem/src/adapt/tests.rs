//! The next mesh, from the previous ones.

use super::*;
use crate::contact::Method;
use crate::scene::LARGEST_N;

/// The next step after these n and relative bounds on squares for an accuracy of 1 %, predictions aiming at 0.95 %.
fn next(seen: &[(usize, f64)]) -> (Way, usize) {
    let scene = Scene::find("one-zone").unwrap();
    let wish = Wish {
        discretisation: Discretisation::of(&scene, Method::cr()),
        target: Target::G,
        accuracy: 0.01,
        stop: Stop::default(),
        linear: Settings::default(),
        way: None,
    };
    let step = |&(n, relative): &(usize, f64)| Step {
        way: Way::Uniform,
        n: Some(n),
        cells: 2 * n * n,
        dofs: 3 * n * n,
        relative,
        saving: 1.0,
        seconds: 1.0,
    };
    let steps: Vec<Step> = seen.iter().map(step).collect();
    let mesh = scene.triangulation(Some(4)).unwrap();
    (choose(&mesh, &wish, &steps), next_n(&wish, &steps))
}

#[test]
fn what_is_far_is_seen_from_nearer() {
    // Of second order: 9.5 times less takes √9.5 times n; 100 times less 10 times n, beyond 4, and has a third of that before.
    assert_eq!(next(&[(8, 0.36), (16, 0.09)]), (Way::Uniform, 50));
    assert_eq!(next(&[(8, 3.8), (16, 0.95)]), (Way::Uniform, 54));
    // No farther than 4 times n, where no rate is seen either, and farther than n.
    assert_eq!(next(&[(8, 80.0), (16, 20.0)]), (Way::Uniform, 64));
    assert_eq!(next(&[(8, 20.0)]), (Way::Uniform, 32));
    assert_eq!(next(&[(8, 0.038), (16, 0.009501)]), (Way::Uniform, 17));
    // A tolerance beyond any mesh is reported immediately.
    assert!(next(&[(8, 0.1), (16, 0.099)]).1 > LARGEST_N);
}

#[test]
fn what_uniform_meshes_do_not_resolve_is_bisected() {
    assert_eq!(next(&[(8, 0.24), (16, 0.11)]).0, Way::Uniform);
    assert_eq!(next(&[(8, 0.24), (16, 0.13)]).0, Way::Adaptive);
    assert_eq!(next(&[(8, 0.24), (16, 0.3)]).0, Way::Adaptive);
}
