//! A face-off at every point of a sweep: one verdict, and the simplest point at which codes fail.

use std::collections::BTreeSet;
use std::time::Instant;

use serde::Serialize;

use super::{FaceOffOutcome, Running, face_off};
use crate::engine::Progress;
use crate::run::{FaceOff, Point, Same, Sweep, rounded};
use faceoff_judge::Verdict;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// At most this many face-offs are spent on making a failure simpler.
const TRIES: usize = 24;
/// Values with more digits are not simple.
const DIGITS: usize = 4;

/// What was found along a sweep.
#[derive(Debug, Serialize)]
pub struct OfSweep {
    /// What changes from point to point.
    pub over: Vec<String>,
    /// Of the random draw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// In the order of the file, or as they were drawn.
    pub points: Vec<OfPoint>,
    /// The simplest point that was found to fail in the same way as a point of the sweep; the rest of the report is about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smallest: Option<Smallest>,
    /// Where all agree, the rest of the report is about the point at which codes differ most.
    pub shown: Point,
}

/// One point.
#[derive(Debug, Serialize)]
pub struct OfPoint {
    /// By name.
    pub at: Point,
    /// Of all codes there.
    pub verdict: Verdict,
    /// Fields, numbers, spectra, systems and runs that do not pass.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub wrong: BTreeSet<String>,
    /// The largest relative difference of a judged field or number.
    pub largest: Option<f64>,
    /// Where the solution is known, the largest relative error of a field on the finest mesh, in L² and H¹.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<[Option<f64>; 2]>,
}

/// A failure in its simplest case.
#[derive(Debug, Serialize)]
pub struct Smallest {
    /// By name.
    pub at: Point,
    /// What it was found from.
    pub from: Point,
    /// How many face-offs were tried for it.
    pub tried: usize,
    /// What runs it, as one types it.
    pub command: String,
}

/// How long a sweep takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Face-offs.
    pub points: usize,
    /// Of codes in all of them.
    pub runs: usize,
    /// About what is left; none before the first point.
    pub seconds: Option<f64>,
}

/// A part of the progress of a whole.
struct Part<'a> {
    of: &'a dyn Progress,
    start: f64,
    share: f64,
}

impl Progress for Part<'_> {
    fn next(&self, what: &str, share: f64) {
        self.of.next(what, self.start + self.share * share);
    }
}

/// Runs the face-off at every point, and makes the worst failure simpler. `cost` hears what it takes before the first point and after it;
/// `command` is what one types for a point.
///
/// # Errors
/// As [`face_off`]; values that the file could not have.
pub fn swept(
    of: &FaceOff,
    sweep: &Sweep,
    how: &Running,
    progress: &dyn Progress,
    cost: &mut dyn FnMut(Cost),
    command: &dyn Fn(&Point) -> String,
) -> Result<FaceOffOutcome> {
    let points = sweep.points.len();
    // What the file could not have is refused before anything runs.
    let runs = |point| Ok(of.at(point)?.levels().len());
    let runs = sweep.points.iter().map(runs).sum::<Result<usize>>()?;
    let codes = match how.codes.len() {
        0 => of.codes.len(),
        asked => asked,
    };
    let runs = runs * codes;
    let told = |seconds| Cost {
        points,
        runs,
        seconds,
    };
    cost(told(None));
    let plain = Running {
        codes: how.codes.clone(),
        keep: how.keep.clone(),
        diagnose: false,
        symmetries: Vec::new(),
        ..*how
    };
    let mut found: Vec<OfPoint> = Vec::new();
    let mut shown: Option<(usize, FaceOffOutcome)> = None;
    for (k, point) in sweep.points.iter().enumerate() {
        cancel::check()?;
        let clock = Instant::now();
        let part = Part {
            of: progress,
            start: k as f64 / points as f64,
            share: 1.0 / points as f64,
        };
        let outcome = face_off(&of.at(point)?, &plain, &part)?;
        found.push(OfPoint::new(point, &outcome));
        let is_worse = |best: usize| key(&found[k]) > key(&found[best]);
        if shown.as_ref().is_none_or(|(best, _)| is_worse(*best)) {
            shown = Some((k, outcome));
        }
        if k == 0 && points > 1 {
            let left = clock.elapsed().as_secs_f64() * (points - 1) as f64;
            cost(told(Some(left)));
        }
    }
    let Some((worst, outcome)) = shown else {
        // A sweep has points; a face-off without any is judged as it is.
        return face_off(of, how, progress);
    };
    let verdict = Verdict::of_all(found.iter().map(|of| of.verdict));
    let from = &sweep.points[worst];
    let mut tried = 0;
    let (at, mut outcome) = match verdict.passes() {
        true => (from.clone(), outcome),
        false => simplest(of, sweep, &plain, (from, outcome), &mut tried)?,
    };
    if how.diagnose || !how.symmetries.is_empty() {
        outcome = face_off(&of.at(&at)?, how, progress)?;
    }
    // A failure that does not come again is one.
    outcome.verdict = verdict.max(outcome.verdict);
    outcome.sweep = Some(OfSweep {
        over: sweep.names.clone(),
        seed: sweep.seed,
        points: found,
        smallest: (!verdict.passes()).then(|| Smallest {
            command: command(&at),
            at: at.clone(),
            from: from.clone(),
            tried,
        }),
        shown: at,
    });
    Ok(outcome)
}

