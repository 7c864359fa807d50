//! The report of `verify` on a face-off file: the user's codes on any problem.

use super::compare::{compared, norms};
use super::described::{open, why, worst};
use super::html;
use super::model::{
    Block, Cell, Report, Story, Suite, Table, TestCase, Todo, joined, sentence, table,
};
use super::orders::{orders_figure, over_n};
use super::spectra;
use super::sweep;
use super::symmetries;
use super::systems;
use crate::campaigns::face_off::{
    Diagnosis, FaceOffOutcome, OfField, OfForm, OfMeeting, OfNumber, OfOrder, OfPair, RowOfNumber,
    RunOf, short, worst as worst_time,
};
use crate::run::convergence::Found;
use crate::run::{Judged, Label, Same};
use crate::text::number::{number, size, whole};
use crate::text::{Number, Text, text};
use crate::why::InForm;
use faceoff_judge::{Norms, On, Verdict};
use faceoff_mesh::error::Result;

/// For coarser levels of one problem.
pub(super) const NOT_JUDGED: &str = "not judged";

/// The report of a face-off file.
///
/// # Errors
/// Only those of a broken installation.
pub fn face_off(of: &FaceOffOutcome) -> Result<Report<'_>> {
    let mut report = Report::judging("face-off", QUESTION, of.verdict, of)?;
    tell(of, &mut report);
    Ok(report)
}

pub(super) const QUESTION: &str = "faceoff verify: do these codes agree?";

/// Fills the report of one.
pub(super) fn tell<'a>(of: &'a FaceOffOutcome, report: &mut Report<'a>) {
    let mut rest: Vec<Block> = of.sweep.iter().flat_map(sweep::blocks).collect();
    for field in &of.fields {
        let shown = worst_times(field);
        let more = times_words(field);
        let words = text!("Differences of `{field.field}`{more}");
        // One code has none.
        if !shown.is_empty() {
            rest.push(Block::Titled(words, pairs_table(field, &shown)));
        }
        if shown.len() < field.pairs.len() {
            let all: Vec<&OfPair> = field.pairs.iter().collect();
            let caption = text!("All times of `{field.field}`");
            let folded = Block::folded(caption, "", vec![pairs_table(field, &all).into()]);
            rest.push(Block::Page(vec![folded]));
        }
        if !field.meetings.is_empty() {
            let words = text!("What codes converge to in `{field.field}`");
            rest.push(Block::Titled(words, meetings_table(&field.meetings)));
        }
        if !field.orders.is_empty() {
            let times = field
                .errors_of
                .map(|times| format!(", of errors at {times}"));
            let words = text!("Observed orders of `{field.field}`{times}");
            rest.push(Block::Titled(words, orders_table(field)));
            let figures = Block::drawn(move || order_figures(field));
            rest.push(Block::Page(vec![figures]));
        }
    }
    rest.extend(of.numbers.iter().map(|number| {
        let exact = number.exact.map(|x| text!(", exact {}", Number::exact(x)));
        let words = text!("`{number.number}`{exact}");
        Block::Titled(words, number_table(number))
    }));
    for number in of.numbers.iter().filter(|of| !of.extrapolated.is_empty()) {
        let words = text!("What `{number.number}` converges to");
        rest.push(Block::Titled(words, extrapolated_table(number)));
        rest.push(meetings_table(&number.meetings).into());
    }
    rest.extend(of.spectra.iter().flat_map(spectra::blocks));
    if let Some(first) = of.in_form.first() {
        let words = text!("The results in the form{}", first.level.at());
        rest.push(Block::Titled(words, in_form_table(&of.in_form)));
    }
    if !of.systems.is_empty() {
        rest.push(Block::Titled(
            "The linear systems".into(),
            systems::pairs(&of.systems),
        ));
        rest.push(Block::Page(vec![systems::blocks(&of.systems).into()]));
    }
    rest.extend(of.diagnosis.iter().map(|of| moved_table(of).into()));
    rest.extend(of.symmetries.iter().map(symmetries::table));
    rest.push(Block::Titled("Runs".into(), runs_table(&of.runs)));
    // The map of the pair that is farthest from agreement.
    let picture = of.shown.iter().filter_map(|(comparison, of_a)| {
        let shown = comparison.fields.iter().find(|f| f.on != On::Domain)?;
        Some(compared(comparison, of_a, shown))
    });
    // Differences in the equations are the cause of those in the fields.
    let picture: Vec<Block> = match systems::picture(&of.systems) {
        Some(first) => {
            rest.extend(picture.map(|map| Block::Page(vec![map])));
            vec![first]
        }
        None => picture.collect(),
    };
    let claim = claim(of);
    report.story = Story {
        claim: match &of.sweep {
            Some(along) => sweep::claim(along, &claim),
            None => claim,
        },
        rests_on: lede(of),
        picture,
        next: next(of),
        rest,
    };
    if of.at_once > 1 && of.runs.iter().any(|run| run.seconds.is_some()) {
        report.notes.push(text!(
            "Up to {} codes ran at the same time, so that each may have taken longer than it does by itself.",
            whole(of.at_once)
        ));
    }
    report.notes.extend(of.shown.as_ref().map(|(shown, _)| {
        let (a, b) = (&shown.a, &shown.b);
        text!("On the map a is `{a}` and b is `{b}`.")
    }));
    report.suites = vec![Suite::new(&of.name, cases(of))];
}

