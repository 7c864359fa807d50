//! How a script is made: a code's table of spellings and the problem give what its template is filled with.

use std::sync::LazyLock;

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, Error, UndefinedBehavior, Value};

use super::fields::{Fields, Named, Term};
use super::python;
use super::spelling::{Shared, Style, Words, shared, traces};
use crate::problem::{Element, Integral, Problem, Space};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// A code's words for everything that a form is made of.
#[derive(Debug)]
pub struct Table {
    /// The file name of its template.
    pub frame: &'static str,
    /// Words that no name of a problem may be: those of the code, and those that the template makes.
    pub reserved: &'static [&'static str],
    /// The number of the first component of a vector in names.
    pub first: usize,
    /// What makes a name another one where it is reserved; other than `_` where names have no underscores.
    pub mark: char,
    /// π.
    pub pi: &'static str,
    /// The coordinates in formulas and in the form.
    pub coordinates: [&'static str; 3],
    /// The components of the normal.
    pub normals: [&'static str; 3],
    /// The diameter of cells, in 2D and 3D.
    pub diameter: [&'static str; 2],
    /// The parameter that is the time, which changes while the script runs.
    pub clock: fn(&str) -> String,
    /// What has a value on either side of a facet.
    pub other: fn(String, Side) -> String,
    /// The value or derivative of a function.
    pub leaf: fn(&Speaker<'_>, Leaf) -> String,
    /// Functions, powers and choices in the form.
    pub form: Style,
    /// The same in formulas outside of it.
    pub formulas: Style,
    /// Are coefficients always in brackets?
    pub brackets: bool,
    /// Are the coefficients 1 and -1 written as signs only?
    pub signs: bool,
    /// The space of an unknown or of data, or what is missing.
    pub element: fn(&Problem, Space) -> Result<String, String>,
    /// The rules on cells and facets by name, where the code does not take points.
    pub rules: fn(&Problem) -> Result<[String; 2], String>,
    /// Is the derivative of an integral written out? The code differentiates the others.
    pub derivative: fn(&mut Problem, &Integral) -> bool,
    /// Where an expression that occurs more than once gets a name.
    pub sharing: Sharing,
    /// Coordinates and parameters in functions of NumPy's arrays.
    pub points: Points,
    /// What else the code lacks for a problem.
    pub lacks: fn(&Problem) -> Result<(), String>,
    /// What else its template needs.
    pub more: fn(&mut Speaker<'_>) -> Result<Value, String>,
}

/// Where expressions that occur more than once get their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharing {
    /// Once for the residual and its derivative.
    Together,
    /// Once for each of them.
    Apart,
    /// In what the code makes of its own.
    Own,
}

/// How functions of the point are written with NumPy.
#[derive(Debug)]
pub struct Points {
    /// The arrays of coordinates.
    pub coordinates: [&'static str; 3],
    /// What follows the name of a parameter.
    pub value: &'static str,
}

/// Arrays of coordinates under their own names.
pub const POINTS: Points = Points {
    coordinates: ["x", "y", "z"],
    value: "",
};

/// A problem with the words that it is written in.
pub struct Speaker<'a> {
    pub table: &'a Table,
    pub problem: Problem,
    pub words: Words,
    /// Is the derivative being written, rather than the residual?
    pub in_derivative: bool,
}

impl Speaker<'_> {
    fn end(&self, node: Node) -> String {
        let Table {
            coordinates,
            normals,
            diameter,
            ..
        } = self.table;
        match node {
            Node::Pi => self.table.pi.into(),
            Node::Parameter(k) => self.parameter(k),
            Node::Coordinate(k) => coordinates[k].into(),
            Node::Normal(k, Side::Minus) => format!("(-{})", normals[k]),
            Node::Normal(k, _) => normals[k].into(),
            Node::Diameter(side) => (self.table.other)(diameter[self.problem.dim - 2].into(), side),
            Node::Leaf(leaf) => (self.table.leaf)(self, leaf),
            _ => String::new(),
        }
    }

    fn parameter(&self, k: usize) -> String {
        let name = &self.words.parameters[k];
        match &self.problem.time {
            Some(time) if time.parameter == k => (self.table.clock)(name),
            _ => name.clone(),
        }
    }

    /// A formula in coordinates and parameters.
    pub fn formula(&self, id: Id) -> String {
        let end = |node: Node| self.end(node);
        let spelling = self.table.formulas.with(&end);
        spelling.text(&self.problem.scalars, id, &Shared::new())
    }

    /// The same with NumPy's functions; its value has the shape of the coordinates.
    pub fn at_points(&self, id: Id) -> String {
        let Points { coordinates, value } = &self.table.points;
        let parameter = |k: usize| format!("{}{value}", self.words.parameters[k]);
        python::numpy(&self.problem.scalars, id, *coordinates, &parameter)
    }

    /// The name of the function that a leaf is of, and whether that is one of vectors as a whole.
    pub fn function(&self, leaf: Leaf) -> (&str, bool) {
        let is_vector = match leaf.field {
            Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                self.problem.unknowns[k].space.element.is_vector()
            }
            Field::Datum(_) => false,
        };
        match is_vector {
            true => (self.words.whole(leaf.field), true),
            false => (self.words.part(leaf), false),
        }
    }

    /// Names for what occurs more than once in some expressions, and their definitions.
    pub fn share(&self, roots: &[Id]) -> (Vec<Named>, Shared) {
        let found = shared(
            &self.problem.scalars,
            roots,
            &mut self.table.words(&self.problem),
        );
        let end = |node: Node| self.end(node);
        let spelling = self.table.form.with(&end);
        let mut known = Shared::new();
        let mut all = Vec::new();
        for (id, name) in found {
            let value = spelling.definition(&self.problem.scalars, id, &known);
            all.push(Named {
                name: name.clone(),
                value,
            });
            known.insert(id, name);
        }
        (all, known)
    }

    /// A sum of products of coefficients with values and derivatives of functions.
    pub fn sum(
        &self,
        products: impl IntoIterator<Item = (Id, Vec<Leaf>)>,
        known: &Shared,
    ) -> Vec<Term> {
        let end = |node: Node| self.end(node);
        let spelling = self.table.form.with(&end);
        let scalars = &self.problem.scalars;
        let mut all: Vec<Term> = Vec::new();
        for (coefficient, leaves) in products {
            let ends = leaves.into_iter().map(|leaf| self.end(Node::Leaf(leaf)));
            let ends = ends.collect::<Vec<_>>().join("*");
            let text = match scalars.number_of(coefficient) {
                Some(1.0) if self.table.signs => ends,
                Some(-1.0) if self.table.signs => format!("-{ends}"),
                _ if self.table.brackets => {
                    format!("({})*{ends}", spelling.text(scalars, coefficient, known))
                }
                _ => format!("{}*{ends}", spelling.factor(scalars, coefficient, known)),
            };
            all.push(Term::new(text, all.is_empty()));
        }
        all
    }
}

impl Table {
    /// Names for a problem.
    pub fn words(&self, problem: &Problem) -> Words {
        Words::new(problem, &self.reserved.join(" "), self.first, self.mark)
    }

    /// The script for a problem.
    ///
    /// # Errors
    /// What the code lacks, or a fault of the template.
    pub fn script(&self, problem: &Problem, file: &str) -> Result<String, String> {
        (self.lacks)(problem)?;
        let mut speaker = Speaker {
            words: self.words(problem),
            problem: problem.clone(),
            table: self,
            in_derivative: false,
        };
        let fields = Fields::new(&mut speaker, file)?;
        fill(self.frame, Value::from(Serde(fields))).map_err(|e| {
            format!(
                "an internal error: the template {} cannot be filled: {e}; please report it",
                self.frame
            )
        })
    }
}

/// A template with its parts filled in.
fn fill(frame: &str, fields: Value) -> Result<String, Error> {
    static FRAMES: LazyLock<Result<Environment<'static>, Error>> = LazyLock::new(frames);
    match &*FRAMES {
        Ok(frames) => frames.get_template(frame)?.render(fields),
        Err(e) => Err(Error::new(e.kind(), e.to_string())),
    }
}

fn frames() -> Result<Environment<'static>, Error> {
    let mut all = Environment::new();
    let syntax = SyntaxConfig::builder()
        .trim_blocks(true)
        .lstrip_blocks(true)
        .keep_trailing_newline(true)
        .build()?;
    all.set_syntax(syntax);
    all.set_undefined_behavior(UndefinedBehavior::Strict);
    all.add_filter("within", within);
    all.add_filter("each", each);
    all.add_filter("dot", dot);
    all.add_function("trace", trace);
    for (name, text) in super::FRAMES {
        all.add_template(name, text)?;
    }
    Ok(all)
}

