//! Fields of one mesh on another: the L² projection, which keeps integrals.
//!
//! Find u in the space of the other mesh with ∫ u φ_i = ∫ b φ_i for each of its basis functions φ_i, both integrals over what the
//! two meshes have in common, exactly on their supermesh. Constants are in every space, so that ∫ u = ∫ b there.

use std::collections::HashMap;

use super::clip::measure;
use super::domain::Domain;
use super::function::Function;
use super::map::Local;
use super::norms::{combine, rule_for};
use super::overlay::{Common, overlay};
use crate::On;
use crate::places;
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::{ResultField, Results};
use faceoff_mesh::memory;

/// Fields of one result on the mesh of another.
#[derive(Debug)]
pub struct Projection {
    /// The mesh with these fields; NaN where nothing of the other mesh lies.
    pub results: Results,
    /// Name, component, and the integrals before and after, over what the meshes have in common.
    pub integrals: Vec<(String, usize, [f64; 2])>,
    /// The part of the mesh that the other does not cover.
    pub uncovered: f64,
}

/// Projects the fields of `from` to the mesh of `onto`: to the space of its field of the same name where it has one, and
/// otherwise to one like that of the field.
///
/// # Errors
/// Meshes on which fields are not functions, or without anything in common; equations that cannot be solved.
pub fn project(
    onto: &Results,
    from: &Results,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Projection> {
    let near = places::tolerance(&onto.points, &from.points)?;
    let domains = [&Domain::new(onto, near)?, &Domain::new(from, near)?];
    if domains[0].dim != domains[1].dim {
        return Err(Error::Compare {
            a: onto.source.clone(),
            b: from.source.clone(),
            what: "one mesh is plane and the other is not".into(),
            remedy: "give two results on one domain".into(),
        });
    }
    let known: HashMap<&str, On> = of_all(onto)
        .map(|f| (f.field.name.as_str(), f.on))
        .collect();
    let functions = of_all(from).filter(|f| f.is_constant() || f.field.rest.is_none());
    let functions: Vec<Function> = functions.collect();
    let spaces: Vec<On> = functions
        .iter()
        .map(|f| known.get(f.field.name.as_str()).copied().unwrap_or(f.on))
        .collect();
    let system = assemble(domains, &functions, &spaces, progress)?;
    let mut results = Results {
        source: from.source.clone(),
        on_points: Vec::new(),
        on_cells: Vec::new(),
        on_corners: Vec::new(),
        whole: Vec::new(),
        ..onto.clone()
    };
    let mut integrals = Vec::new();
    let mut next = 0;
    for (function, &on) in functions.iter().zip(&spaces) {
        let space = Space {
            domain: domains[0],
            system: &system,
            on,
        };
        let columns = next..next + function.components;
        next = columns.end;
        let mut columns_of = Vec::new();
        for (component, column) in columns.enumerate() {
            let values = space.solve(column).ok_or_else(|| Error::Solver {
                what: format!(
                    "the projection of `{}` does not converge",
                    function.field.name
                ),
                remedy: "look for cells of the mesh that are nearly flat".into(),
            })?;
            let after = space.integral(&values);
            let name = function.field.name.clone();
            integrals.push((name, component, [system.integrals[column], after]));
            columns_of.push(values);
        }
        let rows = 0..columns_of.first().map_or(0, Vec::len);
        let values = rows.flat_map(|row| columns_of.iter().map(move |column| column[row]));
        let field = ResultField {
            name: function.field.name.clone(),
            components: function.components,
            values: values.collect(),
            rest: None,
            at: None,
            scaled_by: None,
            single: false,
        };
        match on {
            On::Cells => results.on_cells.push(field),
            On::Corners => results.on_corners.push(field),
            _ => results.on_points.push(field),
        }
    }
    let uncovered = (1.0 - system.common / domains[0].measure).max(0.0);
    Ok(Projection {
        results,
        integrals,
        uncovered,
    })
}

fn of_all(side: &Results) -> impl Iterator<Item = Function<'_>> {
    let on = [
        (On::Points, &side.on_points),
        (On::Cells, &side.on_cells),
        (On::Corners, &side.on_corners),
    ];
    on.into_iter()
        .flat_map(|(on, fields)| fields.iter().map(move |f| Function::new(f, on)))
}

/// Integrals over each cell of the mesh that fields are projected to.
struct System {
    /// Where the rows of a cell begin.
    starts: Vec<usize>,
    /// ∫ φ_i φ_j, by cells.
    mass: Vec<f64>,
    /// ∫ φ_i.
    weights: Vec<f64>,
    /// ∫ b φ_i for each component of each field, one after another; for constants on cells in the first row of the cell.
    loads: Vec<Vec<f64>>,
    /// ∫ b.
    integrals: Vec<f64>,
    /// The measure of each cell that is covered, and of all.
    covered: Vec<f64>,
    common: f64,
}

