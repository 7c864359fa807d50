//! Form files: face-off files whose codes get their scripts from a weak form.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Source;
use super::code::{Code, Missing, Own};
use super::formula::words;
use super::tables::Reader;
use crate::engine::{self, Form, Script};
use faceoff_fem::contact::Method;
use faceoff_form::Problem;
use faceoff_form::codes::{CODES, Code as Spelled};
use faceoff_form::elastic;
use faceoff_form::language::Formula;
use faceoff_judge::UpTo;
use faceoff_mesh::error::{Error, Result, meant};
use faceoff_mesh::file;
use faceoff_mesh::mesh::Mesh;

/// A form with the mesh that its scripts read, at one refinement.
pub struct FormFile {
    /// The form, checked on the mesh.
    pub problem: Problem,
    /// The mesh at the refinement.
    pub mesh: Mesh,
    /// The file of the mesh; `None` if it is generated.
    pub mesh_file: Option<PathBuf>,
    /// The refinements that the file names.
    pub levels: Vec<usize>,
}

/// The name of the field that another is derived from, as `q` in `div(q)`, `|q|` and `|curl(q)|`; the same name if it is not derived.
fn inner(name: &str) -> &str {
    let named = |start: &str, end: &str| name.strip_prefix(start)?.strip_suffix(end);
    let found = [("|", "|"), ("div(", ")"), ("curl(", ")")]
        .iter()
        .find_map(|(start, end)| named(start, end));
    let component = || Some(name.strip_suffix(']')?.rsplit_once('[')?.0);
    found.or_else(component).map_or(name, inner)
}

/// Why a form does not leave open what a field declares as open; `None` if it may.
pub(super) fn not_open(form: &Problem, field: &str, up_to: UpTo) -> Option<String> {
    let unknown = form.unknowns.iter().position(|u| u.name == field)?;
    if !matches!(up_to, UpTo::Constant | UpTo::Rigid) {
        return None;
    }
    let held = form
        .conditions
        .iter()
        .find(|held| held.unknown == unknown)?;
    let group = form.groups.get(held.group)?;
    Some(format!(
        "Dirichlet values on `{}` fix `{field}`",
        group.name
    ))
}

impl FormFile {
    /// Reads a form file, at a refinement or the first that it names; a scene of elasticity is read with a method.
    ///
    /// # Errors
    /// A file that cannot be read, or is not a form file; an invalid form or mesh, with its position.
    pub fn read(path: &Path, method: &Method, n: Option<usize>) -> Result<Self> {
        let (reader, text) = Reader::open(path, method, &[])?;
        let file = reader.parse(&text).map_err(|e| reader.told(e))?;
        if !file.is_form() {
            let what = "there is no form".to_owned();
            let remedy = "add [form] with F = \"…\", or [eigen] with a, m and count";
            return Err(reader.refuse("the file", what, remedy));
        }
        let (source, levels) = match file.mesh {
            Some(table) => reader.mesh(table)?,
            None => (None, Vec::new()),
        };
        let n = n.or(levels.first().copied());
        let found = reader.form(&text, source.as_ref(), n);
        let (problem, mesh) = found.map_err(|e| reader.told(e))?;
        let mesh_file = match source {
            Some(Source::File(path)) => Some(path),
            _ => None,
        };
        Ok(FormFile {
            problem,
            mesh,
            mesh_file,
            levels,
        })
    }
}

impl FormFile {
    /// Reads it at the given refinement, or at the first one in the file for which the mesh has as many cells as a result; if there is none, at the
    /// first.
    ///
    /// # Errors
    /// Errors of [`FormFile::read`].
    pub fn fitting(path: &Path, method: &Method, n: Option<usize>, result: &Mesh) -> Result<Self> {
        let form = FormFile::read(path, method, n)?;
        if n.is_some() || cells(&form.mesh) == cells(result) {
            return Ok(form);
        }
        for level in form.levels.iter().skip(1) {
            let finer = FormFile::read(path, method, Some(*level))?;
            if cells(&finer.mesh) == cells(result) {
                return Ok(finer);
            }
        }
        Ok(form)
    }
}

/// The number of cells of the highest dimension.
fn cells(mesh: &Mesh) -> usize {
    let dim = mesh.dim();
    mesh.cells()
        .filter(|(_, kind, _)| kind.dim() == dim)
        .count()
}

