//! Results at several times: pairs them, and interpolates in time.

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};

/// What is compared at one time; the indices refer to the times of either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pairing {
    /// A time that both have.
    Both(usize, usize),
    /// A time of the first between two times of the second: (1 - w) b_j + w b_{j+1}.
    Between(usize, usize, f64),
    /// A time that only the first has, or only the second.
    Alone(usize, usize),
}

impl Pairing {
    /// The index in the second result if it is judged without interpolation; else `None`.
    pub fn of_second(&self) -> Option<usize> {
        match *self {
            Pairing::Both(_, j) | Pairing::Alone(1, j) => Some(j),
            Pairing::Between(..) | Pairing::Alone(..) => None,
        }
    }
}

/// How times are matched.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times {
    /// The difference up to which two times are the same. `None`: 1e-9 of the largest, or the rounding of binary32 if all
    /// times of one side are such numbers, as in Exodus files.
    pub tolerance: Option<f64>,
    /// Whether the second result is interpolated at times that only the first has.
    pub interpolate: bool,
}

/// Pairs times, which ascend on either side, within a tolerance: each with the nearest of the other side. With
/// interpolation, times of the second that are between those of the first need no counterpart.
///
/// ```
/// use faceoff_judge::{Pairing, Times, pair_times};
///
/// let pairs = pair_times(&[0.0, 0.1, 0.2], &[0.0, 0.2 + 1e-12], &Times::default());
/// assert_eq!(pairs, [Pairing::Both(0, 0), Pairing::Alone(0, 1), Pairing::Both(2, 1)]);
/// ```
pub fn pair_times(a: &[f64], b: &[f64], by: &Times) -> Vec<Pairing> {
    let largest = a.iter().chain(b).fold(0.0_f64, |m, t| m.max(t.abs()));
    let is_single = |list: &[f64]| list.iter().all(|t| f64::from(*t as f32) == *t);
    let rounding = if is_single(a) || is_single(b) {
        2e-7
    } else {
        1e-9
    };
    let tolerance = by.tolerance.unwrap_or(rounding * largest);
    let (mut i, mut j) = (0, 0);
    let mut pairs = Vec::new();
    while i < a.len() || j < b.len() {
        let nearer = |list: &[f64], k: usize, to: f64| {
            let next = list.get(k + 1).map(|t| (t - to).abs());
            next.is_some_and(|next| next < (list[k] - to).abs())
        };
        match (a.get(i), b.get(j)) {
            (Some(&s), Some(&t))
                if (s - t).abs() <= tolerance && !nearer(a, i, t) && !nearer(b, j, s) =>
            {
                pairs.push(Pairing::Both(i, j));
                (i, j) = (i + 1, j + 1);
            }
            (Some(&s), other) if other.is_none_or(|t| s <= *t) => {
                let between = j.checked_sub(1).zip(other).filter(|_| by.interpolate);
                pairs.push(match between {
                    Some((before, t)) => {
                        Pairing::Between(i, before, (s - b[before]) / (t - b[before]))
                    }
                    None => Pairing::Alone(0, i),
                });
                i += 1;
            }
            _ => {
                // Within the times of the first, it only serves interpolation.
                let inside = a.first().is_some_and(|first| *first <= b[j]) && i < a.len();
                if !(by.interpolate && inside) {
                    pairs.push(Pairing::Alone(1, j));
                }
                j += 1;
            }
        }
    }
    pairs
}