/// With its time.
fn place(pair: &OfPair) -> String {
    let time = pair.t.map(|t| format!(", t = {}", short(t)));
    pair.level.at() + &time.unwrap_or_default()
}

/// For each pair of codes and each level, the time at which they are farthest from agreement.
fn worst_times(of: &OfField) -> Vec<&OfPair> {
    let key = |pair: &'_ OfPair| (pair.a.clone(), pair.b.clone(), pair.level.clone());
    let groups = of.pairs.chunk_by(|p, q| key(p) == key(q));
    groups.filter_map(worst_time).collect()
}

/// The times that are judged, if they are not all.
fn times_words(of: &OfField) -> String {
    match &of.times {
        Judged::All => String::new(),
        Judged::Last => ": only the last time of each result is judged".to_owned(),
        Judged::At(list) => {
            let list = list.iter().map(|t| short(*t).to_string());
            format!(": only these times are judged: {}", joined(list, ", "))
        }
    }
}

/// What fails first: a code, a field, an order, a number.
pub(super) fn claim(of: &FaceOffOutcome) -> Text {
    if let Some(run) = of.runs.iter().find(|run| run.failure.is_some()) {
        return text!("**{run.code}** gave no result{}", run.level.at());
    }
    if let Some(differing) = of.systems.iter().find(|of| of.verdict == Verdict::Disagree) {
        return systems::claim(differing);
    }
    let odd = unsolved(of).or_else(|| of.fields.iter().find_map(OfField::odd_one));
    if let Some(odd) = odd {
        return odd;
    }
    // A code whose order is wrong while another's is right comes before the differences that follow from it.
    if let Some(order) = odd_order(of) {
        let (observed, limited) = (observed(order), limited(order));
        return text!("`{order.found.field}` of **{order.of}** {observed}{limited}");
    }
    let fields = of.fields.iter().filter(|f| !f.verdict.passes());
    let numbers = of.numbers.iter().filter(|n| !n.verdict.passes());
    let spectra = of.spectra.iter().filter(|of| !of.verdict.passes());
    if let Some(words) = spectra.clone().find_map(spectra::claim) {
        return words;
    }
    let spectra = spectra.map(|of| &*of.spectrum);
    let wrong = fields.map(|f| &*f.field).chain(numbers.map(|n| &*n.number));
    let wrong = wrong.chain(spectra);
    let wrong: Vec<&str> = wrong.collect();
    let low = orders_of(of).find(|o| o.verdict == Some(Verdict::Disagree));
    let moved = of.symmetries.as_ref().and_then(symmetries::claim);
    match (&wrong[..], low) {
        ([], _) if moved.is_some() => moved.unwrap_or_default(),
        ([], _) => {
            let mut codes: Vec<&str> = of.runs.iter().map(|run| &*run.code).collect();
            codes.sort_unstable();
            codes.dedup();
            text!(
                "{} **{}** on {of.name}",
                codes.join(", "),
                of.verdict.word()
            )
        }
        ([_], Some(order)) if !has_differing_pair(of) => {
            text!(
                "**{order.found.field}** {}{}",
                observed(order),
                limited(order)
            )
        }
        (all, _) if is_untold(of) => {
            let mut adds = meetings(of).filter_map(|(_, of)| of.found.add.as_ref());
            let add = adds.next().map(|add| text!("; add {add}"));
            text!(
                "**{}** cannot be shown to converge on these meshes{add}",
                all.join(", ")
            )
        }
        (all, _) => {
            let does = match (of.verdict, all.len()) {
                (Verdict::Undetermined, _) => "cannot be judged",
                (_, 1) => "differs",
                _ => "differ",
            };
            text!("**{}** {does}", all.join(", "))
        }
    }
}

