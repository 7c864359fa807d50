//! Uniform refinement: every cell is split at the midpoints of its edges, and quadrangles and hexahedra at their centres.

use std::collections::HashMap;

use super::{CellBlock, CellKind, Group, Mesh};
use crate::cancel;
use crate::error::{Error, Result};
use crate::memory;

/// The least memory of a cell, with its points.
const BYTES: f64 = 40.0;

/// Splits each line in two, each triangle and quadrangle in four, each tetrahedron and hexahedron in eight; vertices stay. The parts are in
/// the groups and on the entity of the cell that was split. Old points keep their index and tag. Fields would have to
/// be interpolated: what the refined mesh does not carry is named in the second value. `name` is the mesh's in errors.
///
/// # Errors
/// A cell of another type; more points or cells than indices can count; an interruption.
pub fn refine(name: &str, mesh: &Mesh) -> Result<(Mesh, Vec<String>)> {
    let refuse = |what: String| {
        Error::Mesh {
        mesh: name.to_owned(),
        what,
        remedy: "give a smaller mesh of lines, triangles, quadrangles, tetrahedra and hexahedra of first order".into(),
    }
    };
    let mut fine = Mesh {
        points: mesh.points.clone(),
        ..Mesh::default()
    };
    let mut middles: HashMap<[u32; 4], u32> = HashMap::new();
    // The parts of each cell: the index of the first, and their number.
    let mut parts: Vec<(u32, u32)> = Vec::with_capacity(mesh.cell_count());
    let mut count = 0u32;
    for block in &mesh.blocks {
        let children: u32 = match block.kind {
            CellKind::Vertex => 1,
            CellKind::Line => 2,
            CellKind::Triangle | CellKind::Quadrangle => 4,
            CellKind::Tetrahedron | CellKind::Hexahedron => 8,
            other => return Err(refuse(format!("{other} cells are not refined"))),
        };
        let total = block.len() as u64 * u64::from(children) + u64::from(count);
        if total > u64::from(u32::MAX) {
            let what = "the refined mesh would have more than 2^32 - 1 cells";
            return Err(refuse(what.into()));
        }
        memory::require(BYTES * total as f64, &format!("the refined mesh of {name}"))?;
        let mut nodes = Vec::with_capacity(block.nodes.len() * children as usize);
        for cell in block.cells() {
            cancel::check()?;
            let is_tensor = matches!(block.kind, CellKind::Quadrangle | CellKind::Hexahedron);
            let mut middle = Middles {
                points: fine.points.to_mut(),
                known: &mut middles,
            };
            let done = match is_tensor {
                true => middle.split_lattice(cell, &mut nodes),
                false => middle.split_simplex(cell, &mut nodes),
            };
            done.map_err(refuse)?;
            parts.push((count, children));
            count += children;
        }
        let mut refined = CellBlock::new(block.kind, nodes);
        refined.entities = block
            .entities
            .iter()
            .flat_map(|&e| std::iter::repeat_n(e, children as usize))
            .collect();
        fine.blocks.push(refined);
    }
    for group in &mesh.groups {
        let of_cell = group
            .cells
            .iter()
            .filter_map(|&cell| parts.get(cell as usize));
        let cells = of_cell
            .flat_map(|&(first, number)| first..first + number)
            .collect();
        fine.groups.push(Group {
            cells,
            ..group.clone()
        });
    }
    if !mesh.point_tags.is_empty() {
        let highest = mesh.point_tags.iter().max().copied().unwrap_or(0);
        let new = fine.points.len() - mesh.points.len();
        if highest.checked_add(new as u64).is_none() {
            let what = "the numbers of points leave no room for new ones";
            return Err(refuse(what.into()));
        }
        fine.point_tags = mesh.point_tags.clone();
        fine.point_tags
            .extend((1..=new as u64).map(|i| highest + i));
    }
    fine.geometry.entities.clone_from(&mesh.geometry.entities);
    Ok((fine, left_out(mesh)))
}

fn left_out(mesh: &Mesh) -> Vec<String> {
    let mut left: Vec<String> = mesh
        .fields
        .iter()
        .map(|field| format!("the field {:?} on {}", field.name, field.on))
        .collect();
    if !mesh.geometry.periodic.is_empty() {
        left.push("the periodic links".into());
    }
    if !mesh.geometry.partitions.cells.is_empty() {
        left.push("the partitions of cells".into());
    }
    left
}

