//! What may be different in the form that a code solved.

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
    /// A term, or all that are integrated by the same rule, is integrated by another one.
    Rule {
        /// Its position; none of all.
        term: Option<usize>,
        /// The name of the rule.
        rule: &'static str,
    },
    /// A datum is taken elsewhere than at the points.
    Data {
        /// Its position.
        datum: usize,
        /// The only term for which this holds, if others have it as well.
        term: Option<usize>,
        /// How it is taken.
        by: Interpolated,
    },
    /// A datum is 1.
    One {
        /// Its position.
        datum: usize,
    },
    /// A term, or all, has another length in place of one.
    Size {
        /// Its position; none of all.
        term: Option<usize>,
        /// The length that the form has.
        of: Length,
        /// Which.
        size: Size,
    },
    /// The normal points the other way in a term, or in all.
    Normal {
        /// Its position; none of all.
        term: Option<usize>,
    },
    /// The coordinates of the vertices are rounded.
    Coordinates {
        /// To which digits.
        digits: Digits,
    },
    /// A term has test function and unknown exchanged.
    Transposed {
        /// Its position.
        term: usize,
    },
    /// A term is taken over another group.
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
        /// Which part.
        part: Part,
    },
    /// A term has a factor 1 + a x.
    Varying {
        /// Its position.
        term: usize,
        /// Which coordinate x is.
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
        /// Along which axis.
        axis: usize,
    },
    /// The values on a group are not imposed as they are given.
    Given {
        /// The position of the condition in [`Problem::held`](crate::Problem::held).
        condition: usize,
        /// What they are.
        by: Given,
    },
    /// Dirichlet values are imposed by a penalty.
    Penalty {
        /// How.
        by: Penalty,
    },
    /// In a scene of elasticity, without the terms on Γ_C: nothing holds the body there.
    Uncoupled,
    /// In a scene of elasticity, an integral on Γ_C with the positive part of u_n - ψ is added, with a factor.
    Obstacle {
        /// How.
        by: Penalty,
    },
    /// Right values are at each other's places.
    Exchanged {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
    },
    /// A few values are wrong.
    Values {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
        /// Between which places they are.
        between: [[f64; 3]; 2],
    },
    /// Newton's method, from the start that all scripts have, was stopped early.
    Stopped {
        /// After which step, from 1.
        step: usize,
        /// Of how many.
        of: usize,
    },
    /// A term, or all over one measure, has a factor on some cells or facets.
    Some {
        /// Its position, or that of the first of them.
        term: usize,
        /// Are all terms over its measure meant?
        is_all: bool,
        /// Cells or facets.
        domain: Domain,
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
        /// Between which places their centres lie.
        between: [[f64; 3]; 2],
    },
}

/// How a datum is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolated {
    /// At the quadrature points, although the form interpolates it.
    Points,
    /// Interpolated by polynomials of this degree, continuous from 1 on; 0: by its value at the centre of each cell.
    Degree(u8),
}

/// What may be taken in place of a length of the cell or facet.
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
    /// To so many significant digits.
    Significant(usize),
    /// To so many decimals.
    Decimals(usize),
    /// To a number in single precision.
    Single,
}

impl Digits {
    /// The number that is left.
    pub fn round(self, x: f64) -> f64 {
        let text = match self {
            Digits::Single => return f64::from(x as f32),
            Digits::Significant(digits) => format!("{x:.*e}", digits.saturating_sub(1)),
            Digits::Decimals(digits) => format!("{x:.digits$}"),
        };
        text.parse().unwrap_or(x)
    }
}

/// What values are in place of given ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// Those with which the equations hold that the condition takes away: nothing is imposed.
    Free,
    /// The given ones times a number.
    Factor,
    /// The given ones and a number.
    Added,
    /// Those of the function that is linear on each facet and right at its vertices.
    Linear,
    /// Those of another condition, by its position.
    Of(usize),
    /// The projection in L² by this rule.
    Projected(&'static str),
}

/// How a penalty imposes values: what has the factor k.
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
    /// Is it there or not, without a number?
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

    /// Is it one of a whole term, datum or parameter, wherever that is?
    pub fn is_everywhere(&self) -> bool {
        use Change::{Group, Part, Some, Varying};
        !matches!(
            self,
            Group { .. } | Part { .. } | Some { .. } | Varying { .. }
        )
    }

    /// The term that it is of, where it is of one.
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

    /// How far-fetched it is: of changes that explain the same, the smallest counts.
    pub(super) fn rank(&self, factor: f64) -> usize {
        let is_plain = factor == 0.0 || factor == -1.0;
        match self {
            Change::Factor { .. } if is_plain => 0,
            Change::Parameter { .. } => 1,
            Change::Factor { .. } => 2,
            Change::Rule { .. } | Change::Data { .. } | Change::One { .. } => 3,
            Change::Size { .. } | Change::Normal { .. } | Change::Coordinates { .. } => 3,
            // Where all cells are alike, the plain one is told.
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
    /// The factor of a term or of a part of it, the value of a parameter, the a of 1 + a x; 1 of a change without a number.
    pub factor: f64,
}

/// Changes which together make a form that the result solves.
#[derive(Debug, Clone)]
pub struct Explanation {
    /// At most four.
    pub causes: Vec<Cause>,
    /// What they leave: the largest row, over the sizes of rows.
    pub left: f64,
    /// The part of the residual that they explain, in the root of the sum of squares; 1 where they leave rounding.
    pub share: f64,
    /// Do they leave no more than rounding? If not, they are the nearest that is known, and not the cause.
    pub is_exact: bool,
    /// Other changes that leave no more than rounding either.
    pub alike: Vec<Vec<Cause>>,
}
