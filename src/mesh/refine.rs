//! Uniform refinement: each triangle is cut into four similar ones, each line into two.

use std::collections::HashMap;

use super::{CellBlock, CellKind, Group, Mesh};

/// Halves every edge of a mesh of triangles and lines; groups are inherited.
pub fn refine(mesh: &Mesh) -> Mesh {
    let mut points = mesh.points.clone();
    let mut middles = HashMap::new();
    let mut middle = |points: &mut Vec<[f64; 3]>, a: u32, b: u32| {
        *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let (p, q) = (points[a as usize], points[b as usize]);
            points.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
            points.len() as u32 - 1
        })
    };
    // New cells of each old cell.
    let mut children: Vec<Vec<u32>> = Vec::with_capacity(mesh.cell_count());
    let mut blocks = Vec::new();
    let mut next = 0;
    for block in &mesh.blocks {
        let mut nodes = Vec::new();
        for cell in block.cells() {
            let cut: Vec<u32> = match (block.kind, cell) {
                (CellKind::Line, &[a, b]) => {
                    let m = middle(&mut points, a, b);
                    vec![a, m, m, b]
                }
                (CellKind::Triangle, &[a, b, c]) => {
                    let ab = middle(&mut points, a, b);
                    let bc = middle(&mut points, b, c);
                    let ca = middle(&mut points, c, a);
                    vec![a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]
                }
                _ => cell.to_vec(),
            };
            let count = (cut.len() / block.kind.points()) as u32;
            children.push((next..next + count).collect());
            next += count;
            nodes.extend(cut);
        }
        blocks.push(CellBlock::new(block.kind, nodes));
    }
    let groups = mesh
        .groups
        .iter()
        .map(|group| Group {
            cells: group
                .cells
                .iter()
                .filter_map(|&cell| children.get(cell as usize))
                .flatten()
                .copied()
                .collect(),
            ..group.clone()
        })
        .collect();
    Mesh {
        points,
        blocks,
        groups,
        ..Mesh::default()
    }
}
