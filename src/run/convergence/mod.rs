//! Convergence: errors on finer and finer levels, their order, and their limit. The errors of any code's results are with respect to a formula,
//! a reference, or the next level.

mod fit;
mod limit;
mod limiting;
mod meeting;

use serde::Serialize;

pub use fit::{Fit, Observed, Order, check_meshes};
pub use limit::{Found, Limit};
pub use limiting::Limiting;
pub use meeting::{Course, Meeting};

use faceoff_fem::scene::Expression;
use faceoff_judge::{Intersection, MatchBy, Norms, Settings, Size, compare_results, error_against};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::mesh::CellKind;

/// An observed order may be this much lower than that of theory.
pub const LOWER: f64 = 0.25;

/// The reference of the errors.
pub enum Against {
    /// A formula for each component.
    Exact(Vec<Expression>),
    /// The result on a finer mesh, or of a better method.
    Reference(Box<Results>),
    /// ‖u_k - u_{k+1}‖, which falls with the order of the error if meshes are refined by a constant factor.
    Next,
}

/// The orders of one field.
#[derive(Debug, Serialize)]
pub struct Convergence {
    /// The name of the field.
    pub field: String,
    /// `exact`, `reference`, `next`, or the other code.
    pub against: &'static str,
    /// The coarsest first; with `next`, the finest has no error.
    pub levels: Vec<Level>,
    /// For the L² norm of the error.
    pub l2: Order,
    /// For the broken seminorm; `None` if a field is constant on each cell.
    pub h1: Option<Order>,
    /// Why an order is below the theoretical one, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limiting: Option<Limiting>,
}

/// One result.
#[derive(Debug, Clone, Serialize)]
pub struct Level {
    /// The path of its file.
    pub file: String,
    /// The number of cells of the highest dimension.
    pub cells: usize,
    /// (measure / cells)^(1/d)
    pub h: f64,
    /// The measure of all cells.
    #[serde(skip)]
    pub measure: f64,
    /// The norms of the error; `None` for the finest with `next`.
    #[serde(flatten)]
    pub norms: Option<Norms>,
    /// The part of either mesh that the other does not cover, if two are compared.
    pub alone: Option<[f64; 2]>,
}

impl Convergence {
    /// The limit of the norms on all levels.
    pub fn new(field: &str, against: &'static str, levels: Vec<Level>) -> Self {
        let order = |pick: fn(&Norms) -> Option<f64>| {
            let errors = levels.iter();
            let errors = errors.filter_map(|of| Some((of.h, pick(of.norms.as_ref()?)?)));
            Order::new(&errors.collect::<Vec<_>>())
        };
        let h1 = order(|norms| norms.h1);
        Convergence {
            field: field.to_owned(),
            against,
            l2: order(|norms| Some(norms.l2)),
            h1: levels
                .iter()
                .any(|of| of.norms.is_some_and(|norms| norms.h1.is_some()))
                .then_some(h1),
            limiting: None,
            levels,
        }
    }
}

impl Convergence {
    /// Is an order on the finest levels below the theoretical one?
    fn is_below(&self, theory: [f64; 2]) -> bool {
        let orders = [Some(&self.l2), self.h1.as_ref()];
        let last = orders.map(|order| order.and_then(|order| order.steps.last().copied()));
        let mut both = last.into_iter().zip(theory);
        both.any(|(order, theory)| order.is_some_and(|order| order < theory - LOWER))
    }
}

/// A message about the first level that is not finer than the one before, by these sizes.
pub fn not_finer(levels: &[Level], sizes: &[f64]) -> Option<String> {
    let k = sizes.windows(2).position(|pair| !(pair[0] > pair[1]))?;
    let [of, than] = [&levels[k + 1], &levels[k]];
    Some(format!(
        "{} with {} cells is not finer than {} with {}",
        of.file, of.cells, than.file, than.cells
    ))
}

/// The orders of the fields that all results have, or of those named; results from the coarsest to the finest.
///
/// # Errors
/// Fewer than two errors, meshes that do not become finer, a field that a result lacks, errors of [`compare_results`].
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
    let bare = |result: &Results| {
        let Size { cells, h, measure } = Size::of(result)?;
        let file = result.source.clone();
        Ok(Level {
            file,
            cells,
            h,
            measure,
            norms: None,
            alone: None,
        })
    };
    let levels = results.iter().map(bare).collect::<Result<Vec<_>>>()?;
    let sizes: Vec<f64> = levels.iter().map(|level| level.h).collect();
    if let Some(what) = not_finer(&levels, &sizes) {
        let remedy = "give the results from the coarsest to the finest";
        return Err(Error::usage(what, remedy));
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
        found.push(of_field(results, &levels, name, against, &share)?);
    }
    Ok(found)
}

fn of_field(
    results: &[Results],
    bare: &[Level],
    name: &str,
    against: &Against,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Convergence> {
    let mut levels = Vec::with_capacity(results.len());
    for (k, (result, bare)) in results.iter().zip(bare).enumerate() {
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
            norms,
            alone,
            ..bare.clone()
        });
    }
    let of_exact = match against {
        Against::Exact(u) => Some(u),
        _ => None,
    };
    let against = match against {
        Against::Exact(_) => "exact",
        Against::Reference(_) => "reference",
        Against::Next => "next",
    };
    let mut found = Convergence::new(name, against, levels);
    if let (Some(u), Some(finest)) = (of_exact, results.last()) {
        let value = |x: [f64; 3], component: usize| u[component].with_gradient(x).0;
        let theory = theory(finest, name);
        if theory.is_some_and(|theory| found.is_below(theory)) {
            let theory = theory.unwrap_or_default().map(Some);
            found.limiting = Limiting::of(theory, &found, finest, u.len(), &value);
        }
    }
    Ok(found)
}

/// The orders in L² and H¹ for functions of the degree of the cells; `None` for fields that are not on points.
fn theory(of: &Results, name: &str) -> Option<[f64; 2]> {
    of.on_points.iter().find(|field| field.name == name)?;
    let order = |kind: &CellKind| kind.order().map(|order| order as f64);
    let degree = of.kinds.iter().filter(|(kind, _)| kind.dim() > 1);
    let degree = degree
        .filter_map(|(kind, _)| order(kind))
        .reduce(f64::max)?;
    Some([degree + 1.0, degree])
}

/// ‖a - b‖ of one field over the intersection of two meshes.
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
