//! What people and programs read: the report in Markdown, and the rows as CSV.

use std::fmt::Write as _;

use comfy_table::{Table, presets};

use super::advice::duration;
use super::gamma::{Gammas, Safe};
use super::row::{Row, Varied};
use super::waste::value;
use super::{Norm, StudyOutcome};
use crate::engine::Machine;
use crate::run::Fit;

/// The advice alone, or why there is none.
pub fn summary(outcome: &StudyOutcome) -> String {
    let mut text = String::new();
    for scene in scenes(outcome) {
        let _ = writeln!(text, "{scene}");
        let advice: Vec<_> = outcome.advice.iter().filter(|a| a.scene == scene).collect();
        if advice.is_empty() {
            let _ = writeln!(text, "  no error that advice is given for was reached");
        }
        for advice in advice {
            let _ = writeln!(text, "  {}", advice.sentence());
        }
    }
    let _ = writeln!(
        text,
        "{} measurements in {:.1} s of {:.0} s; {} left out",
        outcome.rows.len(),
        outcome.spent,
        outcome.budget,
        outcome.left_out.len()
    );
    text
}

/// The report: figures by their file names, and all tables.
pub fn report(outcome: &StudyOutcome) -> String {
    let mut text = String::from("# What each digit costs\n\n");
    let engines: Vec<String> = outcome
        .engines
        .iter()
        .map(|(name, version)| format!("{name} {version}"))
        .collect();
    let _ = writeln!(
        text,
        "{}. Codes: {}. Times are medians over repetitions on a machine that may do other things as well, of mesh, assembly and solution, \
         without start-up; the least and the largest are in `rows.csv`. Errors are relative to the norms of u; where u is not known the error in the energy norm is its \
         guaranteed bound.\n",
        machine(&outcome.machine),
        engines.join(", ")
    );
    for scene in scenes(outcome) {
        let _ = writeln!(text, "## {scene}\n");
        let _ = writeln!(text, "![work and precision of {scene}](work-{scene}.svg)\n");
        write_advice(&mut text, outcome, &scene);
        write_front(&mut text, outcome, &scene);
        write_rates(&mut text, outcome, &scene);
        write_scaling(&mut text, outcome, &scene);
        write_waste(&mut text, outcome, &scene);
        write_gammas(&mut text, outcome, &scene);
        write_solvers(&mut text, outcome, &scene);
    }
    if !outcome.left_out.is_empty() {
        let _ = writeln!(text, "## Left out\n");
        for left in &outcome.left_out {
            let _ = writeln!(text, "- {}: {}", left.what, left.why);
        }
    }
    text
}

fn machine(m: &Machine) -> String {
    let memory = m
        .memory_mb
        .map_or(String::new(), |mb| format!(", {:.0} GB", mb / 1024.0));
    let debug = if m.optimised {
        ""
    } else {
        ", built without optimisation: these times mean little"
    };
    let processor = match m.processor.as_str() {
        "" => "unknown processor",
        name => name,
    };
    format!(
        "faceoff {} on {} ({} threads{memory}, {}){debug}",
        m.version, processor, m.threads, m.system
    )
}

/// In the order in which they were asked for.
pub fn scenes(outcome: &StudyOutcome) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for row in &outcome.rows {
        if !names.contains(&row.scene) {
            names.push(row.scene.clone());
        }
    }
    names
}

fn write_advice(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let _ = writeln!(
        text,
        "### Advice\n\nEach command was measured as it stands, in a process of its own: its error, the median of its times as it tells them, and the \
         peak memory of the process. Where the time is not certain to be affordable, `solve --accuracy` asks for the error instead, certified.\n"
    );
    let mut table = new(&["wanted", "in words", "command"]);
    for advice in outcome.advice.iter().filter(|a| a.scene == scene) {
        let norm = match advice.norm {
            Norm::Energy => "energy",
            Norm::L2 => "L²",
        };
        table.add_row([
            format!("{:e} {norm}", advice.target),
            advice.sentence(),
            format!("`{}`", advice.command),
        ]);
    }
    let _ = writeln!(text, "{table}\n");
}

fn write_front(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let _ = writeln!(text, "### What nothing beats in both time and error\n");
    let mut table = new(&[
        "code",
        "method",
        "varied",
        "value",
        "dofs",
        "seconds",
        "MB",
        "energy",
        "L²",
        "certified",
    ]);
    let mut rows: Vec<&Row> = outcome.front.iter().map(|&k| &outcome.rows[k]).collect();
    rows.retain(|row| row.scene == scene);
    rows.sort_by(|a, b| a.seconds.median.total_cmp(&b.seconds.median));
    for row in rows {
        table.add_row([
            row.engine.clone(),
            row.method.clone(),
            row.varied.to_string(),
            value(row),
            row.dofs.to_string(),
            duration(row.seconds.median),
            row.memory_mb.map_or(String::new(), |mb| format!("{mb:.0}")),
            number(row.h1),
            number(row.l2),
            number(row.certified),
        ]);
    }
    let _ = writeln!(text, "{table}\n");
}

