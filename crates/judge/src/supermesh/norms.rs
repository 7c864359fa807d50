//! ‖a - b‖ of every field on the supermesh: L², the broken H¹ seminorm, and the maximum with its place.

use std::collections::HashMap;

use super::clip::{Simplex, measure};
use super::domain::{BLOCK, Domain, Piece};
use super::function::Function;
use super::geometry::Geometry;
use super::map::Local;
use super::overlay::{Common, Cover, overlay};
use super::rule::Rule;
use crate::keyed::fields_on;
use crate::{Differences, Norms, On};
use faceoff_mesh::error::Result;
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::parallel;

/// Where two fields differ most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub cells: [u32; 2],
    pub at: [f64; 3],
    pub values: [f64; 2],
    /// Of a field with several.
    pub component: Option<usize>,
}

/// Sums over a part of the supermesh, for one field.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    /// Squares of a - b, a and b, integrated.
    l2: [f64; 3],
    h1: [f64; 3],
    /// Those of L² by the coarser rule, where integrals are not exact.
    coarse: [f64; 3],
    /// Of a and b on parts that only rounding of the coordinates may have made, which are left out of `l2`.
    thin: [f64; 2],
    pub max: f64,
    /// The largest |a - b| in the unit of its cells.
    pub relative: f64,
    pub worst: Option<Place>,
    pub not_finite: Option<Place>,
    /// Cells of the first mesh with a larger difference than allowed; they may be there twice.
    pub beyond: Vec<u32>,
    /// What is found on cells of the first mesh; a cell may be there several times.
    pub on_cells: Vec<(u32, OnCell)>,
}

/// A field on what the other mesh covers of a cell of the first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct OnCell {
    /// The largest |a - b|, NaN where one is not finite.
    pub largest: f64,
    /// Integrals of a and b; of |a| and |b| if they have components.
    pub integrals: [f64; 2],
}

impl OnCell {
    pub fn add(&mut self, other: &OnCell) {
        if !self.largest.is_nan() && !(other.largest <= self.largest) {
            self.largest = other.largest;
        }
        (0..2).for_each(|k| self.integrals[k] += other.integrals[k]);
    }
}

impl Sums {
    pub fn add(&mut self, other: Sums) {
        for k in 0..3 {
            self.l2[k] += other.l2[k];
            self.h1[k] += other.h1[k];
            self.coarse[k] += other.coarse[k];
        }
        (0..2).for_each(|k| self.thin[k] += other.thin[k]);
        self.max = self.max.max(other.max);
        if other.relative > self.relative || self.worst.is_none() {
            (self.relative, self.worst) = (other.relative, other.worst);
        }
        self.not_finite = self.not_finite.or(other.not_finite);
        self.beyond.extend(other.beyond);
        self.on_cells.extend(other.on_cells);
    }

    /// What belongs to a cell of the first mesh, which comes after the one before or is the same.
    fn on_cell(&mut self, cell: u32) -> &mut OnCell {
        if self.on_cells.last().is_none_or(|(last, _)| *last != cell) {
            self.on_cells.push((cell, OnCell::default()));
        }
        let last = self.on_cells.last_mut();
        &mut last.expect("one was pushed").1
    }

    /// Squares of a difference and of what it is between, each a value and a gradient.
    pub fn add_squares(&mut self, weight: f64, d: &[f64; 4], a: &[f64; 4], b: &[f64; 4]) {
        for (k, of) in [d, a, b].into_iter().enumerate() {
            self.l2[k] += weight * of[0] * of[0];
            self.h1[k] += weight * (of[1] * of[1] + of[2] * of[2] + of[3] * of[3]);
        }
    }

