//! A problem in weak form: the checked content of a form file.

use std::collections::BTreeMap;

use faceoff_fem::quadrature::Rule;

use crate::elastic::Parts;
use crate::grid::Cells;
use crate::language::{Definition, Formula};
use crate::scalar::{Field, Id, Leaf, Length, Node, Scalars};

/// A problem in weak form: find the unknowns u such that F(u; v) = 0 for all test functions v, with Dirichlet values.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The stem of the names of its files: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// A description, which may be empty.
    pub about: String,
    /// 2 or 3.
    pub dim: usize,
    /// The shape of the cells of the mesh.
    pub cells: Cells,
    /// In the order of the file.
    pub unknowns: Vec<Unknown>,
    /// In the order of the file.
    pub parameters: Vec<Parameter>,
    /// In the order of the file.
    pub data: Vec<Datum>,
    /// The groups of the mesh.
    pub groups: Vec<Group>,
    /// The terms of F, in their order.
    pub integrals: Vec<Integral>,
    /// Dirichlet values, by component; if two groups share a dof, the later one counts.
    pub conditions: Vec<Condition>,
    /// Unknowns whose mean is prescribed, because F leaves a constant free.
    pub means: Vec<Mean>,
    /// The time steps; `None` if F is solved once.
    pub time: Option<Time>,
    /// The request of an eigenproblem, whose integrals are those of a(u, v) and of m(u, v); `None` if F(u; v) = 0 is solved.
    pub eigen: Option<Eigen>,
    /// The degree of polynomials that the quadrature rule on cells integrates exactly.
    pub degree: usize,
    /// The degree of the rule on facets.
    pub facet_degree: usize,
    /// Named parts of formulas, which numbers of solutions may use too.
    pub definitions: Vec<Definition>,
    /// F.
    pub form: Formula,
    /// For a scene of elasticity: its parts, for scripts that are not generated from F.
    pub parts: Option<Parts>,
    /// The expressions that all [`Id`]s of this problem refer to.
    pub scalars: Scalars,
}

/// Scripts find this many eigenvalues in addition: the last requested one may be multiple, with a space of modes.
const MORE: usize = 4;
/// The request of an eigenproblem.
#[derive(Debug, Clone)]
pub struct Eigen {
    /// m; the problem's `form` is a.
    pub mass: Formula,
    /// The number of eigenvalues that are compared.
    pub count: usize,
    /// The target: the nearest eigenvalues are requested.
    pub shift: f64,
}

impl Eigen {
    /// The number of eigenvalues that codes find.
    pub fn found(&self) -> usize {
        self.count + MORE
    }
}

/// An unknown function and its test function.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// Its name in the form.
    pub name: String,
    /// The name of its test function: `v`, or `test.NAME`.
    pub test: String,
    /// Its finite element space.
    pub space: Space,
}

/// A finite element space of scalars or vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Space {
    /// The element of each component.
    pub element: Element,
    /// The number of components of a value; `None` for a scalar.
    pub size: Option<usize>,
}

/// A finite element: for scalar functions, with one for each component of a vector, or for vectors as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// Continuous polynomials of this degree, 1 to 3 (Lagrange); on quadrangles and hexahedra of this degree, 1 or 2, in each coordinate of the
    /// reference cell.
    Continuous(u8),
    /// The same on each cell, without continuity, 0 to 2.
    Broken(u8),
    /// Linear on each cell, with continuous means on facets (Crouzeix–Raviart).
    CrouzeixRaviart,
    /// Vectors a + b x on each cell, with continuous normal components (Raviart–Thomas, lowest order).
    RaviartThomas,
    /// Vectors a + b × x on each cell, with continuous tangential components (Nédélec, first kind, lowest order).
    Nedelec,
}

impl Element {
    /// The polynomial degree.
    pub fn degree(self) -> usize {
        match self {
            Element::Continuous(degree) | Element::Broken(degree) => degree.into(),
            Element::CrouzeixRaviart | Element::RaviartThomas | Element::Nedelec => 1,
        }
    }

    /// Are its functions continuous?
    pub fn is_continuous(self) -> bool {
        matches!(self, Element::Continuous(_))
    }

    /// Are its functions vectors as a whole, so that a dof belongs to all components?
    pub fn is_vector(self) -> bool {
        matches!(self, Element::RaviartThomas | Element::Nedelec)
    }

