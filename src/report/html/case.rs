//! One case: its engines, its pairs field by field, and the pictures.

use super::chain::chain;
use super::map::{self, CLASSES, Shown};
use super::markup::{Html, element, figure, leaf, table, text};
use super::plots::{self, Curves};
use super::{label, number, word};
use crate::compare::{FieldVerdict, Verdict, relative_differences};
use crate::diagnose::Diagnosis;
use crate::error::Result;
use crate::field::FaceFields;
use crate::mesh::Triangulation;
use crate::scene::{HRule, Scene};
use crate::verify::{CaseOutcome, Request};

/// Two engines and every field of theirs.
pub(super) struct Pair<'a> {
    pub a: &'a str,
    pub b: &'a str,
    pub fields: Vec<&'a FieldVerdict>,
}

pub(super) fn pairs(case: &CaseOutcome) -> Vec<Pair<'_>> {
    let mut pairs: Vec<Pair> = Vec::new();
    for outcome in &case.pairs {
        let (a, b) = (outcome.a.as_str(), outcome.b.as_str());
        match pairs.iter_mut().find(|p| (p.a, p.b) == (a, b)) {
            Some(pair) => pair.fields.push(&outcome.field),
            None => pairs.push(Pair {
                a,
                b,
                fields: vec![&outcome.field],
            }),
        }
    }
    pairs
}

impl<'a> Pair<'a> {
    pub fn name(&self) -> String {
        format!("{} – {}", self.a, self.b)
    }

    pub fn verdict(&self) -> Verdict {
        let all = self.fields.iter().map(|f| f.verdict);
        all.max().unwrap_or(Verdict::Undetermined)
    }

    /// The field that is shown: the means where they differ, which every face has; else what lies farthest beyond its
    /// tolerance.
    pub fn worst(&self) -> Option<&'a FieldVerdict> {
        let means = self.fields.iter().find(|f| f.field == "mean");
        let farthest = self
            .fields
            .iter()
            .filter(|f| f.field != "status")
            .max_by(|f, g| {
                let factor = |f: &FieldVerdict| match (f.verdict, f.max_rel / f.tolerance) {
                    (Verdict::Agree, factor) => factor,
                    (_, factor) if factor.is_nan() => f64::INFINITY,
                    (_, factor) => factor,
                };
                factor(f).total_cmp(&factor(g))
            });
        match (means, farthest) {
            (Some(means), _) if means.verdict != Verdict::Agree => Some(means),
            (Some(means), Some(farthest)) if farthest.verdict == Verdict::Agree => Some(means),
            (_, farthest) => farthest.copied(),
        }
    }
}

/// `(0.5000, 0.2500)`
pub(super) fn place(x: &[f64]) -> String {
    let x: Vec<String> = x.iter().map(|x| format!("{x:.4}")).collect();
    format!("({})", x.join(", "))
}

/// What a map shows, without the mesh.
pub(super) struct Differences {
    differences: Vec<(u32, f64)>,
    tolerance: f64,
    disagrees: bool,
    worst: Option<u32>,
}

impl Differences {
    pub fn on<'a>(&'a self, mesh: &'a Triangulation) -> Shown<'a> {
        Shown {
            mesh,
            differences: &self.differences,
            tolerance: self.tolerance,
            disagrees: self.disagrees,
            worst: self.worst,
        }
    }
}

/// The mesh of a case, made again, and what the map of a pair shows on it: in space only Γ_C.
pub(super) fn shown(
    case: &CaseOutcome,
    pair: &Pair,
    request: &Request,
) -> Result<Option<(Triangulation, Differences)>> {
    let Some(scene) = request.scenes.iter().find(|s| s.name == case.scene) else {
        return Ok(None);
    };
    let mesh = scene.triangulation(case.n)?;
    Ok(differences(case, pair, &mesh)?.map(|differences| (mesh, differences)))
}

fn differences(
    case: &CaseOutcome,
    pair: &Pair,
    mesh: &Triangulation,
) -> Result<Option<Differences>> {
    let find = |name: &str| case.fields.iter().find(|f| f.source == name);
    let (Some(a), Some(b), Some(field)) = (find(pair.a), find(pair.b), pair.worst()) else {
        return Ok(None);
    };
    let mut differences = relative_differences(a, b, &field.field)?;
    if mesh.dim == 3 {
        let contact = a.column("flux").map_or(&[][..], |c| &c.faces);
        differences.retain(|(face, _)| contact.binary_search(face).is_ok());
    }
    let worst = field
        .worst
        .as_ref()
        .and_then(|w| mesh.find_face(&w.vertices));
    let worst = worst.map(|face| face as u32);
    let worst = worst.filter(|face| differences.iter().any(|(f, _)| f == face));
    Ok(Some(Differences {
        differences,
        tolerance: field.tolerance,
        disagrees: field.verdict != Verdict::Agree,
        worst,
    }))
}

pub(super) fn key() -> Html {
    key_of(&CLASSES)
}

