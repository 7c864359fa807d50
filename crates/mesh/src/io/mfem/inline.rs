//! MFEM's meshes of a box that a few settings describe: `type = quad`, `nx = 4`, `sx = 1.0`, ….

use std::collections::HashMap;

use crate::error::Result;
use crate::io::builder::Builder;
use crate::io::scan::Scan;
use crate::io::sides::quadrangles;
use crate::memory;
use crate::mesh::topology::sides;
use crate::mesh::{CellKind, Mesh, Shape};

/// How MFEM cuts a square or a cube: types of cells, and their corners among those of the cube, 8 being its centre.
const CUTS: [(&str, CellKind, &[&[usize]]); 7] = [
    ("segment", CellKind::Line, &[&[0, 1]]),
    ("quad", CellKind::Quadrangle, &[&[0, 1, 2, 3]]),
    ("tri", CellKind::Triangle, &[&[0, 2, 3], &[1, 2, 0]]),
    ("hex", CellKind::Hexahedron, &[&[0, 1, 2, 3, 4, 5, 6, 7]]),
    (
        "wedge",
        CellKind::Prism,
        &[&[0, 1, 2, 4, 5, 6], &[0, 2, 3, 4, 6, 7]],
    ),
    (
        "tet",
        CellKind::Tetrahedron,
        &[
            &[0, 1, 2, 6],
            &[0, 5, 1, 6],
            &[0, 4, 5, 6],
            &[0, 2, 3, 6],
            &[0, 3, 7, 6],
            &[0, 7, 4, 6],
        ],
    ),
    (
        "pyramid",
        CellKind::Pyramid,
        &[
            &[0, 1, 2, 3, 8],
            &[0, 4, 5, 1, 8],
            &[1, 5, 6, 2, 8],
            &[2, 6, 7, 3, 8],
            &[3, 7, 4, 0, 8],
            &[7, 6, 5, 4, 8],
        ],
    ),
];

/// A few bytes are not to take all memory.
const MOST: f64 = 2e7;

/// Reads the settings and makes the mesh.
pub fn read(scan: &mut Scan<'_>) -> Result<Mesh> {
    let mut settings: HashMap<String, String> = HashMap::new();
    while scan.peek().is_some() {
        scan.skip_blanks();
        let line = String::from_utf8_lossy(scan.line()).into_owned();
        let (name, value) = line
            .split_once('=')
            .ok_or_else(|| scan.error("a setting has no ="))?;
        let value = value.split('#').next().unwrap_or_default();
        settings.insert(name.trim().to_owned(), value.trim().to_owned());
    }
    let wanted = settings.get("type").map_or("", String::as_str);
    let known = CUTS.iter().find(|(name, ..)| *name == wanted);
    let &(_, kind, cut) =
        known.ok_or_else(|| scan.error(format!("{wanted:?} is not a type of cells")))?;
    let dim = usize::from(kind.dim());
    let (mut number, mut size) = ([1usize; 3], [0.0; 3]);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate().take(dim) {
        let value = |key: String| settings.get(&key).map(String::as_str).unwrap_or_default();
        let count = value(format!("n{name}"))
            .parse()
            .ok()
            .filter(|n| (1..=1 << 20).contains(n));
        let length = value(format!("s{name}"))
            .parse()
            .ok()
            .filter(|s: &f64| s.is_finite());
        number[axis] =
            count.ok_or_else(|| scan.error(format!("n{name} is not a number of cells")))?;
        size[axis] = length.ok_or_else(|| scan.error(format!("s{name} is not a length")))?;
    }
    let cubes = number.iter().map(|&n| n as f64).product::<f64>();
    memory::require(cubes * (48 * cut.len() * kind.points()) as f64, "this mesh")?;
    if cubes * cut.len() as f64 > MOST {
        return Err(scan.error(format!("a box of more than {MOST:e} cells is not made")));
    }
    Ok(make(kind, cut, number, size))
}

fn make(kind: CellKind, cut: &[&[usize]], number: [usize; 3], size: [f64; 3]) -> Mesh {
    let dim = usize::from(kind.dim());
    let ends: [usize; 3] = std::array::from_fn(|axis| if axis < dim { number[axis] } else { 0 });
    let mut builder = Builder::default();
    let axes = |end: [usize; 3]| {
        (0..=end[2])
            .flat_map(move |z| (0..=end[1]).flat_map(move |y| (0..=end[0]).map(move |x| [x, y, z])))
    };
    let at = |i: usize, axis: usize| size[axis] * i as f64 / number[axis] as f64;
    let points = axes(ends).map(|point| std::array::from_fn(|axis| at(point[axis], axis)));
    builder.mesh.points = points.collect();
    let lines = builder.mesh.points.len();
    let last = number.map(|n| n - 1);
    let corner = |[x, y, z]: [usize; 3], corner: usize| {
        let [dx, dy] = [[0, 0], [1, 0], [1, 1], [0, 1]][corner % 4];
        let z = z + corner / 4;
        (((z * (ends[1] + 1)) + y + dy) * (ends[0] + 1) + x + dx) as u32
    };
    for (place, cube) in axes(last).enumerate() {
        for cell in cut {
            let centre = (lines + place) as u32;
            let nodes = cell
                .iter()
                .map(|&c| if c == 8 { centre } else { corner(cube, c) });
            let nodes: Vec<u32> = nodes.collect();
            let next = builder.new_number();
            builder.cell(kind, &nodes, next, 1);
        }
    }
    if kind == CellKind::Pyramid {
        let middle = |cube: [usize; 3]| {
            std::array::from_fn(|axis| size[axis] * (cube[axis] as f64 + 0.5) / number[axis] as f64)
        };
        builder.mesh.points.to_mut().extend(axes(last).map(middle));
    }
    // A side of the box is cut as the cells behind it.
    let of_box: Vec<&[usize]> = match dim {
        1 => sides(Shape::Line).to_vec(),
        2 => sides(Shape::Quadrangle).to_vec(),
        _ => quadrangles(Shape::Hexahedron)
            .iter()
            .map(<[_; 4]>::as_slice)
            .collect(),
    };
    for (tag, side) in (1..).zip(of_box) {
        // The axis along which the side does not extend, and whether it is the far one.
        let position = |corner: usize| {
            [
                usize::from(matches!(corner % 4, 1 | 2)),
                usize::from(corner % 4 > 1),
                corner / 4,
            ]
        };
        let flat = |axis: &usize| {
            side.iter()
                .all(|&c| position(c)[*axis] == position(side[0])[*axis])
        };
        let axis = (0..dim).find(flat).unwrap_or(0);
        let far = position(side[0])[axis] * last[axis];
        for cube in axes(last).filter(|cube| cube[axis] == far) {
            for part in parts(side, cut) {
                let nodes: Vec<u32> = part.iter().map(|&c| corner(cube, c)).collect();
                let kind = [
                    CellKind::Vertex,
                    CellKind::Line,
                    CellKind::Triangle,
                    CellKind::Quadrangle,
                ][nodes.len() - 1];
                let next = builder.new_number();
                builder.cell(kind, &nodes, next, tag);
            }
        }
    }
    builder.finish()
}

/// The facets of the cells of a cube that are on one of its sides.
fn parts(side: &[usize], cut: &[&[usize]]) -> Vec<Vec<usize>> {
    let shared = cut.iter().map(|cell| {
        let shared = side.iter().copied().filter(|corner| cell.contains(corner));
        shared.collect::<Vec<usize>>()
    });
    let at_least = if side.len() == 4 { 3 } else { side.len() };
    shared.filter(|part| part.len() >= at_least).collect()
}
