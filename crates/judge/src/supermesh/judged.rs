//! The verdict on each field of two results whose meshes are others.

use super::domain::Domain;
use super::function::Function;
use super::norms::{Law, OnCell, Place, Sums, differences, is_exact};
use super::overlay::Uncovered;
use crate::comparison::by_id;
use crate::parts::Parts;
use crate::sets::{by_name, lacks};
use crate::{
    ComparedField, Differences, FieldVerdict, Intersection, On, Settings, Tolerance, Verdict, Worst,
};
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};

/// Judges every field as a function, on the intersection of the meshes; and the domains, where one mesh covers more than
/// the part of itself that the settings allow. Without such a part, more than rounding of the coordinates is too much.
///
/// # Errors
/// Meshes that are folded, of other dimensions, or have nothing in common; cells on which functions are not known.
pub(crate) fn judge_functions(
    a: &Results,
    b: &Results,
    near: f64,
    settings: &Settings,
) -> Result<(Vec<ComparedField>, Intersection, Differences)> {
    let tolerances = &settings.tolerances;
    let progress = settings.progress.unwrap_or(&|_| {});
    let domains = [Domain::new(a, near)?, Domain::new(b, near)?];
    let [of_a, of_b] = &domains;
    let refuse = |what: String| Error::Compare {
        a: a.source.clone(),
        b: b.source.clone(),
        what,
        remedy: "give two results on one domain".into(),
    };
    if of_a.dim != of_b.dim {
        let what = format!(
            "one mesh has cells of dimension {}, the other of {}",
            of_a.dim, of_b.dim
        );
        return Err(refuse(what));
    }
    let has_surface = of_a.is_surface || of_b.is_surface;
    if of_a.dim == 2 && !has_surface && (of_a.height() - of_b.height()).abs() > near {
        let what = format!(
            "one mesh lies in z = {}, the other in z = {}",
            of_a.height(),
            of_b.height()
        );
        return Err(refuse(what));
    }
    // In the order of the files, with those that cannot be judged.
    let mut fields = Vec::new();
    let mut functions = [Vec::new(), Vec::new()];
    let is_plane = of_a.dim == 2 && !has_surface;
    for (name, found) in pairs(a, b) {
        match matched(name, found, [a, b], is_plane) {
            Ok(pair) => {
                (0..2).for_each(|k| functions[k].push(pair[k]));
                fields.push(None);
            }
            Err((on, reason)) => {
                fields.push(Some(ComparedField::unjudged(on, name, tolerances, reason)));
            }
        }
    }
    let scales = [
        Scales::new(of_a, &functions[0], near)?,
        Scales::new(of_b, &functions[1], near)?,
    ];
    let laws: Vec<(Tolerance, bool)> = (0..functions[0].len())
        .map(|k| {
            let is_integer = functions.iter().all(|of| of[k].field.rest.is_some());
            (
                tolerances.of_fields(functions[0][k].field, functions[1][k].field),
                is_integer,
            )
        })
        .collect();
    let units: Vec<_> = laws
        .iter()
        .enumerate()
        .map(|(k, (tolerance, _))| {
            let scales = &scales;
            move |cells: [u32; 2]| {
                let scale = scales[0].of(k, cells[0]).max(scales[1].of(k, cells[1]));
                tolerance.of_scale(scale).1
            }
        })
        .collect();
    let judged: Vec<Law> = laws
        .iter()
        .zip(&units)
        .map(|((tolerance, is_integer), unit)| Law {
            unit,
            tolerance: tolerance.of_scale(0.0).0,
            is_integer: *is_integer,
        })
        .collect();
    let sides = [of_a, of_b];
    let (sums, cover) = differences(sides, [&functions[0], &functions[1]], &judged, progress)?;
    let open = fields.iter_mut().filter(|field| field.is_none());
    for (k, (field, (sums, (tolerance, _)))) in open.zip(sums.iter().zip(&laws)).enumerate() {
        let is_constant = functions.iter().any(|of| of[k].is_constant());
        let scale = scales.iter().map(|of| of.largest(k)).fold(0.0, f64::max);
        *field = Some(ComparedField {
            on: On::Functions,
            scale: Some(scale),
            rtol: tolerance.rtol,
            atol: tolerance.atol,
            norms: Some(sums.norms(is_constant)),
            single: functions.iter().any(|of| of[k].field.single),
            removed: Vec::new(),
            equal_after: Vec::new(),
            field: verdict(
                of_a,
                &functions[0][k].field.name,
                tolerance,
                sums,
                cover.common,
            ),
        });
    }
    let named = functions[0].iter().zip(&sums);
    let differences = Differences {
        on: On::Functions,
        places: Vec::new(),
        fields: named
            .map(|(f, sums)| (f.field.name.clone(), 3, on_cells(&cover.of_cells[0], sums)))
            .collect(),
    };
    let uncovered = [0, 1].map(|k| Uncovered::new(sides[k], &cover.of_cells[k]));
    let rows = sides
        .iter()
        .zip(&uncovered)
        .filter_map(|(side, of)| domain_row(side, of, settings.alone));
    let fields = fields.into_iter().flatten().chain(rows).collect();
    let exact = sides.iter().all(|side| is_exact(side));
    let changes = sums.iter().map(Sums::change);
    let quadrature = match exact {
        true => None,
        false => changes.reduce(|x, y| if x >= y || x.is_nan() { x } else { y }),
    };
    let intersection = Intersection {
        cells: [of_a.cell_count(), of_b.cell_count()],
        measures: [of_a.measure, of_b.measure],
        common: cover.common,
        alone: uncovered.map(|of| of.measure.max(0.0)),
        curved: [of_a.curved, of_b.curved],
        exact,
        quadrature,
        distance: cover.distance,
    };
    Ok((fields, intersection, differences))
}

