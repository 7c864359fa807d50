//! `faceoff matrix`: a file names releases of codes, scenes and methods; a folder keeps page, badges and history.

use std::path::Path;

use serde::Deserialize;

use super::args::Matrix;
use super::code;
use super::progress::watched;
use super::verify::may_start;
use super::words::methods;
use crate::campaigns::matrix::{MatrixRequest, check, matrix};
use crate::engine::{EngineFile, parsed};
use crate::report::{self, Output, deliver};
use crate::run::is_elastic;
use faceoff_mesh::error::{Error, Place, Result};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    scenes: Vec<String>,
    #[serde(default = "usual")]
    methods: Vec<String>,
    #[serde(default)]
    n: Vec<u32>,
    releases: Vec<EngineFile>,
}

fn usual() -> Vec<String> {
    ["cr", "p2"].map(str::to_owned).to_vec()
}

const REMEDY: &str = "give `scenes`, and for each code [[releases]] with `name`, `companion` or `command`, and `within`";

pub(super) fn run(arguments: &Matrix, to: &Output) -> Result<u8> {
    let path = &arguments.file;
    let file: File = parsed(path, REMEDY)?;
    let refuse = |what: String| Error::file(path, Place::Whole, what, REMEDY);
    let home = path.parent().unwrap_or(Path::new(""));
    let beside = |name: &String| match name.ends_with(".toml") {
        true => home.join(name).to_string_lossy().into_owned(),
        false => name.clone(),
    };
    let scenes: Vec<String> = file.scenes.iter().map(beside).collect();
    if file.methods.is_empty() || file.n.contains(&0) {
        return Err(refuse("`methods` is empty, or `n` has a 0".into()));
    }
    if let Some(name) = scenes.iter().find(|name| is_elastic(name.as_ref())) {
        let what = format!("{name} is a scene of elasticity, and matrix is for the scalar problem");
        let remedy = format!(
            "where one release is installed, run: faceoff verify {name} --methods cr --record DIR; and where the other is: faceoff verify {name} --methods cr --against DIR"
        );
        return Err(Error::usage(what, remedy));
    }
    let request = MatrixRequest {
        scenes: arguments.trust.scenes(&scenes)?,
        methods: methods(&file.methods.join(",")).map_err(refuse)?.0,
        n: file.n.iter().map(|&n| n as usize).collect(),
        releases: file.releases,
        path: path.clone(),
    };
    check(&request)?;
    let programs = request.releases.iter().filter_map(EngineFile::program);
    may_start("matrix", path, arguments.run, programs)?;
    let past = to.report.map_or(Ok(Vec::new()), report::past)?;
    let outcome = watched(&[], vec![], to.quiet, |progress| matrix(&request, progress))?;
    deliver(&report::matrix(&outcome, past)?, to)?;
    if let Some(folder) = to.report {
        for (place, cell) in report::matrix_cells(&outcome)? {
            report::write_page(&cell, folder, &report::cell_name(place))?;
        }
    }
    Ok(code(outcome.verdict))
}
