//! What a scene file holds, each entry with the text that it has there.

use std::ops::Range;
use std::path::Path;

use faceoff_mesh::error::{Error, Place, Result, meant};
use toml::de::{DeTable, DeValue};

use super::Lines;

type Value<'a> = toml::Spanned<DeValue<'a>>;

/// A file, and what messages call it.
pub struct Read<'a> {
    pub origin: &'a Path,
    pub text: &'a str,
}

/// `key = value`.
pub struct Entry<'a> {
    pub key: String,
    /// From the key to the end of the value.
    pub text: &'a str,
    /// The text of the value.
    pub value: &'a str,
    /// That of the key.
    pub line: usize,
    /// How many it has, where it is a list.
    pub count: Option<usize>,
    /// Its texts, where it is one or a list of them; numbers as they are written.
    pub texts: Option<Vec<String>>,
    /// What it holds, where it is a table.
    pub parts: Vec<Entry<'a>>,
}

/// A table with its entries in the order of the file.
pub struct Table<'a> {
    /// Without what it is part of.
    pub name: String,
    /// As `[path]`.
    pub path: String,
    pub line: usize,
    pub entries: Vec<Entry<'a>>,
}

/// A scene of elasticity.
pub struct Scene<'a> {
    pub name: (String, usize),
    pub dim: usize,
    pub is_stress: bool,
    pub top: Table<'a>,
    pub mesh: Table<'a>,
    pub elastic: Table<'a>,
    pub boundary: Table<'a>,
    pub parameters: Option<Table<'a>>,
    pub definitions: Option<Table<'a>>,
    pub data: Table<'a>,
    pub method: Option<Table<'a>>,
    pub exact: Option<Table<'a>>,
    pub numbers: Vec<Table<'a>>,
    pub contact: Vec<String>,
    pub neumann: Vec<String>,
    pub dirichlet: Vec<String>,
}

/// The tables of a scene, with the keys of those that have no others.
const TABLES: [(&str, &[&str]); 9] = [
    ("mesh", &[]),
    ("elastic", &["E", "nu", "plane"]),
    ("boundary", &["dirichlet", "neumann", "contact"]),
    ("parameters", &[]),
    ("definitions", &[]),
    ("data", &[]),
    ("method", &["gamma0", "beta", "degree", "facet_degree"]),
    ("exact", &["u", "orders"]),
    ("numbers", &[]),
];

impl<'a> Entry<'a> {
    /// The part of this name.
    pub fn part(&self, name: &str) -> Option<&Entry<'a>> {
        self.parts.iter().find(|part| part.key == name)
    }
}

impl Table<'_> {
    pub fn get(&self, key: &str) -> Option<&Entry<'_>> {
        self.entries.iter().find(|entry| entry.key == key)
    }

    /// # Errors
    /// There is none.
    pub fn need(&self, read: &Read, key: &str) -> Result<&Entry<'_>> {
        self.get(key).ok_or_else(|| {
            let what = format!("[{}] has no {key}", self.path);
            let remedy = "docs/reference/scenes.md has what a scene of elasticity holds";
            read.refuse(self.line, what, remedy)
        })
    }

    pub fn put(&self, lines: &mut Lines) {
        lines.make(self.line, &format!("[{}]", self.path));
        self.put_entries(lines);
    }

    pub fn put_entries(&self, lines: &mut Lines) {
        for entry in &self.entries {
            lines.copy(entry.line, entry.text);
        }
    }

    /// The names of groups under a key.
    fn groups(&self, read: &Read, key: &str) -> Result<Vec<String>> {
        let Some(entry) = self.get(key) else {
            return Ok(Vec::new());
        };
        entry.texts.clone().ok_or_else(|| {
            let what = format!("{key} is no list of groups");
            read.refuse(
                entry.line,
                what,
                "give names of groups of the mesh: [\"top\"]",
            )
        })
    }
}

impl<'a> Read<'a> {
    pub fn refuse(&self, line: usize, what: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::file(self.origin, Place::Line(line), what, remedy)
    }

    fn line(&self, at: usize) -> usize {
        self.text[..at.min(self.text.len())].matches('\n').count() + 1
    }

