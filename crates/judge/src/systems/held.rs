//! Recognises constrained rows, however a code keeps them: as rows of the identity, by a penalty on the diagonal, or eliminated.

use serde::Serialize;

use super::groups::Where;
use super::matrix::Matrix;

/// A diagonal entry is a penalty if it exceeds all other entries of its row by this factor.
const PENALTY: f64 = 1e10;

/// How a row states the value of its dof.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kept {
    /// It only has a diagonal entry.
    Identity,
    /// Its diagonal entry outweighs all others.
    Penalty,
    /// It is not in the system.
    Eliminated,
}

/// Constrained rows of two systems.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Constrained {
    /// Rows that are constrained in both.
    pub both: usize,
    /// How the first and the second system keep them.
    pub kept: [Vec<Kept>; 2],
    /// Rows that only the first, and only the second, constrains.
    pub only: [usize; 2],
    /// The places of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only_where: Option<Where>,
    /// Rows that both constrain, to different values.
    pub values: usize,
    /// The places of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values_where: Option<Where>,
    /// The largest such difference, relative to the largest value of both.
    pub largest: f64,
    /// The values of the second system divided by those of the first, if that is one factor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
}

/// A row whose dof is prescribed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    pub kept: Kept,
    /// The value; `None` if the row was eliminated.
    pub value: Option<f64>,
}

/// What a row looks like without the other system.
enum Look {
    Coupled,
    Alone(f64),
    Penalised(f64),
    Empty,
}

/// The constrained rows of both systems, which have one numbering; a row that is not in the second one was eliminated there.
///
/// `one` is the number that a 1 on the diagonal of the second system has become by the scaling of its dofs. A row that only has a diagonal entry states a value if that entry is 1 or the same row is coupled in the other system; otherwise it may be a row of a mass matrix.
pub fn held(
    a: (&Matrix, &[f64]),
    b: (&Matrix, &[f64]),
    is_in_both: &[bool],
    one: &[f64],
) -> [Vec<Option<Held>>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    for row in 0..is_in_both.len() {
        let looks = [look(a.0, row), look(b.0, row)];
        let is_coupled =
            [&looks[1], &looks[0]].map(|other| !matches!(other, Look::Alone(_) | Look::Empty));
        for (k, (look, load)) in looks.into_iter().zip([a.1, b.1]).enumerate() {
            let value = |diagonal: f64| Some(load[row] / diagonal);
            let of = |kept, value| Some(Held { kept, value });
            all[k].push(match look {
                _ if k == 1 && !is_in_both[row] => of(Kept::Eliminated, None),
                Look::Alone(diagonal) if diagonal == [1.0, one[row]][k] || is_coupled[k] => {
                    of(Kept::Identity, value(diagonal))
                }
                Look::Penalised(diagonal) => of(Kept::Penalty, value(diagonal)),
                Look::Alone(_) | Look::Coupled | Look::Empty => None,
            });
        }
    }
    all
}

fn look(matrix: &Matrix, row: usize) -> Look {
    let (mut diagonal, mut most) = (0.0, 0.0f64);
    for (column, a) in matrix.row(row) {
        match column == row {
            true => diagonal = a,
            false => most = most.max(a.abs()),
        }
    }
    match (diagonal, most) {
        (0.0, 0.0) => Look::Empty,
        (_, 0.0) if diagonal.abs() > 1e25 => Look::Penalised(diagonal),
        (_, 0.0) => Look::Alone(diagonal),
        _ if diagonal.abs() > PENALTY * most => Look::Penalised(diagonal),
        _ => Look::Coupled,
    }
}