/// The codes whose results do not solve the form, with the first one's cause.
fn unsolved(of: &FaceOffOutcome) -> Option<Text> {
    let all = of.in_form.iter();
    let wrong = all.filter_map(|of| Some((&*of.code, of.wrong()?)));
    let (codes, found): (Vec<&str>, Vec<&InForm>) = wrong.unzip();
    let does = if codes.len() == 1 { "does" } else { "do" };
    let first = found.first()?;
    let cause = match first.cause() {
        Some(words) => text!(", but as if {words}"),
        None => text!(": {first.sentence}"),
    };
    Some(text!(
        "**{}** {does} not solve the form{cause}",
        codes.join(", ")
    ))
}

fn orders_of(of: &FaceOffOutcome) -> impl Iterator<Item = &OfOrder> {
    of.fields.iter().flat_map(|f| &f.orders)
}

fn has_differing_pair(of: &FaceOffOutcome) -> bool {
    let mut pairs = of.fields.iter().flat_map(|f| &f.pairs);
    pairs.any(|p| p.judged && p.compared.field.verdict == Verdict::Disagree)
}

/// The order of a code that is too low, if that of another code is right in the same field.
fn odd_order(of: &FaceOffOutcome) -> Option<&OfOrder> {
    let has_right = |f: &&OfField| {
        let mut orders = f.orders.iter();
        orders.any(|o| o.verdict == Some(Verdict::Agree))
    };
    let mut orders = of.fields.iter().filter(has_right).flat_map(|f| &f.orders);
    orders.find(|o| o.verdict == Some(Verdict::Disagree))
}

/// The limits of each pair of codes, with the name of the field or number.
fn meetings(of: &FaceOffOutcome) -> impl Iterator<Item = (&str, &OfMeeting)> {
    let fields = of.fields.iter().map(|f| (&*f.field, &f.meetings));
    let numbers = of.numbers.iter().map(|n| (&*n.number, &n.meetings));
    let all = fields.chain(numbers);
    all.flat_map(|(name, all)| all.iter().map(move |of| (name, of)))
}

/// The observation for an order that is too low, or for a difference that does not fall to 0.
fn observed(of: &OfOrder) -> Text {
    let limits = ["L²", "H¹"].into_iter().zip(of.limits);
    let apart = limits.filter_map(|(norm, limit)| {
        let limit = limit.filter(|limit| limit.found == Found::Apart)?;
        Some(text!("{} in {norm}", limit.words()))
    });
    Text::joined(low(of).into_iter().chain(apart), " and ")
}

/// The factor that limits an order, to follow the observation.
fn limited(of: &OfOrder) -> Option<Text> {
    let found = of.found.limiting.as_ref()?;
    Some(text!(": {}", found.words()))
}

/// The norms whose order is too low; if the limit is known not to be 0, the order means less.
fn low(of: &OfOrder) -> Option<Text> {
    let orders = [Some(&of.found.l2), of.found.h1.as_ref()];
    let told = (0..2).filter_map(|k| {
        let is_apart = of.limits[k].is_some_and(|limit| limit.found == Found::Apart);
        let is_low = of.verdicts[k] == Some(Verdict::Disagree) && !is_apart;
        let (fit, theory) = (orders[k]?.fit?.exponent, of.theory[k]?);
        let norm = ["L²", "H¹"][k];
        is_low.then(|| {
            text!(
                "{} in {norm} instead of {}",
                number(fit, 3),
                theory.to_string()
            )
        })
    });
    let told: Vec<Text> = told.collect();
    let axis = match &*of.axis {
        "h" => Text::default(),
        other => text!(" in {other}"),
    };
    (!told.is_empty()).then(|| text!("has order {}{axis}", Text::joined(told, " and ")))
}

