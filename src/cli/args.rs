//! The arguments, as clap parses them.

mod campaigns;
mod engines;
mod mesh;

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Args, Parser, Subcommand, ValueEnum};

pub(super) use campaigns::{Hunt, Matrix, Orders, Paper, Stress, Study};
pub(super) use engines::{Engines, EnginesAction, INSTALLED};
pub(super) use mesh::{Form, Mesh, MeshAction};

use super::words::{
    Accuracy, Methods, OfField, Words, accuracy, bound, increment, launcher, memory, method,
    methods, of_field, pair, setting, time,
};
use crate::report;
use crate::run::{is_elastic, is_face_off};
use faceoff_fem::adapt::Way;
use faceoff_fem::certify::Target;
use faceoff_fem::contact::{Iteration, Method};
use faceoff_fem::linear::{Precision, Solver};
use faceoff_fem::scene::Scene;
use faceoff_form::codes::{BY_HAND, CODES};
use faceoff_judge::MatchBy;
use faceoff_mesh::error::{Error, Result, distinct};
use faceoff_mesh::io::NATIVE;

/// Settle whether finite element codes agree, face by face.
///
/// Exit code: 0 agree or done; 1 disagree or not reached; 2 could not judge.
#[derive(Parser)]
#[command(name = "faceoff", version, max_term_width = 100)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub limits: Limits,
}

/// Limits for a command and everything that it starts.
#[derive(Args)]
pub(super) struct Limits {
    /// Time limit for the command, such as 90s, 5m or 1h
    #[arg(help_heading = "Every command", long, global = true, value_name = "TIME", value_parser = time, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
    /// Memory limit for the command, such as 500MB or 4GB [default: the available memory]
    #[arg(help_heading = "Every command", long, global = true, value_name = "SIZE", value_parser = memory, allow_negative_numbers = true)]
    pub memory: Option<u64>,
    /// Run other codes in a sandbox (bubblewrap) or not at all: without network, without your variables and files, writing only to
    /// their job folder [env: FACEOFF_SANDBOX=require]
    #[arg(help_heading = "Every command", long, global = true)]
    pub sandbox: bool,
    /// Print more: `verify` prints every answer and every field of every pair; -vv: also which programs run, and what is left out
    #[arg(help_heading = "Every command", long, short, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Run scenes through all engines and judge every pair
    Verify(Verify),
    /// Write a weak form as a script of one code, to run without faceoff
    Write(Write),
    /// Begin a problem of your own, which `verify` runs at once
    New(New),
    /// Check whether a result solves the scheme; if not, where and why
    Judge(Judge),
    /// Compare two result files from any codes, field by field
    Compare(Compare),
    /// Bound the error of a result of any code
    Certify(Certify),
    /// Solve one scene with one engine
    Solve(Solve),
    /// Observed orders of convergence, next to theory where it is known
    Orders(Orders),
    /// Reproduce section 6 of the paper: its tables, figures and statements
    Paper(Paper),
    /// What each digit costs in time and memory, by method, with advice
    Study(Study),
    /// What breaks at extremes of data, domains, meshes and gamma0
    Stress(Stress),
    /// Compare releases of codes: a page with badges and history
    Matrix(Matrix),
    /// Run random weak forms in every code, and report what is wrong by cause
    Hunt(Hunt),
    /// Inspect, check, convert, make or refine meshes
    Mesh(Mesh),
    /// Begin a scene on your mesh: a TOML file with its groups
    Init(Init),
    /// List the built-in scenes and their purpose
    Scenes(Scenes),
    /// Show the installed codes, their versions, and what is missing
    Engines(Engines),
    /// Write completions of arguments for a shell, on standard output
    ///
    /// Example for bash: faceoff completions bash > ~/.local/share/bash-completion/completions/faceoff
    Completions(Completions),
    /// Write the manual pages of all commands into DIR
    #[command(hide = true)]
    Man(Man),
}

#[derive(Args)]
pub(super) struct Completions {
    /// Which shell
    pub shell: clap_complete::Shell,
}

#[derive(Args)]
pub(super) struct Man {
    /// A folder, which is created if necessary
    pub dir: PathBuf,
}

#[derive(Args)]
pub(super) struct Scenes {
    #[command(flatten)]
    pub output: Output,
}

/// The scene is written next to the mesh as FILE.toml. The role of each group on the boundary is guessed from its name.
#[derive(Args)]
#[command(after_help = formats())]
pub(super) struct Init {
    /// A mesh of any format that `faceoff mesh info` reads
    pub mesh: PathBuf,
    /// Say nothing but errors
    #[arg(help_heading = "Output", long, short)]
    pub quiet: bool,
}

