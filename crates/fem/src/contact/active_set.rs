//! Which contact conditions are in contact: the active set, and how it is changed.
//!
//! With a status for each condition the scheme is linear, max(u-ψ, γ∂ₙu) being u-ψ in contact and
//! γ∂ₙu where separated. Its solution u may contradict a status: P(u) > 0 in contact, P(u) < 0
//! where separated. To turn all of these over is a step of Newton; it nearly always ends, but may
//! cycle. In x = max - (u-ψ) ≥ 0 and y = max - γ∂ₙu ≥ 0, x·y = 0, the scheme is the linear
//! complementarity problem y = Mx + c, in which the principal minor of a set S of conditions is
//! det(A + N with S separated) / det(A + N with all in contact). So M is a P-matrix, and there is
//! exactly one solution, where the symmetric part of A + N is definite for every status:
//!
//! - θ = (1, 1) on every element: a point adds γ⁻¹uv + u∂ₙv - v∂ₙu in contact, γ∂ₙu∂ₙv separated;
//! - penalty, multiplier (γ₀ < 1/4) and variational inequality, which are symmetric;
//! - θ = (1, 0) on CR with one status a face: by the rows of `scheme` it is the complementarity of
//!   face means and fluxes on the stiffness condensed onto Γ_C, which is SPD.
//!
//! For a P-matrix the least-index rule ends whatever the start (K. G. Murty, Opsearch 11, 1974), and
//! it stays finite where it only steps in when turning all over has not lowered the number of
//! violations for a while (J. J. Júdice, F. M. Pires, Comput. Oper. Res. 21, 1994). On CR with
//! θ = (1, 0) and several points on a face there is no proof: the status by faces comes first, so
//! that Newton starts from its solution. Finite is not short where γ is far from h: after a dozen steps
//! [`super::continuation`] leads there from γ₀ = 1, and least indices come last.

use std::ops::Range;

use super::condition::Condition;
use super::iteration::Iteration;
use super::system::{System, Weights};

/// How often all violations are turned over without their number going down.
const TRIALS: usize = 5;

/// P is rounding below this many units of the sizes of its terms.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The unit that has one status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Per {
    /// All conditions of a face; for conditions at the points of faces.
    Face,
    Condition,
}

pub(super) struct ActiveSet {
    /// Conditions that share a status, one after the other.
    groups: Vec<Range<usize>>,
    /// In contact? Of each condition.
    contact: Vec<bool>,
    rule: BlockPivot,
    /// Did the last change leave violations standing?
    partial: bool,
}

/// How many of the violations are turned over, the first ones of an order that never changes.
struct BlockPivot {
    /// The smallest number of violations so far.
    fewest: usize,
    trials: usize,
}

impl BlockPivot {
    fn new() -> Self {
        BlockPivot {
            fewest: usize::MAX,
            trials: TRIALS,
        }
    }

    /// All, as long as that helps; then only the first, until there are fewer than ever before.
    fn count(&mut self, violations: usize) -> usize {
        if violations < self.fewest {
            (self.fewest, self.trials) = (violations, TRIALS);
        } else if self.trials > 0 {
            self.trials -= 1;
        } else {
            return violations.min(1);
        }
        violations
    }
}

impl ActiveSet {
    /// Contact where P(u) ≤ 0, and on all of a part of the domain that nothing else holds.
    pub fn new(scheme: &dyn System, u: &[f64], per: Per) -> Self {
        let conditions = scheme.conditions();
        let groups = match per {
            Per::Condition => (0..conditions.len()).map(|k| k..k + 1).collect(),
            Per::Face => faces(conditions),
        };
        let mut set = ActiveSet {
            contact: vec![false; conditions.len()],
            rule: BlockPivot::new(),
            partial: false,
            groups,
        };
        for k in 0..set.groups.len() {
            let (p, _) = set.p(scheme, u, k);
            set.turn(k, p <= 0.0);
        }
        for part in set.floating(scheme) {
            set.partial = true;
            for (contact, condition) in set.contact.iter_mut().zip(conditions) {
                *contact |= part_of(scheme, condition) == Some(part);
            }
        }
        set
    }

    /// Whether violations remain after the last change, so that a small step means little.
    pub fn is_partial(&self) -> bool {
        self.partial
    }