impl Reader {
    /// From a path: relative paths in the file refer to its folder.
    pub(super) fn of(path: &Path) -> Result<Self> {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let home = std::path::absolute(folder).map_err(Error::io(folder, "find"))?;
        Ok(Reader {
            origin: path.display().to_string(),
            home,
            scene: None,
            is_carried: false,
            given: None,
        })
    }

    /// The text of a form file or a face-off file, and its reader. A scene of elasticity, by its path or its name if it is built in, is a form by a
    /// method in these codes.
    pub(super) fn open(path: &Path, method: &Method, codes: &[String]) -> Result<(Self, String)> {
        let carried = path.to_str().and_then(elastic::builtin);
        let text = match carried {
            Some(text) => text.to_owned(),
            None => file::text(path)?,
        };
        let mut reader = Reader::of(path)?;
        reader.is_carried = carried.is_some();
        if !elastic::is_elastic(&text) {
            return Ok((reader, text));
        }
        let named: Vec<&str> = codes.iter().map(String::as_str).collect();
        let codes = match &named[..] {
            [] => &ELASTIC[..],
            named => named,
        };
        let lowered = elastic::lower(path, &text, method, codes)?;
        let text = lowered.text.text.clone();
        reader.scene = Some(Arc::new(lowered));
        Ok((reader, text))
    }

    /// The form on its mesh, whose groups it names.
    pub(super) fn form(
        &self,
        text: &str,
        source: Option<&Source>,
        n: Option<usize>,
    ) -> Result<(Problem, Mesh)> {
        let source = source.ok_or_else(|| {
            let what = "a form has no mesh".to_owned();
            self.refuse("mesh", what, "add [mesh] with a file or a generator")
        })?;
        let mesh = source.mesh(&self.origin, n)?;
        let mut problem = Problem::parse(self.origin.as_ref(), text, &mesh)?;
        problem.parts = self.scene.as_ref().map(|scene| scene.parts.clone());
        Ok((problem, mesh))
    }

    /// The codes that a form uses, all if it names none; `use` is taken out of the table.
    pub(super) fn written(&self, form: &Problem, codes: &mut toml::Table) -> Result<Vec<Code>> {
        let names: Vec<String> = match codes.remove("use") {
            Some(list) => self.table("codes.use", list)?,
            // An engine with that name replaces it.
            None => spelled()
                .filter(|name| *name != OWN || !codes.contains_key(OWN))
                .map(str::to_owned)
                .collect(),
        };
        let has_systems = match codes.remove("systems") {
            Some(given) => self.table("codes.systems", given)?,
            None => false,
        };
        let mut all = Vec::new();
        for name in names {
            let refuse = || {
                let remedy = format!(
                    "{}known are {}",
                    meant(&name, spelled()),
                    spelled().collect::<Vec<_>>().join(", ")
                );
                let what = format!("no scripts are written for a code `{name}`");
                self.refuse("codes.use", what, &remedy)
            };
            let mut code = match name.as_str() {
                OWN => own(form),
                _ => {
                    // freefem/elastic.idp is for the plane: in space its script is made from the form.
                    let is_by_hand = |code: &&Spelled| self.scene.is_some() && code.has(form);
                    let by_hand = Spelled::by_hand(&name).filter(is_by_hand);
                    let code = by_hand.or_else(|| Spelled::of_name(&name));
                    written(form, code.ok_or_else(refuse)?)
                }
            };
            if all.iter().any(|known: &Code| known.name() == name) {
                let what = format!("{name} is there twice");
                return Err(self.refuse("codes.use", what, "name it once"));
            }
            if has_systems {
                code.write_system().map_err(|why| {
                    let what = format!("{name} writes no linear system: {why}");
                    self.refuse(
                        "codes.systems",
                        what,
                        "name the other codes in `use`, or leave systems out",
                    )
                })?;
            }
            all.push(code);
        }
        Ok(all)
    }

