//! `faceoff completions` and `faceoff man`: the command line for shells and for the manual.

use std::fs;

use clap::CommandFactory;

use super::DONE;
use super::args::{Arguments, Completions, Man};
use crate::report::console;
use faceoff_mesh::error::{Error, Result};

pub(super) fn completions(arguments: &Completions) -> Result<u8> {
    let mut script = Vec::new();
    clap_complete::generate(
        arguments.shell,
        &mut Arguments::command(),
        "faceoff",
        &mut script,
    );
    console::write(&String::from_utf8_lossy(&script));
    Ok(DONE)
}

pub(super) fn man(arguments: &Man) -> Result<u8> {
    let dir = &arguments.dir;
    fs::create_dir_all(dir).map_err(Error::io(dir, "make"))?;
    let command = Arguments::command();
    clap_mangen::generate_to(command, dir).map_err(Error::io(dir, "write into"))?;
    Ok(DONE)
}
