//! Any problem: codes of one's own on one mesh or on their own, field by field and number by number.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;

use super::convergence::{Against, Convergence, Level, Order, convergence};
use crate::engine::{How, Left, Progress, Script};
use crate::run::{Asked, FaceOff, Same};
use faceoff_judge::{
    ComparedField, Comparison, FieldVerdict, MatchBy, Norms, On, Settings, Size, Tolerance,
    Tolerances, Verdict, compare_results,
};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;

/// An observed order may be so much lower than that of theory.
const LOWER: f64 = 0.25;

/// How codes are run.
#[derive(Debug, Clone)]
pub struct Running {
    pub keep: Option<PathBuf>,
    pub time_limit: Duration,
    pub sandbox: bool,
}

/// What a face-off found.
#[derive(Debug, Serialize)]
pub struct FaceOffOutcome {
    pub name: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    pub about: String,
    pub verdict: Verdict,
    pub runs: Vec<RunOf>,
    pub fields: Vec<OfField>,
    pub numbers: Vec<OfNumber>,
    /// The pair that is farthest from agreement, with the result of its first code.
    #[serde(skip)]
    pub shown: Option<(Comparison, Box<Results>)>,
}

/// One code on one mesh.
#[derive(Debug, Serialize)]
pub struct RunOf {
    pub code: String,
    pub n: Option<usize>,
    pub seconds: Option<f64>,
    /// Why there is no result.
    pub failure: Option<String>,
}

/// A field of all codes.
#[derive(Debug, Serialize)]
pub struct OfField {
    pub field: String,
    pub same: Same,
    pub verdict: Verdict,
    pub pairs: Vec<OfPair>,
    pub orders: Vec<OfOrder>,
}

/// Two codes on one level.
#[derive(Debug, Serialize)]
pub struct OfPair {
    pub a: String,
    pub b: String,
    pub n: Option<usize>,
    /// Coarser levels of one problem are told and not judged.
    pub judged: bool,
    #[serde(flatten)]
    pub compared: ComparedField,
}

/// Observed orders, of one code's error or of two codes' difference.
#[derive(Debug, Serialize)]
pub struct OfOrder {
    pub of: String,
    /// The refinements, coarsest first.
    pub n: Vec<Option<usize>>,
    pub theory: [Option<f64>; 2],
    /// None where theory is not asked.
    pub verdict: Option<Verdict>,
    #[serde(flatten)]
    pub found: Convergence,
}

/// A number of all codes.
#[derive(Debug, Serialize)]
pub struct OfNumber {
    pub number: String,
    pub verdict: Verdict,
    pub exact: Option<f64>,
    pub rows: Vec<RowOfNumber>,
}

/// A number on one level.
#[derive(Debug, Serialize)]
pub struct RowOfNumber {
    pub n: Option<usize>,
    pub values: BTreeMap<String, f64>,
    pub verdict: Verdict,
    pub reason: String,
}

/// What the codes left on one level; none of those that failed.
struct Rung {
    n: Option<usize>,
    left: Vec<Option<Left>>,
}

/// Runs every code on every level and judges what they answer. A code that fails does not keep the others from being judged.
///
/// # Errors
/// A mesh that cannot be made; [`Error::Ended`].
pub fn face_off(of: &FaceOff, how: &Running, progress: &dyn Progress) -> Result<FaceOffOutcome> {
    let levels = of.levels();
    let mut runs = Vec::new();
    let mut rungs = Vec::with_capacity(levels.len());
    let all = levels.len() * of.codes.len();
    for n in levels {
        let mesh = of.mesh(n)?;
        let mut left = Vec::with_capacity(of.codes.len());
        for code in &of.codes {
            let label = n.map_or_else(|| code.name.clone(), |n| format!("{}, n = {n}", code.name));
            progress.next(&label, runs.len() as f64 / all as f64);
            let found = run(of, code, mesh.as_ref(), n, how);
            let found = match found {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                other => other,
            };
            runs.push(RunOf {
                code: code.name.clone(),
                n,
                seconds: found.as_ref().ok().map(|left| left.seconds),
                failure: found.as_ref().err().map(Error::to_string),
            });
            left.push(found.ok());
        }
        rungs.push(Rung { n, left });
    }
    let mut shown = None;
    let fields = of
        .fields
        .iter()
        .map(|asked| field(of, asked, &rungs, &mut shown))
        .collect::<Result<Vec<_>>>()?;
    let numbers: Vec<OfNumber> = of
        .numbers
        .iter()
        .map(|asked| number(of, asked, &rungs))
        .collect();
    let verdicts = fields
        .iter()
        .map(|f| f.verdict)
        .chain(numbers.iter().map(|n| n.verdict));
    let failed = runs.iter().any(|run| run.failure.is_some());
    let verdicts = verdicts.chain(failed.then_some(Verdict::Undetermined));
    Ok(FaceOffOutcome {
        name: of.name.clone(),
        about: of.about.clone(),
        verdict: verdicts.max().unwrap_or(Verdict::Undetermined),
        runs,
        fields,
        numbers,
        shown: shown.map(|shown: Shown| (shown.comparison, shown.of_a)),
    })
}

