//! The faces of simplices: local faces are bucketed by their smallest vertex, so that faces are
//! numbered in the order of their vertices.

use std::ops::Range;

use rayon::prelude::*;

use super::triangulation::NONE;
use crate::cancel;
use crate::error::Result;

/// Vertices per task.
const TASK: usize = 1 << 12;

/// The faces of a mesh of simplices; local face i of a cell lies opposite its local vertex i.
pub(super) struct Faces {
    /// Vertices of the faces, D each, ascending.
    pub vertices: Vec<u32>,
    /// The one or two cells of each face; the second is [`NONE`] on the boundary.
    pub cells: Vec<[u32; 2]>,
    /// Faces of the cells, D + 1 each.
    pub of_cells: Vec<u32>,
    /// The first face with both cells on one side.
    pub folded: Option<usize>,
}

/// A face with more than two cells.
pub(super) struct Crowded {
    pub face: Vec<u32>,
    pub cells: Vec<usize>,
}

/// The other vertices of a local face, ascending, and then its number: cell · (D + 1) + i.
type Entry<const D: usize> = [u32; D];

/// Faces that a task has numbered.
#[derive(Default)]
struct Numbered {
    vertices: Vec<u32>,
    cells: Vec<[u32; 2]>,
    crowded: Option<Crowded>,
    folded: Option<usize>,
}

/// Numbers the faces of positively oriented cells in dimension D; `cells` are their vertices, D + 1
/// each.
///
/// # Errors
/// [`crate::Error::Ended`]; inside, the first face with more than two cells.
pub(super) fn number<const D: usize>(
    cells: &[u32],
    vertices: usize,
) -> Result<std::result::Result<Faces, Crowded>> {
    let (starts, mut entries) = buckets::<D>(cells, vertices)?;
    let mut tasks = Vec::new();
    let mut rest = &mut entries[..];
    for first in (0..vertices).step_by(TASK) {
        let last = (first + TASK).min(vertices);
        let count = (starts[last] - starts[first]) as usize;
        let (own, others) = std::mem::take(&mut rest).split_at_mut(count);
        tasks.push((first..last, own));
        rest = others;
    }
    let numbered: Vec<Numbered> = tasks
        .into_par_iter()
        .map(|(vertices, entries)| {
            cancel::check()?;
            Ok(number_some(cells, &starts, vertices, entries))
        })
        .collect::<Result<_>>()?;

    let count = numbered.iter().map(|some| some.cells.len()).sum();
    let mut faces = Faces {
        vertices: Vec::with_capacity(D * count),
        cells: Vec::with_capacity(count),
        of_cells: vec![NONE; cells.len()],
        folded: None,
    };
    let mut entries = entries.iter();
    for (some, first) in numbered.into_iter().zip((0..vertices).step_by(TASK)) {
        if let Some(crowded) = some.crowded {
            return Ok(Err(crowded));
        }
        let before = faces.cells.len();
        let last = (first + TASK).min(vertices);
        let own = (starts[last] - starts[first]) as usize;
        for entry in entries.by_ref().take(own) {
            faces.of_cells[entry[D - 1] as usize] = entry[0] + before as u32;
        }
        faces.folded = faces.folded.or(some.folded.map(|face| before + face));
        faces.vertices.extend(some.vertices);
        faces.cells.extend(some.cells);
        cancel::check()?;
    }
    Ok(Ok(faces))
}

/// Local faces by their smallest vertex, and where those of each vertex start.
fn buckets<const D: usize>(cells: &[u32], vertices: usize) -> Result<(Vec<u32>, Vec<Entry<D>>)> {
    let local = D + 1;
    let mut starts = vec![0u32; vertices + 1];
    for cell in cells.chunks_exact(local) {
        cancel::check()?;
        for i in 0..local {
            starts[sorted_face::<D>(cell, i).0[0] as usize + 1] += 1;
        }
    }
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut entries = vec![[0; D]; cells.len()];
    for (cell, vertices) in cells.chunks_exact(local).enumerate() {
        cancel::check()?;
        for i in 0..local {
            let (face, _) = sorted_face::<D>(vertices, i);
            let slot = &mut next[face[0] as usize];
            let entry = &mut entries[*slot as usize];
            entry[..D - 1].copy_from_slice(&face[1..]);
            entry[D - 1] = (cell * local + i) as u32;
            *slot += 1;
        }
    }
    Ok((starts, entries))
}

/// Numbers the faces whose smallest vertices are these, from 0, and writes each one's number into
/// the first place of its entries.
fn number_some<const D: usize>(
    cells: &[u32],
    starts: &[u32],
    vertices: Range<usize>,
    entries: &mut [Entry<D>],
) -> Numbered {
    let local = D + 1;
    let from = starts[vertices.start] as usize;
    let mut some = Numbered::default();
    for v in vertices {
        let bucket = &mut entries[starts[v] as usize - from..starts[v + 1] as usize - from];
        bucket.sort_unstable();
        for same in bucket.chunk_by_mut(|a, b| a[..D - 1] == b[..D - 1]) {
            let face = some.cells.len();
            some.vertices.push(v as u32);
            some.vertices.extend_from_slice(&same[0][..D - 1]);
            if same.len() > 2 {
                let cells = same.iter().map(|entry| entry[D - 1] as usize / local);
                some.crowded = Some(Crowded {
                    face: some.vertices[D * face..].to_vec(),
                    cells: cells.collect(),
                });
                return some;
            }
            let mut owners = [NONE; 2];
            let mut sides = [false, true];
            for ((owner, side), entry) in owners.iter_mut().zip(&mut sides).zip(&mut *same) {
                let number = entry[D - 1] as usize;
                let cell = number / local;
                *owner = cell as u32;
                let vertices = &cells[local * cell..local * (cell + 1)];
                *side = sorted_face::<D>(vertices, number % local).1;
                entry[0] = face as u32;
            }
            some.cells.push(owners);
            // As all cells are positive, two on different sides of a face see it in opposite orientations.
            if same.len() == 2 && sides[0] == sides[1] {
                some.folded = some.folded.or(Some(face));
            }
        }
    }
    some
}

/// The vertices of local face i of a cell, ascending, and whether sorting reverses their orientation.
fn sorted_face<const D: usize>(cell: &[u32], i: usize) -> ([u32; D], bool) {
    let mut face = [0; D];
    for (k, vertex) in face.iter_mut().enumerate() {
        *vertex = cell[k + usize::from(k >= i)];
    }
    let mut turned = i % 2 == 1;
    let mut order = |a: usize, b: usize| {
        if face[a] > face[b] {
            face.swap(a, b);
            turned = !turned;
        }
    };
    order(0, 1);
    if D == 3 {
        order(1, 2);
        order(0, 1);
    }
    (face, turned)
}
