//! Images of problems: the same problem on a mesh that is numbered in another way, mirrored, turned or in other units, so that its solution has the same
//! components at the places that its own have.

use std::collections::BTreeMap;

use faceoff_mesh::mesh::{CellKind, Mesh};

use crate::problem::{Domain, Element, Integral, Problem};
use crate::random::shuffle;
use crate::scalar::{Field, Id, Leaf, Node, Scalars};

/// What an answer must move with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Image {
    /// Points, cells and the corners of cells in another order.
    Renumbered,
    /// The groups of each dimension have the numbers of each other.
    Regrouped,
    /// x to the other side.
    Mirrored,
    /// By 90 degrees from x to y.
    Turned,
    /// In units that are 1024 times smaller.
    Scaled,
}

/// How many new units the old one has: a power of two, so that nothing is rounded.
const UNITS: f64 = 1024.0;
/// Of the other order.
const SEED: u64 = 63;

impl Image {
    /// All of them.
    pub const ALL: [Image; 5] = [
        Image::Renumbered,
        Image::Regrouped,
        Image::Mirrored,
        Image::Turned,
        Image::Scaled,
    ];

    /// What is done, as a part of a sentence: `the mesh mirrored`.
    pub fn words(self) -> &'static str {
        match self {
            Image::Renumbered => "points and cells in another order",
            Image::Regrouped => "the numbers of groups exchanged",
            Image::Mirrored => "everything mirrored",
            Image::Turned => "everything turned by 90 degrees",
            Image::Scaled => "lengths in units 1024 times smaller",
        }
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Image::Renumbered => "renumbered",
            Image::Regrouped => "regrouped",
            Image::Mirrored => "mirrored",
            Image::Turned => "turned",
            Image::Scaled => "scaled",
        }
    }

    /// About a place, which stays where it is but for scaling.
    pub fn about(self, center: [f64; 3]) -> Motion {
        let mut turn = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        match self {
            Image::Mirrored => turn[0][0] = -1.0,
            Image::Turned => [turn[0], turn[1]] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]],
            Image::Renumbered | Image::Regrouped | Image::Scaled => {}
        }
        Motion {
            image: self,
            turn,
            factor: if self == Image::Scaled { UNITS } else { 1.0 },
            center,
        }
    }
}

/// The map x ↦ f Q (x - c) + c of an image, where f or c is trivial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// What it is.
    pub image: Image,
    /// Q.
    turn: [[f64; 3]; 3],
    /// f
    factor: f64,
    /// c
    center: [f64; 3],
}

impl Motion {
    /// Does no place change?
    pub fn is_still(&self) -> bool {
        matches!(self.image, Image::Renumbered | Image::Regrouped)
    }

    /// The mesh of the image, and the number that each of its points has in the original where that is another; none where cells would be turned over whose nodes have no known order.
    pub fn mesh(&self, mesh: &Mesh) -> Option<(Mesh, Vec<u32>)> {
        let mut mesh = mesh.clone();
        mesh.fields.clear();
        let mut numbers = Vec::new();
        match self.image {
            Image::Renumbered => {
                let new = shuffle(&mut mesh, SEED);
                numbers = vec![0; new.len()];
                for (old, new) in (0..).zip(new) {
                    numbers[new as usize] = old;
                }
            }
            Image::Regrouped => {
                let other = exchanged(
                    mesh.groups
                        .iter()
                        .map(|group| (group.dim.into(), group.tag)),
                );
                for group in &mut mesh.groups {
                    group.tag = other[&(group.dim.into(), group.tag)];
                }
                // As files have them.
                mesh.groups.sort_by_key(|group| (group.dim, group.tag));
            }
            Image::Mirrored | Image::Turned | Image::Scaled => {
                for point in mesh.points.to_mut() {
                    *point = self.to(*point);
                }
            }
        }
        match self.image {
            Image::Mirrored if !orient(&mut mesh) => None,
            _ => Some((mesh, numbers)),
        }
    }

    fn to(&self, x: [f64; 3]) -> [f64; 3] {
        let from: [f64; 3] = std::array::from_fn(|k| x[k] - self.center[k]);
        std::array::from_fn(|k| {
            let turned: f64 = (0..3).map(|j| self.turn[k][j] * from[j]).sum();
            self.factor * turned + self.center[k]
        })
    }

    /// The place whose image this is.
    pub fn back(&self, x: [f64; 3]) -> [f64; 3] {
        let from: [f64; 3] = std::array::from_fn(|k| (x[k] - self.center[k]) / self.factor);
        std::array::from_fn(|k| self.center[k] + self.unturned(from)[k])
    }

