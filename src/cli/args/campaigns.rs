//! The arguments of commands that run many cases: `orders`, `study`, `stress`, `paper`, `matrix`, `hunt`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::{Output, Running, SCENES, Trust, Verdicts};
use crate::campaigns::paper;
use crate::cli::words::{Methods, methods, setting, time};

#[derive(Args)]
#[command(after_help = SCENES)]
pub(in crate::cli) struct Orders {
    /// Scenes with a known solution [default: all built-in ones]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Take results of any code instead of scenes: from the coarsest mesh to the finest, in files that `faceoff compare` reads
    #[arg(long, value_name = "FILE,FILE,…", value_delimiter = ',', conflicts_with_all = ["scenes", "methods", "n"])]
    pub results: Vec<PathBuf>,
    /// Take errors of results against this one [default: each against the next]
    #[arg(long, value_name = "FILE", requires = "results")]
    pub reference: Option<PathBuf>,
    /// Take errors of results against this function, as in "sin(pi*x)*y"; of a vector give one for each component
    #[arg(
        long,
        value_name = "FORMULA",
        requires = "results",
        conflicts_with = "reference",
        allow_hyphen_values = true
    )]
    pub exact: Vec<String>,
    /// Judge only this field of results: a name, a component, magnitude or divergence as in `u[0]`, `|u|` or `div(u)`; may be given several
    /// times [default: all that they share]
    #[arg(long, value_name = "NAME", requires = "results")]
    pub only: Vec<String>,
    /// cr, p1, p2, a member of the family (2.4) such as "p2(1,0)", p1-vi, cr-vi, penalty, multiplier
    #[arg(long, default_value = "cr,p1,p2", value_parser = methods)]
    pub methods: Methods,
    /// Refinements, increasing
    #[arg(long, value_delimiter = ',', default_values = ["16", "32", "64"], value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Vec<u32>,
    /// Of scenes of elasticity: give a parameter this value, as in nu=0.4999; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true, conflicts_with = "results")]
    pub set: Vec<(String, String)>,
    #[command(flatten)]
    pub trust: Trust,
    #[command(flatten)]
    pub output: Output,
}

/// Exit code: 0 done; 1 some iteration did not reach its tolerance; 2 nothing was measured.
#[derive(Args)]
#[command(after_help = SCENES)]
pub(in crate::cli) struct Study {
    /// Scenes, preferably with a known solution: an exact one, or one-zone, three-zones, five-zones; or scenes of elasticity, whose error is measured
    /// for gamma0 and beta over their ranges
    #[arg(value_name = "SCENE", default_values = ["one-zone", "transition-1.5"])]
    pub scenes: Vec<String>,
    /// Engines, or TOML files that describe one
    #[arg(long, value_delimiter = ',', default_values = ["rust"])]
    pub engines: Vec<String>,
    /// Methods: an engine runs those that it has
    #[arg(long, default_value = "cr,cr-fc,p1,p2,p1-vi,cr-vi,penalty,multiplier", value_parser = methods)]
    pub methods: Methods,
    /// Total wall-clock time, such as 90s, 5m or 1h; the two coarsest meshes are always measured
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time, allow_negative_numbers = true)]
    pub budget: Duration,
    /// Finest uniform mesh; adapted meshes stop at as many dofs
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub finest: Option<u32>,
    /// Keep each measurement in FILE as soon as it is made, and reuse those of an earlier run
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    #[command(flatten)]
    pub trust: Trust,
    #[command(flatten)]
    pub running: Running,
    #[command(flatten)]
    pub output: Output,
}

