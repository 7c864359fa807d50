//! The ways in which the form that a code solved may differ.

use crate::problem::Domain;
use crate::scalar::Length;

/// A change of a form.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A term has a factor.
    Factor {
        /// Its position.
        term: usize,
    },
    /// A parameter has another value.
    Parameter {
        /// Its position.
        parameter: usize,
    },
    /// A term, or all terms with the same rule, is integrated with a different one.
    Rule {
        /// Its position; `None` for all.
        term: Option<usize>,
        /// The name of the rule.
        rule: &'static str,
    },
    /// A datum is not evaluated at the points.
    Data {
        /// Its position.
        datum: usize,
        /// The only term for which this holds, if others contain it as well.
        term: Option<usize>,
        /// How it is evaluated.
        by: Interpolated,
    },
    /// A datum is 1.
    One {
        /// Its position.
        datum: usize,
    },
    /// A term, or all terms, has a different length instead of the given one.
    Size {
        /// Its position; `None` for all.
        term: Option<usize>,
        /// The length in the form.
        of: Length,
        /// The length in the code.
        size: Size,
    },
    /// The normal has the opposite direction in a term, or in all.
    Normal {
        /// Its position; `None` for all.
        term: Option<usize>,
    },
    /// The coordinates of the vertices are rounded.
    Coordinates {
        /// The precision of the rounded coordinates.
        digits: Digits,
    },
    /// In a term, test function and unknown are interchanged.
    Transposed {
        /// Its position.
        term: usize,
    },
    /// A term is integrated over another group.
    Moved {
        /// Its position.
        term: usize,
        /// The position of the group.
        group: usize,
    },
    /// A term has a factor on one of its groups.
    Group {
        /// Its position.
        term: usize,
        /// The position of the group.
        group: usize,
    },
    /// A part of a term has a factor.
    Part {
        /// Its position.
        term: usize,
        /// The part.
        part: Part,
    },
    /// A term has a factor 1 + a x.
    Varying {
        /// Its position.
        term: usize,
        /// The index of the coordinate x.
        axis: usize,
    },
    /// The integral of an unknown times its test function is added, with a factor.
    Mass {
        /// The position of the unknown.
        unknown: usize,
        /// The name of the rule, if it is not that of the form.
        rule: Option<&'static str>,
    },
    /// The integral of a partial derivative of an unknown times its test function is added, with a factor.
    Slope {
        /// The position of the unknown.
        unknown: usize,
        /// The axis of the derivative.
        axis: usize,
    },
    /// The prescribed values on a group are not imposed.
    Given {
        /// The position of the condition in [`Problem::held`](crate::Problem::held).
        condition: usize,
        /// The values that are imposed.
        by: Given,
    },
    /// Dirichlet values are imposed by a penalty.
    Penalty {
        /// The kind of penalty.
        by: Penalty,
    },
    /// In a scene of elasticity, the terms on Γ_C are missing: the body is not constrained there.
    Uncoupled,
    /// In a scene of elasticity, an integral on Γ_C with the positive part of u_n - ψ is added, with a factor.
    Obstacle {
        /// The kind of penalty.
        by: Penalty,
    },
    /// Right values are permuted.
    Exchanged {
        /// The number of values in wrong positions.
        count: usize,
        /// The number of all values.
        of: usize,
    },
    /// A few values are wrong.
    Values {
        /// The number of wrong values.
        count: usize,
        /// The number of all values.
        of: usize,
        /// The corners of their bounding box.
        between: [[f64; 3]; 2],
    },
    /// Newton's method, with the initial guess of all scripts, was stopped early.
    Stopped {
        /// The number of its last step, from 1.
        step: usize,
        /// The number of steps to convergence.
        of: usize,
    },
    /// A term, or all over one measure, has a factor on some cells or facets.
    Some {
        /// Its position, or that of the first of them.
        term: usize,
        /// Does it concern all terms over its measure?
        is_all: bool,
        /// Cells or facets.
        domain: Domain,
        /// The number of cells or facets with the factor.
        count: usize,
        /// The number of all.
        of: usize,
        /// The corners of the bounding box of their centres.
        between: [[f64; 3]; 2],
    },
}

/// How a datum is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolated {
    /// At the quadrature points, although the form interpolates it.
    Points,
    /// Interpolated by polynomials of this degree, continuous from 1 on; for 0, by its value at the centre of each cell.
    Degree(u8),
}

/// The lengths that may replace a length of the cell or facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Another length of the cell or facet.
    Of(Length),
    /// The largest diameter of all cells.
    Largest,
    /// The smallest.
    Smallest,
}

/// How a coordinate is rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Digits {
    /// To this number of significant digits.
    Significant(usize),
    /// To this number of decimals.
    Decimals(usize),
    /// To a number in single precision.
    Single,
}

