//! The same nonlinear problem on the same mesh by Rust, FreeFEM (Newton with UMFPACK) and dolfinx
//! (Newton with MUMPS), in one run.
//!
//! ```sh
//! cargo bench --bench solvers                     # minutes for FreeFEM's largest meshes
//! cargo bench --bench solvers -- --quick
//! cargo bench --bench solvers -- --strips         # N × 4 squares with contact on the long side, by all three
//! cargo bench --bench solvers -- --shapes         # strips, combs, plates: each way of the Rust engine, and what `auto` chooses
//! cargo bench --bench solvers -- --phases         # where the Rust engine's time goes, beside the machine's limits
//! cargo bench --bench solvers -- --methods cr --n 64,128,256 --engines rust,fenicsx --repeats 5
//! ```
//!
//! Every solve is a process of its own, so that each tells its own peak memory; interpreters and
//! job files count as `start`, the compilation of dolfinx's forms not at all. Times are medians in
//! seconds. Nothing is printed of a case on which the codes do not agree to 1e-8 of max|u|.
//!
//! Among the tests, without a word, it tells the phases of small solves.

#[path = "solvers/phases.rs"]
mod phases;
#[path = "solvers/shapes.rs"]
mod shapes;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use clap::Parser;
use faceoff::engine::{self, Case, Launch, Settings, Silent};
use faceoff_fem::contact::{Discretisation, Method, Problem, Stop};
use faceoff_fem::scene::Scene;
use faceoff_mesh::mesh::Triangulation;
use serde::{Deserialize, Serialize};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Answers further apart than this, relative to max|u|, are no answers to the same question.
const AGREEMENT: f64 = 1e-8;
/// All codes stop at this relative increment.
const STOP: Stop = Stop {
    increment: 1e-10,
    max_iterations: 50,
};
/// A solve that takes longer is not repeated.
const LONG: f64 = 60.0;

#[derive(Parser)]
struct Arguments {
    #[arg(long, default_value = "one-zone")]
    scene: String,
    /// [default: cr, p2; and cr-fc on strips]
    #[arg(long, value_delimiter = ',')]
    methods: Vec<Method>,
    /// Meshes of n × n squares [default: 64, 128, 256, 512 for cr; 64, 128, 250, 500 for p2], or strips of n × 4 [default: 500
    /// to 8000]
    #[arg(long, value_delimiter = ',')]
    n: Vec<usize>,
    #[arg(long, value_delimiter = ',', default_values = engine::NAMES)]
    engines: Vec<String>,
    #[arg(long, default_value = "3")]
    repeats: usize,
    /// Small meshes once: does it run?
    #[arg(long)]
    quick: bool,
    /// Strips of n × 4 squares with contact on the long side, instead of squares; the Rust engine has one thread
    #[arg(long)]
    strips: bool,
    /// So many processes of dolfinx share the mesh
    #[arg(long)]
    ranks: Option<usize>,
    /// Bodies of many shapes by the Rust engine alone, instead; or those with this in their name
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = "")]
    shapes: Option<String>,
    /// The phases of solves by the Rust engine alone, beside the machine's bandwidth and operations, instead
    #[arg(long)]
    phases: bool,
    /// Solve once, write u into this file and what was measured to standard output
    #[arg(long, hide = true)]
    once: Option<PathBuf>,
    /// What `cargo bench` passes
    #[arg(long, hide = true)]
    bench: bool,
}

impl Arguments {
    fn methods(&self) -> Vec<Method> {
        match (&self.methods[..], self.strips) {
            ([], true) => vec![Method::cr(), Method::cr_fc(), Method::p2()],
            ([], false) => vec![Method::cr(), Method::p2()],
            (methods, _) => methods.to_vec(),
        }
    }

    fn meshes(&self, method: &Method) -> Vec<usize> {
        match (&self.n[..], self.quick, method.element.degree()) {
            ([], true, _) => vec![16, 32],
            ([], false, _) if self.strips => vec![500, 1000, 2000, 4000, 8000],
            ([], false, 1) => vec![64, 128, 256, 512],
            ([], false, _) => vec![64, 128, 250, 500],
            (n, ..) => n.to_vec(),
        }
    }
}

