//! What a problem leaves open in its solution, found by projection in L² and taken away before results are compared: a
//! constant, a rigid motion, a gradient, a sign, a factor, a phase.
//!
//! Constants, rigid motions and gradients are linear spaces: each result loses its own part in them. Signs, factors and phases
//! turn the second result into the direction of the first. All of them on each connected part of the mesh.

use std::borrow::Cow;

use super::clip::{barycentric, measure};
use super::domain::{Domain, Piece};
use super::element::Element;
use super::function::Function;
use super::map::Local;
use super::norms::{combine, is_exact};
use super::overlay::{Common, overlay};
use super::project::conjugate_gradients;
use super::rule::Rule;
use super::small::{Linear, Moments, Products, Sum, domain, integrate};
use crate::On;
use crate::comparison::by_id;
use crate::open::{Over, UpTo};
use crate::parts::{Parts, number};
use crate::places;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ResultField, Results};

/// A function that is known everywhere: a component at a place.
pub(crate) type Known<'a> = &'a (dyn Fn(&[f64; 3], usize) -> f64 + Sync);

/// Beyond the degree of the field, this degree of a known function is integrated as well.
const SEEN: usize = 8;

/// One field of a result and the connected parts of its mesh.
pub(crate) struct Carried<'a> {
    side: &'a Results,
    pub on: On,
    pub field: &'a ResultField,
    near: f64,
    /// The part of each point, cell or corner.
    part: Vec<u32>,
    of_cell: Vec<u32>,
    parts: usize,
}

