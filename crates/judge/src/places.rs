//! Pairs the points of two files by their positions, in O(N log N).
//!
//! Along each axis the coordinates of both files are sorted, and consecutive ones within the tolerance get
//! the same number. Points with the same numbers on all axes are at the same place. There is no grid, whose lines could separate
//! points that belong together.

use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;
use rayon::prelude::*;

/// The number of points per task.
const CHUNK: usize = 1 << 10;
/// How closely coordinates computed by two codes agree in binary64, relative to the extent of the mesh.
const NEAR: f64 = 1e-9;
/// The same for binary32.
const NEAR_SINGLE: f64 = 1e-6;
/// Decimal digits to which a file may have rounded its coordinates: C++ writes six by default, and more than fifteen
/// are full binary64.
const DIGITS: std::ops::RangeInclusive<usize> = 6..=15;

/// The distance along an axis up to which two points are the same. It is larger if a file holds rounded coordinates, so that points
/// that match with more digits match with fewer as well.
///
/// # Errors
/// [`faceoff_mesh::Error::Ended`].
pub(super) fn tolerance(a: &[[f64; 3]], b: &[[f64; 3]]) -> Result<f64> {
    let (mut extent, mut largest) = (0.0_f64, 0.0_f64);
    for axis in 0..3 {
        let of = |points: &[[f64; 3]]| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            points
                .iter()
                .fold(ends, |e, p| (e.0.min(p[axis]), e.1.max(p[axis])))
        };
        let ((low, high), (other_low, other_high)) = (of(a), of(b));
        let (low, high) = (low.min(other_low), high.max(other_high));
        extent = extent.max(high - low);
        largest = largest.max(high.abs()).max(low.abs());
    }
    let all = |points: &[[f64; 3]], rounded: &(dyn Fn(f64) -> bool + Sync)| {
        let found = parallel::map(points.chunks(CHUNK), |points| {
            let mut points = points.iter();
            points.all(|p| cancel::cause().is_none() && p.iter().all(|x| rounded(*x)))
        });
        !found.contains(&false)
    };
    let mut near = NEAR * extent;
    for points in [a, b] {
        if all(points, &|x| f64::from(x as f32) == x) {
            near = near.max(NEAR_SINGLE * extent);
        }
        // The fewest digits count: coordinates that all have six digits also have seven.
        let mut digits = DIGITS;
        let found = digits.find(|d| all(points, &|x| format!("{x:.*e}", d - 1).parse() == Ok(x)));
        if let Some(digits) = found {
            // Half a unit of the last digit is up to 5 · 10^(-digits) of a coordinate, in each file.
            let rounding = 5.5 * 10.0_f64.powi(-(digits as i32)) * largest;
            near = near
                .max(rounding)
                .max(10.0_f64.powi(-(digits as i32)) * extent);
        }
    }
    cancel::check()?;
    Ok(if near.is_finite() { near } else { 0.0 })
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

/// For each point, the first point at its place.
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

/// For each point of `a` the point of `b` at its place; `NOWHERE` if there is none, or if either side has several.
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

    /// Points are found for any number of digits in one file, from six on, also far away from the origin.
    #[test]
    fn the_tolerance_is_that_of_the_coarser_file() {
        let third = |far: f64| -> Vec<[f64; 3]> {
            (0..100)
                .map(|k| [far + f64::from(k) / 37.0, f64::from(k * k) / 7000.0, 0.0])
                .collect()
        };
        fn tolerance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
            super::tolerance(a, b).unwrap()
        }
        let mut before = f64::INFINITY;
        for digits in 6..=17 {
            for far in [0.0, 50.0] {
                let full = third(far);
                let rounded: Vec<[f64; 3]> = full
                    .iter()
                    .map(|p| p.map(|x| format!("{x:.*e}", digits - 1).parse().unwrap()))
                    .collect();
                let near = tolerance(&full, &rounded);
                let n = numbers(&full, &rounded, near).unwrap();
                assert_eq!(n[..100], n[100..], "{digits} digits from {far}");
                if far == 0.0 {
                    assert!(near <= before, "{digits}: {near} {before}");
                    before = near;
                }
            }
        }
        let full = third(0.0);
        let extent = full[99][0];
        assert_eq!(tolerance(&full, &full), 1e-9 * extent);
        let single: Vec<[f64; 3]> = full
            .iter()
            .map(|p| p.map(|x| f64::from(x as f32)))
            .collect();
        let near = tolerance(&full, &single);
        assert!((near / (1e-6 * extent) - 1.0).abs() < 1e-6);
        let n = numbers(&full, &single, near).unwrap();
        assert_eq!(n[..100], n[100..]);
    }
}
