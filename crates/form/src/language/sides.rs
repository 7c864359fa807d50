//! Derivatives, and the sides of interior facets.

use faceoff_fem::scene::expression::syntax::Term;

use super::{Reader, Result, Tensor, fault, kind_of, scalar};
use crate::scalar::{Field, Id, Leaf, Node, Side};

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
                Node::Diameter(Side::Here) => Some(s.push(Node::Diameter(to))),
                _ => None,
            })
        })
    }

    /// ∂/∂x_axis, by the chain rule.
    pub(super) fn slope(&mut self, term: &Term, id: Id, axis: usize) -> Result<Id> {
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
