//! Where rows are, in words that a mesh has: everywhere, on a group, or in a box.

use std::collections::HashSet;

use serde::Serialize;

use crate::places;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;

/// A named group of a mesh, by the places where dofs of low order lie on it.
#[derive(Debug, Clone)]
pub struct Region {
    /// Of the group.
    pub name: String,
    /// Its vertices, and the centres of its edges, faces and cells.
    pub places: Vec<[f64; 3]>,
}

/// Where some rows are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// How many.
    pub rows: usize,
    /// Are they at least 9 of 10 rows that may differ?
    pub everywhere: bool,
    /// The smallest group that has all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
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

/// For each region which of these places are in it.
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

/// Where rows are, of so many that may be among them.
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
    let fitting = members
        .iter()
        .filter(|(_, is_in)| !rows.is_empty() && rows.iter().all(|row| is_in[*row]));
    let sized = fitting.map(|(name, is_in)| (is_in.iter().filter(|is| **is).count(), name));
    // A group that has many more rows is no place for a few.
    let least = sized
        .min()
        .filter(|(count, _)| *count <= 4 * rows.len() && *count < at.len());
    Where {
        rows: rows.len(),
        everywhere,
        group: least.map(|(_, name)| name.clone()),
        between: if rows.is_empty() {
            [[0.0; 3]; 2]
        } else {
            between
        },
    }
}
