//! The faces of polyhedra (NGON_n) and their lists (NFACE_n).

use std::ops::Range;

use super::RANGE;
use crate::error::Result;
use crate::io::cgns::tree::Node;
use crate::io::cgns::{NFACE, NGON};
use crate::io::polytopes::Lists;
use crate::mesh::CellKind;

/// The faces of all polyhedra of a zone, from the number of the first on; none if there are no polyhedra.
pub(super) fn faces(sections: &[Node<'_>]) -> Result<Vec<(i64, Lists)>> {
    let mut faces = Vec::new();
    let mut has_polyhedra = false;
    for section in sections {
        match section.integers()?.first() {
            Some(&NFACE) => has_polyhedra = true,
            Some(&NGON) => {
                faces.push((
                    section.integers_of(RANGE)?.first().copied().unwrap_or(1),
                    lists(section)?,
                ));
            }
            _ => {}
        }
    }
    faces.retain(|_| has_polyhedra);
    Ok(faces)
}

/// The kind and the corners of a face by its number.
pub(super) fn face(
    faces: &[(i64, Lists)],
    number: i64,
    points: &Range<u32>,
) -> Result<(CellKind, Vec<u32>), String> {
    let of_section = |(first, lists): &(i64, Lists)| {
        let k = usize::try_from(number.checked_sub(*first)?).ok()?;
        (k < lists.len()).then(|| lists.face(k, points))
    };
    let found = faces.iter().find_map(of_section);
    found.unwrap_or_else(|| Err(format!("there is no face with the number {number}")))
}

/// The lists of a section, each with its length before it or, since CGNS 4, where they begin given apart.
pub(super) fn lists(section: &Node<'_>) -> Result<Lists> {
    let mut numbers = section.integers_of("ElementConnectivity")?;
    let counts: Vec<i64> = match section.child("ElementStartOffset")? {
        Some(starts) => starts
            .integers()?
            .windows(2)
            .map(|pair| pair[1].saturating_sub(pair[0]))
            .collect(),
        None => {
            let (mut counts, mut at, mut items) = (Vec::new(), 0, Vec::new());
            while let Some(&count) = numbers.get(at) {
                let list = usize::try_from(count)
                    .ok()
                    .and_then(|count| numbers.get(at + 1..)?.get(..count));
                let list = list.ok_or_else(|| section.refuse("its last element ends too early"))?;
                counts.push(count);
                items.extend(list);
                at += 1 + list.len();
            }
            numbers = items;
            counts
        }
    };
    let mut lists = Lists::default();
    lists
        .append(numbers, counts)
        .map_err(|what| section.refuse(what))?;
    Ok(lists)
}
