//! The page of `verify`: one screen if all agree, else the cause, its effect, and the evidence.

use super::along::{Along, Named};
use super::codes::{Codes, fields, heading, posed};
use super::convergence::newton;
use super::effect::Effect;
use super::in_thirds;
use super::markup::{Html, folded, html};
use super::pair::{self, pairs};
use super::residual::{Put, by_term, cause};
use super::spread::Spread;
use super::tables::{table, word};
use crate::campaigns::verify::{CaseOutcome, EngineOutcome, VerifyOutcome};
use crate::report::findings::{terms, tried, worst};
use crate::report::model::{self, Table};
use crate::text::number::{place, size, whole};
use crate::text::text;
use crate::why::Diagnosis;
use faceoff_mesh::error::Result;

/// A run, and the findings when codes ran again.
#[derive(Clone, Copy)]
pub(in crate::report) struct Run<'a> {
    pub outcome: &'a VerifyOutcome,
    pub diagnoses: &'a [Diagnosis],
}

impl<'a> Run<'a> {
    /// The case that is shown in detail.
    fn shown(&self) -> Option<(&'a CaseOutcome, Option<&'a EngineOutcome>)> {
        let of = self
            .outcome
            .culprit()
            .map(|(case, engine)| (case, Some(engine)));
        of.or_else(|| self.outcome.differing().map(|case| (case, None)))
    }

    /// The picture at the top.
    ///
    /// # Errors
    /// Faces that cannot be matched.
    pub fn hero(self) -> Result<Html> {
        match self.shown() {
            Some((case, Some(engine))) => {
                let of = case.setup.case()?;
                let put = Put::new(
                    &engine.engine,
                    &of.problem,
                    &engine.answer.u,
                    engine.findings.as_ref(),
                );
                Ok(cause(&put, &case.label()))
            }
            Some((case, None)) => effect(case, None, &[]),
            // Those that answered.
            None if self.outcome.cases.iter().any(|c| !c.pairs.is_empty()) => {
                Ok(Spread::new(self.outcome)?.figure())
            }
            None => Ok(Html::default()),
        }
    }

    /// Everything below.
    ///
    /// # Errors
    /// Faces that cannot be matched.
    pub fn details(self) -> Result<Html> {
        let outcome = self.outcome;
        let fault = outcome.at_fault();
        let codes = Codes::new(outcome, &fault);
        let Some((case, engine)) = self.shown() else {
            let about = "What the codes that answered make of it; left of the dashed line, the tolerance, is rounding.";
            return Ok(html! {
                @if !codes.names.is_empty() {
                    (heading("One row per code", about)) (codes.by_code())
                    (heading("One row per case", "")) (codes.by_case(None))
                }
                (self.folds(None))
            });
        };
        let of = case.setup.case()?;
        let put =
            |e: &'a EngineOutcome, found| Put::new(&e.engine, &of.problem, &e.answer.u, found);
        let right = case.engines.iter().filter(|e| !fault.contains(&&*e.engine));
        let mut puts: Vec<Put> = right.map(|e| put(e, None)).collect();
        puts.extend(engine.map(|e| put(e, e.findings.as_ref())));
        let along = Along {
            problem: &of.problem,
            fields: &case.fields,
            puts: &puts,
            differences: differences(case, &fault)?,
            tolerance: case.pairs.first().map_or(1e-12, |p| p.field.tolerance),
            faulty: fault.clone(),
        };
        let (drawn, label) = (along.figure(), case.label());
        let found = engine.and_then(|e| e.findings.as_ref());
        let found = found.filter(|found| !found.explanations.is_empty());
        let culprit = engine.and(puts.last()).map(|put| (put, label.as_str()));
        let pairs = pairs(case);
        let diagnoses = pairs.iter();
        let diagnoses = diagnoses.flat_map(|pair| pair.diagnoses(case, self.diagnoses));
        let put_back = "Each answer is put back into the scheme. Left of the dashed line, the tolerance, is rounding.";
        let in_cases = agreeing(outcome, &fault);
        let in_cases = format!("The largest residual of each case, and where.{in_cases}");
        let tries = "One thing put into the scheme in its place at a time, and the residual that is left with it.";
        Ok(html! {
            (heading("One row per code", put_back)) (codes.by_code())
            @if outcome.cases.len() > 1 {
                (heading("One row per case", in_cases)) (codes.by_case(Some(case)))
            }
            @if !drawn.is_empty() { (heading(text!("Along Γ_C"), format!("{label}. {}", contact(case)))) (drawn) }
            @if engine.is_some() { (effect(case, engine, &fault)?) }
            @if let Some(found) = found {
                (heading("What was tried", tries)) (super::blocks(&tried(&found.explanations, found.limit))?)
            }
            @for of in diagnoses { (heading(format!("{} – {} again", of.a, of.b), of.sentence())) (table(&again(of))) }
            (self.folds(culprit))
        })
    }