/// The point to show is the one that is greatest: by its verdict, then by its difference; the first of those that are alike.
fn key(of: &OfPoint) -> (Verdict, u64) {
    // The bits of numbers from 0 on are in their order; one that is not a number is the largest.
    (of.verdict, of.largest.unwrap_or_default().abs().to_bits())
}

impl OfPoint {
    fn new(at: &Point, of: &FaceOffOutcome) -> Self {
        let pairs = of.fields.iter().flat_map(|f| &f.pairs);
        let pairs = pairs.filter(|pair| pair.judged);
        let fields = pairs.map(|pair| pair.compared.field.max_rel);
        let rows = of.numbers.iter().flat_map(|number| &number.rows);
        let rows = rows.filter(|row| row.judged && row.values.len() > 1);
        let numbers = rows.map(|row| {
            let of = |fold: fn(f64, f64) -> f64| row.values.values().copied().reduce(fold);
            let (Some(low), Some(high)) = (of(f64::min), of(f64::max)) else {
                return 0.0;
            };
            let scale = low.abs().max(high.abs());
            if scale > 0.0 {
                (high - low) / scale
            } else {
                0.0
            }
        });
        let known = of.fields.iter().flat_map(|f| &f.orders);
        let known = known.filter(|order| order.found.against == "exact");
        let finest = known.filter_map(|order| order.found.levels.last()?.norms);
        let relative = finest.map(|norms| {
            let h1 = norms.h1.zip(norms.h1_scale);
            [
                Some(norms.l2 / norms.l2_scale),
                h1.map(|(error, scale)| error / scale),
            ]
        });
        // One that is not a number is the largest.
        let larger = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) if b.is_nan() || b > a => Some(b),
            (a, b) => a.or(b),
        };
        OfPoint {
            at: at.clone(),
            verdict: of.verdict,
            errors: relative.reduce(|[a, b], [c, d]| [larger(a, c), larger(b, d)]),
            wrong: wrong(of),
            largest: fields
                .chain(numbers)
                .filter(|x| x.is_finite())
                .reduce(f64::max),
        }
    }
}

/// What does not pass, by name.
fn wrong(of: &FaceOffOutcome) -> BTreeSet<String> {
    let runs = of.runs.iter().filter(|run| run.failure.is_some());
    let runs = runs.map(|run| format!("run of {}", run.code));
    let fields = of.fields.iter().map(|f| (f.verdict, f.field.clone()));
    let numbers = of.numbers.iter().map(|n| (n.verdict, n.number.clone()));
    let spectra = of.spectra.iter().map(|s| (s.verdict, s.spectrum.clone()));
    let systems = of.systems.iter();
    let systems = systems.map(|s| (s.verdict, format!("systems of {} – {}", s.a, s.b)));
    let judged = fields.chain(numbers).chain(spectra).chain(systems);
    let judged = judged.filter(|(verdict, _)| !verdict.passes());
    runs.chain(judged.map(|(_, name)| name)).collect()
}