/// One solve.
#[derive(Serialize, Deserialize)]
struct Solve {
    version: String,
    unknowns: usize,
    steps: usize,
    /// Seconds by phase.
    seconds: BTreeMap<String, f64>,
    /// From the job to the answer, starts and files included.
    wall: f64,
    /// The same, as seconds of one core.
    spent: f64,
    peak_mb: f64,
}

/// Columns of the table, and the phases of the engines that they sum up.
const COLUMNS: [(&str, &[&str]); 6] = [
    ("mesh", &["mesh"]),
    ("space", &["space"]),
    ("assembly", &["assemble"]),
    ("factor", &["factor"]),
    ("iterate", &["iterate", "solve"]),
    ("complete", &["expand"]),
];

impl Solve {
    fn column(&self, phases: &[&str]) -> f64 {
        phases.iter().filter_map(|p| self.seconds.get(*p)).sum()
    }

    /// From the mesh in memory, or for FreeFEM in a file, to u.
    fn work(&self) -> f64 {
        COLUMNS.iter().map(|(_, phases)| self.column(phases)).sum()
    }
}

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    if std::env::args().len() == 1 {
        (arguments.phases, arguments.quick) = (true, true);
    }
    let done = match &arguments.once {
        Some(path) => once(&arguments, path),
        None => match &arguments.shapes {
            Some(name) => shapes::compare(name, STOP),
            None if arguments.phases => tell_phases(&arguments),
            None => compare(&arguments),
        },
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("solvers: {error}");
            ExitCode::FAILURE
        }
    }
}

/// In a process of its own: the first engine, method and n.
fn once(arguments: &Arguments, path: &Path) -> Outcome<()> {
    let engine = engine::find(&arguments.engines[0])?;
    let own = engine.name() == "rust";
    let (method, n) = (arguments.methods[0], arguments.n[0]);
    let strip = shapes::shape("strip", [n, 4, 0]);
    let scene = if arguments.strips {
        strip.scene()?
    } else {
        Scene::find(&arguments.scene)?
    };
    let generated = arguments.strips.then(|| strip.mesh());
    let before = shapes::spent(!own)?;
    let clock = Instant::now();
    let mesh = match &generated {
        Some(mesh) => Triangulation::new("strip", mesh)?,
        None => scene.triangulation(Some(n))?,
    };
    let seconds_mesh = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method))?;
    let seconds_assembly = clock.elapsed().as_secs_f64();
    let settings = Settings {
        stop: STOP,
        time_limit: Duration::from_secs(7200),
        launch: arguments.ranks.map_or(Launch::Alone, Launch::Ranks),
        ..Settings::default()
    };
    let case = Case {
        n: Some(n),
        problem,
    };
    let clock = Instant::now();
    let mut run = engine.run(&[&case], &settings, &Silent)?;
    let mut wall = clock.elapsed().as_secs_f64();
    let answer = run.answers.pop().ok_or("no answer")?;
    if !answer.converged {
        return Err(format!("{} does not converge on n = {n}", engine.name()).into());
    }
    let mut seconds: BTreeMap<String, f64> = answer.seconds.into_iter().collect();
    if own {
        seconds.insert("mesh".into(), seconds_mesh);
        seconds.insert("assemble".into(), seconds_assembly);
        wall += seconds_mesh + seconds_assembly;
    }
    let bytes: Vec<u8> = answer.u.iter().flat_map(|u| u.to_le_bytes()).collect();
    std::fs::write(path, bytes)?;
    let solve = Solve {
        version: run.version,
        unknowns: case.problem.space.dofs,
        steps: answer.increments.len(),
        seconds,
        wall,
        spent: shapes::spent(!own)? - before,
        peak_mb: engine::peak_memory_mb(!own),
    };
    println!("{}", serde_json::to_string(&solve)?);
    Ok(())
}

