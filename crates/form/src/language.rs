//! The language of forms: terms to tensors of scalars, with their types checked, and to integrals.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_fem::scene::expression::{Comparison, Function, Operator};
use faceoff_mesh::error::meant;

use crate::problem::{Datum, Domain, Group, Integral, Measure, Parameter, Unknown};
use crate::scalar::{Field, Id, Leaf, Node, NotLinear, Scalars, Side};

/// The words that mean something: no parameter, datum or unknown may have such a name.
pub const WORDS: [&str; 36] = [
    "x",
    "y",
    "z",
    "pi",
    "n",
    "h",
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
    "free",
    "F",
];

/// A tensor has at most as many entries as one of rank 4 in 3D.
const MOST_ENTRIES: usize = 81;

/// What is wrong with a text, where in it, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// In characters, from 0.
    pub at: usize,
    /// What is wrong there.
    pub what: String,
    /// What to do about it.
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

/// What a term means.
enum Meaning {
    Tensor(Tensor),
    Measure(Measure),
    Form(Vec<Integral>),
}

/// The names that a text may use.
pub struct Names<'a> {
    /// 2 or 3.
    pub dim: usize,
    /// Empty where only data are allowed.
    pub unknowns: &'a [Unknown],
    /// Known numbers.
    pub parameters: &'a [Parameter],
    /// Known functions.
    pub data: &'a [Datum],
    /// Those of the mesh.
    pub groups: &'a [Group],
}

/// Reads terms with some names.
pub struct Reader<'a> {
    names: Names<'a>,
    scalars: &'a mut Scalars,
}

/// The shape in words.
fn kind_of(shape: &[usize]) -> String {
    match shape {
        [] => "a scalar".into(),
        [n] => format!("a vector of {n} components"),
        [n, m] => format!("a {n} × {m} matrix"),
        _ => format!("a tensor of rank {}", shape.len()),
    }
}

impl<'a> Reader<'a> {
    /// A reader that adds what it reads to `scalars`.
    pub fn new(names: Names<'a>, scalars: &'a mut Scalars) -> Self {
        Reader { names, scalars }
    }