impl Digits {
    /// The rounded number.
    pub fn round(self, x: f64) -> f64 {
        let text = match self {
            Digits::Single => return f64::from(x as f32),
            Digits::Significant(digits) => format!("{x:.*e}", digits.saturating_sub(1)),
            Digits::Decimals(digits) => format!("{x:.digits$}"),
        };
        text.parse().unwrap_or(x)
    }
}

/// The values that are imposed instead of the prescribed ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// Those that satisfy the equations that the condition replaces: nothing is imposed.
    Free,
    /// The prescribed ones times a number.
    Factor,
    /// The prescribed ones plus a number.
    Added,
    /// Those of the function that is linear on each facet and interpolates at its vertices.
    Linear,
    /// Those of another condition, by its position.
    Of(usize),
    /// The projection in L² by this rule.
    Projected(&'static str),
}

/// How a penalty imposes values: the expression with the factor k.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Penalty {
    /// The difference u - g at each dof.
    AtDofs,
    /// The integral of (u - g) v.
    Integrated,
    /// The integral of (u - g) v/h.
    OverH,
}

/// A part of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// With this partial derivative of the test function.
    Slope(usize),
    /// With this component of the test function.
    Component(usize),
}

impl Change {
    /// Is it a change without a number?
    pub fn is_whole(&self) -> bool {
        use Change::{Coordinates, Data, Moved, Normal, One, Rule, Size, Transposed};
        let is_of_data = matches!(self, Rule { .. } | Data { .. } | One { .. } | Size { .. });
        is_of_data
            || matches!(self, Transposed { .. } | Moved { .. })
            || matches!(self, Normal { .. } | Coordinates { .. })
            || matches!(
                self,
                Change::Exchanged { .. }
                    | Change::Values { .. }
                    | Change::Stopped { .. }
                    | Change::Uncoupled
            )
            || matches!(self, Change::Given { by, .. } if !matches!(by, Given::Factor | Given::Added))
    }

    /// Does it concern a whole term, datum or parameter, everywhere?
    pub fn is_everywhere(&self) -> bool {
        use Change::{Group, Part, Some, Varying};
        !matches!(
            self,
            Group { .. } | Part { .. } | Some { .. } | Varying { .. }
        )
    }

    /// The term that it concerns, if it concerns one.
    pub(super) fn term(&self) -> Option<usize> {
        match *self {
            Change::Factor { term }
            | Change::Transposed { term }
            | Change::Moved { term, .. }
            | Change::Group { term, .. }
            | Change::Part { term, .. }
            | Change::Varying { term, .. }
            | Change::Some { term, .. } => Some(term),
            Change::Rule { term, .. }
            | Change::Data { term, .. }
            | Change::Size { term, .. }
            | Change::Normal { term } => term,
            Change::Parameter { .. }
            | Change::One { .. }
            | Change::Mass { .. }
            | Change::Slope { .. }
            | Change::Given { .. }
            | Change::Penalty { .. }
            | Change::Uncoupled
            | Change::Obstacle { .. }
            | Change::Exchanged { .. }
            | Change::Values { .. }
            | Change::Stopped { .. }
            | Change::Coordinates { .. } => None,
        }
    }

    /// Its complexity: among changes that explain the same, the smallest counts.
    pub(super) fn rank(&self, factor: f64) -> usize {
        let is_plain = factor == 0.0 || factor == -1.0;
        match self {
            Change::Factor { .. } if is_plain => 0,
            Change::Parameter { .. } => 1,
            Change::Factor { .. } => 2,
            Change::Rule { .. } | Change::Data { .. } | Change::One { .. } => 3,
            Change::Size { .. } | Change::Normal { .. } | Change::Coordinates { .. } => 3,
            // If all cells are congruent, the simpler one is reported.
            Change::Obstacle { by: Penalty::OverH } => 4,
            Change::Uncoupled | Change::Obstacle { .. } => 3,
            Change::Transposed { .. } | Change::Moved { .. } => 4,
            Change::Group { .. } | Change::Mass { .. } => 5,
            Change::Given { .. } | Change::Penalty { .. } => 5,
            Change::Exchanged { .. } | Change::Values { .. } | Change::Stopped { .. } => 5,
            Change::Slope { .. } | Change::Part { .. } => 6,
            Change::Some { .. } => 7,
            Change::Varying { .. } => 8,
        }
    }
}

/// A change with its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// What is changed.
    pub change: Change,
    /// The factor of a term or of a part of it, the value of the parameter, the a of 1 + a x; 1 for a change without a number.
    pub factor: f64,
}

/// Changes that together make a form that the result solves.
#[derive(Debug, Clone)]
pub struct Explanation {
    /// At most four.
    pub causes: Vec<Cause>,
    /// The remaining residual: the largest row, relative to the sizes of the rows.
    pub left: f64,
    /// The fraction of the residual that they explain, as the root of a sum of squares; 1 if they leave rounding.
    pub share: f64,
    /// Do they leave no more than rounding? If not, they are the closest known changes, and not the cause.
    pub is_exact: bool,
    /// Other changes that leave no more than rounding.
    pub alike: Vec<Vec<Cause>>,
}
