//! Definitions: named parts of formulas, inserted into the text of a formula before it is parsed.

use faceoff_fem::scene::expression::syntax::{Kind, Term};
use faceoff_fem::scene::expression::{Function, ParseError};

use super::{Fault, Result, WORDS, fault};

/// The largest length of a formula with its definitions inserted.
const MOST_CHARACTERS: usize = 20_000;

/// A part of formulas with a name, as in `sigma(w) = 2*mu*sym(grad(w))`.
#[derive(Debug, Clone)]
pub struct Definition {
    /// The name in formulas.
    pub name: String,
    /// The names of its arguments; empty for a plain name.
    arguments: Vec<String>,
    body: Formula,
}

/// A formula as the file has it, and with its definitions inserted.
#[derive(Debug, Clone)]
pub struct Formula {
    /// As the file has it.
    pub source: String,
    /// With all definitions inserted: the text that is parsed and written for codes.
    pub text: String,
    /// The syntax tree of `text`.
    pub term: Term,
    /// The position in `source` of each character of `text`, and whether it was inserted there.
    origins: Vec<(usize, bool)>,
}

/// A text under construction, with its origins.
type Characters = Vec<(char, (usize, bool))>;

fn not_grammar(e: ParseError) -> Fault {
    Fault {
        at: e.column.saturating_sub(1),
        what: e.what,
        remedy: "docs/reference/form.md has the grammar".into(),
    }
}

impl Definition {
    /// The name and the arguments before the equals sign.
    ///
    /// # Errors
    /// Text that is neither a name nor a name with names in parentheses.
    pub fn head(text: &str) -> Result<(String, Vec<String>)> {
        let term = Term::parse(text).map_err(not_grammar)?;
        let name = |term: &Term| match &term.kind {
            Kind::Name(name) => Some(name.clone()),
            _ => None,
        };
        let found = match &term.kind {
            Kind::Call(function, given) => {
                let arguments: Option<Vec<String>> = given.iter().map(name).collect();
                name(function).zip(arguments)
            }
            _ => name(&term).map(|name| (name, Vec::new())),
        };
        let (name, arguments) = found.ok_or_else(|| {
            let remedy = "write a name, as in mu, or one with arguments, as in \"sigma(w)\"";
            fault(&term, "this is not the head of a definition", remedy)
        })?;
        for (k, argument) in arguments.iter().enumerate() {
            let is_word =
                WORDS.contains(&argument.as_str()) || Function::of_name(argument).is_some();
            if is_word || arguments[..k].contains(argument) {
                let what = match is_word {
                    true => format!("the argument `{argument}` is a word of the language"),
                    false => format!("two arguments are called `{argument}`"),
                };
                return Err(fault(&term, what, "give it another name"));
            }
        }
        Ok((name, arguments))
    }

    /// A definition that may use those before it.
    ///
    /// # Errors
    /// Errors of [`Formula::new`]; a measure, since integrals belong in F.
    pub fn new(
        (name, arguments): (String, Vec<String>),
        body: String,
        before: &[Definition],
    ) -> Result<Self> {
        let is_hidden = |d: &&Definition| arguments.contains(&d.name);
        let before = before.iter().filter(|d| !is_hidden(d)).cloned();
        let body = Formula::new(body, &before.collect::<Vec<_>>())?;
        let chars: Vec<char> = body.text.chars().collect();
        let words = chars.split(|c| !c.is_alphanumeric() && *c != '_');
        let is_measure = |word: &[char]| matches!(word, ['d', 'x' | 's' | 'S']);
        match words.into_iter().any(is_measure) {
            false => Ok(Definition {
                name,
                arguments,
                body,
            }),
            true => Err(fault(
                &body.term,
                "a definition is a value, and this has a measure",
                "integrate in F: sigma_n(u)*v*ds",
            )),
        }
    }

    /// The definition as text.
    pub fn line(&self) -> String {
        let words: Vec<&str> = self.body.source.split_whitespace().collect();
        let arguments = match self.arguments.is_empty() {
            true => String::new(),
            false => format!("({})", self.arguments.join(", ")),
        };
        format!("{}{arguments} = {}", self.name, words.join(" "))
    }
}

impl Formula {
    /// Parses a text and inserts the definitions that it uses.
    ///
    /// # Errors
    /// Syntax errors; a number of arguments that differs from the definition; a formula that gets too long.
    pub fn new(source: String, definitions: &[Definition]) -> Result<Self> {
        let term = Term::parse(&source).map_err(not_grammar)?;
        let chars = source.chars().enumerate();
        let chars: Characters = chars.map(|(at, c)| (c, (at, false))).collect();
        let mut all = Characters::new();
        let writer = Writer {
            definitions,
            arguments: &[],
            chars: &chars,
        };
        writer.all(&term, &mut all)?;
        let (text, origins): (String, Vec<(usize, bool)>) = all.into_iter().unzip();
        let mut formula = Formula {
            source,
            text,
            term,
            origins,
        };
        if formula.text != formula.source {
            let term = Term::parse(&formula.text).map_err(not_grammar);
            formula.term = term.map_err(|fault| formula.in_source(fault))?;
        }
        Ok(formula)
    }

    /// Where a character of the text comes from in the source.
    pub fn place(&self, at: usize) -> usize {
        let end = || self.source.chars().count();
        self.origins.get(at).map_or_else(end, |(place, _)| *place)
    }

