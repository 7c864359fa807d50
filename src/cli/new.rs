//! `faceoff new`: a folder with a face-off that can run immediately.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use clap::builder::{EnumValueParser, PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, ValueEnum};

use super::DONE;
use super::args::{New, Template};
use crate::report::console::{note, tell};
use faceoff_mesh::CellKind;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::io;
use faceoff_mesh::mesh::Mesh;

/// A file of a template: its name and its contents.
type Part = (&'static str, &'static [u8]);

macro_rules! template {
    ($folder:literal: $($name:literal)*) => {
        &[$(($name, include_bytes!(concat!("../../examples/", $folder, "/", $name)))),*]
    };
}

impl Template {
    /// Its name, and the files of its folder in `examples`.
    fn parts(self) -> (&'static str, &'static [Part]) {
        match self {
            Template::Blank => (
                "blank",
                template!("blank":
                "README.md" "blank.edp" "blank.py" "blank.toml" "compat.py" "moments.idp" "moments3.idp" "vtu.idp"),
            ),
            Template::Obstacle => (
                "obstacle",
                template!("obstacle":
                "README.md" "compat.py" "obstacle.edp" "obstacle.geo" "obstacle.msh" "obstacle.py" "obstacle.toml" "vtu.idp"),
            ),
            Template::Hertz => (
                "hertz",
                template!("hertz":
                "README.md" "ball.edp" "ball.geo" "ball.msh" "ball.py" "ball.toml" "ball_getfem.py" "compat.py" "hertz.edp" "hertz.geo" "hertz.msh" "hertz.py" "hertz.toml" "hertz_getfem.py" "line.toml" "vtu.idp" "vtu3.idp"),
            ),
        }
    }
}

macro_rules! gallery {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../examples/forms/", $name, ".toml")))),*]
    };
}

/// The weak forms of `examples/forms`.
const FORMS: &[(&str, &str)] = gallery!(
    "allen-cahn" "biharmonic" "block" "brinkman" "cantilever" "cavity" "chouly-hild" "contact-patch" "convection" "curl-curl" "curl-curl-3d" "darcy"
    "elastic-chouly-hild" "elastic-transition" "elasticity" "interior-penalty" "korn" "l-shape" "minimal-surface" "neo-hooke" "nitsche" "obstacle" "p-laplace" "plane-stress" "poisson" "ring"
    "signorini" "stokes" "stokes-closed" "stokes-cr" "supg" "tresca");

/// The files that a form names: a mesh from Gmsh, with its geometry.
fn named(form: &str) -> &'static [Part] {
    match form {
        "cantilever" => template!("forms": "beam.geo" "beam.msh"),
        "l-shape" => template!("forms": "l.msh"),
        "ring" => template!("forms": "ring.geo" "ring.msh"),
        _ => &[],
    }
}

/// Their names.
pub(super) fn forms() -> Vec<&'static str> {
    FORMS.iter().map(|(name, _)| *name).collect()
}

/// Their names, each with the description in its file.
pub(super) fn gallery() -> String {
    let about = |text: &'static str| {
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix("about = \""));
        line.map_or("", |line| line.trim_end_matches('"'))
    };
    let each = FORMS
        .iter()
        .map(|(name, text)| format!("\n  {name:16} {}", about(text)));
    format!("Weak forms:{}", each.collect::<String>())
}

/// The CI pipeline that runs it.
const PIPELINE: &str = "\
# Runs the face-off on each change, and keeps the page. Copy it to .github/workflows/ of your repository.
name: face-off
on: [push, pull_request]
permissions:
  contents: read
jobs:
  verify:
    runs-on: ubuntu-latest
    container: debian:12
    steps:
      - uses: actions/checkout@11bd71901bbe5b1630ceea73d27597364c9af683 # v4.2.2
      - run: apt-get update && apt-get install -y --no-install-recommends freefem++ libfreefem++ python3-dolfinx ca-certificates curl build-essential git
      - run: curl -sSf https://sh.rustup.rs | sh -s -- -y
      - run: ~/.cargo/bin/cargo install --git https://github.com/OWNER/faceoff faceoff
      - run: ~/.cargo/bin/faceoff verify --run NAME.toml --report page --junit junit.xml
      - uses: actions/upload-artifact@ea165f8d65b6e75b540449e92b4886f43607fa02 # v4.6.2
        if: always()
        with:
          name: face-off
          path: page
