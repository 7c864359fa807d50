//! Applies two matrices to fields that are linear in x, whose dofs are known without the basis.
//!
//! A dof with the values d for the constant fields along the axes has the value d · w(x) for a linear field w at its position x: this is exact for values at
//! nodes, and for means on facets and edges.

use serde::Serialize;

use super::difference::Both;

/// The remainder of a field in the rows that no constrained dof touches, relative to the sizes of their terms: rounding if the field is in the kernel.
#[derive(Debug, Clone, Serialize)]
pub struct Kernel {
    /// The field.
    pub of: String,
    /// `constants`, `rotations`, or `gradients` of quadratic functions.
    pub kind: &'static str,
    /// For the first and the second matrix.
    pub left: [f64; 2],
    /// For their difference, relative to the sizes of its terms; `None` if the difference is rounding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_difference: Option<f64>,
}

/// Energies of constant fields and constant gradients per volume.
#[derive(Debug, Clone, Serialize)]
pub struct Energies {
    /// The field.
    pub of: String,
    /// The name of the constant.
    pub name: String,
    /// For the first and the second matrix.
    pub values: [f64; 2],
}

/// The largest remainder of a field in a kernel.
pub const NOTHING: f64 = 1e-10;

/// A linear field: the values at 0 and the gradients of its components.
#[derive(Clone, Copy, Default)]
struct Linear {
    constant: [f64; 3],
    gradient: [[f64; 3]; 3],
}

impl Linear {
    fn constant(axis: usize) -> Self {
        let mut w = Linear::default();
        w.constant[axis] = 1.0;
        w
    }

    /// Component i is the sum of these factors times coordinates.
    fn gradient(entries: &[(usize, usize, f64)]) -> Self {
        let mut w = Linear::default();
        entries.iter().for_each(|(i, j, a)| w.gradient[*i][*j] = *a);
        w
    }

    fn dofs(&self, both: &Both<'_>, field: usize) -> Vec<f64> {
        let dofs = &both.a.dofs;
        let each = dofs.direction.iter().zip(&dofs.at).zip(&dofs.field);
        each.map(|((d, x), own)| {
            if usize::from(*own) != field {
                return 0.0;
            }
            let value = |i: usize| {
                self.constant[i] + (0..3).map(|j| self.gradient[i][j] * x[j]).sum::<f64>()
            };
            (0..3).map(|i| d[i] * value(i)).sum()
        })
        .collect()
    }
}

/// The number of axes, and whether a field has directions along more than the first.
fn kind(both: &Both<'_>, field: usize) -> (usize, bool) {
    let dofs = &both.a.dofs;
    let varies = |axis: usize| dofs.at.iter().any(|x| x[axis] != dofs.at[0][axis]);
    let dim = (0..3)
        .filter(|axis| varies(*axis))
        .max()
        .map_or(1, |axis| axis + 1);
    let mut own = dofs
        .direction
        .iter()
        .zip(&dofs.field)
        .filter(|(_, f)| usize::from(**f) == field);
    (dim, own.any(|(d, _)| d[1] != 0.0 || d[2] != 0.0))
}

/// The remainders of constants, rotations and gradients of quadratic functions, by field.
pub fn kernels(both: &Both<'_>) -> Vec<Kernel> {
    let touched = |k: usize, row: usize| {
        both.matrices[k]
            .row(row)
            .any(|(column, _)| both.is_held[column])
    };
    let inner: Vec<usize> = both
        .free
        .iter()
        .copied()
        .filter(|row| !touched(0, *row) && !touched(1, *row))
        .collect();
    let mut all = Vec::new();
    for (field, name) in both.a.dofs.names.iter().enumerate() {
        let (dim, is_vector) = kind(both, field);
        let axes = if is_vector { dim } else { 1 };
        let pairs = |sign: f64| {
            let each = (0..dim).flat_map(move |i| (i + 1..dim).map(move |j| (i, j)));
            each.map(move |(i, j)| Linear::gradient(&[(i, j, 1.0), (j, i, sign)]))
                .collect::<Vec<_>>()
        };
        let mut kinds = vec![(
            "constants",
            (0..axes).map(Linear::constant).collect::<Vec<_>>(),
        )];
        if is_vector {
            let stretches = (0..dim).map(|i| Linear::gradient(&[(i, i, 1.0)]));
            kinds.push(("rotations", pairs(-1.0)));
            kinds.push(("gradients", stretches.chain(pairs(1.0)).collect()));
        }
        for (kind, fields) in kinds {
            let left = both.matrices.each_ref().map(|matrix| {
                let each = fields.iter().map(|w| {
                    let (product, size) = matrix.times(&w.dofs(both, field));
                    let own = inner.iter().filter(|row| {
                        usize::from(both.a.dofs.field[**row]) == field && size[**row] > 0.0
                    });
                    own.map(|row| product[*row].abs() / size[*row])
                        .fold(0.0, f64::max)
                });
                each.fold(0.0, f64::max)
            });
            // The entries of D, whose sizes are those of the differences.
            let mut differing = false;
            let mut of_difference = 0.0f64;
            for w in &fields {
                let w = w.dofs(both, field);
                for row in inner
                    .iter()
                    .filter(|row| usize::from(both.a.dofs.field[**row]) == field)
                {
                    let (mut sum, mut size, mut all) = (0.0, 0.0, 0.0);
                    for (column, a, b) in super::difference::merged(both, *row) {
                        sum += (a - b) * w[column];
                        size += ((a - b) * w[column]).abs();
                        all += (a * w[column]).abs() + (b * w[column]).abs();
                    }
                    if size > 1e-12 * all {
                        differing = true;
                        of_difference = of_difference.max(sum.abs() / size.max(1e-6 * all));
                    }
                }
            }
            // A field without a row to examine is skipped.
            if inner
                .iter()
                .any(|row| usize::from(both.a.dofs.field[*row]) == field)
            {
                all.push(Kernel {
                    of: name.clone(),
                    kind,
                    left,
                    of_difference: differing.then_some(of_difference),
                });
            }
        }
    }
    all
}