/// Where results go.
#[derive(Args)]
pub(super) struct Output {
    /// Write the result as JSON to FILE (`-` for standard output)
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a page (index.html) with figures and data into DIR
    #[arg(help_heading = "Output", long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Print only errors
    #[arg(help_heading = "Output", long, short)]
    pub quiet: bool,
}

/// Verdicts for CI pipelines.
#[derive(Args)]
pub(super) struct Verdicts {
    /// Write a JUnit XML file with one case per judgement
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write the verdict as a badge
    #[arg(help_heading = "Output", long, value_name = "FILE.svg")]
    pub badge: Option<PathBuf>,
}

/// Rights of an untrusted scene.
#[derive(Args)]
pub(super) struct Trust {
    /// Let a scene name a mesh outside its own folder
    #[arg(help_heading = "Trust", long)]
    pub allow_outside: bool,
}

impl Trust {
    /// The scenes of these names or files; their names must be distinct.
    pub fn scenes(&self, names: &[String]) -> Result<Vec<Scene>> {
        let found = names.iter().map(|name| self.scene(name));
        let found = found.collect::<Result<Vec<_>>>()?;
        let names = found.iter().map(Scene::name);
        distinct(names, "scene", "give scenes of different names")?;
        Ok(found)
    }

    /// The scene of this name or file.
    pub fn scene(&self, name: &str) -> Result<Scene> {
        if is_elastic(name.as_ref()) {
            let what =
                format!("{name} is a scene of elasticity, and this is for the scalar problem");
            let remedy = "verify, solve, orders, study, stress, judge and write take it";
            return Err(Error::usage(what, remedy));
        }
        if is_face_off(name.as_ref()) {
            let what = format!("{name} is not a scene: it contains a form, or codes");
            let remedy = format!("compare its codes: faceoff verify {name}");
            return Err(Error::usage(what, remedy));
        }
        match self.allow_outside {
            true => Scene::find_anywhere(name),
            false => Scene::find(name),
        }
    }
}

fn to<'a>(
    command: &'static str,
    output: &'a Output,
    verdicts: Option<&'a Verdicts>,
) -> report::Output<'a> {
    report::Output {
        command,
        subject: None,
        judges: verdicts.is_some(),
        json: output.json.as_deref(),
        report: output.report.as_deref(),
        junit: verdicts.and_then(|v| v.junit.as_deref()),
        badge: verdicts.and_then(|v| v.badge.as_deref()),
        quiet: output.quiet,
    }
}

/// The output of a command without results.
fn plain(command: &'static str) -> report::Output<'static> {
    report::Output {
        command,
        ..report::Output::default()
    }
}

impl Command {
    /// Where the results go, and their subject.
    pub fn output(&self) -> report::Output<'_> {
        match self {
            Command::Verify(a) => to("verify", &a.output, Some(&a.verdicts)),
            Command::Write(_) => plain("write"),
            Command::New(_) => plain("new"),
            Command::Init(_) => plain("init"),
            Command::Completions(_) => plain("completions"),
            Command::Man(_) => plain("man"),
            Command::Scenes(a) => to("scenes", &a.output, None),
            Command::Compare(a) => report::Output {
                subject: Some(format!("{} – {}", a.a.display(), a.b.display())),
                ..to("compare", &a.output, Some(&a.verdicts))
            },
            Command::Judge(a) => report::Output {
                subject: Some(a.result.display().to_string()),
                ..to(a.command(), &a.output, Some(&a.verdicts))
            },
            Command::Certify(a) => to("certify", &a.output, None),
            Command::Solve(a) if is_elastic(a.scene.as_ref()) => {
                to("solve elastic", &a.output, None)
            }
            Command::Solve(a) => to("solve", &a.output, None),
            Command::Orders(a) => to("orders", &a.output, None),
            Command::Paper(a) if a.reference => to("paper reference", &a.output, None),
            Command::Paper(a) => to("paper", &a.output, None),
            Command::Study(a) => to("study", &a.output, None),
            Command::Stress(a) => to("stress", &a.output, Some(&a.verdicts)),
            Command::Matrix(a) => to("matrix", &a.output, Some(&a.verdicts)),
            Command::Hunt(a) => to("hunt", &a.output, Some(&a.verdicts)),
            Command::Mesh(a) => match &a.action {
                MeshAction::Info { output, .. } => to("mesh info", output, None),
                MeshAction::Check {
                    output, verdicts, ..
                } => to("mesh check", output, Some(verdicts)),
                MeshAction::Convert { output, .. } => to("mesh convert", output, None),
                MeshAction::Make { output, .. } => to("mesh make", output, None),
                MeshAction::Refine { output, .. } => to("mesh refine", output, None),
            },
            Command::Engines(a) => match &a.action {
                Some(EnginesAction::Check {
                    output, verdicts, ..
                }) => to("engines check", output, Some(verdicts)),
                _ => to("engines", &a.output, None),
            },
        }
    }
}

