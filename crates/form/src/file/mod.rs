//! Form files: from TOML to a checked [`Problem`], with the position of every error.

mod conditions;
mod eigen;
mod mesh;
#[cfg(test)]
mod tests;
mod time;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use faceoff_fem::scene::expression::Function;
use faceoff_mesh::error::{Error, Place, Result, meant};
use faceoff_mesh::mesh::Mesh;
use toml::de::{DeTable, DeValue};

use crate::grid::Cells;
use crate::language::{Definition, Fault, Formula, Names, Reader, WORDS};
use crate::problem::{Datum, Element, Integral, Parameter, Problem, Space, Unknown};
use crate::scalar::Scalars;

use mesh::Marks;

type Value<'a> = toml::Spanned<DeValue<'a>>;

impl Problem {
    /// Reads the text of a form file for a mesh, whose groups the form names; `origin` is its path in messages.
    ///
    /// # Errors
    /// Text that is not TOML or not a form, with its line and column; a mesh with cells of several shapes, or of unsupported ones.
    pub fn parse(origin: &Path, text: &str, mesh: &Mesh) -> Result<Self> {
        let file = File {
            origin,
            text,
            definitions: Vec::new(),
        };
        file.problem(mesh)
    }
}

/// Is this the text of a form file rather than of a scene or a face-off file with codes?
pub fn is_form(text: &str) -> bool {
    DeTable::parse(text).is_ok_and(|table| {
        let keys = table.get_ref();
        keys.contains_key("form") || keys.contains_key("eigen")
    })
}

struct File<'a> {
    origin: &'a Path,
    text: &'a str,
    definitions: Vec<Definition>,
}

/// A key with its value, in the order of the file.
struct Entry<'a> {
    key: &'a str,
    place: Range<usize>,
    value: &'a Value<'a>,
}

