//! The text of a form, changed only where UFL has a different notation.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_fem::scene::expression::{Comparison, Function};

use super::spelling::{Style, Words};
use crate::language::{Names, Reader, find_group};
use crate::problem::Problem;
use crate::scalar::Field;

struct Editor<'a> {
    problem: &'a Problem,
    words: &'a Words,
    chars: Vec<char>,
    /// Start, end and replacement.
    edits: Vec<(usize, usize, String)>,
}

/// A text and its term in UFL; coordinates are `x[0]`, `x[1]`, `x[2]`.
pub fn ufl(problem: &Problem, words: &Words, text: &str, term: &Term) -> String {
    let mut editor = Editor {
        problem,
        words,
        chars: text.chars().collect(),
        edits: Vec::new(),
    };
    editor.term(term);
    editor.apply()
}

/// UFL's spellings of functions, powers and conditionals.
pub const UFL: Style = Style {
    call: |function, arguments| {
        let name = match function {
            Function::Log => "ln",
            Function::Max => "max_value",
            Function::Min => "min_value",
            other => other.names()[0],
        };
        format!("{name}({})", arguments.join(", "))
    },
    power: |base, n| n.after(base, "**"),
    choice: |sign, [a, b, c, d]| {
        let name = match sign {
            "<" => "lt",
            "<=" => "le",
            ">" => "gt",
            _ => "ge",
        };
        format!("conditional({name}({a}, {b}), {c}, {d})")
    },
};