/// How engines are run.
#[derive(Args)]
pub(super) struct Running {
    /// Run fenicsx with mpirun as R processes with a partitioned mesh
    #[arg(help_heading = "Engines", long, value_name = "R", default_value = "1", value_parser = clap::value_parser!(u32).range(1..))]
    pub ranks: u32,
    /// Start the processes of fenicsx with this command instead, such as "srun -n 64"; job folders must be on
    /// a shared disk: use --keep
    #[arg(help_heading = "Engines", long, value_name = "COMMAND", value_parser = launcher, conflicts_with = "ranks")]
    pub launcher: Option<Words>,
    /// Keep the job folders in DIR
    #[arg(help_heading = "Engines", long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    /// Stop when the relative broken H1 norm of the increment is below this
    #[arg(help_heading = "Engines", long, value_name = "TOL", default_value = "1e-12", value_parser = increment, allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Maximum number of iterations
    #[arg(help_heading = "Engines", long, value_name = "STEPS", default_value = "50", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_iterations: u32,
    /// First install missing engines
    #[arg(help_heading = "Engines", long)]
    pub install: bool,
}

/// Printed below the options.
const SCENES: &str =
    "`faceoff scenes` lists the built-in scenes; docs/reference/scenes.md describes TOML files.";

/// Printed below the options of commands that read results and meshes.
fn formats() -> String {
    let titles: Vec<&str> = NATIVE.iter().map(|format| format.title).collect();
    format!("Formats: {}; others through meshio.", titles.join(", "))
}

#[derive(Args)]
#[command(after_help = SCENES)]
pub(super) struct Verify {
    /// Built-in scenes or TOML files [default: the four in 2D without exact solutions]; or the file of a weak form, from which each
    /// code's script is generated; or, with --run, one face-off file, whose codes are your own programs (`faceoff new`)
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Engines, or TOML files that describe one [default: rust,freefem,fenicsx; with --against: rust]; for a face-off, some of its codes
    /// [default: all]
    #[arg(long, value_delimiter = ',')]
    pub engines: Vec<String>,
    /// Methods: cr, cr-fc, p1, p2, or a member of the family (2.4) such as "p2(1,0)"
    #[arg(long, default_value = "cr,p2", value_parser = methods)]
    pub methods: Methods,
    /// Refinements [default: each scene's own]
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Vec<u32>,
    /// Set a parameter of a face-off file or a form, also one of its sweep; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    pub set: Vec<(String, String)>,
    /// Judge without missing engines, or for a form without codes that are missing or cannot solve it
    #[arg(long)]
    pub allow_missing: bool,
    /// Search for the cause by more runs: where codes differ and no change of the scheme explains it, run both again with one thing matched at a time (tolerance,
    /// order of the mesh, linear solver) and name what accounts for it; of a face-off, run every code again with one thing changed
    /// that should not matter (order of cells and vertices, threads, the last digits of parameters)
    #[arg(long)]
    pub diagnose: bool,
    /// Of a face-off, also give every code images of the problem, with which its answer must move: points, cells and groups in another order; of a form also
    /// mirrored, turned by 90 degrees and in other units; of your own codes what `symmetries` names in the file
    #[arg(long)]
    pub symmetries: bool,
    /// If all agree, keep answers in DIR: those of the other engines, or of a face-off all results
    #[arg(long, value_name = "DIR", conflicts_with = "against")]
    pub record: Option<PathBuf>,
    /// Judge against answers that --record kept
    #[arg(long, value_name = "DIR")]
    pub against: Option<PathBuf>,
    /// Keep each answer in DIR as soon as it is available, and reuse those of an interrupted run with the same settings
    #[arg(long, value_name = "DIR", conflicts_with = "diagnose")]
    pub resume: Option<PathBuf>,
    /// Run the programs that a face-off file names; without this option, a file with commands is refused
    #[arg(long)]
    pub run: bool,
    #[command(flatten)]
    pub trust: Trust,
    /// Report for each case which model was chosen, what was left out, and what the Rust engine built for it
    #[arg(long)]
    pub explain: bool,
    #[command(flatten)]
    pub running: Running,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}

