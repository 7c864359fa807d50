//! Polygons of any number of corners, and polyhedra of any number of faces, as lists of numbers.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::raw;
use super::sets::Sets;
use crate::mesh::{CellBlock, CellKind};

/// Lists one after the other: the corners of each face, or the faces of each cell.
#[derive(Default)]
pub struct Lists {
    items: Vec<i64>,
    ends: Vec<usize>,
}

impl Lists {
    /// Appends lists of a given number of items each.
    ///
    /// # Errors
    /// They are not as many items.
    pub fn append(
        &mut self,
        items: Vec<i64>,
        counts: impl IntoIterator<Item = i64>,
    ) -> Result<(), String> {
        let start = self.items.len();
        self.items.extend(items);
        let mut end = start;
        for count in counts {
            let next = usize::try_from(count)
                .ok()
                .and_then(|count| end.checked_add(count));
            end = next.filter(|&end| end <= self.items.len()).ok_or_else(|| {
                format!("a list of {count} numbers is longer than what is left of them")
            })?;
            self.ends.push(end);
        }
        match self.items.len() - end {
            0 => Ok(()),
            more => Err(format!("{more} numbers belong to no list")),
        }
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn get(&self, k: usize) -> Option<&[i64]> {
        let start = k
            .checked_sub(1)
            .map_or(Some(0), |before| self.ends.get(before).copied());
        self.items.get(start?..*self.ends.get(k)?)
    }

    fn iter(&self) -> impl Iterator<Item = &[i64]> {
        (0..self.len()).filter_map(|k| self.get(k))
    }

    /// The points of the k-th face, which are numbered from 1 on, and the kind of the face.
    ///
    /// # Errors
    /// There is no such face, or it does not have these points.
    pub fn face(&self, k: usize, points: &Range<u32>) -> Result<(CellKind, Vec<u32>), String> {
        let corners = self
            .get(k)
            .ok_or_else(|| format!("there is no face {}", k.saturating_add(1)))?;
        let count = corners.len();
        let kind = CellKind::of_corners(count).filter(|kind| kind.dim() == 2);
        let kind = kind.ok_or_else(|| format!("the face {} has {count} corners", k + 1))?;
        let point = |&number: &i64| {
            let index = raw::index(number, points.len()).map(|index| points.start + index);
            index.ok_or_else(|| format!("it names the node {number} of {}", points.len()))
        };
        Ok((kind, corners.iter().map(point).collect::<Result<_, _>>()?))
    }
}

impl Sets {
    /// Adds all faces as cells.
    ///
    /// # Errors
    /// One is not a polygon of these points.
    pub fn polygons(&mut self, faces: &Lists, points: &Range<u32>) -> Result<(), String> {
        let first = self.mesh.blocks.len();
        for k in 0..faces.len() {
            let (kind, nodes) = faces.face(k, points)?;
            self.push(first, kind, &nodes);
        }
        Ok(())
    }

    /// Adds cells by their faces, each given by its number in `face`, below 0 if it is turned round.
    ///
    /// # Errors
    /// A face is not there, or is one of more than two cells.
    pub fn polyhedra(
        &mut self,
        cells: &Lists,
        face: impl Fn(i64) -> Result<Vec<u32>, String>,
    ) -> Result<(), String> {
        let first = self.mesh.blocks.len();
        let mut uses: HashMap<i64, u8> = HashMap::new();
        for faces in cells.iter() {
            let (mut stream, mut nodes, mut seen) = (Vec::new(), Vec::new(), HashSet::new());
            for &number in faces {
                let number_of_uses = uses.entry(number.saturating_abs()).or_default();
                *number_of_uses += 1;
                if *number_of_uses > 2 {
                    return Err(format!("the face {number} is one of more than two cells"));
                }
                let mut corners = face(number.saturating_abs())?;
                if number < 0 {
                    corners.reverse();
                }
                stream.push(corners.len() as u32);
                stream.extend(&corners);
                nodes.extend(corners.into_iter().filter(|&corner| seen.insert(corner)));
            }
            let count = u32::try_from(nodes.len()).ok().filter(|&count| count > 0);
            let count = count.ok_or("a cell has no faces")?;
            self.mesh.polyhedra.push(stream);
            self.push(first, CellKind::Polyhedron(count), &nodes);
        }
        Ok(())
    }

    /// Appends a cell to the last block of its kind that is not before `first`.
    fn push(&mut self, first: usize, kind: CellKind, nodes: &[u32]) {
        match self
            .mesh
            .blocks
            .get_mut(first..)
            .and_then(<[CellBlock]>::last_mut)
        {
            Some(last) if last.kind == kind => last.nodes.to_mut().extend(nodes),
            _ => self.mesh.blocks.push(CellBlock::new(kind, nodes.to_vec())),
        }
    }
}

/// The faces of two cubes side by side, of points that count from 1 along x, y and z.
#[cfg(test)]
pub const FACES: [[i64; 4]; 11] = [
    [1, 2, 5, 4],
    [7, 8, 11, 10],
    [1, 2, 8, 7],
    [4, 5, 11, 10],
    [1, 4, 10, 7],
    [2, 5, 11, 8],
    [2, 3, 6, 5],
    [8, 9, 12, 11],
    [2, 3, 9, 8],
    [5, 6, 12, 11],
    [3, 6, 12, 9],
];
