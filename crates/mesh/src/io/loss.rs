//! Data that a format cannot store are never dropped silently.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::error::{Error, Result};
use crate::mesh::{Group, Mesh, Partitions, Support};

/// Collects what a target format cannot hold.
#[derive(Default)]
pub struct Losses {
    /// Cells, groups, names, fields, labels: an error, or a warning each when the user allows it.
    losses: Vec<String>,
    /// Data that accompany a mesh without being part of it, such as the numbers of its points: one warning each.
    notes: Vec<String>,
}

impl Losses {
    pub fn lose(&mut self, what: impl Into<String>) {
        self.losses.push(what.into());
    }

    /// Loses a whole field.
    pub fn lose_field(&mut self, name: &str, on: Support) {
        self.lose(format!("the field {name:?} on {on}"));
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

    /// The warnings to give.
    ///
    /// # Errors
    /// Something would be lost and `lossy` does not allow it.
    pub fn settle(self, path: &Path, format: &str, lossy: bool) -> Result<Vec<String>> {
        if lossy || self.losses.is_empty() {
            let lost = self
                .losses
                .into_iter()
                .map(|what| format!("{format} does not hold {what}"));
            return Ok(lost.chain(self.notes).collect());
        }
        let what = self.losses.join("; ");
        Err(Error::whole(
            path,
            format!("{format} cannot hold {what}"),
            "choose another format, or allow the loss with --lossy",
        ))
    }
}
