//! Fields on facets: the mean on each facet of what is derived from a solution, such as the pressure on a part of the boundary.

use std::collections::BTreeMap;

use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::mesh::{CellBlock, CellKind, Field, Mesh, Support, Values};

use super::assemble::Assembler;
use super::batch::State;
use super::functional::Functionals;
use super::read::read;
use crate::language::Fault;
use crate::problem::{Domain, Integral, Problem};

/// A field on facets, one integral over the boundary for each component.
#[derive(Debug)]
pub struct OnFacets(Functionals);

/// A field on facets of one result.
#[derive(Debug)]
pub struct Means {
    /// The facets, with the means as a field on its cells.
    pub mesh: Mesh,
    /// By how much a mean may change when every dof changes by as much as the largest of its unknown: a relative tolerance of the dofs times this is
    /// one of the field.
    pub scale: f64,
}

impl OnFacets {
    /// A field by its components, each as in `sigma_n(u)*ds(bottom)`.
    ///
    /// # Errors
    /// The number of a component and what is wrong with it: a fault of the language, or an integral that is not over the same part of the boundary as the
    /// others.
    pub fn new(problem: &Problem, texts: &[String]) -> std::result::Result<Self, (usize, Fault)> {
        let mut all = Functionals::new(problem);
        for (k, text) in texts.iter().enumerate() {
            all.add(text).map_err(|fault| (k, fault))?;
            let first = all.integrals.first().map(|first| first.measure.clone());
            let is_other = |of: &Integral| {
                of.measure.domain != Domain::Boundary || Some(&of.measure) != first.as_ref()
            };
            if let Some(other) = all.integrals.iter().find(|of| is_other(of)) {
                let fault = Fault {
                    at: other.at,
                    what: "a field on facets is of one part of the boundary".into(),
                    remedy: "end each component with the same *ds(…)".into(),
                };
                return Err((k, fault));
            }
        }
        // The last one is the measure of a facet.
        if let Some(first) = all.integrals.first().cloned() {
            let one = all.problem.scalars.number(1.0);
            let terms = first.terms.keys().map(|leaf| (*leaf, one)).collect();
            all.integrals.push(Integral { terms, ..first });
            all.owners.push(all.count);
            all.count += 1;
        }
        Ok(OnFacets(all))
    }

    /// The field of a result on a mesh, whose own numbers were written with this relative error.
    ///
    /// # Errors
    /// A result on another mesh, fields that are not there or are not functions of the spaces, and values that are not finite.
    pub fn of(&self, name: &str, source: &Mesh, result: &Mesh, unit: f64) -> Result<Means> {
        let all = &self.0;
        let assembler = Assembler::of(&all.problem, source, &all.integrals, true)?;
        let u = read(&assembler, result, unit)?;
        let parameters: Vec<f64> = all.problem.parameters.iter().map(|p| p.value).collect();
        let state = State {
            u: &u,
            old: &[],
            parameters: &parameters,
        };
        let weight = all.problem.unknowns.len() - 1;
        let largest = largest(&assembler, &u);
        // Of each facet the sums of its components and of its measure, and the largest change of a component.
        let mut found: BTreeMap<usize, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
        for (k, owner) in all.owners.iter().enumerate() {
            assembler.by_facet((k, weight), state, &largest, |facet, sum, change| {
                let zeros = || (vec![0.0; all.count], vec![0.0; all.count]);
                let (sums, changes) = found.entry(facet).or_insert_with(zeros);
                sums[*owner] += sum;
                changes[*owner] += change;
            });
        }
        let components = all.count - 1;
        let (mut values, mut nodes, mut scale) = (Vec::new(), Vec::new(), 0.0_f64);
        let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
        let kind = assembler.mesh.shape.kinds(assembler.mesh.dim)[1];
        for (facet, (sums, changes)) in &found {
            let measure = sums[components];
            for (sum, change) in sums.iter().zip(changes).take(components) {
                let (mean, change) = (sum / measure, change / measure);
                if !(mean.is_finite() && change.is_finite()) {
                    let what = format!("`{name}` has a value that is not a finite number");
                    let remedy = "see that its formula is defined on every facet";
                    return Err(Error::usage(what, remedy));
                }
                values.push(mean);
                scale = scale.max(change);
            }
            let mut corners = assembler.mesh.face(*facet).to_vec();
            // Around the quadrangle.
            if kind == CellKind::Quadrangle {
                corners.swap(2, 3);
            }
            for corner in corners {
                let next = numbers.len() as u32;
                nodes.push(*numbers.entry(corner).or_insert(next));
            }
        }
        let mut points = vec![[0.0; 3]; numbers.len()];
        for (corner, number) in &numbers {
            points[*number as usize] = assembler.mesh.points[*corner as usize];
        }
        let field = Field::new(name, Support::Cells, components, Values::F64(values.into()));
        let mesh = Mesh {
            points: points.into(),
            blocks: vec![CellBlock::new(kind, nodes)],
            fields: vec![field],
            ..Mesh::default()
        };
        Ok(Means { mesh, scale })
    }
}

/// Of each unknown the largest dof.
fn largest(assembler: &Assembler, u: &[f64]) -> Vec<f64> {
    let Assembler { mesh, dofs, .. } = assembler;
    let of = |k: usize| {
        let nodes = (0..mesh.cell_count()).flat_map(move |cell| dofs.of_cell(k, cell));
        let all = nodes.flat_map(|node| dofs.of_node(*node));
        all.map(|dof| u[dof].abs()).fold(0.0, f64::max)
    };
    (0..assembler.problem.unknowns.len()).map(of).collect()
}
