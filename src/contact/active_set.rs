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
//! - θ = (1, 0) on CR with one status a face: by the rows of `conditions` it is equivalent to the
//!   complementarity of face means on the stiffness condensed onto Γ_C, which is SPD.
//!
//! For a P-matrix the least-index rule ends whatever the start (K. G. Murty, Opsearch 11, 1974), and
//! it stays finite where it only steps in when turning all over has not lowered the number of
//! violations for a while (J. J. Júdice, F. M. Pires, Comput. Oper. Res. 21, 1994). On CR with
//! θ = (1, 0) and several points on a face there is no proof: the status by faces comes first, so
//! that Newton starts from its solution.

use std::ops::Range;

use super::conditions::Condition;
use super::scheme::Scheme;

/// How often all violations are turned over without their number going down.
const TRIALS: usize = 10;

/// P is rounding below this many units of the sizes of its terms.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// What has one status.
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
    /// The smallest number of violations so far.
    fewest: usize,
    trials: usize,
    /// Did the last change leave violations standing?
    partial: bool,
}

impl ActiveSet {
    /// Contact where P(u) ≤ 0, and on all of a part of the domain that nothing else holds.
    pub fn new(scheme: &dyn Scheme, u: &[f64], per: Per) -> Self {
        let conditions = scheme.conditions();
        let sizes: Vec<usize> = match per {
            Per::Condition => vec![1; conditions.len()],
            Per::Face => scheme.points(),
        };
        let groups = sizes
            .iter()
            .scan(0, |end, size| {
                *end += size;
                Some(*end - size..*end)
            })
            .collect::<Vec<Range<usize>>>();
        let mut set = ActiveSet {
            contact: vec![false; conditions.len()],
            fewest: usize::MAX,
            trials: TRIALS,
            partial: false,
            groups,
        };
        for k in 0..set.groups.len() {
            let (p, _) = set.p(scheme, u, k);
            set.turn(k, p <= 0.0);
        }
        for part in set.floating(scheme) {
            for k in 0..conditions.len() {
                set.contact[k] |= part_of(scheme, &conditions[k]) == Some(part);
            }
        }
        set
    }

    pub fn contact(&self) -> &[bool] {
        &self.contact
    }

    /// Are there violations that the last change left standing, so that a small step means little?
    pub fn is_partial(&self) -> bool {
        self.partial
    }

    /// How many conditions have another status than in `other`.
    pub fn differs(&self, other: &ActiveSet) -> usize {
        let pairs = self.contact.iter().zip(&other.contact);
        pairs.filter(|(a, b)| a != b).count()
    }

    /// Takes the sign of P(u) as it is; the number of conditions that change.
    pub fn follow(&mut self, scheme: &dyn Scheme, u: &[f64]) -> usize {
        let mut changes = 0;
        for (contact, condition) in self.contact.iter_mut().zip(scheme.conditions()) {
            let now = condition.trace(u).p <= 0.0;
            changes += usize::from(std::mem::replace(contact, now) != now);
        }
        changes
    }

    /// Turns over what u, the solution for this set, violates beyond rounding: all of it, or by the
    /// least-index rule the first. The number of conditions that change.
    pub fn pivot(&mut self, scheme: &dyn Scheme, u: &[f64]) -> usize {
        let before = self.contact.clone();
        let violated: Vec<usize> = (0..self.groups.len())
            .filter(|&k| {
                let (p, rounding) = self.p(scheme, u, k);
                if self.contact[self.groups[k].start] {
                    p > rounding
                } else {
                    p < -rounding
                }
            })
            .collect();
        let all = if violated.len() < self.fewest {
            (self.fewest, self.trials) = (violated.len(), TRIALS);
            true
        } else {
            let left = self.trials > 0;
            self.trials = self.trials.saturating_sub(1);
            left
        };
        self.partial = !all && violated.len() > 1;
        let turned = if all { violated.len() } else { 1 };
        for &k in violated.iter().take(turned) {
            self.turn(k, !self.contact[self.groups[k].start]);
        }
        // Without contact such a part would have no solution: what is nearest to it stays.
        for part in self.floating(scheme) {
            let gaps = (0..self.groups.len())
                .filter(|&k| {
                    part_of(scheme, &scheme.conditions()[self.groups[k].start]) == Some(part)
                })
                .map(|k| (k, self.p(scheme, u, k).0));
            if let Some((k, _)) = gaps.min_by(|a, b| a.1.total_cmp(&b.1)) {
                self.turn(k, true);
            }
        }
        let pairs = before.iter().zip(&self.contact);
        pairs.filter(|(a, b)| a != b).count()
    }

    /// Makes the residual of the scheme, R(u), that of the linear scheme with this set.
    pub fn linear_residual(&self, scheme: &dyn Scheme, u: &[f64], r: &mut [f64]) {
        for (&contact, condition) in self.contact.iter().zip(scheme.conditions()) {
            let trace = condition.trace(u);
            if contact == (trace.p <= 0.0) {
                continue;
            }
            // Here the law takes the lesser of u-ψ and γ∂ₙu, and the scheme the greater.
            for (j, &dof) in condition.dofs.iter().enumerate() {
                r[dof as usize] -= condition.weight * trace.p.abs() * condition.test(j);
            }
        }
    }

    fn turn(&mut self, group: usize, contact: bool) {
        self.contact[self.groups[group].clone()].fill(contact);
    }

    /// The mean of P(u) over a group, and what of it is rounding.
    fn p(&self, scheme: &dyn Scheme, u: &[f64], group: usize) -> (f64, f64) {
        let (mut p, mut rounding, mut weight) = (0.0, 0.0, 0.0);
        for condition in &scheme.conditions()[self.groups[group].clone()] {
            let [gap, flux] = condition.sizes(u);
            p += condition.weight * condition.trace(u).p;
            rounding += condition.weight * ROUNDING * (gap + condition.gamma * flux);
            weight += condition.weight;
        }
        (p / weight, rounding / weight)
    }

    /// The parts that neither Γ_D nor a contact of this set holds.
    fn floating(&self, scheme: &dyn Scheme) -> Vec<u32> {
        let Some(parts) = scheme.floating() else {
            return Vec::new();
        };
        let mut floating: Vec<u32> = parts.iter().flatten().copied().collect();
        floating.sort_unstable();
        floating.dedup();
        for (_, condition) in self
            .contact
            .iter()
            .zip(scheme.conditions())
            .filter(|c| *c.0)
        {
            if let Some(part) = part_of(scheme, condition) {
                floating.retain(|p| *p != part);
            }
        }
        floating
    }
}

/// The floating part of the domain that a condition belongs to.
fn part_of(scheme: &dyn Scheme, condition: &Condition) -> Option<u32> {
    scheme.floating()?[condition.dofs[0] as usize]
}
