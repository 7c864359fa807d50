//! Surfaces of polygons as graphics programs have them: OBJ, OFF, PLY and STL. Read here, written by meshio.
//!
//! Of polygons, triangles and quadrangles are cells; others are told. So are normals, textures and the like.

use std::collections::HashMap;
use std::path::Path;

use super::builder::Builder;
use super::recognise::begins;
use super::scan::{Numbers, Scan};
use super::{Content, Native, meshio};
use crate::error::Result;
use crate::mesh::{CellKind, Field, Support, Values};

pub static STL: Native = Native {
    title: "STL",
    names: &["stl"],
    suffixes: &["stl"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| {
        is_binary_stl(bytes)
            || (begins(bytes, "solid") && super::recognise::head_has(bytes, "facet"))
    },
    read: stl,
    write: |path, mesh, _, options| meshio::write(path, mesh, "stl", options),
};

pub static OFF: Native = Native {
    title: "OFF",
    names: &["off"],
    suffixes: &["off"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| off_head(bytes).is_some(),
    read: off,
    write: |path, mesh, _, options| meshio::write(path, mesh, "off", options),
};

pub static PLY: Native = Native {
    title: "PLY",
    names: &["ply"],
    suffixes: &["ply"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r"),
    read: ply,
    write: |path, mesh, _, options| meshio::write(path, mesh, "ply", options),
};

pub static OBJ: Native = Native {
    title: "OBJ",
    names: &["obj"],
    suffixes: &["obj"],
    has_binary: false,
    holds_whole: false,
    recognises: is_obj,
    read: obj,
    write: |path, mesh, _, options| meshio::write(path, mesh, "obj", options),
};

/// Cells of a surface, and how many polygons are none.
#[derive(Default)]
struct Surface {
    builder: Builder,
    others: usize,
    unread: Vec<String>,
}

impl Surface {
    /// The cell of these points, if there is one.
    fn polygon(&mut self, points: &[u32]) -> Option<u32> {
        let kind = match points.len() {
            1 => CellKind::Vertex,
            2 => CellKind::Line,
            3 => CellKind::Triangle,
            4 => CellKind::Quadrangle,
            _ => {
                self.others += 1;
                return None;
            }
        };
        let number = self.builder.new_number();
        Some(self.builder.cell(kind, points, number, 0))
    }

    fn content(mut self, format: &str, encoding: &str) -> Content {
        if self.others > 0 {
            self.unread.push(format!(
                "{} polygons of more than four corners",
                self.others
            ));
        }
        Content {
            mesh: self.builder.finish(),
            format: format.into(),
            encoding: encoding.into(),
            unread: self.unread,
            ..Content::default()
        }
    }
}

/// Whether the length is that of as many triangles as are declared; texts begin with `solid`, and so do some of these.
fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..).and_then(|rest| rest.first_chunk::<4>());
    count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(u32::from_le_bytes(*count)))
}

/// Equal corners of triangles are one point; a solid with a name is a group.
fn stl(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut surface = Surface::default();
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let mut point = |surface: &mut Surface, at: [f64; 3]| {
        let points = &mut surface.builder.mesh.points;
        *known
            .entry(at.map(|x| (x + 0.0).to_bits()))
            .or_insert_with(|| {
                points.push(at);
                points.len() as u32 - 1
            })
    };
    let mut scan = Scan::new(path, bytes);
    if is_binary_stl(bytes) {
        scan.advance(80);
        (scan.numbers, scan.single) = (Numbers::Little, true);
        let count = scan.int()?;
        let mut marked = 0;
        for _ in 0..count {
            scan.bytes(12, 1)?;
            let mut corners = [0; 3];
            for corner in &mut corners {
                let at = [scan.real()?, scan.real()?, scan.real()?];
                *corner = point(&mut surface, at);
            }
            marked += usize::from(scan.bytes(2, 1)? != [0, 0]);
            surface.polygon(&corners);
        }
        if marked > 0 {
            surface
                .unread
                .push(format!("the attributes of {marked} triangles"));
        }
        return Ok(surface.content("stl", "binary-little"));
    }
    let (mut name, mut corners, mut ended) = (String::new(), Vec::new(), false);
    let mut solid = Vec::new();
    while let Some(mut row) = scan.row() {
        let word = row.word().unwrap_or_default().to_ascii_lowercase();
        match word.as_slice() {
            b"solid" => {
                (name, ended) = (String::from_utf8_lossy(row.rest()).trim().to_owned(), false)
            }
            b"vertex" => {
                let at = row.xyz()?;
                corners.push(point(&mut surface, at));
            }
            b"endfacet" => {
                solid.extend(surface.polygon(&corners));
                corners.clear();
            }
            b"endsolid" => {
                ended = true;
                if !name.is_empty() {
                    surface.builder.set(&name, solid.drain(..));
                }
                solid.clear();
            }
            b"" | b"facet" | b"outer" | b"endloop" => {}
            _ => {
                return Err(row.error(format!(
                    "{:?} is no word of this format",
                    String::from_utf8_lossy(&word)
                )));
            }
        }
    }
    if !ended || !corners.is_empty() {
        return Err(scan.error("endsolid is missing"));
    }
    Ok(surface.content("stl", "ascii"))
}