    /// The fields to compare: the unknowns, if the file names no field.
    pub(super) fn asked_of(&self, form: &Problem, fields: &mut toml::Table) -> Result<()> {
        if form.eigen.is_some() {
            return Ok(());
        }
        let unknowns = || form.unknowns.iter().map(|unknown| unknown.name.as_str());
        let is_derived = |table: &toml::Value| table.get("value").is_some();
        if let Some((name, _)) = fields
            .iter()
            .find(|(name, table)| !is_derived(table) && !unknowns().any(|u| u == inner(name)))
        {
            let what = format!("{name} is not an unknown of the form, nor derived from one");
            let remedy = format!(
                "{}the unknowns are {}",
                meant(name, unknowns()),
                unknowns().collect::<Vec<_>>().join(", ")
            );
            return Err(self.refuse(&format!("fields.{name}"), what, &remedy));
        }
        let is_of_form = |(name, table): (&String, &toml::Value)| {
            is_derived(table) && unknowns().any(|u| u == inner(name))
        };
        if let Some((name, _)) = fields.iter().find(|field| is_of_form(*field)) {
            let what = format!(
                "{name} is an unknown: only numbers of a form have a value, and fields on facets"
            );
            let remedy = "give the field on facets a name of its own";
            return Err(self.refuse(&format!("fields.{name}"), what, remedy));
        }
        if fields.iter().all(|(_, table)| is_derived(table)) {
            let all = unknowns().map(|name| (name.to_owned(), toml::Table::new().into()));
            fields.extend(all);
        }
        Ok(())
    }
}

/// The codes that solve a scene of elasticity if none is named.
const ELASTIC: [&str; 3] = [OWN, "freefem", "fenicsx"];

/// The name of this program's solver in files.
const OWN: &str = "rust";

/// The names of the codes that solve forms: our own, and those that scripts are written for.
fn spelled() -> impl Iterator<Item = &'static str> {
    std::iter::once(OWN).chain(CODES.iter().map(|code| code.name))
}

/// The name of the file with the eigenvalues of an eigenproblem.
fn numbers(form: &Problem) -> Option<String> {
    form.eigen.as_ref().map(|_| format!("{}.csv", form.name))
}

/// Our own solver.
fn own(form: &Problem) -> Code {
    let files = Script {
        name: OWN.to_owned(),
        command: Vec::new(),
        source: None,
        home: ".".into(),
        mesh: None,
        results: vec![format!("{}.vtu", form.name)],
        numbers: numbers(form),
        system: None,
    };
    Code::Own(Box::new(Own::new(files, form.clone())))
}

/// The code with its script, or why it has none.
fn written(form: &Problem, code: &'static Spelled) -> Code {
    let mut script = Script {
        name: code.name.to_owned(),
        command: Vec::new(),
        source: None,
        home: ".".into(),
        mesh: Form::of_name(code.mesh.0),
        results: vec![format!("{}.vtu", form.name)],
        numbers: numbers(form),
        system: None,
    };
    let source = match engine::Source::new(form, code) {
        Ok(source) => source,
        Err(why) => return Code::Missing(Missing::new(script, why, true)),
    };
    match source.command() {
        Ok(command) => {
            script.command = command;
            script.source = Some(source);
            Code::Script(script)
        }
        Err(why) => Code::Missing(Missing::new(script, why, false)),
    }
}

/// A formula with definitions and data replaced by their formulas, parameters as `{NAME}`, and the end time as a number.
pub(super) fn in_full(text: &str, form: &Problem) -> String {
    let data: BTreeMap<&str, &str> = form
        .data
        .iter()
        .filter(|datum| datum.shape.is_empty())
        .map(|datum| (datum.name.as_str(), datum.texts[0].as_str()))
        .collect();
    // The end and the step are not parameters of the file.
    let is_timed = |k: usize| {
        let of_time = form.time.as_ref().map(|time| time.parameter);
        of_time.is_some_and(|first| k >= first)
    };
    let value = |name: &str| {
        let mut all = form.parameters.iter().enumerate();
        let (k, found) = all.find(|(_, parameter)| parameter.name == name)?;
        Some(match is_timed(k) {
            true => format!("({:?})", found.value),
            false => format!("{{{name}}}"),
        })
    };
    // Text that cannot be parsed stays unchanged: the reader of the formula rejects it.
    let full = Formula::new(text.to_owned(), &form.definitions);
    let full = full.map_or_else(|_| text.to_owned(), |formula| formula.text);
    words(&full, |word| match data.get(word) {
        Some(datum) => Some(format!("({})", words(datum, value))),
        None => value(word),
    })
}
