//! Random well-posed forms on random meshes: what each consists of, so that it can be made smaller, and the images of it under symmetries.

mod mesh;
mod terms;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

pub use mesh::Shape;
use terms::{BROKEN, SCALAR, VECTOR, WHOLE};

/// Random numbers, the same on every day and machine.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Those of a seed; seeds that follow each other have nothing in common.
    pub fn new(seed: u64) -> Self {
        let mut mixed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        for factor in [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb] {
            mixed = (mixed ^ (mixed >> 30)).wrapping_mul(factor);
        }
        Random(mixed ^ (mixed >> 31))
    }

    /// A number from 0 on.
    pub fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most.max(1)
    }

    fn is(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len())]
    }
}

/// From what forms are drawn.
#[derive(Debug, Clone, Copy)]
pub struct Grammar {
    /// Elements, some more often than others.
    pub elements: &'static [&'static str],
    /// Those for which a rule of degree 4 or more is needed.
    pub few: &'static [&'static str],
    /// May measures have degrees of their own?
    pub has_degrees: bool,
}

/// On triangles.
pub const TRIANGLES: Grammar = Grammar {
    elements: &[
        "P1", "P1", "P2", "P2", "CR", "DG1", "P3", "DG2", "P0", "RT0", "N1curl",
    ],
    few: &["P3"],
    has_degrees: true,
};

/// On quadrangles.
pub const QUADRANGLES: Grammar = Grammar {
    elements: &["P1", "P2", "P2", "DG1", "DG2", "P0"],
    few: &["P2", "DG2"],
    has_degrees: true,
};

/// A function of the point.
fn datum(random: &mut Random, depth: usize) -> String {
    if depth == 0 {
        return random.of(&["x", "y", "0.5", "x*y", "2", "pi"]).to_owned();
    }
    let [a, b] = [0; 2].map(|_| datum(random, depth - 1));
    match random.below(14) {
        0 => format!("sin(3*({a}))"),
        1 => format!("exp(-({a})^2)"),
        2 => format!("({a})/(1 + ({b})^2)"),
        3 => format!("abs({a} - {b})"),
        4 => format!("max({a}, {b})"),
        5 => format!("conditional({a} < {b} + 0.0123, {a}, 1 - ({b}))"),
        6 => format!("sqrt(1 + ({a})^2)"),
        7 => format!("atan2({a}, 1 + ({b})^2)"),
        8 => format!("-({a})^3"),
        9 => format!("min({a}, tanh({b}))"),
        10 | 11 => format!("({a})*({b})"),
        _ => format!("{a} + {b}"),
    }
}

/// A term with its measure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Term {
    /// With the measure, as in `0.2*u^3*v*dx`.
    pub text: String,
    /// The degree of a rule of its own.
    pub degree: Option<usize>,
    /// Is it part of what makes the problem well-posed, or its load?
    is_main: bool,
}

impl Term {
    fn new(text: &str, is_main: bool) -> Self {
        Term {
            text: text.to_owned(),
            degree: None,
            is_main,
        }
    }

    /// As the form has it.
    fn full(&self) -> String {
        match (self.degree, self.text.strip_suffix(')')) {
            (None, _) => self.text.clone(),
            (Some(degree), Some(open)) if self.has_groups() => format!("{open}, degree={degree})"),
            (Some(degree), _) => format!("{}(degree={degree})", self.text),
        }
    }

    fn has_groups(&self) -> bool {
        let measure = self.text.rsplit('*').next().unwrap_or_default();
        measure.starts_with('d') && measure.ends_with(')')
    }
}

/// A form that has one solution near 0, on a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawn {
    /// The element of the unknown.
    element: String,
    is_vector: bool,
    /// The load is last.
    terms: Vec<Term>,
    /// By name, with quotes and brackets.
    data: BTreeMap<&'static str, String>,
    /// Where f is interpolated.
    space: Option<&'static str>,
    degree: usize,
    facet_degree: usize,
    /// Values by group.
    held: Vec<(&'static str, String)>,
    few: bool,
    /// Its mesh.
    pub shape: Shape,
}

/// What moves with a form, or must not move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// Points, cells and the corners of cells in another order.
    Renumbered,
    /// Mesh and data turned by 90 degrees.
    Turned,
    /// All terms of the form twice as large.
    Doubled,
    /// Each term as two halves.
    Halved,
}

impl Symmetry {
    /// What was done, as the end of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Symmetry::Renumbered => "points and cells are numbered in another order",
            Symmetry::Turned => "mesh and data are turned by 90 degrees",
            Symmetry::Doubled => "all terms are doubled",
            Symmetry::Halved => "each term is written as two halves",
        }
    }
}

