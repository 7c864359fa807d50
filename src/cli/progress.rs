//! Progress on stderr, with the time left, on a terminal only: a bar for each engine, or one for everything.

use std::collections::HashMap;
use std::io::IsTerminal;
use std::sync::{Mutex, OnceLock};

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressState, ProgressStyle};

use crate::engine::{Progress, Silent, lock};

/// Runs `run` with bars on a terminal, which are gone when it ends.
pub(super) fn watched<T>(
    engines: &[&str],
    cases: Vec<(String, u64)>,
    quiet: bool,
    run: impl FnOnce(&dyn Progress) -> T,
) -> T {
    let bars = Bars::new(engines, cases, quiet);
    let done = run(bars.as_ref().map_or(&Silent, |bars| bars));
    if let Some(bars) = &bars {
        // A terminal that is gone needs no clearing.
        let _ = bars.all.clear();
    }
    done
}

/// Newton takes about this many steps; it only shapes the estimate.
const USUAL_STEPS: u64 = 8;

struct Bars {
    /// The name of each case, and its share of the work.
    cases: Vec<(String, u64)>,
    bars: Mutex<HashMap<String, ProgressBar>>,
    /// The bar of the whole run, once it reports its share.
    whole: OnceLock<ProgressBar>,
    all: MultiProgress,
    total: u64,
}

/// Steps of the bar of the whole.
const FINE: f64 = 10_000.0;

impl Bars {
    /// None if they would not be visible.
    fn new(engines: &[&str], cases: Vec<(String, u64)>, quiet: bool) -> Option<Self> {
        if quiet || !std::io::stderr().is_terminal() {
            return None;
        }
        let total = USUAL_STEPS * cases.iter().map(|c| c.1).sum::<u64>();
        let all = MultiProgress::new();
        let of_engine = |engine: &&str| {
            let bar = add_bar(&all, "{prefix:>8} ", total);
            bar.set_prefix((*engine).to_owned());
            bar.set_message("starting");
            ((*engine).to_owned(), bar)
        };
        let bars = engines.iter().map(of_engine).collect();
        Some(Bars {
            cases,
            bars: Mutex::new(bars),
            whole: OnceLock::new(),
            all,
            total,
        })
    }

    fn with_bar(&self, engine: &str, act: impl FnOnce(&ProgressBar)) {
        if let Some(bar) = lock(&self.bars).get(engine) {
            act(bar);
        }
    }
}

impl Progress for Bars {
    fn step(&self, engine: &str, case: usize, iteration: usize, increment: f64) {
        let Some((name, weight)) = self.cases.get(case) else {
            return;
        };
        let before: u64 = self.cases[..case].iter().map(|c| c.1).sum();
        let position = USUAL_STEPS * before + weight * (iteration as u64).min(USUAL_STEPS);
        self.with_bar(engine, |bar| {
            bar.set_position(position.min(self.total));
            bar.set_message(format!("{name}: step {iteration}, {increment:.0e}"));
        });
    }

    fn next(&self, what: &str, share: f64) {
        let whole = &self.whole;
        let bar = whole.get_or_init(|| add_bar(&self.all, "", FINE as u64));
        bar.set_position((FINE * share.clamp(0.0, 1.0)) as u64);
        bar.set_message(what.to_owned());
    }

    fn done(&self, engine: &str) {
        self.with_bar(engine, |bar| {
            bar.set_position(self.total);
            bar.finish_with_message("done");
        });
    }
}

/// The remaining time, if known: not before the first step, nor at the end, whose duration is unknown.
fn left(state: &ProgressState, to: &mut dyn std::fmt::Write) {
    let eta = state.eta();
    let is_known = state.pos() > 0 && eta.as_secs() > 0;
    let text = match is_known {
        true => format!("left {}", HumanDuration(eta)),
        false => String::new(),
    };
    // What is written to a string is never lost.
    let _ = write!(to, "{text:<15}");
}

/// A bar that moves by itself; `first` comes before it.
fn add_bar(all: &MultiProgress, first: &str, steps: u64) -> ProgressBar {
    let template = format!("{first}{{bar:24}} {{percent:>3}}% {{elapsed:>4}}, {{left}} {{msg}}");
    let style = ProgressStyle::with_template(&template);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = all.add(ProgressBar::new(steps));
    bar.set_style(style.with_key("left", left));
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}
