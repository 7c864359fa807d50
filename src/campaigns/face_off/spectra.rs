//! A spectrum of all codes: eigenvalues as multisets, modes as subspaces.

use serde::Serialize;

use super::fields::{Side, extract, file_of, side};
use super::times::short;
use super::{OfResidual, Player, Rung, eigen, pairs};
use crate::run::{Asked, FaceOff, Judged, Label, Same, Spectrum};
use faceoff_judge::{Modes, Verdict, clusters, match_spectra, relative};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;

/// A spectrum of all codes.
#[derive(Debug, Serialize)]
pub struct OfSpectrum {
    /// Its name.
    pub spectrum: String,
    /// What the codes share.
    pub same: Same,
    /// The worst of the rows that are judged.
    pub verdict: Verdict,
    /// Every two codes on every level.
    pub pairs: Vec<OfSpectra>,
    /// Each code on the finest level against the values that are known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub exact: Vec<OfSpectra>,
    /// Of an eigenproblem of a form: how well each code solves it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub residuals: Vec<OfResidual>,
}

/// Two spectra, or that of a code and the one that is known, which is the second.
#[derive(Debug, Serialize)]
pub struct OfSpectra {
    /// The first code.
    pub a: String,
    /// The second, or `exact`.
    pub b: String,
    /// The refinement.
    pub n: Option<usize>,
    /// As in the runs.
    pub level: Label,
    /// Coarser levels of one problem are reported and not judged.
    pub judged: bool,
    /// Of values and modes together.
    pub verdict: Verdict,
    /// What is wrong, or why there is no verdict; else empty.
    pub reason: String,
    /// What was allowed between eigenvalues, relative to the larger; infinite where nothing was.
    pub tolerance: f64,
    /// The largest difference of two eigenvalues that are the same one, relative to the larger.
    pub relative: f64,
    /// The values of a and of b that are the same ones.
    pub values: Vec<[f64; 2]>,
    /// What only a has, and only b, below where the other ends.
    pub alone: [Vec<f64>; 2],
    /// What only a has, and only b, above the last of the other.
    #[serde(skip_serializing_if = "is_nothing")]
    pub beyond: [Vec<f64>; 2],
    /// How many were left out as the kernel's.
    pub kernel: [usize; 2],
    /// Modes that belong together, as spaces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spaces: Vec<Space>,
    /// The modal assurance criterion, one row for each mode of a; kernels are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub assurance: Vec<Vec<f64>>,
}

fn is_nothing(lists: &[Vec<f64>; 2]) -> bool {
    lists.iter().all(Vec::is_empty)
}

/// Modes of neighbouring eigenvalues.
#[derive(Debug, Serialize)]
pub struct Space {
    /// The lowest and the highest value of a.
    pub values: [f64; 2],
    /// How many modes it has.
    pub dimension: usize,
    /// The sine of the largest principal angle; none where modes are not independent.
    pub sine: Option<f64>,
    /// Whether the space may go on beyond the last value that a code has, so that there is no verdict.
    pub is_cut: bool,
    /// Of this space.
    pub verdict: Verdict,
}

/// What a code has: values ascending without the kernel, with the modes that go with them.
struct Found {
    values: Vec<f64>,
    modes: Vec<Results>,
    kernel: usize,
    /// Whether the code has further values, which were not asked for and belong to none of these, below the lowest and above the highest; below,
    /// also whether it cannot have any.
    goes_on: [bool; 2],
}