/// The word that files start with: what points have besides coordinates, and OFF. Whether they have four coordinates.
fn off_head(bytes: &[u8]) -> Option<bool> {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'#');
    let head = scan.word()?.strip_suffix(b"OFF")?;
    let plain = head.iter().all(|letter| b"STCN4".contains(letter));
    (plain && scan.peek() != Some(b"BINARY")).then(|| head.contains(&b'4'))
}

fn off(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    scan.word();
    if off_head(bytes) == Some(true) {
        return Err(scan.error_with(
            "points with four coordinates are not read",
            "save the surface as OFF",
        ));
    }
    let mut surface = Surface::default();
    let (points, faces) = (scan.count("points", 6)?, scan.u64()?);
    // The number of edges, which says nothing.
    scan.u64()?;
    let faces = scan.believe(faces, "faces", 4)?;
    let mut more = 0;
    for _ in 0..points {
        let at = scan.xyz()?;
        surface.builder.mesh.points.push(at);
        more += usize::from(!line_is_done(&mut scan));
    }
    for _ in 0..faces {
        let count = scan.count("corners", 2)?;
        let corners: Vec<u32> = (0..count)
            .map(|_| corner(&mut scan, points))
            .collect::<Result<_>>()?;
        more += usize::from(!line_is_done(&mut scan));
        surface.polygon(&corners);
    }
    if more > 0 {
        surface
            .unread
            .push(format!("colours or normals of {more} points and faces"));
    }
    Ok(surface.content("off", "ascii"))
}

/// Moves to the next line; whether nothing but a comment was left.
fn line_is_done(scan: &mut Scan<'_>) -> bool {
    let rest = scan.line().trim_ascii_start();
    rest.is_empty() || rest.starts_with(b"#")
}

/// A point that is counted from 0.
fn corner(scan: &mut Scan<'_>, points: usize) -> Result<u32> {
    match u32::try_from(scan.int()?) {
        Ok(point) if (point as usize) < points => Ok(point),
        _ => Err(scan.error(format!("a face has a point beyond the {points} there are"))),
    }
}

/// Whether the first line that is no comment is a point or what may stand before it.
fn is_obj(bytes: &[u8]) -> bool {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'#');
    let word = scan.word().unwrap_or_default();
    let point = |mut scan: Scan<'_>| (0..3).all(|_| scan.f64().is_ok());
    match word {
        b"v" => point(scan),
        b"mtllib" | b"o" | b"g" | b"vn" | b"vt" => memchr::memmem::find(bytes, b"\nv ").is_some(),
        _ => false,
    }
}

/// Bytes of the longest name.
const LONGEST: usize = 4096;

/// The names of sets, and faces in these: the numbers of their points, and where they stand.
type Run<'a> = (Vec<String>, Vec<(Vec<i64>, Scan<'a>)>);

/// Points, faces and lines; the objects, groups and materials that cells are in are groups.
fn obj(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::with_comments(path, bytes, b'#');
    let mut surface = Surface::default();
    let mut sets: [Vec<String>; 3] = Default::default();
    // Faces that follow each other in the same sets.
    let mut runs: Vec<Run<'_>> = vec![Default::default()];
    let mut others: HashMap<String, usize> = HashMap::new();
    while let Some(mut row) = scan.row() {
        let word = row.word().unwrap_or_default();
        let names = |row: &Scan<'_>| {
            let rest = String::from_utf8_lossy(row.rest()).into_owned();
            rest.split_whitespace()
                .map(str::to_owned)
                .collect::<Vec<String>>()
        };
        match word {
            b"" => {}
            b"v" => {
                let at = row.xyz()?;
                surface.builder.mesh.points.push(at);
            }
            b"o" | b"g" | b"usemtl" => {
                if row.rest().len() > LONGEST {
                    return Err(row.error("a name is longer than any"));
                }
                match word {
                    b"g" => sets[1] = names(&row),
                    _ => sets[usize::from(word != b"o") * 2] = vec![names(&row).join(" ")],
                }
                runs.push((sets.concat(), Vec::new()));
            }
            b"f" | b"l" => {
                let count = surface.builder.mesh.points.len() as i64;
                let mut corners = Vec::new();
                while let Some(word) = row.word() {
                    let number = word.split(|&byte| byte == b'/').next().unwrap_or_default();
                    let mut number = Scan::new(path, number);
                    let number = number
                        .int()
                        .map_err(|_| row.error("a corner is no number"))?;
                    // Negative numbers count back from the last point.
                    corners.push(if number < 0 {
                        count + number
                    } else {
                        number - 1
                    });
                }
                let pairs = if word == b"l" {
                    2
                } else {
                    corners.len().max(1)
                };
                if let Some((_, faces)) = runs.last_mut() {
                    faces.extend(
                        corners
                            .windows(pairs)
                            .map(|corners| (corners.to_vec(), row.clone())),
                    );
                }
            }
            other => {
                *others
                    .entry(String::from_utf8_lossy(other).into_owned())
                    .or_insert(0) += 1
            }
        }
    }
    let points = surface.builder.mesh.points.len();
    for (sets, faces) in runs {
        let mut cells = Vec::new();
        for (corners, row) in faces {
            let point = |corner: &i64| {
                u32::try_from(*corner)
                    .ok()
                    .filter(|&corner| (corner as usize) < points)
            };
            let found: Option<Vec<u32>> = corners.iter().map(point).collect();
            let beyond = || row.error(format!("a face has a point beyond the {points} there are"));
            cells.extend(surface.polygon(&found.ok_or_else(beyond)?));
        }
        for name in sets
            .iter()
            .filter(|name| !name.is_empty() && !cells.is_empty())
        {
            surface.builder.set(name, cells.iter().copied());
        }
    }
    let mut others: Vec<String> = others
        .into_iter()
        .map(|(word, count)| format!("{count} lines of {word}"))
        .collect();
    others.sort();
    surface.unread.extend(others);
    Ok(surface.content("obj", "ascii"))
}

