//! The tables of a face-off file and their checks.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;

use super::code::{Code, Protocol};
use super::level::{Axis, Level};
use super::{Asked, FaceOff, Judged, Source};
use crate::engine::{self, Form, Script, fill};
use faceoff_fem::contact::Method;
use faceoff_fem::scene::Scene;
use faceoff_form::elastic::Lowered;
use faceoff_form::image::Image;
use faceoff_mesh::error::{Error, Result, meant};
use faceoff_mesh::mesh::Mesh;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    name: String,
    #[serde(default)]
    about: String,
    pub mesh: Option<MeshTable>,
    #[serde(default)]
    parameters: BTreeMap<String, toml::Value>,
    #[serde(default)]
    times: Judged,
    #[serde(default)]
    codes: toml::Table,
    #[serde(default)]
    fields: toml::Table,
    #[serde(default)]
    numbers: toml::Table,
    #[serde(default)]
    spectra: toml::Table,
    sweep: Option<toml::Value>,
    #[serde(default)]
    symmetries: Vec<String>,
    // Of a form, which is read by its own crate.
    form: Option<toml::Value>,
    eigen: Option<toml::Value>,
    spaces: Option<toml::Value>,
    definitions: Option<toml::Value>,
    data: Option<toml::Value>,
    dirichlet: Option<toml::Value>,
    mean: Option<toml::Value>,
    time: Option<toml::Value>,
    initial: Option<toml::Value>,
}

/// Where the data of a script are symmetric, its answer is.
const OF_DATA: [Image; 2] = [Image::Mirrored, Image::Turned];

/// In the order of reports, whatever that of the file, which matters only for definitions and Dirichlet values.
fn by_name(table: toml::Table) -> BTreeMap<String, toml::Value> {
    table.into_iter().collect()
}

