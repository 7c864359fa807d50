//! Scalar expressions as one shared graph: equal expressions are the same node, so common subexpressions are found by construction.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use faceoff_fem::scene::expression::{Comparison, Function};
use faceoff_mesh::mesh::CellGeometry;

/// An expression: a node of [`Scalars`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(u32);

/// The side of a facet from which the limit of a function is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// From the only adjacent cell: inside of cells and on the boundary.
    Here,
    /// From the first cell of an interior facet; its normal points into the other.
    Plus,
    /// From the second cell of an interior facet.
    Minus,
}

/// A function in a finite element space, or a datum, by its position in the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Field {
    /// An unknown.
    Unknown(usize),
    /// An unknown at the end of the previous step.
    Old(usize),
    /// The increment of an unknown in a step of Newton's method.
    Increment(usize),
    /// The test function of an unknown.
    Test(usize),
    /// A datum.
    Datum(usize),
}

/// A component of a field or of its gradient, from one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Leaf {
    /// The field.
    pub field: Field,
    /// 0 for a scalar field.
    pub component: usize,
    /// The partial derivative along this axis; `None`: the value.
    pub axis: Option<usize>,
    /// The derivative of that along another axis, which is not before the first one.
    pub second: Option<usize>,
    /// The side.
    pub side: Side,
}

/// A length of a cell: one that a form names, or that a code may use instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Length {
    /// The longest edge.
    Diameter,
    /// The radius of the circle or sphere through the vertices.
    Circumradius,
    /// The radius of the largest circle or ball inside.
    Inradius,
    /// The longest edge of the facet at hand; inside of cells the shortest edge.
    Facet,
}

/// An operation, or a leaf of the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Node {
    /// The bits of a number.
    Number(u64),
    /// π
    Pi,
    /// A parameter, by its position in the problem.
    Parameter(usize),
    /// A coordinate of the point.
    Coordinate(usize),
    /// A component of the unit normal, which points out of the cell.
    Normal(usize, Side),
    /// A length of the cell.
    Length(Length, Side),
    /// A component of a field or of its gradient.
    Leaf(Leaf),
    /// a + b
    Add(Id, Id),
    /// a b
    Multiply(Id, Id),
    /// a/b
    Divide(Id, Id),
    /// aᵇ
    Power(Id, Id),
    /// A function of one or two arguments.
    Call(Function, Id, Option<Id>),
    /// The third if the comparison of the first two holds, else the fourth.
    If(Comparison, [Id; 4]),
}

impl Length {
    /// Its name in forms; that of the inradius is not available in forms.
    pub fn name(self) -> &'static str {
        match self {
            Length::Diameter => "h",
            Length::Circumradius => "circumradius",
            Length::Inradius => "inradius",
            Length::Facet => "facet_length",
        }
    }

    /// The length for a cell; with a facet of it, if it is one of a facet.
    pub fn of(self, cell: &CellGeometry, facet: Option<usize>) -> f64 {
        let dim = cell.dim;
        let edges = |without: Option<usize>| {
            let own = (0..=dim).filter(move |i| Some(*i) != without);
            let pairs = own
                .clone()
                .flat_map(move |i| own.clone().map(move |j| (i, j)));
            pairs
                .filter(|(i, j)| i < j)
                .map(|(i, j)| (cell.vertices[i] - cell.vertices[j]).norm())
        };
        let surface = || (0..=dim).map(|i| cell.face_measure(i)).sum::<f64>();
        match self {
            Length::Diameter => cell.diameter,
            Length::Inradius => dim as f64 * cell.measure() / surface(),
            Length::Facet if facet.is_some() => edges(facet).fold(0.0, f64::max),
            Length::Facet => edges(None).fold(f64::INFINITY, f64::min),
            // In barycentric coordinates the centre is at x₀ + c, where 2 (x_i - x₀)·c = |x_i - x₀|² and c = Σ s_i ∇λ_i, s_i = (x_i - x₀)·c.
            Length::Circumradius => {
                let half = |i: usize| 0.5 * (cell.vertices[i] - cell.vertices[0]).norm_squared();
                let each = (2..=dim).map(|i| cell.gradients[i] * half(i));
                each.fold(cell.gradients[1] * half(1), |sum, part| sum + part)
                    .norm()
            }
        }
    }
}

impl Node {
    /// The nodes that it depends on.
    pub fn parts(&self) -> Vec<Id> {
        match *self {
            Node::Add(a, b) | Node::Multiply(a, b) | Node::Divide(a, b) | Node::Power(a, b) => {
                vec![a, b]
            }
            Node::Call(_, a, b) => std::iter::once(a).chain(b).collect(),
            Node::If(_, parts) => parts.into(),
            _ => Vec::new(),
        }
    }
}

