//! Numbers that are owned, or lent by who has them already.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// Numbers in a row: a `Vec`, or memory of somebody else, who lends it, so that it is not copied until it is to be changed.
///
/// ```
/// use std::sync::Arc;
/// use faceoff_mesh::mesh::Array;
///
/// let theirs = Arc::new(vec![1.0, 2.0]);
/// let mut ours = Array::lent(theirs.clone());
/// assert_eq!(ours.as_ptr(), theirs.as_ptr());
/// ours.to_mut().push(3.0);
/// assert_eq!((&*ours, &**theirs), (&[1.0, 2.0, 3.0][..], &[1.0, 2.0][..]));
/// ```
#[derive(Clone)]
pub struct Array<T> {
    held: Held<T>,
    /// That nodes are less than this, or that coordinates are finite, as checked when they were made; reset when they may change.
    checked: Option<u32>,
}

#[derive(Clone)]
enum Held<T> {
    Owned(Vec<T>),
    Lent(Arc<dyn AsRef<[T]> + Send + Sync>),
}

impl<T: Clone> Array<T> {
    /// Memory that stays what it is while this or a clone of it is there.
    pub fn lent(by: Arc<dyn AsRef<[T]> + Send + Sync>) -> Self {
        Array {
            held: Held::Lent(by),
            checked: None,
        }
    }

    /// The numbers to be changed; copied, once, if they are lent.
    pub fn to_mut(&mut self) -> &mut Vec<T> {
        self.checked = None;
        if let Held::Lent(by) = &self.held {
            self.held = Held::Owned((**by).as_ref().to_vec());
        }
        match &mut self.held {
            Held::Owned(numbers) => numbers,
            Held::Lent(_) => unreachable!("owned since the lines above"),
        }
    }

    /// The numbers; copied if they are lent.
    pub fn into_vec(mut self) -> Vec<T> {
        std::mem::take(self.to_mut())
    }

    /// Appends numbers, without copying if there are none yet.
    pub fn append(&mut self, new: Array<T>) {
        match self.is_empty() {
            true => *self = new,
            false => self.to_mut().extend_from_slice(&new),
        }
    }
}

impl Array<u32> {
    /// Nodes of which it has been seen that each is less than this.
    pub(crate) fn below(self, limit: u32) -> Self {
        let checked = Some(limit);
        Array { checked, ..self }
    }

    /// A number than which each is known to be less.
    pub(crate) fn limit(&self) -> Option<u32> {
        self.checked
    }
}

impl Array<[f64; 3]> {
    /// Coordinates, and whether it has been seen that all are finite.
    pub(crate) fn seen(self, finite: bool) -> Self {
        let checked = finite.then_some(0);
        Array { checked, ..self }
    }

    /// Whether all are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.checked.is_some() || super::all_finite(self.as_flattened())
    }
}

impl<T> Deref for Array<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.held {
            Held::Owned(numbers) => numbers,
            Held::Lent(by) => (**by).as_ref(),
        }
    }
}

impl<T> AsRef<[T]> for Array<T> {
    fn as_ref(&self) -> &[T] {
        self
    }
}

impl<T> Default for Array<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> From<Vec<T>> for Array<T> {
    fn from(numbers: Vec<T>) -> Self {
        Array {
            held: Held::Owned(numbers),
            checked: None,
        }
    }
}

impl<T> FromIterator<T> for Array<T> {
    fn from_iter<I: IntoIterator<Item = T>>(numbers: I) -> Self {
        Vec::from_iter(numbers).into()
    }
}

impl<'a, T> IntoIterator for &'a Array<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T: PartialEq, Other: AsRef<[T]> + ?Sized> PartialEq<Other> for Array<T> {
    fn eq(&self, other: &Other) -> bool {
        **self == *other.as_ref()
    }
}

impl<T: fmt::Debug> fmt::Debug for Array<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{CellBlock, CellKind, Mesh};

    /// Then the mesh is looked at again.
    #[test]
    fn what_was_seen_is_forgotten_when_numbers_may_change() {
        let validate = |nodes: &Array<u32>, points: &Array<[f64; 3]>| {
            let mesh = Mesh {
                points: points.clone(),
                blocks: vec![CellBlock::of(CellKind::Vertex, nodes.clone())],
                ..Mesh::default()
            };
            mesh.validate().err().unwrap_or_default()
        };
        let nodes = Array::from(vec![0, 1]).below(2);
        let points = Array::from(vec![[0.0; 3]; 2]).seen(true);
        assert_eq!(validate(&nodes, &points), "");
        assert!(validate(&nodes, &vec![[0.0; 3]].into()).contains("beyond the 1 points"));
        let (mut changed, mut longer) = (nodes.clone(), nodes.clone());
        changed.to_mut()[0] = 7;
        longer.append(vec![7].into());
        for odd in [changed, longer] {
            assert!(validate(&odd, &points).contains("beyond the 2 points"));
        }
        let (mut changed, mut longer) = (points.clone(), points.clone());
        changed.to_mut()[1][2] = f64::NAN;
        longer.append(vec![[f64::INFINITY; 3]].into());
        for odd in [
            changed,
            longer,
            Array::from(vec![[f64::NAN; 3]; 2]).seen(false),
        ] {
            assert!(validate(&nodes, &odd).contains("not finite"));
        }
    }
}
