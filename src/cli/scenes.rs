//! `faceoff scenes`: the built-in scenes and their purpose.

use serde::Serialize;

use super::DONE;
use crate::report::model::{Report, Table, cells};
use crate::report::{Output, deliver};
use crate::text::{Text, text};
use faceoff_fem::scene::Scene;
use faceoff_form::elastic;
use faceoff_mesh::error::Result;

#[derive(Serialize)]
struct BuiltIn {
    name: &'static str,
    about: String,
}

#[derive(Serialize)]
struct Told {
    scenes: Vec<BuiltIn>,
}

pub(super) fn run(to: &Output) -> Result<u8> {
    let all = Scene::catalogue().into_iter();
    let elastic = elastic::catalogue().map(|(name, about)| (name, about.to_owned()));
    let all = all.chain(elastic);
    let scenes = all.map(|(name, about)| BuiltIn { name, about }).collect();
    let told = Told { scenes };
    let question = "faceoff scenes: which scenes are built in?";
    let first: Vec<&str> = Scene::builtin_names().collect();
    let headline = text!("`verify` runs {}; all others by name", first.join(", "));
    let mut report = Report::new("scenes", question, headline, &told)?;
    let rows = told
        .scenes
        .iter()
        .map(|s| cells![s.name, Text::message(&s.about)]);
    let table = Table::new("", ["scene", "what it is"]).with(rows);
    report.story.rest.push(table.into());
    deliver(&report, to)?;
    Ok(DONE)
}
