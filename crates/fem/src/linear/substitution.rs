//! Triangular solves with the columns that [`super::multifrontal`] writes, by the same tree.

use super::analysis::{Front, Plan};
use super::kernels::Number;

/// y := L⁻¹ y in one front; returns what it leaves on the border. `below` are places and values of
/// what comes from the halves.
pub(super) fn forward_front<T: Number>(
    front: &Front,
    columns: &[T],
    y: &mut [f64],
    below: [(&[u32], &[f64]); 2],
) -> Vec<f64> {
    let (size, pivots) = (front.size(), front.pivots as usize);
    let mut x = vec![0.0; size];
    x[..pivots].copy_from_slice(y);
    for (places, values) in below {
        for (&place, value) in places.iter().zip(values) {
            x[place as usize] += value;
        }
    }
    let mut start = 0;
    for j in 0..pivots {
        let column = &columns[start..start + size - j];
        start += size - j;
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] *= column[0].wide();
        for (x, l) in tail.iter_mut().zip(&column[1..]) {
            *x -= l.wide() * head[0];
        }
    }
    y.copy_from_slice(&x[..pivots]);
    x.split_off(pivots)
}

/// x := L⁻ᵀ x in one front; `x` are y of its pivots and the values on its border.
fn backward_front<T: Number>(columns: &[T], pivots: usize, x: &mut [f64]) {
    let size = x.len();
    let mut end = columns.len();
    for j in (0..pivots).rev() {
        let column = &columns[end - (size - j)..end];
        end -= size - j;
        let (head, tail) = x[j..].split_at_mut(1);
        head[0] = (head[0] - dot(&column[1..], tail)) * column[0].wide();
    }
}

/// Σ_i l_i x_i in four parts, which a processor does side by side.
fn dot<T: Number>(l: &[T], x: &[f64]) -> f64 {
    let (l4, l_rest) = l.as_chunks::<4>();
    let (x4, x_rest) = x.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (l, x) in l4.iter().zip(x4) {
        for k in 0..4 {
            sums[k] += l[k].wide() * x[k];
        }
    }
    let rest: f64 = l_rest.iter().zip(x_rest).map(|(l, x)| l.wide() * x).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// y := L⁻¹ y of a part; returns what it leaves on the border.
pub(super) fn forward<T: Number>(plan: &Plan, columns: &[T], y: &mut [f64]) -> Vec<f64> {
    let Some(halves) = &plan.halves else {
        return forward_all(plan, columns, y);
    };
    let (left, right) = (&halves[0], &halves[1]);
    let (of_left, others) = columns.split_at(left.entries);
    let (of_right, columns) = others.split_at(right.entries);
    let (y_left, y_rest) = y.split_at_mut(left.pivots);
    let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
    let (a, b) = rayon::join(
        || forward(left, of_left, y_left),
        || forward(right, of_right, y_right),
    );
    let (in_a, in_b) = plan.maps.split_at(left.border);
    let below = [(in_a, &a[..]), (in_b, &b[..])];
    forward_front(&plan.fronts[0], columns, y_own, below)
}

fn forward_all<T: Number>(plan: &Plan, mut columns: &[T], mut y: &mut [f64]) -> Vec<f64> {
    let mut waiting: Vec<Vec<f64>> = Vec::new();
    for front in &plan.fronts {
        let (own, other) = columns.split_at(front.entries());
        columns = other;
        let (pivots, others) = y.split_at_mut(front.pivots as usize);
        y = others;
        let (mut a, mut b, mut maps) = (Vec::new(), Vec::new(), &[][..]);
        if !front.is_leaf() {
            b = waiting.pop().unwrap_or_default();
            a = waiting.pop().unwrap_or_default();
            maps = &plan.maps[front.map as usize..][..a.len() + b.len()];
        }
        let (in_a, in_b) = maps.split_at(a.len());
        waiting.push(forward_front(front, own, pivots, [(in_a, &a), (in_b, &b)]));
    }
    waiting.pop().unwrap_or_default()
}

/// y := L⁻ᵀ y of a part, `border` the values on its border.
pub(super) fn backward<T: Number>(plan: &Plan, columns: &[T], y: &mut [f64], border: &[f64]) {
    let Some(halves) = &plan.halves else {
        return backward_all(plan, columns, y, border);
    };
    let (left, right) = (&halves[0], &halves[1]);
    let (of_left, others) = columns.split_at(left.entries);
    let (of_right, columns) = others.split_at(right.entries);
    let (y_left, y_rest) = y.split_at_mut(left.pivots);
    let (y_right, y_own) = y_rest.split_at_mut(right.pivots);
    let mut x = [&*y_own, border].concat();
    backward_front(columns, y_own.len(), &mut x);
    y_own.copy_from_slice(&x[..y_own.len()]);
    let (in_left, in_right) = plan.maps.split_at(left.border);
    rayon::join(
        || backward(left, of_left, y_left, &take(&x, in_left)),
        || backward(right, of_right, y_right, &take(&x, in_right)),
    );
}

fn backward_all<T: Number>(plan: &Plan, mut columns: &[T], mut y: &mut [f64], border: &[f64]) {
    // Values on the borders of the fronts to come, the next one's last.
    let mut waiting = border.to_vec();
    let (mut x, mut map_end) = (Vec::new(), plan.maps.len());
    for front in plan.fronts.iter().rev() {
        let pivots = front.pivots as usize;
        let (others, own) = columns.split_at(columns.len() - front.entries());
        columns = others;
        let split = y.len() - pivots;
        let (rest, own_y) = std::mem::take(&mut y).split_at_mut(split);
        y = rest;
        let start = waiting.len() - front.border as usize;
        x.clear();
        x.extend_from_slice(own_y);
        x.extend_from_slice(&waiting[start..]);
        waiting.truncate(start);
        backward_front(own, pivots, &mut x);
        own_y.copy_from_slice(&x[..pivots]);
        if !front.is_leaf() {
            let maps = &plan.maps[front.map as usize..map_end];
            map_end = front.map as usize;
            waiting.extend(maps.iter().map(|&place| x[place as usize]));
        }
    }
}

/// The values at `places`.
fn take(x: &[f64], places: &[u32]) -> Vec<f64> {
    places.iter().map(|&place| x[place as usize]).collect()
}