impl<'a> File<'a> {
    /// An error at a byte of the file.
    fn refuse(&self, at: usize, what: impl Into<String>, remedy: impl Into<String>) -> Error {
        let before = &self.text[..at.min(self.text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        Error::file(self.origin, Place::Column(line, column), what, remedy)
    }

    fn entries(&self, value: &'a Value<'a>, of: &str) -> Result<Vec<Entry<'a>>> {
        let Some(table) = value.get_ref().as_table() else {
            let what = format!("{of} is not a table");
            return Err(self.refuse(value.span().start, what, format!("write [{of}]")));
        };
        Ok(ordered(table))
    }

    /// The text of a value; a number unchanged.
    fn text_of(&self, value: &'a Value<'a>) -> Result<String> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.to_string()),
            DeValue::Integer(_) | DeValue::Float(_) => Ok(self.text[value.span()].to_owned()),
            other => {
                let what = format!("this is {} {}", article(other.type_str()), other.type_str());
                Err(self.refuse(value.span().start, what, "give a text or a number"))
            }
        }
    }

    /// A finite number.
    fn number(&self, value: &Value<'_>) -> Option<f64> {
        match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => self.text[value.span()]
                .replace('_', "")
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite()),
            _ => None,
        }
    }

    fn integer(&self, value: &'a Value<'a>, most: usize) -> Result<usize> {
        let number = value
            .get_ref()
            .as_integer()
            .and_then(|n| n.as_str().parse().ok());
        number.filter(|n| (1..=most).contains(n)).ok_or_else(|| {
            let what = "this is not a degree of the rules that all codes have";
            self.refuse(
                value.span().start,
                what,
                format!("give an integer from 1 to {most}"),
            )
        })
    }

    /// The position in the file of a character of a text.
    fn inside(&self, value: &Value<'_>, text: &str, at: usize) -> usize {
        let span = value.span();
        let start = self.text[span.clone()].find(text);
        let before: usize = text.chars().take(at).map(char::len_utf8).sum();
        start.map_or(span.start, |start| span.start + start + before)
    }

    fn fault(&self, value: &Value<'_>, text: &str, fault: Fault) -> Error {
        self.refuse(self.inside(value, text, fault.at), fault.what, fault.remedy)
    }

    /// An error in a formula, with its position in the file.
    fn fault_in(&self, value: &Value<'_>, formula: &Formula, fault: Fault) -> Error {
        self.fault(value, &formula.source, formula.in_source(fault))
    }

    fn formula(&self, value: &'a Value<'a>) -> Result<Formula> {
        let text = self.text_of(value)?;
        Formula::new(text.clone(), &self.definitions).map_err(|e| self.fault(value, &text, e))
    }

    fn define(&mut self, entry: &Entry<'a>) -> Result<()> {
        let mut taken = BTreeSet::new();
        for each in self.entries(entry.value, "definitions")? {
            let at = each.place.start;
            let head = Definition::head(each.key).map_err(|e| self.refuse(at, e.what, e.remedy))?;
            self.checked(&head.0, at, &mut taken)?;
            let text = self.text_of(each.value)?;
            let definition = Definition::new(head, text.clone(), &self.definitions);
            let definition = definition.map_err(|e| self.fault(each.value, &text, e))?;
            self.definitions.push(definition);
        }
        Ok(())
    }

    fn name(&self, entry: &Entry<'_>, taken: &mut BTreeSet<String>) -> Result<String> {
        self.checked(entry.key, entry.place.start, taken)
    }

    /// A new name, at a byte of the file.
    fn checked(&self, name: &str, at: usize, taken: &mut BTreeSet<String>) -> Result<String> {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !name.starts_with(|c: char| c.is_ascii_alphabetic())
            || !name.chars().all(is_word)
            || name.ends_with('_')
        {
            let what = format!("`{name}` is not a name that all codes can have");
            let remedy = "use letters, digits and `_`, a letter first and no `_` last";
            return Err(self.refuse(at, what, remedy));
        }
        if WORDS.contains(&name) || Function::of_name(name).is_some() {
            let what = format!("`{name}` is a word of the language");
            return Err(self.refuse(at, what, "give it another name"));
        }
        if !taken.insert(name.to_owned()) {
            let what = format!("there are two things called `{name}`");
            return Err(self.refuse(at, what, "give one of them another name"));
        }
        Ok(name.to_owned())
    }

    fn problem(&self, mesh: &Mesh) -> Result<Problem> {
        let document = DeTable::parse(self.text).map_err(|e| {
            let at = e.span().map_or(0, |span| span.start);
            self.refuse(at, e.message().replace('\n', " "), "write TOML")
        })?;
        // Text borrowed from the document must live as long as the document.
        let mut file = File {
            origin: self.origin,
            text: self.text,
            definitions: Vec::new(),
        };
        let tables = ordered(document.get_ref());
        if let Some(entry) = tables.iter().find(|entry| entry.key == "definitions") {
            file.define(entry)?;
        }
        file.read(tables, mesh)
    }

    fn read(&self, tables: Vec<Entry<'a>>, mesh: &Mesh) -> Result<Problem> {
        const KEYS: [&str; 19] = [
            "name",
            "about",
            "mesh",
            "spaces",
            "parameters",
            "definitions",
            "data",
            "form",
            "eigen",
            "dirichlet",
            "mean",
            "time",
            "initial",
            "codes",
            "fields",
            "numbers",
            "spectra",
            "sweep",
            "symmetries",
        ];
        let names = KEYS.join(", ");
        self.known(&tables, &KEYS)?;
        let find = |key: &str| tables.iter().find(|entry| entry.key == key);
        let need = |key: &str| {
            find(key).ok_or_else(|| {
                self.refuse(
                    0,
                    format!("there is no {key}"),
                    format!("a form file has {names}"),
                )
            })
        };
        let Marks {
            dim,
            cells,
            groups,
            unmarked,
        } = Marks::new(&self.origin.display().to_string(), mesh)?;
        let name = self.title(need("name")?.value)?;
        let definitions = self.definitions.iter().map(|d| d.name.clone());
        let mut taken: BTreeSet<String> = definitions.collect();
        let unknowns = self.unknowns(need("spaces")?, (cells, dim), &mut taken)?;
        let mut parameters = match find("parameters") {
            Some(entry) => self.parameters(entry, &mut taken)?,
            None => Vec::new(),
        };
        let time = find("time")
            .map(|entry| self.time(entry, &mut parameters, &mut taken))
            .transpose()?;
        let mut scalars = Scalars::default();
        let data = match find("data") {
            Some(entry) => self.data(entry, (cells, dim), &parameters, &mut taken, &mut scalars)?,
            None => Vec::new(),
        };
        let (table, key) = match (find("form"), find("eigen")) {
            (Some(_), Some(both)) => {
                let what = "there are [form] and [eigen]";
                let remedy = "keep one: F(u; v) = 0 is solved, or a(u, v) = λ m(u, v)";
                return Err(self.refuse(both.place.start, what, remedy));
            }
            (None, Some(eigen)) => (eigen, "a"),
            _ => (need("form")?, "F"),
        };
        let form = self.entries(table.value, table.key)?;
        let given = match key {
            "a" => {
                let keys = ["a", "m", "count", "shift", "degree", "facet_degree"];
                self.known(&form, &keys)?;
                Some(self.eigen(table, &form, &tables)?)
            }
            _ => {
                self.known(&form, &["F", "degree", "facet_degree"])?;
                None
            }
        };
        let of_form = |key: &str| form.iter().find(|entry| entry.key == key);
        let degree = |key: &str, most: usize| {
            of_form(key).map_or(Ok(5), |entry| self.integer(entry.value, most))
        };
        let [degree, facet_degree] = [
            degree("degree", cells.most_degree(dim))?,
            degree("facet_degree", cells.most_degree(dim - 1))?,
        ];
        let Some(entry) = of_form(key) else {
            let remedy = match key {
                "a" => "add a = \"…\", as in a = \"inner(grad(u), grad(v))*dx\"",
                _ => "add F = \"…\": F(u; v) = 0 is solved",
            };
            let what = format!("[{}] has no {key}", table.key);
            return Err(self.refuse(table.place.start, what, remedy));
        };
        let form = self.formula(entry.value)?;
        let mut integrals = Vec::new();
        let mass = given
            .iter()
            .map(|given| (given.mass, &given.eigen.mass, true));
        for (value, formula, is_mass) in [(entry.value, &form, false)].into_iter().chain(mass) {
            let names = Names {
                dim,
                cells,
                unknowns: &unknowns,
                parameters: &parameters,
                data: &data,
                groups: &groups,
                unmarked,
                is_timed: time.is_some(),
            };
            let found = Reader::new(names, &mut scalars)
                .form(&formula.term)
                .map_err(|fault| self.fault_in(value, formula, fault))?;
            integrals.extend(found.into_iter().map(|integral| Integral {
                at: formula.place(integral.at),
                is_mass,
                ..integral
            }));
        }
        let mut problem = Problem {
            name,
            about: find("about")
                .map(|entry| self.text_of(entry.value))
                .transpose()?
                .unwrap_or_default(),
            dim,
            cells,
            unknowns,
            parameters,
            data,
            groups,
            integrals,
            conditions: Vec::new(),
            means: Vec::new(),
            time,
            eigen: given.as_ref().map(|given| given.eigen.clone()),
            degree,
            facet_degree,
            definitions: self.definitions.clone(),
            form,
            parts: None,
            scalars,
        };
        if let Some(entry) = find("dirichlet") {
            self.conditions(entry, &mut problem)?;
        }
        if let Some(entry) = find("initial") {
            self.initial(entry, &mut problem)?;
        }
        if let Some(entry) = find("mean") {
            self.means(entry, &mut problem, unmarked)?;
        }
        if let Some(given) = &given {
            self.check_eigen(&tables, &mut problem, entry.value, given)?;
        }
        self.check(&mut problem, entry.value, unmarked)?;
        Ok(problem)
    }

    /// The name of the problem, which is part of the names of its files.
    fn title(&self, value: &'a Value<'a>) -> Result<String> {
        let name = self.text_of(value)?;
        let is_part = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        match name.len() <= 64
            && name.chars().all(is_part)
            && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        {
            true => Ok(name),
            false => Err(self.refuse(
                value.span().start,
                "this cannot be the name of a file",
                "use at most 64 letters, digits, `-`, `_` and `.`, a letter or digit first",
            )),
        }
    }

    fn known(&self, entries: &[Entry<'_>], keys: &[&str]) -> Result<()> {
        match entries.iter().find(|entry| !keys.contains(&entry.key)) {
            None => Ok(()),
            Some(entry) => {
                let remedy = format!(
                    "{}known are {}",
                    meant(entry.key, keys.iter().copied()),
                    keys.join(", ")
                );
                Err(self.refuse(
                    entry.place.start,
                    format!("there is no key `{}`", entry.key),
                    remedy,
                ))
            }
        }
    }

    fn unknowns(
        &self,
        entry: &Entry<'a>,
        (cells, dim): (Cells, usize),
        taken: &mut BTreeSet<String>,
    ) -> Result<Vec<Unknown>> {
        let entries = self.entries(entry.value, "spaces")?;
        if entries.is_empty() {
            return Err(self.refuse(
                entry.place.start,
                "there is no unknown",
                "add one, as in u = \"P1\"",
            ));
        }
        let mut all: Vec<Unknown> = Vec::new();
        for each in &entries {
            let name = self.name(each, taken)?;
            let text = self.text_of(each.value)?;
            let space = space(&text, dim).ok_or_else(|| {
                let remedy = "known are P0 to P3, DG0 to DG2 and CR, vectors of them as in \"P2^2\", RT0 and N1curl";
                self.refuse(
                    each.value.span().start,
                    format!("there is no space `{text}`"),
                    remedy,
                )
            })?;
            if !has(cells, space.element) {
                let what = format!(
                    "the mesh is of {}, and {} is a space on {}",
                    cells.names(dim),
                    space.element.name(),
                    Cells::Simplices.names(dim)
                );
                let remedy = "take P0, P1, P2, DG1, DG2, or vectors of them";
                return Err(self.refuse(each.value.span().start, what, remedy));
            }
            all.push(Unknown {
                test: format!("test.{name}"),
                name,
                space,
            });
        }
        let is_alone = all.len() == 1;
        for unknown in &mut all {
            let usual = match unknown.name.as_str() {
                "p" if !is_alone => "q",
                "u" => "v",
                "sigma" => "tau",
                _ if is_alone => "v",
                _ => continue,
            };
            if taken.insert(usual.to_owned()) {
                usual.clone_into(&mut unknown.test);
            }
        }
        Ok(all)
    }

    fn parameters(
        &self,
        entry: &Entry<'a>,
        taken: &mut BTreeSet<String>,
    ) -> Result<Vec<Parameter>> {
        let entries = self.entries(entry.value, "parameters")?;
        let each = entries.iter().map(|each| {
            let name = self.name(each, taken)?;
            // For a list, whose values are levels of a face-off file, the first.
            let list = each.value.get_ref().as_array();
            let first = list.map_or(Some(each.value), |list| list.iter().next());
            let value = first.and_then(|value| self.number(value)).ok_or_else(|| {
                self.refuse(
                    each.value.span().start,
                    format!("the parameter {name} is not a finite number"),
                    "give one number, or a list of numbers that are levels",
                )
            })?;
            Ok(Parameter { name, value })
        });
        each.collect()
    }

    fn data(
        &self,
        entry: &Entry<'a>,
        (cells, dim): (Cells, usize),
        parameters: &[Parameter],
        taken: &mut BTreeSet<String>,
        scalars: &mut Scalars,
    ) -> Result<Vec<Datum>> {
        let entries = self.entries(entry.value, "data")?;
        let mut all = Vec::new();
        for each in &entries {
            let name = self.name(each, taken)?;
            let mut value = each.value;
            let mut interpolated = None;
            if value.get_ref().is_table() {
                let keys = self.entries(value, "data")?;
                self.known(&keys, &["expr", "space"])?;
                let [expr, given] = ["expr", "space"]
                    .map(|key| keys.iter().find(|e| e.key == key).map(|e| e.value));
                let (Some(expr), Some(given)) = (expr, given) else {
                    let what = format!("the datum {name} has no expr or no space");
                    return Err(self.refuse(
                        value.span().start,
                        what,
                        "give both: {expr = \"…\", space = \"P2\"}",
                    ));
                };
                let text = self.text_of(given)?;
                let is_one = |s: &Space| {
                    s.size.is_none() && s.element.is_continuous() && has(cells, s.element)
                };
                interpolated = Some(space(&text, dim).filter(is_one).ok_or_else(|| {
                    let remedy = match cells {
                        Cells::Simplices => "data are interpolated in P1, P2 or P3, each component for itself",
                        Cells::Cubes => "on these cells data are interpolated in P1 or P2, each component for itself",
                    };
                    self.refuse(
                        given.span().start,
                        format!("`{text}` is not a space for data"),
                        remedy,
                    )
                })?);
                value = expr;
            }
            let mut shape = Vec::new();
            let mut parts = Vec::new();
            self.parts(value, 0, &mut shape, &mut parts)?;
            let (mut components, mut texts) = (Vec::new(), Vec::new());
            for part in parts {
                let formula = self.formula(part)?;
                let names = Names {
                    dim,
                    cells,
                    unknowns: &[],
                    parameters,
                    data: &[],
                    groups: &[],
                    unmarked: 0,
                    is_timed: false,
                };
                let id = Reader::new(names, scalars).formula(&formula.term);
                let id = id.map_err(|fault| self.fault_in(part, &formula, fault))?;
                components.push(id);
                texts.push(formula.text);
            }
            all.push(Datum {
                name,
                shape,
                components,
                texts,
                space: interpolated,
            });
        }
        Ok(all)
    }

    /// The parts of a scalar, a list or a list of lists, with its shape.
    fn parts(
        &self,
        value: &'a Value<'a>,
        depth: usize,
        shape: &mut Vec<usize>,
        parts: &mut Vec<&'a Value<'a>>,
    ) -> Result<()> {
        let Some(list) = value.get_ref().as_array() else {
            if depth != shape.len() {
                return Err(self.refuse(
                    value.span().start,
                    "the rows of this list have different shapes",
                    "give all one length",
                ));
            }
            parts.push(value);
            return Ok(());
        };
        let is_new = shape.len() == depth;
        if is_new && parts.is_empty() {
            shape.push(list.len());
        }
        if shape.get(depth) != Some(&list.len()) || !(1..=3).contains(&list.len()) || depth > 1 {
            let remedy = "give vectors of 1 to 3 components, or matrices of such rows";
            return Err(self.refuse(
                value.span().start,
                "this list is not a vector or matrix",
                remedy,
            ));
        }
        list.iter()
            .try_for_each(|part| self.parts(part, depth + 1, shape, parts))
    }
}

