//! `--explain`: the model that was chosen, what was left out because the scene does not need it, and what was built.

use serde::Serialize;

use super::{Answer, Case, peak_memory_mb};
use crate::text::{Number, Text, text};
use faceoff_fem::contact::{Built, Law};
use faceoff_fem::linear::Choice;
use faceoff_fem::scene::Expression;

/// The components of a solve.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    dimension: usize,
    element: &'static str,
    dofs: usize,
    /// On Γ_D: given, not solved for.
    given: usize,
    /// Data that are 0 and do not enter.
    zero_data: Vec<&'static str>,
    /// Parts of the domain that only contact constrains.
    floats: bool,
    contact_faces: usize,
    /// Nonlinear conditions: one per quadrature point, face or vertex of Γ_C, depending on the method.
    conditions: usize,
    /// Contact faces with the whole of their quadrature points in contact, and with a part.
    in_contact: usize,
    partly_in_contact: usize,
    flux_corrected: bool,
    steps: usize,
    /// For the Rust engine.
    built: Option<Built>,
    linear: Option<Choice>,
    /// Whether the error was bounded.
    pub certificate: bool,
    /// The memory of this process so far, or of the largest that it ran.
    peak_rss_mb: f64,
}

impl Explanation {
    /// The explanation of an answer to a case, without a certificate.
    pub fn new(case: &Case, answer: &Answer) -> Self {
        let problem = &case.problem;
        let data = case.scene().data();
        let all: [(&'static str, &Expression); 4] = [
            ("f", &data.f),
            ("g", &data.g),
            ("t", &data.t),
            ("psi", &data.psi),
        ];
        let (mut whole, mut part) = (0, 0);
        for face in &problem.contact {
            let local = problem.space.local(face.cell, &answer.u);
            let points = face.points.iter();
            let touching = points
                .filter(|point| point.trace(face.gamma, &local).p <= 0.0)
                .count();
            whole += usize::from(touching == face.points.len());
            part += usize::from(touching > 0 && touching < face.points.len());
        }
        let history = answer.history.as_ref();
        Explanation {
            dimension: problem.space.mesh.dim,
            element: problem.space.element.name(),
            dofs: problem.space.dofs,
            given: problem.dirichlet.given().count(),
            zero_data: all
                .into_iter()
                .filter(|(_, e)| e.is_zero())
                .map(|(name, _)| name)
                .collect(),
            floats: problem.floating.is_some(),
            contact_faces: problem.contact.len(),
            conditions: problem.conditions.len(),
            in_contact: whole,
            partly_in_contact: part,
            flux_corrected: problem.method().law == Law::FluxCorrected,
            steps: answer.increments.len(),
            built: history.map(|h| h.built),
            linear: history.map(|h| h.linear),
            certificate: false,
            peak_rss_mb: peak_memory_mb(history.is_none()),
        }
    }

    /// One item per line.
    pub fn lines(&self) -> Vec<Text> {
        let mut lines = vec![text!(
            "model: {} in {} dimensions, {} dofs, {} of them given on Γ_D",
            self.element,
            self.dimension,
            self.dofs,
            self.given
        )];
        let mut left_out: Vec<Text> = Vec::new();
        if !self.zero_data.is_empty() {
            left_out.push(text!("{} (zero)", self.zero_data.join(", ")));
        }
        if self.contact_faces == 0 {
            left_out.push("contact (no face has it), so that one linear solve is all".into());
        } else {
            let corrected = match self.flux_corrected {
                true => ", the flux corrected by the load",
                false => "",
            };
            lines.push(text!(
                "contact: {} faces, {} conditions, {} faces wholly in contact and {} partly{}",
                self.contact_faces,
                self.conditions,
                self.in_contact,
                self.partly_in_contact,
                corrected
            ));
        }
        if self.floats {
            lines.push(text!(
                "a part of the domain is constrained only by contact, so that the mass of Γ_C is added and subtracted again"
            ));
        } else {
            left_out.push(text!("what holds floating parts (Γ_D holds all)"));
        }
        if let (Some(built), Some(linear)) = (self.built, self.linear) {
            lines.push(text!(
                "solver: {} in {}, {} entries, {} MB predicted",
                linear.solver.to_string(),
                linear.precision.to_string(),
                linear.entries,
                Number::fixed(linear.predicted_mb, 1)
            ));
            lines.push(text!(
                "built: {} sparse factor(s), {} dense one(s), {} preconditioner(s); {} steps on {} unknowns",
                built.factors,
                built.dense,
                built.preconditioners,
                self.steps,
                built.unknowns
            ));
            if built.dense == 0 && built.preconditioners == 0 {
                left_out.push("Newton's matrix".into());
            }
        }
        match self.certificate {
            true => lines.push("certificate: computed".into()),
            false => left_out.push("the certificate (--certify)".into()),
        }
        lines.push(text!("left out: {}", Text::joined(left_out, "; ")));
        lines.push(text!(
            "memory: {} MB at most",
            Number::fixed(self.peak_rss_mb, 0)
        ));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faceoff_fem::contact::{Discretisation, Iteration, Method, Problem, Stop, solve};
    use faceoff_fem::scene::Scene;

    fn explained(text: &str, method: Method) -> Explanation {
        let scene = Scene::parse(text).unwrap();
        let mesh = scene.triangulation(None).unwrap();
        let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, method)).unwrap();
        let case = Case { n: None, problem };
        let solution = solve(&case.problem, Iteration::Newton, Stop::default(), |_, _| {
            Ok(())
        });
        Explanation::new(&case, &Answer::new(solution.unwrap()))
    }

    const SQUARE: &str = r#"
name = "square"
[mesh]
generator = "union-jack"
n = 8
[boundary]
dirichlet = ["top"]
neumann = ["left", "right"]
contact = ["bottom"]
[data]
f = "-2*pi*sin(2*pi*x)"
"#;

    /// Parts that a scene does not need are not built.
    #[test]
    fn a_linear_scene_builds_nothing_for_contact() {
        let linear = SQUARE
            .replace("contact = [\"bottom\"]", "")
            .replace("\"left\"", "\"bottom\", \"left\"");
        for method in [Method::cr(), Method::cr_fc(), Method::p2()] {
            let e = explained(&linear, method);
            let built = e.built.unwrap();
            let counts = (
                built.unknowns,
                built.factors,
                built.dense,
                built.preconditioners,
            );
            assert_eq!(counts, (0, 1, 0, 0));
            assert_eq!((e.contact_faces, e.conditions, e.steps), (0, 0, 1));
            let text = Text::joined(e.lines(), "\n").to_string();
            assert!(text.contains("contact (no face has it)"), "{text}");
            assert!(text.contains("g, t, psi (zero)"), "{text}");
            assert!(text.contains("the certificate (--certify)"), "{text}");
        }
    }

    #[test]
    fn contact_is_counted() {
        let e = explained(SQUARE, Method::cr());
        let built = e.built.unwrap();
        // Two dofs of each contact cell are not on Γ_C, the one on it is kept as well.
        assert_eq!((e.contact_faces, built.factors), (8, 1));
        assert!(built.unknowns > 8 && built.unknowns < e.dofs - e.given);
        assert!(built.dense >= 1 && built.dense <= e.steps + 1);
        assert!(e.in_contact > 0 && e.in_contact + e.partly_in_contact < 8);
        assert!(e.partly_in_contact <= 2);
        let text = Text::joined(e.lines(), "\n").to_string();
        assert!(text.contains("contact: 8 faces, 40 conditions"), "{text}");
    }
}
