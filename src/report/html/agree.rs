//! The page of `verify` where all agree: one screen.

use std::fmt::Write as _;

use super::codes::Codes;
use super::markup::{Html, division, element, leaf, prose, raw};
use super::plane::{View, WIDTH, drawing, segments};
use super::spread::Spread;
use super::surface::Surface;
use super::verify::Run;
use crate::campaigns::verify::CaseOutcome;
use crate::engine::unique;
use crate::text::number::{share, whole};
use crate::text::{Digits, Text, at_most, below, text};
use faceoff_fem::scene::Part;
use faceoff_mesh::error::Result;

/// So many scenes have a sketch.
const SKETCHES: usize = 4;

impl Run<'_> {
    /// The page where all agree.
    ///
    /// # Errors
    /// Faces that cannot be matched.
    pub fn agreeing(self) -> Result<Html> {
        let outcome = self.outcome;
        let codes = Codes::new(outcome, &[]);
        let about = text!(
            "**Each answer solves the scheme.** Residual of every code, and the largest difference of two in units of rounding"
        );
        let cases = division(
            "c6 compact",
            [
                element("div", &[("class", "cap")], prose(about)),
                codes.by_case(None),
            ],
        );
        let grid = division("grid", [Spread::new(outcome)?.figure(), cases]);
        let scenes = unique(outcome.cases.iter().map(|c| &*c.scene));
        let mut below: Vec<Html> = Vec::new();
        for scene in scenes.iter().take(SKETCHES) {
            if let Some(case) = outcome.cases.iter().find(|c| c.scene == *scene) {
                below.push(sketch(case)?);
            }
        }
        below.extend([self.checked(), self.unchecked()]);
        Ok(Html::from([grid, division("checked", below)]))
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
    let items = items.iter().map(|item| element("li", &[], prose(item)));
    division("", [leaf("h2", &[], name), element("ul", &[], items)])
}

/// A scene's mesh, small, and what is in contact.
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
        let view = View::of(mesh.points.iter().map(|p| [p[0], p[1]]), 2.0 * WIDTH);
        let ends = |face: usize| {
            let ends = mesh.face(face);
            [ends[0], ends[1]].map(|v| [0, 1].map(|k| mesh.points[v as usize][k]))
        };
        let lines = |keeps: &dyn Fn(usize) -> bool| {
            segments(
                &view,
                (0..mesh.face_count()).filter(|f| keeps(*f)).map(ends),
            )
        };
        let is_contact = |f: usize| problem.parts[f] == Some(Part::Contact);
        // A fine mesh would be a grey area, and large.
        let inner = if mesh.face_count() > 6000 {
            String::new()
        } else {
            lines(&|f| !mesh.is_boundary(f))
        };
        let mut svg = format!("<path class=\"hair\" stroke-width=\".7\" d=\"{inner}\"/>");
        let _ = write!(
            svg,
            "<path class=\"frame\" stroke-width=\"1.2\" d=\"{}\"/>",
            lines(&|f| mesh.is_boundary(f) && !is_contact(f))
        );
        let _ = write!(
            svg,
            "<path class=\"ink\" stroke-width=\"1.6\" d=\"{}\"/>",
            lines(&is_contact)
        );
        let _ = write!(
            svg,
            "<path class=\"goodl\" stroke-width=\"5\" d=\"{}\"/>",
            lines(&|f| is_contact(f) && in_contact(f))
        );
        drawing(&label, [WIDTH, view.height], &svg)
    };
    let sizes = text!(
        "{} cells, {} on Γ_C",
        whole(case.cells),
        whole(case.contact_faces)
    );
    let name = leaf("b", &[], &case.scene);
    let caption = element("figcaption", &[], [name, raw("<br>"), prose(sizes)]);
    Ok(element("figure", &[("class", "thumb")], [picture, caption]))
}
