//! The meaning of a term: a tensor, a measure or an integral.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_fem::scene::expression::{Function, Operator};
use faceoff_mesh::error::meant;

use super::{
    Fault, MOST_ENTRIES, Meaning, Reader, Result, Tensor, WORDS, fault, kind_of, scalar, transpose,
};
use crate::grid::Cells;
use crate::problem::Integral;
use crate::scalar::{Field, Id, Leaf, Length, Node, Scalars, Side};

impl Reader<'_> {
    pub(super) fn meaning(&mut self, term: &Term) -> Result<Meaning> {
        let meaning = self.unbounded(term)?;
        match &meaning {
            Meaning::Tensor(tensor)
                if !tensor.entries.iter().all(|e| self.scalars.is_bounded(*e)) =>
            {
                let what = "the components of this expression are too long";
                Err(fault(term, what, "nest fewer functions of tensors"))
            }
            _ => Ok(meaning),
        }
    }

    fn unbounded(&mut self, term: &Term) -> Result<Meaning> {
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
                (Kind::Name(name), _) if ["dx", "ds", "dS"].contains(&name.as_str()) => {
                    return Ok(Meaning::Measure(self.measure(term, name, arguments)?));
                }
                (
                    _,
                    [
                        Term {
                            kind: Kind::Text(side),
                            ..
                        },
                    ],
                ) => self.restricted(term, function, side)?,
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
            Kind::Named(..) => {
                return Err(fault(
                    term,
                    "`=` where a value is needed",
                    "only measures have it: dx(degree=2)",
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

    pub(super) fn named(&mut self, term: &Term, name: &str) -> Result<Meaning> {
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
            "circumradius" if self.names.cells == Cells::Cubes => {
                let what = format!("{} have no circumradius", self.names.cells.names(dim));
                let remedy = "write h, the diameter of the cell";
                return Err(fault(term, what, remedy));
            }
            "h" | "circumradius" | "facet_length" => {
                let length = match name {
                    "h" => Length::Diameter,
                    "circumradius" => Length::Circumradius,
                    _ => Length::Facet,
                };
                scalar(self.scalars.push(Node::Length(length, Side::Here)))
            }
            "dx" | "ds" | "dS" => return Ok(Meaning::Measure(self.measure(term, name, &[])?)),
            _ => match self.field(name) {
                Some(tensor) => tensor,
                None => return Err(self.unknown(term, name)),
            },
        };
        Ok(Meaning::Tensor(tensor))
    }

    /// An unknown, a test function, a parameter or a datum.
    pub(super) fn field(&mut self, name: &str) -> Option<Tensor> {
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
            second: None,
            side: Side::Here,
        };
        let count = shape.iter().product();
        let entries = (0..count).map(|c| self.scalars.leaf(leaf(c))).collect();
        Some(Tensor { shape, entries })
    }

    /// An unknown at the end of the previous step.
    pub(super) fn old(&mut self, term: &Term, of: &Term) -> Result<Tensor> {
        let is_unknown = |name: &String| self.names.unknowns.iter().any(|u| u.name == *name);
        let Kind::Name(name) = &of.kind else {
            return Err(fault(
                of,
                "this is not an unknown",
                "write old(u), as in grad(old(u))",
            ));
        };
        if !is_unknown(name) {
            let known = self.names.unknowns.iter().map(|u| u.name.as_str());
            let known: Vec<&str> = known.collect();
            let remedy = match known.is_empty() {
                true => "old is for F only".to_owned(),
                false => format!("the unknowns are {}", known.join(", ")),
            };
            return Err(fault(of, format!("`{name}` is not an unknown"), remedy));
        }
        if !self.names.is_timed {
            let what =
                format!("old({name}) is {name} a step before, and there are no steps in time");
            return Err(fault(term, what, "add [time] with step and end"));
        }
        let tensor = self.tensor(of)?;
        Ok(self.each(tensor, |s, entry| match s.node(entry) {
            Node::Leaf(
                leaf @ Leaf {
                    field: Field::Unknown(k),
                    ..
                },
            ) => s.leaf(Leaf {
                field: Field::Old(k),
                ..leaf
            }),
            _ => entry,
        }))
    }

    pub(super) fn test(&mut self, term: &Term, name: &str) -> Result<Tensor> {
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

    pub(super) fn unknown(&self, term: &Term, name: &str) -> Fault {
        if ["test", "free", "F"].contains(&name) {
            let what = format!("`{name}` is not a value");
            return fault(term, what, "test functions are called v, or test.u");
        }
        if WORDS.contains(&name) || Function::of_name(name).is_some() {
            let remedy = format!("write its arguments: {name}(…)");
            return fault(term, format!("`{name}` is a function"), remedy);
        }
        let of = &self.names;
        let known = of
            .unknowns
            .iter()
            .flat_map(|u| [u.name.as_str(), u.test.as_str()])
            .filter(|name| !name.is_empty());
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

    pub(super) fn each(&mut self, mut a: Tensor, of: impl Fn(&mut Scalars, Id) -> Id) -> Tensor {
        for entry in &mut a.entries {
            *entry = of(self.scalars, *entry);
        }
        a
    }

    pub(super) fn negated(&mut self, mut integrals: Vec<Integral>) -> Vec<Integral> {
        for entry in integrals.iter_mut().flat_map(|i| i.terms.values_mut()) {
            *entry = self.scalars.negative(*entry);
        }
        integrals
    }

    pub(super) fn binary(
        &mut self,
        term: &Term,
        operator: Operator,
        sides: &[Term; 2],
    ) -> Result<Meaning> {
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

    pub(super) fn list(&mut self, term: &Term, parts: &[Term]) -> Result<Tensor> {
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

    pub(super) fn limited(&self, term: &Term, tensor: Tensor) -> Result<Tensor> {
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
    pub(super) fn component(&mut self, a: &Term, at: &[Term]) -> Result<Tensor> {
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
}
