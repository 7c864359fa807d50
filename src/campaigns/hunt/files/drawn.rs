//! Random meshes with fields and groups, simpler ones of each, and what a reader changed.

use serde::{Deserialize, Serialize};

use faceoff_form::random::Random;
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Group, Mesh, Support, Values};

/// A file format and what it can hold; data beyond that are not drawn.
pub struct Format {
    /// The name of the format here, and the suffix of its files.
    pub name: &'static str,
    pub suffix: &'static str,
    /// Its names for our own library and meshio, with the libraries that write and read it.
    pub native: &'static str,
    pub meshio: &'static str,
    pub libraries: &'static [&'static str],
    /// Whether it holds fields on points, fields on cells, and named groups of cells.
    pub holds: [bool; 3],
    /// Whether points that no cell has are part of it.
    pub unused: bool,
    /// By how much coordinates may be rounded, relative to 1, as the format has few digits.
    pub digits: f64,
}

const fn format(
    [name, suffix, native, meshio]: [&'static str; 4],
    libraries: &'static [&'static str],
    holds: [bool; 3],
    unused: bool,
) -> Format {
    Format {
        name,
        suffix,
        native,
        meshio,
        libraries,
        holds,
        unused,
        digits: 0.0,
    }
}

const FIELDS: [bool; 3] = [true, true, false];
const BARE: [bool; 3] = [false; 3];

/// The formats that are drawn. Gmsh's own two hold groups; Nastran's fields of 16 characters hold 10 digits or more.
pub const FORMATS: [Format; 12] = [
    format(
        ["vtu", "vtu", "vtu", "vtu"],
        &["rust", "meshio", "vtk"],
        FIELDS,
        true,
    ),
    format(
        ["vtk", "vtk", "vtk", "vtk"],
        &["rust", "meshio", "vtk"],
        FIELDS,
        true,
    ),
    format(
        ["msh41", "msh", "msh", "gmsh"],
        &["rust", "meshio", "gmsh"],
        [true; 3],
        false,
    ),
    format(
        ["msh22", "msh", "msh", "gmsh22"],
        &["rust", "meshio", "gmsh"],
        [true; 3],
        false,
    ),
    format(
        ["xdmf", "xdmf", "xdmf", "xdmf"],
        &["rust", "meshio"],
        FIELDS,
        true,
    ),
    format(
        ["med", "med", "med", "med"],
        &["rust", "meshio", "gmsh"],
        FIELDS,
        true,
    ),
    format(
        ["avsucd", "inp", "avsucd", "avsucd"],
        &["rust", "meshio"],
        FIELDS,
        true,
    ),
    format(
        ["exodus", "e", "exodus", "exodus"],
        &["rust", "meshio"],
        BARE,
        true,
    ),
    format(
        ["medit", "mesh", "medit", "medit"],
        &["rust", "meshio", "gmsh"],
        BARE,
        false,
    ),
    format(
        ["su2", "su2", "su2", "su2"],
        &["rust", "meshio", "gmsh"],
        BARE,
        false,
    ),
    format(["unv", "unv", "unv", ""], &["rust", "gmsh"], BARE, false),
    Format {
        digits: 1e-9,
        ..format(
            ["nastran", "bdf", "nastran", "nastran"],
            &["rust", "meshio", "gmsh"],
            BARE,
            false,
        )
    },
];

/// Values on points or cells; NaN is `None`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Values64 {
    pub name: String,
    pub on: String,
    pub components: usize,
    #[serde(rename = "type")]
    pub kind: String,
    pub values: Vec<Option<f64>>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Named {
    pub name: String,
    pub tag: i64,
    pub dim: u8,
    pub cells: Vec<usize>,
}

/// A mesh in the form in which scripts get it; cells have Gmsh's types and orders of nodes.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Drawn {
    pub points: Vec<[f64; 3]>,
    pub cells: Vec<(u8, Vec<usize>)>,
    pub fields: Vec<Values64>,
    pub groups: Vec<Named>,
}

/// Corners of cells in a unit cube, in Gmsh's order, and the edges whose midpoints are nodes of the quadratic cell.
struct Shape {
    types: [u8; 2],
    corners: &'static [[f64; 3]],
    edges: &'static [[usize; 2]],
}