fn lede(of: &FaceOffOutcome) -> Text {
    let message = |words: &String| Text::message(&sentence(words));
    let mut told: Vec<Text> = Vec::new();
    told.extend((!of.about.is_empty()).then(|| message(&of.about)));
    told.extend(of.systems.iter().map(systems::told));
    told.extend(of.sweep.iter().map(sweep::words));
    let failures = of.runs.iter().filter_map(|run| run.failure.as_ref());
    told.extend(failures.take(1).map(message));
    if let Some((field, pair)) = farthest(of) {
        let (found, name, at) = (&pair.compared.field, &field.field, place(pair));
        let size = size(found.max_rel);
        told.push(match (&found.reason, found.verdict.passes()) {
            (Some(reason), _) => {
                text!("`{name}`, {pair.a} – {pair.b}{at}: {reason}.")
            }
            (None, true) => text!("The largest difference is **{size}** of its field, in `{name}`, {pair.a} – {pair.b}{at}."),
            (None, false) => text!("`{name}` of {pair.a} and {pair.b} differs by **{size}** of it{at}, {} times what is allowed.", number(pair.compared.factor(), 2)),
        });
    }
    told.extend(of.fields.iter().filter_map(|field| {
        let all = field.pairs.iter().filter(|pair| pair.judged);
        let mut known =
            all.filter_map(|pair| Some((pair, open(&pair.compared, [&pair.a, &pair.b])?)));
        // The last level is the finest.
        let (pair, words) = known.next_back()?;
        let name = &field.field;
        Some(text!(
            "`{name}` of {pair.a} and {pair.b}{}: {words}.",
            place(pair)
        ))
    }));
    let wrong = of.in_form.iter();
    let wrong = wrong.filter_map(|of| Some((of, &of.wrong()?.sentence)));
    told.extend(wrong.map(|(of, words)| text!("`{of.code}`{}: {words}.", of.level.at())));
    told.extend(of.spectra.iter().flat_map(spectra::words));
    told.extend(orders_of(of).filter_map(order_words));
    told.extend(meetings(of).map(|(name, of)| text!("`{name}`: {}.", of.words())));
    told.extend(of.missing.iter().map(|of| message(&of.message)));
    let findings = of.diagnosis.iter().flat_map(|d| &d.findings);
    let of_images = of.symmetries.iter().flat_map(|of| &of.findings);
    told.extend(findings.chain(of_images).map(|finding| text!("{finding}.")));
    Text::joined(told, " ")
}

/// The pair of codes with the largest difference relative to its tolerance.
pub(super) fn farthest(of: &FaceOffOutcome) -> Option<(&OfField, &OfPair)> {
    let judged = of.fields.iter().filter_map(|field| {
        let judged = field.pairs.iter().filter(|pair| pair.judged);
        Some((field, worst_time(judged)?))
    });
    judged.max_by(|(_, p), (_, q)| {
        let key = |p: &OfPair| (p.compared.field.verdict, p.compared.factor());
        let ((v, x), (w, y)) = (key(p), key(q));
        v.cmp(&w).then(x.total_cmp(&y))
    })
}

/// Is the only open question the limit, which the orders do not decide?
fn is_untold(of: &FaceOffOutcome) -> bool {
    let mut pairs = of.fields.iter().flat_map(|f| &f.pairs);
    of.verdict == Verdict::Undetermined
        && (orders_of(of).any(|order| order.verdict == Some(Verdict::Undetermined))
            || meetings(of).any(|(_, of)| of.verdict == Verdict::Undetermined))
        && pairs.all(|pair| pair.compared.field.reason.is_none())
}

/// The fault of an order, and the remaining limit.
fn order_words(of: &OfOrder) -> Option<Text> {
    let limits = ["L²", "H¹"].into_iter().zip(of.limits);
    let limits = limits.filter_map(|(norm, limit)| {
        let limit = limit.filter(|limit| limit.found != Found::Zero)?;
        let what = match of.found.against {
            "code" => "difference",
            _ => "error",
        };
        let (field, words) = (&of.found.field, limit.words());
        Some(text!(
            "The {what} in `{field}` of {of.of} in {norm} {words}."
        ))
    });
    let low = low(of).map(|low| text!("`{of.found.field}` of {of.of} {low}."));
    let limiting = of.found.limiting.as_ref();
    let limiting = limiting.map(|found| text!("In {of.of} {}.", found.words()));
    let all = Text::joined(low.into_iter().chain(limits).chain(limiting), " ");
    Some(all).filter(|all| !all.is_empty())
}