/// Material constants, from the energies of constant fields and gradients, for fields without constrained rows.
pub fn energies(both: &Both<'_>, volume: f64) -> Vec<Energies> {
    let mut all = Vec::new();
    for (field, name) in both.a.dofs.names.iter().enumerate() {
        let is_whole = both
            .is_held
            .iter()
            .zip(&both.a.dofs.field)
            .all(|(held, own)| !held || usize::from(*own) != field);
        if !is_whole {
            continue;
        }
        let (dim, is_vector) = kind(both, field);
        // The energy of one field per volume, in both; relative to its size it is rounding if the field is in the kernel.
        let energy = |w: Linear| {
            let w = w.dofs(both, field);
            both.matrices.each_ref().map(|matrix| {
                let (product, size) = matrix.times(&w);
                let sum: f64 = w.iter().zip(&product).map(|(w, p)| w * p).sum();
                let most: f64 = w.iter().zip(&size).map(|(w, s)| (w * s).abs()).sum();
                if sum.abs() <= NOTHING * most {
                    0.0
                } else {
                    sum / volume
                }
            })
        };
        let mut push = |title: String, values: [f64; 2]| {
            if values != [0.0, 0.0] {
                all.push(Energies {
                    of: name.clone(),
                    name: title,
                    values,
                });
            }
        };
        let axes = if is_vector { dim } else { 1 };
        let each: Vec<[f64; 2]> = (0..axes)
            .map(|axis| energy(Linear::constant(axis)))
            .collect();
        let constants = each.iter().fold([0.0f64; 2], |most, own| {
            [0, 1].map(|k| most[k].max(own[k].abs()))
        });
        let near = |a: [f64; 2]| (0..2).all(|k| (a[k] - each[0][k]).abs() <= 1e-9 * constants[k]);
        match each.iter().all(|own| near(*own)) {
            true => push("the energy of constants".into(), each[0]),
            false => (0..axes).for_each(|axis| {
                push(
                    format!("the energy of constants along {}", ["x", "y", "z"][axis]),
                    each[axis],
                )
            }),
        }
        if !is_vector && constants == [0.0, 0.0] {
            for axis in 0..dim {
                push(
                    format!("κ{}", ["xx", "yy", "zz"][axis]),
                    energy(Linear::gradient(&[(0, axis, 1.0)])),
                );
            }
        }
        let rotation = energy(Linear::gradient(&[(0, 1, -1.0), (1, 0, 1.0)]));
        if is_vector && dim > 1 && constants == [0.0, 0.0] && rotation == [0.0, 0.0] {
            let along = energy(Linear::gradient(&[(0, 0, 1.0)]));
            let across = energy(Linear::gradient(&[(1, 1, 1.0)]));
            let plane = energy(Linear::gradient(&[(0, 0, 1.0), (1, 1, 1.0)]));
            let shear = energy(Linear::gradient(&[(0, 1, 1.0), (1, 0, 1.0)]));
            push(
                "λ".into(),
                [0, 1].map(|k| (plane[k] - along[k] - across[k]) / 2.0),
            );
            push("μ".into(), shear.map(|e| e / 4.0));
            push("λ + 2μ".into(), along);
        }
    }
    all
}