/// Without -o the script is printed. With -o the script and the mesh that it reads are written, and the command that runs it is printed.
#[derive(Args)]
pub(super) struct Write {
    /// A TOML file with a weak form (docs/reference/form.md), or a scene of elasticity
    pub form: PathBuf,
    /// The code; fenicsx, for dolfinx, has a scheme by hand for scenes of elasticity
    #[arg(long = "for", value_name = "CODE", value_parser = PossibleValuesParser::new(CODES.iter().chain(&BY_HAND[1..]).map(|code| code.name)))]
    pub code: String,
    /// Of a scene of elasticity
    #[arg(long, default_value = "cr", value_parser = method)]
    pub method: Method,
    /// Refinement of the mesh [default: the first of the file]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Option<u32>,
    /// Let the script write its linear system too, as A.mtx, b.mtx and dofs.csv next to its result (docs/how-to/systems.md)
    #[arg(long)]
    pub system: bool,
    /// A file, or a folder in which it gets its usual name
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(help_heading = "Output", long, short)]
    pub quiet: bool,
}

/// The folder contains a face-off file, a typical script for FreeFEM and one for dolfinx, a README and a CI pipeline; or the
/// file of a weak form and a CI pipeline.
#[derive(Args)]
#[command(after_help = super::new::gallery())]
pub(super) struct New {
    /// The folder, whose last part is the name
    pub name: PathBuf,
    /// The template
    #[arg(long, default_value = "blank", value_parser = super::new::FromExample)]
    pub from: Template,
    /// Start from this weak form instead
    #[arg(long, value_name = "FORM", conflicts_with = "from", value_parser = PossibleValuesParser::new(super::new::forms()))]
    pub form: Option<String>,
    /// Use this mesh, and print its groups
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(help_heading = "Output", long, short)]
    pub quiet: bool,
}

/// The folders of `examples`.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Template {
    Blank,
    Obstacle,
    Hertz,
}

