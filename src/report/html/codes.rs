//! One row per code, one row per case, and every pair and field, collapsed by default.

use super::axis::{Axis, Dot, key};
use super::markup::{Html, facts, folded, html};
use super::pair::{largest, pairs};
use super::tables::table;
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, VerifyOutcome};
use crate::engine::unique;
use crate::report::described::{rests_on, sizes, versions, worst};
use crate::report::model::{self, Cell, Column, Table};
use crate::run::{RESIDUAL_TOLERANCE, Setup, tolerance};
use crate::text::number::{number, place, size, whole};
use crate::text::{Number, Text, text};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::HRule;
use faceoff_judge::{FieldVerdict, Worst};

/// The most cases that are not folded, those farthest from agreement first.
const OPEN: usize = 9;
const ROUNDING: f64 = f64::EPSILON;

/// The codes of a run, each with its dot; that of a code at fault is red.
pub(in crate::report) struct Codes<'a> {
    outcome: &'a VerifyOutcome,
    /// Name, and class of its dots.
    pub names: Vec<(&'a str, &'static str)>,
    fault: Vec<&'a str>,
    axis: Axis,
}

impl<'a> Codes<'a> {
    pub fn new(outcome: &'a VerifyOutcome, fault: &[&'a str]) -> Self {
        let answers = || outcome.answers();
        let mut classes = ["", "e1", "e2", "e3"].into_iter().cycle();
        let names = unique(answers().map(|e| &*e.engine)).into_iter();
        let names = names.map(|name| match fault.contains(&name) {
            true => (name, "bd"),
            // A cycle never ends.
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

    /// One row per code.
    pub fn by_code(&self) -> Html {
        let in_each = match self.outcome.cases.len() {
            1 => "residual".to_owned(),
            cases => format!("residual in each of the {cases} cases"),
        };
        let of_code = |(name, class): &(&'a str, &'static str)| {
            let of: Vec<(&CaseOutcome, &EngineOutcome)> = self.answers(name).collect();
            let key = |e: &EngineOutcome| worse(e.residual, 0.0);
            let (case, most) = *of.iter().max_by(|a, b| key(a.1).total_cmp(&key(b.1)))?;
            Some((*name, *class, of, case, most))
        };
        let dots = |class, of: &[(&CaseOutcome, &EngineOutcome)]| -> Vec<Dot> {
            let dot = |(case, e): &(&CaseOutcome, &EngineOutcome)| Dot {
                value: e.residual,
                class,
                title: case.label(),
            };
            of.iter().map(dot).collect()
        };
        let right = |of: &[(&CaseOutcome, &EngineOutcome)]| {
            of.iter().filter(|(_, e)| e.verdict.passes()).count()
        };
        let solves = |of: &[(&CaseOutcome, &EngineOutcome)]| {
            let right = right(of);
            Cell::number(right as f64, format!("{right} of {}", of.len())).bad_if(right < of.len())
        };
        let steps = |of: &[(&CaseOutcome, &EngineOutcome)]| {
            let steps = of.iter().map(|(_, e)| e.iterations);
            let (least, last) = (steps.clone().min().unwrap_or(0), steps.max().unwrap_or(0));
            Cell::number(
                last as f64,
                match least == last {
                    true => last.to_string(),
                    false => format!("{least}–{last}"),
                },
            )
        };
        let seconds = |of: &[(&CaseOutcome, &EngineOutcome)]| {
            let seconds: f64 = of.iter().map(|(_, e)| e.seconds).sum();
            Cell::number(seconds, format!("{} s", number(seconds, 2)))
        };
        let rows: Vec<_> = self.names.iter().filter_map(of_code).collect();
        let set_off: Vec<bool> = rows.iter().map(|row| right(&row.2) < row.2.len()).collect();
        let all = model::table!("", rows, |(name, class, of, case, most)|
            ("w", "code") => Text::strong(name),
            ("opt", "version") => &most.version,
            ("w", "solves") => solves(&of),
            Column::of_dots(&in_each, &self.axis) => Cell::dots(&self.axis, &dots(class, &of), most.residual),
            ("n", "largest") => Cell::size(most.residual),
            ("opt w", "in") => case.label(),
            ("n opt", "steps") => steps(&of),
            ("n opt", "time") => seconds(&of),
        );
        table(&all.setting_off(set_off.into_iter()))
    }

    fn answers(&self, name: &'a str) -> impl Iterator<Item = (&'a CaseOutcome, &'a EngineOutcome)> {
        let of = move |case: &'a CaseOutcome| {
            let mut engines = case.engines.iter();
            engines.find(|e| e.engine == name).map(|e| (case, e))
        };
        self.outcome.cases.iter().filter_map(of)
    }

    /// One row per case, the farthest from agreement first; of many cases the rest is folded.
    pub fn by_case(&self, shown: Option<&CaseOutcome>) -> Html {
        let mut cases: Vec<&'a CaseOutcome> = self.outcome.cases.iter().collect();
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
            parts.push(folded(html! { (name) }, self.cases(&rest, shown)));
        }
        parts.into_iter().collect()
    }

    fn cases(&self, cases: &[&'a CaseOutcome], shown: Option<&CaseOutcome>) -> Html {
        let all = &self.outcome.cases;
        let agree = self.fault.is_empty() && self.outcome.verdict.passes();
        let has_n = unique(all.iter().map(|c| (&c.scene, c.n))).len()
            > unique(all.iter().map(|c| &c.scene)).len();
        let most = |case: &'a CaseOutcome| {
            let of = case.engines.iter();
            of.max_by(|a, b| worse(a.residual, 0.0).total_cmp(&worse(b.residual, 0.0)))
        };
        let residual = |case: &'a CaseOutcome| most(case).map_or(f64::NAN, |e| e.residual);
        let fails = |case: &'a CaseOutcome| !(residual(case) <= RESIDUAL_TOLERANCE);
        let apart = |case: &CaseOutcome| largest(case.pairs.iter().map(|p| &p.field));
        let dots = |case: &'a CaseOutcome| {
            let dot = |e: &EngineOutcome| Dot {
                value: e.residual,
                class: self.class(&e.engine),
                title: e.engine.clone(),
            };
            let dots: Vec<Dot> = case.engines.iter().map(dot).collect();
            Cell::dots(&self.axis, &dots, residual(case))
        };
        let name = |case: &CaseOutcome| Cell {
            more: match shown.is_some_and(|s| std::ptr::eq(s, case)) && all.len() > 1 {
                true => html! { span.cap { " shown here" } },
                false => Html::default(),
            },
            ..Cell::from(&case.scene)
        };
        let digits = |case: &'a CaseOutcome| {
            let digits = match case.engines.is_empty() {
                true => "no answer".to_owned(),
                false => size(residual(case)),
            };
            Cell::number(residual(case), digits).bad_if(fails(case))
        };
        let units = |apart: f64| {
            let digits = if apart < 1e3 * ROUNDING { 2 } else { 3 };
            Cell::number(apart, number(apart / ROUNDING, digits))
        };
        let at = |case: &'a CaseOutcome| {
            let most = most(case).filter(|_| fails(case));
            let at = most.and_then(|e| e.residual_at.as_ref());
            at.map_or("nowhere".into(), |x| place(x))
        };
        let difference = |case: &CaseOutcome| match case.pairs.is_empty() {
            true => Cell::from("–"),
            false => Cell::size(apart(case)),
        };
        let mut column = Column::of_dots("", &self.axis);
        column.more = Html::from([key(self.names.iter().copied()), column.more]);
        let rows = cases.iter().copied();
        let table_of = model::table!("", rows, |case|
            ("w", "scene") => name(case),
            ("", "method") => &case.method,
            ("n", "n") => case.n.filter(|_| has_n).map(|n| Cell::number(n as f64, n)),
            ("n opt", "unknowns") => case.dofs,
            ("n opt", "contact faces") => (!agree).then_some(case.contact_faces),
            column => dots(case),
            ("n", "residual") => digits(case),
            ("n", "difference") => agree.then(|| units(apart(case))),
            ("w opt", "most at") => (!agree).then(|| at(case)),
            ("n opt", "largest |a − b|") => (!agree).then(|| difference(case)),
            ("w opt", "verdict") => (!agree).then_some(case.verdict),
        );
        table(&table_of.setting_off(cases.iter().map(|_| false)).known())
    }
}

