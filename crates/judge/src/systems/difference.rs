//! D = A - P B Pᵀ by rows and blocks, the difference of the right-hand sides, and each answer in the other's system.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Serialize;

use super::groups::{Where, located, members};
use super::held::{Constrained, Held, held};
use super::matching::{Matched, matched};
use super::matrix::Matrix;
use super::{Compared, Settings, System, probes};
use crate::Verdict;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::parallel;

/// Entries, loads and values that differ by at most this, relative to the size they are compared with, are equal, unless the caller sets another bound.
const RTOL: f64 = 1e-12;
/// A row whose entries are smaller than this fraction of the largest one of its block is compared with that fraction.
const SMALL: f64 = 0.1;
/// A row is loaded if its entry is larger than this fraction of the largest load.
const SUPPORT: f64 = 1e-9;
/// A factor, a symmetry or a number is common if it leaves at most this fraction of the difference, or rounding.
const COMMON: f64 = 1e-6;

/// The rows of one field and the columns of another.
#[derive(Debug, Clone, Serialize)]
pub struct Block {
    /// The field of the rows.
    pub of: String,
    /// The field of the columns.
    pub with: String,
    /// The largest difference of two entries, relative to the largest entry of its row in this block.
    pub largest: f64,
    /// The rows that differ.
    pub differs: Where,
    /// B divided by A, if that is one number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Is D symmetric? `None` unless the two fields are one and rows differ.
    pub symmetric: bool,
    /// Is D antisymmetric?
    pub skew: bool,
}

/// The right-hand sides in the rows of a field.
#[derive(Debug, Clone, Serialize)]
pub struct Loads {
    /// The field.
    pub of: String,
    /// The largest difference, relative to the largest load.
    pub largest: f64,
    /// The rows that differ.
    pub differs: Where,
    /// The second load divided by the first, if that is one number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Is each of these rows coupled to a constrained one, whose value enters through the matrix?
    pub constrained: bool,
    /// The rows where each of them is not 0.
    pub support: [Where; 2],
}

/// The largest row of A u - b relative to the sum of the absolute values of its terms, over the rows that are free in both.
#[derive(Debug, Clone, Serialize)]
pub struct Residuals {
    /// For each answer in its own system; above rounding if a solver stopped early.
    pub own: [f64; 2],
    /// For each answer in the other system.
    pub other: [f64; 2],
}

/// Two systems in the numbering and scaling of the one with more rows, which is the first.
#[derive(Debug, Clone)]
pub struct Both<'a> {
    /// The first system.
    pub a: &'a System,
    /// The second one, unchanged.
    pub b: &'a System,
    /// Both matrices.
    pub matrices: [Cow<'a, Matrix>; 2],
    /// Both right-hand sides.
    pub loads: [Vec<f64>; 2],
    /// The values of constrained rows.
    pub given: [Vec<f64>; 2],
    /// Rows that at least one system constrains.
    pub is_held: Vec<bool>,
    /// All others.
    pub free: Vec<usize>,
    matched: Matched,
    rows: [Vec<Option<Held>>; 2],
}

impl<'a> Both<'a> {
    /// Matches the rows of two systems, and finds those that are constrained.
    ///
    /// # Errors
    /// Dofs that cannot be matched; [`faceoff_mesh::Error::Ended`].
    pub fn new(a: &'a System, b: &'a System) -> Result<Self> {
        if b.dofs.at.len() > a.dofs.at.len() {
            return Both::new(b, a);
        }
        let matched = matched(a, b)?;
        let count = a.dofs.at.len();
        let load = spread(count, &matched.to, &b.load, |k, b| b / matched.scale[k]);
        let matrix = b.matrix.renumbered(count, &matched.to, &matched.scale);
        cancel::check()?;
        let one = spread(count, &matched.to, &matched.scale, |_, s| 1.0 / (s * s));
        let rows = held(
            (&a.matrix, &a.load),
            (&matrix, &load),
            &matched.is_in_both,
            &one,
        );
        let is_held: Vec<bool> = (0..count)
            .map(|k| rows.iter().any(|rows| rows[k].is_some()))
            .collect();
        Ok(Both {
            free: (0..count).filter(|row| !is_held[*row]).collect(),
            is_held,
            given: [0, 1].map(|k| given(&rows[k], &rows[1 - k])),
            matrices: [Cow::Borrowed(&a.matrix), Cow::Owned(matrix)],
            loads: [a.load.clone(), load],
            matched,
            rows,
            a,
            b,
        })
    }
}

/// Compares two systems.
///
/// # Errors
/// Dofs that cannot be matched; [`faceoff_mesh::Error::Ended`].
pub fn compare(a: &System, b: &System, settings: &Settings) -> Result<Compared> {
    Both::new(a, b)?.compare(settings)
}