impl File {
    /// Does it contain a weak form, which crates/form reads?
    pub fn is_form(&self) -> bool {
        self.form.is_some() || self.eigen.is_some()
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshTable {
    pub file: Option<String>,
    pub generator: Option<String>,
    pub origin: Option<Vec<f64>>,
    pub size: Option<Vec<f64>>,
    #[serde(default)]
    pub n: Several<usize>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CodeTable {
    #[serde(default)]
    command: Vec<String>,
    engine: Option<String>,
    scene: Option<String>,
    method: Option<String>,
    mesh: Option<String>,
    #[serde(default)]
    result: Several<String>,
    numbers: Option<String>,
    system: Option<String>,
}

/// One, or a list.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Several<T> {
    One(T),
    List(Vec<T>),
}

impl<T> Default for Several<T> {
    fn default() -> Self {
        Several::List(Vec::new())
    }
}

impl<T> Several<T> {
    pub fn as_slice(&self) -> &[T] {
        match self {
            Several::One(one) => std::slice::from_ref(one),
            Several::List(list) => list,
        }
    }

    pub fn list(self) -> Vec<T> {
        match self {
            Several::One(one) => vec![one],
            Several::List(list) => list,
        }
    }
}

/// Reads one file.
#[derive(Clone)]
pub(super) struct Reader {
    pub origin: String,
    pub home: PathBuf,
    /// The form of a scene of elasticity; `None` for other files.
    pub scene: Option<Arc<Lowered>>,
    /// Are the file and its mesh built into the program?
    pub is_carried: bool,
    /// The mesh, if it does not come from the file.
    pub given: Option<Arc<Mesh>>,
}

impl Reader {
    pub(super) fn refuse(&self, place: &str, what: String, remedy: &str) -> Error {
        Error::Scene {
            scene: self.origin.clone(),
            place: place.to_owned(),
            what,
            remedy: remedy.to_owned(),
        }
    }

    pub(super) fn table<T: for<'de> Deserialize<'de>>(
        &self,
        place: &str,
        value: toml::Value,
    ) -> Result<T> {
        value
            .try_into()
            .map_err(|e: toml::de::Error| self.refuse(place, e.message().replace('\n', " "), KEYS))
    }

    /// The tables of a file.
    pub fn parse(&self, text: &str) -> Result<File> {
        let file: File = toml::from_str(text).map_err(|e| {
            let line = e
                .span()
                .map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            self.refuse(
                &format!("line {line}"),
                e.message().replace('\n', " "),
                KEYS,
            )
        })?;
        self.check_name("name", &file.name)?;
        let of_form = [
            ("spaces", &file.spaces),
            ("definitions", &file.definitions),
            ("data", &file.data),
            ("dirichlet", &file.dirichlet),
            ("mean", &file.mean),
            ("time", &file.time),
            ("initial", &file.initial),
        ];
        match of_form.iter().find(|(_, table)| table.is_some()) {
            Some((key, _)) if !file.is_form() => {
                let what = "it belongs to a form, and there is none".to_owned();
                Err(self.refuse(key, what, "add [form] with F = \"…\", or leave it out"))
            }
            _ => Ok(file),
        }
    }

    /// Reads a file; an error in a scene of elasticity is reported at its position there.
    pub fn read(&self, text: &str) -> Result<FaceOff> {
        self.read_here(text).map_err(|e| self.told(e))
    }

    /// Moves an error in a text that was generated from a scene to the scene.
    pub fn told(&self, error: Error) -> Error {
        match &self.scene {
            Some(scene) => scene.text.told(error),
            None => error,
        }
    }

    fn read_here(&self, text: &str) -> Result<FaceOff> {
        let mut file = self.parse(text)?;
        let reals = self.reals(&file.parameters);
        let (parameters, list) = self.parameters(std::mem::take(&mut file.parameters))?;
        let mut n = Vec::new();
        let mut source = None;
        if let Some(table) = file.mesh.take() {
            (source, n) = self.mesh(table)?;
        }
        if let Some(mesh) = &self.given {
            source = Some(Source::Given(mesh.clone()));
        }
        let axes: Vec<Axis> = Axis::refinements(&n).into_iter().chain(list).collect();
        Level::all(&axes).map_err(|what| {
            let remedy = "give one n, or as many as the parameter has values: they run together";
            self.refuse("parameters", what, remedy)
        })?;
        let form = match file.is_form() {
            false => None,
            true => Some(self.form(text, source.as_ref(), n.first().copied())?.0),
        };
        let mut codes = match &form {
            None => Vec::new(),
            Some(form) => self.written(form, &mut file.codes)?,
        };
        for (name, table) in by_name(file.codes) {
            let place = format!("codes.{name}");
            let table = self.table(&place, table)?;
            let code = self.code(name, table, &parameters, source.is_some())?;
            if codes.iter().any(|known| known.name() == code.name()) {
                let what = "there are two codes of this name".to_owned();
                return Err(self.refuse(&place, what, "give one of them another name"));
            }
            codes.push(code);
        }
        // The known data of a scene of elasticity suffice to judge one code.
        if codes.len() < 2 && (self.scene.is_none() || codes.is_empty()) {
            let what = format!("it has {} codes", codes.len());
            return Err(self.refuse("codes", what, "name two at least: [codes.NAME]"));
        }
        for (k, code) in codes.iter().enumerate() {
            let Some(script) = code.typed() else { continue };
            let mut others = codes[..k].iter().filter_map(Code::typed);
            if let Some(twin) = others.find(|other| other.command == script.command) {
                let what = format!("{} and {} have one command", twin.name, script.name);
                let remedy =
                    "comparing a code with itself shows nothing: give each a different command";
                return Err(self.refuse("codes", what, remedy));
            }
        }
        let times = &file.times;
        let asked = |kind: &str, tables: toml::Table| -> Result<Vec<Asked>> {
            let all = by_name(tables).into_iter();
            let all = all.map(|(name, table)| {
                self.asked(
                    (kind, name, table),
                    form.as_ref(),
                    times,
                    &parameters,
                    &codes,
                )
            });
            all.collect()
        };
        if let Some(form) = &form {
            self.asked_of(form, &mut file.fields)?;
        }
        let (fields, numbers) = (
            asked("fields", file.fields)?,
            asked("numbers", file.numbers)?,
        );
        if let Some(form) = &form {
            self.spectra_of(form, &mut file.spectra)?;
        }
        let spectra = by_name(file.spectra).into_iter();
        let spectra = spectra.map(|(name, table)| self.spectrum(name, table, &codes));
        let spectra = spectra.collect::<Result<Vec<_>>>()?;
        // If a code has a system, it is compared with that of the form.
        let has_system = codes.iter().any(|code| code.files().system.is_some());
        for code in &mut codes {
            if let (Code::Own(own), true) = (code, has_system) {
                own.write_system();
            }
        }
        let with_system = codes
            .iter()
            .filter(|code| code.files().system.is_some())
            .count();
        if fields.is_empty() && numbers.is_empty() && spectra.is_empty() && with_system < 2 {
            let what = "nothing is compared".to_owned();
            return Err(self.refuse(
                "fields",
                what,
                "name a field: [fields.u] with same and rtol; or give two codes a system",
            ));
        }
        let symmetries = file.symmetries.iter().map(|name| {
            let mut all = OF_DATA.into_iter();
            all.find(|of| of.name() == name).ok_or_else(|| {
                let what = format!("`{name}` is no symmetry that data may have");
                let known = OF_DATA.map(Image::name);
                let remedy = format!("{}known are {}", meant(name, known), known.join(", "));
                self.refuse("symmetries", what, &remedy)
            })
        });
        let symmetries = symmetries.collect::<Result<Vec<Image>>>()?;
        let files = codes.iter().map(Code::files);
        let has_fields = !fields.is_empty() || spectra.iter().any(|of| of.modes.is_some());
        let has_numbers = !spectra.is_empty() || numbers.iter().any(|asked| asked.value.is_empty());
        let lacks = |code: &&Script| {
            code.results.is_empty() && has_fields || code.numbers.is_none() && has_numbers
        };
        if let Some(code) = files.clone().find(lacks) {
            let key = if code.results.is_empty() && has_fields {
                "result"
            } else {
                "numbers"
            };
            let what = format!("it does not say in which file its {key} are");
            let remedy = match code.command.is_empty() {
                true => "an engine only answers with its field u: leave it out, or the numbers"
                    .to_owned(),
                false => format!("add {key} = \"…\" to it"),
            };
            return Err(self.refuse(&format!("codes.{}", code.name), what, &remedy));
        }
        let mut found = FaceOff {
            form,
            name: file.name,
            about: file.about,
            mesh: source,
            axes,
            parameters,
            reals,
            codes,
            fields,
            numbers,
            spectra,
            sweep: None,
            symmetries,
            // The text is TOML, as it was parsed.
            tables: text.parse().unwrap_or_default(),
            reader: self.clone(),
        };
        found.sweep = match file.sweep {
            Some(table) => Some(self.sweep(table, &found)?),
            None => None,
        };
        Ok(found)
    }

    /// Adds these tables to those of a file.
    pub(super) fn read_tables(&self, tables: toml::Table) -> Result<FaceOff> {
        let text = toml::to_string(&tables).map_err(|e| {
            let what = format!("its tables cannot be written again: {e}");
            self.refuse("the file", what, "report this")
        })?;
        self.read(&text)
    }

    fn check_name(&self, place: &str, name: &str) -> Result<()> {
        let is_usual = |c: char| c.is_alphanumeric() || "-_.".contains(c);
        if !name.is_empty() && !name.starts_with('.') && name.chars().all(is_usual) {
            return Ok(());
        }
        let what = format!("`{name}` cannot name output files");
        Err(self.refuse(place, what, "use letters, digits, `-`, `_` and `.`"))
    }

    fn code(
        &self,
        name: String,
        table: CodeTable,
        parameters: &BTreeMap<String, String>,
        has_mesh: bool,
    ) -> Result<Code> {
        let place = format!("codes.{name}");
        self.check_name(&place, &name)?;
        if let Some(engine) = &table.engine {
            return self.protocol(&place, &name, engine, &table);
        }
        if table.scene.is_some() || table.method.is_some() {
            let what = "scene and method are of an engine".to_owned();
            return Err(self.refuse(&place, what, "add engine = \"…\", or leave them out"));
        }
        if table
            .command
            .first()
            .is_none_or(|word| word.trim().is_empty())
        {
            return Err(self.refuse(&place, "its command is empty".into(), "name a program"));
        }
        let form = match table.mesh.as_deref() {
            None | Some("none") => None,
            Some(form) => Some(Form::of_name(form).ok_or_else(|| {
                let what = format!("there is no form of meshes `{form}`");
                self.refuse(
                    &place,
                    what,
                    "take msh, msh2, vtu, xdmf, medit, freefem, …, or none",
                )
            })?),
        };
        if form.is_some() && !has_mesh {
            let what = "there is no mesh for it".to_owned();
            return Err(self.refuse(&place, what, "add [mesh] with a file or a generator"));
        }
        let known = |word: &str| match word {
            "mesh" => form.as_ref().map(|_| String::new()),
            "out" | "n" => Some(String::new()),
            other => parameters.get(other).cloned(),
        };
        for word in &table.command {
            fill(word, known).map_err(|what| {
                let remedy = "known are {mesh} (of a code with a mesh), {out}, {n}, and what is under [parameters]";
                self.refuse(&place, what, remedy)
            })?;
        }
        if form.is_some() && !table.command.iter().any(|word| word.contains("{mesh}")) {
            let what = "its command does not say where the mesh goes".to_owned();
            return Err(self.refuse(&place, what, "put {mesh} into it, or say mesh = \"none\""));
        }
        let system = table.system.as_deref();
        let system = system.map(|files| self.system(&place, files)).transpose()?;
        let script = Script {
            name,
            command: table.command,
            source: None,
            home: self.home.clone(),
            mesh: form,
            results: table.result.list(),
            numbers: table.numbers,
            system,
        };
        if !script.has_out() {
            let what = "its command does not say where its results go".to_owned();
            let remedy = "put {out} into it, a new folder for each run, and let it write there";
            return Err(self.refuse(&place, what, remedy));
        }
        Ok(Code::Script(script))
    }

    /// The three files of a linear system.
    fn system(&self, place: &str, files: &str) -> Result<[String; 3]> {
        let files: Vec<String> = files.split_whitespace().map(str::to_owned).collect();
        files.try_into().map_err(|files: Vec<String>| {
            let what = format!("its system is {} files", files.len());
            let remedy = "name three: the matrix, the right-hand side and the dofs, as in system = \"A.mtx b.mtx dofs.csv\"";
            self.refuse(place, what, remedy)
        })
    }

    /// A code that implements the protocol of engines: its name, or the file that describes it, and its problem.
    fn protocol(&self, place: &str, name: &str, engine: &str, table: &CodeTable) -> Result<Code> {
        let given = [
            ("command", !table.command.is_empty()),
            ("mesh", table.mesh.is_some()),
            ("numbers", table.numbers.is_some()),
            ("system", table.system.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(_, is_given)| *is_given) {
            let what = format!("it has an engine and {key}");
            let remedy = "an engine gets the mesh and answers with its field u: keep engine, scene and method";
            return Err(self.refuse(place, what, remedy));
        }
        let Some(scene) = &table.scene else {
            let what = format!("it does not say which scene {engine} solves");
            return Err(self.refuse(place, what, "add scene = \"…\", a built-in one or a file"));
        };
        let beside = |word: &str| match word.ends_with(".toml") {
            true => self.home.join(word).display().to_string(),
            false => word.to_owned(),
        };
        let method = table.method.as_deref().unwrap_or("cr").parse::<Method>();
        let method = method.map_err(|what| self.refuse(place, what, "name one method"))?;
        let engine = engine::find(&beside(engine))?;
        engine.accepts(&method)?;
        let scene = Scene::find(&beside(scene))?;
        Ok(Code::Protocol(Box::new(Protocol::new(
            name, engine, scene, method,
        ))))
    }
}

pub(super) const KEYS: &str = "docs/reference/face-off.md lists the keys of a face-off file, docs/reference/form.md those of a form";
