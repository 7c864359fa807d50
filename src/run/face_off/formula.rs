//! The formula under `exact` in a file: an expression of a scene in which parameters are substituted and `t` is the time.

use std::collections::BTreeMap;

use crate::engine::fill;
use faceoff_fem::scene::Expression;

/// A formula in x, y, z, t.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    text: String,
    /// Does it depend on the time?
    pub has_time: bool,
}

impl Formula {
    /// Checks a formula with these parameters; the error is a message.
    pub(super) fn new(text: &str, parameters: &BTreeMap<String, String>) -> Result<Self, String> {
        let mut formula = Formula {
            text: text.to_owned(),
            has_time: false,
        };
        let filled = formula.filled(parameters)?;
        // Of one character as well, so that columns stay the same.
        let in_place = replaced(&filled, "x");
        Expression::parse(&in_place).map_err(|e| {
            let what = e.what.replace("use x, y, z,", "use x, y, z, t,");
            format!("exact, character {}: {what} in `{filled}`", e.column)
        })?;
        formula.has_time = in_place != filled;
        Ok(formula)
    }

    /// A constant.
    pub(super) fn constant(value: f64) -> Self {
        Formula {
            text: format!("{value:?}"),
            has_time: false,
        }
    }

    /// Is a parameter of this name in it?
    pub fn uses(&self, name: &str) -> bool {
        self.text.contains(&format!("{{{name}}}"))
    }

    fn filled(&self, parameters: &BTreeMap<String, String>) -> Result<String, String> {
        let value = |name: &str| parameters.get(name).map(|value| format!("({value})"));
        fill(&self.text, value)
    }

    /// At a time, with the parameters of a level.
    ///
    /// # Errors
    /// A message on parameters with which it is not a valid formula.
    pub fn at(&self, parameters: &BTreeMap<String, String>, t: f64) -> Result<Expression, String> {
        let text = replaced(&self.filled(parameters)?, &format!("({t:?})"));
        Expression::parse(&text).map_err(|e| format!("exact: {} in `{text}`", e.what))
    }
}

/// The formula with the variable t replaced.
fn replaced(text: &str, by: &str) -> String {
    words(text, |word| (word == "t").then(|| by.to_owned()))
}

/// A formula with some of its names replaced; text in braces is kept.
pub fn words(text: &str, other: impl Fn(&str) -> Option<String>) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let mut out = String::new();
    let mut is_braced = false;
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = match is_word(first) {
            true => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (word, after) = rest.split_at(end);
        is_braced = (is_braced || word == "{") && word != "}";
        match other(word).filter(|_| !is_braced) {
            Some(text) => out += &text,
            None => out += word,
        }
        rest = after;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_is_a_variable_and_its_letter_is_not_taken_elsewhere() {
        let parameters = BTreeMap::from([("k".to_owned(), "2".to_owned())]);
        let of = |text: &str| Formula::new(text, &parameters);
        let f = of("exp(-{k}*t) + sqrt(x) + tan(0)").unwrap();
        assert!(f.has_time);
        let value = f.at(&parameters, 0.5).unwrap().value([4.0, 0.0, 0.0]);
        assert!((value - ((-1.0_f64).exp() + 2.0)).abs() < 1e-14);
        assert_eq!(
            f.at(&parameters, -1e-7).unwrap().value([0.0; 3]),
            2e-7_f64.exp()
        );
        assert!(!of("sqrt(x) + tan(y)").unwrap().has_time);
        let wrong = of("exp(-t*q)").unwrap_err();
        assert!(
            wrong.contains("character 8") && wrong.contains("z, t, pi"),
            "{wrong}"
        );
        assert!(of("{m}*t").is_err());
    }

    #[test]
    fn names_are_replaced_as_whole_words() {
        let other = |word: &str| (word == "k").then(|| "{k}".to_owned());
        assert_eq!(
            words("k*tank(k) + 2.5*k_0 - {k}*k", other),
            "{k}*tank({k}) + 2.5*k_0 - {k}*{k}"
        );
    }
}