const O: [f64; 3] = [0.0, 0.0, 0.0];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const XY: [f64; 3] = [1.0, 1.0, 0.0];
const XZ: [f64; 3] = [1.0, 0.0, 1.0];
const YZ: [f64; 3] = [0.0, 1.0, 1.0];
const XYZ: [f64; 3] = [1.0; 3];

const PLANE: [Shape; 2] = [
    Shape {
        types: [2, 9],
        corners: &[O, X, Y],
        edges: &[[0, 1], [1, 2], [2, 0]],
    },
    Shape {
        types: [3, 16],
        corners: &[O, X, XY, Y],
        edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    },
];
const SOLID: [Shape; 4] = [
    Shape {
        types: [4, 11],
        corners: &[O, X, Y, Z],
        edges: &[[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]],
    },
    Shape {
        types: [5, 5],
        corners: &[O, X, XY, Y, Z, XZ, XYZ, YZ],
        edges: &[],
    },
    Shape {
        types: [6, 6],
        corners: &[O, X, Y, Z, XZ, YZ],
        edges: &[],
    },
    Shape {
        types: [7, 7],
        corners: &[O, X, XY, Y, Z],
        edges: &[],
    },
];
const NAMES: [&str; 6] = ["u", "v", "u v", "T (K)", "µ", "a%20b"];
/// Numbers that few digits, binary32 or 32-bit integers do not hold.
const FLOATS: [f64; 9] = [
    0.0,
    1.0,
    -2.5,
    0.1,
    16_777_217.0,
    3.5e38,
    1e-40,
    1e-300,
    1.0 / 3.0,
];
const INTEGERS: [f64; 6] = [0.0, 1.0, -7.0, 2_147_483_648.0, 1_099_511_627_777.0, 5.0];

impl Drawn {
    /// A mesh that this format can hold.
    pub fn new(random: &mut Random, format: &Format) -> Drawn {
        let mut drawn = Drawn::default();
        let is_solid = random.below(2) == 1;
        let shapes: &[Shape] = if is_solid { &SOLID } else { &PLANE };
        let order = random.below(3) / 2;
        let scale = [1.0, 0.1, 1.0 / 3.0, 1e-3][random.below(4)];
        for k in 0..1 + random.below(4) {
            let shape = &shapes[random.below(shapes.len())];
            let mids = shape.edges.iter().map(|&[a, b]| {
                let [a, b] = [shape.corners[a], shape.corners[b]];
                [0, 1, 2].map(|i| (a[i] + b[i]) / 2.0)
            });
            let corners = shape.corners.iter().copied();
            let all = corners.chain(mids.filter(|_| order == 1));
            let nodes: Vec<usize> = all
                .map(|[x, y, z]| drawn.point([(x + k as f64) * scale, y * scale, z * scale]))
                .collect();
            let side = (order == 0 && random.below(3) == 0).then(|| nodes[..3].to_vec());
            drawn.cells.push((shape.types[order], nodes));
            match side {
                Some(nodes) if !is_solid => drawn.cells.push((1, nodes[..2].to_vec())),
                Some(nodes) if shape.types[0] == 4 => drawn.cells.push((2, nodes)),
                _ => {}
            }
        }
        if format.unused && random.below(4) == 0 {
            drawn.points.push([-scale, 0.0, 0.0]);
        }
        for (on, _) in ["points", "cells"]
            .iter()
            .zip(format.holds)
            .filter(|of| of.1)
        {
            for name in NAMES {
                if random.below(6) == 0 {
                    let field = drawn.field(random, name, on);
                    drawn.fields.push(field);
                }
            }
        }
        if format.holds[2] && random.below(2) == 0 {
            for (k, name) in ["left", "a b", "Ω"].into_iter().enumerate() {
                let dim = drawn.dim(random.below(drawn.cells.len()));
                let of_dim = (0..drawn.cells.len()).filter(|&cell| drawn.dim(cell) == dim);
                let cells: Vec<usize> = of_dim.filter(|_| random.below(2) == 0).collect();
                if !cells.is_empty() {
                    drawn.groups.push(Named {
                        name: name.to_owned(),
                        tag: [1, 7, 300][k],
                        dim,
                        cells,
                    });
                }
            }
        }
        drawn
    }

