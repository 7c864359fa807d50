//! Derivatives, and the sides of interior facets.

use faceoff_fem::scene::expression::syntax::Term;

use super::{Names, Reader, Result, Tensor, fault, kind_of, scalar};
use crate::grid::Cells;
use crate::problem::{Element, Space};
use crate::scalar::{Field, Id, Leaf, Node, Scalars, Side};

impl Reader<'_> {
    pub(super) fn restricted(&mut self, term: &Term, of: &Term, side: &str) -> Result<Tensor> {
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

    pub(super) fn on_side(&mut self, tensor: Tensor, to: Side) -> Tensor {
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
                Node::Length(length, Side::Here) => Some(s.push(Node::Length(length, to))),
                _ => None,
            })
        })
    }

    /// ∂/∂x_axis, by the chain rule.
    pub(super) fn slope(&mut self, term: &Term, id: Id, axis: usize) -> Result<Id> {
        let Names {
            data,
            unknowns,
            dim,
            cells,
            ..
        } = self.names;
        let mut refused = None;
        let found = self.scalars.derivative(id, &mut |s, node| match node {
            Node::Coordinate(k) => s.number(f64::from(u8::from(k == axis))),
            Node::Leaf(leaf) => match leaf.field {
                Field::Datum(k) if data[k].space.is_none() => {
                    let formula = data[k].components[leaf.component];
                    s.derivative(formula, &mut |s, node| {
                        s.number(f64::from(u8::from(node == Node::Coordinate(axis))))
                    })
                }
                Field::Datum(_) => {
                    if leaf.axis.is_some() {
                        refused = Some((
                            "a second derivative of data that are interpolated".to_owned(),
                            "give the datum as a formula: f = \"…\"",
                        ));
                    }
                    s.leaf(Leaf {
                        axis: Some(axis),
                        ..leaf
                    })
                }
                Field::Unknown(k) | Field::Old(k) | Field::Increment(k) | Field::Test(k) => {
                    let space = unknowns[k].space;
                    let found = match leaf.axis {
                        Some(_) if cells == Cells::Cubes => Err((
                            format!("a second derivative on {}", cells.names(dim)),
                            "only triangles and tetrahedra have them here: leave this term out, or take such a mesh",
                        )),
                        _ => partial(s, space, leaf, axis, dim),
                    };
                    found.unwrap_or_else(|fault| {
                        refused = Some(fault);
                        s.number(0.0)
                    })
                }
            },
            // Normals and lengths are constant on a facet or cell.
            _ => s.number(0.0),
        });
        match refused {
            None => Ok(found),
            Some((what, remedy)) => Err(fault(term, what, remedy)),
        }
    }

    /// Rejects a derivative that is 0 for all functions of a space.
    pub(super) fn not_zero(
        &self,
        term: &Term,
        of: &Tensor,
        name: &str,
        element: Element,
    ) -> Result<()> {
        let is_of_it = |id: &Id| match self.scalars.node(*id) {
            Node::Leaf(Leaf {
                field: Field::Unknown(k) | Field::Old(k) | Field::Test(k),
                axis: None,
                ..
            }) => self.names.unknowns[k].space.element == element,
            _ => false,
        };
        match of.entries.iter().all(is_of_it) {
            false => Ok(()),
            true => {
                let what = format!("the {name} of {} functions is 0", element.name());
                let remedy = match element {
                    Element::RaviartThomas => "RT0 functions have a div; N1curl functions a curl",
                    _ => "N1curl functions have a curl; RT0 functions a div",
                };
                Err(fault(term, what, remedy))
            }
        }
    }

    /// (grad a)_ij = ∂_j a_i: the axis is the last dimension.
    pub(super) fn gradient(&mut self, term: &Term, a: &Tensor) -> Result<Tensor> {
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

    pub(super) fn combined(&mut self, a: Tensor, b: Tensor, p: f64, q: f64) -> Tensor {
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
    pub(super) fn curl(&mut self, term: &Term, of: &Term, name: &str) -> Result<Tensor> {
        let a = self.tensor(of)?;
        let dim = self.names.dim;
        self.not_zero(term, &a, name, Element::RaviartThomas)?;
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
}

/// ∂/∂x_axis of a component of a function in a space, or of its derivative.
///
/// On a cell, the gradient of a + b x (Raviart–Thomas) is b I, and that of a + b × x (Nédélec) is skew: their entries are one number, or the
/// components of one vector, so that codes only need div or curl.
fn partial(
    s: &mut Scalars,
    space: Space,
    leaf: Leaf,
    axis: usize,
    dim: usize,
) -> std::result::Result<Id, (String, &'static str)> {
    let first = |component, axis| Leaf {
        component,
        axis: Some(axis),
        ..leaf
    };
    let name = || space.element.name();
    match (leaf.axis, leaf.second, space.element) {
        (None, _, Element::RaviartThomas) => Ok(match leaf.component == axis {
            true => s.leaf(first(0, 0)),
            false => s.number(0.0),
        }),
        (None, _, Element::Nedelec) => {
            let (i, j) = (leaf.component, axis);
            let is_first = |i, j| match dim {
                2 => (i, j) == (1, 0),
                _ => i == (j + 1) % 3,
            };
            if i == j {
                return Ok(s.number(0.0));
            }
            if is_first(i, j) {
                return Ok(s.leaf(first(i, j)));
            }
            let found = s.leaf(first(j, i));
            Ok(s.negative(found))
        }
        (None, ..) => Ok(s.leaf(first(leaf.component, axis))),
        (Some(_), None, element) if element.degree() < 2 => Err((
            format!(
                "the second derivatives of {} functions are 0 in every cell",
                name()
            ),
            "leave this term out, or take a space of degree 2",
        )),
        (Some(before), None, _) => Ok(s.leaf(Leaf {
            axis: Some(before.min(axis)),
            second: Some(before.max(axis)),
            ..leaf
        })),
        (Some(_), Some(_), _) => Err((
            "a third derivative".to_owned(),
            "the language has first and second derivatives: integrate by parts",
        )),
    }
}
