//! PLY, text and binary.

use std::path::Path;

use super::Surface;
use crate::error::Result;
use crate::field::Tell;
use crate::io::scalar::Number;
use crate::io::scan::{Numbers, Scan};
use crate::io::{Content, Native, Read, meshio};
use crate::mesh::{Field, Support, Values};

pub static FORMAT: Native = Native {
    title: "PLY",
    names: &["ply"],
    suffixes: &["ply"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r"),
    read: Read::Once(read),
    write: |job| meshio::write(job, "ply"),
};

/// A property of PLY: its name, the type of its values, and of the number of values if it is a list.
type Property = (String, Number, Option<Number>);

const TYPES: [(Number, [&str; 2]); 8] = [
    (Number::I8, ["char", "int8"]),
    (Number::U8, ["uchar", "uint8"]),
    (Number::I16, ["short", "int16"]),
    (Number::U16, ["ushort", "uint16"]),
    (Number::I32, ["int", "int32"]),
    (Number::U32, ["uint", "uint32"]),
    (Number::F32, ["float", "float32"]),
    (Number::F64, ["double", "float64"]),
];

fn read_number(of: Number, scan: &mut Scan<'_>) -> Result<f64> {
    match scan.numbers {
        Numbers::Ascii => scan.any_f64(),
        numbers => Ok(of.read(scan.bytes(of.size(), 1)?, numbers == Numbers::Big)),
    }
}

/// Points with their further properties as fields, and faces with theirs.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::new(path, bytes);
    let mut elements: Vec<(String, u64, Vec<Property>)> = Vec::new();
    let mut numbers = Numbers::Ascii;
    loop {
        let Some(row) = scan.row() else {
            return Err(scan.error("end_header is missing"));
        };
        let text = String::from_utf8_lossy(row.rest()).into_owned();
        let words: Vec<&str> = text.split_whitespace().collect();
        let named = |name: &str| {
            let found = TYPES.iter().find(|(_, names)| names.contains(&name));
            found.map(|(number, _)| *number)
        };
        let unknown = || row.error(format!("{text:?} is not a line of a header"));
        match words.as_slice() {
            ["end_header"] => break,
            ["format", "ascii", _] => numbers = Numbers::Ascii,
            ["format", "binary_little_endian", _] => numbers = Numbers::Little,
            ["format", "binary_big_endian", _] => numbers = Numbers::Big,
            ["element", name, count] => elements.push((
                (*name).to_owned(),
                count.parse().map_err(|_| unknown())?,
                Vec::new(),
            )),
            ["property", rest @ ..] => {
                let property = match rest {
                    ["list", count, of, name] => named(of)
                        .zip(named(count))
                        .map(|(of, count)| ((*name).to_owned(), of, Some(count))),
                    [of, name] => named(of).map(|of| ((*name).to_owned(), of, None)),
                    _ => None,
                };
                let (.., properties) = elements.last_mut().ok_or_else(unknown)?;
                properties.push(property.ok_or_else(unknown)?);
            }
            ["ply"] | ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(unknown()),
        }
    }
    scan.numbers = numbers;
    let mut surface = Surface::default();
    for (name, declared, properties) in elements {
        scan.section.clone_from(&name);
        let least = properties
            .iter()
            .map(|(_, of, count)| scan.least(2, count.unwrap_or(*of).size()))
            .sum();
        let rows = scan.believe(declared, &name, least)?;
        let corners = properties
            .iter()
            .position(|(known, _, count)| count.is_some() && known.starts_with("vert"));
        let axes =
            ["x", "y", "z"].map(|axis| properties.iter().position(|(known, ..)| known == axis));
        let ends = ["vertex1", "vertex2"]
            .map(|end| properties.iter().position(|(known, ..)| known == end));
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); properties.len()];
        let (mut cells, mut lists) = (Vec::new(), 0);
        for _ in 0..rows {
            let mut values = vec![0.0; properties.len()];
            let mut found = Vec::new();
            for (place, (_, of, count)) in properties.iter().enumerate() {
                let Some(count) = count else {
                    values[place] = read_number(*of, &mut scan)?;
                    continue;
                };
                let length = read_number(*count, &mut scan)?;
                let length = scan.believe(
                    if length >= 0.0 {
                        length as u64
                    } else {
                        u64::MAX
                    },
                    "values",
                    scan.least(2, of.size()),
                )?;
                for _ in 0..length {
                    let value = read_number(*of, &mut scan)?;
                    if corners == Some(place) {
                        found.push(value);
                    }
                }
                lists += usize::from(corners != Some(place));
            }
            if let ("edge", [Some(a), Some(b)]) = (name.as_str(), ends) {
                found = vec![values[a], values[b]];
            }
            let cell = match name.as_str() {
                "vertex" => {
                    let at = axes.map(|axis| axis.map_or(0.0, |axis| values[axis]));
                    if at.iter().any(|x| !x.is_finite()) {
                        return Err(scan.error("a coordinate is not finite"));
                    }
                    surface.builder.mesh.points.to_mut().push(at);
                    None
                }
                "face" | "edge" => {
                    let points = surface.builder.mesh.points.len();
                    let point = |&x: &f64| {
                        (x >= 0.0 && x < points as f64 && x.fract() == 0.0).then_some(x as u32)
                    };
                    let points: Option<Vec<u32>> = found.iter().map(point).collect();
                    surface.polygon(
                        &points
                            .ok_or_else(|| scan.error("a face has a point that is not there"))?,
                    )
                }
                _ => continue,
            };
            if name == "vertex" || cell.is_some() {
                columns
                    .iter_mut()
                    .zip(values)
                    .for_each(|(column, value)| column.push(value));
                cells.extend(cell);
            }
        }
        if lists > 0 {
            surface
                .unread
                .tell(&name, format!("{lists} lists of {name}"));
        }
        let on = match name.as_str() {
            "vertex" => Support::Points,
            "face" | "edge" => Support::Cells,
            other => {
                surface
                    .unread
                    .tell(other, format!("{rows} rows of {other}"));
                continue;
            }
        };
        for (place, ((name, _, count), values)) in properties.iter().zip(columns).enumerate() {
            let used =
                on == Support::Points && axes.contains(&Some(place)) || ends.contains(&Some(place));
            if count.is_none() && !used && !values.is_empty() {
                let at = if on == Support::Points {
                    Vec::new()
                } else {
                    cells.clone()
                };
                surface.builder.mesh.fields.push(Field {
                    at,
                    ..Field::new(name, on, 1, Values::F64(values.into()))
                });
            }
        }
    }
    // A field of all cells names none of them.
    let count = surface.builder.cell_count() as usize;
    let fields = surface.builder.mesh.fields.iter_mut();
    fields
        .filter(|field| field.on == Support::Cells && field.at.len() == count)
        .for_each(|field| field.at.clear());
    Ok(surface.content(numbers))
}