/// Suggestions for what fails.
fn next(of: &FaceOffOutcome) -> Vec<Todo> {
    let mut steps = Vec::new();
    if of.verdict.passes() {
        return steps;
    }
    steps.extend(of.sweep.as_ref().and_then(sweep::next));
    if of.runs.iter().any(|run| run.failure.is_some()) {
        steps.push(Todo::only("Keep the folders of the runs by --keep DIR; command.txt in each is what was typed, log.txt what it said."));
    }
    let mut pairs = of.fields.iter().flat_map(|f| &f.pairs);
    let is_wrong = |order: &&OfOrder| order.verdict == Some(Verdict::Disagree);
    let known = of.in_form.iter();
    let known = known.filter(|of| of.wrong().and_then(InForm::cause).is_some());
    let is_limited = |order: &OfOrder| order.found.limiting.is_some();
    if let Some(order) = orders_of(of)
        .find(is_wrong)
        .filter(|order| !is_limited(order))
    {
        let is_of_time = pairs.any(|p| p.t.is_some()) && odd_order(of).is_none();
        let is_constant = order.verdicts == [Some(Verdict::Disagree), Some(Verdict::Agree)];
        steps.push(Todo::only(match is_of_time && order.axis == "h" {
            true => "The error of the time step does not fall with the mesh: let the step fall with it, by a list under [parameters] as long as n, before looking for another cause.".into(),
            false if is_constant => text!("The gradient of `{order.found.field}` converges as it should and `{order.found.field}` itself does not: see first what fixes the constant in it, a value at a point or the mean, in the codes and in exact."),
            false => "Refine further to see whether the order rises, and take parts of the form, the data and the element away one by one, in each code whose order is low.".into(),
        }));
    } else if let Some(known) = known.clone().next() {
        let words = text!("Mend that in `{known.code}`, or in the form, and run this again.");
        steps.push(Todo::only(words));
    } else if let Some((field, up_to)) = equal_after(of) {
        steps.push(Todo::only(text!("Where the problem leaves that open, say so: `up_to = {up_to}` in [fields.{field}]. Where it does not, look for what fixes it in each code.")));
    } else if of.fields.iter().any(|f| f.verdict == Verdict::Disagree) {
        steps.push(Todo::only("Look where the difference enters: on a boundary it is a condition or a group, everywhere a coefficient, a sign or a quadrature rule."));
    }
    steps
}

/// The field that would be equal in all pairs that differ if the problem left something open, and the open part.
fn equal_after(of: &FaceOffOutcome) -> Option<(&str, String)> {
    let open = |pair: &OfPair| -> Vec<&'static str> {
        let all = pair.compared.equal_after.iter();
        all.map(|removed| removed.up_to.word()).collect()
    };
    of.fields.iter().find_map(|field| {
        let pairs = field.pairs.iter().filter(|pair| pair.judged);
        let mut wrong = pairs.filter(|pair| pair.compared.field.verdict == Verdict::Disagree);
        let first = open(wrong.next()?);
        let all = !first.is_empty() && wrong.all(|pair| open(pair) == first);
        let words = match &first[..] {
            [one] => format!("{one:?}"),
            all => format!("{all:?}"),
        };
        all.then_some((&*field.field, words))
    })
}

/// The number of a refinement, or the name of another level.
pub(super) fn level(of: &Label) -> Option<Cell> {
    match of {
        Label::Only => None,
        Label::Mesh(n) => Some(Cell::number(*n as f64, n.to_string())),
        Label::Named(name) => Some(name.into()),
    }
}

fn runs_table(runs: &[RunOf]) -> Table {
    let outcome = |run: &RunOf| run.failure.as_deref().map_or("done".into(), Text::message);
    table!("", runs, |run|
        "code" => &run.code,
        "n" => level(&run.level),
        "time" => run.seconds.map(super::model::duration),
        "outcome" => outcome(run),
    )
}

fn moved_table(of: &Diagnosis) -> Table {
    let n = of.n.map_or(String::new(), |n| format!(", n = {n}"));
    let caption = format!("What moves an answer{n}");
    table!(caption, &of.moved, |moved|
        "code" => &moved.code,
        "change" => moved.change.words(),
        "of" => &moved.of,
        "moved by" => moved.relative,
        "remark" => moved.reason.clone(),
    )
}