impl Drawn {
    /// A form with some terms at random.
    pub fn new(random: &mut Random, grammar: &Grammar, shape: Shape) -> Self {
        let element = random.of(grammar.elements);
        let is_whole = element == "RT0" || element == "N1curl";
        let is_vector = !is_whole && random.is(40);
        let is_broken = element.starts_with("DG") || element == "P0";
        let (main, all, load): (&[&str], _, _) = match is_vector {
            _ if is_whole => (
                &["(1 + a^2)*div(u)*div(v)*dx", "dot(u, v)*dx"],
                WHOLE,
                "-(0.3 + f)*dot(b, v)*dx",
            ),
            true => (
                &[
                    "inner((1 + a^2)*sym(grad(u)), sym(grad(v)))*dx",
                    "dot(u, v)*dx",
                ],
                VECTOR,
                "-(0.3 + f)*dot(b, v)*dx",
            ),
            false => (
                &["(1 + a^2)*inner(grad(u), grad(v))*dx", "u*v*dx"],
                SCALAR,
                "-(0.3 + f)*v*dx",
            ),
        };
        let mut terms: Vec<Term> = main.iter().map(|text| Term::new(text, true)).collect();
        if is_broken {
            let jumps: &[&str] = match is_vector {
                true => &["9/avg(h)*dot(jump(u), jump(v))*dS"],
                false => BROKEN,
            };
            terms.extend(jumps.iter().map(|text| Term::new(text, true)));
        }
        for _ in 0..random.below(5) {
            let mut term = Term::new(random.of(all), false);
            if grammar.has_degrees && random.is(30) {
                term.degree = Some([1, 2, 4][random.below(3)]);
            }
            // In any place, as the order of rules may matter.
            let at = match term.degree {
                Some(_) => random.below(terms.len() + 1),
                None => terms.len(),
            };
            terms.insert(at, term);
        }
        terms.push(Term::new(load, true));
        let mut data = BTreeMap::new();
        for (name, depth) in [("a", 2), ("g", 2), ("f", 3)] {
            data.insert(name, format!("\"{}\"", datum(random, depth)));
        }
        let space = random.is(30).then(|| ["P1", "P2"][random.below(2)]);
        let [p, q] = [0; 2].map(|_| datum(random, 1));
        data.insert("b", format!("[\"{p}\", \"{q}\"]"));
        data.insert("K", format!("[[\"1\", \"{p}\"], [\"{q}\", \"2\"]]"));
        if element == "N1curl" {
            for term in &mut terms {
                term.text = term.text.replace("div(", "curl(");
            }
        }
        // Fewer points do not determine these functions.
        let few = grammar.few.contains(&element);
        let least = if few { 4 } else { 2 };
        let degree = least + random.below(6 - least);
        let facet_degree = 3 + 2 * random.below(3);
        let mut drawn = Drawn {
            element: element.to_owned(),
            is_vector,
            terms,
            data,
            space,
            degree,
            facet_degree,
            held: Vec::new(),
            few,
            shape,
        };
        drawn.hold(random);
        drawn
    }

    fn is_whole(&self) -> bool {
        self.element == "RT0" || self.element == "N1curl"
    }

    /// Draws values on the boundary.
    fn hold(&mut self, random: &mut Random) {
        self.held.clear();
        let is_broken = self.element.starts_with("DG") || self.element == "P0";
        if is_broken || !random.is(60) {
            return;
        }
        for group in ["left", "top", "bottom"] {
            if random.is(50) {
                let [p, q] = [0; 2].map(|_| datum(random, 1));
                let is_whole = self.is_whole();
                let value = match (self.is_vector || is_whole, random.is(50) && !is_whole) {
                    (false, _) => format!("\"{p}\""),
                    (true, true) => format!("[\"{p}\", \"free\"]"),
                    (true, false) => format!("[\"0.1*({p})\", \"0.1*({q})\"]"),
                };
                self.held.push((group, value));
            }
        }
    }

    /// The same terms with other values on the boundary, on another mesh: what codes have compiled they need not compile again.
    pub fn varied(&self, random: &mut Random, shape: Shape) -> Self {
        let mut other = self.clone();
        other.shape = shape;
        other.hold(random);
        if other.space.is_some() {
            other.data.insert("f", format!("\"{}\"", datum(random, 3)));
        }
        other
    }

