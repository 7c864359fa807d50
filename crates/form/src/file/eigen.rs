//! `[eigen]` of a form file: a, m, and which eigenvalues are requested.

use faceoff_mesh::error::Result;

use super::{Entry, File, Value};
use crate::eigen::is_not_symmetric;
use crate::language::Formula;
use crate::problem::{Eigen, Problem};

/// The most eigenvalues of a request.
const MOST: usize = 50;

/// The request of an eigenproblem, with the values of a and m in the file.
pub(super) struct Given<'a> {
    pub eigen: Eigen,
    pub mass: &'a Value<'a>,
    at: usize,
}

impl<'a> File<'a> {
    /// The keys in addition to a and the degrees, for a file with these tables.
    pub(super) fn eigen(
        &self,
        entry: &Entry<'a>,
        keys: &[Entry<'a>],
        tables: &[Entry<'a>],
    ) -> Result<Given<'a>> {
        for key in ["time", "initial", "mean", "fields", "numbers"] {
            if let Some(entry) = tables.iter().find(|entry| entry.key == key) {
                let what = format!("an eigenproblem has no [{key}]");
                let remedy =
                    "leave it out; [spectra.NAME] says how eigenvalues and modes are compared";
                return Err(self.refuse(entry.place.start, what, remedy));
            }
        }
        let at = entry.place.start;
        let find = |key: &str| keys.iter().find(|entry| entry.key == key);
        let mass = find("m").ok_or_else(|| {
            let remedy = "add m = \"…\", as in m = \"u*v*dx\": a(u, v) = λ m(u, v) is solved";
            self.refuse(at, "the eigenproblem has no m", remedy)
        })?;
        let count = find("count").ok_or_else(|| {
            let remedy = "add count = 6, the number of eigenvalues that are compared";
            self.refuse(
                at,
                "the eigenproblem does not say how many eigenvalues it is about",
                remedy,
            )
        })?;
        let number = |value: &Value<'a>| {
            let text = value.get_ref().as_integer()?;
            text.as_str()
                .parse()
                .ok()
                .filter(|n| (1..=MOST).contains(n))
        };
        let eigen = Eigen {
            mass: self.formula(mass.value)?,
            count: number(count.value).ok_or_else(|| {
                let what = "count is not a number of eigenvalues";
                let remedy = format!("give an integer from 1 to {MOST}");
                self.refuse(count.value.span().start, what, remedy)
            })?,
            shift: match find("shift") {
                None => 0.0,
                Some(entry) => self.number(entry.value).ok_or_else(|| {
                    let what = "shift is not a finite number";
                    let remedy = "give the number that the eigenvalues are to be near";
                    self.refuse(entry.value.span().start, what, remedy)
                })?,
            },
        };
        Ok(Given {
            eigen,
            mass: mass.value,
            at,
        })
    }

    /// Restrictions on eigenproblems, and requirements on a and m.
    pub(super) fn check_eigen(
        &self,
        tables: &[Entry<'a>],
        problem: &mut Problem,
        stiffness: &Value<'_>,
        given: &Given<'_>,
    ) -> Result<()> {
        let refuse = |at: usize, what: &str, remedy: &str| Err(self.refuse(at, what, remedy));
        if problem.unknowns.len() > 1 {
            let what = "an eigenproblem is of one unknown, and there are several";
            return refuse(given.at, what, "keep one space, which may be of vectors");
        }
        if let Some(entry) = tables.iter().find(|entry| entry.key == "dirichlet")
            && !problem
                .conditions
                .iter()
                .all(|c| problem.scalars.is_zero(c.value))
        {
            let what = "a Dirichlet value of an eigenproblem is not 0";
            return refuse(
                entry.place.start,
                what,
                "give 0: modes vanish where they are held",
            );
        }
        let value = |is_mass: bool| if is_mass { given.mass } else { stiffness };
        let source = |problem: &Problem, is_mass: bool| -> Formula {
            match &problem.eigen {
                Some(eigen) if is_mass => eigen.mass.clone(),
                _ => problem.form.clone(),
            }
        };
        for integral in problem.integrals.clone() {
            if problem.is_bilinear(&integral) {
                continue;
            }
            let formula = source(problem, integral.is_mass);
            let at = self.inside(value(integral.is_mass), &formula.source, integral.at);
            let what = "this integral is not linear in the unknown";
            return refuse(
                at,
                what,
                "give a and m that are linear in u and in v: loads have no place in an eigenproblem",
            );
        }
        for (is_mass, name) in [(false, "a"), (true, "m")] {
            if !problem
                .integrals
                .iter()
                .any(|i| i.is_mass == is_mass && !i.terms.is_empty())
            {
                let what = format!("{name} is 0");
                return refuse(value(is_mass).span().start, &what, "give a form of u and v");
            }
        }
        if let Some(wrong) = is_not_symmetric(problem) {
            let formula = source(problem, wrong.is_mass);
            let at = self.inside(value(wrong.is_mass), &formula.source, wrong.at);
            let what = "the integrals over this measure change where u and v are exchanged";
            return refuse(
                at,
                what,
                "give symmetric forms: eigenvalues of others may be complex, and are not found",
            );
        }
        Ok(())
    }
}
