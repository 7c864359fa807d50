//! Newest-vertex bisection of triangles: local refinement that stays conforming and produces at most four shapes of
//! triangles for each original one (E. G. Sewell 1972; W. F. Mitchell, ACM Trans. Math. Softw. 15, 1989).
//!
//! A triangle is bisected at the edge opposite its last vertex, and the new vertex is the last one of both parts.

use super::{CellBlock, CellKind, Group, Mesh, Triangulation};
use crate::error::{Error, Result};

/// The same mesh with the vertices of each triangle rotated so that its longest edge is bisected first.
///
/// # Errors
/// A mesh of tetrahedra.
pub fn at_longest_edges(mesh: &Triangulation) -> Result<Mesh> {
    check(mesh)?;
    let turned = |cell: usize| -> [u32; 3] {
        let [a, b, c, _] = mesh.vertices(cell);
        let square = |p: [f64; 3], q: [f64; 3]| -> f64 {
            p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum()
        };
        // Opposite the vertices 0, 1, 2. Among equal ones the first, so that rounding does not decide; the closure
        // handles edges that the two sides treat differently.
        let lengths = [square(b, c), square(c, a), square(a, b)];
        let longest = lengths.iter().fold(0.0, |m: f64, l| m.max(*l));
        let opposite = lengths
            .iter()
            .position(|l| *l >= longest * (1.0 - 1e-12))
            .unwrap_or(0);
        let vertices = mesh.cell(cell);
        std::array::from_fn(|k| vertices[(opposite + 1 + k) % 3])
    };
    let triangles = (0..mesh.cell_count()).map(turned).collect();
    Ok(assemble(mesh, mesh.points.clone(), triangles, &[]))
}

/// The triangle of which a triangle is a part, and how often it was bisected for that.
pub type Origin = (u32, u8);

/// Bisects the marked triangles, and others as far as conformity requires. The parts of a face are in the groups of
/// the face.
///
/// # Errors
/// A mesh of tetrahedra.
pub fn bisect(mesh: &Triangulation, marked: &[bool]) -> Result<(Mesh, Vec<Origin>)> {
    check(mesh)?;
    // Whether each face is cut, and where: the closure of the marked triangles' own edges.
    let mut cut = vec![false; mesh.face_count()];
    let own = |cell: usize| mesh.cell_faces(cell)[2] as usize;
    let mut open: Vec<usize> = (0..mesh.cell_count())
        .filter(|&cell| marked[cell])
        .map(own)
        .collect();
    while let Some(face) = open.pop() {
        if std::mem::replace(&mut cut[face], true) {
            continue;
        }
        let cells = mesh.face_cells(face);
        open.extend(
            cells
                .iter()
                .map(|&cell| cell as usize)
                .filter(|&cell| cell < mesh.cell_count())
                .map(own),
        );
    }
    let mut points = mesh.points.clone();
    let mut middle = vec![None; mesh.face_count()];
    for face in (0..mesh.face_count()).filter(|&face| cut[face]) {
        middle[face] = Some(points.len() as u32);
        points.push(mesh.face_midpoint(face));
    }
    let mut triangles = Vec::with_capacity(mesh.cell_count() * 2);
    let mut origins: Vec<Origin> = Vec::with_capacity(mesh.cell_count() * 2);
    for cell in 0..mesh.cell_count() {
        let faces = mesh.cell_faces(cell);
        let [a, b, c] = [0, 1, 2].map(|i| mesh.cell(cell)[i]);
        let [on_bc, on_ca, on_ab] = [0, 1, 2].map(|i| middle[faces[i] as usize]);
        let Some(m) = on_ab else {
            triangles.push([a, b, c]);
            origins.push((cell as u32, 0));
            continue;
        };
        for (on_other, p, q) in [(on_ca, c, a), (on_bc, b, c)] {
            match on_other {
                Some(n) => {
                    triangles.extend([[m, p, n], [q, m, n]]);
                    origins.extend([(cell as u32, 2); 2]);
                }
                None => {
                    triangles.push([p, q, m]);
                    origins.push((cell as u32, 1));
                }
            }
        }
    }
    Ok((assemble(mesh, points, triangles, &middle), origins))
}

fn check(mesh: &Triangulation) -> Result<()> {
    if mesh.dim == 2 {
        return Ok(());
    }
    Err(Error::Mesh {
        mesh: mesh.name.clone(),
        what: "only triangles can be bisected".into(),
        remedy: "refine tetrahedra uniformly".into(),
    })
}

