//! A symmetric matrix as the sum of small dense ones: what finite elements give, without the sum.

/// A symmetric positive definite matrix Σ_e E_e A_e E_eᵀ.
pub trait Elements: Sync {
    /// Number of rows.
    fn unknowns(&self) -> usize;

    /// Number of elements.
    fn count(&self) -> usize;

    /// Unknowns of every element.
    fn size(&self) -> usize;

    /// The unknowns of an element.
    fn of(&self, element: usize) -> &[u32];

    /// A point inside an element: elements near each other are eliminated together.
    fn centre(&self, element: usize) -> [f64; 3];

    /// A_e by columns, both triangles; `matrix` has size² places, all of which are written.
    fn matrix(&self, element: usize, matrix: &mut [f64]);

    /// One row of A_e.
    fn row(&self, element: usize, row: usize, values: &mut [f64]) {
        let size = self.size();
        let mut matrix = vec![0.0; size * size];
        self.matrix(element, &mut matrix);
        values.copy_from_slice(&matrix[row * size..(row + 1) * size]);
    }
}

/// The role of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It is eliminated.
    Eliminated,
    /// The matrix is condensed onto it: it is in the Schur complement.
    Kept,
    /// Its value is given: its row and column are left out.
    Fixed,
}

/// Elements whose matrices `change` changes: it gets the number and the matrix of one.
pub struct Changed<'a, E, F> {
    /// Those that are changed.
    pub elements: &'a E,
    /// Gets the number of an element, and A_e by columns to change in place.
    pub change: F,
}

impl<E: Elements, F: Fn(usize, &mut [f64]) + Sync> Elements for Changed<'_, E, F> {
    fn unknowns(&self) -> usize {
        self.elements.unknowns()
    }

    fn count(&self) -> usize {
        self.elements.count()
    }

    fn size(&self) -> usize {
        self.elements.size()
    }

    fn of(&self, element: usize) -> &[u32] {
        self.elements.of(element)
    }

    fn centre(&self, element: usize) -> [f64; 3] {
        self.elements.centre(element)
    }

    fn matrix(&self, element: usize, matrix: &mut [f64]) {
        self.elements.matrix(element, matrix);
        (self.change)(element, matrix);
    }
}
