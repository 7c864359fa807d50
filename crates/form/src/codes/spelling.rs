//! Common parts of scripts: names that are not reserved in a code, and scalars as text.

use std::collections::{BTreeMap, BTreeSet};

use faceoff_fem::scene::expression::{Comparison, Function};

use crate::problem::{Domain, Element, Measure, Problem};
use crate::scalar::{Field, Id, Leaf, Node, Scalars};

/// Names of a problem in a script. If a name is reserved in a code or the language of its scripts, a mark is appended.
#[derive(Debug)]
pub struct Words {
    taken: BTreeSet<String>,
    /// Reserved words of the code; with digits appended, the frame may use them as well.
    reserved: BTreeSet<String>,
    /// `_`, or `X` if names have no underscores.
    mark: char,
    whole: BTreeMap<Field, String>,
    parts: BTreeMap<Field, Vec<String>>,
    /// For parameters.
    pub parameters: Vec<String>,
}

impl Words {
    /// `reserved` are reserved words of the code; components of vectors are counted from `first`.
    pub fn new(problem: &Problem, reserved: &[&str], first: usize, mark: char) -> Self {
        let mut words = Words {
            mark,
            taken: BTreeSet::new(),
            reserved: reserved
                .iter()
                .flat_map(|words| words.split_whitespace())
                .map(str::to_owned)
                .collect(),
            whole: BTreeMap::new(),
            parts: BTreeMap::new(),
            parameters: Vec::new(),
        };
        words.parameters = problem
            .parameters
            .iter()
            .map(|p| words.fresh(&p.name))
            .collect();
        let mut add = |field: Field, name: &str, shape: &[usize]| {
            let whole = words.fresh(name);
            let place = |k: usize| match shape {
                [_] => (k + first).to_string(),
                [_, columns, ..] => format!("{}{}", k / columns + first, k % columns + first),
                [] => String::new(),
            };
            let parts = match shape {
                [] => vec![whole.clone()],
                _ => (0..shape.iter().product())
                    .map(|k| words.fresh(&format!("{name}{}", place(k))))
                    .collect(),
            };
            words.whole.insert(field, whole);
            words.parts.insert(field, parts);
        };
        for (k, unknown) in problem.unknowns.iter().enumerate() {
            let test = unknown.test.replace("test.", "test_");
            add(Field::Unknown(k), &unknown.name, &unknown.space.shape());
            add(Field::Test(k), &test, &unknown.space.shape());
            if problem.time.is_some() {
                let old = format!("old_{}", unknown.name);
                add(Field::Old(k), &old, &unknown.space.shape());
            }
            add(
                Field::Increment(k),
                &format!("d{}", unknown.name),
                &unknown.space.shape(),
            );
        }
        for (k, datum) in problem.data.iter().enumerate() {
            add(Field::Datum(k), &datum.name, &datum.shape);
        }
        words
    }

    /// A name that is not in use.
    pub fn fresh(&mut self, name: &str) -> String {
        let mut name = name.to_owned();
        if self.mark != '_' {
            name = name.replace('_', "");
        }
        let is_digit = |c: char| c.is_ascii_digit();
        while self.reserved.contains(name.trim_end_matches(is_digit))
            || self.reserved.contains(&name)
            || !self.taken.insert(name.clone())
        {
            name.push(self.mark);
        }
        name
    }

    /// The name of a field as a whole.
    pub fn whole(&self, field: Field) -> &str {
        &self.whole[&field]
    }

    /// The names of its components; for a scalar, its own name.
    pub fn parts(&self, field: Field) -> &[String] {
        &self.parts[&field]
    }

    /// The components of data that are interpolated: name, element and formula.
    pub fn interpolated(&self, problem: &Problem) -> Vec<(String, Element, Id)> {
        let mut all = Vec::new();
        for (k, datum) in problem.data.iter().enumerate() {
            let Some(space) = datum.space else { continue };
            let parts = self.parts(Field::Datum(k)).iter().zip(&datum.components);
            all.extend(parts.map(|(name, id)| (name.clone(), space.element, *id)));
        }
        all
    }

    /// The name of a component.
    pub fn part(&self, leaf: Leaf) -> &str {
        &self.parts[&leaf.field][leaf.component]
    }
}

