//! Sums of the integrals of all cells and facets: the residual of a form, and its derivative as a sparse matrix.
//!
//! Every core owns a range of rows and evaluates all cells that touch them; cells at a border are evaluated by two. So no core waits for
//! another one, and each sum is computed in the same order for any number of cores.

use faceoff_fem::linear::zeros;
use faceoff_mesh::error::Result;
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::parallel;

use super::batch::{Batch, Scratch, State};
use super::dofs::{Coupling, Dofs, Pattern};
use super::work::{Entity, Work};
use crate::grid::Grid;
use crate::problem::{Bilinear, Integral, Problem};

/// A form on a mesh, ready to be evaluated.
#[derive(Debug)]
pub struct Assembler {
    /// With the expressions of the derivative.
    pub problem: Problem,
    /// The cells.
    pub mesh: Grid,
    /// The degrees of freedom.
    pub dofs: Dofs,
    /// The pattern of the matrix.
    pub pattern: Pattern,
    works: Vec<Work>,
    /// For each core the nodes that it owns, and the entities of each work that touch them.
    parts: Vec<(std::ops::Range<usize>, Vec<Vec<Entity>>)>,
}

/// The requested sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// The residual.
    Residual,
    /// The residual and the matrix.
    Both,
    /// The residual, and the sums of the absolute values of the contributions of cells and facets to its rows.
    Sizes,
}

/// The sums.
#[derive(Debug, Default)]
pub struct System {
    /// F(u; ·), by dofs.
    pub residual: Vec<f64>,
    /// The values of the derivative, in the order of the pattern; empty if it is not requested.
    pub matrix: Vec<f64>,
    /// Sizes of rows; empty if they are not requested.
    pub sizes: Vec<f64>,
}

impl Assembler {
    /// For all integrals of a problem.
    ///
    /// # Errors
    /// A mesh on which the problem cannot be solved.
    pub fn new(problem: &Problem, source: &Mesh) -> Result<Self> {
        let mut problem = problem.clone();
        let integrals = problem.residual();
        Assembler::of(&problem, source, &integrals, true)
    }

    /// For some integrals, with or without the derivative.
    ///
    /// # Errors
    /// A mesh on which the problem cannot be solved.
    pub fn of(
        problem: &Problem,
        source: &Mesh,
        integrals: &[Integral],
        is_matrix: bool,
    ) -> Result<Self> {
        let mut problem = problem.clone();
        let mesh = Grid::new(&problem.name, source)?;
        let dofs = Dofs::new(&problem, &mesh);
        let works: Vec<Work> = integrals
            .iter()
            .map(|integral| {
                let by = if is_matrix {
                    problem.derivative(integral)
                } else {
                    Bilinear::new()
                };
                let rules = problem.rules();
                Work::new(&mut problem, &mesh, source, integral, rules, by)
            })
            .collect();
        let pattern = match is_matrix {
            true => Pattern::new(&dofs, &couplings(&problem, &dofs, &works)),
            false => Pattern::default(),
        };
        let mut assembler = Assembler {
            problem,
            mesh,
            dofs,
            pattern,
            works,
            parts: Vec::new(),
        };
        assembler.divide_into(parallel::threads());
        Ok(assembler)
    }

    /// Assigns a range of rows to each of a number of cores.
    pub(super) fn divide_into(&mut self, count: usize) {
        self.parts = self.divide(count);
    }

    /// Ranges of nodes of about equal work.
    fn divide(&self, count: usize) -> Vec<(std::ops::Range<usize>, Vec<Vec<Entity>>)> {
        let nodes = self.dofs.nodes();
        let size = nodes.div_ceil(count.max(1)).max(1);
        parallel::map((0..nodes).step_by(size), |first| {
            let range = first..nodes.min(first + size);
            let touches = |entity: &&Entity| {
                let cells = entity.cells;
                let both = if cells[0] == cells[1] {
                    &cells[..1]
                } else {
                    &cells[..]
                };
                both.iter().any(|cell| {
                    let unknowns = 0..self.dofs.counts.len();
                    let mut all = unknowns.flat_map(|k| self.dofs.of_cell(k, *cell as usize));
                    all.any(|node| range.contains(&(*node as usize)))
                })
            };
            let own = |work: &Work| work.entities.iter().filter(touches).copied().collect();
            (range.clone(), self.works.iter().map(own).collect())
        })
    }

