//! Results at nodes and on elements: datasets 55, 56 and 2414.

use super::read::Reader;
use crate::error::Result;
use crate::field::Tell;
use crate::mesh::{Field, Support, Values};

/// Reads the results of one dataset.
pub fn read(reader: &mut Reader<'_>, dataset: u64) -> Result<()> {
    let (name, on, head, time, step) = match dataset {
        2414 => {
            reader.line()?;
            let name = text(reader)?;
            let on = reader.ints()?.first().copied().unwrap_or(0);
            for _ in 0..5 {
                reader.line()?;
            }
            let head = reader.ints()?;
            let analysis = reader.ints()?;
            reader.ints()?;
            let times = reader.reals()?;
            reader.reals()?;
            (
                name,
                on,
                head,
                times.first().copied(),
                analysis.get(6).copied(),
            )
        }
        _ => {
            let name = text(reader)?;
            for _ in 0..4 {
                reader.line()?;
            }
            let head = reader.ints()?;
            let analysis = reader.ints()?;
            let times = reader.reals()?;
            let transient = head.get(1) == Some(&4);
            let time = times.first().copied().filter(|_| transient);
            (
                name,
                if dataset == 55 { 1 } else { 2 },
                head,
                time,
                analysis.get(3).copied().filter(|_| transient),
            )
        }
    };
    let &[.., kind, components] = head.as_slice() else {
        return Err(reader.scan.error("the kind of the values is missing"));
    };
    let components = usize::try_from(components)
        .ok()
        .filter(|c| (1..=100_000).contains(c));
    let (Some(components), true, 1 | 2) = (components, matches!(kind, 2 | 4), on) else {
        let what = if matches!(kind, 5 | 6) {
            "complex values"
        } else {
            "values neither at nodes nor on elements"
        };
        reader
            .unread
            .tell(&name, format!("the results {name:?}, which are {what}"));
        return Ok(());
    };
    let mut rows: Vec<(u32, Vec<f64>)> = Vec::new();
    let mut lost = 0;
    if on == 2 {
        reader.builder.index_cells();
    }
    while let Some(mut row) = reader.row() {
        let number = row.u64()?;
        let count = match (on, row.peek()) {
            (2, Some(_)) => usize::try_from(row.u64()?).unwrap_or(0),
            _ => components,
        };
        if count != components {
            return Err(row.error(format!("{number} has {count} values, and not {components}")));
        }
        let mut values = Vec::new();
        while values.len() < components {
            values.extend(reader.reals()?);
        }
        values.truncate(components);
        let index = reader.builder.cell_index.as_ref().filter(|_| on == 2);
        let lookup = index.map_or(reader.builder.points.as_ref(), |index| Some(&index.by_tag));
        match lookup.and_then(|lookup| lookup.get(number)) {
            Some(at) => rows.push((at, values)),
            None => lost += 1,
        }
    }
    if lost > 0 {
        reader.unread.tell(
            &name,
            format!("{lost} rows of the results {name:?}, of what does not exist"),
        );
    }
    rows.sort_by_key(|(at, _)| *at);
    if rows.windows(2).any(|pair| pair[0].0 == pair[1].0) {
        return Err(reader
            .scan
            .error(format!("the results {name:?} have two rows for one item")));
    }
    if rows.is_empty() {
        return Ok(());
    }
    let mesh = &mut reader.builder.mesh;
    let on = match on {
        1 => Support::Points,
        _ => Support::Cells,
    };
    let at = rows.iter().map(|(at, _)| *at).collect();
    let values = rows.into_iter().flat_map(|(_, values)| values).collect();
    let field = Field {
        time,
        step: step.and_then(|step| i32::try_from(step).ok()),
        ..Field::new(name, on, components, Values::F64(values))
    };
    mesh.fields.push(field.only(at, mesh.items(on)));
    Ok(())
}

fn text(reader: &mut Reader<'_>) -> Result<String> {
    Ok(String::from_utf8_lossy(reader.line()?.rest())
        .trim()
        .to_owned())
}
