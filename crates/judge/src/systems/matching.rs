//! Matches the dofs of two systems by field, position and direction.

use std::collections::HashMap;

use super::System;
use crate::places;
use faceoff_mesh::error::{Error, Result};

/// Directions are the same, up to sign and length, if they differ by at most this, relatively.
const PARALLEL: f64 = 1e-6;

/// The dofs of the second system among those of the first.
#[derive(Debug, Clone)]
pub struct Matched {
    /// For each dof of the second system, its number in the first.
    pub to: Vec<u32>,
    /// The first system's dof divided by the second's: ±1 if they have the same scaling.
    pub scale: Vec<f64>,
    /// Which dofs of the first system are in the second?
    pub is_in_both: Vec<bool>,
}

/// Pairs all dofs of `b` with dofs of `a`; `a` may have more, which `b` then has eliminated.
///
/// # Errors
/// Fields with different names; several dofs with one field, position and direction; dofs that neither system shares with the other.
pub fn matched(a: &System, b: &System) -> Result<Matched> {
    let fields = fields(a, b)?;
    let near = places::tolerance(&a.dofs.at, &b.dofs.at)?;
    let place = places::numbers(&a.dofs.at, &b.dofs.at, near)?;
    let (of_a, of_b) = place.split_at(a.dofs.at.len());
    let mut there: HashMap<(u32, u16), Vec<u32>> = HashMap::with_capacity(of_a.len());
    for ((place, field), dof) in of_a.iter().zip(&a.dofs.field).zip(0..) {
        there.entry((*place, *field)).or_default().push(dof);
    }
    let mut found = Matched {
        to: Vec::with_capacity(of_b.len()),
        scale: Vec::with_capacity(of_b.len()),
        is_in_both: vec![false; of_a.len()],
    };
    for (dof, place) in of_b.iter().enumerate() {
        let key = (*place, fields[usize::from(b.dofs.field[dof])]);
        let direction = b.dofs.direction[dof];
        let all = there.get(&key).map_or(&[][..], |all| all);
        let mut fitting = all
            .iter()
            .filter_map(|&k| Some((k, ratio(a.dofs.direction[k as usize], direction)?)));
        let Some((to, scale)) = fitting.next() else {
            return Err(unmatched(a, b, dof));
        };
        if fitting.next().is_some() || std::mem::replace(&mut found.is_in_both[to as usize], true) {
            return Err(ambiguous(a, b, dof));
        }
        found.to.push(to);
        found.scale.push(scale);
    }
    Ok(found)
}

/// For each field of `b` that of `a`: the one with the same name, or the only one of both.
fn fields(a: &System, b: &System) -> Result<Vec<u16>> {
    let (of_a, of_b) = (&a.dofs.names, &b.dofs.names);
    if of_a.len() == 1 && of_b.len() == 1 {
        return Ok(vec![0]);
    }
    let find = |name: &String| {
        let found = of_a.iter().position(|known| known == name);
        found.map(|k| k as u16).ok_or_else(|| {
            let what = format!(
                "its dofs are of {}, and those of {} of {}",
                of_b.join(", "),
                a.name,
                of_a.join(", ")
            );
            Error::engine(&b.name, what, "name the fields alike in both tables")
        })
    };
    of_b.iter().map(find).collect()
}

/// The factor by which the direction d is a multiple of e; `None` if they are not parallel.
fn ratio(d: [f64; 3], e: [f64; 3]) -> Option<f64> {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (both, dd, ee) = (dot(d, e), dot(d, d), dot(e, e));
    let is_parallel = both.abs() >= (1.0 - PARALLEL) * (dd * ee).sqrt();
    let ratio = both / ee;
    // A rounded scaling of 1 is 1.
    let plain = if (ratio.abs() - 1.0).abs() < 1e-9 {
        ratio.signum()
    } else {
        ratio
    };
    (is_parallel && ratio != 0.0).then_some(plain)
}

fn shown(system: &System, dof: usize) -> String {
    let (at, d) = (system.dofs.at[dof], system.dofs.direction[dof]);
    let name = &system.dofs.names[usize::from(system.dofs.field[dof])];
    format!(
        "dof {dof} of {name} at ({}, {}, {}) along ({}, {}, {})",
        at[0], at[1], at[2], d[0], d[1], d[2]
    )
}

fn unmatched(a: &System, b: &System, dof: usize) -> Error {
    let what = format!("{} has no partner in {}", shown(b, dof), a.name);
    let remedy =
        "use the same mesh and spaces in both codes, and check the places in the table of dofs";
    Error::engine(&b.name, what, remedy)
}

fn ambiguous(a: &System, b: &System, dof: usize) -> Error {
    let what = format!(
        "{} has several partners in {}, or shares one with another dof",
        shown(b, dof),
        a.name
    );
    let remedy = "give component or dx, dy, dz for each dof of a vector field; dofs of a broken space that share a place cannot be told apart";
    Error::engine(&b.name, what, remedy)
}
