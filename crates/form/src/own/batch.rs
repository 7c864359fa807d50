//! Evaluates the integrals of a batch of cells or facets: geometry, fields at the points, operations, and sums over the points.

use std::collections::HashMap;
use std::ops::Range;

use faceoff_mesh::mesh::CellGeometry;

use super::dofs::{Dofs, sign};
use super::element::{Table, carriers, vectors};
use super::tape::{Memory, Slot};
use super::work::{Block, Entity, Given, Work, order};
use crate::grid::{Cells, Grid, Map};
use crate::problem::{Domain, Problem};
use crate::scalar::{Length, Node, Side};

/// The arguments of the integrals.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// The dofs.
    pub u: &'a [f64],
    /// Those of the previous step; empty if there is none.
    pub old: &'a [f64],
    /// The values of the parameters.
    pub parameters: &'a [f64],
}

/// Memory of a batch, reused for the next one.
#[derive(Debug, Default)]
pub struct Scratch {
    /// For each side and cell: the vertices, and the longest distance between two of them.
    vertices: Vec<[[f64; 3]; 8]>,
    diameter: Vec<f64>,
    /// For simplices.
    geometry: Vec<CellGeometry>,
    /// The measure of the cell or facet, at each point if the map is not affine.
    measure: Vec<f64>,
    /// The normal of the first side, at (point, a).
    normal: Vec<f64>,
    /// ∂_a ξ_j at (point, side, j, a).
    slopes: Vec<f64>,
    /// Products of two of them, at (side, a, b, j, l).
    bends: Vec<f64>,
    tape: Memory,
    nodal: Memory,
    local: Vec<f64>,
    reference: Vec<f64>,
    sums: Vec<f64>,
    /// The sums for test functions, and for pairs of test functions and increments, by blocks and then, if there are functions of vectors as a whole, by
    /// dofs.
    pub vector: Vec<f64>,
    pub matrix: Vec<f64>,
    spare: Vec<f64>,
    /// Integrals of products of basis functions of the integral that is evaluated, by blocks, orders and placements.
    pub products: HashMap<[u16; 5], Vec<(usize, usize, f64)>>,
}

/// A batch: entities with one placement.
pub struct Batch<'a> {
    pub problem: &'a Problem,
    pub mesh: &'a Grid,
    pub dofs: &'a Dofs,
    pub work: &'a Work,
    pub entities: &'a [Entity],
}

