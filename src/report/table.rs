//! The readable table: one line a pair and field.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, Table, presets};

use crate::compare::{Comparison, FieldVerdict, Map, Verdict};
use crate::verify::Outcome;

/// The whole outcome as text.
pub fn table(outcome: &Outcome) -> String {
    let mut text = String::new();
    for case in &outcome.cases {
        let n = case.n.map_or(String::new(), |n| format!(", n = {n}"));
        let _ = writeln!(
            text,
            "{}, {}{n}: {} cells, {} faces, {} of them contact, {} dofs",
            case.scene, case.method, case.cells, case.faces, case.contact_faces, case.dofs
        );
        let mut engines = new(&[
            "engine", "version", "steps", "seconds", "residual", "verdict",
        ]);
        for e in &case.engines {
            engines.add_row([
                e.engine.clone(),
                e.version.clone(),
                format!(
                    "{}{}",
                    e.iterations,
                    if e.converged { "" } else { " (not converged)" }
                ),
                format!("{:.3}", e.seconds),
                format!("{:.1e}", e.residual),
                word(e.verdict).into(),
            ]);
        }
        let _ = writeln!(text, "{engines}");
        let mut pairs = new(&[
            "pair",
            "field",
            "max |a-b|",
            "relative",
            "tolerance",
            "worst face",
            "verdict",
        ]);
        for pair in &case.pairs {
            let field = &pair.field;
            pairs.add_row([
                format!("{} – {}", pair.a, pair.b),
                field.field.clone(),
                format!("{:.1e}", field.max_abs),
                format!("{:.1e}", field.max_rel),
                format!("{:.0e}", field.tolerance),
                place(field),
                remark(field, "faces"),
            ]);
        }
        let _ = writeln!(text, "{pairs}\n");
    }
    if !outcome.cross.is_empty() {
        let _ = writeln!(
            text,
            "The methods against each other: root mean square of the difference of face means, over max|u|"
        );
        let mut cross = new(&[
            "scene",
            "engine",
            "pair",
            "n",
            "difference",
            "order",
            "verdict",
        ]);
        for c in &outcome.cross {
            let join = |items: Vec<String>| items.join(" ");
            cross.add_row([
                c.scene.clone(),
                c.engine.clone(),
                format!("{} – {}", c.a, c.b),
                join(c.n.iter().map(ToString::to_string).collect()),
                join(c.difference.iter().map(|d| format!("{d:.2e}")).collect()),
                join(c.orders.iter().map(|o| format!("{o:.2}")).collect()),
                match c.required {
                    Some(required) if !c.orders.is_empty() => {
                        format!("{} (at least {required})", word(c.verdict))
                    }
                    _ => "shown only".into(),
                },
            ]);
        }
        let _ = writeln!(text, "{cross}\n");
    }
    for failure in &outcome.failures {
        let _ = writeln!(text, "no answer from {}", failure.engine);
    }
    let _ = writeln!(text, "{}", word(outcome.verdict));
    text
}

/// A comparison of two files as text: one line a field.
pub fn comparison_table(comparison: &Comparison) -> String {
    let mut fields = new(&[
        "field",
        "on",
        "max |a-b|",
        "relative",
        "scale",
        "rtol",
        "atol",
        "worst",
        "verdict",
    ]);
    for compared in &comparison.fields {
        let field = &compared.field;
        let on = format!("{:?}", compared.on).to_lowercase();
        fields.add_row([
            field.field.clone(),
            on.clone(),
            format!("{:.1e}", field.max_abs),
            format!("{:.1e}", field.max_rel),
            compared.scale.map_or(String::new(), |s| format!("{s:.1e}")),
            format!("{:.0e}", compared.rtol),
            format!("{:.0e}", compared.atol),
            place(field),
            remark(field, &on),
        ]);
    }
    let map = match comparison.map {
        Map::Vertices => "vertices",
        Map::Coordinates => "coordinates",
    };
    format!(
        "a: {}\nb: {}\nmatched by {map}\n{fields}\n{}\n",
        comparison.a,
        comparison.b,
        word(comparison.verdict)
    )
}

fn new(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(header.to_vec());
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Left);
    }
    table
}

pub(super) fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agree => "agree",
        Verdict::Disagree => "disagree",
        Verdict::Undetermined => "undetermined",
    }
}

fn place(field: &FieldVerdict) -> String {
    field.worst.as_ref().map_or(String::new(), |worst| {
        let at: Vec<String> = worst.midpoint.iter().map(|x| format!("{x:.4}")).collect();
        format!("{:?} at ({})", worst.vertices, at.join(", "))
    })
}

fn remark(field: &FieldVerdict, carriers: &str) -> String {
    let mut text = word(field.verdict).to_owned();
    if let Some(reason) = &field.reason {
        let _ = write!(text, ": {reason}");
    } else if field.beyond > 0 {
        let _ = write!(text, ": {} of {} {carriers}", field.beyond, field.faces);
    }
    if let Some(flips @ 1..) = field.rounding_flips {
        let _ = write!(text, " ({flips} status flips at rounding level)");
    }
    text
}
