//! One case: its engines, its pairs field by field, and the pictures.

use super::contact::contact;
use super::map::{self, CLASSES};
use super::markup::{Html, element, facts, figure, leaf, table, text, word};
use super::pair::{Pair, differences, pairs};
use super::plots;
use crate::campaigns::verify::{CaseOutcome, VerifyRequest};
use crate::report::model::{Cell, Table, cells, exact, place, short};
use crate::report::verify::{engines, label};
use crate::run::Setup;
use crate::why::Diagnosis;
use faceoff_fem::scene::HRule;
use faceoff_judge::{Verdict, relative_differences};
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Triangulation;

pub(super) fn key() -> Html {
    key_of(&CLASSES)
}

pub(super) fn key_of(names: &[&str]) -> Html {
    let items = names.iter().enumerate().map(|(k, name)| {
        let swatch = leaf("i", &[("class", &format!("k{k}"))], "");
        element("li", &[], [swatch, text(name)])
    });
    element("ul", &[("class", "key")], items.collect::<Html>())
}

pub(in crate::report) fn section(
    index: usize,
    case: &CaseOutcome,
    request: &VerifyRequest,
    diagnoses: &[Diagnosis],
) -> Result<Html> {
    let mut parts = vec![table(&engines(case))];
    let mesh = &*case.setup.mesh;
    for pair in pairs(case) {
        let name = text(format!("{} in {}: ", pair.name(), label(case)));
        let mut of_pair = vec![element("summary", &[], [name, word(pair.verdict())])];
        let found = diagnoses
            .iter()
            .filter(|d| d.is_of((&case.scene, &case.method, case.n), (pair.a, pair.b)));
        of_pair.extend(found.map(diagnosis));
        of_pair.push(fields(case, &pair));
        of_pair.push(pictures(case, &pair, mesh)?);
        let open: &[(&str, &str)] = match pair.verdict() {
            Verdict::Agree => &[],
            _ => &[("open", "")],
        };
        parts.push(element(
            "details",
            open,
            of_pair.into_iter().collect::<Html>(),
        ));
    }
    parts.push(contact(case, mesh)?);
    parts.push(provenance(case));
    let summary = element(
        "summary",
        &[],
        [text(format!("{}: ", label(case))), word(case.verdict)],
    );
    let mut attributes = vec![];
    if case.verdict != Verdict::Agree || request.scenes.len() == 1 {
        attributes.push(("open", ""));
    }
    let details = element(
        "details",
        &attributes,
        [summary, parts.into_iter().collect::<Html>()],
    );
    let id = format!("case-{index}");
    Ok(element(
        "section",
        &[("id", &id), ("aria-label", &label(case))],
        [leaf("h2", &[], label(case)), details],
    ))
}

fn diagnosis(found: &Diagnosis) -> Html {
    let rows = found.ingredients.iter().map(|i| {
        let accounts = if i.accounts {
            "accounts for it"
        } else {
            "does not"
        };
        cells![&i.ingredient, &i.matched, i.left, accounts]
    });
    let caption = format!(
        "One ingredient matched at a time; the difference to begin with is {} of max|u|",
        short(found.difference)
    );
    let of = Table::new(
        caption,
        &["ingredient", "matched", "difference left", "found"],
    );
    Html::from([leaf("p", &[], found.sentence()), table(&of.with(rows))])
}

fn fields(case: &CaseOutcome, pair: &Pair) -> Html {
    let rows = pair.fields.iter().map(|f| {
        let worst = f.worst.as_ref();
        let flips = match (f.flips, f.rounding_flips) {
            (Some(flips), Some(rounding)) => {
                format!("{flips} status flips, and {rounding} at rounding level")
            }
            _ => String::new(),
        };
        cells![
            &f.field,
            f.verdict,
            f.max_abs,
            f.max_rel,
            f.tolerance,
            f.rms,
            format!("{} of {}", f.beyond, f.faces),
            worst.map(|w| format!("{:?} at {}", w.vertices, place(&w.midpoint))),
            worst.map(|w| Cell::Number(w.a, exact(w.a))),
            worst.map(|w| Cell::Number(w.b, exact(w.b))),
            f.reason.as_ref().unwrap_or(&flips),
        ]
    });
    let caption = format!(
        "Every field of {} in {}; relative to max|u| s, s being how much a field changes with the dofs",
        pair.name(),
        label(case)
    );
    let (of_a, of_b) = (format!("{} there", pair.a), format!("{} there", pair.b));
    let head = [
        "field",
        "verdict",
        "max |a-b|",
        "relative",
        "tolerance",
        "rms",
        "faces beyond",
        "worst face",
        &of_a,
        &of_b,
        "remarks",
    ];
    table(&Table::new(caption, &head).with(rows))
}

fn pictures(case: &CaseOutcome, pair: &Pair, mesh: &Triangulation) -> Result<Html> {
    let find = |name: &str| case.fields.iter().find(|f| f.source == name);
    let (Some(a), Some(b)) = (find(pair.a), find(pair.b)) else {
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
    pictures.push(figure(
        plots::histogram(
            &format!("histogram of differences, {about}"),
            &all,
            tolerance,
        )?,
        "How many values of all fields differ by how much; what is equal stands at 0.",
    ));
    if let Some(differences) = differences(case, pair)? {
        let shown = differences.on(mesh);
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
        if differences.disagrees
            && let Some(zoom) = map::zoom(&format!("the worst face, {about}"), &shown)
        {
            pictures.push(figure(
                zoom,
                format!("The same around the worst face of `{field}`."),
            ));
        }
    }
    let row = element(
        "div",
        &[("class", "row")],
        pictures.into_iter().collect::<Html>(),
    );
    Ok(Html::from([row, key()]))
}

fn provenance(case: &CaseOutcome) -> Html {
    let Setup {
        scene,
        discretisation,
        settings,
        mesh,
        ..
    } = &case.setup;
    let mut known: Vec<(&str, String)> = vec![
        ("faceoff", env!("CARGO_PKG_VERSION").into()),
        (
            "codes",
            case.engines
                .iter()
                .map(|e| format!("{} {}", e.engine, e.version))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        (
            "mesh",
            format!(
                "{} cells, {} faces, {} of them contact, {} dofs; digest {}",
                case.cells, case.faces, case.contact_faces, case.dofs, case.mesh_digest
            ),
        ),
    ];
    let h = match discretisation.h {
        HRule::Local => "h the diameter of the cell behind the contact face",
        HRule::Global => "h the largest diameter of all cells",
    };
    known.push(("γ", format!("{} h, {h}", discretisation.gamma0)));
    if let Ok([cell, face]) = discretisation.rules(mesh.dim) {
        known.push((
            "quadrature",
            format!("{} for the load, {} on Γ_C and Γ_N", cell.name, face.name),
        ));
    }
    let data = scene.data();
    known.push((
        "data",
        format!(
            "f = {}; g = {}; ∂ₙu = {}; ψ = {}",
            data.f.text(),
            data.g.text(),
            data.t.text(),
            data.psi.text()
        ),
    ));
    let stop = settings.stop;
    known.push((
        "stopping rule",
        format!(
            "relative broken H¹ norm of the increment at most {:e}, or {} steps",
            stop.increment, stop.max_iterations
        ),
    ));
    known.push(("start", "u = 0, and g on Γ_D".into()));
    let known: Vec<_> = known
        .into_iter()
        .map(|(name, fact)| (name.to_owned(), fact))
        .collect();
    let heading = leaf("h3", &[], format!("Provenance, {}", label(case)));
    Html::from([heading, facts(&known)])
}