/// The same for the piece of a cell.
struct Part {
    cell: u32,
    mass: Vec<f64>,
    weights: Vec<f64>,
    loads: Vec<f64>,
}

fn assemble<'a>(
    domains: [&'a Domain<'a>; 2],
    functions: &'a [Function<'a>],
    spaces: &[On],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<System> {
    let [onto, _] = domains;
    let cells = onto.side.cell_count();
    let (mut starts, mut rows, mut squares) = (vec![0; cells + 1], 0, 0);
    for cell in 0..cells {
        let count = onto.known_element(cell as u32).map_or(0, |e| e.len());
        (starts[cell], rows, squares) = (rows, rows + count, squares + count * count);
    }
    starts[cells] = rows;
    let columns: Vec<On> = functions
        .iter()
        .zip(spaces)
        .flat_map(|(f, on)| std::iter::repeat_n(*on, f.components))
        .collect();
    memory::require(
        8.0 * (squares + (1 + columns.len()) * rows) as f64,
        "the projection",
    )?;
    // The rule integrates products of what is on one side with what is on the other, and of the former with itself.
    let points = ResultField {
        name: String::new(),
        components: 1,
        values: Vec::new().into(),
        rest: None,
        at: None,
        scaled_by: None,
        single: false,
    };
    let nodal = [Function::new(&points, On::Points)];
    let rule = rule_for(domains, [&nodal, functions]);
    let dim = onto.dim;
    let state = || {
        (
            Local::new(onto, &[]),
            Local::new(domains[1], functions),
            Vec::<Part>::new(),
        )
    };
    let visit = |(here, there, parts): &mut (Local<'a>, Local<'a>, Vec<Part>), common: &Common| {
        let [cell, other] = common.pieces.map(|piece| piece.cell);
        here.turn_to(cell, &common.frame);
        there.turn_to(other, &common.frame);
        let element = onto.element(cell);
        let count = element.len();
        if parts.last().is_none_or(|part| part.cell != cell) {
            parts.push(Part {
                cell,
                mass: vec![0.0; count * count],
                weights: vec![0.0; count],
                loads: vec![0.0; count * columns.len()],
            });
        }
        let Some(part) = parts.last_mut() else { return };
        let mut shape = vec![0.0; count];
        for simplex in common.simplices {
            let size = measure(dim, simplex);
            for (lambda, weight) in &rule.points {
                let place = combine(simplex, lambda);
                here.shape_functions(&place, &mut shape);
                there.evaluate(&place);
                let weight = weight * size;
                for i in 0..count {
                    part.weights[i] += weight * shape[i];
                    for j in 0..count {
                        part.mass[i * count + j] += weight * shape[i] * shape[j];
                    }
                }
                for (column, (value, on)) in there.values.iter().zip(&columns).enumerate() {
                    let loads = &mut part.loads[column * count..(column + 1) * count];
                    if *on == On::Cells {
                        loads[0] += weight * value[0];
                    } else {
                        let terms = loads.iter_mut().zip(&shape);
                        terms.for_each(|(load, shape)| *load += weight * value[0] * shape);
                    }
                }
            }
        }
    };
    let mut system = System {
        mass: vec![0.0; squares],
        weights: vec![0.0; rows],
        loads: vec![vec![0.0; rows]; columns.len()],
        integrals: vec![0.0; columns.len()],
        covered: Vec::new(),
        common: 0.0,
        starts,
    };
    // Where the matrix of each cell begins.
    let mut squares = 0;
    let squares: Vec<usize> = system
        .starts
        .windows(2)
        .map(|pair| {
            squares += (pair[1] - pair[0]).pow(2);
            squares - (pair[1] - pair[0]).pow(2)
        })
        .collect();
    let merge = |(_, _, parts): (Local<'a>, Local<'a>, Vec<Part>)| {
        for part in parts {
            let (start, count) = (system.starts[part.cell as usize], part.weights.len());
            let add = |to: &mut [f64], from: &[f64]| {
                to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
            };
            add(&mut system.mass[squares[part.cell as usize]..], &part.mass);
            add(&mut system.weights[start..], &part.weights);
            for (column, loads) in part.loads.chunks_exact(count).enumerate() {
                add(&mut system.loads[column][start..], loads);
                system.integrals[column] += loads.iter().sum::<f64>();
            }
        }
    };
    let cover = overlay(domains, state, visit, merge, progress)?;
    let [covered, _] = cover.of_cells;
    (system.covered, system.common) = (covered, cover.common);
    Ok(system)
}

/// The space that a field is projected to.
struct Space<'a> {
    domain: &'a Domain<'a>,
    system: &'a System,
    on: On,
}