fn run(
    of: &FaceOff,
    code: &Script,
    mesh: Option<&faceoff_mesh::Mesh>,
    n: Option<usize>,
    how: &Running,
) -> Result<Left> {
    let level = n.map_or(String::new(), |n| format!("-n{n}"));
    let how = How {
        keep: how.keep.clone(),
        kept: format!("{}-{}{level}", of.name, code.name),
        time_limit: how.time_limit,
        sandbox: how.sandbox,
    };
    code.run(mesh, n, &of.parameters, &how)
}

/// The pair that is shown.
struct Shown {
    factor: f64,
    comparison: Comparison,
    of_a: Box<Results>,
}

/// One field of a code, by the name that the file has for it.
fn extract(left: &Left, asked: &Asked, code: &str) -> Result<Results, String> {
    let name = asked.name_in(code);
    for of in &left.results {
        let mut of = of.clone();
        if !of.has(name) && !of.derive(name) {
            continue;
        }
        of.keep_only(|known| known == name);
        of.rename(name, &asked.name);
        let fields = [
            (On::Points, &of.on_points),
            (On::Cells, &of.on_cells),
            (On::Corners, &of.on_corners),
        ];
        for (on, field) in fields
            .into_iter()
            .flat_map(|(on, all)| all.iter().map(move |f| (on, f)))
        {
            if asked.on.is_some_and(|asked| asked != on) {
                return Err(format!(
                    "`{name}` of {code} is on {}",
                    format!("{on:?}").to_lowercase()
                ));
            }
            // Files have three components of a vector in the plane.
            let same = |n: usize| n == field.components || n == 2 && field.components == 3;
            if asked.components.is_some_and(|n| !same(n)) {
                return Err(format!(
                    "`{name}` of {code} has {} components",
                    field.components
                ));
            }
            if field.values.iter().any(|v| !v.is_finite()) {
                return Err(format!(
                    "`{name}` of {code} has a value that is not a finite number"
                ));
            }
        }
        return Ok(of);
    }
    let mut known: Vec<&str> = left
        .results
        .iter()
        .flat_map(Results::all)
        .map(|f| &*f.name)
        .collect();
    known.dedup();
    Err(format!(
        "{code} has no field `{name}`; it has {}",
        known.join(", ")
    ))
}

/// Each pair of codes, by their numbers.
fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
}

fn field(
    of: &FaceOff,
    asked: &Asked,
    rungs: &[Rung],
    shown: &mut Option<Shown>,
) -> Result<OfField> {
    // A level by a code.
    let found: Vec<Vec<Option<Result<Results, String>>>> = rungs
        .iter()
        .map(|rung| {
            let codes = rung.left.iter().zip(&of.codes);
            codes
                .map(|(left, code)| Some(extract(left.as_ref()?, asked, &code.name)))
                .collect()
        })
        .collect();
    let mut pairs_found = Vec::new();
    for (level, (rung, of_codes)) in rungs.iter().zip(&found).enumerate() {
        let judged = asked.same == Same::Discretisation
            || level + 1 == rungs.len() && asked.rtol.is_finite();
        for (a, b) in pairs(of.codes.len()) {
            cancel::check()?;
            let (Some(of_a), Some(of_b)) = (&of_codes[a], &of_codes[b]) else {
                continue;
            };
            let compared = match (of_a, of_b) {
                (Ok(of_a), Ok(of_b)) => compare(asked, of_a, of_b, judged, shown)?,
                (Err(reason), _) | (_, Err(reason)) => unjudged(asked, reason.clone()),
            };
            pairs_found.push(OfPair {
                a: of.codes[a].name.clone(),
                b: of.codes[b].name.clone(),
                n: rung.n,
                judged: judged || compared.field.reason.is_some(),
                compared,
            });
        }
    }
    let orders = if rungs.len() > 1 {
        orders(of, asked, &found, &pairs_found)?
    } else {
        Vec::new()
    };
    let of_pairs = pairs_found
        .iter()
        .filter(|p| p.judged)
        .map(|p| p.compared.field.verdict);
    let of_orders = orders.iter().filter_map(|o| o.verdict);
    Ok(OfField {
        field: asked.name.clone(),
        same: asked.same,
        verdict: of_pairs
            .chain(of_orders)
            .max()
            .unwrap_or(Verdict::Undetermined),
        pairs: pairs_found,
        orders,
    })
}

