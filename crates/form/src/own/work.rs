//! One integral of a form, ready to be evaluated: its entities, its points, its operations, and the use of their results.

use std::collections::BTreeMap;

use faceoff_fem::quadrature::Rule;
use faceoff_mesh::mesh::Mesh;

use super::element::{Shape, Table};
use super::tape::{Slot, Tape};
use crate::grid::{Cells, Grid};
use crate::problem::{Bilinear, Domain, Integral, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// Numbers in the matrix of a batch, so that it fits into a core's cache.
const ROOM: usize = 1 << 14;
/// The most cells of a batch.
const MOST: usize = 64;

/// A cell, or a facet with its one or two cells.
#[derive(Debug, Clone, Copy)]
pub struct Entity {
    /// The second is that of the other side.
    pub cells: [u32; 2],
    /// The placement of the points in each cell.
    pub places: [u16; 2],
}

/// The quadrature points in the reference cell: those of a facet are placed by its vertices in a fixed order, so that both cells of a
/// facet have the same.
#[derive(Debug)]
pub struct Placement {
    /// The number of the facet in the cell.
    pub facet: usize,
    /// Positions in the reference cell.
    pub points: Vec<[f64; 4]>,
    /// Basis functions of each shape.
    pub tables: Vec<Table>,
}

/// One component of an unknown from one side: the scalar functions in an integral.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    pub side: usize,
    pub unknown: usize,
    pub component: usize,
    /// The position of its shape.
    pub shape: usize,
    pub count: usize,
    /// Its first function among those of all blocks.
    pub start: usize,
}

/// The source of the values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// The dofs of a block, or those of the previous step.
    Block { block: usize, is_old: bool },
    /// A component of a datum that is interpolated, from a side.
    Datum {
        datum: usize,
        component: usize,
        side: usize,
    },
}

/// A field or a derivative of it that operations need.
#[derive(Debug)]
pub struct Needed {
    pub given: Given,
    pub shape: usize,
    /// The derivatives and their destinations.
    pub derivatives: Vec<(usize, Slot)>,
}

/// The datum's values at the nodes of its space.
#[derive(Debug)]
pub struct Nodal {
    pub nodes: Vec<[f64; 4]>,
    pub tape: Tape,
    pub components: Vec<Slot>,
}

/// Derivatives of the test function and the increment, and the coefficient.
type Entries = Vec<(usize, usize, Id)>;

/// Coefficients of pairs of derivatives.
pub type Pairs = Vec<(usize, usize, Slot)>;

/// An integral, ready to be evaluated.
#[derive(Debug)]
pub struct Work {
    pub sides: usize,
    pub domain: Domain,
    /// Sum to 1.
    pub weights: Vec<f64>,
    /// Sorted by their placements.
    pub entities: Vec<Entity>,
    pub placements: Vec<Placement>,
    pub shapes: Vec<Shape>,
    pub blocks: Vec<Block>,
    /// The number of functions of all blocks.
    pub size: usize,
    pub tape: Tape,
    pub needed: Vec<Needed>,
    /// By the position of the datum.
    pub data: BTreeMap<usize, Nodal>,
    /// The coefficient of a derivative of a block's test function.
    pub vector: Vec<(usize, usize, Slot)>,
    /// Blocks of test function and increment, and the coefficients of their derivatives.
    pub matrix: Vec<(usize, usize, Pairs)>,
    pub has_second: bool,
    /// Does the Jacobian of the map of the reference cell vary between points?
    pub is_curved: bool,
}

/// The number of a derivative: 0 for the function, then the first ones, then the second ones row by row.
pub fn derivative(leaf: &Leaf, dim: usize) -> usize {
    match (leaf.axis, leaf.second) {
        (None, _) => 0,
        (Some(a), None) => 1 + a,
        (Some(a), Some(b)) => 1 + dim + a * dim + b,
    }
}

