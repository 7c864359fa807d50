//! A sweep: the values of n, parameters, the time step and the degree for which all codes solve a problem again, in all combinations or
//! for a random sample.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Deserialize;

use super::FaceOff;
use super::level::{Axis, N};
use super::tables::Reader;
use faceoff_mesh::error::{Error, Result, meant};

/// A point of a sweep: a value for each name, as text for a command.
pub type Point = BTreeMap<String, String>;

/// The points of a sweep.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The names that change.
    pub names: Vec<String>,
    /// The seed of the random sample.
    pub seed: Option<u64>,
    /// The points, all distinct.
    pub points: Vec<Point>,
}

/// `[sweep]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepTable {
    over: BTreeMap<String, Values>,
    draw: Option<usize>,
    seed: Option<u64>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Values {
    List(Vec<toml::Value>),
    Range(Range),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: toml::Value,
    to: toml::Value,
    count: Option<usize>,
    #[serde(default)]
    log: bool,
}

/// A sweep of more points is a mistake.
const MOST: usize = 10_000;
/// The number of digits of sampled values, so that they can be typed.
const DIGITS: usize = 4;
/// The time step of a form, which `[time]` calls `step`.
pub const DT: &str = "dt";
/// The highest degree of the spaces of a form.
const DEGREE: &str = "degree";

/// A number rounded to some significant digits, as one types it.
pub fn rounded(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", digits.max(1) - 1);
    text.parse().unwrap_or(value)
}

/// Numbers from 0 to 1, the same for each seed.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// `nu = 0.3, n = 4`
pub fn place(point: &Point) -> String {
    let mut words = String::new();
    for (name, value) in point {
        let comma = if words.is_empty() { "" } else { ", " };
        let _ = write!(words, "{comma}{name} = {value}");
    }
    words
}

/// The TOML value of a word on the command line or in a point.
fn value(text: &str) -> toml::Value {
    let whole = text.parse::<i64>().map(Into::into);
    let real = || text.parse::<f64>().ok().filter(|x| x.is_finite());
    let other = || match text {
        "true" => true.into(),
        "false" => false.into(),
        _ => text.into(),
    };
    whole.unwrap_or_else(|_| real().map_or_else(other, Into::into))
}

impl Range {
    /// The value at a fraction of the range; an integer if both ends are integers.
    fn at(&self, [from, to]: [f64; 2], share: f64) -> toml::Value {
        let value = match self.log {
            true => from * (to / from).powf(share),
            false => from + share * (to - from),
        };
        match self.from.is_integer() && self.to.is_integer() {
            true => (value.round() as i64).into(),
            // Rounding must not leave the range.
            false => rounded(value, DIGITS).clamp(from, to).into(),
        }
    }

    fn ends(&self) -> Result<[f64; 2], String> {
        let number = |value: &toml::Value| match value {
            toml::Value::Integer(n) => Some(*n as f64),
            toml::Value::Float(x) => Some(*x).filter(|x| x.is_finite()),
            _ => None,
        };
        match (number(&self.from), number(&self.to)) {
            (Some(from), Some(to)) if from < to && (from > 0.0 || !self.log) => Ok([from, to]),
            (Some(from), Some(to)) => Err(format!("its range is from {from} to {to}")),
            _ => Err("an end of its range is not a finite number".into()),
        }
    }
}