impl Space<'_> {
    /// The unknown of each row of a cell.
    fn unknowns(&self, cell: u32) -> impl Iterator<Item = usize> {
        let corner = self.domain.first_corners.get(cell as usize).copied();
        let points = self.domain.side.cell(cell as usize).enumerate();
        points.map(move |(k, point)| match (self.on, corner) {
            (On::Corners, Some(corner)) => corner as usize + k,
            _ => point as usize,
        })
    }

    fn len(&self) -> usize {
        let side = self.domain.side;
        match self.on {
            On::Cells => side.cell_count(),
            On::Corners => (0..side.cell_count())
                .map(|cell| side.cell(cell).count())
                .sum(),
            _ => side.point_count(),
        }
    }

    /// Adds what `of` gives for each row of each cell to its unknown.
    fn gather(&self, mut of: impl FnMut(u32, &mut [f64])) -> Vec<f64> {
        let mut all = vec![0.0; self.len()];
        let mut local = Vec::new();
        for (cell, ends) in (0..).zip(self.system.starts.windows(2)) {
            local.clear();
            local.resize(ends[1] - ends[0], 0.0);
            of(cell, &mut local);
            let rows = self.unknowns(cell).zip(&local);
            rows.for_each(|(unknown, value)| all[unknown] += value);
        }
        all
    }

    /// Values at the unknowns; NaN where there is no equation. `None` where the iteration does not end.
    fn solve(&self, column: usize) -> Option<Vec<f64>> {
        let System {
            starts,
            mass,
            loads,
            covered,
            ..
        } = self.system;
        if self.on == On::Cells {
            let mean = |cell: usize| match starts[cell] < starts[cell + 1] && covered[cell] > 0.0 {
                true => loads[column][starts[cell]] / covered[cell],
                false => f64::NAN,
            };
            return Some((0..covered.len()).map(mean).collect());
        }
        let rows = |cell: u32| starts[cell as usize]..starts[cell as usize + 1];
        let load = self.gather(|cell, local| local.copy_from_slice(&loads[column][rows(cell)]));
        let mut next = 0;
        let diagonal = self.gather(|_, local| {
            let count = local.len();
            (0..count).for_each(|i| local[i] = mass[next + i * count + i]);
            next += count * count;
        });
        let apply = |x: &[f64]| {
            let mut next = 0;
            let mut of_cell = Vec::new();
            self.gather(|cell, local| {
                of_cell.clear();
                of_cell.extend(self.unknowns(cell).map(|unknown| x[unknown]));
                for out in local.iter_mut() {
                    let row = &mass[next..next + of_cell.len()];
                    *out = row.iter().zip(&of_cell).map(|(m, x)| m * x).sum();
                    next += of_cell.len();
                }
            })
        };
        let mut x = conjugate_gradients(&load, &diagonal, apply)?;
        let values = x.iter_mut().zip(&diagonal);
        values
            .filter(|(_, d)| **d == 0.0)
            .for_each(|(x, _)| *x = f64::NAN);
        Some(x)
    }

    /// ∫ u over what is covered.
    fn integral(&self, values: &[f64]) -> f64 {
        let System {
            starts,
            weights,
            covered,
            ..
        } = self.system;
        if self.on == On::Cells {
            let cells = values
                .iter()
                .zip(covered)
                .filter(|(_, covered)| **covered > 0.0);
            return cells.map(|(value, covered)| value * covered).sum();
        }
        let of_cell = |cell: usize| -> f64 {
            let weights = &weights[starts[cell]..starts[cell + 1]];
            let rows = self
                .unknowns(cell as u32)
                .zip(weights)
                .filter(|(_, w)| **w != 0.0);
            rows.map(|(unknown, weight)| weight * values[unknown]).sum()
        };
        (0..covered.len()).map(of_cell).sum()
    }
}

/// M x = b with the diagonal of M as preconditioner, to rounding.
pub(super) fn conjugate_gradients(
    b: &[f64],
    diagonal: &[f64],
    apply: impl Fn(&[f64]) -> Vec<f64>,
) -> Option<Vec<f64>> {
    let scaled = |r: &[f64]| -> Vec<f64> {
        let rows = r.iter().zip(diagonal);
        rows.map(|(r, d)| if *d > 0.0 { r / d } else { 0.0 })
            .collect()
    };
    let dot = |x: &[f64], y: &[f64]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let mut x = vec![0.0; b.len()];
    let mut r = b.to_vec();
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut rho = dot(&r, &z);
    let first = rho;
    if !first.is_finite() {
        return None;
    }
    for _ in 0..2000 {
        // (1e-15)² is below what rounding leaves.
        if rho <= 1e-30 * first || cancel::cause().is_some() {
            return Some(x);
        }
        let of_p = apply(&p);
        let alpha = rho / dot(&p, &of_p);
        for k in 0..x.len() {
            x[k] += alpha * p[k];
            r[k] -= alpha * of_p[k];
        }
        z = scaled(&r);
        let new = dot(&r, &z);
        let beta = new / rho;
        rho = new;
        for k in 0..x.len() {
            p[k] = z[k] + beta * p[k];
        }
    }
    (rho <= 1e-24 * first).then_some(x)
}
