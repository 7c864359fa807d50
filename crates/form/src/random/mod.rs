//! Random well-posed forms on random meshes: what each consists of, so that it can be made smaller, and the same in other words.

mod mesh;
mod rewritten;
mod terms;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

pub use mesh::Shape;
pub(crate) use mesh::shuffle;
pub use rewritten::{PATCH, Rewritten};
use terms::{BROKEN, PRESSURE, SCALAR, VECTOR, WHOLE};

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

    /// Of a rule of a measure.
    fn degree(&mut self) -> usize {
        [1, 1, 2, 4][self.below(4)]
    }
}

/// From what forms are drawn.
#[derive(Debug, Clone, Copy)]
pub struct Grammar {
    /// Elements, some more often than others.
    pub elements: &'static [&'static str],
    /// Elements of a velocity, or a flux, and of a pressure, which have one solution together on any mesh.
    pub pairs: &'static [[&'static str; 2]],
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
    pairs: &[["P2", "P1"], ["P2", "P0"], ["CR", "P0"], ["RT0", "P0"]],
    few: &["P3"],
    has_degrees: true,
};

/// On tetrahedra.
pub const TETRAHEDRA: Grammar = Grammar {
    elements: &["P1", "P1", "P2", "P2", "CR", "DG1", "P0", "RT0", "N1curl"],
    pairs: &[["CR", "P0"], ["RT0", "P0"]],
    few: &[],
    has_degrees: true,
};

/// On quadrangles.
pub const QUADRANGLES: Grammar = Grammar {
    elements: &["P1", "P2", "P2", "DG1", "DG2", "P0"],
    pairs: &[["P2", "P1"], ["P2", "P0"]],
    few: &["P2", "DG2"],
    has_degrees: true,
};

impl Grammar {
    /// That of a mesh.
    pub fn on(shape: Shape) -> Grammar {
        match (shape.is_quadrangles, shape.is_solid) {
            (true, _) => QUADRANGLES,
            (_, true) => TETRAHEDRA,
            _ => TRIANGLES,
        }
    }
}

/// A function of the point, in `dim` coordinates.
fn datum(random: &mut Random, depth: usize, dim: usize) -> String {
    if depth == 0 {
        let all = ["x", "y", "0.5", "x*y", "2", "pi", "z", "x*z"];
        return random.of(&all[..2 + 2 * dim]).to_owned();
    }
    let [a, b] = [0; 2].map(|_| datum(random, depth - 1, dim));
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

    /// The same less what a polynomial makes of it, which is the solution then; nothing of what is free of the solution.
    fn patched(&self) -> Vec<String> {
        let has = |name: &str| words(&self.text).any(|word| word == name);
        // The polynomial has no jumps.
        let jumps = ["jump(u", "jump(grad(u)"].iter();
        match (has("u"), jumps.clone().any(|jump| self.text.contains(jump))) {
            (false, _) => Vec::new(),
            (true, true) => vec![self.full()],
            (true, false) => {
                let text = renamed(&self.text, &|word| (word == "u").then_some(EXACT));
                let text = match text.strip_prefix('-') {
                    Some(positive) => positive.to_owned(),
                    None => format!("-{text}"),
                };
                let other = Term {
                    text,
                    ..self.clone()
                };
                vec![self.full(), other.full()]
            }
        }
    }

    fn has_pressure(&self) -> bool {
        words(&self.text).any(|word| word == "p" || word == "q")
    }

    fn has_groups(&self) -> bool {
        let measure = self.text.rsplit('*').next().unwrap_or_default();
        measure.starts_with('d') && measure.ends_with(')')
    }
}

/// The datum of a form whose solution is known.
const EXACT: &str = "e";

/// A term of the plane in space.
fn in_space(text: &str) -> String {
    let changes = [
        ("Identity(2)", "Identity(3)"),
        ("curl(u)*curl(v)", "dot(curl(u), curl(v))"),
        (
            "avg(curl(u))*avg(curl(v))",
            "dot(avg(curl(u)), avg(curl(v)))",
        ),
    ];
    let change = |text: String, (from, to): (&str, &str)| text.replace(from, to);
    changes.into_iter().fold(text.to_owned(), change)
}

