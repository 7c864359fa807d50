//! A case and a place in words.

use super::model::joined;
use crate::campaigns::verify::{CaseOutcome, EngineOutcome};
use crate::text::number::place;
use faceoff_judge::FieldVerdict;

/// What its mesh has.
pub(super) fn sizes(case: &CaseOutcome) -> String {
    format!(
        "{} cells, {} faces, {} of them contact, {} dofs",
        case.cells, case.faces, case.contact_faces, case.dofs
    )
}

/// Every code with its version.
pub(super) fn versions(case: &CaseOutcome) -> String {
    let of = |e: &EngineOutcome| format!("{} {}", e.engine, e.version);
    joined(case.engines.iter().map(of), ", ")
}

/// `[14, 31] at (0.8750, 0.0312)`
pub(super) fn worst(field: &FieldVerdict) -> Option<String> {
    let worst = field.worst.as_ref().filter(|_| field.max_abs != 0.0)?;
    let at = match worst.midpoint.is_empty() {
        true => String::new(),
        false => format!(" at {}", place(&worst.midpoint)),
    };
    let component = worst.component.map_or(String::new(), |k| format!("[{k}]"));
    Some(match worst.cells {
        Some([i, j]) => format!("cells {i} and {j}{component}{at}"),
        None => format!("{:?}{component}{at}", worst.vertices),
    })
}