impl Reader {
    /// The points of a sweep in a file.
    pub(super) fn sweep(&self, table: toml::Value, file: &FaceOff) -> Result<Sweep> {
        let table: SweepTable = self.table("sweep", table)?;
        let mut random = random(table.seed.unwrap_or(1));
        let mut axes: Vec<(&String, Draw)> = Vec::new();
        for (name, values) in &table.over {
            let place = format!("sweep.over.{name}");
            let refuse = |what: String, remedy: &str| self.refuse(&place, what, remedy);
            file.may_sweep(name)
                .map_err(|(what, remedy)| refuse(what, &remedy))?;
            let known = |value: toml::Value| self.parameter_of(&place, &value);
            let list = match values {
                Values::List(list) if list.is_empty() => {
                    return Err(refuse("its list is empty".into(), "give values"));
                }
                Values::List(list) => list.clone(),
                Values::Range(range) => {
                    let ends = range.ends().map_err(|what| {
                        refuse(what, "give from below to, and both above 0 with log")
                    })?;
                    match range.count {
                        Some(count @ 2..=MOST) => (0..count)
                            .map(|k| range.at(ends, k as f64 / (count - 1) as f64))
                            .collect(),
                        Some(count) => {
                            let what = format!("{count} values are not a range");
                            return Err(refuse(what, "give a count from 2 to 10000"));
                        }
                        None if table.draw.is_some() => {
                            axes.push((name, Draw::Range(range, ends)));
                            continue;
                        }
                        None => {
                            let what = "it does not say how many values there are".to_owned();
                            return Err(refuse(what, "add count, or draw to [sweep]"));
                        }
                    }
                }
            };
            let mut list = list.into_iter().map(known).collect::<Result<Vec<_>>>()?;
            let mut seen = std::collections::BTreeSet::new();
            list.retain(|value| seen.insert(value.clone()));
            axes.push((name, Draw::List(list)));
        }
        let refuse = |what: String, remedy: &str| self.refuse("sweep", what, remedy);
        if axes.is_empty() {
            return Err(refuse(
                "it is over nothing".into(),
                "add over = { NAME = [values] }",
            ));
        }
        let points = match table.draw {
            None => product(&axes),
            Some(count @ 1..=MOST) => {
                let mut points: Vec<Point> = Vec::new();
                // Lists have few combinations, which are drawn repeatedly.
                for _ in 0..100 * count {
                    let of = |(name, draw): &(&String, Draw)| {
                        let share = random();
                        let value = match draw {
                            Draw::List(list) => list[(share * list.len() as f64) as usize].clone(),
                            Draw::Range(range, ends) => {
                                self.parameter_of("sweep", &range.at(*ends, share))?
                            }
                        };
                        Ok(((*name).clone(), value))
                    };
                    let point = axes.iter().map(of).collect::<Result<Point>>()?;
                    if points.len() < count && !points.contains(&point) {
                        points.push(point);
                    }
                }
                Some(points)
            }
            Some(count) => {
                return Err(refuse(
                    format!("{count} points are not a draw"),
                    "draw from 1 to 10000",
                ));
            }
        };
        let points = points.ok_or_else(|| {
            refuse(
                format!("it has more than {MOST} points"),
                "add draw, the number of points to take at random",
            )
        })?;
        Ok(Sweep {
            names: table.over.keys().cloned().collect(),
            seed: table.draw.map(|_| table.seed.unwrap_or(1)),
            points,
        })
    }

    /// A value of a sweep as text for a command; it is part of names of folders.
    fn parameter_of(&self, place: &str, value: &toml::Value) -> Result<String> {
        let text = self.value_of(place, value)?;
        let is_usual = |c: char| c.is_alphanumeric() || "-_.+".contains(c);
        if text.is_empty() || text.starts_with('.') || !text.chars().all(is_usual) {
            let what = format!("`{text}` cannot name folders of runs");
            return Err(self.refuse(place, what, "use letters, digits, `-`, `_`, `+` and `.`"));
        }
        Ok(text)
    }
}

/// The set from which values are drawn.
enum Draw<'a> {
    List(Vec<String>),
    Range(&'a Range, [f64; 2]),
}

/// All combinations; `None` if they are too many.
fn product(axes: &[(&String, Draw)]) -> Option<Vec<Point>> {
    let mut points = vec![Point::new()];
    for (name, draw) in axes {
        let Draw::List(list) = draw else { continue };
        if points.len() * list.len() > MOST {
            return None;
        }
        let with = |point: &Point| {
            let point = point.clone();
            let each = list.iter().cloned();
            each.map(move |value| {
                let mut point = point.clone();
                point.insert((*name).clone(), value);
                point
            })
            .collect::<Vec<_>>()
        };
        points = points.iter().flat_map(with).collect();
    }
    Some(points)
}

impl FaceOff {
    /// An error, with the names that may be swept, if this one may not.
    fn may_sweep(&self, name: &str) -> Result<(), (String, String)> {
        let form = self.form.as_ref();
        let is_timed = form.is_some_and(|form| form.time.is_some());
        let of_form = [(DT, is_timed), (DEGREE, form.is_some())];
        let more = of_form.iter().filter(|(_, is)| *is).map(|(name, _)| *name);
        let known: Vec<&str> = [N]
            .into_iter()
            .chain(self.parameters.keys().map(String::as_str))
            .chain(more)
            .collect();
        if known.contains(&name) {
            return Ok(());
        }
        let remedy = format!(
            "{}known are {}",
            meant(name, known.iter().copied()),
            known.join(", ")
        );
        Err((format!("nothing is called `{name}`"), remedy))
    }

