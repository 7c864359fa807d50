//! The search: the case again by the Rust engine with one thing changed at a time, then by both codes.

use std::cell::RefCell;

use super::{BADLY_CONDITIONED, Diagnosis, Ingredient, gamma};
use crate::engine::{self, Engine};
use crate::run::{Datum, RESIDUAL_TOLERANCE, Runner, Setup, Variation, tolerance};
use faceoff_fem::contact::{Law, Method, Nitsche, Problem, face_fields};
use faceoff_fem::linear::{self, Precision, Solver};
use faceoff_fem::quadrature;
use faceoff_fem::scene::HRule;
use faceoff_judge::judge;
use faceoff_mesh::cancel;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::FaceFields;

/// Two answers to a case that are not the same.
pub struct Search<'a> {
    runner: &'a Runner<'a>,
    setup: &'a Setup,
    problem: Problem<'a>,
    rust: Box<dyn Engine>,
    answers: [FaceFields; 2],
    /// u at all dofs.
    u: [&'a [f64]; 2],
    /// Those that the Rust engine does not come to with the setup as it is: one of them, or both.
    strange: Vec<usize>,
    own: FaceFields,
    found: RefCell<Vec<Ingredient>>,
}

impl<'a> Search<'a> {
    /// None where the Rust engine has no answer itself.
    ///
    /// # Errors
    /// An interruption; a setup that has no problem.
    pub fn new(
        runner: &'a Runner<'a>,
        setup: &'a Setup,
        answers: [(&str, &'a [f64]); 2],
    ) -> Result<Option<Self>> {
        let problem = setup.case()?.problem;
        let fields = answers.map(|(name, u)| face_fields(&problem, u, name));
        let mut search = Search {
            runner,
            setup,
            rust: engine::find(engine::OWN)?,
            own: fields[0].clone(),
            answers: fields,
            u: answers.map(|(_, u)| u),
            strange: Vec::new(),
            problem,
            found: RefCell::default(),
        };
        let Some(own) = search.rust(setup)? else {
            return Ok(None);
        };
        search.own = own;
        let same = |k: &usize| distance(&search.own, &search.answers[*k]) <= search.tolerance();
        search.strange = (0..2).filter(|k| !same(k)).collect();
        Ok(Some(search))
    }

    /// What the answers alone show: one thing at a time is changed in the Rust engine.
    ///
    /// # Errors
    /// An interruption.
    pub fn by_answers(self) -> Result<Self> {
        self.scale();
        for (ingredient, matched, variation) in candidates(self.setup) {
            cancel::check()?;
            if let Some((who, left)) = self.nearest_to(&variation)? {
                self.add(ingredient, matched, Some(who), left);
            }
        }
        if !self.found.borrow().iter().any(|i| i.accounts) {
            for &k in &self.strange {
                if let Some((gamma0, left)) = gamma::fit(&self, &self.answers[k])? {
                    self.add(GAMMA, format!("γ₀ = {gamma0:.12}"), Some(k), left);
                }
            }
        }
        Ok(self)
    }

    /// What shows only when both codes run again.
    ///
    /// # Errors
    /// An interruption.
    pub fn by_running(self, engines: [&dyn Engine; 2]) -> Result<Self> {
        let stop = self.setup.settings.stop;
        let increment = 1e-14_f64.min(0.01 * stop.increment);
        let small = format!("increments of at most {increment:e}");
        let reversed = "the cells in reverse order for both codes".to_owned();
        let mut again = vec![
            ("the tolerance", small, Variation::Increment(increment, 4)),
            ("the order of the mesh", reversed, Variation::CellsReversed),
        ];
        if self.reaches_inside() {
            let matched = "a constant f and no t in both codes";
            again.push((LOAD, matched.into(), Variation::ConstantLoad));
        }
        for (ingredient, matched, variation) in again {
            cancel::check()?;
            if let Some(left) = self.again(engines, &variation)? {
                self.add(ingredient, matched, None, left);
            }
        }
        self.start()?;
        self.linear_solver()?;
        Ok(self)
    }

    /// All that was found, what accounts for the difference first.
    pub fn diagnosis(self) -> Diagnosis {
        let mut ingredients = self.found.into_inner();
        ingredients.sort_by_key(|i| !i.accounts);
        let [a, b] = &self.answers;
        Diagnosis {
            scene: self.setup.scene.name().to_owned(),
            method: self.setup.discretisation.method.to_string(),
            n: self.setup.n,
            a: a.source.clone(),
            b: b.source.clone(),
            difference: distance(a, b),
            ingredients,
        }
    }

    pub(super) fn setup(&self) -> &Setup {
        self.setup
    }

    pub(super) fn tolerance(&self) -> f64 {
        tolerance(&self.setup.discretisation.method)
    }

    fn add(&self, ingredient: &str, matched: String, who: Option<usize>, left: f64) {
        self.found.borrow_mut().push(Ingredient {
            ingredient: ingredient.into(),
            matched,
            used_by: who.map(|k| self.answers[k].source.clone()),
            left,
            accounts: left <= self.tolerance(),
        });
    }

    /// What the Rust engine answers; none where there is nothing to be found.
    pub(super) fn rust(&self, setup: &Setup) -> Result<Option<FaceFields>> {
        let Ok(case) = setup.case() else {
            return Ok(None);
        };
        let answers = self.runner.each(&*self.rust, &[&case], &setup.settings)?;
        let answer = answers.into_iter().next().and_then(Result::ok);
        // By the scheme that was asked for, as the fields of the answers are.
        Ok(answer.map(|answer| face_fields(&self.problem, &answer.u, "rust again")))
    }

    /// How far the Rust engine with a variation is from the nearest strange answer, and which that is.
    fn nearest_to(&self, variation: &Variation) -> Result<Option<(usize, f64)>> {
        let Ok(setup) = self.setup.with(variation) else {
            return Ok(None);
        };
        let of = |fields: FaceFields| {
            let left = |k: &usize| (*k, distance(&fields, &self.answers[*k]));
            let all = self.strange.iter().map(left);
            all.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        Ok(self.rust(&setup)?.and_then(of))
    }

    /// u times a constant.
    fn scale(&self) {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let means = |f: &FaceFields| f.column("mean").map_or(vec![], |c| c.values.clone());
        let own = means(&self.own);
        for &k in &self.strange {
            let other = means(&self.answers[k]);
            let factor = dot(&other, &own) / dot(&own, &own);
            let largest = other.iter();
            let largest = largest.fold(f64::MIN_POSITIVE, |m: f64, v| m.max(v.abs()));
            let apart = other.iter().zip(&own);
            let apart = apart.fold(0.0, |m: f64, (a, b)| m.max((a - factor * b).abs()));
            let is_other = (factor - 1.0).abs() > 1e-6 && factor.abs() > 1e-6;
            if is_other && apart <= self.tolerance() * largest {
                let matched = format!("{factor:.6e} times what it should be");
                self.add("u", matched, Some(k), apart / largest);
            }
        }
    }

    /// Does the residual of a strange answer reach beyond the contact cells? Then more than Γ_C is at fault.
    fn reaches_inside(&self) -> bool {
        let problem = &self.problem;
        let mut at_contact = vec![false; problem.space.dofs];
        for face in &problem.contact {
            let dofs = problem.space.cell_dofs(face.cell);
            dofs.iter().for_each(|dof| at_contact[*dof as usize] = true);
        }
        self.strange.iter().any(|k| {
            let residual = problem.residual(self.u[*k]);
            let largest = |inside: bool| {
                let rows = residual.iter().zip(&at_contact);
                let rows = rows.filter(|(_, at)| !inside || !**at);
                rows.fold(0.0, |m: f64, (r, _)| m.max(r.abs()))
            };
            largest(true) > 1e-3 * largest(false)
        })
    }

    /// What is left when both engines run again; none where one of them does not answer.
    fn again(&self, engines: [&dyn Engine; 2], variation: &Variation) -> Result<Option<f64>> {
        let Ok(setup) = self.setup.with(variation) else {
            return Ok(None);
        };
        let Ok(case) = setup.case() else {
            return Ok(None);
        };
        let mut fields = Vec::new();
        for engine in engines {
            let answers = self.runner.each(engine, &[&case], &setup.settings)?;
            if let Some(Ok(answer)) = answers.into_iter().next() {
                fields.push(face_fields(&case.problem, &answer.u, engine.name()));
            }
        }
        let [a, b] = &fields[..] else {
            return Ok(None);
        };
        Ok(Some(distance(a, b)))
    }

    fn start(&self) -> Result<()> {
        let residuals = self.u.map(|u| self.problem.backward_error(u).0);
        let [a, b] = &self.answers;
        let judged = judge(a, b, self.tolerance())?;
        let flips = judged.iter().find_map(|field| field.flips).unwrap_or(0);
        let (matched, left) = start_decides(residuals, flips, distance(a, b));
        self.add("the start", matched.into(), None, left);
        Ok(())
    }

    /// The Rust engine with another linear solver beside the answer of the other.
    fn linear_solver(&self) -> Result<()> {
        let is_own = |k: &usize| self.answers[*k].source == self.rust.name();
        let (Some(_), Some(other)) = ((0..2).find(is_own), (0..2).find(|k| !is_own(k))) else {
            return Ok(());
        };
        for solver in [Solver::Faer, Solver::Multifrontal] {
            let linear = linear::Settings {
                solver,
                precision: Precision::F64,
            };
            let setup = self.setup.with(&Variation::Linear(linear))?;
            if let Some(fields) = self.rust(&setup)? {
                let other = &self.answers[other];
                let matched = format!("{solver} in the Rust engine, against {}", other.source);
                self.add("the linear solver", matched, None, distance(&fields, other));
            }
        }
        Ok(())
    }
}

const LOAD: &str = "the quadrature of the load";
const GAMMA: &str = "γ = γ₀ h";

/// Everything that a code may do otherwise: the ingredient, what it is then, and how the Rust engine does the same.
fn candidates(setup: &Setup) -> Vec<(&'static str, String, Variation)> {
    let (dim, discretisation) = (setup.mesh.dim, &setup.discretisation);
    let mut all = Vec::new();
    let mut add = |ingredient, matched: &str, variation| {
        all.push((ingredient, matched.to_owned(), variation));
    };
    if let Ok([load, contact]) = discretisation.rules(dim) {
        let others = |dim: usize, own: &'static str| {
            quadrature::names(dim)
                .iter()
                .filter(move |rule| **rule != own)
        };
        for rule in others(dim, load.name) {
            add(LOAD, rule, Variation::LoadRule((*rule).into()));
        }
        for rule in others(dim - 1, contact.name) {
            let variation = Variation::ContactRule((*rule).into());
            add("the quadrature on Γ_C", rule, variation);
        }
    }
    let (h, name) = match discretisation.h {
        HRule::Local => (HRule::Global, "global h"),
        HRule::Global => (HRule::Local, "local h"),
    };
    add(GAMMA, name, Variation::H(h));
    for datum in Datum::ALL {
        if !datum.of(setup.scene.data()).is_zero() {
            add(datum.name(), "the other sign", Variation::Negated(datum));
            add(datum.name(), "0 in its place", Variation::Zero(datum));
        }
    }
    for (i, k, names) in [
        (2, 1, "Γ_C and Γ_N swapped"),
        (2, 0, "Γ_C and Γ_D swapped"),
        (1, 0, "Γ_N and Γ_D swapped"),
    ] {
        add("the boundary", names, Variation::Swapped(i, k));
    }
    let method = discretisation.method;
    match method.law {
        Law::FluxCorrected => {
            let plain = Variation::Method(Method::cr());
            add("the flux", "no correction by the load", plain);
        }
        Law::Nitsche(Nitsche { theta1, theta2 }) => {
            for (a, b) in [(1, 0), (1, 1), (0, 1), (-1, 0), (-1, 1)] {
                if (a, b) != (theta1, theta2) {
                    let other = Variation::Method(Method::nitsche(method.element, a, b));
                    add("θ", &format!("θ₁ = {a} and θ₂ = {b}"), other);
                }
            }
            if method == Method::cr() {
                let corrected = Variation::Method(Method::cr_fc());
                add("the flux", "the correction by the load", corrected);
            }
        }
        _ => {}
    }
    all
}

/// What is left when both codes start from either answer. Of two solutions the start decides which is found; but as the
/// scheme is linear while no point of Γ_C changes its status, two of them differ there. Answers with the same status are
/// one solution of one linear system, which differ by rounding alone.
fn start_decides(residuals: [f64; 2], flips: usize, difference: f64) -> (&'static str, f64) {
    // Each by itself: the larger of a number and of what is none is the number.
    let solved = residuals.iter().all(|r| *r <= RESIDUAL_TOLERANCE);
    let residual = residuals[0].max(residuals[1]);
    match flips {
        _ if !solved => {
            let matched = "either answer, not both of which solve the scheme";
            (matched, difference)
        }
        0 => (BADLY_CONDITIONED, difference),
        _ => (
            "both answers in turn, which both solve the scheme",
            residual,
        ),
    }
}

/// The largest difference of any field by value, as the judge measures it; infinite where there is none.
pub(super) fn distance(a: &FaceFields, b: &FaceFields) -> f64 {
    let judged = judge(a, b, 1.0).unwrap_or_default();
    let values = judged.iter().filter(|f| f.field != "status");
    let largest = values.map(|f| match f.max_rel.is_nan() {
        true => f64::INFINITY,
        false => f.max_rel,
    });
    largest.reduce(f64::max).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::start_decides;

    #[test]
    fn the_start_decides_only_between_two_solutions() {
        let of = |residuals, flips| start_decides(residuals, flips, 1e-3).1;
        assert_eq!(of([1e-16, 3e-15], 2), 3e-15);
        assert_eq!(of([1e-16, 3e-15], 0), 1e-3);
        assert_eq!(of([1e-16, 1e-9], 2), 1e-3);
        assert_eq!(of([f64::NAN, 1e-16], 2), 1e-3);
        assert_eq!(of([1e-16, f64::NAN], 2), 1e-3);
    }
}