    /// The file of the form, without its mesh.
    pub fn text(&self, name: &str) -> String {
        let power = if self.is_vector { "^2" } else { "" };
        let mut s = format!(
            "name = \"{name}\"\n[spaces]\nu = \"{}{power}\"\n",
            self.element
        );
        let terms: Vec<String> = self.terms.iter().map(Term::full).collect();
        let sum = terms.join("\n + ").replace("+ -", "- ");
        let is_used = |name: &str| words(&sum).any(|word| word == name);
        let mut used = self
            .data
            .iter()
            .filter(|(name, _)| is_used(name))
            .peekable();
        if used.peek().is_some() {
            s += "[data]\n";
        }
        for (name, value) in used {
            let _ = match self.space.filter(|_| *name == "f") {
                Some(space) => writeln!(s, "{name} = {{ expr = {value}, space = \"{space}\" }}"),
                None => writeln!(s, "{name} = {value}"),
            };
        }
        let _ = write!(
            s,
            "[form]\nF = \"\"\"\n{sum}\n\"\"\"\ndegree = {}\nfacet_degree = {}\n",
            self.degree, self.facet_degree
        );
        if !self.held.is_empty() {
            s += "[dirichlet]\n";
        }
        for (group, value) in &self.held {
            let _ = writeln!(s, "{group} = {value}");
        }
        s
    }

    /// What the form is about: its rules where measures have some of their own, and else its element, and the terms that are not part of every
    /// form of it.
    pub fn key(&self) -> String {
        if let Some(rules) = self.rules() {
            return rules;
        }
        let drawn = self.terms.iter().filter(|term| !term.is_main);
        let texts: Vec<String> = drawn.map(Term::full).collect();
        match texts.is_empty() {
            true => self.element.clone(),
            false => format!("{}: {}", self.element, texts.join(" + ")),
        }
    }

    /// The measures with rules of their own.
    pub fn rules(&self) -> Option<String> {
        let of = |term: &Term| {
            let name = term.text.rsplit('*').next()?.split('(').next()?.to_owned();
            Some(format!("{name}(degree={})", term.degree?))
        };
        let all: BTreeSet<String> = self.terms.iter().filter_map(of).collect();
        let all: Vec<String> = all.into_iter().collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// The same with one rule on cells and one on facets.
    pub fn without_rules(&self) -> Drawn {
        let mut other = self.clone();
        other.terms.iter_mut().for_each(|term| term.degree = None);
        other
    }

    /// Simpler ones, the simplest first.
    pub fn simpler(&self) -> Vec<Drawn> {
        let mut all = Vec::new();
        let mut push = |change: &dyn Fn(&mut Drawn)| {
            let mut other = self.clone();
            change(&mut other);
            if other != *self && !all.contains(&other) {
                all.push(other);
            }
        };
        // All that was drawn at once, then one after the other.
        push(&|d| d.terms.retain(|term| term.is_main));
        push(&|d| d.held.clear());
        push(&|d| d.shape = Shape::small());
        push(&|d| d.shape = d.shape.even());
        for k in 0..self.terms.len() - 1 {
            if !self.terms[k].is_main {
                push(&|d| {
                    d.terms.remove(k);
                });
            }
        }
        for (name, simple) in [
            ("a", "\"0\""),
            ("f", "\"1\""),
            ("f", "\"x\""),
            ("g", "\"1\""),
            ("b", "[\"1\", \"1\"]"),
            ("K", "[[\"1\", \"0\"], [\"0\", \"1\"]]"),
        ] {
            push(&|d| {
                // What is simple stays so.
                if d.data
                    .get(name)
                    .is_some_and(|value| value.len() > simple.len())
                {
                    d.data.insert(name, simple.to_owned());
                }
            });
        }
        push(&|d| {
            for term in &mut d.terms {
                term.text = term.text.replace("(1 + a^2)*", "");
            }
        });
        push(&|d| {
            if let Some(last) = d.terms.last_mut() {
                last.text = last.text.replace("(0.3 + f)*", "");
            }
        });
        push(&|d| d.space = None);
        for k in 0..self.terms.len() {
            push(&|d| d.terms[k].degree = None);
        }
        for k in 0..self.held.len() {
            push(&|d| {
                d.held.remove(k);
            });
        }
        push(&|d| {
            let lower = match &*d.element {
                "P3" | "P2" => "P1",
                "DG2" => "DG1",
                _ => return,
            };
            lower.clone_into(&mut d.element);
            d.few = false;
        });
        push(&|d| d.degree = if d.few { 4 } else { 2 });
        push(&|d| d.facet_degree = 3);
        all
    }

    /// An image of the form, whose solution is the image of the solution; none where the symmetry is not one of the form.
    pub fn image(&self, symmetry: Symmetry) -> Option<Drawn> {
        let mut other = self.clone();
        match symmetry {
            Symmetry::Renumbered => other.shape.order = other.shape.order.wrapping_add(17).max(1),
            Symmetry::Turned => {
                let has_components = self.terms.iter().any(|term| term.text.contains('['));
                if self.is_vector || self.is_whole() || has_components || self.shape.is_turned {
                    return None;
                }
                other.shape.is_turned = true;
                for term in &mut other.terms {
                    term.text = turned(&term.text);
                }
                for (name, value) in &mut other.data {
                    *value = match *name {
                        "b" | "K" => turned_tensor(&turned(value))?,
                        _ => turned(value),
                    };
                }
                for (_, value) in &mut other.held {
                    *value = turned(value);
                }
            }
            Symmetry::Doubled => other
                .terms
                .iter_mut()
                .for_each(|term| term.text = format!("2*{}", term.text)),
            Symmetry::Halved => {
                let half = |term: &Term| Term {
                    text: format!("0.5*{}", term.text),
                    ..term.clone()
                };
                other.terms = self
                    .terms
                    .iter()
                    .flat_map(|term| [half(term), half(term)])
                    .collect();
            }
        }
        Some(other)
    }

    /// Integrals of a solution, by name, that its images have too.
    pub fn invariants(&self) -> Vec<(&'static str, String)> {
        let place = |text: &str| match self.shape.is_turned {
            true => turned(text),
            false => text.to_owned(),
        };
        let weight = place("sin(3*x + y)");
        match self.is_vector || self.is_whole() {
            true => vec![
                ("square", "dot(u, u)*dx".to_owned()),
                ("weighted", format!("{weight}*(u[0] + 2*u[1])*dx")),
            ],
            false => vec![
                ("square", format!("(u - {weight})^2*dx")),
                ("boundary", format!("u*{weight}*ds(left)")),
            ],
        }
    }
}

/// The words of a formula.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

/// A formula of the point in the coordinates after a turn by 90 degrees.
fn turned(text: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        out += match word.as_str() {
            "x" => "(y)",
            "y" => "(-x)",
            other => other,
        };
        word.clear();
        out.push(c);
    }
    out.pop();
    out
}