impl Editor<'_> {
    fn replace(&mut self, start: usize, end: usize, with: impl Into<String>) {
        self.edits.push((start, end, with.into()));
    }

    fn apply(mut self) -> String {
        // Edits at one position keep their order: outer ones come first.
        self.edits.sort_by_key(|edit| (edit.0, edit.1));
        let mut text = String::new();
        let mut at = 0;
        for (start, end, with) in &self.edits {
            text.extend(&self.chars[at..*start]);
            text += with;
            at = *end;
        }
        text.extend(&self.chars[at..]);
        // Python only accepts these blanks.
        let plain = |c: char| {
            if c.is_whitespace() && c != '\n' {
                ' '
            } else {
                c
            }
        };
        text.chars().map(plain).collect()
    }

    fn term(&mut self, term: &Term) {
        match &term.kind {
            // Python refuses 007.
            Kind::Number(value) if self.chars[term.start] == '0' => {
                self.replace(term.start, term.end, value.to_string());
            }
            Kind::Number(_) | Kind::Text(_) | Kind::Named(..) => {}
            Kind::Name(name) => {
                if let Some(new) = self.name(name) {
                    self.replace(term.start, term.end, new);
                }
            }
            Kind::List(parts) => {
                self.replace(term.start, term.start, "as_tensor(");
                parts.iter().for_each(|part| self.term(part));
                self.replace(term.end, term.end, ")");
            }
            Kind::Negative(a) => self.term(a),
            Kind::Binary(_, sides) => {
                self.term(&sides[0]);
                let between = sides[0].end..sides[1].start;
                if let Some(at) = between.clone().find(|at| self.chars[*at] == '^') {
                    self.replace(at, at + 1, "**");
                }
                self.term(&sides[1]);
            }
            Kind::Compare(comparison, sides) => {
                let name = match comparison {
                    Comparison::Less => "lt(",
                    Comparison::LessEqual => "le(",
                    Comparison::Greater => "gt(",
                    Comparison::GreaterEqual => "ge(",
                };
                self.replace(term.start, term.start, name);
                self.term(&sides[0]);
                self.replace(sides[0].end, sides[1].start, ", ");
                self.term(&sides[1]);
                self.replace(term.end, term.end, ")");
            }
            // x[1] is UFL already.
            Kind::Index(a, at) => {
                if !matches!(&a.kind, Kind::Name(name) if name == "x") {
                    self.term(a);
                    // UFL needs all indices of a row.
                    let rest = self.rank(a).saturating_sub(at.len());
                    let end = at.last().map_or(term.end, |last| last.end);
                    self.replace(end, end, ", :".repeat(rest));
                }
            }
            Kind::Member(a, name) => match &a.kind {
                Kind::Name(test) if test == "test" => {
                    let k = self.problem.unknowns.iter().position(|u| u.name == *name);
                    let new = self.words.whole(Field::Test(k.unwrap_or(0))).to_owned();
                    self.replace(term.start, term.end, new);
                }
                _ => self.term(a),
            },
            Kind::Call(function, arguments) => self.call(term, function, arguments),
        }
    }

    /// The number of dimensions of a term.
    fn rank(&self, term: &Term) -> usize {
        let of = self.problem;
        let names = Names {
            dim: of.dim,
            cells: of.cells,
            unknowns: &of.unknowns,
            parameters: &of.parameters,
            data: &of.data,
            groups: &of.groups,
            unmarked: 0,
            is_timed: of.time.is_some(),
        };
        let mut scalars = of.scalars.clone();
        let tensor = Reader::new(names, &mut scalars).tensor(term);
        tensor.map_or(0, |tensor| tensor.shape.len())
    }

    fn name(&self, name: &str) -> Option<String> {
        let of = self.problem;
        let field = |field| Some(self.words.whole(field).to_owned());
        if let Some(k) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            return Some(format!("x[{k}]"));
        }
        if let Some(k) = of.parameters.iter().position(|p| p.name == name) {
            return Some(self.words.parameters[k].clone());
        }
        if let Some(k) = of.unknowns.iter().position(|u| u.name == name) {
            return field(Field::Unknown(k));
        }
        if let Some(k) = of.unknowns.iter().position(|u| u.test == name) {
            return field(Field::Test(k));
        }
        of.data
            .iter()
            .position(|d| d.name == name)
            .and_then(|k| field(Field::Datum(k)))
    }

    /// The rule of a measure with a degree, which the frame has defined; `None` if it is that of all measures.
    fn own_rule(&self, dim: usize, degree: usize) -> Option<String> {
        let rule = self.problem.cells.exact(dim, degree);
        let mut all = self.problem.all_rules().into_iter();
        let at = all.rposition(|known| known == rule).unwrap_or(0);
        (at > 1).then(|| format!("metadata=md{at}"))
    }

    fn call(&mut self, term: &Term, function: &Term, arguments: &[Term]) {
        let Kind::Name(name) = &function.kind else {
            // A side of a facet.
            return self.term(function);
        };
        let is_measure = ["dx", "ds", "dS"].contains(&name.as_str());
        if !is_measure && matches!(arguments, [one] if matches!(one.kind, Kind::Text(_))) {
            return self.term(function);
        }
        let new = match name.as_str() {
            "dx" | "ds" | "dS" => {
                let dim = self.problem.dim - usize::from(name != "dx");
                let mut own = None;
                let lists = arguments.iter().flat_map(|a| match &a.kind {
                    Kind::Named(_, value) => {
                        own = Some(&value.kind);
                        Vec::new()
                    }
                    Kind::List(parts) => parts.iter().collect(),
                    _ => vec![a],
                });
                let tags = lists.map(|part| {
                    let word = match &part.kind {
                        Kind::Name(word) | Kind::Text(word) => word.clone(),
                        Kind::Number(number) => number.to_string(),
                        _ => String::new(),
                    };
                    let found = find_group(&self.problem.groups, &word, dim).unwrap_or(0);
                    self.problem.groups[found].tag.to_string()
                });
                let tags: Vec<String> = tags.collect();
                let all = match &tags[..] {
                    [] => None,
                    [one] => Some(one.clone()),
                    several => Some(format!("({})", several.join(", "))),
                };
                let own = match own {
                    Some(Kind::Number(degree)) => self.own_rule(dim, *degree as usize),
                    _ => None,
                };
                let all: Vec<String> = all.into_iter().chain(own).collect();
                let new = match all.is_empty() {
                    true => name.clone(),
                    false => format!("{name}({})", all.join(", ")),
                };
                return self.replace(term.start, term.end, new);
            }
            "log" => "ln",
            "max" | "pos" => "max_value",
            "min" => "min_value",
            "if" => "conditional",
            "rot" => "curl",
            other => other,
        };
        if new != name {
            self.replace(function.start, function.end, new);
        }
        if name == "Identity" {
            return;
        }
        if name == "old"
            && let [
                Term {
                    kind: Kind::Name(of),
                    ..
                },
            ] = arguments
            && let Some(k) = self.problem.unknowns.iter().position(|u| u.name == *of)
        {
            let new = self.words.whole(Field::Old(k)).to_owned();
            return self.replace(term.start, term.end, new);
        }
        arguments.iter().for_each(|argument| self.term(argument));
        if name == "pos" {
            let end = arguments.last().map_or(term.end, |last| last.end);
            self.replace(end, end, ", 0.0");
        }
    }
}
