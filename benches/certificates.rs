//! What a certificate takes beside the solve that it is of, in one run: medians in seconds, and their ratio. What is
//! wanted is 3. A solve of `cr` in 2D takes about a microsecond a cell; a certificate is a solve of a flux, some steps for v
//! and s of P2, and the norms of all these with bounds of their rounding. On the strip f has three waves a cell, and depends on
//! x alone: what a column of cells has in common is found once.
//!
//! ```sh
//! cargo bench --bench certificates
//! cargo bench --bench certificates -- --quick
//! ```

use std::time::Instant;

use clap::Parser;
use faceoff_fem::certify::certify;
use faceoff_fem::contact::{Discretisation, Iteration, Problem, Stop, solve};
use faceoff_fem::scene::Scene;

#[derive(Parser)]
struct Arguments {
    #[arg(long, default_value = "3")]
    repeats: usize,
    /// Scenes with this in their names alone
    #[arg(long, default_value = "")]
    scene: String,
    /// Small meshes once: does it run?
    #[arg(long)]
    quick: bool,
    /// What `cargo bench` passes
    #[arg(long, hide = true)]
    bench: bool,
}

/// Several waves of f on a cell: what is left of it on each has to be enclosed.
const STRIP: &str = r#"
name = "strip"
[mesh]
generator = "union-jack"
n = 32
size = [16, 1]
[boundary]
dirichlet = ["top"]
neumann = ["left", "right"]
contact = ["bottom"]
[data]
f = "-2*pi*sin(2*pi*x*6)-0.1"
"#;

fn main() -> faceoff_mesh::Result<()> {
    let arguments = Arguments::parse();
    let strip = Scene::parse(STRIP)?;
    let plain = Scene::find("one-zone")?;
    let solid = Scene::find("one-zone-3d")?;
    let cases = [
        (&plain, "cr", 512),
        (&plain, "cr", 64),
        (&plain, "p2", 256),
        (&strip, "cr", 32),
        (&solid, "cr", 16),
        (&solid, "cr", 48),
    ];
    println!(
        "{:12} {:6} {:>4} {:>9} {:>8} {:>8} {:>6}",
        "scene", "method", "n", "cells", "solve", "certify", "ratio"
    );
    let chosen = |scene: &Scene| scene.name().contains(&arguments.scene);
    for (scene, method, n) in cases.into_iter().filter(|(scene, ..)| chosen(scene)) {
        let n = if arguments.quick { n.min(8) } else { n };
        let mesh = scene.triangulation(Some(n))?;
        let discretisation = Discretisation::of(scene, method.parse().expect("a method"));
        let mut seconds = [Vec::new(), Vec::new()];
        for _ in 0..if arguments.quick {
            1
        } else {
            arguments.repeats
        } {
            let start = Instant::now();
            let problem = Problem::new(scene, &mesh, &discretisation)?;
            let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))?;
            seconds[0].push(start.elapsed().as_secs_f64());
            let start = Instant::now();
            certify(&problem, &solution.u)?;
            seconds[1].push(start.elapsed().as_secs_f64());
        }
        let [of_solve, of_certificate] = seconds.map(|mut seconds| {
            seconds.sort_by(f64::total_cmp);
            seconds[seconds.len() / 2]
        });
        println!(
            "{:12} {method:6} {n:4} {:9} {of_solve:8.3} {of_certificate:8.3} {:6.2}",
            scene.name(),
            mesh.cell_count(),
            of_certificate / of_solve
        );
    }
    Ok(())
}