/// Reads VTU, PVTU, and all files whose fields `faceoff mesh info` shows; CSV with the key columns `vertex`, `v0,v1[,v2]` or
/// `x,y[,z]`, or with quantities over `time`. Two results with several times (a PVD, XDMF, Exodus or MSH file, or a pattern of
/// numbered files such as 'u_*.vtu') are matched by time, the files of two folders by name. Results on different meshes are
/// compared as functions, on the intersection of the meshes.
#[derive(Args)]
#[command(after_help = formats())]
pub(super) struct Compare {
    /// A result: a file, a series or a folder
    pub a: PathBuf,
    /// Another
    pub b: PathBuf,
    /// Relative tolerance: a field agrees where |a-b| <= max(rtol * its largest value, atol) [default: 1e-9]
    #[arg(long, value_name = "R", value_parser = bound, allow_negative_numbers = true)]
    pub rtol: Option<f64>,
    /// Absolute tolerance [default: 0]
    #[arg(long, value_name = "A", value_parser = bound, allow_negative_numbers = true)]
    pub atol: Option<f64>,
    /// Tolerances of one field, or of a pattern, as in "u:rtol=1e-6,atol=1e-12", and what its problem leaves open, as in
    /// "p:up_to=constant" (also sign, scale, phase, rigid, gradient, or several joined by +); tolerances that are left out are those of all fields
    #[arg(long = "field", value_name = "NAME:KEY=VALUE", value_parser = of_field)]
    pub field: Vec<OfField>,
    /// Use the tolerances in the table `compare` of this scene, unless an option sets them
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<String>,
    #[command(flatten)]
    pub trust: Trust,
    /// Judge only this field: a pattern as in `u*`, a component as in `u[0]`, a magnitude as in `|u|`, a
    /// divergence or curl as in `div(u)`; may be given several times [default: every field of either file]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Leave this field out, or a pattern; may be given several times
    #[arg(long, value_name = "NAME")]
    pub except: Vec<String>,
    /// Treat NaN on both sides as equal in this field; NaN against a number is always a difference
    #[arg(long, value_name = "NAME")]
    pub nan_equal: Vec<String>,
    /// The field NAME of A is called OTHER in B, as in "speed=|u|"; may be given several times
    #[arg(long, value_name = "NAME=OTHER", value_parser = pair)]
    pub pair: Vec<(String, String)>,
    /// The mesh to which the vertex numbers (from 0) in columns `v0,v1[,v2]` refer, for fields such as `RT0(q)` and `N1curl(u)`
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,
    /// Judge only cells of this dimension, if a file also contains those of the boundary
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u8).range(0..=3))]
    pub dim: Option<u8>,
    /// How points and cells match: by their numbers, by their places, or fields as functions wherever both meshes are
    /// [default: by numbers where the points of both files are the same; as functions where their cells are others]
    #[arg(long, value_parser = PossibleValuesParser::new(["vertices", "coordinates", "functions"]).map(match_by))]
    pub map: Option<MatchBy>,
    /// Largest distance along an axis at which two points are the same [default: from the digits of the coordinates]
    #[arg(long, value_name = "DISTANCE", value_parser = bound, allow_negative_numbers = true)]
    pub place_tolerance: Option<f64>,
    /// For functions on two meshes: the part of either mesh that the other need not cover, such as 0.01 if both approximate one
    /// curved domain [default: the effect of rounding the coordinates]
    #[arg(long, value_name = "PART", value_parser = bound, allow_negative_numbers = true)]
    pub uncovered: Option<f64>,
    /// Write the differences on the mesh of A
    #[arg(long, value_name = "FILE.vtu")]
    pub out: Option<PathBuf>,
    /// Write the fields of B on the mesh of A, by the L2 projection, which conserves integrals
    #[arg(long, value_name = "FILE.vtu")]
    pub project: Option<PathBuf>,
    /// For results with several times: judge only this one
    #[arg(
        long,
        value_name = "T",
        allow_negative_numbers = true,
        conflicts_with = "times"
    )]
    pub time: Option<f64>,
    /// Which times to judge
    #[arg(long, value_name = "WHICH", value_parser = ["all", "last"], default_value = "all")]
    pub times: String,
    /// Largest distance at which two times are the same [default: from their digits]
    #[arg(long, value_name = "DT", value_parser = bound, allow_negative_numbers = true)]
    pub time_tolerance: Option<f64>,
    /// If B lacks a time of A, interpolate linearly between its neighbours
    #[arg(long)]
    pub interpolate: bool,
    /// For two folders: compare only files matching this pattern, such as '*.vtu'; may be given several times [default: all that
    /// can be results]
    #[arg(long, value_name = "PATTERN")]
    pub include: Vec<String>,
    /// For two folders: leave out files matching this pattern; may be given several times
    #[arg(long, value_name = "PATTERN")]
    pub exclude: Vec<String>,
    /// Without effect: two files with identical bytes are always compared as two results
    #[arg(long, hide = true)]
    pub allow_identical: bool,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}

fn match_by(word: String) -> MatchBy {
    match word.as_str() {
        "vertices" => MatchBy::Vertices,
        "coordinates" => MatchBy::Coordinates,
        _ => MatchBy::Functions,
    }
}

impl Judge {
    /// The kind of judgement, by its name in the schemas.
    fn command(&self) -> &'static str {
        match is_face_off(self.scene.as_ref()) {
            true => "judge form",
            false => "judge",
        }
    }
}

/// Substitutes a field into the discrete equations and reports whether it solves them. If not, it reports the equations, faces and
/// terms with a residual, the γ that each contact face would need, and the single change of the scheme or of the values that explains
/// the residual. All of this follows from the field; the code that wrote it is not run. As for `certify`, the space of the field
/// follows from where it has values. For a form file, the fields with the names of its unknowns are substituted into F, on its
/// mesh at the refinement that fits or that --n sets.
///
/// Exit code: 0 the residual is at rounding level; 1 it is not; 2 it could not be judged.
#[derive(Args)]
#[command(after_help = SCENES)]
pub(super) struct Judge {
    /// A file of any kind that `faceoff compare` reads
    pub result: PathBuf,
    /// The problem: a built-in scene, or a TOML file with a scene or a form
    #[arg(long, value_name = "SCENE")]
    pub scene: String,
    #[command(flatten)]
    pub trust: Trust,
    /// The method whose equations it should solve [default: cr, p1 or p2, according to the field]
    #[arg(long, value_parser = method)]
    pub method: Option<Method>,
    /// The field [default: the only one that can be u, or the one of that name]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// The mesh of the result (with the groups that the scene names) [default: that of the file, or the scene's where it has none]
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,
    /// Refinement of the scene's mesh (for a file without a mesh) [default: the scene's own]
    #[arg(long, conflicts_with = "mesh", value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Option<u32>,
    /// Overrides the scene's gamma0
    #[arg(long, allow_negative_numbers = true)]
    pub gamma0: Option<f64>,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}

