//! The fault of a field in one sentence, with its evidence and its position.

use super::model::Todo;
use crate::text::number::{number, place, share, size, whole};
use crate::text::{Text, text};
use crate::why::{self, Explanation, Findings};
use faceoff_mesh::mesh::Triangulation;

/// `**name:** γ is 1 % too large on one contact face`
pub(super) fn claim(name: &str, found: &Findings) -> Text {
    if let Some(culprit) = found.culprit() {
        return text!("**{name}:** {}", in_short(culprit));
    }
    let place = match found.worst.first() {
        Some(_) if 2 * found.failing > found.rows => " nearly anywhere".into(),
        Some(spot) => text!(" at {}", spot.carrier()),
        None => Text::default(),
    };
    text!("**{name}** does not solve the scheme{place}")
}

/// An explanation without positions and digits.
fn in_short(of: &Explanation) -> Text {
    let is_gamma = of.is_gamma();
    let on = match of.at.len() {
        0 => "on all contact faces".into(),
        1 => "on one contact face".into(),
        more => text!("on {} contact faces", whole(more)),
    };
    match of.factor {
        Some(factor) if is_gamma => text!("γ is {} {on}", too_much(factor)),
        None if is_gamma => text!("γ is wrong {on}"),
        _ => of.brief.clone(),
    }
}

/// The deviation of a factor from 1.
fn too_much(factor: f64) -> String {
    let off = factor - 1.0;
    let way = if off > 0.0 { "large" } else { "small" };
    match off.abs() {
        o if o < 1e-3 => format!("too {way} by {} of itself", size(o)),
        _ if (0.5..2.0).contains(&factor) => format!("{} too {way}", share(off.abs())),
        _ => format!("{} times what it should be", number(factor, 4)),
    }
}

/// The number of equations that a field does not satisfy, and the change with which it satisfies all.
pub(super) fn equations(found: &Findings, of: &str) -> Text {
    let most = found.worst.first().map_or(Text::default(), |spot| {
        text!(
            ", most that of {} at {}",
            spot.carrier(),
            place(&spot.midpoint)
        )
    });
    let fails = text!(
        "It fails **{} of {} equations** of {of}{most}.",
        whole(found.failing),
        whole(found.rows)
    );
    let change = match found.culprit() {
        Some(culprit) => {
            let with = match (culprit.factor, &culprit.at[..]) {
                (Some(factor), [spot]) if culprit.is_gamma() => {
                    text!("With **{} γ on {}**", number(factor, 5), spot.carrier())
                }
                (Some(factor), []) if culprit.is_gamma() => {
                    text!(
                        "With **{} γ**",
                        number(
                            factor,
                            (3.0 - (factor - 1.0).abs().log10()).clamp(4.0, 13.0) as usize
                        )
                    )
                }
                _ => "With this one change".into(),
            };
            text!(
                "{with} it solves them all: the residual falls from {} to {}.",
                size(found.residual),
                size(culprit.left)
            )
        }
        None => {
            let suspects = found.terms.iter().filter(|t| t.suspect);
            let suspects = suspects.map(|t| Text::strong(why::name(t.term)));
            let suspects: Vec<Text> = suspects.collect();
            let nearest = found
                .explanations
                .first()
                .filter(|e| e.left < 0.1 * found.residual);
            let more = match (nearest, &suspects[..]) {
                (Some(e), _) => text!("; the nearest, {}, leaves {}", in_short(e), size(e.left)),
                (None, []) => Text::default(),
                (None, some) => {
                    text!("; all that fail contain {}", Text::joined(some, " or "))
                }
            };
            text!(
                "The residual is {}, and no single change of the scheme explains it{more}.",
                size(found.residual)
            )
        }
    };
    text!("{fails} {change}")
}

/// Where the code with this name contains the fault; with a mesh, what its job folder shows of it.
pub(super) fn look(found: &Findings, name: &str, job: Option<&Triangulation>) -> Option<Todo> {
    let culprit = found.culprit();
    let words = match culprit.filter(|c| c.is_gamma()) {
        Some(of) => {
            let spot = match &of.at[..] {
                [spot] => Some(spot),
                _ => None,
            };
            let on = spot.map(|spot| text!(" of {}", spot.carrier()));
            let cell = job.zip(spot).and_then(|(mesh, spot)| {
                let face = mesh.find_face(&spot.vertices)?;
                Some(text!(
                    ", whose cell is **{}**",
                    whole(mesh.face_cells(face)[0] as usize)
                ))
            });
            let given = job.map(|_| text!("; in `job/*/case-0` is what it was given"));
            text!("Look where {name} makes or reads **γ**{on}{cell}{given}.")
        }
        None => {
            let mut suspects = found.terms.iter().filter(|t| t.suspect).map(|t| t.term);
            let term = culprit.and_then(|c| c.term).or_else(|| suspects.next())?;
            text!("Look where {name} assembles **{}**.", why::name(term))
        }
    };
    Some(Todo::only(words))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_much_is_said_as_a_person_says_it() {
        let of = |factor| too_much(factor).replace('\u{202f}', " ");
        assert_eq!(of(1.01), "1 % too large");
        assert_eq!(of(0.9), "10 % too small");
        assert_eq!(of(1.000_001), "too large by 1.0 · 10⁻⁶ of itself");
        assert_eq!(of(1e4), "10 000 times what it should be");
    }
}
