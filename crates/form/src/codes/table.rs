//! The table of a code: its spelling of every part of a form, and its template.

use super::speaker::Speaker;
use super::spelling::Style;
use crate::problem::{Integral, Problem, Space};
use crate::scalar::{Leaf, Length, Side};

/// A finite element code: how to run its scripts, and its notation of a form.
#[derive(Debug)]
pub struct Code {
    /// The name in form files and commands.
    pub name: &'static str,
    /// The suffix of the script's name after that of the problem: `.edp`, `_dolfinx.py`.
    pub suffix: &'static str,
    /// The command before the script.
    pub command: &'static [&'static str],
    /// The format of the mesh, by its name in face-off files, and the suffix of its files.
    pub mesh: (&'static str, &'static str),
    /// The template of its scripts.
    pub(super) frame: &'static str,
    /// The handwritten scheme of contact in elasticity, which replaces the form.
    pub(super) by_hand_scheme: Option<&'static str>,
    /// Names that a problem must not use: those of the code, and those that the template defines.
    pub(super) reserved: &'static [&'static str],
    /// The number of the first component of a vector in names.
    pub(super) first: usize,
    /// The mark appended to a reserved name; other than `_` if names have no underscores.
    pub(super) mark: char,
    /// π.
    pub(super) pi: &'static str,
    /// The coordinates in formulas and in the form.
    pub(super) coordinates: [&'static str; 3],
    /// The components of the normal.
    pub(super) normals: [&'static str; 3],
    /// A length of cells or facets, in 2D or 3D.
    pub(super) length: fn(Length, usize) -> &'static str,
    /// The parameter for the time, which changes while the script runs.
    pub(super) clock: fn(&str) -> String,
    /// A value on a side of a facet.
    pub(super) on_side: fn(String, Side) -> String,
    /// Values and derivatives of functions.
    pub(super) leaves: Leaves,
    /// Functions, powers and choices in the form.
    pub(super) form: Style,
    /// The same in formulas outside of the form.
    pub(super) formulas: Style,
    /// Are coefficients always in brackets?
    pub(super) brackets: bool,
    /// Are the coefficients 1 and -1 written as signs only?
    pub(super) signs: bool,
    /// The space of an unknown or of data, or the missing feature.
    pub(super) element: fn(&Problem, Space) -> Result<String, String>,
    /// All rules of a problem by name, if the code does not take points.
    pub(super) rules: fn(&Problem) -> Result<Vec<&'static str>, String>,
    /// Is the derivative of an integral written out? The code differentiates the others itself.
    pub(super) by_hand: fn(&mut Problem, &Integral) -> bool,
    /// The scope of names for common subexpressions.
    pub(super) sharing: Sharing,
    /// The coordinates in functions of NumPy's arrays, and the suffix of the name of a parameter there.
    pub(super) points: ([&'static str; 3], &'static str),
    /// Do its scripts solve eigenproblems?
    pub(super) has_eigen: bool,
    /// Other features that the code lacks for a problem.
    pub(super) lacks: fn(&Problem) -> Result<(), String>,
    /// Additional fields for its template.
    pub(super) more: fn(&mut Speaker<'_>) -> minijinja::Value,
}

/// The notation of values and derivatives of functions: `%` is the name of a function, `@` the axes of a derivative.
#[derive(Debug)]
pub struct Leaves {
    /// The name of the function that has a component.
    pub name: fn(&Speaker<'_>, Leaf) -> String,
    pub first: &'static str,
    pub second: &'static str,
    /// The divergence and the curl of functions in spaces of vectors, if the code has no other derivatives of them.
    pub whole: Option<[&'static str; 2]>,
    /// The index of a component: of vectors, then along axes.
    pub index: fn(&[usize]) -> String,
    /// Are the components of a vector separate functions?
    pub by_component: bool,
    /// Does the side belong to the name of a function rather than to its value? Then test functions are on one side at a time.
    pub side_first: bool,
    /// Do data have values on either side of a facet?
    pub sided_data: bool,
}

/// The scope of names for common subexpressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharing {
    /// Once for the residual and its derivative.
    Together,
    /// Once for each of them.
    Apart,
    /// Within each integral, for which the code makes them.
    Own,
}
