//! Where a difference of two fields enters: -Δ removes what only spreads by diffusion.

use std::collections::BTreeMap;

/// A 2D shape, and the source of the difference there, relative to the largest terms.
pub(super) type Entering = (Vec<[f64; 2]>, f64);

/// A triangle of values: points, a and a - b at each.
pub(super) struct Triangle {
    pub points: [[f64; 2]; 3],
    pub a: [f64; 3],
    pub difference: [f64; 3],
}

/// The source at a position, the size of the terms there, and its pieces.
type Place = (f64, f64, Vec<Vec<[f64; 2]>>);

/// By face if values may jump between triangles, else by vertex.
///
/// ```text
/// Σ_T ∫_T ∇φ·∇(a-b)   over   max Σ_T ∫_T |∇φ|·|∇a|,   φ = 1 - 2λ of a face (Crouzeix–Raviart), λ of a vertex
/// ```
pub(super) fn entering(triangles: &[Triangle], is_broken: bool) -> Vec<Entering> {
    let mut places: BTreeMap<Vec<[u64; 2]>, Place> = BTreeMap::new();
    for triangle in triangles {
        let [p, q, r] = triangle.points;
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let det = u[0] * v[1] - u[1] * v[0];
        if det == 0.0 || !det.is_finite() {
            continue;
        }
        let gradients: [[f64; 2]; 3] = std::array::from_fn(|i| {
            let (s, t) = (triangle.points[(i + 1) % 3], triangle.points[(i + 2) % 3]);
            [(s[1] - t[1]) / det, (t[0] - s[0]) / det]
        });
        let gradient =
            |of: &[f64; 3]| [0, 1].map(|k| (0..3).map(|i| of[i] * gradients[i][k]).sum::<f64>());
        let (of_difference, of_a) = (gradient(&triangle.difference), gradient(&triangle.a));
        let centre = [0, 1].map(|k| (p[k] + q[k] + r[k]) / 3.0);
        let area = 0.5 * det.abs();
        for i in 0..3 {
            let [own, s, t] = [i, (i + 1) % 3, (i + 2) % 3].map(|k| triangle.points[k]);
            let middle = |b: [f64; 2]| [0, 1].map(|k| 0.5 * (own[k] + b[k]));
            let (ends, scale, shape) = match is_broken {
                true => (vec![s, t], -2.0, vec![s, centre, t]),
                false => (vec![own], 1.0, vec![own, middle(s), centre, middle(t)]),
            };
            // -0 and 0 are the same position.
            let mut key: Vec<[u64; 2]> = ends
                .iter()
                .map(|p| p.map(|x| (x + 0.0).to_bits()))
                .collect();
            key.sort_unstable();
            let test = gradients[i].map(|g| scale * g);
            let entry = places.entry(key).or_default();
            entry.0 += area * (test[0] * of_difference[0] + test[1] * of_difference[1]);
            entry.1 += area * (test[0].abs() * of_a[0].abs() + test[1].abs() * of_a[1].abs());
            entry.2.push(shape);
        }
    }
    let largest = places
        .values()
        .map(|(_, size, _)| *size)
        .fold(f64::MIN_POSITIVE, f64::max);
    let all = places.into_values();
    all.flat_map(|(enters, _, shapes)| {
        shapes
            .into_iter()
            .map(move |shape| (shape, (enters / largest).abs()))
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear difference enters nowhere inside; one at a single vertex enters there.
    #[test]
    fn what_merely_spreads_is_taken_away() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let of = |peak: f64, slope: f64| -> Vec<Triangle> {
            (0..4)
                .map(|k| {
                    let points = [corners[k], corners[(k + 1) % 4], [0.5, 0.5]];
                    let difference =
                        points.map(|p| slope * p[0] + if p == [0.5, 0.5] { peak } else { 0.0 });
                    Triangle {
                        points,
                        a: points.map(|p| p[1]),
                        difference,
                    }
                })
                .collect()
        };
        let at_centre = |all: Vec<Entering>| {
            let inner = all.into_iter().filter(|(shape, _)| shape[0] == [0.5, 0.5]);
            inner.map(|(_, enters)| enters).fold(0.0, f64::max)
        };
        assert!(at_centre(entering(&of(0.0, 1.0), false)) < 1e-15);
        assert!(at_centre(entering(&of(1.0, 0.0), false)) > 0.1);
        // By face the four inner ones.
        let inner = |all: Vec<Entering>| {
            all.into_iter().filter(|(s, _)| {
                s.contains(&[0.5, 0.5]) && (s[0] == [0.5, 0.5] || s[2] == [0.5, 0.5])
            })
        };
        assert_eq!(inner(entering(&of(0.0, 1.0), true)).count(), 8);
        assert!(inner(entering(&of(0.0, 1.0), true)).all(|(_, enters)| enters < 1e-15));
    }
}
