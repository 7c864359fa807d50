//! The faces of simplices: local faces are bucketed by their smallest vertex, so that faces are
//! numbered in the order of their vertices.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel;

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
    let ranges = || {
        (0..vertices)
            .step_by(TASK)
            .map(|first| first..(first + TASK).min(vertices))
    };
    let count_of = |range: &Range<usize>| (starts[range.end] - starts[range.start]) as usize;
    let own = split(&mut entries, ranges().map(|range| count_of(&range)));
    let counts = parallel::map(ranges().zip(own), |(vertices, entries)| {
        cancel::check()?;
        Ok(sort::<D>(&starts, vertices, entries))
    });
    let counts = counts.into_iter().collect::<Result<Vec<_>>>()?;
    let counts = counts
        .into_iter()
        .collect::<std::result::Result<Vec<usize>, Crowded>>();
    let counts = match counts {
        Ok(counts) => counts,
        Err(crowded) => return Ok(Err(crowded)),
    };

    let count = counts.iter().sum();
    let mut faces = Faces {
        vertices: vec![0; D * count],
        cells: vec![[NONE; 2]; count],
        of_cells: Vec::new(),
        folded: None,
    };
    let before = counts
        .iter()
        .scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count)));
    let own = split(&mut entries, ranges().map(|range| count_of(&range)));
    let own_vertices = split(&mut faces.vertices, counts.iter().map(|count| D * count));
    let own_cells = split(&mut faces.cells, counts.iter().copied());
    let tasks = ranges()
        .zip(before)
        .zip(own)
        .zip(own_vertices)
        .zip(own_cells);
    let folded = parallel::map(
        tasks,
        |((((vertices, first), entries), of_faces), owners)| {
            number_some(cells, &starts, vertices, entries, first, of_faces, owners)
        },
    );
    faces.folded = folded.into_iter().flatten().min();
    cancel::check()?;
    // Each is written once; atomic, as all cores write.
    let of_cells: Vec<AtomicU32> = cells.iter().map(|_| AtomicU32::new(NONE)).collect();
    parallel::map(entries.chunks(TASK), |entries| {
        for entry in entries {
            of_cells[entry[D - 1] as usize].store(entry[0], Ordering::Relaxed);
        }
    });
    faces.of_cells = of_cells.into_iter().map(AtomicU32::into_inner).collect();
    Ok(Ok(faces))
}

/// Parts of these lengths, one after the other.
fn split<T>(
    mut all: &mut [T],
    lengths: impl Iterator<Item = usize>,
) -> impl Iterator<Item = &mut [T]> {
    lengths.map(move |length| {
        let (own, others) = std::mem::take(&mut all).split_at_mut(length);
        all = others;
        own
    })
}

/// Local faces by their smallest vertex, and where those of each vertex start.
fn buckets<const D: usize>(cells: &[u32], vertices: usize) -> Result<(Vec<u32>, Vec<Entry<D>>)> {
    // A task looks at all local faces, for some of the vertices.
    let some = vertices
        .div_ceil(rayon::current_num_threads().min(8))
        .max(TASK);
    let (mut starts, mut next) = (vec![0u32; vertices + 1], vec![0u32; vertices]);
    let counted = parallel::map(next.chunks_mut(some).enumerate(), |(task, counts)| {
        let own = task * some..task * some + counts.len();
        for_each_from::<D>(cells, own, |vertex, _, _| counts[vertex] += 1)
    });
    counted.into_iter().collect::<Result<()>>()?;
    for (v, next) in next.iter_mut().enumerate() {
        starts[v + 1] = starts[v] + std::mem::replace(next, starts[v]);
    }
    let mut entries = vec![[0; D]; cells.len()];
    let of_tasks = (0..vertices).step_by(some);
    let lengths = of_tasks.map(|v| (starts[(v + some).min(vertices)] - starts[v]) as usize);
    let own = split(&mut entries, lengths);
    let tasks = next.chunks_mut(some).zip(own).enumerate();
    let filled = parallel::map(tasks, |(task, (next, entries))| {
        let (own, first) = (task * some..task * some + next.len(), starts[task * some]);
        for_each_from::<D>(cells, own, |vertex, face, number| {
            let entry = &mut entries[(next[vertex] - first) as usize];
            entry[..D - 1].copy_from_slice(&face[1..]);
            entry[D - 1] = number;
            next[vertex] += 1;
        })
    });
    filled.into_iter().collect::<Result<()>>()?;
    Ok((starts, entries))
}