/// Points and triangles with the groups of `source`, whose faces may have been cut.
fn assemble(
    source: &Triangulation,
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    middle: &[Option<u32>],
) -> Mesh {
    let mut lines = Vec::new();
    // The lines of each face: first and number.
    let mut of_face = std::collections::HashMap::new();
    let mut groups = Vec::with_capacity(source.groups.len());
    for group in &source.groups {
        let mut cells = Vec::with_capacity(group.faces.len());
        for &face in &group.faces {
            let (first, count) = *of_face.entry(face).or_insert_with(|| {
                let first = lines.len() as u32 / 2;
                let ends = source.face(face as usize);
                match middle.get(face as usize).copied().flatten() {
                    Some(m) => lines.extend([ends[0], m, m, ends[1]]),
                    None => lines.extend([ends[0], ends[1]]),
                }
                (first, lines.len() as u32 / 2 - first)
            });
            cells.extend(first..first + count);
        }
        groups.push(Group {
            dim: 1,
            tag: group.tag,
            name: group.name.clone(),
            cells,
        });
    }
    Mesh {
        points: points.into(),
        blocks: vec![
            CellBlock::new(CellKind::Line, lines),
            CellBlock::new(CellKind::Triangle, triangles.concat()),
        ],
        groups,
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::union_jack;

    fn area(mesh: &Triangulation) -> f64 {
        (0..mesh.cell_count())
            .map(|cell| mesh.geometry(cell).measure())
            .sum()
    }

    /// The smallest 2|κ|/h².
    fn shape(mesh: &Triangulation) -> f64 {
        let cells = (0..mesh.cell_count()).map(|cell| mesh.geometry(cell));
        let of = |cell: crate::mesh::CellGeometry| 2.0 * cell.measure() / cell.diameter.powi(2);
        cells.map(of).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn refinement_at_a_corner_stays_conforming_and_keeps_shapes_and_groups() {
        let start = Triangulation::new("uj", &union_jack(3, [2.0, 1.0])).unwrap();
        let mut mesh = Triangulation::new("t", &at_longest_edges(&start).unwrap()).unwrap();
        let (whole, least) = (area(&start), shape(&start));
        let mut state = 7u64;
        for level in 0..14 {
            let marked: Vec<bool> = (0..mesh.cell_count())
                .map(|cell| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    let near = mesh.vertices(cell)[..3]
                        .iter()
                        .any(|p| p[0] == 0.0 && p[1] == 0.0);
                    near || state >> 60 == 0
                })
                .collect();
            let before = mesh.cell_count();
            // Conforming, oriented, no hanging vertex: or this is refused.
            mesh = Triangulation::new("t", &bisect(&mesh, &marked).unwrap().0).unwrap();
            assert!(mesh.cell_count() > before, "{level}");
            assert!((area(&mesh) - whole).abs() < 1e-13);
            assert!(shape(&mesh) > 0.49 * least, "{level}: {}", shape(&mesh));
        }
        let smallest = (0..mesh.cell_count()).map(|c| mesh.geometry(c).measure());
        assert!(smallest.fold(f64::INFINITY, f64::min) < whole / 18.0 / 8192.0);
        // Every boundary face is still in the group of its side.
        let in_groups: usize = mesh.groups.iter().map(|group| group.faces.len()).sum();
        let boundary = (0..mesh.face_count())
            .filter(|&f| mesh.is_boundary(f))
            .count();
        assert_eq!(in_groups, boundary);
        for (old, new) in start.groups.iter().zip(&mesh.groups) {
            let length = |m: &Triangulation, faces: &[u32]| -> f64 {
                let of = |&face: &u32| {
                    let [a, b] = [0, 1].map(|k| m.points[m.face(face as usize)[k] as usize]);
                    (a[0] - b[0]).hypot(a[1] - b[1])
                };
                faces.iter().map(of).sum()
            };
            assert_eq!((old.tag, &old.name), (new.tag, &new.name));
            let (before, after) = (length(&start, &old.faces), length(&mesh, &new.faces));
            assert!((before - after).abs() < 1e-13);
        }
    }

    #[test]
    fn twice_all_is_four_of_each() {
        let start = Triangulation::new("uj", &union_jack(2, [1.0, 1.0])).unwrap();
        let mut mesh = Triangulation::new("t", &at_longest_edges(&start).unwrap()).unwrap();
        for _ in 0..2 {
            let all = vec![true; mesh.cell_count()];
            mesh = Triangulation::new("t", &bisect(&mesh, &all).unwrap().0).unwrap();
        }
        assert_eq!(mesh.cell_count(), 4 * start.cell_count());
    }
}
