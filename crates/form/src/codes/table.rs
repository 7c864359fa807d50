//! The table of a code: its words for everything that a form is made of, and its template.

use super::speaker::Speaker;
use super::spelling::Style;
use crate::problem::{Integral, Problem, Space};
use crate::scalar::{Leaf, Length, Side};

/// A finite element code: how its scripts are run, and how it spells a form.
#[derive(Debug)]
pub struct Code {
    /// Its name in form files and commands.
    pub name: &'static str,
    /// What follows the problem's name in that of the script: `.edp`, `_dolfinx.py`.
    pub suffix: &'static str,
    /// The words before the script in a command.
    pub command: &'static [&'static str],
    /// The format of the mesh, by the name that face-offs have for it, and the suffix of its files.
    pub mesh: (&'static str, &'static str),
    /// The template of its scripts.
    pub(super) frame: &'static str,
    /// The scheme of contact in elasticity, where it is written by hand and takes the place of the form.
    pub(super) by_hand_scheme: Option<&'static str>,
    /// Words that no name of a problem may be: those of the code, and those that the template makes.
    pub(super) reserved: &'static [&'static str],
    /// The number of the first component of a vector in names.
    pub(super) first: usize,
    /// What is put behind a reserved name; other than `_` where names have no underscores.
    pub(super) mark: char,
    /// π.
    pub(super) pi: &'static str,
    /// The coordinates in formulas and in the form.
    pub(super) coordinates: [&'static str; 3],
    /// The components of the normal.
    pub(super) normals: [&'static str; 3],
    /// A length of cells or facets, in 2D or 3D.
    pub(super) length: fn(Length, usize) -> &'static str,
    /// The parameter that is the time, which changes while the script runs.
    pub(super) clock: fn(&str) -> String,
    /// A value on a side of a facet.
    pub(super) on_side: fn(String, Side) -> String,
    /// Values and derivatives of functions.
    pub(super) leaves: Leaves,
    /// Functions, powers and choices in the form.
    pub(super) form: Style,
    /// The same in formulas outside of it.
    pub(super) formulas: Style,
    /// Are coefficients always in brackets?
    pub(super) brackets: bool,
    /// Are the coefficients 1 and -1 written as signs only?
    pub(super) signs: bool,
    /// The space of an unknown or of data, or what is missing.
    pub(super) element: fn(&Problem, Space) -> Result<String, String>,
    /// All rules of a problem by name, where the code does not take points.
    pub(super) rules: fn(&Problem) -> Result<Vec<&'static str>, String>,
    /// Is the derivative of an integral written out? The code differentiates the others.
    pub(super) by_hand: fn(&mut Problem, &Integral) -> bool,
    /// Where an expression that occurs more than once gets a name.
    pub(super) sharing: Sharing,
    /// The coordinates in functions of NumPy's arrays, and what follows the name of a parameter there.
    pub(super) points: ([&'static str; 3], &'static str),
    /// Do its scripts solve eigenproblems?
    pub(super) has_eigen: bool,
    /// What else the code lacks for a problem.
    pub(super) lacks: fn(&Problem) -> Result<(), String>,
    /// What else its template is filled with.
    pub(super) more: fn(&mut Speaker<'_>) -> minijinja::Value,
}

/// How values and derivatives of functions are written: `%` is the name of a function, `@` the axes of a derivative.
#[derive(Debug)]
pub struct Leaves {
    /// The name of the function that has a component.
    pub name: fn(&Speaker<'_>, Leaf) -> String,
    pub first: &'static str,
    pub second: &'static str,
    /// The divergence and the curl of functions in spaces of vectors, where the code has no other derivatives of them.
    pub whole: Option<[&'static str; 2]>,
    /// What picks a component: of vectors, then along axes.
    pub index: fn(&[usize]) -> String,
    /// Are the components of a vector functions by themselves?
    pub by_component: bool,
    /// Does the side belong to the name of a function rather than to its value? Test functions are on one side at a time then.
    pub side_first: bool,
    /// Have data values on either side of a facet?
    pub sided_data: bool,
}

/// Where expressions that occur more than once get their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharing {
    /// Once for the residual and its derivative.
    Together,
    /// Once for each of them.
    Apart,
    /// In what the code makes of integrals by itself.
    Own,
}
