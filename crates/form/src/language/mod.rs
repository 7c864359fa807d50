//! The language of forms: from syntax trees to tensors of scalar expressions, with checked shapes, and to integrals.

mod definition;
mod functions;
mod integral;
mod meaning;
mod sides;
#[cfg(test)]
mod tests;

pub use definition::{Definition, Formula};
pub use integral::find_group;

use faceoff_fem::scene::expression::syntax::Term;

use crate::grid::Cells;
use crate::problem::{Datum, Group, Integral, Measure, Parameter, Unknown};
use crate::scalar::{Id, Node, Scalars};

/// Reserved words: not allowed as names of parameters, data and unknowns.
pub const WORDS: [&str; 39] = [
    "x",
    "y",
    "z",
    "pi",
    "n",
    "h",
    "circumradius",
    "facet_length",
    "dx",
    "ds",
    "dS",
    "test",
    "grad",
    "div",
    "curl",
    "rot",
    "dot",
    "inner",
    "outer",
    "cross",
    "sym",
    "skew",
    "dev",
    "tr",
    "det",
    "inv",
    "cofac",
    "transpose",
    "Identity",
    "jump",
    "avg",
    "conditional",
    "if",
    "pow",
    "sign",
    "pos",
    "old",
    "free",
    "F",
];

/// The most entries of a tensor: those of one of rank 4 in 3D.
const MOST_ENTRIES: usize = 81;

/// The most operations in formulas of data and conditions.
pub const MOST_LENGTH: f64 = 5_000.0;

/// An error in an expression, with its position and a remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The position in characters, from 0.
    pub at: usize,
    /// The error.
    pub what: String,
    /// The remedy.
    pub remedy: String,
}

type Result<T> = std::result::Result<T, Fault>;

fn fault(term: &Term, what: impl Into<String>, remedy: impl Into<String>) -> Fault {
    Fault {
        at: term.start,
        what: what.into(),
        remedy: remedy.into(),
    }
}

/// A scalar (no dimensions), vector or tensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Its dimensions.
    pub shape: Vec<usize>,
    /// Row by row.
    pub entries: Vec<Id>,
}

/// The meaning of a term.
enum Meaning {
    Tensor(Tensor),
    Measure(Measure),
    Form(Vec<Integral>),
}

/// The names that an expression may use.
pub struct Names<'a> {
    /// 2 or 3.
    pub dim: usize,
    /// The shape of the cells of the mesh.
    pub cells: Cells,
    /// Empty if only data are allowed.
    pub unknowns: &'a [Unknown],
    /// The parameters.
    pub parameters: &'a [Parameter],
    /// The data.
    pub data: &'a [Datum],
    /// The groups of the mesh.
    pub groups: &'a [Group],
    /// The number of facets of the boundary in no group.
    pub unmarked: usize,
    /// Are there time steps?
    pub is_timed: bool,
}

/// Turns syntax trees into expressions, given the names that they may use.
pub struct Reader<'a> {
    names: Names<'a>,
    scalars: &'a mut Scalars,
    /// The unknown whose test function integrals without one are multiplied by.
    weight: Option<usize>,
}

/// The shape as text.
fn kind_of(shape: &[usize]) -> String {
    match shape {
        [] => "a scalar".into(),
        [n] => format!("a vector of {n} components"),
        [n, m] => format!("a {n} × {m} matrix"),
        _ => format!("a tensor of rank {}", shape.len()),
    }
}

impl<'a> Reader<'a> {
    /// A reader that adds its expressions to `scalars`.
    pub fn new(names: Names<'a>, scalars: &'a mut Scalars) -> Self {
        Reader {
            names,
            scalars,
            weight: None,
        }
    }

    /// The integrals of a number, each multiplied by the test function of an unknown at this position.
    ///
    /// # Errors
    /// Errors of [`Self::form`]; test functions.
    pub fn number(&mut self, term: &Term, weight: usize) -> Result<Vec<Integral>> {
        self.weight = Some(weight);
        self.form(term)
    }

    /// The integrals of a form.
    ///
    /// # Errors
    /// Text that is not in the language, or parts of it that do not fit together.
    pub fn form(&mut self, term: &Term) -> Result<Vec<Integral>> {
        match self.meaning(term)? {
            Meaning::Form(integrals) => Ok(integrals),
            Meaning::Tensor(_) => Err(fault(
                term,
                "this is not integrated",
                "end each term of the form with a measure: *dx, *ds or *dS",
            )),
            Meaning::Measure(_) => Err(self.bare_measure(term)),
        }
    }

    /// A scalar function of the point, for data and conditions.
    ///
    /// # Errors
    /// Errors of [`Self::form`]; the normal, and lengths of cells and facets; a formula that is too long when its tensors are written out.
    pub fn formula(&mut self, term: &Term) -> Result<Id> {
        let id = self.scalar(term)?;
        let nodes = self.scalars.nodes_of([id]);
        let of_cells = nodes.iter().find_map(|id| match self.scalars.node(*id) {
            Node::Normal(..) => Some("n"),
            Node::Length(length, _) => Some(length.name()),
            _ => None,
        });
        if let Some(name) = of_cells {
            let what = format!("{name} in a function of the point");
            return Err(fault(term, what, format!("use {name} in F")));
        }
        match self.scalars.length(id) <= MOST_LENGTH {
            true => Ok(id),
            false => Err(fault(
                term,
                "this formula is too long when its tensors are written out",
                "use fewer functions of tensors",
            )),
        }
    }

    fn scalar(&mut self, term: &Term) -> Result<Id> {
        let tensor = self.tensor(term)?;
        self.as_scalar(term, &tensor, "a scalar is needed here")
    }

    fn bare_measure(&self, term: &Term) -> Fault {
        fault(
            term,
            "a measure that nothing is multiplied with",
            "write what is integrated before it, as in f*v*dx",
        )
    }

    fn as_scalar(&self, term: &Term, tensor: &Tensor, why: &str) -> Result<Id> {
        match tensor.shape.is_empty() {
            true => Ok(tensor.entries[0]),
            false => Err(fault(
                term,
                format!("{why}, and this is {}", kind_of(&tensor.shape)),
                "take a component, dot or inner",
            )),
        }
    }

    pub(crate) fn tensor(&mut self, term: &Term) -> Result<Tensor> {
        match self.meaning(term)? {
            Meaning::Tensor(tensor) => Ok(tensor),
            Meaning::Measure(_) => Err(fault(
                term,
                "a measure where a value is needed",
                "multiply the whole integrand by it, once: f*v*dx",
            )),
            Meaning::Form(_) => Err(fault(
                term,
                "an integral where a value is needed",
                "integrals are only added and subtracted",
            )),
        }
    }
}

fn scalar(id: Id) -> Tensor {
    Tensor {
        shape: Vec::new(),
        entries: vec![id],
    }
}

fn transpose(a: &Tensor) -> Tensor {
    let [rows, columns] = [a.shape[0], a.shape[1]];
    let entries = (0..columns).flat_map(|j| (0..rows).map(move |i| i * columns + j));
    Tensor {
        shape: vec![columns, rows],
        entries: entries.map(|k| a.entries[k]).collect(),
    }
}
