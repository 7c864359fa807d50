//! Numbers of u that people ask for: over all of Γ_C, Γ_D and Ω, and over the groups that the mesh has of them.

use serde::Serialize;

use super::cells::{self, CellFields};
use super::flux::Fluxes;
use super::goal::{self, Dual, Goal, Known};
use super::proof::{self, ContactProof};
use super::simplex::{Simplex, length};
use crate::interval::Interval;
use crate::scene::Part;
use faceoff_mesh::error::Result;

#[cfg(test)]
mod tests;

/// Numbers of u, each in its interval.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Numbers {
    /// <∂ₙu, 1>_C; none where Γ_C meets Γ_D, which carry a share of it that no bound of ∇u separates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_force: Option<[f64; 2]>,
    /// <∂ₙu, 1>_D = -(f,1) - <t,1>_N - <∂ₙu,1>_C
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dirichlet_flux: Option<[f64; 2]>,
    /// The mean of u over the domain.
    pub mean: [f64; 2],
    /// <∂ₙu, 1> over each group of faces of Γ_C, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contact_forces: Vec<OfPart>,
    /// The same of Γ_D.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dirichlet_fluxes: Vec<OfPart>,
    /// The mean of u over each group of cells that is not all of the domain.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub means: Vec<OfPart>,
    /// What is proved about the contact set, in 2D where Γ_C lies on one line parallel to an axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactProof>,
}

/// A number over one group of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfPart {
    /// The group's name, or its number where it has none.
    pub part: String,
    /// None if the group meets another of Γ_C or Γ_D.
    pub interval: Option<[f64; 2]>,
}

/// (1, |w|) ≤ this ‖∇w‖ for w that vanishes on Γ_D: ‖q‖ of the majorant of the load 1.
pub(super) fn friedrichs(fields: &CellFields, solver: &mut Fluxes) -> Result<f64> {
    let mesh = fields.problem.space.mesh;
    let [_, norms] = solver.majorant(&vec![1.0; mesh.cell_count()], &[])?;
    Ok(length(norms))
}

/// # Errors
/// The errors of the linear solver.
pub(super) fn numbers(
    fields: &CellFields,
    mut known: Known,
    solver: &mut Fluxes,
) -> Result<Numbers> {
    let (problem, mesh) = (fields.problem, fields.problem.space.mesh);
    known.friedrichs = friedrichs(fields, solver)?;
    let mut plain = Dual::new(fields, &known, 0.0);
    let ends = |of: Interval| {
        let back = |value: f64| Interval::at(value).times_power_of_two(-fields.data.unit);
        [back(of.low).low, back(of.high).high]
    };
    let mut flux = |faces: &[usize]| -> Result<Option<Interval>> {
        let goal = Goal::flux_through(fields, faces);
        let of = goal.map(|goal| goal::interval(&mut plain, &goal));
        Ok(of.transpose()?.map(|n| -n))
    };
    let faces: Vec<usize> = problem.contact.iter().map(|contact| contact.face).collect();
    let force = flux(&faces)?;
    let mut of_groups = |part: Part| -> Result<Vec<OfPart>> {
        let groups = mesh.groups.iter();
        let of_part = |face: &&u32| problem.parts[**face as usize] == Some(part);
        let groups = groups.filter_map(|group| {
            let faces = group.faces.iter().filter(of_part);
            let faces: Vec<usize> = faces.map(|face| *face as usize).collect();
            (!faces.is_empty()).then(|| (named(group.name.as_ref(), group.tag), faces))
        });
        let groups: Vec<_> = groups.collect();
        let groups = groups.into_iter().filter(|(_, faces)| {
            faces.len() < problem.parts.iter().filter(|of| **of == Some(part)).count()
        });
        let of = groups.map(|(part, faces)| {
            let interval = flux(&faces)?.map(ends);
            Ok(OfPart { part, interval })
        });
        of.collect()
    };
    let (contact_forces, dirichlet_fluxes) =
        (of_groups(Part::Contact)?, of_groups(Part::Dirichlet)?);
    let mut mean = |is_in: &(dyn Fn(usize) -> bool + Sync)| -> Result<[f64; 2]> {
        let goal = Goal {
            means: (0..mesh.cell_count())
                .map(|cell| f64::from(u8::from(is_in(cell))))
                .collect(),
            rests: Vec::new(),
            on_boundary: Vec::new(),
        };
        let [volume] = cells::sums_over(mesh, |cell| {
            [if is_in(cell) {
                Simplex::new(mesh, cell).measure
            } else {
                Interval::ZERO
            }]
        })?;
        Ok(ends(goal::interval(&mut plain, &goal)? / volume))
    };
    let whole = mean(&|_| true)?;
    let parts = mesh
        .regions
        .iter()
        .filter(|region| region.cells.len() < mesh.cell_count());
    let means = parts.map(|region| {
        let mut is_in = vec![false; mesh.cell_count()];
        region
            .cells
            .iter()
            .for_each(|&cell| is_in[cell as usize] = true);
        Ok(OfPart {
            part: named(region.name.as_ref(), region.tag),
            interval: Some(mean(&|cell| is_in[cell])?),
        })
    });
    let means = means.collect::<Result<_>>()?;
    let total = super::load(fields, &vec![Interval::ONE; mesh.points.len()])?;
    Ok(Numbers {
        contact_force: force.map(ends),
        dirichlet_flux: force.map(|n| ends(-n - total)),
        mean: whole,
        contact_forces,
        dirichlet_fluxes,
        means,
        contact: proof::contact(fields, &known)?,
    })
}

fn named(name: Option<&String>, tag: i64) -> String {
    name.cloned().unwrap_or_else(|| tag.to_string())
}
