//! Pairs the points of two files by their positions, in O(N log N).
//!
//! Along each axis the coordinates of both files are sorted, and consecutive ones within the tolerance get
//! one number. Points with the same numbers on all axes are at one place. There is no grid, whose lines could separate
//! points that belong together.

use rayon::prelude::*;

use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;

/// How closely coordinates computed by two codes agree in binary64, relative to the extent of the mesh.
const NEAR: f64 = 1e-9;
/// The same for binary32, and for six decimal digits, which C++ writes by default.
const NEAR_ROUNDED: f64 = 1e-6;

/// How far apart two points may be along an axis and still be one; more if a file holds rounded coordinates.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn tolerance(a: &[[f64; 3]], b: &[[f64; 3]]) -> Result<f64> {
    let mut extent: f64 = 0.0;
    for axis in 0..3 {
        let of = |points: &[[f64; 3]]| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            points
                .iter()
                .fold(ends, |e, p| (e.0.min(p[axis]), e.1.max(p[axis])))
        };
        let ((low, high), (other_low, other_high)) = (of(a), of(b));
        extent = extent.max(high.max(other_high) - low.min(other_low));
    }
    let is_rounded = |points: &[[f64; 3]]| {
        let all = |rounded: fn(f64) -> bool| {
            let points = points.par_iter();
            points.all(|p| cancel::cause().is_none() && p.iter().all(|x| rounded(*x)))
        };
        all(|x| f64::from(x as f32) == x) || all(|x| format!("{x:.5e}").parse() == Ok(x))
    };
    let near = if is_rounded(a) || is_rounded(b) {
        NEAR_ROUNDED
    } else {
        NEAR
    };
    cancel::check()?;
    Ok(near * extent)
}

/// The number of the place of each point, first of `a`, then of `b`.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn numbers(a: &[[f64; 3]], b: &[[f64; 3]], near: f64) -> Result<Vec<u32>> {
    let count = a.len() + b.len();
    let mut place = vec![0u32; count];
    let mut keyed: Vec<(u64, u32)> = Vec::new();
    for axis in 0..3 {
        let on_axis = numbers_on_axis(a, b, axis, near)?;
        if on_axis.iter().all(|n| *n == 0) {
            continue;
        }
        // Combined with the previous axes: first the distinct pairs, then their numbers.
        keyed.clear();
        let pairs = place.iter().zip(&on_axis).zip(0..);
        keyed.extend(pairs.map(|((&p, &n), k)| (u64::from(p) << 32 | u64::from(n), k)));
        keyed.par_sort_unstable();
        let mut number = 0;
        for k in 0..keyed.len() {
            cancel::check()?;
            if k > 0 && keyed[k].0 != keyed[k - 1].0 {
                number += 1;
            }
            place[keyed[k].1 as usize] = number;
        }
    }
    Ok(place)
}

/// For each point the first at its place.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub fn first_at_place(points: &[[f64; 3]]) -> Result<Vec<u32>> {
    let numbers = numbers(points, &[], tolerance(points, &[])?)?;
    let mut first = vec![None; points.len()];
    let of = (0..)
        .zip(&numbers)
        .map(|(point, place)| *first[*place as usize].get_or_insert(point));
    Ok(of.collect())
}

/// For each point of `a` the point of `b` at its place; none where there is none, or where either side has several.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub fn partners(a: &[[f64; 3]], b: &[[f64; 3]]) -> Result<Vec<Option<u32>>> {
    let place = numbers(a, b, tolerance(a, b)?)?;
    let (of_a, of_b) = place.split_at(a.len());
    let places = place.iter().max().map_or(0, |last| *last as usize + 1);
    let mut there = vec![(0u32, 0u32, 0u32); places];
    for &place in of_a {
        there[place as usize].0 += 1;
    }
    for (&place, point) in of_b.iter().zip(0..) {
        let there = &mut there[place as usize];
        (there.1, there.2) = (there.1 + 1, point);
    }
    let partner = |place: &u32| match there[*place as usize] {
        (1, 1, point) => Some(point),
        _ => None,
    };
    Ok(of_a.iter().map(partner).collect())
}

fn numbers_on_axis(a: &[[f64; 3]], b: &[[f64; 3]], axis: usize, near: f64) -> Result<Vec<u32>> {
    let points = a.iter().chain(b).map(|p| p[axis]);
    let mut sorted: Vec<(f64, u32)> = points.zip(0..).collect();
    sorted.par_sort_unstable_by(|p, q| p.0.total_cmp(&q.0));
    let mut numbers = vec![0; sorted.len()];
    let mut number = 0;
    for k in 0..sorted.len() {
        cancel::check()?;
        if k > 0 && sorted[k].0 - sorted[k - 1].0 > near {
            number += 1;
        }
        numbers[sorted[k].1 as usize] = number;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_one_place_within_the_tolerance_on_every_axis() {
        let a = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let b = [[1.0, 1.0 - 1e-12, 0.0], [1e-12, 0.0, 0.0], [1.0, 0.0, 1.0]];
        let n = numbers(&a, &b, tolerance(&[[0.1; 3]], &a).unwrap()).unwrap();
        assert_eq!((n[0], n[2]), (n[4], n[3]));
        let mut distinct = n.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), 4);
    }

    #[test]
    fn a_partner_is_the_only_one_at_its_place() {
        let a = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0 / 3.0; 3]];
        let b = [
            [2.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0 / 3.0; 3],
        ];
        assert_eq!(partners(&a, &b).unwrap(), [None, None, Some(0), Some(3)]);
        assert_eq!(first_at_place(&b).unwrap(), [0, 1, 1, 3]);
    }

    #[test]
    fn the_tolerance_is_that_of_the_coarser_file() {
        let third = [[1.0 / 3.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        let single = third.map(|p| p.map(|x| f64::from(x as f32)));
        fn tolerance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
            super::tolerance(a, b).unwrap()
        }
        assert_eq!(tolerance(&third, &third), 1e-9);
        assert_eq!(tolerance(&third, &single), 1e-6);
        let decimal = [[0.333333, 1.0, 0.0], [0.0, 0.0, 0.0]];
        assert_eq!(tolerance(&decimal, &third), 1e-6);
        for rounded in [single, decimal] {
            let n = numbers(&third, &rounded, tolerance(&third, &rounded)).unwrap();
            assert_eq!(n[..2], n[2..]);
        }
    }
}
