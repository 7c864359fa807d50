//! dolfinx: the form in UFL as the user wrote it, with UFL's derivative; releases from 0.5 on.

use faceoff_fem::scene::expression::Function;
use faceoff_fem::scene::expression::syntax::Term;
use minijinja::{Value, context};

use super::python::{RESERVED as PYTHON, USUAL};
use super::speaker::Speaker;
use super::table::{Code, Sharing};
use super::ufl::{UFL, ufl};
use crate::grid::Cells;
use crate::problem::{Domain, Element, Problem, Space};
use crate::scalar::{Field, Id, Length, Node};

/// dolfinx in the system's Python, where packages of Linux distributions install it. The form is the user's text.
pub const CODE: Code = Code {
    name: "dolfinx",
    suffix: "_dolfinx.py",
    command: &["/usr/bin/python3"],
    frame: include_str!("frames/dolfinx.py"),
    reserved: &[PYTHON, RESERVED],
    pi: "pi",
    coordinates: ["x[0]", "x[1]", "x[2]"],
    formulas: UFL,
    element,
    sharing: Sharing::Own,
    points: (["x[0]", "x[1]", "x[2]"], ".value"),
    // UFL's `MaxFacetEdgeLength` does not compile in dolfinx 0.5; the edges of a curved facet are not in its Jacobian matrix.
    lacks: |problem| match problem.cells {
        Cells::Cubes if problem.dim == 3 && problem.has_length(Length::Facet) => {
            Err("scripts for dolfinx have no facet_length on hexahedra".into())
        }
        _ => Ok(()),
    },
    more,
    has_eigen: true,
    ..USUAL
};

/// The same with contact in elasticity as in `fenicsx/elastic.py`.
pub const ELASTIC: Code = Code {
    name: "fenicsx",
    suffix: "_fenicsx.py",
    by_hand_scheme: Some(include_str!("../../../../fenicsx/elastic.py")),
    reserved: &[PYTHON, RESERVED, "elastic_form"],
    ..CODE
};

/// Names that the frame imports or defines.
const RESERVED: &str = "mode value found free slepc4py SLEPc transformation eigenvalues modes mass M logging CellDiameter FacetNormal Measure SpatialCoordinate TestFunction TestFunctions derivative lines mpi4py parts petsc4py MPI PETSc basix dolfinx fem io petsc ufl mesh marked here V W F J dx ds dS md md2 md3 md4 md5 md6 md7 md8 fixed hold element space spaces bcs solver \
    grad div curl dot inner outer cross sym skew dev tr det inv cofac transpose Identity jump avg conditional lt le gt ge max_value min_value \
    sin cos tan asin acos atan atan2 sinh cosh tanh exp ln sqrt sign as_tensor split graph old facet_tags cell_tags function at nodes cell rank w goal held before number rows scipy splu start volume wanted hold_whole normal tangential";

fn element(_: &Problem, space: Space) -> Result<String, String> {
    let (family, degree) = match space.element {
        Element::Continuous(degree) => ("Lagrange", degree),
        Element::Broken(degree) => ("DG", degree),
        Element::CrouzeixRaviart => ("CR", 1),
        Element::RaviartThomas => ("RT", 1),
        Element::Nedelec => ("N1curl", 1),
    };
    Ok(match space.size {
        Some(size) if !space.element.is_vector() => {
            format!("element(\"{family}\", {degree}, {size})")
        }
        _ => format!("element(\"{family}\", {degree})"),
    })
}

/// The form and the data in UFL, and which of its functions they use.
fn more(of: &mut Speaker<'_>) -> Value {
    let Speaker { problem, words, .. } = &*of;
    let held = problem.held();
    let is_whole = held.iter().any(|held| held.component.is_none());
    let has = |domain| problem.integrals.iter().any(|i| i.measure.domain == domain);
    let facets = [
        ("ds", is_whole || has(Domain::Boundary)),
        ("dS", has(Domain::Interior)),
    ];
    let facets = facets.iter().filter(|(_, is_there)| *is_there);
    let facets: Vec<&str> = facets.map(|(name, _)| *name).collect();
    let texts = || problem.data.iter().flat_map(|datum| &datum.texts);
    let mass = problem.eigen.iter().map(|eigen| eigen.mass.text.as_str());
    let form = problem.form.text.as_str();
    let both = std::iter::once(form)
        .chain(mass.clone())
        .collect::<Vec<_>>();
    let uses = |word: &str| {
        texts().any(|text| text.contains(word)) || both.iter().any(|form| form.contains(word))
    };
    let values = held.iter().flat_map(|held| held.values.iter().copied());
    let nodes = problem.scalars.nodes_of(values);
    let is_angle = |id: &Id| matches!(problem.scalars.node(*id), Node::Call(Function::Atan2, ..));
    let in_ufl = |text: &str| {
        let term = Term::parse(text);
        term.map(|term| ufl(problem, words, text, &term))
            .unwrap_or_default()
    };
    let data = problem.data.iter().enumerate().map(|(k, datum)| {
        if datum.space.is_some() {
            return words.parts(Field::Datum(k)).to_vec();
        }
        let parts = datum.texts.iter().zip(&datum.components);
        let parts = parts.map(|(text, id)| match of.constant(*id) {
            // UFL differentiates numbers only if they have a mesh.
            Some(value) => format!("fem.Constant(mesh, PETSc.ScalarType({value}))"),
            None => in_ufl(text),
        });
        parts.collect()
    });
    let form = |text: &str| {
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        in_ufl(&lines.collect::<Vec<_>>().join("\n"))
    };
    context! {
        form => form(both[0]),
        mass => mass.map(form).collect::<Vec<String>>(),
        data => data.collect::<Vec<Vec<String>>>(),
        facets => facets,
        has_cofactors => uses("cofac"),
        has_flat_jumps => uses("jump") && problem.unknowns.iter().any(|u| u.space.element == Element::Broken(0)),
        has_angle => uses("atan2") || is_whole && nodes.iter().any(is_angle),
        has_normal => is_whole || both.iter().any(|form| form.contains('n')),
    }
}
