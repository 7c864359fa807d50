//! One case: its engines, its pairs field by field, and the pictures.

use super::contact::contact;
use super::map::{self, CLASSES};
use super::markup::{Html, element, facts, figure, key, leaf, table, text, word};
use super::pair::{Pair, differences, pairs};
use super::plots;
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, VerifyRequest};
use crate::report::judge::{terms, tried, worst as worst_rows};
use crate::report::model::{self, Cell, exact, short};
use crate::report::verify::{engines, label, sizes, versions, worst};
use crate::run::Setup;
use crate::why::Diagnosis;
use faceoff_fem::scene::HRule;
use faceoff_judge::{FieldVerdict, relative_differences};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

pub(in crate::report) fn section(
    index: usize,
    case: &CaseOutcome,
    request: &VerifyRequest,
    diagnoses: &[Diagnosis],
) -> Result<Html> {
    let caption =
        "Answers; the residual is the backward error of an answer put into the scheme again";
    let summary = [text(format!("{}: ", label(case))), word(case.verdict)];
    let mut parts = vec![
        element("summary", &[], summary),
        table(&engines(case, caption)),
    ];
    parts.extend(case.engines.iter().filter_map(findings));
    let mesh = &*case.setup.mesh;
    for pair in pairs(case) {
        let name = text(format!("{} in {}: ", pair.name(), label(case)));
        let mut of_pair = vec![element("summary", &[], [name, word(pair.verdict())])];
        of_pair.extend(pair.diagnoses(case, diagnoses).map(diagnosis));
        of_pair.push(fields(case, &pair));
        of_pair.push(pictures(case, &pair, mesh)?);
        parts.push(details(!pair.verdict().passes(), of_pair));
    }
    parts.extend([contact(case, mesh)?, provenance(case)]);
    let is_open = !case.verdict.passes() || request.scenes.len() == 1;
    let id = format!("case-{index}");
    Ok(element(
        "section",
        &[("id", &id), ("aria-label", &label(case))],
        [leaf("h2", &[], label(case)), details(is_open, parts)],
    ))
}

fn details(is_open: bool, inner: Vec<Html>) -> Html {
    let open = is_open.then_some(("open", ""));
    element("details", open.as_slice(), inner)
}

/// What is wrong with an answer that does not solve the scheme.
fn findings(engine: &EngineOutcome) -> Option<Html> {
    let found = engine.findings.as_ref()?;
    let sentence = format!("{}: {}", engine.engine, found.sentence());
    Some(Html::from([
        leaf("p", &[], sentence),
        table(&tried(&found.explanations)),
        table(&worst_rows(&found.worst)),
        table(&terms(&found.terms)),
    ]))
}

fn diagnosis(found: &Diagnosis) -> Html {
    let caption = format!(
        "One ingredient matched at a time; the difference to begin with is {} of max|u|",
        short(found.difference)
    );
    let of = model::table!(caption, &found.ingredients, |i|
        "ingredient" => &i.ingredient,
        "matched" => &i.matched,
        "difference left" => i.left,
        "found" => if i.accounts { "accounts for it" } else { "does not" },
    );
    Html::from([leaf("p", &[], found.sentence()), table(&of)])
}

fn fields(case: &CaseOutcome, pair: &Pair) -> Html {
    let remarks = |f: &FieldVerdict| match (&f.reason, f.flips, f.rounding_flips) {
        (Some(reason), ..) => reason.clone(),
        (_, Some(flips), Some(rounding)) => {
            format!("{flips} status flips, and {rounding} at rounding level")
        }
        _ => String::new(),
    };
    let there = |value: f64| Cell::Number(value, exact(value));
    let caption = format!(
        "Every field of {} in {}; relative to max|u| s, s being how much a field changes with the dofs",
        pair.name(),
        label(case)
    );
    let (of_a, of_b) = (format!("{} there", pair.a), format!("{} there", pair.b));
    let of = model::table!(caption, &pair.fields, |f|
        "field" => &f.field,
        "verdict" => f.verdict,
        "max |a-b|" => f.max_abs,
        "relative" => f.max_rel,
        "tolerance" => f.tolerance,
        "rms" => f.rms,
        "faces beyond" => format!("{} of {}", f.beyond, f.faces),
        "worst face" => worst(f),
        &of_a => f.worst.as_ref().map(|w| there(w.a)),
        &of_b => f.worst.as_ref().map(|w| there(w.b)),
        "remarks" => remarks(f),
    );
    table(&of)
}

