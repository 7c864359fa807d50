//! A problem in the notation of a code: its expressions as text.

use minijinja::{Value, context};

use super::points;
use super::spelling::{Shared, Words, comment, shared, signed};
use super::strong::plain;
use super::table::Code;
use crate::problem::{Element, Problem, Space};
use crate::scalar::{Field, Id, Leaf, Node, Side};

/// A problem with the notation of a code.
#[derive(Debug)]
pub struct Speaker<'a> {
    pub code: &'a Code,
    pub problem: Problem,
    pub words: Words,
    /// Is this the derivative, rather than the residual?
    pub in_derivative: bool,
}

impl<'a> Speaker<'a> {
    pub fn new(code: &'a Code, problem: &Problem) -> Self {
        Speaker {
            code,
            problem: problem.clone(),
            words: Words::new(problem, code.reserved, code.first, code.mark),
            in_derivative: false,
        }
    }

    fn end(&self, node: Node) -> String {
        let code = self.code;
        match node {
            Node::Pi => code.pi.into(),
            Node::Parameter(k) => {
                let name = &self.words.parameters[k];
                match &self.problem.time {
                    Some(time) if time.parameter == k => (code.clock)(name),
                    _ => name.clone(),
                }
            }
            Node::Coordinate(k) => code.coordinates[k].into(),
            Node::Normal(k, Side::Minus) => format!("(-{})", code.normals[k]),
            Node::Normal(k, _) => code.normals[k].into(),
            Node::Length(length, side) => {
                (code.on_side)((code.length)(length, self.problem.dim).into(), side)
            }
            Node::Leaf(leaf) => self.leaf(leaf),
            _ => String::new(),
        }
    }

