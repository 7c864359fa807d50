//! Boundary conditions: what they are on.

use std::collections::BTreeMap;

use super::{Members, Reader, Zone, polytopes::face};
use crate::error::Result;
use crate::field::Tell;
use crate::io::cgns::tree::Node;
use crate::io::raw;
use crate::io::sets::{self, Runs};

impl Reader {
    pub(super) fn boundaries(
        &mut self,
        node: &Node<'_>,
        zone: &Zone,
        aliases: &BTreeMap<String, String>,
    ) -> Result<()> {
        for list in node.labelled("ZoneBC_t")? {
            for boundary in list.labelled("BC_t")? {
                let Some(members) = self.members(&boundary, zone)? else {
                    self.unread.tell(
                        boundary.name(),
                        format!(
                            "the boundary condition {:?}, whose place is not understood",
                            boundary.name()
                        ),
                    );
                    continue;
                };
                let family = family(&boundary)?;
                let own = boundary.name().to_owned();
                match family {
                    Some(family) if family == own => {
                        self.groups.push((alias(aliases, &family), members))
                    }
                    Some(family) => {
                        let name = alias(aliases, &family);
                        if name != own {
                            self.groups.push((name, members.clone()));
                        }
                        self.groups.push((own, members));
                    }
                    None => self.groups.push((own, members)),
                }
            }
        }
        Ok(())
    }

    /// The entities of a boundary condition.
    fn members(&self, boundary: &Node<'_>, zone: &Zone) -> Result<Option<Members>> {
        let mut place = None;
        for name in ["PointRange", "PointList", "ElementRange", "ElementList"] {
            if let Some(node) = boundary.child(name)? {
                place = Some((name, node.integers()?));
                break;
            }
        }
        let Some((name, numbers)) = place else {
            return Ok(None);
        };
        let location = boundary
            .text_of("GridLocation")?
            .unwrap_or_else(|| "Vertex".into());
        let on_nodes = location == "Vertex" && name.starts_with("Point");
        if let Some(structure) = &zone.structure {
            return Ok((name == "PointRange")
                .then(|| part_of_grid(structure, &numbers, &location, zone.points.start))
                .flatten());
        }
        let most = (self.sets.mesh.points.len() + self.sets.mesh.cell_count()) as i64;
        let listed: Vec<i64> = match (name.ends_with("Range"), &numbers[..]) {
            // No more than there are points and cells.
            (true, &[from, to]) if to.checked_sub(from).is_some_and(|n| n <= most) => {
                (from..=to).collect()
            }
            (true, _) => return Ok(None),
            (false, _) => numbers,
        };
        if on_nodes {
            let node = |&n: &i64| Some(zone.points.start + raw::index(n, zone.points.len())?);
            return Ok(listed
                .iter()
                .map(node)
                .collect::<Option<_>>()
                .map(Members::Nodes));
        }
        let cell = |&n: &i64| {
            let at = zone
                .sections
                .partition_point(|&(from, ..)| from <= n)
                .checked_sub(1)?;
            let (from, to, first) = zone.sections[at];
            (n <= to).then(|| first + (n - from) as u32)
        };
        let cells: Option<Runs> = listed.iter().map(cell).collect();
        let faces = || {
            let face = |&number: &i64| face(&zone.faces, number, &zone.points).ok();
            listed.iter().map(face).collect::<Option<_>>()
        };
        Ok(cells
            .map(Members::Cells)
            .or_else(|| faces().map(Members::Given)))
    }
}

/// The cells of a part of a structured zone, given by its first and last indices of points, or of faces.
fn part_of_grid(structure: &[usize], range: &[i64], location: &str, first: u32) -> Option<Members> {
    let rank = structure.len();
    let (from, to) = range.split_at_checked(rank)?;
    let mut bounds = Vec::new();
    for axis in 0..rank {
        let (mut low, mut high) = (from[axis].min(*to.get(axis)?), from[axis].max(to[axis]));
        // Faces have the points at both of their ends, but for the direction in which they lie.
        if location != "Vertex" && low != high {
            high = high.saturating_add(1);
        }
        let last = structure[axis] as i64;
        (low, high) = (low.clamp(1, last.max(1)), high.clamp(1, last.max(1)));
        bounds.push((
            usize::try_from(low - 1).ok()?,
            usize::try_from(high - 1).ok()?,
        ));
    }
    let counts: Vec<usize> = bounds
        .iter()
        .rev()
        .map(|&(low, high)| high.saturating_sub(low) + 1)
        .collect();
    let (kind, places) = sets::grid(&counts, 0);
    let nodes = places.into_iter().map(|place| {
        let (mut rest, mut stride, mut node) = (place as usize, 1, 0);
        for (axis, &(low, high)) in bounds.iter().enumerate() {
            let count = high.saturating_sub(low) + 1;
            node += (low + rest % count) * stride;
            rest /= count;
            stride *= structure[axis];
        }
        first + node as u32
    });
    let nodes: Vec<u32> = nodes.collect();
    let end = structure.iter().product::<usize>() as u32;
    nodes.iter().all(|&node| node - first < end).then(|| {
        let cells = nodes.chunks_exact(kind.points());
        Members::Given(cells.map(|cell| (kind, cell.to_vec())).collect())
    })
}

pub(super) fn family(node: &Node<'_>) -> Result<Option<String>> {
    match node.labelled("FamilyName_t")?.first() {
        Some(family) => family.text(),
        None => Ok(None),
    }
}

pub(super) fn alias(aliases: &BTreeMap<String, String>, family: &str) -> String {
    aliases
        .get(family)
        .cloned()
        .unwrap_or_else(|| family.to_owned())
}