/// For each cell of the first mesh the largest |a - b|, and the means of a and b; NaN where the other mesh does not cover it.
fn on_cells(covered: &[f64], sums: &Sums) -> Vec<f64> {
    let mut cells = vec![OnCell::default(); covered.len()];
    for (cell, found) in &sums.on_cells {
        cells[*cell as usize].add(found);
    }
    let rows = cells
        .iter()
        .zip(covered)
        .map(|(cell, covered)| match covered {
            0.0 => [f64::NAN; 3],
            covered => {
                let [a, b] = cell.integrals.map(|integral| integral / covered);
                [cell.largest, a, b]
            }
        });
    rows.flatten().collect()
}

type Found<'a> = [Vec<(On, &'a ResultField)>; 2];

/// Every name with the fields of either side that have it.
fn pairs<'a>(a: &'a Results, b: &'a Results) -> Vec<(&'a str, Found<'a>)> {
    let all = |side: &'a Results| -> Vec<(On, &'a ResultField)> {
        let on = [
            (On::Points, &side.on_points),
            (On::Cells, &side.on_cells),
            (On::Corners, &side.on_corners),
        ];
        on.into_iter()
            .flat_map(|(on, fields)| fields.iter().map(move |f| (on, f)))
            .collect()
    };
    by_name(all(a), all(b), |(_, field)| &field.name)
}

/// The one field of each side that a name has, as functions; or why it cannot be judged.
fn matched<'a>(
    name: &str,
    [of_a, of_b]: Found<'a>,
    [a, b]: [&Results; 2],
    is_plane: bool,
) -> Result<[Function<'a>; 2], (On, String)> {
    let on = of_a
        .iter()
        .chain(&of_b)
        .map(|(on, _)| *on)
        .next()
        .unwrap_or(On::Points);
    let (&[(on_a, field_a)], &[(on_b, field_b)]) = (&of_a[..], &of_b[..]) else {
        let without = if of_a.is_empty() { a } else { b };
        let reason = match of_a.is_empty() || of_b.is_empty() {
            true => lacks(name, &without.source),
            false => format!("a file has `{name}` more than once"),
        };
        return Err((on, reason));
    };
    let mut functions = [Function::new(field_a, on_a), Function::new(field_b, on_b)];
    let components = functions.map(|f| f.components);
    match components {
        [p, q] if p == q => {}
        [2, 3] | [3, 2] if is_plane => functions.iter_mut().for_each(|f| f.components = 3),
        [p, q] => return Err((on, format!("one side has {p} components, the other {q}"))),
    }
    let whole = |f: &Function| f.field.rest.is_some() && !f.is_constant();
    if functions.iter().any(whole) {
        let reason = "whole numbers on points are labels rather than a function: leave them out, as with --only";
        return Err((on, reason.into()));
    }
    Ok(functions)
}

/// The largest |value| of each function on each connected part of a mesh.
struct Scales {
    /// The part of each cell.
    part: Vec<u32>,
    /// For each function, one number for each part.
    of: Vec<Vec<f64>>,
}