    /// The integrals of a form.
    ///
    /// # Errors
    /// What is not in the language, or does not fit together.
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
    /// As [`Self::form`].
    pub fn scalar(&mut self, term: &Term) -> Result<Id> {
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

    fn tensor(&mut self, term: &Term) -> Result<Tensor> {
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

    fn meaning(&mut self, term: &Term) -> Result<Meaning> {
        let tensor = match &term.kind {
            Kind::Number(value) => scalar(self.scalars.number(*value)),
            Kind::Name(name) => return self.named(term, name),
            Kind::Negative(a) => match self.meaning(a)? {
                Meaning::Form(integrals) => return Ok(Meaning::Form(self.negated(integrals))),
                Meaning::Tensor(a) => self.each(a, |s, a| s.negative(a)),
                Meaning::Measure(_) => return Err(self.bare_measure(a)),
            },
            Kind::Binary(operator, sides) => return self.binary(term, *operator, sides),
            Kind::List(parts) => self.list(term, parts)?,
            Kind::Index(a, at) => self.component(a, at)?,
            Kind::Member(a, name) => match (&a.kind, name.as_str()) {
                (Kind::Name(test), name) if test == "test" => self.test(term, name)?,
                (_, "T") => {
                    let a = self.matrix(a)?;
                    transpose(&a)
                }
                _ => {
                    return Err(fault(
                        term,
                        format!("there is no `.{name}`"),
                        "known are .T of matrices and test.NAME of unknowns",
                    ));
                }
            },
            Kind::Call(function, arguments) => match (&function.kind, &arguments[..]) {
                (
                    _,
                    [
                        Term {
                            kind: Kind::Text(side),
                            ..
                        },
                    ],
                ) => self.restricted(term, function, side)?,
                (Kind::Name(name), _) if ["dx", "ds", "dS"].contains(&name.as_str()) => {
                    return Ok(Meaning::Measure(self.measure(name, arguments)?));
                }
                (Kind::Name(name), _) => self.call(term, name, arguments)?,
                _ => {
                    return Err(fault(
                        function,
                        "this is not a function",
                        "multiply with *, and take sides of a facet by ('+') and ('-')",
                    ));
                }
            },
            Kind::Compare(..) => {
                return Err(fault(
                    term,
                    "a comparison where a value is needed",
                    "use it in conditional(a < b, c, d)",
                ));
            }
            Kind::Text(_) => {
                return Err(fault(
                    term,
                    "a text where a value is needed",
                    "only sides are texts: u('+')",
                ));
            }
        };
        Ok(Meaning::Tensor(tensor))
    }

    fn named(&mut self, term: &Term, name: &str) -> Result<Meaning> {
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
        let dim = self.names.dim;
        let tensor = match name {
            _ if axis.is_some_and(|axis| axis < dim) => {
                scalar(self.scalars.push(Node::Coordinate(axis.unwrap_or(0))))
            }
            "z" => {
                return Err(fault(
                    term,
                    "there is no z in 2D",
                    "the coordinates are x and y",
                ));
            }
            "pi" => scalar(self.scalars.push(Node::Pi)),
            "n" => Tensor {
                shape: vec![dim],
                entries: (0..dim)
                    .map(|k| self.scalars.push(Node::Normal(k, Side::Here)))
                    .collect(),
            },
            "h" => scalar(self.scalars.push(Node::Diameter(Side::Here))),
            "dx" | "ds" | "dS" => return Ok(Meaning::Measure(self.measure(name, &[])?)),
            _ => match self.field(name) {
                Some(tensor) => tensor,
                None => return Err(self.unknown(term, name)),
            },
        };
        Ok(Meaning::Tensor(tensor))
    }

    /// An unknown, a test function, a parameter or a datum.
    fn field(&mut self, name: &str) -> Option<Tensor> {
        if let Some(k) = self.names.parameters.iter().position(|p| p.name == name) {
            return Some(scalar(self.scalars.push(Node::Parameter(k))));
        }
        let unknowns = self.names.unknowns.iter();
        let (field, shape) = if let Some(k) = unknowns.clone().position(|u| u.name == name) {
            (Field::Unknown(k), self.names.unknowns[k].space.shape())
        } else if let Some(k) = unknowns.clone().position(|u| u.test == name) {
            (Field::Test(k), self.names.unknowns[k].space.shape())
        } else {
            let k = self.names.data.iter().position(|d| d.name == name)?;
            (Field::Datum(k), self.names.data[k].shape.clone())
        };
        let leaf = |component| Leaf {
            field,
            component,
            axis: None,
            side: Side::Here,
        };
        let count = shape.iter().product();
        let entries = (0..count).map(|c| self.scalars.leaf(leaf(c))).collect();
        Some(Tensor { shape, entries })
    }

    fn test(&mut self, term: &Term, name: &str) -> Result<Tensor> {
        let found = self.names.unknowns.iter().find(|u| u.name == name);
        let test = found.map(|u| u.test.clone());
        test.and_then(|test| self.field(&test)).ok_or_else(|| {
            let known: Vec<&str> = self
                .names
                .unknowns
                .iter()
                .map(|u| u.name.as_str())
                .collect();
            let what = format!("there is no unknown `{name}`, so that it has no test function");
            fault(term, what, format!("the unknowns are {}", known.join(", ")))
        })
    }

    fn unknown(&self, term: &Term, name: &str) -> Fault {
        if WORDS.contains(&name) || Function::of_name(name).is_some() {
            let remedy = format!("write its arguments: {name}(…)");
            return fault(term, format!("`{name}` is a function"), remedy);
        }
        let of = &self.names;
        let known = of
            .unknowns
            .iter()
            .flat_map(|u| [u.name.as_str(), u.test.as_str()]);
        let known = known
            .chain(of.parameters.iter().map(|p| p.name.as_str()))
            .chain(of.data.iter().map(|d| d.name.as_str()));
        let known: Vec<&str> = known.collect();
        let remedy = match known.is_empty() {
            true => "known are x, y, z, pi and the functions of scenes".to_owned(),
            false => format!(
                "{}declared are {}",
                meant(name, known.iter().copied()),
                known.join(", ")
            ),
        };
        fault(term, format!("`{name}` is not known"), remedy)
    }

    fn each(&mut self, mut a: Tensor, of: impl Fn(&mut Scalars, Id) -> Id) -> Tensor {
        for entry in &mut a.entries {
            *entry = of(self.scalars, *entry);
        }
        a
    }

    fn negated(&mut self, mut integrals: Vec<Integral>) -> Vec<Integral> {
        for entry in integrals.iter_mut().flat_map(|i| i.terms.values_mut()) {
            *entry = self.scalars.negative(*entry);
        }
        integrals
    }

    fn binary(&mut self, term: &Term, operator: Operator, sides: &[Term; 2]) -> Result<Meaning> {
        let [left, right] = sides;
        let meanings = (self.meaning(left)?, self.meaning(right)?);
        Ok(Meaning::Tensor(match (operator, meanings) {
            (Operator::Multiply, (Meaning::Tensor(a), Meaning::Measure(measure))) => {
                let integrand = self.as_scalar(left, &a, "only scalars are integrated")?;
                return Ok(Meaning::Form(vec![
                    self.integral(left, integrand, measure)?,
                ]));
            }
            (Operator::Add | Operator::Subtract, (Meaning::Form(mut a), Meaning::Form(b))) => {
                a.extend(if operator == Operator::Add {
                    b
                } else {
                    self.negated(b)
                });
                return Ok(Meaning::Form(a));
            }
            (Operator::Add | Operator::Subtract, (Meaning::Form(_), Meaning::Tensor(_))) => {
                return Err(fault(
                    right,
                    "this term is not integrated",
                    "end it with a measure: *dx, *ds or *dS",
                ));
            }
            (Operator::Add | Operator::Subtract, (Meaning::Tensor(_), Meaning::Form(_))) => {
                return Err(fault(
                    left,
                    "this term is not integrated",
                    "end it with a measure: *dx, *ds or *dS",
                ));
            }
            (Operator::Multiply, (Meaning::Measure(_), _)) => {
                return Err(fault(
                    left,
                    "a measure before what is integrated",
                    "write it last: f*v*dx",
                ));
            }
            (Operator::Multiply, (Meaning::Form(_), Meaning::Measure(_))) => {
                return Err(fault(
                    right,
                    "a second measure",
                    "each term has one: f*v*dx",
                ));
            }
            (_, (Meaning::Measure(_), _)) => return Err(self.bare_measure(left)),
            (_, (_, Meaning::Measure(_))) => return Err(self.bare_measure(right)),
            (_, (Meaning::Form(_), _) | (_, Meaning::Form(_))) => {
                return Err(fault(
                    term,
                    "an integral where a value is needed",
                    "write factors before the measure: 2*f*v*dx",
                ));
            }
            (Operator::Add | Operator::Subtract, (Meaning::Tensor(a), Meaning::Tensor(b))) => {
                if a.shape != b.shape {
                    let what = format!(
                        "{} and {} cannot be added",
                        kind_of(&a.shape),
                        kind_of(&b.shape)
                    );
                    return Err(fault(term, what, "give both sides one shape"));
                }
                let pairs = a.entries.iter().zip(&b.entries);
                let entries = pairs.map(|(a, b)| match operator {
                    Operator::Add => self.scalars.add(*a, *b),
                    _ => self.scalars.subtract(*a, *b),
                });
                Tensor {
                    entries: entries.collect(),
                    shape: a.shape,
                }
            }
            (Operator::Multiply, (Meaning::Tensor(a), Meaning::Tensor(b))) => {
                let (factor, of) = match (&a.shape[..], &b.shape[..]) {
                    ([], _) => (a.entries[0], b),
                    (_, []) => (b.entries[0], a),
                    (a, b) => {
                        let what = format!("`*` between {} and {}", kind_of(a), kind_of(b));
                        let remedy = "`*` takes a scalar and anything: use dot, inner or outer";
                        return Err(fault(term, what, remedy));
                    }
                };
                self.each(of, |s, entry| s.multiply(factor, entry))
            }
            (Operator::Divide, (Meaning::Tensor(a), Meaning::Tensor(b))) => {
                let below = self.as_scalar(right, &b, "only scalars divide")?;
                if self.scalars.is_zero(below) {
                    return Err(fault(right, "a division by 0", "give another divisor"));
                }
                self.each(a, |s, entry| s.divide(entry, below))
            }
            (Operator::Power, (Meaning::Tensor(a), Meaning::Tensor(b))) => {
                let base = self.as_scalar(left, &a, "only scalars have powers")?;
                let exponent = self.as_scalar(right, &b, "only scalars are exponents")?;
                scalar(self.scalars.power(base, exponent))
            }
        }))
    }

    /// An integral, if what is integrated is linear in the test functions and of its domain.
    fn integral(&mut self, term: &Term, integrand: Id, measure: Measure) -> Result<Integral> {
        let is_sided = |side| side != Side::Here;
        for id in self.scalars.nodes_of([integrand]) {
            let (side, what) = match self.scalars.node(id) {
                Node::Leaf(leaf) => {
                    if let (Field::Datum(k), true) = (leaf.field, leaf.side == Side::Here)
                        && self.names.data[k]
                            .space
                            .is_none_or(|s| s.element.is_continuous() && leaf.axis.is_none())
                    {
                        continue;
                    }
                    (leaf.side, self.field_name(leaf.field))
                }
                Node::Normal(_, side) => (side, "n".to_owned()),
                Node::Diameter(side) => (side, "h".to_owned()),
                _ => continue,
            };
            match measure.domain {
                Domain::Cells if what == "n" => {
                    return Err(fault(
                        term,
                        "n is used with dx, and cells have no normal",
                        "integrate over ds or dS",
                    ));
                }
                Domain::Interior if !is_sided(side) => {
                    return Err(fault(
                        term,
                        format!("{what} has two values on the facets of dS"),
                        format!("take {what}('+'), {what}('-'), jump({what}) or avg({what})"),
                    ));
                }
                Domain::Cells | Domain::Boundary if is_sided(side) => {
                    return Err(fault(
                        term,
                        format!("a side of {what} is taken, and dx and ds have one side"),
                        "integrate over dS, or leave ('+'), ('-'), jump and avg out",
                    ));
                }
                _ => {}
            }
        }
        let is_test = |leaf: &Leaf| matches!(leaf.field, Field::Test(_));
        let terms = self.scalars.linear(integrand, &is_test).map_err(|why| {
            let tests: Vec<&str> = self
                .names
                .unknowns
                .iter()
                .map(|u| u.test.as_str())
                .collect();
            let tests = tests.join(", ");
            let (what, remedy) = match why {
                NotLinear::Without => ("a term without a test function", "multiply it by"),
                NotLinear::Twice => ("a product of two test functions", "F is linear in"),
                NotLinear::Inside => (
                    "a test function inside of a function, power, divisor or condition",
                    "F is linear in",
                ),
            };
            fault(term, what, format!("{remedy} {tests}"))
        })?;
        Ok(Integral { measure, terms })
    }

    fn field_name(&self, field: Field) -> String {
        match field {
            Field::Unknown(k) | Field::Increment(k) => self.names.unknowns[k].name.clone(),
            Field::Test(k) => self.names.unknowns[k].test.clone(),
            Field::Datum(k) => self.names.data[k].name.clone(),
        }
    }

    fn measure(&mut self, name: &str, arguments: &[Term]) -> Result<Measure> {
        let (domain, dim) = match name {
            "dx" => (Domain::Cells, self.names.dim),
            "ds" => (Domain::Boundary, self.names.dim - 1),
            _ => (Domain::Interior, self.names.dim - 1),
        };
        let mut groups = Vec::new();
        let mut all: Vec<&Term> = Vec::new();
        for argument in arguments {
            match &argument.kind {
                Kind::List(parts) => all.extend(parts),
                _ => all.push(argument),
            }
        }
        for term in all {
            let word = match &term.kind {
                Kind::Name(name) | Kind::Text(name) => name.clone(),
                Kind::Number(number) => number.to_string(),
                _ => {
                    return Err(fault(
                        term,
                        "this is not a group",
                        "give names or numbers of groups",
                    ));
                }
            };
            groups.push(
                find_group(self.names.groups, &word, dim)
                    .map_err(|(what, remedy)| fault(term, what, remedy))?,
            );
        }
        groups.sort_unstable();
        groups.dedup();
        Ok(Measure { domain, groups })
    }

    fn list(&mut self, term: &Term, parts: &[Term]) -> Result<Tensor> {
        let parts = parts
            .iter()
            .map(|part| self.tensor(part))
            .collect::<Result<Vec<_>>>()?;
        if let Some(other) = parts.iter().find(|part| part.shape != parts[0].shape) {
            let what = format!(
                "{} beside {} in one list",
                kind_of(&parts[0].shape),
                kind_of(&other.shape)
            );
            return Err(fault(term, what, "give all parts one shape"));
        }
        let mut shape = vec![parts.len()];
        shape.extend(&parts[0].shape);
        let entries: Vec<Id> = parts.into_iter().flat_map(|part| part.entries).collect();
        self.limited(term, Tensor { shape, entries })
    }

    fn limited(&self, term: &Term, tensor: Tensor) -> Result<Tensor> {
        match tensor.entries.len() <= MOST_ENTRIES {
            true => Ok(tensor),
            false => Err(fault(
                term,
                format!("a tensor of more than {MOST_ENTRIES} entries"),
                "contract it first",
            )),
        }
    }

    /// `a[i]`, `a[i, j]`; and `x[i]`, which UFL writes for coordinates.
    fn component(&mut self, a: &Term, at: &[Term]) -> Result<Tensor> {
        let index = |term: &Term, below: usize| match term.kind {
            Kind::Number(k) if k.fract() == 0.0 && k >= 0.0 && k < below as f64 => Ok(k as usize),
            _ => Err(fault(
                term,
                "this is not the number of a component".to_owned(),
                format!("components count from 0 to {}", below - 1),
            )),
        };
        if matches!(&a.kind, Kind::Name(name) if name == "x") && at.len() == 1 {
            let axis = index(&at[0], self.names.dim)?;
            return Ok(scalar(self.scalars.push(Node::Coordinate(axis))));
        }
        let tensor = self.tensor(a)?;
        if at.len() > tensor.shape.len() {
            let what = format!("{} indices of {}", at.len(), kind_of(&tensor.shape));
            return Err(fault(a, what, "give at most one for each dimension"));
        }
        let (outer, inner) = tensor.shape.split_at(at.len());
        let mut first = 0;
        for (term, below) in at.iter().zip(outer) {
            first = first * below + index(term, *below)?;
        }
        let count: usize = inner.iter().product();
        Ok(Tensor {
            shape: inner.to_vec(),
            entries: tensor.entries[first * count..(first + 1) * count].to_vec(),
        })
    }

    fn restricted(&mut self, term: &Term, of: &Term, side: &str) -> Result<Tensor> {
        let side = match side {
            "+" => Side::Plus,
            "-" => Side::Minus,
            _ => {
                return Err(fault(
                    term,
                    format!("there is no side `{side}`"),
                    "take '+' or '-'",
                ));
            }
        };
        let tensor = self.tensor(of)?;
        Ok(self.on_side(tensor, side))
    }

    fn on_side(&mut self, tensor: Tensor, to: Side) -> Tensor {
        let data = self.names.data;
        self.each(tensor, |s, entry| {
            s.map(entry, &mut |s, node| match node {
                // Formulas have one value.
                Node::Leaf(Leaf {
                    field: Field::Datum(k),
                    ..
                }) if data[k].space.is_none() => None,
                Node::Leaf(leaf) if leaf.side == Side::Here => {
                    Some(s.leaf(Leaf { side: to, ..leaf }))
                }
                Node::Normal(k, Side::Here) => Some(s.push(Node::Normal(k, to))),
                Node::Diameter(Side::Here) => Some(s.push(Node::Diameter(to))),
                _ => None,
            })
        })
    }

    /// ∂/∂x_axis, by the chain rule.
    fn slope(&mut self, term: &Term, id: Id, axis: usize) -> Result<Id> {
        let data = self.names.data;
        let mut twice = false;
        let found = self.scalars.derivative(id, &mut |s, node| match node {
            Node::Coordinate(k) => s.number(f64::from(u8::from(k == axis))),
            Node::Leaf(leaf) => match leaf.field {
                Field::Datum(k) if data[k].space.is_none() => {
                    let formula = data[k].components[leaf.component];
                    s.derivative(formula, &mut |s, node| {
                        s.number(f64::from(u8::from(node == Node::Coordinate(axis))))
                    })
                }
                _ => {
                    twice |= leaf.axis.is_some();
                    s.leaf(Leaf {
                        axis: Some(axis),
                        ..leaf
                    })
                }
            },
            // Normals and diameters are constant on a facet or cell.
            _ => s.number(0.0),
        });
        match twice {
            false => Ok(found),
            true => Err(fault(
                term,
                "a second derivative",
                "only first derivatives are in the language: integrate by parts",
            )),
        }
    }

    /// (grad a)_ij = ∂_j a_i: the axis is the last dimension.
    fn gradient(&mut self, term: &Term, a: &Tensor) -> Result<Tensor> {
        let dim = self.names.dim;
        let mut entries = Vec::with_capacity(a.entries.len() * dim);
        for entry in &a.entries {
            for axis in 0..dim {
                entries.push(self.slope(term, *entry, axis)?);
            }
        }
        let mut shape = a.shape.clone();
        shape.push(dim);
        self.limited(term, Tensor { shape, entries })
    }

    fn matrix(&mut self, term: &Term) -> Result<Tensor> {
        let tensor = self.tensor(term)?;
        match tensor.shape.len() {
            2 => Ok(tensor),
            _ => Err(fault(
                term,
                format!(
                    "a matrix is needed here, and this is {}",
                    kind_of(&tensor.shape)
                ),
                "grad of a vector, outer and Identity are matrices",
            )),
        }
    }

    /// A square matrix and its size.
    fn square(&mut self, term: &Term) -> Result<(Tensor, usize)> {
        let matrix = self.matrix(term)?;
        match matrix.shape[0] == matrix.shape[1] && matrix.shape[0] <= 3 {
            true => Ok((matrix.clone(), matrix.shape[0])),
            false => Err(fault(
                term,
                format!(
                    "a square matrix is needed here, and this is {}",
                    kind_of(&matrix.shape)
                ),
                "give as many rows as columns, at most 3",
            )),
        }
    }

    fn call(&mut self, term: &Term, name: &str, arguments: &[Term]) -> Result<Tensor> {
        let takes = |counts: &[usize]| match counts.contains(&arguments.len()) {
            true => Ok(()),
            false => Err(fault(
                term,
                format!(
                    "`{name}` does not take {} argument{}",
                    arguments.len(),
                    if arguments.len() == 1 { "" } else { "s" }
                ),
                format!(
                    "give {}",
                    counts
                        .iter()
                        .map(ToString::to_string)
                        .collect::<Vec<_>>()
                        .join(" or ")
                ),
            )),
        };
        let dim = self.names.dim;
        let first = &arguments[0];
        match name {
            "grad" => {
                takes(&[1])?;
                let a = self.tensor(first)?;
                self.gradient(term, &a)
            }
            "div" => {
                takes(&[1])?;
                let a = self.tensor(first)?;
                if a.shape.last() != Some(&dim) {
                    let what = format!("div of {}", kind_of(&a.shape));
                    let remedy =
                        format!("it takes what has {dim} components along its last dimension");
                    return Err(fault(term, what, remedy));
                }
                let grad = self.gradient(term, &a)?;
                let shape = a.shape[..a.shape.len() - 1].to_vec();
                let rows = grad.entries.chunks(dim * dim);
                let entries = rows.map(|row| self.scalars.sum((0..dim).map(|k| row[k * dim + k])));
                Ok(Tensor {
                    entries: entries.collect(),
                    shape,
                })
            }
            "curl" | "rot" => {
                takes(&[1])?;
                self.curl(term, first, name)
            }
            "dot" => {
                takes(&[2])?;
                let [a, b] = [self.tensor(first)?, self.tensor(&arguments[1])?];
                self.dot(term, &a, &b)
            }
            "inner" => {
                takes(&[2])?;
                let [a, b] = [self.tensor(first)?, self.tensor(&arguments[1])?];
                if a.shape != b.shape {
                    let what = format!("inner of {} and {}", kind_of(&a.shape), kind_of(&b.shape));
                    return Err(fault(term, what, "give both one shape, or use dot"));
                }
                Ok(scalar(self.contract(&a.entries, &b.entries)))
            }
            "outer" => {
                takes(&[2])?;
                let [a, b] = [self.tensor(first)?, self.tensor(&arguments[1])?];
                let shape = [&a.shape[..], &b.shape[..]].concat();
                let mut entries = Vec::new();
                for p in &a.entries {
                    entries.extend(b.entries.iter().map(|q| self.scalars.multiply(*p, *q)));
                }
                self.limited(term, Tensor { shape, entries })
            }
            "cross" => {
                takes(&[2])?;
                let [a, b] = [self.tensor(first)?, self.tensor(&arguments[1])?];
                if a.shape != [3] || b.shape != [3] {
                    let what = format!("cross of {} and {}", kind_of(&a.shape), kind_of(&b.shape));
                    return Err(fault(term, what, "it takes two vectors of 3 components"));
                }
                let (a, b) = (a.entries, b.entries);
                let entries = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
                    let [left, right] = [
                        self.scalars.multiply(a[i], b[j]),
                        self.scalars.multiply(a[j], b[i]),
                    ];
                    self.scalars.subtract(left, right)
                });
                Ok(Tensor {
                    shape: vec![3],
                    entries: entries.into(),
                })
            }
            "Identity" => {
                takes(&[1])?;
                let size = match first.kind {
                    Kind::Number(size) if [1.0, 2.0, 3.0].contains(&size) => size as usize,
                    _ => {
                        return Err(fault(
                            first,
                            "this is not the size of a matrix",
                            "give 1, 2 or 3",
                        ));
                    }
                };
                let entry = |k: usize| f64::from(u8::from(k / size == k % size));
                Ok(Tensor {
                    shape: vec![size, size],
                    entries: (0..size * size)
                        .map(|k| self.scalars.number(entry(k)))
                        .collect(),
                })
            }
            "transpose" => {
                takes(&[1])?;
                Ok(transpose(&self.matrix(first)?))
            }
            "sym" | "skew" => {
                takes(&[1])?;
                let (a, _) = self.square(first)?;
                let half = self.scalars.number(0.5);
                let pairs = a.entries.iter().zip(transpose(&a).entries);
                let entries = pairs.map(|(p, q)| {
                    let both = match name {
                        "sym" => self.scalars.add(*p, q),
                        _ => self.scalars.subtract(*p, q),
                    };
                    self.scalars.multiply(half, both)
                });
                Ok(Tensor {
                    entries: entries.collect(),
                    shape: a.shape,
                })
            }
            "tr" | "dev" => {
                takes(&[1])?;
                let (mut a, size) = self.square(first)?;
                let trace = self.scalars.sum((0..size).map(|k| a.entries[k * size + k]));
                if name == "tr" {
                    return Ok(scalar(trace));
                }
                let part = self.scalars.number(1.0 / size as f64);
                let mean = self.scalars.multiply(part, trace);
                for k in 0..size {
                    let at = k * size + k;
                    a.entries[at] = self.scalars.subtract(a.entries[at], mean);
                }
                Ok(a)
            }
            "det" | "inv" | "cofac" => {
                takes(&[1])?;
                let (a, size) = self.square(first)?;
                Ok(self.minors(&a, size, name))
            }
            "jump" => {
                takes(&[1, 2])?;
                let a = self.tensor(first)?;
                let [plus, minus] =
                    [Side::Plus, Side::Minus].map(|side| self.on_side(a.clone(), side));
                let Some(normal) = arguments.get(1) else {
                    return Ok(self.combined(plus, minus, 1.0, -1.0));
                };
                // jump(a, n) = a⁺·n⁺ + a⁻·n⁻
                let normal = self.tensor(normal)?;
                let [np, nm] =
                    [Side::Plus, Side::Minus].map(|side| self.on_side(normal.clone(), side));
                let [p, m] = [(plus, np), (minus, nm)].map(|(a, n)| match a.shape.is_empty() {
                    true => Ok(self.each(n, |s, n| s.multiply(a.entries[0], n))),
                    false => self.dot(term, &a, &n),
                });
                Ok(self.combined(p?, m?, 1.0, 1.0))
            }
            "avg" => {
                takes(&[1])?;
                let a = self.tensor(first)?;
                let [plus, minus] =
                    [Side::Plus, Side::Minus].map(|side| self.on_side(a.clone(), side));
                Ok(self.combined(plus, minus, 0.5, 0.5))
            }
            "conditional" | "if" => {
                takes(&[3])?;
                let Kind::Compare(comparison, sides) = &first.kind else {
                    let remedy = format!("{name}(a < b, c, d) is c where a < b, else d");
                    return Err(fault(
                        first,
                        format!("`{name}` needs a comparison first"),
                        remedy,
                    ));
                };
                let parts = [&sides[0], &sides[1], &arguments[1], &arguments[2]];
                let [a, b, then, otherwise] = parts.map(|part| self.scalar(part));
                Ok(scalar(
                    self.scalars
                        .choose(*comparison, [a?, b?, then?, otherwise?]),
                ))
            }
            "pow" => {
                takes(&[2])?;
                let [a, b] = [self.scalar(first)?, self.scalar(&arguments[1])?];
                Ok(scalar(self.scalars.power(a, b)))
            }
            "pos" => {
                takes(&[1])?;
                let (a, zero) = (self.scalar(first)?, self.scalars.number(0.0));
                Ok(scalar(self.scalars.call(Function::Max, a, Some(zero))))
            }
            "sign" => {
                takes(&[1])?;
                let a = self.scalar(first)?;
                let [minus, zero, one] = [-1.0, 0.0, 1.0].map(|value| self.scalars.number(value));
                let rest = self
                    .scalars
                    .choose(Comparison::Less, [a, zero, minus, zero]);
                Ok(scalar(
                    self.scalars
                        .choose(Comparison::Greater, [a, zero, one, rest]),
                ))
            }
            _ => {
                let Some((function, count)) = Function::of_name(name) else {
                    if self.field(name).is_some() {
                        let remedy =
                            "multiply with *, and take sides of a facet by ('+') and ('-')";
                        return Err(fault(term, format!("`{name}` is not a function"), remedy));
                    }
                    let known = WORDS[10..34].iter().copied();
                    let remedy = format!(
                        "{}docs/reference/form.md has all functions",
                        meant(name, known)
                    );
                    return Err(fault(
                        term,
                        format!("there is no function `{name}`"),
                        remedy,
                    ));
                };
                takes(&[count])?;
                let a = self.scalar(first)?;
                let b = arguments.get(1).map(|b| self.scalar(b)).transpose()?;
                Ok(scalar(self.scalars.call(function, a, b)))
            }
        }
    }

