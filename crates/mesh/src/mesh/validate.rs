//! Whether a mesh is what its type promises.

use super::{CellBlock, CellKind, Group, Mesh, PointRun};
use crate::parallel;

/// Items that one thread examines at a time.
const CHUNK: usize = 1 << 16;

impl Mesh {
    /// Whether it lies in the plane z = 0 and has no solids.
    pub fn is_flat(&self) -> bool {
        // No early exit within a chunk, so that the loop vectorises.
        let flat = |points: &[[f64; 3]]| points.iter().fold(true, |flat, p| flat & (p[2] == 0.0));
        self.dim() <= 2
            && parallel::map(self.points.chunks(CHUNK), flat)
                .into_iter()
                .all(|flat| flat)
    }

    /// Checks what the types cannot: that indices, lengths and orders satisfy the comments of the fields.
    /// Every reader returns a mesh that passes, and every writer checks first.
    ///
    /// # Errors
    /// A message about the error.
    pub fn validate(&self) -> Result<(), String> {
        let (points, cells) = (self.points.len(), self.cell_count());
        if u32::try_from(points).is_err() || u32::try_from(cells).is_err() {
            return Err("more than 2^32 - 1 points or cells".into());
        }
        if !self.points.is_finite() {
            let odd = |point: &[f64; 3]| !point.iter().all(|x| x.is_finite());
            let point = self.points.iter().position(odd).unwrap_or(0);
            return Err(format!(
                "point {} has a coordinate that is not finite",
                self.point_tag(point as u32)
            ));
        }
        if !self.point_tags.is_empty() && self.point_tags.len() != points {
            return Err(format!(
                "{} point tags for {points} points",
                self.point_tags.len()
            ));
        }
        for block in &self.blocks {
            validate_block(block, points)?;
        }
        let of_faces = |block: &&CellBlock| matches!(block.kind, CellKind::Polyhedron(_));
        let cells: usize = self
            .blocks
            .iter()
            .filter(of_faces)
            .map(CellBlock::len)
            .sum();
        if self.polyhedra.len() != cells || !self.polyhedra.are_among(points) {
            return Err("the polyhedra do not have faces of their points each".into());
        }
        self.validate_groups()?;
        for field in &self.fields {
            if field.expected_len(self) != Some(field.values.len())
                || !field.at.is_sorted_by(|a, b| a < b)
            {
                return Err(format!("field {:?} does not fit the mesh", field.name));
            }
        }
        self.validate_geometry()
    }

    fn validate_groups(&self) -> Result<(), String> {
        if !self
            .groups
            .is_sorted_by(|a, b| (a.dim, a.tag) < (b.dim, b.tag))
        {
            return Err(
                "groups are not in ascending order of dimension and tag, or one appears twice"
                    .into(),
            );
        }
        let ends = self.block_ends();
        for group in &self.groups {
            self.validate_group(group, &ends)
                .map_err(|what| format!("group {} of dimension {} {what}", group.tag, group.dim))?;
        }
        Ok(())
    }

    /// `ends` has the number of cells up to the end of each block.
    fn validate_group(&self, group: &Group, ends: &[usize]) -> Result<(), &'static str> {
        let mut left = group.cells.as_slice();
        // Neighbours across the ends of chunks belong to the earlier chunk.
        let ascends = |chunk: usize| {
            let end = left.len().min((chunk + 1) * CHUNK + 1);
            let cells = left.get(chunk * CHUNK..end).unwrap_or_default();
            let pairs = cells.windows(2);
            pairs.fold(true, |so_far, pair| so_far & (pair[0] < pair[1]))
        };
        let ascends = match left.len().div_ceil(CHUNK) {
            0 | 1 => ascends(0),
            chunks => parallel::map(0..chunks, ascends)
                .into_iter()
                .all(|ascends| ascends),
        };
        if !ascends {
            return Err("has cells twice or not in ascending order");
        }
        // As both ascend, the cells of a block are consecutive in the group.
        while let Some(&cell) = left.first() {
            let block = ends.partition_point(|&end| end <= cell as usize);
            let (Some(found), Some(&end)) = (self.blocks.get(block), ends.get(block)) else {
                return Err("has a cell beyond the last");
            };
            if found.kind.dim() != group.dim {
                return Err("has a cell of another dimension");
            }
            let inside = left.partition_point(|&cell| (cell as usize) < end);
            left = left.split_at(inside).1;
        }
        Ok(())
    }

    pub(crate) fn validate_geometry(&self) -> Result<(), String> {
        let (points, cells) = (self.points.len(), self.cell_count());
        let runs = &self.geometry.point_runs;
        if !runs.is_empty() && runs.iter().map(|run| run.count).sum::<usize>() != points {
            return Err("the runs of points on entities do not add up to all points".into());
        }
        let misfit = |run: &PointRun| {
            run.parameters
                .as_ref()
                .is_some_and(|p| p.len() != run.count * usize::from(run.dim))
                || run.dim > 3
        };
        if runs.iter().any(misfit) {
            return Err("the points on entities do not have one parameter per dimension".into());
        }
        let mut pairs = self
            .geometry
            .periodic
            .iter()
            .flat_map(|link| link.pairs.iter().flatten());
        if pairs.any(|&point| point as usize >= points) {
            return Err("a periodic link names a point beyond the last".into());
        }
        if self
            .geometry
            .partitions
            .cells
            .iter()
            .any(|c| c.cell as usize >= cells)
        {
            return Err("a partition names a cell beyond the last".into());
        }
        Ok(())
    }
}

