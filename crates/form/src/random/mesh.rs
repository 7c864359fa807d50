//! The meshes of random forms: squares and cubes of few cells, moved, graded, flat, with slivers, or numbered in another order.

use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::generate::{Cuboid, lattice_mesh, union_mesh};
use faceoff_mesh::mesh::{CellKind, Mesh};

use super::Random;

/// A mesh of the unit square or cube, by what was done to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Quadrangles instead of triangles.
    pub is_quadrangles: bool,
    /// Tetrahedra of a cube instead of triangles of a square?
    pub is_solid: bool,
    /// Cells along a side.
    pub n: usize,
    /// Are inner points moved, so that no two cells are alike?
    pub is_moved: bool,
    /// Are cells smaller towards a corner?
    pub is_graded: bool,
    /// Are inner points close to an edge, or a face, of their cells?
    pub has_slivers: bool,
    /// Is it a twentieth as high as wide?
    pub is_flat: bool,
    /// The seed of the order of points and cells; 0: that of the generator.
    pub order: u64,
}

impl Shape {
    /// One at random.
    pub fn new(random: &mut Random) -> Self {
        let is_quadrangles = random.is(20);
        let is_solid = !is_quadrangles && random.is(20);
        Shape::of(random, is_quadrangles, is_solid)
    }

    /// Another one of the same kind of cells.
    pub fn other(self, random: &mut Random) -> Self {
        Shape::of(random, self.is_quadrangles, self.is_solid)
    }

    fn of(random: &mut Random, is_quadrangles: bool, is_solid: bool) -> Self {
        let is_moved = random.is(70);
        Shape {
            is_quadrangles,
            is_solid,
            n: match is_solid {
                true => 1 + random.below(2),
                false => 2 + random.below(4),
            },
            is_moved,
            // What moves other points too would turn the flattest over.
            has_slivers: !is_quadrangles && !is_moved && random.is(50),
            is_graded: random.is(25),
            is_flat: random.is(10),
            order: if random.is(60) {
                1 + random.below(1000) as u64
            } else {
                0
            },
        }
    }

    /// As the end of a sentence: `3 × 3 squares of four triangles, moved, in another order`.
    pub fn words(&self) -> String {
        let n = self.n;
        let mut words = match (self.is_quadrangles, self.is_solid) {
            (true, _) => format!("{n} × {n} quadrangles"),
            (_, true) => format!("{n} × {n} × {n} cubes of tetrahedra"),
            _ => format!("{n} × {n} squares of triangles"),
        };
        let more = [
            (self.is_moved, "moved"),
            (self.has_slivers, "with slivers"),
            (self.is_graded, "graded"),
            (self.is_flat, "flat"),
            (self.order > 0, "numbered in another order"),
        ];
        for (_, word) in more.iter().filter(|(is, _)| *is) {
            words += ", ";
            words += word;
        }
        words
    }

    /// Two cells along a side, as they are generated.
    pub fn small() -> Self {
        Shape {
            is_quadrangles: false,
            is_solid: false,
            n: 2,
            is_moved: false,
            has_slivers: false,
            is_graded: false,
            is_flat: false,
            order: 0,
        }
    }

    /// The smallest in as many dimensions.
    pub fn smallest(self) -> Self {
        match self.is_solid {
            true => Shape {
                n: 1,
                ..self.even()
            },
            false => Shape::small(),
        }
    }

    /// The number of coordinates.
    pub fn dim(self) -> usize {
        if self.is_solid { 3 } else { 2 }
    }

    /// The same size and cells, as they are generated.
    pub fn even(self) -> Self {
        Shape {
            is_quadrangles: self.is_quadrangles,
            is_solid: self.is_solid,
            n: self.n,
            ..Shape::small()
        }
    }

    /// The table of a form file that makes it, where a generator does.
    pub fn generator(&self) -> Option<String> {
        let name = match (self.is_quadrangles, self.is_solid) {
            (true, _) => "quadrangles",
            (_, true) => "union-cube",
            _ => "union-jack",
        };
        (*self == self.even()).then(|| format!("[mesh]\ngenerator = \"{name}\"\nn = {}\n", self.n))
    }

    /// The mesh.
    ///
    /// # Errors
    /// An interruption.
    pub fn mesh(&self) -> Result<Mesh> {
        let cuboid = match self.is_solid {
            true => Cuboid::new([0.0; 3], [1.0; 3]),
            false => Cuboid::new([0.0; 2], [1.0; 2]),
        };
        let n = self.n as f64;
        let is_middle = |x: &f64| ((x * n).fract() - 0.5).abs() < 0.1;
        let mut mesh = match self.is_quadrangles {
            true => lattice_mesh(self.n, &cuboid)?,
            false => union_mesh(self.n, &cuboid)?,
        };
        for point in mesh.points.to_mut() {
            let [x, y, z] = *point;
            if self.is_moved {
                let depth = if self.is_solid {
                    4.0 * z * (1.0 - z)
                } else {
                    1.0
                };
                let bump = 16.0 * x * (1.0 - x) * y * (1.0 - y) * depth;
                point[0] += 0.03 * bump * (7.0 * y).sin();
                point[1] += 0.03 * bump * (5.0 * x + 1.0).cos();
                if self.is_solid {
                    point[2] += 0.03 * bump * (6.0 * x * y).cos();
                }
            }
            if self.has_slivers && point[..self.dim()].iter().all(is_middle) {
                point[0] += 0.48 / n;
            }
            if self.is_graded {
                point[0] *= point[0];
            }
            if self.is_flat {
                point[1] *= 0.05;
            }
        }
        if self.order > 0 {
            shuffle(&mut mesh, self.order);
        }
        Ok(mesh)
    }
}

/// A permutation.
fn order(count: usize, random: &mut Random) -> Vec<u32> {
    let mut all: Vec<u32> = (0..count as u32).collect();
    for k in (1..count).rev() {
        all.swap(k, random.below(k + 1));
    }
    all
}

/// Numbers points and the cells of each block in another order, and lets the corners of cells begin elsewhere. Returns the new number of each point.
pub(crate) fn shuffle(mesh: &mut Mesh, seed: u64) -> Vec<u32> {
    let mut random = Random::new(seed);
    let new = order(mesh.points.len(), &mut random);
    let mut points = mesh.points.to_vec();
    for (k, point) in mesh.points.iter().enumerate() {
        points[new[k] as usize] = *point;
    }
    mesh.points = points.into();
    let mut cells: Vec<u32> = Vec::new();
    for block in &mut mesh.blocks {
        let width = block.kind.points();
        let (start, places) = (cells.len() as u32, order(block.len(), &mut random));
        let old = block.nodes.to_vec();
        let nodes = block.nodes.to_mut();
        for (k, corners) in old.chunks_exact(width).enumerate() {
            let at = places[k] as usize;
            let to = &mut nodes[at * width..(at + 1) * width];
            for (node, corner) in to.iter_mut().zip(corners) {
                *node = new[*corner as usize];
            }
            // Turned without being turned over.
            match block.kind {
                CellKind::Triangle | CellKind::Quadrangle => to.rotate_left(random.below(width)),
                CellKind::Tetrahedron => to[..3].rotate_left(random.below(3)),
                _ => {}
            }
        }
        let entities = block.entities.clone();
        for (k, entity) in entities.into_iter().enumerate() {
            block.entities[places[k] as usize] = entity;
        }
        block.tags.clear();
        cells.extend(places.iter().map(|place| start + place));
    }
    for group in &mut mesh.groups {
        for cell in &mut group.cells {
            *cell = cells[*cell as usize];
        }
        group.cells.sort_unstable();
    }
    new
}