impl Batch<'_> {
    /// Evaluates the integral and, if requested, its derivative.
    pub fn run(&self, state: State, scratch: &mut Scratch, is_matrix: bool) {
        self.geometry(scratch);
        let work = self.work;
        work.tape.prepare(&mut scratch.tape, self.entities.len());
        self.ends(state, scratch);
        for needed in 0..work.needed.len() {
            self.field(state, scratch, needed);
        }
        work.tape.run(&mut scratch.tape);
        self.vector(scratch);
        if is_matrix {
            self.matrix(scratch);
        }
        if self
            .problem
            .unknowns
            .iter()
            .any(|u| u.space.element.is_vector())
        {
            self.whole(scratch, is_matrix);
        }
    }

    /// The points at which geometry is needed: all if the map of the reference cell is not affine, or one.
    fn geometry_points(&self) -> usize {
        match self.work.is_curved {
            true => self.work.weights.len(),
            false => 1,
        }
    }

    fn geometry(&self, s: &mut Scratch) {
        let (dim, n) = (self.mesh.dim, self.entities.len());
        s.vertices.clear();
        for side in 0..self.work.sides {
            let cells = self.entities.iter().map(|e| e.cells[side] as usize);
            s.vertices
                .extend(cells.map(|cell| self.mesh.vertices(cell)));
        }
        s.diameter.clear();
        s.geometry.clear();
        s.measure.clear();
        s.normal.clear();
        s.slopes.clear();
        s.bends.clear();
        if self.mesh.shape == Cells::Cubes {
            let diameters = s.vertices.iter().map(|v| self.mesh.diameter(v));
            s.diameter.extend(diameters);
            (0..self.geometry_points()).for_each(|q| self.geometry_at(s, q));
            return;
        }
        let all = s.vertices.iter().map(|v| CellGeometry::new(dim, &v[..4]));
        s.geometry.extend(all);
        s.diameter.extend(s.geometry.iter().map(|g| g.diameter));
        let facet = self.work.placements[usize::from(self.entities[0].places[0])].facet;
        let is_cells = self.work.domain == Domain::Cells;
        s.measure
            .extend(s.geometry[..n].iter().map(|g| match is_cells {
                true => g.measure(),
                false => g.face_measure(facet),
            }));
        if !is_cells {
            for a in 0..dim {
                s.normal
                    .extend(s.geometry[..n].iter().map(|g| g.normal(facet)[a]));
            }
        }
        for side in s.geometry.chunks_exact(n) {
            for j in 1..=dim {
                for a in 0..dim {
                    s.slopes.extend(side.iter().map(|g| g.gradients[j][a]));
                }
            }
        }
        if self.work.has_second {
            for side in s.geometry.chunks_exact(n) {
                for (a, b) in pairs(dim) {
                    for (j, l) in pairs(dim) {
                        s.bends.extend(
                            side.iter()
                                .map(|g| g.gradients[j + 1][a] * g.gradients[l + 1][b]),
                        );
                    }
                }
            }
        }
    }

    /// The geometry of quadrangles or hexahedra at a point.
    fn geometry_at(&self, s: &mut Scratch, q: usize) {
        let (dim, n) = (self.mesh.dim, self.entities.len());
        for (side, vertices) in s.vertices.chunks_exact(n).enumerate() {
            let place = usize::from(self.entities[0].places[side]);
            let placement = &self.work.placements[place];
            let map = |v| self.mesh.map(v, &placement.points[q]);
            let maps: Vec<Map> = vertices.iter().map(map).collect();
            if side == 0 {
                let is_cells = self.work.domain == Domain::Cells;
                s.measure.extend(maps.iter().map(|map| match is_cells {
                    true => map.measure,
                    false => map.face_measure(placement.facet),
                }));
                for a in 0..if is_cells { 0 } else { dim } {
                    s.normal
                        .extend(maps.iter().map(|map| map.normal(placement.facet)[a]));
                }
            }
            for j in 0..dim {
                for a in 0..dim {
                    s.slopes.extend(maps.iter().map(|map| map.slopes[j][a]));
                }
            }
        }
    }

    fn ends(&self, state: State, s: &mut Scratch) {
        let (dim, n) = (self.mesh.dim, self.entities.len());
        let placement = &self.work.placements[usize::from(self.entities[0].places[0])];
        for (node, slot) in &self.work.tape.ends {
            let mut fill = |of: &dyn Fn(usize) -> f64| {
                let row = s.tape.row_mut(*slot, 0);
                row.iter_mut()
                    .enumerate()
                    .for_each(|(c, value)| *value = of(c));
            };
            let of_side = |side: Side| if side == Side::Minus { n } else { 0 };
            match *node {
                Node::Number(bits) => fill(&|_| f64::from_bits(bits)),
                Node::Pi => fill(&|_| std::f64::consts::PI),
                Node::Parameter(k) => fill(&|_| state.parameters[k]),
                Node::Normal(axis, side) => {
                    let sign = if side == Side::Minus { -1.0 } else { 1.0 };
                    for q in 0..self.geometry_points() {
                        let at = (q * dim + axis) * n;
                        let out = s.tape.row_mut(*slot, q).iter_mut();
                        out.zip(&s.normal[at..])
                            .for_each(|(out, x)| *out = sign * x);
                    }
                }
                Node::Length(Length::Diameter, side) => fill(&|c| s.diameter[of_side(side) + c]),
                Node::Length(Length::Facet, _) if self.mesh.shape == Cells::Cubes => {
                    let of = |v| self.mesh.facet_length(v, placement.facet);
                    fill(&|c| of(&s.vertices[c]));
                }
                Node::Length(length, side) => {
                    let facet = (self.work.domain != Domain::Cells).then_some(placement.facet);
                    // The facet is shared by both cells; its number is that in the first.
                    let from = match (length, facet) {
                        (Length::Facet, Some(_)) => 0,
                        _ => of_side(side),
                    };
                    let cell = |c: usize| s.geometry.get(from + c);
                    fill(&|c| cell(c).map_or(f64::NAN, |cell| length.of(cell, facet)));
                }
                Node::Coordinate(axis) => {
                    for (q, at) in placement.points.iter().enumerate() {
                        self.coordinate(s.tape.row_mut(*slot, q), &s.vertices[..n], at, axis);
                    }
                }
                _ => {}
            }
        }
    }

    /// The values of a field and its derivatives at the points.
    fn field(&self, state: State, s: &mut Scratch, k: usize) {
        let (dim, n, work) = (self.mesh.dim, self.entities.len(), self.work);
        let needed = &work.needed[k];
        let side = match needed.given {
            Given::Block { block, .. } => work.blocks[block].side,
            Given::Datum { side, .. } => side,
        };
        let placement = &work.placements[usize::from(self.entities[0].places[side])];
        let table = &placement.tables[needed.shape];
        let count = table.count;
        s.local.clear();
        match needed.given {
            Given::Block { block, is_old } => {
                let block = work.blocks[block];
                let values = if is_old { state.old } else { state.u };
                s.local.resize(count * n, 0.0);
                let element = self.problem.unknowns[block.unknown].space.element;
                for (c, entity) in self.entities.iter().enumerate() {
                    let cell = entity.cells[side] as usize;
                    let nodes = self.dofs.of_cell(block.unknown, cell);
                    if !element.is_vector() {
                        for (i, node) in nodes.iter().enumerate() {
                            let dof = self.dofs.first[*node as usize] as usize + block.component;
                            s.local[i * n + c] = values[dof];
                        }
                        continue;
                    }
                    for (carrier, node) in carriers(element, dim).into_iter().zip(nodes) {
                        let geometry = &s.geometry[side * n + c];
                        let value = values[self.dofs.first[*node as usize] as usize]
                            * sign(self.mesh, cell, carrier);
                        for (j, vector) in vectors(element, geometry, carrier)
                            .iter()
                            .enumerate()
                            .take(count)
                        {
                            s.local[j * n + c] += value * vector[block.component];
                        }
                    }
                }
            }
            Given::Datum {
                datum, component, ..
            } => {
                let nodal = &work.data[&datum];
                nodal.tape.prepare(&mut s.nodal, n);
                for (node, slot) in &nodal.tape.ends {
                    let value = match *node {
                        Node::Number(bits) => f64::from_bits(bits),
                        Node::Pi => std::f64::consts::PI,
                        Node::Parameter(k) => state.parameters[k],
                        Node::Coordinate(axis) => {
                            for (q, at) in nodal.nodes.iter().enumerate() {
                                let cells = &s.vertices[side * n..(side + 1) * n];
                                self.coordinate(s.nodal.row_mut(*slot, q), cells, at, axis);
                            }
                            continue;
                        }
                        _ => f64::NAN,
                    };
                    s.nodal.row_mut(*slot, 0).fill(value);
                }
                nodal.tape.run(&mut s.nodal);
                for i in 0..count {
                    s.local
                        .extend_from_slice(s.nodal.row(nodal.components[component], i));
                }
            }
        }
        for (derivative, slot) in &needed.derivatives {
            let points = if slot.varies {
                placement.points.len()
            } else {
                1
            };
            let order = order(*derivative, dim);
            for q in 0..points {
                s.tape.row_mut(*slot, q).fill(0.0);
                for r in references(order, dim) {
                    s.reference.clear();
                    s.reference.resize(n, 0.0);
                    for (i, phi) in table
                        .row(r, q)
                        .iter()
                        .enumerate()
                        .filter(|(_, phi)| **phi != 0.0)
                    {
                        add_to(&mut s.reference, *phi, &s.local[i * n..(i + 1) * n]);
                    }
                    let out = s.tape.row_mut(*slot, q);
                    match self.factor(&s.slopes, &s.bends, q, side, *derivative, r) {
                        None => out.copy_from_slice(&s.reference),
                        Some(factor) => multiply_to(out, factor, &s.reference),
                    }
                }
            }
        }
    }

    fn vector(&self, s: &mut Scratch) {
        let (dim, n, work) = (self.mesh.dim, self.entities.len(), self.work);
        s.vector.clear();
        s.vector.resize(work.size * n, 0.0);
        for (k, block) in work.blocks.iter().enumerate() {
            let placement = &work.placements[usize::from(self.entities[0].places[block.side])];
            let table = &placement.tables[block.shape];
            for (_, derivative, slot) in work.vector.iter().filter(|(b, ..)| *b == k) {
                let varies = slot.varies || work.is_curved;
                let points = if varies { work.weights.len() } else { 1 };
                for r in references(order(*derivative, dim), dim) {
                    for q in 0..points {
                        let factor =
                            self.factor(&s.slopes, &s.bends, q, block.side, *derivative, r);
                        s.sums.clear();
                        s.sums.extend_from_slice(self.measure(&s.measure, q));
                        scale(&mut s.sums, s.tape.row(*slot, q));
                        if let Some(factor) = factor {
                            scale(&mut s.sums, factor);
                        }
                        for i in 0..block.count {
                            let weight = match varies {
                                true => work.weights[q] * table.row(r, q)[i],
                                false => (0..work.weights.len())
                                    .map(|q| work.weights[q] * table.row(r, q)[i])
                                    .sum(),
                            };
                            if weight != 0.0 {
                                let at = (block.start + i) * n;
                                add_to(&mut s.vector[at..at + n], weight, &s.sums);
                            }
                        }
                    }
                }
            }
        }
    }

    fn matrix(&self, s: &mut Scratch) {
        let (dim, n, work) = (self.mesh.dim, self.entities.len(), self.work);
        s.matrix.clear();
        s.matrix.resize(work.size * work.size * n, 0.0);
        for (pair, (a, b, pairs)) in work.matrix.iter().enumerate() {
            let [a, b] = [&work.blocks[*a], &work.blocks[*b]];
            let table = |block: &Block| {
                let place = self.entities[0].places[block.side];
                &work.placements[usize::from(place)].tables[block.shape]
            };
            let (left, right) = (table(a), table(b));
            let orders = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            for (of_a, of_b) in orders {
                for varies in [false, true] {
                    let own = || {
                        let is_own = |(x, y, slot): &&(usize, usize, Slot)| {
                            (order(*x, dim), order(*y, dim)) == (of_a, of_b)
                                && (slot.varies || work.is_curved) == varies
                        };
                        pairs.iter().filter(is_own)
                    };
                    if own().next().is_none() {
                        continue;
                    }
                    let points = if varies { work.weights.len() } else { 1 };
                    let [rs, ss] = [of_a, of_b].map(|order| references(order, dim));
                    for q in 0..points {
                        // The coefficients of pairs of derivatives by reference coordinates.
                        s.sums.clear();
                        s.sums.resize(rs.len() * ss.len() * n, 0.0);
                        for (x, y, slot) in own() {
                            let coefficient = s.tape.row(*slot, q);
                            for (k, r) in rs.clone().enumerate() {
                                s.reference.clear();
                                s.reference.extend_from_slice(coefficient);
                                scale(&mut s.reference, self.measure(&s.measure, q));
                                if let Some(factor) =
                                    self.factor(&s.slopes, &s.bends, q, a.side, *x, r)
                                {
                                    scale(&mut s.reference, factor);
                                }
                                for (l, t) in ss.clone().enumerate() {
                                    let at = (k * ss.len() + l) * n;
                                    let out = &mut s.sums[at..at + n];
                                    match self.factor(&s.slopes, &s.bends, q, b.side, *y, t) {
                                        None => add_to(out, 1.0, &s.reference),
                                        Some(factor) => multiply_to(out, factor, &s.reference),
                                    }
                                }
                            }
                        }
                        match varies {
                            true => {
                                let weight = work.weights[q];
                                for (k, r) in rs.clone().enumerate() {
                                    // First along the increments, then along the test functions.
                                    for j in 0..b.count {
                                        s.spare.clear();
                                        s.spare.resize(n, 0.0);
                                        for (l, t) in ss.clone().enumerate() {
                                            let phi = right.row(t, q)[j];
                                            if phi != 0.0 {
                                                let at = (k * ss.len() + l) * n;
                                                add_to(&mut s.spare, phi, &s.sums[at..at + n]);
                                            }
                                        }
                                        for i in 0..a.count {
                                            let phi = weight * left.row(r, q)[i];
                                            if phi != 0.0 {
                                                let at =
                                                    ((a.start + i) * work.size + b.start + j) * n;
                                                add_to(&mut s.matrix[at..at + n], phi, &s.spare);
                                            }
                                        }
                                    }
                                }
                            }
                            false => {
                                let places = self.entities[0].places;
                                let key =
                                    [pair as u16, of_a as u16, of_b as u16, places[0], places[1]];
                                let products = s.products.entry(key).or_insert_with(|| {
                                    self.products([a, b], [left, right], [&rs, &ss])
                                });
                                for (at, from, weight) in &*products {
                                    let sums = &s.sums[from * n..(from + 1) * n];
                                    add_to(&mut s.matrix[at * n..(at + 1) * n], *weight, sums);
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// The nonzero integrals of products of derivatives of basis functions by reference coordinates, relative to the measure: their positions in
    /// the matrix and among the coefficients.
    fn products(
        &self,
        [a, b]: [&Block; 2],
        [left, right]: [&Table; 2],
        [rs, ss]: [&Range<usize>; 2],
    ) -> Vec<(usize, usize, f64)> {
        let mut all = Vec::new();
        for i in 0..a.count {
            for j in 0..b.count {
                let at = (a.start + i) * self.work.size + b.start + j;
                for (k, r) in rs.clone().enumerate() {
                    for (l, t) in ss.clone().enumerate() {
                        let points = self.work.weights.iter().enumerate();
                        let products =
                            points.map(|(q, w)| w * left.row(r, q)[i] * right.row(t, q)[j]);
                        let weight: f64 = products.sum();
                        if weight.abs() > ROUNDING {
                            all.push((at, k * ss.len() + l, weight));
                        }
                    }
                }
            }
        }
        all
    }

    /// Transforms from the linear functions of components to basis functions of vectors as a whole, which replace them.
    fn whole(&self, s: &mut Scratch, is_matrix: bool) {
        let (dim, n, size) = (self.mesh.dim, self.entities.len(), self.work.size);
        for block in self.work.blocks.iter().filter(|block| block.component == 0) {
            let element = self.problem.unknowns[block.unknown].space.element;
            if !element.is_vector() {
                continue;
            }
            let all = carriers(element, dim);
            let local = dim * (dim + 1);
            for (c, entity) in self.entities.iter().enumerate() {
                let cell = entity.cells[block.side] as usize;
                let geometry = &s.geometry[block.side * n + c];
                let basis: Vec<Vec<f64>> = all
                    .iter()
                    .map(|carrier| {
                        let sign = sign(self.mesh, cell, *carrier);
                        let vectors = vectors(element, geometry, *carrier);
                        let each = (0..dim).flat_map(|a| (0..=dim).map(move |j| (a, j)));
                        each.map(|(a, j)| sign * vectors[j][a]).collect()
                    })
                    .collect();
                let apply = |values: &mut [f64], at: &dyn Fn(usize) -> usize| {
                    let before: Vec<f64> = (0..local).map(|k| values[at(k)]).collect();
                    for k in 0..local {
                        values[at(k)] = match basis.get(k) {
                            Some(function) => {
                                function.iter().zip(&before).map(|(f, v)| f * v).sum()
                            }
                            None => 0.0,
                        };
                    }
                };
                apply(&mut s.vector, &|k| (block.start + k) * n + c);
                if is_matrix {
                    for other in 0..size {
                        apply(&mut s.matrix, &|k| {
                            ((block.start + k) * size + other) * n + c
                        });
                    }
                    for other in 0..size {
                        apply(&mut s.matrix, &|k| (other * size + block.start + k) * n + c);
                    }
                }
            }
        }
    }

    /// The contribution of a derivative by reference coordinates to one by coordinates at a point; 1 for the function itself.
    fn factor<'a>(
        &self,
        slopes: &'a [f64],
        bends: &'a [f64],
        q: usize,
        side: usize,
        derivative: usize,
        reference: usize,
    ) -> Option<&'a [f64]> {
        let (dim, n) = (self.mesh.dim, self.entities.len());
        let square = dim * dim;
        let (values, at) = match order(derivative, dim) {
            0 => return None,
            1 => {
                let point = if self.work.is_curved { q } else { 0 };
                let place = (reference - 1) * dim + derivative - 1;
                (slopes, (point * self.work.sides + side) * square + place)
            }
            _ => (
                bends,
                (side * square + derivative - 1 - dim) * square + reference - 1 - dim,
            ),
        };
        Some(&values[at * n..(at + 1) * n])
    }

    /// The measures of the cells or facets at a point.
    fn measure<'a>(&self, all: &'a [f64], q: usize) -> &'a [f64] {
        let n = self.entities.len();
        let at = if self.work.is_curved { q * n } else { 0 };
        &all[at..at + n]
    }

    /// A coordinate of a position in each cell.
    fn coordinate(&self, out: &mut [f64], cells: &[[[f64; 3]; 8]], at: &[f64; 4], axis: usize) {
        let parts = self.mesh.shape.parts(self.mesh.dim, at);
        for (out, cell) in out.iter_mut().zip(cells) {
            let all = parts.iter().zip(cell).filter(|(part, _)| **part != 0.0);
            *out = all.map(|(part, x)| part * x[axis]).sum();
        }
    }
}

/// Integrals of products of basis functions that are smaller than this are 0.
const ROUNDING: f64 = 1e-16;

fn pairs(dim: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..dim).flat_map(move |a| (0..dim).map(move |b| (a, b)))
}

/// The derivatives by reference coordinates of an order.
fn references(order: usize, dim: usize) -> Range<usize> {
    match order {
        0 => 0..1,
        1 => 1..1 + dim,
        _ => 1 + dim..1 + dim + dim * dim,
    }
}

#[inline]
fn add_to(out: &mut [f64], factor: f64, values: &[f64]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += factor * value;
    }
}

#[inline]
fn multiply_to(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out += a * b;
    }
}

#[inline]
fn scale(out: &mut [f64], by: &[f64]) {
    for (out, by) in out.iter_mut().zip(by) {
        *out *= by;
    }
}