fn key_of(names: &[&str]) -> Html {
    let items = names.iter().enumerate().map(|(k, name)| {
        let swatch = leaf("i", &[("class", &format!("k{k}"))], "");
        element("li", &[], [swatch, text(name)])
    });
    element("ul", &[("class", "key")], items.collect::<Html>())
}

/// Colours of the engines.
fn engines_key(names: &[&str]) -> Html {
    let items = names.iter().enumerate().map(|(k, name)| {
        let swatch = leaf("i", &[("class", &format!("e{}", k % 4))], "");
        element("li", &[], [swatch, text(name)])
    });
    element("ul", &[("class", "key")], items.collect::<Html>())
}

pub(super) fn section(
    index: usize,
    case: &CaseOutcome,
    request: &Request,
    diagnoses: &[Diagnosis],
) -> Result<Html> {
    let mut parts = vec![engines(case)];
    let scene = request.scenes.iter().find(|s| s.name == case.scene);
    let mesh = scene.map(|scene| scene.triangulation(case.n)).transpose()?;
    for pair in pairs(case) {
        let name = text(format!("{} in {}: ", pair.name(), label(case)));
        let mut of_pair = vec![element("summary", &[], [name, word(pair.verdict())])];
        let found = diagnoses.iter().filter(|d| d.is_of(case, pair.a, pair.b));
        of_pair.extend(found.map(diagnosis));
        of_pair.push(fields(case, &pair));
        if let Some(mesh) = &mesh {
            of_pair.push(pictures(case, &pair, mesh)?);
        }
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
    parts.push(contact(case, mesh.as_ref())?);
    parts.push(provenance(case, scene, request));
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

fn engines(case: &CaseOutcome) -> Html {
    let rows = case.engines.iter().map(|e| {
        let steps = if e.converged { "" } else { " (not converged)" };
        let cells = vec![
            text(&e.engine),
            text(&e.version),
            text(format!("{}{steps}", e.iterations)),
            text(format!("{:.3}", e.seconds)),
            number(e.residual),
            text(e.residual_at.as_ref().map_or(String::new(), |x| place(x))),
            word(e.verdict),
        ];
        (crate::report::word(e.verdict), cells)
    });
    table(
        "Answers; the residual is the backward error of an answer put into the scheme again",
        &[
            "engine", "version", "steps", "seconds", "residual", "most at", "verdict",
        ],
        rows.collect(),
    )
}

fn diagnosis(found: &Diagnosis) -> Html {
    let rows = found.ingredients.iter().map(|i| {
        let accounts = if i.accounts {
            "accounts for it"
        } else {
            "does not"
        };
        let cells = vec![
            text(&i.ingredient),
            text(&i.matched),
            number(i.left),
            text(accounts),
        ];
        (if i.accounts { "disagree" } else { "" }, cells)
    });
    Html::from([
        leaf("p", &[], found.sentence()),
        table(
            &format!(
                "One ingredient matched at a time; the difference to begin with is {:.1e} of max|u|",
                found.difference
            ),
            &["ingredient", "matched", "difference left", "found"],
            rows.collect(),
        ),
    ])
}

fn fields(case: &CaseOutcome, pair: &Pair) -> Html {
    let rows = pair.fields.iter().map(|f| {
        let worst = f.worst.as_ref();
        let flips = match (f.flips, f.rounding_flips) {
            (Some(flips), Some(rounding)) => format!("{flips} ({rounding} at rounding level)"),
            _ => String::new(),
        };
        let cells = vec![
            text(&f.field),
            number(f.max_abs),
            number(f.max_rel),
            number(f.tolerance),
            number(f.rms),
            text(format!("{} of {}", f.beyond, f.faces)),
            text(worst.map_or(String::new(), |w| {
                format!("{:?} at {}", w.vertices, place(&w.midpoint))
            })),
            text(worst.map_or(String::new(), |w| format!("{:e}", w.a))),
            text(worst.map_or(String::new(), |w| format!("{:e}", w.b))),
            text(flips),
            Html::from([
                word(f.verdict),
                text(
                    f.reason
                        .as_ref()
                        .map_or(String::new(), |r| format!(": {r}")),
                ),
            ]),
        ];
        (crate::report::word(f.verdict), cells)
    });
    let of_a = format!("{} there", pair.a);
    let of_b = format!("{} there", pair.b);
    table(
        &format!(
            "Every field of {} in {}; relative to max|u| s, s being how much a field changes with the dofs",
            pair.name(),
            label(case)
        ),
        &[
            "field",
            "max |a-b|",
            "relative",
            "tolerance",
            "rms",
            "faces beyond",
            "worst face",
            &of_a,
            &of_b,
            "status flips",
            "verdict",
        ],
        rows.collect(),
    )
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
    if let Some(differences) = differences(case, pair, mesh)? {
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

/// Trace and flux along Γ_C, and the histories.
fn contact(case: &CaseOutcome, mesh: Option<&Triangulation>) -> Result<Html> {
    let names: Vec<&str> = case.engines.iter().map(|e| e.engine.as_str()).collect();
    let curves = match mesh.filter(|mesh| mesh.dim == 3) {
        Some(mesh) => zones(case, mesh),
        None => along(case)?.unwrap_or_default(),
    };
    let mut pictures = Vec::new();
    let histories: Vec<(&str, &[f64])> = case
        .engines
        .iter()
        .map(|e| (e.engine.as_str(), e.increments.as_slice()))
        .collect();
    if histories
        .iter()
        .any(|(_, increments)| !increments.is_empty())
    {
        pictures.push(figure(
            plots::histories(&format!("iterations, {}", label(case)), &histories)?,
            "Relative broken H¹ norm of the increment of each step.",
        ));
    }
    Ok(Html::from([
        leaf(
            "h3",
            &[],
            format!("Along Γ_C and step by step, {}", label(case)),
        ),
        engines_key(&names),
        curves,
        element(
            "div",
            &[("class", "row")],
            pictures.into_iter().collect::<Html>(),
        ),
    ]))
}

/// The contact status on a surface.
fn zones(case: &CaseOutcome, mesh: &Triangulation) -> Html {
    let columns: Vec<_> = case
        .fields
        .iter()
        .filter_map(|f| f.column("status"))
        .collect();
    let Some(first) = columns.first() else {
        return Html::default();
    };
    let statuses = |k: usize| columns.iter().map(move |c| c.row(k));
    let of = |k: usize| {
        let in_contact = |row: &[f64]| row.iter().filter(|p| **p <= 0.0).count();
        let same = |row: &[f64]| {
            row.iter()
                .zip(first.row(k))
                .all(|(p, q)| (*p <= 0.0) == (*q <= 0.0))
        };
        match in_contact(first.row(k)) {
            _ if !statuses(k).all(same) => 3,
            0 => 0,
            count if count == first.components => 1,
            _ => 2,
        }
    };
    let faces: Vec<(u32, usize)> = first
        .faces
        .iter()
        .enumerate()
        .map(|(k, f)| (*f, of(k)))
        .collect();
    let differ = faces.iter().filter(|(_, status)| *status == 3).count();
    let picture = map::status(
        &format!("contact status on Γ_C, {}", label(case)),
        mesh,
        &faces,
    );
    let caption = format!("The faces of Γ_C by their contact status; codes differ on {differ}.");
    Html::from([figure(picture, caption), key_of(&map::STATUS)])
}

fn along(case: &CaseOutcome) -> Result<Option<Html>> {
    let Some(first) = case.fields.first().filter(|f| f.dim == 2) else {
        return Ok(None);
    };
    let (Some(flux), Some(status)) = (first.column("flux"), first.column("status")) else {
        return Ok(None);
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
        case.fields
            .iter()
            .map(|f| (f.source.as_str(), of(f, name)))
            .collect()
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
        if case.fields[1..].iter().any(differs) {
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
    let picture = plots::along_contact(
        &format!("trace and flux along Γ_C, {}", label(case)),
        chain.axis,
        &panels,
    )?;
    let caption = format!(
        "Means over the contact faces, in the scene's units; what coincides lies under the thinner line. Shaded: faces at least \
         partly in contact by {}. Crosses: faces where the contact status differs at a quadrature point ({}).",
        first.source,
        flips.len()
    );
    let wide = figure(picture, caption);
    Ok(Some(wide))
}

fn provenance(case: &CaseOutcome, scene: Option<&Scene>, request: &Request) -> Html {
    let mut facts: Vec<(&str, String)> = vec![
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
    if let Some(scene) = scene {
        let h = match scene.h {
            HRule::Local => "h the diameter of the cell behind the contact face",
            HRule::Global => "h the largest diameter of all cells",
        };
        facts.push(("γ", format!("{} h, {h}", scene.gamma0)));
        let dim = case.fields.first().map_or(2, |f| f.dim);
        if let Ok([cell, face]) = scene.rules(dim) {
            facts.push((
                "quadrature",
                format!("{} for the load, {} on Γ_C and Γ_N", cell.name, face.name),
            ));
        }
        let data = &scene.data;
        facts.push((
            "data",
            format!(
                "f = {}; g = {}; ∂ₙu = {}; ψ = {}",
                data.f.text(),
                data.g.text(),
                data.t.text(),
                data.psi.text()
            ),
        ));
    }
    let stop = request.settings.stop;
    facts.push((
        "stopping rule",
        format!(
            "relative broken H¹ norm of the increment at most {:e}, or {} steps",
            stop.increment, stop.max_iterations
        ),
    ));
    facts.push(("start", "u = 0, and g on Γ_D".into()));
    let items: Html = facts
        .into_iter()
        .map(|(name, fact)| Html::from([leaf("dt", &[], name), leaf("dd", &[], fact)]))
        .collect();
    Html::from([
        leaf("h3", &[], format!("Provenance, {}", label(case))),
        element("dl", &[], items),
    ])
}
