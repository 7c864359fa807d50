//! One row a code, one row a case, and folded every pair and field.

use super::axis::{Axis, Dot, key};
use super::markup::{Column, Entry, Html, Sheet, element, folded, leaf, prose, text, word};
use super::pair::{largest, pairs};
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, VerifyOutcome};
use crate::engine::unique;
use crate::report::number::{number, place, size, whole};
use crate::report::verify::{label, sizes, versions, worst};
use crate::run::{RESIDUAL_TOLERANCE, Setup, tolerance};
use crate::why::Explanation;
use faceoff_fem::contact::Method;
use faceoff_fem::scene::HRule;
use faceoff_judge::FieldVerdict;

/// Of more cases those that are farthest from agreement stand in the open.
const OPEN: usize = 9;
/// So many attempts stand in the open.
const TRIED: usize = 5;
const ROUNDING: f64 = f64::EPSILON;

/// The codes of a run, each with its dot; one that is at fault has a red one.
pub(in crate::report) struct Codes<'a> {
    outcome: &'a VerifyOutcome,
    /// Name, class of its dots.
    pub names: Vec<(&'a str, &'static str)>,
    fault: Vec<&'a str>,
    axis: Axis,
}

impl<'a> Codes<'a> {
    pub fn new(outcome: &'a VerifyOutcome, fault: &[&'a str]) -> Self {
        let answers = || outcome.cases.iter().flat_map(|c| &c.engines);
        let mut classes = ["", "e1", "e2", "e3"].into_iter().cycle();
        let names = unique(answers().map(|e| &*e.engine)).into_iter();
        let names = names.map(|name| match fault.contains(&name) {
            true => (name, "bd"),
            // Of a cycle there is always one more.
            false => (name, classes.next().unwrap_or_default()),
        });
        Codes {
            outcome,
            names: names.collect(),
            fault: fault.to_vec(),
            axis: Axis::new(answers().map(|e| e.residual), vec![RESIDUAL_TOLERANCE]),
        }
    }

    fn class(&self, name: &str) -> &'static str {
        self.names
            .iter()
            .find(|(known, _)| *known == name)
            .map_or("", |(_, class)| class)
    }

    /// One row a code.
    pub fn by_code(&self) -> Html {
        let cases = self.outcome.cases.len();
        let in_each = match cases {
            1 => "residual".to_owned(),
            _ => format!("residual in each of the {cases} cases"),
        };
        let mut sheet = Sheet {
            head: vec![
                Column::new("w", text("code")),
                Column::new("opt", text("version")),
                Column::new("w", text("solves")),
                Column::new("d", Html::from([text(in_each), self.axis.head()])),
                Column::new("n", text("largest")),
                Column::new("opt w", text("in")),
                Column::new("n opt", text("steps")),
                Column::new("n opt", text("time")),
            ],
            ..Sheet::default()
        };
        for (name, class) in &self.names {
            let of: Vec<(&CaseOutcome, &EngineOutcome)> = self.answers(name).collect();
            let right = of.iter().filter(|(_, e)| e.verdict.passes()).count();
            let dots = of.iter().map(|(case, e)| Dot {
                value: e.residual,
                class,
                title: label(case),
            });
            let dots: Vec<Dot> = dots.collect();
            let key = |e: &EngineOutcome| {
                if e.residual.is_nan() {
                    f64::INFINITY
                } else {
                    e.residual
                }
            };
            let Some((case, most)) = of.iter().max_by(|a, b| key(a.1).total_cmp(&key(b.1))) else {
                continue;
            };
            let steps = of.iter().map(|(_, e)| e.iterations);
            let (least, last) = (steps.clone().min().unwrap_or(0), steps.max().unwrap_or(0));
            let steps = if least == last {
                last.to_string()
            } else {
                format!("{least}–{last}")
            };
            let seconds: f64 = of.iter().map(|(_, e)| e.seconds).sum();
            let solves = format!("{right} of {}", of.len());
            let solves = match right == of.len() {
                true => text(solves),
                false => leaf("b", &[("class", "bad")], solves),
            };
            let row = vec![
                Entry::new(leaf("b", &[], name), None),
                Entry::words(&most.version),
                Entry::new(solves, Some(right as f64)),
                Entry::new(self.axis.strip(&dots), Some(most.residual)),
                Entry::number(most.residual, size(most.residual)),
                Entry::words(label(case)),
                Entry::number(last as f64, steps),
                Entry::number(seconds, format!("{} s", number(seconds, 2))),
            ];
            sheet.rows.push((right < of.len(), row));
        }
        sheet.html()
    }

    fn answers(&self, name: &'a str) -> impl Iterator<Item = (&'a CaseOutcome, &'a EngineOutcome)> {
        let of = move |case: &'a CaseOutcome| {
            let mut engines = case.engines.iter();
            engines.find(|e| e.engine == name).map(|e| (case, e))
        };
        self.outcome.cases.iter().filter_map(of)
    }

    /// One row a case, the farthest from agreement first; of many cases the rest is folded.
    pub fn by_case(&self, shown: Option<&CaseOutcome>) -> Html {
        let mut cases: Vec<&CaseOutcome> = self.outcome.cases.iter().collect();
        if !self.fault.is_empty() || cases.len() > OPEN {
            let residual = |case: &CaseOutcome| {
                case.engines
                    .iter()
                    .map(|e| e.residual / RESIDUAL_TOLERANCE)
                    .fold(0.0, worse)
            };
            let apart = |case: &CaseOutcome| {
                case.pairs
                    .iter()
                    .map(|p| p.field.max_rel / p.field.tolerance)
                    .fold(0.0, worse)
            };
            cases.sort_by(|a, b| {
                let by_verdict = b.verdict.cmp(&a.verdict);
                let key = |c: &CaseOutcome| {
                    worse(
                        residual(c),
                        if self.fault.is_empty() { apart(c) } else { 0.0 },
                    )
                };
                by_verdict.then(key(b).total_cmp(&key(a)))
            });
        }
        let rest = cases.split_off(cases.len().min(OPEN));
        let mut parts = vec![self.cases(&cases, shown)];
        if !rest.is_empty() {
            let name = format!("{} more cases, nearer to agreement", whole(rest.len()));
            parts.push(folded(text(name), [self.cases(&rest, shown)]));
        }
        parts.into_iter().collect()
    }

    fn cases(&self, cases: &[&CaseOutcome], shown: Option<&CaseOutcome>) -> Html {
        let agree = self.fault.is_empty() && self.outcome.verdict.passes();
        let dots = Html::from([key(self.names.iter().copied()), self.axis.head()]);
        let has_n = unique(self.outcome.cases.iter().map(|c| (&c.scene, c.n))).len()
            > unique(self.outcome.cases.iter().map(|c| &c.scene)).len();
        let mut head = vec![
            Column::new("w", text("scene")),
            Column::new("", text("method")),
        ];
        head.extend(has_n.then(|| Column::new("n", text("n"))));
        head.push(Column::new("n opt", text("unknowns")));
        if !agree {
            head.push(Column::new("n opt", text("contact faces")));
        }
        head.push(Column::new("d", dots));
        head.push(Column::new("n", text("residual")));
        if agree {
            head.push(Column::new("n", text("difference")));
        } else {
            head.extend([
                Column::new("w opt", text("most at")),
                Column::new("n opt", text("largest |a − b|")),
                Column::new("w opt", text("verdict")),
            ]);
        }
        let mut sheet = Sheet {
            head,
            ..Sheet::default()
        };
        for case in cases {
            let of = case.engines.iter();
            let dots: Vec<Dot> = of
                .clone()
                .map(|e| Dot {
                    value: e.residual,
                    class: self.class(&e.engine),
                    title: e.engine.clone(),
                })
                .collect();
            let most = of.max_by(|a, b| worse(a.residual, 0.0).total_cmp(&worse(b.residual, 0.0)));
            let residual = most.map_or(f64::NAN, |e| e.residual);
            let fails = !(residual <= RESIDUAL_TOLERANCE);
            let apart = largest(case.pairs.iter().map(|p| &p.field));
            let name = match shown.is_some_and(|s| std::ptr::eq(s, *case))
                && self.outcome.cases.len() > 1
            {
                true => Html::from([
                    text(&case.scene),
                    leaf("span", &[("class", "cap")], " shown here"),
                ]),
                false => text(&case.scene),
            };
            let mut row = vec![Entry::new(name, None), Entry::words(&case.method)];
            if has_n {
                row.push(
                    case.n
                        .map_or(Entry::words(""), |n| Entry::number(n as f64, n.to_string())),
                );
            }
            row.push(Entry::number(case.dofs as f64, whole(case.dofs)));
            if !agree {
                row.push(Entry::number(
                    case.contact_faces as f64,
                    whole(case.contact_faces),
                ));
            }
            row.push(Entry::new(self.axis.strip(&dots), Some(residual)));
            let digits = if case.engines.is_empty() {
                "no answer".to_owned()
            } else {
                size(residual)
            };
            let class = if fails { "bad" } else { "" };
            row.push(Entry::new(
                leaf("span", &[("class", class)], digits),
                Some(residual),
            ));
            if agree {
                row.push(Entry::number(
                    apart,
                    number(apart / ROUNDING, if apart < 1e3 * ROUNDING { 2 } else { 3 }),
                ));
            } else {
                let at = most.filter(|_| fails).and_then(|e| e.residual_at.as_ref());
                row.push(Entry::words(at.map_or("nowhere".into(), |x| place(x))));
                let apart = if case.pairs.is_empty() {
                    Entry::words("–")
                } else {
                    Entry::number(apart, size(apart))
                };
                row.extend([apart, Entry::new(word(case.verdict), None)]);
            }
            sheet.rows.push((false, row));
        }
        sheet.html()
    }
}