/// (1 - w) x + w y for every field of floats; integers must be the same at both times.
///
/// # Errors
/// Two times with different meshes or fields.
pub fn interpolate(x: &Results, y: &Results, w: f64) -> Result<Results> {
    let refuse = |what: String| Error::Compare {
        a: x.source.clone(),
        b: y.source.clone(),
        what,
        remedy: "compare times that both results have, without interpolation".into(),
    };
    if x.points != y.points || x.cells != y.cells || x.ids != y.ids {
        return Err(refuse("the mesh is another at the two times".into()));
    }
    let mut between = x.clone();
    between.source = format!("{}, {}", x.source, y.source);
    let others = y.unread.iter().filter(|part| !x.unread.contains(part));
    between.unread.extend(others.cloned());
    // Numbers on a file as a whole belong to its time.
    between.whole.clear();
    let fields = [
        (&mut between.on_points, &y.on_points),
        (&mut between.on_cells, &y.on_cells),
        (&mut between.on_corners, &y.on_corners),
    ];
    for (of_x, of_y) in fields {
        let same = |(f, g): (&ResultField, &ResultField)| {
            f.name == g.name && f.components == g.components && f.at == g.at
        };
        if of_x.len() != of_y.len() || !of_x.iter().zip(of_y).all(same) {
            return Err(refuse("the fields are others at the two times".into()));
        }
        for (f, g) in of_x.iter_mut().zip(of_y) {
            if f.rest.is_some() {
                if f != g {
                    return Err(refuse(format!("the whole numbers of `{}` change", f.name)));
                }
                continue;
            }
            f.single |= g.single;
            let pairs = f.values.to_mut().iter_mut().zip(&g.values);
            pairs.for_each(|(x, y)| *x = (1.0 - w) * *x + w * y);
        }
    }
    Ok(between)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Pairing::{Alone, Between, Both};

    #[test]
    fn times_are_paired_within_their_tolerance() {
        let pair = |a: &[f64], b: &[f64], tolerance| {
            pair_times(
                a,
                b,
                &Times {
                    tolerance,
                    interpolate: false,
                },
            )
        };
        assert_eq!(pair(&[0.1 + 0.2], &[0.3], None), [Both(0, 0)]);
        assert_eq!(pair(&[1.0], &[1.1], None), [Alone(0, 0), Alone(1, 0)]);
        let single = [0.1, 0.2].map(|t| f64::from(t as f32));
        assert_eq!(pair(&[0.1, 0.2], &single, None), [Both(0, 0), Both(1, 1)]);
        assert_eq!(pair(&[0.1, 0.2], &[0.1, 0.200_000_01], None).len(), 3);
        assert_eq!(pair(&[1.0], &[1.1], Some(0.2)), [Both(0, 0)]);
        // The nearest counts, not the first.
        assert_eq!(
            pair(&[1.0], &[0.9, 1.0], Some(0.2)),
            [Alone(1, 0), Both(0, 1)]
        );
        assert_eq!(
            pair(&[0.9, 1.0], &[1.0], Some(0.2)),
            [Alone(0, 0), Both(1, 0)]
        );
        assert_eq!(pair(&[], &[1.0], None), [Alone(1, 0)]);
        assert_eq!(pair(&[1.0, 2.0], &[], None), [Alone(0, 0), Alone(0, 1)]);
    }

    #[test]
    fn what_lies_between_two_times_is_interpolated_where_that_is_asked_for() {
        let by = Times {
            tolerance: None,
            interpolate: true,
        };
        assert_eq!(
            pair_times(&[0.0, 0.25, 1.0], &[0.0, 0.5, 1.0], &by),
            [Both(0, 0), Between(1, 0, 0.5), Both(2, 2)]
        );
        // There is no extrapolation.
        assert_eq!(
            pair_times(&[0.0, 2.0], &[0.0, 1.0], &by),
            [Both(0, 0), Alone(0, 1)]
        );
        assert_eq!(
            pair_times(&[1.0], &[0.0, 1.0, 2.0], &by),
            [Alone(1, 0), Both(0, 1), Alone(1, 2)]
        );
        let at = |value: f64, rest: Option<Vec<f64>>| Results {
            ids: vec![0],
            on_points: vec![ResultField {
                name: "u".into(),
                components: 1,
                values: vec![value].into(),
                rest,
                at: None,
                scaled_by: None,
                single: false,
            }],
            ..Results::default()
        };
        let between = interpolate(&at(1.0, None), &at(3.0, None), 0.25).unwrap();
        assert_eq!(between.on_points[0].values, [1.5]);
        let whole = Some(Vec::new());
        assert!(interpolate(&at(1.0, whole.clone()), &at(1.0, whole.clone()), 0.25).is_ok());
        assert!(interpolate(&at(1.0, whole.clone()), &at(2.0, whole), 0.25).is_err());
        let other = Results {
            ids: vec![1],
            ..at(1.0, None)
        };
        assert!(interpolate(&at(1.0, None), &other, 0.5).is_err());
    }
}