    fn point(&mut self, at: [f64; 3]) -> usize {
        let known = self.points.iter().position(|point| *point == at);
        known.unwrap_or_else(|| {
            self.points.push(at);
            self.points.len() - 1
        })
    }

    fn field(&self, random: &mut Random, name: &str, on: &str) -> Values64 {
        let components = [1, 1, 3][random.below(3)];
        let rows = match on {
            "points" => self.points.len(),
            _ => self.cells.len(),
        };
        let kind = ["f8", "f8", "i8"][random.below(3)];
        let values = (0..rows * components).map(|_| match kind {
            "f8" if random.below(30) == 0 => None,
            "f8" => Some(FLOATS[random.below(FLOATS.len())]),
            _ => Some(INTEGERS[random.below(INTEGERS.len())]),
        });
        Values64 {
            name: name.to_owned(),
            on: on.to_owned(),
            components,
            kind: kind.to_owned(),
            values: values.collect(),
        }
    }

    fn dim(&self, cell: usize) -> u8 {
        CellKind::from_gmsh(i32::from(self.cells[cell].0)).map_or(0, CellKind::dim)
    }

    /// A description, such as `3 cells, 1 field, 2 groups`.
    pub fn words(&self) -> String {
        format!(
            "{} cells, {} fields and {} groups",
            self.cells.len(),
            self.fields.len(),
            self.groups.len()
        )
    }

    /// The same with less: without a cell, a field, a group, a point that no cell has, or with plain names and values.
    pub fn simpler(&self) -> Vec<Drawn> {
        let mut all = Vec::new();
        for k in 0..self.fields.len() {
            let mut less = self.clone();
            less.fields.remove(k);
            all.push(less);
        }
        for k in 0..self.groups.len() {
            let mut less = self.clone();
            less.groups.remove(k);
            all.push(less);
        }
        for k in (0..self.cells.len()).filter(|_| self.cells.len() > 1) {
            all.push(self.without_cell(k));
        }
        for k in 0..self.fields.len() {
            let of = &self.fields[k];
            if of.name.len() > 1 && self.fields.iter().all(|other| other.name != "w") {
                let mut less = self.clone();
                less.fields[k].name = "w".to_owned();
                all.push(less);
            }
            if of.values.iter().any(|value| *value != Some(1.0)) {
                let mut less = self.clone();
                less.fields[k].values.fill(Some(1.0));
                all.push(less);
            }
        }
        all
    }

    fn without_cell(&self, k: usize) -> Drawn {
        let mut less = self.clone();
        let was_used = self.used();
        less.cells.remove(k);
        for field in less.fields.iter_mut().filter(|of| of.on == "cells") {
            let at = k * field.components;
            field.values.drain(at..at + field.components);
        }
        for group in &mut less.groups {
            group.cells.retain(|cell| *cell != k);
            for cell in group.cells.iter_mut().filter(|cell| **cell > k) {
                *cell -= 1;
            }
        }
        less.groups.retain(|group| !group.cells.is_empty());
        // Points of this cell only go with it.
        let used = less.used();
        for point in (0..self.points.len()).rev() {
            if used[point] || !was_used[point] {
                continue;
            }
            less.points.remove(point);
            for field in less.fields.iter_mut().filter(|of| of.on == "points") {
                let at = point * field.components;
                field.values.drain(at..at + field.components);
            }
            let nodes = less.cells.iter_mut().flat_map(|(_, nodes)| nodes);
            for node in nodes.filter(|node| **node > point) {
                *node -= 1;
            }
        }
        less
    }

    fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.points.len()];
        for node in self.cells.iter().flat_map(|(_, nodes)| nodes) {
            used[*node] = true;
        }
        used
    }

    /// As our own library holds it; `None` for a type that it does not know.
    pub fn mesh(&self) -> Option<Mesh> {
        let mut mesh = Mesh {
            points: self.points.clone().into(),
            ..Mesh::default()
        };
        let mut blocks: Vec<(CellKind, Vec<u32>)> = Vec::new();
        for (kind, nodes) in &self.cells {
            let kind = CellKind::from_gmsh(i32::from(*kind))?;
            if blocks.last().is_none_or(|(last, _)| *last != kind) {
                blocks.push((kind, Vec::new()));
            }
            let (_, last) = blocks.last_mut()?;
            last.extend(nodes.iter().map(|&node| node as u32));
        }
        let blocks = blocks.into_iter();
        mesh.blocks = blocks
            .map(|(kind, nodes)| CellBlock::new(kind, nodes))
            .collect();
        for of in &self.fields {
            let on = match &*of.on {
                "points" => Support::Points,
                _ => Support::Cells,
            };
            let numbers = of.values.iter().map(|value| value.unwrap_or(f64::NAN));
            let values = match &*of.kind {
                "f8" => Values::F64(numbers.collect::<Vec<f64>>().into()),
                _ => Values::I64(
                    numbers
                        .map(|value| value as i64)
                        .collect::<Vec<i64>>()
                        .into(),
                ),
            };
            mesh.fields
                .push(Field::new(&*of.name, on, of.components, values));
        }
        for of in &self.groups {
            mesh.groups.push(Group {
                name: Some(of.name.clone()),
                cells: of.cells.iter().map(|&cell| cell as u32).collect(),
                ..Group::new(of.dim, of.tag)
            });
        }
        mesh.groups.sort_by_key(|group| (group.dim, group.tag));
        Some(mesh)
    }

    /// What our own library has read; `None` where it has cells of a type that is not drawn.
    pub fn of(mesh: &Mesh) -> Option<Drawn> {
        let mut drawn = Drawn {
            points: mesh.points.to_vec(),
            ..Drawn::default()
        };
        for (_, kind, nodes) in mesh.cells() {
            if kind.gmsh() == 0 {
                return None;
            }
            let nodes = nodes.iter().map(|&node| node as usize).collect();
            drawn.cells.push((kind.gmsh(), nodes));
        }
        for of in &mesh.fields {
            let (on, rows) = match of.on {
                Support::Points => ("points", mesh.points.len()),
                Support::Cells => ("cells", mesh.cell_count()),
                Support::CellPoints => continue,
            };
            let numbers = of.values.to_f64();
            let mut values = vec![None; rows * of.components];
            let rows: Vec<usize> = match of.at.is_empty() {
                true => (0..rows).collect(),
                false => of.at.iter().map(|&at| at as usize).collect(),
            };
            for (row, numbers) in rows.iter().zip(numbers.chunks(of.components)) {
                for (i, number) in numbers.iter().enumerate() {
                    values[row * of.components + i] = Some(*number).filter(|v| !v.is_nan());
                }
            }
            drawn.fields.push(Values64 {
                name: of.name.clone(),
                on: on.to_owned(),
                components: of.components,
                kind: if of.values.rest().is_some() {
                    "i8"
                } else {
                    "f8"
                }
                .to_owned(),
                values,
            });
        }
        for of in &mesh.groups {
            drawn.groups.push(Named {
                name: of.name.clone().unwrap_or_default(),
                tag: of.tag,
                dim: of.dim,
                cells: of.cells.iter().map(|&cell| cell as usize).collect(),
            });
        }
        Some(drawn)
    }

    /// What differs first in what was read, of what the reader can see of this mesh; points and cells may have another order.
    pub fn change(&self, read: &Drawn, format: &Format, sees: [bool; 2]) -> Option<String> {
        let far = |a: &[f64; 3], b: &[f64; 3]| {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            // NaN is far from everything.
            apart.fold(0.0, |most, far| if far <= most { most } else { far })
        };
        // Points that were drawn are at least this far apart.
        const NEAR: f64 = 1e-4;
        let of_read = |at: &[f64; 3]| read.points.iter().position(|point| far(at, point) < NEAR);
        let points: Vec<Option<usize>> = self.points.iter().map(of_read).collect();
        let used = self.used();
        for (k, point) in points.iter().enumerate() {
            if point.is_none() && (used[k] || format.unused) {
                return Some(match used[k] {
                    true => "a point is lost".to_owned(),
                    false => "a point that no cell has is lost".to_owned(),
                });
            }
        }
        let apart = |k: usize, at: usize| far(&self.points[k], &read.points[at]);
        let rounded = |(k, at): (usize, &Option<usize>)| at.map_or(0.0, |at| apart(k, at));
        if points
            .iter()
            .enumerate()
            .map(rounded)
            .any(|far| !(far <= format.digits))
        {
            return Some("coordinates are rounded".to_owned());
        }
        let mut free = vec![true; read.cells.len()];
        let mut cells = Vec::new();
        for (kind, nodes) in &self.cells {
            let nodes: Option<Vec<usize>> = nodes.iter().map(|&node| points[node]).collect();
            let nodes = nodes.unwrap_or_default();
            let same =
                |k: &usize| free[*k] && read.cells[*k].0 == *kind && read.cells[*k].1 == nodes;
            if let Some(k) = (0..read.cells.len()).find(same) {
                free[k] = false;
                cells.push(k);
                continue;
            }
            let sorted = |nodes: &[usize]| {
                let mut nodes = nodes.to_vec();
                nodes.sort_unstable();
                nodes
            };
            let like = |of: &(u8, Vec<usize>)| of.0 == *kind && sorted(&of.1) == sorted(&nodes);
            let kind =
                CellKind::from_gmsh(i32::from(*kind)).map_or(String::new(), |of| of.to_string());
            return Some(match read.cells.iter().any(like) {
                true => format!("the nodes of a {kind} have another order"),
                false => format!("a {kind} is lost"),
            });
        }
        if free.contains(&true) {
            return Some("there is a cell that was not drawn".to_owned());
        }
        for field in self.fields.iter().filter(|_| sees[0]) {
            let rows: Vec<Option<usize>> = match &*field.on {
                "points" => points.clone(),
                _ => cells.iter().copied().map(Some).collect(),
            };
            if let Some(change) = field.change(&read.fields, &rows) {
                return Some(change);
            }
        }
        for group in self.groups.iter().filter(|_| sees[1]) {
            let named = |of: &&Named| of.name == group.name && of.dim == group.dim;
            let Some(other) = read.groups.iter().find(named) else {
                return Some(format!("a group named {:?} is lost", group.name));
            };
            let mut drawn: Vec<usize> = group.cells.iter().map(|&cell| cells[cell]).collect();
            let mut found = other.cells.clone();
            drawn.sort_unstable();
            found.sort_unstable();
            if drawn != found {
                return Some("a group has other cells".to_owned());
            }
            if other.tag != group.tag {
                return Some("a group has another tag".to_owned());
            }
        }
        None
    }
}