/// Lines in a block of a script, further to the right: by four blanks, or so many.
fn within(text: &str, by: Option<usize>) -> String {
    let by = " ".repeat(by.unwrap_or(4));
    let lines = text.lines().map(|line| match line.is_empty() {
        true => "\n".to_owned(),
        false => format!("{by}{line}\n"),
    });
    lines.collect()
}

/// A text for each component, whose number, counted from `first`, takes the place of `%`.
fn each(text: &str, count: usize, first: usize) -> Vec<String> {
    let numbers = first..first + count;
    numbers.map(|k| text.replace('%', &k.to_string())).collect()
}

/// A scalar product.
fn dot(a: Vec<String>, b: Vec<String>) -> String {
    let each = a.iter().zip(&b).map(|(a, b)| format!("{a}*{b}"));
    each.collect::<Vec<_>>().join(" + ")
}

/// The components of a vector that are continuous on facets: the `normal` one, or all others.
fn trace(kind: &str, u: Vec<String>, n: Vec<String>) -> Vec<String> {
    let element = match kind {
        "normal" => Element::RaviartThomas,
        _ => Element::Nedelec,
    };
    traces(element, &u, &n)
}

/// For codes that take the points of rules.
pub fn by_points(_: &Problem) -> Result<[String; 2], String> {
    Ok([String::new(), String::new()])
}

/// For codes that lack nothing else.
pub fn nothing(_: &Problem) -> Result<(), String> {
    Ok(())
}

/// For codes whose template needs nothing else.
pub fn no_more(_: &mut Speaker<'_>) -> Result<Value, String> {
    Ok(Value::UNDEFINED)
}

/// For codes that differentiate all integrals.
pub fn by_code(_: &mut Problem, _: &Integral) -> bool {
    false
}
