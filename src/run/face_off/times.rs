//! The times at which results of a face-off file are judged.

use serde::{Deserialize, Serialize};

/// The value in a file: all, `"last"`, or a list.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(try_from = "toml::Value", into = "serde_json::Value")]
pub enum Judged {
    /// Every time that a result has.
    #[default]
    All,
    /// The last of each result.
    Last,
    /// These.
    At(Vec<f64>),
}

impl TryFrom<toml::Value> for Judged {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, String> {
        let number = |value: &toml::Value| match value {
            toml::Value::Float(t) if t.is_finite() => Some(*t),
            toml::Value::Integer(t) => Some(*t as f64),
            _ => None,
        };
        let refused = || "times are \"all\", \"last\" or a list of different numbers".to_owned();
        let list = match &value {
            toml::Value::String(word) if word == "all" => return Ok(Judged::All),
            toml::Value::String(word) if word == "last" => return Ok(Judged::Last),
            toml::Value::Array(list) => list.iter().map(number).collect::<Option<Vec<f64>>>(),
            one => number(one).map(|t| vec![t]),
        };
        let mut list = list.filter(|list| !list.is_empty()).ok_or_else(refused)?;
        list.sort_by(f64::total_cmp);
        match list.windows(2).any(|pair| pair[0] == pair[1]) {
            true => Err(refused()),
            false => Ok(Judged::At(list)),
        }
    }
}

impl From<Judged> for serde_json::Value {
    fn from(judged: Judged) -> Self {
        match judged {
            Judged::All => "all".into(),
            Judged::Last => "last".into(),
            Judged::At(list) => list.into(),
        }
    }
}