fn write_rates(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let _ = writeln!(
        text,
        "### Exponents\n\nErrors as h^p, time and memory as dofs^p, over the finest four meshes or three; after ± the standard error of the fit.\n"
    );
    let mut table = new(&["code", "method", "energy", "L²", "time", "memory"]);
    let fit = |f: Option<Fit>| {
        f.map_or(String::new(), |f| {
            format!("{:.2} ± {:.2}", f.exponent, f.spread.unwrap_or(f64::NAN))
        })
    };
    for rates in outcome.rates.iter().filter(|r| r.scene == scene) {
        table.add_row([
            rates.engine.clone(),
            rates.method.clone(),
            fit(rates.h1),
            fit(rates.l2),
            fit(rates.seconds),
            fit(rates.memory),
        ]);
    }
    let _ = writeln!(text, "{table}\n");
}

fn write_scaling(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let mut table = new(&[
        "code",
        "method",
        "dofs",
        "seconds",
        "MB",
        "dofs here",
        "in",
        "4 ranks",
        "16",
        "64",
        "256",
        "half at",
    ]);
    for s in outcome.scaling.iter().filter(|s| s.scene == scene) {
        let mut row = vec![
            s.engine.clone(),
            s.method.clone(),
            s.dofs.to_string(),
            duration(s.seconds),
            format!("{:.0}", s.memory_mb),
            s.most_dofs
                .map_or(String::new(), |dofs| format!("{dofs:.1e}")),
            s.most_seconds.map_or(String::new(), duration),
        ];
        let ranks = s.rank_seconds.iter().zip(&s.rank_memory_mb);
        row.extend(ranks.map(|(seconds, mb)| format!("{}, {mb:.0} MB", duration(*seconds))));
        row.push(
            s.half_efficient
                .map_or("out of reach".into(), |ranks| format!("{ranks:.0} ranks")),
        );
        table.add_row(row);
    }
    if table.row_count() > 0 {
        let _ = writeln!(
            text,
            "### Beyond this machine\n\nBy the exponents above, taken as 1 where start-up still hides the rest, and as those of a factor in space where noise says more. Dofs here: what this machine's memory holds, and the time that they \
             would take. Ranks: weak scaling on paper, each rank with the dofs of the finest mesh, work and memory shared evenly over a network that costs nothing: time as R^(p-1), memory \
             of a rank as R^(q-1). Half at: the ranks at which half of the time is lost. A factor tends to p = 3/2, q = 1 in the plane and to p = 2, q = 4/3 in space, multigrid to 1: from the \
             memory of this machine on, and in space well before it, iterations (`--linear iterative`, or dolfinx with `--ranks` and GMRES) are what to change to.\n\n{table}\n"
        );
    }
}

fn write_waste(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let mut table = new(&[
        "method",
        "n",
        "setting",
        "enough",
        "most exact",
        "which takes",
        "the worst costs",
    ]);
    for w in outcome.waste.iter().filter(|w| w.scene == scene) {
        table.add_row([
            w.method.clone(),
            w.n.to_string(),
            w.varied.to_string(),
            w.enough.clone(),
            w.most_exact.clone(),
            format!("{:.2} times the time", w.time_ratio),
            format!("{:.1} % of an error", 100.0 * w.worst_change),
        ]);
    }
    if table.row_count() > 0 {
        let _ = writeln!(
            text,
            "### What is wasted\n\nThe cheapest value from which on no error is larger by 1 % than with the most exact one.\n\n{table}\n"
        );
    }
}

fn write_gammas(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let rows: Vec<&Row> = outcome
        .rows
        .iter()
        .filter(|row| row.scene == scene && row.varied == Varied::Gamma0)
        .collect();
    if rows.is_empty() {
        return;
    }
    let _ = writeln!(
        text,
        "### γ₀ \"large enough\"\n\nThe paper's theory asks for γ = γ₀h with γ₀ large enough. Over 24 decades:\n"
    );
    for found in outcome.gammas.iter().filter(|g| g.scene == scene) {
        let _ = writeln!(text, "- {}", gamma_sentence(found));
    }
    let _ = writeln!(text, "\n![errors over gamma0](gamma0-{scene}.svg)\n");
    let mut table = new(&[
        "method", "gamma0", "n", "steps", "energy", "order", "L²", "order", "residual",
    ]);
    let is_finest = |row: &&&Row| {
        let mut tracks = outcome.gammas.iter();
        tracks.any(|g| (&g.scene, &g.method, Some(g.n)) == (&row.scene, &row.method, row.n))
    };
    for row in rows.iter().filter(is_finest) {
        let coarse = rows.iter().find(|other| {
            (other.track(), other.gamma0) == (row.track(), row.gamma0) && other.n < row.n
        });
        let order = |norm: Norm| {
            let (a, b) = (coarse?.error(norm)?, row.error(norm)?);
            let ratio = row.n? as f64 / coarse?.n? as f64;
            Some(format!("{:.2}", (a / b).ln() / ratio.ln()))
        };
        table.add_row([
            row.method.clone(),
            value(row),
            row.n.map_or(String::new(), |n| n.to_string()),
            format!(
                "{}{}",
                row.steps,
                if row.converged { "" } else { " (not reached)" }
            ),
            number(row.h1.or(row.certified)),
            order(Norm::Energy).unwrap_or_default(),
            number(row.l2),
            order(Norm::L2).unwrap_or_default(),
            format!("{:.1e}", row.residual),
        ]);
    }
    let _ = writeln!(text, "{table}\n");
}

