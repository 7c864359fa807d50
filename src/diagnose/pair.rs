//! One pair in one case, run again and again.

use super::{BADLY_CONDITIONED, Diagnosis, Ingredient};
use crate::engine::{Case, Engine, Progress, Settings, Silent, interrupted};
use crate::verify::{CaseOutcome, RESIDUAL_TOLERANCE, Request, tolerance};
use faceoff_fem::contact::{Discretisation, Method, Problem, face_fields, solve_by};
use faceoff_fem::linear::{self, Precision, Solver};
use faceoff_fem::quadrature;
use faceoff_fem::scene::{Data, Expression, HRule, Scene};
use faceoff_judge::judge;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::FaceFields;
use faceoff_mesh::mesh::{Mesh, Triangulation};

/// Matches one ingredient and adds what is left.
type Step<'p> = fn(&Pair<'p>, &mut Vec<Ingredient>) -> Result<()>;

/// Two engines, and the case in which they differ.
pub(super) struct Pair<'a> {
    settings: &'a Settings,
    case: &'a CaseOutcome,
    scene: &'a Scene,
    discretisation: Discretisation,
    mesh: Triangulation,
    engines: [&'a dyn Engine; 2],
    answers: [&'a FaceFields; 2],
    /// Those that the Rust engine does not come to with the scene as it is: one of them, or both.
    strange: Vec<&'a FaceFields>,
}

impl<'a> Pair<'a> {
    pub fn new(
        request: &'a Request,
        case: &'a CaseOutcome,
        scene: &'a Scene,
        method: Method,
        names: [&str; 2],
    ) -> Result<Option<Self>> {
        let engine = |name: &str| request.engines.iter().find(|e| e.name() == name);
        let answer = |name: &str| case.fields.iter().find(|f| f.source == name);
        let ([Some(a), Some(b)], [Some(of_a), Some(of_b)]) = (names.map(engine), names.map(answer))
        else {
            return Ok(None);
        };
        let mut pair = Pair {
            settings: &request.settings,
            case,
            scene,
            discretisation: Discretisation::of(scene, method),
            mesh: scene.triangulation(case.n)?,
            engines: [&**a, &**b],
            answers: [of_a, of_b],
            strange: Vec::new(),
        };
        let Some(own) = pair.rust(&pair.discretisation, request.settings.linear) else {
            return Ok(None);
        };
        let same = |answer: &FaceFields| distance(&own, answer) <= tolerance(&method);
        pair.strange = pair.answers.into_iter().filter(|a| !same(a)).collect();
        Ok(Some(pair))
    }

    pub fn diagnose(&self) -> Result<Diagnosis> {
        let mut ingredients = Vec::new();
        let steps: [Step<'a>; 7] = [
            Self::load,
            Self::contact_quadrature,
            Self::gamma,
            Self::stop,
            Self::start,
            Self::mesh_order,
            Self::linear_solver,
        ];
        for step in steps {
            if interrupted() {
                return Err(Error::Interrupted);
            }
            step(self, &mut ingredients)?;
        }
        ingredients.sort_by_key(|i| !i.accounts);
        let [a, b] = self.answers;
        Ok(Diagnosis {
            scene: self.case.scene.clone(),
            method: self.case.method.clone(),
            n: self.case.n,
            a: a.source.clone(),
            b: b.source.clone(),
            difference: distance(a, b),
            ingredients,
        })
    }

    fn found(&self, ingredient: &str, matched: String, left: f64) -> Ingredient {
        Ingredient {
            ingredient: ingredient.into(),
            matched,
            left,
            accounts: left <= tolerance(&self.discretisation.method),
        }
    }

    /// With what one of the codes has, if it is what accounts for the difference.
    fn found_of(&self, ingredient: &str, what: &str, who: &str, left: f64) -> Ingredient {
        let mut found = self.found(ingredient, String::new(), left);
        let seems = if found.accounts {
            "seems"
        } else {
            "does not seem"
        };
        found.matched = format!("{what}, which {who} {seems} to use");
        found
    }

    /// How far the Rust engine by another discretisation is from a strange answer, and whose that is: the nearest.
    fn nearest_to(&self, changed: &Discretisation) -> Option<(&str, f64)> {
        let fields = self.rust(changed, self.settings.linear)?;
        let sides = self.strange.iter();
        let sides = sides.map(|answer| (&*answer.source, distance(&fields, answer)));
        sides.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// What the Rust engine answers by another discretisation on the same mesh.
    fn rust(&self, by: &Discretisation, linear: linear::Settings) -> Option<FaceFields> {
        let problem = Problem::new(self.scene, &self.mesh, by).ok()?;
        let settings = self.settings;
        let told = |_, _| Ok(());
        let solution = solve_by(&problem, settings.iteration, settings.stop, linear, told).ok()?;
        Some(face_fields(&problem, &solution.u, "rust again"))
    }

    /// Does the residual of a strange answer reach beyond the contact cells? Then more than Γ_C is at fault.
    fn reaches_inside(&self) -> Result<bool> {
        let problem = Problem::new(self.scene, &self.mesh, &self.discretisation)?;
        let mut at_contact = vec![false; problem.space.dofs];
        for face in &problem.contact {
            let dofs = problem.space.cell_dofs(face.cell);
            dofs.iter().for_each(|dof| at_contact[*dof as usize] = true);
        }
        let of = |name: &str| self.case.engines.iter().find(|e| e.engine == name);
        let mut engines = self.strange.iter().filter_map(|answer| of(&answer.source));
        Ok(engines.any(|engine| {
            let residual = problem.residual(&engine.u);
            let largest = |inside: bool| {
                let rows = residual.iter().zip(&at_contact);
                let rows = rows.filter(|(_, at)| !inside || !**at);
                rows.fold(0.0, |m: f64, (r, _)| m.max(r.abs()))
            };
            largest(true) > 1e-3 * largest(false)
        }))
    }

    /// What is left when both engines run again; none where one of them does not answer.
    fn again(&self, scene: &Scene, mesh: &Triangulation, settings: &Settings) -> Option<f64> {
        let problem = Problem::new(scene, mesh, &self.discretisation).ok()?;
        let cases = [Case {
            n: self.case.n,
            problem,
        }];
        let answers = self.engines.map(|engine| {
            let run = engine
                .run(&cases, settings, &Silent as &dyn Progress)
                .ok()?;
            let answer = run.answers.into_iter().next()?;
            Some(face_fields(&cases[0].problem, &answer.u, engine.name()))
        });
        let [Some(a), Some(b)] = answers else {
            return None;
        };
        Some(distance(&a, &b))
    }

    /// Every other rule, and a load that every rule integrates exactly.
    fn load(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        const NAME: &str = "the quadrature of the load";
        let own = self.discretisation.rules(self.mesh.dim)?[0].name;
        for rule in quadrature::names(self.mesh.dim)
            .iter()
            .filter(|r| **r != own)
        {
            let mut changed = self.discretisation.clone();
            changed.load_quadrature = Some((*rule).into());
            if let Some((who, left)) = self.nearest_to(&changed) {
                ingredients.push(self.found_of(NAME, rule, who, left));
            }
        }
        if !self.reaches_inside()? {
            return Ok(());
        }
        let scene = self.scene.with_data(Data {
            f: Expression::constant(-1.0),
            t: Expression::constant(0.0),
            ..self.scene.data().clone()
        });
        if let Some(left) = self.again(&scene, &self.mesh, self.settings) {
            let matched = "a constant f and no t in both codes".into();
            ingredients.push(self.found(NAME, matched, left));
        }
        Ok(())
    }

    fn contact_quadrature(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        let own = self.discretisation.rules(self.mesh.dim)?[1].name;
        for rule in quadrature::names(self.mesh.dim - 1)
            .iter()
            .filter(|r| **r != own)
        {
            let mut changed = self.discretisation.clone();
            changed.contact_quadrature = Some((*rule).into());
            if let Some((who, left)) = self.nearest_to(&changed) {
                ingredients.push(self.found_of("the quadrature on Γ_C", rule, who, left));
            }
        }
        Ok(())
    }

    /// The other meaning of h, and the γ₀ that fits best.
    fn gamma(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        const NAME: &str = "γ = γ₀ h";
        let mut changed = self.discretisation.clone();
        let h;
        (changed.h, h) = match changed.h {
            HRule::Local => (HRule::Global, "global"),
            HRule::Global => (HRule::Local, "local"),
        };
        if let Some((who, left)) = self.nearest_to(&changed) {
            ingredients.push(self.found_of(NAME, &format!("{h} h"), who, left));
        }
        for answer in &self.strange {
            if let Some((gamma0, left)) = self.fit_gamma(answer) {
                let matched = format!("γ₀ = {gamma0:.12}");
                ingredients.push(self.found_of(NAME, &matched, &answer.source, left));
            }
        }
        Ok(())
    }

    /// γ₀ by Gauss and Newton: the least squares of the face means, with the derivative in log γ₀ by differences.
    fn fit_gamma(&self, answer: &FaceFields) -> Option<(f64, f64)> {
        let mut fitted = self.discretisation.clone();
        let mut best: Option<(f64, f64)> = None;
        for _ in 0..8 {
            let here = self.rust(&fitted, self.settings.linear)?;
            let left = distance(&here, answer);
            if best.is_none_or(|(_, other)| left < other) {
                best = Some((fitted.gamma0, left));
            }
            let step = 1e-4;
            let mut beside = fitted.clone();
            beside.gamma0 *= 1.0 + step;
            let beside = self.rust(&beside, self.settings.linear)?;
            let means = |f: &FaceFields| f.column("mean").map(|c| c.values.clone());
            let (x, y, z) = (means(&here)?, means(&beside)?, means(answer)?);
            let (mut above, mut below) = (0.0, 0.0);
            for ((x, y), z) in x.iter().zip(y).zip(z) {
                let slope = (y - x) / step;
                above += slope * (z - x);
                below += slope * slope;
            }
            let factor = (above / below).clamp(-0.9, 10.0);
            if !factor.is_finite() || factor.abs() < 1e-15 {
                break;
            }
            fitted.gamma0 *= 1.0 + factor;
        }
        // The scene's own γ₀ is no other.
        best.filter(|(gamma0, _)| *gamma0 != self.discretisation.gamma0)
    }

    fn stop(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        let mut settings = self.settings.clone();
        settings.stop.increment = 1e-14_f64.min(0.01 * settings.stop.increment);
        settings.stop.max_iterations *= 4;
        settings.keep = None;
        if let Some(left) = self.again(self.scene, &self.mesh, &settings) {
            let matched = format!("increments of at most {:e}", settings.stop.increment);
            ingredients.push(self.found("the tolerance", matched, left));
        }
        Ok(())
    }

    fn start(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        let problem = Problem::new(self.scene, &self.mesh, &self.discretisation)?;
        let of = |name: &str| self.case.engines.iter().find(|e| e.engine == name);
        let residuals = self.answers.map(|answer| {
            of(&answer.source).map_or(f64::INFINITY, |e| problem.backward_error(&e.u).0)
        });
        let [a, b] = self.answers;
        let judged = judge(a, b, tolerance(&self.discretisation.method))?;
        let flips = judged.iter().find_map(|field| field.flips).unwrap_or(0);
        let (matched, left) = start_decides(residuals, flips, distance(a, b));
        ingredients.push(self.found("the start", matched.into(), left));
        Ok(())
    }

    fn mesh_order(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        let (name, mut mesh) = self.scene.mesh(self.case.n)?;
        reverse_cells(&mut mesh);
        let mesh = Triangulation::new(&name, &mesh)?;
        let settings = Settings {
            keep: None,
            ..self.settings.clone()
        };
        if let Some(left) = self.again(self.scene, &mesh, &settings) {
            let matched = "the cells in reverse order for both codes".into();
            ingredients.push(self.found("the order of the mesh", matched, left));
        }
        Ok(())
    }

    fn linear_solver(&self, ingredients: &mut Vec<Ingredient>) -> Result<()> {
        for solver in [Solver::Faer, Solver::Multifrontal] {
            let linear = linear::Settings {
                solver,
                precision: Precision::F64,
            };
            if let Some((who, left)) = self.nearest_to_other(linear) {
                let matched = format!("{solver} in the Rust engine, against {who}");
                ingredients.push(self.found("the linear solver", matched, left));
            }
        }
        Ok(())
    }

    /// The Rust engine with another linear solver beside the answers of the others.
    fn nearest_to_other(&self, linear: linear::Settings) -> Option<(&str, f64)> {
        if !self.answers.iter().any(|a| a.source == "rust") {
            return None;
        }
        let fields = self.rust(&self.discretisation, linear)?;
        let other = self.answers.iter().find(|a| a.source != "rust")?;
        Some((&other.source, distance(&fields, other)))
    }
}

/// What is left when both codes start from either answer. Of two solutions the start decides which is found; but as the
/// scheme is linear while no point of Γ_C changes its status, two of them differ there. Answers with the same status are
/// one solution of one linear system, told apart by rounding alone.
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
fn distance(a: &FaceFields, b: &FaceFields) -> f64 {
    let judged = judge(a, b, 1.0).unwrap_or_default();
    let values = judged.iter().filter(|f| f.field != "status");
    let largest = values.map(|f| {
        if f.max_rel.is_nan() {
            f64::INFINITY
        } else {
            f.max_rel
        }
    });
    largest.reduce(f64::max).unwrap_or(f64::INFINITY)
}

/// Each block's cells in reverse order, and the groups with them.
fn reverse_cells(mesh: &mut Mesh) {
    let mut start = 0;
    let mut moved: Vec<u32> = Vec::with_capacity(mesh.cell_count());
    for block in &mut mesh.blocks {
        let (count, points) = (block.len() as u32, block.kind.points());
        let nodes = block.nodes.chunks_exact(points).rev().flatten();
        block.nodes = nodes.copied().collect();
        block.tags.reverse();
        block.entities.reverse();
        moved.extend((0..count).rev().map(|k| start + k));
        start += count;
    }
    for group in &mut mesh.groups {
        group
            .cells
            .iter_mut()
            .for_each(|cell| *cell = moved[*cell as usize]);
        group.cells.sort_unstable();
    }
    mesh.fields.clear();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_decides_only_between_two_solutions() {
        let of = |residuals, flips| start_decides(residuals, flips, 1e-3).1;
        assert_eq!(of([1e-16, 3e-15], 2), 3e-15);
        assert_eq!(of([1e-16, 3e-15], 0), 1e-3);
        assert_eq!(of([1e-16, 1e-9], 2), 1e-3);
        assert_eq!(of([f64::NAN, 1e-16], 2), 1e-3);
        assert_eq!(of([1e-16, f64::NAN], 2), 1e-3);
    }

    #[test]
    fn reversed_cells_keep_their_groups() {
        let scene = Scene::find("one-zone").unwrap();
        let (name, mut mesh) = scene.mesh(Some(4)).unwrap();
        let before = Triangulation::new(&name, &mesh).unwrap();
        reverse_cells(&mut mesh);
        let after = Triangulation::new(&name, &mesh).unwrap();
        assert_ne!(before.cell(0), after.cell(0));
        let parts = |mesh: &Triangulation| {
            let mut parts: Vec<_> = (0..mesh.face_count())
                .map(|f| (mesh.face(f).to_vec(), scene.parts(mesh).unwrap()[f]))
                .collect();
            parts.sort_by(|a, b| a.0.cmp(&b.0));
            parts
        };
        assert_eq!(parts(&before), parts(&after));
    }
}