/// The named scene on the named meshes; else squares and cubes.
fn tell_phases(arguments: &Arguments) -> Outcome<()> {
    let methods = match &arguments.methods[..] {
        [] => vec![Method::cr()],
        methods => methods.to_vec(),
    };
    let cases: &[(&str, &[usize])] = match (&arguments.n[..], arguments.quick) {
        ([], true) => &[("one-zone", &[16, 32]), ("one-zone-3d", &[4, 14])],
        ([], false) => &[("one-zone", &[512, 1024]), ("one-zone-3d", &[32, 48])],
        (n, _) => &[(&arguments.scene[..], n)],
    };
    let mut solves = Vec::new();
    for method in &methods {
        for (scene, meshes) in cases {
            for &n in *meshes {
                solves.push(phases::Solve::new(scene, *method, n, STOP)?);
            }
        }
    }
    let limits = phases::Limits::measure(arguments.quick);
    solves.into_iter().for_each(|solve| limits.tell(solve));
    Ok(())
}

/// Starts this program again for one solve; u comes along.
fn measure(
    arguments: &Arguments,
    engine: &str,
    method: &Method,
    n: usize,
) -> Outcome<(Solve, Vec<f64>)> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("u.f64");
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(["--scene", &arguments.scene, "--engines", engine])
        .args(["--methods", &method.to_string(), "--n", &n.to_string()]);
    if arguments.strips {
        command.arg("--strips").env("RAYON_NUM_THREADS", "1");
    }
    if let Some(ranks) = arguments.ranks {
        command.args(["--ranks", &ranks.to_string()]);
    }
    let output = command.arg("--once").arg(&path).output()?;
    if !output.status.success() {
        let told = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{engine} on {method}, n = {n}: {}", told.trim()).into());
    }
    let bytes = std::fs::read(&path)?;
    let u = bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b));
    Ok((serde_json::from_slice(&output.stdout)?, u.collect()))
}

/// The largest difference relative to the largest value.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let pairs = a.iter().zip(b);
    let off = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    if a.len() == b.len() {
        off / size
    } else {
        f64::NAN
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 {
        values[middle]
    } else {
        (values[middle - 1] + values[middle]) / 2.0
    }
}

fn compare(arguments: &Arguments) -> Outcome<()> {
    let cores = std::thread::available_parallelism()?;
    println!(
        "{}, increments below {:e}; {cores} cores, one thread for FreeFEM and dolfinx{}\n{}\n",
        arguments.scene,
        STOP.increment,
        if arguments.strips {
            " and Rust; strips of n × 4 squares"
        } else {
            ""
        },
        blas(&arguments.engines)
    );
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    println!(
        "| method | n | unknowns | engine | runs | steps | {} | work | start | core seconds | MB | work / rust | MB / rust |",
        names.join(" | ")
    );
    println!(
        "|---|---|---|---|---|---|{}---|---|---|---|---|---|",
        "---|".repeat(names.len())
    );
    // Seconds of one core by method and engine.
    let mut series: BTreeMap<(String, usize), Vec<(usize, f64)>> = BTreeMap::new();
    for method in &arguments.methods() {
        for n in arguments.meshes(method) {
            let mut rows = Vec::new();
            let mut reference: Option<Vec<f64>> = None;
            for engine in &arguments.engines {
                let mut solves = Vec::new();
                let most = if arguments.quick {
                    1
                } else {
                    arguments.repeats.max(1)
                };
                while solves.len() < most {
                    let (solve, u) = measure(arguments, engine, method, n)?;
                    let first = reference.get_or_insert_with(|| u.clone());
                    let off = distance(first, &u);
                    if !(off <= AGREEMENT) {
                        let what = format!(
                            "{engine} and {} are {off:e} of max|u| apart on {method}, n = {n}",
                            arguments.engines[0]
                        );
                        return Err(what.into());
                    }
                    let long = solve.wall > LONG;
                    solves.push(solve);
                    if long {
                        break;
                    }
                }
                rows.push(Row::new(engine, &solves));
            }
            let rust = rows.iter().find(|r| r.engine == "rust");
            for row in &rows {
                println!("| {method} | {n} | {} |", row.cells(rust));
                let place = arguments.engines.iter().position(|e| *e == row.engine);
                let key = (method.to_string(), place.unwrap_or(0));
                series
                    .entry(key)
                    .or_default()
                    .push((row.unknowns, row.spent));
            }
        }
    }
    println!(
        "\ncore seconds ~ unknowns^s between one mesh and the next, and from the first to the last:\n"
    );
    for ((method, engine), points) in &series {
        let engine = &arguments.engines[*engine];
        let slope = |pair: &[(usize, f64)]| {
            let (a, b) = (pair[0], pair[1]);
            format!("{:.2}", (b.1 / a.1).ln() / (b.0 as f64 / a.0 as f64).ln())
        };
        let slopes: Vec<String> = points.windows(2).map(slope).collect();
        if let ([first, .., last], false) = (&points[..], slopes.is_empty()) {
            let all = slope(&[*first, *last]);
            println!("{method}, {engine}: s = {}; {all}", slopes.join(", "));
        }
    }
    Ok(())
}