/// The larger, with NaN above all.
fn worse(a: f64, b: f64) -> f64 {
    match a.is_nan() || b.is_nan() {
        true => f64::INFINITY,
        false => a.max(b),
    }
}

/// Every field of every pair of a case.
pub(in crate::report) fn fields(case: &CaseOutcome) -> Table {
    let given = |f: &FieldVerdict| {
        let conditioned = f.conditioned.map(|c| format!(", conditioned {}", size(c)));
        let words = size(f.tolerance) + &conditioned.unwrap_or_default();
        Cell::number(f.tolerance, words)
    };
    let value = |f: &FieldVerdict, of: fn(&Worst) -> f64| {
        let worst = f.worst.as_ref();
        worst.map(|w| Cell::number(of(w), number(of(w), 4)))
    };
    let pairs = pairs(case);
    let rows = pairs.iter();
    let rows = rows.flat_map(|pair| pair.fields.iter().map(move |f| (pair, *f)));
    model::table!("", rows, |(pair, f)|
        ("w", "pair") => pair.name(),
        ("w", "field") => &f.field,
        ("n", "max |a − b|") => Cell::size(f.max_abs),
        ("n", "relative") => Cell::size(f.max_rel),
        ("n", "tolerance") => given(f),
        ("n opt page", "rms") => Cell::size(f.rms),
        ("n opt page", "faces") => f.faces,
        ("w", "worst face") => worst(f),
        ("n page", "a there") => value(f, |w| w.a),
        ("n page", "b there") => value(f, |w| w.b),
        ("", "verdict") => f.verdict,
        ("", "rests on") => rests_on(f, "faces"),
    )
    .known()
}