    /// How much ‖a - b‖, ‖a‖ and ‖b‖ change with the coarser rule, and ‖a‖ and ‖b‖ with parts too thin to count, as a part of the
    /// larger of ‖a‖ and ‖b‖; NaN where one is not finite.
    pub fn change(&self) -> f64 {
        let [fine, coarse] = [self.l2, self.coarse].map(|of| of.map(f64::sqrt));
        let thin = |k: usize| match k {
            0 => 0.0,
            _ => (self.l2[k] + self.thin[k - 1]).sqrt() - fine[k],
        };
        let change = |k: usize| (fine[k] - coarse[k]).abs() + thin(k);
        let all = (0..3).map(change);
        let largest = all.reduce(|x, y| if x >= y || x.is_nan() { x } else { y });
        match (largest, fine[1].max(fine[2])) {
            (Some(0.0), _) => 0.0,
            (largest, scale) => largest.map_or(f64::NAN, |x| x / scale),
        }
    }

    pub fn norms(&self, is_constant: bool) -> Norms {
        let [d, a, b] = self.l2.map(f64::sqrt);
        let [of_d, of_a, of_b] = self.h1.map(f64::sqrt);
        Norms {
            l2: d,
            l2_scale: a.max(b),
            h1: (!is_constant).then_some(of_d),
            h1_scale: (!is_constant).then_some(of_a.max(of_b)),
        }
    }
}

/// How a field is judged: the largest difference that is allowed on a pair of cells, in the unit there.
pub(super) struct Law<'a> {
    pub unit: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
    pub tolerance: f64,
    /// Integers are compared exactly.
    pub is_integer: bool,
}

/// The state of one thread.
struct Work<'a> {
    sides: [Local<'a>; 2],
    sums: Vec<Sums>,
}

/// Sums for each pair of fields over the intersection of two meshes; the rule is exact for squares of polynomials.
///
/// # Errors
/// Meshes without anything in common; [`faceoff_mesh::Error::Ended`].
pub(super) fn differences<'a>(
    domains: [&'a Domain<'a>; 2],
    functions: [&'a [Function<'a>]; 2],
    laws: &[Law],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Vec<Sums>, Cover)> {
    let rule = rule_for(domains, functions);
    let degree = degree_of(domains, functions);
    let dim = domains[0].dim;
    let is_exact = domains.iter().all(|domain| is_exact(domain));
    let coarse = (degree > 0 && !is_exact).then(|| Rule::new(dim, 2 * degree + MORE - 2));
    let state = || Work {
        sides: [0, 1].map(|k| Local::new(domains[k], functions[k])),
        sums: vec![Sums::default(); laws.len()],
    };
    let visit = |work: &mut Work, common: &Common| {
        let cells = common.pieces.map(|piece| piece.cell);
        for (side, cell) in work.sides.iter_mut().zip(cells) {
            side.turn_to(cell, &common.frame);
        }
        let units: Vec<f64> = laws.iter().map(|law| (law.unit)(cells)).collect();
        for simplex in common.simplices {
            let size = measure(dim, simplex);
            for (lambda, weight) in &rule.points {
                let weight = weight * size;
                let place = combine(simplex, lambda);
                work.add(common, functions, laws, &units, &place, weight);
            }
            let coarse = coarse.iter().filter(|_| !common.is_rounding);
            for (lambda, weight) in coarse.flat_map(|rule| &rule.points) {
                work.add_coarse(functions, &combine(simplex, lambda), weight * size);
            }
            // The largest difference of linear functions is at a corner.
            if degree > 0 {
                for corner in &simplex[..=dim] {
                    work.add(common, functions, laws, &units, corner, 0.0);
                }
            }
        }
    };
    let mut sums = vec![Sums::default(); laws.len()];
    let merge = |work: Work| {
        let both = sums.iter_mut().zip(work.sums);
        both.for_each(|(sums, of_block)| sums.add(of_block));
    };
    let cover = overlay(domains, state, visit, merge, progress)?;
    for sums in &mut sums {
        sums.beyond.sort_unstable();
        sums.beyond.dedup();
    }
    Ok((sums, cover))
}

/// The largest degree of the polynomials of either side.
fn degree_of(domains: [&Domain; 2], functions: [&[Function]; 2]) -> usize {
    let of = |k: usize| functions[k].iter().map(|f| f.degree(domains[k])).max();
    of(0).max(of(1)).unwrap_or(0)
}