/// The simplest point at which the face-off fails in the same way: the verdict stays, and something that was wrong still is.
fn simplest(
    of: &FaceOff,
    sweep: &Sweep,
    how: &Running,
    (from, outcome): (&Point, FaceOffOutcome),
    tried: &mut usize,
) -> Result<(Point, FaceOffOutcome)> {
    let (verdict, names) = (outcome.verdict, wrong(&outcome));
    let (mut at, mut outcome) = (from.clone(), outcome);
    // The mesh first, so that what follows is cheap.
    let mut axes: Vec<&str> = sweep.names.iter().map(String::as_str).collect();
    if !axes.contains(&N) {
        axes.push(N);
    }
    axes.sort_by_key(|name| *name != N);
    for name in axes {
        for value in simpler(of, sweep, &at, name) {
            if *tried == TRIES {
                return Ok((at, outcome));
            }
            cancel::check()?;
            let mut point = at.clone();
            point.insert(name.to_owned(), value);
            // What the file could not have is not simpler.
            let Ok(there) = of.at(&point) else { continue };
            *tried += 1;
            let found = face_off(&there, how, &crate::engine::Silent)?;
            if found.verdict == verdict && !wrong(&found).is_disjoint(&names) {
                (at, outcome) = (point, found);
                break;
            }
        }
    }
    Ok((at, outcome))
}

const N: &str = "n";

/// Simpler values to try instead of one of a point, the simplest first.
fn simpler(of: &FaceOff, sweep: &Sweep, at: &Point, name: &str) -> Vec<String> {
    if name == N {
        // Where codes share the problem only, coarser meshes differ by their errors, which is another failure.
        let kinds = of.fields.iter().chain(&of.numbers).map(|asked| asked.same);
        let kinds = kinds.chain(of.spectra.iter().map(|asked| asked.same));
        if kinds.clone().any(|same| same == Same::Problem) {
            return Vec::new();
        }
        let here = of.at(at).map(|here| here.levels()).unwrap_or_default();
        let most = here.iter().filter_map(|level| level.n).max().unwrap_or(1);
        let is_one = here.len() <= 1;
        let smaller = (0..)
            .map(|k| 1 << k)
            .take_while(|n| *n < most || *n == most && !is_one);
        return smaller.map(|n: usize| n.to_string()).collect();
    }
    let Some(now) = at.get(name) else {
        return Vec::new();
    };
    let all = sweep.points.iter().filter_map(|point| point.get(name));
    // What the file has where nothing is swept shows whether the parameter matters.
    let base = of.parameters.get(name).into_iter().cloned();
    let round = now
        .parse::<f64>()
        .ok()
        .filter(|now| now.is_finite())
        .map(|now| {
            let values = all.clone().filter_map(|value| value.parse::<f64>().ok());
            let ends = values.fold([now; 2], |[low, high], x| [low.min(x), high.max(x)]);
            let is_inside = move |x: &f64| (ends[0]..=ends[1]).contains(x);
            let digits = (1..=DIGITS).map(move |digits| rounded(now, digits));
            let whole = [0.0, 1.0].into_iter().chain(digits).filter(is_inside);
            whole.map(|x| x.to_string()).collect::<Vec<String>>()
        });
    let mut seen = BTreeSet::from([now.clone()]);
    let is_same = |value: &String| {
        value.parse::<f64>().ok() == now.parse::<f64>().ok() && value.parse::<f64>().is_ok()
    };
    let mut values: Vec<String> = base.chain(round.into_iter().flatten()).collect();
    values.retain(|value| !is_same(value) && seen.insert(value.clone()));
    values
}