/// "cr, n = 64: solved at 25 of 25 values in 3 to 9 steps; the energy error is 3.1e-2 up to a tenth for γ₀ from 1 to 1e12, and
/// below larger by 0.01 γ₀^-1.00"
fn gamma_sentence(g: &Gammas) -> String {
    let mut text = format!(
        "{}, n = {}: solved at {} of {} values, in {} to {} steps",
        g.method, g.n, g.solved, g.tried, g.steps[0], g.steps[1]
    );
    let mut add = |name: &str, safe: &Option<Safe>| {
        let Some(safe) = safe else { return };
        text += &format!(
            "; the {name} is {:.3e}, or larger by less than a tenth, for γ₀ from {:e} to {:e}",
            safe.least, safe.from, safe.to
        );
        for (side, fit) in [("below", safe.below), ("above", safe.above)] {
            if let Some(fit) = fit {
                text += &format!(
                    ", {side} it grows by {:.2e} γ₀^{:.2} (± {:.2})",
                    fit.constant,
                    fit.exponent,
                    fit.spread.unwrap_or(f64::NAN)
                );
            }
        }
    };
    add("relative energy error", &g.energy);
    add("relative L² error", &g.l2);
    text
}

fn write_solvers(text: &mut String, outcome: &StudyOutcome, scene: &str) {
    let of = |row: &&Row| row.scene == scene && row.varied == Varied::Linear;
    let mut table = new(&[
        "method", "n", "solver", "seconds", "MB", "energy", "residual",
    ]);
    for row in outcome.rows.iter().filter(of) {
        table.add_row([
            row.method.clone(),
            row.n.map_or(String::new(), |n| n.to_string()),
            value(row),
            duration(row.seconds.median),
            row.memory_mb.map_or(String::new(), |mb| format!("{mb:.0}")),
            number(row.h1.or(row.certified)),
            format!("{:.1e}", row.residual),
        ]);
    }
    if table.row_count() > 0 {
        let _ = writeln!(text, "### Solver and precision\n\n{table}\n");
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or(String::new(), |v| format!("{v:.3e}"))
}

fn new(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header.to_vec());
    table
}

/// All rows, one a line, numbers with all digits; a field with a comma is quoted (RFC 4180).
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "scene,engine,method,varied,n,accuracy,cells,dofs,tolerance,gamma0,load_quadrature,contact_quadrature,linear,precision,\
         steps,converged,residual,h1,l2,certified,contact_residual,contact_flux,seconds,seconds_least,seconds_most,repeats,\
         start_up,memory_mb\n",
    );
    let some = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:e}"));
    for row in rows {
        let fields = [
            row.scene.clone(),
            row.engine.clone(),
            row.method.clone(),
            row.varied.to_string(),
            row.n.map_or(String::new(), |n| n.to_string()),
            some(row.accuracy),
            row.cells.to_string(),
            row.dofs.to_string(),
            format!("{:e}", row.tolerance),
            format!("{:e}", row.gamma0),
            row.load_quadrature.clone(),
            row.contact_quadrature.clone(),
            row.linear.clone(),
            row.precision.clone(),
            row.steps.to_string(),
            row.converged.to_string(),
            format!("{:e}", row.residual),
            some(row.h1),
            some(row.l2),
            some(row.certified),
            format!("{:e}", row.contact_residual),
            format!("{:e}", row.contact_flux),
            format!("{:e}", row.seconds.median),
            format!("{:e}", row.seconds.least),
            format!("{:e}", row.seconds.most),
            row.seconds.repeats.to_string(),
            some(row.start_up),
            some(row.memory_mb),
        ];
        let quoted = fields.map(|field| {
            if field.contains([',', '"']) {
                format!("\"{}\"", field.replace('"', "\"\""))
            } else {
                field
            }
        });
        let _ = writeln!(text, "{}", quoted.join(","));
    }
    text
}
