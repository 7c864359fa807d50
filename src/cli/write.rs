//! `faceoff write`: a form as a script for one code, to run by hand and to keep.

use std::path::Path;

use super::DONE;
use super::args::Write;
use crate::engine::quoted;
use crate::report::console::{output, tell};
use crate::run::{FormFile, is_elastic};
use faceoff_form::codes::Code;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::{self, Temporary};
use faceoff_mesh::io::save;

pub(super) fn run(arguments: &Write) -> Result<u8> {
    let by_hand = Code::by_hand(&arguments.code).filter(|_| is_elastic(&arguments.form));
    let code = by_hand.or_else(|| Code::of_name(&arguments.code));
    let code = code.ok_or_else(|| {
        let what = format!("no scripts are written for a code `{}`", arguments.code);
        Error::usage(what, "`faceoff write --help` lists the codes")
    })?;
    let form = FormFile::read(
        &arguments.form,
        &arguments.method,
        arguments.n.map(|n| n as usize),
    )?;
    let name = code.mesh_file(&form.problem, form.mesh_file.as_deref());
    let script = code
        .script_reading(&form.problem, &name, arguments.system)
        .map_err(|what| Error::engine(code.name, what, "take another space or code"))?;
    let Some(out) = &arguments.out else {
        output(format_args!("{script}"));
        return Ok(DONE);
    };
    let path = match out.is_dir() {
        true => out.join(code.file(&form.problem)),
        false => out.clone(),
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mesh = folder.join(name);
    let bytes = mesh_bytes(code, &form, &mesh)?;
    save(&mesh, [bytes.as_slice()])?;
    save(&path, [script.as_bytes()])?;
    if arguments.quiet {
        return Ok(DONE);
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut words: Vec<&str> = code.command.to_vec();
    words.push(&name);
    let typed = quoted(&words);
    match folder == Path::new(".") {
        true => tell!("{typed}"),
        false => tell!("cd {} && {typed}", quoted(&[folder.display().to_string()])),
    }
    Ok(DONE)
}

/// The mesh that the script reads, which never replaces another file at its place.
fn mesh_bytes(code: &Code, form: &FormFile, path: &Path) -> Result<Vec<u8>> {
    let beside = Temporary::new()?;
    let written = code.write_mesh(beside.path(), &form.problem, &form.mesh)?;
    let bytes = file::read(&written)?;
    if path.exists() && file::read(path)? != bytes {
        let what = format!(
            "{} is another mesh than the script is to read",
            path.display()
        );
        return Err(Error::usage(
            what,
            "move it, or write the script into another folder",
        ));
    }
    Ok(bytes)
}
