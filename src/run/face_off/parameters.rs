//! The values that commands get as `{NAME}`.

use std::collections::{BTreeMap, BTreeSet};

use super::level::Axis;
use super::tables::Reader;
use faceoff_mesh::error::Result;

impl Reader {
    /// The names of real parameters, which may be perturbed; an integer may be a count.
    pub(super) fn reals(&self, tables: &BTreeMap<String, toml::Value>) -> BTreeSet<String> {
        let is_real = |value: &toml::Value| match value {
            toml::Value::String(text) => text.contains(['.', 'e']) && text.parse::<f64>().is_ok(),
            other => other.is_float(),
        };
        let reals = tables.iter().filter(|(_, value)| match value {
            toml::Value::Array(values) => values.iter().any(is_real),
            one => is_real(one),
        });
        reals.map(|(name, _)| name.clone()).collect()
    }

    /// The values as text for commands, and the one that is a list.
    pub(super) fn parameters(
        &self,
        tables: BTreeMap<String, toml::Value>,
    ) -> Result<(BTreeMap<String, String>, Option<Axis>)> {
        let mut all = BTreeMap::new();
        let mut list: Option<Axis> = None;
        for (name, value) in tables {
            let toml::Value::Array(values) = value else {
                let value = self.parameter(&name, &value)?;
                all.insert(name, value);
                continue;
            };
            let place = format!("parameters.{name}");
            if let Some(other) = &list {
                let what = format!("{} and {name} are lists", other.name);
                let remedy = "keep one: an order is in one thing that goes to zero, and that may run together with n";
                return Err(self.refuse(&place, what, remedy));
            }
            let is_whole = values.iter().all(toml::Value::is_integer);
            let values = values.iter().map(|value| self.parameter(&name, value));
            let values = values.collect::<Result<Vec<_>>>()?;
            let found = Axis::of_list(&name, values, is_whole)
                .map_err(|(what, remedy)| self.refuse(&place, what, remedy))?;
            all.insert(name, found.values[0].clone());
            list = Some(found);
        }
        Ok((all, list))
    }

    /// As text for a command: numbers with the fewest digits that read back unchanged.
    fn parameter(&self, name: &str, value: &toml::Value) -> Result<String> {
        let place = format!("parameters.{name}");
        if ["mesh", "out", "n"].contains(&name) {
            let what = format!("{{{name}}} is a reserved name");
            return Err(self.refuse(&place, what, "give it another name"));
        }
        self.value_of(&place, value)
    }

    /// A number, a text, true or false.
    pub(super) fn value_of(&self, place: &str, value: &toml::Value) -> Result<String> {
        match value {
            toml::Value::String(text) => Ok(text.clone()),
            toml::Value::Integer(number) => Ok(number.to_string()),
            toml::Value::Boolean(is) => Ok(is.to_string()),
            toml::Value::Float(number) if number.is_finite() => Ok(match number.abs() {
                x if x != 0.0 && !(1e-5..1e15).contains(&x) => format!("{number:e}"),
                _ => number.to_string(),
            }),
            _ => {
                let what = "it is neither a finite number nor a text".to_owned();
                Err(self.refuse(place, what, "give a number, a text, true or false"))
            }
        }
    }
}
