//! Eigenproblems: u and λ with a(u, v) = λ m(u, v) for all test functions v, both forms symmetric.

use crate::problem::{Integral, Problem};
use crate::scalar::{Field, Leaf};
use crate::swap;

/// Draws of random values that show whether a form is symmetric.
const DRAWS: u64 = 8;
/// Differences below this fraction of the larger are rounding.
const ROUNDING: f64 = 1e-9;

impl Problem {
    /// The equation of an eigenvalue and its mode: the form a(u, v) - λ m(u, v), linear in u. The factor λ is not in the texts of its terms.
    pub fn pencil(&self, value: f64) -> Problem {
        let mut problem = self.clone();
        let Some(eigen) = problem.eigen.take() else {
            return problem;
        };
        let Problem {
            integrals,
            scalars,
            form,
            ..
        } = &mut problem;
        let start = format!("{} - ", form.source.trim_end());
        let factor = scalars.number(-value);
        for integral in integrals.iter_mut().filter(|integral| integral.is_mass) {
            integral.is_mass = false;
            integral.at += start.chars().count();
            for coefficient in integral.terms.values_mut() {
                *coefficient = scalars.multiply(factor, *coefficient);
            }
        }
        form.source = start + &eigen.mass.source;
        problem
    }
}

/// The first integral of an eigenproblem over whose measure a, or m, changes if u and v are interchanged.
pub(crate) fn is_not_symmetric(problem: &mut Problem) -> Option<Integral> {
    let sums = problem.residual();
    let differs = |problem: &mut Problem, sum: &Integral| {
        let by = problem.derivative(sum);
        let exchanged = |(test, increment): &(Leaf, Leaf)| {
            let to = |leaf: &Leaf, is_test: bool| Leaf {
                field: match (leaf.field, is_test) {
                    (Field::Increment(k), true) => Field::Test(k),
                    (Field::Test(k), false) => Field::Increment(k),
                    (other, _) => other,
                },
                ..*leaf
            };
            (to(increment, true), to(test, false))
        };
        (0..DRAWS).any(|seed| {
            let of = |node| swap::random(problem, seed, node, false);
            let value = |key: &(Leaf, Leaf)| {
                by.get(key)
                    .map_or(0.0, |id| problem.scalars.value(*id, &of))
            };
            by.keys().any(|key| {
                let [x, y] = [value(key), value(&exchanged(key))];
                (x - y).abs() > ROUNDING * x.abs().max(y.abs())
            })
        })
    };
    let wrong = sums.into_iter().find(|sum| differs(problem, sum))?;
    let is_it = |integral: &&Integral| {
        (&integral.measure, integral.is_mass) == (&wrong.measure, wrong.is_mass)
    };
    problem.integrals.iter().find(is_it).cloned()
}
