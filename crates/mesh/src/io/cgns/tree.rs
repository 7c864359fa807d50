//! The tree of nodes that a CGNS file is, on HDF5 or ADF.

use std::path::Path;

use super::adf;
use crate::cancel;
use crate::error::{Error, Result};
use crate::field::{Tell, Unread};
use crate::io::hdf5;
use crate::io::raw::{self, RawNumbers};
use crate::mesh::Values;

/// A node with a name, a label that defines its kind, and perhaps data.
pub enum Node<'a> {
    Hdf5(hdf5::Group, String),
    Adf(&'a adf::File<'a>, adf::Node),
}

impl<'a> Node<'a> {
    pub fn refuse(&self, what: impl Into<String>) -> Error {
        match self {
            Node::Hdf5(group, _) => group.refuse(what),
            Node::Adf(file, node) => file.refuse(0, format!("{}: {}", node.name, what.into())),
        }
    }

    pub fn name(&self) -> &str {
        match self {
            Node::Hdf5(_, name) => name,
            Node::Adf(_, node) => &node.name,
        }
    }

    pub fn label(&self) -> String {
        match self {
            Node::Hdf5(group, _) => group.text("label").unwrap_or_default(),
            Node::Adf(_, node) => node.label.clone(),
        }
    }

    pub fn children(&self) -> Result<Vec<Node<'a>>> {
        match self {
            Node::Hdf5(group, _) => {
                let groups = group.groups()?.into_iter();
                Ok(groups
                    .map(|(name, group)| Node::Hdf5(group, name))
                    .collect())
            }
            Node::Adf(file, node) => {
                let nodes = file.children(node)?.into_iter();
                Ok(nodes.map(|node| Node::Adf(file, node)).collect())
            }
        }
    }

    /// The children with this label.
    pub fn labelled(&self, label: &str) -> Result<Vec<Node<'a>>> {
        let mut children = self.children()?;
        children.retain(|child| child.label() == label);
        Ok(children)
    }

    /// The child of this name.
    pub fn child(&self, name: &str) -> Result<Option<Node<'a>>> {
        Ok(self
            .children()?
            .into_iter()
            .find(|child| child.name() == name))
    }

    /// Lengths of the dimensions of its data, the first running fastest.
    pub fn shape(&self) -> Result<Vec<usize>> {
        match self {
            Node::Hdf5(group, _) => {
                let mut shape = group.data(" data")?.map_or(Vec::new(), |data| data.shape());
                shape.reverse();
                Ok(shape)
            }
            Node::Adf(_, node) => Ok(node.shape.clone()),
        }
    }

    /// Its numbers as they lie in the file; characters are bytes.
    pub fn raw(&self) -> Result<Option<RawNumbers<'a>>> {
        match self {
            Node::Hdf5(group, _) => group.data(" data")?.map(|data| data.raw(None)).transpose(),
            Node::Adf(file, node) => file.raw(node),
        }
    }

    pub fn values(&self) -> Result<Option<Values>> {
        Ok(self.raw()?.map(|numbers| numbers.values()))
    }

    /// The integers of the child of this name; none if there is none.
    pub fn integers_of(&self, name: &str) -> Result<Vec<i64>> {
        match self.child(name)? {
            Some(child) => child.integers(),
            None => Ok(Vec::new()),
        }
    }

    /// The numbers of the child of this name; none if there are none.
    pub fn numbers_of(&self, name: &str) -> Result<Vec<f64>> {
        let values = match self.child(name)? {
            Some(child) => child.values()?,
            None => None,
        };
        Ok(values.map_or(Vec::new(), |values| values.to_f64()))
    }

    /// The integers of this node.
    pub fn integers(&self) -> Result<Vec<i64>> {
        let numbers = self.raw()?.map(|numbers| numbers.integers());
        let numbers = numbers.unwrap_or(Some(Vec::new()));
        numbers.ok_or_else(|| self.refuse("it does not contain integers"))
    }

    /// The texts of `width` bytes in this node; one of all bytes if it is 0.
    pub fn texts(&self, width: usize) -> Result<Vec<String>> {
        let bytes = match self.values()? {
            Some(Values::U8(bytes)) => bytes,
            Some(Values::I8(bytes)) => bytes.iter().map(|byte| *byte as u8).collect(),
            _ => Vec::new().into(),
        };
        let width = if width == 0 {
            bytes.len().max(1)
        } else {
            width
        };
        Ok(bytes.chunks(width).map(raw::text).collect())
    }

    /// Adds the numbers of this node and of those below that have not been read, and links; of a name that already exists the
    /// reader has reported why. `at` is where it is.
    pub fn unread(&self, at: &str, unread: &mut Vec<Unread>) -> Result<()> {
        cancel::check()?;
        if HARMLESS.contains(&&*self.label()) {
            return Ok(());
        }
        let at = format!("{at}/{}", self.name());
        // Characters describe.
        let (links, is_unread) = match self {
            Node::Hdf5(group, _) => {
                let is_text = group.text("type").is_some_and(|kind| kind == "C1");
                let data = group.data(" data")?;
                let is_unread = data.is_some_and(|data| data.is_unread());
                (group.links()?, is_unread && !is_text)
            }
            Node::Adf(_, node) if node.kind == "LK" => {
                let texts = self.texts(0)?;
                (vec![(self.name().to_owned(), texts.concat())], false)
            }
            Node::Adf(file, node) => (Vec::new(), node.kind != "C1" && file.is_unread(node)),
        };
        let is_told = unread.iter().any(|one| one.name == self.name());
        if is_unread && !is_told {
            let what = format!("the node {at}, which has no place in a mesh");
            unread.tell(self.name(), what);
        }
        for (name, target) in links {
            let what = format!("the link {at}/{name} to {target}");
            let own = [" link", " data"].contains(&&*name);
            let name = if own { self.name() } else { &name };
            unread.push(Unread::outside(name, what));
        }
        self.children()?
            .iter()
            .try_for_each(|child| child.unread(&at, unread))
    }

    /// Its text, if it has one.
    pub fn text(&self) -> Result<Option<String>> {
        let text = self.texts(0)?.into_iter().next();
        Ok(text.filter(|text| !text.is_empty()))
    }

    /// The text of the child with this name.
    pub fn text_of(&self, name: &str) -> Result<Option<String>> {
        match self.child(name)? {
            Some(child) => child.text(),
            None => Ok(None),
        }
    }
}

/// Labels of nodes that are about units, versions and the order of things.
const HARMLESS: [&str; 9] = [
    "CGNSLibraryVersion_t",
    "DataClass_t",
    "DataConversion_t",
    "Descriptor_t",
    "DimensionalExponents_t",
    "DimensionalUnits_t",
    "AdditionalUnits_t",
    "BaseIterativeData_t",
    "Ordinal_t",
];

/// The root of an HDF5 file.
pub fn of_hdf5<'a>(path: &Path, bytes: &[u8]) -> Result<Node<'a>> {
    Ok(Node::Hdf5(hdf5::open(path, bytes)?, String::new()))
}