/// What is added to the degree of a rule where functions are not polynomials.
const MORE: usize = 4;

/// On pyramids and on cells whose map is not affine, functions are not polynomials, and a rule of higher degree is nearly exact.
pub(super) fn rule_for(domains: [&Domain; 2], functions: [&[Function]; 2]) -> Rule {
    let degree = degree_of(domains, functions);
    let more = if degree > 0 && domains.iter().any(|d| !is_exact(d)) {
        MORE
    } else {
        0
    };
    Rule::new(domains[0].dim, 2 * degree + more)
}

/// Are all functions of this mesh polynomials on its cells?
pub(super) fn is_exact(domain: &Domain) -> bool {
    let is_polynomial = |piece: &Piece| {
        domain.geometries[piece.cell as usize] == Geometry::Straight
            && !domain.element(piece.cell).is_pyramid()
    };
    domain.pieces.iter().all(is_polynomial)
}

pub(super) fn combine(simplex: &Simplex, lambda: &[f64; 4]) -> [f64; 3] {
    [0, 1, 2].map(|k| simplex.iter().zip(lambda).map(|(x, l)| x[k] * l).sum())
}

impl Work<'_> {
    /// One place of the coarser rule.
    fn add_coarse(&mut self, functions: [&[Function]; 2], place: &[f64; 3], weight: f64) {
        let [of_a, of_b] = &mut self.sides;
        of_a.evaluate(place);
        of_b.evaluate(place);
        let mut values = of_a.values.iter().zip(&of_b.values);
        for (function, sums) in functions[0].iter().zip(&mut self.sums) {
            for (x, y) in values.by_ref().take(function.components) {
                let all = [x[0] - y[0], x[0], y[0]];
                (0..3).for_each(|k| sums.coarse[k] += weight * all[k] * all[k]);
            }
        }
    }

    /// One place of the supermesh, with its weight in integrals.
    fn add(
        &mut self,
        common: &Common,
        functions: [&[Function]; 2],
        laws: &[Law],
        units: &[f64],
        place: &[f64; 3],
        weight: f64,
    ) {
        let [of_a, of_b] = &mut self.sides;
        of_a.evaluate(place);
        of_b.evaluate(place);
        let cells = common.pieces.map(|piece| piece.cell);
        let mut next = 0;
        for (k, (law, sums)) in laws.iter().zip(&mut self.sums).enumerate() {
            let [f, g] = [0, 1].map(|side| &functions[side][k]);
            let mut beyond = false;
            let mut here = OnCell::default();
            let mut squares = [0.0; 2];
            for component in 0..f.components {
                let (x, y) = (&of_a.values[next], &of_b.values[next]);
                next += 1;
                here.integrals = [weight * x[0], weight * y[0]];
                squares = [squares[0] + x[0] * x[0], squares[1] + y[0] * y[0]];
                let mut difference = x[0] - y[0];
                if law.is_integer {
                    difference += f.rest(cells[0], component) - g.rest(cells[1], component);
                }
                let found = |values| {
                    let at = common.frame.point(place);
                    let component = (f.components > 1).then_some(component);
                    Some(Place {
                        cells,
                        at,
                        values,
                        component,
                    })
                };
                if !difference.is_finite() {
                    sums.not_finite = sums.not_finite.or(found([x[0], y[0]]));
                    beyond = true;
                    here.largest = f64::NAN;
                    continue;
                }
                // Gradients jump from cell to cell: where cells overlap only by rounding, they are those of two neighbours.
                if common.is_rounding {
                    let squares = [x, y].map(|of| weight * of[0] * of[0]);
                    (0..2).for_each(|k| sums.thin[k] += squares[k]);
                    continue;
                }
                let d = [difference, x[1] - y[1], x[2] - y[2], x[3] - y[3]];
                sums.add_squares(weight, &d, x, y);
                let absolute = difference.abs();
                let relative = if absolute == 0.0 {
                    0.0
                } else {
                    absolute / units[k]
                };
                sums.max = sums.max.max(absolute);
                if absolute > here.largest {
                    here.largest = absolute;
                }
                beyond |= !(relative <= law.tolerance);
                if relative > sums.relative || sums.worst.is_none() {
                    (sums.relative, sums.worst) = (relative, found([x[0], y[0]]));
                }
            }
            if beyond && sums.beyond.last() != Some(&cells[0]) {
                sums.beyond.push(cells[0]);
            }
            if f.components > 1 {
                here.integrals = squares.map(|sum| weight * sum.sqrt());
            }
            sums.on_cell(cells[0]).add(&here);
        }
    }
}

