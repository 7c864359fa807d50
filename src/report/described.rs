//! A case, a place and a verdict as text.

use super::model::{exact, joined, short};
use crate::campaigns::verify::{CaseOutcome, EngineOutcome};
use crate::text::number::place;
use faceoff_judge::{ComparedField, FieldVerdict, Removed, Worst, removed_words};

/// The size of its mesh.
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

/// The open part that was removed from a field before it was judged, or that would make the two results equal.
pub(super) fn open(of: &ComparedField, names: [&str; 2]) -> Option<String> {
    let told = |all: &[Removed]| (!all.is_empty()).then(|| removed_words(all, names));
    let removed = told(&of.removed).map(|words| format!("judged after {words}"));
    let equal = told(&of.equal_after);
    let equal = equal.map(|words| format!("equal after {words}"));
    removed.or(equal)
}

/// The evidence for a verdict that is not plain agreement.
pub(super) fn rests_on(field: &FieldVerdict, carriers: &str) -> Option<String> {
    let beyond = || format!("{} of {} {carriers}", field.beyond, field.faces);
    let why = field
        .reason
        .clone()
        .or_else(|| (field.beyond > 0).then(beyond));
    let flips = match field.rounding_flips {
        Some(flips @ 1..) => Some(format!("{flips} status flips at rounding level")),
        _ => None,
    };
    match (why, flips) {
        (Some(why), Some(flips)) => Some(format!("{why} ({flips})")),
        (why, flips) => why.or(flips),
    }
}

/// The size, place and number of the differences, in one sentence.
pub(super) fn why(field: &FieldVerdict) -> String {
    let values = |w: &Worst| format!("{} against {}", exact(w.a), exact(w.b));
    let values = field.worst.as_ref().map(values).unwrap_or_default();
    let place = worst(field).map_or(String::new(), |at| format!(", worst at {at}: {values}"));
    match &field.reason {
        Some(reason) => reason.clone(),
        None => format!(
            "{} of {} beyond {:e}: |a-b| up to {}, relative {}{place}",
            field.beyond,
            field.faces,
            field.tolerance,
            short(field.max_abs),
            short(field.max_rel)
        ),
    }
}