impl Both<'_> {
    /// Compares them.
    ///
    /// # Errors
    /// [`faceoff_mesh::Error::Ended`].
    pub fn compare(&self, settings: &Settings) -> Result<Compared> {
        let Both { a, b, matched, .. } = self;
        let count = a.dofs.at.len();
        let values = b.dofs.values.as_ref();
        let values = values.map(|u| spread(count, &matched.to, u, |k, u| u * matched.scale[k]));
        let rtol = if settings.rtol > 0.0 {
            settings.rtol
        } else {
            RTOL
        };
        let regions = members(&settings.regions, &a.dofs.at)?;
        let place = |rows: &[usize], all: usize| located(rows, all, &a.dofs.at, &regions);
        let mut worst = vec![0.0f64; count];
        let constrained = constrained(self, rtol, &mut worst, &place);
        let matrix = blocks(self, rtol, &mut worst, &place)?;
        let load = loads(self, rtol, &mut worst, &place);
        let differs =
            matrix.iter().any(|b| b.differs.rows > 0) || load.iter().any(|l| l.differs.rows > 0);
        let is_same = !differs && constrained.only == [0, 0] && constrained.values == 0;
        let answers = a.dofs.values.as_ref().zip(values.as_ref());
        let shown = (0..count).filter(|row| worst[*row] > 0.0);
        Ok(Compared {
            verdict: if is_same {
                Verdict::Agree
            } else {
                Verdict::Disagree
            },
            dofs: matched.to.len(),
            rescaled: matched.scale.iter().filter(|s| **s != 1.0).count(),
            free: self.free.len(),
            constrained,
            matrix,
            load,
            kernels: probes::kernels(self),
            energies: settings
                .volume
                .map_or_else(Vec::new, |volume| probes::energies(self, volume)),
            residuals: answers.map(|(u, v)| residuals(self, u, v, &matched.is_in_both)),
            rows: shown.map(|row| (a.dofs.at[row], worst[row])).collect(),
            b: b.name.clone(),
            a: a.name.clone(),
        })
    }

    /// The product of a matrix with a vector that is 0 in constrained rows, and the sizes of its rows; 0 in constrained rows.
    pub fn times(&self, which: usize, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut product, mut size) = self.matrices[which].times(x);
        for row in (0..x.len()).filter(|row| self.is_held[*row]) {
            (product[row], size[row]) = (0.0, 0.0);
        }
        (product, size)
    }

    /// The right-hand side in a row without the contributions of constrained dofs, and its size.
    pub fn load(&self, which: usize, row: usize) -> (f64, f64) {
        let held = self.matrices[which]
            .row(row)
            .filter(|(column, _)| self.is_held[*column]);
        let terms = held.map(|(column, a)| a * self.given[which][column]);
        terms.fold((self.loads[which][row], 0.0), |(sum, size), term| {
            (sum - term, size + term.abs())
        })
    }

    /// The value of a constrained dof in a system: the one that this system states, or else that of the other one.
    pub fn held(&self, which: usize, row: usize) -> f64 {
        let value = |k: usize| self.rows[k][row].and_then(|held| held.value);
        value(which).or(value(1 - which)).unwrap_or(0.0)
    }

    /// Does a row have a constrained column in either system?
    fn is_touched(&self, row: usize) -> bool {
        self.matrices
            .iter()
            .any(|matrix| matrix.row(row).any(|(column, _)| self.is_held[column]))
    }
}

/// Values in the second numbering, moved to the first; 0 where there is none.
fn spread(count: usize, to: &[u32], values: &[f64], of: impl Fn(usize, f64) -> f64) -> Vec<f64> {
    let mut all = vec![0.0; count];
    for (k, (to, value)) in to.iter().zip(values).enumerate() {
        all[*to as usize] = of(k, *value);
    }
    all
}

/// The values that a system prescribes; where it does not, or has eliminated the dofs, those of the other system.
fn given(own: &[Option<Held>], other: &[Option<Held>]) -> Vec<f64> {
    let value = |row: &Option<Held>| row.and_then(|held| held.value);
    let both = own.iter().zip(other);
    both.map(|(own, other)| match own {
        // Its right-hand side contains the contributions of eliminated dofs, whose values are not in the file.
        Some(Held { value: None, .. }) => 0.0,
        own => value(own).or(value(other)).unwrap_or(0.0),
    })
    .collect()
}