    /// The sums at a state.
    pub fn assemble(&self, state: State, wanted: Wanted) -> System {
        self.sums(state, wanted, |_| true)
    }

    /// The sums of one integral.
    pub fn assemble_only(&self, integral: usize, state: State, wanted: Wanted) -> System {
        self.sums(state, wanted, |k| k == integral)
    }

    /// Calls `with` with each cell or facet of an integral of a problem with the same spaces, and its contribution to the rows of its dofs.
    pub fn contributions(
        &self,
        problem: &Problem,
        work: &Work,
        state: State,
        mut with: impl FnMut(&Entity, &[(usize, f64)]),
    ) {
        let mut scratch = Scratch::default();
        let mut rows = Vec::new();
        for entities in work.batches(&work.entities) {
            let batch = Batch {
                problem,
                mesh: &self.mesh,
                dofs: &self.dofs,
                work,
                entities,
            };
            batch.run(state, &mut scratch, false);
            for (c, entity) in entities.iter().enumerate() {
                rows.clear();
                for block in work.wholes() {
                    let cell = entity.cells[block.side] as usize;
                    for (i, node) in self.dofs.of_cell(block.unknown, cell).iter().enumerate() {
                        for (component, dof) in self.dofs.of_node(*node).enumerate() {
                            let at = block.start + component * block.count + i;
                            rows.push((dof, scratch.vector[at * entities.len() + c]));
                        }
                    }
                }
                with(entity, &rows);
            }
        }
    }

    /// Calls `with` with each facet of an integral, what it adds to the rows of an unknown, and by how much that may change when each dof of an unknown
    /// changes by as much as `by` says; to first order.
    pub(super) fn by_facet(
        &self,
        (integral, unknown): (usize, usize),
        state: State,
        by: &[f64],
        mut with: impl FnMut(usize, f64, f64),
    ) {
        let work = &self.works[integral];
        let mut scratch = Scratch::default();
        for entities in work.batches(&work.entities) {
            self.batch(work, entities).run(state, &mut scratch, true);
            let facet = work.placements[usize::from(entities[0].places[0])].facet;
            let n = entities.len();
            for (c, entity) in entities.iter().enumerate() {
                let (mut sum, mut change) = (0.0, 0.0);
                for row in work.blocks.iter().filter(|row| row.unknown == unknown) {
                    for i in row.start..row.start + row.count {
                        sum += scratch.vector[i * n + c];
                        for column in &work.blocks {
                            let all = column.start..column.start + column.count;
                            let of = |j: usize| scratch.matrix[(i * work.size + j) * n + c].abs();
                            change += by[column.unknown] * all.map(of).sum::<f64>();
                        }
                    }
                }
                let cell = entity.cells[0] as usize;
                with(self.mesh.cell_faces(cell)[facet] as usize, sum, change);
            }
        }
    }

