//! Observed orders of any code's results: against a formula, against a reference, or each against the next.

use serde::Serialize;

use crate::run::Fit;
use faceoff_fem::scene::Expression;
use faceoff_judge::{Intersection, MatchBy, Norms, Settings, Size, compare_results, error_against};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;

/// What errors are taken against.
pub enum Against {
    /// A formula for each component.
    Exact(Vec<Expression>),
    /// The result of a finer mesh, or of a better method.
    Reference(Box<Results>),
    /// ‖u_k - u_{k+1}‖, which falls with the order of the error where meshes are refined by one factor.
    Next,
}

/// The orders of one field.
#[derive(Debug, Serialize)]
pub struct Convergence {
    /// Its name.
    pub field: String,
    /// `exact`, `reference`, `next`, or the other code.
    pub against: &'static str,
    /// The coarsest first; against the next, the finest has no error.
    pub levels: Vec<Level>,
    /// Of the L² norm of the error.
    pub l2: Order,
    /// Of the broken seminorm; none where a field is constant on each cell.
    pub h1: Option<Order>,
}

/// One result.
#[derive(Debug, Serialize)]
pub struct Level {
    /// Where it was read.
    pub file: String,
    /// Those of the highest dimension.
    pub cells: usize,
    /// (measure / cells)^(1/d)
    pub h: f64,
    /// Of the error; none of the finest against the next.
    #[serde(flatten)]
    pub norms: Option<Norms>,
    /// The part of either mesh that the other does not cover, where two are compared.
    pub alone: Option<[f64; 2]>,
}

/// An order of convergence in h.
#[derive(Debug, Serialize)]
pub struct Order {
    /// Between each mesh and the next.
    pub steps: Vec<f64>,
    /// By least squares over all meshes.
    pub fit: Option<Fit>,
    /// The interval that holds the order with 95 % confidence, if the errors scatter about a power of h independently; none of
    /// fewer than three.
    pub interval: Option<[f64; 2]>,
}

/// Student's t at 97.5 %, for 1, 2, … degrees of freedom; beyond, that of the last is more than enough.
const STUDENT: [f64; 10] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
];

impl Order {
    /// Of errors at falling h.
    pub fn new(errors: &[(f64, f64)]) -> Self {
        let step =
            |pair: &[(f64, f64)]| (pair[0].1 / pair[1].1).ln() / (pair[0].0 / pair[1].0).ln();
        let fit = Fit::new(errors);
        let interval = fit.and_then(|fit| {
            let spread = fit.spread?;
            // Of three points and more, since there is a spread.
            let room = STUDENT[fit.points.saturating_sub(3).min(STUDENT.len() - 1)] * spread;
            Some([fit.exponent - room, fit.exponent + room])
        });
        Order {
            steps: errors.windows(2).map(step).collect(),
            fit,
            interval,
        }
    }
}

