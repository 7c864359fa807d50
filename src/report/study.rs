//! The report of the cost of accuracy.

mod figures;

use serde_json::json;

use super::html::{costs, percent_asked};
use super::json::csv;
use super::model::{Block, Cell, Report, Table, count, duration, percent, short, table};
use crate::campaigns::study::{
    Advice, Alternative, Gammas, HARMLESS, Norm, Rates, Row, Scaling, StudyOutcome, Varied, Waste,
    value,
};
use crate::engine::unique;
use crate::run::Fit;
use crate::text::number::number;
use crate::text::{Number, Text, text};
use faceoff_mesh::error::Result;

/// A longer table is folded.
const LONG: usize = 12;
const HOW: &str = "Times are medians over repetitions on a machine that may do other things as well, of mesh, assembly and solution, without \
    start-up; the least and the largest are in `rows.csv`. Errors are relative to the norms of u; where u is not known the error in \
    the energy norm is its guaranteed bound.";
const ADVICE: &str = "The fastest setting of each code that reaches the error, and the command of the fastest. Rust's commands were run unchanged in a \
    separate process: error, median of the times and peak memory are those of the process. Where the budget left no time for that, \
    \"within this process\" marks a solve of the study itself. To ask for a certified error instead, use `solve --accuracy`.";
const RATES: &str = "Errors as h^p over the finest three meshes, time and memory as dofs^p over the finest four; after ± the standard error of the fit. \
    Growth of time and memory is told where its interval of 95 % leaves out 0, and anything that would follow from it likewise.";
const SCALING: &str = "By the exponents above, taken as 1 where start-up still hides the rest, and as those of a factor in 3D where noise says \
    more. Dofs here: what this machine's memory holds, and the time that they would take. Ranks: weak scaling on paper, each rank with the \
    dofs of the finest mesh, work and memory shared evenly over a network that costs nothing: time as R^(p-1), memory of a rank as R^(q-1). \
    From and to dofs: the meshes that were measured. Half at: the ranks at which half of the time is lost, where the time was seen to grow \
    faster than the dofs. A factor tends to p = 3/2, q = 1 in 2D and to p = 2, q = 4/3 in 3D, multigrid to 1: \
    from the memory of this machine on, and in 3D well before it, iterations (`--linear iterative`, or dolfinx with `--ranks` and GMRES) are \
    what to change to.";
const WASTE: &str = "The cheapest value from which on no error is larger by 1 % than with the most exact one. A value takes longer where its fastest \
    repetition is slower than the slowest of the other.";
const GAMMAS: &str = "The paper's theory asks for γ = γ₀h with γ₀ large enough. Over 24 decades:";

/// The report of a study.
///
/// # Errors
/// Only those of a broken installation.
pub fn study(outcome: &StudyOutcome) -> Result<Report<'_>> {
    let question = "faceoff study: what does each digit cost?";
    let mut report = Report::new("study", question, "", outcome)?;
    report.engines = outcome.engines.clone();
    let scenes = unique(outcome.rows.iter().map(|row| &*row.scene));
    let about = match scenes[..] {
        [first, _, ..] => format!(" on {first}"),
        _ => String::new(),
    };
    report.story.claim = claim(&outcome.advice, &about)
        .or_else(|| least(outcome))
        .unwrap_or_else(|| "No error is known of what was measured".into());
    let left_out = match outcome.left_out.len() {
        0 => "nothing".to_owned(),
        some => count(some, "measurement"),
    };
    report.story.rests_on = text!(
        "{} of {}: {} of {} s were spent, {left_out} left out.",
        count(outcome.rows.len(), "measurement"),
        scenes.join(", "),
        number(outcome.spent, 2),
        number(outcome.budget, 2)
    );
    let first = scenes
        .first()
        .and_then(|scene| figures::work(outcome, scene));
    report.story.picture.extend(first.map(Block::Figure));
    report.notes.push(text!(HOW));
    for (k, scene) in scenes.into_iter().enumerate() {
        report.story.rest.extend(of_scene(outcome, scene, k == 0));
    }
    if !outcome.left_out.is_empty() {
        let left_out = outcome.left_out.iter();
        let left_out = left_out.map(|left| format!("{}: {}", left.what, left.why));
        let many = count(outcome.left_out.len(), "measurement");
        let folded = Block::folded("What was left out", many, vec![Block::list(left_out)]);
        report.story.rest.push(Block::Page(vec![folded]));
    }
    report.file("rows.csv", || rows_csv(&outcome.rows));
    Ok(report)
}

