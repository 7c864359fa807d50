//! The dofs that Γ_D holds.

use std::ops::Index;

use faceoff_mesh::parallel;

/// g at the dofs on Γ_D, a small part of all: indexed by dof, it is `None` elsewhere.
#[derive(Debug, Clone)]
pub struct Held {
    is_held: Vec<bool>,
    /// Those on Γ_D, ascending, and g there.
    dofs: Vec<u32>,
    values: Vec<Option<f64>>,
}

impl Held {
    /// Of `count` dofs these have given values; if a dof occurs several times, the last value counts.
    pub(super) fn new(count: usize, mut given: Vec<(u32, f64)>) -> Self {
        given.sort_by_key(|(dof, _)| *dof);
        let mut held = Held {
            is_held: vec![false; count],
            dofs: Vec::with_capacity(given.len()),
            values: Vec::with_capacity(given.len()),
        };
        for (dof, g) in given {
            if std::mem::replace(&mut held.is_held[dof as usize], true) {
                held.values.pop();
            } else {
                held.dofs.push(dof);
            }
            held.values.push(Some(g));
        }
        held
    }

    /// The number of dofs, constrained or not.
    pub fn len(&self) -> usize {
        self.is_held.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.is_held.is_empty()
    }

    /// Whether this dof is on Γ_D.
    pub fn holds(&self, dof: usize) -> bool {
        self.is_held[dof]
    }

    /// Gives a dof on Γ_D another value; one that is not there stays free.
    pub fn set(&mut self, dof: usize, g: f64) {
        if let Ok(place) = self.dofs.binary_search(&(dof as u32)) {
            self.values[place] = Some(g);
        }
    }

    /// The dofs on Γ_D, ascending, and g there.
    pub fn given(&self) -> impl Iterator<Item = (usize, f64)> {
        let values = self.values.iter().flatten();
        self.dofs
            .iter()
            .map(|dof| *dof as usize)
            .zip(values.copied())
    }

    /// The value of `of` for each dof, on all cores, by whether it is constrained.
    pub(super) fn map<T: Send>(&self, of: impl Fn(bool) -> T + Sync) -> Vec<T> {
        parallel::chunks(self.len(), 1 << 14, |chunk| {
            self.is_held[chunk].iter().map(|held| of(*held)).collect()
        })
    }

    /// Each dof, with g on Γ_D.
    pub fn iter(&self) -> impl Iterator<Item = &Option<f64>> {
        (0..self.len()).map(|dof| &self[dof])
    }
}

impl Index<usize> for Held {
    type Output = Option<f64>;

    fn index(&self, dof: usize) -> &Option<f64> {
        if !self.is_held[dof] {
            return &None;
        }
        let place = self.dofs.binary_search(&(dof as u32));
        &self.values[place.expect("invariant: what is held has a value")]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_has_its_value_and_nothing_else_does() {
        let mut held = Held::new(6, vec![(4, 1.5), (1, -2.0), (4, 0.0)]);
        let all: Vec<Option<f64>> = held.iter().copied().collect();
        assert_eq!(all, [None, Some(-2.0), None, None, Some(0.0), None]);
        let given: Vec<(usize, f64)> = held.given().collect();
        assert_eq!(given, [(1, -2.0), (4, 0.0)]);
        assert!((0..6).all(|dof| held.holds(dof) == all[dof].is_some()));
        assert_eq!(held.map(usize::from), [0, 1, 0, 0, 1, 0]);
        held.set(4, 7.0);
        held.set(5, 7.0);
        assert_eq!((held[4], held[5], held[1]), (Some(7.0), None, Some(-2.0)));
    }
}
