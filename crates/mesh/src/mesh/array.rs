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
pub struct Array<T>(Held<T>);

#[derive(Clone)]
enum Held<T> {
    Owned(Vec<T>),
    Lent(Arc<dyn AsRef<[T]> + Send + Sync>),
}

impl<T: Clone> Array<T> {
    /// Memory that stays what it is while this or a clone of it is there.
    pub fn lent(by: Arc<dyn AsRef<[T]> + Send + Sync>) -> Self {
        Array(Held::Lent(by))
    }

    /// The numbers to be changed; copied, once, if they are lent.
    pub fn to_mut(&mut self) -> &mut Vec<T> {
        if let Held::Lent(by) = &self.0 {
            self.0 = Held::Owned((**by).as_ref().to_vec());
        }
        match &mut self.0 {
            Held::Owned(numbers) => numbers,
            Held::Lent(_) => unreachable!("owned since the lines above"),
        }
    }

    /// The numbers; copied if they are lent.
    pub fn into_vec(mut self) -> Vec<T> {
        std::mem::take(self.to_mut())
    }
}

impl<T> Deref for Array<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
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
        Array(Held::Owned(numbers))
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