    fn entry(&self, key: &str, place: Range<usize>, value: &Value<'_>) -> Entry<'a> {
        let span = value.span();
        let one = |value: &Value<'_>| match value.get_ref() {
            DeValue::String(text) => Some(text.to_string()),
            DeValue::Integer(_) => Some(self.text[value.span()].to_owned()),
            _ => None,
        };
        let list = value.get_ref().as_array();
        let parts = value.get_ref().as_table().into_iter().flatten();
        let parts = parts.map(|(key, value)| self.entry(key.get_ref(), key.span(), value));
        Entry {
            parts: parts.collect(),
            key: key.to_owned(),
            // What a key and its value are not is the start of the file.
            text: self.text.get(place.start..span.end).unwrap_or_default(),
            value: self.text.get(span).unwrap_or_default(),
            line: self.line(place.start),
            count: list.map(|list| list.len()),
            texts: match list {
                Some(list) => list.iter().map(one).collect(),
                None => one(value).map(|one| vec![one]),
            },
        }
    }

    fn table(&self, name: &str, path: &str, line: usize, of: &DeTable<'_>) -> Table<'a> {
        let entries = of
            .iter()
            .map(|(key, value)| (key.span(), key.get_ref(), value));
        let mut entries: Vec<_> = entries.collect();
        entries.sort_by_key(|(place, ..)| place.start);
        let entries = entries.into_iter();
        Table {
            name: name.to_owned(),
            path: path.to_owned(),
            line,
            entries: entries
                .map(|(place, key, value)| self.entry(key, place, value))
                .collect(),
        }
    }

    /// # Errors
    /// What a scene must have and this has not; keys that are not known.
    pub fn scene(&self, of: &DeTable<'_>) -> Result<Scene<'a>> {
        let mut tables = Vec::new();
        let mut numbers = Vec::new();
        let mut top = self.table("", "", 1, of);
        for (key, value) in of {
            let (name, line) = (key.get_ref(), self.line(key.span().start));
            let known = TABLES.iter().find(|(known, _)| known == name);
            let Some((name, keys)) = known else {
                if ["name", "about"].contains(&&**name) {
                    continue;
                }
                let names = || TABLES.iter().map(|(name, _)| *name);
                let all = names().collect::<Vec<_>>().join(", ");
                let remedy = format!(
                    "{}a scene of elasticity has name, about, {all}",
                    meant(name, names())
                );
                return Err(self.refuse(line, format!("there is no key `{name}`"), remedy));
            };
            let Some(table) = value.get_ref().as_table() else {
                let what = format!("{name} is not a table");
                return Err(self.refuse(line, what, format!("write [{name}]")));
            };
            if *name == "numbers" {
                for (key, value) in table {
                    let (own, line) = (key.get_ref(), self.line(key.span().start));
                    let Some(table) = value.get_ref().as_table() else {
                        let what = format!("numbers.{own} is not a table");
                        return Err(self.refuse(line, what, format!("write [numbers.{own}]")));
                    };
                    numbers.push(self.table(own, &format!("numbers.{own}"), line, table));
                }
                continue;
            }
            let found = self.table(name, name, line, table);
            let unknown = |entry: &&Entry| !keys.is_empty() && !keys.contains(&&*entry.key);
            if let Some(entry) = found.entries.iter().find(unknown) {
                let what = format!("[{name}] has no key `{}`", entry.key);
                let remedy = format!(
                    "{}it has {}",
                    meant(&entry.key, keys.iter().copied()),
                    keys.join(", ")
                );
                return Err(self.refuse(entry.line, what, remedy));
            }
            tables.push(found);
        }
        numbers.sort_by_key(|table| table.line);
        top.entries
            .retain(|entry| ["name", "about"].contains(&&*entry.key));
        let mut take = |name: &str| {
            let at = tables.iter().position(|table| table.name == name)?;
            Some(tables.swap_remove(at))
        };
        let missing = |name: &str| {
            let remedy = "docs/reference/scenes.md has what a scene of elasticity holds";
            self.refuse(1, format!("there is no [{name}]"), remedy)
        };
        let mut need = |name: &str| take(name).ok_or_else(|| missing(name));
        let (mesh, elastic, boundary, data) = (
            need("mesh")?,
            need("elastic")?,
            need("boundary")?,
            need("data")?,
        );
        let title = top.need(self, "name")?;
        let Some([name]) = title.texts.as_deref() else {
            return Err(self.refuse(title.line, "name is no text", "write name = \"…\""));
        };
        let name = (name.clone(), title.line);
        let dim = self.dim(&data)?;
        let is_stress = self.is_stress(&elastic, dim)?;
        let [dirichlet, neumann, contact] = [
            boundary.groups(self, "dirichlet")?,
            boundary.groups(self, "neumann")?,
            boundary.groups(self, "contact")?,
        ];
        if contact.is_empty() {
            let remedy = "name the groups where contact is possible: contact = [\"bottom\"]";
            return Err(self.refuse(boundary.line, "no group is one of contact", remedy));
        }
        let given = [("t", "neumann", &neumann), ("g", "dirichlet", &dirichlet)];
        for (key, of, groups) in given {
            match (groups.is_empty(), data.get(key)) {
                (true, Some(entry)) => {
                    let what = format!("{key} is given, and [boundary] has no {of}");
                    return Err(self.refuse(entry.line, what, "name its groups, or leave it out"));
                }
                (false, None) => {
                    let what = format!("[boundary] has {of}, and [data] has no {key}");
                    return Err(self.refuse(data.line, what, format!("give {key} = [\"…\", …]")));
                }
                _ => {}
            }
        }
        if let Some(g) = data.get("g").filter(|g| !g.parts.is_empty()) {
            let other = g.parts.iter().find(|part| !dirichlet.contains(&part.key));
            let left = dirichlet.iter().find(|group| g.part(group).is_none());
            let (line, what) = match (other, left) {
                (Some(part), _) => (part.line, format!("{} is no group of dirichlet", part.key)),
                (None, Some(group)) => (g.line, format!("g has no values for {group}")),
                (None, None) => (g.line, String::new()),
            };
            if !what.is_empty() {
                return Err(self.refuse(line, what, "give one list for each group of dirichlet"));
            }
        }
        if let Some(entry) = data.get("friction").or(data.get("coulomb")) {
            let key = &entry.key;
            let (what, remedy) = match (data.get("along"), data.get("coulomb")) {
                _ if dim == 3 => (
                    "is for the plane".to_owned(),
                    "leave it out, or write the form",
                ),
                (Some(_), _) => (
                    "is along the boundary, and the gap is not along its normal".to_owned(),
                    "leave out along",
                ),
                (_, Some(_)) if key == "friction" => (
                    "is Tresca's, and coulomb is given too".to_owned(),
                    "leave one of them out",
                ),
                _ => (String::new(), ""),
            };
            if !what.is_empty() {
                return Err(self.refuse(entry.line, format!("{key} {what}"), remedy));
            }
        }
        Ok(Scene {
            name,
            dim,
            is_stress,
            top,
            mesh,
            elastic,
            boundary,
            parameters: take("parameters"),
            definitions: take("definitions"),
            data,
            method: take("method"),
            exact: take("exact"),
            numbers,
            contact,
            neumann,
            dirichlet,
        })
    }

    /// That of the vectors among the data.
    fn dim(&self, data: &Table<'_>) -> Result<usize> {
        let vectors = ["f", "g", "t", "along"].into_iter();
        let given = vectors.filter_map(|key| data.get(key));
        // g may be another one on each group.
        let all = given.flat_map(|entry| match &entry.parts[..] {
            [] => std::slice::from_ref(entry),
            parts => parts,
        });
        let all: Vec<&Entry> = all.collect();
        let Some(first) = all.first() else {
            let what = "[data] has neither f, g nor t";
            return Err(self.refuse(data.line, what, "nothing moves the body: give one of them"));
        };
        let dim = first.count.unwrap_or(0);
        match all.iter().find(|entry| entry.count != Some(dim)) {
            _ if !(2..=3).contains(&dim) => {
                let what = format!("{} is no vector", first.key);
                Err(self.refuse(first.line, what, "give a list of 2 or 3 components"))
            }
            Some(other) => {
                let what = format!("{} has another size than {}", other.key, first.key);
                Err(self.refuse(other.line, what, format!("give a list of {dim} components")))
            }
            None => Ok(dim),
        }
    }

    fn is_stress(&self, elastic: &Table<'_>, dim: usize) -> Result<bool> {
        let Some(entry) = elastic.get("plane") else {
            return Ok(false);
        };
        match (entry.value.trim_matches(['"', '\'']), dim) {
            (_, 3) => {
                let what = "plane is for 2D, and this scene is 3D";
                Err(self.refuse(entry.line, what, "leave it out"))
            }
            ("strain", _) => Ok(false),
            ("stress", _) => Ok(true),
            (other, _) => {
                let what = format!("plane is \"{other}\"");
                Err(self.refuse(entry.line, what, "give \"strain\" or \"stress\""))
            }
        }
    }
}
