//! The readable table: one line a pair and field.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, Table, presets};

use crate::campaigns::verify::{Source, VerifyOutcome, telling};
use faceoff_judge::{Comparison, FieldVerdict, MatchBy, Verdict};

/// The whole outcome as text.
pub fn table(outcome: &VerifyOutcome) -> String {
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
            "The methods against each other: ‖∇(u_a-u_b)‖, and certified bounds of the error of each"
        );
        let mut cross = new(&[
            "scene", "n", "a", "b", "pairs", "distance", "bound a", "bound b", "slack", "verdict",
        ]);
        for (c, pairs) in telling(&outcome.cross) {
            let source = |s: &Source| format!("{} {}", s.engine, s.method);
            let n = c.n.map_or(String::new(), |n| n.to_string());
            let mut row = vec![
                c.scene.clone(),
                n,
                source(&c.a),
                source(&c.b),
                pairs.to_string(),
            ];
            match &c.judged {
                Some(j) => {
                    let numbers = [j.distance, j.bounds[0], j.bounds[1], j.slack];
                    row.extend(numbers.map(|x| format!("{x:.2e}")));
                    row.push(word(j.verdict).to_owned());
                }
                None => {
                    let because = c.no_certificate.as_deref().unwrap_or_default();
                    row.extend(["", "", "", ""].map(str::to_owned));
                    row.push(format!("no certificate, because {because}"));
                }
            }
            cross.add_row(row);
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
        MatchBy::Vertices => "vertices",
        MatchBy::Coordinates => "coordinates",
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
