//! Vectors that formats hold as fields of one component each, as in `u_x`, `u_y`, `u_z`.

use super::loss::Losses;
use super::sets;
use crate::mesh::{Field, Values};

/// The name without the letter of an axis, and that axis.
fn axis(name: &str) -> Option<(&str, usize)> {
    let last = name.chars().next_back()?;
    let axis = "xyz".find(last.to_ascii_lowercase())?;
    let stem = name.get(..name.len() - 1)?;
    // A component of a tensor ends in two such letters.
    let before = stem.chars().next_back()?;
    let is_tensor = if last.is_uppercase() { "XYZ" } else { "xyz" }.contains(before);
    (!is_tensor).then_some((stem, axis))
}

/// Joins neighbours that are the components of a vector of two or three.
pub fn join(fields: &mut Vec<Field>) {
    let mut joined: Vec<Field> = Vec::with_capacity(fields.len());
    let mut rest = std::mem::take(fields).into_iter().peekable();
    while let Some(field) = rest.next() {
        let mut parts = vec![field];
        while let Some(next) = rest.peek()
            && parts.len() < 3
            && is_next(&parts, next)
        {
            parts.extend(rest.next());
        }
        if parts.len() == 1 {
            joined.append(&mut parts);
            continue;
        }
        let stem = axis(&parts[0].name).map_or("", |(stem, _)| stem).to_owned();
        // One mark between the name and the letter is not part of the name.
        let name = stem
            .strip_suffix(['_', ' ', '-', '.'])
            .unwrap_or(&stem)
            .to_owned();
        let columns: Vec<Vec<f64>> = parts.iter().map(|part| part.values.to_f64()).collect();
        let rows = 0..columns[0].len();
        let values = rows.flat_map(|row| columns.iter().map(move |column| column[row]));
        let values = match parts
            .iter()
            .all(|part| matches!(part.values, Values::F32(_)))
        {
            true => Values::F32(values.map(|value| value as f32).collect()),
            false => Values::F64(values.collect()),
        };
        let first = parts.swap_remove(0);
        joined.push(Field {
            name: if name.is_empty() { stem } else { name },
            components: columns.len(),
            values,
            ..first
        });
    }
    *fields = joined;
}

/// Whether a field continues a vector whose first components these are.
fn is_next(parts: &[Field], next: &Field) -> bool {
    let [first, ..] = parts else {
        return false;
    };
    let same = (next.on, &next.at, next.time) == (first.on, &first.at, first.time)
        && next.values.len() == first.values.len()
        && [first, next].iter().all(|field| field.components == 1);
    match (axis(&first.name), axis(&next.name)) {
        (Some((stem, 0)), Some((other, k))) => same && stem == other && k == parts.len(),
        _ => false,
    }
}

/// The names of the components of a field in a format of scalars, of at most a given number of bytes: `u` itself, `u_x`, `u_y`, or
/// `u_1`, `u_2`, …, which [`join`] leaves apart.
pub fn names(field: &Field, longest: usize, losses: &mut Losses) -> Vec<String> {
    let name = &field.name;
    let tails: Vec<String> = match field.components {
        1 => vec![String::new()],
        few @ (2 | 3) => ["_x", "_y", "_z"][..few]
            .iter()
            .map(|&tail| tail.to_owned())
            .collect(),
        many => (1..=many).map(|k| format!("_{k}")).collect(),
    };
    if field.components > 3 {
        losses.note(format!("the field {name:?} is {} scalars", tails.len()));
    }
    let tail = tails.iter().map(String::len).max().unwrap_or(0);
    let stem = sets::cut(name, longest.saturating_sub(tail));
    if stem != *name {
        losses.note(format!("the field {name:?} is called {stem:?}"));
    }
    tails.iter().map(|tail| format!("{stem}{tail}")).collect()
}
