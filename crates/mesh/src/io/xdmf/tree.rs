//! The XML of an XDMF file as a tree, and the paths by which its elements refer to others.

use crate::io::xml::{self, DEPTH, Element};

/// All elements of a file; the root is the first.
pub struct Tree<'a> {
    elements: Vec<Element<'a>>,
}

impl<'a> Tree<'a> {
    /// # Errors
    /// The error in the XML.
    pub fn parse(text: &'a str) -> Result<Self, String> {
        let tree = xml::parse(text).and_then(|tree| {
            tree.elements.iter().try_for_each(Element::check)?;
            Ok(tree)
        });
        let tree = tree.map_err(|(_, what)| what)?;
        match tree.open.is_empty() {
            true => Ok(Tree {
                elements: tree.elements,
            }),
            false => Err("the XML ends too early".into()),
        }
    }

    pub fn at(&self, element: usize) -> &Element<'a> {
        &self.elements[element]
    }

    /// The elements of this name below the root, wherever they are.
    pub fn all(&self, tag: &str) -> Vec<usize> {
        (0..self.elements.len())
            .filter(|&k| self.elements[k].name == tag)
            .collect()
    }

    /// The elements in one, with those that are included from elsewhere, each as what it refers to.
    ///
    /// # Errors
    /// A reference that leads nowhere or in a circle.
    pub fn children(&self, element: usize) -> Result<Vec<usize>, String> {
        let mut all = Vec::new();
        for &child in &self.elements[element].children {
            if self.elements[child].name == "include" {
                let path = self.elements[child].get("xpointer").unwrap_or_default();
                let inner = path
                    .strip_prefix("xpointer(")
                    .and_then(|path| path.strip_suffix(')'));
                let found = self.find(inner.unwrap_or(path), child)?;
                all.extend(found.into_iter().filter(|&k| k != element));
            } else {
                all.push(self.resolve(child)?);
            }
        }
        Ok(all)
    }

    /// The children of this name.
    pub fn named(&self, element: usize, tag: &str) -> Result<Vec<usize>, String> {
        let mut all = self.children(element)?;
        all.retain(|&child| self.elements[child].name == tag);
        Ok(all)
    }

    /// The element to which a `Reference` refers.
    fn resolve(&self, element: usize) -> Result<usize, String> {
        let mut at = element;
        for _ in 0..DEPTH {
            let here = &self.elements[at];
            let Some(path) = here.get("Reference") else {
                return Ok(at);
            };
            let text = here.text();
            let path = if path == "XML" { text.trim() } else { path };
            let found = self.find(path, at)?;
            at = *found
                .first()
                .ok_or_else(|| format!("the reference {path:?} leads nowhere"))?;
        }
        Err("references lead in a circle".into())
    }

    /// The elements at a path of XPath: steps of names or `*`, after `//` at any depth, with conditions `[@Name='value']`,
    /// `[number]` and `[self::Name or self::Name]`.
    fn find(&self, path: &str, from: usize) -> Result<Vec<usize>, String> {
        let unknown = || format!("the path {path:?} is not understood");
        let mut found = match path.starts_with('/') {
            true => vec![0],
            false => vec![self.around(from)],
        };
        let mut rest = path.trim();
        while !rest.is_empty() {
            let deep = rest.starts_with("//");
            rest = rest.trim_start_matches('/');
            let mut inside = false;
            let end = rest.find(|c| {
                inside = (inside || c == '[') && c != ']';
                c == '/' && !inside
            });
            let (step, tail) = rest.split_at(end.unwrap_or(rest.len()));
            rest = tail;
            let (name, conditions) = step.split_at(step.find('[').unwrap_or(step.len()));
            let mut next = Vec::new();
            for &at in &found {
                let mut matching: Vec<usize> = match deep {
                    true => self.below(at),
                    false => self.elements[at].children.clone(),
                };
                let local = name.rsplit(':').next().unwrap_or(name);
                matching.retain(|&k| name == "*" || self.elements[k].name == local);
                for condition in conditions.split('[').skip(1) {
                    let condition = condition
                        .trim()
                        .strip_suffix(']')
                        .ok_or_else(unknown)?
                        .trim();
                    if let Ok(number) = condition.parse::<usize>() {
                        matching = matching
                            .get(number.wrapping_sub(1))
                            .copied()
                            .into_iter()
                            .collect();
                    } else if let Some((name, value)) =
                        condition.strip_prefix('@').and_then(|c| c.split_once('='))
                    {
                        let value = value.trim().trim_matches(['"', '\'']);
                        matching.retain(|&k| self.elements[k].get(name.trim()) == Some(value));
                    } else {
                        let mut names = Vec::new();
                        for part in condition.split(" or ") {
                            names.push(part.trim().strip_prefix("self::").ok_or_else(unknown)?);
                        }
                        matching.retain(|&k| names.contains(&self.elements[k].name.as_str()));
                    }
                }
                next.extend(matching);
            }
            found = next;
        }
        found.retain(|&k| k != 0);
        Ok(found)
    }

    fn around(&self, element: usize) -> usize {
        let mut all = self.elements.iter();
        all.position(|other| other.children.contains(&element))
            .unwrap_or(0)
    }

    fn below(&self, element: usize) -> Vec<usize> {
        let mut all = Vec::new();
        let mut waiting = self.elements[element].children.clone();
        waiting.reverse();
        while let Some(next) = waiting.pop() {
            all.push(next);
            waiting.extend(self.elements[next].children.iter().rev());
        }
        all
    }

    /// An element with all in it as one text, by which equal ones are known.
    pub fn key(&self, element: usize) -> Result<String, String> {
        let mut key = String::new();
        let mut waiting = vec![(element, 0)];
        while let Some((next, depth)) = waiting.pop() {
            let here = &self.elements[next];
            key.push_str(&format!(
                "<{} {:?}>{}",
                here.name,
                here.attributes,
                here.text()
            ));
            if depth < DEPTH {
                waiting.extend(
                    self.children(next)?
                        .into_iter()
                        .map(|child| (child, depth + 1)),
                );
            }
        }
        Ok(key)
    }
}