fn constrained(
    both: &Both<'_>,
    rtol: f64,
    worst: &mut [f64],
    place: &dyn Fn(&[usize], usize) -> Where,
) -> Constrained {
    let mut found = Constrained::default();
    let (mut only, mut differ, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..both.is_held.len() {
        let held = [both.rows[0][k], both.rows[1][k]];
        for (kept, held) in found.kept.iter_mut().zip(held) {
            if let Some(held) = held.filter(|held| !kept.contains(&held.kept)) {
                kept.push(held.kept);
            }
        }
        match held {
            [Some(a), Some(b)] => {
                found.both += 1;
                pairs.extend(a.value.zip(b.value).map(|(a, b)| (k, a, b)));
            }
            [None, None] => continue,
            [a, _] => {
                found.only[usize::from(a.is_none())] += 1;
                // The full row.
                worst[k] = 1.0;
                only.push(k);
            }
        }
    }
    let most = pairs
        .iter()
        .fold(0.0f64, |most, (_, a, b)| most.max(a.abs()).max(b.abs()));
    for (k, a, b) in &pairs {
        let far = (a - b).abs();
        if far > rtol * most {
            differ.push(*k);
            worst[*k] = far / most;
            found.largest = found.largest.max(far / most);
        }
    }
    if !differ.is_empty() {
        let (ab, aa) = pairs
            .iter()
            .fold((0.0, 0.0), |(ab, aa), (_, a, b)| (ab + a * b, aa + a * a));
        let factor = ab / aa;
        found.factor = pairs
            .iter()
            .all(|(_, a, b)| (b - factor * a).abs() <= (COMMON * found.largest).max(rtol) * most)
            .then_some(factor);
        found.values_where = Some(place(&differ, both.is_held.len()));
    }
    found.values = differ.len();
    if !only.is_empty() {
        found.only_where = Some(place(&only, both.is_held.len()));
    }
    found
}

/// Two rows with common columns: the columns, and the entries of both, without constrained columns.
pub fn merged<'a>(both: &'a Both<'_>, row: usize) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
    let [a, b] = &both.matrices;
    let (mut a, mut b) = (a.row(row).peekable(), b.row(row).peekable());
    let all = std::iter::from_fn(move || match (a.peek().copied(), b.peek().copied()) {
        (Some((i, x)), Some((j, y))) if i == j => {
            a.next();
            b.next();
            Some((i, x, y))
        }
        (Some((i, x)), other) if other.is_none_or(|(j, _)| i < j) => a.next().map(|_| (i, x, 0.0)),
        (_, Some((j, y))) => b.next().map(|_| (j, 0.0, y)),
        (_, None) => None,
    });
    all.filter(|(column, ..)| !both.is_held[*column])
}

/// Sums over the rows of a block.
#[derive(Clone, Copy, Default)]
struct Sums {
    most: f64,
    ab: f64,
    aa: f64,
}

fn blocks(
    both: &Both<'_>,
    rtol: f64,
    worst: &mut [f64],
    place: &dyn Fn(&[usize], usize) -> Where,
) -> Result<Vec<Block>> {
    let field = |dof: usize| both.a.dofs.field[dof];
    let count = both.a.dofs.names.len();
    // For each row and each field of its columns: the largest entry, and the products.
    let of_row = |row: usize| {
        let mut sums = vec![Sums::default(); count];
        for (column, a, b) in merged(both, row) {
            let own = &mut sums[usize::from(field(column))];
            own.most = own.most.max(a.abs()).max(b.abs());
            (own.ab, own.aa) = (own.ab + a * b, own.aa + a * a);
        }
        sums
    };
    let mut all: BTreeMap<(u16, u16), Sums> = BTreeMap::new();
    let rows: Vec<Vec<Sums>> = parallel::collect(both.free.len(), |k| of_row(both.free[k]));
    for (row, sums) in both.free.iter().zip(&rows) {
        for (with, own) in (0..).zip(sums).filter(|(_, own)| own.most > 0.0) {
            let sum = all.entry((field(*row), with)).or_default();
            sum.most = sum.most.max(own.most);
            (sum.ab, sum.aa) = (sum.ab + own.ab, sum.aa + own.aa);
        }
    }
    let mut found = Vec::new();
    for ((of, with), sums) in all {
        cancel::check()?;
        let factor = if sums.aa > 0.0 {
            sums.ab / sums.aa
        } else {
            f64::NAN
        };
        // Relative to the size of the row: the difference, the remainder after the factor, and D plus and minus its transpose.
        let look = |k: usize| {
            let row = both.free[k];
            let size = rows[k][usize::from(with)].most.max(SMALL * sums.most);
            let mut left = [0.0f64; 4];
            if field(row) != of {
                return left;
            }
            for (_, a, b) in merged(both, row).filter(|(column, ..)| field(*column) == with) {
                left[0] = left[0].max((a - b).abs() / size);
                left[1] = left[1].max((b - factor * a).abs() / size);
            }
            if left[0] > rtol && of == with {
                for (column, a, b) in
                    merged(both, row).filter(|(column, ..)| field(*column) == with)
                {
                    let other =
                        both.matrices[0].entry(column, row) - both.matrices[1].entry(column, row);
                    left[2] = left[2].max((a - b - other).abs() / size);
                    left[3] = left[3].max((a - b + other).abs() / size);
                }
            }
            left
        };
        let left: Vec<[f64; 4]> = parallel::collect(both.free.len(), look);
        let most = |k: usize| left.iter().fold(0.0f64, |most, left| most.max(left[k]));
        let differ = (0..left.len()).filter(|k| left[*k][0] > rtol);
        let rows: Vec<usize> = differ.clone().map(|k| both.free[k]).collect();
        differ.for_each(|k| worst[both.free[k]] = worst[both.free[k]].max(left[k][0]));
        let possible = both.free.iter().filter(|row| field(**row) == of).count();
        let name = |k: u16| both.a.dofs.names[usize::from(k)].clone();
        let is_other = !rows.is_empty();
        let is_plain = |k: usize| is_other && of == with && most(k) <= (COMMON * most(0)).max(rtol);
        found.push(Block {
            of: name(of),
            with: name(with),
            largest: most(0),
            differs: place(&rows, possible),
            factor: (is_other && sums.aa > 0.0 && most(1) <= (COMMON * most(0)).max(rtol))
                .then_some(factor),
            symmetric: is_plain(2),
            skew: is_plain(3),
        });
    }
    Ok(found)
}