fn unjudged(asked: &Asked, reason: String) -> ComparedField {
    let rtol = if asked.rtol.is_finite() {
        asked.rtol
    } else {
        0.0
    };
    ComparedField {
        on: On::Functions,
        scale: None,
        rtol,
        atol: asked.atol,
        norms: None,
        single: false,
        field: FieldVerdict::failed(&asked.name, rtol, reason),
    }
}

/// Two answers on one level: equal to rounding, as functions where the files have other cells (a linear function on quadratic
/// ones is the same function), or by the norm of their difference.
fn compare(
    asked: &Asked,
    a: &Results,
    b: &Results,
    judged: bool,
    shown: &mut Option<Shown>,
) -> Result<ComparedField> {
    let is_same = asked.same == Same::Discretisation;
    let of_all = Tolerance {
        rtol: if asked.rtol.is_finite() {
            asked.rtol
        } else {
            0.0
        },
        atol: asked.atol,
    };
    let settings = Settings {
        tolerances: Tolerances {
            of_all,
            of_field: Vec::new(),
            is_given: true,
        },
        map: (!is_same).then_some(MatchBy::Functions),
        alone: asked.uncovered,
        ..Settings::default()
    };
    let comparison = match compare_results(a, b, &settings) {
        Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
        Err(error) => return Ok(unjudged(asked, error.to_string())),
        Ok(comparison) => comparison,
    };
    // What one mesh has alone comes as a field of its own, which counts.
    let domain = comparison
        .fields
        .iter()
        .find(|f| f.on == On::Domain && !f.field.verdict.passes());
    if let Some(domain) = domain {
        let reason = domain.field.reason.clone().unwrap_or_default();
        return Ok(unjudged(
            asked,
            format!("{reason}; allow a part by `uncovered`"),
        ));
    }
    let Some(found) = comparison
        .fields
        .iter()
        .position(|f| f.field.field == asked.name)
    else {
        return Ok(unjudged(asked, "it is not in the comparison".into()));
    };
    let mut found = comparison.fields[found].clone();
    if !is_same {
        let norms = found.norms.filter(|n| n.l2.is_finite() && n.l2_scale > 0.0);
        match norms {
            None => {
                return Ok(unjudged(
                    asked,
                    found
                        .field
                        .reason
                        .unwrap_or_else(|| "it has no norm".into()),
                ));
            }
            Some(Norms { l2, l2_scale, .. }) => {
                found.field.max_rel = l2 / l2_scale;
                found.field.verdict = match l2 <= (asked.rtol * l2_scale).max(asked.atol) {
                    true => Verdict::Agree,
                    false => Verdict::Disagree,
                };
            }
        }
    }
    let factor = found.factor();
    if judged && shown.as_ref().is_none_or(|shown| factor > shown.factor) {
        *shown = Some(Shown {
            factor,
            comparison,
            of_a: Box::new(a.clone()),
        });
    }
    Ok(found)
}

/// Of each code's error where the solution is known, else of the codes' differences.
fn orders(
    of: &FaceOff,
    asked: &Asked,
    found: &[Vec<Option<Result<Results, String>>>],
    pairs_found: &[OfPair],
) -> Result<Vec<OfOrder>> {
    let mut all = Vec::new();
    let series = |code: usize| -> Option<Vec<Results>> {
        let of_code = found
            .iter()
            .map(|level| level[code].as_ref()?.as_ref().ok().cloned());
        of_code.collect()
    };
    if !asked.exact.is_empty() {
        for (k, code) in of.codes.iter().enumerate() {
            let Some(results) = series(k) else { continue };
            let against = Against::Exact(asked.exact.clone());
            let names = std::slice::from_ref(&asked.name);
            for found in convergence(&results, names, &against, &|_| {})? {
                all.push(judged(asked, of, code.name.clone(), found));
            }
        }
    } else if asked.same == Same::Problem {
        for (a, b) in pairs(of.codes.len()) {
            let (Some(results), Some(_)) = (series(a), series(b)) else {
                continue;
            };
            let (name_a, name_b) = (&of.codes[a].name, &of.codes[b].name);
            let of_pair = pairs_found
                .iter()
                .filter(|p| p.a == *name_a && p.b == *name_b);
            let mut levels = Vec::new();
            for (result, pair) in results.iter().zip(of_pair) {
                let Size { cells, h, .. } = Size::of(result)?;
                levels.push(Level {
                    file: result.source.clone(),
                    cells,
                    h,
                    norms: pair.compared.norms,
                    alone: None,
                });
            }
            let order = |pick: fn(&Norms) -> Option<f64>| {
                let errors = levels
                    .iter()
                    .filter_map(|l| Some((l.h, pick(l.norms.as_ref()?)?)));
                let errors: Vec<(f64, f64)> = errors.collect();
                (!errors.is_empty()).then(|| Order::new(&errors))
            };
            let (l2, h1) = (order(|n| Some(n.l2)), order(|n| n.h1));
            let found = Convergence {
                field: asked.name.clone(),
                against: "code",
                l2: l2.unwrap_or_else(|| Order::new(&[])),
                h1,
                levels,
            };
            all.push(judged(asked, of, format!("{name_a} – {name_b}"), found));
        }
    }
    Ok(all)
}