fn pairs_table(of: &OfField, pairs: &[&OfPair]) -> Table {
    let verdict = |pair: &OfPair| match pair.judged {
        true => Cell::from(pair.compared.field.verdict),
        false => NOT_JUDGED.into(),
    };
    let as_functions = |pair: &OfPair| {
        let is = of.same == Same::Discretisation && pair.compared.on == On::Functions;
        is.then(|| "as functions, since the files have other cells".to_owned())
    };
    let remark = |pair: &OfPair| {
        let reason = pair.compared.field.reason.clone();
        let open = open(&pair.compared, [&pair.a, &pair.b]);
        let told = joined([open, as_functions(pair)].into_iter().flatten(), "; ");
        reason.or(Some(told).filter(|told| !told.is_empty()))
    };
    table!("", pairs, |pair|
        "codes" => format!("{} – {}", pair.a, pair.b),
        "n" => level(&pair.level),
        "t" => pair.t.map(|t| Cell::number(t, short(t).to_string())),
        "max |a-b|" => pair.compared.field.max_abs,
        "relative" => pair.compared.field.max_rel,
        "allowed" => pair.compared.field.tolerance,
        "L2" => norms(&pair.compared)[0].clone(),
        "H1" => norms(&pair.compared)[1].clone(),
        "worst" => worst(&pair.compared.field),
        "verdict" => verdict(pair),
        "remark" => remark(pair),
    )
    .known()
}

/// The limits of each pair of codes.
fn meetings_table(all: &[OfMeeting]) -> Table {
    let order = |of: &OfMeeting, k: usize| {
        let order = of.found.courses[k].and_then(|course| course.order);
        order.map(|order| Cell::fixed(order, 2))
    };
    let part = |of: &OfMeeting, k: usize| {
        let away = of.found.courses[k].map(|course| course.away);
        away.map(|away| away / of.found.scale)
    };
    table!("", all, |of|
        "codes" => format!("{} – {}", of.a, of.b),
        "order of the first" => order(of, 0),
        "of the second" => order(of, 1),
        "first from its limit" => part(of, 0),
        "second from its limit" => part(of, 1),
        "limits apart, at most" => of.found.interval.map(|[_, high]| high / of.found.scale),
        "allowed" => of.found.bound / of.found.scale,
        "verdict" => of.verdict,
    )
}

/// Richardson's value of each code.
fn extrapolated_table(of: &OfNumber) -> Table {
    table!("", &of.extrapolated, |(code, found)|
        "code" => code,
        "limit" => text!("{}", Number::new(found.value, 8)),
        "±" => found.room,
        "order" => found.order.map(|order| Cell::fixed(order, 2)),
    )
}

/// The residual of each code's result in the form.
fn in_form_table(all: &[OfForm]) -> Table {
    table!("", all, |of|
        "code" => &of.code,
        "verdict" => of.found.as_ref().map_or(Verdict::Undetermined, |found| found.verdict),
        "residual" => of.found.as_ref().map(|found| found.residual),
        "found" => match (&of.found, &of.refused) {
            (Some(found), _) => match found.cause() {
                Some(cause) => text!("as if {cause}"),
                None => found.sentence.clone(),
            },
            (None, refused) => Text::message(refused.as_deref().unwrap_or_default()),
        },
    )
}

fn orders_table(of: &OfField) -> Table {
    let rows = of.orders.iter().flat_map(|order| {
        let h1 = order.found.h1.as_ref().map(|h1| (order, "H¹", 1, h1));
        [(order, "L²", 0, &order.found.l2)].into_iter().chain(h1)
    });
    let limit = |order: &OfOrder, k: usize| order.limits[k].map(|limit| limit.words());
    table!("", rows, |(order, norm, k, found)|
        "of" => &order.of,
        "norm" => norm,
        "against" => order.found.against,
        "in" => &order.axis,
        "between levels" => joined(found.steps.iter().map(|o| format!("{o:.2}")), " "),
        "fit" => found.fit.map(|fit| Cell::fixed(fit.exponent, 2)),
        "theory" => order.theory[k].map(|theory| number(theory, 2)),
        "verdict" => order.verdicts[k],
        "limit" => limit(order, k),
    )
}

