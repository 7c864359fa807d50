//! What happens on Γ_C: curves in the plane, a map on a surface; and how the iterations went.

use super::chain::chain;
use super::map::{self, STATUS};
use super::markup::{Html, element, figure, key, leaf};
use super::plots::{self, COLOURS, Curves};
use crate::campaigns::verify::CaseOutcome;
use crate::report::verify::label;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;
use faceoff_mesh::mesh::Triangulation;

/// Trace and flux along Γ_C, and the histories.
pub(super) fn contact(case: &CaseOutcome, mesh: &Triangulation) -> Result<Html> {
    let names: Vec<&str> = case.engines.iter().map(|e| e.engine.as_str()).collect();
    let about = label(case);
    let of: Vec<_> = case.engines.iter().map(|e| &*e.increments).collect();
    let of: Vec<_> = names.iter().copied().zip(of).collect();
    let heading = format!("Along Γ_C and step by step, {about}");
    let histories = element("div", &[("class", "row")], histories(&of, &about)?);
    Ok(Html::from([
        leaf("h3", &[], heading),
        key("e", COLOURS.len(), &names),
        on_contact(&case.fields, mesh, &about)?,
        histories,
    ]))
}

/// What happens on Γ_C, as it can be shown in the plane or on a surface.
pub(in crate::report) fn on_contact(
    all: &[FaceFields],
    mesh: &Triangulation,
    about: &str,
) -> Result<Html> {
    match mesh.dim {
        3 => Ok(zones(all, mesh, about)),
        _ => along(all, about),
    }
}

/// The increments of every engine.
pub(in crate::report) fn histories(engines: &[(&str, &[f64])], about: &str) -> Result<Html> {
    if engines.iter().all(|(_, increments)| increments.is_empty()) {
        return Ok(Html::default());
    }
    let picture = plots::histories(&format!("iterations, {about}"), engines)?;
    Ok(figure(
        picture,
        "Relative broken H¹ norm of the increment of each step.",
    ))
}

/// The contact status on a surface.
fn zones(all: &[FaceFields], mesh: &Triangulation, about: &str) -> Html {
    let columns: Vec<_> = all.iter().filter_map(|f| f.column("status")).collect();
    let Some(first) = columns.first() else {
        return Html::default();
    };
    let statuses = |k: usize| columns.iter().map(move |c| c.row(k));
    let of = |k: usize| {
        let in_contact = |row: &[f64]| row.iter().filter(|p| **p <= 0.0).count();
        let same = |row: &[f64]| {
            let mut both = row.iter().zip(first.row(k));
            both.all(|(p, q)| (*p <= 0.0) == (*q <= 0.0))
        };
        match in_contact(first.row(k)) {
            _ if !statuses(k).all(same) => 3,
            0 => 0,
            count if count == first.components => 1,
            _ => 2,
        }
    };
    let faces = first.faces.iter().enumerate();
    let faces: Vec<(u32, usize)> = faces.map(|(k, f)| (*f, of(k))).collect();
    let differ = faces.iter().filter(|(_, status)| *status == 3).count();
    let picture = map::status(&format!("contact status on Γ_C, {about}"), mesh, &faces);
    let caption = format!("The faces of Γ_C by their contact status; codes differ on {differ}.");
    Html::from([figure(picture, caption), key("k", STATUS.len(), &STATUS)])
}

/// Trace and flux along Γ_C of 2D fields, one set of each engine.
fn along(all: &[FaceFields], about: &str) -> Result<Html> {
    let Some(first) = all.first().filter(|f| f.dim == 2) else {
        return Ok(Html::default());
    };
    let (Some(flux), Some(status)) = (first.column("flux"), first.column("status")) else {
        return Ok(Html::default());
    };
    let chain = chain(first, &flux.faces);
    let of = |fields: &FaceFields, name: &str| -> Vec<f64> {
        let Some(column) = fields.column(name) else {
            return Vec::new();
        };
        let value = |row: &usize| {
            let place = column.faces.binary_search(&flux.faces[*row]);
            place.map_or(f64::NAN, |k| column.row(k)[0])
        };
        chain.rows.iter().map(value).collect()
    };
    let values = |name: &str| -> Vec<(&str, Vec<f64>)> {
        let all = all.iter();
        all.map(|f| (&*f.source, of(f, name))).collect()
    };
    let in_contact = |fields: &FaceFields, row: usize, q: usize| {
        let column = fields.column("status");
        column.is_some_and(|c| c.row(row).get(q).is_some_and(|p| *p <= 0.0))
    };
    let points = status.components;
    // Neighbours in contact are one zone.
    let mut zones: Vec<(f64, f64)> = Vec::new();
    let mut flips = Vec::new();
    for (k, &row) in chain.rows.iter().enumerate() {
        if (0..points).any(|q| in_contact(first, row, q)) {
            let (from, to) = chain.ends[k];
            match zones.last_mut() {
                Some(zone) if (zone.1 - from).abs() <= 1e-9 * (to - from) => zone.1 = to,
                _ => zones.push((from, to)),
            }
        }
        let differs = |other: &FaceFields| {
            (0..points).any(|q| in_contact(first, row, q) != in_contact(other, row, q))
        };
        if all[1..].iter().any(differs) {
            flips.push(chain.s[k]);
        }
    }
    let curves = |name: &'static str, values| Curves {
        s: &chain.s,
        values,
        zones: &zones,
        flips: &flips,
        name,
    };
    let panels = [
        curves("mean of u", values("mean")),
        curves("mean of ∂ₙu", values("flux")),
    ];
    let name = format!("trace and flux along Γ_C, {about}");
    let picture = plots::along_contact(&name, chain.axis, &panels)?;
    let caption = format!(
        "Means over the contact faces, in the scene's units; what coincides lies under the thinner line. Shaded: faces at least \
         partly in contact by {}. Crosses: faces where the contact status differs at a quadrature point ({}).",
        first.source,
        flips.len()
    );
    Ok(figure(picture, caption))
}
