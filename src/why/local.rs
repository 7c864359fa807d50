//! What may be otherwise at some places: values on Γ_D, and the contact status.

use super::place::Spot;
use super::search::Search;
use super::{Explanation, Rank};
use faceoff_fem::contact::Term;

/// So many points of a face have their statuses tried, in all combinations.
const MOST_POINTS: usize = 10;

/// Takes the values on Γ_D for g where they are not.
pub(super) fn values_held(search: &mut Search) -> Option<Explanation> {
    let is_off = |dof: &usize| {
        search.problem.dirichlet[*dof].is_some() && search.errors[*dof] > search.limit
    };
    let off: Vec<usize> = (0..search.u.len()).filter(is_off).collect();
    let first = *off.first()?;
    let kept = search.problem.dirichlet.clone();
    for dof in &off {
        search.problem.dirichlet[*dof] = Some(search.u[*dof]);
    }
    let left = search.problem.backward_error(search.u).0;
    search.problem.dirichlet = kept;
    let spot = |dof: &usize| Spot::of_dof(&search.problem, *dof, search.errors[*dof]);
    let at: Vec<Spot> = off.iter().map(spot).collect();
    let all = search.problem.dirichlet.iter().flatten().count();
    let what = match (&off[..], search.problem.dirichlet[first]) {
        ([_], Some(g)) => {
            let u = search.u[first];
            format!("u is {u}, not g = {g}, on {}", at[0].words())
        }
        _ => format!(
            "u is not g at {} of {all} dofs on Γ_D, {}",
            off.len(),
            Spot::list(&at)
        ),
    };
    Some(Explanation {
        term: Some(Term::Dirichlet),
        at,
        ..Explanation::new("g", what, Rank::Places, left)
    })
}

/// The statuses with which the linear scheme has this field: those of a step of Newton's method that was the last one,
/// although they were not yet those of u.
pub(super) fn status(search: &Search) -> Option<Explanation> {
    let by_face = search.problem.by_status(search.u);
    let mut residual = search.rows.residual.clone();
    // How many faces see a row.
    let mut seen = vec![0_u32; residual.len()];
    for (row, _) in by_face.iter().filter_map(|points| points.first()).flatten() {
        seen[*row as usize] += 1;
    }
    let (mut flips, mut faces) = (0, Vec::new());
    for (face, points) in by_face.iter().enumerate() {
        let is_off = |row: u32| search.errors[row as usize] > search.limit;
        let rows = points.first().map_or(&[][..], |of| &of[..]);
        if points.len() > MOST_POINTS || !rows.iter().any(|(row, _)| is_off(*row)) {
            continue;
        }
        // By its own rows; only the residual as a whole tells whether it is right.
        let own: Vec<usize> = (0..rows.len()).filter(|k| seen[rows[*k].0 as usize] == 1).collect();
        let left = |subset: usize| -> f64 {
            let of_row = |k: &usize| {
                let flipped = (0..points.len()).filter(|q| subset >> q & 1 == 1);
                let row = rows[*k].0 as usize;
                let now = residual[row] + flipped.map(|q| points[q][*k].1).sum::<f64>();
                now.abs() / search.rows.scale[row]
            };
            own.iter().map(of_row).fold(0.0, f64::max)
        };
        let best = (0..1_usize << points.len()).min_by(|a, b| left(*a).total_cmp(&left(*b)))?;
        for point in (0..points.len()).filter(|q| best >> q & 1 == 1) {
            flips += 1;
            for (row, change) in &points[point] {
                residual[*row as usize] += change;
            }
        }
        if best != 0 {
            let face = search.problem.contact[face].face;
            faces.push(Spot::of_face(&search.problem, face, &search.errors));
        }
    }
    if faces.is_empty() {
        return None;
    }
    let errors = residual.iter().zip(&search.rows.scale);
    let left = errors.map(|(r, scale)| if *r == 0.0 { 0.0 } else { r.abs() / scale });
    let points = if flips == 1 { "point" } else { "points" };
    Some(Explanation {
        term: Some(Term::Contact),
        what: format!(
            "contact lags by an iteration: at {flips} {points} of {} it has the status of the step before, so that the \
             iteration stopped too early",
            Spot::list(&faces)
        ),
        at: faces,
        ..Explanation::new(
            "the contact status",
            String::new(),
            Rank::Statuses,
            left.fold(0.0, f64::max),
        )
    })
}