    /// Entities of one integral, which are evaluated together.
    fn batch<'a>(&'a self, work: &'a Work, entities: &'a [Entity]) -> Batch<'a> {
        Batch {
            problem: &self.problem,
            mesh: &self.mesh,
            dofs: &self.dofs,
            work,
            entities,
        }
    }

    fn sums(
        &self,
        state: State,
        wanted: Wanted,
        is_wanted: impl Fn(usize) -> bool + Sync,
    ) -> System {
        let is_matrix = wanted == Wanted::Both;
        let room = |is_wanted: bool, count: usize| zeros(if is_wanted { count } else { 0 });
        let mut system = System {
            residual: zeros(self.dofs.count()),
            matrix: room(is_matrix, self.pattern.values()),
            sizes: room(wanted == Wanted::Sizes, self.dofs.count()),
        };
        let dofs_end =
            |(range, _): &(std::ops::Range<usize>, _)| self.dofs.first[range.end] as usize;
        let residuals = split(&mut system.residual, self.parts.iter().map(dofs_end));
        let sizes = split(
            &mut system.sizes,
            self.parts.iter().map(|part| match wanted {
                Wanted::Sizes => dofs_end(part),
                _ => 0,
            }),
        );
        let matrices = split(
            &mut system.matrix,
            self.parts.iter().map(|(range, _)| match is_matrix {
                true => self.pattern.rows[range.end],
                false => 0,
            }),
        );
        let tasks = self.parts.iter().zip(residuals).zip(sizes).zip(matrices);
        parallel::map(tasks, |((((range, entities), residual), sizes), matrix)| {
            let mut own = Own {
                range: range.clone(),
                residual,
                sizes,
                matrix,
            };
            let mut scratch = Scratch::default();
            let works = self.works.iter().zip(entities).enumerate();
            for (_, (work, entities)) in works.filter(|(k, _)| is_wanted(*k)) {
                scratch.products.clear();
                for entities in work.batches(entities) {
                    let batch = self.batch(work, entities);
                    batch.run(state, &mut scratch, is_matrix);
                    self.scatter(&batch, &scratch, &mut own);
                }
            }
        });
        system
    }

    fn scatter(&self, batch: &Batch, scratch: &Scratch, own: &mut Own) {
        let (n, size, dofs) = (batch.entities.len(), batch.work.size, &self.dofs);
        let (first_dof, first_value) = match own.range.start {
            0 => (0, 0),
            start => (
                dofs.first[start] as usize,
                self.pattern.rows.get(start).copied().unwrap_or(0),
            ),
        };
        let (is_sized, is_matrix) = (!own.sizes.is_empty(), !own.matrix.is_empty());
        let groups: Vec<_> = batch.work.wholes().collect();
        for (c, entity) in batch.entities.iter().enumerate() {
            for row in &groups {
                let nodes = dofs.of_cell(row.unknown, entity.cells[row.side] as usize);
                for (i, node) in nodes.iter().enumerate() {
                    if !own.range.contains(&(*node as usize)) {
                        continue;
                    }
                    let of_node = dofs.of_node(*node);
                    for (component, dof) in of_node.clone().enumerate() {
                        let value = scratch.vector[(row.start + component * row.count + i) * n + c];
                        own.residual[dof - first_dof] += value;
                        if is_sized {
                            own.sizes[dof - first_dof] += value.abs();
                        }
                    }
                    if !is_matrix {
                        continue;
                    }
                    let start = self.pattern.rows[*node as usize] - first_value;
                    let width = self.pattern.widths[*node as usize] as usize;
                    for column in &groups {
                        let others =
                            dofs.of_cell(column.unknown, entity.cells[column.side] as usize);
                        for (j, other) in others.iter().enumerate() {
                            let Some(at) = self.pattern.find(*node, *other) else {
                                continue;
                            };
                            for a in 0..of_node.len() {
                                let from = (row.start + a * row.count + i) * size;
                                let values = &mut own.matrix[start + a * width + at..];
                                for (b, place) in values
                                    .iter_mut()
                                    .enumerate()
                                    .take(dofs.of_node(*other).len())
                                {
                                    let to = column.start + b * column.count + j;
                                    *place += scratch.matrix[(from + to) * n + c];
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The output of a core.
struct Own<'a> {
    range: std::ops::Range<usize>,
    residual: &'a mut [f64],
    sizes: &'a mut [f64],
    matrix: &'a mut [f64],
}

/// The parts of a slice with these ends.
fn split<T>(mut all: &mut [T], ends: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut start = 0;
    ends.map(|end| {
        let (own, others) = std::mem::take(&mut all).split_at_mut(end - start);
        (all, start) = (others, end);
        own
    })
    .collect()
}

fn couplings(problem: &Problem, dofs: &Dofs, works: &[Work]) -> Vec<Coupling> {
    let unknowns = problem.unknowns.len();
    let mut all: Vec<Coupling> = Vec::new();
    for work in works {
        let mut coupled = vec![vec![false; unknowns]; unknowns];
        for (a, b, _) in &work.matrix {
            coupled[work.blocks[*a].unknown][work.blocks[*b].unknown] = true;
        }
        if !coupled.iter().flatten().any(|is| *is) {
            continue;
        }
        let mut coupling = Coupling {
            nodes: Vec::new(),
            size: work.sides * dofs.counts.iter().sum::<usize>(),
            coupled,
        };
        for entity in &work.entities {
            for side in 0..work.sides {
                for k in 0..unknowns {
                    coupling
                        .nodes
                        .extend(dofs.of_cell(k, entity.cells[side] as usize));
                }
            }
        }
        all.push(coupling);
    }
    all
}
