//! The functions of the language.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_fem::scene::expression::{Comparison, Function};
use faceoff_mesh::error::meant;

use super::{Reader, Result, Tensor, WORDS, fault, kind_of, scalar, transpose};
use crate::problem::Element;
use crate::scalar::{Id, Side};

impl Reader<'_> {
    pub(super) fn matrix(&mut self, term: &Term) -> Result<Tensor> {
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
    pub(super) fn square(&mut self, term: &Term) -> Result<(Tensor, usize)> {
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

    pub(super) fn call(&mut self, term: &Term, name: &str, arguments: &[Term]) -> Result<Tensor> {
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
                self.not_zero(term, &a, "div", Element::Nedelec)?;
                let grad = self.gradient(term, &a)?;
                let shape = a.shape[..a.shape.len() - 1].to_vec();
                let rows = grad.entries.chunks(dim * dim);
                let entries = rows.map(|row| self.scalars.sum((0..dim).map(|k| row[k * dim + k])));
                Ok(Tensor {
                    entries: entries.collect(),
                    shape,
                })
            }
            "old" => {
                takes(&[1])?;
                self.old(term, first)
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
                    let known = WORDS[12..37].iter().copied();
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

    pub(super) fn contract(&mut self, a: &[Id], b: &[Id]) -> Id {
        let products: Vec<Id> = a
            .iter()
            .zip(b)
            .map(|(a, b)| self.scalars.multiply(*a, *b))
            .collect();
        self.scalars.sum(products)
    }

    /// The last dimension of a with the first of b.
    pub(super) fn dot(&mut self, term: &Term, a: &Tensor, b: &Tensor) -> Result<Tensor> {
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

    /// The determinant, the inverse, or the matrix of cofactors, det(A) A⁻ᵀ.
    pub(super) fn minors(&mut self, a: &Tensor, size: usize, name: &str) -> Tensor {
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