    fn contract(&mut self, a: &[Id], b: &[Id]) -> Id {
        let products: Vec<Id> = a
            .iter()
            .zip(b)
            .map(|(a, b)| self.scalars.multiply(*a, *b))
            .collect();
        self.scalars.sum(products)
    }

    /// The last dimension of a with the first of b.
    fn dot(&mut self, term: &Term, a: &Tensor, b: &Tensor) -> Result<Tensor> {
        let (Some(size), Some(other)) = (a.shape.last(), b.shape.first()) else {
            let what = format!("dot of {} and {}", kind_of(&a.shape), kind_of(&b.shape));
            return Err(fault(
                term,
                what,
                "it takes vectors and matrices; scalars are multiplied with *",
            ));
        };
        if size != other {
            let what = format!("dot of {} and {}", kind_of(&a.shape), kind_of(&b.shape));
            let remedy = "the last dimension of the first must be the first of the second";
            return Err(fault(term, what, remedy));
        }
        let shape = [&a.shape[..a.shape.len() - 1], &b.shape[1..]].concat();
        let columns = b.entries.len() / size;
        let mut entries = Vec::new();
        for row in a.entries.chunks(*size) {
            for j in 0..columns {
                let column: Vec<Id> = (0..*size).map(|k| b.entries[k * columns + j]).collect();
                entries.push(self.contract(row, &column));
            }
        }
        self.limited(term, Tensor { shape, entries })
    }

