//! Determines which field of a file is u.

use super::Reader;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::ResultField;

/// Fields on one kind of entity, and the name of that kind.
pub(super) type Carried<'a> = (&'static str, &'a [ResultField]);
impl<'a> Reader<'a> {
    /// Every field of the file, as messages list them.
    fn listed(&self) -> String {
        let held = self.held;
        let on = |of: &'a [ResultField], what: &'static str| {
            let of = of.iter();
            of.map(move |f| match f.components {
                1 => format!("`{}` on {what}", f.name),
                n => format!("`{}` ({n} components) on {what}", f.name),
            })
        };
        let all = on(&held.on_points, "points")
            .chain(on(&held.on_cells, "cells"))
            .chain(on(&held.on_corners, "corners of cells"));
        let all: Vec<String> = all.collect();
        match all.is_empty() {
            true => "no field".into(),
            false => all.join(", "),
        }
    }

    /// The field that is named, else the only candidate, else the one with a usual name; and the entities that carry it.
    pub(super) fn field(
        &self,
        all: &[Carried<'a>],
        usual: &[&str],
    ) -> Result<(&'static str, &'a ResultField)> {
        let carried = || {
            let of = |&(on, fields): &Carried<'a>| fields.iter().map(move |field| (on, field));
            all.iter().flat_map(of)
        };
        let named = |name: &str| carried().filter(|(_, f)| f.name == name).collect();
        let wanted = || {
            let on: Vec<&str> = all.iter().map(|(on, _)| *on).collect();
            format!("a field with one number at {}", on.join(" or "))
        };
        let unread = &self.held.unread;
        let asked = self.options.field;
        if let Some(part) = unread
            .iter()
            .find(|p| asked.is_none_or(|name| p.name == name))
        {
            let what = format!("not everything in it was read: {part}");
            return Err(self.refuse(what, "name a field that is read by --field"));
        }
        let (on, field) = if let Some(name) = asked {
            let found: Vec<_> = named(name);
            match found[..] {
                [one] => one,
                [] => {
                    let what = match self.held.has(name) {
                        true => format!("`{name}` is not a field at {}", all[0].0),
                        false => format!("it has no field `{name}`"),
                    };
                    let remedy = format!("name {}; it has {}", wanted(), self.listed());
                    return Err(self.refuse(what, remedy));
                }
                _ => {
                    let what = format!("it has {} fields `{name}`", found.len());
                    return Err(self.refuse(what, "write only one of them, at one time"));
                }
            }
        } else {
            // Integers are labels.
            let fits = |(_, f): &(&str, &ResultField)| f.components == 1 && f.rest.is_none();
            let fitting: Vec<_> = carried().filter(fits).collect();
            let usual = usual.iter().find_map(|usual| {
                let mut found = fitting.iter().filter(|(_, f)| f.name == *usual);
                found.next().filter(|_| found.next().is_none())
            });
            match (&fitting[..], usual) {
                ([one], _) | (_, Some(one)) => *one,
                ([], _) => {
                    let what = format!("it has no field that can be u, but {}", self.listed());
                    return Err(self.refuse(what, format!("write {}", wanted())));
                }
                _ => {
                    let names = fitting.iter().map(|(_, f)| format!("`{}`", f.name));
                    let names = names.collect::<Vec<_>>().join(", ");
                    let what = format!("several of its fields can be u: {names}");
                    return Err(self.refuse(what, "name one by --field"));
                }
            }
        };
        if field.components != 1 {
            let (name, n) = (&field.name, field.components);
            let what = format!("`{name}` has {n} components, and u is one number");
            return Err(self.refuse(what, format!("name {}; it has {}", wanted(), self.listed())));
        }
        match field.values.iter().find(|value| !value.is_finite()) {
            None => Ok((on, field)),
            Some(value) => Err(self.refuse(
                format!("`{}` is {value} somewhere", field.name),
                "give a field of finite numbers",
            )),
        }
    }
}