";

/// Reads the name of an example; for the name of a form, the error names the option that takes it.
#[derive(Clone)]
pub(super) struct FromExample;

impl TypedValueParser for FromExample {
    type Value = Template;

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> std::result::Result<Template, clap::Error> {
        let examples = EnumValueParser::new();
        examples.parse_ref(command, arg, value).map_err(|error| {
            let Some(name) = forms().into_iter().find(|name| value == *name) else {
                return error;
            };
            let what = format!("`{name}` is a weak form: give --form {name} instead of --from");
            command.clone().error(ErrorKind::InvalidValue, what)
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let all = Template::value_variants();
        Some(Box::new(all.iter().filter_map(Template::to_possible_value)))
    }
}

pub(super) fn run(arguments: &New) -> Result<u8> {
    let folder = &arguments.name;
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let is_usual = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    if name.is_empty() || name.starts_with('.') || !name.chars().all(is_usual) {
        let what = format!("`{name}` cannot name a face-off");
        return Err(Error::usage(what, "use letters, digits, `-`, `_` and `.`"));
    }
    if folder.exists() {
        let what = format!("{} already exists", folder.display());
        return Err(Error::usage(what, "give another name, or remove it"));
    }
    let mesh = arguments.mesh.as_deref().map(own).transpose()?;
    let form = arguments.form.as_deref();
    let form = form.and_then(|name| FORMS.iter().find(|(known, _)| *known == name));
    if let (Some((name, mesh)), None) = (&mesh, form) {
        of_triangles(name, mesh)?;
    }
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    fs::create_dir_all(&parent).map_err(Error::io(&parent, "make"))?;
    let beside = tempfile::Builder::new()
        .prefix(".faceoff-new-")
        .tempdir_in(&parent)
        .map_err(Error::io(&parent, "write into"))?;
    let own = mesh.as_ref().map(|(name, mesh)| (&**name, mesh));
    let write = |name: &str, bytes: &[u8]| {
        let path = beside.path().join(name);
        fs::write(&path, bytes).map_err(Error::io(&path, "write"))
    };
    let file = format!("{name}.toml");
    let (template, parts) = match form {
        Some((template, text)) => {
            write(&file, renamed(text, template, &name, own).as_bytes())?;
            let parts = if own.is_none() { named(template) } else { &[] };
            (*template, parts)
        }
        None => arguments.from.parts(),
    };
    for (part, bytes) in parts {
        if *part == format!("{template}.toml") {
            let text = String::from_utf8_lossy(bytes);
            write(&file, renamed(&text, template, &name, own).as_bytes())?;
        } else if *part == "README.md" {
            let text = String::from_utf8_lossy(bytes).replace(&format!("{template}.toml"), &file);
            write(part, text.as_bytes())?;
        } else {
            write(part, bytes)?;
        }
    }
    // A form starts no programs named in the file.
    let pipeline = match form {
        Some(_) => PIPELINE.replace("verify --run", "verify"),
        None => PIPELINE.to_owned(),
    };
    write("ci.yml", pipeline.replace("NAME", &name).as_bytes())?;
    if let (Some((name, _)), Some(path)) = (&mesh, &arguments.mesh) {
        let to = beside.path().join(name);
        fs::copy(path, &to).map_err(Error::io(&to, "write"))?;
    }
    // A temporary folder is private to its owner; this one must not be.
    let made = beside.keep();
    let of_parent = fs::metadata(&parent).map_err(Error::io(&parent, "read"))?;
    fs::set_permissions(&made, of_parent.permissions()).map_err(Error::io(&made, "open"))?;
    fs::rename(&made, folder).map_err(Error::io(folder, "make"))?;
    if let Some((name, mesh)) = &mesh {
        note!("faceoff: {name} has {}", groups(mesh).join(", "));
        match form {
            Some(_) => note!(
                "faceoff: the form names the groups of its original mesh: replace them with yours"
            ),
            None => {
                note!(
                    "faceoff: the scripts name groups by the numbers of the template: replace them with yours"
                );
            }
        }
    }
    if !arguments.quiet {
        tell!(
            "faceoff verify {}{} --report {}",
            if form.is_some() { "" } else { "--run " },
            folder.join(file).display(),
            folder.join("page").display()
        );
    }
    Ok(DONE)
}

/// The user's mesh, by its name.
pub(super) fn own(path: &Path) -> Result<(String, Mesh)> {
    let mesh = io::open(path, crate::engine::meshio_python().as_deref())?.mesh;
    let name = path.file_name().unwrap_or_default();
    Ok((name.to_string_lossy().into_owned(), mesh))
}

/// Checks that the scripts of all templates can read this mesh.
fn of_triangles(name: &str, mesh: &Mesh) -> Result<()> {
    let dim = mesh.blocks.iter().map(|block| block.kind.dim()).max();
    let cells = mesh.blocks.iter().map(|block| block.kind);
    let other = cells.filter(|kind| Some(kind.dim()) == dim);
    match other.into_iter().find(|kind| *kind != CellKind::Triangle) {
        None => Ok(()),
        Some(kind) => {
            let what = format!(
                "{name} has cells of kind {kind}, and the scripts of the templates read straight triangles: FreeFEM has no \
                 quadrangles, and the equations are written for the plane"
            );
            let remedy = "give a mesh of triangles; or leave out --mesh, and name your mesh and codes that read it in the file";
            Err(Error::usage(what, remedy))
        }
    }
}

/// Each group with its number and size.
pub(super) fn groups(mesh: &Mesh) -> Vec<String> {
    let told = mesh.groups.iter().map(|group| {
        let name = group.name.as_deref().unwrap_or("group");
        format!(
            "{name} = {} ({} cells of dimension {})",
            group.tag,
            group.cells.len(),
            group.dim
        )
    });
    let all: Vec<String> = told.collect();
    if all.is_empty() {
        vec!["no groups".into()]
    } else {
        all
    }
}

/// The template's file for a face-off of this name, on this mesh.
fn renamed(text: &str, template: &str, name: &str, own: Option<(&str, &Mesh)>) -> String {
    let text = text.replacen(
        &format!("name = \"{template}\""),
        &format!("name = \"{name}\""),
        1,
    );
    let Some((file, mesh)) = own else {
        return text;
    };
    let mut lines = Vec::new();
    let mut in_mesh = false;
    for line in text.lines() {
        if line.starts_with('[') {
            in_mesh = line.starts_with("[mesh]");
            lines.push(line.to_owned());
            if in_mesh {
                lines.push(format!("file = {file:?}"));
                lines.extend(groups(mesh).iter().map(|group| format!("# {group}")));
                lines.push(String::new());
            }
        } else if !in_mesh {
            lines.push(line.to_owned());
        }
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gallery_is_its_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/forms");
        let mut there: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        there.sort();
        let mut known: Vec<String> = Vec::new();
        for name in forms() {
            known.push(format!("{name}.toml"));
            known.extend(named(name).iter().map(|(part, _)| (*part).to_owned()));
        }
        known.sort();
        assert_eq!(there, known);
    }

    #[test]
    fn templates_are_their_folders() {
        for template in Template::value_variants() {
            let (name, parts) = template.parts();
            let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("examples")
                .join(name);
            let mut there: Vec<String> = fs::read_dir(folder)
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .filter(|name| !name.starts_with("__"))
                .collect();
            there.sort();
            assert_eq!(
                there,
                parts.iter().map(|(name, _)| *name).collect::<Vec<_>>()
            );
        }
    }
}