/// The notation of functions, powers and conditionals.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// A function of one or two arguments.
    pub call: fn(Function, &[String]) -> String,
    /// A power, with the base in brackets if necessary.
    pub power: fn(&str, &Exponent) -> String,
    /// A conditional: the comparison, its sides and both values.
    pub choice: fn(&str, &[String; 4]) -> String,
}

impl Style {
    /// With the leaves of expressions: parameters, coordinates, normals, diameters and fields.
    pub fn with<'a>(&'a self, end: &'a dyn Fn(Node) -> String) -> Spelling<'a> {
        Spelling { end, style: self }
    }
}

/// The notation of scalars.
pub struct Spelling<'a> {
    end: &'a dyn Fn(Node) -> String,
    style: &'a Style,
}

/// The exponent of a power.
pub enum Exponent {
    /// An integer from -9 to -1 or 2 to 9.
    Integer(i8),
    /// Any other number or expression as text, in brackets if necessary.
    Other(String),
}

impl Exponent {
    /// The exponent without a sign.
    pub fn text(&self) -> String {
        match self {
            Exponent::Integer(n) if *n < 0 => format!("({n}.0)"),
            Exponent::Integer(n) => n.to_string(),
            Exponent::Other(text) => text.clone(),
        }
    }

    /// The base, the sign of powers and the exponent.
    pub fn after(&self, base: &str, sign: &str) -> String {
        format!("{base}{sign}{}", self.text())
    }
}

/// The precedence of an expression.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Tight {
    Sum,
    Product,
    Power,
    Atom,
}

/// Common subexpressions, which are printed by name.
pub type Shared = BTreeMap<Id, String>;

impl Spelling<'_> {
    /// An expression as text.
    pub fn text(&self, scalars: &Scalars, id: Id, shared: &Shared) -> String {
        self.print(scalars, id, shared).0
    }

    /// The same as a factor: sums are in brackets.
    pub fn factor(&self, scalars: &Scalars, id: Id, shared: &Shared) -> String {
        self.within(scalars, id, shared, Tight::Product)
    }

    fn within(&self, scalars: &Scalars, id: Id, shared: &Shared, least: Tight) -> String {
        let (text, tight) = self.print(scalars, id, shared);
        match tight >= least {
            true => text,
            false => format!("({text})"),
        }
    }

    fn print(&self, scalars: &Scalars, id: Id, shared: &Shared) -> (String, Tight) {
        if let Some(name) = shared.get(&id) {
            return (name.clone(), Tight::Atom);
        }
        self.print_node(scalars, id, shared)
    }

    /// A shared expression, in terms of the others.
    pub fn definition(&self, scalars: &Scalars, id: Id, shared: &Shared) -> String {
        self.print_node(scalars, id, shared).0
    }

    fn print_node(&self, scalars: &Scalars, id: Id, shared: &Shared) -> (String, Tight) {
        let within = |part, least| self.within(scalars, part, shared, least);
        match scalars.node(id) {
            Node::Number(bits) => {
                let value = f64::from_bits(bits);
                let tight = if value < 0.0 { Tight::Sum } else { Tight::Atom };
                (format!("{value:?}"), tight)
            }
            Node::Add(a, b) => {
                let left = within(a, Tight::Sum);
                let right = within(b, Tight::Sum);
                // A sum on the right needs no brackets: only rounding could differ.
                (format!("{left} {}", signed(&right, false)), Tight::Sum)
            }
            Node::Multiply(a, b) if scalars.number_of(a).is_some_and(|a| a < 0.0) => {
                let sign = match scalars.number_of(a) {
                    Some(a) if a != -1.0 => format!("{a:?}*"),
                    _ => "-".to_owned(),
                };
                (sign + &within(b, Tight::Product), Tight::Sum)
            }
            Node::Multiply(a, b) => (
                format!(
                    "{}*{}",
                    within(a, Tight::Product),
                    within(b, Tight::Product)
                ),
                Tight::Product,
            ),
            Node::Divide(a, b) => (
                format!("{}/{}", within(a, Tight::Product), within(b, Tight::Power)),
                Tight::Product,
            ),
            Node::Power(a, b) => {
                let exponent = match scalars.number_of(b) {
                    Some(n) if n.fract() == 0.0 && n.abs() < 10.0 => Exponent::Integer(n as i8),
                    _ => Exponent::Other(within(b, Tight::Atom)),
                };
                let text = (self.style.power)(&within(a, Tight::Atom), &exponent);
                (text, Tight::Power)
            }
            Node::Call(function, a, b) => {
                let arguments = std::iter::once(a)
                    .chain(b)
                    .map(|part| within(part, Tight::Sum));
                (
                    (self.style.call)(function, &arguments.collect::<Vec<_>>()),
                    Tight::Atom,
                )
            }
            Node::If(comparison, parts) => {
                let sign = match comparison {
                    Comparison::Less => "<",
                    Comparison::LessEqual => "<=",
                    Comparison::Greater => ">",
                    Comparison::GreaterEqual => ">=",
                };
                (
                    (self.style.choice)(sign, &parts.map(|part| within(part, Tight::Sum))),
                    Tight::Atom,
                )
            }
            end => ((self.end)(end), Tight::Atom),
        }
    }
}