fn loads(
    both: &Both<'_>,
    rtol: f64,
    worst: &mut [f64],
    place: &dyn Fn(&[usize], usize) -> Where,
) -> Vec<Loads> {
    let names = both.a.dofs.names.iter().enumerate();
    names
        .map(|(field, name)| {
            let is_here = |row: &&usize| usize::from(both.a.dofs.field[**row]) == field;
            let rows: Vec<usize> = both.free.iter().filter(is_here).copied().collect();
            let values: Vec<([f64; 2], f64)> = parallel::collect(rows.len(), |k| {
                let [(a, size), (b, other)] = [0, 1].map(|which| both.load(which, rows[k]));
                ([a, b], size.max(other))
            });
            let most = values
                .iter()
                .fold(0.0f64, |most, ([a, b], _)| most.max(a.abs()).max(b.abs()));
            let far = |k: usize| {
                let ([a, b], size) = values[k];
                let all = most.max(size);
                if all > 0.0 { (a - b).abs() / all } else { 0.0 }
            };
            let differ: Vec<usize> = (0..rows.len()).filter(|k| far(*k) > rtol).collect();
            let (ab, aa) = values
                .iter()
                .fold((0.0, 0.0), |(ab, aa), ([a, b], _)| (ab + a * b, aa + a * a));
            let factor = ab / aa;
            let largest = (0..rows.len()).map(far).fold(0.0, f64::max);
            let is_common = values
                .iter()
                .all(|([a, b], _)| (b - factor * a).abs() <= (COMMON * largest).max(rtol) * most);
            differ
                .iter()
                .for_each(|k| worst[rows[*k]] = worst[rows[*k]].max(far(*k)));
            let support = |which: usize| {
                let there = (0..rows.len()).filter(|k| values[*k].0[which].abs() > SUPPORT * most);
                place(&there.map(|k| rows[k]).collect::<Vec<_>>(), rows.len())
            };
            let differing: Vec<usize> = differ.iter().map(|k| rows[*k]).collect();
            Loads {
                of: name.clone(),
                largest,
                constrained: !differing.is_empty()
                    && differing.iter().all(|row| both.is_touched(*row)),
                factor: (!differ.is_empty() && aa > 0.0 && is_common).then_some(factor),
                differs: place(&differing, rows.len()),
                support: [support(0), support(1)],
            }
        })
        .collect()
}

fn residuals(both: &Both<'_>, u: &[f64], v: &[f64], is_in_both: &[bool]) -> Residuals {
    // Dofs that the second system has eliminated have the values that the first one states.
    let v: Vec<f64> = (0..u.len())
        .map(|k| {
            if is_in_both[k] {
                v[k]
            } else {
                both.given[0][k]
            }
        })
        .collect();
    let left = |k: usize, x: &[f64]| {
        let (product, size) = both.matrices[k].times(x);
        let each = both.free.iter().map(|row| {
            let load = both.loads[k][*row];
            let size = size[*row] + load.abs();
            if size > 0.0 {
                (product[*row] - load).abs() / size
            } else {
                0.0
            }
        });
        each.fold(0.0, f64::max)
    };
    Residuals {
        own: [left(0, u), left(1, &v)],
        other: [left(1, u), left(0, &v)],
    }
}