/// Every pair on every level, and each code on the finest against what is known.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn judge(
    of: &FaceOff,
    players: &[Player],
    asked: &Spectrum,
    rungs: &[Rung],
) -> Result<OfSpectrum> {
    let (mut of_pairs, mut of_exact) = (Vec::new(), Vec::new());
    for (k, rung) in rungs.iter().enumerate() {
        let is_finest = k + 1 == rungs.len();
        let judged = asked.same == Same::Discretisation || is_finest && asked.rtol.is_finite();
        let sides: Vec<Option<Side>> = (0..players.len()).map(|k| side(players, rung, k)).collect();
        let found: Vec<Option<Result<Found, String>>> = sides
            .iter()
            .map(|side| side.as_ref().map(|side| found(asked, side)))
            .collect();
        let empty = |a: &str, b: &str, judged: bool| OfSpectra {
            a: a.to_owned(),
            b: b.to_owned(),
            n: rung.level.n,
            level: rung.level.label.clone(),
            judged,
            verdict: Verdict::Undetermined,
            reason: String::new(),
            tolerance: asked.rtol,
            relative: 0.0,
            values: Vec::new(),
            alone: [Vec::new(), Vec::new()],
            beyond: [Vec::new(), Vec::new()],
            kernel: [0, 0],
            spaces: Vec::new(),
            assurance: Vec::new(),
        };
        for (i, j) in pairs(players) {
            let (Some(a), Some(b)) = (&found[i], &found[j]) else {
                continue;
            };
            let row = empty(&players[i].name, &players[j].name, judged);
            of_pairs.push(match (a, b) {
                (Ok(a), Ok(b)) => compared(asked, a, b, row)?,
                (Err(reason), _) | (_, Err(reason)) => OfSpectra {
                    judged: true,
                    reason: reason.clone(),
                    ..row
                },
            });
        }
        let known = asked.exact_rtol.filter(|_| is_finest);
        let Some(rtol) = known else { continue };
        for (found, player) in found.iter().zip(players) {
            let Some(Ok(found)) = found else { continue };
            let row = OfSpectra {
                tolerance: rtol,
                ..empty(&player.name, "exact", true)
            };
            of_exact.push(of_values(asked, &found.values, &asked.exact, row));
        }
    }
    let residuals = eigen::judge(of, asked, players, rungs)?;
    let rows = of_pairs.iter().chain(&of_exact).filter(|row| row.judged);
    let verdicts = rows.map(|row| row.verdict);
    let verdicts = verdicts.chain(residuals.iter().map(|row| row.verdict));
    Ok(OfSpectrum {
        spectrum: asked.name.clone(),
        same: asked.same,
        verdict: Verdict::of_all(verdicts),
        pairs: of_pairs,
        exact: of_exact,
        residuals,
    })
}

/// Values and modes of a code, by the numbers behind their names.
fn found(asked: &Spectrum, side: &Side) -> Result<Found, String> {
    let (values, modes) = asked.names_in(side.code);
    let numbers = side.left.numbers.iter();
    let numbers = numbers.filter_map(|(name, value)| {
        let number: usize = name.strip_prefix(values)?.parse().ok()?;
        Some((*value, number))
    });
    let mut numbers: Vec<(f64, usize)> = numbers.collect();
    if numbers.is_empty() {
        return Err(format!(
            "{} has no numbers `{values}1`, `{values}2`, …",
            side.name
        ));
    }
    if let Some((value, number)) = numbers.iter().find(|(value, _)| !value.is_finite()) {
        return Err(format!("{} has {value} as `{values}{number}`", side.name));
    }
    numbers.sort_by(|(x, _), (y, _)| x.total_cmp(y));
    let largest = numbers
        .iter()
        .map(|(value, _)| value.abs())
        .fold(0.0, f64::max);
    let all = numbers.len();
    numbers.retain(|(value, _)| asked.kernel.is_none_or(|part| value.abs() > part * largest));
    let kernel = all - numbers.len();
    // Those that are asked for, with the rest of the clusters that the last of them are in.
    let values: Vec<f64> = numbers.iter().map(|(value, _)| *value).collect();
    let asked_for = nearest(&values, asked);
    let runs = clusters(&values, asked.cluster);
    let kept = runs
        .iter()
        .filter(|run| (*run).clone().any(|k| asked_for.contains(&k)));
    let kept = kept.fold(asked_for.clone(), |all, run| {
        all.start.min(run.start)..all.end.max(run.end)
    });
    let goes_on = [
        kept.start > 0
            || asked
                .near
                .is_none_or(|near| values.first().is_some_and(|low| *low >= near)),
        kept.end < values.len(),
    ];
    numbers = numbers.drain(kept).collect();
    let mut of_modes = Vec::new();
    for (_, number) in modes.iter().flat_map(|_| &numbers) {
        let number = number.to_string();
        let name = match modes.unwrap_or_default() {
            pattern if pattern.contains('*') => pattern.replace('*', &number),
            start => start.to_owned() + &number,
        };
        let mode = Asked::of_mode(&name);
        let file = file_of(side.left, &mode, side.code)?;
        of_modes.push(extract(file, file.times.len() - 1, &mode, side.code)?);
    }
    Ok(Found {
        values: numbers.into_iter().map(|(value, _)| value).collect(),
        modes: of_modes,
        kernel,
        goes_on,
    })
}