    /// The space of an unknown with its supplements; data have none here.
    fn space(&self, field: Field) -> Option<Space> {
        match field {
            Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                Some(self.problem.unknowns[k].space)
            }
            Field::Datum(_) => None,
        }
    }

    /// The name of the function of a leaf: of a component, or of a function of vectors as a whole.
    pub fn function(&self, leaf: Leaf) -> String {
        let space = self.space(leaf.field);
        match space.is_some_and(|space| space.element.is_vector()) {
            true => self.words.whole(leaf.field).to_owned(),
            false => self.words.part(leaf).to_owned(),
        }
    }

    fn leaf(&self, leaf: Leaf) -> String {
        let leaves = &self.code.leaves;
        let name = (leaves.name)(self, leaf);
        let is_plain = match leaf.field {
            Field::Datum(k) => {
                let is_formula = self.problem.data[k].space.is_none();
                is_formula || leaf.axis.is_none() && !leaves.sided_data
            }
            _ => false,
        };
        if is_plain {
            return name;
        }
        let axes = [leaf.axis, leaf.second].into_iter().flatten();
        let letters: String = axes.clone().map(|k| ["x", "y", "z"][k]).collect();
        let is_test = matches!(leaf.field, Field::Test(_) | Field::Increment(_));
        let sided = |text| (self.code.on_side)(text, leaf.side);
        let of = |pattern: &str| {
            let put = |name: &str| pattern.replace('@', &letters).replace('%', name);
            match leaves.side_first {
                true if is_test => put(&name),
                true => put(&sided(name.clone())),
                false => sided(put(&name)),
            }
        };
        let space = self.space(leaf.field);
        let whole = space.filter(|space| space.element.is_vector());
        let dim = self.problem.dim;
        if let (Some([divergence, curl]), Some(space), Some(axis)) =
            (leaves.whole, whole, leaf.axis)
        {
            return match (space.element, dim) {
                (Element::RaviartThomas, _) => format!("({}/{dim})", of(divergence)),
                // The only derivatives are half the components of the curl.
                (_, 2) => format!("({}/2)", of(curl)),
                _ => {
                    let component = (leaves.index)(&[3 - axis - leaf.component]);
                    format!("({}{component}/2)", of(curl))
                }
            };
        }
        let is_vector = match leaves.by_component {
            true => whole.is_some(),
            false => space.is_some_and(|space| space.size.is_some()),
        };
        let component = is_vector.then_some(leaf.component);
        let places: Vec<usize> = component.into_iter().chain(axes).collect();
        let value = match (leaf.axis, leaf.second) {
            (None, _) => of("%"),
            (_, None) => of(leaves.first),
            _ => of(leaves.second),
        };
        match places.is_empty() {
            true => value,
            false => value + &(leaves.index)(&places),
        }
    }

    /// A formula in coordinates and parameters, in the notation of the code.
    pub fn formula(&self, id: Id) -> String {
        let end = |node: Node| self.end(node);
        let spelling = self.code.formulas.with(&end);
        spelling.text(&self.problem.scalars, id, &Shared::new())
    }

    /// The value of a formula without coordinates and parameters.
    pub fn constant(&self, id: Id) -> Option<String> {
        let scalars = &self.problem.scalars;
        let nodes = scalars.nodes_of([id]);
        let is_given = |node| matches!(node, Node::Coordinate(_) | Node::Parameter(_));
        let value = scalars.value(id, &|_| f64::NAN);
        let is_constant = !nodes.iter().any(|id| is_given(scalars.node(*id)));
        (is_constant && value.is_finite()).then(|| format!("{value:?}"))
    }

    /// All versions of a formula for templates.
    pub fn value(&self, id: Id) -> Value {
        let (coordinates, value) = self.code.points;
        let parameter = |k: usize| format!("{}{value}", self.words.parameters[k]);
        context! {
            text => self.formula(id),
            // In the notation of the form.
            plain => comment(&plain(&self.problem, id)),
            // With NumPy's functions, in the shape of the coordinates.
            at_points => points::numpy(&self.problem.scalars, id, coordinates, &parameter),
            is_number => self.problem.scalars.number_of(id).is_some(),
            constant => self.constant(id),
        }
    }

    /// Names for subexpressions that occur more than once in some expressions, with their values, in order of dependence.
    pub fn share(&self, roots: &[Id]) -> (Vec<(String, String)>, Shared) {
        let code = self.code;
        let mut words = Words::new(&self.problem, code.reserved, code.first, code.mark);
        let end = |node: Node| self.end(node);
        let spelling = code.form.with(&end);
        let mut known = Shared::new();
        let mut all = Vec::new();
        for (id, name) in shared(&self.problem.scalars, roots, &mut words) {
            let value = spelling.definition(&self.problem.scalars, id, &known);
            all.push((name.clone(), value));
            known.insert(id, name);
        }
        (all, known)
    }

    /// A sum of products of coefficients with values and derivatives of functions, term by term: as text, and `signed` as in `a`, `+ b`, `- c`.
    pub fn sum(
        &self,
        products: impl IntoIterator<Item = (Id, Vec<Leaf>)>,
        known: &Shared,
    ) -> Vec<Value> {
        let end = |node: Node| self.end(node);
        let spelling = self.code.form.with(&end);
        let scalars = &self.problem.scalars;
        let each = products.into_iter().enumerate();
        let each = each.map(|(k, (coefficient, leaves))| {
            let leaves = leaves.into_iter().map(|leaf| self.leaf(leaf));
            let leaves = leaves.collect::<Vec<_>>().join("*");
            let text = match scalars.number_of(coefficient) {
                Some(1.0) if self.code.signs => leaves,
                Some(-1.0) if self.code.signs => format!("-{leaves}"),
                _ if self.code.brackets => {
                    let coefficient = spelling.text(scalars, coefficient, known);
                    format!("({coefficient})*{leaves}")
                }
                _ => format!("{}*{leaves}", spelling.factor(scalars, coefficient, known)),
            };
            context! { signed => signed(&text, k == 0), text }
        });
        each.collect()
    }
}