    /// An error in the text as one in the source, with the name of the definition that contains it.
    pub fn in_source(&self, fault: Fault) -> Fault {
        let place = self.place(fault.at);
        let is_put_in = self
            .origins
            .get(fault.at)
            .is_some_and(|(_, put_in)| *put_in);
        let is_part = |c: &char| c.is_alphanumeric() || *c == '_';
        let name = self.source.chars().skip(place).skip_while(|c| !is_part(c));
        let name: String = name.take_while(is_part).collect();
        Fault {
            at: place,
            what: match is_put_in && !name.is_empty() {
                true => format!("with the definition of `{name}`: {}", fault.what),
                false => fault.what,
            },
            ..fault
        }
    }
}

/// Writes a formula out.
struct Writer<'a> {
    definitions: &'a [Definition],
    /// The replacements of names, in a definition.
    arguments: &'a [(&'a str, Characters)],
    chars: &'a [(char, (usize, bool))],
}

/// Does a formula need parentheses if it replaces a name?
fn is_compound(term: &Term) -> bool {
    matches!(
        term.kind,
        Kind::Binary(..) | Kind::Negative(_) | Kind::Number(_)
    )
}

impl Writer<'_> {
    fn all(&self, term: &Term, out: &mut Characters) -> Result<()> {
        out.extend(&self.chars[..term.start]);
        self.term(term, out)?;
        out.extend(&self.chars[term.end..]);
        Ok(())
    }

    fn term(&self, term: &Term, out: &mut Characters) -> Result<()> {
        match &term.kind {
            Kind::Number(_) | Kind::Text(_) | Kind::Named(..) => self.parts(term, &[], out),
            Kind::Name(name) => match self.arguments.iter().find(|(of, _)| of == name) {
                Some((_, given)) => {
                    out.extend(given);
                    Ok(())
                }
                None => match self.definition(name) {
                    Some(definition) => self.put_in(term, definition, &[], out),
                    None => self.parts(term, &[], out),
                },
            },
            Kind::List(parts) => self.parts(term, &parts.iter().collect::<Vec<_>>(), out),
            Kind::Negative(a) => self.parts(term, &[a], out),
            Kind::Binary(_, sides) | Kind::Compare(_, sides) => {
                self.parts(term, &[&sides[0], &sides[1]], out)
            }
            Kind::Member(a, _) if matches!(&a.kind, Kind::Name(test) if test == "test") => {
                self.parts(term, &[], out)
            }
            Kind::Member(a, _) => self.parts(term, &[a], out),
            Kind::Index(a, at) => {
                let parts: Vec<&Term> = std::iter::once(&**a).chain(at).collect();
                self.parts(term, &parts, out)
            }
            Kind::Call(function, given) => match &function.kind {
                // Names of groups are not part of this language.
                Kind::Name(name) if ["dx", "ds", "dS"].contains(&name.as_str()) => {
                    self.parts(term, &[], out)
                }
                Kind::Name(name)
                    if !matches!(
                        &given[..],
                        [Term {
                            kind: Kind::Text(_),
                            ..
                        }]
                    ) =>
                {
                    match self.definition(name) {
                        Some(definition) => self.put_in(term, definition, given, out),
                        None => self.parts(term, &given.iter().collect::<Vec<_>>(), out),
                    }
                }
                _ => {
                    let parts: Vec<&Term> = std::iter::once(&**function).chain(given).collect();
                    self.parts(term, &parts, out)
                }
            },
        }
    }

    /// A term, unchanged except for these parts of it.
    fn parts(&self, term: &Term, parts: &[&Term], out: &mut Characters) -> Result<()> {
        let mut at = term.start;
        for part in parts {
            out.extend(&self.chars[at..part.start]);
            self.term(part, out)?;
            at = part.end;
        }
        out.extend(&self.chars[at..term.end]);
        match out.len() <= MOST_CHARACTERS {
            true => Ok(()),
            false => Err(fault(
                term,
                format!(
                    "with its definitions put in, this has more than {MOST_CHARACTERS} characters"
                ),
                "nest fewer definitions",
            )),
        }
    }

    fn definition(&self, name: &str) -> Option<&Definition> {
        self.definitions.iter().find(|d| d.name == name)
    }

    fn put_in(
        &self,
        term: &Term,
        definition: &Definition,
        given: &[Term],
        out: &mut Characters,
    ) -> Result<()> {
        let Definition {
            name,
            arguments,
            body,
        } = definition;
        if given.len() != arguments.len() {
            let what = match given.len() {
                0 => format!("`{name}` is a function"),
                n => format!(
                    "`{name}` does not take {n} argument{}",
                    if n == 1 { "" } else { "s" }
                ),
            };
            let remedy = match arguments.is_empty() {
                true => format!("write {name} without arguments"),
                false => format!("write {name}({})", arguments.join(", ")),
            };
            return Err(fault(term, what, remedy));
        }
        let place = (self.chars[term.start].1.0, true);
        let written = |text: &str| text.chars().map(|c| (c, place)).collect::<Characters>();
        let enclosed = |of: &Term, chars: Characters| match is_compound(of) {
            true => [written("("), chars, written(")")].concat(),
            false => chars,
        };
        let mut values = Vec::new();
        for (argument, given) in arguments.iter().zip(given) {
            let mut chars = Characters::new();
            self.term(given, &mut chars)?;
            values.push((argument.as_str(), enclosed(given, chars)));
        }
        let of_body = Writer {
            definitions: &[],
            arguments: &values,
            chars: &written(&body.text),
        };
        let mut chars = Characters::new();
        // Blanks and parentheses around the whole are removed.
        of_body.term(&body.term, &mut chars)?;
        let mut chars = enclosed(&body.term, chars);
        // A term that begins with an argument begins where the definition is used.
        if let Some(first) = chars.first_mut() {
            first.1 = place;
        }
        out.extend(chars);
        Ok(())
    }
}
