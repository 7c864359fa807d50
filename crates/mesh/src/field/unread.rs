//! The parts of a file that its reader did not read.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A part of a file that was not read, so that nothing can be concluded about it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unread {
    /// The file's name for it: of a field, a section, a data set.
    pub name: String,
    /// A description, the place, and the reason why it was not read.
    pub what: String,
    /// Whether it is not in the file itself, which only names it.
    #[serde(skip)]
    pub is_outside: bool,
}

impl Unread {
    /// The part `name`, described by `what`.
    pub fn new(name: impl Into<String>, what: impl Into<String>) -> Self {
        Unread {
            name: name.into(),
            what: what.into(),
            is_outside: false,
        }
    }

    /// The part `name` that the file only names, described by `what`.
    pub fn outside(name: impl Into<String>, what: impl Into<String>) -> Self {
        Unread {
            is_outside: true,
            ..Unread::new(name, what)
        }
    }
}

/// A list of what was not read.
pub trait Tell {
    /// Adds the part `name`, described by `what`.
    fn tell(&mut self, name: impl Into<String>, what: impl Into<String>);
    /// [`Tell::tell`], unless the list has it already.
    fn tell_once(&mut self, name: impl Into<String>, what: impl Into<String>);
}

impl Tell for Vec<Unread> {
    fn tell(&mut self, name: impl Into<String>, what: impl Into<String>) {
        self.push(Unread::new(name, what));
    }

    fn tell_once(&mut self, name: impl Into<String>, what: impl Into<String>) {
        let unread = Unread::new(name, what);
        if !self.contains(&unread) {
            self.push(unread);
        }
    }
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}

impl PartialEq<&str> for Unread {
    fn eq(&self, what: &&str) -> bool {
        self.what == *what
    }
}
