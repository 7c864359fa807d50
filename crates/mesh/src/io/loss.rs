//! Data that a format cannot store are never dropped silently.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::Path;

use crate::error::{Error, Result};
use crate::mesh::{CellKind, Field, Group, Mesh, Partitions, Support};

/// Collects what a target format cannot hold.
#[derive(Default)]
pub struct Losses {
    /// Cells, groups, names, fields, labels: an error, or a warning each when the user allows it.
    losses: Vec<String>,
    /// Data that accompany a mesh without being part of it, such as the numbers of its points: one warning each.
    notes: Vec<String>,
    /// What is said to hold no more, in messages.
    pub title: String,
    /// Whether a loss is a warning.
    pub lossy: bool,
}

impl Losses {
    pub fn lose(&mut self, what: impl Into<String>) {
        self.losses.push(what.into());
    }

    /// Loses a whole field.
    pub fn lose_field(&mut self, name: &str, on: Support) {
        self.lose(format!("the field {name:?} on {on}"));
    }

    /// Loses all fields.
    pub fn lose_fields<'a>(&mut self, fields: impl IntoIterator<Item = &'a Field>) {
        for field in fields {
            self.lose_field(&field.name, field.on);
        }
    }

    /// Loses the blocks of cells of kinds that a format lacks.
    pub fn lose_blocks(&mut self, mesh: &Mesh, has: impl Fn(CellKind) -> bool) {
        for block in mesh.blocks.iter().filter(|block| !has(block.kind)) {
            self.lose(format!("{} {} cells", block.len(), block.kind));
        }
    }

    /// Notes that a field has a value everywhere in the file, and not here.
    pub fn note_gaps(&mut self, field: &str, on: impl Display) {
        self.note(format!(
            "the field {field:?} is NaN on the {on} that lack it"
        ));
    }

    /// [`Losses::lose`] where `count` is not 0.
    pub fn lose_some(&mut self, count: usize, what: &str) {
        if count > 0 {
            self.lose(format!("{count} {what}"));
        }
    }

    pub fn note(&mut self, what: impl Into<String>) {
        self.notes.push(what.into());
    }

    /// Notes that a group has another name in the file than its own.
    pub fn called(&mut self, group: &Group, name: &str) {
        let Group { tag, dim, .. } = group;
        let own = match &group.name {
            Some(own) => format!(", {own:?},"),
            None => " has no name and".to_owned(),
        };
        self.note(format!(
            "the group {tag} of dimension {dim}{own} is called {name:?}"
        ));
    }

    /// Loses the groups without cells.
    pub fn lose_empty(&mut self, mesh: &Mesh) {
        let empty = mesh.groups.iter().filter(|group| group.cells.is_empty());
        self.lose_some(empty.count(), "groups without cells");
    }

    /// Notes the cells that become one where a format has sides of others in their place: each cell with its side.
    pub fn note_twice(&mut self, sides: impl Iterator<Item = (u32, (u32, usize))>) {
        let sides: BTreeMap<u32, (u32, usize)> = sides.collect();
        let places: BTreeSet<&(u32, usize)> = sides.values().collect();
        if places.len() < sides.len() {
            let twice = sides.len() - places.len();
            self.note(format!(
                "{twice} cells that lie on others become one with them"
            ));
        }
    }

    /// Notes what only Gmsh's format holds of a mesh.
    pub fn note_gmsh(&mut self, mesh: &Mesh) {
        if !mesh.point_tags.is_empty() {
            self.note("points are renumbered");
        }
        if mesh.blocks.iter().any(|block| !block.tags.is_empty()) {
            self.note("cells are renumbered");
        }
        self.note_geometry(mesh);
    }

    /// [`Losses::note_gmsh`] for a format that holds the numbers of points and cells.
    pub fn note_geometry(&mut self, mesh: &Mesh) {
        let reversed = mesh.geometry.entities.iter();
        let reversed = reversed.filter(|entity| entity.is_reversed()).count();
        if reversed > 0 {
            self.note(format!(
                "that {reversed} entities are reversed in their groups is not written"
            ));
        }
        let links = mesh.geometry.periodic.len();
        if links > 0 {
            self.note(format!("{links} periodic links are not written"));
        }
        if mesh.geometry.partitions != Partitions::default() {
            self.note("the partitions of cells are not written");
        }
    }

    /// Saves what was made; the warnings to give.
    ///
    /// # Errors
    /// Something would be lost and that is not allowed; those of `save`.
    pub fn settle(self, path: &Path, save: impl FnOnce() -> Result<()>) -> Result<Vec<String>> {
        let title = self.title;
        if !self.lossy && !self.losses.is_empty() {
            let what = format!("{title} cannot hold {}", self.losses.join("; "));
            let remedy = "choose another format, or allow the loss with --lossy";
            return Err(Error::whole(path, what, remedy));
        }
        save()?;
        let lost = self.losses.into_iter();
        let lost = lost.map(|what| format!("{title} does not hold {what}"));
        Ok(lost.chain(self.notes).collect())
    }
}