    /// The vector whose image this is.
    pub fn unturned(&self, of: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| (0..3).map(|j| self.turn[j][k] * of[j]).sum())
    }

    /// Do the components of vectors change?
    pub fn turns(&self) -> bool {
        matches!(self.image, Image::Mirrored | Image::Turned)
    }

    /// The image of a problem; none where it is not known: of eigenproblems, and of schemes that scripts have by hand.
    pub fn problem(&self, of: &Problem) -> Option<Problem> {
        if of.eigen.is_some() || of.parts.is_some() {
            return None;
        }
        let mut problem = of.clone();
        if self.image == Image::Regrouped {
            let other = exchanged(of.groups.iter().map(|group| (group.dim, group.tag)));
            for group in &mut problem.groups {
                group.tag = other[&(group.dim, group.tag)];
            }
            sort_groups(&mut problem);
        }
        if self.is_still() {
            return Some(problem);
        }
        let elements = Elements::of(of);
        let mut scalars = std::mem::take(&mut problem.scalars);
        problem.integrals = of
            .integrals
            .iter()
            .map(|integral| self.integral(&mut scalars, &elements, of.dim, integral))
            .collect();
        let mut change = |id| self.formula(&mut scalars, &elements, of.dim, id);
        for id in problem.data.iter_mut().flat_map(|d| &mut d.components) {
            *id = change(*id);
        }
        for condition in &mut problem.conditions {
            condition.value = change(condition.value);
        }
        if let Some(time) = &mut problem.time {
            time.initial
                .iter_mut()
                .for_each(|of| of.value = change(of.value));
        }
        problem.scalars = scalars;
        self.turn_values(&mut problem)?;
        Some(problem)
    }

    /// Turns Dirichlet values and initial values of functions that are vectors as a whole; none where a component is not there.
    fn turn_values(&self, problem: &mut Problem) -> Option<()> {
        let dim = problem.dim;
        let is_whole = |k: usize| problem.unknowns[k].space.element.is_vector();
        let mut values: Vec<(usize, usize, Option<usize>, Id)> = Vec::new();
        let conditions = problem.conditions.iter();
        values.extend(conditions.map(|of| (of.unknown, of.component, Some(of.group), of.value)));
        let initial = problem.time.iter().flat_map(|time| &time.initial);
        values.extend(initial.map(|of| (of.unknown, of.component, None, of.value)));
        let scalars = &mut problem.scalars;
        let mut turned = Vec::with_capacity(values.len());
        for (unknown, component, group, value) in &values {
            if !is_whole(*unknown) {
                turned.push(*value);
                continue;
            }
            let mut parts = Vec::new();
            for k in 0..dim {
                let is_it = |of: &&(usize, usize, Option<usize>, Id)| {
                    (of.0, of.1, of.2) == (*unknown, k, *group)
                };
                let (_, _, _, part) = values.iter().find(is_it)?;
                let weight = scalars.number(self.turn[*component][k]);
                parts.push(scalars.multiply(weight, *part));
            }
            turned.push(scalars.sum(parts));
        }
        let mut turned = turned.into_iter();
        let mut next = |value: &mut Id| *value = turned.next().unwrap_or(*value);
        problem
            .conditions
            .iter_mut()
            .for_each(|of| next(&mut of.value));
        let initial = problem.time.iter_mut().flat_map(|time| &mut time.initial);
        initial.for_each(|of| next(&mut of.value));
        Some(())
    }

    fn integral(
        &self,
        scalars: &mut Scalars,
        elements: &Elements,
        dim: usize,
        of: &Integral,
    ) -> Integral {
        let power = match of.measure.domain {
            Domain::Cells => dim,
            Domain::Boundary | Domain::Interior => dim - 1,
        };
        let measure = self.factor.powi(-(power as i32));
        let mut terms: BTreeMap<Leaf, Id> = BTreeMap::new();
        for (test, coefficient) in &of.terms {
            let coefficient = self.formula(scalars, elements, dim, *coefficient);
            for (leaf, weight) in self.leaf(elements, dim, *test) {
                let weight = scalars.number(weight * measure);
                let part = scalars.multiply(weight, coefficient);
                let sum = match terms.get(&leaf) {
                    Some(before) => scalars.add(*before, part),
                    None => part,
                };
                terms.insert(leaf, sum);
            }
        }
        Integral {
            terms,
            ..of.clone()
        }
    }

    /// A formula of the problem by what the image has.
    fn formula(&self, scalars: &mut Scalars, elements: &Elements, dim: usize, id: Id) -> Id {
        scalars.map(id, &mut |scalars, node| match node {
            Node::Coordinate(k) => {
                let center: [f64; 3] = std::array::from_fn(|j| -self.center[j] / self.factor);
                let start = self.center[k] + self.unturned(center)[k];
                let mut parts = vec![scalars.number(start)];
                for j in 0..dim {
                    let x = scalars.push(Node::Coordinate(j));
                    let weight = scalars.number(self.turn[j][k] / self.factor);
                    parts.push(scalars.multiply(weight, x));
                }
                Some(scalars.sum(parts))
            }
            Node::Normal(k, side) => {
                let mut parts = Vec::new();
                for j in 0..dim {
                    let n = scalars.push(Node::Normal(j, side));
                    let weight = scalars.number(self.turn[j][k]);
                    parts.push(scalars.multiply(weight, n));
                }
                Some(scalars.sum(parts))
            }
            Node::Length(..) => {
                let length = scalars.push(node);
                let weight = scalars.number(1.0 / self.factor);
                Some(scalars.multiply(weight, length))
            }
            Node::Leaf(leaf) => {
                let mut parts = Vec::new();
                for (leaf, weight) in self.leaf(elements, dim, leaf) {
                    let (weight, leaf) = (scalars.number(weight), scalars.leaf(leaf));
                    parts.push(scalars.multiply(weight, leaf));
                }
                Some(scalars.sum(parts))
            }
            _ => None,
        })
    }

    /// A component of a field, or of its gradient, as a sum of those of the image.
    fn leaf(&self, elements: &Elements, dim: usize, leaf: Leaf) -> Vec<(Leaf, f64)> {
        let mut all = vec![(leaf, 1.0)];
        let mut split = |each: &dyn Fn(Leaf, usize) -> Option<(Leaf, f64)>| {
            all = all
                .iter()
                .flat_map(|(leaf, weight)| {
                    let parts = (0..dim).filter_map(|k| each(*leaf, k));
                    parts
                        .map(|(part, by)| (part, by * weight))
                        .collect::<Vec<_>>()
                })
                .filter(|(_, weight)| *weight != 0.0)
                .collect();
        };
        if elements.is_vector(leaf.field) {
            split(&|leaf, component| {
                let weight = self.turn[component][leaf.component];
                Some((Leaf { component, ..leaf }, weight))
            });
        }
        if leaf.axis.is_some() {
            split(&|leaf, k| {
                let weight = self.factor * self.turn[k][leaf.axis?];
                let axis = Some(k);
                Some((Leaf { axis, ..leaf }, weight))
            });
        }
        if leaf.second.is_some() {
            split(&|leaf, k| {
                let weight = self.factor * self.turn[k][leaf.second?];
                let [axis, second] = [leaf.axis?.min(k), leaf.axis?.max(k)].map(Some);
                let leaf = Leaf {
                    axis,
                    second,
                    ..leaf
                };
                Some((leaf, weight))
            });
        }
        all
    }
}

