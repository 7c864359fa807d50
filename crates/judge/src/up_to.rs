//! Compares up to what a problem leaves open: the results are projected, and then compared as usual.

use std::borrow::Cow;

use crate::comparison::{ComparedField, Comparison, MatchBy, On, Settings};
use crate::law::Tolerance;
use crate::open::{Over, Removed, RemovedPart, UpTo};
use crate::supermesh::Exact;
use crate::supermesh::{Carried, Known, Linear, Products, error_against};
use crate::{Norms, Verdict, places};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::io::matches;

/// Units of rounding of the largest value that a field may have after a subtraction.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Values with this relative distance are the same in both results.
const SAME: f64 = 1e-12;
/// A difference is open if removing the open part leaves at most this fraction of it,
const LEFT: f64 = 1e-6;
/// and at most this fraction of the field.
const NOTHING: f64 = 1e-8;
/// Meshes with up to this number of cells are intersected in less than seconds.
const QUICK: usize = 20_000;
/// For larger fields only the candidates that the largest difference and the mean suggest are tried: each attempt is a comparison, and copies the field.
const LARGE: usize = 200_000;
/// With fewer values, an open change fits any difference.
const FEWEST: usize = 8;
/// An open change alters at least one of this number of values; fewer are not worth a copy of the field.
const SPARSE: usize = 1000;

/// The comparison of two unchanged results.
type Compare<'a> = &'a dyn Fn(&Results, &Results, &Settings) -> Result<Comparison>;

/// Compares two results after removing from each field what its problem leaves open.
///
/// # Errors
/// A field that neither result has; those of the comparison.
pub(crate) fn compare_up_to(
    [a, b]: [&Results; 2],
    settings: &Settings,
    compare: Compare,
) -> Result<Comparison> {
    for (name, _) in &settings.up_to {
        if !a.has(name) && !b.has(name) {
            return Err(Error::Compare {
                a: a.source.clone(),
                b: b.source.clone(),
                what: format!("neither has the field `{name}` of which something is left open"),
                remedy: "name a field that one of them has".into(),
            });
        }
    }
    let mut sides = [a.clone(), b.clone()];
    let mut found: Vec<(String, Result<Removed, String>)> = Vec::new();
    let mut factors: Vec<(String, UpTo)> = Vec::new();
    let mut tolerances = settings.tolerances.clone();
    let of_b = names(b);
    for name in names(a).into_iter().filter(|name| of_b.contains(name)) {
        let (multiplied, added): (Vec<UpTo>, Vec<UpTo>) = settings
            .up_to(&name)
            .iter()
            .partition(|up_to| up_to.is_factor());
        factors.extend(multiplied.iter().map(|up_to| (name.clone(), *up_to)));
        for up_to in added {
            let [of_a, of_b] = [&sides[0], &sides[1]].map(|side| Carried::find(side, &name));
            let removed = match (of_a?, of_b?) {
                (Some(of_a), Some(of_b)) => lost([&of_a, &of_b], [a, b], up_to)?,
                _ => Err(NOT_ONE.into()),
            };
            let removed = removed.map(|([field_a, field_b], on, removed)| {
                let largest = |side: &Results| {
                    side.all()
                        .filter(|f| f.name == name)
                        .map(largest)
                        .fold(0.0, f64::max)
                };
                let own = tolerances.of_fields(&field_a, &field_b);
                let atol = own.atol.max(ROUNDING * largest(a).max(largest(b)));
                tolerances
                    .of_field
                    .push((name.clone(), Tolerance { atol, ..own }));
                replace(&mut sides[0], on[0], field_a);
                replace(&mut sides[1], on[1], field_b);
                removed
            });
            found.push((name.clone(), removed));
        }
    }
    let inner = Settings {
        tolerances,
        up_to: Vec::new(),
        ..settings.clone()
    };
    let mut comparison = compare(&sides[0], &sides[1], &inner)?;
    for (name, up_to) in factors {
        let turned = turned([&sides[0], &sides[1]], &name, up_to, &comparison, &inner)?;
        let removed = turned.map(|(on, field, removed)| {
            replace(&mut sides[1], on, field);
            removed
        });
        if let Ok(factor) = &removed {
            let before = found.iter_mut().filter(|(of, _)| *of == name);
            before.for_each(|(_, before)| {
                if let Ok(before) = before {
                    multiply(before, factor);
                }
            });
            comparison = compare(&sides[0], &sides[1], &inner)?;
        }
        found.push((name, removed));
    }
    for (name, found) in found {
        let rows = comparison
            .fields
            .iter_mut()
            .filter(|f| f.field.field == name);
        for row in rows {
            match &found {
                Ok(removed) => row.removed.push(removed.clone()),
                Err(why) => {
                    row.field.verdict = row.field.verdict.max(Verdict::Undetermined);
                    row.field.reason.get_or_insert_with(|| why.clone());
                }
            }
        }
    }
    Ok(comparison.judged())
}