/// The orders of the fields that all results have, or of those named; results from the coarsest to the finest.
///
/// # Errors
/// Fewer than two errors, meshes that do not become finer, a field that one lacks, what [`compare_results`] refuses.
pub fn convergence(
    results: &[Results],
    names: &[String],
    against: &Against,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Convergence>> {
    let least = if matches!(against, Against::Next) {
        3
    } else {
        2
    };
    if results.len() < least {
        let what = format!("{} results have no observed order", results.len());
        let remedy = "give at least three, or two with --reference or --exact; from the coarsest to the finest";
        return Err(Error::usage(what, remedy));
    }
    let sizes = results
        .iter()
        .map(Size::of)
        .collect::<Result<Vec<Size>>>()?;
    if let Some(k) = sizes.windows(2).position(|pair| !(pair[0].h > pair[1].h)) {
        let what = format!(
            "{} with {} cells is not finer than {} with {}",
            results[k + 1].source,
            sizes[k + 1].cells,
            results[k].source,
            sizes[k].cells
        );
        return Err(Error::usage(
            what,
            "give the results from the coarsest to the finest",
        ));
    }
    let others = match against {
        Against::Reference(reference) => Some(&**reference),
        _ => None,
    };
    let shared = |name: &&str| results.iter().chain(others).all(|side| side.has(name));
    let is_function = |f: &&faceoff_mesh::field::ResultField| f.rest.is_none();
    let all: Vec<&str> = match names {
        [] => {
            let of = &results[0];
            let fields = of
                .on_points
                .iter()
                .chain(&of.on_cells)
                .chain(&of.on_corners);
            fields
                .filter(is_function)
                .map(|f| f.name.as_str())
                .filter(shared)
                .collect()
        }
        named => named.iter().map(String::as_str).collect(),
    };
    if all.is_empty() || matches!(against, Against::Exact(_)) && all.len() > 1 {
        let what = match all.len() {
            0 => "there is no field that all results have".to_owned(),
            many => format!("there are {many} fields, and the formula is of one"),
        };
        return Err(Error::usage(what, "name one by --only"));
    }
    let mut found = Vec::with_capacity(all.len());
    for (k, name) in all.iter().enumerate() {
        let share = |part: f64| progress((k as f64 + part) / all.len() as f64);
        found.push(of_field(results, &sizes, name, against, &share)?);
    }
    Ok(found)
}

fn of_field(
    results: &[Results],
    sizes: &[Size],
    name: &str,
    against: &Against,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Convergence> {
    let mut levels = Vec::with_capacity(results.len());
    for (k, (result, size)) in results.iter().zip(sizes).enumerate() {
        cancel::check()?;
        let share = |part: f64| progress((k as f64 + part) / results.len() as f64);
        let other = match against {
            Against::Exact(_) => None,
            Against::Reference(reference) => Some(&**reference),
            Against::Next => results.get(k + 1),
        };
        let (norms, alone) = match (against, other) {
            (Against::Exact(u), _) => {
                let exact = |x: [f64; 3], component: usize| u[component].with_gradient(x);
                (Some(error_against(result, name, u.len(), &exact)?), None)
            }
            (_, Some(other)) => {
                let (norms, met) = difference(result, other, name, &share)?;
                let part = |k: usize| met.alone[k] / met.measures[k];
                (Some(norms), Some([part(0), part(1)]))
            }
            _ => (None, None),
        };
        levels.push(Level {
            file: result.source.clone(),
            cells: size.cells,
            h: size.h,
            norms,
            alone,
        });
    }
    let order = |pick: fn(&Norms) -> Option<f64>| {
        let errors = levels
            .iter()
            .filter_map(|of| Some((of.h, pick(of.norms.as_ref()?)?)));
        let errors: Vec<(f64, f64)> = errors.collect();
        (!errors.is_empty()).then(|| Order::new(&errors))
    };
    let (l2, h1) = (order(|n| Some(n.l2)), order(|n| n.h1));
    Ok(Convergence {
        field: name.to_owned(),
        against: match against {
            Against::Exact(_) => "exact",
            Against::Reference(_) => "reference",
            Against::Next => "next",
        },
        l2: l2.unwrap_or_else(|| Order::new(&[])),
        h1,
        levels,
    })
}

/// ‖a - b‖ of one field over what two meshes have in common.
fn difference(
    a: &Results,
    b: &Results,
    name: &str,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Norms, Intersection)> {
    let only = |side: &Results| {
        let mut side = side.clone();
        side.keep_only(|known| known == name);
        side
    };
    let (a, b) = (only(a), only(b));
    let settings = Settings {
        map: Some(MatchBy::Functions),
        progress: Some(progress),
        ..Settings::default()
    };
    let compared = compare_results(&a, &b, &settings)?;
    let field = compared
        .fields
        .iter()
        .find(|f| f.norms.is_some() || f.field.reason.is_some());
    let norms = field
        .and_then(|f| f.norms)
        .filter(|norms| norms.l2.is_finite());
    norms
        .zip(compared.intersection)
        .ok_or_else(|| Error::Compare {
            a: a.source.clone(),
            b: b.source.clone(),
            what: match field.and_then(|f| f.field.reason.clone()) {
                Some(reason) => format!("`{name}`: {reason}"),
                None => format!("`{name}` has no norm"),
            },
            remedy: "name a field of floats that all have, by --only".into(),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_and_their_intervals() {
        let of = |errors: [f64; 4]| {
            let h = [0.5, 0.25, 0.125, 0.0625];
            Order::new(&[0, 1, 2, 3].map(|k| (h[k], errors[k])))
        };
        let exact = of([4.0, 1.0, 0.25, 0.0625]);
        assert_eq!(exact.steps, [2.0; 3]);
        let [low, high] = exact.interval.unwrap();
        assert!(low <= 2.0 && high >= 2.0 && high - low < 1e-12);
        // ln e = (0, -1, -1, -2) ln 2 over ln h = (0, -1, -2, -3) ln 2: slope 0.6, squares left 0.2 over 2 · 5.
        let scattered = of([1.0, 0.5, 0.5, 0.25]);
        let [low, high] = scattered.interval.unwrap();
        let room = 4.303 * (0.2_f64 / 2.0 / 5.0).sqrt();
        assert!((low - (0.6 - room)).abs() < 1e-12 && (high - (0.6 + room)).abs() < 1e-12);
        assert!(Order::new(&[(0.5, 1.0), (0.25, 0.5)]).interval.is_none());
    }
}
