//! XML as a tree of elements, each with its place. No entities are expanded but those that XML itself has.

use std::borrow::Cow;

use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// Far beyond any real file: VTK itself nests seven deep.
pub const DEPTH: usize = 64;
const ATTRIBUTES: usize = 128;
const ELEMENTS: usize = 1 << 20;

/// A byte of the text, and what is wrong there.
pub type Fault = (u64, String);

pub struct Tree<'a> {
    /// In the order of the file; the first stands for the whole file.
    pub elements: Vec<Element<'a>>,
    /// Those that do not end, the outermost first.
    pub open: Vec<usize>,
    /// Where the first text is that is in none of them.
    pub stray: Option<u64>,
}

#[derive(Default)]
pub struct Element<'a> {
    /// Without the prefix of a name space.
    pub name: String,
    pub byte: u64,
    /// References resolved.
    pub attributes: Vec<(String, String)>,
    /// The text between the tags, starting with the first that is not blank.
    pub texts: Vec<Cow<'a, str>>,
    pub children: Vec<usize>,
    /// The error in its attributes.
    pub broken: Option<String>,
}

impl Element<'_> {
    /// The value of an attribute.
    pub fn exact(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }

    /// The value of an attribute whose name is in any case, without blanks around it.
    pub fn get(&self, name: &str) -> Option<&str> {
        let mut all = self.attributes.iter();
        let found = all.find(|(known, _)| known.eq_ignore_ascii_case(name));
        found.map(|(_, value)| value.trim())
    }

    pub fn text(&self) -> Cow<'_, str> {
        match &self.texts[..] {
            [one] => Cow::Borrowed(one),
            several => Cow::Owned(several.concat()),
        }
    }

    pub fn fault(&self, what: impl Into<String>) -> Fault {
        (self.byte, what.into())
    }

    /// # Errors
    /// Its attributes are broken.
    pub fn check(&self) -> Result<(), Fault> {
        let broken = self.broken.clone();
        broken.map_or(Ok(()), |what| Err(self.fault(what)))
    }
}

/// The elements of a text, which may end before they do.
pub fn parse(text: &str) -> Result<Tree<'_>, Fault> {
    let mut reader = Reader::from_str(text);
    let mut tree = Tree {
        elements: vec![Element::default()],
        open: Vec::new(),
        stray: None,
    };
    loop {
        let byte = reader.buffer_position();
        let event = reader.read_event().map_err(|error| {
            let what = format!("not well-formed XML: {error}");
            // An earlier error is more useful.
            let earlier = tree
                .elements
                .iter()
                .find_map(|element| element.check().err());
            earlier.unwrap_or((reader.error_position(), what))
        })?;
        if matches!(event, Event::Eof) {
            return Ok(tree);
        }
        tree.take(event, byte).map_err(|what| (byte, what))?;
    }
}

impl<'a> Tree<'a> {
    /// The elements in one.
    pub fn inside(&self, element: &Element<'a>) -> impl Iterator<Item = &Element<'a>> {
        element.children.iter().map(|&child| &self.elements[child])
    }

    fn take(&mut self, event: Event<'a>, byte: u64) -> Result<(), String> {
        match event {
            Event::Start(tag) => {
                if self.open.len() >= DEPTH {
                    return Err(format!("elements are nested more than {DEPTH} deep"));
                }
                let element = self.add(&tag, byte)?;
                self.open.push(element);
            }
            Event::Empty(tag) => drop(self.add(&tag, byte)?),
            Event::End(_) => drop(self.open.pop()),
            Event::Text(text) => self.text(text.into_inner(), byte),
            Event::CData(text) => self.text(text.into_inner(), byte),
            Event::GeneralRef(reference) => {
                let letter = reference.resolve_char_ref().ok().flatten();
                let letter = letter.map(String::from);
                let name = reference.into_inner();
                let known = resolve_predefined_entity(&name).map(str::to_owned);
                let text = letter.or(known);
                let text = text.ok_or_else(|| format!("the reference &{name}; is not expanded"))?;
                self.text(text.into(), byte);
            }
            // Only a document type declares entities; those that hold no declarations are harmless.
            Event::DocType(text) if text.contains("<!ENTITY") => {
                return Err("a document type that declares entities is not read".into());
            }
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: Cow<'a, str>, byte: u64) {
        let is_blank = text.bytes().all(|byte| byte.is_ascii_whitespace());
        match self.open.last() {
            None if !is_blank => drop(self.stray.get_or_insert(byte)),
            Some(&last) if !is_blank || !self.elements[last].texts.is_empty() => {
                self.elements[last].texts.push(text);
            }
            _ => {}
        }
    }

    fn add(&mut self, tag: &BytesStart<'_>, byte: u64) -> Result<usize, String> {
        let (attributes, broken) = attributes(tag);
        let number = self.elements.len();
        if number > ELEMENTS {
            return Err(format!("there are more than {ELEMENTS} elements"));
        }
        let around = self.open.last().copied().unwrap_or(0);
        self.elements[around].children.push(number);
        self.elements.push(Element {
            name: tag.local_name().into_inner().to_owned(),
            byte,
            attributes,
            broken,
            ..Element::default()
        });
        Ok(number)
    }
}

/// The attributes of a tag up to the first that is broken, and what is wrong with that.
fn attributes(tag: &BytesStart<'_>) -> (Vec<(String, String)>, Option<String>) {
    let mut found = Vec::new();
    // The check for duplicate attributes is quadratic; the bound below keeps the list short.
    for attribute in tag.attributes().with_checks(false) {
        let attribute = match attribute {
            Ok(attribute) if found.len() < ATTRIBUTES => attribute,
            Ok(_) => {
                let what = format!("an element has more than {ATTRIBUTES} attributes");
                return (found, Some(what));
            }
            Err(error) => return (found, Some(format!("a broken attribute: {error}"))),
        };
        let name = attribute.key.into_inner();
        match attribute.normalized_value(XmlVersion::Implicit1_0) {
            Ok(value) => found.push((name.to_owned(), value.into_owned())),
            Err(error) => return (found, Some(format!("attribute {name:?}: {error}"))),
        }
    }
    (found, None)
}

/// The attributes of a single tag, as far as they are sound.
pub fn attributes_of(tag: &str) -> Vec<(String, String)> {
    let name = tag.find(|c: char| c.is_ascii_whitespace());
    attributes(&BytesStart::from_content(tag, name.unwrap_or(tag.len()))).0
}