fn article(word: &str) -> &'static str {
    if word.starts_with(['a', 'i']) {
        "an"
    } else {
        "a"
    }
}

fn ordered<'a>(table: &'a DeTable<'a>) -> Vec<Entry<'a>> {
    let entries = table.iter().map(|(key, value)| Entry {
        key: key.get_ref(),
        place: key.span(),
        value,
    });
    let mut entries: Vec<Entry<'a>> = entries.collect();
    entries.sort_by_key(|entry| entry.place.start);
    entries
}

/// Is this an element on cells of a shape?
fn has(cells: Cells, element: Element) -> bool {
    cells == Cells::Simplices || matches!(element, Element::Continuous(1 | 2) | Element::Broken(_))
}

/// `P2`, `P2^2`, `CR^d` or `RT0`.
fn space(text: &str, dim: usize) -> Option<Space> {
    let vector = match text {
        "RT0" => Some(Element::RaviartThomas),
        "N1curl" => Some(Element::Nedelec),
        _ => None,
    };
    if let Some(element) = vector {
        return Some(Space {
            element,
            size: Some(dim),
        });
    }
    let (element, size) = match text.split_once('^') {
        None => (text, None),
        Some((element, "d")) => (element, Some(dim)),
        Some((element, size)) => (
            element,
            Some(size.parse().ok().filter(|n| (1..=9).contains(n))?),
        ),
    };
    let element = match element {
        "P1" => Element::Continuous(1),
        "P2" => Element::Continuous(2),
        "P3" => Element::Continuous(3),
        "P0" | "DG0" => Element::Broken(0),
        "DG1" => Element::Broken(1),
        "DG2" => Element::Broken(2),
        "CR" => Element::CrouzeixRaviart,
        _ => return None,
    };
    Some(Space { element, size })
}