/// The least error that all codes reach, or else as many as possible, and its cost with each.
fn claim(advice: &[Advice], about: &str) -> Option<Text> {
    let first = &advice.first()?.scene;
    let mut energy = advice
        .iter()
        .filter(|a| a.scene == *first && a.norm == Norm::Energy);
    let codes = |a: &&Advice| a.others.len();
    let most = energy.clone().map(|a| codes(&a)).max()?;
    let of = energy.rfind(|a| codes(a) == most)?;
    let way = |a: &Alternative| match &*a.engine {
        crate::engine::OWN => a.method.clone(),
        name => format!("{} of {}", a.method, name),
    };
    let bound = if of.best.is_bound { " certified" } else { "" };
    let mut words = text!(
        "**{}{bound} energy error**{about} costs {} by {}",
        percent_asked(of.target),
        duration(of.best.seconds).text(),
        way(&of.best)
    );
    for (k, other) in of.others.iter().enumerate() {
        let [between, needs] = if k == 0 { ["; ", " needs"] } else { [", ", ""] };
        let time = duration(other.seconds).text();
        words = words.and(text!("{between}{other.engine}{needs} {time}"));
    }
    Some(words)
}

/// Without advice: the least error that was measured.
fn least(outcome: &StudyOutcome) -> Option<Text> {
    let scene = &outcome.rows.first()?.scene;
    let rows = outcome.front.iter().map(|&k| &outcome.rows[k]);
    let rows = rows.filter(|row| row.scene == *scene);
    let errors = rows.filter_map(|row| Some((row.error(Norm::Energy)?, row)));
    let (error, row) = errors.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(text!(
        "The least error in energy is **{}**, by {row.method} of {row.engine} in {}",
        percent(error),
        duration(row.seconds.median).text()
    ))
}

fn of_scene<'a>(outcome: &'a StudyOutcome, scene: &'a str, is_first: bool) -> Vec<Block<'a>> {
    let advice = outcome.advice.iter().filter(|a| a.scene == scene);
    let sentences = advice.clone().map(|a| format!("  {}", a.sentence()));
    let mut sentences: Vec<String> = sentences.collect();
    if sentences.is_empty() {
        sentences.push("  no error that advice is given for was reached".into());
    }
    let mut page = vec![Block::heading(2, scene.to_owned())];
    // The first scene is at the top of the page.
    let work = figures::work(outcome, scene).filter(|_| !is_first);
    page.extend(work.map(Block::Figure));
    if advice.count() > 0 {
        page.push(Block::heading(3, "What an accuracy costs"));
        page.push(Block::text(text!(ADVICE)));
        page.push(Block::drawn(move || costs(&outcome.advice, scene)));
    }
    let gamma = figures::gamma(outcome, scene).map(Block::Figure);
    let found = outcome.gammas.iter().filter(|g| g.scene == scene);
    let found = found.map(gamma_sentence);
    let mut gammas = vec![Block::list(found)];
    gammas.extend(gamma);
    let mut section = |title: &str, text: &str, more: Vec<Block<'a>>, table: Table| {
        if !table.rows.is_empty() {
            let table = table.known();
            page.push(Block::heading(3, title));
            page.extend((!text.is_empty()).then(|| Block::text(Text::message(text))));
            page.extend(more);
            page.push(match table.rows.len() {
                0..=LONG => table.into(),
                rows => Block::folded(title, count(rows, "row"), vec![table.into()]),
            });
        }
    };
    let unbeaten = "What nothing beats in both time and error";
    section(unbeaten, "", vec![], front(outcome, scene));
    section("Exponents", RATES, vec![], rates(outcome, scene));
    section(
        "Beyond this machine",
        SCALING,
        vec![],
        scaling(outcome, scene),
    );
    section("What is wasted", WASTE, vec![], waste(outcome, scene));
    section(
        "γ₀ \"large enough\"",
        GAMMAS,
        gammas,
        gamma_table(outcome, scene),
    );
    section("Solver and precision", "", vec![], solvers(outcome, scene));
    let mut told = vec![Block::text(scene.to_owned())];
    told.extend(sentences.into_iter().map(Block::text));
    vec![Block::Terminal(told), Block::Page(page)]
}

fn megabytes(mb: f64) -> Cell {
    Cell::fixed(mb, 0)
}

/// The number that a row varies, or the name.
fn varied(row: &Row) -> Cell {
    set(row.varied, &value(row))
}

/// A value of a setting.
fn set(varied: Varied, value: &str) -> Cell {
    match (value.parse(), varied) {
        (Ok(n), Varied::Mesh | Varied::Target) => Cell::number(n, value),
        (Ok(number), _) => Cell::number(number, Number::power(number)),
        (Err(_), _) => value.into(),
    }
}