impl Values64 {
    /// How the field of this name differs from this one, whose row k is row `rows[k]` there.
    fn change(&self, read: &[Values64], rows: &[Option<usize>]) -> Option<String> {
        let (on, kind) = (
            &self.on,
            if self.kind == "f8" {
                "numbers"
            } else {
                "integers"
            },
        );
        let of = match self.components {
            1 => format!("{kind} on {on}"),
            _ => format!("vectors of {kind} on {on}"),
        };
        let Some(other) = read
            .iter()
            .find(|of| of.on == self.on && of.name == self.name)
        else {
            return Some(format!("a field of {of} named {:?} is lost", self.name));
        };
        if other.components < self.components {
            return Some(format!("components of {of} are lost"));
        }
        for (k, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            for i in 0..self.components {
                let drawn = self.values[k * self.components + i];
                let found = other
                    .values
                    .get(row * other.components + i)
                    .copied()
                    .flatten();
                match (drawn, found) {
                    (Some(a), Some(b)) if a == b => {}
                    (None, None) => {}
                    (None, _) => return Some(format!("NaN in {of} becomes a number")),
                    (Some(a), Some(b)) if (a - b).abs() <= 1e-6 * a.abs() => {
                        return Some(format!("{of} are rounded"));
                    }
                    _ => return Some(format!("{of} are wrong")),
                }
            }
        }
        None
    }
}