/// Why a field cannot be projected.
const NOT_ONE: &str = "it is not one field of floats on points, cells or corners of each result";

/// Both fields minus their projections to a linear space, and the entities that carry them.
type Lost = ([ResultField; 2], [On; 2], Removed);

/// Projects both fields; `sides` are the original results.
fn lost([a, b]: [&Carried; 2], sides: [&Results; 2], up_to: UpTo) -> Result<Result<Lost, String>> {
    let finite = |of: &Carried| of.field.values.iter().all(|v| v.is_finite());
    if !finite(a) || !finite(b) {
        return Ok(Err("it has a value that is not a finite number".into()));
    }
    let (of_a, of_b) = match (a.without(up_to, None)?, b.without(up_to, None)?) {
        (Ok(of_a), Ok(of_b)) => (of_a, of_b),
        (Err(why), _) | (_, Err(why)) => return Ok(Err(why)),
    };
    let fits = [of_a.1, of_b.1];
    let parts = match parts_of(&fits) {
        Ok(parts) => parts,
        Err(why) => return Ok(Err(why)),
    };
    let removed = told(up_to, sides[0].space, &fits, &parts);
    Ok(match fixed([a, b], sides, &removed)? {
        Some(why) => Err(why),
        None => Ok(([of_a.0, of_b.0], [a.on, b.on], removed)),
    })
}