/// The positions of the values that are asked for, which are a run: the lowest, or those nearest to a number; all where no count is.
fn nearest(values: &[f64], asked: &Spectrum) -> std::ops::Range<usize> {
    let count = asked.count.unwrap_or(values.len()).min(values.len());
    let Some(near) = asked.near else {
        return 0..count;
    };
    let mut run = 0..values.len();
    while run.len() > count {
        match near - values[run.start] > values[run.end - 1] - near {
            true => run.start += 1,
            false => run.end -= 1,
        }
    }
    run
}

impl Asked {
    /// A mode, which is taken as it is.
    fn of_mode(name: &str) -> Self {
        Asked {
            name: name.to_owned(),
            names: std::collections::BTreeMap::default(),
            same: Same::Discretisation,
            rtol: 0.0,
            atol: 0.0,
            on: None,
            components: None,
            exact: Vec::new(),
            exact_rtol: None,
            orders: [None; 2],
            uncovered: None,
            times: Judged::Last,
            up_to: Vec::new(),
            value: Vec::new(),
            is_number: false,
        }
    }
}

/// Two lists of eigenvalues.
fn of_values(asked: &Spectrum, a: &[f64], b: &[f64], row: OfSpectra) -> OfSpectra {
    let matched = match_spectra(a, b, row.tolerance);
    let values: Vec<[f64; 2]> = matched.pairs.iter().map(|[i, j]| [a[*i], b[*j]]).collect();
    let far = |[x, y]: &[f64; 2]| relative(*x, *y);
    let worst = values.iter().max_by(|p, q| far(p).total_cmp(&far(q)));
    let largest = worst.map_or(0.0, far);
    let [of_a, of_b] = &matched.alone;
    let alone = [
        of_a.iter().map(|k| a[*k]).collect::<Vec<f64>>(),
        of_b.iter().map(|k| b[*k]).collect(),
    ];
    let mut told = Vec::new();
    let is_exact = row.b == "exact";
    for (list, has, lacks) in [(&alone[0], &row.a, &row.b), (&alone[1], &row.b, &row.a)] {
        let words: Vec<String> = list.iter().map(|x| short(*x).to_string()).collect();
        let words = words.join(", ");
        match (list.is_empty(), is_exact, *has == row.a) {
            (true, ..) => {}
            (_, true, true) => told.push(format!("{has} has the spurious {words}")),
            (_, true, false) => told.push(format!("{lacks} misses {words}")),
            (_, false, _) => told.push(format!("{has} has {words}, and {lacks} has not")),
        }
    }
    if let Some([x, y]) = worst.filter(|_| largest > row.tolerance) {
        told.push(format!(
            "{} of {} is {largest:.3e} of it away from {} of {}",
            short(*x),
            row.a,
            short(*y),
            row.b
        ));
    }
    let mut verdict = match told.is_empty() {
        true => Verdict::Agree,
        false => Verdict::Disagree,
    };
    // A list that is too short leaves values of the other unjudged.
    let beyond = [0, 1].map(|k| {
        let own = [a, b][k];
        matched.beyond[k]
            .iter()
            .map(|at| own[*at])
            .collect::<Vec<f64>>()
    });
    for (k, (name, list)) in [(&row.a, a), (&row.b, b)].into_iter().enumerate() {
        let lacks = &beyond[1 - k][within(list, &beyond[1 - k], asked.cluster)..];
        let count = asked.count.map(|count| match is_exact {
            true => count.min(b.len()),
            false => count,
        });
        match count {
            _ if name == "exact" => {}
            Some(count) if list.len() < count => {
                let own = list.len();
                told.push(format!(
                    "{name} has {own} of the lowest {count} eigenvalues"
                ));
                verdict = Verdict::Disagree;
            }
            None if !lacks.is_empty() => {
                let (own, more) = (list.len(), lacks.len());
                let other = [&row.b, &row.a][k];
                told.push(format!(
                    "the {own} of {name} end below {more} of {other}, which are not judged: let every code write as many, or give count"
                ));
                verdict = verdict.max(Verdict::Undetermined);
            }
            _ => {}
        }
    }
    if values.is_empty() {
        told.push("no eigenvalue is that of the other".into());
        verdict = verdict.max(Verdict::Undetermined);
    }
    OfSpectra {
        verdict,
        reason: told.join("; "),
        relative: largest,
        values,
        alone,
        beyond,
        ..row
    }
}

