//! Finds the γ of each contact face that would explain a field.

use serde::Serialize;

use super::dictionary::{Entry, times};
use super::place::Spot;
use super::search::{Search, left_in};
use super::{Aspect, Explanation, Rank};
use crate::text::text;
use faceoff_fem::contact::{Problem, Term};
use faceoff_form::judge::recovery::largest;

const STEPS: usize = 12;
/// The most Gauss–Seidel sweeps, which are needed because faces that share a cell or a vertex share rows.
const SWEEPS: usize = 200;
/// If a relative change of γ changes the residual by less than this multiple of rounding, γ cannot be determined.
const SAY: f64 = 1e3;

/// The ratio of the γ that fits on a contact face to the γ of the scheme.
#[derive(Debug, Clone, Serialize)]
pub struct FaceGamma {
    /// The vertices of the face, ascending.
    pub vertices: Vec<u32>,
    /// Its centroid, with one coordinate per dimension of the mesh.
    pub midpoint: Vec<f64>,
    /// `None` if γ does not enter: in contact, or for methods without a penalty.
    pub factor: Option<f64>,
    /// The uncertainty from rounding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertain: Option<f64>,
}

/// γ of each contact face by least squares over the rows j of its cell,
///
/// ```text
/// δγ_F = -Σ_j r_j c_j / Σ_j c_j²,   c_j = ∂R_j/∂γ_F, for (3.2) Σ_q w [P > 0] ∂ₙu ∂ₙφ_j
/// ```
///
/// one face after the other until nothing changes, since faces share rows.
pub(super) fn by_face(problem: &Problem, u: &[f64], limit: f64) -> Vec<FaceGamma> {
    // In units of the rows.
    let rows = problem.rows(u);
    let scaled = |row: u32, value: f64| value / rows.scale[row as usize];
    let mut columns = problem.by_gamma(u);
    for (row, c) in columns.iter_mut().flatten() {
        *c = scaled(*row, *c);
    }
    let residual = rows.residual.iter().zip(&rows.scale);
    let mut left: Vec<f64> = residual
        .map(|(r, scale)| if *r == 0.0 { 0.0 } else { r / scale })
        .collect();
    let mut change = vec![0.0; columns.len()];
    let squares: Vec<f64> = columns
        .iter()
        .map(|column| column.iter().map(|(_, c)| c * c).sum())
        .collect();
    // The largest change of the residual, relative to its rows, under a change of γ as a whole.
    let say = |face: usize| {
        let of = columns[face].iter();
        of.map(|(_, c)| (c * problem.contact[face].gamma).abs())
            .fold(0.0, f64::max)
    };
    let says: Vec<f64> = (0..columns.len()).map(say).collect();
    let has_say = |face: usize| says[face] > SAY * limit && squares[face] > 0.0;
    for _ in 0..SWEEPS {
        let mut moved = false;
        for (face, column) in columns.iter().enumerate().filter(|(f, _)| has_say(*f)) {
            let at = column.iter();
            let above: f64 = at.map(|(row, c)| left[*row as usize] * c).sum();
            let by = -above / squares[face];
            for (row, c) in column {
                left[*row as usize] += by * c;
            }
            change[face] += by;
            moved |= by.abs() > f64::EPSILON * problem.contact[face].gamma;
        }
        if !moved {
            break;
        }
    }
    let mesh = problem.space.mesh;
    let faces = problem.contact.iter().enumerate();
    let faces = faces.take(columns.len());
    faces
        .map(|(k, face)| FaceGamma {
            vertices: mesh.face(face.face).to_vec(),
            midpoint: mesh.face_midpoint(face.face)[..mesh.dim].to_vec(),
            factor: has_say(k).then(|| 1.0 + change[k] / face.gamma),
            uncertain: has_say(k).then(|| limit / says[k]),
        })
        .collect()
}

/// The faces on which γ differs, each with its factor.
pub(super) fn at_faces(search: &mut Search, gammas: &[FaceGamma]) -> Option<Entry> {
    let asked: Vec<f64> = search.problem.contact.iter().map(|f| f.gamma).collect();
    let mut factors = vec![1.0; asked.len()];
    let mut best = (f64::INFINITY, factors.clone(), Vec::new());
    let mut of_faces = gammas.to_vec();
    let with_say = gammas.iter().filter(|g| g.factor.is_some()).count();
    // The status at its points, and γ⁻¹, change with γ.
    for _ in 0..STEPS {
        for (factor, of) in factors.iter_mut().zip(&of_faces) {
            let uncertain = of.uncertain.unwrap_or(0.0);
            if let Some(more) = of.factor.filter(|f| (f - 1.0).abs() > 10.0 * uncertain) {
                *factor *= more.clamp(0.1, 10.0);
            }
        }
        let gamma: Vec<f64> = asked.iter().zip(&factors).map(|(g, f)| g * f).collect();
        search.problem.set_gamma(&gamma);
        let left = left_in(&search.problem, search.u);
        let now = largest(&left);
        if !(now < best.0) {
            break;
        }
        best = (now, factors.clone(), left);
        if now <= search.limit {
            break;
        }
        of_faces = by_face(&search.problem, search.u, search.limit);
    }
    search.problem.set_gamma(&asked);
    let (_, factors, left) = best;
    let mut off: Vec<usize> = (0..asked.len()).filter(|k| factors[*k] != 1.0).collect();
    off.sort_by(|a, b| {
        (factors[*b] - 1.0)
            .abs()
            .total_cmp(&(factors[*a] - 1.0).abs())
    });
    let first = factors[*off.first()?];
    let contact = &search.problem.contact;
    let spot = |k: &usize| Spot::of_face(&search.problem, contact[*k].face, &search.errors);
    let at: Vec<Spot> = off.iter().map(spot).collect();
    let last = factors[*off.last()?];
    let how_much = match (first - last).abs() <= 1e-6 * (first - 1.0).abs() {
        true => times(first),
        false => text!("{} to {}", times(first), times(last)),
    };
    let rank = match off.len() <= 3.max(with_say / 4) {
        true => Rank::Places,
        false => Rank::Many,
    };
    let found = Explanation {
        term: Some(Term::Contact),
        factor: (off.len() == 1).then_some(first),
        ..Explanation::new(Aspect::Gamma, text!("γ is {}", how_much), rank, 0.0).on(at)
    };
    Some(Entry::known(left, found))
}