    /// The rows of the case that is shown, and its fields.
    fn folds(&self, put: Option<(&Put, &str)>) -> Html {
        let found = put.and_then(|(put, about)| Some((put, about, put.findings?)));
        let found = found.filter(|(_, _, found)| !found.worst.is_empty());
        let case = self.shown().filter(|_| self.outcome.cases.len() > 1);
        let rows = "the rows that are farthest off, and what they are made of";
        html! {
            .folds {
                @if let Some((put, about, found)) = found {
                    (folded(
                        html! { "Rows and terms " span { "· " (rows) "; " (about) } },
                        Html::from([by_term(put, about), table(&worst(&found.worst)), table(&terms(&found.terms))]),
                    ))
                }
                @if let Some((case, _)) = case { (folded(summary(case), Html::from([table(&fields(case)), posed(case)]))) }
            }
        }
    }

    /// Every pair and field of all cases, and the statement of the cases.
    pub fn rest(self) -> Html {
        html! { @for case in &self.outcome.cases { h3 { (summary(case)) } (table(&fields(case))) (posed(case)) } }
    }
}

/// Which cases agree although a code is at fault elsewhere.
fn agreeing(outcome: &VerifyOutcome, fault: &[&str]) -> String {
    let of = outcome.cases.iter().filter(|c| c.verdict.passes());
    let names: Vec<String> = of.map(CaseOutcome::label).collect();
    match &names[..] {
        some @ [_, ..] if !fault.is_empty() && some.len() <= 3 => {
            format!(" In {} what is wrong has no say.", some.join(" and "))
        }
        _ => String::new(),
    }
}

/// Do all codes have the same contact set?
fn contact(case: &CaseOutcome) -> String {
    let status = case.pairs.iter().filter(|p| p.field.field == "status");
    let flips: usize = status
        .clone()
        .filter_map(|p| p.field.flips)
        .max()
        .unwrap_or(0);
    match (flips, status.count()) {
        (_, 0) => String::new(),
        (0, _) => "All codes have the same contact set.".into(),
        (flips, _) => format!(
            "The contact status differs at up to {} quadrature points.",
            whole(flips)
        ),
    }
}

/// Means that differ, with the most important pair last, after one of the right ones.
fn differences(case: &CaseOutcome, fault: &[&str]) -> Result<Vec<Named>> {
    let all = pairs(case);
    let is_faulty = |p: &&pair::Pair| fault.iter().any(|name| p.has(name));
    let right = all.iter().find(|p| !is_faulty(p));
    let wrong = all.iter().find(is_faulty);
    let of = |p: &pair::Pair| -> Result<_> { Ok((p.difference(), p.differences(case, "mean")?)) };
    right.into_iter().chain(wrong).map(of).collect()
}

