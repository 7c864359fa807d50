//! `$NodeData`, `$ElementData` and `$ElementNodeData`: fields.

use super::layout::Reader;
use crate::error::Result;
use crate::field::{Tell, Unread};
use crate::io::scan::{Numbers, Scan};
use crate::mesh::{Field, Support, Values};

/// Reads one section.
pub fn read(reader: &mut Reader<'_>, on: Support) -> Result<()> {
    let (scan, builder, content) = reader.parts();
    if builder.points.is_none() || !builder.elements_seen {
        return Err(scan.error("the values come before the nodes or elements"));
    }
    if on != Support::Points {
        builder.index_cells();
    }
    let index = builder
        .cell_index
        .as_ref()
        .filter(|_| on != Support::Points);
    let by_tag = index.map_or(builder.points.as_ref(), |index| Some(&index.by_tag));
    let kinds = match on {
        Support::CellPoints => index.map_or(&[][..], |index| &index.kinds),
        Support::Points | Support::Cells => &[],
    };
    let head = head(scan, &mut content.unread)?;
    let ascii = scan.numbers == Numbers::Ascii;
    let width = scan.least(2 + 2 * head.components, 4 + 8 * head.components);
    let rows = scan.believe(head.rows, "rows", width)?;

    let mut values = Vec::with_capacity(rows * head.components);
    // Index, and the first value and number of values of its row.
    let mut order: Vec<(u32, usize, usize)> = Vec::with_capacity(rows);
    let mut missing = 0;
    for _ in 0..rows {
        let tag = if ascii {
            scan.u64()?
        } else {
            u64::from(scan.i32()?.unsigned_abs())
        };
        let index = by_tag.and_then(|by_tag| by_tag.get(tag));
        let mut len = head.components;
        let Some(index) = index else {
            // Gmsh leaves out what is in no group, but not its values.
            missing += 1;
            let nodes = if on == Support::CellPoints {
                scan.i32()?
            } else {
                1
            };
            for _ in 0..len.saturating_mul(usize::try_from(nodes).unwrap_or(0)) {
                scan.any_f64()?;
            }
            continue;
        };
        if let Some(kind) = kinds.get(index as usize) {
            let nodes = scan.i32()?;
            if usize::try_from(nodes) != Ok(kind.points()) {
                return Err(scan.error(format!(
                    "values at {nodes} nodes for element {tag}, a {kind}"
                )));
            }
            len *= kind.points();
        }
        order.push((index, values.len(), len));
        for _ in 0..len {
            values.push(scan.any_f64()?);
        }
    }
    if missing > 0 {
        let what = if on == Support::Points {
            "nodes"
        } else {
            "elements"
        };
        content.unread.tell(
            &head.name,
            format!(
                "{missing} rows of the field {:?}, of {what} that are not in the file",
                head.name
            ),
        );
    }
    if !order.is_sorted_by(|a, b| a.0 < b.0) {
        order.sort_by_key(|row| row.0);
        if let Some(twice) = order.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(scan.error(format!("{} has two rows of values", twice[0].0)));
        }
        let rows = order
            .iter()
            .flat_map(|&(_, first, len)| values.get(first..first + len).unwrap_or_default());
        values = rows.copied().collect();
    }
    let all = builder.mesh.items(on);
    if order.is_empty() && all > 0 {
        content.unread.tell(
            &head.name,
            format!("the field {:?}, which has no values", head.name),
        );
        return Ok(());
    }
    let field = Field {
        time: head.time,
        step: head.step,
        ..Field::new(head.name, on, head.components, Values::F64(values.into()))
    };
    let at = order.iter().map(|row| row.0).collect();
    builder.mesh.fields.push(field.only(at, all));
    Ok(())
}

struct FieldHead {
    name: String,
    time: Option<f64>,
    step: Option<i32>,
    components: usize,
    rows: u64,
}

/// The tags before the values, which are text in binary files too: strings, numbers, integers.
fn head(scan: &mut Scan<'_>, unread: &mut Vec<Unread>) -> Result<FieldHead> {
    let numbers = std::mem::replace(&mut scan.numbers, Numbers::Ascii);
    let strings = scan.count("strings", 2)?;
    scan.line();
    let mut name = String::new();
    for index in 0..strings {
        let line = String::from_utf8_lossy(scan.line().trim_ascii()).into_owned();
        if index == 0 {
            let bare = line
                .strip_prefix('"')
                .and_then(|name| name.strip_suffix('"'));
            name = bare.unwrap_or(&line).to_owned();
        } else {
            unread.tell(&name, format!("the text {line} of field {name:?}"));
        }
    }
    let reals = scan.count("numbers", 2)?;
    let reals: Vec<f64> = (0..reals).map(|_| scan.f64()).collect::<Result<_>>()?;
    let integers = scan.count("integers", 2)?;
    let integers: Vec<i32> = (0..integers).map(|_| scan.i32()).collect::<Result<_>>()?;
    let &[step, components, rows, ref more @ ..] = integers.as_slice() else {
        return Err(scan.error("step, number of components and number of rows are missing"));
    };
    if more.iter().any(|&value| value != 0) || reals.len() > 1 {
        unread.tell(
            &name,
            format!("the partition and further numbers of field {name:?}"),
        );
    }
    if numbers != Numbers::Ascii {
        scan.line();
    }
    scan.numbers = numbers;
    let components = usize::try_from(components)
        .ok()
        .filter(|c| (1..=100_000).contains(c));
    let components =
        components.ok_or_else(|| scan.error("the number of components is not sensible"))?;
    let rows = u64::try_from(rows).map_err(|_| scan.error(format!("{rows} rows are declared")))?;
    Ok(FieldHead {
        name,
        time: reals.first().copied(),
        step: Some(step),
        components,
        rows,
    })
}
