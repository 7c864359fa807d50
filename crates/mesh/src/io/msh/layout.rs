//! Common to the readers of all sections of an MSH file: the version's layout, and the place reached.

use crate::io::Content;
use crate::io::builder::Builder;
use crate::io::scan::{Numbers, Scan};

/// The layouts of the versions that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Layout {
    V1,
    /// 2.0 and 2.1: the third tag of an element is its partition.
    V2,
    /// 2.2: the third tag of an element is the number of its partitions.
    V22,
    /// 3.0, as text: a node has the entity that it lies on, an element the number of its nodes.
    V30,
    V40,
    V41,
}

pub struct Reader<'a> {
    pub scan: Scan<'a>,
    pub layout: Option<Layout>,
    /// How the numbers of the file are written, but for the sections that are text in all files.
    pub numbers: Numbers,
    pub version: String,
    pub builder: Builder,
    pub content: Content,
    /// Where periodic links are that come before the nodes they name.
    pub waiting: Vec<Scan<'a>>,
}

impl<'a> Reader<'a> {
    pub fn parts(&mut self) -> (&mut Scan<'a>, &mut Builder, &mut Content) {
        (&mut self.scan, &mut self.builder, &mut self.content)
    }
}