    /// Its name in form files, as in `P2`.
    pub fn name(self) -> String {
        match self {
            Element::Continuous(degree) => format!("P{degree}"),
            Element::Broken(0) => "P0".into(),
            Element::Broken(degree) => format!("DG{degree}"),
            Element::CrouzeixRaviart => "CR".into(),
            Element::RaviartThomas => "RT0".into(),
            Element::Nedelec => "N1curl".into(),
        }
    }
}

impl Space {
    /// The number of components.
    pub fn count(self) -> usize {
        self.size.unwrap_or(1)
    }

    /// Its name in form files, as in `P2`.
    pub fn name(self) -> String {
        match self.size.filter(|_| !self.element.is_vector()) {
            None => self.element.name(),
            Some(size) => format!("{}^{size}", self.element.name()),
        }
    }

    /// The dimensions of a value: empty for a scalar.
    pub fn shape(self) -> Vec<usize> {
        self.size.into_iter().collect()
    }
}

/// A named number in the form, with its value in the file.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Its name in the form.
    pub name: String,
    /// Finite.
    pub value: f64,
}

/// A given function of the point.
#[derive(Debug, Clone)]
pub struct Datum {
    /// Its name in the form.
    pub name: String,
    /// The dimensions of a value: empty for a scalar.
    pub shape: Vec<usize>,
    /// Expressions in coordinates and parameters, row by row.
    pub components: Vec<Id>,
    /// The texts of the components.
    pub texts: Vec<String>,
    /// The space in which it is interpolated; `None` if it is evaluated at the quadrature points.
    pub space: Option<Space>,
}

/// A group of cells or facets of the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Its name, or its number if it has none.
    pub name: String,
    /// Its number.
    pub tag: i64,
    /// The dimension of its cells.
    pub dim: usize,
    /// Its position: cells, the boundary, or facets between cells; `None` for anything else.
    pub on: Option<Domain>,
}

/// The domain of an integral.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Domain {
    /// `dx`: cells.
    Cells,
    /// `ds`: facets of the boundary.
    Boundary,
    /// `dS`: facets between two cells.
    Interior,
}

/// A measure: all of a domain, or some groups of it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Measure {
    /// The domain of an integral.
    pub domain: Domain,
    /// Positions in the problem's groups, ascending; empty for the whole domain.
    pub groups: Vec<usize>,
    /// The degree of a separate rule, as in `dx(degree=1)`; `None` for that of the problem.
    pub degree: Option<usize>,
}

/// One term of F: an integral, linear in the test functions.
#[derive(Debug, Clone)]
pub struct Integral {
    /// The domain of an integral.
    pub measure: Measure,
    /// The coefficient of each component of a test function or of its gradient.
    pub terms: BTreeMap<Leaf, Id>,
    /// Its start in F, in characters from 0; for an eigenproblem in a, or in m.
    pub at: usize,
    /// For an eigenproblem: is it a part of m rather than of a?
    pub is_mass: bool,
}

/// A Dirichlet condition: the dofs of one component on a group of facets have the values of g.
#[derive(Debug, Clone)]
pub struct Condition {
    /// The position of the unknown.
    pub unknown: usize,
    /// The position of its component.
    pub component: usize,
    /// The position of the group.
    pub group: usize,
    /// g, in coordinates and parameters.
    pub value: Id,
}

/// Dirichlet values on a group that scripts set together: for one component, or for a function of vectors as a whole.
#[derive(Debug, Clone)]
pub struct Held {
    /// The position of the unknown.
    pub unknown: usize,
    /// The position of its component; `None` if its element is one of vectors.
    pub component: Option<usize>,
    /// The position of the group.
    pub group: usize,
    /// One value, or one for each component.
    pub values: Vec<Id>,
}

/// The mean of a scalar unknown over the domain, prescribed with a Lagrange multiplier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The position of the unknown.
    pub unknown: usize,
    /// Its mean.
    pub value: f64,
}

/// Equal time steps: F is solved in each, where `old(u)` is the solution of the previous step.
#[derive(Debug, Clone)]
pub struct Time {
    /// The number of steps; the first one starts at 0.
    pub steps: usize,
    /// The position of the parameter `t`, the time at the end of a step; its value is that at the end of the last one.
    pub parameter: usize,
    /// The unknowns at 0, interpolated; a missing component is 0.
    pub initial: Vec<Initial>,
}