/// The larger, and what is not a number before all.
fn worse(a: f64, b: f64) -> f64 {
    match a.is_nan() || b.is_nan() {
        true => f64::INFINITY,
        false => a.max(b),
    }
}

/// Every field of every pair of a case.
pub(in crate::report) fn fields(case: &CaseOutcome) -> Html {
    let head = [
        ("w", "pair"),
        ("w", "field"),
        ("n", "largest |a − b|"),
        ("n", "relative"),
        ("n", "tolerance"),
        ("n opt", "rms"),
        ("n", "faces beyond"),
        ("w", "worst face"),
        ("n", "a there"),
        ("n", "b there"),
        ("", "verdict"),
    ];
    let mut sheet = Sheet {
        head: head
            .into_iter()
            .map(|(class, name)| Column::new(class, text(name)))
            .collect(),
        ..Sheet::default()
    };
    let beyond = |f: &FieldVerdict| match f.beyond {
        0 => format!("none of {}", whole(f.faces)),
        some => format!("{} of {}", whole(some), whole(f.faces)),
    };
    for pair in pairs(case) {
        for f in &pair.fields {
            let value = |of: fn(&faceoff_judge::Worst) -> f64| {
                f.worst
                    .as_ref()
                    .map_or(Entry::words(""), |w| Entry::number(of(w), number(of(w), 4)))
            };
            let said = f
                .reason
                .as_ref()
                .map_or(String::new(), |why| format!(": {why}"));
            let row = vec![
                Entry::words(pair.name()),
                Entry::words(&f.field),
                Entry::number(f.max_abs, size(f.max_abs)),
                Entry::number(f.max_rel, size(f.max_rel)),
                Entry::number(f.tolerance, number(f.tolerance, 2)),
                Entry::number(f.rms, size(f.rms)),
                Entry::number(f.beyond as f64, beyond(f)),
                Entry::words(if f.max_abs == 0.0 {
                    "–".to_owned()
                } else {
                    worst(f).unwrap_or_default()
                }),
                value(|w| w.a),
                value(|w| w.b),
                Entry::new(Html::from([word(f.verdict), prose(said)]), None),
            ];
            sheet.rows.push((!f.verdict.passes(), row));
        }
    }
    sheet.html()
}