fn validate_block(block: &CellBlock, points: usize) -> Result<(), String> {
    let (kind, len) = (block.kind, block.len());
    if !block.nodes.len().is_multiple_of(kind.points()) {
        return Err(format!(
            "{} nodes do not make {kind} cells",
            block.nodes.len()
        ));
    }
    let known = block
        .nodes
        .limit()
        .is_some_and(|limit| limit as usize <= points);
    if !known && !block.is_empty() && highest(&block.nodes) as usize >= points {
        return Err(format!("a {kind} has a node beyond the {points} points"));
    }
    if (!block.tags.is_empty() && block.tags.len() != len)
        || (!block.entities.is_empty() && block.entities.len() != len)
    {
        return Err(format!(
            "the {kind} cells do not have one tag and one entity each"
        ));
    }
    Ok(())
}

/// The highest of the numbers; 0 if there are none.
pub(crate) fn highest(numbers: &[u32]) -> u32 {
    let highest = |numbers: &[u32]| {
        numbers
            .iter()
            .fold(0, |highest, &number| highest.max(number))
    };
    let highest = parallel::map(numbers.chunks(CHUNK), highest);
    highest.into_iter().max().unwrap_or(0)
}

/// Whether none of the numbers is NaN or infinite.
pub(crate) fn all_finite(numbers: &[f64]) -> bool {
    let finite = |numbers: &[f64]| {
        // No early exit, so that the loop vectorises.
        let each = numbers.iter().map(|x| x.is_finite());
        each.fold(true, |so_far, finite| so_far & finite)
    };
    let finite = parallel::map(numbers.chunks(CHUNK), finite);
    finite.into_iter().all(|finite| finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::CellKind;

    /// Lines along a chain of points, then the points themselves as cells; one group of each.
    fn chain(lines: u32) -> Mesh {
        let group = |dim, cells| Group {
            dim,
            tag: 1,
            name: None,
            cells,
        };
        Mesh {
            points: (0..=lines).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
            blocks: vec![
                CellBlock::new(
                    CellKind::Line,
                    (0..lines).flat_map(|i| [i, i + 1]).collect(),
                ),
                CellBlock::new(CellKind::Vertex, (0..=lines).collect()),
            ],
            groups: vec![
                group(0, (lines..=2 * lines).collect()),
                group(1, (0..lines).collect()),
            ],
            ..Mesh::default()
        }
    }

    /// Faults in the first and last position and on both sides of chunk boundaries, where threads meet.
    #[test]
    fn faults_are_found_wherever_they_are() {
        let sound = chain(3 * CHUNK as u32 + 5);
        assert_eq!(sound.validate(), Ok(()));
        let places = |len: usize| [0, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK, len - 1];
        let refused = |spoil: &dyn Fn(&mut Mesh), words: &str| {
            let mut mesh = sound.clone();
            spoil(&mut mesh);
            let error = mesh.validate().expect_err(words);
            assert!(error.contains(words), "{error}");
        };
        for at in places(sound.points.len()) {
            refused(&|mesh| mesh.points.to_mut()[at][2] = f64::NAN, "not finite");
            refused(
                &|mesh| mesh.points.to_mut()[at][0] = f64::INFINITY,
                "not finite",
            );
        }
        for at in places(sound.blocks[0].nodes.len()) {
            let beyond = sound.points.len() as u32;
            refused(&|mesh| mesh.blocks[0].nodes.to_mut()[at] = beyond, "beyond");
        }
        for at in places(sound.groups[1].cells.len() - 1) {
            refused(&|mesh| mesh.groups[1].cells.swap(at, at + 1), "ascending");
            let twice = |mesh: &mut Mesh| mesh.groups[1].cells[at + 1] = at as u32;
            refused(&twice, "ascending");
        }
        let cells = sound.cell_count() as u32;
        refused(&|mesh| mesh.groups[0].cells.push(cells), "beyond the last");
        refused(
            &|mesh| mesh.groups[1].cells.push(cells - 1),
            "of another dimension",
        );
        refused(
            &|mesh| mesh.groups[0].cells.insert(0, 7),
            "of another dimension",
        );
    }
}