impl<'a> Carried<'a> {
    /// The field of this name; none where the result has none, several, or one of integers.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn find(side: &'a Results, name: &str) -> Result<Option<Self>> {
        let all = [
            (On::Points, &side.on_points),
            (On::Cells, &side.on_cells),
            (On::Corners, &side.on_corners),
        ];
        let named = all.into_iter().flat_map(|(on, fields)| {
            let named = fields.iter().filter(|f| f.name == name);
            named.map(move |field| (on, field))
        });
        let found: Vec<_> = named.collect();
        let [(on, field)] = found[..] else {
            return Ok(None);
        };
        if field.rest.is_some() || field.components == 0 {
            return Ok(None);
        }
        let near = places::tolerance(&side.points, &[])?;
        let numbers = by_id(side);
        let parts = Parts::new(side, &numbers, near)?;
        let at = |point: u32| parts.of(&[number(&numbers, point)]);
        let cells = 0..side.cell_count();
        let of_cell = cells.map(|cell| side.cell(cell).next().map_or(parts.count as u32, at));
        let of_cell: Vec<u32> = of_cell.collect();
        let part = match on {
            On::Points => (0..side.point_count() as u32).map(at).collect(),
            On::Cells => of_cell.clone(),
            _ => (0..side.cell_count())
                .flat_map(|cell| side.cell(cell).map(at))
                .collect(),
        };
        cancel::check()?;
        Ok(Some(Carried {
            side,
            on,
            field,
            near,
            part,
            of_cell,
            parts: parts.count + 1,
        }))
    }

    /// Where each value is; none where places are not known.
    fn places(&self) -> Result<Cow<'a, [[f64; 3]]>> {
        let side = self.side;
        Ok(match self.on {
            _ if side.points.is_empty() => Cow::default(),
            On::Points => Cow::from(&*side.points),
            On::Cells => side.centroids()?.into(),
            _ => {
                let cells = 0..side.cell_count();
                let corners = cells.flat_map(|cell| side.cell(cell));
                corners.map(|point| side.points[point as usize]).collect()
            }
        })
    }

    fn items(&self) -> Cow<'a, [u32]> {
        match &self.field.at {
            Some(at) => Cow::from(&**at),
            None => (0..self.field.len() as u32).collect(),
        }
    }

    /// The field less its part in a linear space, with what was taken from it on each part of the mesh; else why that cannot be.
    /// Where the same part of a known function is given, that is put in its place.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn without(
        &self,
        up_to: UpTo,
        instead: Option<&[Linear]>,
    ) -> Result<Result<(ResultField, Vec<Linear>), String>> {
        let (dim, n) = (self.dim(), self.field.components);
        if up_to == UpTo::Gradient {
            return self.without_gradient(&|_, _| 0.0);
        }
        let places = self.places()?;
        let why = self.not_displacement(&places);
        if let (UpTo::Rigid, Some(why)) = (up_to, why) {
            return Ok(Err(why));
        }
        let (moments, over) = self.moments(&places)?;
        let fits: Vec<Linear> = moments
            .iter()
            .map(|of| of.fit(up_to, dim, n, over))
            .collect();
        let mut values = self.field.values.to_vec();
        for (row, &item) in values.chunks_exact_mut(n).zip(&*self.items()) {
            cancel::check()?;
            let Some(part) = self.part.get(item as usize).map(|p| *p as usize) else {
                continue;
            };
            let place = places.get(item as usize).copied().unwrap_or_default();
            for (c, value) in row.iter_mut().enumerate() {
                let known = instead.and_then(|known| known.get(part));
                let known = known.map_or(0.0, |known| known.at(&place, c));
                *value -= fits[part].at(&place, c) - known;
            }
        }
        let field = ResultField {
            values: values.into(),
            ..self.field.clone()
        };
        Ok(Ok((field, fits)))
    }

    /// The dimension of its cells, or of the places of its values.
    fn dim(&self) -> usize {
        let heights = self.side.points.iter().map(|x| x[2]);
        let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
            [low.min(z), high.max(z)]
        });
        match self.side.dimensions().last() {
            Some(2) if high - low > self.near => 3,
            Some(dim @ 2..) => usize::from(*dim),
            _ => self.side.space,
        }
    }

    /// Why it cannot have a part that is a rigid motion.
    fn not_displacement(&self, places: &[[f64; 3]]) -> Option<String> {
        let (dim, n) = (self.dim(), self.field.components);
        if places.is_empty() {
            return Some("its places are not known, on which rigid motions depend".into());
        }
        if self.on == On::Cells {
            return Some(
                "it is constant on cells, and rigid motions are not: give values at points".into(),
            );
        }
        (n != dim && !(n == 3 && dim == 2))
            .then(|| format!("it has {n} components, and rigid motions in {dim}D have {dim}"))
    }

    /// Integrals of the field and of its products with x; sums over its values where it is not a function on cells.
    fn moments(&self, places: &[[f64; 3]]) -> Result<(Vec<Moments>, Over)> {
        let n = self.field.components;
        let new = Moments::new(n);
        let function = [Function::new(self.field, self.on)];
        let add = |of: &mut Moments, weight: f64, at: &[f64; 3], values: &[[f64; 4]]| {
            of.add(weight, at, values.iter().map(|v| v[0]));
        };
        if let Some(all) = self.integrals(&function, 2, &new, add)? {
            return Ok((all, Over::Cells));
        }
        let mut all = vec![new; self.parts];
        for (row, &item) in self.field.values.chunks_exact(n).zip(&*self.items()) {
            cancel::check()?;
            let place = places.get(item as usize).copied().unwrap_or_default();
            if let Some(part) = self.part.get(item as usize) {
                all[*part as usize].add(1.0, &place, row.iter().copied());
            }
        }
        Ok((all, Over::Values))
    }

    /// Sums over the quadrature points of the cells, one for each part of the mesh: of what `add` makes of the weight, the place and the
    /// values of functions, by a rule exact to the degree of the first and `more`. None without cells on which they are functions.
    fn integrals<T: Sum>(
        &self,
        functions: &[Function],
        more: usize,
        new: &T,
        add: impl Fn(&mut T, f64, &[f64; 3], &[[f64; 4]]) + Sync,
    ) -> Result<Option<Vec<T>>> {
        let Some(domain) = domain(self.side)? else {
            return Ok(None);
        };
        let degree = functions[0].degree(&domain) + more;
        let visit =
            |of: &mut Vec<T>, cell: u32, weight: f64, at: &[f64; 3], values: &[[f64; 4]]| {
                add(&mut of[self.part_of_cell(cell)], weight, at, values);
            };
        let block = || vec![new.clone(); self.parts];
        let mut all = block();
        for of in integrate(&domain, functions, degree, block, visit)? {
            all.iter_mut().zip(&of).for_each(|(all, of)| all.merge(of));
        }
        Ok(Some(all))
    }

    /// Less the gradient ∇φ with (∇φ, ∇ψ) = (v - w, ∇ψ) for all continuous ψ linear on each cell; w is a known function.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn without_gradient(
        &self,
        known: Known,
    ) -> Result<Result<(ResultField, Vec<Linear>), String>> {
        let refused = |why: &str| Ok(Err(why.to_owned()));
        let (side, n) = (self.side, self.field.components);
        let Some(domain) = domain(side)? else {
            return refused("it has no cells on which a gradient could be taken");
        };
        let dim = domain.dim;
        if domain.is_surface {
            return refused("gradients are not taken away on surfaces in space");
        }
        if !is_exact(&domain) || domain.elements.iter().any(Element::is_product) {
            return refused("gradients are taken away on straight triangles and tetrahedra only");
        }
        if n != dim && !(n == 3 && dim == 2) {
            return Ok(Err(format!(
                "it has {n} components, and gradients in {dim}D have {dim}"
            )));
        }
        // The cell of each value.
        let of_corners = || {
            (0..side.cell_count()).flat_map(|cell| side.cell(cell).map(move |p| (p, cell as u32)))
        };
        let cell_of: Vec<u32> = match self.on {
            On::Cells => (0..side.cell_count() as u32).collect(),
            On::Corners => of_corners().map(|(_, cell)| cell).collect(),
            _ => {
                let mut cell_of = vec![u32::MAX; side.point_count()];
                for (point, cell) in
                    of_corners().filter(|(_, cell)| domain.known_element(*cell).is_some())
                {
                    if std::mem::replace(&mut cell_of[point as usize], cell) != u32::MAX {
                        return refused(
                            "cells share its values, and gradients of linear functions jump: give the field on cells, or at the corners of each",
                        );
                    }
                }
                cell_of
            }
        };
        let vertex = places::numbers(&side.points, &[], self.near)?;
        let gradients =
            |piece: &Piece| barycentric(dim, &domain.simplex(piece, &domain.frame(piece)));
        let function = [Function::new(self.field, self.on)];
        let corner = |piece: &Piece, k: usize| vertex[piece.corners[k] as usize] as usize;
        let mut piece_of = vec![usize::MAX; side.cell_count()];
        domain
            .pieces
            .iter()
            .enumerate()
            .for_each(|(k, piece)| piece_of[piece.cell as usize] = k);
        let visit = |of: &mut Vec<(u32, [f64; 3])>,
                     cell: u32,
                     weight: f64,
                     at: &[f64; 3],
                     values: &[[f64; 4]]| {
            if of.last().is_none_or(|(last, _)| *last != cell) {
                of.push((cell, [0.0; 3]));
            }
            if let Some((_, sum)) = of.last_mut() {
                (0..dim).for_each(|c| sum[c] += weight * (values[c][0] - known(at, c)));
            }
        };
        // A formula is seen as in errors.
        let degree = function[0].degree(&domain) + SEEN;
        let blocks = integrate(&domain, &function, degree, Vec::new, visit)?;
        let count = vertex.iter().max().map_or(0, |last| *last as usize + 1);
        let (mut load, mut diagonal) = (vec![0.0; count], vec![0.0; count]);
        for (cell, sum) in blocks.into_iter().flatten() {
            let piece = &domain.pieces[piece_of[cell as usize]];
            for (k, gradient) in gradients(piece).iter().take(dim + 1).enumerate() {
                let square: f64 = (0..dim).map(|c| gradient[c] * gradient[c]).sum();
                load[corner(piece, k)] += (0..dim).map(|c| sum[c] * gradient[c]).sum::<f64>();
                diagonal[corner(piece, k)] += domain.piece_measure(piece) * square;
            }
        }
        let gradient_of = |piece: &Piece, phi: &[f64]| {
            let mut sum = [0.0; 3];
            for (k, gradient) in gradients(piece).iter().take(dim + 1).enumerate() {
                (0..dim).for_each(|c| sum[c] += phi[corner(piece, k)] * gradient[c]);
            }
            sum
        };
        let apply = |phi: &[f64]| {
            let mut out = vec![0.0; count];
            for piece in &domain.pieces {
                let of = gradient_of(piece, phi);
                let size = domain.piece_measure(piece);
                for (k, gradient) in gradients(piece).iter().take(dim + 1).enumerate() {
                    out[corner(piece, k)] +=
                        size * (0..dim).map(|c| of[c] * gradient[c]).sum::<f64>();
                }
            }
            out
        };
        let Some(phi) = conjugate_gradients(&load, &diagonal, apply) else {
            return refused("its gradient part was not found: the iteration does not converge");
        };
        cancel::check()?;
        let mut fits = vec![Linear::default(); self.parts];
        for piece in &domain.pieces {
            let of = gradient_of(piece, &phi);
            let fit = &mut fits[self.of_cell[piece.cell as usize] as usize];
            let size = domain.piece_measure(piece);
            fit.measure += size;
            fit.square += size * of.iter().map(|g| g * g).sum::<f64>();
            let centre = side.centroid(piece.cell as usize).unwrap_or_default();
            (0..3).for_each(|k| fit.about[k] += size * centre[k]);
        }
        for fit in fits.iter_mut().filter(|fit| fit.measure > 0.0) {
            (0..3).for_each(|k| fit.about[k] /= fit.measure);
            fit.told = vec![(fit.square / fit.measure).sqrt()];
        }
        let mut values = self.field.values.to_vec();
        for (row, &item) in values.chunks_exact_mut(n).zip(&*self.items()) {
            let cell = cell_of.get(item as usize).copied().unwrap_or(u32::MAX);
            let Some(&piece) = piece_of
                .get(cell as usize)
                .filter(|piece| **piece != usize::MAX)
            else {
                continue;
            };
            let of = gradient_of(&domain.pieces[piece], &phi);
            row.iter_mut().zip(of).for_each(|(value, of)| *value -= of);
        }
        let field = ResultField {
            values: values.into(),
            ..self.field.clone()
        };
        Ok(Ok((field, fits)))
    }

    /// The field times a factor on each part of the mesh: complex where that has an imaginary part.
    pub fn times(&self, factors: &[[f64; 2]]) -> ResultField {
        let n = self.field.components;
        let mut values = self.field.values.to_vec();
        for (row, &item) in values.chunks_exact_mut(n).zip(&*self.items()) {
            let part = self.part.get(item as usize).copied().unwrap_or(0);
            let [re, im] = factors.get(part as usize).copied().unwrap_or([1.0, 0.0]);
            if im == 0.0 {
                row.iter_mut().for_each(|value| *value *= re);
                continue;
            }
            for pair in row.chunks_exact_mut(2) {
                let [x, y] = [pair[0], pair[1]];
                pair.copy_from_slice(&[re * x - im * y, re * y + im * x]);
            }
        }
        ResultField {
            values: values.into(),
            ..self.field.clone()
        }
    }

    /// The products of this field, a, with a less a difference, on each part of the mesh; the difference has a row for each item
    /// that carries it.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn products(&self, on: On, difference: &ResultField) -> Result<(Vec<Products>, Over)> {
        let n = self.field.components;
        let functions = [
            Function::new(self.field, self.on),
            Function::new(difference, on),
        ];
        let new = Products::default();
        let more = domain(self.side)?.map_or(0, |domain| functions[0].degree(&domain));
        let add = |of: &mut Products, weight: f64, _: &[f64; 3], values: &[[f64; 4]]| {
            let (a, d) = values.split_at(n);
            of.add(weight, a.iter().zip(d).map(|(a, d)| [a[0], a[0] - d[0]]));
        };
        if let Some(all) = self.integrals(&functions, more, &new, add)? {
            return Ok((all, Over::Cells));
        }
        let mut all = vec![new; self.parts];
        for (row, &item) in self.field.values.chunks_exact(n).zip(&*self.items()) {
            let start = item as usize * n;
            let other = difference.values.get(start..start + n);
            if let (Some(part), Some(other)) = (self.part.get(item as usize), other) {
                all[*part as usize].add(1.0, row.iter().zip(other).map(|(a, d)| [*a, a - d]));
            }
        }
        Ok((all, Over::Values))
    }

    /// The products with a field on other cells, on each part of this mesh.
    pub fn products_over(
        &self,
        other: &Carried,
        near: f64,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Vec<Products>> {
        let domains = [
            &Domain::new(self.side, near)?,
            &Domain::new(other.side, near)?,
        ];
        let functions = [self, other].map(|of| [Function::new(of.field, of.on)]);
        let degree: usize = (0..2).map(|k| functions[k][0].degree(domains[k])).sum();
        let more = if domains.iter().all(|d| is_exact(d)) {
            0
        } else {
            4
        };
        let dim = domains[0].dim;
        let rule = Rule::new(dim, degree + more);
        let new = || vec![Products::default(); self.parts];
        let state = || ([0, 1].map(|k| Local::new(domains[k], &functions[k])), new());
        let visit = |(sides, products): &mut ([Local; 2], Vec<Products>), common: &Common| {
            let cells = common.pieces.map(|piece| piece.cell);
            sides
                .iter_mut()
                .zip(cells)
                .for_each(|(side, cell)| side.turn_to(cell, &common.frame));
            for simplex in common.simplices {
                let size = measure(dim, simplex);
                for (lambda, weight) in &rule.points {
                    let place = combine(simplex, lambda);
                    sides.iter_mut().for_each(|side| side.evaluate(&place));
                    let [a, b] = &*sides;
                    let pairs = a.values.iter().zip(&b.values).map(|(a, b)| [a[0], b[0]]);
                    products[self.of_cell[cells[0] as usize] as usize].add(weight * size, pairs);
                }
            }
        };
        let mut all = new();
        let merge = |(_, of): ([Local; 2], Vec<Products>)| {
            all.iter_mut().zip(&of).for_each(|(all, of)| all.merge(of));
        };
        overlay(domains, state, visit, merge, progress)?;
        Ok(all)
    }

    /// Its means, with the centre and the measure of each part of the mesh.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn means(&self) -> Result<Vec<Linear>> {
        let (moments, over) = self.moments(&self.places()?)?;
        let (dim, n) = (self.dim(), self.field.components);
        Ok(moments
            .iter()
            .map(|of| of.fit(UpTo::Constant, dim, n, over))
            .collect())
    }

    /// What a known function has in a linear space, on each part of the mesh.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn of_known(&self, up_to: UpTo, known: Known) -> Result<Vec<Linear>> {
        let n = self.field.components;
        let function = [Function::new(self.field, self.on)];
        let add = |of: &mut Moments, weight: f64, at: &[f64; 3], _: &[[f64; 4]]| {
            of.add(weight, at, (0..n).map(|c| known(at, c)));
        };
        let all = self.integrals(&function, SEEN, &Moments::new(n), add)?;
        let dim = self.dim();
        let fit = |of: &Moments| of.fit(up_to, dim, n, Over::Cells);
        Ok(all.iter().flatten().map(fit).collect())
    }

    /// The products of a known function, as the first, with this field.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn products_with(&self, known: Known) -> Result<Vec<Products>> {
        let function = [Function::new(self.field, self.on)];
        let add = |of: &mut Products, weight: f64, at: &[f64; 3], values: &[[f64; 4]]| {
            let pairs = values.iter().enumerate();
            of.add(weight, pairs.map(|(c, v)| [known(at, c), v[0]]));
        };
        let all = self.integrals(&function, SEEN, &Products::default(), add)?;
        Ok(all.unwrap_or_default())
    }

    /// The part of the mesh that a cell belongs to.
    pub fn part_of_cell(&self, cell: u32) -> usize {
        self.of_cell
            .get(cell as usize)
            .map_or(0, |part| *part as usize)
    }
}