/// The initial value of a component of an unknown.
#[derive(Debug, Clone)]
pub struct Initial {
    /// The position of the unknown.
    pub unknown: usize,
    /// The position of its component.
    pub component: usize,
    /// In coordinates and parameters.
    pub value: Id,
}

/// The derivative of an integral: coefficients of pairs of a test function's and an increment's component.
pub type Bilinear = BTreeMap<(Leaf, Leaf), Id>;

impl Problem {
    /// The rule on cells, and that on facets. A rule with a single point is used only if a measure requests it: FFCx 0.5 compiles forms with it wrongly.
    pub fn rules(&self) -> [Rule; 2] {
        let rule = |dim, degree: usize| self.cells.exact(dim, degree.max(2));
        [
            rule(self.dim, self.degree),
            rule(self.dim - 1, self.facet_degree),
        ]
    }

    /// The length of a time step, which is a parameter.
    pub fn step(&self) -> Option<&Parameter> {
        self.parameters.get(self.time.as_ref()?.parameter + 1)
    }

    /// The groups of a measure, for codes that integrate over all marked facets unless groups are named: if facets between cells
    /// are marked too, those of the boundary.
    pub fn named(&self, measure: &Measure) -> Vec<usize> {
        let is_facets = |k: &usize| self.groups[*k].dim + 1 == self.dim;
        let is_outside = |k: &usize| self.groups[*k].on == Some(Domain::Boundary);
        let all = || (0..self.groups.len()).filter(is_facets);
        match measure.domain {
            Domain::Boundary if measure.groups.is_empty() && !all().all(|k| is_outside(&k)) => {
                all().filter(is_outside).collect()
            }
            _ => measure.groups.clone(),
        }
    }

    /// The rule of a measure, given those on cells and on facets.
    pub fn rule_of(&self, measure: &Measure, [cells, facets]: [Rule; 2]) -> Rule {
        let dim = match measure.domain {
            Domain::Cells => self.dim,
            Domain::Boundary | Domain::Interior => self.dim - 1,
        };
        match (measure.degree, measure.domain) {
            (Some(degree), _) => self.cells.exact(dim, degree),
            (None, Domain::Cells) => cells,
            (None, _) => facets,
        }
    }

    /// The rules on cells and on facets, and then the separate rules of measures.
    pub fn all_rules(&self) -> Vec<Rule> {
        let mut all = Vec::from(self.rules());
        for integral in self.integrals.iter().filter(|i| i.measure.degree.is_some()) {
            let rule = self.rule_of(&integral.measure, self.rules());
            if !all.contains(&rule) {
                all.push(rule);
            }
        }
        all
    }

    /// The integrals grouped by measure, so that a script has one of each.
    pub fn residual(&mut self) -> Vec<Integral> {
        let mut all: Vec<Integral> = Vec::new();
        for integral in self.integrals.clone() {
            let Some(same) = all.iter_mut().find(|other| {
                (&other.measure, other.is_mass) == (&integral.measure, integral.is_mass)
            }) else {
                all.push(integral);
                continue;
            };
            for (leaf, coefficient) in integral.terms {
                let sum = match same.terms.get(&leaf) {
                    Some(before) => self.scalars.add(*before, coefficient),
                    None => coefficient,
                };
                same.terms.insert(leaf, sum);
            }
        }
        for integral in &mut all {
            integral
                .terms
                .retain(|_, coefficient| !self.scalars.is_zero(*coefficient));
        }
        all
    }

    /// The derivative of an integral at the unknowns (Gateaux): Σ ∂c_a/∂b of each coefficient c_a by each component b of the
    /// unknowns and their gradients.
    pub fn derivative(&mut self, integral: &Integral) -> Bilinear {
        let mut all = Bilinear::new();
        for (test, coefficient) in &integral.terms {
            let is_unknown = |leaf: &Leaf| matches!(leaf.field, Field::Unknown(_));
            for (leaf, by) in self.scalars.partials(*coefficient, is_unknown) {
                let Field::Unknown(k) = leaf.field else {
                    continue;
                };
                let increment = Leaf {
                    field: Field::Increment(k),
                    ..leaf
                };
                all.insert((*test, increment), by);
            }
        }
        all
    }