/// 0 for a function, 1 for a first derivative, 2 for a second one.
pub fn order(derivative: usize, dim: usize) -> usize {
    match derivative {
        0 => 0,
        k if k <= dim => 1,
        _ => 2,
    }
}

fn side(side: Side) -> usize {
    usize::from(side == Side::Minus)
}

impl Work {
    /// From an integral by rules on cells and facets, with its derivative, which may be left out.
    pub fn new(
        problem: &mut Problem,
        mesh: &Grid,
        source: &Mesh,
        integral: &Integral,
        rules: [Rule; 2],
        by: Bilinear,
    ) -> Self {
        let dim = mesh.dim;
        let domain = integral.measure.domain;
        let rule = problem.rule_of(&integral.measure, rules);
        let sides = if domain == Domain::Interior { 2 } else { 1 };
        let mut shapes: Vec<Shape> = Vec::new();
        let mut position = |shape: Shape| {
            let found = shapes.iter().position(|known| *known == shape);
            found.unwrap_or_else(|| {
                shapes.push(shape);
                shapes.len() - 1
            })
        };
        let mut blocks: Vec<Block> = Vec::new();
        let mut size = 0;
        for side in 0..sides {
            for (k, component) in problem.components() {
                let shape = Shape::of(problem.unknowns[k].space.element, mesh.shape);
                blocks.push(Block {
                    side,
                    unknown: k,
                    component,
                    shape: position(shape),
                    count: shape.count(dim),
                    start: size,
                });
                size += shape.count(dim);
            }
        }
        let find = |unknown: usize, leaf: &Leaf| {
            let is_it = |b: &Block| {
                (b.side, b.unknown, b.component) == (side(leaf.side), unknown, leaf.component)
            };
            blocks.iter().position(is_it).unwrap_or(0)
        };
        let mut vector = Vec::new();
        for (leaf, id) in &integral.terms {
            if let Field::Test(k) = leaf.field {
                vector.push((find(k, leaf), derivative(leaf, dim), inlined(problem, *id)));
            }
        }
        let mut matrix: BTreeMap<(usize, usize), Entries> = BTreeMap::new();
        for ((test, increment), id) in by {
            if let (Field::Test(k), Field::Increment(l)) = (test.field, increment.field) {
                let pair = (find(k, &test), find(l, &increment));
                let id = inlined(problem, id);
                let entry = (derivative(&test, dim), derivative(&increment, dim), id);
                matrix.entry(pair).or_default().push(entry);
            }
        }
        let roots: Vec<Id> = vector
            .iter()
            .map(|(.., id)| *id)
            .chain(matrix.values().flatten().map(|(.., id)| *id))
            .collect();
        let data_shape = |k: usize| {
            let space = problem.data[k].space;
            space.map(|space| Shape::of(space.element, mesh.shape))
        };
        let leaf_shape = |leaf: &Leaf| match leaf.field {
            Field::Datum(k) => data_shape(k).unwrap_or(Shape::nodal(mesh.shape, 1)),
            Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                Shape::of(problem.unknowns[k].space.element, mesh.shape)
            }
        };
        let is_curved = mesh.shape == Cells::Cubes;
        let varies = |node: Node| match node {
            Node::Coordinate(_) => true,
            Node::Normal(..) => is_curved,
            Node::Leaf(_) if is_curved => true,
            Node::Leaf(leaf) => order(derivative(&leaf, dim), dim) < leaf_shape(&leaf).degree(),
            _ => false,
        };
        let tape = Tape::new(&problem.scalars, &roots, rule.weights.len(), varies);
        let mut needed: Vec<Needed> = Vec::new();
        let mut data = BTreeMap::new();
        for (node, slot) in &tape.ends {
            let Node::Leaf(leaf) = node else { continue };
            let shape = leaf_shape(leaf);
            let given = match leaf.field {
                Field::Unknown(k) => Given::Block {
                    block: find(k, leaf),
                    is_old: false,
                },
                Field::Old(k) => Given::Block {
                    block: find(k, leaf),
                    is_old: true,
                },
                Field::Datum(datum) => {
                    data.entry(datum)
                        .or_insert_with(|| nodal(problem, datum, shape));
                    let (component, side) = (leaf.component, side(leaf.side));
                    Given::Datum {
                        datum,
                        component,
                        side,
                    }
                }
                _ => continue,
            };
            let derivative = (derivative(leaf, dim), *slot);
            match needed.iter_mut().find(|n| n.given == given) {
                Some(known) => known.derivatives.push(derivative),
                None => needed.push(Needed {
                    given,
                    shape: position(shape),
                    derivatives: vec![derivative],
                }),
            }
        }
        let slots = |pairs: Entries| -> Pairs {
            pairs
                .into_iter()
                .map(|(a, b, id)| (a, b, tape.slot(id)))
                .collect()
        };
        let matrix: Vec<_> = matrix
            .into_iter()
            .map(|((a, b), pairs)| (a, b, slots(pairs)))
            .collect();
        let vector: Vec<_> = vector
            .into_iter()
            .map(|(block, d, id)| (block, d, tape.slot(id)))
            .collect();
        let is_second = |d: usize| order(d, dim) == 2;
        let has_second = vector.iter().any(|(_, d, _)| is_second(*d))
            || matrix
                .iter()
                .any(|(_, _, pairs)| pairs.iter().any(|(a, b, _)| is_second(*a) || is_second(*b)))
            || needed
                .iter()
                .any(|n| n.derivatives.iter().any(|(d, _)| is_second(*d)));
        let points: Vec<Vec<f64>> = (0..rule.weights.len())
            .map(|q| rule.barycentric(q).to_vec())
            .collect();
        let mut work = Work {
            sides,
            domain,
            weights: rule.weights,
            entities: Vec::new(),
            placements: Vec::new(),
            shapes,
            blocks,
            size,
            tape,
            needed,
            data,
            vector,
            matrix,
            has_second,
            is_curved,
        };
        work.place(
            mesh,
            &facets_or_cells(problem, mesh, source, integral),
            &points,
        );
        work
    }

    /// Entities that are evaluated together: with one placement, as many as fit into the cache.
    pub fn batches<'a>(&self, entities: &'a [Entity]) -> impl Iterator<Item = &'a [Entity]> {
        let room = ROOM / (self.size * self.size).max(1);
        let most = (room / 8 * 8).clamp(8, MOST);
        let runs = entities.chunk_by(|a, b| a.places == b.places);
        runs.flat_map(move |run| run.chunks(most))
    }

    /// The unknowns of each side: the start of their functions, and the stride of components.
    pub fn wholes(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter(|block| block.component == 0)
    }

    /// Finds the cells of entities, and tabulates the basis functions at the points of each placement.
    fn place(&mut self, mesh: &Grid, entities: &[u32], points: &[Vec<f64>]) {
        let dim = mesh.dim;
        let mut known: BTreeMap<[u8; 4], u16> = BTreeMap::new();
        let (placements, shapes) = (&mut self.placements, &self.shapes);
        let mut place = |vertices: [u8; 4], facet: usize| {
            *known.entry(vertices).or_insert_with(|| {
                let at = |point: &Vec<f64>| {
                    let mut at = [0.0; 4];
                    for (value, vertex) in point.iter().zip(vertices) {
                        if vertex == u8::MAX {
                            continue;
                        }
                        let corner = mesh.shape.corner(vertex.into());
                        at.iter_mut()
                            .zip(corner)
                            .for_each(|(at, c)| *at += value * c);
                    }
                    at
                };
                let points: Vec<[f64; 4]> = points.iter().map(at).collect();
                let tables = shapes
                    .iter()
                    .map(|shape| shape.table(dim, &points))
                    .collect();
                placements.push(Placement {
                    facet,
                    points,
                    tables,
                });
                placements.len() as u16 - 1
            })
        };
        self.entities = entities
            .iter()
            .map(|entity| {
                if self.domain == Domain::Cells {
                    let at = place(mesh.shape.frame(), 0);
                    return Entity {
                        cells: [*entity; 2],
                        places: [at; 2],
                    };
                }
                let face = *entity as usize;
                let mut cells = mesh.face_cells(face);
                if self.sides == 1 {
                    cells[1] = cells[0];
                }
                let places = cells.map(|cell| {
                    let cell = cell as usize;
                    let mut vertices = [u8::MAX; 4];
                    for (place, vertex) in vertices.iter_mut().zip(mesh.face(face)).take(dim) {
                        let local = mesh.cell(cell).iter().position(|v| v == vertex);
                        *place = local.unwrap_or(0) as u8;
                    }
                    place(vertices, mesh.local_face(cell, face))
                });
                Entity { cells, places }
            })
            .collect();
        self.entities.sort_by_key(|entity| entity.places);
    }
}