    /// The conditions that have another status than in `other`.
    pub fn differing(&self, other: &ActiveSet) -> Vec<usize> {
        let pairs = self.contact.iter().zip(&other.contact).enumerate();
        pairs.filter(|(_, (a, b))| a != b).map(|(k, _)| k).collect()
    }

    /// The same set with the other status of some conditions.
    pub fn with_turned(&self, conditions: impl IntoIterator<Item = usize>) -> ActiveSet {
        let mut contact = self.contact.clone();
        conditions
            .into_iter()
            .for_each(|k| contact[k] = !contact[k]);
        ActiveSet {
            groups: self.groups.clone(),
            contact,
            rule: BlockPivot::new(),
            partial: false,
        }
    }

    /// Takes the sign of P(u) as it is; the number of conditions that change.
    pub fn follow(&mut self, scheme: &dyn System, u: &[f64]) -> usize {
        let mut changes = 0;
        for (contact, condition) in self.contact.iter_mut().zip(scheme.conditions()) {
            let now = condition.trace(u).p <= 0.0;
            changes += usize::from(std::mem::replace(contact, now) != now);
        }
        changes
    }

    /// Turns over what u, the solution for this set, violates beyond rounding: all of it, or by the
    /// least-index rule the first. The number of conditions that change.
    pub fn pivot(&mut self, scheme: &dyn System, u: &[f64]) -> usize {
        let before = self.contact.clone();
        let violated = self.violated(scheme, u);
        let turned = self.rule.count(violated.len());
        self.partial = turned < violated.len();
        for &k in violated.iter().take(turned) {
            self.turn(k, !self.contact[self.groups[k].start]);
        }
        // Without contact such a part would have no solution: what is nearest to it stays, and u is
        // none either as long as that is against the sign of P.
        for part in self.floating(scheme) {
            let gaps = (0..self.groups.len())
                .filter(|&k| {
                    part_of(scheme, &scheme.conditions()[self.groups[k].start]) == Some(part)
                })
                .map(|k| (k, self.p(scheme, u, k).0));
            if let Some((k, _)) = gaps.min_by(|a, b| a.1.total_cmp(&b.1)) {
                let (p, rounding) = self.p(scheme, u, k);
                self.partial |= p > rounding;
                self.turn(k, true);
            }
        }
        let pairs = before.iter().zip(&self.contact);
        pairs.filter(|(a, b)| a != b).count()
    }

    /// The groups whose status u contradicts beyond rounding.
    pub fn violated(&self, scheme: &dyn System, u: &[f64]) -> Vec<usize> {
        let is_violated = |k: &usize| {
            let (p, rounding) = self.p(scheme, u, *k);
            if self.contact[self.groups[*k].start] {
                p > rounding
            } else {
                p < -rounding
            }
        };
        (0..self.groups.len()).filter(is_violated).collect()
    }

    /// (α, β) of each condition: the law of its status. A row that has a whole face is divided by
    /// h_F in contact, by γ where separated, so that it is of the size of the stiffness.
    pub fn laws(&self, scheme: &dyn System, iteration: Iteration) -> Vec<Weights> {
        let laws = self.contact.iter().zip(self.scales(scheme));
        laws.map(|(&contact, scale)| iteration.law(contact).map(|weight| scale * weight))
            .collect()
    }

    /// Makes the residual of the scheme that of the rows that [`ActiveSet::laws`] belong to.
    pub fn scale_rows(&self, scheme: &dyn System, r: &mut [f64]) {
        let scales = self.scales(scheme);
        for points in faces(scheme.conditions()) {
            let condition = &scheme.conditions()[points.start];
            if let Some(row) = condition.row {
                r[condition.dofs[row.local] as usize] *= scales[points.start];
            }
        }
    }

    /// 1/(a h_F + (1-a) γ) with the part a of F in contact; 1 for unchanged rows.
    fn scales(&self, scheme: &dyn System) -> Vec<f64> {
        let mut scales = vec![1.0; self.contact.len()];
        for points in faces(scheme.conditions()) {
            let Condition { gamma, row, .. } = scheme.conditions()[points.start];
            let Some(row) = row else { continue };
            let weight = |k: &usize| scheme.conditions()[*k].weight;
            let contact: f64 = points
                .clone()
                .filter(|&k| self.contact[k])
                .map(|k| weight(&k))
                .sum();
            let part = contact / points.clone().map(|k| weight(&k)).sum::<f64>();
            scales[points].fill(1.0 / (part * row.height + (1.0 - part) * gamma));
        }
        scales
    }

