//! Data about a mesh as a whole, in addition to the fields on its points and cells ([`crate::mesh::Field`]).

use crate::mesh::Values;

/// A named array about the whole mesh: provenance, parameters, tables.
#[derive(Debug, Clone, PartialEq)]
pub struct GlobalArray {
    /// Its name in the file.
    pub name: String,
    /// Values in one tuple: 1 for a list, 3 for a table of three columns. Never 0; 1 for text.
    pub components: usize,
    /// `components` a tuple, one tuple after the other.
    pub values: GlobalValues,
}

/// Numbers in exactly the type of the file, or text.
#[derive(Debug, Clone, PartialEq)]
pub enum GlobalValues {
    /// Numbers.
    Numbers(Values),
    /// Lines of text.
    Text(Vec<String>),
}

/// Evaluates one expression for the vector of numbers in `$values`, whatever its type.
macro_rules! with_numbers {
    ($values:expr, $numbers:ident => $run:expr) => {
        match $values {
            $crate::mesh::Values::I8($numbers) => $run,
            $crate::mesh::Values::U8($numbers) => $run,
            $crate::mesh::Values::I16($numbers) => $run,
            $crate::mesh::Values::U16($numbers) => $run,
            $crate::mesh::Values::I32($numbers) => $run,
            $crate::mesh::Values::U32($numbers) => $run,
            $crate::mesh::Values::I64($numbers) => $run,
            $crate::mesh::Values::U64($numbers) => $run,
            $crate::mesh::Values::F32($numbers) => $run,
            $crate::mesh::Values::F64($numbers) => $run,
        }
    };
}
pub(crate) use with_numbers;

impl GlobalArray {
    /// A list of numbers.
    pub fn numbers(name: impl Into<String>, values: Values) -> Self {
        GlobalArray {
            name: name.into(),
            components: 1,
            values: GlobalValues::Numbers(values),
        }
    }

    /// One text.
    pub fn text(name: impl Into<String>, text: impl Into<String>) -> Self {
        GlobalArray::texts(name, vec![text.into()])
    }

    /// A list of texts.
    pub fn texts(name: impl Into<String>, texts: Vec<String>) -> Self {
        GlobalArray {
            name: name.into(),
            components: 1,
            values: GlobalValues::Text(texts),
        }
    }

    /// Number of tuples.
    pub fn tuples(&self) -> usize {
        let values = match &self.values {
            GlobalValues::Numbers(numbers) => numbers.len(),
            GlobalValues::Text(texts) => texts.len(),
        };
        values / self.components.max(1)
    }

    /// Adds the array to others, unless they have it; returns it if they have another of its name.
    pub(crate) fn join(self, all: &mut Vec<GlobalArray>) -> Option<Self> {
        match all.iter().find(|known| known.name == self.name) {
            None => all.push(self),
            Some(known) if known.same_bits(&self) => {}
            Some(_) => return Some(self),
        }
        None
    }

    /// Equal name and equal bits, NaN included.
    pub fn same_bits(&self, other: &GlobalArray) -> bool {
        let values = match (&self.values, &other.values) {
            (GlobalValues::Numbers(a), GlobalValues::Numbers(b)) => same_bits(a, b),
            (a, b) => a == b,
        };
        values && self.name == other.name && self.components == other.components
    }
}

/// Equal type and equal bits: NaN equals itself, 0 differs from -0.
pub fn same_bits(a: &Values, b: &Values) -> bool {
    match (a, b) {
        (Values::F32(a), Values::F32(b)) => {
            (a.iter().map(|x| x.to_bits())).eq(b.iter().map(|x| x.to_bits()))
        }
        (Values::F64(a), Values::F64(b)) => {
            (a.iter().map(|x| x.to_bits())).eq(b.iter().map(|x| x.to_bits()))
        }
        (a, b) => a == b,
    }
}

/// The values as integers; `None` for floats and for numbers beyond an `i64`.
pub fn to_i64(values: &Values) -> Option<Vec<i64>> {
    fn widen<T: Copy + TryInto<i64>>(numbers: &[T]) -> Option<Vec<i64>> {
        numbers.iter().map(|&x| x.try_into().ok()).collect()
    }
    match values {
        Values::I8(v) => widen(v),
        Values::U8(v) => widen(v),
        Values::I16(v) => widen(v),
        Values::U16(v) => widen(v),
        Values::I32(v) => widen(v),
        Values::U32(v) => widen(v),
        Values::I64(v) => widen(v),
        Values::U64(v) => widen(v),
        Values::F32(_) | Values::F64(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_compared_rather_than_numbers() {
        let nan = Values::F64(vec![f64::NAN].into());
        let other_nan = Values::F64(vec![f64::from_bits(f64::NAN.to_bits() ^ 1)].into());
        assert!(same_bits(&nan, &nan.clone()));
        assert!(!same_bits(&nan, &other_nan));
        assert!(!same_bits(
            &Values::F64(vec![0.0].into()),
            &Values::F64(vec![-0.0].into())
        ));
        assert!(!same_bits(
            &Values::F64(vec![1.0].into()),
            &Values::F32(vec![1.0].into())
        ));
        assert!(!same_bits(
            &Values::F32(vec![1.0].into()),
            &Values::F32(vec![1.0, 1.0].into())
        ));
    }

    #[test]
    fn whole_numbers_are_widened_or_refused() {
        assert_eq!(to_i64(&Values::U8(vec![255].into())), Some(vec![255]));
        assert_eq!(to_i64(&Values::U64(vec![u64::MAX].into())), None);
        assert_eq!(to_i64(&Values::F32(vec![1.0].into())), None);
    }
}