/// The points in the middle of edges, faces and cells, each made once.
struct Middles<'a> {
    points: &'a mut Vec<[f64; 3]>,
    /// By the corners of the edge or face, ascending.
    known: &'a mut HashMap<[u32; 4], u32>,
}

impl Middles<'_> {
    /// The mean of some points.
    fn of(&mut self, corners: &[u32]) -> Result<u32, String> {
        if let [one] = corners {
            return Ok(*one);
        }
        let mut key = [u32::MAX; 4];
        for (key, corner) in key.iter_mut().zip(corners) {
            *key = *corner;
        }
        key.sort_unstable();
        // The centre of a hexahedron is needed only once.
        let is_shared = corners.len() <= 4;
        if let Some(&point) = self.known.get(&key).filter(|_| is_shared) {
            return Ok(point);
        }
        let count = self.points.len();
        let places = corners.iter().map(|k| {
            let place = self.points.get(*k as usize).copied();
            place.ok_or_else(|| format!("a cell has a node beyond the {count} points"))
        });
        let places: Vec<[f64; 3]> = places.collect::<Result<_, _>>()?;
        let new = std::array::from_fn(|i| match places[..] {
            [p, q] => f64::midpoint(p[i], q[i]),
            _ => places.iter().map(|p| p[i]).sum::<f64>() / places.len() as f64,
        });
        let index = u32::try_from(count).ok().filter(|i| *i < u32::MAX);
        let index = index.ok_or("the refined mesh would have more than 2^32 - 1 points")?;
        self.points.push(new);
        if is_shared {
            self.known.insert(key, index);
        }
        Ok(index)
    }

    /// Appends the parts of a quadrangle or hexahedron: the images of those of the unit square or cube.
    fn split_lattice(&mut self, cell: &[u32], to: &mut Vec<u32>) -> Result<(), String> {
        // Corners in turn, the bottom first.
        const TURN: [[usize; 3]; 8] = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ];
        let corners = TURN.iter().take(cell.len());
        let centre = self.of(cell)?;
        for part in corners.clone() {
            for corner in corners.clone() {
                // A point of the lattice of steps of one half is the mean of the corners around it.
                let at: [usize; 3] = std::array::from_fn(|k| part[k] + corner[k]);
                let is_around = |c: &[usize; 3]| (0..3).all(|k| at[k] == 1 || at[k] == 2 * c[k]);
                let around = corners.clone().zip(cell);
                let around = around.filter(|(c, _)| is_around(c)).map(|(_, node)| *node);
                let around: Vec<u32> = around.collect();
                to.push(match around.len() == cell.len() {
                    true => centre,
                    false => self.of(&around)?,
                });
            }
        }
        Ok(())
    }

    /// Appends the parts of one simplex, each with its orientation.
    fn split_simplex(&mut self, cell: &[u32], to: &mut Vec<u32>) -> Result<(), String> {
        let mut middle = |a: u32, b: u32| self.of(&[a, b]);
        match *cell {
            [a] => to.push(a),
            [a, b] => {
                let ab = middle(a, b)?;
                to.extend([a, ab, ab, b]);
            }
            [a, b, c] => {
                let (ab, bc, ca) = (middle(a, b)?, middle(b, c)?, middle(c, a)?);
                to.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
            }
            [a, b, c, d] => {
                let (ab, ac, ad) = (middle(a, b)?, middle(a, c)?, middle(a, d)?);
                let (bc, bd, cd) = (middle(b, c)?, middle(b, d)?, middle(c, d)?);
                // The corners, then the octahedron between them, cut along one diagonal: always the one from ac to bd,
                // which keeps the number of shapes of repeated refinement finite (Bey 1995).
                to.extend([a, ab, ac, ad, ab, b, bc, bd, ac, bc, c, cd, ad, bd, cd, d]);
                to.extend([
                    ab, ac, ad, bd, ab, ac, bd, bc, ac, ad, bd, cd, ac, bc, cd, bd,
                ]);
            }
            _ => return Err(format!("a cell of {} nodes is not refined", cell.len())),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let mut block = CellBlock::new(CellKind::Tetrahedron, vec![0, 1, 2, 3]);
        block.entities = vec![5];
        Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]].into(),
            point_tags: vec![4, 3, 2, 9],
            blocks: vec![CellBlock::new(CellKind::Triangle, vec![0, 2, 1]), block],
            groups: vec![
                Group {
                    dim: 2,
                    tag: 1,
                    name: Some("floor".into()),
                    cells: vec![0],
                },
                Group {
                    dim: 3,
                    tag: 1,
                    name: None,
                    cells: vec![1],
                },
            ],
            ..Mesh::default()
        }
    }

    fn volume(mesh: &Mesh, nodes: &[u32]) -> f64 {
        let p: Vec<nalgebra::Vector3<f64>> = nodes
            .iter()
            .map(|&n| mesh.points[n as usize].into())
            .collect();
        (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0])) / 6.0
    }

    #[test]
    fn parts_fill_the_whole_and_keep_its_orientation_and_groups() {
        let mut mesh = tetrahedron();
        for level in 1..=2 {
            mesh = refine("t", &mesh).expect("simplices").0;
            assert_eq!(mesh.validate(), Ok(()));
            assert_eq!(mesh.count(CellKind::Tetrahedron), 8usize.pow(level));
            let volumes: Vec<f64> = mesh.blocks[1]
                .cells()
                .map(|nodes| volume(&mesh, nodes))
                .collect();
            let part = 1.0 / 8f64.powi(level as i32);
            assert!(
                volumes.iter().all(|v| (v - part).abs() < 1e-15),
                "{volumes:?}"
            );
            assert_eq!(mesh.groups[0].cells.len(), 4usize.pow(level));
            assert_eq!(mesh.groups[1].cells.len(), 8usize.pow(level));
            assert!(mesh.blocks[1].entities.iter().all(|&e| e == 5));
        }
        // 1 + 3 + ... points of a tetrahedron with four intervals an edge.
        assert_eq!(mesh.points.len(), 35);
        assert_eq!(mesh.point_tags[..5], [4, 3, 2, 9, 10]);
    }

    /// Parts of a quadrangle and of a hexahedron, neither a parallelogram nor a box.
    #[test]
    fn quadrangles_and_hexahedra_are_split_at_their_centres() {
        let mut points = vec![[0.0; 3], [2.0, 0.0, 0.0], [3.0, 2.0, 0.0], [0.0, 1.0, 0.0]];
        points.extend([
            [0.0, 0.0, 1.0],
            [2.0, 0.0, 2.0],
            [3.0, 2.0, 3.0],
            [0.0, 1.0, 2.0],
        ]);
        let mesh = Mesh {
            points: points.into(),
            blocks: vec![
                CellBlock::new(CellKind::Quadrangle, vec![0, 1, 2, 3]),
                CellBlock::new(CellKind::Hexahedron, (0..8).collect()),
            ],
            groups: vec![Group {
                dim: 2,
                tag: 1,
                name: None,
                cells: vec![0],
            }],
            ..Mesh::default()
        };
        let (fine, _) = refine("t", &mesh).unwrap();
        assert_eq!(fine.validate(), Ok(()));
        assert_eq!(fine.points.len(), 27, "those of the bottom are shared");
        assert_eq!(fine.groups[0].cells, [0, 1, 2, 3]);
        let parts: Vec<&[u32]> = fine.blocks[1].cells().collect();
        assert_eq!(parts.len(), 8);
        let at = |v: u32| fine.points[v as usize];
        // Each part keeps its corner in its place, and all have one centre.
        for (k, part) in parts.iter().enumerate() {
            assert_eq!(part[k], k as u32);
            let opposite = [6, 7, 4, 5, 2, 3, 0, 1][k];
            assert_eq!(at(part[opposite]), [1.25, 0.75, 1.0]);
        }
        let bottom: Vec<&[u32]> = fine.blocks[0].cells().collect();
        assert_eq!(bottom[0][..2], parts[0][..2]);
        assert_eq!(at(bottom[2][0]), [1.25, 0.75, 0.0]);
    }

    #[test]
    fn other_cells_are_refused() {
        let mesh = Mesh {
            points: vec![[0.0; 3]; 6].into(),
            blocks: vec![CellBlock::new(CellKind::Prism, (0..6).collect())],
            ..Mesh::default()
        };
        let error = refine("q", &mesh).expect_err("a prism").to_string();
        assert!(error.starts_with("mesh q: prism cells are not refined; "));
    }
}
