//! Values on the points or cells of a mesh.

use crate::mesh::{Array, Mesh};

/// Named values on points or cells, as the file holds them.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name in the file; several fields at different times may share it.
    pub name: String,
    /// The entities that have values.
    pub on: Support,
    /// Values of one point, cell or corner: 1 for a scalar, 3 for a vector, 9 for a tensor.
    pub components: usize,
    /// `components` values for each item of `at`.
    pub values: Values,
    /// Ascending indices of the points or cells that have values; empty when all have, in their order.
    pub at: Vec<u32>,
    /// Time and number of the step, where the file gives them.
    pub time: Option<f64>,
    /// The number of the step.
    pub step: Option<i32>,
}

/// The entities to which the values of a [`Field`] belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Support {
    /// The points of the mesh, in their order.
    Points,
    /// The cells of the mesh, counted through all blocks.
    Cells,
    /// Each node of each cell: a field that may jump from cell to cell.
    CellPoints,
}

impl std::fmt::Display for Support {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Support::Points => "points",
            Support::Cells => "cells",
            Support::CellPoints => "cell points",
        })
    }
}

macro_rules! values {
    ($($variant:ident $type:ty),*) => {
        /// Numbers in the type that the file uses.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Values {
            $(#[doc = concat!("Of type `", stringify!($type), "`.")] $variant(Array<$type>)),*
        }

        impl Values {
            /// How many values there are.
            pub fn len(&self) -> usize {
                match self { $(Values::$variant(values) => values.len()),* }
            }

            /// Each value as binary64; 64-bit integers beyond 2^53 are rounded, by [`Values::rest`].
            pub fn to_f64(&self) -> Vec<f64> {
                match self { $(Values::$variant(values) => values.iter().map(|&v| v as f64).collect()),* }
            }

            /// Copies them if they are borrowed: owned data cannot be changed by others.
            pub fn own(&mut self) {
                match self { $(Values::$variant(values) => _ = values.to_mut()),* }
            }
        }
    };
}
values!(F64 f64, F32 f32, I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, I64 i64, U64 u64);

impl Values {
    /// [`Values::to_f64`] of what is not needed any more: binary64 is not copied.
    pub fn into_f64(self) -> Array<f64> {
        match self {
            Values::F64(values) => values,
            others => others.to_f64().into(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rest of each integer after rounding to binary64: value + rest is exact. Empty if all rests are 0; `None`
    /// for floats.
    pub fn rest(&self) -> Option<Vec<f64>> {
        fn of<T: Copy + Into<i128>>(numbers: &[T], rounded: impl Fn(T) -> f64) -> Vec<f64> {
            let rest = |&n: &T| (n.into() - rounded(n) as i128) as f64;
            match numbers.iter().any(|n| rest(n) != 0.0) {
                true => numbers.iter().map(rest).collect(),
                false => Vec::new(),
            }
        }
        match self {
            Values::F64(_) | Values::F32(_) => None,
            Values::I64(numbers) => Some(of(numbers, |n| n as f64)),
            Values::U64(numbers) => Some(of(numbers, |n| n as f64)),
            _ => Some(Vec::new()),
        }
    }
}

impl Field {
    /// A field with one row of `components` values for every point or cell.
    pub fn new(name: impl Into<String>, on: Support, components: usize, values: Values) -> Self {
        Field {
            name: name.into(),
            on,
            components,
            values,
            at: Vec::new(),
            time: None,
            step: None,
        }
    }

    /// The field with values at these of `all` points or cells, of which it names none if they are all.
    pub(crate) fn only(self, at: Vec<u32>, all: usize) -> Self {
        let at = if at.len() == all { Vec::new() } else { at };
        Field { at, ..self }
    }

    /// Number of values this field must have on `mesh`; `None` when an index of `at` is beyond the mesh.
    pub fn expected_len(&self, mesh: &Mesh) -> Option<usize> {
        let rows = match self.on {
            Support::CellPoints => {
                if self.at.is_empty() {
                    mesh.blocks.iter().map(|block| block.nodes.len()).sum()
                } else {
                    // One field of many may be on few of many cells.
                    let ends = mesh.block_ends();
                    let size = |&cell: &u32| {
                        let block = ends.partition_point(|&end| end <= cell as usize);
                        Some(mesh.blocks.get(block)?.kind.points())
                    };
                    self.at.iter().map(size).sum::<Option<usize>>()?
                }
            }
            Support::Points | Support::Cells => {
                let all = mesh.items(self.on);
                if self.at.iter().any(|&i| i as usize >= all) {
                    return None;
                }
                if self.at.is_empty() {
                    all
                } else {
                    self.at.len()
                }
            }
        };
        rows.checked_mul(self.components)
    }
}