/// The statement of a case: everything that its answers depend on.
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
    let rules = discretisation.rules(mesh.dim).ok();
    let rules =
        rules.map(|[cell, face]| text!("{cell.name} for the load, {face.name} on Γ_C and Γ_N"));
    let stop = text!(
        "relative broken H¹ norm of the increment at most {}, or {settings.stop.max_iterations} steps",
        Number::power(settings.stop.increment)
    );
    let known = [
        ("codes", Some(versions(case).into())),
        (
            "mesh",
            Some(text!("{}; digest `{case.mesh_digest}`", sizes(case))),
        ),
        (
            "γ",
            Some(format!("{} h, {h}", discretisation.gamma0).into()),
        ),
        ("quadrature", rules),
        (
            "data",
            Some(text!("`f = {f}; g = {g}; ∂ₙu = {t}; ψ = {psi}`")),
        ),
        ("stopping rule", Some(stop)),
        ("start", Some(text!("u = 0, and g on Γ_D"))),
    ];
    let known = known.into_iter();
    let known = known.filter_map(|(name, fact): (&str, Option<Text>)| Some((name.into(), fact?)));
    let known: Vec<(Text, Text)> = known.collect();
    html! { h3 { "Provenance, " (case.label()) } (facts(&known)) }
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

/// A heading, and the subject of the text that follows.
pub(super) fn heading(words: impl Into<Text>, about: impl Into<Text>) -> Html {
    let about = about.into();
    html! { h2 { (words.into()) } @if !about.is_empty() { p { (about) } } }
}