    /// A sweep over one parameter, whose values are in the order of the list.
    ///
    /// # Errors
    /// A name of nothing.
    pub fn over(&self, name: &str, values: &[&str]) -> Result<Sweep> {
        self.may_sweep(name)
            .map_err(|(what, remedy)| Error::usage(what, remedy))?;
        let point = |value: &&str| [(name.to_owned(), (*value).to_owned())].into();
        Ok(Sweep {
            names: vec![name.to_owned()],
            seed: None,
            points: values.iter().map(point).collect(),
        })
    }

    /// The same on a generated mesh of another size.
    ///
    /// # Errors
    /// A mesh that is not generated.
    pub fn sized(&self, size: &[f64]) -> Result<FaceOff> {
        let mut tables = self.tables.clone();
        if let Some(mesh) = tables.get_mut("mesh").and_then(toml::Value::as_table_mut) {
            let size: Vec<toml::Value> = size.iter().map(|x| (*x).into()).collect();
            mesh.insert("size".to_owned(), size.into());
        }
        let mut found = self.reader.read_tables(tables)?;
        let names: Vec<&str> = self.codes.iter().map(super::Code::name).collect();
        found.codes.retain(|code| names.contains(&code.name()));
        Ok(found)
    }

    /// Is its mesh made by a generator?
    pub fn is_generated(&self) -> bool {
        matches!(self.mesh, Some(super::Source::Generated(..)))
    }

    /// The same with values of n, of parameters, or of the step in time or the degree of a form; they are no longer swept.
    ///
    /// # Errors
    /// An unknown name; values that the file could not have.
    pub fn at(&self, point: &Point) -> Result<FaceOff> {
        let mut tables = self.tables.clone();
        for (name, text) in point {
            self.may_sweep(name)
                .map_err(|(what, remedy)| Error::usage(what, remedy))?;
            let is_parameter = self.parameters.contains_key(name);
            let (table, key) = match &**name {
                N => ("mesh", N),
                DT if !is_parameter => ("time", "step"),
                DEGREE if !is_parameter => {
                    let at_most = text.parse().map_err(|_| {
                        let what = format!("degree = {text} is not an integer");
                        Error::usage(what, "give 1, 2 or 3")
                    })?;
                    self.raise(&mut tables, at_most)?;
                    continue;
                }
                name => ("parameters", name),
            };
            let of = tables
                .entry(table)
                .or_insert_with(|| toml::Table::new().into());
            if let Some(of) = of.as_table_mut() {
                of.insert(key.to_owned(), value(text));
            }
        }
        forget(&mut tables, point.keys());
        let mut found = self.reader.read_tables(tables)?;
        let names: Vec<&str> = self.codes.iter().map(super::Code::name).collect();
        found.codes.retain(|code| names.contains(&code.name()));
        // Labels, folders and stored answers use these values too.
        let fixed = point.iter().filter(|(name, _)| *name != N);
        let fixed = fixed.map(|(name, value)| Axis::fixed(name, value));
        found.axes.extend(fixed);
        Ok(found)
    }

    /// Gives the space of the highest degree this degree, and shifts the degrees of the others by the same amount.
    fn raise(&self, tables: &mut toml::Table, degree: i64) -> Result<()> {
        let spaces = tables.get_mut("spaces").and_then(toml::Value::as_table_mut);
        let mut spaces: Vec<(&mut toml::Value, usize, i64)> = spaces
            .into_iter()
            .flat_map(|table| table.iter_mut())
            .filter_map(|(_, space)| {
                let text = space.as_str()?;
                let at = ["P", "DG"].iter().find_map(|of| {
                    let rest = text.strip_prefix(of)?;
                    rest.starts_with(|c: char| c.is_ascii_digit())
                        .then_some(of.len())
                })?;
                let degree = text.get(at..=at)?.parse().ok()?;
                Some((space, at, degree))
            })
            .collect();
        let Some(highest) = spaces.iter().map(|(.., degree)| *degree).max() else {
            let what = "the form has no space with a degree";
            return Err(Error::usage(what, "leave degree out of the sweep"));
        };
        for (space, at, of) in &mut spaces {
            let text = space.as_str().unwrap_or_default();
            let raised = *of + degree - highest;
            let text = format!("{}{raised}{}", &text[..*at], &text[*at + 1..]);
            **space = text.into();
        }
        Ok(())
    }
}

/// Removes fixed names from the sweep of a file.
pub(super) fn forget<'a>(tables: &mut toml::Table, names: impl Iterator<Item = &'a String>) {
    let sweep = tables.get_mut("sweep").and_then(toml::Value::as_table_mut);
    let over = sweep.and_then(|of| of.get_mut("over")?.as_table_mut());
    if let Some(over) = over {
        for name in names {
            over.remove(name);
        }
        if over.is_empty() {
            tables.remove("sweep");
        }
    }
}