/// Of unknowns and data.
struct Elements {
    unknowns: Vec<Element>,
    data: Vec<Option<Element>>,
}

impl Elements {
    fn of(problem: &Problem) -> Self {
        let data = problem.data.iter();
        Elements {
            unknowns: problem.unknowns.iter().map(|of| of.space.element).collect(),
            data: data.map(|of| of.space.map(|space| space.element)).collect(),
        }
    }

    fn is_vector(&self, field: Field) -> bool {
        let element = match field {
            Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                self.unknowns.get(k).copied()
            }
            Field::Datum(k) => self.data.get(k).copied().flatten(),
        };
        element.is_some_and(Element::is_vector)
    }
}

/// Groups in the order that those of the mesh have, and all that names them by their positions.
fn sort_groups(problem: &mut Problem) {
    let mut order: Vec<usize> = (0..problem.groups.len()).collect();
    order.sort_by_key(|k| (problem.groups[*k].dim, problem.groups[*k].tag));
    let mut places = vec![0; order.len()];
    for (new, old) in order.iter().enumerate() {
        places[*old] = new;
    }
    problem.groups = order.iter().map(|k| problem.groups[*k].clone()).collect();
    for groups in problem
        .integrals
        .iter_mut()
        .map(|of| &mut of.measure.groups)
    {
        groups.iter_mut().for_each(|k| *k = places[*k]);
        groups.sort_unstable();
    }
    for condition in &mut problem.conditions {
        condition.group = places[condition.group];
    }
}

/// The number that each group gets: of each dimension the first that of the last.
fn exchanged(groups: impl Iterator<Item = (usize, i64)>) -> BTreeMap<(usize, i64), i64> {
    let mut all: BTreeMap<usize, Vec<i64>> = BTreeMap::new();
    for (dim, tag) in groups {
        all.entry(dim).or_default().push(tag);
    }
    let mut other = BTreeMap::new();
    for (dim, mut tags) in all {
        tags.sort_unstable();
        tags.dedup();
        for (tag, new) in tags.iter().zip(tags.iter().rev()) {
            other.insert((dim, *tag), *new);
        }
    }
    other
}

/// Corners of cells the other way round, since a mirror turns them over; are all of known kinds?
fn orient(mesh: &mut Mesh) -> bool {
    for block in &mut mesh.blocks {
        let width = block.kind.points();
        let swaps: &[[usize; 2]] = match block.kind {
            CellKind::Triangle | CellKind::Tetrahedron => &[[1, 2]],
            CellKind::Quadrangle => &[[1, 3]],
            CellKind::Hexahedron => &[[1, 3], [5, 7]],
            _ if block.kind.dim() < 2 => &[],
            _ => return false,
        };
        for corners in block.nodes.to_mut().chunks_exact_mut(width) {
            swaps.iter().for_each(|[a, b]| corners.swap(*a, *b));
        }
    }
    true
}