/// What was put into the scheme in its place, and what that left; the rest of a long list is folded.
pub(in crate::report) fn tried(explanations: &[Explanation], limit: f64) -> Html {
    let axis = Axis::new(explanations.iter().map(|e| e.left), vec![limit]);
    let (first, rest) = explanations.split_at(explanations.len().min(TRIED));
    let sheet = |all: &[Explanation]| {
        let head = vec![
            Column::new("", text("what would have to be so")),
            Column::new("d", Html::from([text("residual with it"), axis.head()])),
            Column::new("n", text("left")),
            Column::new("w opt", text("found")),
        ];
        let rows = all.iter().map(|of| {
            let class = if of.accounts { "" } else { "e2" };
            let dot = Dot {
                value: of.left,
                class,
                title: of.ingredient.to_owned(),
            };
            let row = vec![
                Entry::words(&of.what),
                Entry::new(axis.strip(&[dot]), Some(of.left)),
                Entry::number(of.left, size(of.left)),
                Entry::words(if of.accounts {
                    "explains it"
                } else {
                    "does not"
                }),
            ];
            (of.accounts, row)
        });
        Sheet {
            head,
            rows: rows.collect(),
            ..Sheet::default()
        }
        .html()
    };
    match rest.is_empty() {
        true => sheet(first),
        false => {
            let name = format!("{} more that leave more", rest.len());
            Html::from([sheet(first), folded(text(name), [sheet(rest)])])
        }
    }
}

/// How a case is posed: all that its answers depend on.
pub(in crate::report) fn posed(case: &CaseOutcome) -> Html {
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
        ("codes", versions(case)),
        (
            "mesh",
            format!("{}; digest `{}`", sizes(case), case.mesh_digest),
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
        ("data", format!("`f = {f}; g = {g}; ∂ₙu = {t}; ψ = {psi}`")),
        ("stopping rule", stop),
        ("start", "u = 0, and g on Γ_D".into()),
    ]);
    let heading = leaf("h3", &[], format!("Provenance, {}", label(case)));
    Html::from([heading, super::markup::facts(&known)])
}

/// The tolerances of the methods of a run.
pub(in crate::report) fn tolerances(outcome: &VerifyOutcome) -> String {
    let methods = unique(outcome.cases.iter().map(|c| &*c.method)).into_iter();
    let told = methods.filter_map(|name| {
        let method: Method = name.parse().ok()?;
        Some(format!("{} ({name})", number(tolerance(&method), 2)))
    });
    told.collect::<Vec<_>>().join(" and ")
}

/// A heading, and what follows is about.
pub(super) fn heading(level: &str, words: &str, about: &str) -> Html {
    let about = match about.is_empty() {
        true => Html::default(),
        false => element("p", &[], prose(about)),
    };
    Html::from([element(level, &[], prose(words)), about])
}