fn pictures(case: &CaseOutcome, pair: &Pair, mesh: &Triangulation) -> Result<Html> {
    let Some([a, b]) = pair.of(case) else {
        return Ok(Html::default());
    };
    let about = format!("{} in {}", pair.name(), label(case));
    let mut pictures = Vec::new();
    let mut all = Vec::new();
    for field in pair.fields.iter().filter(|f| f.field != "status") {
        let of_field = relative_differences(a, b, &field.field)?;
        all.extend(of_field.into_iter().map(|(_, d)| d));
    }
    let tolerance = pair.fields.first().map_or(1e-12, |f| f.tolerance);
    let name = format!("histogram of differences, {about}");
    pictures.push(figure(
        plots::histogram(&name, &all, tolerance)?,
        "How many values of all fields differ by how much; what is equal stands at 0.",
    ));
    if let Some(shown) = differences(case, pair)? {
        let field = pair.worst().map_or("", |f| f.field.as_str());
        let what = if mesh.dim == 2 {
            "Faces"
        } else {
            "The faces of Γ_C"
        };
        pictures.push(figure(
            map::overview(&format!("map of differences, {about}"), &shown),
            format!(
                "{what} by |a-b| of `{field}` in units of the tolerance, the worst in a circle; {}.",
                map::orientation(&shown)
            ),
        ));
        if shown.disagrees
            && let Some(zoom) = map::zoom(&format!("the worst face, {about}"), &shown)
        {
            pictures.push(figure(
                zoom,
                format!("The same around the worst face of `{field}`."),
            ));
        }
    }
    let row = element("div", &[("class", "row")], pictures);
    Ok(Html::from([row, key("k", CLASSES.len(), &CLASSES)]))
}

fn provenance(case: &CaseOutcome) -> Html {
    let Setup {
        scene,
        discretisation,
        settings,
        mesh,
        ..
    } = &case.setup;
    let h = match discretisation.h {
        HRule::Local => "h the diameter of the cell behind the contact face",
        HRule::Global => "h the largest diameter of all cells",
    };
    let data = scene.data();
    let [f, g, t, psi] = [&data.f, &data.g, &data.t, &data.psi].map(|e| e.text());
    let mut known = vec![
        ("faceoff", env!("CARGO_PKG_VERSION").to_owned()),
        ("codes", versions(case)),
        (
            "mesh",
            format!("{}; digest {}", sizes(case), case.mesh_digest),
        ),
        ("γ", format!("{} h, {h}", discretisation.gamma0)),
    ];
    if let Ok([cell, face]) = discretisation.rules(mesh.dim) {
        let rules = format!("{} for the load, {} on Γ_C and Γ_N", cell.name, face.name);
        known.push(("quadrature", rules));
    }
    let stop = format!(
        "relative broken H¹ norm of the increment at most {:e}, or {} steps",
        settings.stop.increment, settings.stop.max_iterations
    );
    known.extend([
        ("data", format!("f = {f}; g = {g}; ∂ₙu = {t}; ψ = {psi}")),
        ("stopping rule", stop),
        ("start", "u = 0, and g on Γ_D".into()),
    ]);
    let heading = leaf("h3", &[], format!("Provenance, {}", label(case)));
    Html::from([heading, facts(&known)])
}