/// A property of PLY: its name, the type of its values, and of the number of values if it is a list.
type Property = (String, Type, Option<Type>);

/// Bytes of a number, whether it is a float, whether it has a sign.
#[derive(Clone, Copy)]
struct Type(usize, bool, bool);

const TYPES: [(&str, Type); 16] = [
    ("char", Type(1, false, true)),
    ("int8", Type(1, false, true)),
    ("uchar", Type(1, false, false)),
    ("uint8", Type(1, false, false)),
    ("short", Type(2, false, true)),
    ("int16", Type(2, false, true)),
    ("ushort", Type(2, false, false)),
    ("uint16", Type(2, false, false)),
    ("int", Type(4, false, true)),
    ("int32", Type(4, false, true)),
    ("uint", Type(4, false, false)),
    ("uint32", Type(4, false, false)),
    ("float", Type(4, true, true)),
    ("float32", Type(4, true, true)),
    ("double", Type(8, true, true)),
    ("float64", Type(8, true, true)),
];

impl Type {
    fn read(self, scan: &mut Scan<'_>) -> Result<f64> {
        let Type(size, float, sign) = self;
        if scan.numbers == Numbers::Ascii {
            return scan.any_f64();
        }
        let mut bytes = [0; 8];
        let read = scan.bytes(size, 1)?;
        let big = scan.numbers == Numbers::Big;
        for (place, byte) in bytes.iter_mut().zip(0..size) {
            *place = read[if big { size - 1 - byte } else { byte }];
        }
        let whole = u64::from_le_bytes(bytes);
        let shift = 64 - 8 * size as u32;
        Ok(match (float, size) {
            (true, 4) => f32::from_bits(whole as u32).into(),
            (true, _) => f64::from_bits(whole),
            _ if sign => ((whole << shift) as i64 >> shift) as f64,
            _ => whole as f64,
        })
    }
}

/// Points with their further properties as fields, and faces with theirs.
fn ply(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut scan = Scan::new(path, bytes);
    let mut elements: Vec<(String, u64, Vec<Property>)> = Vec::new();
    let mut encoding = "ascii";
    loop {
        let Some(row) = scan.row() else {
            return Err(scan.error("end_header is missing"));
        };
        let text = String::from_utf8_lossy(row.rest()).into_owned();
        let words: Vec<&str> = text.split_whitespace().collect();
        let named = |name: &str| {
            TYPES
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, of)| *of)
        };
        let unknown = || row.error(format!("{text:?} is no line of a head"));
        match words.as_slice() {
            ["end_header"] => break,
            ["format", "ascii", _] => encoding = "ascii",
            ["format", "binary_little_endian", _] => encoding = "binary-little",
            ["format", "binary_big_endian", _] => encoding = "binary-big",
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
    scan.numbers = match encoding {
        "binary-little" => Numbers::Little,
        "binary-big" => Numbers::Big,
        _ => Numbers::Ascii,
    };
    let mut surface = Surface::default();
    for (name, declared, properties) in elements {
        scan.section.clone_from(&name);
        let least = properties
            .iter()
            .map(|(_, of, count)| scan.least(2, count.map_or(of.0, |count| count.0)))
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
                    values[place] = of.read(&mut scan)?;
                    continue;
                };
                let length = count.read(&mut scan)?;
                let length = scan.believe(
                    if length >= 0.0 {
                        length as u64
                    } else {
                        u64::MAX
                    },
                    "values",
                    scan.least(2, of.0),
                )?;
                for _ in 0..length {
                    let value = of.read(&mut scan)?;
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
                    surface.builder.mesh.points.push(at);
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
            surface.unread.push(format!("{lists} lists of {name}"));
        }
        let on = match name.as_str() {
            "vertex" => Support::Points,
            "face" | "edge" => Support::Cells,
            other => {
                surface.unread.push(format!("{rows} rows of {other}"));
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
                    ..Field::new(name, on, 1, Values::F64(values))
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
    Ok(surface.content("ply", encoding))
}
