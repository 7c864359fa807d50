//! OFF, and its kinds with normals, colours or textures.

use std::path::Path;

use super::Surface;
use crate::error::Result;
use crate::field::Tell;
use crate::io::scan::Scan;
use crate::io::{Content, Native, Read, meshio};

pub static FORMAT: Native = Native {
    title: "OFF",
    names: &["off"],
    suffixes: &["off"],
    has_binary: false,
    holds_whole: false,
    recognises: |bytes| off_head(bytes).is_some(),
    read: Read::Once(read),
    write: |job| meshio::write(job, "off"),
};

/// The word that files start with: what points have besides coordinates, and OFF. Whether they have four coordinates.
fn off_head(bytes: &[u8]) -> Option<bool> {
    let mut scan = Scan::with_comments(Path::new(""), bytes, b'#');
    let head = scan.word()?.strip_suffix(b"OFF")?;
    let plain = head.iter().all(|letter| b"STCN4".contains(letter));
    (plain && scan.peek() != Some(b"BINARY")).then(|| head.contains(&b'4'))
}

fn read(path: &Path, bytes: &[u8]) -> Result<Content> {
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
    // The number of edges, which is not needed.
    scan.u64()?;
    let faces = scan.believe(faces, "faces", 4)?;
    let mut more = 0;
    for _ in 0..points {
        let at = scan.xyz()?;
        surface.builder.mesh.points.to_mut().push(at);
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
        surface.unread.tell(
            "colours",
            format!("colours or normals of {more} points and faces"),
        );
    }
    Ok(surface.content(scan.numbers))
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