/// Medians of an engine on one case.
struct Row {
    engine: String,
    unknowns: usize,
    runs: usize,
    steps: usize,
    columns: Vec<f64>,
    work: f64,
    start: f64,
    spent: f64,
    peak_mb: f64,
}

impl Row {
    fn new(engine: &str, solves: &[Solve]) -> Self {
        let of = |value: &dyn Fn(&Solve) -> f64| median(solves.iter().map(value).collect());
        Row {
            engine: engine.to_owned(),
            unknowns: solves[0].unknowns,
            runs: solves.len(),
            steps: solves[0].steps,
            columns: COLUMNS
                .iter()
                .map(|(_, phases)| of(&|s| s.column(phases)))
                .collect(),
            work: of(&Solve::work),
            start: of(&|s| s.wall - s.work()),
            // What else the machine does adds to it, and takes nothing away.
            spent: solves.iter().fold(f64::INFINITY, |m, s| m.min(s.spent)),
            peak_mb: of(&|s| s.peak_mb),
        }
    }

    fn cells(&self, rust: Option<&Row>) -> String {
        let mut text = format!(
            "{} | {} | {} | {}",
            self.unknowns, self.engine, self.runs, self.steps
        );
        for seconds in self
            .columns
            .iter()
            .chain([&self.work, &self.start, &self.spent])
        {
            // What is 0 to the last digit was not told apart from the rest.
            let told = if *seconds == 0.0 {
                String::new()
            } else {
                format!("{seconds:.3}")
            };
            let _ = write!(text, " | {told}");
        }
        let _ = write!(text, " | {:.0}", self.peak_mb);
        for ratio in [|r: &Row| r.work, |r: &Row| r.peak_mb] {
            let told = rust.map_or(String::new(), |rust| {
                format!("{:.1}", ratio(self) / ratio(rust))
            });
            let _ = write!(text, " | {told}");
        }
        text
    }
}

/// Which BLAS FreeFEM and dolfinx run on: the file behind libblas in each of them.
fn blas(engines: &[String]) -> String {
    let script = "import petsc4py.PETSc; print(*{l.split()[-1] for l in open('/proc/self/maps') if '/libblas' in l})";
    let told = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).output().ok()?;
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let of_freefem = || {
        let path = told("which", &["FreeFem++-nw"])?;
        let libraries = told("ldd", &[path.trim()])?;
        let line = libraries.lines().find(|l| l.contains("libblas"))?;
        let file = line.split_whitespace().find(|w| w.starts_with('/'))?;
        Some(std::fs::canonicalize(file).ok()?.display().to_string())
    };
    let of_fenicsx = || {
        let python = std::env::var("FACEOFF_PYTHON").unwrap_or("/usr/bin/python3".into());
        told(&python, &["-c", script]).map(|t| t.trim().to_owned())
    };
    let mut lines = Vec::new();
    for engine in engines {
        let file = match engine.as_str() {
            "freefem" => of_freefem(),
            "fenicsx" => of_fenicsx(),
            _ => continue,
        };
        let file = file.filter(|f| !f.is_empty()).unwrap_or("unknown".into());
        lines.push(format!("BLAS of {engine}: {file}"));
    }
    lines.join("\n")
}
