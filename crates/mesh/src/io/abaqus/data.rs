//! The data lines that follow a keyword.

use super::model::{Element, Member};
use super::read::{Mode, Reader, fields};
use crate::error::Result;
use crate::io::scan::Scan;

impl Reader<'_> {
    pub fn data(&mut self, row: &Scan<'_>, text: &str) -> Result<()> {
        let fields = fields(text);
        let reals = |most: usize| -> Result<Vec<f64>> {
            let mut found: Vec<f64> = fields
                .iter()
                .take(most)
                .map(|field| real(row, field))
                .collect::<Result<_>>()?;
            found.resize(most, 0.0);
            Ok(found)
        };
        let mut mode = std::mem::replace(&mut self.mode, Mode::Other);
        match &mut mode {
            Mode::Heading => {}
            Mode::Other => return Err(row.error(format!("{text:?} belongs to no keyword"))),
            Mode::Nodes { set, system } => {
                let number = whole(row, fields[0])?;
                let mut point = [0.0; 3];
                for (x, field) in point.iter_mut().zip(fields.iter().skip(1)) {
                    *x = real(row, field)?;
                }
                let point = self.placed(point, *system);
                let part = self.part();
                part.numbers.push(number);
                part.points.push(point);
                if let Some(set) = set.and_then(|set| part.sets.get_mut(set)) {
                    set.members.push(Member::Number(None, number));
                }
            }
            Mode::Elements { of: None, .. } => {}
            Mode::Elements {
                of: Some((kind, shell)),
                set,
                open,
            } => {
                for field in fields.iter().filter(|field| !field.is_empty()) {
                    open.push(whole(row, field)?);
                }
                if open.len() > kind.points() {
                    let number = open[0];
                    let nodes: Vec<u64> = open.drain(1..).collect();
                    open.clear();
                    if nodes.len() != kind.points() {
                        return Err(row.error(format!(
                            "element {number} has {} nodes, and a {kind} has {}",
                            nodes.len(),
                            kind.points()
                        )));
                    }
                    let (kind, shell) = (*kind, *shell);
                    let part = self.part();
                    part.elements.push(Element {
                        number,
                        kind,
                        shell,
                        nodes,
                    });
                    if let Some(set) = set.and_then(|set| part.sets.get_mut(set)) {
                        set.members.push(Member::Number(None, number));
                    }
                }
            }
            Mode::Set {
                set,
                generate,
                instance,
            } => {
                let mut members = Vec::new();
                if *generate {
                    let numbers: Vec<u64> = fields
                        .iter()
                        .filter(|field| !field.is_empty())
                        .map(|field| whole(row, field))
                        .collect::<Result<_>>()?;
                    let range = match numbers[..] {
                        [first, last] => [first, last, 1],
                        [first, last, step] => [first, last, step.max(1)],
                        _ => {
                            return Err(row.error(
                                "a generated set has a first number, a last one and a step",
                            ));
                        }
                    };
                    members.push(Member::Range(instance.clone(), range));
                } else {
                    let named = fields.iter().filter(|field| !field.is_empty());
                    members.extend(named.map(|field| member(field, instance.as_ref())));
                }
                if let Some(set) = self.part().sets.get_mut(*set) {
                    set.members.extend(members);
                }
            }
            Mode::Surface { surface } => {
                let side = fields
                    .get(1)
                    .copied()
                    .unwrap_or_default()
                    .to_ascii_uppercase();
                if let Some(surface) = self.part().surfaces.get_mut(*surface) {
                    surface.sides.push((member(fields[0], None), side));
                }
            }
            Mode::Instance { rows } => {
                if let Some(instance) = self.model.instances.last_mut() {
                    match *rows {
                        0 => instance.shift.copy_from_slice(&reals(3)?),
                        1 => instance.turn = reals(7)?.try_into().ok(),
                        _ => return Err(row.error("an instance has at most two lines")),
                    }
                }
                *rows += 1;
            }
            Mode::System { rows } => {
                let row = reals(6)?;
                let (a, b) = ([row[0], row[1], row[2]], [row[3], row[4], row[5]]);
                match (*rows, &mut self.origin) {
                    (0, _) if text.is_empty() => {}
                    (0, origin) => *origin = Some([a, b, [a[0], a[1] + 1.0, a[2]]]),
                    (_, Some(origin)) if !text.is_empty() => origin[2] = a,
                    _ => {}
                }
                *rows += 1;
            }
        }
        self.mode = mode;
        Ok(())
    }

    /// The place of a point that is given in cylindrical (C), spherical (S) or straight coordinates of the current system.
    fn placed(&self, [a, b, c]: [f64; 3], system: u8) -> [f64; 3] {
        let (sin, cos) = b.to_radians().sin_cos();
        let (rise, run) = c.to_radians().sin_cos();
        let local = match system {
            b'C' => [a * cos, a * sin, c],
            b'S' => [a * cos * run, a * sin * run, a * rise],
            _ => [a, b, c],
        };
        let Some([o, x, y]) = self
            .origin
            .map(|system| system.map(nalgebra::Vector3::from))
        else {
            return local;
        };
        let axis = (x - o).try_normalize(0.0).unwrap_or(nalgebra::Vector3::x());
        let up = axis
            .cross(&(y - o))
            .try_normalize(0.0)
            .unwrap_or(nalgebra::Vector3::z());
        let across = up.cross(&axis);
        (o + axis * local[0] + across * local[1] + up * local[2]).into()
    }
}

/// A number or a name, which may begin with that of an instance.
fn member(text: &str, instance: Option<&String>) -> Member {
    let text = text.trim_matches('"');
    if let Ok(number) = text.parse() {
        return Member::Number(instance.cloned(), number);
    }
    match text.rsplit_once('.') {
        Some((of, number)) if number.parse::<u64>().is_ok() => {
            Member::Number(Some(of.to_ascii_uppercase()), number.parse().unwrap_or(0))
        }
        Some((of, set)) if instance.is_none() => {
            Member::Set(Some(of.to_ascii_uppercase()), set.to_ascii_uppercase())
        }
        _ => Member::Set(instance.cloned(), text.to_ascii_uppercase()),
    }
}

fn real(row: &Scan<'_>, text: &str) -> Result<f64> {
    let value = match text {
        "" => Some(0.0),
        text => text
            .parse()
            .or_else(|_| text.replace(['D', 'd'], "e").parse())
            .ok(),
    };
    let finite = value.filter(|value: &f64| value.is_finite());
    finite.ok_or_else(|| row.error(format!("expected a number, found {text:?}")))
}

fn whole(row: &Scan<'_>, text: &str) -> Result<u64> {
    text.parse()
        .map_err(|_| row.error(format!("expected an integer, found {text:?}")))
}