/// Bounds for recursive algorithms: far beyond any form that a person writes.
const MOST_DEPTH: u32 = 250;
const MOST_NODES: usize = 100_000;

/// All expressions of a problem; a node comes after those that it depends on.
#[derive(Clone, Default)]
pub struct Scalars {
    nodes: Vec<Node>,
    /// The longest path from each node to a leaf.
    depths: Vec<u32>,
    known: HashMap<Node, Id>,
}

/// The nodes, which contain all information: the same text for the same expressions.
impl std::fmt::Debug for Scalars {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(&self.nodes).finish()
    }
}

impl Scalars {
    /// The node of an expression.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.0 as usize]
    }

    /// The number, if the expression is one.
    pub fn number_of(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Is it the number 0?
    pub fn is_zero(&self, id: Id) -> bool {
        self.number_of(id) == Some(0.0)
    }

    fn is_one(&self, id: Id) -> bool {
        self.number_of(id) == Some(1.0)
    }

    /// A node, unchanged; the constructors below simplify first.
    pub fn push(&mut self, node: Node) -> Id {
        if let Some(known) = self.known.get(&node) {
            return *known;
        }
        let next = Id(self.nodes.len() as u32);
        let parts = node.parts().into_iter();
        let below = parts.map(|part| self.depths[part.0 as usize] + 1).max();
        self.nodes.push(node);
        self.depths.push(below.unwrap_or(0));
        self.known.insert(node, next);
        next
    }

    /// Is recursion over the expression safe, whatever its text was? Nested tensor functions make expressions that are much
    /// deeper and larger than their text.
    pub fn is_bounded(&self, id: Id) -> bool {
        self.depths[id.0 as usize] <= MOST_DEPTH && self.nodes.len() <= MOST_NODES
    }

    /// The number of operations in an expression that is written out in full, with shared parts counted as often as they occur.
    pub fn length(&self, id: Id) -> f64 {
        let mut lengths: HashMap<Id, f64> = HashMap::new();
        for each in self.nodes_of([id]) {
            let parts = self.node(each).parts();
            let sum: f64 = parts.iter().map(|part| lengths[part]).sum();
            lengths.insert(each, sum + 1.0);
        }
        lengths[&id]
    }

    /// A number.
    pub fn number(&mut self, value: f64) -> Id {
        // -0 is 0.
        self.push(Node::Number((value + 0.0).to_bits()))
    }

    /// A leaf.
    pub fn leaf(&mut self, leaf: Leaf) -> Id {
        self.push(Node::Leaf(leaf))
    }

    /// a + b
    pub fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.number_of(a), self.number_of(b)) {
            (Some(a), Some(b)) => self.number(a + b),
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            _ => self.push(Node::Add(a, b)),
        }
    }

    /// -a
    pub fn negative(&mut self, a: Id) -> Id {
        let minus = self.number(-1.0);
        self.multiply(minus, a)
    }

    /// a - b
    pub fn subtract(&mut self, a: Id, b: Id) -> Id {
        let b = self.negative(b);
        self.add(a, b)
    }

    /// a b; numbers come first.
    pub fn multiply(&mut self, a: Id, b: Id) -> Id {
        match (self.number_of(a), self.number_of(b)) {
            (Some(a), Some(b)) => self.number(a * b),
            (Some(0.0), _) | (_, Some(1.0)) => a,
            (Some(1.0), _) | (_, Some(0.0)) => b,
            (None, Some(_)) => self.multiply(b, a),
            (Some(value), None) => match self.node(b) {
                Node::Multiply(c, d) if self.number_of(c).is_some() => {
                    let first = self.number(value * self.number_of(c).unwrap_or(1.0));
                    self.multiply(first, d)
                }
                Node::Divide(c, d) if self.number_of(c).is_some() => {
                    let first = self.number(value * self.number_of(c).unwrap_or(1.0));
                    self.divide(first, d)
                }
                _ => self.push(Node::Multiply(a, b)),
            },
            // A factor that is a number goes to the front.
            (None, None) => match (self.node(a), self.node(b)) {
                (_, Node::Multiply(c, d)) if self.number_of(c).is_some() => {
                    let rest = self.multiply(a, d);
                    self.multiply(c, rest)
                }
                (Node::Multiply(c, d), _) if self.number_of(c).is_some() => {
                    let rest = self.multiply(d, b);
                    self.multiply(c, rest)
                }
                _ => self.push(Node::Multiply(a, b)),
            },
        }
    }

    /// a/b
    pub fn divide(&mut self, a: Id, b: Id) -> Id {
        if self.is_zero(a) || self.is_one(b) {
            return a;
        }
        match (self.number_of(a), self.number_of(b)) {
            (Some(a), Some(b)) if b != 0.0 => self.number(a / b),
            _ => self.push(Node::Divide(a, b)),
        }
    }

    /// aᵇ
    pub fn power(&mut self, a: Id, b: Id) -> Id {
        match self.number_of(b) {
            Some(0.0) => self.number(1.0),
            Some(1.0) => a,
            _ => self.push(Node::Power(a, b)),
        }
    }

    /// A function of one or two arguments.
    pub fn call(&mut self, function: Function, a: Id, b: Option<Id>) -> Id {
        self.push(Node::Call(function, a, b))
    }

    /// `then` if the comparison of a and b holds, else `otherwise`.
    pub fn choose(&mut self, comparison: Comparison, parts: [Id; 4]) -> Id {
        match parts[2] == parts[3] {
            true => parts[2],
            false => self.push(Node::If(comparison, parts)),
        }
    }

    /// The sum of several.
    pub fn sum(&mut self, parts: impl IntoIterator<Item = Id>) -> Id {
        let zero = self.number(0.0);
        parts.into_iter().fold(zero, |a, b| self.add(a, b))
    }

    /// The same with replaced nodes: `change` returns the replacement of a leaf, or `None` to keep it.
    pub fn map(&mut self, id: Id, change: &mut impl FnMut(&mut Self, Node) -> Option<Id>) -> Id {
        self.mapped(id, change, &mut HashMap::new())
    }

    fn mapped(
        &mut self,
        id: Id,
        change: &mut impl FnMut(&mut Self, Node) -> Option<Id>,
        done: &mut HashMap<Id, Id>,
    ) -> Id {
        if let Some(known) = done.get(&id) {
            return *known;
        }
        let node = self.node(id);
        let found = change(self, node).unwrap_or_else(|| match node {
            Node::Add(a, b) => {
                let [a, b] = [a, b].map(|part| self.mapped(part, change, done));
                self.add(a, b)
            }
            Node::Multiply(a, b) => {
                let [a, b] = [a, b].map(|part| self.mapped(part, change, done));
                self.multiply(a, b)
            }
            Node::Divide(a, b) => {
                let [a, b] = [a, b].map(|part| self.mapped(part, change, done));
                self.divide(a, b)
            }
            Node::Power(a, b) => {
                let [a, b] = [a, b].map(|part| self.mapped(part, change, done));
                self.power(a, b)
            }
            Node::Call(function, a, b) => {
                let a = self.mapped(a, change, done);
                let b = b.map(|b| self.mapped(b, change, done));
                self.call(function, a, b)
            }
            Node::If(comparison, parts) => {
                let parts = parts.map(|part| self.mapped(part, change, done));
                self.choose(comparison, parts)
            }
            _ => id,
        });
        done.insert(id, found);
        found
    }

    /// All nodes of some expressions, each once, in order of dependence.
    pub fn nodes_of(&self, roots: impl IntoIterator<Item = Id>) -> Vec<Id> {
        let mut wanted: Vec<Id> = roots.into_iter().collect();
        let mut seen = BTreeSet::new();
        while let Some(id) = wanted.pop() {
            if seen.insert(id) {
                wanted.extend(self.node(id).parts());
            }
        }
        seen.into_iter().collect()
    }

    /// The leaves of some expressions.
    pub fn leaves(&self, roots: impl IntoIterator<Item = Id>) -> Vec<Leaf> {
        let nodes = self.nodes_of(roots).into_iter();
        nodes
            .filter_map(|id| match self.node(id) {
                Node::Leaf(leaf) => Some(leaf),
                _ => None,
            })
            .collect()
    }

    /// The derivative of an expression, given those of its leaves: `of` is called for leaves, coordinates, normals and diameters.
    pub fn derivative(&mut self, id: Id, of: &mut impl FnMut(&mut Self, Node) -> Id) -> Id {
        self.derived(id, of, &mut HashMap::new())
    }

    fn derived(
        &mut self,
        id: Id,
        of: &mut impl FnMut(&mut Self, Node) -> Id,
        done: &mut HashMap<Id, Id>,
    ) -> Id {
        if let Some(known) = done.get(&id) {
            return *known;
        }
        let node = self.node(id);
        let mut slope = |s: &mut Self, part: Id| s.derived(part, of, done);
        let found = match node {
            Node::Number(_) | Node::Pi | Node::Parameter(_) => self.number(0.0),
            Node::Add(a, b) => {
                let [da, db] = [a, b].map(|part| slope(self, part));
                self.add(da, db)
            }
            Node::Multiply(a, b) => {
                let [da, db] = [a, b].map(|part| slope(self, part));
                let (left, right) = (self.multiply(da, b), self.multiply(a, db));
                self.add(left, right)
            }
            Node::Divide(a, b) => {
                let [da, db] = [a, b].map(|part| slope(self, part));
                let first = self.divide(da, b);
                // (a/b)' = a'/b - (a/b) b'/b
                let rest = self.multiply(id, db);
                let rest = self.divide(rest, b);
                self.subtract(first, rest)
            }
            Node::Power(a, b) => {
                let [da, db] = [a, b].map(|part| slope(self, part));
                let one = self.number(1.0);
                let less = self.subtract(b, one);
                let first = self.power(a, less);
                let first = self.multiply(b, first);
                let first = self.multiply(first, da);
                let log = self.call(Function::Log, a, None);
                let rest = self.multiply(id, log);
                let rest = self.multiply(rest, db);
                self.add(first, rest)
            }
            Node::Call(function, a, b) => {
                let da = slope(self, a);
                let db = b.map(|b| slope(self, b));
                self.call_derivative(id, function, [Some(a), b], [Some(da), db])
            }
            Node::If(comparison, [a, b, then, otherwise]) => {
                let [then, otherwise] = [then, otherwise].map(|part| slope(self, part));
                self.choose(comparison, [a, b, then, otherwise])
            }
            _ => of(self, node),
        };
        done.insert(id, found);
        found
    }

    fn call_derivative(
        &mut self,
        id: Id,
        function: Function,
        arguments: [Option<Id>; 2],
        slopes: [Option<Id>; 2],
    ) -> Id {
        let zero = self.number(0.0);
        let one = self.number(1.0);
        let [a, b] = arguments.map(|a| a.unwrap_or(zero));
        let [da, db] = slopes.map(|d| d.unwrap_or(zero));
        if self.is_zero(da) && self.is_zero(db) {
            return zero;
        }
        let square = |s: &mut Self, a: Id| s.multiply(a, a);
        // g' of g(a).
        let outer = match function {
            Function::Sin => self.call(Function::Cos, a, None),
            Function::Cos => {
                let sine = self.call(Function::Sin, a, None);
                self.negative(sine)
            }
            Function::Tan => {
                let tan2 = square(self, id);
                self.add(one, tan2)
            }
            Function::Asin | Function::Acos => {
                let a2 = square(self, a);
                let rest = self.subtract(one, a2);
                let root = self.call(Function::Sqrt, rest, None);
                let sign = self.number(if function == Function::Asin {
                    1.0
                } else {
                    -1.0
                });
                self.divide(sign, root)
            }
            Function::Atan => {
                let a2 = square(self, a);
                let below = self.add(one, a2);
                self.divide(one, below)
            }
            Function::Sinh => self.call(Function::Cosh, a, None),
            Function::Cosh => self.call(Function::Sinh, a, None),
            Function::Tanh => {
                let tanh2 = square(self, id);
                self.subtract(one, tanh2)
            }
            Function::Exp => id,
            Function::Log => self.divide(one, a),
            Function::Sqrt => {
                let half = self.number(0.5);
                self.divide(half, id)
            }
            Function::Abs => {
                let minus = self.number(-1.0);
                self.choose(Comparison::Less, [a, zero, minus, one])
            }
            // The angle of (b, a): (b da - a db)/(a² + b²).
            Function::Atan2 => {
                let (left, right) = (self.multiply(b, da), self.multiply(a, db));
                let above = self.subtract(left, right);
                let (a2, b2) = (square(self, a), square(self, b));
                let below = self.add(a2, b2);
                return self.divide(above, below);
            }
            Function::Min => return self.choose(Comparison::Less, [a, b, da, db]),
            Function::Max => return self.choose(Comparison::Greater, [a, b, da, db]),
        };
        self.multiply(outer, da)
    }

    /// The partial derivatives of an expression with respect to its leaves that `varies` accepts; those that are 0 are left out.
    pub fn partials(&mut self, id: Id, varies: impl Fn(&Leaf) -> bool) -> BTreeMap<Leaf, Id> {
        let leaves = self.leaves([id]).into_iter().filter(varies);
        let mut all = BTreeMap::new();
        for leaf in leaves.collect::<Vec<_>>() {
            let by = self.derivative(id, &mut |s, node| {
                s.number(f64::from(u8::from(node == Node::Leaf(leaf))))
            });
            if !self.is_zero(by) {
                all.insert(leaf, by);
            }
        }
        all
    }

    /// An expression that is linear in the leaves that `is_argument` accepts, as their coefficients.
    ///
    /// # Errors
    /// Why it is not linear and homogeneous.
    pub fn linear(
        &mut self,
        id: Id,
        is_argument: &impl Fn(&Leaf) -> bool,
    ) -> Result<BTreeMap<Leaf, Id>, NotLinear> {
        let mut with = BTreeSet::new();
        for each in self.nodes_of([id]) {
            let is_end = matches!(self.node(each), Node::Leaf(leaf) if is_argument(&leaf));
            if is_end
                || self
                    .node(each)
                    .parts()
                    .iter()
                    .any(|part| with.contains(part))
            {
                with.insert(each);
            }
        }
        self.linear_in(id, &with, &mut HashMap::new())
    }

    /// The same, given all nodes that contain an argument.
    fn linear_in(
        &mut self,
        id: Id,
        with: &BTreeSet<Id>,
        done: &mut HashMap<Id, Coefficients>,
    ) -> Result<Coefficients, NotLinear> {
        if let Some(known) = done.get(&id) {
            return Ok(known.clone());
        }
        let has = |part: Id| with.contains(&part);
        let found: Coefficients = match self.node(id) {
            _ if self.is_zero(id) => Coefficients::new(),
            _ if !has(id) => return Err(NotLinear::Without),
            Node::Leaf(leaf) => [(leaf, self.number(1.0))].into(),
            Node::Add(a, b) => {
                let mut all = self.linear_in(a, with, done)?;
                for (leaf, coefficient) in self.linear_in(b, with, done)? {
                    let sum = match all.get(&leaf) {
                        Some(before) => self.add(*before, coefficient),
                        None => coefficient,
                    };
                    all.insert(leaf, sum);
                }
                all
            }
            Node::Multiply(a, b) if has(a) && has(b) => return Err(NotLinear::Twice),
            Node::Multiply(a, b) => {
                let (factor, rest) = if has(a) { (b, a) } else { (a, b) };
                let rest = self.linear_in(rest, with, done)?.into_iter();
                rest.map(|(leaf, c)| (leaf, self.multiply(factor, c)))
                    .collect()
            }
            Node::Divide(a, b) if !has(b) => {
                let above = self.linear_in(a, with, done)?.into_iter();
                above.map(|(leaf, c)| (leaf, self.divide(c, b))).collect()
            }
            Node::If(comparison, [a, b, then, otherwise]) if !has(a) && !has(b) => {
                let then = self.linear_in(then, with, done)?;
                let otherwise = self.linear_in(otherwise, with, done)?;
                let zero = self.number(0.0);
                let leaves: BTreeSet<Leaf> = then.keys().chain(otherwise.keys()).copied().collect();
                let of = |all: &Coefficients, leaf| all.get(&leaf).copied().unwrap_or(zero);
                let each = leaves.into_iter().map(|leaf| {
                    let parts = [a, b, of(&then, leaf), of(&otherwise, leaf)];
                    (leaf, self.choose(comparison, parts))
                });
                each.collect()
            }
            _ => return Err(NotLinear::Inside),
        };
        done.insert(id, found.clone());
        Ok(found)
    }

    /// The value, given those of the leaves; numbers and π are known.
    pub fn value(&self, id: Id, of: &impl Fn(Node) -> f64) -> f64 {
        let mut values = HashMap::new();
        for each in self.nodes_of([id]) {
            let v = |part: Id| values[&part];
            let value = match self.node(each) {
                Node::Number(bits) => f64::from_bits(bits),
                Node::Pi => std::f64::consts::PI,
                Node::Add(a, b) => v(a) + v(b),
                Node::Multiply(a, b) => v(a) * v(b),
                Node::Divide(a, b) => v(a) / v(b),
                Node::Power(a, b) => f64::powf(v(a), v(b)),
                Node::Call(function, a, b) => function.apply(v(a), b.map_or(0.0, v)),
                Node::If(comparison, [a, b, then, otherwise]) => {
                    v(if comparison.holds(v(a), v(b)) {
                        then
                    } else {
                        otherwise
                    })
                }
                end => of(end),
            };
            values.insert(each, value);
        }
        values[&id]
    }
}

/// The coefficient of each leaf in which an expression is linear.
type Coefficients = BTreeMap<Leaf, Id>;

/// Why an expression is not a linear form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotLinear {
    /// A term without the argument.
    Without,
    /// A product of two arguments.
    Twice,
    /// The argument inside of a function, a power, a divisor or a condition.
    Inside,
}
