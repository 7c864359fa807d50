use faceoff_fem::certify::{certify, examine};
use faceoff_fem::contact::{Discretisation, Iteration, Problem, Stop, solve};
use faceoff_fem::scene::Scene;
use std::time::Instant;
fn main() -> faceoff_mesh::Result<()> {
    let a: Vec<String> = std::env::args().collect();
    let scene = Scene::find(&a[1])?;
    let mesh = scene.triangulation(Some(a[3].parse().unwrap()))?;
    let d = Discretisation::of(&scene, a[2].parse().expect("a method"));
    for _ in 0..3 {
        let t = Instant::now();
        let p = Problem::new(&scene, &mesh, &d)?;
        let s = solve(&p, Iteration::Newton, Stop::default(), |_, _| Ok(()))?;
        let ts = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let c = if a.len() > 4 {
            examine(&p, &s.u)?
        } else {
            certify(&p, &s.u)?
        };
        let tc = t.elapsed().as_secs_f64();
        println!(
            "solve {ts:.4} certify {tc:.4} ratio {:.2} g {:.6e} u_h {:.6e} v {:.5e} parts {:?} grad {:?}",
            tc / ts,
            c.g,
            c.u_h[1],
            c.v,
            c.parts,
            c.gradient
        );
    }
    Ok(())
}
