//! `faceoff completions` and `faceoff man`: the command line for shells and for the manual.

use std::fs;

use super::DONE;
use super::args::{Completions, Man};
use super::help::plain;
use crate::report::console;
use faceoff_mesh::error::{Error, Result};

pub(super) fn completions(arguments: &Completions) -> Result<u8> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut plain(), "faceoff", &mut script);
    console::write(&String::from_utf8_lossy(&script));
    Ok(DONE)
}

pub(super) fn man(arguments: &Man) -> Result<u8> {
    let dir = &arguments.dir;
    fs::create_dir_all(dir).map_err(Error::io(dir, "make"))?;
    let command = plain();
    clap_mangen::generate_to(command, dir).map_err(Error::io(dir, "write into"))?;
    Ok(DONE)
}