/// Errors, or differences of codes, by n.
fn order_figures(of: &OfField) -> html::Html {
    type Pick = fn(&Norms) -> Option<f64>;
    let panel = |norm: &str, k: usize, pick: Pick| {
        let line = |order: &OfOrder| {
            let levels = order.n.iter().zip(&order.found.levels);
            let errors = levels.filter_map(|(n, l)| Some([(*n)? as f64, pick(l.norms.as_ref()?)?]));
            let found = [Some(&order.found.l2), order.found.h1.as_ref()][k];
            let fit = found.and_then(|o| o.fit).map(|fit| fit.exponent);
            (order.of.clone(), errors.collect(), fit)
        };
        let theories = of.orders.iter().filter_map(|order| order.theory[k]);
        over_n(norm, of.orders.iter().map(line), theories)
    };
    let mut panels = vec![panel("L²", 0, |n| Some(n.l2)), panel("H¹", 1, |n| n.h1)];
    panels.retain(|panel| !panel.is_empty());
    let caption = text!("**{of.field}** by n, with the order that fits");
    let widest = if panels.len() > 1 {
        html::WIDEST
    } else {
        535.0
    };
    orders_figure(caption, panels, widest)
}

fn number_table(of: &OfNumber) -> Table {
    let values = |row: &RowOfNumber| {
        let of = |(code, value): (&String, &f64)| text!("{code} {}", Number::new(*value, 13));
        Text::joined(row.values.iter().map(of), ", ")
    };
    let verdict = |row: &RowOfNumber| match row.judged {
        true => Cell::from(row.verdict),
        false => NOT_JUDGED.into(),
    };
    table!("", &of.rows, |row|
        "n" => level(&row.level),
        "values" => values(row),
        "verdict" => verdict(row),
        "remark" => &row.reason,
    )
}

/// A case for every pair, order and number, and for every code that failed.
fn cases(of: &FaceOffOutcome) -> Vec<TestCase> {
    let test = |name, verdict, why| TestCase::new(&of.name, name, verdict, why);
    let failed = of.runs.iter().filter_map(|run| {
        let name = format!("run of {}{}", run.code, run.level.at());
        Some((name, run.failure.clone()?))
    });
    let missing = of.missing.iter();
    let missing = missing.map(|of| (format!("run of {}", of.engine), of.message.clone()));
    let silent = failed.chain(missing);
    let along = of.sweep.iter();
    let mut cases: Vec<TestCase> = along
        .flat_map(|along| sweep::cases(&of.name, along))
        .chain(silent.map(|(name, why)| test(name, Verdict::Undetermined, why)))
        .chain(
            of.symmetries
                .iter()
                .flat_map(|found| symmetries::cases(&of.name, found)),
        )
        .collect();
    for field in &of.fields {
        let judged = worst_times(field).into_iter().filter(|pair| pair.judged);
        cases.extend(judged.map(|pair| {
            let found = &pair.compared.field;
            let at = pair.level.at();
            let name = format!("{}, {} – {}{at}", field.field, pair.a, pair.b);
            let time = pair.t.map(|t| format!("t = {}: ", short(t)));
            let why = match why(found) {
                why if why.is_empty() => why,
                why => time.unwrap_or_default() + &why,
            };
            test(name, found.verdict, why)
        }));
        cases.extend(field.orders.iter().filter_map(|order| {
            let name = format!("order of {}, {}", field.field, order.of);
            let why = order_words(order).unwrap_or_default().to_string();
            Some(test(name, order.verdict?, why))
        }));
    }
    cases.extend(meetings(of).map(|(name, of)| {
        let why = if of.verdict.passes() {
            String::new()
        } else {
            of.words().to_string()
        };
        test(
            format!("limit of {name}, {} – {}", of.a, of.b),
            of.verdict,
            why,
        )
    }));
    cases.extend(
        of.spectra
            .iter()
            .flat_map(|spectrum| spectra::cases(&of.name, spectrum)),
    );
    for number in &of.numbers {
        let judged = number.rows.iter().filter(|row| row.judged);
        cases.extend(judged.map(|row| {
            let name = format!("{}{}", number.number, row.level.at());
            test(name, row.verdict, row.reason.clone())
        }));
    }
    cases.extend(of.systems.iter().map(|of| {
        let name = format!("systems of {} – {}{}", of.a, of.b, of.level.at());
        let why = if of.verdict.passes() {
            String::new()
        } else {
            systems::told(of).to_string()
        };
        test(name, of.verdict, why)
    }));
    cases
}