    fn turn(&mut self, group: usize, contact: bool) {
        self.contact[self.groups[group].clone()].fill(contact);
    }

    /// The mean of P(u) over a group, and what of it is rounding. Where a face has one status h_F
    /// does for γ.
    fn p(&self, scheme: &dyn System, u: &[f64], group: usize) -> (f64, f64) {
        let (mut p, mut rounding, mut weight) = (0.0, 0.0, 0.0);
        for condition in &scheme.conditions()[self.groups[group].clone()] {
            let gamma = match condition.row {
                Some(row) if row.points == self.groups[group].len() => row.height,
                _ => condition.gamma,
            };
            let ([gap, flux], trace) = (condition.sizes(u), condition.trace(u));
            p += condition.weight * (gamma * trace.flux - trace.gap);
            rounding += condition.weight * ROUNDING * (gap + gamma * flux);
            weight += condition.weight;
        }
        (p / weight, rounding / weight)
    }

    /// The parts that neither Γ_D nor a contact of this set holds.
    fn floating(&self, scheme: &dyn System) -> Vec<u32> {
        let Some(parts) = scheme.floating() else {
            return Vec::new();
        };
        let mut floating: Vec<u32> = parts.iter().flatten().copied().collect();
        floating.sort_unstable();
        floating.dedup();
        let conditions = self.contact.iter().zip(scheme.conditions());
        for (_, condition) in conditions.filter(|(contact, _)| **contact) {
            if let Some(part) = part_of(scheme, condition) {
                floating.retain(|p| *p != part);
            }
        }
        floating
    }
}

/// The floating part of the domain that a condition belongs to.
fn part_of(scheme: &dyn System, condition: &Condition) -> Option<u32> {
    scheme.floating()?[condition.dofs[0] as usize]
}

/// The conditions that share a row, one after the other.
fn faces(conditions: &[Condition]) -> Vec<Range<usize>> {
    let mut faces = Vec::new();
    let mut start = 0;
    while let Some(condition) = conditions.get(start) {
        let end = start + condition.row.map_or(1, |row| row.points);
        faces.push(start..end);
        start = end;
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Violations of y = Mx + c ≥ 0, x ≥ 0, x·y = 0 where `basic` gives the x that are not 0; n = 3.
    fn violations(basic: [bool; 3], c: [f64; 3]) -> Vec<usize> {
        // Murty's circulant, a P-matrix; rows that are not basic state x = 0.
        let m = [[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]];
        let row = |i: usize, j: usize| {
            if basic[i] {
                m[i][j]
            } else {
                f64::from(u8::from(i == j))
            }
        };
        let matrix = nalgebra::Matrix3::from_fn(row);
        let rhs = nalgebra::Vector3::from_fn(|i, _| if basic[i] { -c[i] } else { 0.0 });
        let x = matrix.lu().solve(&rhs).unwrap();
        let y = |i: usize| (0..3).map(|j| m[i][j] * x[j]).sum::<f64>() + c[i];
        let violated = |&i: &usize| {
            if basic[i] {
                x[i] < -1e-12
            } else {
                y(i) < -1e-12
            }
        };
        (0..3).filter(violated).collect()
    }

    fn turned(mut basic: [bool; 3], which: &[usize]) -> [bool; 3] {
        which.iter().for_each(|&i| basic[i] = !basic[i]);
        basic
    }

    #[test]
    fn the_rule_ends_where_turning_all_over_cycles() {
        let c = [-1.0; 3];
        let starts: Vec<[bool; 3]> = (0..8)
            .map(|bits: u8| [0, 1, 2].map(|i| bits >> i & 1 == 1))
            .collect();
        let cycles = |start: &[bool; 3]| {
            let end = (0..64).fold(*start, |basic, _| turned(basic, &violations(basic, c)));
            !violations(end, c).is_empty()
        };
        assert!(
            starts.iter().any(cycles),
            "nothing cycles: nothing is tested"
        );
        for start in starts {
            let (mut basic, mut rule, mut steps) = (start, BlockPivot::new(), 0);
            loop {
                let violated = violations(basic, c);
                if violated.is_empty() {
                    break;
                }
                basic = turned(basic, &violated[..rule.count(violated.len())]);
                steps += 1;
                assert!(steps < 40, "{start:?}");
            }
        }
    }
}
