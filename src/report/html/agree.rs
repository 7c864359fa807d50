//! The page of `verify` if all agree: one screen.

use super::codes::Codes;
use super::markup::{Html, html};
use super::plane::{View, WIDTH, drawing, line, segments};
use super::residual::ends;
use super::spread::Spread;
use super::surface::Surface;
use super::verify::Run;
use crate::campaigns::verify::CaseOutcome;
use crate::engine::unique;
use crate::text::number::{share, whole};
use crate::text::{Digits, Text, at_most, below, text};
use faceoff_fem::scene::Part;
use faceoff_mesh::error::Result;

/// The most scenes with a sketch.
const SKETCHES: usize = 4;

impl Run<'_> {
    /// The page if all agree.
    ///
    /// # Errors
    /// Faces that cannot be matched.
    pub fn agreeing(self) -> Result<Html> {
        let outcome = self.outcome;
        let codes = Codes::new(outcome, &[]);
        let about = text!(
            "**Each answer solves the scheme.** Residual of every code, and the largest difference of two in units of rounding"
        );
        let scenes = unique(outcome.cases.iter().map(|c| &*c.scene));
        let shown = scenes.iter().take(SKETCHES);
        let shown = shown.filter_map(|s| outcome.cases.iter().find(|c| c.scene == *s));
        let sketches = shown.map(sketch).collect::<Result<Vec<Html>>>()?;
        Ok(html! {
            .grid {
                (Spread::new(outcome)?.figure())
                .c6.compact { .cap { (about) } (codes.by_case(None)) }
            }
            .checked {
                @for sketch in sketches { (sketch) }
                (self.checked()) (self.unchecked())
            }
        })
    }

    fn checked(&self) -> Html {
        let outcome = self.outcome;
        let names = unique(outcome.pairs().map(|p| &*p.field.field));
        let words = |name: &str| match name {
            "mean" => "face means".to_owned(),
            "jump" => "jumps".into(),
            "moments" => "second moments".into(),
            "status" => "contact status".into(),
            other => other.to_owned(),
        };
        let names: Vec<String> = names.into_iter().map(words).collect();
        let count: usize = outcome.cases.iter().map(|c| c.pairs.len()).sum();
        let residual = outcome.answers().map(|e| e.residual).fold(0.0, f64::max);
        let mut items = vec![
            text!("{}: {} fields of pairs", names.join(", "), whole(count)),
            text!(
                "every equation of every answer: residual at most {}",
                at_most(residual, 2)
            ),
        ];
        let judged: Vec<_> = outcome.cross.iter().filter_map(|c| c.judged).collect();
        let slack = judged
            .iter()
            .map(|j| j.slack / j.gradient)
            .filter(|s| s.is_finite())
            .reduce(f64::min);
        if let Some(slack) = slack {
            items.push(text!(
                "methods against each other: {} distances, each below the sum of two guaranteed bounds, by {} of ‖∇u‖ at least",
                whole(judged.len()),
                share(below(slack, Digits::Counting(if slack < 1e-3 { 2 } else { 3 })))
            ));
        }
        list("Checked", &items)
    }

    fn unchecked(&self) -> Html {
        let outcome = self.outcome;
        let has = |dim: usize| outcome.cases.iter().any(|c| c.setup.mesh.dim == dim);
        let mut items = Vec::new();
        if !has(3) {
            items.push(text!("3D: `faceoff verify one-zone-3d block`"));
        }
        if !has(2) {
            items.push(text!("2D: `faceoff verify`"));
        }
        if let Some(n) = outcome.cases.iter().filter_map(|c| c.n).max() {
            items.push(text!("finer meshes: `--n {},{}`", 2 * n, 4 * n));
        }
        items.push(text!("whether the model converges: `faceoff orders`"));
        list("Not checked", &items)
    }
}

fn list(name: &str, items: &[Text]) -> Html {
    html! { div { h2 { (name) } ul { @for item in items { li { (item) } } } } }
}

/// A scene's mesh, small, with its contact zones.
fn sketch(case: &CaseOutcome) -> Result<Html> {
    let of = case.setup.case()?;
    let (problem, mesh) = (&of.problem, &*case.setup.mesh);
    let status = case.fields.first().and_then(|f| f.column("status"));
    let in_contact = |face: usize| {
        let of = status.and_then(|c| Some(c.row(c.faces.binary_search(&(face as u32)).ok()?)));
        of.is_some_and(|row| 2 * row.iter().filter(|p| **p <= 0.0).count() > row.len())
    };
    let label = format!("the mesh of {}", case.scene);
    let picture = if mesh.dim == 3 {
        let all: Vec<usize> = problem.contact.iter().map(|f| f.face).collect();
        let faces: Vec<(usize, usize)> = all
            .iter()
            .map(|f| (*f, if in_contact(*f) { 19 } else { 0 }))
            .collect();
        Surface::new(mesh, &all).picture(&label, &faces, &[], None)
    } else {
        let view = View::of_points(&mesh.points, 2.0 * WIDTH);
        let lines = |keeps: &dyn Fn(usize) -> bool| {
            let faces = (0..mesh.face_count()).filter(|f| keeps(*f));
            segments(&view, faces.map(|face| ends(mesh, face)))
        };
        let is_contact = |f: usize| problem.parts[f] == Some(Part::Contact);
        // A fine mesh would be a grey area, and a large file.
        let has_room = mesh.face_count() <= 6000;
        let svg = line("hair", 0.7, lines(&|f| has_room && !mesh.is_boundary(f)))
            + &line(
                "frame",
                1.2,
                lines(&|f| mesh.is_boundary(f) && !is_contact(f)),
            )
            + &line("ink", 1.6, lines(&is_contact))
            + &line("goodl", 5.0, lines(&|f| is_contact(f) && in_contact(f)));
        drawing(&label, [WIDTH, view.height], &svg)
    };
    let sizes = text!(
        "{} cells, {} on Γ_C",
        whole(case.cells),
        whole(case.contact_faces)
    );
    Ok(html! { figure.thumb { (picture) figcaption { b { (case.scene) } br; (sizes) } } })
}
