//! OBJ of Wavefront.

use std::collections::HashMap;
use std::path::Path;

use super::Surface;
use crate::error::Result;
use crate::field::Tell;
use crate::io::scan::Scan;
use crate::io::{Content, Native, Read, meshio};

pub static FORMAT: Native = Native {
    title: "OBJ",
    names: &["obj"],
    suffixes: &["obj"],
    has_binary: false,
    holds_whole: false,
    recognises: is_obj,
    read: Read::Once(read),
    write: |job| meshio::write(job, "obj"),
};

/// Whether the first line that is not a comment is a point or what may come before it.
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

/// The names of sets, and faces in these: the numbers of their points, and their position in the file.
type Run<'a> = (Vec<String>, Vec<(Vec<i64>, Scan<'a>)>);

/// Points, faces and lines; the objects, groups and materials that cells are in are groups.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
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
                surface.builder.mesh.points.to_mut().push(at);
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
                        .map_err(|_| row.error("a corner is not a number"))?;
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
    let mut others: Vec<(String, usize)> = others.into_iter().collect();
    others.sort();
    for (word, n) in others {
        surface.unread.tell(&word, format!("{n} lines of {word}"));
    }
    Ok(surface.content(scan.numbers))
}
