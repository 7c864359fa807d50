//! STL, text and binary.

use std::collections::HashMap;
use std::path::Path;

use super::Surface;
use crate::error::Result;
use crate::field::Tell;
use crate::io::recognise::{begins, head_has};
use crate::io::scan::{Numbers, Scan};
use crate::io::{Content, Native, Read, meshio};

pub static FORMAT: Native = Native {
    title: "STL",
    names: &["stl"],
    suffixes: &["stl"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| {
        is_binary_stl(bytes) || (begins(bytes, "solid") && head_has(bytes, "facet"))
    },
    read: Read::Once(read),
    write: |job| meshio::write(job, "stl"),
};

/// Whether the length is that of as many triangles as are declared; texts begin with `solid`, and so do some of these.
fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..).and_then(|rest| rest.first_chunk::<4>());
    count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(u32::from_le_bytes(*count)))
}

/// Equal corners of triangles are one point; a solid with a name is a group.
fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
    let mut surface = Surface::default();
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let mut point = |surface: &mut Surface, at: [f64; 3]| {
        let points = &mut surface.builder.mesh.points;
        *known
            .entry(at.map(|x| (x + 0.0).to_bits()))
            .or_insert_with(|| {
                points.to_mut().push(at);
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
            surface.unread.tell(
                "attributes",
                format!("the attributes of {marked} triangles"),
            );
        }
        return Ok(surface.content(scan.numbers));
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
                    "{:?} is not a keyword of this format",
                    String::from_utf8_lossy(&word)
                )));
            }
        }
    }
    if !ended || !corners.is_empty() {
        return Err(scan.error("endsolid is missing"));
    }
    Ok(surface.content(scan.numbers))
}
