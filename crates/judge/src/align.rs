//! Pairs the faces of two results by their sorted vertex ids, in O(N log N).

use rayon::prelude::*;

use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{FaceFields, PADDING};

use super::view::Faces;

/// What is matched, and the tolerance for the positions of a matching pair.
pub(super) struct Nearness<'a> {
    /// The word for it in messages: `face`, `cell` or `point`.
    pub noun: &'a str,
    /// The largest distance along an axis for the k-th item of the first result.
    pub near: &'a (dyn Fn(usize) -> f64 + Sync),
}

/// For each face of `a`, the face of `b` with the same vertices.
///
/// # Errors
/// Faces that only one side has, faces that appear twice, and faces whose vertices are equal but whose
/// positions differ.
pub fn align(a: &FaceFields, b: &FaceFields) -> Result<Vec<u32>> {
    let exponent = 1.0 / a.dim.saturating_sub(1).max(1) as f64;
    let near = |i: usize| 1e-9 * a.measures.get(i).map_or(1.0, |m| m.powf(exponent));
    let noun = "face";
    align_by(&a.into(), &b.into(), &Nearness { noun, near: &near })
}

pub(super) fn align_by(a: &Faces, b: &Faces, by: &Nearness) -> Result<Vec<u32>> {
    let noun = by.noun;
    let refuse = |what: String| Error::Compare {
        a: a.source.to_owned(),
        b: b.source.to_owned(),
        what,
        remedy: "compare results on the same mesh".into(),
    };
    for side in [a, b] {
        let count = side.count();
        let fits = |len: usize| len == 0 || len == count;
        if !fits(side.measures.len()) || !fits(side.midpoints.len()) {
            return Err(refuse(format!(
                "{} has {count} {noun}s but a different number of positions",
                side.source
            )));
        }
    }
    if a.dim != b.dim || a.count() != b.count() {
        let counted = |side: &Faces| match side.dim {
            1 => format!("{} {noun}s", side.count()),
            many => format!("{} {noun}s of {many} vertices", side.count()),
        };
        return Err(refuse(format!(
            "one has {}, the other {}",
            counted(a),
            counted(b)
        )));
    }
    if a.count() == 0 {
        return Err(refuse(format!("there are no {noun}s")));
    }
    let (order_a, order_b) = rayon::join(|| sorted(a), || sorted(b));
    let mut partner = vec![0; a.count()];
    for (k, (&i, &j)) in order_a.iter().zip(&order_b).enumerate() {
        cancel::check()?;
        let (face, other) = (a.face(i as usize), b.face(j as usize));
        let twice = |order: &[u32], of: &Faces, face: &[u32]| {
            k > 0 && of.face(order[k - 1] as usize) == face
        };
        for (order, of, face) in [(&order_a, a, face), (&order_b, b, other)] {
            if twice(order, of, face) {
                return Err(refuse(format!(
                    "{} has {noun} {} twice, so that its partner is ambiguous",
                    of.source,
                    label(of, order[k] as usize)
                )));
            }
        }
        if face != other {
            let (owner, at, without) = if face < other { (a, i, b) } else { (b, j, a) };
            return Err(refuse(format!(
                "{} has no {noun} {}",
                without.source,
                label(owner, at as usize)
            )));
        }
        let places = a.midpoints.get(i as usize).zip(b.midpoints.get(j as usize));
        let near = (by.near)(i as usize);
        // Negated, so that NaN is not near.
        if let Some((p, q)) = places
            && !(0..3).all(|c| (p[c] - q[c]).abs() <= near)
        {
            return Err(refuse(format!(
                "{noun} {face:?} lies at {p:?} in one and at {q:?} in the other"
            )));
        }
        partner[i as usize] = j;
    }
    Ok(partner)
}

/// The vertices, and the position if it is known.
fn label(fields: &Faces, face: usize) -> String {
    let vertices = fields.face(face).iter().filter(|v| **v != PADDING);
    let vertices: Vec<_> = vertices.collect();
    match fields.midpoints.get(face) {
        Some(x) => format!("{vertices:?} at {:?}", &x[..fields.space]),
        None => format!("{vertices:?}"),
    }
}

fn sorted(fields: &Faces) -> Vec<u32> {
    let mut order: Vec<u32> = (0..fields.count() as u32).collect();
    order.par_sort_unstable_by(|&i, &j| fields.face(i as usize).cmp(fields.face(j as usize)));
    order
}
