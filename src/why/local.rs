//! Finds local changes: values on Γ_D, and the contact status.

use super::dictionary::Entry;
use super::place::Spot;
use super::search::{Search, weighted};
use super::{Aspect, Explanation, Rank};
use crate::run::Datum;
use crate::text::{Number, text};
use faceoff_fem::contact::Term;

/// Faults on more contact faces are not explained by one or two of them.
const MOST_FACES: usize = 8;
/// Up to this number of points of a face, all combinations of their statuses are tried.
const MOST_POINTS: usize = 10;

/// Replaces g by the values of u on Γ_D where they differ.
pub(super) fn values_held(search: &Search) -> Option<Entry> {
    let is_off = |dof: &usize| {
        search.problem.dirichlet[*dof].is_some() && search.errors[*dof] > search.limit
    };
    let off: Vec<usize> = (0..search.u.len()).filter(is_off).collect();
    let first = *off.first()?;
    let mut left = search.wanted();
    off.iter().for_each(|dof| left[*dof] = 0.0);
    let spot = |dof: &usize| Spot::of_dof(&search.problem, *dof, search.errors[*dof]);
    let at: Vec<Spot> = off.iter().map(spot).collect();
    let all = search.problem.dirichlet.given().count();
    let found = |brief| Explanation {
        term: Some(Term::Dirichlet),
        ..Explanation::new(Aspect::Datum(Datum::G), brief, Rank::Places, 0.0)
    };
    let found = match (&off[..], search.problem.dirichlet[first]) {
        ([_], Some(g)) => {
            let [u, g] = [search.u[first], g].map(Number::exact);
            let brief = text!("u is {}, not g = {}", u, g);
            let more = text!(", on {}", at[0].words());
            Explanation {
                at,
                ..found(brief).more(more)
            }
        }
        _ => {
            let brief = text!("u is not g at {} of {} dofs on Γ_D", off.len(), all);
            let more = text!(", {}", Spot::list(&at));
            Explanation {
                at,
                ..found(brief).more(more)
            }
        }
    };
    Some(Entry::known(left, found))
}

/// The statuses with which the linear scheme has this field: those of a last step of Newton's method,
/// although they were not yet those of u.
pub(super) fn status(search: &Search) -> Option<Entry> {
    let points = search.problem.by_status(search.u);
    let rows = |face: usize| points[face].first().map_or(&[][..], |of| &of[..]);
    let mut statuses = Statuses {
        search,
        residual: search.rows.residual.clone(),
        flipped: vec![0; points.len()],
        points: &points,
    };
    // The number of faces that each row depends on.
    let mut seen = vec![0_u32; search.u.len()];
    for (row, _) in (0..points.len()).flat_map(rows) {
        seen[*row as usize] += 1;
    }
    let is_off = |row: u32| search.errors[row as usize] > search.limit;
    let failing = |face: &usize| {
        points[*face].len() <= MOST_POINTS && rows(*face).iter().any(|(row, _)| is_off(*row))
    };
    let faces: Vec<usize> = (0..points.len()).filter(failing).collect();
    // First by the rows that only depend on one face, then by all, one face after the other until nothing changes.
    let is_own = |row: u32| seen[row as usize] == 1;
    for face in &faces {
        statuses.choose(*face, &is_own);
    }
    for _ in 0..SWEEPS {
        let changed = faces.iter().map(|face| statuses.choose(*face, &|_| true));
        if changed.filter(|changed| *changed).count() == 0 {
            break;
        }
    }
    let Statuses {
        residual, flipped, ..
    } = statuses;
    let spot = |face: usize| {
        Spot::of_face(
            &search.problem,
            search.problem.contact[face].face,
            &search.errors,
        )
    };
    let faces: Vec<Spot> = (0..points.len())
        .filter(|face| flipped[*face] != 0)
        .map(spot)
        .collect();
    if faces.is_empty() {
        return None;
    }
    let flips: u32 = flipped.iter().map(|subset| subset.count_ones()).sum();
    let left = weighted(&residual, &search.rows.scale)
        .iter()
        .map(|row| -row)
        .collect();
    let noun = if flips == 1 { "point" } else { "points" };
    let brief = text!("the contact status is the other one at {} {}", flips, noun);
    let more = text!(
        " of {}, as when contact lags by an iteration",
        Spot::list(&faces)
    );
    let found = Explanation {
        term: Some(Term::Contact),
        at: faces,
        ..Explanation::new(Aspect::Status, brief, Rank::Statuses, 0.0).more(more)
    };
    Some(Entry::known(left, found))
}

/// The contribution of a functional at each point to the rows, relative to their sizes, for each contact face with a row that fails; `None` if such faces
/// are many, or if the law has no functionals.
pub(super) fn functionals(search: &Search) -> Option<Vec<Vec<Vec<f64>>>> {
    let points = search.problem.by_status(search.u);
    let is_failing = |face: &&Vec<Vec<(u32, f64)>>| {
        let mut rows = face.iter().flatten();
        rows.any(|(row, _)| search.errors[*row as usize] > search.limit)
    };
    let failing: Vec<_> = points.iter().filter(is_failing).collect();
    let dense = |point: &Vec<(u32, f64)>| {
        let mut rows = vec![0.0; search.u.len()];
        for (row, value) in point {
            rows[*row as usize] = *value;
        }
        weighted(&rows, &search.rows.scale)
    };
    let is_few = !points.is_empty() && failing.len() <= MOST_FACES;
    is_few.then(|| {
        failing
            .iter()
            .map(|face| face.iter().map(dense).collect())
            .collect()
    })
}

/// The number of sweeps over the faces, since they share rows.
const SWEEPS: usize = 20;

/// A status for each point, and the residual with them.
struct Statuses<'a> {
    search: &'a Search<'a>,
    /// By face and point, as in [`faceoff_fem::contact::Problem::by_status`].
    points: &'a [Vec<Vec<(u32, f64)>>],
    /// One bit per point, set if its status is the other one.
    flipped: Vec<usize>,
    residual: Vec<f64>,
}

impl Statuses<'_> {
    /// Gives the points of a face the statuses with the smallest residual in those of its rows that count; returns whether any changed.
    fn choose(&mut self, face: usize, counts: &dyn Fn(u32) -> bool) -> bool {
        let points = &self.points[face];
        let before = std::mem::take(&mut self.flipped[face]);
        self.flip(face, before, -1.0);
        let rows = points.first().map_or(&[][..], |of| &of[..]);
        let left = |subset: usize| -> f64 {
            let of_row = |(k, (row, _)): (usize, &(u32, f64))| {
                let flipped = (0..points.len()).filter(|q| subset >> q & 1 == 1);
                let now =
                    self.residual[*row as usize] + flipped.map(|q| points[q][k].1).sum::<f64>();
                (now / self.search.rows.scale[*row as usize]).powi(2)
            };
            let rows = rows.iter().enumerate();
            rows.filter(|(_, (row, _))| counts(*row)).map(of_row).sum()
        };
        let all = 0..1_usize << points.len();
        let best = all
            .min_by(|a, b| left(*a).total_cmp(&left(*b)))
            .unwrap_or(0);
        self.flipped[face] = best;
        self.flip(face, best, 1.0);
        best != before
    }

    /// Adds to the residual a multiple of the change by a subset of points.
    fn flip(&mut self, face: usize, subset: usize, times: f64) {
        let points = self.points[face].iter().enumerate();
        let of_subset = points.filter(|(q, _)| subset >> q & 1 == 1);
        for (row, change) in of_subset.flat_map(|(_, point)| point) {
            self.residual[*row as usize] += times * change;
        }
    }
}