    /// Is an integral linear in the unknowns, without terms that do not contain them?
    pub fn is_bilinear(&mut self, integral: &Integral) -> bool {
        let is_unknown = |leaf: &Leaf| matches!(leaf.field, Field::Unknown(_));
        let mut coefficients = integral.terms.values();
        coefficients.all(|c| self.scalars.linear(*c, &is_unknown).is_ok())
    }

    /// Does F depend on the unknowns affinely, so that its derivative does not contain them?
    pub fn is_linear(&mut self) -> bool {
        let integrals = self.integrals.clone();
        integrals.iter().all(|integral| {
            let by = self.derivative(integral);
            let leaves = self.scalars.leaves(by.into_values());
            leaves
                .iter()
                .all(|leaf| !matches!(leaf.field, Field::Unknown(_)))
        })
    }

    /// The components of all unknowns, in order: positions of the unknown and of its component.
    pub fn components(&self) -> Vec<(usize, usize)> {
        let each = self.unknowns.iter().enumerate();
        each.flat_map(|(k, unknown)| (0..unknown.space.count()).map(move |c| (k, c)))
            .collect()
    }

    /// The scalar functions of the unknowns, as in [`Self::components`], but with a function in a space of vectors as a whole, without
    /// a component.
    pub fn blocks(&self) -> Vec<(usize, Option<usize>)> {
        let each = self.unknowns.iter().enumerate();
        let blocks = each.flat_map(|(k, unknown)| {
            let count = if unknown.space.element.is_vector() {
                1
            } else {
                unknown.space.count()
            };
            (0..count).map(move |c| (k, (!unknown.space.element.is_vector()).then_some(c)))
        });
        blocks.collect()
    }

    /// The position among [`Self::blocks`] of the function that a component belongs to.
    pub fn block(&self, unknown: usize, component: usize) -> usize {
        let is_it =
            |(k, c): &(usize, Option<usize>)| *k == unknown && c.is_none_or(|c| c == component);
        self.blocks().iter().position(is_it).unwrap_or(0)
    }

    /// The Dirichlet values in their order, those of a function of vectors together.
    pub fn held(&self) -> Vec<Held> {
        let mut all: Vec<Held> = Vec::new();
        for condition in &self.conditions {
            let is_vector = self.unknowns[condition.unknown].space.element.is_vector();
            match all.last_mut() {
                Some(last) if is_vector && condition.component > 0 => {
                    last.values.push(condition.value);
                }
                _ => all.push(Held {
                    unknown: condition.unknown,
                    component: (!is_vector).then_some(condition.component),
                    group: condition.group,
                    values: vec![condition.value],
                }),
            }
        }
        all
    }

    /// The position of a component among those of all unknowns.
    pub fn position(&self, unknown: usize, component: usize) -> usize {
        let before = self.unknowns[..unknown].iter();
        before.map(|other| other.space.count()).sum::<usize>() + component
    }

    /// Does F contain a length of cells or facets?
    pub fn has_length(&self, length: Length) -> bool {
        self.has(|node| matches!(node, Node::Length(own, _) if own == length))
    }

    /// Does F contain second derivatives?
    pub fn has_second(&self) -> bool {
        let tests = self.integrals.iter().flat_map(|i| i.terms.keys());
        tests.clone().any(|leaf| leaf.second.is_some())
            || self.has(|node| matches!(node, Node::Leaf(leaf) if leaf.second.is_some()))
    }

    /// Has a node of F this property?
    pub fn has(&self, is: impl Fn(Node) -> bool) -> bool {
        let roots = self
            .integrals
            .iter()
            .flat_map(|i| i.terms.values().copied());
        let nodes = self.scalars.nodes_of(roots);
        nodes.into_iter().any(|id| is(self.scalars.node(id)))
    }

    /// The element for the nodes of its results, which represents all unknowns exactly.
    pub fn output(&self) -> Element {
        let elements = || self.unknowns.iter().map(|u| u.space.element);
        let degree = elements().map(Element::degree).max().unwrap_or(1).max(1) as u8;
        match elements().all(Element::is_continuous) {
            true => Element::Continuous(degree),
            false => Element::Broken(degree),
        }
    }
}