fn front(outcome: &StudyOutcome, scene: &str) -> Table {
    let mut rows: Vec<&Row> = outcome.front.iter().map(|&k| &outcome.rows[k]).collect();
    rows.retain(|row| row.scene == scene);
    rows.sort_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
    table!("", rows, |row|
        "code" => &row.engine,
        "method" => &row.method,
        "varied" => row.varied.to_string(),
        "value" => varied(row),
        "dofs" => row.dofs,
        "time" => duration(row.seconds.median),
        "MB" => row.memory_mb.map(megabytes),
        "energy" => row.h1,
        "L²" => row.l2,
        "certified" => row.certified.map(Cell::at_most),
    )
}

/// The error, or its bound if u is unknown.
fn energy(row: &Row) -> Option<Cell> {
    let bound = |bound| Cell::number(bound, format!("≤ {}", Cell::at_most(bound).text()));
    row.h1.map(Cell::from).or_else(|| row.certified.map(bound))
}

fn rates(outcome: &StudyOutcome, scene: &str) -> Table {
    let cell = |f: Fit| {
        let spread = f.spread.unwrap_or(f64::NAN);
        Cell::number(f.exponent, format!("{:.2} ± {spread:.2}", f.exponent))
    };
    let is_known = |r: &&Rates| {
        [r.h1, r.l2, r.seconds, r.memory]
            .iter()
            .any(Option::is_some)
    };
    let rows = outcome.rates.iter().filter(|r| r.scene == scene);
    table!("", rows.filter(is_known), |r|
        "code" => &r.engine,
        "method" => &r.method,
        "energy" => r.h1.map(cell),
        "L²" => r.l2.map(cell),
        "time" => r.seconds.map(cell),
        "memory" => r.memory.map(cell),
    )
}

fn scaling(outcome: &StudyOutcome, scene: &str) -> Table {
    let rows = outcome.scaling.iter().filter(|s| s.scene == scene);
    let ranks = |s: &Scaling, k: usize| {
        let (seconds, mb) = (s.rank_seconds[k], s.rank_memory_mb[k]);
        Cell::number(seconds, format!("{}, {mb:.0} MB", duration(seconds).text()))
    };
    let half = |ranks: f64| Cell::number(ranks, format!("{ranks:.0} ranks"));
    let not_seen = || Cell::from("not seen");
    table!("", rows, |s|
        "code" => &s.engine,
        "method" => &s.method,
        "from dofs" => s.from_dofs,
        "to dofs" => s.dofs,
        "time" => duration(s.seconds),
        "MB" => megabytes(s.memory_mb),
        "dofs here" => s.most_dofs,
        "in" => s.most_seconds.map(duration),
        "4 ranks" => ranks(s, 0),
        "16" => ranks(s, 1),
        "64" => ranks(s, 2),
        "256" => ranks(s, 3),
        "half at" => s.half_efficient.map_or_else(not_seen, half),
    )
}

/// Reported changes of time and error exceed the spread of the times and the tolerance for equal errors.
fn waste(outcome: &StudyOutcome, scene: &str) -> Table {
    let rows = outcome.waste.iter().filter(|w| w.scene == scene);
    let time = |w: &Waste| match w.time_range {
        [least, _] if least > 1.0 => {
            let ratio = w.time_ratio;
            Cell::number(ratio, format!("{ratio:.2} times the time"))
        }
        _ => Cell::number(1.0, "no longer"),
    };
    let part = |of: f64| match of {
        of if !(of >= HARMLESS) => Cell::number(
            0.0,
            format!("less than {} more error", percent_asked(HARMLESS)),
        ),
        of if of < 1.0 => Cell::number(of, format!("{} more error", percent(of))),
        of => Cell::number(of, format!("{} times the error", number(1.0 + of, 2))),
    };
    table!("", rows, |w|
        "method" => &w.method,
        "n" => w.n,
        "setting" => w.varied.to_string(),
        "enough" => set(w.varied, &w.enough),
        "most exact" => set(w.varied, &w.most_exact),
        "which takes" => time(w),
        "the worst costs" => part(w.worst_change),
    )
}

fn gamma_table(outcome: &StudyOutcome, scene: &str) -> Table {
    let rows = outcome.rows.iter();
    let rows: Vec<&Row> = rows
        .filter(|r| r.scene == scene && r.varied == Varied::Gamma0)
        .collect();
    let is_finest = |row: &&&Row| {
        let mut tracks = outcome.gammas.iter();
        tracks.any(|g| (&g.scene, &g.method, Some(g.n)) == (&row.scene, &row.method, row.n))
    };
    let order = |row: &Row, norm: Norm| {
        let coarse = rows.iter().find(|other| {
            (other.track(), other.gamma0) == (row.track(), row.gamma0) && other.n < row.n
        })?;
        let ratio = row.n? as f64 / coarse.n? as f64;
        let order = (coarse.error(norm)? / row.error(norm)?).ln() / ratio.ln();
        Some(Cell::fixed(order, 2))
    };
    let steps = |row: &Row| {
        let reached = if row.converged { "" } else { " (not reached)" };
        Cell::number(row.steps as f64, format!("{}{reached}", row.steps))
    };
    table!("", rows.iter().filter(is_finest), |row|
        "method" => &row.method,
        "gamma0" => varied(row),
        "n" => row.n,
        "steps" => steps(row),
        "energy" => energy(row),
        "order" => order(row, Norm::Energy),
        "L²" => row.l2,
        "order" => order(row, Norm::L2),
        "residual" => row.residual,
    )
}