/// An expression in which data that are evaluated at the points are replaced by their formulas.
fn inlined(problem: &mut Problem, id: Id) -> Id {
    let Problem { scalars, data, .. } = problem;
    scalars.map(id, &mut |scalars, node| {
        let Node::Leaf(leaf) = node else { return None };
        let Field::Datum(k) = leaf.field else {
            return None;
        };
        let datum = &data[k];
        if datum.space.is_some() {
            return None;
        }
        let mut found = datum.components[leaf.component];
        for axis in leaf.axis.into_iter().chain(leaf.second) {
            found = scalars.derivative(found, &mut |scalars, node| {
                scalars.number(f64::from(u8::from(node == Node::Coordinate(axis))))
            });
        }
        Some(found)
    })
}

fn nodal(problem: &Problem, datum: usize, shape: Shape) -> Nodal {
    let nodes = shape.nodes(problem.dim);
    let components = &problem.data[datum].components;
    let varies = |node: Node| matches!(node, Node::Coordinate(_));
    let tape = Tape::new(&problem.scalars, components, nodes.len(), varies);
    let components = components.iter().map(|id| tape.slot(*id)).collect();
    Nodal {
        nodes,
        tape,
        components,
    }
}

/// The cells or facets of a measure, ascending.
fn facets_or_cells(problem: &Problem, mesh: &Grid, source: &Mesh, integral: &Integral) -> Vec<u32> {
    let measure = &integral.measure;
    if measure.groups.is_empty() {
        let faces = 0..mesh.face_count() as u32;
        return match measure.domain {
            Domain::Cells => (0..mesh.cell_count() as u32).collect(),
            Domain::Boundary => faces.filter(|f| mesh.is_boundary(*f as usize)).collect(),
            Domain::Interior => faces.filter(|f| !mesh.is_boundary(*f as usize)).collect(),
        };
    }
    let of_groups = measure.groups.iter();
    let mut all: Vec<u32> = match measure.domain {
        Domain::Cells => {
            let [kind, _] = mesh.shape.kinds(mesh.dim);
            let numbers: Vec<u32> = source.cells_of(kind).map(|(cell, ..)| cell).collect();
            let cells = of_groups.flat_map(|k| source.groups[*k].cells.iter());
            cells
                .filter_map(|cell| Some(numbers.binary_search(cell).ok()? as u32))
                .collect()
        }
        _ => of_groups
            .flat_map(|k| facets(problem, mesh, source, *k))
            .collect(),
    };
    all.sort_unstable();
    all.dedup();
    all
}

/// The facets of a group, ascending.
pub fn facets(problem: &Problem, mesh: &Grid, source: &Mesh, group: usize) -> Vec<u32> {
    if problem.groups[group].dim + 1 != mesh.dim {
        return Vec::new();
    }
    let cells = source.groups[group]
        .cells
        .iter()
        .filter_map(|cell| source.cell(*cell));
    let found = cells.filter_map(|(_, nodes)| Some(mesh.find_face(nodes)? as u32));
    let mut all: Vec<u32> = found.collect();
    all.sort_unstable();
    all.dedup();
    all
}