/// The effect of a difference.
fn effect(case: &CaseOutcome, engine: Option<&EngineOutcome>, fault: &[&str]) -> Result<Html> {
    let all = pairs(case);
    let wanted = |p: &&pair::Pair| engine.is_none_or(|e| p.has(&e.engine));
    let beside = case.reference(fault).map_or("", |e| &*e.engine);
    let with_right = |p: &&pair::Pair| wanted(p) && p.has(beside);
    let farthest = all.iter().filter(wanted);
    let farthest = farthest.max_by(|p, q| p.largest().total_cmp(&q.largest()));
    let pair = match engine {
        Some(_) => all.iter().find(with_right).or(farthest),
        None => farthest,
    };
    let Some((pair, field)) = pair.and_then(|pair| Some((pair, pair.worst()?))) else {
        return Ok(Html::default());
    };
    let of = case.setup.case()?;
    let (values, name) = (pair.differences(case, "mean")?, pair.difference());
    let shown = Effect {
        problem: &of.problem,
        values: &values,
        tolerance: field.tolerance,
        name: &name,
    };
    let about = case.label();
    let spot = engine.and_then(|e| e.findings.as_ref()?.worst.first());
    let spot = spot.map(|spot| &spot.midpoint);
    let spot = spot.or(field.worst.as_ref().map(|worst| &worst.midpoint));
    let (from, at) = match spot {
        Some(spot) => (point(spot), place(spot)),
        None => ([0.0; 3], "the origin".to_owned()),
    };
    let mut others = all.iter().filter(|p| !std::ptr::eq(*p, pair));
    let others = others.find(|p| engine.is_some_and(|e| !p.has(&e.engine)));
    let others = others.map(|others| others.differences(case, "mean"));
    let others = others.transpose()?.unwrap_or_default();
    let engines = case.engines.iter();
    let increments: Vec<_> = engines.map(|e| (&*e.engine, &*e.increments)).collect();
    let faulty: Vec<&str> = engine.iter().map(|e| &*e.engine).collect();
    let all_stop = case.engines.iter().all(|e| e.converged);
    let why = all_stop.then_some(": all converge, so that stopping is not the cause");
    let caption = text!("**Newton.** Increment by step{why}");
    let stop = case.setup.settings.stop.increment;
    let newton = newton(&increments, &faulty, Some(stop), caption);
    let all = [shown.map(&about), shown.decay(from, &at, &others), newton];
    let pictures = in_thirds(all);
    if engine.is_none() {
        return Ok(pictures);
    }
    let beyond = match field.beyond {
        0 => text!("No face differs beyond the tolerance in `{field.field}`."),
        some => text!(
            "A fault in few rows spreads: {} of {} faces differ beyond the tolerance, by up to {} of max |u|; the map does not show where to look.",
            whole(some),
            whole(field.faces),
            size(field.max_rel)
        ),
    };
    Ok(html! { (heading("What it does to the answer", beyond)) (pictures) })
}

fn point(x: &[f64]) -> [f64; 3] {
    std::array::from_fn(|k| x.get(k).copied().unwrap_or(0.0))
}

fn again(of: &Diagnosis) -> Table {
    let caption = format!(
        "One ingredient matched at a time; the difference to begin with is {} of max|u|",
        size(of.difference)
    );
    model::table!(caption, &of.ingredients, |i|
        "ingredient" => i.change.of(),
        "matched" => &i.matched,
        "difference left" => i.left,
        "found" => if i.accounts { "accounts for it" } else { "does not" },
    )
}

/// `one-zone, cr, n = 16 · disagree, 1.4 · 10⁻⁶ of max |u|`
fn summary(case: &CaseOutcome) -> Html {
    let apart = pair::largest(case.pairs.iter().map(|p| &p.field));
    html! {
        (case.label())
        span {
            " · " (word(case.verdict)) ", "
            @if case.pairs.is_empty() { "no pair to compare" } @else { (size(apart)) " of max |u|" }
        }
    }
}