impl Scales {
    fn new(domain: &Domain, functions: &[Function], near: f64) -> Result<Self> {
        let numbers = by_id(domain.side);
        let parts = Parts::new(domain.side, &numbers, near)?;
        let side = domain.side;
        let part = |cell: usize| {
            let first = side.cell(cell).next();
            parts.of(&first
                .map(|p| crate::parts::number(&numbers, p))
                .into_iter()
                .collect::<Vec<_>>())
        };
        let part: Vec<u32> = (0..side.cell_count()).map(part).collect();
        let mut of = vec![vec![0.0; parts.count + 1]; functions.len()];
        let mut nodal = Vec::new();
        let mut before = None;
        for piece in &domain.pieces {
            if before.replace(piece.cell) == Some(piece.cell) {
                continue;
            }
            for (function, scales) in functions.iter().zip(&mut of) {
                let scale: &mut f64 = &mut scales[part[piece.cell as usize] as usize];
                for component in 0..function.components {
                    if function.is_constant() {
                        nodal = vec![function.on_cell(piece.cell, component)];
                    } else {
                        nodal.resize(domain.element(piece.cell).len(), 0.0);
                        function.at_nodes(domain, piece.cell, component, &mut nodal);
                    }
                    let finite = nodal.iter().filter(|v| v.is_finite());
                    *scale = finite.fold(*scale, |m, v| m.max(v.abs()));
                }
            }
        }
        Ok(Scales { part, of })
    }

    fn of(&self, function: usize, cell: u32) -> f64 {
        self.of[function][self.part[cell as usize] as usize]
    }

    fn largest(&self, function: usize) -> f64 {
        self.of[function].iter().copied().fold(0.0, f64::max)
    }
}

fn verdict(
    a: &Domain,
    name: &str,
    tolerance: &Tolerance,
    sums: &Sums,
    common: f64,
) -> FieldVerdict {
    let allowed = tolerance.of_scale(0.0).0;
    let named = |place: &Place| Worst {
        vertices: a.side.cell(place.cells[0] as usize).collect(),
        midpoint: place.at[..a.side.space].to_vec(),
        a: place.values[0],
        b: place.values[1],
        component: place.component,
        cells: Some(place.cells),
    };
    let found = FieldVerdict {
        max_abs: sums.max,
        max_rel: sums.relative,
        verdict: if sums.beyond.is_empty() {
            Verdict::Agree
        } else {
            Verdict::Disagree
        },
        worst: sums.worst.as_ref().map(named),
        faces: a.cell_count(),
        beyond: sums.beyond.len(),
        rms: sums.norms(true).l2 / common.sqrt(),
        ..FieldVerdict::failed(name, allowed, String::new())
    };
    match &sums.not_finite {
        None => FieldVerdict {
            reason: None,
            ..found
        },
        Some(place) => {
            let ([i, j], [x, y]) = (place.cells, place.values);
            FieldVerdict {
                max_abs: f64::NAN,
                max_rel: f64::NAN,
                rms: f64::NAN,
                worst: Some(named(place)),
                reason: Some(format!(
                    "cell {i} of the first has {x}, cell {j} of the second {y}"
                )),
                ..found
            }
        }
    }
}

/// The note on a mesh that the other does not cover; none where that is rounding.
fn domain_row(side: &Domain, uncovered: &Uncovered, allowed: Option<f64>) -> Option<ComparedField> {
    let cell = uncovered.worst?;
    let part = uncovered.measure / side.measure;
    let at = side.side.centroid(cell as usize).unwrap_or_default();
    let far = match side.is_surface {
        true => ", or more than once, or it is further away than a tenth of the cells' size",
        false => "",
    };
    let reason = format!(
        "{} of {} cells of {} are not covered by the other mesh{}, {:.3e} of its measure: the largest part in cell {cell} at {:?}",
        uncovered.cells,
        side.cell_count(),
        side.side.source,
        far,
        part,
        &at[..side.side.space]
    );
    let agrees = allowed.is_some_and(|allowed| part <= allowed);
    let rtol = allowed.unwrap_or(0.0);
    Some(ComparedField {
        on: On::Domain,
        scale: Some(side.measure),
        rtol,
        atol: 0.0,
        norms: None,
        single: false,
        removed: Vec::new(),
        equal_after: Vec::new(),
        field: FieldVerdict {
            max_abs: uncovered.measure,
            max_rel: part,
            verdict: if agrees {
                Verdict::Agree
            } else {
                Verdict::Disagree
            },
            faces: side.cell_count(),
            beyond: uncovered.cells,
            ..FieldVerdict::failed("domain", rtol, reason)
        },
    })
}