/// How many of the values beyond a list continue the cluster in which it ends.
fn within(list: &[f64], beyond: &[f64], cluster: f64) -> usize {
    let Some(last) = list.last() else { return 0 };
    let run: Vec<f64> = std::iter::once(last).chain(beyond).copied().collect();
    clusters(&run, cluster)[0].end - 1
}

/// Values and modes of two codes.
fn compared(asked: &Spectrum, a: &Found, b: &Found, row: OfSpectra) -> Result<OfSpectra> {
    let mut row = of_values(asked, &a.values, &b.values, row);
    row.kernel = [a.kernel, b.kernel];
    if asked.modes.is_none() || row.values.is_empty() {
        return Ok(row);
    }
    let failed = |mut row: OfSpectra, error: Error| match error {
        Error::Ended(cause) => Err(Error::Ended(cause)),
        error => {
            row.verdict = row.verdict.max(Verdict::Undetermined);
            row.judged = true;
            row.reason = [row.reason, error.to_string()]
                .join("; ")
                .trim_matches([';', ' '])
                .to_owned();
            Ok(row)
        }
    };
    let modes = match Modes::new(&a.modes, &b.modes) {
        Ok(modes) => modes,
        Err(error) => return failed(row, error),
    };
    row.assurance = modes.assurance();
    let pairs = match_spectra(&a.values, &b.values, asked.rtol).pairs;
    let of_a: Vec<f64> = pairs.iter().map(|[i, _]| a.values[*i]).collect();
    let runs = clusters(&of_a, asked.cluster);
    let spaces: Vec<[Vec<usize>; 2]> = runs
        .iter()
        .map(|run| [0, 1].map(|k| pairs[run.clone()].iter().map(|pair| pair[k]).collect()))
        .collect();
    let sines = match modes.sines(&spaces) {
        Ok(sines) => sines,
        Err(error) => return failed(row, error),
    };
    // A space at the end of a list may have further modes, which the code was not asked for.
    let ends = [a, b].map(|of| {
        let [low, high] = of.goes_on.map(|goes_on| !goes_on);
        [low.then_some(0), high.then_some(of.values.len() - 1)]
    });
    let mut told = Vec::new();
    for ((run, space), sine) in runs.iter().zip(&spaces).zip(sines) {
        let is_cut = (0..2).any(|k| ends[k].iter().flatten().any(|end| space[k].contains(end)));
        let allowed = asked.angle.unwrap_or(f64::INFINITY);
        let is_far = sine.is_none_or(|sine| !(sine <= allowed));
        let [low, high] = [of_a[run.start], of_a[run.end - 1]];
        let verdict = match (is_far, is_cut, sine) {
            (false, ..) => Verdict::Agree,
            (true, true, Some(_)) => Verdict::Undetermined,
            (true, ..) => Verdict::Disagree,
        };
        if is_far {
            let of = match run.len() {
                1 => format!("the mode of {}", short(low)),
                n => format!("the {n} modes of {} to {}", short(low), short(high)),
            };
            told.push(match (sine, is_cut) {
                (None, _) => format!("{of} are not independent in one of the codes"),
                (Some(sine), true) => format!("{of} are apart by an angle of sine {sine:.3e}, but the last ones of a code: there may be more of this value; ask for further modes"),
                (Some(sine), false) => format!("{of} are apart by an angle of sine {sine:.3e}"),
            });
        }
        row.verdict = row.verdict.max(verdict);
        row.spaces.push(Space {
            values: [low, high],
            dimension: run.len(),
            sine,
            is_cut,
            verdict,
        });
    }
    let before = (!row.reason.is_empty()).then(|| row.reason.clone());
    row.reason = before
        .into_iter()
        .chain(told)
        .collect::<Vec<_>>()
        .join("; ");
    Ok(row)
}
