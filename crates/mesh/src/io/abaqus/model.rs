//! The contents of files, before they are converted to a mesh.

use crate::mesh::CellKind;

/// A member of a set: a number, or the name of an earlier set in capitals. Either may name an instance.
#[derive(Debug, Clone)]
pub enum Member {
    Number(Option<String>, u64),
    Range(Option<String>, [u64; 3]),
    Set(Option<String>, String),
}

/// A set of nodes or of elements.
#[derive(Debug, Clone)]
pub struct Set {
    pub name: String,
    pub of_nodes: bool,
    pub members: Vec<Member>,
}

/// Sides of elements: a set or an element, and which side; of nodes without one.
#[derive(Debug, Clone)]
pub struct Surface {
    pub name: String,
    pub of_nodes: bool,
    pub sides: Vec<(Member, String)>,
}

#[derive(Debug, Clone)]
pub struct Element {
    pub number: u64,
    pub kind: CellKind,
    pub shell: bool,
    pub nodes: Vec<u64>,
}

/// Nodes and elements with their own numbers.
#[derive(Debug, Default)]
pub struct Part {
    pub name: String,
    pub numbers: Vec<u64>,
    pub points: Vec<[f64; 3]>,
    pub elements: Vec<Element>,
    pub sets: Vec<Set>,
    pub surfaces: Vec<Surface>,
}

/// An instance of a part; it may have its own nodes and elements.
#[derive(Debug, Default)]
pub struct Instance {
    pub name: String,
    /// The name of the part in capitals.
    pub part: String,
    pub own: Part,
    pub shift: [f64; 3],
    /// Two points on an axis and an angle in degrees.
    pub turn: Option<[f64; 7]>,
}