    fn combined(&mut self, a: Tensor, b: Tensor, p: f64, q: f64) -> Tensor {
        let [p, q] = [p, q].map(|value| self.scalars.number(value));
        let pairs = a.entries.iter().zip(&b.entries);
        let entries = pairs.map(|(a, b)| {
            let [a, b] = [self.scalars.multiply(p, *a), self.scalars.multiply(q, *b)];
            self.scalars.add(a, b)
        });
        Tensor {
            entries: entries.collect(),
            shape: a.shape,
        }
    }

    /// In 2D, curl of a vector is ∂₀a₁ - ∂₁a₀, and that of a scalar (∂₁a, -∂₀a).
    fn curl(&mut self, term: &Term, of: &Term, name: &str) -> Result<Tensor> {
        let a = self.tensor(of)?;
        let dim = self.names.dim;
        let difference = |reader: &mut Self, i: usize, j: usize| -> Result<Id> {
            let [p, q] = [
                reader.slope(term, a.entries[j], i)?,
                reader.slope(term, a.entries[i], j)?,
            ];
            Ok(reader.scalars.subtract(p, q))
        };
        match (&a.shape[..], dim) {
            ([2], 2) => Ok(scalar(difference(self, 0, 1)?)),
            ([], 2) => {
                let [p, q] = [
                    self.slope(term, a.entries[0], 1)?,
                    self.slope(term, a.entries[0], 0)?,
                ];
                let q = self.scalars.negative(q);
                Ok(Tensor {
                    shape: vec![2],
                    entries: vec![p, q],
                })
            }
            ([3], 3) => Ok(Tensor {
                shape: vec![3],
                entries: vec![
                    difference(self, 1, 2)?,
                    difference(self, 2, 0)?,
                    difference(self, 0, 1)?,
                ],
            }),
            _ => Err(fault(
                term,
                format!("{name} of {} in {dim}D", kind_of(&a.shape)),
                "it takes a vector of as many components as there are dimensions; in 2D a scalar as well",
            )),
        }
    }