/// A vector or matrix, as a list of texts, after the turn.
fn turned_tensor(list: &str) -> Option<String> {
    let parts: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    match parts[..] {
        [p, q] => Some(format!("[\"-({q})\", \"{p}\"]")),
        [p, q, r, s] => Some(format!("[[\"{s}\", \"-({r})\"], [\"-({q})\", \"{p}\"]]")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Problem;
    use std::path::Path;

    /// All that is drawn, what is simpler and what is an image of it can be read.
    #[test]
    fn forms_are_in_the_language() {
        let mut random = Random::new(5);
        for k in 0..60 {
            let shape = Shape::new(&mut random);
            let grammar = if shape.is_quadrangles {
                QUADRANGLES
            } else {
                TRIANGLES
            };
            let drawn = Drawn::new(&mut random, &grammar, shape);
            let images = [
                Symmetry::Renumbered,
                Symmetry::Turned,
                Symmetry::Doubled,
                Symmetry::Halved,
            ];
            let images = images.into_iter().filter_map(|of| drawn.image(of));
            let varied = drawn.varied(&mut random, Shape::small());
            let all = [drawn.clone(), varied]
                .into_iter()
                .chain(images)
                .chain(drawn.simpler());
            for one in all {
                let mut text = one.text("random");
                for (name, value) in one.invariants() {
                    let _ = writeln!(text, "[numbers.{name}]\nvalue = \"{value}\"");
                }
                let mesh = one.shape.mesh().unwrap();
                let read = Problem::parse(Path::new("random.toml"), &text, &mesh);
                read.unwrap_or_else(|e| panic!("{k}: {e}\n{text}"));
            }
        }
    }

    /// What is made simpler again and again comes to an end.
    #[test]
    fn the_simplest_is_reached() {
        let mut random = Random::new(7);
        for _ in 0..40 {
            let shape = Shape::new(&mut random);
            let grammar = if shape.is_quadrangles {
                QUADRANGLES
            } else {
                TRIANGLES
            };
            let mut drawn = Drawn::new(&mut random, &grammar, shape);
            let mut steps = 0;
            while let Some(next) = drawn.simpler().into_iter().next() {
                drawn = next;
                steps += 1;
                assert!(steps < 60, "{}", drawn.text("random"));
            }
            assert!(
                drawn.text("random").lines().count() < 16,
                "{}",
                drawn.text("random")
            );
        }
    }
}
