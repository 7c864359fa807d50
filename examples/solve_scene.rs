//! Solves a scene, and bounds the error of its solution.
//!
//!     cargo run --example solve_scene -- one-zone cr 32

use std::process::ExitCode;

use faceoff_fem::certify::{Target, certify};
use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, solve};
use faceoff_fem::scene::Scene;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let [scene, method, n] = arguments else {
        return Err("usage: solve_scene SCENE METHOD N".into());
    };
    let scene = Scene::find(scene)?;
    let mesh = scene.triangulation(Some(n.parse()?))?;
    let discretisation = Discretisation::of(&scene, method.parse::<Method>()?);
    let problem = Problem::new(&scene, &mesh, &discretisation)?;
    let solution = solve(&problem, Iteration::Newton, Stop::default(), |_, _| Ok(()))?;
    println!("{} dofs, {:?}", solution.u.len(), solution.ended);
    let relative = certify(&problem, &solution.u)?.relative(Target::G);
    println!("relative error of the averaged gradient: at most {relative:.1e}");
    Ok(())
}