/// Norms of each difference over the mesh of the first file, on whose points, cells or corners (`on`) its fields are; none
/// where it is not a mesh of known elements, or where a difference is not known everywhere.
pub(crate) fn norms_on_mesh(a: &Results, on: On, found: &mut Differences) -> Vec<(String, Norms)> {
    // Lent, not copied.
    let lent = found
        .fields
        .iter_mut()
        .map(|(name, n, values)| ResultField {
            name: name.clone(),
            components: *n,
            values: std::mem::take(values).into(),
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        });
    let lent: Vec<ResultField> = lent.collect();
    let norms = norms_of(a, on, found.on, &lent);
    for ((.., values), lent) in found.fields.iter_mut().zip(lent) {
        *values = lent.values.into_vec();
    }
    norms
}

fn norms_of(
    a: &Results,
    on: On,
    of_differences: On,
    differences: &[ResultField],
) -> Vec<(String, Norms)> {
    let fields = fields_on(a, on);
    // The first of each name, since a file may have thousands.
    let named = fields.iter().rev().map(|field| (&*field.name, field));
    let named: HashMap<&str, _> = named.collect();
    let of_field = |difference: &ResultField| {
        let field = named.get(&*difference.name)?;
        (field.rest.is_none() && field.components == difference.components)
            .then(|| Function::new(field, on))
    };
    let pairs = differences.iter().filter_map(|difference| {
        let field = of_field(difference)?;
        Some((field, Function::new(difference, of_differences)))
    });
    let (of_a, of_difference): (Vec<Function>, Vec<Function>) = pairs.unzip();
    if of_a.is_empty() {
        return Vec::new();
    }
    let Ok(domain) = Domain::divided(a, 0.0) else {
        return Vec::new();
    };
    let functions = [&of_a[..], &of_difference[..]];
    let rule = rule_for([&domain, &domain], functions);
    let block = |pieces: &[Piece]| {
        let mut sides = functions.map(|of| Local::new(&domain, of));
        let mut sums = vec![Sums::default(); of_a.len()];
        for piece in pieces {
            let frame = domain.frame(piece);
            let simplex = domain.simplex(piece, &frame);
            let size = measure(domain.dim, &simplex);
            sides
                .iter_mut()
                .for_each(|side| side.turn_to(piece.cell, &frame));
            for (lambda, weight) in &rule.points {
                let place = combine(&simplex, lambda);
                sides.iter_mut().for_each(|side| side.evaluate(&place));
                let mut values = sides[0].values.iter().zip(&sides[1].values);
                for (function, sums) in of_a.iter().zip(&mut sums) {
                    for (x, d) in values.by_ref().take(function.components) {
                        sums.add_squares(weight * size, d, x, &[0, 1, 2, 3].map(|k| x[k] - d[k]));
                    }
                }
            }
        }
        sums
    };
    let blocks = parallel::map(domain.pieces.chunks(BLOCK), block);
    let mut all = vec![Sums::default(); of_a.len()];
    for sums in blocks {
        all.iter_mut()
            .zip(sums)
            .for_each(|(all, sums)| all.add(sums));
    }
    let norms = all.iter().zip(&of_a).map(|(sums, function)| {
        (
            function.field.name.clone(),
            sums.norms(function.is_constant()),
        )
    });
    norms.filter(|(_, norms)| norms.l2.is_finite()).collect()
}