/// Visits the local faces whose smallest vertex is one of these: which of these, the face, and its number.
fn for_each_from<const D: usize>(
    cells: &[u32],
    vertices: Range<usize>,
    mut visit: impl FnMut(usize, [u32; D], u32),
) -> Result<()> {
    for (cell, corners) in cells.chunks_exact(D + 1).enumerate() {
        cancel::check()?;
        for i in 0..=D {
            let (face, _) = sorted_face::<D>(corners, i);
            if vertices.contains(&(face[0] as usize)) {
                let number = (cell * (D + 1) + i) as u32;
                visit(face[0] as usize - vertices.start, face, number);
            }
        }
    }
    Ok(())
}

/// The entries of each of these vertices.
fn each_bucket<'e, const D: usize>(
    starts: &[u32],
    vertices: Range<usize>,
    entries: &'e mut [Entry<D>],
) -> impl Iterator<Item = (u32, &'e mut [Entry<D>])> {
    let lengths = vertices
        .clone()
        .map(|v| (starts[v + 1] - starts[v]) as usize);
    (vertices.start as u32..).zip(split(entries, lengths))
}

/// Whether this is the same face.
fn is_same<const D: usize>(a: &Entry<D>, b: &Entry<D>) -> bool {
    a[..D - 1] == b[..D - 1]
}

/// Puts the entries of each of these vertices into the order of their faces, and counts those; the first with more than
/// two cells.
fn sort<const D: usize>(
    starts: &[u32],
    vertices: Range<usize>,
    entries: &mut [Entry<D>],
) -> std::result::Result<usize, Crowded> {
    let mut count = 0;
    for (v, bucket) in each_bucket(starts, vertices, entries) {
        bucket.sort_unstable();
        for same in bucket.chunk_by(is_same::<D>) {
            count += 1;
            if same.len() > 2 {
                let cells = same.iter().map(|entry| entry[D - 1] as usize / (D + 1));
                return Err(Crowded {
                    face: [&[v], &same[0][..D - 1]].concat(),
                    cells: cells.collect(),
                });
            }
        }
    }
    Ok(count)
}

/// Numbers the faces whose smallest vertices are these from `first` on, and writes each one's number into the first place of
/// its entries, its vertices and cells into their own places; the first face with both cells on one side.
fn number_some<const D: usize>(
    cells: &[u32],
    starts: &[u32],
    vertices: Range<usize>,
    entries: &mut [Entry<D>],
    first: usize,
    of_faces: &mut [u32],
    owners: &mut [[u32; 2]],
) -> Option<usize> {
    let mut folded = None;
    let mut faces = (first..).zip(of_faces.chunks_exact_mut(D)).zip(owners);
    for (v, bucket) in each_bucket(starts, vertices, entries) {
        let faces_here = bucket.chunk_by_mut(is_same::<D>);
        for (same, ((face, of_face), owners)) in faces_here.zip(&mut faces) {
            of_face[0] = v;
            of_face[1..].copy_from_slice(&same[0][..D - 1]);
            let is_inner = same.len() == 2;
            let mut sides = [false, true];
            for ((owner, side), entry) in owners.iter_mut().zip(&mut sides).zip(same) {
                let number = entry[D - 1] as usize;
                let cell = number / (D + 1);
                *owner = cell as u32;
                let vertices = &cells[(D + 1) * cell..(D + 1) * (cell + 1)];
                *side = sorted_face::<D>(vertices, number % (D + 1)).1;
                entry[0] = face as u32;
            }
            // As all cells are positive, two on different sides of a face see it in opposite orientations.
            if is_inner && sides[0] == sides[1] {
                folded = folded.or(Some(face));
            }
        }
    }
    folded
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