/// "cr, n = 64: solved at 25 of 25 values in 3 to 9 steps; the energy error is 3.1e-2 up to a tenth for γ₀ from 1 to 1e12, and
/// below larger by 0.01 γ₀^-1.00"
fn gamma_sentence(g: &Gammas) -> Text {
    let mut told = text!(
        "{g.method}, n = {g.n}: solved at {g.solved} of {g.tried} values, in {} to {} steps",
        g.steps[0],
        g.steps[1]
    );
    let errors = [
        ("relative energy error", &g.energy),
        ("relative L² error", &g.l2),
    ];
    for (name, safe) in errors {
        let Some(safe) = safe else { continue };
        told = told.and(text!(
            "; the {name} is {}, or larger by less than a tenth, for γ₀ from {} to {}",
            short(safe.least),
            Number::power(safe.from),
            Number::power(safe.to)
        ));
        for (side, fit) in [("below", safe.below), ("above", safe.above)] {
            if let Some(fit) = fit {
                let spread = fit.spread.map(|s| text!(" (± {})", Number::fixed(s, 2)));
                let (constant, exponent) = (fit.constant, fit.exponent);
                told = told.and(text!(
                    ", {side} it grows by {} γ₀^{}{spread}",
                    Number::new(constant, 3),
                    Number::fixed(exponent, 2)
                ));
            }
        }
    }
    told
}

fn solvers(outcome: &StudyOutcome, scene: &str) -> Table {
    let of = |row: &&Row| row.scene == scene && row.varied == Varied::Linear;
    table!("", outcome.rows.iter().filter(of), |row|
        "method" => &row.method,
        "n" => row.n,
        "solver" => value(row),
        "time" => duration(row.seconds.median),
        "MB" => row.memory_mb.map(megabytes),
        "energy" => energy(row),
        "residual" => row.residual,
    )
}

/// All rows, one per line.
fn rows_csv(rows: &[Row]) -> String {
    let head = "scene,engine,method,varied,n,accuracy,cells,dofs,tolerance,gamma0,load_quadrature,contact_quadrature,linear,precision,\
        steps,converged,residual,h1,l2,certified,contact_residual,contact_flux,seconds,seconds_least,seconds_most,repeats,\
        start_up,memory_mb";
    let of = |row: &Row| {
        let mut fields = json!(row);
        fields["seconds"] = json!(row.seconds.median);
        fields["seconds_least"] = json!(row.seconds.least);
        fields["seconds_most"] = json!(row.seconds.most);
        fields["repeats"] = json!(row.seconds.repeats);
        fields
    };
    csv(head, rows.iter().map(of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waste_is_what_exceeds_the_spread() {
        let of = |time_range, worst_change| Waste {
            scene: "s".into(),
            method: "cr".into(),
            n: 8,
            varied: Varied::Tolerance,
            enough: "1e-2".into(),
            most_exact: "1e-12".into(),
            time_ratio: 1.25,
            time_range,
            worst_change,
        };
        let rows = vec![
            of([0.9, 1.4], 1.33e-15),
            of([1.1, 1.4], 0.05),
            of([1.1, 1.4], 2.0),
        ];
        let outcome = StudyOutcome {
            machine: crate::engine::Machine::here(),
            engines: Vec::new(),
            budget: 1.0,
            spent: 1.0,
            rows: Vec::new(),
            front: Vec::new(),
            rates: Vec::new(),
            scaling: Vec::new(),
            waste: rows,
            gammas: Vec::new(),
            advice: Vec::new(),
            left_out: Vec::new(),
        };
        let told = waste(&outcome, "s").rows;
        let told: Vec<[String; 2]> = told
            .iter()
            .map(|row| [5, 6].map(|k| row[k].text()))
            .collect();
        assert_eq!(told[0], ["no longer", "less than 1 % more error"]);
        assert_eq!(told[1], ["1.25 times the time", "5.00 % more error"]);
        assert_eq!(told[2], ["1.25 times the time", "3.0 times the error"]);
    }
}
