//! Which face of one result is which of the other: by sorted vertex ids, in O(N log N).

use crate::error::{Error, Result};
use crate::field::FaceFields;

/// For each face of `a`, the face of `b` with the same vertices.
///
/// # Errors
/// Faces that only one side has, faces that come twice, and faces of the same vertices that lie
/// at different places.
pub fn align(a: &FaceFields, b: &FaceFields) -> Result<Vec<u32>> {
    let refuse = |what: String| Error::Compare {
        a: a.source.clone(),
        b: b.source.clone(),
        what,
        remedy: "compare results on the same mesh".into(),
    };
    if a.dim != b.dim || a.face_count() != b.face_count() {
        return Err(refuse(format!(
            "one has {} faces of {} vertices, the other {} of {}",
            a.face_count(),
            a.dim,
            b.face_count(),
            b.dim
        )));
    }
    if a.face_count() == 0 {
        return Err(refuse("there are no faces".into()));
    }
    let (order_a, order_b) = (sorted(a), sorted(b));
    let mut partner = vec![0; a.face_count()];
    for (k, (&i, &j)) in order_a.iter().zip(&order_b).enumerate() {
        let (face, other) = (a.face(i as usize), b.face(j as usize));
        if face != other {
            let missing = face.min(other);
            let side = if face < other { &b.source } else { &a.source };
            return Err(refuse(format!("{side} has no face {missing:?}")));
        }
        if k > 0 && a.face(order_a[k - 1] as usize) == face {
            return Err(refuse(format!("face {face:?} comes twice")));
        }
        let near = 1e-9 * a.measures[i as usize].powf(1.0 / (a.dim - 1) as f64);
        let (p, q) = (a.midpoints[i as usize], b.midpoints[j as usize]);
        // Asked this way round, so that a coordinate that is not a number is not near.
        if !(0..3).all(|c| (p[c] - q[c]).abs() <= near) {
            return Err(refuse(format!(
                "face {face:?} lies at {:?} in one and at {:?} in the other",
                p, q
            )));
        }
        partner[i as usize] = j;
    }
    Ok(partner)
}

fn sorted(fields: &FaceFields) -> Vec<u32> {
    let mut order: Vec<u32> = (0..fields.face_count() as u32).collect();
    order.sort_unstable_by(|&i, &j| fields.face(i as usize).cmp(fields.face(j as usize)));
    order
}