/// Names for subexpressions that occur more than once and are not trivial, in order of dependence.
pub fn shared(scalars: &Scalars, roots: &[Id], words: &mut Words) -> Vec<(Id, String)> {
    let nodes = scalars.nodes_of(roots.iter().copied());
    let mut uses: BTreeMap<Id, usize> = BTreeMap::new();
    let mut size: BTreeMap<Id, usize> = BTreeMap::new();
    for id in &nodes {
        let parts = scalars.node(*id).parts();
        size.insert(
            *id,
            parts
                .iter()
                .fold(usize::from(!parts.is_empty()), |sum, part| {
                    sum.saturating_add(size[part])
                }),
        );
        for part in parts {
            *uses.entry(part).or_default() += 1;
        }
    }
    for root in roots {
        *uses.entry(*root).or_default() += 1;
    }
    let mut found = Vec::new();
    for id in nodes {
        if uses[&id] > 1 && size[&id] > 2 {
            found.push((id, words.fresh(&format!("s{}", found.len() + 1))));
            size.insert(id, 0);
        }
    }
    found
}

/// A measure in the notation of the form.
pub fn measure(problem: &Problem, measure: &Measure) -> String {
    let name = match measure.domain {
        Domain::Cells => "dx",
        Domain::Boundary => "ds",
        Domain::Interior => "dS",
    };
    let groups: Vec<&str> = measure
        .groups
        .iter()
        .map(|k| problem.groups[*k].name.as_str())
        .collect();
    let degree = measure.degree.map(|degree| format!("degree={degree}"));
    let all: Vec<&str> = groups.into_iter().chain(degree.as_deref()).collect();
    match all.is_empty() {
        true => name.to_owned(),
        false => format!("{name}({})", all.join(", ")),
    }
}

/// A line of a comment: it cannot end the comment or a string, whatever a file contains.
pub fn comment(text: &str) -> String {
    let plain = |c: char| match c {
        '\\' => '/',
        '"' => '\'',
        '\u{2028}' | '\u{2029}' => ' ',
        c if c.is_control() => ' ',
        c => c,
    };
    text.chars().map(plain).collect()
}

/// A term of a sum, with its sign separated unless it is the first one: `a`, `+ b`, `- c`.
pub fn signed(text: &str, is_first: bool) -> String {
    match text.strip_prefix('-') {
        _ if is_first => text.to_owned(),
        Some(rest) => format!("- {rest}"),
        None => format!("+ {text}"),
    }
}

/// The trace that is continuous on facets, of components `u` and a normal `n`: the normal component, or the tangential ones.
pub fn traces(element: Element, u: &[String], n: &[String]) -> Vec<String> {
    let turned = |i: usize, j: usize| format!("({}*({}) - {}*({}))", n[i], u[j], n[j], u[i]);
    match (element, u.len()) {
        (Element::Nedelec, 2) => vec![turned(0, 1)],
        (Element::Nedelec, _) => vec![turned(1, 2), turned(2, 0), turned(0, 1)],
        _ => {
            let products = u.iter().zip(n).map(|(u, n)| format!("{n}*({u})"));
            vec![format!("({})", products.collect::<Vec<_>>().join(" + "))]
        }
    }
}
