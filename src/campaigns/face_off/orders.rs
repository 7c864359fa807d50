//! Observed orders of a field, of each code's error or of two codes' difference.

use super::OfOrder;
use crate::run::convergence::{Convergence, Found, LOWER, Level as Step, Limit, Order, not_finer};
use crate::run::{Asked, Level};
use faceoff_judge::{Norms, Verdict};
use faceoff_mesh::error::{Error, Result};

/// Meshes whose sizes differ by less are one.
const ONE_MESH: f64 = 1e-9;

/// Of the errors of one code, or the differences of two, on every level, which come with the mesh size.
pub(super) fn orders(
    asked: &Asked,
    levels: &[&Level],
    of: String,
    against: &'static str,
    mut steps: Vec<Step>,
) -> Result<OfOrder> {
    let axis = axis(asked, levels, &mut steps)?;
    let found = Convergence::new(&asked.name, against, steps);
    Ok(judged(asked, levels, of, axis, found))
}

/// In what the order is: a parameter, the mesh size, or 1/n where codes take n for something else, as a number of steps on one
/// mesh. The steps get it as their size.
fn axis(asked: &Asked, levels: &[&Level], steps: &mut [Step]) -> Result<String> {
    let is_one_mesh = steps
        .windows(2)
        .all(|pair| (pair[0].h - pair[1].h).abs() <= ONE_MESH * pair[0].h);
    let along = levels.iter().map(|level| level.step.as_ref());
    let along = along.collect::<Option<Vec<_>>>();
    let (axis, sizes) = match along.as_deref() {
        Some(along @ [(name, _), ..]) if name != "1/n" || is_one_mesh => {
            (name.clone(), along.iter().map(|(_, size)| *size).collect())
        }
        _ => (
            "h".to_owned(),
            steps.iter().map(|step| step.h).collect::<Vec<f64>>(),
        ),
    };
    if let Some(what) = not_finer(steps, &sizes) {
        let remedy = "give refinements at which the mesh of the result becomes finer";
        return Err(Error::usage(format!("`{}`: {what}", asked.name), remedy));
    }
    for (step, size) in steps.iter_mut().zip(sizes) {
        step.h = size;
    }
    Ok(axis)
}

/// An order lower than that of theory disagrees; a higher one is none's fault.
fn judged(
    asked: &Asked,
    levels: &[&Level],
    of: String,
    axis: String,
    found: Convergence,
) -> OfOrder {
    let of_norm = |theory: Option<f64>, order: Option<&Order>| {
        let fit = order.and_then(|order| order.fit);
        theory.map(|theory| match fit.map(|fit| fit.exponent) {
            Some(fit) if fit >= theory - LOWER => Verdict::Agree,
            Some(_) => Verdict::Disagree,
            None => Verdict::Undetermined,
        })
    };
    let [l2, h1] = asked.orders;
    let limits = limits(asked, &found);
    let mut verdicts = [of_norm(l2, Some(&found.l2)), of_norm(h1, found.h1.as_ref())];
    for (of_norm, limit) in verdicts.iter_mut().zip(&limits) {
        *of_norm = (*of_norm).max(limit.as_ref().map(verdict));
    }
    OfOrder {
        of,
        n: levels.iter().map(|level| level.n).collect(),
        axis,
        theory: asked.orders,
        verdict: verdicts.into_iter().flatten().max(),
        verdicts,
        limits,
        found,
    }
}

/// What the errors or differences fall to, in each norm with an order of theory. A tolerance is of two codes in L²: for the error
/// of one code, and in H¹, the bound is that of the limit.
fn limits(asked: &Asked, found: &Convergence) -> [Option<Limit>; 2] {
    let of_codes = found.against == "code";
    let rtol = Some(asked.rtol).filter(|rtol| of_codes && rtol.is_finite());
    let limit = |theory: Option<f64>, pick: fn(&Norms) -> Option<(f64, f64)>, rtol: Option<f64>| {
        let norms = found
            .levels
            .iter()
            .map(|l| Some((l.h, pick(l.norms.as_ref()?)?)));
        let norms = norms.collect::<Option<Vec<_>>>()?;
        let scale = norms.last()?.1.1;
        let levels: Vec<(f64, f64)> = norms.into_iter().map(|(h, (norm, _))| (h, norm)).collect();
        Limit::new(&levels, theory?, scale, rtol, !of_codes)
    };
    let [l2, h1] = asked.orders;
    [
        limit(l2, |n| Some((n.l2, n.l2_scale)), rtol),
        limit(h1, |n| n.h1.zip(n.h1_scale), None),
    ]
}

fn verdict(limit: &Limit) -> Verdict {
    match limit.found {
        Found::Zero => Verdict::Agree,
        Found::Apart => Verdict::Disagree,
        Found::Unknown => Verdict::Undetermined,
    }
}