/// Every name of a field on points, cells or corners, once.
fn names(side: &Results) -> Vec<String> {
    let all = [&side.on_points, &side.on_cells, &side.on_corners];
    let mut names: Vec<String> = all.into_iter().flatten().map(|f| f.name.clone()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn refused(up_to: UpTo, a: &Carried, b: &Carried) -> Option<String> {
    let is_scalar = a.field.components == 1 || b.field.components == 1;
    (up_to == UpTo::Phase && is_scalar).then(|| {
        "it has one component, and a phase is of complex numbers: write real and imaginary part as its two".to_owned()
    })
}

fn largest(field: &ResultField) -> f64 {
    let finite = field.values.iter().filter(|v| v.is_finite());
    finite.fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn replace(side: &mut Results, on: On, field: ResultField) {
    let fields = match on {
        On::Points => &mut side.on_points,
        On::Cells => &mut side.on_cells,
        _ => &mut side.on_corners,
    };
    if let Some(old) = fields.iter_mut().find(|f| f.name == field.name) {
        *old = field;
    }
}

/// For each part of the first mesh that has values, the equal part of the second; an error states why there is none.
fn parts_of([a, b]: &[Vec<Linear>; 2]) -> Result<Vec<[usize; 2]>, String> {
    let filled =
        |of: &[Linear]| -> Vec<usize> { (0..of.len()).filter(|k| of[*k].measure > 0.0).collect() };
    let (of_a, mut of_b) = (filled(a), filled(b));
    if of_a.len() != of_b.len() {
        return Err(format!(
            "one mesh has {} connected parts, the other {}: what is left open is another space",
            of_a.len(),
            of_b.len()
        ));
    }
    let pair = |i: usize| {
        let near = of_b.iter().copied().enumerate();
        let near = near.min_by(|(_, j), (_, k)| {
            let unlike = |j: usize| a[i].unlike(&b[j]);
            unlike(*j).total_cmp(&unlike(*k))
        });
        let (at, j) = near.unwrap_or_default();
        of_b.swap_remove(at);
        [i, j]
    };
    Ok(of_a.into_iter().map(pair).collect())
}

fn told(up_to: UpTo, space: usize, [a, b]: &[Vec<Linear>; 2], parts: &[[usize; 2]]) -> Removed {
    let part = |&[i, j]: &[usize; 2]| {
        let (a, b) = (&a[i], &b[j]);
        RemovedPart {
            size: match up_to {
                UpTo::Gradient => (a.square.max(b.square) / a.measure).sqrt(),
                _ => a.apart(b),
            },
            of_a: a.told.clone(),
            of_b: b.told.clone(),
            ..centred(a, space)
        }
    };
    Removed {
        up_to,
        over: over(a),
        parts: parts.iter().map(part).collect(),
    }
}

fn centred(of: &Linear, space: usize) -> RemovedPart {
    RemovedPart {
        centre: of.about[..space.clamp(2, 3)].to_vec(),
        measure: of.measure,
        ..RemovedPart::default()
    }
}

fn over(of: &[Linear]) -> Over {
    let known = of
        .iter()
        .find_map(|of| of.over.filter(|_| of.measure > 0.0));
    known.unwrap_or(Over::Cells)
}

/// Why nothing was open: at several points both results have the same values at first, and different ones after the subtraction.
/// This is so if both results have the values of Dirichlet conditions.
fn fixed(of: [&Carried; 2], sides: [&Results; 2], removed: &Removed) -> Result<Option<String>> {
    let [a, b] = of;
    let is_open = removed.up_to == UpTo::Gradient || [a, b].iter().any(|of| of.on != On::Points);
    let n = a.field.components;
    let scale = largest(a.field).max(largest(b.field));
    let size = removed
        .parts
        .iter()
        .map(|part| part.size)
        .fold(0.0, f64::max);
    if is_open || n != b.field.components || size <= 1e-9 * scale {
        return Ok(None);
    }
    let partners: Vec<Option<u32>> = match sides.iter().all(|side| !side.points.is_empty()) {
        true => places::partners(&sides[0].points, &sides[1].points)?,
        false if sides[0].ids == sides[1].ids => (0..a.field.len() as u32).map(Some).collect(),
        false => return Ok(None),
    };
    let (mut same, mut all) = (0, 0);
    for (point, other) in (0..).zip(partners) {
        let rows = (a.field.row_of(point), other.and_then(|p| b.field.row_of(p)));
        let (Some(i), Some(j)) = rows else { continue };
        let values = a
            .field
            .values
            .get(i * n..(i + 1) * n)
            .zip(b.field.values.get(j * n..(j + 1) * n));
        let Some((x, y)) = values else { continue };
        all += 1;
        let is_same = x.iter().zip(y).all(|(x, y)| (x - y).abs() <= SAME * scale);
        same += usize::from(is_same);
    }
    // One value may be fixed, and two bodies may be fixed at one point each.
    Ok((same > 3 * removed.parts.len() && same < all).then(|| {
        format!(
            "nothing is left open: both results have the same values at {same} of {all} points as they are, as where Dirichlet values fix them, and {} would change that; leave up_to out",
            removed.words(["the first", "the second"])
        )
    }))
}

type Turned = (On, ResultField, Removed);

/// The second field times the factor that brings it closest to the first.
fn turned(
    [a, b]: [&Results; 2],
    name: &str,
    up_to: UpTo,
    comparison: &Comparison,
    settings: &Settings,
) -> Result<Result<Turned, String>> {
    let (Some(of_a), Some(of_b)) = (Carried::find(a, name)?, Carried::find(b, name)?) else {
        return Ok(Err(NOT_ONE.into()));
    };
    if let Some(why) = refused(up_to, &of_a, &of_b) {
        return Ok(Err(why));
    }
    let means = [of_a.means()?, of_b.means()?];
    let parts = match parts_of(&means) {
        Ok(parts) => parts,
        Err(why) => return Ok(Err(why)),
    };
    let (products, over) = match comparison.map {
        MatchBy::Functions => {
            let near = match settings.near {
                Some(near) => near,
                None => places::tolerance(&a.points, &b.points)?,
            };
            let progress = settings.progress.unwrap_or(&|_| {});
            (of_a.products_over(&of_b, near, progress)?, Over::Cells)
        }
        _ => {
            let n = of_a.field.components;
            let known = comparison.differences.iter().find_map(|of| {
                let (_, m, values) = of.fields.iter().find(|(known, ..)| known == name)?;
                let rows = values.chunks_exact(*m).flat_map(|row| row.iter().take(n));
                let values: Vec<f64> = rows.copied().collect();
                (*m >= n).then_some((of.on, values))
            });
            let Some((on, values)) = known else {
                return Ok(Err(
                    "its values cannot be matched with those of the other result".into(),
                ));
            };
            let difference = ResultField {
                values: values.into(),
                at: None,
                ..of_a.field.clone()
            };
            of_a.products(on, &difference)?
        }
    };
    let mut factors = vec![[1.0, 0.0]; means[1].len()];
    let mut told = Vec::new();
    for [i, j] in parts {
        let factor = products[i].factor(up_to);
        factors[j] = factor;
        told.push(multiplied(&products[i], factor, &means[0][i], a.space));
    }
    let removed = Removed {
        up_to,
        over,
        parts: told,
    };
    Ok(Ok((of_b.on, of_b.times(&factors), removed)))
}

/// What was subtracted from the second field before its multiplication, multiplied as well.
fn multiply(before: &mut Removed, factor: &Removed) {
    for (part, of) in before.parts.iter_mut().zip(&factor.parts) {
        let [re, im] = of.factor.unwrap_or([1.0, 0.0]);
        match im == 0.0 {
            true => part.of_b.iter_mut().for_each(|b| *b *= re),
            false => part.of_b.chunks_exact_mut(2).for_each(|pair| {
                let [x, y] = [pair[0], pair[1]];
                pair.copy_from_slice(&[re * x - im * y, re * y + im * x]);
            }),
        }
        if before.up_to == UpTo::Constant {
            let both = part.of_a.iter().zip(&part.of_b);
            part.size = both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        }
    }
}

fn multiplied(products: &Products, factor: [f64; 2], of: &Linear, space: usize) -> RemovedPart {
    RemovedPart {
        factor: Some(factor),
        size: (products.changed(factor) / of.measure).sqrt(),
        ..centred(of, space)
    }
}

/// [`error_against`] after the field was projected or multiplied by the open factor that brings it closest to
/// the function; the norm of the function is that of its projection.
///
/// # Errors
/// The errors of [`error_against`], and fields without such a projection.
pub fn error_up_to(
    side: &Results,
    field: &str,
    components: usize,
    exact: Exact,
    up_to: &[UpTo],
) -> Result<(Norms, Vec<Removed>)> {
    let mut side = Cow::Borrowed(side);
    let (mut all, mut less) = (Vec::new(), 0.0);
    let known = |at: &[f64; 3], c: usize| if c < components { exact(*at, c).0 } else { 0.0 };
    // The factor belongs to the whole field: constants are subtracted together with it.
    let (factors, added): (Vec<UpTo>, Vec<UpTo>) =
        up_to.iter().partition(|up_to| up_to.is_factor());
    for up_to in factors.into_iter().chain(added) {
        let (on, nearest, removed, square) = {
            let source = &side.source;
            let refuse = |what: String| Error::Compare {
                a: source.clone(),
                b: "the formula".into(),
                what: format!("`{field}` with up_to = {}: {what}", up_to.word()),
                remedy: "leave up_to out, or give a field that has such a part".into(),
            };
            let of = Carried::find(&side, field)?.ok_or_else(|| refuse(NOT_ONE.into()))?;
            let (nearest, removed, square) =
                nearest(&of, side.space, &known, up_to)?.map_err(refuse)?;
            (of.on, nearest, removed, square)
        };
        replace(side.to_mut(), on, nearest);
        less += square;
        all.push(removed);
    }
    let norms = error_against(&side, field, components, exact)?;
    let l2_scale = (norms.l2_scale.powi(2) - less).max(0.0).sqrt();
    Ok((Norms { l2_scale, ..norms }, all))
}

/// The field nearest to a known function among all that are the same up to what is open, and ‖·‖² of the projected function.
fn nearest(
    of: &Carried,
    space: usize,
    known: Known,
    up_to: UpTo,
) -> Result<Result<(ResultField, Removed, f64), String>> {
    let (field, fits, square) = match up_to {
        _ if up_to.is_factor() => {
            if let Some(why) = refused(up_to, of, of) {
                return Ok(Err(why));
            }
            let (products, means) = (of.products_with(known)?, of.means()?);
            let factors: Vec<[f64; 2]> = products.iter().map(|of| of.factor(up_to)).collect();
            let parts = (0..products.len()).filter(|k| means[*k].measure > 0.0);
            let parts = parts.map(|k| multiplied(&products[k], factors[k], &means[k], space));
            let removed = Removed {
                up_to,
                over: Over::Cells,
                parts: parts.collect(),
            };
            return Ok(Ok((of.times(&factors), removed, 0.0)));
        }
        UpTo::Gradient => match of.without_gradient(known)? {
            Ok((field, fits)) => (field, [fits.clone(), fits], 0.0),
            Err(why) => return Ok(Err(why)),
        },
        _ => {
            let known = of.of_known(up_to, known)?;
            match of.without(up_to, Some(&known))? {
                Ok((field, fits)) => {
                    let square = known.iter().map(|of| of.square).sum();
                    (field, [known, fits], square)
                }
                Err(why) => return Ok(Err(why)),
            }
        }
    };
    Ok(parts_of(&fits).map(|parts| (field, told(up_to, space, &fits, &parts), square)))
}

/// For each field that disagrees and was not declared open: a change that makes the results equal, if there is one.
///
/// # Errors
/// [`Error::Ended`].
pub(crate) fn look_for_open(
    [a, b]: [&Results; 2],
    settings: &Settings,
    comparison: &mut Comparison,
    compare: Compare,
) -> Result<()> {
    for k in 0..comparison.fields.len() {
        let of = &comparison.fields[k];
        let is_plain = of.field.verdict == Verdict::Disagree && of.field.reason.is_none();
        let is_everywhere = of.field.beyond.saturating_mul(SPARSE) >= of.field.faces;
        let is_asked = !settings.up_to(&of.field.field).is_empty();
        if !is_plain || !is_everywhere || is_asked || of.field.faces < FEWEST {
            continue;
        }
        let name = of.field.field.clone();
        let only = |side: &Results| {
            let keep = |fields: &[ResultField]| -> Vec<ResultField> {
                fields.iter().filter(|f| f.name == name).cloned().collect()
            };
            Results {
                on_points: keep(&side.on_points),
                on_cells: keep(&side.on_cells),
                on_corners: keep(&side.on_corners),
                source: side.source.clone(),
                space: side.space,
                points: side.points.clone(),
                ids: side.ids.clone(),
                width: side.width,
                cells: side.cells.clone(),
                kinds: side.kinds.clone(),
                ..Results::default()
            }
        };
        let candidates = candidates(of, comparison.map, components(a, &name));
        if candidates.is_empty() {
            continue;
        }
        let sides = [only(a), only(b)];
        let mut alone = settings.clone();
        alone
            .tolerances
            .of_field
            .retain(|(of, _)| matches(of, &name));
        alone.nan_equal.retain(|of| matches(of, &name));
        for up_to in candidates {
            let count = up_to.len();
            let again = Settings {
                up_to: vec![(name.clone(), up_to)],
                ..alone.clone()
            };
            let again = match compare_up_to([&sides[0], &sides[1]], &again, compare) {
                Err(Error::Ended(cause)) => return Err(Error::Ended(cause)),
                Err(_) => continue,
                Ok(again) => again,
            };
            let of = &mut comparison.fields[k];
            let left = again.fields.iter().find(|f| f.field.field == name);
            let Some(left) = left.filter(|f| f.removed.len() == count) else {
                continue;
            };
            let (left, removed) = (left.field.max_abs, left.removed.clone());
            // Binary32 has half of the digits.
            let [share, nothing] = if of.single {
                [1e-3, 1e-5]
            } else {
                [LEFT, NOTHING]
            };
            let scale = of.scale.unwrap_or(0.0);
            if left <= share * of.field.max_abs && left <= nothing * scale {
                of.equal_after = removed;
                break;
            }
        }
    }
    Ok(())
}

fn components(side: &Results, name: &str) -> usize {
    let known = side.all().find(|f| f.name == name);
    known.map_or(0, |f| f.components)
}

/// The candidates for the difference of a field, from its largest value and its mean, the likeliest first.
fn candidates(of: &ComparedField, map: MatchBy, n: usize) -> Vec<Vec<UpTo>> {
    let (far, scale) = (of.field.max_abs, of.scale.unwrap_or(0.0));
    let near = |x: f64, y: f64| (x - y).abs() <= 1e-5 * y;
    // Intersecting large meshes takes long.
    let most = match map {
        MatchBy::Functions => QUICK,
        _ => LARGE,
    };
    let is_quick = of.field.faces <= most;
    let mut all = Vec::new();
    if of.field.rms
        >= far
            * if is_quick {
                0.01
            } else {
                0.999 / (n as f64).sqrt()
            }
    {
        all.push(vec![UpTo::Constant]);
    }
    if near(far, 2.0 * scale) {
        all.push(vec![UpTo::Sign]);
    }
    if !is_quick {
        return all;
    }
    all.push(vec![UpTo::Scale]);
    all.push(vec![UpTo::Constant, UpTo::Sign]);
    all.extend((n == 2).then(|| vec![UpTo::Phase]));
    all.extend((n >= 2 && of.on != On::Cells).then(|| vec![UpTo::Rigid]));
    all.extend((n >= 2).then(|| vec![UpTo::Gradient]));
    all
}