/// Guaranteed bounds for the error of a field, from any code and method. The space of the field follows from where it has
/// values: P1 at vertices, P2 at vertices and midpoints of edges, CR at corners of cells or on faces.
///
/// Exit code: 0 certified; 2 no certificate.
#[derive(Args)]
#[command(after_help = SCENES)]
pub(super) struct Certify {
    /// A file of any kind that `faceoff compare` reads
    pub result: PathBuf,
    /// The problem: a built-in scene or a TOML file
    #[arg(long, value_name = "SCENE")]
    pub scene: String,
    #[command(flatten)]
    pub trust: Trust,
    /// The field [default: the only one that can be u, or the one of that name]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// Take the field as a function of this space
    #[arg(long, value_parser = PossibleValuesParser::new(["cr", "p1", "p2"]).try_map(|word| method(&word)))]
    pub element: Option<Method>,
    /// The method that computed it: the flux on Γ_C is then that of the method, which gives sharper bounds for cr-fc
    #[arg(long, value_parser = method, conflicts_with = "element")]
    pub method: Option<Method>,
    /// The mesh of the result (with the groups that the scene names) [default: that of the file, or the scene's where it has none]
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,
    /// Refinement of the scene's mesh (for a file without a mesh) [default: the scene's own]
    #[arg(long, conflicts_with = "mesh", value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Option<u32>,
    /// Write the field as FILE.vtu (with what each cell adds to the bound), and its faces as FILE-faces.vtu
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args)]
#[command(after_help = SCENES)]
pub(super) struct Solve {
    /// A built-in scene or a TOML file
    pub scene: String,
    #[command(flatten)]
    pub trust: Trust,
    /// An engine, or a TOML file that describes one
    #[arg(long, default_value = "rust")]
    pub engine: String,
    /// cr, cr-fc, p1, p2, or a member of the family (2.4) such as "p2(1,0)"; p1-vi, cr-vi, penalty,
    /// multiplier (Rust engine only) [default: cr; with --accuracy cr-fc]
    #[arg(long, value_parser = method)]
    pub method: Option<Method>,
    /// Refinement [default: the scene's own]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Option<u32>,
    /// Solve on this mesh instead of the scene's
    #[arg(long, value_name = "FILE", conflicts_with = "n")]
    pub mesh: Option<PathBuf>,
    /// Overrides the scene's gamma0
    #[arg(long, allow_negative_numbers = true)]
    pub gamma0: Option<f64>,
    /// Of a scene of elasticity: give a parameter this value, as in nu=0.4999; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    pub set: Vec<(String, String)>,
    /// newton, or a splitting of the paper's fixed point: lagged-p, lagged-gap, relaxed, flux-new
    /// (Rust engine only)
    #[arg(long, default_value = "newton")]
    pub iteration: Iteration,
    /// Linear solver: auto, multifrontal, faer or iterative (Rust engine only)
    #[arg(long, value_name = "SOLVER", default_value = "auto")]
    pub linear: Solver,
    /// Precision of the factor: f64, f32-refined, which takes half the memory and is refined to the same
    /// digits, or auto, which uses f32 for large factors (Rust engine only)
    #[arg(long, default_value = "auto")]
    pub precision: Precision,
    /// Refine until a certified error is below TOL: relative, in the energy norm or of the contact force; WHAT as for --certify (Rust
    /// engine only)
    #[arg(long, value_name = "TOL[:WHAT]", value_parser = accuracy, allow_negative_numbers = true, conflicts_with_all = ["n", "mesh", "engine", "iteration"])]
    pub accuracy: Option<Accuracy>,
    /// With --accuracy: only uniform or only adaptive meshes [default: whichever is predicted to be cheaper]
    #[arg(long, value_name = "uniform|adaptive", requires = "accuracy")]
    pub way: Option<Way>,
    /// Bound the error of the averaged gradient (g), of an admissible function (v), of u_h (u_h), or of the contact force
    /// (contact-force)
    #[arg(long, value_name = "WHAT", num_args = 0..=1, require_equals = true, default_missing_value = "g")]
    pub certify: Option<Target>,
    /// Report which model was chosen, what was left out, and what was built for it
    #[arg(long)]
    pub explain: bool,
    /// Write the solution as FILE.vtu (and its faces as FILE-faces.vtu)
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub running: Running,
    #[command(flatten)]
    pub output: Output,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}
