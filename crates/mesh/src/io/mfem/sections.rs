//! The sections of a file.

use super::nodes::Nodes;
use super::{Element, Raw, Set};
use crate::error::Result;
use crate::field::Tell;
use crate::io::Content;
use crate::io::scan::Scan;
use crate::mesh::CellKind;

/// MFEM's numbers of shapes: the linear and quadratic kinds.
const KINDS: [(CellKind, CellKind); 8] = [
    (CellKind::Vertex, CellKind::Vertex),
    (CellKind::Line, CellKind::Line3),
    (CellKind::Triangle, CellKind::Triangle6),
    (CellKind::Quadrangle, CellKind::Quadrangle9),
    (CellKind::Tetrahedron, CellKind::Tetrahedron10),
    (CellKind::Hexahedron, CellKind::Hexahedron27),
    (CellKind::Prism, CellKind::Prism18),
    (CellKind::Pyramid, CellKind::Pyramid14),
];

impl Raw {
    pub fn read(scan: &mut Scan<'_>, non_conforming: bool, content: &mut Content) -> Result<Raw> {
        let mut raw = Raw::default();
        while let Some(word) = scan.word() {
            let word = String::from_utf8_lossy(word.get(..60).unwrap_or(word)).into_owned();
            scan.section.clone_from(&word);
            match word.as_str() {
                "dimension" | "rank" | "sfc_version" => drop(scan.u64()?),
                "elements" => raw.elements = elements(scan, non_conforming)?,
                "boundary" => raw.boundary = elements(scan, false)?,
                "vertices" | "coordinates" => raw.points = points(scan)?,
                "nodes" => raw.nodes = Some(Nodes::read(scan)?),
                "attribute_sets" => raw.sets = sets(scan)?,
                "bdr_attribute_sets" => raw.boundary_sets = sets(scan)?,
                "vertex_parents" if non_conforming => {
                    let count = scan.count("vertices", 6)?;
                    for _ in 0..count {
                        let child = vertex(scan)?;
                        raw.parents.insert(child, [vertex(scan)?, vertex(scan)?]);
                    }
                }
                "mfem_mesh_end" => break,
                other => {
                    // The tree of refinements is not a part of the mesh.
                    raw.hanging |= other == "vertex_parents";
                    match other {
                        "root_state" | "coarse_elements" | "vertex_parents" => {
                            content.warnings.push(format!("{other} was skipped"));
                        }
                        _ => content.unread.tell(other, format!("the section {other}")),
                    }
                    while scan
                        .peek()
                        .is_some_and(|word| !word[0].is_ascii_alphabetic())
                    {
                        scan.word();
                    }
                }
            }
        }
        scan.section.clear();
        Ok(raw)
    }
}

fn vertex(scan: &mut Scan<'_>) -> Result<u32> {
    let vertex = scan.u64()?;
    let small = u32::try_from(vertex).ok().filter(|&v| v < u32::MAX - 1);
    small.ok_or_else(|| scan.error(format!("{vertex} is not the number of a vertex")))
}

/// Rows of attribute, shape and vertices; those of non-conforming meshes have a rank first, and either vertices or children.
fn elements(scan: &mut Scan<'_>, non_conforming: bool) -> Result<Vec<Element>> {
    let count = scan.count("elements", 6)?;
    let mut elements = Vec::new();
    for _ in 0..count {
        if non_conforming {
            scan.i32()?;
        }
        let attribute = scan.i32()?.into();
        let shape = scan.u64()?;
        let known = usize::try_from(shape)
            .ok()
            .and_then(|shape| KINDS.get(shape));
        let &kinds =
            known.ok_or_else(|| scan.error(format!("{shape} is not the number of a shape")))?;
        if non_conforming && scan.u64()? != 0 {
            scan.line();
            continue;
        }
        let vertices = (0..kinds.0.points()).map(|_| vertex(scan));
        elements.push(Element {
            attribute,
            kinds,
            vertices: vertices.collect::<Result<_>>()?,
        });
    }
    Ok(elements)
}

/// The number of vertices, and their coordinates unless the nodes have them.
fn points(scan: &mut Scan<'_>) -> Result<Vec<[f64; 3]>> {
    let declared = scan.u64()?;
    if !scan.peek().is_some_and(|word| word[0].is_ascii_digit()) {
        return Ok(Vec::new());
    }
    let dimension = scan.u64()?;
    if !(1..=3).contains(&dimension) {
        return Err(scan.error(format!("vertices have 1 to 3 coordinates, not {dimension}")));
    }
    let count = scan.believe(declared, "vertices", 2 * dimension as usize)?;
    let mut points = vec![[0.0; 3]; count];
    for point in &mut points {
        for x in point.iter_mut().take(dimension as usize) {
            *x = scan.f64()?;
        }
    }
    Ok(points)
}

/// Named sets of attributes.
fn sets(scan: &mut Scan<'_>) -> Result<Vec<Set>> {
    let count = scan.count("sets", 4)?;
    let mut sets = Vec::new();
    for _ in 0..count {
        scan.skip_blanks();
        let quoted = scan.rest().strip_prefix(b"\"");
        let name = match quoted {
            Some(rest) => rest.get(..memchr::memchr(b'"', rest).unwrap_or(rest.len())),
            None => scan.peek(),
        };
        let name = name.unwrap_or_default();
        scan.advance(name.len() + if quoted.is_some() { 2 } else { 0 });
        let size = scan.count("attributes", 2)?;
        let attributes = (0..size).map(|_| scan.i32().map(i64::from));
        sets.push((
            String::from_utf8_lossy(name).into_owned(),
            attributes.collect::<Result<_>>()?,
        ));
    }
    Ok(sets)
}
