//! The faces of polyhedra, as VTK has them: a list of faces for each cell, each face a list of its corners.

/// The faces of the [`super::CellKind::Polyhedron`] cells of a mesh, in the order of the cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polyhedra {
    /// For each face, its number of corners and the corners.
    stream: Vec<u32>,
    /// Where the faces of each cell end in `stream`.
    ends: Vec<usize>,
}

impl Polyhedra {
    /// Appends a cell by its faces, given as the number of corners of each and these, one after the other; returns
    /// whether that is what they are.
    pub fn push(&mut self, faces: impl IntoIterator<Item = u32>) -> bool {
        let start = self.stream.len();
        self.stream.extend(faces);
        if Self::count_faces(self.stream.split_at(start).1).is_none() {
            self.stream.truncate(start);
            return false;
        }
        self.ends.push(self.stream.len());
        true
    }

    /// The number of faces that these numbers are; `None` if they are not faces.
    pub(crate) fn count_faces(mut rest: &[u32]) -> Option<usize> {
        let mut faces = 0;
        while let Some((&count, corners)) = rest.split_first() {
            (_, rest) = corners.split_at_checked(count as usize)?;
            faces += 1;
        }
        Some(faces)
    }

    /// Appends the cells of another mesh, whose points count from `base` here.
    pub(crate) fn append(&mut self, other: &Polyhedra, base: u32) {
        if base == 0 && self.is_empty() {
            *self = other.clone();
            return;
        }
        for faces in other.iter() {
            self.push(faces.renumbered(|corner| corner + base));
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no polyhedra.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The faces of each cell in turn.
    pub fn iter(&self) -> impl Iterator<Item = Faces<'_>> {
        let mut start = 0;
        self.ends.iter().map(move |&end| {
            let faces = self.stream.get(start..end).unwrap_or_default();
            start = end;
            Faces(faces)
        })
    }

    /// The faces of the last cell.
    pub(crate) fn last(&self) -> Option<Faces<'_>> {
        let end = *self.ends.last()?;
        let start = self
            .ends
            .len()
            .checked_sub(2)
            .map_or(0, |before| self.ends[before]);
        self.stream.get(start..end).map(Faces)
    }

    /// Whether all corners are below a number of points.
    pub(super) fn are_among(&self, points: usize) -> bool {
        let mut corners = self.iter().flatten().flatten();
        corners.all(|&corner| (corner as usize) < points)
    }
}

/// The faces of one cell, each as its corners.
#[derive(Debug, Clone)]
pub struct Faces<'a>(&'a [u32]);

impl<'a> Faces<'a> {
    /// The faces as [`Polyhedra::push`] takes them, with other numbers of points.
    pub(crate) fn renumbered(self, number: impl Fn(u32) -> u32) -> impl Iterator<Item = u32> {
        let number = move |corner: &u32| number(*corner);
        let faces = self.map(move |face| {
            let corners: Vec<u32> = face.iter().map(&number).collect();
            (face.len() as u32, corners)
        });
        faces.flat_map(|(count, corners)| std::iter::once(count).chain(corners))
    }

    /// The faces as [`Polyhedra::push`] takes them.
    pub(crate) fn stream(self) -> impl Iterator<Item = u32> {
        self.renumbered(|corner| corner)
    }
}

impl<'a> Iterator for Faces<'a> {
    type Item = &'a [u32];

    fn next(&mut self) -> Option<&'a [u32]> {
        let (&count, rest) = self.0.split_first()?;
        let (face, others) = rest.split_at_checked(count as usize)?;
        self.0 = others;
        Some(face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_that_end_early_are_refused() {
        let mut polyhedra = Polyhedra::default();
        assert!(polyhedra.push([3, 0, 1, 2, 2, 0, 1]));
        assert!(!polyhedra.push([3, 0, 1]));
        assert!(polyhedra.push([1, 7]));
        let faces: Vec<Vec<&[u32]>> = polyhedra.iter().map(Iterator::collect).collect();
        assert_eq!(faces, [vec![&[0, 1, 2][..], &[0, 1]], vec![&[7]]]);
        assert!(polyhedra.are_among(8) && !polyhedra.are_among(7));
    }
}