/// An order lower than that of theory disagrees; a higher one is none's fault.
fn judged(asked: &Asked, file: &FaceOff, of: String, found: Convergence) -> OfOrder {
    let fit = |order: Option<&Order>| order.and_then(|o| o.fit).map(|fit| fit.exponent);
    let pairs = [fit(Some(&found.l2)), fit(found.h1.as_ref())];
    let asked_for = asked
        .orders
        .iter()
        .zip(pairs)
        .filter_map(|(theory, fit)| Some(((*theory)?, fit)));
    let verdicts = asked_for.map(|(theory, fit)| match fit {
        Some(fit) if fit >= theory - LOWER => Verdict::Agree,
        Some(_) => Verdict::Disagree,
        None => Verdict::Undetermined,
    });
    OfOrder {
        of,
        n: file.levels(),
        theory: asked.orders,
        verdict: verdicts.max(),
        found,
    }
}

fn number(of: &FaceOff, asked: &Asked, rungs: &[Rung]) -> OfNumber {
    let exact = asked.exact.first().map(|e| e.value([0.0; 3]));
    let mut rows = Vec::new();
    for (level, rung) in rungs.iter().enumerate() {
        let is_finest = level + 1 == rungs.len();
        let mut values = BTreeMap::new();
        let mut told: Vec<(Verdict, String)> = Vec::new();
        for (code, left) in of.codes.iter().zip(&rung.left) {
            let name = asked.name_in(&code.name);
            match left.as_ref().map(|left| left.numbers.get(name)) {
                None => {}
                Some(None) => told.push((
                    Verdict::Undetermined,
                    format!("{} has no number `{name}`", code.name),
                )),
                Some(Some(value)) if !value.is_finite() => {
                    told.push((Verdict::Undetermined, format!("{} has {value}", code.name)));
                }
                Some(Some(value)) => {
                    values.insert(code.name.clone(), *value);
                }
            }
        }
        let all: Vec<(&String, &f64)> = values.iter().collect();
        for (i, j) in pairs(all.len()) {
            let ((name_a, a), (name_b, b)) = (all[i], all[j]);
            let (far, scale) = ((a - b).abs(), a.abs().max(b.abs()));
            let is_judged =
                asked.same == Same::Discretisation || is_finest && asked.rtol.is_finite();
            if is_judged && far > (asked.rtol * scale).max(asked.atol) {
                told.push((
                    Verdict::Disagree,
                    format!("{name_a} – {name_b}: {:.3e} of it apart", far / scale),
                ));
            }
        }
        if let (Some(exact), Some(rtol), true) = (exact, asked.exact_rtol, is_finest) {
            for (name, value) in &values {
                let far = (value - exact).abs();
                if far > rtol * exact.abs() {
                    let far = far / exact.abs();
                    told.push((
                        Verdict::Disagree,
                        format!("{name} is {far:.3e} of it away from the exact {exact}"),
                    ));
                }
            }
        }
        let verdict = told.iter().map(|(verdict, _)| *verdict).max();
        let alone = if values.len() < 2 {
            Verdict::Undetermined
        } else {
            Verdict::Agree
        };
        rows.push(RowOfNumber {
            n: rung.n,
            values,
            verdict: verdict.unwrap_or(alone),
            reason: told
                .into_iter()
                .map(|(_, why)| why)
                .collect::<Vec<_>>()
                .join("; "),
        });
    }
    OfNumber {
        number: asked.name.clone(),
        verdict: rows
            .iter()
            .map(|row| row.verdict)
            .max()
            .unwrap_or(Verdict::Undetermined),
        exact,
        rows,
    }
}
