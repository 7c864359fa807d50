//! Which times of two results belong together, and which of one are judged.

use crate::run::Judged;
use faceoff_judge::{Pairing, Times, pair_times};

/// One time of two results: the number of it in each, or why there is nothing to compare.
#[derive(Debug, PartialEq)]
pub(super) struct Row {
    pub t: Option<f64>,
    pub both: Result<[usize; 2], String>,
}

/// Digits that somebody typed, or that a file has with few.
fn typed(t: f64) -> f64 {
    1e-6 * t.abs()
}

/// 0.30000000000000004 is nobody's name for a time.
pub fn short(t: f64) -> f64 {
    format!("{t:.9e}").parse().unwrap_or(t)
}

/// What is judged of two results, by what their codes are called.
pub(super) fn rows(judged: &Judged, names: [&str; 2], times: [&[Option<f64>]; 2]) -> Vec<Row> {
    let [a, b] = times;
    let of = |t, both| Row { t, both };
    let known = [a, b].map(|side| side.iter().copied().collect::<Option<Vec<f64>>>());
    match (judged, known) {
        (Judged::Last, _) => {
            let both = [a.len() - 1, b.len() - 1];
            match [a[both[0]], b[both[1]]] {
                [Some(s), Some(t)] if (s - t).abs() > typed(s.abs().max(t.abs())) => {
                    let last = [short(s), short(t)];
                    let what = format!(
                        "the last time of {} is {}, that of {} is {}",
                        names[0], last[0], names[1], last[1]
                    );
                    vec![of(None, Err(what))]
                }
                [s, t] => vec![of(s.or(t), Ok(both))],
            }
        }
        (Judged::At(list), _) => {
            let of_side = |k: usize, t: f64| match times[k] {
                [None] if list.len() == 1 => Ok(0),
                side => nearest(side, t).ok_or_else(|| lacks(names[k], side, t)),
            };
            let row = |&t: &f64| {
                let both = of_side(0, t).and_then(|i| Ok([i, of_side(1, t)?]));
                of(Some(t), both)
            };
            list.iter().map(row).collect()
        }
        (Judged::All, [Some(of_a), Some(of_b)]) => {
            let alone = |k: usize, t: f64| {
                let what = lacks(names[1 - k], times[1 - k], t);
                of(Some(t), Err(format!("{what}, and {} has it", names[k])))
            };
            let row = |pair| match pair {
                Pairing::Both(i, j) => of(Some(of_a[i]), Ok([i, j])),
                Pairing::Alone(1, j) => alone(1, of_b[j]),
                // Nothing is interpolated.
                Pairing::Alone(_, i) | Pairing::Between(i, ..) => alone(0, of_a[i]),
            };
            pair_times(&of_a, &of_b, &Times::default())
                .into_iter()
                .map(row)
                .collect()
        }
        (Judged::All, _) if a.len() == 1 && b.len() == 1 => vec![of(a[0].or(b[0]), Ok([0, 0]))],
        (Judged::All, [known_a, _]) => {
            let [one, other] = if known_a.is_none() { [0, 1] } else { [1, 0] };
            let what = format!(
                "the result of {} is of no time, and that of {} has {}: name one by `times`, or give it its time",
                names[one],
                names[other],
                times[other].len()
            );
            vec![of(None, Err(what))]
        }
    }
}

fn lacks(name: &str, side: &[Option<f64>], t: f64) -> String {
    let known: Vec<String> = side
        .iter()
        .flatten()
        .map(|t| short(*t).to_string())
        .collect();
    let few = match &known[..] {
        [] => "it is of no time".to_owned(),
        few if few.len() <= 3 => format!("it has {}", few.join(", ")),
        many => format!(
            "it has {}, {}, … {}",
            many[0],
            many[1],
            many[many.len() - 1]
        ),
    };
    format!("{name} has no time {} ({few})", short(t))
}

fn nearest(side: &[Option<f64>], t: f64) -> Option<usize> {
    let far = |k: &usize| side[*k].map_or(f64::INFINITY, |s| (s - t).abs());
    let near = (0..side.len()).min_by(|i, j| far(i).total_cmp(&far(j)))?;
    let largest = side.iter().flatten().fold(0.0_f64, |m, s| m.max(s.abs()));
    (far(&near) <= typed(t).max(1e-9 * largest)).then_some(near)
}

/// The times of one result that are judged.
pub(super) fn of_one(judged: &Judged, times: &[Option<f64>]) -> Vec<usize> {
    match judged {
        Judged::All => (0..times.len()).collect(),
        Judged::Last => vec![times.len() - 1],
        Judged::At(list) if times == [None] && list.len() == 1 => vec![0],
        Judged::At(list) => list.iter().filter_map(|t| nearest(times, *t)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(judged: &Judged, a: &[Option<f64>], b: &[Option<f64>]) -> Vec<String> {
        let rows = rows(judged, ["a", "b"], [a, b]).into_iter();
        let row = |row: Row| match row.both {
            Ok([i, j]) => format!("{:?} {i} {j}", row.t),
            Err(why) => why,
        };
        rows.map(row).collect()
    }

    #[test]
    fn no_time_is_passed_over() {
        let at = |times: &[f64]| times.iter().copied().map(Some).collect::<Vec<_>>();
        let (two, three) = (at(&[0.1, 0.2]), at(&[0.1, 0.1 + 0.1, 0.1 + 0.2]));
        let all = Judged::All;
        assert_eq!(
            told(&all, &two, &three),
            [
                "Some(0.1) 0 0",
                "Some(0.2) 1 1",
                "a has no time 0.3 (it has 0.1, 0.2), and b has it"
            ]
        );
        assert_eq!(told(&all, &at(&[0.5]), &[None]), ["Some(0.5) 0 0"]);
        assert_eq!(told(&all, &[None], &[None]), ["None 0 0"]);
        assert!(told(&all, &at(&[0.1]), &at(&[0.2]))[0].contains("no time"));
        assert!(told(&all, &[None], &two)[0].contains("the result of a is of no time"));
        assert!(told(&all, &two, &[None])[0].contains("the result of b is of no time"));
        assert!(told(&Judged::Last, &two, &three)[0].contains("is 0.2, that of b is 0.3"));
        assert_eq!(told(&Judged::Last, &two, &[None]), ["Some(0.2) 1 0"]);
        let list = Judged::At(vec![0.1, 0.3]);
        assert_eq!(
            told(&list, &three, &two),
            ["Some(0.1) 0 0", "b has no time 0.3 (it has 0.1, 0.2)"]
        );
        assert!(told(&list, &three, &[None])[0].contains("of no time"));
        assert_eq!(of_one(&list, &three), [0, 2]);
    }
}