    /// The determinant, the inverse, or the matrix of cofactors, det(A) A⁻ᵀ.
    fn minors(&mut self, a: &Tensor, size: usize, name: &str) -> Tensor {
        let at = |i: usize, j: usize| a.entries[(i % size) * size + j % size];
        let s = &mut *self.scalars;
        let mut two = |p: [Id; 4]| {
            let [left, right] = [s.multiply(p[0], p[3]), s.multiply(p[1], p[2])];
            s.subtract(left, right)
        };
        let mut cofactors = Vec::new();
        for k in 0..size * size {
            let (i, j) = (k / size, k % size);
            cofactors.push(match size {
                1 => None,
                2 => Some((at(i + 1, j + 1), i != j)),
                // Cyclic indices give the sign as well.
                _ => Some((
                    two([
                        at(i + 1, j + 1),
                        at(i + 1, j + 2),
                        at(i + 2, j + 1),
                        at(i + 2, j + 2),
                    ]),
                    false,
                )),
            });
        }
        let cofactors: Vec<Id> = cofactors
            .into_iter()
            .map(|found| match found {
                None => self.scalars.number(1.0),
                Some((minor, true)) => self.scalars.negative(minor),
                Some((minor, false)) => minor,
            })
            .collect();
        let cofactor = Tensor {
            shape: a.shape.clone(),
            entries: cofactors,
        };
        if name == "cofac" {
            return cofactor;
        }
        let det = self.contract(&a.entries[..size], &cofactor.entries[..size]);
        if name == "det" {
            return scalar(det);
        }
        self.each(transpose(&cofactor), |s, entry| s.divide(entry, det))
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

/// The position of the group of this name or number.
///
/// # Errors
/// What is wrong, and what to do.
pub fn find_group(
    groups: &[Group],
    word: &str,
    dim: usize,
) -> std::result::Result<usize, (String, String)> {
    let is_meant = |group: &&Group| group.name == word || group.tag.to_string() == word;
    let found = groups
        .iter()
        .enumerate()
        .find(|(_, group)| group.dim == dim && is_meant(group));
    found.map(|(k, _)| k).ok_or_else(|| {
        let of_dim = groups.iter().filter(|group| group.dim == dim);
        let known: Vec<&str> = of_dim.map(|group| group.name.as_str()).collect();
        let other = groups.iter().find(is_meant).map(|group| group.dim);
        let what = match other {
            Some(other) => {
                format!("the group `{word}` has cells of dimension {other}, and {dim} is needed")
            }
            None => format!("the mesh has no group `{word}`"),
        };
        let remedy = format!(
            "{}the groups of dimension {dim} are {}",
            meant(word, known.iter().copied()),
            known.join(", ")
        );
        (what, remedy)
    })
}
