//! Describes where rows are in terms of the mesh: everywhere, on a group, or in a box.

use std::collections::HashSet;

use serde::Serialize;

use crate::places;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

/// The most groups that describe the place of rows.
const GROUPS: usize = 6;

/// A named group of a mesh, by the positions of low-order dofs on it.
#[derive(Debug, Clone)]
pub struct Region {
    /// The name of the group.
    pub name: String,
    /// Its vertices, and the centres of its edges, faces and cells.
    pub places: Vec<[f64; 3]>,
}

/// The place of some rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// The number of rows.
    pub rows: usize,
    /// Are they at least 9 of 10 rows that may differ?
    pub everywhere: bool,
    /// The smallest group that contains all of them, or else the fewest groups that contain them together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<String>,
    /// The least and the greatest coordinates.
    pub between: [[f64; 3]; 2],
}

impl Region {
    /// All named groups of a mesh.
    pub fn of(mesh: &Mesh) -> Vec<Region> {
        let cells: Vec<_> = mesh
            .cells()
            .map(|(_, kind, nodes)| (kind, nodes.to_vec()))
            .collect();
        let region = |group: &faceoff_mesh::mesh::Group| {
            let mut places = HashSet::new();
            for cell in &group.cells {
                let Some((kind, nodes)) = cells.get(*cell as usize) else {
                    continue;
                };
                let corners = &nodes[..nodes.len().min(kind.corners())];
                let centre = |of: &[u32]| {
                    let mut sum = [0.0; 3];
                    for node in of {
                        let x = mesh.points[*node as usize];
                        (0..3).for_each(|k| sum[k] += x[k] / of.len() as f64);
                    }
                    sum.map(f64::to_bits)
                };
                for (k, one) in corners.iter().enumerate() {
                    places.insert(centre(&[*one]));
                    for (l, two) in corners.iter().enumerate().skip(k + 1) {
                        places.insert(centre(&[*one, *two]));
                        corners.iter().skip(l + 1).for_each(|three| {
                            places.insert(centre(&[*one, *two, *three]));
                        });
                    }
                }
                places.insert(centre(corners));
            }
            let name = group.name.clone().unwrap_or_else(|| group.tag.to_string());
            let places = places.into_iter().map(|x| x.map(f64::from_bits)).collect();
            Region { name, places }
        };
        mesh.groups.iter().map(region).collect()
    }
}

/// For each region, which of these positions are in it.
pub fn members(regions: &[Region], at: &[[f64; 3]]) -> Result<Vec<(String, Vec<bool>)>> {
    let each = regions.iter().map(|region| {
        let near = places::tolerance(at, &region.places)?;
        let numbers = places::numbers(at, &region.places, near)?;
        let (of_dofs, of_region) = numbers.split_at(at.len());
        let there: HashSet<u32> = of_region.iter().copied().collect();
        let is_in = of_dofs.iter().map(|place| there.contains(place)).collect();
        Ok((region.name.clone(), is_in))
    });
    each.collect()
}

/// Describes the place of rows, given the number of rows that may be among them.
pub fn located(
    rows: &[usize],
    all: usize,
    at: &[[f64; 3]],
    members: &[(String, Vec<bool>)],
) -> Where {
    let mut between = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for row in rows {
        for k in 0..3 {
            between[0][k] = between[0][k].min(at[*row][k]);
            between[1][k] = between[1][k].max(at[*row][k]);
        }
    }
    let everywhere = 10 * rows.len() >= 9 * all;
    Where {
        rows: rows.len(),
        everywhere,
        groups: cover(rows, at.len(), members),
        between: if rows.is_empty() {
            [[0.0; 3]; 2]
        } else {
            between
        },
    }
}

/// The groups that contain these rows together, chosen greedily: the one with most of the remaining rows, and of such the smallest. Empty if that takes too many, or if
/// the groups have many more rows, since such groups do not describe a few rows.
fn cover(rows: &[usize], count: usize, members: &[(String, Vec<bool>)]) -> Vec<String> {
    let mut rest: Vec<usize> = rows.to_vec();
    let mut found: Vec<&(String, Vec<bool>)> = Vec::new();
    while !rest.is_empty() && found.len() < GROUPS {
        let sized = members.iter().map(|of| {
            let has = rest.iter().filter(|row| of.1[**row]).count();
            (has, of.1.iter().filter(|is| **is).count(), of)
        });
        let best = sized
            .filter(|(has, size, _)| *has > 0 && *size < count)
            .max_by(|a, b| {
                let by_name = || b.2.0.cmp(&a.2.0);
                a.0.cmp(&b.0).then(b.1.cmp(&a.1)).then_with(by_name)
            });
        let Some((.., best)) = best else {
            return Vec::new();
        };
        rest.retain(|row| !best.1[*row]);
        found.push(best);
    }
    let all = (0..count).filter(|row| found.iter().any(|of| of.1[*row]));
    if !rest.is_empty() || all.count() > 4 * rows.len() {
        return Vec::new();
    }
    let mut names: Vec<String> = found.into_iter().map(|(name, _)| name.clone()).collect();
    names.sort();
    names
}
