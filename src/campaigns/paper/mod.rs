//! Reproduces section 6 of the paper: its two examples with their figures and statements, each compared with the results computed here.
//!
//! E. Burman, P. Hansbo, M. G. Larson, SIAM J. Numer. Anal. 55 (2017), section 6. The errors are with respect to two
//! references: P2 on a fine mesh, as in the paper, and the mesh-free one of [`faceoff_fem::truth`].

mod example;
mod fine;
mod fine_study;
mod iterations;
mod patterns;
mod reference;
mod request;
mod statements;
mod study;
mod sweep;
mod theory;
mod work;

pub use example::Example;
pub use fine_study::FineOutcome;
pub use iterations::{CAP, Count, FAR, Search, Trial};
pub use patterns::Pattern;
pub use reference::{Known, References};
pub use request::PaperRequest;
pub use statements::Statement;
pub use study::{ExampleOutcome, PaperOutcome, Series, SeriesLevel, study};
pub use sweep::Variant;
pub use theory::Theory;

/// The meshes of both examples: h/√2 ∈ {2^-(i+4)}, i = 0 … 4, on the unit square.
pub const MESHES: [usize; 5] = [16, 32, 64, 128, 256];
/// The reference: "a 500 × 500 mesh".
pub const FINE: usize = 500;
/// "The tolerance was set to TOL = 10⁻⁷", of the relative H¹ norm of the increment.
pub const TOL: f64 = 1e-7;
/// The counts of the fixed point iterations of 6.1, one for each of [`MESHES`].
pub const ITERATIONS: [usize; 5] = [79, 84, 66, 54, 58];
/// Those for the reference of 6.1, on [`FINE`].
pub const FINE_ITERATIONS: usize = 127;
/// N of (6.2).
pub const ZONES: [u32; 2] = [3, 5];

/// If there are more intervals, the text only has the first ones.
const MOST_INTERVALS: usize = 8;

/// `[0, 0.1] ∪ [0.3, 0.4]`; for very many only the first ones.
pub fn intervals(set: &[[f64; 2]], digits: usize) -> String {
    let shown = set.iter().take(MOST_INTERVALS);
    let words: Vec<String> = shown
        .map(|[a, b]| format!("[{a:.digits$}, {b:.digits$}]"))
        .collect();
    let more = if set.len() > MOST_INTERVALS {
        format!(" ∪ … ({} in all)", set.len())
    } else {
        String::new()
    };
    words.join(" ∪ ") + &more
}