/// Functions of the point by name, with quotes and brackets.
fn data(random: &mut Random, dim: usize) -> BTreeMap<&'static str, String> {
    let mut data = BTreeMap::new();
    for (name, depth) in [("a", 2), ("g", 2), ("f", 3)] {
        data.insert(name, format!("\"{}\"", datum(random, depth, dim)));
    }
    let [p, q] = [0; 2].map(|_| datum(random, 1, dim));
    let [b, k] = match dim {
        2 => [
            format!("[\"{p}\", \"{q}\"]"),
            format!("[[\"1\", \"{p}\"], [\"{q}\", \"2\"]]"),
        ],
        _ => [
            format!("[\"{p}\", \"{q}\", \"y\"]"),
            format!("[[\"1\", \"{p}\", \"0\"], [\"{q}\", \"2\", \"z\"], [\"0\", \"x\", \"1.5\"]]"),
        ],
    };
    data.insert("b", b);
    data.insert("K", k);
    // As the space has it.
    data.insert(EXACT, String::new());
    data
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
    /// The element of a second unknown, the pressure.
    pressure: Option<&'static str>,
    /// The load is such that the solution is a polynomial of the space.
    pub is_patch: bool,
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

impl Drawn {
    /// A form with some terms at random.
    pub fn new(random: &mut Random, grammar: &Grammar, shape: Shape) -> Self {
        let dim = shape.dim();
        let [element, pressure] = match random.is(20) {
            true => grammar.pairs[random.below(grammar.pairs.len())],
            false => [random.of(grammar.elements), ""],
        };
        let pressure = (!pressure.is_empty()).then_some(pressure);
        let is_whole = element == "RT0" || element == "N1curl";
        let is_vector = !is_whole && (pressure.is_some() || random.is(40));
        let is_broken = element.starts_with("DG") || element == "P0";
        let (main, all, load): (&[&str], _, _) = match is_vector {
            _ if is_whole && pressure.is_some() => (
                &["(1 + a^2)*dot(u, v)*dx", "-p*div(v)*dx", "-q*div(u)*dx"],
                WHOLE,
                "-(0.3 + f)*dot(b, v)*dx",
            ),
            _ if is_whole => (
                &["(1 + a^2)*div(u)*div(v)*dx", "dot(u, v)*dx"],
                WHOLE,
                "-(0.3 + f)*dot(b, v)*dx",
            ),
            true if pressure.is_some() => (
                &[
                    "(1 + a^2)*inner(grad(u), grad(v))*dx",
                    "dot(u, v)*dx",
                    "-p*div(v)*dx",
                    "-q*div(u)*dx",
                ],
                VECTOR,
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
            let from = match pressure.is_some() && random.is(50) {
                true => PRESSURE,
                false => all,
            };
            let mut term = Term::new(random.of(from), false);
            if grammar.has_degrees && random.is(50) {
                term.degree = Some(random.degree());
            }
            // In any place, as the order of rules may matter.
            let at = match term.degree {
                Some(_) => random.below(terms.len() + 1),
                None => terms.len(),
            };
            terms.insert(at, term);
        }
        let mut load = Term::new(load, true);
        if grammar.has_degrees && random.is(25) {
            load.degree = Some(random.degree());
        }
        terms.push(load);
        for term in &mut terms {
            if element == "N1curl" {
                term.text = term.text.replace("div(", "curl(");
            }
            if dim == 3 {
                term.text = in_space(&term.text);
            }
        }
        let space = random.is(30).then(|| ["P1", "P2"][random.below(2)]);
        // Fewer points do not determine these functions.
        let few = grammar.few.contains(&element);
        let least = if few { 4 } else { 2 };
        let degree = least + random.below(6 - least);
        // On triangles all codes have rules up to degree 5.
        let facet_degree = 3 + 2 * random.below(if dim == 3 { 2 } else { 3 });
        let mut drawn = Drawn {
            element: element.to_owned(),
            is_vector,
            terms,
            data: data(random, dim),
            pressure,
            is_patch: pressure.is_none() && random.is(15),
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

    /// A polynomial of the space, by components.
    fn polynomial(&self) -> Vec<&'static str> {
        let dim = self.shape.dim();
        let all: &[&str] = match &*self.element {
            "P0" => &["0.4", "-0.3", "0.2"],
            "P1" | "DG1" | "CR" => &[
                "0.4 + 0.3*x - 0.2*y",
                "0.1 - 0.2*x + 0.3*y",
                "0.2*x + 0.1*y",
            ],
            "P2" | "DG2" => &[
                "0.4 + 0.3*x*y - 0.2*y^2",
                "0.1 - 0.2*x^2 + 0.3*y",
                "0.2*x*y + 0.1*x",
            ],
            "P3" => &["0.4 + 0.3*x^2*y - 0.2*y^3", "0.1 - 0.2*x^3 + 0.3*y"],
            // a + b x, and a + b × x.
            "RT0" => &["0.4 + 0.3*x", "-0.2 + 0.3*y", "0.1 + 0.3*z"],
            _ => &["0.4 - 0.3*y", "-0.2 + 0.3*x", "0.1"],
        };
        let count = if self.is_vector || self.is_whole() {
            dim
        } else {
            1
        };
        all[..count].to_vec()
    }

    /// The same as a datum.
    fn exact(&self) -> String {
        let quoted: Vec<String> = self
            .polynomial()
            .iter()
            .map(|p| format!("\"{p}\""))
            .collect();
        match self.is_vector || self.is_whole() {
            true => format!("[{}]", quoted.join(", ")),
            false => quoted.concat(),
        }
    }

    /// Draws values on the boundary.
    fn hold(&mut self, random: &mut Random) {
        self.held.clear();
        let is_broken = self.element.starts_with("DG") || self.element == "P0";
        if is_broken || !random.is(60) {
            return;
        }
        let dim = self.shape.dim();
        for group in ["left", "top", "bottom"] {
            if random.is(50) {
                let all: Vec<String> = (0..dim).map(|_| datum(random, 1, dim)).collect();
                let is_whole = self.is_whole();
                let each = |value: &dyn Fn(&String) -> String| {
                    let all: Vec<String> = all.iter().map(value).collect();
                    format!("[{}]", all.join(", "))
                };
                let value = match (self.is_vector || is_whole, random.is(50) && !is_whole) {
                    _ if self.is_patch => self.exact(),
                    (false, _) => format!("\"{}\"", all[0]),
                    (true, true) => each(&|p| match *p == all[0] {
                        true => format!("\"{p}\""),
                        false => "\"free\"".into(),
                    }),
                    (true, false) => each(&|p| format!("\"0.1*({p})\"")),
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
            let dim = other.shape.dim();
            other
                .data
                .insert("f", format!("\"{}\"", datum(random, 3, dim)));
        }
        other
    }

    /// The file of the form, without its mesh.
    pub fn text(&self, name: &str) -> String {
        let power = match self.is_vector {
            true => format!("^{}", self.shape.dim()),
            false => String::new(),
        };
        let mut s = format!(
            "name = \"{name}\"\n[spaces]\nu = \"{}{power}\"\n",
            self.element
        );
        if let Some(element) = self.pressure {
            let _ = writeln!(s, "p = \"{element}\"");
        }
        let terms: Vec<String> = match self.is_patch {
            true => self.terms.iter().flat_map(Term::patched).collect(),
            false => self.terms.iter().map(Term::full).collect(),
        };
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
            let value = if *name == EXACT { &self.exact() } else { value };
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
            let value = if self.is_patch { &self.exact() } else { value };
            let _ = match self.pressure {
                Some(_) => writeln!(s, "u.{group} = {value}"),
                None => writeln!(s, "{group} = {value}"),
            };
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
        push(&|d| d.is_patch = false);
        push(&|d| {
            if d.pressure.take().is_some() {
                d.terms.retain(|term| !term.has_pressure());
            }
        });
        push(&|d| d.shape = d.shape.smallest());
        push(&|d| d.shape = d.shape.even());
        for k in 0..self.terms.len() - 1 {
            if !self.terms[k].is_main {
                push(&|d| {
                    d.terms.remove(k);
                });
            }
        }
        let [ones, identity] = match self.shape.dim() {
            2 => ["[\"1\", \"1\"]", "[[\"1\", \"0\"], [\"0\", \"1\"]]"],
            _ => [
                "[\"1\", \"1\", \"1\"]",
                "[[\"1\", \"0\", \"0\"], [\"0\", \"1\", \"0\"], [\"0\", \"0\", \"1\"]]",
            ],
        };
        for (name, simple) in [
            ("a", "\"0\""),
            ("f", "\"1\""),
            ("f", "\"x\""),
            ("g", "\"1\""),
            ("b", ones),
            ("K", identity),
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
                // A pressure is right for only one velocity.
                _ if d.pressure.is_some() => return,
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
}

/// The words of a formula.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

/// A formula with something else for some words.
fn renamed<'a>(text: &'a str, other: &dyn Fn(&'a str) -> Option<&'a str>) -> String {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut out = String::new();
    let mut rest = text;
    while !rest.is_empty() {
        let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        out += other(word).unwrap_or(word);
        let sign = after.find(is_part).unwrap_or(after.len());
        out += &after[..sign];
        rest = &after[sign..];
    }
    out
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
        for k in 0..120 {
            let shape = Shape::new(&mut random);
            let drawn = Drawn::new(&mut random, &Grammar::on(shape), shape);
            let images = Rewritten::ALL.map(|how| drawn.rewritten(how));
            let varied = drawn.varied(&mut random, shape.smallest());
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
            let mut drawn = Drawn::new(&mut random, &Grammar::on(shape), shape);
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