/// Exit code: 0 nothing is wrong; 1 something is; 2 not run.
#[derive(Args)]
pub(in crate::cli) struct Stress {
    /// Scenes with an exact solution: their data, domain and gamma0 are taken to extremes; or scenes of elasticity: E, nu, the coefficient of friction
    /// and the height of the body are
    #[arg(value_name = "SCENE", default_values = ["transition-1.5", "manufactured-3"])]
    pub scenes: Vec<String>,
    /// Only these families of extremes, such as --families gamma0,flat [default: all]
    #[arg(long, value_delimiter = ',')]
    pub families: Vec<String>,
    /// Engines, or TOML files that describe one
    #[arg(long, value_delimiter = ',', default_values = ["rust"])]
    pub engines: Vec<String>,
    /// Methods: an engine runs those that it has
    #[arg(long, default_value = "cr,cr-fc,p1,p2,p1-vi,cr-vi,penalty,multiplier", value_parser = methods)]
    pub methods: Methods,
    #[command(flatten)]
    pub trust: Trust,
    #[command(flatten)]
    pub running: Running,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}

#[derive(Args)]
pub(in crate::cli) struct Paper {
    /// Only the mesh-free solutions: contact set, norms, flux and samples
    #[arg(long, conflicts_with_all = ["engines", "n", "fine", "ranks", "launcher", "keep", "tolerance", "max_iterations", "install"])]
    pub reference: bool,
    /// N of (6.2) besides the paper's 3 and 5
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    pub zones: Vec<u32>,
    /// Further codes that solve the same problems: freefem, fenicsx, or a TOML file
    #[arg(long, value_delimiter = ',')]
    pub engines: Vec<String>,
    /// Meshes, increasing
    #[arg(long, value_delimiter = ',', default_values_t = paper::MESHES.map(|n| n as u32), value_parser = clap::value_parser!(u32).range(1..))]
    pub n: Vec<u32>,
    /// Mesh of the P2 reference, a multiple of 4
    #[arg(long, value_name = "N", default_value_t = paper::FINE as u32, value_parser = clap::value_parser!(u32).range(4..))]
    pub fine: u32,
    #[command(flatten)]
    pub running: Running,
    #[command(flatten)]
    pub output: Output,
}

/// With --report the folder keeps the history of all runs, a badge for each release, and for each scene and method the page that
/// `verify` writes.
///
/// Exit code: 0 all agree; 1 something differs; otherwise 2 if a release is missing or failed.
#[derive(Args)]
pub(in crate::cli) struct Matrix {
    /// A TOML file with `scenes`, `methods`, `n`, and `[[releases]]` of codes, with the command prefix that runs each in a container or chroot
    pub file: PathBuf,
    /// Run the programs that the file names; without this option, the file is refused
    #[arg(long)]
    pub run: bool,
    #[command(flatten)]
    pub trust: Trust,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}

/// Draws well-posed weak forms and their meshes, writes each for all codes, runs them, and puts every answer that differs into its form.
/// What is wrong there, crashes, hangs or is not finite is made smaller while it stays so. A refusal with a message is not a finding.
///
/// Exit code: 0 nothing was found; 1 something was; 2 nothing could be judged.
#[derive(Args)]
pub(in crate::cli) struct Hunt {
    /// Codes that solve forms; a single one is compared with its own answers to images of a problem [default: rust, freefem, dolfinx, scikit-fem;
    /// with --files rust, meshio, vtk, gmsh]
    #[arg(long, value_name = "CODE,CODE,…", value_delimiter = ',')]
    pub engines: Vec<String>,
    /// Instead of forms, draw meshes with fields and groups, write each with every library, read the files with every other, and compare with what
    /// was drawn
    #[arg(long)]
    pub files: bool,
    /// Of what is drawn: the same forms for the same seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// End after this number of problems [default: go on until --time-limit or an interruption ends it, which is reported as any end]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    pub count: Option<u32>,
    /// A code that takes longer than this for one problem hangs
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time, allow_negative_numbers = true)]
    pub patience: Duration,
    /// Keep each finding in a folder of its own in DIR, as a form file that `faceoff verify` runs, and what is done in DIR/hunt.json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on from DIR/hunt.json
    #[arg(long, requires = "out")]
    pub resume: bool,
    #[command(flatten)]
    pub verdicts: Verdicts,
    #[command(flatten)]
    pub output: Output,
}
