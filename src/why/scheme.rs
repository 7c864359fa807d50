//! The scheme of a scene as a weak form, for Nitsche's methods on CR, P1 and P2; all changes that are known for forms are tried in it.

use std::path::Path;

use super::changes::Names;
use super::search::Search;
use super::{Aspect, Explanation, Rank};
use crate::run::function;
use crate::text::text;
use faceoff_fem::contact::{Law, Problem};
use faceoff_fem::quadrature;
use faceoff_fem::scene::{HRule, Part};
use faceoff_form::Problem as Form;
use faceoff_form::judge::{Cause, Change, judge};
use faceoff_mesh::mesh::{CellBlock, CellKind, Group, Mesh};

/// The names of the boundary parts in the form.
const PARTS: [(Part, &str, i64); 3] = [
    (Part::Contact, "C", 1),
    (Part::Dirichlet, "D", 2),
    (Part::Neumann, "N", 3),
];

/// The form that u solves instead of the scheme, if changes of the form explain it.
pub(super) fn explain(search: &Search) -> Option<Explanation> {
    let problem = &search.problem;
    let mesh = mesh(problem);
    let (text, terms) = form(problem)?;
    let form = Form::parse(Path::new("scheme"), &text, &mesh).ok()?;
    let (cells, field) = function::broken(problem, "u", search.u);
    let fields = vec![field];
    let result = Mesh { fields, ..cells };
    let mut judged = judge(&form, &mesh, &result, 0.0).ok()?;
    // In the notation of the paper.
    for (term, name) in judged.terms.iter_mut().zip(terms) {
        term.text = name;
    }
    let found = judged.explanation.as_ref();
    // Changes of the values are left to the scene's own solver.
    let is_of_values = |cause: &Cause| {
        use Change::{Exchanged, Stopped, Values};
        matches!(
            cause.change,
            Exchanged { .. } | Stopped { .. } | Values { .. }
        )
    };
    let found = found.filter(|found| found.is_exact && !found.causes.iter().any(is_of_values))?;
    let names = Names {
        problem: &form,
        terms: &judged.terms,
    };
    let brief = text!(
        "it solves the scheme as if {}",
        names.sentence(&found.causes)
    );
    // A local change supposes more than statuses that lag, or the γ of a face.
    let is_plain = found
        .causes
        .iter()
        .all(|cause| cause.change.is_everywhere());
    let rank = if is_plain { Rank::Number } else { Rank::Places };
    Some(Explanation::new(Aspect::Form, brief, rank, found.left))
}

/// The cells, and the faces of each part of the boundary.
fn mesh(problem: &Problem) -> Mesh {
    let source = problem.space.mesh;
    let (kind, facet) = match source.dim {
        2 => (CellKind::Triangle, CellKind::Line),
        _ => (CellKind::Tetrahedron, CellKind::Triangle),
    };
    let cells = (0..source.cell_count()).flat_map(|cell| source.cell(cell).to_vec());
    let mut mesh = Mesh {
        points: source.points.clone().into(),
        blocks: vec![CellBlock::new(kind, cells.collect())],
        ..Mesh::default()
    };
    let mut first = source.cell_count() as u32;
    for (part, name, tag) in PARTS {
        let faces = problem.parts.iter().enumerate();
        let faces = faces.filter(|(_, of)| **of == Some(part));
        let nodes: Vec<u32> = faces
            .flat_map(|(face, _)| source.face(face).to_vec())
            .collect();
        let count = (nodes.len() / source.dim) as u32;
        mesh.groups.push(Group {
            name: Some(name.to_owned()),
            cells: (first..first + count).collect(),
            ..Group::new(source.dim as u8 - 1, tag)
        });
        mesh.blocks.push(CellBlock::new(facet, nodes));
        first += count;
    }
    mesh
}

/// The file of the form, (2.4) and (3.2) of the paper, and the names of its terms; `None` for other laws, and for rules that forms do not have.
fn form(problem: &Problem) -> Option<(String, Vec<String>)> {
    let (method, data) = (problem.method(), problem.scene.data());
    let Law::Nitsche(law) = method.law else {
        return None;
    };
    let dim = problem.space.mesh.dim;
    let degree = |dim: usize, rule: &quadrature::Rule| {
        let known = quadrature::exact(dim, rule.degree.max(2));
        (known.name == rule.name).then_some(rule.degree)
    };
    let [degree, facet_degree] = [
        degree(dim, &problem.cell_rule)?,
        degree(dim - 1, &problem.face_rule)?,
    ];
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let has = |part: Part| problem.parts.contains(&Some(part));
    let mut given = String::new();
    let mut terms: Vec<(String, String)> = Vec::new();
    let mut add = |text: String, name: &str| terms.push((text, name.to_owned()));
    add("inner(grad(u), grad(v))*dx".into(), "(∇u,∇v)");
    let all = [
        ("f", &data.f),
        ("t", &data.t),
        ("psi", &data.psi),
        ("g", &data.g),
    ];
    for (name, datum) in all.into_iter().filter(|(_, datum)| !datum.is_zero()) {
        given += &format!("{name} = {}\n", quoted(datum.text()));
    }
    if !data.f.is_zero() {
        add("- f*v*dx".into(), "(f,v)");
    }
    if !data.t.is_zero() && has(Part::Neumann) {
        add("- t*v*ds(N)".into(), "<t,v>");
    }
    let h = match problem.discretisation.h {
        HRule::Local => "h",
        HRule::Global => "hmax",
    };
    if has(Part::Contact) {
        let gap = if data.psi.is_zero() { "u" } else { "(u - psi)" };
        let active = format!("pos(gamma0*{h}*dot(grad(u), n) - {gap})");
        add("- dot(grad(u), n)*v*ds(C)".into(), "<∂ₙu,v>");
        let of_gap = if data.psi.is_zero() { "u" } else { "u-ψ" };
        let tests = [
            (law.theta1, "dot(grad(v), n)".to_owned(), "∂ₙv"),
            (law.theta2, format!("v/(gamma0*{h})"), "γ⁻¹v"),
        ];
        for (theta, test, of_test) in tests.iter().filter(|(theta, ..)| *theta != 0.0) {
            let sign = if *theta < 0.0 { "-" } else { "+" };
            let factor = match theta.abs() {
                1.0 => String::new(),
                size => format!("{size:?}*"),
            };
            for (what, of_what) in [(gap, of_gap), (&*active, "[P_γ(u)]₊")] {
                let text = format!("{sign} {factor}{what}*{test}*ds(C)");
                add(text, &format!("<{of_what},{of_test}>"));
            }
        }
    }
    let element = method.element.name().to_uppercase();
    let mesh = problem.space.mesh;
    let longest = (0..mesh.cell_count()).map(|cell| mesh.geometry(cell).diameter);
    let longest = longest.fold(0.0, f64::max);
    let value = if data.g.is_zero() { "\"0\"" } else { "\"g\"" };
    let held = if has(Part::Dirichlet) {
        format!("D = {value}\n")
    } else {
        String::new()
    };
    let (texts, names): (Vec<String>, Vec<String>) = terms.into_iter().unzip();
    let text = format!(
        "name = \"scheme\"\n[spaces]\nu = \"{element}\"\n[parameters]\ngamma0 = {:?}\nhmax = {longest:?}\n[data]\n{given}[form]\nF = {}\ndegree = {degree}\n\
         facet_degree = {facet_degree}\n[dirichlet]\n{held}",
        problem.discretisation.gamma0(),
        quoted(&texts.join(" "))
    );
    Some((text, names))
}
